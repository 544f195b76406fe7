"""Tables of one cable and suspensions alike: how finely cables are computed, the ground, imaging, limits."""

from functools import lru_cache, partial, reduce
from itertools import pairwise
from operator import and_
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from cablestudy.scene.cable_table import Coordinate
from cablestudy.scene.fields import (
    TEXT,
    Count,
    Delay,
    Either,
    Frequency,
    KeyTable,
    Name,
    Quantity,
    broken,
    plain_name,
    reader_of,
    suggestion,
    wrong,
)
from cablestudy.scene.layers import mapping_at
from cablestudy.scene.tokens import tokens_of
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show

Exposure = Annotated[float, Quantity("s", 1e-12, 1e12)]
_level = Quantity("m", -1e9, 1e9)
_profile = reader_of(Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=2, max_length=10_000)])
_profile_schema = {"type": "array", "minItems": 2, "items": {"type": "array", "minItems": 2, "maxItems": 2}}
Ground = Annotated[
    Annotated[float, _level] | tuple,
    Either("a level, or a list of [x, z]", (Either.of_number(_level), ((list, tuple), _profile, _profile_schema))),
]


class SceneTable(KeyTable):
    """A scene of one cable or a suspension, with what follows alike from the keys of both."""

    no_case: ClassVar[KeyTable]  # load case of no temperature, ice, wind and loads

    gravity: Annotated[float, Quantity("m/s^2", 0, 1e6, SCENE.least_positive)] = Field(
        9.81, description="Acceleration of gravity, along -z"
    )

    @property
    def load_case(self):
        """The chosen load case; without one `no_case`."""
        return self.no_case if self.case is None else self.cases[self.case]

    def in_case(self, name):
        """Copy in one of its load cases, by name; in the reference state where there is no such case."""
        return self.model_copy(update={"case": name if name in self.cases else None})

    @property
    def nonzero_gravity(self):
        """Acceleration of gravity; None without any. [m/s^2]"""
        return None if isinstance(self.gravity, float) and self.gravity == 0 else self.gravity


class ModelTable(KeyTable):
    """Discretisation of cables: to an accuracy (`elements` is None), or with exactly these elements."""

    table: ClassVar[str] = "model"
    optional_groups: ClassVar[bool] = True

    accuracy: Annotated[float, Quantity("", 1e-20, 0.1)] | None = Field(
        None, description="Largest relative error: the cheapest model below it is used (default 1e-4)"
    )
    elements: Annotated[int, Count(1, 1_000_000)] | None = Field(
        None, description="Exactly so many elements, without error control (instead of accuracy)"
    )
    order: Annotated[int, Count(1, 64)] = Field(1, description="Polynomial order of each element")
    mass: Literal["lumped", "consistent", "blended"] = Field("lumped", description="Mass of an element")

    @model_validator(mode="before")
    @classmethod
    def _default(cls, data):
        return {"accuracy": 1e-4} if data == {} else data

    def relations(self):
        """Relations: blended mass is defined for bars."""
        message = f"blended needs order 1, and the order is {self.order} (use lumped or consistent)"
        yield [(("mass",), self.mass != "blended" or self.order == 1, message)]


def ground_relations(ground):
    """The relation that the x of the points of a `Ground` ascend: a list as in `KeyTable.relations`."""
    if not isinstance(ground, tuple):
        return []
    ascending = (point[0] < following[0] for point, following in pairwise(ground))
    ascends = reduce(and_, ascending, True)  # numbers, or arrays where a study varies them
    return [(("ground",), ascends, "the x of its points must ascend")]


class Correction(KeyTable):
    """The tip/tilt/piston mirror that follows the motion."""

    bandwidth: Frequency = Field(description="Bandwidth of the correction")
    delay: Delay = Field(0.0, description="Time between measurement and correction")

    def relations(self):
        """Relations: the mirror's loop, an integrator with a delay, is stable."""
        highest = "an unstable mirror: with this delay it must be below 1/(4 delay) = {:.4g} Hz"
        yield [(("bandwidth",), 4 * self.bandwidth * self.delay < 1, lambda: highest.format(0.25 / self.delay))]


class MarkerCorrection(Correction):
    """The correction of a suspension, of the motion of one marker."""

    marker: Name = Field(description="Whose motion is corrected: BODY.MARKER")


