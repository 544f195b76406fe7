"""The static form of the elements: Newton on one tension vector, from the catenary, with a guarded step.

With loads on its nodes the tension vectors at a cable's Gauss points are N = c - S f (see `assembly`), so that only c
is unknown: the places of the ends determine it. It minimises the complementary energy, which is strictly convex. A c
that fulfils the equation while every tension is positive is therefore THE equilibrium: no false state passes.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.assembly import State, inverse, local_compliance, static_force_transfer, transposed_force_transfer
from cablestudy.cable.element import basis, lagrange
from cablestudy.errors import ConvergenceError

MAX_STEPS = 60
HALVINGS = 40
TOLERANCE = 1e-9  # of the last correction: the error left is about its square
TINY = 1e-300
CONVERGED = "converged"


@dataclass(frozen=True)
class Step:
    """One Newton step.

    Attributes
    ----------
    residual : float
        How far end 2 was from its place before the step, over the length. [-]
    correction : float
        Change of the tension over the largest one, or of its part across the chord over the largest such part. [-]
    share : float
        Share of the full step that was taken. [-]
    """

    residual: float
    correction: float
    share: float


@dataclass(frozen=True)
class Convergence:
    """How a Newton iteration went.

    Attributes
    ----------
    steps : tuple of Step
    reason : str
        Why it stopped.
    """

    steps: tuple
    reason: str

    def __str__(self):
        trace = ", ".join(f"{step.correction:.1e}" for step in self.steps)
        return f"{len(self.steps)} steps ({trace}); {self.reason}"


def from_catenary(catenary, mesh):
    """The continuous cable, sampled at the nodes and Gauss points of a mesh.

    Parameters
    ----------
    catenary : Catenary
        One cable, or many.
    mesh : Mesh

    Returns
    -------
    State
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
    compliance = reference / np.asarray(catenary.span.axial_stiffness, dtype=float)
    size = np.sqrt((force**2).sum(axis=-1))
    shape = (*size.shape[:-1], mesh.elements, mesh.order)
    return State(
        mesh=mesh,
        direction=(force / np.maximum(size, TINY)[..., None]).reshape(*shape, 3),
        tension=size.reshape(shape),
        stretch=(1 + compliance[..., None] * size).reshape(shape),
        displacement=displacement,
        compliance=compliance,
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


def solve(catenary, mesh):
    """Equilibrium of the discrete cable.

    Parameters
    ----------
    catenary : Catenary
        One cable, solved: the start.
    mesh : Mesh

    Returns
    -------
    state : State
    convergence : Convergence

    Raises
    ------
    ConvergenceError
        No equilibrium with every tension positive was reached; its record is the Convergence.
    """
    state, record = solve_many(catenary, mesh)
    convergence = record.of(())
    if convergence.reason != CONVERGED:
        raise record.error(())
    return state, convergence


@dataclass(frozen=True)
class Record:
    """How the Newton iterations of many cables went.

    Attributes
    ----------
    residual, correction, share : ndarray, shape (steps, ...)
        As in `Step`; not a number once a cable has stopped.
    slack : ndarray of bool, shape (...)
        Whether a piece hangs slack in equilibrium, without tension.
    converged : ndarray of bool, shape (...)
    mesh : Mesh
    """

    residual: np.ndarray
    correction: np.ndarray
    share: np.ndarray
    slack: np.ndarray
    converged: np.ndarray
    mesh: object

    def of(self, index):
        """`Convergence` of one cable."""
        columns = (self.residual, self.correction, self.share)
        rows = zip(*(part[(slice(None), *np.atleast_1d(index))].tolist() for part in columns), strict=True)
        steps = tuple(Step(*row) for row in rows if row[2] == row[2])
        reason = CONVERGED
        if not self.converged[index]:
            reason = f"no convergence in {len(steps)} steps, last correction {steps[-1].correction:.1e}"
            if self.slack[index]:
                reason = "somewhere the cable hangs slack"
        return Convergence(steps, reason)

    def error(self, index):
        """Why one cable has no equilibrium."""
        record, mesh = self.of(index), self.mesh
        if self.slack[index]:
            return ConvergenceError(
                f"too few elements ({mesh.elements} of order {mesh.order}) for so sharp a bend: "
                "one would hang slack, without tension",
                record,
            )
        return ConvergenceError(
            f"static form of {mesh.elements} elements of order {mesh.order}: {record.reason}", record
        )


def solve_many(catenary, mesh):
    """Equilibria of discrete cables that share a mesh.

    Parameters
    ----------
    catenary : Catenary
        Fields of shape (...).
    mesh : Mesh

    Returns
    -------
    state : State
    record : Record
        Tells for each cable whether it is in equilibrium.
    """
    span, reference = catenary.span, np.asarray(catenary.max_tension)
    axes = 2 if span.planar else 3
    loads = external_forces(span, mesh, reference)[..., :axes]
    transferred = static_force_transfer(mesh, loads[..., 1:-1, :])
    unknown = catenary.at(np.zeros(1))[1][..., 0, :axes] / reference[..., None] - loads[..., 0, :]
    weights = mesh.point_weights.ravel()
    axial_flexibility = (reference / np.asarray(span.axial_stiffness, dtype=float))[..., None]
    target = np.zeros(unknown.shape)
    target[..., 0] = span.chord_strain

    def at(unknown):
        """Tension vectors, tensions and gradients less the chord's direction at the points, and the gap at end 2."""
        force = unknown[..., None, :] - transferred
        size = np.maximum(np.sqrt((force**2).sum(axis=-1)), TINY)
        t = force / size[..., None]
        aside = (t[..., 1:] ** 2).sum(axis=-1)
        ahead = t[..., 0] > 0
        back = np.where(ahead, -aside / np.where(ahead, 1 + t[..., 0], 1.0), t[..., 0] - 1)
        slope = (axial_flexibility * size)[..., None] * t
        slope[..., 0] += back
        slope[..., 1:] += t[..., 1:]
        return force, size, t, slope, target - weights @ slope

    force, size, t, slope, gap = at(unknown)
    active, change = np.ones(size.shape[:-1], dtype=bool), np.full(size.shape[:-1], np.inf)
    converged = np.zeros(size.shape[:-1], dtype=bool)
    trace = []
    for _ in range(MAX_STEPS):
        own = local_compliance(t, weights * axial_flexibility, weights * (1 / size + axial_flexibility))
        step = (inverse(own.sum(axis=-3)) @ gap[..., None])[..., 0]
        slope_along = (gap * step).sum(axis=-1)
        rounding = 1e-15 * np.abs(target[..., 0] * step[..., 0]) + 1e-16 * np.abs(step).max(axis=-1)
        last, change = change, _change(step, force, size)
        share = active.astype(float)
        for _ in range(HALVINGS):
            trial = unknown + share[..., None] * step
            found = at(trial)
            worse = active & ((found[-1] * step).sum(axis=-1) < -0.5 * slope_along - rounding) & (change > 1e-12)
            if not worse.any():
                break
            share = np.where(worse, share / 2, share)
        residual = np.where(active, np.abs(gap).max(axis=-1), np.nan)
        trace.append((residual, np.where(active, change, np.nan), np.where(active, share, np.nan)))
        unknown, (force, size, t, slope, gap) = trial, found
        settled = (change < TOLERANCE) | ((change < 1e-6) & (change >= last / 2))
        converged |= active & settled & (share == 1)
        active = active & ~settled & ~worse & np.isfinite(change)
        if not active.any():
            break
    excess = slope - target[..., None, :]
    displacement = np.zeros((*excess.shape[:-2], mesh.nodes, 3))
    displacement[..., 1:-1, :axes] = -transposed_force_transfer(mesh, weights[:, None] * excess)
    whole = np.zeros((*force.shape[:-1], 3))
    whole[..., :axes] = force
    slack = np.zeros_like(converged)
    if not converged.all():  # the energy has a kink where a tension vanishes: is its minimum at the smallest one's?
        least = np.argmin(size, axis=-1)
        there = np.take_along_axis(np.broadcast_to(transferred, force.shape), least[..., None, None], axis=-2)[
            ..., 0, :
        ]
        slack = ~converged & (np.sqrt((at(there)[-1] ** 2).sum(axis=-1)) <= weights[least])
    traces = (np.array(part) for part in zip(*trace, strict=True))
    return _state(catenary, mesh, whole, displacement), Record(*traces, slack, converged, mesh)


def _change(step, force, size):
    """Size of a correction, in all and across the chord: a steep cable's sag hangs on its small part across."""
    whole = np.sqrt((step**2).sum(axis=-1)) / size.max(axis=-1)
    aside = np.sqrt((force[..., 1:] ** 2).sum(axis=-1)).max(axis=-1)
    return np.maximum(whole, np.sqrt((step[..., 1:] ** 2).sum(axis=-1)) / np.maximum(aside, 1e-16 * size.max(axis=-1)))


def interpolate(state, positions):
    """Displacement and tension between the nodes.

    Parameters
    ----------
    state : State
    positions : ndarray, shape (j,)
        Unstretched arc length over unstretched length. [-]

    Returns
    -------
    displacement : ndarray, shape (j, 3)
        From the chord, in unstretched lengths, chord frame. [-]
    tension : ndarray, shape (j,)
        Interpolated between the Gauss points of the element; constant in a bar. [N]
    """
    mesh, element = state.mesh, basis(state.mesh.order)
    positions = np.asarray(positions, dtype=float)
    which = np.clip(np.searchsorted(mesh.edges, positions, side="left") - 1, 0, mesh.elements - 1)
    local = (positions - mesh.edges[which]) / mesh.sizes[which]
    index = which[:, None] * mesh.order + np.arange(mesh.order + 1)
    displacement = np.einsum("ji,jia->ja", lagrange(element.nodes, local), state.displacement[index])
    tension = np.einsum("jq,jq->j", lagrange(element.points, local), state.tension[which])
    return displacement, tension * state.force


def sag(span, state, start):
    """Vertical distance from the chord down to the cable at mid-span.

    Parameters
    ----------
    span : Span
    state : State
    start : float
        Arc length at mid-span of the continuous cable, over unstretched length; used as it is for a vertical cable. [-]

    Returns
    -------
    float
        [m]
    """
    up, stretch = np.asarray(span.up), 1 + float(span.chord_strain)

    def vertical_and_horizontal(position):
        place = interpolate(state, np.array([position]))[0][0]
        place[0] += stretch * (position - 0.5)
        return place @ up, place[0] * span.cosine - place[1] * span.sine

    position = start
    if span.cosine > 1e-9 and abs(vertical_and_horizontal(start)[1]) > 1e-16:
        from scipy.optimize import brentq

        position = brentq(lambda s: vertical_and_horizontal(s)[1], 0.0, 1.0, xtol=1e-15)
    return -float(vertical_and_horizontal(position)[0] * span.unstretched_length)
