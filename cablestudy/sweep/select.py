"""Rows of a study that are wanted: --where, --sort and --best."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.sweep.condition import Names, parse


@dataclass(frozen=True)
class Selection:
    """Which rows are shown, and in which order.

    Attributes
    ----------
    condition : callable or None
        Row -> True, False or None (a cell is empty).
    key : Name or None
        What orders the rows.
    descending : bool
    best : bool
        Only the first of that order.
    """

    condition: object = None
    key: object = None
    descending: bool = False
    best: bool = False

    def places(self, rows):
        """Where the rows are that are shown.

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
            There is no best one.
        """
        condition, key = self.condition, self.key
        matching = ((place, row) for place, row in enumerate(rows) if condition is None or condition(row) is True)
        if key is None:
            return [place for place, _ in matching]
        matching = ((key.value(row), place) for place, row in matching)
        if self.best:
            return [self._best(matching)]
        matching = list(matching)
        known = [pair for pair in matching if pair[0] is not None]
        known.sort(key=lambda pair: (isinstance(pair[0], str), pair[0]), reverse=self.descending)
        return [place for _, place in known] + [place for value, place in matching if value is None]

    def _best(self, values):
        """The first place with the smallest or largest number."""
        better = operator.gt if self.descending else operator.lt
        found, best = None, None
        for value, place in values:
            if isinstance(value, float) and (found is None or better(value, best)):
                found, best = place, value
        if found is None:
            where = "" if self.condition is None else " that --where lets pass"
            raise NoSolutionError(f"--best: no row{where} has a value of {self.key.shown}")
        return found

    def table(self, table):
        """A table with only the rows that are shown."""
        places = self.places(table.rows)
        errors = partial(table.errors, places) if table.errors else None
        return replace(table, rows=Chosen(table.rows, places), errors=errors)


class Chosen(Sequence):
    """Some rows of others, which are not copied.

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
            return Chosen(self._rows, self._places[place])
        return self._rows[self._places[place]]


def read_selection(study, where=None, sort=None, best=None):
    """The selection that the options ask for. Columns that the study does not have become its last ones.

    Parameters
    ----------
    study : Study
    where, sort, best : str or None
        `sag < 0.5 and not status != ok`; `column` or `-column`; `min column` or `max column`.

    Returns
    -------
    Selection or None
        None when nothing is asked for.

    Raises
    ------
    SceneError
        Every option that cannot be read.
    """
    if sort is not None and best is not None:
        raise SceneError("--sort and --best exclude each other: --best shows a single row")
    names, mistakes, parts = Names(study), [], {}
    for option, text, read in (("--where", where, _condition), ("--sort", sort, _order), ("--best", best, _extreme)):
        if text is None:
            continue
        try:
            parts |= read(text, names)
        except SceneError as error:
            mistakes += error.mistakes
        for column in names.take():
            study.ask(column, option)
    if mistakes:
        raise SceneError(*mistakes)
    return Selection(**parts) if parts else None


def _condition(text, names):
    return {"condition": parse(text, names)}


def _order(text, names):
    name = text.strip()
    return {"key": _named("--sort", name.removeprefix("-"), names), "descending": name.startswith("-")}


def _extreme(text, names):
    word, _, name = text.strip().partition(" ")
    if word not in ("min", "max") or not name.strip():
        raise SceneError(f"--best: expected 'min COLUMN' or 'max COLUMN', got {text!r:.80}")
    key = _named("--best", name.strip(), names)
    if key.text:
        raise SceneError(f"--best: {key.shown} is text, which has no {word}")
    return {"key": key, "descending": word == "max", "best": True}


def _named(option, name, names):
    try:
        return names.find(name)
    except ValueError as error:
        raise SceneError(f"{option}: {error}") from None
