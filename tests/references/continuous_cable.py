"""The linearised continuous cable about its catenary, without finite elements.

Small motions: (D u')' + m w^2 u = 0 on [0, L], D = EA t t^T + T/(1 + T/EA) (I - t t^T). Mixed, first-order form with
the force increment N:

    u' = C N,   N' = -m w^2 u,   C = D^-1 = t t^T/EA + (1/T + 1/EA) (I - t t^T),

which stays regular for EA -> inf. Both equations are integrated once, on Gauss-Legendre points (spectral integration;
Greengard, SIAM J. Numer. Anal. 28, 1991), in axes along and across the chord and scaled so that the matrices are of
order one whatever EA/T. Pieces break at point loads (u and N are continuous there) and are halved until each is short
against its distance from the branch points s = (-V0 +- i H)/w of T, where the catenary bends sharply.

Fixed ends: with J the integral from end 1, N = c - lambda m J u and u(L) = 0 give u = lambda m G u with the symmetric

    G = J^T C J - (J^T C 1) (1^T C 1)^-1 (1^T C J),

whose LARGEST eigenvalues are the lowest modes: these are accurate to rounding. Axial modes of a cable with EA/T = 1e10
are the small eigenvalues and keep about 16 - log10(EA/T) digits; `Modes.error` shows it.
"""

import functools
import itertools
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from mpmath import mp

from . import catenary_mp


def _integration(n):
    """Gauss nodes and weights on [0, 1] and the matrix that integrates an interpolant from 0 to each node."""
    x, w = np.polynomial.legendre.leggauss(n)
    P = np.polynomial.legendre.legvander(x, n)
    k = np.arange(n)
    coefficients = (2 * k[:, None] + 1) / 2 * P[:, :n].T * w  # values -> Legendre coefficients
    primitive = np.empty((n, n))
    primitive[:, 0] = x + 1
    primitive[:, 1:] = (P[:, 2:] - P[:, : n - 1]) / (2 * k[1:] + 1)
    return (x + 1) / 2, w / 2, primitive @ coefficients / 2


def _breaks(force0, L, w, loads):
    """Piece boundaries in [0, 1]: point loads, and halving near the sharp bend."""
    length = float(L)
    fixed = sorted({0.0, 1.0, *(float(s) / length for s, _ in loads)})
    done = [0.0]
    for left, right in itertools.pairwise(fixed):
        middle = (left + right) / 2
        Hx, Hy, V = (float(f) for f in catenary_mp.tension_vector(force0, middle * L, L, w, loads))
        weight = float(w) * length
        bend = complex(middle - V / weight, np.hypot(Hx, Hy) / weight) if weight else np.inf
        stack = [(left, right)]
        while stack:
            low, high = stack.pop()
            if high - low > abs((low + high) / 2 - bend):
                stack += [((low + high) / 2, high), (low, (low + high) / 2)]
            else:
                done.append(high)
    return np.array(done)


@dataclass(frozen=True)
class _Mesh:
    """Scaled problem u' = C N, N' = -lambda mass u on [0, 1]; component j of u is in units of L scale_j."""

    s: np.ndarray  # (N,) nodes
    weights: np.ndarray  # (N,)
    J: np.ndarray  # (N, N)
    C: np.ndarray  # (N, d, d)
    scale: np.ndarray  # (d,)
    tension: float  # force unit [N]
    length: float  # length unit [m]
    mass: float  # [kg/m]
    axes: np.ndarray  # (3, d) global components of the d axes

    def spectrum(self, omega):
        """omega^2 in the scaled problem."""
        return omega**2 * self.mass * self.length**2 / self.tension


