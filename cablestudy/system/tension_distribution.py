"""Tensions that balance given loads, within bounds and chosen by a method: a convex least-squares problem.

    minimise |S (t - reference)|^2    with  A t + E y = b,   low <= t <= high,

t being the tensions, y unknowns without bounds (free degrees of freedom) and A, E the changes of the net forces with
them. S depends on the method: `balanced` takes the deviations from the mean, `least` and `closest` the tensions
themselves. Where the tensions can all rise together, `balanced` takes the smallest of them.

The equations are eliminated by a singular value decomposition; the bounds make a least-distance problem, solved exactly
by non-negative least squares. Source: Lawson and Hanson (1974), Solving Least Squares Problems, chapter 23.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system.tolerances import SYSTEM

METHODS = ("balanced", "least", "closest")


@dataclass(frozen=True)
class Distribution:
    """Tensions found.

    Attributes
    ----------
    tension : ndarray, shape (m,)
        Where no tensions are within the bounds, those that are outside by the least sum. [N]
    unbounded : ndarray, shape (f,)
        The unknowns y.
    left : ndarray, shape (e,)
        Net forces that no tensions balance: zero where the loads can be held.
    held, within : bool
        Whether the loads can be held, and within the bounds.
    """

    tension: np.ndarray
    unbounded: np.ndarray
    left: np.ndarray
    held: bool
    within: bool


def distribute(by_tension, by_unbounded, right, method, reference, low, high, damping=0.0, current=None):
    """Tensions within bounds that balance loads.

    Parameters
    ----------
    by_tension, by_unbounded : ndarray, shape (e, m), (e, f)
        A and E, rows in comparable units.
    right : ndarray, shape (e,)
        b. [N]
    method : {"balanced", "least", "closest"}
    reference : ndarray, shape (m,)
        Of the method `closest`. [N]
    low, high : ndarray, shape (m,)
        Bounds; infinite where there is none. [N]
    damping : float
        Weight, beside the objective, of the forces of the unknowns y and of the changes of tensions, for steps of an
        iteration; the changes of small tensions, whose forces are the least linear, weigh more. [-]
    current : ndarray, shape (m,), optional
        Tensions from which they change, where they are damped. [N]

    Returns
    -------
    Distribution
    """
    count = by_tension.shape[1]
    matrix = np.hstack([by_tension, by_unbounded])
    norms = np.sqrt((matrix**2).sum(axis=0))
    columns = np.where(norms > 0, norms, 1.0)
    columns[:count] = columns[:count].max(initial=0.0) or 1.0  # the tensions stay comparable
    left_vectors, values, right_vectors = np.linalg.svd(matrix / columns)
    rank = int((values > SYSTEM.rank * values.max(initial=0.0)).sum())
    particular = right_vectors[:rank].T @ ((left_vectors[:, :rank].T @ right) / values[:rank]) / columns
    space = right_vectors[rank:].T / columns[:, None]
    left = right - matrix @ particular
    size = np.abs(right).max(initial=0.0)
    held = bool(np.abs(left).max(initial=0.0) <= SYSTEM.unbalanced * max(size, np.finfo(float).tiny))
    unit = max(np.abs(part).max(initial=1e-300) for part in (particular[:count], reference, low[np.isfinite(low)]))
    objective, target = _objective(method, count, len(particular)), np.zeros(len(particular))
    target[:count] = reference if method == "closest" else 0.0
    desired = objective @ target
    if damping:
        weights = damping * np.append(np.sqrt(current.max() / current), norms[count:])
        objective = np.vstack([objective, np.diag(weights)])
        desired = np.concatenate([desired, weights[:count] * current, np.zeros(len(norms) - count)])
    free = _least_distance(particular, space, count, objective, desired, low, high, unit)
    within = free is not None
    if not within:
        free = _nearest(particular, space, count, low, high, unit)
    solution = particular + space @ free
    return Distribution(solution[:count], solution[count:], left, held, within)


def _objective(method, count, unknowns):
    """S of a method, shape (m or 2 m, m + f)."""
    tensions = np.eye(count, unknowns)
    if method != "balanced":
        return tensions
    spread = tensions.copy()
    spread[:, :count] -= 1.0 / count
    return np.vstack([spread, SYSTEM.tensions_themselves * tensions])


def _least_distance(particular, space, count, objective, desired, low, high, unit):
    """Coordinates z of the solution in the null space of the equations, or None where the bounds leave none."""
    # S (t_0 + Z z - target) = S Z z - f, with z = V (w + f')/s; motions that change no tension are left out
    left_vectors, values, right_vectors = np.linalg.svd(objective @ space, full_matrices=False)
    kept = values > SYSTEM.rank * values.max(initial=0.0)
    basis = right_vectors[kept].T / values[kept]
    start = basis @ (left_vectors[:, kept].T @ (desired - objective @ particular))
    tension, slopes = particular[:count] + space[:count] @ start, space[:count] @ basis
    lower, upper = np.isfinite(low), np.isfinite(high)
    rows = np.vstack([slopes[lower], -slopes[upper]])
    bounds = np.maximum(
        np.concatenate([(low - tension)[lower], (tension - high)[upper]]) / unit, -SYSTEM.farthest_bound
    )
    if not np.any(bounds > SYSTEM.outside_bounds):
        return start
    if not kept.any():
        return None
    from scipy.optimize import nnls

    multipliers, _ = nnls(np.vstack([rows.T, bounds]), np.append(np.zeros(rows.shape[1]), 1.0), maxiter=100 * count)
    gap = np.vstack([rows.T, bounds]) @ multipliers - np.append(np.zeros(rows.shape[1]), 1.0)
    if -gap[-1] <= SYSTEM.outside_bounds**2:
        return None
    # the bounds that hold with a multiplier, met exactly
    active = multipliers > SYSTEM.outside_bounds * multipliers.max()
    step = np.linalg.lstsq(rows[active], bounds[active], rcond=None)[0]
    if np.any(rows @ step < bounds - 1e3 * SYSTEM.outside_bounds):
        step = -gap[:-1] / gap[-1]
        if np.any(rows @ step < bounds - 1e3 * SYSTEM.outside_bounds):
            return None
    return start + basis @ (step * unit)


def _nearest(particular, space, count, low, high, unit):
    """Coordinates z for which the sum of the tensions outside the bounds is least, by a linear program."""
    size = space.shape[1]
    if size == 0:
        return np.zeros(0)
    slopes = space[:count]
    lower, upper = np.isfinite(low), np.isfinite(high)
    eye = np.eye(count)
    rows = np.vstack([np.hstack([-slopes, -eye])[lower], np.hstack([slopes, -eye])[upper]])
    bounds = np.concatenate([(particular[:count] - low)[lower], (high - particular[:count])[upper]])
    cost = np.append(np.zeros(size), np.ones(count))
    limits = [(None, None)] * size + [(0, None)] * count
    from scipy.optimize import linprog

    found = linprog(cost, A_ub=rows, b_ub=bounds / unit, bounds=limits, method="highs")
    return found.x[:size] * unit if found.success else np.zeros(size)
