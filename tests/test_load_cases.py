"""Load cases of one cable: temperature, ice, steady wind, loads by mass and by fraction, against the 50-digit catenary.

The expected cable is made here from the file's values: its length at the temperature, its mass with ice, and one vector
of weight and wind per length, along which the axes of the reference stand.
"""

import json
import math
import re

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, rows_of, run, study_file, table_of
from references import cable_in_wind, catenary_mp
from scenes import cells, mistakes_of, scene_of

from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate, evaluate_cases

LINE = """
cable:
  ends: [[0, 0, 20], [{x}, {y}, 28]]
  elastic_modulus: 70 GPa
  density: 3500
  diameter: 22 mm
  expansion: 19e-6 1/K
  strength: 300 MPa
  {stated}
  reference: {{temperature: 15 degC}}
cases:
  cold: {{temperature: -30 degC}}
  ice: {{temperature: -5 degC, ice: {{thickness: 10 mm}}}}
  heavy: {{ice: {{weight: 10 N/m}}}}
  storm: {{wind: {{pressure: 500 Pa, direction: 90 deg}}}}
  oblique: {{temperature: 268.15, ice: {{thickness: 5 mm, density: 700}}, wind: {{speed: 20 m/s, direction: 40 deg}}}}
  visitor: {{loads: [{{fraction: 0.25, mass: 80 kg}}, {{at: 200 m, force: [100, 50, -300]}}], wind: {{speed: 15 m/s}}}}
"""
pytestmark = pytest.mark.usefixtures("folder")

E, RHO, D, ALPHA, G = 70e9, 3500, 0.022, 19e-6, 9.81
AREA = math.pi * D**2 / 4
DAYS = {  # temperature change [K], ice [kg/m], thickness [m], pressure [Pa], direction [deg]
    "cold": (-45, 0.0, 0.0, 0.0, 0),
    "ice": (-20, 900 * math.pi * 0.010 * (D + 0.010), 0.010, 0.0, 0),
    "heavy": (0, 10 / G, 0.0, 0.0, 0),
    "storm": (0, 0.0, 0.0, 500.0, 90),
    "oblique": (-20, 700 * math.pi * 0.005 * (D + 0.005), 0.005, 0.6 * 20**2, 40),
    "visitor": (0, 0.0, 0.0, 0.6 * 15**2, 0),
}
TENSIONS = ("preload", "max_tension", "tension_1", "tension_2", "reaction_1_vertical", "reaction_2_horizontal", "sag")


def line(stated, *sets, x=300, y=0):
    """The scene of LINE with what the cable states, and changes; its file is s.yaml."""
    return scene_of(LINE.format(stated=stated, x=x, y=y), *sets)


def load_of(day, chord):
    """Growth of lengths by warmth [-], load per length [N/m], and axes whose last one is against that load, (3, 3)."""
    change, ice, thickness, pressure, degrees = DAYS[day]
    warm = 1 + ALPHA * change
    direction = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0])
    across = direction - chord * (direction @ chord) / (chord @ chord)
    drag = 1.2 * pressure * (D + 2 * thickness) * np.linalg.norm(across) * across
    upwards = np.array([0, 0, (RHO * AREA / warm + ice) * G]) - drag
    weight = np.linalg.norm(upwards)
    vertical = upwards / weight
    level = chord - (chord @ vertical) * vertical
    level /= np.linalg.norm(level)
    return warm, weight, np.array([level, np.cross(vertical, level), vertical])


def exact(day, length, x=300.0, y=0.0):
    """The cable of one day by the reference: tensions and reactions [N], sag halfway along the horizontal [m]."""
    chord = np.array([x, y, 8.0])
    warm, weight, axes = load_of(day, chord)
    loads = []
    if day == "visitor":
        loads = [(0.25 * length * warm, axes @ [0, 0, -80 * G]), (200 * warm, axes @ [100, 50, -300])]
    force = catenary_mp.solve_loaded(axes @ chord, length * warm, E * AREA, weight, loads)
    first = np.array([float(part) for part in force]) @ axes  # of the cable on what holds end 1
    total = -weight * length * warm * axes[2] + sum((load @ axes for _, load in loads), np.zeros(3))
    last = total - first
    # halfway along the horizontal, by bisection
    low, high = 0.0, length * warm
    for _ in range(60):
        middle = (low + high) / 2
        place = [
            float(part) for part in catenary_mp.shape_loaded(force, middle, length * warm, E * AREA, weight, loads)
        ]
        place = np.array(place) @ axes
        low, high = (middle, high) if place[:2] @ chord[:2] < (chord[:2] @ chord[:2]) / 2 else (low, middle)
    aside = (place[1] * x - place[0] * y) / math.hypot(x, y)
    mean = catenary_mp.mean_tension_loaded(force, length * warm, weight, loads)
    return {
        "preload": float(mean),
        "tension_1": np.linalg.norm(first),
        "tension_2": np.linalg.norm(last),
        "reaction_1_vertical": -first[2],
        "reaction_2_horizontal": math.hypot(*last[:2]),
        "angle_1": math.degrees(math.atan2(-first[2], math.hypot(*first[:2]))),
        "sag": 4.0 - place[2],
        "swing": math.degrees(math.atan2(abs(aside), 4.0 - place[2])),
    }


