"""YAML text -> plain values and the place of each, by the rules of YAML 1.2.

PyYAML scans, parses and composes. Its loaders are not used: they follow YAML 1.1 (`no` is false, 1:30 is 90) and take
the last of two equal keys.
"""

import re
from typing import NamedTuple

import yaml

from cablestudy.errors import Mistake, SceneError

MAX_DEPTH = 50
MAX_ALIASED = 100_000
MAX_DIGITS = 400

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_CORE = "tag:yaml.org,2002:"
_PLAIN = ""  # tag of a scalar without quotes, whose type follows from its text
_DEFAULT_TAGS = {yaml.SequenceNode: _CORE + "seq", yaml.MappingNode: _CORE + "map"}
_NO_TYPE = re.compile(r"(&\S+\s+)?!(\s|$)")  # `! 5` is text; PyYAML drops the sign
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"[-+]?\.(inf|Inf|INF)")
_WORDS = {"": None, "~": None, ".nan": float("nan"), ".NaN": float("nan"), ".NAN": float("nan")} | {
    spelling: value
    for word, value in (("null", None), ("true", True), ("false", False))
    for spelling in (word, word.capitalize(), word.upper())
}
_TYPES = {_PLAIN: object, "int": int, "float": (int, float), "bool": bool, "null": type(None)}

