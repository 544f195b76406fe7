"""Models that `trade` compares of one cable: closed forms, bars, high orders, accuracies, fewer modes, grids."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cablestudy.cable import taut
from cablestudy.control.loop import unstable_pole
from cablestudy.control.loop_state_space import force_state_space
from cablestudy.errors import CablestudyError, NoSolutionError, SceneError, one_line
from cablestudy.motion.body_mode import largest_share
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.motion.turbulence import OWN
from cablestudy.study.cable_columns import is_of_one_cable
from cablestudy.study.column import DISCRETE, SYSTEM, lacks, value, value_and_error
from cablestudy.study.columns import find
from cablestudy.study.motion_columns import GONDOLA_X
from cablestudy.study.notes import strength_warning as strength_warning
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.columns import column_of_one_cable
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.study.one_cable.system import analysis_of, in_cable_wind_of
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.scene_values import load_count
from cablestudy.study.tolerances import STUDY
from cablestudy.system.assemble import assemble
from cablestudy.system.damping import damping_ratios
from cablestudy.system.ends import Ends
from cablestudy.system.residues import residues
from cablestudy.system.superelement import GONDOLA, GROUND
from cablestudy.wind.imaging import seen_weights

DEFAULT = ("end_stiffness", "cable_frequency", "inplane_frequency_8", "gondola_frequency", "gondola_rms_open_loop")
LEVELS = ((1, 16), (1, 24), (1, 32), (1, 48), (2, 48), (4, 48), (8, 48), (16, 48))  # elements a segment, order
CLOSELY = (1e-8, 1e-9)  # accuracies of gondola and cable as one linear system: closer ones add rounding
PAPER = 40  # number of bars of the paper's model
BARS = (5, 10, 20, 40, 80, 160, 320, 640)
MASSES = ("lumped", "consistent", "blended")
ORDERS = (8, 12, 16, 24, 32)  # of one element a segment
SEVERAL = ((2, 8), (4, 8), (2, 16), (4, 16))  # elements a segment, order
ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
BASE = (1, 32)  # elements a segment and order of the cable whose modes are reduced or whose response is integrated
MODES = (1, 3, 10, 30, 90)  # numbers of modes that reduced models keep
POINTS = (100, 1000, 10_000, 100_000)  # numbers of frequencies of the grids that responses are integrated on
GRID = (1e-5, 1e2)  # ends of a frequency grid, over the static frequency of the gondola


@dataclass(frozen=True)
class ComparedModel:
    """A model that a user can choose, as `trade` compares it; models of one family differ in one number."""

    family: str
    name: str
    build: Callable  # scene, columns -> CableCase, with nothing cached
    needs: tuple = ("statics", "stiffness", *DISCRETE)  # kinds of columns whose values depend on the model
    compute: Callable = value  # column, CableCase -> float
    count_dof: Callable = lambda case: case.dof or case.dynamics.dof  # CableCase -> number of free displacements
    # column, CableCase -> relative error that the model states of a value, or None
    stated_error: Callable = lambda *_: None
    arrange: Callable = list  # columns -> the same in the order in which they are computed

    def solve(self, scene, columns):
        """Compute columns of a scene with this model.

        Returns
        -------
        case : CableCase or None
            The scene with this model; None if it cannot be built.
        values, failures : dict
            Column name -> value, or -> reason why the column has none.
        """
        values, failures = {}, {}
        try:
            case = self.build(scene, columns)
        except CablestudyError as failure:
            return None, values, {column.name: one_line(failure) for column in columns}
        for column in self.arrange(columns):
            try:
                values[column.name] = self.compute(column, case)
            except CablestudyError as failure:
                failures[column.name] = one_line(failure)
        return case, values, {column.name: failures[column.name] for column in columns if column.name in failures}


def default_columns(_):
    """The columns that are compared where none are named, some of which need keys: list of Column."""
    return list(map(find, DEFAULT))


def reference_case(scene):
    """The case on which the reference rests: its statics are closed forms.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    case = CableCase(with_accuracy(scene, STUDY.agreed_levels))
    case.results.check(case.index)
    return case


