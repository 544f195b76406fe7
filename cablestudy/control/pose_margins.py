"""How far a loop of several winches is from instability: largest gain, margins, those of one loop alone, sensitivity.

A pole of the closed loop lies on the imaginary axis at i w for the gain -1/l where an eigenvalue l of the loop gain
L(i w) over the gain is real and negative. The candidates that a grid of frequencies shows are refined, and the
eigenvalues of the closed loop beside them decide.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control import margins
from cablestudy.control.margins import crossing_near, gain_of_peak, highest_of
from cablestudy.control.pose_frequencies import ASIDE, CLOSER, beside, by_parts, eigenvalues, paired, resolved
from cablestudy.control.pose_loop import growth_of
from cablestudy.errors import NoSolutionError

BESIDE = 0.03  # relative distance of the gains on either side of a candidate that eigenvalues judge
SIMILAR = 0.1  # relative distance of two frequencies up to which they belong to one crossing
NEAR = 0.5  # relative distance of an eigenvalue from -1 over a gain up to which it may cross near that gain
FIRST_STEP = 1e-6  # relative, of the search for a crossing near another one
SETTLED = 1e-12  # relative, of a frequency or gain that is found
HIGHEST = 1e3  # gain up to which the sensitivity of a loop without limit is looked at, over its highest pole
STEPS = 50  # of bisection, to rounding
POINTS, REFINEMENTS = 15, 4  # by which a crossing is refined, and how often


def grid(loop):
    """Frequencies at which the sensitivity of a loop is evaluated: all decades, and beside all poles. [rad/s]"""
    return beside(np.concatenate([loop.open_poles, loop.poles]), ASIDE, loop.law)


@dataclass(frozen=True)
class Limit:
    """Where a pole crosses the imaginary axis.

    Attributes
    ----------
    factor : float
        Of a gain; for all winches together the gain itself. [-], [rad/s]
    omega : float
        There the pole is. [rad/s]
    """

    factor: float
    omega: float


def largest_gain(loop):
    """`Limit` with the least gain at which the loop is unstable; None where there is none.

    Parameters
    ----------
    loop : PoseLoop

    Raises
    ------
    NoSolutionError
        The suspension is unstable with the winches at rest, or the delay is too long to judge the loop.
    """
    if growth_of(loop.open_poles) > 0:
        raise NoSolutionError("the suspension is unstable with its winches at rest")
    same = np.ones(len(loop.notches))
    at = crossings(loop.frequencies, loop.unit_eigenvalues)
    return limit(lambda gain: growth_of(loop.poles_with(gain * same)), _eigenvalues(loop), at)


def limit_near(loop, known):
    """The least `Limit` of a loop of all winches near that of a similar loop; None where it has none there."""
    omega = known.omega
    needed = -1 / eigenvalues(loop.exact_unit_gain(np.array([1j * omega])))[0]
    near = needed[np.abs(needed - known.factor) < NEAR * known.factor]
    span = FIRST_STEP * omega, SIMILAR * omega, SETTLED * omega
    found = [crossing_near(_followed(loop, one), omega, *span) for one in near]
    found = [Limit(*map(float, one)) for one in found if one and one[0] > 0]
    return min(found, key=lambda one: one.factor, default=None)


def _followed(loop, begin):
    """-1 over one eigenvalue of the loop gain over the gain, as a function of frequency [rad/s], from its first value.

    Of several that are alike it is the one nearest to the line through the last two.
    """
    known = []

    def needed_gain(omega):
        values = -1 / eigenvalues(loop.exact_unit_gain(np.array([1j * omega])))[0]
        expected = known[-1][1] if known else begin
        if len(known) > 1:
            (before, first), (last, second) = known[-2:]
            expected = second + (second - first) * (omega - last) / (last - before)
        known.append((omega, values[np.argmin(np.abs(values - expected))]))
        return known[-1][1]

    return needed_gain


def gain_crossovers(loop):
    """Where an eigenvalue of the loop gain has the size 1: frequencies [rad/s], and its angle from -1 [deg], each (c,).

    Notes
    -----
    A phase that is common to all eigenvalues, as that of a further delay, brings the loop to the limit of stability
    where it turns one of these eigenvalues to -1.
    """
    values = _eigenvalues(loop)

    def by_size(omega):
        found = loop.gain * values(omega)
        return np.take_along_axis(found, np.argsort(np.abs(found), axis=1), axis=1)

    omega = beside(np.concatenate([loop.open_poles, loop.poles]), CLOSER, loop.law)
    size = np.abs(by_size(omega)) - 1
    where, which = np.nonzero(size[:-1] * size[1:] < 0)
    if not len(where):
        return np.zeros(0), np.zeros(0)
    rows, below = np.arange(len(where)), np.sign(size[where, which])
    low, high = omega[where], omega[where + 1]
    for _ in range(STEPS):
        middle = (low + high) / 2
        same = np.sign(np.abs(by_size(middle)[rows, which]) - 1) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, np.degrees(np.angle(-by_size(low)[rows, which]))


def _eigenvalues(loop):
    """Eigenvalues of the loop gain over the gain, as a function of frequencies [rad/s], shape (f, k)."""
    return lambda omega: by_parts(lambda s: eigenvalues(loop.unit_gain(s)), omega)


def single_limits(loop):
    """By how much the gain of each measured coordinate alone may grow, shape (k,); infinite where by any factor. [-]

    Notes
    -----
    With the other loops closed the loop gain of coordinate j is 1/S_jj - 1, S = (I + L)^-1.
    """
    found, gains = [], np.full(len(loop.notches), loop.gain)
    omega = beside(np.concatenate([loop.open_poles, loop.poles]), CLOSER, loop.law)

    def alone(place):
        return lambda omega: (1 / by_parts(loop.sensitivity, omega)[:, place, place] - 1)[:, None]

    for place, own in enumerate(np.eye(len(gains), dtype=bool)):

        def growth(factor, own=own):
            return growth_of(loop.poles_with(np.where(own, factor, 1.0) * gains))

        values, known = alone(place), Limit(0.0, 0.0)
        if growth(0.0) <= 0:
            closer, matrices = resolved(lambda s, values=values: values(s.imag)[..., None], omega)
            known = limit(growth, values, crossings(closer, matrices[..., 0]))
        found.append(np.inf if known is None else known.factor)
    return np.array(found)


def limit(growth, values, at):
    """`Limit` with the least factor above which a loop has a growing pole, or None.

    Parameters
    ----------
    growth : callable
        Factor of the gain -> `growth_of` the poles; not above 0 at the factor 0.
    values : callable
        Frequencies [rad/s] -> eigenvalues of the loop gain at factor 1, shape (f, k).
    at : list of Crossing
        Of these.
    """
    from scipy.optimize import brentq

    for crossing in at:
        found = refined(values, crossing)
        low = (1 - BESIDE) * found.factor
        if growth((1 + BESIDE) * found.factor) > 0:
            return found if growth(low) <= 0 else Limit(brentq(growth, 0.0, low, rtol=SETTLED), found.omega)
    return None


@dataclass(frozen=True)
class Crossing:
    """Two frequencies between which an eigenvalue of the loop gain crosses the negative real axis.

    Attributes
    ----------
    omega : tuple of 2 float
        [rad/s]
    values : tuple of 2 complex
        The eigenvalue there.
    """

    omega: tuple
    values: tuple

    def at(self, omega):
        """The eigenvalue at a frequency, interpolated."""
        (low, high), (before, after) = self.omega, self.values
        return before + (after - before) * (omega - low) / (high - low)

    @property
    def place(self):
        """Frequency of the crossing, interpolated. [rad/s]"""
        (low, high), (before, after) = self.omega, self.values
        change = before.imag - after.imag
        return low + (high - low) * (before.imag / change if change else 0.0)


def crossings(omega, values):
    """The `Crossing` of each eigenvalue of the loop gain over the negative real axis, by ascending factor: list.

    Parameters
    ----------
    omega : ndarray, shape (f,)
        [rad/s]
    values : ndarray, shape (f, k)
        Not a number where the loop gain is infinite.
    """
    finite = np.isfinite(values).all(axis=1)
    omega, values = omega[finite], values[finite]
    before, after = paired(values)
    crosses = np.argwhere((before.imag * after.imag <= 0) & (np.minimum(before.real, after.real) < 0))
    found = [Crossing((omega[i], omega[i + 1]), (before[i, j], after[i, j])) for i, j in crosses.tolist()]
    return sorted((one for one in found if one.at(one.place).real < 0), key=lambda one: one.at(one.place).real)


def refined(values, crossing):
    """The `Limit` of least factor at a `Crossing`, or at others between its frequencies; `values` as for `limit`."""
    for _ in range(REFINEMENTS):
        omega = np.linspace(*crossing.omega, POINTS)
        found = crossings(omega, values(omega))
        if not found:
            break
        crossing = found[0]
    return Limit(-1 / crossing.at(crossing.place).real, crossing.place)


def sensitivity_peak(loop):
    """Largest singular value of (I + L)^-1 over all frequencies. [-]"""

    def size(omega):
        return np.linalg.norm(by_parts(loop.sensitivity, omega), ord=2, axis=(-2, -1))

    return highest_of(size, grid(loop))[0]


def sensitive_gain(loop, peak, most):
    """The largest gain up to `most` with which the peak of the sensitivity is at most a value. [rad/s]

    Parameters
    ----------
    loop : PoseLoop
    peak : float
        Above 1. [-]
    most : float or None
        Up to which the loop is stable; None where it always is. [rad/s]

    Returns
    -------
    float or None
        None where every gain has a lower peak.
    """
    gain, omega, reached = most or HIGHEST * np.abs(loop.open_poles).max(), loop.frequencies, False
    for _ in range(2):  # beside the poles without the loop, then beside those with that gain
        gain, found = gain_of_peak(lambda s: by_parts(loop.unit_gain, s.imag), omega, peak, gain)
        omega, reached = np.union1d(omega, grid(loop.with_gain(gain))), reached or found is not None
    return gain if most or reached else None


class Margins:
    """Numbers of a stable `PoseLoop` that say how far it is from instability, beside its largest gain."""

    def __init__(self, loop):
        self._loop = loop

    @cached_property
    def _crossovers(self):
        """See `gain_crossovers`."""
        return gain_crossovers(self._loop)

    @cached_property
    def sensitivity_peak(self):
        """Largest singular value of the sensitivity at the measured coordinates. [-]"""
        return sensitivity_peak(self._loop)

    @property
    def phase_margin(self):
        """Least angle between -1 and an eigenvalue of the loop gain of size 1; None where there is none. [deg]"""
        return margins.phase_margin(self._crossovers[1])

    @property
    def gain_crossover(self):
        """Frequency of the phase margin; None where there is none. [Hz]"""
        return margins.phase_margin_frequency(*self._crossovers)

    @property
    def delay_margin(self):
        """Least further delay that makes the loop unstable; None where no eigenvalue of the loop gain is 1. [s]"""
        return margins.delay_margin(*self._crossovers)