@pytest.mark.crossed
@pytest.mark.parametrize(("x", "y"), [(300, 0), (180, -240)])
@pytest.mark.parametrize("day", DAYS)
def test_each_case_is_the_catenary_with_its_weight_vector_and_length(day, x, y):
    expected, scene = exact(day, 301.0, x, y), line("unstretched_length: 301 m", f"case={day}", x=x, y=y)
    if DAYS[day][3]:  # in uniform drag, from which the search for the actual form begins
        uniform = CableCase(scene).results.catenary
        ends = np.linalg.norm(uniform.end_forces("global")[0], axis=-1)
        found = {"preload": uniform.mean_tension[0], "tension_1": ends[0], "tension_2": ends[1]}
    else:
        found = cells(scene, *expected)
    for name, value in found.items():
        assert value == pytest.approx(expected[name], rel=1e-10, abs=1e-9), name


def test_the_length_is_that_of_the_reference_state_in_every_case():
    """22 kN horizontally at 15 degC: the length by the reference, and with it the tensions of the cold day."""
    stated = "tension: {at: horizontal, value: 22 kN}"
    length = cells(line(stated), "unstretched_length")["unstretched_length"]
    h, _ = catenary_mp.solve(300, 8, length, E * AREA, RHO * AREA * G)
    assert float(h) == pytest.approx(22e3, rel=1e-10)
    cold = cells(line(stated, "case=cold"), "unstretched_length", "mass", "preload")
    assert cold["unstretched_length"] == length
    assert cold["mass"] == pytest.approx(RHO * AREA * length, rel=1e-14)
    assert cold["preload"] == pytest.approx(exact("cold", length)["preload"], rel=1e-10)


@pytest.mark.crossed
@pytest.mark.parametrize("at", ["end_1", "end_2", "horizontal", "mean", "max"])
@pytest.mark.parametrize("value", ["22 kN", "10 %"])
def test_a_tension_at_a_place_is_had_there(at, value):
    columns = {"end_1": "tension_1", "end_2": "tension_2", "horizontal": "horizontal_tension", "mean": "preload",
               "max": "max_tension"}  # fmt: skip
    wanted = 22e3 if value == "22 kN" else 0.1 * 300e6 * AREA
    found = cells(line(f"tension: {{at: {at}, value: {value}}}"), columns[at])
    assert found[columns[at]] == pytest.approx(wanted, rel=1e-11)


def test_a_tension_that_no_length_gives_is_told():
    vertical = line("tension: {at: end_1, value: 5 N}")
    status = evaluate(vertical, [find("sag")]).cells["status"]
    assert re.search(r"a tension at end 1 of 5 N is below the least that this cable can have: \d", status)


def test_the_reference_state_has_the_loads_only_where_it_says_so():
    loads = "cable.loads=[{fraction: 0.5, mass: 80 kg}]"
    bare, off, on = (
        cells(line("preload: 22 kN", *sets), "preload", "unstretched_length")
        for sets in ((), (loads,), (loads, "cable.reference.loads=true"))
    )
    assert off["unstretched_length"] == bare["unstretched_length"]
    assert off["preload"] > 1.01 * bare["preload"]
    assert on["preload"] == pytest.approx(22e3, rel=1e-11)
    assert on["unstretched_length"] > bare["unstretched_length"]


