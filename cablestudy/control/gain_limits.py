"""Gains up to which a loop of several winches is stable, and with which the peak of its sensitivity is bounded.

Of a loop that is stable without gain the least gain at which a pole crosses to the right (`margins_crossings`) is the
largest stable one. Eigenvalues of the closed loop on either side of it confirm that no crossing is missing.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.margins import gain_of_peak, sensitivity
from cablestudy.control.margins_crossings import crossing_near, crossings, refined
from cablestudy.control.margins_grid import by_parts, curve, eigenvalues
from cablestudy.control.pose_loop import growth_of
from cablestudy.errors import NoSolutionError

ASIDE = 0.03  # relative distance of the gains on either side of a crossing that eigenvalues judge
TOGETHER = 2.0  # factors up to so many times the least one are refined at once
SIMILAR = 0.1  # relative distance of two frequencies up to which they belong to one crossing
NEAR = 0.5  # relative distance of an eigenvalue from -1 over a gain up to which it may cross near that gain
FIRST_STEP = 1e-6  # relative, of the search for a crossing near another one
SETTLED = 1e-12  # relative, of a frequency or gain that is found
HIGHEST = 1e3  # gain up to which the sensitivity of a loop without limit is looked at, over its highest pole


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
    omega, _, values = loop.curve
    return limit(lambda gain: growth_of(loop.poles_with(gain * same)), loop.unit_gain, omega, values)


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


def single_limits(loop):
    """By how much the gain of each measured coordinate alone may grow, shape (k,); infinite where by any factor. [-]

    Notes
    -----
    With the other loops closed the loop gain of coordinate j is 1/S_jj - 1, S = (I + L)^-1.
    """
    found, gains = [], np.full(len(loop.notches), loop.gain)
    omega = loop.response_frequencies

    def others(s):
        return 1 / sensitivity(loop.gain * loop.unit_gain(s)) - 1

    known = by_parts(others, omega)
    for place, own in enumerate(np.eye(len(gains), dtype=bool)):

        def growth(factor, own=own):
            return growth_of(loop.poles_with(np.where(own, factor, 1.0) * gains))

        def alone(s, place=place):
            return others(s)[:, place : place + 1, place : place + 1]

        if growth(0.0) > 0:
            found.append(0.0)
            continue
        closer, _, values = curve(alone, omega, known[:, place : place + 1, place : place + 1], loop.law.judged_up_to)
        one = limit(growth, alone, closer, values)
        found.append(np.inf if one is None else one.factor)
    return np.array(found)


def limit(growth, function, omega, values):
    """`Limit` with the least factor above which a loop has a growing pole, or None.

    Parameters
    ----------
    growth : callable
        Factor of the gain -> `growth_of` the poles; not above 0 at the factor 0.
    function : callable
        The loop gain at factor 1: s, shape (f,) -> shape (f, k, k).
    omega : ndarray, shape (f,)
        Frequencies that show its crossings. [rad/s]
    values : ndarray, shape (f, k)
        Eigenvalues of the loop gain there.
    """
    from scipy.optimize import brentq

    rest = crossings(omega[None], values[None]).sorted()
    below = 0.0
    while len(rest):
        near = rest.factor <= TOGETHER * rest.factor[0]
        found, rest = refined(function, rest.take(near)), rest.take(~near)
        back = np.append(found.factor[~found.outward], rest.factor[~rest.outward])
        for factor, place in zip(found.factor[found.outward], found.place[found.outward], strict=True):
            returns = back[back > factor].min(initial=np.inf)
            if growth(min((1 + ASIDE) * factor, np.sqrt(factor * returns))) <= 0:
                below = factor
                continue
            low = max((1 - ASIDE) * factor, np.sqrt(max(below, back[back < factor].max(initial=0.0)) * factor))
            if growth(low) > 0:
                return Limit(float(brentq(growth, 0.0, low, rtol=SETTLED)), float(place))
            return Limit(float(factor), float(place))
    return None


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
        omega = np.union1d(omega, loop.with_gain(gain).response_frequencies)
        reached = reached or found is not None
    return gain if most or reached else None
