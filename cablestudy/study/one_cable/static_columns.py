"""Columns of a table by the computation they need; those of statics, in closed form or by stated elements."""

from dataclasses import dataclass
from math import isnan

import numpy as np

from cablestudy.study.cable_columns import is_of_one_cable, over_strength
from cablestudy.study.column import CLOSED, not_finite_error, of_part, shapeless_error
from cablestudy.study.motion_columns import DAMPING_RATIO
from cablestudy.study.one_cable.asked_modes import AskedModes
from cablestudy.study.one_cable.elements import element_results
from cablestudy.study.one_cable.results import Results
from cablestudy.study.table_rows import OK, OVER_STRENGTH, TableColumns, status_of
from cablestudy.study.tolerances import STUDY


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
    gondola, damped, in_motion : bool
        True if any column is of the gondola's mode; its damping ratio; of the loop or the wind.
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
        self.in_motion = self.in_wind or bool(_columns_needing(self.system, "loop"))
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
    """Those of some columns whose attribute `needs` is one of some: list."""
    return [column for column in columns if column.needs in needs]


@dataclass(frozen=True)
class StaticNumbers:
    """Statics of n cases, by closed forms or by elements; a case is an index from 0 to n - 1.

    Attributes
    ----------
    numbers : dict
        Header of a column -> ndarray, shape (n,); without meaning in a case in which the column has failed.
    errors : dict
        Header of a column with an error -> estimated relative error, shape (n,), NaN where it is unknown. [-]
    failures : dict
        Case -> {header: CablestudyError} of each column without a value.
    over_strength : ndarray of bool, shape (n,)
        True for cases whose stress is above the strength.
    """

    numbers: dict
    errors: dict
    failures: dict
    over_strength: np.ndarray

    def rows(self, headers):
        """Numbers of each case in the order of some headers, None where there is none: list of list."""
        none = [None] * len(self.over_strength)
        columns = (self.numbers[header].tolist() if header in self.numbers else none for header in headers)
        rows = list(map(list, zip(*columns, strict=True))) if headers else [[] for _ in none]
        for case, failed in self.failures.items():
            for index, header in enumerate(headers):
                if header in failed:
                    rows[case][index] = None
        return rows

    def cells(self):
        """Header -> number of each case, None where there is none: list of dict."""
        return [dict(zip(self.numbers, row, strict=True)) for row in self.rows(list(self.numbers))]

    def errors_of(self, case):
        """Header -> estimated relative error of one case, None where it is unknown. [-]"""
        errors = {header: float(error[case]) for header, error in self.errors.items()}
        return {header: None if isnan(error) else error for header, error in errors.items()}

    def status(self, case):
        """Status of one case."""
        return status_of(self.failures.get(case, {}), OVER_STRENGTH if self.over_strength[case] else "")

    @property
    def notable(self):
        """Indices of cases whose status is not ok, or some error of which is above `STUDY.rounding` or unknown."""
        notable = self.over_strength.copy()
        notable[list(self.failures)] = True
        for error in self.errors.values():
            notable |= ~(error <= STUDY.rounding)
        return np.flatnonzero(notable)


def by_closed_form(results, required):
    """`StaticNumbers` of the cases of `Results`."""
    numbers, failures, errors = {}, _unsolvable(results, required), {}
    over_strength_cases = np.zeros(len(results.values), dtype=bool)
    if not required.scene_only:
        over_strength_cases = over_strength(results)
        over_strength_cases[list(results.failures)] = False
    for column in required.closed:
        numbers[column.header] = _compute(column, results)
        if column.determined_by:
            for case in np.flatnonzero(results.catenary.slack).tolist():
                _add_failure(failures, case, column.header, shapeless_error(column, results.limp[case]))
        _refuse_infinite(failures, column, numbers[column.header], results.failures if column.name == "chord" else {})
    for column in required.physical:
        if column.least_error is not None:
            errors[column.header] = _error(column, results, required, numbers.get(column.header))
    return StaticNumbers(numbers, errors, failures, over_strength_cases)


