"""The language of --where: comparisons of columns, joined by and, or, not. Nothing in it is ever evaluated as code.

    condition   = both {"or" both}
    both        = negation {"and" negation}
    negation    = "not" negation | "(" condition ")" | comparison
    comparison  = operand operator operand {operator operand}
    operand     = column | varied key | number [unit] | "text" | 'text'

A number without a unit is in the unit of the column that it is compared with, beside a varied key in SI. An empty cell
makes a comparison neither true nor false: unknown, which `not` leaves unknown, and which no row is shown for.
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, get_args

from cablestudy.errors import SceneError
from cablestudy.scene.fields import Quantity
from cablestudy.scene.scene import TABLES
from cablestudy.scene.units import DIMENSIONS, common_factor, factor, show, split
from cablestudy.study.columns import find

MAX_DEPTH = 50
MAX_LENGTH = 10_000
OPERATORS = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
INSTEAD = {"=": "==", "<>": "!=", "&&": "and", "||": "or", "&": "and", "|": "or", "!": "not"}
WORDS = ("and", "or", "not")

_UNIT = r"(?!(?:and|or|not)\b)[A-Za-zµμΩ°%][A-Za-z0-9µμΩ°%]*(?:[*/·][A-Za-zµμΩ°%][A-Za-z0-9µμΩ°%]*|\^-?[0-9]{1,2})*"
_TOKEN = re.compile(
    rf"""\s*(?:
    (?P<number>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?\s*(?:{_UNIT})?)
    |(?P<name>[^\W\d]\w*(?:[.-]\w+)*)
    |(?P<text>"[^"]*"|'[^']*')
    |(?P<sign><>|<=|>=|==|!=|&&|\|\||[<>=!&|()])
    )""",
    re.VERBOSE,
)


class Token(NamedTuple):
    """A piece of the text, its kind, and where it begins (from 1)."""

    kind: str
    text: str
    column: int


@dataclass(frozen=True)
class Name:
    """A column or a varied key.

    Attributes
    ----------
    shown : str
        Its place in a row.
    unit : str or None
        What its numbers are in, SI for a varied key; None when they are pure numbers or of unknown dimension.
    text : bool
        Whether it holds text, and never a number.
    varied : bool
        Whether it is a varied key, whose cells are as written.
    """

    shown: str
    unit: str | None
    text: bool = False
    varied: bool = False

    def value(self, row, unit=None):
        """The cell of a row: float, text, or None.

        Parameters
        ----------
        row : dict
        unit : str or None
            What a number shall be in; None for the column's own unit, and for SI of a varied key.
        """
        cell = row.get(self.shown)
        if self.text or cell is None:
            return cell
        if self.varied:
            return _measure(cell, unit)
        return float(cell) if unit in (None, self.unit) else float(cell) * float(common_factor(self.unit, unit))


class Names:
    """What a study's rows have, or can have.

    Parameters
    ----------
    study : Study
    """

    def __init__(self, study):
        self._varied, self._known, self._new = study.varied, set(), []
        for name in study.columns:
            try:
                self._known.add(find(name).header)
            except ValueError:
                continue  # the study's own mistake, reported where it is written

    def find(self, name):
        """The column or varied key of a name.

        Raises
        ------
        ValueError
            There is none; the message suggests one.
        """
        if name in self._varied:
            return Name(name, _unit_of(name), varied=True)
        if "." in name:
            near = get_close_matches(name, self._varied, 1)
            listed = f"did you mean {near[0]}?" if near else f"varied: {', '.join(self._varied) or 'nothing'}"
            raise ValueError(f"the study does not vary {name!r} ({listed})")
        column = find(name)
        if column.header not in self._known:
            self._known.add(column.header)
            if column.name != "status":
                self._new.append(column.name)
        return Name(column.header, column.unit, text=column.name == "status")

    def take(self):
        """The columns found since the last time that the study does not have."""
        new, self._new = self._new, []
        return new


def _unit_of(key):
    """The unit that the scene has a key's value in; None for what is no quantity."""
    *path, last = ("*" if part.isdigit() else part for part in key.split("."))
    model = TABLES.get(tuple(path))
    field = model and model.model_fields.get(last)
    kinds = [field.annotation, *field.metadata] if field else []
    while kinds:
        kind = kinds.pop()
        if isinstance(kind, Quantity):
            return kind.unit
        kinds += [*getattr(kind, "__metadata__", ()), *get_args(kind)]
    return None


