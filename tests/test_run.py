"""What a run says and leaves: failures and their replay, shards, provenance, tolerances."""

import os
import platform
import re
import shlex
import sqlite3
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy
import pytest
import scipy
import yaml
from campaign import campaign
from command import (
    CARLINA,
    CONFIGS,
    SLACK,
    interrupt,
    process,
    refusal,
    run,
    stored_rows,
    stored_table,
    study_file,
    table_of,
    write,
)

from cablestudy import __version__
from cablestudy.errors import SceneError
from cablestudy.scene.study import ALL_COLUMNS
from cablestudy.scene.tolerances import SCENE
from cablestudy.study.table import Field, Table
from cablestudy.sweeps.check import Difference, compare, read_tolerances
from cablestudy.sweeps.fingerprint import RESULTS_VERSION
from cablestudy.sweeps.run import read_shard
from cablestudy.sweeps.tolerances import SWEEPS

pytestmark = pytest.mark.usefixtures("folder")

VARY = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m, 189 m, 190 m]}, {cable.area: [20 mm^2, 24 mm^2]}]\n"
SHARDED = VARY + "columns: [preload, sag, area]\n"
FAILING = (
    "vary: [{cable.preload: [1345 N, 1 N, 100 kN, 110 kN, 2000 N]}, {gondola.mass: [5 kg, '7 kg']}]\n"
    "columns: [preload, sag, cable_frequency]\n"
    "set: {model: null, cable.loads: [{at: 150 m, force: [0 N, 0 N, -1 N]}]}\n"  # 100 kN need a shorter cable
)


def test_failures_are_counted_by_kind_and_each_can_be_seen_alone():
    outcome = run("sweep", study_file(".", FAILING), "--set", "gravity=9.8 m/s^2", "--jobs", "1", code=3)
    assert [line.partition(":")[0] for line in outcome.lines[:6]] == [f"row {row}" for row in range(3, 9)]
    assert outcome.lines[6].startswith(
        "6 of 10 rows have no answer: 4 x the load at … m is beyond the cable's end, at … m; 2 x a mean tension of … N"
    )
    replays = [line.partition(" alone: ") for line in outcome.lines[7:10]]
    assert [row for row, _, _ in replays] == ["row 3", "row 4", "row 5"]
    stored = stored_table()
    before = {path: path.read_bytes() for path in Path("results").iterdir()}
    for number, (_, _, command) in enumerate(replays, 2):
        program, *words = shlex.split(command)
        assert program == "cablestudy"
        assert table_of(*words, code=3) == [stored[number]]
    alone = process(*shlex.split(replays[0][2])[1:])  # as typed
    assert (alone.code, alone.lines[:1]) == (3, [f"row 3: {stored[2]['status']}"])
    assert {path: path.read_bytes() for path in Path("results").iterdir()} == before
    right = ("sweep", "study.yaml", "--set", "gravity=9.8 m/s^2", "--row", "10")
    assert table_of(*right) == [stored[9]]
    assert run(*right, "--quiet").err == ""
    assert run("sweep", "study.yaml", "--row", "11", code=2).lines == ["--row 11: the study has 10 cases"]


def test_a_study_from_standard_input_has_no_command_to_replay(folder):
    text = f"base: {CARLINA}\n{FAILING}"
    outcome = run("sweep", "-", stdin=text, code=3)
    assert outcome.lines[-1].startswith("written: ")
    assert "alone" not in outcome.err


def test_of_many_failures_the_first_are_shown():
    study_file(".", "vary: [{cable.preload: {from: 1 N, to: 2 N, count: 14}}]\ncolumns: [sag]\n", SLACK)
    said = [line.partition(":")[0] for line in run("sweep", "study.yaml", "--no-write", code=3).lines]
    assert said[:10] == [f"row {row}" for row in range(1, 11)]
    assert said[10:] == ["14 of 14 rows have no answer", *(f"row {row} alone" for row in (1, 2, 3))]


