"""Frequencies at which a loop gain of k coordinates is evaluated, and its extrema and zeros between them.

A loop gain is a function of s, shape (f,) [rad/s], with values of shape (f, k, k); that of one cable has k = 1.
"""

from functools import partial

import numpy as np

from cablestudy.cable.bracketing import minima_between, zeros_between
from cablestudy.control.law import INTEGRATOR
from cablestudy.control.tolerances import CONTROL

ASIDE = np.array([0.6, 2.0, 6.0])  # distances from a pole, in its half-widths


def frequencies(poles, notches=(), law=INTEGRATOR):
    """Frequencies of all decades, beside poles and corners, and of the turns of a delay that can be approximated.

    Parameters
    ----------
    poles : ndarray
        Those in the lower half plane do not count. [rad/s]
    notches : iterable of (Notch or None)
    law : Law

    Returns
    -------
    ndarray, shape (f,)
        Ascending. [rad/s]
    """
    poles = np.concatenate([poles, *(one.corners for one in notches if one is not None), law.corners])
    poles = poles[(poles.imag >= 0) & (np.abs(poles) > 0)]
    centre = np.abs(poles)
    low, high = CONTROL.grid_range[0] * centre.min(), CONTROL.grid_range[1] * centre.max()
    decades = np.geomspace(low, high, 2 + int(CONTROL.grid_per_decade * np.log10(high / low)))
    turns = (
        CONTROL.delay_turn / law.delay * np.arange(1, law.reach * law.delay / CONTROL.delay_turn)
        if law.delay
        else np.zeros(0)
    )
    return distinct(np.concatenate([decades, turns[turns < high], near_poles(poles)]))


def distinct(omega):
    """Frequencies in ascending order, without those that only rounding tells from others: these would hide a peak."""
    omega = np.unique(omega)
    return omega[np.append(True, np.diff(omega) > CONTROL.same_frequency * omega[1:])]


def near_poles(poles):
    """Frequencies at and on both sides of the sizes of some poles, at distances of their half-widths. [rad/s]"""
    centre = np.abs(poles)
    step = np.maximum(np.abs(poles.real), CONTROL.infinite_at_pole * centre)[:, None] * np.concatenate([-ASIDE, ASIDE])
    aside = (centre[:, None] + step)[np.abs(step) < CONTROL.broad_pole * centre[:, None]]
    return np.concatenate([aside, centre[np.abs(poles.real) > CONTROL.infinite_at_pole * centre]])


