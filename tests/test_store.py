"""The file with the rows of a sweep, whatever it holds: the table is the right one, or a line says what to do."""

import csv
import io
import json
import random
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from command import (
    LONGEST,
    SLACK,
    edit_rows,
    go_on,
    interrupt,
    python,
    refusal,
    run,
    start,
    start_paused,
    stored_rows,
    study_file,
    table_of,
    write,
)

from cablestudy.study.table import exact
from cablestudy.sweeps.fingerprint import digest
from cablestudy.sweeps.record import check_sum, pack, unpack
from cablestudy.sweeps.store import open_store

pytestmark = pytest.mark.usefixtures("folder")

ROWS = Path("results/study.rows.sqlite")
TABLE = Path("results/study.csv")
FOUR = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m, 189 m]}]\ncolumns: [preload, sag]\n"
LONG = "vary: [{cable.unstretched_length: {from: 186 m, to: 190 m, count: 600}}]\ncolumns: [sag, preload, mass]\n"


@pytest.fixture
def table(folder):
    """The table of a finished sweep of four rows."""
    study_file(folder, FOUR, SLACK)
    run("sweep", "study.yaml", "--jobs", "1")
    return TABLE.read_bytes()


def resume(*, code=0):
    """Lines on standard error of a resumed sweep."""
    return run("sweep", "study.yaml", "--resume", "--jobs", "1", code=code).lines


ROW = {"row": 2, "key": "00", "status": "ok", "cells": "[1344.5, 12.5]", "errors": "", "notes": ""}
STATEMENTS = ["cells = replace(cells, '.', '.0')", "key = '0'", "status = 'broken'", "sum = NULL", "sum = 'x'",
              "cells = CAST(cells AS BLOB)"]  # fmt: skip
FIELDS = [  # with the right check sum
    *({"cells": cells} for cells in (
        "[1344.5]", "[1344.5,12.5,1.0]", '[1344.5,"12.5"]', "[1344.5,[]]", "[1344.5,true]", "[1344.5,NaN]",
        "[1344.5,1e999]", f"[1344.5,{'9' * 400}]", f"[1344.5,{'9' * 9999}]", '{"preload_N":1344.5,"sag_m":12.5}',
        "1344.5,12.5", "[" * 100_000, None,
    )),
    {"key": None}, {"errors": "[1]"}, {"errors": '{"sag_m": "1e-9"}'}, {"notes": '"note"'}, {"notes": "[1]"},
    {"status": b"ok"},
]  # fmt: skip


@pytest.mark.parametrize("changed", [*STATEMENTS, *FIELDS], ids=lambda changed: str(changed)[:60])
def test_a_row_with_wrong_content_is_computed_again(table, computed, changed):
    if isinstance(changed, str):
        edit_rows(ROWS, f"UPDATE rows SET {changed} WHERE row = 2")
    else:
        fields = ROW | changed
        with closing(sqlite3.connect(ROWS, isolation_level=None)) as database:
            values = (*fields.values(), check_sum(**fields))
            database.execute("REPLACE INTO rows VALUES (?, ?, ?, ?, ?, ?, ?)", values)
    TABLE.unlink()
    computed.clear()
    left_out = f"{ROWS}: left out what is not as it was written: row 2"
    assert resume()[:2] == [left_out, "3 of 4 rows are there already"]
    assert [cases for cases, _ in computed] == [1]
    assert TABLE.read_bytes() == table
    assert stored_rows(ROWS) == [1, 2, 3, 4]


def test_rows_beyond_the_study_are_left_out(table):
    with closing(sqlite3.connect(ROWS, isolation_level=None)) as database:
        for case in (-1, 4, 10**12):
            database.execute("INSERT INTO rows VALUES (?, ?, ?, ?, ?, ?, ?)", pack(case, "0", "ok", [1.0, 2.0]))
    left_out = f"{ROWS}: left out what is not as it was written: rows 0, 5, 1000000000001"
    assert resume()[:2] == [left_out, "4 of 4 rows are there already"]
    assert TABLE.read_bytes() == table


def test_a_text_that_is_not_utf_8(table):
    edit_rows(ROWS, "UPDATE rows SET status = CAST(x'ff' AS TEXT) WHERE row = 2")
    first, second, _ = resume()
    assert first.startswith("results/study.rows.sqlite: is damaged (Could not decode to UTF-8")
    assert first.endswith("; 3 of its rows could be read")
    assert second == "3 of 4 rows are there already"
    assert TABLE.read_bytes() == table


