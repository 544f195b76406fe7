"""Damping that couples the modes of a cable with fixed ends: that of the strain, and viscous damping that is uneven.

What the modes take off the stiffness of the ends contains the inverse of a matrix for each s. It is a sum over the
poles, unless rounding spoils that sum; then systems of equations are solved.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.system.pole_windows import eigen, poles_in_windows, shapes
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class PoleSum:
    """Force at the ends per displacement of the ends, as polynomial and sum over poles of a variable x.

        P_0 + x P_1 + ... + x^n P_n - x^n sum of R/(x - pole)

    It keeps the static stiffness and what follows it for slow movements to rounding.

    Attributes
    ----------
    polynomial : list of n + 1 ndarray, shape (e, e)
    poles : ndarray, shape (N,)
    residues : ndarray, shape (N, e, e)
    """

    polynomial: list
    poles: np.ndarray
    residues: np.ndarray

    @classmethod
    def of(cls, matrices, poles, left, right):
        """The sum for the polynomial of some matrices in x, its part of n modes first.

        Parameters
        ----------
        matrices : sequence of 2 or 3 ndarray, shape (n + e, n + e)
            By ascending power: K and M, or K, C and M; M is the identity for the modes.
        poles, left, right : ndarray, shapes (N,), (n, N), (N, n)
            The inverse for the modes is the sum of left right over (x - pole).
        """
        n = len(left)
        static, *_, mass = matrices
        answer = -np.linalg.solve(static[:n, :n], static[:n, n:])  # of the modes to slow movements of the ends
        slow = np.concatenate([answer, np.eye(static.shape[0] - n)])
        polynomial = [slow.T @ part @ slow for part in matrices[:-1]]
        polynomial.append(mass[n:, n:] - mass[n:, :n] @ mass[:n, n:])
        power = [poles**order for order in range(len(matrices))]
        forces = sum(part[n:, :n] @ left * one for one, part in zip(power, matrices, strict=True)).T
        driven = sum(right @ part[:n, n:] * one[:, None] for one, part in zip(power, matrices, strict=True))
        return cls(polynomial, poles, forces[:, :, None] * (driven / power[-1][:, None])[:, None, :])

    def __call__(self, x, rows, columns):
        """The value for x of shape (m,) and some of the ends, shape (m, r, c)."""
        residues = self.residues[:, rows][:, :, columns]
        moving = np.tensordot(1 / (x[:, None] - self.poles), residues, axes=1)
        *lower, last = (part[rows][:, columns] for part in self.polynomial)
        return _polynomial([*lower, last - moving], x)

    def __add__(self, other):
        """Of two sums whose polynomials have the same degree."""
        polynomial = [one + two for one, two in zip(self.polynomial, other.polynomial, strict=True)]
        poles, residues = np.append(self.poles, other.poles), np.concatenate([self.residues, other.residues])
        return PoleSum(polynomial, poles, residues)

    def in_s(self, viscous):
        """Sum over poles of s, for x = s^2 + viscous s; None where two poles of s coincide nearly.

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
    """Damping of the elastic strain.

    Attributes
    ----------
    law : {"hysteretic", "kelvin_voigt"}
    amount : float
        Loss factor [-], or time [s].
    modes : ndarray, shape (n, n)
        E. [1/s^2]
    coupling : ndarray, shape (n, 6)
        R. [N/(m sqrt(kg))]
    ends : ndarray, shape (6, 6)
        S. [N/m]
    """

    law: str
    amount: float
    modes: np.ndarray
    coupling: np.ndarray
    ends: np.ndarray

    def factor(self, s):
        """Complex loss factor: i loss factor in the upper half plane, or s time."""
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
        found = np.empty((size, size))
        found[:n, :n], found[n:, n:] = self.modes, self.ends
        found[:n, n:], found[n:, :n] = self.coupling, self.coupling.T
        return found


