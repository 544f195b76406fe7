"""Errors that a user can cause, each class with its exit code.

This module imports nothing of the package, so that every layer can raise them.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar


class CablestudyError(Exception):
    """Any error that a user can cause; its message is one complete line, printed without a traceback."""

    exit_code: ClassVar[int] = 3

    @property
    def without_places(self) -> str:
        """The message in one line, for the status of a row."""
        return one_line(self)


LONGEST_NAME = 255  # bytes of the name of a file
LONGEST = {"where": 300, "key": 100, "message": 600}  # characters of each part of a mistake


def shorten(text: str, limit: int) -> str:
    """Text of at most `limit` characters: the middle of a longer one, from word to word, is replaced by `...`."""
    if len(text) <= limit:
        return text
    half = (limit - 3) // 2
    begin, end = text[: limit - 3 - half], text[-half:]
    words_before, words_after = begin.rpartition(" "), end.partition(" ")
    if len(words_before[2]) < half // 4 and len(words_after[0]) < half // 4:
        begin, end = words_before[0] + " ", " " + words_after[2]
    return f"{begin}...{end}"


def printable(text: str) -> str:
    """Text in which characters that move a cursor or colour a terminal, line breaks too, are written as escapes."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text)


def one_line(text: object) -> str:
    """Text of an error, or of anything else, without line breaks and with single blanks."""
    return " ".join(str(text).split())


@dataclass(frozen=True)
class Mistake:
    """One mistake in what the user wrote. Long parts are cut, since they may quote a value of any length.

    Attributes
    ----------
    where : str
        `file:line:column`, or the command-line option; empty when neither is known.
    key : str
        The dotted key, for example `cable.density`; empty when the mistake is not about one key.
    message : str
        What is wrong, the value found and what is allowed.
    """

    where: str
    key: str
    message: str

    def __post_init__(self) -> None:
        for name, limit in LONGEST.items():
            object.__setattr__(self, name, shorten(printable(getattr(self, name)), limit))

    def __str__(self) -> str:
        return ": ".join(part for part in (self.where, self.key, self.message) if part)


class SceneError(CablestudyError):
    """Wrong usage, file or value, with all mistakes that were found.

    Parameters
    ----------
    mistakes : Mistake or str
    """

    exit_code = 2

    def __init__(self, *mistakes: Mistake | str) -> None:
        self.mistakes = tuple(m if isinstance(m, Mistake) else Mistake("", "", str(m)) for m in mistakes)
        super().__init__("\n".join(str(m) for m in self.mistakes))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.mistakes

    @property
    def without_places(self) -> str:
        """The mistakes in one line, for the status of a row."""
        return "; ".join(f"{m.key}: {m.message}" if m.key else m.message for m in self.mistakes)


class Mistakes(list[Mistake]):
    """List of mistakes found one after the other; the end of its `with` block raises them as one SceneError."""

    def __enter__(self) -> Mistakes:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self and error is None:
            raise SceneError(*self)

    @contextmanager
    def at(self, where: str = "", key: str = "") -> Iterator[None]:
        """Context manager that adds the mistakes of a SceneError inside, or a ValueError as a mistake at this place."""
        try:
            yield
        except SceneError as error:
            self.extend(error.mistakes)
        except ValueError as error:
            self.append(Mistake(where, key, str(error)))


class NoSolutionError(CablestudyError):
    """A valid scene that has no answer, for example an unstable loop."""


class NothingToDrawError(NoSolutionError):
    """A picture in which nothing would be seen, for example of a wind that moves nothing; its numbers are there."""


class ConvergenceError(CablestudyError):
    """An iteration that did not converge.

    Attributes
    ----------
    record : object or None
        Convergence record of the iteration: steps, residuals, why it stopped.
    """

    def __init__(self, message: str, record: Any = None) -> None:
        self.record = record
        super().__init__(message)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.record)


def outcome_of(compute):
    """Result of a function without arguments, or its NoSolutionError or ConvergenceError, kept for `result_of`."""
    try:
        return compute()
    except (NoSolutionError, ConvergenceError) as error:
        return error


def result_of(outcome):
    """The result itself of an `outcome_of`; if it is an error, that is raised."""
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def without_errors(outcomes):
    """The entries of a dict of outcomes (`outcome_of`) that are results and no errors: dict."""
    return {key: outcome for key, outcome in outcomes.items() if not isinstance(outcome, Exception)}


def outcomes(objects, name):
    """`outcome_of` an attribute, by its name, of each of some objects: dict, object -> attribute or error."""
    return {one: outcome_of(lambda one=one: getattr(one, name)) for one in objects}


def known(objects, name):
    """The entries of `outcomes` that are no errors: dict."""
    return without_errors(outcomes(objects, name))


def check_output(option: str, path: str | None, endings: Collection[str], noun: str) -> None:
    """Refuse a file, named by an option, with another ending than some, or that cannot be written: SceneError."""
    if path is None:
        return
    if os.path.splitext(path)[1].lower() not in endings:
        raise SceneError(f"{option} {path}: unknown kind of {noun} (allowed: {', '.join(endings)})")
    check_writable(option, path)


def check_writable(option: str, path: str) -> None:
    """Refuse a file, named by an option, that cannot be written: SceneError."""
    folder, name = os.path.split(path)
    if folder and not os.path.isdir(folder):
        raise SceneError(f"{option} {path}: no such folder")
    obstacles = {
        "a folder is there": os.path.isdir(path),
        f"its name is longer than {LONGEST_NAME} bytes": len(os.fsencode(name)) > LONGEST_NAME,
        "no permission to write in its folder": not os.access(folder or ".", os.W_OK | os.X_OK),
    }
    for reason in filter(obstacles.get, obstacles):
        raise SceneError(f"{option} {path}: cannot be written ({reason})")


def refuse_options(options: dict[str, Any], reason: str) -> None:
    """Refuse options (name -> value) that are given and would have no effect: SceneError."""
    given = [name for name, value in options.items() if value]
    if given:
        raise SceneError(f"{', '.join(given)}: no effect: {reason}")
