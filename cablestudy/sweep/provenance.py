"""Where a table comes from: NAME.run.yaml beside it, never inside."""

import platform
from datetime import UTC, datetime

from cablestudy import __version__
from cablestudy.sweep.fingerprint import digest


def record(identity, command, started, seconds, rows):
    """The provenance of a table.

    Parameters
    ----------
    identity : dict
        From `fingerprint.identity`.
    command : str
        As it can be typed again.
    started : float
        Seconds since the epoch.
    seconds : float
        How long this run took; of one that was resumed, the last part.
    rows : dict
        What to count -> how many.

    Returns
    -------
    str
        YAML.
    """
    import yaml

    content = {
        "command": command,
        "fingerprint": digest(identity),
        "started": datetime.fromtimestamp(started, UTC).isoformat(timespec="seconds"),
        "duration_s": round(seconds, 3),
        "rows": rows,
        "versions": {"cablestudy": __version__, **identity["versions"], "python": platform.python_version()},
        "platform": platform.platform(),
        "study": {name: identity[name] for name in ("scene", "vary", "columns")},
    }
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120)
