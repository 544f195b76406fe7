"""Arguments of the Python interface, each checked against its annotation before anything is done with it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, wraps
from typing import Any, Literal, ParamSpec, TypeVar, get_args, get_origin

from cablestudy.errors import Mistake, Mistakes, NoSolutionError, SceneError
from cablestudy.interface.plain import NotPlainError, shown, unwrapped

P = ParamSpec("P")
R = TypeVar("R")
RENAMED = {"with": "with_"}
_COMMAND_OR_OPTION = re.compile(r"'cablestudy[^']*'|(?<![\w-])--([a-z]+(?:-[a-z]+)*)")


@dataclass(frozen=True)
class Kind:
    """Values that an argument takes, as part of its annotation: `Annotated[int, Kind(...)]`.

    `read` makes of what was given what the function is called with. It raises ValueError for a value of another kind,
    and `NotPlainError` for one inside it, whose message is shown as it is.
    """

    expected: str  # for messages, such as "a whole number from 1 to 1000"
    read: Callable[[Any], Any]


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator: convert the arguments of a function of the interface by their annotations; let its errors name them.

    SceneError for all that are not of the kind which their annotation names, TypeError for one that the function does
    not have or that is missing.
    """
    name = function.__qualname__.removesuffix(".__init__").rpartition(".")[2]

    @wraps(function)
    def checked_function(*args: P.args, **kwargs: P.kwargs) -> R:
        signature = inspect.signature(function)
        try:
            bound = signature.bind(*args, **kwargs)
        except TypeError as error:
            takes = ", ".join(argument for argument in signature.parameters if argument != "self")
            raise TypeError(f"{name}: {error} (it takes {takes or 'none'})") from None
        with argument_names():
            with Mistakes() as mistakes:
                for argument, read in readers(function).items():
                    if argument in bound.arguments:
                        with mistakes.at(f"{name}: {argument}"):
                            bound.arguments[argument] = read(bound.arguments[argument])
            return function(*bound.args, **bound.kwargs)

    return checked_function


@cache
def readers(function: Callable[..., Any]) -> dict[str, Callable[[Any], Any]]:
    """Name of each argument of a function that has an annotation, which is text, -> the function that reads it."""
    annotations = {name: kind for name, kind in function.__annotations__.items() if name != "return"}
    return {name: reader_of(eval(kind, function.__globals__)) for name, kind in annotations.items()}


def reader_of(annotation: Any) -> Callable[[Any], Any]:
    """The function that reads what an annotation allows, and raises ValueError with a message for anything else."""
    parts = get_args(annotation)
    kind = next((part for part in parts if isinstance(part, Kind)), None)
    if kind is not None:
        return lambda value: _read(kind, value)
    if get_origin(annotation) is Literal:
        return lambda value: _read_word(parts, value)
    if type(None) in parts:
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
