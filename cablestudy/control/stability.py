"""Which modes of one cable a gain of its winch could drive, and the stability of the loop with them.

Stability follows from the loop gain over frequency (`gain_limits`), with every mode of the cable that the gain could
drive. For a mode of frequency W far above the gondola's, the winch moves the pole by about

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

Another law than an integrator may make the loop gain large far above the gondola's frequency. All modes then count
up to where the loop gain of waves that do not return, about gain |C| Z/(M W), is below BROAD.

Damped strain alone guarantees nothing for waves across the cable. There a growth below NEGLIGIBLE of the frequency is
not called instability: no material is known to be that undamped. A mode whose damping ratio without control is below
UNDAMPED and which the gain drives by more is refused by name: cable.damping.viscous decides then, and not the strain.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from cablestudy.control.gain_limits import NEGLIGIBLE, UNDAMPED, Limit, StableGains
from cablestudy.control.law import SMALL
from cablestudy.control.margins import gain_of_peak
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.system.linear import upper
from cablestudy.system.superelement import Superelement

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
# search for the largest gain
LEAST, MOST = 1e-4, 1e9  # range of gains, relative to the gondola's frequency
WIDER, NARROWER = 4, 3  # factors from one range of gains to the next, upwards and downwards
FINER = 1.7  # orders of the elements from one cable to the next by which the largest gain is confirmed
DOUBT = 3.0  # its error over their difference
ALLOWED, MOST_ERROR = 30.0, 100.0  # error that ends it, and that is given at all, over the tolerance of the response
BEYOND = 0.03  # a gain this much above a crossing is judged, since the crossing lacks modes that hardly matter
BESIDE_GAIN = 0.1  # largest relative distance of places beside the frequency where the sensitivity decides
AROUND = np.linspace(-1.5, 1.5, 13)  # places beside the frequency where the sensitivity decides, in half-widths


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
class LargestGain:
    """The gain below which a loop is stable, and what decided on it.

    Attributes
    ----------
    limit : Limit
    cable : Superelement
    notch : Notch or None
    error : float
        Estimated relative error of the gain by that cable. [-]
    """

    limit: Limit
    cable: Superelement
    notch: object
    error: float

    def of(self, plant):
        """`Limit` of a plant that differs at most in its notch, as that at a coupled frequency of a finer model."""
        return self.limit if plant.notch == self.notch else self.limit.of(partial(plant.unit_matrix, self.cable))


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


class ResolvedLoop:
    """The loop gain with every mode that gains up to some gain could drive.

    Parameters
    ----------
    plant : Plant
    gain : float
        [rad/s]
    Attributes
    ----------
    cable : Superelement
        With the modes that are included.
    gains : StableGains
        Of that cable.

    Raises
    ------
    NoSolutionError
        The gain could drive too many modes, or the delay is too long.
    """

    def __init__(self, plant, gain):
        whole, highest = (plant.excited, np.inf) if plant.resolved is None else plant.resolved(plant, gain, 1.0)
        self.plant, self.gain = plant, gain
        chosen = _driven(plant, whole, gain) & (whole.omega <= highest)
        if plant.broad:  # nothing is known of where poles are that matter
            chosen[plant.needed(whole, NEEDED_BROAD, 1.0)] = True
        if chosen.sum() > MOST_MODES:
            raise too_many(plant.said(gain, 4), int(chosen.sum()), float(whole.omega[chosen].max()))
        self._whole, self._chosen, self._exact = whole, chosen, {}
        # the model of the plant's poles is used where it includes them all: its poles are needed anyway
        known = plant.resolved is None and np.isin(np.flatnonzero(chosen), plant.pole_modes).all()
        self.cable = plant.pole_model if known else whole.condense(np.flatnonzero(chosen))
        self.open_poles = plant.open_poles if known else plant.system_of(self.cable).poles
        poles = np.concatenate([self.open_poles, self.cable.poles])
        self.gains = StableGains(partial(plant.unit_matrix, self.cable), poles, (plant.notch,), plant.law)
        self.gains.check_delay(gain)

    def exact(self, omega):
        """The cable with every mode that matters for a pole at a frequency. [rad/s]"""
        plant, about = self.plant, int(np.ceil(np.log2(max(omega / self.plant.main, 1.0))))
        if self._whole.strain is None or self._whole.uneven or not plant.tolerance:
            return self._whole
        if about not in self._exact:
            chosen = self._chosen.copy()
            chosen[plant.needed(self._whole, EXACT * plant.tolerance, 1.0, plant.main * 2.0**about)] = True
            self._exact[about] = self._whole.condense(np.flatnonzero(chosen))
        return self._exact[about]

    def polished(self, limit):
        """A `Limit` with every mode that matters for it."""
        return limit.of(partial(self.plant.unit_matrix, self.exact(limit.omega)))

    @property
    def limit(self):
        """`Limit` of the smallest gain at which a pole becomes unstable; None where none does."""
        limits = self.gains.limits
        near = [self.polished(one) for one in limits if one.factor <= (1 + BEYOND) * limits[0].factor]
        return min(near, key=lambda one: one.factor, default=None)

    def unstable(self, gain):
        """How many poles with a gain [rad/s] are to the right, pairs counted twice."""
        return self.gains.unstable(gain, self.polished)

    def growing(self, gain):
        """The pole that grows most relative to its frequency with a gain. [rad/s]"""
        fixed, scaled = self.plant.closed_of(self.cable, self.gains.large_up_to(SMALL / gain))
        poles = upper(np.linalg.eigvals(fixed + gain * scaled))
        pole = complex(poles[np.argmax(poles.real / np.maximum(np.abs(poles), np.finfo(float).tiny))])
        return self.plant.pole_near(pole, self.exact(abs(pole)), gain) if pole.imag > 0 else pole


def _driven(plant, cable, gain):
    """Which modes of a cable a gain could drive, or matter for the motion of the gondola."""
    chosen = np.zeros(len(cable.omega), dtype=bool)
    chosen[plant.needed(cable, NEEDED, 1.0)] = True
    omega, main = cable.omega, plant.main
    force = [np.abs(cable.participation[:, end]) for end in plant.ends]
    moved = force[0] > 1e-9 * force[0].max(initial=0.0)
    if plant.drives_every_mode:
        return moved | chosen
    held = np.maximum(
        np.abs(plant.mass * omega**2 - cable.stiffness[plant.ends[0], plant.ends[0]]), plant.mass * main**2
    )
    push = gain * np.abs(plant.controller(1j * omega)) * force[0] * force[1] / (2 * omega * held)
    return chosen | (push > DRIVEN * np.maximum(cable.decay, NEGLIGIBLE * omega))


def loop_up_to(plant, gain):
    """`ResolvedLoop` of a plant for gains up to one [rad/s], which is that of a lower gain beyond what is judged."""
    return ResolvedLoop(plant, min(gain, MOST * plant.main))


def largest_gain(plant):
    """The gain below which the loop is stable.

    Parameters
    ----------
    plant : Plant

    Returns
    -------
    LargestGain or None
        None when the loop always is stable.

    Raises
    ------
    NoSolutionError
        It depends on modes that are as good as undamped, or on too many; or its error is too large.
    """
    low, gain = 0.0, _first_guess(plant)
    while low < MOST * plant.main:
        found = _resolved(plant, low, gain)
        if (limit := found.limit) and limit.factor <= found.gain:
            if limit.undamped:
                said = plant.said((1 + BEYOND) * limit.factor, 4).removeprefix("a gain of ")
                ratio = found.gains.open_ratio(limit.omega)
                raise undamped(1j * limit.omega, ratio, f"no largest gain: at {said} ")
            return _confirmed(plant, found, limit)
        low, gain = found.gain, WIDER * found.gain
    return None


def _confirmed(plant, found, limit):
    """`LargestGain` by cables with finer and finer elements, until two agree; raises as `largest_gain`."""
    known = LargestGain(limit, found.exact(limit.omega), plant.notch, 0.0)
    if plant.resolved is None or not plant.tolerance:
        return known
    finer, allowed = FINER, ALLOWED * plant.tolerance
    while True:
        try:
            cable = plant.resolved(plant, found.gain, finer)[0]
        except CablestudyError:  # so many elements cannot be had
            break
        limit = known.limit.of(partial(plant.unit_matrix, cable))
        known = LargestGain(limit, cable, plant.notch, DOUBT * abs(limit.factor / known.limit.factor - 1))
        if known.error <= allowed:
            return known
        finer *= FINER
    if known.error > MOST_ERROR * plant.tolerance:
        raise NoSolutionError(f"the error of the largest gain is about {known.error:.1e} with the finest elements")
    return known


def _resolved(plant, low, gain):
    """The loop for gains up to the one given, or to a lower one where that is beyond what is judged."""
    while True:
        try:
            return ResolvedLoop(plant, gain)
        except NoSolutionError:
            gain /= NARROWER
            if gain < max(1.05 * low, LEAST * plant.main):
                raise


def _first_guess(plant):
    """A gain a little above the least crossing of the imaginary axis, with the modes that hardly any gain needs."""
    least = _resolved(plant, 0.0, 1e-3 * plant.main).gains.least_crossing or plant.main
    return float(np.clip(1.2 * least, 1e-3 * plant.main, 1e3 * plant.main))


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
    gain, omega = gain_of_peak(found.gains.loop_gain, found.gains.curve[0], peak, found.gain)
    if omega is None:
        return most
    pole = complex(found.open_poles[np.argmin(np.abs(found.open_poles - 1j * omega))])
    if (ratio := found.gains.open_ratio(omega)) < UNDAMPED:
        said = plant.said(gain, 4).removeprefix("a gain of ")
        raise undamped(pole, ratio, f"no gain with a sensitivity of at most {peak:g}: at {said} ")
    around = omega + min(abs(pole.real), BESIDE_GAIN * omega) * AROUND  # with every mode that matters there
    most = min(found.gain, (1 + BEYOND) * gain)
    exact = found.exact(omega)
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


def complaint(plant, gain):
    """Why a gain is refused, with the largest stable one where it is known."""
    found = loop_up_to(plant, gain)
    pole = found.growing(found.gain)
    text = f"unstable loop at {plant.said(gain)}: a motion of {abs(pole.imag) / (2 * np.pi):.4g} Hz "
    text += f"grows by {pole.real:.3g} 1/s; "
    if (ratio := found.gains.open_ratio(abs(pole))) < UNDAMPED:
        return text + str(undamped(pole, ratio))
    try:
        limit = plant.largest_gain
    except NoSolutionError as error:
        return text + str(error)
    if limit is None:
        return text + "there is no largest stable gain"
    if plant.law.integrates_only:
        return text + f"the largest stable gain is {limit:.6g} rad/s"
    return text + f"it is stable with all gains less than {limit / gain:.6g} times as large"
