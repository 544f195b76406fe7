"""What the rows of a run depend on: program, scene, what varies, columns."""

import json
from functools import cache
from hashlib import sha256

from cablestudy import __version__


@cache
def program():
    """Versions that the digits of a row come from: of the program, numpy and scipy."""
    import numpy
    import scipy

    return {"cablestudy": __version__, "numpy": numpy.__version__, "scipy": scipy.__version__}


def identity(study, columns):
    """What the rows of a study depend on, as plain values.

    Parameters
    ----------
    study : Study
    columns : sequence of Column

    Returns
    -------
    dict
        `program`, `scene`, `vary`, `columns`.
    """
    headers = [column.header for column in columns]
    plain = {"program": program(), **study.resolved(), "columns": headers}
    return json.loads(json.dumps(plain))  # what a file gives back: lists, not tuples


def digest(identity):
    """Fingerprint of an identity: 32 hexadecimal digits."""
    return sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:32]


def differences(there, here):
    """What keeps rows of one identity out of a run of another: versions and keys of the scene.

    What varies and which columns are wanted may differ: each row is known by its own scene.

    Parameters
    ----------
    there, here : dict

    Returns
    -------
    list of str
        One for each key that differs.
    """
    found = []
    for part in ("program", "scene"):
        old, new = _flat(there.get(part, {})), _flat(here[part])
        for key in sorted(old.keys() | new.keys()):
            if old.get(key) != new.get(key):
                name = key if part == "scene" else f"version of {key}"
                found.append(f"{name}: {_said(old, key)} there, {_said(new, key)} now")
    return found


def _flat(value, path=""):
    """Dotted key -> plain value."""
    if isinstance(value, dict):
        parts = value.items()
    elif isinstance(value, list):
        parts = enumerate(value)
    else:
        return {path: value}
    flat = {}
    for key, item in parts:
        flat.update(_flat(item, f"{path}.{key}" if path else str(key)))
    return flat


def _said(flat, key):
    return str(flat[key]) if key in flat else "not given"
