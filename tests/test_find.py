"""The value of a key for which a column takes a value: against closed forms of the test's own, in a study, refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command import CONFIGS, refusal, rows_of, run, stored_table, table_of, with_sets, write
from scipy.optimize import brentq

from cablestudy.scene.scene import load_scene
from cablestudy.scene.schema import study_schema
from cablestudy.scene.study import read_study
from cablestudy.study import find as find_module
from cablestudy.study.case_table import tables_of
from cablestudy.study.columns import column_named
from cablestudy.study.columns import find as column
from cablestudy.study.find_rows import evaluate_found
from cablestudy.study.one_cable.rows import evaluate

SPAN, MODULUS, AREA, DENSITY, GRAVITY = 200.0, 160e9, 1e-4, 7850.0, 9.81
STIFFNESS, WEIGHT = MODULUS * AREA, DENSITY * AREA * GRAVITY  # N; N/m of unstretched length
SCENE = f"""\
cable: {{chord: {SPAN} m, elastic_modulus: {MODULUS}, density: {DENSITY}, area: {AREA}, preload: 10 kN}}
gondola: {{mass: 50 kg}}
"""
KNOT = """\
cable: {elastic_modulus: 200e9, density: 1e-9, area: 1e-4, unstretched_length: 10.4 m}
points: {knot: {at: [0, 0, -3 m], free: true, mass: 20 kg}, left: [-10 m, 0, 0], right: [10 m, 0, 0]}
cables: {one: {from: left, to: knot}, two: {from: right, to: knot}}
"""


@pytest.fixture(autouse=True)
def scene(folder):
    """The working directory of a test, with a scene of one cable and one of two in it."""
    write("scene.yaml", SCENE)
    write("knot.yaml", KNOT)
    return folder


def find(*arguments, code=0, scene="scene.yaml"):
    """Rows that the command finds, and what it prints beside them."""
    outcome = run("find", scene, *arguments, "--format", "json", code=code)
    return rows_of(outcome.out, "json") if outcome.out else [], outcome


class Level:
    """The elastic catenary between level supports, by its horizontal tension or its length (Irvine 1981, section 1.4).

    With the half length a of the unstretched cable: span/2 = H a/EA + H/w asinh(w a/H).
    """

    def __init__(self, horizontal=None, length=None, density=DENSITY):
        self.weight = density * AREA * GRAVITY
        if length is None:
            length = 2 * brentq(lambda a: self.half_span(horizontal, a) - SPAN / 2, 1.0, SPAN, xtol=1e-300, rtol=1e-15)
        if horizontal is None:
            horizontal = brentq(lambda h: self.half_span(h, length / 2) - SPAN / 2, 1.0, 1e8, xtol=1e-300, rtol=1e-15)
        self.horizontal, self.length, self.end_load = horizontal, length, self.weight * length / 2

    def half_span(self, horizontal, half):
        return horizontal * half / STIFFNESS + horizontal / self.weight * np.arcsinh(self.weight * half / horizontal)

    @property
    def sag(self):
        h, v = self.horizontal, self.end_load
        return v * self.length / 4 / STIFFNESS + h / self.weight * (np.hypot(1, v / h) - 1)

    @property
    def mean_tension(self):
        h, v = self.horizontal, self.end_load
        return (np.hypot(h, v) + h**2 / v * np.arcsinh(v / h)) / 2

    @property
    def max_tension(self):
        return np.hypot(self.horizontal, self.end_load)


def of_sag(sag, density=DENSITY):
    ends = np.array([0.6, 1e4]) * density * AREA * GRAVITY * SPAN
    horizontal = brentq(lambda h: Level(h, density=density).sag - sag, *ends, xtol=1e-300, rtol=1e-15)
    return Level(horizontal, density=density)


# ------------------------------------------------------------------------------------------------------- the command


def test_a_level_of_the_ground_is_found():
    (row,) = table_of("find", CONFIGS / "guy.yaml", "clearance = -4 m", "--by", "ground", "--set", "ground=1 m")
    assert row["ground_m"] == pytest.approx(4.0)  # the guy ends at z = 0


def test_the_preload_of_a_sag():
    (row,), outcome = find("sag = 2 m", "--by", "cable.preload")
    level = of_sag(2.0)
    assert row["cable.preload_N"] == pytest.approx(level.mean_tension, rel=1e-10)
    assert row["sag_m"] == pytest.approx(2.0, rel=1e-11)
    assert row["max_tension_N"] == pytest.approx(level.max_tension, rel=1e-10)
    assert list(row) == ["cable.preload_N", "sag_m", "max_tension_N", "unstretched_length_m", "status"]
    assert row["status"] == "ok"
    assert outcome.lines == ["searched: cable.preload from 5000 to 20000 N; --between LOW:HIGH searches elsewhere"]


def test_a_key_replaces_the_one_that_it_excludes_and_units_are_free():
    (row,), _ = find("sag_m = 2000 mm", "--by", "cable.unstretched_length", "--set", "cable.sag=1 m", "--quiet")
    assert row["cable.unstretched_length_m"] == pytest.approx(of_sag(2.0).length, rel=1e-12)
    (row,), _ = find("mass = 100", "--by", "cable.diameter", "--columns", "area,strain")
    assert row["cable.diameter_m"] == pytest.approx(np.sqrt(4 * row["area_mm2"] * 1e-6 / np.pi), rel=1e-12)
    length = SPAN / (1 + row["strain"])  # but for the sag
    assert row["area_mm2"] * 1e-6 == pytest.approx(100 / DENSITY / length, rel=1e-3)
    assert list(row) == ["cable.diameter_m", "mass_kg", "area_mm2", "strain", "status"]


def test_temperatures_are_told_in_degrees_celsius():
    """In messages as in the table: of a level at 15 degC, which is 288.15 K; CSV and JSON keep SI."""
    words = "--by", "cases.hot.temperature", "--case", "hot", "--set", "cases={hot: {temperature: 40 degC}}"
    words += (*with_sets("cable.expansion=1.2e-5 1/K", "cable.reference.temperature=15 degC", "cable.sag=2 m"),)
    (row,), outcome = find("sag = 2 m", *words)
    assert row["cases.hot.temperature_K"] == pytest.approx(288.15, abs=1e-6)
    low, high = re.fullmatch(r"searched: cases.hot.temperature from (.*) to (.*) degC; .*", outcome.lines[0]).groups()
    assert -273.15 < float(low) < 15 < 40 < float(high)
    _, outcome = find("sag = 3 m", *words, "--between", "-10 degC:60 degC", code=3)
    assert "cases.hot.temperature from -10 to 60 degC" in outcome.err
    assert "(at -10 degC)" in outcome.err
    assert "(at 60 degC)" in outcome.err


def test_the_preload_of_a_frequency_of_a_string():
    # without weight: f = sqrt(T/(rho A L0/L))/(2 L) with L0 = L/(1 + T/EA)
    frequency = 1.5
    tension = brentq(lambda t: t * (1 + t / STIFFNESS) - DENSITY * AREA * (2 * SPAN * frequency) ** 2, 1.0, 1e8)
    options = ("--by", "cable.preload", "--set", "gravity=0", "--set", "model.accuracy=1e-8")
    (row,), _ = find("cable_frequency = 1.5 Hz", *options)
    assert row["cable.preload_N"] == pytest.approx(tension, rel=1e-7)


def test_fixed_elements_are_solved_too():
    (row,), _ = find("end_stiffness = 40 kN/m", "--by", "cable.preload", "--set", "model.elements=8")
    assert row["end_stiffness_N_per_m"] == pytest.approx(40e3, rel=1e-9)


def test_two_lengths_have_one_largest_tension():
    rows, outcome = find("max_tension = 5 kN", "--by", "cable.unstretched_length", "--between", "190 m:2 km")
    lengths = [row["cable.unstretched_length_m"] for row in rows]
    assert [Level(length=length).max_tension for length in lengths] == pytest.approx([5e3, 5e3], rel=1e-9)
    assert lengths[0] < 210 < 1000 < lengths[1]
    assert outcome.lines == ["2 values of cable.unstretched_length"]
    (row,), _ = find("max_tension = 5 kN", "--by", "cable.unstretched_length")  # about the scene's own length
    assert row["cable.unstretched_length_m"] == pytest.approx(lengths[0], rel=1e-12)


def test_none_tells_what_is_reached_and_where():
    arguments = ("--by", "cable.unstretched_length", "--between", "190 m:2 km")
    line = refusal("find", "scene.yaml", "max_tension = 500 N", *arguments, code=3)
    assert line.startswith("scene.yaml: no solution of max_tension = 500 N: over cable.unstretched_length from 190")
    # the least that an inextensible cable can have is 0.754440 of its weight over the span (Irvine 1981, section 1.2)
    least = float(line.partition("reaches from ")[2].split()[0])
    assert least == pytest.approx(0.754440 * WEIGHT * SPAN, rel=1e-3)


@pytest.mark.parametrize(
    ("goal", "key", "words"),
    [
        ("chord = 3 m", "cable.preload --between 5kN:20kN", "chord does not depend on cable.preload, it is 200 m"),
        ("chord = 200 m", "cable.strength", "chord = 200 m with every cable.strength: chord does not depend on it"),
        ("gondola_damping_ratio = 0.1", "gondola.mass", "gives a value of gondola_damping_ratio: modal damping grows"),
    ],
)
def test_no_solution_is_exit_code_3_and_one_line(goal, key, words):
    assert words in refusal("find", "scene.yaml", goal, "--by", *key.split(), code=3)


def test_a_solution_over_strength_is_told():
    """Steel of 100 mm^2 and 100 MPa holds 10 kN; its largest tension is little above the mean one."""
    strength = ("--set", "cable.strength=100 MPa")
    (row,), outcome = find("max_tension = 12 kN", "--by", "cable.preload", "--between", "5 kN:20 kN", *strength)
    assert row["status"] == "over strength"
    assert row["max_tension_N"] == pytest.approx(12e3, rel=1e-6)
    assert outcome.lines[-1] == "warning: the stress of 120 MPa is above the strength of 100 MPa"
    weak = ("--set", "cable.strength=100 kPa")
    (row,), outcome = find("knot.z = -3.3 m", "--by", "cable.unstretched_length", "--between", "10.5 m:10.6 m", *weak,
                          scene="knot.yaml")  # fmt: skip
    assert row["status"] == "over strength: one, two"
    assert outcome.lines[-1].startswith("warning: the stress is above the strength: one (utilisation ")


def test_a_jump_is_no_solution():
    # the mode with the largest share of the gondola's compliance changes from one to another as the cable tightens
    between = ("--by", "cable.preload", "--between", "5 kN:20 kN")
    _, outcome = find("gondola_frequency = 2 Hz", *between, code=3)
    place = float(outcome.err.rpartition("gondola_frequency jumps over 2 at cable.preload = ")[2].split()[0])
    below, above = (
        evaluate(load_scene("scene.yaml", [f"cable.preload={share * place} N"])[1], [column("gondola_frequency")])
        for share in (0.9999, 1.0001)
    )
    assert below.cells["gondola_frequency_Hz"] < 1 < 3 < above.cells["gondola_frequency_Hz"]


def test_the_mass_at_a_knot():
    # two cables without weight from (-10, 0) and (10, 0): m g = 2 T sin(slope) at the length under the tension T
    tension, unstretched, stiffness = 1e3, 10.4, 200e9 * 1e-4
    length = unstretched * (1 + tension / stiffness)
    mass = 2 * tension * np.sqrt(length**2 - 100) / length / GRAVITY
    (row,), _ = find("max_tension = 1 kN", "--by", "points.knot.mass", scene="knot.yaml")
    assert row["points.knot.mass_kg"] == pytest.approx(mass, rel=1e-8)
    assert row["min_tension_N"] == pytest.approx(tension, rel=1e-8)


PRELOAD = "--by cable.preload"


@pytest.mark.parametrize(
    ("words", "goal", "options"),
    [
        ("find: unknown column 'sagg' (did you mean sag?)", "sagg = 2", PRELOAD),
        ("find: unknown column 'safety_factor' (did you mean utilisation?", "safety_factor = 3", PRELOAD),
        ("expected COLUMN = VALUE, for example 'sag = 2 m', got \"sag\"", "sag", PRELOAD),
        ('find: sag: "kg" (mass) and "m" (length) do not fit each other', "sag = 2 kg", PRELOAD),
        ('gain_margin: "%" (pure number) and "dB" (level) do not fit each other', "gain_margin = 50 %", PRELOAD),
        ('find: sag: expected a number in m, or with a unit, got "x"', "sag = x", PRELOAD),
        ('max_tension: expected a force, got "3 %": give the tension in N', "max_tension = 3 %", PRELOAD),
        ("find: status is text", "status = ok", PRELOAD),
        ("find: dof describes the computation", "dof = 3", PRELOAD),
        ("find: deflection needs the key cable.loads", "deflection = 1 mm", PRELOAD),
        ("find: no body, free point, cable or link knot (allowed: gondola, cable)", "knot.x = 1 m", PRELOAD),
        ("--by cable.loads.0.at: cable.loads: the list is not there, so that it has no item 0",
         "sag = 2 m", "--by cable.loads.0.at"),
        ("--by cable.loads.1.mass: cable.loads: the list is not there, so that it has no item 1",
         "sag = 2 m", "--by cable.loads.1.mass"),
        ("--by cable.densty: unknown key (did you mean density?)", "sag = 2 m", "--by cable.densty"),
        ("--by cable.material: holds no number", "sag = 2 m", "--by cable.material"),
        ("--by model.elements: holds no number that varies continuously", "sag = 2 m", "--by model.elements"),
        ("--by cable.: a key is written as names", "sag = 2 m", "--by cable."),
        ("--by bodies.x.mass: bodies.x: missing key: at", "sag = 2 m", "--by bodies.x.mass"),
        ("--between 9N:1N: the first end must be below", "sag = 2 m", f"{PRELOAD} --between 9N:1N"),
        ("--between 1m:2m: expected a force in N", "sag = 2 m", f"{PRELOAD} --between 1m:2m"),
        ("--between 5%:60%: expected a force in N", "sag = 2 m", f"{PRELOAD} --between 5%:60%"),
        ("--between 5: expected LOW:HIGH", "sag = 2 m", f"{PRELOAD} --between 5"),
        ("--columns: unknown column 'sagg'", "sag = 2 m", f"{PRELOAD} --columns sagg"),
        ("Missing option '--by'", "sag = 2 m", ""),
    ],
)  # fmt: skip
def test_what_is_refused(words, goal, options):
    assert words in refusal("find", "scene.yaml", goal, *options.split())


def test_a_key_that_is_not_one_number_is_told_with_one_that_is():
    line = refusal("find", CONFIGS / "suspensions" / "fast.yaml", "cabin.z = 10 m", "--by", "bodies.mass")
    assert line.endswith("for example bodies.cabin.mass")
    line = refusal("find", CONFIGS / "guy.yaml", "sag = 2 m", "--by", "cable.ends")
    assert line == "--by cable.ends: holds several numbers: give one of them, for example cable.ends.0.0"


@pytest.mark.parametrize(
    ("path", "column", "key"),
    [(CONFIGS / "guy.yaml", "min_tension", "cable.preload"), ("many.yaml", "a.max_tension", "cables.a.preload")],
)
def test_a_tension_as_a_share_of_the_breaking_force_is_told_in_newtons(path, column, key):
    """Which solves as it is printed."""
    cable = "cable: {material: guy-strand, diameter: 16 mm, preload: 10 %}\n"
    write("many.yaml", cable + "cables: {a: {from: [0, 0, 0], to: [60, 0, 80]}}\n")
    line = refusal("find", path, f"{column} = 9 %", "--by", key)
    told = re.search(rf"write ({column} = (.*) N), which is that share of the breaking force of (.*) N", line)
    assert float(told[2]) == pytest.approx(0.09 * float(told[3]), rel=1e-5)
    beside = f"{column.rpartition('.')[0]}.utilisation".strip(".")
    (row,) = table_of("find", path, told[1], "--by", key, "--columns", beside)
    if column == "a.max_tension":
        assert row["a.utilisation"] == pytest.approx(0.09, rel=1e-5)
    assert row[f"{column}_N"] == pytest.approx(float(told[2]), rel=1e-6)


def test_a_fraction_is_a_number():
    (row,), _ = find("sag = 1/4", "--by", "cable.preload", "--between", "100 kN:200 kN")
    assert row["sag_m"] == pytest.approx(0.25, rel=1e-9)


def test_the_place_of_a_load_is_found_by_its_number_in_the_list():
    """Where a load hangs 0.13 m deep: checked by the statics of a load there."""
    (row,), outcome = find("load_sag = 0.13 m", "--by", "cable.loads.0.at", scene=CONFIGS / "point-load.yaml")
    place = row["cable.loads.0.at_m"]
    # beyond the place tried last there is no cable of 184.5 m, and the load hangs ever less deep towards its end
    low, high = re.search(r"not searched: cable.loads.0.at from (.*) to (.*) m, at an end of", outcome.err).groups()
    assert place < float(low) < 184.5 < float(high)
    (there,) = table_of("static", CONFIGS / "point-load.yaml", "--set", f"cable.loads.0.at={place!r} m")
    assert there["load_sag_m"] == pytest.approx(0.13, rel=1e-9)


def test_all_mistakes_at_once():
    lines = run("find", "scene.yaml", "sagg = 2", "--by", "cable.densty", code=2).lines
    assert [line.split(":")[0] for line in lines] == ["find", "--by cable.densty"]


# -------------------------------------------------------------------------------------------------------- in a study

STUDY = """\
base: scene.yaml
find: {column: sag, value: 2 m, by: cable.preload}
vary: [{cable.density: [4000, 7850]}]
columns: [max_tension, sag]
"""
TENSION = STUDY.replace("4000", "1000").replace("sag, value: 2 m, by: cable.preload", "max_tension, value: %s")


def study(text=STUDY):
    write("study.yaml", text)


def sweep(*arguments, code=0):
    outcome = run("sweep", "study.yaml", *arguments, code=code)
    return outcome, stored_table()


def test_each_row_of_a_study_is_solved():
    study()
    rows = sweep()[1]
    assert list(rows[0]) == ["cable.density_kg_per_m3", "cable.preload_N", "max_tension_N", "sag_m", "status"]
    for row in rows:
        level = of_sag(2.0, density=row["cable.density_kg_per_m3"])
        assert row["cable.preload_N"] == pytest.approx(level.mean_tension, rel=1e-9)
        assert row["max_tension_N"] == pytest.approx(level.max_tension, rel=1e-9)
    assert sweep("--check")[0].lines == ["results/study.csv: agrees"]


def test_rows_of_a_study_are_solved_in_step_as_each_is_alone(monkeypatch):
    """Rows of numbers and of words, some without a solution, some with two: the same digits, in a few calls for all."""
    vary = "[{cable.density: {from: 500, to: 9000, count: 6}}, {winch: [null, {location: ground}]}]"
    text = TENSION % "500 N, by: cable.unstretched_length, between: [190 m, 2 km]"
    study(text.replace("[{cable.density: [1000, 7850]}]", vary))
    cases, calls = read_study("study.yaml"), []
    columns = [column_named(cases, name) for name in ("cable.unstretched_length", *cases.columns)]
    evaluate_tables = find_module.evaluate_tables
    monkeypatch.setattr(find_module, "evaluate_tables", lambda *given: calls.append(given) or evaluate_tables(*given))

    def found(numbers):
        return evaluate_found(cases, tables_of(cases, numbers)[0], columns)

    together = found(range(cases.count))
    in_step = len(calls)
    alone = [found([case])[case] for case in range(cases.count)]
    assert [together[case] for case in range(cases.count)] == alone
    assert in_step < (len(calls) - in_step) / 4
    statuses = {" ".join(status.split()[:2]) for _, status, *_ in alone}
    assert len(statuses) > 1
    assert sum(status == "ok" for _, status, *_ in alone) > 1


def test_a_case_without_solution_fails_alone():
    study(TENSION % "500 N, by: cable.unstretched_length, between: [190 m, 300 m]")
    light, heavy = sweep(code=3)[1]
    assert light["max_tension_N"] == pytest.approx(500, rel=1e-9)
    assert heavy["status"].startswith("no solution of max_tension = 500 N: over cable.unstretched_length from 190")
    assert heavy["cable.unstretched_length_m"] is heavy["sag_m"] is None


def test_several_solutions_are_none_in_a_study_and_a_range_chooses_one():
    study(TENSION % "5 kN, by: cable.unstretched_length, between: [190 m, 2 km]")
    status = sweep(code=3)[1][1]["status"]
    assert status.startswith("max_tension = 5000 N: 2 values of cable.unstretched_length: 20")
    assert status.endswith("(find.between chooses one)")
    study(TENSION % "5 kN, by: cable.unstretched_length, between: [190 m, 300 m]")
    row = sweep("--restart")[1][1]
    assert Level(length=row["cable.unstretched_length_m"]).max_tension == pytest.approx(5e3, rel=1e-9)


def test_processes_selection_and_reuse():
    study()
    _, rows = sweep("--jobs", 2)
    table = Path("results/study.csv").read_bytes()
    sweep("--restart", "--jobs", 1)
    assert Path("results/study.csv").read_bytes() == table
    shown = run("sweep", "study.yaml", "--no-write", "--where", "cable.preload > 1 kN", "--sort", "-cable.preload")
    assert [line.split("|")[1].strip() for line in shown.out.splitlines()[2:]] == ["7850", "4000"]
    study(STUDY.replace("sag]", "sag, mass]").replace("[4000,", "[4000, 5000,"))
    outcome, more = sweep("--resume")
    assert "some columns of 2 more" in outcome.lines[0]
    before = [row["max_tension_N"] for row in rows]
    assert [row["max_tension_N"] for row in more if row["cable.density_kg_per_m3"] != 5000] == before
    study(STUDY.replace("2 m,", "1 m,"))  # nothing of it can be used
    outcome, rows = sweep("--resume")
    assert rows[0]["sag_m"] == pytest.approx(1, rel=1e-10)
    assert outcome.lines == ["written: results/study.csv, results/study.md"]


@pytest.mark.parametrize(
    ("find", "words"),
    [
        ("{column: sagg, value: 2, by: gravity}", "study.yaml:2:16: find.column: unknown column 'sagg'"),
        ("{column: sag, value: 2 kg, by: gravity}", 'study.yaml:2:28: find.value: sag: "kg" (mass)'),
        ("{column: sag, value: true, by: gravity}", "study.yaml:2:28: find.value: expected a number, or text such"),
        ("{column: sag, value: 2, by: gravty}", "study.yaml:2:35: find.by: unknown key (did you mean gravity?)"),
        ("{column: sag, value: 2}", "study.yaml:2:7: find: missing key: by"),
        ("{column: sag, value: 2, by: gravity, to: 3}", "find.to: unknown key (allowed: column, value, by, between)"),
        ("{column: sag, value: 2, by: gravity, between: [3, 1]}", "find.between: the first end must be below"),
        ("{column: sag, value: 2, by: gravity, between: [3]}", "find.between"),
        ("{column: sag, value: 2, by: cable.density}", "find.by: cable.density: varies already"),
        ("{column: deflection, value: 2, by: gravity}", "find.column: deflection needs the key cable.loads"),
    ],
)
def test_what_is_refused_in_a_study(find, words):
    study(STUDY.replace("{column: sag, value: 2 m, by: cable.preload}", find))
    assert words in refusal("sweep", "study.yaml")


def test_the_schema_describes_it():
    table = study_schema()["$defs"]["Find"]
    assert (table["required"], table["additionalProperties"]) == (["column", "value", "by"], False)
    assert {"type": "string"} in table["properties"]["value"]["anyOf"]
    assert json.dumps(table)
