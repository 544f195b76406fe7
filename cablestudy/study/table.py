"""Tables: shown as Markdown, CSV, JSON or JSON lines, written to files atomically, and read from stored files."""

import csv
import glob
import io
import json
import os
import re
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from itertools import chain, islice
from math import isfinite

from cablestudy.errors import SceneError
from cablestudy.scene.document import STREAMS
from cablestudy.study.markdown import short as short
from cablestudy.study.markdown import signed as signed
from cablestudy.study.markdown import whole
from cablestudy.study.tolerances import STUDY

REMOVED = str.maketrans("", "", "^ ")  # of a unit in a name
NO_TABLE = "not a table of comma-separated values"


@dataclass(frozen=True)
class Field:
    """One column of a table."""

    name: str  # in CSV and JSON, unit included
    title: str  # in Markdown
    unit: str = ""
    printed: str = ""  # of a difference from a printed value: its field, shown in the same cell of Markdown
    hidden: bool = False  # whether Markdown leaves the column out
    distinct: bool = False  # whether Markdown gives numbers as many digits as tell them apart
    label: bool = False  # whether it names the rows: shown, in front, though columns are chosen without it
    text: bool = False  # whether some cells are text; of tables in memory they are looked at instead
    secondary: bool = False  # whether a terminal that is too narrow leaves the column out before others
    unless: str = ""  # a terminal leaves the column out if all its cells are this text
    varied: bool = False  # whether a study varies it: shown as a label, unless columns are chosen among those it varies
    kept: bool = False  # whether it is shown, behind all others, though columns are chosen without it

    @property
    def plain(self):
        """Its name without the unit."""
        return self.name.removesuffix(header("", self.unit))

    @property
    def shown_unit(self):
        """Its unit in tables and pictures for people: see `shown_unit`; printed values keep that of the program."""
        return self.unit if self.printed else shown_unit(self.unit)

    def shown(self, row):
        """Its cell in a row, in `shown_unit`."""
        value = row.get(self.name)
        return celsius(value) if self.shown_unit != self.unit and isinstance(value, float) else value


def header(name, unit):
    """A name with its unit, as in CSV and JSON: `end_stiffness_N_per_m`."""
    if not unit:
        return name
    words = unit.removeprefix("1").replace("/", "_per_").replace("%", "percent").translate(REMOVED)
    return f"{name}_{words.removeprefix('_')}"


def shown_unit(unit):
    """The unit that people read: degC for a temperature in K."""
    return "degC" if unit == "K" else unit


def celsius(kelvin):
    """A temperature in degC, without the rounding of the difference."""
    return float(f"{kelvin - 273.15:.12g}")


