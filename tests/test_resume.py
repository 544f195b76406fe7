"""Sweeps that are ended at any moment and go on: the journal, signals, studies that grow."""

import fcntl
import json
import random
import re
import shlex
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import pytest
from command import SLACK, process, run, start, study_file, wait_for_rows

from cablestudy.errors import SceneError
from cablestudy.scene.study import read_study
from cablestudy.study.columns import find
from cablestudy.study.prepare import prepare
from cablestudy.sweep import chunk, growth, journal, parallel
from cablestudy.sweep.fingerprint import digest, identity

ROWS = Path("results/study.rows.jsonl")
TABLE = Path("results/study.csv")
FEW = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m, 189 m]}]\ncolumns: [preload, sag]\n"
LONG = "vary: [{cable.unstretched_length: {from: 186 m, to: 190 m, count: 900}}]\ncolumns: [sag, cable_frequency]\n"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The working directory of a test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def computed(monkeypatch):
    """What is computed in this process: list of (cases, names of columns) for each chunk."""
    calls, evaluate = [], chunk.evaluate_cases

    def evaluate_cases(scenes, columns):
        calls.append((len(scenes), tuple(column.name for column in columns)))
        return evaluate(scenes, columns)

    monkeypatch.setattr(chunk, "evaluate_cases", evaluate_cases)
    return calls


def cut(lines, finished=False):
    """Leave the header and so many rows of the journal."""
    kept = ROWS.read_bytes().splitlines(keepends=True)[: lines + 1]
    ROWS.write_bytes(b"".join(kept) + journal.FINISHED * finished)


def names():
    return sorted(path.name for path in Path("results").iterdir())


def test_a_sweep_that_is_killed_time_and_again_ends_with_the_same_bytes(folder):
    study_file(folder, LONG.replace("900", "8000"), SLACK)
    assert process("sweep", "study.yaml", "--out", "whole").code == 0
    generator, kills = random.Random(20), 0
    for attempt in range(8):
        before = ROWS.read_bytes().count(b"\n") if ROWS.exists() else 0
        if before > 5600:  # it might be done before it is killed
            break
        sweep = start("study.yaml", "--resume", "--jobs", str(1 + attempt % 2))
        wait_for_rows(sweep, before, ROWS)
        time.sleep(generator.uniform(0, 0.4))
        sweep.kill()
        kills += sweep.wait() == -signal.SIGKILL
        sweep.stderr.close()
        known = [json.loads(line) for line in ROWS.read_bytes().split(b"\n")[1:-1]]
        rows = [row["row"] for row in known if "row" in row]
        assert len(rows) == len(set(rows))  # no row is computed twice
    assert kills >= 3
    outcome = process("sweep", "study.yaml", "--resume")
    assert outcome.code == 0, outcome.err
    for name in ("study.csv", "study.md"):
        assert Path("results", name).read_bytes() == Path("whole", name).read_bytes()
    assert names() == ["study.csv", "study.md", "study.rows.jsonl", "study.run.yaml"]


@pytest.mark.parametrize(("number", "jobs"), [(signal.SIGINT, "1"), (signal.SIGTERM, "2"), (signal.SIGINT, "2")])
def test_a_signal_ends_it_cleanly_and_says_how_to_go_on(folder, number, jobs):
    study_file(folder, LONG, SLACK)
    sweep = start("study.yaml", "--jobs", jobs)
    wait_for_rows(sweep, 3, ROWS)
    children = Path(f"/proc/{sweep.pid}/task/{sweep.pid}/children")
    workers = children.read_text().split() if children.exists() else []
    sweep.send_signal(number)
    _, said = sweep.communicate(timeout=20)
    assert sweep.returncode == 130, said
    first, command = said.splitlines()
    rows = ROWS.read_bytes().count(b"\n") - 1
    assert first == f"interrupted: {rows} of 900 rows are done, in results/study.rows.jsonl; to go on:"
    assert command == f"cablestudy sweep study.yaml --jobs {jobs} --resume"
    assert names() == ["study.rows.jsonl"]
    end = time.monotonic() + 10
    while any(Path("/proc", worker).exists() for worker in workers):
        assert time.monotonic() < end, "processes are left"
        time.sleep(0.05)
    outcome = run(*shlex.split(command)[1:])
    assert outcome.lines == [f"{rows} of 900 rows are there already", "written: results/study.csv, results/study.md"]
    run("sweep", "study.yaml", "--out", "whole", "--jobs", "1")
    assert TABLE.read_bytes() == Path("whole/study.csv").read_bytes()


