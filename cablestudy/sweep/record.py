"""One row of a table as it is stored: a tuple of plain values with a check sum."""

import json
from math import isfinite
from typing import NamedTuple
from zlib import crc32

OK = "ok"
MAX_INTEGER = 2**53  # beyond, a float does not hold it exactly


class Record(NamedTuple):
    """One row of a table, read back.

    Attributes
    ----------
    case : int
        From 0.
    key : str
        Hash of the resolved scene; empty where the case is no valid scene.
    status : str or None
        "ok", or why there is no answer; None while some columns are still to be computed.
    cells : list
        Number or None of each column but `status`, in their order.
    errors : dict
        Header -> estimated relative error, where it exceeds that of a closed form; a None is not known.
    notes : list of str
    """

    case: int
    key: str
    status: str | None
    cells: list
    errors: dict
    notes: list


def pack(case, key, status, cells, errors=(), notes=()):
    """A row as it is stored.

    Parameters
    ----------
    case, key, status, cells, errors, notes
        As in `Record`.

    Returns
    -------
    tuple
        Row from 1, key, status, JSON of cells, errors and notes ("" of an empty one), check sum.
    """
    if status != OK and status is not None:  # a message may quote a file name that is no valid text
        status = status.encode(errors="backslashreplace").decode()
    stored = (
        case + 1,
        key,
        status,
        "[" + ",".join(["null" if cell is None else repr(cell) for cell in cells]) + "]",  # as json does, but faster
        json.dumps(errors, allow_nan=False) if errors else "",
        json.dumps(notes) if notes else "",
    )
    return (*stored, check_sum(*stored))


def check_sum(row, key, status, cells, errors, notes):
    """CRC-32 of a stored row."""
    return crc32(f"{row}\n{key}\n{status}\n{cells}\n{errors}\n{notes}".encode(errors="backslashreplace"))


def unpack(stored, width):
    """A row as it was before `pack`.

    Parameters
    ----------
    stored : tuple
        What a file holds, which may be anything.
    width : int
        How many cells a row has.

    Returns
    -------
    Record or None
        None if it is not a row as `pack` makes them.
    """
    row, key, status, cells, errors, notes, total = stored
    texts = (key, cells, errors, notes)
    if type(row) is not int or row < 1 or not all(isinstance(text, str) for text in texts):
        return None
    if not (status is None or isinstance(status, str)) or check_sum(*stored[:-1]) != total:
        return None
    try:
        known = json.loads(cells), json.loads(errors) if errors else {}, json.loads(notes) if notes else []
    except (ValueError, RecursionError):
        return None
    record = Record(row - 1, key, status, *known)
    return record if _plausible(record, width) else None


def _plausible(record, width):
    """Whether cells, errors and notes are of the types that they should be."""
    cells, errors, notes = record.cells, record.errors, record.notes
    if not isinstance(cells, list) or len(cells) != width or not all(map(_number_or_none, cells)):
        return False
    if errors is not None and not (isinstance(errors, dict) and all(map(_number_or_none, errors.values()))):
        return False
    return isinstance(notes, list) and all(isinstance(note, str) for note in notes)


def _number_or_none(value):
    if type(value) is int:
        return abs(value) < MAX_INTEGER
    return value is None or (type(value) is float and isfinite(value))
