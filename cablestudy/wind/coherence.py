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
    panels_per_decade : int
        Number of panels of frequency in a decade by which such a spline is integrated.
    error : float
        Relative error of a variance by both. [-]
    """

    kappa: Callable
    per_decade: int
    panels_per_decade: int
    error: float

    @property
    def least_kappa(self):
        """The least kappa, that of slow gusts. [1/m]"""
        return float(self.kappa(np.zeros(1))[0])

    @property
    def constant(self):
        """True if kappa is the same at all frequencies."""
        return bool(self.kappa(np.ones(1))[0] == self.least_kappa)


def decayed(decay):
    """exp(-decay), of which no more than `WIND.largest_decay` counts."""
    exponent = np.minimum(decay, WIND.largest_decay)
    return np.exp(np.negative(exponent, out=exponent), out=exponent)  # in place: of large arrays twice as fast


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
class Rods:
    """Eigenfunctions of n cables as rods with free ends, by which covariances of the gusts along a cable are sums.

    The coherence exp(-r/l) over a distance r is Green's function of such a rod (module's docstring). The eigenfunctions
    are orthonormal over the stretched length of each cable, which counts as 1; loads on the cable are expanded in r of
    them.
    """

    square: np.ndarray  # eigenvalues, the integral of the squared slope of each function, shape (n, r)
    ends: np.ndarray  # values of each function at both ends, shape (n, r, 2)
    length: np.ndarray  # stretched over unstretched length, shape (n,)
    shapes: np.ndarray  # values of each function at the nodes, shape (n, nodes, r)

    def covariance(self, loads, ratio):
        """Covariances of all pairs of loads on a cable in gusts whose coherence is exp(-kappa times distance).

        With x and y from 0 to 1 along the cable, two loads per length p_i and p_j, and rho = `ratio`:

            I_ij = double integral of p_i(x) p_j(y) exp(-rho |x - y|) dx dy, summed over the components of the wind

        Parameters
        ----------
        loads : ndarray, shape (n, c, i, r)
            Coefficients of i loads on each of n cables: the integral over x of the load times each of r eigenfunctions.
            Each of the c components of the wind, which are uncorrelated, has its own loads.
        ratio : ndarray, shape (n, m)
            rho: stretched length of each cable times kappa, at each of m frequencies. [-]

        Returns
        -------
        ndarray, shape (n, m, i, i)
            I, for a length of 1 of each cable.

        Notes
        -----
        exp(-rho |x - y|) is twice the inverse of K, the stiffness of a rod on an elastic bed with a spring at either
        end: in the eigenfunctions K = diag(square/rho + rho) + v0 v0^T + v1 v1^T, with the values v0 and v1 of the
        functions at the two ends. So I = 2 loads K^-1 loads^T. K is inverted by Woodbury's formula, with the even and
        the odd combination of v0 and v1. The constant function, whose slope is zero, is treated apart.
        """
        ratio = np.maximum(ratio, WIND.least_length_ratio)
        inverse = 1 / (self.square[:, None, 1:] / ratio[..., None] + ratio[..., None])  # of diagonals, (n, m, r - 1)
        sums, weights = self._of_springs(loads, ratio, inverse)
        weighted, sums = (part.reshape(*part.shape[:3], -1) for part in (sums @ weights[:, :, None], sums))
        half = weighted @ np.swapaxes(sums, -1, -2)  # of I, (n, m, i, i)
        others = np.moveaxis(loads[..., 1:], -1, 1)  # (n, r - 1, c, i)
        for of_cable, inverse_of_cable, loads_of_cable in zip(half, inverse, others, strict=True):
            _add_products(of_cable, inverse_of_cable, loads_of_cable)
        return 2 * half

    def _of_springs(self, loads, ratio, inverse):
        """Part of `covariance` by the springs at the ends of the rods, and by the constant function.

        `loads`, shape (n, c, i, r), are the coefficients of the loads; `ratio`, shape (n, m), is rho. `inverse`, shape
        (n, m, r - 1), is the inverse of K without springs, a diagonal matrix, for all functions but the constant one.

        Returns
        -------
        sums : ndarray, shape (n, m, i, c, 3)
        weights : ndarray, shape (n, m, 3, 3)
            I/2 is sums weights sums^T + loads `inverse` loads^T, each summed over the components.
        """
        constant, others = loads[..., :1], loads[..., 1:]
        constant_at_end = self.ends[:, :1, 0]
        even_and_odd = self.ends[:, 1:] @ np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
        even, odd = np.moveaxis(even_and_odd, -1, 0)[:, :, None]  # (n, 1, r - 1) each
        # the symmetric 2 x 2 matrix of Woodbury's formula, shape (n, m) each
        even_even, odd_odd = 1 + (inverse * even**2).sum(axis=-1), 1 + (inverse * odd**2).sum(axis=-1)
        even_odd = (inverse * (even * odd)).sum(axis=-1)
        determinant = even_even * odd_odd - even_odd**2
        by_even, by_odd = (others @ np.swapaxes(inverse * one, 1, 2)[:, None] for one in (even, odd))  # (n, c, i, m)
        of_even = (np.sqrt(2) * constant_at_end * odd_odd / determinant)[:, None, None]
        of_odd = (np.sqrt(2) * constant_at_end * even_odd / determinant)[:, None, None]
        by_constant = constant - of_even * by_even + of_odd * by_odd
        weights = np.zeros((*ratio.shape, 3, 3))
        weights[..., 0, 0] = 1 / (ratio + 2 * constant_at_end**2 * odd_odd / determinant)
        weights[..., 1, 1] = -(odd_odd / determinant)
        weights[..., 2, 2] = -(even_even / determinant)
        weights[..., 1, 2] = weights[..., 2, 1] = even_odd / determinant
        return np.stack([by_constant, by_even, by_odd], axis=-1).transpose(0, 3, 2, 1, 4), weights


def _add_products(covariance, diagonals, loads):
    """Add the products loads^T D loads with m diagonal matrices D, summed over c components, in place.

    `covariance` has the shape (m, i, i). The products are symmetric: entries on the diagonal and to the right of it are
    computed, then mirrored. `diagonals` have the shape (m, r), `loads` (r, c, i).
    """
    functions, _, size = loads.shape
    at_once = max(1, WIND.coherence_entries // max(1, size * functions))  # rows whose products caches hold
    for begin in range(0, size, at_once):
        rows, right, below = slice(begin, begin + at_once), slice(begin, size), slice(begin + at_once, size)
        by_function = np.swapaxes(loads[..., rows], 1, 2) @ loads[..., right]
        products = diagonals @ by_function.reshape(functions, -1)
        products = products.reshape(len(products), -1, size - begin)
        covariance[:, rows, right] += products
        covariance[:, below, rows] += np.swapaxes(products[..., at_once:], 1, 2)


def rods(mesh, stretch):
    """The `Rods` of n cables with the stretch |r'| at the Gauss points of their elements, shape (n, e, p). [-]"""
    functions = np.eye(mesh.nodes)
    if mesh.nodes > WIND.coherence_functions:
        count = min(WIND.coherence_functions, mesh.nodes // 2)
        x = mesh.node_positions[:, None]
        # cosines have no slope at the ends: two more functions give them any
        functions = np.concatenate([np.cos(np.pi * x * np.arange(count - 2)), x, x**2], axis=1)
        if np.ptp(mesh.sizes):  # large elements may have too few nodes to tell all of them apart
            functions = _independent(functions)
    length, stiffness, mass = galerkin(mesh, stretch, functions)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    transposed = np.swapaxes(inverse, -1, -2)
    square, vectors = np.linalg.eigh(inverse @ stiffness @ transposed)
    shapes = functions @ (transposed @ vectors)
    square = np.maximum(square, 0.0)
    square[:, 0] = 0.0  # the constant
    return Rods(square, np.swapaxes(shapes[:, [0, -1]], 1, 2), length, shapes)


def _independent(functions):
    """Orthonormal combinations of functions by their values at the nodes, without those that vanish at all nodes."""
    combined, sizes, _ = np.linalg.svd(functions, full_matrices=False)
    return combined[:, sizes > WIND.dependent_functions * sizes[0]]


def gauss(order):
    """Gauss points of an element on [0, 1], one more than those of its tension, and their weights, shape (q,) each."""
    return basis(order + 1).points, basis(order + 1).weights


def galerkin(mesh, stretch, functions):
    """Matrices, by Galerkin's method, of the rods that give the covariance of gusts along n cables (see `Rods`).

    With r functions phi along a cable, and x along its stretched length, which counts as 1,

        stiffness_ij = integral of phi_i' phi_j' dx,   mass_ij = integral of phi_i phi_j dx

    `stretch`, shape (n, e, p), is the local stretched over unstretched length at the p Gauss points of the e elements
    of the mesh, and `functions`, shape (nodes, r), has phi at all nodes. Returned are the stretched over unstretched
    length of each cable, shape (n,), stiffness and mass, shape (n, r, r) both.
    """
    element, (points, weights) = basis(mesh.order), gauss(mesh.order)
    interpolation, nodal = lagrange(element.points, points), functions[mesh.element_nodes]
    values, slopes = lagrange(element.nodes, points) @ nodal, interpolation @ element.derivative @ nodal
    stretch, sizes = stretch @ interpolation.T, mesh.sizes[:, None]
    length = (sizes * weights * stretch).sum(axis=(1, 2))
    mass_weights = sizes * weights * stretch / length[:, None, None]
    stiffness_weights = weights / (sizes * stretch) * length[:, None, None]
    return length, _products(slopes, stiffness_weights), _products(values, mass_weights)


def _products(fields, weights):
    """Sums of products of r fields at q points of e elements, (e, q, r), with n weights each, (n, e, q): (n, r, r)."""
    roots = (np.sqrt(of_cable)[..., None] * fields for of_cable in weights)
    flat = [root.reshape(-1, root.shape[-1]) for root in roots]
    return np.stack([root.T @ root for root in flat])
