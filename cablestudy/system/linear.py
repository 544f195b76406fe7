"""Cables, bodies and winches as one linear system of second order.

    M z'' + C z' + K z = f - (K1 v + C1 v' + M1 v'')

z are the modal amplitudes of all cables and then the displacements of the bodies; f forces on them; v the
displacements that winches impose. The ends of cable i move by u_i = G_i x + H_i v, x being the displacements of the
bodies: G_i and H_i say where it is attached, and the matrices of the system are sums over the superelements.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError

DENSE_LIMIT = 300  # coordinates up to which a full eigen-solution costs less than Lanczos iteration
MASSLESS = 1e-28  # compliance over the largest, below which a motion has no mass
UNSTABLE = "the equilibrium is not stable: it has no modes"


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
    mass, damping, stiffness : ndarray or sparse array, shape (n, n)
        The stiffness is complex where damping is hysteretic, which holds for Im s > 0. Sparse matrices serve `lowest`.
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

    def lowest(self, count):
        """The lowest undamped modes, winches at rest.

        Parameters
        ----------
        count : int
            How many; all if the system has fewer of finite frequency.

        Returns
        -------
        omega : ndarray, shape (k,)
            Ascending. [rad/s]
        shapes : ndarray, shape (n, k)
            Columns: mass-normalised.

        Raises
        ------
        NoSolutionError
            The stiffness is not positive definite: the equilibrium is not stable.
        ConvergenceError
        """
        size = self.mass.shape[0]
        if not size:
            return np.zeros(0), np.zeros((0, 0))
        if size <= DENSE_LIMIT or 2 * count > size:
            stiffness, mass = (_dense(matrix).real for matrix in (self.stiffness, self.mass))
            lower = _cholesky(stiffness)
            half = _solve_lower(lower, mass)
            _value, vectors = np.linalg.eigh(_solve_lower(lower, half.T))
            shapes = _solve_lower(lower, vectors[:, : -count - 1 : -1], transposed=True)
        else:
            factors = _factors(self.stiffness.real)
            shapes = _lanczos(size, factors.solve, self.mass.__matmul__, count)
            shapes = shapes / np.sqrt((shapes * (self.stiffness.real @ shapes)).sum(axis=0))
            mass = self.mass
        return _normalised(shapes, (shapes * (mass @ shapes)).sum(axis=0))

    def compliance(self, forces):
        """Static displacements by forces, shape (n, r) both, the winches at rest and without damping."""
        if isinstance(self.stiffness, np.ndarray):
            return np.linalg.solve(self.stiffness.real, forces)
        return _factors(self.stiffness.real).solve(forces)

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


def _normalised(shapes, compliance):
    """Frequencies [rad/s], ascending, and mass-normalised shapes.

    Parameters
    ----------
    shapes : ndarray, shape (n, k)
        Of unit strain energy.
    compliance : ndarray, shape (k,)
        Their quotients x^T M x, which have all digits of the high modes too. [s^2]
    """
    finite = compliance > MASSLESS * compliance.max(initial=0.0)
    square, shapes = 1 / compliance[finite], shapes[:, finite]
    order = np.argsort(square, kind="stable")
    return np.sqrt(square[order]), shapes[:, order] * np.sqrt(square[order])


@dataclass(frozen=True)
class ReducedSystem:
    """Cables in Craig-Bampton coordinates and bodies, without damping.

    Attributes
    ----------
    omega : ndarray, shape (N,)
        W: angular frequencies of the coordinates of the cables, each alone. [rad/s]
    coupling : ndarray or sparse array, shape (N, d)
        m: their momentum per velocity of the free displacements of the bodies.
    inertia, stiffness : ndarray or sparse array, shape (d, d)
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
        return len(self.omega) + self.stiffness.shape[0]

    def lowest(self, count):
        """The lowest undamped modes: as `LinearSystem.lowest`."""
        if not len(self):
            return np.zeros(0), np.zeros((0, 0))
        if len(self) > DENSE_LIMIT and 2 * count <= len(self):
            return self._lowest_of_large(count)
        modal, (lower, matrix) = len(self.omega), self._compliance()
        vectors = np.linalg.eigh(matrix)[1][:, : -count - 1 : -1]
        bodies = _solve_lower(lower, vectors[modal:], transposed=True)
        shapes = np.concatenate([vectors[:modal] / self.omega[:, None], bodies])
        return _normalised(shapes, (vectors * (matrix @ vectors)).sum(axis=0))

    def frequencies(self, count):
        """Of the lowest modes, ascending; those of a system without shapes to be known. [rad/s]"""
        if not len(self) or len(self) > DENSE_LIMIT:
            return self.lowest(count)[0]
        compliance = np.linalg.eigvalsh(self._compliance()[1])[: -count - 1 : -1]
        return 1 / np.sqrt(compliance[compliance > MASSLESS * compliance.max()])

    def _compliance(self):
        """l and L^-1 M L^-T of the notes, dense."""
        omega, modal = self.omega, len(self.omega)
        coupling, inertia, stiffness = (_dense(part) for part in (self.coupling, self.inertia, self.stiffness))
        lower = _cholesky(stiffness)
        matrix = np.zeros((len(self), len(self)))
        matrix[np.arange(modal), np.arange(modal)] = 1 / omega**2
        matrix[modal:, :modal] = _solve_lower(lower, (coupling / omega[:, None]).T)
        matrix[:modal, modal:] = matrix[modal:, :modal].T
        matrix[modal:, modal:] = _solve_lower(lower, _solve_lower(lower, inertia).T)
        return lower, matrix

    def _lowest_of_large(self, count):
        """`lowest` by Lanczos iteration: no large matrix is formed, only the stiffness of the bodies is factorised."""
        modal, square = len(self.omega), self.omega**2
        solve = _factors(self.stiffness).solve if self.stiffness.shape[0] else np.zeros_like

        def solved(forces):
            return np.concatenate([forces[:modal] / square, solve(forces[modal:])])

        shapes = _lanczos(len(self), solved, self.weighed, count)
        inner, bodies = shapes[:modal], shapes[modal:]
        energy = (square[:, None] * inner**2).sum(axis=0) + (bodies * (self.stiffness @ bodies)).sum(axis=0)
        shapes = shapes / np.sqrt(energy)
        return _normalised(shapes, (shapes * self.weighed(shapes)).sum(axis=0))

    def weighed(self, shapes):
        """M times shapes of all coordinates, shape (N + d,) or (N + d, r)."""
        inner, bodies = shapes[: len(self.omega)], shapes[len(self.omega) :]
        return np.concatenate([inner + self.coupling @ bodies, self.coupling.T @ inner + self.inertia @ bodies])


