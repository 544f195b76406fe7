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
        return [*_walk(STUDY_TABLES), *_ranges()]
    tables = SCENE_TABLES if kind == "scene" else SUSPENSION_TABLES
    return [Key("base", "", "", BASE["description"], ""), *_walk(tables)]


def _walk(tables):
    """Yield the keys of `fields.tables_of` a file, each table after the other, each key once.

    What cables of a suspension share with `cable` is listed there only.
    """
    seen = set()
    shared = {(*path[1:], name) for path, model in tables if path[:1] == ("cable",) for name in _names(model)}
    for path, model in tables:
        for name, field in _names(model).items():
            full = (*path, name)
            if full in seen or (full[:2] == ("cables", "*") and full[2:] in shared):
                continue
            seen.add(full)
            yield Key(dotted(full), *_described(field))


def _ranges():
    """Yield the keys of what varies: a list of values, or a range; and of what is sampled."""
    ends = {"from": ("", REQUIRED, ""), "to": ("", REQUIRED, "")}
    count = {"count": (NO_UNIT, REQUIRED, f"1 to {MAX_COUNT}")}
    spacing = {"spacing": ("", SPACINGS[0], ", ".join(SPACINGS))}
    yield Key("vary.N.KEY", "", "", "Values of a dotted key of the scene: a list, or a range of the keys below", "")
    changes = "Name of an alternative, and the changes that it makes: dotted key -> value; a column has the names"
    yield Key("vary.N.alternative.NAME", "", "", changes, "")
    for place, inside in (("vary.N.KEY", ends | count | spacing), ("sample.over.KEY", ends | spacing)):
        for name, (unit, default, allowed) in inside.items():
            yield Key(f"{place}.{name}", unit, default, MEANINGS[name], allowed)


def _names(model):
    """Key as written -> field of a model."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def dotted(path):
    """A path with "*" as a dotted key: `cables.NAME.loads.N.at`."""
    parts = []
    for place, part in enumerate(path):
        in_list = (path[place - 1] in LISTS and path[place + 1] != "*") or path[place - 2 : place] == (*LISTS, "*")
        parts.append(part if part != "*" else ANY[in_list])
    return ".".join(parts)


def _described(field):
    """Unit, default, meaning and allowed values of a field."""
    number, words = _kind([field.annotation, *field.metadata])
    unit, allowed = "", ", ".join(words)
    if isinstance(number, Quantity):
        unit = number.unit or NO_UNIT
        limits = number.limits.removeprefix("from ") or f"{number.low:g} to {number.high:g}"
        allowed = ", ".join((limits, *number.words)) if number.words else limits
    elif isinstance(number, Count):
        unit, allowed = NO_UNIT, f"{number.low} to {number.high}"
    return unit, _default(field), field.description, allowed


def _kind(kinds):
    """The Quantity or Count inside of the types of a field, or None; the words that are allowed."""
    words = ()
    while kinds:
        kind = kinds.pop(0)
        if isinstance(kind, (Quantity, Count)):
            return kind, words
        if get_origin(kind) is Literal:
            words += get_args(kind)
        elif kind is bool:
            words += ("true", "false")
        elif isinstance(kind, Either):
            kinds = [getattr(read, "__self__", None) for _, read in kind.readers] + kinds
        elif get_origin(kind) in CONTAINERS:
            kinds = [*get_args(kind), *getattr(kind, "__metadata__", ()), *kinds]
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