def reference_levels(case):
    """Finer and finer models for a column that needs modes: a function, `Column` -> list of (name, CableCase)."""
    finer = [(f"{n} x order {order} about the closed form", case.refined(n, order)) for n, order in LEVELS]
    system = "the cable" if case.scene.gondola is None else "gondola and cable"
    systems = [(f"{system} to {power(accuracy)}", fixed_to(accuracy, case.scene)) for accuracy in CLOSELY]
    return lambda column: systems if column.needs in SYSTEM else finer


def exact_value(column, case):
    """A number of a case of the reference, and its relative error by anything but its elements."""
    number, error = value_and_error(column, case)
    return number, max(float(error or 0.0), 0.0 if column.needs in DISCRETE else STUDY.rounding)


def missing_key(scene, column):
    """The key that a column needs and a scene lacks, or an empty text."""
    return lacks(scene, column)


def comparable(scene, column):
    """The column of one cable with the number of a column; SceneError where only suspensions have it."""
    own_column = column_of_one_cable(column, scene.gondola is None)
    if not is_of_one_cable(own_column):
        raise SceneError(f"--columns: {column.name}: the models of one cable that are compared do not have it")
    return own_column


def models_of(scene, columns):
    """Models that `trade` compares for some columns of a scene of one cable: list of `ComparedModel`.

    All models that a user can choose, less those on which no value of the columns depends.
    """
    models = [
        ComparedModel("closed form", "catenary", _most_accurate, ("statics", "stiffness"), _static_value, lambda _: 0),
        ComparedModel("closed form", "Irvine", _most_accurate, ("modes",), _irvine_frequency, lambda _: 0),
    ]

    def add(family, name, build, **options):
        models.append(ComparedModel(family, name, build, **options))

    options_of_row = {  # of models that are computed as a `Row`, in place of a `CableCase`
        "compute": _cell_of_row,
        "count_dof": lambda row: row.cells["dof"],
        "stated_error": lambda column, row: row.errors.get(column.header),
    }
    for accuracy in ACCURACIES:
        add("error control", f"accuracy {power(accuracy)}", partial(_row_to_accuracy, accuracy), **options_of_row)
    for family, name, n, order, mass in element_models():
        add(family, name, partial(fixed_case if order == 1 else _spectral, n, order, mass))
    if scene.gondola is not None:
        _add_of_gondola(add)
    return [model for model in models if any(column.needs in model.needs for column in columns)]


def element_models():
    """Yield family, name, elements (of high order those of each segment), order and mass of fixed elements."""
    for mass in MASSES:
        yield from ((f"{mass} bars", f"{n} {mass} bars", n, 1, mass) for n in BARS)
    for n, order in [(1, order) for order in ORDERS] + list(SEVERAL):
        yield "high order" if n == 1 else "several of high order", f"{n} x order {order}", n, order, "lumped"


def _add_of_gondola(add):
    """Add the models of a gondola's motion."""
    for family, build in (("modes + residual", _with_residual), ("modes alone", _without_residual)):
        for n in MODES:
            add(family, f"{n} {family}", partial(build, n), needs=("gondola", "wind"), compute=_by_reduced_modes)
    add("sum over poles", "sum over poles", _by_poles, needs=("wind",))
    for kind, space in (("uniform", np.linspace), ("log", np.geomspace)):
        for n in POINTS:
            add(f"{kind} grid", f"{kind} {n} points", partial(_on_grid, space, n), needs=("wind",))


def power(number):
    """A power of ten as in `1e-4`."""
    return f"{number:.0e}".replace("e-0", "e-")


# ------------------------------------------------------------------------------------------------ models of elements


def fixed_case(elements, order, mass, scene, _=()):
    """The case of a scene with `model: {elements: ..., order: ..., mass: ...}`."""
    return CableCase(with_elements(scene, elements, order, mass))


def with_elements(scene, elements, order, mass):
    """Copy of a scene with a fixed number of elements, their order and their mass matrix."""
    model = {"accuracy": None, "elements": elements, "order": order, "mass": mass}
    return scene.model_copy(update={"model": scene.model.model_copy(update=model)})


def fixed_to(accuracy, scene, _=()):
    """The case of a scene with error control."""
    return CableCase(with_accuracy(scene, accuracy))


