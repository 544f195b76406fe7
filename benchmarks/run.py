"""Prints docs/benchmarks.md (`make bench`), or some of its sections; with --tiny so small that it tells no speed.

python benchmarks/run.py [--tiny] [SECTION ...]
"""

import argparse
import os

os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))  # before numpy

import platform
import sys
import textwrap
import time

import cables
import others
import rows
import scaling
import suspensions
import sweeps
import wind_rows

# first those that start processes: these would inherit the peak memory of all that came before, and be counted with it
SECTIONS = {
    "Sweeps": sweeps.section,
    "Effort against size": scaling.section,
    "Suspensions": suspensions.section,
    "Compared with other programs": others.section,
    "Rows of a sweep": rows.section,
    "Start-up": scaling.start_up,
}
ORDER = ("Compared with other programs", "Rows of a sweep", "Sweeps", "Effort against size", "Suspensions", "Start-up")
# Sizes with which every script runs in seconds, for tests/test_benchmarks.py.
TINY = {
    cables: {"COUNT": 5},
    others: {"REPEATED": 1, "ROUNDS": 1},
    rows: {"ROWS": 2},
    scaling: {"SIZES": (250, 2000, 2500), "RUNS": 1},
    suspensions: {
        "ROWS": 4, "ROUNDS": 1, "PEER_ROWS": 2, "TOGETHER": 2, "ROUNDS_OF_MODES": 1, "NETS": {2: 12, 3: 24},
    },
    sweeps: {"SIDE": 4, "GRID_SIDE": 2},
    wind_rows: {
        "ROUNDS": 1, "FREQUENCIES": 20, "STUDIES": {key: values[:2] for key, values in wind_rows.STUDIES.items()},
    },
}  # fmt: skip


def wrapped(line):
    """A paragraph or an item of a list in lines of the usual length; tables as they are."""
    return line if line.startswith("|") else textwrap.fill(line, 118, subsequent_indent="  " * line.startswith("* "))


def main():
    """Some sections, or all, one after the other."""
    parser = argparse.ArgumentParser(description="Print docs/benchmarks.md.")
    parser.add_argument("--tiny", action="store_true", help="with the smallest sizes")
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(ORDER))
    chosen = parser.parse_args()
    for name in set(chosen.sections) - set(SECTIONS):
        parser.error(f"no section {name!r} (there are: {', '.join(ORDER)})")
    if chosen.tiny:
        for module, sizes in TINY.items():
            vars(module).update(sizes)
    wanted = chosen.sections or ORDER
    sections = {}
    for title in (title for title in SECTIONS if title in wanted):
        start = time.perf_counter()
        sections[title] = list(SECTIONS[title]())
        print(f"{title}: {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)  # noqa: T201
    import numpy
    import scipy

    versions = f"Python {platform.python_version()}, numpy {numpy.__version__}, scipy {scipy.__version__}"
    lines = [
        "# Benchmarks",
        "",
        f"Printed by `make bench` on {time.strftime('%Y-%m-%d')}: {versions},",
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, one thread. Read the ratios and exponents;",
        "another machine has other milliseconds.",
    ]
    for title in (title for title in ORDER if title in sections):
        lines += ["", f"## {title}", "", *map(wrapped, sections[title])]
    print("\n".join(lines))  # noqa: T201


if __name__ == "__main__":
    main()
