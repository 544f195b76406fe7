"""First frequencies at which a loop gain is evaluated, and extrema and zeros of functions of frequency between them."""

import numpy as np

from cablestudy.cable.bracketing import minima_between, zeros_between
from cablestudy.control.law import INTEGRATOR
from cablestudy.control.tolerances import CONTROL

ASIDE = np.array([0.6, 2.0, 6.0])  # distances from a pole, in its half-widths


def frequencies(poles, notches=(), law=INTEGRATOR):
    """First grid of frequencies for a loop gain: equal ratios over all decades, denser near poles and for a delay.

    Parameters
    ----------
    poles : ndarray, complex
        Poles of the open loop. Those in the lower half plane are left out, as mirror images of others. [rad/s]
    notches : iterable of (Notch or None)
        Notch filters of the loop, whose corner frequencies count as poles.
    law : Law
        Control law: its corner frequencies count as poles too; its delay T adds frequencies in equal steps of w T.

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
    return distinct(np.concatenate([decades, delay_steps[delay_steps < high], near_poles(_apart(poles))]))


def _apart(poles):
    """One of those poles each that nearly coincide, as with equal cables: the same frequencies show all of them.

    They have about the same damping ratio, and sizes that differ by less than a small share of their half-widths.
    """
    size, share = np.abs(poles), CONTROL.poles_together
    ratio = np.round(np.log(_half_width(poles) / size) / share)  # its logarithm, in steps of that share
    log_size = np.round(np.log(size) / (share * np.exp(share * ratio)))
    return poles[np.unique(log_size + 1j * ratio, return_index=True)[1]]


def _half_width(poles):
    """Half of the width of the resonance of each pole, at least that of a pole that is hardly damped. [rad/s]"""
    return np.maximum(np.abs(poles.real), CONTROL.infinite_at_pole * np.abs(poles))


def distinct(omega):
    """Frequencies in ascending order, without those that differ from others by rounding: these would hide a peak."""
    omega = np.unique(omega)
    return omega[np.append(True, np.diff(omega) > CONTROL.same_frequency * omega[1:])]


def near_poles(poles):
    """Frequencies at the sizes of some poles, and on both sides at multiples of their half-widths. [rad/s]"""
    size = np.abs(poles)
    step = _half_width(poles)[:, None] * np.concatenate([-ASIDE, ASIDE])
    both_sides = (size[:, None] + step)[np.abs(step) < CONTROL.broad_pole * size[:, None]]
    return np.concatenate([both_sides, size[np.abs(poles.real) > CONTROL.infinite_at_pole * size]])


def highest(function, curves, equal=0.0):
    """Find the largest value of each of n functions of frequency, and the frequency where it is.

    It serves, for example, to find the peak of a sensitivity. A peak between given frequencies is refined if it may be
    the highest. Of equal peaks the lowest frequency is taken.

    Parameters
    ----------
    function : callable
        Evaluates many functions at once: frequencies [rad/s] and, for each, the number of the function (from 0), both
        of shape (q,) -> values, shape (q,).
    curves : list of (ndarray, ndarray)
        For each function: frequencies, shape (f,), ascending and close enough to show every peak [rad/s]; and the
        values there, shape (f,).
    equal : float
        Relative difference of heights up to which peaks are equal. If above 0, no height may be negative. [-]

    Returns
    -------
    list of (float, float)
        For each function its largest value, and the frequency [rad/s].
    """
    found, brackets = [], []
    for number, (omega, value) in enumerate(curves):
        index = int(np.argmax(value))
        found.append((float(value[index]), float(omega[index])))
        # how much higher than a value a peak near it may be
        reach = np.maximum(CONTROL.flat_peak * np.abs(value[index]), CONTROL.peak_reach * _visible_height(value))
        low, top, high = _peaks(omega, value, value + reach >= value[index])
        brackets.append((low, top, high, np.full(len(top), number)))
    low, top, high, which = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    if not len(top):
        return found
    position, height = maxima(function, low, top, high, which)
    tallest = np.array([value for value, _ in found])  # else the largest value is at an end of the range
    np.maximum.at(tallest, which, height)
    best = np.flatnonzero(height >= tallest[which] * (1 - equal))
    heights, positions = _polished_maxima(function, height[best], position[best], (high - low)[best], which[best])
    for number in np.unique(which[best]).tolist():
        of_function = which[best] == number
        largest = max(tallest[number], heights[of_function].max())
        is_equal = of_function & (heights >= largest * (1 - equal))
        if is_equal.any():
            found[number] = float(largest), float(positions[is_equal].min())
    return found


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
    """Refine p local maxima of functions of frequency, each between two frequencies: their frequencies and values.

    `function` returns the values at frequencies [rad/s], given also the entries of `which` for each: arrays of shape
    (p,), such as the number of one of several functions. `low`, `top` and `high`, shape (p,), are below, near and above
    each maximum: of the three `top` has the highest value. A value that is NaN becomes -inf.
    """
    width = high - low

    def negative(offset, index):
        """Negative of the function near the tops of some maxima, at offsets over their widths."""
        return -function(top[index] + offset * width[index], *(argument[index] for argument in which))

    # offsets from the top in place of frequencies: a peak may be a billionth of its frequency wide
    brackets = (low - top) / width, np.zeros(len(top)), (high - top) / width
    tolerances = {"width": CONTROL.extremum_offset, "rtol": 0.0, "settled": CONTROL.extremum_value}
    offset, value = minima_between(negative, *brackets, np.arange(len(top)), **tolerances)
    return top + offset * width, np.nan_to_num(-value, nan=-np.inf)


def _polished_maxima(function, height, omega, width, which):
    """Heights and frequencies [rad/s] of maxima, to rounding, from those known to `extremum_offset`: two arrays.

    A Newton step with the derivatives of fourth order of five values around each; `width` is that of its bracket.
    """
    step = CONTROL.stencil * width
    around = omega[:, None] + step[:, None] * np.arange(-2, 3)
    value = function(around.ravel(), np.repeat(which, 5)).reshape(around.shape)
    slope, curvature = ((value * weights).sum(axis=1) / 12 for weights in ([1, -8, 0, 8, -1], [-1, 16, -30, 16, -1]))
    sharp = np.flatnonzero(curvature < -np.abs(slope))
    height, omega = height.copy(), omega.copy()
    omega[sharp] -= step[sharp] * slope[sharp] / curvature[sharp]
    height[sharp] = np.fmax(height[sharp], function(omega[sharp], which[sharp]))
    return height, omega


def zero_crossings(function, curves):
    """Find the zeros of n functions of frequency with k values each, such as the crossovers of a loop gain.

    A zero lies between two given values of different signs. Two zeros lie on both sides of an extremum that passes zero
    between given values of one sign.

    Parameters
    ----------
    function : callable
        Evaluates many functions at once: frequencies [rad/s] and, for each, the number of the function (from 0), both
        of shape (q,) -> values, shape (q, k).
    curves : list of (ndarray, ndarray)
        For each function: frequencies, shape (f,), ascending and close enough to show every extremum [rad/s]; and its
        values there, shape (f, k).

    Returns
    -------
    list of (ndarray, ndarray of int)
        For each function the frequencies of its zeros, ascending [rad/s], and which of the k values is zero.
    """

    def single(omega, number, rank):
        """One value of a function, its number in `rank`, at each frequency."""
        return np.take_along_axis(function(omega, number), rank[:, None], axis=1)[:, 0]

    intervals = []
    for number, (omega, value) in enumerate(_with_extrema_of_other_sign(function, single, curves)):
        index, rank = np.nonzero((value[:-1] < 0) != (value[1:] < 0))
        intervals.append((omega[index], omega[index + 1], np.full(len(index), number), rank))
    low, high, number, rank = (np.concatenate(parts) for parts in zip(*intervals, strict=True))
    zeros = np.zeros(0)
    if len(low):
        of_each = np.arange(len(low))
        zeros = zeros_between(lambda omega, of: single(omega, number[of], rank[of]), low, high, of_each)
    order = np.lexsort([zeros, number])
    edges = np.searchsorted(number[order], np.arange(1, len(curves)))
    return list(zip(np.split(zeros[order], edges), np.split(rank[order], edges), strict=True))


def _with_extrema_of_other_sign(function, single, curves):
    """Add to tables of functions of frequency the extrema that pass zero between two values of one sign.

    `function` returns the k values, shape (q, k), of functions at frequencies [rad/s], given each frequency and the
    number of its function, both of shape (q,); `single` returns one of these values, whose number is its third
    argument. `curves` are the tables, one for each function: ascending frequencies, shape (f,), and values there, (f,
    k).
    """
    brackets = []
    for number, (omega, value) in enumerate(curves):
        for rank, values in enumerate(value.T):
            for sign in (1.0, -1.0):
                signed = sign * values
                may_reach_zero = (signed < 0) & (signed + CONTROL.peak_reach * _visible_height(signed) > 0)
                low, top, high = _peaks(omega, signed, may_reach_zero)
                of_value = [np.full(len(top), constant) for constant in (number, rank, sign)]
                brackets.append((low, top, high, *of_value))
    low, top, high, number, rank, sign = (np.concatenate(parts) for parts in zip(*brackets, strict=True))
    if not len(top):
        return curves

    def signed_value(omega, number, rank, sign):
        return sign * single(omega, number, rank)

    position, height = maxima(signed_value, low, top, high, number, rank, sign)
    extrema = [np.unique(position[(number == own) & (height > 0)]) for own in range(len(curves))]
    counts = [len(own) for own in extrema]
    if not any(counts):
        return curves
    values = function(np.concatenate(extrema), np.repeat(np.arange(len(curves)), counts))
    values = np.split(values, np.cumsum(counts)[:-1])
    found = []
    for (omega, value), own, of_own in zip(curves, extrema, values, strict=True):
        order = np.argsort(np.append(omega, own))
        found.append((np.append(omega, own)[order], np.concatenate([value, of_own])[order]))
    return found
