"""Where a study's tables lie: NAME.csv and NAME.md in a folder."""

import os

from cablestudy.errors import SceneError
from cablestudy.study.table import compare, write_whole


class Place:
    """The two files of a study.

    Parameters
    ----------
    folder : str
    study : str
        The study file as the user named it.
    """

    def __init__(self, folder, study):
        stem = os.path.splitext(os.path.basename(study))[0]
        self.folder, self.study = folder, study
        self.stem = "stdin" if study == "<stdin>" else stem
        self.csv = os.path.join(folder, self.stem + ".csv")
        self.md = os.path.join(folder, self.stem + ".md")

    def check_writable(self):
        """Make sure that the folder is there or can be made; make nothing yet.

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

    def check_stored(self):
        """Raise SceneError when there is no stored table to compare with."""
        if not os.path.isfile(self.csv):
            raise SceneError(f"{self.csv}: no such file to compare with (run the sweep without --check first)")

    def write(self, study, table):
        """Write a study's table to both files."""
        self.write_texts(table.csv(), f"# {study.title or self.stem}\n\n{table.markdown()}")

    def write_texts(self, csv, markdown):
        """Write both files, each whole or not at all; make the folder if need be."""
        try:
            os.makedirs(self.folder, exist_ok=True)
        except OSError as error:
            raise SceneError(f"--out {self.folder}: cannot be made ({error.strerror})") from None
        write_whole(self.csv, csv)
        write_whole(self.md, markdown)

    def compare(self, table, rtol):
        """Differences from the stored table; see `table.compare`."""
        return compare(table, self.csv, rtol)
