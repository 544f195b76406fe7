"""Newton's method for the statics of a batch of cables: a convex energy, a guarded step and a record.

The tension vector N that a cable's end conditions determine minimises the complementary energy U*, which is strictly
convex. With the residual g = -dU*/dN (distance of the computed end 2 from its position) and the flexibility F =
d2U*/dN2,

    N <- N + share F^-1 g,

with a share of 1, which is halved as long as the step overshoots: as long as the slope of U* along the step has changed
its sign at the end and is more than half as steep as at the start. This converges from any start, and the solution is
unique (Boyd & Vandenberghe 2004, Convex Optimization, section 9.5).
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.records import assign_rows, take_rows
from cablestudy.cable.tolerances import CABLE

CONVERGED, STALLED, SLACK, UNDETERMINED = range(4)
REASONS = (
    "converged",
    "no convergence",
    "a part of the cable is slack",
    "no definite form: neither tension nor weight",
)


@dataclass(frozen=True)
class NewtonRecord:
    """Newton steps of one cable or of a batch; values of steps after a cable has stopped are NaN."""

    residual: np.ndarray  # largest component before each step, shape (steps, ...) [-]
    correction: np.ndarray  # size of each full step relative to the tension, shape (steps, ...) [-]
    share: np.ndarray  # of the full step that was taken, shape (steps, ...) [-]
    reason: np.ndarray  # why the iteration stopped, an index of REASONS, shape (...)

    @property
    def steps(self):
        """Number of steps, shape (...). [-]"""
        return np.isfinite(self.share).sum(axis=0)

    @property
    def converged(self):
        """True where the iteration converged, shape (...)."""
        return self.reason == CONVERGED

    @property
    def last_correction(self):
        """Size of the last full step, infinite where there was none, shape (...). [-]"""
        last = np.full(self.reason.shape, np.inf)
        for correction, taken in zip(self.correction, np.isfinite(self.share), strict=True):
            last = np.where(taken, correction, last)
        return last

    def of(self, index):
        """`NewtonRecord` of one cable of a batch, or of several."""
        all_steps = (slice(None), *np.index_exp[index])
        steps = (values[all_steps] for values in (self.residual, self.correction, self.share))
        return NewtonRecord(*steps, self.reason[index])

    def then(self, later):
        """`NewtonRecord` of this iteration and a later one, one after the other, with the reason of the later one."""
        pairs = ((self.residual, later.residual), (self.correction, later.correction), (self.share, later.share))
        return NewtonRecord(*(np.concatenate(pair) for pair in pairs), later.reason)

    def __str__(self):
        """Number of steps of one cable, their corrections, and why it stopped."""
        trace = ", ".join(
            f"{correction:.1e}" if correction > CABLE.whole_correction else f"below {CABLE.whole_correction:g}"
            for correction in self.correction[np.isfinite(self.share)]
        )
        return f"{self.steps} steps ({trace}); {REASONS[self.reason]}"


def newton(problem, unknown, active):
    """Solve the equilibrium of a batch of cables: Newton's method on the complementary energy, with halved steps.

    Parameters
    ----------
    problem : EquilibriumResidual or ElementResidual
        With methods `residual(unknown) -> g, point`, `step(g, point) -> F^-1 g`, `relative(step, unknown, point)` (size
        of a step relative to the unknown), `rounding(step)` (error of the slope along a step), `take(index)` (the
        problem of some cables of the batch, by an index of its axes), and the attributes
        `tolerance` (relative size of a step at which the iteration ends) and `stalled` (relative size below which the
        iteration also ends once a step is more than half the one before).
    unknown : ndarray, shape (d, ...)
        The start: components first, then the batch. [N] or in the problem's unit of force.
    active : ndarray of bool, shape (...)
        True for the cables to solve; the others are left as they are.

    Returns
    -------
    unknown : ndarray, shape (d, ...)
        The solution; no digit of a cable depends on the other cables.
    point : tuple
        Second value of `problem.residual` at the solution.
    record : NewtonRecord
    """
    gap, point = problem.residual(unknown)
    change, settled = np.full(active.shape, np.inf), np.zeros(active.shape, dtype=bool)
    trace, solution, moving = [], None, ...  # the last: index of the cables that are still iterated
    for _ in range(CABLE.newton_steps):
        step = problem.step(gap, point)
        slope = np.add.reduce(gap * step)
        least_slope = -0.5 * slope - problem.rounding(step)
        previous_change, change = change, np.where(active, problem.relative(step, unknown, point), change)
        share, large = active.astype(float), active & (change > CABLE.whole_correction)
        for _ in range(CABLE.newton_halvings):
            trial = unknown + share * step
            trial_gap, trial_point = problem.residual(trial)
            trial_slope = np.add.reduce(trial_gap * step)
            overshoots = large & (trial_slope < least_slope)
            if not np.count_nonzero(overshoots):
                break
            share = np.where(overshoots, share / 2, share)
        of_step = np.where(active, (np.maximum.reduce(np.abs(gap)), change, share), np.nan)
        trace.append(of_step if moving is ... else _in_whole_batch(of_step, settled.shape, moving))
        unknown, gap, point = trial, trial_gap, trial_point
        # a cable is done where its step is small, or rounding keeps it from falling further
        stalled = (change < problem.stalled) & (change >= previous_change / 2)
        small = (change < problem.tolerance) | stalled
        settled[moving] |= active & small & (share == 1)
        active = active & ~small & ~overshoots & np.isfinite(change)
        if not np.count_nonzero(active):
            break
        if CABLE.many_cables < active.size and active.sum() < CABLE.still_moving * active.size:
            kept = np.nonzero(active)
            if solution is None:
                solution, moving = (unknown, point), kept
            else:
                _assign(solution, moving, (unknown, point))
                moving = tuple(index[kept] for index in moving)
            problem, unknown, gap = problem.take(kept), unknown[:, *kept], gap[:, *kept]
            point, change, active = take_rows(point, kept), change[kept], active[kept]
    if solution is not None:
        _assign(solution, moving, (unknown, point))
        unknown, point = solution
    residual, change, share = np.moveaxis(np.array(trace), 1, 0)
    return unknown, point, NewtonRecord(residual, change, share, np.where(settled, CONVERGED, STALLED))


def _in_whole_batch(part, shape, index):
    """Numbers of the cables at an index of a batch in an array for the whole batch, NaN elsewhere."""
    whole = np.full((len(part), *shape), np.nan)
    whole[:, *index] = part
    return whole


def _assign(solution, index, part):
    """Write the unknown and the `point` of the cables at an index of a batch into those of the whole batch."""
    (unknown, point), (unknown_of_part, point_of_part) = solution, part
    unknown[:, *index] = unknown_of_part
    assign_rows(point, index, point_of_part)
