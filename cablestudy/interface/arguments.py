"""Arguments of the Python interface: each checked against its annotation, and values of numpy or pandas made plain."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Callable, Iterator, KeysView, Mapping, ValuesView
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import wraps
from numbers import Integral, Real
from typing import Any, Literal, ParamSpec, TypeVar, get_args, get_origin

from cablestudy.errors import Mistake, Mistakes, NoSolutionError, SceneError

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

    Parameters
    ----------
    value : object
    path : tuple of str
        Keys from the whole argument down to this value, for messages.

    Returns
    -------
    dict, list, str, int, float, bool or None

    Raises
    ------
    NotPlainError
        The value is, or contains, anything else, or is nested too deeply.
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


def key_of(key: object, path: tuple[str, ...] = ()) -> str:
    """A key of a mapping as text: text itself, or a whole number, as in `points: {1: ...}`."""
    key = unwrapped(key)
    if isinstance(key, bool) or not isinstance(key, (str, int)):
        where = f"{'.'.join(path)}: " if path else ""
        raise NotPlainError(f"{where}expected text as a key, got {shown(key)}")
    return str(key) if isinstance(key, str) or abs(key) < LONGEST_INTEGER else shown(key)


def refusal(value: object, path: tuple[str, ...]) -> NotPlainError:
    """The error for a value that a file has no form for."""
    where = f"{'.'.join(path)}: " if path else ""
    return NotPlainError(f"{where}expected {CONTENTS}, got {shown(value)}")


P = ParamSpec("P")
R = TypeVar("R")
RENAMED = {"with": "with_"}
_COMMAND_OR_OPTION = re.compile(r"'cablestudy[^']*'|(?<![\w-])--([a-z]+(?:-[a-z]+)*)")


@dataclass(frozen=True)
class Kind:
    """Values that an argument takes, as part of its annotation: `Annotated[int, Kind(...)]`.

    Attributes
    ----------
    expected : str
        For messages, for example "a whole number from 1 to 1000".
    read : callable
        What was given -> what the function is called with. It raises ValueError for a value of another kind, and
        `NotPlainError` for one inside it, whose message is shown as it is.
    """

    expected: str
    read: Callable[[Any], Any]


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator: check the arguments of a function of the interface; let its errors name arguments, not options.

    Raises
    ------
    SceneError
        Every argument that is not of the kind which its annotation names.
    TypeError
        One that the function does not have, or one that is missing.
    """

    @wraps(function)
    def checked_function(*args: P.args, **kwargs: P.kwargs) -> R:
        with argument_names():
            return call(function, *args, **kwargs)

    return checked_function


def call(function: Callable[..., R], *args: Any, **kwargs: Any) -> R:
    """Call a function with arguments converted by its annotations; all that are wrong are named in one error."""
    name = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]
    signature = inspect.signature(function)
    try:
        bound = signature.bind(*args, **kwargs)
    except TypeError as error:
        takes = ", ".join(argument for argument in signature.parameters if argument not in ("self", "scene"))
        raise TypeError(f"{name}: {error} (it takes {takes or 'none'})") from None
    with Mistakes() as mistakes:
        for argument, read in readers(function).items():
            if argument in bound.arguments:
                with mistakes.at(f"{name}: {argument}"):
                    bound.arguments[argument] = read(bound.arguments[argument])
    return function(*bound.args, **bound.kwargs)


_READERS: dict[Callable[..., Any], dict[str, Callable[[Any], Any]]] = {}


def readers(function: Callable[..., Any]) -> dict[str, Callable[[Any], Any]]:
    """Name of each argument of a function that has an annotation -> the function that reads it."""
    if function not in _READERS:
        annotations = {name: kind for name, kind in function.__annotations__.items() if name != "return"}
        _READERS[function] = {
            name: reader_of(eval(kind, function.__globals__) if isinstance(kind, str) else kind)
            for name, kind in annotations.items()
        }
    return _READERS[function]


def reader_of(annotation: Any) -> Callable[[Any], Any]:
    """The function that reads what an annotation allows, and raises ValueError with a message for anything else."""
    parts = get_args(annotation)
    kind = next((part for part in parts if isinstance(part, Kind)), None)
    optional = type(None) in parts
    if kind is not None:
        return lambda value: _read(kind, value)
    if get_origin(annotation) is Literal:
        return lambda value: _read_word(parts, value)
    if optional:
        (inner,) = (reader_of(part) for part in parts if part is not type(None))
        return lambda value: None if value is None else inner(value)
    if isinstance(annotation, type):
        expected = "True or False" if annotation is bool else f"a {annotation.__name__}"
        return lambda value: _read(Kind(expected, lambda given: _read_instance(annotation, given)), value)
    return unread


def unread(value: Any) -> Any:
    """The value itself."""
    return value


def _read(kind: Kind, value: Any) -> Any:
    """The value as its kind reads it; ValueError with a message that says what is expected."""
    try:
        return kind.read(value)
    except NotPlainError:
        raise
    except (ValueError, TypeError, OverflowError):
        raise ValueError(f"expected {kind.expected}, got {shown(value)}") from None


def _read_word(words: tuple[str, ...], value: Any) -> str:
    """One of some words; ValueError for anything else."""
    word = unwrapped(value)
    if not isinstance(word, str) or word not in words:
        raise ValueError(f"unknown {shown(value)} (allowed: {', '.join(words)})")
    return word


def _read_instance(kind: type, value: Any) -> Any:
    """An instance of a class; ValueError for anything else."""
    value = unwrapped(value) if kind is bool else value
    if not isinstance(value, kind):
        raise ValueError
    return value


@contextmanager
def argument_names() -> Iterator[None]:
    """Let errors name arguments, `input` for `--input`; commands in quotes stay as they are typed."""
    try:
        yield
    except SceneError as error:
        mistakes = [Mistake(in_python(found.where), found.key, in_python(found.message)) for found in error.mistakes]
        raise SceneError(*mistakes) from None
    except NoSolutionError as error:
        renamed = NoSolutionError(in_python(str(error)))
        for line in getattr(error, "__notes__", ()):
            renamed.add_note(line)
        raise renamed from None


def in_python(text: str) -> str:
    """A message in which options are called by the names of arguments."""

    def argument_name(match: re.Match[str]) -> str:
        option = match[1]  # None of a command in quotes
        return match[0] if option is None else RENAMED.get(option, option.replace("-", "_"))

    return _COMMAND_OR_OPTION.sub(argument_name, text)
