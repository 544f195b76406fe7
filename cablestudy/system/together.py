"""Rows that are computed in one call: those with arrays of equal sizes, and attributes of many rows."""

from cablestudy.errors import result_of
from cablestudy.system.tolerances import SYSTEM


def batches(rows, key, size):
    """Yield lists of rows with equal keys that are computed in one call, each row once.

    Parameters
    ----------
    rows : iterable
        Objects, some perhaps more than once: rows of a table may share one.
    key : callable
        Row -> what rows of one list have in common.
    size : callable
        Row -> size of its square matrices, which bounds how many rows memory holds at once.
    """
    found = {}
    for row in dict.fromkeys(rows):
        found.setdefault(key(row), []).append(row)
    for members in found.values():
        at_once = max(1, SYSTEM.entries_at_once // max(1, size(members[0])) ** 2)
        for begin in range(0, len(members), at_once):
            yield members[begin : begin + at_once]


class computed_together:  # noqa: N801 a decorator, as functools.cached_property
    """Decorator: attribute of a row that is computed for many rows in one call, and kept in each.

    Asked for, it is computed for its row, with all rows of the list `together` of that row if it has one that is not
    empty. An error in place of a value is raised whenever it is asked for.

    Parameters
    ----------
    function : callable
        List of rows that lack the attribute, each once -> iterable of pairs: row, value or error. Its docstring is that
        of the attribute.
    """

    def __init__(self, function):
        self._function, self.__doc__ = function, function.__doc__

    def __set_name__(self, owner, name):
        self._name = name

    def __get__(self, row, owner=None):
        if row is None:
            return self
        if self._name not in row.__dict__:
            self.compute(getattr(row, "together", ()) or [row])
        return result_of(row.__dict__[self._name])

    def __set__(self, row, value):
        row.__dict__[self._name] = value

    def compute(self, rows):
        """Compute the attribute of those of some rows that lack it."""
        waiting = list(dict.fromkeys(row for row in rows if self._name not in row.__dict__))
        for row, value in self._function(waiting) if waiting else ():
            row.__dict__[self._name] = value

    def known(self, row):
        """Value of a row, or the error in its place; None where it was not computed."""
        return row.__dict__.get(self._name)
