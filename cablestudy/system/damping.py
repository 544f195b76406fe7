"""Damping ratios of coupled modes, from the poles of the damped system in a space spanned by its undamped modes."""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


def damping_ratios(system, omega, shapes, coupled=SYSTEM.coupled_modes):
    """Damping ratio -Re s/|s| of the pole that belongs to each mode, shape (k,); see `damped_poles`. [-]"""
    return damped_poles(system, omega, shapes, coupled)[1]


def damped_poles(system, omega, shapes, coupled=SYSTEM.coupled_modes):
    """Pole of the damped system that belongs to each of some undamped modes, and its damping ratio -Re s/|s|.

    Parameters
    ----------
    system : LinearSystem
    omega : ndarray, shape (k,)
        Angular frequencies of some of the lowest modes, in any order. [rad/s]
    shapes : ndarray, shape (n, k)
        Mass-normalised shapes of these modes.
    coupled : int
        Number of other modes that damping may couple to these: the poles are found in the space of all.

    Returns
    -------
    poles : ndarray, shape (k,)
        Not a number where a mode does not oscillate. [rad/s]
    ratio : ndarray, shape (k,)
        [-]

    Notes
    -----
    The poles are those of s^2 + s phi^T C phi + w^2 + i phi^T Im K phi in a space of these modes, some others, and
    the static response K^-1 C phi to the damping forces of these modes. A pole belongs to the mode that has the largest
    part in its motion; a mode that does not oscillate has phi^T C phi/(2 w).
    """
    count, loss, damping = len(omega), system.stiffness.imag, system.damping
    damping_forces = loss @ shapes
    damping_forces = damping_forces if np.any(damping_forces) else damping @ shapes
    if not np.any(damping_forces):
        return 1j * omega, np.zeros(count)
    omega, basis = _with_coupled_modes(system, omega, shapes, coupled)
    static_omega, static_shapes = ritz(system, basis, system.compliance(damping_forces))
    omega, basis = np.concatenate([omega, static_omega]), np.concatenate([basis, static_shapes], axis=1)
    damping, loss = basis.T @ (damping @ basis), basis.T @ (loss @ basis)
    poles, share = _oscillating_poles(omega, damping, loss)
    share = share[:count]
    mode, pole = assign_columns(share)  # indices of modes, and of the poles that belong to them
    ratio = (np.diagonal(damping) / (2 * omega) + np.diagonal(loss) / (2 * omega**2))[:count]
    oscillates = (share[mode, pole] >= SYSTEM.oscillating_share) | (ratio[mode] <= 1)
    mode, pole = mode[oscillates], pole[oscillates]
    ratio[mode] = np.maximum(-poles.real[pole], 0.0) / np.abs(poles[pole])  # what is below zero is rounding
    pole_of_mode = np.full(count, complex(np.nan, np.nan))
    pole_of_mode[mode] = poles[pole]
    return pole_of_mode, ratio


def _oscillating_poles(omega, damping, loss):
    """Poles above the real axis, shape (p,), of q'' + C q' + (w^2 + i D) q = 0, and share of each q in them, (n, p).

    C is `damping` and D `loss`, shape (n, n); the shares of all n coordinates in the motion of a pole add up to 1.
    """
    modes = len(omega)
    # states w q and q', of like size
    stiffness = np.diag(omega) + (1j * loss / omega if loss.any() else 0.0)
    poles, vectors = np.linalg.eig(np.block([[np.zeros((modes, modes)), np.diag(omega)], [-stiffness, -damping]]))
    oscillating = poles.imag > 0
    share = np.abs(vectors[:modes, oscillating]) ** 2
    return poles[oscillating], share / share.sum(axis=0)


def _with_coupled_modes(system, omega, shapes, coupled):
    """Frequencies and shapes of modes, and after them those of so many others that damping may couple to them."""
    other_omega, other_shapes = system.lowest(len(omega) + coupled)
    product = shapes.T @ (system.mass @ other_shapes)
    others = np.delete(np.arange(len(other_omega)), assign_columns(product**2)[1])
    other_omega, other_shapes = other_omega[others], other_shapes[:, others]
    if np.abs(product[:, others]).max(initial=0.0) > SYSTEM.not_orthogonal:
        other_omega, other_shapes = ritz(system, shapes, other_shapes)
    return np.concatenate([omega, other_omega]), np.concatenate([shapes, other_shapes], axis=1)


def ritz(system, basis, vectors):
    """`ritz_of_rows` of one system, with `basis` and `vectors` of shapes (n, k) and (n, r): one pair of arrays."""
    return ritz_of_rows(system, basis[None], vectors[None])[0]


def ritz_of_rows(system, basis, vectors):
    """Approximate further modes of systems from vectors, by the Rayleigh-Ritz method, orthogonal to some known modes.

    Parameters
    ----------
    system : LinearSystem
        Of n coordinates; of p rows, or of one, whose matrices may be sparse.
    basis : ndarray, shape (p, n, k)
        Mass-normalised shapes of the known modes.
    vectors : ndarray, shape (p, n, r)
        Displacements whose space has the further modes, such as static responses; they need not be independent.

    Returns
    -------
    list of (ndarray, ndarray)
        Of each row the angular frequencies, at most r, ascending, shape (q,) [rad/s]; and the mass-normalised shapes,
        orthogonal to the known modes, shape (n, q).
    """
    stiffness = system.stiffness.real
    size = np.sqrt((vectors * _times(stiffness, vectors)).sum(axis=-2, keepdims=True))
    vectors = vectors / np.where(size > 0, size, 1.0)
    vectors = vectors - basis @ (np.swapaxes(basis, -1, -2) @ _times(system.mass, vectors))
    strain_energy, directions = np.linalg.eigh(np.swapaxes(vectors, -1, -2) @ _times(stiffness, vectors))
    counts = np.count_nonzero(strain_energy > SYSTEM.dependent_ritz, axis=-1)
    found = [None] * len(counts)
    for count in set(counts.tolist()):  # of independent vectors: the last ones, since energies ascend
        rows, last = np.flatnonzero(counts == count), slice(vectors.shape[-1] - count, None)
        scaled = directions[rows][..., last] / np.sqrt(strain_energy[rows][:, None, last])
        independent = vectors[rows] @ scaled
        of_rows = system if len(rows) == len(counts) else system.take(rows)
        products = np.swapaxes(independent, -1, -2) @ _times(of_rows.mass, independent)
        for row, own, compliance, combined in zip(rows.tolist(), independent, *np.linalg.eigh(products), strict=True):
            massive = compliance > SYSTEM.dependent_ritz * compliance.max(initial=0.0)
            root = np.sqrt(compliance[massive])
            found[row] = 1 / root, own @ (combined[:, massive] / root)
    return found


def _times(matrix, vectors):
    """Products of matrices and vectors of rows, shape (p, n, r); of one row for a sparse matrix."""
    return matrix @ vectors if isinstance(matrix, np.ndarray) else (matrix @ vectors[0])[None]


def assign_columns(scores):
    """Assign one column to each row of a matrix so that the sum of their entries is largest: rows, columns."""
    best = scores.argmax(axis=1) if scores.size else []
    if len(np.unique(best)) == len(scores):  # no sum of one entry of each row is larger, and none need be searched
        return np.arange(len(scores)), best
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(scores, maximize=True)
