"""Poles of weakly damped motions from two eigenvalue problems of half the size of that of the state space.

A solvent S of Q(x) = x^2 + x C + K has S^2 + C S + K = 0: its eigenvectors are shapes of Q, with the same poles x. One
has the poles of the upper half plane, another those of the lower (Higham and Kim, Numerical analysis of a quadratic
matrix equation, IMA Journal of Numerical Analysis 20, 2000). With the poles a_j of the uncoupled coordinates, those of
the diagonals of C and K, in one half plane and b_j in the other, S is the limit from diag(a) on of

    S_ij -> S_ij - (S^2 + C S + K)_ij/(a_j - b_i),

fast for weak damping, since all a are far from all b: Newton's method with the diagonal of its Sylvester equation.
"""

import numpy as np

from cablestudy.cable.matrices import inverse
from cablestudy.statics.tolerances import STATICS
from cablestudy.system.tolerances import SYSTEM


@np.errstate(all="ignore")  # at critical damping both poles of a coordinate are equal; what is not finite is not found
def eigen_by_solvents(stiffness, damping):
    """Poles and shapes of Q(x) = x^2 I + x C + K of n systems, from eigenvalue problems of size m in place of 2 m.

    Parameters
    ----------
    stiffness, damping : ndarray, shape (n, m, m)
        K, real or complex, and C, real.

    Returns
    -------
    poles : ndarray, complex, shape (n, 2 m)
        Those of one half plane, then those of the other.
    shapes : ndarray, complex, shape (n, m, 2 m)
        Columns v with Q(pole) v = 0.
    found : ndarray of bool, shape (n,)
        False where no solvent was found, as with strong damping: poles and shapes are then of no use.

    Notes
    -----
    A solvent S, S^2 + C S + K = 0, has the poles of one half plane as eigenvalues (see the module's docstring). The
    eigenvalues of S^-1 are computed: slow poles are its largest ones, which rounding spares. Of a real K the other
    poles are the complex conjugate ones.
    """
    half = np.diagonal(damping, axis1=1, axis2=2) / 2
    root = np.sqrt(half**2 - np.diagonal(stiffness, axis1=1, axis2=2) + 0j)
    uncoupled = np.stack([root - half, -root - half])
    uncoupled = np.take_along_axis(uncoupled, np.argsort(-uncoupled.imag, axis=0), axis=0)  # upper half plane, lower
    (rows, m), is_real = half.shape, not np.iscomplexobj(stiffness)
    poles, shapes = np.full((rows, 2, m), np.nan + 0j), np.full((rows, m, 2, m), np.nan + 0j)
    found = (uncoupled[0].imag > 0).all(axis=-1) | (not is_real)
    for side in (0,) if is_real else (0, 1):
        tried = np.flatnonzero(found)
        own, other = uncoupled[side, tried], uncoupled[1 - side, tried]
        inverse_of_half = inverse(_solvents(stiffness[tried], damping[tried], own, other))
        # not finite where no solvent was found, or a pole is zero
        found[tried] = finite = np.isfinite(inverse_of_half).all(axis=(-2, -1))
        inverse_poles, shapes[found, :, side] = np.linalg.eig(inverse_of_half[finite])
        poles[found, side] = 1 / inverse_poles
    if is_real:
        poles[found, 1], shapes[found, :, 1] = poles[found, 0].conj(), shapes[found, :, 0].conj()
    return poles.reshape(rows, 2 * m), shapes.reshape(rows, m, 2 * m), found


def _solvents(stiffness, damping, own, other):
    """Solvents with the poles that coordinates alone have at `own`, but not at `other`, shape (n, m); or infinite."""
    solvents, distance = own[:, None] * np.eye(own.shape[-1]), own[:, None] - other[:, :, None]
    found, rows = np.full(solvents.shape, np.inf, dtype=complex), np.arange(len(own))
    for _ in range(SYSTEM.solvent_steps):
        solvent = solvents[rows]
        change = ((solvent + damping[rows]) @ solvent + stiffness[rows]) / distance[rows]
        solvents[rows] = solvent - change
        size = np.abs(change / distance[rows]).max(axis=(-2, -1))
        settled = size <= STATICS.sum_rounding * STATICS.rounding
        found[rows[settled]] = solvents[rows[settled]]
        rows = rows[~settled & (size < 1)]
    return found
