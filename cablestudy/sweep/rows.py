"""The table of a sweep: rows that stay on disk, in the order of the study."""

import json
from collections.abc import Sequence

from cablestudy.study.fields import beside, fields_of
from cablestudy.study.table import Table


class Rows(Sequence):
    """The rows of a table, read from the journal one by one and put into the order of the study.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        From `reference_of`.
    journal : Journal
        With every one of the cases.
    cases : range
        From 0.
    """

    def __init__(self, study, columns, reference, journal, cases):
        self._study, self._columns, self._reference = study, columns, reference
        self._journal, self._cases = journal, cases

    def __len__(self):
        return len(self._cases)

    def __getitem__(self, place):
        if isinstance(place, slice):
            return Rows(self._study, self._columns, self._reference, self._journal, self._cases[place])
        case = self._cases[place]
        cells = self._journal.cells(case)
        return {**written(self._study.overrides(case)), **cells, **_printed(cells, self._reference, case)}

    def errors(self, places=None):
        """Yield the estimated error of each cell that has one, of all rows or of some: header -> number."""
        for case in self._cases if places is None else (self._cases[place] for place in places):
            row = self._journal.row(case)
            known, cells = row.get("errors") or {}, row["cells"]
            there = [c for c in self._columns if c.least_error is not None and cells[c.header] is not None]
            errors = {c.header: known.get(c.header, c.least_error) for c in there}
            yield {header: error for header, error in errors.items() if error is not None}


def table_of(study, columns, reference, journal, cases):
    """The table of cases that are in a journal.

    Parameters
    ----------
    study : Study
    columns : list of Column
    reference : tuple
        From `reference_of`.
    journal : Journal
    cases : range
        From 0.

    Returns
    -------
    Table
    """
    rows = Rows(study, columns, reference, journal, cases)
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
