"""YAML text -> a tree of values that know their line and column, by the rules of YAML 1.2 and nothing looser.

PyYAML scans and parses; what its loaders would then guess (YAML 1.1 numbers, `no` as false, the last of two equal keys)
is decided here instead.
"""

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

import yaml

from cablestudy.errors import Mistake, SceneError

MAX_DEPTH = 50
MAX_ALIASED = 100_000
MAX_DIGITS = 400

_PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_CORE = "tag:yaml.org,2002:"
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = {"": None, "~": None} | {
    spelling: value
    for word, value in (("null", None), ("true", True), ("false", False))
    for spelling in (word, word.capitalize(), word.upper())
}
_SPECIAL |= {
    sign + spelling: float(sign + "inf") for sign in ("", "+", "-") for spelling in (".inf", ".Inf", ".INF")
} | {spelling: float("nan") for spelling in (".nan", ".NaN", ".NAN")}

# (what PyYAML or libyaml calls it, what the user can do about it, whether the place is where the construct began)
_HUMAN = (
    (r"tab character", "a tab: YAML indents with spaces", False),
    (r"unexpected end of stream", "quoted text is not closed", True),
    (r"while scanning.*quoted scalar.*document", "quoted text is not closed", True),
    (r"flow sequence", "list: expected ',' or ']' (is a bracket not closed?)", True),
    (r"flow mapping", "mapping: expected ',' or '}' (is a brace not closed?)", True),
    (r"mapping values are not", "': ' is not allowed here (indentation? quotes around text with ': '?)", False),
    (r"could not find expected ':'|required simple key", "expected 'key: value'", False),
    (r"expected key|block end|'-' indicator", "does not fit the lines above (check the indentation)", False),
    (r"document start", "does not fit the lines above (check the indentation)", False),
    (r"cannot start any token", "text that begins with this character must be quoted", False),
    (r"node content", "expected a value", False),
    (r"unknown escape", "unknown \\ escape (use 'single quotes' for text with a backslash)", False),
)


class Place(NamedTuple):
    """A position in a file, or the command-line option that carried a value (line 0).

    Attributes
    ----------
    name : str
        The file as the user named it, or the option.
    line, column : int
        Counted from 1; 0 for an option or a whole file. [-]
    """

    name: str
    line: int = 0
    column: int = 0

    def __str__(self):
        return f"{self.name}:{self.line}:{self.column}" if self.line else self.name


@dataclass(slots=True)
class Node:
    """A value and its place: `content` is a scalar, a dict of Node or a list of Node; `keys`: where the keys are."""

    content: Any
    place: Place
    keys: dict[str, Place] | None = None

    def plain(self):
        """Return the value without places: dict, list, str, int, float, bool or None."""
        if isinstance(self.content, dict):
            return {key: node.plain() for key, node in self.content.items()}
        if isinstance(self.content, list):
            return [node.plain() for node in self.content]
        return self.content


def mistake(place, key, message):
    """Return a Mistake whose key is left out when the place, an option such as `--set cable.area`, names it already.

    Parameters
    ----------
    place : Place or str
        Where.
    key, message : str
        The dotted key, and what is wrong with it.
    """
    return Mistake(str(place), "" if key and str(place) in (f"--set {key}", f"--vary {key}") else key, message)


def refuse(place, message, key=""):
    """Return the SceneError of a single mistake.

    Parameters
    ----------
    place : Place or str
        Where.
    message, key : str
        What is wrong, and the dotted key that it is about.
    """
    return SceneError(mistake(place, key, message))


def resolve(text):
    """Value of a plain (unquoted) scalar by the YAML 1.2 core schema.

    Parameters
    ----------
    text : str
        As written.

    Returns
    -------
    None, bool, int, float or str

    Raises
    ------
    ValueError
        A number of more than 400 digits.
    """
    if text in _SPECIAL:
        return _SPECIAL[text]
    kind = int if _INTEGER.fullmatch(text) else float if _FLOAT.fullmatch(text) else None
    if kind is None:
        return text
    if len(text) > MAX_DIGITS:
        raise ValueError(f"a number of {len(text)} characters (at most {MAX_DIGITS})")
    if kind is float:
        return float(text)
    return int(text[2:], {"o": 8, "x": 16}[text[1]]) if text[1:2] in ("o", "x") else int(text)


def compose(text, name):
    """Read one YAML document.

    Parameters
    ----------
    text : str
        The whole file.
    name : str
        What to call it in messages.

    Returns
    -------
    Node or None
        None when the text holds no document at all.

    Raises
    ------
    SceneError
        Whatever is not plain, well-formed YAML.
    """
    text = text.removeprefix("\ufeff")
    if bad := _UNPRINTABLE.search(text):
        line, column = _line_column(text, bad.start())
        raise refuse(Place(name, line, column), f"character U+{ord(bad[0]):04X} is not text (is this a YAML file?)")
    try:
        parser = _PARSER(text)
        try:
            return _Builder(parser, name).document()
        finally:
            parser.dispose()
    except yaml.YAMLError as error:
        raise _syntax_error(error, text, name) from None
    except (OverflowError, ValueError):  # PyYAML without libyaml, on an escape beyond the last character of Unicode
        raise refuse(Place(name), "an escape in quoted text that stands for no character") from None


def _line_column(text, index):
    """Line and column, from 1, of a character."""
    start = text.rfind("\n", 0, index) + 1
    return text.count("\n", 0, index) + 1, index - start + 1


