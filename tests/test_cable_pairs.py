"""Coherence of gusts between two cables that come close, against a quadrature with panels about the closest place."""

from itertools import pairwise

import numpy as np
import pytest
from campaign import campaign
from references.panels import panels

from cablestudy.cable.element import basis
from cablestudy.wind.cable_pairs import (
    Arcs,
    coherence_of_cables,
    coherence_of_chords,
    coherence_with_points,
    load_points,
)

KAPPA = np.array([1e-3, 1.0, 10.0, 100.0, 1000.0])


def on(curve, positions):
    """Places on a parabola through three points, at positions on [0, 1]."""
    x = positions[..., None]
    return curve[0] * (1 - x) * (1 - 2 * x) + curve[1] * 4 * x * (1 - x) + curve[2] * x * (2 * x - 1)


def closest(place, curve):
    """Position on a parabola that is closest to a place."""
    x = np.linspace(0, 1, 101)
    for _ in range(5):
        best = x[np.argmin(np.linalg.norm(on(curve, x) - place, axis=-1))]
        x = np.clip(np.linspace(best - 1.5 * (x[1] - x[0]), best + 1.5 * (x[1] - x[0]), 101), 0, 1)
    return best


def loads(x):
    """Three of them at positions along a cable: even, and two waves."""
    return np.stack([np.ones_like(x), x, (2 * x - 1) ** 2], axis=-1)


def by_panels(first, second, about):
    """Integrals of all pairs of loads times exp(-kappa r), shape (f, 3, 3); `about` as of the first parabola."""
    total = np.zeros((len(KAPPA), 3, 3))
    for s, share in zip(*panels(about), strict=True):
        place = on(first, np.array(s))
        t, weights = panels(closest(place, second))
        apart = np.linalg.norm(on(second, t) - place, axis=-1)
        inner = np.exp(-KAPPA[:, None] * apart) @ (weights[:, None] * loads(t))
        total += share * loads(np.array(s))[:, None] * inner[:, None]
    return total


def by_means(coherence):
    """The same integrals by the mean coherences of two arcs."""
    points, weights = load_points(2)
    work = weights[:, None] * loads(points)
    return work.T @ coherence @ work


def straight(*ends):
    """Nodes of a straight arc."""
    low, high = np.array(ends, dtype=float)
    return np.array([low, (low + high) / 2, high])


def turned(angle, start=(0, 0, 0), length=1.0):
    """A straight arc from a start, at an angle to x."""
    return straight(start, np.add(start, [length * np.cos(angle), length * np.sin(angle), 0]))


LEVEL = straight((0, 0, 0), (1, 0, 0))
SAG = np.array([0, 0, -0.05])
PAIRS = {  # with the place on the level one that is closest to the other one
    "at 1.5 degrees": (turned(0.026), 0.0),
    "at 60 degrees": (turned(1.05), 0.0),
    "almost in line": (turned(3.1), 0.0),
    "at the same place": (LEVEL, 0.0),
    "beside it": (straight((0, 2e-3, 0), (1, 2e-3, 0)), 0.0),
    "beside it, farther at one end": (straight((0, 0, 0.002), (1, 0.03, 0.002)), 0.0),
    "across": (turned(0.6, (0.4, -0.2, 2e-3)), 0.4 + 0.2 / np.tan(0.6)),
    "ends on it": (turned(1.3, (0.37, 0, 1e-3)), 0.37),
}
# relative to the covariance of one load with itself, for each kappa: the larger it is, the less is in the wind
VALUE_AND_RATE = np.minimum(1.0, 2 / KAPPA)
ALLOWED = (np.array([1e-10, 1e-8, 1e-6, 3e-6, 3e-5]) * VALUE_AND_RATE)[:, None, None]


