"""Comparison of numbers that are known to some accuracy."""

import numpy as np


def first_of_largest(values, apart):
    """Index of the first of the values, shape (m,), that lies within a relative distance `apart` of the largest."""
    return int(np.argmax(values >= values.max() * (1 - apart)))


def relative(value, reference):
    """Relative difference; 1 where only one of the two is there. [-]"""
    if value is None or reference is None:
        return float(value is not reference)
    return abs(value - reference) / abs(reference) if reference else float(value != reference)


def error_of_root(error):
    """Relative error of the root of a number with a relative error of its own, which may leave nothing of it. [-]

    A variance that is smaller by its error has the root of sqrt(1 - e) times that stated: e/2 of small errors, 1 where
    the variance may be zero.
    """
    return error / (1 + np.sqrt(np.maximum(1 - error, 0.0)))
