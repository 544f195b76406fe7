"""One suspension in motion: its coupled modes, its loop and its response to the wind, each computed when needed."""

from copy import copy
from functools import cached_property, partial
from math import isnan

import numpy as np

from cablestudy.cable.damping import any_grows_with_modes
from cablestudy.cable.records import is_computed
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.motion.model_sizes import MODAL
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.words import counted
from cablestudy.statics.failure import explain
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.suspension import AXES
from cablestudy.study.column import CLOSED, DISCRETE
from cablestudy.study.compared_case import ComparedCase
from cablestudy.study.refinement import fixed_model, reference_scene
from cablestudy.study.suspension.at_rest import SuspensionAtRest
from cablestudy.study.tolerances import STUDY


class SuspensionCase(SuspensionAtRest, ComparedCase):
    """One suspension in one load case, and its numbers at rest and in motion, for the columns of tables.

    Parameters
    ----------
    scene, group, index
        As of `SuspensionAtRest`.
    estimate : bool
        Whether errors of the motion are to be estimated, see `ComparedCase`, where the scene states the elements.

    Attributes
    ----------
    together : sequence of SuspensionCase
        Cases, this one among them, whose damping ratios are computed in one call; empty if it is alone.
    """

    def __init__(self, scene, group=None, index=0, estimate=False):
        super().__init__(scene, group, index)
        self._modes, self._modes_of_bodies, self.together = {}, {}, ()
        self.estimate = estimate and self.fixed

    @cached_property
    def finer(self):
        """`SuspensionCase` of the scene with a model to the accuracy `reference_accuracy`, for comparison."""
        return SuspensionCase(reference_scene(self.with_all_cables))

    @property
    def damped_by_modes(self):
        """True if some cable has modal damping, whose effect grows with the number of modes."""
        return any_grows_with_modes(self.scene.cables.values())

    @cached_property
    def analysis(self):
        """Motion in turbulent wind, with the control loop of the winches if there is one: `DynamicAnalysis`.

        It is linear about the equilibrium in the mean wind. Where there is no mean wind, or a steady wind of the load
        case takes its place, it is linear about the equilibrium of the load case.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no stable equilibrium, or none in the mean wind; or the load case has lost a cable whose winch the
            loop needs.
        """
        from cablestudy.motion.airflow import Airflow
        from cablestudy.motion.dynamic_analysis import DynamicAnalysis

        if self.scene.control is not None:
            for name in self.with_all_cables.winches:
                self.refuse_lost(name, "the loop needs the winch of {0}, which is lost in the load case {1}")
        group, index, (_, drag), equilibrium = self.group, self.index, self.group.in_mean_wind, self.group.in_motion
        if not equilibrium.record.converged[index]:
            raise ConvergenceError(f"no equilibrium in the mean wind: {explain(equilibrium.take(index))}")
        if drag is not None and (reason := equilibrium.stability.reason(index)):
            raise NoSolutionError(f"in the mean wind: {reason}")
        airflow = drag and Airflow(self.scene, *group.drags(index))
        model_and_loops = fixed_model(self.scene, group.mean_drag(index)), group.linear_models[index]
        arguments = self.scene, self.without_wind, equilibrium.take(index), airflow, *model_and_loops
        return DynamicAnalysis(*arguments, modes=group.modes_in_wind[index])

    @property
    def moves(self):
        """True if its motion in the wind or under control was computed."""
        return is_computed(self, "analysis") and self.analysis.solved

    @property
    def largest_modes(self):
        """The computed `CoupledModes` with most modes: a list of at most one."""
        return [self._modes[max(self._modes)]] if self._modes else []

    def without_modes(self):
        """Copy without the modes that were computed, of which `modes` gives any that has enough of them."""
        other = copy(self)
        other._modes = {}
        return other

    @cached_property
    def cable_modes(self):
        """Modes of single cables with both ends held where they are in the equilibrium: `CableModes`; as `group`."""
        from cablestudy.study.suspension.cable_modes import CableModes

        about = self.form, self.group.steady_drag(self.index), self.group.mode_errors[self.index]
        return CableModes(self.scene, *about, finer=lambda: self.finer.cable_modes)

    def frequency(self, number):
        """Frequency of a mode by its number (from 1) [Hz], and its estimated relative error.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        modes = self.modes(number)
        if len(modes) < number:
            raise NoSolutionError(f"the model has {counted(len(modes), 'mode')}, not {number}")
        return modes.frequency[number - 1], self.mode_errors(modes)[number - 1]

    def mode_errors(self, modes):
        """Estimated relative errors of the frequencies of `CoupledModes`, with that by the drag, shape (k,). [-]"""
        return modes.error + self.group.mode_errors[self.index]

    def error_of(self, column, number, error=None):
        """Estimated relative error of a number in a column; NaN where it is not known, None where none is stated. [-]

        That by drag is added for loop and wind, whose functions state an `error`; for others it is that of statics.
        With `estimate` it is the difference from the number of the model `finer`.
        """
        if column.name == "iterations":
            return None
        if error is None:
            error = self.statics_error(column, number)
        elif column.needs in CLOSED and error:
            error = max(error, self.error_by_drag(column, number))
        if column.needs in ("loop", "wind") and error and not column.follows_drag:
            error += self.group.motion_errors[self.index]
        if self.estimate and column.needs in DISCRETE:
            error = self.difference_from_finer(column, number)
        stated = not error and (column.needs not in ("loop", "wind") or column.name == "gain")
        return float(error) if stated or number is None or isnan(error) else max(float(error), STUDY.rounding)

    def difference_from_finer(self, column, number):
        """Relative difference of a number, see `ComparedCase`; NaN also of motion with modal damping. [-]"""
        if column.needs == "modes" or not self.damped_by_modes:
            return super().difference_from_finer(column, number)
        self.differences[column.header], self.reason = None, MODAL.partition(",")[0]
        return np.nan

    def mean_displacement(self, name, axis):
        """Displacement of a body or marker by the mean wind along x, y or z (0, 1, 2) [m], and its relative error."""
        displacement, uncertainty = (part[axis] for part in self._displacement_by_mean_wind(name))
        least = self.statics_error(None)
        return displacement, max(least, uncertainty / abs(displacement)) if displacement else least

    def _displacement_by_mean_wind(self, name):
        """Displacement of a body, or of a marker BODY.MARKER, by the mean wind, winches at rest, and its error. [m]"""
        before, after = self.analysis.without_wind, self.analysis.equilibrium
        if not self.scene.wind.mean and self.scene.load_case.wind is None:
            return np.zeros((2, 3))
        owner, _, marker = name.partition(".")
        body, uncertainty = self.body(owner), self.group.displacement_uncertainty(self.index, self.body(owner))
        arm = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        turned = after.rotation[body] - before.rotation[body]
        displacement = after.position[body] - before.position[body] + turned @ arm
        uncertainty = uncertainty[:3] + np.abs(cross_matrix(after.rotation[body] @ arm)) @ uncertainty[3:]
        return np.where(
            np.abs(displacement) > MOTION.mean_wind_rounding * before.longest, displacement, 0.0
        ), uncertainty

    @property
    def size(self):
        """Coordinates of the linear model; 0 where none was made. [-]"""
        return max((len(modes.shapes) for modes in self._modes.values()), default=0)

    @property
    def fixed(self):
        """True if the scene fixes the number of elements, and states no accuracy."""
        return self.scene.model.elements is not None

    def modes(self, count):
        """The lowest coupled modes, at least `count` of them where there are so many: `CoupledModes`.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        from cablestudy.system.coupled_modes import coupled_modes

        computed = [modes for computed_count, modes in self._modes.items() if computed_count >= count]
        if computed:
            return computed[0]
        if self.fixed:
            model = fixed_model(self.scene, self.group.steady_drag(self.index))
            damping = [cable.damping for cable in self.scene.cables.values()]
            self._modes[count] = coupled_modes(self.rest, count, damping=damping, model=model)
        else:
            self._modes[count] = self.group.modes(self.index, count)
        return self._modes[count]

    def modes_up_to(self, frequency):
        """All coupled modes up to a frequency [Hz], and at least one above it if there is one: `CoupledModes`.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        count = MOTION.first_body_modes
        while True:
            modes = self.modes(count)
            if len(modes) < count or modes.frequency[-1] > frequency:
                return modes
            count *= 2

    def mode_of(self, body, number):
        """Find a coupled mode of one body: the `number`th of those with more than half of their kinetic energy in it.

        Parameters
        ----------
        body : str
            Name of the body.
        number : int
            From 1, by ascending frequency.

        Returns
        -------
        modes : CoupledModes
            The lowest modes of the suspension.
        index : int
            Index of the mode among them, from 0.

        Raises
        ------
        NoSolutionError
            There is no such mode among the lowest `most_body_modes`.

        Notes
        -----
        The shares of a body in all modes add up to its free degrees of freedom at most, so that the search ends when
        too little is left for the modes that are missing.
        """
        row = self.body(body)
        free = self.equilibrium.suspension.free[row].sum()
        count = number + STUDY.modes_beyond
        while True:
            modes = self.modes(count)
            share = modes.body_energy[row].sum(axis=0)
            of_body = np.flatnonzero(share > 0.5)
            if len(of_body) >= number:
                return modes, int(of_body[number - 1])
            exhausted = free - share.sum() < 0.5 * (number - len(of_body))
            if exhausted or len(modes) < count or count >= MOTION.most_body_modes:
                raise NoSolutionError(
                    f"{len(of_body)} of the lowest {len(modes)} modes have more than half of their kinetic energy in "
                    f"{body}, not {number}"
                )
            count = min(2 * count, MOTION.most_body_modes)

    def mode_along(self, name, axis):
        """Coupled mode in which a body or free point moves most along an axis: `RefinedMode`.

        It has the largest share in the static compliance of the body, 1/k = sum of phi_j^2/w_j^2 over all modes j, with
        the movement phi_j of the body along the axis and the angular frequency w_j. The winches are at rest. The air
        damps all parts on which a wind acts, see `Airflow.damping_drags`, about the equilibrium without mean wind.

        Parameters
        ----------
        name : str
            Name of the body or free point.
        axis : int
            0, 1, 2 for displacements along x, y, z; 3, 4, 5 for rotations about these axes.

        Returns
        -------
        RefinedMode
            Its frequency, share and damping ratio raise NoSolutionError where the motion along the axis is held.
        """
        from cablestudy.motion.body_mode import BodyMode, RefinedMode
        from cablestudy.system.coupled_modes import coupled_modes

        if (name, axis) not in self._modes_of_bodies:
            model, damping = self.scene.model, [cable.damping for cable in self.scene.cables.values()]

            def search(modes_of):
                body = self.body(name)
                if not self.equilibrium.suspension.free[body, axis]:
                    raise NoSolutionError(f"{name} is held along {AXES[axis]}: it has no mode")
                return BodyMode.search(modes_of, name, body, axis)

            def with_accuracy(factor):
                options = {"accuracy": factor * model.accuracy, "damping": damping}
                return search(partial(coupled_modes, self.rest, **options))

            self._modes_of_bodies[name, axis] = RefinedMode(
                first=lambda: search(self.modes),
                with_accuracy=with_accuracy,
                accuracy=None if model.elements else model.accuracy,
                airflow=lambda: self._airflow,
                together=lambda: [case.mode_along(name, axis) for case in self.together or [self]],
            )
        return self._modes_of_bodies[name, axis]

    @cached_property
    def _airflow(self):
        """`Airflow` about the equilibrium of the modes, which is not that in the mean wind; None without wind."""
        from cablestudy.motion.airflow import Airflow, drag_of

        if self.scene.wind is None:
            return None
        suspension = self.equilibrium.suspension
        of_gusts = drag_of([self.scene], suspension.body_names, suspension.cable_names).take(0)
        return Airflow(self.scene, of_gusts, self.group.drag_of_steady_wind(self.index))
