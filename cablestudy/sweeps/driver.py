"""Computes the chunks of a sweep, through an executor of `concurrent.futures`: here, in processes, on a dask cluster.

A cluster is the optional extra `cablestudy[cluster]`.

Each function takes `chunks.Chunks`, which hands out the cases of the study, and yields the `chunks.Done` with the rows
of each chunk, in any order.
"""

import json
import logging
import multiprocessing
import os
import re
import signal
import threading
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager

from cablestudy.errors import NoSolutionError, SceneError, one_line
from cablestudy.interrupts import signals_blocked
from cablestudy.sweeps.chunks import Done, compute
from cablestudy.sweeps.tolerances import SWEEPS
from cablestudy.threads import keep_one_thread

ADDRESS = re.compile(r"(?:tcp://)?(?:[^\s:/\[\]]+|\[[0-9a-f:.%]+\]):\d{1,5}")
SAME_VERSIONS = "the scheduler and its workers need the same cablestudy, Python and dask as this machine"


class WorkerDeathError(Exception):
    """A worker ended while it computed a chunk, which may be tried again."""


def compute_here(chunks, jobs=None):
    """Compute `Chunks` of a sweep on this machine, in this process or in several: yields `Done`.

    The first chunks are computed in this process, which shows how long the work will take. `jobs` is the number of
    processes, at most `SWEEPS.processes_per_core`; by default one for each core, if the work is long enough.

    NoSolutionError if so many worker processes as `SWEEPS.worker_deaths` died with no result between them.
    """
    seconds = 0.0
    for done in submit_all(chunks, SerialExecutor()):
        yield done
        seconds += done.seconds
        if jobs is None and seconds > SWEEPS.trial_time:
            jobs = cores() if chunks.left * chunks.seconds_per_case > SWEEPS.parallel_time else 1
        if (jobs or 1) > 1:
            break
    if chunks.left:
        jobs = min(jobs, SWEEPS.processes_per_core * cores())
        yield from retry(chunks, lambda: process_pool(min(jobs, chunks.left)), lambda: jobs)


def retry(chunks, open_executor, workers):
    """Compute all chunks of a sweep by workers that may die, for example for lack of memory: yields `Done`.

    The chunk of a worker that died is computed again, in a new executor, of which `open_executor` returns a context
    manager; `workers` is as in `submit_all`. NoSolutionError if so many workers as `SWEEPS.worker_deaths` died with no
    result between them.
    """
    deaths = 0
    while chunks.left:
        try:
            with open_executor() as executor:
                for done in submit_all(chunks, executor, workers):
                    deaths = 0
                    yield done
        except (BrokenProcessPool, WorkerDeathError):
            deaths += 1
            if deaths == SWEEPS.worker_deaths:
                reason = "workers end by themselves, time and again: too little memory for so many?"
                raise NoSolutionError(reason) from None


def submit_all(chunks, executor, workers=lambda: 1):
    """Submit all `Chunks` of a sweep to an executor of `concurrent.futures`, and yield their `Done` as they are done.

    A few chunks for each worker (`SWEEPS.chunks_per_worker`) are submitted at a time, or one chunk for a single worker;
    `workers` returns the present number of workers. If the caller stops early, chunks that are not done are put back,
    for another executor.
    """
    chunk_of_future = {}
    try:
        while True:
            most = SWEEPS.chunks_per_worker * workers() if workers() > 1 else 1
            while len(chunk_of_future) < most and (chunk := chunks.next(workers())):
                chunk_of_future[_submit(chunk, executor, chunks)] = chunk
            if not chunk_of_future:
                return
            # not for ever: chunks may be lost with a scheduler, which asking for its workers brings to light
            for future in wait(chunk_of_future, SWEEPS.result_wait, FIRST_COMPLETED).done:
                done = future.result()
                del chunk_of_future[future]
                chunks.measure(done)
                yield done
    finally:
        for chunk in chunk_of_future.values():
            chunks.requeue(chunk)


def _submit(chunk, executor, chunks):
    """Submit a chunk: its Future. Where the pool of processes is broken the chunk is put back, and the error raised."""
    try:
        return executor.submit(compute, chunk)
    except BrokenProcessPool:
        chunks.requeue(chunk)
        raise


class SerialExecutor(Executor):
    """Computes in this process, immediately."""

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


class _ProcessPool(ProcessPoolExecutor):
    def submit(self, *arguments):
        with signals_blocked():  # Ctrl-C is for the parent alone, which ends the processes started here
            return super().submit(*arguments)


@contextmanager
def process_pool(jobs):
    """An executor with `jobs` processes; at the end none is left, whatever it is doing."""
    context = _context()
    before = set(multiprocessing.active_children())
    pool = _ProcessPool(jobs, mp_context=context, initializer=_begin_worker)
    try:
        yield pool
    finally:
        with signals_blocked():
            for child in set(multiprocessing.active_children()) - before:
                child.kill()
            pool.shutdown(cancel_futures=True)


def cores():
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _context():
    """Context of `multiprocessing`: processes start from a server that has imported what they need, where possible."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver, resource_tracker

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    resource_tracker.ensure_running()  # before signals are blocked: it unblocks them
    with signals_blocked():
        forkserver.ensure_running()
    return context


def _begin_worker():
    """In a worker: take one thread, ignore SIGINT, and end when the parent process ends, however that happens."""
    keep_one_thread()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):  # by SIGTERM the executor ends the others where one has died, and waits
        signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
    threading.Thread(target=_exit_with_parent, daemon=True).start()


def _exit_with_parent():
    """Wait for the end of the parent process, and end this one."""
    multiprocessing.parent_process().join()
    os._exit(1)


# ------------------------------------------------------------------------------------------------- on a dask cluster


def compute_on_cluster(chunks, address, notify=None):
    """Compute `Chunks` of a sweep on the workers of a dask scheduler: yields `Done`.

    Chunks of a worker that is lost are computed by another one. The address is `tcp://host:port`, or the name of a
    scheduler file that ends in `.json`; `notify`, if given, is called with each note for the user.

    SceneError if dask is not installed, nobody answers at the address, or a worker runs another version.
    NoSolutionError if the scheduler is gone, or a chunk ends every worker that takes it.
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
    """Executor on the workers of a dask cluster for a `with` block, at whose end nothing is left on the cluster.

    WorkerDeathError if a worker dies, SceneError if scheduler or workers have other versions, and cannot read the work.
    """
    from distributed import KilledWorker

    executor = client.get_executor(pure=False)  # not by content: a chunk that is tried again is a new task
    try:
        yield executor
    except KilledWorker:
        raise WorkerDeathError from None
    except TypeError as error:  # of a worker that dies as its result is told: dask unpacks the result as an error's
        if Done.__name__ not in str(error):
            raise
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
    """Client of the dask scheduler at an address, see `compute_on_cluster`, for a `with` block.

    Meanwhile all logging is silenced, since errors are reported in one line.
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
            client = Client(scheduler, timeout=SWEEPS.scheduler_wait, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            reason = one_line(error) or type(error).__name__
            raise SceneError(f"--scheduler {address}: no scheduler answers there ({reason:.120})") from None
        cleanup.callback(client.close, timeout=SWEEPS.scheduler_wait)
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
