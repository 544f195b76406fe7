"""Models of a suspension in motion, with some number of modes: modes, loop and gusts, which equal cases share."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.errors import result_of
from cablestudy.motion.closed_loop import ClosedLoop
from cablestudy.motion.in_wind import LoopInWind, PlantInWind
from cablestudy.motion.model_sizes import ModelSizes
from cablestudy.motion.plant import Plant
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.system.mode_search import shaping_modes


@dataclass(eq=False)
class MotionModels:
    """One case of a study in motion: its models with different numbers of modes, which equal cases share.

    Attributes
    ----------
    scene : SuspensionScene
    without_wind : Equilibrium
        Equilibrium without wind.
    equilibrium : Equilibrium
        Equilibrium in the mean wind, or in the steady wind of its load case.
    airflow : Airflow or None
        None without turbulent wind.
    model : FixedModel or None
        Elements that the scene states; None where the scene states an accuracy.
    plants_and_loops : dict
        To be filled; cases of this equilibrium whose winds damp it alike share it. Keys begin with what they are of:
        ("plant", ...) -> `Plant`; ("closed loop", ...) -> `ClosedLoop`; ("in wind", one of these, ...) -> it in a
        wind; ("loops", winches) -> `Plant.loops`; ("number", tables) -> number of winches and actuators, of the
        control, or of the wind, by which other keys name them.
    cables : Cables, optional
        Cables of this equilibrium, with damping.
    modes : dict
        Number of modes -> `CoupledModes` of this equilibrium, or the error that says why there are none; to be filled,
        by `solve_modes` for many cases at once. The key (number, "shaped") is that of modes for mid-spans, `shaped` of
        `Search`. Cases of this equilibrium in other winds share the dict too.
    midspans, points : bool
        As of `Plant`: whether outputs have the mid-spans of cables; whether free points are as accurate as bodies.
    fewest_modes : int
        Least number of modes of a model.
    """

    scene: object
    without_wind: object
    equilibrium: object
    airflow: object
    model: object
    plants_and_loops: dict
    cables: object = None
    modes: dict = field(default_factory=dict)
    midspans: bool = False
    points: bool = False
    fewest_modes: int = 0

    @cached_property
    def sizes(self):
        """`ModelSizes`: numbers of modes of its models, and how accurate these are."""
        in_planes, on_cables = bool(self.cables and self.cables.planes), bool(self.airflow and self.airflow.on_cables)
        arguments = self.scene, self.equilibrium.suspension, self.model is not None, in_planes, on_cables
        return ModelSizes(*arguments, self.fewest_modes)

    def closed_loop_of(self, count, responses=False, computed=0):
        """Build the `ClosedLoop` with a model of the lowest modes of the suspension, or take that of an equal case.

        It may be unstable. The dict `plants_and_loops` keeps plant and loop for equal cases.

        Parameters
        ----------
        count : int
            Number of modes of the model.
        responses : bool
            True for a model that has, besides these modes, static responses to the inertia and damping of moving
            bodies: they represent modes that are left out, see `Plant`.
        computed : int
            Number of modes that are computed, if it is larger than `count`: the lowest `count` of them are taken.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no modes to the accuracy.
        """
        scene, (winches, control, _), shared = self.scene, self._numbers, self.plants_and_loops
        computed = max(count, computed)
        model = count, computed, responses, winches, self.midspans, self.points
        plant, closed_loop = ("plant", *model), ("closed loop", *model, control)
        if plant not in shared:
            modes, loops = self._modes_of(computed).first(count), shared.setdefault(("loops", winches), {})
            arguments = scene, self.equilibrium, self.airflow, modes, self.sizes.accuracy, self.model
            others = {"midspans": self.midspans, "points": self.points}
            shared[plant] = Plant(*arguments, loops=loops, responses=responses, **others)
        if closed_loop not in shared:
            shared[closed_loop] = ClosedLoop(scene, shared[plant])
        return shared[closed_loop]

    def in_wind(self, closed_loop):
        """`LoopInWind` of a `ClosedLoop` in the wind of this case, which cases in equal winds share."""
        wind, shared = self._numbers[-1], self.plants_and_loops
        plant_in_wind, loop_in_wind = ("in wind", closed_loop.plant, wind), ("in wind", closed_loop, wind)
        if plant_in_wind not in shared:
            shared[plant_in_wind] = PlantInWind(closed_loop.plant, self.airflow)
        if loop_in_wind not in shared:
            shared[loop_in_wind] = LoopInWind(closed_loop, shared[plant_in_wind])
        return shared[loop_in_wind]

    @cached_property
    def _numbers(self):
        """Numbers of winches with actuators, of the control and of the wind: equal for cases where these are equal."""
        scene, shared = self.scene, self.plants_and_loops
        winches = tuple(scene.winches.items()), tuple(scene.actuators.items())
        wind = scene.wind, self.airflow and self.airflow.direction_name
        return [shared.setdefault(("number", tables), len(shared)) for tables in (winches, scene.control, wind)]

    def _modes_of(self, count):
        """`CoupledModes`, the lowest `count` of them with damping; raises as `closed_loop_of`."""
        if count not in self.modes:
            self.modes[count] = self._coupled_modes(count)
        modes = result_of(self.modes[count])
        if not self.midspans or self.model is not None:
            return modes
        if modes.fewest_modes_of_cable >= modes.models.cables.across * shaping_modes(self.sizes.accuracy):
            return modes
        if (count, "shaped") not in self.modes:
            self.modes[count, "shaped"] = self._coupled_modes(count, shaped=True)
        return self.modes[count, "shaped"]

    def _coupled_modes(self, count, shaped=False):
        """`CoupledModes` with damping; `shaped` as in `Search`. Raises as `closed_loop_of`."""
        damping = [cable.damping for cable in self.scene.cables.values()]
        arguments = self.equilibrium, count, self.sizes.accuracy, damping, self.model, self.cables
        return coupled_modes(*arguments, damped=True, shaped=shaped).damped

    @property
    def first_model(self):
        """Key of the model that is tried first: rows whose keys are equal have their modes computed together.

        Number of modes, accuracy, planes of the motion of the cables, and elements without their drag, or None.
        """
        drag, planes = self.model and self.model.drag, self.cables and self.cables.planes
        elements = self.model and replace(self.model, drag=drag and (drag.profile is None,))
        return self.sizes.computed(self.sizes.tried[0]), self.sizes.accuracy, planes, elements

    def lowest_modes(self, count):
        """At least `count` `CoupledModes`, or all; those of the model that is tried first, if it has so many.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `closed_loop_of`.
        """
        return self._modes_of(self.sizes.computed(max(count, self.sizes.tried[0])))

    @cached_property
    def sizes_to_try(self):
        """Numbers of modes of the models that are tried, from the fewest on with which notch frequencies are known.

        Fewer than the usual ones only where they have nearly all of the compliance of the bodies.
        """
        for count in (*self.sizes.tried, *(MOTION.more_modes if self.model is None else ())):
            closed_loop = self.closed_loop_with(count)
            enough = count >= self.sizes.usual[0] or closed_loop.plant.lacked_compliance < MOTION.lacked_compliance
            if (enough and closed_loop.body.notch_frequencies_known) or len(closed_loop.modes) < count:
                break
        return tuple(size for size in self.sizes.tried if size >= count) or (count,)

    def closed_loop_with(self, count):
        """`closed_loop_of` a number of modes that is tried; where those left out matter they have responses.

        They do behind a `fast_loop`: static responses to winches alone are wrong by the square of a frequency over that
        of the first wave left out, and the loop amplifies this (RMS 7e-4 off at 0.7 of that frequency).
        """
        sizes = self.sizes
        few_modes = count < sizes.usual[0] or sizes.compared
        responses = few_modes or sizes.fast_loop or self._lacks_motion_of_bodies(count)
        responses = responses or self._has_strongly_damped_cables(count)
        return self.closed_loop_of(count, responses, self.sizes.computed(count))

    def _lacks_motion_of_bodies(self, count):
        """True if modes, `count` of them, lack much of the static compliance of a body: it moves in higher ones.

        Of a free point too, where its motion is asked for.
        """
        modes = self._modes_of(self.sizes.computed(count)).first(count)
        asked = self.points | (modes.layout.free < 6 * self.equilibrium.suspension.bodies)
        return bool((modes.shares_of(np.flatnonzero(asked)).sum(axis=1) < 1 - MOTION.lacked_motion).any())

    def _has_strongly_damped_cables(self, count):
        """True if air and viscous damping give the first mode of a cable a damping ratio above `MOTION.damped_cable`.

        Bodies then move many of its modes by its damping, of which the highest in a model show almost nothing.
        """
        if self.airflow is None:
            return False
        per_length = np.array([cable.damping.viscous for cable in self.scene.cables.values()])
        per_length = per_length + self.airflow.damping_per_length
        first = self._modes_of(self.sizes.computed(count)).models.lowest_omega
        mass = np.asarray(self.equilibrium.catenary.span.mass)
        return bool((per_length[mass > 0] > 2 * MOTION.damped_cable * (first * mass)[mass > 0]).any())
