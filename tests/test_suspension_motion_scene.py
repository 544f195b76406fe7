"""Control, actuators, wind, exposure and correction in scenes: what is read, and every mistake in one line."""

import numpy as np
import pytest
from campaign import campaign
from command import run, study_file, written
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import mistakes_of, replaced, scene_of
from test_suspension_scene import tables_read_as_arrays

from cablestudy.scene.actuator_tables import ReactionMass, ReactionWheel, actuator_relations
from cablestudy.scene.control_tables import NotchTable
from cablestudy.scene.schema import suspension_schema

GOOD = """\
cable: {material: aramid, diameter: 5 mm, preload: 1 kN}
bodies:
  gondola:
    at: [0, 0, 0]
    mass: 50 kg
    center_of_mass: [0, 0, -0.1]
    inertia: [4, 4, 6]
    attachments: {a: [0.5, 0, 0.3], b: [-0.5, 0, 0.3]}
    markers: {focus: [0, 0, -0.5]}
    wind: {area: [0.6, 0.5 m^2, 0.4], drag_coefficient: 1.17, center_of_pressure: [0, 0, 10 cm]}
cables:
  n: {from: [0, 100, 50], to: gondola.a}
  s: {from: [0, -100, 50], to: gondola.b}
winches: {n: {}, s: {end: to}}
control:
  body: gondola
  measured: [x, z]
  gain: 0.325 rad/s
  notch: {frequency: 0.5 Hz}
  allocation: {method: least, weights: {n: 2}}
actuators:
  mass_x: {body: gondola, at: [0.1, 0, 0], axis: [1, 0, 0], mass: 2 kg, frequency: 0.1 Hz, damping_ratio: 0.3,
           velocity_gain: 300 N s/m, position_gain: 1 N/mm, high_pass: 0.05 Hz, stroke: 50 mm, force: 100 N}
  wheel_z: {body: gondola, axis: [0, 0, 2], inertia: 500 kg cm^2, rate_gain: 20 N m s/rad, momentum: 5 N m s,
            torque: 2 N m}
correction: {marker: gondola.focus, bandwidth: 20 Hz, delay: 1 ms}
exposure: 1 ms
wind: {speed: 6 m/s, direction: 90 deg, turbulence_intensity: [0.15, 0.12, 8 %], length_scale: 25 m, on: cables}
"""
BARE = GOOD[: GOOD.index("winches")]
ONE_CABLE = "cable: {chord: 185.8 m, material: aramid, area: 2.69 mm^2, preload: 1344.75}\n"


pytestmark = pytest.mark.usefixtures("folder")  # so that names in messages are short


def changed(*pairs):
    return replaced(GOOD, *pairs)


# -------------------------------------------------------------------------------------------------------- what is read


def test_all_tables_are_read_into_si():
    scene = scene_of(GOOD)
    control, mass, wheel = scene.control, scene.actuators["mass_x"], scene.actuators["wheel_z"]
    assert (control.body, control.measured, control.gain) == ("gondola", ("x", "z"), 0.325)
    assert (control.notch.frequency, control.notch.damping_ratio) == (0.5, 0.05)
    assert (control.allocation.method, control.allocation.weights) == ("least", {"n": 2})
    assert mass == ReactionMass(
        body="gondola", at=(0.1, 0, 0), axis=(1, 0, 0), mass=2, frequency=0.1, damping_ratio=0.3, velocity_gain=300,
        position_gain=1000, high_pass=0.05, stroke=0.05, force=100,
    )  # fmt: skip
    assert wheel == ReactionWheel(body="gondola", axis=(0, 0, 2), inertia=0.05, rate_gain=20, momentum=5, torque=2)
    correction = scene.correction
    assert (correction.marker, correction.bandwidth, correction.delay, scene.exposure) == (
        "gondola.focus", 20, 1e-3, 1e-3,
    )  # fmt: skip
    wind, seen = scene.wind, scene.bodies["gondola"].wind
    assert (wind.speed, wind.length_scale, wind.on) == (6, 25, "cables")
    assert wind.direction == pytest.approx(np.pi / 2)
    assert wind.turbulence == pytest.approx((0.9, 0.72, 0.48))  # times 6 m/s
    assert (seen.areas, seen.drag_coefficient, seen.center_of_pressure) == ((0.6, 0.5, 0.4), 1.17, (0, 0, 0.1))


