"""Poles of many modes that damping couples, found in windows of frequency.

Damping couples modes that are near to each other in frequency strongly, and others weakly: what it does to two modes is
of the order of its coupling over the distance of their poles. So the eigenvalue problem

    Q(x) v = 0,    Q = D(x) + sum of x^k P_k,    D diagonal, P_k with zeros on the diagonal,

is solved for the modes A in one window and some on both of its sides; the poles inside are taken. All other modes F
follow those by two steps of an iteration, and change the pole to first order (Q' the derivative of Q by x):

    v_F = -D_F^-1 (Q_FA v_A + (Q_FF - D_F) v_F),    x = x_A - v_A^T Q_AF v_F/(v^T Q' v).

For n modes that takes some 10 n^3 multiplications where the whole eigenvalue problem takes 200 n^3. It leaves an error
of second order in the coupling to modes that are not in the window, where poles of the window nearly coincide, else of
third.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.matrices import product
from cablestudy.system.connected import coupled_groups
from cablestudy.system.solvents import eigen_by_solvents
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class Resolvent:
    """Inverse of a matrix polynomial Q(x) of n modes as a sum over its N poles: left_j right_j/(x - pole_j).

    Attributes
    ----------
    poles, left, right : ndarray, complex, shapes (..., N), (..., n, N), (..., N, n)
    """

    poles: np.ndarray
    left: np.ndarray
    right: np.ndarray


def poles_in_windows(matrices, omega):
    """Find all poles x of the matrix polynomial Q(x) of the n modes of a cable, and Q^-1 as a sum over these poles.

    The poles are found in windows of frequency, each with the modes near it (see the module's docstring). For many
    modes that is much cheaper than one eigenvalue problem.

    Parameters
    ----------
    matrices : sequence of 2 or 3 ndarray, shape (n, n)
        Coefficients of Q by ascending power of x, symmetric. The real part of the first is diagonal, the last one is
        the identity.
    omega : ndarray, shape (n,)
        Angular frequencies of the modes. [rad/s]

    Returns
    -------
    Resolvent
        N = n or 2 n poles for 2 or 3 matrices.

    Raises
    ------
    LinAlgError
        Poles were lost at the edge of a window, or found twice.
    """
    diagonal = np.stack([np.diagonal(matrix) for matrix in matrices])
    uncoupled = _uncoupled_poles(diagonal)
    mode, size = np.tile(np.arange(len(omega)), len(uncoupled)), np.abs(uncoupled).ravel()
    order = np.argsort(size, kind="stable")
    mode, size = mode[order], size[order]  # of the uncoupled poles, ascending
    static, *damping, _ = (matrix - np.diag(np.diagonal(matrix)) for matrix in matrices)
    coupling = [(1, 1.0, matrix) for matrix in damping]  # P_k as power k of x, factor and real matrix
    if np.iscomplexobj(static):
        coupling.append((0, 1j, static.imag))
    # a window has the uncoupled poles from index `begin` to `end`, and takes the poles of sizes from `low` to `high`
    windows, begin, low = [], 0, 0.0
    while begin < len(size):
        factor = 1 if begin else SYSTEM.lowest_window
        is_last = begin + (factor + 0.5) * SYSTEM.window >= len(size)  # less than half a window would be left
        end = len(size) if is_last else begin + factor * SYSTEM.window
        near = np.unique(mode[max(begin - SYSTEM.window_margin, 0) : end + factor * SYSTEM.window_margin])  # modes A
        (poles,), vectors = poles_and_vectors(
            [matrix[None, near[:, None], near] for matrix in matrices], omega[None, near]
        )
        high = np.inf if is_last else _gap_near(np.abs(poles), size[end])
        inside = (np.abs(poles) >= low) & (np.abs(poles) < high)
        amplitudes = mode_amplitudes(vectors, omega[None, near])[0][:, inside]
        windows.append(_with_other_modes(coupling, diagonal, near, poles[inside], amplitudes))
        low, begin = high, max(np.searchsorted(size, high), begin + 1)
    poles, left, slope = (np.concatenate(arrays, axis=-1) for arrays in zip(*windows, strict=True))
    if len(poles) != len(size):
        raise np.linalg.LinAlgError
    return Resolvent(poles, left, (left / slope).T)


def poles_and_vectors(matrices, omega):
    """Find all poles x of the matrix polynomials of the n modes of r cables, by linear eigenvalue problems.

    Groups of modes that damping does not couple have a problem each, such as the symmetric and the antisymmetric modes
    of a level cable. No digit of a cable depends on the others.

    Parameters
    ----------
    matrices : sequence of 2 or 3 ndarray, shape (r, n, n)
        Coefficients of each polynomial by ascending power of x: K and M, or K, C and M. M is the identity.
    omega : ndarray, shape (r, n)
        Angular frequencies of the modes. [rad/s]

    Returns
    -------
    poles : ndarray, complex, shape (r, N)
        N = n or 2 n for 2 or 3 matrices.
    vectors : ndarray, complex, shape (r, N, N)
        Eigenvectors of the linear problem as columns, from which `mode_amplitudes` takes the amplitudes of the modes.
    """
    (rows, n), states = omega.shape, len(matrices) - 1
    stiffness, *damping, mass = matrices
    groups, rows_of_groups = coupled_groups(mass, damping[0] if damping else 0 * mass, stiffness), {}
    for row in range(rows):
        rows_of_groups.setdefault(groups[row].tobytes(), []).append(row)
    poles, vectors = np.empty((rows, states * n), dtype=complex), np.zeros((rows, states, n, states * n), dtype=complex)
    for of_rows in rows_of_groups.values():
        at, end = np.array(of_rows)[:, None], 0
        for number in range(groups[at[0, 0]].max(initial=-1) + 1):
            group = np.flatnonzero(groups[at[0, 0]] == number)
            matrices_of_group = [matrix[at[:, None], group[:, None], group] for matrix in matrices]
            begin, end = end, end + states * len(group)
            poles[of_rows, begin:end], own = _poles_of_coupled_modes(matrices_of_group, omega[at, group])
            own = own.reshape(len(at), states, len(group), end - begin)
            # zero for the modes of other groups
            vectors[at[:, None], np.arange(states)[:, None], group, begin:end] = own
    return poles, vectors.reshape(rows, states * n, states * n)


def _poles_of_coupled_modes(matrices, omega):
    """`poles_and_vectors` of modes all of which damping couples.

    The states of the linear problem are the amplitudes q of the modes for two matrices, and W q and q' for three, W
    being the frequencies of the modes. The inverse of its matrix is solved: W differ by many powers of ten, and the
    rounding of an eigen-solution has the size of the largest eigenvalue. Where damping is weak, a problem of half the
    size serves instead (`eigen_by_solvents`).
    """
    (rows, n), states = omega.shape, len(matrices) - 1
    found, size = np.zeros(rows, dtype=bool), states * n
    poles, vectors = np.empty((rows, size), dtype=complex), np.empty((rows, size, size), dtype=complex)
    if states > 1:
        of_solvents, amplitudes, found = eigen_by_solvents(*matrices[:2])
        poles[found], amplitudes = of_solvents[found], amplitudes[found]
        both = omega[found][:, :, None] * amplitudes, amplitudes * poles[found][:, None]
        vectors[found] = np.concatenate(both, axis=1)
    if not found.all():
        others, unit = omega[~found], omega[~found][:, :, None] * omega[~found][:, None]
        stiffness, *damping, _ = (matrix[~found] / unit for matrix in matrices)
        flexibility = np.linalg.inv(stiffness)
        inverse = -flexibility / unit
        if damping:
            lower = np.eye(n) / others[:, None]
            inverse = np.block([[-flexibility @ damping[0], -flexibility / others[:, None]], [lower, 0 * lower]])
        inverse_poles, vectors[~found] = np.linalg.eig(inverse)
        poles[~found] = 1 / inverse_poles
    return poles, vectors


def mode_amplitudes(vectors, omega):
    """Amplitudes of the modes in the vectors of `poles_and_vectors`, shape (r, n, N), for omega of shape (r, n)."""
    n = omega.shape[-1]
    return vectors[:, :n] / (1 if vectors.shape[1] == n else omega[:, :, None])


def _uncoupled_poles(diagonal):
    """Poles of the modes without coupling, from the diagonals of the matrices, shape (1 or 2, n)."""
    if len(diagonal) == 2:
        return -diagonal[:1]
    half = diagonal[1] / 2
    return -half + np.sqrt(half**2 - diagonal[0] + 0j) * np.array([[1], [-1]])


def _gap_near(size, near):
    """Middle of the widest gap between sizes of poles in the neighbourhood of the size `near`."""
    size = np.sort(size)
    index = np.searchsorted(size, near)
    neighbours = size[max(index - SYSTEM.window_edge, 0) : index + SYSTEM.window_edge]
    widest = np.argmax(np.diff(neighbours))
    return (neighbours[widest] + neighbours[widest + 1]) / 2


def _with_other_modes(coupling, diagonal, near, poles, vectors):
    """Poles, shapes of all modes, and v^T Q' v, from those of the modes `near` alone: shapes (p,), (n, p), (p,).

    The two steps of the module's docstring; `near` are A there, the others F.
    """
    d = sum(part[:, None] * poles**order for order, part in enumerate(diagonal))
    d[near] = np.inf  # these do not follow
    by_near = _coupling_forces(coupling, near, vectors, poles)
    v = -by_near[0] / d
    by_all = _coupling_forces(coupling, slice(None), v, poles)
    v = -(by_near[0] + by_all[0]) / d
    change = -(by_near[0] * v).sum(axis=0)
    v[near] = vectors
    slope = sum(order * part[:, None] * poles ** (order - 1) for order, part in enumerate(diagonal) if order)
    slope = (v * (slope * v + by_near[1] + by_all[1])).sum(axis=0)
    return poles + change / slope, v, slope


def _coupling_forces(coupling, columns, vectors, poles):
    """(Q - D) v for vectors of some modes, shape (n, p), and its derivative by x."""
    by_order = [0.0, 0.0]
    for order, factor, matrix in coupling:
        by_order[order] = factor * product(matrix[:, columns], vectors)
    return by_order[0] + by_order[1] * poles, by_order[1]
