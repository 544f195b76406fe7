"""All zeros of a function of one number: what a search finds, what it does not take for a zero, how far it looks."""

from dataclasses import replace

import numpy as np
import pytest

from cablestudy.study.roots import Effort, find_zeros, points_between, ranges_about

CHEAP, COSTLY = Effort(40, 40), Effort(8, 10, 1e-7, parts=8, costly=True)


def found(function, start, low, high, effort=CHEAP):
    with np.errstate(all="ignore"):
        return find_zeros(function, ranges_about(start, low, high, effort.points), effort)


@pytest.mark.parametrize("effort", [CHEAP, COSTLY])
@pytest.mark.parametrize(
    ("function", "start", "low", "high", "places"),
    [
        (lambda x: x - 2, 1, 1e-24, 1e24, [2]),
        (lambda x: x - 2e7, 1, 1e-24, 1e24, [2e7]),  # beyond the first ranges
        (lambda x: x - 3e-5, 1, 0, 1e6, [3e-5]),
        (lambda x: x, 1, 0, 1e6, [0]),  # at a limit
        (lambda x: x - 0.3, 0, -1e9, 1e9, [0.3]),
        (lambda x: x + 300, 1, -1e9, 1e9, [-300]),
        (lambda x: x - 2e-5, 0, 0, 2, [2e-5]),
        (lambda x: (x - 1.1) ** 2 - 1e-6, 1, 1e-9, 1e9, [1.099, 1.101]),  # between neighbours of the scan
        (lambda x: np.abs(x - 1) - 0.2, 1, 0, 100, [0.8, 1.2]),
        (lambda x: np.where(x < 3.3, np.nan, x - 3.3001), 1, 1e-9, 1e9, [3.3001]),  # beside the end of what has a value
    ],
)
def test_zeros(function, start, low, high, places, effort):
    assert found(function, start, low, high, effort).roots == pytest.approx(places, rel=1e-7, abs=1e-9)


def test_all_zeros_of_a_given_range():
    between = find_zeros(np.cos, [[points_between(1.0, 12.0, 40)]], CHEAP)
    assert between.roots == pytest.approx(np.pi * (np.arange(4) + 0.5), rel=1e-12)
    assert (between.low, between.high) == (1, 12)


@pytest.mark.parametrize(
    ("function", "jumps"),
    [
        (lambda x: 1 / (x - 1.5), [1.5]),  # a pole
        (lambda x: np.where(x < 1.5, -1.0, 2.0), [1.5]),
        (lambda x: (x - 1.1) ** 2 + 1e-3, []),
        (lambda x: np.where(abs(x - 1.5) < 0.3, np.nan, x - 1.5), []),  # no value about the zero
        (lambda x: np.nan * x, []),
    ],
)
def test_what_is_no_zero(function, jumps):
    nothing = found(function, 1, 1e-3, 1e3)
    assert nothing.roots == []
    assert nothing.jumps == pytest.approx(jumps, rel=1e-9)
    assert (nothing.low, nothing.high) == (1e-3, 1e3)


def test_the_least_distance_is_found_though_it_is_none():
    places, values = found(lambda x: (x - 1.1) ** 2 + 1e-3, 1, 1e-3, 1e3).evaluated
    least = np.argmin(values)
    assert (places[least], values[least]) == pytest.approx((1.1, 1e-3), rel=1e-5)


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_a_constant_has_no_zeros(value):
    constant = found(lambda x: np.full(len(x), value) + 1e-15 * np.sin(x), 1, 1e-3, 1e3, Effort(40, 40, scale=1.0))
    assert (constant.roots, constant.constant) == ([], True)


def test_a_side_without_values_is_left():
    seen = []

    def function(places):
        seen.extend(places)
        return np.where(places < 4, places + 1, np.nan)

    assert found(function, 1, 1e-9, 1e9).high == 1e3  # from 10 to 1000 there was none
    assert max(seen) == 1e3


def test_each_place_is_evaluated_once():
    seen = []

    def function(places):
        seen.extend(places.tolist())
        return places - 1.234567

    found(function, 1, 1e-9, 1e9)
    assert len(seen) == len(set(seen))


def test_a_function_that_stays_at_zero_has_one_zero_there():
    found = find_zeros(
        lambda x: np.minimum(x - 3.0, 0.0) * (1 + 1e-17), [[np.linspace(0.0, 8.0, 33)]], Effort(16, 20, scale=1.0)
    )
    assert found.roots == [3.0]
    assert found.plateaus == [(3.0, 8.0)]


def test_the_ends_of_what_a_costly_function_has_values_for_are_sought_where_a_zero_may_be():
    """A function without value above 2.05: where it goes away from zero that end is not sought."""
    calls = []

    def function(x):
        calls.append(len(x))
        return np.where(x > 2.05, np.nan, x - 1.1)

    assert found(function, 1, 1e-3, 1e3, COSTLY).roots == pytest.approx([1.1])
    assert len(calls) < 10
    near = found(lambda x: np.where(x > 2.05, np.nan, 2.049 - x), 1, 1e-3, 1e3, COSTLY)
    assert near.roots == pytest.approx([2.049], rel=1e-6)


@pytest.mark.parametrize("steep", [False, True])
def test_a_jump_of_a_costly_function_is_found_as_finely_as_the_end_of_its_values(steep):
    tried = []

    def function(x):
        tried.extend(np.atleast_1d(x).tolist())
        return x - 3 + (20 * np.tanh(1e5 * (x - np.pi)) if steep else 20 * np.sign(x - np.pi))

    result = found(function, 1.0, 1e-2, 1e2, replace(COSTLY, rtol=1e-12))
    if steep:  # but continuous
        assert (result.roots, result.jumps) == (pytest.approx([np.pi - (np.pi - 3) / 20 / 1e5], rel=1e-10), [])
    else:
        assert (result.roots, result.jumps) == ([], [pytest.approx(np.pi, rel=1e-6)])
        assert len(tried) < 80


def test_what_a_costly_search_leaves_alone_is_listed():
    def function(x):
        return np.where((x < 0.6) | (x > 40.0), np.nan, (x - 1.5) * (1 + x))

    result = found(function, 1.0, 1e-2, 1e2, COSTLY)
    assert result.roots == pytest.approx([1.5])
    ((low, high),) = result.gaps
    assert low < 0.6 < high
    assert not found(function, 1.0, 1e-2, 1e2).gaps


def test_no_value_about_the_place_nearest_to_zero():
    """The search for an extremum fits parabolas, which an infinite value would make not a number."""

    def dip(x):
        return np.where(abs(x - 1.3) < 0.1, np.nan, (x - 1.3) ** 2 + 0.02 + 0.01 * x)

    with np.errstate(all="raise"):
        assert find_zeros(dip, [[points_between(0.5, 3.0, 12)]], CHEAP).roots == []
