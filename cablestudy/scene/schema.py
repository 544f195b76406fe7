"""JSON Schema of the files, for editors: pydantic's schema of the models, and rules that only reading a file checks."""

from itertools import combinations

from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from cablestudy.scene.entries import ALL, ALTERNATIVE
from cablestudy.scene.layers import ALTERNATIVES, OF_CABLE, OF_SECTION, prune
from cablestudy.scene.materials import materials
from cablestudy.scene.ranges import MAX_COUNT, MEANINGS, SPACINGS
from cablestudy.scene.scene import TABLES
from cablestudy.scene.study import StudyTable
from cablestudy.scene.suspension import SUSPENSION_TABLES

DIALECT = "https://json-schema.org/draft/2020-12/schema"
BASE = {"type": "string", "minLength": 1, "description": "File that this one changes, relative to this file"}
# A scene upon a base may lack any key; what is inside of a list or a gain is never merged.
_ALWAYS_WHOLE = ("Load", "AutoGain", "Margin")
_SECTION = (  # of each row one must be given: stiffness, mass, and a size or what makes one unnecessary
    tuple({"required": [key]} for key in ("material", "axial_stiffness", "elastic_modulus", "stress_strain")),
    ({"required": ["material"]}, {"required": ["mass_per_length"]}, {"required": ["density"]}),
    ({"required": ["area"]}, {"required": ["diameter"]}, {"required": ["axial_stiffness", "mass_per_length"]}),
)


def scene_schema():
    """JSON Schema (draft 2020-12) of a scene file.

    Returns
    -------
    dict
        With `base:` present, keys may be missing; without, the schema asks for all that a scene needs.
    """
    return _file_schema("scene", TABLES, "Controller")


def suspension_schema():
    """JSON Schema (draft 2020-12) of a scene file with several cables; see `scene_schema`.

    Returns
    -------
    dict
    """
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
    """JSON Schema (draft 2020-12) of a study file, by which editors check and complete it.

    Returns
    -------
    dict
        Schema that pydantic makes of `StudyTable`, and the form of values, ranges and alternatives of varied keys.
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
        "count": {"type": "integer", "minimum": 1, "maximum": MAX_COUNT},
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
    """Conditions that no two keys of a table are given which belong to groups that exclude each other: a list."""
    return [
        {"not": {"required": [key, excluded]}}
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
