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
from cablestudy.wind.imaging import seen_weights
from cablestudy.wind.integrals import ALONG_CABLES, UNDAMPED, Integrals
from cablestudy.wind.variance import smooth_on, with_turns

TURN = 2 * np.pi
LOWEST, HIGHEST = 1e-4, 1e3  # range over the slowest and fastest of wind, loop and lowest mode
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
    weighted : dict
        "value", "rate" (of the derivative) and names of `seen_weights` -> variances, shape (2, o).
    error : dict
        The same names -> estimated errors, by interpolation and by the model, shape (2, o).
    """

    rows: dict
    weighted: dict
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
    def _integrals(self):
        """`Integrals` of values, rates and what a telescope sees."""
        scene, gusts = self.scene, self.movement.gusts
        weights = {"value": np.ones_like, "rate": lambda f: (TURN * f) ** 2}
        weights |= seen_weights(scene.exposure, scene.correction)
        edges = with_turns(gusts.edges(*self.range), self.loop.law.delay if self.loop else 0.0)
        least = ALONG_CABLES if gusts.strips else UNDAMPED
        return Integrals.on(smooth_on(edges, weights.values()), gusts, weights, least)

    @cached_property
    def _late_error(self):
        """Error of the variances with the loop by poles that lack the right delay, shape (w, o)."""
        loop, integrals = self.loop, self._integrals
        if loop is None or not loop.law.delay:
            return 0.0
        late = TURN * integrals.panels.frequency > loop.right_up_to
        late = replace(integrals, weights={name: weight * late for name, weight in integrals.weights.items()})
        return DELAYED * loop.gain_beyond * late.variances(self.movement.residues[1])

    @cached_property
    def _undamped(self):
        """`Integrals.undamped` of the outputs, with the loop and with the winches at rest, shape (2, o)."""
        states = zip(self.movement.residues, self._variances[0][0], strict=True)
        found = [self._integrals.undamped(residues, value, self.stiffness) for residues, value in states]
        return np.broadcast_to(found, (2, len(self.names)))

    def check_damped(self, names, state):
        """Refuse a resonance that the wind excites and nothing bounds.

        Parameters
        ----------
        names : sequence of str
            Of the outputs that it would move.
        state : {CLOSED, OPEN}

        Raises
        ------
        NoSolutionError
        """
        worst = self._undamped[state, [self.names.index(name) for name in names]]
        if worst.any():
            raise self._not_finite(worst[np.argmax(worst != 0)])

    def _not_finite(self, pole):
        """The error of a pole that nothing damps: NoSolutionError."""
        moved = self.movement.mode_name(int(np.argmin(np.abs(self.movement.motion.unit - np.abs(pole)))))
        return NoSolutionError(
            f"undamped: {moved} has a damping ratio below {self._integrals.least:g}, so that its RMS in the wind is "
            f"not finite (cable.damping)"
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
        whole, fewer = (
            np.stack([self._integrals.variances(one) for one in residues], axis=1)
            for residues in (self.movement.residues, self.movement.fewer_residues)
        )
        return whole, np.abs(whole - fewer)

    @cached_property
    def variances(self):
        """`Variances` of all outputs, without what nothing damps: see `check_damped`."""
        value, added = self._variances
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        energy = value * self.stiffness
        value = np.where(energy > ROUNDING * energy.max(axis=-1, keepdims=True), value, 0.0)
        tension = np.array([".tension_" in name for name in self.names])
        added = np.where(tension, _of_tensions(value, added, tension), added)
        error = added + INTERPOLATED * value
        error[:, CLOSED] += self._late_error
        names, both_states = list(self._integrals.weights), (2, len(self.names))
        values, errors = (
            {name: np.broadcast_to(part, both_states) for name, part in zip(names, parts, strict=True)}
            for parts in (value, error)
        )
        return Variances({name: row for row, name in enumerate(self.names)}, values, errors)

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, and their estimated errors: two of shape (2, i).

        Raises
        ------
        NoSolutionError
            A resonance that nothing damps moves a winch.
        """
        integrals, names = self._integrals, ("value", "rate")
        whole, fewer = (integrals.variances(one, names) for one in self.movement.winch_residues)
        worst = integrals.undamped(self.movement.winch_residues[0], whole[0], np.ones(whole.shape[1]))
        if worst.any():
            raise self._not_finite(worst[np.argmax(worst != 0)])
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
