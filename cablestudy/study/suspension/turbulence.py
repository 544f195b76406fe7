"""Variances of what turbulence moves, with the loop of the winches closed or with the winches at rest.

Those of displacements, rates and tensions are the same for all exposures and mirrors, and with the winches at rest for
all loops. What the highest modes add to them is the change to a model with fewer modes, `Plant.coarse_space`.
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
    """One motion in turbulence.

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
        """`Plant.residues_of` it."""
        return self.plant.residues_of(self.plant.motion, self.loop)

    def _coarse_residues(self, speeds=False):
        """`Plant.residues_of` the motion with fewer modes."""
        plant, loop = self.plant, self.loop
        loop = loop and loop.within(plant.coarse_space, plant.coarse_motion)
        return plant.residues_of(plant.coarse_motion, loop, plant.coarse_space, speeds)

    @cached_property
    def range(self):
        """Lowest and highest frequency of the integrals. [Hz]"""
        wind, lowest = self.plant.scene.wind, self.plant.modes.frequency[0]
        corner = wind.speed / wind.length_scale
        slow = [corner, lowest] + ([] if self.loop is None else [self.loop.gain / TURN])
        return STUDY.lowest_frequency * min(slow), STUDY.highest_frequency * max(corner, lowest)

    @cached_property
    def _coarse(self):
        """`residues` with fewer modes."""
        return self._coarse_residues()

    def _integrals_of(self, weights, jumps=()):
        """`Integrals` with weights that are functions of frequency [Hz], by their names, and where these jump [Hz]."""
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
        return self._integrals_of(OWN)

    @cached_property
    def variances(self):
        """Of the outputs and of their rates; see `_found`."""
        return self._found(self._integrals)

    def seen(self, weights):
        """Variances of the outputs with weights that are functions of frequency [Hz], by their names; see `_found`."""
        return self._found(self._integrals_of(weights))

    def variances_of(self, residues, weights):
        """Variances of the outputs of other `Residues` by the same gusts, shape (w, o); weights as of `seen`."""
        return self._integrals_of(weights).variances(residues)

    def below(self, limits):
        """Variances of the outputs by frequencies below some limits [Hz], shape (l, o)."""
        return self._integrals_of({limit: partial(np.greater, limit) for limit in limits}, limits).variances(
            self.residues
        )

    def _found(self, integrals):
        """Variances, what the highest modes add to them, not a number where it is not computed, and error by a delay.

        All of shape (w, o).
        """
        whole = integrals.variances(self.residues)
        if not self._estimates:
            return whole, np.full(whole.shape, np.nan), self._late_error(integrals)
        return whole, np.abs(whole - integrals.variances(self._coarse)), self._late_error(integrals)

    @property
    def _estimates(self):
        """Whether what the highest modes add is computed: all modes of an exact choice of elements state no error."""
        return self.plant.model is None or self.plant.responses

    def _late_error(self, integrals):
        """Error of the variances by poles that lack the right delay, shape (w, o) or 0."""
        if self.loop is None or not self.loop.law.delay:
            return np.zeros((len(integrals.weights), 1))
        late = TURN * integrals.panels.frequency > self.loop.right_up_to
        late = replace(integrals, weights={name: weight * late for name, weight in integrals.weights.items()})
        return STUDY.delayed_error * self.loop.gain_beyond * late.variances(self.plant.at_rest.residues)

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, what the highest modes add, both of shape (2, i).

        And of each winch the pole that nothing damps, see `Integrals.undamped`.
        """
        found = self.plant.residues_of(self.plant.motion, self.loop, speeds=True)
        whole, coarse = self._integrals.variances(found), np.nan
        if self._estimates:
            coarse = self._integrals.variances(self._coarse_residues(speeds=True))
        return whole, np.abs(whole - coarse), self._integrals.undamped(found, whole[0], np.ones(whole.shape[1]))

    def undamped(self, stiffness):
        """Poles of the displacements that nothing damps, see `Integrals.undamped`."""
        return self._integrals.undamped(self.residues, self.variances[0][0], stiffness)
