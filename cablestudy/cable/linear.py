"""Direct solution of the banded systems of a cable: dense while small, LAPACK's banded LU beyond."""

from dataclasses import dataclass

import numpy as np

from cablestudy.errors import ConvergenceError

DENSE_LIMIT = 160


@dataclass(frozen=True)
class Pattern:
    """Where element blocks go in the matrix of the whole.

    Attributes
    ----------
    size, bandwidth : int
        Of the matrix; entries (i, j) have |i - j| <= bandwidth.
    keep : ndarray of bool, shape (n m m,)
        Block entries that touch no fixed unknown.
    slots : ndarray of int
        Flat position of each kept entry in the storage (dense or LAPACK band).
    """

    size: int
    bandwidth: int
    keep: np.ndarray
    slots: np.ndarray

    @property
    def dense(self):
        """Whether the matrix is stored whole."""
        return self.size <= DENSE_LIMIT

    @property
    def storage(self):
        """Shape of the storage."""
        return (self.size, self.size) if self.dense else (3 * self.bandwidth + 1, self.size)

    @classmethod
    def of_blocks(cls, unknowns, size, bandwidth):
        """From the unknowns of each element.

        Parameters
        ----------
        unknowns : ndarray of int, shape (n, m)
            Index of each unknown of an element in the whole, -1 where it is fixed.
        size, bandwidth : int

        Returns
        -------
        Pattern
        """
        rows = np.repeat(unknowns, unknowns.shape[1], axis=1).ravel()
        columns = np.tile(unknowns, (1, unknowns.shape[1])).ravel()
        keep = (rows >= 0) & (columns >= 0)
        rows, columns = rows[keep], columns[keep]
        if size > DENSE_LIMIT:
            rows = 2 * bandwidth + rows - columns
        return cls(size, bandwidth, keep, rows * size + columns)

    def assemble(self, blocks):
        """Sum element blocks, shape (n, m, m), into the storage."""
        values = blocks.ravel()[self.keep]
        rows, columns = self.storage
        return np.bincount(self.slots, weights=values, minlength=rows * columns).reshape(rows, columns)


class Factor:
    """An LU factorisation with pivoting.

    Parameters
    ----------
    pattern : Pattern
    blocks : ndarray, shape (n, m, m)
        Element matrices.

    Raises
    ------
    ConvergenceError
        The matrix is singular or not finite.
    """

    def __init__(self, pattern, blocks):
        from scipy.linalg import lapack

        self._lapack, self._pattern = lapack, pattern
        if pattern.size == 0:
            return
        matrix = pattern.assemble(blocks)
        if not np.isfinite(matrix).all():
            raise ConvergenceError("a number in the tangent is not finite")
        if pattern.dense:
            self._lu, self._pivots, info = lapack.dgetrf(matrix, overwrite_a=True)
        else:
            self._lu, self._pivots, info = lapack.dgbtrf(
                matrix, pattern.bandwidth, pattern.bandwidth, overwrite_ab=True
            )
        if info != 0:
            raise ConvergenceError("the tangent is singular: the cable has a motion without stiffness")

    def solve(self, right):
        """Solve for one right-hand side, shape (size,), or several, shape (size, r)."""
        if self._pattern.size == 0:
            return np.zeros_like(right)
        if self._pattern.dense:
            answer, _ = self._lapack.dgetrs(self._lu, self._pivots, right)
        else:
            width = self._pattern.bandwidth
            answer, _ = self._lapack.dgbtrs(self._lu, width, width, right, self._pivots)
        return answer