def test_a_sweep_that_keeps_nothing_says_so_when_it_is_ended(folder, monkeypatch):
    monkeypatch.setattr(chunk, "evaluate_cases", lambda *_: signal.raise_signal(signal.SIGTERM))
    study_file(folder, FEW, SLACK)
    before = signal.getsignal(signal.SIGTERM)
    outcome = run("sweep", "study.yaml", "--no-write", code=130)
    assert outcome.lines == ["interrupted: nothing is kept of a run that writes nothing"]
    assert signal.getsignal(signal.SIGTERM) == before
    assert list(folder.iterdir()) == [folder / "study.yaml"]


def test_no_row_is_computed_twice(folder, computed):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    before = TABLE.read_bytes()
    cut(2)
    TABLE.unlink()
    computed.clear()
    outcome = run("sweep", "study.yaml", "--resume")
    assert outcome.lines[0] == "2 of 4 rows are there already"
    assert sum(count for count, _ in computed) == 2
    assert TABLE.read_bytes() == before
    computed.clear()
    run("sweep", "study.yaml", "--resume")
    assert computed == []
    assert TABLE.read_bytes() == before


@pytest.mark.parametrize(
    "tail", [b'{"row": 3, "key": "ab', b'{"row": 3}\n', b"\0\0\0\0", b'{"row": 3, "key": "", "cells": {"sag_m": 1}}']
)
def test_a_torn_line_is_dropped(folder, computed, tail):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    before = TABLE.read_bytes()
    cut(2)
    ROWS.write_bytes(ROWS.read_bytes() + tail)
    computed.clear()
    run("sweep", "study.yaml", "--resume")
    assert sum(count for count, _ in computed) == 2
    assert TABLE.read_bytes() == before
    lines = ROWS.read_bytes().split(b"\n")
    assert len(lines) == 1 + 4 + 1 + 1
    assert all(json.loads(line) for line in lines[:-1])


EDITS = {
    "a number": lambda line: re.sub(rb'"sag_m": [\d.]+', b'"sag_m": 1.0', line),
    "no JSON any more": lambda line: line.replace(b'"sag_m": ', b'"sag_m" '),
    "a column taken out": lambda line: re.sub(rb', "sag_m": [\d.]+', b"", line),
    "not a number": lambda line: re.sub(rb'"sag_m": [\d.]+', b'"sag_m": NaN', line),
    "another row": lambda line: re.sub(rb'"row": \d', b'"row": 4', line),
    "no row": lambda line: re.sub(rb'"row": \d', b'"row": 0', line),
    "a row far beyond": lambda line: re.sub(rb'"row": \d', b'"row": 999999999', line),
    "no status": lambda line: line.replace(b', "status": "ok"', b""),
    "not UTF-8": lambda line: line.replace(b'"ok"', b'"\xff"'),
    "a part": lambda line: line.replace(b'"row"', b'"part"'),
    "a comment": lambda line: b"# " + line,
    "nothing": lambda line: b"",
}


@pytest.mark.parametrize("what", EDITS)
def test_a_row_that_was_changed_by_hand_is_computed_again(folder, computed, what):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml", "--jobs", "1")
    before, lines = TABLE.read_bytes(), ROWS.read_bytes().split(b"\n")
    changed = EDITS[what](lines[2])
    assert changed != lines[2]
    ROWS.write_bytes(b"\n".join([*lines[:2], changed, *lines[3:]]))
    TABLE.unlink()
    computed.clear()
    outcome = run("sweep", "study.yaml", "--resume")
    assert outcome.lines[:2] == [
        "results/study.rows.jsonl: left out what is no row as it was written: line 3",
        "3 of 4 rows are there already",
    ]
    assert [count for count, _ in computed] == [1]
    assert TABLE.read_bytes() == before
    run("sweep", "study.yaml")  # the run counts as finished: it may be begun anew


