"""Limits: margins and governing load cases against separate commands and closed forms, ranges against bisection."""

import json
from math import cosh, hypot
from pathlib import Path

import numpy as np
import pytest
from command import CONFIGS, refusal, refused_in_one_line, rows_of, run, stored_table, table_of, with_sets, write
from picture import undrawn
from references import catenary_mp
from scipy.optimize import brentq
from solved import solve

import cablestudy as cs
from cablestudy.scene.scene import load_scene
from cablestudy.study.find_limits import _range_ends
from cablestudy.study.roots import Zeros
from cablestudy.sweeps.record import pack, unpack

BARE = (CONFIGS / "line.yaml").read_text(encoding="utf-8").partition("limits:")[0]
LINE = """\
base: bare.yaml
limits:
  strength: {that: utilisation <= 60 %, cases: [ice, storm]}
  everyday: {that: utilisation <= 20 %, cases: [everyday]}
  clearance: clearance >= 7 m
  swing: 40 deg > swing
"""
MAST = f"""\
base: {CONFIGS / "suspensions" / "mast-guys.yaml"}
cable: {{diameter: 14 mm, expansion: 1.2e-5 1/K, strength: 1500 MPa}}
cables: {{guy3: {{strength: null}}}}
cases: {{cold: {{temperature: -30 degC}}, push: {{forces: {{top: [10 kN, -100 N, 0]}}}}}}
limits:
  strength: utilisation <= 10 %
  guy: {{that: guy1.preload >= 12 kN, cases: [cold, reference]}}
  sway: top.force_displacement_x <= 60 mm
  all: max_tension <= 30 kN
"""
SPAN, STIFFNESS, MASS, GRAVITY = 200.0, 16e6, 0.785, 9.81
CABLE = f"cable: {{chord: {SPAN} m, axial_stiffness: {STIFFNESS}, mass_per_length: {MASS}, breaking_force: 100 kN"


@pytest.fixture(autouse=True)
def scenes(folder):
    """The working directory of a test, with two scenes in it."""
    write("bare.yaml", BARE)
    write("line.yaml", LINE)
    write("mast.yaml", MAST)
    return folder


def limits(scene="line.yaml", *arguments, code=None):
    """Rows of the limits of a scene by their names."""
    out = run("static", scene, "--limits", "--format", "json", *arguments, code=code).out
    return {row["name"]: row for row in rows_of(out, "json")}


def test_margins_are_those_of_separate_load_cases():
    """The least margin over `static --case NAME` of each load case, and over the state without one."""
    found = limits(code=1)
    cases = {name: ("--case", name) for name in ("everyday", "cold", "hot", "ice", "storm")} | {"reference": ()}
    rows = {name: table_of("static", "line.yaml", *option)[0] for name, option in cases.items()}
    checks = {
        "strength": ("utilisation", ("ice", "storm"), lambda x: (0.6 - x) / 0.6),
        "everyday": ("utilisation", ("everyday",), lambda x: (0.2 - x) / 0.2),
        "clearance": ("clearance_m", tuple(cases), lambda x: (x - 7) / 7),
        "swing": ("swing_deg", tuple(cases), lambda x: (40 - x) / 40),
    }
    assert list(found) == list(checks)
    for name, (column, among, margin_of) in checks.items():
        case = min(among, key=lambda one: margin_of(rows[one][column]))
        row, margin = found[name], margin_of(rows[case][column])
        assert (row["case"], row["value"]) == (case, rows[case][column])
        assert row["margin"] == pytest.approx(margin, rel=1e-12)
        assert row["status"] == ("ok" if margin >= 0 else "not met")
    assert [row["case"] for row in found.values()] == ["ice", "everyday", "hot", "storm"]
    assert [row["status"] for row in found.values()] == ["ok", "not met", "ok", "not met"]


