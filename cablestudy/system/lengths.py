"""Unstretched lengths with which bodies stand where they shall be: from tensions that balance their loads (`solve`)."""

from dataclasses import replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.errors import NoSolutionError
from cablestudy.system import descent, stated, tangent
from cablestudy.system.descent import (
    CONVERGED,
    TINY,
    TOO_MANY,
    UNHELD,
    Record,
    copied,
    moved,
    put,
    size,
    some,
    spans,
)
from cablestudy.system.failure import MOTIONS
from cablestudy.system.stability import UNSTABLE
from cablestudy.system.statics import NUDGES, equilibrium, nudged, refuse_unheld, start
from cablestudy.system.tension_distribution import METHODS, distribute

MAX_STEPS = 40
LARGEST, GROWING = 0.3, 10.0  # steps that turn more [rad] or grow more are damped,
SHRINKING, SLOW = 0.7, 0.3  # and those that go back and shrink less; damping is eased where others shrink less
DAMPED, MOST_DAMPED = 0.05, 1e3  # with weights from the first to the second
SETTLED = 1e-9  # relative change of the tensions in a step at which they are found,
BALANCED = 1e-11  # and net force over the sum of forces
STALLED = 1e-8  # both, where rounding stops the iteration
ROUGH = 1e-3  # relative change up to which balanced tensions are an answer: the best ones but for its stated error
# steps in a row in which no tensions hold the loads, a cable would have to push, or its weight needs more than allowed
INFEASIBLE_STEPS = 6
SLOWEST = 0.1  # least share of a tension that a step leaves of it
LEVEL_LEAST = 0.508  # least tension of a level cable that does not stretch, over the weight of its chord
# Least tensions over those that a cable has at least by its own weight, tried in turn: near these its length hardly
# changes the tension, and the steps of the search are good for little
ABOVE_LEAST = (1.5, 2.0, 1.05, 1 + stated.LEAST_ERROR)
UNITS = ((1e6, "MN"), (1e3, "kN"), (1.0, "N"))


def default_found(suspension):
    """Degrees of freedom that come from equilibrium while bodies stand.

    Places of junctions, and attitudes of bodies where the lengths are fewer than the equations left.

    Returns
    -------
    ndarray of bool, shape (b, 6)
    """
    found = suspension.free.copy()
    found[: suspension.bodies] = False
    if suspension.given.count(None) + found.sum() < suspension.free.sum():
        found[: suspension.bodies, 3:] = suspension.free[: suspension.bodies, 3:]
    return found


