"""Cables, bodies and winches as one linear system of second order.

    M z'' + C z' + K z = f - (K1 v + C1 v' + M1 v'')

z are the modal amplitudes of all cables and then the displacements of the bodies; f forces on them; v the
displacements that winches impose. The ends of cable i move by u_i = G_i x + H_i v, x being the displacements of the
bodies: G_i and H_i say where it is attached, and the matrices of the system are sums over the superelements.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Modes:
    """Undamped modes, winches at rest.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Ascending. [rad/s]
    shapes : ndarray, shape (n, n)
        Columns: mass-normalised, in the coordinates of the system.
    shares : ndarray, shape (b, n)
        Share of each mode in the static compliance of each body's displacement. [-]
    """

    omega: np.ndarray
    shapes: np.ndarray
    shares: np.ndarray


@dataclass(frozen=True)
class LinearSystem:
    """The matrices above.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
        The stiffness is complex where damping is hysteretic, which holds for Im s > 0.
    driven : tuple of 3 ndarray, shape (n, i)
        K1, C1 and M1.
    bodies : int
        How many of the coordinates, the last ones, are displacements of bodies.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    driven: tuple
    bodies: int = 1

    @cached_property
    def modes(self):
        """Undamped modes from the compliance: `Modes`.

        Notes
        -----
        With K = L L^T, the eigenvalues of L^-1 M L^-T are 1/w^2: the lowest frequencies have all digits, however heavy
        the bodies. The squared components of its unit eigenvectors are the shares in the static compliance.
        """
        lower = np.linalg.cholesky(self.stiffness.real)
        half = np.linalg.solve(lower, self.mass)
        _, vectors = np.linalg.eigh(np.linalg.solve(lower, half.T))
        shapes = np.linalg.solve(lower.T, vectors[:, ::-1])
        # unit strain energy; the quotient has all digits of the high modes too
        square = 1 / np.maximum((shapes * (self.mass @ shapes)).sum(axis=0), np.finfo(float).tiny)
        order = np.argsort(square, kind="stable")
        square, shapes = square[order], shapes[:, order]
        body = slice(len(self.mass) - self.bodies, None)
        compliance = (np.linalg.inv(lower) ** 2)[:, body].sum(axis=0)
        return Modes(np.sqrt(square), shapes * np.sqrt(square), shapes[body] ** 2 / compliance[:, None])

    @cached_property
    def unit(self):
        """About the frequency of each coordinate alone, by which its displacement is weighted as a state. [rad/s]"""
        stiffness, mass = np.diagonal(self.stiffness).real, np.diagonal(self.mass)
        return np.sqrt(np.where(stiffness > 0, stiffness, mass) / mass)

    @cached_property
    def first_order(self):
        """A of x' = A x + (B0 + B1 d/dt + B2 d2/dt2) v for the states (w z, z'), and the lower halves of B0, B1, B2.

        The upper halves are zero.
        """
        n, unit = len(self.mass), self.unit
        right = np.concatenate([self.stiffness / unit, self.damping, *self.driven], axis=1)
        solved = -np.linalg.solve(self.mass, right)
        a = np.zeros((2 * n, 2 * n), dtype=solved.dtype)
        a[np.arange(n), n + np.arange(n)] = unit
        a[n:] = solved[:, : 2 * n]
        return a, tuple(np.split(solved[:, 2 * n :], 3, axis=1))

    @cached_property
    def poles(self):
        """Winches at rest: upper half plane and real axis. [rad/s]"""
        return upper(np.linalg.eigvals(self.first_order[0]))

    @cached_property
    def pole_shares(self):
        """The poles, and the share of each in the static compliance of each body's displacement, shape (b, k). [-]"""
        values, vectors = np.linalg.eig(self.first_order[0])
        n, body = len(self.mass), slice(len(self.mass) - self.bodies, len(self.mass))
        force = np.zeros((2 * n, self.bodies), dtype=complex)
        force[n:] = np.linalg.inv(self.mass)[:, body]
        moved = vectors[body] / self.unit[body, None]
        try:
            shares = np.abs(moved * np.linalg.solve(vectors, force).T / np.where(values != 0, values, 1.0))
        except np.linalg.LinAlgError:
            shares = np.abs(moved)  # two poles that are one: any of their shapes will do
        above = values.imag >= 0
        return values[above], shares[:, above]

    def feedback(self, measured, filtering):
        """A of the closed loop as A0 + gain A1, winches integrating what the bodies do: v' = gain N(s) x.

        Parameters
        ----------
        measured : ndarray, shape (i, b)
            What each winch integrates of the bodies' displacements, signs included. [-]
        filtering : tuple of 4 ndarray
            N as a state space: a (k, k), b (k,), c (k,), and the direct part d, the same for each winch.

        Returns
        -------
        A0, A1 : ndarray, shape (2 n + i k + i, 2 n + i k + i)
            States: w z, z', the filter of each winch, v.

        Notes
        -----
        v' = gain (d y + c n) and v'' = gain (d y' + c n') are sums of states: no derivative of the input is left.
        """
        a, b, c, d = filtering
        n, winches, states = len(self.mass), len(measured), len(a)
        plant, (first, second, third) = self.first_order
        size = 2 * n + winches * (states + 1)
        body = slice(n - self.bodies, n)
        seen, speed = np.zeros((2, winches, size))
        seen[:, body], speed[:, n - self.bodies + n : 2 * n] = measured / self.unit[body], measured
        fixed = np.zeros((size, size), dtype=plant.dtype)
        fixed[: 2 * n, : 2 * n] = plant
        fixed[n : 2 * n, size - winches :] = first
        rate, acceleration = d * seen, d * speed
        for winch in range(winches):
            rows = slice(2 * n + winch * states, 2 * n + (winch + 1) * states)
            fixed[rows, rows] = a
            fixed[rows] += np.outer(b, seen[winch])
            rate[winch, rows] += c
            acceleration[winch] += c @ fixed[rows].real
        scaled = np.zeros_like(fixed)
        scaled[size - winches :] = rate
        scaled[n : 2 * n] = second @ rate + third @ acceleration
        return fixed, scaled


