"""The cases of a sweep in chunks of a few seconds: how they are cut, and how one is computed."""

import gc
import pickle
import re
import time
from dataclasses import dataclass
from functools import lru_cache, partial
from hashlib import blake2b
from itertools import chain, islice

import numpy as np
from pydantic_core import to_json

from cablestudy.errors import SceneError
from cablestudy.study.case_table import CaseTable, tables_of
from cablestudy.study.columns import column_named
from cablestudy.study.find_rows import evaluate_found
from cablestudy.study.study_rows import evaluate_tables
from cablestudy.study.table_rows import has_answer
from cablestudy.sweeps.fingerprint import versions
from cablestudy.sweeps.record import pack
from cablestudy.sweeps.tolerances import SWEEPS


@dataclass(frozen=True)
class Chunk:
    """Work that a worker receives: some cases of a study, and the columns to compute of them."""

    study: bytes  # pickled: a few kilobytes whatever the number of its cases
    versions: dict  # that the rows must be computed with
    columns: tuple  # names of those to compute
    cases: tuple  # from 0
    explain: bool = False  # keep the notes too
    estimate: bool = False  # of fixed elements keep the errors of their motion too


@dataclass(frozen=True)
class Done:
    """Result that a worker returns."""

    headers: list  # of the cells that were computed
    records: list  # one for each case, from `record.pack`
    failed: int  # how many of them have no answer
    seconds: float  # of computing
    processor: float  # seconds of it, less where a busy machine makes the process wait


class Chunks:
    """Hands out the cases of a sweep in chunks, each case once, and adapts their size to the time that they take.

    `work` are pairs of cases, from 0, and names of the columns to compute of them; `count` is the number of cases in
    it. `explain` and `estimate` say whether rows keep their notes, and the errors of the motion of fixed elements.
    """

    def __init__(self, study, work, count, explain=False, estimate=False):
        self._pickled, self._options = pickle.dumps(study), (explain, estimate)
        self._work = [(iter(cases), tuple(columns)) for cases, columns in work]
        self.left = count  # cases that are not handed out
        self.size = 1  # cases of the next chunk
        self.seconds_per_case = None  # as measured last

    def next(self, workers=1):
        """The next chunk, or None when all cases are handed out; smaller towards the end, one for each worker."""
        while self._work:
            cases, columns = self._work[0]
            largest = -(-self.left // (2 * workers)) if workers > 1 else self.left
            chosen = tuple(islice(cases, max(1, min(self.size, largest))))
            if chosen:
                self.left -= len(chosen)
                return Chunk(self._pickled, versions(), columns, chosen, *self._options)
            self._work.pop(0)
        return None

    def measure(self, done):
        """Adapt the size of the next chunks to the time that this one took."""
        self.seconds_per_case = max(done.seconds / len(done.records), 1e-9)
        wanted = SWEEPS.chunk_time * len(done.records) / max(done.processor, 1e-9)
        self.size = int(max(1, min(wanted, SWEEPS.chunk_growth * self.size, SWEEPS.chunk_cases)))

    def requeue(self, chunk):
        """Take back a chunk that was not computed."""
        self.left += len(chunk.cases)
        self._work.insert(0, (iter(chunk.cases), chunk.columns))


def compute(chunk):
    """Compute the rows of a chunk, in this process or in a worker, and let go of their models: as `_compute_rows`."""
    done = _compute_rows(chunk)
    if done.processor > SWEEPS.collected_time:
        gc.collect()  # models of rows refer to each other in circles, and their arrays are large
    return done


def _compute_rows(chunk):
    """The `Done` of a chunk: a record for each case; one that is no valid scene says so in its status.

    SceneError if this process has other versions of program or libraries than the sweep, so that digits would differ.
    """
    begin, processor_begin = time.perf_counter(), time.process_time()
    _freeze()
    _check_versions(chunk.versions)
    study = _study(chunk.study)
    columns = [column_named(study, name) for name in chunk.columns]
    headers = [column.header for column in columns if column.name != "status"]
    tables, errors_of_scenes = tables_of(study, chunk.cases)
    hashes = {}  # by case
    for table in tables:
        hashes.update(zip(table.cases.tolist(), scene_hashes(table, study.find), strict=True))
    evaluate = partial(evaluate_found, study) if study.find else evaluate_tables
    rows = evaluate(tables, columns, chunk.explain, chunk.estimate)
    computed = []
    for case in chunk.cases:
        if case in errors_of_scenes:  # of many cases only some are checked before the sweep begins
            computed.append((case, "", errors_of_scenes[case].without_places, [None] * len(headers), (), ()))
        else:
            cells, status, errors, notes = rows[case]
            computed.append((case, hashes[case], status, cells, errors, notes))
    failed = sum(not has_answer(status) for _, _, status, *_ in computed)
    records, processor = [pack(*row) for row in computed], time.process_time() - processor_begin
    return Done(headers, records, failed, time.perf_counter() - begin, processor)


def _check_versions(expected):
    """Raise SceneError if this process has other versions, see `fingerprint.versions`, than those expected."""
    if versions() == expected:
        return
    pairs = [(name, version, expected.get(name)) for name, version in versions().items()]
    differing = [f"{name} {version}, not {other}" for name, version, other in pairs if version != other]
    raise SceneError("a worker has " + ", ".join(differing))


@lru_cache(maxsize=1)
def _freeze():
    """Once in each process: exempt modules and study from garbage collection."""
    gc.freeze()


@lru_cache(maxsize=2)
def _study(pickled):
    """The StudyFile of a chunk."""
    return pickle.loads(pickled)


def scene_hashes(table, find=None):
    """Hash of each scene of a `CaseTable`, by which later runs recognise rows that are computed already: list of str.

    What is hashed is the scene as JSON, followed by the goal of the study, a `Find` or None. To write JSON is slow. So
    only one scene is written, with a placeholder for each varied number: a number that occurs nowhere else. The numbers
    of each case then replace the placeholders in the text.
    """
    placeholders = {key: np.array([-1e-300 / (i + 1)]) for i, key in enumerate(table.values)}
    template = CaseTable(table.cases[:1], table.scene, placeholders).scene_of(0).model_dump_json().encode()
    written = {key: to_json(number[0].item()) for key, number in placeholders.items()}
    found = {key: re.finditer(re.escape(written[key]), template) for key in placeholders}
    positions = sorted((match.start(), key) for key, matches in found.items() for match in matches)
    pieces, numbers, end = [], [], 0  # of the template before each number; the texts of that number in all cases
    for begin, key in positions:
        pieces.append(template[end:begin])
        numbers.append(to_json(table.values[key].tolist())[1:-1].split(b","))
        end = begin + len(written[key])
    end_of_text = template[end:] + (find.model_dump_json().encode() if find else b"")
    texts = [b"".join(chain.from_iterable(zip(pieces, row, strict=True))) for row in zip(*numbers, strict=True)]
    return [blake2b(text + end_of_text, digest_size=12).hexdigest() for text in texts or [b""] * len(table.cases)]
