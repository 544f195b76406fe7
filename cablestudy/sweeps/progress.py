"""Progress of a sweep on standard error: a bar on a terminal, else a line every 30 s, the first early if it is long."""

import sys
import time

DELAY = 1.0  # before the first bar [s]
BAR_INTERVAL, LINE_INTERVAL = 0.2, 30.0  # between two bars, and between two lines [s]
# A sweep with more than LONG left has its first line once so many seconds and rows give a fair estimate.
LONG, EARLY, EARLY_ROWS = 60.0, 3.0, 20  # [s], [s], [-]
WIDTH = 24


class Progress:
    """Writes the progress of a sweep of so many rows, some `known` from earlier runs, to a stream."""

    def __init__(self, total, known=0, quiet=False, stream=None):
        self._total, self._known, self._quiet = total, known, quiet
        self._stream = stream or sys.stderr
        self._bar = self._stream.isatty()
        self._begin = time.monotonic()
        self._next = self._begin + (DELAY if self._bar else LINE_INTERVAL)
        self._shown = self._announced = False

    def __call__(self, done):
        """Report the number of rows done."""
        now = time.monotonic()
        if self._quiet or done == self._total:
            return
        if now < self._next and not self._is_early(done, now - self._begin):
            return
        self._announced = True
        self._next = now + (BAR_INTERVAL if self._bar else LINE_INTERVAL)
        text = self.line(done, now - self._begin)
        if self._bar:
            full = WIDTH * done // self._total
            text = f"\r[{'#' * full}{'.' * (WIDTH - full)}] {text}\x1b[K"
            self._shown = True
        self._stream.write(text if self._bar else text + "\n")
        self._stream.flush()

    def _is_early(self, done, seconds):
        """Whether to write the first line now, since the sweep will take long."""
        rows = done - self._known
        enough = seconds >= EARLY and rows > EARLY_ROWS and not (self._announced or self._bar)
        return enough and (self._total - done) * seconds > LONG * rows

    def line(self, done, seconds):
        """Rows done, rate and remaining time."""
        rate = (done - self._known) / seconds if seconds > 0 else 0.0
        left = f", {rounded_duration((self._total - done) / rate)} left" if rate > 0 else ""
        return f"{done} of {self._total} rows, {rate:.3g} rows/s{left}"

    def close(self):
        """Erase the bar."""
        if self._shown:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def rounded_duration(seconds):
    """A duration, rounded: `40 s`, `12 min`, `3.5 h`."""
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
