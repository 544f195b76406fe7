"""`cable/dynamics.py`, `modes.py`, `motion.py`: the dense textbook chain, kinds of modes, counts, errors."""

import math

import numpy as np
import pytest
from cables import EA, MASS, G, chord_span, full_stiffness, graded_error, paper_span, state_of
from references import bars, continuous_cable, taut_string
from scipy.optimize import brentq

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.meshes import mesh_pieces, pieces
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError


def dynamics(span, elements=40, order=1, mass="lumped"):
    return Dynamics(state_of(span, elements, order, mass))


# ---- the dense textbook chain ---------------------------------------------------------------------------------------

CHAINS = {  # a, b, L, loads at nodes of 40
    "taut": (185.8, 0.0, 184.4883, ()),
    "sagging": (185.8, 0.0, 186.0, ()),
    "inclined": (175.68, 60.49, 184.4883, ()),
    "slack": (100.0, 20.0, 150.0, ()),
    "loads in the plane": (100.0, -20.0, 110.0, ((10, (5.0, 0.0, -40.0)), (25, (0.0, 0.0, 20.0)))),
    "loads out of it": (100.0, -20.0, 103.0, ((10, (5.0, 30.0, -40.0)), (25, (0.0, -60.0, 20.0)))),
}


@pytest.mark.parametrize(("a", "b", "length", "loads"), CHAINS.values(), ids=CHAINS)
def test_40_bars_equal_the_dense_chain(a, b, length, loads):
    """Frequencies, participation (subspaces where they coincide) and condensed stiffness."""
    chord = math.hypot(a, b)
    degrees = math.degrees(math.atan2(b, a))
    span = chord_span(
        chord, degrees, (chord - length) / length, EA, MASS, loads=[(node / 40, force) for node, force in loads]
    )
    model = dynamics(span)
    assert (len(model.systems) == 2) == (not any(force[1] for _, force in loads))
    found = model.lowest(model.dof)
    chain = bars.solve_spatial((a, 0, b), length, EA, MASS * G, 40, loads)
    expected = bars.modes(chain, length, EA, MASS)
    assert found.complete
    assert len(found) == 117
    assert found.frequency == pytest.approx(expected.frequencies, rel=1e-9)
    end = found.participation @ span.frame
    scale = np.abs(expected.participation).max()
    # modes come from the compliance: the highest lose the digits of (omega_max/omega_1)^2, over their distance
    digits = 1e-6 + 2e-15 * (found.frequency[-1] / found.frequency[0]) ** 2 / 1e-3
    edges = np.flatnonzero(np.diff(expected.frequencies) > 1e-3 * expected.frequencies[1:]) + 1
    for group in np.split(np.arange(117), edges):
        ours, theirs = (np.sqrt((values[group] ** 2).sum(axis=0)) for values in (end, expected.participation))
        assert ours == pytest.approx(theirs, rel=digits, abs=1e-10 * scale)
    K = span.frame.T @ model.end_stiffness @ span.frame
    assert graded_error(K, chain.end_stiffness) < 1e-9


@pytest.mark.parametrize("span", [paper_span(), paper_span(186.0, degrees=19)], ids=["taut", "sagging"])
def test_participation_adds_up_to_the_stiffness(span):
    """K11 - K = sum of p p^T/omega^2 over all modes; K11 is the stiffness of end 2 with the interior held."""
    model = dynamics(span, 3, 4)
    found = model.lowest(model.dof)
    share = found.participation / (2 * np.pi * found.frequency[:, None])
    held = np.zeros((3, 3))
    for system in model.systems:
        K = full_stiffness(system) * model.state.force / span.unstretched_length
        held[np.ix_(system.axes, system.axes)] = K[-len(system.axes) :, -len(system.axes) :]
    assert graded_error(share.T @ share + model.end_stiffness, held) < 1e-7


