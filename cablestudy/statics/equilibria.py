"""Cache of equilibria: equal load cases, of one search or of searches one after the other, are solved once."""

import numpy as np

from cablestudy.statics import rest
from cablestudy.statics.tolerances import STATICS

# of each of the latest searches: what its cases share, {key of each case: its row}, Equilibrium; see
# SuspendedSystem.identity. They change no digit: no case depends on others that are solved with it
_searches = []


def forget():
    """Forget all equilibria: for measurements of time."""
    _searches.clear()


def pose(suspension):
    """`Equilibrium` of each load case by `rest.pose`, or from the cache; equal cases are solved once.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,). Cases of any other shape are solved without the cache.

    Raises
    ------
    NoSolutionError
        As `rest.pose`.
    """
    if len(suspension.shape) != 1:
        return rest.pose(suspension)
    common, keys = suspension.identity  # data that all cases share, and what tells each case from the others
    rows, equilibrium = _found_earlier(common, set(keys)) or _solve(common, keys, suspension)
    row_of_case = [rows[key] for key in keys]
    return equilibrium if row_of_case == list(range(len(rows))) else equilibrium.take(np.array(row_of_case))


def _found_earlier(common, keys):
    """Rows by key and `Equilibrium` of a search that had all of these cases; None without one."""
    for common_of_search, rows, equilibrium in _searches:
        if common_of_search == common and keys <= rows.keys():
            return rows, equilibrium
    return None


def _solve(common, keys, suspension):
    """Rows by key and `Equilibrium` of a new search, which is remembered, and as many of those before as fit."""
    first_case = dict(zip(reversed(keys), range(len(keys) - 1, -1, -1), strict=True))
    cases = sorted(first_case.values())
    equilibrium = rest.pose(suspension if len(cases) == len(keys) else suspension.take(np.array(cases)))
    rows = {keys[case]: row for row, case in enumerate(cases)}
    _searches.insert(0, (common, rows, equilibrium))
    room = np.cumsum([of_search.lengths.size for _, _, of_search in _searches])
    del _searches[np.searchsorted(room, STATICS.remembered_cables, side="right") :]
    return rows, equilibrium
