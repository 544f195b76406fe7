"""The commands static, modes and sweep on suspensions: tables, columns by path, and what is said of wrong input."""

import csv
import json
import math

import numpy as np
import pytest
from command import CONFIGS, ROOT, refusal, rows_of, run, study_file, table_of, written
from scenes import scene_of
from solved import contents, solve
from suspension_cases import SUSPENSIONS
from twins import end_places, held

import cablestudy
from cablestudy.study.markdown import fitted
from cablestudy.study.suspension.case import SuspensionCase

pytestmark = pytest.mark.usefixtures("folder")

# A trifilar pendulum whose wires, of EA = 1 MN and without mass to speak of, are H long under its weight.
MASS, RADIUS, H, EA, G = 30.0, 0.4, 4.0, 1e6, 9.81
YAW_INERTIA, TILT_INERTIA = 3.5, 2.0
LENGTH = H / (1 + MASS * G / 3 / EA)
PLACES = [(RADIUS * math.cos(angle), RADIUS * math.sin(angle)) for angle in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)]
TRIFILAR = f"""\
cable: {{elastic_modulus: 1 GPa, diameter: {2e3 * math.sqrt(EA / 1e9 / math.pi)!r} mm, density: 1e-6,
        damping: {{model: modal, ratio: 0.01}}, unstretched_length: {LENGTH!r} m}}
points:
{"".join(f"  top{i}: [{x!r}, {y!r}, {H}]{chr(10)}" for i, (x, y) in enumerate(PLACES, 1))}\
bodies:
  disc:
    at: [0, 0, 0]
    mass: {MASS} kg
    inertia: [{TILT_INERTIA}, {TILT_INERTIA}, {YAW_INERTIA}]
    attachments: {{{", ".join(f"a{i}: [{x!r}, {y!r}, 0]" for i, (x, y) in enumerate(PLACES, 1))}}}
cables: {{w1: {{from: top1, to: disc.a1}}, w2: {{from: top2, to: disc.a2}}, w3: {{from: top3, to: disc.a3}}}}
"""
HEAVE = 3 * EA / LENGTH  # N/m
STIFFNESS = [MASS * G / H, MASS * G / H, HEAVE, HEAVE * RADIUS**2 / 2, HEAVE * RADIUS**2 / 2, MASS * G * RADIUS**2 / H]
INERTIA = [MASS, MASS, MASS, TILT_INERTIA, TILT_INERTIA, YAW_INERTIA]
FREQUENCIES = sorted(math.sqrt(k / m) / (2 * math.pi) for k, m in zip(STIFFNESS, INERTIA, strict=True))

# A knot of 2 kg on two lines: held in the plane x-z by tension alone along y.
KNOT = """\
cable: {elastic_modulus: 1 GPa, area: 100 mm^2, density: 1400 kg/m^3, unstretched_length: 2.4 m}
points: {left: [-2, 0, 2], right: [2, 0, 2], knot: {at: [0.3, 0, 1], free: true, mass: 2 kg}}
cables: {a: {from: left, to: knot}, b: {from: right, to: knot}}
"""

# A gondola on two cables, one up and one down, at its attachment; it may roll, and its center of mass is above that.
TOPPLES = """\
cable: {elastic_modulus: 1 GPa, area: 1000 mm^2, density: 1e-6, preload: 100 N}
bodies:
  gondola:
    at: [0, 0, 5]
    mass: 1 kg
    inertia: [1, 1, 1]
    center_of_mass: [0, 0, 30 m]
    attachments: {a: [0, 0, 0]}
    free: [roll]
cables: {up: {from: [0, 0, 10], to: gondola.a}, down: {from: [0, 0, 0], to: gondola.a}}
"""


def scene(text=TRIFILAR):
    """A scene in the working directory; its name."""
    return written(text)


def study(text, base=TRIFILAR):
    """A study in the working directory on a scene given as text; its name."""
    return study_file(".", text, base=scene(base))


# ------------------------------------------------------------------------------------------------------------ static


def test_static_prints_all_tables_as_one_object():
    tables = json.loads(run("static", scene(), "--format", "json").out)
    assert list(tables) == ["bodies", "points", "cables", "stiffness"]
    assert all({"columns", "rows"} <= table.keys() for table in tables.values())
    assert tables["points"]["rows"] == []
    (disc,) = tables["bodies"]["rows"]
    assert disc.pop("name") == "disc"
    assert list(disc.values()) == [0.0] * 6  # rounding is shown as zero
    assert tables["cables"]["columns"]["tension_to_N"] == "N"
    for cable in tables["cables"]["rows"]:
        assert cable["tension_to_N"] == pytest.approx(MASS * G / 3, rel=1e-9)
        assert cable["tension_from_N"] == pytest.approx(MASS * G / 3, rel=1e-9)
        assert cable["inclination_deg"] == pytest.approx(-90, abs=1e-9)
    matrix = [[row[axis] for axis in ("x", "y", "z", "rx", "ry", "rz")] for row in tables["stiffness"]["rows"]]
    np.testing.assert_allclose(matrix, np.diag(STIFFNESS), rtol=1e-8, atol=1e-9)


def test_static_in_markdown_leaves_out_empty_tables():
    out = run("static", scene()).out
    assert [line for line in out.splitlines() if line.startswith("#")] == ["## bodies", "## cables", "## stiffness"]
    assert [line for line in run("static", scene(KNOT)).out.splitlines() if line.startswith("#")] == [
        "## points",
        "## cables",
    ]


@pytest.mark.parametrize(
    ("table", "names", "header"),
    [
        ("bodies", ["disc"], ["name", "x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"]),
        ("points", [], ["name", "x_m", "y_m", "z_m"]),
        ("cables", ["w1", "w2", "w3"], None),
        ("stiffness", ["disc"] * 6, ["body", "row", "x", "y", "z", "rx", "ry", "rz"]),
    ],
)
def test_one_table_in_every_format(table, names, header):
    texts = {
        style: run("static", scene(), "--table", table, "--format", style).out for style in ("csv", "json", "jsonl")
    }
    (first, *lines) = csv.reader(texts["csv"].splitlines())
    assert first == header or (header is None and {"name", "preload_N", "sag_m", "tension_from_N"} <= set(first))
    assert [line[0] for line in lines] == names
    assert rows_of(texts["json"], "json") == rows_of(texts["jsonl"], "jsonl") == rows_of(texts["csv"], "csv")
    markdown = run("static", scene(), "--table", table).out.splitlines()
    assert len(markdown) == 2 + len(names)


