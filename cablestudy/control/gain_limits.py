"""Gains with which a loop of several winches is stable, and with which the peak of its sensitivity is bounded.

Of a loop that is stable without gain, a pole crosses to the right or to the left at each gain at which an eigenvalue of
the loop gain L is -1 at some frequency (`margins_crossings`): with any gain as many poles are to the right as have
crossed to the right more often than to the left, and the least gain of a crossing to the right is the largest stable
one. So stability follows from the curve of L over frequency alone, with all modes that L has.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.margins import Margins, gain_of_peak, sensitivity
from cablestudy.control.margins_crossings import crossing_near, crossings, refined
from cablestudy.control.margins_grid import (
    by_parts,
    curve,
    curve_beside,
    distinct,
    eigenvalues,
    frequencies,
    near_poles,
    with_more,
)
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError

ASIDE = np.geomspace(0.05, 1e4, 80)  # distances from such a mode, over its width, at which its growth is looked for


@dataclass(frozen=True)
class Limit:
    """Where a pole crosses the imaginary axis.

    Attributes
    ----------
    factor : float
        Of a gain; for all winches together the gain itself. [-], [rad/s]
    omega : float
        Frequency of the pole there. [rad/s]
    rate : float
        Its growth over frequency per relative change of the gain: about the damping ratio of a mode without control
        that the gain takes away. [-]
    """

    factor: float
    omega: float
    rate: float = 1.0

    @property
    def undamped(self):
        """True if that mode is as good as undamped."""
        return self.rate < CONTROL.undamped

    def of(self, loop_gain):
        """`Limit` of this crossing in a similar loop gain.

        That of a mode as good as undamped is where it grows by `negligible_growth`; its factor is infinite if it never
        does.
        """
        if not self.undamped:
            found = limit_near(loop_gain, self)
            return replace(found, rate=self.rate) if found else self

        def damped(s):
            return loop_gain(s + CONTROL.negligible_growth * np.abs(s))

        step = max(self.rate, CONTROL.negligible_growth) * self.omega * ASIDE
        omega = self.omega + np.concatenate([-step[::-1], [0.0], step])
        found = crossings(omega[None], eigenvalues(by_parts(damped, omega))[None])
        found = refined(damped, found.take(found.outward))
        return replace(self, factor=float(found.factor.min(initial=np.inf)) if len(found) else np.inf)


class StableGains:
    """The loop gain over frequency, and what follows for the gain.

    Parameters
    ----------
    loop_gain : callable
        L over the gain: s, shape (f,) -> shape (f, k, k).
    poles : ndarray
        Without control, all stable: those beside which L changes. [rad/s]
    notches : tuple of (Notch or None)
    law : Law
    most : float
        Gain up to which stability is judged, or up to the smallest at which a pole crosses if that is larger. [rad/s]
    """

    def __init__(self, loop_gain, poles, notches, law, most=np.inf):
        self.loop_gain, self.law, self.poles, self._most = loop_gain, law, poles, most
        self._first = frequencies(self.poles, notches, law)

    @cached_property
    def curve(self):
        """Frequencies that show where eigenvalues of L cross the negative real axis, and L over the gain there.

        Returns
        -------
        omega : ndarray, shape (f,)
            [rad/s]
        matrices : ndarray, shape (f, k, k)
        values : ndarray, shape (f, k)
            Eigenvalues of these.
        """
        return curve(self.loop_gain, self._first, upto=self.law.judged_up_to, most=self._most)

    @cached_property
    def _crossings(self):
        omega, _, values = self.curve
        found = crossings(omega[None], values[None])
        return found.take(found.factor < CONTROL.highest_judged_gain * np.abs(self.poles).min(initial=np.inf)).sorted()

    @property
    def limit(self):
        """`Limit` of the smallest gain at which a pole crosses to the right; None where none does."""
        return self.limits[0] if self.limits else None

    @cached_property
    def limits(self):
        """`Limit` of gains at which poles cross to the right, the smallest ones: list, ascending.

        Notes
        -----
        With l the eigenvalue of L, 1 + g l(s) = 0, so that the pole moves by 1/(g dl/ds) per relative change of g. One
        of a mode as good as undamped is called unstable only from the gain on with which it grows by
        `negligible_growth`.
        """
        rest, found = self._crossings, []
        while len(rest) and (not found or rest.factor[0] < found[0].factor):
            near, rest = _least(self.loop_gain, rest)
            found += [one for one, outward in self._described(near) if outward and one.factor < np.inf]
            found.sort(key=lambda one: one.factor)
        return found

    def _described(self, crossings):
        """Each of some crossings as a `Limit`, and whether the pole crosses to the right: list of pairs."""
        rate = np.abs((1j / (crossings.factor * crossings.slope)).real) / crossings.place
        numbers = np.stack([crossings.factor, crossings.place, rate], axis=1).tolist()
        limits = [(Limit(*row), outward) for row, outward in zip(numbers, crossings.outward.tolist(), strict=True)]
        return [
            (limit.of(self.loop_gain) if outward and limit.undamped else limit, outward) for limit, outward in limits
        ]

    def open_ratio(self, omega):
        """Damping ratio without control of the mode whose pole is nearest to a frequency. [-]"""
        if not len(self.poles):
            return 1.0
        pole = self.poles[np.argmin(np.abs(self.poles - 1j * omega))]
        return float(max(-pole.real / abs(pole), 0.0))

    def unstable(self, gain):
        """Number of poles in the right half plane of the loop with a gain [rad/s], two for a conjugate pair.

        Raises
        ------
        NoSolutionError
            The delay is too long to judge the loop.
        """
        self.check_delay(gain)
        candidates = self._crossings.take(self._crossings.factor < CONTROL.refined_together * gain)
        count = 0
        for limit, outward in self._described(refined(self.loop_gain, candidates)) if len(candidates) else ():
            if limit.factor < gain:
                count += 2 if outward else -2
        return max(count, 0)

    def check_delay(self, gain):
        """Refuse a gain [rad/s] with which a delay is too long to judge the loop; see `Law.check_reach`."""
        if self.law.delay and gain:
            self.law.check_reach(self.large_up_to(CONTROL.harmless_delayed_gain / gain), gain)

    @cached_property
    def _largest(self):
        """Size of the largest eigenvalue of L over the gain at the frequencies of the curve, shape (f,). [s]"""
        return np.nan_to_num(np.abs(self.curve[2])).max(axis=1)

    def large_up_to(self, size):
        """Frequency above which no eigenvalue of L over the gain is larger than a size [s]. [rad/s]"""
        return float(self.curve[0][self._largest >= size].max(initial=0.0))

    def largest_beyond(self, omega):
        """Size of the largest eigenvalue of L over the gain above a frequency [rad/s]. [s]"""
        return float(self._largest[self.curve[0] > omega].max(initial=0.0))

    def frequencies(self, gain):
        """Those of the curve, and beside the poles of the loop with a gain [rad/s], ascending, shape (f,). [rad/s]"""
        return self._close(gain)[0]

    def _close(self, gain):
        """`frequencies`, and L over the gain there, shape (f, k, k)."""
        omega, matrices, values = self.curve
        if not gain:
            return omega, matrices
        near = self._crossings
        near = near.take(
            (near.factor < CONTROL.closed_poles_gain * gain) & (gain < CONTROL.closed_poles_gain * near.factor)
        )
        poles = 1j * near.place + 1j / (near.factor * near.slope) * (gain / near.factor - 1)
        added = near_poles(np.append(poles, [-gain, -min(gain / 2, omega[0])]))  # a small gain is below all of them
        omega, matrices = curve_beside(self.loop_gain, gain, omega, matrices, values)
        return with_more(self.loop_gain, omega, matrices, added[added < omega[-1]])

    def margins(self, gain):
        """`Margins` of the loop with a gain. [rad/s]"""
        omega, matrices = self._close(gain)
        return Margins(lambda s: gain * self.loop_gain(s), omega, self._check_peak, gain * matrices)

    def _check_peak(self, omega):
        """Refuse a peak of the sensitivity [rad/s] of a mode as good as undamped: NoSolutionError."""
        pole = self.poles[np.argmin(np.abs(self.poles - 1j * omega))] if len(self.poles) else np.inf
        if (
            abs(pole - 1j * omega) < CONTROL.peak_at_pole * omega
            and (ratio := self.open_ratio(omega)) < CONTROL.undamped
        ):
            raise undamped(pole, ratio, "no peak of the sensitivity: ")

    def gain_of_peak(self, peak, most):
        """The largest stable gain with which the peak of the sensitivity is at most a value. [rad/s]

        Parameters
        ----------
        peak : float
            Above 1. [-]
        most : float or None
            Gain up to which the loop is stable; None where it is stable with any gain. [rad/s]

        Returns
        -------
        float or None
            None where every gain has a lower peak.
        """
        gain, omega = most or CONTROL.highest_sensitive_gain * np.abs(self.poles).max(), self.curve[0]
        reached = False  # by the peak, with the first gain
        for _ in range(2):  # on frequencies near the poles of the open loop, then also near those of the closed one
            gain, frequency_of_peak = gain_of_peak(self.loop_gain, omega, peak, gain)
            omega = distinct(np.append(omega, self.frequencies(gain)))
            reached = reached or frequency_of_peak is not None
        return gain if most or reached else None

    def single_limits(self, gain):
        """By how much the gain of each measured coordinate alone may grow, shape (k,); infinite where by any factor.

        [-]

        Parameters
        ----------
        gain : float
            With which the loop is stable. [rad/s]

        Returns
        -------
        ndarray
            0 where the loop is unstable without this coordinate.

        Notes
        -----
        With the other loops closed the loop gain of coordinate j is 1/S_jj - 1, S = (I + L)^-1.
        """
        (omega, matrices), found = self._close(gain), []

        known = sensitivity(gain * matrices)
        for own in range(known.shape[-1]):
            place = np.s_[:, own : own + 1, own : own + 1]

            def alone(s, place=place):
                return 1 / sensitivity(gain * self.loop_gain(s))[place] - 1

            closer, _, values = curve(alone, omega, 1 / known[place] - 1, self.law.judged_up_to)
            found.append(_growth_allowed(alone, crossings(closer[None], values[None]).sorted()))
        return np.array(found)


def _growth_allowed(function, rest):
    """Factor above 1 at which a pole first crosses to the right; 0 where one is there without this gain."""
    net = 0
    while len(rest):
        found, rest = _least(function, rest)
        if len(found):
            net += np.where(found.outward, 1, -1)[found.factor < 1].sum()
            above = found.factor[found.outward & (found.factor > 1)]
            if len(above):
                return float(above.min()) if net >= 0 else 0.0
    return np.inf if net >= 0 else 0.0


def _least(function, rest):
    """Of some `Crossings` that are sorted those with the least factors, to rounding, and the rest."""
    near = rest.factor <= CONTROL.refined_together * rest.factor[0]
    found = refined(function, rest.take(near))
    return found if len(found) else rest.take(slice(0)), rest.take(~near)


def limit_near(loop_gain, known):
    """The least `Limit` of a loop gain near that of a similar one; None where it has none there.

    Parameters
    ----------
    loop_gain : callable
        As for `StableGains`.
    known : Limit
    """
    omega = known.omega
    needed = -1 / eigenvalues(loop_gain(np.array([1j * omega])))[0]
    near = needed[np.abs(needed - known.factor) < CONTROL.may_cross_within * known.factor]
    span = (
        min(CONTROL.first_crossing_step, known.rate) * omega,
        CONTROL.one_crossing * omega,
        CONTROL.crossing_frequency * omega,
    )
    found = [crossing_near(_followed(loop_gain, one), omega, *span) for one in near]
    found = [Limit(*map(float, one)) for one in found if one and one[0] > 0]
    return min(found, key=lambda one: one.factor, default=None)


def _followed(loop_gain, begin):
    """-1 over one eigenvalue of the loop gain over the gain, as a function of frequency [rad/s], from its first value.

    Of several that are alike it is the one nearest to the line through the last two.
    """
    known = []

    def needed_gain(omega):
        values = -1 / eigenvalues(loop_gain(np.array([1j * omega])))[0]
        expected = known[-1][1] if known else begin
        if len(known) > 1:
            (before, first), (last, second) = known[-2:]
            expected = second + (second - first) * (omega - last) / (last - before)
        known.append((omega, values[np.argmin(np.abs(values - expected))]))
        return known[-1][1]

    return needed_gain


def undamped(pole, ratio, begin=""):
    """The error for a loop whose stability depends on a mode as good as undamped, the message beginning with a text."""
    return NoSolutionError(
        f"{begin}the loop drives a mode of {abs(pole.imag) / (2 * np.pi):.4g} Hz, whose damping ratio is "
        f"{ratio:.1e}: damped strain leaves it as good as undamped (below {CONTROL.undamped:g}); "
        f"give cable.damping.viscous"
    )


def too_many(gains, count, omega):
    """The error for a gain, in words, that could drive too many modes."""
    return NoSolutionError(
        f"{gains} could drive about {count} modes of the cable, up to {omega / (2 * np.pi):.4g} Hz, "
        f"more than are resolved ({CONTROL.driven_modes}): "
        f"cable.damping.viscous or a lower roll-off of the notch bounds them"
    )
