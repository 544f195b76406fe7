"""Columns of a table, its rows while they are computed and when they are finished, and their status.

The status of a row is `ok`, `over strength` or another doubt about an answer, or why cells are empty.
"""

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from math import isnan

from cablestudy.errors import CablestudyError, one_line
from cablestudy.study.column import DISCRETE, SYSTEM, least_work_first, value_and_error
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

OK, OVER_STRENGTH, SLACK, FALLEN = "ok", "over strength", "a cable goes slack in the wind", "fallen"
DOUBTS = OVER_STRENGTH, SLACK, FALLEN  # of rows that have an answer
STATUS = Field("status", "status", unless="ok", text=True)  # in tables


def status_of(failures, *doubts):
    """The text of a status.

    Parameters
    ----------
    failures : dict
        Header -> CablestudyError of a column without a value. Each reason is reported once, and not by itself where
        another one contains it.
    *doubts : str
        Any of DOUBTS, followed by names where there are several cables or bodies; an empty one does not count. They
        come last, so that a status that begins with one has no other reason.
    """
    if not failures:
        return "; ".join(filter(None, doubts)) or OK
    reasons = list(dict.fromkeys(map(one_line, failures.values())))
    reasons = [reason for reason in reasons if not any(reason in other for other in reasons if other != reason)]
    omitted = len(reasons) - STUDY.listed_reasons
    reasons[STUDY.listed_reasons :] = [f"and {omitted} more reasons"] if omitted > 0 else []
    return "; ".join([*reasons, *filter(None, doubts)])


def has_answer(status):
    """True if a row of this status has an answer; a doubtful one counts."""
    return status == OK or status.startswith(DOUBTS)


def with_status(table, status):
    """Copy of a `Table` whose rows have this status, unless they have one; without a table, one row of it alone."""
    field = replace(STATUS, kept=True)
    if table is None:
        return Table((field,), [{STATUS.name: status}], single=True)
    if any(other.name == STATUS.name for other in table.fields):
        return table
    return replace(table, fields=(*table.fields, field), rows=[{**row, STATUS.name: status} for row in table.rows])


class TableColumns:
    """Columns of a table, and which of them describe the computation, found once for all rows."""

    def __init__(self, columns):
        self.physical = [column for column in columns if column.needs != "run"]  # all but those of the computation
        self.computed = least_work_first(self.physical)  # those that are computed case by case
        # of gondola, loop and wind, in the order in which they cost least
        self.system = least_work_first([column for column in self.physical if column.needs in SYSTEM])
        self.of_equilibrium = [column.header for column in self.physical if column.needs != "scene"]
        self.in_wind = any(column.needs == "wind" for column in self.system)
        self.discrete = any(column.needs in DISCRETE for column in self.physical)  # whether any depends on the elements
        self.empty = {column.header: None for column in columns}
        names = {column.name for column in columns if column.needs == "run"}
        # whether a column is the estimated error; the time; anything that describes the computation but the status
        self.estimate, self.clock, self.run = "error_estimate" in names, "solve_time" in names, bool(names - {"status"})


