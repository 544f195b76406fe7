"""Load cases that push and move, on the lengths of the reference state.

Against the 50-digit catenary between moved ends or under the force, scipy's root-finder upon such catenaries, the
stiffness for small forces, and one kind of scene against the other.
"""

import json
import math

import numpy as np
import pytest
from command import run, study_file, table_of, with_sets, written
from references import catenary_mp
from scenes import cells, mistakes_of, scene_of
from scipy.optimize import root
from suspension_cases import SUSPENSIONS, numbers

from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import load_scene
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.suspension.case import SuspensionCase

pytestmark = pytest.mark.usefixtures("folder")

G, EA, MASS = 9.81, 1.2e6, 0.9
ONE = """\
gravity: 9.81
cable:
  ends: [[0, 0, 20], [90, 0, 35]]
  axial_stiffness: 1.2 MN
  mass_per_length: 0.9 kg/m
  diameter: 14 mm
  expansion: 12e-6 1/K
  STATED
gondola: {mass: 200 kg}
cases:
"""
STATED = ("preload: 8 kN", "sag: 3 m", "unstretched_length: 96 m", "tension: {at: end_1, value: 5 kN}")


def one(stated, case):
    return ONE.replace("STATED", stated) + f"  day: {case}\ncase: day\n"


def catenary(chord, length, mass=MASS):
    """Forces at the ends of a cable on what holds them, along x, y, z, by the reference. [N]"""
    start = catenary_mp.solve_loaded([*map(float, chord)], length, EA, mass * G)
    first = np.array([float(part) for part in start])
    return first, -first - [0, 0, mass * G * length]


# ----------------------------------------------------------------------------------------------------- one cable


@pytest.mark.crossed
@pytest.mark.parametrize("stated", STATED)
@pytest.mark.parametrize("moves", ["{end_1: [0, 0, -2 m]}", "{end_2: [1.5 m, -4 m, 0.3 m]}",
                                   "{end_1: [0.1 m, 0, 0], end_2: [-2 m, 0, 0]}"])  # fmt: skip
def test_moved_ends_against_the_catenary_of_the_same_length(stated, moves):
    found = scene_of(one(stated, f"{{moves: {moves}}}"))
    moved = found.load_case.moves
    length = cells(scene_of(one(stated, "{}").replace("case: day", "")), "unstretched_length")["unstretched_length"]
    chord = np.array([90.0, 0, 15]) + moved.end_2 - np.array(moved.end_1)
    first, last = catenary(chord, length)
    values = cells(
        found, "tension_1", "tension_2", "reaction_1_vertical", "chord", "unstretched_length", "lowest_point"
    )
    assert values["unstretched_length"] == length
    assert values["tension_1"] == pytest.approx(np.linalg.norm(first), rel=1e-10)
    assert values["tension_2"] == pytest.approx(np.linalg.norm(last), rel=1e-10)
    assert values["reaction_1_vertical"] == pytest.approx(-first[2], rel=1e-9)
    assert values["chord"] == pytest.approx(np.linalg.norm(chord), rel=1e-14)
    assert values["lowest_point"] <= 20 + moved.end_1[2] + 1e-12


def test_a_moved_end_keeps_the_digits_of_a_stiff_cable():
    """1 um on a cable of 1e12 N: the tension grows by EA u/l, with the digits that EA leaves of the stated preload."""
    day = "{moves: {end_2: [1 um, 0, 0]}}"
    text = one("preload: 100 N", day).replace("1.2 MN", "1e12 N").replace("[90, 0, 35]", "[90, 0, 20]")
    found = cells(scene_of(text.replace("0.9 kg/m", "1e-9 kg/m")), "preload")["preload"]
    assert found == pytest.approx(100 + 1e12 * 1e-6 / 90, rel=1e-9)


@pytest.mark.crossed
@pytest.mark.parametrize("stated", STATED)
@pytest.mark.parametrize("force", [0.01, 300.0, -300.0, 20e3, -9e3])
def test_a_force_on_the_gondola_against_the_catenary(stated, force):
    """The horizontal force of the 50-digit catenary at the displaced end has changed by the force."""
    found = scene_of(one(stated, f"{{forces: {{end_2: [{force} N, 0, 0]}}}}"))
    values = cells(found, "force_displacement", "unstretched_length", "tension_2", "chord")
    shift, length = values["force_displacement"] / 1e3, values["unstretched_length"]
    before, after = catenary([90, 0, 15], length)[1], catenary([90 + shift, 0, 15], length)[1]
    assert before[0] - after[0] == pytest.approx(force, rel=1e-8, abs=1e-9 * abs(before[0]))
    assert values["tension_2"] == pytest.approx(np.linalg.norm(after), rel=1e-9)
    assert values["chord"] == pytest.approx(math.hypot(90 + shift, 15), rel=1e-13)


