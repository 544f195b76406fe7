"""The cases that are still to be computed, in chunks of about one second."""

import pickle
from itertools import chain, islice

from cablestudy.sweep.chunk import Chunk
from cablestudy.sweep.fingerprint import program

SECONDS = 1.0  # that a chunk should take
MOST = 5000  # cases in a chunk
GROWTH = 4  # at most so many times the last size


class Supply:
    """Hands out chunks, each case once, and learns from what comes back how large they should be.

    Parameters
    ----------
    study : Study
    kinds : sequence of (iterable of int, sequence of str)
        Cases from 0, and the columns that are to be computed of them.
    total : int
        How many cases that are.
    explain : bool

    Attributes
    ----------
    left : int
        Cases not yet handed out.
    size : int
        Cases of the next chunk.
    seconds_per_case : float or None
        As measured last.
    """

    def __init__(self, study, kinds, total, explain=False):
        self._pickled, self._explain = pickle.dumps(study), explain
        self._kinds = [(iter(cases), tuple(columns)) for cases, columns in kinds]
        self.left, self.size, self.seconds_per_case = total, 1, None

    def next(self, workers=1):
        """The next chunk, or None when there is none.

        Parameters
        ----------
        workers : int
            Towards the end chunks shrink, so that so many workers end together.
        """
        while self._kinds:
            cases, columns = self._kinds[0]
            share = -(-self.left // (2 * workers)) if workers > 1 else self.left
            taken = tuple(islice(cases, max(1, min(self.size, share))))
            if taken:
                self.left -= len(taken)
                return Chunk(self._pickled, program(), columns, taken, self._explain)
            self._kinds.pop(0)
        return None

    def learn(self, done):
        """Fit the size to a chunk that is done."""
        if not done.count:
            return
        self.seconds_per_case = max(done.seconds / done.count, 1e-9)
        wanted = SECONDS / self.seconds_per_case
        self.size = int(max(1, min(wanted, GROWTH * self.size, MOST)))

    def put_back(self, chunk):
        """Take back a chunk that was lost."""
        self.left += len(chunk.cases)
        if self._kinds and self._kinds[0][1] == chunk.columns:
            cases, columns = self._kinds[0]
            self._kinds[0] = (chain(chunk.cases, cases), columns)
        else:
            self._kinds.insert(0, (iter(chunk.cases), chunk.columns))
