"""A YAML file as read: plain values, the place of each in its file, `base:` files underneath and `--set` on top."""

import json
import os
import select
import stat
import sys
from collections.abc import Mapping
from contextlib import nullcontext, suppress
from io import BytesIO

from cablestudy.errors import Mistake, Mistakes, SceneError
from cablestudy.scene.fields import suggestion
from cablestudy.scene.layers import (
    absent_name,
    assign,
    is_set,
    merge,
    nulls,
    prune,
    remove_alternatives,
    split_key,
    unknown_name,
)
from cablestudy.scene.mistakes import add_blank
from cablestudy.scene.strict_yaml import Place, compose, mistake, refuse
from cablestudy.scene.tolerances import SCENE

STDIN = "<stdin>"
STREAMS = ("/dev", "/dev/fd", "/proc/self/fd")  # folders of what a shell passes as <(...)
MAPPING = "<mapping>"  # a file that Python gives as its contents


class Document:
    """The values of a file and of the layers upon it, and where each is written.

    Attributes
    ----------
    name : str
        The file as the user named it, `<stdin>`, or `<mapping>`.
    value : dict
        Plain mappings, lists, text and numbers as written.
    empty : list of tuple
        Paths of the keys that are null though no layer below has a value to remove; `mistakes.empty_keys` judges them.
    base : Document or None
        Document of its `base`, where Python gives both as mappings; else None.
    """

    base = None

    def __init__(self, name, value, places, overrides=(), empty=()):
        self.name, self.value, self._places, self._overrides = name, value, places, overrides
        self.empty = list(empty)

    @property
    def stated_keys(self):
        """The keys at the top level and their values, without those that are null."""
        return {key: value for key, value in self.value.items() if value is not None}

    @property
    def files(self):
        """Names of the files that its values are from: list of str."""
        return list(dict.fromkeys([self.name, *(place.name for pair in self._places.values() for place in pair)]))

    def with_sets(self, items, varied=False):
        """Copy of the document in which some keys have other values, as by `--set` or in one case of a study.

        Before that, keys are removed that exclude a new one: a new `sag` of a cable removes its `preload`.

        Parameters
        ----------
        items : list of (str, object, str or Place or callable)
            Dotted key, new value, and the place that messages name. The value None removes the key; a mapping replaces
            the old one as a whole. A callable returns the place on demand: that of the key if its argument `of_key` is
            True, else that of the value.
        varied : bool
            True if None is allowed for a name (of a cable, body, ...) that this scene lacks, since other cases of the
            study have it.

        Raises
        ------
        SceneError
            All keys that cannot be set, and names that only a misprint would add or remove.
        """
        contents, overrides, mistakes = self.value, [], []
        for key, new_value, _ in items:  # before any is set, so that of two that exclude each other both are kept
            contents = remove_alternatives(contents, key) if new_value is not None else contents
        for key, new_value, where in items:
            try:
                if new_value is None and ":" in key:
                    raise ValueError(f"no value ({add_blank(key)})")
                path = split_key(key)
                of_cable = path[0] == "cables" and len(path) > 2  # there null removes what the table `cable` gives
                contents = assign(contents, path, prune(new_value, path), keep_null=of_cable)
                overrides.append((path, where))
            except ValueError as error:
                mistakes.append(mistake(_as_place(where), key, str(error)))
        mistakes += self._unknown_names(contents, overrides) + ([] if varied else self._absent_names(items))
        if mistakes:
            raise SceneError(*mistakes)
        empty = self._empty_after([(path, value) for (path, _), (_, value, _) in zip(overrides, items, strict=True)])
        return Document(self.name, contents, self._places, [*self._overrides, *overrides], empty)

    def _empty_after(self, changes):
        """Paths of the keys without a value, after changes (path, new value) were made."""
        empty = [path for path in self.empty if not any(path[: len(changed)] == changed for changed, _ in changes)]
        for path, new_value in changes:
            removes_nothing = new_value is None and not is_set(self.value, path)
            empty += [path] if removes_nothing else nulls(new_value, path)
        return empty

    def _absent_names(self, items):
        """Mistakes of items, as in `with_sets`, that remove a name which the document does not have."""
        removed = [(key, where) for key, new_value, where in items if new_value is None]
        found = [(absent_name(self.value, key.split(".")), _as_place(where), key) for key, where in removed]
        return [_unknown_name_mistake(*one) for one in found if one[0]]

    def _unknown_names(self, contents, overrides):
        """Mistakes of overrides (path, place) that lead through a name of a suspension which it does not have.

        `contents` are the values with these overrides.
        """
        suspended = overrides if "cables" in self.value else ()
        found = [(unknown_name(self.value, contents, path), where, path) for path, where in suspended]
        return [_unknown_name_mistake(unknown, _as_place(where, of_key=True), ".".join(path))
                for unknown, where, path in found if unknown]  # fmt: skip

    def is_override(self, path):
        """True if an upper layer has set exactly what is at a path."""
        return any(tuple(map(str, path)) == override for override, _ in self._overrides)

    def place(self, path, of_key=False):
        """Place of the value (or of its key) at a path (a tuple), or of its nearest ancestor that has one."""
        names = tuple(map(str, path))
        for override, where in reversed(self._overrides):
            if names[: len(override)] == override:
                return _as_place(where, of_key and names == override)
        if path in self._places:
            return self._places[path][of_key]
        for override, where in reversed(self._overrides):  # a mapping in which only upper layers have set something
            if override[: len(names)] == names:
                return _as_place(where)
        while path not in self._places:
            path = path[:-1]
        return self._places[path][False]

    def where(self, path, of_key=False):
        """`place` as text: `file:line:column`."""
        return str(self.place(path, of_key))


