"""Rows -> Markdown, CSV, JSON and JSON lines; files written whole or not at all; comparison with a stored table."""

import csv
import json
import os
import tempfile
from dataclasses import dataclass

from cablestudy.errors import SceneError

DIGITS = 4
NEVER_EQUAL = "solve_time_ms"  # not compared: no two runs agree on it


@dataclass(frozen=True)
class Field:
    """One column as it is shown.

    Attributes
    ----------
    name : str
        In CSV and JSON, unit included.
    title : str
        In Markdown.
    unit : str
    beside : str
        In Markdown, name of the printed value's field that stands in this one's cell; empty for most.
    hidden : bool
        Not shown in Markdown as a column of its own.
    """

    name: str
    title: str
    unit: str = ""
    beside: str = ""
    hidden: bool = False


@dataclass(frozen=True)
class Table:
    """Fields and rows.

    Attributes
    ----------
    fields : tuple of Field
    rows : list of dict
        Name -> number, text or None. For all but Markdown any iterable.
    single : bool
        One row by nature: Markdown then lists quantities downwards.
    """

    fields: tuple
    rows: list
    single: bool = False

    def render(self, style):
        """The table as text, with a final newline.

        Parameters
        ----------
        style : {"md", "csv", "json", "jsonl"}

        Returns
        -------
        str
        """
        return "".join(self.pieces(style))

    def pieces(self, style):
        """The same text piece by piece; but for Markdown, no more than one row at once is in memory.

        Parameters
        ----------
        style : {"md", "csv", "json", "jsonl"}

        Yields
        ------
        str
        """
        if style == "md":
            yield self.markdown()
        elif style == "csv":
            yield from self._csv_lines()
        elif style == "jsonl":
            yield from (_json(row) + "\n" for row in self._plain_rows())
        else:
            yield '{\n "columns": ' + _json({field.name: field.unit for field in self.fields}, indent=1, margin=" ")
            between = ',\n "rows": ['
            for row in self._plain_rows():
                yield between + "\n  " + _json(row, indent=1, margin="  ")
                between = ","
            yield (between + "]" if between != "," else "\n ]") + "\n}\n"

    def csv(self):
        """Comma-separated, full precision."""
        return self.render("csv")

    def json(self):
        """One object: columns with their units, and rows."""
        return self.render("json")

    def jsonl(self):
        """One object a line for each row."""
        return self.render("jsonl")

    def _csv_lines(self):
        line = _Last()
        writer = csv.writer(line, lineterminator="\n")
        writer.writerow([field.name for field in self.fields])
        yield line.text
        for row in self.rows:
            writer.writerow([exact(row.get(field.name)) for field in self.fields])
            yield line.text

    def _plain_rows(self):
        return ({field.name: row.get(field.name) for field in self.fields} for row in self.rows)

    def markdown(self):
        """Four significant digits."""
        from tabulate import tabulate

        shown = [field for field in self.fields if not field.hidden]
        if self.single:
            row = self.rows[0]
            known = [field for field in shown if row.get(field.name) is not None]
            body = [[field.title, short(row[field.name]), field.unit] for field in known]
            return tabulate(body, ["quantity", "value", "unit"], "pipe", disable_numparse=True,
                            colalign=("left", "right", "left")) + "\n"  # fmt: skip
        head = [f"{field.title} [{field.unit}]" if field.unit else field.title for field in shown]
        body = [[self._cell(field, row) for field in shown] for row in self.rows]
        sides = ["left" if any(isinstance(row.get(field.name), str) for row in self.rows) else "right"
                 for field in shown]  # fmt: skip
        return tabulate(body, head, "pipe", disable_numparse=True, colalign=sides if self.rows else None) + "\n"

    @staticmethod
    def _cell(field, row):
        if not field.beside:
            return short(row.get(field.name)).replace("|", "\\|")
        printed, difference = row.get(field.beside), row.get(field.name)
        if printed is None:
            return ""
        return f"{printed:.12g}" if difference is None else f"{printed:.12g} ({signed(difference)})"


class _Last:
    """A file that keeps only what was written last."""

    def write(self, text):
        self.text = text


def _json(value, indent=None, margin=""):
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=indent)
    return text.replace("\n", "\n" + margin)


def exact(value):
    """Shortest text that reads back as the same number."""
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def short(value):
    """Four significant digits, without an exponent where that is readable."""
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if value == 0:
        return "0"
    text = f"{value:.{DIGITS}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e8:
        text = f"{float(text):.0f}" if abs(value) >= 1 else f"{float(text):f}"
    return text


def signed(value):
    """A difference, two significant digits."""
    if value == 0:
        return "0"
    text = f"{value:+.2g}"
    return f"{float(text):+.0f}" if "e" in text and 1 <= abs(value) < 1e6 else text


def write_whole(path, text):
    """Write a file completely or not at all.

    Parameters
    ----------
    path : str
    text : str or bytes

    Raises
    ------
    SceneError
        The folder cannot be written to.
    """
    data = text.encode() if isinstance(text, str) else text
    folder = os.path.dirname(path) or "."
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=".cablestudy-")
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
    except OSError as error:
        raise SceneError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)


def read_csv(path):
    """A stored table; lines that begin with # are comments.

    Parameters
    ----------
    path : str

    Returns
    -------
    names : list of str
    rows : list of dict
        Name -> text.

    Raises
    ------
    SceneError
        Missing, empty, or not a table.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = [line for line in file if line.strip() and not line.startswith("#")]
        names, *rows = csv.reader(lines, strict=True)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (ValueError, csv.Error) as error:
        reason = "it is empty" if not isinstance(error, (UnicodeError, csv.Error)) else error
        raise SceneError(f"{path}: not a table of comma-separated values ({reason})") from None
    names = [name.strip() for name in names]
    wrong = [f"column {name!r} is there twice" for name in dict.fromkeys(names) if names.count(name) > 1]
    wrong += [
        f"row {place} has {len(row)} cells, and the table {len(names)} columns"
        for place, row in enumerate(rows, 1)
        if len(row) != len(names)
    ]
    if wrong:
        raise SceneError(*(f"{path}: {reason}" for reason in wrong))
    return names, [dict(zip(names, row, strict=True)) for row in rows]


def number(text):
    """The number of a cell, or None when it holds none."""
    try:
        return float(text)
    except ValueError:
        return None


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


def compare(table, path, rtol):
    """Cells in which a table differs from a stored CSV.

    Parameters
    ----------
    table : Table
    path : str
    rtol : float
        Relative difference of numbers that is let pass.

    Returns
    -------
    list of Difference or str
        Empty when they agree; texts for columns or rows that only one of them has.
    """
    names, stored = read_csv(path)
    computed = [{field.name: exact(row.get(field.name)) for field in table.fields} for row in table.rows]
    wanted = [field.name for field in table.fields]
    found = [f"column {name}: stored, not computed" for name in names if name not in wanted]
    found += [f"column {name}: computed, not stored" for name in wanted if name not in names]
    if len(stored) != len(computed):
        found.append(f"{len(stored)} rows stored, {len(computed)} computed")
    for place, (old, new) in enumerate(zip(stored, computed, strict=False), 1):
        for name in wanted:
            if name in old and name != NEVER_EQUAL and not _agree(old[name], new[name], rtol):
                found.append(Difference(place, name, old[name], new[name]))
    return found


def _agree(old, new, rtol):
    if old == new:
        return True
    a, b = number(old), number(new)
    return a is not None and b is not None and abs(a - b) <= rtol * max(abs(a), abs(b))
