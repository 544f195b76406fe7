"""Variances of a suspension in turbulent wind: displacements, rates, tensions, strokes and forces of actuators.

The spectrum of an output is Y S Y^H, Y(f) being its response to forces on the coordinates and S(f) the spectral matrix
of the forces by the gusts at all places together. The variance, the integral of the spectrum, follows from the poles of
Y (`wind.variance`), with the loop closed or with the winches at rest.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.motion.left_out_modes import BodiesOnAllModes
from cablestudy.motion.tolerances import MOTION
from cablestudy.motion.turbulence import VALUE_AND_RATE, Turbulence
from cablestudy.system.together import computed_together
from cablestudy.wind.imaging import image_weights
from cablestudy.wind.tolerances import WIND


@dataclass(frozen=True)
class Variances:
    """Variances of o outputs, under one or more weights over frequency, and their errors.

    Attributes
    ----------
    rows : dict
        Name of each output -> its index.
    weighted : dict
        "value", "rate" (of the derivative) and names of `image_weights` -> variances, shape (o,).
    errors_by_model : dict
        Estimated errors by interpolation and by the model, by the same names, shape (o,).
    left_out : callable
        Function of one of these names -> errors by modes that all models leave out, shape (o,).
    rates_beyond : callable, optional
        Function without arguments -> errors of "rate" by what is above the integrals, shape (o,).
    errors_by_waves : callable, optional
        Function without arguments -> errors of tensions by waves, shape (w, o), for each of these names.
    """

    rows: dict
    weighted: dict
    errors_by_model: dict
    left_out: Callable
    rates_beyond: Callable | None = None
    errors_by_waves: Callable | None = None

    def errors(self, name, tensions=True):
        """Estimated errors of the variances `name` of `weighted`, shape (o,); by waves too if for `tensions`."""
        errors = self.errors_by_model[name] + self.left_out(name)
        if name == "rate":
            errors = errors + self._rates_beyond
        return errors + self._errors_by_waves[name] if tensions and self.errors_by_waves else errors

    @cached_property
    def _rates_beyond(self):
        """Value of `rates_beyond`."""
        return self.rates_beyond()

    @cached_property
    def _errors_by_waves(self):
        """Value of `errors_by_waves`: name of variances -> errors, shape (o,)."""
        return dict(zip(self.weighted, self.errors_by_waves(), strict=True))

    def sum_of(self, name, outputs):
        """Sum of the variances `name` of `weighted` of some named outputs."""
        return self.weighted[name][[self.rows[output] for output in outputs]].sum()

    def error_of(self, name, outputs):
        """Sum of the estimated errors of some named outputs, of the variances `name` of `weighted`."""
        errors = self.errors(name, tensions=any(".tension_" in output for output in outputs))
        return errors[[self.rows[output] for output in outputs]].sum()


class GustResponse:
    """The response of a `LoopInWind` to its gusts; the winches are at rest where the loop does nothing.

    Parameters
    ----------
    in_wind : LoopInWind
        Stable.
    scene : SuspensionScene
        Scene of the loop, or one that differs in the exposure time or the correcting mirror of a telescope.
    before : GustResponse, optional
        Response of a model with fewer modes and coarser cables: the change from it may tell more of the error than one
        model.
    least : float
        Least relative error that is stated for an RMS. [-]

    Attributes
    ----------
    together : list of GustResponse
        Of many rows, whose errors by modes left out are computed in few calls.
    """

    def __init__(self, in_wind, scene, before=None, least=0.0):
        self.in_wind, self.closed_loop = in_wind, in_wind.closed_loop
        self.scene, self._before, self._least = scene, before, least
        self.together = [self]

    @cached_property
    def names(self):
        """Names of all outputs: of the plant, then stroke or momentum and force or torque of each actuator."""
        names = list(self.closed_loop.outputs)
        for actuator in self.closed_loop.actuators:
            quantities = ("momentum", "torque") if actuator.wheel else ("stroke", "force")
            names += [f"{actuator.name}.{quantity}" for quantity in quantities]
        return names

    @property
    def loop(self):
        """The `Loop` where it does something, else None."""
        return self.turbulence.loop

    @property
    def turbulence(self):
        """`Turbulence` of the loop."""
        return self.in_wind.turbulence

    # ------------------------------------------------------------------------------------------------ frequencies

    def spectra(self, frequency, combinations=None):
        """One-sided spectra of the outputs in the gusts, or of weighted sums of outputs.

        They are the diagonal of Y S Y^H, with the response Y of the outputs, or sums, to the inputs of the gusts, and
        the spectral matrix S of these inputs.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            Frequencies. [Hz]
        combinations : ndarray, shape (o, r), optional
            Each column has the weights of the o outputs in one of r sums, whose spectra are returned instead.

        Returns
        -------
        ndarray, shape (o, f) or (r, f)
            Squares of the units of the outputs, per Hz.
        """
        residues, gusts = self.turbulence.residues, self.in_wind.gusts
        if combinations is not None:
            residues = residues.combined(combinations)
        # frequencies in blocks, whose responses bound the memory
        block_size, spectra = max(1, MOTION.response_entries // len(self.closed_loop.motion) ** 2), []
        for block in np.split(frequency, range(block_size, len(frequency), block_size)):
            response = residues.response(2j * np.pi * block)
            spectra.append(gusts.input_spectra(block, np.swapaxes(response, -1, -2)).T)
        return np.concatenate(spectra, axis=-1)

    def resonances(self, names):
        """Poles of the upper half plane whose resonances are visible in the spectra of some named outputs. [rad/s]"""
        (residues, _), rows = self.turbulence.residues.split(np.inf), [self.names.index(name) for name in names]
        size = np.abs(residues.outputs[rows]) * np.linalg.norm(residues.inputs, axis=1)
        height = size / np.abs(residues.poles.real)
        visible = (height > MOTION.seen_resonance * height.max(axis=1, keepdims=True)).any(axis=0)
        return residues.poles[visible & (residues.poles.imag > 0)]

    # -------------------------------------------------------------------------------------------------- integrals

    @property
    def integration_error(self):
        """Estimated relative error of a variance by quadrature, and by interpolation of the gusts. [-]"""
        return WIND.quadrature + self.in_wind.gusts.error

    @cached_property
    def _undamped(self):
        """`Turbulence.undamped` of the outputs."""
        return self.turbulence.undamped(self.stiffness)

    def check_damped(self, names):
        """Refuse a resonance of some outputs that the wind excites and nothing bounds: NoSolutionError."""
        self._refuse_undamped(self._undamped[[self.names.index(name) for name in names]])

    def _refuse_undamped(self, undamped):
        """Refuse poles that nothing damps, an array with 0 for outputs without one: NoSolutionError that names one."""
        if not undamped.any():
            return
        pole = undamped[np.argmax(undamped != 0)]
        nearest = int(np.argmin(np.abs(self.closed_loop.motion.unit - np.abs(pole))))
        raise NoSolutionError(
            f"undamped: {self.closed_loop.mode_name(nearest)} has a damping ratio below {self.turbulence.least:g}, "
            f"so that its RMS in the wind is not finite (cable.damping)"
        )

    def _variances(self, weights=None):
        """Compute variances with some weights over frequency, or those of the outputs and their rates.

        Returns
        -------
        ModelVariances
            The error due to modes is the smaller one of the share of the highest modes and of the change from the model
            `before`; without that due to modes that all of these leave out, see `left_out`.
        """
        variances = self._variances_of(self.turbulence, weights)
        if self._before is None:
            return variances
        change = np.abs(variances.value - self._variances_of(self._before.turbulence, weights).value)
        return replace(variances, by_modes=np.minimum(variances.by_modes, MOTION.change_safety * change))

    @cached_property
    def motion_variances(self):
        """`_variances` of displacements and rates."""
        return self._variances()

    @computed_together
    def left_out_at_most(responses):
        """Upper bound of `left_out`, shape (2, o), zero of values or rates where no change of these matters."""
        Turbulence.all_residues.compute([one._left_out.turbulence for one in responses if np.isfinite(one._least)])
        for one in responses:
            yield one, one._left_out.at_most(VALUE_AND_RATE, one.motion_variances.value, one._least)

    @computed_together
    def left_out(responses):
        """Errors of `motion_variances` by modes that all models leave out, shape (2, o), see `LeftOutModes`."""
        GustResponse.left_out_at_most.compute(responses)
        needed = [one for one in responses if one._left_out.needs_bodies_at_rest and one.left_out_at_most.any()]
        BodiesOnAllModes.loop_gain.compute([one.closed_loop.plant.all_modes for one in needed])
        return ((one, one._left_out_by(VALUE_AND_RATE, one.motion_variances)) for one in responses)

    @cached_property
    def _left_out_of_images(self):
        """Errors of `_image_variances`, as `left_out`."""
        return self._left_out_by(self._image_weights, self._image_variances)

    def _left_out_by(self, weights, variances):
        """Errors of some variances with weights by modes that all models leave out, shape (w, o)."""
        return self._left_out.of_movements(weights, variances.value, variances.by_modes, self._least)

    def _left_out_of_motion(self, name):
        """`left_out` of "value" or "rate", shape (o,), which is not computed where the bound says that none matters."""
        kind = list(VALUE_AND_RATE).index(name)
        return self.left_out[kind] if self.left_out_at_most[kind].any() else self.left_out_at_most[kind]

    @property
    def _left_out(self):
        """`LeftOutModes` of the loop."""
        return self.in_wind.left_out_modes

    @staticmethod
    def _variances_of(turbulence, weights):
        """`ModelVariances` of some `Turbulence` with weights, or of displacements and rates if these are None."""
        return turbulence.weighted_variances(weights) if weights else turbulence.variances

    @cached_property
    def truncation_error(self):
        """Largest relative error of a variance by the modes left out: by it the number of modes is chosen. [-]

        Each variance is that of one place, summed over x, y and z, and so is its error. For bodies and markers it is
        that of displacements, of velocities, and of displacements weighted as a telescope sees them (`image_weights`);
        for mid-spans of cables that of displacements only. Free points count if the plant has static responses to loads
        on them (`Plant.points`), or if no body is free. Rotations do not count: they state the error that they reach.
        """
        of_images = self._left_out_of_images if self._image_weights else self.left_out[:0]
        return self._truncation(np.concatenate([self.left_out, of_images]))

    @cached_property
    def truncation_at_most(self):
        """Upper bound of `truncation_error` that takes little time. [-]"""
        of_images = self.left_out_at_most[:0]
        if self._image_weights:
            of_images = self._left_out.at_most(self._image_weights, self._image_variances.value, self._least)
        return self._truncation(np.concatenate([self.left_out_at_most, of_images]))

    def _truncation(self, left_out):
        """`truncation_error` by errors due to modes that all models leave out, (w, o): of values, rates, images."""
        suspension, plant = self.closed_loop.equilibrium.suspension, self.closed_loop.plant
        points_count = plant.points or not suspension.free[: suspension.bodies].any()
        passed_over = () if points_count else self.scene.points
        displacements = [
            row
            for row, name in enumerate(self.names)
            if name.endswith((".x", ".y", ".z")) and name.partition(".")[0] not in passed_over
        ]
        groups, errors = np.array(_groups(self.names))[displacements], [0.0]
        value, by_modes = self.motion_variances.value, self.motion_variances.by_modes
        if self._image_weights:
            value = np.concatenate([value, self._image_variances.value])
            by_modes = np.concatenate([by_modes, self._image_variances.by_modes])
        by_modes = by_modes + left_out
        for group in set(groups.tolist()):
            rows = np.array(displacements)[groups == group]
            kinds = 1 if ".midspan." in self.names[rows[0]] else len(value)  # no column has velocities of mid-spans
            error, total = by_modes[:kinds, rows].sum(axis=-1), value[:kinds, rows].sum(axis=-1)
            errors += (error[total > 0] / total[total > 0]).tolist()
        return max(errors)

    @cached_property
    def variances(self):
        """`Variances` of all outputs and their rates, without what nothing damps: see `check_damped`."""
        return self._with_errors(VALUE_AND_RATE, self.motion_variances)

    @cached_property
    def in_images(self):
        """`Variances` of what a telescope sees of all outputs, see `image_weights`."""
        return self._with_errors(self._image_weights, self._image_variances)

    @property
    def _image_weights(self):
        """`image_weights` of the scene."""
        return image_weights(self.scene.exposure, self.scene.correction)

    @cached_property
    def _image_variances(self):
        """`_variances` of what a telescope sees."""
        return self._variances(self._image_weights)

    def _with_errors(self, weights, variances):
        """`Variances`, of some `ModelVariances`; 0 where no more than rounding is left."""
        value, by_modes = variances.value, variances.by_modes
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        energy = value * self.stiffness
        largest = np.maximum(energy.max(axis=-1, keepdims=True), self._energy_by_cables(weights))
        value = np.where(energy > MOTION.energy_rounding * largest, value, 0.0)
        is_tension = np.array([".tension_" in name for name in self.names])
        of_tensions = self._tension_safety * _tension_errors_by_modes(value, by_modes, is_tension)
        error = np.where(is_tension, of_tensions, by_modes) + variances.by_delay
        error = error + (self.integration_error + self._error_of_decay) * value
        values, errors = dict(zip(weights, value, strict=True)), dict(zip(weights, error, strict=True))
        rows = {name: row for row, name in enumerate(self.names)}
        if weights is not VALUE_AND_RATE:  # a telescope sees no tension
            left_out = dict(zip(weights, self._left_out_of_images, strict=True))
            return Variances(rows, values, errors, left_out.get)
        by_waves = partial(self._tension_errors_by_waves, value, by_modes)
        return Variances(rows, values, errors, self._left_out_of_motion, self._rates_beyond, by_waves)

    def _rates_beyond(self):
        """Variances of rates above the highest frequency of the integrals at most, shape (o,).

        There the spectrum of a rate falls with f^(-5/3) at least, as that of the wind. It does so if the rate follows
        the acceleration of a body, as that of a force by the body's velocity does.
        """
        highest = self.turbulence.range[1]
        return 1.5 * highest * (2 * np.pi * highest) ** 2 * self.spectra(np.array([highest]))[:, 0]

    @property
    def _tension_safety(self):
        """Factor on the error of tensions due to modes, one of `MOTION.tension_safety`.

        Behind a law that does more than integrate, the model has static responses to moving bodies, and the one with
        fewer modes, by which the error is estimated, does not have them: the change is far larger than the error.
        """
        plant, with_cables, without_cables, with_responses = self.closed_loop.plant, *MOTION.tension_safety
        if not self.in_wind.gusts.strips:
            return without_cables
        more_than_integrates = self.loop is not None and not self.loop.law.integrates_only
        return with_responses if plant.responses and more_than_integrates and not plant.driven else with_cables

    def _tension_errors_by_waves(self, value, by_modes):
        """Errors of the variances of tensions by waves, shape (w, o): of moving ends, and of gusts on the cables."""
        of_ends, in_wind = self._left_out.of_tensions(value, by_modes, self._least), self.in_wind.plant_in_wind
        return of_ends + in_wind.change_by_waves if in_wind.gusts.strips or self._left_out.unknown else of_ends

    def _energy_by_cables(self, weights):
        """Energies of displacements if all force of gusts on cables acted on them, shape (w, o); 0 of other outputs.

        Far below them energies count as rounding: `force^2/stiffness`, of rates times the lowest frequency squared.
        """
        displacements = [name.endswith((".x", ".y", ".z")) for name in self.names]
        slow = float(self.closed_loop.modes.omega[0]) ** 2
        factors = np.array([slow if name == "rate" else 1.0 for name in weights])
        energy = self.in_wind.gusts.force_on_cables**2 / self.stiffness
        return factors[:, None] * np.where(displacements, energy, 0.0)

    def shares_below(self, name, limits):
        """Share of the variance of an output below some frequencies [Hz]: list. [-]"""
        row = self.variances.rows[name]
        total = float(self.variances.weighted["value"][row])
        return [float(below) / total if total else 0.0 for below in self.turbulence.below(limits)[:, row]]

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, and their estimated errors: two of shape (2, i).

        Raises
        ------
        NoSolutionError
            A resonance that nothing damps moves a winch.
        """
        value, by_modes, by_delay, undamped = self.turbulence.winch_speeds
        self._refuse_undamped(undamped)
        # gusts on cables excite the modes between those of the model, and these move winches
        if self.in_wind.gusts.strips and self.closed_loop.plant.driven:
            by_modes = MOTION.one_model_safety * by_modes
        by_modes = by_modes + self._left_out.of_winch_speeds(value, by_modes, self._least)
        least = max(self.integration_error + MOTION.winch_speeds, 2 * self._least if np.isfinite(self._least) else 0.0)
        return value, by_modes + by_delay + (least + self._error_of_decay) * value

    @property
    def _error_of_decay(self):
        """`LoopStability.error_of_decay`; 0 with the winches at rest. [-]"""
        return 0.0 if self.loop is None else self.closed_loop.stability.error_of_decay

    @property
    def stiffness(self):
        """Estimate of the energy per square of each output, by which different outputs are compared, shape (o,)."""
        return self.closed_loop.plant.stiffness_of_outputs


def _tension_errors_by_modes(value, by_modes, is_tension):
    """Estimated error, by the modes left out, of the variances of tensions, shape (w, o).

    The share of the highest modes in one tension depends on single modes: so the largest share of all tensions counts,
    relative or absolute.
    """
    error = np.where(is_tension, by_modes, 0.0)
    relative = np.where(value > 0, error / np.where(value > 0, value, 1.0), 0.0)
    return np.minimum(error.max(axis=-1, keepdims=True), relative.max(axis=-1, keepdims=True) * value)


def _groups(names):
    """Number of the group of each output, list: displacements of a body or marker, rotations, tensions of a cable."""
    numbers, groups = {}, []
    for name in names:
        owner, _, quantity = name.rpartition(".")
        kind = "place" if quantity in ("x", "y", "z") else "turn" if quantity in ("rx", "ry", "rz") else quantity
        kind = "tension" if kind.startswith("tension") else kind
        groups.append(numbers.setdefault((owner, kind), len(numbers)))
    return groups
