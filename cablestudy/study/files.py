"""The files of a table in a folder: NAME.csv and NAME.md; of a sweep NAME.run.yaml and NAME.rows.sqlite too."""

import glob
import os
import re
from contextlib import suppress

from cablestudy.errors import SceneError
from cablestudy.study.table import leftovers, write_whole


class TableFiles:
    """The files of a study, which is named as the user named it.

    Attributes
    ----------
    csv, md, run, rows : str
        The table, its provenance, and the rows as they are computed.
    """

    def __init__(self, folder, study):
        stem = os.path.splitext(os.path.basename(study))[0]
        self.folder = folder
        self.stem = "stdin" if study == "<stdin>" else stem
        self.csv, self.md, self.run, self.rows = (
            os.path.join(folder, self.stem + end) for end in (".csv", ".md", ".run.yaml", ".rows.sqlite")
        )

    def shard(self, number, count):
        """The rows of one shard, numbered from 1."""
        return os.path.join(self.folder, f"{self.stem}.shard-{number}-of-{count}.sqlite")

    def shards(self):
        """The shards that are there: (number, count) -> path."""
        found = {}
        pattern = re.compile(re.escape(self.stem) + r"\.shard-(\d+)-of-(\d+)\.sqlite")
        for path in glob.glob(os.path.join(glob.escape(self.folder), glob.escape(self.stem) + ".shard-*.sqlite")):
            match = pattern.fullmatch(os.path.basename(path))
            if match:
                found[int(match[1]), int(match[2])] = path
        return dict(sorted(found.items()))

    def check_writable(self):
        """Check that the folder is there or can be made, and the files written; make nothing yet.

        Raises
        ------
        SceneError
            It cannot be written to.
        """
        there = os.path.abspath(self.folder)
        while not os.path.lexists(there):
            there = os.path.dirname(there)
        if not os.path.isdir(there):
            raise SceneError(f"--out {self.folder}: {os.path.relpath(there)} is a file, not a folder")
        if not os.access(there, os.W_OK | os.X_OK):
            raise SceneError(f"--out {self.folder}: cannot be written to")
        folders = [path for path in (self.csv, self.md, self.run, self.rows) if os.path.isdir(path)]
        if folders:
            raise SceneError(*(f"{path}: cannot be written (a folder is there)" for path in folders))

    def check_stored(self):
        """Raise SceneError when there is no stored table to compare with."""
        if not os.path.isfile(self.csv):
            raise SceneError(f"{self.csv}: no such file to compare with (run the sweep without --check first)")

    def write_texts(self, csv, markdown):
        """Write both files, each whole or not at all; make the folder if need be."""
        self.make()
        write_whole(self.csv, csv)
        write_whole(self.md, markdown)

    def make(self):
        """Make the folder if need be."""
        try:
            os.makedirs(self.folder, exist_ok=True)
        except OSError as error:
            raise SceneError(f"--out {self.folder}: cannot be made ({error.strerror})") from None

    def clear(self):
        """Remove what a run that was killed while it wrote a table left; the rows must be locked."""
        for path in (self.csv, self.md, self.run):
            for left in glob.glob(os.path.join(glob.escape(self.folder), glob.escape(leftovers(path)) + "*")):
                with suppress(OSError):
                    os.unlink(left)

    def write(self, study, table, provenance):
        """Write the table and its provenance, each file whole or not at all."""
        self.write_texts(table.pieces("csv"), f"# {study.title or self.stem}\n\n{table.render('md')}")
        write_whole(self.run, provenance)
