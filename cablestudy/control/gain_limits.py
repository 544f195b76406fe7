"""Gains at which poles of loops cross the imaginary axis, located to rounding from crossings of curves over frequency.

A pole crosses at each gain at which an eigenvalue of the loop gain L is -1 at some frequency (`margins_crossings`).
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from cablestudy.control.curves import at_frequencies, eigenvalues
from cablestudy.control.margins import sensitivity
from cablestudy.control.margins_crossings import Crossings, crossing_near, crossings, refined_crossings
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError

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


def destabilising_limits(loop_gains, of_curves):
    """Gains at which poles of n loops cross the imaginary axis to the right: for each a list of `Limit`, ascending.

    The first is the largest stable gain; of those above it some may be missing. An empty list means that every gain is
    stable. `of_curves` are the sorted `Crossings` of each loop's curve over frequency; the loop gains, functions of s,
    all have equally many measured coordinates.

    With the gain g and an eigenvalue l of the loop gain over g, a pole s obeys 1 + g l(s) = 0: it moves by 1/(g dl/ds)
    per relative change of g.

    On the curve over frequency crossings are known by interpolation only. In each round those that may be the first of
    their loop are located to rounding (`_split_first`), and kept where a pole moves to the right. Rounds go on until no
    other crossing lies below the least limit found. A mode that is nearly undamped (`CONTROL.undamped`) has its limit
    not where its pole crosses, but where its growth over its frequency is `CONTROL.negligible_growth`.
    """
    limits, remaining = [[] for _ in loop_gains], Crossings.of_all(of_curves)
    while len(remaining):
        first, remaining = _split_first(loop_gains, remaining)
        for row, limit, destabilising in limits_at(loop_gains, first):
            if destabilising and limit.factor < np.inf:
                limits[row].append(limit)
                limits[row].sort(key=lambda limit: limit.factor)
        least_limit = np.array([of_loop[0].factor if of_loop else np.inf for of_loop in limits])
        remaining = remaining.take(remaining.least < least_limit[remaining.row])
    return limits


def limits_at(functions, crossings):
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


def growth_allowed(functions, remaining):
    """`Limit` with the factor above 1 of a gain at which a pole first crosses to the right; the loop is stable at 1.

    The factor is infinite if none does. If more poles cross to the left than to the right below 1, the loop is unstable
    without this gain: the factor is then 0. A mode that is nearly undamped counts from the factor on with which it
    grows, as in `_limits_at`. `remaining` are the sorted `Crossings` of one of the loops of `functions`.
    """
    net, allowed = 0, Limit(np.inf, 0.0)
    while len(remaining):
        first, remaining = _split_first(functions, remaining)
        for _, limit, destabilising in limits_at(functions, first):
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
