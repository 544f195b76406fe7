"""Suspensions of equal names and connections: their equilibria and modes, found together."""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.cable.catenary_in_drag import bounded_errors, form_of_one
from cablestudy.errors import ConvergenceError, NoSolutionError, result_of
from cablestudy.motion.airflow import drag_of
from cablestudy.statics import lengths
from cablestudy.statics.equilibria import pose
from cablestudy.statics.failure import explain
from cablestudy.statics.force_density import find_form
from cablestudy.statics.rigid import angle_errors, to_angles
from cablestudy.study.suspension.cable_results import CableResults
from cablestudy.study.suspension.conductors import conductors_of
from cablestudy.study.suspension.drag_change import changes_by_fewer_parts, drag_on_cables, equilibria_in_drag
from cablestudy.study.suspension.equilibrium_errors import EquilibriumErrors
from cablestudy.study.suspension.load_cases import (
    cables_left,
    loaded_state,
    numbers_at_rest,
    too_long,
)
from cablestudy.study.suspension.numbers import distribution_of, loads_of
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.mean import equilibrium_in_wind


class Group:
    """Suspensions whose equilibria are found in one call: n cases with equal parts and connections.

    The reference state is the equilibrium without a load case; the unstretched lengths that follow from it hold under
    the loads of the load case.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        One scene for each case, with all of its cables. All have a mean wind, or none has; their load cases lack the
        same cables.

    Attributes
    ----------
    reference : Equilibrium
        Of the reference state, with all cables, shape (n,).
    problems : list of str
        Why each case has no reference state; empty where it has one.
    errors : EquilibriumErrors
    cable_indices, body_indices : dict
        Name -> index among those cables, and among bodies and free points.
    linear_models, modes_in_wind : list of dict
        For each case `plants_and_loops` and `modes` of its `DynamicAnalysis`, filled by this.

    Raises
    ------
    NoSolutionError, ConvergenceError
        None of the cases has an answer.
    """

    def __init__(self, scenes):
        self.linear_models, self.modes_in_wind = [{} for _ in scenes], [{} for _ in scenes]
        self._modes = {}  # kept by `modes`
        self._cables, self._drags_on_cables, self._coordinates = {}, {}, {}  # by the number of parts of `coarser`
        self._conductors, self.reference, self.problems = self._reference_state(scenes)
        self._drag_parts = STUDY.drag_parts
        self._scenes = [scene.without_lost() for scene in scenes]  # with the cables that the load cases leave
        lost = scenes[0].load_case.lost
        self._without_lost = f"without {', '.join(lost)}: " if lost else ""  # begins messages
        self._loaded = self._loaded_state()
        self.errors = EquilibriumErrors(self.reference, self.equilibrium, self._conductors)
        self.cable_indices = {name: index for index, name in enumerate(self._scenes[0].cables)}
        self.body_indices = {name: index for index, name in enumerate(self.reference.suspension.body_names)}

    def _reference_state(self, scenes):
        """`SuspendedConductors` or None, and what `at_rest` returns."""
        conductors = conductors_of(scenes, at_rest)
        if conductors is None:
            return None, *at_rest(scenes, numbers_at_rest(scenes))
        return conductors, conductors.reference, conductors.problems

    def _loaded_state(self):
        """`LoadedState` of all cases; None where they are the reference state, without a load case."""
        first = self._scenes[0]
        if first.case is None and not any(loads_of(first, of_case=True)) and self._conductors is None:
            return None
        try:
            return loaded_state(self.reference, self._scenes, cables=self._of_case)
        except NoSolutionError as error:
            raise NoSolutionError(f"{self._without_lost}{error}") from None

    @property
    def cables(self):
        """`CableResults` of the cables that the load cases leave."""
        if self._drag_parts not in self._cables:
            lengths = self.reference.lengths if self._of_case is None else self._of_case.lengths
            lengths = lengths[:, cables_left(self.reference, self._scenes[0])]
            self._cables[self._drag_parts] = CableResults(self._scenes, self.rest, lengths)
        return self._cables[self._drag_parts]

    @property
    def _of_case(self):
        """`CablesOfCase` of conductors with permanent elongation; None where there is none."""
        return self._conductors and self._conductors.of_case

    def conductor_states(self, index):
        """States of all cables of a case, see `LinearCables.labels`; empty where all are linear: list of str."""
        return [] if self._conductors is None else self._conductors.labels[index].tolist()

    @cached_property
    def _too_long(self):
        """Texts of `load_cases.too_long`; without loads no search was ever seen to end at the longer length."""
        none = [""] * len(self._scenes)
        return none if self.reference.suspension.load_forces is None else too_long(self.reference)

    @property
    def equilibrium(self):
        """`Equilibrium` of all cases under their loads, shape (n,); of the reference state without load cases."""
        return self.reference if self._loaded is None else self._loaded.equilibrium

    @property
    def in_steady_wind(self):
        """True if the load cases have a steady wind."""
        return self._loaded is not None and self._loaded.drag is not None

    @property
    def rest(self):
        """`Equilibrium` of all cases where they rest: in a steady wind, with drag that varies along each cable."""
        return self._in_steady_wind[self._drag_parts] if self.in_steady_wind else self.equilibrium

    @cached_property
    def _in_steady_wind(self):
        """`equilibria_in_drag` of all cases."""
        return equilibria_in_drag(self.equilibrium, self._loaded.drag, STUDY.drag_parts)

    @cached_property
    def coarser(self):
        """`Group` of the same cases with drag that varies on half as many parts; itself has none, nor a calm one."""
        if not self.in_steady_wind or self._drag_parts < STUDY.drag_parts:
            return None
        coarser = copy(self)  # shares what was found, also for its own number of parts
        coarser._drag_parts = self._drag_parts // 2
        return coarser

    def form_of(self, span, index, cable):
        """A cable of a case by its `Span` with other loads than its own: `Catenary` or `CatenaryInDrag`."""
        return form_of_one(span, self.steady_drag(([index], [cable])), self._drag_parts)

    def least_error_by_drag(self, index, cable=None):
        """`least_errors` of a cable of a case; of other numbers the largest share that its search leaves. [-]"""
        form = self.rest.catenary
        return float(form.unsettled[index].max(initial=0.0) if cable is None else form.least_errors[index, cable])

    @property
    def without_wind(self):
        """`Equilibrium` without the steady wind of the load cases."""
        return self.reference if self._loaded is None else self._loaded.without_wind

    @cached_property
    def _unforced(self):
        """`LoadedState` of all cases without the forces of their load cases."""
        return loaded_state(self.reference, self._scenes, forced=False, cables=self._of_case)

    def force_displacement(self, index):
        """Displacements of b bodies and free points by the forces that a load case applies to them, and their errors.

        Displacement = position in the load case - position in the same load case without these forces.

        Parameters
        ----------
        index : int
            Index of the load case.

        Returns
        -------
        displacement : ndarray, shape (b, 3)
            Along x, y, z. [m]
        by_rounding : ndarray, shape (b, 3)
            Error by rounding: the sum of those of the two positions. [m]

        Raises
        ------
        NoSolutionError, ConvergenceError
            Without these forces there is no stable equilibrium.
        """
        for equilibrium in (self._unforced.without_wind, self._unforced.equilibrium):
            if failure := _failure(equilibrium, index, "without the forces of the load case: "):
                raise failure
        unforced = self._unforced.equilibrium
        uncertainty = self.equilibrium.uncertainty.pose[index] + unforced.uncertainty.pose[index]
        if self.in_steady_wind:
            unforced = self._unforced_in_steady_wind[self._drag_parts]
        return self.rest.position[index] - unforced.position[index], uncertainty[:, :3]

    @property
    def _drag_on_cables(self):
        """`drag_on_cables` of all cases about `in_motion`; None where no wind acts on cables."""
        if self._drag_parts not in self._drags_on_cables:
            drag = self._drag_in_motion
            self._drags_on_cables[self._drag_parts] = drag and drag_on_cables(drag, self.in_motion)
        return self._drags_on_cables[self._drag_parts]

    def mean_drag(self, index):
        """Drag on the cables of a case of its mean or steady wind: `SteadyDrag` of shape (c,), or None."""
        drag = self._drag_on_cables
        return drag and drag.take(index)

    def steady_drag(self, index):
        """`mean_drag` of a case in a steady wind, in which it rests and has its modes; None without."""
        return self.mean_drag(index) if self.in_steady_wind else None

    @cached_property
    def _unforced_in_steady_wind(self):
        """`equilibria_in_drag` of the load cases without their forces."""
        return equilibria_in_drag(self._unforced.equilibrium, self._unforced.drag, STUDY.drag_parts)

    def coordinates(self, body, axis):
        """A coordinate of a body or free point in all cases, 0 where it is rounding, and its estimated relative error.

        Parameters
        ----------
        body : int
            Its index among all.
        axis : int
            0 to 2: x, y, z [m]; 3 to 5: roll, pitch, yaw [rad].

        Returns
        -------
        list of (float, float)
        """
        key = self._drag_parts, body, axis
        if key not in self._coordinates:
            with np.errstate(all="ignore"):  # of cases that have no equilibrium
                self._coordinates[key] = self._coordinate(body, axis)
        return self._coordinates[key]

    def _coordinate(self, body, axis):
        """A coordinate in all cases and its estimated relative error, as of `coordinates`."""
        by_rounding = self.errors.rounding_movement[:, body]
        uncertainty = by_rounding + self.errors.conductor_movement[:, body]
        if axis < 3:
            value, least = self.rest.position[:, body, axis], STUDY.rounding * self.equilibrium.longest
        else:
            rotation, least = self.rest.rotation[:, body], STUDY.rounding * 2 * np.pi
            value = to_angles(rotation)[:, axis - 3]
            uncertainty = np.concatenate([uncertainty[:, :3], angle_errors(rotation, uncertainty[:, 3:])], axis=-1)
        zero = np.abs(value) <= np.maximum(by_rounding[:, axis], least)
        error = np.where(zero, self.errors.rounding, uncertainty[:, axis] / np.where(zero, 1.0, np.abs(value)))
        return list(zip(np.where(zero, 0.0, value).tolist(), np.maximum(STUDY.rounding, error).tolist(), strict=True))

    @cached_property
    def in_mean_wind(self):
        """`Equilibrium` of all cases about which they move in the wind, and the `Drag` of that wind or None.

        It is `equilibrium` where the scenes have no wind (the drag is then None), where the mean wind shall not act,
        and where a steady wind of the load cases takes its place.
        """
        if self._scenes[0].wind is None:
            return self.equilibrium, None
        suspension = self.equilibrium.suspension
        drag = drag_of(self._scenes, suspension.body_names, suspension.cable_names)
        steady = self._scenes[0].load_case.wind is not None
        if steady or not self._scenes[0].wind.mean:
            return self.equilibrium, drag
        return equilibrium_in_wind(self.equilibrium, drag), drag

    @property
    def _drag_in_motion(self):
        """`Drag` of the mean or steady wind on the cables about which all cases move; None where there is none."""
        equilibrium, drag = self.in_mean_wind
        if equilibrium is self.equilibrium:
            return self._loaded and self._loaded.drag
        return drag if drag.cables.any() else None

    def drags(self, index):
        """`Drag` on a case of its gusts, and of the wind about which it moves, if any; None without gusts.

        The latter has a profile of shape (1,); both are the same object where they are equal.
        """
        equilibrium, drag = self.in_mean_wind
        if drag is None:
            return None
        of_gusts = drag.take(index)
        return of_gusts, self.drag_of_steady_wind(index) if equilibrium is self.equilibrium else of_gusts

    def drag_of_steady_wind(self, index):
        """`Drag` of the steady wind of a load case, with a profile of shape (1,); None without."""
        steady = self._loaded and self._loaded.drag
        return steady and replace(steady.take(index), profile=steady.profile and steady.profile.take([index]))

    @property
    def in_motion(self):
        """`Equilibrium` of all cases about which they move: `in_mean_wind`, with drag that varies along each cable."""
        return self.in_mean_wind[0] if self._in_moving_air is None else self._in_moving_air[self._drag_parts]

    @cached_property
    def _in_moving_air(self):
        """`equilibria_in_drag` about which all cases move; None without wind on cables."""
        equilibrium, drag = self.in_mean_wind
        if equilibrium is self.equilibrium:
            return self._in_steady_wind if self.in_steady_wind else None
        return equilibria_in_drag(equilibrium, drag, STUDY.drag_parts) if drag.cables.any() else None

    @cached_property
    def _change_by_fewer_parts(self):
        """`changes_by_fewer_parts` of `in_motion`; None without wind on cables.

        `least_errors` of the cables count too, of movements what the search left, as a share of the largest one by the
        wind.
        """
        if self._in_moving_air is None:
            return None
        relative, movement = changes_by_fewer_parts(*self._in_moving_air.values())
        form = self.in_motion.catenary
        least, unsettled = (error.max(axis=-1, initial=0.0) for error in (form.least_errors, form.unsettled))
        now, before = self.in_motion, self.without_wind
        by_wind = [np.abs(now.position - before.position), np.abs(now.rotation - before.rotation).max(axis=-1)]
        largest = np.repeat([part.max(axis=(-2, -1), initial=0.0) for part in by_wind], 3, axis=0).T
        return relative + least, np.abs(movement) + (unsettled[:, None] * largest)[:, None]

    @cached_property
    def motion_errors(self):
        """Relative errors of loop and motion by drag, and by conductors taken as linear along each, shape (n,). [-]

        That by drag is the change of tension or stiffness by fewer parts, a hundred times its error or more: a motion
        may change by thirty times as much as the stiffness.
        """
        by_conductors, changes = self.errors.conductor, self._change_by_fewer_parts
        return by_conductors if changes is None else bounded_errors(changes[0]) + by_conductors

    @property
    def mode_errors(self):
        """Relative errors of all frequencies by drag and by conductors, shape (n,). [-]

        Those of `motion_errors`, and the change of the form of cables by fewer parts, see `CatenaryInDrag.mode_errors`.
        """
        if not self.in_steady_wind:
            return self.errors.conductor
        return bounded_errors(self.motion_errors + self.rest.catenary.by_parts.max(axis=-1, initial=0.0))

    def displacement_uncertainty(self, index, body):
        """Errors of the displacement of a body by the mean wind [m], [rad], by drag and by rounding, shape (6,)."""
        changes = self._change_by_fewer_parts
        by_rounding = self.without_wind.uncertainty.pose + self.in_mean_wind[0].uncertainty.pose
        return by_rounding[index, body] + (0.0 if changes is None else changes[1][index, body])

    def failure(self, index):
        """The error of a case without a stable equilibrium, or None.

        The reference state has to be a stable equilibrium too where unstretched lengths follow from it.
        """
        if self.problems[index]:
            return NoSolutionError(str(self.problems[index]))
        if self._loaded is None:
            return _failure(self.equilibrium, index)
        at_rest_failure = None
        if set(self.reference.suspension.stated) - {"unstretched_length"}:  # lengths that follow from that state
            at_rest_failure = _failure(self.reference, index, "in the reference state: ")
            if at_rest_failure is None and self._too_long[index]:
                return NoSolutionError(f"in the reference state: {self._too_long[index]}")
        if at_rest_failure is None and self._loaded.problems[index]:
            return NoSolutionError(self._loaded.problems[index])
        return (
            at_rest_failure
            or _failure(self.without_wind, index, self._without_lost)
            or _failure(self.equilibrium, index, self._without_lost)
            or (_convergence_failure(self.rest, index, self._without_lost) if self.in_steady_wind else None)
        )

    def modes(self, index, count):
        """Compute the lowest coupled modes of cables and bodies of one case: `CoupledModes`.

        Those of neighbouring cases with the same model are computed in the same call, and kept.

        Parameters
        ----------
        index : int
            Index of a case that has a stable equilibrium.
        count : int
            Number of modes.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no such modes, or not to the accuracy of the scene.
        """
        if (index, count) not in self._modes:
            block_size = max(1, STUDY.cables_at_once // max(1, len(self.cable_indices)))
            start = index // block_size * block_size
            block = range(start, min(start + block_size, len(self._scenes)))
            model = self._scenes[index].model
            self._find_modes([i for i in block if self._scenes[i].model == model and not self.failure(i)], count)
        return result_of(self._modes[index, count])

    def _find_modes(self, indices, count):
        """Compute the modes of some cases, which state equal models, in one call, and keep them or their errors."""
        from cablestudy.system.coupled_modes import coupled_modes_of_cases

        accuracy = self._scenes[indices[0]].model.accuracy or 1.0
        damping = [cable.damping for index in indices for cable in self._scenes[index].cables.values()]
        found = coupled_modes_of_cases(self.rest.take(np.array(indices)), count, accuracy, damping)
        for index, modes in zip(indices, found, strict=True):
            self._modes[index, count] = modes


def at_rest(scenes, numbers):
    """`Equilibrium` of suspensions in the reference state, and for each a text why there is none, empty if there is."""
    if scenes[0].solve_for == "lengths":
        return lengths.solve(numbers, **distribution_of(scenes))
    return pose(_with_form(numbers)), [""] * len(scenes)


def _failure(equilibrium, index, state=""):
    """The error of a case without a stable equilibrium, which names the state, or None."""
    if equilibrium.valid[index]:
        return None
    if failure := _convergence_failure(equilibrium, index, state):
        return failure
    reason = equilibrium.stability.reason(index) or equilibrium.uncertainty.reason(index)
    return NoSolutionError(state + reason) if reason else None


def _convergence_failure(equilibrium, index, state=""):
    """The ConvergenceError of a case for which no equilibrium was found, which names the state, or None."""
    if equilibrium.record.converged[index]:
        return None
    return ConvergenceError(f"{state}no equilibrium: {explain(equilibrium.take(index))}")


def _with_form(numbers):
    """`SuspendedSystem` with junctions at the positions of its force densities, if these are stated for all cables."""
    if numbers.force_density is None:
        return numbers
    try:
        return find_form(numbers)[0]
    except NoSolutionError:
        return numbers  # some force densities are missing: the search begins where the file says
