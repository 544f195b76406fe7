"""A study: a base scene, what varies in it, which columns to compute, and the printed table to compare with."""

import math
import os
from contextlib import suppress
from functools import partial
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StrictBool, StrictStr, ValidationError

from cablestudy.errors import Mistakes, SceneError
from cablestudy.scene.document import MAPPING, STDIN, apply_sets, path_named_in, read_base, read_file
from cablestudy.scene.entries import ALTERNATIVE, clash, entries_of, entries_of_options
from cablestudy.scene.fields import Either, KeyTable, Name, Quantity, tables_of, wrong
from cablestudy.scene.layers import mapping_at, replaced_by, split_key
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.scene.mistakes import at_most, findings, in_order, located
from cablestudy.scene.sampling import Sample
from cablestudy.scene.scene import CableScene, read_scene, refuse_study
from cablestudy.scene.strict_yaml import mistake, refuse
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show

ALL_COLUMNS = "rtol"  # in `check`


def _as_list(value):
    """One text as a list of it; anything else itself."""
    return [value] if isinstance(value, str) else value


class Plot(KeyTable):
    """Picture that `--plot` draws."""

    x: Name = Field(description="Column or varied key along x")
    y: Annotated[tuple[Name, ...], BeforeValidator(_as_list)] = Field(
        min_length=1, description="Column or varied key along y, or a list of them"
    )
    color: Name | None = Field(None, description="Column or varied key as colour; over two varied keys a heat map")
    logx: StrictBool = Field(False, description="Logarithmic x axis")
    logy: StrictBool = Field(False, description="Logarithmic y axis")


def _refuse_bool(value):
    """A number or text itself; true and false, which are numbers of Python, are refused."""
    if isinstance(value, bool):
        raise wrong(f"expected {_NUMBER_OR_TEXT}, got {show(value)}")
    return value


_NUMBER_OR_TEXT = 'a number, or text such as "2 m"'
Written = Annotated[
    int | float | str,
    Either(_NUMBER_OR_TEXT, ((int | float | str, _refuse_bool, {"type": "number"}, {"type": "string"}),)),
]


class Find(KeyTable):
    """For which value of a key a column takes a value."""

    column: Name = Field(description="Column, with or without its unit")
    value: Written = Field(description="What it is to be; a number is in the unit of the column")
    by: Name = Field(description="Dotted key of the scene that is solved for")
    between: tuple[Written, Written] | None = Field(
        None, description="Range of the key; default: about its value in the scene, growing to what the key allows"
    )


class StudyTable(KeyTable):
    """The keys of a study file."""

    title: StrictStr = Field("", description="Heading of the table")
    base: Name = Field(description="Scene file, relative to this file")
    set: dict[str, Any] = Field({}, description="Fixed changes of the scene: dotted key -> value")
    vary: tuple[dict[str, Any], ...] = Field(
        (), description="What varies: entries multiply (grid), keys inside one entry go together (zip)"
    )
    sample: Sample | None = Field(None, description="What is sampled: one more entry in addition to those of vary")
    find: Find | None = Field(None, description="What is solved for in each case: a column of its own in the table")
    columns: tuple[Name, ...] = Field(min_length=1, description="Columns of the table, with or without their unit")
    reference: Name | None = Field(None, description="CSV file of values to compare with, relative to this file")
    check: dict[str, Annotated[float, Quantity("", 0, 1e9)]] = Field(
        {}, description="Relative tolerances of --check: rtol for all columns, a column's name for one"
    )
    plot: Plot | None = Field(None, description="What --plot draws")


# What tells a scene from a study; both may have `base`.
SCENE_KEYS = CableScene.model_fields.keys() | SuspensionScene.model_fields.keys()
OF_SCENE = "unknown key of a study: it is one of a scene, which set changes by dotted keys, as set: {gravity: 9.8}"
STUDY_KEYS = StudyTable.model_fields.keys() - {"base"}
STAND_INS = {"base": "-", "columns": ("status",)}  # for keys that are needed, where they are missing or wrong
TABLES = tables_of(StudyTable)


