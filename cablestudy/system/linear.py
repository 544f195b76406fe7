"""Cables, bodies and winches as one linear system of second order with inputs u and outputs y.

    M z'' + C z' + K z = B0 u + B1 u' + B2 u'',      y = C0 z + C1 z' + C2 z'' + D0 u + D1 u' + D2 u''

M and K are symmetric and positive definite, except for the load stiffness that `motion_of_rows` adds to K. K is complex
where damping is hysteretic, and with it B0, C0 and D0: the model then holds for Im s > 0, and `LinearSystem.viscous`
makes a real one of it.

As `assemble.assemble` makes it, z are the modal amplitudes of all cables and then the displacements of the bodies, and
u what winches impose. The ends of cable i move by u_i = G_i x + H_i u, x being the displacements of the bodies: G_i and
H_i say where it is attached, and the matrices of the system are sums over the superelements.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import (
    UNSTABLE,
    cholesky,
    dense,
    is_positive_definite,
    only_dissipates,
    polynomial,
    solved,
    sparse_factors,
)
from cablestudy.cable.records import stack, take_rows, with_arrays, with_computed
from cablestudy.errors import NoSolutionError
from cablestudy.system.first_order import equations
from cablestudy.system.reduced import ReducedSystem
from cablestudy.system.residues import eigen, eigen_of_rows
from cablestudy.system.tolerances import SYSTEM

MASSLESS_MOTION = "the state space needs a mass of everything that moves"
MODAL = "sqrt(kg) m"  # unit of a modal amplitude


@dataclass(frozen=True)
class LinearSystem:
    """Linear system of second order: n coordinates, i inputs, o outputs; or those of many rows (...).

    Its equations and symbols are those of the module's docstring.

    Attributes
    ----------
    mass, damping, stiffness : ndarray or sparse array, shape (..., n, n)
        M, C and K. Sparse matrices serve `lowest`.
    b : tuple of 3 ndarray, shape (..., n, i)
        B0, B1, B2.
    bodies : int
        How many of the coordinates, the last ones, are displacements of bodies.
    c : tuple of 3 ndarray, shape (..., o, n)
        C0, C1, C2.
    d : tuple of 3 ndarray, shape (..., o, i)
        D0, D1, D2.
    coordinates, inputs, outputs : tuple of (str, str)
        Name and unit of each.
    feedback : tuple of ActuatorFeedback
        Forces f = gain(s) acts measured z of actuators, see `control.motion`.
    scale : ndarray, shape (..., n), optional
        By what each displacement is weighted as a state; without it by about its frequency alone. [rad/s]
    shapes : ndarray, shape (..., m, k), optional
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
    _origin = None  # of a system taken from rows: these, and its index among them

    def __len__(self):
        return self.mass.shape[-1]

    def take(self, row):
        """`LinearSystem` of one row of many, by its index, or of some."""
        taken = take_rows(self, row)
        return with_computed(taken, _origin=(self, row)) if isinstance(row, int) else taken

    @staticmethod
    def of_rows(systems):
        """`LinearSystem` of many rows: that of which all of these were taken, or some of its rows; else a stack."""
        origin, rows = systems[0]._origin and systems[0]._origin[0], []
        for system in systems:
            if system._origin is None or system._origin[0] is not origin:
                return stack(systems)
            rows.append(system._origin[1])
        return origin if rows == list(range(len(origin.mass))) else origin.take(rows)

    @property
    def signature(self):
        """Sizes of all arrays: systems for which they are equal are made one of many rows. Tuple."""
        shapes = self.mass.shape, self.b[0].shape, self.c[0].shape, None if self.shapes is None else self.shapes.shape
        return *shapes, self.stiffness.dtype, self.scale is None, *(one.filtered for one in self.feedback)

    @cached_property
    def strain_modes(self):
        """All undamped modes of the n coordinates, winches at rest, scaled to unit strain energy v^T K v = 1.

        Returns
        -------
        compliance : ndarray, shape (n,)
            1/W^2 = v^T M v, W being the angular frequency; descending. [s^2]
        shapes : ndarray, shape (n, n)
            The modes v are its columns.

        Raises
        ------
        NoSolutionError
            K is not positive definite: the equilibrium is not stable.

        Notes
        -----
        Only the real part of a complex K counts. With K = L L^T the eigenvalues of L^-1 M L^-T are 1/W^2. So the lowest
        frequencies have all digits, however heavy the bodies. The quotients v^T M v give all digits of the high ones
        too. Coordinates without mass have 1/W^2 = 0.
        """
        mass, lower = dense(self.mass), cholesky(dense(self.stiffness).real)
        lower_inverse_mass = np.linalg.solve(lower, mass)
        _, vectors = np.linalg.eigh(np.linalg.solve(lower, lower_inverse_mass.T))
        shapes = np.linalg.solve(lower.T, vectors)
        compliance = np.maximum((shapes * (mass @ shapes)).sum(axis=0), 0.0)
        order = np.argsort(-compliance, kind="stable")
        return compliance[order], shapes[:, order]

    def lowest(self, count):
        """The lowest undamped modes, winches at rest; of a large system by Lanczos iteration.

        Parameters
        ----------
        count : int
            Number of modes that are wanted.

        Returns
        -------
        omega : ndarray, shape (k,)
            Angular frequencies of k <= count modes, ascending; fewer than `count` if no more are finite. [rad/s]
        shapes : ndarray, shape (n, k)
            Columns: mass-normalised shapes, in the n coordinates of the system.

        Raises
        ------
        NoSolutionError
            The stiffness is not positive definite: the equilibrium is not stable.
        ConvergenceError
            The iteration did not converge.
        """
        system = ReducedSystem(np.zeros(0), np.zeros((0, len(self))), self.mass, self.stiffness.real)
        omega, shapes = system.lowest(count)
        if np.isnan(omega).any():
            raise NoSolutionError(UNSTABLE)
        finite = np.isfinite(omega)
        return omega[finite], shapes[:, finite]

    def compliance(self, forces):
        """Static displacements by forces, shape (..., n, r) both, the winches at rest and without damping."""
        if isinstance(self.stiffness, np.ndarray):
            return np.linalg.solve(self.stiffness.real, forces)
        return sparse_factors(self.stiffness.real).solve(forces)

    @cached_property
    def unit(self):
        """Weight of each displacement as a state: `scale`, or about the frequency of its coordinate alone. [rad/s]"""
        if self.scale is not None:
            return self.scale
        stiffness, mass = (np.diagonal(matrix, axis1=-2, axis2=-1) for matrix in (self.stiffness.real, self.mass))
        return np.sqrt(np.where(stiffness > 0, stiffness, mass) / mass)

    @cached_property
    def _has_unit_mass(self):
        """True where M is the identity, except for rounding, shape (...)."""
        return np.abs(self.mass - np.eye(len(self))).max(axis=(-2, -1), initial=0.0) < SYSTEM.entry_rounding

    def accelerations(self, forces):
        """Accelerations by forces on the coordinates, M^-1 f, shape (..., n, r)."""
        if self._has_unit_mass.all():
            return forces
        return np.where(self._has_unit_mass[..., None, None], forces, np.linalg.solve(self.mass, forces))

    @cached_property
    def dissipates(self):
        """True if it is known without its poles that none grows, the inputs at rest, since no motion gains energy.

        Of a pole s = a + i b with b > 0 and the shape v, a = -v^H (b C + Im K) v/(2 b v^H M v) where M, C and K are
        symmetric and nothing is fed back: C and Im K must have no negative eigenvalues, M and Re K no others.
        """
        losses = [self.damping] + [self.stiffness.imag] * np.iscomplexobj(self.stiffness)
        stiffness = self.stiffness.real
        rounding = SYSTEM.entry_rounding * np.abs(stiffness).max(initial=0.0)
        if self.feedback or np.abs(stiffness - stiffness.T).max(initial=0.0) > rounding:
            return False
        if not all(only_dissipates(part) for part in losses):
            return False
        return is_positive_definite(stiffness)

    @cached_property
    def equations(self):
        """`Equations` of first order, winches at rest and without inputs."""
        return equations(self)

    @cached_property
    def eigen(self):
        """`Eigen` of `equations`; of a system taken from rows it is computed for all of these at once."""
        if self._origin is None:
            return eigen(self.equations.fixed)
        rows, row = self._origin
        return rows._eigen_of_rows[row]

    @cached_property
    def _eigen_of_rows(self):
        """`eigen` of each row: list."""
        return eigen_of_rows(self.equations.fixed)

    @cached_property
    def static_stiffness(self):
        """Real part of the `dynamic_stiffness` at rest, shape (n, n)."""
        stiffness = self.stiffness.real
        for feedback in self.feedback:
            gain = 0.0 if feedback.filtered else feedback.position_gain
            stiffness = stiffness - gain * np.outer(feedback.acts, feedback.measured)
        return stiffness

    def dynamic_stiffness(self, s):
        """Forces per displacement of the coordinates, D = s^2 M + s C + K, shape (f, n, n), inputs at rest.

        Parameters
        ----------
        s : array_like, shape (f,)
            With Im s > 0 where the stiffness is complex. [rad/s]
        """
        return stack([self]).dynamic_stiffness_of_rows(np.zeros(len(s), dtype=int), s)

    def dynamic_stiffness_of_rows(self, row, s):
        """`dynamic_stiffness` of many rows at s of the rows `row`, both of shape (f,): shape (f, n, n)."""
        s = s[:, None, None]
        dynamic = self.stiffness[row] + s * (self.damping[row] + s * self.mass[row])
        for feedback in self.feedback:
            own = with_arrays(feedback, lambda array: array[row][..., None])
            dynamic = dynamic - own.gain(s[:, 0])[..., None] * own.acts * np.swapaxes(own.measured, 1, 2)
        return dynamic

    def pulled(self, s):
        """Forces on the coordinates per input, B0 + s B1 + s^2 B2, shape (f, n, i)."""
        return polynomial(self.b, s)

    def within(self, space, imposed=None, inputs=()):
        """Transform the system to other coordinates q, with motions imposed by further inputs v: z = S q + N v.

        Parameters
        ----------
        space : ndarray, shape (..., n, r)
            S: independent columns, the motions of the n coordinates z that stay free.
        imposed : ndarray, shape (n, j), optional
            N, for one system only: motion by each of j further inputs v.
        inputs : tuple of (str, str)
            Name and unit of each further input.

        Returns
        -------
        LinearSystem
            With r coordinates, S^T M S and so on. The further inputs come before those of the system; v, v' and v''
            drive q by -S^T K N, -S^T C N and -S^T M N, and add C0 N, C1 N and C2 N to the outputs.
        """
        transposed = np.swapaxes(space, -1, -2)
        b, d = tuple(transposed @ matrix for matrix in self.b), self.d
        if imposed is not None:
            forces = (-transposed @ matrix @ imposed for matrix in (self.stiffness, self.damping, self.mass))
            b = tuple(np.concatenate(columns, axis=1) for columns in zip(forces, b, strict=True))
            imposed_outputs = (matrix @ imposed for matrix in self.c)
            d = tuple(np.concatenate(columns, axis=1) for columns in zip(imposed_outputs, d, strict=True))
        return replace(
            self,
            mass=transposed @ self.mass @ space,
            damping=transposed @ self.damping @ space,
            stiffness=transposed @ self.stiffness @ space,
            b=b,
            c=tuple(matrix @ space for matrix in self.c),
            d=d,
            inputs=(*inputs, *self.inputs),
            feedback=tuple(one.within(space) for one in self.feedback),
            scale=None,
            shapes=None,
        )

    def with_forces(self, forces, inputs=(), direct=None):
        """The system with forces as further inputs.

        Parameters
        ----------
        forces : ndarray, shape (..., n, j)
            On each coordinate by each of them.
        inputs : tuple of (str, str)
            Name and unit of each.
        direct : ndarray, shape (..., o, j), optional
            Their share in each output where nothing moves; by default none.
        """
        direct = np.zeros((*self.d[0].shape[:-1], forces.shape[-1])) if direct is None else direct
        return replace(
            self,
            b=tuple(np.concatenate([part, forces * (order == 0)], axis=-1) for order, part in enumerate(self.b)),
            d=tuple(np.concatenate([part, direct * (order == 0)], axis=-1) for order, part in enumerate(self.d)),
            inputs=(*self.inputs, *inputs),
        )

    def with_damped_bodies(self, damping):
        """The system with further viscous damping of the displacements of its bodies, shape (b, b), or 0."""
        modal = len(self) - self.bodies
        if isinstance(self.damping, np.ndarray):
            matrix = self.damping.copy()
            matrix[..., modal:, modal:] += damping
            return replace(self, damping=matrix)
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
    if not is_positive_definite(mass):
        raise NoSolutionError(MASSLESS_MOTION)
    compliance, shapes = LinearSystem(mass, np.zeros_like(mass), stiffness).strain_modes
    omega = 1 / np.sqrt(compliance)
    momentum = mass @ shapes * omega
    modal_damping = omega * (shapes * (stiffness.imag @ shapes)).sum(axis=0)
    return momentum * modal_damping @ momentum.T
