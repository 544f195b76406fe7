"""Linear response of a cable about a state by the force method: compliance, end stiffness, mass.

A cable has one static redundant, a vector: under nodal loads f the tension vector at the Gauss points is N = c - S f.
S depends on the mesh alone and sums the loads nearer to end 1; c is constant along the cable. The gradient r' changes
by the local compliance

    A = |r'|/T (I - t t^T) + 1/EA t t^T,

t being the unit tangent and T the tension: the inverse of the geometric and elastic stiffness K_G + K_E at that point.
Fixed ends determine c: sum of w A (c - S f) = 0 with the weights w of the points. By virtual work S^T sums gradients
to displacements, so that

    K^-1 = (S - m)^T w A (S - m),    m = (sum of w A)^-1 (sum of w A S),    end stiffness = (sum of w A)^-1.

These are sums of positive terms in which EA appears only as 1/EA: an almost inextensible cable is as well conditioned
as an elastic one, and no matrix of the size of the cable is factorised. The unit of lengths is the unstretched length,
that of forces a reference force (`State.force`). Source: Przemieniecki (1968), Theory of Matrix Structural Analysis,
chapter 8 (force method).

Shapes: n elements with q Gauss points each, d components of motion, dof = (nodes - 2) d free displacements. Arrays may
have leading axes, one entry for each cable of a batch on one mesh. No sum runs over cables.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from cablestudy.cable.element import basis, highest_projection, mass_matrix
from cablestudy.cable.records import with_computed
from cablestudy.cable.state import State

IN_PLANE, OUT_OF_PLANE, SPATIAL = (0, 1), (2,), (0, 1, 2)


@lru_cache(maxsize=128)
def element_force_transfer(order):
    """Block of S of one element: for unit forces on its inner nodes, end 1 free, shape (q, order - 1). [-]"""
    element = basis(order)
    equilibrium_rows = (element.weights[:, None] * element.derivative[:, :-1]).T  # one for each node but the last
    return -np.linalg.solve(equilibrium_rows, np.eye(order)[:, 1:])


def static_force_transfer(mesh, forces):
    """S f: minus the tension vectors at the Gauss points under forces on the inner nodes, end 1 free.

    Forces have the shape (..., nodes - 2, r), the result (..., n q, r).
    """
    n, p, shape = mesh.elements, mesh.order, forces.shape
    nodal = np.zeros((*shape[:-2], n * p, shape[-1]))  # of all nodes but that of end 2
    nodal[..., 1:, :] = forces
    nodal = nodal.reshape(*shape[:-2], n, p, shape[-1])
    sums = np.cumsum(nodal.sum(axis=-2), axis=-2)  # from end 1 to the end of each element, then to its first node
    sums = np.concatenate([np.zeros_like(sums[..., :1, :]), sums[..., :-1, :]], axis=-2) + nodal[..., 0, :]
    at_points = sums[..., None, :] + element_force_transfer(p) @ nodal[..., 1:, :]
    return at_points.reshape(*shape[:-2], n * p, shape[-1])


def static_force_transfer_of_axes(mesh, axes, forces):
    """S f for forces whose columns hold all components, shape (..., dof, r); the result has shape (..., n q, d, r)."""
    *lead, _, count = forces.shape
    at_points = static_force_transfer(mesh, forces.reshape(*lead, mesh.nodes - 2, axes * count))
    return at_points.reshape(*at_points.shape[:-1], axes, count)


def transposed_force_transfer(mesh, weighted):
    """S^T w e: displacement of end 2 minus those of the inner nodes, for gradients e times weights w.

    Weighted gradients have the shape (..., n q, r), the result (..., nodes - 2, r).
    """
    n, p, shape = mesh.elements, mesh.order, weighted.shape
    weighted = weighted.reshape(*shape[:-2], n, p, shape[-1])
    elongations = weighted.sum(axis=-2)  # of the elements
    from_first_node = np.cumsum(elongations[..., ::-1, :], axis=-2)[..., ::-1, :]  # to end 2 of the cable
    from_last_node = np.concatenate([from_first_node[..., 1:, :], np.zeros_like(from_first_node[..., :1, :])], axis=-2)
    from_inner_nodes = from_last_node[..., None, :] + element_force_transfer(p).T @ weighted
    nodal = np.concatenate([from_first_node[..., None, :], from_inner_nodes], axis=-2)
    return nodal.reshape(*shape[:-2], n * p, shape[-1])[..., 1:, :]


def local_compliance(t, along, across):
    """along t t^T + across (I - t t^T) for unit vectors t, shape (..., d), without cancellation; d is 2 or 3."""
    matrix = (along - across)[..., None, None] * t[..., :, None] * t[..., None, :]
    squares = t**2
    for i in range(t.shape[-1]):
        others = np.delete(squares, i, axis=-1).sum(axis=-1)
        matrix[..., i, i] = along * squares[..., i] + across * others
    return matrix


def flatten_components(field):
    """Field of vectors at points or nodes, shape (..., n, d, r), with their components in a row, (..., n d, r)."""
    return field.reshape(*field.shape[:-3], field.shape[-3] * field.shape[-2], field.shape[-1])


def inverse(matrix):
    """Inverse of symmetric positive definite matrices, shape (..., d, d), scaled to a unit diagonal first."""
    root = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    scale = root[..., :, None] * root[..., None, :]
    return np.linalg.inv(matrix / scale) / scale


@dataclass(frozen=True)
class System:
    """Cable linearised about a state, in one, two or all three directions.

    Attributes
    ----------
    state : State
        Equilibrium of the elements.
    axes : tuple of int
        Components of the chord frame that move, d of them: IN_PLANE, OUT_OF_PLANE or SPATIAL.
    """

    state: State
    axes: tuple

    def take(self, index):
        """`System` of one cable of a batch, or of several; its arrays are computed once for the whole batch."""
        names = "tangent", "frame", "weighted_flexibility", "compliance", "end_stiffness", "end_shapes"
        arrays = {name: getattr(self, name)[index] for name in names}
        return with_computed(System(self.state.take(index), self.axes), **arrays)

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
        """1/EA and |r'|/T at the Gauss points, shapes (..., 1) and (..., n q). [-]"""
        state = self.state
        across = state.stretch / state.tension
        return np.asarray(state.compliance)[..., None], across.reshape(*across.shape[:-2], -1)

    @cached_property
    def frame(self):
        """Orthonormal directions at the Gauss points, the tangent first where d > 1, shape (..., n q, d, d). [-]"""
        return _orthonormal_frame(self.tangent)

    @cached_property
    def weighted_flexibility(self):
        """w times the local flexibility along each direction of `frame`, shape (..., n q, d). [-]"""
        along, across = self.local_flexibility
        flexibility = np.repeat((self.weights * across)[..., None], len(self.axes), axis=-1)
        if len(self.axes) > 1:
            flexibility[..., 0] = self.weights * along
        return flexibility

    @cached_property
    def compliance(self):
        """w A at the Gauss points, shape (..., n q, d, d). [-]"""
        along, across = self.local_flexibility
        if len(self.axes) == 1:  # out of the plane
            return (self.weights * across)[..., None, None]
        return local_compliance(self.tangent, self.weights * along, self.weights * across)

    @cached_property
    def _compliance_rows(self):
        """`compliance` as the matrix by which the sum of w A e follows from gradients e, shape (..., d, n q d). [-]"""
        *lead, count, d, _ = self.compliance.shape
        return self.compliance.swapaxes(-3, -2).reshape(*lead, d, count * d)

    @cached_property
    def end_stiffness(self):
        """Condensed stiffness of end 2, end 1 fixed, shape (..., d, d). [-]"""
        return inverse(self.compliance.sum(axis=-3))

    @cached_property
    def end_shapes(self):
        """Static displacements for unit displacements of end 2, end 1 fixed, shape (..., nodes, d, d). [-]"""
        d, mesh = len(self.axes), self.state.mesh
        gradient = self.compliance @ self.end_stiffness[..., None, :, :]  # times the weights
        to_end_2 = transposed_force_transfer(mesh, gradient.reshape(*gradient.shape[:-2], -1))
        shapes = np.zeros((*gradient.shape[:-3], mesh.nodes, d, d))
        shapes[..., 1:-1, :, :] = np.eye(d) - to_end_2.reshape(*to_end_2.shape[:-1], d, d)
        shapes[..., -1, :, :] = np.eye(d)
        return shapes

    def solve(self, forces):
        """Interior displacements K^-1 f under nodal forces f, ends held; both of shape (..., dof, r)."""
        mesh, count, compliance = self.state.mesh, forces.shape[-1], self.compliance
        accumulated = static_force_transfer_of_axes(mesh, len(self.axes), forces)  # S f
        redundant = self.end_stiffness @ (self._compliance_rows @ flatten_components(accumulated))  # c = m f
        gradient = compliance @ (redundant[..., None, :, :] - accumulated)  # times the weights
        displacement = -transposed_force_transfer(mesh, gradient.reshape(*gradient.shape[:-2], -1))
        return displacement.reshape(*displacement.shape[:-2], self.dof, count)

    def root(self, accumulated, points=slice(None)):
        """B f at a slice of the Gauss points, shape (..., points d, r): B is a root of the compliance, K^-1 = B^T B.

        Parameters
        ----------
        accumulated : ndarray, shape (n q, d, r)
            S f, for the same forces f on each cable.
        points : slice
        """
        redundant = self.end_stiffness @ (self._compliance_rows @ flatten_components(accumulated))  # c = m f
        scaled_frame = np.sqrt(self.weighted_flexibility[..., points, :])[..., None] * self.frame[..., points, :, :]
        return flatten_components(scaled_frame @ (accumulated[points] - redundant[..., None, :, :]))

    def modal_energies(self, shapes):
        """Twice the elastic and the geometric energy of displacement shapes.

        Sums of squares, without cancellation however stiff the cable; shapes are (..., nodes, d, r), energies (..., r).
        """
        squares = self.frame @ self._gradient(shapes)
        squares *= squares
        stiffness = self.weights[:, None] ** 2 / self.weighted_flexibility
        if len(self.axes) == 1:
            geometric = _weighted_sum(stiffness, squares)
            return 0.0 * geometric, geometric
        along = np.arange(len(self.axes)) == 0
        return _weighted_sum(along * stiffness, squares), _weighted_sum(~along * stiffness, squares)

    def principal(self, shapes):
        """Orthogonal combinations of displacement shapes, shape (r, r), whose energies do not couple, lowest first."""
        gradient = flatten_components(self.frame @ self._gradient(shapes))
        stiffness = flatten_components((self.weights[:, None] ** 2 / self.weighted_flexibility)[..., None])
        return np.linalg.eigh(gradient.swapaxes(-1, -2) @ (stiffness * gradient))[1]

    def tension_vectors(self, forces, shapes):
        """Changes N of the tension vectors along a cable, to first order, in displacement shapes u such as its modes.

        With the forces f = K u on the inner nodes, K being the stiffness of the cable,

            N = c - S f,    c = k (u_end2 - u_end1 + sum of w A S f)

        S f is the sum of the forces from end 1 to a Gauss point. c is constant along the cable; k is the stiffness of
        its ends, A the change of the gradient r' per tension vector, w the weight of a Gauss point. (EA times the
        strain is the same in exact arithmetic; of an almost inextensible cable only rounding would be left of it.)

        Parameters
        ----------
        forces : ndarray, shape (..., nodes, d, r)
            f of r shapes, over the reference force `State.force`; only those on the inner nodes are used. [-]
        shapes : ndarray, shape (..., nodes, d, r)
            Displacements u of all nodes, both ends included, in d directions, over the unstretched length. [-]

        Returns
        -------
        ndarray, shape (..., n q, d, r)
            N over the reference force, at the q Gauss points of each of n elements. [-]
        """
        inner_forces = flatten_components(forces[..., 1:-1, :, :])
        accumulated = static_force_transfer_of_axes(self.state.mesh, len(self.axes), inner_forces)  # S f
        gap_by_forces = self._compliance_rows @ flatten_components(accumulated)
        between_ends = shapes[..., -1, :, :] - shapes[..., 0, :, :]
        return (self.end_stiffness @ (between_ends + gap_by_forces))[..., None, :, :] - accumulated

    def highest_energy(self, shapes, tensions):
        """Energy of the two highest polynomials of each element in displacement shapes, for error estimates.

        The larger one of twice the complementary energy of that part of their `tension_vectors` and twice the geometric
        energy of that part of the gradient; EA amplifies neither. Shapes are (..., nodes, d, r), energies (..., r).
        """
        highest_tension = self.frame @ self._project_highest(tensions)
        highest_gradient = self._project_highest(self._gradient(shapes))
        across = np.repeat((self.weights**2 / self.weighted_flexibility[..., -1])[..., None], len(self.axes), axis=-1)
        complementary = _weighted_sum(self.weighted_flexibility, highest_tension**2)
        return np.maximum(complementary, _weighted_sum(across, highest_gradient**2))

    def _project_highest(self, field):
        """Part of a field at the Gauss points in the two highest polynomials of each element."""
        mesh, (*lead, _, d, r) = self.state.mesh, field.shape
        by_element = field.reshape(*lead, mesh.elements, mesh.order, d * r)
        return (highest_projection(mesh.order) @ by_element).reshape(field.shape)

    def elastic_root(self, shapes):
        """V of displacement shapes, shape (..., n q, r): their elastic energies Psi^T K_E Psi are V^T V."""
        along = (self.tangent[..., None] * self._gradient(shapes)).sum(axis=-2)
        return np.sqrt(self.weights / self.local_flexibility[0])[..., None] * along

    def _gradient(self, shapes):
        """Gradient of shapes at the Gauss points, shape (..., n q, d, r)."""
        mesh, (*lead, nodes, d, r) = self.state.mesh, shapes.shape
        flat = shapes.reshape(*lead, nodes, d * r)
        # the nodes of each element; neighbours share one
        by_element = sliding_window_view(flat, mesh.order + 1, axis=-2)[..., :: mesh.order, :, :].swapaxes(-1, -2)
        gradient = basis(mesh.order).derivative / mesh.sizes[:, None, None] @ by_element
        return gradient.reshape(*lead, len(self.weights), d, r)

    @property
    def mass(self):
        """Sparse mass matrix of the interior for a cable of unit mass, shape (dof, dof). [-]"""
        return masses(self.state.mesh, len(self.axes))[1]

    def inertia(self, movements):
        """M u for movements u of all nodes, see `inertia`."""
        return inertia(self.state.mesh, movements)

    def bare_inertia(self, movements):
        """M u as in `inertia`, without the point masses on the cable."""
        return inertia(self.state.mesh.bare, movements)


