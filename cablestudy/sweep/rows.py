"""The table of a sweep: its rows stay on disk and are read in the order of the study."""

import csv
import io
import json
from collections.abc import Sequence
from functools import lru_cache
from itertools import islice, product

from cablestudy.study.fields import beside, fields_of
from cablestudy.study.table import Table, exact
from cablestudy.sweep.record import OK

CACHED_STEPS = 100_000  # of what varies, whose text in the CSV is kept: more than any grid has along one axis


class Rows(Sequence):
    """The rows of a table.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        Printed values, from `prepare`.
    store : RowStore
        With every one of the cases.
    cases : range
        From 0.
    """

    def __init__(self, study, columns, reference, store, cases):
        self._study, self._columns, self._reference = study, columns, reference
        self._store, self._cases = store, cases

    def __len__(self):
        return len(self._cases)

    def __getitem__(self, place):
        if isinstance(place, slice):
            return Rows(self._study, self._columns, self._reference, self._store, self._cases[place])
        return self._row(self._store.row(self._cases[place]))

    def __iter__(self):
        yield from map(self._row, self._records())

    def _records(self):
        if self._cases.step == 1:
            return self._store.read(self._cases)
        return map(self._store.row, self._cases)

    def _row(self, record):
        cells = {**dict(zip(self._store.headers, record.cells, strict=True)), "status": record.status}
        return {
            **written(self._study.overrides(record.case)),
            **cells,
            **_printed(cells, self._reference, record.case),
        }

    def errors(self, places=None):
        """Yield the estimated error of each cell that has one, of all rows or of some: header -> number."""
        records = self._records() if places is None else (self._store.row(self._cases[place]) for place in places)
        rounding = {c.header: c.least_error for c in self._columns if c.least_error is not None}
        for record in records:
            cells = dict(zip(self._store.headers, record.cells, strict=True))
            errors = {header: record.errors.get(header, error) for header, error in rounding.items()}
            yield {
                header: errors[header]
                for header in cells
                if cells[header] is not None and errors.get(header) is not None
            }

    def csv_lines(self, names):
        """The lines of the CSV below its head; stored numbers are copied as text, which a million rows need.

        Parameters
        ----------
        names : list of str
            Of the table's columns.

        Returns
        -------
        iterator of str, or None
            None if the columns are others than those that vary, those stored, and the status.
        """
        headers = self._store.headers
        varied = names[: len(names) - len(headers) - 1]
        shown = [key for key in self._study.varied if key in varied]
        return self._copied(set(varied)) if names == [*shown, *headers, "status"] and self._cases.step == 1 else None

    def _copied(self, varied):
        entries = [[(key, values) for key, values, _ in e.columns if key in varied] for e in self._study.entries]
        varying = [number for number, columns in enumerate(entries) if columns]

        @lru_cache(CACHED_STEPS)
        def varied_text(number, step):
            plain = written({key: values[step] for key, values in entries[number]})
            return _csv_text([*map(exact, plain.values()), ""])

        steps = product(*(range(len(entry)) for entry in self._study.entries))
        texts = self._store.read_texts(self._cases)
        comma = "," if self._store.headers else ""
        for case_steps, (status, cells) in zip(islice(steps, self._cases.start, None), texts, strict=False):
            before = "".join([varied_text(number, case_steps[number]) for number in varying])
            numbers = cells[1:-1].replace("null", "")
            yield f"{before}{numbers}{comma}{status if status == OK else _csv_text([status])}\n"


def table_of(study, columns, reference, store, cases):
    """The table of cases that are in a store.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        Printed values, from `prepare`.
    store : RowStore
    cases : range
        From 0.

    Returns
    -------
    Table
    """
    rows = Rows(study, columns, reference, store, cases)
    return Table(fields_of(study, columns, reference[0]), rows, errors=rows.errors)


def written(overrides):
    """What varies, as the user wrote it: numbers and text, and JSON of anything else.

    Parameters
    ----------
    overrides : dict
        As from `Study.overrides`.

    Returns
    -------
    dict
    """
    plain = {}
    for key, value in overrides.items():
        number_or_text = isinstance(value, (str, int, float)) and not isinstance(value, bool)
        plain[key] = value if number_or_text else json.dumps(value, ensure_ascii=False)
    return plain


def _csv_text(cells):
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(list(cells))
    return line.getvalue()


def _printed(cells, reference, place):
    names, rows = reference
    added = {}
    for name in names:
        printed, computed = rows[place][name], cells[name]
        added[beside(name, "printed")] = printed
        known = printed is not None and computed is not None
        difference = computed - printed if known else None
        if known and abs(difference) < 1e-12 * abs(printed):
            difference = 0.0
        added[beside(name, "difference")] = difference
    return added
