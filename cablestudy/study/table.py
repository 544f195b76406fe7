"""Tables as Markdown, CSV, JSON and JSON lines; their files, written atomically; stored tables read."""

import csv
import glob
import json
import os
import re
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from cablestudy.errors import SceneError

DIGITS = 4
MOST_DIGITS = 17  # of a float
NO_TABLE = "not a table of comma-separated values"
MOST_ROWS = 1000  # of a table in Markdown


@dataclass(frozen=True)
class Field:
    """One column of a table."""

    name: str  # in CSV and JSON, unit included
    title: str  # in Markdown
    unit: str = ""
    beside: str = ""  # of a difference from a printed value: its field, shown in the same cell of Markdown
    hidden: bool = False  # whether Markdown leaves the column out
    distinct: bool = False  # whether Markdown gives numbers as many digits as tell them apart


def header(name, unit):
    """A name with its unit, as in CSV and JSON: `end_stiffness_N_per_m`."""
    if not unit:
        return name
    return f"{name}_{unit.replace('/', '_per_').replace('^', '').replace(' ', '').replace('%', 'percent')}"


@dataclass(frozen=True)
class Table:
    """Fields and rows."""

    fields: tuple  # of Field
    rows: list  # dicts of name -> number, text or None; if they have a method `csv_lines`, it writes the CSV
    single: bool = False  # one row by nature: Markdown then has one line for each quantity
    across: str = ""  # field whose values head the columns of Markdown, one for each row
    errors: Callable | None = None  # yields for each row, or for some, the relative errors of its cells, for JSON

    def render(self, style):
        """The table as one text; see `pieces`."""
        return "".join(self.pieces(style))

    def pieces(self, style):
        """Yield the table as text, row by row, with a final newline.

        Parameters
        ----------
        style : {"md", "csv", "json", "jsonl"}
            Markdown: four significant digits, first and last rows of a long table. CSV: all digits. JSON: one object
            with columns and units, rows, and the estimated errors of their cells where they are known. JSON lines: one
            object for each row.
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
            writer.writerow([row.get(name) for name in names])  # csv writes floats by repr, None as nothing
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
        shown = [field for field in self.fields if not field.hidden]
        if self.single:
            row = self.rows[0]
            known = [field for field in shown if row.get(field.name) is not None]
            body = [[field.title, short(row[field.name]), field.unit] for field in known]
            yield _tabulated(body, ["quantity", "value", "unit"], ("left", "right", "left"))
            return
        if self.across:
            yield self._side_by_side(shown)
            return
        total, half = len(self.rows), MOST_ROWS // 2
        left_out = max(0, total - MOST_ROWS)
        rows = [*self.rows[:half], *self.rows[-half:]] if left_out else list(self.rows)
        head = [f"{field.title} [{field.unit}]" if field.unit else field.title for field in shown]
        body = _body(shown, rows)
        if left_out:
            body.insert(half, ["…"] * len(shown))
        yield _tabulated(body, head, [_side(field.name, rows) for field in shown])
        if left_out:
            yield f"\n{left_out} of {total} rows are left out here, from {half + 1} to {total - half}"
            yield "; csv, json and jsonl have them all.\n"

    def _side_by_side(self, shown):
        """Markdown with one line for each quantity and one column for each row."""
        rows, left = list(self.rows), [field for field in shown if field.name != self.across]
        known = [field for field in left if any(row.get(field.name) is not None for row in rows)]
        cells = zip(*_body(known, rows), strict=True)
        body = [[field.title, *texts, field.unit] for field, texts in zip(known, cells, strict=True)]
        heads = [str(row[self.across]) for row in rows]
        return _tabulated(body, ["quantity", *heads, "unit"], ("left", *["right"] * len(rows), "left"))


def _tabulated(body, head, sides):
    """Cells as a table of Markdown."""
    from tabulate import tabulate

    return tabulate(body, head, "pipe", disable_numparse=True, colalign=sides if body else None) + "\n"


def _side(name, rows):
    """On which side the cells of a column stand: numbers on the right."""
    return "left" if any(isinstance(row.get(name), str) for row in rows) else "right"


def _body(fields, rows):
    """The cells of Markdown, row by row."""
    digits = [_digits([row.get(field.name) for row in rows]) if field.distinct else DIGITS for field in fields]
    return [[_cell(field, row, count) for field, count in zip(fields, digits, strict=True)] for row in rows]


def _digits(values):
    """The fewest significant digits, DIGITS or more, with which different numbers are different texts."""
    numbers = {value for value in values if isinstance(value, float)}
    counts = range(DIGITS, MOST_DIGITS)
    return next((count for count in counts if len({short(n, count) for n in numbers}) == len(numbers)), MOST_DIGITS)


def _cell(field, row, digits):
    """A cell of Markdown; of a difference from a printed value, both."""
    if not field.beside:
        return short(row.get(field.name), digits).replace("|", "\\|")
    printed, difference = row.get(field.beside), row.get(field.name)
    if printed is None:
        return ""
    return f"{printed:.12g}" if difference is None else f"{printed:.12g} ({signed(difference)})"


class _Line:
    """File for csv.writer that keeps the last line written."""

    def write(self, text):
        self.text = text


def _indented(value, depth):
    """JSON with indented lines."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=1).replace("\n", "\n" + " " * depth)


def exact(value):
    """A cell as csv writes it: the shortest text that reads back as the same number."""
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def short(value, digits=DIGITS):
    """A cell of Markdown: significant digits, without an exponent from 1e-4 to 1e8."""
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if value == 0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e8:
        text = f"{float(text):.0f}" if abs(value) >= 1 else f"{float(text):f}"
    return text