@pytest.mark.parametrize("force", [1e-9, 1e-6, 1e-3, 1.0])
def test_the_error_of_a_displacement_by_a_small_force_is_true(force):
    """Against F/k, of which the second order is far below; k is that without the force."""
    path = written(one("preload: 8 kN", f"{{forces: {{end_2: [{force!r} N, 0, 0]}}}}"))
    ((row,), (errors,)) = (json.loads(run("static", path, "--format", "json").out)[part] for part in ("rows", "errors"))
    (calm,) = table_of("static", path, "--set", "case=null")
    linear = 1e3 * force / calm["end_stiffness_N_per_m"]
    stated, second_order = errors["force_displacement_mm"], 1e-4 * force
    assert abs(row["force_displacement_mm"] / linear - 1) <= stated + second_order
    assert stated <= max(1e-12, 1e-14 * 8000 / force)  # not so large that it says nothing


def test_force_temperature_and_wind_together_are_those_of_a_suspension():
    """The gondola as a body free along x, held by what the cable pulls with in the case without the force."""
    day = "{temperature: 273.15 K, wind: {speed: 20 m/s, direction: 50 deg}, moves: {end_1: [0, 1 m, 0]}FORCE}"
    alone = scene_of(one("preload: 8 kN", day.replace("FORCE", ", forces: {end_2: [500 N, 0, 0]}")))
    values = cells(alone, "force_displacement", "tension_1", "tension_2", "swing", "sag", "reaction_1_vertical")
    calm = CableCase(scene_of(one("preload: 8 kN", day.replace("FORCE", ""))))
    held = -calm.form.end_forces("global")[1, 0]
    text = one("unstretched_length: LENGTH", day.replace("FORCE", ", forces: {gondola: [500 N, 0, 0]}"))
    text = text.replace("LENGTH", repr(float(calm.reference_length))).replace("  ends: [[0, 0, 20], [90, 0, 35]]\n", "")
    text = text.replace("gondola: {mass: 200 kg}\n", "").replace("end_1: ", "a: ")
    text += ("points: {a: [0, 0, 20]}\nbodies: {gondola: {at: [90, 0, 35], mass: 200 kg, free: [x], "
             f"force: [{held} N, 0, 0], attachments: {{eye: [0, 0, 0]}}}}}}\n"
             "cables: {n: {from: a, to: gondola.eye}}\n")  # fmt: skip
    many = numbers(scene_of(text), "gondola.x", "n.tension_from", "n.tension_to", "n.swing", "n.sag",
                   "n.reaction_1_vertical", "gondola.force_displacement_x")  # fmt: skip
    assert many["gondola.x"] - 90 == pytest.approx(values["force_displacement"] / 1e3, rel=1e-7)
    assert many["gondola.force_displacement_x"] == pytest.approx(values["force_displacement"], rel=1e-9)
    pairs = ("n.tension_from", "tension_1"), ("n.tension_to", "tension_2"), ("n.swing", "swing"), ("n.sag", "sag"), (
        "n.reaction_1_vertical", "reaction_1_vertical")  # fmt: skip
    for other, own in pairs:
        assert many[other] == pytest.approx(values[own], rel=1e-8), own


def test_a_row_has_the_same_digits_beside_rows_that_are_pushed():
    text = one("preload: 8 kN", "{forces: {end_2: [3 kN, 0, 0]}}").replace("case: day\n", "")
    path = written(text + "  calm: {}\n  pull: {forces: {end_2: [-1 kN, 0, 0]}}\n")
    columns = "vary: [{case: all}]\ncolumns: [preload, sag, tension_1, force_displacement]\n"
    rows = table_of("sweep", study_file(".", columns, path), "--no-write")
    assert [row["case"] for row in rows] == ["day", "calm", "pull"]
    for row in rows:
        (alone,) = table_of("static", path, "--case", row["case"])
        for name in ("preload_N", "sag_m", "tension_1_N", "force_displacement_mm"):
            assert alone[name] == row[name], (row["case"], name)