@pytest.mark.parametrize("style", ["csv", "jsonl"])
def test_a_format_of_one_table_needs_its_name(style):
    outcome = run("static", scene(), "--format", style, code=2)
    assert outcome.err == f"--format {style}: one table at a time: give --table bodies, points, cables, stiffness\n"
    assert outcome.out == ""


def test_options_of_one_cable_and_of_suspensions():
    alone = "--table: no effect: --shape has the coordinates alone\n"
    assert run("static", scene(), "--shape", "--table", "cables", code=2).err == alone
    carlina = CONFIGS / "carlina.yaml"
    assert run("static", carlina, "--table", "cables", code=2).err == "--table: no effect: the scene has one cable\n"
    assert refusal("modes", carlina, "--cable", "n1") == "--cable n1: no such cable (allowed: cable)"
    both = "--cable: no effect: --coupled has the modes of cable and gondola together"
    assert refusal("modes", carlina, "--cable", "cable", "--coupled") == both
    assert "bodies" in run("static", scene(), "--table", "lines", code=2).err


@pytest.mark.parametrize(
    ("options", "of_suspension"),
    [
        (("modes", "carlina.yaml", "-n", "3"), ("--cable", "cable")),
        (("static", "point-load.yaml", "--locus", "load1:3"), ("--locus", "cable.load1:3")),
        (("loop", "carlina-pid.yaml", "--time", "1s:3"), ("--input", "winch.cable", "--output", "gondola.x")),
        (("loop", "carlina-pid.yaml", "--time", "1s:3", "--input", "reference"), ("--input", "reference.x")),
    ],
)
def test_one_cable_takes_the_names_that_its_parts_have_in_a_suspension(options, of_suspension):
    command, name, *own = options
    others = own[:-2] if own[-2] == of_suspension[0] else own
    path = CONFIGS / name
    assert table_of(command, path, *others, *of_suspension) == table_of(command, path, *own)


@pytest.mark.parametrize("name", ["guy", "zipline", "slack"])
def test_the_shape_of_a_cable_is_that_of_its_twin_of_one_cable(name):
    """Held against a scene of one cable, whose shape tests hold against the catenary in 50 digits."""
    one = contents(CONFIGS / f"{name}.yaml") | {"model": {}}
    expected, found = cablestudy.load(one).shape(), cablestudy.load(held(one)).shape()
    assert found["cable"].unique().tolist() == ["cable"]
    # with loads one cable has a row at each node of its elements: ends and loads are in both
    apart = np.abs(np.subtract.outer(found["s_m"].to_numpy(), expected["s_m"].to_numpy()))
    own, other = np.nonzero(apart < 1e-9)
    assert len(own) == (5 if name == "zipline" else len(found))
    for header in ("x_m", "y_m", "z_m", "tension_N"):
        size = np.abs(expected[header]).max()
        assert found[header].to_numpy()[own] == pytest.approx(expected[header].to_numpy()[other], abs=1e-9 * size)
    ends = found.iloc[[0, -1]][["x_m", "y_m", "z_m"]].to_numpy()
    assert ends == pytest.approx(np.array(end_places(one["cable"])), abs=1e-9)


@pytest.mark.parametrize("model", [{"accuracy": 1e-6}, {"elements": 12}])
def test_modes_of_one_cable_by_type_and_symmetry(model, folder):
    """Those of a scene of that cable alone, in the picture too; errors are those that are stated there."""
    one = contents(CONFIGS / "guy.yaml") | {"model": model}
    expected, found = (
        cablestudy.load(scene).compute("modes", count=9, **more)
        for scene, more in ((one, {"estimate": True}), (held(one), {"cable": "cable"}))
    )
    for row, other in zip(found.table.rows, expected.table.rows, strict=True):
        assert (row["number"], row["type"], row["symmetry"]) == (other["number"], other["type"], other["symmetry"])
        assert row["frequency_Hz"] == pytest.approx(other["frequency_Hz"], rel=1e-9)
    stated, known = ([row["frequency_Hz"] for row in one.table.errors()] for one in (found, expected))
    assert stated == pytest.approx(known, rel=1e-3, abs=1e-11)
    frame = cablestudy.load(held(one)).modes(9, cable="cable")
    assert frame["type"].tolist() == [row["type"] for row in expected.table.rows]


def test_modes_of_one_cable_of_a_suspension(folder):
    """The taut string n/2L sqrt(T/m), numbers of all commands alike, a picture, and a name that does not exist."""
    trifilar = SUSPENSIONS / "trifilar.yaml"
    found = rows_of(run("modes", trifilar, "--cable", "w2", "--upto", "40 Hz", "--format", "csv").out, "csv")
    assert sorted(row["type"] for row in found) == ["in-plane"] * 2 + ["out-of-plane"] * 2
    mass = np.pi / 4 * 1e-6 * 7850
    string = np.sqrt(30 * 9.81 / 3 / mass) / (2 * 4.0)
    assert [row["frequency_Hz"] for row in found] == pytest.approx([string, string, 2 * string, 2 * string], rel=2e-3)
    run("modes", trifilar, "--cable", "w2", "--plot", "modes.svg")
    assert (folder / "modes.svg").stat().st_size > 1000
    wrong = run("modes", trifilar, "--cable", "w4", code=2)
    assert wrong.err == "--cable w4: no such cable (allowed: w1, w2, w3)\n"


def test_a_knot_on_two_lines_is_where_statics_by_hand_puts_it():
    (row,) = table_of("static", scene(KNOT), "--table", "points")
    # EA = 1e5 N: a half of the weight of knot and lines on each line of tension T at an angle below the horizontal;
    # the sag of the lines shortens their chord by less than (w d/T)^2/24
    chord, weight, lines = 2.4, 2 * G, 2.4 * 1400 * 1e-4 * G
    for _ in range(50):
        sine = math.sqrt(chord**2 - 4) / chord
        tension = (weight + lines) / 2 / sine
        chord = 2.4 * (1 + tension / 1e5)
    assert row["x_m"] == pytest.approx(0, abs=1e-9)
    assert row["z_m"] == pytest.approx(2 - math.sqrt(chord**2 - 4), abs=chord * (lines / tension) ** 2 / 24 * 2)


