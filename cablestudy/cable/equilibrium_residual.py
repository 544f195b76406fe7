"""Residual and flexibility of a cable made of catenary segments, for Newton's method (`newton.py`).

The tension vector at mid-length is the unknown. The segments, joined end to end, have to lead from end 1 to end 2. The
start is a parabola for a taut cable, an inextensible catenary for a slack one: Irvine (1981), chapters 2 and 1.
"""

import numpy as np

from cablestudy.cable.segment import extension, flexibility, solve_symmetric
from cablestudy.cable.tolerances import CABLE


class EquilibriumResidual:
    """Distance of the last segment's end from end 2, as a function of the tension vector at mid-length.

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

    def tension(self, unknown):
        """Tension vectors at mid-segment, 3 arrays of shape (..., k + 1). [N]"""
        return tuple(u[..., None] + o for u, o in zip(unknown, self.segments.offset, strict=True))

    def residual(self, unknown):
        """Vector from the last segment's end to end 2, per unstretched length, shape (3, ...); tensions and kernel."""
        tension = self.tension(unknown)
        parts, kernel = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        gap = np.empty((3, *self.shape))
        for component, part in enumerate(parts):
            gap[component] = -(part * self.segments.fraction).sum(axis=-1)
        gap[0] += self.strain
        return gap, (tension, kernel)

    def flexibility(self, point):
        """Movement of the last segment's end per force, per unstretched length: qq, nn, yy, qn, qy, ny. [1/N]"""
        tension, kernel = point
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, kernel)
        return tuple((entry * self.segments.fraction).sum(axis=-1) for entry in entries)

    def step(self, gap, point):
        """Newton step of the tension vector, shape (3, ...). [N]"""
        step = np.array(solve_symmetric(self.flexibility(point), gap))
        step[1:] = np.where(self.vertical, 0.0, step[1:])
        return step

    def relative(self, step, unknown, _):
        """Size of a step relative to the tension vector, shape (...). [-]

        The larger one of all components together and of those across the chord: the sag of a steep cable follows from
        its small transverse tension.
        """
        floors = 1e-3 * self.load, 1e-3 * self.transverse_load
        whole = np.sqrt(sum(d * d for d in step)) / np.maximum(
            np.sqrt(sum(u * u for u in unknown)) + floors[0], CABLE.least_divisor
        )
        across = np.hypot(*step[1:]) / np.maximum(np.hypot(*unknown[1:]) + floors[1], CABLE.least_divisor)
        return np.maximum(whole, across)

    def rounding(self, step):
        """Error of the slope along a step by rounding of the residual, shape (...)."""
        return 1e-15 * np.abs(self.strain * step[0])

    def start(self, span):
        """A first tension vector, shape (3, ...), a vertical cable's with next to no horizontal tension. [N]

        Not zero: where such a cable is slack and folded, its stiffness is a limit, H^2 over a number that goes as H^2.
        """
        q, n, y = (np.broadcast_to(part, self.shape).astype(float) for part in _first_tension(span))
        almost_nothing = -1e-100 * np.sign(span.sine) * (np.abs(q) + self.load)
        # the chord is vertical: across it is horizontal
        return np.stack([q, np.where(self.vertical, almost_nothing, n), np.where(self.vertical, 0.0, y)])

    def kink(self, sizes):
        """The nearest tension vector at which a segment of a weightless cable has none: the energy has a kink there.

        Parameters
        ----------
        sizes : ndarray, shape (..., k + 1)
            Tensions of the segments. [N]

        Returns
        -------
        minimum : ndarray of bool, shape (...)
            Whether the energy is least at the kink: the segment is at least as long as the distance that it spans, and
            slack.
        place, lower : ndarray, shape (3, ...)
            The kink, and a tension vector with less energy where it is no minimum. [N]
        """
        nearest = sizes.argmin(axis=-1)[..., None]
        place = np.stack([-np.take_along_axis(o, nearest, axis=-1)[..., 0] for o in self.segments.offset])
        tension = self.tension(place)
        slack = np.all([part == 0 for part in tension], axis=0)
        parts, kernel = extension(tension, self.segments.weight, self.stiffness, *self.angles)
        fraction = np.where(slack, 0.0, self.segments.fraction)
        entries = flexibility(tension, self.segments.weight, self.stiffness, *self.angles, kernel)
        qq, nn, yy, qn, qy, ny = ((entry * fraction).sum(axis=-1) for entry in entries)
        own = (self.segments.fraction - fraction).sum(axis=-1)
        q, n, y = (-(part * fraction).sum(axis=-1) for part in parts)
        q = q + self.strain
        excess = 2 * own * q + q * q + n * n + y * y  # |own e + (q, n, y)|^2 - own^2
        distance = np.sqrt(np.maximum(own**2 + excess, 0.0))
        way = np.stack([part / np.maximum(distance, CABLE.least_divisor) for part in (own + q, n, y)])
        compliance = own / self.stiffness[..., 0] + qq * way[0] ** 2 + nn * way[1] ** 2 + yy * way[2] ** 2
        compliance = compliance + 2 * (qn * way[0] * way[1] + qy * way[0] * way[2] + ny * way[1] * way[2])
        force = np.maximum(excess, 0.0) / (distance + own) / np.maximum(compliance, CABLE.least_divisor)
        return excess <= 0, place, place + force * way


