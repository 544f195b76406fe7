"""Result columns of one cable: name, unit, meaning, and the one function that computes each.

To add a column, add a line to COLUMNS, or a family with a K in its name to FAMILIES. The function takes `Results` and
returns an array with an axis of cases, or takes one `CableCase` and returns a number.
"""

import re
from functools import partial
from types import SimpleNamespace

import numpy as np

from cablestudy.cable import taut
from cablestudy.cable.catenary_in_drag import errors_by_parts
from cablestudy.cable.geometry import chord_angles, clearance, load_sag, lowest_point, sag_and_swing
from cablestudy.study.column import DIAMETER, METAL, MM, STRONG, Column, scaled
from cablestudy.study.motion_columns import (
    BODY,
    DAMPING_RATIO,
    MIDSPAN,
    ON_CABLE,
    TENSIONS,
    WINCH,
    damping_ratio_of_gondola,
    imaged_column,
    loop_columns,
    mean_displacement,
    peak_of_gondola,
    rms_columns,
    rms_of_bare_cable,
    tension_columns,
    winch_columns,
)
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.drag import shedding_frequencies

# keys that columns need, as `Column.key`
LOADED = "cable.loads|load_case.loads"
STEADY = "gondola.area, gondola.drag_coefficient, wind|load_case.wind"


def stress_of(results):
    """Largest stress of each cable. [Pa]"""
    return results.statics.max_tension / results.number("cable.section_area")


def utilisation_of(results):
    """Largest tension of each cable over its breaking force, NaN without one. [-]"""
    return results.statics.max_tension / results.number("cable.section_breaking_force")


def over_strength(results):
    """True if the largest tension of each cable is above its breaking force; False where none is stated."""
    return utilisation_of(results) > 1


def _mean_tension(results):
    """Mean tension of each cable, 0 where no part of it has any tension. [N]"""
    tension = np.where(results.statics.max_tension > 0, results.statics.mean_tension, 0.0)
    return _as_stated(tension, results.number("cable.stated_preload"))


def _as_stated(numbers, stated):
    """Numbers of cables, NaN where there is none; where one is the stated number but for rounding, the stated one."""
    return np.where(np.abs(numbers - stated) <= STUDY.rounding * np.abs(stated), stated, numbers)


def _catenary_constant(results):
    """Horizontal tension over weight per length, not finite without gravity. [m]"""
    with np.errstate(divide="ignore", invalid="ignore"):
        return results.statics.horizontal_tension / (results.number("cable.section_mass") * results.number("gravity"))


def _unstretched_length(results):
    """Unstretched length in the reference state: as the scene states it, to the last digit, else computed. [m]"""
    stated = results.number("cable.unstretched_length")
    return np.where(np.isnan(stated), results.reference_length, stated)


def _deflections(case):
    """Movement along its force of the load that moves most: non-linear, and linear about the unloaded form.

    Two pairs of a number [m] and its relative error [-], which is None with the elements of a scene.
    """
    from cablestudy.study.deflection import load_deflections, rounding

    deflections = _of_most_moved(load_deflections(case))
    full, linear = deflections.tolist()
    if not case.exact_statics:
        return (full, None), (linear, None)
    by_rounding, by_drag = rounding(case, full) / abs(full) if full else 0.0, np.zeros(2)
    if case.coarser is not None:
        coarser = _of_most_moved(load_deflections(case.coarser))
        by_drag = errors_by_parts(deflections, coarser, case.form.least_errors)
    error, linear_error = np.maximum(max(STUDY.rounding, case.statics_error), by_drag).tolist()
    return (full, error + by_rounding), (linear, linear_error)


def _of_most_moved(deflections):
    """Deflections, non-linear and linear, of the load that moves most: shape (2,). [m]"""
    deflections = np.array(deflections)
    return deflections[:, np.abs(deflections[0]).argmax()]


