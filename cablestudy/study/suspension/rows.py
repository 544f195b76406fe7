"""Rows of a table of suspensions: the columns of cases, with the reason where one has no value."""

import time
from dataclasses import dataclass
from math import isfinite, isnan

import numpy as np

from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.scene.words import first_of
from cablestudy.study.closed_form import DISCRETE, SYSTEM
from cablestudy.study.columns import least_work_first, not_finite, relative
from cablestudy.study.refinement import reference_scene
from cablestudy.study.row import Row, batched
from cablestudy.study.status import FALLEN, MODAL, OVER_STRENGTH, SLACK, status_of
from cablestudy.study.suspension.case import SuspensionCase, cases_of, prepare
from cablestudy.study.suspension.columns import WHOLE
from cablestudy.study.suspension.notes import fallen, notes_of, strength_warning
from cablestudy.study.suspension.wind_columns import exceeded_limits, slackened
from cablestudy.study.tolerances import STUDY

OF_THE_WHOLE = {column.name: column for column in WHOLE}


@dataclass(frozen=True)
class _Wanted:
    """Columns of a table of suspensions.

    Attributes
    ----------
    headers : list of str
        Of all columns, in their order.
    computed : list of Column
        Those of the suspensions, in the order in which they cost least; the others are of the run.
    in_wind : bool
        Whether some are of the motion in the wind.
    """

    headers: list
    computed: list
    in_wind: bool

    @classmethod
    def of(cls, columns):
        """`_Wanted` of a sequence of Column."""
        computed = [column for column in least_work_first(columns) if column.needs != "run"]
        return cls([column.header for column in columns], computed, any(column.needs == "wind" for column in columns))


def evaluate_suspensions(scenes, columns, estimate=False):
    """Compute the columns of many suspensions.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to write notes, and to estimate the errors of models with stated elements even if no column asks for it.

    Returns
    -------
    list of Row
        Where a column has no value its cell is empty, and the status says why.
    """
    columns = [OF_THE_WHOLE.get(column.name, column) for column in columns]
    need_statics = any(column.needs in ("statics", "stiffness", "modes", "loop", "wind") for column in columns)
    need_motion = any(column.needs in SYSTEM for column in columns)
    compared = estimate or any(column.name == "error_estimate" for column in columns)
    rows, wanted, most_cables = [], _Wanted.of(columns), max((len(scene.cables) for scene in scenes), default=1)
    batch_size = max(STUDY.suspensions_at_once, STUDY.suspended_cables_at_once // max(1, most_cables))
    for batch in batched(scenes, batch_size):  # equilibria solved together
        start = time.perf_counter()
        cases = cases_of(batch) if need_statics else [SuspensionCase(scene) for scene in batch]
        if compared:
            _compare(cases, columns)
        seconds = (time.perf_counter() - start) / len(batch)
        block_size = len(cases)
        if need_motion:
            block_size = max(1, STUDY.cables_at_once // max(1, *(len(scene.cables) for scene in batch)))
        for block in batched(cases, block_size):  # models of cables computed together
            start = time.perf_counter()
            if need_motion:
                prepare(block)
            seconds_of_row = seconds + (time.perf_counter() - start) / len(block)
            rows += [_row(case, wanted, seconds_of_row, estimate) for case in block]
    return rows


def _compare(cases, columns):
    """Set `finer` of the cases that state their elements, for comparison; their statics are computed together."""
    exact = [case for case in cases if case.model is not None]
    if exact and any(column.needs in DISCRETE for column in columns):
        for case, finer in zip(exact, cases_of([reference_scene(case.with_all_cables) for case in exact]), strict=True):
            case.estimate, case.finer = True, finer


def _row(case, wanted, seconds, noted):
    """The `Row` of a case, with notes if `noted`; `seconds` is its share of the time of work done for several cases."""
    start = time.perf_counter()
    cells, errors, failures = _cells(case, wanted)
    if "dof" in cells:
        cells["dof"] = case.size
    if "error_estimate" in cells:
        unknown = None in errors.values()
        cells["error_estimate"] = None if unknown else max(errors.values(), default=0.0)
    if "solve_time_ms" in cells:
        cells["solve_time_ms"] = 1e3 * (seconds + time.perf_counter() - start)
    overloaded = list(case.over_strength) if case.solved else []
    slack_cables = slackened(case) if wanted.in_wind and case.moves else []
    doubts = (OVER_STRENGTH, overloaded), (SLACK, slack_cables), (FALLEN, fallen(case) if case.solved else [])
    cells["status"] = status_of(
        failures, *(f"{words}: {first_of(names, STUDY.listed_parts)}" for words, names in doubts if names)
    )
    return Row(cells, case, notes_of(case) if noted else (), errors, strength_warning(case) if overloaded else ())


def _cells(case, wanted):
    """Numbers of the columns, None where there is none, estimated relative errors, and failures: dicts by header."""
    cells, errors, failures = dict.fromkeys(wanted.headers), {}, {}
    for column in wanted.computed:
        try:
            cells[column.header], errors[column.header] = value(case, column)
        except CablestudyError as error:
            failures[column.header] = error
    if not failures:
        failures.update(_doubts(case, wanted.in_wind))
    return cells, errors, failures


def _doubts(case, in_wind):
    """Reasons to doubt a row: an unstable loop; with `in_wind`, limits exceeded in the wind, or why none are known.

    Returns
    -------
    dict
        Name -> CablestudyError.
    """
    try:
        if case.scene.control is not None and case.moves:
            case.in_wind.check_stable()
        return {name: NoSolutionError(text) for name, text in exceeded_limits(case).items()} if in_wind else {}
    except CablestudyError as error:
        return {"limits": error}


def value(case, column):
    """Value of a column of a case, and its estimated relative error.

    Returns
    -------
    number : float or None
        None where the case has no such number and none is missing, such as a limit.
    error : float or None
        None where it is not known. [-]

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no value.
    """
    case.refuse_lost(column.name.partition(".")[0])
    result = column.compute(case)
    number, error = result if isinstance(result, tuple) else (result, case.statics_error(column))
    if column.needs in ("loop", "wind") and error:
        # mean displacements have an error by the drag already, which is of first order and by itself too small
        error += case.group.drag_error(case.index, in_wind=True)
    if case.estimate and column.needs in DISCRETE:
        error = _difference(case, column, number)
    if number is None:
        return None, None if isnan(error) else float(error)
    number = number if isinstance(number, float) else np.asarray(number).item()
    if not isfinite(number):
        if column.key:
            raise NoSolutionError(f"{column.name} needs the key {column.key}, which this case does not have")
        raise not_finite(column)
    return float(number) + 0.0, None if isnan(error) else max(float(error), STUDY.rounding if error else 0.0)


def _difference(case, column, number):
    """Relative difference of a number from that of the finer model, plus the error of that; NaN if not known."""
    case.differences[column.header] = None
    if column.needs != "modes" and case.damped_by_modes:
        case.reason = MODAL.partition(",")[0]
        return np.nan
    try:
        reference, reference_error = value(case.finer, column)
    except CablestudyError as error:
        case.reason = str(error)
        return np.nan
    case.differences[column.header] = relative(number, reference) + (reference_error or 0.0)
    return case.differences[column.header]
