"""Variances of a suspension in turbulent wind: displacements, rates, tensions, and what actuators do.

One quadratic form: with Y(f) the response of an output to forces on the coordinates and S(f) the spectral matrix of the
forces by all places together, its spectrum is Y S Y^H. All are integrated over frequency at once.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.wind import rms
from cablestudy.wind.imaging import correction_weight, exposure_weight

TURN = 2 * np.pi
LOWEST, HIGHEST = 1e-4, 1e3  # range over the slowest and fastest of wind, loop and lowest mode
NARROW = 0.3  # damping ratio below which a pole gets boundaries of panels of its own
BESIDE = 2.0  # their distance from it, in half-widths
APART = 0.5  # least distance of boundaries, in half-widths
SHARE = 0.5  # of the accuracy that the integral may take
AT_ONCE = 2_000_000  # entries of the matrices that are solved at once


@dataclass(frozen=True)
class Variances:
    """Of the outputs of a suspension, o of them.

    Attributes
    ----------
    value, rate : ndarray, shape (o,)
        Variance of each output and of its derivative.
    exposed, corrected, both : ndarray, shape (o,)
        Within one exposure, what the correcting mirror leaves, and both; zero where the scene has none.
    error : float
        Largest estimated relative error of a variance by integration, of its group of outputs. [-]
    """

    value: np.ndarray
    rate: np.ndarray
    exposed: np.ndarray
    corrected: np.ndarray
    both: np.ndarray
    error: float


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
    def rows(self):
        """Name -> row of each output: those of the movement, then stroke or momentum and force or torque."""
        own = dict(self.movement.outputs)
        for one in self.movement.actuators:
            for quantity in ("momentum", "torque") if one.wheel else ("stroke", "force"):
                own[f"{one.name}.{quantity}"] = len(own)
        return own

    @cached_property
    def groups(self):
        """Outputs with the same number have a common tolerance, shape (o,): those of one body, marker or cable."""
        found, names = {}, []
        for name in self.rows:
            owner, _, quantity = name.rpartition(".")
            kind = "turn" if quantity in ("rx", "ry", "rz") else quantity if "_" not in quantity else "tension"
            names.append(found.setdefault((owner, "place" if kind in ("x", "y", "z") else kind), len(found)))
        return np.array(names)

    def responses(self, frequency, loop, motion):
        """Outputs per force on each coordinate, shape (f, m, o)."""
        s = 2j * np.pi * frequency
        powers = s[:, None, None]
        zeroth, first, second = motion.moved
        shown = zeroth + powers * first + powers**2 * second
        closed = loop is not None and loop.gain
        if closed and any(np.any(part) for part in motion.follow):
            zeroth, first, second = motion.follow
            shown = shown + (zeroth + powers * first + powers**2 * second) @ loop.winch_response(s)
        strokes = len(motion) - sum(not one.wheel for one in self.movement.actuators)
        more = []
        for one, feedback in zip(self.movement.actuators, motion.feedback, strict=True):
            force = feedback.gain(s)[:, None] * feedback.measured
            if one.wheel:
                more += [force / s[:, None], force]
                continue
            stroke = np.zeros((len(s), len(motion)))
            stroke[:, strokes] = 1.0
            strokes += 1
            more += [stroke, force]
        if more:
            shown = np.concatenate([shown, np.stack(more, axis=1)], axis=1)
        dynamic = loop.dynamic_stiffness(s) if closed else motion.dynamic_stiffness(s)
        return np.linalg.solve(np.swapaxes(dynamic, -1, -2), np.swapaxes(shown, -1, -2))

    def spectra(self, frequency, loop, count=None):
        """One-sided spectra of all outputs, shape (o, f).

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        loop : PoseLoop or None
            None with the winches at rest.
        count : int, optional
            How many of the coordinates that are not strokes, the first ones, are considered.
        """
        motion, found = self.movement.motion, []
        whole = motion.shapes.shape[1]
        forced = slice(whole if count is None else count)
        if count is not None:
            motion = motion.some(count)
            loop = loop and loop.of(motion, count)
        at_once = max(1, AT_ONCE // len(motion) ** 2)
        for begin in range(0, len(frequency), at_once):
            part = frequency[begin : begin + at_once]
            response = self.responses(part, loop, motion)[:, forced]
            forces = self.movement.gusts.spectra(part)[:, forced, forced]
            found.append(((forces @ response.conj()) * response).sum(axis=1).real)
        return np.concatenate(found).T

    @cached_property
    def closed(self):
        """`Variances` with the loop, or without it where there is none."""
        loop = self.movement.loop
        return self._variances(loop if loop is not None and loop.gain else None)

    @cached_property
    def open(self):
        """`Variances` with the winches at rest."""
        loop = self.movement.loop
        return self.closed if loop is None or not loop.gain else self._variances(None)

    def _edges(self, loop):
        """Boundaries of panels. [Hz]"""
        movement = self.movement
        wind, lowest = movement.scene.wind, movement.modes.frequency[0]
        corner = wind.speed / wind.length_scale
        slow = [corner, lowest] if loop is None else [corner, lowest, loop.gain / TURN]
        low, high = LOWEST * min(slow), HIGHEST * max(corner, lowest)
        poles = self._poles(loop)
        centre, width = np.abs(poles) / TURN, np.abs(poles.real) / TURN
        narrow = (width < NARROW * centre) & (low < centre) & (centre < high)
        centre, width = centre[narrow], np.maximum(width[narrow], 1e-9 * centre[narrow])
        return _apart(low, high, centre, width)

    def _poles(self, loop):
        poles = np.linalg.eigvals(self._at_rest) if loop is None else loop.poles
        return poles[poles.imag > 0]

    @cached_property
    def _at_rest(self):
        from cablestudy.control.pose_loop import first_order

        return first_order(self.movement.motion)[0]

    def _variances(self, loop):
        scene, groups = self.movement.scene, self.groups
        weights = [lambda f: np.ones_like(f), lambda f: (TURN * f) ** 2]
        exposure, correction = scene.exposure, scene.correction
        if exposure is not None:
            weights.append(lambda f: exposure_weight(f, exposure))
        if correction is not None:
            weights.append(lambda f: correction_weight(f, correction.bandwidth, correction.delay))
        if exposure is not None and correction is not None:
            weights.append(
                lambda f: exposure_weight(f, exposure) * correction_weight(f, correction.bandwidth, correction.delay)
            )

        def weighted(frequency):
            spectra = self.spectra(frequency, loop)
            return np.concatenate([weight(frequency) * spectra for weight in weights])

        every = np.concatenate([groups + place * (groups.max() + 1) for place in range(len(weights))])
        accuracy = scene.model.accuracy or 1e-4
        found = rms.integrate(weighted, self._edges(loop), SHARE * accuracy, every)
        # below the range the spectra are flat, or fall to zero
        first, second = found.edges[:2]
        flat = found.panels[0] * (first / (second - first))
        value = (found.value + flat).reshape(len(weights), -1)
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        value = list(np.maximum(value, 0.0))
        none = np.zeros(len(groups))
        both = value.pop() if exposure is not None and correction is not None else none
        corrected = value.pop() if correction is not None else none
        exposed = value.pop() if exposure is not None else none
        largest = np.zeros(every.max() + 1)
        np.maximum.at(largest, every, found.value)
        error = found.error / np.where(largest > 0, largest, 1.0)[every]
        return Variances(*value, exposed, corrected, both, float(error.max()))


def _apart(low, high, centre, width):
    """Boundaries between low and high: two a decade, and at and beside each resonance, none too close to another."""
    order = np.argsort(width)
    kept = list(np.geomspace(low, high, 2 + int(2 * np.log10(high / low))))
    for place in order.tolist():
        for point in (centre[place], centre[place] - BESIDE * width[place], centre[place] + BESIDE * width[place]):
            if low < point < high and np.abs(np.array(kept) - point).min() > APART * width[place]:
                kept.append(point)
    return np.sort(kept)