def by_elements(results, required, closed):
    """Compute columns of statics by finite elements for scenes that fix their number, and estimate their errors.

    The error of a number x due to elements is |x - x_c| / |x_c|, where x_c is the same number in closed form.

    Parameters
    ----------
    results : Results
        Closed form of n cases.
    required : ColumnRequirements
        The columns of the table.
    closed : StaticNumbers
        The columns of these cases in closed form, from `by_closed_form`.

    Returns
    -------
    StaticNumbers
        Numbers, errors and failures, here those by elements. Columns that follow from the scene without an equilibrium
        keep their numbers of `closed`.
    list of (ndarray of int, ElementResults)
        Groups of cases with equal meshes, solved together: their indices, and their solution by elements.
    """
    columns = [column for column in required.closed if column.needs != "scene"]
    numbers = {name: np.array(values) for name, values in closed.numbers.items()}
    failures, over_strength_cases = _unsolvable(results, required), np.zeros(len(results.values), dtype=bool)
    for column in required.closed:
        for case, error in _errors_of_column(closed.failures, column).items() if column.needs == "scene" else ():
            _add_failure(failures, case, column.header, error)
    groups, refused = element_results(results)
    for case, error in refused.items():
        for header in required.of_equilibrium:
            _add_failure(failures, case, header, error)
    for cases, elements in groups:
        over_strength_cases[cases] = over_strength(elements)
        for column in columns:
            column_numbers = _compute(column, elements)
            numbers[column.header][cases] = column_numbers
            _refuse_infinite(failures, column, column_numbers, {}, cases)
    no_errors_of_scene = {c.header: np.zeros(len(results.values)) for c in required.physical if c.needs == "scene"}
    errors = no_errors_of_scene | _against_closed_form(columns, numbers, closed)
    return StaticNumbers(numbers, errors, failures, over_strength_cases), groups


def _against_closed_form(columns, numbers, closed):
    """Header -> relative error of each case against the closed form, NaN where it has none: dict."""
    errors = {}
    for column in columns:
        if column.least_error is None:
            continue
        value, reference = (np.asarray(array[column.header], dtype=float) for array in (numbers, closed.numbers))
        size = np.abs(reference)
        with np.errstate(invalid="ignore"):  # of cases without a number
            relative = np.abs(value - reference) / np.where(size > 0, size, 1.0)
            errors[column.header] = np.where(size > 0, relative, 1.0 * (value != reference))
        errors[column.header][list(_errors_of_column(closed.failures, column))] = np.nan
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
        _add_failure(failures, case, column.header, unsolved.get(case) or not_finite_error(column))


def _add_failure(failures, case, header, error):
    """Add the error of a column in a case, where it has none yet."""
    failures.setdefault(case, {}).setdefault(header, error)


def _errors_of_column(failures, column):
    """Case -> CablestudyError of a column."""
    return {case: errors[column.header] for case, errors in failures.items() if column.header in errors}


def _error(column, results, required, numbers):
    """Estimated relative error of a column in closed form, shape (n,). [-]

    It is the largest of the errors that apply to the column:

    * all columns: `Column.least_error` by rounding, zero if a number follows from the scene without an equilibrium;
    * if that is not zero: rounding of the equilibrium; and the error as a conductor is taken as linear; more of a
      number in which larger ones cancel (`Column.whole`);
    * columns with `determined_by` "sag": rounding of the sag;
    * the column `force_displacement`: error of the displacement of end 2 by the force on it;
    * in a steady wind: change of its own number by the parts on which the drag varies (`Results.errors_by_drag`), but
      of columns of the state without load case (`Column.of_reference`).

    Parameters
    ----------
    column : Column
        With a `least_error`.
    results : Results
        Closed form of n cases.
    required : ColumnRequirements
        The columns of the table.
    numbers : ndarray, shape (n,), or None
        Of the column; None if it is computed case by case, where it finds its own error.
    """
    error = np.full(len(results.values), column.least_error)
    if required.scene_only:
        return error
    if column.least_error:
        error = np.maximum(error, np.maximum(results.statics_rounding, results.model_error))
    if column.whole is not None:
        error = of_part(error, column.whole(results), numbers)
    if column.determined_by == "sag":
        error = np.maximum(error, results.sag_rounding)
    if column.name == "force_displacement":
        error = np.maximum(error, results.force_displacement[1])
    if numbers is not None and not column.of_reference and results.in_steady_wind:
        error = np.maximum(error, results.errors_by_drag(column, numbers))
    return error


def evaluate_table(table, columns):
    """Compute columns of statics for all cases of a table at once, as arrays, without an object for each case.

    By the closed form, or by the elements that the scene states.

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

        None in place of the list where this is not possible: a column is one of suspensions, is computed case by case,
        needs a model of the motion or describes the computation; or the cable is a conductor with stress-strain curves.
    """
    if not all(map(is_of_one_cable, columns)) or table.scene.cable.stress_strain is not None:
        return None
    required = ColumnRequirements(columns)
    if required.run or len(required.closed) < len(required.physical):
        return None
    results = Results(table)
    statics = by_closed_form(results, required)
    if table.scene.model.elements is not None and not required.scene_only:
        statics, _ = by_elements(results, required, statics)
    rows = [(cells, OK, {}) for cells in statics.rows([column.header for column in required.closed])]
    for case in statics.notable.tolist():
        failed = statics.failures.get(case, ())
        errors = {
            name: error
            for name, error in statics.errors_of(case).items()
            if name not in failed and (error is None or error > STUDY.rounding)
        }
        rows[case] = rows[case][0], statics.status(case), errors
    return rows
