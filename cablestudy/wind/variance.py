"""Variances of the outputs of a linear system that turbulence drives, by its poles.

With the response y = [D + sum over j of c_j b_j/(s - l_j)] u of the outputs to the inputs, a sum over the poles l_j
(`system.residues`), and the one-sided spectral matrix S(f) of the inputs, the covariance X of the amplitudes of the
poles solves Lyapunov's equation with coloured noise,

    l_j X_jk + X_jk conj(l_k) = -(H_jk + conj(H_kj)),   H_jk = integral of r_j b_j S conj(b_k)^T df,
    r_j = 1/(i w - l_j) + 1/(-i w - l_j) = -2 l_j/(w^2 + l_j^2),

since (i w - l_j)^-1 (-i w - conj(l_k))^-1 is a sum of two fractions. S is smooth: it is a sum of matrices times
functions of frequency. Narrow peaks are in r_j alone, and Gauss's rule on each panel of frequency is corrected for
them.

A complex stiffness has a response for positive frequencies alone, and its poles are no pairs: r_j is then
2/(i w - l_j), the sums run over all poles, and the real part is the variance.

The response of a system with a delay has a remainder in addition to such a sum: `variances_with_remainder`.

Arrays may have leading axes, of many rows (...).
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.matrices import product
from cablestudy.wind.tolerances import WIND

NODES, WEIGHTS = np.polynomial.legendre.leggauss(WIND.panel_points)
LEGENDRE = np.polynomial.legendre.legvander(NODES, WIND.panel_points - 1)  # polynomials at the nodes, by their degree
LAST = np.polynomial.legendre.legval(NODES, np.eye(WIND.panel_points)[-1])  # the last one, to the last digit
# coefficients of the two highest ones by values at the nodes
HIGHEST = LEGENDRE[:, -2:] * (WIND.panel_points - np.array([1.5, 0.5])) * WEIGHTS[:, None]


@dataclass(frozen=True)
class Noise:
    """Inputs with the spectral matrix sum over k of E(f) g_k(f) S_k E(f), S_k constant matrices.

    Attributes
    ----------
    matrices : ndarray, shape (..., p, i, i)
        S_k, symmetric.
    groups : list of slice
        Groups of inputs that have one function e of frequency each: E = diag(e).
    functions : list of list of ndarray, shape (..., p, n)
        e_j e_l g_k for groups j and l at n frequencies.
    """

    matrices: np.ndarray
    groups: list
    functions: list

    def times(self, columns, batch=slice(None)):
        """The spectral matrix at a batch of f of the frequencies times complex columns, shape (f, i, c), of one row."""
        total = np.zeros(columns.shape, dtype=complex)
        for rows, functions in zip(self.groups, self.functions, strict=True):
            for others, function in zip(self.groups, functions, strict=True):
                matrix = np.tensordot(function[:, batch], self.matrices[:, rows, others], axes=(0, 0))
                total[:, rows] += product(matrix, columns[:, others])
        return total


def with_turns(edges, delay):
    """Edges [Hz], and further ones between which the phase of a delay [s] turns by `WIND.delay_in_panel`."""
    if not delay:
        return edges
    turns = WIND.delay_in_panel * np.arange(1, WIND.delay_panels) / (2 * np.pi * delay)
    turns = turns[(turns > edges[0]) & (turns < edges[-1])]
    distance = np.abs(np.log(turns / edges[:, None])).min(axis=0)  # to the nearest edge
    return np.sort(np.concatenate([edges, turns[distance > WIND.panel_edges]]))


def smooth_on(edges, functions):
    """Halve panels of frequency until Gauss's rule resolves all of some smooth functions: edges, ascending. [Hz]

    A function is resolved on a panel if its two highest Legendre coefficients are at most `WIND.unresolved_panel` times
    its largest value there. A panel that is not resolved after `WIND.panel_halvings` halvings stays as it is.

    Parameters
    ----------
    edges : ndarray
        Edges of panels to begin with, ascending. [Hz]
    functions : sequence of callable
        Frequencies, shape (n,) [Hz] -> values, shape (n,).
    """
    resolved_edges = [edges[-1:]]
    low, high = edges[:-1], edges[1:]
    for _ in range(WIND.panel_halvings):
        middle = np.sqrt(low * high)
        frequency = middle[:, None] * (high / middle)[:, None] ** NODES  # Gauss points in log frequency
        rough = np.zeros(len(low), dtype=bool)
        for function in functions:
            value = function(frequency.ravel()).reshape(frequency.shape)
            rough |= np.abs(value @ HIGHEST).max(axis=1) > WIND.unresolved_panel * np.abs(value).max(axis=1)
        resolved_edges.append(low[~rough])
        low, high = np.concatenate([low[rough], middle[rough]]), np.concatenate([middle[rough], high[rough]])
    return np.sort(np.concatenate([*resolved_edges, low]))


class Panels:
    """Gauss points on panels in log frequency; below the lowest panel an integrand counts with its value at that edge.

    Parameters
    ----------
    edges : ndarray, shape (..., k + 1)
        Ascending. [Hz]

    Attributes
    ----------
    frequency, weights : ndarray, shape (..., n)
        Points, and their shares in an integral. [Hz]
    highest : ndarray, shape (...)
        The last edge. [Hz]
    """

    def __init__(self, edges):
        log_edges, lowest = np.log(edges), edges[..., :1]
        self.edges, self.highest = edges, edges[..., -1]
        self._middle, self._half = (log_edges[..., 1:] + log_edges[..., :-1]) / 2, np.diff(log_edges) / 2
        on_panels, points = np.exp(self._middle[..., None] + self._half[..., None] * NODES), (*edges.shape[:-1], -1)
        self.frequency = np.concatenate([on_panels.reshape(points), lowest], axis=-1)
        shares = (self._half[..., None] * WEIGHTS * on_panels).reshape(points)
        self.weights = np.concatenate([shares, lowest], axis=-1)

    def resolvents(self, poles, one_sided=False):
        """Weights for integrals over frequency f of a smooth function times r_j, the peak by one of N poles l_j.

            r_j = -2 l_j/(w^2 + l_j^2),   one-sided: r_j = 2/(i w - l_j),   w = 2 pi f

        Parameters
        ----------
        poles : ndarray, complex, shape (..., N)
            l_j: in the upper half plane or on the real axis; anywhere if one-sided. [rad/s]
        one_sided : bool
            True for poles of a response that is known at positive frequencies alone, by a complex stiffness.

        Returns
        -------
        ndarray, complex, shape (..., N, n)
            The integral is the sum over the n points `frequency` of function times weight, however narrow the peak is.
        """
        omega = 2 * np.pi * self.frequency[..., None, :]
        if one_sided:
            fractions = 2 / (1j * omega - poles[..., None])
        else:
            fractions = -2 * poles[..., None] / (omega**2 + poles[..., None] ** 2)
        fractions *= self.weights[..., None, :]
        *pole, points, factors = self._corrections(poles)
        fractions[(*pole, points)] *= factors
        return fractions

    def weights_for(self, poles):
        """Weights, shape (..., N, n), for functions with a simple pole each at i w = l_j; `poles` as for `resolvents`.

        Notes
        -----
        In z = log f, such a function has a pole at log(l_j/(2 pi i)). Gauss's rule of n points x_i is exact for a
        polynomial over x - z where its weights are multiplied by 1 + n P_(n-1)(x_i) Q_n(z), P and Q being Legendre's
        functions of the first and second kind: Christoffel's sum of (2 k + 1) P_k(x) Q_k(z) (Whittaker and Watson,
        Modern Analysis, 15.4).
        """
        weights = np.empty((*poles.shape, self.weights.shape[-1]), dtype=complex)
        weights[...] = self.weights[..., None, :]
        *pole, points, factors = self._corrections(poles)
        weights[(*pole, points)] *= factors
        return weights

    def _corrections(self, poles):
        """Indices, and factors, of the weights in `weights_for` that are not those of Gauss's rule: list of ndarray."""
        # of each pole for each panel
        z = (np.log(poles / 2j / np.pi)[..., None] - self._middle[..., None, :]) / self._half[..., None, :]
        near = np.abs(z) < WIND.near_pole
        *pole, panel = (index[:, None] for index in np.nonzero(near))
        points = panel * WIND.panel_points + np.arange(WIND.panel_points)
        return *pole, points, 1 + WIND.panel_points * LAST * _legendre_q(z[near])[:, None]


