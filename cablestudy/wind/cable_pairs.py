"""Coherence of turbulence between two cables, and between cables and points, where they come close too.

A load on an element is known by its integrals with the Lagrange polynomials l_i of n Gauss points. With the weights w_i
of these points, its covariance with another load is a sum over the points of both, of products of these integrals and

    integral of l_i(s) l_j(t) exp(-kappa r(s, t)) ds dt / (w_i w_j),

the mean coherence. Far from each other it is that of the points. Where two cables meet, cross or run beside each other
exp(-kappa r) has a peak along them that is as narrow as their distance. Let t0 be the place on a straight cable that is
closest to a point, h their distance: with t = t0 + h sinh(u), r is h cosh(u), in which there is no peak, and few points
of u suffice for any kappa. So they do along the other cable with s = s0 + c sinh(v), s0 being the place where both are
closest, and c their distance there over the sine of their angle.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.polynomial import legendre

from cablestudy.cable.element import basis, lagrange
from cablestudy.cable.vectors import dot, size
from cablestudy.wind.coherence import gauss
from cablestudy.wind.tolerances import WIND


def load_points(order):
    """The n Gauss points of loads on an element, on [0, 1], and their weights, shape (n,) both; two on a bar."""
    return gauss(1 if order == 1 else order + WIND.load_points - 1)


@cache
def _over_weights(order):
    """Legendre coefficients of the n functions l_i/w_i, shape (n, n): a function is a column."""
    points, _ = load_points(order)
    return (2 * np.arange(len(points))[:, None] + 1) * legendre.legvander(2 * points - 1, len(points) - 1).T


@dataclass(frozen=True)
class Arc:
    """One element of a cable, with the positions of its nodes, shape (order + 1, 3), global axes. [m]"""

    nodes: np.ndarray

    @property
    def order(self):
        """Order of the polynomials of the element."""
        return len(self.nodes) - 1

    @cached_property
    def points(self):
        """Positions of the n points of loads, shape (n, 3). [m]"""
        return lagrange(basis(self.order).nodes, load_points(self.order)[0]) @ self.nodes

    @cached_property
    def slopes(self):
        """Derivatives of the position by that in the element, at these points, shape (n, 3). [m]"""
        element = basis(self.order)
        return lagrange(element.points, load_points(self.order)[0]) @ (element.derivative @ self.nodes)

    @cached_property
    def spacing(self):
        """Mean distance of these points. [m]"""
        weights = load_points(self.order)[1]
        return float(size(self.slopes) @ weights) / len(weights)

    def functions(self, positions):
        """The n functions l_i/w_i at positions on [0, 1], shape (...): shape (..., n)."""
        return self._along(positions)[0] @ _over_weights(self.order)

    def places(self, positions):
        """Places at positions on [0, 1], shape (..., 3). [m]"""
        return self._along(positions)[1]

    def arc_lengths(self, positions):
        """Arc lengths from the first node to positions on [0, 1], shape (p,). [m]"""
        points, _ = load_points(self.order)
        inner, weights = gauss(len(points))
        speed = lagrange(points, positions[:, None] * inner) @ size(self.slopes)
        return positions * (speed @ weights)

    def _along(self, positions):
        """Legendre's polynomials at positions on [0, 1], shape (...), and the places there: (..., n) and (..., 3)."""
        _, weights = load_points(self.order)
        polynomials = legendre.legvander(2 * positions - 1, len(weights) - 1)
        return polynomials, polynomials @ ((_over_weights(self.order) * weights) @ self.points)

    def mean_with_points(self, kappa, places):
        """Mean coherence of points at `places`, shape (p, 3), and functions of the arc, shape (f, p, n)."""
        nearest = size(places[:, None] - self.points).argmin(axis=1)
        slope, start = self.slopes[nearest], load_points(self.order)[0][nearest]
        offset, length = places - self.points[nearest], size(slope)
        along = dot(offset, slope) / length**2
        distance = size(offset - along[:, None] * slope) / length
        t, weights = _sinh_rule(len(self.points), start + along, distance)
        polynomials, others = self._along(t)
        coherence = np.exp(-kappa[:, None] * size(places[:, None] - others)[:, None])  # (p, f, q)
        means = coherence @ (polynomials * weights[..., None]) @ _over_weights(self.order)
        return np.swapaxes(means, 0, 1)

    def mean_with(self, kappa, other):
        """Mean coherence of the functions of this `Arc` and of another one, shape (f, n, n')."""
        distances = size(self.points[:, None] - other.points)
        i, j = np.unravel_index(distances.argmin(), distances.shape)
        # the tangents at the two closest points as straight cables
        own, its, offset = self.slopes[i], other.slopes[j], self.points[i] - other.points[j]
        offset, across = (part - (part @ its) / (its @ its) * its for part in (offset, own))
        square, least = across @ across, WIND.parallel_cables**2 * (own @ own)
        along = -(offset @ across) / max(square, least)
        distance = size(offset + along * across) / np.sqrt(square) if square > least else WIND.broad_peak
        s, weights = _sinh_rule(len(self.points), load_points(self.order)[0][i] + along, distance)
        polynomials, places = self._along(s)
        by_function = (polynomials * weights[:, None]) @ _over_weights(self.order)
        return by_function.T @ other.mean_with_points(kappa, places)


