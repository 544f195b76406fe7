"""Damping that couples the modes of a cable with fixed ends: that of the strain, and viscous damping that is uneven.

What the modes take off the stiffness of the ends contains the inverse of a matrix for each s. It is a sum over the
poles, unless rounding spoils that sum; then systems of equations are solved.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError

ENDS = 0, 3  # movements of the ends, or the last one of fewer, for which sums over poles are checked
TRUSTED = 1e-11  # difference between the sum over poles and solved systems up to which the sum is used
MOST_DAMPED = 1e6  # loss factor at the lowest mode from which rounding spoils what damped strain leaves
FEW = 4  # places up to which solving is cheaper than finding the poles
AT_ONCE = 64  # systems of equations that are solved in one call


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
        moving = (1 / (x[:, None] - self.poles)) @ residues.reshape(len(residues), -1)
        value, x = -moving.reshape(len(x), *residues.shape[1:]), x[:, None, None]
        value += self.polynomial[-1][rows][:, columns]
        for part in self.polynomial[-2::-1]:
            value = value * x + part[rows][:, columns]
        return value


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

    @property
    def matrix(self):
        """[E R; R^T S], shape (n + 6, n + 6)."""
        return np.block([[self.modes, self.coupling], [self.coupling.T, self.ends]])


class StrainDamping:
    """The modes of a cable whose strain is damped.

    Parameters
    ----------
    element : Superelement
        With `strain`.
    """

    def __init__(self, element):
        self.strain, self.viscous = element.strain, element.viscous
        self.omega, self.coupling = element.omega, element.coupling
        self.stiffness, self.inertia = element.stiffness, element.inertia
        self.residual, self._matrices = element.residual_damping, element.matrices  # made where a sum needs them

    @property
    def spoilt(self):
        """Whether so much strain is damped that rounding spoils what is left."""
        return len(self.omega) > 0 and bool(np.abs(self.strain.factor(1j * self.omega.min())) > MOST_DAMPED)

    def check(self):
        """Refuse so much damped strain that rounding spoils what is left."""
        if self.spoilt:
            raise NoSolutionError(
                f"the strain is damped so much ({self.strain.law}, {self.strain.amount:g}) that rounding spoils the "
                f"response: cable.damping must be less"
            )

    def dynamic_stiffness(self, s, rows, columns):
        """See `Superelement.dynamic_stiffness`."""
        below = (np.imag(s) < 0) & (self.strain.law == "hysteretic")
        s = np.where(below, np.conj(s), s)
        few = len(s) <= FEW and "resolvent" not in self.__dict__
        if few or not len(self.omega) or self.resolvent is None:
            value = self._by_solving(s, rows, columns)
        else:
            value = self._pole_sum(self._variable(s), rows, columns)
        return np.where(below[:, None, None], value.conj(), value)

    def _variable(self, s):
        """Of the sum over poles."""
        return s**2 + self.viscous * s if self.strain.law == "hysteretic" else s

    def _drives(self, ends):
        """R and m of some ends."""
        return self.strain.coupling[:, ends], self.coupling[:, ends]

    def _by_solving(self, s, rows, columns):
        """The response by a system of equations for each s."""
        strain, (left, right) = self.strain, (self._drives(rows), self._drives(columns))
        factor, inertial = strain.factor(s)[:, None, None], (s**2 + self.viscous * s)[:, None, None]
        whole = self.stiffness + factor * strain.ends + inertial * self.inertia
        if np.any(self.residual):
            whole = whole + s[:, None, None] * self.residual
        value, unit = whole[:, rows][:, :, columns], np.eye(len(self.omega))
        for i in range(0, len(s) if len(self.omega) else 0, AT_ONCE):
            c, g = factor[i : i + AT_ONCE], inertial[i : i + AT_ONCE]
            matrix = np.diag(self.omega**2) + c * strain.modes + g * unit
            force = (c * left[0] + g * left[1]).swapaxes(1, 2)
            value[i : i + AT_ONCE] -= force @ np.linalg.solve(matrix, c * right[0] + g * right[1])
        return value

    @cached_property
    def _pole_sum(self):
        return self._sum_over(self.resolvent)

    def _sum_over(self, resolvent):
        """The `PoleSum` of what `resolvent` says."""
        value, left, right = resolvent
        mass, damping, stiffness = self._matrices()
        if self.strain.law == "hysteretic":
            return PoleSum.of((stiffness, mass), -value, left, right)
        return PoleSum.of((stiffness, damping, mass), value, left, right)

    @cached_property
    def resolvent(self):
        """(values, left, right) of damped strain; None where rounding spoils the sum.

        (W^2 + c E + g)^-1 is the sum of left right over (g + value), or over (s - value) for Kelvin-Voigt.
        """
        try:
            with np.errstate(all="ignore"):  # the check below finds what is not finite
                poles = self._slow_poles()
        except np.linalg.LinAlgError:
            return None
        s, ends = checked(self.omega), np.minimum(ENDS, len(self.inertia) - 1)
        inertial = (s**2 + self.viscous * s)[:, None, None]
        with np.errstate(all="ignore"):
            summed = self._sum_over(poles)(self._variable(s), ends, ends)
            solved = self._by_solving(s, ends, ends)
            size = np.abs(inertial) * np.diagonal(self.inertia)[ends] + np.diagonal(self.stiffness)[ends]
            size = np.sqrt(size.swapaxes(1, 2) * size)
            error = (np.abs(summed - solved) / np.where(size > 0, size, 1.0)).max()
        return poles if error <= TRUSTED else None

    def _slow_poles(self):
        """Poles of the modes that damped strain couples, the slow ones most accurate.

        The frequencies of the modes differ by many powers of ten, and an eigen-solution has rounding of the size of its
        largest eigenvalue: so the inverse is taken.
        """
        omega, n = self.omega, len(self.omega)
        unit = np.outer(omega, omega)
        elastic = self.strain.amount * self.strain.modes / unit
        if self.strain.law == "hysteretic":
            value, vector = np.linalg.eig(np.linalg.inv(np.eye(n) + 1j * elastic) / unit)
            return 1 / value, vector, np.linalg.inv(vector)
        # for W q and q': symmetric but for a sign, entries no larger than they must be
        slowness = np.diag(1 / omega)
        loss = elastic + self.viscous * slowness**2
        value, vector = np.linalg.eig(np.block([[-loss, -slowness], [slowness, np.zeros((n, n))]]))
        return 1 / value, vector[:n] / omega[:, None], np.linalg.inv(vector)[:, n:]

    @property
    def poles(self):
        """Upper half plane and real axis, none where rounding spoils them. [rad/s]"""
        if self.resolvent is None:
            return np.zeros(0, dtype=complex)
        value, viscous = self.resolvent[0], self.viscous
        if self.strain.law == "hysteretic":
            value = np.sqrt(viscous**2 / 4 - value + 0j)
            value = np.where(value.imag < 0, -value, value) - viscous / 2
        return value[value.imag >= 0]


class UnevenDamping:
    """The modes of a cable on which viscous damping acts, and not on the masses that it carries.

    Parameters
    ----------
    element : Superelement
        With `uneven`.
    """

    def __init__(self, element):
        self.omega, self.matrices, self._near = element.omega, element.matrices(), element.near

    def dynamic_stiffness(self, s, rows, columns):
        """See `Superelement.dynamic_stiffness`."""
        below, n = np.imag(s) < 0, len(self.omega)
        s = np.where(below, np.conj(s), s)
        if self._solved_for(s):
            every = [part[:, n:][:, columns] for part in self.matrices]
            value = _quadratic([part[n:][rows] for part in every], s)
            value = value - self.held_by_modes(s, rows) @ _quadratic([part[:n] for part in every], s)
        else:
            value = self.summed(s, rows, columns)
        return np.where(below[:, None, None], value.conj(), value)

    def _solved_for(self, s):
        """Whether equations are solved: places so few that poles cost more, or a sum that rounding spoils."""
        few = len(s) <= FEW and self._near is None and "pole_sum" not in self.__dict__
        return few or self.pole_sum is None

    @cached_property
    def summed(self):
        """`PoleSum`, or None where rounding spoils it."""
        return None if self.pole_sum is None else PoleSum.of(self.matrices[::-1], *self.pole_sum)

    def held_by_modes(self, s, ends):
        """Force on some ends that holds them per modal force, where viscous damping is uneven.

        Parameters
        ----------
        s : ndarray, shape (m,)
            In the upper half plane. [rad/s]
        ends : slice or list of int

        Returns
        -------
        ndarray, complex, shape (m, e, n)
            The rows of s^2 M + s C + K of these ends and all modes, times the inverse of the block of the modes.
            [sqrt(kg)]
        """
        s = np.asarray(s, dtype=complex)
        if self._solved_for(s):
            return self._held_by_solving(s, ends)
        return _held_by_poles(self.matrices, self.pole_sum, s, ends)

    def _held_by_solving(self, s, ends):
        """`held_by_modes` by a system of equations for each s."""
        n = len(self.omega)
        return self._solved(s, _quadratic([part[n:, :n][ends] for part in self.matrices], s))

    def _solved(self, s, force):
        """Forces, shape (m, e, n), times the inverse of the block of the modes, by a system of equations for each s."""
        n, found = len(self.omega), [force[:0]]
        inner = [part[:n, :n] for part in self.matrices]
        for i in range(0, len(s), AT_ONCE):
            matrix = _quadratic(inner, s[i : i + AT_ONCE])  # symmetric
            found.append(np.linalg.solve(matrix, force[i : i + AT_ONCE].swapaxes(1, 2)).swapaxes(1, 2))
        return np.concatenate(found)

    @cached_property
    def pole_sum(self):
        """(poles, shapes, inverse): the inverse of the block of the modes is the sum of products over s - pole.

        As in `StrainDamping._slow_poles` of the inverse, for W q and q'; None where rounding spoils the sum.
        """
        if not len(self.omega):
            return None
        if self._near is not None and self._near.uneven_damping.pole_sum is not None:
            return self._moved(self._near.uneven_damping)
        n, every = len(self.omega), slice(None)
        unit = np.outer(self.omega, self.omega)
        _, damping, stiffness = (part[:n, :n] / unit for part in self.matrices)
        s = checked(self.omega)
        try:
            with np.errstate(all="ignore"):  # what is not finite is not trusted
                give, slowness = np.linalg.inv(stiffness), np.diag(1 / self.omega)
                matrix = [[-give @ damping, -give / self.omega], [slowness, np.zeros((n, n))]]
                value, vectors = np.linalg.eig(np.block(matrix))
                found = 1 / value, vectors[:n] / self.omega[:, None], np.linalg.inv(vectors)[:, n:]
                summed, solved = _held_by_poles(self.matrices, found, s, every), self._held_by_solving(s, every)
                error = (np.abs(summed - solved).max(axis=(1, 2)) / np.abs(solved).max(axis=(1, 2))).max()
        except np.linalg.LinAlgError:
            return None
        return found if error <= TRUSTED else None

    def _moved(self, near):
        """`pole_sum` from that of modes of other frequencies and rates of decay, the poles to first order.

        The shapes are kept: of modes that nearly coincide both are taken to change by as much.
        """
        (poles, shapes, inverse), n = near.pole_sum, len(self.omega)
        _, damping, stiffness = (
            np.diagonal(own - other)[:n, None] for own, other in zip(self.matrices, near.matrices, strict=True)
        )
        moved = poles - (inverse.T * (stiffness + damping * poles) * shapes).sum(axis=0)
        return moved, shapes, inverse * (poles / moved)[:, None]

    @property
    def poles(self):
        """Upper half plane and real axis, none where rounding spoils them. [rad/s]"""
        poles = np.zeros(0, dtype=complex) if self.pole_sum is None else self.pole_sum[0]
        return poles[poles.imag >= 0]


def checked(omega):
    """Places at which a sum over poles is held against solved systems, for modes at `omega`, shape (8,). [rad/s]"""
    return (0.03 + 1j) * np.geomspace(omega.min() / 10, np.median(omega), 8)


def _held_by_poles(matrices, pole_sum, s, ends):
    """`UnevenDamping.held_by_modes` by a sum over poles."""
    (poles, shapes, inverse), n = pole_sum, len(pole_sum[1])
    forces = _quadratic([part[n:, :n][ends] @ shapes for part in matrices], s)
    return (forces / (s[:, None, None] - poles)) @ inverse


def _quadratic(matrices, s):
    """s^2 M + s C + K for M, C, K of shape (r, c), shape (m, r, c)."""
    mass, damping, stiffness = matrices
    s = s[:, None, None]
    return s * (s * mass + damping) + stiffness
