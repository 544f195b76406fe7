"""Layers of keys: a file upon its base, `set:` upon the file, `--set` and varied values upon that.

A key of the upper layer removes from the lower one the alternatives to it. Two alternatives in one layer stay, and the
scene refuses them.
"""

from functools import lru_cache
from itertools import permutations, product

from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted

# Rows of alternatives of which none need be given: a material gives them, or nothing asks for them.
OF_SECTION = (
    (("axial_stiffness",), ("elastic_modulus",)),
    (("mass_per_length",), ("density",)),
    (("breaking_force",), ("strength",)),
)
OF_CABLE = ((*OF_SECTION[0], ("stress_strain",)), *OF_SECTION[1:])
# Table -> rows of alternatives: of the groups of a row exactly one may be given.
ALTERNATIVES = {
    "cable": (
        (("ends",), ("chord", "inclination")),
        (("unstretched_length",), ("preload",), ("sag",), ("tension",)),
        *OF_CABLE,
    ),
    "cables": (
        (("unstretched_length",), ("preload",), ("sag",), ("tension_to",), ("tension",)),
        *OF_CABLE,
    ),
    "material": OF_SECTION,
    "cable.damping": ((("ratio",), ("loss_factor",), ("time",)),),
    "wind": ((("turbulence_intensity",), ("turbulence_rms",)),),
    "model": ((("accuracy",), ("elements", "order", "mass")),),
    "load": ((("at",), ("fraction",)),),
    "ice": ((("thickness", "density"), ("weight",)),),
    "steady_wind": ((("speed", "air_density"), ("pressure",)),),
}
# Tables of which there may be many -> where each is; "*" is any name or index.
PLACES = {
    "load": ("cable.loads.*", "cables.*.loads.*", "cases.*.loads.*", "cases.*.loads.*.*"),
    "ice": ("cases.*.ice",),
    "steady_wind": ("cases.*.wind",),
    "cables": ("cable", "cables.*"),
    "material": ("materials.*",),
}

# Tables whose keys are names ("*": any name) -> what a name stands for, and keys of which a dotted key must set one to
# add a new name, else the name is a misprint; None: any key adds a name; (): none does.
NAMED = {
    ("cables",): ("cable", ("from", "to")),
    ("cases",): ("case", None),
    ("limits",): ("limit", ("that",)),
    ("bodies",): ("body", ("at",)),
    ("points",): ("point", ("at",)),
    ("actuators",): ("actuator", ("axis",)),
    ("winches",): ("winch", ("end",)),
    ("bodies", "*", "attachments"): ("attachment", ()),
    ("bodies", "*", "markers"): ("marker", ()),
}


def _replaced_patterns():
    """Pattern of a path ("*": any name) -> tuple of the patterns that a value there removes from a lower layer."""
    replaced = {}
    for pattern, excluded in _exclusions():
        replaced.setdefault(pattern, []).append(excluded)
    of_material = ("fill_factor", "expansion", *(group[0] for groups in OF_CABLE for group in groups))
    damping = ("ratio", "loss_factor", "time")
    for cable in (("cable",), ("cables", "*")):
        replaced[*cable, "material"] = [(*cable, key) for key in of_material]
        # Both may be given in one layer; one alone is another size, of which the other follows.
        replaced[*cable, "area"], replaced[*cable, "diameter"] = [(*cable, "diameter")], [(*cable, "area")]
        # A parameter implies its damping model, and a model its parameter: each replaces the other of a lower layer.
        model, parameters = (*cable, "damping", "model"), [(*cable, "damping", name) for name in damping]
        replaced[model] = parameters
        for parameter in parameters:
            replaced[parameter] = [model, *(other for other in parameters if other != parameter)]
    return {pattern: tuple(dict.fromkeys(others)) for pattern, others in replaced.items()}


def _exclusions():
    """Yield pairs of patterns: a key of ALTERNATIVES, and one that it excludes; each pair in both orders."""
    for table, rows in ALTERNATIVES.items():
        for pattern, groups in product(PLACES.get(table, (table,)), rows):
            parent = pattern.split(".")
            for group, other_group in permutations(groups, 2):
                for key, excluded in product(group, other_group):
                    yield (*parent, key), (*parent, excluded)


REPLACES = _replaced_patterns()


def matches(pattern, path):
    """True if a path is one of a pattern, in which "*" stands for any name or index."""
    return len(pattern) == len(path) and all(name in ("*", part) for name, part in zip(pattern, path, strict=True))


@lru_cache(maxsize=4096)
def replaced_by(key):
    """Tuple of the paths that a dotted key removes from a lower layer."""
    path = tuple(key.split("."))
    for pattern, replaced in REPLACES.items():
        if matches(pattern, path):
            return tuple(_filled(other, path) for other in replaced)
    return ()


def _filled(pattern, path):
    """A pattern with the names of a path of equal length in the places of "*": tuple."""
    return tuple(name if part == "*" else part for part, name in zip(pattern, path, strict=True))


@lru_cache(maxsize=4096)
def split_key(key):
    """Parts of a dotted key, for example of `cable.loads.0.at`, as a tuple.

    Raises
    ------
    ValueError
        A part is empty, or there are too many.
    """
    parts = tuple(key.split("."))
    if len(parts) > SCENE.nesting:
        raise ValueError(f"a key of {len(parts)} names (at most {SCENE.nesting})")
    if not all(part and part == part.strip() for part in parts):
        raise ValueError("a key is written as names joined by dots, for example cable.area")
    return parts