def test_shapes_are_mass_normalised_and_orthogonal():
    span = chord_span(100, 20, -0.05, 1e5, loads=[(0.3, (0, 50, -100))])
    model = dynamics(span, 12, 3, "consistent")
    found = model.lowest(model.dof)
    M = model.systems[0].mass.toarray() * span.mass * span.unstretched_length
    shapes = found.shapes[1:-1].reshape(-1, len(found))
    assert shapes.T @ M @ shapes == pytest.approx(np.eye(len(found)), abs=1e-6)
    assert np.abs(np.diag(shapes.T @ M @ shapes) - 1).max() < 1e-12
    assert not found.shapes[[0, -1]].any()


# ---- kinds ----------------------------------------------------------------------------------------------------------


def names(found, count=None):
    return [(found.kind[k], found.symmetry[k]) for k in range(count or len(found))]


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [0, 19, -70, 90])
@pytest.mark.parametrize("order", [1, 16])
def test_a_straight_cable_where_every_transverse_mode_comes_twice(degrees, order):
    """Weightless: y and n coincide exactly; kinds and symmetry alternate as for a string."""
    span = chord_span(100, degrees, 1e-3, 1e6, gravity=0.0)
    found = dynamics(span, 40 if order == 1 else 2, order).lowest(12)
    assert sorted(names(found, 2)) == [("in-plane", "symmetric"), ("out-of-plane", "symmetric")]
    for k in range(6):
        pair = names(found)[2 * k : 2 * k + 2]
        symmetry = "symmetric" if k % 2 == 0 else "antisymmetric"
        assert pair == [("out-of-plane", symmetry), ("in-plane", symmetry)]
        assert found.frequency[2 * k] == pytest.approx(found.frequency[2 * k + 1], rel=1e-12)
    if order == 16:
        expected = taut_string.string_frequencies(6, 100, 1e3, 1 / (1 + 1e-3))
        # m per deformed length is m/(1 + strain)
        assert found.frequency[::2] == pytest.approx(expected, rel=1e-10)


def test_a_spatial_cable_keeps_its_kinds_when_they_coincide():
    """A load without weight out of the plane makes the model spatial, but hardly couples anything."""
    span = chord_span(100, 0, 1e-3, 1e6, gravity=0.0, loads=[(0.5, (0.0, 1e-12, 0.0))])
    model = dynamics(span, 40)
    assert len(model.systems) == 1
    assert names(model.lowest(4)) == [
        ("out-of-plane", "symmetric"), ("in-plane", "symmetric"),
        ("out-of-plane", "antisymmetric"), ("in-plane", "antisymmetric"),
    ]  # fmt: skip


def test_irvines_crossover():
    """lambda^2 = 4 pi^2: the first symmetric and antisymmetric in-plane modes coincide; found here by bisection."""

    def pair(strain):
        found = dynamics(paper_span().with_chord_strain(strain), 40).lowest(12)
        one, other = (found.select("in-plane", symmetry)[0] for symmetry in ("symmetric", "antisymmetric"))
        return found, one, other

    def gap(strain):
        found, one, other = pair(strain)
        return found.frequency[one] / found.frequency[other] - 1

    crossing = brentq(gap, -1e-3, 1e-3, xtol=1e-19, rtol=1e-15)
    tension = float(catenary.solve(paper_span().with_chord_strain(crossing)).mean_tension)
    squared = taut_string.irvine_parameter(MASS * G, 185.8, EA, tension)
    assert squared == pytest.approx(4 * np.pi**2, rel=0.03)  # Irvine: a flat cable, many more than 40 bars
    for strain in (crossing, np.nextafter(crossing, 1), crossing * (1 + 1e-12), crossing * (1 - 1e-11)):
        found, one, other = pair(strain)
        assert abs(found.frequency[one] / found.frequency[other] - 1) < 1e-9
        assert names(found, 4) == [
            ("out-of-plane", "symmetric"), ("in-plane", "symmetric"),
            ("in-plane", "antisymmetric"), ("out-of-plane", "antisymmetric"),
        ]  # fmt: skip


