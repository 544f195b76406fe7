"""Rows of the cases of a study, of one cable or of a suspension: the results of each case, and checks of its limits."""

from dataclasses import replace

from cablestudy.errors import CablestudyError, SceneError
from cablestudy.study.limits import columns_by_case, least_margin, limits_of, unanswered
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.table_rows import has_answer
from cablestudy.study.tolerances import STUDY


def evaluate(scenes, columns, estimate=False):
    """Compute the columns of many scenes, all of one cable or all suspensions: list of Row.

    Parameters
    ----------
    scenes : sequence of CableScene or SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to estimate the errors of fixed elements though they are no column, and to write notes.
    """
    without_limits = [column for column in columns if column.needs != "limits"]
    rows = kind_of(scenes[0]).evaluate(scenes, without_limits, estimate) if scenes else []
    return rows if len(without_limits) == len(columns) else list(map(_with_limits, rows, checks_of(scenes)))


def checks_of(scenes):
    """Check the limits that scenes state, each limit in all of its load cases: a list with an item for each scene.

    It is the list of a `limits.Check` for each limit, in the load case where its margin is least; or the SceneError of
    a scene that cannot have its limits.
    """
    limits, errors = [[] for _ in scenes], {}
    for index, scene in enumerate(scenes):
        try:
            limits[index] = limits_of(scene)
        except SceneError as error:
            errors[index] = error
    rows = _rows_of_cases(scenes, limits)
    return [
        errors.get(index) or [least_margin(limit, rows[index]) for limit in limits_of_scene]
        for index, limits_of_scene in enumerate(limits)
    ]


def _rows_of_cases(scenes, limits):
    """Load case -> `Row` with the columns of the limits of each scene: list of dict.

    Scenes in cases with equal columns are solved together.
    """
    groups, rows = {}, [{} for _ in scenes]  # headers -> columns, and (index, case) with these
    for index, limits_of_scene in enumerate(limits):
        for case, columns in columns_by_case(limits_of_scene, kind_of(scenes[index]).is_cheap).items():
            groups.setdefault(tuple(columns), (columns, []))[1].append((index, case))
    for columns, members in groups.values():
        computed = evaluate([scenes[index].in_case(case) for index, case in members], list(columns.values()))
        for (index, case), row in zip(members, computed, strict=True):
            rows[index][case] = row
    return rows


def _with_limits(row, checks):
    """A `Row` with the cells of the columns of limits, and notes on undecided ones, from its item of `checks_of`."""
    refused = isinstance(checks, CablestudyError)
    reason = checks.without_places if refused else unanswered(checks)
    doubts = () if refused else [line for check in checks for line in check.doubts]
    least = None if reason else min(checks, key=lambda check: check.margin)
    status = row.cells["status"]
    cells = {"limit_margin": least and least.margin, "governing": least and least.governing}
    if reason:
        cells["status"] = reason if has_answer(status) else f"{status}; {reason}"
    errors = {"limit_margin": least.margin_error} if least else {}
    return replace(row, cells={**row.cells, **cells}, errors={**row.errors, **errors}, notes=(*row.notes, *doubts))


def evaluate_tables(tables, columns, explain=False, estimate=False):
    """Compute the columns of many cases of a study: closed forms for all cases of a table at once, others case by case.

    Parameters
    ----------
    tables : list of CaseTable
    columns : sequence of Column
    explain : bool
        Whether to return notes, among them the errors of models with a stated number of elements.
    estimate : bool
        Whether to estimate these errors though neither notes nor a column ask for them.

    Returns
    -------
    dict
        Number of a case of the study -> (numbers, status, errors, notes):

        * numbers: list in the order of the columns, without `status`; None where a column has no value
        * status: str
        * errors: dict of header -> estimated relative error, only where it exceeds the `least_error` of its column, or
          is not known (None)
        * notes: sequence of str, empty without `explain`
    """
    headers = [column.header for column in columns if column.name != "status"]
    least = {column.header: column.least_error for column in columns if column.least_error is not None}
    answers, scenes = {}, {}
    for table in tables:
        cases = table.cases.tolist()
        # several scenes, each a table by itself, are solved together below
        by_arrays = not explain and (len(cases) > 1 or len(tables) == 1)
        evaluate_table = kind_of(table.scene).evaluate_table
        closed_rows = evaluate_table(table, columns) if by_arrays and evaluate_table else None
        if closed_rows is None:
            scenes |= {case: table.scene_of(index) for index, case in enumerate(cases)}
        else:
            answers |= {case: (*row, ()) for case, row in zip(cases, closed_rows, strict=True)}
    for case, row in zip(scenes, evaluate(list(scenes.values()), columns, explain or estimate), strict=True):
        numbers = [row.cells[header] for header in headers]
        errors = {h: e for h, e in row.errors.items() if e is None or e > least.get(h, STUDY.rounding)}
        answers[case] = numbers, row.cells["status"], errors, row.notes if explain else ()
    return answers
