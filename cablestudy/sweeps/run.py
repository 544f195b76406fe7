"""One run of a study, from the stored rows to the table: what is computed, what is reported, how to go on."""

import json
import os
import re
import shlex
import sys
from collections import Counter
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache, partial
from itertools import islice

from cablestudy.errors import CablestudyError, NoSolutionError, SceneError
from cablestudy.interrupts import Interrupts
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted, first_of
from cablestudy.study.case_table import tables_of
from cablestudy.study.column import CLOSED
from cablestudy.study.columns import find_header
from cablestudy.study.notes import above_accuracy, is_probability
from cablestudy.study.prepare import prepare
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.table import write_whole
from cablestudy.study.table_rows import FALLEN, OK, OVER_STRENGTH, SLACK
from cablestudy.sweeps.chunks import Chunks, scene_hashes
from cablestudy.sweeps.driver import compute_here, compute_on_cluster
from cablestudy.sweeps.fingerprint import identity, provenance
from cablestudy.sweeps.progress import Progress
from cablestudy.sweeps.record import pack, unpack
from cablestudy.sweeps.rows import table_of
from cablestudy.sweeps.store import COMPLETE, MISSING, PARTIAL, open_store
from cablestudy.sweeps.tolerances import SWEEPS

# beginning of a status, and in a warning
DOUBTS = (
    (OVER_STRENGTH, "the stress is above the strength"), (SLACK, SLACK), (FALLEN, "without the lost cables it falls"),
)  # fmt: skip
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class SweepOptions:
    """Options of `cablestudy sweep`; `keep` the rows on disk as they are done."""

    keep: bool = False
    resume: bool = False
    restart: bool = False
    jobs: int | None = None
    scheduler: str | None = None
    shard: tuple[int, int] | None = None  # K of N, from 1
    row: int | None = None  # from 1
    fail_fast: bool = False
    explain: bool = False
    estimate: bool = False
    quiet: bool = False

    def cases(self, count):
        """The cases of a study that are to be computed: range from 0."""
        if self.row is not None:
            if self.row > count:
                raise SceneError(f"--row {self.row}: the study has {counted(count, 'case')}")
            return range(self.row - 1, self.row)
        number, shards = self.shard or (1, 1)
        return range(number - 1, count, shards)


