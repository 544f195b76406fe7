"""Poles of many modes that damping couples, found in windows of frequency.

Damping couples modes that are near to each other in frequency strongly, and others weakly: what it does to two modes is
of the order of its coupling over the distance of their poles. So the eigenvalue problem

    Q(x) v = 0,    Q = D(x) + sum of x^n P_n,    D diagonal, P_n with zeros there,

is solved for the modes N in one window and some on both of its sides; the poles inside are taken. All other modes F
follow them by two steps of an iteration, and change the pole to first order:

    v_F = -D_F^-1 (Q_FN v_N + (Q_FF - D_F) v_F),    x = x_N - v_N^T Q_NF v_F/(v^T Q' v).

That takes some 10 n^3 multiplications where the whole eigenvalue problem takes 200 n^3, and leaves an error of second
order in the coupling to modes that are not in the window, where poles of the window nearly coincide, else of third.
"""

import numpy as np

from cablestudy.system.connected import coupled_groups
from cablestudy.system.tolerances import SYSTEM


def poles_in_windows(matrices, omega):
    """Poles x of a symmetric polynomial of the modes of a cable, and its inverse as a sum over them.

    Parameters
    ----------
    matrices : sequence of 2 or 3 ndarray, shape (n, n)
        By ascending power of x: the first one is diagonal but for its imaginary part, the last one the identity.
    omega : ndarray, shape (n,)
        Frequencies of the modes. [rad/s]

    Returns
    -------
    poles, left, right : ndarray, shapes (N,), (n, N), (N, n)
        The inverse is the sum of left right over (x - pole).

    Raises
    ------
    LinAlgError
        Poles were lost at the edge of a window, or found twice.
    """
    diagonal = np.stack([np.diagonal(part) for part in matrices])
    alone = _alone(diagonal)
    mode, size = np.tile(np.arange(len(omega)), len(alone)), np.abs(alone).ravel()
    order = np.argsort(size, kind="stable")
    mode, size = mode[order], size[order]
    static, *damping, _ = (part - np.diag(np.diagonal(part)) for part in matrices)
    coupling = [(0, 1j, static.imag)] * np.iscomplexobj(static) + [(1, 1.0, part) for part in damping]
    found, begin, low = [], 0, 0.0
    while begin < len(size):
        wide = 1 if begin else SYSTEM.lowest_window
        end = begin + wide * SYSTEM.window if begin + (wide + 0.5) * SYSTEM.window < len(size) else len(size)
        near = np.unique(mode[max(begin - SYSTEM.window_margin, 0) : end + wide * SYSTEM.window_margin])
        poles, vectors = eigen([part[np.ix_(near, near)] for part in matrices], omega[near])
        high = _edge(np.abs(poles), size[end]) if end < len(size) else np.inf
        own = (np.abs(poles) >= low) & (np.abs(poles) < high)
        found.append(_completed(coupling, diagonal, near, poles[own], shapes(vectors, omega[near])[:, own]))
        low, begin = high, max(np.searchsorted(size, high), begin + 1)
    poles, left, slope = (np.concatenate(part, axis=-1) for part in zip(*found, strict=True))
    if len(poles) != len(size):
        raise np.linalg.LinAlgError
    return poles, left, (left / slope).T


def eigen(matrices, omega):
    """Poles x of a polynomial as `poles_in_windows` has it, and vectors of a linear eigenvalue problem.

    Modes that damping does not couple are solved apart: of a level cable the symmetric and the antisymmetric ones.

    Returns
    -------
    poles : ndarray, shape (N,)
    vectors : ndarray, shape (N, N)
        See `shapes`.
    """
    n, states = len(omega), len(matrices) - 1
    stiffness, *damping, mass = matrices
    poles, vectors = [np.zeros(0)], [np.zeros((states * n, 0))]
    for part in coupled_groups(mass, damping[0] if damping else 0 * mass, stiffness):
        own, found = _eigen_of_some([one[np.ix_(part, part)] for one in matrices], omega[part])
        whole = np.zeros((states, n, len(own)), dtype=complex)
        whole[:, part] = found.reshape(states, len(part), -1)
        poles.append(own)
        vectors.append(whole.reshape(-1, len(own)))
    return np.concatenate(poles), np.concatenate(vectors, axis=1)


def _eigen_of_some(matrices, omega):
    """`eigen` of modes that damping couples.

    The frequencies of the modes differ by many powers of ten, and an eigen-solution has rounding of the size of its
    largest eigenvalue: so the inverse is taken, for W q, and W q' in s: entries no larger than they must be.
    """
    n, unit = len(omega), np.outer(omega, omega)
    stiffness, *damping, _ = (part / unit for part in matrices)
    give = np.linalg.inv(stiffness)
    matrix = -give / unit
    if damping:
        matrix = np.block([[-give @ damping[0], -give / omega], [np.diag(1 / omega), np.zeros((n, n))]])
    slow, vectors = np.linalg.eig(matrix)
    return 1 / slow, vectors


def shapes(vectors, omega):
    """Amplitudes of the modes in the vectors of `eigen`, shape (n, N)."""
    return vectors[: len(omega)] / (1 if len(vectors) == len(omega) else omega[:, None])


def _alone(diagonal):
    """Poles of the modes without coupling, from the diagonals of the matrices, shape (1 or 2, n)."""
    if len(diagonal) == 2:
        return -diagonal[:1]
    half = diagonal[1] / 2
    return -half + np.sqrt(half**2 - diagonal[0] + 0j) * np.array([[1], [-1]])


def _edge(size, near):
    """Middle of the widest gap among sizes of poles about one of them."""
    size = np.sort(size)
    place = np.searchsorted(size, near)
    some = size[max(place - SYSTEM.window_edge, 0) : place + SYSTEM.window_edge]
    widest = np.argmax(np.diff(some))
    return (some[widest] + some[widest + 1]) / 2


def _completed(coupling, diagonal, near, poles, vectors):
    """Poles, shapes of all modes, and v^T Q' v, from those of the modes `near` alone: shapes (p,), (n, p), (p,)."""
    own = sum(part[:, None] * poles**order for order, part in enumerate(diagonal))
    own[near] = np.inf  # these do not follow
    pushed = _coupled(coupling, near, vectors, poles)
    moved = -pushed[0] / own
    again = _coupled(coupling, slice(None), moved, poles)
    moved = -(pushed[0] + again[0]) / own
    poles_moved = -(pushed[0] * moved).sum(axis=0)
    moved[near] = vectors
    slope = sum(order * part[:, None] * poles ** (order - 1) for order, part in enumerate(diagonal) if order)
    slope = (moved * (slope * moved + pushed[1] + again[1])).sum(axis=0)
    return poles + poles_moved / slope, moved, slope


def _coupled(coupling, columns, vectors, poles):
    """(Q - D) v of vectors of some modes, shape (n, p), and the part of it that grows with x, over x."""
    real, found = np.ascontiguousarray(vectors, dtype=complex).view(float), [0.0, 0.0]
    for order, factor, part in coupling:
        found[order] = factor * (part[:, columns] @ real).view(complex)
    return found[0] + found[1] * poles, found[1]
