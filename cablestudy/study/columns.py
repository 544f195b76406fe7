"""The registry of columns: name, unit, meaning, and the one function that computes each.

To add a column, add a line to COLUMNS, or a family with a K in its name to FAMILIES.
"""

import difflib
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import hypot, isfinite

import numpy as np

from cablestudy.cable import taut
from cablestudy.errors import NoSolutionError
from cablestudy.wind.drag import shedding_frequencies

SHAPELESS = "a part of the cable without weight is slack: it has no definite form"
ROUNDING = 1e-12  # of the closed forms and of modes, held by the tests against 50 digits
SUFFIX = {"": "", "rad/s": "_rad_per_s", "N/m": "_N_per_m", "kg/m^3": "_kg_per_m3", "mm^2": "_mm2", "mm/s": "_mm_per_s"}
WINCH = "gondola.mass, winch.controller"
BODY = "gondola.mass, gondola.area, gondola.drag_coefficient, wind"
ON_CABLE = "gondola.mass, wind"


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name : str
        Without its unit.
    unit : str
    meaning : str
    needs : str
        The most that is computed for it: scene, statics, stiffness, modes, gondola, loop, wind or run.
    compute : callable
        Case -> float.
    key : str
        Keys of the scene without which it has no value, after commas; empty when there is none.
    each : bool
        Computed cable by cable, even where others of its kind are computed for many at once.
    mode : tuple
        Number (from 1), kind and symmetry or None, of a mode's frequency; empty for other numbers.
    """

    name: str
    unit: str
    meaning: str
    needs: str
    compute: Callable
    key: str = ""
    each: bool = False
    mode: tuple = ()

    @property
    def least_error(self):
        """Estimated relative error where nothing but rounding is felt; None of what has none. [-]"""
        if self.needs == "run" or self.name == "iterations":
            return None
        return 0.0 if self.needs == "scene" else ROUNDING

    @cached_property
    def header(self):
        """Name with its unit, as in CSV and JSON."""
        return self.name + suffix(self.unit)


def suffix(unit):
    """What a unit adds to a column's name: `_N_per_m` for N/m."""
    return SUFFIX.get(unit, f"_{unit}")


def _stress(case):
    return case.statics.max_tension / case.scene.cable.section_area


def _given(value, computed):
    """A value as the scene gives it, or the computed one."""
    return computed if value is None else np.where(np.isnan(value), computed, value)


def _squared_ratio(case):
    return taut.lambda_squared(case.span, case.statics.mean_tension)


def _nonlinearity(case):
    full, linear = deflections(case)
    return linear / full - 1 if full else 0.0


def deflections(case):
    """How far the point loads move the cable, fully non-linear and linear about the unloaded form.

    Parameters
    ----------
    case : Case

    Returns
    -------
    full, linear : float
        Movement along its force of the load that moves most, from the unloaded form. [m]

    Raises
    ------
    NoSolutionError
        The cable carries no load.
    """
    from cablestudy.study.deflection import load_deflections

    full, linear = load_deflections(case)
    place = int(np.argmax(np.abs(full)))
    return float(full[place]), float(linear[place])


def _shedding(case):
    return shedding_frequencies(case.scene.wind, case.scene.cable.section_diameter)


def _frequency(name, meaning, number, kind, symmetry=None):
    """Column of the frequency of a mode."""
    mode = number, kind, symmetry
    return Column(name, "Hz", meaning, "modes", lambda case: case.frequency(*mode), mode=mode)