def test_exit_codes_and_formats():
    assert run("static", "line.yaml", "--limits", code=1).lines == [
        "not met: everyday (everyday): utilisation <= 20 %", "not met: swing (storm): 40 deg > swing",
    ]  # fmt: skip
    sets = "--set", "limits.swing=swing < 50 deg", "--set", "cable.tension.value=19 %"
    assert set(table_of("static", "line.yaml", "--limits", *sets)[0]) >= {"name", "case", "value", "limit", "margin"}
    assert {row["status"] for row in limits("line.yaml", *sets, code=0).values()} == {"ok"}
    scene = cs.load("line.yaml")
    assert scene.limits().set_index("name")["margin"].to_dict() == {n: row["margin"] for n, row in limits().items()}
    assert json.loads(run("static", "line.yaml", "--limits", "--format", "json", code=1).out)["errors"][0]["margin"] > 0


@undrawn()
def test_a_report_begins_with_the_limits():
    write("short.yaml", CABLE + ", preload: 20 kN}\nlimits: {a: sag <= 1 m, b: chord >= 1 m}\n")
    done = run("report", "short.yaml")
    page = Path("short.html").read_text(encoding="utf-8")
    assert page.index(">Limits</h2>") < page.index(">Scene</h2>")
    assert page.index("least margin of the limits, reference") < page.index("largest tension")
    assert '<td class="word">not met</td>' in page
    assert '<td class="word">ok</td>' in page
    assert done.lines[0] == "not met: a (reference): sag <= 1 m"
    run("report", "short.yaml", "--set", "limits.a=sag <= 99 m")  # where all hold too
    assert Path("short.html").read_text(encoding="utf-8").count('<td class="word">ok</td>') == 2


def test_a_strict_limit_does_not_hold_at_its_number():
    """The chord of 200 m is exact: a margin of zero."""
    chords = "{a: chord <= 200 m, b: chord < 200 m, c: 200 m >= chord, d: chord > 200 m}"
    write("level.yaml", f"{CABLE}, preload: 20 kN}}\nlimits: {chords}\n")
    found = limits("level.yaml", code=1)
    assert {row["margin"] for row in found.values()} == {0}
    assert [found[name]["status"] for name in "abcd"] == ["ok", "not met", "ok", "not met"]
    assert {row["case"] for row in found.values()} == {"reference"}


def test_a_case_may_have_the_name_of_the_reference_state():
    sets = "--set", "cases={reference: {temperature: 80 degC}}", "--set", "limits={a: clearance >= 7 m}"
    hot = table_of("static", "line.yaml", "--case", "hot", "--set", "limits=null")[0]["clearance_m"]
    row = limits("line.yaml", *sets, code=0)["a"]
    assert (row["case"], row["value"]) == ("reference", hot)


def test_cables_of_a_suspension():
    """A column of one cable stands for each that has it; guy3 has no strength."""
    found = limits("mast.yaml", code=1)
    rows = {
        case: table_of("static", "mast.yaml", "--table", "cables", *(("--case", case) if case else ()))
        for case in ("cold", "push", "")
    }
    of_cables = {(case, row["name"]): row for case, some in rows.items() for row in some}
    worst = max((key for key in of_cables if key[1] != "guy3"), key=lambda key: of_cables[key]["utilisation"])
    row = found["strength"]
    assert (row["case"], row["cable"]) == worst
    assert row["value"] == pytest.approx(of_cables[worst]["utilisation"], rel=1e-12)
    assert row["margin"] == pytest.approx(1 - row["value"] / 0.1, rel=1e-9)
    assert (found["guy"]["case"], found["guy"]["cable"]) == ("reference", "")
    assert found["guy"]["value"] == pytest.approx(of_cables["", "guy1"]["preload_N"], rel=1e-12)
    assert (found["sway"]["case"], found["sway"]["status"]) == ("push", "ok")  # the only case with forces
    largest = max(of_cables, key=lambda key: of_cables[key]["max_tension_N"])
    assert found["all"]["case"] == largest[0]
    assert found["all"]["value"] == pytest.approx(of_cables[largest]["max_tension_N"], rel=1e-12)


