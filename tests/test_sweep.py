"""Studies from file to table: rows that fail, printed values, several processes, the check against stored tables."""

import json
import math
from itertools import product
from pathlib import Path

import pytest
from command import CARLINA, CONFIGS, SLACK, run, stored_table, study_file, table_of, write

from cablestudy.sweeps.run import Run

PRELOAD = str(CONFIGS / "preload.yaml")


pytestmark = pytest.mark.usefixtures("folder")


def swept(folder, text, *arguments, base=CARLINA, code=0):
    return table_of("sweep", study_file(folder, text, base), "--no-write", *arguments, code=code)


def test_a_row_that_fails_leaves_the_others_standing(folder):
    text = "vary: [{cable.preload: [1345 N, 1 N, 100 kN, 2000 N]}]\ncolumns: [preload, sag, chord, cable_frequency]\n"
    rows = swept(folder, text, code=3)
    assert [row["status"] for row in rows] == ["ok", rows[1]["status"], "over strength", "ok"]
    assert "below the least that this cable can have" in rows[1]["status"]
    assert [rows[1][name] for name in ("preload_N", "sag_m", "cable_frequency_Hz")] == [None] * 3
    assert rows[1]["chord_m"] == 185.8  # of the scene, which needs no equilibrium
    assert rows[2]["preload_N"] == pytest.approx(100e3, rel=1e-6)
    assert rows[0]["preload_N"] == pytest.approx(1345, rel=1e-6)  # 40 bars
    outcome = run("sweep", "study.yaml", code=3)
    said = [line.partition(":")[0] for line in outcome.lines]
    assert said == ["row 2", "1 of 4 rows have no answer", "row 2 alone", "warning", "written"]
    assert outcome.lines[3] == "warning: the stress is above the strength in 1 of 4 rows: 3"
    assert [row["sag_m"] is None for row in stored_table()] == [False, True, False, False]
    assert run("sweep", "study.yaml", "--quiet", code=3).err == ""
    run("sweep", "study.yaml", "--check")  # as stored: the check holds


def test_rows_over_strength_are_answers(folder):
    """Aramid of 3000 MPa and 2.69 mm^2 holds 8.07 kN; the rows are closed forms, elements, and to an accuracy."""
    text = "vary: [{model: [{accuracy: 1e-4}, {elements: 40}]}, {cable.preload: [8.06 kN, 8.08 kN]}]\n"
    for columns in ("[sag, gondola_rms_open_loop, error_estimate]", "[sag, cable_frequency]", "[utilisation, sag]"):
        damping = "set: {cable.damping: {model: kelvin_voigt, time: 1 ms}}\n"
        rows = swept(folder, f"{text}{damping}columns: {columns}\n")
        assert [row["status"] for row in rows] == ["ok", "over strength"] * 2, columns
        assert None not in [cell for row in rows for cell in row.values()]
    outcome = run("sweep", "study.yaml", "--fail-fast")
    assert outcome.lines[0] == "warning: the stress is above the strength in 2 of 4 rows: 2, 4"
    assert [line[-17:] for line in outcome.out.splitlines()[2:]] == ["| ok            |", "| over strength |"] * 2
    assert run("sweep", "study.yaml", "--check").lines[-1].endswith("study.csv: agrees")
    stored = Path("results/study.csv")
    write(stored, stored.read_text(encoding="utf-8").replace("over strength", "ok"))
    wrong = [f"{stored}: row {row}, status: stored ok, computed over strength" for row in (2, 4)]
    assert run("sweep", "study.yaml", "--check", code=1).lines[1:] == wrong
    warning = "warning: the stress is above the strength in 1 of 1 rows: 2"
    assert run("sweep", "study.yaml", "--row", 2).lines == [warning]


