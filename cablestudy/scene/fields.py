"""Types for pydantic: of single keys (quantities with a unit, whole numbers, text) and of mappings, `KeyTable`."""

import math
import re
from dataclasses import dataclass
from difflib import SequenceMatcher, get_close_matches
from typing import Annotated, ClassVar, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, StringConstraints, TypeAdapter, model_validator
from pydantic_core import PydanticCustomError, core_schema

from cablestudy.scene.layers import ALTERNATIVES, OF_CABLE, OF_SECTION, value_at
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import DIMENSIONS, article, expected, show, to_si

ALL = "all"  # in the place of the name of a load case: each of them
TRIPLE = {"type": "array", "minItems": 3, "maxItems": 3}  # JSON Schema of three numbers
TEXT = {"type": "string", "minLength": 1}  # JSON Schema of a name or another text


def wrong(message):
    """The error by which a type refuses a value; its message is shown as it is."""
    return PydanticCustomError("cablestudy", "{text}", {"text": message})


def _material_name(name):
    """A name with which no formula of a spreadsheet and no option of a command begins."""
    if name[:1].isalnum():
        return name
    raise wrong(f"a name of a material begins with a letter or a digit, got {show(name)}")


def _case_name(name):
    """A name that --case, --set and --vary can have too."""
    if name == ALL:
        raise wrong(f"a name of a load case is not {ALL}, which stands for each of them (--case {ALL})")
    return plain_name("load case")(name)


def plain_name(kind):
    """Function that refuses a name, of a kind of things, that dotted keys and lists of names cannot have."""

    def check(name):
        if name[:1].isalnum() and name == name.strip() and not any(sign in name for sign in ".,="):
            return name
        raise wrong(f"a name of a {kind} begins with a letter or a digit and has no dot, comma or =, got {show(name)}")

    return check


Name = Annotated[str, StringConstraints(strict=True, min_length=1)]
MaterialName = Annotated[Name, AfterValidator(_material_name)]
CaseName = Annotated[Name, AfterValidator(_case_name)]


def suggestion(word, known):
    """`did you mean ...?` where a known word has about the same letters or an equal part, else all that are known."""
    known = list(known)
    if not known:
        return "there is none"
    word = str(word)[:100]
    swapped = [one for one in known if sorted(one) == sorted(word)]  # letters in another order
    near = swapped or _misspelt(word, known) or _with_a_common_part(word, known)
    return f"did you mean {near[0]}?" if near else f"allowed: {', '.join(known)}"


def _misspelt(word, known):
    """Those of the known words that differ from a word by a few letters, the most similar one first."""
    most = max(2, len(word) // SCENE.letters_to_one_wrong)
    similar = get_close_matches(word, known, cutoff=SCENE.similar_word)
    return [one for one in similar if _wrong_letters(word, one) <= most]


def _wrong_letters(word, right):
    """Number of letters by which a word differs from the right one."""
    parts = SequenceMatcher(None, word, right).get_opcodes()
    return sum(max(i2 - i1, j2 - j1) for tag, i1, i2, j1, j2 in parts if tag != "equal")


def _with_a_common_part(word, known):
    """Those of the known words that begin with a word, or share one of its parts, the most similar one first."""
    parts = {part for part in _parts(word) if len(part) >= SCENE.shortest_part}
    begin = [one for one in known if len(word) >= SCENE.shortest_part and one.startswith(word)]
    return get_close_matches(word, begin or [one for one in known if parts.intersection(_parts(one))], cutoff=0.0)


def _parts(words):
    """Words of a name with spaces, dashes or underscores between them: list."""
    return re.split(r"[\W_]+", words)


def each_once(value):
    """A tuple of words itself; refused where one of them is there twice."""
    repeated = next((word for index, word in enumerate(value) if word in value[:index]), None)
    if repeated:
        raise wrong(f"{repeated} is given twice")
    return value


class _Type:
    """Base of types of keys: pydantic converts a value by their method `read`, and describes it by `schema`."""

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema, handler):
        return self.schema()


