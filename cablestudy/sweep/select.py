"""Selection of rows: --where, --sort and --best."""

from dataclasses import dataclass, replace
from functools import partial

import pandas

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.sweep.condition import parse
from cablestudy.sweep.rows import LazyRows
from cablestudy.sweep.variable import Variable, variable


@dataclass(frozen=True)
class Selection:
    """Which rows of a table are shown, and in which order."""

    condition: object = None  # DataFrame -> Series of True, False or NA (unknown)
    key: Variable | None = None  # by which the rows are ordered
    descending: bool = False
    best: bool = False  # only the first row of that order is shown

    def table(self, table):
        """The rows that are shown, equal ones in their order, those with an empty cell last; how many, as a note.

        Raises
        ------
        NoSolutionError
            `best`, and no row has a number.
        """
        frame = table.rows.frame()
        if self.condition is not None:
            frame = frame[self.condition(frame).fillna(False)]
        if self.key is not None:
            frame = self._best(frame) if self.best else self._sorted(frame)
        places = frame.index.tolist()
        errors = partial(table.errors, places) if table.errors else None
        shown = replace(table, rows=LazyRows(places, table.rows.__getitem__), errors=errors)
        return shown, [f"shown: {len(places)} of {len(table.rows)} rows"]

    def _sorted(self, frame):
        """Numbers in their order, then texts in theirs."""
        cells = self.key.getter()(frame)
        texts = cells.map(lambda cell: isinstance(cell, str)).astype(bool)
        order = pandas.DataFrame(
            {"empty": cells.isna(), "is text": texts, "number": cells.mask(texts), "text": cells.where(texts)}
        )
        rising = not self.descending
        return frame.loc[order.sort_values(list(order), ascending=[True, rising, rising, rising]).index]

    def _best(self, frame):
        """The first row with the smallest or largest number."""
        numbers = pandas.to_numeric(self.key.getter()(frame), errors="coerce").dropna()
        if numbers.empty:
            row = "no row" if self.condition is None else "no row that --where lets pass"
            raise NoSolutionError(f"--best: {row} has a value of {self.key.name}")
        return frame.loc[[numbers.idxmax() if self.descending else numbers.idxmin()]]


def read_selection(study, where=None, sort=None, best=None):
    """The selection that the options ask for, or None. Columns that the study does not have are added to it.

    Parameters
    ----------
    study : Study
    where, sort, best : str or None
        For example `sag < 0.5 and status == ok`; `COLUMN` or `-COLUMN`; `min COLUMN` or `max COLUMN`.

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