def test_a_column_that_cables_have_in_one_case_is_compared_there():
    """Only guy2 has a load, in one case; a load case that is chosen changes nothing."""
    case = "cases.fitter.loads={guy2: [{fraction: 0.5, mass: 80 kg}]}"
    sets = with_sets(case, "limits={a: load_sag <= 4 m}")
    row = limits("mast.yaml", *sets, code=0)["a"]
    assert (row["case"], row["cable"]) == ("fitter", "guy2")
    study = "{base: mast.yaml, set: {limits: {a: load_sag <= 4 m}}, vary: [{case: [fitter]}], columns: [guy2.load_sag]}"
    (alone,) = table_of("sweep", "-", "--no-write", *sets[:2], stdin=study)
    assert row["value"] == alone["guy2.load_sag_m"]
    assert limits("mast.yaml", *sets, "--set", "case=cold", code=0)["a"] == row


FREQUENCY = "outofplane_frequency_1"
# over a pointed hill the drag changes sharply along the span
HILL = (
    "ground=[[0, 0], [100 m, 2 m], [150 m, 9 m], [170 m, 0], [300 m, 0]]",
    "cases.storm.wind={speed: 30 m/s, direction: 90 deg, at: 10 m, exponent: 0.2}",
    "model.accuracy=1e-8",
)


def frequency_in_storm(*sets):
    """FREQUENCY of line.yaml in its storm, and its stated relative error. [Hz], [-]"""
    row = solve(load_scene("line.yaml", ["case=storm", *sets])[1], FREQUENCY)
    return row.values[FREQUENCY], row.errors[FREQUENCY]


@pytest.mark.parametrize("share", [-2, -0.5, 0.5, 2])
def test_a_margin_below_the_stated_error_is_undecided(share):
    """Limits above and below a frequency in a storm, by half of its stated error and by twice that."""
    value, error = frequency_in_storm()
    assert error > 1e-6
    limit = f"{{that: {FREQUENCY} <= {value * (1 + share * error)!r} Hz, cases: [storm]}}"
    done = run("static", "line.yaml", "--limits", "--set", f"limits={{a: {limit}}}", code=1 if share < 0 else 0)
    assert [line.partition(":")[0] for line in done.lines] == ["not met"] * (share < 0) + ["undecided"] * (
        abs(share) < 1
    )
    if abs(share) < 1:
        assert f"a (storm): the stated error is larger than the margin: {FREQUENCY} <=" in done.lines[-1]


@pytest.mark.parametrize(("share", "warned"), [(0.2, "undecided: a (storm)"), (0.8, "not met: a (cold)")])
def test_a_load_case_that_does_not_govern_may_be_undecided(share, warned):
    """A frequency on a cold day, of small error, governs; that in a storm is below the limit by less than its error.

    Nothing is undecided where the cold day exceeds the limit for certain.
    """
    value, error = frequency_in_storm(*HILL)
    assert error > 1e-5

    def excess(temperature):
        cold = load_scene("line.yaml", ["case=cold", f"cases.cold.temperature={temperature!r}", *HILL])[1]
        return solve(cold, FREQUENCY).values[FREQUENCY] - (1 + share * error) * value

    cold = f"cases.cold.temperature={brentq(excess, 180, 290)!r}"
    limit = f"limits={{a: {{that: {FREQUENCY} <= {(1 + error / 2) * value!r} Hz, cases: [cold, storm]}}}}"
    done = run("static", "line.yaml", "--limits", *with_sets(cold, limit, *HILL), code=None)
    assert [line[: len(warned)] for line in done.lines] == [warned]


# ------------------------------------------------------------------------------------------------------ closed forms


