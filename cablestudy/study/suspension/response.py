"""Variances of a suspension in turbulent wind: displacements, rates, tensions, and what actuators do.

One quadratic form: with Y(f) the response of an output to forces on the coordinates and S(f) the spectral matrix of the
forces by all places together, its spectrum is Y S Y^H. Its integral follows from the poles (`wind.variance`), with the
loop closed and with the winches at rest.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.pose_state_space import by_forces
from cablestudy.errors import NoSolutionError
from cablestudy.system.residues import Residues
from cablestudy.wind.imaging import correction_weight, exposure_weight
from cablestudy.wind.variance import Panels, mixed_variances, smooth_on, variances, with_turns

TURN = 2 * np.pi
LOWEST, HIGHEST = 1e-4, 1e3  # range over the slowest and fastest of wind, loop and lowest mode
UNDAMPED = 1e-9  # damping ratio below which a resonance is not bounded
SAME = 1e-6  # relative distance of such a pole from the frequency of its mode, at most
EXCITED = 1e-6  # share with that damping ratio from which it is refused: what is less is rounding, or not seen
ACCURACY = 1e-4  # where the scene has a fixed model
INTERPOLATED = 6e-6  # error of a variance by the covariances between known ones, see `wind.gusts`
TENSION = 6.0  # what modes left out add to a tension over what the highest ones add: with fewer of them it falls slowly
ABOVE = 1e-3  # of the variance of a tension: by waves along the cables, far above the modes of the model
ROUNDING = 1e-16  # of the energy of an output over the largest of all: what is less is shown as zero
DELAYED = 4.0  # largest relative error of a variance by a pole that lacks the right delay, over the loop gain there
AT_ONCE = 500_000  # entries of the responses that are computed at once
CLOSED, OPEN = 0, 1


@dataclass(frozen=True)
class Variances:
    """Of some outputs, o of them; with the loop first, then with the winches at rest.

    Attributes
    ----------
    rows : dict
        Name of each output -> its place.
    value, rate : ndarray, shape (2, o)
        Variance of each output and of its derivative.
    exposed, corrected, both : ndarray, shape (2, o)
        Within one exposure, what the correcting mirror leaves, and both; zero where the scene has none.
    error : dict
        "value", "rate" and so on -> estimated error of each, by interpolation and by the model, shape (2, o).
    """

    rows: dict
    value: np.ndarray
    rate: np.ndarray
    exposed: np.ndarray
    corrected: np.ndarray
    both: np.ndarray
    error: dict


class Response:
    """The response of a `Movement` to its gusts.

    Parameters
    ----------
    movement : Movement
        With wind, and stable.
    scene : SuspensionScene
        Its scene, or one with another exposure or correction.
    """

    def __init__(self, movement, scene):
        self.movement, self.scene = movement, scene

    @cached_property
    def names(self):
        """Of all outputs: those of the movement, then stroke or momentum and force or torque of each actuator."""
        names = list(self.movement.outputs)
        for one in self.movement.actuators:
            names += [f"{one.name}.{what}" for what in (("momentum", "torque") if one.wheel else ("stroke", "force"))]
        return names

    @property
    def loop(self):
        """The `PoseLoop` where it does something, else None."""
        loop = self.movement.loop
        return loop if loop is not None and loop.gain else None

    # ------------------------------------------------------------------------------------------------ frequencies

    def responses(self, frequency):
        """All outputs by the inputs of `Gusts.into`, shape (2, f, i, o), or (1, f, i, o) without a loop.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        """
        found = [one.response(2j * np.pi * frequency) for one in self.movement.residues]
        return np.swapaxes(np.stack(found), -1, -2)

    def spectra(self, frequency):
        """One-sided spectra of all outputs, shape (2, o, f), or (1, o, f) without a loop; `frequency` in Hz."""
        at_once = max(1, AT_ONCE // len(self.movement.motion) ** 2)
        parts = np.split(frequency, range(at_once, len(frequency), at_once))
        gusts = self.movement.gusts
        found = [[gusts.input_spectra(part, one).T for one in self.responses(part)] for part in parts]
        return np.concatenate(found, axis=-1)

    # -------------------------------------------------------------------------------------------------- integrals

    @cached_property
    def range(self):
        """Lowest and highest frequency of the integrals. [Hz]"""
        movement = self.movement
        wind, lowest = movement.scene.wind, movement.modes.frequency[0]
        corner = wind.speed / wind.length_scale
        slow = [corner, lowest] + ([] if self.loop is None else [self.loop.gain / TURN])
        return LOWEST * min(slow), HIGHEST * max(corner, lowest)

    @cached_property
    def weights(self):
        """Functions of frequency that the spectra are weighted by, by the names of `Variances`."""
        scene = self.scene
        found = {"value": np.ones_like, "rate": lambda f: (TURN * f) ** 2}
        exposure, mirror = scene.exposure, scene.correction
        if exposure is not None:
            found["exposed"] = lambda f: exposure_weight(f, exposure)
        if mirror is not None:
            found["corrected"] = lambda f: correction_weight(f, mirror.bandwidth, mirror.delay)
        if exposure is not None and mirror is not None:
            found["both"] = lambda f: found["exposed"](f) * found["corrected"](f)
        return found

    @cached_property
    def _wind(self):
        """`Panels`, `Noise` on them, and the weights there, shape (w, n)."""
        gusts, weights = self.movement.gusts, list(self.weights.values())
        edges, delay = gusts.edges(*self.range), self.loop.law.delay if self.loop else 0.0
        panels = Panels(smooth_on(with_turns(edges, delay), weights))
        return panels, gusts.noise(panels.frequency), np.stack([weight(panels.frequency) for weight in weights])

    @cached_property
    def _late_error(self):
        """Error of the variances with the loop by poles that lack the right delay, shape (w, o)."""
        loop, (panels, _, weights) = self.loop, self._wind
        if loop is None or not loop.law.delay:
            return 0.0
        late = weights * (TURN * panels.frequency > loop.right_up_to)
        return DELAYED * loop.gain_beyond * self._integrated(self.movement.residues[1:], late)[:, 0]

    def _integrated(self, systems, weights=None):
        """Variances of the outputs of some `Residues`, shape (w, len(systems), o), with other weights than `weights`.

        A pole that nothing damps is left out: `check_damped` refuses
        it where the wind excites it.
        """
        weights = self._wind[2] if weights is None else weights
        return np.stack([self._variances_of(system, weights) for system in systems], axis=1)

    def _variances_of(self, system, weights):
        """Variances of the outputs of one `Residues` or `Beside`, shape (w, o)."""
        (panels, noise, _), gusts = self._wind, self.movement.gusts
        if isinstance(system, Residues):
            return variances(_bounded(system), panels, noise, weights)
        sharp = system.sharp.some(np.abs(system.sharp.poles) <= TURN * self.range[1])

        def smooth(frequency):
            s = 2j * np.pi * frequency
            return system.response(s) - sharp.response(s)

        return mixed_variances(_bounded(sharp), smooth, gusts.matrix_times, panels, noise, weights)

    def check_damped(self):
        """Refuse a resonance that the wind excites and nothing bounds.

        Raises
        ------
        NoSolutionError
        """
        poles = self.movement.open_poles
        poles = poles[(poles.imag > 0) & (-poles.real < UNDAMPED * np.abs(poles))]
        poles = np.sort(np.abs(poles[np.abs(poles) < TURN * self.range[1]]))
        if not len(poles):
            return
        motion, count = self.movement.motion, len(self.movement.gusts.into)
        unit = motion.unit[:count]
        damping = np.diagonal(motion.damping)[:count] + np.diagonal(motion.stiffness).imag[:count] / unit
        # variance by each coordinate as if it were alone, about
        force = self.movement.gusts.own(unit / TURN)
        alone = np.abs(motion.moved[0][:, :count]) ** 2 * force / (4 * np.maximum(damping, UNDAMPED * unit) * unit**2)
        whole = alone.sum(axis=1)
        energy = whole * self.stiffness[: len(whole)]
        moved = energy > ROUNDING * energy.max(initial=0.0)  # the others the wind does not move
        shares = (alone[moved] / whole[moved, None]).max(axis=0, initial=0.0)
        for frequency in poles.tolist():
            mode = int(np.argmin(np.abs(unit - frequency)))
            if abs(unit[mode] - frequency) < SAME * frequency and shares[mode] > EXCITED:
                raise NoSolutionError(
                    f"undamped: {self.movement.mode_name(mode)} has a damping ratio below {UNDAMPED:g}, so that its "
                    f"RMS in the wind is not finite (cable.damping)"
                )

    @cached_property
    def moving_error(self):
        """Largest relative error by the modes left out of the variances of displacement and velocity of bodies. [-]"""
        places = [row for row, name in enumerate(self.names) if name.endswith((".x", ".y", ".z"))]
        whole, added = (part[:2, :, places] for part in self._variances)
        groups = np.array(_groups(self.names))[places]
        found = [0.0]
        for group in set(groups.tolist()):
            own = groups == group
            part, total = added[..., own].sum(axis=-1), whole[..., own].sum(axis=-1)
            found += (part[total > 0] / total[total > 0]).tolist()
        return max(found)

    @cached_property
    def _variances(self):
        """Variances of all outputs, and what the highest modes add to them, both of shape (w, 2, o) or (w, 1, o)."""
        whole = self._integrated(self.movement.residues)
        return whole, np.abs(whole - self._integrated(self.movement.fewer_residues))

    @cached_property
    def variances(self):
        """`Variances` of all outputs."""
        self.check_damped()
        value, added = self._variances
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        energy = value * self.stiffness
        value = np.where(energy > ROUNDING * energy.max(axis=-1, keepdims=True), value, 0.0)
        tension = np.array([".tension_" in name for name in self.names])
        added = np.where(tension, _of_tensions(value, added, tension), added)
        error = added + INTERPOLATED * value
        error[:, CLOSED] += self._late_error

        def both_states(part):
            return part if len(part) == 2 else np.concatenate([part, part])

        values = {name: both_states(part) for name, part in zip(self.weights, value, strict=True)}
        errors = {name: both_states(part) for name, part in zip(self.weights, error, strict=True)}
        none = np.zeros((2, len(self.names)))
        values = {name: values.get(name, none) for name in ("value", "rate", "exposed", "corrected", "both")}
        return Variances({name: row for row, name in enumerate(self.names)}, **values, error=errors)

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, and their estimated errors: two of shape (2, i)."""
        weights = self._wind[2][:2]
        whole, fewer = (self._integrated([one], weights)[:, 0] for one in self.movement.winch_residues)
        return whole, np.abs(whole - fewer) + INTERPOLATED * whole

    @cached_property
    def stiffness(self):
        """Energy per square of each output, about, by which different outputs are compared, shape (o,)."""
        motion = self.movement.motion
        count = len(motion)
        rows = np.abs(by_forces(motion, np.zeros((count, 0)), None, self.movement.actuators)[1][:, : 2 * count]) ** 2
        places = rows[:, :count] * motion.unit**2 / np.diagonal(motion.stiffness.real)
        compliance = (places + rows[:, count:] / np.diagonal(motion.mass)).sum(axis=1)
        return 1 / np.maximum(compliance, np.finfo(float).tiny)


