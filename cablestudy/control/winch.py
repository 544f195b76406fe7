"""The winch loop: an integrator with a notch that moves a cable end to hold the gondola. See `control.plant`."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.control import stability
from cablestudy.control.gain_limits import UNDAMPED
from cablestudy.control.law import INTEGRATOR, Law
from cablestudy.control.margins import Margins
from cablestudy.control.notch import Notch
from cablestudy.control.plant import Plant
from cablestudy.errors import NoSolutionError
from cablestudy.system.superelement import Superelement

__all__ = ["Loop", "Notch", "Plant"]


@dataclass(frozen=True)
class Loop:
    """Gondola, cable and winch.

    Attributes
    ----------
    cable : Superelement
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
    gain : float
        k_i of C = (k_i/s) N(s); of another law than an integrator what it is multiplied by. [rad/s]
    notch : Notch or None
    damping : float
        Viscous, on the gondola. [N s/m]
    plant : Plant or None
        All that does not depend on the gain, where it is known already; another one is taken if it is not of this loop.
    law : Law
        What the winch does with what the notch passes.
    """

    cable: Superelement
    mass: float
    location: str = "ground"
    gain: float = 0.0
    notch: Notch | None = None
    damping: float = 0.0
    plant: Plant | None = field(default=None, repr=False, compare=False)
    law: Law = INTEGRATOR

    def __post_init__(self):
        names = "mass", "location", "notch", "damping", "law"
        plant, own = self.plant, {name: getattr(self, name) for name in names}
        if plant is None or plant.cable is not self.cable or own != {name: getattr(plant, name) for name in own}:
            object.__setattr__(self, "plant", Plant(self.cable, **own))

    @classmethod
    def of(cls, plant, gain):
        """The loop of a plant with a gain. [rad/s]"""
        return cls(plant.cable, plant.mass, plant.location, gain, plant.notch, plant.damping, plant, plant.law)

    @property
    def at_rest(self):
        """The same with the winch held."""
        return replace(self, gain=0.0)

    @cached_property
    def whole(self):
        """The same with every mode in its response."""
        return Loop.of(replace(self.plant, tolerance=0.0, known={}), self.gain) if self.plant.tolerance else self

    @property
    def excited(self):
        """See `Plant`, like all that follows."""
        return self.plant.excited

    @property
    def open_poles(self):
        return self.plant.open_poles

    @property
    def gondola_pole(self):
        return self.plant.gondola_pole

    def controller(self, s):
        return self.plant.controller(s)

    def unit_gain(self, s):
        return self.plant.unit_gain(s)

    def check_damped(self):
        self.plant.check_damped()

    def compliances(self, s):
        """x/F without and with control, each of shape (m,). [m/N]"""
        own, driven = self.plant.stiffness(s)
        alone = self.plant.alone(s, own)
        return 1 / alone, 1 / (alone + self.gain * self.controller(s) * driven)

    @property
    def closed_poles(self):
        """Poles with control, upper half plane and real axis, shape (k,). [rad/s]"""
        return self.plant.closed_poles(self.gain)

    @cached_property
    def observable_poles(self):
        """Poles of x/F without and with control that no zero cancels. [rad/s]"""
        found = self.plant.observable(self.open_poles)
        if self.gain:
            found = np.concatenate([found, self.plant.observable(self.closed_poles)])
        return found

    @property
    def integral_gain(self):
        """Of the controller. [rad/s]"""
        return self.gain * self.law.integral

    @property
    def largest_integral_gain(self):
        """With it, and proportional and derivative gain in proportion, the loop is on the limit of stability.

        None where it is always stable, or does not integrate. [rad/s]
        """
        limit = self.largest_gain
        return limit * self.law.integral if limit is not None and self.law.integral else None

    @property
    def largest_gain(self):
        """Below it the loop is stable; None when it always is. [rad/s]

        Raises
        ------
        NoSolutionError
            The gondola is not damped, or modes decide that are as good as undamped, or too many.
        """
        self.check_damped()
        return self.plant.largest_gain

    @property
    def gain_margin(self):
        """Largest stable gain over the gain; None when there is no limit. [dB]"""
        self.check_damped()
        limit = self.largest_gain if self.gain else None
        return None if limit is None else float(20 * np.log10(limit / self.gain))

    @property
    def phase_crossover(self):
        """Frequency at which the largest gain puts a pole on the imaginary axis; None when there is no limit. [Hz]"""
        return self.plant.limit_frequency if self.gain and self.largest_gain else None

    @cached_property
    def margins(self):
        """`Margins` of a stable loop, with every mode in its response.

        Raises
        ------
        NoSolutionError
            The gondola is not damped; of a peak: it is that of a mode as good as undamped.
        """
        self.check_damped()
        whole = self.whole.plant
        return Margins(
            lambda s: self.gain * whole.unit_matrix(whole.responding, s),
            self.whole.response_frequencies,
            self._check_peak,
        )

    @property
    def response_frequencies(self):
        """All decades, and frequencies beside the poles with and without control, shape (f,). [rad/s]"""
        plant = self.plant
        poles = plant.open_poles, plant.responding.poles, self.closed_poles, [-self.gain]
        return plant.frequencies(np.concatenate(poles))

    def _check_peak(self, omega):
        """Refuse a peak of the sensitivity [rad/s] of a mode as good as undamped."""
        poles = np.concatenate([self.closed_poles, self.plant.excited.poles])
        pole = complex(poles[np.argmin(np.abs(poles - 1j * omega))])
        if -pole.real < UNDAMPED * abs(pole):
            raise stability.undamped(pole, max(-pole.real / abs(pole), 0.0), "no peak of the sensitivity: ")

    @property
    def stable(self):
        """Whether no motion grows."""
        return not self.gain or self.plant.stable(self.gain)

    def check_stable(self):
        """Refuse an unstable loop.

        Raises
        ------
        NoSolutionError
            With the motion that grows and the largest stable gain; or the gondola is not damped.
        """
        self.check_damped()
        if not self.stable:
            raise NoSolutionError(stability.complaint(self.plant, self.gain))

    def with_margins(self, margin, peak=np.inf):
        """The same loop with the largest gain that leaves a gain margin and bounds the peak of the sensitivity.

        Parameters
        ----------
        margin : float
            Of gain. [dB]
        peak : float
            Above 1. [-]

        Returns
        -------
        Loop

        Raises
        ------
        NoSolutionError
            Every gain satisfies both; or a mode as good as undamped decides.
        """
        limit = self.largest_gain
        gain = stability.sensitive_gain(self.plant, peak, limit and limit / 10 ** (margin / 20))
        if gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(self, gain=gain)