def assemble(cables, moved, bodies, imposed=None, stiffness=0.0):
    """Cables between bodies, winches and the ground as one system.

    Parameters
    ----------
    cables : sequence of Superelement
        c cables.
    moved : ndarray or sparse array, shape (6 c, b)
        G: displacements of the six ends of one cable after the other, per displacement of the bodies. Where it is
        sparse, the matrices of the system are.
    bodies : ndarray or sparse array, shape (b, b)
        Mass matrix of the bodies.
    imposed : ndarray, shape (6 c, i), optional
        H: the same per movement of the winches.
    stiffness : ndarray or sparse array, shape (b, b), optional
        Of the bodies, that of the cables' end stiffness left out.

    Returns
    -------
    LinearSystem
    """
    imposed = np.zeros((moved.shape[0], 0)) if imposed is None else imposed
    matrices = [cable.matrices() for cable in cables]
    if not isinstance(moved, np.ndarray):
        return _assemble_sparse(cables, matrices, moved, bodies, imposed, stiffness)
    modal, b = sum(len(cable.omega) for cable in cables), len(bodies)
    hysteretic = any(cable.strain is not None and cable.strain.law == "hysteretic" for cable in cables)
    whole = np.zeros((3, modal + b, modal + b), dtype=complex if hysteretic else float)
    driven = np.zeros((3, modal + b, imposed.shape[1]), dtype=whole.dtype)
    whole[0, modal:, modal:], whole[2, modal:, modal:] = bodies, stiffness
    begin, body = 0, slice(modal, None)
    for place, (cable, parts) in enumerate(zip(cables, matrices, strict=True)):
        n = len(cable.omega)
        own, ends = slice(begin, begin + n), slice(6 * place, 6 * place + 6)
        for total, outer, matrix in zip(whole, driven, parts, strict=True):
            total[own, own] = matrix[:n, :n]
            total[own, body] = matrix[:n, n:] @ moved[ends]
            total[body, own] = total[own, body].T
            total[body, body] += moved[ends].T @ matrix[n:, n:] @ moved[ends]
            outer[own] += matrix[:n, n:] @ imposed[ends]
            outer[body] += moved[ends].T @ matrix[n:, n:] @ imposed[ends]
        begin += n
    mass, damping, total = whole
    return LinearSystem(mass.real, damping.real, total, tuple(driven[::-1]), b)