def _nonlinearity(case):
    """Linear over non-linear deflection by the point loads, minus 1, and its relative error. [-]

    0 of loads along a straight cable, whose pieces are springs in a row.
    """
    (full, error), (linear, linear_error) = _deflections(case)
    span, forces = case.span, np.abs(case.span.load_forces)
    along_chord = not span.weight * span.cosine and forces[:, 1:].max() <= STUDY.rounding * forces.max()
    if not full or (along_chord and not case.continuous.folded and np.isfinite(linear)):
        return 0.0, error
    ratio = linear / full
    if error is None:
        return ratio - 1, None
    uncertainty = (error + linear_error) * abs(ratio)
    return ratio - 1, uncertainty / abs(ratio - 1) if ratio != 1 else uncertainty


def _tension(results, end):
    """Tension of each cable at an end (1 or 2). [N]"""
    return np.sqrt((results.form.end_forces()[..., end - 1, :] ** 2).sum(axis=-1))


def _end_force(results, end):
    """Force of each cable on its support at an end, global axes. [N]"""
    return results.form.end_forces("global")[..., end - 1, :]


def _horizontal(force):
    """Horizontal part of forces. [N]"""
    return np.hypot(force[..., 0], force[..., 1])


def _horizontal_reaction(results, end):
    """Horizontal part of `_end_force`, 0 where it is what the solver leaves of it in a vertical cable. [N]"""
    force = _end_force(results, end)
    return np.where(_horizontal(force) > STUDY.upright * np.abs(force[..., 2]), _horizontal(force), 0.0)


def _force_terms(results, end):
    """Sizes of the terms that add up to `_end_force`, from the chord and across it. [N]"""
    in_chord_frame = np.abs(results.form.end_forces()[..., end - 1, :])
    return (in_chord_frame[..., None] * np.abs(results.span.frame)).sum(axis=-2)


def _angle_terms(results, end):
    """Sizes of the terms that add up to the angle of the cable at an end. [deg]"""
    force, terms = _end_force(results, end), _force_terms(results, end)
    level, vertical = _horizontal(force), np.abs(force[..., 2])
    square = np.maximum((force**2).sum(axis=-1), STUDY.tiny)
    return np.degrees((level * terms[..., 2] + vertical * _horizontal(terms)) / square)


def _coupling_terms(results):
    """Sizes of the terms that add up to the stiffness along x by a movement along z. [N/m]"""
    along_x, along_z = np.abs(results.span.frame[..., 0]), np.abs(results.span.frame[..., 2])
    stiffness = np.abs(results.form.end_stiffness)
    return sum(along_x[..., i] * stiffness[..., i, j] * along_z[..., j] for i in range(3) for j in range(3))


def _coupling_stiffness(results):
    """Force along x by a movement along z, 0 where it is rounding of the stiffness along both. [N/m]"""
    direct = np.sqrt(np.abs(results.end_stiffness_along(0) * results.end_stiffness_along(2)))
    coupling = results.end_stiffness_along(0, 2)
    return np.where(np.abs(coupling) > STUDY.rounding * direct, coupling, 0.0)


def _static_frequency(results):
    """Frequency of each gondola on the static stiffness of its cable along x. [Hz]"""
    return np.sqrt(results.end_stiffness_along(0) / results.number("gondola.mass")) / (2 * np.pi)


def _below_horizontal(force):
    """Angle of forces on a support below the horizontal. [deg]"""
    return np.degrees(np.arctan2(-force[..., 2], _horizontal(force)))


def _support_columns():
    """Yield the columns of tensions, support forces and angles at the two ends."""
    for end in (1, 2):
        yield Column(f"tension_{end}", "N", f"tension at end {end}", "statics", partial(_tension, end=end))
    for end in (1, 2):
        yield Column(f"reaction_{end}_horizontal", "N", f"horizontal part of the force of the support at end {end}",
                     "statics", partial(_horizontal_reaction, end=end),
                     whole=lambda r, end=end: _horizontal(_force_terms(r, end)))  # fmt: skip
        yield Column(f"reaction_{end}_vertical", "N", f"vertical part of the force of the support at end {end}, "
                     "upwards: negative where it holds the end down", "statics",
                     lambda r, end=end: -_end_force(r, end)[..., 2],
                     whole=lambda r, end=end: _force_terms(r, end)[..., 2])  # fmt: skip
    for end in (1, 2):
        yield Column(f"angle_{end}", "deg", f"angle of the cable below the horizontal where it leaves end {end}",
                     "statics", lambda r, end=end: _below_horizontal(_end_force(r, end)),
                     determined_by="form", whole=partial(_angle_terms, end=end))  # fmt: skip


