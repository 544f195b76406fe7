"""Before numpy is imported: one thread, as the command line has it; the matrices are too small for more."""

import gc
import math
import os
from contextlib import nullcontext, suppress
from importlib import import_module
from pathlib import Path

import pytest
from campaign import WHOLE, deselected
from found_once import lengths_found_once, rows_found_once
from hypothesis import HealthCheck, settings

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
os.environ["CABLESTUDY_PROGRESS"] = "off"  # it depends on how busy the machine is
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each command in a process of its own would compile the whole program
# by itself hypothesis fails what takes more than 0.2 s, and what is slow to draw
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


@pytest.fixture(scope="module", autouse=True)
def searches(request):
    """Lengths of cables are searched once for all tests but those of the search itself."""
    with nullcontext() if request.module.__name__ == "test_initial_length" else lengths_found_once():
        yield


@pytest.fixture(scope="module")
def rows_once(tmp_path_factory):
    """Rows of one scene are solved once for all tests of a module that asks for it."""
    with rows_found_once(tmp_path_factory.mktemp("rows")):
        yield


@pytest.fixture
def short_searches(monkeypatch):
    """Searches for an equilibrium that there is not give up sooner, but in `make campaigns`."""
    from cablestudy.statics import descent
    from cablestudy.statics.tolerances import STATICS

    if not WHOLE:
        monkeypatch.setattr(descent, "SOFTENED", descent.SOFTENED[::5])
        monkeypatch.setattr(type(STATICS), "softened", STATICS.softened[-1:])
        monkeypatch.setattr(type(STATICS), "soft_steps", STATICS.soft_steps // 4)


@pytest.fixture(scope="session", autouse=True)
def undivided_sweeps():
    """A sweep starts processes where they are asked for alone: the other cores have tests to run.

    Its second chunk has all rows after the first, however busy the machine is: many small ones take far longer.
    `trade` times each model once, since no test holds one time against another.
    """
    from cablestudy.study.tolerances import STUDY
    from cablestudy.sweeps.tolerances import SWEEPS

    with pytest.MonkeyPatch.context() as patch:
        for name in ("parallel_time", "chunk_time", "chunk_growth"):
            patch.setattr(type(SWEEPS), name, math.inf)
        for name in ("timing_budget", "brief_run"):
            patch.setattr(type(STUDY), name, 0.0)
        yield


def pytest_collection(session):
    """Each worker begins to import a folder of tests elsewhere, and finds compiled what the others began with.

    All of them in the same order would each compile all.
    """
    worker, workers = (os.environ.get(f"PYTEST_XDIST_WORKER{end}") for end in ("", "_COUNT"))
    if worker:
        names = sorted(path.stem for folder in session.config.args for path in Path(folder).glob("test_*.py"))
        begin = len(names) * int(worker.removeprefix("gw")) // int(workers)
        for name in names[begin:] + names[:begin]:
            with suppress(Exception):  # pytest imports it again, and tells why it fails
                import_module(name)


def pytest_collection_finish():
    """What stays until the end is never collected: looking through it again and again takes 5 % of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)


def pytest_collection_modifyitems(config, items):
    left_out = set(deselected(items))
    if left_out:
        config.hook.pytest_deselected(items=list(left_out))
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory of a test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def computed(monkeypatch):
    """What sweeps compute in this process: list of how many cases, and the names of which columns."""
    from cablestudy.sweeps import chunks

    calls, evaluate = [], chunks.evaluate_tables

    def evaluate_tables(tables, columns, *how):
        calls.append((sum(len(table.cases) for table in tables), tuple(column.name for column in columns)))
        return evaluate(tables, columns, *how)

    monkeypatch.setattr(chunks, "evaluate_tables", evaluate_tables)
    return calls


@pytest.fixture
def made(tmp_path):
    """A function from the text of a scene, and changes, to the scene."""
    from cablestudy.scene.scene import load_scene

    def from_text(text, *sets):
        path = tmp_path / "s.yaml"
        path.write_text(text, encoding="utf-8")
        return load_scene(path, sets)[1]

    return from_text
