"""The rows of a sweep on disk as they are computed: an SQLite database next to the table, opened whatever it holds.

Table `rows` has a line for each row of the study's table (see `record`), table `about` says what they depend on:

    study        JSON of `fingerprint.identity`: versions, scene, what varies, columns
    fingerprint  its digest
    finished     1 once the table of these rows is written
    partial      JSON list: the columns that are known of the rows whose `status` is NULL

SQLite keeps its own structure intact; each row has a check sum because a changed number would go unnoticed.
"""

import json
import sqlite3
from contextlib import suppress

from cablestudy.errors import SceneError
from cablestudy.scene.words import first_of
from cablestudy.study.columns import find_header
from cablestudy.study.table_rows import DOUBTS, OK
from cablestudy.sweeps.database import Database
from cablestudy.sweeps.fingerprint import differences, digest, is_identity
from cablestudy.sweeps.record import check_sum, pack, unpack
from cablestudy.sweeps.tolerances import SWEEPS

FORMAT = 1  # of the two tables (user_version of SQLite)
SCHEMA = {
    "about": "CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT)",
    "rows": "CREATE TABLE rows (row INTEGER PRIMARY KEY, key TEXT, status TEXT, cells TEXT, errors TEXT, notes TEXT,"
    " sum INTEGER)",
}
COLUMNS = "row, key, status, cells, errors, notes, sum"
DONE = "SELECT count(*) FROM rows WHERE status IS NOT NULL"
INSERT = "INSERT OR REPLACE INTO rows VALUES (?, ?, ?, ?, ?, ?, ?)"
IS_DOUBTFUL = "(" + " OR ".join(f"status LIKE '{doubt}%'" for doubt in DOUBTS) + ")"  # see `table_rows.has_answer`
MISSING, PARTIAL, COMPLETE = 0, 1, 2  # how much is known of a case


