"""Frequencies at which a loop gain of k coordinates is evaluated, and its extrema and zeros between them.

A loop gain is a function of s, shape (f,) [rad/s], with values of shape (f, k, k); k = 1 for one cable.
"""

from functools import partial

import numpy as np

from cablestudy.cable.bracketing import minima_between, zeros_between
from cablestudy.control.law import INTEGRATOR
from cablestudy.control.tolerances import CONTROL

ASIDE = np.array([0.6, 2.0, 6.0])  # distances from a pole, in its half-widths


def frequencies(poles, notches=(), law=INTEGRATOR):
    """First grid of frequencies for a loop gain: all decades, denser beside poles, in steps of the phase of a delay.

    Parameters
    ----------
    poles : ndarray
        Poles of the open loop; those in the lower half plane, mirror images of others, are left out. [rad/s]
    notches : iterable of (Notch or None)
        Their corners, and those of the law, count as poles.
    law : Law
        Its delay sets the step of some frequencies.

    Returns
    -------
    ndarray, shape (f,)
        Ascending. [rad/s]
    """
    poles = np.concatenate([poles, *(notch.corners for notch in notches if notch is not None), law.corners])
    poles = poles[(poles.imag >= 0) & (np.abs(poles) > 0)]
    size = np.abs(poles)
    low, high = CONTROL.grid_range[0] * size.min(), CONTROL.grid_range[1] * size.max()
    decades = np.geomspace(low, high, 2 + int(CONTROL.grid_per_decade * np.log10(high / low)))
    delay_steps = np.zeros(0)
    if law.delay:
        delay_steps = CONTROL.delay_turn / law.delay * np.arange(1, law.reach * law.delay / CONTROL.delay_turn)
    return distinct(np.concatenate([decades, delay_steps[delay_steps < high], near_poles(poles)]))


def distinct(omega):
    """Frequencies in ascending order, without those that differ from others by rounding: these would hide a peak."""
    omega = np.unique(omega)
    return omega[np.append(True, np.diff(omega) > CONTROL.same_frequency * omega[1:])]


def near_poles(poles):
    """Frequencies at the sizes of some poles, and on both sides at multiples of their half-widths. [rad/s]"""
    size = np.abs(poles)
    half_width = np.maximum(np.abs(poles.real), CONTROL.infinite_at_pole * size)
    step = half_width[:, None] * np.concatenate([-ASIDE, ASIDE])
    beside = (size[:, None] + step)[np.abs(step) < CONTROL.broad_pole * size[:, None]]
    return np.concatenate([beside, size[np.abs(poles.real) > CONTROL.infinite_at_pole * size]])