def test_what_is_not_written_has_a_default():
    bare = scene_of(BARE)
    assert (bare.control, bare.actuators, bare.wind, bare.exposure, bare.correction) == (None, {}, None, None, None)
    scene = scene_of(
        BARE
        + """\
winches: {n: {}}
control: {gain: 0.1}
actuators:
  m: {axis: [1, 1, 0], mass: 1, frequency: 1, stroke: 1, force: 1}
  w: {axis: [1, 1, 0], inertia: 1, momentum: 1, torque: 1}
wind: {speed: 6, turbulence_rms: 0.5, length_scale: 25}
correction: {marker: gondola.focus, bandwidth: 1}
"""
    )
    control, mass, wheel, wind = scene.control, scene.actuators["m"], scene.actuators["w"], scene.wind
    assert (control.body, control.measured, control.notch, control.allocation) == (None, None, NotchTable(), None)
    assert [scene.body_of(part) for part in (control, mass, wheel)] == ["gondola"] * 3
    assert (mass.at, mass.damping_ratio, mass.velocity_gain, mass.position_gain) == ((0, 0, 0), 0.5, 0, 0)
    assert (wheel.rate_gain, wheel.high_pass, mass.high_pass, scene.correction.delay) == (0, None, None, 0)
    assert (wind.direction, wind.coherence_decay, wind.duration, wind.on) == (0, 10, 600, "both")
    assert (wind.air_density, wind.spectrum, wind.admittance) == (1.2, "von_karman", "vickery")
    assert (wind.cable_drag_coefficient, wind.mean, wind.aerodynamic_damping) == (1.2, True, True)
    assert wind.turbulence == (0.5, 0, 0)


@pytest.mark.parametrize(
    ("written", "turbulence"),
    [
        ("turbulence_intensity=0.1", (0.6, 0, 0)),
        ("turbulence_intensity=[0.1, 0, 5 %]", (0.6, 0, 0.3)),
        ("turbulence_rms=0.9 m/s", (0.9, 0, 0)),
        ("turbulence_rms=[0.9 m/s, 0.7, 0]", (0.9, 0.7, 0)),
    ],
)
def test_the_turbulence_has_three_components(written, turbulence):
    assert scene_of(GOOD, f"wind.{written}").wind.turbulence == pytest.approx(turbulence)


def test_one_area_is_seen_from_all_sides():
    assert scene_of(GOOD, "bodies.gondola.wind.area=0.6 m^2").bodies["gondola"].wind.areas == (0.6, 0.6, 0.6)


@pytest.mark.parametrize(
    ("text", "gain"), [(GOOD, "control.gain"), (ONE_CABLE + "gondola: {mass: 5}\n", "winch.controller.gain")]
)
@pytest.mark.parametrize("auto", ["6 dB", "{gain_margin: 6 dB}", "{gain_margin: 6 dB, sensitivity: 2}"])
def test_an_automatic_gain_has_two_forms(text, gain, auto):
    scene = scene_of(text, f"{gain}={{auto: {auto}}}")
    assert scene.value_at((*gain.split("."), "auto", "gain_margin")) == 6
    assert scene.value_at((*gain.split("."), "auto", "sensitivity")) == 2


def test_the_notch_can_be_switched_off():
    assert scene_of(GOOD, "control.notch=none").control.notch is None


def test_one_cable_has_exposure_correction_and_what_the_mean_wind_does():
    wind = "wind: {speed: 6, turbulence_intensity: 0.15, length_scale: 25"
    bare = scene_of(ONE_CABLE + wind + "}\n")
    assert (bare.wind.duration, bare.wind.mean, bare.wind.aerodynamic_damping) == (600, True, True)
    assert (bare.exposure, bare.correction) == (None, None)
    more = ", duration: 10 min, mean: false, aerodynamic_damping: false}\nexposure: 5 ms\ncorrection: {bandwidth: 20}\n"
    scene = scene_of(ONE_CABLE + wind + more)
    assert (scene.wind.duration, scene.wind.mean, scene.wind.aerodynamic_damping) == (600, False, False)
    assert (scene.exposure, scene.correction.bandwidth, scene.correction.delay) == (0.005, 20, 0)
    (line,) = mistakes_of(ONE_CABLE, "correction={marker: a.b, bandwidth: 1}")
    assert line == "--set correction: correction.marker: unknown key (allowed: bandwidth, delay)"


