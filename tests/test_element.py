"""`cable/element.py`: Lobatto and Gauss rules, mass matrices, and how elements are shared out."""

import numpy as np
import pytest

from cablestudy.cable.element import MASSES, Mesh, basis, lagrange, mass_matrix
from cablestudy.cable.meshes import mesh_segments
from cablestudy.errors import NoSolutionError

ORDERS = (1, 2, 3, 4, 8, 16, 33, 64)


@pytest.mark.parametrize("order", ORDERS)
def test_lobatto_rule_is_exact_to_degree_2p_minus_1(order):
    element = basis(order)
    assert (element.nodes[0], element.nodes[-1]) == (0, 1)
    assert np.diff(element.nodes).min() > 0
    assert element.nodes + element.nodes[::-1] == pytest.approx(1, abs=1e-15)
    for degree in range(2 * order):
        assert element.shares @ element.nodes**degree == pytest.approx(1 / (degree + 1), rel=1e-13)


def test_lobatto_nodes_of_a_table():
    """Abramowitz and Stegun (1964), table 25.6: n = 4 and 5 points."""
    assert 2 * basis(3).nodes[2] - 1 == pytest.approx(1 / np.sqrt(5), rel=1e-15)
    assert 2 * basis(4).nodes[3] - 1 == pytest.approx(np.sqrt(3 / 7), rel=1e-15)
    assert basis(4).shares * 2 == pytest.approx([1 / 10, 49 / 90, 32 / 45, 49 / 90, 1 / 10], rel=1e-14)


@pytest.mark.parametrize("order", ORDERS)
def test_derivative_of_polynomials(order):
    element = basis(order)
    for degree in range(order + 1):
        expected = degree * element.points ** max(degree - 1, 0)
        assert element.derivative @ element.nodes**degree == pytest.approx(expected, abs=1e-11 * order**2)
    assert np.abs(element.derivative.sum(axis=1)).max() < 1e-12


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("mass", MASSES)
def test_mass_matrix(order, mass):
    M = mass_matrix(order, mass)
    assert np.abs(M - M.T).max() < 1e-15
    assert M.sum() == pytest.approx(1, rel=1e-13)
    assert M.sum(axis=1) == pytest.approx(basis(order).shares, abs=1e-14)  # partition of unity
    assert np.linalg.eigvalsh(M).min() > 0


def test_mass_of_a_bar():
    """Textbook: 1/2 on each node; (2 1; 1 2)/6; and their mean."""
    assert mass_matrix(1, "lumped") == pytest.approx(np.eye(2) / 2)
    assert mass_matrix(1, "consistent") == pytest.approx(np.array([[2, 1], [1, 2]]) / 6)
    assert mass_matrix(1, "blended") == pytest.approx(np.array([[5, 1], [1, 5]]) / 12)


@pytest.mark.parametrize("order", [1, 2, 5, 12])
def test_consistent_mass_integrates_products(order):
    """u^T M v is the integral of the product of the polynomials that u and v interpolate."""
    M, x = mass_matrix(order, "consistent"), basis(order).nodes
    for i in range(order + 1):
        for j in range(order + 1):
            assert x**i @ M @ x**j == pytest.approx(1 / (i + j + 1), rel=1e-12)


def test_lagrange():
    nodes, x = basis(5).nodes, np.array([0.0, 0.1, 0.5, basis(5).nodes[2], 1.0])
    values = lagrange(nodes, x)
    for degree in range(6):
        assert values @ nodes**degree == pytest.approx(x**degree, abs=1e-14)


@pytest.mark.parametrize("order", [1, 3])
def test_mesh(order):
    mesh = Mesh(np.array([0, 0.25, 1]), order)
    assert (mesh.elements, mesh.nodes) == (2, 2 * order + 1)
    assert mesh.node_positions[[0, order, -1]] == pytest.approx([0, 0.25, 1])
    assert mesh.point_positions.shape == (2, order)
    assert mesh.point_positions.mean(axis=1) == pytest.approx([0.125, 0.625])


def test_elements_are_shared_by_length():
    for fractions in ([1.0], [0.5, 0.5], [0.25, 0.75]):
        assert np.allclose(mesh_segments(fractions, 4).edges, [0, 0.25, 0.5, 0.75, 1])
    assert np.allclose(mesh_segments([1e-6, 1 - 1e-6], 2).edges, [0, 1e-6, 1])


def test_a_boundary_stands_at_every_load_and_the_number_is_kept():
    rng = np.random.default_rng(1)
    for _ in range(200):
        loads = rng.integers(0, 8)
        fractions = rng.dirichlet(np.ones(loads + 1) * rng.choice([0.1, 1, 100]))
        elements = int(rng.integers(loads + 1, 200))
        mesh = mesh_segments(fractions, elements)
        assert mesh.elements == elements
        assert np.diff(mesh.edges).min() >= 0
        assert (mesh.edges[0], mesh.edges[-1]) == (0, 1)
        for place in np.cumsum(fractions)[:-1]:
            assert np.abs(mesh.edges - place).min() < 1e-11
        # no element is much longer than the mean: what remains after one each is shared by length
        assert mesh.sizes.max() <= max(2 / elements * (loads + 1), 1.0 / (elements - loads) + 1e-12)


def test_segments_of_no_length_have_no_elements():
    """A load at an end, or two at one place."""
    assert mesh_segments([0.0, 0.5, 1e-13, 0.5], 4).edges == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    assert mesh_segments([1.0, 0.0], 1).elements == 1


def test_one_element_per_segment_is_the_least():
    assert mesh_segments([0.2, 0.3, 0.5], 3).sizes == pytest.approx([0.2, 0.3, 0.5])
    with pytest.raises(NoSolutionError, match="2 point loads need at least 3 elements, got 2"):
        mesh_segments([0.2, 0.3, 0.5], 2)