class StudyFile:
    """A study file, read and checked."""

    wrong_keys = frozenset()  # keys at the top level that are left out, since they have mistakes

    def __init__(self, source, table, document, entries, options=()):
        self.source, self.name = source, source.name  # the file as read, and as the user named it
        self.document = document  # the base scene with `set:` and `--set`, nothing varied yet
        self.entries = (*entries, *options)  # those of `vary`, the sample, those of the options `--vary`
        self.title, self.set, self.plot, self.find = table.title, table.set, table.plot, table.find
        self.columns = table.columns  # names as written, not looked up yet
        self.asked = ()  # the last of these columns, which only an option of the command line names
        self.tolerances = table.check  # of --check, as written: a column, or ALL_COLUMNS -> relative tolerance
        # of the CSV file to compare with, which exists; or None
        self.reference_path = path_named_in(source.name, table.reference) if table.reference and not options else None
        self.count = math.prod(len(entry) for entry in self.entries)  # of cases
        self.sample, self.sample_entry = table.sample, len(entries) - 1  # its place among the entries
        self._options = {}  # path in the study -> the option that added what is there
        self._scenes = {}  # number of a case -> its scene, of the first cases that were read
        self.notes = tuple(self._notes(table, bool(options)))  # for the user, about the cases

    def _notes(self, table, is_extended):
        """Yield the notes on the cases; `is_extended`: whether options `--vary` add entries."""
        for note in table.sample.notes if table.sample else ():
            yield f"{self.source.where(('sample', 'count'))}: {note}"
        if table.reference and is_extended:
            yield f"{table.reference} left out: its rows are those of the study without --vary"
        yield from self._notes_on_unused_cases()
        if table.find and "case" in self.set_keys and not table.find.by.startswith("cases"):
            alone = f"{table.find.by} is solved for in each load case alone, so that each row is another cable"
            one = "one cable in all load cases states what it has at its reference state (set:)"
            yield f"{self.source.where(('find', 'by'))}: {alone}; {one}"

    def likely_mistakes(self):
        """Likely mistakes of the first cases, so far as they can be set, each once; see `likely_mistakes`."""
        lines = {}
        for case in self.cases_to_check()[: SCENE.searched_cases]:
            with suppress(SceneError):
                lines.update(dict.fromkeys(likely_mistakes(self.document.with_sets(self._settings(case)))))
        listed, left_out = list(lines)[: SCENE.listed_likely_mistakes], len(lines) - SCENE.listed_likely_mistakes
        return (*listed, *([f"and {left_out} more like these"] if left_out > 0 else []))

    def _notes_on_unused_cases(self):
        """Notes on varied keys of load cases that no row is in: tuple of str."""
        if "case" in self.set_keys:
            return ()
        chosen = self.document.value.get("case")
        case_of_key = {key: split_key(key)[1] for key in self.set_keys if key.startswith("cases.")}
        return tuple(
            f"{key} varies, and no row is in the load case {name}: set: {{case: {name}}} chooses it"
            for key, name in case_of_key.items()
            if name != chosen
        )

    def where(self, path):
        """`file:line:column` of a value of the study file, for example of `("columns", 3)`, or an option's name."""
        return self._options.get(path) or self.source.where(path)

    def ask(self, name, option):
        """Add a column that an option of the command line (named for messages) needs."""
        self._options[("columns", len(self.columns))] = option
        self.columns += (name,)
        self.asked += (name,)

    @property
    def varied(self):
        """Tuple of the dotted keys that vary, in order, and perhaps `alternative`: the columns of the table."""
        return tuple(key for entry in self.entries for key in entry.keys)

    @property
    def set_keys(self):
        """Tuple of the dotted keys that are set in some case, those of alternatives too."""
        return tuple(key for entry in self.entries for key in entry.set_keys)

    def resolved(self):
        """The study as plain values: `scene` with its base files and `--set` merged, `vary`, `columns`, and `find`
        where there is one.

        Two studies that resolve alike have the same cases.
        """
        vary = []
        for entry in self.entries:
            written = {key: getattr(values, "written", values) for key, values, _ in entry.columns}
            changes = {name: {key: value for key, value, _ in items} for name, items in entry.alternatives.items()}
            vary.append(written | ({ALTERNATIVE: changes} if changes else {}))
        find = {"find": self.find.model_dump(mode="json")} if self.find else {}
        return {"scene": self.document.value, "vary": vary, "columns": list(self.columns), **find}

    def overrides(self, index):
        """Dotted key -> value as written of what varies in a case, from 0; the last entry runs fastest."""
        return {key: value for entry, step in self._steps(index) for key, value in entry.shown(step).items()}

    def case(self, index):
        """Overrides and scene of one case, from 0; the key that `find` solves for is as in the base scene.

        `study.case_table` reads many cases at once.

        Raises
        ------
        SceneError
            The case is no valid scene.
        """
        scene = self._scenes.get(index) or read_scene(self.document_of(index))
        if len(self._scenes) < SCENE.kept_scenes:
            self._scenes[index] = scene
        return self.overrides(index), scene

    def document_of(self, index):
        """The document of one case, from 0; SceneError where a varied key cannot be set."""
        return self.document.with_sets(self._settings(index), varied=True)

    def __getstate__(self):
        """Attributes for a pickle: without the scenes, which are read again where they are needed."""
        return {**self.__dict__, "_scenes": {}}

    def cases(self):
        """Yield (overrides, scene) of every case, in order; see `case`."""
        return map(self.case, range(self.count))

    def cases_to_check(self):
        """Numbers of the cases that are checked before anything is computed: list of int.

        All of them up to `SCENE.checked_cases`; beyond, each step of each entry with the first step of the others.
        """
        if self.count <= SCENE.checked_cases:
            return list(range(self.count))
        stride, cases = self.count, {}
        for entry in self.entries:
            stride //= len(entry)
            cases.update((step * stride, None) for step in entry.steps())
        return list(cases)

    def _steps(self, index):
        """List of each entry and its step in a case, from 0; the last entry runs fastest."""
        if not 0 <= index < self.count:
            raise IndexError(f"case {index} of {self.count}")
        steps = []
        for entry in reversed(self.entries):
            index, step = divmod(index, len(entry))
            steps.append(step)
        return list(zip(self.entries, reversed(steps), strict=True))

    def _settings(self, index):
        """List of (key, value, place) of all that varies in a case."""
        return [item for entry, step in self._steps(index) for item in entry.settings(step)]