def by_parts(function, omega):
    """Values of a function of s at frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    block = CONTROL.frequencies_at_once
    if len(omega) <= block:
        return function(1j * omega)
    return np.concatenate([function(1j * omega[begin : begin + block]) for begin in range(0, len(omega), block)])


def eigenvalues(matrices):
    """Eigenvalues of matrices, shape (f, k, k) -> (f, k); not a number where a matrix is not finite."""
    if matrices.shape[-1] == 1:
        return np.where(np.isfinite(matrices), matrices, np.nan)[..., 0]
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    values = np.full(matrices.shape[:-1], np.nan, dtype=complex)
    values[finite] = np.linalg.eigvals(matrices[finite])
    return values


def paired(values):
    """Pairs of eigenvalues at neighbouring frequencies: those before, and those after, shape (..., f - 1, 2 k) both.

    Each eigenvalue is paired with the nearest one at the next frequency, and with the nearest one at the frequency
    before. `values` has the shape (..., f, k); the pairs of k = 1 have the shape (..., f - 1, 1).
    """
    before, after = values[..., :-1, :], values[..., 1:, :]
    if values.shape[-1] == 1:
        return before, after
    distance = np.abs(before[..., :, None] - after[..., None, :])
    nearest_after = np.take_along_axis(after, distance.argmin(axis=-1), axis=-1)
    nearest_before = np.take_along_axis(before, distance.argmin(axis=-2), axis=-1)
    return np.concatenate([before, nearest_before], axis=-1), np.concatenate([nearest_after, after], axis=-1)


def curve(function, omega, matrices=None, upto=np.inf, most=np.inf):
    """Refine a grid of frequencies until it shows where eigenvalues of a loop gain cross the negative real axis.

    Stability follows from these crossings, see `margins_crossings`.

    Parameters
    ----------
    function : callable
        The loop gain: s, shape (f,) -> shape (f, k, k).
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
        The loop gain there.
    values : ndarray, shape (g, k)
        Its eigenvalues.
    """
    omega, matrices = finite(omega, by_parts(function, omega) if matrices is None else matrices)
    return _subdivided(function, omega, matrices, eigenvalues(matrices), partial(_may_cross_twice, most=most), upto)


def curve_beside(function, gain, omega, matrices, values):
    """Frequencies of a `curve`, closer where the sensitivity with a gain [rad/s] changes fast, and the loop gain there.

    `omega`, `matrices` and `values` are those of the curve.
    """

    def changes_fast(values):
        before, after = (1 + gain * eigenvalue for eigenvalue in paired(values))  # distances from -1, complex
        near = np.minimum(np.abs(before), np.abs(after))
        fast = np.abs(after - before) > CONTROL.followed_change * near
        return ((near < CONTROL.followed_distance) & fast).any(axis=1)

    return _subdivided(function, omega, matrices, values, changes_fast)[:2]


def with_more(function, omega, matrices, added):
    """Frequencies and the loop gain there, with those `added` [rad/s] that are not among them."""
    new_omega = np.setdiff1d(distinct(np.append(omega, added)), omega)
    new_omega, new_matrices = finite(new_omega, by_parts(function, new_omega))
    index = np.searchsorted(omega, new_omega)
    return np.insert(omega, index, new_omega), np.insert(matrices, index, new_matrices, axis=0)


def _subdivided(function, omega, matrices, values, divides, upto=np.inf):
    """Frequencies, matrices and eigenvalues as of `curve`, with more frequencies where intervals are divided.

    `divides` is a function: eigenvalues, shape (f, k) -> which intervals between them, array of bool, shape (f - 1,).
    """
    fractions = np.arange(1, CONTROL.interval_parts) / CONTROL.interval_parts
    for _ in range(CONTROL.interval_rounds):
        width = np.diff(omega)
        divided = divides(values) & (width > CONTROL.close_frequencies * omega[1:]) & (omega[1:] < upto)
        if not divided.any():
            break
        new_omega = (omega[:-1][divided, None] + width[divided, None] * fractions).ravel()
        new_omega, new_matrices = finite(new_omega, by_parts(function, new_omega))
        index = np.searchsorted(omega, new_omega)
        omega, matrices = np.insert(omega, index, new_omega), np.insert(matrices, index, new_matrices, axis=0)
        values = np.insert(values, index, eigenvalues(new_matrices), axis=0)
    return omega, matrices, values


def _may_cross_twice(values, most):
    """Intervals in which an eigenvalue may cross the negative real axis and come back, array of bool, shape (f - 1,).

    `values` are eigenvalues, shape (f, k), and `most` is that of `curve`; smaller eigenvalues cross with larger gains.
    """
    before, after = paired(values)
    sizes = np.abs(before), np.abs(after)
    crosses = (before.imag * after.imag <= 0) & (before.real < 0) & (after.real < 0)
    with np.errstate(divide="ignore"):
        most = max(most, (1 / np.minimum(*sizes)[crosses]).min(initial=np.inf))
    turn = np.abs(np.angle(after * before.conj()))
    to_axis = np.minimum(np.abs(np.angle(-before)), np.abs(np.angle(-after)))
    with np.errstate(divide="ignore", invalid="ignore"):  # an eigenvalue of zero
        growth = np.abs(np.log(sizes[1] / sizes[0]))
    changes = (turn > CONTROL.angle_change * to_axis) | ~(growth < CONTROL.size_change)
    may_cross = (turn > CONTROL.eigenvalue_turn) | ((to_axis < CONTROL.near_axis) & changes)
    matters = np.maximum(*sizes) * most * CONTROL.closely_looked_above >= 1
    return (may_cross & matters).any(axis=1)


def finite(omega, matrices):
    """The frequencies at which all of a matrix is finite, and the matrices there."""
    is_finite = np.isfinite(matrices).all(axis=(-2, -1))
    return omega[is_finite], matrices[is_finite]


def highest(function, omega, value=None):
    """Find the largest value of a function of frequency, and the frequency where it is [rad/s]: two float.

    Parameters
    ----------
    function : callable
        Frequencies, shape (f,) -> values, shape (f,).
    omega : ndarray, shape (f,)
        Ascending, close enough to show every peak; each one that may be the highest is refined. [rad/s]
    value : ndarray, shape (f,), optional
        Values of the function there, where they are known.
    """
    value = function(omega) if value is None else value
    index = int(np.argmax(value))
    largest = float(value[index]), float(omega[index])
    # how much higher than a value a peak beside it may be
    reach = np.maximum(CONTROL.flat_peak * np.abs(value[index]), CONTROL.peak_reach * _visible_height(value))
    low, top, high = _peaks(omega, value, value + reach >= value[index])
    if not len(top):
        return largest
    position, height = maxima(function, low, top, high)
    peak = int(np.argmax(height))
    if not height[peak] >= value[index]:  # the largest value is at an end of the range
        return largest
    return _polished_maximum(function, float(height[peak]), float(position[peak]), float(high[peak] - low[peak]))


def _visible_height(value):
    """Height of each value above the lower one of its neighbours, shape (f,)."""
    return value - np.minimum(np.append(value[1:], value[-1]), np.append(value[0], value[:-1]))


def _peaks(omega, value, chosen):
    """Frequencies before, at and after the chosen values that are local maxima, each of shape (p,). [rad/s]"""
    before, inner, after = value[:-2], value[1:-1], value[2:]
    is_peak = (inner >= before) & (inner >= after) & (inner > np.minimum(before, after))
    index = 1 + np.flatnonzero(is_peak & chosen[1:-1])
    return omega[index - 1], omega[index], omega[index + 1]


def maxima(function, low, top, high, *which):
    """Local maxima of a function between frequencies: their frequencies [rad/s] and values, each of shape (p,).

    Parameters
    ----------
    function : callable
        Frequencies, shape (q,), and the entries of `which` for the maxima near them, shape (q,) -> values, shape (q,).
    low, top, high : ndarray, shape (p,)
        Ascending; the value at `top` is the highest of the three. [rad/s]
    which : ndarray, shape (p,)
        Further arguments of the function, one value for each maximum, such as the number of one of several functions.
    """
    width = high - low

    def negative(offset, index):
        """Negative of the function beside the tops of some maxima, at offsets over their widths."""
        return -function(top[index] + offset * width[index], *(argument[index] for argument in which))

    # offsets from the top in place of frequencies: a peak may be a billionth of its frequency wide
    brackets = (low - top) / width, np.zeros(len(top)), (high - top) / width
    tolerances = {"width": CONTROL.extremum_place, "rtol": 0.0, "settled": CONTROL.extremum_value}
    offset, value = minima_between(negative, *brackets, np.arange(len(top)), **tolerances)
    return top + offset * width, np.nan_to_num(-value, nan=-np.inf)


def _polished_maximum(function, height, omega, width):
    """Height and frequency [rad/s] of a maximum, both to rounding, from those known to `extremum_place`.

    A Newton step with the derivatives of fourth order of five values around it; `width` is that of its bracket.
    """
    step = CONTROL.stencil * width
    value = function(omega + step * np.arange(-2, 3))
    slope, curvature = np.array([1, -8, 0, 8, -1]) @ value / 12, np.array([-1, 16, -30, 16, -1]) @ value / 12
    if not curvature < -abs(slope):
        return height, omega
    omega -= float(step * slope / curvature)
    return max(height, float(function(np.array([omega]))[0])), omega


def passages(function, omega, value):
    """Find where k functions of frequency pass zero.

    Parameters
    ----------
    function : callable
        Frequencies, shape (f,) -> values of all functions, shape (f, k).
    omega : ndarray, shape (f,)
        Ascending, close enough to show every extremum. A function that passes zero and comes back between two of them
        is found where the values around suggest it. [rad/s]
    value : ndarray, shape (f, k)
        Values of the functions there.

    Returns
    -------
    zeros : ndarray, shape (z,)
        Ascending. [rad/s]
    which : ndarray of int, shape (z,)
        Number of the function that is zero there.
    """

    def single(omega, which):
        """Value of one function, its number in `which`, at each frequency."""
        return np.take_along_axis(function(omega), which[:, None], axis=1)[:, 0]

    extrema = _extrema_beyond_zero(single, omega, value)
    if len(extrema):
        omega, value = np.append(omega, extrema), np.concatenate([value, function(extrema)])
        order = np.argsort(omega)
        omega, value = omega[order], value[order]
    index, which = np.nonzero((value[:-1] < 0) != (value[1:] < 0))
    if not len(index):
        return np.zeros(0), which
    zeros = zeros_between(single, omega[index], omega[index + 1], which)
    order = np.argsort(zeros)
    return zeros[order], which[order]


def _extrema_beyond_zero(function, omega, value):
    """Extrema at which a function has another sign than at the frequencies around it, shape (t,). [rad/s]"""
    brackets = []
    for which, values in enumerate(value.T):
        for sign in (1.0, -1.0):
            signed = sign * values
            may_reach_zero = (signed < 0) & (signed + CONTROL.peak_reach * _visible_height(signed) > 0)
            bracket = _peaks(omega, signed, may_reach_zero)
            brackets.append((*bracket, np.full(len(bracket[0]), which), np.full(len(bracket[0]), sign)))
    low, top, high, which, sign = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    if not len(top):
        return np.zeros(0)
    position, height = maxima(lambda omega, which, sign: sign * function(omega, which), low, top, high, which, sign)
    return np.unique(position[height > 0])
