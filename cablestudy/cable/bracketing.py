"""Zeros and minima of many functions of one number at once: brackets by growing steps, and Chandrupatla's methods.

The numbers are those of `scipy.optimize.elementwise` (`bracket_root`, `find_root`, `find_minimum`), to the last digit.
Importing scipy.optimize takes longer than all else that a command on one cable does.

References
----------
Chandrupatla 1997, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using
derivatives, Advances in Engineering Software 28(3), 145-149.

Chandrupatla 1998, An efficient quadratic fit-sectioning algorithm for minimization without derivatives, Computer
Methods in Applied Mechanics and Engineering 152(1-2), 211-217.
"""

import numpy as np

ROUNDING = 4 * np.finfo(float).eps  # width of a bracket over its zero, which cannot be much less
PLACED = np.sqrt(np.finfo(float).eps)  # to which rounding lets the place of a minimum be found, relative
SMALLER_PART = 1.5 - 0.5 * 5**0.5  # of an interval in the golden section
TINY = np.finfo(float).tiny  # a value that is as good as zero; four times as wide is a bracket about zero


def bracket(function, low, high, least, most, index, steps):
    """Look for a change of sign below and above a first interval, halving the distance to a limit in each step.

    Parameters
    ----------
    function : callable
        Arguments, shape (k,), and which of the functions they belong to, shape (k,) -> values, shape (k,).
    low, high : ndarray, shape (n,)
        The first interval.
    least, most : ndarray, shape (n,)
        Limits, finite, which are not reached.
    index : ndarray of int, shape (n,)
        Which of the functions these are.
    steps : int

    Returns
    -------
    found : ndarray of bool, shape (n,)
    low, high : ndarray, shape (n,)
        Ends of the brackets, where one was found.
    """
    limit = np.array([least, most])
    place, before = np.array([low, high]), np.array([high, low])
    gap = limit - place
    value = np.array([function(low, index), function(high, index)])
    earlier = value[::-1].copy()
    found = np.zeros(place.shape, dtype=bool)
    search = np.tile((least <= low) & (low < high) & (high <= most), (2, 1))
    for step in range(steps + 1):
        if step:
            gap[search] /= 2
            before[search], earlier[search] = place[search], value[search]
            place[search] = limit[search] - gap[search]
            value[search] = function(place[search], np.broadcast_to(index, search.shape)[search])
        sign, last = np.sign(value), np.sign(earlier)
        new = search & ((last == -sign) | (last == 0) | (sign == 0))
        found |= new
        search &= ~(new | new[::-1]) & (place != limit) & np.isfinite(value)
        if not search.any():
            break
    below = found[0] & ((before[0] - place[0] <= place[1] - before[1]) | ~found[1])
    return found.any(axis=0), np.where(below, place[0], before[1]), np.where(below, before[0], place[1])


def zeros_between(function, low, high, index, rtol=ROUNDING, smallest=TINY, steps=2048):
    """Zeros between places where functions have different signs, shape (n,); not a number where they have one sign.

    Parameters
    ----------
    function, index
        As of `bracket`.
    low, high : ndarray, shape (n,)
    rtol : float
        Width of the last bracket over the zero.
    smallest : float
        A value of the function that is as good as zero.
    steps : int
        At most.
    """
    index = np.asarray(index)
    x1, x2 = np.array(low, dtype=float), np.array(high, dtype=float)
    f1, f2 = function(x1, index), function(x2, index)
    zero, going, share = np.full(x1.shape, np.nan), np.arange(len(x1)), 0.5
    for step in range(steps + 1):
        if step:
            x = x1 + share * (x2 - x1)
            f = function(x, index[going])
            same = np.sign(f) == np.sign(f1)
            x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
            x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
            x1, f1 = x, f
        first = np.abs(f1) < np.abs(f2)
        best, value = np.where(first, x1, x2), np.where(first, f1, f2)
        met = np.abs(value) <= smallest
        none = ((np.sign(f1) == np.sign(f2)) & ~met) | (np.isnan(f1) & np.isnan(f2))
        zero[going] = np.where(none, np.nan, best)
        width, least = np.abs(x2 - x1), np.abs(best) * rtol + 4 * TINY
        on = ~(met | none | (width < least))
        if not on.any():
            break
        going, x1, x2, f1, f2, width, least = (part[on] for part in (going, x1, x2, f1, f2, width, least))
        if step:
            share = _share(x1, x2, x3[on], f1, f2, f3[on], 0.5 * least / width)
    return zero


