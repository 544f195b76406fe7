"""Result columns of one cable: name, unit, meaning, and the one function that computes each.

To add a column, add a line to COLUMNS, or a family with a K in its name to FAMILIES. The function takes `Results` and
returns an array with an axis of cases, or takes one `Case` and returns a number.
"""

import difflib
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import hypot, isfinite
from types import SimpleNamespace

import numpy as np

from cablestudy.cable import taut
from cablestudy.cable.geometry import chord_angles, clearance, load_sag, lowest_point, sag_and_swing
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study.load_cases import wind_direction
from cablestudy.study.table import Field, header
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.drag import shedding_frequencies
from cablestudy.wind.peak import peak_factor

SHAPELESS = "a part of the cable without weight is slack: it has no definite form"
LIMP = "a slack cable without weight has no definite form"
# keys that columns need, as `Column.key`
LOADED = "cable.loads|load_case.loads"
METAL, DIAMETER, STRONG = "cable.section_area", "cable.section_diameter", "cable.section_breaking_force"
WINCH = "gondola.mass, winch.controller"
DAMPING_RATIO = "gondola_damping_ratio"
GONDOLA_X = "gondola.x"  # outputs of `as_suspension`, with a gondola and without
MIDSPAN, TENSIONS = [f"cable.midspan.{axis}" for axis in "xyz"], ["cable.tension_from", "cable.tension_to"]
MM, UM = 1e3, 1e6
DRAG = "gondola.area, gondola.drag_coefficient, wind"
STEADY = "gondola.area, gondola.drag_coefficient, wind|load_case.wind"
BODY = f"gondola.mass, {DRAG}"
ON_CABLE = f"gondola.mass, wind, {DIAMETER}"
# numbers of `control.margins.Margins` of one loop and of several -> unit, meaning
SENSITIVITY = {
    "sensitivity_peak": ("", "largest singular value of the sensitivity S = (I + L)^-1 over frequency; |1/(1 + L)| of "
                         "one loop"),
    "sensitivity_frequency": ("Hz", "frequency of the largest sensitivity"),
    "bandwidth": ("Hz", "first frequency at which the largest singular value of T = L (I + L)^-1 falls below "
                  "1/sqrt(2); empty where it never does"),
    "disk_margin": ("", "alpha: stable with each factor (1 + d/2)/(1 - d/2) of the loop gain, |d| < alpha; at most 2. "
                    "Of several loops a lower bound: with such factors of all, coupled ones too"),
    "disk_gain_margin": ("dB", "gains may grow or fall by less than this, those of several loops independently; empty "
                         "where by any factor"),
    "disk_phase_margin": ("deg", "phases may turn by less than this, those of several loops independently"),
}  # fmt: skip
# attribute of the scene that is computed -> the key in the file by which it can be
WRITTEN = {
    "section_area": "area", "section_diameter": "diameter", "section_breaking_force": "breaking_force",
    "section_elastic_modulus": "area", "section_density": "area", "forces_on_end_2": "cases.*.forces.end_2",
    "nonzero_gravity": "gravity",
}  # fmt: skip


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # without its unit
    unit: str
    meaning: str
    # the most expensive result that it uses: scene, statics, stiffness, modes, gondola, loop, wind or run;
    # find: a key that a study solves for; limits: what the limits of the scene compare, in all their load cases
    needs: str
    compute: Callable  # Results -> ndarray, or Case -> float
    key: str = ""  # keys of the scene without which it has no value, separated by commas; one|another: either
    each: bool = False  # computed case by case, although it is a closed form
    mode: tuple = ()  # of a mode's frequency: number (from 1), kind, and symmetry or None
    without: str = ""  # key that a scene must not have
    text: bool = False  # whether its cells are texts
    # "form": by how the cable hangs between its ends, which a slack part without weight leaves open: refused there;
    # "sag": by its sag, whose estimated error counts too; empty: by neither
    determined_by: str = ""

    @property
    def least_error(self):
        """Estimated relative error of the closed form, by rounding; None of a column without an error. [-]"""
        if self.needs in ("run", "find") or self.text or self.name == "iterations":
            return None
        return 0.0 if self.needs == "scene" else STUDY.rounding

    @cached_property
    def header(self):
        """Name with its unit, as in CSV and JSON."""
        return header(self.name, self.unit)

    @property
    def field(self):
        """Its `Field` in a table."""
        return Field(self.header, self.name.replace("_", " "), self.unit, text=self.text)

    @cached_property
    def keys(self):
        """The keys of `key`, a tuple."""
        return tuple(filter(None, self.key.split(", ")))


