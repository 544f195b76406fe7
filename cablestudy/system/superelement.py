"""A cable at its two ends: static stiffness, mass, damping and the modes with fixed ends, in global axes.

This is the Craig-Bampton form (Craig and Bampton, AIAA Journal 6, 1968). With u the displacements of the ends and q the
modal amplitudes of the motion relative to the static shapes that the ends impose, m = -p/W^2,

    M = [I    m]      K = [W^2  0]      C = damping(M, K, strain)
        [m^T  J],         [0    k],

where k is the static end stiffness and J the mass of the static shapes. Modes that are left out keep their static part,
which is in k, and their mass, which is in J.

Damping, any sum of:

* viscous, a force per length on all motion of the cable: nu (M - B^T B), with nu = (damping per length)/(mass per
  length) and B^T B the mass of what the cable carries (`Superelement.carried`), on which no such force acts;
* modal, a ratio zeta for each mode with fixed ends, whose absolute amplitude is q + m u;
* hysteretic, EA (1 + i loss factor): i loss factor [E R; R^T S], which holds for Im s > 0;
* Kelvin-Voigt, EA (1 + s time): s time [E R; R^T S].

E, R and S are the elastic parts of the stiffness: of the modes, of modes against static shapes, of the static shapes.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError

GROUND, GONDOLA = 0, 3  # x of end 1 and of end 2 among the six end displacements
NAMES = tuple(f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz")
TRUSTED = 1e-11  # difference between the sum over poles and solved systems up to which the sum is used
MOST_DAMPED = 1e6  # loss factor at the lowest mode from which rounding spoils what damped strain leaves
FEW = 4  # places up to which solving is cheaper than finding the poles
AT_ONCE = 64  # systems of equations that are solved in one call
BLOCK = 128  # frequencies for which the modes are summed in one call: arrays that stay in the processor's cache


@dataclass(frozen=True)
class Damping:
    """How a cable loses energy; by default it does not.

    Attributes
    ----------
    model : {"modal", "hysteretic", "kelvin_voigt"}
    ratio, loss_factor, time : float
        Of the model: damping ratio [-], loss factor [-] or time [s].
    viscous : float
        Force per length and velocity, with any model. [N s/m^2]
    """

    model: str = "modal"
    ratio: float = 0.0
    loss_factor: float = 0.0
    time: float = 0.0
    viscous: float = 0.0


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


@dataclass(frozen=True)
class Superelement:
    """The cable between its two ends. Ends are ordered end 1 x, y, z, end 2 x, y, z.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Of the modes with fixed ends. [rad/s]
    participation : ndarray, shape (n, 6)
        p = psi^T K21: modal force per end displacement; less W^2 psi^T M21 where the mass is not lumped.
        [N/(m sqrt(kg))]
    damping_ratio : ndarray, shape (n,)
        Modal; where the strain is damped, the equivalent one. Viscous damping is not in it. [-]
    stiffness : ndarray, shape (6, 6)
        Static, interior condensed. [N/m]
    inertia : ndarray, shape (6, 6)
        Mass of the static shapes. [kg]
    strain : Strain or None
        None for modal damping.
    viscous : float
        Viscous damping per length over mass per length. [1/s]
    residual_damping : ndarray, shape (6, 6), or 0
        What the modal damping of omitted modes adds at the ends, where it was kept. [N s/m]
    carried : ndarray, shape (c, n + 6), or None
        B: displacement of each point mass along each axis times the root of the mass, by modes [-] and by ends
        [sqrt(kg)]; None without point masses.
    """

    omega: np.ndarray
    participation: np.ndarray
    damping_ratio: np.ndarray
    stiffness: np.ndarray
    inertia: np.ndarray
    strain: Strain | None = None
    viscous: float = 0.0
    residual_damping: np.ndarray | float = 0.0
    carried: np.ndarray | None = None

    @property
    def feedthrough(self):
        """D: static stiffness plus what the modes take off it, shape (6, 6). [N/m]"""
        scaled = self.participation / self.omega[:, None]
        return self.stiffness + scaled.T @ scaled

    @cached_property
    def coupling(self):
        """m: modal momentum per velocity of the ends, shape (n, 6). [sqrt(kg)]"""
        return -self.participation / self.omega[:, None] ** 2

    @cached_property
    def residual_inertia(self):
        """What the modes leave of `inertia`: the ends' own mass and the omitted modes', shape (6, 6). [kg]"""
        return self.inertia - self.coupling.T @ self.coupling

    @cached_property
    def decay(self):
        """Rate at which each mode with fixed ends decays, its coupling by damping left out, shape (n,). [1/s]"""
        rate = self.damping_ratio * self.omega
        if self.uneven:
            return rate + self.viscous / 2 * (1 - (self.carried[:, : len(rate)] ** 2).sum(axis=0))
        return rate + self.viscous / 2

    @property
    def uneven(self):
        """Whether viscous damping acts on the cable and not on what it carries, so that it couples modes."""
        return self.carried is not None and self.viscous != 0

    def select(self, chosen):
        """The same cable with only some modes; its static stiffness stays exact.

        Parameters
        ----------
        chosen : array of int or bool

        Returns
        -------
        Superelement
        """
        strain = self.strain
        if strain is not None:
            strain = replace(strain, modes=strain.modes[chosen][:, chosen], coupling=strain.coupling[chosen])
        return replace(
            self,
            omega=self.omega[chosen],
            participation=self.participation[chosen],
            damping_ratio=self.damping_ratio[chosen],
            strain=strain,
            carried=self._carried_by(lambda modes: modes[:, chosen]),
        )

    def _carried_by(self, new):
        """`carried` where the part of the modes is replaced by a function of it."""
        if self.carried is None:
            return None
        n = len(self.omega)
        return np.concatenate([new(self.carried[:, :n]), self.carried[:, n:]], axis=1)

    def combine(self, shapes):
        """The same cable with combinations of its modes as coordinates; its static stiffness stays exact.

        Parameters
        ----------
        shapes : ndarray, shape (n, k)
            Orthonormal columns, for which shapes^T W^2 shapes is diagonal.

        Returns
        -------
        Superelement
            What modal damping of the others adds at the ends is kept.
        """
        square, coupling = (self.omega**2) @ shapes**2, shapes.T @ self.coupling
        rate = 2 * self.damping_ratio * self.omega
        new = rate @ shapes**2
        strain, residual = self.strain, self.residual_damping
        if strain is not None:
            strain = replace(strain, modes=shapes.T @ strain.modes @ shapes, coupling=shapes.T @ strain.coupling)
        else:
            rest = self.coupling.T @ (rate[:, None] * self.coupling) - coupling.T @ (new[:, None] * coupling)
            residual = residual + rest
        return replace(
            self,
            omega=np.sqrt(square),
            participation=-square[:, None] * coupling,
            damping_ratio=new / (2 * np.sqrt(square)),
            strain=strain,
            residual_damping=residual,
            carried=self._carried_by(lambda modes: modes @ shapes),
        )

    def condense(self, chosen):
        """As `select`, but with the modal damping of the omitted modes as slow movements of the ends meet it."""
        kept = self.select(chosen)
        if self.strain is not None:
            return kept
        omitted = np.ones(len(self.omega), dtype=bool)
        omitted[chosen] = False
        left, rate = self.coupling[omitted], (2 * self.damping_ratio * self.omega)[omitted]
        return replace(kept, residual_damping=self.residual_damping + left.T @ (rate[:, None] * left))

    def matrices(self):
        """M, C and K of the modes and the six ends, each of shape (n + 6, n + 6); K is complex where hysteretic."""
        n, coupling = len(self.omega), self.coupling
        mass, stiffness = np.zeros((2, n + 6, n + 6))
        mass[np.arange(n), np.arange(n)], stiffness[np.arange(n), np.arange(n)] = 1.0, self.omega**2
        mass[:n, n:], mass[n:, :n], mass[n:, n:] = coupling, coupling.T, self.inertia
        stiffness[n:, n:] = self.stiffness
        damping = self.viscous * mass
        if self.uneven:
            damping = damping - self.viscous * (self.carried.T @ self.carried)
        if self.strain is None:
            absolute = np.concatenate([np.eye(n), coupling], axis=1)
            damping = damping + absolute.T @ ((2 * self.damping_ratio * self.omega)[:, None] * absolute)
        elif self.strain.law == "kelvin_voigt":
            damping = damping + self.strain.amount * self.strain.matrix
        else:
            stiffness = stiffness + 1j * self.strain.amount * self.strain.matrix
        damping[n:, n:] += self.residual_damping
        return mass, damping, stiffness

    def dynamic_stiffness(self, s, rows=slice(None), columns=slice(None)):
        """Force at the ends per displacement of the ends.

        Parameters
        ----------
        s : ndarray, shape (m,)
            Laplace variable, i omega for the frequency response. [rad/s]
        rows, columns : slice or list of int
            Which forces and which displacements, of the six.

        Returns
        -------
        ndarray, complex, shape (m, r, c)
            [N/m]

        Raises
        ------
        NoSolutionError
            So much damped strain that rounding spoils the response.

        Notes
        -----
        With g = s^2 + nu s: modal damping k + g (J - m^T m) + sum of p p^T r/(W^2 (W^2 + r)), r = g + 2 zeta W s;
        damped strain k + c S + g J - (c R + g m)^T (W^2 + c E + g)^-1 (c R + g m).
        Where viscous damping is uneven, by a system of equations for each s.
        """
        s = np.asarray(s, dtype=complex)
        if self.strain is not None:
            self._check_strain()
        if self.uneven:
            return self._coupled(s, rows, columns)
        if self.strain is not None:
            return self._strained(s, rows, columns)
        inertial, left, right = s**2 + self.viscous * s, self.participation[:, rows], self.participation[:, columns]
        value = self.stiffness[rows][:, columns] + inertial[:, None, None] * self.residual_inertia[rows][:, columns]
        if np.any(self.residual_damping):
            value = value + s[:, None, None] * self.residual_damping[rows][:, columns]
        products = left[:, :, None] * (right / self.omega[:, None] ** 2)[:, None, :]
        products = products.reshape(len(self.omega), left.shape[1] * right.shape[1])
        modal = [self._modal(s[i : i + BLOCK], products) for i in range(0, len(s), BLOCK)]
        return value + np.concatenate(modal or [products[:0]]).reshape(value.shape)

    def _coupled(self, s, rows, columns):
        """The dynamic stiffness where viscous damping is uneven."""
        below, n = np.imag(s) < 0, len(self.omega)
        s = np.where(below, np.conj(s), s)
        every = [part[:, n:][:, columns] for part in self.matrices()]
        value, driven = _quadratic([part[n:][rows] for part in every], s), [part[:n] for part in every]
        if self._pole_sum is None:
            value = value - self.held_by_modes(s, rows) @ _quadratic(driven, s)
        else:
            moved = _quadratic([(self._pole_sum[2] @ part).T for part in driven], s)
            value = value - self._by_pole(s, rows) @ moved.swapaxes(1, 2)
        return np.where(below[:, None, None], value.conj(), value)

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
        s, n = np.asarray(s, dtype=complex), len(self.omega)
        if self._pole_sum is None:
            return self._solved(s, _quadratic([part[n:, :n][ends] for part in self.matrices()], s))
        return self._by_pole(s, ends) @ self._pole_sum[2]

    def _by_pole(self, s, ends):
        """The same as a part of each pole of `_pole_sum`, shape (m, e, 2 n)."""
        (poles, shapes, _), n = self._pole_sum, len(self.omega)
        return _quadratic([part[n:, :n][ends] @ shapes for part in self.matrices()], s) / (s[:, None, None] - poles)

    def _solved(self, s, force):
        """Forces, shape (m, e, n), times the inverse of the block of the modes, by a system of equations for each s."""
        n, found = len(self.omega), [force[:0]]
        inner = [part[:n, :n] for part in self.matrices()]
        for i in range(0, len(s), AT_ONCE):
            matrix = _quadratic(inner, s[i : i + AT_ONCE])  # symmetric
            found.append(np.linalg.solve(matrix, force[i : i + AT_ONCE].swapaxes(1, 2)).swapaxes(1, 2))
        return np.concatenate(found)

    def _modal(self, s, products):
        """Sum over the modes of r/(W^2 + r) times some products."""
        square, rate = self.omega**2, self.viscous + 2 * self.damping_ratio * self.omega
        if s.real.any():
            inertial = s[:, None] * (s[:, None] + rate)
            return (inertial / (inertial + square)) @ products
        # on the imaginary axis in real numbers, which are several times faster
        gone, lost = s.imag[:, None] ** 2, s.imag[:, None] * rate
        left_over = square - gone
        size = left_over**2 + lost**2
        return ((lost**2 - gone * left_over) / size) @ products + 1j * ((lost / size) @ (square[:, None] * products))

    def _check_strain(self):
        """Refuse so much damped strain that rounding spoils what is left."""
        if np.abs(self.strain.factor(1j * self.omega.min(initial=np.inf))) > MOST_DAMPED and len(self.omega):
            raise NoSolutionError(
                f"the strain is damped so much ({self.strain.law}, {self.strain.amount:g}) that rounding spoils the "
                f"response: cable.damping must be less"
            )

    def _strained(self, s, rows, columns):
        strain, below = self.strain, (np.imag(s) < 0) & (self.strain.law == "hysteretic")
        s = np.where(below, np.conj(s), s)
        factor, inertial = strain.factor(s)[:, None, None], (s**2 + self.viscous * s)[:, None, None]
        value = (
            self.stiffness[rows][:, columns]
            + factor * strain.ends[rows][:, columns]
            + inertial * self.inertia[rows][:, columns]
        )
        if len(self.omega):
            few = len(s) <= FEW and "resolvent" not in self.__dict__
            if few or self.resolvent is None:
                value = value - self._by_solving(s, factor, inertial, rows, columns)
            else:
                value = value - self._by_poles(self.resolvent, s, factor, inertial, rows, columns)
        return np.where(below[:, None, None], value.conj(), value)

    def _drives(self, ends):
        """R and m of some ends."""
        return self.strain.coupling[:, ends], self.coupling[:, ends]

    def _by_poles(self, poles, s, factor, inertial, rows, columns):
        """(c R + g m)^T (W^2 + c E + g)^-1 (c R + g m), as a sum over the poles of the inverse."""
        value, vectors, inverse = poles
        left, right = self._drives(rows), self._drives(columns)
        left, right = [part.T @ vectors for part in left], [inverse @ part for part in right]

        def residues(one, other):
            return one.T[:, :, None] * other[:, None, :]

        by_power = np.stack([
            residues(left[0], right[0]),
            residues(left[0], right[1]) + residues(left[1], right[0]),
            residues(left[1], right[1]),
        ])  # fmt: skip
        weight = 1 / (inertial[:, 0] + value if self.strain.law == "hysteretic" else s[:, None] - value)
        strained, mixed, inert = (weight @ by_power.reshape(3, len(value), -1)).reshape(3, len(s), *by_power.shape[2:])
        return factor**2 * strained + factor * inertial * mixed + inertial**2 * inert

    def _by_solving(self, s, factor, inertial, rows, columns):
        """The same by a system of equations for each s."""
        found, unit = [], np.eye(len(self.omega))
        left, right = self._drives(rows), self._drives(columns)
        for i in range(0, len(s), AT_ONCE):
            c, g = factor[i : i + AT_ONCE], inertial[i : i + AT_ONCE]
            matrix = np.diag(self.omega**2) + c * self.strain.modes + g * unit
            force = (c * left[0] + g * left[1]).swapaxes(1, 2)
            found.append(force @ np.linalg.solve(matrix, c * right[0] + g * right[1]))
        return np.concatenate(found)

    @property
    def _checked(self):
        """Places at which a sum over poles is held against solved systems, shape (8,). [rad/s]"""
        return (0.03 + 1j) * np.geomspace(self.omega.min() / 10, np.median(self.omega), 8)

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
        s = self._checked
        factor, inertial = self.strain.factor(s)[:, None, None], (s**2 + self.viscous * s)[:, None, None]
        columns = [GROUND, GONDOLA]
        with np.errstate(all="ignore"):
            summed = self._by_poles(poles, s, factor, inertial, columns, columns)
            solved = self._by_solving(s, factor, inertial, columns, columns)
            size = np.abs(inertial) * np.diagonal(self.inertia)[columns] + np.diagonal(self.stiffness)[columns]
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

    @cached_property
    def poles(self):
        """Poles with fixed ends: upper half plane and real axis. [rad/s]"""
        if self.uneven and len(self.omega):
            poles = np.zeros(0, dtype=complex) if self._pole_sum is None else self._pole_sum[0]
            return poles[poles.imag >= 0]
        if self.strain is not None and len(self.omega):
            if self.resolvent is None:
                return np.zeros(0, dtype=complex)
            value = self.resolvent[0]
            if self.strain.law == "hysteretic":
                value = np.sqrt(self.viscous**2 / 4 - value + 0j)
                value = np.where(value.imag < 0, -value, value) - self.viscous / 2
            return value[value.imag >= 0]
        return damped_poles(self.omega, self.damping_ratio + self.viscous / (2 * self.omega))

    @cached_property
    def _pole_sum(self):
        """(poles, shapes, inverse): the inverse of the block of the modes is the sum of products over s - pole.

        As in `_slow_poles` of the inverse, for W q and q'; None where rounding spoils the sum.
        """
        if not len(self.omega):
            return None
        n, slowness = len(self.omega), np.diag(1 / self.omega)
        _, damping, stiffness = (part[:n, :n] for part in self.matrices())
        s = self._checked
        try:
            with np.errstate(all="ignore"):  # what is not finite is not trusted
                give = np.linalg.inv(slowness @ stiffness @ slowness)
                matrix = [[-give @ slowness @ damping @ slowness, -give @ slowness], [slowness, np.zeros((n, n))]]
                value, vectors = np.linalg.eig(np.block(matrix))
                poles, shapes, inverse = 1 / value, vectors[:n] / self.omega[:, None], np.linalg.inv(vectors)[:, n:]
                summed = (shapes / (s[:, None, None] - poles)) @ inverse
                solved = self._solved(s, np.broadcast_to(np.eye(n), (len(s), n, n)))
                error = (np.abs(summed - solved).max(axis=(1, 2)) / np.abs(solved).max(axis=(1, 2))).max()
        except np.linalg.LinAlgError:
            return None
        return (poles, shapes, inverse) if error <= TRUSTED else None


def _quadratic(matrices, s):
    """s^2 M + s C + K for M, C, K of shape (r, c), shape (m, r, c)."""
    mass, damping, stiffness = matrices
    s = s[:, None, None]
    return s * (s * mass + damping) + stiffness


def damped_poles(omega, ratio):
    """Poles of oscillators, upper half plane and real axis. [rad/s]

    Parameters
    ----------
    omega, ratio : ndarray, shape (n,)
        [rad/s], [-]
    """
    ratio = ratio.astype(complex)
    bend = np.sqrt(ratio**2 - 1)
    poles = np.concatenate([omega * (bend - ratio), -omega * (bend + ratio)])
    return poles[poles.imag >= 0]
