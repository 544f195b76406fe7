"""Comparison of a table with a stored one, row by row."""

import math
from dataclasses import dataclass
from decimal import Decimal

from cablestudy.errors import Mistakes, shorten
from cablestudy.scene.study import ALL_COLUMNS
from cablestudy.scene.units import to_si
from cablestudy.study.all_columns import find
from cablestudy.study.prepare import NEVER_COMPARED, compared, tolerances_of
from cablestudy.study.table import exact, number, stream_csv
from cablestudy.sweeps.run import NUMBER

RTOL = 1e-6
LONGEST_CELL = 200  # characters of a cell in a message
LAST_DIGIT_SHARE = Decimal("0.1")  # of a number in a status: the largest difference in its last digit


@dataclass(frozen=True)
class Difference:
    """A cell that differs from the stored table: row (from 1), column, both values as text."""

    row: int
    column: str
    stored: str
    computed: str

    def __str__(self):
        a, b = number(self.stored), number(self.computed)
        ratio = f", ratio {b / a:.9g}" if a and b is not None else ""
        stored, computed = (shorten(text, LONGEST_CELL) or "empty" for text in (self.stored, self.computed))
        return f"row {self.row}, {self.column}: stored {stored}, computed {computed}{ratio}"


@dataclass(frozen=True)
class Tolerance:
    """Relative difference up to which numbers agree: as usual, and of columns (by header) where it is another."""

    usual: float = RTOL
    columns: dict = None

    def of(self, name):
        """Tolerance of a column."""
        return (self.columns or {}).get(name, self.usual)


def read_tolerances(texts, study):
    """The tolerances of a study file, and of `--rtol` options: `1e-6` for all columns, `sag=1e-4` for one.

    Options take precedence.

    Raises
    ------
    SceneError
        Every option that is wrong.
    """
    given = {}
    with Mistakes() as mistakes:
        for text in texts:
            name, sign, written = text.rpartition("=")
            with mistakes.at(f"--rtol {text}"):
                header, value = compared(study, name.strip()) if sign else ALL_COLUMNS, _tolerance(written)
                if header in given:
                    raise ValueError(f"given twice{'' if sign else ' for all columns'}")
                given[header] = value
    columns = {**tolerances_of(study), **given}
    return Tolerance(columns.pop(ALL_COLUMNS, RTOL), columns)


def _tolerance(text):
    """The tolerance in an option."""
    try:
        value = to_si(text, "")
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise ValueError("expected a finite number, not negative, or column=number")
    return value


def compare(table, path, tolerance):
    """Compare a table with a stored CSV, cell by cell.

    Yields
    ------
    Difference or str
        Text for columns and rows that only one of them has.
    """
    names, stored = stream_csv(path)
    columns = _tolerance_columns(table.fields)
    yield from _other_columns(table, names, columns)
    never = find(NEVER_COMPARED).header
    cells = [(name, column) for name, column in columns.items() if name in names and name != never]
    count = 0
    for count, (row, (_, old_row)) in enumerate(zip(table.rows, stored, strict=False), 1):
        for name, column in cells:
            if not _agree(name, old_row[name], row.get(name), column, row.get(column), tolerance):
                yield Difference(count, name, old_row[name], exact(row.get(name)))
    count += sum(1 for _ in stored)
    if count != len(table.rows):
        yield f"{count} rows stored, {len(table.rows)} computed"


def _other_columns(table, names, columns):
    """Yield a line for each column that only the computed table has, or only the stored one, with its `names`."""
    before = {field.title: field.name for field in table.fields if field.distinct and field.title not in columns}
    renamed = [name for name in names if before.get(name) not in (None, *names)]  # by versions that wrote text
    for name in renamed:
        yield f"column {name}: stored as text by an earlier version, now {before[name]}: sweep it anew without --check"
    known = {*columns, *renamed}
    yield from (f"column {name}: stored, not computed" for name in names if name not in known)
    known = {*names, *(before[name] for name in renamed)}
    yield from (f"column {name}: computed, not stored" for name in columns if name not in known)


def _tolerance_columns(fields):
    """Field name -> the column whose tolerance holds: of a difference from a printed value, the column before it."""
    found, last = {}, None
    for field in fields:
        last = last if field.hidden or field.printed else field.name
        found[field.name] = last
    return found


def _agree(name, old, new, column, value, tolerance):
    """Whether a stored text and a computed cell agree, relative to the largest of both and of their column."""
    if name == "status":
        return _same_status(old, exact(new))
    if not isinstance(new, float) and old == exact(new):
        return True
    a, b = number(old), new if isinstance(new, float) else number(exact(new))
    if a is None or b is None:
        return False
    scale = abs(value or 0.0) if name != column else 0.0
    return a == b or abs(a - b) <= tolerance.of(column) * max(abs(a), abs(b), scale)


def _same_status(old, new):
    """Whether two statuses agree but for the last digit of numbers, in which processors differ."""
    if old == new:
        return True
    if NUMBER.sub("0", old) != NUMBER.sub("0", new):
        return False
    return all(map(_same_but_last_digit, NUMBER.findall(old), NUMBER.findall(new)))


def _same_but_last_digit(old, new):
    a, b = Decimal(old), Decimal(new)
    try:
        digit = max(Decimal(1).scaleb(number.as_tuple().exponent) for number in (a, b))
        return abs(a - b) <= min(digit, LAST_DIGIT_SHARE * max(abs(a), abs(b)))
    except ArithmeticError:  # beyond all numbers that this program writes
        return False
