"""Rows of the cases of a study, of one cable or of a suspension."""

from cablestudy.study.columns import ROUNDING
from cablestudy.study.scene_kind import kind_of


def evaluate(scenes, columns, estimate=False):
    """Compute the columns of many scenes, all of one cable or all suspensions: list of Row, see `row.evaluate_cases`.

    Parameters
    ----------
    scenes : sequence of CableScene or SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to estimate the errors of fixed elements though they are no column, and to write notes.
    """
    return kind_of(scenes[0]).evaluate(scenes, columns, estimate) if scenes else []


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
    """As `SceneKind.evaluate_table`; None too of a case alone, whose object costs less than arrays."""
    return None if len(table.cases) == 1 else kind_of(table.scene).evaluate_table(table, columns)


def _beyond_rounding(errors):
    """Those estimated errors that are above rounding, or not known."""
    return {name: error for name, error in errors.items() if error is None or error > ROUNDING}
