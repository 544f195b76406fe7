"""Tokens of a condition, as in --where and limits: numbers with units, names, texts, words, signs and brackets."""

import re
from typing import NamedTuple

# token of other languages -> what a condition has instead
INSTEAD = {"=": "==", "<>": "!=", "&&": "and", "||": "or", "&": "and", "|": "or", "!": "not"}

_WORD = r"[A-Za-zµμΩ°%][A-Za-z0-9µμΩ°%]*"
_UNIT = rf"(?!(?:and|or|not)\b){_WORD}(?:[*/·]{_WORD}|\^-?[0-9]{{1,2}}|[²³])*"
_TOKEN = re.compile(
    rf"""\s*(?:
    (?P<number>[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?(?:/[0-9]{{1,9}}(?![0-9.]))?\s*(?:{_UNIT})?)
    |(?P<word>(?:and|or|not)(?![\w.-]))
    |(?P<name>[^\W\d]\w*(?:[.-]\w+)*)
    |(?P<text>"[^"]*"|'[^']*')
    |(?P<sign><>|<=|>=|==|!=|&&|\|\||[<>=!&|()])
    )""",
    re.VERBOSE,
)


class Token(NamedTuple):
    """A piece of a condition: its kind (a group of _TOKEN, or `end`), its text, and where it begins, counted from 1."""

    kind: str
    text: str
    column: int


def tokens_of(text, refuse):
    """Split the text of a condition, such as "sag > 2 m and clearance >= 6 m", into tokens: list of `Token`.

    The last one is of the kind `end`. `refuse` is called with a position (from 1) and a message where the text is no
    token; it must raise an error.
    """
    tokens, position, end = [], 0, len(text.rstrip())
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            wrong_index = end - len(text[position:end].lstrip())  # of the first character that is no blank
            refuse(wrong_index + 1, f"unexpected {text[wrong_index]!r}")
        kind = match.lastgroup
        token = Token(kind, match[kind].strip(), match.start(kind) + 1)
        if token.text in INSTEAD:
            refuse(token.column, f"unexpected {token.text!r} (use {INSTEAD[token.text]})")
        tokens.append(token)
        position = match.end()
    return [*tokens, Token("end", "", end + 1)]
