"""The rows of a run as they are done: a file of JSON lines, safe against an end at any moment.

    {"journal": 2, "fingerprint": ..., "program": ..., "scene": ..., "vary": ..., "columns": ...}
    {"row": 17, "sum": "1c291ca3", "key": "9f0c...", "cells": {"sag_m": 0.12, ..., "status": "ok"}}

The first line says what the rows depend on, every other line is a row, in the order in which they were done. `sum` is
the CRC-32 of the rest of the line: what was torn or changed is not taken for a row. `key` is a hash of the row's own
resolved scene: a study that grew finds its rows again by it. A line `part` is a row of which some columns are still to
be computed. The last line of a run whose table is written is `{"finished": true}`.
"""

import io
import json
import re
import tempfile
from array import array
from collections import Counter
from contextlib import suppress
from zlib import crc32

from cablestudy.errors import SceneError
from cablestudy.sweep.chunk import OK, line_of
from cablestudy.sweep.fingerprint import digest

FORMAT = 2
FINISHED = b'{"finished": true}\n'
LINE = re.compile(rb'(\{"(row|part)": ([1-9]\d{0,8}), )"sum": "([0-9a-f]{8})", ("key": "([0-9a-f]*)", .*)\n')
STATUS = re.compile(rb'"status": ("(?:[^"\\]|\\.)*")\}\}\n$')
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
FIRST = 10  # failures that are kept to be shown
IN_MEMORY = 100_000  # cases of a run that leaves no file


