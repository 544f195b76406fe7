"""Cables, bodies and junctions of a suspension about its equilibrium as one `LinearSystem`.

Its coordinates are those of all cables, one cable after the other, and then the free displacements of the bodies and
junctions, x y z and small rotations about global axes at the reference points. An end at r from the reference point of
its body moves by B = [I, -[r x]] times the body's displacements. To the end stiffness of the cables the bodies add

    [0, 0; 0, -sum [F x][r x] - [W x][r_G x]],

F being the forces of cables and links on them and W their weight with its arm r_G (`tangent`), and their own mass.
Links add stiffness and damping of the bodies and no coordinates.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.system import tangent
from cablestudy.system.linear import ReducedSystem, assemble, dense
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import GROUND, Equilibrium
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class Layout:
    """Part of the linear model that does not depend on the cables' models.

    Attributes
    ----------
    equilibrium : Equilibrium
        Of one case, or of many, which are leading axes `...`; matrices of many are not sparse.
    """

    equilibrium: Equilibrium

    def take(self, index):
        """That of one case of many, or of some."""
        some = Layout(self.equilibrium.take(index))
        some.__dict__.update(_ends_moved=self._ends_moved[index], own=tuple(part[index] for part in self.own))
        return some

    @property
    def shape(self):
        """Shape of the cases: () for one."""
        return self.equilibrium.position.shape[:-2]

    @cached_property
    def free(self):
        """Places of the free displacements among all 6 b, shape (d,)."""
        return np.flatnonzero(self.equilibrium.suspension.free)

    @cached_property
    def large(self):
        """True if matrices are sparse."""
        return 6 * len(self.equilibrium.suspension.cable_names) * len(self.free) > SYSTEM.large_connection

    @cached_property
    def moved(self):
        """G: displacements of the six ends of all cables per free displacement, shape (..., 6 c, d), sparse or not."""
        return self._ends_moved[..., : 6 * len(self.equilibrium.suspension.cable_names), :]

    @cached_property
    def links_moved(self):
        """Displacements of the six ends of all links per free displacement, shape (..., 6 l, d), sparse or not."""
        return self._ends_moved[..., 6 * len(self.equilibrium.suspension.cable_names) :, :]

    @cached_property
    def _ends_moved(self):
        """Those of the ends of all cables, then of all links, sparse or not."""
        owner, arms = self.equilibrium.suspension.owner, self.equilibrium.arms
        cable, end = np.nonzero(owner != GROUND)
        turned = -cross_matrix(arms[..., cable, end, :])
        blocks = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned], axis=-1)
        rows = (6 * cable + 3 * end)[:, None, None] + np.arange(3)[:, None] + np.zeros(6, dtype=int)
        columns = 6 * owner[cable, end][:, None, None] + np.arange(6) + np.zeros((3, 1), dtype=int)
        if self.large:
            from scipy.sparse import coo_array

            number = np.full(6 * len(self.equilibrium.suspension.body_names), -1)
            number[self.free] = np.arange(len(self.free))
            columns = number[columns]
            there = (columns >= 0) & (blocks != 0)
            shape = 6 * len(owner), len(self.free)
            return coo_array((blocks[there], (rows[there], columns[there])), shape=shape).tocsr()
        whole = np.zeros((*self.shape, 6 * len(owner), 6 * len(self.equilibrium.suspension.body_names)))
        whole[..., rows, columns] = blocks
        return whole.take(self.free, axis=-1)

    def _each(self, moved):
        """Displacements of ends for each cable or link, shape (..., c, 6, d); not for sparse matrices."""
        return moved.reshape(*self.shape, moved.shape[-2] // 6, 6, len(self.free))

    @cached_property
    def mass(self):
        """Mass matrices of the bodies at their reference points, global axes, shape (..., b, 6, 6).

        [kg, kg m, kg m^2]
        """
        suspension, rotation = self.equilibrium.suspension, self.equilibrium.rotation
        arm = cross_matrix((rotation * suspension.center[..., None, :]).sum(axis=-1))
        mass = np.asarray(suspension.mass)[..., None, None]
        inertia = rotation @ suspension.inertia @ np.swapaxes(rotation, -1, -2)
        whole = np.zeros((*self.shape, rotation.shape[-3], 6, 6))
        whole[..., :3, :3], whole[..., :3, 3:] = mass * np.eye(3), -mass * arm
        whole[..., 3:, :3], whole[..., 3:, 3:] = mass * arm, inertia - mass * arm @ arm
        return whole

    @cached_property
    def geometric_stiffness(self):
        """Of the bodies, by the forces on them, symmetric part, shape (..., b, 6, 6). [N m]"""
        blocks = self.equilibrium.blocks.matrices
        blocks = blocks[..., blocks.shape[-3] - self.mass.shape[-3] :, :, :]
        return (blocks + np.swapaxes(blocks, -1, -2)) / 2

    def of_bodies(self, blocks):
        """A matrix of the free displacements from one of each body, shape (..., d, d)."""
        own = np.arange(blocks.shape[-3])
        diagonal = tangent.Blocks(own, own, blocks)
        suspension = self.equilibrium.suspension
        return tangent.sparse(diagonal, suspension) if self.large else tangent.dense(diagonal, suspension)

    def system(self, elements, imposed=None):
        """`LinearSystem` with some superelements of the cables.

        Parameters
        ----------
        elements : list of Superelement
        imposed : ndarray, shape (6 c, i), optional
            Displacements of the ends per movement of the winches.

        Returns
        -------
        LinearSystem
        """
        stiffness, mass = self.own
        whole = assemble(elements, self.moved, mass, imposed, stiffness)
        return whole if self.equilibrium.links is None else whole.with_damped_bodies(self.damping)

    def without_modes(self, stiffness, inertia):
        """`ReducedSystem` of bodies on cables without modes, from matrices of their six ends, shape (..., c, 6, 6)."""
        own_stiffness, own_mass = self.own
        stiffness, inertia = self.of_cables(stiffness) + own_stiffness, self.of_cables(inertia) + own_mass
        none = np.zeros((*self.shape, 0, len(self.free)))
        return ReducedSystem(none.sum(axis=-1), none, inertia, stiffness)

    @cached_property
    def own(self):
        """Stiffness of bodies and links, without cables, and mass matrix, for the free displacements, (..., d, d)."""
        stiffness, links = self.of_bodies(self.geometric_stiffness), self.equilibrium.links
        stiffness = stiffness if links is None else stiffness + self._of_links(links.end_stiffness)
        return stiffness, self.of_bodies(self.mass)

    @cached_property
    def damping(self):
        """Of the links, for the free displacements, shape (..., d, d); 0 without. [N s/m, N s; N s, N m s]"""
        links = self.equilibrium.links
        return np.zeros(()) if links is None else self._of_links(links.end_damping)

    @property
    def elongation(self):
        """Change of the distance of the ends of each link per free displacement, shape (l, d), of one case."""
        first, second = np.split(self._each(dense(self.links_moved)), 2, axis=-2)
        return (self.equilibrium.links.direction[..., None] * (second - first)).sum(axis=-2)

    def of_cables(self, matrices):
        """Sum over the cables of matrices of their six ends, for the free displacements, shape (..., d, d)."""
        return self._summed(self.moved, matrices)

    def _of_links(self, matrices):
        """Such a sum over the links, from matrices of end 2 of each, shape (..., l, 3, 3)."""
        signs = np.array([[1.0, -1.0], [-1.0, 1.0]])
        return self._summed(self.links_moved, np.kron(signs, matrices))

    def _summed(self, moved, matrices):
        if not self.large:
            return moved.swapaxes(-1, -2) @ (matrices @ self._each(moved)).reshape(moved.shape)
        from scipy.sparse import block_diag

        return moved.T @ block_diag(matrices, format="csr") @ moved

    def driven(self, coupling, cable):
        """Momentum of coordinates of the cables per velocity of the free displacements, shape (N, d).

        Parameters
        ----------
        coupling : ndarray, shape (N, 6)
            Per velocity of the ends. [sqrt(kg)]
        cable : ndarray of int, shape (N,)
            Of which cable each is, those of one case after the other.
        """
        if not self.large:
            moved = self._each(self.moved)
            row, own = np.divmod(cable, moved.shape[-3])
            return (coupling[:, None, :] @ moved[(row, own) if self.shape else own])[:, 0]
        from scipy.sparse import csr_array

        columns = 6 * cable[:, None] + np.arange(6)
        rows = 6 * np.arange(len(cable) + 1)
        return csr_array((coupling.ravel(), columns.ravel(), rows), (len(cable), self.moved.shape[0])) @ self.moved

    def bodies(self, shapes):
        """The free displacements in the coordinates of the system, shape (d, r)."""
        return shapes[len(shapes) - len(self.free) :]

    def ends(self, displacements):
        """Displacements of the six ends of each cable, shape (..., c, 6, r), for free ones of shape (..., d, r)."""
        return (self.moved @ displacements).reshape(*displacements.shape[:-2], -1, 6, displacements.shape[-1])

    def displaced(self, displacements):
        """Displacements of all bodies, held ones too, shape (b, 6, r), for free ones of shape (d, r)."""
        whole = np.zeros((6 * len(self.equilibrium.suspension.body_names), displacements.shape[-1]))
        whole[self.free] = displacements
        return whole.reshape(-1, 6, displacements.shape[-1])

    def kinetic(self, displacements):
        """Share of each body's displacements in the kinetic energy of mass-normalised motions, shape (b, 6, r). [-]

        x y z of the center of mass, then the rotations about the body's axes.
        """
        suspension, rotation = self.equilibrium.suspension, self.equilibrium.rotation
        whole = self.displaced(displacements)
        arm = cross_matrix((rotation * suspension.center[..., None, :]).sum(axis=-1))
        center = whole[:, :3] - arm @ whole[:, 3:]
        turned = np.swapaxes(rotation, -1, -2) @ whole[:, 3:]
        straight = np.asarray(suspension.mass)[:, None, None] * center**2
        return np.concatenate([straight, turned * (suspension.inertia @ turned)], axis=1)
