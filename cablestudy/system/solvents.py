"""Poles of weakly damped motions from two eigenvalue problems of half the size of that of the state space.

A solvent S of Q(x) = x^2 + x C + K has S^2 + C S + K = 0: its eigenvectors are shapes of Q, with the same poles x, here
those of the upper half plane (Higham and Kim, Numerical analysis of a quadratic matrix equation, IMA Journal of
Numerical Analysis 20, 2000). The other poles are those of -(C + S), since Q(x) = (x + C + S) (x - S). With the poles
a_j of the uncoupled coordinates, those of the diagonals of C and K, in the upper half plane and b_j in the other, S is
the limit from diag(a) on of

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
    A solvent S, S^2 + C S + K = 0, has the poles a of one half plane as eigenvalues, and -(C + S) the others (see the
    module's docstring). The eigenvalues of the inverses are computed: slow poles are their largest ones, which rounding
    spares. With the eigenvectors X of S and Y of -(C + S), the residues of Q(x)^-1 = X (x - a)^-1 X^-1 (x + C + S)^-1
    at the other poles b are dyads with the shapes X (b - a)^-1 X^-1 Y. Of a real K these are complex conjugate ones.
    """
    half = np.diagonal(damping, axis1=1, axis2=2) / 2
    root = np.sqrt(half**2 - np.diagonal(stiffness, axis1=1, axis2=2) + 0j)
    uncoupled = np.stack([root - half, -root - half])
    uncoupled = np.take_along_axis(uncoupled, np.argsort(-uncoupled.imag, axis=0), axis=0)  # upper half plane, lower
    (rows, m), is_real = half.shape, not np.iscomplexobj(stiffness)
    found = (uncoupled[0].imag > 0).all(axis=-1) | (not is_real)
    tried = np.flatnonzero(found)
    of_tried = _of_both_half_planes(stiffness[tried], damping[tried], uncoupled[:, tried])
    poles, shapes = np.full((rows, 2 * m), np.nan + 0j), np.full((rows, m, 2 * m), np.nan + 0j)
    poles[tried], shapes[tried], found[tried] = of_tried
    return poles, shapes, found


def _of_both_half_planes(stiffness, damping, uncoupled):
    """Result of `eigen_by_solvents` of systems with poles of `uncoupled` coordinates in both half planes, (2, n, m)."""
    solvent, found = _solvents(stiffness, damping, *uncoupled), np.ones(len(stiffness), dtype=bool)
    poles, shapes = _eigen_by_inverse(solvent, found)
    if not np.iscomplexobj(stiffness):
        other_poles, other_shapes = poles.conj(), shapes.conj()
    else:
        other_poles, vectors = _eigen_by_inverse(-(damping + solvent), found)
        other_shapes = shapes @ ((inverse(shapes) @ vectors) / (other_poles[:, None] - poles[..., None]))
        other_shapes /= np.linalg.norm(other_shapes, axis=1, keepdims=True)
        found &= np.isfinite(other_shapes).all(axis=(-2, -1))
    return np.concatenate([poles, other_poles], axis=-1), np.concatenate([shapes, other_shapes], axis=-1), found


def _eigen_by_inverse(matrices, found):
    """Eigenvalues and eigenvectors of n matrices by those of their inverses; `found` becomes false without inverse."""
    inverses = inverse(matrices)  # not finite where no solvent was found, or a pole is zero
    found &= np.isfinite(inverses).all(axis=(-2, -1))
    inverses[~found] = 0.0
    values, vectors = np.linalg.eig(inverses)
    return 1 / values, vectors


def _solvents(stiffness, damping, own, other):
    """Solvents with the poles that coordinates alone have at `own`, but not at `other`, shape (n, m); or infinite."""
    solvents, inverse_distance = own[:, None] * np.eye(own.shape[-1]), 1 / (own[:, None] - other[:, :, None])
    found, rows = np.full(solvents.shape, np.inf, dtype=complex), np.arange(len(own))
    for _ in range(SYSTEM.solvent_steps):
        solvent, inverse_of_rows = solvents[rows], inverse_distance[rows]
        change = ((solvent + damping[rows]) @ solvent + stiffness[rows]) * inverse_of_rows
        solvents[rows] = solvent - change
        change *= inverse_of_rows
        size = np.sqrt((change.real**2 + change.imag**2).max(axis=(-2, -1)))  # several times faster than `abs`
        settled = size <= STATICS.sum_rounding * STATICS.rounding
        found[rows[settled]] = solvents[rows[settled]]
        rows = rows[~settled & (size < 1)]
    return found
