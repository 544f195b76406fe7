"""The models that `trade` compares: closed forms, bars, high orders, error control, reduced modes, frequency grids."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from cablestudy.cable import taut
from cablestudy.control import reduction
from cablestudy.control.plant import Plant
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study import windrms
from cablestudy.study.case import Case
from cablestudy.study.column_requirements import DISCRETE
from cablestudy.study.columns import find, value
from cablestudy.study.row import evaluate
from cablestudy.system.ends import Ends

PAPER = 40  # bars
BARS = (5, 10, 20, 40, 80, 160, 320, 640)
MASSES = ("lumped", "consistent", "blended")
ORDERS = (8, 12, 16, 24, 32)  # of one element a segment
SEVERAL = ((2, 8), (4, 8), (2, 16), (4, 16))  # elements a segment, order
ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
BASE = (1, 32)  # elements a segment and order of the cable whose modes are reduced or whose response is integrated
MODES = (1, 3, 10, 30, 90)
TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8)
POINTS = (100, 1000, 10_000, 100_000)
GRID = (1e-5, 1e2)  # ends of a frequency grid, over the static frequency of the gondola
BLOCK = 4096  # frequencies at once, to limit memory


@dataclass(frozen=True)
class Answer:
    """What a model computes, by names of columns."""

    values: dict  # numbers, of the columns that it has
    failures: dict = field(default_factory=dict)  # reasons, of the others
    count_dof: Callable = lambda: 0  # not called while timed; returns None where no model was made

    @property
    def dof(self):
        """Number of free displacements, or None. [-]"""
        try:
            return self.count_dof()
        except CablestudyError:
            return None


@dataclass(frozen=True)
class Model:
    """A model that a user can choose."""

    family: str  # models of one family differ in one number
    name: str
    solve: Callable  # scene, columns -> Answer; everything from the scene on, nothing cached
    needs: tuple = ("statics", "stiffness", *DISCRETE)  # kinds of columns (`Column.needs`) that depend on it

    def concerns(self, column):
        """Whether the value of a column depends on the model."""
        return column.needs in self.needs


def models_of(columns):
    """Every model on which some of the columns depend.

    Parameters
    ----------
    columns : sequence of Column

    Returns
    -------
    list of Model
    """
    found = [
        Model("closed form", "catenary", _catenary, ("statics", "stiffness")),
        Model("closed form", "Irvine", _irvine, ("modes",)),
        *(Model("error control", f"accuracy {_power(a)}", partial(_controlled, a)) for a in ACCURACIES),
    ]

    def add(family, name, build, *needs):
        found.append(Model(family, name, partial(solve_case, build), *needs))

    for mass in MASSES:
        for n in BARS:
            add(f"{mass} bars", f"{n} {mass} bars", partial(fixed, n, 1, mass))
    for n, p in [(1, order) for order in ORDERS] + list(SEVERAL):
        add("high order" if n == 1 else "several of high order", f"{n} x order {p}", partial(_spectral, n, p))
    for family, build in (("modes + residual", _with_residual), ("modes alone", _without_residual)):
        for n in MODES:
            add(family, f"{n} {family}", partial(build, n), DISCRETE[1:])
    rules = [("adaptive", f"adaptive {_power(t)}", partial(windrms.response_of, tolerance=t)) for t in TOLERANCES]
    for family, space in (("uniform grid", np.linspace), ("log grid", np.geomspace)):
        rules += [(family, f"{family.split()[0]} {n} points", partial(_on_grid, space, n)) for n in POINTS]
    for family, name, rule in rules:
        add(family, name, partial(_integrated, rule), DISCRETE[-1:])
    return [model for model in found if any(model.concerns(column) for column in columns)]


def _power(number):
    return f"{number:.0e}".replace("e-0", "e-")


def one_line(text):
    """A message without line breaks."""
    return " ".join(str(text).split())


def _answer(columns, case, compute=value, count_dof=lambda: 0):
    """The answer of a function of a column and a case; columns without a value fail."""
    values, failures = {}, {}
    for column in columns:
        try:
            values[column.name] = compute(column, case)
        except CablestudyError as failure:
            failures[column.name] = one_line(failure)
    return Answer(values, failures, count_dof)


def _no_answer(columns, reason):
    """Answer of a model that cannot be made."""
    return Answer({}, dict.fromkeys([column.name for column in columns], one_line(reason)), lambda: None)


# ------------------------------------------------------------------------------------------------ models of elements


def solve_case(build, scene, columns):
    """Answer of a case.

    Parameters
    ----------
    build : callable
        Scene, columns -> Case.
    scene : Scene
    columns : sequence of Column

    Returns
    -------
    Answer
    """
    try:
        case = build(scene, columns)
    except CablestudyError as failure:
        return _no_answer(columns, failure)
    return _answer(columns, case, count_dof=lambda: case.dof or case.dynamics.dof)


def fixed(elements, order, mass, scene, _=()):
    """The case of so many elements, as `model: {elements: ..., order: ..., mass: ...}` asks for."""
    return Case(_modelled(scene, accuracy=None, elements=elements, order=order, mass=mass))


def with_accuracy(scene, accuracy):
    """The same scene with error control."""
    return _modelled(scene, accuracy=accuracy, elements=None, order=1, mass="lumped")


def _modelled(scene, **model):
    return scene.model_copy(update={"model": scene.model.model_copy(update=model)})


def _spectral(elements, order, scene, _):
    segments = 1 + len({load.at for load in scene.cable.loads})
    return fixed(elements * segments, order, "lumped", scene)


def _controlled(accuracy, scene, columns):
    row = evaluate(with_accuracy(scene, accuracy), [*columns, find("dof")])
    if row.failed:
        return _no_answer(columns, row.cells["status"])
    return Answer({column.name: row.cells[column.header] for column in columns}, {}, lambda: row.cells["dof"])


# ------------------------------------------------------------------------------------------------------ closed forms


def _accurate(scene):
    return Case(with_accuracy(scene, ACCURACIES[-1]))


def _catenary(scene, columns):
    def compute(column, case):
        if column.needs in DISCRETE:
            raise NoSolutionError("statics alone")
        return value(column, case)

    return _answer(columns, _accurate(scene), compute)


def _irvine(scene, columns):
    return _answer(columns, _accurate(scene), _irvine_frequency)


def _irvine_frequency(column, case):
    """Frequency of the taut cable in closed form (Irvine, 1981, chapter 3). [Hz]"""
    match = re.fullmatch(r"(inplane|outofplane|symmetric|axial)_frequency_(\d+)", column.name)
    family, count = (match[1], int(match[2])) if match else ("inplane", 1)
    if not match and column.name != "cable_frequency":
        raise NoSolutionError("no formula of Irvine's")
    if case.scene.cable.loads:
        raise NoSolutionError("Irvine's cable carries no point loads")
    span, tension = case.span, case.catenary.mean_tension
    if family == "axial":
        return float(taut.axial_frequencies(count, span)[-1])
    mass, _ = taut.per_deformed_length(span)
    string = taut.string_frequencies(2 * count, span.chord, tension, mass)
    if family == "outofplane":
        return float(string[count - 1])
    symmetric = taut.symmetric_frequencies(count, span, tension)
    if family == "symmetric":
        return float(symmetric[-1])
    return float(np.sort(np.concatenate([symmetric, string[1::2]]))[count - 1])


# ----------------------------------------------------------------------------------------------------- reduced modes


def _base(scene):
    return _accurate(scene).refined(*BASE)


def _with_residual(count, scene, _):
    """The lowest modes and the static part of all others, as by `ssm --modes`."""
    case = _base(scene)
    return _with_ends(case, Ends(case.dynamics, case.frame, count).model(scene.cable.damping))


def _without_residual(count, scene, _):
    """The lowest modes of the paper's bars alone, as by `ssm --modes --no-residual`."""
    case = fixed(PAPER, 1, "lumped", scene)
    whole = case.end_model
    return _with_ends(case, reduction.truncated(whole, np.arange(min(count, len(whole.omega)))))


