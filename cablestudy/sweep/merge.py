"""Shards of a study joined into its table."""

from contextlib import ExitStack, closing

from cablestudy.errors import SceneError
from cablestudy.sweep.fingerprint import differences, digest
from cablestudy.sweep.opening import merged, read_journal
from cablestudy.sweep.run import Run, Wish, command

SHOWN = 10  # missing rows that are named


class MergedRun(Run):
    """A run whose rows come from the shards of its study.

    Parameters
    ----------
    study : Study
    place : Place
    words : sequence of str
        The command that computes the study, for hints; `--shard` is added.
    quiet : bool
    """

    def __init__(self, study, place, words, quiet=False):
        super().__init__(study, place, Wish(keep=True, quiet=quiet))
        self._words = words

    def _open(self):
        """The rows of all shards as one journal.

        Raises
        ------
        SceneError
            No shards, shards of another study or version, or rows that are missing: which, and how to get them.
        """
        shards = self.place.shards()
        if not shards:
            nothing = "no shards there ('cablestudy sweep --shard K/N' makes them)"
            raise SceneError(f"{self.place.shard('K', 'N')}: {nothing}")
        counts = sorted({count for _, count in shards})
        if len(counts) > 1:
            kinds = " and of ".join(map(str, counts))
            raise SceneError(f"--out {self.place.folder}: shards of {kinds} lie there: move one kind away")
        with ExitStack() as stack:
            journals, mistakes = {}, []
            for (number, _), path in shards.items():
                journals[number] = stack.enter_context(closing(read_journal(path, self.study.count)))
                mistakes += _foreign(journals[number], self.identity)
            mistakes = mistakes or self._missing(counts[0], journals)
            if mistakes:
                raise SceneError(*mistakes)
            return merged(self.place.rows, self.identity, self.study.count, journals.values())

    def _missing(self, shards, journals):
        """What is missing of each shard, and how to get it."""
        found = []
        for number in range(1, shards + 1):
            journal, cases = journals.get(number), range(number - 1, self.study.count, shards)
            lacking = [case + 1 for case in cases if journal is None or case not in journal]
            if lacking or journal is None:
                what = "no such shard" if journal is None else "not complete"
                listed = ", ".join(map(str, lacking[:SHOWN])) + (", ..." if len(lacking) > SHOWN else "")
                how = command(self._words, "--out", self.place.folder, "--shard", f"{number}/{shards}", "--resume")
                rows = f"{len(lacking)} row{'s' * (len(lacking) != 1)} missing" + (f" ({listed})" if lacking else "")
                found.append(f"{self.place.shard(number, shards)}: {what}, {rows}: {how}")
        return found


def _foreign(journal, identity):
    """Why the rows of a shard do not belong to a study."""
    if digest(journal.identity) == digest(identity):
        return []
    found = differences(journal.identity, identity)
    found += [f"{part}: not as now" for part in ("vary", "columns") if journal.identity.get(part) != identity[part]]
    return [f"{journal.path}: {line}" for line in found]
