"""Load cases of suspensions: against scenes of one cable, and poses by scipy's root-finder on 50-digit catenaries.

The expected suspension is made here from the file's values: lengths at the temperature, masses with ice, and for each
cable one vector of weight and wind per length, along which the axes of the reference stand.
"""

import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, run, table_of, written
from references import cable_in_wind, catenary_mp
from scenes import cells, mistakes_of, scene_of
from scipy.optimize import root
from suspension_cases import numbers, row
from test_load_cases import DAYS as DAYS_OF_ONE
from test_load_cases import LINE, load_of
from test_suspension_ssm import state_space

from cablestudy.cable.geometry import points_along
from cablestudy.control.winches import FROM, TO, Winch
from cablestudy.scene.determinacy import MOTIONS
from cablestudy.study.columns import find
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.rows import cases_of, evaluate_suspensions
from cablestudy.system.coupled import Layout

pytestmark = pytest.mark.usefixtures("folder")

G, D, ALPHA, DENSITY, EA = 9.81, 0.022, 19e-6, 3500.0, 70e9 * math.pi * 0.022**2 / 4
MASS = DENSITY * math.pi * D**2 / 4
CASES = LINE[LINE.index("cases:") : LINE.index("  visitor:")].format()
SECTION = "elastic_modulus: 70 GPa, density: 3500, diameter: 22 mm, expansion: 19e-6 1/K, strength: 300 MPa"
DAYS = {day: load for day, load in DAYS_OF_ONE.items() if day != "visitor"}
ANCHORS = {"a": (60, 40, 25), "b": (-60, 40, 25), "c": (-60, -40, 25), "d": (60, -40, 25)}
BODY = f"""\
cable: {{{SECTION}, STATED}}
{CASES}bodies:
  gondola:
    at: [0, 0, 0]
    mass: 400 kg
    free: [x, y, z]
    attachments: {{eye: [0, 0, 0]}}
    wind: {{area: [1.5 m^2, 1 m^2, 2 m^2], drag_coefficient: 1.1}}
cables:
  a: {{from: [60, 40, 25], to: gondola.eye}}
  b: {{from: [-60, 40, 25], to: gondola.eye}}
  c: {{from: [-60, -40, 25], to: gondola.eye}}
  d: {{from: [60, -40, 25], to: gondola.eye}}
"""


def test_a_chord_between_held_ends_needs_no_equilibrium():
    """At -1e-3 of its length per degree next to nothing is left of the cable, but its ends are where they were."""
    cable = "cable: {elastic_modulus: 70 GPa, density: 3500, diameter: 22 mm, expansion: -1e-3 1/K}\n"
    text = cable + "cases: {fire: {temperature: 1000 degC}}\ncables: {a: {from: [0, 0, 0], to: [30, 0, 40], STATED}}\n"
    cells, status = row(scene_of(text.replace("STATED", "unstretched_length: 50.1 m"), "case=fire"), "a.chord", "a.sag")
    assert cells["a.chord"] == pytest.approx(50.0, rel=1e-15)
    assert cells["a.sag"] is None
    assert "next to nothing is left" in status


def body(stated="unstretched_length: 77 m"):
    """The text of the body on four cables."""
    return BODY.replace("STATED", stated)


def held(*sets, stated="unstretched_length: 77 m"):
    """The scene of the body on four cables, with changes."""
    return scene_of(body(stated), *sets)


# ------------------------------------------------------------------------------------------------ as a single cable

OF_ONE = ("unstretched_length", "mass", "preload", "max_tension", "min_tension", "stretched_length", "sag", "angle_1",
          "lowest_point", "clearance", "reaction_1_vertical", "reaction_2_horizontal", "utilisation",
          "inclination_from_plumb")  # fmt: skip


def check_of_one(text, many, sets, without):
    """Cables n1 and n2 of a suspension are those of scenes of one cable, of which n2 lacks loads: `without` them."""
    ends = "from: [0, 0, 20], to: [180, -240, 28]"
    many = many.replace("  ends: [[0, 0, 20], [180, -240, 28]]\n", "").replace("ENDS", ends)
    for name, more in (("n1", ()), ("n2", (without,))):
        values = numbers(scene_of(many, *sets), *(f"{name}.{column}" for column in OF_ONE))
        for column, value in cells(scene_of(text, *sets, *more), *OF_ONE).items():
            assert values[f"{name}.{column}"] == pytest.approx(value, rel=1e-10, abs=1e-10), (name, column)


# ------------------------------------------------------------------------------------------- a body on four cables


def force_on_body(place, anchor, day, length, near):
    """Force of one cable on the body, tension there; from the 50-digit catenary. [N]

    `near` keeps the answer, from which the search of the next place begins.
    """
    chord = np.asarray(place) - anchor
    warm, weight, axes = load_of(day, chord)
    key = tuple(anchor)
    near[key] = catenary_mp.solve_loaded(axes @ chord, length * warm, EA, weight, start=near.get(key))
    first = np.array([float(part) for part in near[key]]) @ axes
    return -(first + weight * length * warm * axes[2])


def balanced(day, lengths):
    """Place of the body, and the tensions of the cables at it, by scipy's root-finder."""
    _, _, _, pressure, degrees = DAYS[day]
    direction = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])
    own = pressure * 1.1 * np.array([1.5, 1.0, 2.0]) * direction + [0, 0, -400 * G]
    near = {}

    def forces(place):
        pairs = zip(ANCHORS.values(), lengths, strict=True)
        return np.array([force_on_body(place, np.array(anchor), day, length, near) for anchor, length in pairs])

    start = np.array([0.0, 0.1, 0.0])
    found = root(lambda place: forces(place).sum(axis=0) + own, start, tol=1e-13)
    assert np.abs(found.fun).max() < 1e-8
    return found.x, np.linalg.norm(forces(found.x), axis=-1)


