"""Cache of equilibria: equal load cases, of one search or of searches one after the other, are solved once."""

import numpy as np

from cablestudy.statics import rest
from cablestudy.statics.tolerances import STATICS


class Equilibria:
    """Cache of the results of the latest searches. It changes no digit: no case depends on others solved with it."""

    def __init__(self):
        self.forget()

    def forget(self):
        """Keep none of them: for measurements of time."""
        # of each search: what its cases share, {key of each case: its row}, Equilibrium; see SuspendedSystem.identity
        self._searches = []

    def pose(self, suspension):
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
        rows, equilibrium = self._remembered(common, set(keys)) or self._solve(common, keys, suspension)
        row_of_case = [rows[key] for key in keys]
        return equilibrium if row_of_case == list(range(len(rows))) else equilibrium.take(np.array(row_of_case))

    def _remembered(self, common, keys):
        """Rows by key and `Equilibrium` of a search that had all of these cases; None without one."""
        for common_of_search, rows, equilibrium in self._searches:
            if common_of_search == common and keys <= rows.keys():
                return rows, equilibrium
        return None

    def _solve(self, common, keys, suspension):
        """Rows by key and `Equilibrium` of a new search, which is remembered, and as many of those before as fit."""
        first_case = dict(zip(reversed(keys), range(len(keys) - 1, -1, -1), strict=True))
        cases = sorted(first_case.values())
        equilibrium = rest.pose(suspension if len(cases) == len(keys) else suspension.take(np.array(cases)))
        rows = {keys[case]: row for row, case in enumerate(cases)}
        room, remembered = STATICS.remembered_cables, []
        for search in [(common, rows, equilibrium), *self._searches]:
            room -= search[2].lengths.size
            if room < 0:
                break
            remembered.append(search)
        self._searches = remembered
        return rows, equilibrium


shared = Equilibria()
pose = shared.pose