@functools.lru_cache(maxsize=64)
def _points(cable, n):
    """n points on each piece: nodes, weights, integration, T [N] and its direction in axes along, across and out."""
    force0, a, b, L, _, _, w, loads = cable
    breaks = _breaks(force0, L, w, loads)
    x, weight, J0 = _integration(n)
    sizes = np.diff(breaks)
    s = (breaks[:-1, None] + sizes[:, None] * x).ravel()
    weights = (sizes[:, None] * weight).ravel()
    J = np.kron(np.diag(sizes), J0)
    for i in range(1, len(sizes)):
        J[i * n : (i + 1) * n, : i * n] = weights[: i * n]
    with mp.workdps(40):
        chord = mp.hypot(a, b)
        cos, sin = mp.mpf(a) / chord, mp.mpf(b) / chord
        T, t = np.empty(len(s)), np.empty((len(s), 3))
        for i, middle in enumerate((breaks[1:] + breaks[:-1]) / 2):  # not at a break: there the tension may jump
            Hx, Hy, V0 = catenary_mp.tension_vector(force0, mp.mpf(middle) * L, L, w, loads)
            for j in range(i * n, (i + 1) * n):
                V = V0 + mp.mpf(w) * L * (mp.mpf(s[j]) - mp.mpf(middle))
                Tj = mp.sqrt(Hx * Hx + Hy * Hy + V * V)
                T[j], t[j] = Tj, ((Hx * cos + V * sin) / Tj, (V * cos - Hx * sin) / Tj, Hy / Tj)
    return s, weights, J, T, t, (float(cos), float(sin))


AXES = {"in": (0, 1), "out": (2,), "all": (0, 1, 2)}


@functools.lru_cache(maxsize=128)
def _mesh(cable, plane, n, eta=0.0):
    """Discretise: n points on each piece; `cable` as made by `_equilibrium`."""
    if plane not in AXES:
        raise ValueError(f"plane {plane!r}: allowed are {', '.join(AXES)}")
    _, _, _, L, EA, m, _, _ = cable
    s, weights, J, T, t, (cos, sin) = _points(cable, n)
    L, EA, chosen = float(L), float(EA), list(AXES[plane])
    unit = float(weights @ T)
    across = unit * (1 / T + 1 / EA)
    along = unit / (EA * (1 + 1j * eta)) if eta else unit / EA
    if plane == "in":
        t, q = t[:, 0], t[:, 1]
        C = np.array([[along * t**2 + across * q**2, (along - across) * t * q]] * 2)
        C[1] = C[0, 1], along * q**2 + across * t**2
        C = np.moveaxis(C, 2, 0)
    elif plane == "out":
        C = across[:, None, None]
    else:
        square = t**2
        project = -np.einsum("ni,nj->nij", t, t)
        for i in range(3):
            project[:, i, i] = np.delete(square, i, axis=1).sum(axis=1)  # 1 - t_i^2 without cancellation
        along = np.broadcast_to(along, T.shape)
        C = np.einsum("n,ni,nj->nij", along, t, t) + across[:, None, None] * project
    axes = np.array([[cos, 0.0, sin], [-sin, 0.0, cos], [0.0, 1.0, 0.0]]).T[:, chosen]
    scale = np.sqrt(np.abs(np.einsum("i,ijj->j", weights, C)))
    return _Mesh(s, weights, J, C / np.multiply.outer(scale, scale), scale, unit, L, float(m), axes)


def _equilibrium(a, b, L, EA, m, g, loads):
    """The static problem at 50 digits, with the data that `_mesh` needs (remembered: tests ask many frequencies)."""
    loads = tuple((float(s), tuple(f)) for s, f in (loads or ()) if any(f))
    if any(f[1] for _, f in loads):
        raise ValueError("loads must lie in the plane of the cable: fy = 0")
    return _solved(float(a), float(b), float(L), float(EA), float(m), float(m * g), loads)


@functools.lru_cache(maxsize=32)
def _solved(a, b, L, EA, m, w, loads):
    return catenary_mp.solve_loaded((a, 0, b), L, EA, w, loads), a, b, L, EA, m, w, loads


