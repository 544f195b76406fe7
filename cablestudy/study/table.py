"""Rows -> Markdown, CSV, JSON and JSON lines; files written whole or not at all; stored tables read."""

import csv
import json
import os
import tempfile
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass

from cablestudy.errors import SceneError

DIGITS = 4
NO_TABLE = "not a table of comma-separated values"
MOST_ROWS = 1000  # of a table for people


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
    rows : sequence of dict
        Name -> number, text or None. With a method `csv_lines` it writes the CSV by itself; see `sweep.rows`.
    single : bool
        One row by nature: Markdown then lists quantities downwards.
    errors : callable or None
        Yields for each row the estimated relative errors of its cells, for JSON; of a table that a selection chooses
        from, given places, for those rows.
    """

    fields: tuple
    rows: list
    single: bool = False
    errors: Callable | None = None

    def render(self, style):
        """The table as one text; see `pieces`."""
        return "".join(self.pieces(style))

    def pieces(self, style):
        """Yield the table as text, row by row, with a final newline.

        Parameters
        ----------
        style : {"md", "csv", "json", "jsonl"}
            Four significant digits, and of a long table both ends; all digits, separated by commas; one object of
            columns with their units, rows, and the estimated errors of their cells where they are known; one object a
            line for each row.

        Yields
        ------
        str
        """
        return {"md": self._markdown, "csv": self._csv, "json": self._json, "jsonl": self._jsonl}[style]()

    def _csv(self):
        names = [field.name for field in self.fields]
        line = _Line()
        writer = csv.writer(line, lineterminator="\n")
        writer.writerow(names)
        yield line.text
        lines = self.rows.csv_lines(names) if hasattr(self.rows, "csv_lines") else None
        if lines is not None:
            yield from lines
            return
        for row in self.rows:
            writer.writerow([exact(row.get(name)) for name in names])
            yield line.text

    def _json(self):
        units = {field.name: field.unit for field in self.fields}
        yield '{\n "columns": ' + _indented(units, 1)
        lists = {"rows": self._plain_rows()} | ({} if self.errors is None else {"errors": self.errors()})
        for name, rows in lists.items():
            yield f',\n "{name}": ['
            before = "\n  "
            for row in rows:
                yield before + _indented(row, 2)
                before = ",\n  "
            yield "]" if before == "\n  " else "\n ]"
        yield "\n}\n"

    def _jsonl(self):
        for row in self._plain_rows():
            yield json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n"

    def _plain_rows(self):
        for row in self.rows:
            yield {field.name: row.get(field.name) for field in self.fields}

    def _markdown(self):
        from tabulate import tabulate

        shown = [field for field in self.fields if not field.hidden]
        if self.single:
            row = self.rows[0]
            known = [field for field in shown if row.get(field.name) is not None]
            body = [[field.title, short(row[field.name]), field.unit] for field in known]
            yield tabulate(body, ["quantity", "value", "unit"], "pipe", disable_numparse=True,
                           colalign=("left", "right", "left")) + "\n"  # fmt: skip
            return
        left_out = max(0, len(self.rows) - MOST_ROWS)
        rows = list(self.rows) if not left_out else [*self.rows[: MOST_ROWS // 2], *self.rows[-MOST_ROWS // 2 :]]
        head = [f"{field.title} [{field.unit}]" if field.unit else field.title for field in shown]
        body = [[self._cell(field, row) for field in shown] for row in rows]
        sides = ["left" if any(isinstance(row.get(field.name), str) for row in rows) else "right"
                 for field in shown]  # fmt: skip
        if left_out:
            body.insert(MOST_ROWS // 2, ["…"] * len(shown))
        yield tabulate(body, head, "pipe", disable_numparse=True, colalign=sides if rows else None) + "\n"
        if left_out:
            total = len(self.rows)
            yield f"\n{left_out} of {total} rows are left out here, from {MOST_ROWS // 2 + 1}"
            yield f" to {total - MOST_ROWS // 2}; csv, json and jsonl have them all.\n"

    @staticmethod
    def _cell(field, row):
        if not field.beside:
            return short(row.get(field.name)).replace("|", "\\|")
        printed, difference = row.get(field.beside), row.get(field.name)
        if printed is None:
            return ""
        return f"{printed:.12g}" if difference is None else f"{printed:.12g} ({signed(difference)})"


class _Line:
    """What csv writes to: keeps the last line."""

    def write(self, text):
        self.text = text


def _indented(value, depth):
    """JSON, its lines after the first indented deeper."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=1).replace("\n", "\n" + " " * depth)


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
    text : str, bytes or iterable of str
        Pieces are written as they come.

    Raises
    ------
    SceneError
        The folder cannot be written to.
    """
    folder = os.path.dirname(path) or "."
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=leftovers(path))
        with os.fdopen(handle, "wb", buffering=1 << 20) as file:
            if isinstance(text, bytes):
                file.write(text)
            else:
                pieces = [text] if isinstance(text, str) else text
                file.writelines(piece.encode(errors="backslashreplace") for piece in pieces)  # a name may be no text
        give_rights(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise SceneError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)


def give_rights(path):
    """Give a temporary file the rights that an ordinary one has."""
    mask = os.umask(0)
    os.umask(mask)
    os.chmod(path, 0o666 & ~mask)


def leftovers(path):
    """How the temporary files of a file begin, beside it."""
    return f".{os.path.basename(path)}-"


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
    names, rows = stream_csv(path)
    return names, list(rows)


def stream_csv(path):
    """As `read_csv`, the rows read one by one as they are asked for."""
    lines = _lines(path)
    try:
        reader = csv.reader(lines, strict=True)
        names = [name.strip() for name in next(reader)]
    except StopIteration:
        raise SceneError(f"{path}: {NO_TABLE} (it is empty)") from None
    except csv.Error as error:
        raise SceneError(f"{path}: {NO_TABLE} ({error})") from None
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        lines.close()
        raise SceneError(*(f"{path}: column {name!r} is there twice" for name in twice))
    return names, _rows(path, names, reader, lines)


def _lines(path):
    """Lines of a file that are neither empty nor comments."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            yield from (line for line in file if line.strip() and not line.startswith("#"))
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror or error})") from None
    except UnicodeError as error:
        raise SceneError(f"{path}: {NO_TABLE} ({error})") from None


def _rows(path, names, reader, lines):
    """Rows as dicts; all that have another number of cells are named at the end of the table."""
    wrong = []
    with closing(lines):
        try:
            for place, row in enumerate(reader, 1):
                if len(row) != len(names):
                    wrong.append(f"{path}: row {place} has {len(row)} cells, and the table {len(names)} columns")
                elif not wrong:
                    yield dict(zip(names, row, strict=True))
        except csv.Error as error:
            raise SceneError(f"{path}: {NO_TABLE} ({error})") from None
    if wrong:
        raise SceneError(*wrong)


def number(text):
    """The number of a cell, or None when it holds none."""
    try:
        return float(text)
    except ValueError:
        return None
