"""The elastic catenary in closed form (Irvine 1981, section 1.3): statics and end stiffness of a batch of cables.

A cable is divided into segments at its point loads (`segment`). The tension vector at mid-length is the only unknown
(`equilibrium_residual`); Newton's method finds it (`newton`). With point loads that name means the mean of the
tension vectors at both ends, which without them is the tension vector at mid-length.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.equilibrium_residual import EquilibriumResidual
from cablestudy.cable.geometry import midspan, sag_and_swing
from cablestudy.cable.midspan import arc_length_at_midspan
from cablestudy.cable.newton import CONVERGED, STALLED, UNDETERMINED, NewtonRecord, newton
from cablestudy.cable.records import take_rows
from cablestudy.cable.segment import (
    SegmentedCable,
    SegmentTerms,
    extension,
    flexibility,
    inverse_symmetric,
    segment_terms,
)
from cablestudy.cable.span import Span
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import row_keys

GAUSS_POINTS = 8  # on each piece, for the travel time of a wave


@dataclass(frozen=True)
class Segments:
    """Segments of a cable between its point loads; arrays have shape (..., k + 1)."""

    fraction: np.ndarray  # share of the unstretched length [-]
    offset: tuple  # 3 arrays: tension vector at mid-segment minus the unknown at mid-length, chord frame [N]
    weight: np.ndarray  # of each segment [N]


def split(span):
    """The `Segments` into which its point loads divide a cable."""
    length = np.asarray(span.unstretched_length)[..., None]
    loads = span.load_positions / length
    end_2 = np.ones((*loads.shape[:-1], 1))
    edges = np.concatenate([0 * end_2, loads, end_2], axis=-1)
    fraction = np.diff(edges, axis=-1)
    from_midlength = (edges[..., 1:] + edges[..., :-1]) / 2 - 0.5
    total = span.load_forces.sum(axis=-2)
    nearer_to_end_1 = np.concatenate([np.zeros_like(total)[..., None, :], span.load_forces], axis=-2)
    by_loads = total[..., None, :] / 2 - np.cumsum(nearer_to_end_1, axis=-2)
    weight, up = np.asarray(span.weight)[..., None], span.up
    offset = tuple(weight * up[..., i, None] * from_midlength + by_loads[..., i] for i in range(3))
    return Segments(fraction, offset, weight * fraction)


@dataclass(frozen=True)
class Catenary(SegmentedCable):
    """Equilibrium of a cable or of a batch of cables."""

    span: Span
    tension: tuple  # tension vector at mid-segment, chord frame, 3 arrays of shape (..., k + 1) [N]
    segments: Segments
    terms: SegmentTerms  # closed-form quantities of each segment
    record: NewtonRecord

    def take(self, index):
        """One cable of a batch of shape (n,)."""
        parts = (take_rows(part, index) for part in (self.span, self.tension, self.segments, self.terms))
        return Catenary(*parts, self.record.of(index))

    def with_span(self, span):
        """Copy with another `Span`, such as one without places of loads that carry nothing."""
        return replace(self, span=span)

    @cached_property
    def mid_forces(self):
        """Tension vector at mid-segment, chord frame, shape (..., k + 1, 3). [N]"""
        return np.stack(self.tension, axis=-1)

    @property
    def segment_weights(self):
        """Weight of each segment, shape (..., k + 1). [N]"""
        return self.segments.weight

    @cached_property
    def edges(self):
        """Ends of the segments, shares of the unstretched length, shape (..., k + 2). [-]"""
        inner = np.cumsum(self.segments.fraction, axis=-1)
        inner[..., -1] = 1.0
        return np.concatenate([np.zeros_like(inner[..., :1]), inner], axis=-1)

    @property
    def _axial_stiffness(self):
        """EA, shape (..., 1). [N]"""
        return np.asarray(self.span.axial_stiffness, dtype=float)[..., None]

    @property
    def slack(self):
        """True where a segment without weight has no tension, and no definite form, shape (...)."""
        weightless = self.segments.weight == 0
        if not weightless.any():
            return np.zeros(weightless.shape[:-1], dtype=bool)
        return (~self.mid_forces.any(axis=-1) & weightless).any(axis=-1)

    @cached_property
    def mean_tension(self):
        """Mean over the unstretched length, shape (...). [N]"""
        vertical, horizontal = self._vertical_and_horizontal
        total = self.terms.sum_of_tensions
        # as H goes to 0 with a change of sign of V, H^2 times the logarithm goes to 0
        mean = vertical**2 / total + total / 4 + horizontal**2 * (1 + self.terms.excess) / total
        return (mean * self.segments.fraction).sum(axis=-1)

    @property
    def singularities(self):
        """Complex arc length over unstretched length at which T(s) of each segment vanishes, shape (..., k + 1). [-]

        T^2 = H^2 + (V + w s)^2. The curvature is largest at the real part, over about twice the imaginary part, and the
        distance of the singularity bounds the length on which a polynomial series converges.
        """
        vertical, horizontal = self._vertical_and_horizontal
        weight = np.maximum(np.broadcast_to(self.segments.weight, vertical.shape), CABLE.least_divisor)
        fraction = self.segments.fraction
        middle = np.cumsum(fraction, axis=-1) - fraction / 2
        real, imaginary = -vertical / weight, horizontal / weight
        far = 1e30  # a segment without weight is straight
        return middle + fraction * (np.clip(real, -far, far) + 1j * np.minimum(imaginary, far))

    @cached_property
    def horizontal_tension(self):
        """Mean horizontal tension, constant where no load acts horizontally, shape (...). [N]"""
        mean = (self._vertical_and_horizontal[1] * self.segments.fraction).sum(axis=-1)
        oblique = self._load_is_oblique
        return np.where(oblique, self._horizontal_tension_by_quadrature, mean) if oblique.any() else mean

    @property
    def _horizontal_tension_by_quadrature(self):
        """Mean horizontal part of the tension vector, for a uniform load of any direction, shape (...). [N]"""
        load = self.segments.weight[..., None] * self.span.up[..., None, :]
        nodes, weights = np.polynomial.legendre.leggauss(CABLE.horizontal_tension_points)
        total = 0.0
        for node, weight in zip(nodes, weights, strict=True):  # the tension vector is linear on each segment
            force = self.span.in_frame(self.mid_forces + load * node / 2, "global")
            total = total + weight / 2 * np.hypot(force[..., 0], force[..., 1])
        return (total * self.segments.fraction).sum(axis=-1)

    @property
    def middle_tension(self):
        """Tension vector at mid-length, global axes, from which `solve` can begin again, shape (..., 3). [N]"""
        forces = self.end_forces("global")
        return (forces[..., 0, :] - forces[..., 1, :]) / 2

    @cached_property
    def flexibility(self):
        """Movement of end 2 per force there, chord frame, as (qq, nn, yy, qn, qy, ny), shape (...). [m/N]"""
        length, weight = self.span.unstretched_length, self.segments.weight
        per_length = flexibility(self.tension, weight, self._axial_stiffness, *self._angles, self.terms)
        return tuple(length * (entry * self.segments.fraction).sum(axis=-1) for entry in per_length)

    def flexibility_between(self, positions):
        """Movement of the one end of each part of a cable per force, the other end fixed, as `flexibility`.

        Parameters
        ----------
        positions : ndarray, shape (k + 1,)
            Ends of the k parts, shares of the length, loads among them. [-]

        Returns
        -------
        ndarray, shape (6, ..., k)
            [m/N]
        """
        shares, middles = np.diff(positions), (positions[1:] + positions[:-1]) / 2
        tension = tuple(np.moveaxis(self.tension_at(middles), -1, 0))
        weight = np.asarray(self.span.weight)[..., None] * shares
        terms = segment_terms(tension, weight, *self._angles)
        per_length = np.array(flexibility(tension, weight, self._axial_stiffness, *self._angles, terms))
        return np.asarray(self.span.unstretched_length)[..., None] * shares * per_length

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, chord frame: the inverse flexibility, shape (..., 3, 3). [N/m]

        A folded vertical cable has no transverse stiffness: that of an inclined one goes to zero as 1/log(H) with its
        horizontal tension H. A cable with a slack segment has no stiffness.
        """
        stiffness, vertical = inverse_symmetric(self.flexibility), np.abs(self.span.cosine) == 0
        if vertical.any():
            folded = vertical & (self.min_tension < CABLE.folded_vertical * self.max_tension)
            transverse = np.array([[0, 1, 1], [1, 1, 1], [1, 1, 1]], dtype=bool)
            stiffness = np.where(folded[..., None, None] & transverse, 0.0, stiffness)
        slack = self.slack
        return np.where(slack[..., None, None], 0.0, stiffness) if slack.any() else stiffness

    @property
    def planar(self):
        """True when no load leaves the plane of chord and vertical: motion in it and out of it decouple."""
        return self.span.planar

    @property
    def mirror_symmetric(self):
        """True where a cable is its own mirror image at mid-length, shape (...)."""
        return self.span.mirror_symmetric

    @property
    def end_loads(self):
        """Distributed load at both ends, global axes, shape (..., 2, 3). [N/m]"""
        size = np.asarray(self.span.mass * self.span.gravity)[..., None]
        load = np.broadcast_to(-size * self.span.vertical, (*np.shape(self.span.chord), 3))
        return np.stack([load, load], axis=-2)

    def uneven_load(self, edges):
        """Load besides the uniform one and point loads on each part between edges: None, for there is none."""

    def at(self, position):
        """Displacement and tension vector at positions along the cable.

        Vectors are in the chord frame. The displacement d is that from the straight chord, over the unstretched
        length L. The vector from end 1 to a point of the cable is

            r = L ((1 + chord strain) position e + d)

        with the unit vector e along the chord; the chord strain is the length of the chord over L, minus 1.

        Parameters
        ----------
        position : ndarray, shape (..., j)
            Unstretched arc length over unstretched length, in [0, 1]; at a point load, the side of end 1. [-]

        Returns
        -------
        displacement : ndarray, shape (..., j, 3)
            d. [-]
        tension : ndarray, shape (..., j, 3)
            Tension vector. [N]
        """
        (cosine, sine), stiffness = self._angles, self._axial_stiffness
        piece, middle, half_weight, in_segment = self._pieces(position)
        of_piece, _ = extension(middle, 2 * half_weight, stiffness, cosine, sine)
        of_chord = (np.asarray(self.span.chord_strain)[..., None], 0, 0)
        displacement = [
            in_segment(at_end_1) + piece * (piece_strain - chord_strain)
            for at_end_1, piece_strain, chord_strain in zip(self._segment_begins, of_piece, of_chord, strict=True)
        ]
        return np.stack(displacement, axis=-1), self._tension_of(middle, half_weight)

    def tension_at(self, position):
        """Tension vector along the cable as in `at`, shape (..., j, 3). [N]"""
        _, middle, half_weight, _ = self._pieces(position)
        return self._tension_of(middle, half_weight)

    def _tension_of(self, middle, half_weight):
        """Tension vector at the end of pieces, shape (..., j, 3), from that in their middle and half their weight."""
        up = (*reversed(self._angles), 0.0)
        return np.stack([m + half_weight * u for m, u in zip(middle, up, strict=True)], axis=-1)

    def _pieces(self, position):
        """Parts of a cable from which `at` finds the form and tension at given positions, shape (..., j), from 0 to 1.

        A position is in one of the k + 1 segments between the k point loads; at a point load, on the side of end 1. Its
        piece is the part of the cable from the beginning of this segment, on the side of end 1, to the position.

        Returns
        -------
        piece : ndarray, shape (..., j)
            Length of each piece over the unstretched length of the cable. [-]
        middle : list of 3 ndarrays, shape (..., j)
            Components of the tension vector in the middle of the piece, chord frame. [N]
        half_weight : ndarray, shape (..., j)
            Half of the weight of the piece. [N]
        in_segment : callable
            Values of all segments, shape (..., k + 1) -> values of the segment of each position, shape (..., j).
        """
        cosine, sine = self._angles
        # in rows, whatever the batch: products of matrices round by the order in which their entries are stored
        position = np.broadcast_to(position, cosine.shape[:-1] + np.shape(position)[-1:]).astype(float, order="C")
        segment_ends = np.cumsum(self.segments.fraction, axis=-1)
        segment = (position[..., None] > segment_ends[..., None, :-1]).sum(axis=-1)

        def in_segment(values):
            if segment_ends.shape[-1] == 1:  # the only segment
                return values
            return np.take_along_axis(np.broadcast_to(values, segment_ends.shape), segment, axis=-1)

        piece = position - in_segment(segment_ends - self.segments.fraction)
        weight = np.asarray(self.span.weight)[..., None]
        shift = weight * (piece - in_segment(self.segments.fraction)) / 2  # from mid-segment to the middle of the piece
        middle = [in_segment(p) + shift * u for p, u in zip(self.tension, (sine, cosine, 0.0), strict=True)]
        return piece, middle, weight * piece / 2, in_segment

    @cached_property
    def _segment_begins(self):
        """Displacement at end 1 of each segment as in `at`, 3 ndarrays of shape (..., k). [-]"""
        cosine, sine = self._angles
        strains, _ = extension(self.tension, self.segments.weight, self._axial_stiffness, cosine, sine)
        of_chord, begins = (np.asarray(self.span.chord_strain)[..., None], 0, 0), []
        for strain, chord_strain in zip(strains, of_chord, strict=True):
            changes = self.segments.fraction * (strain - chord_strain)
            begins.append(np.cumsum(changes, axis=-1) - changes)
        return begins

    @cached_property
    def middle(self):
        """Arc length at mid-span over unstretched length (`midspan`), shape (...). [-]"""
        middle, oblique = arc_length_at_midspan(self), self._load_is_oblique
        return np.where(oblique, midspan(self), middle) if oblique.any() else middle

    @property
    def _load_is_oblique(self):
        """True where the uniform load is not vertical, as in a wind, shape (...)."""
        return np.asarray(self.span.vertical)[..., 2] != 1

    @cached_property
    def sag(self):
        """Vertical distance from the chord down to the cable at mid-span, shape (...). [m]

        Not a number where a part without weight is slack.
        """
        position = np.asarray(self.middle)
        displacement, _ = self.at(position[..., None])
        along, across = displacement[..., 0, 0], displacement[..., 0, 1]
        cosine, sine = np.asarray(self.span.cosine), np.asarray(self.span.sine)
        # displacements across the chord do not cancel; a nearly vertical cable under a large transverse load needs both
        sloping = (np.abs(cosine) > 0.1) | (self.span.transverse_load < np.abs(cosine) * self.mean_tension)
        steep = sine * ((1 + self.span.chord_strain) * (0.5 - position) - along) - cosine * across
        sag = self.span.unstretched_length * np.where(sloping, -across / np.where(sloping, cosine, 1.0), steep)
        if self._load_is_oblique.any():
            sag = np.where(self._load_is_oblique, sag_and_swing(self, position)[0], sag)
        return np.where(self.slack, np.nan, sag)


