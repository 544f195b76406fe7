"""Sweeps that are ended at any moment and go on: kills, signals, edited studies."""

import json
import multiprocessing
import os
import random
import shlex
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from functools import cache
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, LONGEST, SLACK, go_on, interrupt, process, run, start_paused, stored_rows, study_file

from cablestudy.errors import SceneError
from cablestudy.scene.study import read_study
from cablestudy.study.case_table import CaseTable, tables_of
from cablestudy.study.prepare import prepare
from cablestudy.sweeps import chunks, driver
from cablestudy.sweeps.database import Database
from cablestudy.sweeps.fingerprint import RESULTS_VERSION, digest, identity, versions
from cablestudy.sweeps.tolerances import SWEEPS

pytestmark = pytest.mark.usefixtures("folder")

ROWS = Path("results/study.rows.sqlite")
TABLE = Path("results/study.csv")
FEW = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m, 189 m]}]\ncolumns: [preload, sag]\n"
LONG = "vary: [{cable.unstretched_length: {from: 186 m, to: 190 m, count: 900}}]\ncolumns: [sag, preload]\n"


def cut(rows):
    """Leave so many rows of an unfinished run."""
    interrupt(ROWS, f"DELETE FROM rows WHERE row > {rows}")


def names():
    return sorted(path.name for path in Path("results").iterdir())


def sweep_of(text, *options, code=0):
    """Lines on standard error of a sweep of a study upon the slack cable."""
    return run("sweep", study_file(".", text, SLACK), *options, code=code).lines


def is_the_table_of_one_run(code=0):
    """Of a sweep that begins anew and is not ended."""
    assert TABLE.read_bytes() == table_of_one_run(Path("study.yaml").read_bytes(), code)


@cache
def table_of_one_run(_, code):
    """Bytes of the table of study.yaml, whose content is given, by a sweep that begins anew and is not ended."""
    run("sweep", "study.yaml", "--out", "whole", code=code)
    return Path("whole/study.csv").read_bytes()


