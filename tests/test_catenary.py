"""`cable/catenary.py` against the catenary at 50 digits, closed forms of vertical cables, and its batches."""

import math

import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, PAPER_LENGTH, Exact, batch, chord_span, graded_error, paper_span, span_between
from campaign import campaign

from cablestudy.cable.catenary import solve
from cablestudy.cable.tolerances import CABLE

EPS = np.finfo(float).eps
QUANTITIES = ("mean_tension", "max_tension", "min_tension", "stretched_length")


def random_cables(count, seed, loads=0, steep=False):
    """Strain 1e-12 to 0.3, slack to 100 chords, EA/T to 1e12, 1 mm to 1000 km, level to nearly vertical."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        near = 90 - 10 ** rng.uniform(-12, 0)
        degrees = rng.choice([-near, near]) if steep else rng.choice([0, rng.uniform(-89, 89)])
        taut = 10 ** rng.uniform(-12, np.log10(0.3))
        strain = rng.choice([taut, -(10 ** rng.uniform(-12, -1)), 10 ** rng.uniform(-2, 0) - 1])
        chord, stiffness = 10 ** rng.uniform(-3, 6), 10 ** rng.uniform(0, 12)
        weight = stiffness * 10 ** rng.uniform(-12, 1)
        count = rng.integers(1, 5)
        forces = [(rng.uniform(0, 1), rng.normal(size=3) * weight * 10 ** rng.uniform(-3, 3)) for _ in range(count)]
        yield chord_span(chord, degrees, strain, stiffness, weight * (1 + strain) / chord, 1.0, forces if loads else ())


def exactly(span, found):
    """The 50 digits, whose search begins at what the program found: the energy is convex, and has one minimum."""
    return Exact(span, span.frame.T @ found.at(np.array([0.0]))[1][0])


def compare(span, tension=None):
    """All quantities of one cable; also the shape at a few places. Every tolerance is a multiple of rounding.

    The search begins from a tension vector at mid-length, if one is given.
    """
    found = solve(span, tension)
    assert found.record.converged
    exact = exactly(span, found)
    highest, lowest = exact.max_tension(), exact.min_tension()
    # the tension at mid-length is known to its last digit: where the cable is nearly slack, T/max T digits are left
    digits = 2e-12 + 10 * EPS * highest / lowest
    assert found.mean_tension == pytest.approx(exact.mean_tension(), rel=2e-13)
    assert found.max_tension == pytest.approx(highest, rel=2e-13)
    assert found.min_tension == pytest.approx(lowest, rel=digits)
    assert found.stretched_length == pytest.approx(exact.stretched_length(), rel=1e-14)
    assert graded_error(found.end_stiffness, exact.end_stiffness()) < 200 * digits
    # a place is a difference of lengths; a piece with little tension between large loads turns with their last digit
    rounding = 20 * EPS * (1 + highest / span.axial_stiffness) + EPS * highest / lowest
    if not len(span.load_positions):
        assert found.sag == pytest.approx(exact.sag(), rel=digits, abs=rounding * span.unstretched_length)
    places = np.array([0.0, 0.123, 0.51, 0.877, 1.0])
    displacement, force = found.at(places)
    for i, share in enumerate(places):
        where, tension = exact.at(share)
        if 0 < i < 4:  # at an end a load there may or may not be counted
            assert np.linalg.norm(force[i] - tension) < 1e-11 * highest
        assert np.abs(displacement[i] - where).max() < rounding
    return found


@pytest.mark.crossed
@pytest.mark.parametrize("loads", [False, True], ids=["plain", "point loads"])
@pytest.mark.parametrize(("steep", "seed"), [(False, 1), (True, 3)], ids=["any direction", "near the vertical"])
def test_random_cables(steep, seed, loads):
    """Within a degree to 1e-12 degrees of the vertical H may be 1e-12 of the weight, on the strain's last digits."""
    steps = [compare(span).record.steps for span in random_cables(campaign(120, 25), seed + loads, loads, steep)]
    assert steep or max(steps) <= 15


