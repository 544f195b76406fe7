"""The winch loop of a scene of one cable, with what independent computations need of it."""

from functools import cached_property

import numpy as np
from cables import poles_between_fixed_ends

from cablestudy.control.gain_limits import StableGains
from cablestudy.control.law import INTEGRATOR
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.margins_grid import frequencies
from cablestudy.control.notch import NotchedLaw
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.scene.one_cable import as_suspension
from cablestudy.study.one_cable.case import CableCase
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.linear import LinearSystem
from cablestudy.system.superelement import Superelement

EVERY = 250  # modes of a model, of bars all


class OneLoop:
    """The loop of a scene; loops that differ in the gain alone share its models.

    Attributes
    ----------
    mass : float
        Of the gondola. [kg]
    location : str
        Of the winch.
    """

    def __init__(self, scene, in_wind=None):
        self.scene, self.case = scene, CableCase(scene)
        self.mass, self.location = scene.gondola.mass, scene.winch.location
        self.analysis = in_wind or self.case.analysis

    def with_gain(self, gain):
        """The same loop with another gain [rad/s], and the other gains of a law in proportion."""
        own = self.scene.winch.controller
        scaled = {name: getattr(own, name) * gain / own.gain for name in ("proportional_gain", "derivative_gain")
                  if getattr(own, name)}  # fmt: skip
        return self._with(lambda table: table.model_copy(update={"gain": gain} | scaled))

    def with_margins(self, margin, peak=np.inf):
        """The same loop with the largest gain that leaves a gain margin [dB] and bounds the sensitivity."""
        sensitivity = min(peak, 1e9)
        return self._with(
            lambda table: type(table).model_validate(
                {**table.model_dump(), "gain": {"auto": {"gain_margin": margin, "sensitivity": sensitivity}}}
            )
        )

    def _with(self, changed):
        winch = self.scene.winch
        winch = winch.model_copy(update={"controller": changed(winch.controller)})
        scene, own = self.scene.model_copy(update={"winch": winch}), self.analysis
        known = own.without_wind, own.equilibrium, own.airflow, own.model, own.plants_and_loops
        return OneLoop(scene, DynamicAnalysis(as_suspension(scene), *known))

    @property
    def closed_loop(self):
        """`ClosedLoop`, stable or not with the loop."""
        return self.analysis.loop_for_margins

    @property
    def gain(self):
        """[rad/s]"""
        return self.closed_loop.loop.gain

    @property
    def damping(self):
        """Of the gondola by the air. [N s/m]"""
        return self.case.gondola_air_damping

    @property
    def notch(self):
        """`Notch` or None."""
        return self.closed_loop.body.notches[0]

    @cached_property
    def cable(self):
        """`Superelement` with the modes that are judged, as far as gondola or winch move them."""
        return self._element.select(self._moved)

    @property
    def unmoved_poles(self):
        """Of the others. [rad/s]"""
        return poles_between_fixed_ends(self._element.select(~self._moved))

    @property
    def _element(self):
        (found,) = self.closed_loop.stability.driven.loop_gain.elements
        return found

    @property
    def _moved(self):
        size = np.abs(self._element.coupling[:, [0, 3]]).max(axis=1, initial=0.0)
        return size > 1e-9 * size.max(initial=0.0)

    @property
    def largest_gain(self):
        """[rad/s], or None."""
        return self.closed_loop.stability.largest_gain

    @property
    def gain_margin(self):
        """[dB], or None."""
        return self.analysis.gain_margin[0]

    @property
    def margins(self):
        """`Margins`."""
        return self.closed_loop.stability.margins

    @property
    def stable(self):
        """Whether nothing grows."""
        return self.closed_loop.stability.stable

    def check_stable(self):
        """NoSolutionError where something grows."""
        self.analysis.check_stable()

    def unstable(self, gain):
        """How many poles with a gain [rad/s] are to the right."""
        return self.with_gain(float(gain)).closed_loop.stability.gains.unstable(float(gain))

    def unit_gain(self, s):
        """L over the gain, shape (f,)."""
        return self.closed_loop.stability.gains.loop_gain(s)[:, 0, 0]

    @property
    def open_poles(self):
        """With the winch at rest, upper half plane and real axis. [rad/s]"""
        return self.closed_loop.open_poles

    def closed_poles(self, gain):
        """The same with a gain. [rad/s]"""
        return self.with_gain(float(gain)).analysis.closed_loop_of(EVERY).loop.poles


def moved_by_winch(cable, mass, location, s):
    """Displacement of a gondola that the winch corrects over that of the winch, by the stiffness of the ends, (f,)."""
    own, ground = cable.dynamic_stiffness(s, [3], [3, 0])[:, 0].T
    return (own if location == "gondola" else -ground) / (mass * s**2 + own)


def encirclements(loop, gain):
    """Number of unstable poles by the argument principle.

    1 + L has its only pole that is not stable in s = 0, where L is about gain/s. The contour passes it on the right,
    where the argument falls by pi; along either half of the imaginary axis it grows by the same angle. So
    -2 pi Z = 2 angle - pi.
    """
    poles = np.concatenate([loop.open_poles, poles_between_fixed_ends(loop.cable)])
    omega = frequencies(poles[poles.imag >= 0], (loop.notch,))
    value = 1 + gain * loop.unit_gain(1j * omega)
    for _ in range(12):
        coarse = np.abs(np.angle(value[1:] / value[:-1])) > 0.3
        if not coarse.any():
            break
        omega = np.sort(np.concatenate([omega, (omega[1:] + omega[:-1])[coarse] / 2]))
        value = 1 + gain * loop.unit_gain(1j * omega)
    angle = np.angle(value[1:] / value[:-1]).sum()
    # from the lowest frequency down to zero, and from the highest up to infinity
    angle += np.angle(value[0] / -1j) - np.angle(value[-1])
    return round(0.5 - angle / np.pi)


def spring_loop(mass, stiffness, location="ground", notch=None, time=0.0, law=INTEGRATOR):
    """`StableGains` of a gondola on one spring, damped by Kelvin and Voigt's law, without any mode."""
    cable = spring(stiffness, time)
    bodies, unit = LinearSystem(np.array([[mass]]), np.zeros((1, 1)), np.zeros((1, 1))), np.eye(6)
    winch, sign = (unit[:, 0], 1.0) if location == "ground" else (unit[:, 3], -1.0)
    places = unit[None, :, [3]], winch[None, :, None], np.zeros((1, 1)), np.ones((1, 1)), np.array([[sign]])
    loop_gain = LoopGain(bodies, [cable], *places, NotchedLaw.of(law, [notch]))
    poles = np.roots([mass, stiffness * time, stiffness]).astype(complex)
    return StableGains(loop_gain, poles[poles.imag >= 0], (notch,), law)


def spring(stiffness, time=0.0):
    """`Superelement` of a spring along x without mass, damped by Kelvin and Voigt's law."""
    ends = np.zeros((6, 6))
    ends[np.ix_([0, 3], [0, 3])] = stiffness * np.array([[1, -1], [-1, 1]])
    strain = Strain("kelvin_voigt", time, np.zeros((0, 0)), np.zeros((0, 6)), ends) if time else None
    return Superelement(np.zeros(0), np.zeros((0, 6)), np.zeros(0), ends, np.zeros((6, 6)), strain)
