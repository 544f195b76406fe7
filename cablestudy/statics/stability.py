"""Stability of an equilibrium: sign of the least eigenvalue of its tangent stiffness, and its eigenvector, a motion.

Rows and columns of the stiffness are divided by the square root of the sum of sizes of the terms on their diagonal, so
that a scaled eigenvalue can be compared with the relative rounding of these terms. Where dead moments make the
stiffness unsymmetric its symmetric part decides.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.matrices import shifted_factors
from cablestudy.cable.vectors import largest
from cablestudy.statics import block_stiffness, tangent
from cablestudy.statics.tolerances import STATICS

STABLE, MECHANISM, UNSTABLE = range(3)
MOTIONS = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Stability:
    """Stability of each case of a batch of equilibria.

    Attributes
    ----------
    least : ndarray, shape (...)
        Least eigenvalue of the scaled stiffness; infinite where nothing is free. [-]
    verdict : ndarray of int, shape (...)
        STABLE, MECHANISM (a motion that nothing holds) or UNSTABLE (a motion that runs away).
    motion : ndarray, shape (..., b, 6)
        Eigenvector of the least eigenvalue, unscaled: displacements, and rotations times the size of the body, over the
        largest component of them all. [-]
    body_names : tuple of str
    """

    least: np.ndarray
    verdict: np.ndarray
    motion: np.ndarray
    body_names: tuple

    @property
    def stable(self):
        """True where a case is stable, shape (...)."""
        return self.verdict == STABLE

    def motion_name(self, case=()):
        """Name of the motion of one case, as "gondola yaw" or "gondola x and gondola pitch"."""
        motion = np.abs(self.motion[case])
        components = np.argsort(-motion, axis=None, kind="stable")[: STATICS.named_components]  # largest first
        named = [i for i in components if motion.flat[i] >= STATICS.named_share]
        return " and ".join(f"{self.body_names[i // 6]} {MOTIONS[i % 6]}" for i in named)

    def reason(self, case=()):
        """Reason why one case is not a stable equilibrium, for a message; an empty string where the case is stable."""
        words = {MECHANISM: "nothing holds", UNSTABLE: "unstable:"}
        verdict = int(self.verdict[case])
        return f"{words[verdict]} {self.motion_name(case)}" if verdict in words else ""


def stability_of(equilibrium):
    """Tell whether equilibria are stable, by the least eigenvalue of the scaled tangent stiffness: `Stability`.

    It is STABLE if the eigenvalue is above a tolerance, UNSTABLE if it is below minus the tolerance, else a MECHANISM,
    a motion that nothing holds. The tolerance is the larger one of `STATICS.zero_eigenvalue` and the relative net force
    that the search has left. Cables without weight, loads and tension are left out.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of one case or a batch.
    """
    suspension, blocks = equilibrium.suspension, _blocks_without_loose_cables(equilibrium)
    if not suspension.free.any():
        shape = blocks.matrices.shape[:-3]
        motion = np.zeros((*shape, *suspension.free.shape))
        return Stability(np.full(shape, np.inf), np.full(shape, STABLE), motion, suspension.body_names)
    sizes = block_stiffness.magnitudes(blocks, suspension)
    scales = np.sqrt(np.where(sizes > 0, sizes, 1.0))
    least, vector = _least_eigenvalues(blocks, suspension, scales)
    # forces that are balanced to the residual only leave the geometric stiffness uncertain by as much
    tolerance = np.maximum(STATICS.zero_eigenvalue, equilibrium.record.residual)
    verdict = np.where(least > tolerance, STABLE, np.where(least < -tolerance, UNSTABLE, MECHANISM))
    motion = np.zeros((*least.shape, *suspension.free.shape))
    motion[..., suspension.free] = vector / scales
    motion *= tangent.motion_units(suspension)
    motion /= largest(motion).max(axis=-1)[..., None, None]
    return Stability(least, verdict, motion, suspension.body_names)


def _least_eigenvalues(blocks, suspension, scales):
    """Least eigenvalue, shape (...), and its eigenvector, (..., d), of the stiffness scaled by `scales`, (..., d)."""
    if scales.shape[-1] <= STATICS.dense_freedoms:
        matrix = block_stiffness.scaled_dense(blocks, suspension, scales)
        values, vectors = np.linalg.eigh((matrix + np.swapaxes(matrix, -1, -2)) / 2)
        return values[..., 0], vectors[..., 0]
    shape = blocks.matrices.shape[:-3]
    least, vector = np.empty(shape), np.empty(scales.shape)
    for case in np.ndindex(shape):
        matrix = block_stiffness.scaled_sparse(blocks.of(case), suspension, scales[case])
        least[case], vector[case] = _least_eigenvalue(matrix)
    return least, vector


def _blocks_without_loose_cables(equilibrium):
    """`block_stiffness.Blocks` of the equilibrium without its loose cables, which hold nothing.

    A cable is loose if it has neither weight nor loads, and a tension no larger than the rounding of its strain:
    rounding decides whether it is just taut or just slack.
    """
    span, tension = equilibrium.catenary.span, equilibrium.catenary.max_tension
    loose = (
        (tension <= STATICS.rounding * span.axial_stiffness)
        & (np.asarray(span.weight) == 0)
        & (span.load_positions.size == 0)
    )
    if not loose.any():
        return equilibrium.blocks
    links = len(equilibrium.suspension.link_names)
    loose = np.pad(loose, [(0, 0)] * (loose.ndim - 1) + [(0, links)])[..., None, None]
    forces = np.where(loose, 0.0, equilibrium.end_forces)
    stiffness = np.where(loose, 0.0, equilibrium.end_stiffness)
    return tangent.stiffness_blocks(equilibrium.suspension, equilibrium.rotation, equilibrium.arms, forces, stiffness)


def _least_eigenvalue(matrix):
    """Least eigenvalue of a sparse matrix that is symmetric except for rounding, and its eigenvector."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    matrix = ((matrix + matrix.T) / 2).tocsc()
    factors, shift = shifted_factors(matrix, STATICS.zero_eigenvalue)
    inverse = LinearOperator(matrix.shape, factors.solve, dtype=float)
    first_vector = np.random.default_rng(1).normal(size=matrix.shape[0])
    values, vectors = eigsh(matrix, 1, sigma=-shift, which="LM", OPinv=inverse, v0=first_vector)
    return values[0], vectors[:, 0]
