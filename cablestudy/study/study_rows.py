"""Rows of the cases of a study, of one cable or of a suspension."""

from dataclasses import replace

from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.closed_form import evaluate_table
from cablestudy.study.columns import ROUNDING
from cablestudy.study.notes import reference_without_loads
from cablestudy.study.one_cable_columns import column_of_one_cable
from cablestudy.study.row import evaluate_cases
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.notes import moved_note
from cablestudy.study.suspension.rows import evaluate_suspensions


def evaluate(scenes, columns, estimate=False):
    """Compute the columns of many scenes, all of one cable or all suspensions: list of Row, see `row.evaluate_cases`.

    Parameters
    ----------
    scenes : sequence of CableScene or SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to estimate the errors of fixed elements though they are no column, and to write notes.
    """
    if bool(scenes) and isinstance(scenes[0], SuspensionScene):
        return evaluate_suspensions(scenes, columns, estimate)
    bare = all(scene.gondola is None for scene in scenes)
    own = {column.header: column_of_one_cable(column, bare) for column in columns}
    rows = evaluate_cases(scenes, list({column.header: column for column in own.values()}.values()), estimate)
    if all(header == column.header for header, column in own.items()):
        return rows
    return [_renamed(row, own) for row in rows]


def _renamed(row, own):
    """A row of own columns with the headers that were asked for: `own` has the column of each."""
    cells = {header: row.cells[column.header] for header, column in own.items()}
    errors = {header: row.errors[column.header] for header, column in own.items() if column.header in row.errors}
    return replace(row, cells={**cells, "status": row.cells["status"]}, errors=errors)


def evaluate_tables(tables, columns, explain=False, estimate=False):
    """Compute the columns of many cases of a study: closed forms by arrays, everything else case by case.

    Parameters
    ----------
    tables : list of CaseTable
    columns : sequence of Column
    explain : bool
        Whether to return notes, and with them the errors of fixed elements.
    estimate : bool
        Whether to estimate these errors though neither notes nor a column ask for them.

    Returns
    -------
    dict
        Case -> list of numbers in the order of the columns but `status`, None where one cannot be had; status; dict of
        header -> estimated relative error where it exceeds ROUNDING or, None, is not known; notes.
    """
    headers = [column.header for column in columns if column.name != "status"]
    found, scenes = {}, {}
    for table in tables:
        cases = table.cases.tolist()
        closed = None if explain else _by_arrays(table, columns)
        if closed is None:
            scenes.update((case, table.scene_of(place)) for place, case in enumerate(cases))
        else:
            found.update((case, (*row, ())) for case, row in zip(cases, closed, strict=True))
    for case, row in zip(scenes, evaluate(list(scenes.values()), columns, explain or estimate), strict=True):
        numbers = [row.cells[header] for header in headers]
        found[case] = numbers, row.cells["status"], _beyond_rounding(row.errors), row.notes if explain else ()
    return found


def _by_arrays(table, columns):
    """As `evaluate_table`; None of a suspension, and of a case alone, whose object costs less than arrays."""
    if len(table.cases) == 1 or isinstance(table.scene, SuspensionScene):
        return None
    return evaluate_table(table, columns)


def _beyond_rounding(errors):
    """Those estimated errors that are above rounding, or not known."""
    return {name: error for name, error in errors.items() if error is None or error > ROUNDING}


def notes_on_stated(scene):
    """Notes, at most one, on what the tensions and sags that a scene states mean: a tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        A suspension has no stable equilibrium.
    """
    return moved_note(SuspensionCase(scene)) if isinstance(scene, SuspensionScene) else reference_without_loads(scene)
