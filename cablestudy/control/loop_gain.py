"""The loop gain of winches from the dynamic stiffness of the bodies, with all modes that the cables' elements have.

    L(s)/g = P Z^-1 F A C1(s) N(s),    Z = Z_b + sum of G^T S(s) G,    F = F_0 - sum of G^T S(s) H

g is the gain of the control law C1 behind the notches N (see `loop`). P gives the measured coordinates, A allocates
them to the winches, Z_b is the dynamic stiffness of the bodies without cables, S that of a cable at the six
displacements of its ends, G and H these displacements by the bodies and by the lengths reeled in, F_0 the load that a
winch takes off its own end. No system larger than that of the bodies is solved, and no mode of the whole suspension is
needed.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import prod

import numpy as np

from cablestudy.cable.matrices import inverse, solve
from cablestudy.cable.records import is_computed, stack
from cablestudy.control.notch import NotchedLaw
from cablestudy.control.tolerances import CONTROL
from cablestudy.system.coupling_damping import SumOverPoles
from cablestudy.system.linear import LinearSystem
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True, eq=False)
class LoopGain:
    """The loop gain over the gain, L/g: a function of s.

    Attributes
    ----------
    bodies : LinearSystem
        Of d coordinates: the free displacements of the bodies, and the strokes of what moves on them; without cables.
    elements : list of Superelement
        Of c cables.
    connection : ndarray, shape (c, 6, d)
        G.
    reeling : ndarray, shape (c, 6, i)
        H.
    winch_loads : ndarray, shape (d, i)
        F_0.
    measured : ndarray, shape (k, d)
        P.
    allocation : ndarray, shape (i, k)
        A.
    controller : NotchedLaw or None
        C1 N; None where k is zero.
    near : LoopGain or None
        Loop gain of cables that differ little: from its poles those of modes coupled by damping follow to first order.
    windows : bool
        True if poles of many modes coupled by damping may be found in windows, see `Superelement.windowed`.
    """

    bodies: LinearSystem
    elements: list
    connection: np.ndarray
    reeling: np.ndarray
    winch_loads: np.ndarray
    measured: np.ndarray
    allocation: np.ndarray
    controller: NotchedLaw | None
    near: "LoopGain | None" = None
    windows: bool = False

    def __call__(self, s):
        """L/g for s of shape (f,), shape (f, k, k). [s]"""
        return self.of_rows([self], np.zeros(len(s), dtype=int), s)

    @staticmethod
    @np.errstate(divide="ignore", invalid="ignore")  # at the pole of an undamped mode it is infinite
    def of_rows(loop_gains, row, s):
        """L/g of n loop gains with equal `signature`, at s of the loops `row`, ascending: shape (f, k, k). [s]"""
        if len(s):  # rounds of a search ask for few of the loops
            numbers, row = np.unique(row, return_inverse=True)
            loop_gains = [loop_gains[number] for number in numbers.tolist()]
        stiffness, forces = LoopGain.stiffness_and_forces(loop_gains, row, s)
        allocation = np.array([one.allocation for one in loop_gains])[row]
        measured = np.array([one.measured for one in loop_gains])[row]
        if forces.shape[-1] < allocation.shape[-1]:  # of no higher rank than there are winches, to rounding
            coordinates = measured @ solve(stiffness, forces) @ allocation
        else:
            coordinates = measured @ solve(stiffness, forces @ allocation)
        return coordinates * NotchedLaw.of_rows([one.controller for one in loop_gains], row, s)[:, None, :]

    @staticmethod
    def stiffness_and_forces(loop_gains, row, s):
        """Z, shape (f, d, d), and F, shape (f, d, i), as in `of_rows`; of k = 0 too."""
        by_cables = LoopGain._by_cables_of_rows(loop_gains, row, s)
        bodies = stack([one.bodies for one in loop_gains]).dynamic_stiffness_of_rows(row, s)
        winch_loads, count = np.array([one.winch_loads for one in loop_gains])[row], bodies.shape[-1]
        return bodies + by_cables[:, :, :count], winch_loads - by_cables[:, :, count:]

    @property
    def signature(self):
        """Sizes of arrays but those of cables, by which loop gains are found that `of_rows` puts together: tuple."""
        bodies, shapes = self.bodies, (self.measured.shape, self.allocation.shape)
        return len(bodies), bodies.stiffness.dtype, *(one.filtered for one in bodies.feedback), *shapes

    @np.errstate(divide="ignore", invalid="ignore")  # at the pole of an undamped mode it is NaN
    def receptance(self, s, gain=0.0):
        """Coordinates per force on them with a gain g, (Z + g F A C1 N P)^-1 for s of shape (f,), shape (f, d, d)."""
        bodies, pulled = LoopGain.stiffness_and_forces([self], np.zeros(len(s), dtype=int), s)
        if gain:
            bodies = bodies + gain * (pulled @ self.allocation * self.controller(s)[:, None, :]) @ self.measured
        finite = np.isfinite(bodies).all(axis=(1, 2))
        receptance = np.full(bodies.shape, np.nan, dtype=complex)
        receptance[finite] = inverse(bodies[finite])
        return receptance

    @property
    def ill_conditioned(self):
        """True if so much strain is damped that rounding spoils the response of a cable."""
        return any(cable.element.ill_conditioned for cable in self._cables)

    @property
    def coupling_damping(self):
        """`CouplingDamping` of each cable whose modes damping couples: list."""
        elements = [cable.element for cable in self._cables]
        return [element.coupling_damping for element in elements if element.coupled]

    @property
    def windowed(self):
        """True if poles of a cable are found in windows, which leaves a small error."""
        return any(damping.windowed for damping in self.coupling_damping)

    @staticmethod
    def _by_cables_of_rows(loop_gains, row, s):
        """`_by_cables` at s of the loops `row`, ascending; where those have few frequencies each, of many together."""
        count, winches = loop_gains[0].winch_loads.shape
        forces, together = np.empty((len(s), count, count + winches), dtype=complex), {}
        for number, part in _parts(row):
            frequencies = part.stop - part.start
            summed, others = loop_gains[number]._divided_for(frequencies)
            if frequencies <= CONTROL.frequencies_together and summed and not others and summed.signature:
                together.setdefault(summed.signature, []).append((summed, np.arange(part.start, part.stop)))
            else:
                forces[part] = loop_gains[number]._by_cables(s[part])
        for members in together.values():
            sums, parts = zip(*members, strict=True)
            index, own = np.concatenate(parts), np.repeat(np.arange(len(sums)), [len(part) for part in parts])
            forces[index] = _ForcesByPoles.of_rows(sums, own, s[index])
        return forces

    def _divided_for(self, frequencies):
        """`_divided`; at few frequencies, where poles of cables cost more than they spare, None and all cables."""
        few = frequencies <= SYSTEM.solved_frequencies and self.near is None and not is_computed(self, "_divided")
        return (None, self._cables) if few else self._divided

    def _by_cables(self, s):
        """Forces of cables on bodies by their displacements and by the winches, Z - Z_b and F_0 - F, (f, d, d + i)."""
        summed, others = self._divided_for(len(s))
        count, winches = self.winch_loads.shape
        forces = summed(s) if summed else np.zeros((len(s), count, count + winches), dtype=complex)
        for cable in others:
            forces += cable.connection.T @ cable.stiffness(s) @ cable.columns(winches)
        return forces

    @property
    def by_equations(self):
        """Itself, or a copy, that solves equations of cables at few frequencies, without sums over their poles."""
        return self if self.near is None and not is_computed(self, "_divided") else replace(self, near=None)

    def find_pole_sums(self):
        """Find the sums over poles of the cables' stiffness, which few frequencies alone would not pay for."""
        _ = self._divided

    @cached_property
    def elements_at_all_ends(self):
        """`Superelement` of each cable at its six end displacements, with the poles that the loop gain has: list."""
        elements, of_cables = list(self.elements), np.flatnonzero(self.connection.any(axis=(1, 2))).tolist()
        for number, cable in zip(of_cables, self._cables, strict=True):
            elements[number] = replace(_with_modes(elements[number], cable.used), near=cable.element)
        return elements

    @cached_property
    def _divided(self):
        """`_ForcesByPoles` of the cables whose stiffness is a sum over poles, or None; and the other cables."""
        summed = [cable for cable in self._cables if cable.is_sum]
        sums = _ForcesByPoles.of(summed, self.winch_loads.shape[1]) if summed else None
        return sums, [cable for cable in self._cables if not cable.is_sum]

    @cached_property
    def _cables(self):
        """`_CableInLoop` of each cable that holds a body: list."""
        cables, similar = [], iter(self.near._cables if self.near else ())
        for element, connection, reeling in zip(self.elements, self.connection, self.reeling, strict=True):
            rows, winches = np.flatnonzero(connection.any(axis=1)), np.flatnonzero(reeling.any(axis=0))
            if len(rows):
                element = element.with_end_shapes(np.concatenate([np.eye(6)[:, rows], reeling[:, winches]], axis=1))
                cables.append(_CableInLoop.of(element, connection[rows], winches, next(similar, None), self.windows))
        return cables


