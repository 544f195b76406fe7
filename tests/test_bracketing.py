"""`cable/bracketing.py`: the numbers of scipy.optimize.elementwise to the last digit, and zeros that are known."""

import numpy as np
import pytest
from scipy.optimize import elementwise

from cablestudy.cable.bracketing import bracket, minima_between, zeros_between

COUNT = 400
NOTHING = {"xatol": 0.0, "frtol": 0.0}


def family(seed):
    """Functions of one number, some flat, steep, with a pole, nearly a step or without a zero; parameters (n, 4)."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, COUNT)) * 10.0 ** rng.integers(-6, 6, COUNT)
    kind = rng.integers(0, 6, COUNT)

    def function(x, index):
        shift, scale, more = a[index], 1 + np.abs(b[index]), c[index]
        y = (x - shift) / scale
        with np.errstate(all="ignore"):
            forms = [
                y,
                y**3 + 1e-3 * y,
                np.expm1(np.minimum(y, 50.0)),
                np.arctan(1e6 * y),
                1 / y,
                y**2 + np.abs(more) + 1e-3,
            ]
        return np.select([kind[index] == k for k in range(len(forms))], forms)

    return function, rng


@pytest.mark.parametrize("seed", range(6))
def test_zeros_are_those_of_scipy(seed):
    function, rng = family(seed)
    low = rng.normal(size=COUNT) * 10.0 ** rng.integers(-3, 7, COUNT)
    high = low + np.abs(rng.normal(size=COUNT)) * 10.0 ** rng.integers(-3, 8, COUNT)
    every = np.arange(COUNT)
    expected = elementwise.find_root(function, (low, high), args=(every,)).x
    assert 0.1 * COUNT < np.isfinite(expected).sum() < COUNT
    np.testing.assert_array_equal(zeros_between(function, low, high, every), expected)
    close = NOTHING | {"xrtol": 5e-16, "fatol": 4e-16}
    expected = elementwise.find_root(function, (low, high), args=(every,), tolerances=close, maxiter=40).x
    np.testing.assert_array_equal(zeros_between(function, low, high, every, 5e-16, 4e-16, 40), expected)


@pytest.mark.parametrize("seed", range(6))
def test_brackets_are_those_of_scipy(seed):
    function, rng = family(seed)
    low = rng.normal(size=COUNT) * 10.0 ** rng.integers(-3, 5, COUNT)
    high = low + np.abs(rng.normal(size=COUNT)) * 10.0 ** rng.integers(-5, 3, COUNT)
    least, most = low - 10.0 ** rng.integers(-3, 7, COUNT), high + 10.0 ** rng.integers(-3, 7, COUNT)
    every = np.arange(COUNT)
    options = {"xmin": least, "xmax": most, "args": (every,), "maxiter": 16}
    expected = elementwise.bracket_root(function, low, high, **options)
    found, below, above = bracket(function, low, high, least, most, every, 16)
    assert 0.1 * COUNT < found.sum() < COUNT
    np.testing.assert_array_equal(found, expected.success)
    np.testing.assert_array_equal(below[found], expected.bracket[0][found])
    np.testing.assert_array_equal(above[found], expected.bracket[1][found])


@pytest.mark.parametrize("seed", range(6))
def test_minima_are_those_of_scipy(seed):
    rng = np.random.default_rng(seed)
    place, size = rng.normal(size=COUNT), 10.0 ** rng.integers(-6, 6, COUNT)
    kind, every = rng.integers(0, 5, COUNT), np.arange(COUNT)

    def function(x, index):
        y = (x - place[index]) * size[index]
        forms = [y**2, 1 - 1 / (1 + y**2), np.abs(y), -np.cos(np.minimum(np.abs(y), 3.0)), y**4 + np.sin(9 * y)]
        return np.select([kind[index] == k for k in range(len(forms))], forms)

    middle = place + rng.normal(size=COUNT) / size
    low, high = (middle + side * 3 * np.abs(rng.normal(size=COUNT)) / size for side in (-1, 1))
    for tolerances in ({}, {"xatol": 1e-7, "xrtol": 0.0, "frtol": 1e-14}):
        expected = elementwise.find_minimum(function, (low, middle, high), args=(every,), tolerances=tolerances)
        assert 0.1 * COUNT < np.isfinite(expected.x).sum() < COUNT
        found = minima_between(function, low, middle, high, every, *tolerances.values())
        np.testing.assert_array_equal(found, [expected.x, expected.f_x])


def test_no_value_is_no_zero():
    nothing = np.full(3, np.nan)
    every = np.arange(3)
    assert np.isnan(zeros_between(lambda x, _: x * np.nan, np.zeros(3), np.ones(3), every)).all()
    assert not bracket(lambda x, _: nothing, np.zeros(3), np.ones(3), -np.ones(3), 2 * np.ones(3), every, 16)[0].any()


def test_zeros_of_a_cosine():
    low = np.arange(5) * np.pi
    found = zeros_between(lambda x, _: np.cos(x), low, low + np.pi, np.arange(5))
    np.testing.assert_allclose(found, low + np.pi / 2, rtol=4e-16)
