"""Gains with which a loop of several winches is stable, and with which the peak of its sensitivity is bounded.

Of a loop that is stable without gain, a pole crosses the imaginary axis to the right or to the left at each gain at
which an eigenvalue of the loop gain L is -1 at some frequency (`margins_crossings`). The number of unstable pairs of
poles with a gain is that of the crossings to the right at smaller gains, less that of the crossings to the left; the
least gain of a crossing to the right is the largest stable one. So stability follows from the curve of L over frequency
alone, with all modes that L has.
"""

from functools import cached_property
from operator import attrgetter

import numpy as np

from cablestudy.control.curves import refined_for_sensitivity, sample_curves
from cablestudy.control.gain_limits import destabilising_limits, gain_of_one, growth_allowed, limits_at, undamped
from cablestudy.control.margins import Margins, gain_of_peak, largest, sensitivity
from cablestudy.control.margins_crossings import crossings, refined_crossings
from cablestudy.control.margins_grid import distinct, frequencies, near_poles
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.together import batches, computed_together


class StableGains:
    """Gains with which a loop is stable, its margins and limits, from its loop gain over frequency.

    Parameters
    ----------
    loop_gain : callable
        L over the gain: s, shape (f,) -> shape (f, k, k).
    poles : ndarray
        Poles without control, all stable: L changes fast near them. [rad/s]
    notches : tuple of (Notch or None)
    law : Law
    most : float
        Gain up to which stability is judged, or up to the smallest at which a pole crosses if that is larger. [rad/s]
    """

    def __init__(self, loop_gain, poles, notches, law, most=np.inf):
        self.loop_gain, self.law, self.poles, self.most = loop_gain, law, poles, most
        self.measured, self.first_frequencies = len(notches), frequencies(self.poles, notches, law)

    @computed_together
    def curve(loops):
        """`LoopGainCurves` of this loop: frequencies that show where eigenvalues cross the negative real axis."""
        for members in batches(loops, attrgetter("_signature"), attrgetter("measured")):
            yield from zip(members, _curves_of(members), strict=True)

    @computed_together
    def limits(loops):
        """`Limit` of the smallest gains at which poles cross to the right: list, ascending."""
        StableGains.curve.compute(loops)
        for members in batches(loops, attrgetter("_signature"), attrgetter("measured")):
            of_members = [one.loop_gain for one in members], [one._crossings for one in members]
            yield from zip(members, destabilising_limits(*of_members), strict=True)

    @property
    def _signature(self):
        """Sizes of all arrays, by which loops are found whose loop gains are computed together: tuple."""
        return self.measured, getattr(self.loop_gain, "signature", None)

    @cached_property
    def _crossings(self):
        """`Crossings` of the curve up to the highest gain that is judged, by ascending gain."""
        on_curve = crossings(self.curve.row, self.curve.omega, self.curve.values)
        return on_curve.take(on_curve.factor < self._highest_judged).sorted()

    @property
    def _highest_judged(self):
        """Gain up to which stability is judged: beyond it rounding decides. [rad/s]"""
        return CONTROL.highest_judged_gain * np.abs(self.poles).min(initial=np.inf)

    def open_ratio(self, omega):
        """Damping ratio, without control, of the mode whose pole is nearest to a frequency [rad/s]. [-]"""
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
        for _, limit, destabilising in limits_at([self.loop_gain], refined_crossings([self.loop_gain], candidates)):
            if limit.factor < gain:
                count += 2 if destabilising else -2
        return max(count, 0)

    def crosses_within(self, ratio, gain, omega):
        """True if a pole crosses at a gain near this one [rad/s], up to a ratio, and above a frequency [rad/s]."""
        return bool((self._crossings_near(gain, ratio).frequency > omega).any())

    def _crossings_near(self, gain, ratio):
        """`Crossings` at gains near one [rad/s], up to a ratio."""
        factor = self._crossings.factor
        return self._crossings.take((factor < ratio * gain) & (gain < ratio * factor))

    def check_delay(self, gain):
        """Refuse a gain [rad/s] with which a delay is too long to judge the loop; see `Law.check_reach`."""
        if self.law.delay and gain:
            self.law.check_reach(self.large_up_to(CONTROL.harmless_delayed_gain / gain), gain)

    @cached_property
    def _largest(self):
        """Size of the largest eigenvalue of L over the gain at the frequencies of the curve, shape (f,). [s]"""
        return np.abs(self.curve.values).max(axis=1)

    def large_up_to(self, size):
        """Frequency above which no eigenvalue of L over the gain is larger than a size [s]. [rad/s]"""
        return float(self.curve.omega[self._largest >= size].max(initial=0.0))

    def largest_beyond(self, omega):
        """Size of the largest eigenvalue of L over the gain above a frequency [rad/s]. [s]"""
        return float(self._largest[self.curve.omega > omega].max(initial=0.0))

    def frequencies(self, gain):
        """Frequencies of the curve, and near poles of the loop with a gain [rad/s], ascending, shape (f,). [rad/s]"""
        return self._closed_loop_curve(gain).omega

    def _closed_loop_curve(self, gain):
        """L over the gain at `frequencies`: `LoopGainCurves`.

        A pole that crosses the axis near this gain is extrapolated from its crossing; the integrator has one at -gain.
        The least frequency is that of a loop that hardly moves.
        """
        curve, first = self.curve, self.curve.omega[0]
        if not gain:
            return curve
        near = self._crossings_near(gain, CONTROL.closed_poles_gain)
        poles = 1j * near.frequency + 1j / (near.factor * near.slope) * (gain / near.factor - 1)
        added = near_poles(np.append(poles, [-gain, -min(gain / 2, first)]))  # a small gain is below all of them
        added = np.append(added, gain / CONTROL.gain_at_rest)
        curve = refined_for_sensitivity(self.loop_gain, gain, curve)
        added = np.setdiff1d(distinct(np.append(curve.omega, added[added < curve.omega[-1]])), curve.omega)
        return curve.with_more([self.loop_gain], np.zeros(len(added), dtype=int), added)

    def margins(self, gain):
        """`Margins` of the loop with a gain. [rad/s]"""
        curve = self._closed_loop_curve(gain)
        return Margins(self.loop_gain, curve.omega, gain, self._check_peak, curve.matrices)

    def _check_peak(self, omega):
        """Refuse a peak of the sensitivity, at a frequency [rad/s], of a mode nearly undamped: NoSolutionError."""
        pole = self.poles[np.argmin(np.abs(self.poles - 1j * omega))] if len(self.poles) else np.inf
        at_pole, ratio = abs(pole - 1j * omega) < CONTROL.peak_at_pole * omega, self.open_ratio(omega)
        if at_pole and ratio < CONTROL.undamped:
            raise undamped(pole, ratio, "no peak of the sensitivity: ")

    @property
    def _sensitivity_at_rest(self):
        """Size of the sensitivity far below the frequency of any gain: above 1 where winches are too few. [-]

        With fewer winches than coordinates, compared in metres and radians, they correct by a projection P that is not
        orthogonal; I - P remains.
        """
        at_rest = CONTROL.gain_at_rest * self.curve.omega[0] * self.curve.matrices[:1]
        return float(largest(sensitivity(at_rest))[0])

    def gain_of_peak(self, peak, most):
        """Largest stable gain with which the sensitivity nowhere exceeds `peak`.

        Parameters
        ----------
        peak : float
            Largest singular value of the sensitivity (I + L)^-1 over frequency that is allowed, above 1; L is the loop
            gain. [-]
        most : float or None
            Gain up to which the loop is stable; None where it is stable with any gain. [rad/s]

        Returns
        -------
        float or None
            None where the peak is not reached with any gain. [rad/s]

        Raises
        ------
        NoSolutionError
            It is exceeded with every gain, by what the winches do not correct at rest; or the search did not end.
        """
        if (at_rest := self._sensitivity_at_rest) > peak:
            raise NoSolutionError(
                f"no gain has a sensitivity of at most {peak:g}: with every gain that of the winches at rest, which do "
                f"not correct all that is measured, is {at_rest:.4g}"
            )
        gain = most or CONTROL.highest_sensitive_gain * np.abs(self.poles).max()
        omega, bounded_by_peak = self.curve.omega, False
        for _ in range(2):  # at frequencies near the poles of the open loop, then also near those of the closed loop
            gain, peak_omega = gain_of_peak(self.loop_gain, omega, peak, gain)
            omega = distinct(np.append(omega, self.frequencies(gain)))
            bounded_by_peak = bounded_by_peak or peak_omega is not None  # else `most` is the bound
        return gain if most or bounded_by_peak else None

    def single_limits(self, gain):
        """Limit of the gain of each of k measured coordinates while the gains of the others stay: list of Limit.

        Parameters
        ----------
        gain : float
            Gain of all coordinates, with which the loop is stable. [rad/s]

        Returns
        -------
        list of Limit
            The `factor` of each is that by which the gain of its coordinate may grow [-]: infinite without limit; 0 if
            the loop is unstable when this coordinate alone has no gain.
        """
        curve = self._closed_loop_curve(gain)
        size, count = curve.matrices.shape[-1], len(curve.omega)
        loop_gains = [gain_of_one(self.loop_gain, gain, coordinate) for coordinate in range(size)]
        # as many loops of one coordinate, one after the other, on the frequencies of the curve
        row, omega = np.repeat(np.arange(size), count), np.tile(curve.omega, size)
        of_itself = np.diagonal(sensitivity(gain * curve.matrices), axis1=1, axis2=2)  # S_jj, shape (f, k)
        matrices = 1 / of_itself.T.reshape(-1, 1, 1) - 1  # their loop gains, see `gain_of_one`
        most = self._highest_judged / gain
        curves = sample_curves(loop_gains, row, omega, matrices, self.law.judged_up_to, most)
        remaining = crossings(curves.row, curves.omega, curves.values)
        remaining = remaining.take(remaining.factor < most).sorted()
        return [growth_allowed(loop_gains, remaining.take(remaining.row == coordinate)) for coordinate in range(size)]


def _curves_of(loops):
    """`StableGains.curve` of many `StableGains` with as many measured coordinates, computed together: list."""
    grids = [loop.first_frequencies for loop in loops]
    row = np.repeat(np.arange(len(loops)), [len(grid) for grid in grids])
    bounds = {"highest": [loop.law.judged_up_to for loop in loops], "most": [loop.most for loop in loops]}
    of_all = sample_curves([loop.loop_gain for loop in loops], row, np.concatenate(grids), **bounds)
    return [of_all.of_loop(number) for number in range(len(loops))]
