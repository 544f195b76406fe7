"""Nodal forces and tangent stiffness K_E + K_G of one cable from the positions of its nodes, as sparse matrices.

With the tangent t, the stretch |r'| and the tension T at the Gauss points, and B the derivative of the nodal functions
with respect to the unstretched length s,

    f   = integral of B^T T t ds                     T = EA (|r'| - 1)
    K_E = integral of B^T EA t t^T B ds
    K_G = integral of B^T T/|r'| (I - t t^T) B ds    K_E + K_G = df/dr

An element of order 1 is the bar of the paper that this program follows: K_E = EA/L0e n n^T and
K_G = F/|r| (I - n n^T), with its unstretched length L0e and its length |r|. Source: Bathe (1996), Finite Element
Procedures, section 6.3.3 (total Lagrangian truss).

The solvers of this package use the force method (`assembly`) instead, whose digits do not depend on EA. These matrices
are for users, for networks of cables, and for integration in time.
"""

import numpy as np

from cablestudy.cable.assembly import add_elements
from cablestudy.cable.element import basis
from cablestudy.cable.state import State


def state_at(span, mesh, positions):
    """Tensions and directions of a cable from the positions of its nodes, in equilibrium or not.

    The tension at a Gauss point is T = EA (|r'| - 1), with the derivative r' of the positions by the unstretched
    length.

    Parameters
    ----------
    span : Span
        One cable.
    mesh : Mesh
    positions : ndarray, shape (nodes, 3)
        Of the nodes, ends included, from the place of end 1 at rest, in the axes of `span.frame`. For global positions
        r they are `(r - end_1) @ span.frame.T`. Complex numbers are allowed, for derivatives by a complex step. [m]

    Returns
    -------
    State
        A tension is negative where an element is compressed: a cable would be slack there.

    Notes
    -----
    The strain is a difference of lengths: it has the digits of |r'| - 1, fewer the stiffer the cable. States of
    `equilibrium.solve` have all digits.
    """
    length = span.unstretched_length
    gradient = basis(mesh.order).derivative / mesh.sizes[:, None, None] @ (positions / length)[mesh.element_nodes]
    stretch = np.sqrt((gradient**2).sum(axis=-1))
    chord = np.outer(mesh.node_positions, [1 + span.chord_strain, 0.0, 0.0])
    return State(
        mesh=mesh,
        span=span,
        direction=gradient / stretch[..., None],
        tension=stretch - 1,
        displacement=positions / length - chord,
        force=span.axial_stiffness,
        mirror_symmetric=False,
    )


def internal_forces(state, frame="chord"):
    """Internal forces f of a cable: the force that must act on each node to hold the cable in a state.

    Parameters
    ----------
    state : State
        Of one cable.
    frame : {"chord", "global"}
        Axes of the forces.

    Returns
    -------
    ndarray, shape (nodes, 3)
        On the inner nodes of a cable in equilibrium its weight and loads (`equilibrium.external_forces`). The cable
        acts on what holds its nodes with the opposite force. [N]
    """
    mesh, element, t = state.mesh, basis(state.mesh.order), _tangent(state, frame)
    tension = (element.weights * state.tension)[..., None] * t * state.force  # T t times the Gauss weights
    nodal = np.zeros((mesh.nodes, 3), dtype=tension.dtype)
    np.add.at(nodal, mesh.element_nodes, element.derivative.T @ tension)
    return nodal


def tangent_stiffness(state, frame="chord"):
    """Elastic and geometric stiffness of all nodes about a state, whose sum is the derivative of `internal_forces`.

    Parameters
    ----------
    state : State
        Of one cable.
    frame : {"chord", "global"}
        Axes of the displacements.

    Returns
    -------
    elastic, geometric : scipy.sparse.csr_array, shape (3 nodes, 3 nodes)
        K_E and K_G; degree of freedom 3 i + j is component j of node i. [N/m]
    """
    mesh, element, t = state.mesh, basis(state.mesh.order), _tangent(state, frame)
    along = t[..., :, None] * t[..., None, :]
    across = np.eye(3) - along
    elastic = np.asarray(state.span.axial_stiffness, dtype=float) * along
    geometric = (state.tension * state.force / state.stretch)[..., None, None] * across
    products = element.weights[:, None, None] * element.derivative[:, :, None] * element.derivative[:, None, :]
    length, dof = state.span.unstretched_length * mesh.sizes[:, None, None], 3 * (mesh.order + 1)

    def assemble(at_points):
        """Integral of B^T A B for matrices A at the Gauss points, shape (n, q, 3, 3)."""
        blocks = np.einsum("qij,eqab->eiajb", products, at_points, optimize=True)
        return add_elements(mesh, 3, blocks.reshape(mesh.elements, dof, dof) / length)

    return assemble(elastic), assemble(geometric)


def _tangent(state, frame):
    """Unit tangent at the Gauss points in the axes of a frame, shape (n, q, 3)."""
    return state.span.in_frame(state.direction.reshape(-1, 3), frame).reshape(state.direction.shape)
