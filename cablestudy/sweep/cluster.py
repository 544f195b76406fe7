"""Chunks computed on a dask cluster: the optional extra `cablestudy[cluster]`."""

import json
import logging
import re
from concurrent.futures import CancelledError
from contextlib import contextmanager

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.sweep.chunk import compute

AHEAD = 2  # chunks in flight for each thread of the workers
ANSWER = 15  # seconds until a scheduler must have answered
TRIES = 3  # of a chunk that the scheduler gives up, each after several lost workers
ADDRESS = re.compile(r"(?:tcp://)?(?:[^\s:/\[\]]+|\[[0-9a-f:.%]+\]):\d{1,5}")
ELSEWHERE = "the scheduler and its workers need the same cablestudy, Python and dask as this machine"


def scheduled(supply, address, say=None):
    """Compute chunks where a scheduler says; those of a worker that is lost are computed by another.

    Parameters
    ----------
    supply : Supply
    address : str
        `tcp://host:port`, or the name of a scheduler file that ends in `.json`.
    say : callable, optional
        Is told what the user may want to know.

    Yields
    ------
    Done
        In any order.

    Raises
    ------
    SceneError
        dask is not installed, nobody answers at the address, or a worker runs another version.
    NoSolutionError
        The scheduler is gone, or a chunk ends every worker that takes it.
    """
    with _client(address) as client:
        from distributed import as_completed

        if say and not client.nthreads():
            say(f"{address}: no workers yet, waiting for them")
        flying, results = {}, as_completed(loop=client.loop)
        try:
            while True:
                threads = max(1, sum(client.nthreads().values()))
                while len(flying) < AHEAD * threads and (chunk := supply.next(threads)):
                    _send(client, chunk, 1, flying, results)
                if not flying:
                    return
                future = next(results)
                chunk, tries = flying.pop(future)
                done = _result(future, tries)
                if done is None:
                    _send(client, chunk, tries + 1, flying, results)
                    continue
                supply.learn(done)
                yield done
        except (CancelledError, OSError, TimeoutError) as error:
            raise NoSolutionError(f"{address}: the scheduler is gone ({type(error).__name__})") from None


def _send(client, chunk, tries, flying, results):
    """Submit a chunk; not by its content, so that a chunk which is tried again is a new one."""
    future = client.submit(compute, chunk, pure=False)
    flying[future] = chunk, tries
    results.add(future)


def _result(future, tries):
    """What a worker gave back; None when the chunk is to be tried again."""
    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker:
        if tries < TRIES:
            return None
        raise NoSolutionError("a chunk ended every worker that took it: too little memory there?") from None
    except (ImportError, AttributeError) as error:
        raise SceneError(f"--scheduler: a worker cannot read the work ({error}): {ELSEWHERE}") from None
    except RuntimeError as error:
        if "deserializ" not in str(error):
            raise
        raise SceneError(f"--scheduler: the scheduler cannot read the work: {ELSEWHERE}") from None


def _address_in(path):
    """The address that a scheduler file names."""
    try:
        with open(path, encoding="utf-8") as file:
            return str(json.load(file)["address"])
    except OSError as error:
        raise SceneError(f"--scheduler {path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        raise SceneError(f"--scheduler {path}: is no scheduler file of dask") from None


@contextmanager
def _client(address):
    """A connection to the scheduler, which leaves nothing behind there."""
    try:
        from distributed import Client
    except ImportError:
        raise SceneError("--scheduler: dask is not installed (pip install 'cablestudy[cluster]')") from None
    where = _address_in(address) if address.endswith(".json") else address
    if not ADDRESS.fullmatch(where):  # dask itself says so in a traceback
        raise SceneError(f"--scheduler {address}: expected tcp://host:port, or a scheduler file FILE.json")
    log = logging.getLogger("distributed")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)  # what matters is said in one line here
    try:
        try:
            client = Client(where, timeout=ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise SceneError(f"--scheduler {address}: no scheduler answers there ({reason:.120})") from None
        try:
            yield client
        finally:
            client.close(timeout=ANSWER)
    finally:
        log.setLevel(before)
