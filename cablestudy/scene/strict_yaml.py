"""YAML text -> plain values and the place of each, by the rules of YAML 1.2; and plain values -> YAML text.

PyYAML scans, parses and composes. Its loaders are not used: they follow YAML 1.1 (`no` is false, 1:30 is 90) and take
the last of two equal keys.
"""

import re
from typing import NamedTuple

import yaml

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.tolerances import SCENE

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_CORE = "tag:yaml.org,2002:"
_PLAIN = ""  # tag of a scalar without quotes, whose type follows from its text
_DEFAULT_TAGS = {yaml.SequenceNode: _CORE + "seq", yaml.MappingNode: _CORE + "map"}
_NO_TYPE = re.compile(r"(&\S+\s+)?!(\s|$)")  # `! 5` is text; PyYAML drops the sign
_UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
# Tag of the core schema -> (text of such a scalar, its value).
_TYPES = {
    "null": (re.compile("|~|null|Null|NULL"), lambda text: None),
    "bool": (re.compile("true|True|TRUE|false|False|FALSE"), lambda text: text.lower() == "true"),
    "int": (
        re.compile("[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+"),
        lambda text: int(text, 0) if text[1:2] in ("o", "x") else int(text),
    ),
    "float": (
        re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)"),
        lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    ),
}

# (pattern of PyYAML's or libyaml's message, message shown, whether its place is the beginning of the construct)
_MESSAGES = (
    (r"tab character", "a tab: YAML indents with spaces", False),
    (r"plain scalar.*unexpected ':'", "a colon behind a key is followed by a blank", False),
    (r"unexpected end of stream", "quoted text is not closed", True),
    (r"while scanning.*quoted scalar.*document", "quoted text is not closed", True),
    (r"flow sequence", "list: expected ',' or ']' (is a bracket not closed?)", True),
    (r"flow mapping", "mapping: expected ',' or '}' (is a brace not closed?)", True),
    (r"mapping values are not", "': ' is not allowed here (indentation? quotes around text with ': '?)", False),
    (r"could not find expected ':'|required simple key", "expected 'key: value'", True),
    (r"expected key|block end|'-' indicator", "does not fit the lines above (check the indentation)", False),
    (r"document start", "does not fit the lines above (check the indentation)", False),
    (r"cannot start any token", "text that begins with this character must be quoted", False),
    (r"node content", "expected a value", False),
    (r"unknown escape", r"unknown \\ escape (use 'single quotes' for text with a backslash)", False),
    (r"undefined alias \*(\w*)", r"alias *\1 has no anchor &\1 above it", False),
    (r"duplicate anchor", "an anchor of this name stands above already", False),
    (r"another document", "a second document ('---'): one file holds one document", False),
    (r"nested more|nesting depth", f"nested more than {SCENE.nesting} deep", False),
)


class Place(NamedTuple):
    """A position in a file, counted from 1; line 0 stands for a whole file or a command-line option."""

    name: str  # the file as the user named it, or the option
    line: int = 0
    column: int = 0

    def __str__(self):
        return f"{self.name}:{self.line}:{self.column}" if self.line else self.name


def mistake(place, key, message):
    """A Mistake; its key is left out when the place is an option that names it already (`--set cable.area`)."""
    options = [f"{option} {key}" for option in ("--set", "--vary", "--by")]
    is_named = key and (str(place) in options or str(place).startswith(f"--{key} "))  # --case NAME
    return Mistake(str(place), "" if is_named else key, message)


def refuse(place, message, key=""):
    """The SceneError of a single mistake; parameters as in `mistake`."""
    return SceneError(mistake(place, key, message))


def resolve(text, tags=_TYPES):
    """Value of a plain (unquoted) scalar by the YAML 1.2 core schema: None, bool, int, float or str.

    Raises
    ------
    ValueError
        A number of more than 400 digits.
    """
    for pattern, value in map(_TYPES.get, tags):
        if pattern.fullmatch(text):
            if len(text) > SCENE.number_characters:
                raise ValueError(f"a number of {len(text)} characters (at most {SCENE.number_characters})")
            return value(text)
    return text


def compose(text, name):
    """Parse the text of one YAML document, of the file `name`, into plain values, with the line and column of each.

    Returns the value, and path (tuple of str and int) -> (Place of the value, Place of its key), a dict, which is empty
    when the text holds no document. SceneError if the text is not well-formed, or not plain YAML.
    """
    text = text.removeprefix("\ufeff")
    if match := _UNPRINTABLE.search(text):
        line = text.count("\n", 0, match.start()) + 1
        column = match.start() - text.rfind("\n", 0, match.start())
        message = f"character U+{ord(match[0]):04X} is not text (is this a YAML file?)"
        raise refuse(Place(name, line, column), message)
    try:
        node = _Composer(text).get_single_node()
    except yaml.YAMLError as error:
        raise _syntax_error(error, text, name) from None
    except (OverflowError, ValueError):  # PyYAML without libyaml, on an escape beyond the last character of Unicode
        raise refuse(Place(name), "an escape in quoted text that stands for no character") from None
    reader = _Reader(text, name)
    return (None if node is None else reader.value(node, path=(), key_place=None)), reader.places


