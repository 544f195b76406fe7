"""A study: vary -> cases -> rows -> table."""

import json
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from math import inf

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.study import CHECK_ALL
from cablestudy.study.columns import Column, find, lacks
from cablestudy.study.fingerprint import identity
from cablestudy.study.interrupt import Interrupts
from cablestudy.study.journal import Journal
from cablestudy.study.parallel import local
from cablestudy.study.supply import Supply
from cablestudy.study.table import Field, Table, number, read_csv

# columns that show what a key varies
SHOWN_BY = {
    "cable.area": ("area", "diameter"),
    "cable.diameter": ("diameter", "area"),
    "cable.unstretched_length": ("unstretched_length",),
    "cable.preload": ("preload",),
    "cable.sag": ("sag",),
    "cable.elastic_modulus": ("elastic_modulus",),
    "cable.density": ("density",),
    "cable.chord": ("chord",),
}
STATUS = Field("status", "status")


def columns_of(study):
    """The columns that a study names.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of Column

    Raises
    ------
    SceneError
        Unknown or repeated columns, or one that needs a key which the scene lacks.
    """
    columns, mistakes = [], []
    _, scene = study.case(0)
    for place, name in enumerate(study.columns):
        asked = place >= len(study.columns) - len(study.asked)
        about = study.where(("columns", place)), "" if asked else f"columns.{place}"
        try:
            column = find(name)
        except ValueError as error:
            mistakes.append(Mistake(*about, str(error)))
            continue
        if any(column.header == other.header for other in columns):
            mistakes.append(Mistake(*about, f"{column.name} is listed twice"))
        elif lacks(scene, column) and _every_case_lacks(study, column):
            message = f"{column.name} needs the key {lacks(scene, column)}, which the scene does not have"
            mistakes.append(Mistake(*about, message))
        columns.append(column)
    if mistakes:
        raise SceneError(*mistakes)
    return columns


def _every_case_lacks(study, column):
    return all(lacks(study.case(index)[1], column) for index in range(min(study.count, CHECK_ALL)))


def reference_of(study, columns):
    """The printed values of a study, row by row.

    Parameters
    ----------
    study : Study
    columns : list of Column

    Returns
    -------
    names : list of str
        Headers of the columns that have printed values.
    rows : list of dict
        Header -> number or None.

    Raises
    ------
    SceneError
        The table does not fit the study.
    """
    if study.reference_path is None:
        return [], []
    names, rows = read_csv(study.reference_path)
    where = study.where(("reference",))
    headers = {column.header for column in columns}
    mistakes = [
        Mistake(where, "reference", f"{study.reference_path}: column {name!r} is not among the study's columns")
        for name in names
        if name not in headers
    ]
    if len(rows) != study.count:
        message = f"{study.reference_path}: {len(rows)} rows, and the study has {study.count} cases"
        mistakes.append(Mistake(where, "reference", message))
    for place, row in enumerate(rows, 1):
        for name in names:
            parsed = number(row[name]) if row[name].strip() else 0.0
            if parsed is None or not abs(parsed) < inf:
                message = f"{study.reference_path}: row {place}, {name}: not a number: {row[name]!r}"
                mistakes.append(Mistake(where, "reference", message))
    if mistakes:
        raise SceneError(*mistakes)
    return names, [{name: number(row[name]) for name in names} for row in rows]


def prepare(study):
    """Everything that can be wrong with a study, found before anything is computed.

    Parameters
    ----------
    study : Study

    Returns
    -------
    columns : list of Column
    reference : tuple
        As from `reference_of`.

    Raises
    ------
    SceneError
    """
    study.check()
    columns = columns_of(study)
    for name in (study.plot.x, *study.plot.y) if study.plot else ():
        try:
            header = find(name).header
        except ValueError as error:
            raise SceneError(Mistake(study.where(("plot",)), "plot", str(error))) from None
        if header not in {column.header for column in columns}:
            message = f"{name} is not among the study's columns"
            raise SceneError(Mistake(study.where(("plot",)), "plot", message))
    return columns, reference_of(study, columns)


