"""Tangent stiffness of the bodies of a suspension as a sum of 6x6 blocks: its matrices, and what follows from them."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from cablestudy.cable.matrices import of_each
from cablestudy.statics.tolerances import STATICS


@dataclass(frozen=True)
class Blocks:
    """Stiffness matrix as a sum of p 6x6 blocks: block k is in the rows of body `rows[k]`, the columns of `columns[k]`.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (p,)
    matrices : ndarray, shape (..., p, 6, 6)
    by_ends, by_forces : ndarray, shape (..., b, 6), or 0
        Sums of the sizes of the terms on the diagonal of each body: by the stiffness of cables and links, and by the
        forces on the body, those that cancel in rotations too. [N/m], [N m/rad]
    """

    rows: np.ndarray
    columns: np.ndarray
    matrices: np.ndarray
    by_ends: np.ndarray | float = 0.0
    by_forces: np.ndarray | float = 0.0

    def of(self, case):
        """`Blocks` of one case of many, or of some."""
        sizes = (size[case] if np.ndim(size) else size for size in (self.by_ends, self.by_forces))
        return Blocks(self.rows, self.columns, self.matrices[case], *sizes)


def free_values(suspension, values):
    """Values of the free degrees of freedom, shape (..., d), from the values of all, shape (..., b, 6).

    Not by a boolean index: the memory order of its result, and so the last digits of products with that result, would
    depend on the number of cases.
    """
    return values.reshape(*values.shape[:-2], -1).take(np.flatnonzero(suspension.free), axis=-1)


def free_index(free):
    """Index of each degree of freedom among the free ones, -1 of others; shape of `free`, an ndarray of bool."""
    return np.where(free.ravel(), np.cumsum(free) - 1, -1).reshape(free.shape)


def solved(matrices, vectors):
    """Solutions of systems of equations, shape (n, d); those of least size where a matrix is singular.

    Parameters
    ----------
    matrices, vectors : ndarray, shape (n, d, d), (n, d)
    """
    solutions = of_each(np.linalg.solve, np.nan, matrices, vectors[..., None])[..., 0]
    singular = np.isnan(solutions).any(axis=-1) & np.isfinite(matrices).all(axis=(-1, -2))
    for case in np.flatnonzero(singular & np.isfinite(vectors).all(axis=-1)):
        solutions[case] = np.linalg.lstsq(matrices[case], vectors[case], rcond=None)[0]
    return solutions


def scaled_dense(blocks, suspension, scales):
    """`dense`, each row and column divided by a scale of its degree of freedom; scales of shape (..., d)."""
    return dense(blocks, suspension) / (scales[..., :, None] * scales[..., None, :])


def full(blocks, bodies):
    """Sum of the blocks as a matrix of all degrees of freedom, held ones too, shape (..., 6 b, 6 b)."""
    shape = blocks.matrices.shape[:-3]
    matrix = np.zeros((*shape, bodies, bodies, 6, 6))
    for block, (row, column) in enumerate(zip(blocks.rows.tolist(), blocks.columns.tolist(), strict=True)):
        matrix[..., row, column, :, :] += blocks.matrices[..., block, :, :]
    return np.swapaxes(matrix, -3, -2).reshape(*shape, 6 * bodies, 6 * bodies)


def dense(blocks, suspension):
    """Sum of the blocks as a matrix of the free degrees of freedom, shape (..., d, d)."""
    free = np.flatnonzero(suspension.free)
    return full(blocks, len(suspension.body_names)).take(free, axis=-2).take(free, axis=-1)


def sparse(blocks, suspension, free=None):
    """Sparse stiffness matrix of the free degrees of freedom of all bodies, from 6x6 blocks of pairs of bodies.

    Parameters
    ----------
    blocks : Blocks
        Stiffness, of one case.
    suspension : SuspendedSystem
        With b bodies and points.
    free : ndarray of bool, shape (b, 6), optional
        True for the d degrees of freedom that the matrix shall have; by default `suspension.free`.

    Returns
    -------
    scipy.sparse.csc_array, shape (d, d)
        In the order of `free.ravel()`.
    """
    from scipy.sparse import coo_array

    free = suspension.free if free is None else free
    index = free_index(free)
    rows = np.broadcast_to(index[blocks.rows][:, :, None], blocks.matrices.shape)
    columns = np.broadcast_to(index[blocks.columns][:, None, :], blocks.matrices.shape)
    is_free = (rows >= 0) & (columns >= 0)
    size = int(free.sum())
    return coo_array((blocks.matrices[is_free], (rows[is_free], columns[is_free])), shape=(size, size)).tocsc()


def magnitudes(blocks, suspension):
    """Sum of the sizes of all terms on the diagonal of each free degree of freedom, shape (..., d). [N/m], [N m/rad]

    As scales of the rows and columns they make each eigenvalue comparable with the rounding of the terms.
    """
    return free_values(suspension, blocks.by_ends + blocks.by_forces)


def scaled_sparse(blocks, suspension, scales):
    """`sparse`, each row and column divided by a scale of its degree of freedom; scales of shape (d,)."""
    from scipy.sparse import diags_array

    inverse = diags_array(1 / scales)
    return (inverse @ sparse(blocks, suspension) @ inverse).tocsc()


def displacements(blocks, suspension, forces):
    """Static displacements K^-1 f of the free degrees of freedom by forces on them; infinite where K is singular.

    Parameters
    ----------
    blocks : Blocks
        K, the tangent stiffness of n cases, of d free degrees of freedom.
    suspension : SuspendedSystem
        Bodies on cables and links (springs).
    forces : ndarray, shape (n, d, k)
        f: k sets of forces [N] and moments [N m] in each case.

    Returns
    -------
    ndarray, shape (n, d, k)
        [m], [rad]
    """
    scales = np.sqrt(np.maximum(magnitudes(blocks, suspension), STATICS.tiny))
    right = forces / scales[..., None]
    solution = np.full(right.shape, np.inf)
    if scales.shape[-1] <= STATICS.dense_freedoms:
        matrices = scaled_dense(blocks, suspension, scales)
        usable = np.isfinite(matrices).all(axis=(-1, -2)) & np.isfinite(right).all(axis=(-1, -2))
        solution[usable] = of_each(np.linalg.solve, np.inf, matrices[usable], right[usable])
    else:
        from scipy.sparse.linalg import splu

        for case in np.ndindex(scales.shape[:-1]):
            matrix = scaled_sparse(blocks.of(case), suspension, scales[case])
            with suppress(RuntimeError):  # singular: nothing holds some motion
                solution[case] = splu(matrix).solve(right[case])
    return solution / scales[..., None]


def body_stiffness(blocks, suspension):
    """Stiffness of each body on its cables while other bodies are at rest and the junctions (free points) follow.

    By static condensation it is K_bb - K_bj K_jj^-1 K_jb; b are the degrees of freedom of the body, held ones too, and
    j the free ones of all junctions.

    Parameters
    ----------
    blocks : Blocks
        Tangent stiffness K of all bodies and junctions.
    suspension : SuspendedSystem
        Bodies on cables and links (springs).

    Returns
    -------
    ndarray, shape (..., number of bodies, 6, 6)
        At the reference point; rows x y z rx ry rz. Not a number where K_jj is singular. [N/m, N/rad; N, N m/rad]
    """
    count, shape = suspension.bodies, blocks.matrices.shape[:-3]
    following = suspension.free.copy()
    following[:count] = False
    stiffness = np.full((*shape, count, 6, 6), np.nan)
    if not following.any():
        for body in range(count):
            of_body = (blocks.rows == body) & (blocks.columns == body)
            stiffness[..., body, :, :] = blocks.matrices[..., of_body, :, :].sum(axis=-3)
        return stiffness
    for case in np.ndindex(shape):
        with suppress(np.linalg.LinAlgError, RuntimeError):  # singular, where there is no stable equilibrium
            condensed = _condensed(blocks.of(case), suspension, following)
            stiffness[case] = [condensed[6 * body : 6 * body + 6, 6 * body : 6 * body + 6] for body in range(count)]
    return stiffness


def _condensed(blocks, suspension, following):
    """K_bb - K_bj K_jj^-1 K_jb of `body_stiffness` in one case, shape (6 bodies, 6 bodies).

    `following`, bool of shape (b, 6), is True for the free degrees of freedom of the junctions, j of `body_stiffness`.
    """
    size, used = 6 * suspension.bodies, following.copy()
    used[: suspension.bodies] = True  # the bodies come first
    if following.size <= STATICS.dense_freedoms:
        matrix = full(blocks, len(following))[np.ix_(used.ravel(), used.ravel())]
        junction_motion = np.linalg.solve(matrix[size:, size:], matrix[size:, :size])  # K_jj^-1 K_jb
        return matrix[:size, :size] - matrix[:size, size:] @ junction_motion
    from scipy.sparse.linalg import splu

    matrix = sparse(blocks, suspension, used)
    junction_motion = splu(matrix[size:, size:].tocsc()).solve(matrix[size:, :size].toarray())
    return matrix[:size, :size].toarray() - matrix[:size, size:] @ junction_motion
