"""The loop gain of winches from the dynamic stiffness of the bodies, with all modes that the cables' elements have.

    L(s) = P Z^-1 F A C1(s) N(s),    Z = Z_b + sum of G^T S(s) G,    F = F_0 - sum of G^T S(s) H

P picks what is measured, A shares it among the winches, Z_b is the dynamic stiffness of the bodies without cables, S
that of a cable at its six ends, G and H their displacements by the bodies and by the lengths reeled in, F_0 the load
that a winch takes off its own end. No system larger than that of the bodies is solved, and no mode of the whole is
needed.

A mode of one cable between fixed ends, of frequency W, has its pole with the bodies free near that of

    s^2 + c s + W^2 = s^4 w^T Z_r^-1 w,    w = G^T m,

Z_r being Z without this mode. A gain g moves it by -g X/(2 s) to first order, with

    X = s^4 (w^T Z_r^-1 F + m^T H) A C1 N P Z_r^-1 w.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.tolerances import CONTROL
from cablestudy.system.linear import LinearSystem
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class LoopGain:
    """The loop gain over the gain.

    Attributes
    ----------
    bodies : LinearSystem
        Of d coordinates: the free displacements of the bodies, and the strokes of what moves on them; without cables.
    elements : list of Superelement
        Of c cables.
    moved : ndarray, shape (c, 6, d)
        G.
    reeled : ndarray, shape (c, 6, i)
        H.
    lifted : ndarray, shape (d, i)
        F_0.
    measured : ndarray, shape (k, d)
        P.
    shares : ndarray, shape (i, k)
        A.
    controller : callable
        s, shape (f,) -> C1 N, shape (f, k).
    near : LoopGain or None
        Of cables that differ little: poles of modes that damping couples follow from its poles to first order.
    windows : bool
        Whether poles of many such modes may be found in windows, see `Superelement.windowed`.
    """

    bodies: LinearSystem
    elements: list
    moved: np.ndarray
    reeled: np.ndarray
    lifted: np.ndarray
    measured: np.ndarray
    shares: np.ndarray
    controller: object
    near: "LoopGain | None" = None
    windows: bool = False

    @np.errstate(divide="ignore", invalid="ignore")  # at the pole of an undamped mode it is infinite
    def __call__(self, s):
        """L for s of shape (f,), shape (f, k, k)."""
        bodies, pulled = self._at(s)
        pulled = pulled @ self.shares
        moved = self.measured @ (pulled / bodies if bodies.shape[-1] == 1 else np.linalg.solve(bodies, pulled))
        return moved * self.controller(s)[:, None, :]

    @property
    def spoilt(self):
        """True if so much strain is damped that rounding spoils the response of a cable."""
        return any(part.element.spoilt for part in self._parts)

    @property
    def windowed(self):
        """True if poles of a cable are found in windows, which leaves a small error."""
        return any(part.element.coupled and part.element.coupling_damping.windowed for part in self._parts)

    def _at(self, s):
        """Z, shape (f, d, d), and F, shape (f, d, i)."""
        bodies = self.bodies.dynamic_stiffness(s)
        pulled = np.broadcast_to(self.lifted, (len(s), *self.lifted.shape)).astype(complex)
        few = len(s) <= SYSTEM.solved_places  # of which poles cost more
        few &= self.near is None and "_divided" not in self.__dict__
        together, apart = (None, self._parts) if few else self._divided
        if together:
            stiffness, count = together(s), bodies.shape[-1]
            bodies, pulled = bodies + stiffness[:, :, :count], pulled - stiffness[:, :, count:]
        for part in apart:
            stiffness, count = part.stiffness(s), len(part.moved)
            bodies += part.moved.T @ stiffness[:, :, :count] @ part.moved
            if len(part.winches):
                pulled[:, :, part.winches] -= part.moved.T @ stiffness[:, :, count:]
        return bodies, pulled

    @cached_property
    def _divided(self):
        """`_Together` of the cables whose stiffness is a sum over poles, None without, and the others."""
        summed = [part for part in self._parts if part.summed is not None]
        together = _Together(summed, self.lifted.shape[1]) if summed else None
        return together, [part for part in self._parts if part.summed is None]

    @cached_property
    def _parts(self):
        """Each cable that holds a body: `_Part`."""
        found, near = [], iter(self.near._parts if self.near else ())
        for element, moved, reeled in zip(self.elements, self.moved, self.reeled, strict=True):
            ends, winches = np.flatnonzero(moved.any(axis=1)), np.flatnonzero(reeled.any(axis=0))
            if len(ends):
                element = element.at_ends(np.concatenate([np.eye(6)[:, ends], reeled[:, winches]], axis=1))
                found.append(_Part.of(element, moved[ends], winches, next(near, None), self.windows))
        return found

    def poles_of(self, cable, modes):
        """About where modes of one cable have their poles with the bodies free, and their shift per gain, shape (n,).

        Parameters
        ----------
        cable : int
        modes : ndarray of int, shape (n,)
            Their numbers.

        Returns
        -------
        poles : ndarray, complex
            [rad/s]
        shift : ndarray, complex
            To first order.
        """
        element = self.elements[cable]
        omega = element.omega[modes]
        decay = np.maximum(element.decay[modes], CONTROL.least_half_width * omega)
        every, rate, coupling = 1j * (omega + CONTROL.half_widths_aside * decay), 2 * decay, element.coupling[modes]
        found = []
        for begin in range(0, len(modes), CONTROL.modes_at_once):
            part = slice(begin, begin + CONTROL.modes_at_once)
            s, momentum = every[part], coupling[part] @ self.moved[cable]
            bodies, pulled = self._at(s)
            own = s**4 / (omega[part] ** 2 + s * (s + rate[part]))
            bodies = bodies + own[:, None, None] * momentum[:, :, None] * momentum[:, None, :]
            moved = np.linalg.solve(bodies, momentum[..., None])[..., 0]
            pushed = (moved[:, None, :] @ pulled)[:, 0] + coupling[part] @ self.reeled[cable]
            made = (self.controller(s) * (moved @ self.measured.T)) @ self.shares.T
            found.append(np.stack([(momentum * moved).sum(axis=-1), (pushed * made).sum(axis=-1)]))
        held, driven = np.concatenate(found, axis=1) * omega**4
        poles = -decay + 1j * np.sqrt(omega**2 - held - decay**2)
        return poles, -driven / (2 * poles)


@dataclass(frozen=True)
class _Part:
    """One cable for the movements of its ends by bodies, then by winches.

    Attributes
    ----------
    element : Superelement
        With the modes that its ends move.
    used : ndarray of bool
        Which these are.
    moved : ndarray, shape (e, d)
        Displacements of the ends that bodies move.
    winches : ndarray of int
        Which reel it in.
    """

    element: object
    used: np.ndarray
    moved: np.ndarray
    winches: np.ndarray

    @classmethod
    def of(cls, element, moved, winches, near, windows):
        """That of a `Superelement` at the ends that are moved; `near` is that of nearly the same one."""
        used = element.moved_by_ends if near is None else near.used
        element = element if used.all() else element.select(used)
        return cls(replace(element, near=near and near.element, windowed=windows), used, moved, winches)

    @cached_property
    def summed(self):
        """`PoleSum` of the stiffness in s; None without coupling by damping, or see `pole_sum_in_s`."""
        return self.element.coupling_damping.pole_sum_in_s if self.element.coupled else None

    def stiffness(self, s):
        """Forces at the ends that bodies move, by these and by the winches, shape (f, e, e + w)."""
        return self.element.dynamic_stiffness(s, slice(len(self.moved)))


class _Together:
    """Cables whose stiffness is a sum over poles.

    Parameters
    ----------
    parts : list of _Part
        c of them.
    winches : int
        How many there are, i.
    """

    def __init__(self, parts, winches):
        self._sums, self._polynomial = [], [0.0, 0.0, 0.0]
        for part in parts:
            one, columns, rows = part.summed, _columns(part, winches), slice(len(part.moved))
            spread = np.kron(part.moved, columns)
            residues = one.residues[:, rows].reshape(len(one.poles), len(spread))
            # whichever has fewer columns: residues for the ends, or for the bodies and winches
            self._sums.append((one.poles, residues, spread) if len(spread) < spread.shape[1] else
                              (one.poles, residues @ spread, None))  # fmt: skip
            for order, coefficient in enumerate(one.polynomial):
                self._polynomial[order] = self._polynomial[order] + part.moved.T @ coefficient[rows] @ columns

    def __call__(self, s):
        """Forces on the bodies by these and by the winches, shape (f, d, d + i)."""
        moving = 0.0
        for poles, residues, spread in self._sums:
            own = (1 / (s[:, None] - poles)) @ residues
            moving = moving + (own if spread is None else own @ spread)
        static, first, second = self._polynomial
        s = s[:, None, None]
        return s * (s * (second - moving.reshape(len(s), *second.shape)) + first) + static


def _columns(part, winches):
    """Movements of the ends of a `_Part`, and its reeling in, by those of the bodies and all winches."""
    (ends, coordinates), own = part.moved.shape, len(part.winches)
    found = np.zeros((ends + own, coordinates + winches))
    found[:ends, :coordinates] = part.moved
    found[ends + np.arange(own), coordinates + part.winches] = 1.0
    return found