def test_what_cannot_be_had_comes_before_over_strength(folder):
    text = "set: {cable.preload: 10 kN, winch.controller.gain: 1000 rad/s}\ncolumns: [utilisation, gondola_rms]\n"
    (row,) = swept(folder, text, code=3)
    reason, _, last = row["status"].rpartition("; ")
    assert reason.startswith("the loop is unstable at 1000 rad/s")
    assert last == "over strength"
    assert row["utilisation"] == pytest.approx(10 / 8.07, rel=1e-4)
    # what the scene states alone says nothing of a stress
    for columns, status in (("chord, mass", "over strength"), ("chord", "ok")):
        assert swept(folder, f"set: {{cable.preload: 10 kN}}\ncolumns: [{columns}]\n")[0]["status"] == status


def test_a_study_whose_every_case_fails(folder):
    rows = swept(folder, "vary: [{cable.preload: [1 N, 2 N]}]\ncolumns: [sag, status, dof, error_estimate]\n", code=3)
    assert list(rows[0]) == ["cable.preload_N", "sag_m", "dof", "error_estimate", "status"]
    assert [list(row.values())[:-1] for row in rows] == [[1, None, 0, None], [2, None, 0, None]]


@pytest.mark.parametrize(
    ("sets", "status"),
    [
        ("{cable.chord: 185.8, cable.inclination: 90 deg, cable.unstretched_length: 200}", "folded"),
        ("{cable.unstretched_length: 186, model: {elements: 1}}", "for so sharp a bend"),
        ("{gravity: 0, cable.unstretched_length: 186}", "without weight has no definite form"),
        ("{cable.preload: 5 kN, cable.reference: {loads: true}, cable.loads: [{at: 185 m, force: [0, 0, -1]}]}",
         "ends before its last load"),
        ("{cable.sag: 1e5 m}", "no unstretched length gives a sag"),
    ],
)  # fmt: skip
def test_a_case_without_an_answer_says_why(folder, sets, status):
    rows = swept(folder, f"set: {sets}\ncolumns: [sag, cable_frequency]\n", code=3)
    assert status in rows[0]["status"]
    assert rows[0]["cable_frequency_Hz"] is None


def test_a_part_without_weight_that_is_slack_has_tensions_and_no_form(folder):
    """Pulled along by 3 kN at mid-length: the first half carries it all, and its stretch leaves the second slack."""
    loads = "{gravity: 0, model: {accuracy: 1e-6}, cable.loads: [{at: 92 m, force: [3000, 0, 0]}]}"
    (row,) = swept(folder, f"set: {loads}\ncolumns: [max_tension, min_tension, end_stiffness]\n")
    assert list(row.values()) == [3000, 0, 0, "ok"]
    (row,) = swept(folder, f"set: {loads}\ncolumns: [sag]\n", code=3)
    assert row["status"] == "no sag: a part of the cable without weight is slack: it has no definite form"
    (row,) = swept(folder, f"set: {loads}\ncolumns: [cable_frequency]\n", code=3)
    assert row["status"].startswith("the cable hangs folded")


def test_a_slack_cable_without_weight_has_no_tension_and_no_form(folder):
    """As the same cable of a suspension: what its ends and its length say stays."""
    slack = "{gravity: 0, model: {accuracy: 1e-6}, cable.unstretched_length: 186}"
    known = {"preload": 0, "min_tension": 0, "stretched_length": 186, "end_stiffness": 0, "reaction_1_vertical": 0}
    (row,) = swept(folder, f"set: {slack}\ncolumns: [{', '.join(known)}]\n")
    assert list(row.values()) == [*known.values(), "ok"]
    for name in ("sag", "swing", "lowest_point", "angle_1", "cable_frequency", "inplane_frequency_2"):
        (row,) = swept(folder, f"set: {slack}\ncolumns: [{name}, preload]\n", code=3)
        assert list(row.values()) == [None, 0, "a slack cable without weight has no definite form"]


