"""Variances of a suspension in turbulent wind: displacements, rates, tensions, and what actuators do.

One quadratic form: with Y(f) the response of an output to forces on the coordinates and S(f) the spectral matrix of the
forces by all places together, its spectrum is Y S Y^H. Its integral follows from the poles (`wind.variance`), with the
loop closed or with the winches at rest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control.loop_state_space import by_forces
from cablestudy.errors import NoSolutionError
from cablestudy.study.suspension.turbulence import OWN
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.imaging import seen_weights
from cablestudy.wind.tolerances import WIND


@dataclass(frozen=True)
class Variances:
    """Of some outputs, o of them.

    Attributes
    ----------
    rows : dict
        Name of each output -> its place.
    weighted : dict
        "value", "rate" (of the derivative) and names of `seen_weights` -> variances, shape (o,).
    but_by_waves : dict
        The same names -> estimated errors, by interpolation and by the model, shape (o,).
    by_waves : callable, optional
        -> what waves add to the errors of tensions, shape (w, o): for each of these names.
    """

    rows: dict
    weighted: dict
    but_by_waves: dict
    by_waves: Callable | None = None

    @cached_property
    def error(self):
        """Estimated errors by the same names, that of tensions by waves included: dict of ndarray, shape (o,)."""
        if self.by_waves is None:
            return self.but_by_waves
        return {name: own + more for (name, own), more in zip(self.but_by_waves.items(), self.by_waves(), strict=True)}

    def error_of(self, name, outputs):
        """Sum of the estimated errors of some outputs, by their names."""
        errors = self.error if any(".tension_" in output for output in outputs) else self.but_by_waves
        return errors[name][[self.rows[output] for output in outputs]].sum()


class GustResponse:
    """The response of a `ClosedLoop` to its gusts, with the loop where it does something.

    Parameters
    ----------
    closed_loop : ClosedLoop
        With wind, and stable.
    scene : SuspensionScene
        Its scene, or one with another exposure or correction.
    before : GustResponse, optional
        Of a model with fewer modes and coarser cables: the change from it may tell more of the error than one model.
    """

    def __init__(self, closed_loop, scene, before=None):
        self.closed_loop, self.scene, self._before = closed_loop, scene, before

    @cached_property
    def names(self):
        """Of all outputs: those of the plant, then stroke or momentum and force or torque of each actuator."""
        names = list(self.closed_loop.outputs)
        for one in self.closed_loop.actuators:
            names += [f"{one.name}.{what}" for what in (("momentum", "torque") if one.wheel else ("stroke", "force"))]
        return names

    @property
    def loop(self):
        """The `Loop` where it does something, else None."""
        return self._turbulence.loop

    @property
    def _turbulence(self):
        return self.closed_loop.turbulence

    # ------------------------------------------------------------------------------------------------ frequencies

    def spectra(self, frequency, space=None):
        """One-sided spectra of outputs.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        space : ndarray, shape (o, r), optional
            Combinations of the outputs.

        Returns
        -------
        ndarray, shape (o, f) or (r, f)
        """
        residues, gusts = self._turbulence.residues, self.closed_loop.gusts
        if space is not None:
            residues = residues.combined(space)
        at_once, found = max(1, STUDY.response_entries // len(self.closed_loop.motion) ** 2), []
        for part in np.split(frequency, range(at_once, len(frequency), at_once)):
            found.append(gusts.input_spectra(part, np.swapaxes(residues.response(2j * np.pi * part), -1, -2)).T)
        return np.concatenate(found, axis=-1)

    def resonances(self, names):
        """Poles of the upper half plane that are seen in some outputs, by their names. [rad/s]"""
        (found, _), rows = self._turbulence.residues.split(np.inf), [self.names.index(name) for name in names]
        height = np.abs(found.outputs[rows]) * np.linalg.norm(found.inputs, axis=1) / np.abs(found.poles.real)
        seen = (height > STUDY.seen_resonance * height.max(axis=1, keepdims=True)).any(axis=0)
        return found.poles[seen & (found.poles.imag > 0)]

    # -------------------------------------------------------------------------------------------------- integrals

    @property
    def integration_error(self):
        """Estimated relative error of a variance by quadrature, and by interpolation of the gusts. [-]"""
        return WIND.quadrature + self.closed_loop.gusts.error

    @cached_property
    def _undamped(self):
        """`Turbulence.undamped` of the outputs."""
        return self._turbulence.undamped(self.stiffness)

    def check_damped(self, names):
        """Refuse a resonance of some outputs that the wind excites and nothing bounds: NoSolutionError."""
        self._refuse(self._undamped[[self.names.index(name) for name in names]])

    def _refuse(self, undamped):
        """Refuse a pole that nothing damps among some, 0 where there is none."""
        if not undamped.any():
            return
        pole = undamped[np.argmax(undamped != 0)]
        moved = self.closed_loop.mode_name(int(np.argmin(np.abs(self.closed_loop.motion.unit - np.abs(pole)))))
        raise NoSolutionError(
            f"undamped: {moved} has a damping ratio below {self._turbulence.least:g}, so that its RMS in the wind "
            f"is not finite (cable.damping)"
        )

    def _variances(self, weights=None):
        """`Turbulence.variances`, or those with some weights, and their errors by modes as far as they are known."""
        own = self._turbulence
        whole, added, late = own.seen(weights) if weights else own.variances
        if self._before is None:
            return whole, added, late
        earlier = self._before._turbulence
        change = np.abs(whole - (earlier.seen(weights) if weights else earlier.variances)[0])
        return whole, np.minimum(added, STUDY.change_safety * change), late

    @cached_property
    def moving_error(self):
        """Largest relative error by the modes left out of the variances of displacement and velocity of bodies. [-]

        Of mid-spans by displacements alone.
        """
        places = [row for row, name in enumerate(self.names) if name.endswith((".x", ".y", ".z"))]
        groups, found = np.array(_groups(self.names))[places], [0.0]
        whole, added, _ = self._variances()
        for group in set(groups.tolist()):
            own = np.array(places)[groups == group]
            shown = 1 if ".midspan." in self.names[own[0]] else len(OWN)  # no column has their velocities
            part, total = (kind[:shown, own].sum(axis=-1) for kind in (added, whole))
            found += (part[total > 0] / total[total > 0]).tolist()
        return max(found)

    @cached_property
    def variances(self):
        """`Variances` of all outputs and their rates, without what nothing damps: see `check_damped`."""
        return self._described(OWN, self._variances())

    @cached_property
    def seen(self):
        """`Variances` of what a telescope sees of all outputs, see `seen_weights`."""
        weights = seen_weights(self.scene.exposure, self.scene.correction)
        return self._described(weights, self._variances(weights))

    def _described(self, weights, found):
        """`Variances` from those that a `Turbulence` has found, for weights as of `Turbulence.seen`."""
        value, added, late = found
        if not np.isfinite(value).all():
            raise NoSolutionError("a variance of the motion in the wind is not a number")
        energy = value * self.stiffness
        largest = np.maximum(energy.max(axis=-1, keepdims=True), self._energy_by_cables(weights))
        value = np.where(energy > STUDY.energy_rounding * largest, value, 0.0)
        tension = np.array([".tension_" in name for name in self.names])
        added = np.where(
            tension, STUDY.tension_safety * _of_tensions(value, added, tension) + self._by_ends * value, added
        )
        error = added + self.integration_error * value + late
        values, errors = (dict(zip(weights, parts, strict=True)) for parts in (value, error))
        rows = {name: row for row, name in enumerate(self.names)}
        if weights is not OWN:  # a telescope sees no tension
            return Variances(rows, values, errors)
        return Variances(rows, values, errors, lambda: self.closed_loop.plant.change_by_waves)

    @property
    def _by_ends(self):
        """Relative error of the variance of a tension since waves are looked at between ends at rest. [-]"""
        return STUDY.moving_ends if self.closed_loop.equilibrium.suspension.free.any() else 0.0

    def _energy_by_cables(self, weights):
        """That of displacements if all force of the gusts on cables moved them, shape (w, o); 0 of other outputs."""
        places = [name.endswith((".x", ".y", ".z")) for name in self.names]
        slow = float(self.closed_loop.modes.solution.omega[0]) ** 2
        factors = np.array([slow if name == "rate" else 1.0 for name in weights])
        return factors[:, None] * np.where(places, self.closed_loop.gusts.force_on_cables**2 / self.stiffness, 0.0)

    def shares_below(self, name, limits):
        """Share of the variance of an output below some frequencies [Hz]: list. [-]"""
        found = self.variances
        row = found.rows[name]
        whole = float(found.weighted["value"][row])
        return [float(part) / whole if whole else 0.0 for part in self._turbulence.below(limits)[:, row]]

    @cached_property
    def winch_speeds(self):
        """Variances of speed and acceleration of each winch, and their estimated errors: two of shape (2, i).

        Raises
        ------
        NoSolutionError
            A resonance that nothing damps moves a winch.
        """
        whole, added, undamped = self._turbulence.winch_speeds
        self._refuse(undamped)
        return whole, added + (self.integration_error + STUDY.winch_speeds) * whole

    @cached_property
    def stiffness(self):
        """Energy per square of each output, about, by which different outputs are compared, shape (o,)."""
        motion = self.closed_loop.motion
        count = len(motion)
        rows = np.abs(by_forces(motion, np.zeros((count, 0)), None, self.closed_loop.actuators)[1][:, : 2 * count]) ** 2
        places = rows[:, :count] * motion.unit**2 / np.diagonal(motion.stiffness.real)
        compliance = (places + rows[:, count:] / np.diagonal(motion.mass)).sum(axis=1)
        return 1 / np.maximum(compliance, np.finfo(float).tiny)


def _of_tensions(value, added, tension):
    """What modes left out may add to the variances of tensions, shape (w, o).

    What the highest modes add is a chance of single modes: so the largest of all tensions counts, relative or absolute.
    """
    added = np.where(tension, added, 0.0)
    relative = np.where(value > 0, added / np.where(value > 0, value, 1.0), 0.0)
    return np.minimum(added.max(axis=-1, keepdims=True), relative.max(axis=-1, keepdims=True) * value)


def _groups(names):
    """Number of the group of each output: displacements of one body or marker, its rotations, tensions of a cable."""
    found, groups = {}, []
    for name in names:
        owner, _, quantity = name.rpartition(".")
        kind = "place" if quantity in ("x", "y", "z") else "turn" if quantity in ("rx", "ry", "rz") else quantity
        kind = "tension" if kind.startswith("tension") else kind
        groups.append(found.setdefault((owner, kind), len(found)))
    return groups
