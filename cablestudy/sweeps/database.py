"""An SQLite database that one process at a time uses, safe against a kill at any moment; its errors as single lines.

In WAL mode a commit is one append to a file NAME-wal next to the database: a process that is killed leaves all of it or
nothing, and the next one to open the database takes it over. With the exclusive lock both files stay open: a run goes
on even if its folder is renamed or deleted meanwhile. After a clean end NAME-wal is gone.
"""

import os
import random
import sqlite3
import time
from contextlib import contextmanager, suppress

from cablestudy.errors import SceneError
from cablestudy.sweeps.tolerances import SWEEPS

MAGIC = b"SQLite format 3\0"
APPLICATION = 0x63616273  # application_id of SQLite: tells our databases from those of other programs
SIDE_FILES = ("-wal", "-shm", "-journal")
BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
AT_WORK = "another sweep is at work on it"


class Database:
    """A connection to a database; "" is the path of one that vanishes with the process, in memory while it is small.

    SceneError if the file cannot be opened, is something else, or another process uses it. A damaged one is opened;
    statements raise sqlite3.DatabaseError then.
    """

    def __init__(self, path):
        self.path = path
        self._connect()

    def _connect(self):
        """Open the database file with an exclusive lock; if another process has it, try for `SWEEPS.lock_wait`.

        Two processes that open the file at once can each hold a lock that the other waits for. Each attempt that fails
        therefore gives back all locks, and a random pause lets one of the processes succeed.
        """
        if self.path:
            _check_beginning(self.path)
        deadline = time.monotonic() + SWEEPS.lock_wait
        while True:
            try:
                self._open()
                return
            except sqlite3.OperationalError as error:
                self._connection.close()
                if error.sqlite_errorcode & 0xFF not in BUSY:
                    raise SceneError(f"{self.path}: cannot be written ({error})") from None
            except sqlite3.DatabaseError:  # damaged
                return
            if time.monotonic() > deadline:
                raise SceneError(f"{self.path}: {AT_WORK}")
            time.sleep(random.uniform(0, SWEEPS.lock_pause))

    def _open(self):
        """Open the file with its exclusive lock, and make it one of ours if it is new."""
        self._connection = sqlite3.connect(self.path, timeout=0, isolation_level=None)
        self.execute("PRAGMA locking_mode = EXCLUSIVE")
        self.execute("PRAGMA writable_schema = ON")  # reads what is left of a file that was cut
        if not self.value("PRAGMA page_count"):
            self.execute(f"PRAGMA application_id = {APPLICATION}")
        if self.value("PRAGMA application_id") != APPLICATION:
            self._connection.close()
            raise SceneError(f"{self.path}: is a database of another program; move it away")
        self.execute("PRAGMA journal_mode = WAL")
        self.execute("PRAGMA synchronous = NORMAL")
        self.execute("SELECT count(*) FROM sqlite_master")

    def empty(self):
        """Make the database empty, whatever is in it: remove all tables, or the file itself if it is damaged.

        If the file is removed, its lock is released for a moment.

        Raises
        ------
        SceneError
            Another sweep has taken the file in this moment.
        """
        try:
            tables = [name for (name,) in self.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            with self._connection:
                self.execute("BEGIN")
                for name in tables:
                    self.execute(f'DROP TABLE "{name}"')
            if tables:
                self.execute("VACUUM")  # writes the file anew: damage among its free pages would stay
            if not self.value("SELECT count(*) FROM sqlite_master"):
                return
        except sqlite3.Error:
            pass
        self._connection.close()
        for suffix in ("", *SIDE_FILES) if self.path else ():
            with suppress(FileNotFoundError):
                os.unlink(self.path + suffix)
        self._connect()
        if self.value("SELECT count(*) FROM sqlite_master"):  # of another sweep, which began between the two steps
            raise SceneError(f"{self.path}: {AT_WORK}")

    def execute(self, statement, values=()):
        """Execute a statement: cursor of its rows."""
        return self._connection.execute(statement, values)

    def reported_rows(self, query, values=()):
        """Yield the rows of the result of a query; errors of SQLite as in `reported`."""
        with self.reported():
            yield from self.execute(query, values)

    def value(self, query):
        """The only value in the only row of the result of a query."""
        return self.execute(query).fetchone()[0]

    def execute_many(self, statement, rows):
        """Execute a statement for each of many rows of values."""
        self._connection.executemany(statement, rows)

    @contextmanager
    def transaction(self):
        """All statements inside take effect together, or none; SceneError if the disk is full or the file damaged."""
        with self.reported(), self._connection:
            self.execute("BEGIN")
            yield

    @contextmanager
    def reported(self):
        """Turn errors of SQLite into SceneError."""
        try:
            yield
        except sqlite3.Error as error:
            hint = "; --resume goes on" if self.path else ""
            raise SceneError(f"{self.path or 'a temporary file'}: cannot be used ({error}){hint}") from None

    def close(self):
        """Release the file."""
        with suppress(sqlite3.Error):  # a full disk has been reported already
            self._connection.close()
        if self.path and not os.path.exists(self.path):  # deleted meanwhile: SQLite leaves the side file
            with suppress(OSError):
                os.unlink(self.path + "-wal")


def _check_beginning(path):
    """Refuse a file that is no SQLite database, and a link to nothing, before SQLite writes anything."""
    for name in (path, *(path + suffix for suffix in SIDE_FILES)):
        if os.path.islink(name) and not os.path.exists(name):
            raise SceneError(f"{name}: is a link to {os.readlink(name)}, which is not there")
    try:
        with open(path, "rb") as file:
            beginning = file.read(len(MAGIC))
    except FileNotFoundError:
        return
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror})") from None
    if not MAGIC.startswith(beginning):
        raise SceneError(f"{path}: is no database of a sweep; move it away")
