"""Journals on disk: begun, gone on with, taken over by a study that grew, joined; one process at a time."""

import json
import os
import tempfile
from contextlib import suppress
from itertools import islice

from cablestudy.errors import SceneError
from cablestudy.study.table import give_rights, leftovers
from cablestudy.sweep.fingerprint import differences, digest
from cablestudy.sweep.journal import FORMAT, Journal, whole


def open_journal(path, identity, count, take, resume=False, restart=False):
    """The journal of a run: a new one, or the one that is there.

    Parameters
    ----------
    path : str
    identity : dict
    count : int
        Cases of the study.
    take : callable
        (old journal, new journal) -> None: moves what a grown study can use; called when the fingerprints differ.
    resume, restart : bool
        Go on with what is there, or begin anew even if it is unfinished.

    Returns
    -------
    Journal

    Raises
    ------
    SceneError
        An unfinished run is there and nothing says what to do with it; it is of another scene or version; another
        process is at work on it; the file is something else.
    """
    try:
        file = os.fdopen(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+b", buffering=1 << 18)
    except OSError as error:
        raise SceneError(f"{path}: cannot be written ({error.strerror})") from None
    try:
        _lock(file, path)
        there = _identity(file, path, any_format=restart)
        if there is not None and not restart:
            known = Journal(file, there, max(count, _rows(file)), path)
            known.load()
            if resume:
                return _resumed(known, identity, count, take)
            if known.done and not known.finished:
                raise SceneError(
                    f"{path}: an unfinished run is there, {known.done} rows done: go on with --resume,"
                    " or begin anew with --restart"
                )
        return _begun(file, path, identity, count)
    except BaseException:
        file.close()
        raise


def read_journal(path, count):
    """A journal that is only read.

    Parameters
    ----------
    path : str
    count : int
        Cases of the study.

    Returns
    -------
    Journal

    Raises
    ------
    SceneError
        It cannot be read, or is something else.
    """
    try:
        file = open(path, "rb", buffering=1 << 18)  # noqa: SIM115
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        there = _identity(file, path)
        if there is None:
            raise SceneError(f"{path}: is empty")
        journal = Journal(file, there, max(count, _rows(file)), path)
        journal.load(cut=False)
        return journal
    except BaseException:
        file.close()
        raise


def merged(path, identity, count, journals):
    """One journal with the rows of several, in the order of the cases of each; replaces what is there.

    Parameters
    ----------
    path : str
    identity : dict
    count : int
    journals : iterable of Journal
        Of the same identity.

    Returns
    -------
    Journal
    """

    def take(_, new):
        for journal in journals:
            for lines in batched(line for _, line in journal.lines()):
                new.extend(b"".join(lines))

    return _replaced(path, identity, count, None, take)


def batched(items, size=10_000):
    """Yield lists of so many items."""
    items = iter(items)
    while batch := list(islice(items, size)):
        yield batch


def _begun(file, path, identity, count):
    """A journal without rows in an open file."""
    file.seek(0)
    file.truncate(0)
    journal = Journal(file, identity, count, path)
    journal.begin()
    return journal


def _resumed(known, identity, count, take):
    """What is there as the journal of this run."""
    if digest(known.identity) == digest(identity):
        return known
    found = differences(known.identity, identity)
    if found:
        hint = "these rows cannot be used: --restart begins anew, --out DIR begins elsewhere"
        raise SceneError(*(f"{known.path}: {line}" for line in found), f"{known.path}: {hint}")
    journal = _replaced(known.path, identity, count, known, take)
    known.close()
    return journal


def _replaced(path, identity, count, known, take):
    """A journal that takes the place of what lies at a path, once it has taken what it can use."""
    handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", prefix=leftovers(path))
    file = os.fdopen(handle, "r+b", buffering=1 << 18)
    try:
        journal = _begun(file, path, identity, count)
        take(known, journal)
        _lock(file, path)
        give_rights(temporary)
        os.replace(temporary, path)
    except BaseException:
        file.close()
        with suppress(FileNotFoundError):
            os.unlink(temporary)
        raise
    return journal


def _identity(file, path, any_format=False):
    """What the rows of a file depend on; None when it is empty, or torn before its first row."""
    file.seek(0)
    line = file.readline()
    if not line.endswith(b"\n"):
        if line and not b'{"journal": '.startswith(line[:12]):
            raise SceneError(f"{path}: is no journal of a sweep; move it away")
        return None
    try:
        header = json.loads(line)
        version, fingerprint = header.pop("journal"), header.pop("fingerprint")
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        raise SceneError(f"{path}: is no journal of a sweep; move it away") from None
    if not any_format and version != FORMAT:
        raise SceneError(f"{path}: is a journal of another version of cablestudy; --restart begins anew")
    if not any_format and digest(header) != fingerprint:
        raise SceneError(f"{path}: its first line was changed, which says what its rows are of; --restart begins anew")
    return header


def _rows(file):
    """The highest row in a file."""
    file.seek(0)
    return max((int(match[3]) for line in file if (match := whole(line))), default=0)


def _lock(file, path):
    """Keep other processes out of a file; the system lets go of it whatever happens to this one."""
    try:
        import fcntl
    except ImportError:  # not every system has such locks
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SceneError(f"{path}: another sweep is at work on it") from None
    except OSError:  # nor has every disk
        return
