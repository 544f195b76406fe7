"""Columns of a table by the computation they need; those of statics, in closed form or by stated elements."""

from dataclasses import dataclass, field

import numpy as np

from cablestudy.study.cable_columns import is_of_one_cable, over_strength
from cablestudy.study.column import CLOSED, not_finite, shapeless_error
from cablestudy.study.motion_columns import DAMPING_RATIO
from cablestudy.study.one_cable.asked_modes import AskedModes
from cablestudy.study.one_cable.models import element_results
from cablestudy.study.one_cable.results import Results
from cablestudy.study.table_rows import OK, OVER_STRENGTH, TableColumns, status_of
from cablestudy.study.tolerances import STUDY
from cablestudy.study.uneven_drag import relative_change


class ColumnRequirements(TableColumns):
    """Columns of a table of one cable by the computation that they need; lists of columns are parts of `physical`.

    Attributes
    ----------
    closed, single : list of Column
        Closed forms of many cases at once, and closed forms computed case by case.
    modes : list of Column
        Frequencies of the cable between fixed ends.
    computed : list of Column
        `single`, `system` and `modes`, which are computed case by case, in this order.
    scene_only : bool
        True if no column needs more than the keys of the scene.
    gondola, damped, driven : bool
        True if any column is of the gondola's mode; its damping ratio; of the loop or the wind.
    least_errors : dict
        Header -> relative error of a closed form, by rounding. [-]
    asked_modes : AskedModes
        Those whose frequencies are columns.
    """

    def __init__(self, columns):
        super().__init__(columns)
        closed = _columns_needing(self.physical, *CLOSED)
        self.closed = [column for column in closed if not column.each]
        self.single = [column for column in closed if column.each]
        self.modes = _columns_needing(self.physical, "modes")
        self.scene_only = not self.of_equilibrium
        self.gondola = bool(_columns_needing(self.system, "gondola"))
        self.damped = any(column.name == DAMPING_RATIO for column in self.system)
        self.driven = self.in_wind or bool(_columns_needing(self.system, "loop"))
        self.least_errors = {c.header: c.least_error for c in self.physical if c.least_error is not None}
        self.computed = [*self.single, *self.system, *self.modes]
        self.asked_modes = AskedModes(column.mode for column in self.modes)

    @property
    def rows_at_once(self):
        """Number of rows whose models are solved at once, by the memory that they take. [-]"""
        if self.system:
            return STUDY.coupled_rows_at_once
        asked = self.asked_modes
        low = not asked.axial and max(asked.waves, asked.sagging_waves) <= STUDY.low_mode_waves
        return STUDY.low_mode_rows_at_once if low else STUDY.rows_at_once


def _columns_needing(columns, *needs):
    return [column for column in columns if column.needs in needs]


@dataclass(frozen=True)
class ClosedForm:
    """Values of closed-form columns of n cases; a case is an index from 0 to n - 1."""

    count: int  # n
    numbers: dict  # header -> ndarray of shape (n,)
    failures: dict = field(default_factory=dict)  # case -> {header: CablestudyError} of a column without a value
    over_strength: frozenset = frozenset()  # cases whose stress is above the strength
    errors: dict = field(default_factory=dict)  # case -> {header: relative error}, where it exceeds `rounding`
    least_errors: dict = field(default_factory=dict)  # header -> estimated relative error of all other cases

    def rows(self, headers):
        """Numbers of each case in the order of some headers, None where there is none: list of list."""
        if not headers:
            return [[] for _ in range(self.count)]
        none = [None] * self.count
        columns = (self.numbers[header].tolist() if header in self.numbers else none for header in headers)
        rows = list(map(list, zip(*columns, strict=True)))
        for case, failed in self.failures.items():
            for place, header in enumerate(headers):
                if header in failed:
                    rows[case][place] = None
        return rows

    def cells(self, headers):
        """List of dict: each header -> number of each case, None where there is none."""
        return [dict(zip(headers, row, strict=True)) for row in self.rows(headers)]

    def errors_of(self, case):
        """Header -> estimated relative error, of one case."""
        return self.errors.get(case, self.least_errors)

    def status(self, case):
        """Status of one case."""
        if case not in self.failures and case not in self.over_strength:
            return OK
        return status_of(self.failures.get(case, {}), OVER_STRENGTH if case in self.over_strength else "")


