"""One case of one cable at rest: its statics in closed form or by elements, each number computed when asked for."""

from functools import cached_property, partial

import numpy as np

from cablestudy.cable.catenary_in_drag import errors_by_parts
from cablestudy.cable.geometry import midspan
from cablestudy.study.column import number_of
from cablestudy.study.one_cable.elements import ElementResults, elements_of
from cablestudy.study.one_cable.results import Results
from cablestudy.study.stated_numbers import StatedNumbers
from cablestudy.study.statics import ClosedStatics, ElementStatics


def shared(function):
    """Decorator that makes a method of `CableCase` a property which is computed once for all equal cases.

    The result is kept in the case (`CableCase.computed`) and among those of its level of refinement
    (`CableCase.cache`). Where it is computed for many cases at once, the property is set.
    """
    name = function.__name__

    def get_result(case):
        if name not in case.computed:
            if name not in case.cache:
                case.cache[name] = function(case)
            case.computed[name] = case.cache[name]
        return case.computed[name]

    def set_result(case, result):
        case.computed[name] = case.cache[name] = result

    return property(get_result, set_result, doc=function.__doc__)


def of_results(name, meaning):
    """Property of a `CableCase`: the number of its row in an attribute of `Results`."""
    return property(lambda case: getattr(case.results, name)[case.index], doc=meaning)


