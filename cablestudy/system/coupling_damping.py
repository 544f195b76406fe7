"""Dynamic stiffness at the ends of a cable whose modes are coupled by damping: of strain, or uneven viscous damping.

The modes with fixed ends enter that stiffness by the inverse of a matrix that depends on the frequency s. The inverse
is evaluated as a sum over its poles, unless rounding spoils that sum; then equations are solved for each s.
"""

from dataclasses import dataclass
from math import prod
from operator import attrgetter

import numpy as np

from cablestudy.cable.matrices import product
from cablestudy.cable.records import stack, take_rows
from cablestudy.errors import NoSolutionError
from cablestudy.system.pole_windows import Resolvent, mode_amplitudes, poles_and_vectors, poles_in_windows
from cablestudy.system.together import batches, computed_together
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class PoleSum:
    """Dynamic stiffness at the e end displacements of a cable, as a polynomial and a sum over N poles in x.

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
    def of_polynomial(cls, matrices, resolvent, symmetric):
        """Condense the modes out of the matrix polynomial Q(x) of a cable: `PoleSum` of the stiffness at its ends.

        `matrices`, shape (..., n + e, n + e), are the coefficients of Q by ascending power of x, K and M or K, C and M,
        for n modes and then e ends; M is the identity for the modes. `resolvent` is Q_nn^-1 as a sum over N poles;
        `symmetric` says whether Q is. The stiffness at the ends is Q_ee - Q_en Q_nn^-1 Q_ne. With d, the degree of Q,
        this is a polynomial of degree d less x^d times the sum of residue_j/(x - pole_j), where

            residue_j = (Q_en(pole_j) left_j) (right_j Q_ne(pole_j))/pole_j^d.

        The coefficients of the polynomial are those of V Q U, U = [-K_nn^-1 K_ne; I] being the static shapes and
        V = [-K_en K_nn^-1, I], which is U^T of a symmetric K. The highest one is M_ee - M_en M_ne instead.
        """
        poles, left, right = resolvent.poles, resolvent.left, resolvent.right
        n = left.shape[-2]
        # blocks of each coefficient of Q
        of_modes, by_ends = [matrix[..., :n, :n] for matrix in matrices], [matrix[..., :n, n:] for matrix in matrices]
        by_modes, of_ends = [matrix[..., n:, :n] for matrix in matrices], [matrix[..., n:, n:] for matrix in matrices]
        shapes = _static_shapes(of_modes[0], by_ends[0])
        pushed = shapes  # V^T
        if not symmetric:
            pushed = _static_shapes(np.swapaxes(of_modes[0], -1, -2), np.swapaxes(by_modes[0], -1, -2))
        polynomial = [np.swapaxes(pushed, -1, -2) @ matrix @ shapes for matrix in matrices[:-1]]
        polynomial.append(of_ends[-1] - by_modes[-1] @ by_ends[-1])
        powers = [poles**order for order in range(len(matrices))]
        forces = sum(part @ left * power[..., None, :] for power, part in zip(powers, by_modes, strict=True))
        inputs = sum(right @ part * power[..., None] for power, part in zip(powers, by_ends, strict=True))
        inputs = inputs / powers[-1][..., None]
        return cls(polynomial, poles, np.swapaxes(forces, -1, -2)[..., None] * inputs[..., None, :])

    def __call__(self, x, rows=slice(None), columns=slice(None)):
        """The value for x of shape (..., m) and some of the ends, shape (..., m, r, c)."""
        residues = self.residues[..., rows, :][..., columns]
        ends = residues.shape[-2:]
        moving = (1 / (x[..., None] - self.poles[..., None, :])) @ residues.reshape(*self.poles.shape, prod(ends))
        *lower, highest = (matrix[..., None, rows, :][..., columns] for matrix in self.polynomial)
        return _polynomial([*lower, highest - moving.reshape(*x.shape, *ends)], x)


@dataclass(frozen=True)
class SumOverPoles:
    """Functions of s: r sums of a term for each of N poles, or pairs of poles, times s^2 + viscous s.

    Attributes
    ----------
    coefficients : ndarray, shape (r, N), or real, (2 r, N)
        Numerators of the terms: the first r of 2 r times s.
    poles : ndarray, shape (N,)
        p. [rad/s]
    others : ndarray, shape (N,), or None
        q of pairs, whose terms have the denominator (s - p) (s - q). [rad/s]
    viscous : float
        [1/s]
    """

    coefficients: np.ndarray
    poles: np.ndarray
    others: np.ndarray | None
    viscous: float = 0.0

    def __call__(self, s):
        """The sums at s of shape (f,), shape (r, f)."""
        terms = s - self.poles[:, None]
        if self.others is not None:
            terms *= s - self.others[:, None]
        return self._weighted(product(self.coefficients, _reciprocal(terms)), s, self.viscous)

    @property
    def signature(self):
        """Sizes of all arrays, by which sums are found that `of_rows` evaluates together: tuple."""
        return self.coefficients.shape, self.coefficients.dtype, self.others is None

    @staticmethod
    def of_rows(sums, row, s):
        """Values of n `SumOverPoles` of equal `signature`, at s of the sums `row`, both of shape (f,): shape (f, r)."""
        coefficients, terms = np.array([one.coefficients for one in sums])[row], s[:, None]
        terms = terms - np.array([one.poles for one in sums])[row]
        if sums[0].others is not None:
            terms *= s[:, None] - np.array([one.others for one in sums])[row]
        values, viscous = product(coefficients, _reciprocal(terms)[..., None])[..., 0], [one.viscous for one in sums]
        return sums[0]._weighted(values.T, s, np.array(viscous)[row]).T

    def _weighted(self, values, s, viscous):
        """The sums at s, shape (r, f), from those with each of the coefficients, shape (r or 2 r, f)."""
        if np.isrealobj(self.coefficients):
            count = len(values) // 2
            values = s * values[:count] + values[count:]
        return (s**2 + viscous * s) * values


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
        if self.ill_conditioned(omega):
            raise NoSolutionError(
                f"the strain is damped so much ({self.law}, {self.amount:g}) that rounding spoils the response: "
                f"cable.damping must be less"
            )

    def ill_conditioned(self, omega):
        """True if so much strain is damped that rounding spoils what is left."""
        return len(omega) > 0 and bool(np.abs(self.factor(1j * omega.min())) > SYSTEM.ill_conditioned_loss)

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
        self.symmetric = element.load_stiffness is None
        if not self.symmetric:
            stiffness = stiffness + element.load_stiffness
        hysteretic = element.strain is not None and element.strain.law == "hysteretic"
        self._squared = hysteretic and not element.uneven and not np.any(element.residual_damping)
        self.matrices = (stiffness, mass) if self._squared else (stiffness, damping, mass)

    def dynamic_stiffness(self, s, rows, columns):
        """Dynamic stiffness at some of the ends, see `Superelement.dynamic_stiffness`."""
        below = np.imag(s) < 0
        x = self.variable(np.where(below, np.conj(s), s))
        few = len(s) <= SYSTEM.solved_frequencies  # at few frequencies the poles cost more than they spare
        few &= self._similar is None and CouplingDamping._pole_sum_and_resolvent.known(self) is None
        by_poles = None if few else self.pole_sum
        value = by_poles(x, rows, columns) if by_poles else _solved(self.matrices, x, rows, columns, len(self.omega))
        if (real := np.imag(s) == 0).any():  # where hysteretic strain loses nothing
            lossless = [matrix.real for matrix in self.matrices]
            value[real] = _solved(lossless, x[real], rows, columns, len(self.omega))
        return np.where(below[:, None, None], value.conj(), value)

    def variable(self, s):
        """x of the polynomial for s."""
        return s**2 + self._viscous * s if self._squared else s

    @property
    def pole_sum(self):
        """`PoleSum`; None where rounding spoils it."""
        return self._pole_sum_and_resolvent[0]

    @computed_together
    def _pole_sum_and_resolvent(cables):
        """`PoleSum` of a cable, and the resolvent of its modes, by the cheapest method that is accurate enough.

        Returns
        -------
        pole_sum : PoleSum or None
            Dynamic stiffness at the ends as a sum over poles in x; None if rounding spoils every such sum.
        resolvent : Resolvent or None
            Of the matrix polynomial Q_nn(x) of the n modes.

        Notes
        -----
        An attribute that is computed for many cables in one call. The methods, in the order in which they are tried:

        1. If there is a similar element, its resolvent is corrected to first order. This serves for small changes of a
           loop gain. The error is not checked.
        2. The poles are found in windows of frequency, if the element allows this (`windowed`) and is symmetric.
        3. The poles of all modes are found at once.

        Of 2 and 3 the first sum is used whose error against the equations is small enough (`_relative_errors`).
        """
        by_all_modes = []
        for cable in cables:
            if (found := cable._cheaper_pole_sum()) is None:
                by_all_modes.append(cable)
            else:
                yield cable, found
        for members in batches(by_all_modes, attrgetter("_signature"), lambda cable: len(cable.matrices[0])):
            yield from zip(members, _pole_sums_by_all_modes(members), strict=True)

    @np.errstate(all="ignore")  # what is not finite is not trusted
    def _cheaper_pole_sum(self):
        """`_pole_sum_and_resolvent` by a similar element, or in windows of frequency; None where neither serves."""
        similar = self._similar and self._similar.coupling_damping
        _, resolvent_of_similar = similar._pole_sum_and_resolvent if similar else (None, None)
        if resolvent_of_similar:
            resolvent = self._to_first_order(similar.matrices, resolvent_of_similar)
            return PoleSum.of_polynomial(self.matrices, resolvent, self.symmetric), resolvent
        if not self.windowed or not self.symmetric:
            return None
        n = len(self.omega)
        try:
            resolvent = poles_in_windows([matrix[:n, :n] for matrix in self.matrices], self.omega)
            return _accurate_pole_sums([self], take_rows(resolvent, None), SYSTEM.trusted_windows)[0]
        except np.linalg.LinAlgError:
            return None

    def sum_over_poles(self, residues):
        """`SumOverPoles` of the N poles of `pole_sum`: what the modes take away from the stiffness of static shapes.

        Parameters
        ----------
        residues : ndarray, shape (N, r)
            Residues of r sums at each of the N poles.

        Notes
        -----
        Two poles p and q in s, with the residues R and S, are added as one term, in which s - p and s - q lose no
        digits:

            R/(s - p) + S/(s - q) = ((R + S) s - (R q + S p))/((s - p) (s - q)).

        A pole in x = s^2 + viscous s is such a pair of poles in s, with S = -R. Of a real polynomial in s the pairs are
        a pole and its conjugate, or two real poles: both coefficients are then real. Poles of a complex polynomial in s
        are not paired.
        """
        poles = self.pole_sum.poles
        if self._squared:
            half, middle = np.sqrt(self._viscous**2 / 4 + poles + 0j), -self._viscous / 2
            return SumOverPoles(residues.T, middle + half, middle - half, self._viscous)
        if np.iscomplexobj(self.matrices[0]):
            return SumOverPoles(residues.T, poles, None)
        p, q, of_p, of_q = _in_real_pairs(poles, residues)
        # (R + S) and -(R q + S p) of each pair
        coefficients = np.concatenate([(of_p + of_q).real, -(of_p * q[:, None] + of_q * p[:, None]).real], axis=1).T
        return SumOverPoles(coefficients, p, q)

    @property
    def polynomial_in_s(self):
        """Coefficients of s^0, s^1 and s^2 in the polynomial of `pole_sum`: list of ndarray."""
        static, *others = self.pole_sum.polynomial
        return [static, self._viscous * others[0], others[0]] if self._squared else [static, *others]

    def _to_first_order(self, matrices, resolvent):
        """`Resolvent` to first order from that of the similar `matrices` with other frequencies and decay.

        The shapes are kept: of modes that nearly coincide both are taken to change by as much.
        """
        n, poles, left, right = len(self.omega), resolvent.poles, resolvent.left, resolvent.right
        changes = [
            np.diagonal(own)[:n] - np.diagonal(other)[:n] for own, other in zip(self.matrices, matrices, strict=True)
        ]
        change = sum(diagonal[:, None] * poles**order for order, diagonal in enumerate(changes))
        changed = poles - (right.T * change * left).sum(axis=0)
        if not np.iscomplexobj(self.matrices[0]):  # `sum_over_poles` tells real poles by an imaginary part of zero
            changed[poles.imag == 0] = changed[poles.imag == 0].real
        return Resolvent(changed, left, right if self._squared else right * (poles / changed)[:, None])

    @property
    def _signature(self):
        """Sizes of all arrays, by which cables are found whose poles are computed together: tuple."""
        return self.symmetric, self.matrices[0].shape, len(self.omega), *(matrix.dtype for matrix in self.matrices)


def compute_pole_sums(cables):
    """Compute the `pole_sum` of many `CouplingDamping`, in one call for those with arrays of equal sizes."""
    CouplingDamping._pole_sum_and_resolvent.compute(cables)


@np.errstate(all="ignore")
def _pole_sums_by_all_modes(cables):
    """Find `PoleSum` and `Resolvent` of many cables, each by the poles of all its modes: list of pairs.

    Where poles nearly coincide the symmetry of the polynomial gives no accurate sum, and the inverse of the
    eigenvectors is tried, as it is where the polynomial is not symmetric. The pair is (None, None) where rounding
    spoils this sum too.
    """
    n, found, omega = len(cables[0].omega), [None] * len(cables), np.array([cable.omega for cable in cables])
    methods = [_right_by_symmetry, _right_by_inverse] if cables[0].symmetric else [_right_by_inverse]
    matrices = stack([[matrix[:n, :n] for matrix in cable.matrices] for cable in cables])
    try:
        poles, vectors = poles_and_vectors(matrices, omega)
        left = mode_amplitudes(vectors, omega)
        for right_vectors in methods:
            rows = [row for row, pair in enumerate(found) if pair is None]
            if rows:
                right = right_vectors([matrix[rows] for matrix in matrices], poles[rows], left[rows], vectors[rows])
                resolvent = Resolvent(poles[rows], left[rows], right)
                pairs = _accurate_pole_sums([cables[row] for row in rows], resolvent, SYSTEM.trusted)
                for row, pair in zip(rows, pairs, strict=True):
                    found[row] = pair
    except np.linalg.LinAlgError:
        if len(cables) > 1:
            return [_pole_sums_by_all_modes([cable])[0] for cable in cables]
    return [pair or (None, None) for pair in found]


def _right_by_symmetry(matrices, poles, left, _):
    """`right` of poles that are apart: left^T over left^T Q' left, Q' the slope of the symmetric polynomial."""
    slope = left if len(matrices) == 2 else 2 * poles[:, None] * left + product(matrices[1], left)
    return np.swapaxes(left / (left * slope).sum(axis=1, keepdims=True), 1, 2)


def _right_by_inverse(matrices, _, left, vectors):
    """`right` from the inverse of the eigenvectors, right for poles that coincide too."""
    inverse = np.linalg.inv(vectors)
    return inverse if len(matrices) == 2 else inverse[:, :, left.shape[1] :]


def _accurate_pole_sums(cables, resolvent, allowed):
    """`PoleSum` and `Resolvent` of each cable, None where the sum has more than the `allowed` relative error: list."""
    matrices = stack([cable.matrices for cable in cables])
    symmetric, difference = cables[0].symmetric, np.zeros(len(cables))
    sums = PoleSum.of_polynomial(matrices, resolvent, symmetric)
    if resolvent.left.shape[1]:
        s = _checked_frequencies(np.array([cable.omega for cable in cables]))
        x = np.array([cable.variable(of_row) for cable, of_row in zip(cables, s, strict=True)])
        difference = _relative_errors(matrices, x, sums, resolvent, symmetric)
    usable = (difference <= allowed).tolist()
    return [(take_rows(sums, row), take_rows(resolvent, row)) if usable[row] else None for row in range(len(cables))]


def _relative_errors(matrices, x, sums, resolvent, symmetric):
    """Largest relative error of the forces at the ends by a sum over poles, for each of r cables, shape (r,). [-]

    Parameters
    ----------
    matrices : list of ndarray, shape (r, n + e, n + e)
        Coefficients of the matrix polynomial Q(x) of n modes and e end displacements, from x^0 on.
    x : ndarray, shape (r, m)
        Values at which each cable is checked.
    sums : PoleSum
        Of all r cables: forces at the ends per displacement of the ends.
    resolvent : Resolvent
        Of all r cables: Q_nn(x)^-1 by poles.
    symmetric : bool
        True if Q is symmetric.

    Notes
    -----
    The sums are compared with

        Q_ee - Q_en q - p Q_ne + p Q_nn q,    q = Q_nn^-1 Q_ne,    p = Q_en Q_nn^-1,

    p being q^T of a symmetric Q. This form is stationary in p and q: their errors, which are computed from the same
    poles, change it by the product only. The error of an entry i j is taken over sqrt(a_i a_j), with the size
    a = |x|^d M_ii + |K_ii| of the forces at an end; d is the degree of Q, M its last coefficient and K its first.
    """
    poles, left, right = resolvent.poles, resolvent.left, resolvent.right
    n = left.shape[1]
    q_ee = _polynomial([matrix[:, None, n:, n:] for matrix in matrices], x)  # (r, m, e, e)
    q_ne = _polynomial([matrix[:, None, :n, n:] for matrix in matrices], x)  # (r, m, n, e)
    cables, values, _, ends = q_ne.shape
    # for all values of x at once: m e columns, each with its x
    columns, x_of_column = np.moveaxis(q_ne, 1, 2).reshape(cables, n, -1), np.repeat(x, ends, axis=-1)[:, None]
    q = left @ ((right @ columns) / (x_of_column - poles[:, :, None]))
    q_nn_q = q
    for matrix in matrices[-2::-1]:
        q_nn_q = q_nn_q * x_of_column + product(matrix[:, :n, :n], q)
    # q, and the residual Q_nn q - Q_ne, shapes (r, m, n, e)
    q, residual = (np.moveaxis(part.reshape(cables, n, values, ends), 1, 2) for part in (q, q_nn_q - columns))
    q_en, p = np.swapaxes(q_ne, 2, 3), np.swapaxes(q, 2, 3)
    if not symmetric:
        q_en = _polynomial([matrix[:, None, n:, :n] for matrix in matrices], x)  # (r, m, e, n)
        by_poles = (q_en @ left[:, None]) / (x[:, :, None, None] - poles[:, None, None])
        p = by_poles @ right[:, None]
    forces = q_ee - q_en @ q + p @ residual
    first, last = (np.diagonal(matrix, axis1=1, axis2=2)[:, None, n:] for matrix in (matrices[0], matrices[-1]))
    size = np.abs(x[..., None] ** (len(matrices) - 1)) * last + np.abs(first)  # a of each end, (r, m, e)
    size = np.sqrt(size[..., :, None] * size[..., None, :])
    error = np.abs(sums(x) - forces) / np.where(size > 0, size, 1.0)
    return error.max(axis=(1, 2, 3))


def _static_shapes(of_modes, by_ends):
    """Modes and ends per displacement of the ends, K_nn being `of_modes`, K_ne `by_ends`: shape (..., n + e, e)."""
    identity = np.broadcast_to(np.eye(by_ends.shape[-1]), (*by_ends.shape[:-2], *2 * by_ends.shape[-1:]))
    return np.concatenate([-np.linalg.solve(of_modes, by_ends), identity], axis=-2)


def _checked_frequencies(omega):
    """Complex frequencies at which a sum over poles is checked, for modes at `omega`, (..., n) -> (..., 8). [rad/s]"""
    # to the right of the imaginary axis, where no pole is near; from far below the modes to their middle
    return (0.03 + 1j) * np.geomspace(omega.min(axis=-1) / 10, np.median(omega, axis=-1), 8, axis=-1)


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


def _in_real_pairs(poles, residues):
    """Pair the N poles of a real polynomial, shape (N,), and their residues, shape (N, r): complex ones by conjugates.

    Returns two arrays of N/2 poles p and q, where a pole p above the real axis has its conjugate q and real poles are
    paired in their order; and two of the residues at p and q, shape (N/2, r).
    """
    upper, real = np.flatnonzero(poles.imag > 0), np.flatnonzero(poles.imag == 0)
    p, q = (poles[np.append(upper, real[part])] for part in (np.s_[::2], np.s_[1::2]))
    of_p, of_q = (residues[np.append(upper, real[part])] for part in (np.s_[::2], np.s_[1::2]))
    q[: len(upper)], of_q[: len(upper)] = q[: len(upper)].conj(), of_q[: len(upper)].conj()
    return p, q, of_p, of_q


def _reciprocal(values):
    """1/values, written over the values: these are the largest arrays of a loop gain, and new ones cost more time."""
    return np.reciprocal(values, out=values)


def _polynomial(matrices, x):
    """Sum of matrices of shape (..., r, c) times powers of x, shape (..., m), from the zeroth on: (..., m, r, c)."""
    x = x[..., None, None]
    first, *between, highest = matrices
    value = highest * x
    for matrix in reversed(between):  # in place: these may be large
        value += matrix
        value *= x
    value += first
    return value
