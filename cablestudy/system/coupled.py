"""Cables, bodies and junctions of a suspension about its equilibrium as one `LinearSystem`.

Its coordinates are those of all cables, one cable after the other, and then the free displacements of the bodies and
junctions, x y z and small rotations about global axes at the reference points. An end at r from the reference point of
its body moves by [I, -[r x]] times the body's displacements. To the end stiffness of the cables the bodies add

    [0, 0; 0, -sum [F x][r x] - [W x][r_G x]],

F being the forces of cables and links on a body and W its weight with the arm r_G (`tangent`), and their mass
matrices. Links add stiffness and damping between bodies, and no coordinates.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.cable.records import with_computed
from cablestudy.statics import block_stiffness
from cablestudy.statics.rigid import cross_matrix, point_movement
from cablestudy.statics.suspension import GROUND, Equilibrium
from cablestudy.system.assemble import assemble
from cablestudy.system.reduced import ReducedSystem
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class Layout:
    """Matrices of the bodies and links of a suspension, and the matrix that connects cable ends to bodies.

    They do not depend on how the cables are discretised, and are shared by all models of one equilibrium. Shapes have b
    bodies and points, d of whose 6 b displacements (x y z and small rotations) are free, c cables and l links.

    Attributes
    ----------
    equilibrium : Equilibrium
        Of one case, or of many, which are leading axes `...`; matrices of many are not sparse.
    """

    equilibrium: Equilibrium

    def take(self, index):
        """`Layout` of one case of many, or of some."""
        body_matrices = tuple(matrix[index] for matrix in self.body_matrices)
        arrays = {name: getattr(self, name)[index] for name in ("_all_connections", "mass", "moment_stiffness")}
        return with_computed(Layout(self.equilibrium.take(index)), body_matrices=body_matrices, **arrays)

    @property
    def shape(self):
        """Shape of the cases: () for one."""
        return self.equilibrium.position.shape[:-2]

    @cached_property
    def free(self):
        """Indices of the free displacements among all 6 b, shape (d,)."""
        return np.flatnonzero(self.equilibrium.suspension.free)

    @cached_property
    def large(self):
        """True if matrices are sparse."""
        return 6 * len(self.equilibrium.suspension.cable_names) * len(self.free) > SYSTEM.large_connection

    @cached_property
    def connection(self):
        """G: displacements of the six ends of all cables per free displacement, shape (..., 6 c, d), sparse or not."""
        return self._all_connections[..., : 6 * len(self.equilibrium.suspension.cable_names), :]

    @cached_property
    def link_connection(self):
        """Displacements of the six ends of all links per free displacement, shape (..., 6 l, d), sparse or not."""
        return self._all_connections[..., 6 * len(self.equilibrium.suspension.cable_names) :, :]

    @cached_property
    def _all_connections(self):
        """Displacements of both ends of all c cables, then of all l links, per free displacement.

        Shape (..., 6 (c + l), d); rows: x y z of end 1, then of end 2, of one line after the other; sparse for large
        suspensions. [-], [m]
        """
        owner, arms = self.equilibrium.suspension.owner, self.equilibrium.arms
        line, end = np.nonzero(owner != GROUND)  # index of the cable or link, and its end, of all ends on bodies
        blocks = point_movement(arms[..., line, end, :])
        rows = (6 * line + 3 * end)[:, None, None] + np.arange(3)[:, None]  # of x y z of each end
        columns = 6 * owner[line, end][:, None, None] + np.arange(6)  # of all displacements of its body
        if self.large:
            from scipy.sparse import coo_array

            free_index = block_stiffness.free_index(self.equilibrium.suspension.free).ravel()
            rows, columns = np.broadcast_arrays(rows, free_index[columns])
            entries = (columns >= 0) & (blocks != 0)
            shape = 6 * len(owner), len(self.free)
            return coo_array((blocks[entries], (rows[entries], columns[entries])), shape=shape).tocsr()
        matrix = np.zeros((*self.shape, 6 * len(owner), 6 * len(self.equilibrium.suspension.body_names)))
        matrix[..., rows, columns] = blocks
        return matrix.take(self.free, axis=-1)

    def _by_cable(self, connection):
        """A dense connection as one matrix for each cable or link, shape (..., c, 6, d)."""
        return connection.reshape(*self.shape, connection.shape[-2] // 6, 6, len(self.free))

    @cached_property
    def mass(self):
        """Mass matrices of the bodies at their reference points, global axes, shape (..., b, 6, 6).

        [kg, kg m, kg m^2]
        """
        suspension, rotation = self.equilibrium.suspension, self.equilibrium.rotation
        arm = cross_matrix((rotation * suspension.center[..., None, :]).sum(axis=-1))
        mass = np.asarray(suspension.mass)[..., None, None]
        inertia = rotation @ suspension.inertia @ np.swapaxes(rotation, -1, -2)
        matrix = np.zeros((*self.shape, rotation.shape[-3], 6, 6))
        matrix[..., :3, :3], matrix[..., :3, 3:] = mass * np.eye(3), -mass * arm
        matrix[..., 3:, :3], matrix[..., 3:, 3:] = mass * arm, inertia - mass * arm @ arm
        return matrix

    @cached_property
    def geometric_stiffness(self):
        """Stiffness of the bodies by the forces on them, symmetric part, shape (..., b, 6, 6). [N m]"""
        blocks = self.equilibrium.blocks.matrices
        of_bodies = blocks[..., blocks.shape[-3] - self.mass.shape[-3] :, :, :]  # the last ones
        return (of_bodies + np.swapaxes(of_bodies, -1, -2)) / 2

    @cached_property
    def moment_stiffness(self):
        """Stiffness of the free displacements by dead moments M on the bodies, shape (..., d, d); not symmetric.

        -[M x] / 2 of rotations: what `geometric_stiffness` leaves out, since all other forces balance M.
        """
        matrices = np.zeros((*self.shape, len(self.equilibrium.suspension.body_names), 6, 6))
        matrices[..., 3:, 3:] = -cross_matrix(self.equilibrium.suspension.moment) / 2
        return self.of_bodies(matrices)

    def of_bodies(self, matrices):
        """Matrix of the free displacements, shape (..., d, d), from one of each body, shape (..., b, 6, 6)."""
        bodies, suspension = np.arange(matrices.shape[-3]), self.equilibrium.suspension
        diagonal = block_stiffness.Blocks(bodies, bodies, matrices)
        matrix_of = block_stiffness.sparse if self.large else block_stiffness.dense
        return matrix_of(diagonal, suspension)

    def system(self, elements, imposed=None):
        """`LinearSystem` with some superelements of the cables.

        Parameters
        ----------
        elements : list of Superelement
        imposed : ndarray, shape (6 c, i), optional
            Displacements of the ends per movement of the winches.
        """
        stiffness, mass = self.body_matrices
        system = assemble(elements, self.connection, mass, imposed, stiffness)
        return system if self.equilibrium.links is None else system.with_damped_bodies(self.damping)

    def without_modes(self, stiffness, inertia):
        """`ReducedSystem` of bodies on cables without modes, from matrices of their six ends, shape (..., c, 6, 6)."""
        body_stiffness, body_mass = self.body_matrices
        stiffness, inertia = self.of_cables(stiffness) + body_stiffness, self.of_cables(inertia) + body_mass
        no_coupling = np.zeros((*self.shape, 0, len(self.free)))
        return ReducedSystem(no_coupling.sum(axis=-1), no_coupling, inertia, stiffness)

    @cached_property
    def body_matrices(self):
        """Stiffness of bodies and links, without cables, and mass matrix, for the free displacements, (..., d, d)."""
        stiffness, links = self.of_bodies(self.geometric_stiffness), self.equilibrium.links
        stiffness = stiffness if links is None else stiffness + self._of_links(links.end_stiffness)
        return stiffness, self.of_bodies(self.mass)

    @cached_property
    def damping(self):
        """Damping of the links for the free displacements, shape (..., d, d); 0 without. [N s/m, N s; N s, N m s]"""
        links = self.equilibrium.links
        return np.zeros(()) if links is None else self._of_links(links.end_damping)

    @property
    def elongation(self):
        """Change of the distance of the ends of each link per free displacement, shape (l, d), of one case."""
        first, second = np.split(self._by_cable(dense(self.link_connection)), 2, axis=-2)
        return (self.equilibrium.links.direction[..., None] * (second - first)).sum(axis=-2)

    def of_cables(self, matrices):
        """Sum over the cables of matrices of their six ends, for the free displacements, shape (..., d, d)."""
        return self._sum_at_bodies(self.connection, matrices)

    def _of_links(self, matrices):
        """Sum over the links for the free displacements, from matrices of end 2 of each, shape (..., l, 3, 3)."""
        signs = np.array([[1.0, -1.0], [-1.0, 1.0]])
        return self._sum_at_bodies(self.link_connection, np.kron(signs, matrices))

    def _sum_at_bodies(self, connection, matrices):
        """Sum of G_i^T A_i G_i over cables or links, G_i their connection and A_i matrices of their six ends."""
        if not self.large:
            return connection.swapaxes(-1, -2) @ (matrices @ self._by_cable(connection)).reshape(connection.shape)
        from scipy.sparse import bsr_array

        places = np.arange(len(matrices) + 1)
        return connection.T @ bsr_array((matrices, places[:-1], places)).tocsr() @ connection

    def momentum(self, coupling, cable):
        """Momentum of coordinates of the cables per velocity of the free displacements, shape (N, d).

        Parameters
        ----------
        coupling : ndarray, shape (N, 6)
            Per velocity of the ends. [sqrt(kg)]
        cable : ndarray of int, shape (N,)
            Of which cable each is, those of one case after the other.
        """
        if not self.large:
            by_cable = self._by_cable(self.connection)
            case, cable_of_case = np.divmod(cable, by_cable.shape[-3])
            return (coupling[:, None, :] @ by_cable[(case, cable_of_case) if self.shape else cable_of_case])[:, 0]
        from scipy.sparse import csr_array

        columns, row_ends = 6 * cable[:, None] + np.arange(6), 6 * np.arange(len(cable) + 1)
        shape = len(cable), self.connection.shape[0]
        return csr_array((coupling.ravel(), columns.ravel(), row_ends), shape) @ self.connection

    def bodies(self, shapes):
        """Free displacements of the bodies from shapes in all coordinates of the system, shape (d, r)."""
        return shapes[len(shapes) - len(self.free) :]

    def ends(self, displacements):
        """Displacements of the six ends of each cable, shape (..., c, 6, r), for free ones of shape (..., d, r)."""
        cables = len(self.equilibrium.suspension.cable_names)
        return (self.connection @ displacements).reshape(*displacements.shape[:-2], cables, 6, displacements.shape[-1])

    def holding_loads(self, elements, of_bodies, shapes, reeled=None):
        """Forces on all N coordinates that hold motions against loads which turn with them, shape (N, m + i).

        Parameters
        ----------
        elements : sequence of Superelement
            Of the c cables; those under such loads have a `load_stiffness`.
        of_bodies : ndarray, shape (d, d)
            Stiffness of the free displacements by loads on bodies.
        shapes : ndarray, shape (N, m)
            Motions of all coordinates.
        reeled : ndarray, shape (c, 6, i), optional
            Further motions, of ends of cables alone.
        """
        moved, count, first = self.bodies(shapes), shapes.shape[1], 0
        ends = self.ends(moved) if reeled is None else np.concatenate([self.ends(moved), reeled], axis=-1)
        forces, on_ends = np.zeros((len(shapes), ends.shape[-1])), np.zeros(ends.shape)
        for cable, element in enumerate(elements):
            modes = slice(first, first + len(element.omega))
            first = modes.stop
            if element.load_stiffness is not None:
                amplitudes = np.pad(shapes[modes], ((0, 0), (0, ends.shape[-1] - count)))
                held = element.load_stiffness @ np.concatenate([amplitudes, ends[cable]])
                forces[modes], on_ends[cable] = held[:-6], held[-6:]
        on_bodies = self.bodies(forces)  # a view
        on_bodies[:, :count] += of_bodies @ moved
        on_bodies += self.connection.T @ on_ends.reshape(6 * len(on_ends), on_ends.shape[-1])
        return forces

    def displaced(self, displacements):
        """Displacements of all bodies, held ones too, shape (b, 6, r), for free ones of shape (d, r)."""
        of_all = np.zeros((6 * len(self.equilibrium.suspension.body_names), displacements.shape[-1]))
        of_all[self.free] = displacements
        return of_all.reshape(len(of_all) // 6, 6, displacements.shape[-1])  # maybe of no columns

    def moving_mass(self, displacements):
        """Share of each body's displacements in the kinetic energy of mass-normalised motions, shape (b, 6, r). [-]

        x y z of the center of mass, then the rotations about the body's axes.
        """
        suspension, rotation = self.equilibrium.suspension, self.equilibrium.rotation
        of_all = self.displaced(displacements)
        arm = cross_matrix((rotation * suspension.center[..., None, :]).sum(axis=-1))
        center = of_all[:, :3] - arm @ of_all[:, 3:]
        body_rotation = np.swapaxes(rotation, -1, -2) @ of_all[:, 3:]
        of_translation = np.asarray(suspension.mass)[:, None, None] * center**2
        return np.concatenate([of_translation, body_rotation * (suspension.inertia @ body_rotation)], axis=1)