class Run:
    """One run of a study: its stored rows, the computation of those that are missing, its table. A context manager.

    From a `StudyFile`, `TableFiles` and `SweepOptions`. SceneError where something is wrong with the study, or with the
    rows that are there; nothing has been computed then.
    """

    def __init__(self, study, files, options):
        self.study, self.files, self.options = study, files, options
        self.columns, self._reference = prepare(study)
        self.cases = options.cases(study.count)
        self.identity = identity(study, self.columns)
        self.path = files.shard(*options.shard) if options.shard else files.rows
        self.store = None
        self._started = datetime.now(UTC)

    def __enter__(self):
        with ExitStack() as on_error:
            self.store = on_error.enter_context(closing(self._open()))
            if self.store.identity != self.identity:  # rows of the study before it was edited
                reuse_rows(self.store, self.study, self.cases, self.identity)
            self._reused = self.done
            on_error.pop_all()
        return self

    def __exit__(self, *_):
        self.store.close()

    def _open(self):
        """The store of the rows: in memory, or in the folder with what an earlier run has left there."""
        options = self.options
        if not options.keep:
            return open_store("", self.identity, self.study.count)
        self.files.make()
        reuse = 0 if options.explain or (options.estimate and has_fixed_elements(self.study)) else len(self.cases)
        store = open_store(self.path, self.identity, self.study.count, options.resume, options.restart, reuse)
        if not options.shard:
            self.files.clear()
        old_file = self.path.removesuffix(".sqlite") + ".jsonl"
        if options.resume and os.path.exists(old_file):
            warning = "rows of an earlier version of cablestudy are not used; it may be deleted"
            store.warnings.append(f"{old_file}: {warning}")
        return store

    def compute(self):
        """Compute the rows that are missing, and store each chunk of them, some rows, as soon as it is done.

        Whatever ends the run, the rows that are done stay stored, and a later run goes on with them. With the option
        `fail_fast` it ends after the first chunk in which a row has no answer.

        Raises
        ------
        KeyboardInterrupt
            Ctrl-C or SIGTERM.
        NoSolutionError
            Workers die, or the scheduler is gone.
        """
        store, options, done = self.store, self.options, self._reused
        headers = [column.header for column in self.columns]
        work = [  # cases, and the columns to compute of them: of partial rows only those that are not known
            (store.select(self.cases, MISSING), headers),
            (store.select(self.cases, PARTIAL), [header for header in headers if header not in store.partial]),
        ]
        chunks = Chunks(self.study, work, len(self.cases) - self._reused, options.explain, options.estimate)
        progress = Progress(len(self.cases), self._reused, options.quiet)
        try:
            with Interrupts() as interrupts, closing(self._results(chunks)) as results, closing(progress):
                for result in results:
                    with interrupts.deferred():
                        store.add(result.headers, result.records)
                    done += len(result.records)
                    progress(done, result.seconds)
                    if options.fail_fast and result.failed:
                        return
        except NoSolutionError as error:
            raise NoSolutionError(f"{error}{self._resumable()}") from None

    def _results(self, chunks):
        """Iterator of the results of the chunks: `Done`, in any order."""
        if self.options.scheduler is None:
            return compute_here(chunks, self.options.jobs)
        notify = None if self.options.quiet else partial(print, file=sys.stderr, flush=True)
        return compute_on_cluster(chunks, self.options.scheduler, notify)

    def _resumable(self):
        """End of a message on a sweep that was interrupted: how to resume it, if its rows are kept."""
        return f"; --resume goes on: {self.done} rows are done" if self.options.keep else ""

    @property
    def done(self):
        """Number of complete rows."""
        return self.store.how_many(self.cases, COMPLETE)

    @property
    def failed(self):
        """Number of rows without an answer."""
        return sum(1 for _ in self.store.failures())

    def check_complete(self):
        """Raise NoSolutionError if `fail_fast` ended the run."""
        if self.done < len(self.cases):
            raise NoSolutionError(f"stopped at the first case without an answer (--fail-fast){self._resumable()}")

    def table(self):
        """The table of a complete run."""
        return table_of(self.study, self.columns, self._reference, self.store, self.cases)

    def notes(self):
        """Yield lines on what was modelled, of each row that is done."""
        for case in self.store.select(self.cases, COMPLETE):
            yield from (f"row {case + 1}: {note}" for note in self.store.row(case).notes)

    def write(self, table, command):
        """Write the table and where it comes from; the rows stay, for a study that is edited."""
        self.files.write(self.study, table, self._record(command))
        self.store.set_finished(True)

    def finish_shard(self, command):
        """Write where a shard comes from; return its file."""
        write_whole(self.path.removesuffix(".sqlite") + ".run.yaml", self._record(command))
        self.store.set_finished(True)
        return self.path

    def _record(self, command):
        """Record of the run that computed the table, as YAML: for NAME.run.yaml next to it."""
        import yaml

        rows = {"total": len(self.cases), "reused": self._reused, "failed": self.failed}
        content = provenance(command, self.identity, self._started, rows=rows)
        content["study"] = {name: value for name, value in self.identity.items() if name != "versions"}
        return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=SCENE.line_width)

    def reused(self):
        """List of lines: what was found damaged, and how many rows are there already."""
        partial_rows = self.store.how_many(self.cases, PARTIAL)
        if not (self._reused or partial_rows):
            return self.store.warnings
        if self._reused == len(self.cases) and not self.options.resume:
            return [*self.store.warnings, f"{counted(self._reused, 'row')} as stored; --restart computes anew"]
        line = f"{self._reused} of {len(self.cases)} rows are there already"
        return [*self.store.warnings, line + (f", and some columns of {partial_rows} more" if partial_rows else "")]

    def failures(self, words):
        """Lines about the rows without an answer: the first of them, how many of each kind, how to see one alone.

        `words` are the command, `sweep STUDY ...`, without what says how to compute; a study that is standard input
        cannot be read again.
        """
        listed = list(islice(self.store.failures(), SWEEPS.listed))
        lines = [f"row {case + 1}: {status}" for case, status in listed]
        if self.options.row is not None or not lines:
            return lines
        kinds = Counter(NUMBER.sub("…", status) for _, status in self.store.failures())
        counts = [f"{count} x {kind}" for kind, count in kinds.most_common(SWEEPS.failure_kinds)]
        others = kinds.total() - sum(count for _, count in kinds.most_common(SWEEPS.failure_kinds))
        counts += [f"{others} x others"] if others else []
        lines.append(f"{kinds.total()} of {self.done} rows have no answer: " + "; ".join(counts))
        for case, _ in listed[: 0 if words[1] == "-" else SWEEPS.replayed_failures]:
            lines.append(f"row {case + 1} alone: {command(words, '--row', case + 1)}")
        return lines

    def warnings(self):
        """List of lines: what a stated tension means in the first case, doubtful rows, errors above the accuracy."""
        lines = []
        with suppress(CablestudyError):
            scene = self.study.case(0)[1]
            lines += kind_of(scene).notes_on_stated(kind_of(scene).case(scene))
        for doubt, words in DOUBTS:
            rows = [str(case + 1) for case in self.store.doubtful(doubt)]
            if rows:
                lines.append(f"warning: {words} in {len(rows)} of {self.done} rows: {first_of(rows, SWEEPS.listed)}")
        return [*lines, *above_accuracy(self._errors())]

    def _errors(self):
        """Yield the errors of each row that states any, header -> error, its probabilities, and its accuracy."""
        headers = {column.header for column in self.columns}
        probabilities = {header: i for i, header in enumerate(self.store.headers) if is_probability(header)}
        varied = any(key.partition(".")[0] == "model" for key in self.study.set_keys)
        accuracy_of = lru_cache(maxsize=1)(lambda case: self.study.case(case)[1].model.accuracy)
        first = None
        for case, errors, cells in self.store.errors():
            first = case if varied or first is None else first
            accuracy = accuracy_of(first)
            if accuracy is None and not varied:  # the scenes state their elements
                return
            cells = json.loads(cells) if probabilities else ()
            values = {header: cells[i] for header, i in probabilities.items()}
            yield {name: error for name, error in errors.items() if name in headers}, values, accuracy

    def interrupted(self, words):
        """Lines that say how to go on with a run that was ended."""
        if not self.options.keep:
            return ["interrupted: nothing is kept of a run that writes nothing"]
        words = [word for word in words if word not in ("--resume", "--restart")]
        return [
            f"interrupted: {self.done} of {len(self.cases)} rows are done, in {self.path}; to go on:",
            command(words, "--resume"),
        ]