@pytest.mark.parametrize("command", ["static", "modes"])
def test_what_nothing_holds_has_no_answer_and_its_motion_is_named(command):
    """All cables are at one attachment, at the center of mass: the gondola may turn about it as it likes."""
    outcome = run(command, scene(TOPPLES.replace("30 m", "0")), code=3)
    assert (outcome.err, outcome.out) == ("scene.yaml: nothing holds gondola roll\n", "")


# ------------------------------------------------------------------------------------------------------------- modes


def test_modes_of_a_trifilar_pendulum():
    rows = table_of("modes", scene(), "-n", "6")
    np.testing.assert_allclose([row["frequency_Hz"] for row in rows], FREQUENCIES, rtol=1e-8)
    assert [row["moves"] for row in rows[2:4]] == ["disc yaw", "disc z"]
    assert {row["moves"] for row in rows[:2]} <= {"disc x", "disc y"}
    assert [row["number"] for row in rows] == [1, 2, 3, 4, 5, 6]
    assert all(row["body_share"] == pytest.approx(1, abs=1e-9) for row in rows)


def test_modes_up_to_a_frequency():
    rows = table_of("modes", scene(), "--upto", "1 Hz")
    np.testing.assert_allclose([row["frequency_Hz"] for row in rows], FREQUENCIES[:3], rtol=1e-8)
    assert table_of("modes", scene(), "--upto", "1 mHz") == []
    assert run("modes", scene(), "-n", "3", "--upto", "1 Hz", code=2).err == "-n and --upto exclude each other\n"


def test_coincident_modes_are_told():
    lines = run("modes", scene(), "-n", "6", "--explain").lines
    assert [line for line in lines if "coincide" in line] == [
        "modes 1 to 2 coincide: their motions may be combined at will",
        "modes 5 to 6 coincide: their motions may be combined at will",
    ]
    none = [line.partition(": no modes: its first one, at ") for line in lines if "no modes" in line]
    assert sorted(", ".join(names for names, _, _ in none).split(", ")) == ["w1", "w2", "w3"]
    first = math.sqrt(MASS * G / 3 / (1e-6 * EA / 1e9)) / (2 * H)  # of a string: far above the body's
    assert {text.split()[0] for _, _, text in none} == {f"{first:.4g}"}


def test_estimated_errors_of_modes():
    def errors(*options):
        return json.loads(run("modes", scene(), "-n", "3", "--format", "json", *options).out)["errors"]

    assert [row.keys() for row in errors()] == [{"frequency_Hz"}] * 3  # modal damping states none of its own
    hysteretic = "cable.damping={model: hysteretic, loss_factor: 0.02}"
    assert [row.keys() for row in errors("--set", hysteretic)] == [{"frequency_Hz", "damping_ratio"}] * 3
    one = json.loads(run("modes", scene(), "--upto", "0.26 Hz", "--format", "json").out)
    assert len(one["errors"]) == len(one["rows"]) == 2
    below_all = ("--set", "model={elements: 3}", "--upto", "1e-6 Hz", "--format", "json")
    none = json.loads(run("modes", scene(), *below_all, "--explain").out)
    assert (none["errors"], none["rows"]) == ([], [])


# A string of 20 m without weight, of two cables with almost nothing between them.
STRING = """\
gravity: 0
cable: {elastic_modulus: 70 GPa, area: 1 mm^2, density: 1440, preload: 100 N,
        damping: {model: hysteretic, loss_factor: 0.02}}
points: {left: [-10, 0, 0], right: [10, 0, 0], knot: {at: [0, 0, 0], free: true, mass: 1e-12}}
cables: {a: {from: left, to: knot}, b: {from: knot, to: right}}
"""


@pytest.mark.parametrize("elements", [5, 20])
def test_stated_errors_of_bars(elements):
    """Of 2 n lumped bars along a string: sin(x)/x of x = k pi/(4 n)."""
    sets = ("--set", f"model={{elements: {elements}}}")
    true = [1 - math.sin(x) / x for x in (k * math.pi / (4 * elements) for k in (1, 1, 2, 2))]
    answer = json.loads(run("modes", scene(STRING), "-n", 4, *sets, "--format", "json").out)
    stated = [errors["frequency_Hz"] for errors in answer["errors"]]
    assert all(error / 1.2 < own < 1.2 * error for own, error in zip(stated, true, strict=True))
    said = f"motion: estimated error {stated[3]:.1e}, of mode "
    for command in (("modes", "-n", 4), ("ssm", "--modes", 4, "--input", "knot.force_y", "--response", "1Hz:2Hz:3")):
        lines = run(command[0], scene(STRING), *command[1:], *sets, "--explain").lines
        assert [line.startswith(said) for line in lines].count(True) == 1
    text = f"columns: [frequency_1, frequency_3, error_estimate]\nset: {{model: {{elements: {elements}}}}}\n"
    answer = json.loads(run("sweep", study(text, STRING), "--no-write", "--format", "json").out)
    (row,), (errors,) = answer["rows"], answer["errors"]
    assert (errors["frequency_1_Hz"], errors["frequency_3_Hz"]) == pytest.approx((true[0], true[2]), rel=0.2)
    assert row["error_estimate"] == max(errors.values())
    # nobody asks: nothing is compared
    silent = json.loads(run("static", scene(STRING), *sets, "--table", "cables", "--format", "json").out)["errors"]
    assert max(max(errors.values()) for errors in silent) < 1e-9  # statics are closed forms


def test_a_winch_without_any_cable():
    text = KNOT.partition("cables:")[0] + "cables: {}\nwinches: {a: {}}\n"
    lines = run("static", scene(text), code=2).lines
    assert "scene.yaml:4:11: winches.a: unknown cable (there is none)" in lines


def test_notes_count_what_there_is():
    lines = run("static", scene(KNOT), "--explain").lines
    assert lines[0].startswith("statics: 2 cables in closed form, 3 free displacements; ")
    lines = run(
        "static", scene(KNOT), "--explain", "--set", "points.knot.free=null", "--set", "points.knot.mass=null"
    ).lines
    assert lines == [
        "statics: 2 cables in closed form, 0 free displacements; 0 Newton steps, net force below 1e-11 of the forces",
        "slack: b",
    ]


# ------------------------------------------------------------------------------------------------------------- sweep

COLUMNS = (
    "[disc.z, disc.yaw, disc.mass, disc.stiffness_xx, disc.stiffness_rzrz, w1.preload, w2.sag, w3.tension_to, "
    "max_tension, cable_mass, frequency_1, frequency_4, disc.frequency_3, disc.frequency_static_1]"
)
MASSES = "vary: [{bodies.disc.mass: [30 kg, 20 kg, 45 kg]}]\n"


