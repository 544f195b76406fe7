"""The table of a study as it is stored, read again without computing anything."""

import os
import re
import sqlite3
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass

from cablestudy.errors import SceneError, shorten
from cablestudy.scene.words import counted, first_of
from cablestudy.study.cable_columns import TEXTS
from cablestudy.study.prepare import fields_of, prepare
from cablestudy.study.table import Table, exact, number, stream_csv
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.database import AT_WORK, Database
from cablestudy.sweeps.fingerprint import differences, edited_parts, identity, is_identity
from cablestudy.sweeps.record import EXACT
from cablestudy.sweeps.rows import more_fields, table_of, varied_cells
from cablestudy.sweeps.store import COMPLETE, RowStore, rows_done, stored_description
from cablestudy.sweeps.tolerances import SWEEPS

WHILE_AT_WORK = "nothing to show before it ends; Ctrl-C ends it too, and keeps the rows that are done"
WHOLE = re.compile("-?[0-9]+")


@dataclass(frozen=True)
class Stored:
    """Stored results of a study."""

    table: Table
    path: str  # of the file that it is from
    notes: tuple  # lines about the versions that it was computed with, and its gaps
    complete: bool  # True if all rows are there


class PlainRows(list):
    """Rows in memory, with a frame as `rows.Rows` has one; `names` are those of their cells."""

    def __init__(self, rows, names):
        super().__init__(rows)
        self.names = names

    def frame(self):
        """The rows as a pandas.DataFrame: numbers as floats, other values as text."""
        import pandas

        columns = {name: [row.get(name) for row in self] for name in self.names}
        texts = {name for name, cells in columns.items() if any(isinstance(cell, str) for cell in cells)}
        return pandas.DataFrame(
            {name: pandas.Series(cells, dtype=object if name in texts else float) for name, cells in columns.items()}
        )


@contextmanager
def stored_table(study, files, again):
    """Open the stored results of a study without computing anything, for a `with` block: yields `Stored`.

    The results are those in the database of rows if it is complete; else those in the CSV file; else the rows that the
    database has so far. `files` are the `TableFiles` of the study; `again` is the command that computes it, for hints.
    SceneError if nothing is stored, or what is stored does not belong to the study as it is now.
    """
    columns, reference = prepare(study)
    fields, current = fields_of(study, columns, reference[0]), identity(study, columns)
    problems = []
    with ExitStack() as opened:
        store, notes = _open_rows(study, files.rows, current, problems)
        if store:
            opened.enter_context(closing(store))
        cases, done = range(study.count), store.how_many(range(study.count), COMPLETE) if store else 0
        table = table_of(study, columns, reference, store, cases) if store else None
        if done == study.count:
            yield Stored(table, files.rows, tuple(notes), True)
            return
        stored = _stored_csv(study, fields, files, current, problems)
        if stored is None and done:
            rows = PlainRows((table.rows[case] for case in store.select(cases, COMPLETE)), [f.name for f in fields])
            gaps = f"{files.rows}: {done} of {study.count} rows are done; to go on: {again} --resume"
            stored = Stored(Table(fields, rows, more=table.more), files.rows, (*notes, gaps), False)
        if stored is None:
            nothing = [] if problems else [f"{files.csv}: no such file, nor {files.rows}"]
            hint = f"nothing to show; to compute the study as it is now: {again}"
            raise SceneError(*nothing, *problems, WHILE_AT_WORK if f"{files.rows}: {AT_WORK}" in problems else hint)
        yield stored


def has_all_rows(path, current, count):
    """True if a file has all rows of a study as it is now, whose `fingerprint.identity` is `current`."""
    if not os.path.exists(path):
        return False
    try:
        with closing(Database(path)) as database:
            return rows_done(database, current) == count
    except SceneError:  # another program's file, or a sweep is at work on it
        return False


