"""A study: a base scene, what varies in it, which columns to compute, and the printed table to compare with."""

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import Field, ValidationError

from cablestudy.errors import SceneError
from cablestudy.scene.document import apply_sets, lazily, read_base, read_file
from cablestudy.scene.fields import Switch, Text
from cablestudy.scene.layers import REPLACES, split_key
from cablestudy.scene.mistakes import collect, located
from cablestudy.scene.ranges import MAX_COUNT, Range, read_range
from cablestudy.scene.scene import read_scene
from cablestudy.scene.strict_yaml import refuse
from cablestudy.scene.tables import Table
from cablestudy.scene.units import show

CHECK_ALL = 1000
_RANGE_SAMPLES = 50

Name = Annotated[str, Text(empty=False)]


class Plot(Table):
    """What `--plot` draws.

    Attributes
    ----------
    x : str
        Column.
    y : tuple of str
        Columns.
    logx, logy : bool
    """

    x: Name = Field(description="Column along x")
    y: tuple[Name, ...] = Field(min_length=1, description="Column or list of columns along y")
    logx: Annotated[bool, Switch()] = Field(False, description="Logarithmic x axis")
    logy: Annotated[bool, Switch()] = Field(False, description="Logarithmic y axis")


class StudyTable(Table):
    """The keys of a study file."""

    title: Annotated[str, Text()] = Field("", description="Heading of the table")
    base: Name = Field(description="Scene file, relative to this file")
    set: dict[str, Any] = Field({}, description="Fixed changes of the scene: dotted key -> value")
    vary: tuple[dict[str, Any], ...] = Field(
        (), description="What varies: entries multiply (grid), keys inside one entry go together (zip)"
    )
    columns: tuple[Name, ...] = Field(min_length=1, description="Columns of the table, with or without their unit")
    reference: Name | None = Field(None, description="CSV file of values to compare with, relative to this file")
    plot: Plot | None = Field(None, description="What to draw")


TABLES = {(): StudyTable, ("plot",): Plot}


@dataclass(frozen=True)
class Entry:
    """One entry of `vary`: keys that go together.

    Attributes
    ----------
    columns : tuple of (str, sequence, callable)
        Dotted key, its values, and index -> place (looked up only on a mistake).
    """

    columns: tuple[tuple[str, Any, Any], ...]

    def __len__(self):
        return len(self.columns[0][1])

    def settings(self, index):
        """List of (key, value, place) of one step."""
        return [(key, values[index], partial(place, index)) for key, values, place in self.columns]

    def steps(self):
        """The steps worth checking: all, but of ranges only some, since every limit of a quantity is an interval."""
        if all(isinstance(values, Range) for _, values, _ in self.columns):
            last = len(self) - 1
            return sorted({round(i * last / _RANGE_SAMPLES) for i in range(_RANGE_SAMPLES + 1)})
        return range(len(self))


class Study:
    """A study file, read and checked.

    Attributes
    ----------
    name : str
        The file as the user named it.
    title : str
    columns : tuple of str
        As written; whether they exist is for the registry of columns to say.
    plot : Plot or None
    reference_path : str or None
        An existing file.
    document : Document
        The base scene with `set:` and `--set`, nothing varied yet.
    source : Document
        The study file itself.
    entries : tuple of Entry
    count : int
        How many cases. [-]
    """

    def __init__(self, source, table, document, entries):
        self.name, self.source, self.document, self.entries = source.name, source, document, entries
        self.title, self.columns, self.plot = table.title, table.columns, table.plot
        self.base, self.set = table.base, table.set
        self.reference_path = _beside(source, table.reference) if table.reference else None
        self.count = math.prod(len(entry) for entry in entries)

    def where(self, path):
        """`file:line:column` of a value of the study file, for example of `("columns", 3)`."""
        return self.source.where(path)

    @property
    def varied(self):
        """Tuple of the dotted keys that vary, in order."""
        return tuple(key for entry in self.entries for key, _, _ in entry.columns)

    def resolved(self):
        """The study as plain values: `scene` with its base files and `--set` merged, `vary`, `columns`.

        Two studies that resolve alike have the same cases.

        Returns
        -------
        dict
        """
        vary = [{key: getattr(values, "written", values) for key, values, _ in entry.columns} for entry in self.entries]
        return {"scene": self.document.value, "vary": vary, "columns": list(self.columns)}

    def overrides(self, index):
        """What varies in one case.

        Parameters
        ----------
        index : int
            From 0 to count - 1; the last entry of `vary` runs fastest.

        Returns
        -------
        dict
            Dotted key -> value as written.
        """
        return {key: value for key, value, _ in self._settings(self._steps(index))}

    def case(self, index):
        """One case.

        Parameters
        ----------
        index : int
            From 0 to count - 1.

        Returns
        -------
        overrides : dict
        scene : Scene

        Raises
        ------
        SceneError
            The case is no valid scene.
        """
        settings = self._settings(self._steps(index))
        scene = read_scene(self.document.with_sets(settings))
        return {key: value for key, value, _ in settings}, scene

    def cases(self):
        """Yield (overrides, scene) of every case, in order; see `case`."""
        for index in range(self.count):
            yield self.case(index)

    def check(self):
        """Check the cases before anything is computed.

        All of them up to 1000; beyond, each step of each entry beside the first step of the others.

        Raises
        ------
        SceneError
            All mistakes of all cases checked, each once.
        """
        mistakes = {}
        for steps in self._steps_to_check():
            try:
                read_scene(self._document(steps))
            except SceneError as error:
                mistakes.update(dict.fromkeys(error.mistakes))
        if mistakes:
            raise SceneError(*mistakes)

    def _steps_to_check(self):
        if self.count <= CHECK_ALL:
            yield from map(self._steps, range(self.count))
            return
        for place, entry in enumerate(self.entries):
            for step in entry.steps():
                yield tuple(step if i == place else 0 for i in range(len(self.entries)))

    def _steps(self, index):
        """Step of each entry in a case."""
        if not 0 <= index < self.count:
            raise IndexError(f"case {index} of {self.count}")
        steps = []
        for entry in reversed(self.entries):
            index, step = divmod(index, len(entry))
            steps.append(step)
        return tuple(reversed(steps))

    def _settings(self, steps):
        settings = []
        for entry, step in zip(self.entries, steps, strict=True):
            settings += entry.settings(step)
        return settings

    def _document(self, steps):
        return self.document.with_sets(self._settings(steps))


