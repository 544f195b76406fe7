"""Scenes of suspensions: what is read, what cables share, and every mistake in one line at its place."""

import copy
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from campaign import campaign
from command import LONGEST, calls, run, study_file, written
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import mistakes_of, replaced, scene_of
from scipy.spatial.transform import Rotation
from suspension_cases import SUSPENSIONS

from cablestudy.errors import SceneError
from cablestudy.scene.document import read_document
from cablestudy.scene.scene import load_scene, quantity_of, read_scene
from cablestudy.scene.schema import suspension_schema
from cablestudy.scene.study import read_study
from cablestudy.scene.suspension import SUSPENSION_TABLES
from cablestudy.statics.suspension import CORES
from cablestudy.study.case_table import tables_of
from cablestudy.study.prepare import check_cases
from cablestudy.study.suspension.numbers import distribution_of, numbers_of

FILES = [path for path in sorted(SUSPENSIONS.glob("*.yaml")) if "\nvary:" not in path.read_text(encoding="utf-8")]
GOOD = """\
cable: {material: aramid, diameter: 5 mm}
points:
  north: [0, 100 m, 50]
  south: [0, -100, 50]
  knot: {at: [0, 0, 40], free: true, mass: 2 kg, force: [0, 0, 100 N]}
bodies:
  gondola:
    at: [0, 0, 10]
    mass: 50
    inertia: [4, 4, 6]
    attachments: {a: [0.5, 0, 0.3], b: [-0.5, 0, 0.3]}
cables:
  n: {from: north, to: knot, preload: 1000}
  s: {from: south, to: knot, tension_to: 1 kN}
  v: {from: knot, to: gondola.a, unstretched_length: 29}
  w: {from: [30, 0, 50], to: gondola.b, sag: 20 cm}
"""
FORCED = "cases: {pushed: {forces: {knot: [1, 2, 3]}}}\n"
STATED = "unstretched_length, preload, sag, tension_to, tension"


pytestmark = pytest.mark.usefixtures("folder")  # so that names in messages are short


@pytest.mark.parametrize("path", [("points", "north"), ("points", "knot"), ("cases", "pushed", "forces", "knot")])
def test_a_component_of_a_vector_is_replaced_whether_it_stands_alone_or_in_a_mapping(path):
    scene = scene_of(GOOD + FORCED)
    component = (*path, "1")
    changed_scene = scene.with_value(component, 7.0)
    assert changed_scene.value_at(component) == 7.0
    assert scene.value_at(component) != 7.0
    for index in "02":
        assert changed_scene.value_at((*path, index)) == scene.value_at((*path, index))


def changed(*pairs):
    return replaced(GOOD, *pairs)


def study_on_good(text):
    """A study upon the scene GOOD; its name."""
    return study_file("", text, base=written(GOOD, "s.yaml"))


# -------------------------------------------------------------------------------------------------------- what is read


def test_a_suspension_is_read_into_si():
    scene = scene_of(GOOD)
    assert scene.gravity == 9.81
    assert (scene.points["north"].at, scene.points["north"].free) == ((0, 100, 50), False)
    knot, gondola = scene.points["knot"], scene.bodies["gondola"]
    assert (knot.at, knot.free, knot.mass, knot.force) == ((0, 0, 40), True, 2, (0, 0, 100))
    assert (gondola.at, gondola.mass, gondola.inertia) == ((0, 0, 10), 50, (4, 4, 6))
    assert gondola.free == ("x", "y", "z", "roll", "pitch", "yaw")
    assert (gondola.attitude, gondola.center_of_mass) == ((0, 0, 0), (0, 0, 0))
    assert (gondola.force, gondola.moment, gondola.markers) == ((0, 0, 0), (0, 0, 0), {})
    assert [cable.stated for cable in scene.cables.values()] == ["preload", "tension_to", "unstretched_length", "sag"]
    assert scene.cables["s"].tension_to == 1000
    assert scene.cables["w"].ends == ((30, 0, 50), "gondola.b")
    assert (scene.solve_for, scene.tensions, scene.winches) == ("pose", None, {})
    assert scene.model.accuracy == 1e-4


def test_a_held_body_may_have_no_cable():
    text = replaced(GOOD, ("gondola:\n", "gondola:\n    free: []\n"), (GOOD[GOOD.index("  v:") :], ""))
    assert scene_of(text).bodies["gondola"].free == ()


def test_optional_keys_are_read_into_si():
    scene = scene_of(
        changed(
            ("mass: 50", "mass: 0.05 tonne\n    attitude: [10 deg, 0, -0.5]\n    center_of_mass: [0, 0, -10 cm]"),
            ("[4, 4, 6]", "[4, 4, 6 kg m^2, 0.5, 0, 10000 kg cm^2]\n    markers: {focus: [0, 0, -50 cm]}"),
            ("cables:", "winches: {n: {}, v: {end: to}}\ncables:"),
            ("  gondola:", "  gondola:\n    free: [z, yaw]\n    force: [0, 0, 1 kN]\n    moment: [0, 0, 2 N m]"),
        )
    )
    gondola = scene.bodies["gondola"]
    assert gondola.mass == 50
    assert gondola.attitude == (pytest.approx(math.pi / 18), 0, -0.5)
    assert (gondola.center_of_mass, gondola.markers) == ((0, 0, -0.1), {"focus": (0, 0, -0.5)})
    assert gondola.inertia == (4, 4, 6, 0.5, 0, 1)
    assert (gondola.free, gondola.force, gondola.moment) == (("z", "yaw"), (0, 0, 1000), (0, 0, 2))
    assert {name: winch.end for name, winch in scene.winches.items()} == {"n": "from", "v": "to"}