def _compliance(mesh):
    """G of fixed ends, shape (d N, d N), 1^T C J, shape (d, d, N), and 1^T C 1, shape (d, d)."""
    N, d = len(mesh.s), len(mesh.scale)
    WC = mesh.weights[:, None, None] * mesh.C
    row, total = np.moveaxis(WC, 0, 2) @ mesh.J, WC.sum(axis=0)
    G = np.block([[mesh.J.T @ (WC[:, j, k, None] * mesh.J) for k in range(d)] for j in range(d)])
    flat = row.reshape(d, d * N)
    return G - flat.T @ scipy.linalg.cho_solve(scipy.linalg.cho_factor(total), flat), row, total


def _fixed_modes(mesh, count):
    """Frequencies [Hz], mass-normalised end forces (count, 2, 3) [N/(m sqrt(kg))], and shapes (count, N, 3)."""
    N, d = len(mesh.s), len(mesh.scale)
    G, row, total = _compliance(mesh)
    half = np.outer(mesh.scale, 1 / np.sqrt(mesh.weights)).ravel()
    half_G = half[:, None] * G * half
    count = min(count, d * N)
    values, vectors = scipy.linalg.eigh((half_G + half_G.T) / 2, subset_by_index=[d * N - count, d * N - 1])
    values, vectors = values[::-1], vectors[:, ::-1]
    spectrum = 1 / values
    u = vectors.T.reshape(count, d, N) / np.sqrt(mesh.weights)  # in units of L
    loads = spectrum[:, None, None] * u * mesh.scale[:, None]
    c = np.linalg.solve(total, np.einsum("jkn,pkn->jp", row, loads)).T
    N1 = np.stack([-c, c - loads @ mesh.weights], axis=1) / mesh.scale
    amplitude = 1 / np.sqrt(mesh.mass * mesh.length)
    ends = N1 @ mesh.axes.T * mesh.tension * amplitude / mesh.length
    shapes = np.moveaxis(u, 1, 2) @ mesh.axes.T * amplitude
    frequencies = np.sqrt(spectrum * mesh.tension / mesh.mass) / (2 * np.pi * mesh.length)
    return frequencies, ends, shapes


@dataclass(frozen=True)
class Modes:
    """Modes between fixed ends.

    frequencies (count,), ascending [Hz]; end_forces (count, 2, 3): force on ends 1 and 2 per mass-normalised mode
    (integral of m u.u ds = 1), up to one sign per mode, of the size of the participation |psi^T K21 e_j| [N/(m
    sqrt(kg))]; error: estimate of the largest relative error of the frequencies.
    """

    frequencies: np.ndarray
    end_forces: np.ndarray
    error: float


