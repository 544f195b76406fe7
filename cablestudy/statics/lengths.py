"""Unstretched lengths with which bodies are at given positions: from tensions that balance their loads (`solve`)."""

from dataclasses import replace

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.errors import NoSolutionError
from cablestudy.statics import rest
from cablestudy.statics.descent import descend
from cablestudy.statics.failure import MOTIONS, explain
from cablestudy.statics.length_search import TensionProblem, near_least, search
from cablestudy.statics.stability import UNSTABLE
from cablestudy.statics.tension_distribution import METHODS
from cablestudy.statics.tolerances import STATICS

# Least tension allowed of a cable over the least that it can have by its own weight: ratios tried in turn. Near a ratio
# of 1 the length of a cable hardly changes its tension, and the steps of the search are good for little
LEAST_RATIOS = (1.5, 2.0, 1.05, 1 + STATICS.least_tension_error)
DECIDES = "state tensions.min, or the method closest with a reference"
UNITS = ((1e6, "MN"), (1e3, "kN"), (1.0, "N"))


def default_moving(suspension):
    """Degrees of freedom that come from equilibrium while the others are at the positions that the scene gives.

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
    """Find unstretched lengths of the open cables with which the bodies are in equilibrium at their given positions.

    A cable is open if the scene states neither its length nor a tension or sag; the others keep what is stated. Where
    there are more open cables than equations, `method` chooses among the tensions.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of any shape, and c cables.
    method : {"balanced", "least", "closest"}
        Choice of the mean tensions of the open cables: least variance, least sum of squares, closest to `reference`.
    low, high : float or ndarray, shape (..., c)
        Bounds of the mean tensions. [N]
    reference : float or ndarray, shape (..., c)
        Mean tensions that the method `closest` approaches. [N]
    moving : ndarray of bool, shape (b, 6), optional
        True for degrees of freedom of the b bodies and points that follow from equilibrium; the others stay at their
        given values. Default: `default_moving`.

    Returns
    -------
    Equilibrium
        Its record says for each case whether it converged; `Equilibrium.stability` whether it is stable.
    problems : ndarray of str, shape (...)
        Why there is no answer; empty where there is one.

    Raises
    ------
    NoSolutionError
        There are fewer unknowns than equations; nothing holds a body; or all that is free moves, so that any tensions
        are in balance somewhere, and neither bounds nor reference say which.
    ValueError
        Another method.
    """
    if method not in METHODS:
        raise ValueError(f"method is {method!r}, not one of {', '.join(METHODS)}")
    rest.refuse_unsupported(suspension)
    moving = suspension.free & (default_moving(suspension) if moving is None else np.asarray(moving, dtype=bool))
    open_cables = np.flatnonzero([kind is None for kind in suspension.stated])
    refuse_overdetermined(suspension, moving, len(open_cables))
    shape, count = suspension.shape, len(suspension.stated)
    n = int(np.prod(shape))  # cases, along one axis

    def of_open(tensions):
        """Tensions of the m open cables in all cases, shape (n, m)."""
        return np.broadcast_to(tensions, (*shape, count)).reshape(n, count)[:, open_cables]

    of_cases = suspension.broadcast((n,))
    problem = TensionProblem(of_cases, open_cables, moving, method, of_open(low), of_open(high), of_open(reference))
    if np.array_equal(moving, suspension.free):
        return at_wanted_tensions(problem, suspension)
    result = search(problem, LEAST_RATIOS[0])
    # cases near the least tension of a cable are tried again with other lower bounds
    for least_ratio in LEAST_RATIOS[1:]:
        failed = np.flatnonzero(~result.record.converged & near_least(problem, result.state))
        if not len(failed):
            break
        result = result.with_converged(failed, search(problem.take(failed), least_ratio))
    if moving[: suspension.bodies, 3:].any():
        result = with_stable_attitudes(problem, result)
    texts = np.full(n, "", dtype=object)
    for case in np.flatnonzero(~(result.distribution.held & result.distribution.within & result.record.converged)):
        texts[case] = describe_failure(problem, result, case)
    for case in np.flatnonzero((texts == "") & undecided_tensions(problem, result)):
        names = ", ".join(suspension.cable_names[cable] for cable in open_cables)
        texts[case] = (
            f"nothing decides the tensions of {names}: nothing pulls at them, and they weigh nothing; {DECIDES}"
        )
    found = rest.equilibrium(suspension, problem.suspension, result.state, result.record)
    return found, texts.reshape(shape)


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


def at_wanted_tensions(problem, suspension):
    """Equilibrium where all free bodies and points may move, so that they find a balance under any tensions.

    The balance does not restrict the tensions of the open cables, those for which nothing is stated. The method
    `closest` takes the reference tensions, other methods the lower bounds. The positions of bodies and points follow.
    The results are those of `solve`, with the cases in their own shape, as in `suspension`.

    Raises
    ------
    NoSolutionError
        A cable gets no tension: it has neither a lower bound nor a reference.
    """
    lowest = problem.low.max(axis=-1, keepdims=True)
    wanted = {"balanced": lowest, "least": problem.low, "closest": problem.reference}[problem.method]
    tension = np.clip(wanted, problem.low, problem.high)
    undecided = (tension <= 0).any(axis=0)
    if undecided.any():
        names = ", ".join(suspension.cable_names[cable] for cable in problem.open_cables[undecided])
        raise NoSolutionError(
            f"nothing decides the tensions of {names}: what is free is in balance somewhere for any tensions; {DECIDES}"
        )
    solution = rest.pose(problem.with_preloads(tension).broadcast(suspension.shape))
    reasons = np.full(suspension.shape, "", dtype=object)
    for case in np.ndindex(suspension.shape):
        if not solution.record.converged[case]:
            reasons[case] = explain(solution.take(case))
    as_described = replace(solution.suspension, stated=suspension.stated, value=suspension.broadcast().value)
    return replace(solution, suspension=as_described), reasons


def undecided_tensions(problem, result):
    """True where the open cables have no weight and the tensions found, if any, would not show in a length, shape (n,).

    The search then ends at any tension near zero.
    """
    rounding = np.finfo(float).eps * problem.suspension.axial_stiffness[:, problem.open_cables]
    zero = (result.possible <= 0) & (result.distribution.tension <= rounding)
    return zero.any(axis=-1) & zero.all(axis=-1)


def with_stable_attitudes(problem, result):
    """Replace unstable equilibria by stable ones with other attitudes (rotations) of the bodies, where such are found.

    With the lengths of an unstable equilibrium, the bodies are let go a little away from it, along its unstable motion.
    The search for lengths is then repeated with the attitudes in which they come to rest, at their given positions.

    Parameters
    ----------
    problem : TensionProblem
        Bodies, cables, and bounds of the tensions, of all cases.
    result : LengthsFound
        Lengths and poses that the search found, of all cases.

    Returns
    -------
    LengthsFound
        A case is unchanged where it was stable or where the repeated searches failed. One that the last of the tries
        (`STATICS.off_saddle`) replaced may still be unstable.
    """
    for size_of_step in STATICS.off_saddle:
        state, record = result.state, result.record
        stability = rest.equilibrium(problem.suspension, problem.suspension, state, record).stability
        falling = np.flatnonzero(record.converged & (stability.verdict == UNSTABLE))
        if not len(falling):
            break
        subset = problem.take(falling)
        cases = subset.suspension
        with_lengths = replace(cases, stated=("unstretched_length",) * len(cases.stated), value=state.length[falling])
        off_saddle = rest.perturbed(with_lengths, take_rows(state, falling), stability.motion[falling], size_of_step)
        descended, _ = descend(with_lengths, off_saddle)
        with_attitudes = replace(subset, suspension=replace(cases, rotation=descended.rotation))
        result = result.with_converged(falling, search(with_attitudes, LEAST_RATIOS[0]))
    return result


def describe_failure(problem, result, case):
    """Reason, for an error message, why no lengths were found that hold the bodies at their given positions in a case.

    Either cables can only pull a body down, or no tensions hold the loads, or only tensions outside the bounds do, or
    the search did not settle.
    """
    suspension, answer = problem.suspension, take_rows(result.distribution, case)
    body = next(bodies_above_their_cables(suspension.take(case)), None)
    if body is not None:
        return f"no lengths hold {suspension.body_names[body]} here: all its cables pull down, and nothing lifts it"
    bodies = [suspension.body_names[i] for i in range(suspension.bodies) if suspension.free[i].any()]
    held = ", ".join(bodies) or "the points"
    if not answer.held:
        body, motion = np.argwhere(suspension.free)[int(np.argmax(np.abs(answer.residual)))]
        return f"no tensions hold {held} here: nothing balances {suspension.body_names[body]} {MOTIONS[motion]}"
    low, possible, high = problem.low[case], result.possible[case], problem.high[case]
    excess = np.maximum(possible - answer.tension, answer.tension - high)  # beyond the nearer bound
    if answer.within or excess.max() <= 0:
        steps = f"their search did not settle in {STATICS.lengths_steps} steps"
        points = ", ".join(points_of_open_cables(problem))
        hint = f"; state a length or tension of a cable at {points}" if points else ""
        return f"no lengths were found that hold {held} here: {steps}{hint}"
    largest = np.abs(answer.tension).max()
    factor, unit = next(pair for pair in UNITS if largest >= pair[0] or pair[0] == 1.0)
    nearest = []
    for k in np.flatnonzero(excess > min(1e-6 * largest, excess.max() / 2)):
        text = f"{suspension.cable_names[problem.open_cables[k]]} at {answer.tension[k] / factor:.4g} {unit}"
        if possible[k] > low[k]:
            text += f" (by its own weight at least {possible[k] / factor:.4g} {unit})"
        nearest.append(text)
    least, most = low.min() / factor, high.max() / factor
    allowed = f"in [{least:.4g}, {most:.4g}] {unit}" if np.isfinite(most) else f"of {least:.4g} {unit} and more"
    return f"no tensions {allowed} hold {held} here; nearest: {', '.join(nearest)}"


def bodies_above_their_cables(suspension):
    """Yield indices of heavy bodies and points, free along z, none of whose cables and links ends above them.

    At its upper end a cable pulls down, however slack it is.

    Parameters
    ----------
    suspension : SuspendedSystem
        One case.
    """
    height = suspension.ends(suspension.position, suspension.rotation)[..., 2]
    below = height <= height[:, ::-1]  # of each end: whether the other one is as high or higher
    down = suspension.mass * suspension.gravity - suspension.force[:, 2]
    for body in np.flatnonzero(suspension.free[:, 2] & (down > 0)):
        if not below[suspension.owner == body].any():
            yield body


def points_of_open_cables(problem):
    """Names of the free points that only open cables hold."""
    suspension = problem.suspension
    ends = suspension.owner[suspension.of_cables]
    stated_ends = np.delete(ends, problem.open_cables, axis=0)
    points = range(suspension.bodies, len(suspension.body_names))
    return [suspension.body_names[i] for i in points if (ends == i).any() and not (stated_ends == i).any()]
