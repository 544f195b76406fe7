"""All zeros of a function of one number x: a scan, its gaps and extrema refined, and Brent's method."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, isnan, log2, log10

import numpy as np

from cablestudy.study.tolerances import STUDY


@dataclass(frozen=True)
class Effort:
    """Effort of a search for zeros, by the cost and the error of the function."""

    points: int  # on each side, in a range of about a decade
    steps: int  # halvings of each gap between a point with a value and one without, and of a search for an extremum
    rtol: float = 1e-13  # relative tolerance of a zero
    reach: float = np.inf  # largest factor between the start and a point that is tried, see `ranges_about`
    noise: float = 0.0  # error of the function: at a zero the size of its value is at most this error
    scale: float = 0.0  # size of the numbers whose difference the function is: values within their rounding are equal
    parts: int = 2  # into which the gap between a point with a value and one without is divided at once
    # whether such gaps are left alone where the function is far from zero, and jumps found as finely as their ends
    costly: bool = False

    def equal(self, values):
        """True if two or more values of the function are equal except for rounding."""
        return len(values) > 1 and np.ptp(values) <= STUDY.constant_spread * (np.abs(values).max() + self.scale)


@dataclass(frozen=True)
class Zeros:
    """Zeros that a search has found."""

    roots: list  # of float: the zeros, rising
    jumps: list  # of float: points at which the function changes its sign without being zero, rising
    plateaus: list  # of (float, float): where the function stays zero; only the first point of each is a zero
    gaps: list  # of (float, float): with a value at one end and none at the other, rising; not searched further
    low: float  # ends of the range that was searched
    high: float
    evaluated: tuple  # points that have a value, rising, and the values: ndarrays of shape (k,)
    constant: bool  # whether the function has one value wherever it has any


class _NoValueError(Exception):
    """The function has no value within a bracket."""


class _JumpFoundError(Exception):
    """A costly function jumps over zero."""


class _SignFoundError(Exception):
    """An extremum lies beyond zero."""


# ------------------------------------------------------------------------------------------------ points to try


def ranges_about(start, low, high, count, reach=np.inf):
    """Yield growing ranges about a start, as points to try: a search stops at the first range that has a zero.

    There is a range for each factor k of `STUDY.range_factors` up to `reach`, within `low` and `high`. If low >= 0, it
    is from start/k to k start; for start = 0 the only range is then from `low` to `high`. If low < 0, it is from
    start - k s to start + k s, with s = |start|, or s = min(1, (high - low)/8) for start = 0. A range yields only its
    points beyond the range before.

    Parameters
    ----------
    start : float
        Point from low to high.
    low, high : float
        Limits of the points.
    count : int
        Number of points on each side, in a range of about a decade.
    reach : float
        Largest k.

    Yields
    ------
    list of ndarray
        Points of the range below the start, and above it.
    """
    signed = low < 0
    if not signed and start == 0:
        yield [np.array([]), points_between(low, high, count)]
        return
    size = (abs(start) or min(1.0, (high - low) / 8)) if signed else start
    previous_ends = start, start
    for factor in (factor for factor in STUDY.range_factors if factor <= reach):
        distance = size * factor
        below, above = (start - distance, start + distance) if signed else (start / factor, distance)
        ends = max(low, below), min(high, above)
        sides = [_side(start, *pair, signed, count) for pair in zip(previous_ends, ends, strict=True)]
        if previous_ends == (start, start):
            sides = [np.append(side, start) for side in sides]
        if any(map(len, sides)):
            yield sides
        previous_ends = ends


def _side(start, near, far, signed, count):
    """Points beyond one end of a range up to the end of the next."""
    if near == far:
        return np.array([])
    if not signed:
        return _geometric(near, far, count)[1:]
    if near == start:
        return np.linspace(near, far, count + 1)[1:]
    return start + _geometric(near - start, far - start, count)[1:]


def _geometric(near, far, count):
    """Points at equal ratios between two numbers of one sign; zero at the far end is one more."""
    end = far or near * STUDY.least_positive
    intervals = max(count, min(STUDY.many_decades * count, round(count * abs(log10(end / near)) / 2)))
    points = np.geomspace(near, end, intervals + 1)
    return np.append(points, 0.0) if far == 0 else np.append(points[:-1], far)


def points_between(low, high, count):
    """Points between two limits, both among them: at equal ratios over more than a factor of four, else at equal steps.

    Parameters are those of `ranges_about`.

    Returns
    -------
    ndarray
    """
    if low >= 0 and high > 4 * low:
        return _geometric(high, low, STUDY.many_decades * count)[::-1]
    return np.linspace(low, high, STUDY.many_decades * count + 1)


# --------------------------------------------------------------------------------------------------------- the search


def find_zeros(function, ranges, effort, enclose=False):
    """Find all zeros of a function f of one number, in growing ranges up to the first range that has any.

    In each range f is evaluated at the points; gaps between points with and without a value are divided; |f| is
    minimised where two close zeros may hide; Brent's method locates the zero at each change of sign. A range has two
    sides, below and above the start of the search. A side without any value is not extended further once there are
    values elsewhere.

    Parameters
    ----------
    function : callable
        f: ndarray of shape (n,) -> ndarray of shape (n,), NaN where there is no value.
    ranges : iterable of list of ndarray
        For each range the points below the start, and those above it.
    effort : Effort
        Numbers of points and steps, and tolerances.
    enclose : bool
        Whether ranges are extended until f is negative, or has no value, at both ends.

    Returns
    -------
    Zeros
        The zeros, jumps of f over zero, and what was searched.
    """
    scan = _Scan(function, effort)
    ended_sides = set()
    for sides in ranges:
        open_sides = {side: points for side, points in enumerate(sides) if side not in ended_sides}
        if not open_sides:
            break
        scan.evaluate(np.concatenate(list(open_sides.values())))
        if len(scan.finite()[0]):
            ended_sides |= {side for side, points in open_sides.items() if all(map(isnan, map(scan.value, points)))}
        roots, jumps = scan.search()
        if roots and not (enclose and scan.rises_to_an_end()):
            break
    if not roots and not (jumps and effort.costly):
        scan.approach_zero()  # there may be a zero, else a message names how close the function comes
        roots, jumps = scan.search()
    evaluated = scan.finite()
    ends = min(scan.tried), max(scan.tried)
    return Zeros(roots, jumps, scan.plateaus, scan.gaps_left(), *ends, evaluated, effort.equal(evaluated[1]))


class _Scan:
    """Points x at which a function f was evaluated, and the zeros, jumps and plateaus of f between them."""

    def __init__(self, function, effort):
        self._function, self._effort = function, effort
        self.tried = {}  # x -> value, NaN where there is none; the points between which is searched
        self._near_zeros = {}  # likewise, of points that were evaluated on the way to a zero
        self.plateaus = []

    def evaluate(self, points):
        """Evaluate the function at those points where it was not evaluated yet."""
        new = [x for x in dict.fromkeys(np.asarray(points, dtype=float).tolist()) if x not in self.tried]
        if new:
            values = np.asarray(self._function(np.array(new)), dtype=float)
            self.tried.update(zip(new, values.tolist(), strict=True))

    def value(self, x):
        """The function at a point on the way to a zero."""
        if x not in self.tried and x not in self._near_zeros:
            self._near_zeros[x] = float(self._function(np.array([x]))[0])
        return self.tried.get(x, self._near_zeros.get(x))

    def finite(self):
        """Points that have a value, rising, and the values: two arrays of shape (k,)."""
        finite = sorted((x, value) for x, value in self.tried.items() if not isnan(value))
        return tuple(np.array(finite).reshape(-1, 2).T)

    def rises_to_an_end(self):
        """True if the function is positive at the lowest or the highest point tried."""
        return any(self.tried[end(self.tried)] > 0 for end in (min, max))

    def search(self):
        """The zeros and jumps between the points tried: two lists of numbers, rising."""
        for _ in range(STUDY.bracket_rounds):
            self._refine_edges()
            self._refine_extrema()
            try:
                return self._roots_and_jumps()
            except _NoValueError:
                continue  # the point without a value is among those tried now
        return [], []

    def _refine_edges(self):
        """Divide each gap between a point that has a value and a neighbour that has none."""
        parts = self._effort.parts
        for _ in range(ceil(self._effort.steps / log2(parts))):
            wide = [gap for gap, may_cross in self._gaps() if may_cross]
            if not wide:
                return
            self.evaluate([_interpolation(a, b)(k / parts) for a, b in wide for k in range(1, parts)])

    def gaps_left(self):
        """Gaps between a point that has a value and one that has none that were not divided."""
        return [gap for gap, may_cross in self._gaps() if not may_cross]

    def _gaps(self):
        """Yield each wide gap between a point with a value and a neighbour without one, and if it may hold a zero."""
        tried = sorted(self.tried.items())
        for k, ((a, f), (b, g)) in enumerate(pairwise(tried)):
            if isnan(f) != isnan(g) and b - a > STUDY.edge * max(abs(a), abs(b)):
                yield (a, b), self._may_cross(tried, k)

    def _may_cross(self, tried, k):
        """True if a zero may lie between points k and k + 1 of `tried`, one of which has no value.

        Of a costly function that is so where its last change, extrapolated, comes near to zero in this gap.
        """
        nearer, farther = (k, k - 1) if isnan(tried[k + 1][1]) else (k + 1, k + 2)
        if not (self._effort.costly and 0 <= farther < len(tried)) or isnan(tried[farther][1]):
            return True
        (x, value), (x_before, value_before) = tried[nearer], tried[farther]
        extrapolated = (value - value_before) * (tried[k + 1][0] - tried[k][0]) / abs(x - x_before)
        return value * extrapolated <= 0 and abs(value) <= STUDY.bends * abs(extrapolated)

    def _refine_extrema(self):
        """Minimise the distance from zero about each point closer to it than its neighbours: two zeros may be there."""
        points, values = self.finite()
        if self._effort.equal(values):
            return
        size, sign = np.abs(values), np.sign(values)
        for k in range(1, len(points) - 1):
            larger_neighbour = max(size[k - 1], size[k + 1])
            is_minimum = size[k] <= min(size[k - 1], size[k + 1]) and (sign[k - 1 : k + 2] == sign[k]).all()
            if is_minimum and larger_neighbour >= 2 * size[k] > 0:  # else the extremum is too far from zero
                self._search_between_equal_signs(points[k - 1], points[k + 1], sign[k])

    def approach_zero(self):
        """Search for the extremum about the point where the function is closest to zero, for a message to name it."""
        points, values = self.finite()
        k = int(np.argmin(np.abs(values))) if len(points) else 0
        if 0 < k < len(points) - 1 and not self._effort.equal(values):
            self._search_between_equal_signs(points[k - 1], points[k + 1], np.sign(values[k]))

    def _search_between_equal_signs(self, low, high, sign):
        """Look for two close zeros of f between two points where f has the same sign, by minimising |f| between them.

        The search stops at the first point where f is zero or has the other sign. All points are kept in `tried`, where
        `_roots_and_jumps` then finds a change of sign on each side of such a point.
        """
        from scipy.optimize import minimize_scalar

        point_at = _interpolation(low, high)
        without_value = np.abs(self.finite()[1]).max()  # finite, unlike inf: the search fits parabolas

        def signed_value(fraction):
            x = point_at(fraction)
            self.evaluate([x])
            value = sign * self.tried[x]
            if value <= 0:
                raise _SignFoundError
            return without_value if isnan(value) else value

        try:
            options = {"maxiter": self._effort.steps, "xatol": STUDY.edge}
            minimize_scalar(signed_value, bounds=(0.0, 1.0), method="bounded", options=options)
        except _SignFoundError:
            pass

    def _roots_and_jumps(self):
        """Zeros of f and its jumps over zero between points that have values: two rising lists. Sets `plateaus`.

        A change of sign is a jump where f is not small at the point that Brent's method finds.
        """
        if self._effort.equal(self.finite()[1]):
            return [], []
        least = STUDY.constant_spread * self._effort.scale
        tried = [(x, 0.0 if abs(value) <= least else value) for x, value in sorted(self.tried.items())]
        jumps, roots = [], [tried[0][0]] if tried[0][1] == 0 else []
        self.plateaus = []
        for (a, f), (b, g) in pairwise(tried):
            if f == g == 0:  # it stays at zero: one zero, where that begins
                start = self.plateaus.pop()[0] if self.plateaus and self.plateaus[-1][1] == a else a
                self.plateaus.append((start, b))
            elif g == 0:
                roots.append(b)
            elif f * g < 0:
                try:
                    x = self._root_between(a, b)
                except _JumpFoundError as jump:
                    jumps.append(jump.args[0])
                    continue
                is_zero = abs(self.value(x)) <= max(STUDY.jump * abs(g - f), self._effort.noise)
                (roots if is_zero else jumps).append(x)
        return sorted(roots), sorted(jumps)

    def _root_between(self, low, high):
        """Point between `low` and `high`, where f has different signs, at which f changes its sign: by Brent's method.

        _NoValueError where f has no value at a point on the way, which is added to `tried`; _JumpFoundError where a
        costly f jumps over zero: in a narrow bracket its values still differ much. This saves evaluations.
        """
        from scipy.optimize import brentq

        point_at, change = _interpolation(low, high), self.value(high) - self.value(low)
        ends = {}  # True (positive) or False -> last point where the function has this sign, and its value there

        def value(fraction):
            x = point_at(fraction)
            number = self.value(x)
            if isnan(number):
                self.tried[x] = number
                raise _NoValueError
            ends[number > 0] = x, number
            if self._effort.costly and len(ends) == 2:
                (a, f), (b, g) = ends.values()
                if abs(b - a) <= STUDY.edge * max(abs(a), abs(b)) and abs(g - f) >= STUDY.abrupt * abs(change):
                    raise _JumpFoundError(x)
            return number

        return point_at(brentq(value, 0.0, 1.0, xtol=1e-15, rtol=self._effort.rtol, maxiter=500))


def _interpolation(low, high):
    """Function of a fraction, from 0 to 1, to a point between two: at equal ratios where they are far apart."""

    def point_at(fraction):
        if fraction in (0.0, 1.0):
            return high if fraction else low
        if low > 0 and high > 4 * low:
            return float(low * (high / low) ** fraction)
        return float(low + (high - low) * fraction)

    return point_at
