"""Extension and flexibility of one catenary segment under a tension vector, in closed form.

The equations are written along the chord (q) and across it (n, y), because no terms cancel there: they balance small
quantities only (strain, sag, excess length), however stiff or taut the cable is.

A segment carries no point load inside. Over a segment of length l and weight W, with P the tension vector at its
middle, V its vertical and H its horizontal part, V0 = V - W/2, V1 = V + W/2, T0 = |(H, V0)|, T1 = |(H, V1)|,
S = T0 + T1 and beta = W/S:

    end 2 - end 1 = l (1/EA + 2/S) P + l (2/S) (atanh(beta)/beta - 1) H
    flexibility   = l/EA + integral of (I - t t^T)/T ds

with the tension T and the unit tangent t along the segment, and the unit matrix I.

Source: Irvine (1981), Cable Structures, section 1.3, rewritten.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import largest

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)
# of atanh(beta)/beta - 1 in beta^2, from its highest power on; with numbers of Python numpy takes longer
SERIES = [np.array(1.0 / (2 * k + 1)) for k in range(10, 0, -1)]


@dataclass(frozen=True)
class SegmentTerms:
    """Terms of the module's equations that extension and flexibility of a segment share; all of one shape."""

    horizontal: np.ndarray  # horizontal component of P in the plane, signed [N]
    beta: np.ndarray  # W/S [-]
    sum_of_tensions: np.ndarray  # S [N]
    excess: np.ndarray  # atanh(beta)/beta - 1 [-]
    product: np.ndarray  # T0 T1 (S^2 - W^2) [N^4]
    tensions: tuple  # T0 and T1, at the two ends [N]


def segment_terms(tension, weight, cosine, sine):
    """Quantities of one catenary segment that both its form and its flexibility are computed from: `SegmentTerms`.

    P = (q, n, y) has the vertical part V = q sine + n cosine and the horizontal part H = (q cosine - n sine, y).

    Parameters
    ----------
    tension : tuple of 3 ndarrays
        q along the chord, n across it in the vertical plane, y out of that plane. [N]
    weight : ndarray
        W of the segment. [N]
    cosine, sine : ndarray
        Of the inclination of the chord. [-]
    """
    q, n, y = tension
    vertical = q * sine + n * cosine
    horizontal = q * cosine - n * sine
    h2 = horizontal**2 + y**2
    half_weight = weight / 2
    v0, v1 = vertical - half_weight, vertical + half_weight
    t0, t1 = np.sqrt(h2 + v0**2), np.sqrt(h2 + v1**2)
    total = np.maximum(t0 + t1, CABLE.least_divisor)
    beta = weight / total
    # without cancellation: S + W = (T1 + V1) + (T0 - V0), S - W = (T1 - V1) + (T0 + V0), T - |V| = H^2/(T + |V|)
    larger0, larger1 = t0 + np.abs(v0), t1 + np.abs(v1)
    smaller0, smaller1 = (h2 / np.maximum(larger, CABLE.least_divisor) for larger in (larger0, larger1))
    upwards0, upwards1 = v0 >= 0, v1 >= 0
    s_plus_w = np.where(upwards1, larger1, smaller1) + np.where(upwards0, smaller0, larger0)
    s_minus_w = np.where(upwards1, smaller1, larger1) + np.where(upwards0, larger0, smaller0)
    s_minus_w = np.maximum(s_minus_w, CABLE.least_divisor)
    small = beta < CABLE.series_below
    return SegmentTerms(
        horizontal, beta, total, _excess(beta, small, s_plus_w, s_minus_w), t0 * t1 * s_plus_w * s_minus_w, (t0, t1)
    )


def _excess(beta, small, s_plus_w, s_minus_w):
    """atanh(beta)/beta - 1, by its power series where beta is small, else by the logarithm of S + W over S - W."""
    number = np.count_nonzero(small)
    if number == small.size:
        return _excess_by_series(beta)
    by_logarithm = (
        0.5 * np.log(np.maximum(s_plus_w, CABLE.least_divisor) / s_minus_w) / np.where(small, 1.0, beta) - 1.0
    )
    return np.where(small, _excess_by_series(np.where(small, beta, 0.0)), by_logarithm) if number else by_logarithm


def _excess_by_series(beta):
    """atanh(beta)/beta - 1 by its power series."""
    square = beta**2
    series = square * SERIES[0]
    for coefficient in SERIES[1:]:
        series = square * (coefficient + series)
    return series


