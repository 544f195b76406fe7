"""Every key of scenes, suspensions and studies with its unit, default, range and meaning, read from the models."""

from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Literal, Union, get_args, get_origin

from pydantic_core import PydanticUndefined

from cablestudy.scene.fields import Count, Either, KeyTable, Quantity
from cablestudy.scene.ranges import MAX_COUNT, MEANINGS, SPACINGS
from cablestudy.scene.scene import TABLES as SCENE_TABLES
from cablestudy.scene.schema import BASE
from cablestudy.scene.study import TABLES as STUDY_TABLES
from cablestudy.scene.suspension import SUSPENSION_TABLES

KINDS = ("scene", "suspension", "study")
CONTAINERS = (Annotated, Union, UnionType, tuple, dict)
ANY = ("NAME", "N")  # stand for any name, and any place in a list
LISTS = ("loads",)  # tables that hold a list, not names
NO_UNIT = "-"  # of a pure number
REQUIRED = "required"


@dataclass(frozen=True)
class Key:
    """One key of a file.

    Attributes
    ----------
    key : str
        Dotted; NAME stands for any name and N for a place in a list, from 0.
    unit : str
        Of a bare number, and of the limits; "-" of a pure number; empty of what is no number.
    default : str
        As it would be written; "required" where there is none; empty where nothing stands for a missing key.
    meaning : str
    allowed : str
        Range, or the words that it may be.
    """

    key: str
    unit: str
    default: str
    meaning: str
    allowed: str


def keys_of(kind):
    """List of `Key` of a file.

    Parameters
    ----------
    kind : {"scene", "suspension", "study"}
        A scene of one cable, of several, or a study.
    """
    if kind == "study":
        return [*_keys_in(STUDY_TABLES), *_keys_of_ranges()]
    tables = SCENE_TABLES if kind == "scene" else SUSPENSION_TABLES
    return [Key("base", "", "", BASE["description"], ""), *_keys_in(tables)]


def _keys_in(tables):
    """Yield each `Key` of the tables of a file, from `fields.tables_of`, each table after the other, each key once.

    What cables of a suspension share with `cable` is listed there only.
    """
    listed = set()
    shared = {(*path[1:], name) for path, model in tables if path[:1] == ("cable",) for name in _fields(model)}
    for table_path, model in tables:
        for name, field in _fields(model).items():
            path = (*table_path, name)
            if path in listed or (path[:2] == ("cables", "*") and path[2:] in shared):
                continue
            listed.add(path)
            yield Key(dotted(path), *_description(field))


def _keys_of_ranges():
    """Yield the keys inside of `vary` and `sample`: of ranges, of alternatives, of intervals that are sampled."""
    ends = {"from": ("", REQUIRED, ""), "to": ("", REQUIRED, "")}
    count = {"count": (NO_UNIT, REQUIRED, f"1 to {MAX_COUNT}")}
    spacing = {"spacing": ("", SPACINGS[0], ", ".join(SPACINGS))}
    yield Key("vary.N.KEY", "", "", "Values of a dotted key of the scene: a list, or a range of the keys below", "")
    changes = "Name of an alternative, and the changes that it makes: dotted key -> value; a column has the names"
    yield Key("vary.N.alternative.NAME", "", "", changes, "")
    for parent, children in (("vary.N.KEY", ends | count | spacing), ("sample.over.KEY", ends | spacing)):
        for name, (unit, default, allowed) in children.items():
            yield Key(f"{parent}.{name}", unit, default, MEANINGS[name], allowed)


def _fields(model):
    """Key as written -> field of a model, of pydantic: dict."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def dotted(path):
    """A path with "*" as a dotted key: `cables.NAME.loads.N.at`."""
    parts = []
    for i, part in enumerate(path):
        if part == "*":  # of `loads`: a place in the list, but the name of a cable in `cases.NAME.loads.NAME.N`
            in_list = (path[i - 1] in LISTS and path[i + 1] != "*") or path[i - 2 : i] == (*LISTS, "*")
            part = ANY[in_list]
        parts.append(part)
    return ".".join(parts)


def _description(field):
    """Unit, default, meaning and allowed values of a field, each as text."""
    number, words = _number_and_words([field.annotation, *field.metadata])
    unit, allowed = "", ", ".join(words)
    if isinstance(number, Quantity):
        unit = number.unit or NO_UNIT
        limits = number.limits.removeprefix("from ") or f"{number.low:g} to {number.high:g}"
        allowed = ", ".join((limits, *number.words)) if number.words else limits
    elif isinstance(number, Count):
        unit, allowed = NO_UNIT, f"{number.low} to {number.high}"
    return unit, _default(field), field.description, allowed


def _number_and_words(annotations):
    """The first Quantity or Count inside of the annotations of a field, or None; the words that are allowed."""
    words, to_visit = (), list(annotations)
    while to_visit:
        annotation = to_visit.pop(0)
        if isinstance(annotation, (Quantity, Count)):
            return annotation, words
        if get_origin(annotation) is Literal:
            words += get_args(annotation)
        elif annotation is bool:
            words += ("true", "false")
        elif isinstance(annotation, Either):  # the reader of a number is a method of its Quantity
            to_visit = [getattr(read, "__self__", None) for _, read in annotation.readers] + to_visit
        elif get_origin(annotation) in CONTAINERS:
            to_visit = [*get_args(annotation), *getattr(annotation, "__metadata__", ()), *to_visit]
    return None, words


def _default(field):
    """The default of a field as text."""
    value = field.default
    if value is PydanticUndefined:
        return REQUIRED
    return _written(value)


def _written(value):
    """A value as YAML has it; empty where there is nothing, and of a table, whose keys have their own defaults."""
    if value is None or value in ({}, (), "") or isinstance(value, KeyTable):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_written, value)) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)
