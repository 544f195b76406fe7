"""Progress of a sweep on standard error: a bar on a terminal, else a line every 30 s, the first early if it is long.

With the environment variable CABLESTUDY_PROGRESS set to `off` nothing is written, so that what is compared with stored
text does not depend on how fast a machine is.
"""

import os
import sys
import time
from collections import deque

from cablestudy.activity import OFF
from cablestudy.sweeps.tolerances import SWEEPS


class Progress:
    """Writes the progress of a sweep of `total` rows, `known` of them from earlier runs, to a stream.

    The rate is that of the later half of the rows computed, without the time in which workers only began: what comes
    once, at the beginning, says nothing about the time left.
    """

    def __init__(self, total, known=0, quiet=False, stream=None):
        self._total, self._known = total, known
        self._stream = stream or sys.stderr  # None where standard error is closed
        self._quiet = quiet or self._stream is None or os.environ.get(OFF) == "off"
        self._bar = not self._quiet and self._stream.isatty()
        self._begin = self._last = time.monotonic()
        self._waited = 0.0
        self._reports = deque([(0.0, known)])  # seconds of work and rows done, from the middle of the rows computed
        self._next = self._begin + (SWEEPS.first_bar if self._bar else SWEEPS.line_interval)
        self._shown = self._announced = False

    def __call__(self, done, seconds):
        """Report the number of rows done, and the seconds of computing that the last of them took."""
        now = time.monotonic()
        self._count(done, seconds, now)
        if self._quiet or done == self._total:
            return
        if now < self._next and not self._is_early(done, now - self._begin):
            return
        self._announced = True
        self._next = now + (SWEEPS.bar_interval if self._bar else SWEEPS.line_interval)
        text = self.line(done)
        if self._bar:
            filled = SWEEPS.bar_width * done // self._total
            text = f"\r[{'#' * filled}{'.' * (SWEEPS.bar_width - filled)}] {text}\x1b[K"
            self._shown = True
        self._stream.write(text if self._bar else text + "\n")
        self._stream.flush()

    def _is_early(self, done, seconds):
        """True if the first line is to be written now, since the sweep will take long."""
        is_fair = seconds >= SWEEPS.early_line and done - self._known > SWEEPS.early_rows
        if self._announced or self._bar or not is_fair:
            return False
        return self.rate is not None and self._total - done > SWEEPS.long_sweep * self.rate

    def _count(self, done, seconds, now):
        """Add a report, with the parameters of a call and the time now [s]; drop those of the earlier half of rows."""
        waited = now - self._last - seconds
        self._waited += waited if waited > SWEEPS.workers_begin else 0.0
        self._last = now
        self._reports.append((now - self._begin - self._waited, done))
        while 2 * self._reports[1][1] <= self._known + done and len(self._reports) > 2:
            self._reports.popleft()

    @property
    def rate(self):
        """Rows per second; None as long as too little is computed to tell."""
        (begin, done_before), (end, done) = self._reports[0], self._reports[-1]
        return (done - done_before) / (end - begin) if end - begin >= SWEEPS.rate_time else None

    def line(self, done):
        """Rows done, and as soon as they are known rate and remaining time."""
        text = f"{done} of {self._total} rows"
        if self.rate:
            text += f", {self.rate:.3g} rows/s, {rounded_duration((self._total - done) / self.rate)} left"
        return text

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
