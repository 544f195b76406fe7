"""A cable as its ends feel it: static stiffness, inertia and the modes between, in global axes, with its damping.

Everything dynamic (frequency response, state space, gondola, winch loop) is made from this. With u the ends, q the
modes about the static shapes that the ends impose, m = -p/W^2 and c(s) the damping of the elastic strain,

    (s^2 + W^2 + c E) q = -(c R + s^2 m) u,        f = (K + c S + s^2 M) u + (c R + s^2 m)^T q

c = i loss factor (hysteretic), c = s time (Kelvin-Voigt); E, R, S are the elastic parts of the modes' stiffness, of
modes against static shapes, and of the static shapes. The paper's modal damping instead damps the modes with fixed
ends, each by its ratio.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import joined
from cablestudy.control.poles import all_poles, slow_poles
from cablestudy.errors import NoSolutionError

GROUND, GONDOLA = 0, 3  # x of end 1 and of end 2 among the six end displacements
NAMES = tuple(f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz")
TRUSTED = 1e-10  # difference between the sum over poles and solved systems up to which the sum is an answer
HOPEFUL = 1e-4  # the same, up to which it is worth finding the poles twice
LOCKED = 10  # c at the lowest frequency from which damping holds the strain


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
        """c(s)."""
        return s * self.amount if self.law == "kelvin_voigt" else 1j * self.amount * np.sign(np.imag(s))


@dataclass(frozen=True)
class EndModel:
    """The cable between its two ends. Ends are ordered end 1 x, y, z, end 2 x, y, z.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Of the modes with fixed ends. [rad/s]
    participation : ndarray, shape (n, 6)
        p = psi^T K21: modal force per end displacement; less W^2 psi^T M21 where the mass is not lumped.
        [N/(m sqrt(kg))]
    damping_ratio : ndarray, shape (n,)
        Modal; where the strain is damped, the equivalent one. [-]
    stiffness : ndarray, shape (6, 6)
        Static, interior condensed. [N/m]
    inertia : ndarray, shape (6, 6)
        Mass of the static shapes. [kg]
    strain : Strain or None
        None for modal damping.
    """

    omega: np.ndarray
    participation: np.ndarray
    damping_ratio: np.ndarray
    stiffness: np.ndarray
    inertia: np.ndarray
    strain: Strain | None = None

    @property
    def feedthrough(self):
        """D: static stiffness plus what the modes take off it, shape (6, 6). [N/m]"""
        scaled = self.participation / self.omega[:, None]
        return self.stiffness + scaled.T @ scaled

    @cached_property
    def residual_inertia(self):
        """What the modes leave of `inertia`: the ends' own mass and the omitted modes', shape (6, 6). [kg]"""
        scaled = self.participation / self.omega[:, None] ** 2
        return self.inertia - scaled.T @ scaled

    def select(self, chosen):
        """The same cable with only some modes; its static stiffness stays exact.

        Parameters
        ----------
        chosen : array of int or bool

        Returns
        -------
        EndModel
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
        )

    @cached_property
    def poles(self):
        """(values, left, right) of the strain-damped modes, so that no system is solved per frequency.

        q = sum of left (right a)/(s^2 + value), or over (s - value) for Kelvin-Voigt, for a right-hand side a.

        Raises
        ------
        NoSolutionError
            So much damping that rounding spoils the sum.
        """
        found = slow_poles(self.omega, self.strain)
        error = self._rounding(found)
        if TRUSTED < error <= HOPEFUL:
            try:
                with np.errstate(all="ignore"):  # what is not finite is not trusted
                    found = all_poles(self.omega, self.strain, found)
                    error = self._rounding(found)
            except np.linalg.LinAlgError:
                pass
        if not error <= TRUSTED:
            raise NoSolutionError(
                f"the strain is damped so much ({self.strain.law}, {self.strain.amount:g}) that rounding spoils the "
                f"response: cable.damping must be less"
            )
        return found

    def strained(self, s, rows, columns):
        """What modes and damped strain add at s, shape (m, 1) -> (m, r, c), beside the residual model. [N/m]"""
        return _summed(self, self.poles, s, rows, columns)

    @property
    def locked(self):
        """Whether so much damping acts that no mode strains the cable: the sums cancel elsewhere then."""
        return len(self.omega) > 0 and bool(np.abs(self.strain.factor(1j * self.omega.min())) > LOCKED)

    def _rounding(self, poles):
        """How far the sum over poles is from the solution of the systems that it stands for, at worst of some s. [-]"""
        if not len(self.omega):
            return 0.0
        # up to where the model means something, off the axis: a resonance has no more digits than its frequency
        s = (0.03 + 1j) * np.geomspace(self.omega.min() / 10, np.median(self.omega), 8)[:, None]
        summed, solved = _summed(self, poles, s, slice(None), slice(None)), _solved(self, s)
        whole = self.stiffness + self.residual_inertia * s[..., None] ** 2 + solved
        # at a zero of a diagonal entry the static one is its measure
        size = np.sqrt(np.abs(np.diagonal(whole, axis1=1, axis2=2)) + np.diagonal(self.stiffness))
        unit = size[:, :, None] * size[:, None, :]
        return float((np.abs(summed - solved) / np.where(unit > 0, unit, 1.0)).max())