class CouplingDamping:
    """The modes of a cable that damping couples, and the forces at its ends with them.

    The equations are a polynomial in s, or in s^2 + viscous s where hysteretic damping alone couples the modes: that
    has half as many poles.

    Parameters
    ----------
    element : Superelement
    """

    def __init__(self, element):
        self.omega, self._near, self._viscous = element.omega, element.near, element.viscous
        self.windowed = element.windowed and len(element.omega) > SYSTEM.windows_from
        mass, damping, stiffness = element.matrices()
        hysteretic = element.strain is not None and element.strain.law == "hysteretic"
        self._squared = hysteretic and not element.uneven and not np.any(element.residual_damping)
        self.matrices = (stiffness, mass) if self._squared else (stiffness, damping, mass)

    def dynamic_stiffness(self, s, rows, columns):
        """Dynamic stiffness at some of the ends, see `Superelement.dynamic_stiffness`."""
        below = np.imag(s) < 0
        x = self._variable(np.where(below, np.conj(s), s))
        few = len(s) <= SYSTEM.solved_places  # of which poles cost more
        few &= self._near is None and "_found" not in self.__dict__
        by_poles = None if few else self.pole_sum
        value = by_poles(x, rows, columns) if by_poles else _solved(self.matrices, x, rows, columns, len(self.omega))
        if (real := np.imag(s) == 0).any():  # where hysteretic strain loses nothing
            lossless = [part.real for part in self.matrices]
            value[real] = _solved(lossless, x[real], rows, columns, len(self.omega))
        return np.where(below[:, None, None], value.conj(), value)

    def _variable(self, s):
        """Of the polynomial."""
        return s**2 + self._viscous * s if self._squared else s

    @property
    def pole_sum(self):
        """`PoleSum`; None where rounding spoils it."""
        return self._found[0]

    @cached_property
    @np.errstate(all="ignore")  # what is not finite is not trusted
    def _found(self):
        """`PoleSum`, and its (poles, left, right): the inverse for the modes is the sum of left right over x - pole.

        None and None where rounding spoils it.
        """
        near = self._near and self._near.coupling_damping._found[1]
        if near:
            resolvent = self._moved(self._near.coupling_damping.matrices, *near)
            return PoleSum.of(self.matrices, *resolvent), resolvent
        n = len(self.omega)
        of_modes = [part[:n, :n] for part in self.matrices]
        try:
            if self.windowed:
                resolvent = poles_in_windows(of_modes, self.omega)
                found = PoleSum.of(self.matrices, *resolvent)
                if self._difference(found, *resolvent) <= SYSTEM.trusted_windows:
                    return found, resolvent
        except np.linalg.LinAlgError:
            pass
        try:
            poles, vectors = eigen(of_modes, self.omega)
            for right in self._by_symmetry, self._by_inverse:
                left = shapes(vectors, self.omega)
                resolvent = poles, left, right(poles, left, vectors)
                found = PoleSum.of(self.matrices, *resolvent)
                if self._difference(found, *resolvent) <= SYSTEM.trusted:
                    return found, resolvent
        except np.linalg.LinAlgError:
            pass
        return None, None

    def _by_symmetry(self, poles, left, _):
        """`right` of poles that are apart: left^T over left^T Q' left, Q' the slope of the symmetric polynomial."""
        n, (_, *higher) = len(self.omega), self.matrices
        slope = sum(order * poles ** (order - 1) * (part[:n, :n] @ left) for order, part in enumerate(higher, 1))
        return (left / (left * slope).sum(axis=0)).T

    def _by_inverse(self, _, left, vectors):
        """`right` from the inverse of the eigenvectors, right for poles that coincide too."""
        inverse = np.linalg.inv(vectors)
        return inverse if self._squared else inverse[:, len(left) :]

    def _difference(self, found, poles, left, right):
        """Largest difference of a `PoleSum` from the forces Q_ee - Q_en q - q^T Q_ne + q^T Q_nn q, over their size.

        These are stationary in q = Q_nn^-1 Q_ne, so that their error is the square of that of q by the resolvent.
        """
        n, every = len(self.omega), slice(None)
        if not n:
            return 0.0
        x = self._variable(checked(self.omega))
        of_ends, pushed = (_polynomial([part[rows, n:] for part in self.matrices], x) for rows in np.s_[n:, :n])
        moved = left @ ((right @ pushed) / (x[:, None] - poles)[:, :, None])
        answer = sum(x[:, None, None] ** order * (part[:n, :n] @ moved) for order, part in enumerate(self.matrices))
        value = of_ends - np.swapaxes(pushed, 1, 2) @ moved + np.swapaxes(moved, 1, 2) @ (answer - pushed)
        size = np.abs(x[:, None] ** (len(self.matrices) - 1)) * np.diagonal(self.matrices[-1])[n:]
        size = size + np.abs(np.diagonal(self.matrices[0])[n:])
        size = np.sqrt(size[:, :, None] * size[:, None])
        error = np.abs(found(x, every, every) - value) / np.where(size > 0, size, 1.0)
        return error.max()

    @property
    def pole_sum_in_s(self):
        """`PoleSum` in s; None where rounding spoils it, or viscous damping makes poles coincide nearly."""
        return self.pole_sum.in_s(self._viscous) if self._squared and self.pole_sum else self.pole_sum

    def _moved(self, matrices, poles, left, right):
        """(poles, left, right) from those of `matrices` of modes of other frequencies and decay: poles to first order.

        The shapes are kept: of modes that nearly coincide both are taken to change by as much.
        """
        n = len(self.omega)
        changes = [np.diagonal(own - other)[:n] for own, other in zip(self.matrices, matrices, strict=True)]
        change = sum(part[:, None] * poles**power for power, part in enumerate(changes))
        moved = poles - (right.T * change * left).sum(axis=0)
        return moved, left, right if self._squared else right * (poles / moved)[:, None]

    @property
    def poles(self):
        """Upper half plane and real axis, none where rounding spoils them. [rad/s]"""
        if self.pole_sum is None:
            return np.zeros(0, dtype=complex)
        poles = self.pole_sum.poles
        if self._squared:
            poles = np.sqrt(self._viscous**2 / 4 + poles + 0j)
            poles = np.where(poles.imag < 0, -poles, poles) - self._viscous / 2
        return poles[poles.imag >= 0]


def checked(omega):
    """Places at which a sum over poles is checked, for modes at `omega`, shape (8,). [rad/s]"""
    return (0.03 + 1j) * np.geomspace(omega.min() / 10, np.median(omega), 8)


def _solved(matrices, x, rows, columns, n):
    """Forces at some ends per displacement of some, of n modes and the ends, by a system of equations for each x."""
    right = [part[:, n:][:, columns] for part in matrices]
    value = _polynomial([part[n:][rows] for part in right], x)
    for i in range(0, len(x) if n else 0, SYSTEM.systems_at_once):
        some = x[i : i + SYSTEM.systems_at_once]
        matrix = _polynomial([part[:n, :n] for part in matrices], some)
        moved = np.linalg.solve(matrix, _polynomial([part[:n] for part in right], some))
        value[i : i + SYSTEM.systems_at_once] -= _polynomial([part[n:, :n][rows] for part in matrices], some) @ moved
    return value


def _polynomial(matrices, x):
    """Sum of matrices of shape (r, c) times powers of x, from the zeroth on, shape (m, r, c)."""
    value, x = matrices[-1], x[:, None, None]
    for part in matrices[-2::-1]:
        value = value * x + part
    return value
