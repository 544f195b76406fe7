"""Scenes: what is read from a file, what is derived, and every mistake in one line at its place."""

import json
import math
import re
from pathlib import Path

import pytest
from campaign import campaign
from command import CONFIGS, calls, write
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scenes import mistakes_of, scene_of

import cablestudy
from cablestudy.errors import SceneError
from cablestudy.scene.cable_table import Cable
from cablestudy.scene.document import read_document, read_file
from cablestudy.scene.fields import KeyTable, suggestion
from cablestudy.scene.scene import TABLES, CableScene, ModelTable, missing, quantity_of, read_scene
from cablestudy.scene.schema import scene_schema, study_schema, suspension_schema
from cablestudy.scene.suspension import SuspensionScene

GOOD = """\
gravity: 9.81
cable:
  ends: [[0, 0, 0], [185.8, 0, 0]]
  material: aramid
  elastic_modulus: 70.3 GPa
  density: 1440 kg/m^3
  area: 2.69 mm^2
  unstretched_length: 184.4883 m
  damping: {model: modal, ratio: 0.01}
  loads: [{at: 139.35 m, force: [0 N, 0 N, -1 N]}]
gondola: {mass: 50 kg, area: 0.6 m^2, drag_coefficient: 1.17}
winch: {location: ground, controller: {gain: 0.325, notch: {frequency: coupled, rolloff_frequency: 10 Hz}}}
wind: {speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m}
model: {elements: 40}
"""


pytestmark = pytest.mark.usefixtures("folder")


def test_a_scene_is_read_into_si():
    scene = scene_of(GOOD)
    cable = scene.cable
    assert (cable.elastic_modulus, cable.density, cable.area, cable.diameter) == (70.3e9, 1440.0, 2.69e-6, None)
    assert cable.strength == 2920e6  # of aramid
    assert (cable.end_1, cable.end_2) == ((0, 0, 0), (185.8, 0, 0))
    assert (cable.chord_length, cable.rise) == (185.8, 0)
    assert cable.section_axial_stiffness == 70.3e9 * 2.69e-6
    assert cable.section_mass == 1440 * 2.69e-6
    assert (cable.loads[0].at, cable.loads[0].force) == (139.35, (0, 0, -1))
    assert scene.gondola.mass == 50
    assert scene.winch.controller.notch.frequency == "coupled"
    assert scene.wind.turbulence == pytest.approx(0.9)  # 0.15 * 6
    assert (scene.model.elements, scene.model.accuracy) == (40, None)


WIND_KEYS = ["speed", "length_scale", "air_density", "duration", "turbulence_intensity"]


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("direction", None), ("vector", None), ("spede", "speed"), ("sped", "speed"), ("mean_speed", "speed"),
        ("intensity", "turbulence_intensity"), ("turb", "turbulence_intensity"), ("lenght_scael", "length_scale"),
        ("turbulense_intensety", "turbulence_intensity"), ("air", "air_density"),
    ],
)  # fmt: skip
def test_hints_name_words_with_few_other_letters_or_an_equal_part(word, hint):
    expected = f"did you mean {hint}?" if hint else f"allowed: {', '.join(WIND_KEYS)}"
    assert suggestion(word, WIND_KEYS) == expected


def test_defaults_are_those_of_the_interface():
    scene = scene_of(GOOD.replace("gravity: 9.81\n", "").replace("model: {elements: 40}\n", ""))
    assert scene.gravity == 9.81
    assert (scene.model.accuracy, scene.model.elements) == (1e-4, None)
    assert (scene.wind.air_density, scene.wind.spectrum, scene.wind.admittance) == (1.2, "von_karman", "vickery")
    notch = scene.winch.controller.notch
    assert (notch.damping_ratio, notch.rolloff_frequency, notch.rolloff_damping_ratio) == (0.05, 10.0, 1.0)


def test_defaults_that_are_tables_are_what_an_empty_table_is_read_as():
    """Some are made without validators, which cost time when the program starts."""
    defaults = [field.default for table in tables() for field in table.model_fields.values()]
    made = [default for default in defaults if isinstance(default, KeyTable)]
    made += [CableScene.no_case, SuspensionScene.no_case]
    assert len(made) > 8
    for default in made:
        assert default == type(default).model_validate({})
        assert default.model_fields_set == type(default).model_validate({}).model_fields_set


