"""Keys of the files, read from the models: JSON Schema for editors; lists with units, defaults, ranges and meanings.

The schema is that of pydantic, with rules that only reading a file checks.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Literal, get_args, get_origin

from pydantic.json_schema import GenerateJsonSchema, models_json_schema
from pydantic_core import PydanticUndefined

from cablestudy.scene.entries import ALTERNATIVE
from cablestudy.scene.fields import ALL, Count, Either, KeyTable, Quantity, fields_by_key, parts_of
from cablestudy.scene.layers import ALTERNATIVES, OF_CABLE, OF_SECTION, prune
from cablestudy.scene.materials import materials
from cablestudy.scene.ranges import MEANINGS, SPACINGS
from cablestudy.scene.scene import TABLES
from cablestudy.scene.study import TABLES as STUDY_TABLES
from cablestudy.scene.study import StudyTable
from cablestudy.scene.suspension import SUSPENSION_TABLES
from cablestudy.scene.tolerances import SCENE

DIALECT = "https://json-schema.org/draft/2020-12/schema"
BASE = {"type": "string", "minLength": 1, "description": "File that this one changes, relative to this file"}
# A scene upon a base may lack any key; what is inside of a list or a gain is never merged.
_ALWAYS_WHOLE = ("Load", "AutoGain", "Margin")
_GIVEN = {"not": {"type": "null"}}
_SECTION = tuple(  # of each row one must be given: stiffness, mass, and a size or what makes one unnecessary
    tuple({"required": keys.split()} for keys in row)
    for row in (
        ("material", "axial_stiffness", "elastic_modulus", "stress_strain"),
        ("material", "mass_per_length", "density"),
        ("material", "area", "diameter", "axial_stiffness mass_per_length"),  # a rope has a size of its own
    )
)


def scene_schema():
    """JSON Schema (draft 2020-12) of a scene file: dict.

    With `base:` present, keys may be missing; without, the schema asks for all that a scene needs.
    """
    return _file_schema("scene", TABLES, "Controller")


def suspension_schema():
    """JSON Schema (draft 2020-12) of a scene file with several cables; see `scene_schema`."""
    return _file_schema("suspension", SUSPENSION_TABLES, "Control")


def _file_schema(kind, tables, controller):
    """JSON Schema of a kind of scene file, from its `tables_of`; `controller` is the model that has the key `notch`."""
    models = [(model, "validation") for _, model in tables]
    definitions = models_json_schema(models, schema_generator=_PlainSchema)[1]["$defs"]
    conditions = {}  # path of a table -> what it must have in a file without a base
    for path, model in tables:
        table = definitions[model.__name__]
        condition = _completeness(model, table)
        conditions[path] = {"anyOf": [conditions[path], condition]} if path in conditions else condition
        _allow_parts(model, table)
        if "material" in table["properties"]:
            _name_materials(table)
    definitions[controller]["properties"]["notch"]["anyOf"].append({"const": "none"})
    schema = definitions.pop(tables[0][1].__name__)
    schema["properties"] = {"base": BASE, **schema["properties"], "materials": _materials(schema)}
    schema |= {"if": {"required": ["base"]}, "else": _nested(conditions)}
    return {"$schema": DIALECT, "title": f"cablestudy {kind}", **schema, "$defs": definitions}


def _allow_parts(model, table):
    """Let a table of a file lack keys, which `base` may have, but not have keys that exclude each other."""
    if model.__name__ not in _ALWAYS_WHOLE:
        table.pop("required", None)
    if pairs := _exclusions(model.table):
        table["allOf"] = pairs


def study_schema():
    """JSON Schema (draft 2020-12) of a study file: dict.

    It is that of pydantic for `StudyTable`, with the form of values, ranges and alternatives of varied keys.
    """
    schema = StudyTable.model_json_schema(schema_generator=_PlainSchema)
    definitions = schema.pop("$defs")
    dotted = {"pattern": r"^[^.\s]+(\.[^.\s]+)*$"}  # a key such as cable.area
    definitions["Values"] = {
        "anyOf": [{"type": "array", "minItems": 1}, {"$ref": "#/$defs/Range"}],
        "description": "List of values, or a range",
    }
    definitions["Range"] = _range_schema("from", "to", "count", "spacing")
    definitions["Interval"] = _range_schema("from", "to", "spacing")
    definitions["Sample"]["properties"]["over"] |= {
        "propertyNames": dotted,
        "additionalProperties": {"$ref": "#/$defs/Interval"},
    }
    properties = schema["properties"]
    properties["set"] |= {"propertyNames": dotted}
    properties["vary"]["items"] = {
        "type": "object",
        "minProperties": 1,
        "propertyNames": dotted,
        "additionalProperties": {"$ref": "#/$defs/Values"},
        "patternProperties": {
            "^case$": {"anyOf": [{"$ref": "#/$defs/Values"}, {"const": ALL}]},
            f"^{ALTERNATIVE}$": {
                "type": "object",
                "minProperties": 1,
                "additionalProperties": {"type": "object", "propertyNames": dotted},
                "description": "Name -> changes that are made together: dotted key -> value",
            },
        },
    }
    properties["columns"]["uniqueItems"] = True
    list_of_names = definitions["Plot"]["properties"]["y"]  # one name may stand in its place
    description = {"description": list_of_names.pop("description")}
    one_name = {"type": "string", "minLength": 1}
    definitions["Plot"]["properties"]["y"] = {**description, "anyOf": [one_name, list_of_names]}
    return {"$schema": DIALECT, "title": "cablestudy study", **schema, "$defs": definitions}


def _range_schema(*keys):
    """Schema of a range of values, or of the interval that a sample draws from, by the keys that it has."""
    end = {"anyOf": [{"type": "number"}, {"type": "string"}]}
    schemas = {
        "from": end,
        "to": end,
        "count": {"type": "integer", "minimum": 1, "maximum": SCENE.cases},
        "spacing": {"enum": list(SPACINGS), "default": "linear"},
    }
    return {
        "type": "object",
        "description": "count values, ends included" if "count" in keys else "Interval that is sampled",
        "properties": {key: {**schemas[key], "description": MEANINGS[key]} for key in keys},
        "required": [key for key in keys if key != "spacing"],
        "additionalProperties": False,
    }


class _PlainSchema(GenerateJsonSchema):
    """pydantic's schema without titles, docstrings and null defaults, of which an editor has no use."""

    def field_title_should_be_set(self, schema):
        return False

    def model_schema(self, schema):
        table = super().model_schema(schema)
        return {key: value for key, value in table.items() if key not in ("title", "description")}

    def default_schema(self, schema):
        return prune(super().default_schema(schema))