# --------------------------------------------------------------------------------------------------- several cables

MAST = str(SUSPENSIONS / "mast-guys.yaml")
ANCHORS = ((50, 0, 0), (-25, 43.30127, 0), (-25, -43.30127, 0))


def top_under(force, lengths, anchors=ANCHORS):
    """Where the top of the mast comes to rest, by catenaries of 50 digits between it and its anchors. [m]"""
    found = load_scene(MAST)[1].cables["guy1"]
    stiffness, mass = found.section_axial_stiffness, found.section_mass
    near = {}  # of each cable the last answer, from which the next search begins

    def net(place):
        total = np.array(force) - [0, 0, 300 * G]
        for anchor, length in zip(anchors, lengths, strict=True):
            span = [*(place - np.array(anchor))]
            near[anchor] = catenary_mp.solve_loaded(span, length, stiffness, mass * G, start=near.get(anchor))
            total = total - [float(part) for part in near[anchor]] - [0, 0, mass * G * length]
        return total

    at = root(net, [0.03, 0, 50.02], tol=1e-12)
    assert np.abs(at.fun).max() < 1e-6
    return at.x


def mast(*sets):
    return load_scene(MAST, sets)[1]


PUSHED = tuple(f"top.force_displacement_{axis}" for axis in "xyz")
GUYS = tuple(f"guy{k}.unstretched_length" for k in (1, 2, 3))


@pytest.mark.parametrize(
    ("case", "force", "shift"),
    [
        ("{forces: {top: [10 kN, 0, 0]}}", (10e3, 0, 46.6e3), (0, 0, 0)),
        ("{forces: {top: {force: [0, -4 kN, 1 kN]}}}", (0, -4e3, 47.6e3), (0, 0, 0)),
        ("{moves: {ground1: [0, 0, -5 mm]}}", (0, 0, 46.6e3), (0, 0, -0.005)),
        ("{forces: {top: [3 kN, 0, 0]}, moves: {ground1: [-0.4 m, 0, 0]}}", (3e3, 0, 46.6e3), (-0.4, 0, 0)),
    ],
)
def test_forces_and_moves_keep_the_lengths_of_a_mast(case, force, shift):
    lengths = [*numbers(mast(), *GUYS).values()]
    found = mast(f"cases={{lean: {case}}}", "case=lean")
    values = numbers(found, "top.x", "top.y", "top.z", *GUYS)
    assert [values[name] for name in GUYS] == lengths
    anchors = [tuple(np.array(ANCHORS[0]) + shift), *ANCHORS[1:]]
    expected = top_under(force, lengths, anchors)
    assert [values[f"top.{axis}"] for axis in "xyz"] == pytest.approx(expected, abs=1e-8)
    assert np.hypot(*expected[:2]) < 0.3  # not the 16 m of guys cut anew
    if "forces" in case:
        moved = 1e3 * (expected - top_under((0, 0, 46.6e3), lengths, anchors))
        assert [*numbers(found, *PUSHED).values()] == pytest.approx(moved, abs=1e-5)


def test_a_small_force_moves_a_point_by_its_stiffness():
    lengths = [*numbers(mast(), *GUYS).values()]
    before = top_under((0, 0, 46.6e3), lengths)
    step, stiffness = 1e-3, np.zeros(3)
    # by differences of the catenaries: the force that holds the top 1 mm aside
    found = load_scene(MAST)[1].cables["guy1"]
    for sign in (1, -1):
        for anchor, length in zip(ANCHORS, lengths, strict=True):
            place = before + np.array([sign * step, 0, 0])
            first = catenary_mp.solve_loaded([*(place - np.array(anchor))], length, found.section_axial_stiffness,
                                             found.section_mass * G)  # fmt: skip
            stiffness += sign * np.array([float(part) for part in first]) / (2 * step)
    values = numbers(mast("cases={lean: {forces: {top: [10 N, 0, 0]}}}", "case=lean"), "top.x")
    assert values["top.x"] - before[0] == pytest.approx(10 / stiffness[0], rel=1e-3)
    for force in (10.0, 1e-2, 1e-6, 1e-12):  # whose displacement rounding hides at last
        leaning = mast(f"cases={{lean: {{forces: {{top: [{force!r} N, 0, 0]}}}}}}", "case=lean")
        moved, error = SuspensionCase(leaning).force_displacement("top", 0)
        assert (moved == 0) == (force < 1e-8)
        assert not moved or abs(moved * stiffness[0] / force - 1) <= error + 1e-3
        assert error < 1e-7 / force  # not so large that it says nothing