def test_an_axial_mode_that_coincides_with_a_transverse_one():
    """Straight, weightless, of a strain near 1/16, found on the model itself: the first axial mode and the 4th pair."""

    def frequencies(strain):
        found = dynamics(chord_span(100, 0, strain, 1e6, gravity=0.0), 24).lowest(30)
        return found, found.select("axial")[0]

    def gap(strain):
        found, axial = frequencies(strain)
        return found.frequency[axial] / found.frequency[found.select("out-of-plane")[3]] - 1

    crossing = brentq(gap, 0.05, 0.09, xtol=1e-16, rtol=1e-15)
    for strain in (crossing, np.nextafter(crossing, 1), crossing * (1 - 1e-12)):
        found, axial = frequencies(strain)
        same = np.flatnonzero(np.abs(found.frequency / found.frequency[axial] - 1) < 1e-9)
        assert [found.kind[k] for k in same] == ["out-of-plane", "in-plane", "axial"]
        assert [found.symmetry[k] for k in same] == ["antisymmetric", "antisymmetric", "symmetric"]


@pytest.mark.parametrize("degrees", [0, 19, 60])
def test_inclined_and_sagging_cables_have_kinds(degrees):
    """Modes alternate in a level cable out of its plane, and in a taut one in both, whatever its inclination."""
    for length in (184.4883, 185.9, 186.0, 200.0):
        found = dynamics(paper_span(length, degrees=degrees), 4, 16).lowest(20)
        taut = length == 184.4883
        for kind, alternates in (("out-of-plane", taut or degrees == 0), ("in-plane", taut)):
            symmetry = [found.symmetry[k] for k in found.select(kind)]
            expected = ["symmetric" if k % 2 == 0 else "antisymmetric" for k in range(len(symmetry))]
            assert symmetry == expected or not alternates
        assert degrees or "mixed" not in found.symmetry


def test_a_steep_sagging_cable_has_mixed_modes():
    """Neither a mirror image of itself nor its opposite: gravity along the chord makes the lower part slacker."""
    found = dynamics(paper_span(188.0, degrees=70), 4, 16).lowest(12)
    assert "mixed" in found.symmetry


# ---- how many -------------------------------------------------------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize("elements", [3, 40, 400])
@pytest.mark.parametrize("count", [0, 1, 2, 10])
def test_the_lowest_few_are_those_of_many(elements, count):
    model = dynamics(paper_span(186.0), elements)
    found, more = model.lowest(count), model.lowest(min(24, model.dof))
    kept = min(count, model.dof)
    assert len(found) == kept
    assert found.frequency == pytest.approx(more.frequency[:kept], rel=1e-10)
    assert names(found) == names(more, kept) if kept else not names(found)
    assert found.complete == (count >= model.dof)


def test_more_than_there_are():
    model = dynamics(paper_span(), 5)
    found = model.lowest(1000)
    assert found.complete
    assert len(found) == model.dof == 12
    assert found.frequency == pytest.approx(model.lowest(model.dof).frequency)
    none = dynamics(paper_span(), 1)
    assert none.dof == 0
    assert len(none.lowest(5)) == 0
    assert none.lowest(1).complete


def test_up_to_a_frequency():
    model = dynamics(paper_span(), 100)
    every = model.lowest(model.dof)
    for limit in (0.1, 5.0, 40.0, 1e9):
        found = model.up_to(limit)
        below = int((every.frequency <= limit).sum())
        assert len(found) >= below
        assert found.frequency[:below] == pytest.approx(every.frequency[:below], rel=1e-9)
        assert found.complete or found.frequency[-1] > limit


def test_too_many_modes_of_a_large_model():
    model = dynamics(paper_span(), 4000)
    with pytest.raises(ConvergenceError, match="at most a quarter"):
        model.lowest(model.dof)


