"""How far a loop of several winches is from instability: largest gain, margins of one loop alone, sensitivity.

A pole of the closed loop lies on the imaginary axis at i w for the gain -1/l where an eigenvalue l of the loop gain
L(i w) over the gain is real and negative. The candidates that a grid of frequencies shows are refined, and the
eigenvalues of the closed loop beside them decide.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.pose_loop import growth_of
from cablestudy.errors import NoSolutionError

PER_DECADE = 30
ASIDE = np.array([1.0, 3.0])  # frequencies beside a pole, in its half-widths, for the sensitivity
CLOSER = np.array([0.3, 0.7, 1.2, 2.0, 3.0, 5.0])  # and for eigenvalues of the loop gain, which must be told apart
UNDAMPED = 1e-9  # damping ratio below which the loop gain at a pole is infinite
NARROWEST = 1e-6  # half-width that is taken at least, over the frequency
RANGE = 1e-3, 30.0  # frequencies that are looked at, over the least and largest of the poles
BESIDE = 0.03  # relative distance of the gains on either side of a candidate that eigenvalues judge
AT_ONCE = 100  # frequencies
SIMILAR = 0.1  # logarithm of the ratio of two frequencies up to which they belong to one crossing
SETTLED = 1e-12  # relative, of a frequency or gain that is found
PEAKS = 4  # of the sensitivity: the highest on the grid
POINTS, REFINEMENTS = 15, 4  # by which a peak or crossing is refined, and how often


def grid(loop):
    """Frequencies at which the sensitivity of a loop is evaluated: all decades, and beside all poles. [rad/s]"""
    return _beside(np.concatenate([loop.open_poles, loop.poles]), ASIDE)


def _beside(poles, distances):
    """Frequencies of all decades, at poles, and at some distances from them in their half-widths. [rad/s]"""
    poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max(initial=0.0)]
    poles = poles[poles.imag >= 0]
    centre, width = np.abs(poles), np.abs(poles.real)
    low, high = RANGE[0] * centre.min(), RANGE[1] * centre.max()
    decades = np.geomspace(low, high, 2 + int(PER_DECADE * np.log10(high / low)))
    steps = np.clip(width, NARROWEST * centre, 0.2 * centre)[:, None] * np.concatenate([-distances, distances])
    points = np.concatenate([decades, centre[width > UNDAMPED * centre], (centre[:, None] + steps).ravel()])
    return np.unique(points[points > 0])


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
        The suspension is unstable with the winches at rest.
    """
    if growth_of(loop.open_poles) > 0:
        raise NoSolutionError("the suspension is unstable with its winches at rest")
    fixed, scaled = loop.matrices
    return limit(fixed, scaled.sum(axis=0), _eigenvalues(loop), _beside(loop.open_poles, CLOSER))


def gain_beside(loop, known):
    """The gain at which a similar loop has the crossing nearest to a known `Limit`; None where it has none. [rad/s]"""
    omega = _beside(loop.open_poles, CLOSER)
    omega = omega[np.abs(np.log(omega / known.omega)) < SIMILAR]
    values = _eigenvalues(loop)
    found = [refined(values, one).factor for one in crossings(omega, values(omega))]
    return min(found, key=lambda gain: abs(gain - known.factor), default=None)


def _eigenvalues(loop):
    """Eigenvalues of the loop gain over the gain, as a function of frequencies [rad/s], shape (f, k)."""
    return lambda omega: _by_parts(lambda s: _finite_eigenvalues(loop.unit_gain(s)), omega)


def _finite_eigenvalues(matrices):
    """Not a number where the matrix is not finite, shape (f, k)."""
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-1], np.nan, dtype=complex)
    found[finite] = np.linalg.eigvals(matrices[finite])
    return found


def single_limits(loop):
    """By how much the gain of each measured coordinate alone may grow, shape (k,); infinite where by any factor. [-]

    Notes
    -----
    With the other loops closed the loop gain of coordinate j is 1/S_jj - 1, S = (I + L)^-1.
    """
    (fixed, scaled), found = loop.matrices, []
    omega = _beside(np.concatenate([loop.open_poles, loop.poles]), CLOSER)

    def alone(place):
        return lambda omega: (1 / _by_parts(loop.sensitivity, omega)[:, place, place] - 1)[:, None]

    for place, own in enumerate(scaled):
        others = fixed + loop.gain * (scaled.sum(axis=0) - own)
        stable = growth_of(np.linalg.eigvals(others)) <= 0
        known = limit(others, loop.gain * own, alone(place), omega) if stable else Limit(0.0, 0.0)
        found.append(np.inf if known is None else known.factor)
    return np.array(found)


def limit(fixed, scaled, values, omega):
    """`Limit` with the least factor above which fixed + factor scaled has a growing eigenvalue, or None.

    Parameters
    ----------
    fixed, scaled : ndarray, shape (N, N)
        `fixed` has no growing eigenvalue.
    values : callable
        Frequencies [rad/s] -> eigenvalues of the loop gain at factor 1, shape (f, k).
    omega : ndarray
        Ascending. [rad/s]
    """
    from scipy.optimize import brentq

    def growth(factor):
        return growth_of(np.linalg.eigvals(fixed + factor * scaled))

    for crossing in crossings(omega, values(omega)):
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
    # each eigenvalue with the nearest one at the next frequency, and each of these with the nearest one before
    apart = np.abs(values[:-1, :, None] - values[1:, None, :])
    before = np.concatenate([values[:-1], np.take_along_axis(values[:-1], apart.argmin(axis=1), axis=1)], axis=1)
    after = np.concatenate([np.take_along_axis(values[1:], apart.argmin(axis=2), axis=1), values[1:]], axis=1)
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


def _by_parts(function, omega):
    """A function of s at many frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    return np.concatenate([function(1j * omega[i : i + AT_ONCE]) for i in range(0, len(omega), AT_ONCE)])


def sensitivity_peak(loop):
    """Largest singular value of (I + L)^-1 over all frequencies. [-]"""

    def size(omega):
        value = np.linalg.norm(_by_parts(loop.sensitivity, omega.ravel()), ord=2, axis=(-2, -1))
        return value.reshape(omega.shape)

    omega = grid(loop)
    value = size(omega)
    higher = np.diff(value, prepend=-np.inf, append=-np.inf)
    tops = np.flatnonzero((higher[:-1] >= 0) & (higher[1:] <= 0))
    tops = tops[np.argsort(value[tops])[-PEAKS:]]
    low, high = omega[np.maximum(tops - 1, 0)], omega[np.minimum(tops + 1, len(omega) - 1)]
    for _ in range(REFINEMENTS):
        omega = np.linspace(low, high, POINTS, axis=1)
        value = size(omega)
        place, rows = value.argmax(axis=1), np.arange(len(tops))
        low, high = omega[rows, np.maximum(place - 1, 0)], omega[rows, np.minimum(place + 1, POINTS - 1)]
    return float(value.max())