def _bounded(system):
    """`Residues` without the poles that nothing damps.

    Those below the real axis of a one-sided response are no resonances: they stay, a little off the imaginary axis.
    """
    poles, size = system.poles, np.abs(system.poles)
    damped = -poles.real >= UNDAMPED * size
    if not system.one_sided:
        return system.some(damped)
    below = poles.imag < 0
    still = below & (np.abs(poles.real) < UNDAMPED * size)
    return replace(system, poles=np.where(still, poles - UNDAMPED * size, poles)).some(damped | below)


def _of_tensions(value, added, tension):
    """Estimated errors of the variances of tensions, shape (w, states, o).

    What the highest modes add is a chance of single modes: so the largest of all tensions counts, relative or absolute.
    """
    added = np.where(tension, added, 0.0)
    relative = np.where(value > 0, added / np.where(value > 0, value, 1.0), 0.0)
    seen = np.minimum(added.max(axis=-1, keepdims=True), relative.max(axis=-1, keepdims=True) * value)
    return TENSION * seen + ABOVE * value


def _groups(names):
    """Number of the group of each output: displacements of one body or marker, its rotations, tensions of a cable."""
    found, groups = {}, []
    for name in names:
        owner, _, quantity = name.rpartition(".")
        kind = "place" if quantity in ("x", "y", "z") else "turn" if quantity in ("rx", "ry", "rz") else quantity
        kind = "tension" if kind.startswith("tension") else kind
        groups.append(found.setdefault((owner, kind), len(found)))
    return groups
