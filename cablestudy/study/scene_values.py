"""Values of many scenes as arrays with an axis of cases, and the tables of cases that a study describes.

Cases that differ in plain numbers only are one scene whose varied numbers are arrays: each key is read and checked once
for all of them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydantic_core import PydanticCustomError

from cablestudy.errors import SceneError
from cablestudy.scene.fields import KeyTable
from cablestudy.scene.layers import split_key
from cablestudy.scene.sampling import Sampled
from cablestudy.scene.scene import CableScene, quantity_of
from cablestudy.study.columns import attribute, lacks, without

# names in keys of quantities that are no columns: a scene takes their sine, compares them one by one, or cables follow
NOT_COLUMNS = ("materials", "inclination", "attitude", "ends", "loads", "forces", "moves", "stress_strain")
NO_LOAD = np.nan, np.nan, (0.0, 0.0, 0.0), 0.0  # in the place of one of `merged_loads`


class SceneValues:
    """Values of scenes whose cables carry loads at equally many places."""

    def __init__(self, scenes):
        self.scenes, self._found, self._known = scenes, {}, {}

    def __len__(self):
        return len(self.scenes)

    def take(self, places):
        """Those of some scenes, by their indices, shape (m,)."""
        return SceneValues([self.scenes[place] for place in places.tolist()])

    def given(self, path):
        """A number of each scene, like `cable.section_area`, in SI; NaN where there is none: shape (n,)."""
        if path not in self._known:
            self._known[path] = np.array(self._at(path), dtype=float)
        return self._known[path]

    def _at(self, path):
        """What each scene has at a path with dots: list. The tables on the way are looked up once for all keys."""
        if path not in self._found:
            table, _, name = path.rpartition(".")
            self._found[path] = [getattr(one, name, None) for one in (self._at(table) if table else self.scenes)]
        return self._found[path]

    def words(self, path):
        """A word of each scene, like `cable.tension.at`; empty where there is none: ndarray of str, shape (n,)."""
        return np.array([word or "" for word in self._at(path)])

    def lacking(self, column):
        """Case -> NoSolutionError, of the cases that lack a key which a column needs."""
        if not column.keys:
            return {}
        return {case: without(scene, column) for case, scene in enumerate(self.scenes) if lacks(scene, column)}

    @cached_property
    def ends(self):
        """Places of end 1 and end 2, each of shape (n, 3). [m]"""
        return np.array(self._at("cable.end_1")), np.array(self._at("cable.end_2"))

    @cached_property
    def moves(self):
        """Displacements of end 1 and end 2 by the load cases, shape (n, 2, 3). [m]"""
        return np.stack([np.array(self._at(f"load_case.moves.{end}")) for end in ("end_1", "end_2")], axis=1)

    @cached_property
    def push(self):
        """Forces of the load cases on end 2 along x, shape (n,). [N]"""
        return np.array(self._at("load_case.forces.end_2"))[:, 0]

    @property
    def grounds(self):
        """Ground of each scene: list of n."""
        return self._at("ground")

    def loads(self, of_case):
        """Point loads of the cables themselves, `of_case` with those of their chosen cases; see `load_arrays`."""
        return load_arrays(self._at("loads" if of_case else "cable.loads"))


def load_arrays(listed):
    """Point loads of n cables as arrays, those at one place added, as many for each as for the one with the most.

    Parameters
    ----------
    listed : list of tuple of Load

    Returns
    -------
    positions, fractions : ndarray, shape (n, k)
        Arc length on the unstretched cable [m], or share of it [-]; the other one is NaN, both where there is no load.
    forces : ndarray, shape (n, k, 3)
        Global, without the weight of masses. [N]
    masses : ndarray, shape (n, k)
        [kg]
    """
    if not any(listed):
        return tuple(np.zeros((len(listed), 0, *size)) for size in ((), (), (3,), ()))
    merged = [merged_loads(loads) for loads in listed]
    count = max(map(len, merged), default=0)
    merged = [loads + [NO_LOAD] * (count - len(loads)) for loads in merged]
    return tuple(np.array([[load[part] for load in loads] for loads in merged]).reshape(len(listed), count, *size)
                 for part, size in ((0, ()), (1, ()), (2, (3,)), (3, ())))  # fmt: skip


def merged_loads(loads):
    """(position, fraction, force, mass) of point loads, those at one place added, ascending from end 1."""
    found = {}
    for load in loads:
        place = np.nan if load.at is None else load.at, np.nan if load.fraction is None else load.fraction
        key = load.at, load.fraction
        force, mass = np.array((0.0, 0.0, 0.0) if load.force is None else load.force), load.mass or 0.0
        if key in found:
            force, mass = found[key][2] + force, found[key][3] + mass
        found[key] = (*place, force, mass)
    return sorted(found.values(), key=lambda load: load[:2])


def load_count(scene):
    """At how many places the cable of a scene carries loads, alone and with its case: two numbers. [-]"""
    return places_of(scene.cable.loads), places_of(scene.loads)


def places_of(loads):
    """At how many places point loads are. [-]"""
    return len({(load.at, load.fraction) for load in loads}) if loads else 0


# ------------------------------------------------------------------------------------------------- cases of a study


@dataclass(frozen=True)
class CaseTable:
    """Cases of a study that differ in plain numbers only; their values as of `SceneValues`."""

    cases: np.ndarray  # their numbers, from 0, shape (n,)
    scene: CableScene  # what they share; each varied number is an array, shape (n,), in SI, and so are its properties
    values: dict  # dotted key -> that array

    def __len__(self):
        return len(self.cases)

    def take(self, places):
        """Those of some cases, by their indices, shape (m,)."""
        return self if len(places) == len(self) else _chosen(self.scene, self.cases, self.values, places)

    def given(self, path):
        """A number of each case in SI, see `SceneValues.given`."""
        return self._array(attribute(self.scene, path))

    def words(self, path):
        """A word of each case, see `SceneValues.words`."""
        return np.array([attribute(self.scene, path) or ""] * len(self))

    def lacking(self, column):
        """Cases that lack a key which a column needs, see `SceneValues.lacking`."""
        return dict.fromkeys(range(len(self)), without(self.scene, column)) if lacks(self.scene, column) else {}

    @property
    def ends(self):
        """Places of both ends, see `SceneValues.ends`."""
        cable = self.scene.cable
        return tuple(np.stack([self._array(place) for place in end], axis=-1) for end in (cable.end_1, cable.end_2))

    @property
    def moves(self):
        """Displacements of both ends by the load cases, see `SceneValues.moves`."""
        return np.repeat(SceneValues([self.scene]).moves, len(self), axis=0)

    @property
    def push(self):
        """Forces of the load cases on end 2 along x, see `SceneValues.push`."""
        return np.repeat(SceneValues([self.scene]).push, len(self))

    @property
    def grounds(self):
        """Ground of each case, see `SceneValues.grounds`."""
        return [self.scene.ground] * len(self)

    def loads(self, of_case):
        """Point loads, see `SceneValues.loads`."""
        return tuple(np.repeat(part, len(self), axis=0) for part in SceneValues([self.scene]).loads(of_case))

    def _array(self, value):
        return np.broadcast_to(np.array(np.nan if value is None else value, dtype=float), (len(self),))

    def scene_of(self, place):
        """The scene of the case at an index into `cases`, numbers only."""
        return _with_values(self.scene, {key: float(values[place]) for key, values in self.values.items()})


def tables_of(study, cases):
    """Read many cases of a study.

    Cases share a table when they differ only in keys that are quantities. What the study varies beside them (a
    material, a mapping, a gain that is sometimes `auto`) divides the cases; a case unlike all others is read alone.

    Parameters
    ----------
    study : StudyFile
    cases : sequence of int
        From 0 to study.count - 1.

    Returns
    -------
    tables : list of CaseTable
        Each case with a valid scene once, with the same numbers as `study.case` gives.
    refused : dict
        Case -> SceneError of each other one.
    """
    cases = np.asarray(cases, dtype=int)
    steps = np.array(np.unravel_index(cases, [len(entry) for entry in study.entries] or [1])).T
    numeric = [place for place, entry in enumerate(study.entries) if all(map(_is_column, entry.keys))]
    groups = np.unique(np.delete(steps, numeric, axis=1), axis=0, return_inverse=True)[1].ravel()
    tables, alone = [], []
    for group in range(groups.max(initial=-1) + 1):
        here = np.flatnonzero(groups == group)
        values = {}
        for place in numeric:
            values |= _numbers(study.entries[place], steps[here, place])
        table = _table(study, cases[here], values) if len(here) > 1 and values else None
        tables += [table] if table else []
        alone += np.setdiff1d(cases[here], table.cases if table else []).tolist()
    refused = {}
    for case in alone:
        try:
            tables.append(CaseTable(np.array([case]), study.case(case)[1], {}))
        except SceneError as error:
            refused[case] = error
    return tables, refused


def _is_column(key):
    return quantity_of(key) is not None and not set(split_key(key)).intersection(NOT_COLUMNS)


def _numbers(entry, steps):
    """Dotted key -> values in SI at the steps of an entry; not a number where a value is none."""
    unique, place = np.unique(steps, return_inverse=True)
    found = {}
    for key, written, _ in entry.columns:
        read = quantity_of(key).read
        chosen = written.at(unique) if isinstance(written, Sampled) else [written[step] for step in unique.tolist()]
        found[key] = np.array([_number(read, value) for value in chosen])[place]
    return found


def _number(read, written):
    try:
        value = read(written)
    except (PydanticCustomError, ValueError):
        return np.nan
    return value if isinstance(value, float) else np.nan


def _table(study, cases, values):
    """The table of the cases whose numbers are valid, alone and together; None when there is none."""
    valid = ~np.isnan(list(values.values())).any(axis=0)
    scene = _first_scene(study, cases[valid])
    if scene is None or not all(isinstance(scene.value_at(split_key(key)), float) for key in values):
        return None
    table = _chosen(scene, cases, values, valid)
    holds = np.ones(len(table.cases), dtype=bool)
    for part in _tables_in(table.scene):
        for together in part.relations():
            for _, one_holds, _ in together:
                holds &= one_holds
    if holds.all():
        return table
    return _chosen(scene, table.cases, table.values, holds) if holds.any() else None


def _first_scene(study, cases):
    """The scene of the first, the middle or the last of some cases; None when all three are wrong."""
    for case in cases[[0, len(cases) // 2, -1]].tolist() if len(cases) else ():
        try:
            return study.case(case)[1]
        except SceneError:
            continue
    return None


def _chosen(scene, cases, values, chosen):
    """The table of chosen cases."""
    values = {key: numbers[chosen] for key, numbers in values.items()}
    return CaseTable(cases[chosen], _with_values(scene, values), values)


def _with_values(scene, values):
    """Copy of a scene with other numbers at some dotted keys."""
    for key, value in values.items():
        scene = scene.with_value(split_key(key), value)
    return scene


def _tables_in(table):
    """A table and all tables in it."""
    yield table
    for value in table.__dict__.values():
        for inside in value if isinstance(value, tuple) else value.values() if isinstance(value, dict) else (value,):
            if isinstance(inside, KeyTable):
                yield from _tables_in(inside)
