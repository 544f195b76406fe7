"""One thread for linear algebra: the matrices are small, and the last digits may depend on the number of threads.

A number of threads that the environment names stays: whoever sets one of VARIABLES has chosen.
"""

import os
from contextlib import contextmanager
from functools import cache
from threading import Lock

VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
_lock, _inside, _limit = Lock(), 0, None  # how many blocks of `one_thread` run, in all threads; what the first one set


@contextmanager
def one_thread():
    """Context manager, or decorator: inside, linear algebra takes one thread; after the last block as many as before.

    The number holds for the whole process: blocks of several threads may overlap.
    """
    global _inside, _limit
    with _lock:
        if not (_inside or _number_is_set()):
            _limit = _libraries().limit(limits=1, user_api="blas")
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside and _limit is not None:
                _limit.restore_original_limits()
                _limit = None


def keep_one_thread():
    """Let linear algebra take one thread for the rest of this process."""
    if not _number_is_set():
        _libraries().limit(limits=1, user_api="blas")


def _number_is_set():
    """True if the environment names a number of threads."""
    return any(name in os.environ for name in VARIABLES)


@cache
def _libraries():
    """Controller of the libraries for linear algebra, of numpy and of scipy."""
    import scipy.linalg  # noqa: F401 a library that is not loaded is not found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
