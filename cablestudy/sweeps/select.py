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
    """Selection of the rows of a study's table that are shown, and their order."""

    condition: object = None  # DataFrame -> Series of True, False or NA (unknown)
    bare: tuple = ()  # texts such as "14 is 14 m" on numbers of the condition without a unit
    objectives: tuple = ()  # (Variable, whether it is to be large): only rows on their Pareto front are shown
    key: Variable | None = None  # by which the rows are ordered
    descending: bool = False
    best: bool = False  # only the first row of that order is shown

    def table(self, table):
        """Select and sort the rows of a study's table: the `Table` of the selected ones, and notes, a list of str.

        First the condition selects, then the Pareto front; the rows left are sorted by `key`, or the best one is taken.
        Equal rows keep their order, rows with an empty cell are last. The notes say how many rows are selected, how
        many have no value of an objective, and which numbers without a unit may be a mistake. NoSolutionError if the
        best row is asked for, and no row has a number.
        """
        frame, notes = table.rows.frame(), []
        if self.condition is not None:
            frame = frame[self.condition(frame).fillna(False)]
        if self.bare and len(frame) in (0, len(table.rows)):
            notes.append(f"--where: without a unit {', '.join(self.bare)}")
        if self.objectives:
            frame, notes_on_front = self._front(frame)
            notes += notes_on_front
        if self.key is not None:
            frame = self._best(frame) if self.best else self._sorted(frame)
        indices = frame.index.tolist()  # of the rows shown, in the whole table
        errors = partial(table.errors, indices) if table.errors else None
        selected = replace(table, rows=LazyRows(indices, table.rows.__getitem__), errors=errors)
        return selected, [*notes, f"selected: {len(indices)} of {len(table.rows)} rows"]

    def _front(self, frame):
        """The rows that no other beats in the objectives, and a note, in a list, on those without a value of one."""
        costs = {key.name: _numbers(key, frame) * (-1 if large else 1) for key, large in self.objectives}
        complete = pandas.DataFrame(costs, index=frame.index).dropna()
        left_out = len(frame) - len(complete)
        notes = [f"--pareto: {counted(left_out, 'row')} without a value of {' or '.join(costs)}"] if left_out else []
        return frame.loc[complete.index[pareto_front(complete.to_numpy(dtype=float))]], notes

    def _sorted(self, frame):
        """The rows by numbers in their order, then by texts in theirs; those with an empty cell last."""
        cells = self.key.getter()(frame)
        is_text = cells.map(lambda cell: isinstance(cell, str)).astype(bool)
        order = pandas.DataFrame(
            {"empty": cells.isna(), "is text": is_text, "number": cells.mask(is_text), "text": cells.where(is_text)}
        )
        rising = not self.descending
        return frame.loc[order.sort_values(list(order), ascending=[True, rising, rising, rising]).index]

    def _best(self, frame):
        """The first row with the smallest or largest number."""
        numbers = _numbers(self.key, frame).dropna()
        if numbers.empty:
            options = {"--where": self.condition, "--pareto": self.objectives}
            filters = [name for name, value in options.items() if value]
            row = f"no row that {' and '.join(filters)} let{'s' * (len(filters) == 1)} pass" if filters else "no row"
            raise NoSolutionError(f"--best: {row} has a value of {self.key.name}")
        return frame.loc[[numbers.idxmax() if self.descending else numbers.idxmin()]]


def _numbers(key, frame):
    """The values of a Variable, NA where they are text or empty."""
    return pandas.to_numeric(key.getter()(frame), errors="coerce")


def read_selection(study, where=None, sort=None, best=None, pareto=None):
    """Read the options that select and sort the rows of a study: `Selection`, or None without any option.

    Columns that the options name and the study does not have are added to the study. `where` is a condition, for
    example `sag < 0.5 and status == ok`; `sort` is `COLUMN`, or `-COLUMN` for falling numbers; `best` is `min COLUMN`
    or `max COLUMN`: only the row with the smallest or largest number; `pareto` has objectives, each as for `best`,
    joined by commas: only rows on their Pareto front, which no other row equals or beats in all objectives and beats in
    one. SceneError: all mistakes in the options.
    """
    if sort is not None and best is not None:
        raise SceneError("--sort and --best exclude each other: --best shows a single row")
    fields = {}  # of the Selection
    readers = (where, _read_where), (pareto, _read_pareto), (sort, _read_sort), (best, _read_best)
    with Mistakes() as mistakes:
        for text, read in readers:
            with mistakes.at():
                fields |= read(text, study) if text is not None else {}
    return Selection(**fields) if fields else None


def _read_where(text, study):
    """Fields of the Selection for --where: dict; the readers of other options alike."""
    condition, bare = parse(text, study)
    return {"condition": condition, "bare": bare}


def _read_sort(text, study):
    name = text.strip()
    return {"key": _read_variable("--sort", name.removeprefix("-"), study), "descending": name.startswith("-")}


def _read_best(text, study):
    if "," in text:
        raise SceneError(f"--best: one row is best in one column, got {text.strip()!r:.80} (--pareto takes several)")
    key, large = _read_objective("--best", text, study)
    return {"key": key, "descending": large, "best": True}


def _read_pareto(text, study):
    objectives = [_read_objective("--pareto", part, study) for part in text.split(",")]
    names = [key.name for key, _ in objectives]
    repeated = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if repeated:
        raise SceneError(*(f"--pareto: {name} is there twice" for name in repeated))
    return {"objectives": tuple(objectives)}


def _read_objective(option, text, study):
    """Variable of `min COLUMN` or `max COLUMN`, and whether it is to be large."""
    word, _, name = text.strip().partition(" ")
    if word not in ("min", "max") or not name.strip():
        raise SceneError(f"{option}: expected 'min COLUMN' or 'max COLUMN', got {text.strip()!r:.80}")
    key = _read_variable(option, name.strip(), study)
    if key.is_text:
        raise SceneError(f"{option}: {key.name} is text, which has no {word}")
    return key, word == "max"


def _read_variable(option, name, study):
    """The Variable of a name in an option; SceneError where there is none."""
    try:
        return variable(name, study, option)
    except ValueError as error:
        raise SceneError(f"{option}: {error}") from None
