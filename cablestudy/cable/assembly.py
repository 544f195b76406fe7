"""Elements -> the tangent of a whole cable, its compliance from the forces that each Gauss point carries.

A cable is statically determinate but for one force: with loads f on its nodes the tension vector at the Gauss points is
N = c - S f, where S, the same for every cable with so many elements of an order, adds up the loads nearer to end 1, and
c is constant along the cable. The elements' gradient r' answers by the local compliance

    A = |r'|/T (I - t t^T) + 1/EA t t^T,

the inverse of K_G + K_E at that point. The ends at rest give c: sum of w A (c - S f) = 0, with the weights w of the
points; and S^T, the same by virtual work, adds the gradients up to displacements. So

    K^-1 = (S - m)^T w A (S - m),    m = (sum of w A)^-1 (sum of w A S),    end stiffness = (sum of w A)^-1:

sums of positive terms, in which EA appears only as its inverse. Nothing of the size of the cable is factorised, and an
almost inextensible cable is as well conditioned as an elastic one. Lengths are counted in unstretched lengths and
forces in a reference force.

Every array may have leading axes, one entry for each cable: they share a mesh. No sum runs over cables.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cablestudy.cable.element import Mesh, basis, highest, mass_matrix

IN_PLANE, OUT_OF_PLANE, SPATIAL = (0, 1), (2,), (0, 1, 2)


@dataclass(frozen=True)
class State:
    """A cable in equilibrium, at the Gauss points and nodes of a mesh, or many on one mesh; chord frame.

    Attributes
    ----------
    mesh : Mesh
    direction : ndarray, shape (..., n, q, 3)
        Unit tangent. [-]
    tension : ndarray, shape (..., n, q)
        In units of `force`. [-]
    stretch : ndarray, shape (..., n, q)
        |r'|. [-]
    displacement : ndarray, shape (..., nodes, 3)
        Of the nodes from the straight chord, in unstretched lengths. [-]
    compliance : float or ndarray, shape (...)
        force / EA. [-]
    force : float or ndarray, shape (...)
        Reference force. [N]
    mirror_symmetric : bool
        Whether each cable, with its elements, is its own mirror image at mid-length.
    """

    mesh: Mesh
    direction: np.ndarray
    tension: np.ndarray
    stretch: np.ndarray
    displacement: np.ndarray
    compliance: np.ndarray
    force: np.ndarray
    mirror_symmetric: bool

    def take(self, index):
        """One cable of many, or some of them."""
        fields = (self.direction, self.tension, self.stretch, self.displacement, self.compliance, self.force)
        return State(self.mesh, *(field[index] for field in fields), self.mirror_symmetric)


@lru_cache(maxsize=128)
def element_force_transfer(order):
    """Share of a force on each inner node of an element that its Gauss points carry less, shape (q, order - 1). [-]

    Of the polynomial that is in equilibrium with it, end 1 of the element being free.
    """
    element = basis(order)
    rows = (element.weights[:, None] * element.derivative[:, :-1]).T
    return -np.linalg.solve(rows, np.eye(order)[:, 1:])


def static_force_transfer(mesh, forces):
    """S f: what the Gauss points carry less for forces on the inner nodes, end 1 being free.

    Parameters
    ----------
    mesh : Mesh
    forces : ndarray, shape (..., nodes - 2, r)

    Returns
    -------
    ndarray, shape (..., n q, r)
    """
    n, p, shape = mesh.elements, mesh.order, forces.shape
    padded = np.zeros((*shape[:-2], n * p, shape[-1]))
    padded[..., 1:, :] = forces
    padded = padded.reshape(*shape[:-2], n, p, shape[-1])
    passed = np.cumsum(padded.sum(axis=-2), axis=-2)
    passed = np.concatenate([np.zeros_like(passed[..., :1, :]), passed[..., :-1, :]], axis=-2) + padded[..., 0, :]
    points = passed[..., None, :] + element_force_transfer(p) @ padded[..., 1:, :]
    return points.reshape(*shape[:-2], n * p, shape[-1])


def static_force_transfer_of_axes(mesh, axes, forces):
    """The same for forces of all directions in one column, shape (..., dof, r); it is of shape (..., n q, d, r)."""
    *lead, _, count = forces.shape
    points = static_force_transfer(mesh, forces.reshape(*lead, mesh.nodes - 2, axes * count))
    return points.reshape(*points.shape[:-1], axes, count)


def transposed_force_transfer(mesh, weighted):
    """S^T w e: how far the inner nodes stay behind end 2 for gradients e times weights w.

    Parameters
    ----------
    mesh : Mesh
    weighted : ndarray, shape (..., n q, r)

    Returns
    -------
    ndarray, shape (..., nodes - 2, r)
    """
    n, p, shape = mesh.elements, mesh.order, weighted.shape
    parts = weighted.reshape(*shape[:-2], n, p, shape[-1])
    whole = parts.sum(axis=-2)
    ahead = np.cumsum(whole[..., ::-1, :], axis=-2)[..., ::-1, :]  # from the element's end 1 on
    behind = np.concatenate([ahead[..., 1:, :], np.zeros_like(ahead[..., :1, :])], axis=-2)
    inner = behind[..., None, :] + element_force_transfer(p).T @ parts
    nodes = np.concatenate([ahead[..., None, :], inner], axis=-2)
    return nodes.reshape(*shape[:-2], n * p, shape[-1])[..., 1:, :]


def local_compliance(t, along, across):
    """along t t^T + across (I - t t^T) for unit vectors t in two or three dimensions, without a difference.

    Parameters
    ----------
    t : ndarray, shape (..., d)
    along, across : ndarray, shape (...)

    Returns
    -------
    ndarray, shape (..., d, d)
    """
    products = t[..., :, None] * t[..., None, :]
    matrix = (along - across)[..., None, None] * products
    squares = t**2
    for i in range(t.shape[-1]):
        others = squares[..., [j for j in range(t.shape[-1]) if j != i]].sum(axis=-1)
        matrix[..., i, i] = along * squares[..., i] + across * others
    return matrix


def joined(field):
    """The second and third last axes as one."""
    return field.reshape(*field.shape[:-3], field.shape[-3] * field.shape[-2], field.shape[-1])


def inverse(matrix):
    """Inverse of symmetric positive definite matrices, shape (..., d, d), scaled to a unit diagonal first."""
    root = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    scale = root[..., :, None] * root[..., None, :]
    return np.linalg.inv(matrix / scale) / scale


@dataclass(frozen=True)
class System:
    """The tangent of a cable about a state, in some of the three directions.

    Attributes
    ----------
    state : State
    axes : tuple of int
        Which components of the chord frame: IN_PLANE, OUT_OF_PLANE or SPATIAL.
    """

    state: State
    axes: tuple

    def take(self, index):
        """That of one cable of many, with what its ends feel, which is computed for all of them at once."""
        one = System(self.state.take(index), self.axes)
        for name in ("tangent", "compliance", "end_stiffness", "end_shapes"):
            one.__dict__[name] = getattr(self, name)[index]
        return one

    @property
    def dof(self):
        """Number of free displacements. [-]"""
        return (self.state.mesh.nodes - 2) * len(self.axes)

    @cached_property
    def weights(self):
        """Share of the unstretched length of each Gauss point, shape (n q,). [-]"""
        return self.state.mesh.point_weights.ravel()

    @cached_property
    def tangent(self):
        """Unit tangent at the Gauss points, shape (..., n q, d). [-]"""
        direction = self.state.direction
        return direction.reshape(*direction.shape[:-3], -1, 3)[..., self.axes]

    @cached_property
    def local_flexibility(self):
        """Gradient per force along and across the cable at the Gauss points, shapes (..., 1) and (..., n q). [-]"""
        state = self.state
        across = state.stretch / state.tension
        return np.asarray(state.compliance)[..., None], across.reshape(*across.shape[:-2], -1)

    @cached_property
    def frame(self):
        """Orthonormal directions at the Gauss points, the tangent first where d > 1, shape (..., n q, d, d). [-]"""
        return _frame(self.tangent)

    @cached_property
    def weighted_flexibility(self):
        """w times the gradient per force along each of them, shape (..., n q, d). [-]"""
        along, across = self.local_flexibility
        flexibility = np.repeat((self.weights * across)[..., None], len(self.axes), axis=-1)
        if len(self.axes) > 1:
            flexibility[..., 0] = self.weights * along
        return flexibility

    @cached_property
    def compliance(self):
        """w A at the Gauss points, shape (..., n q, d, d). [-]"""
        along, across = self.local_flexibility
        if len(self.axes) == 1:  # across its plane
            return (self.weights * across)[..., None, None]
        return local_compliance(self.tangent, self.weights * along, self.weights * across)

    @cached_property
    def end_stiffness(self):
        """Condensed stiffness of end 2, end 1 fixed, shape (..., d, d). [-]"""
        return inverse(self.compliance.sum(axis=-3))

    @cached_property
    def end_shapes(self):
        """Static shapes for unit movements of end 2, shape (..., nodes, d, d). [-]"""
        axes, mesh = len(self.axes), self.state.mesh
        strained = _times(self.compliance, self.end_stiffness[..., None, :, :])
        behind = transposed_force_transfer(mesh, strained.reshape(*strained.shape[:-2], -1))
        shapes = np.zeros((*strained.shape[:-3], mesh.nodes, axes, axes))
        shapes[..., 1:-1, :, :] = np.eye(axes) - behind.reshape(*behind.shape[:-1], axes, axes)
        shapes[..., -1, :, :] = np.eye(axes)
        return shapes

    def solve(self, forces):
        """Interior displacements under nodal forces, ends held.

        Parameters
        ----------
        forces : ndarray, shape (..., dof, r)

        Returns
        -------
        ndarray, shape (..., dof, r)
        """
        mesh, count, compliance = self.state.mesh, forces.shape[-1], self.compliance
        transferred = static_force_transfer_of_axes(mesh, len(self.axes), forces)
        mean = self.end_stiffness @ _times(compliance, transferred).sum(axis=-3)
        strained = _times(compliance, mean[..., None, :, :] - transferred)
        moved = -transposed_force_transfer(mesh, strained.reshape(*strained.shape[:-2], -1))
        return moved.reshape(*moved.shape[:-2], self.dof, count)

    def root(self, transferred, points=slice(None)):
        """B f with K^-1 = B^T B, for forces f that are the same on each cable.

        Parameters
        ----------
        transferred : ndarray, shape (n q, d, r)
            S f.
        points : slice
            Of which Gauss points: all.

        Returns
        -------
        ndarray, shape (..., points d, r)
        """
        *lead, count, d, _ = self.compliance.shape
        each = self.compliance.swapaxes(-3, -2).reshape(*lead, d, count * d)
        mean = self.end_stiffness @ (each @ joined(transferred))
        root = self.frame[..., points, :, :] @ (transferred[points] - mean[..., None, :, :])
        root *= np.sqrt(self.weighted_flexibility[..., points, :])[..., None]
        return joined(root)

    def modal_energies(self, shapes):
        """Twice the elastic and the geometric energy of displacement shapes.

        Sums of squares: nothing cancels, however stiff the cable.

        Parameters
        ----------
        shapes : ndarray, shape (..., nodes, d, r)

        Returns
        -------
        elastic, geometric : ndarray, shape (..., r)
        """
        squares = self.frame @ self._gradient(shapes)
        squares *= squares
        stiff = self.weights[:, None] ** 2 / self.weighted_flexibility
        if len(self.axes) == 1:
            geometric = _weighed(stiff, squares)
            return 0.0 * geometric, geometric
        along = np.arange(len(self.axes)) == 0
        return _weighed(along * stiff, squares), _weighed(~along * stiff, squares)

    def highest_energy(self, shapes):
        """What the two highest polynomials of each element contribute to the energies of displacement shapes.

        The larger of twice the complementary energy of that part of the tensions, and of the geometric energy of that
        part of the gradient: neither is stiff where the cable is.

        Parameters
        ----------
        shapes : ndarray, shape (..., nodes, d, r)

        Returns
        -------
        ndarray, shape (..., r)
        """
        gradient, frame = self._gradient(shapes), self.frame
        force = frame.swapaxes(-1, -2) @ (
            (self.weights[:, None] / self.weighted_flexibility)[..., None] * (frame @ gradient)
        )
        strained, turned = frame @ self._highest(force), self._highest(gradient)
        stiff = np.repeat(self.weights[:, None] ** 2 / self.weighted_flexibility[..., -1:], len(self.axes), axis=-1)
        return np.maximum(_weighed(self.weighted_flexibility, strained**2), _weighed(stiff, turned**2))

    def _highest(self, field):
        """What the two highest polynomials of each element have of a field at the Gauss points."""
        mesh, (*lead, _, d, r) = self.state.mesh, field.shape
        parts = field.reshape(*lead, mesh.elements, mesh.order, d * r)
        return (highest(mesh.order) @ parts).reshape(field.shape)

    def elastic_energy(self, shapes):
        """Twice the elastic energy of displacement shapes and of their products, shape (..., r, r)."""
        along = (self.tangent[..., None] * self._gradient(shapes)).sum(axis=-2)
        weighted = self.weights[:, None] / self.local_flexibility[0][..., None] * along
        return weighted.swapaxes(-1, -2) @ along

    def _gradient(self, shapes):
        """Gradient of shapes at the Gauss points, shape (..., n q, d, r)."""
        mesh, lead, rest = self.state.mesh, shapes.shape[:-3], shapes.shape[-2:]
        flat = shapes.reshape(*lead, mesh.nodes, rest[0] * rest[1])
        # the nodes of one element after the other, the last of one being the first of the next
        parts = sliding_window_view(flat, mesh.order + 1, axis=-2)[..., :: mesh.order, :, :].swapaxes(-1, -2)
        gradient = basis(mesh.order).derivative / mesh.sizes[:, None, None] @ parts
        return gradient.reshape(*lead, len(self.weights), *rest)

    @property
    def mass(self):
        """Sparse mass matrix of the interior for a cable of unit mass, shape (dof, dof). [-]"""
        return masses(self.state.mesh, len(self.axes))[1]

    def full_mass(self):
        """Sparse mass matrix of all nodes for a cable of unit mass, shape (nodes d, nodes d). [-]"""
        return masses(self.state.mesh, len(self.axes))[0]


def _times(matrices, vectors):
    """Products of many small matrices, shape (..., d, d), with (..., d, r): faster than one after the other."""
    return (matrices[..., None] * vectors[..., None, :, :]).sum(axis=-2)


def _weighed(weights, field):
    """Sum of weights, shape (..., n q, d), times a field, shape (..., n q, d, r)."""
    return (weights.reshape(*weights.shape[:-2], 1, -1) @ joined(field))[..., 0, :]


def _frame(tangent):
    """Orthonormal directions at each point, the tangent first, shape (..., d, d)."""
    d = tangent.shape[-1]
    if d == 1:
        return np.ones((*tangent.shape, 1))
    if d == 2:
        return np.stack([tangent, np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)], axis=-2)
    least = np.eye(3)[np.argmin(np.abs(tangent), axis=-1)]
    first = np.cross(tangent, least)
    first /= np.sqrt((first**2).sum(axis=-1, keepdims=True))
    return np.stack([tangent, first, np.cross(tangent, first)], axis=-2)


@lru_cache(maxsize=32)
def masses(mesh, axes):
    """Sparse mass matrices of a cable of unit mass: all nodes, and the interior. [-]

    Parameters
    ----------
    mesh : Mesh
    axes : int
        Components d of a node.

    Returns
    -------
    whole, interior : sparse arrays
        (nodes d, nodes d), (dof, dof).
    """
    per_node = mass_matrix(mesh.order, mesh.mass)
    whole = _sparse(mesh, axes, mesh.sizes[:, None, None] * np.kron(per_node, np.eye(axes)))
    return whole, whole[axes:-axes, axes:-axes]


def _sparse(mesh, axes, blocks):
    """Element blocks summed into a sparse array of all nodes."""
    from scipy.sparse import coo_array

    index = np.arange(mesh.elements)[:, None] * mesh.order * axes + np.arange((mesh.order + 1) * axes)
    rows = np.repeat(index, index.shape[1], axis=1).ravel()
    columns = np.tile(index, (1, index.shape[1])).ravel()
    total = mesh.nodes * axes
    matrix = coo_array((blocks.ravel(), (rows, columns)), shape=(total, total)).tocsr()
    matrix.eliminate_zeros()
    return matrix