def extension(tension, weight, axial_stiffness, cosine, sine):
    """End 2 minus end 1 of a segment, less its unstretched length along the chord, per that length; and its terms.

    Arguments as for `segment_terms`, and EA [N]. The extension is a tuple of 3 ndarrays: along the chord, across it in
    the plane, out of the plane. [-]
    """
    q, n, y = tension
    terms = segment_terms(tension, weight, cosine, sine)
    t0, t1 = terms.tensions
    total, by_sag = terms.sum_of_tensions, 2 * terms.excess / terms.sum_of_tensions
    half_weight, by_lean = weight / 2, by_sag * terms.horizontal
    half_q, half_n = half_weight * sine, half_weight * cosine  # of the weight along the chord and across it
    shortfall = _less_component(t0, q - half_q, n - half_n, y) + _less_component(t1, q + half_q, n + half_n, y)
    along = q / axial_stiffness - shortfall / total + by_lean * cosine
    across = n / axial_stiffness + 2 * n / total - by_lean * sine
    out = y / axial_stiffness + 2 * y / total + by_sag * y
    return (along, across, out), terms


def _less_component(tension, q, n, y):
    """Tension T = |(q, n, y)| less its component q along the chord, without cancellation."""
    return np.where(q > 0, (n**2 + y**2) / np.maximum(tension + np.abs(q), CABLE.least_divisor), tension - q)


def flexibility(tension, weight, axial_stiffness, cosine, sine, terms):
    """Flexibility of a catenary segment: movement of its end 2 per force there, end 1 fixed, per unstretched length.

    Parameters
    ----------
    tension : tuple of 3 ndarrays
        As for `segment_terms`. [N]
    weight, axial_stiffness, cosine, sine : ndarray
        As for `extension`.
    terms : SegmentTerms
        From `extension`.

    Returns
    -------
    tuple of 6 ndarrays
        Entries qq, nn, yy, qn, qy, ny of the symmetric matrix. [1/N]

    Notes
    -----
    The mean of (I - t t^T)/T is found once in terms of small deviations from the chord and once in horizontal and
    vertical components: each form is free of cancellation where the other is not.
    """
    small = terms.beta < CABLE.series_below
    number = np.count_nonzero(small)
    if number == small.size:
        by_turning = _flexibility_of_small_beta(tension, weight, cosine, sine, terms)
    else:
        by_turning = _flexibility_of_large_beta(tension, cosine, sine, terms)
        if number:
            shallow = _flexibility_of_small_beta(tension, weight, cosine, sine, terms)
            by_turning = tuple(np.where(small, *pair) for pair in zip(shallow, by_turning, strict=True))
    qq, nn, yy, *mixed = by_turning
    axial = 1.0 / axial_stiffness
    return (axial + qq, axial + nn, axial + yy, *mixed)


def _flexibility_of_small_beta(tension, weight, cosine, sine, terms):
    """Flexibility of light segments by change of direction alone, from small deviations from the chord.

    Light is a segment of small beta = W/S: its weight over the sum of the tensions at both ends. The result is
    `flexibility` without I/EA, with the unit tangent t = P/T:

        mean of (I - t t^T)/T = mean of (T^2 I - P P^T)/T^3

    Along the segment the tension vector is P = (q, n, y) + w tau with w = W (sine, cosine, 0) and tau from -1/2 to 1/2.
    The numbers i0, i1 and i2 are the means of tau^k/T^3 for k = 0, 1 and 2, the last one by quadrature. Returned are
    the entries qq, nn, yy, qn, qy, ny of the symmetric matrix, in the chord frame. [1/N]
    """
    q, n, y = tension
    total, product = terms.sum_of_tensions, np.maximum(terms.product, CABLE.least_divisor)
    i0 = 2 * total / product
    i1 = -2 * (q * sine + n * cosine) * weight / np.maximum(total * product, CABLE.least_divisor)
    wq, wn = weight * sine, weight * cosine  # w
    q2, n2, y2, wq2, wn2 = q * q, n * n, y * y, wq * wq, wn * wn
    twice_along, twice_across = 2 * q * wq, 2 * n * wn
    tau, share = _gauss_rule(np.ndim(i0))
    square = q2 + n2 + y2 + tau * (twice_along + twice_across + tau * (wq2 + wn2))  # T^2
    # summed point by point, so that the digits of a cable do not depend on its batch
    i2 = sum(share / np.maximum(square * np.sqrt(square), CABLE.least_divisor))
    qq = q2 * i0 + twice_along * i1 + wq2 * i2
    nn = n2 * i0 + twice_across * i1 + wn2 * i2
    yy = y2 * i0
    return (
        nn + yy,
        qq + yy,
        2 * (1 + terms.excess) / total - yy,
        -(q * n * i0 + (q * wn + n * wq) * i1 + wq * wn * i2),
        -(q * y * i0 + y * wq * i1),
        -(n * y * i0 + y * wn * i1),
    )


