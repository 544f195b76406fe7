"""One row of a table as it is stored: a tuple of plain values with a check sum."""

import json
from typing import Annotated, NamedTuple
from zlib import crc32

from pydantic import Field, FiniteFloat, Strict, StrictInt, StrictStr, TypeAdapter

from cablestudy.study.cable_columns import TEXTS
from cablestudy.study.table_rows import OK

COMPACT = json.JSONEncoder(separators=(",", ":"))
EXACT = 2**53  # beyond, a float does not hold an integer exactly

Number = Annotated[StrictInt, Field(gt=-EXACT, lt=EXACT)] | Annotated[FiniteFloat, Strict()]
CELLS, ERRORS = TypeAdapter(list[Number | None]), TypeAdapter(dict[str, Number | None])
CELLS_AND_TEXTS = TypeAdapter(list[Number | StrictStr | None])
NOTES = TypeAdapter(list[StrictStr])


class RowRecord(NamedTuple):
    """One row of a table, read back."""

    case: int  # from 0
    key: str  # hash of the resolved scene; empty where the case is no valid scene
    status: str | None  # see `study.table_rows`; None while some columns are still to be computed
    cells: list  # number, text or None of each column but `status`, in their order
    errors: dict  # header -> estimated relative error, where it exceeds that of a closed form; a None is not known
    notes: list  # of str


def pack(case, key, status, cells, errors=(), notes=()):
    """A row, given as in `RowRecord`, as the database stores it: tuple.

    Row from 1, key, status, JSON of the cells, JSON of the errors or "", JSON of the notes or "", check sum.
    """
    if status != OK and status is not None:  # a message may quote a file name that is no valid text
        status = status.encode(errors="backslashreplace").decode()
    errors = json.dumps(errors, allow_nan=False) if errors else ""
    stored = case + 1, key, status, COMPACT.encode(cells), errors, json.dumps(notes) if notes else ""
    return *stored, check_sum(*stored)


def check_sum(row, key, status, cells, errors, notes):
    """CRC-32 of a stored row."""
    return crc32(f"{row}\n{key}\n{status}\n{cells}\n{errors}\n{notes}".encode(errors="backslashreplace"))


def unpack(stored, headers):
    """The RowRecord of a stored row with cells of these headers; None if it is not as `pack` returned it."""
    row, key, status, cells, errors, notes, stored_sum = stored
    if check_sum(*stored[:-1]) != stored_sum:
        return None
    has_texts = not TEXTS.isdisjoint(headers)
    try:
        cells = (CELLS_AND_TEXTS if has_texts else CELLS).validate_json(cells)
        errors, notes = ERRORS.validate_json(errors or "{}"), NOTES.validate_json(notes or "[]")
    except ValueError:
        return None
    is_valid = type(row) is int and row >= 1 and isinstance(key, str) and isinstance(status, str | None)
    is_valid = is_valid and len(cells) == len(headers)
    if is_valid and has_texts:
        pairs = zip(headers, cells, strict=True)
        is_valid = all(cell is None or (name in TEXTS) == isinstance(cell, str) for name, cell in pairs)
    return RowRecord(row - 1, key, status, cells, errors, notes) if is_valid else None
