"""Search for the coarsest finite-element model of a cable whose results have an asked accuracy, level by level.

The elements are linearised about the equilibrium in closed form (`cable.catenary`); each level has more of them on the
piece with most waves, or a higher order. A piece is a part along which the cable bends little (`meshes.pieces`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, inf, log10

import numpy as np

from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study.tolerances import STUDY


def levels(least_sum):
    """Yield levels (elements along the piece with most waves, order), finer and finer.

    Parameters
    ----------
    least_sum : float
        Sum of the orders to begin with.
    """
    total = min(max(ceil(least_sum), STUDY.lowest_order), STUDY.finest_orders)
    while True:
        elements = ceil(total / (STUDY.highest_order - 4))
        order = ceil(total / elements)
        for increment in (0, 2, 4):  # an odd step may leave the symmetric shapes as they are
            yield elements, order + increment
        if total >= STUDY.finest_orders:
            return
        total = min(ceil(STUDY.order_growth * elements * (order + 4)), STUDY.finest_orders)


def levels_for(case, waves):
    """The `levels` of a case to its accuracy, from those on that resolve some half-waves along its cable."""
    orders = CABLE.orders_per_half_wave * waves * float(case.results.longest_segment[case.index])
    digits = STUDY.orders_per_digit * -log10(case.scene.model.accuracy) + STUDY.orders_without_digits
    elements = max(1, ceil(orders / max(STUDY.highest_order - 4 - digits, 1)))  # each element needs its digits
    return levels(orders + elements * digits)


def least_order_sum(waves):
    """Least sum of orders along a piece that resolves a number of half-waves along it."""
    return CABLE.orders_per_half_wave * waves + STUDY.orders_without_waves


def needs_of(case, required):
    """Estimate which waves and frequencies the finite-element model of one case must resolve, before any is solved.

    Parameters
    ----------
    case : CableCase
    required : AskedModes
        The modes whose frequencies are asked for, at least one.

    Returns
    -------
    waves : float
        Estimated number of transverse half-waves along the cable; it decides how fine the first model is. [-]
    least : float
        Lower bound of the highest axial frequency that is asked for; 0 if there is none. [Hz]

    Raises
    ------
    NoSolutionError, ConvergenceError
        The case has no equilibrium.
    """
    case.results.check(case.index)
    return _half_waves(case, required), _least_axial_frequency(case, required.axial) if required.axial else 0.0


def _least_axial_frequency(case, number):
    """Lower bound of the frequency of an axial mode by its number, from 1. [Hz]"""
    results, index = case.results, case.index
    # Dunkerley: masses on the cable lower its axial mode k at most by this
    lowered_by = np.sqrt(1 + (number * np.pi / 2) ** 2 * sum(mass for _, mass in case.point_masses))
    # half of k c/(2 L): neighbouring modes shift an axial one
    return number * float(results.axial_waves[index]) / (4 * float(results.travel_time[index])) / lowered_by


def _half_waves(case, required):
    """Estimated number of transverse half-waves along the cable that the columns depend on. [-]"""
    results, index, waves = case.results, case.index, required.waves
    if required.sagging_waves > waves:
        waves = max(waves, min(required.sagging_waves, float(results.sag_waves[index])))
    if (
        required.axial
        and STUDY.unresolved_turn * case.refined(1, STUDY.lowest_order).waves(0.0)[1] > case.scene.model.accuracy
    ):
        # an axial mode of a curved cable excites the transverse waves
        waves = max(waves, required.axial * float(results.axial_waves[index]))
    return waves


@dataclass
class Refinement:
    """Search for the coarsest finite-element model of one case whose values are within its accuracy, level by level.

    A level is a number of elements and their order. Each frequency has an error estimate of its own, by what the
    highest orders contribute to its shape. A model that does not resolve the transverse waves at a frequency ignores
    them. Its relative error of this frequency is estimated as `unresolved_turn` times the angle [rad] by which the
    direction of the cable changes along it.
    """

    case: object  # CableCase, whose scene states the accuracy
    # case with its elements, names to leave out -> three dicts of name -> value, relative error, and CablestudyError of
    # a value that cannot be computed
    compute: Callable
    waves: float  # half-waves along the cable that the model must resolve, from `needs_of` [-]
    least: float = 0.0  # frequency that the model must resolve [Hz]
    finer: object = None  # the case at the next level to be examined; None when the search has ended
    used: object = None  # the case at the level whose values are taken
    values: dict = field(default_factory=dict)  # name -> number, of those within the accuracy
    errors: dict = field(default_factory=dict)  # name -> their estimated relative error
    failures: dict = field(default_factory=dict)  # name -> CablestudyError of a number that does not reach the accuracy
    tried: int = 0  # number of levels examined

    def __post_init__(self):
        self.used, self._accuracy = self.case, self.case.scene.model.accuracy
        index, results = self.case.index, self.case.results
        self._rounding = float(results.motion_rounding[index])
        self._values_of_level, self._last_failures, self._last_waves, self._least_orders = {}, {}, 0.0, 0.0
        self._message, self._least_error, self._levels_without_gain = "the finest model is too coarse", inf, 0
        self._levels = levels_for(self.case, self.waves)
        self.advance()

    def of(self, name):
        """A value that was found, and its estimated relative error; raises the error of one without a value."""
        if name in self.values:
            return self.values[name], self.errors[name]
        raise self.failures.get(name) or self.failures[None]

    def advance(self):
        """Go to the next level that resolves the waves known so far."""
        fine_enough = (level for level in self._levels if level[0] * level[1] >= self._least_orders)
        level = next(fine_enough, None)
        if level is None:
            self._give_up(self._message)
        else:
            self.finer = self.case.refined(*level)

    def examine(self):
        """Compute the values at this level; end the search, or go to the next one."""
        self.tried += 1
        if self._too_large():
            unknowns = self.finer.in_plane.dof
            self._give_up(f"about {self.waves:.3g} waves along the cable, and {unknowns} unknowns, are too many")
            return
        try:
            computed = self._values_where_resolved()
        except CablestudyError as error:
            computed = {}, {}, {None: error}, 0.0  # None: of all columns
        if computed is not None:
            self._judge(*computed)
        if self.finer is not None:
            self.advance()

    def _too_large(self):
        """True if the model of this level has too many unknowns to be solved."""
        many_waves = self.waves > STUDY.many_waves
        limit = STUDY.most_dense_unknowns if many_waves else STUDY.most_unknowns
        return (self._values_of_level or many_waves) and self.finer.in_plane.dof > limit

    def _unresolved(self, frequency):
        """Relative error at a frequency [Hz] by unresolved transverse waves, else 0; number of half-waves. [-]"""
        if not frequency:
            return 0.0, 0.0
        waves, turn = self.finer.waves(frequency)
        resolved = least_order_sum(waves) <= self.finer.level[0] * self.finer.level[1]
        return 0.0 if resolved else STUDY.unresolved_turn * turn, waves

    def _values_where_resolved(self):
        """Values, errors and failures by this level, and the error by unresolved waves: arguments of `_judge`.

        None where the error by unresolved waves is above the accuracy: a finer level is then needed, or, if the finest
        one does not resolve the waves either and their number has settled, the search ends.
        """
        computed, (unresolved, waves) = None, self._unresolved(self.least)
        if unresolved <= self._accuracy:
            computed = self.compute(self.finer, self.failures)
            unresolved, waves = self._unresolved(max(computed[0].values(), default=0.0))
        settled, self._last_waves = abs(waves - self._last_waves) < 0.1 * self._last_waves, waves
        if unresolved <= self._accuracy:
            return *computed, unresolved
        self._values_of_level, self._least_orders = {}, min(least_order_sum(waves), STUDY.finest_orders)
        if settled and least_order_sum(waves) > STUDY.finest_orders:
            most = (STUDY.finest_orders - STUDY.orders_without_waves) / CABLE.orders_per_half_wave
            self._give_up(f"more waves along a piece of the cable than the {most:.0f} that the finest model resolves")
        return None

    def _judge(self, values, estimated_errors, failures, unresolved):
        """Keep the values of this level that are within the accuracy, and end the search if no finer level is needed.

        The search ends when all values are within the accuracy and a finer level would not give missing values. It also
        ends when the largest error, below `STUDY.rounding_limit`, has stopped falling: only rounding is left of it. The
        three dicts are those of `compute`, where the key None of `failures` stands for all names; `unresolved` is the
        relative error by transverse waves that are too short for the elements of this level.
        """
        self._refuse(failures)
        pending = failures.keys() - self.failures.keys()  # columns to which a finer level may give a number
        if not values:
            if not pending:
                self.used, self.finer = self.finer, None
            return
        least = max(self._rounding, unresolved)
        errors = {header: error if error > least else least for header, error in estimated_errors.items()}
        within_accuracy = {header: error for header, error in errors.items() if error <= self._accuracy}
        self._values_of_level, self.used, self.errors = values, self.finer, within_accuracy
        self.values = {header: values[header] for header in within_accuracy}
        if len(within_accuracy) == len(values):
            self.finer = self.finer if pending else None
            return
        worst = max(errors.values())
        without_gain = self._least_error <= worst < STUDY.rounding_limit
        self._levels_without_gain = self._levels_without_gain + 1 if without_gain else 0
        self._least_error = min(worst, self._least_error)
        self._message = f"the error reached is about {self._least_error:.1e}"
        if self._levels_without_gain == STUDY.levels_without_gain:
            self._give_up(self._message)

    def _refuse(self, failures):
        """Refuse columns that failed twice in the same way, or often: a finer level may have a mode that this lacks."""
        missing = {}
        for header, error in failures.items():
            previous_error, count = self._last_failures.get(header, (None, 0))
            missing[header] = error, count + 1
            if count and (str(previous_error) == str(error) or count == STUDY.levels_without_value):
                self.failures[header] = error
        self._last_failures = missing

    def _give_up(self, reached):
        """End the search; values that are not within the accuracy fail, with a message on what was reached."""
        self.finer = None
        missing = {header: error for header, (error, _) in self._last_failures.items()}
        remaining = self._values_of_level.keys() - self.values.keys()
        error = ConvergenceError(f"accuracy {self._accuracy:g} cannot be reached: {reached}")
        self.failures |= missing | dict.fromkeys(remaining, error)
        if not (self.failures or self.values):
            self.failures[None] = error


def refine(searches, prepare):
    """Refine the models of many cases until the values of each are within its accuracy, or its finest model is reached.

    A level is a number of elements and their order. Level by level, the coarsest first, the models of the cases at one
    level are solved together. The cases whose values are not accurate enough go on to their next level.

    Parameters
    ----------
    searches : list of Refinement
        One for each case; they hold the results.
    prepare : callable
        Solves the models of several cases at one level together: list of CableCase -> None.
    """
    waiting = [search for search in searches if search.finer is not None]
    while waiting:
        level = min(search.finer.level for search in waiting)
        batch = [search for search in waiting if search.finer.level == level]
        batch = batch[: max(1, STUDY.numbers_at_once // batch[0].finer.model_numbers)]
        if len(batch) > 1:
            prepare([search.finer for search in batch])
        for search in batch:
            search.examine()
        waiting = [search for search in waiting if search.finer is not None]


def with_accuracy(scene, accuracy):
    """Copy of a scene, of one cable or of a suspension, with a model to an accuracy."""
    return with_elements(scene, None, 1, "lumped", accuracy)


def with_elements(scene, elements, order, mass, accuracy=None):
    """Copy of a scene with a fixed number of elements, their order and their mass matrix."""
    model = {"accuracy": accuracy, "elements": elements, "order": order, "mass": mass}
    return scene.model_copy(update={"model": scene.model.model_copy(update=model)})


def fixed_model(scene, drag):
    """`FixedModel` of a scene, whose elements follow a drag; None where it states an accuracy."""
    from cablestudy.system.hanging_cables import FixedModel

    model = scene.model
    return FixedModel(model.elements, model.order, model.mass, drag) if model.elements else None


def reference_scene(scene):
    """Copy of a scene with a model to `STUDY.reference_accuracy`."""
    return with_accuracy(scene, STUDY.reference_accuracy)
