"""One element of order 16 against the continuous cable: statics, frequencies, participation, end stiffness."""

import math

import cables
import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, Exact, G, chord_span, graded_error, paper_span
from references import continuous_cable

from cablestudy.cable import catenary
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.element import basis
from cablestudy.cable.geometry import midspan, sag_and_swing

CABLES = {
    "taut": paper_span(),
    "sag 1:45 (Table 6, last row)": paper_span(186.0),
    "inclined 19 degrees": paper_span(degrees=19),
    "inclined 19 degrees, sag 1:45": paper_span(186.0, degrees=19),
}
each_cable = pytest.mark.parametrize("span", CABLES.values(), ids=CABLES)


def solved(span, elements=1, order=16, mass="lumped"):
    start, state = cables.solved(span, elements, order, mass)
    return start, state, Dynamics(state)


def continuous(span, count, plane):
    exact = Exact(span)
    a, b = exact.chord * exact.c, exact.chord * exact.s
    return continuous_cable.modes(float(a), float(b), float(exact.L), span.axial_stiffness, MASS, G, count, plane)


@each_cable
def test_statics(span):
    """Tension at the Gauss points and places of the nodes, 1e-9, against the 50-digit catenary."""
    _, state, _ = solved(span)
    exact, positions = Exact(span), state.mesh.point_positions[0]
    expected = np.array([np.linalg.norm(exact.at(share)[1]) for share in positions])
    assert state.tension[0] * state.force == pytest.approx(expected, rel=1e-9)
    places = np.array([exact.at(share)[0] for share in state.mesh.node_positions])
    depth = np.abs(places[:, 1]).max()
    assert np.abs(state.displacement - places).max() < 1e-9 * depth
    mean = float(basis(16).weights @ state.tension[0]) * state.force
    assert mean == pytest.approx(exact.mean_tension(), rel=1e-9)
    assert sag_and_swing(state, midspan(state))[0] == pytest.approx(exact.sag(), rel=1e-9)


def lowest(span, count, **loads):
    """Of the continuous cable, in and out of the plane together. [Hz]"""
    exact = Exact(span)
    a, b = float(exact.chord * exact.c), float(exact.chord * exact.s)
    cable = a, b, float(exact.L), span.axial_stiffness, MASS, G, count
    planes = [continuous_cable.modes(*cable, plane, **loads) for plane in ("in", "out")]
    assert max(plane.error for plane in planes) < 1e-10
    return np.sort(np.concatenate([plane.frequencies for plane in planes]))[:count]


@each_cable
def test_first_eight_frequencies(span):
    assert solved(span)[2].lowest(8).frequency == pytest.approx(lowest(span, 8), rel=1e-8)


@each_cable
def test_participation_and_end_stiffness(span):
    *_, model = solved(span, 2)
    found = model.lowest(12)
    inside = continuous(span, 5, "in")
    force = np.abs(inside.end_forces[:, 1] @ span.frame[:2].T)  # along and across the chord
    ours = np.abs(found.participation[found.select("in-plane")[:5], :2])
    assert ours == pytest.approx(force, rel=1e-6, abs=1e-7 * force.max())
    assert graded_error(model.end_stiffness, Exact(span).end_stiffness()) < 1e-8


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [0, 30, 71])
@pytest.mark.parametrize("ratio", [1e4, 1e7, 1e10])
def test_an_almost_inextensible_cable_keeps_its_transverse_modes(degrees, ratio):
    """EA/T to 1e10, inclined, slightly sagging: frequencies to 1e-8, whatever the axes."""
    length = 100.02
    span = chord_span(100, degrees, (100 - length) / length, 1.0)
    tension = float(catenary.solve(chord_span(100, degrees, (100 - length) / length, 1e12)).mean_tension)
    span = chord_span(100, degrees, span.chord_strain, ratio * tension)
    *_, model = solved(span, 2)
    a, b = 100 * math.cos(math.radians(degrees)), 100 * math.sin(math.radians(degrees))
    L = float(Exact(span).L)
    for plane, kind in (("in", "in-plane"), ("out", "out-of-plane")):
        exact = continuous_cable.modes(a, b, L, span.axial_stiffness, 1.0, G, 6, plane)
        found = model.lowest(16)
        kinds = [k for k in range(16) if (found.kind[k] == "out-of-plane") == (kind == "out-of-plane")]
        assert found.frequency[kinds[:6]] == pytest.approx(exact.frequencies, rel=1e-8)


def test_point_loads():
    """Loads in the plane, at segment boundaries: against the continuous cable with kinks."""
    loads = [(0.3, (20.0, 0.0, -150.0)), (0.8, (0.0, 0.0, 60.0))]
    span = chord_span(PAPER_CHORD, 19, (PAPER_CHORD - 186.0) / 186.0, EA, MASS, loads=loads)
    _, state, model = solved(span, 3)
    world = [(share * float(Exact(span).L), force) for share, force in loads]
    assert model.lowest(8).frequency == pytest.approx(lowest(span, 8, loads=world), rel=1e-8)
    assert graded_error(model.end_stiffness, Exact(span).end_stiffness()) < 1e-8
    assert state.mesh.elements == 3


def test_loads_in_space_have_the_exact_end_stiffness():
    span = chord_span(100, -20, -0.05, 1e5, loads=[(0.3, (10, 60, -150)), (0.5, (0, -80, 90)), (0.9, (0, 0, 20))])
    *_, model = solved(span, 8, 16)
    assert graded_error(model.end_stiffness, Exact(span).end_stiffness()) < 1e-8
    assert graded_error(model.end_stiffness, catenary.solve(span).end_stiffness) < 1e-8