def descendants(pid):
    """Processes that a process and its children started, the youngest last."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    pairs = [tuple(map(int, line.split())) for line in listed.splitlines()]
    found = [pid]
    for parent in found:
        found += [child for child, other in pairs if other == parent]
    return sorted(found[1:])


def test_a_sweep_that_is_killed_time_and_again_ends_with_the_same_bytes(folder):
    study_file(folder, LONG, SLACK)
    assert process("sweep", "study.yaml", "--out", "whole").code == 0
    generator = random.Random(20)
    for attempt in campaign(range(4), (0, 3)):
        before, where = len(stored_rows(ROWS)), ("within", "after")[attempt // 2]
        jobs = ("--jobs", 1 + attempt % 2)
        sweep = start_paused(generator.randrange(2, 100), "study.yaml", "--resume", *jobs, where=where)
        sweep.kill()
        assert sweep.wait() == -signal.SIGKILL
        sweep.stderr.close()
        assert len(stored_rows(ROWS)) > before  # what was done is kept
    outcome = process("sweep", "study.yaml", "--resume")
    assert outcome.code == 0, outcome.err
    for name in ("study.csv", "study.md"):
        assert Path("results", name).read_bytes() == Path("whole", name).read_bytes()
    assert names() == ["study.csv", "study.md", "study.rows.sqlite", "study.run.yaml"]


SIGNALS = (signal.SIGTERM, "2"), (signal.SIGINT, "1"), (signal.SIGINT, "2")


@pytest.mark.parametrize(("number", "jobs"), campaign(SIGNALS, SIGNALS[:2]))
def test_a_signal_ends_it_cleanly_and_says_how_to_go_on(folder, number, jobs):
    """SIGINT as from a terminal: to all processes of the sweep."""
    study_file(folder, LONG, SLACK)
    sweep = start_paused(3, "study.yaml", "--jobs", jobs)
    workers = descendants(sweep.pid)
    os.killpg(sweep.pid, number) if number == signal.SIGINT else sweep.send_signal(number)
    code, said = go_on(sweep)
    first, command = said.splitlines()
    assert code == 130
    rows = len(stored_rows(ROWS))
    assert first == f"interrupted: {rows} of 900 rows are done, in results/study.rows.sqlite; to go on:"
    assert command == f"cablestudy sweep study.yaml --jobs {jobs} --resume"
    assert names() == ["study.rows.sqlite"]
    end = time.monotonic() + LONGEST
    while any(Path("/proc", str(worker)).exists() for worker in workers):
        assert time.monotonic() < end, "processes are left"
        time.sleep(0.05)
    said = run(*shlex.split(command)[1:]).lines
    assert said == [f"{rows} of 900 rows are there already", "written: results/study.csv, results/study.md"]
    is_the_table_of_one_run()


def test_a_sweep_that_keeps_nothing_says_so_when_it_is_ended(folder, monkeypatch):
    monkeypatch.setattr(chunks, "evaluate_tables", lambda *_: signal.raise_signal(signal.SIGTERM))
    before = signal.getsignal(signal.SIGTERM)
    assert sweep_of(FEW, "--no-write", code=130) == ["interrupted: nothing is kept of a run that writes nothing"]
    assert signal.getsignal(signal.SIGTERM) == before
    assert list(folder.iterdir()) == [folder / "study.yaml"]


@pytest.fixture
def half(folder):
    """An unfinished run in results/, two of four rows done."""
    sweep_of(FEW)
    cut(2)


def test_no_row_is_computed_twice(half, computed):
    before = TABLE.read_bytes()
    TABLE.unlink()
    outcome = run("sweep", "study.yaml", "--resume")
    assert outcome.lines[0] == "2 of 4 rows are there already"
    assert sum(count for count, _ in computed) == 2
    assert TABLE.read_bytes() == before
    computed.clear()
    run("sweep", "study.yaml", "--resume")
    assert computed == []
    assert TABLE.read_bytes() == before


def test_an_unfinished_run_is_not_overwritten(half):
    left = ROWS.read_bytes()
    told = "an unfinished run is there, 2 rows done: go on with --resume, or begin anew with --restart"
    assert run("sweep", "study.yaml", code=2).lines == [f"{ROWS}: {told}"]
    assert ROWS.read_bytes() == left
    run("sweep", "study.yaml", "--check")  # reads what is written, touches nothing
    run("sweep", "study.yaml", "--no-write")
    assert ROWS.read_bytes() == left
    run("sweep", "study.yaml", "--restart")
    run("sweep", "study.yaml")  # finished: nothing to lose
    cut(0)
    run("sweep", "study.yaml")  # no row yet


def test_resume_refuses_what_differs_and_says_what(half):
    outcome = run("sweep", "study.yaml", "--set", "cable.density=8 g/cm^3", "--set", "wind=null", "--resume", code=2)
    assert "results/study.rows.sqlite: cable.density: 1440 kg/m^3 there, 8 g/cm^3 now" in outcome.lines
    assert "results/study.rows.sqlite: wind.speed: 6 m/s there, not given now" in outcome.lines
    assert "--restart begins anew" in outcome.lines[-1]
    study = read_study("study.yaml")
    known = {**identity(study, prepare(study)[0]), "versions": {"results": 0, "numpy": "1.0", "scipy": "1.0"}}
    with closing(sqlite3.connect(ROWS, isolation_level=None)) as database:
        for name, value in (("study", json.dumps(known)), ("fingerprint", digest(known))):
            database.execute("UPDATE about SET value = ? WHERE name = ?", (value, name))
    lines = run("sweep", "study.yaml", "--resume", code=2).lines
    assert f"results/study.rows.sqlite: version of results: 0 there, {RESULTS_VERSION} now" in lines
    run("sweep", "study.yaml", "--restart")


def test_two_sweeps_do_not_write_one_journal(half):
    with closing(Database(str(ROWS))):
        line = "results/study.rows.sqlite: another sweep is at work on it"
        for option in ("--resume", "--restart"):
            assert run("sweep", "study.yaml", option, code=2).lines == [line]
    run("sweep", "study.yaml", "--resume")


def test_a_study_with_more_rows_computes_only_those(computed):
    sweep_of(FEW)
    computed.clear()
    grown = FEW.replace("[186 m, 187 m,", "[185.9 m, 187 m, 186 m, 186.5 m,")
    assert sweep_of(grown, "--resume")[0] == "4 of 6 rows are there already"
    assert sum(count for count, _ in computed) == 2
    is_the_table_of_one_run()
    computed.clear()
    # one more thing varies: its old value is known
    more = grown.replace("vary: [", "vary: [{cable.area: [24.2 mm^2, 30 mm^2]}, ")
    assert sweep_of(more, "--resume")[0] == "6 of 12 rows are there already"
    assert sum(count for count, _ in computed) == 6


@pytest.mark.parametrize(
    ("before", "after", "computes"),
    [
        ("[sag]", "[sag, preload]", "preload"),
        ("[sag, cable_frequency]", "[sag, preload, cable_frequency]", "preload"),
        ("[sag]", "[sag, cable_frequency]", "cable_frequency"),
        ("[sag, preload]", "[preload]", ""),
        # the model is refined until all frequencies agree: they are computed together
        ("[sag, cable_frequency]", "[sag, cable_frequency, axial_frequency_2]", "cable_frequency, axial_frequency_2"),
        ("[sag, cable_frequency, axial_frequency_2]", "[sag, cable_frequency]", "cable_frequency"),
        ("[sag, preload]", "[sag, preload, dof]", "sag, preload, dof"),
        ("[sag, preload]", "[sag, preload, error_estimate]", "sag, preload, error_estimate"),
        ("[sag, cable_frequency, error_estimate]", "[error_estimate, sag, cable_frequency]", None),
    ],
)
def test_a_study_with_other_columns_computes_only_what_is_new(computed, before, after, computes):
    vary = "vary: [{cable.preload: [400 N, 300 N, 1 N]}]\n"
    sweep_of(f"{vary}columns: {before}\n", code=3)  # 1 N is less than its weight asks for
    computed.clear()
    sweep_of(f"{vary}columns: {after}\n", "--resume", code=3)
    expected, found = Counter(), Counter()
    if computes is not None:  # the row that failed is computed as a whole: another column may have been the reason
        expected[tuple(after[1:-1].split(", "))] += 1
        expected[tuple(computes.split(", "))] += 2 if computes else 0
    for often, columns in computed:
        found[columns] += often
    assert +found == +expected
    is_the_table_of_one_run(code=3)


def test_new_columns_may_fail_where_the_old_ones_did_not():
    for columns, code in (("sag", 0), ("sag, gondola_frequency_static", 3)):
        sweep_of(f"vary: [{{gondola: [{{mass: 5 kg}}, null]}}]\ncolumns: [{columns}]\n", "--resume", code=code)
    is_the_table_of_one_run(code=3)


def test_a_growing_study_can_be_ended_too(computed, monkeypatch):
    vary = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m]}]\n"
    sweep_of(f"{vary}columns: [sag]\n")
    with monkeypatch.context() as ended:
        ended.setattr(chunks, "evaluate_tables", lambda *_: signal.raise_signal(signal.SIGINT))
        lines = sweep_of(f"{vary}columns: [sag, preload]\n", "--resume", code=130)
    assert lines[0] == "0 of 3 rows are there already, and some columns of 3 more"
    computed.clear()
    run("sweep", "study.yaml", "--resume")
    assert {columns for _, columns in computed} == {("preload",)}
    is_the_table_of_one_run()


def key_alone(study, case):
    """The key of a case that is read alone."""
    (key,) = chunks.scene_hashes(CaseTable(np.array([case]), study.case(case)[1], {}))
    return key


def test_a_key_is_of_the_resolved_scene(folder):
    study_file(folder, "vary: [{cable.unstretched_length: [186 m, 18600 cm, 187 m]}]\ncolumns: [sag]\n", SLACK)
    keys = [key_alone(read_study("study.yaml"), case) for case in range(3)]
    assert keys[0] == keys[1] != keys[2]


VARIED = """\
vary:
  - {gravity: [9.81, 1e-7, 1.62 m/s^2], wind.speed: [6, 1e-5 m/s, 7.25 m/s]}
  - {cable.unstretched_length: {from: 186 m, to: 190 m, count: 3}}
  - {cable.material: [steel, aramid]}
  - {gondola: [null, {mass: 5 kg}]}