def _legendre_q(z):
    """Q_n(z) of Legendre's functions of the second kind, n = `WIND.panel_points`, z off the segment from -1 to 1."""
    q_below, q = 1.0, np.log((z + 1) / (z - 1)) / 2  # k Q_(k-1) at k = 0, and Q_0
    for k in range(WIND.panel_points):  # (k + 1) Q_(k+1) = (2 k + 1) z Q_k - k Q_(k-1)
        q_below, q = q, ((2 * k + 1) * z * q - (k * q_below if k else 1.0)) / (k + 1)
    return q


def variances(residues, panels, noise, weights):
    """Variances of the outputs of a system driven by noise: integrals of their spectra times each of some weights.

    The spectra are the diagonal of Y S Y^H, with the response Y = D + sum over j of c_j b_j/(s - l_j) and the one-sided
    spectral matrix S of the inputs. By the covariances X of the amplitudes of the poles, which solve Lyapunov's
    equation (module's docstring), such an integral is a sum over pairs of poles, c_j X_jk conj(c_k), and terms with D.

    Parameters
    ----------
    residues : Residues
        Y: response of a stable system of o outputs, with both poles of each complex pair; of rows (...) with equally
        many poles in the upper half plane and on the real axis.
    panels : Panels
        n points of quadrature over frequency.
    noise : Noise
        S.
    weights : ndarray, shape (..., w, n)
        w functions of frequency, at these points.

    Returns
    -------
    ndarray, shape (..., w, o)
        0 where no more than rounding is left of the sum over the poles.
    """
    all_poles, all_inputs, leading = residues.poles, residues.inputs, residues.poles.shape[:-1]
    upper = np.nonzero((all_poles.imag >= 0) | residues.one_sided)[-1].reshape(*leading, -1)
    poles = np.take_along_axis(all_poles, upper, axis=-1)
    inputs = np.take_along_axis(all_inputs, upper[..., None], axis=-2)
    outputs = np.swapaxes(np.take_along_axis(residues.outputs, upper[..., None, :], axis=-1), -1, -2)
    if not residues.one_sided:  # the real part of a pair of poles is twice that of one
        outputs = outputs * np.where(poles.imag > 0, 2.0, 1.0)[..., None]
    # integrals of r_j b_j S and of S
    by_pole, spectra = _spectral_integrals(inputs, panels, noise, weights, panels.resolvents(poles, residues.one_sided))

    def conjugate_transpose(matrix):
        """Of a matrix, or of those of many rows, with an axis for the w weights: shape (..., 1, columns, rows)."""
        return np.swapaxes(matrix.conj(), -1, -2)[..., None, :, :]

    # Lyapunov's equation of the module's docstring
    pole_sums = poles[..., :, None] + all_poles[..., None, :].conj()  # l_j + conj(l_k)
    # X is this plus its conjugate transpose
    covariance = by_pole @ conjugate_transpose(all_inputs) / -pole_sums[..., None, :, :]
    by_outputs, by_direct = conjugate_transpose(residues.outputs), conjugate_transpose(residues.direct)
    pole_output_covariance = covariance @ by_outputs + by_pole @ by_direct
    direct = residues.direct[..., None, :, :]
    of_direct = ((direct @ spectra) * direct.conj()).sum(axis=-1).real
    variance = (outputs[..., None, :, :] * pole_output_covariance).sum(axis=-2).real + of_direct
    # by Schwarz's inequality no sum over the poles is larger than that of the sizes of its terms
    diagonal = np.take_along_axis(covariance, upper[..., None, :, None], axis=-1)[..., 0].real
    largest = (np.sqrt(np.maximum(2 * diagonal, 0.0)) @ np.abs(outputs)) ** 2
    return np.where(variance > WIND.variance_rounding * largest, variance, 0.0)