def test_every_line_changed_by_an_editor_is_left_out(folder):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    before = TABLE.read_bytes()
    ROWS.write_bytes(ROWS.read_bytes().replace(b"\n", b"\r\n"))
    outcome = run("sweep", "study.yaml", "--resume")
    assert outcome.lines[0].endswith("no row as it was written: lines 2, 3, 4, 5, 6")
    assert TABLE.read_bytes() == before


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda head: {**head, "columns": 5}, "its first line was changed, which says what its rows are of"),
        (lambda head: {**head, "scene": {}}, "its first line was changed, which says what its rows are of"),
        (lambda head: {**head, "journal": 1}, "is a journal of another version of cablestudy"),
        (lambda head: [head], "is no journal of a sweep; move it away"),
        (lambda head: {}, "is no journal of a sweep; move it away"),
    ],
)
def test_a_first_line_that_was_changed_is_refused(folder, edit, message):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    head, rest = ROWS.read_bytes().split(b"\n", 1)
    ROWS.write_bytes(json.dumps(edit(json.loads(head))).encode() + b"\n" + rest)
    (line,) = run("sweep", "study.yaml", "--resume", code=2).lines
    assert line.startswith(f"results/study.rows.jsonl: {message}")
    if "move it away" not in message:
        run("sweep", "study.yaml", "--restart")


def test_every_beginning_of_a_journal_can_be_gone_on_with(folder):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    before, whole = TABLE.read_bytes(), ROWS.read_bytes()
    for length in random.Random(3).sample(range(len(whole)), 25):
        ROWS.write_bytes(whole[:length])
        run("sweep", "study.yaml", "--resume", "--quiet")
        assert TABLE.read_bytes() == before
        assert sorted(ROWS.read_bytes().splitlines()) == sorted(whole.splitlines())


def test_an_unfinished_run_is_not_overwritten(folder):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    cut(2)
    left = ROWS.read_bytes()
    assert run("sweep", "study.yaml", code=2).lines == [
        "results/study.rows.jsonl: an unfinished run is there, 2 rows done: go on with --resume,"
        " or begin anew with --restart"
    ]
    assert ROWS.read_bytes() == left
    run("sweep", "study.yaml", "--check")  # reads what is written, touches nothing
    run("sweep", "study.yaml", "--no-write")
    assert ROWS.read_bytes() == left
    run("sweep", "study.yaml", "--restart")
    run("sweep", "study.yaml")  # finished: nothing to lose
    cut(0)
    run("sweep", "study.yaml")  # no row yet


def test_resume_refuses_what_differs_and_says_what(folder):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    cut(2)
    left = ROWS.read_bytes()
    outcome = run("sweep", "study.yaml", "--set", "cable.density=8 g/cm^3", "--set", "wind=null", "--resume", code=2)
    assert "results/study.rows.jsonl: cable.density: 1440 kg/m^3 there, 8 g/cm^3 now" in outcome.lines
    assert "results/study.rows.jsonl: wind.speed: 6 m/s there, not given now" in outcome.lines
    assert "--restart begins anew" in outcome.lines[-1]
    head, rows = left.split(b"\n", 1)
    head = json.loads(head)
    known = {part: head[part] for part in ("program", "scene", "vary", "columns")}
    known["program"]["cablestudy"] = "9.1"
    ROWS.write_bytes(json.dumps({"journal": 2, "fingerprint": digest(known), **known}).encode() + b"\n" + rows)
    (line, _) = run("sweep", "study.yaml", "--resume", code=2).lines
    assert line.startswith("results/study.rows.jsonl: version of cablestudy: 9.")
    ROWS.write_bytes(left.replace(b'{"journal": 2', b'{"journal": 7', 1))
    (line,) = run("sweep", "study.yaml", "--resume", code=2).lines
    assert line.endswith("is a journal of another version of cablestudy; --restart begins anew")
    run("sweep", "study.yaml", "--restart")
    ROWS.write_bytes(b"sag_m\n1\n")
    for option in ("--resume", "--restart"):
        assert run("sweep", "study.yaml", option, code=2).lines == [
            "results/study.rows.jsonl: is no journal of a sweep; move it away"
        ]
    assert ROWS.read_bytes() == b"sag_m\n1\n"


def test_two_sweeps_do_not_write_one_journal(folder):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    cut(2)
    with ROWS.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        line = "results/study.rows.jsonl: another sweep is at work on it"
        for option in ("--resume", "--restart"):
            assert run("sweep", "study.yaml", option, code=2).lines == [line]
    run("sweep", "study.yaml", "--resume")