COLUMNS = (
    Column("preload", "N", "mean tension over the unstretched length", "statics", lambda c: c.statics.mean_tension),
    Column("horizontal_tension", "N", "mean horizontal part of the tension", "statics",
           lambda c: c.statics.horizontal_tension),
    Column("max_tension", "N", "largest tension along the cable", "statics", lambda c: c.statics.max_tension),
    Column("min_tension", "N", "smallest tension along the cable", "statics", lambda c: c.statics.min_tension),
    Column("unstretched_length", "m", "length without tension", "statics",
           lambda c: _given(c.scene.cable.unstretched_length, c.span.unstretched_length)),
    Column("stretched_length", "m", "length under tension", "statics", lambda c: c.statics.stretched_length),
    Column("chord", "m", "distance between the ends", "scene", lambda c: c.scene.cable.chord_length),
    Column("sag", "m", "vertical distance from chord to cable at mid-span", "statics", lambda c: c.statics.sag),
    Column("sag_ratio", "", "sag over chord", "statics", lambda c: c.statics.sag / c.scene.cable.chord_length),
    Column("mass", "kg", "mass of the cable, density x area x unstretched length", "statics",
           lambda c: c.span.mass * c.span.unstretched_length),
    Column("diameter", "mm", "of a round solid cross-section", "scene",
           lambda c: 1e3 * c.scene.cable.section_diameter),
    Column("area", "mm^2", "of the cross-section", "scene", lambda c: 1e6 * c.scene.cable.section_area),
    Column("elastic_modulus", "GPa", "of the cross-section", "scene", lambda c: c.scene.cable.elastic_modulus / 1e9),
    Column("density", "kg/m^3", "mass per volume", "scene", lambda c: c.scene.cable.density),
    Column("strain", "", "mean strain, mean tension over EA", "statics",
           lambda c: c.statics.mean_tension / c.scene.cable.axial_stiffness),
    Column("stress", "MPa", "largest tension over area", "statics", lambda c: _stress(c) / 1e6),
    Column("utilisation", "", "largest stress over strength", "statics",
           lambda c: _stress(c) / c.scene.cable.strength, "cable.strength"),
    Column("lambda_squared", "", "Irvine's parameter: stiffness by stretching over stiffness by sagging", "statics",
           _squared_ratio),
    Column("deflection", "m", "movement of the most moved point load along its force, from the unloaded form",
           "statics", lambda c: deflections(c)[0], "cable.loads", each=True),
    Column("linear_deflection", "m", "the same by the tangent stiffness of the unloaded form", "statics",
           lambda c: deflections(c)[1], "cable.loads", each=True),
    Column("nonlinearity", "", "linear over full deflection, less one", "statics", _nonlinearity, "cable.loads",
           each=True),
    Column("end_stiffness", "N/m", "static stiffness of end 2 along x, interior condensed", "stiffness",
           lambda c: c.end_stiffness_along(0)),
    Column("end_stiffness_zz", "N/m", "static stiffness of end 2 along z", "stiffness",
           lambda c: c.end_stiffness_along(2)),
    Column("end_stiffness_yy", "N/m", "static stiffness of end 2 along y", "stiffness",
           lambda c: c.end_stiffness_along(1)),
    _frequency("cable_frequency", "lowest in-plane frequency, ends fixed", 1, "in-plane"),
    Column("gondola_frequency_static", "Hz", "sqrt(static end stiffness/gondola mass)/(2 pi)", "stiffness",
           lambda c: c.gondola_frequency_static, "gondola.mass"),
    Column("gondola_frequency", "Hz", "coupled mode with the largest share of the gondola's static compliance",
           "gondola", lambda c: c.gondola_frequency, "gondola.mass"),
    Column("gondola_share", "", "that share, phi^2/w^2 over 1/k", "gondola", lambda c: c.gondola_share, "gondola.mass"),
    Column("gondola_damping_ratio", "", "of the coupled gondola mode, the winch at rest", "loop",
           lambda c: c.gondola_damping_ratio, "gondola.mass"),
    Column("largest_gain", "rad/s", "of the winch, below which the loop is stable; empty when it always is", "loop",
           lambda c: c.loop.largest_gain, WINCH),
    Column("gain_margin", "dB", "largest stable gain over the gain; empty when there is no limit", "loop",
           lambda c: c.loop.gain_margin, WINCH),
    Column("phase_margin", "deg", "least angle to instability where the loop gain is one", "loop",
           lambda c: c.loop.phase_margin, WINCH),
    Column("bandwidth", "Hz", "where the closed loop first falls to 1/sqrt(2)", "loop",
           lambda c: c.loop.bandwidth, WINCH),
    Column("gondola_rms", "mm", "of the gondola along x in the wind, with the winch loop", "wind",
           lambda c: 1e3 * c.response.displacement, f"{BODY}, winch.controller"),
    Column("gondola_rms_velocity", "mm/s", "of its velocity, with the winch loop", "wind",
           lambda c: 1e3 * c.response.velocity, f"{BODY}, winch.controller"),
    Column("gondola_rms_open_loop", "mm", "of the gondola along x in the wind, the winch at rest", "wind",
           lambda c: 1e3 * c.open_response.open_displacement, BODY),
    Column("gondola_rms_velocity_open_loop", "mm/s", "of its velocity, the winch at rest", "wind",
           lambda c: 1e3 * c.open_response.open_velocity, BODY),
    Column("gondola_rms_cable_wind", "mm", "of the gondola by the wind on the cable alone, with the winch loop", "wind",
           lambda c: 1e3 * c.cable_response.displacement, f"{ON_CABLE}, winch.controller"),
    Column("gondola_rms_velocity_cable_wind", "mm/s", "of its velocity, with the winch loop", "wind",
           lambda c: 1e3 * c.cable_response.velocity, f"{ON_CABLE}, winch.controller"),
    Column("gondola_rms_open_loop_cable_wind", "mm", "by the wind on the cable alone, the winch at rest", "wind",
           lambda c: 1e3 * c.open_cable_response.open_displacement, ON_CABLE),
    Column("gondola_rms_velocity_open_loop_cable_wind", "mm/s", "of its velocity, the winch at rest", "wind",
           lambda c: 1e3 * c.open_cable_response.open_velocity, ON_CABLE),
    Column("gondola_rms_all_wind", "mm", "by the wind on gondola and cable together, with the winch loop", "wind",
           lambda c: 1e3 * hypot(c.response.displacement, c.cable_response.displacement), f"{BODY}, winch.controller"),
    Column("gondola_rms_velocity_all_wind", "mm/s", "of its velocity, with the winch loop", "wind",
           lambda c: 1e3 * hypot(c.response.velocity, c.cable_response.velocity), f"{BODY}, winch.controller"),
    Column("gondola_rms_open_loop_all_wind", "mm", "by the wind on gondola and cable together, the winch at rest",
           "wind", lambda c: 1e3 * hypot(c.open_response.open_displacement, c.open_cable_response.open_displacement),
           BODY),
    Column("gondola_rms_velocity_open_loop_all_wind", "mm/s", "of its velocity, the winch at rest", "wind",
           lambda c: 1e3 * hypot(c.open_response.open_velocity, c.open_cable_response.open_velocity), BODY),
    Column("shedding_frequency", "Hz", "of vortices, 0.2 v/d at the mean wind speed", "scene",
           lambda c: _shedding(c)[1], "wind"),
    Column("shedding_frequency_low", "Hz", "the same three standard deviations of the speed below the mean, 0 at least",
           "scene", lambda c: _shedding(c)[0], "wind"),
    Column("shedding_frequency_high", "Hz", "the same three standard deviations of the speed above the mean", "scene",
           lambda c: _shedding(c)[2], "wind"),
    Column("iterations", "", "Newton steps of the statics", "statics", lambda c: c.statics.iterations),
    Column("dof", "", "free displacements of the model; 0 where the closed form suffices", "run", None),
    Column("solve_time", "ms", "time that the row took", "run", None),
    Column("error_estimate", "", "largest estimated relative error in the row, against the continuous cable", "run",
           None),
    Column("status", "", "ok, or why the row is empty", "run", None),
)  # fmt: skip

