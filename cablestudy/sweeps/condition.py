"""The condition of --where: comparisons joined by and, or, not; text -> function of a pandas.DataFrame.

    operand = column | varied key | number[/number] [unit] | "text" | 'text'

Python's parser reads the condition with `x` in the place of each operand. Its syntax tree is translated node by node;
all nodes except and, or, not and comparisons of operands are refused. Nothing is evaluated as code.

A number without a unit is in the unit of the column that it is compared with, next to a varied key in SI. Empty cells
follow Kleene's three-valued logic: a comparison with one is unknown (None).
"""

import ast
import operator
from bisect import bisect_right
from functools import reduce
from itertools import compress, pairwise

import pandas

from cablestudy.errors import SceneError
from cablestudy.scene.tokens import tokens_of
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import converted, show, split
from cablestudy.sweeps.tolerances import SWEEPS
from cablestudy.sweeps.variable import Variable, variable

OPERATORS = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
EQUALITY = (operator.eq, operator.ne)
OPERAND_KINDS = ("number", "name", "text")
SIGNS = "<", "<=", ">", ">=", "==", "!="
# in messages: what may follow an operand, and a comparison
SIGN, END = f"{' '.join(SIGNS[:-1])} or {SIGNS[-1]}", "and, or, or the end"


def parse(text, study):
    """Read a condition; columns of it that the study does not have are added to it.

    Returns a function, pandas.DataFrame of rows -> Series of True, False or NA (unknown), and a tuple of texts: which
    numbers next to varied keys lack a unit, as "14 is 14 m". SceneError: `--where:COLUMN: ...`
    """
    if len(text) > SWEEPS.condition_characters:
        raise SceneError(f"--where: {len(text)} characters (at most {SWEEPS.condition_characters})")
    translator = _Translator(tokens_of(text, _refuse), study)
    return translator.translate(), tuple(translator.bare)


def _refuse(column, message):
    """Raise the SceneError of a mistake at a column of the condition, from 1."""
    raise SceneError(f"--where:{column}: {message}")


def _check_neighbours(tokens):
    """Refuse an operand, `(` or `not` right after an operand or `)`, which Python's parser may take for a call."""
    for before_last, last, token in zip([None, *tokens], tokens, tokens[1:], strict=False):
        is_complete = last.kind in OPERAND_KINDS or last.text == ")"
        if is_complete and (token.kind in OPERAND_KINDS or token.text in ("(", "not")):
            compared = last.text == ")" or (before_last and before_last.text in SIGNS)
            _refuse(token.column, f"expected {END if compared else SIGN}, got {token.text!r}")


