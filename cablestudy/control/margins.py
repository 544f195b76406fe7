"""The loop gain over frequency: gains at which a pole crosses the imaginary axis, margins, sensitivity, bandwidth.

L is the loop gain, S = 1/(1 + L) the sensitivity and T = L/(1 + L) the complementary sensitivity (Skogestad and
Postlethwaite, Multivariable Feedback Control, 2005, sections 2.2 and 2.4).
"""

import numpy as np

from cablestudy.errors import NoSolutionError

STEPS = 60  # of bisection, to rounding, and of the search for a gain
BISECTIONS = 12  # for the frequency of a crossing, whose gain is then judged and refined
PER_DECADE = 40
ASIDE = np.concatenate([[0.0], 0.2 * 1.6 ** np.arange(16)])  # distances from a pole, in its half-widths
BESIDE = 0.12  # largest such distance, relative to the frequency of the pole
REFINEMENTS = 6
PEAKS, POINTS, ZOOMS = 4, 21, 8  # highest peaks on the grid that are refined, in how many points, and how often
REACHED = 1e-9  # relative, of a peak of the sensitivity that rounding leaves where it is reached
REAL = 1e-7  # imaginary part over size of an eigenvalue that rounding may have moved off the real axis
NEAR_AXIS, TURN, COARSE = 0.8, 0.5, 2e-3  # where: angle from the negative axis, turn [rad]; finest relative distance


def crossing_gains(plant, cable, poles):
    """Gains at which a pole of the closed loop crosses the imaginary axis: where L is real and negative, L = -1.

    Parameters
    ----------
    plant : Plant
    cable : Superelement
        Model of the cable.
    poles : ndarray
        Poles without control of the plant with this model. [rad/s]

    Returns
    -------
    ndarray
        Ascending. [rad/s]
    """
    omega, value = curve(plant, cable, poles)
    crosses = (value.imag[:-1] * value.imag[1:] < 0) & (np.minimum(value.real[:-1], value.real[1:]) < 0)
    where = np.flatnonzero(crosses)
    if not len(where):
        return np.zeros(0)
    low, _ = _bisected(lambda omega: plant.unit_gain_of(cable, 1j * omega).imag, omega, value.imag, where, BISECTIONS)
    real = plant.unit_gain_of(cable, 1j * low).real
    return np.sort(-1 / real[real < 0])


def crossing_near(needed_gain, begin, step, farthest, settled):
    """Gain and frequency at which a pole crosses the imaginary axis near a frequency [rad/s]; None if not found.

    Parameters
    ----------
    needed_gain : callable
        Frequency [rad/s] -> -1/L of a gain of 1 rad/s, complex: where it is real it is that gain.
    begin, step, farthest : float
        First frequency, distance of the second one, and largest distance of the crossing. [rad/s]
    settled : float
        Step that ends the search. [rad/s]

    Notes
    -----
    The imaginary part is about linear in the frequency, so that the secant method needs few steps.
    """
    before, here, last = begin, begin + step, needed_gain(begin).imag
    for _ in range(STEPS):
        found = needed_gain(here)
        if found.imag == last:
            return None
        change = found.imag * (here - before) / (found.imag - last)
        if abs(change) <= settled:
            return found.real, here
        before, last, here = here, found.imag, here - change
        if not abs(here - begin) <= farthest:
            return None
    return None


def curve(plant, cable, poles):
    """Frequencies that show how L passes the negative real axis [rad/s], and L there for a gain of 1 rad/s.

    Arguments are those of `crossing_gains`.
    """
    omega, value = np.zeros(0), np.zeros(0, dtype=complex)
    new = frequencies(plant, np.concatenate([poles, cable.poles]))
    for _ in range(REFINEMENTS):
        with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode
            omega, value = np.append(omega, new), np.append(value, plant.unit_gain_of(cable, 1j * new))
        there = np.isfinite(value)
        order = np.argsort(omega[there])
        omega, value = omega[there][order], value[there][order]
        # L may cross the axis and come back between two frequencies: finer where it turns, and near the negative axis
        near = np.abs(np.angle(-value)) < NEAR_AXIS
        gap = np.diff(omega) / omega[1:]
        coarse = (gap > COARSE) & (near[1:] | near[:-1] | (np.abs(np.angle(value[1:] / value[:-1])) > TURN))
        new = (omega[1:] + omega[:-1])[coarse] / 2
        if not len(new):
            break
    return omega, value