@pytest.mark.parametrize(
    "statements",
    [
        "DROP TABLE rows",
        "ALTER TABLE rows RENAME TO lines",
        "ALTER TABLE rows RENAME COLUMN cells TO numbers",
        "ALTER TABLE rows DROP COLUMN notes",
        "ALTER TABLE rows ADD COLUMN more TEXT",
        "DROP TABLE rows; CREATE TABLE rows (row TEXT, cells TEXT); INSERT INTO rows VALUES ('x', 'y')",
        "DROP TABLE rows; CREATE VIEW rows AS SELECT 1 AS row, 2 AS status",
        "CREATE TRIGGER no BEFORE INSERT ON rows BEGIN SELECT RAISE(ABORT, 'no'); END; DELETE FROM rows",
    ],
)
def test_tables_that_were_changed_are_begun_anew(table, statements):
    with closing(sqlite3.connect(ROWS)) as database:
        database.executescript(statements)
    assert resume()[0].startswith("results/study.rows.sqlite: is damaged (")
    assert TABLE.read_bytes() == table
    with closing(sqlite3.connect(ROWS)) as database:
        database.executescript(statements)
    interrupt(ROWS)
    lines = run("sweep", "study.yaml", code=None).lines  # may see all rows, an unfinished run, damage, or no rows
    assert len(lines) <= 3
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == table


def described(**changes):
    """Change what the file says about the study of its rows, the digest with it."""
    with closing(sqlite3.connect(ROWS, isolation_level=None)) as database:
        known = json.loads(dict(database.execute("SELECT * FROM about"))["study"]) | changes
        for name, value in (("study", json.dumps(known)), ("fingerprint", digest(known))):
            database.execute("UPDATE about SET value = ? WHERE name = ?", (value, name))


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE about SET value = '{}' WHERE name = 'study'",
        "UPDATE about SET value = 5 WHERE name = 'study'",
        "UPDATE about SET value = NULL WHERE name = 'study'",
        "UPDATE about SET value = 'x' WHERE name = 'fingerprint'",
        "UPDATE about SET value = 'x' WHERE name = 'partial'",
        "UPDATE about SET value = '[[]]' WHERE name = 'partial'",
        "UPDATE about SET value = replace(value, 'sag_m', 'mass_kg') WHERE name = 'study'",
        "DELETE FROM about",
        {"columns": 5},
        {"columns": [5]},
        {"columns": ["sagg_m"]},
        {"scene": []},
        {"versions": None},
        {"vary": {}},
    ],
)
def test_a_description_that_was_changed_is_refused(table, change):
    if isinstance(change, str):
        edit_rows(ROWS, change)
    else:
        described(**change)
    told = "the description of the study that its rows belong to was changed; --restart begins anew"
    assert resume(code=2) == [f"{ROWS}: {told}"]
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == table


def test_a_description_with_the_right_digest_of_another_scene_is_refused(table):
    described(scene={"cable": 5, "wind": [[[1]]]})
    lines = resume(code=2)
    assert "results/study.rows.sqlite: cable: 5 there, not given now" in lines
    assert lines[-1].endswith("--restart begins anew, --out DIR begins elsewhere")


@pytest.mark.parametrize("what", ["a database of another program", "no database of a sweep"])
def test_a_file_of_another_program_is_left_alone(table, what):
    ROWS.write_bytes(b"sag_m\n1\n")
    if what.startswith("a database"):
        ROWS.unlink()
        edit_rows(ROWS, "CREATE TABLE notes (text)")
    before = ROWS.read_bytes()
    for options in ((), ("--resume",), ("--restart",)):
        assert refusal("sweep", "study.yaml", *options) == f"results/study.rows.sqlite: is {what}; move it away"
    assert ROWS.read_bytes() == before
    assert [path.name for path in Path("results").glob("study.rows*")] == [ROWS.name]


def test_a_file_of_another_version_is_refused(table):
    edit_rows(ROWS, "PRAGMA user_version = 99")
    line = "results/study.rows.sqlite: is of another version of cablestudy; --restart begins anew"
    for options in ((), ("--resume",)):
        assert refusal("sweep", "study.yaml", *options) == line
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == table


