"""Damping ratios of coupled modes, from the poles of the damped system in a space spanned by its undamped modes."""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


def damped_poles(system, omega, shapes, loads=None):
    """Find the pole of the damped system that belongs to each of k undamped modes, and its damping ratio -Re s/|s|.

    Parameters
    ----------
    system : LinearSystem
        Of n coordinates, with M, C and K; K is complex where damping is hysteretic.
    omega : ndarray, shape (k,)
        W: angular frequencies of some of the lowest modes, in any order. [rad/s]
    shapes : ndarray, shape (n, k)
        Mass-normalised shapes of these modes.
    loads : callable, optional
        Shapes, (n, m) -> A times these, with a load stiffness A besides K, which need not be symmetric.

    Returns
    -------
    poles : ndarray, complex, shape (k,)
        s; NaN where a mode does not oscillate. [rad/s]
    ratio : ndarray, shape (k,)
        -Re s/|s|; see Notes for a mode that does not oscillate. [-]

    Notes
    -----
    The poles are those of s^2 I + s Phi^T C Phi + W^2 + i Phi^T Im(K) Phi + Phi^T A Phi. The columns of Phi are the k
    modes, `SYSTEM.coupled_modes` further ones that damping may couple to these, and Ritz vectors. These are the static
    response of the system to the damping forces of the k modes, Im(K) phi, C phi and A phi. Modes and poles are paired
    so that the sum of the shares of the modes in the motion of their poles is largest. A mode that does not oscillate
    has the ratio

        phi^T C phi/(2 W) + phi^T Im(K) phi/(2 W^2).
    """
    count, loss, damping = len(omega), system.stiffness.imag, system.damping
    by_loads = [loads(shapes)] if loads else []
    damping_forces = [forces for forces in (loss @ shapes, damping @ shapes, *by_loads) if np.any(forces)]
    if not damping_forces:
        return 1j * omega, np.zeros(count)
    omega, basis = _with_coupled_modes(system, omega, shapes)
    static_omega, static_shapes = ritz(system, basis, system.compliance(np.concatenate(damping_forces, axis=1)))
    omega, basis = np.concatenate([omega, static_omega]), np.concatenate([basis, static_shapes], axis=1)
    damping, loss = basis.T @ (damping @ basis), basis.T @ (loss @ basis)
    further = 1j * loss + (basis.T @ loads(basis) if loads else 0.0)
    poles, share = _oscillating_poles(omega, damping, further)
    share = share[:count]
    mode, pole = assign_columns(share)  # indices of modes, and of the poles that belong to them
    ratio = (np.diagonal(damping) / (2 * omega) + np.diagonal(loss) / (2 * omega**2))[:count]
    oscillates = (share[mode, pole] >= SYSTEM.oscillating_share) | (ratio[mode] <= 1)
    mode, pole = mode[oscillates], pole[oscillates]
    ratio[mode] = np.maximum(-poles.real[pole], 0.0) / np.abs(poles[pole])  # what is below zero is rounding
    pole_of_mode = np.full(count, complex(np.nan, np.nan))
    pole_of_mode[mode] = poles[pole]
    return pole_of_mode, ratio


def _oscillating_poles(omega, damping, further):
    """Poles above the real axis, shape (p,), of q'' + C q' + (w^2 + D) q = 0, and share of each q in them, (n, p).

    C is `damping` and D the `further` stiffness, complex, shape (n, n); the shares of all n coordinates in the motion
    of a pole add up to 1.
    """
    modes = len(omega)
    # states w q and q', of like size
    further = further if further.imag.any() else further.real
    stiffness = np.diag(omega) + further / omega
    poles, vectors = np.linalg.eig(np.block([[np.zeros((modes, modes)), np.diag(omega)], [-stiffness, -damping]]))
    oscillating = poles.imag > 0
    share = np.abs(vectors[:modes, oscillating]) ** 2
    return poles[oscillating], share / share.sum(axis=0)


def _with_coupled_modes(system, omega, shapes):
    """Frequencies and shapes of modes, and after them those of others that damping may couple to them."""
    other_omega, other_shapes = system.lowest(len(omega) + SYSTEM.coupled_modes)
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
    """Approximate further modes of p systems in the space of given vectors, by the Rayleigh-Ritz method.

    Parameters
    ----------
    system : LinearSystem
        The p systems ("rows") of n coordinates each; or one, whose matrices may be sparse, with p = 1.
    basis : ndarray, shape (p, n, k)
        Mass-normalised shapes of k known modes of each system.
    vectors : ndarray, shape (p, n, r)
        Displacements that span the space, such as static responses; they need not be independent.

    Returns
    -------
    list of (ndarray, ndarray)
        For each system q <= r angular frequencies, descending, shape (q,) [rad/s]; and mass-normalised shapes, shape
        (n, q), which diagonalise M and Re(K), and are orthogonal for M to the known modes.
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
        mass = system.mass if len(rows) == len(counts) else system.mass[rows]
        products = np.swapaxes(independent, -1, -2) @ _times(mass, independent)
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
