"""Fingerprint of what rows of a study depend on: version of the results, scene, what varies, columns."""

import json
import platform
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256

from cablestudy.scene.layers import walk
from cablestudy.version import __version__

# Rows on disk are used again only if this number is the one they were computed with. Raise it by one with every change
# of the code that changes a number of any table by more than its rounding, or the text of a `status`: whatever needs a
# line under "Numbers changed" in CHANGELOG.md. A release that changes no result leaves it as it is.
RESULTS_VERSION = 20
# parts of an identity that may be edited -> in messages
PARTS = {"vary": "what varies", "find": "what is solved for", "columns": "the columns"}


@cache
def versions():
    """Versions that the digits of a row depend on: of this program's results, of numpy and of scipy."""
    import numpy
    import scipy

    return {"results": RESULTS_VERSION, "numpy": numpy.__version__, "scipy": scipy.__version__}


def identity(study, columns):
    """All that the rows of a study depend on, as plain values: dict of `versions`, `scene`, `vary`, `find` (or not),
    `columns`."""
    headers = [column.header for column in columns]
    plain = {"versions": versions(), **study.resolved(), "columns": headers}
    return json.loads(json.dumps(plain))  # as it is read back from a file: lists instead of tuples


def is_identity(value):
    """True if a dict of plain values has the form of an `identity`; KeyError where a part is missing."""
    return [type(value[name]) for name in ("versions", "scene", "vary", "columns")] == [dict, dict, list, list]


def digest(identity):
    """Fingerprint of an identity: 32 hexadecimal digits."""
    return sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:32]


def provenance(command, identity, started, **entries):
    """Record of where the numbers of a table come from, for the YAML file next to it: dict of plain values.

    It has the command as typed, the fingerprint of the `identity`, start and duration [s], the further entries,
    versions and platform. `started` is when the run began, or the last part of a run that was resumed.
    """
    return {
        "command": command,
        "fingerprint": digest(identity),
        "started": started.isoformat(timespec="seconds"),
        "duration_s": (datetime.now(UTC) - started).total_seconds(),
        **entries,
        "versions": {"cablestudy": __version__, **identity["versions"], "python": platform.python_version()},
        "platform": platform.platform(),
    }


def differences(stored, current, parts=("versions", "scene")):
    """The versions and keys of the scene because of which stored rows cannot be used in a run: a line for each.

    What varies and which columns are asked for may differ: each row is identified by its own scene.
    """
    lines = []
    for part in parts:
        prefix = "version of " if part == "versions" else ""
        old, new = _by_dotted_key(stored[part]), _by_dotted_key(current[part])
        for key in sorted(old.keys() | new.keys()):
            if old.get(key) != new.get(key):
                there, now = (str(values[key]) if key in values else "not given" for values in (old, new))
                lines.append(f"{prefix}{key}: {there} there, {now} now")
    return lines


def edited_parts(stored, current):
    """A line for each part of an identity, without those of `differences`, in which stored rows differ from a run."""
    changed = [what for part, what in PARTS.items() if stored.get(part) != current.get(part)]
    return [f"of the study before it was edited: {what} changed" for what in changed]


def _by_dotted_key(mapping):
    """Dotted key -> value of all that nested mappings and lists hold, except for these themselves: dict."""
    items = walk(mapping, lists=True)
    return {".".join(map(str, path)): item for path, item in items if not isinstance(item, dict | list)}