@pytest.mark.parametrize("day", campaign(["cold", "ice", "storm", "oblique"], ["ice", "oblique"]))
def test_a_body_on_four_cables(day):
    place, tensions = balanced(day, [77.0] * 4)
    equilibrium = SuspensionCase(held(f"case={day}")).equilibrium  # in uniform drag
    assert equilibrium.position[0] == pytest.approx(place, abs=1e-9)
    assert np.linalg.norm(equilibrium.end_forces[:, 1], axis=-1) == pytest.approx(tensions, rel=1e-9)


@pytest.mark.parametrize("stated", ["preload: 20 kN", "sag: 30 cm", "tension_to: 8 %"])
def test_lengths_are_those_of_the_reference_state(stated):
    length = ("a.unstretched_length", "a.mass")
    reference, oblique = (numbers(held(*sets, stated=stated), *length) for sets in ((), ("case=oblique",)))
    assert oblique == reference
    if not stated.startswith("preload"):
        return
    place, tensions = balanced("oblique", [reference["a.unstretched_length"]] * 4)
    equilibrium = SuspensionCase(held("case=oblique", stated=stated)).equilibrium  # in uniform drag
    assert equilibrium.position[0, 1] == pytest.approx(place[1], abs=1e-8)
    assert np.linalg.norm(equilibrium.end_forces[0, 1]) == pytest.approx(tensions[0], rel=1e-8)


def test_lengths_that_tensions_choose_are_those_of_the_reference_state():
    sets = ("solve_for=lengths",)
    text = BODY.replace(", STATED", "")
    reference = numbers(scene_of(text, *sets), "a.unstretched_length", "gondola.z", "a.preload")
    assert reference["gondola.z"] == 0
    day = numbers(scene_of(text, *sets, "case=ice"), "a.unstretched_length", "gondola.z", "a.tension_to")
    assert day["a.unstretched_length"] == reference["a.unstretched_length"]
    place, tensions = balanced("ice", [reference["a.unstretched_length"]] * 4)
    assert day["gondola.z"] == pytest.approx(place[2], abs=1e-8)
    assert day["a.tension_to"] == pytest.approx(tensions[0], rel=1e-8)


def test_each_cable_has_its_own_reference_temperature():
    """Where the day is that of the reference of one cable, only the others change."""
    lengths = {"a": 77.0, "b": 77 * (1 - 45 * ALPHA), "c": 77 * (1 - 45 * ALPHA), "d": 77 * (1 - 45 * ALPHA)}
    found = numbers(held("case=cold", "cables.a.reference.temperature=-30 degC"),
                    *(f"{name}.{column}" for name in ANCHORS for column in ("stretched_length", "strain")))  # fmt: skip
    for name, length in lengths.items():
        # mean of T/EA along the cable, to second order in its sag
        assert found[f"{name}.stretched_length"] / (1 + found[f"{name}.strain"]) == pytest.approx(length, rel=2e-6)


# --------------------------------------------------------------------------------------------- a tension at a place

AT = {"end_1": "tension_from", "end_2": "tension_to", "horizontal": "horizontal_tension", "mean": "preload",
      "max": "max_tension"}  # fmt: skip


@pytest.mark.crossed
@pytest.mark.parametrize("share", [False, True])
@pytest.mark.parametrize("at", AT)
def test_a_tension_at_a_place_is_had_there(at, share):
    """Of all cables, and of one beside those whose lengths are found."""
    for newtons, percent, alone in ((20e3, 12, False), (4e3, 3, True)):
        stated = f"tension: {{at: {at}, value: {f'{percent} %' if share else newtons}}}"
        own = f"cables.a={{from: [60, 40, 25], to: gondola.eye, {stated}}}", "solve_for=lengths"
        scene = held(*own, stated="") if alone else held(stated=stated)
        wanted = percent / 100 * 300e6 * math.pi * D**2 / 4 if share else newtons
        names = [f"{name}.{AT[at]}" for name in ("a" if alone else ANCHORS)]
        assert list(numbers(scene, *names).values()) == pytest.approx([wanted] * len(names), rel=1e-9)


@pytest.mark.parametrize("at", campaign(AT, list(AT)[::4]))
def test_a_deep_cable_with_a_tension_at_a_place(at):
    """It hangs from a knot on a steep one; the search begins far away."""
    text = f"""\
cable: {{{SECTION}}}
points: {{knot: {{at: [-20, 5, 50], free: true, mass: 150 kg}}}}
cables:
  steep: {{from: [45, 0, 60], to: knot, unstretched_length: 60 m}}
  deep: {{from: knot, to: [-40, 0, 30], tension: {{at: {at}, value: 1.9 kN}}}}
"""
    assert numbers(scene_of(text), f"deep.{AT[at]}")[f"deep.{AT[at]}"] == pytest.approx(1900, rel=1e-9)


@pytest.mark.usefixtures("short_searches")
def test_tensions_that_no_lengths_give_are_told():
    """Horizontal tensions on both sides of a knot without a horizontal force are equal."""
    text = f"""\
cable: {{{SECTION}}}
points: {{knot: {{at: [0, 0, 2], free: true, mass: 150 kg}}}}
cables:
  right: {{from: [45, 0, 40], to: knot, tension: {{at: horizontal, value: 3 kN}}}}
  left: {{from: knot, to: [-40, 0, 30], tension: {{at: horizontal, value: 2 kN}}}}
"""
    _, status = row(scene_of(text), "knot.z")
    assert re.search(r"(right|left) has a horizontal_tension of \d.* N instead of \d000 N", status)


# ---------------------------------------------------------------------------------------------- point loads on cables

COUPLED = ["gondola.x", "gondola.y", "gondola.z", "a.tension_from", "c.tension_to", "d.tension_to"]
LOADS = "loads: [{fraction: 0.25, mass: 80 kg}, {at: 200 m, force: [100, 50, -300]}, {at: 200 m, mass: 3 kg}]"