def catenary(horizontal):
    """Sag and largest tension of an inextensible catenary over the span: H/w (cosh(w l/2H) - 1), H cosh(w l/2H)."""
    argument = MASS * GRAVITY * SPAN / 2 / horizontal
    return horizontal / (MASS * GRAVITY) * (cosh(argument) - 1), horizontal * cosh(argument)


def test_the_range_of_a_rigid_cable_is_that_of_the_catenary():
    """It hardly stretches: at a horizontal tension, sag and largest tension are those of `catenary`."""
    tension = "{at: horizontal, value: 10 kN}"
    cable = f"chord: {SPAN} m, axial_stiffness: 1e15, mass_per_length: {MASS}, tension: {tension}"
    write("rigid.yaml", f"cable: {{{cable}}}\nlimits: {{low: sag <= 5 m, strong: max_tension <= 12 kN}}\n")
    found = table_of("find", "rigid.yaml", "limits", "--by", "cable.tension.value")
    low = brentq(lambda h: catenary(h)[0] - 5, 1e3, 1e5, xtol=1e-9, rtol=1e-15)
    high = brentq(lambda h: catenary(h)[1] - 12e3, 1e3, 1e5, xtol=1e-9, rtol=1e-15)
    ends = {row["end"]: row["governing"] for row in found}
    assert ends == {"from": "low (reference)", "to": "strong (reference)"}
    assert [row["cable.tension.value_N"] for row in found] == pytest.approx([low, high], rel=1e-8)


def test_margins_of_an_elastic_cable_in_cold_and_ice():
    """The catenary at 50 digits: of the reference length, of that length when cold, and of it under ice."""
    write(
        "elastic.yaml",
        CABLE + ", unstretched_length: 200.1 m, expansion: 12e-6 1/K}\n"
        "cases: {cold: {temperature: -11.85 degC}, ice: {ice: {weight: 10 N/m}}}\n"
        "limits: {strength: utilisation <= 35 %, sag: sag <= 2.6 m}\n",
    )
    lengths = {"reference": 200.1, "cold": 200.1 * (1 + 12e-6 * (261.3 - 288.15)), "ice": 200.1}
    weights = {"reference": MASS * GRAVITY, "cold": MASS * GRAVITY * 200.1 / lengths["cold"],
               "ice": MASS * GRAVITY + 10}  # fmt: skip
    sags, tensions = {}, {}
    for case, length in lengths.items():
        horizontal, vertical = catenary_mp.solve(SPAN, 0, length, STIFFNESS, weights[case])
        sags[case] = float(catenary_mp.sag(horizontal, vertical, length, STIFFNESS, weights[case]))
        tensions[case] = hypot(float(horizontal), float(vertical))
    found = limits("elastic.yaml", code=None)
    for name, numbers, bound in (("strength", tensions, 0.35e5), ("sag", sags, 2.6)):
        case = max(numbers, key=numbers.get)
        assert found[name]["case"] == case
        assert found[name]["margin"] == pytest.approx(1 - numbers[case] / bound, abs=3e-9)


# --------------------------------------------------------------------------------------------------------- find limits


def found_range(*arguments, scene="line.yaml"):
    done = run("find", scene, "limits", *arguments, "--format", "json")
    return rows_of(done.out, "json"), done.lines


def test_the_least_margin_changes_its_sign_at_the_ends_of_the_range():
    sets = "--set", "limits.swing=null"
    rows, lines = found_range("--by", "cable.tension.value", *sets, "--columns", "sag")
    ends = {row["end"]: row["governing"] for row in rows}
    assert ends == {"from": "clearance (hot)", "to": "everyday (everyday)"}
    assert lines[0].startswith("searched: cable.tension.value from 14010 to 56040 N")
    for row, (low, high) in zip(rows, ((20e3, 27e3), (27e3, 30e3)), strict=True):
        end, rises = row["cable.tension.value_N"], row["end"] == "from"
        for tension, met in ((low, not rises), (end - 1, not rises), (end + 1, rises), (high, rises)):
            each = limits("line.yaml", *sets, "--set", f"cable.tension.value={tension!r}").values()
            assert (min(one["margin"] for one in each) > 0) == met