def test_the_published_zipline():
    """Steel of 12 mm, 200 m with a drop of 12 m, 15 kN bare: 80 kg pull 19.59 kN at 20 % and 21.38 kN at mid-span."""
    text = """\
cable: {ends: [[0, 0, 12], [200, 0, 0]], elastic_modulus: 210 GPa, density: 7800, diameter: 12 mm,
        preload: 15 kN, loads: [{fraction: 0.5, mass: 80 kg}]}
"""
    for fraction, tension in ((0.2, 19.59e3), (0.5, 21.38e3)):
        found = cells(scene_of(text, f"cable.loads.0.fraction={fraction}"), "max_tension")
        assert found["max_tension"] == pytest.approx(tension, abs=5)


def test_the_parabola_of_a_taut_travelling_load():
    """Nearly inextensible and light: the sag under a load P at x is P x (l - x)/(l H), statics of a string."""
    cable = "chord: 100 m, axial_stiffness: 1e9, mass_per_length: 1e-6, preload: 1e6"
    for fraction in (0.1, 0.5, 0.8):
        text = f"cable: {{{cable}, loads: [{{fraction: {fraction}, mass: 10 kg}}]}}\n"
        found = cells(scene_of(text), "deflection", "horizontal_tension")
        sag = 10 * G * 100 * fraction * (1 - fraction) / found["horizontal_tension"]
        assert found["deflection"] == pytest.approx(sag, rel=2e-6)


@pytest.mark.parametrize("fraction", [0.1, 0.35, 0.5, 0.9])
def test_the_sag_under_a_rider_is_that_of_the_50_digit_catenary(fraction):
    cable = "ends: [[0, 0, 12], [200, 0, 0]], axial_stiffness: 24e6, mass_per_length: 0.9, unstretched_length: 201"
    text = f"cable: {{{cable}, loads: [{{fraction: {fraction}, mass: 80 kg}}]}}\n"
    loads = [(fraction * 201, (0, 0, -80 * G))]
    force = catenary_mp.solve_loaded((200, 0, -12), 201, 24e6, 0.9 * G, loads)
    x, _, z = catenary_mp.shape_loaded(force, fraction * 201, 201, 24e6, 0.9 * G, loads)
    expected = float(-12 * x / 200 - z)
    for model in ("model={accuracy: 1e-4}", "model={elements: 20, order: 10}"):
        found = cells(scene_of(text, model), "load_sag")
        assert found["load_sag"] == pytest.approx(expected, rel=1e-10), model


def test_no_digit_of_a_case_in_the_wind_depends_on_the_other_rows():
    """The search for mid-span ends after different numbers of steps in each row."""
    line("unstretched_length: 301 m")
    lengths = "vary: [{cable.unstretched_length: [300.5 m, 301 m, 305 m, 320 m]}"
    cases = "{case: [cold, storm, oblique, visitor]}]\ncolumns: [sag, swing, max_tension]\n"
    study = study_file(".", f"{lengths}, {cases}", "s.yaml")
    together = table_of("sweep", study, "--no-write")
    alone = [table_of("sweep", study, "--row", row)[0] for row in range(1, 17)]
    assert together == alone


# --------------------------------------------------------------------------------------------- drag along the cable


@pytest.mark.crossed
@pytest.mark.parametrize("day", ["storm", "oblique"])
@pytest.mark.parametrize("length", [300.3, 303.0, 315.0])
def test_drag_changes_along_the_cable(day, length):
    """Truth: 400 pieces, each of which meets the wind in its own direction."""
    case = CableCase(line(f"unstretched_length: {length} m", f"case={day}"))
    change, ice, thickness, pressure, degrees = DAYS[day]
    warm = 1 + ALPHA * change
    weight = (RHO * AREA / warm + ice) * G
    load = cable_in_wind.drag(1.2 * (D + 2 * thickness), lambda place: pressure, math.radians(degrees), weight)
    ends, start = np.array([[0.0, 0.0, 20.0], [300.0, 0.0, 28.0]]), case.form.end_forces("global")[0]
    _, force = cable_in_wind.solve(*ends, E * AREA, length * warm, load, start)
    tension = np.linalg.norm(force, axis=1)
    elements = CableCase(line(f"unstretched_length: {length} m", f"case={day}", "model={elements: 24, order: 6}"))
    for name, truth, close in (
        ("mean_tension", np.trapezoid(tension) / 400, 5e-5),
        ("max_tension", tension.max(), 1e-4),
    ):
        assert getattr(case.statics, name) == pytest.approx(truth, rel=1e-5), name
        assert getattr(elements.statics, name) == pytest.approx(truth, rel=close), name


# ------------------------------------------------------------------------------------------------------ bad input


