"""Ten thousand random scenes against the truth: `make extremes`, or extremes.py [--scenes N] [--first SEED] [--jobs N].

With --suspensions random suspensions of several cables, bodies and junctions; what is promised of them is that no error
is larger than ten times the stated one, and that none takes more than 30 s.

Every process has one thread and keeps only the summary of a scene. Prints a table for each column and accuracy, the
refusals with their reasons, the slowest rows, and the worst offenders, each with the command that shows its scene.

With --out FILE the cells are appended to a file as they come, a line of JSON for each scene; --resume goes on from it,
and with all scenes in it only prints the report. A scene is given up after a minute, and counts as a broken promise.

A cell counts as solved when it has a number, alone or in a row with others; or when the cable hangs folded and the
column is one of motion, of which there is none at a fold: its statics are asked for alone, and must be there. The
median of stated over true error is taken of all cells whose error can be told from rounding.
"""

import argparse
import importlib
import json
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

TRUE = 0.999  # share of cells whose error is below the stated one
TIMES = 10  # no error is larger than so many times the stated one
IDLE = 100  # median of stated over true error
SOLVED = 0.99
SLOW = {"random_scenes": 10.0, "random_suspensions": 30.0}  # s of one row
FOLDED = "refused: the cable hangs folded"


def examined(task):
    """Cells of one scene."""
    scenes, seed, every = task
    module = importlib.import_module(scenes)
    return seed, module.examine(seed, module.ACCURACIES if every else ())


def answered(cells, static):
    """Share of cells that are solved, and how many folded cables are among them; `static`: names of such columns."""
    hanging = {cell.seed for cell in cells if cell.value is not None and cell.column in static}
    folded = [cell for cell in cells if cell.note.startswith(FOLDED) and cell.column not in static]
    given = [cell for cell in folded if cell.seed in hanging]
    solved = sum(cell.value is not None for cell in cells)
    return (solved + len(given)) / max(len(cells), 1), len({cell.seed for cell in given}), solved / max(len(cells), 1)