def solve(span, tension=None):
    """Equilibrium of an elastic cable between its ends, under weight and point loads, or of a batch of cables.

    Parameters
    ----------
    span : Span
        Ends, unstretched length, properties and loads; fields of shape () or (...).
    tension : ndarray, shape (..., 3), optional
        Tension vectors at mid-length, global axes, from which to begin; NaN where none is known. [N]

    Returns
    -------
    Catenary
        Its record states for each cable whether it converged. A loose cable, longer than its chord and without any
        load, has no tension; the reason in its record is UNDETERMINED.

    Notes
    -----
    Newton's method for the tension vector at mid-length, which minimises the complementary energy (`newton`). Without
    weight this energy has a kink where a segment between point loads loses its tension. Either the kink is the minimum,
    and the segment slack, or the iteration starts again next to it.
    """
    span = span.broadcast()
    problem = EquilibriumResidual(span, split(span))
    unknown = problem.start(span) if tension is None else problem.start_near(span, tension)
    loose = (problem.load == 0) & (problem.strain <= 0)  # no tension at all: nothing to solve
    unknown[0] = np.where(loose, problem.stiffness[..., 0], unknown[0])  # any tension: these take no part
    unknown, (tension, terms), record = newton(problem, unknown, np.broadcast_to(~loose, problem.shape))
    unknown, change = np.where(loose, 0.0, unknown), record.last_correction
    weightless = ~loose & (np.asarray(span.weight) == 0)
    if weightless.any():
        unknown, change, record = _pass_kinks(problem, unknown, change, record, weightless)
    if weightless.any() or loose.any():  # where these tensions are other ones than the iteration ended at
        tension = problem.tension(unknown)
        terms = segment_terms(tension, problem.segments.weight, *problem.angles)
    reason = np.where(loose, UNDETERMINED, np.where(change < CABLE.last_tension_step, CONVERGED, STALLED))
    return Catenary(span, tension, problem.segments, terms, replace(record, reason=reason))


