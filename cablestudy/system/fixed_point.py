"""Acceleration of a fixed-point iteration x = g(x).

Of some arguments x_i and values g_i = g(x_i) the next argument is the combination sum of a_i g_i, sum of a_i = 1, for
which the sum of a_i (g_i - x_i) is least: where g is linear this is the argument in their space that is nearest to the
fixed point, even if the iteration itself would diverge (Anderson, Iterative procedures for nonlinear integral
equations, Journal of the ACM 12, 1965; Walker and Ni, SIAM Journal on Numerical Analysis 49, 2011).
"""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


def next_argument(arguments, values):
    """Next argument of a fixed-point iteration by Anderson acceleration, shape (..., n), each case by itself.

    Parameters
    ----------
    arguments, values : ndarray, shape (k, ..., n)
        x_i and g(x_i) of k steps, the last one last. The n components of x are of comparable size.
    """
    residual, value = values[-1] - arguments[-1], values[-1]
    changes = np.moveaxis(np.diff(values - arguments, axis=0), 0, -1)  # of the residuals from step to step
    weights = np.linalg.pinv(changes, rcond=SYSTEM.dependent_steps) @ residual[..., None]
    return value - (np.moveaxis(np.diff(values, axis=0), 0, -1) @ weights)[..., 0]
