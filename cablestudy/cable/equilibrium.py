"""Equilibrium of a cable of finite elements: Newton's method for one tension vector, from the catenary as the start.

With loads f on its inner nodes, S f being their sum from end 1 on (see `assembly`), the tension vectors at a cable's
Gauss points are N = c - S f: only the vector c is unknown, and the positions of the ends determine it. This c minimises
the complementary energy, which is strictly convex, so that a c with which end 2 is at its position, and every tension
is positive, is the only equilibrium.
"""

from copy import copy
from dataclasses import replace

import numpy as np

from cablestudy.cable.assembly import inverse, local_compliance, static_force_transfer, transposed_force_transfer
from cablestudy.cable.element import basis, lagrange
from cablestudy.cable.newton import SLACK, STALLED, newton
from cablestudy.cable.state import State
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError


def from_catenary(catenary, mesh):
    """`State` of one continuous cable or many, a `Catenary` sampled at the nodes and Gauss points of a mesh.

    Exact at every point; `solve` gives the equilibrium of the discrete cable.
    """
    displacement, _ = catenary.at(mesh.node_positions)
    displacement[..., -1, :] = 0.0
    force = catenary.tension_at(mesh.point_positions.ravel())
    state = _state(catenary, mesh, force / np.asarray(catenary.max_tension)[..., None, None], displacement)
    uneven = catenary.uneven_load(mesh.edges)
    return state if uneven is None else replace(state, uneven=uneven)


def _state(catenary, mesh, force, displacement):
    """`State` from tension vectors at the Gauss points, (..., n q, 3), and displacements of nodes, (..., nodes, 3).

    Forces are in units of the catenary's largest tension, displacements in units of the unstretched length. [-]
    """
    reference = np.asarray(catenary.max_tension)
    tension = np.sqrt((force**2).sum(axis=-1))
    shape = (*tension.shape[:-1], mesh.elements, mesh.order)
    return State(
        mesh=mesh,
        span=catenary.span,
        direction=(force / np.maximum(tension, CABLE.tiny)[..., None]).reshape(*shape, 3),
        tension=tension.reshape(shape),
        displacement=displacement,
        force=reference,
        mirror_symmetric=mesh.mirror_symmetric and bool(np.all(catenary.mirror_symmetric)),
    )


def external_forces(span, mesh, force):
    """Weight and point loads on the nodes, shape (..., nodes, 3), in units of `force`. [-]"""
    force = np.asarray(force)[..., None, None]
    weight = np.asarray(span.weight)[..., None, None] / force
    nodal = -weight * mesh.node_weights[:, None] * np.asarray(span.up)[..., None, :]
    positions = span.load_positions / np.asarray(span.unstretched_length)[..., None]
    loads = span.load_forces / force
    for load in range(positions.shape[-1]):
        edge = np.argmin(np.abs(mesh.edges - positions[..., load, None]), axis=-1)
        loaded = np.arange(mesh.nodes) == edge[..., None] * mesh.order
        nodal = nodal + loaded[..., None] * loads[..., load, None, :]
    return nodal


