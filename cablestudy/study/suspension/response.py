"""Variances of a suspension in turbulent wind: displacements, rates, tensions, and what actuators do.

One quadratic form: with Y(f) the response of an output to forces on the coordinates and S(f) the spectral matrix of the
forces by all places together, its spectrum is Y S Y^H. The loop closed and open are integrated at once.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control.pose_loop import PoseLoop
from cablestudy.control.second_order import polynomial
from cablestudy.errors import NoSolutionError
from cablestudy.wind import rms
from cablestudy.wind.imaging import correction_weight, exposure_weight

TURN = 2 * np.pi
LOWEST, HIGHEST = 1e-4, 1e3  # range over the slowest and fastest of wind, loop and lowest mode
NARROW = 0.3  # damping ratio below which a pole is a boundary of panels
IMPORTANT = 3e-5  # share of its mode in the variance of an output from which it is one
BESIDE = 0.02  # relative distance of a pole from the frequency of its mode
UNDAMPED = 1e-9  # damping ratio below which a resonance is not bounded
SAME = 1e-6  # relative distance of such a pole from the frequency of its mode, at most
EXCITED = 1e-6  # share with that damping ratio from which it is refused: what is less is rounding, or not seen
APART = 0.5  # least distance of boundaries, in half-widths
ACCURACY = 1e-4  # where the scene has a fixed model
PANELS = 5000  # of the integral, at most
SAMPLES = 8  # frequencies a decade at which that error is estimated,
OFFSETS = np.array([-9.0, -3.0, -1.0, 0.0, 1.0, 3.0, 9.0])  # and beside resonances
ROUNDING = 1e-20  # of the energy of an output over the largest of all: what is less is shown as zero
AT_ONCE = 500_000  # entries of the matrices that are solved at once
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
    largest : ndarray, shape (2, o)
        The largest variance in the group of each, whose tolerance they share.
    error : dict
        "value", "rate" and so on -> estimated error of each, by integration and by the model, shape (2, o).
    """

    rows: dict
    value: np.ndarray
    rate: np.ndarray
    exposed: np.ndarray
    corrected: np.ndarray
    both: np.ndarray
    largest: np.ndarray
    error: dict


