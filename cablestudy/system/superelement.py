"""A cable at its two ends: static stiffness, mass, damping and the modes with fixed ends, in global axes.

This is the Craig-Bampton form (Craig and Bampton, AIAA Journal 6, 1968). With u the displacements of the ends, q the
modal amplitudes of the motion relative to the static shapes that the ends impose, W = diag(`omega`) and m = -W^-2 p, p
being `participation`,

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

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import shares
from cablestudy.system.connected import connected
from cablestudy.system.coupling_damping import CouplingDamping, Strain
from cablestudy.system.tolerances import SYSTEM

GROUND, GONDOLA = 0, 3  # x of end 1 and of end 2 among the six end displacements
NAMES = tuple(f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz")


@dataclass(frozen=True)
class Superelement:
    """A cable as seen from its two ends, in the form of the module's docstring: end 1 x, y, z, then end 2 x, y, z.

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
        Damping at the ends by the modal damping of omitted modes, if kept, or of a cable without mass. [N s/m]
    carried : ndarray, shape (3 p, n + 6), or None
        B: displacement of each of p point masses along each axis times the root of the mass, by modes [-] and by ends
        [sqrt(kg)]; None without point masses.
    air : ndarray, shape (n + 6, n + 6), or None
        Damping by the wind, of modes and ends. [1/s], [N s/m]
    load_stiffness : ndarray, shape (n + 6, n + 6), or None
        Stiffness by loads that turn with the cable, which need not be symmetric: none of `matrices`, where undamped
        modes come from. [1/s^2], [N/m]
    near : Superelement or None
        Similar cable, with the same modes and nearly the same numbers: where damping couples modes, the poles
        follow from those of `near` to first order.
    windowed : bool
        True if the poles of many modes that damping couples may be found in windows, which leaves a small error.
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
    air: np.ndarray | None = None
    load_stiffness: np.ndarray | None = None
    near: "Superelement | None" = field(default=None, repr=False)
    windowed: bool = False

    @cached_property
    def coupling(self):
        """m: modal momentum per velocity of the ends, shape (n, 6). [sqrt(kg)]"""
        return -self.participation / self.omega[:, None] ** 2

    @cached_property
    def residual_inertia(self):
        """`inertia` without that of the modes: of the ends and of omitted modes, shape (6, 6). [kg]"""
        return self.inertia - self.coupling.T @ self.coupling

    @cached_property
    def decay(self):
        """Rate at which each mode with fixed ends decays, without coupling by damping, shape (n,). [1/s]"""
        rate = self.damping_ratio * self.omega + self.viscous / 2
        if self.carried is not None:
            rate = rate - self.viscous / 2 * (self.carried[:, : len(rate)] ** 2).sum(axis=0)
        return rate if self.air is None else rate + np.diagonal(self.air)[: len(rate)] / 2

    @property
    def uneven(self):
        """True if load stiffness couples modes, or viscous damping: of a cable with point masses, or by the wind."""
        of_loads = self.air is not None or self.load_stiffness is not None
        return (self.carried is not None and self.viscous != 0) or of_loads

    @property
    def coupled(self):
        """True if damping couples modes."""
        return self.strain is not None or self.uneven

    @property
    def moved_by_ends(self):
        """Which modes the ends move, directly or by other modes, array of bool, shape (n,): others have no response."""
        n, size = len(self.omega), np.abs(self.coupling)
        is_moved = (size > SYSTEM.uncoupled_entry * size.max(axis=0, initial=0.0)).any(axis=1)
        if is_moved.all():
            return is_moved
        return connected(*self.matrices(), np.arange(n + size.shape[1]) >= n)[:n]

    def select(self, chosen):
        """`Superelement` of the cable with only some modes; its static stiffness stays exact.

        Parameters
        ----------
        chosen : array of int or bool
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
            carried=self._carried_with(lambda modes: modes[:, chosen]),
            air=self._with_ends(self.air, chosen),
            load_stiffness=self._with_ends(self.load_stiffness, chosen),
        )

    def with_end_shapes(self, shapes):
        """Copy of the cable whose ends move in e given shapes only.

        The six end displacements are u = T v, and the amplitudes v of the shapes take their place.

        Parameters
        ----------
        shapes : ndarray, shape (6, e)
            T: end displacements x, y, z of end 1, then of end 2, in each shape.

        Returns
        -------
        Superelement
            Matrices of the ends become T^T k T, with e in place of 6 rows and columns; modes do not change.
        """
        n, strain = len(self.omega), self.strain
        if strain is not None:
            strain = replace(strain, coupling=strain.coupling @ shapes, ends=shapes.T @ strain.ends @ shapes)
        carried = self.carried
        if carried is not None:
            carried = np.concatenate([carried[:, :n], carried[:, n:] @ shapes], axis=1)

        def at_end_shapes(matrix):
            """Matrix of modes and ends as one of modes and end shapes."""
            if matrix is None:
                return None
            by_ends, of_ends = matrix[:n, n:] @ shapes, shapes.T @ matrix[n:, :n]
            return np.block([[matrix[:n, :n], by_ends], [of_ends, shapes.T @ matrix[n:, n:] @ shapes]])

        residual = self.residual_damping
        return replace(
            self,
            participation=self.participation @ shapes,
            stiffness=shapes.T @ self.stiffness @ shapes,
            inertia=shapes.T @ self.inertia @ shapes,
            strain=strain,
            residual_damping=shapes.T @ residual @ shapes if np.any(residual) else 0.0,
            carried=carried,
            air=at_end_shapes(self.air),
            load_stiffness=at_end_shapes(self.load_stiffness),
        )

    @property
    def with_loads_at_rest(self):
        """Copy whose load stiffness acts at the ends alone, as it does at rest: their `stiffness` has it."""
        if self.load_stiffness is None:
            return self
        return replace(self, stiffness=self.stiffness + self._loads_of(slice(0, 0)), load_stiffness=None)

    def _loads_of(self, chosen):
        """Load stiffness of some modes and the ends, which the other modes follow as at rest; None of none."""
        if self.load_stiffness is None:
            return None
        loads, rows = self.load_stiffness, np.arange(len(self.load_stiffness))
        modes, ends = np.split(rows, [len(self.omega)])
        kept, others = np.append(modes[chosen], ends), np.delete(modes, chosen)
        others_alone = np.diag(self.omega[others] ** 2) + loads[np.ix_(others, others)]
        followed = np.linalg.solve(others_alone, loads[np.ix_(others, kept)])
        return loads[np.ix_(kept, kept)] - loads[np.ix_(kept, others)] @ followed

    def _with_ends(self, matrix, chosen):
        """Rows and columns of the chosen modes and of all ends of a matrix of modes and ends; None of none."""
        if matrix is None:
            return None
        n = len(self.omega)
        rows = np.append(np.arange(n)[chosen], np.arange(n, len(matrix)))
        return matrix[np.ix_(rows, rows)]

    def _carried_with(self, change):
        """`carried` with its columns of modes replaced by `change` of them, a function."""
        if self.carried is None:
            return None
        n = len(self.omega)
        return np.concatenate([change(self.carried[:, :n]), self.carried[:, n:]], axis=1)

    def combine(self, shapes):
        """Copy of the cable with k combinations of its n modes as coordinates; its static stiffness stays exact.

        Parameters
        ----------
        shapes : ndarray, shape (n, k)
            R: orthonormal columns for which R^T W^2 R is diagonal, W being the frequencies of the modes.

        Returns
        -------
        Superelement
            With the frequencies sqrt(R^T W^2 R) and the coupling R^T m to the ends; static shapes of the ends stay. The
            elastic stiffness E of the modes, on which damping of strain acts, becomes R^T E R. Of modal damping the
            combinations keep the diagonal. The rest acts at the ends, against their slow movements.
            `load_stiffness` becomes that of `combined_loads`.
        """

        def combined(matrix):
            """Matrix of modes and ends as one of combinations and ends."""
            return None if matrix is None else with_ends(shapes).T @ matrix @ with_ends(shapes)

        square, coupling = (self.omega**2) @ shapes**2, shapes.T @ self.coupling
        rate = 2 * self.damping_ratio * self.omega
        combined_rate = rate @ shapes**2
        strain, residual = self.strain, self.residual_damping
        if strain is not None:
            strain = replace(strain, modes=shapes.T @ strain.modes @ shapes, coupling=shapes.T @ strain.coupling)
        else:
            of_modes = self.coupling.T @ (rate[:, None] * self.coupling)
            of_combined = coupling.T @ (combined_rate[:, None] * coupling)
            residual = residual + (of_modes - of_combined)
        return replace(
            self,
            omega=np.sqrt(square),
            participation=-square[:, None] * coupling,
            damping_ratio=combined_rate / (2 * np.sqrt(square)),
            strain=strain,
            residual_damping=residual,
            carried=self._carried_with(lambda modes: modes @ shapes),
            air=combined(self.air),
            load_stiffness=combined_loads(self.load_stiffness, self.omega, shapes),
        )

    def truncate(self, chosen):
        """Copy with some modes, by modal truncation: the others are held at zero, without compliance and inertia.

        Held at zero is the absolute amplitude q + m u of each mode left out: q is relative to the static shapes, u are
        the end displacements and m is the coupling. With the participation p = -W^2 m, the stiffness of the ends
        becomes k + sum of p p^T/W^2 over these modes, more than the static stiffness k of the cable.

        Parameters
        ----------
        chosen : ndarray of int, shape (k,)
            Indices of the modes to keep.

        Returns
        -------
        Superelement
            Of k modes, with that `stiffness`, and with the `inertia` J less the sum of m m^T.
        """
        kept, omitted = self.select(chosen), np.setdiff1d(np.arange(len(self.omega)), chosen)
        held, strain, carried = -self.coupling[omitted], kept.strain, kept.carried  # q = -m u
        if strain is not None:
            modes, by_ends = self.strain.modes, held.T @ self.strain.coupling[omitted]
            strain = replace(
                strain,
                coupling=strain.coupling + modes[np.ix_(chosen, omitted)] @ held,
                ends=strain.ends + by_ends + by_ends.T + held.T @ modes[np.ix_(omitted, omitted)] @ held,
            )
        if carried is not None:
            by_omitted = np.zeros_like(carried)
            by_omitted[:, len(kept.omega) :] = self.carried[:, omitted] @ held
            carried = carried + by_omitted
        space = with_ends(np.eye(len(self.omega))[:, chosen])
        space[omitted, len(kept.omega) :] = held
        air, loads = (
            None if matrix is None else space.T @ matrix @ space for matrix in (self.air, self.load_stiffness)
        )
        return replace(
            kept,
            stiffness=self.stiffness + held.T @ (self.omega[omitted, None] ** 2 * held),
            inertia=self.inertia - held.T @ held,
            strain=strain,
            carried=carried,
            air=air,
            load_stiffness=loads,
        )

    def inertia_share(self, force, displacement):
        """Share of each mode in the inertia |p_r p_c|/W^4 between a displacement of the ends and a force there.

        Parameters
        ----------
        force, displacement : int
            Which of the six end forces r and end displacements c.

        Returns
        -------
        ndarray, shape (n,)
            Sums to one. Its sum over omitted modes bounds their share in the lowest term of the response that their
            static part, which `stiffness` keeps, does not cover: |p_r p_c| w^2/W^4. [-]
        """
        mass = np.abs(self.coupling)
        return shares(mass[:, force] * mass[:, displacement])

    def condense(self, chosen):
        """Copy with only some modes, and at the ends the modal damping of the others against slow movements.

        The others follow the load stiffness as at rest.
        """
        kept = replace(self.select(chosen), load_stiffness=self._loads_of(chosen))
        if self.strain is not None:
            return kept
        omitted = np.ones(len(self.omega), dtype=bool)
        omitted[chosen] = False
        coupling, rate = self.coupling[omitted], (2 * self.damping_ratio * self.omega)[omitted]
        return replace(kept, residual_damping=self.residual_damping + coupling.T @ (rate[:, None] * coupling))

    def matrices(self):
        """Mass, damping and stiffness matrices of the n modes and the e ends, in this order.

        Returns
        -------
        mass, damping, stiffness : ndarray, shape (n + e, n + e)
            M, C and K of the module's docstring, in modal amplitudes relative to the static shapes and in end
            displacements; e is 6, or the number of shapes given to `with_end_shapes`. K is complex if damping is
            hysteretic.
        """
        (n, ends), coupling = self.participation.shape, self.coupling
        mass, stiffness = np.zeros((2, n + ends, n + ends))
        mass[np.arange(n), np.arange(n)], stiffness[np.arange(n), np.arange(n)] = 1.0, self.omega**2
        mass[:n, n:], mass[n:, :n], mass[n:, n:] = coupling, coupling.T, self.inertia
        stiffness[n:, n:] = self.stiffness
        damping = self.viscous * mass if self.air is None else self.viscous * mass + self.air
        if self.carried is not None:
            damping = damping - self.viscous * (self.carried.T @ self.carried)
        if self.strain is None:
            absolute = np.concatenate([np.eye(n), coupling], axis=1)  # q + m u
            damping = damping + absolute.T @ ((2 * self.damping_ratio * self.omega)[:, None] * absolute)
        elif self.strain.law == "kelvin_voigt":
            damping += self.strain.amount * self.strain.matrix
        else:
            stiffness = stiffness.astype(complex)
            stiffness.imag = self.strain.amount * self.strain.matrix
        damping[n:, n:] += self.residual_damping
        return mass, damping, stiffness

    def dynamic_stiffness(self, s, rows=slice(None), columns=slice(None)):
        """Dynamic stiffness: force at the ends per displacement of the ends, at m values of the Laplace variable s.

        Parameters
        ----------
        s : ndarray, shape (m,)
            i times the angular frequency for the frequency response. [rad/s]
        rows, columns : slice or list of int
            Which forces and which displacements, of the six: r and c of them. Default: all.

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
        With the end stiffness k and inertia J, frequencies W, damping ratios zeta, participations p and couplings m of
        the modes, viscous damping nu, the `residual_damping` D and g = s^2 + nu s, it is for modal damping

            k + g (J - m^T m) + s D + sum over modes of p p^T r/(W^2 (W^2 + r)),    r = g + 2 zeta W s.

        For damped strain it is, with its elastic parts E, R, S and the complex loss factor c of `Strain.factor` at s,

            k + c S + g J + s D - (c R + g m)^T (W^2 + c E + g)^-1 (c R + g m).
        """
        s = np.asarray(s, dtype=complex)
        if self.strain is not None:
            self.strain.check(self.omega)
        if self.coupled:
            return self.coupling_damping.dynamic_stiffness(s, rows, columns)
        g, p_rows, p_columns = s**2 + self.viscous * s, self.participation[:, rows], self.participation[:, columns]
        value = self.stiffness[rows][:, columns] + g[:, None, None] * self.residual_inertia[rows][:, columns]
        if np.any(self.residual_damping):
            value = value + s[:, None, None] * self.residual_damping[rows][:, columns]
        products = p_rows[:, :, None] * (p_columns / self.omega[:, None] ** 2)[:, None, :]  # p p^T/W^2
        products = products.reshape(len(self.omega), p_rows.shape[1] * p_columns.shape[1])
        block = SYSTEM.frequency_block
        modal = [self._modal(s[begin : begin + block], products) for begin in range(0, len(s), block)]
        return value + np.concatenate(modal or [products[:0]]).reshape(value.shape)

    @property
    def ill_conditioned(self):
        """True if so much strain is damped that rounding spoils the response: `dynamic_stiffness` refuses it."""
        return self.strain is not None and self.strain.ill_conditioned(self.omega)

    @cached_property
    def coupling_damping(self):
        """`CouplingDamping` of the modes, where damping couples them."""
        return CouplingDamping(self)

    def _modal(self, s, products):
        """Sum over the modes of r/(W^2 + r) times the rows of `products`, shape (m, p), see `dynamic_stiffness`."""
        square, rate = self.omega**2, self.viscous + 2 * self.damping_ratio * self.omega
        if s.real.any():
            inertial = s[:, None] * (s[:, None] + rate)
            return (inertial / (inertial + square)) @ products
        # on the imaginary axis in real numbers, which are several times faster
        inertial, damped = s.imag[:, None] ** 2, s.imag[:, None] * rate
        elastic = square - inertial
        size = elastic**2 + damped**2
        real, imaginary = (damped**2 - inertial * elastic) / size, damped / size
        return real @ products + 1j * (imaginary @ (square[:, None] * products))


def of_shapes(matrix, shapes):
    """Product of a matrix and shapes of combinations of modes, shape (r, k).

    Of many combinations most are single modes: their columns are copied.

    Parameters
    ----------
    matrix : ndarray, shape (r, n)
    shapes : ndarray, shape (n, k)
    """
    single = (np.count_nonzero(shapes, axis=0) == 1) & (shapes == 1.0).any(axis=0)
    if np.count_nonzero(single) < SYSTEM.many_modes:
        return matrix @ shapes
    product = np.empty((len(matrix), shapes.shape[1]))
    product[:, single] = matrix[:, np.argmax(shapes[:, single], axis=0)]
    product[:, ~single] = matrix @ shapes[:, ~single]
    return product


def combined_loads(loads, omega, shapes):
    """Load stiffness of k combinations of n modes and ends, which what they leave out of the modes follows as at rest.

    That moves by the compliance W^-2 - R (R^T W^2 R)^-1 R^T under these loads: with it static responses of light bodies
    in storms are those of all modes to 4e-8, without it to 2e-5.

    Parameters
    ----------
    loads : ndarray, shape (n + 6, n + 6), or None
        Load stiffness of all modes and ends, see `Superelement`.
    omega : ndarray, shape (n,)
        W. [rad/s]
    shapes : ndarray, shape (n, k)
        R, as of `Superelement.combine`.

    Returns
    -------
    ndarray, shape (k + 6, k + 6), or None
    """
    if loads is None:
        return None
    (n, count), combinations = shapes.shape, with_ends(shapes)
    pushed, pushing = of_shapes(loads, combinations), of_shapes(loads.T, combinations)
    combined = of_shapes(pushed.T, combinations).T
    if count == n:
        return combined
    # of the compliance W^-2 of all modes the combinations have R (R^T W^2 R)^-1 R^T
    of_all = pushing[:n].T @ (pushed[:n] / omega[:, None] ** 2)
    return combined - of_all + (combined[:, :count] / (omega**2 @ shapes**2)) @ combined[:count]


def with_ends(shapes):
    """Combinations of modes, shape (n, k), as those of modes and six unchanged ends, shape (n + 6, k + 6)."""
    n, count = shapes.shape
    combinations = np.zeros((n + 6, count + 6))
    combinations[:n, :count], combinations[n:, count:] = shapes, np.eye(6)
    return combinations