class Journal:
    """The rows of one run, on disk; where each line begins is all that is kept in memory.

    Parameters
    ----------
    file : binary file
        Open for reading and writing.
    identity : dict
        From `fingerprint.identity`.
    count : int
        Cases of the study.

    Attributes
    ----------
    path : str or None
    done : int
        Rows that are complete.
    finished : bool
        Whether their table is written.
    failed : int
        Complete rows without an answer.
    failures : list of (int, str)
        The first of them: case from 0, and why.
    kinds : Counter
        Why, numbers left out, and how often.
    parts : dict
        Case -> where the line begins that holds some of its columns.
    strange : list of int
        Lines, from 1, that are no rows as they were written.
    """

    def __init__(self, file, identity, count, path=None):
        self._file, self.identity, self.path = file, identity, path
        self._begins = array("q", [-1]) * count
        self._end = 0
        self.done, self.failed, self.finished = 0, 0, False
        self.failures, self.kinds, self.parts, self.strange = [], Counter(), {}, []

    @classmethod
    def temporary(cls, identity, count):
        """A journal that goes with the process: for a run that writes nothing."""
        file = io.BytesIO() if count <= IN_MEMORY else tempfile.TemporaryFile()  # noqa: SIM115
        journal = cls(file, identity, count)
        journal.begin()
        return journal

    def begin(self):
        """Write the first line."""
        header = {"journal": FORMAT, "fingerprint": digest(self.identity), **self.identity}
        self._write(json.dumps(header).encode() + b"\n")

    def __contains__(self, case):
        return self._begins[case] >= 0

    def missing(self, cases):
        """Those of some cases of which nothing is known."""
        return (case for case in cases if self._begins[case] < 0 and case not in self.parts)

    def incomplete(self, cases):
        """Those of some cases of which some columns are known."""
        return (case for case in cases if case in self.parts) if self.parts else iter(())

    def part_columns(self):
        """Headers that are known of the rows of which only some columns are."""
        return frozenset(self._read(next(iter(self.parts.values())))["cells"]) if self.parts else frozenset()

    def row(self, case):
        """What the line of a complete row holds."""
        return self._read(self._begins[case])

    def cells(self, case):
        """Cells of a complete row: header -> number, text or None."""
        return self.row(case)["cells"]

    def notes(self, case):
        """What was modelled, as far as it was kept: tuple of str."""
        return tuple(self.row(case).get("notes", ()))

    def append(self, lines):
        """Add rows that are done, and hand them to the system before anything else happens.

        Parameters
        ----------
        lines : bytes
            From `chunk.compute`.
        """
        self.extend(b"".join(map(self._joined, _split(lines))) if self.parts else lines)

    def extend(self, lines):
        """`append` of lines as they are: rows, or parts of rows."""
        begin, self.finished = self._end, False
        self._write(lines)
        for line in _split(lines):
            self._note(line, begin)
            begin += len(line)

    def finish(self):
        """Say that the table of these rows is written."""
        if not self.finished:
            self._write(FINISHED)
        self.finished = True

    def close(self):
        """Let go of the file."""
        with suppress(OSError):  # a full disk has been reported already
            self._file.close()

    def load(self, cut=True):
        """Take in what the file holds; what is no row as it was written is left out, and at the end cut off."""
        self._file.seek(0)
        begin = self._end = len(self._file.readline())
        for number, line in enumerate(self._file, 2):
            known = whole(line)
            if known:
                self._note(line, begin)
            begin += len(line)
            if known or line == FINISHED:
                self.finished, self._end = not known, begin
            elif line.endswith(b"\n"):  # the last one may be torn
                self.strange.append(number)
        if cut:
            self._file.truncate(self._end)

    def lines(self):
        """Yield the line of every complete row, in the order of the cases."""
        for case, begin in enumerate(self._begins):
            if begin >= 0:
                yield case, self._line(begin)

    def keys(self):
        """Key -> where its line begins, of every complete row."""
        found = {}
        for _, line in self.lines():
            found[LINE.match(line)[6]] = self._file.tell() - len(line)
        return found

    def line_at(self, begin):
        """The line that begins there."""
        return self._line(begin)

    def _write(self, lines):
        try:
            self._file.seek(self._end)
            self._file.write(lines)
            self._file.flush()
        except OSError as error:
            place = self.path or "a temporary file"
            hint = "; --resume goes on" if self.path and self.done else ""
            raise SceneError(f"{place}: cannot be written ({error.strerror or error}){hint}") from None
        self._end += len(lines)

    def _line(self, begin):
        self._file.seek(begin)
        return self._file.readline()

    def _read(self, begin):
        return json.loads(self._line(begin))

    def _note(self, line, begin):
        """Take one line into the index."""
        _, kind, row, *_ = LINE.match(line).groups()
        case = int(row) - 1
        if kind == b"part":
            self.parts[case] = begin
            return
        self.parts.pop(case, None)
        if self._begins[case] < 0:
            self.done += 1
            if not line.endswith(OK):
                self._note_failure(case, json.loads(STATUS.search(line)[1]))
        self._begins[case] = begin

    def _note_failure(self, case, status):
        self.failed += 1
        self.kinds[NUMBER.sub("…", status)] += 1
        if len(self.failures) < FIRST or case < self.failures[-1][0]:
            self.failures = sorted([*self.failures, (case, status)])[:FIRST]

    def _joined(self, line):
        """The line of a row that had some columns already, with the new ones."""
        new = json.loads(line)
        case = new["row"] - 1
        if case not in self.parts:
            return line
        old, cells = self._read(self.parts[case]), new["cells"]
        if cells["status"] == "ok":
            cells = {**old["cells"], **cells}
        else:
            cells = {**dict.fromkeys(old["cells"]), **dict.fromkeys(cells), "status": cells["status"]}
        known = [part.get("errors", {}) for part in (old, new)]
        errors = None if None in known else {**known[0], **known[1]}
        return line_of(case, new["key"], cells, (*old.get("notes", ()), *new.get("notes", ())), errors=errors)


def whole(line):
    """The match of LINE with a line that is as it was written, else None."""
    match = LINE.fullmatch(line)
    return match if match and crc32(match[5], crc32(match[1])) == int(match[4], 16) else None


def _split(lines):
    """Lines of bytes, parted at line feeds only."""
    return [line + b"\n" for line in lines.split(b"\n")[:-1]]