def test_without_forces_there_is_no_displacement_by_them():
    for sets in ((), ("cases={lower: {moves: {ground1: [0, 0, -5 mm]}}}", "case=lower")):
        with pytest.raises(NoSolutionError, match=r"needs the key cases\.\*\.forces"):
            SuspensionCase(mast(*sets)).force_displacement("top", 0)


BODY = """\
cable: {axial_stiffness: 500 kN, mass_per_length: 0.4 kg/m}
bodies:
  box:
    at: [0, 0, 0]
    mass: MASS
    center_of_mass: CENTER
    inertia: [20, 30, 25]
    attachments: {a: [1, 0.5, 0.4], b: [-1, 0.6, 0.5], c: [0.2, -0.8, 0.3], d: [-0.7, -0.9, 0.2]}
    markers: {hook: [0.6, -0.4, -0.9]}
cables:
  a: {from: [8, 6, 12], to: box.a, unstretched_length: 15 m}
  b: {from: [-9, 7, 11], to: box.b, unstretched_length: 15.5 m}
  c: {from: [1, -9, 12], to: box.c, unstretched_length: 14.6 m}
  d: {from: [-7, -8, 10], to: box.d, unstretched_length: 14.5 m}
"""
POSE = ("box.x", "box.y", "box.z", "box.roll", "box.pitch", "box.yaw", "a.tension_to", "d.tension_from")


def box(mass=150.0, center=(0.1, 0.05, -0.2), case=""):
    text = BODY.replace("MASS", repr(mass)).replace("CENTER", str([*map(float, center)]))
    return scene_of(text + (f"cases: {{day: {case}}}\ncase: day\n" if case else ""))


def test_a_load_on_a_marker_is_a_mass_that_hangs_there():
    """Statics and stiffness are those of a body with another mass and center of mass."""
    center, hook, load = np.array([0.1, 0.05, -0.2]), np.array([0.6, -0.4, -0.9]), 60.0
    with_mass = box(150 + load, (150 * center + load * hook) / (150 + load))
    pushed = box(case=f"{{forces: {{box.hook: [0, 0, {-load * G!r}]}}}}")
    names = *POSE, *(f"box.stiffness_{pair}" for pair in ("rxrx", "ryry", "rzrz", "rxry", "ryrx", "xrz"))
    expected, found = numbers(with_mass, *names), numbers(pushed, *names)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-8, abs=1e-9), name


def test_a_force_on_a_marker_turns_with_the_body():
    """Nothing is left of forces and moments about the reference point, and the stiffness is that of differences."""
    force = np.array([220.0, -150, 90])
    pushed = SuspensionCase(box(case=f"{{forces: {{box.hook: {force.tolist()}}}}}"))
    found = pushed.equilibrium
    turn = found.rotation[0]
    weight = np.array([0, 0, -150 * G])
    net = force + weight + found.end_forces[:, 1].sum(axis=0)
    moment = np.cross(turn @ [0.6, -0.4, -0.9], force) + np.cross(turn @ [0.1, 0.05, -0.2], weight)
    moment = moment + np.cross(turn @ np.array([[1, 0.5, 0.4], [-1, 0.6, 0.5], [0.2, -0.8, 0.3], [-0.7, -0.9, 0.2]]).T,
                               found.end_forces[:, 1].T, axis=0).sum(axis=1)  # fmt: skip
    assert np.abs(net).max() < 1e-7
    assert np.abs(moment).max() < 1e-7
    stiffness, step = pushed.body_stiffness("box"), 0.5
    assert stiffness == pytest.approx(stiffness.T, rel=1e-6, abs=1e-4)
    moved = []
    for sign in (1, -1):
        beside = f"{{forces: {{box.hook: {force.tolist()}, box: {{moment: [0, {sign * step}, 0]}}}}}}"
        moved.append(SuspensionCase(box(case=beside)).equilibrium)
    turned = (moved[0].rotation[0] - moved[1].rotation[0]) @ turn.T / 2  # [rotation vector x]
    small = np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
    shift = (moved[0].position[0] - moved[1].position[0]) / 2
    expected = np.linalg.solve(stiffness, [0, 0, 0, 0, step, 0])
    assert np.concatenate([shift, small]) == pytest.approx(expected, rel=1e-4, abs=1e-8)


