"""`cable/assembly.py`: patch test, mass, compliance and condensation."""

import numpy as np
import pytest
from cables import CABLES, chord_span, full_mass, full_stiffness, graded_error, gradient, state_of

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.assembly import (
    IN_PLANE,
    OUT_OF_PLANE,
    SPATIAL,
    System,
    static_force_transfer,
    static_force_transfer_of_axes,
    transposed_force_transfer,
)
from cablestudy.cable.element import MASSES, Mesh

each_cable = pytest.mark.parametrize("span", CABLES.values(), ids=CABLES)
each_order = pytest.mark.parametrize("order", [1, 2, 3, 8])


@each_order
@pytest.mark.parametrize("edges", [[0, 1], [0, 0.07, 0.1, 0.55, 0.9, 1]], ids=["one element", "five elements"])
def test_patch(edges, order):
    """Elements of any lengths in a straight weightless cable: uniform strain, end stiffness EA/L and T/l exactly."""
    span = chord_span(10, 25, 1e-3, 1e6, gravity=0.0)
    state, record = equilibrium.solve(catenary.solve(span), Mesh(np.array(edges, dtype=float), order))
    assert record.steps == 1
    assert state.tension * state.force == pytest.approx(np.full((len(edges) - 1, order), 1e3), rel=1e-13)
    assert np.abs(state.displacement).max() < 1e-16
    system = System(state, SPATIAL)
    assert system.dof == 3 * (order * (len(edges) - 1) - 1)  # none of a single bar
    K = system.end_stiffness * state.force / span.unstretched_length
    assert graded_error(K, np.diag([1e6 / span.unstretched_length, 100.0, 100.0])) < 1e-13


@each_cable
@each_order
@pytest.mark.parametrize("mass", MASSES)
def test_mass(span, order, mass):
    state = state_of(span, 6, order, mass)
    for axes in (OUT_OF_PLANE, IN_PLANE, SPATIAL):
        M = full_mass(System(state, axes))
        for axis in range(len(axes)):
            motion = np.tile(np.eye(len(axes))[axis], state.mesh.nodes)
            assert motion @ (M @ motion) == pytest.approx(1, rel=1e-13)
        assert (M.nnz == M.shape[0]) == (mass == "lumped")
        assert np.linalg.eigvalsh(M.toarray()).min() > 0


@pytest.mark.parametrize("axes", [IN_PLANE, OUT_OF_PLANE, SPATIAL])
@each_cable
@each_order
def test_compliance_and_condensation(span, axes, order):
    """The force method against dense algebra with K in displacements: K22^-1, condensation, static shapes."""
    if axes != SPATIAL and not span.planar:
        return
    state = state_of(span, 6, order)
    system, d = System(state, axes), len(axes)
    K = full_stiffness(system)
    ends = np.r_[0:d, len(K) - d : len(K)]
    k11, k12, k22 = K[ends][:, ends], K[ends, d:-d], K[d:-d, d:-d]
    assert k22.shape == (system.dof, system.dof)
    compliance = np.linalg.inv(k22)
    root = system.root(static_force_transfer_of_axes(state.mesh, d, np.eye(system.dof)))
    assert graded_error(root.T @ root, compliance) < 1e-7
    loads = np.random.default_rng(3).normal(size=(system.dof, 2))
    assert system.solve(loads) == pytest.approx(compliance @ loads, rel=1e-6, abs=1e-7 * np.abs(compliance).max())
    condensed = k11 - k12 @ compliance @ k12.T
    assert graded_error(system.end_stiffness, condensed[d:, d:]) < 1e-7
    assert np.abs(condensed[:d] + condensed[d:]).max() < 1e-7 * np.abs(condensed).max()
    shapes = -compliance @ k12.T[:, d:]
    assert system.end_shapes[1:-1].reshape(-1, d) == pytest.approx(shapes, abs=1e-7)
    assert not system.end_shapes[0].any()
    assert (system.end_shapes[-1] == np.eye(d)).all()
    M = full_mass(system)[d:-d, d:-d]
    assert abs(M - system.mass).max() == 0


@pytest.mark.parametrize("elements", [1, 2, 5])
@each_order
def test_forces_carried_are_in_equilibrium_and_gradients_add_up(elements, order):
    """S by virtual work: sum of w (S f) v' = -f v for every v at rest at end 1; S^T by integrals of polynomials."""
    mesh = Mesh(np.sort(np.r_[0, np.random.default_rng(elements).uniform(size=elements - 1), 1]), order)
    inner, slope, weights = mesh.nodes - 2, gradient(mesh), mesh.point_weights.ravel()  # v' at the points
    S = static_force_transfer(mesh, np.eye(mesh.nodes - 2))
    assert S.shape == (elements * order, inner)
    assert (slope[:, 1:-1].T * weights) @ S == pytest.approx(-np.eye(inner), abs=1e-11)
    assert (slope[:, 0] * weights) @ S == pytest.approx(np.zeros(inner), abs=1e-11)
    forces = np.random.default_rng(5).normal(size=(2, inner, 3))
    assert static_force_transfer(mesh, forces) == pytest.approx(S @ forces, abs=1e-12)
    weighted = weights[:, None] * np.random.default_rng(6).normal(size=(2, elements * order, 3))
    assert transposed_force_transfer(mesh, weighted) == pytest.approx(S.T @ weighted, abs=1e-12)
    # a polynomial's gradient, added up from end 2
    place = np.vander(mesh.node_positions, order + 1)
    end = place[-1] - transposed_force_transfer(mesh, weights[:, None] * (slope @ place))
    assert end == pytest.approx(place[1:-1], abs=1e-12)
