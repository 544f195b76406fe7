"""Equilibria that several load cases, or searches one after the other, share: each is found once."""

import numpy as np

from cablestudy.system import statics
from cablestudy.system.tolerances import SYSTEM


class Equilibria:
    """Equilibria that were found last. No digit of a case depends on those that it was solved with."""

    def __init__(self):
        self.forget()

    def forget(self):
        """Keep none of them: for measurements of time."""
        self._found = []  # of each: what its cases share, row of each case by its numbers, Equilibrium

    def pose(self, suspension):
        """`statics.pose` of cases with axes of any number; of one axis each row of numbers is solved once.

        Parameters
        ----------
        suspension : SuspendedSystem

        Returns
        -------
        Equilibrium

        Raises
        ------
        NoSolutionError
            As `statics.pose`.
        """
        if len(suspension.shape) != 1:
            return statics.pose(suspension)
        common, keys = suspension.identity
        rows, equilibrium = self._known(common, set(keys)) or self._new(common, keys, suspension)
        chosen = [rows[key] for key in keys]
        return equilibrium if chosen == list(range(len(rows))) else equilibrium.take(np.array(chosen))

    def _known(self, common, keys):
        """Rows and `Equilibrium` of a search that had all of these cases; None without one."""
        return next(
            ((rows, found) for kind, rows, found in self._found if kind == common and keys <= rows.keys()), None
        )

    def _new(self, common, keys, suspension):
        """The same of a new search, which is kept, as are those before as far as there is room."""
        first = dict(zip(reversed(keys), range(len(keys) - 1, -1, -1), strict=True))
        places = sorted(first.values())
        equilibrium = statics.pose(suspension if len(places) == len(keys) else suspension.take(np.array(places)))
        rows = {keys[place]: row for row, place in enumerate(places)}
        room, kept = SYSTEM.remembered_cables, []
        for one in [(common, rows, equilibrium), *self._found]:
            room -= one[2].lengths.size
            if room < 0:
                break
            kept.append(one)
        self._found = kept
        return rows, equilibrium


shared = Equilibria()
pose = shared.pose
