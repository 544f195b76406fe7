"""Gains with which a loop of several winches is stable, and with which the peak of its sensitivity is bounded.

Of a loop that is stable without gain, a pole crosses the imaginary axis to the right or to the left at each gain at
which an eigenvalue of the loop gain L is -1 at some frequency (`margins_crossings`). The number of unstable pairs of
poles with a gain is that of the crossings to the right at smaller gains, less that of the crossings to the left; the
least gain of a crossing to the right is the largest stable one. So stability follows from the curve of L over frequency
alone, with all modes that L has.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from operator import attrgetter

import numpy as np

from cablestudy.control.curves import at_frequencies, eigenvalues, refined_for_sensitivity, sample_curves
from cablestudy.control.margins import Margins, gain_of_peak, largest, sensitivity
from cablestudy.control.margins_crossings import Crossings, crossing_near, crossings, refined_crossings
from cablestudy.control.margins_grid import distinct, frequencies, near_poles
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.together import batches, computed_together

# distances from the frequency of a mode nearly undamped, over its width, at which its growth is looked for
ASIDE = np.geomspace(0.05, 1e4, 80)


@dataclass(frozen=True)
class Limit:
    """Gain and frequency at which a pole crosses the imaginary axis.

    Attributes
    ----------
    factor : float
        The gain [rad/s]; or, if only one coordinate's gain changes, the factor on it [-].
    omega : float
        Frequency of the pole there. [rad/s]
    rate : float
        Growth of the pole, over its frequency, per relative change of the gain: about the damping ratio of a mode
        without control that the gain takes away. [-]
    slope : complex
        dl/dw: l is the eigenvalue of the loop gain, divided by the gain, and w the frequency. [s^2], or [s] with a
        factor [-].
    """

    factor: float
    omega: float
    rate: float = 1.0
    slope: complex = 1j

    @property
    def undamped(self):
        """True if the mode whose pole crosses is nearly undamped: its damping ratio is below `CONTROL.undamped`."""
        return self.rate < CONTROL.undamped

    def resembles(self, other):
        """True if a `Limit` of a similar loop gain may belong to the same pole."""
        pairs = (self.factor, other.factor), (self.omega, other.omega)
        return all(abs(theirs / own - 1) < CONTROL.same_pole for own, theirs in pairs)


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
            yield from zip(members, _destabilising_limits(members), strict=True)

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
        for _, limit, destabilising in _limits_at([self.loop_gain], refined_crossings([self.loop_gain], candidates)):
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
        return [_growth_allowed(loop_gains, remaining.take(remaining.row == coordinate)) for coordinate in range(size)]


def gain_of_one(loop_gain, gain, coordinate):
    """Loop gain of one coordinate while the other loops are closed, 1/S_jj - 1: s, shape (f,) -> shape (f, 1, 1).

    Parameters
    ----------
    loop_gain : callable
        L over the gain of all coordinates: s, shape (f,) -> shape (f, k, k). [s]
    gain : float
        That gain. [rad/s]
    coordinate : int
        j; S = (I + L)^-1 is the sensitivity.
    """

    def of_one(s):
        return 1 / sensitivity(gain * loop_gain(s))[:, coordinate, coordinate, None, None] - 1

    return of_one


def _curves_of(loops):
    """`StableGains.curve` of many `StableGains` with as many measured coordinates, computed together: list."""
    grids = [loop.first_frequencies for loop in loops]
    row = np.repeat(np.arange(len(loops)), [len(grid) for grid in grids])
    bounds = {"highest": [loop.law.judged_up_to for loop in loops], "most": [loop.most for loop in loops]}
    of_all = sample_curves([loop.loop_gain for loop in loops], row, np.concatenate(grids), **bounds)
    return [of_all.of_loop(number) for number in range(len(loops))]


def _destabilising_limits(loops):
    """Gains at which poles of many loops cross the imaginary axis to the right: `StableGains.limits` of each.

    For each loop a list of `Limit`, ascending by gain. The first is the largest stable gain; of those above it some may
    be missing. An empty list means that every gain is stable. All loops have equally many measured coordinates.

    With the gain g and an eigenvalue l of the loop gain over g, a pole s obeys 1 + g l(s) = 0: it moves by 1/(g dl/ds)
    per relative change of g.

    On the curve over frequency crossings are known by interpolation only. In each round those that may be the first of
    their loop are located to rounding (`_split_first`), and kept where a pole moves to the right. Rounds go on until no
    other crossing lies below the least limit found. A mode that is nearly undamped (`CONTROL.undamped`) has its limit
    not where its pole crosses, but where its growth over its frequency is `CONTROL.negligible_growth`.
    """
    functions, limits = [loop.loop_gain for loop in loops], [[] for _ in loops]
    remaining = Crossings.of_all([loop._crossings for loop in loops])
    while len(remaining):
        first, remaining = _split_first(functions, remaining)
        for row, limit, destabilising in _limits_at(functions, first):
            if destabilising and limit.factor < np.inf:
                limits[row].append(limit)
                limits[row].sort(key=lambda limit: limit.factor)
        least_limit = np.array([of_loop[0].factor if of_loop else np.inf for of_loop in limits])
        remaining = remaining.take(remaining.least < least_limit[remaining.row])
    return limits


def _limits_at(functions, crossings):
    """`Limit`s of `Crossings` of n loop gains, with the number of the loop, and True if the pole crosses to the right.

    For a nearly undamped mode that crosses to the right the limit is where it grows by `CONTROL.negligible_growth`
    times its frequency; the factor is infinite if it never does. Its crossing back to the left is left out.
    """
    limits, destabilising = _as_limits(crossings), crossings.destabilising.tolist()
    undamped = [index for index, limit in enumerate(limits) if destabilising[index] and limit.undamped]
    if undamped:
        row = crossings.row[undamped]
        factors = _undamped_factors(functions, row, [limits[index] for index in undamped])
        for index, factor in zip(undamped, factors.tolist(), strict=True):
            limits[index] = replace(limits[index], factor=factor)
    found = zip(crossings.row.tolist(), limits, destabilising, strict=True)
    return [(row, limit, to_right) for row, limit, to_right in found if to_right or not limit.undamped]


def _undamped_factors(functions, row, limits):
    """Gain from which on each of l nearly undamped modes grows by `negligible_growth` times its frequency. [rad/s]

    The growing pole is sought along s = (negligible_growth + i) w, at frequencies w on both sides of the mode. The gain
    is infinite where the mode nowhere grows so fast. `row`, shape (l,), is the number of the loop of each mode,
    ascending; `limits` are gain and frequency at which the pole of each crosses the imaginary axis.
    """
    own, growth = [functions[index] for index in row.tolist()], CONTROL.negligible_growth  # one function for each mode
    center = np.array([limit.omega for limit in limits])[:, None]
    width = np.array([max(limit.rate, CONTROL.negligible_growth) for limit in limits])[:, None] * center
    omega = (center + width * np.concatenate([-ASIDE[::-1], [0.0], ASIDE])).ravel()
    mode = np.repeat(np.arange(len(limits)), 2 * len(ASIDE) + 1)
    near_modes = crossings(mode, omega, eigenvalues(at_frequencies(own, mode, omega, growth)))
    destabilising = refined_crossings(own, near_modes.take(near_modes.destabilising), growth)
    factors = np.full(len(limits), np.inf)
    np.minimum.at(factors, destabilising.row, destabilising.factor)
    return factors


def _as_limits(crossings):
    """Each of some `Crossings` as a `Limit`: list."""
    rate = np.abs((1j / (crossings.factor * crossings.slope)).real) / crossings.frequency
    columns = crossings.factor, crossings.frequency, rate, crossings.slope
    return [Limit(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def _growth_allowed(functions, remaining):
    """`Limit` with the factor above 1 of a gain at which a pole first crosses to the right; the loop is stable at 1.

    The factor is infinite if none does. If more poles cross to the left than to the right below 1, the loop is unstable
    without this gain: the factor is then 0. A mode that is nearly undamped counts from the factor on with which it
    grows, as in `_limits_at`. `remaining` are the sorted `Crossings` of one of the loops of `functions`.
    """
    net, allowed = 0, Limit(np.inf, 0.0)
    while len(remaining):
        first, remaining = _split_first(functions, remaining)
        for _, limit, destabilising in _limits_at(functions, first):
            if limit.factor < 1:
                net += 1 if destabilising else -1
            elif destabilising and limit.factor < allowed.factor:
                allowed = limit
        remaining = remaining.take(remaining.least < allowed.factor)
    return allowed if net >= 0 else Limit(0.0, 0.0)


def _split_first(functions, remaining):
    """First of sorted `Crossings` of each loop, those with about the least factor, to rounding; and the others."""
    near = remaining.factor <= CONTROL.refined_together * remaining.least
    return refined_crossings(functions, remaining.take(near)), remaining.take(~near)


def limit_near(loop_gain, similar):
    """The first of `limits_near` if it resembles the known one, else the least; None where no pole crosses there."""
    limits = limits_near(loop_gain, similar)
    first = next(limits, None)
    if first is None or similar.resembles(first):
        return first
    return min([first, *limits], key=lambda limit: limit.factor)


def limits_near(loop_gain, similar):
    """Find gains and frequencies at which poles cross the imaginary axis, near such a crossing of a similar loop.

    A local search replaces the whole curve over frequency. It serves for two loop gains that differ by no more than the
    errors of a model.

    Parameters
    ----------
    loop_gain : callable
        Function of s, shape (f,) [rad/s] -> loop gain divided by the gain, shape (f, k, k). [s]
    similar : Limit
        Crossing of the similar loop. The search begins at its frequency. It follows those eigenvalues l of `loop_gain`
        for which -1/l, the gain of a crossing where it is real, is near the gain of `similar`.

    Yields
    ------
    Limit
        One crossing for each of these eigenvalues, if it is found; that with the nearest -1/l first. `rate` and `slope`
        are those of `similar`.
    """
    omega = similar.omega

    @cache  # several searches begin with the same step
    def needed_gains(omega):
        return -1 / eigenvalues(loop_gain(np.array([1j * omega])))[0]

    candidates = needed_gains(omega)  # complex; real where a pole crosses
    distance = np.abs(candidates - similar.factor)
    nearest = np.argsort(distance)[: np.count_nonzero(distance < CONTROL.may_cross_within * similar.factor)]
    farthest = CONTROL.one_crossing * omega
    settled = max(CONTROL.crossing_step * similar.rate, CONTROL.crossing_frequency) * omega  # the last step
    slope = similar.slope * similar.factor**2  # of -1/l over frequency: (dl/dw)/l^2, with l = -1/similar.factor
    for gain in candidates[nearest]:
        step = -gain.imag / slope.imag  # to where -1/l is real, by this slope
        if abs(step) <= settled:
            yield replace(similar, factor=float(gain.real + step * slope.real), omega=float(omega + step))
            continue
        if abs(step) > CONTROL.nearby_change * min(similar.rate, 1.0) * omega:
            step = min(CONTROL.first_crossing_step, similar.rate) * omega  # small: the slope does not hold that far
        found = crossing_near(needed_gains, gain, omega, step, farthest, settled)
        if found and found[0] > 0:
            yield replace(similar, factor=float(found[0]), omega=float(found[1]))


def undamped(pole, ratio, begin=""):
    """The error for a loop whose stability depends on a mode nearly undamped, the message beginning with a text."""
    return NoSolutionError(
        f"{begin}the loop drives a mode of {abs(pole.imag) / (2 * np.pi):.4g} Hz, whose damping ratio is "
        f"{ratio:.1e}: damped strain leaves it as good as undamped (below {CONTROL.undamped:g}); "
        f"give cable.damping.viscous"
    )


def too_many(gains, count, most, omega):
    """The error for gains, in words, up to which a loop is examined, and which could drive more modes than `most`."""
    return NoSolutionError(
        f"the loop is examined up to {gains}, which could drive about {count} modes of the cable, "
        f"up to {omega / (2 * np.pi):.4g} Hz, more than are resolved ({most}): "
        f"cable.damping.viscous or a lower roll-off of the notch bounds them"
    )
