"""The kinds of arguments that functions of the interface take, each the annotation of one.

Numbers and text of numpy, arrays, Series of pandas, tuples, views of a dict and paths are read as Python's own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Mapping
from typing import Annotated, Any, Literal

from cablestudy.interface.arguments import Kind
from cablestudy.interface.plain import NotPlainError, list_of, mapping_of, plain, shown, unwrapped

MOST_MODES, MOST_RUNS, MOST_PROCESSES = 100_000, 1000, 1024  # as for the commands


def read_text(value: object) -> str:
    """Text that is not blank."""
    value = unwrapped(value)
    if not isinstance(value, str) or not value.strip():
        raise ValueError
    return value


def read_number(value: object) -> float:
    """A number."""
    value = unwrapped(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError
    return float(value)


def read_amount(value: object) -> str:
    """A number, as text, or text that is not empty: a number with its unit."""
    value = unwrapped(value)
    return read_text(value) if isinstance(value, str) else repr(read_number(value))


def read_amounts(value: object) -> str:
    """Amounts in a list as one text with colons between them; or such a text. ValueError of an empty list."""
    amounts = list_of(value)
    if amounts == []:
        raise ValueError
    return read_amount(value) if amounts is None else ":".join(map(read_part, amounts))


def read_part(value: object) -> str:
    """An amount as part of a text with colons: a whole number without a decimal point."""
    value = unwrapped(value)
    return str(value) if type(value) is int else read_amount(value)


def read_path(value: object) -> str:
    """The name of a file or folder."""
    path = read_text(os.fspath(value) if isinstance(value, os.PathLike) else value)
    if b"\0" in os.fsencode(path):  # no system has such a name, nor one of half a character: ValueError
        raise ValueError
    return path


def read_goal(value: object) -> str:
    """A column, a sign and a value; or the word for all limits."""
    goal = read_text(value)
    if goal.strip() != "limits" and not any(sign in goal for sign in "<>="):
        raise ValueError
    return goal


def read_texts(value: object) -> tuple[str, ...]:
    """Several texts, none of them empty."""
    texts = list_of(value)
    if texts is None:
        raise ValueError
    wrong = next((index for index, text in enumerate(texts) if not text or not isinstance(text, str)), None)
    if wrong is not None:
        raise NotPlainError(f"item {wrong}: expected text, got {shown(texts[wrong])}")
    return tuple(map(unwrapped, texts))


def read_columns(value: object) -> str:
    """Names of columns in a list as one text with commas between them; or such a text."""
    return read_text(value) if isinstance(value, str) else read_text(",".join(read_texts(value)))


def names_in(text: str) -> tuple[str, ...]:
    """The names in a text with commas between them, each once; ValueError where one is empty."""
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise ValueError("expected names joined by commas")
    return tuple(dict.fromkeys(names))


def read_source(value: object) -> str | dict[str, Any]:
    """The name of a file, or the plain values of a mapping."""
    mapping = mapping_of(value)
    return read_path(value) if mapping is None else plain(mapping)


def read_changes(value: object) -> tuple[str, ...]:
    """Changes of a file as texts KEY=VALUE: of a mapping of key -> value, or these texts themselves."""
    return texts_of(value, lambda key, written: json_of(written))


def read_variations(value: object) -> tuple[str, ...]:
    """Texts KEY=VALUES of what varies: from a mapping of key -> values, or these texts themselves."""
    return texts_of(value, values_text)


def texts_of(value: object, text: Callable[[str, Any], str]) -> tuple[str, ...]:
    """Texts KEY=TEXT of a mapping, by a function `text` of each key and its plain value; or the texts of a list."""
    mapping = mapping_of({} if value is None else value)
    if mapping is None:
        return read_texts(value)
    return tuple(f"{key}={text(key, written)}" for key, written in plain(mapping).items())


def values_text(key: str, values: Any) -> str:
    """The values of one key as the option `--vary` takes them; `values` are plain."""
    if isinstance(values, str):
        return values
    if isinstance(values, list):
        return json_of(values)[1:-1]
    if isinstance(values, dict) and {"from", "to", "count"} <= values.keys() <= {"from", "to", "count", "spacing"}:
        return f"{values['from']}:{values['to']}:{values['count']} {values.get('spacing', '')}".strip()
    if isinstance(values, (int, float)):
        return json_of(values)
    expected = 'a list of values, a range {"from": ..., "to": ..., "count": ...}, or text such as "10kg:50kg:5"'
    raise NotPlainError(f"{key}: expected {expected}, got {shown(values)}")


def json_of(value: Any) -> str:
    """Plain values as JSON, which YAML reads too."""
    return json.dumps(value, ensure_ascii=False)


def case_text(name: str | None) -> tuple[str, ...]:
    """The change of a scene that chooses a load case; none without a name."""
    return () if name is None else (f"case={json_of(name)}",)


def whole(low: int, high: int) -> Kind:
    """The kind of a whole number between two limits, both allowed."""

    def read(value: object) -> int:
        number = read_number(value)
        if not (number.is_integer() and low <= number <= high):
            raise ValueError
        return int(number)

    return Kind(f"a whole number from {low} to {high}", read)


CHANGES = "a mapping of dotted key -> value, or a list of texts KEY=VALUE"
VALUES = "a mapping of dotted key -> values, or a list of texts KEY=VALUES"

Text = Annotated[str, Kind("text", read_text)]
Goal = Annotated[str, Kind("COLUMN = VALUE, for example 'sag = 2 m'", read_goal)]
Texts = Annotated[Collection[str], Kind("a list of texts", read_texts)]
File = Annotated[str | os.PathLike[str], Kind("the name of a file or folder", read_path)]
Source = Annotated[
    str | os.PathLike[str] | Mapping[str, Any],
    Kind("the name of a file, or a mapping of what it would say", read_source),
]
Changes = Annotated[Mapping[str, Any] | Collection[str] | None, Kind(CHANGES, read_changes)]
Variations = Annotated[Mapping[str, Any] | Collection[str] | None, Kind(VALUES, read_variations)]
Columns = Annotated[str | Collection[str], Kind('names of columns, as "sag,mass" or a list of them', read_columns)]
WindOn = Literal["gondola", "cable", "both"]
Picture = Literal["static", "modes", "windrms", "loop"]
Number = Annotated[float, Kind("a number", read_number)]
Frequency = Annotated[float | str, Kind('a frequency in Hz (a number, or text such as "20 Hz")', read_amount)]
Size = Annotated[float | str, Kind('a number, or text such as "1 mm"', read_amount)]
Duration = Annotated[float | str, Kind('a time in s (a number, or text such as "60 s")', read_amount)]
Between = Annotated[str | Collection[float | str], Kind('two values, as (100, 2000) or "100 N:2 kN"', read_amounts)]
Frequencies = Annotated[
    str | Collection[float | str],
    Kind('first and last frequency and how many, as (0.01, 100, 200) or "0.01Hz:100Hz:200"', read_amounts),
]
Modes = Annotated[int, whole(1, MOST_MODES)]
Runs = Annotated[int, whole(1, MOST_RUNS)]
Processes = Annotated[int, whole(1, MOST_PROCESSES)]
