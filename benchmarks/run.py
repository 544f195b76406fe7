"""Prints docs/benchmarks.md (`make bench`)."""

import os

os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))  # before numpy

import platform
import textwrap
import time

import others
import rows
import scaling
import suspensions
import sweeps


def wrapped(line):
    """A paragraph or an item of a list in lines of the usual length; tables as they are."""
    return line if line.startswith("|") else textwrap.fill(line, 118, subsequent_indent="  " * line.startswith("* "))


def main():
    """Every section, one after the other."""
    # first: what they start would inherit the peak memory of all that came before, and be counted with it
    whole, size, suspended = list(sweeps.section()), list(scaling.section()), list(suspensions.section())
    import numpy
    import scipy

    versions = f"Python {platform.python_version()}, numpy {numpy.__version__}, scipy {scipy.__version__}"
    sections = {
        "Beside other programs": others.section(),
        "Rows of a sweep": rows.section(),
        "Sweeps": whole,
        "Effort against size": size,
        "Suspensions": suspended,
        "Start-up": scaling.start_up(),
    }
    lines = [
        "# Benchmarks",
        "",
        f"Printed by `make bench` on {time.strftime('%Y-%m-%d')}: {versions},",
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, one thread. Read the ratios and exponents;",
        "another machine has other milliseconds.",
    ]
    for title, section in sections.items():
        lines += ["", f"## {title}", "", *map(wrapped, section)]
    print("\n".join(lines))  # noqa: T201


if __name__ == "__main__":
    main()
