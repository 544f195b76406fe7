"""A YAML file as read: plain values, the place of each in its file, `base:` files underneath and `--set` on top."""

import os
import sys
from functools import partial

from cablestudy.errors import Mistake, SceneError
from cablestudy.scene.layers import merge, prune, put_layer, split_key
from cablestudy.scene.strict_yaml import Place, compose, mistake, refuse

MAX_BYTES = 10_000_000
MAX_BASES = 32
STDIN = "<stdin>"


class Document:
    """What the user wrote, in all its layers.

    Attributes
    ----------
    name : str
        The file as the user named it, or `<stdin>`.
    value : dict
        Plain mappings, lists, text and numbers, nothing converted. A key whose value is null is left out; inside of a
        file whose base is still unread only at the top level, because deeper down it may say what to remove.
    """

    __slots__ = ("_overrides", "_root", "name", "value")

    def __init__(self, name, root, resolved=True):
        value = root.plain()
        self.name = name
        self.value = prune(value) if resolved else {key: item for key, item in value.items() if item is not None}
        self._root = root
        self._overrides = ()

    def with_sets(self, items):
        """Document with one more layer on top. Costs little: what the layer does not touch is shared.

        Parameters
        ----------
        items : list of (str, object, str or Place or callable)
            Dotted key, value (None removes the key; a mapping replaces the key whole) and the place to name when it is
            wrong; a callable is asked for the place only then.

        Returns
        -------
        Document

        Raises
        ------
        SceneError
            A key that cannot be set.
        """
        new = object.__new__(Document)
        new.name, new._root = self.name, self._root
        try:
            new.value = put_layer(self.value, [(key, _pruned(value)) for key, value, _ in items])
        except ValueError:
            raise self._wrong_keys(items) from None
        new._overrides = (*self._overrides, *((split_key(key), where) for key, _, where in items))
        return new

    def _wrong_keys(self, items):
        """The error of the keys in a layer that cannot be set, each tried on its own."""
        mistakes = []
        for key, value, where in items:
            try:
                put_layer(self.value, [(key, value)])
            except ValueError as error:
                mistakes.append(mistake(_as_place(where), key, str(error)))
        return SceneError(*mistakes) if mistakes else SceneError("these keys cannot be set together")

    def place(self, path):
        """Place of the value at a path, or of its nearest ancestor that is written somewhere.

        Parameters
        ----------
        path : tuple of str and int

        Returns
        -------
        Place
        """
        return self._place(tuple(path), of_key=False)

    def key_place(self, path):
        """Place of the key (not of its value) at a path; see `place`."""
        return self._place(tuple(path), of_key=True)

    def where(self, path):
        """`file:line:column` of the value at a path, or of its nearest ancestor."""
        return str(self.place(path))

    def where_key(self, path):
        """`file:line:column` of the key at a path, or of its nearest ancestor."""
        return str(self.key_place(path))

    def _place(self, path, of_key):
        names = tuple(map(str, path))
        for key, where in reversed(self._overrides):
            if names[: len(key)] == key:
                return _as_place(where)
        node, place, known = self._root, self._root.place, not path
        for step, part in enumerate(path):
            inside = _child(node, part)
            if inside is None:
                break
            known = step == len(path) - 1
            place = node.keys[part] if of_key and known and isinstance(part, str) else inside.place
            node = inside
        if not known:
            # A mapping that exists only because a layer set something in it.
            for key, where in reversed(self._overrides):
                if key[: len(names)] == names:
                    return _as_place(where)
        return place


def _child(node, part):
    """The node under a key or an index, or None."""
    content = node.content
    if isinstance(content, dict):
        return content.get(part)
    if isinstance(content, list) and isinstance(part, int) and part < len(content):
        return content[part]
    return None


def _pruned(value):
    return prune(value) if isinstance(value, (dict, list)) else value


def _as_place(where):
    where = where() if callable(where) else where
    return where if isinstance(where, Place) else Place(where)


def read_file(path):
    """Read one YAML file, its `base:` left unread.

    Parameters
    ----------
    path : str or path-like
        `-` is standard input.

    Returns
    -------
    Document

    Raises
    ------
    SceneError
        The file cannot be read, or is not a YAML mapping.
    """
    name = os.fspath(path)
    if name == "-":
        return Document(STDIN, _parse(_read_stdin(), STDIN), resolved=False)
    return Document(name, _parse(_read_bytes(name, Place(name)), name), resolved=False)


def read_document(path):
    """Read one YAML file and merge it upon its `base:` files.

    Parameters
    ----------
    path : str or path-like
        `-` is standard input; its base is relative to the working directory.

    Returns
    -------
    Document

    Raises
    ------
    SceneError
        A file of the chain cannot be read, or the chain is a circle.
    """
    return resolve_base(read_file(path))


def resolve_base(document):
    """Merge a document upon its own `base:` files, to any depth."""
    return Document(document.name, _resolved(document._root, document.name, (document.name,)))