def test_the_range_of_a_suspension_is_that_of_straight_cables():
    """Two weightless cables and a knot: 2 T sin(slope) = m g, the slope that of a cable of L (1 + T/EA)."""
    write(
        "knot.yaml",
        "cable: {elastic_modulus: 200e9, density: 1e-9, area: 1e-4, unstretched_length: 10.4 m}\n"
        "points: {knot: {at: [0, 0, -3 m], free: true, mass: 20 kg}, left: [-10 m, 0, 0], right: [10 m, 0, 0]}\n"
        "cables: {one: {from: left, to: knot}, two: {from: right, to: knot}}\n"
        "limits: {taut: min_tension >= 200 N, strong: preload <= 1 kN}\n",
    )

    def mass(tension):
        length = 10.4 * (1 + tension / 2e7)
        return 2 * tension * (length**2 - 100) ** 0.5 / length / 9.81

    rows, lines = found_range("--by", "points.knot.mass", scene="knot.yaml")
    assert [row["governing"].partition(",")[0].rstrip(")") for row in rows] == ["taut (reference", "strong (reference"]
    assert rows[1]["governing"][-4:-1] in ("one", "two")
    assert [row["points.knot.mass_kg"] for row in rows] == pytest.approx([mass(200), mass(1000)], rel=1e-6)
    assert lines[0].startswith("searched: points.knot.mass from")


def test_no_value_meets_all_limits():
    asked = ("find", "line.yaml", "limits", "--by", "cable.tension.value", "--between")
    line = refusal(*asked, "20kN:40kN", code=3)
    assert "no value of cable.tension.value from 20000 to 40000 N meets all limits: nearest is" in line
    assert "swing (storm)" in line  # whatever the tension
    sets = with_sets("limits.clearance=clearance >= 8 m", "limits.swing=null")
    line = refusal(*asked, "25kN:33kN", *sets, code=3)
    assert line.endswith("not met there: everyday (everyday), clearance (hot)")


def test_a_range_that_ends_with_what_was_searched():
    between = ("--by", "cable.tension.value", "--between", "26 kN:29 kN")
    rows, lines = found_range(*between, "--set", "limits={clearance: clearance >= 7 m}")
    ends = {row["end"]: (row["cable.tension.value_N"], row["governing"]) for row in rows}
    assert ends == {"from": (26e3, None), "to": (29e3, None)}
    for line, end in zip(lines, ("from cable.tension.value = 26000", "to cable.tension.value = 29000"), strict=True):
        assert line == f"all limits hold {end} N: the end of what was searched"


def test_ranges_between_zeros_jumps_and_values_without_an_answer():
    """(x - 1) (x - 2) (x - 3) in the place of the least margin: positive from 1 to 2 and beyond 3, unknown beyond 4."""
    places = np.linspace(0, 4, 21)
    values = (places - 1) * (places - 2) * (places - 3)
    found = Zeros([1.0, 2.0], [3.0], [], [], 0.0, 5.0, (places, values), False)
    ends = _range_ends(found, {4.5: "no equilibrium", 5.0: "no equilibrium", 4.0: "ok"})
    assert ends == [
        ("from", 1.0, ""), ("to", 2.0, ""), ("from", 3.0, ""), ("to", 4.0, "beyond, no equilibrium"),
    ]  # fmt: skip


# ------------------------------------------------------------------------------------------------------------- studies

STUDY = """\
base: line.yaml
vary:
- {cable.tension.value: {from: 20 kN, to: 32 kN, count: 4}}
- {limits.clearance: [clearance >= 7 m, clearance >= 4 m]}
columns: [limit_margin, governing, mass]
"""


