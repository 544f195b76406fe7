"""The elastic catenary in closed form: exact statics and end stiffness of many cables at once.

A cable is cut into segments at its point loads (`segment.py` holds their closed form). The tension vector at
mid-length is the one unknown; `closure.py` finds it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.closure import Closure, hold_upright, newton
from cablestudy.cable.guess import first_tension
from cablestudy.cable.segment import TINY, evaluate, extension, flexibility, solve_symmetric
from cablestudy.cable.span import Span

EPSILON = float(np.finfo(float).eps)
LAST = 1e-8  # correction after which a tension is right


@dataclass(frozen=True)
class Segments:
    """The pieces of a cable between point loads; arrays have shape (..., k + 1).

    Attributes
    ----------
    fraction : ndarray
        Share of the unstretched length. [-]
    offset : tuple of 3 ndarrays
        Tension vector at mid-segment minus the cable's unknown, in the chord frame. [N]
    weight : ndarray
        [N]
    """

    fraction: np.ndarray
    offset: tuple
    weight: np.ndarray


def split(span):
    """Cut a cable at its point loads.

    Parameters
    ----------
    span : Span

    Returns
    -------
    Segments
    """
    length = np.asarray(span.unstretched_length)[..., None]
    inner = span.load_positions / length
    end = np.ones((*inner.shape[:-1], 1))
    edges = np.concatenate([0 * end, inner, end], axis=-1)
    fraction = np.diff(edges, axis=-1)
    middle = (edges[..., 1:] + edges[..., :-1]) / 2 - 0.5
    total = span.load_forces.sum(axis=-2)
    passed = np.cumsum(np.concatenate([np.zeros_like(total)[..., None, :], span.load_forces], axis=-2), axis=-2)
    jump = total[..., None, :] / 2 - passed
    weight = np.asarray(span.weight)[..., None]
    offset = tuple(weight * np.asarray(g)[..., None] * middle + jump[..., i] for i, g in enumerate(components(span.up)))
    return Segments(fraction, offset, weight * fraction)


def components(vectors):
    """The last axis of an array as a tuple."""
    return tuple(vectors[..., i] for i in range(vectors.shape[-1]))


@dataclass(frozen=True)
class Record:
    """How an iteration went.

    Attributes
    ----------
    steps : ndarray of int, shape (...)
        Newton steps taken.
    residual : ndarray, shape (...)
        Size of the last correction relative to the answer. [-]
    converged : ndarray of bool, shape (...)
    """

    steps: np.ndarray
    residual: np.ndarray
    converged: np.ndarray


@dataclass(frozen=True)
class Catenary:
    """A solved cable, or a batch of them.

    Attributes
    ----------
    span : Span
    tension : tuple of 3 ndarrays, shape (..., k + 1)
        Tension vector at mid-segment, chord frame. [N]
    segments : Segments
    record : Record
    """

    span: Span
    tension: tuple
    segments: Segments
    record: Record

    def take(self, index):
        """One cable of a batch of shape (n,)."""
        parts = tuple(part[index] for part in self.tension)
        segments = Segments(
            self.segments.fraction[index],
            tuple(part[index] for part in self.segments.offset),
            self.segments.weight[index],
        )
        record = Record(self.record.steps[index], self.record.residual[index], self.record.converged[index])
        return Catenary(self.span.take(index), parts, segments, record)

    @cached_property
    def kernel(self):
        """The closed-form quantities of each segment."""
        return evaluate(self.tension, self.segments.weight, *self._angles)

    @property
    def _angles(self):
        return np.asarray(self.span.cosine)[..., None], np.asarray(self.span.sine)[..., None]

    @property
    def slack(self):
        """Whether a part without weight has no tension, and no definite form, shape (...)."""
        return np.all([part == 0 for part in (*self.tension, self.segments.weight + 0 * self.tension[0])], axis=0).any(
            axis=-1
        )

    @property
    def mean_tension(self):
        """Mean over the unstretched length, shape (...). [N]"""
        cosine, sine = self._angles
        q, n, y = self.tension
        vertical = q * sine + n * cosine
        h2 = self.kernel.horizontal**2 + y**2
        total = self.kernel.sum_of_tensions
        # as H goes to 0 with a change of sign of V the logarithm is beaten by H^2
        mean = vertical**2 / total + total / 4 + h2 * (1 + self.kernel.excess) / total
        return (mean * self.segments.fraction).sum(axis=-1)

    @property
    def max_tension(self):
        """Largest tension, at an end or a load, shape (...). [N]"""
        return np.maximum(*self.kernel.tensions).max(axis=-1)

    @property
    def min_tension(self):
        """Smallest tension, shape (...). [N]"""
        cosine, sine = self._angles
        q, n, y = self.tension
        vertical = np.abs(q * sine + n * cosine)
        lowest = np.hypot(self.kernel.horizontal, y)
        return np.where(vertical < self.segments.weight / 2, lowest, np.minimum(*self.kernel.tensions)).min(axis=-1)

    @property
    def singularities(self):
        """Where the tension of each segment would vanish, as complex arc length over unstretched length.

        The cable bends most at the real part, over about twice the imaginary part; shape (..., k + 1). [-]
        """
        cosine, sine = self._angles
        q, n, y = self.tension
        heavy = np.maximum(np.broadcast_to(self.segments.weight, q.shape), TINY)
        fraction = self.segments.fraction
        middle = np.cumsum(fraction, axis=-1) - fraction / 2
        level = np.hypot(self.kernel.horizontal, y)
        far = 1e30  # a straight segment bends nowhere
        aside, deep = -(q * sine + n * cosine) / heavy, level / heavy
        return middle + fraction * (np.clip(aside, -far, far) + 1j * np.minimum(deep, far))

    @property
    def horizontal_tension(self):
        """Mean horizontal tension, constant where no load acts horizontally, shape (...). [N]"""
        return (np.hypot(self.kernel.horizontal, self.tension[2]) * self.segments.fraction).sum(axis=-1)

    @property
    def stretched_length(self):
        """Shape (...). [m]"""
        return self.span.unstretched_length * (1 + self.mean_tension / self.span.axial_stiffness)

    @cached_property
    def flexibility(self):
        """Movement of end 2 per force there, chord frame, as (qq, nn, yy, qn, qy, ny), shape (...). [m/N]"""
        per_length = flexibility(
            self.tension, self.segments.weight, np.asarray(self.span.axial_stiffness)[..., None], *self._angles,
            self.kernel,
        )  # fmt: skip
        length = self.span.unstretched_length
        return tuple(length * (entry * self.segments.fraction).sum(axis=-1) for entry in per_length)

    @cached_property
    def end_stiffness(self):
        """Force on end 2 per movement of end 2, end 1 fixed, chord frame, shape (..., 3, 3). [N/m]

        A vertical cable that folds has none sideways: the limit of an inclined one, as 1/log(H). One with a slack part
        has none at all.
        """
        columns = [np.stack(solve_symmetric(self.flexibility, tuple(np.eye(3)[i])), axis=-1) for i in range(3)]
        folded = (np.abs(self.span.cosine) == 0) & (self.min_tension < 1e-50 * self.max_tension)
        sideways = np.array([[0, 1, 1], [1, 1, 1], [1, 1, 1]], dtype=bool)
        none = (folded[..., None, None] & sideways) | self.slack[..., None, None]
        return np.where(none, 0.0, np.stack(columns, axis=-1))

    def at(self, position):
        """Place and tension vector along the cable.

        Parameters
        ----------
        position : ndarray, shape (..., j)
            Unstretched arc length over unstretched length, in [0, 1]; at a load, the side of end 1. [-]

        Returns
        -------
        displacement : ndarray, shape (..., j, 3)
            From the straight chord, chord frame, in unstretched lengths: r = (1 + strain) position e + displacement.
        tension : ndarray, shape (..., j, 3)
            Chord frame. [N]
        """
        cosine, sine = self._angles
        position = np.broadcast_to(position, cosine.shape[:-1] + np.shape(position)[-1:]).astype(float)
        stiffness = np.asarray(self.span.axial_stiffness, dtype=float)[..., None]
        edges = np.cumsum(self.segments.fraction, axis=-1)
        which = (position[..., None] > edges[..., None, :-1]).sum(axis=-1)

        def pick(values):
            return np.take_along_axis(np.broadcast_to(values, edges.shape), which, axis=-1)

        whole = pick(self.segments.fraction)
        part = position - pick(edges - self.segments.fraction)
        weight = np.asarray(self.span.weight)[..., None]
        up = (sine, cosine, 0.0)
        # mid-point of the piece between the segment's start and the wanted place
        middle = [pick(p) + weight * (part - whole) / 2 * u for p, u in zip(self.tension, up, strict=True)]
        pieces, _ = extension(middle, weight * part, stiffness, cosine, sine)
        wholes, _ = extension(self.tension, self.segments.weight, stiffness, cosine, sine)
        displacement, straight = [], (np.asarray(self.span.chord_strain)[..., None], 0, 0)
        for piece, full, stretch in zip(pieces, wholes, straight, strict=True):
            own = self.segments.fraction * (full - stretch)
            displacement.append(pick(np.cumsum(own, axis=-1) - own) + part * (piece - stretch))
        tension = [m + weight * part * u / 2 for m, u in zip(middle, up, strict=True)]
        return np.stack(displacement, axis=-1), np.stack(tension, axis=-1)

    @cached_property
    def middle(self):
        """Arc length at mid-span (halfway along the horizontal) over unstretched length, shape (...). [-]

        Where no load acts horizontally the horizontal tension is a common factor and drops out, so that the place is
        definite for a vertical cable too, as the limit of an inclined one. With such a load on a vertical cable: 1/2.
        """
        cosine, sine = self._angles
        stiffness = np.asarray(self.span.axial_stiffness, dtype=float)[..., None]
        along, kernel = self.kernel.horizontal, self.kernel
        scale = np.maximum(np.abs(along).max(axis=-1, keepdims=True), TINY)
        give = 1 / stiffness + 2 * (1 + kernel.excess) / kernel.sum_of_tensions
        advance = along / scale * self.segments.fraction * give
        reached = np.cumsum(advance, axis=-1)
        half = reached[..., -1:] / 2
        which = np.minimum((reached < half).sum(axis=-1, keepdims=True), reached.shape[-1] - 1)
        whole = np.take_along_axis(self.segments.fraction, which, axis=-1)
        before = np.take_along_axis(reached - advance, which, axis=-1)
        rate = np.take_along_axis(np.broadcast_to(along / scale, reached.shape), which, axis=-1)
        tension = [np.take_along_axis(np.broadcast_to(p, reached.shape), which, axis=-1) for p in self.tension]
        weight = np.asarray(self.span.weight)[..., None]

        # only those still under way are carried on: a few near the vertical take long
        part = np.empty(whole.shape).ravel()
        todo = np.arange(part.size)
        data = [np.broadcast_to(x, whole.shape).ravel() for x in (
            whole, half - before, EPSILON * half, rate, stiffness, weight, cosine, sine, *tension)]  # fmt: skip
        low, high, place = np.zeros_like(data[0]), data[0].copy(), data[0] / 2
        for _ in range(80):  # Newton kept inside a bracket
            whole_, target, rounding, rate_, stiffness_, weight_, cosine_, sine_, q, n, y = data
            shift = weight_ * (place - whole_) / 2
            piece = evaluate((q + shift * sine_, n + shift * cosine_, y), weight_ * place, cosine_, sine_)
            gap = target - rate_ * place * (1 / stiffness_ + 2 * (1 + piece.excess) / piece.sum_of_tensions)
            low, high = np.where(gap > 0, place, low), np.where(gap > 0, high, place)
            slope = np.maximum(rate_, TINY) * (1 / stiffness_ + 1 / np.maximum(piece.tensions[1], TINY))
            trial = place + gap / slope
            trial = np.where((trial > low) & (trial < high), trial, (low + high) / 2)
            trial = np.where(np.abs(gap) > rounding, trial, place)
            moving = np.abs(trial - place) > 4e-16
            place = trial
            part[todo] = trial
            if not moving.all():
                todo, low, high, place = (x[moving] for x in (todo, low, high, place))
                data = [x[moving] for x in data]
            if not len(todo):
                break
        part = part.reshape(whole.shape)
        edges = np.cumsum(self.segments.fraction, axis=-1) - self.segments.fraction
        position = (np.take_along_axis(edges, which, axis=-1) + part)[..., 0]
        # pulled out of the vertical a cable goes and comes back: halfway along the horizontal means nothing
        return np.where((np.abs(self.span.cosine) == 0) & (self.span.sideways > 0), 0.5, position)

    @cached_property
    def sag(self):
        """Vertical distance from the chord down to the cable at mid-span, shape (...). [m]

        Not a number where a part without weight is slack.
        """
        position = np.asarray(self.middle)
        displacement, _ = self.at(position[..., None])
        along, across = displacement[..., 0, 0], displacement[..., 0, 1]
        cosine, sine = np.asarray(self.span.cosine), np.asarray(self.span.sine)
        # across the chord nothing cancels; but near the vertical what a large force across moves tells little of height
        leaning = (np.abs(cosine) > 0.1) | (self.span.sideways < np.abs(cosine) * self.mean_tension)
        steep = sine * ((1 + self.span.chord_strain) * (0.5 - position) - along) - cosine * across
        sag = self.span.unstretched_length * np.where(leaning, -across / np.where(leaning, cosine, 1.0), steep)
        return np.where(self.slack, np.nan, sag)


def solve(span):
    """Equilibrium of one cable or of a batch.

    Parameters
    ----------
    span : Span
        Fields of shape () or (...).

    Returns
    -------
    Catenary
        Its record tells for each cable whether it converged.

    Notes
    -----
    The tension vector minimises the complementary energy, which is strictly convex: the answer is unique, and a Newton
    step that is halved until the slope along it no longer grows always arrives. Without weight that energy has a kink
    where a segment loses its tension: either it is least there, and the segment slack, or the search goes on beside it.
    """
    span = span.broadcast()
    problem = Closure(span, split(span))
    shape, strain = problem.shape, problem.strain
    floor = np.asarray(span.weight) + np.abs(span.load_forces).sum(axis=(-1, -2))
    unknown, upright = hold_upright(
        span, tuple(np.broadcast_to(u, shape).astype(float) for u in first_tension(span)), floor
    )
    weightless = (floor == 0) & (strain <= 0)  # no tension at all: nothing to solve
    unknown = (np.where(weightless, problem.stiffness[..., 0], unknown[0]), *unknown[1:])
    active = np.broadcast_to(~weightless, shape)
    scales = floor, span.sideways
    unknown, steps, change = newton(problem, unknown, upright, active, scales)
    bare = active & (np.asarray(span.weight) == 0)
    for _ in range(problem.segments.fraction.shape[-1] if bare.any() else 0):
        sizes = np.sqrt(sum(part**2 for part in problem.tension(unknown)))
        lost = bare & ~((change < LAST) & (sizes.min(axis=-1) > LAST * sizes.max(axis=-1)))
        if not lost.any():
            break
        held, place, beside = problem.kink(sizes)
        held, again = lost & held, lost & ~held & ~(change < LAST)
        unknown = tuple(
            np.where(held, p, np.where(again, b, u)) for p, b, u in zip(place, beside, unknown, strict=True)
        )
        change, bare = np.where(held, 0.0, change), again
        if again.any():
            unknown, more, other = newton(problem, unknown, upright, again, scales)
            steps, change = steps + more, np.where(again, other, change)
    converged = np.isfinite(change) & (change < LAST) & ~weightless
    return Catenary(span, problem.tension(unknown), problem.segments, Record(steps, change, converged))