@pytest.mark.parametrize(
    ("sets", "message"),
    [
        (["case=icy"], 'case: unknown case "icy" (did you mean ice?)'),
        (["cases.cold.temperature=25"], "must be from 60 K to 5000 K (a bare number is K: write 15 degC), got 25"),
        (["cases.cold.temperature=5 m"], "expected a temperature in K"),
        (["cases.ice.ice.weight=3", "cases.ice.ice.thickness=1 mm"], "given together with"),
        (["cases.ice.ice.thickness=-1 mm"], "must not be negative"),
        (["cases.ice.ice={density: 900}"], "missing key: thickness (density goes with it)"),
        (["cases.ice.ice={}"], "missing key: one of thickness, weight"),
        (["cases.storm.wind.speed=10", "cases.storm.wind.pressure=3"], "given together with"),
        (["cases.storm.wind={direction: 3}"], "missing key: one of speed, pressure"),
        (["cases.storm.wind.direction=400 deg"], "must be from -360 deg to 360 deg"),
        (["cases.storm.wind.gust=3"], "cases.storm.wind.gust: unknown key"),
        (["cable.loads=[{fraction: 0.5}]"], "missing key: force, mass, or both"),
        (["cable.loads=[{fraction: 1.5, mass: 3}]"], "must be between 0 and 1"),
        (["cable.loads=[{fraction: 0.5, at: 3 m, mass: 3}]"], "given together with"),
        (["cable.loads=[{mass: 3}]"], "missing key: one of at, fraction"),
        (["cable.loads=[{fraction: 0.5, mass: -3}]"], "must be positive"),
        (["cases.cold.loads=[{at: 400 m, mass: 3}]"], "400 m is not on the cable, which is 301 m long"),
        (["cable.tension={at: middle, value: 3}"], "got \"middle\""),
        (["cable.tension={value: 3}"], "missing key: at"),
        (["cable.reference.loads=1"], "expected true or false"),
        (["cable.reference.temperature=-300 degC"], "must be from 60 K to 5000 K"),
        (["cable.expansion=null"], "missing key: expansion (case cold has a temperature)"),
        (["ground=[[0, 0]]"], "expected at least 2 items, got 1"),
        (["ground=[[0, 0], [0, 1]]"], "the x of its points must ascend"),
        (["ground=deep"], "expected a length"),
        (["cases=3"], "expected a mapping"),
    ],
)  # fmt: skip
def test_each_mistake_is_one_clear_line(sets, message):
    lines = mistakes_of(LINE.format(stated="unstretched_length: 301 m", x=300, y=0), *sets)
    assert any(message in text for text in lines), lines
    assert len(lines) <= 3


@pytest.mark.parametrize(
    ("ground", "messages"),
    [
        ("[0, 0]", ["ground.0: expected a list, got 0", "ground.1: expected a list, got 0"]),
        ("[[0, 0, 1], [1, 2]]", ["ground.0: expected at most 2 items, got 3"]),
    ],
)
def test_items_that_are_wrong_are_not_told_as_too_few(ground, messages):
    lines = mistakes_of("cable: {chord: 9, material: steel, diameter: 5 mm, sag: 1}\n", f"ground={ground}")
    assert lines == [f"--set ground: {message}" for message in messages]


@pytest.mark.parametrize(("x", "y"), campaign([(300, 0), (183.17, -97.73)], [(183.17, -97.73)]))
def test_rows_of_many_cases_are_those_of_each_alone_to_the_last_digit(x, y):
    names = (*TENSIONS, "swing", "lowest_point", "horizontal_tension", "unstretched_length", "angle_1",
             "end_stiffness", "end_stiffness_xz")  # fmt: skip
    columns = [find(name) for name in names]
    states = ("unstretched_length: 301 m", "preload: 20 kN", "sag: 8 m", "tension: {at: max, value: 25 kN}")
    for days in (DAYS, [day for day in DAYS if day != "visitor"]):
        scenes = [line(stated, f"case={day}", x=x, y=y) for day in days for stated in states]
        for model, row in zip(scenes, evaluate_cases(scenes, columns), strict=True):
            assert row.cells == evaluate(model, columns).cells