@pytest.mark.crossed
@pytest.mark.parametrize("stated", ["unstretched_length: 301 m", "preload: 22 kN", "sag: 8 m"])
@pytest.mark.parametrize("own", ["loads: []", LOADS])
def test_loads_of_a_case_are_those_of_one_cable(stated, own):
    """Beside those of the cable itself, and beside a cable on which the case puts nothing."""
    text = LINE.format(stated=f"{stated}\n  {own}", x=180, y=-240)
    begin, visitor, of_case = text.partition("  visitor: {loads: ")
    many = f"{begin}{visitor}{{n1: {of_case.replace('], wind', ']}, wind')}cables: {{n1: {{ENDS}}, n2: {{ENDS}}}}\n"
    check_of_one(text, many, ("ground=-3", "case=visitor"), "cases.visitor.loads=[]")


def test_the_load_of_a_case_on_a_massless_wire_by_hand():
    """Half way between two points at one height: T sin(a) = W/2, and cos(a) from the length of the stretched halves."""
    text = ("cable: {axial_stiffness: 1 MN, mass_per_length: 1e-9, unstretched_length: 10 m}\n"
            "cables: {w: {from: [0, 0, 0], to: [10, 0, 0]}}\n"
            "cases: {lamp: {loads: {w: [{fraction: 0.5, mass: 20 kg}]}}}\ncase: lamp\n")  # fmt: skip
    weight, stiffness = 20 * G, 1e6
    sine = root(lambda s: 2 * s * stiffness * (1 / math.sqrt(1 - s[0] ** 2) - 1) - weight, [0.05], tol=1e-13).x[0]
    found = numbers(scene_of(text), "w.max_tension", "w.min_tension")
    assert list(found.values()) == pytest.approx([weight / 2 / sine] * 2, rel=1e-8)


# ------------------------------------------------------------------------------------- loads in the reference state

ON_A = "cables.a.loads=[{fraction: 0.3, mass: 60 kg}, {at: 50 m, force: [200, -100, -400]}]"
WITH_LOADS = "cable.reference.loads=true"


@pytest.mark.crossed
@pytest.mark.parametrize("stated", ["unstretched_length: 301 m", "preload: 22 kN", "sag: 12 m",
                                    *(f"tension: {{at: {at}, value: 25 kN}}" for at in AT)])  # fmt: skip
@pytest.mark.parametrize("day", [None, "oblique"])
def test_what_holds_with_the_loads_on_is_that_of_one_cable(stated, day):
    """Beside a cable without loads, which is as alone too."""
    text = LINE.format(stated=f"{stated}\n  {LOADS}", x=180, y=-240).partition("  visitor:")[0]
    text = text.replace("temperature: 15 degC", "temperature: 15 degC, loads: true")
    many = text + "cables: {n1: {ENDS}, n2: {ENDS, loads: []}}\n"
    check_of_one(text, many, ("ground=-3", *([f"case={day}"] if day else [])), "cable.loads=[]")


def test_a_preload_with_the_load_on_by_hand():
    """A wire without weight, a lamp half way: T sin(a) = W/2, and each half is 5 m/cos(a) long under T."""
    text = ("cable: {axial_stiffness: 1 MN, mass_per_length: 1e-9, preload: 900 N, reference: {loads: true}}\n"
            "cables: {w: {from: [0, 0, 0], to: [10, 0, 0], loads: [{fraction: 0.5, mass: 20 kg}]}}\n")  # fmt: skip
    cosine = math.sqrt(1 - (20 * G / 2 / 900) ** 2)
    found = numbers(scene_of(text), "w.unstretched_length", "w.max_tension", "w.preload")
    assert list(found.values()) == pytest.approx([10 / cosine / (1 + 900 / 1e6), 900, 900], rel=1e-8)


MOVING = ["preload: 20 kN", "tension: {at: end_2, value: 9 kN}", "sag: 0.4 m"]


@pytest.mark.parametrize("stated", campaign(MOVING, MOVING[:2]))
def test_a_moving_body_has_what_is_stated_with_the_loads_on(stated):
    """And rests where it does with these lengths and loads, which is another search."""
    places, of_a = ("gondola.x", "gondola.y", "gondola.z"), "a.sag" if "sag" in stated else "a.preload"
    names = (*places, of_a, *(f"{name}.unstretched_length" for name in ANCHORS))
    found = numbers(held(ON_A, WITH_LOADS, stated=stated), *names, "c.tension_to", "a.tension_to")
    if "tension" in stated:
        assert [found["a.tension_to"], found["c.tension_to"]] == pytest.approx([9e3, 9e3], rel=1e-9)
    else:
        assert found[of_a] == pytest.approx(0.4 if "sag" in stated else 20e3, rel=1e-9)
    lengths = [f"cables.{name}.unstretched_length={found[f'{name}.unstretched_length']!r}" for name in ANCHORS]
    again = numbers(held(ON_A, *lengths), *places)
    assert [found[name] for name in places] == pytest.approx(list(again.values()), abs=1e-8)
    bare = numbers(held(ON_A, stated=stated), *names)
    assert abs(bare["a.unstretched_length"] - found["a.unstretched_length"]) > 1e-3


def test_only_loads_that_are_said_to_be_there_are_in_the_reference_state():
    """Those of c come on the lengths that hold with those of a; and loads of a case are never there."""
    on_c, stated = "cables.c.loads=[{fraction: 0.5, mass: 30 kg}]", "preload: 20 kN"
    lengths = [f"{name}.unstretched_length" for name in ANCHORS]
    expected = numbers(held(ON_A, WITH_LOADS, stated=stated), *lengths)
    mixed = ON_A, on_c, "cables.a.reference.loads=true"
    assert numbers(held(*mixed, stated=stated), *lengths) == pytest.approx(expected, rel=1e-11)
    of_case = "cases.storm.loads.c=[{fraction: 0.5, mass: 30 kg}]", "case=storm"
    assert numbers(held(ON_A, WITH_LOADS, *of_case, stated=stated), *lengths) == expected


