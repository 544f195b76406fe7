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
    """Tensions that balance given loads, or come nearest to it.

    Attributes
    ----------
    tension : ndarray, shape (m,)
        Where none that balance the loads are within the bounds, those that exceed the bounds by the least sum. [N]
    unbounded : ndarray, shape (f,)
        The unknowns y.
    left : ndarray, shape (e,)
        Net forces left over, which no tensions balance: zero where the loads can be held. [N]
    held, within : bool
        True if any tensions hold the loads, and if tensions within the bounds do.
    """

    tension: np.ndarray
    unbounded: np.ndarray
    left: np.ndarray
    held: bool
    within: bool


def distribute(by_tension, by_unbounded, right, method, reference, low, high, damping=0.0, current=None):
    """Solve the problem of the module's docstring: tensions within bounds that balance loads, chosen by a method.

    Parameters
    ----------
    by_tension, by_unbounded : ndarray, shape (e, m), (e, f)
        A and E, rows in comparable units.
    right : ndarray, shape (e,)
        b. [N]
    method : {"balanced", "least", "closest"}
    reference : ndarray, shape (m,)
        Tensions that those of the method `closest` shall be close to. [N]
    low, high : ndarray, shape (m,)
        Bounds; infinite where there is none. [N]
    damping : float
        Weight, beside the objective, of the forces of the unknowns y and of the changes of tensions, for steps of an
        iteration; the changes of small tensions, whose forces are the least linear, weigh more. [-]
    current : ndarray, shape (m,), optional
        Present tensions, changes from which are damped; needed with `damping`. [N]

    Returns
    -------
    Distribution
    """
    count = by_tension.shape[1]
    matrix = np.hstack([by_tension, by_unbounded])
    norms = np.sqrt((matrix**2).sum(axis=0))
    column_scales = np.where(norms > 0, norms, 1.0)
    column_scales[:count] = column_scales[:count].max(initial=0.0) or 1.0  # the tensions stay comparable
    particular, null_space = _solutions(matrix, column_scales, right)
    left = right - matrix @ particular
    largest_load = np.abs(right).max(initial=0.0)
    held = bool(np.abs(left).max(initial=0.0) <= SYSTEM.unbalanced * max(largest_load, np.finfo(float).tiny))
    tensions = particular[:count], reference, low[np.isfinite(low)]
    unit = max(np.abs(values).max(initial=1e-300) for values in tensions)  # tensions are solved for in this unit
    objective, target = _objective(method, count, len(particular)), np.zeros(len(particular))
    target[:count] = reference if method == "closest" else 0.0
    target_value = objective @ target
    if damping:
        weights = damping * np.append(np.sqrt(current.max() / current), norms[count:])
        objective = np.vstack([objective, np.diag(weights)])
        target_value = np.concatenate([target_value, weights[:count] * current, np.zeros(len(norms) - count)])
    coordinates = _least_distance(particular, null_space, count, objective, target_value, low, high, unit)
    within = coordinates is not None
    if not within:
        coordinates = _least_excess(particular, null_space, count, low, high, unit)
    solution = particular + null_space @ coordinates
    return Distribution(solution[:count], solution[count:], left, held, within)


def _solutions(matrix, column_scales, right):
    """All solutions t_0 + Z z of the equations with a matrix, by singular value decomposition: t_0, and null space Z.

    Where the equations contradict each other their error is least. Columns are divided by their scales, shape (m + f,).
    """
    left_vectors, values, right_vectors = np.linalg.svd(matrix / column_scales)
    rank = int((values > SYSTEM.rank * values.max(initial=0.0)).sum())
    particular = right_vectors[:rank].T @ ((left_vectors[:, :rank].T @ right) / values[:rank]) / column_scales
    return particular, right_vectors[rank:].T / column_scales[:, None]