def signed(value):
    """A difference with its sign, two significant digits."""
    if value == 0:
        return "0"
    text = f"{value:+.2g}"
    return f"{float(text):+.0f}" if "e" in text and 1 <= abs(value) < 1e6 else text


def write_whole(path, text):
    """Write a file atomically: a reader finds the old file or the complete new one.

    `text` is a str, bytes, or an iterable of str, written piece by piece; SceneError where the file cannot be written.
    """
    pieces = [text] if isinstance(text, str | bytes) else text
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", prefix=leftovers(path))
        with os.fdopen(handle, "wb", buffering=1 << 20) as file:
            for piece in pieces:  # a file name in it may be no valid text
                file.write(piece if isinstance(piece, bytes) else piece.encode(errors="backslashreplace"))
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)  # the permissions of an ordinary file
        os.replace(temporary, path)
    except OSError as error:
        raise SceneError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)


def leftovers(path):
    """Prefix of the temporary files of `write_whole`, in the folder of the file."""
    return f".{os.path.basename(path)}-"


class TableFiles:
    """Paths of the files of a study in a folder: `csv` and `md` its table, `run` the provenance, `rows` as computed."""

    def __init__(self, folder, study):
        stem = os.path.splitext(os.path.basename(study))[0]
        self.folder = folder
        self.stem = "stdin" if study == "<stdin>" else stem
        self.csv, self.md, self.run, self.rows = (
            os.path.join(folder, self.stem + end) for end in (".csv", ".md", ".run.yaml", ".rows.sqlite")
        )

    def shard(self, number, count):
        """The rows of one shard, numbered from 1."""
        return os.path.join(self.folder, f"{self.stem}.shard-{number}-of-{count}.sqlite")

    def shards(self):
        """The shards that are there: (number, count) -> path."""
        pattern = re.compile(re.escape(self.stem) + r"\.shard-(\d+)-of-(\d+)\.sqlite")
        paths = glob.glob(os.path.join(glob.escape(self.folder), glob.escape(self.stem) + ".shard-*.sqlite"))
        found = [(pattern.fullmatch(os.path.basename(path)), path) for path in paths]
        return dict(sorted(((int(match[1]), int(match[2])), path) for match, path in found if match))

    def check_writable(self):
        """Raise SceneError unless the folder is there or can be made, and the files be written; make nothing yet."""
        there = os.path.abspath(self.folder)
        while not os.path.lexists(there):
            there = os.path.dirname(there)
        if not os.path.isdir(there):
            raise SceneError(f"--out {self.folder}: {os.path.relpath(there)} is a file, not a folder")
        if not os.access(there, os.W_OK | os.X_OK):
            raise SceneError(f"--out {self.folder}: cannot be written to")
        folders = [path for path in (self.csv, self.md, self.run, self.rows) if os.path.isdir(path)]
        if folders:
            raise SceneError(*(f"{path}: cannot be written (a folder is there)" for path in folders))

    def check_stored(self):
        """Raise SceneError when there is no stored table to compare with."""
        if not os.path.isfile(self.csv):
            raise SceneError(f"{self.csv}: no such file to compare with (run the sweep without --check first)")

    def write_texts(self, csv, markdown):
        """Write both files, each whole or not at all; make the folder if need be."""
        self.make()
        write_whole(self.csv, csv)
        write_whole(self.md, markdown)

    def make(self):
        """Make the folder if need be."""
        try:
            os.makedirs(self.folder, exist_ok=True)
        except OSError as error:
            raise SceneError(f"--out {self.folder}: cannot be made ({error.strerror})") from None

    def clear(self):
        """Remove what a run that was killed while it wrote a table left; the rows must be locked."""
        for path in (self.csv, self.md, self.run):
            for left in glob.glob(os.path.join(glob.escape(self.folder), glob.escape(leftovers(path)) + "*")):
                with suppress(OSError):
                    os.unlink(left)

    def write(self, study, table, provenance):
        """Write the table and its provenance, each file whole or not at all."""
        self.write_texts(table.pieces("csv"), f"# {study.title or self.stem}\n\n{table.render('md')}")
        write_whole(self.run, provenance)


def read_csv(path):
    """Names and rows of a stored table, each row a dict of name -> text; lines that begin with # are comments.

    SceneError for a file that is missing, empty, or no table.
    """
    names, rows = stream_csv(path)
    return names, list(rows)


def stream_csv(path):
    """As `read_csv`, with an iterator of rows."""
    lines = _cells(path)
    names = [name.strip() for name in next(lines, ())]
    if not names:
        raise SceneError(f"{path}: {NO_TABLE} (it is empty)")
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise SceneError(*(f"{path}: column {name!r} is there twice" for name in twice))
    return names, _rows(path, names, lines)


def _cells(path):
    """Yield the cells of each line that is neither empty nor a comment."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            yield from csv.reader((line for line in file if line.strip() and not line.startswith("#")), strict=True)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (csv.Error, UnicodeError) as error:
        raise SceneError(f"{path}: {NO_TABLE} ({error})") from None


def _rows(path, names, lines):
    """Yield rows as dicts; raise SceneError at the end for those with a wrong number of cells."""
    wrong = []
    for place, row in enumerate(lines, 1):
        if len(row) != len(names):
            wrong.append(f"{path}: row {place} has {len(row)} cells, and the table {len(names)} columns")
        elif not wrong:
            yield dict(zip(names, row, strict=True))
    if wrong:
        raise SceneError(*wrong)


def number(text):
    """The number in a cell, or None."""
    try:
        return float(text)
    except ValueError:
        return None
