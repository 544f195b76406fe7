"""`cable/state.py`: tensions at the ends of elements and forces on the ends follow from equilibrium."""

import numpy as np
import pytest
from cables import EA, MASS, G, batch, chord_span, paper_span, solved
from references import bars
from scenes import INCLINED, PAPER, SAGGING, cells, scene

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.meshes import mesh_segments
from cablestudy.study.cable_columns import over_strength
from cablestudy.study.one_cable.case import CableCase

LOADS = [(8, (0.0, 0.0, 500.0)), (20, (30.0, -70.0, -400.0)), (31, (-20.0, 10.0, 0.0))]
CHAINS = {  # chord, degrees, unstretched length, EA, mass, loads at nodes of 40 bars
    "taut": (185.8, 0, 184.4883, EA, MASS, ()),
    "sagging": (185.8, 0, 186.0, EA, MASS, ()),
    "slack, inclined": (100.0, -30, 300.0, EA, MASS, ()),
    "loads, taut": (100.0, 0, 99.5, 1e5, 1.0, LOADS),
    "loads, slack": (100.0, 20, 140.0, 1e5, 1.0, LOADS),
}


@pytest.mark.parametrize("name", CHAINS)
def test_bars_against_the_exact_chain(name):
    """The tension vector of each bar, from 50 digits, with half of the bar's weight more or less at its ends."""
    chord, degrees, length, stiffness, mass, loads = CHAINS[name]
    shares = [(node / 40, force) for node, force in loads]
    span = chord_span(chord, degrees, chord / length - 1, stiffness, mass, loads=shares)
    _, state = solved(span, 40, 1)
    end = chord * np.array([span.cosine, 0.0, span.sine])
    chain = bars.solve_spatial(end, length, stiffness, mass * G, 40, loads)
    force = chain.tensions[:, None] * chain.vectors / np.linalg.norm(chain.vectors, axis=1)[:, None]
    local = np.linspace(-0.5, 0.5, 20001)  # over each bar
    along = force[:, None] + local[:, None] * [0, 0, mass * G * length / 40]
    tension = np.linalg.norm(along, axis=-1)
    assert state.edge_tensions == pytest.approx(tension[:, [0, -1]], rel=1e-10)
    assert state.max_tension == pytest.approx(tension.max(), rel=1e-10)
    assert state.min_tension == pytest.approx(tension.min(), rel=1e-7)
    assert state.end_forces("global") == pytest.approx(np.array([along[0, 0], -along[-1, -1]]), rel=1e-9, abs=1e-8)
    total = np.array([0, 0, -mass * G * length]) + sum((np.array(force) for _, force in loads), np.zeros(3))
    assert state.end_forces("global").sum(axis=0) == pytest.approx(total, abs=1e-9 * state.max_tension)
    places = np.array([0.0, 0.19, 0.2, 1.0])
    exact = [tension[0, 0], tension[7, 12000], tension[7, -1], tension[-1, -1]]
    assert state.at(places)[1] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("span", [paper_span(), paper_span(230.0), chord_span(100, -50, -0.4, 1e5, 2.0)])
def test_few_elements_of_high_order_show_the_tension_at_the_ends(span):
    """4 elements of order 12 showed 1.5e-3 too little of a slack cable, at the outermost Gauss point."""
    start, state = solved(span, 4, 12)
    assert state.max_tension == pytest.approx(start.max_tension, rel=1e-6)
    assert state.min_tension == pytest.approx(start.min_tension, rel=1e-6)
    exact = equilibrium.from_catenary(start, state.mesh)
    assert exact.max_tension == pytest.approx(start.max_tension, rel=1e-13)
    assert exact.min_tension == pytest.approx(start.min_tension, rel=1e-13)


def test_a_batch_equals_a_loop():
    spans = [paper_span(length, degrees) for length in (184.5, 186.0, 230.0) for degrees in (0, 40)]
    start = catenary.solve(batch(spans))
    together, _ = equilibrium.solve_many(start, mesh_segments([1.0], 3, 8))
    for index, span in enumerate(spans):
        _, alone = solved(span, 3, 8)
        assert (together.end_forces("global")[index] == alone.end_forces("global")).all()
        for name in ("max_tension", "min_tension", "edge_tensions"):
            assert (getattr(together, name)[index] == getattr(alone, name)).all(), name
            assert (getattr(together.take(index), name) == getattr(alone, name)).all(), name


@pytest.mark.parametrize("gravity", [9.81, 1.62])
def test_two_bars_hang_as_a_triangle(gravity):
    """Two inextensible bars, half of the weight at their joint: the sag is that of a triangle, T = W/(2 sin a)."""
    chord, length = 8.0, 10.0
    cable = f"{{chord: {chord}, elastic_modulus: 1e18, density: 1000, area: 1e-4, unstretched_length: {length}}}"
    found = cells(scene(f"cable={cable}", "model={elements: 2}", f"gravity={gravity}"), "sag", "horizontal_tension")
    depth = np.sqrt(length**2 - chord**2) / 2
    assert found["sag"] == pytest.approx(depth, rel=1e-9)
    joint = 1000 * 1e-4 * length * gravity / 2
    assert found["horizontal_tension"] == pytest.approx(joint / 2 * (chord / 2) / depth, rel=1e-9)


def test_the_strength_check_sees_the_tension_at_the_ends():
    """Steel, 300 m: 10 bars were below a strength of 11.79 MPa in the middle of the outermost bar."""
    steel = ("cable.density=7800", "cable.area=2.69 mm^2", "cable.unstretched_length=300 m", "cable.chord=185.8 m",
             "cable.strength=11.79 MPa", "gondola=null")  # fmt: skip
    exact = CableCase(scene(*steel, "model={accuracy: 1e-9}")).statics.max_tension
    for model in ("model={elements: 10}", "model={elements: 40}", "model={accuracy: 1e-6}"):
        case = CableCase(scene(*steel, model))
        assert case.statics.max_tension == pytest.approx(exact, rel=2e-3), model
        assert over_strength(case), model


@pytest.mark.parametrize("elements", [10, 40])
@pytest.mark.parametrize("twin", [PAPER, INCLINED, SAGGING])
def test_columns_have_the_tensions_at_the_ends_by_equilibrium(twin, elements):
    """The reaction is the force in the outermost bar, by hand from 50 digits, and half of that bar's weight."""
    chain, half = twin.chain(elements), np.array([0.0, 0.0, twin.mass * G * twin.length / elements / 2])
    force = chain.tensions[:, None] * chain.vectors / np.linalg.norm(chain.vectors, axis=1)[:, None]
    ends = np.linalg.norm(force[0] - half), np.linalg.norm(force[-1] + half)
    level = abs(force[0, 0])
    least = level if force[0, 2] < half[2] and force[-1, 2] > -half[2] else min(ends)  # of a lowest point, or an end
    for mass in ("lumped", "consistent", "blended"):
        model = f"model={{elements: {elements}, mass: {mass}}}"
        found = cells(twin.scene(model), "max_tension", "min_tension", "stress", "utilisation")
        assert found["max_tension"] == pytest.approx(max(ends), rel=1e-9)
        assert found["max_tension"] > chain.tensions.max()
        assert found["min_tension"] == pytest.approx(least, rel=1e-9)
        assert found["stress"] == pytest.approx(max(ends) / twin.area / 1e6, rel=1e-9)
        assert found["utilisation"] == pytest.approx(max(ends) / twin.area / 3000e6, rel=1e-9)