def _summed(model, poles, s, rows, columns):
    """Damped strain, by the poles: c S - (c R + s^2 m)^T (s^2 + W^2 + c E)^-1 (c R + s^2 m) + s^2 m^T m.

    With the last term, which is left out of the inertia in turn, what modes far below s take off it does not cancel.
    """
    value, left, right = poles
    hysteretic, below = model.strain.law == "hysteretic", np.imag(s) < 0
    s = np.where(below, np.conj(s), s) if hysteretic else s  # the poles are those of the upper half-plane
    carried = -model.participation / model.omega[:, None] ** 2
    factor, square = model.strain.factor(s), s**2
    weight = 1 / (square + value if hysteretic else s - value)
    # (c a + s^2 b)(c d + s^2 e), term by term
    a, b = ((source[:, rows].T @ left).T[:, :, None] for source in (model.strain.coupling, carried))
    d, e = ((right @ source[:, columns])[:, None, :] for source in (model.strain.coupling, carried))
    shape, once, rest = (len(s), a.shape[1], d.shape[2]), value[:, None, None], 0.0
    if model.locked:
        powers = ((factor**2, a * d), (factor * square, a * e + b * d), (square**2, b * e))
        rest = square[..., None] * (carried[:, rows].T @ carried[:, columns])
    elif hysteretic:  # the sum of b e is m^T m
        powers = ((factor**2, a * d), (factor * square, a * e + b * d), (-square, once * b * e))
    else:  # that of value b e is, and those of a d, a e, b d and b e are none
        powers = ((factor**2, a * d), (factor * s, once * (a * e + b * d)), (square, once**2 * b * e))
    modal = sum(
        (power * (weight @ part.reshape(len(part), shape[1] * shape[2]))).reshape(shape) for power, part in powers
    )
    total = factor[..., None] * model.strain.ends[rows][:, columns] - modal + rest
    return np.where(below[..., None], total.conj(), total) if hysteretic else total


def _solved(model, s):
    """The same for all ends, by a system for each s."""
    strain, factor, square = model.strain, model.strain.factor(s)[..., None], s[..., None] ** 2
    carried = -model.participation / model.omega[:, None] ** 2
    stiff = factor * strain.modes + np.diag(model.omega**2)
    matrix, at_rest = stiff + square * np.eye(len(model.omega)), factor * strain.ends
    if model.locked:
        force = factor * strain.coupling + square * carried
        return at_rest - force.swapaxes(1, 2) @ np.linalg.solve(matrix, force) + square * (carried.T @ carried)
    ends = len(strain.ends)
    coupling, carried = (np.broadcast_to(part, (len(s), *part.shape)) for part in (strain.coupling, carried))
    answer = np.linalg.solve(matrix, np.concatenate([coupling, carried, stiff @ carried], axis=2))
    elastic, mixed, heavy = (answer[..., i * ends : (i + 1) * ends] for i in range(3))
    coupling, mixed = coupling.swapaxes(1, 2), coupling.swapaxes(1, 2) @ mixed
    modal = factor**2 * (coupling @ elastic) + factor * square * (mixed + mixed.swapaxes(1, 2))
    return at_rest - modal + square * (carried.swapaxes(1, 2) @ heavy)


