"""`cable/span.py`: cables between places, alone and in batches, and the forces on their ends."""

import numpy as np
import pytest
from cables import Exact, span_between

from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span

RNG = np.random.default_rng(12)
ENDS = RNG.uniform(-50, 50, size=(2, 6, 3))
ENDS[1, 0] = ENDS[0, 0] + [0, 0.1, 70]  # steep
ENDS[1, 1] = ENDS[0, 1] + [-80, 0, 0]  # level
SLACK = np.array([0.9, 1.001, 0.995, 1.2, 0.999, 3.0])
LENGTHS = np.linalg.norm(ENDS[1] - ENDS[0], axis=1) * SLACK
PLACES = np.array([0.3, 0.7]) * LENGTHS[:, None]
FORCES = RNG.normal(size=(6, 2, 3)) * 200


def between(chosen, loads):
    load = {"load_positions": PLACES[chosen], "load_forces": FORCES[chosen]} if loads else {}
    return Span.between(*ENDS[:, chosen], 1e6, 1.5, unstretched_length=LENGTHS[chosen], **load)


@pytest.mark.parametrize("loads", [False, True])
def test_cables_between_places(loads):
    """Of each: geometry by vector algebra, and the end forces of 50 digits; in a batch to the last digit as alone."""
    together = between(slice(None), loads)
    forces = solve(together).end_forces("global")
    assert forces.shape == (6, 2, 3)
    for i, length in enumerate(LENGTHS):
        span = between(i, loads)
        delta = ENDS[1, i] - ENDS[0, i]
        assert span.frame[0] * span.chord == pytest.approx(delta, abs=1e-13 * 100)
        assert span.frame @ span.frame.T == pytest.approx(np.eye(3), abs=1e-15)
        assert span.frame @ [0, 0, 1] == pytest.approx(span.up, abs=1e-15)
        assert span.unstretched_length == pytest.approx(length, rel=1e-14)
        assert span.load_forces @ span.frame == pytest.approx(FORCES[i] if loads else np.zeros((0, 3)), abs=1e-12)
        alone = solve(span)
        assert (alone.end_forces("global") == forces[i]).all()
        assert alone.end_forces() @ span.frame == pytest.approx(forces[i], abs=1e-12 * alone.max_tension)
        exact = Exact(span)
        first = np.array([float(part) for part in exact.force0])  # in the vertical plane of the chord
        ux, uy, _ = span.horizontal
        turned = np.array([first[0] * ux - first[1] * uy, first[0] * uy + first[1] * ux, first[2]])
        digits = 1e-11 * alone.max_tension
        assert forces[i, 0] == pytest.approx(turned, abs=digits)
        total = [0, 0, -1.5 * 9.81 * length] + (FORCES[i].sum(axis=0) if loads else np.zeros(3))
        assert forces[i].sum(axis=0) == pytest.approx(total, abs=digits)


def test_what_a_span_refuses():
    with pytest.raises(ValueError, match="in one place"):
        Span.between((1, 2, 3), (1, 2, 3), 1e6, 1.0)
    with pytest.raises(ValueError, match="'x', not 'chord' or 'global'"):
        solve(between(3, False)).end_forces("x")


def test_values_that_all_cables_share_and_a_chord_of_more_digits():
    """Ends of three cables, all else as numbers; a chord given keeps a strain of 1e-12 that the places have lost."""
    span = Span.between(np.zeros((3, 3)), [[10, 0, 0], [0, 20, 0], [0, 0, -30]], 1e6, 1.0, 1.62)
    assert span.chord.tolist() == [10, 20, 30]
    assert span.axial_stiffness.shape == (3,)
    assert (span.gravity.tolist(), span.chord_strain.tolist()) == ([1.62] * 3, [0] * 3)
    assert (span.cosine.tolist(), span.sine.tolist()) == ([1, 1, 0], [0, 0, -1])
    chord = 100.0 + 1e-10
    ends = (0, 0, 0), (chord * np.cos(0.3), 0, chord * np.sin(0.3))
    assert Span.between(*ends, 1e6, 1.0, unstretched_length=100.0, chord=chord).chord_strain == (chord - 100) / 100
    same = span_between((1, 2, 3), (31, 42, 123), 120.0, 1e6, 1.0)
    other = Span.between((1, 2, 3), (31, 42, 123), 1e6, 1.0, unstretched_length=120.0)
    assert (same.chord, same.cosine, same.chord_strain) == (other.chord, other.cosine, other.chord_strain)
