"""The winch loop of a scene of one cable, with what independent computations need of it."""

from functools import cached_property

import numpy as np

from cablestudy.control.law import INTEGRATOR
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.notch import NotchedLaw
from cablestudy.control.stable_gains import StableGains
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.scene.one_cable import as_suspension
from cablestudy.study.one_cable.case import CableCase
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.linear import LinearSystem
from cablestudy.system.superelement import Superelement


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
        """The same loop with another gain of its integrator. [rad/s]"""
        winch = self.scene.winch
        winch = winch.model_copy(update={"controller": winch.controller.model_copy(update={"gain": gain})})
        scene, wind = self.scene.model_copy(update={"winch": winch}), self.analysis
        known = wind.without_wind, wind.equilibrium, wind.airflow, wind.model, wind.plants_and_loops
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
        (element,) = self.closed_loop.stability.driven.loop_gain.elements
        size = np.abs(element.coupling[:, [0, 3]]).max(axis=1, initial=0.0)
        return element.select(size > 1e-9 * size.max(initial=0.0))

    @property
    def largest_gain(self):
        """[rad/s], or None."""
        return self.closed_loop.stability.largest_gain

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


def moved_by_winch(cable, mass, location, s):
    """Displacement of a gondola that the winch corrects over that of the winch, by the stiffness of the ends, (f,)."""
    own, ground = cable.dynamic_stiffness(s, [3], [3, 0])[:, 0].T
    return (own if location == "gondola" else -ground) / (mass * s**2 + own)


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