class ElementResidual:
    """Residual of elements, for Newton's method: distance of end 2 from its position under a tension vector c.

    Parameters
    ----------
    span : Span
        Fields of shape (...).
    mesh : Mesh
    force : ndarray, shape (...)
        Unit of force. [N]
    nodal : ndarray, shape (..., nodes, 3), optional
        Dead loads on the nodes, besides weight and point loads. [N]

    Notes
    -----
    N = c - S f at the Gauss points; r' = N/EA + N/|N|; g = chord - sum of w r', per unstretched length.
    """

    tolerance, stalled = 1e-9, 1e-6  # see `newton`; the error left is about the square of the last step

    def __init__(self, span, mesh, force, nodal=None):
        self.axes = 2 if span.planar and nodal is None else 3
        self.loads = external_forces(span, mesh, force)[..., : self.axes]
        if nodal is not None:
            self.loads = self.loads + nodal / np.asarray(force)[..., None, None]
        self.accumulated_loads = static_force_transfer(mesh, self.loads[..., 1:-1, :])  # S f
        self.weights = mesh.point_weights.ravel()
        self.axial = (force / np.asarray(span.axial_stiffness, dtype=float))[..., None]  # 1/EA
        self.chord = np.zeros((*np.shape(force), self.axes))
        self.chord[..., 0] = span.chord_strain

    def take(self, index):
        """The residual of some cables of the batch, by a tuple of indices along its axes."""
        taken = copy(self)
        for name in ("accumulated_loads", "axial", "chord"):
            setattr(taken, name, getattr(self, name)[index])
        return taken

    def residual(self, unknown):
        """g, shape (d, ...), and the `point`: tension vectors, tensions, tangents t, and r' less that of the chord."""
        force = np.ascontiguousarray(np.moveaxis(unknown, 0, -1))[..., None, :] - self.accumulated_loads
        tension = np.maximum(np.sqrt((force**2).sum(axis=-1)), CABLE.tiny)
        t = force / tension[..., None]
        sine_squared = (t[..., 1:] ** 2).sum(axis=-1)  # of the angle between tangent and chord
        forward = t[..., 0] > 0
        # component of t along the chord, minus 1: without cancellation where it is nearly 1
        shortening = np.where(forward, -sine_squared / np.where(forward, 1 + t[..., 0], 1.0), t[..., 0] - 1)
        slope = (self.axial * tension)[..., None] * t
        slope[..., 0] += shortening
        slope[..., 1:] += t[..., 1:]
        return np.moveaxis(self.chord - self.weights @ slope, -1, 0), (force, tension, t, slope)

    def step(self, gap, point):
        """Newton step of c, shape (d, ...): sum of w (t t^T/EA + |r'|/T (I - t t^T)) inverted, times g."""
        _, tension, t, _ = point
        axial, weights = self.axial, self.weights
        flexibility = local_compliance(t, weights * axial, weights * (1 / tension + axial)).sum(axis=-3)
        return np.moveaxis((inverse(flexibility) @ np.moveaxis(gap, 0, -1)[..., None])[..., 0], -1, 0)

    def relative(self, step, _, point):
        """Size of a step over the largest tension and the largest transverse one, shape (...). [-]"""
        force, tension, _, _ = point
        largest = tension.max(axis=-1)
        largest_transverse = np.sqrt((force[..., 1:] ** 2).sum(axis=-1)).max(axis=-1)
        transverse = np.sqrt((step[1:] ** 2).sum(axis=0)) / np.maximum(largest_transverse, 1e-16 * largest)
        return np.maximum(np.sqrt((step**2).sum(axis=0)) / largest, transverse)

    def rounding(self, step):
        """Error of the slope along a step due to rounding of the residual, shape (...)."""
        return 1e-15 * np.abs(self.chord[..., 0] * step[0]) + 1e-16 * np.abs(step).max(axis=0)

    def slack(self, point):
        """True where the complementary energy is least at its kink where the smallest tension vanishes, shape (...)."""
        force, tension, _, _ = point
        loosest, accumulated = np.argmin(tension, axis=-1), np.broadcast_to(self.accumulated_loads, force.shape)
        kink = np.take_along_axis(accumulated, loosest[..., None, None], axis=-2)  # c - S f = 0 at the loosest point
        gap, _ = self.residual(np.moveaxis(kink[..., 0, :], -1, 0))
        return np.sqrt((gap**2).sum(axis=0)) <= self.weights[loosest]


