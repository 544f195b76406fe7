"""Tensions that balance given loads, within bounds and chosen by a method: a convex least-squares problem.

    minimise |S (t - reference)|^2    with  A t + E y = b,   low <= t <= high,

t being the tensions, y unknowns without bounds (free degrees of freedom) and A, E the changes of the net forces with
them. S depends on the method: `balanced` takes the deviations from the mean, `least` and `closest` the tensions
themselves. Where the tensions can all rise together, `balanced` takes the smallest of them, since it adds
`STATICS.tensions_themselves`^2 of the sum of squares.

The equations are eliminated by a singular value decomposition; the bounds make a least-distance problem, solved exactly
by non-negative least squares. Source: Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.statics.tolerances import STATICS

METHODS = ("balanced", "least", "closest")


@dataclass(frozen=True)
class Distribution:
    """Tensions that balance given loads, or come nearest to it, of n cases.

    Attributes
    ----------
    tension : ndarray, shape (n, m)
        Where none that balance the loads are within the bounds, those that exceed the bounds by the least sum. [N]
    unbounded : ndarray, shape (n, f)
        The unknowns y.
    residual : ndarray, shape (n, e)
        Net forces left over, which no tensions balance: zero where the loads can be held. [N]
    held, within : ndarray of bool, shape (n,)
        True if any tensions hold the loads, and if tensions within the bounds do.
    """

    tension: np.ndarray
    unbounded: np.ndarray
    residual: np.ndarray
    held: np.ndarray
    within: np.ndarray


def distribute(by_tension, by_unbounded, right, method, reference, low, high, damping, current):
    """Find cable tensions within bounds that balance given loads, the best ones by a method: `Distribution`.

    For each of n problems an objective is minimised with A t + E y = b and low <= t <= high. t are the m tensions, and
    y are f other unknowns without bounds, such as displacements. Where no tensions are within the bounds, those that
    exceed them by the least sum are returned.

    Parameters
    ----------
    by_tension, by_unbounded : ndarray, shape (n, e, m), (n, e, f)
        A and E of the e equations of balance, in comparable units.
    right : ndarray, shape (n, e)
        b. [N]
    method : {"balanced", "least", "closest"}
        Objective: sum of squares of the deviations of t from their mean, of t, or of t - reference.
    reference : ndarray, shape (n, m)
        Tensions that the method `closest` approaches. [N]
    low, high : ndarray, shape (n, m)
        Bounds of t; infinite where there is none. [N]
    damping : ndarray, shape (n,)
        Weight by which y and the changes of the tensions are kept small, in an iteration that calls this: they are
        added to the objective. The changes of small tensions weigh more, as their forces are the least linear. [-]
    current : ndarray, shape (n, m)
        Tensions before the change, above zero. [N]
    """
    count = by_tension.shape[-1]
    matrix = np.concatenate([by_tension, by_unbounded], axis=-1)
    norms = np.sqrt((matrix**2).sum(axis=-2))
    scales = np.where(norms > 0, norms, 1.0)
    largest_norm = scales[:, :count].max(axis=-1, keepdims=True, initial=0.0)
    scales[:, :count] = np.where(largest_norm > 0, largest_norm, 1.0)  # the tensions stay comparable
    particular, null_space = _solutions(matrix, scales, right)
    residual = right - _product(matrix, particular)
    largest_load = np.maximum(np.abs(right).max(axis=-1, initial=0.0), np.finfo(float).tiny)
    held = np.abs(residual).max(axis=-1, initial=0.0) <= STATICS.unbalanced * largest_load
    of_tensions, of_unbounded = np.sqrt(current.max(axis=-1, keepdims=True) / current), norms[:, count:]
    weights = damping[:, None] * np.concatenate([of_tensions, of_unbounded], axis=-1)
    objective, target = _objective(method, count, weights, reference, current)
    optimum, basis = _least_squares(particular, null_space, objective, target)
    solution = particular + _product(null_space, optimum)
    tensions = particular[:, :count], reference, np.where(np.isfinite(low), low, 0.0)
    units = np.max([np.abs(values).max(axis=-1, initial=1e-300) for values in tensions], axis=0)
    outside = np.maximum(low - solution[:, :count], solution[:, :count] - high).max(axis=-1, initial=-np.inf)
    slopes, within = null_space[:, :count] @ basis, np.ones(len(right), dtype=bool)
    for case in np.flatnonzero(outside > STATICS.outside_bounds * units).tolist():
        limits = low[case], high[case], units[case]  # solved for in this unit
        shift = _smallest_shift_into_bounds(solution[case, :count], slopes[case], *limits)
        within[case] = shift is not None
        if within[case]:
            solution[case] += null_space[case] @ (basis[case] @ shift)
        else:
            solution[case] = particular[case] + _least_excess(particular[case], null_space[case], *limits)
    return Distribution(solution[:, :count], solution[:, count:], residual, held, within)


def _product(matrices, vectors):
    """Products of n matrices and n vectors, shape (n, ...)."""
    return (matrices @ vectors[..., None])[..., 0]


def _solutions(matrix, scales, right):
    """All solutions t_0 + Z z of the equations with a matrix, by singular value decomposition: t_0, and null space Z.

    Where the equations contradict each other their error is least. Columns are divided by their `scales`, shape
    (n, m + f). Z has the shape (n, m + f, m + f), with columns of zeros where it has fewer dimensions.
    """
    left_vectors, values, right_vectors = np.linalg.svd(matrix / scales[:, None])
    count = values.shape[-1]
    decisive = values > STATICS.rank * values.max(axis=-1, keepdims=True, initial=0.0)
    load = _product(left_vectors.swapaxes(-1, -2), right)[:, :count]
    amplitudes = np.where(decisive, load / np.where(decisive, values, 1.0), 0.0)
    particular = (amplitudes[:, None] @ right_vectors[:, :count])[:, 0] / scales
    null_space = right_vectors.swapaxes(-1, -2) / scales[..., None]
    null_space[:, :, :count] *= ~decisive[:, None]
    return particular, null_space


def _objective(method, count, weights, reference, current):
    """Objective by which tensions t and other unknowns y are chosen, as least squares: O and d of |O (t, y) - d|^2.

    The first rows are those of the method: for "balanced" t - mean(t) and, with a small weight, t; for "least" t; for
    "closest" t - reference. The rows below damp changes: w (t - current), and w y. There are n problems with m
    (`count`) tensions and f other unknowns: `weights` w have the shape (n, m + f), `reference` and `current` (n, m),
    the results O and d the shapes (n, p, m + f) and (n, p).
    """
    cases, unknowns = weights.shape
    tensions = np.eye(count, unknowns)
    if method == "balanced":
        deviations = tensions.copy()
        deviations[:, :count] -= 1.0 / count
        tensions = np.concatenate([deviations, STATICS.tensions_themselves * tensions])
    objective = np.zeros((cases, len(tensions) + unknowns, unknowns))
    objective[:, : len(tensions)] = tensions
    objective[:, len(tensions) + np.arange(unknowns), np.arange(unknowns)] = weights
    target = np.zeros(objective.shape[:2])
    if method == "closest":
        target[:, :count] = reference
    target[:, len(tensions) :][:, :count] = weights[:, :count] * current
    return objective, target


def _least_squares(particular, null_space, objective, target):
    """Coordinates z of the solutions t_0 + Z z with the least |S (t_0 + Z z) - d|^2, shape (n, q), and a basis of z.

    By the singular value decomposition S Z = U s V^T this is z = V (w + U^T (d - S t_0))/s with w = 0: within bounds
    the w of least size is wanted, a least-distance problem. The basis is V/s, shape (n, q, q), with columns of zeros
    for motions that change no tension. t_0, Z, S and d are the arguments in this order, shapes (n, m + f), (n, m + f,
    q), (n, p, m + f) and (n, p); the first m unknowns are tensions.
    """
    left_vectors, values, right_vectors = np.linalg.svd(objective @ null_space, full_matrices=False)
    kept = values > STATICS.rank * values.max(axis=-1, keepdims=True, initial=0.0)
    basis = right_vectors.swapaxes(-1, -2) * np.where(kept, 1 / np.where(kept, values, 1.0), 0.0)[:, None]
    amplitudes = _product(left_vectors.swapaxes(-1, -2), target - _product(objective, particular))
    return _product(basis, amplitudes), basis


def _smallest_shift_into_bounds(tension, slopes, low, high, unit):
    """Smallest w, shape (q,), with which the tensions t + D w are within their bounds, in one case; None if none are.

    t, shape (m,), are the best tensions without bounds, of which at least one is outside of them. The objective grows
    with |w|^2, so that those of the smallest w are best. D, shape (m, q), are the `slopes`, with columns that may be
    zero. `low` and `high` are infinite where there is no bound; `unit` is a tension of about the size of the solution
    [N].

    Notes
    -----
    With w over `unit`: least |w|^2 with G w >= h, where G = [D; -D] and h = [low - t; t - high]/unit, without bounds
    that are infinite; those farther off than `STATICS.farthest_bound` count as at that distance.
    Mostly the bound farthest from w = 0 alone decides, and `scipy.optimize` need not be imported. Else non-negative
    least squares, [G^T; h^T] u ~ [0; 1] with u >= 0, have the residual [r_w; r_1], and w = -r_w/r_1; r_1 = 0 where no w
    is within the bounds (Lawson and Hanson, Solving Least Squares Problems, algorithm LDP). The bounds with u > 0 are
    then met as equations, which is more accurate.
    """
    lower, upper = np.isfinite(low), np.isfinite(high)
    moving = slopes.any(axis=0)
    rows = np.vstack([slopes[lower], -slopes[upper]])[:, moving]  # rows @ w >= bounds
    bounds = np.concatenate([(low - tension)[lower], (tension - high)[upper]]) / unit
    bounds = np.maximum(bounds, -STATICS.farthest_bound)
    if not moving.any():
        return None
    shift = _shift_to_farthest(rows, bounds)
    if shift is None:
        shift = _shift_by_multipliers(rows, bounds)
    if shift is None:
        return None
    shifts = np.zeros(slopes.shape[1])
    shifts[moving] = shift * unit
    return shifts


def _shift_to_farthest(rows, bounds):
    """Least w that meets the farthest bound; None where it is not within the others.

    No w within the bounds is smaller than the distance of any of them from w = 0, so that this one is the smallest.
    """
    sizes = np.sqrt((rows**2).sum(axis=-1))
    distance = np.divide(bounds, sizes, out=np.full(len(bounds), -np.inf), where=sizes > 0)
    farthest = np.argmax(distance)
    shift = rows[farthest] * (distance[farthest] / sizes[farthest])
    return shift if _within(rows, bounds, shift) else None


def _shift_by_multipliers(rows, bounds):
    """Shift w by the multipliers u of the notes of `_smallest_shift_into_bounds`; None where there is none."""
    from scipy.optimize import nnls

    matrix, right = np.vstack([rows.T, bounds]), np.append(np.zeros(rows.shape[1]), 1.0)
    multipliers, _ = nnls(matrix, right, maxiter=100 * len(bounds))
    residual = matrix @ multipliers - right
    if -residual[-1] <= STATICS.outside_bounds**2:
        return None
    active = multipliers > STATICS.outside_bounds * multipliers.max()
    shift = np.linalg.lstsq(rows[active], bounds[active], rcond=None)[0]
    if _within(rows, bounds, shift):
        return shift
    shift = -residual[:-1] / residual[-1]
    return shift if _within(rows, bounds, shift) else None


def _within(rows, bounds, shift):
    """True if a shift w is within its bounds, rows @ w >= bounds, to rounding."""
    return not np.any(rows @ shift < bounds - 1e3 * STATICS.outside_bounds)


def _least_excess(particular, null_space, low, high, unit):
    """Change Z z of the solution t_0 of one case for which the sum of the tensions outside the bounds is least.

    By a linear program; the parameters are as for `_least_squares` and `_smallest_shift_into_bounds`.
    """
    null_space, count = null_space[:, null_space.any(axis=0)], len(low)
    size = null_space.shape[1]
    if size == 0:
        return np.zeros(len(particular))
    slopes, excess = null_space[:count], np.eye(count)  # unknowns: z, and by how much each tension is outside
    lower, upper = np.isfinite(low), np.isfinite(high)
    rows = np.vstack([np.hstack([-slopes, -excess])[lower], np.hstack([slopes, -excess])[upper]])
    right = np.concatenate([(particular[:count] - low)[lower], (high - particular[:count])[upper]])
    cost = np.append(np.zeros(size), np.ones(count))
    limits = [(None, None)] * size + [(0, None)] * count
    from scipy.optimize import linprog

    result = linprog(cost, A_ub=rows, b_ub=right / unit, bounds=limits, method="highs")
    return null_space @ result.x[:size] * unit if result.success else np.zeros(len(particular))