def _exclusions(table):
    """Conditions that no two keys of a table are given which belong to groups that exclude each other: a list.

    A key that is null is not given: it is removed from what a base has.
    """
    return [
        {"not": {"required": [key, excluded], "properties": {key: _GIVEN, excluded: _GIVEN}}}
        for groups in ALTERNATIVES.get(table, ())
        for group, other_group in combinations(groups, 2)
        for key in group
        for excluded in other_group
    ]


def _completeness(model, table):
    """Condition that a mapping has all keys it needs; `table` is the schema of its model, with its `required`."""
    required = table.get("required", ())
    conditions = [{"anyOf": list(alternatives)} for alternatives in _SECTION] if model.table == "cable" else []
    if not model.optional_groups:
        for groups in ALTERNATIVES.get(model.table, ()):
            if groups not in OF_SECTION + OF_CABLE:
                conditions.append({"oneOf": [{"required": [group[0]]} for group in groups]})
    return ({"required": list(required)} if required else {}) | ({"allOf": conditions} if conditions else {})


def _name_materials(table):
    """Let an editor offer the built-in materials; a scene may have others."""
    table["properties"]["material"]["anyOf"][0] = {"anyOf": [{"enum": list(materials())}, {"type": "string"}]}


def _materials(schema):
    """The key `materials`: the name of a file, or its contents."""
    contents = dict(schema["properties"]["materials"])
    file = {"type": "string", "minLength": 1, "description": "File of materials, relative to this file"}
    return {"description": contents.pop("description"), "anyOf": [file, contents]}