def solve(suspension, method="balanced", low=0.0, high=np.inf, reference=0.0, found=None):
    """Lengths of the cables that state nothing, with the bodies where they shall be.

    Parameters
    ----------
    suspension : Suspension
        With cases of any shape. Cables that state something keep it.
    method : {"balanced", "least", "closest"}
        Of the mean tensions of the cables that state nothing: least variance, least sum of squares, closest to
        `reference`.
    low, high, reference : float or ndarray, shape (..., c)
        Bounds of the mean tensions, and what they shall be close to. [N]
    found : ndarray of bool, shape (b, 6), optional
        Degrees of freedom that come from equilibrium, the others stand; default: `default_found`.

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
    found = suspension.free & (default_found(suspension) if found is None else np.asarray(found, dtype=bool))
    unstated = np.array([kind is None for kind in suspension.given])
    refuse_overdetermined(suspension, found, int(unstated.sum()))
    shape, count = suspension.shape, len(suspension.given)
    n = int(np.prod(shape))
    bounds = [np.broadcast_to(b, (*shape, count)).reshape(n, count)[:, unstated] for b in (low, high, reference)]
    flat = suspension.broadcast((n,))
    which = np.flatnonzero(unstated)
    answers = search(flat, which, found, method, *bounds, ABOVE_LEAST[0])
    for above in ABOVE_LEAST[1:]:
        hard = np.flatnonzero(~answers[1].converged & near_least(flat, answers[0], which, bounds[1]))
        if not len(hard):
            break
        again = search(flat.take(hard), which, found, method, *(bound[hard] for bound in bounds), above)
        answers = with_better(answers, hard, again)
    if found[: suspension.bodies, 3:].any():
        answers = with_stable_attitudes(suspension, flat, answers, which, found, method, bounds)
    state, record, problems = answers
    return equilibrium(suspension, flat, state, record), problems.reshape(shape)


def with_better(found, index, again):
    """State, record and problems of cases, with those of a second search of some of them where it converged."""
    state, record, problems = copied(found[0]), copied(found[1]), found[2].copy()
    good = again[1].converged
    for whole, part in ((state, again[0]), (record, again[1])):
        put(whole, index[good], some(part, good))
    problems[index[good]] = again[2][good]
    return state, record, problems


def with_stable_attitudes(suspension, flat, answers, which, found, method, bounds):
    """Answers of `search` whose attitudes, where they are unstable, are those to which the bodies fall from there.

    The bodies fall with the lengths as they are, from a place beside it along the unstable motion; the search begins
    again where they shall be, with the attitudes in which they have come to rest.
    """
    for side in NUDGES:
        state, record, _ = answers
        stability = equilibrium(suspension, flat, state, record).stability
        falling = np.flatnonzero(record.converged & (stability.verdict == UNSTABLE).reshape(len(record.converged)))
        if not len(falling):
            break
        part, motion = flat.take(falling), stability.motion.reshape(len(state.length), -1, 6)[falling]
        held = replace(part, given=("unstretched_length",) * len(flat.given), value=state.length[falling])
        descended, _ = descent.descend(held, nudged(held, some(state, falling), motion, side))
        part = replace(part, rotation=descended.rotation)
        again = search(part, which, found, method, *(bound[falling] for bound in bounds), ABOVE_LEAST[0])
        answers = with_better(answers, falling, again)
    return answers


def refuse_overdetermined(suspension, found, lengths):
    """Raise where there are fewer unknowns than equations.

    Raises
    ------
    NoSolutionError
        With both counts.
    """
    equations, places = int(suspension.free.sum()), int(found.sum())
    if lengths + places < equations:
        raise NoSolutionError(
            f"{equations} equations of balance for {lengths + places} unknowns ({lengths} lengths and {places} degrees "
            f"of freedom that come from equilibrium): leave {equations - lengths - places} more lengths unstated"
        )


def first_tensions(suspension, state, which, low, high):
    """Mean tensions with which the search begins, shape (n, m): a share of the loads, more than the cables' weights."""
    gravity = np.abs(suspension.gravity)[:, None]
    loads = (suspension.mass * gravity + size(suspension.force)).sum(axis=-1)
    chord = size(state.vector)
    own = (suspension.cable_mass * gravity * chord).sum(axis=-1)
    if suspension.load_forces is not None:
        own = own + size(suspension.load_forces).sum(axis=(-1, -2))
    tension = np.maximum((loads + own)[:, None] / len(which), 2 * (suspension.cable_mass * gravity * chord)[:, which])
    middle = np.where(np.isfinite(high), (low + high) / 2, np.maximum(tension, 2 * low))
    tension = np.where((tension < low) | (tension > high), middle, tension)
    return np.where(tension > 0, tension, 1e-6 * suspension.axial_stiffness[:, which])


def linearised(suspension, state, which, found):
    """Net forces and their changes with the mean tensions of some cables and with some degrees of freedom.

    Parameters
    ----------
    suspension : Suspension
        With cases of shape (n,); what each cable states is kept while the bodies move.
    state : PoseState
    which : ndarray of int, shape (m,)
    found : ndarray of bool, shape (b, 6)

    Returns
    -------
    net : ndarray, shape (n, d)
        Moments over the size of the body. [N]
    by_tension : ndarray, shape (n, d, m)
        [-]
    by_place : ndarray, shape (n, d, f)
        [N/m], by rotations times the size of the body.
    imbalance : ndarray, shape (n,)
        Largest net force over the sum of forces. [-]
    """
    cables = catenary.solve(spans(suspension, state))
    rates = stated.rates(cables, suspension.given)
    forces = cables.end_forces("global")
    net, scale = tangent.net_forces(suspension, state.rotation, state.arms, forces, cables.max_tension)
    blocks = tangent.blocks(suspension, state.rotation, state.arms, forces, rates.stiffness)
    every = np.arange(len(suspension.given))
    pulled = tangent.by_body(suspension, every, tangent.wrenches(state.arms, rates.end_forces))
    signed = rates.by_end[..., None, :] * np.array([-1.0, 1.0])[:, None]
    turned = tangent.by_body(suspension, every, tangent.wrenches(state.arms, signed))
    own = rates.by_length[..., None]
    pulled = pulled / np.where(own != 0, own, np.inf)  # by what is stated
    stiffness = tangent.dense(blocks, suspension) + np.swapaxes(pulled, -1, -2) @ turned
    free = suspension.free
    sizes = np.ones((*state.position.shape[:-1], 6))
    sizes[..., 3:] = tangent.body_sizes(suspension)[..., None]
    sizes = tangent.free_values(suspension, sizes)
    # in this memory order for any number of cases: the sums of a product of matrices follow it
    by_tension = np.ascontiguousarray(np.swapaxes(pulled[:, which], -1, -2) / sizes[..., None])
    by_place = np.ascontiguousarray(-(stiffness / (sizes[:, :, None] * sizes[:, None, :]))[..., found[free]])
    worst = np.abs(np.where(free, net / body_units(suspension), 0.0)).max(axis=-1) / np.maximum(scale, TINY)
    return tangent.free_values(suspension, net) / sizes, by_tension, by_place, worst.max(axis=-1)


