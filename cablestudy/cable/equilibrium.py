"""The static form of the elements: Newton on one tension vector, from the catenary, with a guarded step.

With loads on its nodes the tension vectors at a cable's Gauss points are N = c - S f (see `assembly`), so that only c
is unknown: the places of the ends determine it. It minimises the complementary energy, which is strictly convex. A c
that fulfils the equation while every tension is positive is therefore the only equilibrium.
"""

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
    points = mesh.point_positions
    displacement, force = catenary.at(np.concatenate([mesh.node_positions, points.ravel()]))
    displacement, force = displacement[..., : mesh.nodes, :].copy(), force[..., mesh.nodes :, :]
    displacement[..., -1, :] = 0.0
    return _state(catenary, mesh, force / np.asarray(catenary.max_tension)[..., None, None], displacement)


def _state(catenary, mesh, force, displacement):
    """From the tension vectors at the Gauss points in units of the largest of the catenary, shape (..., n q, 3)."""
    reference = np.asarray(catenary.max_tension)
    size = np.sqrt((force**2).sum(axis=-1))
    shape = (*size.shape[:-1], mesh.elements, mesh.order)
    return State(
        mesh=mesh,
        span=catenary.span,
        direction=(force / np.maximum(size, CABLE.tiny)[..., None]).reshape(*shape, 3),
        tension=size.reshape(shape),
        displacement=displacement,
        force=reference,
        mirror_symmetric=mesh.mirror_symmetric and bool(np.all(catenary.span.mirror_symmetric)),
    )


def external_forces(span, mesh, force):
    """Weight and point loads on the nodes, shape (..., nodes, 3), in units of `force`. [-]"""
    force = np.asarray(force)[..., None, None]
    weight = np.asarray(span.weight)[..., None, None] / force
    total = -weight * mesh.node_weights[:, None] * np.asarray(span.up)[..., None, :]
    positions = span.load_positions / np.asarray(span.unstretched_length)[..., None]
    loads = span.load_forces / force
    for place in range(positions.shape[-1]):
        edge = np.argmin(np.abs(mesh.edges - positions[..., place, None]), axis=-1)
        hit = np.arange(mesh.nodes) == edge[..., None] * mesh.order
        total = total + hit[..., None] * loads[..., place, None, :]
    return total


