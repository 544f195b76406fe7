"""Rows of the cases of a study, of one cable or of a suspension."""

from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.closed_form import evaluate_table
from cablestudy.study.columns import ROUNDING
from cablestudy.study.notes import reference_without_loads
from cablestudy.study.row import evaluate_cases
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.notes import moved_note
from cablestudy.study.suspension.rows import evaluate_suspensions


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
    suspensions = any(isinstance(table.scene, SuspensionScene) for table in tables)
    found, scenes = {}, {}
    for table in tables:
        cases = table.cases.tolist()
        closed = None if explain or suspensions else _by_arrays(table, columns)
        if closed is None:
            scenes.update((case, table.scene_of(place)) for place, case in enumerate(cases))
        else:
            found.update((case, (*row, ())) for case, row in zip(cases, closed, strict=True))
    evaluate = evaluate_suspensions if suspensions else evaluate_cases
    for case, row in zip(scenes, evaluate(list(scenes.values()), columns, explain or estimate), strict=True):
        numbers = [row.cells[header] for header in headers]
        found[case] = numbers, row.cells["status"], _beyond_rounding(row.errors), row.notes if explain else ()
    return found


def _by_arrays(table, columns):
    """As `evaluate_table`; None for a case alone too, whose object costs less than arrays."""
    return evaluate_table(table, columns) if len(table.cases) > 1 else None


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