def fill(study, columns, cases, journal, workers=local, tell=None, fail_fast=False, explain=False):
    """Compute the cases that a journal lacks.

    Parameters
    ----------
    study : Study
    columns : list of Column
    cases : range
        From 0.
    journal : Journal
    workers : callable
        Supply -> iterator of Done, in any order: `parallel.local`, `cluster.scheduled`.
    tell : callable, optional
        Is told after each chunk how many cases are done.
    fail_fast : bool
        Stop after the first chunk with a case that has no answer.
    explain : bool
        Keep the notes.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C or SIGTERM; what is done is in the journal.
    """
    known = sum(case in journal for case in cases)
    kinds = [(journal.missing(cases), [column.header for column in columns])]
    if journal.parts:
        there = journal.part_columns()
        kinds.append((journal.incomplete(cases), [c.header for c in columns if c.header not in there]))
    supply = Supply(study, kinds, len(cases) - known, explain)
    with Interrupts() as interrupts, closing(workers(supply)) as results:
        failed = journal.failed
        for done in results:
            with interrupts.sheltered():
                journal.append(done.lines)
            known += done.count
            if tell:
                tell(known)
            if fail_fast and journal.failed > failed:
                return


def run(study, jobs=1):
    """Compute a study; write nothing.

    Parameters
    ----------
    study : Study
    jobs : int or None
        Processes; None leaves it to the work. [-]

    Returns
    -------
    table : Table
    notes : list of tuple of str
        What was modelled, row by row.

    Raises
    ------
    SceneError
        Something is wrong with the study; nothing has been computed.
    """
    columns, reference = prepare(study)
    cases = range(study.count)
    journal = Journal.temporary(identity(study, columns), study.count)
    fill(study, columns, cases, journal, partial(local, jobs=jobs), explain=True)
    return table_of(study, columns, reference, journal, cases), [journal.notes(case) for case in cases]


class Rows(Sequence):
    """The rows of a table, read from the journal one by one and put into the order of the study.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        From `reference_of`.
    journal : Journal
        With every one of the cases.
    cases : range
        From 0.
    """

    def __init__(self, study, columns, reference, journal, cases):
        self._study, self._columns, self._reference = study, columns, reference
        self._journal, self._cases = journal, cases

    def __len__(self):
        return len(self._cases)

    def __getitem__(self, place):
        if isinstance(place, slice):
            return Rows(self._study, self._columns, self._reference, self._journal, self._cases[place])
        case = self._cases[place]
        cells = self._journal.cells(case)
        return {**written(self._study.overrides(case)), **cells, **_printed(cells, self._reference, case)}

    def errors(self, places=None):
        """Yield the estimated error of each cell that has one, of all rows or of some: header -> number."""
        for case in self._cases if places is None else (self._cases[place] for place in places):
            row = self._journal.row(case)
            known, cells = row.get("errors", {}), row["cells"]
            there = [c for c in self._columns if c.least_error is not None and cells[c.header] is not None]
            yield {} if known is None else {c.header: known.get(c.header, c.least_error) for c in there}


def table_of(study, columns, reference, journal, cases):
    """The table of cases that are in a journal.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        From `reference_of`.
    journal : Journal
    cases : range
        From 0.

    Returns
    -------
    Table
    """
    rows = Rows(study, columns, reference, journal, cases)
    return Table(_fields(study, columns, reference[0]), rows, errors=rows.errors)


def written(overrides):
    """What varies, as the user wrote it: numbers and text, and JSON of anything else.

    Parameters
    ----------
    overrides : dict
        As from `Study.overrides`.

    Returns
    -------
    dict
    """
    plain = {}
    for key, value in overrides.items():
        number_or_text = isinstance(value, (str, int, float)) and not isinstance(value, bool)
        plain[key] = value if number_or_text else json.dumps(value, ensure_ascii=False)
    return plain


def _printed(cells, reference, place):
    names, rows = reference
    added = {}
    for name in names:
        printed, computed = rows[place][name], cells[name]
        added[beside(name, "printed")] = printed
        known = printed is not None and computed is not None
        difference = computed - printed if known else None
        if known and abs(difference) < 1e-12 * abs(printed):
            difference = 0.0
        added[beside(name, "difference")] = difference
    return added


def beside(header, word):
    """`sag_m` -> `sag_printed_m`."""
    column = find(header)
    return f"{column.name}_{word}{column.header[len(column.name) :]}"


def _fields(study, columns, referenced):
    shown = {column.name for column in columns}
    fields = [Field(key, key) for key in study.varied if not shown.intersection(SHOWN_BY.get(key, ()))]
    for column in columns:
        if column.name == "status":
            continue
        fields.append(field_of(column))
        if column.header in referenced:
            printed, difference = beside(column.header, "printed"), beside(column.header, "difference")
            fields.append(Field(printed, "printed", column.unit, hidden=True))
            fields.append(Field(difference, "printed (Δ)", "", beside=printed))
    return (*fields, STATUS)


def field_of(column: Column):
    """A column as a field of a table."""
    return Field(column.header, column.name.replace("_", " "), column.unit)