def by_parts(function, omega):
    """Values of a function of s at frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    if len(omega) <= CONTROL.frequencies_at_once:
        return function(1j * omega)
    return np.concatenate(
        [
            function(1j * omega[i : i + CONTROL.frequencies_at_once])
            for i in range(0, len(omega), CONTROL.frequencies_at_once)
        ]
    )


def eigenvalues(matrices):
    """Eigenvalues of matrices, shape (f, k, k) -> (f, k); not a number where a matrix is not finite."""
    if matrices.shape[-1] == 1:
        return np.where(np.isfinite(matrices), matrices, np.nan)[..., 0]
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-1], np.nan, dtype=complex)
    found[finite] = np.linalg.eigvals(matrices[finite])
    return found


def paired(values):
    """Eigenvalues at neighbouring frequencies that belong together: before and after, shape (..., f - 1, 2 k) both.

    Each with the nearest one at the next frequency, and each of these with the nearest one before; shape (..., f - 1,
    k) of k = 1. `values` has the shape (..., f, k).
    """
    first, second = values[..., :-1, :], values[..., 1:, :]
    if values.shape[-1] == 1:
        return first, second
    apart = np.abs(first[..., :, None] - second[..., None, :])
    before = np.concatenate([first, np.take_along_axis(first, apart.argmin(axis=-2), axis=-1)], axis=-1)
    after = np.concatenate([np.take_along_axis(second, apart.argmin(axis=-1), axis=-1), second], axis=-1)
    return before, after


def curve(function, omega, matrices=None, upto=np.inf, most=np.inf):
    """Frequencies that show where eigenvalues of a loop gain cross the negative real axis, and the loop gain there.

    Parameters
    ----------
    function : callable
        The loop gain.
    omega : ndarray, shape (f,)
        Ascending frequencies to begin with. [rad/s]
    matrices : ndarray, shape (f, k, k), optional
        The loop gain there.
    upto : float
        Frequency above which no more are taken. [rad/s]
    most : float
        Gain up to which no crossing may be missed, or the least one with a crossing where that is larger. [rad/s]

    Returns
    -------
    omega : ndarray, shape (g,)
        Ascending; those at which the loop gain is infinite are left out. [rad/s]
    matrices : ndarray, shape (g, k, k)
    values : ndarray, shape (g, k)
        Its eigenvalues.
    """
    omega, matrices = finite(omega, by_parts(function, omega) if matrices is None else matrices)
    return _closer(function, omega, matrices, eigenvalues(matrices), partial(_unsure, most=most), upto)


def curve_beside(function, gain, omega, matrices, values):
    """Those of a `curve`, closer where the sensitivity with a gain [rad/s] turns, and the loop gain there."""

    def turning(values):
        before, after = (1 + gain * part for part in paired(values))
        near = np.minimum(np.abs(before), np.abs(after))
        return ((near < CONTROL.followed_distance) & (np.abs(after - before) > CONTROL.followed_change * near)).any(
            axis=1
        )

    return _closer(function, omega, matrices, values, turning)[:2]


def with_more(function, omega, matrices, added):
    """Frequencies and the loop gain there, with some that are `added` where they are not among them. [rad/s]"""
    every = distinct(np.append(omega, added))
    new = np.setdiff1d(every, omega)
    new, found = finite(new, by_parts(function, new))
    place = np.searchsorted(omega, new)
    return np.insert(omega, place, new), np.insert(matrices, place, found, axis=0)


def _closer(function, omega, matrices, values, unsure, upto=np.inf):
    """Frequencies, matrices and eigenvalues as of `curve`, with more between those that `unsure` chooses of these."""
    share = np.arange(1, CONTROL.interval_parts) / CONTROL.interval_parts
    for _ in range(CONTROL.interval_rounds):
        width = np.diff(omega)
        wide = unsure(values) & (width > CONTROL.close_frequencies * omega[1:]) & (omega[1:] < upto)
        if not wide.any():
            break
        between = (omega[:-1][wide, None] + width[wide, None] * share).ravel()
        between, added = finite(between, by_parts(function, between))
        place = np.searchsorted(omega, between)
        omega, matrices = np.insert(omega, place, between), np.insert(matrices, place, added, axis=0)
        values = np.insert(values, place, eigenvalues(added), axis=0)
    return omega, matrices, values


def _unsure(values, most):
    """Whether an eigenvalue may cross the negative real axis and come back after each frequency but the last.

    `most` as of `curve`; smaller eigenvalues cross with larger gains.
    """
    before, after = paired(values)
    size = np.abs(before), np.abs(after)
    crossed = (before.imag * after.imag <= 0) & (before.real < 0) & (after.real < 0)
    with np.errstate(divide="ignore"):
        most = max(most, (1 / np.minimum(*size)[crossed]).min(initial=np.inf))
    turn = np.abs(np.angle(after * before.conj()))
    to_axis = np.minimum(np.abs(np.angle(-before)), np.abs(np.angle(-after)))
    with np.errstate(divide="ignore", invalid="ignore"):  # an eigenvalue of zero
        growth = np.abs(np.log(size[1] / size[0]))
    changes = (turn > CONTROL.angle_change * to_axis) | ~(growth < CONTROL.size_change)
    unsure = (turn > CONTROL.eigenvalue_turn) | ((to_axis < CONTROL.near_axis) & changes)
    return (unsure & (np.maximum(*size) * most * CONTROL.closely_looked_above >= 1)).any(axis=1)


def finite(omega, matrices):
    """The frequencies at which all of a matrix is finite, and the matrices there."""
    is_finite = np.isfinite(matrices).all(axis=(-2, -1))
    return omega[is_finite], matrices[is_finite]


def highest(function, omega, value=None):
    """The largest value of a function of frequency, and the frequency where it is [rad/s].

    Parameters
    ----------
    function : callable
        Frequencies, shape (f,) -> values, shape (f,).
    omega : ndarray, shape (f,)
        Ascending, as close as the function changes: each peak that may be the highest is refined. [rad/s]
    value : ndarray, shape (f,), optional
        Of the function there.
    """
    value = function(omega) if value is None else value
    best = int(np.argmax(value))
    # how much higher than a value a peak beside it may be
    reach = np.maximum(CONTROL.flat_peak * np.abs(value[best]), CONTROL.peak_reach * _height(value))
    low, top, high = _peaks(omega, value, value + reach >= value[best])
    if not len(top):
        return float(value[best]), float(omega[best])
    place, height = maxima(function, low, top, high)
    peak = int(np.argmax(height))
    if not height[peak] >= value[best]:  # the largest value is at an end of the range
        return float(value[best]), float(omega[best])
    return _placed(function, float(height[peak]), float(place[peak]), float(high[peak] - low[peak]))


def _height(value):
    """Visible height of each value above the lower one of its neighbours, shape (f,)."""
    return value - np.minimum(np.append(value[1:], value[-1]), np.append(value[0], value[:-1]))


def _peaks(omega, value, chosen):
    """Frequencies before, at and after those of the chosen values that are local maxima, each of shape (p,)."""
    inner = (value[1:-1] >= value[:-2]) & (value[1:-1] >= value[2:]) & (value[1:-1] > np.minimum(value[:-2], value[2:]))
    place = 1 + np.flatnonzero(inner & chosen[1:-1])
    return omega[place - 1], omega[place], omega[place + 1]


def maxima(function, low, top, high, *which):
    """Local maxima of a function between frequencies: places [rad/s] and values, each of shape (p,).

    Parameters
    ----------
    function : callable
        Frequencies, shape (q,), and `which` of these maxima they belong to -> values, shape (q,).
    low, top, high : ndarray, shape (p,)
        Ascending; the value at `top` is the highest of the three. [rad/s]
    which : ndarray, shape (p,)
        Further arguments of the function.
    """
    # in steps of the distance of the frequencies: a peak may be a billionth of its frequency wide
    width = high - low
    found, value = minima_between(
        lambda step, index: -function(top[index] + step * width[index], *(one[index] for one in which)),
        (low - top) / width, np.zeros(len(top)), (high - top) / width, np.arange(len(top)),
        CONTROL.extremum_place, 0.0, CONTROL.extremum_value,
    )  # fmt: skip
    return top + found * width, np.nan_to_num(-value, nan=-np.inf)


def _placed(function, height, omega, width):
    """Height and frequency [rad/s] of a maximum, both to rounding, from those known to `extremum_place`."""
    step = CONTROL.stencil * width
    value = function(omega + step * np.arange(-2, 3))
    slope, curvature = np.array([1, -8, 0, 8, -1]) @ value / 12, np.array([-1, 16, -30, 16, -1]) @ value / 12
    if not curvature < -abs(slope):
        return height, omega
    omega -= float(step * slope / curvature)
    return max(height, float(function(np.array([omega]))[0])), omega


def passages(function, omega, value):
    """Frequencies at which functions of frequency are zero, shape (z,) [rad/s], and which of them, shape (z,).

    Parameters
    ----------
    function : callable
        Frequencies, shape (f,) -> values, shape (f, k).
    omega : ndarray, shape (f,)
        Ascending, as close as the functions change. A function that passes zero and comes back between two of them is
        seen where its values show that it may. [rad/s]
    value : ndarray, shape (f, k)
    """

    def one(omega, which):
        return np.take_along_axis(function(omega), which[:, None], axis=1)[:, 0]

    turning = _turning(one, omega, value)
    if len(turning):
        omega, value = np.append(omega, turning), np.concatenate([value, function(turning)])
        order = np.argsort(omega)
        omega, value = omega[order], value[order]
    place, which = np.nonzero((value[:-1] < 0) != (value[1:] < 0))
    if not len(place):
        return np.zeros(0), which
    found = zeros_between(one, omega[place], omega[place + 1], which)
    order = np.argsort(found)
    return found[order], which[order]


def _turning(function, omega, value):
    """Extrema at which a function has another sign than at the frequencies around it, shape (t,). [rad/s]"""
    brackets = []
    for which, own in enumerate(value.T):
        for sign in (1.0, -1.0):
            side = sign * own
            bracket = _peaks(omega, side, (side < 0) & (side + CONTROL.peak_reach * _height(side) > 0))
            brackets.append((*bracket, np.full(len(bracket[0]), which), np.full(len(bracket[0]), sign)))
    low, top, high, which, sign = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    if not len(top):
        return np.zeros(0)
    place, height = maxima(lambda omega, which, sign: sign * function(omega, which), low, top, high, which, sign)
    return np.unique(place[height > 0])