def test_a_case_that_was_not_checked_fails_alone(folder, monkeypatch):
    monkeypatch.setattr(type(SCENE), "checked_cases", 3)
    # each value is right beside the first of the others, and the last two of both are not right together
    text = "vary: [{cable.chord: [10 m, 186 m]}, {cable.unstretched_length: [40 m, 30 m]}]\ncolumns: [sag]\n"
    study_file(folder, text, SLACK)
    rows = table_of("sweep", "study.yaml", "--jobs", "1", code=3)
    assert [row["status"] == "ok" for row in rows] == [True, True, False, False]
    assert rows[3]["sag_m"] is None
    assert rows[3]["status"].startswith("cable.unstretched_length: 30 m is 0.161 times the distance of the ends, 186 m")


def test_fail_fast_stops_and_the_run_can_go_on(folder, monkeypatch):
    study_file(folder, FAILING)
    monkeypatch.setattr(type(SWEEPS), "chunk_time", 0.0)
    outcome = run("sweep", "study.yaml", "--fail-fast", "--jobs", "1", code=3)
    assert outcome.out == ""
    first, *_, last = outcome.lines
    assert first.startswith("row 3: ")
    assert last == "stopped at the first case without an answer (--fail-fast); --resume goes on: 3 rows are done"
    assert [path.name for path in Path("results").iterdir()] == ["study.rows.sqlite"]
    run("sweep", "study.yaml", "--resume", "--jobs", "1", code=3)
    resumed = Path("results/study.csv").read_bytes()
    run("sweep", "study.yaml", "--out", "whole", "--jobs", "1", code=3)
    assert resumed == Path("whole/study.csv").read_bytes()


def test_shards_make_the_table_of_one_run(folder):
    name = study_file(folder, SHARDED, SLACK)
    run("sweep", name, "--out", "whole")
    line = "results/study.shard-K-of-N.sqlite: no shards there ('cablestudy sweep --shard K/N' makes them)"
    assert refusal("merge", name) == line
    outcome = run("sweep", name, "--shard", "3/4")
    assert (outcome.out, outcome.err) == ("", "written: results/study.shard-3-of-4.sqlite\n")
    run("sweep", name, "--shard", "1/4", "--jobs", "1")
    path = Path("results/study.shard-1-of-4.sqlite")
    assert stored_rows(path) == [1, 5, 9]
    interrupt(path, "DELETE FROM rows WHERE row > 1")
    lines = run("merge", name, code=2).lines
    assert [line.partition(": cablestudy ")[0] for line in lines] == [
        "results/study.shard-1-of-4.sqlite: not complete, 2 rows missing (5, 9)",
        "results/study.shard-2-of-4.sqlite: no such shard, 3 rows missing (2, 6, 10)",
        "results/study.shard-4-of-4.sqlite: no such shard, 2 rows missing (4, 8)",
    ]
    assert run("sweep", name, "--shard", "1/4", code=2).lines[0].endswith("--restart")  # unfinished
    for line in lines:  # what it says helps
        run(*shlex.split(line.partition(": cablestudy ")[2]))
    run("merge", name)
    for file in ("study.csv", "study.md"):
        assert Path("results", file).read_bytes() == Path("whole", file).read_bytes()
    assert Path("results/study.shard-3-of-4.run.yaml").exists()
    # the merged rows are rows: a study that grows goes on from them
    study_file(folder, SHARDED.replace("190 m]", "190 m, 191 m]"), SLACK)
    assert run("sweep", name, "--resume").lines[0] == "10 of 12 rows are there already"


def test_shards_of_a_study_with_one_more_dimension(folder):
    """What the command line adds to a study, merge takes too."""
    study = (study_file(folder, SHARDED, SLACK), "--vary", "cable.density=1 g/cm^3,7.8 g/cm^3")
    run("sweep", *study, "--out", "whole")
    run("sweep", *study, "--shard", "2/2")
    line = refusal("merge", *study)
    assert "no such shard, 10 rows missing (1, 3, 5" in line
    run(*shlex.split(line.partition(": cablestudy ")[2]))
    run("merge", *study)
    assert Path("results/study.csv").read_bytes() == Path("whole/study.csv").read_bytes()


