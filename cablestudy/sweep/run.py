"""One run of a study, from the journal to the table: what is kept, what is said, how to go on."""

import shlex
import sys
import time
from dataclasses import dataclass
from functools import partial

from cablestudy.errors import SceneError
from cablestudy.study.prepare import prepare
from cablestudy.study.table import write_whole
from cablestudy.sweep.fill import fill
from cablestudy.sweep.fingerprint import identity
from cablestudy.sweep.growth import take_over
from cablestudy.sweep.journal import Journal
from cablestudy.sweep.opening import open_journal
from cablestudy.sweep.parallel import local
from cablestudy.sweep.progress import Progress
from cablestudy.sweep.provenance import record
from cablestudy.sweep.rows import table_of

REPLAYED = 3  # failures whose command is given
KINDS = 5  # of failures that are counted each


@dataclass(frozen=True)
class Wish:
    """What is to be done with a study.

    Attributes
    ----------
    keep : bool
        Keep the rows on disk as they are done.
    resume, restart : bool
        Go on with the rows that are there, or forget them.
    jobs : int or None
        Processes; None leaves it to the work.
    scheduler : str or None
        Of dask: an address, or a file with one.
    shard : (int, int) or None
        K of N, from 1.
    row : int or None
        Only this row, from 1.
    fail_fast, explain, quiet : bool
    """

    keep: bool = False
    resume: bool = False
    restart: bool = False
    jobs: int | None = None
    scheduler: str | None = None
    shard: tuple[int, int] | None = None
    row: int | None = None
    fail_fast: bool = False
    explain: bool = False
    quiet: bool = False

    def cases(self, count):
        """The cases of a study that are to be computed: range from 0."""
        if self.row is not None:
            if self.row > count:
                raise SceneError(f"--row {self.row}: the study has {count} case{'s' * (count > 1)}")
            return range(self.row - 1, self.row)
        number, shards = self.shard or (1, 1)
        return range(number - 1, count, shards)


class Run:
    """A study on its way to its table. Use it in a `with`.

    Parameters
    ----------
    study : Study
    place : Place
    wish : Wish

    Raises
    ------
    SceneError
        Something is wrong with the study, or with the rows that are there; nothing has been computed.
    """

    def __init__(self, study, place, wish):
        self.study, self.place, self.wish = study, place, wish
        self.columns, self._reference = prepare(study)
        self.cases = wish.cases(study.count)
        self.identity = identity(study, self.columns)
        self.path = place.shard(*wish.shard) if wish.shard else place.rows
        self.journal = None
        self._begin, self._started = time.monotonic(), time.time()

    def __enter__(self):
        self.journal = self._open()
        self._known = sum(case in self.journal for case in self.cases)
        return self

    def __exit__(self, *_):
        self.journal.close()

    def _open(self):
        if not self.wish.keep:
            return Journal.temporary(self.identity, self.study.count)
        self.place.make()
        take = take_over(self.study, self.cases)
        journal = open_journal(self.path, self.identity, self.study.count, take, self.wish.resume, self.wish.restart)
        if not self.wish.shard:
            self.place.clear()
        return journal

    def compute(self):
        """Compute what is missing; see `fill`."""
        progress = None if self.wish.quiet else Progress(len(self.cases), self._known)
        try:
            fill(
                self.study, self.columns, self.cases, self.journal, self._workers(), progress,
                self.wish.fail_fast, self.wish.explain,
            )  # fmt: skip
        finally:
            if progress:
                progress.close()

    def _workers(self):
        if self.wish.scheduler is None:
            return partial(local, jobs=self.wish.jobs)
        from cablestudy.sweep.cluster import scheduled

        say = None if self.wish.quiet else partial(print, file=sys.stderr, flush=True)
        return partial(scheduled, address=self.wish.scheduler, say=say)

    @property
    def done(self):
        """How many rows are complete."""
        return sum(case in self.journal for case in self.cases)

    @property
    def complete(self):
        """Whether every row is."""
        return self.done == len(self.cases)

    def table(self):
        """The table of a complete run."""
        return table_of(self.study, self.columns, self._reference, self.journal, self.cases)

    def notes(self):
        """Yield what was modelled, row by row."""
        for case in self.cases:
            yield from (f"row {case + 1}: {note}" for note in self.journal.notes(case))

    def write(self, table, command):
        """Write the table and where it comes from; the journal stays, for a study that will grow."""
        self.place.write(self.study, table, self._record(command))
        self.journal.finish()

    def finish_shard(self, command):
        """Say where a shard comes from.

        Returns
        -------
        str
            Its file.
        """
        write_whole(self.path.removesuffix(".jsonl") + ".run.yaml", self._record(command))
        self.journal.finish()
        return self.path

    def _record(self, command):
        rows = {"total": len(self.cases), "reused": self._known, "failed": self.journal.failed}
        return record(self.identity, command, self._started, time.monotonic() - self._begin, rows)

    def reused(self):
        """List of the lines that say how many rows were there already, and what of the file is none."""
        strange, lines = self.journal.strange, []
        if strange:
            listed = ", ".join(map(str, strange[:KINDS])) + (", ..." if len(strange) > KINDS else "")
            listed = f"line{'s' * (len(strange) > 1)} {listed}"
            lines.append(f"{self.path}: left out what is no row as it was written: {listed}")
        parts = sum(1 for _ in self.journal.incomplete(self.cases))
        if not (self._known or parts):
            return lines
        known = f"{self._known} of {len(self.cases)} rows are there already"
        return [*lines, known + (f", and some columns of {parts} more" if parts else "")]

    def failures(self, words):
        """Lines about the rows without an answer: the first of them, how many of each kind, how to see one alone.

        Parameters
        ----------
        words : sequence of str
            The command without what says how to compute; `--row` is added. Empty where nothing can be typed again.

        Returns
        -------
        list of str
        """
        journal = self.journal
        lines = [f"row {case + 1}: {status}" for case, status in journal.failures]
        if self.wish.row is not None or not lines:
            return lines
        kinds = [f"{often} x {kind}" for kind, often in journal.kinds.most_common(KINDS)]
        others = journal.failed - sum(often for _, often in journal.kinds.most_common(KINDS))
        kinds += [f"{others} x others"] if others else []
        lines.append(f"{journal.failed} of {self.done} rows have no answer: " + "; ".join(kinds))
        for case, _ in journal.failures[: REPLAYED if words else 0]:
            lines.append(f"row {case + 1} alone: {command(words, '--row', case + 1)}")
        return lines

    def interrupted(self, words):
        """Lines that say how to go on with a run that was ended."""
        if not self.wish.keep:
            return ["interrupted: nothing is kept of a run that writes nothing"]
        words = [word for word in words if word not in ("--resume", "--restart")]
        return [
            f"interrupted: {self.done} of {len(self.cases)} rows are done, in {self.path}; to go on:",
            command(words, "--resume"),
        ]


def command(words, *more):
    """A command as it can be typed into a shell."""
    return shlex.join(["cablestudy", *map(str, (*words, *more))])


def read_shard(text):
    """The `K/N` of `--shard`.

    Parameters
    ----------
    text : str or None

    Returns
    -------
    (int, int) or None

    Raises
    ------
    SceneError
    """
    if text is None:
        return None
    number, _, count = text.partition("/")
    if number.isascii() and number.isdigit() and count.isascii() and count.isdigit() and len(number + count) < 16:
        shard = int(number), int(count)
        if 1 <= shard[0] <= shard[1]:
            return shard
    raise SceneError(f"--shard {text}: expected K/N with K from 1 to N, for example 3/8")
