"""`cable/symmetry.py`: the symmetric and antisymmetric modes of a level cable, against the whole solved at once."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from cables import EA, MASS, batch, chord_span, full_stiffness, paper_span

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE
from cablestudy.cable.dynamics import PLANAR, Dynamics
from cablestudy.cable.element import Mesh
from cablestudy.cable.meshes import mesh_segments

SPANS = {
    "taut": paper_span(),
    "sagging": paper_span(186.0),
    "slack": chord_span(100, 0, -0.4, EA, MASS),
    "deep": chord_span(10, 0, -0.9, EA, MASS),
}
MESHES = [(2, 1), (3, 1), (5, 1), (40, 1), (1, 8), (1, 9), (2, 7), (3, 4)]


def state_of(span, elements, order, mass="lumped", closed=False):
    start = catenary.solve(span)
    mesh = mesh_segments(start.segments.fraction, elements, order, mass)
    return equilibrium.from_catenary(start, mesh) if closed else equilibrium.solve(start, mesh)[0]


def mirror_image(shapes, axes):
    """Shapes of the inner nodes, shape (nodes, d, k), in a mirror at right angles to the chord."""
    return shapes[::-1] * np.where(np.array(axes) == 0, -1, 1)[:, None]


@pytest.mark.crossed
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("axes", [IN_PLANE, OUT_OF_PLANE], ids=["in plane", "out of plane"])
@pytest.mark.parametrize(("elements", "order"), MESHES)
@pytest.mark.parametrize("span", SPANS.values(), ids=SPANS)
def test_halves_have_the_modes_of_the_whole(span, elements, order, axes, mass):
    """Frequencies and symmetry against a dense solution with K in displacements, all nodes at once."""
    state = state_of(span, elements, order, mass, closed=elements < 40)  # few bars do not hang as deep
    assert state.mirror_symmetric
    model = Dynamics(state, (axes,))
    found, d, nodes = model.lowest(model.dof), len(axes), state.mesh.nodes - 2
    assert len(found) == nodes * d
    assert found.complete
    M = model.systems[0].mass.toarray()
    value, vector = scipy.linalg.eigh(full_stiffness(model.systems[0])[d:-d, d:-d], M)
    square = (found.frequency / model.unit_frequency) ** 2
    assert square == pytest.approx(value, rel=1e-11, abs=1e-13 * value[-1])
    images = mirror_image(vector.reshape(nodes, d, -1), axes).reshape(nodes * d, -1)
    even = np.einsum("ik,ij,jk->k", vector, M, images)
    near = np.diff(value, prepend=-np.inf, append=np.inf) < 1e-8 * value[-1]  # of two such the dense shapes are mixed
    alone = ~(near[1:] | near[:-1])
    assert alone.mean() >= 0.5  # both sides of a deep cable swing nearly by themselves: pairs
    assert np.abs(even[alone]) == pytest.approx(1, abs=1e-6)
    # the sign of a shape's image, where a symmetric axial mode is odd
    names = zip(found.symmetry, found.kind, strict=True)
    sign = np.array([1 if (word == "symmetric") != (kind == "axial") else -1 for word, kind in names])
    assert (np.sign(even[alone]) == sign[alone]).all()
    # every shape is its own image, or the opposite, to rounding; and all are orthonormal
    shapes = found.shapes[1:-1][:, axes] * np.sqrt(span.mass * span.unstretched_length)
    assert mirror_image(shapes, axes) == pytest.approx(sign * shapes, abs=1e-12 * np.abs(shapes).max())
    flat = shapes.reshape(nodes * d, -1)
    assert flat.T @ M @ flat == pytest.approx(np.eye(nodes * d), abs=1e-9)


@pytest.mark.parametrize("ratio", [1e1, 1e5, 1e10], ids=lambda ratio: f"EA over T {ratio:.0e}")
@pytest.mark.parametrize("elements", [2, 3, 20, 39])
def test_a_straight_chain_of_bars_keeps_its_digits(elements, ratio):
    """Weightless: springs EA/l0 along and T/l across between equal masses, in closed form, however stiff."""
    span = chord_span(100, 0, 1 / ratio, 1e6, gravity=0.0)
    state = state_of(span, elements, 1)
    assert state.mirror_symmetric
    bar = span.unstretched_length / elements
    wave = np.sin(np.arange(1, elements) * np.pi / (2 * elements)) / np.pi
    across = wave * np.sqrt(1e6 / ratio / (bar * (1 + 1 / ratio)) / (span.mass * bar))
    along = wave * np.sqrt(1e6 / bar / (span.mass * bar))
    out = Dynamics(state, (OUT_OF_PLANE,)).lowest(1000)
    assert out.frequency == pytest.approx(across, rel=1e-12)
    inside = Dynamics(state, (IN_PLANE,)).lowest(1000)
    expected = np.sort(np.concatenate([across, along]))
    # modes come from the compliance: the highest lose the digits of (omega_max/omega_1)^2
    wrong = np.abs(inside.frequency / expected - 1)
    assert (wrong < 1e-12 + 4e-16 * (expected / expected[0]) ** 2).all()
    assert wrong[: elements - 1].max() < 1e-12
    for kind, names in (("in-plane", inside), ("axial", inside), ("out-of-plane", out)):
        found = [names.symmetry[k] for k in names.select(kind)]
        assert found == [("symmetric", "antisymmetric")[k % 2] for k in range(elements - 1)], kind


EXTREMES = {
    "hardly strained": chord_span(100, 0, 1e-10, 1e6, 1e-6),
    "stiff and flat": chord_span(100, 0, -1e-6, 1e14),
    "stiff and slack": chord_span(100, 0, -0.3, 1e14),
    "almost weightless": chord_span(100, 0, 1e-4, 1e6, 1e-12),
    "almost no tension": chord_span(100, 0, -1e-12, 1e3, 1e-9),
    "deep": chord_span(1, 0, -0.97, 1e8),
}


@pytest.mark.crossed
@pytest.mark.parametrize("span", EXTREMES.values(), ids=EXTREMES)
@pytest.mark.parametrize(("elements", "order", "closed"), [(40, 1, False), (5, 4, False), (1, 17, True), (4, 12, True)])
def test_halves_lose_nothing_at_the_ends_of_the_range(span, elements, order, closed):
    """Against the same cable, solved as if it were not its own mirror image."""
    state = state_of(span, elements, order, closed=closed)
    assert state.mirror_symmetric
    for axes in PLANAR:
        halves, whole = (Dynamics(one, (axes,)).lowest(12) for one in (state, replace(state, mirror_symmetric=False)))
        assert halves.frequency == pytest.approx(whole.frequency, rel=1e-10)
        forces = np.abs(whole.participation)
        assert np.abs(halves.participation) == pytest.approx(forces, rel=1e-6, abs=1e-9 * forces.max())
        assert (halves.kind, halves.symmetry) == (whole.kind, whole.symmetry)


def test_which_cables_are_their_own_mirror_image():
    even, uneven = mesh_segments(np.ones(1), 4, 3), Mesh(np.array([0, 0.3, 1.0]), 3)
    level, inclined = chord_span(100, 0, -0.1, 1e5), chord_span(100, 1e-6, -0.1, 1e5)
    loaded = chord_span(100, 0, -0.1, 1e5, loads=[(0.5, (0, 0, -10))])
    for span, mesh, expected in (
        (level, even, True),
        (inclined, even, False),
        (level, uneven, False),
        (loaded, mesh_segments([0.5, 0.5], 4, 3), False),
        (chord_span(100, 30, 0.01, 1e5, gravity=0.0), even, True),
        # many are where each of them is
        (batch([level, level]), even, True),
        (batch([level, inclined]), even, False),
    ):
        assert equilibrium.from_catenary(catenary.solve(span), mesh).mirror_symmetric == expected
    assert batch([level, inclined]).mirror_symmetric.tolist() == [True, False]