def test_bodies_stand_with_the_loads_on_where_tensions_are_chosen():
    sets, places = (ON_A, "solve_for=lengths", "tensions.min=2 kN"), ("gondola.x", "gondola.y", "gondola.z")
    tensions = [f"{name}.preload" for name in ANCHORS]
    found = numbers(held(*sets, WITH_LOADS, stated=""), *places, *tensions)
    assert [found[name] for name in places] == pytest.approx([0, 0, 0], abs=1e-8)
    assert min(found[name] for name in tensions) >= 2e3 * (1 - 1e-9)
    without = numbers(held(*sets, stated=""), *places)
    assert max(map(abs, without.values())) > 1e-3


def test_all_cases_are_the_rows_of_each():
    path = written(body())

    def tables(case):
        return json.loads(run("static", path, "--case", case, "--format", "json").out)

    each, together = {day: tables(day) for day in DAYS}, tables("all")
    for table in ("bodies", "cables"):
        expected = [{"case": day, **row} for day in DAYS for row in each[day][table]["rows"]]
        assert together[table]["rows"] == expected
        assert table_of("static", path, "--case", "all", "--table", table) == expected
    modes = table_of("modes", path, "--case", "all", "-n", "2")
    assert modes == [{"case": day, **row} for day in DAYS for row in table_of("modes", path, "--case", day, "-n", "2")]


def test_all_cases_go_on_beside_one_without_an_answer():
    path = written(body())
    sets = "--set", "cables.b.expansion=1e-2", "--set", "cases.cold.temperature=100"
    done = run("static", path, *sets, "--case", "all", "--table", "bodies", "--format", "jsonl", code=3)
    rows = [json.loads(line) for line in done.out.splitlines()]
    assert [row["case"] for row in rows] == list(DAYS)
    (cold,) = (row for row in rows if row["x_m"] is None)
    assert cold["case"] == "cold"
    assert cold["status"].startswith("b: at the temperature of the case")
    assert all(row["status"] == "ok" or row["status"].startswith("over strength: ") for row in rows if row != cold)
    assert any(re.match(rf"{path}: case cold: b: at the temperature of the case", line) for line in done.lines)
    assert "has no cases" in run("static", path, "--set", "cases=null", "--case", "all", code=2).err


@pytest.mark.parametrize("day", [None, "cold", "ice"])
def test_a_load_on_a_moving_cable_is_a_free_point_that_carries_it(day):
    """Cable a in two pieces that meet at a free point with the mass and the force: statics, modes, from a bad start."""
    sets = ["model.accuracy=1e-7", *([f"case={day}"] if day else [])]
    whole = body()
    load = "loads: [{at: 30 m, mass: 50 kg, force: [0, 400, -200]}]"
    loaded = whole.replace("to: gondola.eye}\n  b:", f"to: gondola.eye, {load}}}\n  b:")
    assert loaded != whole
    pieces = whole.replace(
        "  a: {from: [60, 40, 25], to: gondola.eye}\n",
        """\
  a: {from: [60, 40, 25], to: knot, unstretched_length: 30 m}
  a2: {from: knot, to: gondola.eye, unstretched_length: 47 m}
""",
    ).replace(
        "cables:\n",
        """\
points: {knot: {at: [37, 24, 15], free: true, mass: 50 kg, force: [0, 400, -200]}}
cables:
""",
    )
    modes = ["frequency_1", "frequency_3", "frequency_6"]
    common = ["gondola.x", "gondola.y", "gondola.z", "b.max_tension", "c.sag", "a.tension_from"]
    truth = numbers(scene_of(pieces, *sets), *common, "a2.tension_to", *modes)
    for at in ([0, 0, 0], [20, -15, 30]):
        found = numbers(scene_of(loaded, *sets, f"bodies.gondola.at={at}"), *common, "a.tension_to", *modes)
        assert [found[name] for name in common] == pytest.approx([truth[name] for name in common], rel=1e-9, abs=1e-9)
        assert found["a.tension_to"] == pytest.approx(truth["a2.tension_to"], rel=1e-10)
        assert [found[name] for name in modes] == pytest.approx([truth[name] for name in modes], rel=1e-6)


def test_the_stiffness_with_loads_is_that_of_neighbouring_equilibria():
    """Central differences of the place by a force on the body, in the storm, with loads on two of the cables."""
    loads = ["cables.a.loads=[{fraction: 0.4, mass: 60 kg}]", "cables.c.loads=[{at: 20 m, force: [50, 20, -500]}]"]
    stiffness = SuspensionCase(held(*loads, "case=ice")).body_stiffness("gondola")[:3, :3]
    moved = []
    for axis in range(3):
        places = []
        for force in (1.0, -1.0):
            text = f"bodies.gondola.force={[force if k == axis else 0 for k in range(3)]}"
            places.append(SuspensionCase(held(*loads, "case=ice", text)).equilibrium.position[0])
        moved.append((places[0] - places[1]) / 2)
    assert stiffness @ np.array(moved).T == pytest.approx(np.eye(3), abs=2e-6)


def test_winches_reel_cables_with_loads():
    """Static gain of the state space against central differences of neighbouring lengths; tensions at both ends too."""
    loads = ["cables.a.loads=[{at: 30 m, mass: 60 kg}]", "cables.c.loads=[{at: 20 m, force: [50, 20, -500]}]"]
    case = SuspensionCase(held(*loads))
    kept = case.modes(60).kept
    model = state_space(Layout(case.equilibrium), kept, [Winch(0, TO), Winch(1, FROM)])
    rows = [model.outputs.index(label) for label in model.outputs if label[0] in COUPLED]
    found = model.response(np.zeros(1))[0].real[rows]
    for winch, name in enumerate("ab"):
        states = [
            list(numbers(held(*loads, f"cables.{name}.unstretched_length={77 + change}"), *COUPLED).values())
            for change in (-1e-3, 1e-3)
        ]
        expected = (np.array(states[0]) - np.array(states[1])) / 2e-3
        assert found[:, winch] == pytest.approx(expected, rel=1e-4, abs=1e-5 * np.abs(expected).max())