def read_study(path, sets=()):
    """Read a study file, its base scene and its reference's name.

    Parameters
    ----------
    path : str or path-like
        `-` is standard input; names in it are then relative to the working directory.
    sets : sequence of str
        `key=value` each: changes of the scene.

    Returns
    -------
    Study

    Raises
    ------
    SceneError
        All that is wrong with the study file itself; the cases are checked by `Study.check`.
    """
    return study_of(read_file(path), sets)


def study_of(source, sets=()):
    """Study of a document whose `base:` is still unread; see `read_study`.

    Parameters
    ----------
    source : Document
    sets : sequence of str

    Returns
    -------
    Study
    """
    for key in ("cable", "gravity"):
        if key in source.value:
            place = source.key_place((key,))
            raise refuse(place, f"this is a scene (it has the key {key}): use 'cablestudy static'")
    try:
        table = StudyTable.model_validate(_listed(source.value))
    except ValidationError as error:
        raise collect(error, source, TABLES) from None
    entries, found = _entries(table, source)
    found += _repeated(table.columns, "columns")
    if table.reference and not os.path.isfile(_beside(source, table.reference)):
        found.append((("reference",), f"{_beside(source, table.reference)}: no such file"))
    if found:
        raise located(found, source)
    document = read_base(source)
    settings = [(key, value, lazily(source, ("set", key))) for key, value in table.set.items()]
    document = apply_sets(document.with_sets(settings), sets)
    study = Study(source, table, document, entries)
    _refuse_idle(study, table.set, sets)
    return study


def _listed(value):
    """A study's mapping with a single `y` of its plot made a list of one."""
    plot = value.get("plot")
    if isinstance(plot, dict) and isinstance(plot.get("y"), str):
        return {**value, "plot": {**plot, "y": [plot["y"]]}}
    return value


def _beside(source, name):
    """A file named in a study, relative to the study."""
    return os.path.join(os.path.dirname(source.name), name)


def _entries(table, source):
    """The entries of `vary`, and what is wrong with them as (path, message)."""
    entries, found, seen = [], [], set()
    for number, mapping in enumerate(table.vary):
        columns = []
        if not mapping:
            found.append((("vary", number), "an entry without a key"))
        for key, written in mapping.items():
            path = ("vary", number, key)
            try:
                split_key(key)
                columns.append((key, _values(written), partial(_value_place, source, path)))
            except ValueError as error:
                found.append((path, str(error)))
            if key in seen:
                found.append((path, "varies in an entry above already"))
            seen.add(key)
        lengths = {key: len(values) for key, values, _ in columns}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{key} {length}" for key, length in lengths.items())
            found.append((("vary", number), f"keys of one entry go together and need equally many values: {listed}"))
        elif columns:
            entries.append(Entry(tuple(columns)))
    if math.prod(map(len, entries)) > MAX_COUNT:
        found.append((("vary",), f"{math.prod(map(len, entries))} cases (at most {MAX_COUNT})"))
    return tuple(entries), found


def _value_place(source, path, index):
    """Place of one varied value; a range has a single one."""
    return source.place((*path, index))


def _values(written):
    """The values of a varied key: a list as it is, a mapping as a range."""
    if isinstance(written, dict):
        return read_range(written)
    if not isinstance(written, list):
        raise ValueError(f"expected a list of values, or a range {{from, to, count}}, got {show(written)}")
    if not written:
        raise ValueError("expected at least one value")
    return written


def _repeated(names: Iterable[str], key):
    """Names that occur twice."""
    first = {}
    return [((key, i), f"{name} is given twice") for i, name in enumerate(names) if first.setdefault(name, i) != i]


def _refuse_idle(study, fixed, sets):
    """Refuse what the varied keys make void: a fixed value that no case would show."""
    varied = [split_key(key) for key in study.varied]
    removed = [path for key in study.varied for path in REPLACES.get(key, ())]
    options = [text.partition("=")[0].strip() for text in sets]
    written = [(key, study.where(("set", key))) for key in fixed] + [(key, f"--set {key}") for key in options]
    found = []
    for key, place in written:
        path = split_key(key)
        if any(path[: len(other)] == other for other in (*varied, *removed)):
            found += refuse(place, "has no effect: the study varies this key, or one that replaces it", key).mistakes
    if found:
        raise SceneError(*found)
