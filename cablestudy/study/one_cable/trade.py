"""Models that `trade` compares of one cable: closed forms, bars, high orders, accuracies, fewer modes, grids."""

import re
from dataclasses import replace
from functools import partial

import numpy as np

from cablestudy.cable import taut
from cablestudy.control.loop import unstable_pole
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.motion.body_mode import largest_share
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.motion.turbulence import VALUE_AND_RATE
from cablestudy.study.cable_columns import is_of_one_cable
from cablestudy.study.column import value_and_error
from cablestudy.study.columns import find
from cablestudy.study.compared_models import ACCURACIES, LEVELS, ComparedModel, controlled_models, element_models
from cablestudy.study.load_arrays import load_count
from cablestudy.study.motion_columns import GONDOLA_X
from cablestudy.study.notes import strength_warning as strength_warning
from cablestudy.study.one_cable.asked_modes import AskedModes
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.columns import column_of_one_cable
from cablestudy.study.one_cable.system import analysis_of, in_cable_wind_of
from cablestudy.study.refinement import with_accuracy, with_elements
from cablestudy.system.assemble import assemble
from cablestudy.system.damping import damped_poles
from cablestudy.system.ends import Ends
from cablestudy.system.state_spaces import StateSpaces
from cablestudy.system.superelement import GONDOLA, GROUND
from cablestudy.wind.imaging import image_weights

DEFAULT = ("end_stiffness", "cable_frequency", "inplane_frequency_8", "gondola_frequency", "gondola_rms_open_loop")
PAPER = 40  # number of bars of the paper's model
BASE = (1, 32)  # elements a segment and order of the cable whose modes are reduced or whose response is integrated
MODES = (1, 3, 10, 30, 90)  # numbers of modes that reduced models keep
POINTS = (100, 1000, 10_000, 100_000)  # numbers of frequencies of the grids that responses are integrated on
GRID = (1e-5, 1e2)  # ends of a frequency grid, over the static frequency of the gondola


def default_columns(_):
    """The columns that are compared where none are named, some of which need keys: list of Column."""
    return list(map(find, DEFAULT))


def reference_levels(case):
    """Finer and finer models of the modes of the cable: list of (name, CableCase)."""
    return [(f"{n} x order {order} about the closed form", case.refined(n, order)) for n, order in LEVELS]


def moving_parts(scene):
    """Words for what moves in the wind and under control."""
    return "the cable" if scene.gondola is None else "gondola and cable"


def comparable(scene, column):
    """The column of one cable with the number of a column; SceneError where only suspensions have it."""
    own_column = column_of_one_cable(column, scene.gondola is None)
    if not is_of_one_cable(own_column):
        raise SceneError(f"--columns: {column.name}: the models of one cable that are compared do not have it")
    return own_column


def models_of(scene):
    """Models but the catenary that `trade` compares of a scene of one cable: list of `ComparedModel`."""
    return [
        ComparedModel("closed form", "Irvine", _most_accurate, ("modes",), _irvine_frequency, lambda _: 0),
        *controlled_models(_case_of, ComparedModel.needs),
        *element_models(fixed_case, count_dof=_unknowns),
        *([] if scene.gondola is None else _models_of_gondola()),
    ]


def _case_of(scene, columns):
    """The case of a scene, which finds the frequencies of all columns together."""
    return CableCase(scene, asked_modes=AskedModes(column.mode for column in columns if column.mode))


def _unknowns(case):
    """Free displacements of the motion that was computed, or of all motion. [-]"""
    return case.dof or case.dynamics.dof


def _models_of_gondola():
    """Yield the models of a gondola's motion."""
    for family, build in (("modes + residual", _with_residual), ("modes alone", _without_residual)):
        for n in MODES:
            reduced = partial(build, n), ("gondola", "wind"), _by_reduced_modes
            yield ComparedModel(family, f"{n} {family}", *reduced, _unknowns)
    in_wind = {"needs": ("wind",), "count_dof": _unknowns}
    yield ComparedModel("sum over poles", "sum over poles", _by_poles, **in_wind)
    for kind, space in (("uniform", np.linspace), ("log", np.geomspace)):
        for n in POINTS:
            yield ComparedModel(f"{kind} grid", f"{kind} {n} points", partial(_on_grid, space, n), **in_wind)


# ------------------------------------------------------------------------------------------------ models of elements


def fixed_case(elements, order, mass, scene, _=()):
    """The case of a scene with fixed `elements`; above order 1 on each segment between point loads."""
    segments = 1 if order == 1 else 1 + load_count(scene)[1]
    return CableCase(with_elements(scene, elements * segments, order, mass))


def _most_accurate(scene, _=()):
    """The case of a scene to the closest of ACCURACIES."""
    return CableCase(with_accuracy(scene, ACCURACIES[-1]))


# ------------------------------------------------------------------------------------------------------ closed forms


