"""Rows with equal numbers of everything, whose arrays are computed in one call."""

from cablestudy.study.tolerances import STUDY


def together(rows, numbers, size):
    """Yield lists of rows that are computed in one call, each row once.

    Parameters
    ----------
    rows : iterable
        Objects, some perhaps more than once: rows of a table may share one.
    numbers : callable
        Row -> what rows of one list have in common.
    size : callable
        Row -> size of its square matrices, which bounds how many rows memory holds at once.
    """
    found = {}
    for row in dict.fromkeys(rows):
        found.setdefault(numbers(row), []).append(row)
    for members in found.values():
        at_once = max(1, STUDY.entries_at_once // max(1, size(members[0])) ** 2)
        for begin in range(0, len(members), at_once):
            yield members[begin : begin + at_once]