def test_motion_of_a_level_cable_in_a_cross_wind_is_that_under_its_inclined_load():
    """Weight and wind together are a larger gravity in a plane turned about the chord: modes and gondola as there.

    The cable is so taut and stiff that the drag changes by 1e-5 along it.
    """
    text = """\
cable: {chord: 200 m, elastic_modulus: 100 TPa, density: 7000, diameter: 20 mm, unstretched_length: 200.005 m,
        damping: {time: 1 ms}}
gondola: {mass: 50 kg}
cases: {storm: {wind: {pressure: 400 Pa, direction: 90 deg}, ice: {weight: 5 N/m}}}
"""
    names = ("cable_frequency", "inplane_frequency_3", "outofplane_frequency_2", "gondola_frequency",
             "gondola_damping_ratio")  # fmt: skip
    area = math.pi * 0.02**2 / 4
    mass = 7000 * area + 5 / G
    gravity = math.hypot(mass * G, 1.2 * 400 * 0.02) / mass
    windy = cells(scene_of(text, "case=storm"), *names)
    calm = cells(scene_of(text, f"gravity={gravity!r}", f"cable.density={mass / area!r}"), *names)
    for name in names:
        assert windy[name] == pytest.approx(calm[name], rel=1e-5), name


def test_a_load_case_in_the_name_of_a_column_is_told_apart_from_a_body():
    study = study_file(".", "columns: [sag, cold.sag, hail.sag]\n", base=CONFIGS / "line.yaml")
    assert run("sweep", study, code=2).lines == [
        f"{study}:2:16: columns.1: cold is a load case: --case cold, or vary: [{{case: [cold]}}], has the column sag",
        f"{study}:2:26: columns.2: no body, free point, cable or link hail (allowed: cable)",
    ]


def test_the_note_on_point_loads_says_how_to_silence_it():
    (note,) = run("static", CONFIGS / "zipline.yaml", "--set", "cable.reference=null").lines
    assert note == (
        "note: cable.preload is that of the cable without its point loads; cable.reference.loads: true states it with "
        "them, and false silences this note"
    )
    assert not run("static", CONFIGS / "zipline.yaml").lines


@pytest.mark.parametrize("name", ["=1+1", "-20", "+5", "@home", "a.b", "a, b", "a=b", " a", "a ", "<b>"])
def test_names_that_options_or_spreadsheets_take_for_something_else_are_refused(name):
    refused = study_file(".", f"cases:\n  {json.dumps(name)}: {{temperature: 10 degC}}\n")
    rule = "a name of a load case begins with a letter or a digit and has no dot, comma or =, got"
    assert run("static", refused, code=2).lines == [f'{refused}:3:3: cases.{name}: {rule} "{name}"']


def test_a_case_named_all_is_refused_since_the_option_means_each_of_them():
    refused = study_file(".", "cases: {all: {temperature: 10 degC}}\n")
    message = "cases.all: a name of a load case is not all, which stands for each of them (--case all)"
    assert run("static", refused, code=2).lines == [f"{refused}:2:9: {message}"]


@pytest.mark.parametrize("name", ["ice & wind", "50 years", "Sturm (Süd)", "寒い日", "5 degC"])
def test_names_in_any_script_and_with_blanks_can_be_used_everywhere(name):
    day = study_file(".", f"cable: {{expansion: 1e-5}}\ncases: {{{name}: {{temperature: 10 degC}}}}\n")
    moved = ("--set", f"cases.{name}.temperature=40 degC")
    assert table_of("static", day, "--case", name, *moved)[0]["sag_m"] > table_of("static", day)[0]["sag_m"]
    rows = rows_of(run("static", day, "--case", "all", "--format", "csv", "--columns", "sag").out, "csv")
    assert [row["case"] for row in rows] == [name]


def test_a_material_whose_name_is_a_formula_is_refused():
    refused = study_file(".", "materials: {=1+1: {density: 1440, elastic_modulus: 70 GPa}}\n")
    message = 'materials.=1+1: a name of a material begins with a letter or a digit, got "=1+1"'
    assert run("static", refused, code=2).lines == [f"{refused}:2:13: {message}"]


def test_a_line_on_several_load_cases_is_told_once():
    cases = "{dry: {}, wet: {loads: [{at: 30 m, mass: 5 kg}]}, storm: {loads: [{at: 10 m, mass: 50 kg}]}}"
    path = study_file(".", f"cable: {{reference: null}}\ncases: {cases}\n", CONFIGS / "zipline.yaml")
    alone = [run("static", path, "--case", case).lines for case in ("dry", "wet", "storm")]
    (note,) = alone[0]
    assert note.startswith("note: cable.preload is that of the cable without its point loads")
    assert alone == [[note]] * 3
    assert run("static", path, "--case", "all").lines == [f"cases dry, wet, storm: {note}"]
