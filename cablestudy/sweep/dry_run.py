"""sweep --dry-run: the table of the cases of a study; nothing is computed or written."""

from collections.abc import Sequence

from cablestudy.study.table import Field, Table
from cablestudy.sweep.rows import written


def cases_table(study):
    """The table of the cases: their numbers and what varies.

    Parameters
    ----------
    study : Study

    Returns
    -------
    Table
        Its rows are built when they are asked for.
    """
    names = ("case", *study.varied)
    return Table(tuple(Field(name, name) for name in names), CaseRows(study, range(study.count)))


class CaseRows(Sequence):
    """Rows of some cases.

    Parameters
    ----------
    study : Study
    cases : range
        From 0.
    """

    def __init__(self, study, cases):
        self._study, self._cases = study, cases

    def __len__(self):
        return len(self._cases)

    def __getitem__(self, place):
        if isinstance(place, slice):
            return CaseRows(self._study, self._cases[place])
        case = self._cases[place]
        return {"case": case + 1, **written(self._study.overrides(case))}
