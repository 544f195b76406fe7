"""Shards of a study, each some of its rows computed by `sweep --shard K/N`, joined into its table."""

import sqlite3
from contextlib import closing

from cablestudy.errors import SceneError
from cablestudy.scene.words import counted, first_of
from cablestudy.sweeps.database import Database
from cablestudy.sweeps.fingerprint import differences, digest, edited_parts
from cablestudy.sweeps.record import unpack
from cablestudy.sweeps.run import Run, SweepOptions, command
from cablestudy.sweeps.store import COLUMNS, MISSING, open_store, stored_description
from cablestudy.sweeps.tolerances import SWEEPS


class MergedRun(Run):
    """A run whose rows come from the shards of its study; `words`: the command that computes the study, for hints."""

    def __init__(self, study, files, words, quiet=False):
        super().__init__(study, files, SweepOptions(keep=True, quiet=quiet))
        self._words = words

    def _open(self):
        """Join the rows that all shards of the study have stored: `RowStore` of the whole study.

        SceneError if there are no shards, or of another study or version; where rows are missing, with the commands
        that compute them.
        """
        shards = self.files.shards()
        if not shards:
            nothing = "no shards there ('cablestudy sweep --shard K/N' makes them)"
            raise SceneError(f"{self.files.shard('K', 'N')}: {nothing}")
        counts = sorted({count for _, count in shards})
        if len(counts) > 1:
            listed = " and of ".join(map(str, counts))
            raise SceneError(f"--out {self.files.folder}: shards of {listed} lie there: move one kind away")
        mistakes = []
        with closing(open_store("", self.identity, self.study.count)) as merged:
            for path in shards.values():
                mistakes += _add_shard(path, merged)
            merged.load()
            mistakes = mistakes or self._missing_rows(merged, counts[0], {number for number, _ in shards})
            if mistakes:
                raise SceneError(*mistakes)
            store = open_store(self.path, self.identity, self.study.count, restart=True)
            store.insert(merged.stored(self.cases))
        store.load()
        return store

    def _missing_rows(self, merged, count, present):
        """List of lines, one for each of `count` shards without all of its rows, with the command that computes them.

        `merged` has the rows of all shards, `present` is the set of numbers, from 1, of those that are there.
        """
        lines = []
        for number in range(1, count + 1):
            missing = [case + 1 for case in merged.select(range(number - 1, self.study.count, count), MISSING)]
            if missing or number not in present:
                state = "not complete" if number in present else "no such shard"
                listed = first_of(list(map(str, missing)), SWEEPS.listed)
                rows = f"{counted(len(missing), 'row')} missing" + (f" ({listed})" if missing else "")
                how = command(self._words, "--out", self.files.folder, "--shard", f"{number}/{count}", "--resume")
                lines.append(f"{self.files.shard(number, count)}: {state}, {rows}: {how}")
        return lines


def _add_shard(path, merged):
    """Add the intact rows of a shard to a store; list of lines why they do not belong to it, empty where they do."""
    with closing(Database(path)) as shard:
        try:
            stored = stored_description(shard)
            if stored is None:
                return [f"{path}: is empty"]
            identity, _ = stored
            if digest(identity) == digest(merged.identity):
                rows = shard.execute(f"SELECT {COLUMNS} FROM rows WHERE status IS NOT NULL")
                merged.insert([row for row in rows if unpack(row, merged.headers)])
                return []
        except sqlite3.Error as error:
            return [f"{path}: is damaged ({error}): compute the shard again with --resume"]
    lines = *differences(identity, merged.identity), *edited_parts(identity, merged.identity)
    return [f"{path}: {line}" for line in lines]