def test_a_study_with_more_rows_computes_only_those(folder, computed):
    study_file(folder, FEW, SLACK)
    run("sweep", "study.yaml")
    grown = FEW.replace("[186 m, 187 m,", "[185.9 m, 187 m, 186 m, 186.5 m,")
    study_file(folder, grown, SLACK)
    computed.clear()
    assert run("sweep", "study.yaml", "--resume").lines[0] == "4 of 6 rows are there already"
    assert sum(count for count, _ in computed) == 2
    grown_table = TABLE.read_bytes()
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == grown_table
    # one more thing varies: its old value is known
    study_file(folder, grown.replace("vary: [", "vary: [{cable.area: [24.2 mm^2, 30 mm^2]}, "), SLACK)
    computed.clear()
    assert run("sweep", "study.yaml", "--resume").lines[0] == "6 of 12 rows are there already"
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
    ],
)
def test_a_study_with_other_columns_computes_only_what_is_new(folder, computed, before, after, computes):
    vary = "vary: [{cable.unstretched_length: [186 m, 187 m, 100 m]}]\n"
    study_file(folder, f"{vary}columns: {before}\n", SLACK)
    run("sweep", "study.yaml", code=3)  # a cable of 100 m breaks
    study_file(folder, f"{vary}columns: {after}\n", SLACK)
    computed.clear()
    run("sweep", "study.yaml", "--resume", code=3)
    # the row that failed is computed as a whole: another column may have been the reason
    expected = Counter({tuple(after[1:-1].split(", ")): 1})
    expected[tuple(computes.split(", "))] += 2 if computes else 0
    found = Counter()
    for count, columns in computed:
        found[columns] += count
    assert +found == +expected
    table = TABLE.read_bytes()
    run("sweep", "study.yaml", "--restart", code=3)
    assert TABLE.read_bytes() == table


def test_new_columns_may_fail_where_the_old_ones_did_not(folder):
    study_file(folder, "vary: [{gondola: [{mass: 5 kg}, null]}]\ncolumns: [sag]\n", SLACK)
    run("sweep", "study.yaml")
    study_file(folder, "vary: [{gondola: [{mass: 5 kg}, null]}]\ncolumns: [sag, gondola_frequency_static]\n", SLACK)
    run("sweep", "study.yaml", "--resume", code=3)
    table = TABLE.read_bytes()
    run("sweep", "study.yaml", "--restart", code=3)
    assert TABLE.read_bytes() == table


def test_a_growing_study_can_be_ended_too(folder, computed, monkeypatch):
    vary = "vary: [{cable.unstretched_length: [186 m, 187 m, 188 m]}]\n"
    study_file(folder, f"{vary}columns: [sag]\n", SLACK)
    run("sweep", "study.yaml")
    study_file(folder, f"{vary}columns: [sag, preload]\n", SLACK)
    monkeypatch.setattr(chunk, "evaluate_cases", lambda *_: signal.raise_signal(signal.SIGINT))
    outcome = run("sweep", "study.yaml", "--resume", code=130)
    assert outcome.lines[0] == "0 of 3 rows are there already, and some columns of 3 more"
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    calls, evaluate = [], chunk.evaluate_cases
    monkeypatch.setattr(chunk, "evaluate_cases", lambda s, c: calls.extend(x.name for x in c) or evaluate(s, c))
    run("sweep", "study.yaml", "--resume")
    assert set(calls) == {"preload"}
    table = TABLE.read_bytes()
    run("sweep", "study.yaml", "--restart")
    assert TABLE.read_bytes() == table


def test_what_can_be_used_again():
    moving = ["sag_m", "cable_frequency_Hz"]
    assert growth.usable(["sag_m"], ["sag_m", "preload_N"]) == {"sag_m"}
    assert growth.usable(moving, [*moving, "preload_N"]) == set(moving)
    assert growth.usable(moving, [*moving, "axial_frequency_1_Hz"]) == {"sag_m"}
    assert growth.usable(moving, [*moving, "error_estimate"]) == set()
    assert growth.usable([*moving, "error_estimate"], ["error_estimate", *moving]) == {*moving, "error_estimate"}


