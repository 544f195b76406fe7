"""The elastic catenary in closed form: exact statics and end stiffness of many cables at once.

Everything is written along the chord (Q) and across it (N, Y), because there no term cancels: the equation of the
chord balances small quantities only (strain, sag, excess length), however stiff or taut the cable is.

A segment carries no point load inside. Over a segment of length l and weight W, with P the tension vector at its
middle, V its vertical and H its horizontal part, V0 = V - W/2, V1 = V + W/2, T0 = |(H, V0)|, T1 = |(H, V1)|,
S = T0 + T1 and beta = W/S:

    end 2 - end 1 = l (1/EA + 2/S) P + l (2/S) (atanh(beta)/beta - 1) H
    flexibility   = l/EA + integral of (I - t t^T)/T ds

Source: Irvine (1981), section 1.3, rewritten; shared notation in docs/physics.md.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.span import Span
from cablestudy.errors import NoSolutionError

MAX_STEPS = 60
SMALL_BETA = 0.15  # below it the series, above it the closed forms: both are exact to rounding there
TINY = 1e-290
GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)


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


@dataclass(frozen=True)
class Kernel:
    """What one evaluation of the segments gives; all arrays have the shape of the tensions."""

    horizontal: np.ndarray  # the in-plane horizontal component, signed
    beta: np.ndarray
    sum_of_tensions: np.ndarray
    excess: np.ndarray  # atanh(beta)/beta - 1
    product: np.ndarray  # T0 T1 (S^2 - W^2)
    tensions: tuple  # at the two ends


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
    edges = np.concatenate([np.zeros(inner.shape[:-1] + (1,)), inner, np.ones(inner.shape[:-1] + (1,))], axis=-1)
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


def evaluate(tension, weight, cosine, sine):
    """The quantities that position and flexibility share.

    Parameters
    ----------
    tension : tuple of 3 ndarrays
        Tension vector at mid-segment in the chord frame. [N]
    weight, cosine, sine : ndarray
        Weight of the segment [N], cosine and sine of the chord's inclination [-].

    Returns
    -------
    Kernel
    """
    q, n, y = tension
    vertical = q * sine + n * cosine
    horizontal = q * cosine - n * sine
    h2 = horizontal**2 + y**2
    v0, v1 = vertical - weight / 2, vertical + weight / 2
    t0, t1 = np.sqrt(h2 + v0**2), np.sqrt(h2 + v1**2)
    total = np.maximum(t0 + t1, TINY)
    beta = weight / total
    up0, up1 = t0 + np.abs(v0), t1 + np.abs(v1)
    down0, down1 = h2 / np.maximum(up0, TINY), h2 / np.maximum(up1, TINY)
    plus = np.where(v1 >= 0, up1, down1) + np.where(v0 >= 0, down0, up0)
    minus = np.maximum(np.where(v1 >= 0, down1, up1) + np.where(v0 >= 0, up0, down0), TINY)
    small = beta < SMALL_BETA
    square = np.where(small, beta, 0.0) ** 2
    series = np.zeros_like(beta)
    for k in range(10, 0, -1):
        series = square * (1.0 / (2 * k + 1) + series)
    safe = np.where(small, 1.0, beta)
    excess = np.where(small, series, 0.5 * np.log(np.maximum(plus, TINY) / minus) / safe - 1.0)
    return Kernel(horizontal, beta, total, excess, t0 * t1 * plus * minus, (t0, t1))


def extension(tension, weight, axial_stiffness, cosine, sine):
    """End 2 minus end 1 of a segment, minus its own length along the chord, per unstretched length.

    Parameters
    ----------
    tension, weight, cosine, sine
        As for `evaluate`.
    axial_stiffness : ndarray
        [N]

    Returns
    -------
    tuple of 3 ndarrays
        Along the chord, across it in the plane, out of the plane. [-]
    Kernel
    """
    q, n, y = tension
    kernel = evaluate(tension, weight, cosine, sine)
    total, sag = kernel.sum_of_tensions, 2 * kernel.excess / kernel.sum_of_tensions
    half_q, half_n = weight * sine / 2, weight * cosine / 2
    shortfall = _beyond(kernel.tensions[0], q - half_q, n - half_n, y) + _beyond(
        kernel.tensions[1], q + half_q, n + half_n, y
    )
    along = q / axial_stiffness - shortfall / total + sag * kernel.horizontal * cosine
    across = n / axial_stiffness + 2 * n / total - sag * kernel.horizontal * sine
    out = y / axial_stiffness + 2 * y / total + sag * y
    return (along, across, out), kernel


def _beyond(tension, q, n, y):
    """Tension minus its component along the chord, without cancellation."""
    return np.where(q > 0, (n**2 + y**2) / np.maximum(tension + np.abs(q), TINY), tension - q)


def flexibility(tension, weight, axial_stiffness, cosine, sine, kernel):
    """Derivative of a segment's extension with respect to the tension vector, per unstretched length.

    Parameters
    ----------
    tension, weight, axial_stiffness, cosine, sine, kernel
        As for `extension`.

    Returns
    -------
    tuple of 6 ndarrays
        qq, nn, yy, qn, qy, ny. [1/N]

    Notes
    -----
    The integral of (T^2 I - P P^T)/T^3 over the segment, once in terms of small deviations from the chord and once in
    horizontal and vertical components: each form is free of cancellation where the other is not.
    """
    small = kernel.beta < SMALL_BETA
    if small.all():
        sag = _shallow(tension, weight, cosine, sine, kernel)
    else:
        sag = tuple(
            np.where(small, shallow, deep)
            for shallow, deep in zip(
                _shallow(tension, weight, cosine, sine, kernel),
                _deep(tension, cosine, sine, kernel),
                strict=True,
            )
        )
    axial = 1.0 / axial_stiffness
    return (axial + sag[0], axial + sag[1], axial + sag[2], *sag[3:])


def _shallow(tension, weight, cosine, sine, kernel):
    """With P = P_mid + W g tau: moments of 1/T^3, the second one by quadrature. For small beta."""
    q, n, y = tension
    total, product = kernel.sum_of_tensions, np.maximum(kernel.product, TINY)
    i0 = 2 * total / product
    i1 = -2 * (q * sine + n * cosine) * weight / (total * product)
    wq, wn = weight * sine, weight * cosine
    i2 = np.zeros_like(i0)
    for point, share in zip(GAUSS_POINTS / 2, GAUSS_WEIGHTS / 2, strict=True):
        square = (q + wq * point) ** 2 + (n + wn * point) ** 2 + y**2
        i2 = i2 + share * point**2 / np.maximum(square * np.sqrt(square), TINY)
    qq = q * q * i0 + 2 * q * wq * i1 + wq * wq * i2
    nn = n * n * i0 + 2 * n * wn * i1 + wn * wn * i2
    yy = y * y * i0
    return (
        nn + yy,
        qq + yy,
        2 * (1 + kernel.excess) / total - yy,
        -(q * n * i0 + (q * wn + n * wq) * i1 + wq * wn * i2),
        -(q * y * i0 + y * wq * i1),
        -(n * y * i0 + y * wn * i1),
    )


def _deep(tension, cosine, sine, kernel):
    """Horizontal h and vertical v components, rotated into the chord frame. For large beta."""
    q, n, y = tension
    h, total = kernel.horizontal, kernel.sum_of_tensions
    i0 = 2 * total / np.maximum(kernel.product, TINY)
    first = 2 * (q * sine + n * cosine) / (total * np.maximum(kernel.tensions[0] * kernel.tensions[1], TINY))
    second = 2 * (1 + kernel.excess) / total - (h * h + y * y) * i0
    hh, vv, hv = second + y * y * i0, (h * h + y * y) * i0, -h * first
    hy, vy = -h * y * i0, -y * first
    mixed = 2 * cosine * sine * hv
    return (
        cosine**2 * hh + mixed + sine**2 * vv,
        sine**2 * hh - mixed + cosine**2 * vv,
        second + h * h * i0,
        cosine * sine * (vv - hh) + (cosine**2 - sine**2) * hv,
        cosine * hy + sine * vy,
        cosine * vy - sine * hy,
    )


def solve_symmetric(matrix, right):
    """Solve symmetric 3x3 systems given as (qq, nn, yy, qn, qy, ny), scaled to a unit diagonal first."""
    qq, nn, yy, qn, qy, ny = matrix
    a, b, c = (1 / np.sqrt(np.maximum(diagonal, TINY)) for diagonal in (qq, nn, yy))
    d, e, f = qn * a * b, qy * a * c, ny * b * c
    x, y, z = right[0] * a, right[1] * b, right[2] * c
    c11, c12, c13 = 1 - f * f, e * f - d, d * f - e
    determinant = np.maximum(c11 + d * c12 + e * c13, 1e-30)
    c22, c23, c33 = 1 - e * e, d * e - f, 1 - d * d
    return (
        a * (c11 * x + c12 * y + c13 * z) / determinant,
        b * (c12 * x + c22 * y + c23 * z) / determinant,
        c * (c13 * x + c23 * y + c33 * z) / determinant,
    )


def start(span):
    """A first tension vector: DESIGN section 5's, in the direction of gravity and loads together.

    Parameters
    ----------
    span : Span

    Returns
    -------
    tuple of 3 ndarrays, shape (...)
        In the chord frame. [N]
    """
    down = span.load_forces.sum(axis=-2) - np.asarray(span.weight)[..., None] * span.up
    size = np.sqrt((down**2).sum(axis=-1))
    largest = np.maximum(size, np.sqrt((span.load_forces**2).sum(axis=-1)).max(axis=-1, initial=0.0))
    up = -down / np.maximum(size, TINY)[..., None]
    along = up[..., 0]
    across = np.sqrt(up[..., 1] ** 2 + up[..., 2] ** 2)
    taut = _taut_tension(span, np.where(size > 0, across * size, largest))
    ratio = 1.0 / (1.0 + span.chord_strain)  # unstretched length over chord
    slack = (ratio > 1.2) & (across > 1e-8)
    if not np.any(slack):
        return taut, np.zeros_like(taut), np.zeros_like(taut)
    reach = np.sqrt(np.maximum(ratio**2 - along**2, 1.0)) / np.maximum(across, 1e-8)
    parameter = _sinhc_inverse(np.where(slack, reach, 1.0))
    horizontal = largest * across / (2 * parameter * np.maximum(ratio, 1.0))
    vertical = largest * along / np.maximum(2 * ratio * np.tanh(np.minimum(parameter, 300.0)), TINY)
    unit = 1.0 / np.maximum(across, 1e-8)
    q = np.where(slack, horizontal * across + vertical * along, taut)
    n, y = (
        np.where(slack, (-horizontal * along * unit + vertical) * up[..., i], 0.0) for i in (1, 2)
    )
    return q, n, y


def _taut_tension(span, across):
    """Positive root T of T^3/EA - strain T^2 - across^2/24 = 0 (a parabola), by bounded Newton steps."""
    stiffness, strain = span.axial_stiffness, span.chord_strain
    load = across**2 / 24
    tension = np.maximum(np.maximum(strain, 0.0) * stiffness, np.cbrt(load * stiffness))
    slack = strain < 0
    tension = np.where(slack, np.minimum(tension, np.sqrt(load / np.where(slack, -strain, 1.0))), tension)
    tension = np.maximum(tension, TINY)
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

    @cached_property
    def kernel(self):
        """The closed-form quantities of each segment."""
        return evaluate(self.tension, self.segments.weight, *self._angles)

    @property
    def _angles(self):
        return np.asarray(self.span.cosine)[..., None], np.asarray(self.span.sine)[..., None]

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
        """Force on end 2 per movement of end 2, end 1 fixed, chord frame, shape (..., 3, 3). [N/m]"""
        columns = [
            np.stack(solve_symmetric(self.flexibility, tuple(np.eye(3)[i])), axis=-1) for i in range(3)
        ]
        return np.stack(columns, axis=-1)

    def at(self, position):
        """Place and tension vector along one cable.

        Parameters
        ----------
        position : ndarray, shape (j,)
            Unstretched arc length over unstretched length, in [0, 1]; at a load, the side of end 1. [-]

        Returns
        -------
        displacement : ndarray, shape (j, 3)
            From the straight chord, in unstretched lengths, chord frame: r = (1 + strain) position e + displacement. [-]
        tension : ndarray, shape (j, 3)
            Chord frame. [N]
        """
        position = np.asarray(position, dtype=float)
        edges = np.concatenate([[0.0], np.cumsum(self.segments.fraction)])
        edges[-1] = 1.0
        which = np.clip(np.searchsorted(edges, position, side="left") - 1, 0, len(edges) - 2)
        begin, whole = edges[which], self.segments.fraction[which]
        part = position - begin
        weight = self.span.weight
        # mid-point of the piece between the segment's start and the wanted place
        shift = weight * (part - whole) / 2
        up = self.span.up
        middle = tuple(self.tension[i][which] + shift * up[i] for i in range(3))
        angles = self.span.cosine, self.span.sine
        piece, _ = extension(middle, weight * part, self.span.axial_stiffness, *angles)
        full, _ = extension(self.tension, self.segments.weight, self.span.axial_stiffness, *angles)
        strain = self.span.chord_strain
        stretch = (strain, 0.0, 0.0)
        displacement = []
        for i in range(3):
            ends = np.cumsum(self.segments.fraction * (full[i] - stretch[i]))
            before = np.concatenate([[0.0], ends])[which]
            displacement.append(before + part * (piece[i] - stretch[i]))
        tension = np.stack([middle[i] + weight * part * up[i] / 2 for i in range(3)], axis=-1)
        return np.stack(displacement, axis=-1), tension


def _hold_upright(span, unknown, floor):
    """A vertical cable without horizontal loads has no horizontal tension: hold it at next to nothing.

    Not at zero: where such a cable is slack and folds, its stiffness is a limit, H^2 over a number that goes as H^2.
    """
    sideways = np.abs(span.load_forces[..., 1:]).sum(axis=(-1, -2)) if span.load_forces.size else 0.0
    upright = (np.abs(span.cosine) == 0) & (sideways == 0)
    almost_nothing = 1e-100 * (np.abs(unknown[0]) + floor)
    # the chord is vertical: across it is horizontal
    return (unknown[0], np.where(upright, almost_nothing, unknown[1]), np.where(upright, 0.0, unknown[2])), upright


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
    step that is halved until the slope along it no longer grows always arrives.
    """
    cosine, sine = np.asarray(span.cosine)[..., None], np.asarray(span.sine)[..., None]
    stiffness = np.asarray(span.axial_stiffness, dtype=float)[..., None]
    segments = split(span)
    shape = np.broadcast_shapes(cosine.shape[:-1], stiffness.shape[:-1], segments.weight.shape[:-1])
    strain = np.broadcast_to(span.chord_strain, shape)

    def residual(unknown):
        tension = tuple(u[..., None] + o for u, o in zip(unknown, segments.offset, strict=True))
        parts, kernel = extension(tension, segments.weight, stiffness, cosine, sine)
        gap = [(part * segments.fraction).sum(axis=-1) for part in parts]
        return tension, kernel, (strain - gap[0], -gap[1], -gap[2])

    floor = np.asarray(span.weight) + np.abs(span.load_forces).sum(axis=(-1, -2))
    unknown, upright = _hold_upright(span, tuple(np.broadcast_to(u, shape).astype(float) for u in start(span)), floor)
    weightless = (floor == 0) & (strain <= 0)  # no tension at all: nothing to solve
    unknown = (np.where(weightless, stiffness[..., 0], unknown[0]), *unknown[1:])
    tension, kernel, gap = residual(unknown)
    steps = np.zeros(shape, dtype=int)
    change = np.full(shape, np.inf)
    active = np.broadcast_to(~weightless, shape)
    for _ in range(MAX_STEPS):
        matrix = flexibility(tension, segments.weight, stiffness, cosine, sine, kernel)
        matrix = tuple((entry * segments.fraction).sum(axis=-1) for entry in matrix)
        step = solve_symmetric(matrix, gap)
        step = (step[0], np.where(upright, 0.0, step[1]), np.where(upright, 0.0, step[2]))
        slope = sum(g * d for g, d in zip(gap, step, strict=True))
        size = np.sqrt(sum(u * u for u in unknown)) + 1e-3 * floor
        last, change = change, np.sqrt(sum(d * d for d in step)) / np.maximum(size, TINY)
        share = active.astype(float)
        for _ in range(40):
            trial = tuple(u + share * d for u, d in zip(unknown, step, strict=True))
            new_tension, new_kernel, new_gap = residual(trial)
            along = sum(g * d for g, d in zip(new_gap, step, strict=True))
            worse = active & (along < -0.5 * slope) & (change > 1e-12)
            if not worse.any():
                break
            share = np.where(worse, share / 2, share)
        unknown, tension, kernel, gap = trial, new_tension, new_kernel, new_gap
        steps = steps + active
        # quadratic convergence: below 1e-9 the step just taken was the last that matters; rounding stops the rest
        active = active & ~((change < 1e-13) | ((change < 1e-9) & (change >= last / 2)) | ~np.isfinite(change))
        if not active.any():
            break
    converged = np.isfinite(change) & (change < 1e-8) & ~weightless
    return Catenary(span, tension, segments, Record(steps, change, converged))
