"""Shards of a study joined into its table."""

from contextlib import closing

from cablestudy.errors import SceneError
from cablestudy.sweep.fingerprint import differences, digest
from cablestudy.sweep.run import Options, Run, command
from cablestudy.sweep.store_files import merged_store, read_store

SHOWN = 10  # missing rows that are named


class MergedRun(Run):
    """A run whose rows come from the shards of its study.

    Parameters
    ----------
    study : Study
    files : TableFiles
    words : sequence of str
        The command that computes the study, for hints; `--shard` is added.
    quiet : bool
    """

    def __init__(self, study, files, words, quiet=False):
        super().__init__(study, files, Options(keep=True, quiet=quiet))
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
        stores, mistakes = {}, []
        for (number, _), path in shards.items():
            with closing(read_store(path, self.study.count)) as store:
                mistakes += _foreign(store, self.identity)
            stores[number] = store
        mistakes = mistakes or self._missing(counts[0], stores)
        if mistakes:
            raise SceneError(*mistakes)
        return merged_store(self.path, self.identity, self.study.count, shards.values())

    def _missing(self, shards, stores):
        """What is missing of each shard, and how to get it."""
        found = []
        for number in range(1, shards + 1):
            store, cases = stores.get(number), range(number - 1, self.study.count, shards)
            lacking = [case + 1 for case in cases if store is None or case not in store]
            if lacking or store is None:
                what = "no such shard" if store is None else "not complete"
                listed = ", ".join(map(str, lacking[:SHOWN])) + (", ..." if len(lacking) > SHOWN else "")
                how = command(self._words, "--out", self.files.folder, "--shard", f"{number}/{shards}", "--resume")
                rows = f"{len(lacking)} row{'s' * (len(lacking) != 1)} missing" + (f" ({listed})" if lacking else "")
                found.append(f"{self.files.shard(number, shards)}: {what}, {rows}: {how}")
        return found


def _foreign(store, identity):
    """Why the rows of a shard do not belong to a study: list of lines."""
    if digest(store.identity) == digest(identity):
        return []
    found = differences(store.identity, identity)
    found += [f"{part}: not as now" for part in ("vary", "columns") if store.identity[part] != identity[part]]
    return [f"{store.path}: {line}" for line in found]