def test_more_shards_than_rows(folder):
    name = study_file(folder, "columns: [sag]\n", SLACK)
    for shard in ("1/2", "2/2"):
        run("sweep", name, "--shard", shard)
    assert run("merge", name, "--format", "csv").out == Path("results/study.csv").read_text(encoding="utf-8")


def test_shards_that_do_not_belong_together(folder):
    name = study_file(folder, SHARDED, SLACK)
    run("sweep", name, "--shard", "1/2")
    run("sweep", name, "--shard", "2/2", "--set", "gravity=1.62")
    assert refusal("merge", name) == "results/study.shard-2-of-2.sqlite: gravity: 1.62 there, not given now"
    study_file(folder, SHARDED.replace("187", "187.5").replace(", area", ""), SLACK)
    lines = run("merge", name, code=2).lines
    shard, edited = "results/study.shard-1-of-2.sqlite", "of the study before it was edited"
    assert lines[:2] == [f"{shard}: {edited}: {part} changed" for part in ("what varies", "the columns")]
    run("sweep", name, "--shard", "1/3")
    assert refusal("merge", name) == "--out results: shards of 2 and of 3 lie there: move one kind away"
    assert not Path("results/study.csv").exists()


def test_a_failure_in_a_shard(folder):
    name = study_file(folder, FAILING)
    outcome = run("sweep", name, "--shard", "2/3", code=3)
    assert [line.partition(":")[0] for line in outcome.lines][:2] == ["row 5", "row 8"]
    for shard in ("1/3", "3/3"):
        run("sweep", name, "--shard", shard, code=3)
    outcome = run("merge", name, code=3)
    assert outcome.lines[6].startswith("6 of 10 rows have no answer")
    run("sweep", name, "--check", code=0)


@pytest.mark.parametrize(
    "text", ["0/2", "3/2", "1/0", "1", "a/b", "-1/2", "1/2/3", "", "1/", "½/2", "1/99999999999999999"]
)
def test_what_is_no_shard(text):
    with pytest.raises(SceneError, match=f"^--shard {text}: expected K/N with K from 1 to N, for example 3/8$"):
        read_shard(text)


@pytest.mark.parametrize(
    "options",
    [
        "--resume --restart", "--resume --no-write", "--restart --check", "--shard 1/2 --row 1", "--shard 1/2 --check",
        "--check --row 1", "--jobs 2 --scheduler a.json",
    ],
)  # fmt: skip
def test_options_that_exclude_each_other(folder, options):
    one, other = re.findall(r"--\S+", options)
    line = refusal("sweep", study_file(folder, SHARDED, SLACK), *options.split())
    assert line == f"{one} and {other} exclude each other"
    assert not Path("results").exists()


def test_provenance_lies_beside_the_table(folder):
    study_file(folder, FAILING)
    run("sweep", "study.yaml", "--set", "gravity=9.8 m/s^2", code=3)
    content = yaml.safe_load(Path("results/study.run.yaml").read_text(encoding="utf-8"))
    assert content["command"] == "cablestudy sweep study.yaml --set 'gravity=9.8 m/s^2'"
    assert content["versions"] == {
        "cablestudy": __version__, "results": RESULTS_VERSION, "numpy": numpy.__version__, "scipy": scipy.__version__,
        "python": platform.python_version(),
    }  # fmt: skip
    assert content["rows"] == {"total": 10, "reused": 0, "failed": 6}
    assert content["platform"] == platform.platform()
    assert content["started"].endswith("+00:00")
    assert content["duration_s"] > 0
    study = content["study"]
    assert study["scene"]["gravity"] == "9.8 m/s^2"
    assert study["scene"]["cable"]["elastic_modulus"] == "70.3 GPa"  # of the base
    assert study["vary"][1] == {"gondola.mass": ["5 kg", "7 kg"]}
    assert study["columns"] == ["preload_N", "sag_m", "cable_frequency_Hz"]
    with closing(sqlite3.connect("results/study.rows.sqlite")) as database:
        assert dict(database.execute("SELECT * FROM about"))["fingerprint"] == content["fingerprint"]
    table = Path("results/study.csv").read_text(encoding="utf-8")
    assert "cablestudy" not in table
    assert __version__ not in table