class RowStore:
    """Store of the rows of one run of a study, in an SQLite database; `open_store` opens it, with the same parameters.

    A row is partial if only some of its columns are known, from a run before the study was edited.
    """

    def __init__(self, path, identity, count):
        self.database, self.path, self.count = Database(path), path, count
        self._state = bytearray(count)  # of each case MISSING, PARTIAL or COMPLETE
        self.warnings = []  # lines about damage of the file
        self.describe(identity)

    def describe(self, identity, partial=()):
        """State what the rows depend on, and which columns are known of partial ones."""
        self.identity, self.partial = identity, partial
        self.headers = [header for header in identity["columns"] if header != "status"]  # of the cells of a row

    def begin(self):
        """Forget whatever the file holds: no rows."""
        self.database.empty()
        with self.database.transaction():
            self.database.execute(f"PRAGMA user_version = {FORMAT}")
            for statement in SCHEMA.values():
                self.database.execute(statement)
            self._write_description()
        self._state = bytearray(self.count)

    def _write_description(self, finished=False):
        """Write the table `about`."""
        about = {"study": json.dumps(self.identity), "fingerprint": digest(self.identity)}
        about |= {"finished": int(finished), "partial": json.dumps(list(self.partial))}
        self.database.execute_many("INSERT OR REPLACE INTO about VALUES (?, ?)", about.items())

    def set_finished(self, finished):
        """Note whether the table of these rows is written."""
        with self.database.transaction():
            self._write_description(finished)

    def load(self):
        """Take over the rows that the file has, unchecked."""
        self._state = bytearray(self.count)
        query = f"SELECT row, status IS NOT NULL FROM rows WHERE row BETWEEN 1 AND {self.count}"
        for row, complete in self.database.reported_rows(query):
            self._state[row - 1] = COMPLETE if complete else PARTIAL

    def load_valid(self):
        """Take over the rows that are as they were written; a line about the others in `warnings`."""
        self.load()
        with self.database.reported():
            damaged = [row for row, stored in self._checked_rows("ASC", self.count) if stored is None]
        for row in damaged:
            if 1 <= row <= self.count:
                self._state[row - 1] = MISSING
        if damaged:
            self.warnings.append(self._warning_of(damaged))

    def _warning_of(self, damaged):
        """Line about rows, from 1, that are left out since they are not as they were written."""
        rows = f"row{'s' * (len(damaged) > 1)} {first_of(list(map(str, damaged)), SWEEPS.listed)}"
        return f"{self.path}: left out what is not as it was written: {rows}"

    def select(self, cases, state):
        """Iterator of those of some cases that are in a state: MISSING, PARTIAL or COMPLETE."""
        return (case for case in cases if self._state[case] == state)

    def how_many(self, cases, state):
        """Number of those of some cases that are in a state, see `select`."""
        return sum(1 for _ in self.select(cases, state))

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
            yield unpack(stored, self.headers) or self._refuse_changed(stored[0])

    def read_texts(self, cases):
        """Yield status and cells, these as JSON, of a range of cases: faster than `read`."""
        for stored in self.stored(cases):
            if check_sum(*stored[:-1]) != stored[-1]:
                self._refuse_changed(stored[0])
            yield stored[2], stored[3]

    def stored(self, cases):
        """Yield the rows of a range of cases as they are stored, in order."""
        query = f"SELECT {COLUMNS} FROM rows WHERE row > ? AND row <= ? ORDER BY row"
        row = cases.start
        for stored in self.database.reported_rows(query, (cases.start, cases.stop)):
            row += 1
            if stored[0] != row:
                self._refuse_changed(row)
            yield stored
        if row != cases.stop:
            self._refuse_changed(row + 1)

    def _refuse_changed(self, row):
        """Raise the SceneError for a row, from 1, that is not as it was written."""
        raise SceneError(f"{self.path}: row {row} was changed while the sweep ran; --resume computes it again")

    def failures(self):
        """Iterator of case and status of each row without an answer, in order."""
        return self.database.reported_rows(
            f"SELECT row - 1, status FROM rows WHERE status != '{OK}' AND NOT {IS_DOUBTFUL} ORDER BY row"
        )

    def doubtful(self, doubt):
        """Iterator of each case with an answer that one of `table_rows.DOUBTS` is about, in order."""
        query = f"SELECT row - 1 FROM rows WHERE {IS_DOUBTFUL} AND status LIKE '%{doubt}%' ORDER BY row"
        return (case for (case,) in self.database.reported_rows(query))

    def errors(self):
        """Iterator of each row that states errors, in order.

        Yields case, errors, header -> estimated relative error, and JSON of the cells.
        """
        query = "SELECT row - 1, errors, cells FROM rows WHERE errors != '' ORDER BY row"
        return ((case, json.loads(errors), cells) for case, errors, cells in self.database.reported_rows(query))

    def add(self, headers, records):
        """Add the rows of a chunk, from `record.pack`: all of them, or none.

        `headers` are those of their cells; of partial rows those that were missing.
        """
        if headers != self.headers:
            records = [self._complete(headers, unpack(stored, headers)) for stored in records]
        self.insert(records)
        for row, *_ in records:
            self._state[row - 1] = COMPLETE

    def _complete(self, headers, new):
        """The stored partial row of a case completed by a RowRecord `new` with the cells of these headers, packed."""
        old = self.row(new.case)
        cells = dict(zip(self.headers, old.cells, strict=True)) | dict(zip(headers, new.cells, strict=True))
        errors, notes = old.errors | new.errors, [*old.notes, *new.notes]
        return pack(new.case, new.key, new.status, list(cells.values()), errors, notes)

    def insert(self, records):
        """Add rows as they are: all of them, or none."""
        with self.database.transaction():
            self.database.execute_many(INSERT, records)

    def replace(self, identity, partial, records):
        """Replace all rows by those of an edited study, of another `identity`: completely, or not at all.

        `partial` are the headers of the cells that partial rows have: those with only some of the columns. The records,
        from `record.pack`, may be computed from the stored ones while these are replaced.
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

    def resume(self):
        """Take over the rows that an earlier run has left in the file, to go on with them; or begin without rows.

        The store begins without rows if the file is empty or cannot be read. If the study was edited since, `identity`
        becomes that of the stored rows; afterwards `run.reuse_rows` keeps the rows that the edited study has too.

        Raises
        ------
        SceneError
            The stored rows are of another scene or version, or the description of their study was changed.
        """
        try:
            stored = stored_description(self.database)
        except sqlite3.Error as error:
            stored = None
            self.warnings.append(f"{self.path}: is damaged ({error}); none of its rows could be read")
        if stored is None:
            self.begin()
            return
        current, (identity, partial) = self.identity, stored
        lines = differences(identity, current)
        if lines:
            hint = "these rows cannot be used: --restart begins anew, --out DIR begins elsewhere"
            raise SceneError(*(f"{self.path}: {line}" for line in (*lines, hint)))
        self.describe(identity, partial)
        self._keep_valid_rows(self.count if identity == current else None)
        self.load()
        self.set_finished(False)

    def _keep_valid_rows(self, highest):
        """Check the file for damage, and each stored row by its check sum; if any is damaged, keep only the valid rows.

        Rows have numbers up to `highest`, if that is not None.
        """
        damaged_rows, damage = [], None
        try:
            damage = self._damage_of_structure()
            damaged_rows = [row for row, stored in self._checked_rows("ASC", highest) if stored is None]
        except sqlite3.Error as error:
            damage = str(error)
        if not (damage or damaged_rows):
            return
        valid = {}
        for order in ("ASC", "DESC"):  # read from both ends, since reading stops where the file is damaged
            with suppress(sqlite3.Error):
                valid.update((row, stored) for row, stored in self._checked_rows(order, highest) if stored)
        self.begin()
        self.insert(valid.values())
        if damage:
            self.warnings.append(f"{self.path}: is damaged ({damage}); {len(valid)} of its rows could be read")
        else:
            self.warnings.append(self._warning_of(damaged_rows))

    def _damage_of_structure(self):
        """Text on damage of the database as SQLite finds it, or of its tables; None where they are intact."""
        tables = dict(self.database.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL"))
        outcome = self.database.value("PRAGMA quick_check(1)")
        if outcome != "ok":
            return " ".join(outcome.split())
        return None if tables == SCHEMA else "its tables were changed"

    def _checked_rows(self, order, highest):
        """Yield number and stored tuple of each row, None in its place if it is not as it was written.

        `order`: "ASC" or "DESC"; `highest` as in `_keep_valid_rows`.
        """
        for stored in self.database.execute(f"SELECT {COLUMNS} FROM rows ORDER BY row {order}"):
            is_valid = unpack(stored, self.headers) and (highest is None or stored[0] <= highest)
            yield stored[0], stored if is_valid else None

    def close(self):
        """Release the file."""
        self.database.close()


def open_store(path, identity, count, resume=False, restart=False, reuse=0):
    """Open the store of the rows of a run, with the rows of an earlier run or without any: `RowStore`.

    The path is "" for a run that keeps nothing; `identity` is all that the rows depend on, from `fingerprint.identity`;
    `count` is the number of cases of the study. With `resume` the run goes on with the stored rows; with `restart` it
    begins without rows, even if the earlier run is unfinished. `reuse` is the number of rows of a complete run: if the
    file has exactly this number of complete rows of this study, they are used even without `resume`; 0 for never.

    SceneError if an earlier run is unfinished, and neither `resume` nor `restart` is set; if its rows are of another
    scene or version; if another process uses the file, or it is something else.
    """
    store = RowStore(path, identity, count)
    try:
        if resume or (reuse and not restart and rows_done(store.database, identity) == reuse):
            store.resume()
        else:
            if not restart:
                _check_finished(store.database)
            store.begin()
    except BaseException:
        store.close()
        raise
    return store


def rows_done(database, identity):
    """Number of complete rows of a study in a database; 0 where it has those of another one, or cannot be read."""
    try:
        stored = stored_description(database)
        return database.value(DONE) if stored and stored[0] == identity else 0
    except (SceneError, sqlite3.Error):
        return 0


def _is_empty(database):
    """True if a database has no tables; raises SceneError for one of another version."""
    if not database.value("SELECT count(*) FROM sqlite_master"):
        return True
    if database.value("PRAGMA user_version") != FORMAT:
        raise SceneError(f"{database.path}: is of another version of cablestudy; --restart begins anew")
    return False


def _check_finished(database):
    """Raise SceneError if there are rows of which no table is written, or which cannot be read."""
    query = "SELECT count(*) FROM rows WHERE NOT EXISTS (SELECT 1 FROM about WHERE name = 'finished' AND value = '1')"
    try:
        rows = 0 if _is_empty(database) else database.value(query)
    except sqlite3.Error as error:
        hint = "--resume keeps the rows that can be read, --restart begins anew"
        raise SceneError(f"{database.path}: is damaged ({error}): {hint}") from None
    if rows:
        hint = "go on with --resume, or begin anew with --restart"
        raise SceneError(f"{database.path}: an unfinished run is there, {rows} rows done: {hint}")


def stored_description(database):
    """Read from a `Database` what its rows depend on, to decide whether a run can use them; None without tables.

    It is the identity of the study (`fingerprint.identity`), and the headers of the cells that partial rows have: those
    with cells for only some of the columns. SceneError if the description was changed since it was written, or is of
    another version; sqlite3.Error if the database cannot be read.
    """
    if _is_empty(database):
        return None
    try:
        about = dict(database.execute("SELECT name, value FROM about"))
        identity, partial = json.loads(about["study"]), json.loads(about["partial"])
        headers = [find_header(header).header for header in identity["columns"]]
        if is_identity(identity) and set(partial) <= set(headers) and digest(identity) == about["fingerprint"]:
            return identity, partial
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError):
        pass
    what = "the description of the study that its rows belong to was changed"
    raise SceneError(f"{database.path}: {what}; --restart begins anew")
