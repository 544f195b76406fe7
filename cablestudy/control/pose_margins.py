"""How far a loop of several winches is from instability: largest gain, margins of one loop alone, sensitivity.

A pole of the closed loop lies on the imaginary axis at i w for the gain -1/l where an eigenvalue l of the loop gain
L(i w) over the gain is real and negative. The candidates that a grid of frequencies shows are refined, and the
eigenvalues of the closed loop beside them decide.
"""

import numpy as np
from scipy.optimize import brentq

from cablestudy.control.pose_loop import growth_of, growths
from cablestudy.errors import NoSolutionError

PER_DECADE = 30
ASIDE = np.array([1.0, 3.0])  # frequencies beside a pole, in its half-widths
UNDAMPED = 1e-9  # damping ratio below which the loop gain at a pole is infinite
NARROWEST = 1e-6  # half-width that is taken at least, over the frequency
RANGE = 1e-3, 30.0  # frequencies that are looked at, over the least and largest of the poles
BESIDE = 0.03  # relative distance of the gains on either side of a candidate that eigenvalues judge
AT_ONCE = 100  # frequencies
SETTLED = 1e-9  # relative width of the bracket of a gain that is found
STEP = 1e-4  # relative, of the gain, between two poles whose difference is a derivative
REFINEMENTS = 4  # of the frequency of the largest sensitivity


def grid(loop):
    """Frequencies at which a loop is evaluated: all decades, and beside its poles. [rad/s]"""
    poles = np.concatenate([loop.open_poles, loop.poles])
    poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max(initial=0.0)]
    poles = poles[poles.imag >= 0]
    centre, width = np.abs(poles), np.abs(poles.real)
    low, high = RANGE[0] * centre.min(), RANGE[1] * centre.max()
    decades = np.geomspace(low, high, 2 + int(PER_DECADE * np.log10(high / low)))
    steps = np.clip(width, NARROWEST * centre, 0.2 * centre)[:, None] * np.concatenate([-ASIDE, ASIDE])
    return np.unique(np.concatenate([decades, centre[width > UNDAMPED * centre], (centre[:, None] + steps).ravel()]))


def largest_gain(loop, near=None):
    """The least gain at which the loop is unstable; None where there is none.

    Parameters
    ----------
    loop : PoseLoop
    near : float, optional
        About where it is, when that is known. [rad/s]

    Returns
    -------
    float or None
        [rad/s]

    Raises
    ------
    NoSolutionError
        The suspension is unstable with the winches at rest.
    """
    fixed, scaled = loop.matrices
    known = [] if near is None else [near]
    candidates = known or _candidates(_by_parts(lambda s: np.linalg.eigvals(loop.unit_gain(s)), grid(loop)))
    found = limit(fixed, scaled.sum(axis=0), candidates)
    if found == 0:
        raise NoSolutionError("the suspension is unstable with its winches at rest")
    return found


def single_limits(loop):
    """By how much the gain of each measured coordinate alone may grow, shape (k,); infinite where by any factor. [-]

    Notes
    -----
    With the other loops closed the loop gain of coordinate j is 1/S_jj - 1, S = (I + L)^-1.
    """
    (fixed, scaled), found = loop.matrices, []
    sensitivity = _by_parts(loop.sensitivity, grid(loop))
    for place, own in enumerate(scaled):
        candidates = _candidates((1 / sensitivity[:, place, place] - 1)[:, None])
        others = fixed + loop.gain * (scaled.sum(axis=0) - own)
        factor = limit(others, loop.gain * own, candidates)
        found.append(np.inf if factor is None else factor)
    return np.array(found)


def limit(fixed, scaled, candidates):
    """The least factor above which fixed + factor scaled has a growing eigenvalue; None where there is none, 0 where
    `fixed` has one.

    Parameters
    ----------
    fixed, scaled : ndarray, shape (N, N)
    candidates : list of float
        Ascending.
    """

    def poles(factor):
        return np.linalg.eigvals(fixed + factor * scaled)

    def growth(factor):
        return growth_of(poles(factor))

    if growth(0.0) > 0:
        return 0.0
    for factor in candidates:
        low, high = (1 - BESIDE) * factor, (1 + BESIDE) * factor
        if growth(high) > 0:
            low, high = (low, high) if growth(low) <= 0 else (0.0, low)
            return _crossing(poles, brentq(growth, low, high, xtol=SETTLED * high, rtol=SETTLED))
    return None


def _crossing(poles, factor):
    """The factor at which a pole is on the imaginary axis, from one at which it begins to count as growing.

    Parameters
    ----------
    poles : callable
        Factor -> eigenvalues.
    factor : float
    """
    found, beside = poles(factor), poles((1 - STEP) * factor)
    crossing = found[np.argmax(growths(found))]
    slope = (crossing - beside[np.argmin(np.abs(beside - crossing))]).real / (STEP * factor)
    change = crossing.real / slope if slope > 0 else 0.0
    return factor - change if abs(change) < BESIDE * factor else factor


def _candidates(values):
    """Factors at which an eigenvalue of the loop gain crosses the negative real axis, ascending.

    Parameters
    ----------
    values : ndarray, shape (f, k)
        Not a number where the loop gain is infinite.
    """
    values = values[np.isfinite(values).all(axis=1)]
    first, second = values[:-1, :, None], values[1:, None, :]
    nearest = np.abs(first - second).argmin(axis=2)
    after, before = np.take_along_axis(values[1:], nearest, axis=1), values[:-1]
    crosses = (before.imag * after.imag <= 0) & (np.minimum(before.real, after.real) < 0)
    before, after = before[crosses], after[crosses]
    share = before.imag / np.where(before.imag != after.imag, before.imag - after.imag, 1.0)
    real = before.real + share * (after.real - before.real)
    return np.sort(-1 / real[real < 0]).tolist()


def _by_parts(function, omega):
    """A function of s at many frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    return np.concatenate([function(1j * omega[i : i + AT_ONCE]) for i in range(0, len(omega), AT_ONCE)])


def sensitivity_peak(loop):
    """Largest singular value of (I + L)^-1 over all frequencies. [-]"""
    omega = grid(loop)
    for _ in range(REFINEMENTS):
        value = np.linalg.norm(_by_parts(loop.sensitivity, omega), ord=2, axis=(-2, -1))
        place = int(np.argmax(value))
        low, high = omega[max(place - 1, 0)], omega[min(place + 1, len(omega) - 1)]
        omega = np.linspace(low, high, 41)
    return float(value.max())
