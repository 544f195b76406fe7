"""Frequencies of a response over frequency in blocks, and its phase from block to block."""

import numpy as np

from cablestudy.control.tolerances import CONTROL


def frequency_blocks(low, high, count, others=()):
    """Yield the frequencies of a response, ascending, in blocks of about `frequency_block`: ndarray. [Hz]

    They are `count` frequencies with equal ratios from `low` to `high`, both included, merged with `others`.

    Parameters
    ----------
    low, high : float
        0 < low < high. [Hz]
    count : int
        At least 2. [-]
    others : ndarray
        Ascending, such as resonances; none equals one of the `count` frequencies. [Hz]
    """
    first, last = np.log10(low), np.log10(high)
    step = (last - first) / (count - 1)
    for begin in range(0, count, CONTROL.frequency_block):
        block = 10.0 ** (np.arange(begin, min(begin + CONTROL.frequency_block, count)) * step + first)
        if not begin:
            block[0] = low  # exactly
        if begin + CONTROL.frequency_block >= count:
            block[-1] = high
        others = np.asarray(others, dtype=float)
        before = others[others < block[-1]]
        others = others[len(before) :]
        yield np.sort(np.concatenate([block, before]))


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
