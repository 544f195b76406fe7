"""Cases of a study that differ in plain numbers only: one scene whose varied numbers are arrays with an axis of cases.

So each key is read and checked once for all of them.
"""

import numpy as np
from pydantic_core import PydanticCustomError

from cablestudy.errors import SceneError
from cablestudy.scene.fields import KeyTable
from cablestudy.scene.layers import split_key
from cablestudy.scene.sampling import Sampled
from cablestudy.scene.scene import quantity_of
from cablestudy.study.column import attribute, lacking_error, lacking_key
from cablestudy.study.load_arrays import load_arrays, merged_loads
from cablestudy.study.stated_numbers import StatedNumbers

# names in keys of quantities that are no columns: a scene takes their sine, compares them one by one, or cables follow
NOT_COLUMNS = ("materials", "attitude", "forces", "moves", "stress_strain")
POSITIONS = ("at", "fraction")  # of point loads, which a scene compares with each other


class CaseTable(StatedNumbers):
    """Values of n cases of a study whose scenes differ only in numbers: one scene, whose varied numbers are arrays.

    Parameters
    ----------
    cases : ndarray, shape (n,)
        Number of each case in the study, from 0.
    scene : CableScene
        Stands for all cases; each varied number is an array, shape (n,), in SI, and so are the properties that follow.
    values : dict
        Dotted key that is varied -> its array, shape (n,).
    """

    def __init__(self, cases, scene, values):
        super().__init__([scene])
        self.cases, self.scene, self.values = cases, scene, values

    def __len__(self):
        return len(self.cases)

    def take(self, indices):
        """`CaseTable` of the cases at some indices, shape (m,)."""
        return self if len(indices) == len(self) else _table_of_cases(self.scene, self.cases, self.values, indices)

    def number(self, path):
        """A number of each case in SI, see `StatedNumbers.number`."""
        return self._array(attribute(self.scene, path))

    def _values_at(self, path):
        """Value of each case at a path with dots that no case varies: list."""
        return [attribute(self.scene, path)] * len(self)

    def lacking(self, column):
        """Cases that lack a key which a column needs, see `StatedNumbers.lacking`."""
        if not lacking_key(self.scene, column):
            return {}
        return dict.fromkeys(range(len(self)), lacking_error(self.scene, column))

    @property
    def ends(self):
        """Positions of both ends, see `StatedNumbers.ends`."""
        return self._arrays(self.scene.cable.end_1), self._arrays(self.scene.cable.end_2)

    def loads(self, of_case):
        """Point loads, see `StatedNumbers.loads`."""
        merged = merged_loads(self.scene.loads if of_case else self.scene.cable.loads)
        if not merged:
            return load_arrays([()] * len(self))
        positions, fractions, forces, masses = zip(*merged, strict=True)
        forces = np.stack([self._arrays(force) for force in forces], axis=1)
        return self._arrays(positions), self._arrays(fractions), forces, self._arrays(masses)

    def _arrays(self, values):
        """Some numbers of the scene for each case, shape (n, m)."""
        return np.stack([self._array(value) for value in values], axis=-1)

    def _array(self, value):
        """A number of the scene, or None, for each case, shape (n,)."""
        return np.broadcast_to(np.array(np.nan if value is None else value, dtype=float), (len(self),))

    def scene_of(self, index):
        """The scene of the case at an index into `cases`, numbers only."""
        return _with_values(self.scene, {key: float(values[index]) for key, values in self.values.items()})