# ---------------------------------------------------------------------------------------------------------- the wind


def test_turbulence_acts_about_the_state_of_the_case():
    """Mean displacements are those by the steady wind of the case, which takes the place of the mean wind."""
    wind = "wind={speed: 10, turbulence_intensity: 0.15, length_scale: 50}"
    calm, storm = (held(f"case={day}", wind, "cases.none={}") for day in ("none", "storm"))
    columns = ["gondola.x", "gondola.y", "gondola.z", "a.tension_to"]
    before, after = numbers(calm, *columns), numbers(storm, *columns)
    moved = numbers(storm, "gondola.mean_x", "gondola.mean_y", "gondola.mean_z")
    for axis in "xyz":
        shift = 1e3 * (after[f"gondola.{axis}"] - before[f"gondola.{axis}"])
        assert moved[f"gondola.mean_{axis}"] == pytest.approx(shift, abs=1e-8)
    in_wind = SuspensionCase(storm).analysis
    assert in_wind.mean_tensions("a")[1] == pytest.approx(after["a.tension_to"], rel=1e-12)
    # without a steady wind the mean one acts on the cables of the day
    mean = SuspensionCase(held("case=ice", wind)).analysis
    thick = SuspensionCase(held("case=ice", wind, "cases.ice.ice.thickness=20 mm")).analysis
    ratio = thick.closed_loop.drag.cables / mean.closed_loop.drag.cables
    assert ratio == pytest.approx((D + 0.04) / (D + 0.02))


def in_pieces(case, length, pieces=16, turning=None):
    """Text of the same suspension with each cable in pieces that meet at free points, with their own directions.

    `turning` is the text of one whose cables have eyes of their own.
    """
    text, points, cables = turning or body("unstretched_length: 1"), "", ""
    for number, name in enumerate(ANCHORS):
        nodes = points_along(case.equilibrium.catenary.take(number), np.arange(1, pieces) / pieces) + ANCHORS[name]
        eye = f"gondola.{name if turning else 'eye'}"
        ends = [f"{list(ANCHORS[name])}", *(f"{name}{k}" for k in range(1, pieces)), eye]
        points += "".join(f"  {name}{k}: {{at: {node.tolist()}, free: true}}\n" for k, node in enumerate(nodes, 1))
        cables += "".join(
            f"  {name}-{k}: {{from: {ends[k]}, to: {ends[k + 1]}, unstretched_length: {length / pieces}}}\n"
            for k in range(pieces)
        )
    return text.partition("cables:\n")[0] + "points:\n" + points + "cables:\n" + cables


def test_the_note_on_modes_in_a_storm_has_the_error_of_the_table():
    arguments = "modes", CONFIGS / "suspensions" / "mast-levels.yaml", "--set", "case=storm", "-n", 3
    stated = [row["frequency_Hz"] for row in json.loads(run(*arguments, "--format", "json").out)["errors"]]
    assert f"estimated error {max(stated):.1e}" in run(*arguments, "--explain").err


@pytest.mark.parametrize(("length", "direction"), campaign([(76.5, 53), (79, 53), (79, 20)], [(79, 53)]))
def test_stated_errors_hold_where_a_body_turns(length, direction):
    """Of a marker beside its reference point, and of its attitude in a steady wind; truth: cables in pieces."""
    text = body(f"unstretched_length: {length} m").replace("free: [x, y, z]", f"free: {list(MOTIONS)}")
    eyes = ", ".join(
        f"{name}: {[math.copysign(1, x), math.copysign(1, y), 1.0]}" for name, (x, y, _) in ANCHORS.items()
    )
    more = "inertia: [400, 400, 400]\n    markers: {m: [1, 2, -3]}\n    attachments: {"
    text = text.replace("attachments: {eye: [0, 0, 0]}", more + eyes + "}")
    for name in ANCHORS:
        text = re.sub(rf"({name}: {{from: .*), to: gondola.eye", rf"\1, to: gondola.{name}", text)
    wind = f"wind={{speed: 10, direction: {direction} deg, turbulence_intensity: 0.15, length_scale: 50}}"
    steady = f"cases.storm.wind.direction={direction} deg"
    places_, angles = [f"gondola.m.mean_{axis}" for axis in "xyz"], [f"gondola.{angle}" for angle in MOTIONS[3:]]
    for names, sets in ((places_, (wind,)), (angles, ("case=storm", steady))):
        case = SuspensionCase(scene_of(text, *sets))
        columns = [find(name) for name in names]
        own = evaluate_suspensions([case.scene], columns)[0]
        true = evaluate_suspensions([scene_of(in_pieces(case, length, 6, text), *sets)], columns)[0]
        for header, error in own.errors.items():
            both = error + true.errors[header]
            assert abs(own.cells[header] - true.cells[header]) <= both * abs(own.cells[header]), header


@pytest.mark.parametrize("steady", [True, False], ids=["load case", "mean wind"])
def test_cables_in_pieces_move_in_the_wind_as_whole_ones(steady):
    """Half cables meet the drag in their own directions, and turn with it, as whole ones do."""
    speed, lossy = 10 if steady else 25, "cable.damping={loss_factor: 0.02}"
    wind = (
        f"wind={{speed: {speed}, turbulence_intensity: 0.15, length_scale: 50, on: {'bodies' if steady else 'both'}}}"
    )
    changed = lossy, wind, *(["case=storm"] if steady else [])
    case = SuspensionCase(held(*changed, "model.accuracy=1e-3", stated="unstretched_length: 79 m"))
    names = ["gondola.rms", "gondola.rms_velocity"]
    rows = [
        evaluate_suspensions([scene], [find(name) for name in names])[0]
        for scene in (case.scene, scene_of(in_pieces(case, 79, 2), *changed, "model.accuracy=1e-3"))
    ]
    for header in rows[0].errors:
        stated = rows[0].errors[header] + rows[1].errors[header]
        assert stated < 2e-3
        assert rows[0].cells[header] == pytest.approx(rows[1].cells[header], rel=stated), header


