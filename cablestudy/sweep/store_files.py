"""Opens the file with the rows of a sweep, whatever it holds: rows to go on with, a damaged file, another program's."""

import json
import sqlite3

from cablestudy.errors import SceneError
from cablestudy.study.columns import find
from cablestudy.sweep.database import Database
from cablestudy.sweep.fingerprint import differences, digest
from cablestudy.sweep.record import unpack
from cablestudy.sweep.store import COLUMNS, FORMAT, SCHEMA, RowStore

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
            empty = is_empty(store.database, any_version=restart)
            rows = 0 if empty or resume or restart else _unfinished(store.database)
            stored = stored_description(store.database) if resume and not empty else None
        except sqlite3.Error as error:
            if not (resume or restart):
                hint = "--resume keeps the rows that can be read, --restart begins anew"
                raise SceneError(f"{path}: is damaged ({error}): {hint}") from None
            rows, stored = 0, None
            store.warnings += [f"{path}: is damaged ({error}); none of its rows could be read"] if resume else []
        if rows:
            hint = "go on with --resume, or begin anew with --restart"
            raise SceneError(f"{path}: an unfinished run is there, {rows} rows done: {hint}")
        if stored:
            _resume(store, *stored, reuse)
        else:
            store.begin()
    except BaseException:
        store.close()
        raise
    return store


def is_empty(database, any_version=False):
    """Whether a database has no tables; raises SceneError for one of another version."""
    if not database.value("SELECT count(*) FROM sqlite_master"):
        return True
    if not any_version and database.value("PRAGMA user_version") != FORMAT:
        raise SceneError(f"{database.path}: is of another version of cablestudy; --restart begins anew")
    return False


def _unfinished(database):
    """How many rows are there of which no table is written."""
    finished = database.execute("SELECT value FROM about WHERE name = 'finished'").fetchone()
    return 0 if finished == ("1",) else database.value("SELECT count(*) FROM rows")


def stored_description(database):
    """What the rows of a database depend on, and which columns are known of its partial rows.

    Returns
    -------
    identity : dict
    partial : list of str

    Raises
    ------
    SceneError
        It is not as it was written.
    sqlite3.Error
        It cannot be read.
    """
    try:
        about = dict(database.execute("SELECT name, value FROM about"))
        identity, partial = json.loads(about["study"]), json.loads(about["partial"])
        kinds = [type(identity[name]) for name in ("versions", "scene", "vary", "columns")]
        headers = [find(header).header for header in identity["columns"]]
        intact = kinds == [dict, dict, list, list] and set(partial) <= set(headers)
        intact = intact and digest(identity) == about["fingerprint"]
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError):
        intact = False
    if not intact:
        what = "the description of the study that its rows belong to was changed"
        raise SceneError(f"{database.path}: {what}; --restart begins anew")
    return identity, partial


def _resume(store, identity, partial, reuse):
    """Go on with the rows that are there."""
    current = store.identity
    lines = differences(identity, current)
    if lines:
        hint = "these rows cannot be used: --restart begins anew, --out DIR begins elsewhere"
        raise SceneError(*(f"{store.path}: {line}" for line in lines), f"{store.path}: {hint}")
    same = digest(identity) == digest(current)
    store.describe(identity, partial)
    _keep_valid_rows(store, store.count if same else None)
    store.load()
    if not same:
        reuse(store, current)
    store.set_finished(False)


def _keep_valid_rows(store, highest):
    """Check all rows of a store; if something is wrong, begin anew with those that are as they were written."""
    wrong, damage = [], None
    try:
        tables = dict(store.database.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"))
        structure = store.database.value("PRAGMA quick_check(1)")
        if structure != "ok" or tables != SCHEMA:
            damage = "its tables were changed" if structure == "ok" else " ".join(structure.split())
        wrong = [row for row, stored in _rows(store, "ASC", highest) if stored is None]
    except sqlite3.Error as error:
        damage = str(error)
    if not (damage or wrong):
        return
    valid = {}
    for order in ("ASC", "DESC"):  # from both ends to where it is damaged
        try:
            valid.update((row, stored) for row, stored in _rows(store, order, highest) if stored)
        except sqlite3.Error:
            continue
    store.begin()
    store.insert(valid.values())
    if damage:
        store.warnings.append(f"{store.path}: is damaged ({damage}); {len(valid)} of its rows could be read")
    else:
        listed = ", ".join(map(str, wrong[:MAX_LISTED])) + (", ..." if len(wrong) > MAX_LISTED else "")
        listed = f"row{'s' * (len(wrong) > 1)} {listed}"
        store.warnings.append(f"{store.path}: left out what is not as it was written: {listed}")


def _rows(store, order, highest):
    """Yield the number of each row and what is stored of it, None if that is not as it was written."""
    for stored in store.database.execute(f"SELECT {COLUMNS} FROM rows ORDER BY row {order}"):
        valid = unpack(stored, len(store.headers)) and (highest is None or stored[0] <= highest)
        yield stored[0], stored if valid else None
