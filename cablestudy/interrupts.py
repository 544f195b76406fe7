"""Ctrl-C and SIGTERM end a run cleanly, as KeyboardInterrupt."""

import signal
import threading
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """Context manager: the first SIGINT or SIGTERM raises KeyboardInterrupt, later ones are ignored.

    In a thread other than the main one, signals are left as they are.
    """

    def __init__(self):
        self._deferring, self._received = False, False

    def __enter__(self):
        self._before = {}
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._receive) for number in SIGNALS}
        return self

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _receive(self, *_):
        if self._received:
            return
        self._received = True
        if not self._deferring:
            raise KeyboardInterrupt

    @contextmanager
    def deferred(self):
        """A signal that arrives inside raises KeyboardInterrupt at the end of the block."""
        self._deferring = True
        try:
            yield
        finally:
            self._deferring = False
        if self._received:
            raise KeyboardInterrupt


@contextmanager
def signals_blocked():
    """Block both signals, also in the processes and threads that are started inside, which inherit the mask."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