def _unknown_name_mistake(unknown, place, key):
    """The Mistake of a name that is none: kind of thing, the name, and the names that there are."""
    kind, name, known_names = unknown
    return mistake(place, key, f"unknown {kind} {name} ({suggestion(name, known_names)})")


def _as_place(where, of_key=False):
    """Place of a value, or of its key, that `with_sets` was given as text, as a Place, or as a function."""
    where = where(of_key=of_key) if callable(where) else where
    return where if isinstance(where, Place) else Place(where)


def read_file(path):
    """Read one YAML file as a `Document` of values as written with their places, without the file that `base` names.

    Nulls are kept, since they may remove keys of the base. `path` is the name of the file, or `-` for standard input; a
    mapping is taken in place of the contents of a file, and so may be its `base`. SceneError if the file cannot be
    read, or is not a YAML mapping.
    """
    if isinstance(path, Mapping):
        return _document_of_mapping(path, MAPPING)
    name = os.fspath(path)
    if not name.strip():
        raise SceneError(f"expected the name of a file, got {name!r}")
    if name == "-":
        return _parse(_read_bytes(lambda: nullcontext(sys.stdin.buffer), Place(STDIN)), STDIN)
    return _parse(_read_bytes(lambda: _open_file(name), Place(name)), name)


def _document_of_mapping(mapping, name):
    """The Document of a mapping from Python; it is read as JSON text, so that the rules of files hold for it."""
    base = mapping.get("base")
    contents = {**mapping, "base": MAPPING} if isinstance(base, Mapping) else dict(mapping)
    try:
        text = json.dumps(contents, ensure_ascii=False)
    except (TypeError, ValueError, RecursionError) as error:
        raise refuse(Place(name), f"expected mappings, lists, text and numbers ({error})") from None
    try:
        value, places = compose(text, name)
    except SceneError as error:  # its places are lines of the text above, which the user does not know
        raise SceneError(*(Mistake(name, found.key, found.message) for found in error.mistakes)) from None
    document = Document(name, value, dict.fromkeys(places, (Place(name), Place(name))))
    document.base = _document_of_mapping(base, f"{name} base") if isinstance(base, Mapping) else None
    return document