def frequencies(plant, poles):
    """Frequencies at which a loop gain is evaluated: all decades, and beside poles and notch. [rad/s]"""
    if plant.notch is not None:
        poles = np.concatenate([poles, plant.notch.corners])
    poles = poles[np.abs(poles) > 0]
    centre = np.abs(poles)
    low, high = 1e-4 * centre.min(), 1e3 * centre.max()
    width = np.maximum(np.abs(poles.real), 1e-9 * centre)[:, None] * ASIDE
    centre = centre[:, None]
    width = np.where(width < BESIDE * centre, width, 0.0)
    decades = np.geomspace(low, high, 2 + int(PER_DECADE * np.log10(high / low)))
    return np.unique(np.concatenate([decades, (centre + width).ravel(), (centre - width).ravel()]))


def gain_crossovers(loop):
    """Frequencies at which |L| = 1 [rad/s], and the angle from -1 to L there, -180 to 180 [deg], each of shape (k,)."""
    omega = _zeros(loop, lambda value: np.abs(value) - 1, lambda size: size[:-1] * size[1:] < 0)
    return omega, np.degrees(np.angle(-loop.unit_gain(1j * omega)))


def phase_margin(phase):
    """The least angle of the `gain_crossovers`; None where there is none. [deg]"""
    return float(np.abs(phase).min()) if len(phase) else None


def phase_margin_frequency(omega, phase):
    """The frequency of the phase margin; None where there is none. [Hz]"""
    return float(omega[np.argmin(np.abs(phase))] / (2 * np.pi)) if len(omega) else None


def delay_margin(omega, phase):
    """The least delay that turns L into -1 at one of the `gain_crossovers`; None where there is none. [s]"""
    return float((np.radians(phase % 360) / omega).min()) if len(omega) else None


def sensitivity_peak(loop):
    """Largest |S| over all frequencies [-], and the frequency of the peak [rad/s]: 1 and None where none is above."""

    def size(omega):
        with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode |L| is infinite
            value = np.abs(1 / (1 + loop.gain * loop.unit_gain(1j * omega)))
        return np.nan_to_num(value, nan=0.0, posinf=0.0)

    peak, omega = highest_of(size, response_frequencies(loop))
    return (peak, omega) if peak > 1 else (1.0, None)


def gain_of_peak(unit_gain, omega, peak, most):
    """The largest gain up to another one with which no singular value of (I + gain L)^-1 is above a value.

    Parameters
    ----------
    unit_gain : callable
        s, shape (f,) -> L over the gain, shape (f, k, k).
    omega : ndarray, shape (f,)
        Frequencies to begin with, as close as L turns. [rad/s]
    peak : float
        Above 1. [-]
    most : float
        [rad/s]

    Returns
    -------
    gain, omega : float
        And the frequency of the peak; None with `most`. [rad/s], [rad/s]

    Raises
    ------
    NoSolutionError
        The search did not end.

    Notes
    -----
    At one frequency a singular value is `peak` for gains g = 1/m where (I + g L)^H (I + g L) - I/peak^2 is singular:

        (1 - 1/peak^2) m^2 I + m (L + L^H) + L^H L

    Where it is larger with the gain g, so it is for all gains down to the next such one below g.
    """
    found = None
    for _ in range(STEPS):

        def size(omega, gain=most):
            return 1 / np.maximum(_least(_finite(unit_gain(1j * omega)), gain), np.finfo(float).tiny)

        def inverse(omega, gain=most):
            return _next_below(_finite(unit_gain(1j * omega)), peak, gain)

        height, place = highest_of(size, omega)
        if height <= peak * (1 + REACHED):
            break
        omega = np.union1d(omega, place)
        highest, found = highest_of(inverse, omega)
        most = 1 / max(highest, (1 + REACHED) / most)  # rounding may hide the next gain, all but reached
    else:
        raise NoSolutionError(f"no gain with a sensitivity of at most {peak:g} was found in {STEPS} steps")
    return most, found


def _least(value, gain):
    """Least singular value of I + gain L, shape (f,)."""
    return np.linalg.svd(np.eye(value.shape[-1]) + gain * value, compute_uv=False)[:, -1]


def _finite(value):
    """Matrices with 0 in place of those that are not finite, shape (f, k, k)."""
    return np.where(np.isfinite(value).all(axis=(-2, -1), keepdims=True), value, 0.0)