def variances_with_remainder(residues, remainder, panels, noise, weights):
    """Variances of the outputs of a system with a delay, driven by noise; without a delay, use `variances`.

    The response is a sum over its sharp poles, P, and a remainder, G, that is smooth over frequency. The spectra are
    the diagonal of

        P S P* + 2 Re P S G* + G S G*

    S is the one-sided spectral matrix of the inputs, and * the conjugate transpose. The first term is integrated by
    `variances`, the others by quadrature, in batches of frequencies.

    Parameters
    ----------
    residues : Residues
        P: stable poles, both of each complex pair, without a direct part.
    remainder : callable
        G: s = 2 pi i f, shape (f,) [rad/s] -> complex, shape (f, o, i), for o outputs and i inputs.
    panels : Panels
        n points of quadrature over frequency.
    noise : Noise
        S.
    weights : ndarray, shape (w, n)
        w functions of frequency by which the spectra are multiplied, at these points.

    Returns
    -------
    ndarray, shape (w, o)
        Of each of o outputs, with each of the w weights.
    """
    variance, s = variances(residues, panels, noise, weights), 2j * np.pi * panels.frequency
    fractions = panels.weights_for(residues.poles).T / (s[:, None] - residues.poles)
    for begin in range(0, len(s), WIND.frequencies_at_once):
        batch = slice(begin, begin + WIND.frequencies_at_once)
        g = remainder(s[batch])
        s_g = noise.times(np.swapaxes(g, 1, 2).conj(), batch)  # S G*
        g_s_g = (g * np.swapaxes(s_g, 1, 2)).sum(axis=-1).real * panels.weights[batch, None]
        p_s_g = ((residues.inputs @ s_g) * fractions[batch, :, None] * residues.outputs.T).sum(axis=1)
        variance += weights[:, batch] @ (g_s_g + 2 * p_s_g.real)
    return variance