def test_rows_of_an_earlier_version_are_not_used(table):
    old = Path("results/study.rows.jsonl")
    write(old, '{"journal": 2}\n')
    assert resume()[0] == f"{old}: rows of an earlier version of cablestudy are not used; it may be deleted"
    assert old.read_text(encoding="utf-8") == '{"journal": 2}\n'
    assert TABLE.read_bytes() == table


def test_an_empty_file_is_no_obstacle(table):
    for options in ((), ("--resume",), ("--restart",)):
        ROWS.write_bytes(b"")
        run("sweep", "study.yaml", *options)
        assert TABLE.read_bytes() == table


@pytest.fixture
def long_table(folder):
    """The table of a finished sweep of 300 rows, which fill many pages of the file."""
    study_file(folder, LONG.replace("600", "300"), SLACK)
    run("sweep", "study.yaml", "--jobs", "1")
    return TABLE.read_bytes()


def test_a_file_cut_anywhere_gives_the_same_table(long_table):
    whole, kept = ROWS.read_bytes(), []
    lengths = [10, 100, 4096, *random.Random(3).sample(range(len(whole)), 4)]
    for length in lengths:
        ROWS.write_bytes(whole[:length])
        lines = resume()
        assert TABLE.read_bytes() == long_table
        assert sorted(stored_rows(ROWS)) == list(range(1, 301))
        kept += [int(line.split()[0]) for line in lines if "there already" in line]
    assert max(kept) > 100  # what could be read was not computed again


def test_bytes_changed_anywhere_give_the_same_table_or_a_line(long_table):
    whole, generator, refused = ROWS.read_bytes(), random.Random(5), 0
    for _ in range(8):
        damaged = bytearray(whole)
        for place in generator.sample(range(len(whole)), generator.choice((1, 10, 100))):
            damaged[place] = generator.randrange(256)
        ROWS.write_bytes(damaged)
        outcome = run("sweep", "study.yaml", "--resume", "--jobs", "1", code=None)
        if outcome.code == 0:
            assert TABLE.read_bytes() == long_table
            continue
        assert outcome.code == 2
        assert outcome.lines[0].startswith("results/study.rows.sqlite: ")
        assert len(outcome.lines) <= 3
        refused += 1
        ROWS.unlink()
    assert refused < 6


def test_without_resume_a_damaged_file_is_not_overwritten(table):
    interrupt(ROWS)
    ROWS.write_bytes(ROWS.read_bytes()[:4096])
    before = ROWS.read_bytes()
    line = refusal("sweep", "study.yaml")
    assert line.startswith("results/study.rows.sqlite: is damaged (database disk image is malformed)")
    assert line.endswith(": --resume keeps the rows that can be read, --restart begins anew")
    assert ROWS.read_bytes() == before
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == table


def paused(folder, *options):
    """A sweep of 600 rows that stands still when some are there."""
    return start_paused(5, study_file(folder, LONG, SLACK), *options, "--jobs", "1")


def change_while_it_runs(folder, change):
    """Run a sweep of 600 rows, and change its files when some rows are there: exit code and standard error."""
    sweep = paused(folder)
    change()
    return go_on(sweep)


@pytest.fixture(scope="module")
def whole_table(tmp_path_factory):
    """The table of LONG, of an undisturbed sweep."""
    folder = tmp_path_factory.mktemp("whole")
    run("sweep", study_file(folder, LONG, SLACK), "--out", folder, "--jobs", "1", "--quiet")
    return (folder / "study.csv").read_bytes()


def test_a_file_overwritten_while_the_sweep_runs(folder, whole_table):
    def overwrite():
        with ROWS.open("r+b") as file:
            file.write(b"x" * 8192)

    code, said = change_while_it_runs(folder, overwrite)
    assert code in (0, 2)
    assert len(said.splitlines()) == 1
    run("sweep", "study.yaml", "--resume", code=None)
    ROWS.unlink()
    run("sweep", "study.yaml", "--resume")
    assert TABLE.read_bytes() == whole_table


@pytest.mark.parametrize("what", ["file deleted", "folder renamed", "folder deleted"])
def test_rows_moved_or_deleted_while_the_sweep_runs(folder, what, whole_table):
    """A folder that is gone is made anew for the table."""
    changes = {"file deleted": ROWS.unlink, "folder renamed": lambda: Path("results").rename("moved"),
               "folder deleted": lambda: shutil.rmtree("results")}  # fmt: skip
    code, said = change_while_it_runs(folder, changes[what])
    assert (code, said) == (0, "written: results/study.csv, results/study.md\n")
    assert TABLE.read_bytes() == whole_table
    if what == "file deleted":
        assert sorted(path.name for path in Path("results").iterdir()) == ["study.csv", "study.md", "study.run.yaml"]
    if what == "folder renamed":
        assert run("sweep", "study.yaml", "--out", "moved", "--resume").lines[0].endswith("rows are there already")
        assert Path("moved/study.csv").read_bytes() == TABLE.read_bytes()


