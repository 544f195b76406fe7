"""Limits of a scene: comparisons of a column with a number that must hold in load cases."""

from functools import lru_cache, partial
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, Field

from cablestudy.scene.fields import Either, KeyTable, Name, plain_name, suggestion, wrong
from cablestudy.scene.tokens import tokens_of
from cablestudy.scene.units import show

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
    """Parse a limit such as "clearance >= 6 m", or "6 m <= clearance", as a `Comparison` with the column first.

    Raises
    ------
    PydanticCustomError
        The text is no comparison of one column with one number by <, <=, > or >=.
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


Limit = Annotated[LimitTable | str, Either(
    ((str, lambda text: LimitTable.model_construct(that=_check_comparison(text))),
     ((dict, LimitTable), LimitTable.model_validate)),
    "a comparison, such as 'clearance >= 6 m', or a mapping with the keys that, cases",
    ({"type": "string", "minLength": 1}, {"$ref": "#/$defs/LimitTable"}),
)]  # fmt: skip
Limits = dict[Annotated[Name, AfterValidator(plain_name("limit"))], Limit]


def case_relations(chosen, limits, cases):
    """Relations, as of `KeyTable.relations`, that a chosen load case, and those which limits name, are there: a list.

    Parameters
    ----------
    chosen : str or None
    limits : dict
        Name -> LimitTable.
    cases : dict
        Name of a load case -> its table.
    """
    known = [*cases, REFERENCE]
    of_limits = [
        (("limits", name, "cases", index), case in known, partial(_unknown_case, "load case", case, known))
        for name, limit in limits.items()
        for index, case in enumerate(limit.cases or ())
    ]
    return [(("case",), chosen is None or chosen in cases, partial(_unknown_case, "case", chosen, cases)), *of_limits]


def _unknown_case(kind, case, known):
    """Message on a load case that the scene does not have."""
    return f"unknown {kind} {show(case)} ({suggestion(case, known)})"