def test_a_held_body_is_moved_and_its_cables_with_it():
    """A frame that stands shifts by what the case says; the cable is that between moved points."""
    text = """\
cable: {axial_stiffness: 1.2 MN, mass_per_length: 0.9 kg/m, preload: 8 kN}
bodies: {frame: {at: [90, 0, 35], mass: 10 kg, free: [], attachments: {eye: [0, 0, 0]}}}
cables: {n: {from: [0, 0, 20], to: frame.eye}}
cases: {lean: {moves: {frame: [1 m, 0, -2 m]}}}
case: lean
"""
    values = numbers(scene_of(text), "n.tension_from", "frame.x", "frame.z", "n.unstretched_length")
    assert (values["frame.x"], values["frame.z"]) == (91, 33)
    first, _ = catenary([91, 0, 13], values["n.unstretched_length"])
    assert values["n.tension_from"] == pytest.approx(np.linalg.norm(first), rel=1e-10)


def test_modes_and_studies_take_the_case():
    path = written(f"base: {MAST}\ncases: {{calm: {{}}, lean: {{forces: {{top: [10 kN, 0, 0]}}}}}}\n")
    calm, lean = (table_of("modes", path, "-n", "1", "--case", case)[0]["frequency_Hz"] for case in ("calm", "lean"))
    assert lean < 0.99 * calm  # the guy that gives way is slacker
    vary = "vary: [{cases.lean.forces.top: [[0, 0, 0], [10 kN, 0, 0]]}]\nset: {case: lean}\n"
    rows = table_of("sweep", study_file(".", f"{vary}columns: [top.x, frequency_1]\n", path), "--no-write")
    assert [row["frequency_1_Hz"] for row in rows] == pytest.approx([calm, lean], rel=1e-9)
    assert rows[1]["top.x_m"] == pytest.approx(numbers(load_scene(path, (), "lean")[1], "top.x")["top.x"], rel=1e-12)


# ------------------------------------------------------------------------------------------------------- the note


def test_a_force_that_cuts_cables_anew_is_told():
    """In a study and in a search once, of the first row and of the first solution; static: test_suspension_commands."""
    assert run("static", MAST, "--table", "points").err == ""
    pushed = "points.top.force=[10 kN, 0, 46.6 kN]"
    vary = "set: {points.top.force: [10 kN, 0, 46.6 kN]}\nvary: [{cable.density: [7000, 7900]}]\n"
    swept = run("sweep", study_file(".", f"{vary}columns: [top.x]\n", MAST), "--no-write")
    found = run("find", MAST, "max_tension = 20.1 kN", "--by", "cable.density", "--set", pushed)
    for lines in (swept.lines, found.lines):
        (note,) = [line for line in lines if line.startswith("note: ")]
        assert "move top by " in note
    # with lengths nothing is cut anew, however far it moves
    sets = with_sets(*(f"cables.guy{k}.unstretched_length=75 m" for k in (1, 2, 3)))
    assert run("static", MAST, *sets, "--table", "points").err == ""


# ------------------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("{forces: {end_1: [1 N, 0, 0]}}", "cases.day.forces.end_1: unknown key (did you mean end_2?)"),
        ("{forces: {end_2: [1 N, 2 N, 0]}}", "forces.end_2: end 2 is free along x only: the forces along y and z must"),
        ("{forces: {end_2: [1 m, 0, 0]}}", 'forces.end_2.0: expected a force in N (a number, or text such as "1.3 kN"'),
        ("{forces: {end_2: 3 N}}", 'cases.day.forces.end_2: expected a list, got "3 N"'),
        ("{forces: [1, 0, 0]}", "cases.day.forces: expected a mapping with the keys end_2, got a list"),
        ("{moves: {end_3: [1 m, 0, 0]}}", "cases.day.moves.end_3: unknown key (did you mean end_2?)"),
        ("{moves: {end_1: [1 N, 0, 0]}}", "cases.day.moves.end_1.0: expected a length in m (a number, or text such as"),
        ("{moves: {end_1: [90 m, 0, 15 m]}}", "cases.day.moves: moved, the two ends are 0 m apart: out of range"),
        ("{moves: {end_1: [1 m, 0]}}", "cases.day.moves.end_1: expected 3 components, got 2"),
    ],
)
def test_mistakes_of_one_cable(case, message):
    (line,) = mistakes_of(one("preload: 8 kN", case))
    assert message in line


