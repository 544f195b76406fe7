"""Effort against size: static form and ten modes of a chain of bars, 250 to 100 000 of them; and start-up.

The paper's cable at 1:45 sag. Times are the best of a few runs on one thread; each size runs in a process of its own,
so that its peak memory is its own. The last row is the exponent p of time ~ bars^p, fitted over the larger half.
"""

import json
import os
import resource
import subprocess
import sys
import time

SIZES = (250, 500, 1000, 2000, 4000, 10_000, 25_000, 50_000, 100_000)
AIMS = {4000: {"static": 0.1, "modes": 0.2}, 100_000: {"total": 10.0, "memory": 1.5e9}}
RUNS = 7  # of a whole command
UNITS = {"static": "s", "modes": "s", "total": "s", "memory": "B"}


def best(function, budget=2.0, runs=5):
    """Least time of a few calls [s]."""
    times = []
    while len(times) < runs and sum(times) < budget:
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return min(times)


def measure(bars):
    """Times [s] and peak memory [bytes] for one size."""
    from cablestudy.cable import catenary, equilibrium
    from cablestudy.cable.dynamics import Dynamics
    from cablestudy.cable.meshes import mesh_segments
    from cablestudy.cable.span import Span

    area = 2.69e-6
    span = Span(185.8, 1.0, 0.0, 185.8 / 186.0 - 1, 70.3e9 * area, 1440 * area)

    def static():
        start = catenary.solve(span)
        return equilibrium.solve(start, mesh_segments(start.segments.fraction, bars))[0]

    state = static()

    def modes():
        return Dynamics(state).lowest(10)

    modes()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    return {"static": best(static), "modes": best(modes), "memory": peak}


def exponent(sizes, times):
    """Slope of log(time) over log(size), by least squares."""
    import numpy as np

    return float(np.polyfit(np.log(sizes), np.log(times), 1)[0])


def wall(*command):
    """Median wall time of a few runs of a command [s]."""
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - begin)
    return sorted(times)[len(times) // 2]


def scaling():
    """Lines of the table of sizes."""
    rows = {}
    for bars in SIZES:
        command = [sys.executable, __file__, str(bars)]
        rows[bars] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        rows[bars]["total"] = rows[bars]["static"] + rows[bars]["modes"]
    yield "| bars | static ms | 10 modes ms | peak memory MB | aims |"
    yield "|---:|---:|---:|---:|---|"
    for bars, row in rows.items():
        wanted = AIMS.get(bars, {}).items()
        aims = "; ".join(
            f"{what} < {aim:g} {UNITS[what]}: {'met' if row[what] < aim else 'MISSED'}" for what, aim in wanted
        )
        yield f"| {bars} | {1e3 * row['static']:.1f} | {1e3 * row['modes']:.1f} | {row['memory'] / 1e6:.0f} | {aims} |"
    large = [bars for bars in SIZES if bars >= 2000]
    fitted = [exponent(large, [rows[bars][what] for bars in large]) for what in ("static", "modes")]
    yield f"| exponent | {fitted[0]:.2f} | {fitted[1]:.2f} | | |"


def start_up():
    """Lines of the table of whole commands."""
    program = os.path.join(os.path.dirname(sys.executable), "cablestudy")
    click = wall(sys.executable, "-c", "import click")
    shown = wall(program, "--help")
    study = wall(program, "sweep", "configs/preload.yaml", "--no-write")
    yield "| command | median wall s | aim |"
    yield "|---|---:|---|"
    yield f'| `python -c "import click"` | {click:.3f} | |'
    yield f"| `cablestudy --help` | {shown:.3f} | {shown / click:.1f} times the line above; at most 3 |"
    yield f"| `cablestudy sweep configs/preload.yaml` | {study:.2f} | at most 0.7 |"


def section():
    """Lines of the section on size."""
    yield "The paper's cable at 1:45 sag as so many bars: static form, and the ten lowest modes. Best of a few runs,"
    yield "each size in a process of its own. The exponent p of time ~ bars^p is fitted from 2000 bars up; that of the"
    yield "static form is below 1 because a finer chain needs fewer Newton steps."
    yield ""
    yield from scaling()


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))  # noqa: T201
