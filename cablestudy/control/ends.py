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


def of_cable(dynamics, modes, frame, damping):
    """The end model of a cable.

    Parameters
    ----------
    dynamics : Dynamics
    modes : Modes
        The modes to keep.
    frame : ndarray, shape (3, 3)
        Rows: the chord frame in global coordinates. [-]
    damping : Damping
        model, and ratio [-], loss_factor [-] or time [s].

    Returns
    -------
    EndModel
    """
    omega = 2 * np.pi * modes.frequency
    n, mass, unit = len(modes), dynamics.mass * dynamics.length, dynamics.state.force / dynamics.length
    static, inertia, elastic = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((n + 6, n + 6))
    carried = np.zeros((n, 3))
    for system in dynamics.systems:
        axes = list(system.axes)
        places = axes + [axis + 3 for axis in axes]
        block = system.end_stiffness * unit
        static[np.ix_(places, places)] = np.block([[block, -block], [-block, block]])
        # a movement of end 1 is one of the whole cable less one of end 2
        second = system.end_shapes
        both = np.concatenate([np.eye(len(axes)) - second, second], axis=2)
        flat = both.reshape(-1, 2 * len(axes))
        inertia[np.ix_(places, places)] = mass * flat.T @ (system.full_mass() @ flat)
        shapes = modes.shapes[:, axes]
        ones = system.full_mass() @ np.tile(np.eye(len(axes)), (len(shapes), 1))
        carried[:, axes] = mass * shapes.reshape(len(ones), n).T @ ones  # the ends of a mode are at rest
        if damping.model != "modal":
            index = [*range(n), *(n + place for place in places)]
            elastic[np.ix_(index, index)] += unit * system.elastic_energy(np.concatenate([shapes, both], axis=2))
    participation = np.concatenate([-modes.driven - omega[:, None] ** 2 * carried, modes.driven], axis=1)
    turn = np.kron(np.eye(2), frame)
    strain, ratio = None, np.full(n, damping.ratio if damping.model == "modal" else 0.0)
    if damping.model != "modal":
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        share = np.diagonal(elastic)[:n] / omega**2
        ratio = share * amount / 2 * (1 if damping.model == "hysteretic" else omega)
        strain = Strain(damping.model, amount, elastic[:n, :n], elastic[:n, n:] @ turn, turn.T @ elastic[n:, n:] @ turn)
    return EndModel(omega, participation @ turn, ratio, turn.T @ static @ turn, turn.T @ inertia @ turn, strain)
