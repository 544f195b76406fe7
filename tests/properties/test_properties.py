"""Laws that hold for every cable: scaling, rotation, mirror image, gravity and load reversed, order.

Reproducible: examples are derandomised, and bounded in number.
"""

import math

import numpy as np
from cables import chord_span, full_stiffness, graded_error, span_between
from campaign import campaign
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from slack_chain import span_margin

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.assembly import SPATIAL, System
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.meshes import mesh_segments
from cablestudy.cable.stiffness import internal_forces

PROFILE = settings(
    derandomize=True,
    max_examples=campaign(40, 12),
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)


def powers(low, high):
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


inclinations = st.one_of(st.sampled_from([0.0, 19.0]), st.floats(-85, 85))
strains = st.one_of(powers(-9, -1.5), powers(-9, -1).map(lambda x: -x), st.floats(1, 3).map(lambda x: 1 / x - 1))
weights = powers(-8, -2)  # over EA
shares = st.floats(0.02, 0.98)
forces = st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3))
load_lists = st.lists(st.tuples(shares, forces), max_size=3, unique_by=lambda load: round(load[0], 2))


def solved(span, elements=12, order=4):
    start = catenary.solve(span)
    assert start.record.converged
    mesh = mesh_segments(start.segments.fraction, elements, order)
    assume(start.min_tension > 0.03 * start.max_tension)  # sharper bends need more elements than these
    state, record = equilibrium.solve(start, mesh)
    assert record.steps <= 15
    return start, state, Dynamics(state)


def cable(degrees, strain, weight, loads, chord=10.0, stiffness=1e5, azimuth=0.0, gravity=9.81):
    scaled = [(share, np.array(force) * weight * stiffness) for share, force in loads]
    mass = weight * stiffness * (1 + strain) / (chord * 9.81)
    return chord_span(chord, degrees, strain, stiffness, mass, gravity, scaled, azimuth)


@PROFILE
@given(inclinations, strains, weights, load_lists, st.floats(-math.pi, math.pi))
def test_rotation_about_the_vertical(degrees, strain, weight, loads, angle):
    """Turned ends and loads: same frequencies, turned stiffness."""
    R = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    end = 10 * np.array([math.cos(math.radians(degrees)), 0, math.sin(math.radians(degrees))])
    length, EA = 10 / (1 + max(strain, 1e-4) if strain > 0 else 1 + min(strain, -1e-4)), 1e5
    mass = weight * EA / length / 9.81
    frequencies, stiffnesses = [], []
    for turn in (np.eye(3), R):
        world = [(share * length, turn @ np.array(force) * weight * EA) for share, force in loads]
        span = span_between((1, 2, 3), np.array([1, 2, 3]) + turn @ end, length, EA, mass, 9.81, world)
        # a turned in-plane load may leave the plane by its last digit: then the model is spatial, the answer the same
        model = solved(span)[2]
        frequencies.append(model.lowest(8).frequency)
        stiffnesses.append(turn.T @ span.frame.T @ model.end_stiffness @ span.frame @ turn)
    assert graded_error(*stiffnesses) < 1e-7
    assert np.allclose(*frequencies, rtol=1e-7, atol=0)


@PROFILE
@given(inclinations, strains, weights, load_lists)
def test_seen_from_the_other_end(degrees, strain, weight, loads):
    """The mirror image: inclination reversed, loads mirrored. Same frequencies, tension, stiffness of either end."""
    mirrored = [(1 - share, (-force[0], force[1], force[2])) for share, force in loads]
    first, state_1, one = solved(cable(degrees, strain, weight, loads))
    second, state_2, two = solved(cable(-degrees, strain, weight, mirrored))
    assert math.isclose(first.mean_tension, second.mean_tension, rel_tol=1e-10)
    flip = np.diag([-1, 1, 1])  # e turns round; n and y stay
    assert graded_error(flip @ first.end_stiffness @ flip, second.end_stiffness) < 1e-8
    # a tie of the shares of two segments may give the odd element to either
    if np.allclose(state_1.mesh.edges, 1 - state_2.mesh.edges[::-1], atol=1e-12):
        assert np.allclose(one.lowest(8).frequency, two.lowest(8).frequency, rtol=1e-8, atol=0)


@PROFILE
@given(inclinations, strains, weights, load_lists, st.sampled_from([1, 2, 3, 5]))
def test_the_static_form_is_in_balance(degrees, strain, weight, loads, order):
    """Forces on every node add up to nothing; tensions are positive; it fails only where a bar is slack by geometry."""
    span = cable(degrees, strain, weight, loads)
    start = catenary.solve(span)
    mesh = mesh_segments(start.segments.fraction, 12, order)
    if order == 1:
        assume(span_margin(span, mesh) > 0)
    else:
        assume(start.min_tension > 1e-2 * start.max_tension)
    state, _ = equilibrium.solve(start, mesh)
    system = System(state, SPATIAL)
    inner = internal_forces(state) / state.force - equilibrium.external_forces(span, mesh, state.force)
    assert np.abs(inner[1:-1]).max() < 1e-12
    assert (state.tension > 0).all()
    values = np.linalg.eigvalsh(full_stiffness(system))
    assert values[0] > -1e-12 * values[-1]
    assert np.linalg.eigvalsh(system.end_stiffness).min() > 0


@PROFILE
@given(inclinations, strains, weights, load_lists)
def test_closed_form_and_elements_agree(degrees, strain, weight, loads):
    """Two independent ways to the end stiffness, order 10."""
    span = cable(degrees, strain, weight, loads)
    start, _, model = solved(span, 24, 10)
    assert graded_error(model.end_stiffness, start.end_stiffness) < 1e-6