def coherence_of_cables(kappa, cable, other):
    """Coherence of the gusts on two cables, averaged with each pair of their load functions, at f frequencies.

    Each element of a cable has a polynomial of mean 1 for each of its load points, see `Arc.functions`. With the
    functions g_i(s) of one cable and h_j(t) of the other, and the distance r between the places s and t, the mean is

        double integral of g_i(s) h_j(t) exp(-kappa r(s, t)) ds dt

    For elements far from each other this is the coherence between the load points i and j. Elements closer than
    `WIND.close_cables` times the spacing of their points are integrated by `Arc.mean_with`.

    Parameters
    ----------
    kappa : ndarray, shape (f,)
        Decay at each frequency: the coherence at a distance r is exp(-kappa r). [1/m]
    cable, other : list of Arc
        Elements of the two cables. All elements of `cable` have q functions in all, those of `other` p.

    Returns
    -------
    ndarray, shape (f, q, p)
        The mean for each pair of functions i and j. [-]
    """
    places = np.concatenate([arc.points for arc in cable])  # of the load points, shape (q, 3)
    others = np.concatenate([arc.points for arc in other])  # (p, 3)
    distance = size(places[:, None] - others)
    # both axes of points, q and p, as elements and the points of each
    by_element = len(cable), len(places) // len(cable), len(other), len(others) // len(other)
    least_distance = distance.reshape(by_element).min(axis=(1, 3))
    spacing = np.maximum.outer([arc.spacing for arc in cable], [arc.spacing for arc in other])
    close = least_distance < WIND.close_cables * spacing
    if min(cable[0].order, other[0].order) == 1:  # bars are many, with two points each
        close[:] = False
    coherence = np.zeros((len(kappa), *distance.shape))
    if not close.all():
        np.exp(-kappa[:, None, None] * distance, out=coherence)
    of_elements = coherence.reshape(len(kappa), *by_element)  # a view
    for i, j in np.argwhere(close).tolist():
        of_elements[:, i, :, j] = cable[i].mean_with(kappa, other[j])
    return coherence


def coherence_of_chords(kappa, cable):
    """Correction to the coherence of the gusts on one cable: for straight distances r instead of a along the cable.

    `Strips.gust_covariance` takes the coherence of two places as exp(-kappa a); it is exp(-kappa r). The mean of the
    difference, for each pair of load functions g of the cable (`Arc.functions`), is

        double integral of g_i(s) g_j(t) (exp(-kappa r(s, t)) - exp(-kappa a(s, t))) ds dt

    It is smooth, since both distances are nearly equal where they are short.

    Parameters
    ----------
    kappa : ndarray, shape (f,)
        Decay of the coherence at each of f frequencies. [1/m]
    cable : list of Arc
        Elements of the cable, with q functions in all.

    Returns
    -------
    ndarray, shape (f, q, q)
        [-]
    """
    elements, count = len(cable), len(cable[0].points)
    positions, weights = gauss(WIND.chord_points * count - 1)  # of an integral over an element
    by_function = cable[0].functions(positions) * weights[:, None]
    places = np.concatenate([arc.places(positions) for arc in cable])
    lengths = np.array([arc.arc_lengths(np.append(positions, 1.0)) for arc in cable])  # and of whole elements, the last
    before = np.cumsum(lengths[:, -1]) - lengths[:, -1]  # length of all elements before each
    along = (before[:, None] + lengths[:, :-1]).ravel()
    straight, curved = size(places[:, None] - places), np.abs(along[:, None] - along)
    # exp(-b) - exp(-a) = -exp(-b) (exp(b - a) - 1), with the digits of a small difference
    change = -np.exp(-kappa[:, None, None] * straight) * np.expm1(kappa[:, None, None] * (straight - curved))
    of_elements = change.reshape(len(kappa), elements, len(positions), elements, len(positions)).swapaxes(2, 3)
    means = by_function.T @ (of_elements @ by_function)  # (f, elements, elements, count, count)
    return means.swapaxes(2, 3).reshape(len(kappa), elements * count, elements * count)


def coherence_with_points(kappa, places, cable):
    """Mean coherence of points at `places`, shape (b, 3), and functions of a cable, list of Arc: shape (f, b, q)."""
    return np.concatenate([arc.mean_with_points(kappa, places) for arc in cable], axis=-1)


def _sinh_rule(count, center, scale):
    """Points and weights of quadrature over t from 0 to 1, for a polynomial times a function with a narrow peak.

    In the variable u of t = center + scale sinh(u) the peak is broad. The points are those of a Gauss rule in u, closer
    together at the ends. If one of the peaks is narrower than `WIND.narrow_peak`, all of them count as kinks: each side
    of a kink then has all points of the rule. `count` is the number of coefficients of the polynomial; `center` and
    `scale` have the shape (...) of many rules, points and weights (..., q).
    """
    points, weights = _ends_refined(max(count + WIND.load_points, WIND.peak_points))
    kinked = np.any(scale < WIND.narrow_peak)
    center = (np.clip(center, 0, 1) if kinked else center)[..., None]
    scale = np.clip(scale, WIND.narrow_peak, WIND.broad_peak)[..., None]
    low, high = np.arcsinh(-center / scale), np.arcsinh((1 - center) / scale)
    positions, shares = [], []
    for begin, end in [(0.0, low), (0.0, high)] if kinked else [(low, high)]:
        u = begin + (end - begin) * points
        positions.append(center + scale * np.sinh(u))
        shares.append(scale * np.cosh(u) * np.abs(end - begin) * weights)
    return np.concatenate(positions, axis=-1), np.concatenate(shares, axis=-1)


@cache
def _ends_refined(count):
    """Gauss points and weights on [0, 1], closer together at the ends, shape (count,) both."""
    x, weights = gauss(count - 1)
    return (x + x**2 * (3 - 2 * x)) / 2, (1 + 6 * x * (1 - x)) / 2 * weights
