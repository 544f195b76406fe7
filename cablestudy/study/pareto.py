"""The Pareto front of points: those that no other one dominates.

Divide and conquer over the points in lexicographic order (Kung, Luccio, Preparata 1975, Journal of the ACM 22, 469):
a point can be dominated only by one before it, so that the front of the second half is compared with that of the first,
in all coordinates but the first one. Two remaining coordinates need one sorted search, more of them comparisons in
blocks.
"""

import numpy as np

from cablestudy.study.tolerances import STUDY


def pareto_front(points):
    """True of points on the front: no other point is at most as large in each coordinate, and smaller in one.

    Parameters
    ----------
    points : ndarray of float, shape (n, m)
        Finite; each coordinate is to be small.

    Returns
    -------
    ndarray of bool, shape (n,)
        Equal points on the front are all true.
    """
    if not len(points):
        return np.zeros(0, dtype=bool)
    unique, inverse = np.unique(points, axis=0, return_inverse=True)
    on_front = np.zeros(len(unique), dtype=bool)
    on_front[_front_indices(unique, np.arange(len(unique)))] = True
    return on_front[inverse.ravel()]


def _front_indices(points, indices):
    """Indices of the front among some indices into distinct points in lexicographic order."""
    if len(indices) <= STUDY.pareto_points:
        compared = points[indices]
        dominated = np.tril(_at_most_in_all(compared, compared).T, -1).any(axis=1)
        return indices[~dominated]
    half = len(indices) // 2
    front_of_first, front_of_second = _front_indices(points, indices[:half]), _front_indices(points, indices[half:])
    dominated = _dominated(points[front_of_first, 1:], points[front_of_second, 1:])
    return np.concatenate([front_of_first, front_of_second[~dominated]])


def _at_most_in_all(lower, upper):
    """True where point i of one set is at most as large as point j of another in all coordinates: shape (n, k)."""
    return (lower[:, None] <= upper[None]).all(axis=2)


def _dominated(others, points):
    """True of points that have a point of another set at most as large in all coordinates: shape (k,)."""
    if others.shape[1] == 2:
        order = np.argsort(others[:, 0])
        least_so_far = np.minimum.accumulate(others[order, 1])
        count_before = np.searchsorted(others[order, 0], points[:, 0], side="right")
        return (count_before > 0) & (least_so_far[count_before - 1] <= points[:, 1])
    if others.shape[1] < 2:
        return (others.min(axis=0) <= points).all(axis=1)
    block_size = max(1, STUDY.pareto_numbers // others.size)
    blocks = [points[start : start + block_size] for start in range(0, len(points), block_size)]
    return np.concatenate([_at_most_in_all(others, block).any(axis=0) for block in blocks])