@pytest.mark.parametrize(("length", "speed"), campaign([(76.5, 10), (79, 10), (79, 25), (90, 10)], [(79, 25)]))
def test_mean_displacements_are_those_in_drag_that_follows_the_cables(length, speed):
    """Truth: equilibria of cables in pieces with uniform drag on each, extrapolated to no length of the pieces."""
    wind = f"wind={{speed: {speed}, turbulence_intensity: 0.15, length_scale: 50}}"
    case = SuspensionCase(held(wind, stated=f"unstretched_length: {length} m"))
    found, error = np.transpose([case.mean_displacement("gondola", axis) for axis in range(3)])
    moved = []
    for pieces in (8, 16, 32):
        analysis = SuspensionCase(scene_of(in_pieces(case, length, pieces), wind)).analysis
        moved.append(analysis.equilibrium.position[0] - analysis.without_wind.position[0])
    halved = [fine + (fine - coarse) / 3 for coarse, fine in pairwise(moved)]  # their errors fall with 1/pieces^2
    expected, unknown = halved[1], np.abs(halved[1] - halved[0])
    assert (np.abs(found - expected) <= np.abs(error * found) + unknown + 1e-12).all()
    assert (unknown < 2e-6 * np.linalg.norm(expected)).all()
    assert (error < 1e-5).all()
    in_uniform_drag = (case.group.in_mean_wind[0].position - case.group.without_wind.position)[0, 0]
    assert np.linalg.norm(in_uniform_drag - expected) > 1e-3 * np.linalg.norm(expected)


# --------------------------------------------------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        (["case=icy"], 'case: unknown case "icy" (did you mean ice?)'),
        (["case=3"], "case: expected text"),
        (["cases.storm.loads=[]"], "cases.storm.loads: expected a mapping of cable -> list of loads, got a list"),
        (["cases.storm.loads.e=[{at: 3, mass: 2}]"], "cases.storm.loads.e: unknown cable (allowed: a, b, c, d)"),
        (["cases.storm.loads.a=[{at: 78, mass: 2}]"], "78 m is not on the cable, which is 77 m long"),
        (["cases.storm.loads.a=[{at: 3, masss: 2}]"], "cases.storm.loads.a.0.masss: unknown key (did you mean mass?)"),
        (["cable.expansion=null"], "cable: missing key: expansion (case cold has a temperature)"),
        (["cables.a.reference.loads=3"], "cables.a.reference.loads: expected true or false, got 3"),
        (["cables.a.reference.load=true"], "cables.a.reference.load: unknown key (did you mean loads?)"),
        (["cables.a.loads=[{at: 80 m, mass: 3}]"], "80 m is not on the cable, which is 77 m long"),
        (["cable.loads=[{fraction: 1.5, mass: 3}]"], "cable.loads.0.fraction: must be between 0 and 1"),
        (["cables.a.loads=3"], "cables.a.loads: expected a list"),
        (["cables.a.tension={at: max, value: 1 TN}"], "cables.a.tension.value: 1e+12 N is"),
        (["cable.reference=3"], "cable.reference: expected a mapping with the keys temperature"),
        (["cases.storm=windy"], "cases.storm: expected a mapping"),
    ],
)
def test_each_mistake_is_one_clear_line(sets, message):
    """Of tables that scenes of one cable do not share; mistakes in those of both are in test_load_cases.py."""
    lines = mistakes_of(body(), *sets)
    assert any(message in text for text in lines), lines
    assert len(lines) <= 3


def test_what_a_case_needs_of_each_cable_is_told_once():
    section = "axial_stiffness: 1 MN, mass_per_length: 1 kg/m, unstretched_length: 77 m"
    lines = mistakes_of(BODY.replace(f"{SECTION}, STATED", section))
    assert len(lines) == len(set(lines)) <= 6
    assert any("missing key: diameter (case storm has wind or ice around the cable)" in line for line in lines)


def test_what_is_explained():
    lines = run("static", written(body()), "--set", "case=storm", "--explain", "--table", "bodies").lines
    assert "load case storm: on the unstretched lengths of the reference state; drag varies along each cable" in lines


# ----------------------------------------------------------------------------------------------------------- extremes


EXTREMES = [
    ["cases.cold.temperature=5000", "case=cold"],  # nearly 10 % longer
    ["cases.cold.temperature=60", "case=cold"],
    ["cases.ice.ice.thickness=1 m", "case=ice"],
    ["cases.ice.ice.thickness=0", "case=ice"],
    ["cases.heavy.ice.weight=1e7", "case=heavy"],
    ["cases.storm.wind.pressure=0", "case=storm"],
    ["cases.storm.wind.pressure=1e-300", "case=storm"],
    ["cases.storm.wind.pressure=1e7", "case=storm"],
    ["cases.storm.wind.direction=-360 deg", "case=storm"],
    ["gravity=0", "case=storm", "cable.unstretched_length=75"],
    ["cables.a.loads=[{at: 1e-6, mass: 1e9}]"],
    ["cables.a.loads=[{fraction: 0.5, mass: 1e-9}]", "case=ice"],
    ["cables.a.loads=[{fraction: 0.5, force: [0, 0, 1e5]}]", "case=storm"],
    ["cables.a.loads=[{at: 38.5, mass: 3}, {fraction: 0.5, mass: 3}]", "case=cold"],
    ["gravity=0", "case=heavy", "cable.unstretched_length=75"],
]
EXTREME_LOADS = [  # what is stated with the loads on, a load on a, and other changes
    ("preload: 20 kN", "at: 1e-6, mass: 1e9", ()),
    ("preload: 20 kN", "fraction: 0.5, mass: 1e-9", ()),
    ("preload: 20 kN", "fraction: 0.5, mass: 5000", ()),
    ("preload: 20 kN", "fraction: 0.5, mass: 3", ("gravity=0",)),
    ("preload: 5 N", "fraction: 0.5, mass: 3", ()),
    ("sag: 1 m", "at: 38.5, mass: 3}, {fraction: 0.5, mass: 3", ()),
    ("sag: 1 m", "fraction: 0.5, force: [0, 0, 1e5]", ()),
    ("", "at: 1e-6, mass: 1e9", ("solve_for=lengths",)),
]