@pytest.mark.parametrize("loads", [False, True], ids=["plain", "point loads"])
def test_a_search_from_a_tension_nearby_ends_in_the_same_place(loads):
    rng = np.random.default_rng(7)
    for span in random_cables(campaign(60, 12), 11 + loads, loads):
        tension = solve(span).middle_tension
        wrong = 0.3 * np.linalg.norm(tension) * rng.uniform(-1, 1, size=3)
        compare(span, tension + wrong)
        assert compare(span, tension).record.steps <= 2
        compare(span, np.full(3, np.nan))


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [-90 + 1e-9, -60, -19, 0, 45, 89.9])
@pytest.mark.parametrize("strain", [1e-12, 1e-9, 1e-6, 1e-3, 0.03, 0.3, 0.0, -1e-9, -1e-3, -0.5, -0.99])
@pytest.mark.parametrize("weight", [1e-12, 1e-6, 1e-2, 10.0], ids=lambda w: f"W/EA={w:g}")
def test_grid(degrees, strain, weight):
    span = chord_span(100, degrees, strain, 1e6, weight * 1e6 * (1 + strain) / 100, 1.0)
    compare(span)


@pytest.mark.parametrize("degrees", [-90, -30, 0, 90])
@pytest.mark.parametrize("strain", [1e-12, 1e-6, 0.3])
def test_without_gravity_it_is_a_straight_bar(degrees, strain):
    """T = EA strain; K = EA/L along the chord and T/chord across it: Hooke's law."""
    cable = solve(chord_span(100, degrees, strain, 1e6, gravity=0.0))
    tension, length = 1e6 * strain, 100 / (1 + strain)
    assert cable.record.converged
    assert [cable.mean_tension, cable.max_tension, cable.min_tension] == pytest.approx([tension] * 3, rel=1e-14)
    assert cable.sag == pytest.approx(0, abs=4 * EPS * 100)
    expected = np.diag([1e6 / length, tension / 100, tension / 100])
    assert graded_error(cable.end_stiffness, expected) < 1e-13


@pytest.mark.parametrize("strain", [0.0, -1e-12, -0.5])
@pytest.mark.parametrize("degrees", [-90, 0, 30, 90])
def test_a_weightless_slack_cable_is_reported_as_not_converged(degrees, strain):
    good = chord_span(100, degrees, 1e-3, 1e6)
    bad = chord_span(100, degrees, strain, 1e6, gravity=0.0)
    assert not solve(bad).record.converged
    assert list(solve(batch([bad, good, bad])).record.converged) == [False, True, False]


def test_a_part_without_weight_that_a_load_leaves_slack():
    """2 m between ends 1.5 m apart, one above the other: the upper 1 m carries the load, the lower hangs loose."""
    up, load = 1.5, 3.0
    span = chord_span(up, 90, up / 2 - 1, 100.0, 0.0, 0.0, [(0.5, np.array([0, 0, -load]))])
    found = solve(span)
    assert found.record.converged
    assert found.slack
    assert found.tension[0].tolist() == [0.0, load]
    assert (found.min_tension, found.max_tension, found.mean_tension) == (0.0, load, load / 2)
    assert found.stretched_length == pytest.approx(2 + load / 100, rel=1e-15)
    assert not found.end_stiffness.any()
    assert np.isnan(found.sag)
    # taut by 1 %: the upper half stretches by 3 %, and the lower, which bears no thrust, is slack; by 0.3 %: it is not
    assert solve(chord_span(up, 90, 0.01, 100.0, 0.0, 0.0, [(0.5, np.array([0, 0, -load]))])).slack
    stiff = solve(chord_span(up, 90, 0.01, 1000.0, 0.0, 0.0, [(0.5, np.array([0, 0, -load]))]))
    lower = 1000 * 0.01 - load / 2
    assert stiff.tension[0] == pytest.approx([lower, lower + load], rel=1e-14)
    assert not stiff.slack


def loaded_bare_cables(count, seed):
    """Without weight, steep, taut by little against loads along and across: about half have a slack part."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        degrees = rng.choice([-1, 1]) * (90 - 10 ** rng.uniform(-6, 0))
        sizes, ways = 10 ** rng.uniform(-6, -1, 3), rng.choice([-1, 1], 3)
        forces = [
            (rng.uniform(0.02, 0.98), 10 ** rng.uniform(-3, 0) * np.array([*(size * rng.normal(size=2)), way]))
            for size, way in zip(sizes, ways, strict=True)
        ]
        chord, stiffness = 10 ** rng.uniform(-3, 6), 10 ** rng.uniform(1, 8)
        yield chord_span(chord, degrees, 10 ** rng.uniform(-4, -1) / stiffness, stiffness, 0.0, 0.0, forces)


def test_weightless_cables_with_loads_along_them():
    """Where a segment has no tension the energy has a kink, and Newton's method no slope to go by."""
    slack = 0
    for span in loaded_bare_cables(campaign(150, 40), 5):
        found = solve(span)
        assert found.record.converged
        assert found.record.steps < 120
        exact = exactly(span, found)
        slack += found.slack
        highest = exact.max_tension()
        assert found.slack == (exact.min_tension() < 1e-50 * highest)
        assert found.max_tension == pytest.approx(highest, rel=1e-12)
        assert found.min_tension == pytest.approx(exact.min_tension(), abs=1e-12 * highest)
        assert found.mean_tension == pytest.approx(exact.mean_tension(), rel=1e-12)
        assert found.stretched_length == pytest.approx(exact.stretched_length(), rel=1e-14)
    assert campaign(40, 8) < slack < campaign(110, 32)