@dataclass(frozen=True)
class Table:
    """Table of results: its columns (`Field`) and rows, shown as Markdown or written as CSV or JSON."""

    fields: tuple  # of Field
    rows: list  # dicts of name -> number, text or None; if they have a method `csv_lines`, it writes the CSV
    single: bool = False  # one row by nature: Markdown then has one line for each quantity
    across: str = ""  # field whose values head the columns of Markdown, one for each row
    more: tuple = ()  # fields of cells that rows have too, shown only where `chosen` names them
    errors: Callable | None = None  # yields for each row, or for some, the relative errors of its cells, for JSON
    digits: int = STUDY.table_digits  # significant ones of a number in Markdown

    @classmethod
    def of(cls, fields, lines, **options):
        """The table of lines, each of which has its cells in the order of the fields."""
        names = [field.name for field in fields]
        return cls(tuple(fields), [dict(zip(names, line, strict=True)) for line in lines], **options)

    def chosen(self, names=(), top=None):
        """Table with only the columns that a user asks for, and only the first rows.

        Three kinds of columns are kept though they are not asked for. In front are those that name the rows
        (`Field.label`) and the keys that a study varies, unless a varied key is asked for. Columns marked `Field.kept`
        are at the end. Names are with or without units; none are all columns. SceneError for one that no column has.
        """
        if not names and top is None:
            return self
        named = {field.name: replace(field, hidden=False, unless="") for field in map(self.field, names)}
        labels = [field for field in self.fields if field.label and field.name not in named]
        kept_fields = [field for field in self.fields if field.kept and field.name not in named]
        fields = (*labels, *self._varied(named.values()), *named.values(), *kept_fields) if named else self.fields
        shown_names = {field.name for field in fields}

        def errors():
            for row in islice(self.errors(), top):
                yield {name: error for name, error in row.items() if name in shown_names}

        return replace(self, fields=fields, rows=self.rows[:top], errors=self.errors and errors)

    def _varied(self, named_fields):
        """The varied fields shown besides the named ones: none if one of these varies, nor keys of equal name."""
        varied = [field for field in (*self.fields, *self.more) if field.varied]
        plain = {field.plain for field in named_fields}
        if any(field.varied for field in named_fields):
            return []
        return [field for field in varied if field.plain.rpartition(".")[2] not in plain]

    def field(self, name):
        """The field of a name, with its unit or without; SceneError where there is none."""
        field = next((field for field in (*self.fields, *self.more) if name in (field.name, field.plain)), None)
        if field:
            return field
        names = {name: field.plain for field in self.fields for name in (field.name, field.plain)}
        similar = get_close_matches(name.lower(), names, 1)
        hint = f"did you mean {names[similar[0]]}?" if similar else f"it has {', '.join(dict.fromkeys(names.values()))}"
        raise SceneError(f"--columns: the table has no column {name!r} ({hint})")

    def render(self, style):
        """The table as one text; see `pieces`."""
        return "".join(self.pieces(style))

    def pieces(self, style):
        """Yield the table as text, row by row, with a final newline.

        "md": `digits` significant digits, first and last rows of a long table. "csv": all digits. "json": one object
        with columns and units, rows, and the estimated errors of their cells where they are known. "jsonl": one object
        for each row.
        """
        return {"md": partial(whole, self), "csv": self._csv, "json": self._json, "jsonl": self._jsonl}[style]()

    def _csv(self):
        """Yield the lines of CSV."""
        names = [field.name for field in self.fields]
        yield csv_line(names)
        lines = self.rows.csv_lines(names) if hasattr(self.rows, "csv_lines") else None
        yield from lines or (csv_line([row.get(name) for name in names]) for row in self.rows)

    def _json(self):
        """Yield the pieces of one JSON object, row by row."""
        units = {field.name: field.unit for field in self.fields}
        yield '{\n "columns": ' + _indented(units, 1)
        lists = {"rows": self._plain_rows()} | ({} if self.errors is None else {"errors": self.errors()})
        for name, rows in lists.items():
            yield f',\n "{name}": ['
            separator = "\n  "
            for row in rows:
                yield separator + _indented(row, 2)
                separator = ",\n  "
            yield "]" if separator == "\n  " else "\n ]"
        yield "\n}\n"

    def _jsonl(self):
        for row in self._plain_rows():
            yield json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n"

    def _plain_rows(self):
        for row in self.rows:
            yield {field.name: row.get(field.name) for field in self.fields}


def csv_line(cells):
    """One line of a CSV, with its end: floats by `repr`, nothing for None."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def _indented(value, depth):
    """JSON with indented lines."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, indent=1).replace("\n", "\n" + " " * depth)


def exact(value):
    """A cell as csv writes it: the shortest text that reads back as the same number."""
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def write_whole(path, text):
    """Write a file atomically: a reader finds the old file or the complete new one.

    Devices, pipes and the file behind /dev/stdout, which a shell may have opened to append to it (>>), are written into
    instead. A symbolic link stays; the file that it names is replaced. The text is str, bytes, or an iterable of str.
    SceneError where the file cannot be written.
    """
    target = os.path.realpath(path) if os.path.isfile(path) else path
    replaced, temporary = os.path.isfile(target) and os.path.dirname(path) not in STREAMS, None
    try:
        if os.path.exists(target) and not (replaced or os.path.isdir(target)):
            with open(target, "ab") as stream:
                _write(stream, text)
            return
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(target) or ".", prefix=leftovers(target))
        with os.fdopen(handle, "wb", buffering=1 << 20) as file:
            _write(file, text)
        mask = os.umask(0)  # the umask can only be read by setting another one
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)  # the permissions of an ordinary file
        os.replace(temporary, target)
    except OSError as error:
        raise SceneError(f"{path}: cannot be written ({error.strerror or error})") from None
    finally:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)


def _write(file, text):
    """Write a str, bytes, or an iterable of str to an open file; a file name in it may be no valid text."""
    for piece in [text] if isinstance(text, str | bytes) else text:
        file.write(piece if isinstance(piece, bytes) else piece.encode(errors="backslashreplace"))


def leftovers(path):
    """Prefix of the temporary files of `write_whole`, in the folder of the file."""
    return f".{os.path.basename(path)}-"


