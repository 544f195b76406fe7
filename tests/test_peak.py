"""Davenport's peak factor, against the distribution of the largest value."""

import numpy as np
import pytest
from scipy.integrate import quad

from cablestudy.wind.peak import peak_factor


def expected_largest(crossings):
    """Mean of the largest value where up-crossings of a level eta are independent, n exp(-eta^2/2) of them."""
    return quad(lambda eta: -np.expm1(-crossings * np.exp(-(eta**2) / 2)), 0, 40, limit=400, epsabs=1e-12)[0]


@pytest.mark.parametrize("crossings", [30.0, 300.0, 1e4, 1e8])
def test_mean_of_largest_value(crossings):
    mode = np.sqrt(2 * np.log(crossings))
    # of the expansion in 1/mode the formula has two terms; the third is -(gamma^2 + pi^2/6)/(2 mode^3)
    third = (np.euler_gamma**2 + np.pi**2 / 6) / (2 * mode**3)
    assert 0 < peak_factor(crossings / 600, 600.0) - expected_largest(crossings) < third


def test_by_hand():
    # n = e^8: sqrt(16) + 0.57722/4
    assert peak_factor(1.0, np.exp(8)) == pytest.approx(4.144304, abs=1e-6)


def test_few_crossings():
    fewest = np.sqrt(2) + 0.5772157 / np.sqrt(2)
    assert np.allclose(peak_factor(np.array([0.0, 1e-300, 1e-3, np.e / 600]), 600.0), fewest, rtol=1e-7)
    assert (np.diff(peak_factor(np.geomspace(1e-3, 1e3, 100), 600.0)) >= 0).all()


def test_no_overflow():
    assert peak_factor(1e300, 1e12) == pytest.approx(np.sqrt(2 * np.log(10) * 312), rel=1e-3)
