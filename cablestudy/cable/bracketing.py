"""Zeros and minima of many functions of one number at once, by Chandrupatla's methods.

The numbers are those of `scipy.optimize.elementwise` (`find_root`, `find_minimum`), to the last digit.
Importing scipy.optimize takes longer than all else that a command on one cable does.

References
----------
Chandrupatla 1997, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using
derivatives, Advances in Engineering Software 28(3), 145-149.

Chandrupatla 1998, An efficient quadratic fit-sectioning algorithm for minimization without derivatives, Computer
Methods in Applied Mechanics and Engineering 152(1-2), 211-217.
"""

import numpy as np

ROUNDING = 4 * np.finfo(float).eps  # least width of a bracket, relative to the zero in it
MINIMUM_ROUNDING = np.sqrt(np.finfo(float).eps)  # relative error of the argument of a minimum due to rounding
SMALLER_PART = 1.5 - 0.5 * 5**0.5  # of an interval in the golden section
TINY = np.finfo(float).tiny  # a value as small counts as zero; 4 times it is the least width of a bracket about zero


def zeros_between(function, low, high, index, rtol=ROUNDING, smallest=TINY, steps=2048):
    """Zero of each of n functions in an interval at whose ends it has different signs, by Chandrupatla's method (1997).

    Parameters
    ----------
    function : callable
        Arguments, shape (k,), and indices of the functions they belong to, shape (k,) -> values, shape (k,).
    low, high : ndarray, shape (n,)
        Ends of the intervals.
    index : ndarray of int, shape (n,)
        Indices of the n functions, which `function` is called with.
    rtol : float
        Relative accuracy: an interval is divided until its width over the zero is below this.
    smallest : float
        Largest size of a value of the function that counts as zero.
    steps : int
        Largest number of steps.

    Returns
    -------
    ndarray, shape (n,)
        Not a number where the signs at the ends are equal.
    """
    index = np.asarray(index)
    # the bracket is from x1, the newest point, to x2; x3 is the point left out last: names as in Chandrupatla (1997)
    x1, x2 = np.array(low, dtype=float), np.array(high, dtype=float)
    f1, f2 = function(x1, index), function(x2, index)
    zeros, active, fraction = np.full(x1.shape, np.nan), np.arange(len(x1)), 0.5
    for step in range(steps + 1):
        if step:
            x = x1 + fraction * (x2 - x1)
            f = function(x, index[active])
            same_sign = np.sign(f) == np.sign(f1)
            x3, f3 = np.where(same_sign, x1, x2), np.where(same_sign, f1, f2)
            x2, f2 = np.where(same_sign, x2, x1), np.where(same_sign, f2, f1)
            x1, f1 = x, f
        nearer = np.abs(f1) < np.abs(f2)
        best, value = np.where(nearer, x1, x2), np.where(nearer, f1, f2)
        solved = np.abs(value) <= smallest
        one_sign = ((np.sign(f1) == np.sign(f2)) & ~solved) | (np.isnan(f1) & np.isnan(f2))
        zeros[active] = np.where(one_sign, np.nan, best)
        width, least_width = np.abs(x2 - x1), np.abs(best) * rtol + 4 * TINY
        unfinished = ~(solved | one_sign | (width < least_width))
        if not unfinished.any():
            break
        active, x1, x2, f1, f2 = (a[unfinished] for a in (active, x1, x2, f1, f2))
        if step:
            margin = 0.5 * least_width[unfinished] / width[unfinished]
            fraction = _next_fraction(x1, x2, x3[unfinished], f1, f2, f3[unfinished], margin)
    return zeros


def _next_fraction(x1, x2, x3, f1, f2, f3, margin):
    """Next argument as a fraction of the way from x1 to x2: by inverse quadratic interpolation where safe, else 1/2."""
    with np.errstate(divide="ignore", invalid="ignore"):
        xi, phi = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
        alpha = (x3 - x1) / (x2 - x1)
        safe = (1 - np.sqrt(1 - xi) < phi) & (phi < np.sqrt(xi))
        quadratic = f1 / (f1 - f2) * f3 / (f3 - f2) - alpha * f1 / (f3 - f1) * f2 / (f2 - f3)
    return np.clip(np.where(safe, quadratic, 0.5), margin, 1 - margin)