def stress_of(results):
    """Largest stress of each cable. [Pa]"""
    return results.statics.max_tension / results.given("cable.section_area")


def utilisation_of(results):
    """Largest tension of each cable over its breaking force, not a number without one. [-]"""
    return results.statics.max_tension / results.given("cable.section_breaking_force")


def over_strength(results):
    """True if the largest tension of each cable is above its breaking force; False where none is stated."""
    return utilisation_of(results) > 1


def _mean_tension(results):
    """Mean tension of each cable, 0 where no part of it has any tension. [N]"""
    return np.where(results.statics.max_tension > 0, results.statics.mean_tension, 0.0)


def _catenary_constant(results):
    """Horizontal tension over weight per length, not finite without gravity. [m]"""
    with np.errstate(divide="ignore", invalid="ignore"):
        return results.statics.horizontal_tension / (results.given("cable.section_mass") * results.given("gravity"))


def _unstretched_length(results):
    """Unstretched length in the reference state: as the scene states it, to the last digit, else computed. [m]"""
    stated = results.given("cable.unstretched_length")
    return np.where(np.isnan(stated), results.reference_length, stated)


def _nonlinearity(case):
    """Linear over non-linear deflection by the point loads, less one. [-]"""
    full, linear = _deflections(case)
    return linear / full - 1 if full else 0.0


def _deflections(case):
    """Movement along its force of the load that moves most: non-linear, and linear about the unloaded form. [m]"""
    from cablestudy.study.deflection import load_deflections

    full, linear = load_deflections(case)
    largest = int(np.argmax(np.abs(full)))
    return float(full[largest]), float(linear[largest])


def mean_displacement(results):
    """Displacement of each gondola along x by the mean wind: rho/2 C_d A v^2 over the static stiffness. [m]

    By the steady wind of the load case where it has one; else zero where `wind.mean` leaves it out.
    """
    wind, gondola = (lambda key: results.given(f"wind.{key}")), (lambda key: results.given(f"gondola.{key}"))
    steady = results.given("load_case.wind.dynamic_pressure")
    by_wind = np.where(wind("mean"), wind("air_density") / 2 * wind("speed") ** 2, 0.0)
    along_x = wind_direction(results.given("load_case.wind.direction"))[..., 0]
    pressure = np.where(np.isnan(steady), by_wind, steady * along_x * results.pressure_on_gondola)
    with np.errstate(divide="ignore"):  # of cases that have no equilibrium
        return pressure * gondola("drag_coefficient") * gondola("area") / results.end_stiffness_along(0)


def _tension_at(end):
    """Function of the tension at an end (0 or 1)."""
    return lambda r: np.sqrt((r.form.end_forces()[..., end, :] ** 2).sum(axis=-1))


def _reaction(end, component):
    """Function of a part of the force of the support on the cable at an end: horizontal, or upwards."""

    def compute(results):
        force = -results.form.end_forces("global")[..., end, :]
        if component == "vertical":
            return force[..., 2]
        horizontal = np.hypot(force[..., 0], force[..., 1])
        # what the solver leaves of it in a vertical cable is rounding
        return np.where(horizontal > STUDY.upright * np.abs(force[..., 2]), horizontal, 0.0)

    return compute