# what --set changes, and what then differs in the cables n and v from the file
@pytest.mark.parametrize(
    ("sets", "n", "v"),
    [
        ((), {}, {}),
        (("cable.diameter=1 mm",), {"diameter": 1e-3}, {"diameter": 1e-3}),
        (("cable.area=1e-6",), {"area": 1e-6, "diameter": None}, {"area": 1e-6, "diameter": None}),
        (("cables.n.area=1e-6",), {"area": 1e-6, "diameter": None}, {}),
        (("cables.n.material=steel",), {"elastic_modulus": 205e9, "density": 7850}, {}),
        (("cable.elastic_modulus=50 GPa",), {"elastic_modulus": 50e9}, {"elastic_modulus": 50e9}),
        (("cables.n.sag=1",), {"stated": "sag"}, {}),
        (("cables.v.tension_to=5",), {}, {"stated": "tension_to"}),
        (("cable.preload=5",), {}, {}),
        (("cable.damping.loss_factor=0.02",), {"model": "hysteretic"}, {"model": "hysteretic"}),
        (("cables.v.damping={time: 1 ms}",), {}, {"model": "kelvin_voigt"}),
    ],
)
def test_a_cable_has_what_all_share_and_its_own_keys_over_it(sets, n, v):
    unchanged = {"elastic_modulus": 70.5e9, "density": 1440, "diameter": 0.005, "area": None, "model": "modal"}
    cables = scene_of(GOOD, *sets).cables
    for name, stated, changes in (("n", "preload", n), ("v", "unstretched_length", v)):
        cable = cables[name]
        found = {"model": cable.damping.model} | {key: getattr(cable, key) for key in unchanged if key != "model"}
        assert found | {"stated": cable.stated} == {**unchanged, "stated": stated} | changes


def test_what_a_cable_states_itself_stays_when_the_shared_key_is_set():
    scene = scene_of(
        changed(("preload: 1000", "preload: 1000, diameter: 7 mm")), "cable.diameter=1 mm", "cable.preload=5"
    )
    assert [scene.cables[name].diameter for name in "nsvw"] == [0.007, 0.001, 0.001, 0.001]
    assert [scene.cables[name].stated for name in "nsvw"] == ["preload", "tension_to", "unstretched_length", "sag"]
    shared = scene_of(changed((", preload: 1000", ""), ("diameter: 5 mm", "diameter: 5 mm, preload: 3 N")))
    assert (shared.cables["n"].preload, shared.cables["s"].preload, shared.cables["s"].tension_to) == (3, None, 1000)


def test_null_in_a_cable_removes_what_all_cables_share():
    text = changed(
        ("preload: 1000", "preload: 1000, expansion: null, damping: {viscous: null}"),
        ("diameter: 5 mm", "diameter: 5 mm, expansion: 2e-5, strength: 3 GPa, damping: {viscous: 2}"),
    )
    scene = scene_of(text, "cables.v.strength=null", "cable.expansion=3e-5", "cable.strength=4 GPa")
    n, s, v = (scene.cables[name] for name in "nsv")
    assert [cable.expansion for cable in (n, s, v)] == [scene_of(GOOD).cables["n"].expansion, 3e-5, 3e-5]
    assert [cable.strength for cable in (n, s, v)] == [4e9, 4e9, scene_of(GOOD).cables["v"].strength]
    assert [cable.damping.viscous for cable in (n, s, v)] == [0, 2, 2]
    n = scene_of(text, "cables.n.expansion=4e-5", "cables.n.damping.viscous=1").cables["n"]
    assert (n.expansion, n.damping.viscous) == (4e-5, 1)


def test_a_file_upon_a_base_replaces_alternatives_of_its_cables_and_removes_them():
    written(GOOD, "base.yaml")
    scene = scene_of("base: base.yaml\ncables: {n: {sag: 1 m}, w: null}\npoints: {south: {at: [0, -90, 50]}}\n")
    assert list(scene.cables) == ["n", "s", "v"]
    assert (scene.cables["n"].stated, scene.cables["n"].to) == ("sag", "knot")
    assert scene.points["south"].at == (0, -90, 50)


UNITS = {
    "m": ("cables.n1.diameter", "cable.diameter", "bodies.gondola.attachments.a.0", "bodies.gondola.markers.focus",
          "points.north", "points.north.2", "points.knot.at.1"),
    "N": ("cable.tension_to", "points.knot.force.1", "tensions.max"),
    "s": ("cables.n1.damping.time", "exposure"), "N/m": ("cables.n1.force_density",),
    "kg": ("bodies.gondola.mass", "actuators.mass_x.mass"), "N m": ("bodies.gondola.moment",),
    "kg m^2": ("bodies.gondola.inertia.5", "actuators.wheel_z.inertia"), "m^2": ("bodies.gondola.wind.area.1",),
    "rad": ("bodies.gondola.attitude.2", "wind.direction"), "rad/s": ("control.gain",), "dB": ("control.gain.auto",),
    "m/s^2": ("gravity",), "m/s": ("wind.speed", "wind.turbulence_rms"), "N s/m": ("actuators.mass_x.velocity_gain",),
    "Hz": ("control.notch.frequency", "correction.bandwidth"), "N m s/rad": ("actuators.wheel_z.rate_gain",),
    "N m s": ("actuators.wheel_z.momentum",),
    "": ("actuators.wheel_z.axis.1", "bodies.gondola.wind.drag_coefficient", "wind.turbulence_intensity.2"),
    None: ("control.measured", "cables.n1", "cables.n1.from", "solve_for"),
}  # fmt: skip


def test_keys_by_path_have_a_unit():
    for unit, keys in UNITS.items():
        for key in keys:
            quantity = quantity_of(key)
            assert (quantity and quantity.unit) == unit, key


def test_a_study_varies_keys_by_path():
    study = read_study(
        study_on_good(
            """\
vary:
  - {points.north.2: [50 m, 60 m], "points.south": [[0, -100, 50], [0, -90, 60]]}
  - {cables.n.preload: [1 kN, 2 kN], bodies.gondola.mass: [50, 60]}
  - {cable.diameter: [5 mm, 6 mm]}
columns: [preload]
"""
        )
    )
    check_cases(study)
    scenes = [scene for _, scene in study.cases()]
    assert [scene.points["north"].at[2] for scene in scenes] == [50] * 4 + [60] * 4
    assert [scene.points["south"].at[1] for scene in scenes] == [-100] * 4 + [-90] * 4
    assert [scene.cables["n"].preload for scene in scenes] == [1000, 1000, 2000, 2000] * 2
    assert [scene.bodies["gondola"].mass for scene in scenes] == [50, 50, 60, 60] * 2
    assert [scene.cables["w"].diameter for scene in scenes] == [0.005, 0.006] * 4
    numbers = numbers_of(scenes)
    assert numbers.shape == (8,)
    np.testing.assert_array_equal(numbers.attachment[:, 0, 0, 2], [50] * 4 + [60] * 4)
    np.testing.assert_array_equal(numbers.value[:, 0], [1000, 1000, 2000, 2000] * 2)


# ------------------------------------------------------------------------------------------------------------- mistakes