@pytest.mark.parametrize(
    "vary",
    [
        "{control.gain: [0.1, 0.2], control.notch.frequency: [1, 2], control.allocation.weights.n: [2, 3]}",
        "{wind.speed: [6, 7], wind.direction: [0, 45 deg], wind.turbulence_intensity.1: [0.1, 0.2]}",
        "{wind.turbulence_rms: [0.5, 0.6], bodies.gondola.wind.area.0: [1, 2], correction.delay: [0, 1 ms]}",
        "{actuators.mass_x.mass: [1, 60 kg], actuators.mass_x.at.0: [0, 1 m], actuators.wheel_z.axis.2: [1, 2]}",
        "{actuators.wheel_z.inertia: [1, 7], exposure: [1 ms, 2 ms], bodies.gondola.mass: [50, 60]}",
        "{actuators.mass_x.at.2: [0, 10 m], actuators.wheel_z.axis.2: [1, 0]}",
    ],
)
def test_cases_read_as_arrays_are_those_read_one_by_one(vary):
    text = f"vary: [{vary}, {{cables.n.preload: [1 kN, 2 kN]}}]\ncolumns: [n.preload]\n"
    assert tables_read_as_arrays(study_file("", text, base=written(GOOD))) == 1


# ------------------------------------------------------------------------------------------------------------- mistakes

