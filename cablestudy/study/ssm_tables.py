"""Frequency responses of the command `ssm`: their frequencies, resonances among them, as tables and as pictures."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np

from cablestudy.control import response
from cablestudy.motion.tolerances import MOTION
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

WITHIN = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])  # frequencies about a resonance, in its half-widths


@dataclass(frozen=True)
class Curve:
    """One frequency response."""

    name: str  # prefix of its columns; empty for the only curve of a table
    label: str
    unit: str
    value: Callable  # frequencies, shape (m,) [Hz] -> complex, shape (m,) [unit]


class FrequencyGrid(NamedTuple):
    """Frequencies of a response: those of equal ratios, and others between them. [Hz]"""

    low: float
    high: float
    count: int  # of those of equal ratios
    others: tuple = ()

    @property
    def size(self):
        """Number of all of them."""
        return self.count + len(self.others)


def with_resonances(frequency_range, poles):
    """Frequencies for a response whose narrow peaks must not be missed.

    They are at equal ratios, and five more are at each pole with a peak (damping ratio below `STUDY.resonant`): at the
    size of the pole, and on both sides of it at 0.5 and 1 half-widths of the peak, since a large static part shifts the
    peak. An undamped pole, where the response is infinite, is left out.

    Parameters
    ----------
    frequency_range : (float, float, int)
        Lowest and highest frequency [Hz] and number of those at equal ratios.
    poles : ndarray, shape (p,)
        p poles of the response, complex. [rad/s]

    Returns
    -------
    FrequencyGrid
    """
    low, high, count = frequency_range
    size = np.abs(poles)
    resonant = (poles.imag > 0) & (-poles.real < STUDY.resonant * size) & (-poles.real > MOTION.undamped_motion * size)
    frequency = near_poles(poles[resonant], WITHIN, low, high)
    # without those that coincide with a frequency at equal ratios, or with each other
    log_step = np.log(high / low) / (count - 1)
    steps_from_low = np.log(frequency / low) / log_step
    frequency = frequency[np.abs(steps_from_low - np.rint(steps_from_low)) * log_step > STUDY.equal_frequencies]
    distinct = np.diff(frequency, prepend=0.0) > STUDY.equal_frequencies * frequency
    return FrequencyGrid(low, high, count, tuple(frequency[distinct].tolist()))


def near_poles(poles, half_widths, low, high):
    """Frequencies between `low` and `high` near resonances, ascending. [Hz]

    Parameters
    ----------
    poles : ndarray, shape (p,)
        Complex. [rad/s]
    half_widths : ndarray
        Distances of the frequencies from that of a pole, in half-widths of its peak. [-]
    """
    frequency = (np.abs(poles)[:, None] + np.abs(poles.real)[:, None] * half_widths) / (2 * np.pi)
    return np.unique(frequency[(frequency > low) & (frequency < high)])


def response_blocks(frequency_range, curves):
    """Yield a response in blocks: frequency [Hz], then magnitude [unit] and phase [deg] of each curve, shape (m,) each.

    Parameters
    ----------
    frequency_range : (float, float, int) or FrequencyGrid
        From `ssm.read_response_range` or `with_resonances`.
    curves : list of Curve
    """
    phases = [response.Phase() for _ in curves]
    for frequency in response.frequency_blocks(*frequency_range):
        block = [frequency]
        for curve, phase in zip(curves, phases, strict=True):
            value = curve.value(frequency)
            block += [np.abs(value), phase(value)]
        yield block


def drawn_points(frequency_range, curves):
    """The points of a response that a picture shows, resonances included: arrays as in `response_blocks`.

    Of a long response, of each group of neighbouring frequencies the first and those with the smallest and the largest
    magnitude of each curve.
    """
    neighbours = -(-frequency_range[2] // STUDY.drawn_groups)
    kept, left = [], None
    for block in response_blocks(frequency_range, curves):
        block = np.stack(block)
        block = block if left is None else np.concatenate([left, block], axis=1)
        whole = block.shape[1] - block.shape[1] % neighbours
        kept.append(_extremes(block[:, :whole], neighbours))
        left = block[:, whole:]
    return [*np.concatenate([*kept, left], axis=1)]


def _extremes(block, neighbours):
    """Points of a block of a response: of each group of neighbours the first, the smallest and the largest of a curve.

    The rows of the block are the frequency, then magnitude and phase of each curve.
    """
    if neighbours == 1 or not block.size:
        return block
    groups = np.nan_to_num(block[1::2]).reshape(len(block) // 2, -1, neighbours)  # of magnitudes
    first = np.arange(0, block.shape[1], neighbours)
    chosen = [first, *(first + groups.argmin(axis=2)), *(first + groups.argmax(axis=2))]
    return block[:, np.unique(chosen)]


def response_table(frequency_range, curves):
    """Table of frequency, and magnitude and phase of each curve; arguments are those of `response_blocks`.

    Cells are empty where a response is not finite, for example at the pole of an undamped mode.
    """
    fields = [Field("frequency_Hz", "frequency", "Hz")]
    for curve in curves:
        before, title = (f"{curve.name}_", f"{curve.name} ") if curve.name else ("", "")
        suffix = f"_{re.sub('[ ()]', '', curve.unit).replace('/', '_per_')}" if curve.unit else ""
        fields += [Field(f"{before}magnitude{suffix}", f"{title}magnitude", curve.unit)]
        fields += [Field(f"{before}phase_deg", f"{title}phase", "deg")]
    return Table(tuple(fields), _Rows([field.name for field in fields], FrequencyGrid(*frequency_range), curves))


@dataclass(frozen=True)
class _Rows(Sequence):
    """Rows computed on demand, from the first on, since a long response does not fit in memory."""

    names: list
    grid: FrequencyGrid
    curves: list

    def __len__(self):
        return self.grid.size

    def __getitem__(self, index):
        if isinstance(index, slice):
            return list(self._between(*index.indices(len(self))[:2]))[:: index.step]
        return self[index : index + 1 or None][0]  # of the last row, -1, the slice has no end

    def __iter__(self):
        return self._between(0, len(self))

    def _between(self, first, end):
        """Yield the rows from a first one to the one before an end: dict of name -> number, or None."""
        begin = 0
        for block in response_blocks(self.grid, self.curves):
            if begin >= end:
                return
            part = slice(max(first - begin, 0), max(end - begin, 0))
            for cells in zip(*(values[part].tolist() for values in block), strict=True):
                yield {n: c if isfinite(c) else None for n, c in zip(self.names, cells, strict=True)}
            begin += len(block[0])