def _linear_range(case):
    """Displacement of the gondola along x up to which its cable is linear, or None where it always is [mm]; its error.

    The error is relative, None with the elements of a scene.
    """
    from cablestudy.cable.linear_range import linear_range

    results, index, moves = case.results, np.array([case.index]), np.eye(2, 3, -1)[None]  # of end 2, along x
    displacement, error = linear_range(results.form.take(index), moves, results.drag.take(index))
    if case.coarser is not None and displacement is not None:
        coarser = _linear_range(case.coarser)[0]
        error = max(error, float(errors_by_parts(1e3 * displacement, coarser or 0.0, 0.0)))
    error = error + case.statics_error if case.exact_statics else None
    return None if displacement is None else 1e3 * displacement, error


def _shedding(name, meaning, index):
    """Column of a frequency of vortex shedding: the low, mean and high one have the indices 0, 1, 2."""

    def compute(results):
        wind = SimpleNamespace(speed=results.number("wind.speed"), turbulence=results.number("wind.turbulence_along"))
        return shedding_frequencies(wind, results.number("wind_diameter"))[index]

    return Column(name, "Hz", meaning, "scene", compute, f"wind, {DIAMETER}")


def _frequency(name, meaning, number, kind, symmetry=None):
    """Column of the frequency of a mode."""
    mode = number, kind, symmetry
    return Column(name, "Hz", meaning, "modes", lambda case: case.frequency(*mode), mode=mode)


