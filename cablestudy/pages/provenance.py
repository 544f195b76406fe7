"""Where the numbers of a page come from."""

import platform
from datetime import UTC, datetime

from cablestudy.pages.markup import element, text
from cablestudy.pages.tables import TableGrid
from cablestudy.sweeps.fingerprint import digest, versions
from cablestudy.version import __version__


class Provenance:
    """Begins when a page does; see `NAME.run.yaml` of a sweep.

    Parameters
    ----------
    command : str
        As typed.
    """

    def __init__(self, command):
        self.command, self._started = command, datetime.now(UTC)

    def html(self, identity, files):
        """A table of it.

        Parameters
        ----------
        identity : dict
            What the numbers depend on.
        files : sequence of str
            That were read.
        """
        used = {"cablestudy": __version__, **versions(), "python": platform.python_version()}
        lines = {
            "command": self.command,
            "files": ", ".join(files),
            "fingerprint": digest(identity),
            "started": self._started.isoformat(timespec="seconds"),
            "duration": f"{(datetime.now(UTC) - self._started).total_seconds():.1f} s",
            "versions": ", ".join(f"{name} {version}" for name, version in used.items()),
            "platform": platform.platform(),
        }
        rows = [[text(name), element("code", text(value))] for name, value in lines.items()]
        return TableGrid(["what", "value"], rows).html("Where the numbers come from")
