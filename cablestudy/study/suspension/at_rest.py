"""One suspension at rest: its equilibrium, tensions, stiffness and displacements, each computed when it is needed."""

from functools import cached_property, partial
from math import isfinite

import numpy as np

from cablestudy.cable.catenary_in_drag import errors_by_parts
from cablestudy.cable.linear_range import linear_range
from cablestudy.cable.records import is_computed
from cablestudy.errors import NoSolutionError
from cablestudy.statics.rigid import point_movement
from cablestudy.statics.suspension import GROUND
from cablestudy.study.column import number_of, of_part
from cablestudy.study.load_arrays import merged_loads
from cablestudy.study.statics import ClosedStatics
from cablestudy.study.suspension.cable_results import HangingCable
from cablestudy.study.suspension.group import Group
from cablestudy.study.suspension.numbers import CableNumbers, SingleCable
from cablestudy.study.tolerances import STUDY


class SuspensionAtRest:
    """One suspension in one load case, and its numbers at rest, for the columns of tables.

    Parameters
    ----------
    scene : SuspensionScene
        With all cables.
    group : Group or CablestudyError, optional
        With the statics of this case, computed with those of other cases, or the error in their place; by default a
        group of this case alone.
    index : int
        Of the case in the group.

    Attributes
    ----------
    scene : SuspensionScene
        With the cables that its load case leaves.
    lost : tuple of str
        Names of the cables that the load case lacks.
    """

    def __init__(self, scene, group=None, index=0):
        self.scene, self.with_all_cables, self._group = scene.without_lost(), scene, group
        self.index, self.lost = index, scene.load_case.lost

    @cached_property
    def unbroken(self):
        """Case of the same class, of the load case with none of its cables lost, for comparison."""
        name = self.scene.case
        without_loss = self.with_all_cables.cases[name].model_copy(update={"lost": ()})
        cases = {**self.scene.cases, name: without_loss}
        return type(self)(self.with_all_cables.model_copy(update={"cases": cases}))

    def refuse_lost(self, name, words="{0} is lost in the load case {1}"):
        """Raise the NoSolutionError of a cable that the load case lacks, in words with the names of both."""
        if name in self.lost:
            raise NoSolutionError(words.format(name, self.scene.case))

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
        return self.group.equilibrium.take(self.index)

    @cached_property
    def rest(self):
        """`Equilibrium` where it rests, in a steady wind with drag that varies along each cable; raises as `group`."""
        return self.group.rest.take(self.index)

    @cached_property
    def coarser(self):
        """Case of the same class with drag that varies on half as many parts; None without a steady wind."""
        coarser = self.group.coarser
        return coarser and type(self)(self.with_all_cables, coarser, self.index)

    @property
    def form(self):
        """The cables where they hang, shape (c,): what `cable.geometry` takes; raises as `group`."""
        return self.rest.catenary

    @property
    def statics(self):
        """`ClosedStatics` of all cables, fields of shape (c,); raises as `group`."""
        return ClosedStatics(self.form)

    @property
    def without_wind(self):
        """`Equilibrium` without the steady wind of the load case; raises as `group`."""
        return self.group.without_wind.take(self.index)

    @property
    def solved(self):
        """True if its equilibrium was computed and is stable."""
        return is_computed(self, "group")

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
            return column.compute(self._values)[0, cable]
        return (self._solved_group if self._ends_held(cable) else self.group).cables.chord[self.index, cable]

    @cached_property
    def _values(self):
        """`CableNumbers` of this case."""
        return CableNumbers([self.scene])

    def _ends_held(self, cable):
        """True of a cable, by its index, whose ends are both where the scene says."""
        suspension = self._solved_group.equilibrium.suspension
        return not any(end != GROUND and suspension.free[end].any() for end in suspension.owner[cable])

    def hanging(self, name):
        """`HangingCable` of a name, with the loads that it carries; raises as `group`.

        The arrays of a batch have entries for as many loads as the cable with most: those without a load are left out.
        """
        cable, scene, group, index = self.cable(name), SingleCable(self.scene, name), self.group, self.index
        form, length = self.form.take(cable), group.cables.reference_length[index, cable]
        loaded = np.zeros(len(form.span.load_positions), dtype=bool)
        fractions = form.span.load_positions / form.span.unstretched_length
        for position, fraction, _, _ in merged_loads(scene.loads):
            loaded[np.argmin(np.abs(fractions - (fraction if np.isnan(position) else position / length)))] = True
        form, end_1 = form.with_span(form.span.take_loads(loaded)), self.rest.ends[cable, 0]
        coarser = self.coarser and self.coarser.hanging(name)
        form_of = partial(group.form_of, index=index, cable=cable)
        return HangingCable(scene, end_1, form, length, self.statics_error(None), form_of, coarser)

    def of_cables(self, column):
        """Numbers of all cables in a `Column` of single cables, shape (c,)."""
        return self.group.cables.column(column.name, column.compute)[self.index]

    def link(self, name):
        """Force along a link, positive in tension, 0 where it is rounding [N], its relative error, its length [m]."""
        links, link = self.group.rest.links, list(self.scene.links).index(name)
        arrays = links.force, self.group.equilibrium.uncertainty.force, links.distance
        force, rounding, length = (float(array[self.index, link]) for array in arrays)
        zero, error = abs(force) <= rounding, self.statics_error(None)
        return 0.0 if zero else force, error if zero else max(error, rounding / abs(force)), length

    def body_stiffness(self, name):
        """Stiffness of a body, shape (6, 6), zero where it is rounding; see `Equilibrium.body_stiffness`."""
        matrix, size = self._body_stiffness(name)
        is_rounding = np.abs(matrix) <= STUDY.stiffness_rounding * size
        np.fill_diagonal(is_rounding, np.diagonal(matrix) == 0)
        return np.where(is_rounding, 0.0, matrix)

    def stiffness_entry(self, name, row, column):
        """An entry of `body_stiffness`, and its estimated relative error: off the diagonal by the size of the entry."""
        entry, size = self.body_stiffness(name)[row, column], self._body_stiffness(name)[1][row, column]
        errors, least = self.group.errors, self.statics_error(None)
        if not entry:
            return entry, least
        return entry, max(least, errors.statics[self.index] * size / abs(entry))

    def _body_stiffness(self, name):
        """Stiffness of a body, and the geometric means of the two entries on its diagonal, shape (6, 6) each.

        An entry on the diagonal that arms of rounded length make is set to zero; the largest one that a body as large
        as its cables are long could have takes its place in the means.
        """
        matrix = self.group.rest.body_stiffness[self.index, self.body(name)].copy()
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
        ends = suspension.owner[suspension.of_cables] == self.body(name)
        return linear_range(self.form, ends[..., None] * np.eye(3)[axis], self.group.steady_drag(self.index))

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

    def statics_error(self, column, number=None):
        """Estimated relative error of a column that needs no motion; zero of one that the scene states. [-]

        `number` is that of the column, which in a steady wind is compared with that of the `coarser` case.
        """
        if column is None:
            return self.group.errors.statics[self.index]
        part, _, quantity = column.name.rpartition(".")
        cable = self.cable(part) if part in self.scene.cables else None
        if column.needs == "scene" and (quantity != "chord" or cable is None or self._ends_held(cable)):
            return 0.0
        error = self._of_part(self.group.errors.statics[self.index], column, number, cable)
        return max(error, self.error_by_drag(column, number, cable))

    def _of_part(self, error, column, number, cable):
        """Relative error of a number, more than that of a cable where larger ones cancel in it (`Column.whole`). [-]"""
        if cable is None or column.whole is None or number is None:
            return error
        whole = self.group.cables.column(f"whole of {column.name.rpartition('.')[2]}", column.whole)
        return float(of_part(error, whole[self.index, cable], number))

    def error_by_drag(self, column, number, cable=None):
        """Relative error of a number of the statics by the parts on which the drag of a steady wind varies. [-]"""
        if self.coarser is None or column.of_reference or not isinstance(number, float) or not isfinite(number):
            return 0.0
        least = self._of_part(self.group.least_error_by_drag(self.index, cable), column, number, cable)
        return float(errors_by_parts(number, number_of(column, self.coarser), least))

    def check(self, column):
        """Raise the NoSolutionError of a column of a cable that the load case lacks."""
        self.refuse_lost(column.name.partition(".")[0])

    def coordinate(self, name, axis):
        """A coordinate of a body or free point, 0 where it is rounding, and its estimated relative error.

        Parameters
        ----------
        name : str
        axis : int
            0 to 2: x, y, z [m]; 3 to 5: roll, pitch, yaw [rad].
        """
        return self.group.coordinates(self.body(name), axis)[self.index]

    def force_displacement(self, name, axis):
        """Displacement of a body or free point along x, y or z (0, 1, 2) by the forces of the load case [m].

        Returned with its estimated relative error. Raises as `group`, and where the load case has no forces.
        """
        if not self.scene.load_case.forces:
            raise NoSolutionError(
                f"{name}.force_displacement needs the key cases.*.forces, which this case does not have"
            )
        of_all = self.group.force_displacement(self.index)
        displacement, by_rounding = (array[self.body(name), axis] for array in of_all)
        if abs(displacement) <= by_rounding:
            return 0.0, self.statics_error(None)
        return displacement, max(self.statics_error(None), by_rounding / abs(displacement))
