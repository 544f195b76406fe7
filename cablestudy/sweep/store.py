"""The rows of a sweep on disk as they are computed: an SQLite database beside the table.

Table `rows` has a line for each row of the study's table (see `record`), table `about` says what they depend on:

    study        JSON of `fingerprint.identity`: versions, scene, what varies, columns
    fingerprint  its digest
    finished     1 once the table of these rows is written
    partial      JSON list: the columns that are known of the rows whose `status` is NULL

SQLite keeps its own structure intact; each row has a check sum because a changed number would go unnoticed.
"""

import json

from cablestudy.errors import SceneError
from cablestudy.sweep.database import Database
from cablestudy.sweep.fingerprint import digest
from cablestudy.sweep.record import OK, check_sum, pack, unpack

FORMAT = 1  # of the two tables (user_version of SQLite)
SCHEMA = {
    "about": "CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT)",
    "rows": "CREATE TABLE rows (row INTEGER PRIMARY KEY, key TEXT, status TEXT, cells TEXT, errors TEXT, notes TEXT,"
    " sum INTEGER)",
}
COLUMNS = "row, key, status, cells, errors, notes, sum"
INSERT = "INSERT OR REPLACE INTO rows VALUES (?, ?, ?, ?, ?, ?, ?)"
MISSING, PARTIAL, COMPLETE = 0, 1, 2  # how much is known of a case


class RowStore:
    """The rows of one run.

    Parameters
    ----------
    database : Database
    identity : dict
        From `fingerprint.identity`.
    count : int
        Cases of the study.

    Attributes
    ----------
    path : str
    identity : dict
    headers : list of str
        Of the cells of a row: the columns but `status`.
    partial : list of str
        Headers of the cells that are known of partial rows.
    warnings : list of str
        Lines about what was found damaged.
    """

    def __init__(self, database, identity, count):
        self.database, self.path, self.count = database, database.path, count
        self._known = bytearray(count)
        self.warnings = []
        self.describe(identity)

    @classmethod
    def temporary(cls, identity, count):
        """A store that vanishes with the process: for a run that keeps nothing."""
        store = cls(Database(""), identity, count)
        store.begin()
        return store

    def describe(self, identity, partial=()):
        """State what the rows depend on, and which columns are known of partial ones."""
        self.identity, self.partial = identity, partial
        self.headers = [header for header in identity["columns"] if header != "status"]

    def begin(self):
        """Forget whatever the file holds: no rows."""
        self.database.recreate()
        with self.database.transaction():
            self.database.execute(f"PRAGMA user_version = {FORMAT}")
            for statement in SCHEMA.values():
                self.database.execute(statement)
            self._write_description()
        self._known = bytearray(self.count)

    def _write_description(self, finished=False):
        """Write the table `about`."""
        about = {"study": json.dumps(self.identity), "fingerprint": digest(self.identity)}
        about |= {"finished": int(finished), "partial": json.dumps(list(self.partial))}
        self.database.execute_many("INSERT OR REPLACE INTO about VALUES (?, ?)", about.items())

    def load(self):
        """Take over the rows that the file has."""
        self._known = bytearray(self.count)
        with self.database.reported():
            for row, complete in self.database.execute("SELECT row, status IS NOT NULL FROM rows"):
                if row <= self.count:
                    self._known[row - 1] = COMPLETE if complete else PARTIAL

    def __contains__(self, case):
        return self._known[case] == COMPLETE

    def select(self, cases, known):
        """Iterate over those of some cases of which so much is known: MISSING, PARTIAL or COMPLETE."""
        return (case for case in cases if self._known[case] == known)

    def how_many(self, cases, known):
        """How many of some cases these are."""
        return sum(1 for _ in self.select(cases, known))

    def row(self, case):
        """The record of one row."""
        return next(self.read(range(case, case + 1)))

    def read(self, cases):
        """Yield the records of a range of cases, in order.

        Raises
        ------
        SceneError
            The file was changed while this run used it.
        """
        for stored in self.stored(cases):
            record = unpack(stored, len(self.headers))
            if record is None:
                raise self._changed(stored[0])
            yield record

    def read_texts(self, cases):
        """Yield status and cells, these as JSON, of a range of cases: faster than `read`."""
        for stored in self.stored(cases):
            if check_sum(*stored[:-1]) != stored[-1]:
                raise self._changed(stored[0])
            yield stored[2], stored[3]

    def stored(self, cases):
        """Yield the rows of a range of cases as they are stored, in order."""
        query = f"SELECT {COLUMNS} FROM rows WHERE row > ? AND row <= ? ORDER BY row"
        row = cases.start
        with self.database.reported():
            for stored in self.database.execute(query, (cases.start, cases.stop)):
                row += 1
                if stored[0] != row:
                    raise self._changed(row)
                yield stored
        if row != cases.stop:
            raise self._changed(row + 1)

    def _changed(self, row):
        return SceneError(f"{self.path}: row {row} was changed while the sweep ran; --resume computes it again")

    def failures(self):
        """Yield case and status of each row without an answer, in order."""
        with self.database.reported():
            yield from self.database.execute(f"SELECT row - 1, status FROM rows WHERE status != '{OK}' ORDER BY row")

    def add(self, headers, records):
        """Add the rows of a chunk: all of them, or none.

        Parameters
        ----------
        headers : list of str
            Of the cells that the records have; of partial rows those that were missing.
        records : list of tuple
            From `record.pack`.
        """
        if headers != self.headers:
            records = [self._completed(headers, unpack(stored, len(headers))) for stored in records]
        self.insert(records)
        for row, *_ in records:
            self._known[row - 1] = COMPLETE

    def _completed(self, headers, new):
        """A partial row with the columns that were missing."""
        old = self.row(new.case)
        known = dict(zip(self.headers, old.cells, strict=True)) | dict(zip(headers, new.cells, strict=True))
        errors, notes = old.errors | new.errors, [*old.notes, *new.notes]
        return pack(new.case, new.key, new.status, list(known.values()), errors, notes)

    def replace(self, identity, partial, records):
        """Put rows of another study in place of those that are there.

        Parameters
        ----------
        identity : dict
        partial : list of str
            Headers of the cells that are known of partial rows.
        records : iterable of tuple
            From `record.pack`; may be computed from the rows that are there.
        """
        with self.database.transaction():
            self.database.execute("CREATE TEMP TABLE new_rows AS SELECT * FROM rows LIMIT 0")
            self.database.execute_many(INSERT.replace("rows", "new_rows", 1), records)
            self.database.execute("DELETE FROM rows")
            self.database.execute("INSERT OR REPLACE INTO rows SELECT * FROM new_rows")
            self.database.execute("DROP TABLE new_rows")
            self.describe(identity, partial)
            self._write_description()
        self.load()

    def insert(self, records):
        """Add rows as they are: all of them, or none."""
        with self.database.transaction():
            self.database.execute_many(INSERT, records)

    def set_finished(self, finished):
        """Note whether the table of these rows is written."""
        with self.database.transaction():
            self._write_description(finished)

    def close(self):
        """Release the file."""
        self.database.close()
