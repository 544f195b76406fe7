"""Coherence of turbulence over distance, and the variance of a sum of forces along a cable under it.

The cross-spectrum of the wind at two points a distance r apart along the cable is S exp(-r/l), with a coherence length
l = 1/kappa that falls with frequency. The spectrum of the integral of the wind times g over the cable is then S I,

    I = integral of g(a) g(b) exp(-|a - b|/l) da db.

exp(-r/l) is Green's function of a rod: y = integral of exp(-|a - b|/l) g(b) db solves y/l^2 - y'' = 2 g/l with
y' = y/l at the near end and y' = -y/l at the far one. So y comes from the cable's own shape functions by Galerkin's
method, right for any l against the size of an element: I goes to the square of the integral of g for a long l, to 2 l
times the integral of g^2 for a short one. In the eigenfunctions of the rod with free ends, found once for a cable, I is
a sum at each frequency.
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
    """Coherence exp(-kappa r) of the wind at two points a distance r apart, and how covariances are interpolated.

    Attributes
    ----------
    kappa : callable
        Frequencies, shape (f,) [Hz] -> kappa, shape (f,), ascending. [1/m]
    per_decade : int
        Number of values of kappa in a decade at which a covariance is computed; between them it is a spline.
    error : float
        Relative error of a variance by the spline. [-]
    """

    kappa: Callable
    per_decade: int
    error: float

    @property
    def least_kappa(self):
        """The least kappa, that of slow gusts. [1/m]"""
        return float(self.kappa(np.zeros(1))[0])

    @property
    def constant(self):
        """True if kappa is the same at all frequencies."""
        return bool(self.kappa(np.ones(1))[0] == self.least_kappa)


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
    slow = LARGE_SCALE * wind.speed / wind.length_scale  # frequency below which kappa is about constant
    return Coherence(lambda frequency: DECAY / wind.speed * np.hypot(frequency, slow), *WIND.fine_coherence)


@dataclass(frozen=True)
class Rod:
    """Eigenfunctions of the rod of a cable with free ends (module's docstring), in which loads along it are expanded.

    They are orthonormal over the stretched length of the cable, which counts as 1.
    """

    square: np.ndarray  # eigenvalues, the integral of the squared slope of each function, shape (r,)
    ends: np.ndarray  # values of each function at both ends, shape (r, 2)
    length: float  # stretched over unstretched length
    shapes: np.ndarray  # values of each function at the nodes, shape (nodes, r)

    def covariance(self, loads, ratio):
        """Integrals I of the module's docstring for pairs of loads, under the coherence exp(-kappa r).

        Parameters
        ----------
        loads : ndarray, shape (c, i, r)
            Integral over the cable of each of i loads, by each of c uncorrelated components of the wind, times each of
            the r eigenfunctions.
        ratio : ndarray, shape (m,)
            The cable's stretched length times kappa. [-]

        Returns
        -------
        ndarray, shape (m, i, i)
            Sum over the components, the cable's length counted as 1.
        """
        ratio = np.maximum(ratio, WIND.least_length_ratio)[:, None]
        covariance = np.zeros((len(ratio), loads.shape[1], loads.shape[1]))
        for load in loads:
            inverse, others, sums, weights = self._covariance_terms(load, ratio)
            covariance += sums @ weights @ sums.swapaxes(-1, -2)
            for index, root in enumerate(np.sqrt(inverse)):  # one by one: all at once they are more than caches hold
                scaled = others * root
                covariance[index] += scaled @ scaled.T
        return 2 * covariance

    def _covariance_terms(self, load, ratio):
        """Parts of half of the covariance of i loads, shape (i, r), for m ratios, shape (m, 1).

        With rho = ratio, that is length/l, the rod has the matrix K = diag(square/rho + rho) + v0 v0^T + v1 v1^T, v0
        and v1 being the functions at its ends, and I = 2 load K^-1 load^T. K is inverted by Woodbury's formula, with
        the even and the odd combination of v0 and v1. The constant function, without slope, is treated apart.

        Returns
        -------
        inverse : ndarray, shape (m, r - 1)
            Diagonal of the inverse of diag(square/rho + rho), without the constant function.
        others : ndarray, shape (i, r - 1)
            The loads without the constant function.
        sums : ndarray, shape (m, i, 3)
            Remainder of the constant part of each load, and its products with the even and the odd combination.
        weights : ndarray, shape (m, 3, 3)
            Half of the covariance is others inverse others^T + sums weights sums^T.
        """
        constant, others = load[:, :1], load[:, 1:]
        inverse = 1 / (self.square[1:] / ratio + ratio)
        end_1, end_2 = self.ends[1:].T
        even, odd = (end_1 + end_2) / np.sqrt(2), (end_1 - end_2) / np.sqrt(2)
        # the 2 x 2 matrix of Woodbury's formula, [[a, b], [b, c]]
        a, b, c = 1 + inverse @ even**2, inverse @ (even * odd), 1 + inverse @ odd**2
        determinant, constant_at_end = a * c - b**2, self.ends[0, 0]
        by_even, by_odd = others @ (inverse * even).T, others @ (inverse * odd).T
        remainder = constant - constant_at_end * np.sqrt(2) * (c * by_even - b * by_odd) / determinant
        weights = np.zeros((len(ratio), 3, 3))
        weights[:, 0, 0] = 1 / (ratio[:, 0] + 2 * constant_at_end**2 * c / determinant)
        weights[:, 1, 1], weights[:, 2, 2] = -(c / determinant), -(a / determinant)
        weights[:, 1, 2] = weights[:, 2, 1] = b / determinant
        return inverse, others, np.stack([remainder, by_even, by_odd], axis=-1).swapaxes(0, 1), weights


def rod(mesh, stretch):
    """The `Rod` of a cable with the stretch |r'| at the Gauss points of its elements, shape (n, p). [-]"""
    from scipy.linalg import eigh

    length, stiffness, mass = galerkin(mesh, stretch)
    if mesh.nodes <= WIND.coherence_functions:
        square, shapes = eigh(stiffness.toarray(), mass.toarray())
    else:
        count = min(WIND.coherence_functions, mesh.nodes // 2)
        x = mesh.node_positions[:, None]
        # cosines have no slope at the ends: two more functions give them any
        smooth = np.concatenate([np.cos(np.pi * x * np.arange(count - 2)), x, x**2], axis=1)
        square, shapes = eigh(smooth.T @ (stiffness @ smooth), smooth.T @ (mass @ smooth))
        shapes = smooth @ shapes
    square = np.maximum(square, 0.0)
    square[0] = 0.0  # the constant
    return Rod(square, shapes[[0, -1]].T, length, shapes)


def gauss(order):
    """Gauss points of an element on [0, 1], one more than those of its tension, and their weights, shape (q,) each."""
    return basis(order + 1).points, basis(order + 1).weights


def galerkin(mesh, stretch):
    """Matrices of the rod of a cable (module's docstring) in the shape functions of its mesh, by Galerkin's method.

    Parameters
    ----------
    mesh : Mesh
        n elements of p + 1 nodes.
    stretch : ndarray, shape (n, p)
        |r'| of the cable at the Gauss points of its elements. [-]

    Returns
    -------
    length : float
        Stretched over unstretched length. [-]
    stiffness, mass : sparse array, shape (nodes, nodes)
        Integrals of products of the slopes of two functions, and of their values, over the stretched length, which
        counts as 1. [-]
    """
    element, (points, weights) = basis(mesh.order), gauss(mesh.order)
    values, interpolation = lagrange(element.nodes, points), lagrange(element.points, points)
    slopes, stretch = interpolation @ element.derivative, stretch @ interpolation.T
    length = float((mesh.sizes[:, None] * weights * stretch).sum())
    mass_weights = mesh.sizes[:, None] * weights * stretch / length
    stiffness_weights = weights / (mesh.sizes[:, None] * stretch) * length
    stiffness = add_elements(mesh, 1, slopes.T @ (stiffness_weights[..., None] * slopes))
    return length, stiffness, add_elements(mesh, 1, values.T @ (mass_weights[..., None] * values))
