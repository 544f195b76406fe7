"""Shards of a study joined into its table."""

import sqlite3
from contextlib import closing

from cablestudy.errors import SceneError
from cablestudy.scene.words import counted
from cablestudy.sweeps.database import Database
from cablestudy.sweeps.fingerprint import differences, digest
from cablestudy.sweeps.record import unpack
from cablestudy.sweeps.run import Run, SweepOptions, command
from cablestudy.sweeps.store import COLUMNS, MISSING, open_store, stored_description

SHOWN = 10  # missing rows that are named


class MergedRun(Run):
    """A run whose rows come from the shards of its study; `words` are the command that computes it, for hints."""

    def __init__(self, study, files, words, quiet=False):
        super().__init__(study, files, SweepOptions(keep=True, quiet=quiet))
        self._words = words

    def _open(self):
        """The rows of all shards in one store.

        Raises
        ------
        SceneError
            No shards, shards of another study or version, or rows that are missing: which, and how to get them.
        """
        shards = self.files.shards()
        if not shards:
            nothing = "no shards there ('cablestudy sweep --shard K/N' makes them)"
            raise SceneError(f"{self.files.shard('K', 'N')}: {nothing}")
        counts = sorted({count for _, count in shards})
        if len(counts) > 1:
            kinds = " and of ".join(map(str, counts))
            raise SceneError(f"--out {self.files.folder}: shards of {kinds} lie there: move one kind away")
        merged, mistakes = open_store("", self.identity, self.study.count), []
        for path in shards.values():
            mistakes += _take(path, merged)
        merged.load()
        mistakes = mistakes or self._missing(counts[0], {number for number, _ in shards}, merged)
        if mistakes:
            raise SceneError(*mistakes)
        store = open_store(self.path, self.identity, self.study.count, restart=True)
        store.insert(merged.stored(self.cases))
        store.load()
        return store

    def _missing(self, shards, there, merged):
        """What is missing of each shard, and how to get it."""
        found = []
        for number in range(1, shards + 1):
            cases = range(number - 1, self.study.count, shards)
            lacking = [case + 1 for case in merged.select(cases, MISSING)]
            if lacking or number not in there:
                what = "not complete" if number in there else "no such shard"
                listed = ", ".join(map(str, lacking[:SHOWN])) + (", ..." if len(lacking) > SHOWN else "")
                how = command(self._words, "--out", self.files.folder, "--shard", f"{number}/{shards}", "--resume")
                rows = f"{counted(len(lacking), 'row')} missing" + (f" ({listed})" if lacking else "")
                found.append(f"{self.files.shard(number, shards)}: {what}, {rows}: {how}")
        return found


def _take(path, merged):
    """Add the rows of a shard that are as they were written to a store; list of lines why they do not belong to it."""
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
    found = differences(identity, merged.identity)
    changed = [part for part in ("vary", "find", "columns") if identity.get(part) != merged.identity.get(part)]
    found += [f"{part}: not as now" for part in changed]
    return [f"{path}: {line}" for line in found]
