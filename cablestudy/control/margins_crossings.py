"""Gains at which poles of loops of k coordinates cross the imaginary axis, of many loops at once; k = 1 for one cable.

L is the loop gain divided by its gain g. A pole of the closed loop lies at i w where an eigenvalue l of L(i w) is real
and negative, and g = -1/l. With l(s(g)) = -1/g along the pole, ds/dg = 1/(g^2 l'(s)), so that it crosses to the right
where the imaginary part of l grows with w, to the left where it falls.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.records import concatenate, take_rows
from cablestudy.control.curves import at_frequencies, eigenvalues, paired
from cablestudy.control.tolerances import CONTROL


@dataclass(frozen=True)
class Crossings:
    """Pairs of frequencies between which an eigenvalue of a loop gain crosses the negative real axis.

    There are c pairs, of one or several loops.

    Attributes
    ----------
    row : ndarray of int, shape (c,)
        Number of the loop, ascending.
    omega : ndarray, shape (c, 2)
        The frequencies. [rad/s]
    values : ndarray, complex, shape (c, 2)
        The eigenvalue of the loop gain divided by its gain, at these frequencies. [s]
    """

    row: np.ndarray
    omega: np.ndarray
    values: np.ndarray

    def __len__(self):
        return len(self.omega)

    def take(self, chosen):
        """Crossings that are `chosen` by numbers or bool, with the properties already computed."""
        taken = take_rows(self, chosen)
        vars(taken).update({name: value[chosen] for name, value in vars(self).items()})
        return taken

    @staticmethod
    def of_all(of_loops):
        """`Crossings` of n loops, from those of each: a list."""
        row = np.repeat(np.arange(len(of_loops)), [len(of_loop) for of_loop in of_loops])
        return replace(concatenate(of_loops), row=row)

    @cached_property
    def slope(self):
        """Change of the eigenvalue with frequency, complex, shape (c,). [s^2]"""
        return (self.values[:, 1] - self.values[:, 0]) / (self.omega[:, 1] - self.omega[:, 0])

    @cached_property
    def frequency(self):
        """Frequency of each crossing, interpolated, shape (c,). [rad/s]"""
        imag, omega = self.values.imag, self.omega
        change = imag[:, 1] - imag[:, 0]
        share = -imag[:, 0] / np.where(change, change, 1.0)
        return omega[:, 0] + share * (omega[:, 1] - omega[:, 0])

    @cached_property
    def factor(self):
        """Factor of the gain with which the pole crosses, interpolated, shape (c,)."""
        with np.errstate(divide="ignore", invalid="ignore"):  # of values that rounding leaves of zero
            return -1 / (self.values[:, 0] + self.slope * (self.frequency - self.omega[:, 0])).real

    @property
    def least(self):
        """Least factor of the crossings of the same loop, shape (c,); of `sorted` ones."""
        return self.factor[np.searchsorted(self.row, self.row)]

    @property
    def destabilising(self):
        """True where the pole crosses to the right with more gain, shape (c,)."""
        return self.slope.imag > 0

    def sorted(self):
        """`Crossings` by loop, those of each by ascending factor, without repetitions."""
        ordered = self.take(np.lexsort([self.factor, self.row]))
        row, factor, frequency = ordered.row, ordered.factor, ordered.frequency
        repeated = row[1:] == row[:-1]
        repeated &= np.diff(factor) <= CONTROL.same_crossing * factor[1:]
        repeated &= np.abs(np.diff(frequency)) <= CONTROL.same_crossing * frequency[1:]
        return ordered.take(np.append(True, ~repeated)) if repeated.any() else ordered


def crossings(row, omega, values):
    """Find neighbouring frequencies between which an eigenvalue of a loop gain crosses the negative real axis.

    There a pole of the closed loop crosses the imaginary axis, with the gain that makes the eigenvalue -1.

    Parameters
    ----------
    row : ndarray of int, shape (f,)
        Number of the curve to which each frequency belongs, ascending: of a loop, or of a part of its frequencies.
        Intervals from one curve to the next have no crossing.
    omega : ndarray, shape (f,)
        Frequencies, ascending within each curve. [rad/s]
    values : ndarray, complex, shape (f, k)
        Eigenvalues of the loop gains divided by their gain; NaN where one is infinite. [s]

    Returns
    -------
    Crossings
        Pairs of frequencies, and the eigenvalue at both.
    """
    before, after = paired(values)
    rounding = CONTROL.zero_eigenvalue * np.abs(values).max(axis=-1)[:-1, None]
    crosses = (before.imag * after.imag <= 0) & (before.imag != after.imag) & (row[1:] == row[:-1])[:, None]
    crosses &= (np.minimum(before.real, after.real) < 0) & (np.abs(before) > rounding)
    index, pair = np.nonzero(crosses)
    omega = np.stack([omega[index], omega[index + 1]], axis=1)
    all_crossings = Crossings(row[index], omega, np.stack([before[index, pair], after[index, pair]], axis=1))
    factor = all_crossings.factor
    return all_crossings.take((factor > 0) & (factor < np.inf))


def refined_crossings(functions, brackets, growth=0.0):
    """Locate to rounding where eigenvalues of loop gains cross the negative real axis.

    Further frequencies first divide each interval, so that each has one crossing only. The secant method follows. An
    interval in which no crossing is left is dropped: its ends had values of two different eigenvalues.

    Parameters
    ----------
    functions : sequence of callable
        The n loop gains, each divided by its gain: s, shape (f,) [rad/s] -> shape (f, k, k). [s]
    brackets : Crossings
        Pairs of frequencies with at least one apparent crossing between them.
    growth : float
        The loop gains are computed at s = (growth + i) w: 0 for the limit of stability, else along a line of constant
        damping ratio. [-]

    Returns
    -------
    Crossings
        Sorted by loop, and within each by the gain that makes the eigenvalue -1.
    """
    is_single = False
    for _ in range(CONTROL.crossing_zooms if len(brackets) else 0):
        low, high = brackets.omega.T
        omega = (low[:, None] + (high - low)[:, None] * np.linspace(0, 1, CONTROL.crossing_points)).ravel()
        bracket = np.repeat(np.arange(len(brackets)), CONTROL.crossing_points)
        values = eigenvalues(at_frequencies(functions, brackets.row[bracket], omega, growth))
        is_single = values.shape[-1] == 1
        within = crossings(bracket, omega, values)
        brackets = replace(within, row=brackets.row[within.row]).sorted()
        if not len(brackets):
            break
    return _by_secant(functions, brackets, is_single, growth).sorted() if len(brackets) else brackets


def _by_secant(functions, brackets, is_single, growth):
    """Locate crossings of the negative real axis by eigenvalues of loop gains to rounding, by the secant method.

    Of the k eigenvalues at a new frequency it takes the one nearest to the line through the last two values. Crossings
    where another eigenvalue was followed by mistake are left out, which cannot happen if k = 1.

    Parameters
    ----------
    functions : list of callable
        Loop gains over the gain: s, shape (f,) -> shape (f, k, k).
    brackets : Crossings
        Pairs of frequencies with one crossing between them, and the eigenvalues there.
    is_single : bool
        True if k = 1.
    growth : float
        Loop gains are computed at s = (growth + i) w, w being the frequency. [-]

    Returns
    -------
    Crossings
    """
    pairs, (low, high) = brackets, brackets.omega.T  # the last two points of each search
    last_step = np.maximum(CONTROL.secant_last_step * (high - low), CONTROL.secant_rounding * high)
    for _ in range(CONTROL.secant_steps):
        estimate = np.clip(pairs.frequency, low, high)
        step = estimate - pairs.omega[:, 1]
        unsettled = np.abs(step) > last_step
        if not unsettled.any():
            break
        expected = pairs.values[:, 1] + pairs.slope * step
        candidates = eigenvalues(at_frequencies(functions, brackets.row[unsettled], estimate[unsettled], growth))
        nearest = np.abs(candidates - expected[unsettled, None]).argmin(axis=1)
        eigenvalue = candidates[np.arange(len(candidates)), nearest]
        omega, values = pairs.omega.copy(), pairs.values.copy()
        omega[unsettled] = np.stack([pairs.omega[unsettled, 1], estimate[unsettled]], axis=1)
        values[unsettled] = np.stack([pairs.values[unsettled, 1], eigenvalue], axis=1)
        pairs = Crossings(brackets.row, omega, values)
    # with the slope of the bracket, which has the sign of the crossing: that of the last two values may be rounding
    omega, value, width = pairs.omega[:, 1], pairs.values[:, 1], high - low
    values = np.stack([value, value + brackets.slope * width], axis=1)
    located = Crossings(brackets.row, np.stack([omega, omega + width], axis=1), values)
    if is_single:  # near a narrow pole the rounding of the loop gain may be all that is left of its imaginary part
        return located
    rounding = 2 * last_step * np.abs(brackets.slope)
    return located.take(np.abs(value.imag) <= CONTROL.crossing_real * np.abs(value) + rounding)


def crossing_near(needed_gains, gain, begin, step, farthest, settled):
    """Find gain and frequency at which a pole crosses the imaginary axis, by a secant search for Im(-1/l) = 0.

    l is an eigenvalue of the loop gain divided by its gain. Im(-1/l) is about linear in frequency: few steps do. Of the
    k eigenvalues at a new frequency, the search follows the one whose -1/l is nearest to the line through the last two.

    Parameters
    ----------
    needed_gains : callable
        Frequency w [rad/s] -> -1/l of all k eigenvalues at s = i w, complex, shape (k,). A real one is the gain with
        which a pole crosses at w. [rad/s]
    gain : complex
        -1/l of the eigenvalue to follow, at the first frequency. [rad/s]
    begin, step : float
        First frequency, and distance from it to the second one. [rad/s]
    farthest : float
        Largest distance of the crossing from `begin`. [rad/s]
    settled : float
        The search ends at a step smaller than this, by which gain and frequency are extrapolated. [rad/s]

    Returns
    -------
    (float, float) or None
        Gain and frequency [rad/s]; None if no crossing was found.
    """
    omega, expected = begin + step, gain
    previous, previous_gain = begin, gain
    for _ in range(CONTROL.crossing_steps):
        candidates = needed_gains(omega)
        gain = candidates[np.argmin(np.abs(candidates - expected))]
        if gain.imag == previous_gain.imag:
            return None
        slope = (gain - previous_gain) / (omega - previous)
        change = gain.imag / slope.imag
        if abs(change) <= settled:
            return gain.real - change * slope.real, omega - change
        previous, previous_gain, omega, expected = omega, gain, omega - change, gain - change * slope
        if not abs(omega - begin) <= farthest:
            return None
    return None