COLUMNS = (
    Column("preload", "N", "mean tension over the unstretched length", "statics", _mean_tension),
    Column("horizontal_tension", "N", "mean horizontal part of the tension", "statics",
           lambda r: r.statics.horizontal_tension),
    Column("catenary_constant", "m", "horizontal tension over weight per length, without ice: H/w", "statics",
           _catenary_constant, "nonzero_gravity"),
    Column("max_tension", "N", "largest tension along the cable", "statics", lambda r: r.statics.max_tension),
    Column("min_tension", "N", "smallest tension along the cable", "statics", lambda r: r.statics.min_tension),
    Column("unstretched_length", "m", "length without tension, at the reference temperature", "statics",
           _unstretched_length, of_reference=True),
    Column("stretched_length", "m", "length under tension", "statics", lambda r: r.statics.stretched_length),
    Column("chord", "m", "distance between the ends", "scene", lambda r: r.chord),
    Column("sag", "m", "vertical distance from chord to cable at mid-span", "statics",
           lambda r: _as_stated(r.statics.sag, r.number("cable.sag")), determined_by="sag"),
    Column("sag_ratio", "", "sag over chord", "statics", lambda r: r.statics.sag / r.chord, determined_by="sag"),
    Column("mass", "kg", "mass of the cable, mass per length x unstretched length", "statics",
           lambda r: r.number("cable.section_mass") * r.reference_length, of_reference=True),
    Column("diameter", "mm", "outer diameter of the cross-section", "scene",
           lambda r: 1e3 * r.number("cable.section_diameter"), DIAMETER),
    Column("area", "mm^2", "metallic area of the cross-section", "scene",
           lambda r: 1e6 * r.number("cable.section_area"), METAL),
    Column("elastic_modulus", "GPa", "axial stiffness over area", "scene",
           lambda r: r.number("cable.section_elastic_modulus") / 1e9, "cable.section_elastic_modulus"),
    Column("density", "kg/m^3", "mass per length over area", "scene",
           lambda r: r.number("cable.section_density"), "cable.section_density"),
    Column("axial_stiffness", "N", "EA, tension per strain", "scene",
           lambda r: r.number("cable.section_axial_stiffness")),
    Column("mass_per_length", "kg/m", "mass per length of the unstretched cable", "scene",
           lambda r: r.number("cable.section_mass")),
    Column("breaking_force", "N", "tension at which the cable breaks", "scene",
           lambda r: r.number("cable.section_breaking_force"), STRONG),
    Column("strain", "", "mean strain, mean tension over EA", "statics",
           lambda r: _mean_tension(r) / r.number("cable.section_axial_stiffness")),
    Column("stress", "MPa", "largest tension over area", "statics", lambda r: stress_of(r) / 1e6, METAL),
    Column("utilisation", "", "largest tension over breaking force", "statics", utilisation_of, STRONG),
    Column("lambda_squared", "", "Irvine's parameter: stiffness by stretching over stiffness by sagging", "statics",
           lambda r: taut.lambda_squared(r.span, r.statics.mean_tension)),
    Column("deflection", "m", "displacement of the point load that moves most, along its force, from the unloaded form",
           "statics", lambda c: _deflections(c)[0], LOADED, each=True),
    Column("linear_deflection", "m", "deflection by the tangent stiffness of the unloaded form", "statics",
           lambda c: _deflections(c)[1], LOADED, each=True),
    Column("nonlinearity", "", "linear over non-linear deflection, minus 1", "statics", _nonlinearity, LOADED,
           each=True),
    Column("load_sag", "m", "vertical distance from chord to the point load that hangs lowest below it", "statics",
           lambda c: load_sag(c.form), LOADED, each=True),
    *_support_columns(),
    Column("lowest_point", "m", "level of the lowest point of the cable, its ends included", "statics",
           lambda r: r.end_1[..., 2] + lowest_point(r.form), determined_by="form"),
    Column("clearance", "m", "least vertical distance from the cable down to the ground", "statics",
           lambda c: clearance(c.form, c.end_1, c.scene.ground), "ground", each=True, determined_by="form"),
    Column("swing", "deg", "angle out of the vertical plane of the chord, at mid-span", "statics",
           lambda r: np.degrees(sag_and_swing(r.form, r.middle)[1]), determined_by="form"),
    Column("inclination_from_plumb", "deg", "angle of the chord from the vertical", "statics",
           lambda r: np.degrees(chord_angles(r.span.frame[..., 0, :])[1])),
    Column("end_stiffness", "N/m", "static stiffness of end 2 along x, interior condensed", "stiffness",
           lambda r: r.end_stiffness_along(0)),
    Column("end_stiffness_zz", "N/m", "static stiffness of end 2 along z", "stiffness",
           lambda r: r.end_stiffness_along(2)),
    Column("end_stiffness_yy", "N/m", "static stiffness of end 2 along y", "stiffness",
           lambda r: r.end_stiffness_along(1)),
    Column("end_stiffness_xz", "N/m", "force along x per static displacement of end 2 along z", "stiffness",
           _coupling_stiffness, whole=_coupling_terms),
    Column("end_stiffness_along", "N/m", "static stiffness of end 2 along the chord", "stiffness",
           lambda r: r.end_stiffness_chord),
    _frequency("cable_frequency", "lowest in-plane frequency, ends fixed", 1, "in-plane"),
    Column("gondola_frequency_static", "Hz", "sqrt(static end stiffness/gondola mass)/(2 pi)", "stiffness",
           _static_frequency, "gondola.mass"),
    Column("gondola_frequency", "Hz", "coupled mode with the largest share of the gondola's static compliance",
           "gondola", lambda c: c.gondola_mode.frequency, "gondola.mass"),
    Column("gondola_share", "", "share of the gondola's static compliance in its mode, phi^2/w^2 over 1/k", "gondola",
           lambda c: c.gondola_mode.share, "gondola.mass"),
    Column(DAMPING_RATIO, "", "damping ratio of the coupled gondola mode, the winch at rest", "gondola",
           damping_ratio_of_gondola, "gondola.mass"),
    *loop_columns(WINCH),
    *rms_columns("", "in the wind", BODY, "analysis"),
    *rms_columns("_cable_wind", "by the wind on the cable alone", ON_CABLE, "in_cable_wind"),
    *rms_columns("_all_wind", "by the wind on gondola and cable together, which damps the cable too, so that it can be "
                 "less than by the wind on the gondola alone", f"{BODY}, {DIAMETER}", "in_wind_that_damps",
                 "in_cable_wind"),
    Column("mean_displacement", "mm", "displacement of the gondola along x by the mean wind on it, the winch at rest; "
           "linear", "stiffness", lambda r: 1e3 * mean_displacement(r), STEADY),
    Column("force_displacement", "mm", "displacement of the gondola along x by the force of the load case on it",
           "statics", lambda r: 1e3 * r.force_displacement[0], "gondola.mass, forces_on_end_2"),
    Column("peak", "mm", "largest displacement of the gondola expected within wind.duration: mean_displacement, and "
           "Davenport's factor times the RMS with the winch loop, if there is one", "wind", peak_of_gondola, BODY),
    *tension_columns(),
    Column("linear_range", "mm", "displacement of the gondola along x, of either sign, at which the restoring force of "
           "the cable differs by 5 % from linear; empty where it does not", "stiffness", _linear_range, "gondola.mass",
           each=True),
    *winch_columns(f"{BODY}, winch.controller"),
    imaged_column("exposure", "RMS of the gondola's motion within one exposure, with the winch loop if there is one",
                  "exposure"),
    imaged_column("corrected", "RMS of the gondola's motion that is left after correction by the mirror", "correction"),
    imaged_column("corrected_exposure", "RMS of the gondola's motion within one exposure that is left after correction "
                  "by the mirror", "exposure, correction"),
    Column("midspan_rms", "mm", "RMS displacement at mid-span of a cable with fixed ends in the wind, in the direction "
           "that moves most", "wind", lambda c: scaled(rms_of_bare_cable(c, MIDSPAN), MM), f"wind, {DIAMETER}",
           without="gondola"),
    Column("tension_rms", "N", "RMS tension of a cable with fixed ends in the wind, at the end where it is larger",
           "wind", lambda c: rms_of_bare_cable(c, TENSIONS), f"wind, {DIAMETER}", without="gondola"),
    _shedding("shedding_frequency", "frequency of vortices, 0.2 v/d at the mean wind speed", 1),
    _shedding("shedding_frequency_low",
              "frequency of vortices at three standard deviations of the speed below the mean, not below 0", 0),
    _shedding("shedding_frequency_high",
              "frequency of vortices at three standard deviations of the speed above the mean", 2),
    Column("limit_margin", "", "least margin of the limits in all of their load cases, relative to the limit; negative "
           "where one does not hold", "limits", None, "limits"),
    Column("governing", "", "limit with the least margin, with its load case and cable", "limits",
           None, "limits", text=True),
    Column("iterations", "", "Newton steps of the statics", "statics", lambda r: r.statics.iterations),
    Column("dof", "", "free displacements of the model; 0 where the closed form suffices", "run", None),
    Column("solve_time", "ms", "time that the row took", "run", None),
    Column("error_estimate", "", "largest estimated relative error in the row, against the continuous cable", "run",
           None),
    Column("status", "", "ok, over strength, a cable that goes slack in the wind, or why cells of the row are empty",
           "run", None, text=True),
)  # fmt: skip