def check_answer_or_reason(scene, *names):
    """Each number of a row is finite, or its status says in a line why there is none."""
    cells, status = row(scene, *names)
    assert "\n" not in status
    if status.startswith(("ok", "over strength")):
        assert np.isfinite(list(cells.values())).all()
    else:
        assert len(status) > 20


@pytest.mark.parametrize("sets", campaign(EXTREMES, EXTREMES[::2]))
def test_extremes_have_an_answer_or_a_reason(sets):
    columns = "gondola.z", "a.max_tension", "b.sag", "a.swing", "frequency_1"
    check_answer_or_reason(held(*sets, "ground=-40"), *columns)


@pytest.mark.parametrize(("stated", "load", "more"), campaign(EXTREME_LOADS, [EXTREME_LOADS[k] for k in (0, 3, 5, 7)]))
def test_extreme_loads_in_the_reference_state_have_an_answer_or_a_reason(stated, load, more):
    check_answer_or_reason(held(f"cables.a.loads=[{{{load}}}]", WITH_LOADS, *more, stated=stated), "gondola.z")


LONG_ONLY = r"in the reference state: a has its preload only at \d+ m, where a longer cable would be tauter"
BEYOND_END = r"a: the load at 90 m is beyond the cable's end, at 7\d\.\d+ m"


@pytest.mark.parametrize(
    ("stated", "more", "reason"),
    [
        ("preload: 20 kN", (), BEYOND_END),
        ("sag: 1 m", (WITH_LOADS,), BEYOND_END),
        ("preload: 20 kN", (WITH_LOADS,), LONG_ONLY),  # so long that its weight gives the preload: that is no answer
    ],
)
def test_a_load_beyond_the_end_that_is_found_is_told(stated, more, reason):
    _, status = row(held("cables.a.loads=[{at: 90 m, mass: 3}]", *more, stated=stated), "gondola.z")
    assert re.fullmatch(reason, status)


@pytest.mark.usefixtures("short_searches")
def test_a_sag_without_weight_has_no_answer():
    _, status = row(held("gravity=0", stated="sag: 14 m"), "gondola.z")
    assert status.startswith("no equilibrium: no lengths were found")


def test_stated_lengths_need_no_equilibrium_of_the_reference_state():
    """Cables without weight are slack there, and a load on one of them holds the knot in the case."""
    text = """\
gravity: 0
cable: {axial_stiffness: 1 MN, mass_per_length: 1 kg/m, diameter: 1 cm, unstretched_length: 60 m}
points: {knot: {at: [0, 0, 40], free: true, force: [0, 0, 0]}}
cables:
  left: {from: [-50, 0, 40], to: knot, loads: [{fraction: 0.5, force: [0, 0, -100]}]}
  right: {from: knot, to: [50, 0, 40], loads: [{fraction: 0.5, force: [0, 0, -100]}]}
"""
    found = numbers(scene_of(text), "left.tension_from", "right.tension_to", "left.reaction_1_vertical", "knot.x")
    assert found["left.reaction_1_vertical"] == pytest.approx(100, rel=1e-9)
    assert found["left.tension_from"] == pytest.approx(found["right.tension_to"], rel=1e-9)
    assert found["knot.x"] == pytest.approx(0, abs=1e-9)


def test_no_wind_and_no_change_are_the_reference():
    names = ("gondola.z", "a.max_tension", "b.sag")
    expected = numbers(held(), *names)
    for sets in (["case=storm", "cases.storm.wind.pressure=0"], ["case=none", "cases.none={}"],
                 ["case=cold", "cases.cold.temperature=15 degC"], ["case=ice", "cases.ice.ice.thickness=0",
                  "cases.ice.temperature=null"]):  # fmt: skip
        assert numbers(held(*sets), *names) == pytest.approx(expected, rel=1e-11), sets


def test_a_vertical_cable_in_each_case():
    """A mass on a plumb line: the tension above is its weight and that of the cable; wind moves it aside."""
    text = f"""\
cable: {{{SECTION}, unstretched_length: 50 m}}
{CASES}points: {{bob: {{at: [0, 0, -50], free: true, mass: 1000 kg}}}}
cables: {{line: {{from: [0, 0, 0], to: bob}}}}
"""
    for day, (change, ice, _, pressure, degrees) in DAYS.items():
        found = numbers(
            scene_of(text, f"case={day}"), "line.tension_from", "bob.x", "bob.y", "line.reaction_1_vertical"
        )
        warm = 1 + ALPHA * change
        weight = G * (1000 + (MASS / warm + ice) * 50 * warm)
        if not pressure:
            assert found["line.tension_from"] == pytest.approx(weight, rel=1e-10)
            assert found["line.reaction_1_vertical"] == pytest.approx(weight, rel=1e-10)
            assert found["bob.x"] == found["bob.y"] == 0
        else:
            assert math.degrees(math.atan2(found["bob.y"], found["bob.x"])) == pytest.approx(degrees, abs=1e-6)
            assert math.hypot(found["bob.x"], found["bob.y"]) > 0.5


def test_a_sweep_over_cases_and_numbers():
    """Cases as a key of a study, in groups: as alone. Clearances too, and the column is refused without ground."""
    scenes = [held(f"case={day}", f"bodies.gondola.mass={mass}", "ground=-12")
              for day in ("cold", "storm") for mass in (400, 800)]  # fmt: skip
    cases = cases_of(scenes)
    columns = [find("a.clearance"), find("gondola.z")]
    for one, case in zip(scenes, cases, strict=True):
        clearance = columns[0].compute(case)
        lowest = numbers(one, "a.lowest_point")["a.lowest_point"]
        assert clearance == pytest.approx(lowest + 12, abs=1e-9)
    _, status = row(scenes[0].model_copy(update={"ground": None}), "a.clearance")
    assert "a.clearance needs the key ground" in status


