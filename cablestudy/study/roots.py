"""All places where a function of one number is zero: a scan, its gaps and extrema refined, and Brent's method."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, isnan, log2, log10

import numpy as np

from cablestudy.study.tolerances import STUDY


@dataclass(frozen=True)
class Effort:
    """How much a function may cost.

    Attributes
    ----------
    points : int
        On each side in a range of about a decade.
    steps : int
        Halvings of each gap between what has a value and what has none, and steps of each search for an extremum.
    rtol : float
        To which a zero is found, relative.
    reach : float
        Largest factor between the start and a place that is tried, see `ranges_about`.
    noise : float
        Error of the function where it should be zero: a zero leaves no more than that.
    scale : float
        Size of the numbers whose difference the function is: what differs less than its rounding is equal.
    parts : int
        Into which the gap between what has a value and what has none is divided at once.
    costly : bool
        Whether such gaps are left alone where the function is far from zero, and jumps found as finely as their ends.
    """

    points: int
    steps: int
    rtol: float = 1e-13
    reach: float = np.inf
    noise: float = 0.0
    scale: float = 0.0
    parts: int = 2
    costly: bool = False

    def equal(self, values):
        """True if values of the function are equal but for rounding; of fewer than two nothing is known."""
        return len(values) > 1 and np.ptp(values) <= STUDY.constant_spread * (np.abs(values).max() + self.scale)


@dataclass(frozen=True)
class Zeros:
    """Zeros that a search has found.

    Attributes
    ----------
    places : list of float
        Of the zeros, rising.
    jumps : list of float
        Where the function changes its sign without being zero, rising.
    plateaus : list of (float, float)
        Between which places tried the function stays zero; only the first place of each is among the zeros.
    gaps : list of (float, float)
        Between places of which one has a value and one has none, rising: what was left alone of a costly function.
    low, high : float
        Ends of the range that was searched.
    known : tuple of ndarray
        Places that have a value, rising, and the values, each of shape (k,).
    constant : bool
        Whether the function has one value wherever it has any.
    """

    places: list
    jumps: list
    plateaus: list
    gaps: list
    low: float
    high: float
    known: tuple
    constant: bool


class _NoValueError(Exception):
    """The function has no value within a bracket."""


class _JumpFoundError(Exception):
    """A costly function jumps over zero."""


class _SignFoundError(Exception):
    """An extremum lies beyond zero."""


# ---------------------------------------------------------------------------------------------------- what is tried


def ranges_about(start, low, high, points, reach=np.inf):
    """Yield places to try about a start, each time beyond those before, in the end up to both limits or the reach.

    Parameters
    ----------
    start : float
        From low to high.
    low, high : float
        Limits. Where low is not negative the ranges grow by factors of the start, else by distances from it.
    points : int
        On each side, in a range of about a decade.
    reach : float
        Largest factor or, in units of the start, distance.

    Yields
    ------
    list of ndarray
        Of the side below, and of that above.
    """
    signed = low < 0
    if not signed and start == 0:
        yield [np.array([]), places_between(low, high, points)]
        return
    size = (abs(start) or min(1.0, (high - low) / 8)) if signed else start
    before = start, start
    for factor in (factor for factor in STUDY.range_factors if factor <= reach):
        away = size * factor
        ends = (max(low, start - away if signed else start / factor), min(high, start + away if signed else away))
        sides = [_side(start, *pair, signed, points) for pair in zip(before, ends, strict=True)]
        if before == (start, start):
            sides = [np.append(side, start) for side in sides]
        if any(map(len, sides)):
            yield sides
        before = ends


def _side(start, near, far, signed, points):
    """Places beyond one end of a range up to the end of the next."""
    if near == far:
        return np.array([])
    if not signed:
        return _geometric(near, far, points)[1:]
    if near == start:
        return np.linspace(near, far, points + 1)[1:]
    return start + _geometric(near - start, far - start, points)[1:]


def _geometric(near, far, points):
    """Places at equal ratios between two of one sign; zero at the far end is one more."""
    last = far or near * STUDY.least_positive
    count = max(points, min(STUDY.many_decades * points, round(points * abs(log10(last / near)) / 2)))
    places = np.geomspace(near, last, count + 1)
    return np.append(places, 0.0) if far == 0 else np.append(places[:-1], far)


def places_between(low, high, points):
    """Places between two limits, both among them: at equal ratios over more than a factor of four, else at equal steps.

    Parameters as of `ranges_about`.

    Returns
    -------
    ndarray
    """
    if low >= 0 and high > 4 * low:
        return _geometric(high, low, STUDY.many_decades * points)[::-1]
    return np.linspace(low, high, STUDY.many_decades * points + 1)


# --------------------------------------------------------------------------------------------------------- the search


def zeros(function, ranges, effort, enclose=False, cheaper=None):
    """Search ranges one after the other until one has a zero, and then for all zeros in it.

    A side of a range that has no value anywhere ends the search on that side, once there are values elsewhere. Two
    zeros between neighbouring places are found by way of the extremum between them, unless they are so close that the
    values about them do not tell.

    Parameters
    ----------
    function : callable
        ndarray of shape (n,) -> ndarray of shape (n,), NaN where there is no value.
    ranges : iterable of list of ndarray
        Places of each side, see `ranges_about`.
    effort : Effort
    enclose : bool
        Whether the search goes on until the function is negative, or has no value, at both ends of what was tried.
    cheaper : callable, optional
        Two places -> cheaper function of one place, tried first between them: its zero is taken where the function has
        the same value.

    Returns
    -------
    Zeros
    """
    scan = _Scan(function, effort, cheaper)
    ended_sides = set()
    for sides in ranges:
        open_sides = {number: places for number, places in enumerate(sides) if number not in ended_sides}
        if not open_sides:
            break
        scan.evaluate(np.concatenate(list(open_sides.values())))
        if len(scan.finite()[0]):
            ended_sides |= {number for number, places in open_sides.items() if all(map(isnan, map(scan.value, places)))}
        found, jumps = scan.search()
        if found and not (enclose and scan.rises_to_an_end()):
            break
    if not found and not (jumps and effort.costly):
        scan.approach_zero()  # there may be a zero, else a message names how close the function comes
        found, jumps = scan.search()
    with_values = scan.finite()
    ends = min(scan.tried), max(scan.tried)
    return Zeros(found, jumps, scan.plateaus, scan.gaps_left(), *ends, with_values, effort.equal(with_values[1]))


class _Scan:
    """Places where the function was evaluated, and what is found between them."""

    def __init__(self, function, effort, cheaper):
        self._function, self._effort, self._cheaper = function, effort, cheaper
        self.tried = {}  # place -> value, NaN where there is none; what the search looks at
        self._others = {}  # the same of places about a zero
        self.plateaus = []

    def evaluate(self, places):
        """Evaluate the function at places where it was not yet."""
        new = [place for place in dict.fromkeys(np.asarray(places, dtype=float).tolist()) if place not in self.tried]
        if new:
            values = np.asarray(self._function(np.array(new)), dtype=float)
            self.tried.update(zip(new, values.tolist(), strict=True))

    def value(self, place):
        """The function at a place about a zero."""
        if place not in self.tried and place not in self._others:
            self._others[place] = float(self._function(np.array([place]))[0])
        return self.tried.get(place, self._others.get(place))

    def finite(self):
        """Places that have a value, rising, and the values: two arrays of shape (k,)."""
        known = sorted((place, value) for place, value in self.tried.items() if not isnan(value))
        return tuple(np.array(known).reshape(-1, 2).T)

    def rises_to_an_end(self):
        """True if the function is positive at the lowest or the highest place tried."""
        return any(self.tried[end(self.tried)] > 0 for end in (min, max))

    def search(self):
        """The zeros and jumps between the places tried: two lists of places, rising."""
        for _ in range(STUDY.bracket_rounds):
            self._refine_edges()
            self._refine_extrema()
            try:
                return self._zeros()
            except _NoValueError:
                continue  # the place without a value is among those tried now
        return [], []

    def _refine_edges(self):
        """Divide each gap between a place that has a value and a neighbour that has none."""
        parts = self._effort.parts
        for _ in range(ceil(self._effort.steps / log2(parts))):
            wide = [gap for gap, may_cross in self._gaps() if may_cross]
            if not wide:
                return
            self.evaluate([_way(a, b)(part / parts) for a, b in wide for part in range(1, parts)])

    def gaps_left(self):
        """Gaps between a place that has a value and one that has none that were not divided."""
        return [gap for gap, may_cross in self._gaps() if not may_cross]

    def _gaps(self):
        """Yield each wide gap between a place with a value and a neighbour without one, and if it may hold a zero."""
        known = sorted(self.tried.items())
        for k, ((a, f), (b, g)) in enumerate(pairwise(known)):
            if isnan(f) != isnan(g) and b - a > STUDY.edge * max(abs(a), abs(b)):
                yield (a, b), self._may_cross(known, k)

    def _may_cross(self, known, k):
        """Whether a zero may lie between places k and k + 1 of `known`, one of which has no value.

        Of a costly function that is so where its last change, carried on, comes near to zero in this gap.
        """
        last, before = (k, k - 1) if isnan(known[k + 1][1]) else (k + 1, k + 2)
        if not (self._effort.costly and 0 <= before < len(known)) or isnan(known[before][1]):
            return True
        (place, value), (other, earlier) = known[last], known[before]
        carried = (value - earlier) * (known[k + 1][0] - known[k][0]) / abs(place - other)
        return value * carried <= 0 and abs(value) <= STUDY.bends * abs(carried)

    def _refine_extrema(self):
        """Where the function comes closest to zero between its neighbours there may be two zeros, or one."""
        places, values = self.finite()
        if self._effort.equal(values):
            return
        size, sign = np.abs(values), np.sign(values)
        for k in range(1, len(places) - 1):
            around = max(size[k - 1], size[k + 1])
            least = size[k] <= min(size[k - 1], size[k + 1]) and (sign[k - 1 : k + 2] == sign[k]).all()
            if least and around >= 2 * size[k] > 0:  # else the extremum is too far from zero
                self._minimise(places[k - 1], places[k + 1], sign[k])

    def approach_zero(self):
        """Search for the extremum about the place where the function is closest to zero, for a message to name it."""
        places, values = self.finite()
        k = int(np.argmin(np.abs(values))) if len(places) else 0
        if 0 < k < len(places) - 1 and not self._effort.equal(values):
            self._minimise(places[k - 1], places[k + 1], np.sign(values[k]))

    def _minimise(self, low, high, sign):
        """Search for the extremum between two places, until the sign changes; what is tried is kept."""
        from scipy.optimize import minimize_scalar

        place_at = _way(low, high)
        farthest = np.abs(self.finite()[1]).max()  # finite, unlike inf: the search fits parabolas

        def distance(part):
            place = place_at(part)
            self.evaluate([place])
            value = sign * self.tried[place]
            if value <= 0:
                raise _SignFoundError
            return farthest if isnan(value) else value

        try:
            options = {"maxiter": self._effort.steps, "xatol": STUDY.edge}
            minimize_scalar(distance, bounds=(0.0, 1.0), method="bounded", options=options)
        except _SignFoundError:
            pass

    def _zeros(self):
        """The zeros and jumps between neighbouring places that have values."""
        if self._effort.equal(self.finite()[1]):
            return [], []
        least = STUDY.constant_spread * self._effort.scale
        known = [(place, 0.0 if abs(value) <= least else value) for place, value in sorted(self.tried.items())]
        jumps, found = [], [known[0][0]] if known[0][1] == 0 else []
        self.plateaus = []
        for (a, f), (b, g) in pairwise(known):
            if f == g == 0:  # it stays at zero: one zero, where that begins
                begin = self.plateaus.pop()[0] if self.plateaus and self.plateaus[-1][1] == a else a
                self.plateaus.append((begin, b))
            elif g == 0:
                found.append(b)
            elif f * g < 0:
                try:
                    place = self._brent(a, b)
                except _JumpFoundError as jump:
                    jumps.append(jump.args[0])
                    continue
                continuous = abs(self.value(place)) <= max(STUDY.jump * abs(g - f), self._effort.noise)
                (found if continuous else jumps).append(place)
        return sorted(found), sorted(jumps)

    def _brent(self, low, high):
        """Where the function changes its sign between two places of different sign."""
        if cheaper := self._cheaper and self._cheaper(low, high):
            try:
                place = self._bracketed(cheaper, low, high)
                if self.value(place) == cheaper(place):
                    return place
            except (_NoValueError, _JumpFoundError):
                pass
        try:
            return self._bracketed(self.value, low, high)
        except _NoValueError as none:
            self.tried[none.args[0]] = np.nan
            raise

    def _bracketed(self, function, low, high):
        """Where a function changes its sign between two places of different sign, by Brent's method."""
        from scipy.optimize import brentq

        place_at, ends, known = _way(low, high), {}, {low: self.value(low), high: self.value(high)}

        def value(part):
            place = place_at(part)
            number = known[place] if place in known else function(place)
            if isnan(number):
                raise _NoValueError(place)
            ends[number > 0] = place, number
            if self._effort.costly and len(ends) == 2:
                (a, f), (b, g) = ends.values()
                if abs(b - a) <= STUDY.edge * max(abs(a), abs(b)) and abs(g - f) >= STUDY.abrupt * abs(change):
                    raise _JumpFoundError(place)
            return number

        change = known[high] - known[low]
        return place_at(brentq(value, 0.0, 1.0, xtol=1e-15, rtol=self._effort.rtol, maxiter=500))


def _way(low, high):
    """Function of a part of the way, from 0 to 1, to a place between two: at equal ratios where they are far apart."""

    def place_at(part):
        if part in (0.0, 1.0):
            return high if part else low
        if low > 0 and high > 4 * low:
            return float(low * (high / low) ** part)
        return float(low + (high - low) * part)

    return place_at