class OneCableAtRest:
    """One cable in one load case, a row of `Results`, and its numbers at rest, for the columns of tables.

    Parameters
    ----------
    scene : CableScene
    results : Results, optional
        Statics of a batch to which the case belongs; by default those of this scene alone.
    index : int
        Row of the case in the batch.
    level : tuple of int, optional
        (elements along the piece with most waves, order) of the motion about the closed form; without it the elements
        are those that the scene states in `model.elements`.
    cache_by_level : dict, optional
        Level -> `cache`, to be filled: one for all cases that are equal by `Results.first_equal`.

    Attributes
    ----------
    exact_statics : bool
        True if statics and end stiffness are those of the closed form, not of a fixed number of elements.
    cache : dict
        Name -> result, shared by equal cases at this level of refinement.
    computed : dict
        Name -> result of each `shared` property that this case was asked for.
    """

    def __init__(self, scene, results=None, index=0, level=None, cache_by_level=None):
        self.scene, self.index, self.level = scene, index, level
        self.exact_statics = scene.model.elements is None
        self.results = results or Results(StatedNumbers([scene]))
        self._cache_by_level, self.computed = {} if cache_by_level is None else cache_by_level, {}
        self.cache = self._cache_by_level.setdefault(level, {})

    def number(self, path):
        """A number that the scene states; see `StatedNumbers.number`."""
        return self.results.number(path)[self.index]

    reference_length = of_results("reference_length", "Unstretched length in the reference state. [m]")
    end_1 = of_results("end_1", "Position of end 1, shape (3,). [m]")
    chord = of_results("chord", "Distance of the ends. [m]")
    limp = of_results("limp", "True if the cable is longer than its chord without any load.")
    planar = of_results("planar", "True if no load leaves the cable's plane: motion in it and across it decouple.")
    force_on_gondola = of_results("force_on_gondola", "Force of the wind on the gondola along x, see `Results`. [N]")

    @property
    def statics_error(self):
        """Relative error of the statics in closed form due to rounding and to what they leave out. [-]"""
        return float(max(self.results.statics_rounding[self.index], self.results.model_error[self.index]))

    @cached_property
    def span(self):
        """The cable, with its unstretched length: `Span`.

        Raises
        ------
        NoSolutionError
            No such cable exists, or it has no equilibrium.
        """
        self.results.check(self.index)
        return self.results.span.take(self.index)

    @property
    def point_masses(self):
        """Point masses on the cable, as for its `span`; raises as this."""
        self.results.check(self.index)
        return () if self.results.span.load_masses is None else self.span.point_masses

    @cached_property
    def continuous(self):
        """The continuous cable where it hangs: `Catenary`, or in a steady wind `CatenaryInDrag`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none.
        """
        self.results.check(self.index)
        return self.results.form.take(self.index)

    @cached_property
    def statics(self):
        """Statics of the model: `ClosedStatics` or `ElementStatics`."""
        if self.exact_statics:
            return ClosedStatics(self.continuous)
        return ElementStatics(self.state, self.convergence, self.continuous.middle)

    @property
    def form(self):
        """The cable in equilibrium, `continuous` or `State`: an argument of the functions of `cable.geometry`."""
        return self.continuous if self.exact_statics else self.state

    @property
    def middle(self):
        """Arc length at mid-span over unstretched length. [-]"""
        return self.continuous.middle if self.exact_statics else midspan(self.state)

    def hanging(self, _):
        """Its cable of any name, as for a suspension: itself."""
        return self

    def form_of(self, span):
        """The continuous cable with other loads than its own, by its `Span`: `Catenary` or `CatenaryInDrag`."""
        return self.results.form_of(span, self.index)

    @property
    def force_displacement(self):
        """Displacement of end 2 along x by the force of the load case [m], and its relative error."""
        shift, error = self.results.force_displacement
        return shift[self.index], error[self.index]

    def closed_form_error(self, column, number):
        """Relative error of a number of the statics that is computed case by case, None where none is stated. [-]"""
        if not column.least_error or number is None:
            return column.least_error
        return max(column.least_error, self.statics_error, self.error_by_drag(partial(number_of, column)))

    def error_by_drag(self, compute):
        """Relative error of a number by the parts on which the drag of a steady wind varies; 0 without one. [-]

        `compute` is a function of the case; the elements that a scene states have no such parts.
        """
        if self.coarser is None or not self.exact_statics:
            return 0.0
        return float(errors_by_parts(compute(self), compute(self.coarser), self.form.least_errors))

    @cached_property
    def coarser(self):
        """Case of the same class with drag that varies on half as many parts; None without a steady wind."""
        return self.results.coarser and type(self)(self.scene, self.results.coarser, self.index)

    @shared
    def elements(self):
        """The elements, perhaps with those of other cases: `BatchElements`, and the row of this case among them.

        Raises
        ------
        ConvergenceError, NoSolutionError
            No equilibrium of the elements, or a cable that hangs folded.
        """
        return elements_of(self)

    @cached_property
    def state(self):
        """The elements in equilibrium: `State`."""
        elements, row = self.elements
        return elements.state.take(row)

    @property
    def convergence(self):
        """`NewtonRecord` of the iteration to equilibrium of fixed elements."""
        elements, row = self.elements
        return elements.record.of(row)

    @cached_property
    def by_elements(self):
        """Statics of the elements, perhaps with those of other cases: `ElementResults`, and the row of this case."""
        elements, row = self.elements
        return ElementResults(self.results, np.array([self.index]), elements.take(np.array([row]))), 0

    @property
    def statics_of_model(self):
        """Statics in closed form, or of stated elements: `Results` of many cases, and the row of this one; raises."""
        if not self.exact_statics:
            return self.by_elements
        self.results.check(self.index)
        return self.results, self.index

    def end_stiffness_along(self, axis, moved=None):
        """Static stiffness of end 2, end 1 fixed: force along an axis per displacement along it or another. [N/m]

        Parameters
        ----------
        axis : int
            Of the force: 0, 1, 2 for x, y, z.
        moved : int, optional
            Axis of the displacement, by default the same.
        """
        results, index = self.statics_of_model
        return float(results.end_stiffness_along(axis, moved)[index])

    @property
    def slow_stiffness(self):
        """Force on end 2 along x per slow displacement along x, see `Results.slow_stiffness`. [N/m]"""
        results, index = self.statics_of_model
        return float(results.slow_stiffness[index])
