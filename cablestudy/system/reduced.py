"""Undamped systems in the coordinates of their cables, and their lowest modes: small, coupled to bodies, or sparse."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.matrices import dense, factors_of_each, lanczos_modes, normalised_modes, sparse_factors
from cablestudy.errors import NoSolutionError
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class ReducedSystem:
    """Undamped system of bodies and cables in Craig-Bampton coordinates: one, or a stack of many of equal size.

    The structure of its matrices makes the modes cheaper and more accurate than those of a general `LinearSystem`.

    Attributes
    ----------
    omega : ndarray, shape (..., N)
        W: angular frequencies of the coordinates of the cables, each alone. [rad/s]
    coupling : ndarray or sparse array, shape (..., N, d)
        m: their momentum per velocity of the free displacements of the bodies.
    inertia, stiffness : ndarray or sparse array, shape (..., d, d)
        J and k: of bodies and cables, for the free displacements.

    Notes
    -----
    M = [1, m; m^T, J] and K = [W^2, 0; 0, k]. With K = L L^T and k = l l^T, only l must be found, and
    L^-1 M L^-T = [1/W^2, b; b^T, l^-1 J l^-T] with b = m l^-T/W.
    """

    omega: np.ndarray
    coupling: np.ndarray
    inertia: np.ndarray
    stiffness: np.ndarray

    def __len__(self):
        return self.omega.shape[-1] + self.stiffness.shape[-1]

    def lowest(self, count):
        """The lowest undamped modes of the N coordinates of cables and d free displacements of bodies, winches at rest.

        In all systems of a stack equally many cable coordinates must move bodies (`coupled`).

        Parameters
        ----------
        count : int
            Number k of modes; if there are fewer, k is their number.

        Returns
        -------
        omega : ndarray, shape (..., k)
            Angular frequencies, ascending; infinite for motions without mass, NaN where the equilibrium is not
            stable. [rad/s]
        shapes : ndarray, shape (..., N + d, k)
            Columns: mass-normalised; zero where there is no mode.

        Raises
        ------
        ConvergenceError
            The iteration for a large system did not converge.
        """
        if isinstance(self.inertia, np.ndarray):
            moves_bodies = coupled(self.coupling, np.diagonal(self.inertia, axis1=-2, axis2=-1)[..., None, :])
            if not moves_bodies.all():
                return self._lowest_with_uncoupled(count, moves_bodies)
        return self._lowest_of_coupled(count)

    def _lowest_of_coupled(self, count):
        """`lowest` of coordinates all of which move bodies."""
        if len(self) > SYSTEM.dense_coordinates and 2 * count <= len(self):
            return self._lowest_of_large(count)
        return self._lowest_of_small(min(count, len(self)))

    def _lowest_of_small(self, count):
        """`lowest` of a small system: all eigenvectors of L^-1 M L^-T, see the notes of the class."""
        omega, modal = self.omega, self.omega.shape[-1]
        coupling, inertia, stiffness = dense(self.coupling), dense(self.inertia), dense(self.stiffness)
        lower = factors_of_each(stiffness)
        stable = np.isfinite(lower).all(axis=(-2, -1))[..., None]
        lower = np.where(stable[..., None], lower, np.eye(stiffness.shape[-1]))
        matrix = np.zeros((*omega.shape[:-1], len(self), len(self)))
        matrix[..., np.arange(modal), np.arange(modal)] = 1 / omega**2
        matrix[..., modal:, :modal] = np.linalg.solve(lower, (coupling / omega[..., None]).swapaxes(-1, -2))
        matrix[..., :modal, modal:] = matrix[..., modal:, :modal].swapaxes(-1, -2)
        matrix[..., modal:, modal:] = np.linalg.solve(lower, np.linalg.solve(lower, inertia).swapaxes(-1, -2))
        vectors = np.ascontiguousarray(np.linalg.eigh(matrix)[1][..., ::-1][..., :count])
        bodies = np.linalg.solve(lower.swapaxes(-1, -2), vectors[..., modal:, :])
        shapes = np.concatenate([vectors[..., :modal, :] / omega[..., None], bodies], axis=-2)
        omega, shapes = normalised_modes(shapes, (vectors * (matrix @ vectors)).sum(axis=-2))
        return np.where(stable, omega, np.nan), np.where(stable[..., None], shapes, 0.0)

    def _lowest_with_uncoupled(self, count, moves_bodies):
        """`lowest` where some of the N cable coordinates move no body, by a mask, shape (..., N), of those that do.

        Each of the others is a mode by itself, of shape 1. The eigenvalue problem is solved for the coordinates that
        move bodies, equally many in each system of a stack, and the bodies; all modes are then sorted by frequency.
        """
        modal, size = self.omega.shape[-1], len(self)
        order = np.argsort(~moves_bodies, axis=-1, kind="stable")
        coupled_count = int(np.count_nonzero(moves_bodies.reshape(-1, modal)[0]))
        with_bodies, alone = order[..., :coupled_count], order[..., coupled_count:]  # indices of cable coordinates
        coupled_omega = np.take_along_axis(self.omega, with_bodies, axis=-1)
        coupling = np.take_along_axis(self.coupling, with_bodies[..., None], axis=-2)
        coupled_omega, coupled_shapes = replace(self, omega=coupled_omega, coupling=coupling)._lowest_of_coupled(count)
        omega = np.concatenate([coupled_omega, np.take_along_axis(self.omega, alone, axis=-1)], axis=-1)
        shapes, modes = np.zeros((*omega.shape[:-1], size, omega.shape[-1])), coupled_omega.shape[-1]
        bodies = np.broadcast_to(np.arange(modal, size), (*with_bodies.shape[:-1], size - modal))
        rows = np.concatenate([with_bodies, bodies], axis=-1)
        np.put_along_axis(shapes[..., :modes], rows[..., None], coupled_shapes, axis=-2)
        np.put_along_axis(shapes[..., modes:], alone[..., None, :], 1.0, axis=-2)
        lowest = np.argsort(omega, axis=-1, kind="stable")[..., :count]
        return np.take_along_axis(omega, lowest, axis=-1), np.take_along_axis(shapes, lowest[..., None, :], axis=-1)

    def compliance(self, motions):
        """Static compliance of some free displacements, by their numbers, shape (q,). [m/N, rad/(N m)]"""
        forces, each = np.zeros((self.stiffness.shape[0], len(motions))), np.arange(len(motions))
        forces[motions, each] = 1.0
        dense = isinstance(self.stiffness, np.ndarray)
        moved = np.linalg.solve(self.stiffness, forces) if dense else sparse_factors(self.stiffness).solve(forces)
        return moved[motions, each]

    def _lowest_of_large(self, count):
        """`lowest` of a large system by Lanczos iteration, without forming a large matrix; those of a stack one by one.

        Only the stiffness of the bodies is factorised, as that of the cable coordinates is the diagonal matrix W^2.
        """
        if self.omega.ndim > 1:
            systems = zip(self.omega, self.coupling, self.inertia, self.stiffness, strict=True)
            omega, shapes = zip(*(ReducedSystem(*system)._lowest_of_large(count) for system in systems), strict=True)
            return np.array(omega), np.array(shapes)
        modal, square = len(self.omega), self.omega**2
        try:
            solve = sparse_factors(self.stiffness).solve if self.stiffness.shape[0] else np.zeros_like
        except NoSolutionError:
            return np.full(count, np.nan), np.zeros((len(self), count))

        def static_displacements(forces):
            return np.concatenate([forces[:modal] / square, solve(forces[modal:])])

        shapes = lanczos_modes(len(self), static_displacements, self.mass_times, count)
        cables, bodies = shapes[:modal], shapes[modal:]
        energy = (square[:, None] * cables**2).sum(axis=0) + (bodies * (self.stiffness @ bodies)).sum(axis=0)
        shapes = shapes / np.sqrt(energy)
        return normalised_modes(shapes, (shapes * self.mass_times(shapes)).sum(axis=0))

    def mass_times(self, shapes):
        """M times shapes of all coordinates, shape (N + d,) or (N + d, r), of one system."""
        cables, bodies = shapes[: len(self.omega)], shapes[len(self.omega) :]
        return np.concatenate([cables + self.coupling @ bodies, self.coupling.T @ cables + self.inertia @ bodies])


def coupled(coupling, inertia):
    """True for coordinates of the cables that move bodies, shape (..., N): each of the others is a mode by itself.

    Parameters
    ----------
    coupling : ndarray, shape (..., N, d)
        As of `ReducedSystem`.
    inertia : ndarray, shape (..., N, d) or (..., 1, d)
        Diagonal of its inertia.
    """
    return (np.abs(coupling) > SYSTEM.uncoupled_momentum * np.sqrt(inertia)).any(axis=-1)