def _with_ends(case, model):
    """The case with another end model in the place of its own."""
    case.end_model = case.end_model_along_x = model
    case.end_stiffness_along = lambda axis: float(model.stiffness[3 + axis, 3 + axis])
    if case.scene.gondola is not None and case.scene.gondola.mass is not None:
        case.coupled = Plant(model, case.scene.gondola.mass).coupled
    return case


# ---------------------------------------------------------------------------------------------- frequency integration


def _integrated(rule, scene, columns):
    case = _base(scene)
    integrate_by(case, columns, rule)
    return case


def integrate_by(case, columns, rule):
    """Integrate the response to the wind by a rule, and store it in the case.

    Parameters
    ----------
    case : Case
    columns : sequence of Column
        Those of the open loop alone do not need a stable loop.
    rule : callable
        Case, loop -> Response.
    """
    names = [column.name for column in columns if column.needs == "wind"]
    if any("open_loop" not in name for name in names):
        case.response = rule(case, case.loop)
    elif names:
        case.open_response = rule(case, case.loop.at_rest)


def _on_grid(space, points, case, loop):
    """Trapezoidal rule on a grid about the gondola's frequency, in equal steps or equal ratios."""
    return by_trapezoids(case, loop, space(*(np.array(GRID) * case.gondola_frequency_static), points))


def by_trapezoids(case, loop, frequency):
    """RMS of the gondola by the trapezoidal rule.

    Parameters
    ----------
    case : Case
    loop : Loop
    frequency : ndarray, shape (n,)
        Ascending. [Hz]

    Returns
    -------
    Response
        Without an estimate of its error.

    Raises
    ------
    NoSolutionError
        The loop is unstable.
    """
    loop.check_stable()
    spectra = windrms.spectra_of(loop, windrms.force_of(case))
    blocks = [spectra(frequency[i : i + BLOCK]) for i in range(0, len(frequency), BLOCK)]
    variance = np.trapezoid(np.concatenate(blocks, axis=1), frequency, axis=1)
    return windrms.Response(*map(float, np.sqrt(variance)), np.nan, (), len(frequency))
