"""Stability of the winch loop: one verdict for a gain, and the largest stable gain.

The poles of the closed loop are the eigenvalues of its A, taken with every mode of the cable that the gain could drive.
For a mode of frequency W far above the gondola's, the winch moves the pole by about

    ds = gain |N(i W)| F_1 F_2 / (2 M W^4)

at most, with F the forces of the mode, of unit modal mass, on the ends along x. A wave that runs to and fro along the
cable has F^2 = 2 W^2 Z n^2/t, Z being the impedance of the end (sqrt(T m) across, sqrt(EA m) along the cable), n the
direction cosine and t the travel time from end to end. Beyond the frequency where this falls below the decay that
damping guarantees (strain damping for waves along the cable, viscous damping for all), no mode can be driven.

Masses on the cable reflect waves, and t is then that of the shortest segment between ends and masses. Viscous damping
does not act on them. With A the amplitude of a wave of number k on a segment of length l, it has the mass
m A^2 (l - 1/k)/2 at least; the force on a mass M is that of the waves beside it, so that M y^2 <= m (A1^2 + A2^2)/k.
The masses have the share 4/(k l + 3) of the modal mass at most, and beyond k l = HALVED half of the viscous damping is
guaranteed.

Another law than an integrator may make the loop gain large far above the gondola's frequency. All modes are then in A
up to where the loop gain of waves that do not return, about gain |C| Z/(M W), is below BROAD.

Damped strain alone guarantees nothing for waves across the cable. There a growth below NEGLIGIBLE of the frequency is
not called instability: no material is known to be that undamped. A mode whose damping ratio without control is below
UNDAMPED and which the gain drives by more is refused by name: cable.damping.viscous decides then, and not the strain.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control.law import SMALL
from cablestudy.control.margins import gain_of_peak
from cablestudy.control.margins_crossings import crossing_near, crossings, refined
from cablestudy.control.margins_grid import by_parts, curve
from cablestudy.errors import NoSolutionError
from cablestudy.system.linear import upper

UNDAMPED = 1e-8  # damping ratio below which a mode counts as undamped
NEGLIGIBLE = 1e-9  # growth over frequency that is not called instability: twofold in 1e8 oscillations
# which modes are in the model of the loop
DRIVEN = 0.02  # a mode is included if the gain shifts its pole by more than this share of its decay
SAFETY = 4  # divides the guaranteed decay in the bound for the modes that are not included
HALVED = 5.0  # phase of waves along a segment beyond which masses at its ends have at most half of the modal mass
FEWEST = 5  # modes up to so many times the gondola's frequency are always candidates
MOST_MODES = 300  # more are refused: one eigenvalue problem of some 600 states takes about a second
BROAD = 0.1  # loop gain of waves that run away, above which a law that is no integrator needs all modes
NEEDED = 1e-4  # relative error of the poles by the other modes
NEEDED_BROAD = 1e-6  # the same of a law that is no integrator
EXACT = 0.1  # the same where a pole decides, relative to the tolerance of the response
TAKEN, FEW = 0.5, 8  # a pole that lost this share of its damping is recomputed with more modes; at most so many poles
# search for the largest gain
LEAST, MOST = 1e-4, 1e9  # range of gains, relative to the gondola's frequency
WIDER, NARROWER = 4, 3  # factors from one range of gains to the next, upwards and downwards
BEYOND = 0.03  # a gain this much above a crossing is judged, since the crossing lacks modes that hardly matter
FARTHER = 2.0  # crossings that values between two frequencies show up to so many times a gain may lie below it
CLOSE = 1e-4  # a gain this much below a crossing is judged, since another pole may have crossed before
STEPS, SETTLED = 60, 1e-12  # most steps of the secant method, and the relative step that ends it
HALF_WIDTHS, BESIDE_POLE, BESIDE_GAIN = 3, 1e-5, 0.1  # distance of a crossing from its pole and from the gain
AROUND = np.linspace(-1.5, 1.5, 13)  # places beside the frequency where the sensitivity decides, in half-widths
FIRST_STEP, LAST_STEP = 1e-9, 1e-15  # of the search for a crossing, relative to its frequency


@dataclass(frozen=True)
class Waves:
    """Impedance and travel time of the waves along a cable.

    Attributes
    ----------
    across, along : float
        sqrt(T m) (1 - n^2) and sqrt(EA m) n^2, n the cosine between cable and x, the larger of both ends. [kg/s]
    time_across, time_along : float
        From end to end. [s]
    part : float
        Of these times along the shortest segment between ends and masses on the cable. [-]
    """

    across: float
    along: float
    time_across: float
    time_along: float
    part: float = 1.0


@dataclass(frozen=True)
class Limit:
    """The largest gain.

    Attributes
    ----------
    gain : float
        [rad/s]
    pole : complex
        The one that it brings to the imaginary axis. [rad/s]
    """

    gain: float
    pole: complex


@dataclass(frozen=True)
class Verdict:
    """Whether the loop is stable with a gain.

    Attributes
    ----------
    stable : bool
    pole : complex
        The pole with the largest growth relative to its frequency. [rad/s]
    open_ratio : float
        Damping ratio without control of the mode that it belongs to. [-]
    """

    stable: bool
    pole: complex
    open_ratio: float

    @property
    def growth(self):
        """Of the pole over its frequency. [-]"""
        return self.pole.real / max(abs(self.pole), np.finfo(float).tiny)

    @property
    def undamped(self):
        """Whether that mode is practically undamped."""
        return self.open_ratio < UNDAMPED


def driven_up_to(plant, waves, gain):
    """Frequency beyond which no mode of the cable can be driven.

    Parameters
    ----------
    plant : Plant
    waves : Waves
    gain : float
        [rad/s]

    Returns
    -------
    float
        Infinite where there is none. [rad/s]
    """
    omega = np.geomspace(plant.main, 1e9 * plant.main, 721)
    strain, part = plant.cable.strain, waves.part
    push = 2 * gain * np.abs(plant.controller(1j * omega)) / (plant.mass * omega * part)
    loss = np.zeros_like(omega) if strain is None else np.abs(strain.factor(1j * omega)) * omega / 2
    across, along = (
        guaranteed_decay(plant.cable, omega * part * time) / SAFETY + NEGLIGIBLE * omega
        for time in (waves.time_across, waves.time_along)
    )
    driven = (push * waves.across / waves.time_across > across) | (
        push * waves.along / waves.time_along > along + loss / SAFETY
    )
    if plant.broad:  # of waves that do not return the loop gain is about C Z/(M W)
        passed = gain * np.abs(plant.controller(1j * omega)) * (waves.across + waves.along) / (plant.mass * omega)
        driven |= passed > BROAD
    if driven[-1]:
        return np.inf
    return float(max(omega[driven].max(initial=0.0), FEWEST * plant.main))


def guaranteed_decay(cable, phase):
    """Rate at which viscous damping makes waves decay at least.

    Parameters
    ----------
    cable : Superelement
    phase : ndarray, shape (m,)
        Wave number times length of the shortest segment between ends and masses on the cable. [-]

    Returns
    -------
    ndarray, shape (m,)
        [1/s]
    """
    return np.where(phase >= HALVED, 0.5, 0.0) * cable.viscous / 2 if cable.uneven else cable.viscous / 2


def judge(plant, gain):
    """The verdict on a gain.

    Parameters
    ----------
    plant : Plant
    gain : float
        [rad/s]

    Returns
    -------
    Verdict

    Raises
    ------
    NoSolutionError
        The gain could drive too many modes, or the delay is too long.
    """
    gain = min(gain, MOST * plant.main)  # beyond it nothing changes
    return ResolvedLoop(plant, gain).verdict(gain)


class ResolvedLoop:
    """The closed loop with every mode that gains up to some gain could drive.

    Parameters
    ----------
    plant : Plant
    gain : float
        [rad/s]
    """

    def __init__(self, plant, gain):
        whole, limit = (plant.excited, np.inf) if plant.resolved is None else plant.resolved(plant, gain)
        self.plant, self.gain = plant, gain
        chosen = _driven(plant, whole, gain) & (whole.omega <= limit)
        if plant.broad:  # nothing is known of where poles are that matter
            chosen[plant.needed(whole, NEEDED_BROAD, 1.0)] = True
        if chosen.sum() > MOST_MODES:
            raise too_many(plant.said(gain, 4), int(chosen.sum()), float(whole.omega[chosen].max()))
        self._whole, self._chosen, self._exact = whole, chosen, {}
        self._own = plant.resolved is not None or not np.isin(np.flatnonzero(chosen), plant.pole_modes).all()
        self._own = self._own or plant.law.delay > 0
        _ = self._highest  # raises NoSolutionError

    @cached_property
    def cable(self):
        """The cable with the modes that are included."""
        # the model of the plant's poles is used where it includes them all: its poles are needed anyway
        return self._whole.condense(np.flatnonzero(self._chosen)) if self._own else self.plant.pole_model

    @cached_property
    def _closed(self):
        """A of the closed loop as A0 + gain A1."""
        return self.plant.closed_of(self.cable, self._highest) if self._own else self.plant.closed

    @cached_property
    def _highest(self):
        """Frequency beyond which the loop gain is below SMALL: up to there a delay must be right. [rad/s]

        Raises
        ------
        NoSolutionError
            The delay is too long for that.
        """
        plant = self.plant
        if not plant.law.delay:
            return 0.0
        omega = plant.frequencies(np.concatenate([self.open_poles, self.cable.poles]))
        value = self.gain * np.abs(by_parts(self.unit_gain, omega)[:, 0, 0])
        large = omega[~(value < SMALL)]
        highest = float(large[-1]) if len(large) else plant.main
        plant.law.check_reach(highest, self.gain)
        return highest

    @cached_property
    def open_poles(self):
        """Poles without control, upper half plane and real axis. [rad/s]"""
        return self.plant.system_of(self.cable).poles if self._own else self.plant.open_poles

    def unit_gain(self, s):
        """L over the gain, shape (f, 1, 1)."""
        return self.plant.unit_matrix(self.cable, s)

    @cached_property
    def curve(self):
        """Frequencies that show how L passes the negative real axis [rad/s], and L over the gain there."""
        omega = self.plant.frequencies(np.concatenate([self.open_poles, self.cable.poles]))
        return curve(self.unit_gain, omega, upto=self.plant.law.judged_up_to)

    @cached_property
    def _crossings(self):
        """`Crossings` of the curve, as far as its values show them."""
        omega, _, values = self.curve
        return crossings(omega[None], values[None])

    def crossing_gains(self, most):
        """Gains up to about another one at which a pole crosses the imaginary axis, ascending, shape (c,). [rad/s]"""
        found = self._crossings
        return refined(self.unit_gain, found.take(found.factor <= FARTHER * most)).factor

    @property
    def first_crossing_gain(self):
        """The least of them; infinite where there is none. [rad/s]"""
        return float(self.crossing_gains(self._crossings.factor.min(initial=np.inf)).min(initial=np.inf))

    def exact(self, pole):
        """The cable with every mode that matters for a pole."""
        plant, about = self.plant, int(np.ceil(np.log2(max(abs(pole) / self.plant.main, 1.0))))
        if self._whole.strain is None or self._whole.uneven or not plant.tolerance:
            return self._whole
        if about not in self._exact:
            chosen = self._chosen.copy()
            chosen[plant.needed(self._whole, EXACT * plant.tolerance, 1.0, plant.main * 2.0**about)] = True
            self._exact[about] = self._whole.condense(np.flatnonzero(chosen))
        return self._exact[about]

    def poles(self, gains):
        """Eigenvalues for some gains, shape (k,) -> (k, n). [rad/s]"""
        fixed, scaled = self._closed
        every = np.linalg.eigvals(fixed + np.asarray(gains)[:, None, None] * scaled)
        return np.where(every.imag >= 0, every, -1.0)  # of hysteretic damping only the upper half plane counts

    def verdict(self, gain):
        """`Verdict` on a gain: the pole that grows most, or is nearest to growing."""
        verdicts = self._verdicts(gain)
        return max([part for part in verdicts if not part.stable] or verdicts, key=lambda part: part.growth)

    def growing(self, gain):
        """A `Verdict` for each pole that grows with a gain: list."""
        return [part for part in self._verdicts(gain) if not part.stable]

    def _verdicts(self, gain):
        """A `Verdict` for each of the poles that grow most relative to their frequency: list."""
        poles = self.poles([gain])[0] if self._own else self.plant.closed_poles(gain)
        ratio = poles.real / np.maximum(np.abs(poles), np.finfo(float).tiny)
        verdicts = []
        for place in np.argsort(-ratio)[: None if self.plant.broad else FEW]:
            growth, pole = float(ratio[place]), complex(poles[place])
            open_ratio = self.open_ratio(pole)
            if pole.imag > 0 and growth > -TAKEN * open_ratio:  # with all modes that matter
                pole = self.plant.pole_near(pole, self.exact(pole), gain)
                growth = pole.real / abs(pole)
            verdicts.append(Verdict(bool(growth <= allowed(open_ratio)), pole, open_ratio))
        return verdicts

    def open_ratio(self, pole):
        """Damping ratio without control of the mode that a pole belongs to. [-]"""
        if not len(self.open_poles):
            return 1.0
        mode = self.open_poles[np.argmin(np.abs(self.open_poles - pole))]
        return float(max(-mode.real / abs(mode), 0.0))


def allowed(open_ratio):
    """Growth over frequency that is no instability, of a mode with a damping ratio without control. [-]"""
    return NEGLIGIBLE if open_ratio < UNDAMPED else 0.0


def _driven(plant, cable, gain):
    """Which modes of a cable a gain could drive, or matter for the motion of the gondola."""
    chosen = np.zeros(len(cable.omega), dtype=bool)
    chosen[plant.needed(cable, NEEDED, 1.0)] = True
    omega, main = cable.omega, plant.main
    force = [np.abs(cable.participation[:, end]) for end in plant.ends]
    moved = force[0] > 1e-9 * force[0].max(initial=0.0)
    if plant.broad or plant.mass < cable.inertia[plant.ends[0], plant.ends[0]]:
        return moved | chosen  # a light gondola is moved by every mode
    held = np.maximum(
        np.abs(plant.mass * omega**2 - cable.stiffness[plant.ends[0], plant.ends[0]]), plant.mass * main**2
    )
    push = gain * np.abs(plant.controller(1j * omega)) * force[0] * force[1] / (2 * omega * held)
    return chosen | (push > DRIVEN * np.maximum(cable.decay, NEGLIGIBLE * omega))


def largest_gain(plant):
    """The gain below which the loop is stable.

    Parameters
    ----------
    plant : Plant

    Returns
    -------
    Limit or None
        None when it always is.

    Raises
    ------
    NoSolutionError
        It depends on modes that are as good as undamped, or on too many.
    """
    low, gain = 0.0, _first_guess(plant)
    while low < MOST * plant.main:
        found = _resolved(plant, low, gain)
        gain = found.gain
        crossed = found.crossing_gains(gain)
        tried = [crossing for crossing in (1 + BEYOND) * crossed if low < crossing < gain]
        for higher in [*tried, gain]:
            if growing := found.growing(higher):
                return _smallest(found, higher, growing)
        low, gain = gain, WIDER * gain
    return None


def _smallest(found, gain, growing):
    """`Limit` with the smallest gain at which a pole becomes unstable, from a gain with which some grow.

    The pole that grows fastest there may have crossed later than another one.
    """
    while True:
        damped = [one for one in growing if not one.undamped]
        if not damped:
            one = max(growing, key=lambda part: part.growth)
            said = found.plant.said(gain, 4).removeprefix("a gain of ")
            raise undamped(one.pole, one.open_ratio, f"no largest gain: at {said} ")
        limits = [_polished(found, one.pole, gain) for one in damped]
        limit = min((one for one in limits if one.gain < gain), key=lambda one: one.gain, default=limits[0])
        below = (1 - CLOSE) * limit.gain
        growing = found.growing(below)
        if not growing or limit.gain >= gain:
            return limit
        gain = below


def _resolved(plant, low, gain):
    """The closed loop for gains up to the one given, or to a lower one where that is beyond what is judged."""
    while True:
        try:
            return ResolvedLoop(plant, gain)
        except NoSolutionError:
            gain /= NARROWER
            if gain < max(1.05 * low, LEAST * plant.main):
                raise


def _first_guess(plant):
    """A gain a little above the least crossing of the imaginary axis, with the modes that hardly any gain needs."""
    found = _resolved(plant, 0.0, 1e-3 * plant.main)
    least = min(found.first_crossing_gain, plant.main)
    return float(np.clip(1.2 * least, 1e-3 * plant.main, 1e3 * plant.main))


def limit_near(plant, known):
    """The largest gain of a plant that differs little from another one, whose largest gain is known.

    Parameters
    ----------
    plant : Plant
    known : Limit

    Returns
    -------
    Limit

    Raises
    ------
    NoSolutionError
        The gain could drive too many modes.
    """
    return _polished(ResolvedLoop(plant, known.gain), known.pole, known.gain)


def _polished(found, pole, gain):
    """`Limit`: the gain at which a pole becomes unstable, with all modes that matter for it."""
    cable = found.exact(pole)
    crossing = _crossing(found.plant, cable, pole, gain)
    if crossing:
        return crossing

    def excess(gain, near):
        pole = found.plant.pole_near(near, cable, gain)
        return pole.real / abs(pole), pole

    last, pole = excess(gain, complex(pole))
    before, here = gain, gain * (1.01 if last < 0 else 0.99)
    for _ in range(STEPS):
        value, pole = excess(here, pole)
        if value == last:
            break
        step = value * (here - before) / (value - last)
        before, last, here = here, value, here - float(np.clip(step, -0.3 * here, 0.3 * here))
        if abs(step) <= SETTLED * here:
            return Limit(float(here), pole)
    return Limit(float(gain), pole)


def _crossing(plant, cable, pole, gain):
    """The gain near another one at which a pole crosses the imaginary axis: a `Limit`, or None if not found."""

    def needed_gain(omega):
        return -1 / complex(plant.unit_gain_of(cable, np.array([1j * omega]))[0])

    begin, width = abs(pole), abs(pole.real)
    step, farthest = max(0.1 * width, FIRST_STEP * begin), HALF_WIDTHS * width + BESIDE_POLE * begin
    found = crossing_near(needed_gain, begin, step, farthest, max(LAST_STEP * begin, SETTLED * width))
    return Limit(found[0], 1j * found[1]) if found and abs(found[0] - gain) <= BESIDE_GAIN * gain else None


def sensitive_gain(plant, peak, most):
    """The largest gain up to `most` with which the peak of the sensitivity is at most a value. [rad/s]

    Parameters
    ----------
    plant : Plant
    peak : float
        Above 1; infinite for none. [-]
    most : float or None
        Up to which the loop is stable; None where it always is. [rad/s]

    Returns
    -------
    float or None
        None where every gain has a lower peak.

    Raises
    ------
    NoSolutionError
        A mode as good as undamped decides, or the gain could drive too many modes.
    """
    if peak == np.inf:
        return most
    found = _resolved(plant, 0.0, MOST * plant.main if most is None else most)
    gain, omega = gain_of_peak(found.unit_gain, found.curve[0], peak, found.gain)
    if omega is None:
        return most
    pole = complex(found.open_poles[np.argmin(np.abs(found.open_poles - 1j * omega))])
    if (ratio := found.open_ratio(pole)) < UNDAMPED:
        said = plant.said(gain, 4).removeprefix("a gain of ")
        raise undamped(pole, ratio, f"no gain with a sensitivity of at most {peak:g}: at {said} ")
    around = omega + min(abs(pole.real), BESIDE_GAIN * omega) * AROUND  # with every mode that matters there
    most = min(found.gain, (1 + BEYOND) * gain)
    exact = found.exact(1j * omega)
    return gain_of_peak(lambda s: plant.unit_matrix(exact, s), around, peak, most)[0]


def undamped(pole, ratio, begin=""):
    """The error for a loop whose stability depends on a mode as good as undamped."""
    return NoSolutionError(
        f"{begin}the winch drives the cable's mode of {abs(pole.imag) / (2 * np.pi):.4g} Hz, whose damping ratio is "
        f"{ratio:.1e}: damped strain leaves it as good as undamped (below {UNDAMPED:g}); give cable.damping.viscous"
    )


def too_many(said, count, omega):
    """The error for a gain, in words, that could drive too many modes."""
    return NoSolutionError(
        f"{said} could drive about {count} modes of the cable, up to {omega / (2 * np.pi):.4g} Hz, "
        f"more than are resolved ({MOST_MODES}): cable.damping.viscous or a lower roll-off of the notch bounds them"
    )


def complaint(plant, gain, verdict):
    """Why a gain is refused, with the largest stable one where it is known."""
    pole = verdict.pole
    text = f"unstable loop at {plant.said(gain)}: a motion of {abs(pole.imag) / (2 * np.pi):.4g} Hz "
    text += f"grows by {pole.real:.3g} 1/s; "
    if verdict.undamped:
        return text + str(undamped(pole, verdict.open_ratio))
    try:
        limit = plant.largest_gain
    except NoSolutionError as error:
        return text + str(error)
    if limit is None:
        return text + "there is no largest stable gain"
    if plant.law.integrates_only:
        return text + f"the largest stable gain is {limit:.6g} rad/s"
    return text + f"it is stable with all gains less than {limit / gain:.6g} times as large"


def unstable_poles(plant, gain):
    """How many poles lie to the right for a gain, pairs counted twice."""
    found = ResolvedLoop(plant, gain)
    right = upper(found.poles([gain])[0])
    right = right[right.real > 0]
    return int((1 + (right.imag > 0)).sum())