def read_document(path):
    """Read one YAML file and merge it upon its `base:` files; parameters and errors are those of `read_file`."""
    return resolve_base(read_file(path))


def resolve_base(document, chain=()):
    """Read the files that a document names by `base:` and `materials:`, and merge it upon them: a new `Document`.

    A base has the values that the document does not give; it may have a base itself. A null in the document removes a
    key of the base; `empty` of the result lists null keys that had nothing to remove. `materials:` may be the name of a
    file in place of the table itself. Names of files are relative to the document, or to the working directory if it is
    from standard input. `chain` has the files from the one that the user named down to this one, each the base of the
    one before it; it is empty if this is the first.

    SceneError if a file cannot be read or is no YAML mapping, or base files form a circle, or are more than
    `SCENE.base_files`.
    """
    contents = {key: value for key, value in document.value.items() if key != "base"}
    places = document._places
    if isinstance(contents.get("materials"), str):
        materials = _read_named_file(document, "materials")
        contents["materials"] = materials.value
        places = places | {("materials", *path): place for path, place in materials._places.items() if path}
    if "base" not in document.stated_keys:
        return Document(document.name, prune(contents), places, empty=nulls(contents))
    base = read_base(document, chain)
    empty = base.empty + [path for path in nulls(contents) if not is_set(base.value, path)]
    return Document(document.name, prune(merge(base.value, contents)), base._places | places, empty=empty)


def _named_file(document, key):
    """Path of the file that a key of a document names, relative to the document; SceneError if it is no name."""
    name = document.value[key]
    if not isinstance(name, str) or not name or not name.isprintable():
        raise refuse(document.place((key,)), "expected the name of a file", key)
    return path_named_in(document.name, name)


def path_named_in(source, name):
    """Path of a file that another one names: relative to that one, of a stream to the working directory."""
    folder = os.path.dirname(source)
    return os.path.join("" if folder in STREAMS else folder, name)


def _read_named_file(document, key):
    """The Document of the file that a key of another one names, its own base unread; SceneError as in `read_file`."""
    name, place = _named_file(document, key), document.place((key,))
    return _parse(_read_bytes(lambda: _open_file(name), place, key, f"{name}: "), name)


def read_base(document, chain=()):
    """The document that the key `base` of another one names, merged upon its own bases; as `resolve_base`."""
    if document.base:
        return resolve_base(document.base, chain)
    name, place = _named_file(document, "base"), document.place(("base",))
    chain = (*(chain or (document.name,)), name)
    if os.path.realpath(name) in [os.path.realpath(upper) for upper in chain[:-1] if upper != STDIN]:
        raise refuse(place, "base files in a circle: " + " -> ".join(chain), "base")
    if len(chain) > SCENE.base_files:
        raise refuse(place, f"more than {SCENE.base_files} base files upon each other", "base")
    return resolve_base(_read_named_file(document, "base"), chain)


def _open_file(name):
    """A file opened for its bytes; a FIFO too, if some program writes to it, but no device. OSError says why not."""
    mode = os.stat(name).st_mode
    if stat.S_ISCHR(mode) or stat.S_ISBLK(mode) or stat.S_ISSOCK(mode):
        raise OSError(None, "a device or socket, not a file")
    return _read_fifo(name) if stat.S_ISFIFO(mode) else open(name, "rb")


def _read_fifo(name):
    """Contents of a FIFO as a binary stream, at most `SCENE.file_bytes` + 1; OSError if no program writes to it."""
    descriptor, first_byte = os.open(name, os.O_RDONLY | os.O_NONBLOCK), b""
    if not select.select([descriptor], [], [], SCENE.fifo_wait)[0]:
        with suppress(BlockingIOError):  # a program has it open and has not written yet
            first_byte = os.read(descriptor, 1)
            if not first_byte:
                os.close(descriptor)
                raise OSError(None, f"a FIFO that no program writes to; waited {SCENE.fifo_wait:.0f} s")
    os.set_blocking(descriptor, True)
    with os.fdopen(descriptor, "rb") as file:
        return BytesIO(first_byte + file.read(SCENE.file_bytes + 1))


