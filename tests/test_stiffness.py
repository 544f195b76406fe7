"""`cable/stiffness.py`: forces as the gradient of the energy, K_E + K_G as their derivative, the paper's bars."""

from pathlib import Path

import numpy as np
import pytest
from cables import CABLES, graded_error, paper_span, state_of
from references import dense
from scipy.sparse import issparse

from cablestudy.cable import equilibrium
from cablestudy.cable.assembly import SPATIAL, System
from cablestudy.cable.element import basis
from cablestudy.cable.stiffness import internal_forces, state_at, tangent_stiffness

each_cable = pytest.mark.parametrize("span", CABLES.values(), ids=CABLES)
STEP = 1e-30j
each_order = pytest.mark.parametrize("order", [1, 2, 3, 8])


def positions_of(state):
    """Of the nodes in the chord frame, end 1 in the origin. [m]"""
    span = state.span
    chord = np.outer(state.mesh.node_positions, [1 + span.chord_strain, 0, 0])
    return (state.displacement + chord) * span.unstretched_length


def energy(span, mesh, positions):
    """Integral of EA/2 (|r'| - 1)^2 over the unstretched length, element by element. [J]"""
    element, total = basis(mesh.order), 0.0
    for e in range(mesh.elements):
        size = mesh.sizes[e] * span.unstretched_length
        slope = element.derivative @ positions[e * mesh.order : (e + 1) * mesh.order + 1] / size
        strain = np.sqrt((slope**2).sum(axis=1)) - 1
        total += size * span.axial_stiffness / 2 * (element.weights @ strain**2)
    return total


@each_cable
@each_order
def test_forces_are_the_gradient_of_the_energy_at_any_place_of_the_nodes(span, order):
    """Complex step: Im U(r + i h e)/h, exact to rounding; nodes displaced at random by 5 % of the cable, ends too."""
    state = state_of(span, 4, order)
    mesh = state.mesh
    rng = np.random.default_rng(order)
    places = positions_of(state) + 0.05 / mesh.elements / order * span.chord * rng.normal(size=(mesh.nodes, 3))
    found, expected = internal_forces(state_at(span, mesh, places)), np.empty_like(places)
    for place in np.ndindex(places.shape):
        moved = places.astype(complex)
        moved[place] += STEP
        expected[place] = energy(span, mesh, moved).imag / abs(STEP)
    assert found == pytest.approx(expected, abs=1e-12 * abs(found).max())


@pytest.mark.crossed
@each_cable
@each_order
@pytest.mark.parametrize("displaced", [False, True])
def test_the_tangent_is_the_derivative_of_the_forces(span, order, displaced):
    """Complex step: Im f(r + i h e)/h for every degree of freedom, in equilibrium and out of it."""
    state = state_of(span, 4, order)
    places = positions_of(state)
    if displaced:
        places = places + 1e-2 / order * span.chord * np.random.default_rng(1).normal(size=places.shape)
    K = sum(tangent_stiffness(state_at(span, state.mesh, places) if displaced else state)).toarray()
    for column, place in enumerate(np.ndindex(places.shape)):
        moved = places.astype(complex)
        moved[place] += STEP
        derivative = internal_forces(state_at(span, state.mesh, moved)).imag.ravel() / abs(STEP)
        assert np.abs(derivative - K[:, column]).max() < 1e-8 * np.abs(K[:, column]).max()


@each_cable
@each_order
def test_a_state_in_equilibrium(span, order):
    """The same state from its node positions, as far as these determine strains; weight and loads are in balance."""
    state = state_of(span, 6, order)
    again = state_at(span, state.mesh, positions_of(state))
    rounding = 2e-16 * 6 * (1 + order**2)  # of places of the nodes, times the derivative
    assert again.tension == pytest.approx(state.tension * state.compliance, abs=rounding)
    assert again.direction == pytest.approx(state.direction, abs=1e-13)
    assert again.displacement == pytest.approx(state.displacement, abs=1e-15)
    outer = equilibrium.external_forces(span, state.mesh, 1.0)
    for one, digits in ((state, 1e-13 * state.force), (again, (1 + order) * rounding * span.axial_stiffness)):
        forces = internal_forces(one)
        assert np.abs(forces - outer)[1:-1].max() < digits
        assert internal_forces(one, "global") == pytest.approx(forces @ span.frame, abs=digits)
    # the ends hold the rest: their own share of the weight less the force of the cable
    ends = internal_forces(state)[[0, -1]] - outer[[0, -1]]
    assert ends == pytest.approx(-state.end_forces(), abs=1e-12 * state.force)


