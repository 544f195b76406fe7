"""Residual and flexibility of a cable made of catenary segments, for Newton's method (`newton.py`).

The tension vector at mid-length (see `catenary`) is the unknown. The segments, joined end to end, have to lead from
end 1 to end 2. The start is a parabola for a taut cable, an inextensible catenary for a slack one: Irvine (1981),
chapters 2 and 1.
"""

from copy import copy

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.cable.segment import extension, flexibility, solve_symmetric
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import dot


class EquilibriumResidual:
    """Vector from the last segment's end to end 2, as a function of the tension vector at mid-length.

    Vectors are in the chord frame: along the chord, across it in the vertical plane, and out of that plane (q, n, y).
    A batch of cables has the shape (...), each cable k + 1 segments.

    Parameters
    ----------
    span : Span
    segments : Segments
    """

    tolerance, stalled = 1e-10, 1e-9  # see `newton`; the error left is about the square of the last step

    def __init__(self, span, segments):
        self.segments = segments
        self.angles = np.asarray(span.cosine)[..., None], np.asarray(span.sine)[..., None]
        self.stiffness = np.asarray(span.axial_stiffness, dtype=float)[..., None]
        self.shape = np.broadcast_shapes(
            self.angles[0].shape[:-1], self.stiffness.shape[:-1], segments.weight.shape[:-1]
        )
        self.strain = np.broadcast_to(span.chord_strain, self.shape)
        self.load = np.asarray(span.weight) + np.abs(span.load_forces).sum(axis=(-1, -2))
        self.transverse_load = span.transverse_load
        # a vertical cable without horizontal loads has no horizontal tension: that is no unknown
        self.vertical = (np.abs(span.cosine) == 0) & (span.transverse_load == 0)

    def take(self, index):
        """The residual of some cables of the batch, by a tuple of indices along its axes, or masks."""
        taken = copy(self)
        taken.segments, taken.angles = take_rows(self.segments, index), take_rows(self.angles, index)
        for name in ("stiffness", "strain", "load", "transverse_load", "vertical"):
            setattr(taken, name, getattr(self, name)[index])
        taken.shape = taken.strain.shape
        return taken

    def tension(self, unknown):
        """Tension vectors at mid-segment, 3 arrays of shape (..., k + 1). [N]"""
        (q, n, y), (along, across, out) = unknown[..., None], self.segments.offset
        return q + along, n + across, y + out

    def residual(self, unknown):
        """Vector from the last segment's end to end 2, per unstretched length, shape (3, ...) [-], and a `point`.

        The `point` is what `flexibility` and `step` take: tension vectors at mid-segment, and `segment.SegmentTerms`.
        """
        tension = self.tension(unknown)
        extensions, terms = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        gap = np.empty((3, *self.shape))
        for component, per_length in enumerate(extensions):
            gap[component] = -self._over_segments(per_length)
        gap[0] += self.strain
        return gap, (tension, terms)

    def flexibility(self, point):
        """Movement of the last segment's end per force, per unstretched length: qq, nn, yy, qn, qy, ny. [1/N]"""
        tension, terms = point
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, terms)
        return tuple(self._over_segments(entry) for entry in entries)

    def _over_segments(self, per_length):
        """Mean over the segments of a cable, shape (...), weighted by their lengths."""
        one = self.segments.fraction.shape[-1] == 1
        return per_length[..., 0] if one else (per_length * self.segments.fraction).sum(axis=-1)

    def step(self, gap, point):
        """Newton step of the tension vector, shape (3, ...). [N]"""
        step = np.array(solve_symmetric(self.flexibility(point), gap))
        if np.count_nonzero(self.vertical):
            step[1:] = np.where(self.vertical, 0.0, step[1:])
        return step

    def relative(self, step, unknown, _):
        """Size of a step relative to the tension vector, shape (...). [-]

        The larger one of all components together and of those across the chord: the sag of a steep cable follows from
        its small transverse tension.
        """
        (q, n, y), (along, across, out) = unknown * unknown, step * step
        tension = np.sqrt(q + n + y) + 1e-3 * self.load  # the load counts where the tension is next to zero
        transverse_tension = np.sqrt(n + y) + 1e-3 * self.transverse_load
        whole_change = np.sqrt(along + across + out) / np.maximum(tension, CABLE.least_divisor)
        transverse_change = np.sqrt(across + out) / np.maximum(transverse_tension, CABLE.least_divisor)
        return np.maximum(whole_change, transverse_change)

    def rounding(self, step):
        """Error of the slope along a step due to rounding of the residual, shape (...)."""
        return 1e-15 * np.abs(self.strain * step[0])  # rounding of the chord strain in the residual

    def start(self, span):
        """A first tension vector, shape (3, ...); of a vertical cable the horizontal tension H is next to zero. [N]

        H is not zero: where such a cable is slack and folded, its stiffness is H^2 over a number that is proportional
        to H^2.
        """
        q, n, y = (np.broadcast_to(component, self.shape).astype(float) for component in _first_tension(span))
        almost_nothing = -1e-100 * np.sign(span.sine) * (np.abs(q) + self.load)
        # the chord is vertical: across it is horizontal
        return np.stack([q, np.where(self.vertical, almost_nothing, n), np.where(self.vertical, 0.0, y)])

    def start_near(self, span, tension):
        """First tension vectors, shape (3, ...), near known ones of shape (..., 3), global axes; else of `start`. [N]

        Cables without weight, and vertical ones, begin from `start`: their energy has kinks and degenerate forms.
        """
        near = np.stack([dot(tension, span.frame[..., axis, :]) for axis in range(3)])
        known = np.isfinite(near).all(axis=0) & (np.asarray(span.weight) > 0) & ~self.vertical
        return near if known.all() else np.where(known, near, self.start(span))

    def kink(self, sizes):
        """Decide whether the loosest segment of a weightless cable hangs slack.

        The complementary energy, whose minimum is the equilibrium, has a kink where a segment has no tension: Newton's
        method cannot find a minimum there.

        Parameters
        ----------
        sizes : ndarray, shape (..., k + 1)
            Tension of each of the k + 1 segments between point loads. [N]

        Returns
        -------
        slack : ndarray of bool, shape (...)
            True if the energy is least at the kink. Then the segment is slack: it is at least as long as the gap that
            the other segments leave for it.
        kink : ndarray, shape (3, ...)
            Tension vector at mid-length for which that segment has no tension, chord frame. [N]
        beyond_kink : ndarray, shape (3, ...)
            Tension vector with less energy, where Newton's method goes on if the kink is no minimum. [N]
        """
        loosest = sizes.argmin(axis=-1)[..., None]
        kink = np.stack([-np.take_along_axis(offset, loosest, axis=-1)[..., 0] for offset in self.segments.offset])
        tension = self.tension(kink)
        without_tension = np.all([component == 0 for component in tension], axis=0)
        taut_fraction = np.where(without_tension, 0.0, self.segments.fraction)
        slack_length = (self.segments.fraction - taut_fraction).sum(axis=-1)
        # the taut segments leave the slack ones to span the distance |slack_length e + (q, n, y)|
        extensions, terms = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        q, n, y = (-(per_length * taut_fraction).sum(axis=-1) for per_length in extensions)
        q = q + self.strain
        excess = 2 * slack_length * q + q * q + n * n + y * y  # distance^2 - slack_length^2
        # the energy falls along that distance, direction u: a force along it stretches the slack segments and moves the
        # taut ones; it is the excess of the distance over the slack length, divided by the compliance along u
        distance = np.sqrt(np.maximum(slack_length**2 + excess, 0.0))
        u = np.stack([component / np.maximum(distance, CABLE.least_divisor) for component in (slack_length + q, n, y)])
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, terms)
        qq, nn, yy, qn, qy, ny = ((entry * taut_fraction).sum(axis=-1) for entry in entries)
        compliance = slack_length / self.stiffness[..., 0] + qq * u[0] ** 2 + nn * u[1] ** 2 + yy * u[2] ** 2
        compliance = compliance + 2 * (qn * u[0] * u[1] + qy * u[0] * u[2] + ny * u[1] * u[2])
        force = np.maximum(excess, 0.0) / (distance + slack_length) / np.maximum(compliance, CABLE.least_divisor)
        return excess <= 0, kink, kink + force * u


