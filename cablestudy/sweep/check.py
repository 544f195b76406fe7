"""Comparison of a table with a stored one, row by row."""

import math
from dataclasses import dataclass
from itertools import zip_longest

from cablestudy.errors import SceneError
from cablestudy.study.columns import find
from cablestudy.study.table import exact, number, stream_csv

NEVER_EQUAL = "solve_time_ms"  # not compared: no two runs agree on it
RTOL = 1e-6


@dataclass(frozen=True)
class Difference:
    """A cell that differs from the stored table: row (from 1), column, both values."""

    row: int
    column: str
    stored: str
    computed: str

    def __str__(self):
        a, b = number(self.stored), number(self.computed)
        ratio = f", ratio {b / a:.9g}" if a and b is not None else ""
        stored, computed = self.stored or "empty", self.computed or "empty"
        return f"row {self.row}, {self.column}: stored {stored}, computed {computed}{ratio}"


@dataclass(frozen=True)
class Tolerance:
    """Relative difference of numbers that is let pass.

    Attributes
    ----------
    usual : float
    columns : dict
        Header -> its own.
    """

    usual: float = RTOL
    columns: dict = None

    def of(self, name):
        """That of a column."""
        return (self.columns or {}).get(name, self.usual)


def read_tolerances(texts, study):
    """The tolerances of `--rtol` options.

    Parameters
    ----------
    texts : sequence of str
        `1e-6` for all columns, `sag=1e-4` for one.
    study : Study
        With the columns that there are.

    Returns
    -------
    Tolerance

    Raises
    ------
    SceneError
        Every option that is wrong.
    """
    usual, columns, mistakes = [], {}, []
    known = set(study.columns)
    for text in texts:
        name, sign, written = text.rpartition("=")
        value = number(written)
        if value is None or not 0 <= value < math.inf:
            mistakes.append(f"--rtol {text}: expected a finite number, not negative, or column=number")
        elif not sign:
            usual.append(value)
        else:
            try:
                column = find(name.strip())
            except ValueError as error:
                mistakes.append(f"--rtol {text}: {error}")
                continue
            header = column.header
            if not known.intersection((column.name, header)):
                mistakes.append(f"--rtol {text}: {name} is not among the study's columns")
            elif columns.setdefault(header, value) != value:
                mistakes.append(f"--rtol {text}: given twice")
    if len(usual) > 1:
        mistakes.append("--rtol: given twice for all columns")
    if mistakes:
        raise SceneError(*mistakes)
    return Tolerance(*usual, columns=columns)


def compare(table, path, tolerance):
    """Cells in which a table differs from a stored CSV.

    Parameters
    ----------
    table : Table
    path : str
    tolerance : Tolerance

    Yields
    ------
    Difference or str
        Nothing when they agree; texts for columns or rows that only one of them has.
    """
    names, stored = stream_csv(path)
    wanted = [field.name for field in table.fields]
    yield from (f"column {name}: stored, not computed" for name in names if name not in wanted)
    yield from (f"column {name}: computed, not stored" for name in wanted if name not in names)
    common = [name for name in wanted if name in names and name != NEVER_EQUAL]
    count = 0
    for place, (old, row) in enumerate(zip_longest(stored, table.rows), 1):
        count += old is not None
        if old is None or row is None:
            continue
        for name in common:
            new = exact(row.get(name))
            if not _agree(old[name], new, tolerance.of(name)):
                yield Difference(place, name, old[name], new)
    if count != len(table.rows):
        yield f"{count} rows stored, {len(table.rows)} computed"


def _agree(old, new, rtol):
    if old == new:
        return True
    a, b = number(old), number(new)
    return a is not None and b is not None and abs(a - b) <= rtol * max(abs(a), abs(b))
