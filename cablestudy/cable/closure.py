"""What closes a cable: the tension vector at mid-length for which its segments, end to end, reach from end to end.

Newton on the complementary energy, which is strictly convex; without weight it has a kink where a segment loses its
tension.
"""

import numpy as np

from cablestudy.cable.segment import TINY, extension, flexibility, solve_symmetric

MAX_STEPS = 60
STUCK = 1e-12  # share of a Newton step in which there is still none: at a fold without tension


class Closure:
    """The closure of the segments, end to end, for tension vectors at mid-length.

    Parameters
    ----------
    span : Span
    segments : Segments
    """

    def __init__(self, span, segments):
        self.segments = segments
        self.angles = np.asarray(span.cosine)[..., None], np.asarray(span.sine)[..., None]
        self.stiffness = np.asarray(span.axial_stiffness, dtype=float)[..., None]
        self.shape = np.broadcast_shapes(
            self.angles[0].shape[:-1], self.stiffness.shape[:-1], segments.weight.shape[:-1]
        )
        self.strain = np.broadcast_to(span.chord_strain, self.shape)

    def tension(self, unknown):
        """At mid-segment, 3 arrays of shape (..., k + 1)."""
        return tuple(u[..., None] + o for u, o in zip(unknown, self.segments.offset, strict=True))

    def residual(self, unknown):
        """Tensions, kernel, and what is missing to end 2, per unstretched length."""
        tension = self.tension(unknown)
        parts, kernel = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        gap = [(part * self.segments.fraction).sum(axis=-1) for part in parts]
        return tension, kernel, (self.strain - gap[0], -gap[1], -gap[2])

    def matrix(self, tension, kernel):
        """Movement of end 2 per force, per unstretched length."""
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, kernel)
        return tuple((entry * self.segments.fraction).sum(axis=-1) for entry in entries)

    def kink(self, sizes):
        """Of weightless cables: the nearest place where a segment has no tension, and there the energy has a kink.

        Parameters
        ----------
        sizes : ndarray, shape (..., k + 1)
            Tensions. [N]

        Returns
        -------
        held : ndarray of bool, shape (...)
            The energy is least at the kink: the segment is no shorter than the way it has to go, and slack.
        place, beside : tuple of 3 ndarrays
            The kink, and where the energy is less than there if it is not held.
        """
        nearest = sizes.argmin(axis=-1)[..., None]
        place = tuple(-np.take_along_axis(o, nearest, axis=-1)[..., 0] for o in self.segments.offset)
        tension = self.tension(place)
        slack = np.all([part == 0 for part in tension], axis=0)
        parts, kernel = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        fraction = np.where(slack, 0.0, self.segments.fraction)
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, kernel)
        qq, nn, yy, qn, qy, ny = ((entry * fraction).sum(axis=-1) for entry in entries)
        own = (self.segments.fraction - fraction).sum(axis=-1)
        q, n, y = (-(part * fraction).sum(axis=-1) for part in parts)
        q = q + self.strain
        over = 2 * own * q + q * q + n * n + y * y  # |own e + (q, n, y)|^2 - own^2
        far = np.sqrt(np.maximum(own**2 + over, 0.0))
        way = tuple(part / np.maximum(far, TINY) for part in (own + q, n, y))
        give = own / self.stiffness[..., 0] + qq * way[0] ** 2 + nn * way[1] ** 2 + yy * way[2] ** 2
        give = give + 2 * (qn * way[0] * way[1] + qy * way[0] * way[2] + ny * way[1] * way[2])
        pull = np.maximum(over, 0.0) / (far + own) / np.maximum(give, TINY)
        return over <= 0, place, tuple(p + pull * w for p, w in zip(place, way, strict=True))


def newton(problem, unknown, upright, active, scales):
    """Newton's method from `unknown`, of those that are `active`.

    Returns
    -------
    unknown : tuple of 3 ndarrays
    steps : ndarray of int
    change : ndarray
        Size of the last correction relative to the answer; infinite where nothing was done.
    """
    tension, kernel, gap = problem.residual(unknown)
    steps, change = np.zeros(problem.shape, dtype=int), np.full(problem.shape, np.inf)
    for _ in range(MAX_STEPS):
        step = solve_symmetric(problem.matrix(tension, kernel), gap)
        step = (step[0], np.where(upright, 0.0, step[1]), np.where(upright, 0.0, step[2]))
        slope = sum(g * d for g, d in zip(gap, step, strict=True))
        rounding = 1e-15 * np.abs(problem.strain * step[0])
        last, change = change, np.where(active, _relative(step, unknown, *scales), change)
        share = active.astype(float)
        for _ in range(40):
            trial = tuple(u + share * d for u, d in zip(unknown, step, strict=True))
            new_tension, new_kernel, new_gap = problem.residual(trial)
            along = sum(g * d for g, d in zip(new_gap, step, strict=True))
            worse = active & (along < -0.5 * slope - rounding) & (change > 1e-12)
            if not worse.any():
                break
            share = np.where(worse, share / 2, share)
        stuck = worse & (share < STUCK)
        unknown, tension, kernel, gap = trial, new_tension, new_kernel, new_gap
        steps = steps + active
        # quadratic convergence: below 1e-9 the step just taken was the last that matters; rounding stops the rest
        active = active & ~(stuck | (change < 1e-13) | ((change < 1e-9) & (change >= last / 2)) | ~np.isfinite(change))
        if not active.any():
            break
    return unknown, steps, change


def hold_upright(span, unknown, floor):
    """A vertical cable without horizontal loads has no horizontal tension: hold it at next to nothing.

    Not at zero: where such a cable is slack and folds, its stiffness is a limit, H^2 over a number that goes as H^2.
    """
    upright = (np.abs(span.cosine) == 0) & (span.sideways == 0)
    almost_nothing = -1e-100 * np.sign(span.sine) * (np.abs(unknown[0]) + floor)
    # the chord is vertical: across it is horizontal
    return (unknown[0], np.where(upright, almost_nothing, unknown[1]), np.where(upright, 0.0, unknown[2])), upright


def _relative(step, unknown, floor, sideways):
    """Size of a correction, in all and across the chord: a steep cable's sag hangs on its small part across."""
    whole = np.sqrt(sum(d * d for d in step)) / np.maximum(np.sqrt(sum(u * u for u in unknown)) + 1e-3 * floor, TINY)
    across = np.hypot(*step[1:]) / np.maximum(np.hypot(*unknown[1:]) + 1e-3 * sideways, TINY)
    return np.maximum(whole, across)