def _share(x1, x2, x3, f1, f2, f3, edge):
    """Part of the way from x1 to x2 that comes next: inverse quadratic where that is safe, else half; shape (n,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        xi, phi = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
        alpha = (x3 - x1) / (x2 - x1)
        safe = (1 - np.sqrt(1 - xi) < phi) & (phi < np.sqrt(xi))
        quadratic = f1 / (f1 - f2) * f3 / (f3 - f2) - alpha * f1 / (f3 - f1) * f2 / (f2 - f3)
    return np.clip(np.where(safe, quadratic, 0.5), edge, 1 - edge)


def minima_between(function, low, middle, high, index, width=TINY, rtol=PLACED, settled=TINY, steps=100):
    """Local minima between ascending places: places and values, each of shape (n,).

    Not a number where the value at `middle` is not the least of the three, or one is not finite.

    Parameters
    ----------
    function, index
        As of `bracket`.
    low, middle, high : ndarray, shape (n,)
    width, rtol : float
        Half the distance of places that are as good as one, and that over the place.
    settled : float
        How much values that are as good as equal differ, relative.
    steps : int
        At most.
    """
    index = np.asarray(index)
    places = np.array([low, middle, high], dtype=float)
    values = function(places.ravel(), np.tile(index, 3)).reshape(places.shape)
    one, best, other = np.stack([places, values], axis=1)  # rows: place and value
    found, going, before = np.full(best.shape, np.nan), np.arange(best.shape[1]), other[0]
    near = width
    for step in range(steps + 1):
        if step:
            x, before = _fitted(one, best, other, before, near)
            new = np.array([x, function(x, index[going])])
            beyond, worse = np.sign(x - best[0]) == np.sign(other[0] - best[0]), new[1] > best[1]
            one, best, other = (
                np.where(beyond, np.where(worse, one, best), np.where(worse, new, one)),
                np.where(worse, best, new),
                np.where(beyond, np.where(worse, new, other), np.where(worse, other, best)),
            )
        none = (best[1] > one[1]) | (best[1] > other[1]) | ~np.isfinite(one + best + other).all(axis=0)
        found[:, going] = np.where(none, np.nan, best)
        turned = np.abs(other[0] - best[0]) < np.abs(best[0] - one[0])
        one, other = np.where(turned, other, one), np.where(turned, one, other)  # the second interval is the larger
        near = np.abs(best[0]) * rtol + width
        level = one[1] - 2 * best[1] + other[1] <= 2 * (np.abs(best[1]) * settled + TINY)
        on = ~(none | level | (np.abs(other[0] - best[0]) <= 2 * near))
        if not on.any():
            break
        going, one, best, other, before, near = (part[..., on] for part in (going, one, best, other, before, near))
    return found


def _fitted(one, best, other, before, near):
    """Next places, shape (n,), and the minima of the parabolas through three points, which they are where it is safe.

    Safe is a parabola whose minimum moved little since the one before; else the golden section of the larger interval.
    """
    first, second = best[0] - one[0], other[0] - best[0]
    a, b = first * (other[1] - best[1]), second * (one[1] - best[1])
    quadratic = 0.5 * (a / (a + b) * (one[0] - other[0]) + best[0] + other[0])
    apart = np.where(np.abs(quadratic - best[0]) <= near, best[0] + np.sign(second) * near, quadratic)
    golden = best[0] + SMALLER_PART * second
    return np.where(np.abs(quadratic - before) < 0.5 * np.abs(first), apart, golden), quadratic