def _first_tension(span):
    """Approximate tension vector at mid-length of a cable, where Newton's method begins, chord frame. [N]

    Weight and point loads are taken as distributed uniformly over the cable. Its form is then a parabola, or an
    inextensible catenary where it is more than 1.2 times as long as its chord.
    """
    load_vector = span.load_forces.sum(axis=-2) - np.asarray(span.weight)[..., None] * span.up
    load = np.sqrt((load_vector**2).sum(axis=-1))
    largest = np.maximum(load, np.sqrt((span.load_forces**2).sum(axis=-1)).max(axis=-1, initial=0.0))
    up = -load_vector / np.maximum(load, CABLE.least_divisor)[..., None]  # unit vector against the load
    along = up[..., 0]  # components of `up` along the chord and across it
    across = np.sqrt(up[..., 1] ** 2 + up[..., 2] ** 2)
    taut = _taut_tension(span, np.where(load > 0, across * load, largest))
    ratio = 1.0 / (1.0 + span.chord_strain)  # unstretched length over chord
    slack = (ratio > 1.2) & (across > 1e-8)  # a chord along the load has no run
    if not np.any(slack):
        return taut, np.zeros_like(taut), np.zeros_like(taut)
    # sinh(parameter)/parameter = sqrt(length^2 - rise^2)/run, with rise along and run across the load
    length_over_run = np.sqrt(np.maximum(ratio**2 - along**2, 1.0)) / np.maximum(across, 1e-8)
    parameter = _sinhc_inverse(np.where(slack, length_over_run, 1.0))
    # tension across the load and along it
    horizontal = largest * across / (2 * parameter * np.maximum(ratio, 1.0))
    vertical = largest * along / np.maximum(2 * ratio * np.tanh(np.minimum(parameter, 300.0)), CABLE.least_divisor)
    inverse_across = 1.0 / np.maximum(across, 1e-8)
    q = np.where(slack, horizontal * across + vertical * along, taut)
    n, y = (np.where(slack, (-horizontal * along * inverse_across + vertical) * up[..., i], 0.0) for i in (1, 2))
    return q, n, y


