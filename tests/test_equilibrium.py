"""`cable/equilibrium.py`: exact discrete equilibrium, wide ranges, and refusals with their reason and record."""

import itertools
import math
import pickle

import numpy as np
import pytest
from cables import EA, MASS, G, chord_span, graded_error, gradient, paper_span
from campaign import campaign
from mpmath import mp
from references import bars
from slack_chain import span_margin

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.assembly import SPATIAL, System
from cablestudy.cable.element import basis
from cablestudy.cable.geometry import midspan, sag_and_swing
from cablestudy.cable.meshes import mesh_segments
from cablestudy.cable.newton import REASONS, SLACK, NewtonRecord
from cablestudy.cable.stiffness import internal_forces
from cablestudy.errors import ConvergenceError

NEWTON_STEPS = 15  # the aim of the project


def solved(span, elements, order=1):
    start = catenary.solve(span)
    state, record = equilibrium.solve(start, mesh_segments(start.segments.fraction, elements, order))
    assert record.steps <= NEWTON_STEPS
    assert record.converged
    assert (state.tension > 0).all()
    return start, state


CHAINS = {  # a, b, L
    "taut": (185.8, 0.0, 184.4883),
    "sagging": (185.8, 0.0, 186.0),
    "inclined": (175.68, 60.49, 184.4883),
    "inclined, slack": (100.0, -20.0, 300.0),
    "steep": (20.0, 100.0, 103.0),
    "strain 1e-9": (100.0, 0.0, mp.mpf(100) / (1 + mp.mpf("1e-9"))),
}


@pytest.mark.crossed
@pytest.mark.parametrize(("a", "b", "length"), CHAINS.values(), ids=CHAINS)
@pytest.mark.parametrize("elements", [2, 7, 40])
def test_bars_equal_the_exact_chain(a, b, length, elements):
    """Tensions and places against the 50-digit chain."""
    with mp.workdps(40):
        chord = mp.hypot(a, b)
        strain = float((chord - length) / length)
    span = chord_span(float(chord), math.degrees(math.atan2(b, a)), strain, EA, MASS)
    if span_margin(span, mesh_segments([1.0], elements)) < 0:
        pytest.skip("a bar of this chain hangs slack")
    _, state = solved(span, elements)
    chain = bars.solve_spatial((a, 0, b), length, EA, MASS * G, elements)
    assert state.tension[:, 0] * state.force == pytest.approx(chain.tensions, rel=1e-10)
    place = state.displacement + np.outer(state.mesh.node_positions, [1 + strain, 0, 0])
    assert place * float(length) @ span.frame == pytest.approx(chain.nodes, abs=1e-11 * float(length))


def bar_tension_error(start, state):
    """Mean tension of the discrete cable against the closed form's, relative."""
    weights = state.mesh.sizes[:, None] * basis(state.mesh.order).weights
    return abs((weights * state.tension).sum() * state.force / start.mean_tension - 1)


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [-90, -89.9, -45, 0, 19, 80, 90])
@pytest.mark.parametrize("strain", [1e-9, 1e-6, 1e-3, 0.03])
def test_taut(degrees, strain):
    """W/EA = 1e-10: every size and order, and equal to the closed form."""
    span = chord_span(100, degrees, strain, 1e6, 1e-4 / 981, 9.81)
    for elements, order in itertools.product((1, 2, 40, 10_000), (1, 2, 3, 4)):
        start, state = solved(span, elements, order)
        # one bar has no sag; W/T is at most 0.1, and a parabola gives a share (W/T)^2/24 EA/T of the tension
        bend = (span.weight / start.mean_tension) ** 2 / 24 * span.axial_stiffness / start.mean_tension
        allowed = bend / (elements * order) ** 2 if order == 1 else bend / elements ** (2 * order)
        assert bar_tension_error(start, state) < max(2 * allowed, 1e-12)


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [-80, -45, 0, 19, 60])
@pytest.mark.parametrize("ratio", [1.0, 1.001, 1.1, 2.0, 3.0])
def test_slack(degrees, ratio):
    """Unstretched length up to three chords: the finer, the closer to the closed form."""
    span = chord_span(100, degrees, 1 / ratio - 1, 1e6, 1.0)
    errors = [bar_tension_error(*solved(span, elements, 1)) for elements in (100, 1000, 10_000)]
    assert errors[0] > 30 * errors[1] > 900 * errors[2] or errors[1] < 1e-10
    for order in (2, 3, 4):
        start, state = solved(span, 256, order)
        assert bar_tension_error(start, state) < errors[1]