REFERENCE = "reference"  # the state without a load case
EXPECTED = "expected COLUMN <= NUMBER, for example 'clearance >= 6 m'"
MIRRORED = {"<=": ">=", ">=": "<=", "<": ">", ">": "<"}


class Comparison(NamedTuple):
    """Name of a column, one of < <= > >=, and the number as written, perhaps with a unit."""

    column: str
    sign: str
    number: str


@lru_cache(maxsize=4096)
def comparison(text):
    """Parse the text of a limit on a result, a column of the table, such as "clearance >= 6 m" or "6 m <= clearance".

    The `Comparison` has the column first: if the text begins with the number, the sign is mirrored. PydanticCustomError
    if the text is no comparison of one column with one number by <, <=, > or >=.
    """

    def refuse(position, message):
        """Raise the error for text that is no token, at a character counted from 1."""
        raise wrong(f"{message.partition(' (')[0]} at character {position}: {EXPECTED}")

    tokens = tokens_of(text, refuse)[:-1]  # without the last one, which marks the end
    kinds, texts = [token.kind for token in tokens], [token.text for token in tokens]
    signs = [token.text for token in tokens if token.kind == "sign" and token.text not in "()"]
    if "and" in texts or kinds[1::2] == ["sign", "sign"]:
        raise wrong(f"{show(text)} are two limits: give each a name of its own")
    if "==" in signs or "!=" in signs:
        raise wrong(f"a limit leaves a margin: write <= or >=, got {show(text)}")
    if kinds == ["number", "sign", "name"] and texts[1] in MIRRORED:
        return Comparison(texts[2], MIRRORED[texts[1]], texts[0])
    if kinds == ["name", "sign", "number"] and texts[1] in MIRRORED:
        return Comparison(*texts)
    raise wrong(f"{EXPECTED}, got {show(text)}")


def _check_comparison(text):
    """The text of a limit itself; PydanticCustomError where it is no `comparison`."""
    return comparison(text) and text


class LimitTable(KeyTable):
    """One limit."""

    that: Annotated[Name, AfterValidator(_check_comparison)] = Field(
        description="Comparison of a column with a number: utilisation <= 60 %"
    )
    cases: tuple[Name, ...] | None = Field(
        None, min_length=1, description=f"Load cases in which it must hold; default: all, and {REFERENCE}, without one"
    )


Limit = Annotated[
    LimitTable | str,
    Either("a comparison, such as 'clearance >= 6 m', or a mapping with the keys that, cases", (
        (str, lambda text: LimitTable.model_construct(that=_check_comparison(text)), TEXT), Either.of_table(LimitTable),
    )),
]  # fmt: skip
Limits = dict[Annotated[Name, AfterValidator(plain_name("limit"))], Limit]


def written_limits(value):
    """Yield path and comparison of each limit in the plain values of a file, in which anything may be wrong."""
    for name, limit in mapping_at(value, ("limits",)).items():
        yield (("limits", name, "that"), limit.get("that")) if isinstance(limit, dict) else (("limits", name), limit)


def case_relations(chosen, limits, cases):
    """Relations, as in `KeyTable.relations`, that a chosen load case, and those which limits name, are there: a list.

    `chosen` is a name or None; `limits` and `cases` are the tables of a scene.
    """
    known = [*cases, REFERENCE]
    of_limits = [
        (("limits", name, "cases", index), case in known, partial(_unknown_case, "load case", case, known))
        for name, limit in limits.items()
        for index, case in enumerate(limit.cases or ())
    ]
    return [(("case",), chosen is None or chosen in cases, partial(_unknown_case, "case", chosen, cases)), *of_limits]


def case_mistakes_in_file(value):
    """Path and message of load cases that the plain values of a file name and do not have; see `case_relations`.

    Pydantic checks such relations only where every key is right alone.
    """
    cases, chosen = value.get("cases", {}), value.get("case")
    if not isinstance(cases, dict):
        return []
    named = {}
    for name, table in mapping_at(value, ("limits",)).items():
        names = table.get("cases") if isinstance(table, dict) else None
        if isinstance(names, list) and all(isinstance(item, str) for item in names):
            named[name] = LimitTable.model_construct(cases=names)
    return broken(case_relations(chosen if isinstance(chosen, str) else None, named, cases))


def _unknown_case(kind, case, known):
    """Message on a load case that the scene does not have."""
    return f"unknown {kind} {show(case)} ({suggestion(case, known)})"
