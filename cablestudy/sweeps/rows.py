"""The table of a sweep: its rows stay on disk and are read in the order of the study."""

import json
from collections.abc import Sequence
from functools import lru_cache
from itertools import islice, product

import numpy as np

from cablestudy.study.cable_columns import TEXTS
from cablestudy.study.prepare import fields_of, reference_header
from cablestudy.study.table import Field, Table, csv_line, exact
from cablestudy.study.table_rows import OK
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.tolerances import SWEEPS

OK_LINE = f"{OK}\n"


class LazyRows(Sequence):
    """Rows that are made when they are asked for, each by `row_at` of an index: its case, or its row in a table."""

    def __init__(self, indices, row_at):
        self.indices, self._row_at = indices, row_at

    def __len__(self):
        return len(self.indices)

    def __getitem__(self, number):
        if isinstance(number, slice):
            return LazyRows(self.indices[number], self._row_at)
        return self._row_at(self.indices[number])


class Rows(LazyRows):
    """The rows of a study's table, read from a `RowStore`.

    `columns` (list of Column) and `reference` are from `prepare`; `cases` is a range of numbers from 0.
    """

    def __init__(self, study, columns, reference, store, cases):
        super().__init__(cases, lambda case: self._row(store.row(case)))
        self._study, self._columns, self._reference = study, columns, reference
        self._store, self._cases = store, cases
        self._varied = {varied.key: varied for varied in varied_keys(study)}
        self._texts = TEXTS.intersection(store.headers)

    def __iter__(self):
        return map(self._row, self._store.read(self._cases))

    def _row(self, record):
        """The row of a RowRecord: header -> cell, of varied keys, computed columns and printed values."""
        cells = {**dict(zip(self._store.headers, record.cells, strict=True)), "status": record.status}
        varied = varied_cells(self._varied.values(), self._study.overrides(record.case))
        return {**varied, **cells, **_printed(cells, self._reference, record.case)}

    def errors(self, indices=None):
        """Yield the estimated error of each cell that has one, of all rows or of some: header -> number."""
        least_errors = {c.header: c.least_error for c in self._columns if c.least_error is not None}
        chosen = (self._store.row(self._cases[index]) for index in indices or ())
        for record in self._store.read(self._cases) if indices is None else chosen:
            errors = {header: record.errors.get(header, error) for header, error in least_errors.items()}
            cells = zip(self._store.headers, record.cells, strict=True)
            yield {name: errors[name] for name, cell in cells if cell is not None and errors.get(name) is not None}

    def frame(self):
        """All rows as a pandas.DataFrame.

        Its columns are the computed ones, the status, the varied keys, then printed values (of a publication, with
        which results are compared) and the differences from them. Numbers are floats, NaN in empty cells; other values
        are text.
        """
        import pandas

        stored = list(self._store.read_texts(self._cases))
        cells_of_rows = json.loads(f"[{','.join([cells for _, cells in stored])}]")
        frame = pandas.DataFrame(cells_of_rows, columns=self._store.headers, dtype=object if self._texts else float)
        if self._texts:
            frame = frame.astype(dict.fromkeys(frame.columns.difference(self._texts), float))
        frame["status"] = [status for status, _ in stored]
        # a study is a grid: each of its entries takes its steps, and each case is one combination of steps
        steps_of_entries = np.unravel_index(self._cases, [len(entry) for entry in self._study.entries] or [1])
        for entry, steps in zip(self._study.entries, steps_of_entries, strict=False):
            unique_steps, inverse = np.unique(steps, return_inverse=True)  # a cell is made once for each step
            for key, values, _ in entry.columns:
                varied = self._varied[key]
                cells = [varied.cell(values[step]) for step in unique_steps.tolist()]
                frame[varied.header] = np.array(cells, dtype=object if varied.text else float)[inverse]
        if names := self._reference[0]:
            computed = zip(self._cases, frame[names].to_dict("records"), strict=True)
            printed = [_printed(cells, self._reference, case) for case, cells in computed]
            frame = frame.join(pandas.DataFrame(printed, dtype=float))
        return frame

    def csv_lines(self, names):
        """Iterator of the lines of the CSV below its head, in which stored numbers are copied as text: fast.

        None unless the columns `names` are varied keys, then all stored ones, and these are numbers.
        """
        stored = [*self._store.headers, "status"]
        varied, others = names[: -len(stored)], names[-len(stored) :]
        in_order = varied == [key.header for key in self._varied.values() if key.header in varied]
        return self._copied_lines(set(varied)) if others == stored and in_order and not self._texts else None

    def _copied_lines(self, varied_headers):
        """Yield lines of the CSV file: cells of the varied keys with these headers, stored numbers, status.

        Stored rows are JSON lists of numbers. Without brackets and `null` their text is part of a CSV line. To copy the
        text is much faster than to read and write the numbers.
        """
        columns_of_entries = []  # of each entry: (VariedKey, its values) of the keys shown
        for entry in self._study.entries:
            columns = [(self._varied[key], values) for key, values, _ in entry.columns]
            columns_of_entries.append([column for column in columns if column[0].header in varied_headers])
        shown_entries = [number for number, columns in enumerate(columns_of_entries) if columns]

        @lru_cache(SWEEPS.cached_steps)
        def varied_text(number, step):
            cells = [exact(varied.cell(values[step])) for varied, values in columns_of_entries[number]]
            return csv_line([*cells, ""])[:-1]  # ends with a comma

        steps_of_cases = product(*(range(len(entry)) for entry in self._study.entries))
        stored = self._store.read_texts(self._cases)
        comma = "," if self._store.headers else ""
        for steps, (status, cells) in zip(islice(steps_of_cases, self._cases.start, None), stored, strict=False):
            beginning = "".join([varied_text(number, steps[number]) for number in shown_entries])
            numbers = cells[1:-1].replace("null", "")
            yield f"{beginning}{numbers}{comma}{OK_LINE if status == OK else csv_line([status])}"


def table_of(study, columns, reference, store, cases):
    """The table of cases that are in a store; parameters are those of `Rows`."""
    rows, fields = Rows(study, columns, reference, store, cases), fields_of(study, columns, reference[0])
    return Table(fields, rows, more=more_fields(study, fields), errors=rows.errors)


def more_fields(study, fields):
    """The fields of the varied keys that a table does not show, since one of its columns does."""
    return tuple(varied.field for varied in varied_keys(study) if varied.field not in fields)


def cases_table(study):
    """The table of what varies in each row of a study, for `sweep --dry-run`: nothing is computed or written."""
    keys = varied_keys(study)

    def row_at(case):
        return {"row": case + 1, **varied_cells(keys, study.overrides(case))}

    fields = (Field("row", "row"), *(varied.field for varied in keys))
    return Table(fields, LazyRows(range(study.count), row_at))


def varied_cells(keys, overrides):
    """Header -> cell of some VariedKey in a case: dict, from `StudyFile.overrides`."""
    return {varied.header: varied.cell(overrides[varied.key]) for varied in keys}


def _printed(cells, reference, case):
    """Cells of the printed values of a case, and of the differences of the computed ones, `cells`, from them: dict."""
    names, rows = reference
    added = {}
    for name in names:
        printed, computed = rows[case][name], cells[name]
        difference = None if printed is None or computed is None else computed - printed
        if difference is not None and abs(difference) < SWEEPS.rounding * abs(printed):
            difference = 0.0
        added |= {reference_header(name, "printed"): printed, reference_header(name, "difference"): difference}
    return added