def random_cables(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        near = 90 - 10 ** rng.uniform(-9, 0)
        degrees = rng.choice([0, rng.uniform(-90, 90), 90, -90, near, -90 + 10 ** rng.uniform(-3, 1)])
        taut = 10 ** rng.uniform(-9, np.log10(0.03))
        strain = rng.choice([taut, -(10 ** rng.uniform(-9, -1)), 1 / rng.uniform(1, 3) - 1])
        chord, stiffness = 10 ** rng.uniform(0, 3), 10 ** rng.uniform(2, 10)
        weight = stiffness * 10 ** rng.uniform(-9, -1)
        elements = int(rng.choice([1, 2, 3, 5, 10, 40, 100]))
        loads = [
            (rng.uniform(0.01, 0.99), rng.normal(size=3) * weight * 10 ** rng.uniform(-2, 1) * [1, rng.integers(2), 1])
            for _ in range(min(rng.integers(0, 3), elements - 1))
        ]
        yield chord_span(chord, degrees, strain, stiffness, weight * (1 + strain) / chord, 1.0, loads), elements


def test_bars_converge_if_and_only_if_none_hangs_slack():
    """Whether a bar hangs slack follows from geometry alone: every refusal is for that reason alone."""
    outcomes = []
    for span, elements in random_cables(campaign(80, 20), 21):
        start = catenary.solve(span)
        assert start.record.converged
        mesh = mesh_segments(start.segments.fraction, elements)
        taut = span_margin(span, mesh) > 0
        outcomes.append(taut)
        if taut:
            _, state = solved(span, elements)
            forces = internal_forces(state) / state.force
            outside = equilibrium.external_forces(span, mesh, state.force)
            assert np.abs(forces - outside)[1:-1].max(initial=0) < 1e-12
        else:
            with pytest.raises(ConvergenceError, match=r"too few elements .* sharp a bend.* slack"):
                equilibrium.solve(start, mesh)
    assert campaign(10, 2) < sum(outcomes) < campaign(70, 18)


def tension_only(span, mesh):
    """Strains at the Gauss points of the cable that bears no compression: least energy by a guarded Newton iteration.

    Energy: sum of w EA/2 max(|r'| - 1, 0)^2 - f . r, convex; in the plane, lengths in L, forces in EA.
    """
    derive, weights = gradient(mesh), mesh.point_weights.ravel()
    loads = equilibrium.external_forces(span, mesh, span.axial_stiffness)[:, :2]
    end = np.array([1 + span.chord_strain, 0.0])

    def energy(unknown):
        place = np.vstack([np.zeros(2), unknown.reshape(-1, 2), end])
        slope = derive @ place
        stretch = np.linalg.norm(slope, axis=-1)
        strain = np.maximum(stretch - 1, 0)
        t = slope / stretch[:, None]
        force = derive.T @ ((weights * strain)[:, None] * t) - loads
        along = t[:, :, None] * t[:, None, :]
        D = (stretch > 1)[:, None, None] * along + (strain / stretch)[:, None, None] * (np.eye(2) - along)
        stiff = np.einsum("k,ki,kj,kab->iajb", weights, derive, derive, D, optimize=True)
        value = (weights * strain**2).sum() / 2 - (loads * place).sum()
        return value, force[1:-1].ravel(), stiff[1:-1, :, 1:-1].reshape(len(unknown), -1), stretch - 1

    unknown = (np.linspace(0, 1, mesh.nodes)[1:-1, None] * end + [0, -0.05]).ravel()
    value, force, stiff, strain = energy(unknown)
    damping, scale = 1e-3, np.abs(loads).max()
    for _ in range(3000):
        if np.abs(force).max() < 1e-10 * scale:
            return strain
        trial = unknown - np.linalg.solve(stiff + damping * np.eye(len(unknown)), force)
        result = energy(trial)
        if result[0] <= value:
            unknown, (value, force, stiff, strain), damping = trial, result, max(damping / 5, 1e-15)
        else:
            damping *= 4
    return None


def test_higher_orders_converge_if_and_only_if_no_point_is_slack():
    """Against the least energy of a cable without compression, found by another method from another start."""
    rng, outcomes = np.random.default_rng(4), []
    for _ in range(30):
        degrees = rng.choice([0, rng.uniform(-90, 90), 90 - 10 ** rng.uniform(-3, 1.3)])
        strain = rng.choice([10 ** rng.uniform(-9, -1.5), -(10 ** rng.uniform(-4, -1)), 1 / rng.uniform(1, 3) - 1])
        weight = 100 * 10 ** rng.uniform(-3, -1)
        span = chord_span(10, degrees, strain, 100.0, weight * (1 + strain) / 10, 1.0)
        start = catenary.solve(span)
        mesh = mesh_segments([1.0], int(rng.choice([1, 2, 5])), int(rng.integers(2, 5)))
        expected = tension_only(span, mesh)
        if expected is None or abs(expected.min()) < 1e-7 * expected.max():
            continue
        outcomes.append(expected.min() > 0)
        if outcomes[-1]:
            state, _ = equilibrium.solve(start, mesh)
            assert np.abs(state.tension.ravel() * state.force / 100 - expected).max() < 1e-6 * expected.max()
        else:
            with pytest.raises(ConvergenceError, match="slack"):
                equilibrium.solve(start, mesh)
    assert {True, False} == set(outcomes)


def test_a_load_at_an_element_boundary_of_its_own_making():
    """One element a segment; and a load that coincides with a boundary of an even mesh: the same cable."""
    span = chord_span(100, 10, -0.01, 1e6, 1.0, loads=[(0.25, (0, 0, -300)), (0.5, (0, 20, 0)), (0.75, (0, 0, 100))])
    coarse = solved(span, 4, 20)[1]
    fine = solved(span, 8, 12)[1]
    assert coarse.displacement[::20] == pytest.approx(fine.displacement[::24], abs=1e-11)
    start = catenary.solve(span)
    assert bar_tension_error(start, coarse) < 1e-11


@pytest.mark.parametrize("gap", [1e-4, 1e-9, 1e-12, 0.0])
@pytest.mark.parametrize("place", [0.0, 0.5])
def test_loads_a_hair_apart_or_at_an_end(gap, place):
    """An element 1e-9 long keeps its digits; closer than 1e-11 two loads, or a load and an end, share a node."""
    loads = [(place, (0, 0, -5.0)), (place + gap, (0, 3.0, -5.0))]
    span = chord_span(10, 0, 0.01, 1e5, loads=loads)
    start, state = solved(span, 10, 4)
    K = System(state, SPATIAL).end_stiffness * state.force / span.unstretched_length
    assert graded_error(K, start.end_stiffness) < 1e-9


@pytest.mark.parametrize("strain", [0.0, -1e-12, -0.5])
def test_one_slack_bar_is_refused(strain):
    with pytest.raises(ConvergenceError, match=r"1 .*of order 1.* slack") as caught:
        solved(chord_span(10, 20, strain, 1e6), 1)
    record = caught.value.record
    assert isinstance(record, NewtonRecord)
    assert record.steps >= 1
    assert str(record).endswith(REASONS[SLACK])
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


@pytest.mark.parametrize("order", [1, 4])
@pytest.mark.parametrize("up", [1, -1])
def test_a_folded_vertical_cable_is_refused(up, order):
    """At the fold the tension is nothing: no number of elements helps."""
    for elements in (1, 10, 101):
        with pytest.raises(ConvergenceError, match="slack") as caught:
            solved(chord_span(10, 90 * up, -0.3, 1e6, 1.0), elements, order)
        assert caught.value.record.steps


def test_a_taut_vertical_cable_whose_lower_end_nearly_slackens():
    """T = EA strain - W/2 at the foot, W/1000 above slack: still one cable; just below it, a refusal."""

    def upright(excess, weight=1e3):
        strain = (0.5 + excess) * weight / 1e6
        span = chord_span(10, 90, strain, 1e6, weight * (1 + strain) / 10, 1.0)
        start, state = solved(span, 50, 3)
        return start, state, 1e6 * strain + weight * (state.mesh.point_positions - 0.5)

    start, state, expected = upright(1e-3)
    assert state.tension * state.force == pytest.approx(expected, rel=1e-9)
    assert bar_tension_error(start, state) < 1e-12
    with pytest.raises(ConvergenceError, match="slack"):
        upright(-1e-1)


def test_sag_and_interpolation():
    """Order 16: the closed form between the nodes too; 40 bars: the straight pieces between exact nodes."""
    places = np.linspace(0, 1, 37)
    for span in (paper_span(), paper_span(186.0, degrees=19), chord_span(100, -30, -0.4, 1e5), paper_span(degrees=90)):
        start, state = solved(span, 8, 16)
        assert sag_and_swing(state, midspan(state, start.middle))[0] == pytest.approx(float(start.sag), rel=1e-9)
        displacement, tension = state.at(places)
        exact, force = start.at(places)
        assert np.abs(displacement - exact).max() < 1e-10
        assert tension == pytest.approx(np.linalg.norm(force, axis=1), rel=1e-7)
    chain = bars.solve_spatial((185.8, 0, 0), 186.0, EA, MASS * G, 40)
    start, state = solved(paper_span(186.0), 40)
    assert sag_and_swing(state, midspan(state))[0] == pytest.approx(-chain.nodes[20, 2], rel=1e-9)


def test_the_record():
    start = catenary.solve(paper_span(186.0))
    _, record = equilibrium.solve(start, mesh_segments([1.0], 40))
    assert record.correction[-1] < 1e-6 > record.residual[-1]
    assert ((record.share > 0) & (record.share <= 1)).all()
    assert str(record).startswith(f"{record.steps} steps ({record.correction[0]:.1e}, ")
    assert str(record).endswith("; converged")