def _taut_tension(span, transverse_load):
    """Tension of a parabola under a transverse load W: the positive root T of T^3/EA - strain T^2 - W^2/24 = 0. [N]"""
    stiffness, strain = span.axial_stiffness, span.chord_strain
    constant = transverse_load**2 / 24
    tension = np.maximum(np.maximum(strain, 0.0) * stiffness, np.cbrt(constant * stiffness))
    slack = strain < 0
    tension = np.where(slack, np.minimum(tension, np.sqrt(constant / np.where(slack, -strain, 1.0))), tension)
    tension = np.maximum(tension, CABLE.least_divisor)
    for _ in range(8):
        value = tension**2 * (tension / stiffness - strain) - constant
        slope = tension * (3 * tension / stiffness - 2 * strain)
        step = np.where(slope > 0, value / np.where(slope > 0, slope, 1.0), 0.0)
        tension = np.minimum(np.maximum(tension - step, tension / 4), tension * 4)
    return tension


def _sinhc_inverse(value):
    """y > 0 with sinh(y)/y = value >= 1."""
    log = np.log(np.maximum(value, 1 + 1e-12))
    y = np.where(value < 3, np.sqrt(6 * np.maximum(value - 1, 1e-12)), log + np.log(2 * log + 2))
    for _ in range(6):  # Newton's method on the logarithm
        no_overflow = np.minimum(y, 300.0)  # above, sinh(y) is exp(y)/2 and tanh(y) 1
        log_at_y = np.where(y > 300, y - np.log(2 * y), np.log(np.sinh(no_overflow) / no_overflow))
        slope = np.where(y > 300, 1.0, 1 / np.tanh(no_overflow)) - 1 / y
        y = np.maximum(y - (log_at_y - log) / slope, y / 3)
    return y
