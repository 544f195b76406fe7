"""Loop gains over frequency, of many loops at once: enough frequencies to show where poles cross the imaginary axis.

A loop gain is a function of s, shape (f,) [rad/s], with values of shape (f, k, k); k = 1 for one cable. Those of n
loops are a sequence of n such functions, all of the same k. Loops are numbered by `row`: what is at hand of all of them
stands one loop after the other, and no digit of one depends on the others.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from cablestudy.cable.records import concatenate, take_rows
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.tolerances import CONTROL


def by_parts(function, s):
    """Values of a function of s, shape (f,), few at a time, whose matrices stay in the processor's cache."""
    block = CONTROL.frequencies_at_once
    if len(s) <= block:
        return function(s)
    return np.concatenate([function(s[begin : begin + block]) for begin in range(0, len(s), block)])


def eigenvalues(matrices):
    """Eigenvalues of matrices, shape (f, k, k) -> (f, k); NaN where a matrix is not finite."""
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


@dataclass(frozen=True)
class LoopGainCurves:
    """Loop gains of n loops, each at frequencies of its own.

    Attributes
    ----------
    row : ndarray of int, shape (f,)
        Number of the loop, ascending.
    omega : ndarray, shape (f,)
        Frequencies, ascending within each loop. [rad/s]
    matrices : ndarray, shape (f, k, k)
        The loop gain there, finite.
    values : ndarray, shape (f, k)
        Its eigenvalues.
    """

    row: np.ndarray
    omega: np.ndarray
    matrices: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, row, omega, matrices):
        """`LoopGainCurves` of known loop gains, without the frequencies at which these are infinite."""
        finite = np.isfinite(matrices).all(axis=(-2, -1))
        return cls(row[finite], omega[finite], matrices[finite], eigenvalues(matrices[finite]))

    def of_loop(self, number):
        """`LoopGainCurves` of one loop, whose number is then 0."""
        part = slice(*np.searchsorted(self.row, [number, number + 1]).tolist())
        return LoopGainCurves(self.row[part] - number, self.omega[part], self.matrices[part], self.values[part])

    def with_more(self, functions, row, omega):
        """The curves with more frequencies, `row` and `omega` of these, of the n loop gains `functions`."""
        added = LoopGainCurves.of(row, omega, at_frequencies(functions, row, omega))
        both = concatenate([self, added])
        return take_rows(both, np.lexsort([both.omega, both.row]))


def at_frequencies(functions, row, omega, growth=0.0):
    """Loop gains of n loops, `functions`, at s = (growth + i) w, w of the loops `row`, ascending: shape (f, k, k).

    Those that are all `LoopGain`, of equal `signature`, are computed in one call.
    """
    s = (growth + 1j) * omega
    if all(isinstance(function, LoopGain) for function in functions):
        return LoopGain.of_rows(functions, row, s)
    if not len(s):  # of loops whose gain nowhere is one, for example
        return functions[0](s)
    edges = np.searchsorted(row, np.arange(len(functions) + 1)).tolist()
    parts = zip(functions, edges[:-1], edges[1:], strict=True)
    return np.concatenate([by_parts(function, s[begin:end]) for function, begin, end in parts if end > begin])


def sample_curves(functions, row, omega, matrices=None, highest=np.inf, most=np.inf):
    """Compute n loop gains at frequencies that show each crossing of the negative real axis by an eigenvalue.

    Stability follows from these crossings: a pole of the closed loop is on the imaginary axis where gain times
    eigenvalue is -1. Intervals between the given frequencies are divided where an eigenvalue may cross unseen.

    Parameters
    ----------
    functions : sequence of callable
        The n loop gains, each divided by its gain: s, shape (f,) [rad/s] -> shape (f, k, k). [s]
    row : ndarray of int, shape (f,)
        Number of the loop to which each first frequency belongs, ascending.
    omega : ndarray, shape (f,)
        First frequencies, ascending within each loop. [rad/s]
    matrices : ndarray, shape (f, k, k), optional
        Values of `functions` there; computed if not given. [s]
    highest : float or ndarray, shape (n,)
        Frequency above which no interval is divided. [rad/s]
    most : float or ndarray, shape (n,)
        Gain of each loop up to which no crossing may be missed; if no pole crosses below it, the least gain with a
        crossing takes its place. [rad/s]

    Returns
    -------
    LoopGainCurves
        The loop gains and their eigenvalues at the first and at the added frequencies.
    """
    first = LoopGainCurves.of(row, omega, at_frequencies(functions, row, omega) if matrices is None else matrices)
    most, highest = (np.broadcast_to(bound, len(functions)) for bound in (most, highest))
    return _subdivided(functions, first, partial(_may_cross_twice, most=most), highest)