def assemble(cables, bodies):
    """Cables between bodies, winches and the ground as one system.

    Parameters
    ----------
    cables : sequence of tuple
        (Superelement, G, H): of each cable, with the displacements of its six ends per displacement of the bodies,
        shape (6, b), and per movement of the winches, shape (6, i).
    bodies : ndarray, shape (b, b)
        Mass matrix of the bodies.

    Returns
    -------
    LinearSystem
    """
    sizes = [len(cable.omega) for cable, _, _ in cables]
    modal, b = sum(sizes), len(bodies)
    winches = cables[0][2].shape[1]
    hysteretic = any(cable.strain is not None and cable.strain.law == "hysteretic" for cable, _, _ in cables)
    whole = np.zeros((3, modal + b, modal + b), dtype=complex if hysteretic else float)
    driven = np.zeros((3, modal + b, winches), dtype=whole.dtype)
    whole[0, modal:, modal:] = bodies
    begin = 0
    for (cable, moved, wound), n in zip(cables, sizes, strict=True):
        own, body = slice(begin, begin + n), slice(modal, None)
        for total, imposed, matrix in zip(whole, driven, cable.matrices(), strict=True):
            total[own, own] = matrix[:n, :n]
            total[own, body] = matrix[:n, n:] @ moved
            total[body, own] = total[own, body].T
            total[body, body] += moved.T @ matrix[n:, n:] @ moved
            imposed[own] += matrix[:n, n:] @ wound
            imposed[body] += moved.T @ matrix[n:, n:] @ wound
        begin += n
    mass, damping, stiffness = whole
    return LinearSystem(mass.real, damping.real, stiffness, tuple(driven[::-1]), b)


def upper(values):
    """Those of some poles in the upper half plane and on the real axis."""
    return values[values.imag >= 0]
