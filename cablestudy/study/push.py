"""A force along x on the end of a cable that is free along x: where that end comes to rest, of many cables at once.

The force g(u) that holds end 2 at a displacement u along x grows with u: its slope, the static end stiffness, is
positive. Newton's method on g(u) = g(0) + F, kept within a bracket that each step narrows, therefore finds the only u.
Far out the cable is straight and g nearly linear, so that a step from a soft place that goes much too far comes back.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.study.tolerances import STUDY

CONVERGED, TOO_MANY, UNBALANCED = range(3)
REASONS = ("converged", "no convergence", "rounding leaves a part of the force")


@dataclass(frozen=True)
class PushRecord:
    """The searches of n cables: steps, what is left of the force over force and tension, and why they ended."""

    steps: np.ndarray
    residual: np.ndarray
    reason: np.ndarray

    @property
    def converged(self):
        """Shape (n,)."""
        return self.reason == CONVERGED

    def describe(self, case):
        """One search in words."""
        return f"{REASONS[self.reason[case]]} in {self.steps[case]} steps, {self.residual[case]:.1e} left"


@dataclass(frozen=True)
class Push:
    """Displaced ends.

    Attributes
    ----------
    shift : ndarray, shape (n,)
        Displacement of end 2 along x. [m]
    error : ndarray, shape (n,)
        Its relative error, by the rounding of the tensions. [-]
    record : PushRecord
    """

    shift: np.ndarray
    error: np.ndarray
    record: PushRecord


def pushed_ends(span_at, force):
    """Displacements of end 2 along x by forces on it, what held it there before holding it on.

    Parameters
    ----------
    span_at : callable
        Displacements of end 2 along x, shape (n,) [m] -> `Span` of n cables with all other loads.
    force : ndarray, shape (n,)
        Along x. [N]

    Returns
    -------
    Push
    """
    shift, done = np.zeros(len(force)), force == 0
    low, high = np.where(force > 0, 0.0, -np.inf), np.where(force > 0, np.inf, 0.0)
    held, stiffness, tension, chord = _held(span_at(shift))
    target, steps = held + force, np.zeros(len(force), dtype=int)
    for _ in range(STUDY.push_steps):
        gap = target - held
        low, high = np.where(gap > 0, shift, low), np.where(gap < 0, shift, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            trial = shift + gap / stiffness
            middle = np.where(np.isfinite(low + high), (low + high) / 2, 2 * shift + np.sign(force) * chord)
        trial = np.where((trial > low) & (trial < high) & np.isfinite(trial), trial, middle)
        close = (np.abs(trial - shift) <= STUDY.epsilon * (chord + np.abs(shift))) | (gap == 0)
        done = done | close
        if done.all():
            break
        shift, steps = np.where(done, shift, trial), steps + ~done
        held, stiffness, tension, chord = _held(span_at(shift))
    gap = np.where(force == 0, 0.0, np.abs(target - held))
    scale = np.maximum(np.abs(force), tension)
    residual = np.divide(gap, scale, out=np.zeros_like(gap), where=scale > 0)
    unbalanced = np.where(residual <= STUDY.balanced, CONVERGED, UNBALANCED)
    reason = np.where(done, unbalanced, TOO_MANY)
    known = np.maximum(STUDY.epsilon * scale, gap) / np.maximum(stiffness, np.finfo(float).tiny)
    error = np.divide(known, np.abs(shift), out=np.sign(np.abs(force)), where=shift != 0)
    return Push(shift, np.minimum(error, 1.0), PushRecord(steps, residual, reason))


def _held(span):
    """Force that holds end 2 along x, and its slope; largest tension, and chord of each cable, shape (n,)."""
    cables = solve(span)
    force = -cables.end_forces("global")[..., 1, 0]
    along = span.frame[..., 0]
    # without a matrix product, whose rounding would depend on the number of cables
    slope = sum(along[..., i] * cables.end_stiffness[..., i, j] * along[..., j] for i in range(3) for j in range(3))
    return force, slope, cables.max_tension, span.chord