class _Translator:
    """Translator of the syntax tree of a condition to a function of a pandas.DataFrame."""

    def __init__(self, tokens, study):
        self.tokens, self.study = tokens, study
        self.source, self.offsets = "", []  # what Python parses, and where each token begins in it
        self.bare = []  # texts of the numbers without a unit next to varied keys that have one, with that unit
        _check_neighbours(tokens)
        for token in tokens:
            self.offsets.append(len(self.source))
            self.source += ("x" if token.kind in OPERAND_KINDS else token.text) + " "

    def translate(self):
        """The function of the whole condition: DataFrame -> Series, see `parse`."""
        try:
            return self.condition(ast.parse(self.source, mode="eval").body)
        except SyntaxError as error:
            if "nested" not in error.msg:
                self.refuse_syntax(error)
        except (RecursionError, MemoryError):
            pass
        raise SceneError(f"--where: nested more than {SCENE.nesting} deep")  # than Python's parser allows, even

    def refuse_syntax(self, error):
        """Report where Python's parser stopped, and what was expected there."""
        token = self.tokens[-1] if not error.offset else self.token_at(error.offset - 1)
        if "never closed" in error.msg:
            _refuse(token.column, "'(' is never closed")
        before = self.tokens[: self.tokens.index(token)][-1:]  # a list of one token, or empty
        is_complete = before and (before[0].kind in OPERAND_KINDS or before[0].text == ")")
        expected = END if is_complete else "a column, a number or a text"
        _refuse(token.column, f"expected {expected}, got {repr(token.text) if token.text else 'nothing'}")

    def token_at(self, offset):
        """The token at an offset of the parsed source."""
        return self.tokens[bisect_right(self.offsets, offset) - 1]

    def condition(self, node, depth=0):
        """Function of a frame for a node that is `and`, `or`, `not` or a comparison."""
        if depth >= SCENE.nesting:
            _refuse(self.token_at(node.col_offset).column, f"nested more than {SCENE.nesting} deep")
        match node:
            case ast.BoolOp():
                conditions = [self.condition(value, depth + 1) for value in node.values]
                join = operator.or_ if isinstance(node.op, ast.Or) else operator.and_
                return lambda frame: reduce(join, [condition(frame) for condition in conditions])
            case ast.UnaryOp(op=ast.Not()):
                condition = self.condition(node.operand, depth + 1)
                return lambda frame: ~condition(frame)
            case ast.Compare():
                return self.comparison(node)
        self.refuse_node(node)

    def refuse_node(self, node):
        """Report a node that is neither a condition nor an operand where one of them is expected."""
        token = self.token_at(node.col_offset)
        if isinstance(node, ast.Name):
            following = self.tokens[self.tokens.index(token) + 1]
            _refuse(following.column, f"expected {SIGN} after {token.text!r}")
        got = "empty brackets" if isinstance(node, ast.Tuple) else "a condition"
        _refuse(token.column, f"expected a column, a number or a text, got {got}")

    def comparison(self, node):
        """Function of a frame for operands with an operator between each two neighbours, as `1 < sag <= 2`."""
        operand_nodes = (node.left, *node.comparators)
        for operand_node in operand_nodes:
            if not isinstance(operand_node, ast.Name):
                self.refuse_node(operand_node)
        tokens = [self.token_at(operand_node.col_offset) for operand_node in operand_nodes]
        tests = [OPERATORS[type(sign)] for sign in node.ops]
        after_order_sign = [token for token, test in zip(tokens[1:], tests, strict=True) if test not in EQUALITY]
        operands = self.operands(tokens, may_be_text=not after_order_sign)
        check_kinds(operands, tokens)
        if after_order_sign and any(is_text(operand) for operand in operands):
            sign = self.tokens[self.tokens.index(after_order_sign[0]) - 1]
            _refuse(sign.column, "texts compare by == and != only")
        unit = common_unit(operands)
        if unit and any(isinstance(operand, Variable) and operand.is_varied for operand in operands):
            without_unit = [isinstance(operand, tuple) and not operand[1] for operand in operands]
            self.bare += [f"{token.text} is {token.text} {unit}" for token in compress(tokens, without_unit)]
        getters = [self.getter(operand, token, unit) for operand, token in zip(operands, tokens, strict=True)]
        return compare_in_turn(getters, tests)

    def operands(self, tokens, may_be_text):
        """The operands of one comparison, from their tokens: list of Variable, (number, unit) or text.

        A word that is neither a column nor a varied key is a text, if a column or key of the comparison may hold text,
        and its operators allow them (`may_be_text`); else it is a mistake, as is a comparison without a column or key.
        """
        operands, unknown = [], []
        for token in tokens:
            try:
                operands.append(self.operand(token))
            except ValueError as error:
                unknown.append((token, error))
                operands.append(token.text)
        variables = [operand for operand in operands if isinstance(operand, Variable)]
        may_hold_text = any(operand.is_text or (operand.is_varied and operand.unit is None) for operand in variables)
        if unknown and not (may_hold_text and may_be_text):
            token, error = unknown[0]
            _refuse(token.column, str(error))
        if not variables:
            _refuse(tokens[0].column, "compares no column")
        return operands

    def operand(self, token):
        """Variable, number (Decimal, unit) or text of a token; ValueError for an unknown word."""
        if token.kind == "text":
            return token.text[1:-1]
        if token.kind == "name":
            return variable(token.text, self.study, "--where")
        try:
            return split(token.text)
        except ValueError:
            _refuse(token.column, f"not a number: {show(token.text)}")

    def getter(self, operand, token, unit):
        """Function from a frame of rows to the values of an operand in a unit, as a Series; of a constant all equal."""
        try:
            if isinstance(operand, Variable):
                return operand.getter(unit)
            if isinstance(operand, tuple):
                number, written_unit = operand  # without one it is in that of the comparison already
                operand = float(converted(number, written_unit, unit) if written_unit else number)
        except ValueError as error:
            _refuse(token.column, str(error).replace('""', "no unit"))
        except OverflowError:
            _refuse(token.column, f"out of range: {show(token.text)}")
        kind = object if isinstance(operand, str) else "Float64"
        return lambda frame: pandas.Series(operand, frame.index, dtype=kind)


def is_text(operand):
    """True if an operand is text, and never a number."""
    return isinstance(operand, str) or (isinstance(operand, Variable) and operand.is_text)


def check_kinds(operands, tokens):
    """Refuse a comparison of text with a number; a varied key may hold either."""
    kinds = {}
    for operand, token in zip(operands, tokens, strict=True):
        if not (isinstance(operand, Variable) and operand.is_varied):
            kinds.setdefault("text" if is_text(operand) else "number", token)
    if len(kinds) == 2:
        later = max(kinds.values(), key=lambda token: token.column)
        _refuse(later.column, f"{kinds['number'].text} is a number, and {kinds['text'].text} is text")


def common_unit(operands):
    """The unit in which operands are compared: that of the first column, else of the first varied key."""
    numeric = [operand for operand in operands if isinstance(operand, Variable) and not operand.is_text]
    columns_first = sorted(numeric, key=lambda operand: operand.is_varied)
    return next((operand.unit for operand in columns_first if operand.unit is not None), "")


def compare_in_turn(getters, tests):
    """Function of a frame: nullable boolean Series, True where each value compares with the next, as `1 < sag <= 2`.

    Parameters
    ----------
    getters : list of callable
        Frame -> Series of the values of each operand.
    tests : list of callable
        From OPERATORS, one between each two operands.
    """

    def holds(frame):
        pairs = pairwise([getter(frame) for getter in getters])
        return reduce(operator.and_, [compare(*pair, test) for pair, test in zip(pairs, tests, strict=True)])

    return holds


def compare(first, second, test):
    """Nullable boolean Series: how two Series of numbers, or of numbers and texts, compare cell by cell."""
    if first.dtype == second.dtype == "Float64":
        return test(first, second)
    outcomes = [compare_cells(*pair, test) for pair in zip(first, second, strict=True)]
    return pandas.Series(outcomes, first.index, dtype="boolean")


def compare_cells(first, second, test):
    """True, False or None (unknown); a number and a text are unequal, and have no order."""
    if not (isinstance(first, str | float) and isinstance(second, str | float)):
        return None
    if isinstance(first, str) == isinstance(second, str):
        return bool(test(first, second))
    return test is operator.ne if test in EQUALITY else None