@pytest.mark.parametrize("name", campaign(list(PAIRS), ["at 1.5 degrees", "at the same place", "beside it", "across"]))
def test_two_cables_that_come_close(name):
    """Three loads on each, as the first and as the second one."""
    other, about = PAIRS[name]
    expected = by_panels(LEVEL, other, about)
    for pair in ((LEVEL, other), (other, LEVEL)):
        found = by_means(coherence_of_cables(KAPPA, *(Arcs(nodes[None]) for nodes in pair)))
        found = found if pair[0] is LEVEL else np.swapaxes(found, 1, 2)
        assert (np.abs(found - expected) <= ALLOWED).all()


def test_two_sagging_cables_beside_each_other():
    """Two parabolas of equal sag, at a distance of a hundredth of their span."""
    first, second = (LEVEL + np.outer([0, 1, 0], SAG) + [0, y, 0] for y in (0, 0.01))
    found = by_means(coherence_of_cables(KAPPA, Arcs(first[None]), Arcs(second[None])))
    assert (np.abs(found - by_panels(first, second, 0.0)) <= ALLOWED).all()


def test_places_of_one_cable_by_their_distance():
    """Against a fine rule on a parabola, whose arc length is in closed form; in one element and in two."""
    sag = LEVEL + np.outer([0, 1, 0], 4 * SAG)
    x, weights = np.polynomial.legendre.leggauss(400)
    x, weights = (1 + x) / 2, weights / 2
    slope = 16 * SAG[2] * (1 - 2 * x)
    along = -(slope * np.hypot(1, slope) + np.arcsinh(slope)) / (64 * SAG[2])
    distance, of_arc = np.linalg.norm(on(sag, x)[:, None] - on(sag, x), axis=-1), np.abs(along[:, None] - along)
    assert np.abs(of_arc[0, -1] / distance[0, -1] - 1) > 0.05
    whole = Arcs(on(sag, basis(12).nodes)[None])
    halves = Arcs(np.array([on(sag, (half + basis(12).nodes) / 2) for half in (0, 1)]))
    points, of_points = load_points(12)
    of_whole = of_points[:, None] * loads(points)
    of_halves = np.concatenate([of_points[:, None] / 2 * loads((half + points) / 2) for half in (0, 1)])
    for kappa, own in zip(KAPPA, VALUE_AND_RATE, strict=True):
        change = np.exp(-kappa * distance) - np.exp(-kappa * of_arc)
        expected = (weights[:, None] * loads(x)).T @ change @ (weights[:, None] * loads(x))
        for arcs, work in ((whole, of_whole), (halves, of_halves)):
            found = work.T @ coherence_of_chords(np.array([kappa]), arcs)[0] @ work
            assert np.abs(found - expected).max() <= (2e-6 if kappa < 50 else 1e-5) * own, kappa


def test_points_near_a_cable():
    """Beside it, in line with it, and far away."""
    places = np.array([[0.3, 1e-3, 0], [-2e-3, 0, 0], [1.01, 0.02, 0], [0.5, 3.0, 1.0]])
    found = coherence_with_points(KAPPA, places, Arcs(LEVEL[None]))
    points, weights = load_points(2)
    found = found @ (weights[:, None] * loads(points))
    for place, of_place in zip(places, np.moveaxis(found, 1, 0), strict=True):
        t, weights = panels(closest(place, LEVEL))
        apart = np.linalg.norm(on(LEVEL, t) - place, axis=-1)
        expected = np.exp(-KAPPA[:, None] * apart) @ (weights[:, None] * loads(t))
        assert (np.abs(of_place - expected) <= 3 * ALLOWED[..., 0]).all()


def test_two_cables_of_several_elements():
    """Which meet at one of their ends: as two cables of one element each."""
    other = turned(0.1)
    pieces = [Arcs(np.array([straight(*ends) for ends in pairwise(nodes)])) for nodes in (LEVEL, other)]
    coherence = coherence_of_cables(KAPPA, *pieces)
    points, weights = load_points(2)
    work = np.concatenate([weights[:, None] / 2 * loads((points + half) / 2) for half in (0, 1)])
    expected = by_means(coherence_of_cables(KAPPA, Arcs(LEVEL[None]), Arcs(other[None])))
    assert work.T @ coherence @ work == pytest.approx(expected, abs=1e-6)