# ---- the error that one model tells --------------------------------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize("order", [6, 8, 9, 11, 14, 17])
@pytest.mark.parametrize(("a", "b", "length"), [
    (185.8, 0.0, 184.4883), (185.8, 0.0, 186.0), (175.68, 60.49, 184.4883), (100.0, -20.0, 130.0), (20.0, 100.0, 103.0),
], ids=["taut", "sagging", "inclined", "slack", "steep"])  # fmt: skip
def test_the_error_that_a_model_tells_is_true_and_not_idle(a, b, length, order):
    """Against the continuous cable, by integral equations: at most what is told, nor a thousandth (slack: 1e-4)."""
    chord = math.hypot(a, b)
    span = chord_span(chord, math.degrees(math.atan2(b, a)), (chord - length) / length, EA, MASS)
    start = catenary.solve(span)
    edges = pieces(start.segments.fraction, start.singularities)
    mesh = mesh_pieces(edges, (1,) * (len(edges) - 1), order)
    model = Dynamics(equilibrium.from_catenary(start, mesh))
    for kind, plane in (("in-plane", "in"), ("out-of-plane", "out")):
        exact = continuous_cable.frequencies(a, b, length, EA, MASS, G, 4, plane=plane)
        which = tuple((k, kind, None) for k in range(1, 5))
        found, told, _ = model.frequencies(which, errors=True)
        for k, frequency, error, value in zip(range(1, 5), found, told, exact, strict=True):
            if 1.7 * k + 3 > order:
                continue  # its waves are not resolved
            true = abs(frequency / value - 1)
            assert true <= max(error, 1e-11), (kind, k)
            if true > 1e-9:
                assert error < (1e3 if length < 103 or chord > 105 else 1e4) * true, (kind, k)


@pytest.mark.crossed
@pytest.mark.parametrize("order", range(6, 25))
@pytest.mark.parametrize("elements", [1, 2, 3])
def test_the_error_of_a_taut_string_is_told_sharply(elements, order):
    """Of its k-th mode, k sqrt(T/m)/(2 l): at most what is told, and for some mode of a high order not a third."""
    span = chord_span(100.0, 20.0, 1e-3, EA, MASS, gravity=0.0)
    start = catenary.solve(span)
    model = Dynamics(equilibrium.from_catenary(start, mesh_pieces((0.0, 1.0), (elements,), order)))
    waves = np.arange(1, int((elements * order - 3) / 1.7) + 1)
    # per unstretched length: mass MASS, stiffness T/(1 + strain)
    exact = waves / 2 * np.sqrt(1e-3 * EA / (MASS * 1.001)) / (100 / 1.001)
    found, told, _ = model.frequencies(tuple((k, "out-of-plane", None) for k in waves.tolist()), errors=True)
    true = np.abs(np.array(found) / exact - 1)
    assert np.all(true <= np.maximum(told, 2e-13))
    seen = true > 1e-11
    assert order < 10 or np.min(np.array(told)[seen] / true[seen]) < 3


# ---- the two solvers ------------------------------------------------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("span", [paper_span(), paper_span(186.0, degrees=19)], ids=["taut", "sagging"])
def test_lanczos_equals_dense(span, mass, monkeypatch):
    model = dynamics(span, 250, 1, mass)
    large = model.lowest(15)
    monkeypatch.setattr(type(CABLE), "dense_freedoms", 10_000)
    small = model.lowest(15)
    assert large.frequency == pytest.approx(small.frequency, rel=1e-10)
    assert names(large) == names(small)
    assert np.abs(large.participation) == pytest.approx(np.abs(small.participation), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("elements", [20, 300])
def test_two_runs_are_identical(elements):
    one, other = (dynamics(paper_span(186.0), elements).lowest(12) for _ in range(2))
    for name in ("frequency", "shapes", "participation"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert names(one) == names(other)


def test_first_and_select():
    found = dynamics(paper_span()).lowest(20)
    assert len(found.first(5)) == 5
    assert found.first(5).shapes.shape == (41, 3, 5)
    assert found.first(50) is found
    everything = sorted(found.select("in-plane") + found.select("out-of-plane") + found.select("axial"))
    assert everything == list(range(20))