def tables(beginning=KeyTable):
    """All models of the file format."""
    for table in beginning.__subclasses__():
        yield from (table, *tables(table))


def test_gain_and_notch_have_several_forms():
    assert scene_of(GOOD, "winch.controller.notch=none").winch.controller.notch is None
    assert scene_of(GOOD, "winch.controller.notch.frequency=0.7 Hz").winch.controller.notch.frequency == 0.7
    automatic = scene_of(GOOD, "winch.controller.gain={auto: {gain_margin: 6 dB}}")
    assert automatic.winch.controller.gain.auto.gain_margin == 6


@pytest.mark.parametrize(
    ("inclination", "span", "rise"),
    [
        ("0 deg", 100, 0),
        ("90 deg", 0, 100),
        ("-90 deg", 0, -100),
        ("30 deg", 50 * math.sqrt(3), 50),
        ("-0.5", 100 * math.cos(0.5), -100 * math.sin(0.5)),  # a bare number is in radian
    ],
)
def test_a_chord_with_inclination_gives_the_ends(inclination, span, rise):
    sets = ("cable.chord=100 m", f"cable.inclination={inclination}", "cable.preload=1 kN", "cable.loads=null")
    cable = scene_of(GOOD, *sets).cable
    tolerance = 0 if abs(rise) in (0, 100) else 1e-14
    assert cable.end_1 == (0, 0, 0)
    assert cable.chord_length == 100
    assert cable.end_2 == pytest.approx((span, 0, rise), rel=tolerance, abs=0)
    assert cable.rise == pytest.approx(rise, rel=tolerance, abs=0)


def test_diameter_and_area_describe_the_same_section():
    cable = scene_of(GOOD, "cable.diameter=2 mm").cable
    assert cable.section_area == pytest.approx(math.pi * 1e-6, rel=1e-15)
    assert (cable.section_diameter, cable.area) == (0.002, None)
    assert scene_of(GOOD, f"cable.area={math.pi * 1e-6!r}").cable.section_diameter == pytest.approx(0.002, rel=1e-15)


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("{}", ("modal", 0.01, None, None, 0.0)),
        ("{model: modal}", ("modal", 0.01, None, None, 0.0)),
        ("{ratio: 0}", ("modal", 0.0, None, None, 0.0)),
        ("{viscous: 0.02 N s/m^2}", ("modal", 0.0, None, None, 0.02)),
        ("{viscous: 0.02}", ("modal", 0.0, None, None, 0.02)),
        ("{model: modal, viscous: 20 mN s/m^2}", ("modal", 0.01, None, None, 0.02)),
        ("{ratio: 1 %, viscous: 0.02 Pa*s}", ("modal", 0.01, None, None, 0.02)),  # N s/m^2 is Pa s
        ("{loss_factor: 0.1, viscous: 0}", ("hysteretic", None, 0.1, None, 0.0)),
        ("{model: kelvin_voigt, time: 5 ms}", ("kelvin_voigt", None, None, 0.005, 0.0)),
        ("{model: kelvin_voigt, time: 1 ms, viscous: 1e6}", ("kelvin_voigt", None, None, 0.001, 1e6)),
    ],
)
def test_damping(written, read):
    """Model, ratio, loss factor, time and viscous damping, which is added to any model or stands alone."""
    damping = scene_of(GOOD, f"cable.damping={written}").cable.damping
    assert (damping.model, damping.ratio, damping.loss_factor, damping.time, damping.viscous) == read


def test_viscous_damping_set_in_an_upper_layer_keeps_the_model_below():
    damping = scene_of(GOOD, "cable.damping.viscous=0.02").cable.damping
    assert (damping.model, damping.ratio, damping.viscous) == ("modal", 0.01, 0.02)
    damping = scene_of(GOOD, "cable.damping={viscous: 0.1}", "cable.damping.loss_factor=0.2").cable.damping
    assert (damping.model, damping.ratio, damping.viscous) == ("hysteretic", None, 0.1)