def test_cells_of_a_sweep_are_those_of_static_and_modes():
    name = study(f"{MASSES}columns: {COLUMNS}\n")
    rows = table_of("sweep", name, "--no-write")
    for row, mass in zip(rows, (30.0, 20.0, 45.0), strict=True):
        changed = ("--set", f"bodies.disc.mass={mass} kg")
        (disc,) = table_of("static", "scene.yaml", *changed, "--table", "bodies")
        cables = table_of("static", "scene.yaml", *changed, "--table", "cables")
        stiffness = table_of("static", "scene.yaml", *changed, "--table", "stiffness")
        modes = [mode["frequency_Hz"] for mode in table_of("modes", "scene.yaml", *changed)]
        assert row["status"] == "ok"
        assert (row["disc.mass_kg"], row["disc.z_m"], row["disc.yaw_deg"]) == (mass, disc["z_m"], disc["yaw_deg"])
        assert row["disc.stiffness_xx_N_per_m"] == stiffness[0]["x"]
        assert row["disc.stiffness_rzrz_Nm_per_rad"] == stiffness[5]["rz"]
        assert row["w1.preload_N"] == cables[0]["preload_N"]
        assert row["w2.sag_m"] == cables[1]["sag_m"]
        assert row["w3.tension_to_N"] == cables[2]["tension_to_N"]
        assert row["max_tension_N"] == max(cable["max_tension_N"] for cable in cables)
        assert row["cable_mass_kg"] == pytest.approx(sum(cable["mass_kg"] for cable in cables), rel=1e-14)
        np.testing.assert_allclose([row["frequency_1_Hz"], row["frequency_4_Hz"]], [modes[0], modes[3]], rtol=1e-9)
        assert row["disc.frequency_3_Hz"] == pytest.approx(modes[2], rel=1e-9)


def test_static_frequencies_count_a_third_of_the_cables():
    # wires of 0.5 kg each: sway and yaw by the mean tension, since a heavy wire is stiffer at its top than at its end
    heavy = TRIFILAR.replace("density: 1e-6", f"density: {0.5 / (EA / 1e9 * LENGTH)!r}")
    text = "vary: [{gravity: [9.81]}]\ncolumns: [disc.frequency_static_1, disc.stiffness_xx, disc.frequency_static_4]\n"
    (row,) = table_of("sweep", study(text, heavy), "--no-write")
    expected = math.sqrt(row["disc.stiffness_xx_N_per_m"] / (MASS + 0.5)) / (2 * math.pi)
    assert row["disc.frequency_static_1_Hz"] == pytest.approx(expected, rel=1e-9)
    assert row["disc.stiffness_xx_N_per_m"] == pytest.approx((MASS + 1.5 / 2) * G / H, rel=1e-3)
    assert row["disc.frequency_static_4_Hz"] == pytest.approx(math.sqrt(HEAVE / (MASS + 0.5)) / (2 * math.pi), rel=1e-4)


def test_json_states_the_error_of_each_cell():
    name = study(f"{MASSES}columns: [disc.mass, disc.z, frequency_1]\n")
    answer = json.loads(run("sweep", name, "--no-write", "--format", "json").out)
    assert len(answer["errors"]) == 3
    for row, errors in zip(answer["rows"], answer["errors"], strict=True):
        assert errors.get("disc.mass_kg", 0.0) == 0.0  # as the file states it
        assert errors["frequency_1_Hz"] <= 1e-4  # the accuracy of a scene that asks for none
        mass = row["disc.mass_kg"]
        height = LENGTH * (1 + mass * G / 3 / EA)
        squared = min(G / height, mass * G * RADIUS**2 / (YAW_INERTIA * height))
        assert row["frequency_1_Hz"] == pytest.approx(
            math.sqrt(squared) / (2 * math.pi), rel=errors["frequency_1_Hz"] + 1e-8
        )


def test_cables_over_their_strength_are_named():
    """A third of the weight in each wire of 1000 mm^2: 98.1 kPa."""
    held = scene(TRIFILAR.replace("to: disc.a2}", "to: disc.a2, strength: 98 kPa}"))
    said = "warning: the stress is above the strength: w2 (utilisation 1.001)"
    for options in (("static",), ("modes", "-n", 3), ("ssm", "--modes", 3, "--input", "disc.force_x", "--response",
                    "0.1Hz:1Hz:5"), ("trade", "--columns", "max_tension", "--repeats", 1)):  # fmt: skip
        outcome = run(options[0], held, *options[1:])
        assert outcome.lines.count(said) == 1, options
        assert outcome.out
    study_file(".", "vary: [{cables.w1.strength: [99 kPa, 97 kPa]}]\ncolumns: [max_utilisation, disc.z]\n", base=held)
    outcome = run("sweep", "study.yaml", "--format", "json")
    rows = rows_of(outcome.out, "json")
    assert [row["status"] for row in rows] == ["over strength: w2", "over strength: w1, w2"]
    assert [row["max_utilisation"] for row in rows] == pytest.approx([98.1 / 98, 98.1 / 97], rel=1e-9)
    assert outcome.lines[0] == "warning: the stress is above the strength in 2 of 2 rows: 1, 2"
    assert run("sweep", "study.yaml", "--check").lines[-1].endswith("agrees")


