"""First frequencies at which a loop gain is evaluated, and extrema and zeros of functions of frequency between them."""

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
