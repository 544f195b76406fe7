"""Opens the file with the rows of a sweep, whatever it holds: rows to go on with, a damaged file, another program's."""

import json
import sqlite3
from contextlib import suppress

from cablestudy.errors import SceneError
from cablestudy.study.columns import find
from cablestudy.sweep.database import Database
from cablestudy.sweep.fingerprint import differences, digest
from cablestudy.sweep.record import unpack
from cablestudy.sweep.store import APPLICATION, COLUMNS, FORMAT, INSERT, SCHEMA, RowStore

MAX_LISTED = 5  # rows that are named in a message


def open_store(path, identity, count, reuse, resume=False, restart=False):
    """The store of a run: a new one, or the one that is there.

    Parameters
    ----------
    path : str
    identity : dict
        From `fingerprint.identity`.
    count : int
        Cases of the study.
    reuse : callable
        (store with the rows of another study, identity) -> None: puts what can be used of them in their place.
    resume, restart : bool
        Go on with what is there, or begin anew even if it is unfinished.

    Returns
    -------
    RowStore

    Raises
    ------
    SceneError
        An unfinished run is there and nothing says what to do with it; its rows are of another scene or version;
        another process is at work on it; the file is something else.
    """
    store = RowStore(Database(path), identity, count)
    try:
        try:
            empty = _is_empty(store.database, any_version=restart)
            rows = 0 if empty or resume or restart else _unfinished(store.database)
        except sqlite3.Error as error:
            if not (resume or restart):
                hint = "--resume keeps the rows that can be read, --restart begins anew"
                raise SceneError(f"{path}: is damaged ({error}): {hint}") from None
            empty, rows = False, 0
        if rows:
            hint = "go on with --resume, or begin anew with --restart"
            raise SceneError(f"{path}: an unfinished run is there, {rows} rows done: {hint}")
        if resume and not empty:
            _resume(store, reuse)
        else:
            store.begin()
    except BaseException:
        store.close()
        raise
    return store


def _is_empty(database, any_version=False):
    """Whether a database has no tables; refuses one of another program or version."""
    if not database.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
        return True
    if database.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
        raise SceneError(f"{database.path}: is a database of another program; move it away")
    if not any_version and database.execute("PRAGMA user_version").fetchone()[0] != FORMAT:
        raise SceneError(f"{database.path}: is of another version of cablestudy; --restart begins anew")
    return False


def _unfinished(database):
    """How many rows are there of which no table is written."""
    finished = database.execute("SELECT value FROM about WHERE name = 'finished'").fetchone()
    return 0 if finished == ("1",) else database.execute("SELECT count(*) FROM rows").fetchone()[0]


def _resume(store, reuse):
    """Go on with the rows that are there."""
    current = store.identity
    try:
        identity, partial = _description(store.database)
    except sqlite3.Error as error:
        store.begin()
        store.warnings.append(f"{store.path}: is damaged ({error}); none of its rows could be read")
        return
    lines = differences(identity, current)
    if lines:
        hint = "these rows cannot be used: --restart begins anew, --out DIR begins elsewhere"
        raise SceneError(*(f"{store.path}: {line}" for line in lines), f"{store.path}: {hint}")
    same = digest(identity) == digest(current)
    store.load(identity, partial)
    _remove_wrong_rows(store, store.count if same else None)
    store.load(identity, partial)
    if not same:
        reuse(store, current)
    store.set_finished(False)


def _description(database):
    """What the rows of a database depend on, and which columns are known of its partial rows."""
    about = dict(database.execute("SELECT name, value FROM about"))
    try:
        identity, partial = json.loads(about["study"]), json.loads(about["partial"])
        if digest(identity) != about["fingerprint"] or not set(partial) <= set(identity["columns"]):
            raise ValueError
        for name, kind in (("versions", dict), ("scene", dict), ("vary", list), ("columns", list)):
            if not isinstance(identity[name], kind):
                raise ValueError
        for header in identity["columns"]:
            find(header)
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError):
        about_what = "what it says about the study of its rows was changed"
        raise SceneError(f"{database.path}: {about_what}; --restart begins anew") from None
    return identity, partial


def _remove_wrong_rows(store, most):
    """Remove the rows that are not as they were written, or beyond the highest; recreate a damaged file."""
    try:
        tables = dict(store.database.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"))
        if tables != SCHEMA:
            raise sqlite3.DatabaseError("its tables were changed")
        (found,) = store.database.execute("PRAGMA quick_check(1)").fetchone()
        if found != "ok":
            raise sqlite3.DatabaseError(" ".join(found.split()))
        wrong = list(_wrong_rows(store, most))
    except sqlite3.Error as error:
        rows = _readable_rows(store)
        store.begin()
        with store.database.transaction():
            store.database.execute_many(INSERT, rows)
        store.warnings.append(f"{store.path}: is damaged ({error}); {len(rows)} of its rows could be read")
        return
    if wrong:
        listed = ", ".join(map(str, wrong[:MAX_LISTED])) + (", ..." if len(wrong) > MAX_LISTED else "")
        listed = f"row{'s' * (len(wrong) > 1)} {listed}"
        store.warnings.append(f"{store.path}: left out what is not as it was written: {listed}")
        with store.database.transaction():
            store.database.execute_many("DELETE FROM rows WHERE row = ?", [(row,) for row in wrong])


def _wrong_rows(store, most):
    """Numbers of the rows that are not as they were written, or beyond the highest."""
    with store.database.any_text():
        for stored in store.database.execute(f"SELECT {COLUMNS} FROM rows ORDER BY row"):
            if unpack(stored, len(store.headers)) is None or (most is not None and stored[0] > most):
                yield stored[0]


def _readable_rows(store):
    """The rows of a damaged file that can be read, from its beginning and from its end."""
    found = {}
    for order in ("ASC", "DESC"):
        with suppress(sqlite3.Error), store.database.any_text():
            for stored in store.database.execute(f"SELECT {COLUMNS} FROM rows ORDER BY row {order}"):
                if unpack(stored, len(store.headers)) is not None:
                    found[stored[0]] = stored
    return list(found.values())


def read_store(path, count):
    """The store of a shard, which is only read.

    Parameters
    ----------
    path : str
    count : int
        Cases of the study.

    Returns
    -------
    RowStore

    Raises
    ------
    SceneError
        It cannot be read, or is something else.
    """
    database = Database(path)
    try:
        if _is_empty(database):
            raise SceneError(f"{path}: is empty")
        identity, partial = _description(database)
        store = RowStore(database, identity, count)
        store.load(identity, partial)
        wrong = list(_wrong_rows(store, count))
    except sqlite3.Error as error:
        database.close()
        raise SceneError(f"{path}: is damaged ({error}): compute the shard again with --resume") from None
    except BaseException:
        database.close()
        raise
    store.forget(wrong)
    return store


def merged_store(path, identity, count, shards):
    """One store with the rows of several shards; replaces what is there.

    Parameters
    ----------
    path : str
    identity : dict
    count : int
    shards : sequence of str
        Stores of the same identity, closed.

    Returns
    -------
    RowStore
    """
    store = RowStore(Database(path), identity, count)
    try:
        with suppress(sqlite3.Error):  # a damaged file is replaced, too
            _is_empty(store.database, any_version=True)
        store.begin()
        for shard in shards:
            store.copy(shard)
        store.load(identity, [])
    except BaseException:
        store.close()
        raise
    return store