@lru_cache
def _gauss_rule(dimensions):
    """Places tau of Gauss's rule on a segment, from -1/2 to 1/2, and their weights times tau^2.

    Both have the shape (points, 1, ...), with `dimensions` axes of length one after the first.
    """
    tau, share = (column.reshape(-1, *[1] * dimensions) / 2 for column in (GAUSS_POINTS, GAUSS_WEIGHTS))
    return tau, share * tau**2


def _flexibility_of_large_beta(tension, cosine, sine, terms):
    """Flexibility of heavy segments (large beta) by change of direction alone.

    The result is that of `_flexibility_of_small_beta`: entries qq, nn, yy, qn, qy, ny in the chord frame [1/N]. It is
    found for horizontal, vertical and lateral components (h, V, y) of the tension vector P and then rotated into the
    chord frame (q, n, y). The numbers i0, i1 and i2 are the means of V^k/T^3 for k = 0, 1 and 2.
    """
    q, n, y = tension
    h, total, (t0, t1) = terms.horizontal, terms.sum_of_tensions, terms.tensions
    i0 = 2 * total / np.maximum(terms.product, CABLE.least_divisor)
    i1 = 2 * (q * sine + n * cosine) / np.maximum(total * (t0 * t1), CABLE.least_divisor)
    h2, y2 = h * h, y * y
    vv = (h2 + y2) * i0
    i2 = 2 * (1 + terms.excess) / total - vv
    hh, hv = i2 + y2 * i0, -h * i1
    hy, vy = -h * y * i0, -y * i1
    cc, ss = cosine**2, sine**2
    mixed = 2 * cosine * sine * hv
    return (
        cc * hh + mixed + ss * vv,
        ss * hh - mixed + cc * vv,
        i2 + h2 * i0,
        cosine * sine * (vv - hh) + (cc - ss) * hv,
        cosine * hy + sine * vy,
        cosine * vy - sine * hy,
    )


class SegmentedCable:
    """Tensions of a cable in equilibrium whose tension vector is linear along each of its segments or elements.

    A subclass has `span`, `mid_forces`, the tension vectors at mid-segment, chord frame, shape (..., k, 3) [N], and
    `segment_weights`, shape (..., k) [N]. A continuous cable has `mean_tension` and `end_stiffness` too.
    """

    @property
    def _angles(self):
        """Cosine and sine of the chord's inclination, shapes (..., 1). [-]"""
        return np.asarray(self.span.cosine)[..., None], np.asarray(self.span.sine)[..., None]

    @cached_property
    def _vertical_and_horizontal(self):
        """Vertical part of the tension at mid-segment, signed, and size of the horizontal one, each (..., k). [N]"""
        cosine, sine = self._angles
        q, n, y = np.moveaxis(self.mid_forces, -1, 0)
        return q * sine + n * cosine, np.hypot(q * cosine - n * sine, y)

    @cached_property
    def edge_tensions(self):
        """Tension at both ends of each segment, shape (..., k, 2). [N]"""
        vertical, horizontal = self._vertical_and_horizontal
        half = self.segment_weights / 2
        return np.sqrt(horizontal[..., None] ** 2 + np.stack([vertical - half, vertical + half], axis=-1) ** 2)

    @property
    def max_tension(self):
        """Largest tension, at an end or at a load, shape (...). [N]"""
        return largest(self.edge_tensions).max(axis=-1)

    @property
    def min_tension(self):
        """Smallest tension, at an end, at a load or at the lowest point, shape (...). [N]"""
        vertical, horizontal = self._vertical_and_horizontal
        sags = np.abs(vertical) < self.segment_weights / 2
        least = np.minimum(self.edge_tensions[..., 0], self.edge_tensions[..., 1])
        return np.where(sags, horizontal, least).min(axis=-1)

    @property
    def folded(self):
        """True where a cable has almost no tension somewhere, shape (...): it has no stiffness about this form."""
        return self.min_tension <= CABLE.folded * self.max_tension

    @property
    def stretched_length(self):
        """Stretched length of a continuous cable, shape (...). [m]"""
        return self.span.unstretched_length * (1 + self.mean_tension / self.span.axial_stiffness)

    @cached_property
    def global_end_stiffness(self):
        """`end_stiffness` of a continuous cable along x, y, z, shape (..., 3, 3). [N/m]"""
        frame = self.span.frame
        return np.swapaxes(frame, -1, -2) @ self.end_stiffness @ frame

    @property
    def half_changes(self):
        """Change of the tension vector along half of each segment, chord frame, shape (..., k, 3). [N]"""
        return (self.segment_weights / 2)[..., None] * self.span.up[..., None, :]

    def change_along(self, normal):
        """Change of the part of the tension vector along a normal, global axes, over each segment, (..., k). [N]"""
        return self.segment_weights * (self.span.vertical * normal).sum(axis=-1)[..., None]

    def displacement_at(self, position):
        """Displacement from the chord at positions along the cable, as of `Catenary.at`, shape (..., j, 3). [-]"""
        return self.at(position)[0]

    def extremes(self, normal):
        """Arc lengths at which cables may be farthest along a normal, global axes: edges, and zeros of T . normal.

        The normal has the shape (3,) or (..., 3), the result (..., 2 k + 1): shares of the unstretched length. The
        tension vector T is linear along each segment.
        """
        edges = self.edges
        at_middle = (self.span.in_frame(self.mid_forces, "global") * normal[..., None, :]).sum(axis=-1)
        change = self.change_along(normal)
        zero = 0.5 - np.divide(at_middle, change, out=np.zeros_like(at_middle), where=change != 0)
        inner = edges[..., :-1] + np.clip(zero, 0.0, 1.0) * np.diff(edges, axis=-1)
        return np.concatenate([np.broadcast_to(edges, (*inner.shape[:-1], edges.shape[-1])), inner], axis=-1)

    @property
    def edge_forces(self):
        """Tension vectors at both ends of each segment, global axes, shape (..., k, 2, 3). [N]"""
        half = self.half_changes
        return np.stack([self.span.in_frame(self.mid_forces + sign * half, "global") for sign in (-1, 1)], axis=-2)

    def end_forces(self, frame="chord"):
        """Force of the cable on each end, point loads there included, shape (..., 2, 3). [N]

        Parameters
        ----------
        frame : {"chord", "global"}
        """
        return self.global_end_forces if frame == "global" else self.span.in_frame(self._local_end_forces, frame)

    @property
    def _local_end_forces(self):
        """`end_forces` in the axes of the chord. [N]"""
        half = self.half_changes
        at_end_1, at_end_2 = (self.mid_forces - half)[..., 0, :], (self.mid_forces + half)[..., -1, :]
        return np.stack([at_end_1, -at_end_2], axis=-2)

    @cached_property
    def global_end_forces(self):
        """`end_forces` along x, y, z. [N]"""
        return self.span.in_frame(self._local_end_forces, "global")