class Response:
    """The response of a `Movement` to its gusts.

    Parameters
    ----------
    movement : Movement
        With wind, and stable.
    """

    def __init__(self, movement):
        self.movement = movement

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

    def shown(self, s):
        """All outputs by the coordinates with the winches at rest, shape (f, o, m)."""
        motion = self.movement.motion
        shown = polynomial(motion.moved, s)
        stroke, more = len(motion) - sum(not one.wheel for one in self.movement.actuators), []
        for one, feedback in zip(self.movement.actuators, motion.feedback, strict=True):
            force = feedback.gain(s)[:, None] * feedback.measured
            if one.wheel:
                more += [force / s[:, None], force]
            else:
                more += [np.broadcast_to(np.eye(len(motion))[stroke], force.shape), force]
                stroke += 1
        return np.concatenate([shown, np.stack(more, axis=1)], axis=1) if more else shown

    def responses(self, frequency, space=None):
        """All outputs per force on each coordinate, shape (2, f, m, o): with the loop, and with the winches at rest.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        space : ndarray, shape (m, r), optional
            That the coordinates move in.

        Notes
        -----
        With the loop the dynamic stiffness D loses b a, b being what winches do to coordinates, a the winches by the
        coordinates; so D is factorised once for both (Woodbury's formula): c (D - b a)^-1 = c D^-1 + c D^-1 b (1 - a
        D^-1 b)^-1 a D^-1.
        """
        motion, loop = self.movement.motion, self.loop
        if space is not None:
            motion, loop = motion.within(space), loop and loop.within(space)
        s = 2j * np.pi * frequency
        shown = self.shown(s)
        shown = shown if space is None else shown @ space
        dynamic = np.swapaxes(motion.dynamic_stiffness(s), -1, -2)
        if loop is None:
            found = np.linalg.solve(dynamic, np.swapaxes(shown, -1, -2))
            return found[None]
        measured = np.broadcast_to(loop.allocation.measured, (len(s), *loop.allocation.measured.shape))
        solved = np.linalg.solve(dynamic, np.swapaxes(np.concatenate([shown, measured], axis=1), -1, -2))
        at_rest, seen = solved[..., : len(self.names)], solved[..., len(self.names) :]
        winches = loop.winch_gain(s)  # winches by what is measured
        pulled = motion.pulled(s)
        # what is measured, and what is shown, by a movement of the winches; then by what is measured
        loop_gain = np.swapaxes(seen, -1, -2) @ pulled @ winches
        follow = polynomial(motion.follow, s)
        driven = np.swapaxes(at_rest, -1, -2) @ pulled
        driven[:, : follow.shape[1]] += follow
        inverse = np.linalg.inv(np.eye(loop_gain.shape[-1]) - loop_gain)
        closed = at_rest + seen @ np.swapaxes(driven @ winches @ inverse, -1, -2)
        return np.stack([closed, at_rest])

    def spectra(self, frequency, space=None):
        """One-sided spectra of all outputs, shape (2, o, f), or (1, o, f) without a loop; arguments as `responses`."""
        forced = self.movement.motion.shapes.shape[1]  # strokes are not blown
        at_once, found = max(1, AT_ONCE // len(self.movement.motion) ** 2), []
        for begin in range(0, len(frequency), at_once):
            part = frequency[begin : begin + at_once]
            response = self.responses(part, space)
            response = (response if space is None else space @ response)[:, :, :forced]
            states = response.shape[0]
            together = np.concatenate(list(response), axis=-1)
            spectra = self.movement.gusts.variance_spectra(part, together)
            found.append(spectra.T.reshape(states, len(self.names), len(part)))
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

    def resonances(self, space=None):
        """Frequency and half-width of the narrow resonances that the outputs feel. [Hz]

        Of the poles with the winches at rest those near the frequency of a mode that has a share in the variance of an
        output; with the loop also those that it moves.
        """
        loop, poles = self.loop, self.movement.open_poles
        if space is not None:
            motion = self.movement.motion.within(space)
            loop, poles = loop and loop.within(space), PoseLoop(motion, None, 0.0, ()).poles
        centre, width = self._narrow(poles)
        unit = self.movement.motion.unit[: self.movement.motion.shapes.shape[1]]
        important = unit[self._shares > IMPORTANT] / TURN
        if len(important):
            near = np.abs(centre[:, None] - important).min(axis=1) < np.maximum(width, BESIDE * centre)
            centre, width = centre[near], width[near]
        if loop is not None:
            moved, narrow = self._narrow(loop.poles)
            far = np.abs(moved[:, None] - centre).min(axis=1, initial=np.inf) > APART * narrow
            centre, width = np.append(centre, moved[far]), np.append(width, narrow[far])
        return centre, width

    @cached_property
    def _of_all(self):
        self.check_damped()
        return self.resonances()

    def check_damped(self):
        """Refuse a resonance that the wind excites and nothing bounds.

        Raises
        ------
        NoSolutionError
        """
        poles, unit = self.movement.open_poles, self.movement.motion.unit[: len(self._shares)]
        poles = poles[(poles.imag > 0) & (np.abs(poles.real) < UNDAMPED * np.abs(poles))]
        for frequency in np.abs(poles[np.abs(poles) < TURN * self.range[1]]).tolist():
            mode = int(np.argmin(np.abs(unit - frequency)))
            if abs(unit[mode] - frequency) < SAME * frequency and self._shares[mode] > EXCITED:
                raise NoSolutionError(
                    f"undamped: {self.movement.mode_name(mode)} has a damping ratio below {UNDAMPED:g}, so that its "
                    f"RMS in the wind is not finite (cable.damping)"
                )

    def _narrow(self, poles):
        """Frequency and half-width of lightly damped poles within the range, not of undamped ones. [Hz]"""
        low, high = self.range
        ratio = np.abs(poles.real) / np.abs(poles)
        poles = poles[(poles.imag > 0) & (ratio >= UNDAMPED) & (ratio < NARROW)]
        centre, width = np.abs(poles) / TURN, np.abs(poles.real) / TURN
        there = (low < centre) & (centre < high)
        return centre[there], width[there]

    @cached_property
    def _shares(self):
        """Largest share of each coordinate, as if it were alone, in the variance of any output, about; shape (m,)."""
        motion = self.movement.motion
        count = motion.shapes.shape[1]
        unit, damping = motion.unit[:count], np.diagonal(motion.damping)[:count]
        force = self.movement.gusts.own(unit / TURN)
        size = motion.moved[0][:, :count] ** 2 * force / (4 * np.maximum(damping, 1e-9 * unit) * unit**2)
        whole = size.sum(axis=1)
        energy = whole * self.stiffness[: len(whole)]
        moved = energy > ROUNDING * energy.max(initial=0.0)  # the others the wind does not move
        return (size[moved] / whole[moved, None]).max(axis=0, initial=0.0)

    @cached_property
    def weights(self):
        """Functions of frequency that the spectra are weighted by, by the names of `Variances`."""
        scene = self.movement.scene
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
    def moving_error(self):
        """Largest relative error by the modes left out of the variances of displacement and velocity of bodies. [-]"""
        places = [row for row, name in enumerate(self.names) if name.endswith((".x", ".y", ".z"))]
        added, variances = (part[:2, :, places] for part in self.model_error)
        groups = np.array(_groups(self.names))[places]
        found = [0.0]
        for group in set(groups.tolist()):
            own = groups == group
            part, whole = added[..., own].sum(axis=-1), variances[..., own].sum(axis=-1)
            found += (part[whole > 0] / whole[whole > 0]).tolist()
        return max(found)

    @cached_property
    def variances(self):
        """`Variances` of all outputs."""
        names = self.names
        states, weights = 1 if self.loop is None else 2, list(self.weights.values())
        groups = np.array(_groups(names))
        kinds = states * len(weights)

        def weighted(frequency):
            spectra = self.spectra(frequency)
            return np.concatenate([(weight(frequency) * spectra).reshape(-1, len(frequency)) for weight in weights])

        accuracy = self.movement.scene.model.accuracy or ACCURACY
        every = (np.arange(kinds)[:, None] * (groups.max(initial=0) + 1) + groups).ravel()
        edges = _apart(*self.range, *self._of_all)
        scale = np.tile(self.stiffness, kinds)
        found = rms.integrate(weighted, edges, accuracy, every, scale, PANELS)
        # below the range the spectra are flat, or fall to zero
        first, second = found.edges[:2]
        value = found.value + found.panels[0] * (first / (second - first))
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        shape = len(weights), states, len(names)
        value, error = np.maximum(value, 0.0).reshape(shape), found.error.reshape(shape)
        largest = np.zeros((len(weights), states, groups.max(initial=0) + 1))
        np.maximum.at(largest, (slice(None), slice(None), groups), value)
        largest = largest[..., groups]
        energy = value * self.stiffness
        value = np.where(energy > ROUNDING * energy.max(axis=-1, keepdims=True), value, 0.0)
        error = error + self.model_error[0]

        def both_states(part):
            return part if states == 2 else np.concatenate([part, part])

        values = {name: both_states(part) for name, part in zip(self.weights, value, strict=True)}
        errors = {name: both_states(part) for name, part in zip(self.weights, error, strict=True)}
        none = np.zeros((2, len(names)))
        values = {name: values.get(name, none) for name in ("value", "rate", "exposed", "corrected", "both")}
        rows = {name: row for row, name in enumerate(names)}
        return Variances(rows, **values, largest=both_states(largest[0]), error=errors)

    @cached_property
    def stiffness(self):
        """Energy per square of each output, by which different outputs are compared, shape (o,)."""
        motion = self.movement.motion
        shown = self.shown(1j * motion.unit[:1])[0]
        compliance = (shown.conj() * np.linalg.solve(motion.stiffness, shown.T).T).sum(axis=1).real
        return 1 / np.maximum(compliance, np.finfo(float).tiny)

    @cached_property
    def model_error(self):
        """What the highest modes add to the variances of all outputs, and these, from a few frequencies.

        Returns
        -------
        added, variances : ndarray, shape (w, 2, o), or (w, 1, o) without a loop
            For each of `weights`.
        """
        whole = self._sampled()
        return np.abs(whole - self._sampled(self.movement.fewer)), whole

    def _sampled(self, space=None):
        """Variances from a few frequencies, more beside each resonance, by the trapezoid rule."""
        low, high = self.range
        frequency = np.geomspace(low, high, int(SAMPLES * np.log10(high / low)))
        centre, width = self._of_all if space is None else self.resonances(space)
        frequency = np.unique(np.append(frequency, centre[:, None] + width[:, None] * OFFSETS))
        frequency = frequency[(frequency >= low) & (frequency <= high)]
        spectra = self.spectra(frequency, space)
        return np.stack([np.trapezoid(weight(frequency) * spectra, frequency) for weight in self.weights.values()])


def _groups(names):
    """Number of the group of each output: displacements of one body or marker, its rotations, tensions of a cable."""
    found, groups = {}, []
    for name in names:
        owner, _, quantity = name.rpartition(".")
        kind = "place" if quantity in ("x", "y", "z") else "turn" if quantity in ("rx", "ry", "rz") else quantity
        kind = "tension" if kind.startswith("tension") else kind
        groups.append(found.setdefault((owner, kind), len(found)))
    return groups


def _apart(low, high, centre, width):
    """Boundaries between low and high: two a decade, and at each resonance, none within half its width of another."""
    kept = list(np.geomspace(low, high, 2 + int(2 * np.log10(high / low))))
    for place in np.argsort(width).tolist():
        if np.abs(np.array(kept) - centre[place]).min() > APART * width[place]:
            kept.append(centre[place])
    return np.sort(kept)
