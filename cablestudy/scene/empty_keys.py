"""Keys without a value that remove nothing: right where a key is known, a mistake where it is not."""

from cablestudy.scene.fields import suggestion, table_at

EMPTY_NAME = "no value (an empty mapping is written {})"


def unknown_key(name, known):
    """The message of a key that a table does not have.

    YAML takes `{ratio:0.02}`, without a blank, for a key "ratio:0.02" that has no value.
    """
    key, colon, value = name.partition(":")
    if colon and value and key in known:
        return f"unknown key ({add_blank(name)})"
    return f"unknown key ({suggestion(name, known)})"


def add_blank(name):
    """Text to write instead of a key with a colon in it."""
    key, _, value = name.partition(":")
    return f"write {key}: {value.strip()}, with a blank after the colon"


def empty_keys(document, tables):
    """Yield path and message of what a document's `empty` keys have wrong: each that no model has, each name.

    Parameters
    ----------
    document : Document
    tables : list of (tuple, type)
        From `fields.tables_of`.
    """
    for path in document.empty:
        known = keys_at(path[:-1], tables)
        if known and path[-1] not in known:
            yield path, unknown_key(path[-1], known)
        elif not (known or document.is_override(path)) and _holds_names(path[:-1], tables):
            yield path, EMPTY_NAME


def _holds_names(path, tables):
    """Whether the mapping at a path is a key that is known, and has names of the user as keys."""
    return bool(path) and path[-1] in keys_at(path[:-1], tables)


def keys_at(path, tables):
    """The keys that the mapping at a path may have; empty where any name is right, and where nothing is known."""
    model = table_at(tables, path)
    return [field.alias or name for name, field in model.model_fields.items()] if model else []
