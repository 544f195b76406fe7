"""The sum over the poles of a system whose matrix has next to no full set of eigenvectors, against solved systems."""

import numpy as np
import pytest

from cablestudy.system.residues import eigen, eigen_of_rows

FREQUENCIES = 1j * np.geomspace(1e-2, 1e3, 60)


def chain(*blocks, into=1.0):
    """Systems one behind the other: each is driven by the first state of the one before, times a factor."""
    size = sum(len(block) for block in blocks)
    found, begin = np.zeros((size, size)), 0
    for place, block in enumerate(blocks):
        own = slice(begin, begin + len(block))
        found[own, own] = block
        if place:
            found[begin + len(block) - 1, begin - len(blocks[place - 1])] = into
        begin += len(block)
    return found


def second_order(omega, ratio):
    """x'' + 2 z w x' + w^2 x, its states x and x'."""
    return np.array([[0.0, 1.0], [-(omega**2), -2 * ratio * omega]])


LAG = np.array([[-60.0]])
MATRICES = {
    "a critically damped filter": second_order(60.0, 1.0),
    "it before a slow and a fast oscillator": chain(
        second_order(60.0, 1.0), second_order(0.7, 0.04), second_order(300.0, 0.1), into=3e5
    ),
    "two equal filters": chain(LAG, LAG),
    "three equal filters": chain(LAG, LAG, LAG, into=60.0),
    "a critically damped filter and two of its poles": chain(second_order(60.0, 1.0), LAG, LAG, into=60.0),
}
WRONG = 2e-7  # of a response, over its largest value


@pytest.mark.parametrize("name", MATRICES)
def test_the_sum_over_poles_is_the_response(name):
    """Of each state to a force on itself, and of the last one to a force on the first."""
    matrix, found = MATRICES[name], eigen(MATRICES[name])
    right = np.linalg.inv(FREQUENCIES[:, None, None] * np.eye(len(matrix)) - matrix)
    summed = (found.right / (FREQUENCIES[:, None] - found.values)[:, None, :]) @ found.left
    own = np.arange(len(matrix))
    for rows, columns in ((own, own), ([-1], [0])):
        size = np.abs(right[:, rows, columns]).max(axis=0)
        assert (np.abs(summed - right)[:, rows, columns] / size).max() < WRONG


def test_the_slow_poles_of_a_graded_matrix_are_not_moved_by_a_double_pole_far_above():
    """0.7 rad/s with 4 % beside a critically damped filter of 60 rad/s, and forces of 3e5 between them."""
    poles = eigen(MATRICES["it before a slow and a fast oscillator"]).poles
    slow = poles[np.argmin(np.abs(poles - 0.7j))]
    assert slow == pytest.approx(0.7 * (-0.04 + 1j * np.sqrt(1 - 0.04**2)), rel=1e-9)


def test_matrices_of_many_rows_have_the_poles_and_vectors_of_each_alone():
    """Full matrices, one with real poles alone, one of two groups of states, one with coinciding poles."""
    draw = np.random.default_rng(3)
    full, triangular, apart = draw.normal(size=(4, 4)), np.triu(draw.normal(size=(4, 4))), draw.normal(size=(4, 4))
    apart[:2, 2:] = apart[2:, :2] = 0.0
    coinciding = np.eye(4, k=1) - 2 * np.eye(4)
    coinciding[3, 0] = 1e-15
    rows = np.array([full, triangular, apart, coinciding, full.T])
    for found, matrix in zip(eigen_of_rows(rows), rows, strict=True):
        alone = eigen(matrix)
        for name in ("values", "right", "left"):
            assert np.array_equal(getattr(found, name), getattr(alone, name)), name
        assert (found.right * found.values) @ found.left == pytest.approx(matrix, abs=1e-6)


def test_the_inverse_of_vectors_in_pairs_is_that_of_the_complex_matrix():
    matrix = np.random.default_rng(8).normal(size=(9, 9))
    found = eigen(matrix)
    assert (found.values.imag != 0).any()
    assert found.left == pytest.approx(np.linalg.inv(found.right), abs=1e-12)
    assert found.left @ found.right == pytest.approx(np.eye(9), abs=1e-13)


@pytest.mark.parametrize("ratio", [1e-9, 1e-4, 0.1, 3.0, 100.0])  # of the damping; the last one is above critical
@pytest.mark.parametrize("seed", range(3))
def test_complex_stiffness_and_damping_together(seed, ratio):
    """A [0 U; S D] of 12 coordinates, frequencies over three decades, damping and loss that couple them."""
    draw, n = np.random.default_rng(seed), 12
    omega, shapes = 10 ** draw.uniform(-1, 2, n), draw.normal(size=(2, n, n)) / n
    root = np.sqrt(omega[:, None] * omega)
    damping, loss = (root * (shape @ shape.T) for shape in shapes)
    unit = omega * draw.uniform(0.5, 2.0, n)
    stiffness = np.diag(omega**2) + 0.05j * root * loss
    matrix = np.block([[np.zeros((n, n)), np.diag(unit)], [-stiffness / unit[:, None], -ratio * damping]])
    matrix[n:, n:] *= unit / unit[:, None]  # of the speeds over `unit`
    found = eigen(matrix)
    right = np.linalg.inv(FREQUENCIES[:, None, None] * np.eye(2 * n) - matrix)
    summed = (found.right / (FREQUENCIES[:, None] - found.values)[:, None, :]) @ found.left
    size = np.sqrt(np.diagonal(np.abs(right).max(axis=0)))
    assert (np.abs(summed - right) / size[:, None] / size).max() < 1e-10  # rounding, over three decades
    assert found.one_sided