def test_a_case_without_equilibrium_leaves_the_others_as_they_are():
    text = "vary: [{bodies.gondola.center_of_mass.2: [-1 m, 30 m, 0, -2 m]}]\n"
    text += "columns: [gondola.roll, gondola.stiffness_rxrx, frequency_1]\n"
    outcome = run("sweep", study(text, TOPPLES), "--no-write", "--format", "csv", code=3)
    rows = rows_of(outcome.out, "csv")
    assert [row["status"] for row in rows] == ["ok", "ok", "nothing holds gondola roll", "ok"]
    assert (rows[0]["gondola.roll_deg"], rows[2]["gondola.roll_deg"], rows[3]["gondola.roll_deg"]) == (0.0, None, 0.0)
    assert abs(rows[1]["gondola.roll_deg"]) == pytest.approx(180)  # it has fallen over
    for row, depth in ((rows[0], 1.0), (rows[1], 30.0), (rows[3], 2.0)):  # of 1 kg: stiffness m g l, inertia 1 + m l^2
        assert row["gondola.stiffness_rxrx_Nm_per_rad"] == pytest.approx(G * depth, rel=1e-6)
        expected = math.sqrt(G * depth / (1 + depth**2)) / (2 * math.pi)
        assert row["frequency_1_Hz"] == pytest.approx(expected, rel=1e-6)
    assert outcome.lines[:1] == ["row 3: nothing holds gondola roll"]


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("disk.z", "no body, free point, cable or link disk (did you mean disc?)"),
        ("disc.zz", "unknown column 'disc.zz' (did you mean disc.z?)"),
        ("w1.preloads", "unknown column 'w1.preloads' (did you mean w1.preload?)"),
        ("w9.sag", "no body, free point, cable or link w9 (allowed: disc, w1, w2, w3)"),
        ("top1.x", "top1 is a fixed point, which has no columns"),
        ("w1.roll", "w1 has no column roll (allowed: w1.preload"),
        ("disc.sag", "disc has no column sag (did you mean disc.yaw?)"),
        ("disc.stiffness_qq", "unknown column 'disc.stiffness_qq' (did you mean disc.stiffness_"),
        ("disc.stiffness_xx_bar", "unknown column 'disc.stiffness_xx_bar' (did you mean disc.stiffness_"),
        ("disc.damping_ratio_q", "unknown column 'disc.damping_ratio_q' (did you mean disc.damping_ratio_"),
        ("disc.frequency_q", "unknown column 'disc.frequency_q' (did you mean disc.frequency_z?)"),
        ("disc.frequency_0", "unknown column 'disc.frequency_0' (frequency_K: K is a whole number from 1 to "),
        ("frequency_999999", "unknown column 'frequency_999999' (frequency_K: K is a whole number from 1 to "),
        ("disc.frequency_static_7", "unknown column 'disc.frequency_static_7' (did you mean "),
        ("preload", "preload is a column of a single cable; here it is CABLE.preload"),
        ("gondola_rms", "gondola_rms is a column of a single cable; here it is disc.rms_x"),
        ("tension_rms", "tension_rms is a column of a single cable; here it is CABLE.rms_tension"),
        ("axial_frequency_2", "axial_frequency_2 is a column of a single cable; here it is CABLE.axial_frequency_2"),
        ("gondola_rms_all_wind", "gondola_rms_all_wind is a column of a single cable"),
        ("rms_tension", "unknown column 'rms_tension' (of one cable tension_rms; a part of a suspension has it: NAME."),
        ("w1.utilisation", "w1.utilisation needs the key cables.w1.breaking_force, which the scene does not have"),
        (
            "max_utilisation",
            "max_utilisation needs the strength or breaking_force of a cable, which the scene does not have",
        ),
        (".z", "unknown column '.z' ("),
        ("disc.", "unknown column 'disc.' ("),
    ],
)
def test_an_unknown_column_is_told_at_its_place(column, message):
    name = study(f"{MASSES}columns: [disc.z, {column}]\n")
    (line,) = run("sweep", name, code=2).lines
    assert line.startswith(f"{name}:3:19: columns.1: {message}")
    if message.endswith("single cable"):
        assert line.endswith(message)


def test_the_column_of_newton_steps_has_those_that_explain_tells():
    scene = SUSPENSIONS / "fast.yaml"
    steps = solve(str(scene), "iterations").values["iterations"]
    assert f"; {steps} Newton steps, " in run("static", scene, "--explain").err


def test_columns_of_a_gondola_need_one():
    name = study_file(".", "vary: [{gravity: [9.81]}]\ncolumns: [sag, gondola.x, frequency_2]\n", CONFIGS / "guy.yaml")
    assert run("sweep", name, code=2).lines == [
        f"{name}:3:16: columns.1: no body, free point, cable or link gondola (allowed: cable)",
    ]


def test_rows_are_chosen_and_sorted_by_columns_by_path():
    name = study(f"{MASSES}columns: [w1.preload, disc.z]\n")

    def masses(*options):
        return [row["bodies.disc.mass_kg"] for row in table_of("sweep", name, "--no-write", *options)]

    assert masses("--where", "w1.preload > 70 N") == [30.0, 45.0]
    assert masses("--where", "disc.z < 0 and w1.preload < 1 kN") == [45.0]
    assert masses("--sort", "w1.preload") == [20.0, 30.0, 45.0]
    assert masses("--sort", "-w1.preload_N") == [45.0, 30.0, 20.0]
    assert masses("--best", "max disc.z") == [20.0]
    (line,) = run("sweep", name, "--no-write", "--sort", "disk.z", code=2).lines
    assert line == (
        "--sort: the study does not vary 'disk.z' (varied: bodies.disc.mass), "
        "and it is no column: no body, free point, cable or link disk (did you mean disc?)"
    )
    assert "did you mean bodies.disc.mass?" in refusal("sweep", name, "--no-write", "--where", "bodies.disc.mas > 1 kg")


def test_a_key_that_all_cables_share_changes_those_that_have_it_from_there():
    own = TRIFILAR.replace("w2: {from: top2,", "w2: {diameter: 3 mm, from: top2,")
    text = "vary: [{cable.diameter: [1 mm, 2 mm]}]\ncolumns: [w1.diameter, w2.diameter, w3.area]\n"
    rows = table_of("sweep", study(text, own), "--no-write")
    assert [(row["w1.diameter_mm"], row["w2.diameter_mm"]) for row in rows] == [(1.0, 3.0), (2.0, 3.0)]
    assert [row["w3.area_mm2"] for row in rows] == pytest.approx([math.pi / 4, math.pi], rel=1e-12)


def test_the_number_of_cables_may_vary():
    text = "vary: [{cables.w4: [null, {from: [0, 0, 8], to: disc.a1, unstretched_length: 9 m}]}]\n"
    rows = table_of("sweep", study(f"{text}columns: [disc.z, cable_mass, frequency_1]\n"), "--no-write")
    assert [row["status"] for row in rows] == ["ok", "ok"]
    area = EA / 1e9
    assert rows[0]["cable_mass_kg"] == pytest.approx(1e-6 * area * 3 * LENGTH, rel=1e-9)
    assert rows[1]["cable_mass_kg"] == pytest.approx(1e-6 * area * (3 * LENGTH + 9), rel=1e-9)