def _coupling_stiffness(results):
    """Force along x by a movement along z, 0 where it is rounding of the stiffness along both. [N/m]"""
    direct = np.sqrt(np.abs(results.end_stiffness_along(0) * results.end_stiffness_along(2)))
    coupling = results.end_stiffness_along(0, 2)
    return np.where(np.abs(coupling) > STUDY.rounding * direct, coupling, 0.0)


def _angle(end):
    """Function of the angle of a cable below the horizontal where it leaves an end. [deg]"""

    def compute(results):
        force = results.form.end_forces("global")[..., end, :]
        return np.degrees(np.arctan2(-force[..., 2], np.hypot(force[..., 0], force[..., 1])))

    return compute


def _lowest_point(results):
    """Level of the lowest point of each cable. [m]"""
    return results.end_1[..., 2] + lowest_point(results.form)


def _support_columns():
    """Yield the columns of tensions, support forces and angles at the two ends."""
    for end in (1, 2):
        yield Column(f"tension_{end}", "N", f"tension at end {end}", "statics", _tension_at(end - 1))
    for end in (1, 2):
        yield Column(f"reaction_{end}_horizontal", "N", f"horizontal part of the force of the support at end {end}",
                     "statics", _reaction(end - 1, "horizontal"))  # fmt: skip
        yield Column(f"reaction_{end}_vertical", "N", f"vertical part of the force of the support at end {end}, "
                     "upwards: negative where it holds the end down", "statics",
                     _reaction(end - 1, "vertical"))  # fmt: skip
    for end in (1, 2):
        yield Column(f"angle_{end}", "deg", f"angle of the cable below the horizontal where it leaves end {end}",
                     "statics", _angle(end - 1), determined_by="form")  # fmt: skip


def _peak(case):
    """Expected largest displacement of a gondola [mm], and its estimated relative error."""
    case.check_winch_speed()
    return scaled(case.in_wind.peak([GONDOLA_X], float(mean_displacement(case))), MM)


def tensions_at_peak(case):
    """Least tension at an end, and largest one of the cable, expected within `wind.duration`. [N]

    With a gondola by its largest displacement: linear and quasi-static, towards either side, since a scene of one cable
    does not say whether its wind blows towards end 1 or away from it. With fixed ends by `tension_rms`, with as many
    crossings as cycles of the lowest mode.
    """
    tension, change = _change_at_peak(case)
    return float((tension - change).min()), float(case.statics.max_tension + np.max(change))


def _change_at_peak(case):
    """Tension at both ends, shape (2,), and its largest change as of `tensions_at_peak`, shape (2,) or a number. [N]"""
    force = case.equilibrium.end_forces[0] if case.exact_statics else case.state.end_forces("global")
    tension = np.sqrt((force**2).sum(axis=-1))
    if case.scene.gondola is None:
        lowest = float(case.in_cable_wind.sides[0].closed_loop.modes.frequency[0])
        change = peak_factor(lowest, case.scene.wind.duration) * _of_bare_cable(case, TENSIONS)[0]
    else:
        # force on end 2 per displacement along x; in closed form, since elements would have to be those of both planes
        stiffness = np.array([case.results.end_stiffness_along(axis, 0)[case.index] for axis in range(3)])
        change = np.abs(force @ stiffness) / np.where(tension > 0, tension, 1.0) * _peak(case)[0] / MM
    return tension, change


def goes_slack(case):
    """True if the least tension of a `Case` in the wind is below zero; False where its RMS was not computed."""
    solved = case.moves_in_wind and (case.scene.gondola is None or case.__dict__.get("in_wind") in case.solved_winds)
    try:
        tension, change = _change_at_peak(case) if solved else (np.zeros(2), 0.0)
        return bool((tension < change).any())
    except CablestudyError:  # a winch that would be too fast, for example: the columns of the wind say why
        return False