END, TO_A = "to: gondola.a", "to: gondola.a,"
INERTIA = "    inertia: [4, 4, 6]\n"
SILENT = ((", preload: 1000", ""), (", tension_to: 1 kN", ""))
NO_MASS = "no mass has this tensor: its principal moments must be positive, and none above the sum of the other two"
DOT = "a name must not contain a dot: BODY.ATTACHMENT is an end, and columns are named NAME.COLUMN"
ATTACHMENTS = "give it some, bodies.gondola.attachments: {NAME: [x, y, z]}"
ONE_CABLE = "unknown key in a suspension"
# what is changed in the file, and the lines that say what is wrong with it
MISTAKES = {
    "unknown end": ([(END, "to: gondla.a")], '15:23: cables.v.to: unknown end "gondla.a" (did you mean gondola.a?)'),
    "unknown point": ([("from: south", "from: west")],
        '14:13: cables.s.from: unknown end "west" (allowed: north, south, knot, gondola.a, gondola.b)'),
    "a misspelt table, which other tables refer to": ([("bodies:", "bodys:")],
        "6:1: bodys: unknown key (did you mean bodies?)"),
    "a misspelt table beside the right one": ([("bodies:", "bodys: {}\nbodies:"), (END, "to: gondla.a")],
        ["6:1: bodys: unknown key (did you mean bodies?)",
         '16:23: cables.v.to: unknown end "gondla.a" (did you mean gondola.a?)']),
    "no such attachment": ([(END, "to: gondola.c")],
        '15:23: cables.v.to: gondola has no attachment "c" (allowed: a, b)'),
    "a body without attachment": ([(END, "to: gondola")],
        "15:23: cables.v.to: gondola is a body: a cable ends at one of its attachments (gondola.a, gondola.b)"),
    "bodies without any attachment": ([("    attachments: {a: [0.5, 0, 0.3], b: [-0.5, 0, 0.3]}\n", "")],
        ["14:23: cables.v.to: gondola is a body without attachments: " + ATTACHMENTS,
         "15:30: cables.w.to: gondola is a body without attachments: " + ATTACHMENTS]),
    "an attachment of a point": ([(END, "to: knot.a")],
        "15:23: cables.v.to: knot is a point, which has no attachments"),
    "a place of two numbers": ([(END, "to: [1, 2]")], "15:23: cables.v.to: expected 3 components, got 2"),
    "a place with a word": ([(END, "to: [1, 2, up]")],
        '15:30: cables.v.to.2: expected a length in m (a number, or text such as "1.85 mm"), got "up"'),
    "a number for an end": ([(END, "to: 3")],
        "15:23: cables.v.to: expected a point, BODY.ATTACHMENT, or a place [x, y, z], got 3"),
    "no end": ([(f" {TO_A}", "")], "15:6: cables.v: missing key: to"),
    "both ends alike": ([("from: knot, to: gondola.a", "from: gondola.a, to: gondola.a")],
        "15:28: cables.v.to: both ends are at gondola.a"),
    "a cable of zero length": ([("at: [0, 0, 40]", "at: [0, 100, 50]")],
        "13:6: cables.n: its two ends are at one place, [0, 100, 50]"),
    "a cable from a body to itself at one place": ([("{a: [0.5, 0, 0.3]", "{a: [-0.5, 0, 0.3]"),
         ("from: knot, to: gondola.a", "from: gondola.b, to: gondola.a")],
        "15:6: cables.v: its two ends are at one place, [-0.5, 0, 10.3]"),
    "fixed ends at one place": ([("sag: 20 cm}", "sag: 1}\n  z: {from: [0, 100, 50], to: north, sag: 1}")],
        "17:6: cables.z: its two ends are at one place, [0, 100, 50]"),
    "a length far off": ([("sag: 20 cm}", "sag: 1}\n  z: {from: south, to: north, unstretched_length: 200 mm}")],
        "17:51: cables.z.unstretched_length: 0.2 m is 0.001 times the distance of the ends, 200 m (allowed: 0.2 to 200 "
        "times; did you mean 200 m?)"),
    "no inertia": ([(INERTIA, "")],
        "8:5: bodies.gondola: missing key: inertia (the body is free to turn: roll, pitch, yaw)"),
    "beyond the triangle inequality": ([("[4, 4, 6]", "[4, 4, 8.1]")], f"10:14: bodies.gondola.inertia: {NO_MASS}"),
    "off the diagonal": ([("[4, 4, 6]", "[4, 4, 6, 0, 3.5, 0]")], f"10:14: bodies.gondola.inertia: {NO_MASS}"),
    "a rod without thickness": ([("[4, 4, 6]", "[0.5, 0.5, 1, -0.5, 0, 0]")],
        f"10:14: bodies.gondola.inertia: {NO_MASS}"),
    "a negative moment": ([("[4, 4, 6]", "[4, -4, 6]")],
        "10:18: bodies.gondola.inertia.1: yy must be positive, got -4"),
    "four moments": ([("[4, 4, 6]", "[4, 4, 6, 0]")],
        "10:14: bodies.gondola.inertia: expected 3 entries (xx yy zz) or 6 (xx yy zz xy xz yz), got 4"),
    "no cable at a point": ([("  knot:", "  lonely: {at: [0, 0, 0], free: true}\n  knot:")],
        "5:11: points.lonely: nothing holds it: no cable ends at it"),
    "no cable at a body": ([("to: gondola.b", "to: knot"), (END, "to: north")],
        "8:5: bodies.gondola: nothing holds it: no cable ends at it"),
    "cables to nothing fixed": ([("from: [30, 0, 50]", "from: knot"), ("{from: north", "{from: [1, 1, 1]"),
         ("to: knot", "to: south"), ("to: knot", "to: north")],
        ["5:9: points.knot: nothing holds it: its cables lead to nothing that is fixed (only to gondola)",
         "8:5: bodies.gondola: nothing holds it: its cables lead to nothing that is fixed (only to knot)"]),
    "a dot in a name": ([("  south:", "  so.uth:"), ("from: south", "from: so.uth")], f"4:3: points.so.uth: {DOT}"),
    "a digit first": ([("  south:", "  2nd:"), ("from: south", "from: 2nd")],
        '4:3: points.2nd: a name begins with a letter and consists of letters, digits, _ and -, got "2nd"'),
    "a sign first": ([("  south:", '  "-1":'), ("from: south", 'from: "-1"')],
        '4:3: points.-1: a name begins with a letter and consists of letters, digits, _ and -, got "-1"'),
    "an attachment without a name": ([("b: [-0.5", '"": [-0.5'), ("gondola.b", "gondola.a")],
        '11:37: bodies.gondola.attachments.: a name has at least one character, got ""'),
    "a dot in an attachment": ([("b: [-0.5", "b.c: [-0.5"), ("gondola.b", "gondola.b.c")],
        f"11:37: bodies.gondola.attachments.b.c: {DOT}"),
    "a dot in a marker": ([("inertia:", "markers: {fo.cus: [0, 0, 0]}\n    inertia:")],
        f"10:15: bodies.gondola.markers.fo.cus: {DOT}"),
    "a body named as a point": ([("  south:", "  gondola:"), ("from: south", "from: gondola")],
        "7:3: bodies.gondola: a name must be unique, and there is a point of this name"),
    "a cable named as a body": ([("  n: {", "  gondola: {")],
        "13:3: cables.gondola: a name must be unique, and there is a body of this name"),
    "all cables named as points": ([("  south:", "  s:"), ("from: south", "from: s"), ("  north:", "  n:"),
         ("from: north", "from: n"), ("  v: {from: knot, to: gondola.a, unstretched_length: 29}\n", ""),
         ("  w: {from: [30, 0, 50], to: gondola.b, sag: 20 cm}\n", "")],
        ["13:3: cables.n: a name must be unique, and there is a point of this name",
         "14:3: cables.s: a name must be unique, and there is a point of this name"]),
    "too little stated": (SILENT,
        f"13:6: cables.n: missing key: one of {STATED} (solve_for: pose needs one of each cable; 2 of 4 cables give "
        "none: n, s; solve_for: lengths finds them)"),
    "too much stated": ([("preload: 1000", "preload: 1000, sag: 3")],
        f"13:45: cables.n.sag: given together with preload: give exactly one of {STATED}"),
    "more equations than unknowns": ([("cables:", "solve_for: lengths\ncables:"), *SILENT],
        "12:12: solve_for: lengths: 6 equations (gondola x, y, z, roll, pitch, yaw), and 5 unknowns (lengths of n, s; "
        "gondola roll, pitch, yaw): add cables, or state nothing of 1 more"),
    "more equations of a body that cannot turn": ([("cables:", "solve_for: lengths\ncables:"), SILENT[0],
         ("mass: 50", "mass: 50\n    free: [x, y, z]")],
        "13:12: solve_for: lengths: 3 equations (gondola x, y, z), and 1 unknown (lengths of n): add cables, or "
        "state nothing of 2 more"),
    "nothing to find": ([("cables:", "solve_for: lengths\ncables:")],
        "12:12: solve_for: lengths: every cable states one already, so that nothing is left to find"),
    "tensions with pose": ([("cables:", "tensions: {min: 3}\ncables:")],
        "12:11: tensions: belongs to solve_for: lengths; with pose each cable states its own"),
    "bounds in the wrong order": ([("cables:", "solve_for: lengths\ntensions: {min: 3 kN, max: 2 kN}\ncables:")],
        "13:28: tensions.max: 2000 N is below min, 3000 N"),
    "closest to nothing": ([("cables:", "solve_for: lengths\ntensions: {method: closest}\ncables:")],
        "13:11: tensions: missing key: reference (the method is closest)"),
    "a reference without use": ([("cables:", "solve_for: lengths\ntensions: {reference: 3}\ncables:")],
        "13:23: tensions.reference: belongs to the method closest; the method is balanced"),
    "a wrong reference": ([("cables:", "solve_for: lengths\ntensions: {method: closest, reference: {q: 3}}\ncables:")],
        "13:41: tensions.reference.q: unknown cable (allowed: n, s, v, w)"),
    "missing references": ([("cables:", "solve_for: lengths\ntensions: {method: closest, reference: {v: 3}}\ncables:"),
         *SILENT],
        "13:40: tensions.reference: missing key: one for each cable that states nothing: n, s"),
    "a winch of no cable": ([("cables:", "winches: {n: {}, q: {}}\ncables:")],
        "12:18: winches.q: unknown cable (allowed: n, s, v, w)"),
    "an end that no winch has": ([("cables:", "winches: {n: {end: top}}\ncables:")],
        '12:20: winches.n.end: got "top" (did you mean to?)'),
    "a fixed point with mass": ([("free: true, mass: 2 kg, force: [0, 0, 100 N]", "mass: 3")],
        "5:32: points.knot.mass: belongs to a free point: this one is fixed (free: true lets it move)"),
    "a point without place": ([("at: [0, 0, 40], ", "")], "5:9: points.knot: missing key: at"),
    "a word for a point": ([("[0, -100, 50]", "south")],
        "4:10: points.south: expected a place [x, y, z], or a mapping with the keys at, free, mass, force, got "
        '"south"'),
    "an attitude in no range": ([("mass: 50", "mass: 50\n    attitude: [0, 0, 400 deg]")],
        '10:22: bodies.gondola.attitude.2: must be from -360 deg to 360 deg (a bare number is rad), got "400 deg"'),
    "a word for an attitude": ([("mass: 50", "mass: 50\n    attitude: fre")],
        '10:15: bodies.gondola.attitude: expected [roll, pitch, yaw], or free, got "fre"'),
    "an unknown motion": ([("mass: 50", "mass: 50\n    free: [x, y, rz]")],
        '10:18: bodies.gondola.free.2: got "rz" (did you mean z?)'),
    "a motion twice": ([("mass: 50", "mass: 50\n    free: [x, y, x]")], "10:11: bodies.gondola.free: x is given twice"),
    "an unknown key of a cable": ([("preload: 1000", "prelod: 1000")],
        "13:30: cables.n.prelod: unknown key (did you mean preload?)"),
    "an unknown key of a body": ([("mass: 50", "mas: 50")],
        "9:5: bodies.gondola.mas: unknown key (did you mean mass?)"),
    "a wrong value that all share": ([("5 mm", "5 mmm")],
        '1:37: cable.diameter: expected a length in m (a number, or text such as "1.85 mm"), got "5 mmm" (unknown unit '
        '"mmm"; did you mean mm?)'),
    "alternatives that all share": ([("diameter: 5 mm", "diameter: 5 mm, breaking_force: 3, strength: 4")],
        "1:62: cable.strength: given together with breaking_force: give exactly one of breaking_force, strength"),
    "an area that no diameter holds": ([("diameter: 5 mm", "diameter: 5 mm, area: 3")],
        "1:37: cable.diameter: a circle of it has 1.9635e-05 m^2, less than 3 m^2"),
    "a share of an unknown breaking force": ([("material: aramid", "elastic_modulus: 70e9, density: 1440"),
         ("preload: 1000", "preload: 10 %")],
        "13:39: cables.n.preload: a share needs the breaking force: give breaking_force, or strength with area or "
        "diameter"),
    "wind on cables without a size": ([("material: aramid, diameter: 5 mm", "axial_stiffness: 1e6, mass_per_length: 1"),
         ("cables:", "wind: {speed: 1, turbulence_intensity: 0.1, length_scale: 9}\ncables:")],
        "1:8: cable: missing key: one of diameter, area (the wind acts on cables; or wind.on: bodies)"),
    "no section anywhere": ([(", diameter: 5 mm", "")],
        "1:8: cable: missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"),
    "no material anywhere": ([("material: aramid, ", "")],
        ["1:8: cable: missing key: one of axial_stiffness, elastic_modulus (or give material)",
         "1:8: cable: missing key: one of mass_per_length, density (or give material)"]),
    "no section of one cable": ([(", diameter: 5 mm", ""), ("sag: 20 cm", "sag: 1, area: 1"),
         ("length: 29", "length: 29, area: 1"), ("1 kN}", "1 kN, area: 1}")],
        "13:6: cables.n: missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"),
    "an unknown material": ([("aramid", "aramit")],
        '1:19: cable.material: unknown material "aramit" (did you mean aramid?)'),
    "a tension beyond the cable": ([("preload: 1000", "preload: 1 TN")],
        "13:39: cables.n.preload: 1e+12 N is 7.22e+05 times the axial stiffness: out of range (1e-18 to 10 times)"),
    "keys of one cable in cable": ([("diameter", "chord: 5, ends: [[0, 0, 0], [1, 1, 1]], loads: [], diameter")],
        [f"1:27: cable.chord: {ONE_CABLE}: each cable has from and to",
         f"1:37: cable.ends: {ONE_CABLE}: each cable has from and to"]),
    "ends of a cable": ([("preload: 1000", "preload: 1000, chord: 3")],
        f"13:45: cables.n.chord: {ONE_CABLE}: each cable has from and to"),
    "tables of one cable": ([("cable: {", "gondola: {mass: 3}\nwinch: {location: ground}\ncable: {")],
        [f"1:1: gondola: {ONE_CABLE}: bodies are under bodies",
         f"2:1: winch: {ONE_CABLE}: winches are under winches"]),
    "no cables": ([("cables:", "cabels:")],
        "12:1: cabels: unknown key (did you mean cables?)"),
    "a number for a cable": ([("{from: north, to: knot, preload: 1000}", "5")],
        "13:6: cables.n: expected a mapping with the keys axial_stiffness, elastic_modulus, "
        "mass_per_length, density, breaking_force, strength, area, diameter, fill_factor, expansion, stress_strain, "
        "material, state, damping, unstretched_length, preload, sag, tension_to, tension, force_density, "
        "reference, loads, from, to, got 5"),
    "several mistakes": ([("mass: 50", "mass: -50"), ("preload: 1000", "prelod: 100"),
         ("to: gondola.b", "to: gondola.q")],
        ["9:11: bodies.gondola.mass: must be positive, got -50",
         "13:30: cables.n.prelod: unknown key (did you mean preload?)",
         '16:30: cables.w.to: gondola has no attachment "q" (allowed: a, b)']),
}  # fmt: skip


