"""The table of a study as it is stored, read again without computing anything."""

import os
import re
import sqlite3
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass

from cablestudy.errors import SceneError, shorten
from cablestudy.scene.words import counted, first_of
from cablestudy.study.columns import TEXTS
from cablestudy.study.prepare import fields_of, prepare
from cablestudy.study.table import Table, exact, number, stream_csv
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.check import LONGEST_CELL
from cablestudy.sweeps.database import AT_WORK, Database
from cablestudy.sweeps.fingerprint import differences, identity
from cablestudy.sweeps.record import EXACT
from cablestudy.sweeps.rows import more_fields, table_of, varied_cells
from cablestudy.sweeps.store import COMPLETE, RowStore, rows_done, stored_description

PARTS = {"vary": "what varies", "find": "what is solved for", "columns": "the columns"}
WHILE_AT_WORK = "nothing to show before it ends; Ctrl-C ends it too, and keeps the rows that are done"
SHOWN = 5  # columns that are named in a message, and mistakes that are listed
WHOLE = re.compile("-?[0-9]+")


@dataclass(frozen=True)
class Stored:
    """Rows that are stored of a study."""

    table: Table
    path: str  # of the file that it is from
    notes: tuple  # lines about its age and its gaps
    complete: bool


class PlainRows(list):
    """Rows in memory, with a frame as `rows.Rows` has one; `names` are those of their cells."""

    def __init__(self, rows, names):
        super().__init__(rows)
        self.names = names

    def frame(self):
        """The rows as a pandas.DataFrame: numbers as floats, other values as text."""
        import pandas

        columns = {name: [row.get(name) for row in self] for name in self.names}
        text = {name for name, cells in columns.items() if any(isinstance(cell, str) for cell in cells)}
        return pandas.DataFrame(
            {name: pandas.Series(cells, dtype=object if name in text else float) for name, cells in columns.items()}
        )


@contextmanager
def stored_table(study, files, again):
    """Table from what is stored of a study: all its rows as computed, else its CSV, else the rows that are done.

    Parameters
    ----------
    study : StudyFile
    files : TableFiles
    again : str
        The command that computes the study, for hints.

    Yields
    ------
    Stored

    Raises
    ------
    SceneError
        Nothing is stored, or what is stored does not belong to the study as it is now.
    """
    columns, reference = prepare(study)
    fields, current = fields_of(study, columns, reference[0]), identity(study, columns)
    problems = []
    with ExitStack() as opened:
        store, age = _open_rows(study, files.rows, current, problems)
        if store:
            opened.enter_context(closing(store))
        cases, done = range(study.count), store.how_many(range(study.count), COMPLETE) if store else 0
        whole = table_of(study, columns, reference, store, cases) if store else None
        if done == study.count:
            yield Stored(whole, files.rows, tuple(age), True)
            return
        found = _of_csv(study, fields, files, current, problems)
        if found is None and done:
            rows = PlainRows((whole.rows[case] for case in store.select(cases, COMPLETE)), [f.name for f in fields])
            gaps = f"{files.rows}: {done} of {study.count} rows are done; to go on: {again} --resume"
            found = Stored(Table(fields, rows, more=whole.more), files.rows, (*age, gaps), False)
        if found is None:
            nothing = [] if problems else [f"{files.csv}: no such file, nor {files.rows}"]
            hint = f"nothing to show; to compute the study as it is now: {again}"
            raise SceneError(*nothing, *problems, WHILE_AT_WORK if f"{files.rows}: {AT_WORK}" in problems else hint)
        yield found


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
    """The store of the rows that belong to a study, and notes on their age; None where there is none.

    Why not is added to `problems`.
    """
    if not os.path.exists(path):
        return None, []
    store = None
    try:
        store = RowStore(path, current, study.count)
        stored = stored_description(store.database)
        other = _other_study(stored[0], current) if stored else ["has no rows"]
        if not other:
            store.describe(*stored)
            store.load_valid()
    except SceneError as error:
        other = [str(error).removeprefix(f"{path}: ")]
    except sqlite3.Error as error:
        other = [f"is damaged ({error})"]
    if other:
        if store:
            store.close()
        problems += [f"{path}: {line}" for line in other]
        return None, []
    return store, [*_age(path, stored[0], current), *store.warnings]