def read_study(path, sets=(), vary=(), further_check=None):
    """Read a study file and the base scene that it names, and check them: `StudyFile`.

    `path` is a name, or `-` for standard input; names in it are then relative to the working directory. `sets` and
    `vary` are arguments of the options: changes of the scene, and more keys that vary, after those of the study.
    `further_check` is called with the `StudyFile` if it has mistakes: it finds more of them, so that the user sees all
    of them together, and raises SceneError; it ignores the keys `StudyFile.wrong_keys`, which could not be read.

    SceneError: all that is wrong with the study file itself; cases and columns are checked by `study.prepare`.
    """
    return study_of(read_file(path), sets, vary, further_check)


def study_of(source, sets=(), vary=(), further_check=None):
    """Make a `StudyFile` of a study file that has been read, a Document with its `base:` unread; as `read_study`."""
    _refuse_scene(source)
    table, found = _read_table(source)
    mistakes = Mistakes()
    wrong_keys, options = _top_level(found) | STAND_INS.keys() - source.value.keys(), ()
    base = None if "base" in wrong_keys else _read_base(source, table.set, sets, mistakes)
    wrong_keys |= {"base"} if mistakes else set()
    case_names = partial(_case_names, base)
    entries, found_in_entries = entries_of(table, source, case_names)
    found += [*found_in_entries, *_missing_reference(source, table)]
    with mistakes.at():
        options = entries_of_options(vary, entries, case_names)
    study = StudyFile(source, table, base or source, entries, options)
    with mistakes.at():
        _refuse_settings_without_effect(study, entries, sets)
    with mistakes.at():
        _refuse_variation_of_unknown(study)
    study.wrong_keys = frozenset(wrong_keys | _top_level(found) | ({"vary"} if mistakes else set()))
    mistakes.extend(located(found, source).mistakes)
    if mistakes and further_check:
        with mistakes.at():
            further_check(study)
    if mistakes:
        raise SceneError(*at_most(in_order(mistakes), source.name))
    return study


