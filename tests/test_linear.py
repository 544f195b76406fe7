"""`cable/linear.py`: dense and banded storage give what numpy gives for the matrix put together by hand."""

import numpy as np
import pytest

from cablestudy.cable.linear import DENSE_LIMIT, Factor, Pattern
from cablestudy.errors import ConvergenceError


def chain(elements, width=3):
    """Overlapping blocks along a chain, the first and last unknown fixed; indefinite on purpose."""
    rng = np.random.default_rng(elements)
    unknowns = np.arange(elements)[:, None] * (width - 1) + np.arange(width) - 1
    size = elements * (width - 1) - 1
    unknowns[-1, -1] = -1
    blocks = rng.normal(size=(elements, width, width))
    whole = np.zeros((size, size))
    for element in range(elements):
        keep = unknowns[element] >= 0
        index = unknowns[element][keep]
        whole[np.ix_(index, index)] += blocks[element][np.ix_(keep, keep)]
    return Pattern.of_blocks(unknowns, size, width - 1), blocks, whole


@pytest.mark.parametrize("elements", [1, 2, 40, DENSE_LIMIT // 2, DENSE_LIMIT // 2 + 1, 300])
def test_solve(elements):
    pattern, blocks, whole = chain(elements)
    assert pattern.dense == (len(whole) <= DENSE_LIMIT)
    factor = Factor(pattern, blocks)
    rng = np.random.default_rng(0)
    for right in (rng.normal(size=len(whole)), rng.normal(size=(len(whole), 4))):
        kept = right.copy()
        answer = factor.solve(right)
        assert answer.shape == right.shape
        assert np.linalg.norm(whole @ answer - right) < 1e-13 * np.linalg.cond(whole) * np.linalg.norm(right)
        assert (right == kept).all()


@pytest.mark.parametrize("elements", [10, 300])
def test_singular_and_not_finite(elements):
    pattern, blocks, _ = chain(elements)
    blocks[:] = 0
    with pytest.raises(ConvergenceError, match="singular"):
        Factor(pattern, blocks)
    blocks[0, 0] = np.nan
    blocks[0, 1] = np.nan
    with pytest.raises(ConvergenceError, match="not finite"):
        Factor(pattern, blocks)


def test_nothing_to_solve():
    pattern = Pattern.of_blocks(np.array([[-1, -1]]), 0, 1)
    assert Factor(pattern, np.ones((1, 2, 2))).solve(np.zeros(0)).shape == (0,)
