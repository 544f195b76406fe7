"""Progress of a command, told on standard error where it takes long.

A thread writes: a line after DELAY, then after twice that time, and so on; on a terminal one line that changes. Whoever
computes says by `doing` what it is at. With the environment variable CABLESTUDY_PROGRESS set to `off` nothing is
written, so that what is compared with stored text does not depend on how fast a machine is.
"""

import os
import sys
import threading

DELAY, BAR_INTERVAL = 2.0, 1.0  # before the first line, and between two on a terminal [s]
OFF = "CABLESTUDY_PROGRESS"

_now, _shown = "", None


def doing(text):
    """Say what is computed from now on, for example `4 places tried`; an empty text: nothing in particular."""
    global _now
    _now = text


class Shown:
    """Context manager: shows that a command is at work, until its end or `end_shown`.

    Parameters
    ----------
    command : str
        Its name.
    quiet : bool
        Whether nothing is shown.
    stream : text stream, optional
        Standard error by default.
    wait : callable, optional
        Waits so many seconds [s], true where the end has come before; for tests.
    """

    def __init__(self, command, quiet=False, stream=None, wait=None):
        self._command, self._stream, self._ended = command, stream or sys.stderr, threading.Event()
        self._wait = wait or self._ended.wait
        self._quiet = quiet or self._stream is None or os.environ.get(OFF) == "off"
        self._thread = None

    def __enter__(self):
        global _shown
        doing("")
        if not self._quiet:
            _shown = self
            self._thread = threading.Thread(target=self.write, daemon=True)
            self._thread.start()
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        """Write nothing from now on."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def write(self):
        """Write lines until the end."""
        terminal, seconds, left = self._stream.isatty(), DELAY, DELAY
        while not self._wait(left):
            line = f"{self._command}: {seconds:.0f} s{', ' if _now else ''}{_now}"
            self._stream.write(f"\r{line}\x1b[K" if terminal else f"{line}\n")
            self._stream.flush()
            left = BAR_INTERVAL if terminal else seconds
            seconds += left
        if terminal and seconds > DELAY:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def end_shown():
    """End what is shown, before anything else is written."""
    if _shown is not None:
        _shown.end()
