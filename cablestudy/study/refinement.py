"""The cheapest model whose error is below an accuracy: elements about the closed form, refined level by level."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, inf, log10

import numpy as np

from cablestudy.cable.element import PER_WAVE
from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study.columns import ROUNDING, relative


@dataclass(frozen=True)
class Settings:
    """Constants of the refinement. Those that scale errors are held against random scenes by tests/test_extremes.py.

    Attributes
    ----------
    lowest, highest : int
        Orders of an element: 3 is the least with a symmetric and an antisymmetric shape inside; beyond 48 two elements
        cost less than one, whose eigenvalue problem grows with the cube of the order.
    finest : int
        Sum of the orders along a piece: eight elements of the highest order, an eigenvalue problem of a second.
    most_unknowns, most_dense : int
        Unknowns beyond which the search ends: the latter where a large share of the modes is needed, for damping or
        more than `many_waves`, and a dense eigenvalue problem is solved.
    many_waves : float
        Half-waves beyond which the size is checked before the first model already.
    growth : float
        Of the order from one triple of levels to the next: the error falls by about a power of ten.
    per_wave, beside_waves : float
        Orders for each half-wave, and besides, from which the error falls exponentially; pi/2 and a little more.
    single, compared : tuple of float
        Orders for each further digit, and besides, of the first level: where one model gives its error by itself, and
        where several are compared.
    trials : int
        Levels in a row without a value of a column, after which it is refused.
    without_gain, rounding_limit : int, float
        Levels in a row whose error does not fall, after which the search ends; where errors are below the latter, so
        that rounding is what remains.
    unresolved : float
        Error over the angle by which the cable turns, where its transverse waves are not resolved.
    noise : float
        Difference of two levels below which rounding may hide how fast the error falls.
    two_levels, two_levels_noise : float
        Error of the finer of two levels over their difference, above `noise` and below.
    three_levels, least_of_three : float
        Safety factor on the error extrapolated from three levels, and the least share of their last difference.
    modal_rounding : float
        Least error of numbers that sum many modes, whose rounding neighbouring levels may share.
    numbers : int
        In the models that are solved at once: 2.4 MB, what a processor's cache holds.
    """

    lowest: int = 3
    highest: int = 48
    finest: int = 380
    most_unknowns: int = 12000
    most_dense: int = 2000
    many_waves: float = 100
    growth: float = 1.3
    per_wave: float = PER_WAVE
    beside_waves: float = 3
    single: tuple = (1.0, 0.75)
    compared: tuple = (0.9, 1.0)
    trials: int = 6
    without_gain: int = 2
    rounding_limit: float = 1e-5
    unresolved: float = 10
    noise: float = 1e-8
    two_levels: float = 1.0
    two_levels_noise: float = 3.0
    three_levels: float = 10
    least_of_three: float = 0.03
    modal_rounding: float = 1e-10
    numbers: int = 300_000


SETTINGS = Settings()
REFERENCE = 1e-6  # accuracy of the model against which the motion of a fixed model is held: above it, errors are true


def levels(first):
    """Yield levels (elements along the piece with most waves, order), finer and finer.

    Parameters
    ----------
    first : float
        Sum of the orders to begin with.
    """
    total = min(max(ceil(first), SETTINGS.lowest), SETTINGS.finest)
    while True:
        elements = ceil(total / (SETTINGS.highest - 4))
        order = ceil(total / elements)
        for more in (0, 2, 4):  # an odd step may leave the symmetric shapes as they are
            yield elements, order + more
        if total >= SETTINGS.finest:
            return
        total = min(ceil(SETTINGS.growth * elements * (order + 4)), SETTINGS.finest)


def resolving(waves):
    """Sum of orders from which so many half-waves along a piece are resolved."""
    return SETTINGS.per_wave * waves + SETTINGS.beside_waves


@dataclass(frozen=True)
class AccuracyNeeds:
    """What of a cable's motion the numbers of one case depend on.

    Attributes
    ----------
    waves : float
        Estimated number of transverse half-waves along the cable, for the first level. [-]
    highest : callable
        Case, values -> highest frequency that they depend on. [Hz]
    least : callable
        Case -> a frequency on which they depend in any case, known before the values; 0 for none. [Hz]
    damped : bool
        Whether damping matters: rounding shared by two levels is possible, and three are compared.
    single : bool
        Whether one model gives the errors of all values by itself.
    """

    waves: float
    highest: Callable
    least: Callable = lambda case: 0.0
    damped: bool = False
    single: bool = False


def needs_of(case, required):
    """What the columns that need motion depend on.

    Parameters
    ----------
    case : Case
    required : ColumnRequirements
        With at least one such column.

    Returns
    -------
    AccuracyNeeds

    Raises
    ------
    NoSolutionError, ConvergenceError
        The case has no motion.
    """
    results, axial, body = case.results, required.axial, required.gondola
    axial_waves, travel_time = float(results.axial_waves[case.index]), float(results.travel_time[case.index])

    def highest(finer, values):
        found = max([values.get(column.header, 0.0) for column in required.modes], default=0.0)
        return max(found, finer.gondola_frequency) if body else found

    # Dunkerley: masses on the cable lower its axial mode k at most by this
    carried = sum(mass for _, mass in case.span.point_masses)
    slower = np.sqrt(1 + (axial * np.pi / 2) ** 2 * carried)

    def least(finer):
        # half of k c/(2 L): neighbouring modes shift an axial one
        alone = axial * axial_waves / (4 * travel_time) / slower if axial else 0.0
        return max(alone, finer.gondola_frequency) if body else alone

    waves = _half_waves(case, required)
    return AccuracyNeeds(waves, highest, least, required.damped, required.frequencies_only)


def _half_waves(case, required):
    """Estimated number of transverse half-waves along the cable that the columns depend on. [-]"""
    results, index, waves = case.results, case.index, required.waves
    if required.sagging_waves > waves:
        waves = max(waves, min(required.sagging_waves, float(results.sag_waves[index])))
    if (
        required.axial
        and SETTINGS.unresolved * case.refined(1, SETTINGS.lowest).waves(0.0)[1] > case.scene.model.accuracy
    ):
        # an axial mode of a curved cable excites the transverse waves
        waves = max(waves, required.axial * float(results.axial_waves[index]))
    if required.gondola:
        waves = max(waves, 2 * case.gondola_frequency_static * float(results.travel_time[index]))
    return waves


@dataclass
class Refinement:
    """The refinement of one case.

    A frequency of the cable has an error estimate of its own, by what the highest orders contribute to its shape. Other
    values are compared over levels: of three neighbours the differences d1 and d2 show how fast the error falls, and
    the error that is left is d2 (d2/d1)^(step/last step), times a safety factor. Two levels suffice where the waves
    are resolved and nothing is damped. A model that does not resolve the transverse waves at a frequency agrees with
    its neighbours on a number that ignores them: where the cable turns by an angle, it may be wrong by
    `Settings.unresolved` times as much.

    Parameters
    ----------
    case : Case
    sample : callable
        Case, headers that are refused -> values, errors, failures; see `ColumnRequirements.sample`.
    needs : AccuracyNeeds

    Attributes
    ----------
    finer : Case or None
        At the next level to be examined; None when the search has ended.
    used : Case
        At the level whose values are taken.
    values, errors : dict
        Header -> number, and its estimated relative error: those within the accuracy.
    failures : dict
        Header -> CablestudyError of a column that cannot be had.
    tried : int
        Levels examined.
    """

    case: object
    sample: Callable
    needs: AccuracyNeeds
    finer: object = None
    used: object = None
    values: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)
    failures: dict = field(default_factory=dict)
    tried: int = 0

    def __post_init__(self):
        self.used, self._accuracy = self.case, self.case.scene.model.accuracy
        index, results = self.case.index, self.case.results
        self._rounding = float(results.motion_rounding[index])
        self._history, self._missing, self._last_waves, self._needed = [], {}, 0.0, 0.0
        self._reached, self._best, self._no_gain = "the finest model is too coarse", inf, 0
        per_digit, more = SETTINGS.single if self.needs.single else SETTINGS.compared
        orders = SETTINGS.per_wave * self.needs.waves * float(results.longest_segment[index])
        digits, elements = per_digit * -log10(self._accuracy) + more, 1
        if self.needs.single:  # each element needs its digits; levels that are compared may begin coarse
            elements = max(1, ceil(orders / max(SETTINGS.highest - 4 - digits, 1)))
        self._levels = levels(orders + elements * digits)
        self.advance()

    def advance(self):
        """Go to the next level that resolves the waves known so far."""
        level = next((one for one in self._levels if one[0] * one[1] >= self._needed), None)
        if level is None:
            self._give_up(self._reached)
        else:
            self.finer = self.case.refined(*level)

    def examine(self):
        """Compute the values at this level; end the search, or go to the next one."""
        self.tried += 1
        if self._too_large():
            unknowns = self.finer.excited.dof
            self._give_up(f"about {self.needs.waves:.3g} waves along the cable, and {unknowns} unknowns, are too many")
            return
        try:
            found = self._values_where_resolved()
        except CablestudyError as error:
            found = {}, {}, {None: error}, 0.0
        if found is not None:
            self._judge(*found)
        if self.finer is not None:
            self.advance()

    def _too_large(self):
        many = self.needs.waves > SETTINGS.many_waves
        limit = SETTINGS.most_dense if many or self.needs.damped else SETTINGS.most_unknowns
        return (self._history or many) and self.finer.excited.dof > limit

    def _unresolved(self, frequency):
        """Error by transverse waves that are not resolved, 0 where they are; and how many half-waves there are. [-]"""
        if not frequency:
            return 0.0, 0.0
        waves, turn = self.finer.waves(frequency)
        resolved = resolving(waves) <= self.finer.level[0] * self.finer.level[1]
        return 0.0 if resolved else SETTINGS.unresolved * turn, waves

    def _values_where_resolved(self):
        """Values, errors and failures of a sample, and the error by waves that are not resolved; None of too many."""
        found, (unresolved, waves) = None, self._unresolved(self.needs.least(self.finer))
        if unresolved <= self._accuracy:
            found = self.sample(self.finer, self.failures)
            unresolved, waves = self._unresolved(self.needs.highest(self.finer, found[0]))
        settled, self._last_waves = abs(waves - self._last_waves) < 0.1 * self._last_waves, waves
        if unresolved <= self._accuracy:
            return *found, unresolved
        self._history, self._needed = [], min(resolving(waves), SETTINGS.finest)
        if settled and resolving(waves) > SETTINGS.finest:
            most = (SETTINGS.finest - SETTINGS.beside_waves) / SETTINGS.per_wave
            self._give_up(f"more waves along a piece of the cable than the {most:.0f} that the finest model resolves")
        return None

    def _judge(self, values, known_errors, failures, unresolved):
        """Keep the values that are within the accuracy, and end the search where no others remain."""
        self._refuse(failures)
        pending = failures.keys() - self.failures.keys()
        if self._history and self._history[-1][1].keys() != values.keys():
            self._history = []  # other values: they do not show how the error falls
        if not values:
            if not pending:
                self.used, self.finer = self.finer, None
            return
        self._history.append((self.finer.level[0] * self.finer.level[1], values))
        left = {header: self._error_left(header, known_errors.get(header), unresolved) for header in values}
        errors = {header: max(self._rounding, unresolved, error) for header, error in left.items() if error is not None}
        good = {header: error for header, error in errors.items() if error <= self._accuracy}
        self.used, self.errors, self.values = self.finer, good, {header: values[header] for header in good}
        if len(errors) < len(values):
            return
        if len(good) == len(values):
            self.finer = self.finer if pending else None
            return
        worst = max(errors.values())
        self._no_gain = self._no_gain + 1 if self._best <= worst < SETTINGS.rounding_limit else 0
        self._best = min(worst, self._best)
        self._reached = f"the error reached is about {self._best:.1e}"
        if self._no_gain == SETTINGS.without_gain:
            self._give_up(self._reached)

    def _error_left(self, header, known, unresolved):
        """Relative error that is left in a value at this level; None where more levels are needed. [-]"""
        if known is not None:
            return known
        count = len(self._history)
        if count < 2 or (count == 2 and (self.needs.damped or unresolved)):
            return None
        left = left_of_two if count == 2 else left_of_three
        least = max(SETTINGS.modal_rounding, self.finer.omitted)
        return max(least, left([(orders, values[header]) for orders, values in self._history[-3:]]))

    def _refuse(self, failures):
        """Refuse the columns that failed again in the same way: a finer level may have the mode that a coarse lacks."""
        missing = {}
        for header, error in failures.items():
            before, count = self._missing.get(header, (None, 0))
            missing[header] = error, count + 1
            if count and (str(before) == str(error) or count == SETTINGS.trials):
                self.failures[header] = error
        self._missing = missing

    def _give_up(self, reached):
        """End the search; the values that are not within the accuracy cannot be had."""
        self.finer = None
        missing = {header: error for header, (error, _) in self._missing.items()}
        remaining = self._history[-1][1].keys() - self.values.keys() if self._history else ()
        error = ConvergenceError(f"accuracy {self._accuracy:g} cannot be had: {reached}")
        self.failures |= missing | dict.fromkeys(remaining, error)
        if not (self.failures or self.values):
            self.failures[None] = error


def refine(searches, prepare):
    """Refine many cases until the values of each are within its accuracy, or cannot be had.

    Level by level, the coarsest first: the models of the cases at one level are solved at once, their values judged,
    and the cases that are not finished go on.

    Parameters
    ----------
    searches : list of Refinement
    prepare : callable
        List of cases at one level -> None; solves their models together.
    """
    waiting = [search for search in searches if search.finer is not None]
    while waiting:
        level = min(search.finer.level for search in waiting)
        chosen = [search for search in waiting if search.finer.level == level]
        chosen = chosen[: max(1, SETTINGS.numbers // chosen[0].finer.size)]
        if len(chosen) > 1:
            prepare([search.finer for search in chosen])
        for search in chosen:
            search.examine()
        waiting = [search for search in waiting if search.finer is not None]


def left_of_two(history):
    """Relative error that is left in the second of two values whose waves are resolved. [-]

    Parameters
    ----------
    history : sequence of (float, float or None)
        Sum of orders, value.
    """
    (_, before), (_, last) = history
    difference = relative(last, before)
    return difference * (SETTINGS.two_levels if difference > SETTINGS.noise else SETTINGS.two_levels_noise)


def left_of_three(history):
    """Relative error that is left in the last of three values, by how fast their differences fall; see `left_of_two`.

    [-]
    """
    orders, values = zip(*history, strict=True)
    last, before = relative(values[2], values[1]), relative(values[1], values[0])
    if last < ROUNDING or None in values or not last < before < 0.1:
        return last if last < ROUNDING or before > last else SETTINGS.three_levels * last
    rest = (last / before) ** ((orders[2] - orders[1]) / (orders[1] - orders[0]))
    return last * max(SETTINGS.three_levels * rest, SETTINGS.least_of_three if last > SETTINGS.noise else 1.0)


def reference_scene(scene):
    """The same scene, of one cable or of a suspension, with a model to an accuracy of REFERENCE."""
    model = scene.model.model_copy(update={"elements": None, "order": 1, "mass": "lumped", "accuracy": REFERENCE})
    return scene.model_copy(update={"model": model})
