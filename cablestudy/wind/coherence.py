"""Coherence of turbulence over distance, and the variance of a sum of forces along a cable under it.

The cross-spectrum of the wind at two points a distance r apart along the cable is S exp(-r/l), with a coherence length
l that falls with frequency. The variance of an integral of g over the cable is then

    I = integral of g(a) g(b) exp(-|a - b|/l) da db.

exp(-r/l) is Green's function of a rod: y = integral of exp(-|a - b|/l) g(b) db solves y/l^2 - y'' = 2 g/l with
y' = y/l at the near end and y' = -y/l at the far one. So y comes from the cable's own shape functions by Galerkin's
method, right for any l against the size of an element: I goes to the square of the integral of g for a long l, to 2 l
times the integral of g^2 for a short one. The eigenvectors of the rod with free ends, once found, leave a sum for
each frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cablestudy.cable.assembly import add_elements
from cablestudy.cable.element import basis, lagrange
from cablestudy.wind.tolerances import WIND

DECAY, LARGE_SCALE = 12.0, 0.12  # of the exponential model of IEC 61400-1


@dataclass(frozen=True)
class Coherence:
    """The coherence exp(-kappa r) at two places a distance r apart, and how covariances under it are interpolated.

    Attributes
    ----------
    kappa : callable
        Of frequencies, shape (f,) [Hz] -> shape (f,), ascending. [1/m]
    per_decade : int
        Values of kappa at which a covariance is computed; between them it is a spline.
    error : float
        Of a variance by it.
    """

    kappa: Callable
    per_decade: int
    error: float

    @property
    def least(self):
        """kappa of slow gusts. [1/m]"""
        return float(self.kappa(np.zeros(1))[0])

    @property
    def constant(self):
        """True if it is the same at all frequencies."""
        return bool(self.kappa(np.ones(1))[0] == self.least)


def davenport(wind):
    """`Coherence` exp(-C f r/U) of the turbulence on a suspension; `wind` has speed [m/s] and coherence_decay C."""
    return Coherence(lambda frequency: wind.coherence_decay * frequency / wind.speed, *WIND.coarse_coherence)


def along_cable(wind):
    """`Coherence` of the wind along one cable.

    Parameters
    ----------
    wind : Wind
        Has speed, length_scale and coherence_length, None for the model of IEC 61400-1.

    Notes
    -----
    Without a given length it is exp(-12 sqrt((f r/v)^2 + (0.12 r/L)^2)): IEC 61400-1, ed. 3 (2005), annex B.
    """
    if wind.coherence_length is not None:
        return Coherence(lambda frequency: np.full(len(frequency), 1 / wind.coherence_length), *WIND.fine_coherence)
    slow = LARGE_SCALE * wind.speed / wind.length_scale
    return Coherence(lambda frequency: DECAY / wind.speed * np.hypot(frequency, slow), *WIND.fine_coherence)


@dataclass(frozen=True)
class Rod:
    """Functions in which loads along a cable are expanded, orthonormal over its stretched length, counted as 1."""

    square: np.ndarray  # integral of the squared slope of each function, shape (r,)
    ends: np.ndarray  # values of each function at both ends, shape (r, 2)
    length: float  # stretched over unstretched length
    shapes: np.ndarray  # values of each function at the nodes, shape (nodes, r)

    def covariance(self, loads, ratio):
        """I between pairs of real loads that are coherent over some length.

        Parameters
        ----------
        loads : ndarray, shape (c, i, r)
            Integrals of i loads by c uncorrelated components times each function.
        ratio : ndarray, shape (m,)
            The cable's length over the coherence length. [-]

        Returns
        -------
        ndarray, shape (m, i, i)
            Sum over the components, the cable's length counted as 1.
        """
        ratio = np.maximum(ratio, WIND.least_length_ratio)[:, None]
        found = np.zeros((len(ratio), loads.shape[1], loads.shape[1]))
        for load in loads:
            inner, sums, others, (by_constant, first, second, mixed) = self._parts(load, ratio)
            weights = np.zeros((len(ratio), 3, 3))
            weights[:, 0, 0], weights[:, 1, 1], weights[:, 2, 2] = by_constant, -second, -first
            weights[:, 1, 2] = weights[:, 2, 1] = mixed
            sums = np.stack(sums, axis=-1).swapaxes(0, 1)
            found += sums @ weights @ sums.swapaxes(-1, -2)
            for place, root in enumerate(np.sqrt(inner)):  # one by one: all at once they are more than caches hold
                scaled = others * root
                found[place] += scaled @ scaled.T
        return 2 * found

    def _parts(self, load, ratio):
        """Of loads, shape (i, r), for `ratio` of shape (m, 1): what `covariance` is a sum of.

        The rod's inverse without its ends, (m, r - 1); three sums of each load, (i, m); the load but for its constant;
        weights of squares and product of these sums, (m,).
        """
        constant, others = load[:, :1], load[:, 1:]
        inner = 1 / (self.square[1:] / ratio + ratio)
        near, far = self.ends[1:].T
        even, odd = (near + far) / np.sqrt(2), (near - far) / np.sqrt(2)
        # the ends by Woodbury's formula; the constant apart, since only the ends restrain it
        first, second, mixed = 1 + inner @ even**2, 1 + inner @ odd**2, inner @ (even * odd)
        determinant, end = first * second - mixed**2, self.ends[0, 0]
        f, g = others @ (inner * even).T, others @ (inner * odd).T
        left = constant - end * np.sqrt(2) * (second * f - mixed * g) / determinant
        by_constant = 1 / (ratio[:, 0] + 2 * end**2 * second / determinant)
        return inner, (left, f, g), others, (by_constant, *(part / determinant for part in (first, second, mixed)))


def rod(mesh, stretch):
    """The `Rod` of a cable with the stretch |r'| at the Gauss points of its elements, shape (n, p). [-]"""
    from scipy.linalg import eigh

    length, stiffness, mass = galerkin(mesh, stretch)
    if mesh.nodes <= WIND.coherence_functions:
        square, shapes = eigh(stiffness.toarray(), mass.toarray())
    else:
        count = min(WIND.coherence_functions, mesh.nodes // 2)
        place = mesh.node_positions[:, None]
        # cosines have no slope at the ends: two more functions give them any
        smooth = np.concatenate([np.cos(np.pi * place * np.arange(count - 2)), place, place**2], axis=1)
        square, shapes = eigh(smooth.T @ (stiffness @ smooth), smooth.T @ (mass @ smooth))
        shapes = smooth @ shapes
    square = np.maximum(square, 0.0)
    square[0] = 0.0  # the constant
    return Rod(square, shapes[[0, -1]].T, length, shapes)


def gauss(order):
    """Points of an element of an order on [0, 1], one more than has its tension, and their weights, shape (q,) both."""
    return basis(order + 1).points, basis(order + 1).weights


def galerkin(mesh, stretch):
    """The rod of a cable in its shape functions.

    Parameters
    ----------
    mesh : Mesh
        n elements of p + 1 nodes.
    stretch : ndarray, shape (n, p)
        |r'| at the points of the tensions. [-]

    Returns
    -------
    length : float
        Stretched over unstretched.
    stiffness, mass : sparse array, shape (nodes, nodes)
        The stretched length counted as 1.
    """
    element, (points, weights) = basis(mesh.order), gauss(mesh.order)
    values, between = lagrange(element.nodes, points), lagrange(element.points, points)
    slopes, stretched = between @ element.derivative, stretch @ between.T
    length = float((mesh.sizes[:, None] * weights * stretched).sum())
    share = mesh.sizes[:, None] * weights * stretched / length
    flat = weights / (mesh.sizes[:, None] * stretched) * length
    stiffness = add_elements(mesh, 1, slopes.T @ (flat[..., None] * slopes))
    return length, stiffness, add_elements(mesh, 1, values.T @ (share[..., None] * values))