@pytest.mark.parametrize("what", MISTAKES)
def test_each_mistake_is_one_line_at_its_place(what):
    changes, lines = MISTAKES[what]
    lines = [lines] if isinstance(lines, str) else lines
    assert mistakes_of(changed(*changes)) == [f"s.yaml:{line}" for line in lines]


@pytest.mark.parametrize(
    ("option", "line"),
    [
        ("cables.n.preload=30 TN", "--set cables.n.preload: 3e+13 N is 2.17e+07 times the axial stiffness"),
        ("cables.q.preload=3", "--set cables.q.preload: unknown cable q (allowed: n, s, v, w)"),
        ("cables.q=null", "--set cables.q: unknown cable q (allowed: n, s, v, w)"),
        ("winches={n: }", "--set winches: winches.n: no value (an empty mapping is written {})"),
        ("winches.v=null", "--set winches.v: unknown winch v (there is none)"),
        (
            "cable.damping={ratio:0.02}",
            "--set cable.damping: cable.damping.ratio:0.02: unknown key (write ratio: 0.02, ",
        ),
        ("gondola=null", "--set gondola: unknown key in a suspension: bodies are under bodies"),
        ("cables.q.diameter=null", "--set cables.q.diameter: unknown cable q (allowed: n, s, v, w)"),
        ("cables.q.damping.ratio=0", "--set cables.q.damping.ratio: unknown cable q (allowed: n, s, v, w)"),
        ("cables.q.from=north", "--set cables.q.from: cables.q: missing key: to"),
        ("cables.n.to=null", "--set cables.n.to: cables.n: missing key: to"),
        ("cables.n.preload=null", f"--set cables.n.preload: cables.n: missing key: one of {STATED} (solve_for"),
        ("cable.diameter=null", "--set cable.diameter: cable: missing key: "),
        ("cables.q={preload: 3}", "--set cables.q: missing key: from"),
        ("actuators.m.mass=3", "--set actuators.m.mass: unknown actuator m (there is none)"),
        ("bodies.gondla.mass=3", "--set bodies.gondla.mass: unknown body gondla (did you mean gondola?)"),
        ("points.nort.2=3", "--set points.nort.2: unknown point nort (did you mean north?)"),
        ("cases.calm.iec.weight=3", "--set cases.calm.iec.weight: cases.calm.iec: unknown key (did you mean ice?)"),
        (
            "bodies.gondola.attachments.c.0=3",
            "--set bodies.gondola.attachments.c.0: unknown attachment c (allowed: a, b)",
        ),
        (
            "bodies.gondola.markers.focus.0=3",
            "--set bodies.gondola.markers.focus.0: unknown marker focus (there is none)",
        ),
        ("cables.n.to=knott", '--set cables.n.to: unknown end "knott" (did you mean knot?)'),
        ("points.north.3=3", "--set points.north.3: points.north has 3 items, counted from 0: there is no item 3"),
        ("bodies.gondola.mass=3 m", "--set bodies.gondola.mass: expected a mass in kg"),
        ("points.north=[0, 0, 40]", "s.yaml:13:6: cables.n: its two ends are at one place, [0, 0, 40]"),
        ("bodies=null", 's.yaml:15:23: cables.v.to: unknown end "gondola.a" (allowed: north, south, knot)'),
    ],
)
def test_a_bad_set_option(option, line):
    assert mistakes_of(GOOD, option)[0].startswith(line)


