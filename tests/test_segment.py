"""`cable/segment.py` against the same integrals at 50 digits."""

import numpy as np
import pytest
from campaign import campaign
from mpmath import mp
from references import catenary_mp

from cablestudy.cable.segment import extension, flexibility, segment_terms, solve_symmetric
from cablestudy.cable.tolerances import CABLE

EPS = np.finfo(float).eps


@mp.workdps(90)
def exact(tension, weight, stiffness, cosine, sine):
    """Extension and flexibility, both per unstretched length, in the chord frame."""
    q, n, y = (mp.mpf(float(p)) for p in tension)
    c, s = mp.mpf(float(cosine)), mp.mpf(float(sine))
    size = mp.hypot(c, s)
    c, s = c / size, s / size
    weight = mp.mpf(float(weight))
    first = (q * c - n * s, y, q * s + n * c - weight / 2)
    end, flexible, *_ = catenary_mp._integrals(first, mp.mpf(1), weight, 1 / mp.mpf(float(stiffness)))
    R = mp.matrix([[c, 0, s], [-s, 0, c], [0, 1, 0]])
    place = R * mp.matrix(end)
    return (
        np.array([place[0] - 1, place[1], place[2]], dtype=float),
        np.array((R * flexible * R.T).tolist(), dtype=float),
    )


def cases():
    """Shallow and deep, taut and slack, level to vertical, in the plane and out of it."""
    rng = np.random.default_rng(20)
    for _ in range(campaign(150, 40)):
        angle = rng.choice([0.0, rng.uniform(-np.pi / 2, np.pi / 2)])
        direction = rng.normal(size=3) * 10.0 ** rng.uniform([-1, -6, -6], [0, 0, 0])
        tension = direction / np.linalg.norm(direction)
        weight = 10 ** rng.uniform(-12, 3)
        yield tension, weight, 10 ** rng.uniform(0, 12), np.cos(angle), np.sin(angle)


def matrix(entries):
    qq, nn, yy, qn, qy, ny = entries
    return np.array([[qq, qn, qy], [qn, nn, ny], [qy, ny, yy]])


CASES = list(cases())


def test_extension_and_flexibility():
    assert {w < 0.1 for _, w, *_ in CASES} == {True, False}
    for tension, weight, stiffness, cosine, sine in CASES:
        parts, terms = extension(tension, weight, stiffness, cosine, sine)
        expected, flexible = exact(tension, weight, stiffness, cosine, sine)
        # a digit of the input tension moves the segment's end by its flexibility: no formula can do better
        bound = 50 * EPS * (np.abs(flexible) @ (np.abs(tension) + weight) + np.abs(expected))
        assert (np.abs(np.array(parts) - expected) <= bound).all(), (tension, weight)
        found = matrix(flexibility(tension, weight, stiffness, cosine, sine, terms))
        d = np.sqrt(np.diag(flexible))
        assert np.max(np.abs(found - flexible) / np.outer(d, d)) < 1e-9, (tension, weight)


def test_a_taut_segment_keeps_the_digits_of_a_strain_of_1e_12():
    """Along the chord: T/EA less (w/T)^2/24 of a parabola, both far below the rounding of a length."""
    tension, weight = (1.0, 0.0, 0.0), 1e-6
    (along, across, out), _ = extension(tension, weight, 1e12, 1.0, 0.0)
    expected, _ = exact(tension, weight, 1e12, 1.0, 0.0)
    assert along == pytest.approx(1e-12 - weight**2 / 24, rel=1e-11)
    assert along == pytest.approx(expected[0], rel=1e-14)
    assert across == out == 0


@pytest.mark.parametrize("side", [1 - 1e-9, 1 + 1e-9])
def test_series_and_closed_form_meet(side):
    """Just below and above CABLE.series_below the two branches are both exact."""
    weight = 2 * CABLE.series_below / np.sqrt(1 - CABLE.series_below**2) * side  # beta = W / (2 hypot(1, W/2))
    terms = segment_terms((1.0, 0.0, 0.0), weight, 1.0, 0.0)
    assert (terms.beta < CABLE.series_below) == (side < 1)
    assert terms.excess == pytest.approx(np.arctanh(terms.beta) / terms.beta - 1, rel=2e-13)
    parts, terms = extension((1.0, 0.0, 0.0), weight, 1e3, 1.0, 0.0)
    expected, flexible = exact((1.0, 0.0, 0.0), weight, 1e3, 1.0, 0.0)
    assert np.allclose(parts, expected, rtol=2e-13, atol=1e-16)
    assert np.allclose(
        matrix(flexibility((1.0, 0.0, 0.0), weight, 1e3, 1.0, 0.0, terms)), flexible, rtol=1e-13, atol=1e-18
    )


def test_solve_symmetric():
    rng = np.random.default_rng(3)
    for _ in range(campaign(50, 15)):
        A = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-6, 6, size=3)
        A = A.T @ A  # badly scaled: what the routine is for
        right = A @ np.ones(3)
        entries = (A[0, 0], A[1, 1], A[2, 2], A[0, 1], A[0, 2], A[1, 2])
        d = np.sqrt(np.diag(A))
        condition = np.linalg.cond(A / np.outer(d, d))
        found = np.array(solve_symmetric(entries, right))
        assert np.max(np.abs(found - 1) * d) / d.max() < 1e-14 * condition