@lru_cache(maxsize=65536)
def _measure(cell, unit):
    """A varied value as a float in a unit (None: SI), or as it is when it is no quantity."""
    try:
        number, own = split(cell) if isinstance(cell, str) else (None, "")
        ratio = common_factor(own or _si(unit), unit) if unit is not None else factor(own, _si(own))
        return float(ratio) * float(cell) if number is None else float(number * ratio)
    except (ValueError, OverflowError):
        return cell


@lru_cache(maxsize=256)
def _si(unit):
    """The program's unit of what a unit measures; the unit itself when it measures something else, or nothing."""
    for known in DIMENSIONS if unit else ():
        try:
            factor(unit, known)
        except ValueError:
            continue
        return known
    return unit


@dataclass(frozen=True)
class Operand:
    """One side of a comparison; exactly one of the first three."""

    name: Name | None
    number: tuple | None  # (Fraction, unit)
    text: str | None
    token: Token


def parse(text, names):
    """Read a condition.

    Parameters
    ----------
    text : str
    names : Names

    Returns
    -------
    callable
        Row -> True, False or None.

    Raises
    ------
    SceneError
        `--where:COLUMN: ...`
    """
    return _Parser(text, names).whole()


class _Parser:
    def __init__(self, text, names):
        self.names, self.depth, self.place = names, 0, 0
        if len(text) > MAX_LENGTH:
            raise SceneError(f"--where: {len(text)} characters (at most {MAX_LENGTH})")
        self.tokens = self._tokens(text)

    def _tokens(self, text):
        tokens, place, end = [], 0, len(text.rstrip())
        while place < end:
            match = _TOKEN.match(text, place)
            if match is None:
                while text[place].isspace():
                    place += 1
                self._refuse(place + 1, f"unexpected {text[place : place + 1]!r}")
            kind = match.lastgroup
            tokens.append(Token(kind, match[kind].strip(), match.start(kind) + 1))
            place = match.end()
        return [*tokens, Token("end", "", end + 1)]

    @staticmethod
    def _refuse(column, message):
        raise SceneError(f"--where:{column}: {message}")

    @property
    def token(self):
        return self.tokens[self.place]

    def _take(self, *texts):
        """The next token when it is one of these words or signs."""
        token = self.token
        if token.kind in ("name", "sign") and token.text in texts:
            self.place += 1
            return token
        return None

    def whole(self):
        """The condition, and nothing behind it."""
        condition = self.condition()
        token = self.token
        if token.kind != "end":
            hint = INSTEAD.get(token.text)
            wanted = f"use {hint}" if hint else "expected and, or, or the end"
            self._refuse(token.column, f"unexpected {token.text!r} ({wanted})")
        return condition

    def condition(self):
        """`both {"or" both}`"""
        return self._joined(self.both, "or", any_of)

    def both(self):
        """`negation {"and" negation}`"""
        return self._joined(self.negation, "and", all_of)

    def _joined(self, part, word, join):
        parts = [part()]
        while self._take(word):
            parts.append(part())
        return join(parts) if len(parts) > 1 else parts[0]

    def negation(self):
        """`"not" negation | "(" condition ")" | comparison`"""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            self._refuse(self.token.column, f"nested more than {MAX_DEPTH} deep")
        if self._take("not"):
            found = none_of(self.negation())
        elif opened := self._take("("):
            found = self.condition()
            if not self._take(")"):
                self._refuse(self.token.column, f"expected ')' for the '(' of column {opened.column}")
        else:
            found = self.comparison()
        self.depth -= 1
        return found

    def comparison(self):
        """`operand operator operand {operator operand}`"""
        tokens, signs = [self.operand()], []
        while sign := self._take(*OPERATORS):
            signs.append(sign)
            tokens.append(self.operand())
        if not signs:
            token = self.token
            hint = f"use {INSTEAD[token.text]}" if token.text in INSTEAD else "expected < <= > >= == or !="
            self._refuse(token.column, f"{hint} after {tokens[0].text!r}")
        operands = self._resolved(tokens, all(sign.text in ("==", "!=") for sign in signs))
        self._check_kinds(operands, signs)
        names = [operand.name for operand in operands if operand.name and not operand.name.text]
        unit = next((name.unit for name in sorted(names, key=lambda name: name.varied) if name.unit is not None), None)
        return chain([self._getter(operand, unit) for operand in operands], [OPERATORS[sign.text] for sign in signs])

    def operand(self):
        """The token of an operand."""
        token = self.token
        if token.kind in ("end", "sign") or token.text in WORDS:
            got = f"got {token.text!r}" if token.text else "got nothing"
            hint = f" (use {INSTEAD[token.text]})" if token.text in INSTEAD else ""
            self._refuse(token.column, f"expected a column, a number or a text, {got}{hint}")
        self.place += 1
        return token

    def _resolved(self, tokens, may_be_text):
        """Tokens -> Operand. A word that is no column is text where it is set equal to what may hold text."""
        operands, unknown = [], []
        for token in tokens:
            name, number, text = None, None, None
            if token.kind == "number":
                number = self._number(token)
            elif token.kind == "text":
                text = token.text[1:-1]
            else:
                try:
                    name = self.names.find(token.text)
                except ValueError as error:
                    unknown.append((token, error))
                    text = token.text
            operands.append(Operand(name, number, text, token))
        texts = [o for o in operands if o.name and (o.name.text or (o.name.varied and o.name.unit is None))]
        if unknown and not (texts and may_be_text):
            self._refuse(unknown[0][0].column, str(unknown[0][1]))
        if not any(operand.name for operand in operands):
            self._refuse(tokens[0].column, "compares no column")
        return operands

    def _number(self, token):
        try:
            return split(token.text)
        except ValueError:
            self._refuse(token.column, f"not a number: {show(token.text)}")

    def _check_kinds(self, operands, signs):
        """Numbers compare with numbers, texts with texts; a varied key may hold either."""
        numbers = [o for o in operands if o.number is not None or (o.name and not o.name.text and not o.name.varied)]
        texts = [o for o in operands if o.text is not None or (o.name and o.name.text)]
        if numbers and texts:
            later = max(numbers[0].token, texts[0].token, key=lambda token: token.column)
            message = f"{numbers[0].token.text} is a number, and {texts[0].token.text} is text"
            self._refuse(later.column, message)
        for sign in signs if texts else ():
            if sign.text not in ("==", "!="):
                self._refuse(sign.column, "texts compare by == and != only")

    def _getter(self, operand, unit):
        """Row -> value in a unit (None: SI)."""
        try:
            if operand.name:
                name = operand.name
                if None not in (name.unit, unit) and not name.text:
                    common_factor(name.unit, unit)
                return lambda row: name.value(row, unit)
            if operand.number is not None:
                number, own = operand.number
                if own:
                    number *= common_factor(own, unit) if unit is not None else factor(own, _si(own))
                value = float(number)
            else:
                value = operand.text
        except ValueError as error:
            self._refuse(operand.token.column, str(error).replace('""', "no unit"))
        except OverflowError:
            self._refuse(operand.token.column, f"out of range: {show(operand.token.text)}")
        return lambda row: value


def chain(getters: list[Callable], tests):
    """Comparisons in a row: every neighbours' one must hold."""

    def holds(row):
        values = [getter(row) for getter in getters]
        if None in values:
            return None
        for (first, second), test in zip(pairwise(values), tests, strict=True):
            if isinstance(first, str) != isinstance(second, str):
                if test is operator.ne:
                    continue
                return False if test is operator.eq else None
            if not test(first, second):
                return False
        return True

    return holds


def all_of(conditions):
    """`and` of what may be unknown."""

    def holds(row):
        found = [condition(row) for condition in conditions]
        return False if False in found else None if None in found else True

    return holds


def any_of(conditions):
    """`or` of what may be unknown."""

    def holds(row):
        found = [condition(row) for condition in conditions]
        return True if True in found else None if None in found else False

    return holds


def none_of(condition):
    """`not` of what may be unknown."""

    def holds(row):
        found = condition(row)
        return None if found is None else not found

    return holds