FAMILIES = (
    _frequency("inplane_frequency_K", "in-plane frequency K (1, 2, ...), axial modes not counted", 0, "in-plane"),
    _frequency("outofplane_frequency_K", "out-of-plane frequency K", 0, "out-of-plane"),
    _frequency("symmetric_frequency_K", "symmetric in-plane frequency K", 0, "in-plane", "symmetric"),
    _frequency("axial_frequency_K", "axial frequency K", 0, "axial"),
)

MAX_MODE_NUMBER = 1000


def _member(family, number):
    """Column `number` of a family."""
    return _frequency(family.name.replace("_K", f"_{number}"), family.meaning, number, *family.mode[1:])


def find(name):
    """The column of a name, with or without its unit.

    Parameters
    ----------
    name : str

    Returns
    -------
    Column

    Raises
    ------
    ValueError
        No such column; the message suggests one.
    """
    for column in COLUMNS:
        if name in (column.name, column.header):
            return column
    match = re.fullmatch(r"(\w+_frequency_)([1-9]\d{0,3})(_Hz)?", name)
    for family in FAMILIES if match else ():
        if family.name == match[1] + "K" and int(match[2]) <= MAX_MODE_NUMBER:
            return _member(family, int(match[2]))
    family = next((f.name for f in FAMILIES if re.fullmatch(f.name.replace("_K", r"_\w+"), name)), None)
    if family:
        raise ValueError(f"unknown column {name!r} ({family}: K is a whole number from 1 to {MAX_MODE_NUMBER})")
    known = [column.name for column in COLUMNS + FAMILIES]
    close = difflib.get_close_matches(name, known, 1) or difflib.get_close_matches(re.sub(r"\d+", "K", name), known, 1)
    hint = f"did you mean {close[0]}?" if close else "'cablestudy columns' lists them"
    raise ValueError(f"unknown column {name!r} ({hint})")


