"""Values that Python gives, numbers of numpy, arrays, Series and paths among them, as the plain values of a file."""

from __future__ import annotations

import os
from collections.abc import KeysView, Mapping, ValuesView
from contextlib import suppress
from numbers import Integral, Real
from typing import Any

LISTS = (list, tuple, range, KeysView, ValuesView)
NUMBERS_AND_TEXT = "biufUOT"  # kinds of numpy's data types that a file has values for; O: looked at one by one
DEEPEST = 60  # more than a file may be nested
LONGEST_INTEGER = 10**400
LONGEST_SHOWN = 60  # characters of a value in a message
CONTENTS = "mappings with text as keys, lists, text and numbers"


class NotPlainError(ValueError):
    """A value for which a file has no form; its message says where it stands in what was given, and what it is."""


def shown(value: object) -> str:
    """A value in a message: a number or text as Python writes it, of anything else its type; one short line."""
    value = unwrapped(value)
    if isinstance(value, (str, bytes)):
        return repr(value) if len(value) <= LONGEST_SHOWN else f"{value[: LONGEST_SHOWN - 3]!r}..."
    if isinstance(value, int) and abs(value) >= LONGEST_INTEGER:
        return "an integer of more than 400 digits"
    if value is None or isinstance(value, (bool, int, float, complex)):
        return repr(value)
    if isinstance(value, type):
        return f"the class {value.__name__:.60}"
    name = type(value).__name__.replace("ndarray", "array")
    return f"{'an' if name[0] in 'aeiouAEIOU' else 'a'} {name:.60}"


def unwrapped(value: Any) -> Any:
    """A number or text of numpy, or of a class that is made from Python's, as Python's own; anything else itself."""
    if type(value) in (str, int, float, bool):
        return value
    if is_array(value) and not value.shape:
        value = value.tolist()  # None where it is masked
    if isinstance(value, bool):
        return value
    with suppress(OverflowError):  # a fraction that no float is near
        if isinstance(value, str):
            return str.__str__(value)
        if isinstance(value, Real):
            return int(value) if isinstance(value, Integral) else float(value)
    return value


def is_array(value: Any) -> bool:
    """True if a value is an array, or a number of numpy, or a Series, of numbers or text."""
    kind = getattr(getattr(value, "dtype", None), "kind", None)
    return isinstance(kind, str) and kind in NUMBERS_AND_TEXT and hasattr(value, "tolist")


def mapping_of(value: Any) -> Mapping[Any, Any] | None:
    """A mapping itself, a Series with an index of text as one; None of anything else."""
    if isinstance(value, Mapping):
        return value
    if is_array(value) and hasattr(value, "to_dict") and len(value) and isinstance(value.index[0], str):
        return value.to_dict()  # type: ignore[no-any-return]
    return None


def list_of(value: Any) -> list[Any] | None:
    """A list, tuple, range, view of a dict, array or Series as a list; None of anything else, of text too."""
    if isinstance(value, LISTS):
        return list(value)
    return list(value.tolist()) if is_array(value) and value.shape else None


def plain(value: Any, path: tuple[str, ...] = ()) -> Any:
    """Convert a value that Python code gives, such as a numpy array or Path, to a value that a YAML file can hold.

    `path` are the keys from the whole argument down to this value, for messages. NotPlainError: the value is, or
    contains, anything else, or is nested too deeply.
    """
    value = unwrapped(value)
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, int) and abs(value) >= LONGEST_INTEGER:
        raise refusal(value, path)
    if value is None or isinstance(value, (str, int, float)):
        return value
    if len(path) > DEEPEST:
        raise NotPlainError(f"{'.'.join(path[:3])}...: nested more than {DEEPEST} deep")
    mapping = mapping_of(value)
    if mapping is not None:
        return {key_of(key, path): plain(item, (*path, str(key))) for key, item in mapping.items()}
    items = list_of(value)
    if items is None:
        raise refusal(value, path)
    return [plain(item, (*path, str(index))) for index, item in enumerate(items)]


def key_of(key: object, path: tuple[str, ...]) -> str:
    """A key of a mapping as text: text itself, or a whole number, as in `points: {1: ...}`."""
    key = unwrapped(key)
    if isinstance(key, bool) or not isinstance(key, (str, int)):
        raise refusal(key, path, "text as a key")
    return str(key) if isinstance(key, str) or abs(key) < LONGEST_INTEGER else shown(key)


def refusal(value: object, path: tuple[str, ...], expected: str = CONTENTS) -> NotPlainError:
    """The error for a value that a file has no form for."""
    where = f"{'.'.join(path)}: " if path else ""
    return NotPlainError(f"{where}expected {expected}, got {shown(value)}")
