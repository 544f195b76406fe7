"""Interpolating splines of odd degree, as of scipy.interpolate, which takes a fifth of a second to import.

References
----------
de Boor 2001, A Practical Guide to Splines, chapters IX, X and XIII: the recurrence of B-splines, their derivatives and
knots that leave out the first and last points ("not a knot"), as of `scipy.interpolate.make_interp_spline`.
"""

import numpy as np


class CardinalSplines:
    """Splines of odd degree k, of which the j-th is 1 at the j-th of n > k ascending points, and 0 at the others.

    Parameters
    ----------
    points : ndarray, shape (n,)
    degree : int
    """

    def __init__(self, points, degree):
        inner = points[(degree + 1) // 2 : -((degree + 1) // 2)]
        self._degree = degree
        self._knots = np.concatenate([[points[0]] * (degree + 1), inner, [points[-1]] * (degree + 1)])
        first, values = self._basis(points)
        collocation = np.zeros((len(points), len(points)))
        np.put_along_axis(collocation, first[:, None] + np.arange(degree + 1), values, axis=1)
        self._coefficients = np.linalg.inv(collocation)

    def __call__(self, x):
        """Values of the splines between the first and the last point, shape (f,) -> (f, n)."""
        first, values = self._basis(x)
        return sum(values[:, j, None] * self._coefficients[first + j] for j in range(self._degree + 1))

    def _basis(self, x):
        """Index of the first B-spline that is not zero at each x, shape (f,), and values of it and the k next ones."""
        degree, knots = self._degree, self._knots
        interval = np.clip(np.searchsorted(knots, x, side="right") - 1, degree, len(knots) - degree - 2)
        values = np.ones((len(x), 1))
        for order in range(1, degree + 1):
            low = knots[interval[:, None] + np.arange(1 - order, 1)]
            high = knots[interval[:, None] + np.arange(1, order + 1)]
            scaled = values / (high - low)
            values = np.zeros((len(x), order + 1))
            values[:, :-1] = (high - x[:, None]) * scaled
            values[:, 1:] += (x[:, None] - low) * scaled
        return interval - degree, values
