"""Many cases of a study as one scene whose varied numbers are arrays: each key is read and checked once for all."""

from dataclasses import dataclass

import numpy as np
from pydantic_core import PydanticCustomError

from cablestudy.errors import SceneError
from cablestudy.scene.fields import Table
from cablestudy.scene.layers import split_key
from cablestudy.scene.sampling import Sampled
from cablestudy.scene.scene import Scene, quantity_of

# names in keys of quantities that are no columns: a scene takes their sine, or compares them one by one
NOT_COLUMNS = ("inclination", "attitude", "ends", "loads")


@dataclass(frozen=True)
class CaseTable:
    """Cases of a study that differ in plain numbers only.

    Attributes
    ----------
    cases : ndarray of int, shape (n,)
        Their numbers, from 0.
    scene : Scene
        What the cases share; each varied number is an array, shape (n,), in SI. Its properties are arrays too.
    values : dict
        Dotted key -> that array.
    """

    cases: np.ndarray
    scene: Scene
    values: dict

    def scene_of(self, place):
        """The scene of one of the cases, numbers only.

        Parameters
        ----------
        place : int
            Index into `cases`.

        Returns
        -------
        Scene
        """
        return _with_values(self.scene, {key: float(values[place]) for key, values in self.values.items()})


def tables_of(study, cases):
    """Read many cases of a study.

    Cases share a table when they differ only in keys that are quantities. What the study varies beside them (a
    material, a mapping, a gain that is sometimes `auto`) divides the cases; a case unlike all others is read alone.

    Parameters
    ----------
    study : Study
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
    table = _of(scene, cases, values, valid)
    holds = np.ones(len(table.cases), dtype=bool)
    for part in _tables_in(table.scene):
        for together in part.relations():
            for _, one_holds, _ in together:
                holds &= one_holds
    if holds.all():
        return table
    return _of(scene, table.cases, table.values, holds) if holds.any() else None


def _first_scene(study, cases):
    """The scene of the first, the middle or the last of some cases; None when all three are wrong."""
    for case in cases[[0, len(cases) // 2, -1]].tolist() if len(cases) else ():
        try:
            return study.case(case)[1]
        except SceneError:
            continue
    return None


def _of(scene, cases, values, chosen):
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
            if isinstance(inside, Table):
                yield from _tables_in(inside)
