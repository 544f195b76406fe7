"""Mistakes of files, one sentence each with dotted key and place: what pydantic found, and keys without a value.

A key without a value that removes nothing is right where it is known, a mistake where it is not.
"""

import re
import sys

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.fields import fields_by_key, suggestion
from cablestudy.scene.layers import matches
from cablestudy.scene.strict_yaml import mistake
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show
from cablestudy.scene.words import counted

EMPTY_NAME = "no value (an empty mapping is written {})"
UNKNOWN, MISSING = "unknown key", "missing key"  # beginnings of messages
PLACE = re.compile(r"(.*?)(?::(\d+):(\d+))?", re.DOTALL)  # file:line:column, or the name of an option
DID_YOU_MEAN, WORD = re.compile(r"did you mean (.+)\?"), re.compile(r"\w+")
# How messages begin that are about a key rather than about its value.
ABOUT_KEYS = (UNKNOWN, "unknown cable", "no winch", "given together", "a name ", EMPTY_NAME)


def findings(error, value, tables):
    """Path and message of each mistake in a ValidationError of the model of the whole file: a list.

    `value` is what was read, as plain values; `tables` are from `fields.tables_of`.
    """
    of_pydantic = [pair for detail in error.errors(include_url=False) for pair in _paths_and_messages(detail, tables)]
    return _without_misspelt(of_pydantic + _key_mistakes(value, tables))


def _without_misspelt(found):
    """Findings without `missing key` for keys that are only misspelt: the finding on the unknown key names them."""
    meant = {}  # path of a table -> keys that its unknown ones may mean
    for path, message in found:
        if message.startswith(UNKNOWN) and (hint := DID_YOU_MEAN.search(message)):
            meant.setdefault(path[:-1], set()).update(hint[1].split(" or "))
    return [
        (path, message)
        for path, message in found
        if not (message.startswith(MISSING) and meant.get(path, set()).intersection(WORD.findall(message)))
    ]


def as_meant(value, found):
    """A file as plain values, with each table of it whose key is misspelt, under the key that is meant.

    What refers to names in that table is right: the unknown key is the one mistake, among the (path, message) pairs.
    """
    hints = {path[0]: DID_YOU_MEAN.search(message) for path, message in found
             if len(path) == 1 and message.startswith(UNKNOWN)}  # fmt: skip
    return {hint[1]: value[key] for key, hint in hints.items() if hint} | value


def located(found, document):
    """SceneError from (path, message) pairs, each once, sorted by place in the document; at most 100 mistakes."""
    mistakes_with_place = []
    for path, message in dict.fromkeys(found):
        place = _place_of(path, message, document)
        mistakes_with_place.append((place, mistake(place, ".".join(map(str, path)), message)))
    mistakes_with_place.sort(key=lambda pair: pair[0])
    return SceneError(*at_most([located_mistake for _, located_mistake in mistakes_with_place], document.name))


def _place_of(path, message, document):
    """Place of a mistake: that of its path, or of another key of the table that it names and that an option sets.

    Of two keys that do not fit each other the one is at fault that was set last. What a table lacks was removed by an
    option, or by one that replaces the table, of cables the one `cable` too.
    """
    of_key, others = message.startswith(ABOUT_KEYS), []
    words = WORD.findall(message.partition("(")[0])
    if message.startswith(MISSING):
        shared = [("cable",)] if path[:1] == ("cables",) and len(path) == 2 else []
        others = [(*table, word) for table in (path, *shared) for word in words] + shared
    elif not of_key and not document.is_override(path):
        others = [(*path[:-1], word) for word in words]
    path, of_key = next(((other, False) for other in others if document.is_override(other)), (path, of_key))
    return document.place(path, of_key)


def in_order(mistakes):
    """Mistakes, each once, by file and then by line and column, then those of the file as a whole: list."""
    files, keys = {}, {}
    for found in mistakes:
        name, line, column = PLACE.fullmatch(found.where).groups()
        keys[found] = files.setdefault(name, len(files)), int(line or sys.maxsize), int(column or 0)
    return sorted(keys, key=keys.get)


