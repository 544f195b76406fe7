"""A force along x on the end of a cable that is free along x: the position of rest of that end, of many cables at once.

The force g(u) that holds end 2 at a displacement u along x grows with u: its slope, the static end stiffness, is
positive. Newton's method on g(u) = g(0) + F, kept within a bracket that each step narrows, therefore finds the only
solution u. Far out the cable is straight and g nearly linear, so that a step that goes much too far, from a soft form,
comes back.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.study.tolerances import STUDY

CONVERGED, TOO_MANY, UNBALANCED = range(3)
REASONS = ("converged", "no convergence", "rounding leaves a part of the force")


@dataclass(frozen=True)
class PushRecord:
    """The searches of n cables, arrays of shape (n,)."""

    steps: np.ndarray  # [-]
    residual: np.ndarray  # force out of balance, over the larger one of the force and the tension [-]
    reason: np.ndarray  # of the end of the search, an index into REASONS

    @property
    def converged(self):
        """True of searches that found an equilibrium, shape (n,)."""
        return self.reason == CONVERGED

    def describe(self, case):
        """Text on the search of one case."""
        return f"{REASONS[self.reason[case]]} in {self.steps[case]} steps, {self.residual[case]:.1e} left"


@dataclass(frozen=True)
class Push:
    """Displacements of n cable ends by forces on them.

    Attributes
    ----------
    shift : ndarray, shape (n,)
        Displacement of end 2 along x. [m]
    error : ndarray, shape (n,)
        Relative error of `shift`, by the rounding of the tensions. [-]
    record : PushRecord
    """

    shift: np.ndarray
    error: np.ndarray
    record: PushRecord


def pushed_ends(span_at, force):
    """Displacements of n cable ends along x by forces F on them, from the positions of rest without F: `Push`.

    Solves g(u) = g(0) + F for u, with the force g(u) that holds end 2 at the displacement u (head of this file).

    Parameters
    ----------
    span_at : callable
        Displacements of end 2 along x, shape (n,) [m] -> `Span` of n cables with all other loads.
    force : ndarray, shape (n,)
        F of each cable, along x. [N]
    """
    shift, done = np.zeros(len(force)), force == 0
    low, high = np.where(force > 0, 0.0, -np.inf), np.where(force > 0, np.inf, 0.0)
    holding_force, stiffness, tension, chord = _holding_force(span_at(shift))
    target, steps = holding_force + force, np.zeros(len(force), dtype=int)
    for _ in range(STUDY.push_steps):  # of Newton's method; the solution stays between low and high
        imbalance = target - holding_force
        low, high = np.where(imbalance > 0, shift, low), np.where(imbalance < 0, shift, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            next_shift = shift + imbalance / stiffness
            middle = np.where(np.isfinite(low + high), (low + high) / 2, 2 * shift + np.sign(force) * chord)
        next_shift = np.where((next_shift > low) & (next_shift < high) & np.isfinite(next_shift), next_shift, middle)
        settled = (np.abs(next_shift - shift) <= STUDY.epsilon * (chord + np.abs(shift))) | (imbalance == 0)
        done = done | settled
        if done.all():
            break
        shift, steps = np.where(done, shift, next_shift), steps + ~done
        holding_force, stiffness, tension, chord = _holding_force(span_at(shift))
    imbalance = np.where(force == 0, 0.0, np.abs(target - holding_force))
    scale = np.maximum(np.abs(force), tension)
    residual = np.divide(imbalance, scale, out=np.zeros_like(imbalance), where=scale > 0)
    unbalanced = np.where(residual <= STUDY.balanced, CONVERGED, UNBALANCED)
    reason = np.where(done, unbalanced, TOO_MANY)
    force_error = np.maximum(STUDY.epsilon * scale, imbalance) / np.maximum(stiffness, np.finfo(float).tiny)
    error = np.divide(force_error, np.abs(shift), out=np.sign(np.abs(force)), where=shift != 0)
    return Push(shift, np.minimum(error, 1.0), PushRecord(steps, residual, reason))


def _holding_force(span):
    """Force that holds end 2 along x [N], its slope [N/m], largest tension [N] and chord [m], each of shape (n,)."""
    cables = solve(span)
    force = -cables.end_forces("global")[..., 1, 0]
    x_axis = span.frame[..., 0]
    # without a matrix product, whose rounding would depend on the number of cables
    slope = sum(x_axis[..., i] * cables.end_stiffness[..., i, j] * x_axis[..., j] for i in range(3) for j in range(3))
    return force, slope, cables.max_tension, span.chord