def _syntax_error(error, text, name):
    """PyYAML's several lines about a mistake -> one line that says what to do."""
    problem = f"{getattr(error, 'context', '') or ''}: {getattr(error, 'problem', '') or error}"
    mark, began = getattr(error, "problem_mark", None), getattr(error, "context_mark", None)
    if mark is not None and "cannot start any token" in problem and _character(text, mark) == "\t":
        problem = "tab character"
    known = (row for row in _HUMAN if re.search(row[0], problem))
    _, message, use_began = next(known, (None, "not YAML: " + " ".join(problem.strip(": ").split()), False))
    mark = began if use_began and began is not None else mark
    return refuse(_place(name, mark) if mark is not None else Place(name), message)


def _character(text, mark):
    """The character under a mark (empty past the end)."""
    lines = text.splitlines()
    return lines[mark.line][mark.column : mark.column + 1] if mark.line < len(lines) else ""


def _place(name, mark):
    return Place(name, mark.line + 1, mark.column + 1)


def _written_tag(tag):
    """A tag as users write it."""
    return "!!" + tag.removeprefix(_CORE) if tag.startswith(_CORE) else tag[:60]


class _Builder:
    """Events of the parser -> Node. Works on events because PyYAML's own composer recurses without a bound."""

    def __init__(self, parser, name):
        self.parser = parser
        self.name = name
        self.anchors = {}  # name -> (node, how many nodes it holds, how deep), or None while it is still open
        self.aliased = 0

    def document(self):
        """The only document of the stream, or None."""
        self.parser.get_event()  # stream start
        if isinstance(self.parser.get_event(), yaml.StreamEndEvent):
            return None
        node, _, _ = self.node(self.parser.get_event(), 0)
        self.parser.get_event()  # document end
        event = self.parser.get_event()
        if not isinstance(event, yaml.StreamEndEvent):
            raise refuse(_place(self.name, event.start_mark), "a second document ('---'): one file holds one document")
        return node

    def node(self, event, depth):
        """One node, the number of nodes in it and the levels below it."""
        place = _place(self.name, event.start_mark)
        if depth > MAX_DEPTH:
            raise refuse(place, f"nested more than {MAX_DEPTH} deep")
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event.anchor, place, depth)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        build = {yaml.ScalarEvent: self.scalar, yaml.MappingStartEvent: self.mapping}.get(type(event), self.sequence)
        built = build(event, place, depth)
        if event.anchor is not None:
            self.anchors[event.anchor] = built
        return built

    def alias(self, anchor, place, depth):
        """What an alias stands for, at the place of the alias."""
        if anchor not in self.anchors:
            raise refuse(place, f"alias *{anchor} has no anchor &{anchor} above it")
        if self.anchors[anchor] is None:
            raise refuse(place, f"alias *{anchor} stands inside of what it repeats")
        node, size, height = self.anchors[anchor]
        if depth + height > MAX_DEPTH:
            raise refuse(place, f"nested more than {MAX_DEPTH} deep")
        self.aliased += size
        if self.aliased > MAX_ALIASED:
            raise refuse(place, f"aliases repeat more than {MAX_ALIASED} values")
        return Node(node.content, place, node.keys), size, height

    def scalar(self, event, place, depth):
        """A value: quoted and block text is text, plain text follows the core schema."""
        tag = (event.tag or "").removeprefix(_CORE)
        if event.style == '"' and (bad := _UNPRINTABLE.search(event.value)):
            raise refuse(place, f"character U+{ord(bad[0]):04X} is not text")
        if tag in ("!", "str") or (not tag and not event.implicit[0]):
            return Node(event.value, place), 1, 0
        try:
            value = resolve(event.value)
        except ValueError as error:
            raise refuse(place, str(error)) from None
        kinds = {"": object, "int": int, "float": (int, float), "bool": bool, "null": type(None)}
        if tag not in kinds:
            raise refuse(place, f"tag {_written_tag(event.tag)} is not allowed")
        if not isinstance(value, kinds[tag]) or (isinstance(value, bool) and tag in ("int", "float")):
            raise refuse(place, f"{event.value[:40]!r} is not of the type !!{tag}")
        return Node(float(value) if tag == "float" else value, place), 1, 0

    def container_tag(self, event, place, allowed):
        """Refuse a tag on a mapping or a list, except its own."""
        tag = (event.tag or "").removeprefix(_CORE)
        if tag not in ("", "!", allowed):
            raise refuse(place, f"tag {_written_tag(event.tag)} is not allowed")

    def sequence(self, event, place, depth):
        """A list."""
        self.container_tag(event, place, "seq")
        items, size, height = [], 1, 0
        while not isinstance(event := self.parser.get_event(), yaml.SequenceEndEvent):
            item, count, levels = self.node(event, depth + 1)
            items.append(item)
            size, height = size + count, max(height, levels + 1)
        return Node(items, place), size, height

    def mapping(self, event, place, depth):
        """A mapping; keys are text and occur once."""
        self.container_tag(event, place, "map")
        content, keys, size, height = {}, {}, 1, 0
        while not isinstance(event := self.parser.get_event(), yaml.MappingEndEvent):
            key_node, _, _ = self.node(event, depth + 1)
            key = key_node.content
            if not isinstance(key, str):
                shown = "a list or a mapping" if isinstance(key, (list, dict)) else repr(key)
                raise refuse(key_node.place, f"a key must be text, got {shown}")
            if not key.isprintable():
                raise refuse(key_node.place, f"a key is text on one line, got {key[:60]!r}")
            if key in content:
                raise refuse(key_node.place, f"key {key[:60]!r} is given twice (first on line {keys[key].line})")
            keys[key] = key_node.place
            content[key], count, levels = self.node(self.parser.get_event(), depth + 1)
            size, height = size + count + 1, max(height, levels + 1)
        return Node(content, place, keys), size, height