def test_a_material_gives_what_is_not_given_and_replaces_what_is_below():
    steel = scene_of(GOOD, "cable.material=steel").cable  # wire of grade 1770
    assert (steel.elastic_modulus, steel.density, steel.strength) == (205e9, 7850, 1770e6)
    heavy = scene_of(GOOD, "cable.material=steel", "cable.density=8 g/cm^3").cable
    assert (heavy.elastic_modulus, heavy.density) == (205e9, 8000)


def test_a_stiffness_mass_or_force_of_its_own_wins_over_the_material():
    cable = scene_of(GOOD.replace("  elastic_modulus: 70.3 GPa\n  density: 1440 kg/m^3\n", "")).cable
    own = "  axial_stiffness: 150 kN\n  mass_per_length: 3 g/m\n  breaking_force: 4 kN\n"
    given = scene_of(GOOD.replace("  elastic_modulus: 70.3 GPa\n  density: 1440 kg/m^3\n", own)).cable
    assert (given.section_axial_stiffness, given.section_mass, given.section_breaking_force) == (150e3, 3e-3, 4e3)
    assert (given.elastic_modulus, given.density, given.strength) == (None, None, None)
    assert (given.section_elastic_modulus, given.section_density) == (150e3 / 2.69e-6, 3e-3 / 2.69e-6)
    assert cable.section_breaking_force == 2920e6 * 2.69e-6