def test_too_few_cables_are_not_asked_to_state_less_than_nothing():
    """Two cables that state nothing, for the six equations of two bodies."""
    name = scene(
        "cable: {axial_stiffness: 1 MN, mass_per_length: 1 g/m, diameter: 5 mm}\n"
        "bodies:\n"
        "  upper: {at: [0, 0, -5], mass: 9, free: [x, y, z], attachments: {eye: [0, 0, 0]}}\n"
        "  lower: {at: [0, 0, -9], mass: 9, free: [x, y, z], attachments: {eye: [0, 0, 0]}}\n"
        "cables: {one: {from: [0, 0, 0], to: upper.eye}, two: {from: upper.eye, to: lower.eye}}\n"
        "solve_for: lengths\n"
    )
    (line,) = run("static", name, code=2).lines
    assert line == (
        "scene.yaml:6:12: solve_for: lengths: 6 equations (upper x, y, z; lower x, y, z), and 2 unknowns (lengths of "
        "one, two): add cables, or state all lengths, with solve_for: pose"
    )


# Two cables in line between two walls, with the same tension.
IN_LINE = """\
cable: {axial_stiffness: 1e9 N, mass_per_length: 50 kg/m, diameter: 120 mm, preload: 3 MN}
points: {p: {at: [3 m, 0, 0], free: true}}
cables: {short: {from: [0, 0, 0], to: p}, long: {from: p, to: [100 m, 0, 0]}}
"""


def test_the_note_on_a_moved_point_says_what_holds_it():
    """By a force it is a load case; without one the tensions leave the place along the cables to their weight."""
    (note,) = run("static", scene(IN_LINE)).lines
    assert "move p by 47 m from its place" in note
    assert note.endswith("an unstretched_length of one of its cables, in place of a tension, decides where it is")
    (note,) = run("static", scene(IN_LINE.replace("free: true", "free: true, force: [0, 0, -100 kN]"))).lines
    assert note.endswith("a force in a load case (cases.NAME.forces) keeps them")


def test_a_note_says_that_the_reference_state_of_a_suspension_is_without_loads_on_cables():
    text = IN_LINE.replace("to: p}", "to: p, unstretched_length: 3 m, loads: [{fraction: 0.5, mass: 1 t}]}")
    (note,) = run("static", scene(text)).lines
    assert note == (
        "note: what cables state is without the point loads of short; reference.loads: true of these cables states it "
        "with them, and false silences this note"
    )
    for quiet in ("cable.reference.loads=false", "cables.short.reference.loads=true"):
        assert not run("static", scene(text), "--set", quiet).lines
    assert not run("static", scene(text), "--set", "cables.long.unstretched_length=97 m").lines


def test_bounds_of_tensions_vary_within_each_other():
    text = TRIFILAR.replace(f", unstretched_length: {LENGTH!r} m", "")
    text += "solve_for: lengths\ntensions: {min: 1 N, max: 1 kN}\n"
    text = text.replace("disc:\n", "disc:\n    free: [z, roll, pitch]\n")
    name = study("vary: [{tensions.min: [10 N, 20 N, 500 N]}]\ncolumns: [w1.preload, w2.unstretched_length]\n", text)
    rows = table_of("sweep", name, "--no-write", code=3)
    assert [row["status"] for row in rows[:2]] == ["ok", "ok"]
    assert rows[2]["status"].startswith("no tensions in [500, 1000] N hold disc here; nearest: w1 at 98.1 N")
    for row in rows[:2]:
        assert row["w1.preload_N"] == pytest.approx(MASS * G / 3, rel=1e-9)
        assert row["w2.unstretched_length_m"] == pytest.approx(LENGTH, rel=1e-9)
    wrong = study("vary: [{tensions.min: [10 N, 2 kN]}]\ncolumns: [w1.preload]\n", text)
    assert refusal("sweep", wrong) == f"{wrong}:2:30: tensions.max: 1000 N is below min, 2000 N"


def test_of_two_keys_that_do_not_fit_the_one_that_an_option_sets_is_named():
    text = TRIFILAR.replace(f", unstretched_length: {LENGTH!r} m", "")
    name = scene(text + "solve_for: lengths\ntensions: {min: 1 N, max: 1 kN}\n")
    (line,) = run("static", name, "--set", "tensions.min=2 kN", code=2).lines
    assert line == "--set tensions.min: tensions.max: 1000 N is below min, 2000 N"
    assert refusal("static", name, "--set", "tensions.max=0.5 N") == "--set tensions.max: 0.5 N is below min, 1 N"
    (line,) = run("static", CONFIGS / "carlina.yaml", "--set", "cable.ends=[[0, 0, 0], [2 km, 0, 0]]", code=2).lines
    assert line.startswith("--set cable.ends: cable.unstretched_length: 184.4883 m is 0.0922 times the distance")


# ------------------------------------------------------------------------------------------- the studies of the project


def stored(name):
    """Rows of a stored table, which `make tables` compares with those that the program computes."""
    return rows_of((ROOT / "results" / f"{name}.csv").read_text(encoding="utf-8"), "csv")


def test_lowest_frequencies_of_fast_over_its_focal_surface_are_those_published():
    rows = stored("fast-focal")
    assert len(rows) == 9
    for row in rows:
        assert row["status"] == "ok"
        assert 0.12 <= row["frequency_1_Hz"] <= 0.20  # Nan et al. (2011)
        assert row["min_tension_N"] >= 0.95 * 120e3  # the mean tension is bounded, that of the lower end is less
        # the cabin on the static stiffness of its cables cannot know that their own modes are as low
        assert row["cabin.frequency_static_1_Hz"] > 1.5 * row["frequency_1_Hz"]
    (computed,) = table_of("sweep", SUSPENSIONS / "fast-focal.yaml", "--row", "5")
    assert computed["frequency_1_Hz"] == pytest.approx(rows[4]["frequency_1_Hz"], rel=1e-6)


def test_tension_balances_the_weight_and_stiffness_is_that_of_bars_where_cables_are_taut():
    # six bars of EA = 70.3 GPa x 2.69 mm^2 at the angle a, L long: K_zz = sum (EA/L0 s^2 + T/L c^2), and K_xx has of
    # each bar's horizontal part the mean over all directions; the sag of 0.1 m takes away less than 1 % of EA/L0
    ea = 70.3e9 * 2.69e-6
    for row in stored("gondola-angle"):
        angle = math.radians(row["d1.inclination_deg"])
        low, sine, cosine = 1000.0, math.sin(angle), math.cos(angle)
        chord = (175.678 - 0.5) / cosine
        cables = 6 * 1440 * 2.69e-6 * chord
        high = low + (50 + cables / 2) * G / (3 * sine)
        k_zz = k_xx = 0.0
        for tension in (low, high):
            axial, lateral = ea / chord * (1 + tension / ea), tension / chord
            k_zz += 3 * (axial * sine**2 + lateral * cosine**2)
            k_xx += 3 * ((axial * cosine**2 + lateral * (sine**2 + 1)) / 2)
        assert row["max_tension_N"] == pytest.approx(high, rel=0.005)
        assert row["gondola.stiffness_zz_N_per_m"] == pytest.approx(k_zz, rel=0.03)
        assert row["gondola.stiffness_xx_N_per_m"] == pytest.approx(k_xx, rel=0.03)