def test_a_name_that_a_study_misspells_is_suggested_at_its_place():
    text = "set: {bodies.gondla.mass: 3}\nvary: [{cables.nn.sag: [1, 2]}, {points.nort.2: [5, 6]}]\n"
    assert run("sweep", study_on_good(f"{text}columns: [max_tension]\n"), code=2).lines == [
        "study.yaml:2:7: bodies.gondla.mass: unknown body gondla (did you mean gondola?)"
    ]
    name = study_on_good(f"{text.replace('gondla', 'gondola')}columns: [max_tension]\n")
    assert sorted(run("validate", name, code=2).lines) == [
        "study.yaml:3:34: points.nort.2: unknown point nort (did you mean north?)",
        "study.yaml:3:9: cables.nn.sag: unknown cable nn (did you mean n?)",
    ]


def test_a_component_of_a_default_vector_may_be_set():
    scene = scene_of(GOOD, "bodies.gondola.force.1=3 kN", "bodies.gondola.attitude.2=90 deg")
    assert scene.bodies["gondola"].force == (0, 3000, 0)
    assert scene.bodies["gondola"].attitude == (0, 0, pytest.approx(math.pi / 2))
    whole = scene_of(GOOD, "bodies.gondola.force=[0, 3000, 0]", "bodies.gondola.attitude=[0, 0, 90 deg]")
    assert scene.bodies == whole.bodies
    assert mistakes_of(GOOD, "bodies.gondola.force.3=1") == [
        "--set bodies.gondola.force.3: bodies.gondola.force: expected a list, got a mapping"
    ]
    assert mistakes_of(GOOD, "bodies.gondola.force={}")[0].endswith("expected a list, got a mapping")
    assert mistakes_of(GOOD, "bodies.gondola.force.2=1 m")[0].startswith(
        "--set bodies.gondola.force.2: expected a force in N"
    )


