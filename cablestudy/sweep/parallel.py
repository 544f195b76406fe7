"""Chunks computed here: in this process, or in several."""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from cablestudy.errors import NoSolutionError
from cablestudy.sweep.chunk import compute
from cablestudy.sweep.interrupt import unbroken

PROBE = 0.3  # seconds in this process before others are thought of
WORTH = 3.0  # seconds of work that are worth the start of other processes
AHEAD = 2  # chunks in flight for each worker
MOST = 4  # processes for each core: more of them only take memory
DEATHS = 3  # of worker processes, one after the other without a result, until nothing more is tried


def cores():
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def here(supply, seconds=float("inf")):
    """Compute chunks in this process.

    Parameters
    ----------
    supply : Supply
    seconds : float
        After which to stop; at least one chunk is computed.

    Yields
    ------
    Done
    """
    while seconds > 0 and (chunk := supply.next()):
        done = compute(chunk)
        supply.learn(done)
        seconds -= done.seconds
        yield done


def local(supply, jobs=None):
    """Compute chunks in so many processes.

    Parameters
    ----------
    supply : Supply
    jobs : int, optional
        At most MOST for each core are started. Without it: all cores when the estimated work is worth their start.

    Yields
    ------
    Done
        In any order.
    """
    if jobs == 1:
        yield from here(supply)
        return
    yield from here(supply, PROBE if jobs is None else 1e-9)
    if not supply.left:
        return
    if jobs is None:
        work = supply.left * supply.seconds_per_case
        jobs = cores() if work > WORTH else 1
    jobs = min(jobs, MOST * cores())
    yield from processes(supply, jobs) if jobs > 1 else here(supply)


def processes(supply, jobs):
    """Compute chunks in processes; those of a process that dies are computed by another.

    Parameters
    ----------
    supply : Supply
    jobs : int

    Yields
    ------
    Done
        In any order.

    Raises
    ------
    NoSolutionError
        Processes end by themselves time and again.
    """
    context = _context()
    deaths = 0
    while supply.left and deaths < DEATHS:
        before = set(multiprocessing.active_children())
        pool = ProcessPoolExecutor(min(jobs, supply.left), mp_context=context, initializer=_begin_worker)
        flying = {}
        try:
            while True:
                with unbroken():  # this may start a process
                    while len(flying) < AHEAD * jobs and (chunk := supply.next(jobs)):
                        flying[pool.submit(compute, chunk)] = chunk
                if not flying:
                    break
                for future in wait(flying, return_when=FIRST_COMPLETED).done:
                    done = future.result()
                    del flying[future]
                    supply.learn(done)
                    deaths = 0
                    yield done
        except BrokenProcessPool:
            deaths += 1
            for chunk in flying.values():
                supply.put_back(chunk)
        finally:
            with unbroken():  # what still runs is not wanted any more: at the end nothing runs
                for child in set(multiprocessing.active_children()) - before:
                    child.kill()
                pool.shutdown(cancel_futures=True)
    if supply.left:
        raise NoSolutionError("processes end by themselves: too little memory for so many jobs?")


def _context():
    """How processes are started: from a server that has imported what they need, where there can be one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing import forkserver, resource_tracker

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    resource_tracker.ensure_running()  # it takes a block away
    with unbroken():  # Ctrl-C is for this process alone, which ends the others
        forkserver.ensure_running()
    return context


def _begin_worker():
    """A worker takes no heed of Ctrl-C, and ends with the process that started it, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent():
    multiprocessing.parent_process().join()
    os._exit(1)