def _irvine_frequency(column, case):
    """Frequency of the taut cable in closed form (Irvine, 1981, chapter 3). [Hz]"""
    match = re.fullmatch(r"(inplane|outofplane|symmetric|axial)_frequency_(\d+)", column.name)
    family, count = (match[1], int(match[2])) if match else ("inplane", 1)
    if not match and column.name != "cable_frequency":
        raise NoSolutionError("no formula of Irvine's")
    if case.scene.loads:
        raise NoSolutionError("Irvine's cable carries no point loads")
    span, tension = case.span, case.continuous.mean_tension
    if family == "axial":
        return float(taut.axial_frequencies(count, span)[-1]), None
    mass, _ = taut.per_deformed_length(span)
    string = taut.string_frequencies(2 * count, span.chord, tension, mass)
    if family == "outofplane":
        return float(string[count - 1]), None
    symmetric = taut.symmetric_frequencies(count, span, tension)
    if family == "symmetric":
        return float(symmetric[-1]), None
    return float(np.sort(np.concatenate([symmetric, string[1::2]]))[count - 1]), None


# ----------------------------------------------------------------------------------------------------- reduced modes


def _with_residual(count, scene, _):
    """The lowest modes and the static part of all others, as by `ssm --modes`."""
    case = _most_accurate(scene).refined(*BASE)
    return _with_end_model(case, Ends(case.dynamics, case.span.frame, count).superelement(scene.cable.damping))


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
    """A number by reduced modes, which state no error.

    NoSolutionError for columns of the loop, of winches and of the wind on the cable."""
    if column.needs == "loop" or (column.needs == "wind" and re.search("winch|cable_wind|all_wind", column.name)):
        raise NoSolutionError("not by reduced modes")
    return value_and_error(column, case)[0], None


class ModeOfSystem:
    """Mode of the gondola, as `RefinedMode`, of a linear system of gondola and cable, without errors.

    Parameters
    ----------
    system : LinearSystem
        Its last coordinate is the gondola's position.
    """

    def __init__(self, system):
        omega, shapes = self._lowest = system.lowest(len(system))
        shares = (shapes[-1] / omega) ** 2
        self.number = largest_share(shares)
        self.frequency = omega[self.number] / (2 * np.pi), None
        self.share = shares[self.number] / shares.sum(), None
        self._system = system

    @property
    def damping_ratio(self):
        """Damping ratio of the mode with the winch at rest, 1 without oscillation [-]; and None, no error."""
        _, ratio = damped_poles(self._system, *self._lowest)
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
        self._system, self._weights = system, VALUE_AND_RATE | image_weights(self.scene.exposure, self.scene.correction)

    def rms(self, names, variance, open_loop):
        """RMS of the gondola's motion along x in the gusts of the analysis, computed by the other system, `system`.

        Parameters
        ----------
        names : list of str
            Not used: the gondola's position is the only output.
        variance : {"value", "rate", "exposure", "corrected", "corrected_exposure"}
            Displacement [m], velocity [m/s], or displacement as a telescope sees it (`imaging.image_weights`) [m].
        open_loop : bool
            True for the winch at rest, False for the loop closed.

        Returns
        -------
        rms : float
            [m] or [m/s].
        error : float
            NaN: no error is estimated.

        Raises
        ------
        NoSolutionError
            `system` is unstable, or the analysis has no response.
        """
        response = self.response_of(open_loop)
        closed_loop, in_wind, loop = response.closed_loop, response.in_wind, response.loop
        if loop is not None:
            measured = np.eye(len(self._system))[[-1]]
            loop = replace(loop, motion=self._system, allocation=replace(loop.allocation, measured=measured))
        if unstable_pole((loop or self._system).eigen.poles) is not None:
            raise NoSolutionError("the loop is unstable with these modes")
        # the position is x = row z, by the coordinates z of the analysis: its forces on z are row^T times that on x
        row, by_gusts = closed_loop.motion.c[0][closed_loop.outputs[GONDOLA_X]].real, in_wind.gusts.input_matrix
        forces = np.zeros((len(self._system), by_gusts.shape[1]))
        forces[-1] = row[: len(by_gusts)] @ by_gusts / (row @ row)
        (system,) = StateSpaces.of_one(self._system, loop).residues(forces[None])
        ((squared, *_),) = in_wind.turbulence.variances_of(system, {variance: self._weights[variance]})
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
        self._weights = VALUE_AND_RATE | image_weights(self.scene.exposure, self.scene.correction)

    def rms(self, names, variance, open_loop):
        """RMS of some outputs, as `DynamicAnalysis.rms`; the error is NaN."""
        response = self.response_of(open_loop)
        rows = [row for row, name in enumerate(response.names) if name in names]
        spectrum = response.spectra(self._frequency)[rows].sum(axis=0)
        weight = self._weights[variance](self._frequency)
        return float(np.sqrt(np.trapezoid(weight * spectrum, self._frequency))), np.nan
