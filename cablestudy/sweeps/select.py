"""Selection of rows: --where, --pareto, --sort and --best."""

from dataclasses import dataclass, replace
from functools import partial

import pandas

from cablestudy.errors import Mistakes, NoSolutionError, SceneError
from cablestudy.scene.words import counted
from cablestudy.study.pareto import pareto_front
from cablestudy.sweeps.condition import parse
from cablestudy.sweeps.rows import LazyRows
from cablestudy.sweeps.variable import Variable, variable


@dataclass(frozen=True)
class Selection:
    """Which rows of a table are shown, and in which order."""

    condition: object = None  # DataFrame -> Series of True, False or NA (unknown)
    bare: tuple = ()  # numbers of the condition without a unit, as "14 is 14 m"
    objectives: tuple = ()  # (Variable, whether it is to be large): only rows on their Pareto front are shown
    key: Variable | None = None  # by which the rows are ordered
    descending: bool = False
    best: bool = False  # only the first row of that order is shown

    def table(self, table):
        """The rows that are shown, equal ones in their order, those with an empty cell last; and notes: how many they
        are, and how many have no value of an objective.

        Raises
        ------
        NoSolutionError
            `best`, and no row has a number.
        """
        frame, notes = table.rows.frame(), []
        if self.condition is not None:
            frame = frame[self.condition(frame).fillna(False)]
        if self.bare and len(frame) in (0, len(table.rows)):
            notes.append(f"--where: without a unit {', '.join(self.bare)}")
        if self.objectives:
            frame, lacking = self._front(frame)
            notes += lacking
        if self.key is not None:
            frame = self._best(frame) if self.best else self._sorted(frame)
        places = frame.index.tolist()
        errors = partial(table.errors, places) if table.errors else None
        shown = replace(table, rows=LazyRows(places, table.rows.__getitem__), errors=errors)
        return shown, [*notes, f"shown: {len(places)} of {len(table.rows)} rows"]

    def _front(self, frame):
        """The rows that no other beats in the objectives, and a note on those that lack one."""
        columns = {key.name: _numbers(key, frame) * (-1 if large else 1) for key, large in self.objectives}
        numbers = pandas.DataFrame(columns, index=frame.index).dropna()
        lacking = len(frame) - len(numbers)
        notes = [f"--pareto: {counted(lacking, 'row')} without a value of {' or '.join(columns)}"] if lacking else []
        return frame.loc[numbers.index[pareto_front(numbers.to_numpy(dtype=float))]], notes

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
        numbers = _numbers(self.key, frame).dropna()
        if numbers.empty:
            filters = [name for name, given in (("--where", self.condition), ("--pareto", self.objectives)) if given]
            row = f"no row that {' and '.join(filters)} let{'s' * (len(filters) == 1)} pass" if filters else "no row"
            raise NoSolutionError(f"--best: {row} has a value of {self.key.name}")
        return frame.loc[[numbers.idxmax() if self.descending else numbers.idxmin()]]


def _numbers(key, frame):
    """The values of a Variable, NA where they are text or empty."""
    return pandas.to_numeric(key.getter()(frame), errors="coerce")


def read_selection(study, where=None, sort=None, best=None, pareto=None):
    """The selection that the options ask for, or None. Columns that the study does not have are added to it.

    Parameters
    ----------
    study : StudyFile
    where, sort, best, pareto : str or None
        For example `sag < 0.5 and status == ok`; `COLUMN` or `-COLUMN`; `min COLUMN` or `max COLUMN`; several of these,
        joined by commas.

    Raises
    ------
    SceneError
        Every option that cannot be read.
    """
    if sort is not None and best is not None:
        raise SceneError("--sort and --best exclude each other: --best shows a single row")
    parts = {}
    readers = (where, _read_where), (pareto, _read_pareto), (sort, _read_sort), (best, _read_best)
    with Mistakes() as mistakes:
        for text, read in readers:
            with mistakes.at():
                parts |= read(text, study) if text is not None else {}
    return Selection(**parts) if parts else None


def _read_where(text, study):
    condition, bare = parse(text, study)
    return {"condition": condition, "bare": bare}


def _read_sort(text, study):
    name = text.strip()
    return {"key": _key("--sort", name.removeprefix("-"), study), "descending": name.startswith("-")}


def _read_best(text, study):
    key, large = _objective("--best", text, study)
    return {"key": key, "descending": large, "best": True}


def _read_pareto(text, study):
    objectives = [_objective("--pareto", part, study) for part in text.split(",")]
    names = [key.name for key, _ in objectives]
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise SceneError(*(f"--pareto: {name} is there twice" for name in twice))
    return {"objectives": tuple(objectives)}


def _objective(option, text, study):
    """What `min COLUMN` or `max COLUMN` names: Variable, and whether it is to be large."""
    word, _, name = text.strip().partition(" ")
    if word not in ("min", "max") or not name.strip():
        raise SceneError(f"{option}: expected 'min COLUMN' or 'max COLUMN', got {text.strip()!r:.80}")
    key = _key(option, name.strip(), study)
    if key.is_text:
        raise SceneError(f"{option}: {key.name} is text, which has no {word}")
    return key, word == "max"


def _key(option, name, study):
    try:
        return variable(name, study, option)
    except ValueError as error:
        raise SceneError(f"{option}: {error}") from None