def _linear_range(case):
    """Displacement of the gondola along x up to which its cable is linear, or None where it always is. [mm]"""
    from cablestudy.cable.linear_range import linear_range

    displacement = linear_range(case.results.span.take([case.index]), np.array([[1.0, 0.0, 0.0]]))
    return None if displacement is None else 1e3 * displacement


def _imaged(name, meaning, keys):
    """Column of the gondola's motion in a telescope's image, with exposure time or correction as `name` says."""

    def compute(case):
        case.check_winch_speed()
        return scaled(case.in_wind.rms([GONDOLA_X], name, open_loop=False), UM)

    return Column(name, "um", meaning, "wind", compute, f"{BODY}, {keys}")


def _shedding(name, meaning, index):
    """Column of a frequency of vortex shedding: the low, mean and high one have the indices 0, 1, 2."""

    def compute(results):
        wind = SimpleNamespace(speed=results.given("wind.speed"), turbulence=results.given("wind.turbulence_along"))
        return shedding_frequencies(wind, results.given("wind_diameter"))[index]

    return Column(name, "Hz", meaning, "scene", compute, f"wind, {DIAMETER}")


def loop_columns(keys):
    """The columns of the winch loop, of one cable or of a suspension: list of Column, each with `keys` as `Column.key`.

    Their functions take a case with `in_wind`, and return a number and its estimated relative error.
    """
    properties = {
        "gain": ("rad/s", "integral gain of the loop of the winches, as stated or as it follows from a margin"),
        "largest_gain": ("rad/s", "integral gain below which the loop is stable, proportional and derivative gain in "
                         "proportion; empty when it always is"),
        "gain_margin": ("dB", "largest stable gain over the gain, of all winches together; empty when there is no "
                        "limit"),
        "phase_crossover": ("Hz", "frequency at which the largest gain puts a pole of the loop on the axis: that of "
                            "the gain margin"),
    }  # fmt: skip
    margins = {
        "phase_margin": ("deg", "least angle to instability where the loop gain is one: of several coordinates where "
                         "one of its eigenvalues has the size 1"),
        "gain_crossover": ("Hz", "frequency at which the loop gain is one: that of the phase margin"),
        "delay_margin": ("s", "least further delay in the loop of all winches that makes it unstable"),
        **SENSITIVITY,
    }  # fmt: skip

    return [
        *(Column(name, unit, meaning, "loop", lambda case, name=name: getattr(case.in_wind, name), keys)
          for name, (unit, meaning) in properties.items()),
        *(Column(name, unit, meaning, "loop", lambda case, name=name: case.in_wind.margin(name), keys)
          for name, (unit, meaning) in margins.items()),
    ]  # fmt: skip


def winch_columns(keys):
    """The columns of the speed of the winches in the wind, as `loop_columns`."""

    def speed(case, index):
        return scaled(case.in_wind.winch_speeds[index], MM)

    meanings = {
        "winch_rms_speed": "RMS of the speed of the winches in the wind, that of the fastest one",
        "winch_peak_speed": "largest speed of any winch expected within wind.duration",
    }
    return [
        Column(name, "mm/s", meaning, "wind", partial(speed, index=index), keys)
        for index, (name, meaning) in enumerate(meanings.items())
    ]


def _frequency(name, meaning, number, kind, symmetry=None):
    """Column of the frequency of a mode."""
    mode = number, kind, symmetry
    return Column(name, "Hz", meaning, "modes", lambda case: case.frequency(*mode), mode=mode)


