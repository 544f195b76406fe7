"""Variances of the motion in turbulence, with the loop of the winches closed or with the winches at rest.

Variances of displacements, rates and tensions hold for all exposures and mirrors, and with the winches at rest for all
loops. Their errors by modes are estimated from the change to a model with fewer modes, `Plant.coarse_space`.
"""

from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from cablestudy.study.tolerances import STUDY
from cablestudy.wind.integrals import Integrals
from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import smooth_on, with_turns

TURN = 2 * np.pi
OWN = {"value": np.ones_like, "rate": lambda frequency: (TURN * frequency) ** 2}  # weights of displacements and rates


class Turbulence:
    """Variances of one plant in turbulence, with a loop or without.

    Parameters
    ----------
    plant : Plant
    loop : Loop, optional
        Of this motion, with a gain.
    """

    def __init__(self, plant, loop=None):
        self.plant, self.loop = plant, loop

    @cached_property
    def residues(self):
        """`Residues` from gusts to outputs, see `Plant.residues_of`."""
        return self.plant.residues_of(self.plant.motion, self.loop)

    def _coarse_residues(self, speeds=False):
        """`Residues` with fewer modes; with `speeds` to the speeds of the winches."""
        plant, loop = self.plant, self.loop
        loop = loop and loop.within(plant.coarse_space, plant.coarse_motion)
        return plant.residues_of(plant.coarse_motion, loop, plant.coarse_space, speeds)

    @cached_property
    def range(self):
        """Lowest and highest frequency of the integrals. [Hz]"""
        wind, lowest = self.plant.scene.wind, self.plant.modes.frequency[0]
        corner = wind.speed / wind.length_scale
        slow = [corner, lowest] + ([] if self.loop is None else [self.loop.gain / TURN])
        corners = [[actuator.omega, actuator.corner] for actuator in self.plant.actuators]
        corners = np.concatenate([*corners, [] if self.loop is None else self.loop.corners])
        highest = STUDY.highest_frequency * max(corner, lowest)
        highest = max(highest, STUDY.beyond_corners * corners.max(initial=0.0) / TURN)
        return STUDY.lowest_frequency * min(slow), highest

    @cached_property
    def _coarse(self):
        """`residues` with fewer modes, computed once."""
        return self._coarse_residues()

    def _integrals_of(self, weights, jumps=()):
        """`Integrals` over frequency with weights: dict of functions of frequency [Hz] with `jumps` at some [Hz]."""
        gusts, (low, high) = self.plant.gusts, self.range
        edges = with_turns(gusts.edges(low, high), self.loop.law.delay if self.loop else 0.0)
        edges = np.union1d(edges, [jump for jump in jumps if low < jump < high])
        edges = edges if weights is OWN else smooth_on(edges, weights.values())  # panels resolve any power of frequency
        return Integrals.on(edges, gusts, weights, self.least)

    @property
    def least(self):
        """Damping ratio up to which a motion counts as not damped. [-]"""
        return WIND.undamped_along_cables if self.plant.gusts.strips else WIND.undamped

    @cached_property
    def _integrals(self):
        """`Integrals` of displacements and rates."""
        return self._integrals_of(OWN)

    @cached_property
    def variances(self):
        """Variances of the outputs and of their rates, and their errors; see `_with_errors`."""
        return self._with_errors(self._integrals)

    def seen(self, weights):
        """Variances of the outputs with weights: dict of functions of frequency [Hz]; see `_with_errors`."""
        return self._with_errors(self._integrals_of(weights))

    def variances_of(self, residues, weights):
        """Variances of the outputs of other `Residues` by the same gusts, shape (w, o); weights as of `seen`."""
        return self._integrals_of(weights).variances(residues)

    def below(self, limits):
        """Variances of the outputs by frequencies below some limits [Hz], shape (l, o)."""
        weights = {limit: partial(np.greater, limit) for limit in limits}
        return self._integrals_of(weights, limits).variances(self.residues)

    def _with_errors(self, integrals):
        """Variances of the outputs, their errors by modes and those by a delay, three arrays of shape (w, o).

        Errors by modes are not numbers where they are not computed.
        """
        value = integrals.variances(self.residues)
        if not self._estimates:
            return value, np.full(value.shape, np.nan), self._delay_error(integrals)
        return value, np.abs(value - integrals.variances(self._coarse)), self._delay_error(integrals)

    @property
    def _estimates(self):
        """True if errors by modes are computed: all modes of an exact choice of elements state no error."""
        return self.plant.model is None or self.plant.responses

    def _delay_error(self, integrals):
        """Error of the variances by poles that lack the right delay, shape (w, o) or (w, 1)."""
        if self.loop is None or not self.loop.law.delay:
            return np.zeros((len(integrals.weights), 1))
        beyond = TURN * integrals.panels.frequency > self.loop.right_up_to
        weights = {name: weight * beyond for name, weight in integrals.weights.items()}
        beyond = replace(integrals, weights=weights).variances(self.plant.at_rest.residues)
        return STUDY.delayed_error * self.loop.gain_beyond * beyond

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, their errors by modes, both of shape (2, i).

        And of each winch the pole that nothing damps, see `Integrals.undamped`.
        """
        residues = self.plant.residues_of(self.plant.motion, self.loop, speeds=True)
        value, coarse = self._integrals.variances(residues), np.nan
        if self._estimates:
            coarse = self._integrals.variances(self._coarse_residues(speeds=True))
        return value, np.abs(value - coarse), self._integrals.undamped(residues, value[0], np.ones(value.shape[1]))

    def undamped(self, stiffness):
        """Poles of the displacements that nothing damps, see `Integrals.undamped`."""
        return self._integrals.undamped(self.residues, self.variances[0][0], stiffness)
