"""Several processes open the rows of one study at once: one of them has the file, whatever was in it."""

import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from cablestudy.sweeps.store import open_store

PATH = "study.rows.sqlite"
PROCESSES = 6
IDENTITY = {"versions": {}, "scene": {}, "vary": [], "columns": ["sag_m", "status"]}
OPEN_AND_HOLD = f"""
from cablestudy.errors import SceneError
from cablestudy.sweeps.store import open_store
print("ready", flush=True)
input()
try:
    store = open_store("{PATH}", {IDENTITY}, 5)
    print("opened", flush=True)
    input()
except SceneError as error:
    print(error, flush=True)
"""


def store_rows():
    """Leave a finished run of other rows."""
    with closing(open_store(PATH, IDENTITY, 5)) as store:
        store.set_finished(True)


def store_damaged_rows():
    """Leave a finished run whose pages are damaged behind the first."""
    store_rows()
    whole = Path(PATH).read_bytes()
    Path(PATH).write_bytes(whole[:4096] + b"x" * (len(whole) - 4096))


@pytest.mark.parametrize("prepare", [lambda: None, store_rows], ids=["no file", "finished run"])
@pytest.mark.usefixtures("folder")
def test_one_of_several_that_begin_at_once_has_the_file(prepare):
    prepare()
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    processes = [subprocess.Popen([sys.executable, "-c", OPEN_AND_HOLD], text=True, **pipes) for _ in range(PROCESSES)]
    assert [process.stdout.readline() for process in processes] == ["ready\n"] * PROCESSES
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    answers = sorted(process.stdout.readline() for process in processes)
    assert answers == ["opened\n"] + [f"{PATH}: another sweep is at work on it\n"] * (PROCESSES - 1)
    for process in processes:
        process.communicate("\n")
    assert {process.returncode for process in processes} == {0}


@pytest.mark.parametrize("restart", [False, True])
@pytest.mark.usefixtures("folder")
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


@pytest.mark.usefixtures("folder")
def test_a_damaged_file_is_begun_anew():
    store_damaged_rows()
    with closing(open_store(PATH, IDENTITY, 5, restart=True)) as store:
        assert store.database.value("PRAGMA integrity_check") == "ok"
        assert store.how_many(range(5), 0) == 5