# (pattern of PyYAML's or libyaml's message, message shown, whether its place is the beginning of the construct)
_MESSAGES = (
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
    (r"unknown escape", r"unknown \\ escape (use 'single quotes' for text with a backslash)", False),
    (r"undefined alias \*(\w*)", r"alias *\1 has no anchor &\1 above it", False),
    (r"duplicate anchor", "an anchor of this name stands above already", False),
    (r"another document", "a second document ('---'): one file holds one document", False),
    (r"nested more", f"nested more than {MAX_DEPTH} deep", False),
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


def mistake(place, key, message):
    """A Mistake, whose key is left out when the place is an option that names it already (`--set cable.area`).

    Parameters
    ----------
    place : Place or str
    key, message : str
        The dotted key, and what is wrong with it.
    """
    return Mistake(str(place), "" if key and str(place) in (f"--set {key}", f"--vary {key}") else key, message)


def refuse(place, message, key=""):
    """The SceneError of a single mistake; parameters as in `mistake`."""
    return SceneError(mistake(place, key, message))


def resolve(text):
    """Value of a plain (unquoted) scalar by the YAML 1.2 core schema.

    Parameters
    ----------
    text : str

    Returns
    -------
    None, bool, int, float or str

    Raises
    ------
    ValueError
        A number of more than 400 digits.
    """
    if text in _WORDS:
        return _WORDS[text]
    if text[0] not in "+-.0123456789":
        return text
    if _INFINITE.fullmatch(text):
        return float(text.replace(".", ""))
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
        How messages call it.

    Returns
    -------
    value : dict, list, str, int, float, bool or None
    places : dict
        Path (tuple of str and int) -> (Place of the value, Place of its key); empty when the text holds no document.

    Raises
    ------
    SceneError
        The text is not well-formed, or not plain YAML.
    """
    text = text.removeprefix("\ufeff")
    if bad := _UNPRINTABLE.search(text):
        line, start = text.count("\n", 0, bad.start()) + 1, text.rfind("\n", 0, bad.start()) + 1
        message = f"character U+{ord(bad[0]):04X} is not text (is this a YAML file?)"
        raise refuse(Place(name, line, bad.start() - start + 1), message)
    try:
        node = _Composer(text).get_single_node()
    except yaml.YAMLError as error:
        raise _syntax_error(error, text, name) from None
    except (OverflowError, ValueError):  # PyYAML without libyaml, on an escape beyond the last character of Unicode
        raise refuse(Place(name), "an escape in quoted text that stands for no character") from None
    reader = _Reader(text, name)
    return (None if node is None else reader.value(node, (), None)), reader.places


def _syntax_error(error, text, name):
    """A message of PyYAML, of several lines, as one line that says what to do."""
    problem = f"{getattr(error, 'context', '') or ''}: {getattr(error, 'problem', '') or error}"
    mark, began = getattr(error, "problem_mark", None), getattr(error, "context_mark", None)
    here = "" if mark is None else (text.splitlines()[mark.line : mark.line + 1] or [""])[0][mark.column :]
    if "cannot start any token" in problem and here.startswith("\t"):
        problem = "tab character"
    if "undefined alias" in problem:
        problem = f"undefined alias {here}"
    message, use_began = "not YAML: " + " ".join(problem.strip(": ").split()), False
    for pattern, template, at_beginning in _MESSAGES:
        if found := re.search(pattern, problem):
            message, use_began = found.expand(template), at_beginning
            break
    mark = began if use_began and began is not None else mark
    return refuse(_place(name, mark) if mark is not None else Place(name), message)


def _place(name, mark):
    return Place(name, mark.line + 1, mark.column + 1)


class _Composer(_LOADER):
    """PyYAML's composer, of libyaml where PyYAML has it, with a limit of depth and types by YAML 1.2."""

    depth = 0

    def descend_resolver(self, parent, index):
        """Refuse nodes deeper than MAX_DEPTH, since composing recurses."""
        self.depth += 1
        if self.depth > MAX_DEPTH + 1:
            raise yaml.composer.ComposerError(None, None, "nested more", parent.start_mark)

    def ascend_resolver(self):
        """Count back."""
        self.depth -= 1

    def resolve(self, kind, value, implicit):
        """Tag of a node without one: text when quoted."""
        return _DEFAULT_TAGS.get(kind) or (_PLAIN if implicit[0] else _CORE + "str")


class _Reader:
    """Nodes -> plain values; `places` collects where they are. An alias has the place of its anchor."""

    def __init__(self, text, name):
        self.text, self.name, self.places = text, name, {}
        self._seen, self._open, self._aliased = set(), set(), 0

    def value(self, node, path, key_place):
        """The plain value of a node."""
        place = _place(self.name, node.start_mark)
        if len(path) > MAX_DEPTH:
            raise refuse(place, f"nested more than {MAX_DEPTH} deep")
        if id(node) in self._open:
            raise refuse(place, "an alias inside of what it repeats")
        self._aliased += id(node) in self._seen
        if self._aliased > MAX_ALIASED:
            raise refuse(place, f"aliases repeat more than {MAX_ALIASED} values")
        self._seen.add(id(node))
        self.places[path] = (place, key_place or place)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, place)
        if node.tag != _DEFAULT_TAGS[type(node)]:
            raise refuse(place, f"tag {_written_tag(node.tag)} is not allowed")
        self._open.add(id(node))
        read = self._mapping if isinstance(node, yaml.MappingNode) else self._sequence
        value = read(node, path)
        self._open.discard(id(node))
        return value

    def _scalar(self, node, place):
        tag = node.tag.removeprefix(_CORE)
        if node.style == '"' and (bad := _UNPRINTABLE.search(node.value)):
            raise refuse(place, f"character U+{ord(bad[0]):04X} is not text")
        start = node.start_mark.index
        if tag == "str" or (
            self.text[start : start + 1] in ("!", "&") and tag == _PLAIN and _NO_TYPE.match(self.text, start)
        ):
            return node.value
        if tag not in _TYPES:
            raise refuse(place, f"tag {_written_tag(node.tag)} is not allowed")
        try:
            value = resolve(node.value)
        except ValueError as error:
            raise refuse(place, str(error)) from None
        if not isinstance(value, _TYPES[tag]) or (isinstance(value, bool) and tag in ("int", "float")):
            raise refuse(place, f"{node.value[:40]!r} is not of the type !!{tag}")
        return float(value) if tag == "float" else value

    def _sequence(self, node, path):
        return [self.value(item, (*path, index), None) for index, item in enumerate(node.value)]

    def _mapping(self, node, path):
        """A mapping, whose keys are text and occur once."""
        content = {}
        for key_node, item in node.value:
            place = _place(self.name, key_node.start_mark)
            if not isinstance(key_node, yaml.ScalarNode):
                raise refuse(place, "a key must be text, got a list or a mapping")
            key = self._scalar(key_node, place)
            if not isinstance(key, str):
                raise refuse(place, f"a key must be text, got {key!r:.60}")
            if not key.isprintable():
                raise refuse(place, f"a key is text on one line, got {key[:60]!r}")
            if key in content:
                first = self.places[*path, key][1].line
                raise refuse(place, f"key {key[:60]!r} is given twice (first on line {first})")
            content[key] = self.value(item, (*path, key), place)
        return content


def _written_tag(tag):
    """A tag as users write it."""
    return "!!" + tag.removeprefix(_CORE) if tag.startswith(_CORE) else tag[:60]