def test_a_study_varies_a_component_of_a_default_vector():
    columns = "columns: [gondola.x, max_tension]\n"
    whole = read_study(study_on_good("vary: [{bodies.gondola.force: [[0, 0, 0], [500, 0, 0]]}]\n" + columns))
    written = [dict(whole.case(row)[1]) for row in range(2)]
    name = study_on_good("vary: [{bodies.gondola.force.0: [0, 500 N]}]\n" + columns)
    indexed = read_study(name)
    assert [dict(indexed.case(row)[1]) for row in range(2)] == written


def test_a_key_of_another_table_is_suggested_with_its_table():
    sets = ("cables.n.temperature=3", "temperature=3", "cables.n.length=3")
    assert mistakes_of(GOOD, *sets) == [
        "--set cables.n.length: unknown key (did you mean unstretched_length?)",
        "--set cables.n.temperature: unknown key "
        "(did you mean cables.n.reference.temperature or cases.NAME.temperature?)",
        "--set temperature: unknown key (did you mean cable.reference.temperature or cases.NAME.temperature?)",
    ]


def test_dotted_keys_may_add_what_is_new():
    new = ("cables.x.from=[3, 0, 60]", "cables.x.to=knot", "cables.x.sag=1", "bodies.gondola.markers.focus=[0, 0, -1]")
    scene = scene_of(GOOD, *new, "points.east.at=[9, 0, 0]")
    assert (scene.cables["x"].stated, scene.cables["x"].ends) == ("sag", ((3, 0, 60), "knot"))
    assert (scene.bodies["gondola"].markers, scene.points["east"].at) == ({"focus": (0, 0, -1)}, (9, 0, 0))


def written_net(n):
    """What the script of the nets writes for n x n nodes."""
    command = [sys.executable, SUSPENSIONS / "net.py", str(n)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=LONGEST).stdout


def test_the_first_hundred_mistakes_of_a_large_file_are_shown_without_much_work():
    number, lines = calls(mistakes_of, written_net(16).replace("from: n", "from: m"))
    assert number < 5_000_000  # 10 millions with a name suggested for each
    assert (len(lines), lines[-1]) == (101, "s.yaml: and 412 more mistakes")  # 2 x 16 x 16 cables begin at a node
    assert lines[0].endswith('unknown end "m1-1" (did you mean n1-1?)')


def test_a_mistake_that_all_cables_share_is_told_once():
    text = (SUSPENSIONS / "net-30x30.yaml").read_text(encoding="utf-8").replace("area: 10e-6", "area: 10 kg")
    assert [line.split(": expected")[0] for line in mistakes_of(text)] == ["s.yaml:7:9: cable.area"]


# every place of a file, and a wrong or unlikely value there
LEAVES = st.sampled_from(
    [None, 0, -1, 1e300, float("nan"), True, "", "x", "free", "3 m", "a.b", [], {}, [1, 2, 3], [[0]], {"a": 1}, [None]]
)  # fmt: skip


def _paths(value, path=()):
    yield path
    for key, inside in value.items() if isinstance(value, dict) else ():
        yield from _paths(inside, (*path, key))


@settings(max_examples=campaign(150, 40), deadline=None)
@given(st.data())
def test_whatever_stands_somewhere_there_is_a_scene_or_a_list_of_mistakes(data):
    motion = """
control: {gain: 0.1, measured: [x], notch: none, allocation: {weights: {n: 1}}}
actuators: {wheel: {axis: [0, 0, 1], inertia: 1, momentum: 1, torque: 1}}
wind: {speed: 6, turbulence_intensity: [0.1, 0.1, 0.1], length_scale: 25, direction: 1}
correction: {marker: gondola.focus, bandwidth: 1}
"""
    tables = f"tensions: {{min: 1}}\nwinches: {{n: {{}}}}\nmodel: {{}}{motion}cables:"
    body = "mass: 50\n    markers: {focus: [0, 0, 1]}\n    wind: {area: 1, drag_coefficient: 1}"
    document = read_document(written(changed(("cables:", tables), ("mass: 50", body)), "s.yaml"))
    value = copy.deepcopy(document.value)
    for path in data.draw(st.lists(st.sampled_from(sorted(set(_paths(value)) - {()})), min_size=1, max_size=3)):
        inside = value
        for key in path[:-1]:
            inside = inside.get(key, {}) if isinstance(inside, dict) else {}
        if isinstance(inside, dict):
            inside[path[-1]] = copy.deepcopy(data.draw(LEAVES))  # one that is filled later is no other
    document.value = value
    mistakes = ["s.yaml:"]
    try:
        read_scene(document)
    except SceneError as error:
        mistakes = [str(mistake) for mistake in error.mistakes]
    assert mistakes
    assert all(mistake.startswith("s.yaml:") and "\n" not in mistake for mistake in mistakes)