def median(values):
    """Middle value, or None."""
    values = sorted(values)
    return values[len(values) // 2] if values else None


def say(text, file=None):
    """A line of the report, or of the progress."""
    (file or sys.stdout).write(text + "\n")


def report(cells, scenes, kind):
    """Print everything; whether it is as good as promised. `kind`: the module of the scenes."""
    module = importlib.import_module(kind)
    judged = [cell for cell in cells if cell.error is not None]
    true = sum(cell.excess <= 1 for cell in judged) / max(len(judged), 1)
    worst = sorted((cell for cell in judged if cell.excess > 1), key=lambda cell: -cell.excess)
    caution = median([cell.caution for cell in judged if cell.caution is not None])
    crashed = [cell for cell in cells if cell.note.startswith(("crash", "slow"))]
    refused = {}
    for cell in cells:
        if cell.note.startswith("refused"):
            refused.setdefault(cell.seed, cell)
    solved, folded, numbers = answered(cells, module.STATIC)
    slowest = sorted({(cell.cpu, cell.seed, cell.column, cell.accuracy) for cell in cells}, reverse=True)[:5]
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
    say(f"\nscenes: {scenes}; cells: {len(cells)}, judged: {len(judged)}; crashes, warnings, given up: {len(crashed)}")
    say(
        f"cells solved: {100 * solved:.2f} %, the motion of {folded} folded cables, which has no answer, among them; "
        f"with a number: {100 * numbers:.2f} %; scenes with something refused: {len(refused)}"
    )
    for name, together in (("alone", False), ("in a row with others", True)):
        own = [cell.excess for cell in judged if cell.together == together]
        late = sum(excess > 1 for excess in own)
        say(f"  {name}: {len(own)} cells, {late} stated too small, worst {max(own, default=0):.3g} times")
    say(f"error at most as stated: {100 * true:.3f} % of cells; worst: {worst[0].excess if worst else 1:.3g} times")
    say(f"stated over true error, median: {caution if caution is None else format(caution, '.3g')}")
    for cpu, seed, column, accuracy in slowest:
        say(f"  slow: {cpu:.1f} s, seed {seed}, {column} at {accuracy:g}")
    reasons = Counter((cell.column, cell.note.split(":")[1][:60]) for cell in cells if cell.note.startswith("refused"))
    for (column, reason), count in reasons.most_common(12):
        say(f"  refused {count:5d} x {column}:{reason}")
    for cell in [*crashed[:5], *worst[:10]]:
        said = cell.note or f"error {cell.error:.2g}, stated {cell.estimate:.2g}"
        say(f"  seed {cell.seed}: {cell.column} at {cell.accuracy:g}: {said}\n    {module.replay(cell.seed)}")
    promises = [not crashed, not worst or worst[0].excess <= TIMES, slowest[0][0] <= SLOW[kind]]
    if kind == "random_scenes":
        promises += [true >= TRUE, solved >= SOLVED, caution is None or caution < IDLE]
    return all(promises)


class Ledger:
    """The cells that are known, and the file that keeps them.

    Parameters
    ----------
    path : Path or None
        A line of JSON for each scene: [seed, [cell, ...]]; the last may be torn.
    kind : list
        What each file begins with, and only such a file is gone on with.
    """

    def __init__(self, path, kind, resume):
        self.cells, self.done, self._file = [], set(), None
        if path is None:
            return
        if path.exists() and not resume:
            sys.exit(f"{path}: exists; go on from it with --resume")
        kept = path.read_bytes() if path.exists() else b""
        lines = kept[: kept.rfind(b"\n") + 1].splitlines()
        if lines and json.loads(lines[0]) != kind:
            sys.exit(f"{path}: begins with {lines[0].decode()}, not {json.dumps(kind)}")
        self._file = path.open("r+b" if lines else "wb")
        self._file.truncate(sum(len(line) + 1 for line in lines))
        self._file.seek(0, os.SEEK_END)
        if not lines:
            self._write(kind)
        from random_scenes import Cell

        for line in lines[1:]:
            seed, cells = json.loads(line)
            self._know(seed, [Cell(*cell) for cell in cells])

    def _know(self, seed, cells):
        self.done.add(seed)
        self.cells += cells

    def _write(self, entry):
        self._file.write(json.dumps(entry, default=float).encode() + b"\n")
        self._file.flush()

    def add(self, seed, cells):
        """Cells of one more scene."""
        self._know(seed, cells)
        if self._file:
            self._write([seed, [astuple(cell) for cell in cells]])

    def close(self):
        """No more cells come."""
        if self._file:
            self._file.close()


def main():
    """Run the campaign; exit code 1 when a promise is not kept."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--suspensions", action="store_true", help="suspensions instead of single cables")
    parser.add_argument("--every", action="store_true", help="each column at every accuracy, not some at one of them")
    parser.add_argument("--out", type=Path, help="append the cells of each scene to this file")
    parser.add_argument("--resume", action="store_true", help="go on from the file of --out")
    chosen = parser.parse_args()
    if chosen.resume and not chosen.out:
        parser.error("--resume needs --out")
    scenes = "random_suspensions" if chosen.suspensions else "random_scenes"
    kind = ["suspensions" if chosen.suspensions else "extremes", chosen.first, "every" if chosen.every else "some"]
    ledger = Ledger(chosen.out, kind, chosen.resume)
    wanted = range(chosen.first, chosen.first + chosen.scenes)
    todo, begin = [(scenes, seed, chosen.every) for seed in wanted if seed not in ledger.done], time.monotonic()
    with ProcessPoolExecutor(chosen.jobs, max_tasks_per_child=500) as pool:
        for count, found in enumerate(pool.map(examined, todo, chunksize=5), 1):
            ledger.add(*found)
            if count % 250 == 0:
                say(f"{count} of {len(todo)} scenes in {time.monotonic() - begin:.0f} s", file=sys.stderr)
    ledger.close()
    cells = [cell for cell in ledger.cells if cell.seed in wanted]
    sys.exit(0 if report(cells, chosen.scenes, scenes) else 1)


if __name__ == "__main__":
    main()
