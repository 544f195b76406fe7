"""Frequency responses from the dynamic end stiffness: no matrix is solved for each frequency."""

import numpy as np

from cablestudy.system.superelement import GONDOLA, GROUND

BLOCK = 4096  # frequencies computed at once, to bound the memory of a long response


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
    """Force at one end for a unit displacement of an end, all other ends at rest.

    Parameters
    ----------
    model : Superelement
    force, displacement : int
        Which of the six end forces and end displacements.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        Infinite or not a number at the pole of an undamped mode. [N/m]
    """
    return _at(lambda s: model.dynamic_stiffness(s, [force], [displacement])[:, 0, 0], frequency)


def winch_to_gondola(model, mass, location, frequency):
    """Position of the gondola for a unit displacement of the winch with the loop open, as in the paper's Fig. 8.

    Parameters
    ----------
    model : Superelement
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
        Where the winch is: curve A or B.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        At low frequencies 1 for a winch on the ground and -1 for one on the gondola. [-]
    """

    def ratio(s):
        both = model.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        return -(both[:, 0] if location == "gondola" else both[:, 1]) / (mass * s**2 + both[:, 0])

    return _at(ratio, frequency)


def position(loop, model, frequency):
    """Position of the gondola for a unit force on it with the loop closed.

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
    """Unwraps the phase of a response given in consecutive blocks; the first phase is between -180 and 180 degrees."""

    def __init__(self):
        self._last, self._turns = None, 0

    def __call__(self, value):
        """Phase of the next block, unwrapped.

        Parameters
        ----------
        value : ndarray, complex, shape (m,)

        Returns
        -------
        ndarray, shape (m,)
            NaN where the response is not finite. [deg]
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
    """A function of i omega, without warnings where it is not finite."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return function(2j * np.pi * frequency)
