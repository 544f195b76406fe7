"""Rows of the cases of a study, of one cable or of a suspension."""

from dataclasses import replace

from cablestudy.errors import SceneError
from cablestudy.study.limits import columns_by_case, in_case, least_margin, limits_of, unanswered
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.status import has_answer
from cablestudy.study.tolerances import STUDY


def evaluate(scenes, columns, estimate=False):
    """Compute the columns of many scenes, all of one cable or all suspensions: list of Row, see `row.evaluate_cases`.

    Parameters
    ----------
    scenes : sequence of CableScene or SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to estimate the errors of fixed elements though they are no column, and to write notes.
    """
    own = [column for column in columns if column.needs != "limits"]
    rows = kind_of(scenes[0]).evaluate(scenes, own, estimate) if scenes else []
    return rows if len(own) == len(columns) else list(map(_with_limits, rows, checks_of(scenes)))


def checks_of(scenes, limits_of=limits_of):
    """The limits of scenes, each in all of its load cases.

    Parameters
    ----------
    scenes : sequence of CableScene or SuspensionScene
    limits_of : callable
        Scene -> list of its `SceneLimit`; by default all of them.

    Returns
    -------
    list
        Of each scene: list of `limits.Check`, or the SceneError of one that cannot have its limits.
    """
    limits = [_known_or_error(limits_of, scene) for scene in scenes]
    rows = _rows_of_cases(scenes, [[] if isinstance(known, SceneError) else known for known in limits])
    return [
        known if isinstance(known, SceneError) else [least_margin(limit, own) for limit in known]
        for known, own in zip(limits, rows, strict=True)
    ]


def _rows_of_cases(scenes, limits):
    """Rows with the columns of the limits of scenes, by load case: list of dict. Cases alike are solved together."""
    groups, rows = {}, [{} for _ in scenes]
    for place, own in enumerate(limits):
        for case, columns in columns_by_case(own, kind_of(scenes[place]).is_cheap).items():
            groups.setdefault(tuple(columns), (columns, []))[1].append((place, case))
    for columns, members in groups.values():
        found = evaluate([in_case(scenes[place], case) for place, case in members], list(columns.values()))
        for (place, case), row in zip(members, found, strict=True):
            rows[place][case] = row
    return rows


def _known_or_error(limits_of, scene):
    try:
        return limits_of(scene)
    except SceneError as error:
        return error


def _with_limits(row, checks):
    """A `Row` with the cells of the columns of limits, from its item of `checks_of`."""
    reason = checks.without_places if isinstance(checks, SceneError) else unanswered(checks)
    least = None if reason else min(checks, key=lambda check: check.margin)
    status = row.cells["status"]
    cells = {"limit_margin": least and least.margin, "governing": least and least.governing}
    if reason:
        cells["status"] = reason if has_answer(status) else f"{status}; {reason}"
    errors = {"limit_margin": least.margin_error} if least else {}
    return replace(row, cells={**row.cells, **cells}, errors={**row.errors, **errors})


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
        header -> estimated relative error where it exceeds `rounding` or, None, is not known; notes.
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
    return {name: error for name, error in errors.items() if error is None or error > STUDY.rounding}