SECOND = ("cables:\n", "  box: {at: [0, 0, -5], mass: 3, free: [], wind: {area: 1, drag_coefficient: 1}}\ncables:\n")
NO_SUCH = "unknown body (allowed: gondola)"
PARTS = "of which they are a part"
MORE = f"with it the actuators of gondola have more inertia than gondola itself, {PARTS}"
HORIZONTAL = "the mean wind is horizontal, and its direction an angle from x towards y"
# what is changed in the file, and the lines that say what is wrong with it
MISTAKES = {
    "no stroke": ([(" stroke: 50 mm,", "")],
        "22:11: actuators.mass_x: missing key: stroke (an actuator without limits)"),
    "no limits of a wheel": ([(", momentum: 5 N m s,\n            torque: 2 N m", "")],
        ["24:12: actuators.wheel_z: missing key: momentum (an actuator without limits)",
         "24:12: actuators.wheel_z: missing key: torque (an actuator without limits)"]),
    "neither mass nor wheel": ([(" inertia: 500 kg cm^2,", "")],
        "24:12: actuators.wheel_z: missing key: one of mass (a reaction mass), inertia (a reaction wheel)"),
    "mass and wheel": ([("mass: 2 kg", "mass: 2 kg, inertia: 3")],
        "22:11: actuators.mass_x: mass is given together with inertia: a reaction mass has mass, a reaction wheel "
        "inertia"),
    "a number for an actuator": ([("correction", "  m: 3\ncorrection")],
        "26:6: actuators.m: expected a mapping with the key mass or inertia, got 3"),
    "a key of the other kind": ([("rate_gain", "stroke")],
        ["24:67: actuators.wheel_z.stroke: unknown key (allowed: body, axis, high_pass, inertia, rate_gain, momentum, "
         "torque)"]),
    "an actuator named as a body": ([("mass_x:", "gondola:")],
        "22:3: actuators.gondola: a name must be unique, and there is a body of this name"),
    "an actuator on an unknown body": ([("mass_x: {body: gondola", "mass_x: {body: box")],
        f"22:18: actuators.mass_x.body: {NO_SUCH}"),
    "an axis without direction": ([("axis: [0, 0, 2]", "axis: [0, 0, 0]")],
        "24:34: actuators.wheel_z.axis: the axis has no direction: all zero"),
    "a mass above that of its body": ([("mass: 2 kg", "mass: 50 kg")],
        f"22:67: actuators.mass_x.mass: the reaction masses of gondola together have its mass or more, {PARTS}"),
    "a mass far from its body": ([("at: [0.1, 0, 0]", "at: [0, 3 m, 0]")],
        f"22:11: actuators.mass_x: {MORE}"),
    "a wheel above its body": ([("500 kg cm^2", "6")],
        f"24:12: actuators.wheel_z: {MORE}"),
    "a wheel on a body without inertia": ([("    inertia: [4, 4, 6]\n", "    free: [x, z]\n")],
        "4:5: bodies.gondola: missing key: inertia (that of the wheel wheel_z is a part of it)"),
    "control without winches": ([("winches: {n: {}, s: {end: to}}\n", "")],
        "15:3: control: needs a winch: the cables that are reeled are listed under winches"),
    "weights of cables without a winch": (
        [("winches: {n: {}, s: {end: to}}", "winches: {n: {}}"), ("weights: {n: 2}", "weights: {s: 2, q: 3}")],
        ["20:41: control.allocation.weights.s: no winch reels this cable (allowed: n)",
         "20:47: control.allocation.weights.q: unknown cable (allowed: n)"],
    ),
    "a weight of zero": ([("{n: 2}", "{n: 0}")], "20:44: control.allocation.weights.n: must be positive, got 0"),
    "a winch on no cable": ([("s: {end: to}}", "q: {}}")], "14:18: winches.q: unknown cable (allowed: n, s)"),
    "a measured motion that is held": ([("mass: 50 kg", "mass: 50 kg\n    free: [x, y, roll]")],
        "18:17: control.measured.1: z of gondola is held (free: x, y, roll)"),
    "nothing measured": ([("[x, z]", "[]")], "17:13: control.measured: expected at least 1 item, got 0"),
    "a motion measured twice": ([("[x, z]", "[x, z, x]")], "17:13: control.measured: x is given twice"),
    "an unknown motion": ([("[x, z]", "[x, rz]")], '17:17: control.measured.1: got "rz" (did you mean z?)'),
    "control of an unknown body": ([("  body: gondola", "  body: gondol")],
                                   "16:9: control.body: unknown body (did you mean gondola?)"),
    "one of two bodies": ([("  body: gondola\n", ""), SECOND],
        "17:3: control: missing key: body (the suspension has 2 bodies: gondola, box)"),
    "control of a body that is held": ([("body: gondola\n  measured: [x, z]", "body: box"), SECOND],
        "17:3: control: box is held, so that there is nothing to measure"),
    "no gain": ([("  gain: 0.325 rad/s\n", "")], "16:3: control: missing key: gain"),
    "a word for the gain": ([("0.325 rad/s", "auto")],
        '18:9: control.gain: expected an angular rate in rad/s (a number, or text such as "0.325 rad/s"), got "auto"'),
    "a margin of zero": ([("0.325 rad/s", "{auto: 0 dB}")],
        '18:16: control.gain.auto: must be positive, got "0 dB"'),
    "an unknown notch": ([("{frequency: 0.5 Hz}", "{frequenzy: 0.5 Hz}")],
                         "19:11: control.notch.frequenzy: unknown key (did you mean frequency?)"),
    "a bandwidth of zero": ([("20 Hz", "0 Hz")], '26:48: correction.bandwidth: must be positive, got "0 Hz"'),
    "an unknown marker": ([("gondola.focus", "gondola.fokus")],
        '26:22: correction.marker: unknown marker "gondola.fokus" (did you mean gondola.focus?)'),
    "no markers": ([("    markers: {focus: [0, 0, -0.5]}\n", "")],
        '25:22: correction.marker: unknown marker "gondola.focus" (no body has markers)'),
    "no exposure": ([("exposure: 1 ms", "exposure: 0")], "27:11: exposure: must be positive, got 0"),
    "a wind from below ground": ([("90 deg", "[1, 0, 0.2]")],
        f"28:33: wind.direction: a wind from below ground: {HORIZONTAL}"),
    "a vector for the direction": ([("90 deg", "[1, 0, 0]")],
        f"28:33: wind.direction: got a list: {HORIZONTAL}"),
    "two turbulences": ([("direction: 90 deg", "turbulence_rms: 3")],
        "28:22: wind.turbulence_rms: given together with turbulence_intensity: give exactly one of "
        "turbulence_intensity, turbulence_rms"),
    "two components": ([("[0.15, 0.12, 8 %]", "[0.15, 0.12]")],
        "28:63: wind.turbulence_intensity: expected 3 components, got 2"),
    "a mapping for the turbulence": ([("[0.15, 0.12, 8 %]", "{x: 3}")],
        "28:63: wind.turbulence_intensity: expected one number, or [along, across, vertical], got a mapping"),
    "a key of the wind on one cable": ([("direction: 90 deg", "coherence_length: 3 m")],
        "28:22: wind.coherence_length: unknown key (did you mean coherence_decay?)"),
    "a wind on bodies that offer nothing": (
        [("on: cables", "on: bodies"),
         ("    wind: {area: [0.6, 0.5 m^2, 0.4], drag_coefficient: 1.17, center_of_pressure: [0, 0, 10 cm]}\n", "")],
        "27:106: wind.on: bodies: no body has the key wind (area, drag_coefficient), so that there is nothing "
        "to act on",
    ),
    "a body without drag coefficient": ([(" drag_coefficient: 1.17,", "")],
        "10:11: bodies.gondola.wind: missing key: drag_coefficient"),
}  # fmt: skip