@settings(max_examples=campaign(100, 30), deadline=None)
@given(
    st.lists(st.floats(0.1, 10), min_size=2, max_size=2),
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.sampled_from([0.5, 0.999, 1.001, 2.0]),
)
def test_a_tensor_is_accepted_where_its_principal_moments_obey_the_triangle_inequality(moments, angles, ratio):
    smallest, middle = sorted(moments)
    principal = np.diag([smallest, middle, max(middle, ratio * (smallest + middle))])
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    tensor = turn @ principal @ turn.T
    entries = [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    text = changed(("[4, 4, 6]", str(entries)))
    if ratio < 1:
        assert scene_of(text).bodies["gondola"].inertia == pytest.approx(entries)
    else:
        assert mistakes_of(text) == [f"s.yaml:10:14: bodies.gondola.inertia: {NO_MASS}"]


def test_a_flat_body_has_a_tensor_that_a_mass_has():
    assert scene_of(changed(("[4, 4, 6]", "[0.1, 0.2, 0.3]"))).bodies["gondola"].inertia == (0.1, 0.2, 0.3)


# -------------------------------------------------------------------------------------------------------------- numbers


def test_numbers_of_one_scene():
    text = changed(
        (
            "mass: 50",
            "mass: 50\n    attitude: [0.1, 0.2, 0.3]\n    center_of_mass: [0, 0.1, -0.2]\n    free: [x, z, roll]",
        ),
        ("[4, 4, 6]", "[4, 5, 6, 0.1, 0.2, 0.3]\n    force: [1, 2, 3]\n    moment: [4, 5, 6]"),
    )
    numbers = numbers_of([scene_of(text)])
    assert (numbers.shape, numbers.body_names, numbers.junctions) == ((1,), ("gondola", "knot"), 1)
    one = numbers.take(0)
    np.testing.assert_array_equal(one.position, [[0, 0, 10], [0, 0, 40]])
    # intrinsic rotations about z, y, x: R = Rz(yaw) Ry(pitch) Rx(roll)
    expected = [Rotation.from_euler("ZYX", [0.3, 0.2, 0.1]).as_matrix(), np.eye(3)]
    np.testing.assert_allclose(one.rotation, expected, atol=1e-15)
    np.testing.assert_array_equal(one.mass, [50, 2])
    np.testing.assert_array_equal(one.center, [[0, 0.1, -0.2], [0, 0, 0]])
    np.testing.assert_array_equal(one.inertia[0], [[4, 0.1, 0.2], [0.1, 5, 0.3], [0.2, 0.3, 6]])
    np.testing.assert_array_equal(one.inertia[1], np.zeros((3, 3)))
    np.testing.assert_array_equal(one.force, [[1, 2, 3], [0, 0, 100]])
    np.testing.assert_array_equal(one.moment, [[4, 5, 6], [0, 0, 0]])
    np.testing.assert_array_equal(one.free, [[1, 0, 1, 1, 0, 0], [1, 1, 1, 0, 0, 0]])
    assert one.cable_names == ("n", "s", "v", "w")
    np.testing.assert_array_equal(one.owner, [[-1, 1], [-1, 1], [1, 0], [-1, 0]])
    fixed = [[0, 100, 50], [0, -100, 50], [0, 0, 0], [30, 0, 50]]
    held = [[0, 0, 0], [0, 0, 0], [0.5, 0, 0.3], [-0.5, 0, 0.3]]
    np.testing.assert_array_equal(one.attachment, np.stack([fixed, held], axis=1))
    np.testing.assert_allclose(one.axial_stiffness, [70.5e9 * math.pi * 0.005**2 / 4] * 4, rtol=1e-15)
    np.testing.assert_allclose(one.cable_mass, [1440 * math.pi * 0.005**2 / 4] * 4, rtol=1e-15)
    assert one.stated == ("preload", "tension_to", "unstretched_length", "sag")
    np.testing.assert_array_equal(one.value, [1000, 1000, 29, 0.2])
    assert one.force_density is None
    # the attachments where the body stands, by hand: position + R b
    np.testing.assert_allclose(
        one.ends(one.position, one.rotation)[3], [[30, 0, 50], [0, 0, 10] + expected[0] @ [-0.5, 0, 0.3]]
    )


def test_numbers_of_scenes_of_different_topology_are_refused():
    other = changed(("tension_to: 1 kN", "sag: 1"))
    with pytest.raises(ValueError, match="the scenes differ"):
        numbers_of([scene_of(GOOD), scene_of(other)])


def test_what_is_not_given_is_no_number():
    text = changed(
        ("cables:", "solve_for: lengths\ncables:"),
        *SILENT,
        ("mass: 50", "mass: 50\n    free: [z]"),
        ("unstretched_length: 29", "unstretched_length: 29, force_density: 40"),
    )
    numbers = numbers_of([scene_of(text)])
    assert numbers.stated == (None, None, "unstretched_length", "sag")
    np.testing.assert_array_equal(numbers.value, [[np.nan, np.nan, 29, 0.2]])
    np.testing.assert_array_equal(numbers.force_density, [[np.nan, np.nan, 40, np.nan]])


ALL_SILENT = (*SILENT, (", unstretched_length: 29", ""), (", sag: 20 cm", ""))


def test_lengths_to_be_found_and_tensions_that_are_wanted():
    table = "tensions: {method: closest, min: 1, max: 2 kN, reference: {n: 1 kN, s: 6, v: 7, w: 8}}"
    text = changed(
        ("cables:", f"solve_for: lengths\n{table}\ncables:"), *ALL_SILENT, ("mass: 50", "mass: 50\n    attitude: free")
    )
    scene = scene_of(text)
    assert (scene.solve_for, scene.bodies["gondola"].attitude) == ("lengths", "free")
    wanted = distribution_of([scene, scene_of(text, "tensions.min=3", "tensions.reference=2 kN")])
    assert wanted["method"] == "closest"
    np.testing.assert_array_equal(wanted["low"], [[1] * 4, [3] * 4])
    np.testing.assert_array_equal(wanted["high"], np.full((2, 4), 2000))
    np.testing.assert_array_equal(wanted["reference"], [[1000, 6, 7, 8], [2000] * 4])
    np.testing.assert_array_equal(wanted["moving"], [[0, 0, 0, 1, 1, 1], [1, 1, 1, 0, 0, 0]])


def test_tensions_by_default_are_balanced_without_bounds():
    wanted = distribution_of([scene_of(changed(("cables:", "solve_for: lengths\ncables:"), *ALL_SILENT))])
    assert wanted["method"] == "balanced"
    np.testing.assert_array_equal(wanted["low"], np.zeros((1, 4)))
    np.testing.assert_array_equal(wanted["high"], np.full((1, 4), np.inf))
    # four lengths for six equations: the rotations come from equilibrium
    np.testing.assert_array_equal(wanted["moving"], [[0, 0, 0, 1, 1, 1], [1, 1, 1, 0, 0, 0]])
    held = [("mass: 50", "mass: 50\n    free: [x, y, z, yaw]"), ("cables:", "solve_for: lengths\ncables:")]
    wanted = distribution_of([scene_of(changed(*held, *ALL_SILENT))])
    np.testing.assert_array_equal(wanted["moving"], [[0] * 6, [1, 1, 1, 0, 0, 0]])  # as many as equations


# -------------------------------------------------------------------------------------------------- files and commands


@pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])
def test_the_scenes_of_the_project_are_valid(path):
    scene = load_scene(path)[1]
    numbers = numbers_of([scene])
    assert numbers.cable_names == tuple(scene.cables)
    assert "ok" in run("validate", path).out