def tables_of(study, cases):
    """Read many cases of a study, and combine those whose scenes differ only in numbers into tables of arrays.

    Cases share a table if they differ only in keys that are quantities (number and unit). Other varied keys, such as a
    material, divide the cases. A case that can share no table is read alone.

    Parameters
    ----------
    study : StudyFile
    cases : sequence of int
        From 0 to study.count - 1.

    Returns
    -------
    tables : list of CaseTable
        Each case with a valid scene is in one of them, with the numbers that `StudyFile.case` gives.
    refused : dict
        Case -> SceneError of each other one.
    """
    cases = np.asarray(cases, dtype=int)
    # step of each entry in each case, shape (cases, entries)
    steps = np.array(np.unravel_index(cases, [len(entry) for entry in study.entries] or [1])).T
    numeric_entries = [index for index, entry in enumerate(study.entries) if all(map(_is_column, entry.keys))]
    groups = np.unique(np.delete(steps, numeric_entries, axis=1), axis=0, return_inverse=True)[1].ravel()
    tables, remaining = [], []
    for group in range(groups.max(initial=-1) + 1):
        members = np.flatnonzero(groups == group)
        values = {}
        for index in numeric_entries:
            values |= _numbers(study.entries[index], steps[members, index])
        table = _table(study, cases[members], values) if len(members) > 1 and values else None
        tables += [table] if table else []
        remaining += np.setdiff1d(cases[members], table.cases if table else []).tolist()
    refused = {}
    for case in remaining:
        try:
            tables.append(CaseTable(np.array([case]), study.case(case)[1], {}))
        except SceneError as error:
            refused[case] = error
    return tables, refused


def _is_column(key):
    """True if a key is a quantity that can be an array in one scene for many cases."""
    path = split_key(key)
    is_position = "loads" in path and path[-1] in POSITIONS
    return quantity_of(key) is not None and not is_position and not set(path).intersection(NOT_COLUMNS)


def _numbers(entry, steps):
    """Dotted key -> values in SI at the steps of an entry; NaN where a value is invalid."""
    unique, inverse = np.unique(steps, return_inverse=True)
    numbers = {}
    for key, written, _ in entry.columns:
        read = quantity_of(key).read
        sampled = isinstance(written, Sampled)
        written_values = written.at(unique) if sampled else [written[step] for step in unique.tolist()]
        numbers[key] = np.array([_number(read, value) for value in written_values])[inverse]
    return numbers


def _number(read, written):
    """A value of the file in SI, read by a quantity's function; NaN where it is invalid."""
    try:
        value = read(written)
    except (PydanticCustomError, ValueError):
        return np.nan
    return value if isinstance(value, float) else np.nan


def _table(study, cases, values):
    """The table of the cases whose numbers are valid, each by itself and together; None when there is none."""
    valid = ~np.isnan(list(values.values())).any(axis=0)
    scene = _first_scene(study, cases[valid])
    if scene is None or not all(isinstance(scene.value_at(split_key(key)), float) for key in values):
        return None
    table = _table_of_cases(scene, cases, values, valid)
    valid_together = np.ones(len(table.cases), dtype=bool)
    with np.errstate(all="ignore"):  # of cases that another relation refuses, such as a distance of zero
        for table_of_keys in _tables_in(table.scene):
            for relations in table_of_keys.relations():
                for _, valid_relation, _ in relations:
                    valid_together &= valid_relation
    if valid_together.all():
        return table
    return _table_of_cases(scene, table.cases, table.values, valid_together) if valid_together.any() else None


def _first_scene(study, cases):
    """The scene of the first, the middle or the last of some cases; None when all three are wrong."""
    for case in cases[[0, len(cases) // 2, -1]].tolist() if len(cases) else ():
        try:
            return study.case(case)[1]
        except SceneError:
            continue
    return None


def _table_of_cases(scene, cases, values, chosen):
    """The `CaseTable` of some cases: `chosen` are their indices, or a mask."""
    values = {key: numbers[chosen] for key, numbers in values.items()}
    return CaseTable(cases[chosen], _with_values(scene, values), values)


def _with_values(scene, values):
    """Copy of a scene with new numbers at some dotted keys."""
    for key, value in values.items():
        scene = scene.with_value(split_key(key), value)
    return scene


def _tables_in(table):
    """A table and all tables in it."""
    yield table
    for value in table.__dict__.values():
        for inner in value if isinstance(value, tuple) else value.values() if isinstance(value, dict) else (value,):
            if isinstance(inner, KeyTable):
                yield from _tables_in(inner)