def solve_each_once(span):
    """Equilibria of a batch of shape (n, ...) as in `solve`, those of rows that are equal to the last digit once."""
    keys = row_keys(span.broadcast().arrays.values())
    index = dict(zip(reversed(keys), reversed(range(len(keys))), strict=True))  # of the first row with these numbers
    if len(index) == len(keys):
        return solve(span)
    different = sorted(index.values())
    solved = solve(span.take(np.array(different)))
    return solved.take(np.searchsorted(different, [index[key] for key in keys]))


def _pass_kinks(problem, unknown, change, record, weightless):
    """Finish the equilibria of cables without weight for which Newton's method may have ended at a kink of the energy.

    The kinks are those of the notes of `solve`. `problem` is the `EquilibriumResidual` of all cables; `unknown`, shape
    (3, ...), `change` and `record` are what Newton's method returned, and are returned after the further iterations: a
    cable with a slack segment has a change of zero. `weightless` masks the cables to solve.
    """
    pending = weightless
    for _ in range(problem.segments.fraction.shape[-1]):
        sizes = np.sqrt(sum(component**2 for component in problem.tension(unknown)))
        converged = change < CABLE.last_tension_step
        taut = sizes.min(axis=-1) > CABLE.last_tension_step * sizes.max(axis=-1)
        pending = pending & ~(converged & taut)
        if not pending.any():
            break
        is_minimum, kink, beyond_kink = problem.kink(sizes)
        slack, restarted = pending & is_minimum, pending & ~is_minimum & ~converged
        unknown = np.where(slack, kink, np.where(restarted, beyond_kink, unknown))
        change, pending = np.where(slack, 0.0, change), restarted
        if restarted.any():
            unknown, _, restart = newton(problem, unknown, restarted)
            record, change = record.then(restart), np.where(restarted, restart.last_correction, change)
    return unknown, change, record