def _open_rows(study, path, current, problems):
    """`RowStore` of a study's rows, to be closed, and notes on their versions and on damage; None without such rows.

    Reasons why there are no rows of the study as it is now, whose identity is `current`, are appended to `problems`.
    """
    if not os.path.exists(path):
        return None, []
    store = None
    try:
        store = RowStore(path, current, study.count)
        description = stored_description(store.database)
        reasons = _why_other_study(description[0], current) if description else ["has no rows"]
        if not reasons:
            store.describe(*description)
            store.load_valid()
    except SceneError as error:
        reasons = [str(error).removeprefix(f"{path}: ")]
    except sqlite3.Error as error:
        reasons = [f"is damaged ({error})"]
    if reasons:
        if store:
            store.close()
        problems += [f"{path}: {line}" for line in reasons]
        return None, []
    return store, [*_other_versions(path, description[0], current), *store.warnings]


def _why_other_study(stored, current):
    """Lines why stored rows are of another study than the current one, a list; both are from `fingerprint.identity`."""
    return [*differences(stored, current, ["scene"]), *edited_parts(stored, current)]


def _other_versions(path, stored, current):
    """Lines on the versions with which rows were computed, where these differ from those that are here."""
    return [f"{path}: {line}" for line in differences(stored, current, ["versions"])]


def _stored_csv(study, fields, files, current, problems):
    """`Stored` of the CSV file of a study; None where it is not of the study as it is now, whose identity is `current`.

    Reasons why the file cannot be used are appended to `problems`.
    """
    if not os.path.isfile(files.csv):
        return None
    stored_names, stored_rows = stream_csv(files.csv)
    missing = [field.name for field in fields if field.name not in stored_names]
    recorded = _recorded_identity(files.run, current)
    reasons = _why_other_study(recorded, current) if recorded else []
    if missing and not reasons:
        listed = first_of(missing, SWEEPS.listed)
        reasons = [f"of the study before it was edited, or of an earlier version: no column {listed}"]
    if reasons:
        problems += [f"{files.csv}: {line}" for line in reasons]
        return None
    rows = PlainRows([], [field.name for field in fields])
    wrong_rows = _read_rows(study, files.csv, stored_rows, rows)
    if wrong_rows:
        problems += wrong_rows
        return None
    table = Table(fields, rows, more=more_fields(study, fields))
    notes = _other_versions(files.csv, recorded, current) if recorded else ()
    return Stored(table, files.csv, tuple(notes), True)


def _read_rows(study, path, stored_rows, rows):
    """Append the rows of a stored CSV file, from `stream_csv`, to `PlainRows`, with cells as numbers or text.

    Returns a list of reasons why they are not those of the study as it is now, at most `SWEEPS.listed`.
    """
    keys, count, lines = varied_keys(study), 0, []
    for count, (line, texts) in enumerate(stored_rows, 1):
        if count > study.count:
            continue
        cells_of_varied = varied_cells(keys, study.overrides(count - 1))
        for name, cell in cells_of_varied.items():
            if texts.get(name, exact(cell)) != exact(cell):
                difference = f"stored {shorten(texts[name], SWEEPS.cell_characters)}, now {exact(cell)}"
                return [f"{path}: row {count}, {name}: {difference}"]
        computed = [name for name in rows.names if name in texts and name not in cells_of_varied]
        row = {name: _cell(texts[name], name in TEXTS) for name in computed}
        for name in computed:
            if row[name] is None and texts[name]:
                cell = shorten(repr(texts[name]), SWEEPS.cell_characters)
                lines.append(f"{path}:{line}: row {count}, {name}: not a finite number: {cell}")
        rows.append({**row, **cells_of_varied})
    if count != study.count:
        lines.append(f"{path}: {counted(count, 'row')}, and the study has {counted(study.count, 'case')}")
    return lines[: SWEEPS.listed]


def _recorded_identity(path, current):
    """The identity of the study whose table was written, from NAME.run.yaml; None where it cannot be read.

    Its versions are those that `current`, of the study as it is now, has too.
    """
    import yaml

    try:
        with open(path, encoding="utf-8") as file:
            content = yaml.safe_load(file)
        versions = {name: content["versions"].get(name) for name in current["versions"]}
        recorded = {"versions": versions, **content["study"]}
        return recorded if is_identity(recorded) else None
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _cell(text, is_text):
    """A cell of a stored table: a number, text, or None where it is empty or no finite number."""
    if is_text or not text:
        return text or None
    value = number(text)
    is_integer = value is not None and abs(value) < EXACT and WHOLE.fullmatch(text)
    return int(text) if is_integer else value