def _case_names(base):
    """Names of the load cases of the base scene, a Document: list; a stand-in where it cannot be read (None)."""
    return list(mapping_at(base.value, ("cases",))) if base else [""]


def _missing_reference(source, table):
    """Path and message where the file of printed values is not there: list, at most one."""
    path = path_named_in(source.name, table.reference) if table.reference else None
    if path is None or os.path.isfile(path):
        return []
    return [(("reference",), f"{path}: {'a directory, not a file' if os.path.isdir(path) else 'no such file'}")]


def _read_base(source, fixed, sets, mistakes):
    """Base scene of a study, changed by its `set:` (`fixed`) and by options `--set`: `Document`, None without a file.

    Mistakes are added to a `Mistakes`; changes with mistakes are left out.
    """
    document = None
    with mistakes.at():
        document = read_base(source)
    if document is None:
        return None
    with mistakes.at():
        refuse_study(document, is_base=True)
    with mistakes.at():
        document = document.with_sets(
            [(key, value, partial(source.place, ("set", key))) for key, value in fixed.items()]
        )
    with mistakes.at():
        document = apply_sets(document, sets)
    return document


def _read_table(source):
    """The `StudyTable` of a file without the keys that are wrong, and (path, message) of each mistake in a list."""
    known = StudyTable.model_fields  # unknown keys stay, so that they are refused; known ones may be null
    given = {key: value for key, value in source.value.items() if value is not None or key not in known}
    try:
        return StudyTable.model_validate(given), []
    except ValidationError as error:
        found = findings(error, source.value, TABLES)
    wrong = _top_level(found)
    right = {key: value for key, value in given.items() if key in known and key not in wrong}
    return StudyTable.model_validate(STAND_INS | right), found


def _top_level(found):
    """Keys at the top level that have mistakes, of (path, message) pairs: set of str."""
    missing_keys = {message.rpartition(" ")[2] for path, message in found if not path}
    return missing_keys | {path[0] for path, _ in found if path}


def _refuse_scene(source):
    """Refuse a document with keys of a scene, which is a scene or a study that should have them under `set`."""
    places = {key: source.place((key,), of_key=True) for key in source.stated_keys if key in SCENE_KEYS}
    if places and not STUDY_KEYS.isdisjoint(source.stated_keys):
        raise SceneError(*(mistake(place, key, OF_SCENE) for key, place in places.items()))
    if places:
        key = next((name for name in ("cable", "cables") if name in places), next(iter(places)))
        name = "SCENE" if source.name in (STDIN, MAPPING) else os.path.basename(source.name)
        study = f"a study of it is a file with the line base: {name} ('cablestudy new study' writes one)"
        raise refuse(places[key], f"this is a scene (it has the key {key}): use 'cablestudy static'; {study}")


def _refuse_variation_of_unknown(study):
    """Refuse varied keys that are, contain or exclude the key for which `find` solves, if it is there."""
    if not study.find:
        return
    try:
        split_key(study.find.by)
        reason = next(filter(None, (clash(study.find.by, other) for other in study.set_keys)), None)
    except ValueError as error:
        reason = str(error)
    if reason:
        raise refuse(study.source.place(("find", "by")), f"{study.find.by}: {reason}", "find.by")


def _refuse_settings_without_effect(study, entries, sets):
    """Refuse fixed values that no case would show, since the varied keys replace them.

    The options --vary are a layer upon the study and may replace what its `set:` fixes, but not what --set fixes.
    """
    fixed = [(key, study.where(("set", key)), entries) for key in study.set]
    fixed += [(key, f"--set {key}", study.entries) for key in (text.partition("=")[0].strip() for text in sets)]
    mistakes = []
    for key, place, varying_entries in fixed:
        path = split_key(key)
        varied = [other for entry in varying_entries for other in entry.set_keys if entry.always_set(other)]
        replaced = [split_key(other) for other in varied] + [other for key in varied for other in replaced_by(key)]
        if any(path[: len(other)] == other for other in replaced):
            message = "has no effect: the study varies this key, or one that replaces it"
            mistakes.append(mistake(place, key, message))
    if mistakes:
        raise SceneError(*mistakes)
