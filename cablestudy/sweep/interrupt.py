"""Ctrl-C and SIGTERM end a run cleanly: between two statements of its choice."""

import signal
import threading
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """While open, the first of either signal raises KeyboardInterrupt, and later ones are ignored.

    In a thread that is not the main one, signals are left as they are.
    """

    def __init__(self):
        self._sheltered, self._wanted = False, False

    def __enter__(self):
        self._before = {}
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._receive) for number in SIGNALS}
        return self

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, *_):
        if self._wanted:
            return
        self._wanted = True
        if not self._sheltered:
            raise KeyboardInterrupt

    @contextmanager
    def sheltered(self):
        """A signal waits until the block is done."""
        self._sheltered = True
        try:
            yield
        finally:
            self._sheltered = False
        if self._wanted:
            raise KeyboardInterrupt


@contextmanager
def unbroken():
    """A signal waits until the block is done; processes and threads that are started inside never take it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