def test_twice_as_many_cables_of_one_preload_are_twice_as_stiff():
    first, down, up, both = stored("gondola-cables")
    assert [row["status"] for row in (first, down, up, both)] == ["ok"] * 4
    assert both["cable_mass_kg"] == pytest.approx(2 * first["cable_mass_kg"], rel=0.01)
    for column in ("gondola.stiffness_xx_N_per_m", "gondola.stiffness_zz_N_per_m"):
        assert both[column] == pytest.approx(2 * first[column], rel=0.03)
        assert first[column] < min(down[column], up[column]) < both[column]


def test_preload_straightens_the_cables_and_holds_the_yaw():
    rows = stored("gondola-preload")
    frequencies = [row["frequency_1_Hz"] for row in rows]
    assert frequencies == sorted(frequencies)
    # turning by a small angle, each cable of tension T and length L, whose ends are r and R from the axis, holds with
    # T r (R cos(a)/L + ... ) = T r R / L, all but independent of EA
    low, high = 5000.0, 5000.0 + 50 * G * math.hypot(175.178, 60.191) / (3 * 60.191)
    expected = 3 * (low + high) * 0.5 * 175.678 / math.hypot(175.178, 60.191)
    assert rows[-1]["gondola.stiffness_rzrz_Nm_per_rad"] == pytest.approx(expected, rel=0.01)


# ------------------------------------------------------------------------------------------------- force densities

ANCHORS, DENSITIES = np.array([[-3.0, 0.0, 4.0], [3.0, 1.0, 5.0], [0.0, -4.0, 6.0]]), np.array([50.0, 80.0, 120.0])
FORM = f"""\
cable: {{elastic_modulus: 1 GPa, area: 100 mm^2, density: 1400 kg/m^3}}
points: {{knot: {{at: [9, 9, -90], free: true, mass: 2 kg, force: [10, 0, 0]}}}}
cables:
{
    "".join(
        f"  c{i}: {{from: {a.tolist()}, to: knot, unstretched_length: 4.5, force_density: {q}}}{chr(10)}"
        for i, (a, q) in enumerate(zip(ANCHORS, DENSITIES, strict=True))
    )
}"""


def test_form_finding_is_the_linear_balance_of_force_densities():
    load = np.array([10.0, 0.0, -2 * G])
    place = (DENSITIES @ ANCHORS + load) / DENSITIES.sum()
    lengths = np.linalg.norm(place - ANCHORS, axis=1)
    found = json.loads(run("static", scene(FORM), "--form-finding", "--format", "json").out)
    (point,), cables = found["points"]["rows"], found["cables"]["rows"]
    assert [point[f"{axis}_m"] for axis in "xyz"] == pytest.approx(place, rel=1e-14)
    assert [cable["length_m"] for cable in cables] == pytest.approx(lengths, rel=1e-14)
    assert [cable["tension_N"] for cable in cables] == pytest.approx(DENSITIES * lengths, rel=1e-14)


def test_the_exact_search_begins_at_the_form():
    found = SuspensionCase(scene_of(FORM)).equilibrium
    load = np.array([10.0, 0.0, -2 * G])
    assert found.suspension.position[0] == pytest.approx((DENSITIES @ ANCHORS + load) / DENSITIES.sum(), rel=1e-14)
    assert found.record.converged


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (KNOT.replace(", free: true, mass: 2 kg", ""), (), "--form-finding: no effect: no cable ends at a free point"),
        (FORM, ("--table", "bodies"), "--table bodies: there are the tables points, cables"),
        (FORM, ("--format", "csv"), "--format csv: one table at a time: give --table points, cables"),
    ],
)
def test_form_finding_refuses_what_has_no_effect(text, options, message):
    assert run("static", scene(text), "--form-finding", *options, code=2).err == f"{message}\n"


def test_form_finding_without_points_tells_the_tensions_between_the_ground():
    text = "cables: {a: {from: [0, 0, 0], to: [3, 4, 0], force_density: 7, unstretched_length: 5}}\n"
    found = run("static", scene(KNOT.splitlines()[0].replace(", unstretched_length: 2.4 m", "") + "\n" + text),
                "--form-finding", "--format", "json")  # fmt: skip
    (cable,) = json.loads(found.out)["cables"]["rows"]
    assert (cable["length_m"], cable["tension_N"]) == (5.0, 35.0)


def test_form_finding_names_each_cable_without_a_force_density():
    told = "force_density: missing key: 'cablestudy static --form-finding' needs it"
    found = run("static", scene(KNOT), "--form-finding", code=2).lines
    assert found == [f"scene.yaml:3:13: cables.a.{told}", f"scene.yaml:3:40: cables.b.{told}"]
    some = FORM.replace(f", force_density: {DENSITIES[1]}", "")
    assert refusal("static", scene(some), "--form-finding") == f"scene.yaml:5:7: cables.c1.{told}"


@pytest.mark.usefixtures("short_searches")
@pytest.mark.parametrize("mass", [1e9, 3e14])
def test_a_point_too_heavy_for_its_preloads_is_refused_without_a_warning(mass):
    """Pytest takes a warning of numpy for an error; far below three guys would carry a third of the weight each."""
    (line,) = run("static", SUSPENSIONS / "mast-guys.yaml", "--set", f"points.top.mass={mass!r} kg", code=3).lines
    assert "no lengths were found" in line
    assert f"has a preload of {mass * G / 3:.4g} N instead of 2e+04 N" in line