def test_a_study_names_undecided_limits_among_its_notes():
    """Limits above a frequency in a storm by half of its stated error, and by twice that."""
    value, error = frequency_in_storm()
    limits = ", ".join(
        f'{{that: "{FREQUENCY} <= {value * (1 + share * error)!r} Hz", cases: [storm]}}' for share in (0.5, 2)
    )
    write("study.yaml", f"base: line.yaml\nvary: [{{limits.a: [{limits}]}}]\ncolumns: [limit_margin]\n")
    lines = [line for line in run("sweep", "study.yaml", "--no-write", "--explain").lines if "undecided" in line]
    assert len(lines) == 1
    assert "row 1: " in lines[0]
    assert "undecided: a (storm): the stated error is larger than the margin" in lines[0]


def test_columns_of_a_study_through_every_store_and_format():
    write("study.yaml", STUDY)
    run("sweep", "study.yaml", "--quiet")
    rows = stored_table()
    assert len(rows) == 8
    for row in rows[::3]:
        sets = [f"cable.tension.value={row['cable.tension.value_N']!r}", f"limits.clearance={row['limits.clearance']}"]
        found = limits("line.yaml", *with_sets(*sets))
        name = min(found, key=lambda one: found[one]["margin"])
        assert row["limit_margin"] == found[name]["margin"]  # to the last digit, alone and among others
        assert row["governing"] == f"{name} ({found[name]['case']})"
    assert len({row["governing"] for row in rows}) > 1
    assert table_of("show", "study.yaml") == rows
    assert "agrees" in run("sweep", "study.yaml", "--check").err
    largest = max(row["limit_margin"] for row in rows)
    assert table_of("show", "study.yaml", "--best", "max limit_margin")[0]["limit_margin"] == largest
    where = "--where", f"governing == {rows[0]['governing']!r} and limit_margin > -1"
    assert table_of("show", "study.yaml", *where) == [row for row in rows if row["governing"] == rows[0]["governing"]]
    front = table_of("show", "study.yaml", "--pareto", "max limit_margin, min mass")
    assert largest in [row["limit_margin"] for row in front]
    Path("results/study.rows.sqlite").unlink()  # now from the CSV alone
    assert table_of("show", "study.yaml") == rows
    assert cs.sweep("study.yaml")["governing"].tolist() == [row["governing"] for row in rows]
    text = Path("results/study.csv").read_text(encoding="utf-8")
    write("results/study.csv", text.replace(rows[0]["governing"], "clearance (ice)", 1))
    assert "governing: stored clearance (ice), computed" in run("sweep", "study.yaml", "--check", code=1).err


def test_a_study_draws_and_reports_text_beside_numbers():
    write("study.yaml", STUDY.replace("count: 4", "count: 2"))
    run("sweep", "study.yaml", "--no-write", "--quiet", "--plot", "margin.svg")
    assert Path("margin.svg").stat().st_size > 1000
    run("report", "study.yaml", "--quiet")
    page = Path("study.html").read_text(encoding="utf-8")
    assert "clearance (hot)" in page or "swing (storm)" in page
    wrong = STUDY + "plot: {x: cable.tension.value, y: governing}\n"
    write("study.yaml", wrong)
    assert "governing is text" in run("validate", "study.yaml", code=2).err


def test_a_number_and_a_text_come_back_from_a_stored_row():
    cells, headers = [0.1, None, 'a "b" (c, d)', 2], ["limit_margin", "sag_m", "governing", "iterations"]
    assert unpack(pack(3, "key", "ok", cells), headers).cells == cells
    assert unpack(pack(3, "key", "ok", cells), [*headers[:2], "mass_kg", headers[3]]) is None


