"""Frequency responses through the dynamic end stiffness: no matrix solve for each frequency, nothing truncated."""

import numpy as np

from cablestudy.control.ends import GONDOLA, GROUND
from cablestudy.control.transfer import dynamic_stiffness

BLOCK = 4096  # frequencies at once, for memory


def frequencies(low, high, count):
    """Frequencies with equal ratios, both ends included.

    Parameters
    ----------
    low, high : float
        0 < low < high. [Hz]
    count : int
        At least 2. [-]

    Returns
    -------
    ndarray, shape (count,)
        [Hz]
    """
    return np.geomspace(low, high, count)


def between_ends(model, frequency, force, displacement):
    """Force at one end for a unit displacement of one, all others at rest.

    Parameters
    ----------
    model : EndModel
    frequency : ndarray, shape (m,)
        [Hz]
    force, displacement : int
        Which of the six.

    Returns
    -------
    ndarray, complex, shape (m,)
        Infinite or not a number at the pole of an undamped mode. [N/m]
    """
    return _blocks(lambda s: dynamic_stiffness(model, s, [force], [displacement])[:, 0, 0], frequency)


def winch_to_gondola(model, mass, location, frequency):
    """Position of the gondola for a unit movement of the winch, the loop open: the paper's Fig. 8.

    Parameters
    ----------
    model : EndModel
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
        both = dynamic_stiffness(model, s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        return -(both[:, 0] if location == "gondola" else both[:, 1]) / (mass * s**2 + both[:, 0])

    return _blocks(ratio, frequency)


def position(loop, model, frequency):
    """Position of the gondola for a unit force on it, the loop closed.

    Parameters
    ----------
    loop : Loop
    model : EndModel
        The cable's, with the modes to keep.
    frequency : ndarray, shape (m,)
        [Hz]

    Returns
    -------
    ndarray, complex, shape (m,)
        [m/N]
    """

    def compliance(s):
        both = dynamic_stiffness(model, s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        driven = both[:, 0] if loop.location == "gondola" else -both[:, 1]
        return 1 / (loop.mass * s**2 + both[:, 0] + loop.gain * loop.controller(s) * driven)

    return _blocks(compliance, frequency)


def bode(value):
    """Magnitude, and phase without jumps, which begins between -180 and 180.

    Parameters
    ----------
    value : ndarray, complex, shape (m,)

    Returns
    -------
    magnitude : ndarray, shape (m,)
    phase : ndarray, shape (m,)
        [deg]
    """
    phase = np.angle(value)
    known = np.isfinite(phase)
    phase[known] = np.unwrap(phase[known])
    return np.abs(value), np.degrees(phase)


def _blocks(function, frequency):
    """A function of i omega, in blocks."""
    s = 2j * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.concatenate([function(s[i : i + BLOCK]) for i in range(0, len(s), BLOCK)])
