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
from cablestudy.wind.coherence import decayed, gauss
from cablestudy.wind.tolerances import WIND


def load_points(order):
    """The n Gauss points of loads on an element, on [0, 1], and their weights, shape (n,) both; two on a bar."""
    return gauss(1 if order == 1 else order + WIND.load_points - 1)


@cache
def _over_weights(order):
    """Legendre coefficients of the n functions l_i/w_i, shape (n, n): a function is a column."""
    points, _ = load_points(order)
    return (2 * np.arange(len(points))[:, None] + 1) * legendre.legvander(2 * points - 1, len(points) - 1).T


@cache
def _at_load_points(order):
    """Values and derivatives of the nodal functions of an element at its n load points, shape (n, order + 1) both."""
    element, (points, _) = basis(order), load_points(order)
    return lagrange(element.nodes, points), lagrange(element.points, points) @ element.derivative


@dataclass(frozen=True)
class Arcs:
    """Elements of cables, g of one order, with the positions of their nodes, shape (g, order + 1, 3), global axes. [m]

    An element has n points of loads.
    """

    nodes: np.ndarray

    def __len__(self):
        return len(self.nodes)

    def take(self, index):
        """`Arcs` of some of the elements."""
        return Arcs(self.nodes[index])

    @property
    def order(self):
        """Order of the polynomials of the elements."""
        return self.nodes.shape[1] - 1

    @cached_property
    def points(self):
        """Positions of the points of loads, shape (g, n, 3). [m]"""
        return _at_load_points(self.order)[0] @ self.nodes

    @cached_property
    def slopes(self):
        """Derivatives of the position by that in the element, at these points, shape (g, n, 3). [m]"""
        return _at_load_points(self.order)[1] @ self.nodes

    @cached_property
    def spacing(self):
        """Mean distance of these points in each element, shape (g,). [m]"""
        weights = load_points(self.order)[1]
        return size(self.slopes) @ weights / len(weights)

    def functions(self, positions):
        """The n functions l_i/w_i of every element at positions on [0, 1], shape (...): shape (..., n)."""
        return self._polynomials(positions) @ _over_weights(self.order)

    def places(self, positions):
        """Places at positions on [0, 1], shape (g, ..., q), or (q,) in all elements: shape (g, ..., q, 3). [m]"""
        return self._places(self._polynomials(positions))

    def arc_lengths(self, positions):
        """Arc lengths from the first node to positions on [0, 1], shape (p,), in each element: shape (g, p). [m]"""
        points, _ = load_points(self.order)
        inner, weights = gauss(len(points))
        speed = size(self.slopes) @ lagrange(points, positions[:, None] * inner).reshape(-1, len(points)).T
        return positions * (speed.reshape(len(self), len(positions), -1) @ weights)

    def _polynomials(self, positions):
        """Legendre's polynomials at positions on [0, 1], shape (...): shape (..., n)."""
        return legendre.legvander(2 * positions - 1, len(load_points(self.order)[1]) - 1)

    def _places(self, polynomials):
        """Places where the polynomials, shape (g, ..., q, n), have these values: shape (g, ..., q, 3). [m]"""
        coefficients = (_over_weights(self.order) * load_points(self.order)[1]) @ self.points
        return polynomials @ coefficients.reshape(len(self), *[1] * (polynomials.ndim - 3), *coefficients.shape[1:])

    def mean_with_points(self, kappa, places):
        """Mean coherence of functions of each element and points at `places`, shape (g, p, 3): shape (g, f, p, n)."""
        element, count = np.arange(len(self))[:, None], self.points.shape[1]
        nearest = size(places[:, :, None] - self.points[:, None]).argmin(axis=-1)
        slope, start = self.slopes[element, nearest], load_points(self.order)[0][nearest]
        offset, length = places - self.points[element, nearest], size(slope)
        along = dot(offset, slope) / length**2
        distance = size(offset - along[..., None] * slope) / length
        means = np.zeros((len(self), len(kappa), places.shape[1], count))
        for chosen, *rule in _sinh_rules(count, start + along, distance):
            means[chosen] = self.take(chosen)._means_by(kappa, places[chosen], *rule)
        return means

    def _means_by(self, kappa, places, positions, weights):
        """`mean_with_points` by a rule of q points with these positions and weights, shape (g, p, q)."""
        polynomials = self._polynomials(positions)
        distance = size(places[..., None, :] - self._places(polynomials))
        coherence = decayed(kappa[:, None] * distance[:, :, None])  # (g, p, f, q)
        by_function = (polynomials * weights[..., None]) @ _over_weights(self.order)
        return np.swapaxes(coherence @ by_function, 1, 2)

    def mean_with(self, kappa, other):
        """Mean coherence of the functions of each element and of that of g others, `Arcs`: shape (g, f, n, n')."""
        pair, count = np.arange(len(self)), self.points.shape[1]
        distances = size(self.points[:, :, None] - other.points[:, None])
        i, j = np.unravel_index(distances.reshape(len(self), -1).argmin(axis=1), distances.shape[1:])
        # the tangents at the two closest points as straight cables
        own, its, offset = self.slopes[pair, i], other.slopes[pair, j], self.points[pair, i] - other.points[pair, j]
        offset, across = (part - (dot(part, its) / dot(its, its))[:, None] * its for part in (offset, own))
        square, least = dot(across, across), WIND.parallel_cables**2 * dot(own, own)
        along = -dot(offset, across) / np.maximum(square, least)
        distance = size(offset + along[:, None] * across) / np.sqrt(np.maximum(square, least))
        distance = np.where(square > least, distance, WIND.broad_peak)
        means = np.zeros((len(self), len(kappa), count, other.points.shape[1]))
        peak = load_points(self.order)[0][i] + along
        for chosen, s, weights in _sinh_rules(count, peak[:, None], distance[:, None]):
            arcs, polynomials = self.take(chosen), self._polynomials(s[:, 0])
            by_function = (polynomials * weights[:, 0, :, None]) @ _over_weights(self.order)
            with_points = other.take(chosen).mean_with_points(kappa, arcs._places(polynomials))
            means[chosen] = np.swapaxes(by_function, 1, 2)[:, None] @ with_points
        return means