def _rms(suffix, wind, key, compute):
    """Yield the columns of the gondola's RMS in one wind: of displacement and velocity, with loop and winch at rest.

    `suffix` and `wind` are the parts of their names and meanings for the wind. `compute` is a function of a `Case`,
    "value" or "rate", and whether the winch is at rest, for the RMS [m] or [m/s] and its relative error.
    """
    loops = (False, "with the winch loop", f"{key}, winch.controller"), (True, "the winch at rest", key)
    for at_rest, loop, keys in loops:
        for quantity, variance, unit in (("displacement", "value", "mm"), ("velocity", "rate", "mm/s")):

            def rms_in_mm(case, at_rest=at_rest, variance=variance):
                if not at_rest:
                    case.check_winch_speed()
                return scaled(compute(case, variance, at_rest), MM)

            name = "gondola_rms" + ("_velocity" if unit == "mm/s" else "") + ("_open_loop" if at_rest else "") + suffix
            meaning = f"RMS {quantity} of the gondola along x {wind}, {loop}"
            yield Column(name, unit, meaning, "wind", rms_in_mm, keys)


def _by_wind_on_gondola(case, variance, at_rest):
    """RMS of the gondola along x and its relative error, as `compute` of `_rms`; also the two following."""
    return case.in_wind.rms([GONDOLA_X], variance, at_rest)


def _by_wind_on_cable(case, variance, at_rest):
    return case.in_cable_wind.rms([GONDOLA_X], variance, at_rest)


def _of_bare_cable(case, names):
    """Largest RMS of some outputs of a bare cable over the directions of the wind, and its relative error."""
    return case.in_cable_wind.rms_to(case.scene.model.accuracy or np.inf, names)


def _by_wind_on_both(case, variance, at_rest):
    """RMS and error by the winds on gondola and cable together: they are independent, so that variances add."""
    winds = case.in_wind_that_damps, case.in_cable_wind
    (on_gondola, gondola_error), (on_cable, cable_error) = (wind.rms([GONDOLA_X], variance, at_rest) for wind in winds)
    total = hypot(on_gondola, on_cable)
    return total, (gondola_error * (on_gondola / total) ** 2 + cable_error * (on_cable / total) ** 2) if total else 0.0


def scaled(value_and_error, factor):
    """A number and its relative error, times a factor."""
    value, error = value_and_error
    return factor * value, error


