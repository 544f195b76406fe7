"""Poles of weakly damped motions from two eigenvalue problems of half the size of that of the state space.

A solvent S of Q(x) = x^2 + x C + K has S^2 + C S + K = 0: its eigenvectors are shapes of Q, with the same poles x. One
has the poles of the upper half plane, another those of the lower (Higham and Kim, Numerical analysis of a quadratic
matrix equation, IMA Journal of Numerical Analysis 20, 2000). With the poles a_j of the uncoupled coordinates, those of
the diagonals of C and K, in one half plane and b_j in the other, S is the limit from diag(a) on of

    S_ij -> S_ij - (S^2 + C S + K)_ij/(a_j - b_i),

fast for weak damping, since all a are far from all b: Newton's method with the diagonal of its Sylvester equation.
"""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


@np.errstate(divide="ignore", invalid="ignore")  # at critical damping both poles of a coordinate are equal
def eigen_by_solvents(stiffness, damping):
    """Poles, shape (2 n,), and shapes, (n, 2 n), of Q(x) = x^2 + x C + K; None where the solvents are not found.

    The inverses of the solvents are taken, since the slow poles then are the largest eigenvalues, which rounding
    spares.

    Parameters
    ----------
    stiffness : ndarray, complex, shape (n, n)
        K.
    damping : ndarray, shape (n, n)
        C.
    """
    half = np.diagonal(damping) / 2
    uncoupled = np.sqrt(half**2 - np.diagonal(stiffness) + 0j) * np.array([[1], [-1]]) - half
    uncoupled = np.take_along_axis(uncoupled, np.argsort(uncoupled.imag, axis=0), axis=0)  # lower half plane, upper one
    settled, poles, shapes = SYSTEM.sum_rounding * SYSTEM.rounding, [], []
    for own, other in (uncoupled, uncoupled[::-1]):
        solvent, distance = np.diag(own), own - other[:, None]
        for _ in range(SYSTEM.solvent_steps):
            change = ((solvent + damping) @ solvent + stiffness) / distance
            solvent = solvent - change
            if not settled < (size := np.abs(change / distance).max()) < 1:
                break
        if not size <= settled:
            return None
        try:
            inverse_poles, of_half = np.linalg.eig(np.linalg.inv(solvent))
        except np.linalg.LinAlgError:  # a pole is zero
            return None
        poles.append(1 / inverse_poles)
        shapes.append(of_half)
    return np.concatenate(poles), np.concatenate(shapes, axis=1)