def closed_form(results, required):
    """`ClosedForm` of the cases of `Results`."""
    numbers, failures, over_strength_cases = {}, _unsolvable(results, required), frozenset()
    if not required.scene_only:
        over_strength_cases = frozenset(np.flatnonzero(over_strength(results)).tolist()) - results.failures.keys()
    for column in required.closed:
        numbers[column.header] = _compute(column, results)
        if column.determined_by:
            for case in np.flatnonzero(results.catenary.slack).tolist():
                _add_failure(failures, case, column.header, shapeless_error(column, results.limp[case]))
        _refuse_infinite(failures, column, numbers[column.header], results.failures if column.name == "chord" else {})
    errors = {} if required.scene_only else _coarse_errors(results, required, numbers)
    return ClosedForm(len(results.values), numbers, failures, over_strength_cases, errors, required.least_errors)


def by_elements(results, required, closed):
    """Compute columns of statics by finite elements, of scenes that fix their number, with the errors by the elements.

    The error of a number x by elements, x_c in closed form, is |x - x_c| / |x_c|.

    Parameters
    ----------
    results : Results
        Closed form of n cases.
    required : ColumnRequirements
        The columns of the table.
    closed : ClosedForm
        The columns of these cases in closed form, from `closed_form`.

    Returns
    -------
    ClosedForm
        Numbers, errors and failures by elements, in spite of its name. Columns that follow from the scene without an
        equilibrium keep their numbers of `closed`.
    list of (ndarray of int, ElementResults)
        Groups of cases with equal meshes, solved together: their indices, and their solution by elements.
    """
    columns = [column for column in required.closed if column.needs != "scene"]
    numbers = {name: np.array(values) for name, values in closed.numbers.items()}
    failures, over_strength_cases = _unsolvable(results, required), set()
    for column in required.closed:
        for case, error in _errors_of_column(closed.failures, column).items() if column.needs == "scene" else ():
            _add_failure(failures, case, column.header, error)
    groups, refused = element_results(results)
    for case, error in refused.items():
        for header in required.of_equilibrium:
            _add_failure(failures, case, header, error)
    for cases, elements in groups:
        over_strength_cases.update(cases[over_strength(elements)].tolist())
        for column in columns:
            column_numbers = _compute(column, elements)
            numbers[column.header][cases] = column_numbers
            _refuse_infinite(failures, column, column_numbers, {}, cases)
    errors = _against_closed_form(columns, numbers, failures, closed)
    least_errors = {column.header: 0.0 for column in required.physical if column.needs == "scene"}
    errors = {case: least_errors | {name: errors[name][case] for name in errors} for case in range(closed.count)}
    return ClosedForm(closed.count, numbers, failures, frozenset(over_strength_cases), errors, least_errors), groups


def _against_closed_form(columns, numbers, failures, closed):
    """Header -> relative error of each case against the closed form, None where this has no number: dict of list."""
    errors = {}
    for column in columns:
        if column.least_error is None:
            continue
        header = column.header
        value, reference = (np.asarray(array, dtype=float) for array in (numbers[header], closed.numbers[header]))
        size = np.abs(reference)
        with np.errstate(invalid="ignore"):  # of cases without a number
            relative = np.abs(value - reference) / np.where(size > 0, size, 1.0)
            relative = np.where(size > 0, relative, 1.0 * (value != reference))
        errors[header] = relative.tolist()
        for case in _errors_of_column(closed.failures, column):
            errors[header][case] = None
    return errors


def _unsolvable(results, required):
    """Case -> {header: CablestudyError} of columns whose case has no equilibrium, or lacks a key that they need."""
    failures = {}
    if not required.scene_only:
        for case, error in results.failures.items():
            for header in required.of_equilibrium:
                _add_failure(failures, case, header, error)
    for column in required.physical:
        for case, error in results.values.lacking(column).items():
            _add_failure(failures, case, column.header, error)
    return failures


def _compute(column, results):
    """Numbers of a column, shape (n,); no minus before a zero."""
    number = np.asarray(column.compute(results))
    return number + 0.0 if number.dtype.kind == "f" else number


def _refuse_infinite(failures, column, number, unsolved, cases=None):
    """Add failures of a column where its number is not finite, with the reason of `unsolved` (case -> error) if any.

    The numbers, shape (n,), are of `cases`, by default 0 to n - 1.
    """
    for index in np.flatnonzero(~np.isfinite(number)).tolist():
        case = index if cases is None else int(cases[index])
        _add_failure(failures, case, column.header, unsolved.get(case) or not_finite(column))


