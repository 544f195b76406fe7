"""Types of the keys in a file: quantities, whole numbers, words. Each reads a value, or says what it wants instead.

They are annotations for pydantic, which then only has to find out which keys there are.
"""

import math
from dataclasses import dataclass
from difflib import get_close_matches

from pydantic_core import PydanticCustomError, core_schema

from cablestudy.scene.units import DIMENSIONS, expected, show, to_si


def wrong(message):
    """The error by which a type refuses a value.

    Parameters
    ----------
    message : str
        Complete; shown as it is.

    Returns
    -------
    PydanticCustomError
    """
    return PydanticCustomError("cablestudy", "{text}", {"text": message})


def suggestion(word, known):
    """`did you mean ...?` when something near is known, else all that is known.

    Parameters
    ----------
    word : str
        What was written.
    known : iterable of str
        What is allowed.
    """
    known = list(known)
    near = get_close_matches(str(word), known, n=1, cutoff=0.6)
    return f"did you mean {near[0]}?" if near else f"allowed: {', '.join(known)}"


class _Type:
    """Hooks of pydantic: validate by `read`, describe by `schema`."""

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema, handler):
        return self.schema()


@dataclass(frozen=True)
class Quantity(_Type):
    """A number in SI, or text with a unit.

    Attributes
    ----------
    unit : str
        A key of `units.DIMENSIONS`: what the value is in after reading.
    low, high : float
        Smallest and largest value allowed. [unit]
    positive : bool
        Refuse zero and less.
    bounds : str
        How messages name `low` and `high`, when not as numbers.
    words : tuple of str
        Words that may stand instead of a number; they are kept.
    """

    unit: str
    low: float = -math.inf
    high: float = math.inf
    positive: bool = False
    bounds: str = ""
    words: tuple[str, ...] = ()

    def read(self, value):
        """Value -> float [unit], or one of `words`."""
        if self.words and isinstance(value, str) and value in self.words:
            return value
        try:
            number = to_si(value, self.unit)
        except ValueError as error:
            either = f"expected one of {', '.join(self.words)}, or " if self.words else ""
            raise wrong(str(error).replace("expected ", either, 1) if either else str(error)) from None
        if not math.isfinite(number):
            raise wrong(f"expected {expected(self.unit)}, got {show(value)}, which is not finite")
        if self.positive and number <= 0:
            raise wrong(f"must be positive, got {show(value)}")
        if not self.low <= number <= self.high:
            raise wrong(f"{self._allowed()}, got {show(value)}")
        return number

    def _allowed(self):
        if self.bounds:
            return f"must be {self.bounds}"
        if self.high == math.inf:
            return "must not be negative" if self.low == 0 else f"must be at least {self.low:g}"
        return f"must be at most {self.high:g}" if self.positive else f"must be from {self.low:g} to {self.high:g}"

    def schema(self):
        """JSON Schema: a number in SI, or text of a number and a unit."""
        noun, example = DIMENSIONS[self.unit]
        number = {"type": "number"}
        if self.positive:
            number["exclusiveMinimum"] = 0
        elif self.low > -math.inf:
            number["minimum"] = self.low
        if self.high < math.inf:
            number["maximum"] = self.high
        text = {
            "type": "string",
            "pattern": r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*([A-Za-zµμΩ°%(1].*)?$",
            "description": f"{noun}, e.g. {example}",
        }
        return {"anyOf": [number, text, *({"enum": list(self.words)} for _ in self.words[:1])]}


@dataclass(frozen=True)
class Count(_Type):
    """A whole number between two bounds, both allowed."""

    low: int
    high: int

    def read(self, value):
        """Value -> int. A range of a study yields 4.0 for 4, so that whole floats pass."""
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise wrong(f"expected a whole number from {self.low} to {self.high}, got {show(value)}")
        return value

    def schema(self):
        """JSON Schema."""
        return {"type": "integer", "minimum": self.low, "maximum": self.high}


@dataclass(frozen=True)
class Word(_Type):
    """One of some words."""

    words: tuple[str, ...]

    def read(self, value):
        """Value -> the same word."""
        if not isinstance(value, str) or value not in self.words:
            hint = suggestion(value, self.words) if isinstance(value, str) else f"allowed: {', '.join(self.words)}"
            raise wrong(f"got {show(value)} ({hint})")
        return value

    def schema(self):
        """JSON Schema."""
        return {"enum": list(self.words)}


@dataclass(frozen=True)
class Text(_Type):
    """Text, and nothing that YAML reads as something else."""

    empty: bool = True

    def read(self, value):
        """Value -> the same text."""
        if not isinstance(value, str) or not (value or self.empty):
            raise wrong(f"expected text, got {show(value)}")
        return value

    def schema(self):
        """JSON Schema."""
        return {"type": "string"} if self.empty else {"type": "string", "minLength": 1}


@dataclass(frozen=True)
class Switch(_Type):
    """true or false."""

    def read(self, value):
        """Value -> bool."""
        if not isinstance(value, bool):
            raise wrong(f"expected true or false, got {show(value)}")
        return value

    def schema(self):
        """JSON Schema."""
        return {"type": "boolean"}