class ElementResidual:
    """Residual of elements, for Newton's method: distance of end 2 from its place under a tension vector c.

    Parameters
    ----------
    span : Span
        Fields of shape (...).
    mesh : Mesh
    force : ndarray, shape (...)
        Unit of force. [N]
    nodal : ndarray, shape (..., nodes, 3), optional
        Dead loads on the nodes beside weight and point loads. [N]

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
        self.transferred = static_force_transfer(mesh, self.loads[..., 1:-1, :])
        self.weights = mesh.point_weights.ravel()
        self.axial = (force / np.asarray(span.axial_stiffness, dtype=float))[..., None]
        self.chord = np.zeros((*np.shape(force), self.axes))
        self.chord[..., 0] = span.chord_strain

    def residual(self, unknown):
        """g, shape (d, ...); at the points tension vectors, tensions, tangents and r' minus the chord's direction."""
        force = np.ascontiguousarray(np.moveaxis(unknown, 0, -1))[..., None, :] - self.transferred
        size = np.maximum(np.sqrt((force**2).sum(axis=-1)), CABLE.tiny)
        t = force / size[..., None]
        aside = (t[..., 1:] ** 2).sum(axis=-1)
        ahead = t[..., 0] > 0
        back = np.where(ahead, -aside / np.where(ahead, 1 + t[..., 0], 1.0), t[..., 0] - 1)
        slope = (self.axial * size)[..., None] * t
        slope[..., 0] += back
        slope[..., 1:] += t[..., 1:]
        return np.moveaxis(self.chord - self.weights @ slope, -1, 0), (force, size, t, slope)

    def step(self, gap, point):
        """Newton step of c, shape (d, ...): sum of w (t t^T/EA + |r'|/T (I - t t^T)) inverted, times g."""
        _, size, t, _ = point
        axial, weights = self.axial, self.weights
        flexibility = local_compliance(t, weights * axial, weights * (1 / size + axial)).sum(axis=-3)
        return np.moveaxis((inverse(flexibility) @ np.moveaxis(gap, 0, -1)[..., None])[..., 0], -1, 0)

    def relative(self, step, _, point):
        """Size of a step over the largest tension and the largest transverse one, shape (...). [-]"""
        force, size, _, _ = point
        largest = size.max(axis=-1)
        aside = np.sqrt((force[..., 1:] ** 2).sum(axis=-1)).max(axis=-1)
        across = np.sqrt((step[1:] ** 2).sum(axis=0)) / np.maximum(aside, 1e-16 * largest)
        return np.maximum(np.sqrt((step**2).sum(axis=0)) / largest, across)

    def rounding(self, step):
        """Error of the slope along a step by rounding of the residual, shape (...)."""
        return 1e-15 * np.abs(self.chord[..., 0] * step[0]) + 1e-16 * np.abs(step).max(axis=0)

    def slack(self, point):
        """True where the complementary energy is least at its kink where the smallest tension vanishes, shape (...)."""
        force, size, _, _ = point
        least = np.argmin(size, axis=-1)
        there = np.take_along_axis(np.broadcast_to(self.transferred, force.shape), least[..., None, None], axis=-2)
        gap, _ = self.residual(np.moveaxis(there[..., 0, :], -1, 0))
        return np.sqrt((gap**2).sum(axis=0)) <= self.weights[least]


def solve_many(catenary, mesh, uneven=None):
    """Equilibria of one discrete cable or of many on one mesh, from their `Catenary` as the start.

    Parameters
    ----------
    catenary : Catenary
    mesh : Mesh
    uneven : callable, optional
        `State` -> force per unstretched length at the Gauss points beside the uniform one, chord frame, shape
        (..., n, q, 3) [N/m]. It depends on where the cable hangs, so the equilibrium is sought until both agree.

    Returns
    -------
    state : State
    record : Record
        Whether each cable is in equilibrium.
    """
    if uneven is None:
        return _solve_loads(catenary, mesh)
    length = np.asarray(catenary.span.unstretched_length)[..., None, None]
    before = np.zeros((*np.shape(catenary.max_tension), mesh.nodes, 3))
    state, record = _solve_loads(catenary, mesh, before)
    for _ in range(CABLE.uneven_load_steps):
        field = uneven(state)
        nodal = _on_nodes(mesh, field) * length
        state, record = _solve_loads(catenary, mesh, nodal)
        state = replace(state, uneven=(mesh.point_weights[..., None] * field).sum(axis=-2) * length)
        change, before = np.abs(nodal - before).sum(axis=(-1, -2)), nodal
        settled = change <= CABLE.uneven_load_change * np.asarray(catenary.max_tension)
        if (settled | ~record.converged).all():
            return state, record
    return state, replace(record, reason=np.where(settled, record.reason, STALLED))


def _on_nodes(mesh, field):
    """Nodal forces of a force per length at the Gauss points, shape (..., n, q, 3), over the unstretched length."""
    element = basis(mesh.order)
    values = lagrange(element.nodes, element.points)  # shape (q, p + 1)
    shared = values.T @ (mesh.point_weights[..., None] * field)
    nodal = np.zeros((*field.shape[:-3], mesh.nodes, 3))
    for place in range(mesh.order + 1):
        nodal[..., mesh.element_nodes[:, place], :] += shared[..., place, :]
    return nodal


def _solve_loads(catenary, mesh, nodal=None):
    """As `solve_many`, with dead loads on the nodes beside weight and point loads, shape (..., nodes, 3). [N]"""
    span, reference = catenary.span, np.asarray(catenary.max_tension)
    problem = ElementResidual(span, mesh, reference, nodal)
    start = catenary.at(np.zeros(1))[1][..., 0, : problem.axes] / reference[..., None] - problem.loads[..., 0, :]
    active = np.ones(start.shape[:-1], dtype=bool)
    _, point, record = newton(problem, np.moveaxis(start, -1, 0), active)
    if not record.converged.all():
        slack = ~record.converged & problem.slack(point)
        record = replace(record, reason=np.where(slack, SLACK, record.reason))
    force, _, _, slope = point
    excess = slope - problem.chord[..., None, :]
    displacement = np.zeros((*excess.shape[:-2], mesh.nodes, 3))
    moved = transposed_force_transfer(mesh, problem.weights[:, None] * excess)
    displacement[..., 1:-1, : problem.axes] = -moved
    whole = np.zeros((*force.shape[:-1], 3))
    whole[..., : problem.axes] = force
    state = _state(catenary, mesh, whole, displacement)
    return (state if nodal is None else replace(state, mirror_symmetric=False)), record


def solve(catenary, mesh):
    """Equilibrium of one discrete cable; as `solve_many`, but without an equilibrium it raises.

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
    """`ConvergenceError` that states why one discrete cable has no equilibrium, from its `Record`."""
    if record.reason == SLACK:
        return ConvergenceError(
            f"too few elements ({mesh.elements} of order {mesh.order}) for so sharp a bend: "
            "one would hang slack, without tension",
            record,
        )
    return ConvergenceError(f"static form of {mesh.elements} elements of order {mesh.order}: {record}", record)
