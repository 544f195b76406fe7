"""Numerical tools: zeros, minima and splines as by scipy, fixed points, vectors and matrices."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.optimize import elementwise

from cablestudy.cable.bracketing import minima_between, zeros_between
from cablestudy.cable.matrices import inverse, solved
from cablestudy.cable.segment import inverse_symmetric
from cablestudy.cable.vectors import cross, dot, largest, size, times
from cablestudy.wind.gusts import CardinalSplines
from cablestudy.wind.mean import next_argument

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
    every = np.arange(3)
    assert np.isnan(zeros_between(lambda x, _: x * np.nan, np.zeros(3), np.ones(3), every)).all()


def test_zeros_of_a_cosine():
    low = np.arange(5) * np.pi
    found = zeros_between(lambda x, _: np.cos(x), low, low + np.pi, np.arange(5))
    np.testing.assert_allclose(found, low + np.pi / 2, rtol=4e-16)


# splines


@pytest.mark.parametrize(("count", "degree"), [(36, 7), (6, 5), (8, 7), (25, 7), (200, 7), (12, 3)])
def test_splines_are_those_of_scipy(count, degree):
    rng = np.random.default_rng(count)
    for places in (np.linspace(-7.0, 9.0, count), np.cumsum(rng.uniform(0.5, 1.5, count))):
        splines, expected = CardinalSplines(places, degree), make_interp_spline(places, np.eye(count), k=degree)
        between = np.concatenate([places, rng.uniform(places[0], places[-1], 500)])
        np.testing.assert_allclose(splines(between), expected(between), atol=1e-12)


@pytest.mark.parametrize("degree", [3, 5, 7])
def test_polynomials_are_met(degree):
    places = np.linspace(0.3, 2.0, 20)
    splines, between = CardinalSplines(places, degree), np.linspace(0.3, 2.0, 77)
    assert splines(between) @ places**degree == pytest.approx(between**degree, rel=1e-12)


# acceleration of fixed-point iterations


def linear_steps(seed, count):
    """Arguments and values of `count` steps of x = A x + b, which diverges, and its fixed point."""
    rng = np.random.default_rng(seed)
    matrix, constant = 2 * rng.normal(size=(4, 4)), rng.normal(size=4)
    arguments, values, x = [], [], np.zeros(4)
    for _ in range(count):
        arguments.append(x)
        x = matrix @ x + constant
        values.append(x)
    return np.array(arguments), np.array(values), np.linalg.solve(np.eye(4) - matrix, constant)


@pytest.mark.parametrize("seed", range(5))
def test_a_linear_iteration_ends_as_soon_as_its_steps_span_the_space(seed):
    """Of n components n changes determine the fixed point; two cases together are each as it is alone."""
    cases = [linear_steps(seed, 5), linear_steps(seed + 100, 5)]
    together = next_argument(*(np.stack(parts, axis=1) for parts in zip(*(case[:2] for case in cases), strict=True)))
    for (arguments, values, fixed), found in zip(cases, together, strict=True):
        assert found == pytest.approx(fixed, rel=1e-6)
        assert np.array_equal(found, next_argument(arguments, values))
        assert np.abs(values[-1] - fixed).max() > np.abs(values[0] - fixed).max()


def test_one_step_alone_and_steps_that_do_not_move_give_the_value():
    arguments, values, _ = linear_steps(0, 1)
    assert np.array_equal(next_argument(arguments, values), values[-1])
    still = np.ones((3, 4))
    assert np.array_equal(next_argument(still, still), still[-1])


# vectors and symmetric matrices


def test_products_and_lengths_are_those_of_numpy():
    first, second, matrix = (np.random.default_rng(3).normal(size=(5, 4, *shape)) for shape in ((3,), (3,), (3, 3)))
    second = second[::-1]
    np.testing.assert_array_equal(cross(first, second), np.cross(first, second))
    np.testing.assert_allclose(dot(first, second), np.einsum("...i,...i", first, second), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(size(first), np.linalg.norm(first, axis=-1), rtol=1e-15)
    np.testing.assert_allclose(times(matrix, first), (matrix @ first[..., None])[..., 0], rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(largest(first), np.abs(first).max(axis=-1))


def test_systems_of_one_unknown_are_solved_and_inverted_as_others():
    """Beside a second unknown that is in no equation of the first, a singular one too."""
    numbers, right = np.array([2.0, -0.5j, 0.0])[:, None, None], np.array([3.0, 1j, 1.0])[:, None, None]
    alone, both = (solved(numbers, right), inverse(numbers)), np.eye(2) * numbers
    beside = solved(both, right * np.ones((2, 1)))[:, :1], inverse(both)[:, :1, :1]
    np.testing.assert_array_equal(alone[0][:2], beside[0][:2])
    np.testing.assert_array_equal(alone[1][:2], beside[1][:2])
    assert np.isnan([alone[0][2], beside[0][2]]).all()
    assert np.isinf([alone[1][2], beside[1][2]]).all()


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e12])
def test_symmetric_matrices_are_inverted(scale):
    root = np.random.default_rng(3).normal(size=(6, 3, 3))
    matrix = scale * (root @ root.swapaxes(-1, -2) + np.eye(3))
    entries = tuple(matrix[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    np.testing.assert_allclose(inverse_symmetric(entries), np.linalg.inv(matrix), rtol=1e-11, atol=1e-13 / scale)
