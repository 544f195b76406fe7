"""Frequency responses through the dynamic end stiffness: no matrix solve for each frequency, nothing truncated."""

import numpy as np

from cablestudy.system.superelement import GONDOLA, GROUND

BLOCK = 4096  # frequencies at once: a long response would not fit in memory


def frequencies(low, high, count):
    """Yield frequencies with equal ratios, both ends included, in blocks.

    Parameters
    ----------
    low, high : float
        0 < low < high. [Hz]
    count : int
        At least 2. [-]

    Yields
    ------
    ndarray, shape (m,)
        m is BLOCK, and less at the end. [Hz]
    """
    first, last = np.log10(low), np.log10(high)
    step = (last - first) / (count - 1)
    for begin in range(0, count, BLOCK):
        block = 10.0 ** (np.arange(begin, min(begin + BLOCK, count)) * step + first)
        if not begin:
            block[0] = low
        if begin + BLOCK >= count:
            block[-1] = high
        yield block


def between_ends(model, force, displacement, frequency):
    """Force at one end for a unit displacement of one, all others at rest.

    Parameters
    ----------
    model : Superelement
    force, displacement : int
        Which of the six.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        Infinite or not a number at the pole of an undamped mode. [N/m]
    """
    return _at(lambda s: model.dynamic_stiffness(s, [force], [displacement])[:, 0, 0], frequency)


def winch_to_gondola(model, mass, location, frequency):
    """Position of the gondola for a unit movement of the winch, the loop open: the paper's Fig. 8.

    Parameters
    ----------
    model : Superelement
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
        Curve A, B.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        1 on the ground and -1 on the gondola where it is slow. [-]
    """

    def ratio(s):
        both = model.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        return -(both[:, 0] if location == "gondola" else both[:, 1]) / (mass * s**2 + both[:, 0])

    return _at(ratio, frequency)


def position(loop, model, frequency):
    """Position of the gondola for a unit force on it, the loop closed.

    Parameters
    ----------
    loop : Loop
    model : Superelement
        The cable's, with the modes to keep.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        [m/N]
    """

    def compliance(s):
        both = model.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        driven = both[:, 0] if loop.location == "gondola" else -both[:, 1]
        return 1 / (loop.mass * s**2 + both[:, 0] + loop.gain * loop.controller(s) * driven)

    return _at(compliance, frequency)


class Phase:
    """Phases without jumps, of one block of a response after the other; the first is between -180 and 180."""

    def __init__(self):
        self._last, self._turns = None, 0

    def __call__(self, value):
        """The phases of the next block.

        Parameters
        ----------
        value : ndarray, complex, shape (m,)

        Returns
        -------
        ndarray, shape (m,)
            [deg]
        """
        phase = np.angle(value)
        known = np.isfinite(phase)
        if known.any():
            found = phase[known]
            step = np.diff(found, prepend=found[0] if self._last is None else self._last)
            turns = self._turns - np.cumsum(np.rint(step / (2 * np.pi)))
            self._last, self._turns = found[-1], turns[-1]
            phase[known] = found + 2 * np.pi * turns
        return np.degrees(phase)


def _at(function, frequency):
    """A function of i omega; where it has no number it says nothing."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return function(2j * np.pi * frequency)