def _read_bytes(open_file, place, key="", prefix=""):
    """The bytes of the stream that `open_file()` returns, at most `SCENE.file_bytes` + 1, to tell a longer one.

    If it cannot be read, SceneError with this place and key, and a message that begins with the prefix.
    """
    try:
        with open_file() as file:
            return file.read(SCENE.file_bytes + 1)
    except FileNotFoundError:
        reason = "no such file"
    except IsADirectoryError:
        reason = "a directory, not a file"
    except (OSError, ValueError) as error:
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
    except AttributeError:  # there is no standard input
        reason = "cannot be read (closed)"
    raise refuse(place, prefix + reason, key)


def _parse(data, name):
    """Parse the bytes of a YAML file, by its name, as a `Document`, its `base:` unread.

    SceneError if they are too many, not UTF-8 or not one YAML mapping, or `base` is a mapping, not the name of a file.
    """
    if len(data) > SCENE.file_bytes:
        raise refuse(Place(name), f"larger than {SCENE.file_bytes // 1_000_000} MB")
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        message = f"byte 0x{data[error.start]:02x} is not UTF-8 text (is this a YAML file?)"
        raise refuse(Place(name, line, column), message) from None
    value, places = compose(text, name)
    if value is None:
        raise refuse(Place(name), "empty file")
    if not isinstance(value, dict):
        kind = "a list" if isinstance(value, list) else f"{value!r:.60}"
        raise refuse(places[()][0], f"expected a mapping (key: value), got {kind}")
    if isinstance(value.get("base"), dict):
        message = "expected the name of a file, got a mapping (write what it says into this file, or one of its own)"
        raise refuse(places[("base",)][0], message, "base")
    return Document(name, value, places)


def read_option(option, text, usage, read):
    """Read the argument `key=value` of a command-line option such as `--set`: dotted key and value, a tuple.

    `option` is the name of the option, `text` its argument as the user wrote it, `usage` the message for one without
    `=`; `read` makes the value of the text behind the `=`, and raises ValueError or SceneError. SceneError for all that
    is wrong.
    """
    key, sign, written = text.partition("=")
    key = key.strip()
    if not sign:
        raise refuse(Place(f"{option} {text}"), usage)
    try:
        split_key(key)
        return key, read(written)
    except ValueError as error:
        message = str(error)
    except SceneError as error:
        message = error.mistakes[0].message
    raise refuse(Place(f"{option} {key}"), message)


def parse_set(text):
    """Key and value of `--set`, written as in the files: `3 mm`, `{a: 1}`; `null` removes the key."""
    return read_option("--set", text, "expected key=value, for example cable.area=3 mm^2", _read_value)


def _read_value(written):
    """Value of the YAML text of an option; ValueError where it is empty."""
    value, places = compose(written, "")
    if not places:
        raise ValueError("no value: expected key=value")
    return value


def apply_sets(document, texts, case=None):
    """Copy of a document, changed by the arguments of the options `--set` and `--case` of a command.

    SceneError for every option that cannot be read, and keys that are given twice or that cannot be set.
    """
    values = {}
    with Mistakes() as mistakes:
        for text in texts:
            with mistakes.at():
                key, value = parse_set(text)
                if key in values:
                    mistakes.append(Mistake(f"--set {key}", "", "given twice"))
                values[key] = value
        if case is not None and "case" in values:
            mistakes.append(Mistake(f"--case {case}", "", "given twice, also as --set case"))
    items = [(key, value, f"--set {key}") for key, value in values.items()]
    if case is not None:
        items.append(("case", case, f"--case {case}"))
    return document.with_sets(items)