def _objective(method, count, unknowns):
    """S of a method, shape (m or 2 m, m + f)."""
    tensions = np.eye(count, unknowns)
    if method != "balanced":
        return tensions
    deviations = tensions.copy()
    deviations[:, :count] -= 1.0 / count
    return np.vstack([deviations, SYSTEM.tensions_themselves * tensions])


def _least_distance(particular, null_space, count, objective, target_value, low, high, unit):
    """Coordinates z of the solution t_0 + Z z of the equations with the least objective, or None if none is in bounds.

    Parameters
    ----------
    particular, null_space : ndarray, shapes (m + f,), (m + f, q)
        t_0 and Z; the first m = `count` unknowns are tensions.
    count : int
    objective, target_value : ndarray, shapes (p, m + f), (p,)
        S, and its product d with the target.
    low, high : ndarray, shape (m,)
        Bounds of the tensions. [N]
    unit : float
        Tension of about the size of the solution. [N]

    Notes
    -----
    The objective is |S (t_0 + Z z) - d|^2. By the singular value decomposition S Z = U s V^T the solution is
    z = V (w + U^T (d - S t_0))/s with the w of least size within the bounds: a least-distance problem.
    """
    left_vectors, values, right_vectors = np.linalg.svd(objective @ null_space, full_matrices=False)
    kept = values > SYSTEM.rank * values.max(initial=0.0)  # motions that change no tension are left out
    basis = right_vectors[kept].T / values[kept]
    optimum = basis @ (left_vectors[:, kept].T @ (target_value - objective @ particular))
    tension, slopes = particular[:count] + null_space[:count] @ optimum, null_space[:count] @ basis
    lower, upper = np.isfinite(low), np.isfinite(high)
    rows = np.vstack([slopes[lower], -slopes[upper]])  # rows @ w >= bounds
    bounds = np.concatenate([(low - tension)[lower], (tension - high)[upper]]) / unit
    bounds = np.maximum(bounds, -SYSTEM.farthest_bound)
    if not np.any(bounds > SYSTEM.outside_bounds):
        return optimum
    if not kept.any():
        return None
    from scipy.optimize import nnls

    # Lawson and Hanson, algorithm LDP: the residual of this problem is w up to a factor, or zero if none is in bounds
    matrix, right = np.vstack([rows.T, bounds]), np.append(np.zeros(rows.shape[1]), 1.0)
    multipliers, _ = nnls(matrix, right, maxiter=100 * count)
    residual = matrix @ multipliers - right
    if -residual[-1] <= SYSTEM.outside_bounds**2:
        return None
    # the bounds that hold with a multiplier, met exactly
    active = multipliers > SYSTEM.outside_bounds * multipliers.max()
    shift = np.linalg.lstsq(rows[active], bounds[active], rcond=None)[0]
    if np.any(rows @ shift < bounds - 1e3 * SYSTEM.outside_bounds):
        shift = -residual[:-1] / residual[-1]
        if np.any(rows @ shift < bounds - 1e3 * SYSTEM.outside_bounds):
            return None
    return optimum + basis @ (shift * unit)


def _least_excess(particular, null_space, count, low, high, unit):
    """Coordinates z for which the sum of the tensions outside the bounds is least, by a linear program."""
    size = null_space.shape[1]
    if size == 0:
        return np.zeros(0)
    slopes, excess = null_space[:count], np.eye(count)  # unknowns: z, and by how much each tension is outside
    lower, upper = np.isfinite(low), np.isfinite(high)
    rows = np.vstack([np.hstack([-slopes, -excess])[lower], np.hstack([slopes, -excess])[upper]])
    right = np.concatenate([(particular[:count] - low)[lower], (high - particular[:count])[upper]])
    cost = np.append(np.zeros(size), np.ones(count))
    limits = [(None, None)] * size + [(0, None)] * count
    from scipy.optimize import linprog

    result = linprog(cost, A_ub=rows, b_ub=right / unit, bounds=limits, method="highs")
    return result.x[:size] * unit if result.success else np.zeros(size)