@pytest.mark.crossed
@pytest.mark.parametrize("up", [1, -1])
@pytest.mark.parametrize("strain", [1e-12, 1e-6, 0.01, 0.3, 0.0, -1e-9, -1e-3, -0.5, -0.99])
@pytest.mark.parametrize("weight", [1e-6, 1e-3, 1.0, 100.0])
def test_vertical(up, strain, weight):
    """EA = 100 N, 10 m. Taut: T = EA strain + w (s - L/2). Slack: strands x L and (1 - x) L hang side by side."""
    length, taut = 10 / (1 + strain), 100 * strain >= weight / 2
    cable = solve(chord_span(10, 90 * up, strain, 100.0, weight / length, 1.0))
    assert cable.record.converged
    if taut:
        mean, highest, lowest = 100 * strain, 100 * strain + weight / 2, 100 * strain - weight / 2
        along = 100 / length
    else:
        x = (weight / 200 - strain) / (2 + weight / 100)
        mean, highest, lowest = weight * (x**2 + (1 - x) ** 2) / 2, weight * (1 - x), 0.0
        along = 1 / (length * (1 / 100 + 2 / weight))  # the fold climbs by 1/2 when an end does
    assert [cable.mean_tension, cable.max_tension, cable.min_tension] == pytest.approx(
        [mean, highest, lowest], rel=1e-12, abs=1e-13 * highest
    )
    assert cable.end_stiffness[0, 0] == pytest.approx(along, rel=1e-12)
    assert np.abs(cable.end_stiffness[0, 1:]).max() < 1e-50 * along
    if weight < 50 * strain:
        # K_yy = 1/integral of (1/EA + 1/T) ds, written so that a weight far below the tension does not cancel
        logarithm = 2 * math.atanh(weight / (2 * mean)) / weight
        assert np.diag(cable.end_stiffness)[1:] == pytest.approx(2 * [1 / length / (1 / 100 + logarithm)], rel=1e-11)
    elif not taut:
        assert not cable.end_stiffness[1:].any()


def test_vertical_is_the_limit_of_steep():
    """With a load across, nothing is singular at 90 degrees."""
    for strain in (-0.3, 1e-4, 0.05):
        loads = [(0.3, (0.5, 0.2, 0.1)), (0.6, (0.0, -0.4, 0.0))]
        upright = solve(chord_span(10, 90, strain, 100.0, 0.1, loads=loads))
        steep = Exact(chord_span(10, 90 - 1e-9, strain, 100.0, 0.1, loads=loads))
        assert upright.record.converged
        for name in QUANTITIES:
            assert getattr(upright, name) == pytest.approx(getattr(steep, name)(), rel=1e-9)
        assert graded_error(upright.end_stiffness, steep.end_stiffness()) < 1e-8


@pytest.mark.parametrize("loads", [False, True], ids=["plain", "point loads"])
def test_a_batch_equals_a_loop(loads):
    spans = [*random_cables(campaign(40, 12), 7, loads), *random_cables(campaign(20, 6), 8, loads, steep=True)]
    places = np.array([0.2, 0.9])
    for count in {len(span.load_positions) for span in spans}:
        chosen = [span for span in spans if len(span.load_positions) == count]
        together = solve(batch(chosen))
        assert together.record.converged.all()
        displacements, forces = together.at(np.broadcast_to(places, (len(chosen), 2)))
        for i, span in enumerate(chosen):
            alone = solve(span)
            for name in QUANTITIES:
                assert getattr(together, name)[i] == pytest.approx(getattr(alone, name), rel=1e-14), name
            assert together.sag[i] == pytest.approx(alone.sag, rel=1e-12, abs=1e-16 * span.chord)
            assert graded_error(together.end_stiffness[i], alone.end_stiffness) < 1e-12
            for several, one in zip((displacements, forces), alone.at(places), strict=True):
                assert np.allclose(several[i], one, rtol=1e-12, atol=1e-15 * np.abs(several).max())


