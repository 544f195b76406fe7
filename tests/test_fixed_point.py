"""Acceleration of fixed-point iterations, against linear equations solved directly."""

import numpy as np
import pytest

from cablestudy.wind.mean import next_argument


def linear_steps(seed, count):
    """Arguments and values of `count` steps of x = A x + b, which diverges, and its fixed point."""
    rng = np.random.default_rng(seed)
    matrix, constant = 2 * rng.normal(size=(4, 4)), rng.normal(size=4)
    arguments, values, x = [], [], np.zeros(4)
    for _ in range(count):
        arguments.append(x)
        x = matrix @ x + constant
        values.append(x)
    return np.array(arguments), np.array(values), np.linalg.solve(np.eye(4) - matrix, constant)


@pytest.mark.parametrize("seed", range(5))
def test_a_linear_iteration_ends_as_soon_as_its_steps_span_the_space(seed):
    """Of n components n changes determine the fixed point; two cases together are each as it is alone."""
    cases = [linear_steps(seed, 5), linear_steps(seed + 100, 5)]
    together = next_argument(*(np.stack(parts, axis=1) for parts in zip(*(case[:2] for case in cases), strict=True)))
    for (arguments, values, fixed), found in zip(cases, together, strict=True):
        assert found == pytest.approx(fixed, rel=1e-6)
        assert np.array_equal(found, next_argument(arguments, values))
        assert np.abs(values[-1] - fixed).max() > np.abs(values[0] - fixed).max()


def test_one_step_alone_and_steps_that_do_not_move_give_the_value():
    arguments, values, _ = linear_steps(0, 1)
    assert np.array_equal(next_argument(arguments, values), values[-1])
    still = np.ones((3, 4))
    assert np.array_equal(next_argument(still, still), still[-1])