def test_a_row_whose_scene_cannot_have_the_limit_fails_alone():
    write(
        "study.yaml",
        "base: line.yaml\nset: {limits: {a: utilisation <= 40 %}}\n"
        "vary: [{ground: [0 m, 5 m], limits.a: [clearance >= 6 m, clearence >= 6 m]}]\ncolumns: [sag, limit_margin]\n",
    )
    rows = table_of("sweep", "study.yaml", "--no-write", code=3)
    assert rows[0]["status"] == "ok"
    assert rows[1]["limit_margin"] is None
    assert rows[1]["sag_m"] == rows[0]["sag_m"]
    assert "limits.a: unknown column 'clearence' (did you mean clearance?)" in rows[1]["status"]


def test_a_load_case_without_an_answer_is_named():
    """A gondola that a force pulls past the length of its rope, and other limits that have theirs."""
    write(
        "slack.yaml",
        CABLE + ", preload: 20 kN}\ngravity: 0\n"
        "cases: {on: {}, near: {moves: {end_2: [-1 m, 0, 0]}}}\n"
        "limits: {sag: sag <= 1 m, length: unstretched_length <= 201 m, on: {that: sag <= 1 m, cases: [on]}}\n",
    )
    found = limits("slack.yaml", code=3)
    assert found["sag"]["status"].startswith("no answer in near: a slack cable without weight")
    assert [found[name]["status"] for name in ("length", "on")] == ["ok", "ok"]
    told = run("static", "slack.yaml", "--limits", code=3).err
    assert told.startswith("slack.yaml: no answer in near: a slack cable")


# ----------------------------------------------------------------------------------------------------------- malformed

WRONG = {  # limits -> what the line says; behind 9:13: limits.a where it begins with no place
    "{a: clearence >= 6 m}": "unknown column 'clearence' (did you mean clearance?)",
    "{a: {that: sag <= 7 m, cases: [iec]}}": '9:40: limits.a.cases.0: unknown load case "iec" (did you mean ice?)',
    "{a: clearance >=}": "expected COLUMN <= NUMBER, for example 'clearance >= 6 m', got \"clearance >=\"",
    "{a: sag = 6 m}": "unexpected '=' at character 5: expected COLUMN <= NUMBER, for example 'clearance >= 6 m'",
    "{a: sag == 6 m}": 'a limit leaves a margin: write <= or >=, got "sag == 6 m"',
    "{a: sag < 7 m and swing < 1}": '"sag < 7 m and swing < 1" are two limits: give each a name of its own',
    "{a: 1 m < sag < 7 m}": '"1 m < sag < 7 m" are two limits: give each a name of its own',
    "{a: not sag < 7}": "expected COLUMN <= NUMBER, for example 'clearance >= 6 m', got \"not sag < 7\"",
    "{a: sag <= clearance}": "expected COLUMN <= NUMBER, for example 'clearance >= 6 m', got \"sag <= clearance\"",
    "{a: clearance >= 6 kN}": 'clearance: "kN" (force) and "m" (length) do not fit each other',
    "{a: clearance >= 0 m}": "a margin is relative to the limit, which must not be 0: clearance >= 0 m",
    "{a: status <= 1}": "status is no result that a limit could hold for",
    "{a: limit_margin >= 0.1}": "limit_margin is no result that a limit could hold for",
    "{a: max_tension <= 60 %}": 'max_tension: expected a force, got "60 %": write max_tension = 84060 N, which is that '
    "share of the breaking force of 140100 N",
    "{a: gondola_frequency >= 1 Hz}": "gondola_frequency needs the key gondola.mass, which the scene does not have",
    "{a: {that: peak <= 1 mm}}": "9:20: limits.a.that: peak needs the key gondola.mass, which the scene does not have",
    "{a: {that: deflection <= 1 m, cases: [ice]}}": "9:20: limits.a.that: deflection needs the key cable.loads, which "
    "the scene does not have (load case ice)",
    "{a: 6}": "expected a comparison, such as 'clearance >= 6 m', or a mapping with the keys that, cases, got 6",
    "{a: {that: sag <= 7 m, case: ice}}": "9:32: limits.a.case: unknown key (did you mean cases?)",
    "{a: {that: sag <= 7 m, cases: []}}": "9:39: limits.a.cases: expected at least 1 item, got 0",
    "{a: {cases: [ice]}}": "missing key: that",
    "{a.b: sag <= 7 m}": "9:10: limits.a.b: a name of a limit begins with a letter or a digit and has no dot, comma or "
    '=, got "a.b"',
    "[sag <= 7 m]": "9:9: limits: expected a mapping, got a list",
    "{a: sag <= 1e999 m}": 'sag: expected a number in m, or with a unit, got "1e999 m" (out of range)',
}