def test_a_key_is_of_the_resolved_scene(folder):
    study_file(folder, "vary: [{cable.unstretched_length: [186 m, 18600 cm, 187 m]}]\ncolumns: [sag]\n", SLACK)
    keys = [chunk.key_of(scene) for _, scene in read_study("study.yaml").cases()]
    assert keys[0] == keys[1] != keys[2]


def test_a_worker_of_another_version_is_refused(folder):
    study = read_study(study_file(folder, FEW, SLACK))
    piece = chunk.Chunk(b"", {**identity(study, prepare(study)[0])["program"], "numpy": "0.1"}, (), (0,))
    with pytest.raises(SceneError, match=r"a worker has numpy \S+, not 0\.1"):
        chunk.compute(piece)


def test_the_size_of_chunks_and_the_number_of_processes_change_no_digit(folder, monkeypatch):
    text = LONG.replace("900", "40").replace("sag,", "sag, end_stiffness, gondola_frequency,")
    study_file(folder, text, SLACK)
    tables = []
    for seconds, jobs in ((0.0, "1"), (0.02, "1"), (10.0, "1"), (0.05, "2"), (10.0, "3")):
        monkeypatch.setattr("cablestudy.sweep.supply.SECONDS", seconds)
        run("sweep", "study.yaml", "--jobs", jobs)
        tables.append(TABLE.read_bytes())
    assert len(set(tables)) == 1


def test_a_process_that_dies_is_replaced(folder):
    study_file(folder, LONG, SLACK)
    sweep = start("study.yaml", "--jobs", "2")
    wait_for_rows(sweep, 3, ROWS)
    workers = _descendants(sweep.pid)
    assert len(workers) >= 2
    subprocess.run(["kill", "-9", str(workers[-1])], check=True)
    _, said = sweep.communicate(timeout=60)
    assert sweep.returncode == 0, said
    assert said == "written: results/study.csv, results/study.md\n"
    run("sweep", "study.yaml", "--out", "whole", "--jobs", "1")
    assert TABLE.read_bytes() == Path("whole/study.csv").read_bytes()


def _descendants(pid):
    """Processes that a process and its children started, the youngest last."""
    listed = subprocess.run(["ps", "-eo", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    pairs = [tuple(map(int, line.split())) for line in listed.splitlines()]
    found = [pid]
    for parent in found:
        found += [child for child, other in pairs if other == parent]
    return sorted(found[1:])


def test_processes_that_always_die_are_given_up(folder, monkeypatch):
    study_file(folder, FEW, SLACK)
    monkeypatch.setattr(parallel, "compute", _die_elsewhere)
    outcome = run("sweep", "study.yaml", "--jobs", "2", code=3)
    assert outcome.lines == ["processes end by themselves: too little memory for so many jobs?"]
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    run("sweep", "study.yaml", "--resume")


def _die_elsewhere(piece):
    import multiprocessing
    import os

    if multiprocessing.parent_process() is not None:
        os._exit(9)
    return chunk.compute(piece)


def test_no_more_processes_than_cores_have_use_for(monkeypatch):
    asked = []
    monkeypatch.setattr(parallel, "cores", lambda: 2)
    monkeypatch.setattr(parallel, "processes", lambda supply, jobs: asked.append(jobs) or iter(()))
    monkeypatch.setattr(parallel, "here", lambda *_: iter(()))
    for jobs in (2, 8, 1000):
        list(parallel.local(SimpleNamespace(left=10_000), jobs))
    assert asked == [2, 8, 8]


def test_a_full_disk_is_one_line_and_what_is_there_stays(folder):
    study_file(folder, LONG, SLACK)
    full = "ulimit -f 4; exec {} -m cablestudy sweep study.yaml --jobs 1"  # blocks of 1024 bytes
    done = subprocess.run(["bash", "-c", full.format(sys.executable)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "results/study.rows.jsonl: cannot be written (File too large); --resume goes on\n"
    assert names() == ["study.rows.jsonl"]
    reused = run("sweep", "study.yaml", "--resume").lines[0]
    assert 0 < int(reused.split()[0]) < 900
    run("sweep", "study.yaml", "--out", "whole")
    assert TABLE.read_bytes() == Path("whole/study.csv").read_bytes()


def test_columns_are_found_by_their_headers():
    assert find("sag_m") is find("sag")