TEXTS = frozenset(column.header for column in COLUMNS if column.text)

FAMILIES = (
    _frequency("inplane_frequency_K", "in-plane frequency K (1, 2, ...), axial modes not counted", 0, "in-plane"),
    _frequency("outofplane_frequency_K", "out-of-plane frequency K", 0, "out-of-plane"),
    _frequency("symmetric_frequency_K", "symmetric in-plane frequency K", 0, "in-plane", "symmetric"),
    _frequency("axial_frequency_K", "axial frequency K", 0, "axial"),
)


def family_member(name):
    """The member of one of FAMILIES by its name, with or without its unit, such as `axial_frequency_3`; else None."""
    match = re.fullmatch(r"(\w+_frequency_)([1-9]\d{0,3})(_Hz)?", name)
    family = match and next((family for family in FAMILIES if family.name == match[1] + "K"), None)
    if not family or int(match[2]) > STUDY.highest_mode_number:
        return None
    number = int(match[2])
    return _frequency(f"{match[1]}{number}", family.meaning, number, *family.mode[1:])


NAMES = {column.name for column in COLUMNS}


def is_of_one_cable(column):
    """True if a column is one of this file, of one cable, or a key that a study solves for."""
    return column.name in NAMES or column.needs == "find" or (len(column.mode) == 3 and "." not in column.name)
