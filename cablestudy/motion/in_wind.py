"""A suspension, and its loop, in one turbulent wind: the gusts, and what they move.

Winds that damp a suspension alike, or not at all, share its `Plant` and its `ClosedLoop`: its linear system, its loop
and the stable gains of this.
"""

from functools import cached_property

import numpy as np

from cablestudy.control.loop_state_space import ExactResponse
from cablestudy.motion.left_out_modes import LeftOutModes
from cablestudy.motion.tension_waves import change_by_waves
from cablestudy.motion.turbulence import Turbulence
from cablestudy.system.residues import delayed_response
from cablestudy.system.state_spaces import StateSpaces


class PlantInWind:
    """A `Plant` in the gusts of one wind.

    Parameters
    ----------
    plant : Plant
        In this wind, or in another one that damps it alike.
    airflow : Airflow or None
        The air about this case; None without wind, where there are poles and no gusts.
    """

    def __init__(self, plant, airflow):
        self.plant, self.airflow = plant, airflow

    @cached_property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self.airflow.gusts(self.plant.modes, self.plant.layout, self.plant.basis[1])

    @cached_property
    def gust_forces(self):
        """Forces on the coordinates by the inputs of the gusts, shape (m, i): none on the strokes of masses."""
        input_matrix = self.gusts.input_matrix
        return np.pad(input_matrix, ((0, len(self.plant.motion) - len(input_matrix)), (0, 0)))

    def delayed_response(self, loop, coarse=False):
        """Response of all outputs, as in `StateSpaces`, to the gusts with a loop that has a delay: `DelayedResponse`.

        It has the exact response over frequency, and the poles that make sharp peaks in this. Up to a limit of
        frequency these are poles with a Padé approximant of the delay. The limit is just above the frequency up to
        which the approximant is accurate (`Loop.delay_accurate_up_to`). Above it the winches hardly move: the poles are
        those with the winches at rest.

        Parameters
        ----------
        loop : Loop
            Loop about the `motion` of the plant.
        coarse : bool
            True to leave out the highest modes, by `coarse_space`: the change tells the error due to modes.
        """
        forces, actuators = self.gust_forces, self.plant.actuators
        if coarse:
            loop, forces = loop.within(self.plant.coarse_space), self.plant.coarse_space.T @ forces
        space = StateSpaces.of_one(loop.motion, loop, actuators)
        (approximate,) = space.residues(forces[None], self.direct[None])
        # the poles are those of a Padé approximant; above `delay_accurate_up_to` those with the winches at rest
        exact = ExactResponse(loop.motion, forces, loop, actuators, self.direct)
        return delayed_response(exact, approximate, exact.at_small_gain, loop.delay_accurate_up_to)

    @cached_property
    def direct(self):
        """Change of each output by the inputs of `Gusts.input_matrix` where nothing moves, shape (o, i).

        The tensions are the last outputs, two of each cable: each is less by the force of the gusts that reaches its
        end statically.
        """
        gusts = self.gusts
        direct = np.zeros((len(self.plant.outputs), gusts.input_matrix.shape[1]))
        cables = np.array([cable for group in gusts.strips for cable in group.cables], dtype=int)
        rows = self.plant.tension_rows.reshape(-1, 2)[cables].ravel()
        direct[rows, len(gusts.input_matrix) + np.arange(len(rows))] = -1.0
        return direct

    @cached_property
    def at_rest(self):
        """`Turbulence` with the winches at rest."""
        return Turbulence(self)

    @cached_property
    def change_by_waves(self):
        """`tension_waves.change_by_waves` of the outputs and of their rates, which all loops share, shape (2, o)."""
        return change_by_waves(self)

    @cached_property
    def movements_with_all_modes(self):
        """`BodiesOnAllModes.movements` in this wind, winches at rest."""
        return self.plant.all_modes.movements(self.at_rest)

    @cached_property
    def tensions_with_all_modes(self):
        """`BodiesOnAllModes.tensions` in this wind, winches at rest."""
        return self.plant.all_modes.tensions(self.at_rest)


class LoopInWind:
    """A `ClosedLoop` in the gusts of one wind.

    Parameters
    ----------
    closed_loop : ClosedLoop
    plant_in_wind : PlantInWind
        Its plant in this wind.
    """

    def __init__(self, closed_loop, plant_in_wind):
        self.closed_loop, self.plant_in_wind = closed_loop, plant_in_wind

    @property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self.plant_in_wind.gusts

    @cached_property
    def turbulence(self):
        """`Turbulence` with the loop, or with the winches at rest where there is none or its gain is zero."""
        loop = self.closed_loop.loop
        return Turbulence(self.plant_in_wind, loop) if loop and loop.gain else self.plant_in_wind.at_rest

    @cached_property
    def left_out_modes(self):
        """`LeftOutModes`, whose responses all exposures and mirrors share."""
        return LeftOutModes(self)