def body_units(suspension):
    """1 for displacements and the size of the body for rotations, shape (n, b, 6). [-], [m]"""
    sizes = np.ones((*suspension.position.shape[:-1], 6))
    sizes[..., 3:] = tangent.body_sizes(suspension)[..., None]
    return sizes


def search(suspension, which, found, method, low, high, reference, above):
    """Repeat the linear problem about the current tensions until the true equilibrium holds.

    Parameters
    ----------
    suspension : Suspension
        With cases of shape (n,).
    which : ndarray of int, shape (m,)
        Cables that state nothing.
    found, method
        As for `solve`.
    low, high, reference : ndarray, shape (n, m)
        [N]
    above : float
        Least tension of a cable over the least that it can have by its own weight. [-]

    Returns
    -------
    PoseState
    Record
    problems : ndarray of str, shape (n,)
    """
    given = tuple(kind or "preload" for kind in suspension.given)
    value = np.array(suspension.value)
    arms_state = start(replace(suspension, given=("unstretched_length",) * len(given), value=np.ones_like(value)))
    value[:, which] = tension = first_tensions(suspension, arms_state, which, low, high)
    part = replace(suspension, given=given, value=value)
    state, cases = start(part), len(value)
    state = fitted(part, state)
    answers, infeasible = np.full(cases, None, dtype=object), np.zeros(cases, dtype=int)
    steps, settled = np.zeros(cases, dtype=int), np.zeros(cases, dtype=bool)
    damping, least_damping = np.zeros(cases), np.zeros(cases)
    possible = possible_tensions(part, state, which, low, tension, above)
    last, ended = np.full(cases, np.inf), settled.copy()
    final, change, direction = last.copy(), last.copy(), np.zeros_like(tension)
    for _ in range(MAX_STEPS):
        net, by_tension, by_place, worst = linearised(part, state, which, found)
        step, asked = np.zeros((*state.position.shape[:-1], 6)), tension.copy()
        for case in np.flatnonzero(~ended):
            right = by_tension[case] @ tension[case] - net[case]
            limits = reference[case], possible[case], high[case], damping[case], tension[case]
            answer = distribute(by_tension[case], by_place[case], right, method, *limits)
            answers[case] = answer
            heavy = (possible[case] > above * high[case]).any()
            pushes = not answer.held or (not answer.within and (heavy or answer.tension.min() < 0))
            infeasible[case] = infeasible[case] + 1 if pushes else 0
            asked[case], step[case, found] = answer.tension, answer.unbounded
        step = step / body_units(part)
        wide = np.abs(step[..., 3:]).max(axis=(-1, -2))
        share = allowed_share(part, state, step)
        step, asked = step * share[:, None, None], tension + share[:, None] * (asked - tension)
        asked = np.where(ended[:, None], tension, np.maximum(asked, SLOWEST * tension))
        change = np.abs(asked - tension).max(axis=-1) / tension.max(axis=-1) + np.abs(step).max(axis=(-1, -2))
        change = change * (1 + damping**2)  # what is left without damping, about
        final = np.where(ended, final, change)
        done = (worst < BALANCED) & (change < SETTLED) | (worst < STALLED) & (change < STALLED) & (change >= last / 2)
        settled |= done
        ended = settled | (infeasible >= INFEASIBLE_STEPS)
        if ended.all():
            break
        moving = ~ended
        steps += moving
        before, direction = direction, (asked - tension) / tension
        back = (before * direction).sum(axis=-1) < 0
        diverging = (wide > LARGEST) | ((change > SHRINKING * last) & back & (steps > 3)) | (change > GROWING * last)
        damping, least_damping = damped(damping, least_damping, diverging, change > SLOW * last)
        tension = np.where(moving[:, None], asked, tension)
        last = np.where(moving, change, last)
        fresh = moved(part, state, step)
        lowest = possible_tensions(part, fresh, which, low, tension, above)
        possible = np.where(moving[:, None], lowest, possible)
        tension = np.where(moving[:, None], np.maximum(tension, np.minimum(possible, high)), tension)
        value = np.array(part.value)
        value[:, which] = tension
        part = replace(part, value=value)
        state = copied(state)  # a case that has ended stays as it is
        put(state, moving, some(fitted(part, fresh), moving))
    settled |= (worst < STALLED) & (final < ROUGH)
    good = np.array([answer.held and answer.within for answer in answers], dtype=bool)
    reasons = np.where(good, np.where(settled, CONVERGED, TOO_MANY), UNHELD)
    words = [describe(suspension, which, *case) for case in zip(answers, settled, low, possible, high, strict=True)]
    return state, Record(steps, worst, final, reasons), np.array(words, dtype=object)