def _other_study(stored, current):
    """Lines why what is stored belongs to another study than the current one; both are from `fingerprint.identity`."""
    lines = differences({**stored, "versions": {}}, {**current, "versions": {}})
    changed = [what for part, what in PARTS.items() if stored.get(part) != current.get(part)]
    return [*lines, *(f"of the study before it was edited: {what} changed" for what in changed)]


def _age(path, stored, current):
    """Lines on the versions with which rows were computed, where these differ from those that are here."""
    return [f"{path}: {line}" for line in differences({**stored, "scene": {}}, {**current, "scene": {}})]


def _of_csv(study, fields, files, current, problems):
    """The table of a study from its CSV; None, and why in `problems`, where there is none that belongs to it."""
    if not os.path.isfile(files.csv):
        return None
    names, stored = stream_csv(files.csv)
    missing = [field.name for field in fields if field.name not in names]
    recorded = _recorded(files.run, current)
    other = _other_study(recorded, current) if recorded else []
    if missing and not other:
        other = [f"of the study before it was edited, or of an earlier version: no column {first_of(missing, SHOWN)}"]
    problems += [f"{files.csv}: {line}" for line in other]
    rows = PlainRows([], [field.name for field in fields])
    if other or (wrong := _read_rows(study, files.csv, stored, rows)):
        problems += [] if other else wrong
        return None
    table = Table(fields, rows, more=more_fields(study, fields))
    return Stored(table, files.csv, tuple(_age(files.csv, recorded, current) if recorded else ()), True)


def _read_rows(study, path, stored, rows):
    """Add the rows of a stored table to `rows`; list of lines why they are not those of the study."""
    varied = {known.key: known for known in varied_keys(study)}
    count, wrong = 0, []
    for count, (line, texts) in enumerate(stored, 1):
        if count > study.count:
            continue
        cells = varied_cells(varied, study.overrides(count - 1))
        for name, cell in cells.items():
            if texts.get(name, exact(cell)) != exact(cell):
                now = f"stored {shorten(texts[name], LONGEST_CELL)}, now {exact(cell)}"
                return [f"{path}: row {count}, {name}: {now}"]
        row = {name: _cell(texts[name], name in TEXTS) for name in rows.names if name in texts and name not in cells}
        damaged = [name for name, cell in row.items() if cell is None and texts[name]]
        wrong += [
            f"{path}:{line}: row {count}, {name}: not a finite number: {shorten(repr(texts[name]), LONGEST_CELL)}"
            for name in damaged
        ]
        rows.append({**row, **cells})
    if count != study.count:
        wrong.append(f"{path}: {counted(count, 'row')}, and the study has {counted(study.count, 'case')}")
    return wrong[:SHOWN]


def _recorded(path, current):
    """The identity of the study whose table was written, from NAME.run.yaml; None where it cannot be read."""
    import yaml

    try:
        with open(path, encoding="utf-8") as file:
            content = yaml.safe_load(file)
        found = {"versions": {name: content["versions"].get(name) for name in current["versions"]}, **content["study"]}
        intact = [type(found[name]) for name in ("versions", "scene", "vary", "columns")] == [dict, dict, list, list]
        return found if intact else None
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _cell(text, is_text):
    """A cell of a stored table: a number, text, or None where it is empty or no finite number."""
    if is_text or not text:
        return text or None
    value = number(text)
    whole = value is not None and abs(value) < EXACT and WHOLE.fullmatch(text)
    return int(text) if whole else value
