"""Computes the chunks of a sweep on a dask cluster: the optional extra `cablestudy[cluster]`."""

import json
import logging
import re
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.sweeps.driver import WorkerDeathError, retry

TIMEOUT = 15  # seconds until a scheduler must have answered
ADDRESS = re.compile(r"(?:tcp://)?(?:[^\s:/\[\]]+|\[[0-9a-f:.%]+\]):\d{1,5}")
SAME_VERSIONS = "the scheduler and its workers need the same cablestudy, Python and dask as this machine"


def compute_on_cluster(chunks, address, notify=None):
    """Compute the chunks of a sweep on the workers of a dask scheduler: yields `Done`, in any order.

    Chunks of a worker that is lost are computed by another one.

    Parameters
    ----------
    chunks : Chunks
    address : str
        `tcp://host:port`, or the name of a scheduler file that ends in `.json`.
    notify : callable, optional
        Called with each note for the user.

    Raises
    ------
    SceneError
        dask is not installed, nobody answers at the address, or a worker runs another version.
    NoSolutionError
        The scheduler is gone, or a chunk ends every worker that takes it.
    """
    with _client(address) as client:
        if notify and not client.nthreads():
            notify(f"{address}: no workers yet, waiting for them")

        def workers():
            return max(1, sum(client.nthreads().values()))

        try:
            yield from retry(chunks, lambda: _executor(client), workers)
        except (CancelledError, OSError, TimeoutError) as error:
            raise NoSolutionError(f"{address}: the scheduler is gone ({type(error).__name__})") from None


@contextmanager
def _executor(client):
    """The cluster as an executor; at the end nothing that was submitted is left there."""
    from distributed import KilledWorker

    executor = client.get_executor(pure=False)  # not by content: a chunk that is tried again is a new task
    try:
        yield executor
    except KilledWorker:
        raise WorkerDeathError from None
    except (ImportError, AttributeError) as error:
        raise SceneError(f"--scheduler: a worker cannot read the work ({error}): {SAME_VERSIONS}") from None
    except RuntimeError as error:
        if "deserializ" not in str(error):
            raise
        raise SceneError(f"--scheduler: the scheduler cannot read the work: {SAME_VERSIONS}") from None
    finally:
        executor.shutdown(wait=False)


@contextmanager
def _client(address):
    """Connect to the dask scheduler at an address, for a `with` block: yields the dask `Client`.

    Meanwhile all logging is silenced, since errors are reported in one line. SceneError if there is no connection.
    """
    try:
        from distributed import Client
    except ImportError:
        raise SceneError("--scheduler: dask is not installed (pip install 'cablestudy[cluster]')") from None
    scheduler = _address_in(address) if address.endswith(".json") else address
    if not ADDRESS.fullmatch(scheduler):  # dask would report it in a traceback
        raise SceneError(f"--scheduler {address}: expected tcp://host:port, or a scheduler file FILE.json")
    disabled = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    with ExitStack() as cleanup:
        cleanup.callback(logging.disable, disabled)
        try:
            client = Client(scheduler, timeout=TIMEOUT, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise SceneError(f"--scheduler {address}: no scheduler answers there ({reason:.120})") from None
        cleanup.callback(client.close, timeout=TIMEOUT)
        yield client


def _address_in(path):
    """The address that a scheduler file names."""
    try:
        with open(path, encoding="utf-8") as file:
            return str(json.load(file)["address"])
    except OSError as error:
        raise SceneError(f"--scheduler {path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        raise SceneError(f"--scheduler {path}: is no scheduler file of dask") from None
