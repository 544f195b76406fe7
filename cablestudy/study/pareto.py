"""The Pareto front of points: those that no other one dominates.

Divide and conquer over the points in lexicographic order (Kung, Luccio, Preparata 1975, Journal of the ACM 22, 469):
a point can be dominated only by one before it, so that the front of the second half is compared with that of the first,
in all coordinates but the first one. Two remaining coordinates need one sorted search, more of them comparisons in
blocks.
"""

import numpy as np

from cablestudy.study.tolerances import STUDY


def pareto_front(points):
    """Which points no other one beats: is at most as large in each coordinate, and smaller in one.

    Parameters
    ----------
    points : ndarray of float, shape (n, m)
        Finite; each coordinate is to be small.

    Returns
    -------
    ndarray of bool, shape (n,)
        Of equal points on the front, all.
    """
    if not len(points):
        return np.zeros(0, dtype=bool)
    unique, place = np.unique(points, axis=0, return_inverse=True)
    on_front = np.zeros(len(unique), dtype=bool)
    on_front[_front(unique, np.arange(len(unique)))] = True
    return on_front[place.ravel()]


def _front(points, places):
    """Those places of distinct points, in lexicographic order, that are on the front."""
    if len(places) <= STUDY.pareto_points:
        chosen = points[places]
        dominated = np.tril(_all_at_most(chosen, chosen).T, -1).any(axis=1)
        return places[~dominated]
    half = len(places) // 2
    first, second = _front(points, places[:half]), _front(points, places[half:])
    dominated = _dominated(points[first, 1:], points[second, 1:])
    return np.concatenate([first, second[~dominated]])


def _all_at_most(lower, upper):
    """Whether each point of one set is at most as large as each of another in all coordinates: shape (n, k)."""
    return (lower[:, None] <= upper[None]).all(axis=2)


def _dominated(by, points):
    """Which points have one of another set that is at most as large in all coordinates: shape (k,)."""
    if by.shape[1] == 2:
        order = np.argsort(by[:, 0])
        least = np.minimum.accumulate(by[order, 1])
        before = np.searchsorted(by[order, 0], points[:, 0], side="right")
        return (before > 0) & (least[before - 1] <= points[:, 1])
    if by.shape[1] < 2:
        return (by.min(axis=0) <= points).all(axis=1)
    width = max(1, STUDY.pareto_numbers // by.size)
    blocks = [points[first : first + width] for first in range(0, len(points), width)]
    return np.concatenate([_all_at_most(by, block).any(axis=0) for block in blocks])
