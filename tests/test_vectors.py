"""Products, lengths and largest components of vectors, sums on bodies, inverses of symmetric matrices: by numpy."""

import numpy as np
import pytest

from cablestudy.cable.segment import inverse_symmetric, solve_symmetric
from cablestudy.cable.vectors import cross, dot, largest, size, times
from cablestudy.statics.tangent import on_bodies

RANDOM = np.random.default_rng(3)
FIRST, SECOND = RANDOM.normal(size=(2, 5, 4, 3))


def test_products_and_lengths_are_those_of_numpy():
    matrix = RANDOM.normal(size=(5, 4, 3, 3))
    np.testing.assert_array_equal(cross(FIRST, SECOND), np.cross(FIRST, SECOND))
    np.testing.assert_allclose(dot(FIRST, SECOND), np.einsum("...i,...i", FIRST, SECOND), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(size(FIRST), np.linalg.norm(FIRST, axis=-1), rtol=1e-15)
    np.testing.assert_allclose(times(matrix, FIRST), (matrix @ FIRST[..., None])[..., 0], rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(largest(FIRST), np.abs(FIRST).max(axis=-1))


def test_arrays_of_vectors_meet_single_ones():
    up = np.array([0.0, 0.0, 1.0])
    np.testing.assert_array_equal(cross(up, FIRST), np.cross(up, FIRST))
    assert size(np.array([3.0, 4.0])) == 5.0


def test_sums_on_bodies_are_those_of_each_body():
    body = np.array([0, 0, 2, 2, 2])
    values = RANDOM.normal(size=(3, 5, 2))
    total = on_bodies(values, body, 4)
    for owner in range(4):
        np.testing.assert_allclose(total[:, owner], values[:, body == owner].sum(axis=1), rtol=1e-14)
    assert on_bodies(values[:, :0], body[:0], 2).shape == (3, 2, 2)


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e12])
def test_symmetric_matrices_are_inverted(scale):
    root = RANDOM.normal(size=(6, 3, 3))
    matrix = scale * (root @ root.swapaxes(-1, -2) + np.eye(3))
    entries = tuple(matrix[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    inverse = inverse_symmetric(entries)
    np.testing.assert_allclose(inverse, np.linalg.inv(matrix), rtol=1e-11, atol=1e-13 / scale)
    right = tuple(RANDOM.normal(size=(3, 6)))
    solution = np.stack(solve_symmetric(entries, right), axis=-1)
    np.testing.assert_allclose(solution, (inverse @ np.stack(right, axis=-1)[..., None])[..., 0], rtol=1e-10)
