"""Elements -> the tangent of a whole cable: sparse K and M, and the mixed system that every solver uses.

The mixed system keeps the tensions at the Gauss points as unknowns beside the displacements,

    [ K_G   G ] [ u ]   [ f ]        K_G = integral of B^T T/|r'| (I - t t^T) B ds
    [ G^T  -C ] [ s ] = [ g ]        G   = integral of B^T t ds,   C = integral of ds/EA

Eliminating s gives the paper's K_E + K_G. Kept apart, EA appears only as its inverse: an almost inextensible cable is
as well conditioned as an elastic one, in any direction of the axes. Lengths are counted in unstretched lengths and
forces in a reference force.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cablestudy.cable.element import Mesh, basis, mass_matrix
from cablestudy.cable.linear import Factor, Pattern


@dataclass(frozen=True)
class State:
    """A cable in equilibrium, at the Gauss points and nodes of a mesh; chord frame.

    Attributes
    ----------
    mesh : Mesh
    direction : ndarray, shape (n, q, 3)
        Unit tangent. [-]
    tension : ndarray, shape (n, q)
        In units of `force`. [-]
    stretch : ndarray, shape (n, q)
        |r'|. [-]
    displacement : ndarray, shape (nodes, 3)
        Of the nodes from the straight chord, in unstretched lengths. [-]
    compliance : float
        force / EA. [-]
    force : float
        Reference force. [N]
    """

    mesh: Mesh
    direction: np.ndarray
    tension: np.ndarray
    stretch: np.ndarray
    displacement: np.ndarray
    compliance: float
    force: float


IN_PLANE, OUT_OF_PLANE, SPATIAL = (0, 1), (2,), (0, 1, 2)


@lru_cache(maxsize=16)
def layout(elements, order, axes, mixed):
    """Where each unknown of the mixed system stands: element by element, tensions before displacements.

    Returns
    -------
    tension_index : ndarray, shape (n, q) or None
    node_index : ndarray, shape (nodes, axes)
        -1 at the two ends.
    pattern : Pattern
    """
    block = order * (axes + mixed)
    first = np.arange(elements)[:, None] * block
    tension_index = first + np.arange(order) if mixed else np.zeros((elements, 0), dtype=int)
    node_index = np.full((elements * order + 1, axes), -1)
    inner = first[:, :, None] + mixed * order + np.arange(order * axes).reshape(1, order, axes)
    node_index[1:] = inner.reshape(-1, axes)
    node_index[-1] = -1
    size = elements * block - axes
    of_element = node_index[np.arange(elements)[:, None] * order + np.arange(order + 1)].reshape(elements, -1)
    unknowns = np.concatenate([of_element, tension_index], axis=1)
    pattern = Pattern.of_blocks(unknowns, size, bandwidth=block + axes - 1)
    return tension_index, node_index, pattern


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

    @property
    def mixed(self):
        """False where the cable moves across its plane: no first-order strain, hence no tension unknowns."""
        return self.axes != OUT_OF_PLANE

    @cached_property
    def layout(self):
        """See `layout`."""
        mesh = self.state.mesh
        return layout(mesh.elements, mesh.order, len(self.axes), self.mixed)

    @cached_property
    def geometric_blocks(self):
        """K_G of each element, shape (n, (p + 1) d, (p + 1) d). [-]"""
        state, element = self.state, basis(self.state.mesh.order)
        nodes, axes = len(element.nodes), len(self.axes)
        share = state.tension / state.stretch * element.weights / state.mesh.sizes[:, None]
        t = state.direction[..., self.axes]
        blocks = np.empty((len(share), nodes, axes, nodes, axes))
        for a in range(axes):
            for b in range(axes):
                projector = (a == b) - t[..., a] * t[..., b]
                blocks[:, :, a, :, b] = element.derivative.T @ ((share * projector)[..., None] * element.derivative)
        return blocks.reshape(len(share), nodes * axes, nodes * axes)

    @cached_property
    def coupling_blocks(self):
        """G of each element, shape (n, (p + 1) d, q). [-]"""
        element = basis(self.state.mesh.order)
        weighted = element.weights[:, None] * element.derivative
        blocks = np.einsum("qi,eqa->eiaq", weighted, self.state.direction[..., self.axes])
        return blocks.reshape(len(blocks), -1, len(element.weights))

    @cached_property
    def compliance_diagonal(self):
        """C at each Gauss point, shape (n, q). [-]"""
        return self.state.compliance * self.state.mesh.sizes[:, None] * basis(self.state.mesh.order).weights

    @cached_property
    def factor(self):
        """The factorised mixed matrix of the interior."""
        geometric = self.geometric_blocks
        if not self.mixed:
            return Factor(self.layout[2], geometric)
        size, points = geometric.shape[1], self.state.tension.shape[1]
        blocks = np.zeros((len(geometric), size + points, size + points))
        blocks[:, :size, :size] = geometric
        blocks[:, :size, size:] = self.coupling_blocks
        blocks[:, size:, :size] = self.coupling_blocks.transpose(0, 2, 1)
        diagonal = np.arange(size, size + points)
        blocks[:, diagonal, diagonal] = -self.compliance_diagonal
        if self.scale is not None:
            tension_index, node_index, _ = self.layout
            nodes = self.element_vectors(node_index).reshape(len(blocks), size)
            local = np.concatenate([np.where(nodes < 0, 1.0, self.scale[nodes]), self.scale[tension_index]], axis=1)
            blocks *= local[:, :, None] * local[:, None, :]
        return Factor(self.layout[2], blocks)

    @cached_property
    def scale(self):
        """Units of the mixed unknowns where elements differ much in size, shape (mixed size,); else None.

        K_G grows as 1/size and C as size: without it two loads a hair apart leave no digits to the pivots.
        """
        mesh = self.state.mesh
        if not self.mixed or mesh.sizes.max() < 4 * mesh.sizes.min():
            return None
        tension_index, node_index, pattern = self.layout
        root = np.exp2(np.round(np.log2(mesh.sizes * mesh.elements) / 2))  # powers of two: exact
        per_node = np.full(mesh.nodes, np.inf)
        np.minimum.at(per_node, self.element_vectors(np.arange(mesh.nodes)), root[:, None])
        scale = np.ones(pattern.size)
        scale[node_index[1:-1]] = per_node[1:-1, None]
        scale[tension_index] = 1 / root[:, None]
        return scale

    @property
    def interior(self):
        """Index of the interior displacements in the mixed vector, shape (dof,)."""
        return self.layout[1][1:-1].ravel()

    @property
    def dof(self):
        """Number of free displacements. [-]"""
        return (self.state.mesh.nodes - 2) * len(self.axes)

    def solve(self, forces, mismatch=None):
        """Interior displacements under nodal forces, ends held.

        Parameters
        ----------
        forces : ndarray, shape (dof,) or (dof, r)
        mismatch : ndarray, shape (n q,) or (n q, r), optional
            Right-hand side of the tension rows.

        Returns
        -------
        displacement : ndarray, shape (dof,) or (dof, r)
        tension : ndarray, shape (n q,) or (n q, r)
        """
        right = np.zeros((self.layout[2].size, *forces.shape[1:]))
        right[self.interior] = forces
        where = self.layout[0].ravel()
        if mismatch is not None:
            right[where] = mismatch
        scale = 1.0 if self.scale is None else self.scale.reshape(-1, *[1] * (right.ndim - 1))
        answer = scale * self.factor.solve(scale * right)
        return answer[self.interior], answer[where]

    def element_vectors(self, nodal):
        """Nodal vectors gathered by element.

        Parameters
        ----------
        nodal : ndarray, shape (nodes, d, ...)

        Returns
        -------
        ndarray, shape (n, p + 1, d, ...)
        """
        mesh = self.state.mesh
        index = mesh.element_nodes
        return nodal[index]

    def strain_energy(self, shapes):
        """Twice the elastic and the geometric energy of displacement shapes, and their products.

        Sums of squares: nothing cancels, however stiff the cable.

        Parameters
        ----------
        shapes : ndarray, shape (nodes, d, r)

        Returns
        -------
        elastic, geometric : ndarray, shape (r, r)
        """
        along, across, weights = self._gradients(shapes)
        rate = weights * self.state.tension / self.state.stretch
        return _gram(weights[..., None] / self.state.compliance, along), _gram(rate[..., None, None], across)

    def modal_energies(self, shapes):
        """Diagonals of `strain_energy`, each of shape (r,)."""
        along, across, weights = self._gradients(shapes)
        elastic = np.einsum("eq,eqr->r", weights / self.state.compliance, along**2)
        rate = weights * self.state.tension / self.state.stretch
        return elastic, np.einsum("eq,eqar->r", rate, across**2)

    def _gradients(self, shapes):
        mesh, t = self.state.mesh, self.state.direction[..., self.axes]
        element = basis(mesh.order)
        gathered = self.element_vectors(shapes)
        gradient = np.tensordot(element.derivative, gathered, axes=(1, 1)).swapaxes(0, 1)
        gradient = gradient / mesh.sizes[:, None, None, None]
        along = np.einsum("eqa,eqar->eqr", t, gradient)
        across = gradient - t[..., None] * along[:, :, None]
        return along, across, mesh.sizes[:, None] * element.weights

    def end_columns(self, end):
        """Right-hand sides of the interior when one end moves by one unit in each direction.

        Parameters
        ----------
        end : int
            0 for end 1, -1 for end 2.

        Returns
        -------
        forces : ndarray, shape (dof, d)
        mismatch : ndarray, shape (n q, d)
        """
        axes, mesh = len(self.axes), self.state.mesh
        nodes = mesh.order + 1
        local = slice(0, axes) if end == 0 else slice((nodes - 1) * axes, nodes * axes)
        which = 0 if end == 0 else mesh.elements - 1
        forces = np.zeros((mesh.nodes * axes, axes))
        begin = which * mesh.order * axes
        forces[begin : begin + nodes * axes] = -self.geometric_blocks[which][:, local]
        points = self.layout[0].shape[1]
        mismatch = np.zeros((mesh.elements * points, axes))
        if self.mixed:
            mismatch[which * points : (which + 1) * points] = -self.coupling_blocks[which][local].T
        return forces[axes:-axes], mismatch

    @cached_property
    def end_stiffness(self):
        """Condensed stiffness of end 2, end 1 fixed, shape (d, d). [-]

        By the energy of the shapes that the cable takes: error squared, and no difference of large numbers.
        """
        return sum(self.strain_energy(self.end_shapes))

    @cached_property
    def end_shapes(self):
        """Static shapes for unit movements of end 2, shape (nodes, d, d). [-]"""
        axes = len(self.axes)
        shapes = np.zeros((self.state.mesh.nodes, axes, axes))
        shapes[-1] = np.eye(axes)
        if self.dof:
            inner, _ = self.solve(*self.end_columns(-1))
            shapes[1:-1] = inner.reshape(-1, axes, axes)
        return shapes

    @property
    def mass(self):
        """Sparse mass matrix of the interior for a cable of unit mass, shape (dof, dof). [-]"""
        return masses(self.state.mesh, len(self.axes))[1]

    def full_mass(self):
        """Sparse mass matrix of all nodes for a cable of unit mass, shape (nodes d, nodes d). [-]"""
        return masses(self.state.mesh, len(self.axes))[0]

    def full_stiffness(self):
        """Sparse K_E + K_G of all nodes, shape (nodes d, nodes d). [-]"""
        elastic = 0.0
        if self.mixed:
            coupling = self.coupling_blocks
            elastic = (coupling / self.compliance_diagonal[:, None, :]) @ coupling.transpose(0, 2, 1)
        return _sparse(self.state.mesh, len(self.axes), self.geometric_blocks + elastic)


def _gram(weights, shapes):
    """Sum of weights times products of shapes, over all axes but the last, shape (r, r)."""
    flat = shapes.reshape(-1, shapes.shape[-1])
    return (weights * shapes).reshape(flat.shape).T @ flat


@lru_cache(maxsize=8)
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


def partition(matrix, axes):
    """Split a full matrix into ends (1) and interior (2).

    Parameters
    ----------
    matrix : sparse array, shape (nodes d, nodes d)
    axes : int
        Components d of a node.

    Returns
    -------
    m11, m12, m22 : sparse arrays
        (2 d, 2 d), (2 d, dof), (dof, dof); the ends in the order end 1, end 2.
    """
    total = matrix.shape[0]
    ends = np.r_[0:axes, total - axes : total]
    inner = np.arange(axes, total - axes)
    return matrix[ends][:, ends], matrix[ends][:, inner], matrix[inner][:, inner]