@pytest.mark.parametrize(
    "sets",
    [
        "{cable.chord: 185.8, cable.inclination: 90 deg}",  # vertical, taut
        "{cable.chord: 185.8, cable.inclination: -90 deg}",
        "{model: {elements: 1, order: 64}, cable.unstretched_length: 186}",
        "{model: {elements: 2}, cable.unstretched_length: 186}",
        "{gravity: 0}",
        "{cable.loads: [{at: 1e-6 m, force: [0, 0, -1]}]}",
        "{cable.loads: [{at: 92 m, force: [0, 5 N, -1]}, {at: 92 m, force: [0, -5 N, 0]}]}",
        "{cable.density: 1e-9, cable.unstretched_length: 180}",
    ],
)
def test_odd_cables_that_have_an_answer(folder, sets):
    text = f"set: {sets}\ncolumns: [preload, min_tension, end_stiffness, cable_frequency]\n"
    row = swept(folder, text)[0]
    assert min(row[name] for name in ("min_tension_N", "end_stiffness_N_per_m", "cable_frequency_Hz")) > 0


def test_grid_and_zip_and_what_varies_is_shown(folder):
    text = (
        "vary:\n"
        "  - {cable.diameter: [1 mm, 2 mm]}\n"
        "  - {gondola.mass: {from: 10 kg, to: 1000 kg, count: 3, spacing: log},\n"
        "     winch.location: [ground, gondola, ground]}\n"
        "columns: [diameter, gondola_frequency_static]\n"
    )
    rows = swept(folder, text)
    shown = [(row["diameter_mm"], row["gondola.mass_kg"]) for row in rows]
    assert shown == list(product((1.0, 2.0), (10.0, 100.0, 1000.0)))
    assert not [name for name in rows[0] if name.startswith("cable.diameter")]  # its column shows it
    assert rows[0]["winch.location"] == "ground"
    # sqrt(1/m): ten times heavier, sqrt(10) slower
    assert rows[0]["gondola_frequency_static_Hz"] / rows[1]["gondola_frequency_static_Hz"] == pytest.approx(10**0.5)


def test_a_case_that_lacks_what_a_column_needs(folder):
    text = "vary: [{gondola: [{mass: 5 kg}, null]}]\ncolumns: [sag, gondola_frequency]\n"
    rows = swept(folder, text, code=3)
    assert rows[0]["status"] == "ok"
    assert rows[1]["status"] == "gondola_frequency needs the key gondola.mass, which this case does not have"


def test_the_check_passes_on_what_was_written_and_shows_what_was_changed():
    run("sweep", PRELOAD)
    stored = Path("results/preload.csv")
    assert run("sweep", PRELOAD, "--check").out == ""
    lines = stored.read_text(encoding="utf-8").splitlines()
    cells = lines[3].split(",")
    place = lines[0].split(",").index("end_stiffness_N_per_m")
    computed, cells[place] = cells[place], repr(float(cells[place]) * 1.25)
    write(stored, "\n".join([*lines[:3], ",".join(cells), *lines[4:]]) + "\n")
    message = f"{stored}: row 3, end_stiffness_N_per_m: stored {cells[place]}, computed {computed}, ratio 0.8"
    for options in ((), ("--quiet",), ("--rtol", "0.19")):
        assert message in run("sweep", PRELOAD, "--check", *options, code=1).lines
    assert run("sweep", PRELOAD, "--check", "--rtol", "0.25").lines == [f"{stored}: agrees"]
    left = sorted(path.name.removeprefix("preload.") for path in Path("results").iterdir())
    assert left == ["csv", "md", "rows.sqlite", "run.yaml"]


def interrupt(_):
    raise KeyboardInterrupt