def test_scalars_broadcast_against_arrays():
    """One cable with many chord strains, the fields that do not vary as scalars."""
    strains = np.array([0.01, 1e-3, -0.02])
    together = solve(paper_span().with_chord_strain(strains))
    alone = [solve(paper_span().with_chord_strain(strain)) for strain in strains]
    assert together.mean_tension == pytest.approx([float(one.mean_tension) for one in alone], rel=1e-14)
    assert together.sag == pytest.approx([float(one.sag) for one in alone], rel=1e-13)
    assert together.end_stiffness.shape == (3, 3, 3)


def test_place_of_a_load():
    """At a load, at an end, two at one place, and a load of nothing: equal to the sum, or to none at all."""
    plain = solve(paper_span())
    force = np.array([1.0, 2.0, -30.0])

    def loaded(*loads):
        return solve(span_between((0, 0, 0), (PAPER_CHORD, 0, 0), PAPER_LENGTH, EA, MASS, loads=loads))

    assert loaded((50.0, (0, 0, 0))).mean_tension == pytest.approx(plain.mean_tension, rel=1e-14)
    at_ends = solve(paper_span(loads=[(0.0, force), (1.0, -force)]))
    assert at_ends.record.converged
    assert at_ends.mean_tension == pytest.approx(plain.mean_tension, rel=1e-13)
    assert graded_error(at_ends.end_stiffness, plain.end_stiffness) < 1e-12
    twice = loaded((50.0, force), (50.0, force))
    assert twice.span.load_positions.shape == (1,)
    assert twice.mean_tension == pytest.approx(loaded((50.0, 2 * force)).mean_tension, rel=1e-15)
    apart = loaded((50.0, force), (50.0 + 1e-11, force))
    assert apart.mean_tension == pytest.approx(twice.mean_tension, rel=1e-11)
    assert twice.span.without_loads().load_forces.shape == (0, 3)


MANY = np.random.default_rng(5)
LOADED = {
    "eight buoys carry the weight exactly": chord_span(
        90, 0, -0.1, 1e6, 1.0, loads=[((i + 0.5) / 8, (0.0, 0.0, 981.0 / 8)) for i in range(8)]
    ),
    "no weight, pulled apart by two opposite loads": chord_span(
        90, 0, -0.1, 1e6, 1.0, 0.0, [(0.25, (0.0, 0.0, -50.0)), (0.75, (0.0, 0.0, 50.0))]
    ),
    "sixty loads": chord_span(
        100, 10, -0.02, 1e6, 0.5, loads=[(share, MANY.normal(size=3) * 40) for share in MANY.uniform(size=60)]
    ),
}


@pytest.mark.parametrize("span", LOADED.values(), ids=LOADED)
def test_loads(span):
    compare(span)


@pytest.mark.parametrize("up", [1, -1])
def test_a_load_upwards_lifts_the_cable(up):
    """A buoy of three times the cable's weight, and a load as heavy."""
    span = chord_span(90, 0, -0.1, 1e6, 1.0, loads=[(0.5, (0.0, 0.0, up * 3 * 100 * 9.81))])
    compare(span)
    assert up * solve(span).at(np.array([0.5]))[0][0, 1] > 0


@pytest.mark.parametrize("loads", [False, True], ids=["plain", "point loads"])
def test_cables_of_a_large_batch_have_the_digits_of_a_small_one(loads):
    """Those that have converged are left out of later steps of a large batch, and keep their digits."""
    spans = [span for span in random_cables(600, 9, loads) if len(span.load_positions) == (2 if loads else 0)]
    large = solve(batch(spans))
    steps = large.record.steps
    assert len(spans) > CABLE.many_cables < (steps < steps.max()).sum()
    small = solve(batch(spans[: CABLE.many_cables // 2]))
    first = slice(len(small.span.chord))
    for name in (*QUANTITIES, "end_stiffness", "sag", "mid_forces"):
        np.testing.assert_array_equal(getattr(large, name)[first], getattr(small, name))
    np.testing.assert_array_equal(steps[first], small.record.steps)
    np.testing.assert_array_equal(large.record.residual[: len(small.record.residual), first], small.record.residual)