def read_base(document):
    """The document that `base:` names, merged upon its own bases; the given document stays out of it.

    Parameters
    ----------
    document : Document
        With the key `base`.

    Returns
    -------
    Document
    """
    name, root = _read_lower(document._root.content["base"], document.name, (document.name,))
    return Document(name, root)


def _resolved(root, name, chain):
    """A tree upon its base, without the key `base`."""
    base = root.content.get("base")
    if base is None:
        return root
    if base.content is not None:
        _, lower = _read_lower(base, name, chain)
        root = merge(lower, root)
    root.content = {key: node for key, node in root.content.items() if key != "base"}
    return root


def _read_lower(base, name, chain):
    """Name and resolved tree of the file that a `base:` names."""
    if not isinstance(base.content, str) or not base.content or not base.content.isprintable():
        raise refuse(base.place, "expected the name of a file", "base")
    lower = os.path.join(os.path.dirname(name) if name != STDIN else "", base.content)
    chain = (*chain, lower)
    if os.path.realpath(lower) in [os.path.realpath(above) for above in chain[:-1] if above != STDIN]:
        raise refuse(base.place, "base files in a circle: " + " -> ".join(chain), "base")
    if len(chain) > MAX_BASES:
        raise refuse(base.place, f"more than {MAX_BASES} base files upon each other", "base")
    root = _parse(_read_bytes(lower, base.place, "base"), lower)
    return lower, _resolved(root, lower, chain)


def _read_stdin():
    """Standard input as bytes, one more than allowed at most."""
    try:
        return sys.stdin.buffer.read(MAX_BYTES + 1)
    except (AttributeError, OSError, ValueError) as error:  # closed, or a directory
        raise refuse(Place(STDIN), f"cannot be read ({getattr(error, 'strerror', None) or 'closed'})") from None


def _read_bytes(name, place, key=""):
    """A file as bytes, one more than allowed at most."""
    shown = f"{name}: " if key else ""
    try:
        with open(name, "rb") as file:
            return file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise refuse(place, f"{shown}no such file", key) from None
    except IsADirectoryError:
        raise refuse(place, f"{shown}a directory, not a file", key) from None
    except (OSError, ValueError) as error:
        raise refuse(place, f"{shown}cannot be read ({getattr(error, 'strerror', None) or error})", key) from None


def _parse(data, name):
    """Bytes -> the tree of a mapping."""
    if len(data) > MAX_BYTES:
        raise refuse(Place(name), f"larger than {MAX_BYTES // 1_000_000} MB")
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - (data.rfind(b"\n", 0, error.start) + 1) + 1
        message = f"byte 0x{data[error.start]:02x} is not UTF-8 text (is this a YAML file?)"
        raise refuse(Place(name, line, column), message) from None
    root = compose(text, name)
    if root is None or root.content is None:
        raise refuse(Place(name), "empty file")
    if not isinstance(root.content, dict):
        raise refuse(root.place, f"expected a mapping (key: value), got {_kind(root.content)}")
    return root


def _kind(content):
    return "a list" if isinstance(content, list) else f"{content!r:.60}"


def parse_set(text):
    """Read the argument of `--set`.

    Parameters
    ----------
    text : str
        `key=value`; the value follows the rules of the files, so that `3`, `3 mm`, `[1, 2]` and `{a: 1}` all work.

    Returns
    -------
    key : str
        Dotted.
    value : object
        Plain; None (written `null`) removes the key.

    Raises
    ------
    SceneError
        Anything else.
    """
    key, sign, written = text.partition("=")
    key = key.strip()
    place = Place(f"--set {key}")
    if not sign:
        raise refuse(Place(f"--set {text}"), "expected key=value, for example cable.area=3 mm^2")
    try:
        split_key(key)
        node = compose(written, place.name)
    except ValueError as error:
        raise refuse(place, str(error)) from None
    except SceneError as error:
        raise refuse(place, error.mistakes[0].message) from None
    if node is None:
        raise refuse(place, "no value: expected key=value")
    return key, node.plain()


def apply_sets(document, texts):
    """Put all `--set` options upon a document, as one layer.

    Parameters
    ----------
    document : Document
    texts : sequence of str
        `key=value` each.

    Returns
    -------
    Document

    Raises
    ------
    SceneError
        Every option that cannot be read, a key that is given twice or that cannot be set.
    """
    values, mistakes = {}, []
    for text in texts:
        try:
            key, value = parse_set(text)
        except SceneError as error:
            mistakes.extend(error.mistakes)
            continue
        if key in values:
            mistakes.append(Mistake(f"--set {key}", "", "given twice"))
        values[key] = value
    if mistakes:
        raise SceneError(*mistakes)
    return document.with_sets([(key, value, f"--set {key}") for key, value in values.items()]) if values else document


def lazily(document, path):
    """A place that is looked up only when it is needed."""
    return partial(document.place, path)
