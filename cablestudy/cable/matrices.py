"""Functions of matrices of coupled systems: factors, modes by Lanczos iteration, shares in a compliance, changes."""

import numpy as np

from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError

UNSTABLE = "the equilibrium is not stable: it has no modes"


def polynomial(coefficients, s):
    """Values a + s b + s^2 c of three arrays of one shape (...), for each s of shape (f,): shape (f, ...)."""
    a, b, c = coefficients
    s = np.reshape(s, (-1, *[1] * np.ndim(a)))
    return a + s * b + s**2 * c


def product(matrix, columns):
    """Product of matrices with complex columns; that of real ones in real numbers, which is twice as fast."""
    if np.iscomplexobj(matrix):
        return matrix @ columns
    return (matrix @ np.ascontiguousarray(columns).view(float)).view(complex)


def solve(matrices, right):
    """Solutions of linear systems, shapes (m, n, n) and (m, n, k); of one unknown by division, which is much faster."""
    return right / matrices if matrices.shape[-1] == 1 else np.linalg.solve(matrices, right)


def of_each(function, failed, *stacks):
    """A function of numpy.linalg of stacks of matrices, shape (m, n, n), and of right-hand sides, shape (m, n, k).

    Where it refuses some of them, the result of these is the number `failed`, in the shape of the last stack.
    """
    try:
        return function(*stacks)
    except np.linalg.LinAlgError:
        count = len(stacks[0])
        if count == 1:
            return np.full(stacks[-1].shape, failed, dtype=np.result_type(*stacks))
        halves = slice(count // 2), slice(count // 2, count)
        return np.concatenate([of_each(function, failed, *(stack[half] for stack in stacks)) for half in halves])


def solved(matrices, right):
    """Solutions of linear systems, NaN where one is singular, shapes (m, n, n) and (m, n, k); see `solve`."""
    if matrices.shape[-1] == 1:
        with np.errstate(all="ignore"):
            return np.where(matrices == 0, np.nan, right / matrices)
    return of_each(np.linalg.solve, np.nan, matrices, right)


def solved_sparse(matrix, right):
    """Solution of a sparse linear system, NaN where it is singular, shape (n,)."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    try:
        return splu(csc_array(matrix)).solve(right)
    except RuntimeError:
        return np.full(right.shape, np.nan)


def inverse(matrices):
    """Inverses of matrices, shape (n, m, m); infinite where one is singular. Of one number its reciprocal."""
    if matrices.shape[-1] == 1:
        with np.errstate(all="ignore"):
            return np.where(matrices == 0, np.inf, 1 / matrices)
    return of_each(np.linalg.inv, np.inf, matrices)


def factors_of_each(matrices):
    """Cholesky factors of matrices, shape (..., d, d); NaN where one is not positive definite."""
    stack = matrices.reshape(int(np.prod(matrices.shape[:-2])), *matrices.shape[-2:])
    return of_each(np.linalg.cholesky, np.nan, stack).reshape(matrices.shape)


def shares(values):
    """Values over their sum, zeros where that is zero, shape (n,). [-]"""
    total = values.sum()
    return values / (total if total > 0 else 1.0)


def massive_modes(shapes, compliance):
    """Mass-normalised shapes of the modes of finite frequency, (n, m), and their W^2, shape (m,) [rad^2/s^2].

    From the shapes of unit strain energy and the compliance of some of the `LinearSystem.strain_modes`.
    """
    massive = compliance > CABLE.massless * compliance.max(initial=0.0)
    square = 1 / compliance[massive]
    return shapes[:, massive] * np.sqrt(square), square


def normalised_modes(shapes, compliance):
    """Frequencies [rad/s], ascending, infinite where a motion has no mass, and mass-normalised shapes, zero there.

    Parameters
    ----------
    shapes : ndarray, shape (..., n, k)
        Of unit strain energy.
    compliance : ndarray, shape (..., k)
        Their quotients x^T M x, which have all digits of the high modes too. [s^2]
    """
    massive = compliance > CABLE.massless * compliance.max(axis=-1, keepdims=True, initial=0.0)
    omega = 1 / np.sqrt(np.where(massive, compliance, np.inf))
    shapes = shapes * omega[..., None, :]
    omega = np.where(massive, omega, np.inf)
    order = np.argsort(omega, axis=-1, kind="stable")
    return np.take_along_axis(omega, order, axis=-1), np.take_along_axis(shapes, order[..., None, :], axis=-1)


def dense(matrix):
    """A matrix, sparse or not, as an array."""
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def only_dissipates(losses):
    """True if a damping matrix is symmetric and has no negative eigenvalue, except for rounding."""
    rounding = CABLE.loss_rounding * np.abs(losses).max(initial=0.0)
    if np.abs(losses - losses.T).max(initial=0.0) > rounding:
        return False
    return not rounding or is_positive_definite(losses + rounding * np.eye(len(losses)))


def is_positive_definite(matrix):
    """True if a symmetric matrix has positive eigenvalues only: it has Cholesky factors, found faster than those."""
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True


def cholesky(stiffness):
    """Cholesky factor L of a stiffness L L^T; NoSolutionError where it is not positive definite."""
    try:
        return np.linalg.cholesky(stiffness)
    except np.linalg.LinAlgError:
        raise NoSolutionError(UNSTABLE) from None


def sparse_factors(stiffness):
    """Sparse L U factors (`SuperLU`) of a stiffness; NoSolutionError where it is not positive definite."""
    from scipy.sparse import csc_array

    matrix = csc_array(stiffness)
    matrix.data = np.ascontiguousarray(matrix.data)  # which the real part of a complex matrix is not
    factors = _factorised(matrix)
    if factors is None:
        raise NoSolutionError(UNSTABLE)
    return factors


def shifted_factors(matrix, first_shift):
    """Factors of a sparse symmetric matrix plus a multiple of I that makes it positive definite; and this multiple.

    It is zero if the matrix is so by itself, else `first_shift` or more.
    """
    from scipy.sparse import eye_array

    unit, shift = eye_array(matrix.shape[0], format="csc"), 0.0
    while (factors := _factorised(matrix + shift * unit)) is None:
        shift = max(10 * shift, first_shift)
    return factors, shift


def _factorised(matrix):
    """L U factors of a sparse symmetric matrix; None where it is not positive definite, as is a stable stiffness.

    Without exchange of rows the signs of the diagonal of U are those of the eigenvalues (Sylvester's law of inertia).
    """
    from scipy.sparse.linalg import splu

    try:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # exactly singular
        return None
    return factors if np.all(factors.U.diagonal() > 0) else None


def lanczos_modes(size, solve, weigh, count):
    """Shapes of the lowest modes, (size, count), by shift-invert Lanczos iteration about zero from a fixed vector.

    Parameters
    ----------
    size : int
    solve, weigh : callable
        K^-1 and M times a vector.
    count : int
    """
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    inverse, mass = (LinearOperator((size, size), matvec=product, dtype=float) for product in (solve, weigh))
    start = 1 + np.modf(np.arange(1, size + 1) * (np.sqrt(5) - 1) / 2)[0]  # without symmetry, reproducible
    try:
        return eigsh(inverse, count, M=mass, sigma=0.0, OPinv=inverse, v0=start, ncv=lanczos_basis(size, count))[1]
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"modes: {error}") from None


def lanczos_basis(size, count):
    """Number of vectors in the basis of `lanczos_modes`."""
    return min(size, max(2 * count + 10, 30))


def largest_ratio(change, matrices):
    """Largest size of x^T D x over x^T K x of changes D and matrices K, shapes (..., d, d): shape (...). [-]

    Not a number where K is not positive definite, or one of them has entries that are no numbers.
    """
    scale = np.sqrt(np.abs(np.diagonal(matrices, axis1=-2, axis2=-1)))
    scale = np.where(scale > 0, scale, 1.0)
    scale = scale[..., :, None] * scale[..., None, :]
    known = np.isfinite(change + matrices).all(axis=(-2, -1))
    change, matrices = (
        np.where(known[..., None, None], (array + np.swapaxes(array, -1, -2)) / (2 * scale), 0.0)
        for array in (change, matrices)
    )
    values, vectors = np.linalg.eigh(matrices)
    positive = (values > 0).all(axis=-1)
    root = vectors / np.sqrt(np.where(positive[..., None], values, 1.0))[..., None, :]
    ratios = np.abs(np.linalg.eigvalsh(np.swapaxes(root, -1, -2) @ change @ root)).max(axis=-1)
    return np.where(positive, ratios, np.nan)
