"""Cables, bodies and winches as one linear system of second order with inputs u and outputs y.

    M z'' + C z' + K z = B0 u + B1 u' + B2 u'',      y = C0 z + C1 z' + C2 z'' + D0 u + D1 u' + D2 u''

M and K are symmetric and positive definite. K is complex where damping is hysteretic, and with it B0, C0 and D0: the
model then holds for Im s > 0, and `LinearSystem.viscous` makes a real one of it.

As `assemble` makes it, z are the modal amplitudes of all cables and then the displacements of the bodies, and u what
winches impose. The ends of cable i move by u_i = G_i x + H_i u, x being the displacements of the bodies: G_i and H_i
say where it is attached, and the matrices of the system are sums over the superelements.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.system.first_order import equations
from cablestudy.system.residues import eigen
from cablestudy.system.tangent import factors_of_each
from cablestudy.system.tolerances import SYSTEM

UNSTABLE = "the equilibrium is not stable: it has no modes"
MASSLESS_MOTION = "the state space needs a mass of everything that moves"
MODAL = "sqrt(kg) m"  # unit of a modal amplitude


@dataclass(frozen=True)
class LinearSystem:
    """The system of the module's docstring: n coordinates, i inputs, o outputs.

    Attributes
    ----------
    mass, damping, stiffness : ndarray or sparse array, shape (n, n)
        M, C and K. Sparse matrices serve `lowest`.
    b : tuple of 3 ndarray, shape (n, i)
        B0, B1, B2.
    bodies : int
        How many of the coordinates, the last ones, are displacements of bodies.
    c : tuple of 3 ndarray, shape (o, n)
        C0, C1, C2.
    d : tuple of 3 ndarray, shape (o, i)
        D0, D1, D2.
    coordinates, inputs, outputs : tuple of (str, str)
        Name and unit of each.
    feedback : tuple of ActuatorFeedback
        Forces f = gain(s) acts measured z of actuators, see `control.motion`.
    scale : ndarray, shape (n,), optional
        By what each displacement is weighted as a state; without it by about its frequency alone. [rad/s]
    shapes : ndarray, shape (m, k), optional
        Coordinates of the system that this one reduces, per each of its first k coordinates; its others do not move
        them.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    b: tuple = ()
    bodies: int = 1
    c: tuple = ()
    d: tuple = ()
    coordinates: tuple = ()
    inputs: tuple = ()
    outputs: tuple = ()
    feedback: tuple = ()
    scale: np.ndarray | None = None
    shapes: np.ndarray | None = None

    def __len__(self):
        return self.mass.shape[0]

    @cached_property
    def strain_modes(self):
        """All undamped modes, winches at rest, scaled to unit strain energy v^T K v = 1.

        Returns
        -------
        compliance : ndarray, shape (n,)
            1/W^2 = v^T M v, W the angular frequency; descending. [s^2]
        shapes : ndarray, shape (n, n)
            The modes v are its columns.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable.

        Notes
        -----
        With K = L L^T the eigenvalues of L^-1 M L^-T are 1/W^2: the lowest frequencies have all digits, however heavy
        the bodies, and the quotients v^T M v those of the high modes too. Coordinates without mass have 1/W^2 = 0.
        """
        mass, lower = dense(self.mass), _cholesky(dense(self.stiffness).real)
        lower_inverse_mass = np.linalg.solve(lower, mass)
        _, vectors = np.linalg.eigh(np.linalg.solve(lower, lower_inverse_mass.T))
        shapes = np.linalg.solve(lower.T, vectors)
        compliance = np.maximum((shapes * (mass @ shapes)).sum(axis=0), 0.0)
        order = np.argsort(-compliance, kind="stable")
        return compliance[order], shapes[:, order]

    @cached_property
    def modes(self):
        """All undamped modes: angular frequencies, and shares in the static compliance of each displacement of bodies.

        Returns
        -------
        omega : ndarray, shape (n,)
            Ascending. [rad/s]
        shares : ndarray, shape (b, n)
            The squares of the `strain_modes` over their sum. [-]
        """
        compliance, shapes = self.strain_modes
        square = shapes[len(shapes) - self.bodies :] ** 2
        omega = 1 / np.sqrt(np.maximum(compliance, np.finfo(float).tiny))
        return omega, square / square.sum(axis=1, keepdims=True)

    def lowest(self, count):
        """The lowest undamped modes, winches at rest; of a large system by Lanczos iteration.

        Parameters
        ----------
        count : int
            Number of modes; all if the system has fewer of finite frequency.

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
        size = len(self)
        if not size:
            return np.zeros(0), np.zeros((0, 0))
        if size <= SYSTEM.dense_coordinates or 2 * count > size:
            compliance, shapes = self.strain_modes
            compliance, shapes = compliance[:count], shapes[:, :count]
        else:
            factors = _factors(self.stiffness.real)
            shapes = _lanczos(size, factors.solve, self.mass.__matmul__, count)
            shapes = shapes / np.sqrt((shapes * (self.stiffness.real @ shapes)).sum(axis=0))
            compliance = (shapes * (self.mass @ shapes)).sum(axis=0)
        omega, shapes = _normalised(shapes, compliance)
        finite = np.isfinite(omega)
        return omega[finite], shapes[:, finite]

    def compliance(self, forces):
        """Static displacements by forces, shape (n, r) both, the winches at rest and without damping."""
        if isinstance(self.stiffness, np.ndarray):
            return np.linalg.solve(self.stiffness.real, forces)
        return _factors(self.stiffness.real).solve(forces)

    @cached_property
    def unit(self):
        """Weight of each displacement as a state: `scale`, or about the frequency of its coordinate alone. [rad/s]"""
        if self.scale is not None:
            return self.scale
        stiffness, mass = np.diagonal(self.stiffness).real, np.diagonal(self.mass)
        return np.sqrt(np.where(stiffness > 0, stiffness, mass) / mass)

    @cached_property
    def _has_unit_mass(self):
        """True if M is the identity, but for rounding."""
        return bool(np.abs(self.mass - np.eye(len(self))).max(initial=0.0) < SYSTEM.entry_rounding)

    def accelerated(self, forces):
        """Accelerations by forces on the coordinates, M^-1 f, shape (n, r)."""
        return forces if self._has_unit_mass else np.linalg.solve(self.mass, forces)

    @cached_property
    def dissipates(self):
        """True if it is known without its poles that none grows, the inputs at rest, since no motion gains energy.

        Of a pole s = a + i b with b > 0 and the shape v, a = -v^H (b C + Im K) v/(2 b v^H M v) where M, C and K are
        symmetric and nothing is fed back: C and Im K must have no negative eigenvalues, M and Re K no others.
        """
        losses = [self.damping] + [self.stiffness.imag] * np.iscomplexobj(self.stiffness)
        if self.feedback or not all(_only_dissipates(part) for part in losses):
            return False
        return bool(np.linalg.eigvalsh(self.stiffness.real).min(initial=np.inf) > 0)

    @cached_property
    def equations(self):
        """`Equations` of first order, winches at rest and without inputs."""
        return equations(self)

    @cached_property
    def eigen(self):
        """`Eigen` of `equations`."""
        return eigen(self.equations.fixed)

    @cached_property
    def poles(self):
        """Poles with winches at rest, in the upper half plane and on the real axis. [rad/s]"""
        return upper(np.linalg.eigvals(self.equations.fixed))

    @cached_property
    def _flat_matrices(self):
        """K, C and M, the entries of each in a row, shape (3, n^2)."""
        return np.stack([self.stiffness.real, self.damping, self.mass]).reshape(3, -1)

    @cached_property
    def static_stiffness(self):
        """Real part of the `dynamic_stiffness` at rest, shape (n, n)."""
        return self.dynamic_stiffness(np.zeros(1))[0].real

    def dynamic_stiffness(self, s):
        """Forces per displacement of the coordinates, D = s^2 M + s C + K, shape (f, n, n), inputs at rest.

        Parameters
        ----------
        s : array_like, shape (f,)
            With Im s > 0 where the stiffness is complex. [rad/s]
        """
        powers = np.asarray(s, dtype=complex)[:, None] ** np.arange(3)
        dynamic = np.empty((len(powers), *self.mass.shape), dtype=complex)
        # real and imaginary part apart: one product of real matrices each
        dynamic.real = (powers.real @ self._flat_matrices).reshape(dynamic.shape)
        dynamic.imag = (powers.imag @ self._flat_matrices).reshape(dynamic.shape)
        if np.iscomplexobj(self.stiffness):
            dynamic.imag += self.stiffness.imag
        s = powers[:, 1, None, None]
        for feedback in self.feedback:
            dynamic = dynamic - feedback.gain(s) * np.outer(feedback.acts, feedback.measured)
        return dynamic

    def pulled(self, s):
        """Forces on the coordinates per input, B0 + s B1 + s^2 B2, shape (f, n, i)."""
        return polynomial(self.b, s)

    def within(self, space, imposed=None, inputs=()):
        """The system with new coordinates q and with motions that inputs v impose: z = S q + N v.

        Parameters
        ----------
        space : ndarray, shape (n, r)
            S: independent columns, the motions that stay free.
        imposed : ndarray, shape (n, j), optional
            N: motion imposed by each further input v; these inputs come before those of the system.
        inputs : tuple of (str, str)
            Name and unit of each further input.
        """
        b, d = tuple(space.T @ matrix for matrix in self.b), self.d
        if imposed is not None:
            forces = (-space.T @ matrix @ imposed for matrix in (self.stiffness, self.damping, self.mass))
            b = tuple(np.concatenate(columns, axis=1) for columns in zip(forces, b, strict=True))
            imposed_outputs = (matrix @ imposed for matrix in self.c)
            d = tuple(np.concatenate(columns, axis=1) for columns in zip(imposed_outputs, d, strict=True))
        return replace(
            self,
            mass=space.T @ self.mass @ space,
            damping=space.T @ self.damping @ space,
            stiffness=space.T @ self.stiffness @ space,
            b=b,
            c=tuple(matrix @ space for matrix in self.c),
            d=d,
            inputs=(*inputs, *self.inputs),
            feedback=tuple(replace(f, measured=f.measured @ space, acts=f.acts @ space) for f in self.feedback),
            scale=None,
            shapes=None,
        )

    def with_forces(self, forces, inputs=(), direct=None):
        """The system with forces as further inputs.

        Parameters
        ----------
        forces : ndarray, shape (n, j)
            On each coordinate by each of them.
        inputs : tuple of (str, str)
            Name and unit of each.
        direct : ndarray, shape (o, j), optional
            Their share in each output where nothing moves; by default none.
        """
        direct = np.zeros((len(self.c[0]), forces.shape[1])) if direct is None else direct
        return replace(
            self,
            b=tuple(np.concatenate([part, forces * (order == 0)], axis=1) for order, part in enumerate(self.b)),
            d=tuple(np.concatenate([part, direct * (order == 0)], axis=1) for order, part in enumerate(self.d)),
            inputs=(*self.inputs, *inputs),
        )

    def with_damped_bodies(self, damping):
        """The system with further viscous damping of the displacements of its bodies, shape (b, b), or 0."""
        modal = len(self) - self.bodies
        if isinstance(self.damping, np.ndarray):
            added = np.broadcast_to(damping, (self.bodies, self.bodies))
            return replace(self, damping=self.damping + np.pad(added, (modal, 0)))
        from scipy.sparse import coo_array

        added = coo_array(damping if np.ndim(damping) else (self.bodies, self.bodies))
        rows, columns = added.coords
        added = coo_array((added.data, (rows + modal, columns + modal)), shape=self.damping.shape)
        return replace(self, damping=(self.damping + added).tocsc())

    def viscous(self):
        """The system with viscous damping in place of a complex stiffness; itself where its stiffness is real.

        Returns
        -------
        LinearSystem
            Each undamped mode has the viscous damping that dissipates as much energy per cycle; outputs are without
            their damped part.

        Raises
        ------
        NoSolutionError
            Something that moves has no mass.
        """
        if not np.iscomplexobj(self.stiffness):
            return self
        stiffness, damping = self.stiffness.real, self.damping + equivalent_viscous(self.mass, self.stiffness)
        b, c, d = (tuple(matrix.real for matrix in matrices) for matrices in (self.b, self.c, self.d))
        return replace(self, damping=damping, stiffness=stiffness, b=b, c=c, d=d)

    def inertia_share(self, output, input_):
        """Share of each mode in the inertia between an input and an output of given numbers, shape (n,). [-]

        About the static displacements K^-1 B0 u a mode moves by w^2 m/(W^2 - w^2) with m = Phi^T (B0/W^2 - B2), and at
        its frequency the output is W^2 (C0/W^2 - C2) Phi of it. The share is that of |(C0/W^2 - C2) Phi m|, for two
        ends of a cable as in `Superelement.inertia_share`.
        """
        compliance, shapes = self.strain_modes
        inertia = compliance * (shapes.T @ self.b[0][:, input_]) - shapes.T @ self.b[2][:, input_]
        observed = compliance * (self.c[0][output] @ shapes) - self.c[2][output] @ shapes
        # W^2, as if the shapes were mass-normalised; none of motions without mass
        square = np.where(compliance > 0, 1 / np.where(compliance > 0, compliance, 1.0), 0.0)
        return shares(np.abs(observed * inertia) * square)

    def keep(self, chosen):
        """The system reduced to some of its modes, with the static response of the others to the inputs.

        Parameters
        ----------
        chosen : ndarray of int
            Modes to keep, from 0.

        Returns
        -------
        LinearSystem
            Its coordinates are modal amplitudes.

        Notes
        -----
        Of the modes left out the static part stays (mode acceleration method: Williams, Quarterly of Mechanics and
        Applied Mathematics 2, 1949): z = Phi q + S u with S = K^-1 B0 - Phi Omega^-2 Phi^T B0.
        """
        others = np.delete(self.strain_modes[1], chosen, axis=1)
        return self._of_modes(chosen, others @ (others.T @ self.b[0]), self.c, self.d)

    def truncate(self, chosen):
        """The system reduced to some of its modes, the others left out with their static response: modal truncation.

        It shows the error that `keep` avoids. Parameters and result are those of `keep`.

        Notes
        -----
        The displacements of the modes left out are held at zero, relative to the movement P B2 u of the inputs itself:
        z = Phi q + P B2 u with P = M^-1 - Phi Phi^T, the sum of phi phi^T over the modes left out. The forces that hold
        them would appear in the outputs, as if they were inertia forces, by C2 z'': D0, D1 and C1 take them out again.
        Without damping the response of each mode left out is missing, c g/(W^2 + s^2) with c = (C0 - W^2 C2) phi and
        g = phi^T (B0 - W^2 B2). Motions without mass are at rest.
        """
        compliance, shapes = self.strain_modes
        others, square = _massive(np.delete(shapes, chosen, axis=1), np.delete(compliance, chosen))
        static, c2_p = others @ (others.T @ self.b[2]), self.c[2] @ others @ others.T
        by_holding = self.c[2] @ (others @ (others.T @ self.b[0] - square[:, None] * (others.T @ self.b[2])))
        c = self.c[0], self.c[1] - c2_p @ self.damping, self.c[2]
        d = self.d[0] + by_holding, self.d[1] + c2_p @ self.b[1], self.d[2]
        return self._of_modes(chosen, static, c, d)

    def _of_modes(self, chosen, static, c, d):
        """The system in modal amplitudes q and static displacements by the inputs: z = Phi q + S u.

        Parameters
        ----------
        chosen : ndarray of int
            Modes of the columns of Phi, from 0.
        static : ndarray, shape (n, i)
            S: displacement of each coordinate by a unit of each input.
        c, d : tuple of 3 ndarray, shapes (o, n) and (o, i)
            C0 to C2 and D0 to D2: outputs per z, z', z'' and per u, u', u''.
        """
        compliance, shapes = self.strain_modes
        omega = 1 / np.sqrt(compliance[chosen])
        kept = shapes[:, chosen] * omega
        b0, b1, b2 = (kept.T @ matrix for matrix in self.b)
        return replace(
            self,
            mass=np.eye(len(omega)),
            damping=kept.T @ self.damping @ kept,
            stiffness=np.diag(omega**2),
            b=(b0, b1 - kept.T @ (self.damping @ static), b2),
            c=tuple(matrix @ kept for matrix in c),
            d=tuple(direct + matrix @ static for direct, matrix in zip(d, c, strict=True)),
            bodies=0,
            coordinates=tuple((f"mode_{k + 1}", MODAL) for k in np.asarray(chosen).tolist()),
        )

    @np.errstate(all="ignore")
    def response(self, output, input_, frequency):
        """One output for a unit input, complex, shape (m,); not finite at an undamped pole.

        Parameters
        ----------
        output, input_ : int
            Numbers of the output and of the input.
        frequency : ndarray, shape (m,)
            [Hz]
        """
        at_once = max(1, SYSTEM.response_entries // max(1, len(self.mass)) ** 2)  # frequencies whose matrices fit
        pieces = np.split(frequency, range(at_once, len(frequency), at_once))
        return np.concatenate([self._response(output, input_, 2j * np.pi * piece) for piece in pieces])

    def _response(self, output, input_, s):
        """`response` at values of s, shape (f,), solved at once. [rad/s]"""
        dynamic = polynomial((self.stiffness, self.damping, self.mass), s)
        force = polynomial([matrix[:, input_] for matrix in self.b], s)
        observed = polynomial([matrix[output] for matrix in self.c], s)
        direct = polynomial([matrix[output, input_] for matrix in self.d], s)
        return (observed * solved(dynamic, force[..., None])[..., 0]).sum(axis=-1) + direct


def equivalent_viscous(mass, stiffness):
    """Viscous damping that gives each undamped mode the energy loss per cycle of a complex stiffness.

    Its damping ratio is then half of the loss factor times the elastic share of its stiffness. Not a number where an
    entry of either matrix, shape (n, n), is not finite.
    """
    if not np.isfinite(mass.sum() + stiffness.sum()):
        return np.full(mass.shape, np.nan)
    try:
        np.linalg.cholesky(mass)
    except np.linalg.LinAlgError:
        raise NoSolutionError(MASSLESS_MOTION) from None
    compliance, shapes = LinearSystem(mass, np.zeros_like(mass), stiffness).strain_modes
    omega = 1 / np.sqrt(compliance)
    momentum = mass @ shapes * omega
    modal_damping = omega * (shapes * (stiffness.imag @ shapes)).sum(axis=0)
    return momentum * modal_damping @ momentum.T


def polynomial(coefficients, s):
    """Values a + s b + s^2 c of three arrays of one shape (...), for each s of shape (f,): shape (f, ...)."""
    a, b, c = coefficients
    s = np.reshape(s, (-1, *[1] * np.ndim(a)))
    return a + s * b + s**2 * c


def solved(matrices, right):
    """Solutions of linear systems, not a number where one is singular, shapes (m, n, n) and (m, n, 1)."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan, dtype=complex)
        half = len(matrices) // 2
        return np.concatenate([solved(matrices[:half], right[:half]), solved(matrices[half:], right[half:])])


