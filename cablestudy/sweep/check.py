"""Comparison of a table with a stored one, row by row."""

import math
from dataclasses import dataclass
from decimal import Decimal
from itertools import zip_longest

from cablestudy.errors import SceneError
from cablestudy.scene.study import ALL_COLUMNS
from cablestudy.scene.units import to_si
from cablestudy.study.columns import find
from cablestudy.study.prepare import NEVER_COMPARED, compared, tolerances_of
from cablestudy.study.table import exact, number, stream_csv
from cablestudy.sweep.run import NUMBER

RTOL = 1e-6
TURNED = Decimal("0.1")  # of a number, at most, that its last digit may turn


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
    """The tolerances of a study file and of `--rtol` options, each of which replaces the same one of the file.

    Parameters
    ----------
    texts : sequence of str
        `1e-6` for all columns, `sag=1e-4` for one.
    study : Study

    Returns
    -------
    Tolerance

    Raises
    ------
    SceneError
        Every option that is wrong.
    """
    given, mistakes = {}, []
    for text in texts:
        name, sign, written = text.rpartition("=")
        try:
            header, value = compared(study, name.strip()) if sign else ALL_COLUMNS, _tolerance(written)
        except ValueError as error:
            mistakes.append(f"--rtol {text}: {error}")
            continue
        if header in given:
            mistakes.append(f"--rtol {text}: given twice{'' if sign else ' for all columns'}")
        given[header] = value
    if mistakes:
        raise SceneError(*mistakes)
    columns = {**tolerances_of(study), **given}
    return Tolerance(columns.pop(ALL_COLUMNS, RTOL), columns)


def _tolerance(text):
    """A number as a study file may have it."""
    try:
        value = to_si(text, "")
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise ValueError("expected a finite number, not negative, or column=number")
    return value


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
    common = [name for name in wanted if name in names and name != find(NEVER_COMPARED).header]
    owner = _owners(table.fields)
    count = 0
    for place, (old, row) in enumerate(zip_longest(stored, table.rows), 1):
        count += old is not None
        if old is None or row is None:
            continue
        for name in common:
            new, column = exact(row.get(name)), owner[name]
            scale = 0.0 if name == column else row.get(column) or 0.0
            if name == "status":
                same = _say_the_same(old[name], new)
            else:
                same = _agree(old[name], new, tolerance.of(column), scale)
            if not same:
                yield Difference(place, name, old[name], new)
    if count != len(table.rows):
        yield f"{count} rows stored, {len(table.rows)} computed"


def _owners(fields):
    """Name of each field -> its column: a difference from a printed value is as certain as what it is taken of."""
    found, last = {}, None
    for field in fields:
        last = last if field.hidden or field.beside else field.name
        found[field.name] = last
    return found


def _agree(old, new, rtol, scale):
    if old == new:
        return True
    a, b = number(old), number(new)
    return a is not None and b is not None and abs(a - b) <= rtol * max(abs(a), abs(b), abs(scale))


def _say_the_same(old, new):
    """Whether two statuses do: on another machine the last digit of a number in one may turn."""
    if NUMBER.sub("", old) != NUMBER.sub("", new):
        return False
    return all(map(_same_but_for_its_last_digit, NUMBER.findall(old), NUMBER.findall(new)))


def _same_but_for_its_last_digit(old, new):
    a, b = Decimal(old), Decimal(new)
    digit = max(Decimal(1).scaleb(number.as_tuple().exponent) for number in (a, b))
    return abs(a - b) <= min(digit, TURNED * max(abs(a), abs(b)))
