"""Comparison of a table with a stored one, row by row."""

import math
from dataclasses import dataclass
from decimal import Decimal

from cablestudy.errors import Mistakes, shorten
from cablestudy.scene.study import ALL_COLUMNS
from cablestudy.scene.units import si_or
from cablestudy.study.columns import find
from cablestudy.study.prepare import NEVER_COMPARED, header_of, tolerances_of
from cablestudy.study.table import exact, number, stream_csv
from cablestudy.sweeps.run import NUMBER
from cablestudy.sweeps.tolerances import SWEEPS

LAST_DIGIT_SHARE = Decimal("0.1")  # of a number in a status: the largest difference in its last digit


@dataclass(frozen=True)
class Difference:
    """A cell that differs from the stored table: row (from 1), column, both values as text."""

    row: int
    column: str
    stored: str
    computed: str

    def __str__(self):
        stored_number, computed_number = number(self.stored), number(self.computed)
        has_ratio = stored_number and computed_number is not None
        ratio = f", ratio {computed_number / stored_number:.9g}" if has_ratio else ""
        stored, computed = (shorten(text, SWEEPS.cell_characters) or "empty" for text in (self.stored, self.computed))
        return f"row {self.row}, {self.column}: stored {stored}, computed {computed}{ratio}"


def read_tolerances(texts, study):
    """Read the relative tolerances by which computed numbers are compared with stored ones.

    `texts` are the arguments of the option `--rtol`: `1e-6` for all columns, or `sag=1e-4` for one. They take
    precedence over the key `check` of the study file.

    Returns
    -------
    dict
        Header of a column, or ALL_COLUMNS -> tolerance. [-]
    """
    of_options = {}
    with Mistakes() as mistakes:
        for text in texts:
            name, sign, written = text.rpartition("=")
            with mistakes.at(f"--rtol {text}"):
                header, tolerance = header_of(study, name.strip()) if sign else ALL_COLUMNS, _read_tolerance(written)
                if header in of_options:
                    raise ValueError(f"given twice{'' if sign else ' for all columns'}")
                of_options[header] = tolerance
    return {**tolerances_of(study), **of_options}


def _read_tolerance(text):
    """The number in the text of a tolerance; ValueError where there is none."""
    value = si_or(math.nan, text, "")
    if not 0 <= value < math.inf:
        raise ValueError("expected a finite number, not negative, or column=number")
    return value


def compare_columns(table, path):
    """Yield a text for each column that only one of a table and a stored CSV file has; rows are not looked at."""
    names, (stored_names, _) = list(_tolerance_columns(table.fields)), stream_csv(path)
    new_name = {field.title: field.name for field in table.fields if field.distinct and field.title not in names}
    # names of columns that versions of the program wrote which wrote varied keys as text
    renamed = [name for name in stored_names if new_name.get(name) not in (None, *stored_names)]
    for name in renamed:
        now = new_name[name]
        yield f"column {name}: stored as text by an earlier version, now {now}: sweep it anew without --check"
    matched = {*names, *renamed}
    yield from (f"column {name}: stored, not computed" for name in stored_names if name not in matched)
    matched = {*stored_names, *(new_name[name] for name in renamed)}
    yield from (f"column {name}: computed, not stored" for name in names if name not in matched)


def compare(table, path, tolerances):
    """Compare a computed table with a stored CSV file, cell by cell, in the columns that both have.

    Numbers a and b agree if |a - b| <= tolerance max(|a|, |b|). Columns of differences from printed (published) values
    are compared relative to the computed value itself if that is larger. Other cells must be equal, except for the last
    digit of numbers in `status`. Computing times are not compared.

    `tolerances` are header of a column, or ALL_COLUMNS -> relative tolerance [-]; `SWEEPS.agreement` where neither is
    there. Yields a `Difference` for each cell that differs, and a text for rows that only one of the two tables has.
    """
    stored_names, stored_rows = stream_csv(path)
    tolerance_columns = _tolerance_columns(table.fields)  # name -> column whose tolerance holds for it
    never_compared = find(NEVER_COMPARED).header
    compared_names = [name for name in tolerance_columns if name in stored_names and name != never_compared]
    count = 0
    for count, (row, (_, stored)) in enumerate(zip(table.rows, stored_rows, strict=False), 1):
        for name in compared_names:
            if not _agree(name, stored[name], row, tolerance_columns[name], tolerances):
                yield Difference(count, name, stored[name], exact(row.get(name)))
    count += sum(1 for _ in stored_rows)
    if count != len(table.rows):
        yield f"{count} rows stored, {len(table.rows)} computed"


def _tolerance_columns(fields):
    """Field name -> the column whose tolerance holds: of a difference from a printed value, the column before it."""
    column_of, column = {}, None
    for field in fields:
        column = column if field.hidden or field.printed else field.name
        column_of[field.name] = column
    return column_of


def _agree(name, stored, row, column, tolerances):
    """True if the stored text of a cell, the field `name`, agrees with the computed row.

    The tolerance is that of a column, relative to the larger number; of a difference, also to the number in the column.
    """
    computed = row.get(name)
    if name == "status":
        return _same_status(stored, exact(computed))
    if not isinstance(computed, float) and stored == exact(computed):
        return True
    a, b = number(stored), computed if isinstance(computed, float) else number(exact(computed))
    if a is None or b is None:
        return False
    scale = abs(row.get(column) or 0.0) if name != column else 0.0
    tolerance = tolerances.get(column, tolerances.get(ALL_COLUMNS, SWEEPS.agreement))
    return a == b or abs(a - b) <= tolerance * max(abs(a), abs(b), scale)


def _same_status(stored, computed):
    """True if two statuses agree except for the last digit of numbers, in which processors differ."""
    if stored == computed:
        return True
    if NUMBER.sub("0", stored) != NUMBER.sub("0", computed):
        return False
    return all(map(_same_but_last_digit, NUMBER.findall(stored), NUMBER.findall(computed)))


def _same_but_last_digit(stored, computed):
    """True if two numbers as text differ by at most one in the last digit written."""
    a, b = Decimal(stored), Decimal(computed)
    try:
        last_digit = max(Decimal(1).scaleb(number.as_tuple().exponent) for number in (a, b))
        return abs(a - b) <= min(last_digit, LAST_DIGIT_SHARE * max(abs(a), abs(b)))
    except ArithmeticError:  # beyond all numbers that this program writes
        return False
