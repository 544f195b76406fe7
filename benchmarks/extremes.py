"""Ten thousand random scenes against the truth: `make extremes`, or extremes.py [--scenes N] [--first SEED] [--jobs N].

Every process has one thread and keeps only the summary of a scene. Prints a table for each column and accuracy, the
refusals with their reasons, and the worst offenders, each with the command that shows its scene.
"""

import argparse
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

TRUE = 0.999  # share of cells whose error is below the stated one
TIMES = 10  # no error is larger than so many times the stated one
IDLE = 100  # median of stated over true error
SOLVED = 0.99


def examined(seed):
    """Cells of one scene."""
    from random_scenes import examine

    return examine(seed)


def median(values):
    """Middle value, or None."""
    values = sorted(values)
    return values[len(values) // 2] if values else None


def say(text, file=None):
    """A line of the report, or of the progress."""
    (file or sys.stdout).write(text + "\n")


def report(cells, scenes):
    """Print everything; whether it is as good as promised."""
    judged = [cell for cell in cells if cell.error is not None]
    true = sum(cell.excess <= 1 for cell in judged) / max(len(judged), 1)
    worst = sorted((cell for cell in judged if cell.excess > 1), key=lambda cell: -cell.excess)
    caution = median([cell.caution for cell in judged if cell.caution is not None])
    crashed = [cell for cell in cells if cell.note.startswith("crash")]
    refused = {}
    for cell in cells:
        if cell.note.startswith("refused"):
            refused.setdefault(cell.seed, cell)
    solved = sum(cell.value is not None for cell in cells) / len(cells)
    say("| column | accuracy | cells | judged | stated too small | stated over true, median | unknowns |")
    say("|---|---|---|---|---|---|---|")
    for column, accuracy in sorted({(cell.column, cell.accuracy) for cell in cells}):
        own = [cell for cell in cells if (cell.column, cell.accuracy) == (column, accuracy)]
        seen = [cell for cell in own if cell.error is not None]
        ratio = median([cell.caution for cell in seen if cell.caution is not None])
        shown = "at rounding" if ratio is None else f"{ratio:.3g}"
        late = sum(cell.excess > 1 for cell in seen)
        counts, size = f"{len(own)} | {len(seen)} | {late}", median([cell.dof for cell in own])
        say(f"| {column} | {accuracy:g} | {counts} | {shown} | {size} |")
    say(f"\nscenes: {scenes}; cells: {len(cells)}, judged: {len(judged)}; crashes and warnings: {len(crashed)}")
    say(f"cells solved: {100 * solved:.2f} %; scenes with something refused: {len(refused)}")
    say(f"error at most as stated: {100 * true:.3f} % of cells; worst: {worst[0].excess if worst else 1:.3g} times")
    say(f"stated over true error, median: {caution if caution is None else format(caution, '.3g')}")
    reasons = Counter((cell.column, cell.note.split(":")[1][:60]) for cell in cells if cell.note.startswith("refused"))
    for (column, reason), count in reasons.most_common(12):
        say(f"  refused {count:5d} x {column}:{reason}")
    from random_scenes import replay

    for cell in [*crashed[:5], *worst[:10]]:
        said = cell.note or f"error {cell.error:.2g}, stated {cell.estimate:.2g}"
        say(f"  seed {cell.seed}: {cell.column} at {cell.accuracy:g}: {said}\n    {replay(cell.seed)}")
    return not crashed and true >= TRUE and (not worst or worst[0].excess <= TIMES) and solved >= SOLVED and (
        caution is None or caution < IDLE
    )  # fmt: skip


def main():
    """Run the campaign; exit code 1 when a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    chosen = parser.parse_args()
    seeds, cells, begin = range(chosen.first, chosen.first + chosen.scenes), [], time.monotonic()
    with ProcessPoolExecutor(chosen.jobs, max_tasks_per_child=500) as pool:
        for count, found in enumerate(pool.map(examined, seeds, chunksize=5), 1):
            cells += found
            if count % 250 == 0:
                say(f"{count} scenes in {time.monotonic() - begin:.0f} s", file=sys.stderr)
    sys.exit(0 if report(cells, chosen.scenes) else 1)


if __name__ == "__main__":
    main()
