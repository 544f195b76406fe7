"""Progress of a command, reported on standard error where it takes long.

A thread writes: a line after DELAY, then after twice that time, and so on; on a terminal one line that changes. Whoever
computes says by `doing` what it is at. With the environment variable CABLESTUDY_PROGRESS set to `off` nothing is
written, so that what is compared with stored text does not depend on how fast a machine is.
"""

import os
import sys
import threading

DELAY, BAR_INTERVAL = 2.0, 1.0  # before the first line, and between two on a terminal [s]
OFF = "CABLESTUDY_PROGRESS"

_activity, _display = "", None  # what is computed at present; the display that is open


def doing(text):
    """Say what is computed from now on, for example `4 places tried`; an empty text: nothing in particular."""
    global _activity
    _activity = text


class ActivityDisplay:
    """Context manager: shows on a stream that a command is at work, until its end or `end_display`.

    Parameters
    ----------
    command : str
        Its name.
    quiet : bool
        Whether nothing is shown.
    stream : text stream, optional
        Standard error by default.
    wait : callable, optional
        Waits for a number of seconds [s], true where the end has come before; for tests.
    """

    def __init__(self, command, quiet=False, stream=None, wait=None):
        self._command, self._stream, self._ended = command, stream or sys.stderr, threading.Event()
        self._wait = wait or self._ended.wait
        self._quiet = quiet or self._stream is None or os.environ.get(OFF) == "off"
        self._thread = None

    def __enter__(self):
        global _display
        doing("")
        if not self._quiet:
            _display = self
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
        is_terminal, seconds, pause = self._stream.isatty(), DELAY, DELAY  # time of the next line, and until it
        while not self._wait(pause):
            line = f"{self._command}: {seconds:.0f} s{', ' if _activity else ''}{_activity}"
            self._stream.write(f"\r{line}\x1b[K" if is_terminal else f"{line}\n")
            self._stream.flush()
            pause = BAR_INTERVAL if is_terminal else seconds
            seconds += pause
        if is_terminal and seconds > DELAY:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def end_display():
    """End the display that is open, before anything else is written."""
    if _display is not None:
        _display.end()
