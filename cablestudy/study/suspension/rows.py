"""Rows of a table of suspensions: the columns of cases, with the reason where one cannot be had."""

import time

import numpy as np

from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.scene.words import first_of
from cablestudy.study.columns import ROUNDING, most_modes_first, not_finite
from cablestudy.study.row import Row
from cablestudy.study.status import OVER_STRENGTH, status_of
from cablestudy.study.suspension.case import SuspensionCase, cases_of
from cablestudy.study.suspension.columns import WHOLE
from cablestudy.study.suspension.notes import LISTED, notes_of
from cablestudy.study.suspension.wind_columns import limits_passed

OF_THE_WHOLE = {column.name: column for column in WHOLE}
AT_ONCE = 200  # cases whose equilibria are solved together: bounds the memory


def evaluate_suspensions(scenes, columns, explain=False):
    """Compute the columns of many suspensions.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
    columns : sequence of Column
    explain : bool
        Whether notes are needed.

    Returns
    -------
    list of Row
        Where a column cannot be had its cell is empty, and the status says why.
    """
    columns = [OF_THE_WHOLE.get(column.name, column) for column in columns]
    rows, needed = [], any(column.needs in ("statics", "stiffness", "modes", "loop", "wind") for column in columns)
    for first in range(0, len(scenes), AT_ONCE):
        some = scenes[first : first + AT_ONCE]
        begin = time.perf_counter()
        cases = cases_of(some) if needed else [SuspensionCase(scene) for scene in some]
        shared = (time.perf_counter() - begin) / len(some)
        rows += [_row(case, columns, shared, explain) for case in cases]
    return rows


def _row(case, columns, seconds, explain):
    """One row; `seconds` is its share of the time of what was solved with others."""
    begin, cells, errors, failures = time.perf_counter(), {column.header: None for column in columns}, {}, {}
    for column in most_modes_first(columns):
        if column.needs == "run":
            continue
        try:
            cells[column.header], errors[column.header] = value(case, column)
        except CablestudyError as error:
            failures[column.header] = error
    if any(column.needs == "wind" for column in columns) and not failures:
        failures.update((name, NoSolutionError(text)) for name, text in limits_passed(case).items())
    known = [error for error in errors.values() if error is not None]
    run = {
        "dof": case.size,
        "error_estimate": max(known, default=0.0) if len(known) == len(errors) else None,
        "solve_time_ms": 1e3 * (seconds + time.perf_counter() - begin),
    }
    cells.update((header, number) for header, number in run.items() if header in cells)
    weak = list(case.over_strength) if case.solved else []
    cells["status"] = status_of(failures, f"{OVER_STRENGTH}: {first_of(weak, LISTED)}" if weak else "")
    return Row(cells, case, notes_of(case) if explain else (), errors)


def value(case, column):
    """One number of a case, None for a limit that it does not have; and its estimated relative error, None where that
    is not known.

    Raises
    ------
    NoSolutionError, ConvergenceError
        It cannot be had.
    """
    found = column.compute(case)
    number, error = found if isinstance(found, tuple) else (found, case.statics_error(column))
    if number is None:  # a limit that there is not
        return None, None if np.isnan(error) else float(error)
    number = np.asarray(number).item()
    if not np.isfinite(number):
        if column.key:
            raise NoSolutionError(f"{column.name} needs the key {column.key}, which this case does not have")
        raise not_finite(column)
    return number + 0.0, None if np.isnan(error) else max(float(error), ROUNDING if error else 0.0)