def at_most(mistakes, name):
    """The first `SCENE.listed_mistakes` of a list, and one about the file `name` that counts the others."""
    most = SCENE.listed_mistakes
    left_out = len(mistakes) - most
    return mistakes if left_out <= 0 else [*mistakes[:most], Mistake(name, "", f"and {left_out} more mistakes")]


OF_CASES = ("cases", "*")
LIKE_CABLE = ("cables", "materials")  # tables of which each has keys of `cable`
# What is written for a key -> the keys that are meant, where a table has them.
MEANT = {
    "length": ("chord", "unstretched_length"),
    "span": ("chord",),
    "weight": ("mass_per_length", "mass"),
    "stiffness": ("axial_stiffness",),
    "modulus": ("elastic_modulus",),
}

# pydantic's kind of mistake -> what to say before ", got ..."
_EXPECTED = {
    "bool_type": "expected true or false",
    "string_type": "expected text",
    "string_too_short": "expected text",
    "string_unicode": "expected text in UTF-8",
    "empty_name": "a name has at least one character",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
}


def _paths_and_messages(detail, tables):
    """Path and message of each mistake in an item of `ValidationError.errors()`; a table may have several."""
    path, kind, context, value = detail["loc"], detail["type"], detail.get("ctx", {}), detail["input"]
    if path[-1:] == ("[key]",):  # a name that the user chose, for example of a cable
        path, value = path[:-1], path[-2]
        kind = "empty_name" if kind == "string_too_short" else kind
    if "found" in context:  # mistakes of one table, from `KeyTable`
        return [((*path, *path_in_table), message) for path_in_table, message in context["found"]]
    if kind == "missing":
        return [_missing_item(path, detail)]
    if kind in ("too_long", "too_short"):
        return [(path, message) for message in _wrong_length_messages(kind, context, value)]
    return [(path, _message(path, kind, value, detail, tables))]


def _message(path, kind, value, detail, tables):
    """The message on the value, or the key, at a path, of an error of pydantic of a kind."""
    if kind == "cablestudy":  # an error of a check of this program, with its own text
        return detail["ctx"]["text"]
    if kind == "extra_forbidden":
        return _unknown_key_message(path, tables)
    if kind == "literal_error":
        return _wrong_word_message(detail["ctx"]["expected"], value)
    if kind == "tuple_type" and path[-1] == "loads" and isinstance(value, dict) and "".join(value).isdigit():
        return f"the list is not there, so that it has no item {next(iter(value))}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        keys = keys_at(path, tables)
        expected = f"expected a mapping with the keys {', '.join(keys)}" if keys else "expected a mapping"
    else:
        expected = _EXPECTED.get(kind, f"{detail['msg'][:1].lower()}{detail['msg'][1:]}")
    by_names = kind == "tuple_type" and isinstance(value, dict) and not "".join(map(str, value)).isdigit() and value
    return f"{expected}, got {show(value)}" + (' (each item of a list begins with "- ")' if by_names else "")


def _wrong_word_message(expected, value):
    """The message on a value that is none of some words, which pydantic expects in quotes."""
    words = re.findall(r"'(\w+)'", expected)
    hint = suggestion(value, words) if isinstance(value, str) else f"allowed: {', '.join(words)}"
    return f"got {show(value)} ({hint})"


def _unknown_key_message(path, tables):
    """The message on an unknown key, with the keys that may be meant."""
    known, name = keys_at(path[:-1], tables), path[-1]
    plural = [key for key in known if name in (f"{key}s", key.removesuffix("s"))]
    meant = plural or _same_key_elsewhere(path, tables) or [key for key in MEANT.get(name, ()) if key in known]
    return f"unknown key (did you mean {' or '.join(meant)}?)" if meant else unknown_key(name, known)