@dataclass(frozen=True)
class _CableInLoop:
    """One cable as a stiffness between displacements of its ends by bodies, then by winches.

    Attributes
    ----------
    element : Superelement
        With the modes that its ends move, at e displacements of ends and w winches.
    used : ndarray of bool
        Which of all its modes these are.
    connection : ndarray, shape (e, d)
        Displacements of the ends that bodies move.
    winches : ndarray of int, shape (w,)
        Which winches reel it in.
    """

    element: object
    used: np.ndarray
    connection: np.ndarray
    winches: np.ndarray

    @classmethod
    def of(cls, element, connection, winches, near, windows):
        """`_CableInLoop` of a `Superelement` at the moved ends; `near` is that of nearly the same one, or None."""
        used = element.moved_by_ends if near is None else near.used
        element = _with_modes(element, used)
        return cls(replace(element, near=near and near.element, windowed=windows), used, connection, winches)

    @property
    def is_sum(self):
        """True if the stiffness is a sum over poles: damping couples modes, and rounding does not spoil the sum."""
        return self.element.coupled and self.element.coupling_damping.pole_sum is not None

    def stiffness(self, s):
        """Forces at the ends that bodies move, by these displacements and by the winches, shape (f, e, e + w)."""
        return self.element.dynamic_stiffness(s, slice(len(self.connection)))

    def columns(self, winches):
        """Displacements of the ends, and lengths reeled in, by those of the bodies and of all winches, (e + w, d + i).

        `winches` is their number i.
        """
        (ends, coordinates), winding = self.connection.shape, len(self.winches)
        columns = np.zeros((ends + winding, coordinates + winches))
        columns[:ends, :coordinates] = self.connection
        columns[ends + np.arange(winding), coordinates + self.winches] = 1.0
        return columns