def _scaled_cofactors(matrix):
    """Scales, cofactors and determinant of symmetric 3x3 matrices with the entries (qq, nn, yy, qn, qy, ny).

    The scales a, b, c of rows and columns make a unit diagonal. The cofactors (11, 22, 33, 12, 13, 23) and the
    determinant are those of the scaled matrix [[1, d, e], [d, 1, f], [e, f, 1]].
    """
    qq, nn, yy, qn, qy, ny = matrix
    a, b, c = (1 / np.sqrt(np.maximum(diagonal, CABLE.least_divisor)) for diagonal in (qq, nn, yy))
    d, e, f = qn * a * b, qy * a * c, ny * b * c
    c11, c12, c13 = 1 - f * f, e * f - d, d * f - e
    determinant = np.maximum(c11 + d * c12 + e * c13, 1e-30)  # rounding may leave none of a singular one
    return (a, b, c), (c11, 1 - e * e, 1 - d * d, c12, c13, d * e - f), determinant


def solve_symmetric(matrix, right):
    """Solutions of symmetric 3x3 systems with the entries (qq, nn, yy, qn, qy, ny): tuple of 3 arrays."""
    (a, b, c), (c11, c22, c33, c12, c13, c23), determinant = _scaled_cofactors(matrix)
    x, y, z = right[0] * a, right[1] * b, right[2] * c
    return (
        a * (c11 * x + c12 * y + c13 * z) / determinant,
        b * (c12 * x + c22 * y + c23 * z) / determinant,
        c * (c13 * x + c23 * y + c33 * z) / determinant,
    )


def inverse_symmetric(matrix):
    """Inverses of symmetric 3x3 matrices with the entries (qq, nn, yy, qn, qy, ny), shape (..., 3, 3)."""
    scales, (c11, c22, c33, c12, c13, c23), determinant = _scaled_cofactors(matrix)
    inverse = np.empty((*determinant.shape, 3, 3))
    for i, row in enumerate(((c11, c12, c13), (c12, c22, c23), (c13, c23, c33))):
        for j, cofactor in enumerate(row):
            inverse[..., i, j] = scales[i] * (cofactor * scales[j]) / determinant
    return inverse