class TableFiles:
    """Paths of the files of a study in a folder: `csv` and `md` its table, `run` the provenance, `rows` as computed."""

    def __init__(self, folder, study):
        self.folder = folder
        self.stem = study.strip("<>") if study[0] == "<" else os.path.splitext(os.path.basename(study))[0]
        self.csv, self.md, self.run, self.rows = (
            os.path.join(folder, self.stem + end) for end in (".csv", ".md", ".run.yaml", ".rows.sqlite")
        )

    def shard(self, number, count):
        """The rows of one shard, numbered from 1."""
        return os.path.join(self.folder, f"{self.stem}.shard-{number}-of-{count}.sqlite")

    def shards(self):
        """The existing shards: (number, count) -> path."""
        pattern = re.compile(re.escape(self.stem) + r"\.shard-(\d+)-of-(\d+)\.sqlite")
        paths = glob.glob(os.path.join(glob.escape(self.folder), glob.escape(self.stem) + ".shard-*.sqlite"))
        matches = [(pattern.fullmatch(os.path.basename(path)), path) for path in paths]
        return dict(sorted(((int(match[1]), int(match[2])), path) for match, path in matches if match))

    def check_writable(self):
        """Raise SceneError unless the folder exists or can be made and the files can be written; change nothing."""
        folder = os.path.abspath(self.folder)
        while not os.path.lexists(folder):
            folder = os.path.dirname(folder)
        if not os.path.isdir(folder):
            raise SceneError(f"--out {self.folder}: {os.path.relpath(folder)} is a file, not a folder")
        if not os.access(folder, os.W_OK | os.X_OK):
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
        """Remove temporary files of a run that was killed while it wrote a table; the rows must be locked."""
        for path in (self.csv, self.md, self.run):
            for temporary in glob.glob(os.path.join(glob.escape(self.folder), glob.escape(leftovers(path)) + "*")):
                with suppress(OSError):
                    os.unlink(temporary)

    def write(self, study, table, provenance):
        """Write the table and its provenance, each file whole or not at all."""
        self.write_texts(table.pieces("csv"), f"# {study.title or self.stem}\n\n{table.render('md')}")
        write_whole(self.run, provenance)


def stream_csv(path):
    """Names of a stored table, and an iterator of its rows: number of the line, and a dict of name -> text.

    Lines that begin with # are comments. SceneError for a file that is missing, empty, or no table.
    """
    lines = _cells(path)
    names = [name.strip() for name in next(lines, (1, ()))[1]]
    if not names:
        raise SceneError(f"{path}: {NO_TABLE} (it is empty)")
    repeated = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if repeated:
        raise SceneError(*(f"{path}: column {name!r} is there twice" for name in repeated))
    return names, _rows(path, names, lines)


def _cells(path):
    """Yield the number of each line that is neither empty nor a comment, and its cells."""
    line_number = 0

    def lines(file):
        nonlocal line_number
        for line in file:
            line_number += 1
            if line.strip() and not line.startswith("#"):
                yield line

    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            for cells in csv.reader(lines(file), strict=True):
                yield line_number, cells
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (csv.Error, UnicodeError) as error:
        raise SceneError(f"{path}: {NO_TABLE} ({error})") from None


def _rows(path, names, lines):
    """Yield line and row, a dict; raise SceneError at the end for those with a wrong number of cells."""
    mistakes = []
    for row_number, (line, row) in enumerate(lines, 1):
        if len(row) != len(names):
            mistakes.append(f"{path}:{line}: row {row_number} has {len(row)} cells, and the table {len(names)} columns")
        elif not mistakes:
            yield line, dict(zip(names, row, strict=True))
    if mistakes:
        raise SceneError(*mistakes)


def number(text):
    """The finite number in a cell, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None


def join_tables(answers):
    """Tables of several load cases, name of a case -> name of a table -> Table, joined: name -> Table."""
    by_name = {}
    for case, tables in answers.items():
        for name, table in tables.items():
            by_name.setdefault(name, {})[case] = table
    return {name: _joined_table(tables) for name, tables in by_name.items()}


def _joined_table(tables):
    """Join the tables of several load cases, name of a case -> Table, below each other, the case as first column.

    If each of the tables has one row by nature (`single`), the rows are shown side by side in Markdown.
    """
    fields = dict.fromkeys(field for table in tables.values() for field in table.fields)
    fields = (Field("case", "case", label=True), *sorted(fields, key=lambda field: field.name == "status"))
    rows = [{"case": name, **row} for name, table in tables.items() for row in table.rows]

    def errors():
        return chain.from_iterable(
            table.errors() if table.errors else ({},) * len(table.rows) for table in tables.values()
        )

    single = all(table.single for table in tables.values())
    return Table(fields, rows, errors=errors, across="case" if single else "")
