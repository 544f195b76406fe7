"""The static form: Newton on displacements and tensions, from the catenary, with a guarded step and a record.

The energy of a cable that bears no compression is convex. A state in equilibrium whose tensions are all positive is
therefore THE equilibrium: the last check of `solve` is a proof, and no false state passes.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, SPATIAL, State, System
from cablestudy.cable.catenary import solve as closed_form
from cablestudy.cable.element import basis, lagrange
from cablestudy.errors import ConvergenceError

MAX_STEPS = 40
SLACK = 1e-7  # share of the largest tension below which a piece of the lumped chain hangs slack
TOLERANCE = 1e-9  # of the last correction: the error left is about its square


@dataclass(frozen=True)
class Step:
    """One Newton step.

    Attributes
    ----------
    residual : float
        Largest force out of balance before the step over the largest tension. [-]
    correction : float
        Largest change of a tension over the largest tension, or of a place over the length. [-]
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
        One cable.
    mesh : Mesh

    Returns
    -------
    State
        Exact at every point; `solve` turns it into the equilibrium of the discrete cable.
    """
    points = mesh.point_positions
    displacement, force = catenary.at(np.concatenate([mesh.node_positions, points.ravel()]))
    displacement, force = displacement[: mesh.nodes].copy(), force[mesh.nodes :]
    displacement[-1] = 0.0
    size = np.sqrt((force**2).sum(axis=-1))
    reference = float(catenary.max_tension)
    stiffness = float(catenary.span.axial_stiffness)
    tension = size.reshape(points.shape)
    direction = (force / np.maximum(size, 1e-300)[:, None]).reshape(*points.shape, 3)
    return State(
        mesh=mesh,
        direction=direction,
        tension=tension / reference,
        stretch=1 + tension / stiffness,
        displacement=displacement,
        compliance=reference / stiffness,
        force=reference,
    )


def gradient(span, mesh, displacement):
    """r' minus the unit vector along the chord, at the Gauss points, shape (n, q, 3). [-]"""
    index = mesh.element_nodes
    slope = np.einsum("qi,eia->eqa", basis(mesh.order).derivative, displacement[index]) / mesh.sizes[:, None, None]
    slope[..., 0] += span.chord_strain
    return slope


def tangent(slope):
    """Unit tangent and strain from `gradient`, without cancellation for small strain."""
    excess = 2 * slope[..., 0] + (slope**2).sum(axis=-1)
    stretch = np.sqrt(np.maximum(1 + excess, 0.0))
    direction = slope / np.maximum(stretch, 1e-300)[..., None]
    direction[..., 0] += 1 / np.maximum(stretch, 1e-300)
    return direction, excess / (1 + stretch)


def external_forces(span, mesh, force):
    """Weight and point loads on the nodes, shape (nodes, 3), in units of `force`. [-]"""
    nodal = np.zeros((mesh.nodes, 3))
    shares = mesh.sizes[:, None] * basis(mesh.order).shares
    index = mesh.element_nodes
    np.add.at(nodal, index, -float(span.weight) / force * shares[..., None] * np.asarray(span.up))
    for position, load in zip(span.load_positions / span.unstretched_length, span.load_forces, strict=True):
        edge = int(np.argmin(np.abs(mesh.edges - position)))
        nodal[edge * mesh.order] += load / force
    return nodal


def lumped_chain(catenary, mesh):
    """The cable with its weight gathered at the nodes: straight weightless pieces, solved in closed form.

    For order 1 this is the exact discrete equilibrium; it helps where a few elements must follow a sharp bend.

    Returns
    -------
    Catenary
    """
    span = catenary.span
    nodal = external_forces(span, mesh, 1.0)[1:-1]
    positions = mesh.node_positions[1:-1] * span.unstretched_length
    return closed_form(replace(span, mass=0.0, load_positions=positions, load_forces=nodal))


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
    try:
        return _newton(catenary.span, from_catenary(catenary, mesh))
    except ConvergenceError as error:
        chain = lumped_chain(catenary, mesh)
        if not chain.record.converged or chain.min_tension < SLACK * chain.max_tension:
            raise ConvergenceError(
                f"too few elements ({mesh.elements} of order {mesh.order}) for so sharp a bend: "
                "one would hang slack, without tension",
                error.record,
            ) from None
        return _newton(catenary.span, from_catenary(chain, mesh))


def _newton(span, state):
    """Newton from a state whose tensions are positive."""
    mesh, displacement, tension = state.mesh, state.displacement, state.tension
    axes = IN_PLANE if span.planar else SPATIAL
    loads = external_forces(span, mesh, state.force)[1:-1][:, axes].ravel()
    weights = mesh.sizes[:, None] * basis(mesh.order).weights
    steps = []

    def at(displacement, tension):
        direction, strain = tangent(gradient(span, mesh, displacement))
        moved = replace(state, direction=direction, tension=tension, stretch=1 + strain, displacement=displacement)
        return moved, strain

    def failed(reason):
        message = f"static form of {mesh.elements} elements of order {mesh.order}: {reason}"
        return ConvergenceError(message, Convergence(tuple(steps), reason))

    while True:
        current, strain = at(displacement, tension)
        if not (strain > -1).all():
            raise failed("an element has collapsed")
        system = System(current, axes)
        unbalance = loads - internal_forces(system)[1:-1].ravel()
        mismatch = -weights * (strain - state.compliance * tension)
        try:
            shift, pull = system.solve(unbalance, mismatch.ravel())
        except ConvergenceError as error:
            raise failed(str(error)) from None
        pull = pull.reshape(tension.shape)
        change = float(max(np.abs(pull).max(), np.abs(shift).max(initial=0.0)))
        if not np.isfinite(change):
            raise failed("a correction is not finite")
        share = min(1.0, 0.9 / max(float(np.max(-pull / tension)), 0.9))
        steps.append(Step(float(np.abs(unbalance).max(initial=0.0)), change, share))
        displacement = displacement.copy()
        displacement[1:-1, axes] += share * shift.reshape(-1, len(axes))
        tension = tension + share * pull
        rounding = len(steps) > 1 and change < 1e-6 and change >= steps[-2].correction / 2
        if share == 1.0 and (change < TOLERANCE or rounding):
            break
        if len(steps) == MAX_STEPS:
            raise failed(f"no convergence in {MAX_STEPS} steps, last correction {change:.1e}")
    if tension.min() <= 0:
        raise failed("an element would be in compression: too few elements for so sharp a bend")
    return at(displacement, tension)[0], Convergence(tuple(steps), "converged")


def internal_forces(system):
    """Nodal forces of the tensions, shape (nodes, d). [-]"""
    state, axes = system.state, len(system.axes)
    per_element = np.einsum("eiq,eq->ei", system.coupling_blocks, state.tension)
    mesh = state.mesh
    index = mesh.element_nodes
    nodal = np.zeros((mesh.nodes, axes))
    np.add.at(nodal, index, per_element.reshape(*index.shape, axes))
    return nodal


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
