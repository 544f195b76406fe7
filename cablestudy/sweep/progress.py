"""How far a run is: a bar on a terminal, a line now and then elsewhere, nothing for what takes no time."""

import sys
import time

PATIENCE = 1.0  # seconds before anything is said
OFTEN, SELDOM = 0.2, 30.0  # seconds between two bars, and between two lines
WIDTH = 24


class Progress:
    """Says on a stream how far a run is.

    Parameters
    ----------
    total : int
        Rows.
    known : int
        Rows that were done before.
    stream : text file, optional
        Default: standard error.
    """

    def __init__(self, total, known=0, stream=None):
        self._total, self._known = total, known
        self._stream = stream or sys.stderr
        self._bar = self._stream.isatty()
        self._begin = time.monotonic()
        self._next = self._begin + (PATIENCE if self._bar else SELDOM)
        self._shown = False

    def __call__(self, done):
        """So many rows are done now."""
        now = time.monotonic()
        if now < self._next or done == self._total:
            return
        self._next = now + (OFTEN if self._bar else SELDOM)
        text = self.line(done, now - self._begin)
        if self._bar:
            full = WIDTH * done // self._total
            text = f"\r[{'#' * full}{'.' * (WIDTH - full)}] {text}\x1b[K"
            self._shown = True
        self._stream.write(text if self._bar else text + "\n")
        self._stream.flush()

    def line(self, done, seconds):
        """How many rows, how fast, how long still."""
        rate = (done - self._known) / seconds if seconds > 0 else 0.0
        left = f", {spoken((self._total - done) / rate)} left" if rate > 0 else ""
        return f"{done} of {self._total} rows, {rate:.3g} rows/s{left}"

    def close(self):
        """Take the bar away."""
        if self._shown:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._shown = False


def spoken(seconds):
    """A time that nobody needs to the second: `40 s`, `12 min`, `3.5 h`."""
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
