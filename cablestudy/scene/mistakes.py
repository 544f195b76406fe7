"""What pydantic found wrong -> one sentence each, with dotted key and place in the file, all at once."""

import re

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.fields import group_mistakes, suggestion
from cablestudy.scene.strict_yaml import mistake
from cablestudy.scene.units import show

MAX_SHOWN = 100


def collect(error, document, tables):
    """The SceneError for a ValidationError, sorted by place; at most 100 mistakes.

    Parameters
    ----------
    error : pydantic.ValidationError
        Of the model of the whole file.
    document : Document
        What was read.
    tables : dict
        Path of each mapping in the file ("*" for an index) -> its model.
    """
    found = [item for detail in error.errors(include_url=False) for item in _plain(detail, tables)]
    found += _groups(document.value, tables)
    # a cable of an unknown material lacks its numbers too: only the material is reported
    if any(path == ("cable", "material") for path, _ in found):
        found = [item for item in found if not (item[0] == ("cable",) and item[1].endswith("(or give material)"))]
    return located(dict.fromkeys(found), document)


def located(found, document):
    """SceneError from (path, message) pairs, each at its place in the document."""
    placed = []
    for path, message in found:
        about_key = message.startswith(("unknown key", "given together"))
        place = document.place(path, about_key)
        placed.append((place, mistake(place, ".".join(map(str, path)), message)))
    placed.sort(key=lambda item: item[0])
    return SceneError(*at_most([found for _, found in placed], document.name))


def at_most(mistakes, name):
    """The first 100 mistakes of a list, and one about the file `name` that counts those left out."""
    more = len(mistakes) - MAX_SHOWN
    return mistakes if more <= 0 else [*mistakes[:MAX_SHOWN], Mistake(name, "", f"and {more} more mistakes")]


# pydantic's kind of mistake -> what to say before ", got ..."
_EXPECTED = {
    "bool_type": "expected true or false",
    "string_type": "expected text",
    "string_too_short": "expected text",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
}


def _plain(detail, tables):
    """One finding of pydantic as (path, message) pairs."""
    path, kind, context, value = detail["loc"], detail["type"], detail.get("ctx", {}), detail["input"]
    if "found" in context:
        return [((*path, *inside), message) for inside, message in context["found"]]
    if kind == "cablestudy":
        return [(path, context["text"])]
    if kind == "extra_forbidden":
        return [(path, f"unknown key ({suggestion(path[-1], _keys(path[:-1], tables))})")]
    if kind == "missing":
        return [_missing(path, detail)]
    if kind == "literal_error":
        words = re.findall(r"'(\w+)'", context["expected"])
        hint = suggestion(value, words) if isinstance(value, str) else f"allowed: {', '.join(words)}"
        return [(path, f"got {show(value)} ({hint})")]
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        keys = _keys(path, tables)
        expected = f"a mapping with the keys {', '.join(keys)}" if keys else "a mapping"
        return [(path, f"expected {expected}, got {show(value)}")]
    if kind in ("too_long", "too_short"):
        limit = context.get("max_length", context.get("min_length"))
        bound = "at most" if kind == "too_long" else "at least"
        return [(path, f"expected {bound} {limit} item{'s' * (limit != 1)}, got {len(value)}")]
    expected = _EXPECTED.get(kind, f"{detail['msg'][:1].lower()}{detail['msg'][1:]}")
    return [(path, f"{expected}, got {show(value)}")]


def _missing(path, detail):
    """A key, or an item of a list of fixed length, that is not there: reported where it should be."""
    if isinstance(path[-1], int):
        expected = "2 points" if path[:-1] == ("cable", "ends") else "3 components"
        return path[:-1], f"expected {expected}, got {len(detail['input'])}"
    hint = " (or give material)" if path in (("cable", "elastic_modulus"), ("cable", "density")) else ""
    return path[:-1], f"missing key: {path[-1]}{hint}"


def _keys(path, tables):
    """The keys that the mapping at a path may have."""
    model = tables.get(tuple("*" if isinstance(part, int) else part for part in path))
    return list(model.model_fields) if model else []


def _groups(value, tables):
    """Exclusive groups in the raw file, because pydantic skips them where a single key is wrong."""
    found = []
    for path, model in tables.items():
        inside = value
        for part in path:
            inside = inside.get(part) if isinstance(inside, dict) else None
        if model.table and isinstance(inside, dict):
            mistakes = group_mistakes(model.table, inside, model.optional_groups)
            found += [((*path, *key), message) for key, message in mistakes]
    return found