def damped(damping, least, diverging, slow):
    """Damping of the next step, and the least of the steps to come, shape (n,).

    More after a diverging step, and from then on never again as little as it had; less after the others, and less is
    allowed where these are slow.
    """
    least = np.where(diverging, np.maximum(least, 3 * damping), np.where(slow, least / 3, least))
    return np.where(diverging, np.clip(3 * damping, DAMPED, MOST_DAMPED), np.maximum(damping / 3, least)), least


def near_least(suspension, state, which, high):
    """Whether a cable has less tension than its weight, and none needs more by its weight than is allowed, shape (n,).

    Only then the bounds of `possible_tensions` decide on an answer.
    """
    cables = catenary.solve(spans(suspension, state))
    near = (cables.mean_tension < cables.span.weight_per_length * cables.span.chord)[:, which].any(axis=-1)
    least = possible_tensions(suspension, state, which, 0.0, cables.mean_tension[:, which], 1.0)
    return near & (least <= high).all(axis=-1)


def possible_tensions(suspension, state, which, low, tension, above):
    """Lower bounds of mean tensions that are none below what a cable has at least by its own weight, shape (n, m). [N]

    Of cables with more tension than the weight of their chord it is that of a level cable that does not stretch.
    """
    heavy = (suspension.cable_mass * suspension.cable_gravity[0] * size(state.vector))[:, which]
    least = LEVEL_LEAST * heavy
    if np.any(tension < heavy):
        least = np.where(tension < heavy, stated.least_preload(spans(suspension, state))[:, which], least)
    return np.maximum(low, above * least)


def allowed_share(suspension, state, step):
    """Share of a step of bodies that is no longer than a search allows, shape (n,). [-]"""
    far = np.abs(step[..., :3]).max(axis=(-1, -2)) / (descent.FARTHEST * descent.extent(suspension, state))
    wide = np.abs(step[..., 3:]).max(axis=(-1, -2)) / descent.WIDEST
    return 1 / np.maximum(1.0, np.maximum(far, wide))


def fitted(suspension, state):
    """State with the lengths for which the cables have what they state, the bodies at rest."""
    strain, _ = stated.fit(spans(suspension, state), suspension.given, suspension.value, state.strain)
    return replace(state, strain=strain, length=size(state.vector) / (1 + strain))


def describe(suspension, which, answer, settled, low, possible, high):
    """Why a case has no answer; an empty string where it has one."""
    names = [suspension.cable_names[i] for i in which]
    bodies = [suspension.body_names[i] for i in range(suspension.bodies) if suspension.free[i].any()]
    held = ", ".join(bodies) or "the points"
    if not answer.held:
        body, motion = np.argwhere(suspension.free)[int(np.argmax(np.abs(answer.left)))]
        return f"no tensions hold {held} here: nothing balances {suspension.body_names[body]} {MOTIONS[motion]}"
    if answer.within and settled:
        return ""
    beyond = np.maximum(possible - answer.tension, answer.tension - high)
    if answer.within or beyond.max() <= 0:
        return f"no lengths were found that hold {held} here: their search did not settle in {MAX_STEPS} steps"
    outside = beyond > min(1e-6 * np.abs(answer.tension).max(), beyond.max() / 2)
    unit, name = next(pair for pair in UNITS if np.abs(answer.tension).max() >= pair[0] or pair[0] == 1.0)
    nearest = ", ".join(
        f"{cable} at {value / unit:.4g} {name}"
        + (f" (by its own weight at least {least / unit:.4g} {name})" if heavy else "")
        for cable, value, least, out, heavy in zip(
            names, answer.tension, possible, outside, possible > low, strict=True
        )
        if out
    )
    least, most = low.min() / unit, high.max() / unit
    allowed = f"in [{least:.4g}, {most:.4g}] {name}" if np.isfinite(most) else f"of {least:.4g} {name} and more"
    return f"no tensions {allowed} hold {held} here; nearest: {nearest}"