def _spectral(elements, order, mass, scene, _):
    """The case of a scene with fixed elements, so many for each segment between point loads."""
    return fixed_case(elements * (1 + load_count(scene)[1]), order, mass, scene)


def _row_to_accuracy(accuracy, scene, columns):
    """The `Row` of a scene to an accuracy, in the place of a case."""
    return evaluate(with_accuracy(scene, accuracy), [*columns, find("dof")])


def _cell_of_row(column, row):
    """The number of a column in a `Row`; NoSolutionError where it is empty."""
    if row.failed and row.cells[column.header] is None:
        raise NoSolutionError(row.cells["status"])
    return row.cells[column.header]


# ------------------------------------------------------------------------------------------------------ closed forms


_most_accurate = partial(fixed_to, ACCURACIES[-1])


def _static_value(column, case):
    """A number of the statics; NoSolutionError for other columns."""
    if column.needs in DISCRETE:
        raise NoSolutionError("statics alone")
    return value(column, case)


def _irvine_frequency(column, case):
    """Frequency of the taut cable in closed form (Irvine, 1981, chapter 3). [Hz]"""
    match = re.fullmatch(r"(inplane|outofplane|symmetric|axial)_frequency_(\d+)", column.name)
    family, count = (match[1], int(match[2])) if match else ("inplane", 1)
    if not match and column.name != "cable_frequency":
        raise NoSolutionError("no formula of Irvine's")
    if case.scene.loads:
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


def _with_residual(count, scene, _):
    """The lowest modes and the static part of all others, as by `ssm --modes`."""
    case = _most_accurate(scene).refined(*BASE)
    return _with_end_model(case, Ends(case.dynamics, case.frame, count).model(scene.cable.damping))


def _without_residual(count, scene, _):
    """The lowest modes of the paper's bars alone, as by `ssm --modes --no-residual`."""
    case = fixed_case(PAPER, 1, "lumped", scene)
    all_modes = case.end_model
    return _with_end_model(case, all_modes.truncate(np.arange(min(count, len(all_modes.omega)))))


def _with_end_model(case, model):
    """The case with another `Superelement` in the place of its cable's."""
    case.end_model = model
    case.end_stiffness_along = lambda axis: float(model.stiffness[3 + axis, 3 + axis])
    gondola = case.scene.gondola
    if gondola is not None and gondola.mass is not None:
        system = _gondola_system(model, case)
        case.gondola_mode = ModeOfSystem(system)
        case.analysis = analysis_of(case, make_analysis=partial(AnalysisOfSystem, system))
    return case


def _gondola_system(model, case):
    """`LinearSystem` of the gondola on a `Superelement`, driven by the winch; its position is the last coordinate."""
    identity, mass, winch = np.eye(6), np.array([[case.scene.gondola.mass]]), case.scene.winch
    driven_end = GONDOLA if winch is not None and winch.location == "gondola" else GROUND
    system = assemble([model], identity[:, [GONDOLA]], mass, identity[:, [driven_end]])
    damping = system.damping.copy()
    damping[-1, -1] += case.gondola_air_damping
    position, none = np.eye(len(system))[[-1]], np.zeros((1, 1))
    return replace(system, damping=damping, c=(position, 0 * position, 0 * position), d=(none, none, none))


def _by_reduced_modes(column, case):
    """A number by reduced modes; NoSolutionError for columns of the loop, of winches and of the wind on the cable."""
    if column.needs == "loop" or (column.needs == "wind" and re.search("winch|cable_wind|all_wind", column.name)):
        raise NoSolutionError("not by reduced modes")
    return value(column, case)


class ModeOfSystem:
    """Mode of the gondola, as `RefinedMode`, of a linear system of gondola and cable, without errors.

    Parameters
    ----------
    system : LinearSystem
        Its last coordinate is the gondola's position.
    """

    def __init__(self, system):
        omega, shares = system.modes
        self.number = largest_share(shares[0])
        self.frequency = omega[self.number] / (2 * np.pi), None
        self.share = shares[0, self.number], None
        self._system = system

    @property
    def damping_ratio(self):
        """Damping ratio of the mode with the winch at rest, 1 without oscillation [-]; and None, no error."""
        ratio = damping_ratios(self._system, *self._system.lowest(len(self._system)))
        return min(ratio[self.number], 1.0), None