def _with_modes(element, used):
    """`Superelement` with those of its modes that are `used`, ndarray of bool; itself where these are all."""
    return element if used.all() else element.select(used)


def _parts(row):
    """Loops of ascending numbers `row`, a few of these at a time: list of pairs of number and slice, at least one."""
    edges, block = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)], CONTROL.frequencies_at_once
    parts = [
        slice(first, min(first + block, end))
        for begin, end in pairwise(edges)
        for first in range(begin, max(end, 1), block)
    ]
    return [(int(row[part.start]) if len(row) else 0, part) for part in parts]


@dataclass(frozen=True)
class _ForcesByPoles:
    """Forces of many cables on bodies, each a sum over its poles: a function of s.

    s, shape (f,) [rad/s] -> forces on the d coordinates of the bodies by these and by the lengths that the i winches
    reel in, shape (f, d, d + i). [N/m]

    Attributes
    ----------
    sums : list of (SumOverPoles, ndarray or None)
        Of each cable, and the matrix from its sums to forces on bodies; None where they are these.
    polynomial : list of 3 ndarray, shape (d, d + i)
        Coefficients of s^0, s^1 and s^2 in the forces by all cables.
    """

    sums: list
    polynomial: list

    @classmethod
    def of(cls, cables, winches):
        """`_ForcesByPoles` of a list of `_CableInLoop`, each with a `pole_sum`; `winches` is the number i."""
        sums, polynomial = [], [0.0, 0.0, 0.0]
        for cable in cables:
            damping, columns, ends = cable.element.coupling_damping, cable.columns(winches), len(cable.connection)
            residues = damping.pole_sum.residues[:, :ends]  # of the forces at the ends that bodies move, (N, e, e + w)
            # the smaller arrays are summed: forces on bodies, or forces at ends that become forces on bodies afterwards
            if cable.connection.shape[1] * columns.shape[1] <= prod(residues.shape[1:]):
                residues, onto_bodies = cable.connection.T @ residues @ columns, None
            else:
                onto_bodies = np.kron(cable.connection, columns)
            sums.append((damping.sum_over_poles(residues.reshape(-1, prod(residues.shape[1:]))), onto_bodies))
            for order, coefficient in enumerate(damping.polynomial_in_s):
                polynomial[order] = polynomial[order] + cable.connection.T @ coefficient[:ends] @ columns
        return cls(sums, polynomial)

    def __call__(self, s):
        moving = 0.0
        for sum_over_poles, onto_bodies in self.sums:
            of_cable = sum_over_poles(s).T
            moving = moving + (of_cable if onto_bodies is None else of_cable @ onto_bodies)
        return _less_moving(self.polynomial, s, moving)

    @cached_property
    def signature(self):
        """Sizes of arrays by which those of one cable, with few terms, are found that `of_rows` puts together, or None.

        Terms of many cables, and coordinates, take longer than what calls cost.
        """
        own, onto_bodies = self.sums[0]
        few = len(self.sums) == 1 and onto_bodies is None and own.coefficients.size <= CONTROL.terms_together
        return (own.signature, self.polynomial[0].shape) if few else None

    @staticmethod
    def of_rows(members, row, s):
        """Values of n `_ForcesByPoles` of equal `signature`, at s of the members `row`: shape (f, d, d + i)."""
        moving = SumOverPoles.of_rows([member.sums[0][0] for member in members], row, s)
        orders = zip(*(member.polynomial for member in members), strict=True)
        return _less_moving([np.array(of_order)[row] for of_order in orders], s, moving)


def _less_moving(polynomial, s, moving):
    """Polynomials in s, three coefficients of shape (d, d + i) or (f, d, d + i), less what their modes take away."""
    (static, first, second), s = polynomial, s[:, None, None]
    return s * (s * second + first) + static - moving.reshape(len(s), *second.shape[-2:])
