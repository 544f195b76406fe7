"""Frequency responses from the dynamic end stiffness: no matrix is solved for each frequency.

Responses are complex and of the shape (m,) of the frequencies [Hz]; not finite at the pole of an undamped mode.
"""

import numpy as np

from cablestudy.control.tolerances import CONTROL
from cablestudy.system.superelement import GONDOLA, GROUND


def frequencies(low, high, count, others=()):
    """Yield frequencies with equal ratios, both ends included, and others, in blocks of about `frequency_block`.

    Parameters
    ----------
    low, high : float
        0 < low < high. [Hz]
    count : int
        At least 2. [-]
    others : ndarray
        Rising, none of them one of those with equal ratios. [Hz]
    """
    first, last = np.log10(low), np.log10(high)
    step = (last - first) / (count - 1)
    for begin in range(0, count, CONTROL.frequency_block):
        block = 10.0 ** (np.arange(begin, min(begin + CONTROL.frequency_block, count)) * step + first)
        if not begin:
            block[0] = low
        if begin + CONTROL.frequency_block >= count:
            block[-1] = high
        others = np.asarray(others, dtype=float)
        before = others[others < block[-1]]
        others = others[len(before) :]
        yield np.sort(np.concatenate([block, before]))


@np.errstate(all="ignore")
def between_ends(model, force, displacement, frequency):
    """Force at one of the six ends for a unit displacement of one of them, all others at rest. [N/m]

    Parameters
    ----------
    model : Superelement
    force, displacement : int
        Which of the six end forces and end displacements.
    frequency : ndarray, shape (m,)
        [Hz]
    """
    return model.dynamic_stiffness(2j * np.pi * frequency, [force], [displacement])[:, 0, 0]


@np.errstate(all="ignore")
def winch_to_gondola(model, mass, damping, location, frequency):
    """Position of the gondola for a unit displacement of the winch with the loop open, as in the paper's Fig. 8. [-]

    At low frequencies 1 for a winch on the ground and -1 for one on the gondola.

    Parameters
    ----------
    model : Superelement
    mass : float
        Of the gondola. [kg]
    damping : float
        Viscous, on the gondola. [N s/m]
    location : {"ground", "gondola"}
        Where the winch is: curve A or B.
    frequency : ndarray, shape (m,)
        [Hz]
    """
    own, driven = _at_gondola(model, mass, damping, location, 2j * np.pi * frequency)
    return driven / own


@np.errstate(all="ignore")
def position(model, mass, damping, location, loop, frequency):
    """Position of the gondola for a unit force on it with the loop closed. [m/N]

    Parameters
    ----------
    model, mass, damping, location, frequency
        As for `winch_to_gondola`.
    loop : Loop
        Its gain, and its controller.
    """
    s = 2j * np.pi * frequency
    own, driven = _at_gondola(model, mass, damping, location, s)
    sign = -1 if location == "gondola" else 1
    return 1 / (own + sign * loop.gain * loop.controller(s)[:, 0] * driven)


def _at_gondola(model, mass, damping, location, s):
    """Force on the gondola per its displacement, and per that of the winch. [N/m]"""
    own, ground = model.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0].T
    return mass * s**2 + damping * s + own, -own if location == "gondola" else -ground


class Phase:
    """Unwraps the phase of a response given in consecutive blocks; the first phase is between -180 and 180 degrees."""

    def __init__(self):
        self._last, self._turns = None, 0

    def __call__(self, value):
        """Phase [deg] of the next block, complex, shape (m,): unwrapped, NaN where it is not finite."""
        phase = np.angle(value)
        known = np.isfinite(phase)
        if known.any():
            found = phase[known]
            step = np.diff(found, prepend=found[0] if self._last is None else self._last)
            turns = self._turns - np.cumsum(np.rint(step / (2 * np.pi)))
            self._last, self._turns = found[-1], turns[-1]
            phase[known] = found + 2 * np.pi * turns
        return np.degrees(phase)
