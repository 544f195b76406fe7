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
from cablestudy.system.superelement import Ends

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
OPEN = "open_loop"  # in the names of the columns with the winch at rest


@dataclass(frozen=True)
class Answer:
    """What a model computes.

    Attributes
    ----------
    values : dict
        Column name -> number, of the columns that it has.
    failures : dict
        Column name -> reason, of the others.
    count_dof : callable
        Returns the number of free displacements, or None where no model was made; default: 0. Not called while timed.
    """

    values: dict
    failures: dict = field(default_factory=dict)
    count_dof: Callable = lambda: 0

    @property
    def dof(self):
        """Number of free displacements, or None. [-]"""
        try:
            return self.count_dof()
        except CablestudyError:
            return None


@dataclass(frozen=True)
class Model:
    """A model that a user can choose.

    Attributes
    ----------
    family : str
        Models of one family differ in one number.
    name : str
    solve : callable
        Scene, columns -> Answer; everything from the scene on, nothing cached.
    needs : tuple of str
        The kinds of columns (`Column.needs`) whose values depend on it.
    """

    family: str
    name: str
    solve: Callable
    needs: tuple = ("statics", "stiffness", *DISCRETE)

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
    for mass in MASSES:
        found += [_of_case(f"{mass} bars", f"{n} {mass} bars", partial(fixed, n, 1, mass)) for n in BARS]
    found += [_of_case("high order", f"1 x order {p}", partial(_spectral, 1, p)) for p in ORDERS]
    found += [_of_case("several of high order", f"{n} x order {p}", partial(_spectral, n, p)) for n, p in SEVERAL]
    for family, build in (("modes + residual", _with_residual), ("modes alone", _without_residual)):
        found += [_of_case(family, f"{n} {family}", partial(build, n), DISCRETE[1:]) for n in MODES]
    rules = [("adaptive", f"adaptive {_power(t)}", partial(windrms.response_of, tolerance=t)) for t in TOLERANCES]
    for family, space in (("uniform grid", np.linspace), ("log grid", np.geomspace)):
        rules += [(family, f"{family.split()[0]} {n} points", partial(_on_grid, space, n)) for n in POINTS]
    found += [_of_case(family, name, partial(_integrated, rule), DISCRETE[-1:]) for family, name, rule in rules]
    return [model for model in found if any(model.concerns(column) for column in columns)]


def _of_case(family, name, build, *needs):
    return Model(family, name, partial(solve_case, build), *needs)


def _power(number):
    return f"{number:.0e}".replace("e-0", "e-")


def read(case, columns):
    """Numbers of a case.

    Parameters
    ----------
    case : Case
    columns : sequence of Column

    Returns
    -------
    values : dict
        Column name -> number.
    failures : dict
        Column name -> why there is none.
    """
    return _each(columns, lambda column: value(column, case))


def _each(columns, compute):
    """Values and failures of a function of a column."""
    values, failures = {}, {}
    for column in columns:
        try:
            values[column.name] = compute(column)
        except CablestudyError as failure:
            failures[column.name] = " ".join(str(failure).split())
    return values, failures


def _none(columns, reason):
    """Answer of a model that cannot be made."""
    return Answer({}, {column.name: " ".join(reason.split()) for column in columns}, lambda: None)


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
        return _none(columns, str(failure))
    return Answer(*read(case, columns), lambda: case.dof or case.dynamics.dof)


def fixed(elements, order, mass, scene, _=()):
    """The case of so many elements, as `model: {elements: ..., order: ..., mass: ...}` asks for."""
    model = {"accuracy": None, "elements": elements, "order": order, "mass": mass}
    return Case(scene.model_copy(update={"model": scene.model.model_copy(update=model)}))


def _spectral(elements, order, scene, _):
    segments = 1 + len({load.at for load in scene.cable.loads})
    return fixed(elements * segments, order, "lumped", scene)


def _base(scene):
    return Case(with_accuracy(scene, ACCURACIES[-1])).refined(*BASE)


def with_accuracy(scene, accuracy):
    """The same scene with error control."""
    model = scene.model.model_copy(update={"accuracy": accuracy, "elements": None, "order": 1, "mass": "lumped"})
    return scene.model_copy(update={"model": model})


def _controlled(accuracy, scene, columns):
    row = evaluate(with_accuracy(scene, accuracy), [*columns, find("dof")])
    if row.failed:
        return _none(columns, row.cells["status"])
    return Answer({column.name: row.cells[column.header] for column in columns}, {}, lambda: row.cells["dof"])


# ------------------------------------------------------------------------------------------------------ closed forms


def _catenary(scene, columns):
    static = [column for column in columns if column.needs not in DISCRETE]
    values, failures = read(Case(with_accuracy(scene, ACCURACIES[-1])), static)
    moving = {column.name: "statics alone" for column in columns if column not in static}
    return Answer(values, failures | moving)


def _irvine(scene, columns):
    case = Case(with_accuracy(scene, ACCURACIES[-1]))
    return Answer(*_each(columns, lambda column: _irvine_frequency(case, column.name)))


def _irvine_frequency(case, name):
    """Frequency of the taut cable in closed form (Irvine, 1981, chapter 3). [Hz]"""
    match = re.fullmatch(r"(inplane|outofplane|symmetric|axial)_frequency_(\d+)", name)
    family, count = (match[1], int(match[2])) if match else ("inplane", 1)
    if not match and name != "cable_frequency":
        raise NoSolutionError("no formula of Irvine's")
    if case.scene.cable.loads:
        raise NoSolutionError("Irvine's cable carries no point loads")
    span, tension = case.span, case.catenary.mean_tension
    if family == "axial":
        return float(taut.axial_frequencies(count, span)[-1])
    if family == "symmetric":
        return float(taut.symmetric_frequencies(count, span, tension)[-1])
    mass, _ = taut.per_deformed_length(span)
    if family == "outofplane":
        return float(taut.string_frequencies(count, span.chord, tension, mass)[-1])
    symmetric = taut.symmetric_frequencies(count, span, tension)
    antisymmetric = taut.string_frequencies(2 * count, span.chord, tension, mass)[1::2]
    return float(np.sort(np.concatenate([symmetric, antisymmetric]))[count - 1])


# ----------------------------------------------------------------------------------------------------- reduced modes


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
    return integrate_by(_base(scene), columns, rule)


def integrate_by(case, columns, rule):
    """Integrate the response to the wind by a rule, and store it in the case.

    Parameters
    ----------
    case : Case
    columns : sequence of Column
    rule : callable
        Case, loop -> Response.

    Returns
    -------
    Case
        The given one.
    """
    names = [column.name for column in columns if column.needs == "wind"]
    if any(OPEN not in name for name in names):
        case.response = rule(case, case.loop)
    elif names:
        case.open_response = rule(case, case.loop.at_rest)
    return case


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