@pytest.mark.parametrize("more", ["", ", moves: {end_1: [1 m, 0, 0]}"])
def test_a_force_needs_a_gondola(more):
    text = one("preload: 8 kN", f"{{forces: {{end_2: [1 N, 0, 0]}}{more}}}").replace("gondola: {mass: 200 kg}\n", "")
    (line,) = mistakes_of(text)
    assert "end 2 is fixed without a gondola: a force on it changes nothing" in line


HELD = "{at: [3, 3, 3], mass: 1 kg, free: [], attachments: {eye: [0, 0, 0]}}"


@pytest.mark.parametrize(
    ("case", "message"),
    [
        ("{forces: {tpo: [1 N, 0, 0]}}", "cases.day.forces.tpo: unknown point, body or marker (did you mean top?)"),
        (
            "{forces: {ground1: [1 N, 0, 0]}}",
            "cases.day.forces.ground1: ground1 is fixed: a force on it changes nothing",
        ),
        (
            "{forces: {top: {moment: [1 N m, 0, 0]}}}",
            "cases.day.forces.top: moment belongs to a body: a point does not",
        ),
        ("{forces: {box.hook: {moment: [1 N m, 0, 0]}}}", "moment belongs to the body: write it for box"),
        ("{forces: {box.hok: [1 N, 0, 0]}}", "unknown point, body or marker (did you mean box.hook?)"),
        ("{forces: {anchor: [1 N, 0, 0]}}", "anchor is held in all its motions: a force on it changes nothing"),
        ("{forces: {top: [1 m, 0, 0]}}", "expected a force in N"),
        ("{forces: {top: 3 N}}", "cases.day.forces.top: expected a force [x, y, z], or a mapping with the keys force"),
        ("{forces: {top: {forse: [1, 0, 0]}}}", "unknown key (did you mean force?)"),
        ("{forces: [1, 2, 3]}", "cases.day.forces: expected a mapping, got a list"),
        ("{moves: {top: [1 m, 0, 0]}}", "cases.day.moves.top: top is free, it finds its place itself: forces push it"),
        ("{moves: {grund1: [1 m, 0, 0]}}", "unknown fixed point or held body (did you mean ground1?)"),
        ("{moves: {box: [1 m, 0, 0]}}", "box is free along x, where it finds its place itself: forces push it"),
        ("{moves: {ground1: [1 N, 0, 0]}}", "cases.day.moves.ground1.0: expected a length in m"),
        ("{moves: {ground1: [-75 m, 43.30127 m, 0]}}", "moved, the two ends of tie are 0 m apart"),
        ("{moves: {ground1: 5 mm}}", "cases.day.moves.ground1: expected a list"),
    ],
)
def test_mistakes_of_suspensions(case, message):
    box = "{at: [0, 0, 60], mass: 5 kg, inertia: [1, 1, 1], attachments: {eye: [0, 0, 0]}, markers: {hook: [0, 0, 1]}}"
    text = f"""\
base: {MAST}
bodies: {{box: {box}, anchor: {HELD}}}
cables:
  more: {{from: top, to: box.eye}}
  tie: {{from: ground1, to: ground2}}
  rest: {{from: anchor.eye, to: top}}
cases: {{day: {case}}}
"""
    (line,) = mistakes_of(text)
    assert message in line


def test_a_component_is_found_and_varied():
    """The force that moves the top by 5 cm, by its key; the statics with that force say so."""
    lean = "{forces: {top: [10 kN, 0, 0]}, moves: {ground1: [0, 0, 0]}}"
    path = written(f"base: {MAST}\ncases: {{lean: {lean}}}\n")
    key = "cases.lean.forces.top.0"
    (row,) = table_of("find", path, "top.x = 5 cm", "--by", key, "--case", "lean", "--columns", "top.z")
    there = numbers(load_scene(path, (f"{key}={row[f'{key}_N']!r}",), "lean")[1], "top.x")
    assert there["top.x"] == pytest.approx(0.05, rel=1e-8)
    (row,) = table_of("find", path, "top.x = 0.04 m", "--by", "cases.lean.moves.ground1.2", "--case", "lean")
    assert row["cases.lean.moves.ground1.2_m"] < 0