def solve_many(catenary, mesh, uneven=None):
    """Equilibria of one cable of finite elements, or of many on one mesh, from their catenaries as the start.

    A load may depend on where the cable hangs. Then load and equilibrium are computed in turn until the forces on the
    nodes change by less than `CABLE.uneven_load_change` times the largest tension. A cable whose forces still change
    after `CABLE.uneven_load_steps` turns has the reason `STALLED` in its record.

    Parameters
    ----------
    catenary : Catenary
        Exact equilibrium of the continuous cables under weight and point loads.
    mesh : Mesh
        n elements with q Gauss points each.
    uneven : callable, optional
        `State` -> force per unstretched length at the Gauss points, to be added to the uniform load, such as the drag
        of a wind that grows with height; chord frame, shape (..., n, q, 3) [N/m].

    Returns
    -------
    state : State
        Tensions, directions and displacements of the elements.
    record : NewtonRecord
        Of the last Newton iteration; its `reason` tells whether each cable is in equilibrium.
    """
    if uneven is None:
        return _solve_loads(catenary, mesh)
    length = np.asarray(catenary.span.unstretched_length)[..., None, None]
    previous = np.zeros((*np.shape(catenary.max_tension), mesh.nodes, 3))
    state, record = _solve_loads(catenary, mesh, previous)
    for _ in range(CABLE.uneven_load_steps):
        force_per_length = uneven(state)
        nodal = _nodal_forces(mesh, force_per_length) * length
        state, record = _solve_loads(catenary, mesh, nodal)
        state = replace(state, uneven=(mesh.point_weights[..., None] * force_per_length).sum(axis=-2) * length)
        change, previous = np.abs(nodal - previous).sum(axis=(-1, -2)), nodal
        settled = change <= CABLE.uneven_load_change * np.asarray(catenary.max_tension)
        if (settled | ~record.converged).all():
            return state, record
    return state, replace(record, reason=np.where(settled, record.reason, STALLED))


def _nodal_forces(mesh, force_per_length):
    """Nodal forces over the unstretched length, shape (..., nodes, 3), of a force per length at the Gauss points.

    The force per length has the shape (..., n, q, 3).
    """
    element = basis(mesh.order)
    values = lagrange(element.nodes, element.points)  # shape (q, p + 1)
    on_element = values.T @ (mesh.point_weights[..., None] * force_per_length)
    nodal = np.zeros((*force_per_length.shape[:-3], mesh.nodes, 3))
    for node in range(mesh.order + 1):
        nodal[..., mesh.element_nodes[:, node], :] += on_element[..., node, :]
    return nodal


def _solve_loads(catenary, mesh, nodal=None):
    """`solve_many` under weight, point loads and further constant loads on the nodes.

    `nodal`, shape (..., nodes, 3), are the further loads in the chord frame. [N]
    """
    span, reference = catenary.span, np.asarray(catenary.max_tension)
    problem = ElementResidual(span, mesh, reference, nodal)
    at_end_1 = catenary.tension_at(np.zeros(1))[..., 0, : problem.axes]
    start = at_end_1 / reference[..., None] - problem.loads[..., 0, :]  # c, the tension vector beyond the load on end 1
    active = np.ones(start.shape[:-1], dtype=bool)
    _, point, record = newton(problem, np.moveaxis(start, -1, 0), active)
    if not record.converged.all():
        slack = ~record.converged & problem.slack(point)
        record = replace(record, reason=np.where(slack, SLACK, record.reason))
    force, _, _, slope = point
    gradient = slope - problem.chord[..., None, :]  # of the displacement from the straight chord
    displacement = np.zeros((*gradient.shape[:-2], mesh.nodes, 3))
    to_end_2 = transposed_force_transfer(mesh, problem.weights[:, None] * gradient)
    displacement[..., 1:-1, : problem.axes] = -to_end_2
    force_3d = np.zeros((*force.shape[:-1], 3))
    force_3d[..., : problem.axes] = force
    state = _state(catenary, mesh, force_3d, displacement)
    return (state if nodal is None else replace(state, mirror_symmetric=False)), record


def solve(catenary, mesh):
    """`State` and `NewtonRecord` of one discrete cable in equilibrium, from its `Catenary` as the start.

    Raises
    ------
    ConvergenceError
        No equilibrium with every tension positive was reached.
    """
    state, record = solve_many(catenary, mesh)
    if not record.converged:
        raise refusal(record, mesh)
    return state, record


def refusal(record, mesh):
    """`ConvergenceError` that states why one discrete cable has no equilibrium, from its `NewtonRecord`."""
    if record.reason == SLACK:
        return ConvergenceError(
            f"too few elements ({mesh.elements} of order {mesh.order}) for so sharp a bend: "
            "one would hang slack, without tension",
            record,
        )
    return ConvergenceError(f"static form of {mesh.elements} elements of order {mesh.order}: {record}", record)
