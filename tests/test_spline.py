"""`wind/gusts.py` beside scipy.interpolate, and polynomials, which splines of their degree are."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from cablestudy.wind.gusts import CardinalSplines


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