def modes(a, b, L, EA, m, g, count, plane="in", n=None, loads=None, tolerance=1e-12):
    """Lowest `count` modes of the continuous cable between fixed ends, as `Modes`.

    `plane`: "in" (transverse and axial together) or "out". `n`: Gauss points per piece; by default enough, and then n
    and n + 8 are compared until they agree to `tolerance`. Loads lie in the plane.
    """
    cable = _equilibrium(a, b, L, EA, m, g, loads)
    pieces = len(_breaks(cable[0], cable[3], cable[6], cable[7])) - 1
    first = n or max(14, 12 + -(-3 * count // pieces))
    best = None
    previous = _fixed_modes(_mesh(cable, plane, first), count)[0]
    for points in [first + 8] if n else range(first + 8, first + 49, 8):
        mesh = _mesh(cable, plane, points)
        frequencies, ends, _ = _fixed_modes(mesh, count)
        shared = min(len(previous), len(frequencies))
        error = float(np.max(np.abs(frequencies[:shared] / previous[:shared] - 1)))
        if best is None or error < best.error:
            best = Modes(frequencies, ends, error)
        if error < tolerance:
            break
        previous = frequencies
    return best


def frequencies(a, b, L, EA, m, g, count, plane="in", n=None, loads=None):
    """Frequencies of `modes`, ascending. [Hz]"""
    return modes(a, b, L, EA, m, g, count, plane, n, loads).frequencies


def _ends(mesh, omega):
    """Dynamic stiffness of both ends, (2d, 2d) ordered end 1, end 2, scaled axes undone, chord axes. [N/m]"""
    N, d = len(mesh.s), len(mesh.scale)
    mass = mesh.spectrum(omega) * mesh.scale**2
    JJ, unity, zero = mesh.J @ mesh.J, np.eye(d), np.zeros((d, d))
    system = np.einsum("j,nm,mjk->jnkm", mass, JJ, mesh.C).reshape(d * N, d * N)
    system[np.diag_indices(d * N)] += 1
    right = np.zeros((d, N, 2 * d), dtype=system.dtype)  # unknown N(0) = c, then u(0) = e
    for j in range(d):
        right[j, :, j] = 1
        right[j, :, d + j] = -mass[j] * mesh.s
    force = np.linalg.solve(system, right.reshape(d * N, 2 * d)).reshape(d, N, 2 * d)
    strain = np.einsum("njk,knq->jnq", mesh.C, force)
    u1 = np.einsum("n,jnq->jq", mesh.weights, strain) + np.hstack([zero, unity])
    u_total = np.einsum("n,jnq->jq", mesh.weights @ mesh.J, strain) + np.hstack([zero, unity])
    N1 = np.hstack([unity, zero]) - mass[:, None] * u_total
    inverse = np.linalg.inv(u1[:, :d])
    c = np.hstack([-inverse @ u1[:, d:], inverse])  # N(0) for given (u(0), u(L))
    K = np.vstack([-c, N1[:, :d] @ c])
    K[d:, :d] += N1[:, d:]
    unit = np.tile(mesh.scale, 2)
    return K / np.outer(unit, unit) * mesh.tension / mesh.length


def dynamic_stiffness_both_ends(a, b, L, EA, m, g, omega, n=None, loads=None, eta=0.0):
    """Forces on (end 1, end 2) for harmonic motions of both, the cable's own mass included, along x, y, z.

    Shape (6, 6), complex if omega or eta is [N/m]; omega = 0 is the static limit. `eta`: loss factor, EA (1 + i eta)
    in the elastic part of D (Kelvin-Voigt: eta = omega tau). `n`, `loads` as in `modes`.
    """
    cable = _equilibrium(a, b, L, EA, m, g, loads)

    def matrix(points, omega):
        K = np.zeros((6, 6), dtype=complex if eta or np.iscomplexobj(omega) else float)
        for plane, dof in (("in", [0, 2, 3, 5]), ("out", [1, 4])):
            K[np.ix_(dof, dof)] = _ends(_mesh(cable, plane, points, eta), omega)
        return K

    wave = abs(omega) * L * np.sqrt(m * L / float(catenary_mp.mean_tension_loaded(cable[0], L, m * g, cable[7])) / L)
    first = n or 20 + 8 * int(np.ceil(wave / 8))  # neighbouring frequencies share their points
    coarse = matrix(first, omega)
    size = np.sqrt(np.abs(np.diag(matrix(first, 0.0))))
    best, best_error = None, np.inf
    for points in [first + 8] if n else range(first + 8, first + 41, 8):
        fine = matrix(points, omega)
        error = float(np.max(np.abs(fine - coarse) / np.outer(size, size)))
        if error < best_error:
            best, best_error = fine, error
        if error < 1e-12:
            break
        coarse = fine
    mesh = _mesh(cable, "in", 4)
    turn = np.kron(np.eye(2), np.column_stack([mesh.axes[:, 0], [0.0, 1.0, 0.0], mesh.axes[:, 1]]))
    return turn @ best @ turn.T


def dynamic_end_stiffness(a, b, L, EA, m, g, omega, n=None, loads=None, eta=0.0):
    """The part of `dynamic_stiffness_both_ends` that belongs to end 2, (3, 3), end 1 fixed. [N/m]"""
    return dynamic_stiffness_both_ends(a, b, L, EA, m, g, omega, n, loads, eta)[3:, 3:]


def static_end_stiffness(a, b, L, EA, m, g, n=None, loads=None):
    """Static limit of `dynamic_end_stiffness`, omega = 0; shape (3, 3). [N/m]"""
    return dynamic_end_stiffness(a, b, L, EA, m, g, 0.0, n, loads)
