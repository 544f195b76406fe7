"""Dynamic stiffness at the ends of a cable whose modes are coupled by damping: of strain, or uneven viscous damping.

The modes with fixed ends enter that stiffness by the inverse of a matrix that depends on the frequency s. The inverse
is evaluated as a sum over its poles, unless rounding spoils that sum; then equations are solved for each s.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.system.pole_windows import eigen, poles_in_windows, shapes
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class PoleSum:
    """Forces on the e end displacements of a cable per end displacement: a polynomial and a sum over N poles in x.

        P_0 + x P_1 + ... + x^d P_d - x^d sum of residue/(x - pole)

    The variable x is s, or s^2 + viscous s (`CouplingDamping`). The polynomial is that of the static shapes, so that
    the stiffness against slow movements is exact to rounding, whatever the error of the poles.

    Attributes
    ----------
    polynomial : list of d + 1 ndarray, shape (e, e)
        P_0 to P_d.
    poles : ndarray, shape (N,)
    residues : ndarray, shape (N, e, e)
    """

    polynomial: list
    poles: np.ndarray
    residues: np.ndarray

    @classmethod
    def of(cls, matrices, poles, left, right):
        """Condense the n modes out of the matrix polynomial of a cable: the end displacements are left, as a `PoleSum`.

        Parameters
        ----------
        matrices : sequence of 2 or 3 ndarray, shape (n + e, n + e)
            Coefficients by ascending power of x: K and M, or K, C and M, for the modes and then the ends; M is the
            identity for the modes.
        poles, left, right : ndarray, shapes (N,), (n, N), (N, n)
            The inverse of the polynomial Q_nn of the modes is the sum of left right/(x - pole) over the poles.

        Notes
        -----
        The forces are Q_ee - Q_en Q_nn^-1 Q_ne, Q being the polynomial of modes n and ends e. The product Q_en left
        right Q_ne at each pole is divided by pole^d, since the sum of a `PoleSum` is times x^d.
        """
        n = len(left)
        static, *_, mass = matrices
        static_shapes = np.concatenate([-np.linalg.solve(static[:n, :n], static[:n, n:]), np.eye(len(static) - n)])
        polynomial = [static_shapes.T @ matrix @ static_shapes for matrix in matrices[:-1]]
        polynomial.append(mass[n:, n:] - mass[n:, :n] @ mass[:n, n:])
        powers = [poles**order for order in range(len(matrices))]
        forces = sum(matrix[n:, :n] @ left * power for power, matrix in zip(powers, matrices, strict=True)).T
        driven = sum(right @ matrix[:n, n:] * power[:, None] for power, matrix in zip(powers, matrices, strict=True))
        return cls(polynomial, poles, forces[:, :, None] * (driven / powers[-1][:, None])[:, None, :])

    def __call__(self, x, rows, columns):
        """The value for x of shape (m,) and some of the ends, shape (m, r, c)."""
        residues = self.residues[:, rows][:, :, columns]
        moving = np.tensordot(1 / (x[:, None] - self.poles), residues, axes=1)
        *lower, highest = (matrix[rows][:, columns] for matrix in self.polynomial)
        return _polynomial([*lower, highest - moving], x)

    def __add__(self, other):
        """Sum of two of them, whose polynomials have the same degree."""
        polynomial = [first + second for first, second in zip(self.polynomial, other.polynomial, strict=True)]
        poles, residues = np.append(self.poles, other.poles), np.concatenate([self.residues, other.residues])
        return PoleSum(polynomial, poles, residues)

    def in_s(self, viscous):
        """`PoleSum` in s, from one in x = s^2 + viscous s; None where two poles in s nearly coincide.

        x/(x - X) = -viscous s/X - s^2 sum of q/(p (p - q))/(s - p), for both orders of the two poles p and q.
        """
        if (viscous > 2 * SYSTEM.pole_pair_decay * np.sqrt(np.abs(self.poles))).any():
            return None
        half = np.sqrt(viscous**2 / 4 + self.poles + 0j) * np.array([[1], [-1]])
        poles, other = half - viscous / 2, -half - viscous / 2
        residues = -(other / (2 * poles * half))[..., None, None] * self.residues
        static, first = self.polynomial
        slope = viscous * (first + (self.residues / self.poles[:, None, None]).sum(axis=0))
        return PoleSum([static, slope, first], poles.ravel(), residues.reshape(-1, *residues.shape[2:]))


@dataclass(frozen=True)
class Strain:
    """Damping of the elastic strain, with the elastic parts E, R, S of the stiffness: see `superelement`.

    Attributes
    ----------
    law : {"hysteretic", "kelvin_voigt"}
    amount : float
        Loss factor [-], or time [s].
    modes : ndarray, shape (n, n)
        E, of the n modes with fixed ends. [1/s^2]
    coupling : ndarray, shape (n, 6)
        R, of modes against static shapes of the ends. [N/(m sqrt(kg))]
    ends : ndarray, shape (6, 6)
        S, of the static shapes. [N/m]
    """

    law: str
    amount: float
    modes: np.ndarray
    coupling: np.ndarray
    ends: np.ndarray

    def factor(self, s):
        """Complex loss factor at s: i loss factor in the upper half plane, or s time."""
        return s * self.amount if self.law == "kelvin_voigt" else 1j * self.amount * np.sign(np.imag(s))

    def check(self, omega):
        """Refuse so much damped strain, for modes of some frequencies [rad/s], that rounding spoils what is left."""
        if self.spoils(omega):
            raise NoSolutionError(
                f"the strain is damped so much ({self.law}, {self.amount:g}) that rounding spoils the response: "
                f"cable.damping must be less"
            )

    def spoils(self, omega):
        """True if so much strain is damped that rounding spoils what is left."""
        return len(omega) > 0 and bool(np.abs(self.factor(1j * omega.min())) > SYSTEM.spoiling_loss)

    @property
    def matrix(self):
        """[E R; R^T S], shape (n + 6, n + 6)."""
        n, size = len(self.modes), len(self.modes) + len(self.ends)
        matrix = np.empty((size, size))
        matrix[:n, :n], matrix[n:, n:] = self.modes, self.ends
        matrix[:n, n:], matrix[n:, :n] = self.coupling, self.coupling.T
        return matrix


class CouplingDamping:
    """Dynamic stiffness at the ends, and poles, of a cable whose modes are coupled by damping.

    The equations of motion are a matrix polynomial in x = s, or in x = s^2 + viscous s where hysteretic damping alone
    couples the modes: that has half as many poles.

    Parameters
    ----------
    element : Superelement
    """

    def __init__(self, element):
        self.omega, self._similar, self._viscous = element.omega, element.near, element.viscous
        self.windowed = element.windowed and len(element.omega) > SYSTEM.windows_from
        mass, damping, stiffness = element.matrices()
        hysteretic = element.strain is not None and element.strain.law == "hysteretic"
        self._squared = hysteretic and not element.uneven and not np.any(element.residual_damping)
        self.matrices = (stiffness, mass) if self._squared else (stiffness, damping, mass)

    def dynamic_stiffness(self, s, rows, columns):
        """Dynamic stiffness at some of the ends, see `Superelement.dynamic_stiffness`."""
        below = np.imag(s) < 0
        x = self._variable(np.where(below, np.conj(s), s))
        few = len(s) <= SYSTEM.solved_places  # at few frequencies the poles cost more than they spare
        few &= self._similar is None and "_pole_sum_and_resolvent" not in self.__dict__
        by_poles = None if few else self.pole_sum
        value = by_poles(x, rows, columns) if by_poles else _solved(self.matrices, x, rows, columns, len(self.omega))
        if (real := np.imag(s) == 0).any():  # where hysteretic strain loses nothing
            lossless = [matrix.real for matrix in self.matrices]
            value[real] = _solved(lossless, x[real], rows, columns, len(self.omega))
        return np.where(below[:, None, None], value.conj(), value)

    def _variable(self, s):
        """x of the polynomial for s."""
        return s**2 + self._viscous * s if self._squared else s

    @property
    def pole_sum(self):
        """`PoleSum`; None where rounding spoils it."""
        return self._pole_sum_and_resolvent[0]

    @cached_property
    @np.errstate(all="ignore")  # what is not finite is not trusted
    def _pole_sum_and_resolvent(self):
        """`PoleSum` of the cable, and the resolvent of its modes, from the cheapest method that is accurate enough.

        Returns
        -------
        pole_sum : PoleSum or None
        resolvent : tuple of ndarray, shapes (N,), (n, N), (N, n), or None
            Poles, left and right: the inverse of the polynomial of the n modes is the sum of left right/(x - pole).

        Notes
        -----
        Where a similar element is known, its resolvent is corrected to first order, unchecked: it serves for small
        changes of a loop gain. Else the poles are found in windows of frequency, or of all modes at once, and the first
        sum that agrees with the equations (`_difference`) is taken. None and None where rounding spoils all of them.
        """
        similar = self._similar and self._similar.coupling_damping
        if similar and (resolvent_of_similar := similar._pole_sum_and_resolvent[1]):
            resolvent = self._to_first_order(similar.matrices, *resolvent_of_similar)
            return PoleSum.of(self.matrices, *resolvent), resolvent
        n = len(self.omega)
        of_modes = [matrix[:n, :n] for matrix in self.matrices]
        try:
            if self.windowed:
                resolvent = poles_in_windows(of_modes, self.omega)
                pole_sum = PoleSum.of(self.matrices, *resolvent)
                if self._difference(pole_sum, *resolvent) <= SYSTEM.trusted_windows:
                    return pole_sum, resolvent
        except np.linalg.LinAlgError:
            pass
        try:
            poles, vectors = eigen(of_modes, self.omega)
            left = shapes(vectors, self.omega)
            for right_of in self._right_by_symmetry, self._right_by_inverse:
                resolvent = poles, left, right_of(poles, left, vectors)
                pole_sum = PoleSum.of(self.matrices, *resolvent)
                if self._difference(pole_sum, *resolvent) <= SYSTEM.trusted:
                    return pole_sum, resolvent
        except np.linalg.LinAlgError:
            pass
        return None, None

    def _right_by_symmetry(self, poles, left, _):
        """`right` of poles that are apart: left^T over left^T Q' left, Q' the slope of the symmetric polynomial."""
        n, (_, *higher) = len(self.omega), self.matrices
        slope = sum(order * poles ** (order - 1) * (matrix[:n, :n] @ left) for order, matrix in enumerate(higher, 1))
        return (left / (left * slope).sum(axis=0)).T

    def _right_by_inverse(self, _, left, vectors):
        """`right` from the inverse of the eigenvectors, right for poles that coincide too."""
        inverse = np.linalg.inv(vectors)
        return inverse if self._squared else inverse[:, len(left) :]

    def _difference(self, pole_sum, poles, left, right):
        """Largest difference of a `PoleSum` from the forces Q_ee - Q_en q - q^T Q_ne + q^T Q_nn q, over their size.

        These are stationary in q = Q_nn^-1 Q_ne, so that their error is the square of that of q by the resolvent.
        """
        n, ends = len(self.omega), slice(None)
        if not n:
            return 0.0
        x = self._variable(checked(self.omega))
        q_ee, q_ne = (_polynomial([matrix[rows, n:] for matrix in self.matrices], x) for rows in np.s_[n:, :n])
        q = left @ ((right @ q_ne) / (x[:, None] - poles)[:, :, None])
        q_nn_q = sum(x[:, None, None] ** order * (matrix[:n, :n] @ q) for order, matrix in enumerate(self.matrices))
        forces = q_ee - np.swapaxes(q_ne, 1, 2) @ q + np.swapaxes(q, 1, 2) @ (q_nn_q - q_ne)
        size = np.abs(x[:, None] ** (len(self.matrices) - 1)) * np.diagonal(self.matrices[-1])[n:]
        size = size + np.abs(np.diagonal(self.matrices[0])[n:])
        size = np.sqrt(size[:, :, None] * size[:, None])
        error = np.abs(pole_sum(x, ends, ends) - forces) / np.where(size > 0, size, 1.0)
        return error.max()

    @property
    def pole_sum_in_s(self):
        """`PoleSum` in s; None where rounding spoils it, or viscous damping makes poles coincide nearly."""
        return self.pole_sum.in_s(self._viscous) if self._squared and self.pole_sum else self.pole_sum

    def _to_first_order(self, matrices, poles, left, right):
        """(poles, left, right) to first order from those of the similar `matrices` with other frequencies and decay.

        The shapes are kept: of modes that nearly coincide both are taken to change by as much.
        """
        n = len(self.omega)
        changes = [np.diagonal(own - other)[:n] for own, other in zip(self.matrices, matrices, strict=True)]
        change = sum(diagonal[:, None] * poles**order for order, diagonal in enumerate(changes))
        changed = poles - (right.T * change * left).sum(axis=0)
        return changed, left, right if self._squared else right * (poles / changed)[:, None]

    @property
    def poles(self):
        """Poles of the upper half plane and the real axis; none where rounding spoils them. [rad/s]"""
        if self.pole_sum is None:
            return np.zeros(0, dtype=complex)
        poles = self.pole_sum.poles
        if self._squared:
            poles = np.sqrt(self._viscous**2 / 4 + poles + 0j)
            poles = np.where(poles.imag < 0, -poles, poles) - self._viscous / 2
        return poles[poles.imag >= 0]


def checked(omega):
    """Complex frequencies at which a sum over poles is checked, for modes at `omega`, shape (8,). [rad/s]"""
    return (0.03 + 1j) * np.geomspace(omega.min() / 10, np.median(omega), 8)


def _solved(matrices, x, rows, columns, n):
    """Forces at some ends per displacement of some, of n modes and the ends, by a system of equations for each x."""
    by_ends = [matrix[:, n:][:, columns] for matrix in matrices]
    value, block = _polynomial([matrix[n:][rows] for matrix in by_ends], x), SYSTEM.systems_at_once
    for begin in range(0, len(x) if n else 0, block):
        at = x[begin : begin + block]
        of_modes = _polynomial([matrix[:n, :n] for matrix in matrices], at)
        amplitudes = np.linalg.solve(of_modes, _polynomial([matrix[:n] for matrix in by_ends], at))
        value[begin : begin + block] -= _polynomial([matrix[n:, :n][rows] for matrix in matrices], at) @ amplitudes
    return value


def _polynomial(matrices, x):
    """Sum of matrices of shape (r, c) times powers of x, from the zeroth on, shape (m, r, c)."""
    value, x = matrices[-1], x[:, None, None]
    for matrix in matrices[-2::-1]:
        value = value * x + matrix
    return value
