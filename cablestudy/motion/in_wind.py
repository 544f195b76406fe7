"""A suspension, and its loop, in one turbulent wind: the gusts, and what they move.

Winds that damp a suspension alike, or not at all, share everything else: its linear system, its loop and the stable
gains of this.
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
    """A `Plant` in one wind. Attributes that are not defined here are those of the plant.

    Parameters
    ----------
    plant : Plant
        In this wind, or in another one that damps it alike.
    scene : SuspensionScene
        Has the wind.
    airflow : Airflow or None
        The air about this case; None without wind.
    """

    def __init__(self, plant, scene, airflow):
        self.linear, self.scene, self.airflow, self.drag = plant, scene, airflow, airflow and airflow.drag

    def __getattr__(self, name):
        return getattr(self.linear, name)

    @cached_property
    def gust_forces(self):
        """Forces on the coordinates by the inputs of the gusts, shape (m, i): none on the strokes of masses."""
        input_matrix = self.gusts.input_matrix
        return np.pad(input_matrix, ((0, len(self.motion) - len(input_matrix)), (0, 0)))

    def delayed_response(self, loop, coarse=False):
        """Response of all outputs, as in `StateSpaces`, to the gusts with a loop that has a delay: `DelayedResponse`.

        It has the exact response over frequency, and the poles that make sharp peaks in this. Up to a limit of
        frequency these are poles with a Padé approximant of the delay. The limit is just above the frequency up to
        which the approximant is accurate (`Loop.delay_accurate_up_to`). Above it the winches hardly move: the poles are
        those with the winches at rest.

        Parameters
        ----------
        loop : Loop
            Loop about the `motion` of this plant.
        coarse : bool
            True to leave out the highest modes, by `coarse_space`: the change tells the error due to modes.
        """
        forces = self.gust_forces
        if coarse:
            loop, forces = loop.within(self.coarse_space), self.coarse_space.T @ forces
        space = StateSpaces.of_one(loop.motion, loop, self.actuators)
        (approximate,) = space.residues(forces[None], self.direct[None])
        # the poles are those of a Padé approximant; above `delay_accurate_up_to` those with the winches at rest
        exact = ExactResponse(loop.motion, forces, loop, self.actuators, self.direct)
        return delayed_response(exact, approximate, exact.at_small_gain, loop.delay_accurate_up_to)

    @cached_property
    def direct(self):
        """Change of each output by the inputs of `Gusts.input_matrix` where nothing moves, shape (o, i).

        The tensions are the last outputs, two of each cable: each is less by the force of the gusts that reaches its
        end statically.
        """
        gusts = self.gusts
        direct = np.zeros((len(self.outputs), gusts.input_matrix.shape[1]))
        cables = np.array([cable for group in gusts.strips for cable in group.cables], dtype=int)
        rows = self.tension_rows.reshape(-1, 2)[cables].ravel()
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
    def gusts(self):
        """`Gusts` on the coordinates; None without wind."""
        return self.airflow and self.airflow.gusts(self.modes, self.layout, self.basis[1])

    @cached_property
    def movements_with_all_modes(self):
        """`BodiesOnAllModes.movements` in this wind, winches at rest."""
        return self.all_modes.movements(self.at_rest)

    @cached_property
    def tensions_with_all_modes(self):
        """`BodiesOnAllModes.tensions` in this wind, winches at rest."""
        return self.all_modes.tensions(self.at_rest)


class LoopInWind:
    """A `ClosedLoop` in one wind. Attributes that are not defined here are those of the loop.

    Parameters
    ----------
    closed_loop : ClosedLoop
    plant : PlantInWind
        Its plant in this wind.
    """

    def __init__(self, closed_loop, plant):
        self.linear, self.plant, self.scene = closed_loop, plant, plant.scene

    def __getattr__(self, name):
        return getattr(self.linear, name)

    @property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self.plant.gusts

    @cached_property
    def turbulence(self):
        """`Turbulence` with the loop, or with the winches at rest where there is none or its gain is zero."""
        loop = self.linear.loop
        return Turbulence(self.plant, loop) if loop and loop.gain else self.plant.at_rest

    @cached_property
    def left_out_modes(self):
        """`LeftOutModes`, whose responses all exposures and mirrors share."""
        return LeftOutModes(self)

    @cached_property
    def with_critical_modes(self):
        """`ClosedLoop.with_critical_modes` in this wind; itself where that is the same."""
        return self._in_this_wind(self.linear.with_critical_modes)

    @cached_property
    def with_all_modes(self):
        """`ClosedLoop.with_all_modes` in this wind; itself where that is the same."""
        return self._in_this_wind(self.linear.with_all_modes)

    @cached_property
    def with_twice_the_modes(self):
        """`ClosedLoop.with_twice_the_modes` in this wind; None where there is none."""
        return self._in_this_wind(self.linear.with_twice_the_modes)

    def _in_this_wind(self, closed_loop):
        """Another `ClosedLoop` in this wind; None of none, and itself of its own."""
        if closed_loop is None or closed_loop is self.linear:
            return closed_loop and self
        return LoopInWind(closed_loop, PlantInWind(closed_loop.plant, self.scene, self.plant.airflow))
