"""Unstretched lengths with which bodies are at given places: from tensions that balance their loads (`solve`)."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.vectors import largest, size
from cablestudy.errors import NoSolutionError
from cablestudy.statics import rest, rounding, stated, tangent
from cablestudy.statics.descent import CONVERGED, ROUNDED, TOO_MANY, UNHELD, SearchRecord, descend
from cablestudy.statics.failure import MOTIONS, explain
from cablestudy.statics.pose_state import (
    TINY,
    assign_rows,
    copy_record,
    displaced,
    end_forces_and_stiffness,
    extent,
    spans,
    take_rows,
)
from cablestudy.statics.rest import equilibrium, perturbed, refuse_unheld, start, with_stated
from cablestudy.statics.stability import UNSTABLE
from cablestudy.statics.tension_distribution import METHODS, distribute
from cablestudy.statics.tolerances import STATICS

GOING_ON = -1  # in place of a reason
# Least tension allowed of a cable over the least that it can have by its own weight: ratios tried in turn. Near a ratio
# of 1 the length of a cable hardly changes its tension, and the steps of the search are good for little
LEAST_RATIOS = (1.5, 2.0, 1.05, 1 + STATICS.least_tension_error)
UNITS = ((1e6, "MN"), (1e3, "kN"), (1.0, "N"))


def default_moving(suspension):
    """Degrees of freedom that come from equilibrium while the others are at the places that the scene gives.

    Places of junctions, and attitudes of bodies where the lengths are fewer than the equations left.

    Returns
    -------
    ndarray of bool, shape (b, 6)
    """
    moving = suspension.free.copy()
    moving[: suspension.bodies] = False
    if suspension.stated.count(None) + moving.sum() < suspension.free.sum():
        moving[: suspension.bodies, 3:] = suspension.free[: suspension.bodies, 3:]
    return moving


def solve(suspension, method="balanced", low=0.0, high=np.inf, reference=0.0, moving=None):
    """Unstretched lengths of open cables with which the bodies are in equilibrium at their given places.

    Open are the cables that state neither a length nor a tension or sag; the others keep what they state. Where there
    are more open cables than equations, `method` chooses among the tensions.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of any shape.
    method : {"balanced", "least", "closest"}
        Of the mean tensions of the open cables: least variance, least sum of squares, closest to `reference`.
    low, high, reference : float or ndarray, shape (..., c)
        Bounds of the mean tensions, and the tensions that `closest` approaches. [N]
    moving : ndarray of bool, shape (b, 6), optional
        Degrees of freedom that come from equilibrium, the others are given; default: `default_moving`.

    Returns
    -------
    Equilibrium
        Its record says for each case whether it converged; `Equilibrium.stability` whether it is stable.
    problems : ndarray of str, shape (...)
        Why there is no answer; empty where there is one.

    Raises
    ------
    NoSolutionError
        Fewer unknowns than equations, a body that nothing holds.
    ValueError
        Another method.
    """
    if method not in METHODS:
        raise ValueError(f"method is {method!r}, not one of {', '.join(METHODS)}")
    refuse_unheld(suspension)
    moving = suspension.free & (default_moving(suspension) if moving is None else np.asarray(moving, dtype=bool))
    unstated = np.array([kind is None for kind in suspension.stated])
    refuse_overdetermined(suspension, moving, int(unstated.sum()))
    shape, count = suspension.shape, len(suspension.stated)
    n = int(np.prod(shape))
    bounds = [np.broadcast_to(b, (*shape, count)).reshape(n, count)[:, unstated] for b in (low, high, reference)]
    which = np.flatnonzero(unstated)
    if np.array_equal(moving, suspension.free):
        return with_tensions_of_method(suspension, which, method, *bounds)
    flat = suspension.broadcast((n,))
    answers = search(flat, which, moving, method, *bounds, LEAST_RATIOS[0])
    # cases near the least tension of a cable are tried again with other lower bounds
    for least_ratio in LEAST_RATIOS[1:]:
        state, record, _ = answers
        failed = np.flatnonzero(~record.converged & near_least(flat, state, which, bounds[1]))
        if not len(failed):
            break
        repeated = search(flat.take(failed), which, moving, method, *(bound[failed] for bound in bounds), least_ratio)
        answers = with_converged(answers, failed, repeated)
    if moving[: suspension.bodies, 3:].any():
        answers = with_stable_attitudes(suspension, flat, answers, which, moving, method, bounds)
    state, record, problems = answers
    return equilibrium(suspension, flat, state, record), problems.reshape(shape)


def with_tensions_of_method(suspension, which, method, low, high, reference):
    """Equilibrium with the tensions that the method wants, where all that is free follows the tensions.

    Loads then rule out no tensions: those of `closest` are the reference, those of the other methods the lower bound.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of any shape, n of them.
    which : ndarray of int, shape (m,)
        Cables that state nothing.
    method : {"balanced", "least", "closest"}
    low, high, reference : ndarray, shape (n, m)
        Bounds of the mean tensions of these cables, and what they shall be close to. [N]

    Returns
    -------
    Equilibrium
    problems : ndarray of str, shape (...)
        As of `solve`.

    Raises
    ------
    NoSolutionError
        A cable with neither a lower bound nor a reference.
    """
    wanted = {"balanced": low.max(axis=-1, keepdims=True), "least": low, "closest": reference}[method]
    tension = np.clip(wanted, low, high)
    undecided = (tension <= 0).any(axis=0)
    if undecided.any():
        names = ", ".join(suspension.cable_names[cable] for cable in which[undecided])
        raise NoSolutionError(
            f"nothing decides the tensions of {names}: no body stands at a given place, and what is free finds a balance "
            "for any tensions; state tensions.min, or the method closest with a reference"
        )
    cases = suspension.broadcast((len(tension),))
    value, kinds = np.array(cases.value), np.array(suspension.stated, dtype=object)
    value[:, which], kinds[which] = tension, "preload"
    found = rest.pose(replace(cases, value=value, stated=tuple(kinds)).broadcast(suspension.shape))
    problems = np.full(suspension.shape, "", dtype=object)
    for case in np.ndindex(suspension.shape):
        if not found.record.converged[case]:
            problems[case] = explain(found.take(case))
    as_described = replace(found.suspension, stated=suspension.stated, value=suspension.broadcast().value)
    return replace(found, suspension=as_described), problems


def with_converged(answers, index, repeated):
    """Answers of `search`, those at `index` replaced by those of a `repeated` search of these cases that converged."""
    state, record, problems = copy_record(answers[0]), copy_record(answers[1]), answers[2].copy()
    new_state, new_record, new_problems = repeated
    converged = new_record.converged
    assign_rows(state, index[converged], take_rows(new_state, converged))
    assign_rows(record, index[converged], take_rows(new_record, converged))
    problems[index[converged]] = new_problems[converged]
    return state, record, problems


def with_stable_attitudes(suspension, flat, answers, which, moving, method, bounds):
    """Answers of `search` in which unstable attitudes are replaced by stable ones, where such were found.

    With the lengths of an unstable equilibrium the bodies are let go a little beside it, along its unstable motion. The
    search is repeated from the attitudes in which they come to rest, with the bodies moved back to their places. `flat`
    is the suspension with its cases in one axis, `bounds` are `low`, `high` and `reference` of `search`.
    """
    for size_of_step in STATICS.off_saddle:
        state, record, _ = answers
        stability = equilibrium(suspension, flat, state, record).stability
        falling = np.flatnonzero(record.converged & (stability.verdict == UNSTABLE).reshape(len(record.converged)))
        if not len(falling):
            break
        subset, motion = flat.take(falling), stability.motion.reshape(len(state.length), -1, 6)[falling]
        with_lengths = replace(subset, stated=("unstretched_length",) * len(flat.stated), value=state.length[falling])
        off_saddle = perturbed(with_lengths, take_rows(state, falling), motion, size_of_step)
        descended, _ = descend(with_lengths, off_saddle)
        with_attitudes = replace(subset, rotation=descended.rotation)
        repeated = search(with_attitudes, which, moving, method, *(bound[falling] for bound in bounds), LEAST_RATIOS[0])
        answers = with_converged(answers, falling, repeated)
    return answers


def refuse_overdetermined(suspension, moving, lengths):
    """Raise where there are fewer unknowns than equations.

    Raises
    ------
    NoSolutionError
        With both counts.
    """
    equations, motions = int(suspension.free.sum()), int(moving.sum())
    if lengths + motions < equations:
        raise NoSolutionError(
            f"{equations} equations of balance for {lengths + motions} unknowns ({lengths} lengths and {motions} "
            f"degrees of freedom that come from equilibrium): "
            f"leave {equations - lengths - motions} more lengths unstated"
        )


def first_tensions(suspension, state, which, low, high):
    """Mean tensions with which the search begins, within their bounds, shape (n, m). [N]

    Without bounds, all loads over the number of these cables, but at least twice the weight of each cable.
    """
    gravity = np.abs(suspension.gravity)[:, None]
    loads = (suspension.mass * gravity + size(suspension.force)).sum(axis=-1)
    cable_weights = suspension.cable_mass * gravity * size(state.chord)
    cable_loads = cable_weights.sum(axis=-1)
    if suspension.load_forces is not None:
        cable_loads = cable_loads + size(suspension.load_forces).sum(axis=(-1, -2))
    tension = np.maximum((loads + cable_loads)[:, None] / len(which), 2 * cable_weights[:, which])
    middle = np.where(np.isfinite(high), (low + high) / 2, np.maximum(tension, 2 * low))
    tension = np.where((tension < low) | (tension > high), middle, tension)
    return np.where(tension > 0, tension, 1e-6 * suspension.axial_stiffness[:, which])


@dataclass(frozen=True)
class LinearForces:
    """Net forces, and their changes with the mean tensions of some cables and with some degrees of freedom; n cases.

    Attributes
    ----------
    net : ndarray, shape (n, d)
        Moments over the size of the body. [N]
    by_tension : ndarray, shape (n, d, m)
        [-]
    by_motion : ndarray, shape (n, d, f)
        Rotations are counted times the size of the body. [N/m]
    imbalance : ndarray, shape (n,)
        Largest net force over the sum of forces. [-]
    over_least, over_most : ndarray, shape (n,)
        Largest net force over its rounding, `least` and `most` of `rounding.Bounds`. [-]
    tension_rounding : ndarray, shape (n,)
        Largest relative rounding of the tensions of these cables, by that of lengths and places. [-]
    """

    net: np.ndarray
    by_tension: np.ndarray
    by_motion: np.ndarray
    imbalance: np.ndarray
    over_least: np.ndarray
    over_most: np.ndarray
    tension_rounding: np.ndarray


def linearised(suspension, state, which, moving):
    """Net forces in a state, and their derivatives by tensions and by motions: `LinearForces`.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,); what each cable states is kept while the bodies move.
    state : PoseState
    which : ndarray of int, shape (m,)
        Cables by whose tensions the forces are differentiated.
    moving : ndarray of bool, shape (b, 6)
        Degrees of freedom by which they are differentiated, f of them.

    Notes
    -----
    By a motion u the net forces F change by -(K + (dF/dv) (dv/du)) u, with K the stiffness at given lengths and v what
    the cables state: their lengths follow so that v stays.
    """
    cables, quantities = catenary.solve(spans(suspension, state), state.tension), suspension.stated
    rates = stated.rates(cables, quantities)
    forces, stiffness, links = end_forces_and_stiffness(suspension, state, cables, rates.stiffness)
    net, scale = tangent.net_forces(suspension, state.rotation, state.arms, forces, cables.max_tension)
    blocks = tangent.stiffness_blocks(suspension, state.rotation, state.arms, forces, stiffness)
    all_cables, arms = np.arange(len(quantities)), state.arms[:, suspension.of_cables]
    force_by_length = tangent.by_body(suspension, all_cables, tangent.wrenches(arms, rates.end_forces))
    value_by_ends = rates.by_end[..., None, :] * np.array([-1.0, 1.0])[:, None]
    value_by_motion = tangent.by_body(suspension, all_cables, tangent.wrenches(arms, value_by_ends))
    value_by_length = rates.by_length[..., None]
    force_by_value = force_by_length / np.where(value_by_length != 0, value_by_length, np.inf)
    stiffness = tangent.dense(blocks, suspension) + np.swapaxes(force_by_value, -1, -2) @ value_by_motion
    free, units = suspension.free, body_units(suspension)
    sizes = tangent.free_values(suspension, units)
    # in this memory order for any number of cases: the sums of a product of matrices follow it
    by_tension = np.ascontiguousarray(np.swapaxes(force_by_value[:, which], -1, -2) / sizes[..., None])
    by_motion = np.ascontiguousarray(-(stiffness / (sizes[:, :, None] * sizes[:, None, :]))[..., moving[free]])
    imbalance = np.abs(np.where(free, net / units, 0.0)).max(axis=-1) / np.maximum(scale, TINY)
    ends, strain = state.ends, state.strain
    bounds = rounding.bounds(suspension, state.rotation, state.arms, ends, strain, cables, cables.max_tension, links)
    of_values = rounding.of_stated(ends[:, suspension.of_cables], strain, cables, quantities, suspension.value)
    return LinearForces(
        tangent.free_values(suspension, net) / sizes, by_tension, by_motion, imbalance.max(axis=-1, initial=0.0),
        rounding.largest_ratio(suspension, net, bounds.least), rounding.largest_ratio(suspension, net, bounds.most),
        of_values.most[:, which].max(axis=-1),
    )  # fmt: skip


def body_units(suspension):
    """1 for displacements and the size of the body for rotations, shape (n, b, 6). [-], [m]"""
    sizes = np.ones((*suspension.position.shape[:-1], 6))
    sizes[..., 3:] = tangent.body_sizes(suspension)[..., None]
    return sizes


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
        See `next_damping`.
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


def search(suspension, which, moving, method, low, high, reference, least_ratio):
    """Find tensions that hold the bodies: solve the linear problem about the current ones again until these do.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).
    which : ndarray of int, shape (m,)
        Cables that state nothing.
    moving, method
        As for `solve`.
    low, high, reference : ndarray, shape (n, m)
        Bounds of the mean tensions of these cables, and what they shall be close to. [N]
    least_ratio : float
        Least tension of a cable over the least that it can have by its own weight. [-]

    Returns
    -------
    PoseState
        Of each case, with the lengths.
    SearchRecord
    problems : ndarray of str, shape (n,)
        Why there is no answer; empty where there is one.

    Notes
    -----
    A search ends where the net forces are the rounding of their sums, and the tensions asked for differ from those that
    there are by the rounding of lengths; or where steps get no smaller and the net forces are the rounding of lengths
    (`rounding.Bounds`). It has no answer where several steps in a row leave no tensions within the bounds, as far from
    them as before.
    """
    # `active`, `state` and `iterates` are of the cases still searched for, the others of all cases
    active, state, iterates = first_iterates(suspension, which, low, high, least_ratio)
    cases = len(iterates.index)
    states, possible = copy_record(state), iterates.possible.copy()
    record = SearchRecord(
        np.zeros(cases, dtype=int), np.zeros(cases), np.full(cases, np.inf), np.full(cases, TOO_MANY)
    )  # fmt: skip
    for number in range(STATICS.lengths_steps + 1):
        index, linear = iterates.index, linearised(active, state, which, moving)
        right = (linear.by_tension @ iterates.tension[..., None])[..., 0] - linear.net
        bounds = iterates.possible, high[index], iterates.damping, iterates.tension
        solutions = distribute(linear.by_tension, linear.by_motion, right, method, reference[index], *bounds)
        if number == 0:
            answers = copy_record(solutions)
        assign_rows(answers, index, solutions)
        step, tension, turn = limited_steps(active, state, iterates, solutions, moving)
        change = sizes_of(step, tension, iterates)
        iterates = with_infeasible(iterates, solutions, high[index], least_ratio)
        iterates, reason = with_reasons(iterates, linear, solutions, change, last=number == STATICS.lengths_steps)
        assign_rows(record, index, SearchRecord(np.full(len(index), number), linear.imbalance, change, reason))
        assign_rows(states, index, state)
        possible[index] = iterates.possible
        going_on = np.flatnonzero(reason == GOING_ON)
        if not len(going_on):
            break
        iterates = take_rows(with_damping(iterates, tension, change, turn, number), going_on)
        active, index, tension = active.take(going_on), iterates.index, tension[going_on]
        state = displaced(active, take_rows(state, going_on), step[going_on])
        bounds = low[index], high[index], least_ratio
        active, iterates = with_tensions(active, state, iterates, which, tension, *bounds)
        state = with_stated(active, state)
    problems = np.full(cases, "", dtype=object)
    for case in np.flatnonzero(~(answers.held & answers.within & record.converged)).tolist():
        answer = take_rows(answers, case)
        problems[case] = describe_failure(suspension, which, answer, low[case], possible[case], high[case])
    return states, record, problems


def first_iterates(suspension, which, low, high, least_ratio):
    """Suspension whose cables that state nothing get first preloads, its `PoseState`, and `Iterates` of all cases."""
    quantities = tuple(kind or "preload" for kind in suspension.stated)
    value = np.array(suspension.value)
    of_any_length = replace(suspension, stated=("unstretched_length",) * len(quantities), value=np.ones_like(value))
    value[:, which] = tension = first_tensions(suspension, start(of_any_length), which, low, high)
    with_preloads = replace(suspension, stated=quantities, value=value)
    state = with_stated(with_preloads, start(with_preloads))
    cases = len(value)
    infinite, zero = np.full(cases, np.inf), np.zeros(cases, dtype=int)
    possible = possible_tensions(with_preloads, state, which, low, tension, least_ratio)
    return with_preloads, state, Iterates(
        np.arange(cases), tension, possible, np.zeros_like(tension), np.zeros(cases), np.zeros(cases), infinite,
        infinite, infinite, zero, zero,
    )  # fmt: skip


def limited_steps(suspension, state, iterates, solutions, moving):
    """Steps of k cases towards the solutions of their linear problems, shortened to what a search allows.

    Parameters
    ----------
    suspension, state, iterates : SuspendedSystem, PoseState, Iterates
    solutions : Distribution
        Tensions and displacements that solve the linear problems.
    moving : ndarray of bool, shape (b, 6)
        Degrees of freedom that come from equilibrium.

    Returns
    -------
    step : ndarray, shape (k, b, 6)
        Of the bodies. [m], [rad]
    tension : ndarray, shape (k, m)
        After the step. [N]
    turn : ndarray, shape (k,)
        Largest rotation asked for, before the step is shortened. [rad]
    """
    step = np.zeros((*state.position.shape[:-1], 6))
    step[:, moving] = solutions.unbounded
    step = step / body_units(suspension)
    turn = largest(step[..., 3:]).max(axis=-1)
    share = allowed_share(suspension, state, step)
    tension = iterates.tension + share[:, None] * (solutions.tension - iterates.tension)
    return step * share[:, None, None], np.maximum(tension, STATICS.least_tension_share * iterates.tension), turn


def sizes_of(step, tension, iterates):
    """Size of the step of each case, about as large as without damping, shape (k,). [-]

    Largest change of a tension over the largest tension, plus the largest component of the step of the bodies.
    """
    change = np.abs(tension - iterates.tension).max(axis=-1) / iterates.tension.max(axis=-1)
    return (change + largest(step).max(axis=-1)) * (1 + iterates.damping**2)


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

    `change` is the size of the steps from `sizes_of`; `last` is true in the last step that a search may take.
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
    """`Iterates` with the damping of the next step, more where step `number` (from 0) diverges; see `next_damping`."""
    direction = (tension - iterates.tension) / iterates.tension
    reversed_step = (iterates.direction * direction).sum(axis=-1) < 0
    diverging = (
        (turn > STATICS.largest_turn)
        | ((change > STATICS.shrinking_step * iterates.change) & reversed_step & (number > 2))
        | (change > STATICS.growing_step * iterates.change)
    )
    slow = change > STATICS.slow_step * iterates.change
    damping, least = next_damping(iterates.damping, iterates.least_damping, diverging, slow)
    return replace(iterates, direction=direction, damping=damping, least_damping=least, change=change)


def with_tensions(suspension, state, iterates, which, tension, low, high, least_ratio):
    """Suspension and `Iterates` with the tensions asked for, raised to what is possible where the bodies are."""
    possible = possible_tensions(suspension, state, which, low, tension, least_ratio)
    tension = np.maximum(tension, np.minimum(possible, high))
    value = np.array(suspension.value)
    value[:, which] = tension
    return replace(suspension, value=value), replace(iterates, tension=tension, possible=possible)


def next_damping(damping, least, diverging, slow):
    """Damping of the next step, and the least damping of the steps to come, shape (n,) both.

    After a diverging step the damping is three times as large, and so is the least damping from then on. After other
    steps it is a third, but not below the least damping, which is a third too after slow steps.
    """
    least = np.where(diverging, np.maximum(least, 3 * damping), np.where(slow, least / 3, least))
    more = np.clip(3 * damping, STATICS.damped_lengths, STATICS.most_damped_lengths)
    return np.where(diverging, more, np.maximum(damping / 3, least)), least


def near_least(suspension, state, which, high):
    """True where a cable has less tension than the weight of its chord length, and none is too heavy, shape (n,).

    A cable is too heavy where the least tension that it can have by its own weight is above the bound `high`. Where
    the result is false, the bounds of `possible_tensions` do not decide on an answer.
    """
    cables = catenary.solve(spans(suspension, state), state.tension)
    less_than_weight = cables.mean_tension < cables.span.weight_per_length * cables.span.chord
    least = possible_tensions(suspension, state, which, 0.0, cables.mean_tension[:, which], 1.0)
    return less_than_weight[:, which].any(axis=-1) & (least <= high).all(axis=-1)


def possible_tensions(suspension, state, which, low, tension, least_ratio):
    """Lower bounds `low` of mean tensions, raised to what each cable has at least by its own weight, shape (n, m). [N]

    For a cable with more tension than the weight of its chord length that least tension is taken as that of a level
    cable that does not stretch.
    """
    chord_weight = (suspension.cable_mass * suspension.cable_gravity[0] * size(state.chord))[:, which]
    least, light = STATICS.least_level_tension * chord_weight, tension < chord_weight
    if np.any(light):
        least = np.where(light, stated.least_preload(spans(suspension, state))[:, which], least)
    return np.maximum(low, least_ratio * least)


def allowed_share(suspension, state, step):
    """Share of a step of bodies that is no longer than a search allows, shape (n,). [-]"""
    displacement = largest(step[..., :3]).max(axis=-1) / (STATICS.farthest_step * extent(state))
    rotation = largest(step[..., 3:]).max(axis=-1) / STATICS.widest_turn
    return 1 / np.maximum(1.0, np.maximum(displacement, rotation))


def points_of_open_cables(suspension, which):
    """Names of the free points all of whose cables are among `which`, those that state nothing."""
    ends = suspension.owner[suspension.of_cables]
    stated_ends = np.delete(ends, which, axis=0)
    points = range(suspension.bodies, len(suspension.body_names))
    return [suspension.body_names[i] for i in points if (ends == i).any() and not (stated_ends == i).any()]


def describe_failure(suspension, which, answer, low, possible, high):
    """Reason why a case has no answer: its search has not converged, or its loads are not held within the bounds.

    Parameters
    ----------
    suspension, which
        As for `search`.
    answer : Distribution
        The last one of the case, without its axis of cases.
    low, possible, high : ndarray, shape (m,)
        Bounds of the tensions, and what they are at least by the cables' own weight. [N]
    """
    bodies = [suspension.body_names[i] for i in range(suspension.bodies) if suspension.free[i].any()]
    held = ", ".join(bodies) or "the points"
    if not answer.held:
        body, motion = np.argwhere(suspension.free)[int(np.argmax(np.abs(answer.left)))]
        return f"no tensions hold {held} here: nothing balances {suspension.body_names[body]} {MOTIONS[motion]}"
    excess = np.maximum(possible - answer.tension, answer.tension - high)  # beyond the nearer bound
    if answer.within or excess.max() <= 0:
        text = f"no lengths were found that hold {held} here: their search did not settle in {STATICS.lengths_steps} steps"
        points = points_of_open_cables(suspension, which)
        return f"{text}; state a length or tension of a cable at {', '.join(points)}" if points else text
    largest = np.abs(answer.tension).max()
    factor, unit = next(pair for pair in UNITS if largest >= pair[0] or pair[0] == 1.0)
    nearest = []
    for k in np.flatnonzero(excess > min(1e-6 * largest, excess.max() / 2)):
        text = f"{suspension.cable_names[which[k]]} at {answer.tension[k] / factor:.4g} {unit}"
        if possible[k] > low[k]:
            text += f" (by its own weight at least {possible[k] / factor:.4g} {unit})"
        nearest.append(text)
    least, most = low.min() / factor, high.max() / factor
    allowed = f"in [{least:.4g}, {most:.4g}] {unit}" if np.isfinite(most) else f"of {least:.4g} {unit} and more"
    return f"no tensions {allowed} hold {held} here; nearest: {', '.join(nearest)}"