class AnalysisOfSystem(DynamicAnalysis):
    """`DynamicAnalysis` whose RMS are those of another linear system of gondola and cable in the same gusts.

    Parameters
    ----------
    system : LinearSystem
        Its only output is the gondola's position, the last coordinate.
    *args
        As of `DynamicAnalysis`.
    """

    def __init__(self, system, *args):
        super().__init__(*args)
        self._system, self._weights = system, OWN | seen_weights(self.scene.exposure, self.scene.correction)

    def rms(self, names, variance, open_loop):
        """RMS of the gondola along x in the gusts of the analysis, by the other system, and NaN in place of its error.

        `variance` is `value` for the RMS displacement [m], `rate` for the RMS velocity [m/s]. The gondola's position is
        the only output, so that `names` is not looked at. See `DynamicAnalysis.rms`.

        Raises
        ------
        NoSolutionError
            This system is unstable, or as of `DynamicAnalysis.rms`.
        """
        response = self.response_of(open_loop)
        closed_loop, loop = response.closed_loop, response.loop
        if loop is not None:
            measured = np.eye(len(self._system))[[-1]]
            loop = replace(loop, motion=self._system, allocation=replace(loop.allocation, measured=measured))
        eigen = (loop or self._system).eigen
        if unstable_pole(eigen.poles) is not None:
            raise NoSolutionError("the loop is unstable with these modes")
        # the position is x = row z, by the coordinates z of the analysis: its forces on z are row^T times that on x
        row, by_gusts = closed_loop.motion.c[0][closed_loop.outputs[GONDOLA_X]].real, closed_loop.gusts.input_matrix
        forces = np.zeros((len(self._system), by_gusts.shape[1]))
        forces[-1] = row[: len(by_gusts)] @ by_gusts / (row @ row)
        system = residues(eigen, *force_state_space(self._system, forces, loop))
        ((squared,),) = closed_loop.turbulence.variances_of(system, {variance: self._weights[variance]})
        return float(np.sqrt(squared)), np.nan


# ---------------------------------------------------------------------------------------------- frequency integration


def _by_poles(scene, _):
    """The case with one fixed model of high order, whose variances are sums over poles."""
    return _most_accurate(scene).refined(*BASE)


def _on_grid(space, points, scene, _):
    """The case with RMS by the trapezoidal rule on a grid about the gondola's frequency, by a function `space`."""
    case = _by_poles(scene, _)
    gondola_frequency = find("gondola_frequency_static").compute(case)
    return by_trapezoids(case, space(*(np.array(GRID) * gondola_frequency), points))


def by_trapezoids(case, frequency):
    """A case whose RMS in the wind are by the trapezoidal rule over frequencies, ascending, shape (n,) [Hz]."""
    make_analysis = partial(OnGrid, frequency)
    case.analysis = analysis_of(case, make_analysis=make_analysis)
    case.in_wind_that_damps = analysis_of(case, case.cable_air_damping, make_analysis)
    if case.scene.wind_diameter is not None:
        case.in_cable_wind = in_cable_wind_of(case, make_analysis)
    return case


class OnGrid(DynamicAnalysis):
    """`DynamicAnalysis` whose RMS is by the trapezoidal rule, without an estimate of its error.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        Ascending. [Hz]
    *args
        As of `DynamicAnalysis`.
    """

    def __init__(self, frequency, *args):
        super().__init__(*args)
        self._frequency = frequency
        self._weights = OWN | seen_weights(self.scene.exposure, self.scene.correction)

    def rms(self, names, variance, open_loop):
        """RMS of some outputs, as `DynamicAnalysis.rms`; the error is not a number."""
        response = self.response_of(open_loop)
        rows = [row for row, name in enumerate(response.names) if name in names]
        spectrum = response.spectra(self._frequency)[rows].sum(axis=0)
        weight = self._weights[variance](self._frequency)
        return float(np.sqrt(np.trapezoid(weight * spectrum, self._frequency))), np.nan