@pytest.mark.parametrize("text", WRONG)
def test_malformed_limits_are_refused_in_one_line(text):
    line = (CONFIGS / "line.yaml").read_text().partition("cases:")[0].rstrip()
    write("wrong.yaml", f"{line}\ncases: {{ice: {{temperature: -5 degC}}}}\nlimits: {text}\n")
    for command in ("validate", "static", "modes"):
        done = run(command, "wrong.yaml", code=2)
        line = WRONG[text] if WRONG[text].startswith("9:") else f"9:13: limits.a: {WRONG[text]}"
        assert done.lines == [f"wrong.yaml:{line}"], command


@pytest.mark.parametrize("file", ["line.yaml", "suspensions/mast-levels.yaml"])
def test_a_wrong_case_is_told_beside_a_limit_on_another_one(file):
    sets = [f"--set={key}" for key in ("case=icee", "limits={a: {that: max_tension <= 7 kN, cases: [icy]}}")]
    lines = run("validate", CONFIGS / file, *sets, code=2).lines
    wrong = [text for text in lines if "unknown" in text]
    assert len(wrong) == 2
    assert 'case: unknown case "icee"' in wrong[0]
    assert 'limits.a.cases.0: unknown load case "icy"' in wrong[1]


def test_limits_that_have_no_effect_or_are_not_there(folder):
    for path in folder.iterdir():
        path.unlink()
    line = str(CONFIGS / "line.yaml")
    by, some = ("--by", "cable.tension.value"), ("--set", "limits={a: sag <= 9 m}")
    none = ("--set", "limits=null")
    for words, arguments in {
        "limits: missing key: 'cablestudy static --limits' needs it": ("static", line, *none, "--limits"),
        "limit_margin needs the key limits, which the scene does not have": ("find", line, *none, "limits", *by),
        "--case: no effect: --limits has each limit": ("static", line, *some, "--limits", "--case", "ice"),
        "--case: no effect: limits say themselves": ("find", line, *some, "limits", *by, "--case", "ice"),
        "there is no picture of this": ("static", line, *some, "--limits", "--plot", "a.svg"),
        "limit_margin is of several load cases": ("trade", line, *some, "--columns", "limit_margin"),
        "governing is text": ("find", line, *some, "governing = 1", *by),
    }.items():
        refused_in_one_line(folder, words, *arguments)


def test_a_suspension_names_what_its_cables_lack():
    for limit, words in {
        "clearance >= 3 m": "guy1.clearance needs the key ground, which the scene does not have",
        "guy9.sag <= 1 m": "no body, free point, cable or link guy9 (did you mean guy3?)",
        "tension_1 <= 3 kN": "tension_1 is a column of a single cable; here it is CABLE.tension_from",
    }.items():
        done = run("validate", "mast.yaml", "--set", f"limits={{a: {limit}}}", code=2)
        assert done.lines == [f"--set limits: limits.a: {words}"]


def test_limits_change_no_other_number():
    assert load_scene("line.yaml")[1].limits
    assert not load_scene("line.yaml", ("limits=null",))[1].limits
    every = ("static", "line.yaml", "--case", "all")
    assert table_of(*every) == table_of(*every, "--set", "limits=null")