def test_the_published_suspensions_are_there():
    names = {"carlina-net", "carlina-balloon", "fast", "cogiro", "trifilar", "net-2x2", "net-30x30", "mast-guys"}
    assert names <= {path.stem for path in FILES}
    fast = numbers_of([load_scene(SUSPENSIONS / "fast.yaml")[1]]).take(0)
    towers, attachments = fast.attachment[:, 0], fast.attachment[:, 1]
    np.testing.assert_allclose(np.hypot(*towers.T[:2]), 300, rtol=1e-6)  # a circle of 600 m
    np.testing.assert_allclose(np.hypot(*attachments.T[:2]), 6.5, rtol=1e-5)
    np.testing.assert_allclose(np.degrees(np.arctan2(towers[:, 1], towers[:, 0])) % 360, [30, 90, 150, 210, 270, 330])
    np.testing.assert_allclose(
        np.degrees(np.arctan2(attachments[:, 1], attachments[:, 0])) % 360, [60, 60, 180, 180, 300, 300], rtol=1e-5
    )


def test_a_net_is_what_its_script_writes_and_loads_without_much_work():
    for n in (2, 30):
        assert written_net(n) == (SUSPENSIONS / f"net-{n}x{n}.yaml").read_text(encoding="utf-8")
    number, (_, scene) = calls(load_scene, SUSPENSIONS / "net-30x30.yaml")
    assert number < 3_000_000
    numbers = numbers_of([scene])
    assert (len(scene.cables), numbers.junctions) == (2 * 30 * 31, 900)
    ends = numbers.ends(numbers.position, numbers.rotation)[0]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1), 1, rtol=1e-15)


def test_the_schema_knows_every_key():
    schema = suspension_schema()
    for path, model in SUSPENSION_TABLES:
        mapping = schema["$defs"][model.__name__] if path else schema
        keys = {field.alias or name for name, field in model.model_fields.items()}
        assert set(mapping["properties"]) - {"base"} == keys
        assert mapping["additionalProperties"] is False
        assert all(value.get("description") for value in mapping["properties"].values())
    assert schema["else"]["required"] == ["cables"]
    assert schema["else"]["properties"]["cables"]["additionalProperties"] == {"required": ["from", "to"]}
    excluded = [one["not"]["required"] for one in schema["$defs"]["SuspendedCable"]["allOf"]]
    assert ["preload", "tension_to"] in excluded


# keys that vary, each with two values, and whether the cases are one table
TABLES = {
    "numbers of all kinds": (
        "{cable.diameter: [5 mm, 6 mm], points.north.2: [50 m, 60 m], points.knot.at.1: [0, 1],"
        " cables.n.preload: [1, 2], bodies.gondola.attachments.a.0: [0.5, 0.6], bodies.gondola.inertia.2: [6, 7],"
        " points.knot.force.2: [1, 2], bodies.gondola.mass: [50, 1 kg], gravity: [9, 10]}",
        1,
    ),
    "a key that all share and one cable has itself": ("{cable.density: [1, 2], cables.n.density: [3, 4]}", 1),
    "a section in place of the shared one": ("{cables.n.area: [1e-6, 2e-6], cable.diameter: [5 mm, 6 mm]}", 1),
    "damping": ("{cable.damping.loss_factor: [0.01, 0.02]}", 1),
    "a preload in place of a length": ("{cables.v.preload: [1, 2]}", 1),
    "a value out of range": ("{cables.v.preload: [1, -2]}", 1),
    "a body that no mass can be": ("{bodies.gondola.inertia.0: [4, 40]}", 1),
    "a cable of no length": ("{points.knot.at: [[0, 0, 40], [0, 100, 50]]}", 1),
    "a knot moved onto its anchor": ("{points.knot.at.1: [0, 100], points.knot.at.2: [40, 50]}", 1),
    "an attitude": ("{bodies.gondola.attitude: [[0, 0, 1], [0, 0, 2]]}", 2),
    "a whole place": ("{points.north: [[0, 100, 50], [0, 100, 60]]}", 2),
}


@pytest.mark.parametrize("what", TABLES)
def test_cases_read_as_arrays_are_those_read_one_by_one(what):
    vary, count = TABLES[what]
    assert tables_read_as_arrays(study_on_good(f"vary: [{vary}]\ncolumns: [preload]\n")) == count


def tables_read_as_arrays(name):
    """Number of tables that the cases of a study are, each of which is as it is read alone."""
    study, found = read_study(name), {}
    tables, refused = tables_of(study, range(study.count))
    for table in tables:
        scenes = [table.scene_of(place) for place in range(len(table.cases))]
        numbers = numbers_of(scenes)
        found |= {case: (scenes[place], numbers.take(place)) for place, case in enumerate(table.cases.tolist())}
    for case, (scene, numbers) in found.items():
        expected = study.case(case)[1]
        assert scene.model_dump() == expected.model_dump()
        alone = numbers_of([expected]).take(0)
        for core in CORES:
            np.testing.assert_array_equal(getattr(numbers, core), getattr(alone, core), err_msg=core)
        assert (numbers.stated, numbers.cable_names) == (alone.stated, alone.cable_names)
    for case, error in refused.items():
        with pytest.raises(SceneError, match=re.escape(str(error))):
            study.case(case)
    assert sorted([*found, *refused]) == list(range(study.count))
    return len(tables)