columns: [sag]
"""


OF_ALL_CABLES = """
vary:
  - {cable.diameter: {from: 2 mm, to: 3 mm, count: 4}}
  - {wind.speed: {from: 3 m/s, to: 9 m/s, count: 6}}
columns: [max_tension]
"""


@pytest.mark.parametrize(
    ("text", "base"), [(VARIED, SLACK), (OF_ALL_CABLES, CONFIGS / "suspensions" / "carlina-net-wind.yaml")]
)
def test_keys_of_many_cases_are_those_of_each(folder, text, base):
    study = read_study(study_file(folder, text, base))
    found = {}
    for table in tables_of(study, range(study.count))[0]:
        found |= dict(zip(table.cases.tolist(), chunks.scene_hashes(table), strict=True))
    assert len(found) > 20
    assert found == {case: key_alone(study, case) for case in found}
    assert len(set(found.values())) == len(found)


def test_a_worker_of_another_version_is_refused():
    piece = chunks.Chunk(b"", {**versions(), "numpy": "0.1"}, (), (0,))
    with pytest.raises(SceneError, match=r"a worker has numpy \S+, not 0\.1"):
        chunks.compute(piece)


def test_the_size_of_chunks_and_the_number_of_processes_change_no_digit(folder, monkeypatch):
    text = LONG.replace("900", "20").replace("sag,", "sag, end_stiffness, gondola_frequency,")
    study_file(folder, text, SLACK)
    tables = []
    for seconds, jobs in ((0.0, "1"), (0.02, "1"), (10.0, "1"), (0.05, "2"), (10.0, "3")):
        monkeypatch.setattr(type(SWEEPS), "chunk_time", seconds)
        run("sweep", "study.yaml", "--jobs", jobs)
        tables.append(TABLE.read_bytes())
    assert len(set(tables)) == 1


def test_chunks_have_as_many_cases_on_a_busy_machine(folder, monkeypatch):
    """Cases that share an equilibrium are computed together however long a process waits for a processor."""
    monkeypatch.setattr(type(SWEEPS), "chunk_time", 4.0)
    monkeypatch.setattr(type(SWEEPS), "chunk_growth", 4)
    study = read_study(study_file(folder, LONG, SLACK))
    for waiting in (0.0, 30.0):
        handed_out = chunks.Chunks(study, [(range(study.count), ("sag",))], study.count)
        sizes = []
        for _ in range(4):
            cases = handed_out.next().cases
            sizes.append(len(cases))
            seconds = 0.25 * len(cases)
            handed_out.measure(chunks.Done([], list(cases), 0, seconds + waiting, seconds))
        assert sizes == [1, 4, 16, 16]


def test_a_process_that_dies_is_replaced(folder):
    study_file(folder, LONG, SLACK)
    sweep = start_paused(3, "study.yaml", "--jobs", "2")
    workers = descendants(sweep.pid)
    assert len(workers) >= 2
    subprocess.run(["kill", "-9", str(workers[-1])], check=True)
    assert go_on(sweep) == (0, "written: results/study.csv, results/study.md\n")
    is_the_table_of_one_run()


def test_no_chunk_is_lost_where_a_worker_dies_between_two_results(folder):
    """An executor that has found out takes nothing more; in processes that happens if it finds out early enough."""
    study = read_study(study_file(folder, FEW, SLACK))
    piece = chunks.Chunks(study, [(range(study.count), ("sag",))], study.count)
    dies_at = iter([2, 1])

    @contextmanager
    def executor():
        submitted, last = count(1), next(dies_at, None)

        class Breaking(driver.SerialExecutor):
            def submit(self, *what):
                if next(submitted) == last:
                    raise BrokenProcessPool
                return super().submit(*what)

        yield Breaking()

    done = list(driver.retry(piece, executor, lambda: 1))
    assert [record[0] for chunk in done for record in chunk.records] == list(range(1, study.count + 1))


def test_processes_that_always_die_are_given_up(monkeypatch):
    with monkeypatch.context() as deadly:
        deadly.setattr(driver, "compute", _die_elsewhere)
        lines = sweep_of(FEW, "--jobs", "2", code=3)
    assert lines == [
        "workers end by themselves, time and again: too little memory for so many?; --resume goes on: 1 rows are done"
    ]
    run("sweep", "study.yaml", "--resume")


def _die_elsewhere(piece):
    if multiprocessing.parent_process() is not None:
        os._exit(9)
    return chunks.compute(piece)


@pytest.fixture
def processes(monkeypatch):
    """Numbers of processes that are started: list of int. The first case takes one second."""
    asked = []

    def computed_here(chunks, _):
        yield SimpleNamespace(seconds=1.0)
        chunks.left = 0  # where the caller goes on to the end

    monkeypatch.setattr(driver, "process_pool", asked.append)
    monkeypatch.setattr(driver, "retry", lambda chunks, pool, workers: pool() or iter(()))
    monkeypatch.setattr(driver, "submit_all", computed_here)
    return asked


def test_no_more_processes_than_cores_have_use_for(processes, monkeypatch):
    monkeypatch.setattr(driver, "cores", lambda: 2)
    for jobs in (2, 8, 1000):
        list(driver.compute_here(SimpleNamespace(left=10_000), jobs))
    assert processes == [2, 8, 8]


def test_processes_are_started_by_themselves_for_work_that_is_worth_it(processes, monkeypatch):
    """One for each core, where the first case of one second foretells more than three."""
    monkeypatch.setattr(driver, "cores", lambda: 3)
    monkeypatch.setattr(type(SWEEPS), "parallel_time", 3.0)
    for left in (2, 3, 4):
        list(driver.compute_here(SimpleNamespace(left=left, seconds_per_case=1.0)))
    assert processes == [3]


def test_a_full_disk_is_one_line_and_what_is_there_stays(folder):
    study_file(folder, LONG, SLACK)
    full = "ulimit -f 64; exec {} -B -m cablestudy sweep study.yaml --jobs 1"  # blocks of 1024 bytes
    done = subprocess.run(["bash", "-c", full.format(sys.executable)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "results/study.rows.sqlite: cannot be used (disk I/O error); --resume goes on\n"
    assert names() == ["study.rows.sqlite"]
    reused = run("sweep", "study.yaml", "--resume").lines[0]
    assert 0 < int(reused.split()[0]) < 900
    is_the_table_of_one_run()