def coherence_of_cables(kappa, cable, other):
    """Coherence of the gusts on two cables, averaged with each pair of their load functions, at f frequencies.

    Each element of a cable has a polynomial of mean 1 for each of its load points, see `Arcs.functions`. With the
    functions g_i(s) of one cable and h_j(t) of the other, and the distance r between the places s and t, the mean is

        double integral of g_i(s) h_j(t) exp(-kappa r(s, t)) ds dt

    For elements far from each other this is the coherence between the load points i and j. Elements closer than
    `WIND.close_cables` times the spacing of their points are integrated by `Arcs.mean_with`.

    Parameters
    ----------
    kappa : ndarray, shape (f,)
        Decay at each frequency: the coherence at a distance r is exp(-kappa r). [1/m]
    cable, other : Arcs
        Elements of two cables, or of several. All elements of `cable` have q functions in all, those of `other` p.

    Returns
    -------
    ndarray, shape (f, q, p)
        The mean for each pair of functions i and j. [-]
    """
    places, others = cable.points.reshape(-1, 3), other.points.reshape(-1, 3)  # of the load points, (q, 3) and (p, 3)
    distance = size(places[:, None] - others)
    # both axes of points, q and p, as elements and the points of each
    by_element = len(cable), cable.points.shape[1], len(other), other.points.shape[1]
    least_distance = distance.reshape(by_element).min(axis=(1, 3))
    close = least_distance < WIND.close_cables * np.maximum.outer(cable.spacing, other.spacing)
    if min(cable.order, other.order) == 1:  # bars are many, with two points each
        close[:] = False
    coherence = np.zeros((len(kappa), *distance.shape))
    if not close.all():
        coherence[:] = decayed(kappa[:, None, None] * distance)
    of_elements = coherence.reshape(len(kappa), *by_element)  # a view
    at_once = max(1, WIND.coherence_entries // (len(kappa) * WIND.peak_points**2))  # pairs whose arrays caches hold
    pairs = np.argwhere(close)
    for begin in range(0, len(pairs), at_once):
        i, j = pairs[begin : begin + at_once].T
        of_elements[:, i, :, j] = cable.take(i).mean_with(kappa, other.take(j))
    return coherence


def coherence_of_chords(kappa, cable):
    """Correction to the coherence of the gusts on one cable: for straight distances r instead of a along the cable.

    `Strips.gust_covariance` takes the coherence of two places as exp(-kappa a); it is exp(-kappa r). The mean of the
    difference, for each pair of load functions g of the cable (`Arcs.functions`), is

        double integral of g_i(s) g_j(t) (exp(-kappa r(s, t)) - exp(-kappa a(s, t))) ds dt

    It is smooth, since both distances are nearly equal where they are short.

    Parameters
    ----------
    kappa : ndarray, shape (f,)
        Decay of the coherence at each of f frequencies. [1/m]
    cable : Arcs
        Elements of the cable, with q functions in all.

    Returns
    -------
    ndarray, shape (f, q, q)
        [-]
    """
    elements, count = cable.points.shape[:2]
    positions, weights = gauss(WIND.chord_points * count - 1)  # of an integral over an element
    by_function = cable.functions(positions) * weights[:, None]
    places = cable.places(positions).reshape(-1, 3)
    lengths = cable.arc_lengths(np.append(positions, 1.0))  # and of whole elements, the last
    before = np.cumsum(lengths[:, -1]) - lengths[:, -1]  # length of all elements before each
    along = (before[:, None] + lengths[:, :-1]).ravel()
    first, second = np.triu_indices(len(along), 1)
    straight, curved = size(places[first] - places[second]), along[second] - along[first]
    # exp(-b) - exp(-a) = -exp(-b) (exp(b - a) - 1), with the digits of a small difference
    change = np.zeros((len(kappa), len(along), len(along)))  # to the right of the diagonal: half of what is symmetric
    change[:, first, second] = -decayed(kappa[:, None] * straight) * np.expm1(kappa[:, None] * (straight - curved))
    of_elements = change.reshape(len(kappa), elements, len(positions), elements, len(positions)).swapaxes(2, 3)
    means = by_function.T @ (of_elements @ by_function)  # (f, elements, elements, count, count)
    means = means.swapaxes(2, 3).reshape(len(kappa), elements * count, elements * count)
    return means + np.swapaxes(means, 1, 2)


def coherence_with_points(kappa, places, cable):
    """Mean coherence of points at `places`, shape (b, 3), and functions of elements, `Arcs`: shape (f, b, q)."""
    means = cable.mean_with_points(kappa, np.broadcast_to(places, (len(cable), *places.shape)))
    return np.moveaxis(means, 0, 2).reshape(len(kappa), len(places), -1)


def _sinh_rules(count, center, scale):
    """Points and weights of quadrature over t from 0 to 1, for a polynomial times a function with a narrow peak.

    In the variable u of t = center + scale sinh(u) the peak is broad. The points are those of a Gauss rule in u, closer
    together at the ends. If one of the p peaks of an element is narrower than `WIND.narrow_peak`, all of them count as
    kinks: each side of a kink then has all points of the rule. `count` is the number of coefficients of the polynomial;
    `center` and `scale` have the shape (g, p) of many rules.

    Yields
    ------
    chosen : ndarray of int, shape (k,)
        Elements whose rules have equally many points.
    positions, weights : ndarray, shape (k, p, q)
    """
    points, weights = _ends_refined(max(count + WIND.load_points, WIND.peak_points))
    with_kinks = (scale < WIND.narrow_peak).any(axis=1)
    for kinked in np.unique(with_kinks).tolist():
        chosen = np.flatnonzero(with_kinks == kinked)
        middle = (np.clip(center[chosen], 0, 1) if kinked else center[chosen])[..., None]
        width = np.clip(scale[chosen], WIND.narrow_peak, WIND.broad_peak)[..., None]
        low, high = np.arcsinh(-middle / width), np.arcsinh((1 - middle) / width)
        positions, shares = [], []
        for begin, end in [(0.0, low), (0.0, high)] if kinked else [(low, high)]:
            u = begin + (end - begin) * points
            positions.append(middle + width * np.sinh(u))
            shares.append(width * np.cosh(u) * np.abs(end - begin) * weights)
        yield chosen, np.concatenate(positions, axis=-1), np.concatenate(shares, axis=-1)


@cache
def _ends_refined(count):
    """Gauss points and weights on [0, 1], closer together at the ends, shape (count,) both."""
    x, weights = gauss(count - 1)
    return (x + x**2 * (3 - 2 * x)) / 2, (1 + 6 * x * (1 - x)) / 2 * weights
