"""`cable/taut.py`: against textbook formulas written independently; Tables 3 and 4 of the paper are in test_paper."""

import math

import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, G, chord_span, paper_span
from references import continuous_cable, taut_string

from cablestudy.cable import catenary, taut


def test_string():
    expected = taut_string.string_frequencies(7, 185.8, 1345.0, MASS)
    assert taut.string_frequencies(7, 185.8, 1345.0, MASS) == pytest.approx(expected, rel=1e-15)
    many = taut.string_frequencies(3, np.array([1.0, 2.0]), 4.0, np.array([1.0, 0.25]))
    assert many == pytest.approx(np.array([[1, 2, 3], [1, 2, 3]]), rel=1e-15)


CROSSOVER = 4 * math.pi**2  # the first symmetric mode has the antisymmetric frequency 2 pi: Irvine (1981), section 3.2


@pytest.mark.parametrize("squared", [0.0, 1e-12, 1e-3, 1.0, CROSSOVER, 100.0, 1e4, 1e8])
def test_symmetric_roots(squared):
    """Every root, none twice, next to the poles of the tangent too."""
    found = taut.symmetric_roots(12, squared)
    assert found == pytest.approx(taut_string.irvine_symmetric(12, squared), rel=1e-14)
    assert squared != CROSSOVER or found[0] == pytest.approx(2 * np.pi, rel=1e-14)


@pytest.mark.parametrize("degrees", [0, 19, 60, -75])
@pytest.mark.parametrize("tension", [40.0, 361.0, 1345.0])
def test_lambda_squared(degrees, tension):
    span = paper_span(degrees=degrees)
    expected = taut_string.irvine_parameter(MASS * G, PAPER_CHORD, EA, tension, math.radians(degrees))
    assert taut.lambda_squared(span, tension) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("tension", [200.0, 1345.0, 20_000.0])
@pytest.mark.parametrize("stretched", [False, True])
def test_symmetric_frequencies(tension, stretched):
    span = paper_span() if stretched else paper_span().with_chord_strain(0.0)
    ratio = span.unstretched_length / span.chord
    expected = taut_string.irvine_frequencies(6, PAPER_CHORD, tension, MASS * ratio, EA / ratio)
    found = taut.symmetric_frequencies(6, span, tension)
    assert found == pytest.approx(expected, rel=1e-12 if stretched else 1e-13)


def test_with_stretch_the_closed_form_is_the_exact_cable():
    """DESIGN section 8: 1.59146 and 4.7736 Hz; Irvine assumes a flat cable, hence the 1e-5."""
    span = paper_span()
    tension = float(catenary.solve(span).mean_tension)
    found = taut.symmetric_frequencies(2, span, tension)
    exact = continuous_cable.frequencies(PAPER_CHORD, 0, span.unstretched_length, EA, MASS, G, 8)
    assert exact[0] == pytest.approx(1.59146, abs=0.6e-5)
    assert exact[2] == pytest.approx(4.7736, abs=0.6e-4)
    assert found == pytest.approx(exact[[0, 2]], rel=1e-5)
    strings = taut.string_frequencies(4, PAPER_CHORD, tension, taut.per_deformed_length(span)[0])
    assert strings[[1, 3]] == pytest.approx(exact[[1, 3]], rel=1e-5)


def test_axial_modes_are_those_of_the_continuous_cable():
    """A straight weightless cable: waves run through the unstretched length at sqrt(EA/m)."""
    span = chord_span(100, 0, 0.1, 1e6, gravity=0.0)
    exact = continuous_cable.frequencies(100, 0, span.unstretched_length, 1e6, 1.0, 0.0, 12)
    for frequency in taut.axial_frequencies(3, span):
        assert np.abs(exact / frequency - 1).min() < 1e-10


def test_many_cables_at_once():
    strains = np.array([0.001, 0.007, 0.02])
    span = paper_span().with_chord_strain(strains)
    tension = EA * strains
    together = taut.symmetric_frequencies(4, span, tension)
    axial = taut.axial_frequencies(4, span)
    assert together.shape == axial.shape == (3, 4)
    for i, strain in enumerate(strains):
        alone = paper_span().with_chord_strain(strain)
        assert together[i] == pytest.approx(taut.symmetric_frequencies(4, alone, tension[i]), rel=1e-13)
        assert axial[i] == pytest.approx(taut.axial_frequencies(4, alone), rel=1e-14)