def _nested(conditions):
    """One condition on the whole file, from those on its tables by path; lists and gains carry their own."""
    file_condition = dict(conditions[()])
    for path, condition in conditions.items():
        if not path or "loads" in path or "gain" in path or not condition:
            continue
        schema = file_condition
        for part in path:  # to the place of the table, making what is missing on the way
            parent = schema if part == "*" else schema.setdefault("properties", {})
            schema = parent.setdefault("additionalProperties" if part == "*" else part, {})
        schema |= condition
    return file_condition


KINDS = ("scene", "suspension", "study")
ANY = ("NAME", "N")  # stand for any name, and any place in a list
LISTS = ("loads",)  # tables that hold a list, not names
NO_UNIT = "-"  # of a pure number
REQUIRED = "required"


@dataclass(frozen=True)
class Key:
    """One key of a file."""

    key: str  # dotted; NAME stands for any name and N for a place in a list, from 0
    unit: str  # of a bare number, and of the limits; "-" of a pure number; empty of what is no number
    default: str  # as it would be written; "required" where there is none; empty where nothing stands for a missing key
    meaning: str
    allowed: str  # range, or the words that it may be


def keys_of(kind):
    """List of `Key` of a file.

    Parameters
    ----------
    kind : {"scene", "suspension", "study"}
        A scene of one cable, of several, or a study.
    """
    if kind == "study":
        return [*_keys_in(STUDY_TABLES), *_keys_of_ranges()]
    tables = TABLES if kind == "scene" else SUSPENSION_TABLES
    return [Key("base", "", "", BASE["description"], ""), *_keys_in(tables)]


def _keys_in(tables):
    """Yield each `Key` of the tables of a file, from `fields.tables_of`, each table after the other, each key once.

    What cables of a suspension share with `cable` is listed there only.
    """
    listed = set()
    shared = {(*path[1:], name) for path, model in tables if path[:1] == ("cable",) for name in fields_by_key(model)}
    for table_path, model in tables:
        for name, field in fields_by_key(model).items():
            path = (*table_path, name)
            if path in listed or (path[:2] == ("cables", "*") and path[2:] in shared):
                continue
            listed.add(path)
            yield Key(dotted(path), *_description(field))


def _keys_of_ranges():
    """Yield the keys inside of `vary` and `sample`: of ranges, of alternatives, of intervals that are sampled."""
    ends = {"from": ("", REQUIRED, ""), "to": ("", REQUIRED, "")}
    count = {"count": (NO_UNIT, REQUIRED, f"1 to {SCENE.cases}")}
    spacing = {"spacing": ("", SPACINGS[0], ", ".join(SPACINGS))}
    yield Key("vary.N.KEY", "", "", "Values of a dotted key of the scene: a list, or a range of the keys below", "")
    changes = "Name of an alternative, and the changes that it makes: dotted key -> value; a column has the names"
    yield Key("vary.N.alternative.NAME", "", "", changes, "")
    for parent, children in (("vary.N.KEY", ends | count | spacing), ("sample.over.KEY", ends | spacing)):
        for name, (unit, default, allowed) in children.items():
            yield Key(f"{parent}.{name}", unit, default, MEANINGS[name], allowed)


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
    number, words = _number_and_words(field)
    unit, allowed = "", ", ".join(words)
    if isinstance(number, Quantity):
        unit = number.unit or NO_UNIT
        limits = number.limits.removeprefix("from ") or f"{number.low:g} to {number.high:g}"
        allowed = ", ".join((limits, *number.words)) if number.words else limits
    elif isinstance(number, Count):
        unit, allowed = NO_UNIT, f"{number.low} to {number.high}"
    default = REQUIRED if field.default is PydanticUndefined else _written(field.default)
    return unit, default, field.description, allowed


def _number_and_words(field):
    """The first Quantity or Count inside of the annotation of a field, or None; the words that are allowed."""
    words = ()
    for part in parts_of(field):
        readers = [read for _, read, *_ in part.options] if isinstance(part, Either) else []
        for number in (part, *(getattr(read, "__self__", None) for read in readers)):  # which are methods of a Quantity
            if isinstance(number, Quantity | Count):
                return number, words
        if get_origin(part) is Literal:
            words += get_args(part)
        elif part is bool:
            words += ("true", "false")
    return None, words


def _written(value):
    """A value as YAML has it; empty where there is nothing, and of a table, whose keys have their own defaults."""
    if value is None or value in ({}, (), "") or isinstance(value, KeyTable):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_written, value)) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)
