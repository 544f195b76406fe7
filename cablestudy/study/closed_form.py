"""Columns in closed form, of many cases at once."""

from dataclasses import dataclass, field

import numpy as np

from cablestudy.study.column_requirements import ColumnRequirements
from cablestudy.study.columns import ROUNDING, not_finite, values
from cablestudy.study.results import Results
from cablestudy.study.scene_values import TableValues

MAX_REASONS = 3  # in a status


@dataclass(frozen=True)
class ClosedForm:
    """Values of closed-form columns with an axis of cases.

    Attributes
    ----------
    count : int
        Of cases, n.
    numbers : dict
        Header -> ndarray of shape (n,).
    failures : dict
        Case -> {header: CablestudyError} of what it cannot have.
    errors : dict
        Case -> {header: estimated relative error}, of cases whose rounding exceeds ROUNDING.
    least_errors : dict
        Header -> estimated relative error of all other cases.
    """

    count: int
    numbers: dict
    failures: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)
    least_errors: dict = field(default_factory=dict)

    def cells(self):
        """List of dict: header -> number of each case, None where it cannot be had."""
        if not self.numbers:
            return [{} for _ in range(self.count)]
        rows = zip(*(numbers.tolist() for numbers in self.numbers.values()), strict=True)
        cells = [dict(zip(self.numbers, row, strict=True)) for row in rows]
        for case, failed in self.failures.items():
            cells[case].update((header, None) for header in failed if header in cells[case])
        return cells

    def errors_of(self, case):
        """Header -> estimated relative error, of one case."""
        return self.errors.get(case, self.least_errors)


def closed_form(results, required, breakable=True):
    """Compute the closed-form columns of many cases.

    Parameters
    ----------
    results : Results
    required : ColumnRequirements
    breakable : bool
        Whether a stress above the strength is a failure.

    Returns
    -------
    ClosedForm
    """
    numbers = {column.header: values(column, results) for column in required.closed}
    failures = {}

    def fail(case, header, error):
        failures.setdefault(case, {}).setdefault(header, error)

    if not required.scene_only:
        unsolved = {**(results.broken if breakable else {}), **results.failures}
        for case, error in unsolved.items():
            for header in required.of_equilibrium:
                fail(case, header, error)
    for column in required.physical:
        for case, error in results.values.lacking(column).items():
            fail(case, column.header, error)
    for column in required.closed:
        for case in np.flatnonzero(~np.isfinite(numbers[column.header])).tolist():
            fail(case, column.header, not_finite(column))
    errors = {} if required.scene_only else _coarse_errors(results, required)
    return ClosedForm(len(results.values), numbers, failures, errors, required.least_errors)


def _coarse_errors(results, required):
    """Case -> {header: estimated relative error}, where rounding exceeds ROUNDING."""
    statics = results.statics_rounding
    sags = [column.header for column in required.closed if column.name in ("sag", "sag_ratio")]
    sag = results.sag_rounding if sags else np.zeros(len(statics))
    errors = {}
    for case in np.flatnonzero(np.maximum(statics, sag) > ROUNDING).tolist():
        own = {
            name: max(least, float(statics[case]) if least else 0.0) for name, least in required.least_errors.items()
        }
        own.update((name, max(own[name], float(sag[case]))) for name in sags)
        errors[case] = own
    return errors


def evaluate_table(table, columns):
    """Closed-form columns of many cases that differ in numbers only, without an object for each case.

    Parameters
    ----------
    table : CaseTable
    columns : sequence of Column

    Returns
    -------
    list of tuple, or None
        Of each case: list of numbers in the order of the columns but `status`, None where one cannot be had; status;
        dict of header -> estimated relative error where it exceeds ROUNDING. None where a column is no closed form of
        many cases.
    """
    required = ColumnRequirements(columns)
    elements = table.scene.model.elements is not None and not required.scene_only
    if elements or required.run or len(required.closed) < len(required.physical):
        return None
    closed = closed_form(Results(TableValues(table.scene, len(table.cases))), required)
    numbers = list(map(list, zip(*(closed.numbers[column.header].tolist() for column in required.closed), strict=True)))
    rows = [(cells, "ok", {}) for cells in numbers] or [([], "ok", {}) for _ in table.cases]
    for case, errors in closed.errors.items():
        rows[case] = rows[case][0], "ok", {name: error for name, error in errors.items() if error > ROUNDING}
    for case, failures in closed.failures.items():
        cells, _, errors = rows[case]
        cells = [None if c.header in failures else cell for c, cell in zip(required.closed, cells, strict=True)]
        errors = {name: error for name, error in errors.items() if name not in failures}
        rows[case] = cells, status_of(failures), errors
    return rows


def status_of(failures):
    """`ok`, or why columns cannot be had: each reason once.

    Parameters
    ----------
    failures : dict
        Header -> CablestudyError.
    """
    reasons = list(dict.fromkeys(" ".join(str(error).split()) for error in failures.values()))
    more = len(reasons) - MAX_REASONS
    return "; ".join(reasons[:MAX_REASONS] + ([f"and {more} more reasons"] if more > 0 else [])) or "ok"
