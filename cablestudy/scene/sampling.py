"""Samples of the space of some keys: Sobol points, Latin hypercubes, Saltelli designs (scipy.stats.qmc)."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field

from cablestudy.scene.fields import Count, KeyTable
from cablestudy.scene.tolerances import SCENE

METHODS = ("sobol", "latin_hypercube", "saltelli")


class Sample(KeyTable):
    """The key `sample` of a study."""

    method: Literal[METHODS] = Field(
        description="sobol or latin_hypercube: count cases; saltelli: count x (keys + 2), for --sensitivity"
    )
    count: Annotated[int, Count(1, SCENE.cases)] = Field(
        description="How many points; a power of two is best for sobol and saltelli"
    )
    seed: Annotated[int, Count(0, 2**63 - 1)] = Field(0, description="The same seed gives the same points")
    over: dict[str, Any] = Field(min_length=1, description="Dotted key -> {from, to, spacing}")

    @property
    def pages(self):
        """Number of cases that follow from one point."""
        return len(self.over) + 2 if self.method == "saltelli" else 1

    @property
    def cases(self):
        """Number of cases."""
        return self.count * self.pages

    @property
    def dimension(self):
        """Numbers in a point: one for each key, two for the two independent samples of a Saltelli design. [-]"""
        return len(self.over) * (2 if self.method == "saltelli" else 1)

    def relations(self):
        """Check that the points fit into memory."""
        message = f"{self.count} points of {self.dimension} numbers (at most {SCENE.sampled_numbers} numbers)"
        yield [(("count",), self.count * self.dimension <= SCENE.sampled_numbers, message)]

    def points(self):
        """Points of the unit cube: ndarray, shape (count, dimension)."""
        return _points(self.method, self.count, self.dimension, self.seed)

    def coordinate(self, case, key):
        """Position in its interval, from 0 to 1, of a key (from 0) in one case or an array of cases.

        A Saltelli design has for each point, with a and b its halves, the cases a; a with the first number of b; a with
        the second; ...; b (Saltelli et al., 2010, Computer Physics Communications 181, 259).
        """
        point, page = divmod(case, self.pages)
        from_b = (self.method == "saltelli") & ((page == key + 1) | (page == self.pages - 1))
        return self.points()[point, key + len(self.over) * from_b]

    @property
    def notes(self):
        """Tuple of warnings."""
        if self.method == "latin_hypercube" or self.count & (self.count - 1) == 0:
            return ()
        power = 1 << self.count.bit_length()
        return (f"sample: {self.count} points; Sobol points are balanced for powers of two ({power // 2} or {power})",)


class Sampled(Sequence):
    """The values of one key of a sample, by its number from 0, in all cases; computed one by one.

    `written` are sample and key as plain values.
    """

    def __init__(self, sample, key, interval):
        self._sample, self._key, self._interval = sample, key, interval
        self.written = {"sample": sample.model_dump(), "key": key}

    def __len__(self):
        return self._sample.cases

    def __getitem__(self, index):
        if not 0 <= index < len(self):
            raise IndexError(index)
        return self._interval.between(float(self._sample.coordinate(index, self._key)))

    def at(self, cases):
        """List of the values in many cases, an ndarray of int."""
        return [self._interval.between(share) for share in self._sample.coordinate(cases, self._key).tolist()]

    def worth_checking(self, steps):
        """Set of the cases to check: evenly spread, and those of the smallest and the largest value."""
        pages, keys = self._sample.pages, len(self._sample.over)
        cases = {round(i * (len(self) - 1) / steps) for i in range(steps + 1)}
        points = self._sample.points()
        for column in range(self._key, self._sample.dimension, keys):  # of a Saltelli design one in a and one in b
            page = 0 if column < keys else pages - 1
            for point in (points[:, column].argmin(), points[:, column].argmax()):
                cases.add(int(point) * pages + page)
        return cases


@lru_cache(maxsize=2)
def _points(method, count, dimension, seed):
    """Points of the unit cube, shape (count, dimension); the only place that imports scipy.stats."""
    import warnings

    from numpy.random import default_rng
    from scipy.stats import qmc

    kind = qmc.LatinHypercube if method == "latin_hypercube" else qmc.Sobol
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # no power of two: `Sample.notes` says so
        return kind(dimension, rng=default_rng(seed)).random(count)
