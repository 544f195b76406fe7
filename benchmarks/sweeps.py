"""Sections of docs/benchmarks.md: sweeps as users run them, whole commands by the clock on the wall."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager

from cables import HERE, verdict

CARLINA = os.path.join(HERE, os.pardir, "configs", "carlina.yaml")
SIDE, GRID_SIDE = 1000, 40  # values of each of two keys
MILLION = f"""base: {CARLINA}
set: {{model: {{accuracy: 1e-4}}}}
vary:
  - {{cable.unstretched_length: {{from: 184.2 m, to: 186 m, count: SIDE}}}}
  - {{cable.area: {{from: 2 mm^2, to: 20 mm^2, count: SIDE, spacing: log}}}}
columns: [preload, max_tension, sag, mass, end_stiffness]
"""
GRID = f"""base: {CARLINA}
vary:
  - {{cable.diameter: {{from: 1.5 mm, to: 7 mm, count: SIDE}}}}
  - {{cable.preload: {{from: 600 N, to: 1500 N, count: SIDE}}}}
columns: [mass, preload, end_stiffness, gondola_frequency, gondola_rms_open_loop, gondola_rms]
"""
LIMIT, MEMORY, WORKERS = 25.0, 2e9, 2  # [s], [B]
AIMS = {"processes": 0.8, "dask": 0.7}  # of so many times the rate of one process


def sweep(folder, *options):
    """Wall time of a sweep of study.yaml in a folder. [s]"""
    program = os.path.join(os.path.dirname(sys.executable), "cablestudy")
    begin = time.perf_counter()
    subprocess.run(
        [program, "sweep", "study.yaml", "--quiet", *options],
        cwd=folder,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return time.perf_counter() - begin


@contextmanager
def study(text, side):
    """A folder with a study of side x side cases in it."""
    with tempfile.TemporaryDirectory(prefix="cablestudy-bench-") as folder:
        with open(os.path.join(folder, "study.yaml"), "w", encoding="utf-8") as file:
            file.write(text.replace("SIDE", str(side)))
        yield folder


def million():
    """Lines: a million static rows."""
    with study(MILLION, SIDE) as folder:
        seconds = sweep(folder, "--jobs", str(WORKERS))
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        again = sweep(folder, "--resume")
        written = sum(entry.stat().st_size for entry in os.scandir(os.path.join(folder, "results")))
    count = "a million" if SIDE == 1000 else f"{SIDE**2:,}"
    yield f"| {count} rows of five static columns | measured | aim |"
    yield "|---|---:|---|"
    met = verdict(seconds <= LIMIT)
    yield f"| `sweep --jobs {WORKERS}`, tables written | {seconds:.0f} s | at most {LIMIT:.0f}: {met} |"
    yield f"| largest process | {peak / 1e6:.0f} MB | at most {MEMORY / 1e6:.0f}: {verdict(peak <= MEMORY)} |"
    yield f"| written, with the rows that a sweep goes on from | {written / 1e6:.0f} MB | |"
    yield f"| `sweep --resume` of the finished study | {again:.0f} s | |"


def parallel():
    """Lines: one process, two, and two workers of a cluster."""
    with study(GRID, GRID_SIDE) as folder:
        alone = sweep(folder, "--jobs", "1")
        found = {"processes": sweep(folder, "--jobs", str(WORKERS), "--restart", "--out", "two")}
        with _workers(folder) as address:
            if address:
                found["dask"] = sweep(folder, "--scheduler", address, "--restart", "--out", "dask")
        tables = {_bytes(folder, name) for name in ("results", "two", "dask")[: 1 + len(found)]}
    names = {"processes": f"`--jobs {WORKERS}`", "dask": f"`--scheduler`, {WORKERS} dask workers"}
    yield f"| {GRID_SIDE**2:,} rows of loop and wind | wall s | efficiency | aim |"
    yield "|---|---:|---:|---|"
    yield f"| `--jobs 1` | {alone:.1f} | | |"
    for name, seconds in found.items():
        share = alone / seconds / WORKERS
        yield f"| {names[name]} | {seconds:.1f} | {share:.2f} | at least {AIMS[name]}: {verdict(share >= AIMS[name])} |"
    if "dask" not in found:
        yield f"| {names['dask']} | not measured: dask is not installed | | |"
    yield ""
    yield f"The {1 + len(found)} tables are {'identical' if len(tables) == 1 else 'NOT identical'}, byte for byte."


def _bytes(folder, name):
    with open(os.path.join(folder, name, "study.csv"), "rb") as file:
        return file.read()


@contextmanager
def _workers(folder):
    """The address of a dask cluster of this machine with so many workers; None without dask."""
    from importlib.util import find_spec

    if find_spec("distributed") is None:
        yield None
        return
    sys.path.insert(0, os.path.join(HERE, os.pardir, "tests"))
    from cluster import cluster

    with cluster(folder, WORKERS) as made:
        yield made.address


def section():
    """Lines of the section."""
    yield (
        f"Whole commands by the clock on the wall, one BLAS thread each. Efficiency: over {WORKERS} times the rate of "
        "one process."
    )
    yield ""
    yield from million()
    yield ""
    yield from parallel()
