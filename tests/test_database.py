"""Several processes open the rows of one study at once: one of them has the file, whatever was in it."""

import json
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from command import LONGEST

from cablestudy.sweeps.store import open_store

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


def store_damaged_rows():
    """Leave a finished run whose pages are damaged behind the first."""
    store_rows()
    whole = Path(PATH).read_bytes()
    Path(PATH).write_bytes(whole[:4096] + b"x" * (len(whole) - 4096))


@pytest.mark.parametrize("prepare", [lambda: None, store_rows], ids=["no file", "finished run"])
@pytest.mark.usefixtures("folder")
def test_one_of_several_that_begin_at_once_has_the_file(prepare):
    prepare()
    done = subprocess.run([sys.executable, "-c", OPEN_AT_ONCE], capture_output=True, text=True, timeout=LONGEST)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == ["opened"] + [f"{PATH}: another sweep is at work on it"] * (PROCESSES - 1)


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
