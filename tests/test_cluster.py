"""Sweeps on a dask cluster: a real scheduler, real workers, one of which is killed."""

import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from cluster import cluster
from command import LONGEST, SLACK, go_on, refusal, run, start_paused, stored_rows, study_file, write

from cablestudy.sweeps import driver as module
from cablestudy.sweeps.chunks import Done
from cablestudy.sweeps.tolerances import SWEEPS

pytestmark = pytest.mark.usefixtures("folder")

STUDY = """\
vary: [{cable.unstretched_length: {from: 186 m, to: 190 m, count: 300}}]
columns: [preload, cable_frequency]
"""


@pytest.fixture
def slow(folder):
    """A study that takes some seconds; its name."""
    return study_file(folder, STUDY, SLACK)


def test_a_cluster_gives_the_same_bytes_though_a_worker_is_killed(folder, slow):
    run("sweep", slow, "--out", "here", "--jobs", "1", "--quiet")
    with cluster(folder, 2) as made:
        rows = Path("there/study.rows.sqlite")
        sweep = start_paused(4, slow, "--out", "there", "--scheduler", made.file)
        made.workers[0].kill()
        done = len(stored_rows(rows))
        code, said = go_on(sweep)
        assert code == 0, said
        assert said.splitlines()[-1] == "written: there/study.csv, there/study.md"
        assert done < 300, "the sweep was over before the worker was killed"
        # by address, and the one worker that is left
        ended = start_paused(1, slow, "--out", "ended", "--scheduler", made.address)
        ended.send_signal(signal.SIGINT)
        code, said = go_on(ended)
        assert (code, len(said.splitlines())) == (130, 2), said
        assert said.startswith("interrupted: ")
        left = start_paused(1, slow, "--out", "left", "--scheduler", made.address)
        made.scheduler.kill()
        code, said = go_on(left)
        assert (code, len(said.splitlines())) == (3, 1), said
        assert said.startswith(f"{made.address}: the scheduler is gone (")
    for name in ("study.csv", "study.md"):
        assert Path("there", name).read_bytes() == Path("here", name).read_bytes()


def test_nobody_there(slow, folder, monkeypatch):
    monkeypatch.setattr(type(SWEEPS), "scheduler_wait", 1)
    write(folder / "bad.json", "{}")
    form = "expected tcp://host:port, or a scheduler file FILE.json"
    for name, reason in (
        ("tcp://127.0.0.1:9", "no scheduler answers there"),
        ("no.json", "cannot be read (No such file or directory)"),
        ("bad.json", "is no scheduler file of dask"),
        *((name, form) for name in ("odd://x", "nowhere", "tls://127.0.0.1:9")),
    ):
        assert refusal("sweep", slow, "--no-write", "--scheduler", name).startswith(f"--scheduler {name}: {reason}")


def test_without_dask_one_line_says_what_to_install(slow, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    line = refusal("sweep", slow, "--no-write", "--scheduler", "tcp://127.0.0.1:9")
    assert line == "--scheduler: dask is not installed (pip install 'cablestudy[cluster]')"


def test_distributed_is_imported_by_nothing_else(folder):
    code = "import sys; from cablestudy.cli import main; main(sys.argv[1:], standalone_mode=False)"
    code += "; sys.exit('distributed' in sys.modules)"
    command = [sys.executable, "-c", code, "sweep", study_file(folder, "columns: [sag]\n"), "--no-write"]
    done = subprocess.run(command, capture_output=True, timeout=LONGEST)
    assert (done.returncode, bool(done.stdout)) == (0, True)


def test_a_result_that_is_lost_while_it_is_told_is_a_worker_that_died():
    """As dask tells it: it finds the future neither finished nor cancelled, and takes the result for an error's."""
    done = Done([], [], 0, 0.0, 0.0)
    executor = SimpleNamespace(shutdown=lambda wait: None)
    client = SimpleNamespace(get_executor=lambda pure: executor)
    with pytest.raises(module.WorkerDeathError), module._executor(client):
        _type, _error, _trace = done
    with pytest.raises(TypeError, match="int"), module._executor(client):
        _type, _error, _trace = 3