@dataclass(frozen=True)
class Quantity(_Type):
    """A number in SI, or text with a unit.

    The limits are the widest that any cable, wind or winch could need; beyond them products and powers in the solvers
    could overflow.
    """

    unit: str  # a key of `units.DIMENSIONS`: what the value is in after reading
    low: float  # smallest value allowed [unit]
    high: float  # largest [unit]
    least: float = 0.0  # where `low` is zero: the smallest other value allowed [unit]
    limits: str = ""  # how messages name `low` and `high`; by default as numbers
    words: tuple[str, ...] = ()  # that may stand instead of a number; they are kept

    def read(self, value):
        """Convert a value of a file to a float in `unit`, and check that it is within the limits.

        A number is in `unit` already; text has a unit, such as "3 mm"; one of `words` stays as it is.
        PydanticCustomError if the value is no such quantity, or outside of the limits.
        """
        if self.words and isinstance(value, str) and value in self.words:
            return value
        try:
            number = to_si(value, self.unit)
        except ValueError as error:
            either = f"expected one of {', '.join(self.words)}, or " if self.words else ""
            raise wrong(str(error).replace("expected ", either, 1) if either else str(error)) from None
        if self.low <= number <= self.high and not 0 < number < self.least:
            return number
        if not math.isfinite(number):
            raise wrong(f"expected {expected(self.unit)}, got {show(value)}, which is not finite")
        if "bare number" in self.limits:  # the limits then name its unit; -300 degC is no positive temperature
            raise wrong(f"must be {self.limits}, got {show(value)}")
        if number <= 0 < self.low:
            raise wrong(f"must be positive, got {show(value)}")
        if number < 0 == self.low:
            raise wrong(f"must not be negative, got {show(value)}")
        raise wrong(f"must be {self._range()}, got {show(value)}")

    def _range(self):
        """The values allowed, for messages."""
        low = f"0, or from {self.least:g}" if self.least else f"from {self.low:g}"
        return self.limits or f"{low} to {self.high:g} {self.unit}".strip()

    def schema(self):
        """JSON Schema: a number in SI, or text of a number and a unit."""
        noun, example = DIMENSIONS[self.unit]
        number = {"type": "number", "minimum": self.low, "maximum": self.high, "description": self._range()}
        text = {
            "type": "string",
            "pattern": r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(/\d{1,9})?\s*([A-Za-zµμΩ°%(1].*)?$",
            "description": f"{article(noun)} {self._range()}, e.g. {example}",
        }
        return {"anyOf": [number, text, *({"enum": list(self.words)} for _ in self.words[:1])]}


Frequency = Annotated[float, Quantity("Hz", 1e-9, 1e9)]
Delay = Annotated[float, Quantity("s", 0, 1e6, SCENE.least_positive)]


@dataclass(frozen=True)
class Count(_Type):
    """A whole number between two limits, both allowed."""

    low: int
    high: int

    def read(self, value):
        """Value -> int. A range of a study yields 4.0 for 4, so that whole floats are allowed."""
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise wrong(f"expected a whole number from {self.low} to {self.high}, got {show(value)}")
        return value

    def schema(self):
        """JSON Schema."""
        return {"type": "integer", "minimum": self.low, "maximum": self.high}


@dataclass(frozen=True, eq=False)
class Either(_Type):
    """A value of one of several kinds, which its form tells apart: text, a number, a list, a mapping."""

    expected: str  # in messages
    options: tuple  # of each a tuple: type of a plain value, or tuple of types; function that reads it; JSON Schemas

    def read(self, value):
        """Value -> what the reader of its kind makes of it."""
        for kind, read, *_ in self.options:
            if isinstance(value, kind):
                return read(value)
        raise wrong(f"expected {self.expected}, got {show(value)}")

    def schema(self):
        """JSON Schema."""
        return {"anyOf": [schema for _, _, *schemas in self.options for schema in schemas]}

    @staticmethod
    def of_number(quantity, kind=(int, float, str)):
        """The option that a `Quantity` reads."""
        return kind, quantity.read, *quantity.schema()["anyOf"]

    @staticmethod
    def of_table(model):
        """The option of a mapping that a model reads, whose schema is expected among the definitions."""
        return dict, model.model_validate, {"$ref": f"#/$defs/{model.__name__}"}


def reader_of(annotation):
    """Function that reads values of a type; its validator is built when the first one is read, see `KeyTable`."""
    return TypeAdapter(annotation, config=ConfigDict(defer_build=True)).validate_python


def tables_of(model, path=()):
    """Each mapping of a file, in the order of its keys: list of (path, model that reads it).

    Parameters
    ----------
    model : type
        Subclass of `KeyTable` that reads the whole file.
    path : tuple of str
        Where it is; "*" stands for any name or index. What may be of two kinds is there twice.
    """
    tables = [(path, model)]
    for name, field in fields_by_key(model).items():
        tables += _tables_in(field.annotation, (*path, name))
    return tables


def fields_by_key(model):
    """Key as written -> field of a model, of pydantic: dict."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def parts_of(field):
    """Yield the annotation of a field, of pydantic, and all that it is made of, from the outside inwards."""
    to_visit = [field.annotation, *field.metadata]
    while to_visit:
        annotation = to_visit.pop(0)
        yield annotation
        to_visit = [*get_args(annotation), *to_visit]


def _tables_in(annotation, path):
    """`tables_of` the models in the type of a key, the annotation of its field."""
    if isinstance(annotation, type) and issubclass(annotation, KeyTable):
        return tables_of(annotation, path)
    path_of_items = (*path, "*") if get_origin(annotation) in (dict, tuple) else path
    return [table for part in get_args(annotation) for table in _tables_in(part, path_of_items)]


class KeyTable(BaseModel):
    """A mapping of the file. Subclasses state in `relations` the conditions that several of its keys must meet.

    The validators of pydantic are built when the first one is read: building all of them would take an eighth of the
    start of a command. A default that is a table of plain defaults is written `model_construct()`, which builds none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", revalidate_instances="never", defer_build=True)
    table: ClassVar[str] = ""  # its key in `layers.ALTERNATIVES`; empty where no keys of it exclude each other
    optional_groups: ClassVar[bool] = False  # whether all groups of alternatives may be missing
    bare: ClassVar[str] = ""  # the key whose vector a file may have alone in place of the mapping; empty for none

    @classmethod
    def key_mistakes(cls, given):
        """Find keys that exclude each other, for example `at` and `fraction` of a load, and keys that are missing.

        `layers.ALTERNATIVES` lists the choices of the table, each between alternatives. An alternative is a tuple of
        keys that go together, the main one first. Mistakes are keys of a second alternative of a choice, an alternative
        without its main key, and a choice of which nothing is `given`: list of (path inside the table, message).
        """
        mistakes, given = [], set(given)
        for choice in ALTERNATIVES.get(cls.table, ()):
            main_keys = ", ".join(alternative[0] for alternative in choice)
            chosen = [alternative for alternative in choice if not given.isdisjoint(alternative)]
            used_keys = [key for alternative in chosen for key in alternative if key in given]
            if len(chosen) > 1:
                message = f"given together with {used_keys[0]}: give exactly one of {main_keys}"
                mistakes += [((key,), message) for key in used_keys if key not in chosen[0]]
            elif chosen and chosen[0][0] not in given:
                mistakes.append(((), f"missing key: {chosen[0][0]} ({used_keys[0]} goes with it)"))
            elif not (chosen or cls.optional_groups or choice in OF_SECTION + OF_CABLE):  # a material may give these
                mistakes.append(((), f"missing key: one of {main_keys}"))
        return mistakes

    def value_at(self, path):
        """The value at a path (names and indices) after reading; None when nothing is there."""
        key, *inside = self._whole_path(path)
        return value_at(getattr(self, key, None), inside)

    def with_value(self, path, value):
        """Copy with another value at a path that holds one; it is not checked."""
        key, *inside = self._whole_path(path)
        return self.model_copy(update={key: with_value(getattr(self, key), inside, value)})

    def _whole_path(self, path):
        """A path inside the table; a component alone is one of the vector that may be bare."""
        return (self.bare, *path) if self.bare and path[0].isdigit() else path

    def relations(self):
        """Relations that must hold between keys that are right alone.

        Yields
        ------
        list of (tuple, bool or ndarray of bool, str or callable)
            Path inside the table, whether it holds, and the message when it does not, or a function that returns it. A
            list is checked only when all before it hold. Numbers may be arrays of many cases, see `study.case_table`;
            what a message says of them is written by a function, when it is asked for.
        """
        return ()

    @model_validator(mode="before")
    @classmethod
    def _complete_vectors(cls, data):
        """A vector of which a dotted key sets a component, `force.0`, has its default for the others."""
        if not isinstance(data, dict):
            return data
        vectors = {key: value for key, value in data.items() if isinstance(value, dict) and key in cls.model_fields}
        return data | {key: _with_components(cls.model_fields[key].default, value) for key, value in vectors.items()}

    @model_validator(mode="after")
    def _check_relations(self):
        """Refuse keys that exclude each other, that are missing, or whose relations do not hold."""
        given = [key for key, value in self.__dict__.items() if value is not None and key in self.model_fields_set]
        mistakes = self.key_mistakes(given) or next(filter(None, map(broken, self.relations())), [])
        if mistakes:
            text = "; ".join(": ".join((".".join(map(str, path)), message)).strip(": ") for path, message in mistakes)
            raise PydanticCustomError("cablestudy", "{text}", {"text": text, "found": mistakes})
        return self


def broken(relations):
    """Path and message of those of a list of relations, as in `KeyTable.relations`, that do not hold: a list."""
    found = [(path, message) for path, holds, message in relations if not holds]
    return [(path, message() if callable(message) else message) for path, message in found]


def _with_components(default, value):
    """The default of a vector with those components that a mapping of index -> value sets: list.

    The mapping itself where it sets anything else, or the default is no vector.
    """
    indices = [str(index) for index in range(len(default))] if isinstance(default, tuple) else ()
    sets_components = bool(value) and value.keys() <= set(indices)
    if not sets_components:
        return value
    return [value.get(index, component) for index, component in zip(indices, default, strict=True)]


def with_value(node, path, value):
    """Copy of a table, mapping or tuple with another value at a path that holds one."""
    if not path:
        return value
    if isinstance(node, KeyTable):
        return node.with_value(path, value)
    name = path[0]
    if isinstance(node, dict):
        return {**node, name: with_value(node[name], path[1:], value)}
    index = int(name)
    return (*node[:index], with_value(node[index], path[1:], value), *node[index + 1 :])
