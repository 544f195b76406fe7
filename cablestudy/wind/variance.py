"""Variances of the outputs of a linear system that turbulence drives, by its poles.

With y = [D + sum c_a b_a/(s - l_a)] u (`system.residues`) and the one-sided spectral matrix S(f) of the inputs, the
covariance X of the amplitudes of the poles solves Lyapunov's equation with coloured noise,

    l_a X_ab + X_ab conj(l_b) = -(G_ab + conj(G_ba)),   G_ab = integral of r_a b_a S conj(b_b)^T df,
    r_a = 1/(i w - l_a) + 1/(-i w - l_a) = -2 l_a/(w^2 + l_a^2),

since (i w - l_a)^-1 (-i w - conj(l_b))^-1 is a sum of two fractions. S is smooth: it is a sum of matrices times
functions of frequency. What is narrow is in r_a alone, and Gauss's rule of each panel is corrected for its pole.

A complex stiffness has a response for positive frequencies alone, and its poles are no pairs: r_a is then
2/(i w - l_a), the sums run over all poles, and the real part is the variance.
"""

from dataclasses import dataclass

import numpy as np

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
    matrices : ndarray, shape (p, i, i)
        S_k, symmetric.
    parts : list of slice
        The inputs by parts that have one function e of frequency each: E = diag(e).
    functions : list of list of ndarray, shape (p, n)
        e_j e_l g_k for parts j and l at the frequencies of the panels.
    """

    matrices: np.ndarray
    parts: list
    functions: list


def with_turns(edges, delay):
    """Edges, and further ones between which the phase of a delay [s] turns by `delay_in_panel`."""
    if not delay:
        return edges
    turns = WIND.delay_in_panel * np.arange(1, WIND.delay_panels) / (2 * np.pi * delay)
    turns = turns[(turns > edges[0]) & (turns < edges[-1])]
    return np.sort(
        np.concatenate([edges, turns[np.abs(np.log(turns / edges[:, None])).min(axis=0) > WIND.panel_edges]])
    )


def smooth_on(edges, functions):
    """Edges of panels on which some functions are resolved: those panels are halved on which one is not.

    Parameters
    ----------
    edges : ndarray
        Ascending. [Hz]
    functions : sequence of callable
        Of frequencies [Hz].
    """
    done = [edges[-1:]]
    low, high = edges[:-1], edges[1:]
    for _ in range(WIND.panel_halvings):
        middle = np.sqrt(low * high)
        place = middle[:, None] * (high / middle)[:, None] ** NODES
        rough = np.zeros(len(low), dtype=bool)
        for function in functions:
            value = function(place.ravel()).reshape(place.shape)
            rough |= np.abs(value @ HIGHEST).max(axis=1) > WIND.unresolved_panel * np.abs(value).max(axis=1)
        done.append(low[~rough])
        low, high = np.concatenate([low[rough], middle[rough]]), np.concatenate([middle[rough], high[rough]])
    return np.sort(np.concatenate([*done, low]))


class Panels:
    """Gauss points on panels in log frequency, and all below the lowest one by its value there.

    Parameters
    ----------
    edges : ndarray, shape (k + 1,)
        Ascending. [Hz]

    Attributes
    ----------
    frequency, weights : ndarray, shape (n,)
        Points, and their shares in an integral. [Hz]
    highest : float
        The last edge. [Hz]
    """

    def __init__(self, edges):
        ends = np.log(edges)
        self.highest = float(edges[-1])
        self._middle, self._half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
        inner = np.exp(self._middle[:, None] + self._half[:, None] * NODES)
        self.frequency = np.append(inner.ravel(), edges[0])
        self.weights = np.append((self._half[:, None] * WEIGHTS * inner).ravel(), edges[0])

    def resolvents(self, poles, one_sided=False):
        """r_a times the weights, shape (N, n), so that sums of them with a smooth function are integrals over f.

        Parameters
        ----------
        poles : ndarray, complex, shape (N,)
            Of the upper half plane and the real axis; any of a response for positive frequencies alone. [rad/s]
        one_sided : bool
            Whether they are those of such a response.
        """
        omega = 2 * np.pi * self.frequency
        if one_sided:
            fractions = 2 / (1j * omega - poles[:, None])
        else:
            fractions = -2 * poles[:, None] / (omega**2 + poles[:, None] ** 2)
        return fractions * self.weights_for(poles)

    def weights_for(self, poles):
        """Weights, shape (N, n), for functions with a simple pole each at i w = l_a; `poles` as for `resolvents`.

        Notes
        -----
        In z = log f, such a function has a pole at log(l_a/(2 pi i)). Gauss's rule of n points x_i is exact for a
        polynomial over x - z where its weights are multiplied by 1 + n P_(n-1)(x_i) Q_n(z), P and Q being Legendre's
        functions of the first and second kind: Christoffel's sum of (2 k + 1) P_k(x) Q_k(z) (Whittaker and Watson,
        Modern Analysis, 15.4).
        """
        found = np.tile(self.weights + 0j, (len(poles), 1))
        place = (np.log(poles / 2j / np.pi)[:, None] - self._middle) / self._half
        pole, panel = np.nonzero(np.abs(place) < WIND.near_pole)
        points = panel[:, None] * WIND.panel_points + np.arange(WIND.panel_points)
        found[pole[:, None], points] *= 1 + WIND.panel_points * LAST * _second_kind(place[pole, panel])[:, None]
        return found


def _second_kind(z):
    """Legendre's function of the second kind and of degree `panel_points`, off the segment from -1 to 1."""
    before, found = 1.0, np.log((z + 1) / (z - 1)) / 2  # of degree -1, times 0, and 0
    for degree in range(WIND.panel_points):
        before, found = found, ((2 * degree + 1) * z * found - (degree * before if degree else 1.0)) / (degree + 1)
    return found