def test_three_sweeps_of_one_study_at_once(folder, whole_table):
    study_file(folder, LONG, SLACK)
    sweeps = [start("study.yaml", "--jobs", "1") for _ in range(3)]
    said = [sweep.communicate(timeout=LONGEST)[1] for sweep in sweeps]
    codes = [sweep.returncode for sweep in sweeps]
    assert 0 in codes, said  # one that begins after another has ended does its work too
    refusals = [text for code, text in zip(codes, said, strict=True) if code]
    assert refusals == ["results/study.rows.sqlite: another sweep is at work on it\n"] * len(refusals)
    assert TABLE.read_bytes() == whole_table


def test_a_log_left_by_a_killed_sweep_belongs_to_its_rows(folder, whole_table):
    sweep = paused(folder)
    sweep.kill()
    sweep.communicate()
    log = Path(f"{ROWS}-wal")
    assert log.exists()
    done = len(stored_rows(ROWS))
    ROWS.with_name("copy.sqlite").write_bytes(ROWS.read_bytes())
    assert run("sweep", "study.yaml", "--resume").lines[0] == f"{done} of 600 rows are there already"
    table = TABLE.read_bytes()
    assert table == whole_table
    assert not log.exists()
    log.write_bytes(b"what another program left")
    run("sweep", "study.yaml", "--resume")
    assert TABLE.read_bytes() == table


def test_a_record_is_read_as_it_was_packed():
    names = ["sag_m", "iterations", "preload_N", "chord_m", "mass_kg"]
    stored = pack(6, "0a", "broken \udcff", [None, 1, 0.1, -0.0, 1e-308], {"sag_m": 1e-9}, ("a note",))
    record = unpack(stored, names)
    assert (record.case, record.key, record.status) == (6, "0a", "broken \\udcff")
    assert repr(record.cells) == "[None, 1, 0.1, -0.0, 1e-308]"
    assert (record.errors, record.notes) == ({"sag_m": 1e-9}, ["a note"])
    assert unpack(pack(0, "", "ok", []), []).errors == {}
    assert unpack(pack(0, "", "ok", [1.0], {"sag_m": None}), names[:1]).errors == {"sag_m": None}  # not known
    assert unpack(stored, names[:4]) is None
    assert unpack((0, *stored[1:]), names) is None


def test_a_run_that_keeps_nothing_leaves_nothing_even_if_it_is_killed(folder):
    sweep = paused(folder, "--no-write")
    sweep.kill()
    sweep.communicate()
    assert [path.name for path in folder.iterdir()] == ["study.yaml"]


STUDIES = {
    "grid": "vary: [{gravity: {from: 9, to: 10, count: 3}}, {cable.area: [20 mm^2, 30 mm^2]}]\ncolumns: [sag, mass]\n",
    "zip": "vary: [{gravity: [9, 10], cable.unstretched_length: [187 m, 100 m]}]\ncolumns: [status, sag, iterations]\n",
    "text": "vary: [{cable.loads: [null, [{at: 1 m, force: [0, 0, 1]}]]}]\ncolumns: [sag]\n",
    "shown by a column": "vary: [{cable.area: [20 mm^2, 30 mm^2]}, {gravity: [9, 10]}]\ncolumns: [area, preload]\n",
    "nothing varies": "columns: [sag]\n",
    "only the status": "vary: [{gravity: [9, 10]}]\ncolumns: [status]\n",
}