def prune(value, path=()):
    """Copy of a plain value, at a path of a file, without the keys whose value is null.

    But for keys in a cable of `cables`: there null removes what the table `cable` gives, see `scene.suspension`.
    """
    if len(path) > 1 and path[0] == "cables":
        return value
    if isinstance(value, dict):
        return {key: prune(item, (*path, key)) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [prune(item, (*path, "")) for item in value]
    return value


def walk(value, path=(), lists=False):
    """Yield path and value of all that nested mappings hold, and lists if asked for, each after what holds it."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if lists and isinstance(value, list) else ()
    for key, item in items:
        yield (*path, key), item
        yield from walk(item, (*path, key), lists)


def nulls(value, path=()):
    """List of the paths (tuples of str and int) of the keys in a plain value that are null."""
    return [inner for inner, item in walk(value, path, lists=True) if item is None and isinstance(inner[-1], str)]


def assign(container, path, value, parent=(), keep_null=False):
    """Copy of nested dicts and lists in which the value at one path is set; missing dicts on the path are made.

    Only the containers on the path are copied; all others are shared with the original. An item of a list is named by
    its index, "0", "1", ...; the value None removes the last key from its dict, unless `keep_null`. `parent` is the
    path of `container` itself, for messages. ValueError if the path leads through something that is neither a dict nor
    a list, or to an item that a list lacks.
    """
    key, remaining = path[0], path[1:]
    if isinstance(container, list):
        key = _index(container, key, ".".join(parent))
        item = container[key]
    elif isinstance(container, dict):
        item = {} if container.get(key) is None else container[key]
    else:
        raise ValueError(f"{'.'.join(parent)} is {container!r:.60}, which has no key {key:.60}")
    copy = container.copy()
    if remaining:
        copy[key] = assign(item, remaining, value, (*parent, path[0]), keep_null)
    elif value is None and isinstance(copy, dict) and not keep_null:
        copy.pop(key, None)
    else:
        copy[key] = value
    return copy


def _index(items, key, name):
    """Index of an item of a list, whose keys are 0, 1, ..."""
    if not (key.isascii() and key.isdigit() and len(key) < 9):
        raise ValueError(f"{name} is a list: its items are {name}.0, {name}.1, ...")
    if int(key) >= len(items):
        raise ValueError(f"{name} has {counted(len(items), 'item')}, counted from 0: there is no item {int(key)}")
    return int(key)


def unknown_name(lower, upper, path):
    """Find a new name that is probably a misprint: `--set cables.nroth.sag=2 m`, where no cable has the name nroth.

    `NAMED` lists, for each kind of thing, keys that a new one needs, such as `from` or `to` for a cable. A new name
    whose table has one of these keys is accepted. `lower` and `upper` are the plain values of the scene before and
    after the key at the path was set.

    Returns kind of thing, new name and existing names: ("cable", "nroth", ["north", "south"]); None if nothing is
    amiss.
    """
    for table, (kind, keys) in NAMED.items():
        depth = len(table)
        if len(path) > depth + 1 and matches(table, path[:depth]):
            name, names, entry = path[depth], list(mapping_at(lower, path[:depth])), value_at(upper, path[: depth + 1])
            lacks_keys = keys is not None and isinstance(entry, dict) and entry.keys().isdisjoint(keys)
            if name not in names and lacks_keys:
                return kind, name, names
    return None


def absent_name(value, path):
    """Find the name with which a path ends and which plain values do not have; returns as `unknown_name`."""
    for table, (kind, _) in NAMED.items():
        if matches(table, path[:-1]):
            names = list(mapping_at(value, path[:-1]))
            if path[-1] not in names:
                return kind, path[-1], names
    return None


def remove_alternatives(value, key):
    """Copy of a plain mapping without the keys that a dotted key replaces; the mapping itself where there is none."""
    for path in replaced_by(key):
        value = assign(value, path, None) if is_set(value, path) else value
    return value


def merge(lower, upper):
    """A file upon its base, both plain: mappings are merged key by key, anything else replaces."""
    for path, value in walk(upper):
        lower = remove_alternatives(lower, ".".join(path)) if value is not None else lower
    return _merge_keys(lower, upper)


def _merge_keys(lower, upper):
    """`merge` without regard to keys that are alternatives."""
    if not (isinstance(lower, dict) and isinstance(upper, dict)):
        return upper
    return lower | {key: _merge_keys(lower[key], value) if key in lower else value for key, value in upper.items()}


def leaves(mapping):
    """Iterator of path and value of all that is no mapping, or an empty one, in a nested mapping."""
    return ((path, value) for path, value in walk(mapping) if not (isinstance(value, dict) and value))


def is_set(value, path):
    """True if there is a value, other than null, at a path."""
    return value_at(value, path) is not None


def value_at(value, path):
    """The value at a path of mappings, lists, tuples and tables that were read; None when nothing is there."""
    for depth, key in enumerate(path):
        if hasattr(value, "value_at"):
            return value.value_at(path[depth:])
        value = item_of(value, key)
    return value


def mapping_at(value, path):
    """The mapping at a path of mappings and lists; an empty one where anything else is there, or nothing."""
    mapping = value_at(value, path)
    return mapping if isinstance(mapping, dict) else {}


def item_of(container, key):
    """The item of a mapping, list or tuple, by its key or index; None when there is none."""
    if isinstance(container, list | tuple) and str(key).isdecimal():
        index = int(key)
        return container[index] if index < len(container) else None
    return container.get(key) if isinstance(container, dict) else None
