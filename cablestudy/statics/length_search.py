"""Search for unstretched lengths: tensions that balance the loads, from a linear problem about the current ones, again.

Each step linearises the net forces F on the bodies in the tensions t of the open cables and the motions y that come
from equilibrium, with A = dF/dt and E = dF/dy,

    A (t_new - t) + E y + F = 0,

lets `tension_distribution` choose t_new and y within the bounds, and finds the lengths with which the cables have these
tensions where the bodies then are. Steps that diverge are damped.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.records import assign_rows, copy_record, take_rows
from cablestudy.cable.vectors import largest, size
from cablestudy.statics import block_stiffness, rounding, stated, tangent
from cablestudy.statics.descent import CONVERGED, ROUNDED, TOO_MANY, UNHELD, SearchRecord, imbalance
from cablestudy.statics.fitted_lengths import least_preload
from cablestudy.statics.pose_state import PoseState, displaced, end_forces_and_stiffness, extent, spans
from cablestudy.statics.rest import start
from cablestudy.statics.stated_equilibrium import with_stated
from cablestudy.statics.suspension import SuspendedSystem
from cablestudy.statics.tension_distribution import Distribution, distribute
from cablestudy.statics.tolerances import STATICS

GOING_ON = -1  # in place of a reason


@dataclass(frozen=True)
class TensionProblem:
    """Problem of finding tensions of the open cables with which bodies are in equilibrium at given positions; n cases.

    Attributes
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).
    open_cables : ndarray of int, shape (m,)
        Indices of the cables for which neither a length nor a tension or sag is stated.
    moving : ndarray of bool, shape (b, 6)
        Degrees of freedom that come from equilibrium; the others are given.
    method : {"balanced", "least", "closest"}
        Choice of the mean tensions of the open cables: least variance, least sum of squares, closest to `reference`.
    low, high, reference : ndarray, shape (n, m)
        Bounds of these tensions, and what they shall be close to. [N]
    """

    suspension: SuspendedSystem
    open_cables: np.ndarray
    moving: np.ndarray
    method: str
    low: np.ndarray
    high: np.ndarray
    reference: np.ndarray

    def take(self, index):
        """`TensionProblem` of some of the cases."""
        bounds = {name: getattr(self, name)[index] for name in ("low", "high", "reference")}
        return replace(self, suspension=self.suspension.take(index), **bounds)

    def with_preloads(self, tension):
        """`SuspendedSystem` whose open cables state mean tensions, shape (n, m). [N]"""
        value, kinds = np.array(self.suspension.value), np.array(self.suspension.stated, dtype=object)
        value[:, self.open_cables], kinds[self.open_cables] = tension, "preload"
        return replace(self.suspension, value=value, stated=tuple(kinds))


@dataclass(frozen=True)
class LengthsFound:
    """Where the searches of n cases ended.

    Attributes
    ----------
    state : PoseState
        With the lengths.
    record : SearchRecord
    distribution : Distribution
        The last one of each case.
    possible : ndarray, shape (n, m)
        Least mean tensions of the open cables in that state, see `possible_tensions`. [N]
    """

    state: PoseState
    record: SearchRecord
    distribution: Distribution
    possible: np.ndarray

    def with_converged(self, index, repeated):
        """Copy in which the cases at `index` are those of their `repeated` search, where that converged."""
        copy, converged = copy_record(self), repeated.record.converged
        assign_rows(copy, index[converged], take_rows(repeated, converged))
        return copy


@dataclass(frozen=True)
class Iterates:
    """Cases whose tensions are still searched for; arrays of k cases.

    Attributes
    ----------
    index : ndarray of int, shape (k,)
        Their numbers among all.
    tension, possible : ndarray, shape (k, m)
        Mean tensions, and what they are at least (`possible_tensions`). [N]
    direction : ndarray, shape (k, m)
        The last changes of the tensions, relative. [-]
    damping, least_damping : ndarray, shape (k,)
        Of the next step, and of all steps to come, see `with_damping`. [-]
    change, least_change : ndarray, shape (k,)
        Size of the last step, and the smallest one so far. [-]
    outside : ndarray, shape (k,)
        Sum of the tensions beyond their bounds, the smallest so far. [N]
    stalled, infeasible : ndarray of int, shape (k,)
        Steps in a row that were hardly smaller than those before, and that left no tensions within the bounds.
    """

    index: np.ndarray
    tension: np.ndarray
    possible: np.ndarray
    direction: np.ndarray
    damping: np.ndarray
    least_damping: np.ndarray
    change: np.ndarray
    least_change: np.ndarray
    outside: np.ndarray
    stalled: np.ndarray
    infeasible: np.ndarray


def search(problem, least_ratio):
    """Find lengths of the open cables, those with nothing stated, that hold bodies at given positions: `LengthsFound`.

    Parameters
    ----------
    problem : TensionProblem
        Bodies, cables, bounds, and how to choose among several solutions; n cases.
    least_ratio : float
        Lower bound of the mean tension of each open cable, over the least that it can have by its own weight. [-]

    Notes
    -----
    A search converges where the net forces are no more than the rounding of their sums, and the next step would change
    the tensions by no more than rounding. It converges too where steps get no smaller, and the net forces are no more
    than what rounding of lengths and positions makes (`rounding.Bounds`). It has no answer where several steps in a row
    find no tensions within the bounds and come no closer to them.
    """
    # `found` is of all cases, `active`, `state` and `iterates` of those still searched for
    active, state, iterates = first_iterates(problem, least_ratio)
    for number in range(STATICS.lengths_steps + 1):
        index, linear = iterates.index, linearised(active, state)
        right = (linear.by_tension @ iterates.tension[..., None])[..., 0] - linear.net
        solutions = distribute(
            linear.by_tension,
            linear.by_motion,
            right,
            problem.method,
            reference=active.reference,
            low=iterates.possible,
            high=active.high,
            damping=iterates.damping,
            current=iterates.tension,
        )
        step, tension, turn, change = limited_steps(active, state, iterates, solutions)
        iterates = with_infeasible(iterates, solutions, active.high, least_ratio)
        iterates, reason = with_reasons(iterates, linear, solutions, change, last=number == STATICS.lengths_steps)
        record = SearchRecord(np.full(len(index), number), linear.imbalance, change, reason)
        of_active = LengthsFound(state, record, solutions, iterates.possible)
        if number == 0:
            found = copy_record(of_active)
        assign_rows(found, index, of_active)
        going_on = np.flatnonzero(reason == GOING_ON)
        if not len(going_on):
            break
        iterates = take_rows(with_damping(iterates, tension, change, turn, number), going_on)
        active, tension = active.take(going_on), tension[going_on]
        state = displaced(active.suspension, take_rows(state, going_on), step[going_on])
        active, iterates = with_tensions(active, state, iterates, tension, least_ratio)
        state = with_stated(active.suspension, state)
    return found


def first_iterates(problem, least_ratio):
    """Problem whose open cables state first tensions as preloads, its `PoseState`, and `Iterates` of all cases."""
    suspension = problem.suspension
    lengths = {"stated": ("unstretched_length",) * len(suspension.stated), "value": np.ones_like(suspension.value)}
    of_any_length = replace(suspension, **lengths)
    tension = first_tensions(problem, start(of_any_length))
    problem = replace(problem, suspension=problem.with_preloads(tension))
    state = with_stated(problem.suspension, start(problem.suspension))
    cases = len(tension)
    infinite = np.full(cases, np.inf)
    iterates = Iterates(
        index=np.arange(cases),
        tension=tension,
        possible=possible_tensions(problem, state, problem.low, tension, least_ratio),
        direction=np.zeros_like(tension),
        damping=np.zeros(cases),
        least_damping=np.zeros(cases),
        change=infinite,
        least_change=infinite,
        outside=infinite,
        stalled=np.zeros(cases, dtype=int),
        infeasible=np.zeros(cases, dtype=int),
    )
    return problem, state, iterates


def first_tensions(problem, state):
    """Mean tensions with which the search begins, within their bounds, shape (n, m). [N]

    Without bounds, all loads over the number of open cables, but at least twice the weight of each cable.
    """
    suspension, open_cables, low, high = problem.suspension, problem.open_cables, problem.low, problem.high
    gravity = np.abs(suspension.gravity)[:, None]
    loads = (suspension.mass * gravity + size(suspension.force)).sum(axis=-1)
    cable_weights = suspension.cable_mass * gravity * size(state.chord)
    cable_loads = cable_weights.sum(axis=-1)
    if suspension.load_forces is not None:
        cable_loads = cable_loads + size(suspension.load_forces).sum(axis=(-1, -2))
    tension = np.maximum((loads + cable_loads)[:, None] / len(open_cables), 2 * cable_weights[:, open_cables])
    middle = np.where(np.isfinite(high), (low + high) / 2, np.maximum(tension, 2 * low))
    tension = np.where((tension < low) | (tension > high), middle, tension)
    # without any load: a strain that hardly shows
    return np.where(tension > 0, tension, 1e-6 * suspension.axial_stiffness[:, open_cables])


@dataclass(frozen=True)
class LinearForces:
    """Net forces F, and derivatives A by the tensions of m open cables, E by f moving degrees of freedom; n cases.

    Rows are the d free degrees of freedom of the bodies. Moments are divided by the size of the body, a length, and
    rotations are multiplied by it.

    Attributes
    ----------
    net : ndarray, shape (n, d)
        F. [N]
    by_tension : ndarray, shape (n, d, m)
        A. [-]
    by_motion : ndarray, shape (n, d, f)
        E. [N/m]
    imbalance : ndarray, shape (n,)
        Largest net force over the sum of forces. [-]
    over_least, over_most : ndarray, shape (n,)
        Largest net force over its rounding, `least` and `most` of `rounding.Bounds`. [-]
    tension_rounding : ndarray, shape (n,)
        Largest relative rounding of the tensions of the open cables, by that of lengths and positions. [-]
    """

    net: np.ndarray
    by_tension: np.ndarray
    by_motion: np.ndarray
    imbalance: np.ndarray
    over_least: np.ndarray
    over_most: np.ndarray
    tension_rounding: np.ndarray


def linearised(problem, state):
    """Net forces F on the bodies, linear in the tensions and motions that a step of `search` changes: `LinearForces`.

    The derivatives are A = dF/dt by the mean tensions t of the open cables, and E = dF/dy by the motions y of bodies
    that are not given. Along y each cable keeps its stated length, tension or sag.

    Parameters
    ----------
    problem : TensionProblem
        For its open cables the current mean tensions are stated (`TensionProblem.with_preloads`).
    state : PoseState
        Pose of the bodies, and lengths of the cables, of n cases.
    """
    suspension, quantities = problem.suspension, problem.suspension.stated
    cables = catenary.solve(spans(suspension, state), state.tension)
    rates = stated.rates(cables, quantities)
    forces, stiffness, links = end_forces_and_stiffness(suspension, state, cables, rates.stiffness)
    net, scale = tangent.net_forces(suspension, state.rotation, state.arms, forces, cables.max_tension)
    blocks = tangent.stiffness_blocks(suspension, state.rotation, state.arms, forces, stiffness)
    at_constant_lengths = block_stiffness.dense(blocks, suspension)
    force_by_value, stiffness = at_stated_values(suspension, state.arms, rates, at_constant_lengths)
    sizes = block_stiffness.free_values(suspension, tangent.motion_units(suspension))
    # in this memory order for any number of cases: the sums of a product of matrices follow it
    by_tension = np.ascontiguousarray(np.swapaxes(force_by_value[:, problem.open_cables], -1, -2) / sizes[..., None])
    by_motion = -(stiffness / (sizes[:, :, None] * sizes[:, None, :]))[..., problem.moving[suspension.free]]
    ends, strain = state.ends, state.strain
    bounds = rounding.bounds(suspension, state.rotation, state.arms, ends, strain, cables, cables.max_tension, links)
    of_values = rounding.of_stated(ends[:, suspension.of_cables], strain, cables, quantities, suspension.value)
    return LinearForces(
        net=block_stiffness.free_values(suspension, net) / sizes,
        by_tension=by_tension,
        by_motion=np.ascontiguousarray(by_motion),
        imbalance=imbalance(suspension, net, scale),
        over_least=rounding.largest_ratio(suspension, net, bounds.least),
        over_most=rounding.largest_ratio(suspension, net, bounds.most),
        tension_rounding=of_values.most[:, problem.open_cables].max(axis=-1),
    )


def at_stated_values(suspension, arms, rates, stiffness):
    """Stiffness of a suspension while each cable keeps its stated tension, sag or length v, and dF/dv.

    The length L of a cable adjusts to v. Along a motion u of the bodies the net forces F on them change by

        dF = -(K + (dF/dv) (dv/du)) du

    with the stiffness K (`stiffness`, shape (n, d, d)) and the derivative dv/du at constant lengths. `rates` are the
    `stated.Rates` of all cables, `arms` those of `PoseState`.

    Returns
    -------
    force_by_value : ndarray, shape (n, c, d)
        dF/dv = (dF/dL)/(dv/dL) for each cable, the bodies at rest.
    stiffness : ndarray, shape (n, d, d)
        K + (dF/dv) (dv/du).
    """
    all_cables, arms = np.arange(len(suspension.stated)), arms[:, suspension.of_cables]
    force_by_length = tangent.by_body(suspension, all_cables, tangent.wrenches(arms, rates.end_forces))
    value_by_ends = rates.by_end[..., None, :] * np.array([-1.0, 1.0])[:, None]
    value_by_motion = tangent.by_body(suspension, all_cables, tangent.wrenches(arms, value_by_ends))
    value_by_length = rates.by_length[..., None]
    force_by_value = force_by_length / np.where(value_by_length != 0, value_by_length, np.inf)
    return force_by_value, stiffness + np.swapaxes(force_by_value, -1, -2) @ value_by_motion


def limited_steps(problem, state, iterates, solutions):
    """Steps of bodies and tensions in `search`, shortened to where its linear equations are still about right; k cases.

    Displacements are limited to `STATICS.farthest_step` times the extent of the suspension, rotations to
    `STATICS.widest_turn`. The change of the tensions is shortened by the same factor. No tension falls below the share
    `STATICS.least_tension_share` of its value.

    Returns
    -------
    step : ndarray, shape (k, b, 6)
        Displacement and rotation of each of the b bodies. [m], [rad]
    tension : ndarray, shape (k, m)
        Mean tensions of the open cables after the step. [N]
    turn : ndarray, shape (k,)
        Largest rotation of a body before the step is shortened. [rad]
    change : ndarray, shape (k,)
        Size of the step, about as large as without damping: largest change of a tension over the largest tension, plus
        the largest component of the step of the bodies. [-]
    """
    step = np.zeros((*state.position.shape[:-1], 6))
    step[:, problem.moving] = solutions.unbounded
    step = step / tangent.motion_units(problem.suspension)
    turn = largest(step[..., 3:]).max(axis=-1)
    displacement = largest(step[..., :3]).max(axis=-1) / (STATICS.farthest_step * extent(state))
    share = 1 / np.maximum(1.0, np.maximum(displacement, turn / STATICS.widest_turn))
    step = step * share[:, None, None]
    tension = iterates.tension + share[:, None] * (solutions.tension - iterates.tension)
    tension = np.maximum(tension, STATICS.least_tension_share * iterates.tension)
    change = np.abs(tension - iterates.tension).max(axis=-1) / iterates.tension.max(axis=-1)
    return step, tension, turn, (change + largest(step).max(axis=-1)) * (1 + iterates.damping**2)


def with_infeasible(iterates, solutions, high, least_ratio):
    """`Iterates` with the number of successive steps for which no tensions are within the bounds.

    A step counts where nothing holds the loads, where cables would have to push or are too heavy for their bounds, and
    where it comes no closer to the bounds than those before.
    """
    tension, held, within = solutions.tension, solutions.held, solutions.within
    outside = np.maximum(np.maximum(iterates.possible - tension, tension - high), 0.0).sum(axis=-1)
    too_heavy = (iterates.possible > least_ratio * high).any(axis=-1)
    no_closer = outside >= STATICS.lengths_progress * iterates.outside
    infeasible = ~held | (~within & (too_heavy | (tension.min(axis=-1) < 0) | no_closer))
    return replace(
        iterates,
        infeasible=np.where(infeasible, iterates.infeasible + 1, 0),
        outside=np.where(within, np.inf, np.minimum(outside, iterates.outside)),
    )


def with_reasons(iterates, linear, solutions, change, last):
    """`Iterates` with their smallest change, and the reason why each ends: index in REASONS, or GOING_ON.

    `change` is that of `limited_steps`; `last` is true in the last step that a search may take.
    """
    falling = change < STATICS.lengths_progress * iterates.least_change
    iterates = replace(
        iterates,
        stalled=np.where(falling, 0, iterates.stalled + 1),
        least_change=np.minimum(change, iterates.least_change),
    )
    balanced = solutions.held & solutions.within
    settled = change <= linear.tension_rounding
    converged = (linear.over_least <= 1) & settled
    stuck = (iterates.stalled >= np.where(settled, 1, STATICS.lengths_patience)) | last
    rounded = stuck & (linear.over_most <= 1) & (change < STATICS.rough_balance)
    ended = converged | rounded | (iterates.infeasible >= STATICS.infeasible_steps) | last
    reason = np.where(balanced, np.where(converged, CONVERGED, np.where(rounded, ROUNDED, TOO_MANY)), UNHELD)
    return iterates, np.where(ended, reason, GOING_ON)


def with_damping(iterates, tension, change, turn, number):
    """`Iterates` with the damping of the next step, more where step `number` (from 0) diverges.

    After a diverging step the damping is three times as large, and so is the least damping from then on. After other
    steps it is a third, but not below the least damping, which is a third too after slow steps.
    """
    direction = (tension - iterates.tension) / iterates.tension
    reversed_step = (iterates.direction * direction).sum(axis=-1) < 0
    diverging = (
        (turn > STATICS.largest_turn)
        | ((change > STATICS.shrinking_step * iterates.change) & reversed_step & (number > 2))
        | (change > STATICS.growing_step * iterates.change)
    )
    slow, damping, least = change > STATICS.slow_step * iterates.change, iterates.damping, iterates.least_damping
    least = np.where(diverging, np.maximum(least, 3 * damping), np.where(slow, least / 3, least))
    more = np.clip(3 * damping, STATICS.damped_lengths, STATICS.most_damped_lengths)
    damping = np.where(diverging, more, np.maximum(damping / 3, least))
    return replace(iterates, direction=direction, damping=damping, least_damping=least, change=change)


def with_tensions(problem, state, iterates, tension, least_ratio):
    """Problem and `Iterates` with the tensions asked for, raised to what is possible where the bodies are."""
    possible = possible_tensions(problem, state, problem.low, tension, least_ratio)
    tension = np.maximum(tension, np.minimum(possible, problem.high))
    problem = replace(problem, suspension=problem.with_preloads(tension))
    return problem, replace(iterates, tension=tension, possible=possible)


def possible_tensions(problem, state, low, tension, least_ratio):
    """Lower bounds `low` of mean tensions, raised to what each cable has at least by its own weight, shape (n, m). [N]

    For a cable with more tension than the weight of its chord length that least tension is taken as that of a level
    cable that does not stretch.
    """
    suspension, open_cables = problem.suspension, problem.open_cables
    chord_weight = (suspension.cable_mass * suspension.cable_gravity[0] * size(state.chord))[:, open_cables]
    least, light = STATICS.least_level_tension * chord_weight, tension < chord_weight
    if np.any(light):
        least = np.where(light, least_preload(spans(suspension, state))[:, open_cables], least)
    return np.maximum(low, least_ratio * least)


def near_least(problem, state):
    """True where an open cable has less tension than the weight of its chord, and none is too heavy, shape (n,).

    A cable is too heavy where the least tension that it can have by its own weight is above its bound. Where the result
    is false, the bounds of `possible_tensions` do not decide on an answer.
    """
    cables, open_cables = catenary.solve(spans(problem.suspension, state), state.tension), problem.open_cables
    less_than_weight = cables.mean_tension < cables.span.weight_per_length * cables.span.chord
    least = possible_tensions(problem, state, 0.0, cables.mean_tension[:, open_cables], 1.0)
    return less_than_weight[:, open_cables].any(axis=-1) & (least <= problem.high).all(axis=-1)
