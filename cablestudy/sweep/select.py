"""Selection of rows: --where, --sort and --best."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.sweep.condition import parse
from cablestudy.sweep.variable import variable


@dataclass(frozen=True)
class Selection:
    """Which rows of a table are shown, and in which order.

    Attributes
    ----------
    condition : callable or None
        Row -> True, False or None (unknown).
    key : Variable or None
        By which the rows are ordered.
    descending : bool
    best : bool
        Whether only the first row of that order is shown.
    """

    condition: object = None
    key: object = None
    descending: bool = False
    best: bool = False

    def places(self, rows):
        """Indices of the rows that are shown.

        Parameters
        ----------
        rows : iterable of dict
            Header or varied key -> cell.

        Returns
        -------
        list of int
            From 0. Equal rows keep their order; those whose cell is empty are last.

        Raises
        ------
        NoSolutionError
            `best`, and no row has a number.
        """
        condition, key = self.condition, self.key
        matching = ((place, row) for place, row in enumerate(rows) if condition is None or condition(row) is True)
        if key is None:
            return [place for place, _ in matching]
        value = key.getter()
        matching = ((value(row), place) for place, row in matching)
        if self.best:
            return [self._best(matching)]
        matching = list(matching)
        known = [pair for pair in matching if pair[0] is not None]
        known.sort(key=lambda pair: (isinstance(pair[0], str), pair[0]), reverse=self.descending)
        return [place for _, place in known] + [place for value, place in matching if value is None]

    def _best(self, values):
        """Index of the first row with the smallest or largest number."""
        better = operator.gt if self.descending else operator.lt
        found, best = None, None
        for value, place in values:
            if isinstance(value, float) and (found is None or better(value, best)):
                found, best = place, value
        if found is None:
            where = "" if self.condition is None else " that --where lets pass"
            raise NoSolutionError(f"--best: no row{where} has a value of {self.key.name}")
        return found

    def table(self, table):
        """The table of the rows that are shown."""
        places = self.places(table.rows)
        errors = partial(table.errors, places) if table.errors else None
        return replace(table, rows=ChosenRows(table.rows, places), errors=errors)


class ChosenRows(Sequence):
    """Some rows of a table, not copied.

    Parameters
    ----------
    rows : sequence of dict
    places : list of int
        From 0, in the order in which they are shown.
    """

    def __init__(self, rows, places):
        self._rows, self._places = rows, places

    def __len__(self):
        return len(self._places)

    def __getitem__(self, place):
        if isinstance(place, slice):
            return ChosenRows(self._rows, self._places[place])
        return self._rows[self._places[place]]


def read_selection(study, where=None, sort=None, best=None):
    """The selection that the options ask for. Columns that the study does not have are added to it.

    Parameters
    ----------
    study : Study
    where, sort, best : str or None
        For example `sag < 0.5 and status == ok`; `COLUMN` or `-COLUMN`; `min COLUMN` or `max COLUMN`.

    Returns
    -------
    Selection or None
        None without options.

    Raises
    ------
    SceneError
        Every option that cannot be read.
    """
    if sort is not None and best is not None:
        raise SceneError("--sort and --best exclude each other: --best shows a single row")
    mistakes, parts = [], {}
    for text, read in ((where, _read_where), (sort, _read_sort), (best, _read_best)):
        try:
            parts |= read(text, study) if text is not None else {}
        except SceneError as error:
            mistakes += error.mistakes
    if mistakes:
        raise SceneError(*mistakes)
    return Selection(**parts) if parts else None


def _read_where(text, study):
    return {"condition": parse(text, study)}


def _read_sort(text, study):
    name = text.strip()
    return {"key": _key("--sort", name.removeprefix("-"), study), "descending": name.startswith("-")}


def _read_best(text, study):
    word, _, name = text.strip().partition(" ")
    if word not in ("min", "max") or not name.strip():
        raise SceneError(f"--best: expected 'min COLUMN' or 'max COLUMN', got {text!r:.80}")
    key = _key("--best", name.strip(), study)
    if key.is_text:
        raise SceneError(f"--best: {key.name} is text, which has no {word}")
    return {"key": key, "descending": word == "max", "best": True}


def _key(option, name, study):
    try:
        return variable(name, study, option)
    except ValueError as error:
        raise SceneError(f"{option}: {error}") from None