@pytest.mark.parametrize("what", MISTAKES)
def test_each_mistake_is_one_line_at_its_place(what):
    changes, lines = MISTAKES[what]
    lines = [lines] if isinstance(lines, str) else lines
    assert mistakes_of(changed(*changes)) == [f"s.yaml:{line}" for line in lines]


def test_validate_takes_the_tables_and_reports_their_mistakes():
    assert "ok" in run("validate", written(GOOD)).out
    (line,) = run("validate", written(changed(("20 Hz", "0"))), code=2).lines
    assert line == "scene.yaml:26:48: correction.bandwidth: must be positive, got 0"


def _point(mass, place):
    """Tensor of inertia of a point mass."""
    return mass * (np.dot(place, place) * np.eye(3) - np.outer(place, place))


@settings(max_examples=campaign(60, 20), deadline=None)
@given(
    st.lists(st.floats(-1, 1), min_size=12, max_size=12),
    st.floats(0.1, 10),
    st.floats(0.01, 10),
    st.floats(0.01, 10),
    st.sampled_from([1e-3, -1e-3]),
)
def test_actuators_are_a_part_of_their_body_where_what_remains_has_inertia(numbers, mass, wheel, rest, least):
    # a body put together from what remains, with its own center of mass at a place, a reaction mass and a wheel
    center, place, axis, turn = np.array(numbers).reshape(4, 3)
    axis = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 0.1 else np.array([0.6, 0, 0.8])
    turn = np.linalg.qr(np.eye(3) + np.outer(turn, [1, 2, 3]))[0]
    tensor = turn @ np.diag([5.0, 6.0, least]) @ turn.T
    whole = (mass * place + rest * center) / (mass + rest)
    tensor = tensor + _point(rest, center - whole) + _point(mass, place - whole) + wheel * np.outer(axis, axis)
    scene = scene_of(GOOD)
    body = scene.bodies["gondola"].model_copy(
        update={
            "mass": mass + rest,
            "center_of_mass": tuple(whole),
            "inertia": tuple(tensor[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))),
        }
    )
    actuators = {
        "m": scene.actuators["mass_x"].model_copy(update={"at": tuple(place), "mass": mass}),
        "w": scene.actuators["wheel_z"].model_copy(update={"axis": tuple(3 * axis), "inertia": wheel}),
    }
    scene = scene.model_copy(update={"bodies": {"gondola": body}, "actuators": actuators})
    assert all(holds for _, holds, _ in actuator_relations(scene)) == (least > 0)


def test_the_schema_knows_both_kinds_of_actuators_and_what_a_complete_file_needs():
    schema = suspension_schema()
    definitions, whole = schema["$defs"], schema["else"]["properties"]
    kinds = [kind["$ref"] for kind in schema["properties"]["actuators"]["additionalProperties"]["anyOf"]]
    assert kinds == ["#/$defs/ReactionMass", "#/$defs/ReactionWheel"]
    assert set(definitions["ReactionWheel"]["properties"]) == set(ReactionWheel.model_fields)
    assert definitions["ReactionWheel"]["additionalProperties"] is False
    assert {"const": "none"} in definitions["Control"]["properties"]["notch"]["anyOf"]
    assert whole["actuators"]["additionalProperties"]["anyOf"] == [
        {"required": ["axis", "mass", "frequency", "stroke", "force"]},
        {"required": ["axis", "inertia", "momentum", "torque"]},
    ]
    assert whole["wind"]["required"] == ["speed", "length_scale"]
    assert whole["bodies"]["additionalProperties"]["properties"]["wind"]["required"] == ["area", "drag_coefficient"]
    assert "required" not in definitions["SuspensionWind"]  # a file with a base may leave out anything