def test_frozen_lengths_hold_the_body_where_it_stood_and_yield_by_its_stiffness(folder):
    """The recipe of docs/suspension.md: a small force moves the body by K^-1 F, K its stiffness."""
    run("new", "suspension")
    stood = cablestudy.load("suspension.yaml").static()
    lengths = stood["cables"].set_index("name")["unstretched_length_m"]
    frozen = {f"cables.{name}.unstretched_length": length for name, length in lengths.items()}
    frozen |= {"solve_for": "pose", "tensions": None}
    places, force = ["x_m", "y_m", "z_m"], 0.1
    hung, pushed = (
        cablestudy.load("suspension.yaml", set={**frozen, "bodies.camera.force.0": pull}).static()["bodies"]
        for pull in (0.0, force)
    )
    start = stood["bodies"][places].to_numpy()[0]
    assert hung[places].to_numpy()[0] == pytest.approx(start, abs=1e-9)
    stiffness = stood["stiffness"][["x", "y", "z", "rx", "ry", "rz"]].to_numpy()
    expected = np.linalg.solve(stiffness, [force, 0, 0, 0, 0, 0])[:3]
    moved = pushed[places].to_numpy()[0] - hung[places].to_numpy()[0]
    assert moved == pytest.approx(expected, rel=1e-3, abs=1e-3 * expected[0])


def test_a_narrow_terminal_keeps_what_matters_of_many_cables():
    net = SUSPENSIONS / "carlina-net.yaml"
    table = cablestudy.load(net).compute("static").tables["cables"]
    kept = ("name", "preload", "max_tension", "unstretched_length", "sag", "utilisation")
    for width in (60, 80, 100, 200):
        text, left_out = fitted(table, width)
        assert max(map(len, text.splitlines())) <= width
        assert left_out
        shown = [field.plain for field in table.fields if field.plain not in left_out]
        few = len(shown) < len(kept)
        assert list(kept[: len(shown)]) == shown if few else set(kept) <= set(shown)
        assert few == (width == 60)
    printed = table_of("static", net, "--table", "cables")
    assert list(printed[0]) == [field.name for field in table.fields]
    assert "reaction 1 vertical [N]" in run("static", net, "--table", "cables").out


# Four cables hold a point; of four more two are just longer than the distance that they span. No gravity.
LOOSE = """\
gravity: 0
cable: {elastic_modulus: 20 GPa, area: 50 mm^2, density: 509, unstretched_length: 1.76 m}
points: {e: {at: [1.25, 1.25, 1.25], free: true, mass: 30}}
ground: [[-5, -3], [5, -3]]
cables:
  t0: {from: [0, 0, 1.25], to: e}
  t1: {from: [0, 2.5, 1.25], to: e}
  t2: {from: [2.5, 0, 1.25], to: e}
  t3: {from: [2.5, 2.5, 1.25], to: e}
  up: {from: [0, 0, 2.5], to: e, unstretched_length: 2.15 m}
  low: {from: [2.5, 2.5, 0], to: e, unstretched_length: 2.15 m}
  s0: {from: [2.5, 0, 2.5], to: e, unstretched_length: 2.2 m}
  s1: {from: [0, 2.5, 2.5], to: e, unstretched_length: 2.2 m}
"""


def test_a_slack_cable_without_weight_has_no_form():
    """What depends on it is refused and names the cable; tensions, places and the other cables stay."""
    done = run("static", scene(LOOSE), "--table", "cables", "--format", "json", code=3)
    said = "is slack and without weight: it has no definite form, so no sag, swing, lowest point, clearance or angles"
    told = [line.startswith(f"scene.yaml: {name} {said}") for name, line in zip(("s0", "s1"), done.lines, strict=True)]
    assert all(told)
    rows = {row["name"]: row for row in json.loads(done.out)["rows"]}
    for name in ("s0", "s1"):
        of_form = ("sag_m", "swing_deg", "lowest_point_m", "clearance_m")
        assert [rows[name][column] for column in of_form] == [None] * 4
        assert [rows[name][force] for force in ("preload_N", "max_tension_N", "tension_to_N")] == [0.0] * 3
        assert rows[name]["mass_kg"] == pytest.approx(2.2 * 50e-6 * 509)
    # 20 GPa x 50 mm^2 of cables that four times span sqrt(2) 1.25 m
    assert rows["t0"]["preload_N"] == pytest.approx(1e6 * (math.sqrt(2) * 1.25 / 1.76 - 1), rel=1e-6)
    assert rows["up"]["sag_m"] == 0
    assert len(run("static", "scene.yaml", "--table", "points", "--format", "csv").out.splitlines()) == 2


def test_modes_beside_a_slack_cable_without_weight_are_refused():
    """Its mass is somewhere, and moves with something."""
    done = run("modes", scene(LOOSE), code=3)
    assert done.lines == ["scene.yaml: s0, s1: slack and without weight, so that nothing determines where its mass is"]
    heavy = run("modes", "scene.yaml", "--set", "gravity=9.81", "-n", "2", "--format", "csv")
    assert len(heavy.out.splitlines()) == 3


def test_stated_tensions_that_move_a_point_are_told():
    """A force in the file belongs to the state in which the guys are cut; one in a load case does not."""
    mast = SUSPENSIONS / "mast-guys.yaml"
    cut = run("static", mast, "--set", "points.top.force=[10 kN, 0, 46.6 kN]", "--table", "points", "--format", "json")
    (top,) = rows_of(cut.out, "json")
    begin = f"note: the stated tensions or sags move top by {math.dist((0, 0, 50), list(top.values())[1:]):.4g} m from"
    assert [line.startswith(begin) for line in cut.lines] == [True]
    case = ("--set", "cases={push: {forces: {top: [100 N, 0, 0]}}}", "--case", "push")
    kept = run("static", mast, *case, "--table", "points", "--format", "json")
    assert kept.lines == []
    # a guy resists along its foot, two behind it half as much together; Ernst's modulus of steel for their sag
    stiff, weight, foot = 210e9 * 150e-6, 7800 * 150e-6 * 9.81, 50.0
    stiff /= 1 + (weight * foot) ** 2 * stiff / (12 * 20e3**3)
    assert rows_of(kept.out, "json")[0]["x_m"] == pytest.approx(100 / (0.75 * stiff / math.hypot(50, 50)), rel=0.01)


def test_an_anchor_at_a_depth_of_30_km():
    """A cable with 605 modes below those asked for, of which 600 are computed."""
    study = SUSPENSIONS / "gondola-cables.yaml"
    deep = ("--no-write", "--row", "2", "--set", "points.down4=[175.678 m, 0, -30 km]", "--format", "json")
    done = run("sweep", study, *deep, code=3)
    assert done.lines[0].startswith(
        "row 2: 0 of the lowest 400 modes have more than half of their kinetic energy in go"
    )
    assert rows_of(done.out, "json")[0]["frequency_1_Hz"] > 0