def test_a_range_is_recorded_as_written(folder):
    study_file(folder, "vary: [{gravity: {from: 1, to: 2, count: 3}}]\ncolumns: [sag]\n", SLACK)
    run("sweep", "study.yaml")
    content = yaml.safe_load(Path("results/study.run.yaml").read_text(encoding="utf-8"))
    assert content["study"]["vary"] == [{"gravity": {"from": 1, "to": 2, "count": 3, "spacing": "linear"}}]


def store(values, *factors, name="results/study.csv"):
    """Overwrite the numbers of a stored table of one row by multiples of their values."""
    header = Path(name).read_text(encoding="utf-8").splitlines()[0]
    numbers = (repr(value * factor) for value, factor in zip(values, factors, strict=True))
    write(name, f"{header}\n{','.join(numbers)},ok\n")


def test_tolerances_of_columns(folder):
    (row,) = table_of("sweep", study_file(folder, "columns: [sag, preload]\n", SLACK))
    store((row["sag_m"], row["preload_N"]), 1.001, 1.01)
    assert len(run("sweep", "study.yaml", "--check", code=1).lines) == 2
    check = ("sweep", "study.yaml", "--check", "--rtol")
    assert "preload_N" in refusal(*check, "sag=2e-3", code=1)
    assert "sag_m" in refusal(*check, "0.02", "--rtol", "sag_m=1e-4", code=1)
    run(*check, "sag=2e-3", "--rtol", "preload=0.02")
    number = "expected a finite number, not negative, or column=number"
    for wrong, message in (
        ("sag=-1", number),
        ("nan", number),
        ("sag=1 m", number),
        ("chord=1e-3", "chord is not among the study's columns"),
        ("status=1", "status is not among the study's columns"),
        ("sagg=1e-3", "unknown column 'sagg' (did you mean sag?)"),
    ):
        assert refusal(*check, wrong) == f"--rtol {wrong}: {message}"
    assert refusal(*check, "1", "--rtol", "2") == "--rtol 2: given twice for all columns"


def test_a_study_states_its_own_tolerances(folder):
    text = "columns: [sag, preload, mass]\ncheck: {rtol: 1e-9, sag_m: 1 %}\n"
    study_file(folder, text, SLACK)
    (row,) = table_of("sweep", "study.yaml")
    values = [row[name] for name in ("sag_m", "preload_N", "mass_kg")]
    store(values, 1.009, 1 + 1e-10, 1.0)
    run("sweep", "study.yaml", "--check")
    store(values, 1.011, 1 + 1e-8, 1 - 1e-8)
    check = ("sweep", "study.yaml", "--check", "--rtol")
    lines = run("sweep", "study.yaml", "--check", code=1).lines
    assert [line.split(":")[1].split(",")[1] for line in lines] == [" sag_m", " preload_N", " mass_kg"]
    # an option replaces the same one of the file
    assert "sag_m" in refusal(*check, "1e-6", code=1)
    assert len(run(*check, "sag=0.02", code=1).lines) == 2
    run(*check, "sag=0.02", "--rtol", "1e-6")
    # what lets pass more or less computes the same rows
    study_file(folder, text.replace("1 %", "2 %"), SLACK)
    assert "1 of 1 rows are there already" in run("sweep", "study.yaml", "--resume").err