def variances(residues, panels, noise, weights):
    """Variances of the outputs.

    Parameters
    ----------
    residues : Residues
        Stable; of complex poles both of each pair.
    panels : Panels
    noise : Noise
    weights : ndarray, shape (w, n)
        Functions of frequency by which the spectra are weighted.

    Returns
    -------
    ndarray, shape (w, o)
    """
    upper = (residues.poles.imag >= 0) | residues.one_sided
    poles, inputs, outputs = residues.poles[upper], residues.inputs[upper], residues.outputs[:, upper]
    if not residues.one_sided:
        outputs = outputs * np.where(poles.imag > 0, 2.0, 1.0)
    forced, direct = _forced(inputs, panels, noise, weights, panels.resolvents(poles, residues.one_sided))
    sums = poles[:, None] + residues.poles.conj()
    covariance = forced @ residues.inputs.conj().T / -sums
    seen = covariance @ residues.outputs.conj().T + forced @ residues.direct.conj().T
    directly = ((residues.direct @ direct) * residues.direct.conj()).sum(axis=-1).real
    found = (outputs.T * seen).sum(axis=1).real + directly
    # by Schwarz's inequality no sum over the poles is larger than that of the sizes of its terms
    own = np.maximum(2 * covariance[:, np.arange(len(poles)), np.flatnonzero(upper)].real, 0.0)
    return np.where(found > WIND.variance_rounding * (np.sqrt(own) @ np.abs(outputs.T)) ** 2, found, 0.0)


def mixed_variances(residues, smooth, noise_times, panels, noise, weights):
    """Variances of the outputs of a system with few known poles beside a response that is smooth over frequency.

    Parameters
    ----------
    residues : Residues
        The poles, stable, without a direct part; of complex ones both of each pair.
    smooth : callable
        What is to be added to their response: s = i w, shape (f,) [rad/s] -> complex, shape (f, o, i).
    noise_times : callable
        Frequencies and columns, complex, shape (f, i, o) -> S times these.
    panels, noise, weights
        As for `variances`.

    Returns
    -------
    ndarray, shape (w, o)

    Notes
    -----
    With the poles' response P and the smooth one G: P S P* + 2 Re P S G* + G S G*.
    """
    found, s = variances(residues, panels, noise, weights), 2j * np.pi * panels.frequency
    fractions = panels.weights_for(residues.poles).T / (s[:, None] - residues.poles)
    for begin in range(0, len(s), WIND.frequencies_at_once):
        part = slice(begin, begin + WIND.frequencies_at_once)
        own = smooth(s[part])
        pushed = noise_times(panels.frequency[part], np.swapaxes(own, 1, 2).conj())
        plain = (own * np.swapaxes(pushed, 1, 2)).sum(axis=-1).real * panels.weights[part, None]
        crossed = ((residues.inputs @ pushed) * fractions[part, :, None] * residues.outputs.T).sum(axis=1)
        found += weights[:, part] @ (plain + 2 * crossed.real)
    return found


def _forced(inputs, panels, noise, weights, resolvents):
    """Integrals of r_a b_a S, shape (w, a, i), and of S, shape (w, i, i)."""
    count, size = inputs.shape
    parts = np.concatenate([resolvents.real, resolvents.imag])
    forced = np.zeros((len(weights), count, size), dtype=complex)
    direct = np.zeros((len(weights), size, size))
    for row, functions in zip(noise.parts, noise.functions, strict=True):
        own = np.concatenate([inputs[:, row].real, inputs[:, row].imag])
        for column, function in zip(noise.parts, functions, strict=True):
            matrices = noise.matrices[:, row, column]
            pushed = np.tensordot(own, matrices, axes=(1, 1)).reshape(2, count, *matrices.shape[::2])
            weighted = weights[:, None] * function
            integrals = (parts @ weighted.reshape(-1, len(panels.weights)).T).reshape(2, count, *weighted.shape[:2])
            # (a + i b)(c + i d), matrix products of real numbers for each pole
            straight, crossed = integrals @ pushed, integrals @ pushed[::-1]
            found = straight[0] - straight[1] + 1j * (crossed[0] + crossed[1])
            forced[..., column] += np.swapaxes(found, 0, 1)
            direct[:, row, column] += np.tensordot(weighted @ panels.weights, matrices, axes=1)
    return forced, direct