def compliance_shares(displacement, compliance):
    """Share of each mode in the static compliance of a displacement: all of them add up to one. [-]

    Parameters
    ----------
    displacement : ndarray, shape (..., k)
        In each mode of unit strain energy, phi/w of a mass-normalised one.
    compliance : float or ndarray, shape (..., 1)
        Displacement per force there.
    """
    return displacement**2 / compliance


def shares(values):
    """Values over their sum, zeros where that is zero, shape (n,). [-]"""
    total = values.sum()
    return values / (total if total > 0 else 1.0)


def _massive(shapes, compliance):
    """Mass-normalised shapes of the modes of finite frequency, (n, m), and their W^2, shape (m,) [rad^2/s^2].

    From the shapes of unit strain energy and the compliance of some of the `LinearSystem.strain_modes`.
    """
    massive = compliance > SYSTEM.massless * compliance.max(initial=0.0)
    square = 1 / compliance[massive]
    return shapes[:, massive] * np.sqrt(square), square


def _normalised(shapes, compliance):
    """Frequencies [rad/s], ascending, infinite where a motion has no mass, and mass-normalised shapes, zero there.

    Parameters
    ----------
    shapes : ndarray, shape (..., n, k)
        Of unit strain energy.
    compliance : ndarray, shape (..., k)
        Their quotients x^T M x, which have all digits of the high modes too. [s^2]
    """
    massive = compliance > SYSTEM.massless * compliance.max(axis=-1, keepdims=True, initial=0.0)
    omega = 1 / np.sqrt(np.where(massive, compliance, np.inf))
    shapes = shapes * omega[..., None, :]
    omega = np.where(massive, omega, np.inf)
    order = np.argsort(omega, axis=-1, kind="stable")
    return np.take_along_axis(omega, order, axis=-1), np.take_along_axis(shapes, order[..., None, :], axis=-1)


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
        """The lowest undamped modes, winches at rest.

        Parameters
        ----------
        count : int
            Number k of modes; all where there are fewer. In each system of a stack the number of cable coordinates
            that move bodies (`coupled`) must be equal.

        Returns
        -------
        omega : ndarray, shape (..., k)
            Ascending; infinite without mass, not a number where the equilibrium is not stable. [rad/s]
        shapes : ndarray, shape (..., N + d, k)
            Columns: mass-normalised; zero where there is no mode.

        Raises
        ------
        ConvergenceError
        """
        if isinstance(self.inertia, np.ndarray):
            moves_bodies = coupled(self.coupling, np.diagonal(self.inertia, axis1=-2, axis2=-1)[..., None, :])
            if not moves_bodies.all():
                return self._lowest_beside_uncoupled(count, moves_bodies)
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
        omega, shapes = _normalised(shapes, (vectors * (matrix @ vectors)).sum(axis=-2))
        return np.where(stable, omega, np.nan), np.where(stable[..., None], shapes, 0.0)

    def _lowest_beside_uncoupled(self, count, moves_bodies):
        """`lowest` where some cable coordinates move no body: each of those is a mode by itself.

        The eigenvalue problem is solved for the other coordinates and the bodies alone; its modes and the modes by
        themselves are then sorted by frequency.

        Parameters
        ----------
        count : int
        moves_bodies : ndarray of bool, shape (..., N)
            True for the coordinates of the cables that move bodies, equally many in each system; see `coupled`.
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

    def compliance(self, motion):
        """Static displacement of a free displacement of the bodies (its number) per force there. [m/N, rad/(N m)]"""
        force = np.zeros(self.stiffness.shape[0])
        force[motion] = 1.0
        if isinstance(self.stiffness, np.ndarray):
            return float(np.linalg.solve(self.stiffness, force)[motion])
        return float(_factors(self.stiffness).solve(force)[motion])

    def _lowest_of_large(self, count):
        """`lowest` of a large system, by Lanczos iteration: no large matrix is formed.

        Only the stiffness of the bodies is factorised, as that of the cable coordinates is diagonal. Systems of a stack
        are solved one by one.
        """
        if self.omega.ndim > 1:
            systems = zip(self.omega, self.coupling, self.inertia, self.stiffness, strict=True)
            omega, shapes = zip(*(ReducedSystem(*system)._lowest_of_large(count) for system in systems), strict=True)
            return np.stack(omega), np.stack(shapes)
        modal, square = len(self.omega), self.omega**2
        try:
            solve = _factors(self.stiffness).solve if self.stiffness.shape[0] else np.zeros_like
        except NoSolutionError:
            return np.full(count, np.nan), np.zeros((len(self), count))

        def static_displacements(forces):
            return np.concatenate([forces[:modal] / square, solve(forces[modal:])])

        shapes = _lanczos(len(self), static_displacements, self.weighed, count)
        cables, bodies = shapes[:modal], shapes[modal:]
        energy = (square[:, None] * cables**2).sum(axis=0) + (bodies * (self.stiffness @ bodies)).sum(axis=0)
        shapes = shapes / np.sqrt(energy)
        return _normalised(shapes, (shapes * self.weighed(shapes)).sum(axis=0))

    def weighed(self, shapes):
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


def assemble(cables, connection, bodies, imposed=None, stiffness=0.0):
    """Assemble the `LinearSystem` of cables between bodies, winches and the ground from their superelements.

    Its coordinates are the modal amplitudes of one cable after the other, then the displacements of the bodies; its
    inputs are the movements of the winches.

    Parameters
    ----------
    cables : sequence of Superelement
        One of each of the c cables.
    connection : ndarray or sparse array, shape (6 c, b)
        G: displacements of the six ends of one cable after the other, per displacement of the bodies. Where it is
        sparse, the matrices of the system are.
    bodies : ndarray or sparse array, shape (b, b)
        Mass matrix of the b displacements of the bodies.
    imposed : ndarray, shape (6 c, i), optional
        H: displacements of the ends per movement of the winches.
    stiffness : ndarray or sparse array, shape (b, b), optional
        Of the bodies, without that of the cables.

    Returns
    -------
    LinearSystem
    """
    imposed = np.zeros((connection.shape[0], 0)) if imposed is None else imposed
    matrices = [cable.matrices() for cable in cables]
    if not isinstance(connection, np.ndarray):
        return _assemble_sparse(cables, matrices, connection, bodies, imposed, stiffness)
    modal, b = sum(len(cable.omega) for cable in cables), len(bodies)
    hysteretic = any(cable.strain is not None and cable.strain.law == "hysteretic" for cable in cables)
    # M, C, K, and what they make of the movements of the winches: minus B2, B1, B0
    systems = np.zeros((3, modal + b, modal + b), dtype=complex if hysteretic else float)
    of_winches = np.zeros((3, modal + b, imposed.shape[1]), dtype=systems.dtype)
    systems[0, modal:, modal:], systems[2, modal:, modal:] = bodies, stiffness
    begin, body = 0, slice(modal, None)
    for cable, (element, of_cable) in enumerate(zip(cables, matrices, strict=True)):
        n = len(element.omega)
        modes, ends = slice(begin, begin + n), slice(6 * cable, 6 * cable + 6)
        g, h = connection[ends], imposed[ends]
        for system, by_winches, matrix in zip(systems, of_winches, of_cable, strict=True):
            system[modes, modes] = matrix[:n, :n]
            system[modes, body] = matrix[:n, n:] @ g
            system[body, modes] = system[modes, body].T
            system[body, body] += g.T @ matrix[n:, n:] @ g
            by_winches[modes] += matrix[:n, n:] @ h
            by_winches[body] += g.T @ matrix[n:, n:] @ h
        begin += n
    mass, damping, total_stiffness = systems
    return LinearSystem(mass.real, damping.real, total_stiffness, tuple(-of_winches[::-1]), b)


def _assemble_sparse(cables, matrices, connection, bodies, imposed, stiffness):
    """`assemble` for a sparse G: block-diagonal matrices A of all modes and cable ends, reduced to T^T A T.

    T gives modes and ends by the coordinates of the system: the ends move with the bodies. `matrices` has M, C and K of
    each cable; the other arguments are those of `assemble`.
    """
    from scipy.sparse import block_array, csc_array, eye_array

    modal = sum(len(cable.omega) for cable in cables)
    bodies, stiffness = csc_array(bodies), csc_array(stiffness) if np.ndim(stiffness) else 0 * csc_array(bodies)
    blocks = [[eye_array(modal), None], [None, connection]]
    by_system = block_array(blocks, format="csr") if modal else csc_array(connection)  # T
    by_winches = np.concatenate([np.zeros((modal, imposed.shape[1])), imposed])  # modes and ends by the winches
    systems, of_winches = [], []
    for matrix, of_bodies in zip(_block_diagonal(cables, matrices), (bodies, 0 * bodies, stiffness), strict=True):
        if modal:
            of_bodies = block_array([[csc_array((modal, modal)), None], [None, of_bodies]], format="csc")
        systems.append((by_system.T @ matrix @ by_system + of_bodies).tocsc())
        # sorts the indices too: whoever sorted those of a copy that shares the values would put these in disorder
        systems[-1].sum_duplicates()
        of_winches.append(by_system.T @ (matrix @ by_winches))
    mass, damping, total_stiffness = systems
    inputs = tuple(-matrix for matrix in of_winches[::-1])
    return LinearSystem(mass.real, damping.real, total_stiffness, inputs, bodies.shape[0])


def _block_diagonal(cables, matrices):
    """M, C and K of all cables, rows first of all modes and then of the six ends of each cable: list of sparse arrays.

    Arguments are those of `_assemble_sparse`. Entries are collected for cables with equal numbers of modes together.
    """
    from scipy.sparse import coo_array

    sizes = np.array([len(cable.omega) for cable in cables])
    modal, first_mode = int(sizes.sum()), np.cumsum(sizes) - sizes
    shape = (modal + 6 * len(cables),) * 2
    rows, columns, values = [], [], ([], [], [])  # of the entries; values of M, C and K
    for size in np.unique(sizes):
        alike = np.flatnonzero(sizes == size)
        modes, ends = first_mode[alike, None] + np.arange(size), modal + 6 * alike[:, None] + np.arange(6)
        index = np.concatenate([modes, ends], axis=1)  # row in the whole matrix of each row of a cable's matrix
        rows.append(np.repeat(index, size + 6, axis=1).ravel())
        columns.append(np.tile(index, (1, size + 6)).ravel())
        for kind, entries in enumerate(values):
            entries.append(np.stack([matrices[cable][kind] for cable in alike.tolist()]).ravel())
    rows, columns, sparse = np.concatenate(rows), np.concatenate(columns), []
    for entries in map(np.concatenate, values):
        nonzero = entries != 0
        sparse.append(coo_array((entries[nonzero], (rows[nonzero], columns[nonzero])), shape=shape).tocsr())
    return sparse


def dense(matrix):
    """A matrix, sparse or not, as an array."""
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()


def _only_dissipates(losses):
    """True if a damping matrix is symmetric and has no negative eigenvalue, but for rounding."""
    rounding = SYSTEM.loss_rounding * np.abs(losses).max(initial=0.0)
    if np.abs(losses - losses.T).max(initial=0.0) > rounding:
        return False
    return np.linalg.eigvalsh(losses).min(initial=0.0) >= -rounding


def _cholesky(stiffness):
    """Cholesky factor L of a stiffness L L^T; NoSolutionError where it is not positive definite."""
    try:
        return np.linalg.cholesky(stiffness)
    except np.linalg.LinAlgError:
        raise NoSolutionError(UNSTABLE) from None


def _factors(stiffness):
    """Sparse L U factors (`SuperLU`) of a stiffness; NoSolutionError where it is not positive definite."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    symmetric, matrix = {"SymmetricMode": True, "DiagPivotThresh": 0.0}, csc_array(stiffness)
    matrix.data = np.ascontiguousarray(matrix.data)  # which the real part of a complex matrix is not
    try:
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options=symmetric)
    except RuntimeError:  # exactly singular
        raise NoSolutionError(UNSTABLE) from None
    if not (factors.U.diagonal() > 0).all():
        raise NoSolutionError(UNSTABLE)
    return factors


def _lanczos(size, solve, weigh, count):
    """Shapes of the lowest modes, (size, count), by shift-invert Lanczos iteration about zero from a fixed vector.

    Parameters
    ----------
    size : int
    solve, weigh : callable
        K^-1 and M times a vector.
    count : int
    """
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    inverse, mass = (LinearOperator((size, size), matvec=product, dtype=float) for product in (solve, weigh))
    start = 1 + np.modf(np.arange(1, size + 1) * (np.sqrt(5) - 1) / 2)[0]  # without symmetry, reproducible
    try:
        return eigsh(inverse, count, M=mass, sigma=0.0, OPinv=inverse, v0=start, ncv=2 * count + 10)[1]
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"modes: {error}") from None


def upper(values):
    """The values in the upper half plane and on the real axis."""
    return values[values.imag >= 0]