# ------------------------------------------------------------------------------------------- the shape in the wind

STRING = """\
gravity: 9.81
cable: {axial_stiffness: 2 MN, mass_per_length: 2 kg/m, diameter: 40 mm}
points:
  mast: [0, 0, 60 m]
  pole: [80 m, 30 m, 45 m]
  far: [-40 m, 55 m, 10 m]
  end: {at: [0, 10 m, 35 m], free: true, mass: 15 kg}
cables:
  string: {from: mast, to: end, unstretched_length: 25 m}
  span: {from: mast, to: pole, unstretched_length: 90 m}
  guy: {from: far, to: mast, preload: 3 kN}
  short: {from: pole, to: mast, unstretched_length: 85 m}
ground: 2 m
cases: {w: {wind: {speed: 25 m/s, direction: 70 deg}}}
case: w
"""
SHAPE = ("inclination", "inclination_from_plumb", "angle_1", "angle_2", "sag", "swing", "lowest_point", "clearance",
         "horizontal_tension", "reaction_1_vertical", "reaction_2_horizontal")  # fmt: skip


@pytest.mark.parametrize("name", ["string", "span", "guy", "short"])
def test_angles_and_places_of_a_cable_in_the_wind_are_those_of_its_shape(name):
    """Against the vertical of gravity, not against weight and wind together."""
    found = scene_of(STRING)
    columns = ("end.x", "end.y", "end.z", f"{name}.unstretched_length", *(f"{name}.{column}" for column in SHAPE))
    values = numbers(found, *columns)
    places = {point: found.points[point].at for point in ("mast", "pole", "far")}
    places["end"] = tuple(values[f"end.{axis}"] for axis in "xyz")
    begin, end = (np.array(places[at], dtype=float) for at in found.cables[name].ends)
    chord, load = end - begin, cable_in_wind.drag(1.2 * 0.04, lambda place: 375.0, math.radians(70), 2 * 9.81)
    start = SuspensionCase(found).rest.end_forces[list(found.cables).index(name), 0]
    length = values[f"{name}.unstretched_length"]
    place, force = cable_in_wind.solve(begin, end, 2e6, length, load, start, pieces=2000)
    level = np.hypot(force[:, 0], force[:, 1])
    expected = cable_in_wind.statics(place, force) | {
        "inclination": math.degrees(math.atan2(chord[2], np.linalg.norm(chord[:2]))),
        "inclination_from_plumb": math.degrees(math.acos(abs(chord[2]) / np.linalg.norm(chord))),
        "horizontal_tension": ((level[1:] + level[:-1]) / 2).mean(),
        "clearance": place[:, 2].min() - 2,
    }
    for column in SHAPE:
        loose = 1e-5 if column in ("lowest_point", "clearance", "sag", "swing", "horizontal_tension") else 1e-8
        assert values[f"{name}.{column}"] == pytest.approx(expected[column], rel=loose, abs=loose), column


def test_a_string_along_weight_and_wind_together_is_not_upright():
    """A weightless end: the string stands straight along its load, leaning, with a horizontal tension."""
    changes = ("cables={string: {from: mast, to: end, unstretched_length: 25 m}}", "points.end.mass=0",
               "cable.axial_stiffness=1e12", "cases.w.wind.speed=15 m/s")  # fmt: skip
    values = numbers(scene_of(STRING, *changes), "string.inclination_from_plumb", "string.horizontal_tension")
    angle = math.radians(values["string.inclination_from_plumb"])
    drag = 1.2 * 1.2 / 2 * 0.04 * 15**2 * math.cos(angle) ** 2  # across the string, per length
    assert drag == pytest.approx(2 * 9.81 * math.sin(angle), rel=1e-9)
    # of the load beyond: mean over the length, horizontal part
    assert values["string.horizontal_tension"] == pytest.approx(drag * math.cos(angle) * 12.5, rel=1e-6)


TWO_SPANS = """
cable: {material: acsr-drake}
points:
  arm: [300 m, 0, 2 m]
  clamp: {at: [300 m, 0, 0], free: true}
cables:
  left: {from: [0, 0, 0], to: clamp, unstretched_length: 300.3 m}
  right: {from: clamp, to: [500 m, 0, 0], unstretched_length: 200.1 m}
  insulator: {from: arm, to: clamp, material: null, axial_stiffness: 50 MN, mass_per_length: 30 kg/m, diameter: 250 mm,
              unstretched_length: 2 m}
cases:
  storm: {wind: {speed: 30 m/s, direction: 90 deg}}
"""


def test_an_insulator_between_two_spans_swings():
    """Moments about the arm of wind and weight of half of both spans, and of the insulator.

    The spans pull back, as their clamp is above and beside the line between the dead ends.
    """
    file = written(TWO_SPANS)
    spans, pressure = np.array([300.0, 200.0]), 1.2 * 1.2 / 2 * 30**2  # drag coefficient and density of the air
    weight, wind = G * 1.628 * spans.sum() / 2, pressure * 0.02814 * spans.sum() / 2
    clamp = table_of("static", file, "--case", "storm", "--table", "points")[0]
    cables = {row["name"]: row for row in table_of("static", file, "--case", "storm", "--table", "cables")}
    pull = sum(cables[name]["horizontal_tension_N"] / span for name, span in zip(("left", "right"), spans, strict=True))
    across, below = clamp["y_m"], 2 - clamp["z_m"]
    turning = (wind - pull * across) * below + pressure * 0.25 * below**2 / 2  # what is normal to the insulator
    assert turning == pytest.approx((weight + pull * clamp["z_m"] + G * 30) * across, rel=2e-3)
    assert cables["insulator"]["inclination_from_plumb_deg"] > 40
