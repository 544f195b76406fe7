"""Numbers that many scenes of one cable state, as arrays with an axis of scenes."""

from functools import cached_property

import numpy as np

from cablestudy.study.column import is_absent, lacking_error
from cablestudy.study.load_arrays import load_arrays


class StatedNumbers:
    """Values of n scenes of one cable as arrays with an axis of scenes. All have point loads at equally many places."""

    def __init__(self, scenes):
        self.scenes, self._numbers, self._values = scenes, {}, {"": scenes}

    def __len__(self):
        return len(self.scenes)

    def take(self, indices):
        """`StatedNumbers` of the scenes at some indices, shape (m,)."""
        return StatedNumbers([self.scenes[index] for index in indices.tolist()])

    def number(self, path):
        """A number of each scene, like `cable.section_area`, in SI; NaN where there is none: shape (n,)."""
        if path not in self._numbers:
            self._numbers[path] = np.array(self._values_at(path), dtype=float)
        return self._numbers[path]

    def _values_at(self, path):
        """Value of each scene at a path with dots, None where part of the path is missing: list."""
        if path not in self._values:
            parent, _, name = path.rpartition(".")
            tables = self._values_at(parent)
            values = [table.get(name) if isinstance(table, dict) else getattr(table, name, None) for table in tables]
            self._values[path] = values
        return self._values[path]

    def words(self, path):
        """A word of each scene, like `cable.tension.at`; empty where there is none: ndarray of str, shape (n,)."""
        return np.array([word or "" for word in self._values_at(path)])

    def lacking(self, column):
        """Case -> NoSolutionError, of the cases that lack a key which a column needs."""
        cases = set()
        for key in column.keys:
            cases |= set.intersection(*map(self._without, key.split("|")))
        return {case: lacking_error(self.scenes[case], column) for case in sorted(cases)}

    def _without(self, path):
        """Cases without a value at a path: set of int."""
        return {case for case, value in enumerate(self._values_at(path)) if is_absent(value)}

    @cached_property
    def ends(self):
        """Positions of end 1 and end 2, each of shape (n, 3). [m]"""
        return np.array(self._values_at("cable.end_1")), np.array(self._values_at("cable.end_2"))

    @cached_property
    def moves(self):
        """Displacements of end 1 and end 2 by the load cases, shape (n, 2, 3). [m]"""
        return np.stack([self._values_at(f"load_case.moves.{end}") for end in ("end_1", "end_2")], axis=1)

    @cached_property
    def push(self):
        """Forces of the load cases on end 2 along x, shape (n,). [N]"""
        return np.array(self._values_at("load_case.forces.end_2"))[:, 0]

    @property
    def grounds(self):
        """Ground of each scene: list of n."""
        return self._values_at("ground")

    def loads(self, of_case):
        """Point loads of the cables, with `of_case` also those of their load cases; see `load_arrays`."""
        return load_arrays(self._values_at("loads" if of_case else "cable.loads"))