def _spectral_integrals(inputs, panels, noise, weights, resolvents):
    """Integrals over frequency for `variances`: of r_j b_j S, and of S, times w weights.

    They have the shapes (..., w, N, i) and (..., w, i, i). S is the one-sided spectral matrix of i inputs (`noise`),
    b_j the input vector of each of N poles l_j (`inputs`), and r_j the narrow peak by this pole: -2 l_j/(w^2 + l_j^2),
    or 2/(i w - l_j) for a one-sided response. `resolvents`, shape (..., N, n), are r_j times the weights of the
    quadrature at the n points of the `panels`; `weights` are w functions of frequency there, shape (..., w, n).
    """
    *leading, poles, size = inputs.shape
    count, points = weights.shape[-2:]  # w, n
    real_resolvents = np.concatenate([resolvents.real, resolvents.imag], axis=-2)  # (..., 2 N, n)
    by_pole = np.zeros((*leading, poles, count, size), dtype=complex)
    spectra = np.zeros((*leading, count, size, size))
    for row_group, functions in zip(noise.groups, noise.functions, strict=True):
        for column_group, function in zip(noise.groups, functions, strict=True):
            matrices = noise.matrices[..., row_group, column_group]  # p of them
            weighted = weights[..., :, None, :] * function[..., None, :, :]  # (..., w, p, n)
            by_point = np.swapaxes(weighted.reshape(*leading, -1, points), -1, -2)  # (..., n, w p)
            with_resolvents = (real_resolvents @ by_point).reshape(*leading, 2, poles, count, function.shape[-2])
            by_pole[..., column_group] += _times_matrices(inputs[..., row_group], matrices, with_resolvents)
            integrals = (weighted @ panels.weights[..., None, :, None])[..., 0]  # (..., w, p)
            of_matrices = integrals @ matrices.reshape(*leading, matrices.shape[-3], -1)
            spectra[..., row_group, column_group] += of_matrices.reshape(*leading, count, *matrices.shape[-2:])
    return np.swapaxes(by_pole, -3, -2), spectra


def _times_matrices(inputs, matrices, integrals):
    """Sum of c_k b_j S_k over k = 1 to p, for each of N poles j and w weights, shape (..., N, w, l).

    The products b_j S_k, which all weights share, are computed first. b_j are the rows of `inputs`, (..., N, i), and
    S_k the real `matrices`, (..., p, i, l). `integrals`, (..., 2, N, w, p), are the real and imaginary parts of c_k,
    which differ with pole and weight.
    """
    *leading, functions, rows, columns = matrices.shape  # p, i, l
    real, imag = np.moveaxis(integrals, -4, 0)  # of c_k, (..., N, w, p) each
    # b_j S_k: for each pole its real parts of all k, below them its imaginary parts
    real_inputs = np.stack([inputs.real, inputs.imag], axis=-2).reshape(*leading, -1, rows)
    by_row = np.ascontiguousarray(np.swapaxes(matrices, -3, -2)).reshape(*leading, rows, functions * columns)
    # (a + i b)(c + i d) of c_k and b_j S_k by real products [a -b; b a] [c; d]
    real_rows, imaginary_rows = np.concatenate([real, -imag], axis=-1), np.concatenate([imag, real], axis=-1)
    both, parts = np.concatenate([real_rows, imaginary_rows], axis=-2), []
    at_once = max(1, WIND.product_entries // (2 * functions * columns))
    for begin in range(0, max(1, inputs.shape[-2]), at_once):
        end = begin + at_once
        products = (real_inputs[..., 2 * begin : 2 * end, :] @ by_row).reshape(*leading, -1, 2 * functions, columns)
        parts.append(both[..., begin:end, :, :] @ products)
    real, imag = np.split(np.concatenate(parts, axis=-3), 2, axis=-2)
    return real + 1j * imag
