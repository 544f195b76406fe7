"""Stability of an equilibrium: the least eigenvalue of its stiffness, and the motion that is not held.

Rotations are multiplied by the size of the body, so that all eigenvalues are in N/m. Where dead moments make the
stiffness unsymmetric its symmetric part decides.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system import tangent

STABLE, MECHANISM, UNSTABLE = range(3)
MOTIONS = ("x", "y", "z", "roll", "pitch", "yaw")
ROUNDING = 1e-14  # of the largest eigenvalue: those smaller count as zero
SHARE = 0.5  # of the largest component of a motion: components from here on are named
NAMED = 3  # components that are named at most


@dataclass(frozen=True)
class Stability:
    """Verdict on each case.

    Attributes
    ----------
    least, tolerance : ndarray, shape (...)
        Least eigenvalue, and the size up to which one counts as zero. [N/m]
    verdict : ndarray of int, shape (...)
        STABLE, MECHANISM (a motion that nothing holds) or UNSTABLE (a motion that runs away).
    motion : ndarray, shape (..., b, 6)
        Of the least eigenvalue, rotations times the size of the body; its largest component is 1. [-]
    body_names : tuple of str
    """

    least: np.ndarray
    tolerance: np.ndarray
    verdict: np.ndarray
    motion: np.ndarray
    body_names: tuple

    @property
    def stable(self):
        """Shape (...)."""
        return self.verdict == STABLE

    def motion_name(self, case=()):
        """The motion of one case in words, as "gondola yaw" or "gondola x and gondola pitch"."""
        motion = np.abs(self.motion[case])
        largest = np.argsort(-motion, axis=None, kind="stable")[:NAMED]
        named = [i for i in largest if motion.flat[i] >= SHARE]
        return " and ".join(f"{self.body_names[i // 6]} {MOTIONS[i % 6]}" for i in named)

    def reason(self, case=()):
        """Why one case is no stable equilibrium; an empty string where it is one."""
        words = {MECHANISM: "nothing holds", UNSTABLE: "unstable:"}
        verdict = int(self.verdict[case])
        return f"{words[verdict]} {self.motion_name(case)}" if verdict in words else ""


def judge(equilibrium):
    """Stability of a batch of equilibria.

    Parameters
    ----------
    equilibrium : Equilibrium

    Returns
    -------
    Stability
    """
    suspension, blocks = equilibrium.suspension, equilibrium.blocks
    scales = tangent.coordinate_scales(suspension)
    if scales.shape[-1] <= tangent.DENSE:
        matrix = tangent.dense(blocks, suspension) / (scales[..., :, None] * scales[..., None, :])
        values, vectors = np.linalg.eigh((matrix + np.swapaxes(matrix, -1, -2)) / 2)
        least, vector = values[..., 0], vectors[..., 0]
        largest = np.abs(values).max(axis=-1)
    else:
        shape = blocks.matrices.shape[:-3]
        least, largest, vector = np.empty(shape), np.empty(shape), np.empty(scales.shape)
        for case in np.ndindex(shape):
            matrix = tangent.scaled_sparse(blocks.of(case), suspension, scales[case])
            least[case], largest[case], vector[case] = _lowest(matrix)
    tolerance = ROUNDING * largest
    verdict = np.where(least > tolerance, STABLE, np.where(least < -tolerance, UNSTABLE, MECHANISM))
    motion = np.zeros((*least.shape, *suspension.free.shape))
    motion[..., suspension.free] = vector / np.abs(vector).max(axis=-1, keepdims=True)
    return Stability(least, tolerance, verdict, motion, suspension.body_names)


def _lowest(matrix):
    """Least eigenvalue, a bound of the largest, and the eigenvector of the least, of a symmetric sparse matrix."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import LinearOperator, eigsh

    matrix = ((matrix + matrix.T) / 2).tocsc()
    count = matrix.shape[0]
    largest = abs(matrix).sum(axis=0).max()
    unit, shift = diags_array(np.ones(count), format="csc"), 0.0
    while (factors := tangent.factorised(matrix + shift * unit)) is None:
        shift = max(10 * shift, ROUNDING * largest, np.finfo(float).tiny)
    inverse = LinearOperator(matrix.shape, factors.solve, dtype=float)
    begin = np.random.default_rng(1).normal(size=count)
    values, vectors = eigsh(matrix, 1, sigma=-shift, which="LM", OPinv=inverse, v0=begin)
    return values[0], largest, vectors[:, 0]