COLUMNS = (
    Column("preload", "N", "mean tension over the unstretched length", "statics", _mean_tension),
    Column("horizontal_tension", "N", "mean horizontal part of the tension", "statics",
           lambda r: r.statics.horizontal_tension),
    Column("catenary_constant", "m", "horizontal tension over the weight of a length without ice: H/w", "statics",
           _catenary_constant, "nonzero_gravity"),
    Column("max_tension", "N", "largest tension along the cable", "statics", lambda r: r.statics.max_tension),
    Column("min_tension", "N", "smallest tension along the cable", "statics", lambda r: r.statics.min_tension),
    Column("unstretched_length", "m", "length without tension, at the reference temperature", "statics",
           _unstretched_length),
    Column("stretched_length", "m", "length under tension", "statics", lambda r: r.statics.stretched_length),
    Column("chord", "m", "distance between the ends", "scene", lambda r: r.chord),
    Column("sag", "m", "vertical distance from chord to cable at mid-span", "statics", lambda r: r.statics.sag,
           determined_by="sag"),
    Column("sag_ratio", "", "sag over chord", "statics", lambda r: r.statics.sag / r.chord, determined_by="sag"),
    Column("mass", "kg", "mass of the cable, mass per length x unstretched length", "statics",
           lambda r: r.given("cable.section_mass") * r.reference_length),
    Column("diameter", "mm", "outer diameter of the cross-section", "scene",
           lambda r: 1e3 * r.given("cable.section_diameter"), DIAMETER),
    Column("area", "mm^2", "metallic area of the cross-section", "scene",
           lambda r: 1e6 * r.given("cable.section_area"), METAL),
    Column("elastic_modulus", "GPa", "axial stiffness over area", "scene",
           lambda r: r.given("cable.section_elastic_modulus") / 1e9, "cable.section_elastic_modulus"),
    Column("density", "kg/m^3", "mass per length over area", "scene",
           lambda r: r.given("cable.section_density"), "cable.section_density"),
    Column("axial_stiffness", "N", "EA, tension per strain", "scene",
           lambda r: r.given("cable.section_axial_stiffness")),
    Column("mass_per_length", "kg/m", "mass per length of the unstretched cable", "scene",
           lambda r: r.given("cable.section_mass")),
    Column("breaking_force", "N", "tension at which the cable breaks", "scene",
           lambda r: r.given("cable.section_breaking_force"), STRONG),
    Column("strain", "", "mean strain, mean tension over EA", "statics",
           lambda r: _mean_tension(r) / r.given("cable.section_axial_stiffness")),
    Column("stress", "MPa", "largest tension over area", "statics", lambda r: stress_of(r) / 1e6, METAL),
    Column("utilisation", "", "largest tension over breaking force", "statics", utilisation_of, STRONG),
    Column("lambda_squared", "", "Irvine's parameter: stiffness by stretching over stiffness by sagging", "statics",
           lambda r: taut.lambda_squared(r.span, r.statics.mean_tension)),
    Column("deflection", "m", "movement of the most moved point load along its force, from the unloaded form",
           "statics", lambda c: _deflections(c)[0], LOADED, each=True),
    Column("linear_deflection", "m", "deflection by the tangent stiffness of the unloaded form", "statics",
           lambda c: _deflections(c)[1], LOADED, each=True),
    Column("nonlinearity", "", "linear over full deflection, less one", "statics", _nonlinearity, LOADED,
           each=True),
    Column("load_sag", "m", "vertical distance from chord to the point load that hangs lowest below it", "statics",
           lambda c: load_sag(c.form), LOADED, each=True),
    *_support_columns(),
    Column("lowest_point", "m", "level of the lowest point of the cable, its ends included", "statics", _lowest_point,
           determined_by="form"),
    Column("clearance", "m", "least vertical distance from the cable down to the ground", "statics",
           lambda c: clearance(c.form, c.end_1, c.scene.ground), "ground", each=True, determined_by="form"),
    Column("swing", "deg", "angle out of the vertical plane of the chord, at mid-span", "statics",
           lambda r: np.degrees(sag_and_swing(r.form, r.middle)[1]), determined_by="form"),
    Column("inclination_from_plumb", "deg", "angle of the chord from the vertical", "statics",
           lambda r: np.degrees(chord_angles(r.span)[1])),
    Column("end_stiffness", "N/m", "static stiffness of end 2 along x, interior condensed", "stiffness",
           lambda r: r.end_stiffness_along(0)),
    Column("end_stiffness_zz", "N/m", "static stiffness of end 2 along z", "stiffness",
           lambda r: r.end_stiffness_along(2)),
    Column("end_stiffness_yy", "N/m", "static stiffness of end 2 along y", "stiffness",
           lambda r: r.end_stiffness_along(1)),
    Column("end_stiffness_xz", "N/m", "force along x by a static movement of end 2 along z", "stiffness",
           _coupling_stiffness),
    Column("end_stiffness_along", "N/m", "static stiffness of end 2 along the chord", "stiffness",
           lambda r: r.end_stiffness_chord),
    _frequency("cable_frequency", "lowest in-plane frequency, ends fixed", 1, "in-plane"),
    Column("gondola_frequency_static", "Hz", "sqrt(static end stiffness/gondola mass)/(2 pi)", "stiffness",
           lambda r: np.sqrt(r.end_stiffness_along(0) / r.given("gondola.mass")) / (2 * np.pi), "gondola.mass"),
    Column("gondola_frequency", "Hz", "coupled mode with the largest share of the gondola's static compliance",
           "gondola", lambda c: c.gondola_mode.frequency, "gondola.mass"),
    Column("gondola_share", "", "share of the gondola's static compliance in its mode, phi^2/w^2 over 1/k", "gondola",
           lambda c: c.gondola_mode.share, "gondola.mass"),
    Column(DAMPING_RATIO, "", "damping ratio of the coupled gondola mode, the winch at rest", "gondola",
           lambda c: c.gondola_mode.damping_ratio, "gondola.mass"),
    *loop_columns(WINCH),
    *_rms("", "in the wind", BODY, _by_wind_on_gondola),
    *_rms("_cable_wind", "by the wind on the cable alone", ON_CABLE, _by_wind_on_cable),
    *_rms("_all_wind", "by the wind on gondola and cable together, which damps the cable too, so that it can be less "
          "than by the wind on the gondola alone", f"{BODY}, {DIAMETER}", _by_wind_on_both),
    Column("mean_displacement", "mm", "displacement of the gondola along x by the mean wind on it, the winch at rest; "
           "linear", "stiffness", lambda r: 1e3 * mean_displacement(r), STEADY),
    Column("force_displacement", "mm", "displacement of the gondola along x by the force of the load case on it",
           "statics", lambda r: 1e3 * r.pushed[0], "gondola.mass, forces_on_end_2"),
    Column("peak", "mm", "largest displacement of the gondola expected within wind.duration: mean_displacement, and "
           "Davenport's factor times the RMS with the winch loop, if there is one", "wind", _peak, BODY),
    Column("peak_utilisation", "", "largest tension over breaking force at the gondola's peak, towards either side; "
           "linear", "wind", lambda c: tensions_at_peak(c)[1] / float(c.given(STRONG)), f"{BODY}, {STRONG}"),
    Column("linear_range", "mm", "displacement of the gondola along x, of either sign, at which the restoring force of "
           "the cable differs by 5 % from linear; empty where it does not", "stiffness", _linear_range, "gondola.mass",
           each=True),
    *winch_columns(f"{BODY}, winch.controller"),
    _imaged("exposure", "RMS of the gondola's motion within one exposure, with the winch loop if there is one",
            "exposure"),
    _imaged("corrected", "RMS of the gondola's motion that the correcting mirror leaves", "correction"),
    _imaged("corrected_exposure", "RMS of the gondola's motion within one exposure that the mirror leaves",
            "exposure, correction"),
    Column("midspan_rms", "mm", "RMS displacement at mid-span of a cable with fixed ends in the wind, in the direction "
           "that moves most", "wind", lambda c: scaled(_of_bare_cable(c, MIDSPAN), MM), f"wind, {DIAMETER}",
           without="gondola"),
    Column("tension_rms", "N", "RMS tension of a cable with fixed ends in the wind, at the end where it is larger",
           "wind", lambda c: _of_bare_cable(c, TENSIONS), f"wind, {DIAMETER}", without="gondola"),
    _shedding("shedding_frequency", "frequency of vortices, 0.2 v/d at the mean wind speed", 1),
    _shedding("shedding_frequency_low",
              "frequency of vortices at three standard deviations of the speed below the mean, 0 at least", 0),
    _shedding("shedding_frequency_high",
              "frequency of vortices at three standard deviations of the speed above the mean", 2),
    Column("limit_margin", "", "least margin of the limits in all of their load cases, relative to the limit; negative "
           "where one does not hold", "limits", None, "limits"),
    Column("governing", "", "limit with the least margin, and the load case and cable in which it has it", "limits",
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
STATUS = Field("status", "status", unless="ok", text=True)

FAMILIES = (
    _frequency("inplane_frequency_K", "in-plane frequency K (1, 2, ...), axial modes not counted", 0, "in-plane"),
    _frequency("outofplane_frequency_K", "out-of-plane frequency K", 0, "out-of-plane"),
    _frequency("symmetric_frequency_K", "symmetric in-plane frequency K", 0, "in-plane", "symmetric"),
    _frequency("axial_frequency_K", "axial frequency K", 0, "axial"),
)


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
        if family.name == match[1] + "K" and int(match[2]) <= STUDY.highest_mode_number:
            number = int(match[2])
            return _frequency(f"{match[1]}{number}", family.meaning, number, *family.mode[1:])
    family = next((f.name for f in FAMILIES if re.fullmatch(f.name.replace("_K", r"_\w+"), name)), None)
    if family:
        raise ValueError(
            f"unknown column {name!r} ({family}: K is a whole number from 1 to {STUDY.highest_mode_number})"
        )
    if "safety" in name:
        raise ValueError(f"unknown column {name!r} (did you mean utilisation? it is 1 over the safety factor)")
    names = [column.name for column in COLUMNS + FAMILIES]
    spellings = name, re.sub(r"\d+", "K", name)
    similar = next(filter(None, (difflib.get_close_matches(spelling, names, 1) for spelling in spellings)), None)
    hint = f"did you mean {similar[0]}?" if similar else "'cablestudy columns' lists them"
    raise ValueError(f"unknown column {name!r} ({hint})")


OWN = {column.name for column in COLUMNS}


def is_own(column):
    """True if a column is one of this file, of one cable, or a key that a study solves for."""
    return column.name in OWN or column.needs == "find" or (len(column.mode) == 3 and "." not in column.name)


def least_work_first(columns):
    """Columns in the order in which they cost least: list.

    By falling mode number, since the model of a high mode has the lower ones; and those of the loop before those of the
    wind, which need no largest gain, but are spared another proof of stability where it is known.
    """
    return sorted(columns, key=lambda column: (column.needs == "wind", -column.mode[0] if column.mode else 0))


def attribute(scene, path):
    """Attribute of a scene, or entry of its tables, at a path with dots; None where part of the path is missing."""
    for name in path.split("."):
        scene = scene.get(name) if isinstance(scene, dict) else getattr(scene, name, None)
    return scene


def lacks(scene, column):
    """The first key that a column needs and a scene has no value for, or an empty text."""
    for key in column.keys:
        values = [attribute(scene, name) for name in key.split("|")]
        if all(value is None or (isinstance(value, tuple | dict) and not value) for value in values):
            return written_key(key.split("|")[0])
    return ""


def written_key(key):
    """The key of the file for a key of `Column.key`, which may be an attribute that the scene computes."""
    table, _, name = key.rpartition(".")
    return f"{table}.{WRITTEN[name]}".strip(".") if name in WRITTEN else key


def without(scene, column):
    """The error of a column that needs a key which its case lacks."""
    return NoSolutionError(f"{column.name} needs the key {lacks(scene, column)}, which this case does not have")


def shapeless(column, limp):
    """The error of a column `determined_by` the form of a cable that is slack in part, or, if `limp`, all of it."""
    return NoSolutionError(LIMP if limp else f"no {column.name}: {SHAPELESS}")


def not_finite(column):
    """The error of a column whose value is not finite."""
    return NoSolutionError(f"{column.header} is not finite")


def value(column, case):
    """One number of a case whose scene has the keys that the column needs; see `value_and_error`."""
    return value_and_error(column, case)[0]


def value_and_error(column, case):
    """One number of a case whose scene has the keys that the column needs, and its estimated relative error.

    None where the quantity has no value, for example no limit of the gain, and where the column states no error;
    NoSolutionError or ConvergenceError where there is no solution.
    """
    if column.determined_by and case.exact_statics and case.catenary.slack:
        raise shapeless(column, case.limp)
    result = column.compute(case)
    number, error = result if isinstance(result, tuple) else (result, None)
    if not isinstance(number, float | int | None):
        number = np.asarray(number).item()
    if number is None or isinstance(number, int):
        return number, error
    if not isfinite(number):
        raise not_finite(column)
    return float(number) + 0.0, error  # no minus before a zero


def first_of_largest(values, apart):
    """Index of the largest of some values, shape (m,): of those closer to it than a relative distance the first."""
    return int(np.argmax(values >= values.max() * (1 - apart)))


def relative(value, reference):
    """Relative difference; 1 where only one of the two is there. [-]"""
    if value is None or reference is None:
        return float(value is not reference)
    return abs(value - reference) / abs(reference) if reference else float(value != reference)
