"""A second-order model with inputs and outputs: its modes, those to keep, its state space, its frequency response.

    M z'' + C z' + K z = B0 u + B1 u' + B2 u'',      y = C0 z + C1 z' + C2 z'' + D0 u + D1 u' + D2 u''

M and K are symmetric and positive definite. Of the modes left out the static part stays (mode acceleration method:
Williams, Quarterly of Mechanics and Applied Mathematics 2, 1949): z = Phi q + S u with

    S = K^-1 B0 - Phi Omega^-2 Phi^T B0.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control.reduction import shares
from cablestudy.control.statespace import MODAL, SecondOrder, StateSpace, first_order
from cablestudy.errors import NoSolutionError

ENTRIES = 4_000_000  # of the matrices that are solved at once for a frequency response: 64 MB


@dataclass(frozen=True)
class SecondOrderSystem:
    """The model of the module's docstring, n coordinates, i inputs, o outputs.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
    driven : tuple of 3 ndarray, shape (n, i)
        B0, B1, B2.
    moved : tuple of 3 ndarray, shape (o, n)
        C0, C1, C2.
    follow : tuple of 3 ndarray, shape (o, i)
        D0, D1, D2.
    scale : ndarray, shape (n,)
        States of `state_space` are these times z, and z'.
    states, inputs, outputs : tuple of (str, str)
        Name and unit of each.
    physical : SecondOrder
        M, C and K before any modes were left out.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    driven: tuple
    moved: tuple
    follow: tuple
    scale: np.ndarray
    states: tuple
    inputs: tuple
    outputs: tuple
    physical: SecondOrder

    @cached_property
    def modes(self):
        """Undamped modes: 1/W^2, descending, shape (n,), and shapes of unit strain energy v^T K v, shape (n, n).

        So the lowest modes have all digits, and coordinates without mass have modes too, with 1/W^2 = 0.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable.
        """
        from scipy.linalg import LinAlgError, eigh

        try:
            values, shapes = eigh(self.mass, self.stiffness)
        except LinAlgError:
            raise NoSolutionError("the state space needs a stable equilibrium") from None
        return np.maximum(values[::-1], 0.0), shapes[:, ::-1]

    def inertia_share(self, output, input_):
        """Share of each mode in the inertia between an input and an output, shape (n,), by their numbers. [-]

        About the static displacements K^-1 B0 u a mode moves by w^2 m/(W^2 - w^2) with m = Phi^T (B0/W^2 - B2), and at
        its frequency the output is W^2 (C0/W^2 - C2) Phi of it. The share is that of |(C0/W^2 - C2) Phi m|, for two
        ends of a cable as in `reduction.inertia_share`.
        """
        compliance, shapes = self.modes
        inertia = compliance * (shapes.T @ self.driven[0][:, input_]) - shapes.T @ self.driven[2][:, input_]
        observed = compliance * (self.moved[0][output] @ shapes) - self.moved[2][output] @ shapes
        square = np.where(
            compliance > 0, 1 / np.where(compliance > 0, compliance, 1.0), 0.0
        )  # of mass-normalised shapes
        return shares(np.abs(observed * inertia) * square)

    def keep(self, chosen):
        """The system in some of its modes, the static part of the others kept.

        Parameters
        ----------
        chosen : ndarray of int
            Modes to keep, from 0.

        Returns
        -------
        SecondOrderSystem
            Its coordinates are modal amplitudes.
        """
        compliance, shapes = self.modes
        omega = 1 / np.sqrt(compliance[chosen])
        kept, others = shapes[:, chosen] * omega, np.delete(shapes, chosen, axis=1)
        static = others @ (others.T @ self.driven[0])
        driven = [kept.T @ part for part in self.driven]
        driven[1] -= kept.T @ (self.damping @ static)
        names = [f"mode_{k + 1}" for k in np.asarray(chosen).tolist()]
        amplitudes = [(f"{name}_amplitude", f"{MODAL}/s") for name in names]
        return SecondOrderSystem(
            np.eye(len(names)),
            kept.T @ self.damping @ kept,
            np.diag(omega**2),
            tuple(driven),
            tuple(part @ kept for part in self.moved),
            tuple(direct + part @ static for direct, part in zip(self.follow, self.moved, strict=True)),
            omega,
            (*amplitudes, *((f"{name}_velocity", f"{MODAL}/s") for name in names)),
            self.inputs,
            self.outputs,
            self.physical,
        )

    @np.errstate(all="ignore")  # StateSpace refuses what overflows
    def state_space(self):
        """The system of first order: StateSpace.

        Raises
        ------
        NoSolutionError
            Something that moves has no mass, or entries overflow.
        """
        n, i = len(self.mass), len(self.inputs)
        try:
            solved = np.linalg.solve(self.mass, np.concatenate([self.stiffness, self.damping, *self.driven], axis=1))
        except np.linalg.LinAlgError:
            raise NoSolutionError("the state space needs a mass of everything that moves") from None
        matrices, given = (solved[:, :n], solved[:, n : 2 * n]), np.split(solved[:, 2 * n :], [i, 2 * i], axis=1)
        # forces are inputs like the others, only without effect of their derivatives
        forces = np.zeros((n, 0)), np.zeros((len(self.outputs), 0))
        a, b, c, d, derivatives = first_order(
            matrices, given, forces[0], self.scale, self.moved, self.follow, forces[1]
        )
        return StateSpace(a, b, c, d, self.states, self.inputs, self.outputs, derivatives, self.physical)

    @np.errstate(all="ignore")
    def response(self, output, input_, frequency):
        """One output for a unit input, complex, shape (m,), by their numbers; not finite at an undamped pole.

        Parameters
        ----------
        output, input_ : int
        frequency : ndarray, shape (m,)
            [Hz]
        """
        at_once = max(1, ENTRIES // max(1, len(self.mass)) ** 2)
        pieces = np.split(frequency, range(at_once, len(frequency), at_once))
        return np.concatenate([self._response(output, input_, 2j * np.pi * piece) for piece in pieces])

    def _response(self, output, input_, s):
        dynamic = polynomial((self.stiffness, self.damping, self.mass), s)
        right = polynomial([part[:, input_] for part in self.driven], s)
        observed = polynomial([part[output] for part in self.moved], s)
        direct = polynomial([part[output, input_] for part in self.follow], s)
        return (observed * solved(dynamic, right[..., None])[..., 0]).sum(axis=-1) + direct


def polynomial(parts, s):
    """a + s b + s^2 c of three arrays of one shape (...), for each s of shape (f,): shape (f, ...)."""
    zeroth, first, second = parts
    s = np.reshape(s, (-1, *[1] * np.ndim(zeroth)))
    return zeroth + s * first + s**2 * second


def solved(matrices, right):
    """Solutions of linear systems, not a number where one is singular, shapes (m, n, n) and (m, n, 1)."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full(right.shape, np.nan, dtype=complex)
        half = len(matrices) // 2
        return np.concatenate([solved(matrices[:half], right[:half]), solved(matrices[half:], right[half:])])