def _add_failure(failures, case, header, error):
    """Add the error of a column in a case, where it has none yet."""
    failures.setdefault(case, {}).setdefault(header, error)


def _errors_of_column(failures, column):
    """Case -> CablestudyError of a column."""
    return {case: errors[column.header] for case, errors in failures.items() if column.header in errors}


def _coarse_errors(results, required, numbers):
    """Estimated relative errors of closed forms, of the cases in which any is above that by rounding, `STUDY.rounding`.

    The error of a column is the largest of those that apply to it:

    * of the statics: by rounding, by the drag of a steady wind that is taken as uniform along the cable, and by the
      linear cable that stands for a conductor. It applies to all columns but those of the scene alone; to columns of
      the reference state (`Column.of_reference`), in which no wind blows, without the part by the drag;
    * of the sag by rounding: columns whose `determined_by` is "sag";
    * of the displacement of end 2 by a force: the column `force_displacement`;
    * of the number itself by uniform drag: columns with a function `Column.by_drag`.

    Parameters
    ----------
    results : Results
        Closed form of n cases.
    required : ColumnRequirements
        The columns of the table.
    numbers : dict
        Header of a column -> ndarray of its numbers, shape (n,).

    Returns
    -------
    dict
        Index of a case -> {header: error}. [-]
    """
    statics_error = np.maximum(results.statics_rounding, results.model_error)
    reference_error = np.maximum(results.statics_rounding, results.model_error - results.drag_error)
    sag_headers = [column.header for column in required.closed if column.determined_by == "sag"]
    reference_headers = [column.header for column in required.closed if column.of_reference]
    pushed_headers = [column.header for column in required.closed if column.name == "force_displacement"]
    none = np.zeros(len(statics_error))
    sag_error = results.sag_rounding if sag_headers else none
    push_error = results.pushed[1] if pushed_headers else none
    errors = {}
    largest = np.maximum(np.maximum(statics_error, sag_error), push_error)
    for case in np.flatnonzero(largest > STUDY.rounding).tolist():
        by_statics = float(statics_error[case])
        errors[case] = {name: max(least, by_statics if least else 0.0) for name, least in required.least_errors.items()}
        of_reference = dict.fromkeys(reference_headers, max(STUDY.rounding, float(reference_error[case])))
        errors[case].update(of_reference)
        for headers, error in ((sag_headers, sag_error), (pushed_headers, push_error)):
            errors[case].update((header, max(errors[case][header], float(error[case]))) for header in headers)
    for column in required.closed if results.drag_errors is not None else ():
        if column.by_drag is None:
            continue
        by_drag = relative_change(results.change_by_drag(column), numbers[column.header])
        for case in errors:
            errors[case][column.header] = max(errors[case][column.header], float(by_drag[case]))
    return errors


def evaluate_table(table, columns):
    """Compute columns of statics for all cases of a table at once, as arrays, without an object for each case.

    Parameters
    ----------
    table : CaseTable
        n cases of one scene, which differ in numbers only.
    columns : sequence of Column

    Returns
    -------
    list of (list, str, dict), or None
        One tuple for each case:

        * its numbers in the order of the columns without `status`, None where there is none;
        * its status: "ok", or why a number is missing or doubtful;
        * its estimated relative errors: header -> error above `STUDY.rounding`, or None where it is unknown. [-]

        None in place of the list where this way is not open: a column is of a suspension, is computed case by case,
        needs a model of the motion or describes the computation; or the cable is a conductor with stress-strain curves.
    """
    if not all(map(is_of_one_cable, columns)) or table.scene.cable.stress_strain is not None:
        return None
    required = ColumnRequirements(columns)
    if required.run or len(required.closed) < len(required.physical):
        return None
    results = Results(table)
    closed = closed_form(results, required)
    if table.scene.model.elements is not None and not required.scene_only:
        closed, _ = by_elements(results, required, closed)
    rows = [(cells, OK, {}) for cells in closed.rows([column.header for column in required.closed])]
    for case in {*closed.errors, *closed.failures, *closed.over_strength}:
        failed = closed.failures.get(case, ())
        errors = {
            name: error
            for name, error in closed.errors.get(case, {}).items()
            if name not in failed and (error is None or error > STUDY.rounding)
        }
        rows[case] = rows[case][0], closed.status(case), errors
    return rows