def inertia(mesh, movements):
    """M u for movements u of all nodes of a cable of unit mass, both of shape (..., nodes, d, r).

    Lumped masses need no matrix, nor scipy.sparse, which takes a tenth of a second to import.
    """
    if mesh.mass == "lumped":
        return np.multiply(mesh.node_masses[:, None, None], movements, order="C")
    mass = masses(mesh, movements.shape[-2])[0]
    return sparse_product(mass, flatten_components(movements)).reshape(movements.shape)


def sparse_product(matrix, dense):
    """A sparse matrix times stacked dense ones, shape (..., n, r); the digits of each column are those of it alone."""
    columns = np.moveaxis(dense, -2, 0)
    product = matrix @ columns.reshape(len(columns), dense.size // max(len(columns), 1))
    return np.ascontiguousarray(np.moveaxis(product.reshape(columns.shape), 0, -2))


def _weighted_sum(weights, field):
    """Sum over points and components of weights, shape (..., n q, d), times a field, shape (..., n q, d, r)."""
    return (weights.reshape(*weights.shape[:-2], 1, -1) @ flatten_components(field))[..., 0, :]


def _orthonormal_frame(tangent):
    """Orthonormal directions at each point, the tangent first, shape (..., d, d)."""
    d = tangent.shape[-1]
    if d == 1:
        return np.ones((*tangent.shape, 1))
    if d == 2:
        return np.stack([tangent, np.stack([-tangent[..., 1], tangent[..., 0]], axis=-1)], axis=-2)
    steepest_axis = np.eye(3)[np.argmin(np.abs(tangent), axis=-1)]  # of x, y, z that nearest to a right angle
    normal = np.cross(tangent, steepest_axis)
    normal /= np.sqrt((normal**2).sum(axis=-1, keepdims=True))
    return np.stack([tangent, normal, np.cross(tangent, normal)], axis=-2)


@lru_cache(maxsize=32)
def masses(mesh, axes):
    """Sparse mass matrices of all nodes, with `axes` components each, and of the interior; of a cable of unit mass.

    Point masses are added to that.
    """
    element_mass = np.kron(mass_matrix(mesh.order, mesh.mass), np.eye(axes))
    mass = add_elements(mesh, axes, mesh.sizes[:, None, None] * element_mass)
    if mesh.point_masses:
        from scipy.sparse import diags_array

        mass = (mass + diags_array(np.repeat(mesh.carried, axes))).tocsr()
    return mass, mass[axes:-axes, axes:-axes]


def add_elements(mesh, axes, blocks):
    """Assemble the matrices of all elements, such as stiffness or mass, into a sparse matrix of all nodes.

    Parameters
    ----------
    mesh : Mesh
        n elements with order + 1 nodes each; neighbours share a node.
    axes : int
        Number of components at a node, d.
    blocks : ndarray, shape (n, (order + 1) d, (order + 1) d)
        Matrix of each element; rows node by node, the components of one node together.

    Returns
    -------
    scipy.sparse.csr_array, shape (nodes d, nodes d)
        Without entries that are zero; rows and columns ordered as those of `blocks`, the nodes of the ends included.
    """
    from scipy.sparse import coo_array

    dof_of_elements = np.arange(mesh.elements)[:, None] * mesh.order * axes + np.arange((mesh.order + 1) * axes)
    rows = np.repeat(dof_of_elements, dof_of_elements.shape[1], axis=1).ravel()
    columns = np.tile(dof_of_elements, (1, dof_of_elements.shape[1])).ravel()
    dof = mesh.nodes * axes
    matrix = coo_array((blocks.ravel(), (rows, columns)), shape=(dof, dof)).tocsr()
    matrix.eliminate_zeros()
    return matrix