def has_fixed_elements(study):
    """True if the elements of cables are fixed, so that the errors of motion are estimated only on request."""
    _, scene = study.case(0)
    return scene.model.elements is not None or any(key.startswith("model") for key in study.set_keys)


def command(words, *more):
    """A command as it can be typed into a shell."""
    return shlex.join(["cablestudy", *map(str, (*words, *more))])


def read_shard(text):
    """K and N of the option `--shard K/N`; None of None."""
    if text is None:
        return None
    match = re.fullmatch("([0-9]{1,9})/([0-9]{1,9})", text)
    number, count = map(int, match.groups()) if match else (0, 0)
    if not 1 <= number <= count:
        raise SceneError(f"--shard {text}: expected K/N with K from 1 to N, for example 3/8")
    return number, count


# --------------------------------------------------------------- rows of an earlier run that an edited study uses again


def reusable_columns(old, new):
    """Columns whose stored values another run can use again, because it would compute the same digits.

    It depends on what a column is computed from (`Column.needs`):

    - scene, statics or stiffness (CLOSED): always, since the value depends on no other column.
    - a model of the motion: only if both runs have the same columns of this kind. The model is refined until they all
      are accurate.
    - "run", the computation itself, such as its error estimate: this depends on all columns. If the new run has such a
      column, nothing is used unless both runs have the same columns throughout.

    Parameters
    ----------
    old, new : sequence of str
        Headers of the stored columns, and of the columns of the new run.

    Returns
    -------
    frozenset of str
        Headers, without `status`; empty if whole rows must be computed.
    """
    stored, asked = ({name: find_header(name).needs for name in names if name != "status"} for names in (old, new))
    if stored == asked:
        return frozenset(asked)
    if "run" in asked.values():
        return frozenset()
    same_motion = _columns_of_motion(stored) == _columns_of_motion(asked)
    common = stored.keys() & asked.keys()
    return frozenset(name for name in common if asked[name] in CLOSED or same_motion)


def _columns_of_motion(needs_of):
    """Set of the columns, from a mapping of name -> what it needs, that need a model of the motion."""
    return {name for name, needs in needs_of.items() if needs not in CLOSED}


def reuse_rows(store, study, cases, identity):
    """Give a store with the rows of an earlier run those cases (from 0) of the edited study that are the same."""
    headers = [header for header in identity["columns"] if header != "status"]
    reusable = reusable_columns(store.headers, headers)
    partial = [header for header in headers if header in reusable] if not reusable.issuperset(headers) else []
    records = _reusable_records(store, study, cases, headers, reusable) if reusable else ()
    store.replace(identity, partial, records)


def _reusable_records(store, study, cases, headers, reusable):
    """Yield records, from `record.pack`, of the cases of a study whose scenes the store of an earlier run has.

    They have cells of the headers; those that are not reusable stay empty, and the record is partial.
    """
    old_headers = store.headers
    same_columns, complete = set(old_headers) == set(headers), reusable.issuperset(headers)
    for case, stored in _stored_rows_of(store, study, cases):
        row = unpack(stored, old_headers)
        if row.status != OK and not same_columns:  # another column may be the reason of its status
            continue
        cell_of = {header: cell for header, cell in zip(old_headers, row.cells, strict=True) if header in reusable}
        cells = [cell_of.get(header) for header in headers]
        yield pack(case, row.key, row.status if complete else None, cells, row.errors, row.notes)


def _stored_rows_of(store, study, cases):
    """Yield (case, stored row) where a complete row has the hash of the scene of a case."""
    store.database.execute("CREATE TEMP TABLE cases (row INTEGER PRIMARY KEY, key TEXT)")
    store.database.execute_many("INSERT INTO cases VALUES (?, ?)", _hashes(study, cases))
    joined = store.database.execute(
        "SELECT cases.row, rows.row, rows.key, status, cells, errors, notes, sum FROM cases JOIN rows USING (key)"
        " WHERE status IS NOT NULL"
    )
    for row, *stored in joined:
        yield row - 1, stored
    store.database.execute("DROP TABLE cases")


def _hashes(study, cases):
    """Yield row, from 1, and hash of the scene of each case whose scene is valid."""
    for first in range(0, len(cases), SWEEPS.chunk_cases):
        tables, _ = tables_of(study, cases[first : first + SWEEPS.chunk_cases])
        for table in tables:
            yield from zip((table.cases + 1).tolist(), scene_hashes(table, study.find), strict=True)