def test_a_stored_table_of_another_shape_fails_the_check(monkeypatch):
    run("sweep", PRELOAD)
    stored = Path("results/preload.csv")
    text = stored.read_text(encoding="utf-8")
    write(stored, text.replace("sag_m", "sagg_m", 1))
    lines = [
        "results/preload.csv: column sagg_m: stored, not computed",
        "results/preload.csv: column sag_m: computed, not stored",
    ]
    assert run("sweep", PRELOAD, "--check", code=1).lines == lines
    with monkeypatch.context() as patched:
        patched.setattr(Run, "compute", interrupt)  # the columns are told before
        done = run("sweep", PRELOAD, "--check", code=130)
    assert done.lines[:2] == lines
    write(stored, "\n".join(text.splitlines()[:-1]) + "\n")
    assert run("sweep", PRELOAD, "--check", code=1).lines == ["results/preload.csv: 5 rows stored, 6 computed"]
    write(stored, "")
    assert "not a table" in run("sweep", PRELOAD, "--check", code=2).err


def test_no_write_writes_nothing_and_out_says_where(folder):
    run("sweep", PRELOAD, "--no-write")
    assert list(folder.iterdir()) == []
    outcome = run("sweep", PRELOAD, "--out", "a/b")
    assert outcome.err == "written: a/b/preload.csv, a/b/preload.md\n"
    table = Path("a/b/preload.md").read_text(encoding="utf-8")
    assert table == f"# Table 6: influence of preload\n\n{outcome.out}"


def test_printed_values_stand_beside_the_computed_ones(folder):
    write("printed.csv", "sag_m,preload_N\n0.12,\n,1343\n0.5,\n")
    text = "vary: [{cable.preload: [1345 N, 1343 N, 1 N]}]\ncolumns: [sag_m, preload]\nreference: printed.csv\n"
    first, second, failed = swept(folder, text, code=3)
    assert [row["sag_printed_m"] for row in (first, second, failed)] == [0.12, None, 0.5]
    assert first["sag_difference_m"] == first["sag_m"] - 0.12
    assert second["sag_difference_m"] is None
    assert second["preload_difference_N"] == second["preload_N"] - 1343
    assert (failed["sag_m"], failed["sag_difference_m"]) == (None, None)
    assert "0.12 (+0.0011)" in run("sweep", "study.yaml", "--no-write", code=3).out


def test_json_states_the_errors_of_the_motion_of_fixed_elements(folder):
    study_file(folder, "vary: [{model.elements: [10, 40]}]\ncolumns: [sag, cable_frequency]\n")
    answer = json.loads(run("sweep", "study.yaml", "--format", "json").out)
    for elements, errors in zip((10, 40), answer["errors"], strict=True):
        x = math.pi / 2 / elements
        assert errors["cable_frequency_Hz"] == pytest.approx(1 - math.sin(x) / x, rel=0.01)  # a taut string
        assert 1e-12 < errors["sag_m"] < 0.01
    assert answer["rows"] == stored_table()


def test_explain_names_the_row(folder):
    study_file(folder, "vary: [{model: [{elements: 4}, {accuracy: 1e-3}]}]\ncolumns: [cable_frequency]\n")
    notes = run("sweep", "study.yaml", "--no-write", "--explain").lines
    assert any(note.startswith("row 1: model: 4 elements of order 1") for note in notes)
    assert any(note.startswith("row 2: motion: 1 element of order") for note in notes)


def test_run_time_columns(folder):
    rows = swept(folder, "columns: [solve_time, dof, iterations, status, sag, error_estimate]\n", base=SLACK)
    assert rows[0]["solve_time_ms"] > 0
    assert (rows[0]["dof"], rows[0]["status"]) == (0, "ok")
    assert list(rows[0]) == ["solve_time_ms", "dof", "iterations", "sag_m", "error_estimate", "status"]
    run("sweep", "study.yaml", "--out", ".")
    run("sweep", "study.yaml", "--out", ".", "--check", "--rtol", "0")  # the time itself is not compared


def test_a_larger_preload_has_less_sag(folder):
    text = "vary: [{cable.preload: {from: 1 kN, to: 2 kN, count: 100}}]\nset: {model: null}\ncolumns: [sag]\n"
    sags = [row["sag_m"] for row in swept(folder, text)]
    assert len(sags) == 100
    assert sags == sorted(sags, reverse=True)