@pytest.mark.parametrize(
    ("stored", "agrees"),
    [
        ("reached is about 1.1e-12 of 3 models", True),
        ("reached is about 1.2e-12 of 3 models", False),
        ("reached is about 1.0e-11 of 3 models", False),
        ("reached is about 1.0e-12 of 4 models", False),
        ("left is about 1.0e-12 of 3 models", False),
        ("ok", False),
    ],
)
def test_the_last_digit_in_a_status_may_turn(folder, stored, agrees):
    """On another machine the rounding of a number may be another one; what is counted is the same."""
    write("stored.csv", f"sag_m,status\n,{stored}\n")
    rows = [{"sag_m": None, "status": "reached is about 1.0e-12 of 3 models"}]
    table = Table((Field("sag_m", "", ""), Field("status", "", "")), rows)
    differences = [difference.column for difference in compare(table, "stored.csv", {})]
    assert differences == ([] if agrees else ["status"])


# another processor: the linear algebra of one without the vector units of today's
OTHER = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX"}


# which modes of the lightest gondola are left out, within 1e-6, depends on rounding; its damping ratio begins with its
# frequency, and ends with a step of 1e-8
LEFT_OUT = [
    part
    for name, share in {"rms": "1e-7", "rms_open_loop": "1e-7", "frequency": "1e-8", "damping_ratio": "1e-8"}.items()
    for part in ("--rtol", f"gondola_{name}={share}")
]


TABLES = [("preload", ()), ("extremes-loop", LEFT_OUT), ("diameter", ())]


@pytest.mark.parametrize(("study", "more"), campaign(TABLES, TABLES[:2]))
def test_another_processor_gives_the_same_table(study, more, tmp_path):
    """Stored tables within 1e-9, whatever machine they were made on."""
    file, folder = CONFIGS / f"{study}.yaml", CONFIGS.parent / "results"
    arguments = ("sweep", file, "--check", "--rtol", "1e-9", *more, "--out", folder)
    done = process(*arguments, cwd=tmp_path, env={**os.environ, **OTHER})
    assert done.lines[-1].endswith(f"{study}.csv: agrees"), done.err
    assert done.code in (0, 3)


def test_a_difference_from_a_printed_value_is_as_certain_as_its_column(folder):
    write(folder / "printed.csv", "sag_m\n12.3\n")
    study_file(folder, "columns: [sag]\nreference: printed.csv\n", SLACK)
    run("sweep", "study.yaml")
    (row,) = stored_table()
    printed = row["sag_m"] * (1 + 1e-5)  # a millionth of the sag is a tenth of the difference
    write(folder / "printed.csv", f"sag_m\n{printed!r}\n")
    for change, code in ((5e-7, 0), (2e-6, 1)):
        sag = row["sag_m"] * (1 + change)
        cells = "sag_m,sag_printed_m,sag_difference_m,status\n" + f"{sag!r},{printed!r},{sag - printed!r},ok\n"
        write("results/study.csv", cells)
        assert len(run("sweep", "study.yaml", "--check", code=code).lines) == (2 if code else 1)


def test_a_tolerance_without_a_column_is_for_all():
    nothing = SimpleNamespace(columns=(), tolerances={})
    assert read_tolerances((), nothing) == {}
    assert read_tolerances(("1 %",), nothing) == {ALL_COLUMNS: 0.01}  # as a study file may have it
    assert str(Difference(2, "sag_m", "2.0", "3.0")) == "row 2, sag_m: stored 2.0, computed 3.0, ratio 1.5"


def test_a_run_that_was_killed_while_it_wrote_leaves_nothing_for_long(folder):
    study_file(folder, "columns: [sag]\n", SLACK)
    Path("results").mkdir()
    for name in ("study.csv", "study.md", "other.csv"):
        write(Path("results", f".{name}-abc"), "half")
    run("sweep", "study.yaml")
    assert [path.name for path in Path("results").glob(".*")] == [".other.csv-abc"]