def _first_tension(span):
    """Approximate tension vector at mid-length, weight and loads distributed uniformly over the cable; 3 arrays. [N]"""
    down = span.load_forces.sum(axis=-2) - np.asarray(span.weight)[..., None] * span.up
    size = np.sqrt((down**2).sum(axis=-1))
    largest = np.maximum(size, np.sqrt((span.load_forces**2).sum(axis=-1)).max(axis=-1, initial=0.0))
    up = -down / np.maximum(size, CABLE.least_divisor)[..., None]
    along = up[..., 0]
    across = np.sqrt(up[..., 1] ** 2 + up[..., 2] ** 2)
    taut = _taut_tension(span, np.where(size > 0, across * size, largest))
    ratio = 1.0 / (1.0 + span.chord_strain)  # unstretched length over chord
    slack = (ratio > 1.2) & (across > 1e-8)
    if not np.any(slack):
        return taut, np.zeros_like(taut), np.zeros_like(taut)
    ratio_across = np.sqrt(np.maximum(ratio**2 - along**2, 1.0)) / np.maximum(across, 1e-8)
    parameter = _sinhc_inverse(np.where(slack, ratio_across, 1.0))
    horizontal = largest * across / (2 * parameter * np.maximum(ratio, 1.0))
    vertical = largest * along / np.maximum(2 * ratio * np.tanh(np.minimum(parameter, 300.0)), CABLE.least_divisor)
    unit = 1.0 / np.maximum(across, 1e-8)
    q = np.where(slack, horizontal * across + vertical * along, taut)
    n, y = (np.where(slack, (-horizontal * along * unit + vertical) * up[..., i], 0.0) for i in (1, 2))
    return q, n, y


def _taut_tension(span, across):
    """Positive root T of T^3/EA - strain T^2 - W^2/24 = 0, the parabola's, for a transverse load W: Newton steps."""
    stiffness, strain = span.axial_stiffness, span.chord_strain
    load = across**2 / 24
    tension = np.maximum(np.maximum(strain, 0.0) * stiffness, np.cbrt(load * stiffness))
    slack = strain < 0
    tension = np.where(slack, np.minimum(tension, np.sqrt(load / np.where(slack, -strain, 1.0))), tension)
    tension = np.maximum(tension, CABLE.least_divisor)
    for _ in range(8):
        value = tension**2 * (tension / stiffness - strain) - load
        slope = tension * (3 * tension / stiffness - 2 * strain)
        step = np.where(slope > 0, value / np.where(slope > 0, slope, 1.0), 0.0)
        tension = np.clip(tension - step, tension / 4, tension * 4)
    return tension


def _sinhc_inverse(value):
    """y > 0 with sinh(y)/y = value >= 1."""
    log = np.log(np.maximum(value, 1 + 1e-12))
    y = np.where(value < 3, np.sqrt(6 * np.maximum(value - 1, 1e-12)), log + np.log(2 * log + 2))
    for _ in range(6):
        small = np.minimum(y, 300.0)
        value_log = np.where(y > 300, y - np.log(2 * y), np.log(np.sinh(small) / small))
        slope = np.where(y > 300, 1.0, 1 / np.tanh(small)) - 1 / y
        y = np.maximum(y - (value_log - log) / slope, y / 3)
    return y