def refined_for_sensitivity(function, gain, curve):
    """A `LoopGainCurves` of one loop with closer frequencies where the sensitivity with a gain [rad/s] changes fast."""

    def changes_fast(curve):
        before, after = (1 + gain * eigenvalue for eigenvalue in paired(curve.values))  # distances from -1, complex
        near = np.minimum(np.abs(before), np.abs(after))
        fast = np.abs(after - before) > CONTROL.followed_change * near
        return ((near < CONTROL.followed_distance) & fast).any(axis=1)

    return _subdivided([function], curve, changes_fast, np.array([np.inf]))


def _subdivided(functions, curves, divides, highest):
    """Divide intervals of frequency where a criterion asks for it, and compute n loop gains there: `LoopGainCurves`.

    Each interval is divided into `interval_parts`, and these in turn, in up to `interval_rounds` rounds. `divides`
    returns a mask of the intervals of `LoopGainCurves`, shape (f - 1,) for f frequencies. Above `highest` of a loop,
    shape (n,) [rad/s], none is divided.
    """
    fractions = np.arange(1, CONTROL.interval_parts) / CONTROL.interval_parts
    for _ in range(CONTROL.interval_rounds):
        row, low, high = curves.row[1:], curves.omega[:-1], curves.omega[1:]
        wide = (high - low > CONTROL.close_frequencies * high) & (high < highest[row]) & (row == curves.row[:-1])
        divided = divides(curves) & wide
        if not divided.any():
            break
        new_omega = low[divided, None] + (high - low)[divided, None] * fractions
        curves = curves.with_more(functions, np.repeat(row[divided], len(fractions)), new_omega.ravel())
    return curves


def _may_cross_twice(curves, most):
    """Mask of the intervals of frequency in which an eigenvalue may cross the negative real axis and come back unseen.

    It may where the eigenvalue turns by a large angle, or where it is near the axis and its angle or size changes by
    much. An eigenvalue l crosses at the gain 1/|l|: one too small to cross at the gains of interest does not count.
    `most`, shape (n,), are gains up to which no crossing of the n loops may be missed; where the least gain with a
    crossing is larger, it is looked up to that one.
    """
    before, after = paired(curves.values)
    row, inside = curves.row[1:], curves.row[1:] == curves.row[:-1]
    size_before, size_after = np.abs(before), np.abs(after)
    crosses = (before.imag * after.imag <= 0) & (before.real < 0) & (after.real < 0) & inside[:, None]
    least_gain = np.full(len(most), np.inf)  # of each loop, with a crossing
    with np.errstate(divide="ignore"):
        np.minimum.at(least_gain, row, np.where(crosses, 1 / np.minimum(size_before, size_after), np.inf).min(axis=1))
    highest_gain = np.maximum(most, least_gain)[row, None]
    may_cross = np.maximum(size_before, size_after) * highest_gain * CONTROL.closely_looked_above >= 1
    # from here on only the eigenvalues that are large enough in their intervals
    before, after, size_before, size_after = (part[may_cross] for part in (before, after, size_before, size_after))
    turn = np.abs(np.angle(after * before.conj()))
    to_axis = np.minimum(np.abs(np.angle(-before)), np.abs(np.angle(-after)))
    with np.errstate(divide="ignore", invalid="ignore"):  # an eigenvalue of zero
        growth = np.abs(np.log(size_after / size_before))
    changes = (turn > CONTROL.angle_change * to_axis) | ~(growth < CONTROL.size_change)
    may_cross[may_cross] = (turn > CONTROL.eigenvalue_turn) | ((to_axis < CONTROL.near_axis) & changes)
    return may_cross.any(axis=1)
