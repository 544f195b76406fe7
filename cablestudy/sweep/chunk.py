"""Some cases of a study, computed wherever there is room: in this process, in another, on another machine."""

import gc
import json
import pickle
import time
from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b
from zlib import crc32

from cablestudy.errors import SceneError
from cablestudy.study.columns import ROUNDING, find
from cablestudy.study.row import evaluate_cases
from cablestudy.sweep.fingerprint import program

OK = b'"status": "ok"}}\n'  # how the line of a row with an answer ends


@dataclass(frozen=True)
class Chunk:
    """What a worker receives.

    Attributes
    ----------
    study : bytes
        The study, pickled: a few kilobytes whatever the number of its cases.
    program : dict
        Versions that the rows must come from.
    columns : tuple of str
        Names of the columns to compute.
    cases : tuple of int
        Cases to compute, from 0.
    explain : bool
        Keep the notes too.
    """

    study: bytes
    program: dict
    columns: tuple
    cases: tuple
    explain: bool = False


@dataclass(frozen=True)
class Done:
    """What a worker gives back.

    Attributes
    ----------
    lines : bytes
        One line of JSON for each case, as the journal keeps them.
    count : int
    seconds : float
    """

    lines: bytes
    count: int
    seconds: float


def compute(chunk):
    """Compute a chunk.

    Parameters
    ----------
    chunk : Chunk

    Returns
    -------
    Done

    Raises
    ------
    SceneError
        This worker runs another version of the program.
    """
    begin = time.perf_counter()
    _settle()
    here = program()
    if here != chunk.program:
        other = ", ".join(f"{name} {here[name]}, not {chunk.program[name]}" for name in here
                          if here[name] != chunk.program[name])  # fmt: skip
        raise SceneError(f"a worker has {other}")
    study = _study(chunk.study)
    columns = [find(name) for name in chunk.columns]
    scenes, refused = {}, {}
    for case in chunk.cases:
        try:
            _, scenes[case] = study.case(case)
        except SceneError as error:  # of many cases only some are checked before: the others fail alone
            refused[case] = "; ".join(f"{m.key}: {m.message}" if m.key else m.message for m in error.mistakes)
    rows = dict(zip(scenes, evaluate_cases(list(scenes.values()), columns, chunk.explain), strict=True))
    lines = []
    for case in chunk.cases:
        if case in refused:
            cells = {**dict.fromkeys((column.header for column in columns), None), "status": refused[case]}
            lines.append(line_of(case, "", cells))
        else:
            row = rows[case]
            lines.append(
                line_of(case, key_of(scenes[case]), row.cells, row.notes * chunk.explain, errors=larger(row.errors))
            )
    return Done(b"".join(lines), len(lines), time.perf_counter() - begin)


@lru_cache(maxsize=1)
def _settle():
    """Once in a process: modules and study stay, and need not be looked through for garbage over and over."""
    gc.freeze()


@lru_cache(maxsize=2)
def _study(pickled):
    return pickle.loads(pickled)


def key_of(scene):
    """What tells one resolved scene from another: the same wherever and whenever it is computed."""
    return blake2b(scene.model_dump_json().encode(), digest_size=12).hexdigest()


def larger(errors):
    """The estimated errors of a row that exceed the rounding of closed forms, and None for those that are not known."""
    return {name: error for name, error in errors.items() if error is None or error > ROUNDING}


def line_of(case, key, cells, notes=(), kind="row", errors=None):
    """A line of the journal.

    Parameters
    ----------
    case : int
        From 0; shown from 1, as everywhere.
    key : str
        From `key_of`.
    cells : dict
    notes : tuple of str
    kind : str
        `row`, or `part` while some columns are still to be computed.
    errors : dict or None
        From `larger`.
    """
    content = {"key": key}
    if notes:
        content["notes"] = notes
    if errors != {}:
        content["errors"] = errors
    status = {"status": cells["status"]} if "status" in cells else {}
    content["cells"] = {**{name: cell for name, cell in cells.items() if name != "status"}, **status}
    return summed(kind, case, json.dumps(content, ensure_ascii=False, allow_nan=False).encode()[1:])


def summed(kind, case, content):
    """A line of the journal from what it holds behind its check sum, without the line feed."""
    head = f'{{"{kind}": {case + 1}, '.encode()
    return b'%b"sum": "%08x", %b\n' % (head, crc32(content, crc32(head)), content)