def _assemble_sparse(cables, matrices, moved, bodies, imposed, stiffness):
    """`assemble` for a sparse G: block-diagonal matrices of all modes and all ends, of which bodies move the ends."""
    from scipy.sparse import block_array, coo_array, csc_array, eye_array

    sizes = np.array([len(cable.omega) for cable in cables])
    modal, ends = int(sizes.sum()), 6 * len(cables)
    first = np.cumsum(sizes) - sizes
    rows, columns, values = [], [], ([], [], [])
    for size in np.unique(sizes):
        alike = np.flatnonzero(sizes == size)
        own = first[alike, None] + np.arange(size)
        index = np.concatenate([own, modal + 6 * alike[:, None] + np.arange(6)], axis=1)
        rows.append(np.repeat(index, size + 6, axis=1).ravel())
        columns.append(np.tile(index, (1, size + 6)).ravel())
        for part, found in enumerate(values):
            found.append(np.stack([matrices[cable][part] for cable in alike.tolist()]).ravel())
    rows, columns = np.concatenate(rows), np.concatenate(columns)
    bodies, stiffness = csc_array(bodies), csc_array(stiffness) if np.ndim(stiffness) else 0 * csc_array(bodies)
    follow = block_array([[eye_array(modal), None], [None, moved]], format="csr") if modal else csc_array(moved)
    imposed_by_winches = np.concatenate([np.zeros((modal, imposed.shape[1])), imposed])
    whole, driven = [], []
    for found, added in zip(values, (bodies, 0 * bodies, stiffness), strict=True):
        entries = np.concatenate(found)
        there = entries != 0
        matrix = coo_array((entries[there], (rows[there], columns[there])), shape=(modal + ends,) * 2).tocsr()
        if modal:
            added = block_array([[csc_array((modal, modal)), None], [None, added]], format="csc")
        whole.append((follow.T @ matrix @ follow + added).tocsc())
        whole[-1].sum_duplicates()  # sorted: who sorts a copy that shares its numbers would spoil them
        driven.append(follow.T @ (matrix @ imposed_by_winches))
    mass, damping, total = whole
    return LinearSystem(mass.real, damping.real, total, tuple(driven[::-1]), bodies.shape[0])


def _dense(matrix):
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def _cholesky(stiffness):
    try:
        return np.linalg.cholesky(stiffness)
    except np.linalg.LinAlgError:
        raise NoSolutionError(UNSTABLE) from None


def _solve_lower(lower, right, transposed=False):
    """lower^-1 right, or lower^-T right, for a lower triangular matrix."""
    from scipy.linalg.lapack import dtrtrs

    return dtrtrs(lower, right, lower=1, trans=int(transposed))[0] if right.size else right


def _factors(stiffness):
    """Factors of a positive definite matrix."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    symmetric = {"SymmetricMode": True, "DiagPivotThresh": 0.0}
    try:
        factors = splu(csc_array(stiffness), permc_spec="MMD_AT_PLUS_A", options=symmetric)
    except RuntimeError:  # exactly singular
        raise NoSolutionError(UNSTABLE) from None
    if not (factors.U.diagonal() > 0).all():
        raise NoSolutionError(UNSTABLE)
    return factors


def _lanczos(size, solve, weigh, count):
    """Lowest modes, by shift-invert Lanczos iteration about zero from a fixed start vector.

    Parameters
    ----------
    size : int
    solve, weigh : callable
        K^-1 and M times a vector.
    count : int
    """
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    inverse, mass = (LinearOperator((size, size), matvec=product, dtype=float) for product in (solve, weigh))
    begin = 1 + np.modf(np.arange(1, size + 1) * (np.sqrt(5) - 1) / 2)[0]  # without symmetry, reproducible
    try:
        return eigsh(inverse, count, M=mass, sigma=0.0, OPinv=inverse, v0=begin, ncv=2 * count + 10)[1]
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"modes: {error}") from None


def upper(values):
    """Those of some poles in the upper half plane and on the real axis."""
    return values[values.imag >= 0]
