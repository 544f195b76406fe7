"""One suspension: its equilibrium, tensions and coupled modes, each computed when it is needed."""

from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from math import isnan

import numpy as np

from cablestudy.cable.damping import any_grows_with_modes
from cablestudy.cable.linear_range import linear_range
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.motion.model_sizes import MODAL
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.words import counted
from cablestudy.statics.failure import explain
from cablestudy.statics.rigid import cross_matrix, point_movement
from cablestudy.statics.suspension import AXES, GROUND
from cablestudy.study.column import DISCRETE
from cablestudy.study.compared_case import ComparedCase
from cablestudy.study.refinement import reference_scene
from cablestudy.study.scene_values import merged_loads
from cablestudy.study.statics import ClosedStatics
from cablestudy.study.suspension.group import Group, HangingCable
from cablestudy.study.suspension.numbers import CableValues
from cablestudy.study.tolerances import STUDY


class SuspensionCase(ComparedCase):
    """One suspension in one load case, and its numbers, for the columns of tables.

    Parameters
    ----------
    scene : SuspensionScene
        With all cables.
    group : Group or CablestudyError, optional
        With the statics of this case, computed with those of other cases, or the error in their place; by default a
        group of this case alone.
    index : int
        Of the case in the group.
    estimate : bool
        Whether errors of the motion are to be estimated, see `ComparedCase`, where the scene states the elements.

    Attributes
    ----------
    scene : SuspensionScene
        With the cables that its load case leaves.
    lost : tuple of str
        Names of the cables that the load case lacks.
    together : sequence of SuspensionCase
        Cases, this one among them, whose damping ratios are computed in one call; empty if it is alone.
    """

    def __init__(self, scene, group=None, index=0, estimate=False):
        self.scene, self.with_all_cables, self._group = scene.without_lost(), scene, group
        self.index, self._modes, self._modes_of_bodies, self.lost = index, {}, {}, scene.load_case.lost
        self.estimate = estimate and self.model is not None
        self.together = ()

    @cached_property
    def finer(self):
        """`SuspensionCase` of the scene with a model to the accuracy `reference_accuracy`, for comparison."""
        return SuspensionCase(reference_scene(self.with_all_cables))

    @cached_property
    def unbroken(self):
        """`SuspensionCase` of the load case with none of its cables lost, for comparison."""
        name = self.scene.case
        without_loss = self.with_all_cables.cases[name].model_copy(update={"lost": ()})
        cases = {**self.scene.cases, name: without_loss}
        return SuspensionCase(self.with_all_cables.model_copy(update={"cases": cases}))

    def refuse_lost(self, name, words="{0} is lost in the load case {1}"):
        """Raise the NoSolutionError of a cable that the load case lacks, in words with the names of both."""
        if name in self.lost:
            raise NoSolutionError(words.format(name, self.scene.case))

    @property
    def damped_by_modes(self):
        """True if some cable has modal damping, whose effect grows with the number of modes."""
        return any_grows_with_modes(self.scene.cables.values())

    @cached_property
    def group(self):
        """The `Group` of this case, which has a stable equilibrium.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none, or it is not stable.
        """
        group = self._solved_group
        if failure := group.failure(self.index):
            raise failure
        return group

    @cached_property
    def _solved_group(self):
        """The `Group`, also of a case without a stable equilibrium, whose numbers then mean nothing."""
        group = Group([self.with_all_cables]) if self._group is None else self._group
        if isinstance(group, Exception):
            raise group
        return group

    @cached_property
    def equilibrium(self):
        """`Equilibrium` of this case; raises as `group`."""
        return self.group.take(self.index)

    @property
    def form(self):
        """The cables where they hang, shape (c,): what `cable.geometry` takes; raises as `group`."""
        return self.equilibrium.catenary

    @property
    def statics(self):
        """`ClosedStatics` of all cables, fields of shape (c,); raises as `group`."""
        return ClosedStatics(self.form)

    @property
    def without_wind(self):
        """`Equilibrium` without the steady wind of the load case; raises as `group`."""
        return self.group.without_wind.take(self.index)

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
        group, index, (equilibrium, drag) = self.group, self.index, self.group.in_mean_wind
        others = self._exact_model, group.linear_models[index]
        shared = {"modes": group.modes_in_wind[index], "mean_drag": group.mean_drag(index)}
        if drag is None:
            return DynamicAnalysis(self.scene, self.without_wind, self.equilibrium, None, *others, **shared)
        if not equilibrium.record.converged[index]:
            raise ConvergenceError(f"no equilibrium in the mean wind: {explain(equilibrium.take(index))}")
        if reason := equilibrium.stability.reason(index):
            raise NoSolutionError(f"in the mean wind: {reason}")
        in_mean_wind, airflow = equilibrium.take(index), Airflow(self.scene, drag.take(index))
        return DynamicAnalysis(self.scene, self.without_wind, in_mean_wind, airflow, *others, **shared)

    @property
    def moves(self):
        """True if its motion in the wind or under control was computed."""
        return "analysis" in self.__dict__ and self.analysis.solved

    @property
    def solved(self):
        """True if its equilibrium was computed and is stable."""
        return "group" in self.__dict__

    @property
    def largest_modes(self):
        """The computed `CoupledModes` with most modes: a list of at most one."""
        return [self._modes[max(self._modes)]] if self._modes else []

    def without_modes(self):
        """Copy without the modes that were computed, of which `modes` gives any that has enough of them."""
        other = copy(self)
        other._modes = {}
        return other

    @property
    def over_strength(self):
        """Name of each cable whose largest tension is above its breaking force -> their ratio: dict. [-]"""
        cables = self.group.cables
        if not cables.overloaded[self.index]:
            return {}
        utilisations = zip(self.group.cable_indices, cables.utilisation[self.index].tolist(), strict=True)
        return {name: utilisation for name, utilisation in utilisations if utilisation > 1}

    def cable(self, name):
        """Index of a cable among those of the case, which need no equilibrium."""
        return self._solved_group.cable_indices[name]

    def body(self, name):
        """Index of a body or free point among all."""
        return self.group.body_indices[name]

    def stated_of_cable(self, column, name):
        """Number of one cable in a column that needs no statics, also where there is no equilibrium.

        The distance of its ends needs an equilibrium unless both are held.
        """
        cable = list(self.scene.cables).index(name)
        if column.name != "chord":
            return column.compute(CableValues([self.scene]))[0, cable]
        return (self._solved_group if self._ends_held(cable) else self.group).cables.chord[self.index, cable]

    def _ends_held(self, cable):
        """True of a cable, by its index, whose ends are both where the scene says."""
        suspension = self._solved_group.equilibrium.suspension
        return not any(end != GROUND and suspension.free[end].any() for end in suspension.owner[cable])

    @cached_property
    def cable_modes(self):
        """Modes of single cables with both ends held where they are in the equilibrium: `CableModes`; as `group`."""
        from cablestudy.study.suspension.cable_modes import CableModes

        about = self.equilibrium.catenary, self.group.steady_drag(self.index), self.group.errors.modes[self.index]
        return CableModes(self.scene, *about, finer=lambda: self.finer.cable_modes)

    def hanging(self, name):
        """`HangingCable` of a name, with the loads that it carries; raises as `group`.

        The arrays of a batch have entries for as many loads as the cable with most: those without a load are left out.
        """
        cable = self.cable(name)
        catenary, length = self.equilibrium.catenary.take(cable), self.group.cables.reference_length[self.index, cable]
        loaded = np.zeros(len(catenary.span.load_positions), dtype=bool)
        fractions = catenary.span.load_positions / catenary.span.unstretched_length
        for position, fraction, _, _ in merged_loads(self.scene.loads_on(name)):
            loaded[np.argmin(np.abs(fractions - (fraction if np.isnan(position) else position / length)))] = True
        catenary = replace(catenary, span=catenary.span.with_some_loads(loaded))
        return HangingCable(self.scene, self.equilibrium.ends[cable, 0], catenary, self.statics_error(None))

    def of_cables(self, column):
        """Numbers of all cables in a `Column` of single cables, shape (c,)."""
        return self.group.cables.column(column.name, column.compute)[self.index]

    def link(self, name):
        """Force along a link, positive in tension, 0 where it is rounding [N], its relative error, its length [m]."""
        equilibrium, link = self.group.equilibrium, list(self.scene.links).index(name)
        arrays = equilibrium.links.force, equilibrium.uncertainty.force, equilibrium.links.distance
        force, rounding, length = (float(array[self.index, link]) for array in arrays)
        zero, error = abs(force) <= rounding, self.statics_error(None)
        uncertainty = float(self.group.errors.links[self.index, link])
        return 0.0 if zero else force, error if zero else max(error, uncertainty / abs(force)), length

    def body_stiffness(self, name):
        """Stiffness of a body, shape (6, 6), zero where it is rounding; see `Equilibrium.body_stiffness`."""
        matrix, size = self._body_stiffness(name)
        is_rounding = np.abs(matrix) <= STUDY.stiffness_rounding * size
        np.fill_diagonal(is_rounding, np.diagonal(matrix) == 0)
        return np.where(is_rounding, 0.0, matrix)

    def stiffness_entry(self, name, row, column):
        """An entry of `body_stiffness`, and its estimated relative error: that beside the diagonal by its own size."""
        entry, size = self.body_stiffness(name)[row, column], self._body_stiffness(name)[1][row, column]
        error = self.statics_error(None)
        return entry, max(error, self.group.errors.stiffness[self.index] * size / abs(entry)) if entry else error

    def _body_stiffness(self, name):
        """Stiffness of a body, and the geometric means of the two entries on its diagonal, shape (6, 6) each.

        An entry on the diagonal that arms of rounded length make is set to zero; the largest one that a body as large
        as its cables are long could have takes its place in the means.
        """
        matrix = self.group.equilibrium.body_stiffness[self.index, self.body(name)].copy()
        diagonal = np.abs(np.diagonal(matrix))
        largest = diagonal[:3].max() * np.repeat([1.0, float(self.equilibrium.longest) ** 2], 3)
        is_rounding = diagonal <= STUDY.stiffness_rounding**2 * largest
        np.fill_diagonal(matrix, np.where(is_rounding, 0.0, np.diagonal(matrix)))
        size = np.sqrt(np.where(is_rounding, largest, diagonal))
        return matrix, np.outer(size, size)

    def linear_range(self, name, axis):
        """Movement of a body or free point along x, y or z (0, 1, 2) up to which its cables restore it linearly. [m]

        None where there is no such limit; and its relative error, see `cable.linear_range`.
        """
        suspension = self.equilibrium.suspension
        ends = (suspension.owner[suspension.of_cables] == self.body(name)).astype(float)
        moves = (ends[:, 1] - ends[:, 0])[:, None] * np.eye(3)[axis]
        return linear_range(self.equilibrium.catenary.span, moves)

    def static_frequencies(self, name):
        """Estimate the frequencies of one body on its static stiffness, other bodies at rest: ndarray, shape (f,). [Hz]

        For the f free displacements and rotations of the body it solves, ascending,

            K phi = w^2 (M + sum of B^T B m/3) phi

        with the stiffness K and mass M of the body, and for each end of a cable on it the mass m of cable and point
        loads, and the displacement B of the end per movement of the body. Free points follow without mass. The estimate
        is good for light and taut cables.

        Parameters
        ----------
        name : str
            Name of the body.
        """
        from scipy.linalg import eigvalsh

        from cablestudy.system.coupled import Layout

        body, equilibrium = self.body(name), self.equilibrium
        suspension, mass = equilibrium.suspension, Layout(equilibrium).mass[body]
        cable, end = np.nonzero(suspension.owner[suspension.of_cables] == body)
        ends = point_movement(equilibrium.arms[cable, end])
        span = equilibrium.catenary.span
        load_mass = 0.0 if span.load_masses is None else span.load_masses.sum(axis=-1)
        third_of_mass = (span.mass * equilibrium.lengths + load_mass)[cable, None, None] / 3
        mass = mass + (np.swapaxes(ends, -1, -2) @ ends * third_of_mass).sum(axis=0)
        free = np.ix_(suspension.free[body], suspension.free[body])
        stiffness = self.body_stiffness(name)[free]
        squared = eigvalsh((stiffness + stiffness.T) / 2, mass[free])
        return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi)

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
        return modes.error + self.group.errors.modes[self.index]

    def statics_error(self, column, number=None):
        """Estimated relative error of a column that needs no motion; zero of one that the scene states. [-]

        `number` is that of the column, where it may state an error of its own by the drag of a steady wind.
        """
        if column is None:
            return self.group.errors.statics[self.index]
        cable = column.by_drag and self.cable(column.name.rpartition(".")[0])
        if column.needs == "scene" and (cable is None or self._ends_held(cable)):
            return 0.0
        within_reference = column.of_reference or column.needs == "scene"
        least = (self.group.errors.reference if within_reference else self.group.errors.statics)[self.index]
        return least if cable is None else max(least, self.group.error_by_drag(self.index, cable, column, number))

    def check(self, column):
        """Raise the NoSolutionError of a column of a cable that the load case lacks."""
        self.refuse_lost(column.name.partition(".")[0])

    def error_of(self, column, number, error=None):
        """Estimated relative error of a number in a column; not a number where it is not known. [-]

        That by drag is added for loop and wind, whose functions state an `error`; for others it is that of statics.
        With `estimate` it is the difference from the number of the model `finer`.
        """
        if error is None:
            error = self.statics_error(column, number)
        if column.needs in ("loop", "wind") and error and not column.follows_drag:
            error += self.group.errors.drag_in_wind[self.index]
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

    def coordinate(self, name, axis):
        """A coordinate of a body or free point, 0 where it is rounding, and its estimated relative error.

        Parameters
        ----------
        name : str
        axis : int
            0 to 2: x, y, z [m]; 3 to 5: roll, pitch, yaw [rad].
        """
        return self.group.coordinates(self.body(name), axis)[self.index]

    def mean_displacement(self, name, axis):
        """Displacement of a body or marker by the mean wind along x, y or z (0, 1, 2) [m], and its relative error."""
        displacement, uncertainty = (part[axis] for part in self._displacement_by_mean_wind(name))
        least = self.statics_error(None)
        error = max(least, uncertainty / abs(displacement)) if displacement else least
        followed = not displacement or self.group.poses_in_mean_wind.followed[self.index]
        return displacement, error if followed else error + self.group.errors.drag_in_wind[self.index]

    def _displacement_by_mean_wind(self, name):
        """Displacement of a body, or of a marker BODY.MARKER, by the mean wind, winches at rest, and its error. [m]"""
        before = self.analysis.without_wind
        if not self.scene.wind.mean and self.scene.load_case.wind is None:
            return np.zeros((2, 3))
        owner, _, marker = name.partition(".")
        body, poses = self.body(owner), self.group.poses_in_mean_wind
        arm = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        rotation, uncertainty = poses.rotation[self.index, body], self.group.mean_wind_uncertainty[self.index, body]
        displacement = (
            poses.position[self.index, body] - before.position[body] + (rotation - before.rotation[body]) @ arm
        )
        uncertainty = uncertainty[:3] + np.abs(cross_matrix(rotation @ arm)) @ uncertainty[3:]
        return np.where(
            np.abs(displacement) > MOTION.mean_wind_rounding * before.longest, displacement, 0.0
        ), uncertainty

    def force_displacement(self, name, axis):
        """Displacement of a body or free point along x, y or z (0, 1, 2) by the forces of the load case [m].

        Returned with its estimated relative error. Raises as `group`, and where the load case has no forces.
        """
        if not self.scene.load_case.forces:
            raise NoSolutionError(
                f"{name}.force_displacement needs the key cases.*.forces, which this case does not have"
            )
        of_all = self.group.force_displacement(self.index)
        displacement, by_rounding, by_drag = (array[self.body(name), axis] for array in of_all)
        if abs(displacement) <= by_rounding:
            return 0.0, self.statics_error(None)
        return displacement, max(self.statics_error(None), (by_rounding + by_drag) / abs(displacement))

    @property
    def size(self):
        """Coordinates of the linear model; 0 where none was made. [-]"""
        return max((len(modes.shapes) for modes in self._modes.values()), default=0)

    @property
    def model(self):
        """`FixedModel` of the scene, or None where it states an accuracy."""
        from cablestudy.system.hanging_cables import FixedModel

        model = self.scene.model
        return FixedModel(model.elements, model.order, model.mass) if model.elements else None

    @property
    def _exact_model(self):
        """`model` with the steady wind on the cables, whose drag its elements follow; raises as `group`."""
        return self.model and replace(self.model, drag=self.group.steady_drag(self.index))

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
        if self.model is None:
            self._modes[count] = self.group.modes(self.index, count)
        else:
            damping = [cable.damping for cable in self.scene.cables.values()]
            self._modes[count] = coupled_modes(self.equilibrium, count, damping=damping, model=self._exact_model)
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
        damps all parts on which the wind of the scene acts, about the equilibrium without mean wind.

        Parameters
        ----------
        name : str
            Name of the body or free point.
        axis : int
            0, 1, 2 for displacements along x, y, z; 3, 4, 5 for rotations about these axes.

        Returns
        -------
        RefinedMode
            Its numbers raise NoSolutionError where the motion along the axis is held.
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

            def sharper(factor):
                options = {"accuracy": factor * model.accuracy, "damping": damping}
                return search(partial(coupled_modes, self.equilibrium, **options))

            self._modes_of_bodies[name, axis] = RefinedMode(
                first=lambda: search(self.modes),
                sharper=sharper,
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
        return Airflow(self.scene, drag_of([self.scene], suspension.body_names, suspension.cable_names).take(0))
