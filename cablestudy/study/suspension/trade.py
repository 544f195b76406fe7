"""Models that `trade` compares of a suspension: closed forms, bars, high orders and error control, for all cables."""

from functools import partial
from math import isnan

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.study.column import DISCRETE, least_work_first, value_and_error
from cablestudy.study.columns import COUPLED_MODE, find
from cablestudy.study.one_cable.trade import ACCURACIES, LEVELS, ComparedModel, element_models, power, with_elements
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.notes import strength_warning as strength_warning
from cablestudy.study.suspension.rows import OF_THE_WHOLE
from cablestudy.system.coupled import Layout
from cablestudy.system.hanging_cables import UNDAMPED, Cables

FREQUENCIES = (1, 2, 8)  # numbers of the modes that are compared by default
LARGEST = {False: 3_000, True: 150_000}  # displacements of the largest model, dense and sparse: a few seconds, 2 GB


def default_columns(scene):
    """The columns that are compared where none are named: list of Column."""
    stiffness = [f"{name}.stiffness_zz" for name in list(scene.bodies)[:1]]
    return list(map(find, ["max_tension", *stiffness, *(f"frequency_{number}" for number in FREQUENCIES)]))


def reference_case(scene):
    """The case on which the reference rests: its statics are closed forms.

    Raises
    ------
    NoSolutionError, ConvergenceError
        It has no stable equilibrium.
    """
    return SuspensionCase(scene, SuspensionCase(scene).group)


def reference_levels(case):
    """Finer and finer models of the coupled modes: a function, `Column` -> list of (name, SuspensionCase)."""
    fits, levels = _size_limit(case), []
    for n, order in LEVELS:
        if fits(n * order):
            finer = SuspensionCase(with_elements(case.scene, n, order, "lumped"), case.group)
            levels.append((f"{n} x order {order} of each cable", finer))
    return lambda column: levels


def exact_value(column, case):
    """A number of a case of the reference, and its relative error by anything but its elements."""
    number, error = _value(column, case)
    return number, 0.0 if isnan(error) else error


def missing_key(scene, column):
    """An empty text: `columns.why_not` has the message on a missing key."""
    return ""


def comparable(_, column):
    """The column itself: models of a suspension have every column."""
    return column


def models_of(scene, columns):
    """Models that `trade` compares by their values of some columns: list of `ComparedModel`, without too large ones.

    Closed forms, models with an accuracy, and fixed elements of several numbers and orders; models on which none of the
    columns depends are left out.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no stable equilibrium.
    """
    models = [
        ComparedModel("closed form", "catenary", _case, needs=("statics", "stiffness"), compute=_static_value,
                      count_dof=lambda _: 0, stated_error=_stated_error),
        ComparedModel("closed form", "static stiffness", _case, needs=("modes",), compute=_static_frequency,
                      count_dof=_free_displacements),
    ]  # fmt: skip

    def add(family, name, change):
        """Add the model of a scene that the function `change` makes of the scene."""
        build = partial(_case, change=change)
        options = DISCRETE, _number, lambda case: case.size, _stated_error, least_work_first
        models.append(ComparedModel(family, name, build, *options))

    for accuracy in ACCURACIES:
        add("error control", f"accuracy {power(accuracy)}", partial(with_accuracy, accuracy=accuracy))
    fits = _size_limit(SuspensionCase(scene))
    for family, name, n, order, mass in element_models():
        if fits(n * order):
            add(family, name, partial(with_elements, elements=n, order=order, mass=mass))
    return [model for model in models if any(column.needs in model.needs for column in columns)]


def _case(scene, _=(), change=lambda scene: scene):
    """The case of a changed scene, with nothing cached."""
    return SuspensionCase(change(scene))


def _size_limit(case):
    """Function of the number of segments along each cable: True if the model is small enough to be compared."""
    layout, cables = Layout(case.equilibrium), len(case.scene.cables)
    return lambda segments: 3 * (segments - 1) * cables <= LARGEST[layout.large]


def _value(column, case):
    """A number, and the relative error that its model states of it, not a number where it states none."""
    return value_and_error(OF_THE_WHOLE.get(column.name, column), case)


def _number(column, case):
    """A number of a case, without its error."""
    return _value(column, case)[0]


def _stated_error(column, case):
    """Relative error that the model states of a number, or None. [-]"""
    error = _value(column, case)[1]
    return None if isnan(error) else error


def _static_value(column, case):
    """A number of the statics; NoSolutionError for other columns."""
    if column.needs in DISCRETE:
        raise NoSolutionError("statics alone")
    return _number(column, case)


def _free_displacements(case):
    """Number of free displacements of bodies and junctions. [-]"""
    return int(case.equilibrium.suspension.free.sum())


def _static_frequency(column, case):
    """Frequency of a column by a common shortcut: bodies on the static stiffness of cables that have no modes. [Hz]

    The mass of each cable is that of a straight one whose ends move: a third of it at an end that moves alone.

    Raises
    ------
    NoSolutionError
        The column is no frequency, or its number is above the number of free displacements.
    """
    match = COUPLED_MODE.fullmatch(column.name)
    if not match:
        raise NoSolutionError("frequencies alone")
    body, number = match[1][:-1], int(match[2])
    if body:
        frequencies = case.static_frequencies(body)
    else:
        equilibrium = case.equilibrium
        cables = Cables(equilibrium.catenary, UNDAMPED)
        reduced = Layout(equilibrium).without_modes(cables.end_stiffness, cables.straight_inertia)
        frequencies = reduced.lowest(number)[0] / (2 * np.pi)
        frequencies = frequencies[np.isfinite(frequencies)]
    if number > len(frequencies):
        raise NoSolutionError(f"{len(frequencies)} free displacements have no mode {number}")
    return float(frequencies[number - 1])