def lacks(scene, column):
    """The first key that a column needs and a scene has no value for, or an empty text."""
    if not column.key:
        return ""
    for key in filter(None, column.key.split(", ")):
        value = scene
        for part in key.split("."):
            value = getattr(value, part, None)
        if value is None or value == ():
            return key
    return ""


def broken(case):
    """Why the cable of a case would break, or an empty text.

    Parameters
    ----------
    case : Case

    Returns
    -------
    str
    """
    strength = case.scene.cable.strength
    if strength is None:
        return ""
    return breaking(float(_stress(case)), strength)


def stress_and_strength(batch):
    """Largest stress of each cable, and its strength or not a number. [Pa]"""
    return _stress(batch), batch.scene.cable.strength


def breaking(stress, strength):
    """Why a cable breaks, or an empty text."""
    if not stress > strength:
        return ""
    return f"broken cable: stress {stress / 1e6:.4g} MPa is above the strength of {strength / 1e6:.4g} MPa"


def value(column, case):
    """One number of a row whose scene has the keys that it needs.

    Parameters
    ----------
    column : Column
    case : Case

    Returns
    -------
    float

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no such number.
    """
    number = column.compute(case)
    if not isinstance(number, float | int | None):
        number = np.asarray(number).item()
    if number is None or isinstance(number, int):
        return number
    if not isfinite(number):
        raise infinite(column)
    return float(number) + 0.0  # no minus before a zero


def values(column, batch):
    """One column of many rows.

    Parameters
    ----------
    column : Column
        In closed form.
    batch : Batch

    Returns
    -------
    list of float or int
        Not finite where there is no such number.
    """
    number = np.asarray(column.compute(batch))
    return (number + 0.0 if number.dtype.kind == "f" else number).tolist()


def without(scene, column):
    """The error for a column that needs a key which its case lacks."""
    return NoSolutionError(f"{column.name} needs the key {lacks(scene, column)}, which this case does not have")


def infinite(column):
    """The error for a number that is none."""
    if column.name in ("sag", "sag_ratio"):
        return NoSolutionError(f"no {column.name}: {SHAPELESS}")
    return NoSolutionError(f"{column.header} is not finite")
