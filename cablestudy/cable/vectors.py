"""Lengths, products and largest components of vectors on a last, short axis; keys of equal rows of arrays.

They go component by component: a sum or a maximum over an axis of three costs ten times as much.
"""

from functools import reduce

import numpy as np


def _components(values):
    """Arrays of the components on the last axis."""
    return [values[..., i] for i in range(values.shape[-1])]


def dot(first, second):
    """Scalar products of the vectors on the last axes."""
    return reduce(np.add, _components(first * second))


def size(vectors):
    """Euclidean lengths of the vectors on the last axis."""
    return np.sqrt(dot(vectors, vectors))


def largest(values):
    """Largest absolute values on the last axis."""
    return reduce(np.maximum, [np.abs(component) for component in _components(values)])


def cross(first, second):
    """Cross products of the vectors on the last axes, shapes (..., 3)."""
    product = np.empty(np.broadcast_shapes(first.shape, second.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = first[..., j] * second[..., k] - first[..., k] * second[..., j]
    return product


def times(matrix, vector):
    """Products of matrices and vectors, shapes (..., 3, 3) and (..., 3)."""
    return reduce(np.add, [matrix[..., i] * vector[..., i, None] for i in range(3)])


def row_keys(arrays):
    """Hashable key of each row of some arrays, shapes (n, ...): list. Rows are equal where all their numbers are."""
    numbers = np.concatenate([np.reshape(array, (len(array), -1)) for array in arrays], axis=1)
    return [row.tobytes() for row in numbers]
