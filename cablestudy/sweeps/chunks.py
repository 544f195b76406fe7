"""The cases of a sweep in chunks of about one second: how they are cut, and how one is computed."""

import gc
import pickle
import time
from dataclasses import dataclass
from functools import lru_cache, partial
from hashlib import blake2b
from itertools import chain, islice

import numpy as np
from pydantic_core import to_json

from cablestudy.errors import SceneError
from cablestudy.study.find import column_named, evaluate_found
from cablestudy.study.scene_values import CaseTable, tables_of
from cablestudy.study.status import has_answer
from cablestudy.study.study_rows import evaluate_tables
from cablestudy.sweeps.fingerprint import versions
from cablestudy.sweeps.record import pack

SECONDS = 1.0  # of computing that a chunk should take
MAX_CASES = 5000  # in a chunk: bounds the memory that rows in flight take
MAX_GROWTH = 4  # of the size from one chunk to the next: the first cases may be the cheap ones


@dataclass(frozen=True)
class Chunk:
    """Work that a worker receives."""

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


class Chunks:
    """Hands out the cases of a sweep in chunks, each case once, and adapts their size to the time that they take.

    Parameters
    ----------
    study : StudyFile
    work : sequence of (iterable of int, sequence of str)
        Cases from 0, and the columns to compute of them.
    count : int
        How many cases that are.
    explain, estimate : bool
        Whether rows keep their notes, and the errors of the motion of fixed elements.
    """

    def __init__(self, study, work, count, explain=False, estimate=False):
        self._pickled, self._kept = pickle.dumps(study), (explain, estimate)
        self._work = [(iter(cases), tuple(columns)) for cases, columns in work]
        self.left, self.size, self.seconds_per_case = count, 1, None  # not handed out; of the next; as measured last

    def next(self, workers=1):
        """The next chunk, or None when all cases are handed out; towards the end smaller ones, for so many workers."""
        while self._work:
            cases, columns = self._work[0]
            share = -(-self.left // (2 * workers)) if workers > 1 else self.left
            taken = tuple(islice(cases, max(1, min(self.size, share))))
            if taken:
                self.left -= len(taken)
                return Chunk(self._pickled, versions(), columns, taken, *self._kept)
            self._work.pop(0)
        return None

    def measure(self, done):
        """Adapt the size of the next chunks to the time that this one took."""
        self.seconds_per_case = max(done.seconds / len(done.records), 1e-9)
        self.size = int(max(1, min(SECONDS / self.seconds_per_case, MAX_GROWTH * self.size, MAX_CASES)))

    def put_back(self, chunk):
        """Take back a chunk that was not computed."""
        self.left += len(chunk.cases)
        self._work.insert(0, (iter(chunk.cases), chunk.columns))


def compute(chunk):
    """Compute a chunk, in this process or in another: Done; raises SceneError if this worker has other versions."""
    begin = time.perf_counter()
    _freeze()
    if versions() != chunk.versions:
        there = [(name, own, chunk.versions.get(name)) for name, own in versions().items()]
        differing = [f"{name} {own}, not {other}" for name, own, other in there if own != other]
        raise SceneError("a worker has " + ", ".join(differing))
    study = _study(chunk.study)
    columns = [column_named(study, name) for name in chunk.columns]
    headers = [column.header for column in columns if column.name != "status"]
    tables, refused = tables_of(study, chunk.cases)
    keys = {}
    for table in tables:
        keys.update(zip(table.cases.tolist(), keys_of(table, study.find), strict=True))
    evaluate = partial(evaluate_found, study) if study.find else evaluate_tables
    rows = evaluate(tables, columns, chunk.explain, chunk.estimate)
    records, failed = [], len(refused)
    for case in chunk.cases:
        if case in refused:  # of many cases only some are checked before the sweep begins
            records.append(pack(case, "", refused[case].without_places, [None] * len(headers)))
            continue
        numbers, status, errors, notes = rows[case]
        failed += not has_answer(status)
        records.append(pack(case, keys[case], status, numbers, errors, notes))
    return Done(headers, records, failed, time.perf_counter() - begin)


@lru_cache(maxsize=1)
def _freeze():
    """Once in each process: exempt modules and study from garbage collection."""
    gc.freeze()


@lru_cache(maxsize=2)
def _study(pickled):
    return pickle.loads(pickled)


def keys_of(table, find=None):
    """Hashes of the scenes of a CaseTable, and of what a study solves for in them: list of str.

    They identify the rows in later runs.

    Each is of the JSON of a scene: the varied numbers are put into that of one of them.
    """
    marks = {key: np.array([-1e-300 / (place + 1)]) for place, key in enumerate(table.values)}
    text = CaseTable(table.cases[:1], table.scene, marks).scene_of(0).model_dump_json().encode()
    places = sorted((text.find(to_json(mark[0].item())), key) for key, mark in marks.items())
    parts, numbers, end = [], [], 0
    for begin, key in places:
        parts.append(text[end:begin])
        numbers.append(to_json(table.values[key].tolist())[1:-1].split(b","))
        end = begin + len(to_json(marks[key][0].item()))
    end_of_text = text[end:] + (find.model_dump_json().encode() if find else b"")
    texts = [b"".join(chain.from_iterable(zip(parts, row, strict=True))) for row in zip(*numbers, strict=True)]
    return [blake2b(text + end_of_text, digest_size=12).hexdigest() for text in texts or [b""] * len(table.cases)]