def minima_between(function, low, middle, high, index, width=TINY, rtol=MINIMUM_ROUNDING, settled=TINY, steps=100):
    """Local minimum of each of n functions between three ascending arguments, by Chandrupatla's method (1998).

    Parameters
    ----------
    function : callable
        Arguments, shape (k,), and indices of the functions they belong to, shape (k,) -> values, shape (k,).
    low, middle, high : ndarray, shape (n,)
        Arguments; the value at `middle` must be the least of the three.
    index : ndarray of int, shape (n,)
        Indices of the n functions, which `function` is called with.
    width, rtol : float
        Absolute and relative accuracy of the argument x: a search ends where both intervals next to it are at most
        2 (width + rtol |x|) wide.
    settled : float
        Relative difference of values that count as equal.
    steps : int
        Largest number of steps.

    Returns
    -------
    ndarray, shape (2, n)
        Argument of each minimum, and the value there; NaN where the value at `middle` is not the least, or
        one of the three is not finite.
    """
    index = np.asarray(index)
    x = np.array([low, middle, high], dtype=float)
    values = function(x.ravel(), np.tile(index, 3)).reshape(x.shape)
    near, best, far = np.stack([x, values], axis=1)  # rows: argument and value; the interval to `far` is divided next
    minima, active, parabola_minimum = np.full(best.shape, np.nan), np.arange(best.shape[1]), far[0]
    tolerance = width
    for step in range(steps + 1):
        if step:
            x, parabola_minimum = _next_trial(near, best, far, parabola_minimum, tolerance)
            trial = np.array([x, function(x, index[active])])
            towards_far = np.sign(x - best[0]) == np.sign(far[0] - best[0])
            worse = trial[1] > best[1]
            near, best, far = (
                np.where(towards_far, np.where(worse, near, best), np.where(worse, trial, near)),
                np.where(worse, best, trial),
                np.where(towards_far, np.where(worse, trial, far), np.where(worse, far, best)),
            )
        no_minimum = (best[1] > near[1]) | (best[1] > far[1]) | ~np.isfinite(near + best + far).all(axis=0)
        minima[:, active] = np.where(no_minimum, np.nan, best)
        swap = np.abs(far[0] - best[0]) < np.abs(best[0] - near[0])
        near, far = np.where(swap, far, near), np.where(swap, near, far)  # the interval to `far` is the larger one
        tolerance = np.abs(best[0]) * rtol + width
        flat = near[1] - 2 * best[1] + far[1] <= 2 * (np.abs(best[1]) * settled + TINY)
        unfinished = ~(no_minimum | flat | (np.abs(far[0] - best[0]) <= 2 * tolerance))
        if not unfinished.any():
            break
        active, near, best, far, parabola_minimum, tolerance = (
            a[..., unfinished] for a in (active, near, best, far, parabola_minimum, tolerance)
        )
    return minima


def _next_trial(near, best, far, previous_minimum, tolerance):
    """Next arguments, and the minima of the parabolas through three points, which are taken where safe; shape (n,).

    Safe is a parabola whose minimum moved little since the one before; else the golden section of the larger interval.
    """
    to_best, to_far = best[0] - near[0], far[0] - best[0]
    a, b = to_best * (far[1] - best[1]), to_far * (near[1] - best[1])
    minimum = 0.5 * (a / (a + b) * (near[0] - far[0]) + best[0] + far[0])
    apart = np.where(np.abs(minimum - best[0]) <= tolerance, best[0] + np.sign(to_far) * tolerance, minimum)
    golden = best[0] + SMALLER_PART * to_far
    return np.where(np.abs(minimum - previous_minimum) < 0.5 * np.abs(to_best), apart, golden), minimum
