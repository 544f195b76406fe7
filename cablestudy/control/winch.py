"""The winch loop: an integrator with a notch that moves a cable end to hold the gondola.

With x the gondola's place, u the winch's and F a force on the gondola:

    (M s^2 + k_xx) x + k_xu u = F,    u = -C(s) x on the ground,  u = +C(s) x on the gondola

C = (gain/s) N(s); all that does not depend on the gain is the `Plant`'s, and shared by loops with different ones.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from cablestudy.control import plant as plants
from cablestudy.control.ends import EndModel
from cablestudy.control.nyquist import Passages
from cablestudy.control.plant import NEAR, Plant
from cablestudy.control.roots import between
from cablestudy.control.together import Notch, Together, zeros_of
from cablestudy.errors import NoSolutionError

__all__ = ["NEAR", "Loop", "Notch", "Passages", "prepare"]
FOLLOWED = 300  # steps at most in which a pole is followed over the gain
REMEMBERED, ARRAYS = 5000, 12  # frequencies of an array, and arrays, whose response is kept for the next wind
ALIKE = 1e-9  # relative distance of poles that are one
APART = 0.5  # of the half-width: distance of two poles up to which a grid around the one serves the other
MOVED = 0.03  # of the gain that a passage stands for: below it none of the poles is far from an open one


@dataclass(frozen=True)
class Loop:
    """Gondola, cable and winch.

    Attributes
    ----------
    cable : EndModel
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
    gain : float
        k_i of C = (k_i/s) N(s). [rad/s]
    notch : Notch or None
    undamped : tuple of 2 ndarray or None
        `Plant.coupled`, where it is known already.
    plant : Plant or None
        All that does not depend on the gain, where it is known already; another one is taken if it is not of this loop.
    """

    cable: EndModel
    mass: float
    location: str = "ground"
    gain: float = 0.0
    notch: Notch | None = None
    undamped: tuple | None = None
    plant: Plant | None = field(default=None, repr=False, compare=False)

    def __post_init__(self):
        plant, own = self.plant, (self.mass, self.location, self.notch)
        if plant is None or plant.cable is not self.cable or (plant.mass, plant.location, plant.notch) != own:
            plant = Plant(self.cable, *own, self.undamped)
            object.__setattr__(self, "plant", plant)

    @property
    def at_rest(self):
        """The same with the winch held."""
        return replace(self, gain=0.0)

    @property
    def felt(self):
        """See `Plant`, like all that follows."""
        return self.plant.felt

    @property
    def coupled(self):
        return self.plant.coupled

    @property
    def open_poles(self):
        return self.plant.open_poles

    @property
    def gondola_pole(self):
        return self.plant.gondola_pole

    @property
    def passages(self):
        return self.plant.passages

    @property
    def largest_gain(self):
        return self.passages.largest_gain

    def stiffness(self, s):
        return self.plant.stiffness(s)

    def controller(self, s):
        return self.plant.controller(s)

    def unit_gain(self, s):
        return self.plant.unit_gain(s)

    def check_damped(self):
        self.plant.check_damped()

    def compliances(self, s):
        """x/F without and with control, each of shape (m,). [m/N]"""
        own, driven = self.stiffness(s)
        alone = self.mass * s**2 + own
        return 1 / alone, 1 / (alone + self.gain * self.controller(s) * driven)

    def squares(self, frequency):
        """|x/F|^2 without and with control at frequencies [Hz], each of shape (m,). [m^2/N^2]"""
        few, key = len(frequency) <= REMEMBERED, frequency.tobytes()
        if key not in self._squares:
            without, controlled = self.compliances(2j * np.pi * frequency)
            found = tuple(value.real**2 + value.imag**2 for value in (without, controlled))
            if not few:
                return found
            while len(self._squares) >= ARRAYS:
                del self._squares[next(iter(self._squares))]
            self._squares[key] = found
        return self._squares[key]

    @cached_property
    def _squares(self):
        return {}

    @cached_property
    def closed_poles(self):
        """Poles that the open ones and the passages lead to, for laying a grid; not all of them, not for counting."""
        return find_closed_poles([self])[0]

    @cached_property
    def seen_poles(self):
        """Poles without control that no pole of the cable cancels, and those with control apart from them. [rad/s]"""
        seen = self.plant.seen_poles
        if not self.gain:
            return seen
        moved = self.plant.visible(self.closed_poles)
        width = np.minimum(np.abs(moved.real)[:, None], np.abs(seen.real))
        return np.concatenate([seen, moved[(np.abs(moved[:, None] - seen) > APART * width).all(axis=1)]])

    def _growing(self):
        """Poles to the right, each followed from where it passes the imaginary axis. [rad/s]"""
        passed = self.passages.for_gain(self.gain)
        out = (passed.turn > 0) & (passed.depth * self.gain > 1)
        if not out.any():  # one of the passages was missed
            return self.closed_poles[self.closed_poles.real > 0]
        s, begin = 1j * passed.omega[out], 1 / passed.depth[out]
        steps = int(min(FOLLOWED, 2 + np.log(self.gain / begin.min()) / np.log(1.25)))
        for part in np.linspace(0, 1, steps + 1)[1:]:
            found = self.plant.zeros(begin ** (1 - part) * self.gain**part, s)
            s = np.where(np.isfinite(found), found, s)
        # should one be lost on the way, it is looked for about there
        about = np.outer(np.abs(s), np.outer(np.geomspace(0.1, 10, 9), np.exp(1j * np.linspace(0.1, 1.5, 6))).ravel())
        final = self.plant.zeros(self.gain, np.concatenate([s, about.ravel()]))
        every = np.concatenate([final[np.isfinite(final)], self.closed_poles])
        return every[every.real > 0]

    def _where(self, size):
        """Zeros of a real function of the loop gain over frequency. [rad/s]"""

        def zeros(chosen):
            curve = self.plant.whole_curve
            where = np.flatnonzero(chosen(size(self.gain * curve.value)))
            low, high = curve.omega[where], curve.omega[where + 1]
            return between(lambda _, omega: size(self.gain * self.unit_gain(1j * omega)), low, high)

        return zeros

    @property
    def gain_margin(self):
        """Largest stable gain over the gain; None when there is no limit. [dB]"""
        limit = self.largest_gain
        return None if limit is None or not self.gain else float(20 * np.log10(limit / self.gain))

    @property
    def phase_margin(self):
        """Least angle between L and -1 where |L| = 1, over all such places; None when there is none. [deg]"""
        omega = self._where(lambda loop: np.abs(loop) - 1)(lambda size: size[:-1] * size[1:] < 0)
        if not len(omega):
            return None
        angle = np.degrees(np.angle(-self.unit_gain(1j * omega)))
        return float(np.abs(angle).min())

    @property
    def bandwidth(self):
        """Where the closed loop L/(1 + L) first falls to 1/sqrt(2); None when it never does. [Hz]"""
        excess = self._where(lambda loop: np.abs(loop / (1 + loop)) - np.sqrt(0.5))
        omega = excess(lambda value: _first((value[:-1] > 0) & (value[1:] <= 0)))
        return float(omega[0] / (2 * np.pi)) if len(omega) else None

    @property
    def stable(self):
        """Whether no pole lies to the right."""
        return not self.gain or not self.passages.unstable_poles(self.gain)

    def check_stable(self):
        """Refuse an unstable loop.

        Raises
        ------
        NoSolutionError
            With an unstable pole and the largest stable gain; or the gondola is not damped.
        """
        self.check_damped()
        if self.stable:
            return
        right = self._growing()
        pole = ""
        if len(right):
            worst = right[np.argmax(right.real)]
            pole = f": a motion of {worst.imag / (2 * np.pi):.4g} Hz grows by {worst.real:.3g} 1/s"
        raise NoSolutionError(
            f"unstable loop at a gain of {self.gain:.6g} rad/s{pole}; "
            f"the largest stable gain is {self.largest_gain:.6g} rad/s"
        )

    def with_margin(self, margin):
        """The same loop with the gain that leaves a margin.

        Parameters
        ----------
        margin : float
            Of gain. [dB]

        Returns
        -------
        Loop

        Raises
        ------
        NoSolutionError
            No gain makes this loop unstable, so that none follows from a margin.
        """
        if self.largest_gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(self, gain=self.largest_gain / 10 ** (margin / 20))


def _first(chosen):
    """Only the first of them."""
    return chosen & (np.cumsum(chosen) == 1)


def find_closed_poles(loops):
    """`Loop.closed_poles` of many loops.

    Parameters
    ----------
    loops : list of Loop
        Their plants damped.

    Returns
    -------
    list of ndarray
    """
    begin = []
    for loop in loops:
        passed = loop.passages.for_gain(loop.gain)
        moved = passed.omega[passed.depth * loop.gain > MOVED]
        begin.append(np.concatenate([loop.plant.near(loop.plant.seen_poles), 1j * moved]))
    which = np.repeat(np.arange(len(loops)), [len(places) for places in begin])
    gain = np.array([loop.gain for loop in loops])[which]
    found = zeros_of(Together([loop.plant for loop in loops]), which, gain, np.concatenate(begin))
    ends = np.searchsorted(which, np.arange(len(loops) + 1))
    return [_each_once(found[a:b]) for a, b in pairwise(ends)]


def _each_once(poles):
    """Poles of the upper half plane, those that two iterations led to once."""
    poles = np.sort_complex(poles[np.isfinite(poles) & (poles.imag > 0)])
    return poles[np.concatenate([[True], np.abs(np.diff(poles)) > ALIKE * np.abs(poles[1:])])] if len(poles) else poles


def prepare(loops):
    """Let many loops know their poles and passages, by one iteration for all.

    A loop that has none says why when it is asked.

    Parameters
    ----------
    loops : list of Loop
    """
    plants.prepare(list({id(loop.plant): loop.plant for loop in loops}.values()))
    waiting = [loop for loop in loops if loop.gain and "passages" in loop.plant.__dict__]
    waiting = [loop for loop in waiting if "closed_poles" not in loop.__dict__]
    if waiting:
        for loop, poles in zip(waiting, find_closed_poles(waiting), strict=True):
            loop.__dict__["closed_poles"] = poles