@each_cable
@each_order
def test_rigid_motions(span, order):
    """Translations strain nothing; a rotation only turns the forces: K (a x r) = a x f."""
    state = state_of(span, 6, order)
    K, places, forces = sum(tangent_stiffness(state)), positions_of(state), internal_forces(state)
    scale = abs(K).max()
    for axis in np.eye(3):
        assert np.abs(K @ np.tile(axis, state.mesh.nodes)).max() < 1e-13 * scale
        turned = (K @ np.cross(axis, places).ravel()).reshape(-1, 3)
        assert np.abs(turned - np.cross(axis, forces)).max() < 1e-12 * scale * span.unstretched_length


@each_cable
@each_order
def test_both_parts_are_sparse_symmetric_and_positive_with_only_translations_free(span, order):
    state = state_of(span, 6, order)
    parts = tangent_stiffness(state)
    for part in (*parts, sum(parts)):
        assert issparse(part)
        assert part.shape == (3 * state.mesh.nodes, 3 * state.mesh.nodes)
        assert part.nnz <= 9 * state.mesh.elements * (order + 1) ** 2
        assert abs(part - part.T).max() < 1e-14 * abs(part).max()
        assert np.linalg.eigvalsh(part.toarray())[0] > -1e-13 * abs(part).max() * order**2
    values = np.linalg.eigvalsh(sum(parts).toarray())
    assert (values < 1e-12 * values[-1]).sum() == 3


@each_cable
@each_order
def test_condensed_it_is_the_end_stiffness_of_the_force_method(span, order):
    """K22 - K21 K11^-1 K12 of end 2, by dense algebra, against (sum of w A)^-1; in global axes against its rotation."""
    state = state_of(span, 6, order)
    system = System(state, SPATIAL)
    expected = system.end_stiffness * state.force / span.unstretched_length
    for frame, turn in (("chord", np.eye(3)), ("global", span.frame)):
        K = sum(tangent_stiffness(state, frame)).toarray()
        condensed = dense.condensed(K[3:, 3:], np.arange(len(K) - 6, len(K) - 3))
        assert graded_error(turn @ condensed @ turn.T, expected) < 1e-9


@each_cable
@pytest.mark.parametrize("elements", [3, 40])
def test_bars_are_the_papers_bars(span, elements):
    """n n^T EA/L0e and F/|r| (I - n n^T) of each bar, from the ends of the bars."""
    state = state_of(span, elements)
    places, lengths = positions_of(state), state.mesh.sizes * span.unstretched_length
    expected = np.zeros((2, 3 * state.mesh.nodes, 3 * state.mesh.nodes))
    for i, (unstretched, bar) in enumerate(zip(lengths, np.diff(places, axis=0), strict=True)):
        length = np.linalg.norm(bar)
        axis = np.outer(bar, bar) / length**2
        force = state.tension[i, 0] * state.force
        assert force == pytest.approx(span.axial_stiffness * (length / unstretched - 1), rel=1e-8)
        block, pattern = slice(3 * i, 3 * i + 6), [[1, -1], [-1, 1]]
        expected[0][block, block] += np.kron(pattern, axis * span.axial_stiffness / unstretched)
        expected[1][block, block] += np.kron(pattern, (np.eye(3) - axis) * force / length)
    for part, textbook in zip(tangent_stiffness(state), expected, strict=True):
        assert np.abs(part.toarray() - textbook).max() < 1e-11 * np.abs(textbook).max()


def test_the_example_of_the_documentation():
    """docs/physics.md runs, and ends with the end stiffness of the force method and of the closed form."""
    text = (Path(__file__).parents[1] / "docs" / "physics.md").read_text(encoding="utf-8")
    names = {}
    exec(text.partition("```python\n")[2].partition("```")[0], names)
    frame, span, state = names["span"].frame, names["span"], names["state"]
    assert names["K"].shape == (123, 123)
    assert names["forces"][1:-1] == pytest.approx(np.tile([0, 0, -float(span.weight) / 40], (39, 1)), abs=1e-9)
    condensed = frame @ names["condensed"] @ frame.T
    stiffness = System(state, SPATIAL).end_stiffness * state.force / span.unstretched_length
    assert graded_error(condensed, stiffness) < 1e-9
    assert graded_error(condensed, names["closed_form"].end_stiffness) < 1e-4  # 40 bars


def test_the_frame_is_named():
    with pytest.raises(ValueError, match="'local', not 'chord' or 'global'"):
        internal_forces(state_of(paper_span()), "local")
