"""Models that `trade` compares of a suspension: closed forms, bars, high orders and error control, for all cables."""

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.study.column import DISCRETE
from cablestudy.study.columns import COUPLED_MODE, find
from cablestudy.study.compared_models import LEVELS, ComparedModel, controlled_models, element_models
from cablestudy.study.refinement import with_elements
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
    names = ["max_tension", *stiffness, *(f"frequency_{number}" for number in FREQUENCIES)]
    return [comparable(scene, find(name)) for name in names]


def reference_levels(case):
    """Finer and finer models of the coupled modes: list of (name, SuspensionCase)."""
    fits, levels = _size_limit(case), []
    for n, order in LEVELS:
        if fits(n * order):
            scene = with_elements(case.with_all_cables, n, order, "lumped")
            levels.append((f"{n} x order {order} of each cable", SuspensionCase(scene)))
    return levels


def moving_parts(_):
    """Words for what moves in the wind and under control."""
    return "bodies and cables"


def comparable(_, column):
    """The column by which a suspension computes the quantity of a column of any scene."""
    return OF_THE_WHOLE.get(column.name, column)


def models_of(scene):
    """Models but the catenary that `trade` compares of a suspension: list of `ComparedModel`.

    Fixed elements with more displacements than `LARGEST` are left out. Raises as the equilibrium of the scene.
    """
    return [
        ComparedModel("closed form", "static stiffness", _case, ("modes",), _static_frequency, _free_displacements),
        *controlled_models(_case, DISCRETE),
        *element_models(_fixed_case, _size_limit(SuspensionCase(scene)), needs=DISCRETE),
    ]


def _case(scene, _=()):
    """The case of a scene, with nothing cached."""
    return SuspensionCase(scene)


def _fixed_case(elements, order, mass, scene, _):
    """The case of a scene with fixed elements along each cable."""
    return SuspensionCase(with_elements(scene, elements, order, mass))


def _size_limit(case):
    """Function of the number of segments along each cable: True if the model is small enough to be compared."""
    layout, cables = Layout(case.equilibrium), len(case.scene.cables)
    return lambda segments: 3 * (segments - 1) * cables <= LARGEST[layout.large]


def _free_displacements(case):
    """Number of free displacements of bodies and junctions. [-]"""
    return int(case.equilibrium.suspension.free.sum())


def _static_frequency(column, case):
    """Frequency by a common shortcut: bodies on the static stiffness of cables that have no modes of their own.

    It is w/(2 pi) from K phi = w^2 M phi. K is the static stiffness of the suspension. M has the inertia of the bodies
    and, at the ends of each cable, that of a straight cable: a third of its mass at an end that moves alone. For the
    frequency of one body, the other bodies are at rest.

    Parameters
    ----------
    column : Column
        `frequency_K` or `BODY.frequency_K`; K is here the number of the mode, not the stiffness.
    case : SuspensionCase

    Returns
    -------
    frequency : float
        [Hz]
    error : None
        The shortcut states no error.

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
    return float(frequencies[number - 1]), None