@dataclass
class Row:
    """Row of a table: the columns of one case, while they are computed and when it is finished."""

    case: object  # CableCase or SuspensionCase
    # header -> number, None where the case has no such number and none is missing; of a finished row also where it has
    # no value, and `status`, a text
    cells: dict = field(default_factory=dict)
    # header -> CablestudyError of a column without a number, or name -> one that makes others doubtful
    failures: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)  # header -> estimated relative error, None where it is not known [-]
    notes: tuple = ()  # of str: on the model, and what it leaves out; shown only if asked for
    warnings: tuple = ()  # of str, shown to all users
    doubts: tuple = ()  # of str, see `status_of`
    dof: int = 0  # number of unknowns of the model

    def known_errors(self):
        """Yield the estimated errors of the cells, as a table of this one row has them."""
        yield {name: error for name, error in self.errors.items() if error is not None}

    @property
    def failed(self):
        """True if some column has no value."""
        return not has_answer(self.cells["status"])

    def table(self, columns, further_cells=()):
        """The row as a `Table` of some columns, further cells (pairs of `Field`, cell), and its status."""
        fields = (*(column.field for column in columns), *(field for field, _ in further_cells), STATUS)
        cells = self.cells | {field.name: cell for field, cell in further_cells}
        return Table(fields, [cells], single=True, errors=self.known_errors)

    def fail(self, columns, error):
        """Record an error as the failure of those columns that have no value yet."""
        for column in columns:
            if column.header not in self.cells:
                self.failures.setdefault(column.header, error)

    def compute(self, column, compute=value_and_error):
        """Compute a column, by default by `value_and_error`, with the stated error, or why there is no value."""
        if column.header in self.failures:
            return
        try:
            number, error = compute(column, self.case)
        except CablestudyError as failure:
            self.failures[column.header] = failure
            return
        self.cells[column.header] = number
        if error is not None:
            self.errors[column.header] = None if isnan(error) else float(error)

    def complete(self, required, seconds):
        """Add the cells without a value, those on the computation, with its time [s], and the status."""
        self.cells = {**required.empty, **self.cells}
        self.errors = {name: error for name, error in self.errors.items() if name not in self.failures}
        if required.run:
            errors_known = None not in self.errors.values() and (self.errors or not self.failures)
            run = {"dof": self.dof, "error_estimate": max(self.errors.values(), default=0.0) if errors_known else None}
            run["solve_time_ms"] = 1e3 * seconds if required.clock else None
            self.cells.update((header, number) for header, number in run.items() if header in self.cells)
        self.cells["status"] = status_of(self.failures, *self.doubts)
        self.failures = {}  # which would keep the models that have failed


class RowBatch(ABC):
    """Batch of scenes whose statics are solved together, and the rows of a table that they give.

    Subclasses for scenes of one cable and for suspensions implement the steps. `required` is the `TableColumns` of the
    table. `noted` is True if rows have notes.
    """

    def __init__(self, scenes, required, noted):
        self.scenes, self.required, self.noted = scenes, required, noted

    @abstractmethod
    def solve_statics(self):
        """Compute the statics of all scenes."""

    @abstractmethod
    def blocks(self, width):
        """Yield the rows in lists of at most `width`, by default of as many as memory and cache hold."""

    @abstractmethod
    def prepare(self, rows):
        """Compute in one call what the columns of some rows need first; return the rows that can be computed."""

    @abstractmethod
    def finish(self, row):
        """Add to a row with its columns why it is doubtful, the size of its model, and notes if `noted`."""

    def rows(self):
        """Yield the rows of all scenes, block by block.

        The columns are computed one after the other for all rows of a block: what the first row needs for a column is
        computed for all rows at once. The numbers are, to the last digit, those of each scene by itself.

        Yields
        ------
        Row
        """
        start = time.perf_counter()
        self.solve_statics()
        seconds_of_statics = (time.perf_counter() - start) / len(self.scenes)
        for rows in self.blocks(1 if self.required.clock else None):  # the time of each row is measured alone
            start = time.perf_counter()
            cases = [row.case for row in rows]
            for case in cases:
                case.together = cases
            solvable = self.prepare(rows)
            for column in self.required.computed:
                for row in solvable:
                    row.compute(column)
            for row in rows:
                self.finish(row)
            for case in cases:  # one that held itself would be kept until garbage is collected
                case.together = ()
            seconds = seconds_of_statics + (time.perf_counter() - start) / len(rows)
            for row in rows:
                row.complete(self.required, seconds)
                yield row


def batched(sequence, width):
    """Yield the pieces of a sequence that have at most `width` entries."""
    for start in range(0, len(sequence), width):
        yield sequence[start : start + width]