class Ends:
    """The ends of a cable, or of many on one mesh: what they feel of it, and its modes between them, but for damping.

    Parameters
    ----------
    dynamics : Dynamics
        Of one cable, or with a leading axis of many.
    frame : ndarray, shape (..., 3, 3)
        Rows: the chord frame in global coordinates. [-]
    count : int
        How many modes to keep.
    """

    def __init__(self, dynamics, frame, count):
        self._dynamics, self._frame, self._count = dynamics, frame, count

    def model(self, damping, place=()):
        """The end model of one cable.

        Parameters
        ----------
        damping : Damping
            model, and ratio [-], loss_factor [-] or time [s].
        place : int
            Of the cable among many.

        Returns
        -------
        EndModel
        """
        omega, participation, stiffness, inertia = (part[place] for part in self._undamped)
        if damping.model == "modal":
            return EndModel(omega, participation, np.full(len(omega), damping.ratio), stiffness, inertia)
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        strain = Strain(damping.model, amount, *(part[place] for part in self._elastic))
        ratio = np.diagonal(strain.modes) / omega**2 * amount / 2 * (1 if damping.model == "hysteretic" else omega)
        return EndModel(omega, participation, ratio, stiffness, inertia, strain)

    @cached_property
    def moments(self):
        """How the cables' mass weighs on end 2 moving along x, shape (..., 3): s_0 [kg], s_1 [kg s^2], s_2 [kg s^4].

        With u the static shape of that movement and g = M u inside: s_0 = u^T M u, s_1 = g^T K^-1 g,
        s_2 = g^T K^-1 M K^-1 g. The mode k has the share p^2/W^(4 + 2 j) of s_j.
        """
        dynamics, along, moments = self._dynamics, self._frame[..., 0], 0.0
        for system in dynamics.systems:
            axes = len(system.axes)
            shape = (system.end_shapes * along[..., None, None, system.axes]).sum(axis=-1)
            shape = shape.reshape(*shape.shape[:-2], -1)
            weighted = _times(system.full_mass(), shape[..., None])[..., 0]
            inner = weighted[..., axes:-axes]
            moved = system.solve(inner[..., None])
            heavy, moved = _times(system.mass, moved)[..., 0], moved[..., 0]
            products = shape * weighted, inner * moved, moved * heavy
            moments = moments + np.stack([product.sum(axis=-1) for product in products], axis=-1)
        mass = np.asarray(dynamics.mass * dynamics.length)[..., None]
        slow = np.asarray(dynamics.length / dynamics.state.force)[..., None]
        return moments * mass * (mass * slow) ** np.arange(3)

    @cached_property
    def _modes(self):
        return self._dynamics.modes(self._count).first(self._count)

    @cached_property
    def _shapes(self):
        """System, the places of its axes among the six, and its static shapes for movements of either end."""
        for_each = []
        for system in self._dynamics.systems:
            # a movement of end 1 is one of the whole cable less one of end 2
            second = system.end_shapes
            both = np.concatenate([np.eye(len(system.axes)) - second, second], axis=-1)
            for_each.append((system, [*system.axes, *(axis + 3 for axis in system.axes)], both))
        return for_each

    @property
    def _turn(self):
        none = np.zeros_like(self._frame)
        return np.block([[self._frame, none], [none, self._frame]])

    @cached_property
    def _undamped(self):
        """Angular frequencies, participation, static stiffness and inertia, as in `EndModel`."""
        dynamics, modes, frame, turn = self._dynamics, self._modes, self._frame, self._turn
        participation = np.concatenate([(modes.rigid - modes.driven) @ frame, modes.driven @ frame], axis=-1)
        static, inertia = frame.swapaxes(-1, -2) @ dynamics.end_stiffness @ frame, np.zeros(turn.shape)
        for system, places, both in self._shapes:
            flat = joined(both)
            inertia[..., np.array(places)[:, None], places] = flat.swapaxes(-1, -2) @ _times(system.full_mass(), flat)
        inertia *= np.asarray(dynamics.mass * dynamics.length)[..., None, None]
        return (
            2 * np.pi * modes.frequency,
            participation,
            np.block([[static, -static], [-static, static]]),
            turn.swapaxes(-1, -2) @ inertia @ turn,
        )

    @cached_property
    def _elastic(self):
        """E, R and S of `Strain`."""
        dynamics, shapes, turn = self._dynamics, self._modes.shapes, self._turn
        n = shapes.shape[-1]
        elastic = np.zeros((*shapes.shape[:-3], n + 6, n + 6))
        for system, places, both in self._shapes:
            index = np.array([*range(n), *(n + place for place in places)])
            parts = np.concatenate([shapes[..., list(system.axes), :], both], axis=-1)
            elastic[..., index[:, None], index] += system.elastic_energy(parts)
        elastic *= np.asarray(dynamics.state.force / dynamics.length)[..., None, None]
        return (
            elastic[..., :n, :n],
            elastic[..., :n, n:] @ turn,
            turn.swapaxes(-1, -2) @ elastic[..., n:, n:] @ turn,
        )


def _times(matrix, flat):
    """A sparse matrix times stacked dense ones, shape (..., n, r), whose columns do not meet."""
    columns = np.moveaxis(flat, -2, 0)
    product = matrix @ columns.reshape(len(columns), flat.size // max(len(columns), 1))
    return np.moveaxis(product.reshape(columns.shape), 0, -2)