@pytest.mark.parametrize("what", STUDIES)
def test_the_csv_holds_the_rows_of_the_other_formats(folder, what):
    """Its numbers are copied as stored text; JSON is made of the numbers."""
    study_file(folder, STUDIES[what], SLACK)
    text = run("sweep", "study.yaml", "--format", "csv", code=None).out
    plain = table_of("sweep", "study.yaml", code=None)
    found = list(csv.DictReader(io.StringIO(text)))
    assert [list(row) for row in found] == [list(row) for row in plain]
    assert found == [{name: exact(value) for name, value in row.items()} for row in plain]
    assert TABLE.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    "options", [(), ("--resume",), ("--restart",), ("--shard", "1/2")], ids=lambda words: words[:1]
)
@pytest.mark.parametrize("end", ["", "-wal"])
def test_nothing_is_written_through_a_link_to_nothing(folder, options, end):
    study_file(folder, FOUR, SLACK)
    link = Path(f"results/study.{'shard-1-of-2' if '--shard' in options else 'rows'}.sqlite{end}")
    link.parent.mkdir()
    link.symlink_to(folder / "elsewhere")
    line = refusal("sweep", "study.yaml", *options)
    assert line == f"{link}: is a link to {folder / 'elsewhere'}, which is not there"
    assert not Path("elsewhere").exists()
    assert [path.name for path in Path("results").iterdir()] == [link.name]
    run("show", "study.yaml", code=2)
    assert not Path("elsewhere").exists()


def test_a_table_takes_the_place_of_a_link_to_nothing(folder):
    """As of any file: it is written whole beside its place, and then put there."""
    study_file(folder, FOUR, SLACK)
    Path("results").mkdir()
    for path in (TABLE, TABLE.with_suffix(".md"), TABLE.with_suffix(".run.yaml"), Path("picture.svg")):
        path.symlink_to(folder / "elsewhere")
    run("sweep", "study.yaml", "--plot", "picture.svg")
    assert not Path("elsewhere").exists()
    assert TABLE.read_text().startswith("cable.unstretched_length_m,")
    assert not TABLE.is_symlink()


# --------------------------------------------------------------------------- begun by several processes at once

PATH = "study.rows.sqlite"
PROCESSES = 6
IDENTITY = {"versions": {}, "scene": {}, "vary": [], "columns": ["sag_m", "status"]}
OPEN_AT_ONCE = f"""
import json
from multiprocessing import get_context

from cablestudy.errors import SceneError
from cablestudy.sweeps.store import open_store

fork = get_context("fork")
begun, ended, answers = fork.Barrier({PROCESSES}), fork.Barrier({PROCESSES}), fork.Queue()


def open_and_hold():
    begun.wait()
    try:
        store = open_store("{PATH}", {IDENTITY}, 5)
        answers.put("opened")
    except SceneError as error:
        answers.put(str(error))
    ended.wait()


processes = [fork.Process(target=open_and_hold) for _ in range({PROCESSES})]
for process in processes:
    process.start()
print(json.dumps(sorted(answers.get(timeout={LONGEST}) for _ in processes)))
for process in processes:
    process.join()
    assert process.exitcode == 0
"""


def store_rows():
    """Leave a finished run of other rows."""
    with closing(open_store(PATH, IDENTITY, 5)) as store:
        store.set_finished(True)


@pytest.mark.parametrize("prepare", [lambda: None, store_rows], ids=["no file", "finished run"])
def test_one_of_several_that_begin_at_once_has_the_file(prepare):
    prepare()
    refused = [f"{PATH}: another sweep is at work on it"] * (PROCESSES - 1)
    assert json.loads(python(OPEN_AT_ONCE)) == ["opened", *refused]


@pytest.mark.parametrize("restart", [False, True])
def test_what_a_file_held_is_forgotten(restart):
    """Tables of other programs inside it, too; a file that was emptied is as small as a new one."""
    store_rows()
    new = Path(PATH).stat().st_size
    with closing(sqlite3.connect(PATH)) as database, database:
        database.execute("CREATE TABLE more (text TEXT PRIMARY KEY)")
        database.execute("CREATE VIEW seen AS SELECT text FROM more")
        database.executemany("INSERT INTO more VALUES (?)", ((f"{number:0200}",) for number in range(1000)))
    with closing(open_store(PATH, IDENTITY, 5, restart=restart)):
        pass
    with closing(sqlite3.connect(PATH)) as database:
        names = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE name NOT LIKE 'sqlite%'")}
    assert names == {"about", "rows"}
    assert Path(PATH).stat().st_size == new


def test_a_damaged_file_is_begun_anew():
    store_rows()
    whole = Path(PATH).read_bytes()
    Path(PATH).write_bytes(whole[:4096] + b"x" * (len(whole) - 4096))  # damaged behind the first page
    with closing(open_store(PATH, IDENTITY, 5, restart=True)) as store:
        assert store.database.value("PRAGMA integrity_check") == "ok"
        assert store.how_many(range(5), 0) == 5