def _wrong_length_messages(kind, context, value):
    """The message, in a list, on too few or too many items; empty where items that are wrong are reported already."""
    limit = context.get("max_length", context.get("min_length"))
    if kind == "too_short" and len(value) >= limit:  # pydantic leaves out the items that are wrong
        return []
    return [f"expected {'at most' if kind == 'too_long' else 'at least'} {counted(limit, 'item')}, got {len(value)}"]


def _same_key_elsewhere(path, tables):
    """Dotted keys like an unknown one but in another table, where the user may have meant to write it: list of str.

    A key at the top level is searched for in all tables, others in the tables inside of their own and in load cases;
    not in lists, nor in tables inside of those with a name.
    """
    parent, name = path[:-1], path[-1]
    found = []
    for pattern, _ in tables:
        below = pattern[len(parent) :] if matches(pattern[: len(parent)], parent) else ()
        is_named_table = not parent and len(below) == 2 and below[0] not in LIKE_CABLE
        is_below = below and ("*" not in below or is_named_table)
        if (is_below or (0 < len(parent) < 3 and pattern == OF_CASES)) and name in keys_at(pattern, tables):
            parts = (*parent, *below, name) if below else (*pattern, name)
            found.append(".".join("NAME" if part == "*" else str(part) for part in parts))
    return list(dict.fromkeys(found))  # a reaction mass and a wheel have keys of one name


def _missing_item(path, detail):
    """Path of a table or list, and the message that a key, or an item of a list of fixed length, is not there."""
    if isinstance(path[-1], int):
        expected = "2 points" if path[:-1] == ("cable", "ends") else "3 components"
        return path[:-1], f"expected {expected}, got {len(detail['input'])}"
    return path[:-1], f"missing key: {path[-1]}"


def _key_mistakes(value, tables):
    """Path and message of exclusive and missing keys of all tables: pydantic skips them where one key is wrong."""
    mistakes = []
    for pattern, model in tables:
        for path, mapping in _mappings_at(value, pattern) if model.table and "loads" not in pattern else ():
            mistakes += [((*path, *key), message) for key, message in model.key_mistakes(mapping)]
    return mistakes


def _mappings_at(value, pattern, path=()):
    """Yield path and value of each mapping whose path matches a pattern, in which "*" stands for any name."""
    if not isinstance(value, dict):
        return
    if not pattern:
        yield path, value
        return
    for name in value if pattern[0] == "*" else (pattern[0],):
        yield from _mappings_at(value.get(name), pattern[1:], (*path, name))


def unknown_key(name, known):
    """The message of a key that a table does not have.

    YAML takes `{ratio:0.02}`, without a blank, for a key "ratio:0.02" that has no value. Keys are not merged by `<<`.
    """
    if name == "<<":
        return "unknown key (keys are not merged: write them out, or put them into a file that base names)"
    key, colon, value = name.partition(":")
    if colon and value and key in known:
        return f"unknown key ({add_blank(name)})"
    return f"unknown key ({suggestion(name, known)})"


def add_blank(name):
    """Text to write instead of a key with a colon in it."""
    key, _, value = name.partition(":")
    return f"write {key}: {value.strip()}, with a blank after the colon"


def empty_keys(document, tables):
    """Yield path and message of wrong keys without a value: those that no model has, and names of the user."""
    for path in document.empty:
        known = keys_at(path[:-1], tables)
        if known and path[-1] not in known:
            yield path, unknown_key(path[-1], known)
        elif not (known or document.is_override(path)) and path[1:] and path[-2] in keys_at(path[:-2], tables):
            yield path, EMPTY_NAME  # in a mapping such as `cables`, whose keys are names of the user


def keys_at(path, tables):
    """The keys that the mapping at a path may have; empty where any name is right, and where nothing is known.

    Of two models of a path (see `tables_of`) those of the first.
    """
    model = next((model for pattern, model in tables if matches(pattern, path)), None)
    return list(fields_by_key(model)) if model else []
