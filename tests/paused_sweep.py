"""A sweep that stops itself in the middle, as a terminal stops one by Ctrl-Z, for tests that then act on it.

    python paused_sweep.py ROWS WHERE sweep STUDY ...

WHERE is `after` the first transaction with which so many rows are on disk, or `within` that transaction.
"""

import os
import signal
import sys

from cablestudy.cli import main
from cablestudy.sweeps.store import RowStore


def pause(rows, within):
    """Let the process stop itself at so many rows that this run adds."""
    added, insert = [0], RowStore.insert

    def counted(records):
        for record in records:
            if within and added[0] == rows:
                os.kill(os.getpid(), signal.SIGSTOP)
            added[0] += 1
            yield record

    def inserted(store, records):
        before = added[0]
        insert(store, counted(records))
        if not within and before < rows <= added[0]:
            os.kill(os.getpid(), signal.SIGSTOP)

    RowStore.insert = inserted


if __name__ == "__main__":
    rows, where, *words = sys.argv[1:]
    sys.argv[1:] = words
    pause(int(rows), where == "within")
    main(prog_name="cablestudy")