# One mistake each: what is replaced in GOOD, by what, and the line that says so.
BAD = [
    ("gravity:", "gravty:", "1:1: gravty: unknown key (did you mean gravity?)"),
    ("density:", "densty:", "6:3: cable.densty: unknown key (did you mean density?)"),
    ("gondola: {mass:", "gondola: {qqq: 1, mass:",
     "11:11: gondola.qqq: unknown key (allowed: mass, area, drag_coefficient)"),
    ("{mass: 50 kg, ", "{", "11:10: gondola: missing key: mass"),
    ("  area: 2.69 mm^2\n", "",
     "3:3: cable: missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  axial_stiffness: 189 kN\n",
     "5:3: cable.elastic_modulus: given together with axial_stiffness: give exactly one of axial_stiffness, "
     "elastic_modulus, stress_strain"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  diameter: 1.8 mm\n",
     "8:13: cable.diameter: a circle of it has 2.54469e-06 m^2, less than 2.69e-06 m^2"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  diameter: 2 mm\n  fill_factor: 0.8\n",
     "9:16: cable.fill_factor: has no effect: area and diameter are given"),
    ("  elastic_modulus: 70.3 GPa\n  density: 1440 kg/m^3\n  area: 2.69 mm^2\n", "  axial_stiffness: 189 kN\n",
     "3:3: cable: missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  breaking_force: 0\n",
     "8:19: cable.breaking_force: must be positive, got 0"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  breaking_force: 1 kN\n  strength: 1 GPa\n",
     "9:3: cable.strength: given together with breaking_force: give exactly one of breaking_force, strength"),
    ("  area: 2.69 mm^2\n", "  area: 2.69 mm^2\n  expansion: 12e-6 1/m\n",
     "8:14: cable.expansion: expected a coefficient of expansion in 1/K (a number, or text such as \"12e-6 1/K\"), "
     'got "12e-6 1/m" (1 / meter)'),
    ("unstretched_length: 184.4883 m", "preload: 0 %",
     '8:12: cable.preload: a share of the breaking force must be above 0 % and at most 100 %, got "0 %"'),
    ("unstretched_length: 184.4883 m", "preload: 101 %",
     '8:12: cable.preload: a share of the breaking force must be above 0 % and at most 100 %, got "101 %"'),
    ("unstretched_length: 184.4883 m", "preload: ten %",
     '8:12: cable.preload: a share of the breaking force must be above 0 % and at most 100 %, got "ten %"'),
    ("  material: aramid\n  elastic_modulus: 70.3 GPa\n  density: 1440 kg/m^3\n  area: 2.69 mm^2\n"
     "  unstretched_length: 184.4883 m\n",
     "  axial_stiffness: 189 kN\n  mass_per_length: 4 g/m\n  strength: 1 GPa\n  preload: 10 %\n",
     "7:12: cable.preload: a share needs the breaking force: give breaking_force, or strength with area or diameter"),
    ("  material: aramid\n", "  inclination: 3 deg\n",
     "4:3: cable.inclination: given together with ends: give exactly one of ends, chord"),
    ("ends: [[0, 0, 0], [185.8, 0, 0]]", "inclination: 1", "3:3: cable: missing key: chord (inclination goes with it)"),
    ("length_scale", "turbulence_rms: 1, length_scale",
     "13:50: wind.turbulence_rms: given together with turbulence_intensity: "
     "give exactly one of turbulence_intensity, turbulence_rms"),
    ("{elements: 40}", "{elements: 40, accuracy: 1e-3}",
     "14:9: model.elements: given together with accuracy: give exactly one of accuracy, elements"),
    ("{elements: 40}", "{order: 4}", "14:8: model: missing key: elements (order goes with it)"),
    ("{elements: 40}", "{elements: 4, order: 4, mass: blended}",
     "14:38: model.mass: blended needs order 1, and the order is 4 (use lumped or consistent)"),
    ("{elements: 40}", "{elements: 4.5}", "14:19: model.elements: expected a whole number from 1 to 1000000, got 4.5"),
    ("{elements: 40}", "{accuracy: 0.5}", "14:19: model.accuracy: must be from 1e-20 to 0.1, got 0.5"),
    ("2.69 mm^2", "2.69 mm",
     '7:9: cable.area: expected an area in m^2 (a number, or text such as "2.69 mm^2"), got "2.69 mm" (length)'),
    ("70.3 GPa", "70.3 Gpa",
     '5:20: cable.elastic_modulus: expected a stress in Pa (a number, or text such as "70.3 GPa"), '
     'got "70.3 Gpa" (unknown unit "Gpa"; did you mean GPa?)'),
    ("1440 kg/m^3", "heavy",
     '6:12: cable.density: expected a density in kg/m^3 (a number, or text such as "1440 kg/m^3"), got "heavy"'),
    ("184.4883 m", "-184.4883 m", '8:23: cable.unstretched_length: must be positive, got "-184.4883 m"'),
    ("2.69 mm^2", "0", "7:9: cable.area: must be positive, got 0"),
    ("2.69 mm^2", ".nan", '7:9: cable.area: expected an area in m^2 (a number, or text such as "2.69 mm^2"), '
     "got nan, which is not finite"),
    ("6 m/s", ".inf",
     '13:15: wind.speed: expected a speed in m/s (a number, or text such as "6 m/s"), got inf, which is not finite'),
    ("gravity: 9.81", "gravity: no",
     '1:10: gravity: expected an acceleration in m/s^2 (a number, or text such as "9.81 m/s^2"), got "no"'),
    ("gravity: 9.81", "gravity: -1", "1:10: gravity: must not be negative, got -1"),
    ("[185.8, 0, 0]", "[0, 0, 0]", "3:9: cable.ends: the two ends coincide"),
    ("[185.8, 0, 0]", "[185.8, 0]", "3:21: cable.ends.1: expected 3 components, got 2"),
    ("[185.8, 0, 0]", "[185.8, 0, 0, 0]", "3:21: cable.ends.1: expected at most 3 items, got 4"),
    (", [185.8, 0, 0]", "", "3:9: cable.ends: expected 2 points, got 1"),
    ("[[0, 0, 0], [185.8, 0, 0]]", "5", "3:9: cable.ends: expected a list, got 5"),
    ("184.4883 m", "184.4883 mm",
     "8:23: cable.unstretched_length: 0.1844883 m is 0.000993 times the distance of the ends, 185.8 m "
     "(allowed: 0.2 to 200 times; did you mean 184.4883 m?)"),
    ("184.4883 m", "184.4883 km",
     "8:23: cable.unstretched_length: 184488.3 m is 993 times the distance of the ends, 185.8 m "
     "(allowed: 0.2 to 200 times; did you mean 184.4883 m?)"),
    ("139.35 m", "190 m", "10:16: cable.loads.0.at: 190 m is not on the cable, which is 184.4883 m long"),
    ("{at: 139.35 m, ", "{", "10:11: cable.loads.0: missing key: one of at, fraction"),
    ("[{at: 139.35 m, force: [0 N, 0 N, -1 N]}]", "{at: 1}",
     '10:10: cable.loads: expected a list, got a mapping (each item of a list begins with "- ")'),
    ("{mass: 50 kg, area: 0.6 m^2, drag_coefficient: 1.17}", "[50 kg]",
     "11:10: gondola: expected a mapping with the keys mass, area, drag_coefficient, got a list"),
    ("50 kg", "{a: 1}",
     '11:17: gondola.mass: expected a mass in kg (a number, or text such as "50 kg"), got a mapping'),
    ("50 kg", "0", "11:17: gondola.mass: must be positive, got 0"),
    ("aramid", "arammid", '4:13: cable.material: unknown material "arammid" (did you mean aramid?)'),
    ("location: ground", "location: sky", '12:19: winch.location: got "sky" (allowed: ground, gondola)'),
    ("model: modal", "model: modl", '9:20: cable.damping.model: got "modl" (did you mean modal?)'),
    ("ratio: 0.01", "ratio: -1", "9:34: cable.damping.ratio: must not be negative, got -1"),
    ("ratio: 0.01", "viscous: -1", "9:36: cable.damping.viscous: must not be negative, got -1"),
    ("ratio: 0.01", "viscous: 1 N/m", "9:36: cable.damping.viscous: expected a viscous damping per length in N s/m^2 "
     '(a number, or text such as "0.02 N s/m^2"), got "1 N/m" (stiffness)'),
    ("model: modal", "model: hysteretic",
     "9:39: cable.damping.ratio: belongs to the model modal; the model is hysteretic, with loss_factor"),
    ("model: modal, ratio: 0.01", "model: hysteretic",
     "9:12: cable.damping: missing key: loss_factor (the model is hysteretic)"),
    ("gain: 0.325", "gain: {auto: {gain_margin: 6 m}}",
     "12:67: winch.controller.gain.auto.gain_margin: expected a level in dB "
     '(a number, or text such as "6 dB"), got "6 m"'),
    ("frequency: coupled", "frequency: copled",
     "12:72: winch.controller.notch.frequency: expected one of coupled, static, or a frequency in Hz "
     '(a number, or text such as "10 Hz"), got "copled"'),
    ("gravity: 9.81", "columns: [sag]", "1:1: this is a study (it has the key columns): use 'cablestudy sweep'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_one_mistake_is_one_line_at_its_place(old, new, message):
    assert GOOD.count(old) >= 1
    assert mistakes_of(GOOD.replace(old, new, 1)) == [f"s.yaml:{message}"]


def test_a_value_of_a_missing_material_is_asked_for():
    text = GOOD.replace("  material: aramid\n  elastic_modulus: 70.3 GPa\n", "")
    line = "s.yaml:3:3: cable: missing key: one of axial_stiffness, elastic_modulus (or give material)"
    assert mistakes_of(text) == [line]
    text = GOOD.replace("aramid", "kryptonite").replace("  elastic_modulus: 70.3 GPa\n", "")
    assert len(mistakes_of(text)) == 1


def test_all_mistakes_are_reported_at_once_in_the_order_of_the_file():
    text = GOOD.replace("gravity", "gravty").replace("2.69 mm^2", "2 kg\n  axial_stiffness: 1 kN").replace("50 kg", "0")
    assert [line.split(":")[1] for line in mistakes_of(text)] == ["1", "5", "7", "12"]


def test_a_wrong_base_value_is_reported_in_the_base_file():
    write("base.yaml", GOOD.replace("2.69 mm^2", "0"))
    assert mistakes_of("base: base.yaml\ngravity: 1\n") == ["base.yaml:7:9: cable.area: must be positive, got 0"]


STEEP = "--set cable.inclination: must be from -90 deg to 90 deg (a bare number is rad), got "
APART = "the two ends are {} m apart: out of range (1e-09 to 1e+09 m)"


@pytest.mark.parametrize(
    ("sets", "messages"),
    [
        (["cable.area=4", "cable.diameter=2"],
         ["--set cable.diameter: a circle of it has 3.14159 m^2, less than 4 m^2"]),
        (["cable.chord=185.8", "cable.inclination=90.001 deg"], [STEEP + '"90.001 deg"']),
        (["cable.chord=185.8", "cable.inclination=19"], [STEEP + "19"]),
        (["cable.area=1e9", "cable.elastic_modulus=1e30", "cable.density=1e15"],
         ["--set cable.density: times the area of the cross-section is 1e+24 kg/m: out of range (1e-18 to 1e+12 kg/m)",
          "--set cable.elastic_modulus: times the area of the cross-section is 1e+39 N: out of range "
          "(1e-12 to 1e+24 N)"]),
        (["cable.ends=[[-1e9, 0, 0], [1e9, 0, 0]]"], [APART.format("2e+09")]),
        (["cable.ends=[[0, 0, 0], [1e-10, 0, 0]]"], [APART.format("1e-10")]),
        (["cable.preload=1e20", "cable.loads=null"],
         ["1e+20 N is 5.29e+14 times the axial stiffness: out of range (1e-18 to 10 times)"]),
    ],
)  # fmt: skip
def test_values_that_do_not_go_together_are_refused(sets, messages):
    for line, message in zip(mistakes_of(GOOD, *sets), messages, strict=True):
        assert message in line


KEYS = [
    ".".join((*path, name)).replace("loads.*", "loads.0").replace("*", "day")
    for path, model in TABLES
    for name in model.model_fields
]
RANGES = {key: quantity_of(key) for key in KEYS if quantity_of(key)}
AUTO = "winch.controller.gain={auto: {gain_margin: 6}}"
ICE, WIND, LOAD = "{ice: {thickness: 1 mm}}", "{wind: {speed: 1}}", "{loads: [{at: 1, mass: 1}]}"
METAL = "{elastic_modulus: 1e9, density: 1}"
CURVES = "{outer: {initial: [0, 1e4], final: 7e9, expansion: 0}, core: {initial: [0, 1e4], final: 7e9, expansion: 0}}"
OF_PART = ("initial", "creep", "final", "expansion", "area_share")
OF_WIND = ("direction", "air_density", "cable_drag_coefficient", "at", "exponent", "gust_factor")
OF_MATERIAL = ("breaking_force", "strength", "area", "diameter", "fill_factor", "expansion")
BESIDE = {
    "cable.tension.value": ("cable.tension={at: mean, value: 1}",),
    "correction.delay": ("correction.bandwidth=1",),
    "cable.inclination": ("cable.chord=100 m", "cable.loads=null"),
    **{
        f"{table}.stress_strain.{key}": (f"materials={{day: {METAL}}}", f"{table}.stress_strain={CURVES}")
        for table in ("cable", "materials.day")
        for key in ("measured_at", *(f"{part}.{name}" for part in ("outer", "core") for name in OF_PART))
    },
    **{
        f"{table}{key}": (change,)
        for table, keys, change in (
            ("cases.day.ice.", ("density", "lift_slope", "drag_coefficient"), f"cases={{day: {ICE}}}"),
            ("cases.day.wind.", OF_WIND, f"cases={{day: {WIND}}}"),
            ("cases.day.loads.0.", ("at", "fraction", "force", "mass"), f"cases={{day: {LOAD}}}"),
            ("materials.day.", OF_MATERIAL, f"materials={{day: {METAL}}}"),
            ("materials.day.", ("axial_stiffness", "elastic_modulus"), "materials={day: {density: 1}}"),
            ("materials.day.", ("mass_per_length", "density"), "materials={day: {elastic_modulus: 1}}"),
            ("winch.controller.gain.auto", ("", ".gain_margin", ".sensitivity"), AUTO),
        )
        for key in keys
    },
}
VECTORS = {
    "cable.ends": "[[0, 0, 0], [{}, 0, 0]]",
    "cable.loads.0.force": "[0, 0, {}]",
    "cases.day.loads.0.force": "[0, 0, {}]",
    "cases.day.forces.end_2": "[{}, 0, 0]",
    "cases.day.moves.end_1": "[0, {}, 0]",
    "cases.day.moves.end_2": "[0, 0, {}]",
    **{
        f"{table}.stress_strain.{part}.{curve}": "[0, {}]"
        for table in ("cable", "materials.day")
        for part in ("outer", "core")
        for curve in ("initial", "creep")
    },
}


def test_every_quantity_has_a_range_whose_products_do_not_overflow():
    assert len(RANGES) == 110
    for key, quantity in RANGES.items():
        ends = [abs(end) for end in (quantity.low, quantity.high, quantity.least) if end]
        assert 1e-30 <= min(ends) <= max(ends) <= 1e30, key  # so that products of ten are finite


@pytest.mark.parametrize("key", RANGES)
def test_a_quantity_beyond_its_range_is_refused_in_one_line(key):
    low, high = RANGES[key].low, RANGES[key].high
    below = low / 10 if low > 0 else low * 10 or -1.0
    for value in (math.inf, -math.inf, math.nan, 10 * high, below, 1e308, -1e308, *((5e-324, 0.0) if low > 0 else ())):
        text = repr(value).replace("inf", ".inf").replace("nan", ".nan")
        (found,) = mistakes_of(GOOD, *BESIDE.get(key, ()), f"{key}={VECTORS.get(key, '{}').format(text)}")
        assert re.fullmatch(rf"--set {key}: (.*: )?(must (be|not be) .*|expected .* which is not finite)", found)


ALLOWED = (
    "allowed: gravity, cable, gondola, winch, wind, ground, cases, case, limits, exposure, correction, materials, model"
)
MERGED = "unknown key (keys are not merged: write them out, or put them into a file that base names)"
ANCHORED = GOOD.replace("gondola: {", "gondola: &a {").replace("wind: {", "wind: {<<: *a, ")


@pytest.mark.parametrize(
    ("text", "sets", "message"),
    [
        (GOOD, ["<<=1"], f"--set <<: {MERGED}"),
        (GOOD, ["<a=1"], f"--set <a: unknown key ({ALLOWED})"),
        (GOOD, ["cable.<<={a: 1}"], f"--set cable.<<: {MERGED}"),
        (GOOD, ["winch.controller.gain.<number>=1"],
         "--set winch.controller.gain.<number>: winch.controller.gain is 0.325, "),
        (GOOD, ["winch.controller.gain={<mapping>: 1}"], "--set winch.controller.gain: missing key: auto"),
        (GOOD + "<<: 3\n", [], f"s.yaml:15:1: <<: {MERGED}"),
        (ANCHORED, [], f"s.yaml:13:8: wind.<<: {MERGED}"),
        (GOOD.replace("  area: ", "  <x: 1\n  area: "), [], "s.yaml:7:3: cable.<x: unknown key ("),
    ],
)  # fmt: skip
def test_a_merge_key_is_an_unknown_key(text, sets, message):
    assert mistakes_of(text, *sets)[0].startswith(message)


LONG = "x" * 100_000


@pytest.mark.parametrize(
    ("text", "sets"),
    [
        *((GOOD.replace(old, new), ()) for old, new in [
            ("2.69 mm^2", LONG), ("2.69 mm^2", f"1 {LONG}"), ("area", LONG[:1000]), ("aramid", LONG),
            ("location: ground", f"location: {LONG}"), ("gravity: 9.81", f"base: {LONG}"),
            ("gravity: 9.81", f"gravity: *{LONG}"), ("gravity: 9.81", f"gravity: !{LONG} 1"),
            ("gravity: 9.81", f"'{LONG}\\n': 1"),
        ]),
        (GOOD + f"{LONG[:1000]}: 1\n{LONG[:1000]}: 1\n", ()),
        (LONG, ()),
        *((GOOD, (option,)) for option in (LONG, f"{LONG}=1", f"gravity.{LONG}=1", f"gravity={LONG}")),
    ],
)  # fmt: skip
def test_long_values_are_cut_in_messages(text, sets):
    assert all(len(line) < 1000 for line in mistakes_of(text, *sets))


def test_models_built_in_python_keep_the_same_rules():
    with pytest.raises(ValidationError, match="give exactly one of axial_stiffness, elastic_modulus, stress_strain"):
        Cable(chord=1, material="steel", area=1e-6, axial_stiffness=1e6, elastic_modulus=1e11, preload=1)
    cable = Cable(chord=1, material="steel", area=1e-6, preload=1)
    scene = CableScene(cable=cable, model=ModelTable(elements=4, order=2))
    assert scene.model.order == 2
    with pytest.raises(ValidationError, match="frozen"):
        scene.gravity = 1


def test_a_key_that_a_command_needs_is_named():
    error = missing(read_document(write("s.yaml", GOOD)), "gondola.mas", "windrms")
    assert str(error) == "s.yaml:11:10: gondola.mas: missing key: 'cablestudy windrms' needs it"


def test_a_case_is_read_without_much_work():
    # A guard against accidental slowness, far above what it takes.
    document = read_document(write("s.yaml", GOOD))

    def read(case):
        read_scene(document.with_sets([("cable.area", f"{case + 1} mm^2", "x"), ("gondola.mass", case + 1, "y")]))

    read(0)
    number, _ = calls(read, 1)
    assert number < 3_000


_SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
_SCALARS |= st.sampled_from(["1 m", "2 mm^2", "3 kg", "none", "modal", "aramid", "0 deg", "coupled", 1e308, 10**400])
_KEYS = sorted({key for _, model in TABLES for key in model.model_fields} | {"x", "vary"})
_TREES = st.recursive(
    _SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(_KEYS), inner, max_size=4),
    max_leaves=10,
)


# The fixture only changes the working directory, which every example may share.
@settings(
    max_examples=campaign(100, 15),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(key=st.sampled_from(_KEYS), table=st.sampled_from(sorted(".".join(path) for path, _ in TABLES)), value=_TREES)
def test_any_value_of_any_key_gives_a_scene_or_a_scene_error(key, table, value):
    document = read_document(write("any.yaml", GOOD))
    mistakes = [None]
    try:
        read_scene(document.with_sets([(f"{table}.{key}".strip(".").replace("*", "0"), value, "here")]))
    except SceneError as error:
        mistakes = error.mistakes
    assert mistakes
    assert all("\n" not in str(mistake) for mistake in mistakes)


def _objects(node):
    if isinstance(node, dict):
        if "properties" in node and node.get("type") == "object":
            yield node
        for value in node.values():
            yield from _objects(value)
    elif isinstance(node, list):
        for value in node:
            yield from _objects(value)


@pytest.mark.parametrize("schema", [scene_schema(), suspension_schema(), study_schema()])
def test_schemas_define_what_they_refer_to(schema):
    references = set(re.findall(r'"#/\$defs/(\w+)"', json.dumps(schema)))
    assert references
    assert references <= schema["$defs"].keys()


FILES = [*CONFIGS.rglob("*.yaml"), *Path(cablestudy.__file__).parent.glob("templates/*.yaml")]


@pytest.mark.parametrize("file", sorted(FILES), ids=lambda path: path.name)
def test_schemas_allow_the_files_of_the_project(file):
    jsonschema = pytest.importorskip("jsonschema")
    value = read_file(file).value
    is_of_suspensions = "suspensions" in file.parts or "cables" in value
    schema = study_schema() if "columns" in value else suspension_schema() if is_of_suspensions else scene_schema()
    assert list(jsonschema.Draft202012Validator(schema).iter_errors(value)) == []


@pytest.mark.parametrize("schema", [scene_schema(), study_schema()])
def test_schemas_describe_every_key_and_refuse_others(schema):
    assert json.loads(json.dumps(schema)) == schema
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    for mapping in _objects(schema):
        assert mapping["additionalProperties"] is False
        for key, value in mapping["properties"].items():
            assert value.get("description"), key


def test_the_scene_schema_knows_every_key_and_group():
    schema = scene_schema()
    for path, model in TABLES:
        mapping = schema["$defs"][model.__name__] if path else schema
        assert set(mapping["properties"]) - {"base"} == set(model.model_fields)
    cable = schema["$defs"]["Cable"]
    assert ["axial_stiffness", "elastic_modulus"] in [one["not"]["required"] for one in cable["allOf"]]
    assert "required" not in cable  # a file with a base may leave out anything
    assert schema["if"] == {"required": ["base"]}
    conditions = schema["else"]["properties"]["cable"]["allOf"]
    assert {"oneOf": [{"required": [key]} for key in ("unstretched_length", "preload", "sag", "tension")]} in conditions
    sizes = (["material"], ["area"], ["diameter"], ["axial_stiffness", "mass_per_length"])
    assert {"anyOf": [{"required": keys} for keys in sizes]} in conditions
    assert {"const": "none"} in schema["$defs"]["Controller"]["properties"]["notch"]["anyOf"]