def _syntax_error(error, text, name):
    """The SceneError for an error of PyYAML, whose message has several lines: one line with a hint."""
    problem = f"{getattr(error, 'context', '') or ''}: {getattr(error, 'problem', '') or error}"
    mark, beginning = getattr(error, "problem_mark", None), getattr(error, "context_mark", None)
    rest_of_line = "" if mark is None else (text.splitlines()[mark.line : mark.line + 1] or [""])[0][mark.column :]
    if "cannot start any token" in problem and rest_of_line.startswith("\t"):
        problem = "tab character"
    if "undefined alias" in problem:
        problem = f"undefined alias {rest_of_line}"
    message = "not YAML: " + " ".join(problem.strip(": ").split())
    for pattern, template, at_beginning in _MESSAGES:
        if match := re.search(pattern, problem):
            message = match.expand(template)
            mark = beginning if at_beginning and beginning else mark
            break
    return refuse(_place(name, mark) if mark else Place(name), message)


def _place(name, mark):
    """The Place of a mark of PyYAML, which counts from 0."""
    return Place(name, mark.line + 1, mark.column + 1)


class _Composer(_LOADER):
    """PyYAML's composer, of libyaml where PyYAML has it, with a limit of depth and types by YAML 1.2."""

    depth = 0

    def descend_resolver(self, parent, index):
        """Refuse nodes deeper than `SCENE.nesting`, since composing recurses."""
        self.depth += 1
        if self.depth > SCENE.nesting + 1:
            raise yaml.composer.ComposerError(None, None, "nested more", parent.start_mark)

    def ascend_resolver(self):
        """Count back."""
        self.depth -= 1

    def resolve(self, kind, value, implicit):
        """Tag of a node without one: text when quoted."""
        return _DEFAULT_TAGS.get(kind) or (_PLAIN if implicit[0] else _CORE + "str")


class _Reader:
    """Reads nodes of PyYAML as plain values; `places` collects where they are. An alias has the place of its anchor."""

    def __init__(self, text, name):
        self.text, self.name, self.places = text, name, {}
        # ids of the nodes that were read, and of those that are being read; number of repetitions by aliases
        self._seen, self._open, self._aliased = set(), set(), 0

    def value(self, node, path, key_place):
        """The plain value of a node at a path; `key_place` is the Place of its key, None of an item of a list."""
        place = _place(self.name, node.start_mark)
        self._check_repetition(node, path, place)
        self.places[path] = (place, key_place or place)
        if isinstance(node, yaml.ScalarNode):
            return self._scalar(node, place)
        if node.tag != _DEFAULT_TAGS[type(node)]:
            raise refuse(place, f"tag {_written_tag(node.tag)} is not allowed")
        self._open.add(id(node))
        if isinstance(node, yaml.MappingNode):
            value = self._mapping(node, path)
        else:
            value = [self.value(item, (*path, index), None) for index, item in enumerate(node.value)]
        self._open.discard(id(node))
        return value

    def _check_repetition(self, node, path, place):
        """Refuse a node that is nested too deeply, inside of itself, or repeated too often by aliases."""
        if len(path) > SCENE.nesting:
            raise refuse(place, f"nested more than {SCENE.nesting} deep")
        if id(node) in self._open:
            raise refuse(place, "an alias inside of what it repeats")
        self._aliased += id(node) in self._seen
        if self._aliased > SCENE.aliased_values:
            raise refuse(place, f"aliases repeat more than {SCENE.aliased_values} values")
        self._seen.add(id(node))

    def _scalar(self, node, place):
        """Value of text, quoted or not, by its tag or by the rules of `resolve`."""
        tag = node.tag.removeprefix(_CORE)
        if node.style == '"' and (match := _UNPRINTABLE.search(node.value)):
            raise refuse(place, f"character U+{ord(match[0]):04X} is not text")
        start = node.start_mark.index
        if tag == "str" or (tag == _PLAIN and _NO_TYPE.match(self.text, start)):
            return node.value
        if tag not in (_PLAIN, *_TYPES):
            raise refuse(place, f"tag {_written_tag(node.tag)} is not allowed")
        if tag in _TYPES and not _TYPES[tag][0].fullmatch(node.value):
            raise refuse(place, f"{node.value[:40]!r} is not of the type !!{tag}")
        try:
            return resolve(node.value, _TYPES if tag == _PLAIN else [tag])
        except ValueError as error:
            raise refuse(place, str(error)) from None

    def _mapping(self, node, path):
        """A mapping, whose keys are text and occur once."""
        content = {}
        for key_node, item in node.value:
            place = _place(self.name, key_node.start_mark)
            if not isinstance(key_node, yaml.ScalarNode):
                raise refuse(place, "a key must be text, got a list or a mapping")
            key = self._scalar(key_node, place)
            if not isinstance(key, str):
                raise refuse(place, f'a key must be text, got {key!r:.60} (write "{key_node.value:.60}", in quotes)')
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


class _Dumper(yaml.SafeDumper):
    """Text that YAML 1.2 would take for a number, a truth value or null is quoted; nothing is an alias."""

    def ignore_aliases(self, data):
        return True


def _represent_text(dumper, text):
    """The node of a text, in quotes where it would else be read as something else."""
    is_text = isinstance(resolve(text), str)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if is_text else '"')


_Dumper.add_representer(str, _represent_text)


def write_yaml(value):
    """YAML text of a dict of plain values, in their order, from which `compose` reads the same values."""
    options = {"sort_keys": False, "allow_unicode": True, "width": SCENE.line_width, "default_flow_style": None}
    return yaml.dump(value, Dumper=_Dumper, **options)