def _next_below(value, peak, gain):
    """One over the next gain below another one that has a peak of the sensitivity; 0 where `gain` has no higher one.

    Parameters
    ----------
    value : ndarray, shape (f, k, k)
        L over the gain.
    peak, gain : float

    Returns
    -------
    ndarray, shape (f,)
        [s]
    """
    size, room, found = value.shape[-1], 1 - peak**-2, np.zeros(len(value))
    higher = np.flatnonzero(_least(value, gain) * peak < 1)
    value = value[higher]
    conjugate = np.swapaxes(value.conj(), -1, -2)
    companion = np.zeros((len(value), 2 * size, 2 * size), dtype=complex)
    companion[:, :size, size:] = np.eye(size)
    companion[:, size:, :size] = -conjugate @ value / room
    companion[:, size:, size:] = -(value + conjugate) / room
    inverse = np.linalg.eigvals(companion)
    there = (np.abs(inverse.imag) <= REAL * np.abs(inverse)) & (inverse.real * gain > 1)
    least = np.where(there, inverse.real, np.inf).min(axis=1, initial=np.inf)
    found[higher] = np.where(np.isfinite(least), least, 0.0)
    return found


def highest_of(function, omega):
    """The largest value of a function of frequency, shape (f,) -> (f,), and the frequency where it is. [rad/s]

    Parameters
    ----------
    function : callable
    omega : ndarray, shape (f,)
        Ascending; the highest values among them are refined. [rad/s]
    """
    value = function(omega)
    slope = np.diff(value, prepend=-np.inf, append=-np.inf)
    tops = np.flatnonzero((slope[:-1] >= 0) & (slope[1:] <= 0))
    tops = tops[np.argsort(value[tops])[-PEAKS:]]
    low, top, high = omega[np.maximum(tops - 1, 0)], omega[tops], omega[np.minimum(tops + 1, len(omega) - 1)]
    rows, half = np.arange(len(tops)), POINTS // 2
    for _ in range(ZOOMS):  # the highest value so far stays among them, however narrow its peak is
        below, above = np.linspace(low, top, half, False, axis=1), np.linspace(top, high, half + 1, axis=1)
        omega = np.concatenate([below, above], axis=1)
        value = function(omega.ravel()).reshape(omega.shape)
        place = value.argmax(axis=1)
        low, top = omega[rows, np.maximum(place - 1, 0)], omega[rows, place]
        high = omega[rows, np.minimum(place + 1, POINTS - 1)]
    best = int(value.max(axis=1).argmax())
    return float(value[best].max()), float(omega[best, place[best]])


def response_frequencies(loop):
    """All decades, and frequencies beside the resonances of open and closed loop. [rad/s]"""
    plant = loop.plant
    return frequencies(plant, np.concatenate([plant.open_poles, plant.responding.poles, loop.closed_poles]))


def bandwidth(loop):
    """Where the closed loop L/(1 + L) first falls to 1/sqrt(2); None when it never does. [Hz]"""

    def first(size):
        falls = (size[:-1] > 0) & (size[1:] <= 0)
        return falls & (np.cumsum(falls) == 1)

    omega = _zeros(loop, lambda value: np.abs(value / (1 + value)) - np.sqrt(0.5), first)
    return float(omega[0] / (2 * np.pi)) if len(omega) else None


def _zeros(loop, size, chosen):
    """Frequencies at which a real function of the loop gain is zero, by bisection. [rad/s]"""
    plant = loop.plant
    omega = frequencies(plant, np.concatenate([plant.open_poles, plant.responding.poles, [-loop.gain]]))
    with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode
        value = loop.gain * plant.unit_gain(1j * omega)
    there = np.isfinite(value)
    omega, value = omega[there], size(value[there])
    where = np.flatnonzero(chosen(value))
    if not len(where):
        return np.zeros(0)
    low, high = _bisected(lambda w: size(loop.gain * plant.unit_gain(1j * w)), omega, value, where, STEPS)
    return (low + high) / 2


def _bisected(function, omega, value, where, steps):
    """Narrow brackets of the zeros of a function that follow the places `where` of a grid with known values."""
    low, high, sign = omega[where], omega[where + 1], np.sign(value[where])
    for _ in range(steps):
        middle = (low + high) / 2
        same = np.sign(function(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, high
