"""Spectra of outputs in the gusts above the modes of a model, and grids of frequencies that resolve their peaks.

They show by how much modes that the model leaves out change variances, see `left_out_modes`.
"""

from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.control.margins_grid import distinct, near_poles
from cablestudy.motion.tolerances import MOTION


def weighted_integrals(omega, values, weights):
    """Sizes of the integrals over frequency of weighted values, shape (f, r), at frequencies [rad/s]: shape (w, r)."""
    frequency = omega / (2 * np.pi)
    weighted = [weight(frequency)[:, None] * values for weight in weights.values()]
    return np.abs(np.trapezoid(weighted, frequency, axis=1))


class UpperSpectra:
    """Spectra of r outputs in the gusts by a model, above its modes, and their responses by all modes and by the model.

    Responses are those to forces on the bodies. Each is computed when asked for, and kept: with the winches at rest all
    loops share them.

    Parameters
    ----------
    turbulence : Turbulence
        Of the model.
    rows : slice or ndarray of int
        Which of `Turbulence.all_residues` these outputs are.
    by_all_modes : callable
        s, shape (f,) -> response to forces on the d free displacements, by all modes, shape (f, r, d).
    of_each_cable : bool
        True if resonances of each cable are looked at, not only those that add most to the motion of bodies.
    change_at_most : float
        See `BodiesOnAllModes.change_at_most`. [-]

    Attributes
    ----------
    coarse : ndarray
        Frequencies, ascending, at which the response of the model shows how it falls. [rad/s]
    """

    def __init__(
        self, turbulence, rows, by_all_modes, of_each_cable=False, change_at_most=MOTION.left_out_change_at_most
    ):
        self.plant, self._turbulence, self._by_all_modes = turbulence.plant, turbulence, by_all_modes
        self._rows, self._of_each, self.change_at_most = rows, of_each_cable, change_at_most
        low, high = MOTION.left_out_from * self.plant.all_modes.highest, 2 * np.pi * turbulence.range[1]
        self.coarse = np.geomspace(low, max(high, low), MOTION.left_out_points)

    @cached_property
    def _by_model(self):
        """Response by the model to forces on the free displacements, as `by_all_modes`."""
        return self._turbulence.response_to_forces(self.plant.loads_on_bodies, self._rows)

    def squares(self, omega):
        """Squared responses to forces, by all modes and by the model, shape (f, 2, r)."""
        both = self._by_all_modes(1j * omega), self._by_model(1j * omega)
        return np.stack([(np.abs(response * self._units) ** 2).sum(axis=-1) for response in both], axis=1)

    @cached_property
    def _units(self):
        """Forces on the free displacements that each do the same work at rest, shape (d,)."""
        return 1 / np.sqrt(np.diagonal(np.linalg.inv(dense(self.plant.modes.model.reduced.stiffness))))

    @cached_property
    def first(self):
        """Frequencies to begin with: `coarse`, and close to poles of the model and resonances; and `squares` there."""
        poles = (self._turbulence.loop or self.plant.motion).eigen.poles
        poles = np.concatenate([self.plant.all_modes.resonances(self._of_each), poles[poles.imag > 0]])
        omega = distinct(np.append(self.coarse, near_poles(poles)))
        omega = omega[(omega >= self.coarse[0]) & (omega <= self.coarse[-1])]
        return _where_finite(omega, self.squares(omega))

    @cached_property
    def of_model(self):
        """W of `left_out_modes`: spectra by the model at the frequencies `coarse`, shape (f, r)."""
        residues = self._turbulence.all_residues.of_outputs(self._rows)
        response = np.swapaxes(residues.response(1j * self.coarse), -1, -2)
        return self._turbulence.in_wind.gusts.input_spectra(self.coarse / (2 * np.pi), response)

    @cached_property
    def _forcing(self):
        """W/|Y_model|^2, smoother than both, at the frequencies `coarse`, shape (f, r)."""
        omega, squares = self.first
        squares = _interpolated(self.coarse, omega, squares[:, 1])
        return np.divide(self.of_model, squares, out=np.zeros_like(squares), where=squares > 0)

    def forcing(self, omega):
        """`_forcing` interpolated at other frequencies, shape (f, r)."""
        return _interpolated(omega, self.coarse, self._forcing)

    def least_changes(self, variances, least):
        """Changes of variances, shape (w, r), by which RMS change by a relative error `least`: of the root twice it.

        An output whose motion has almost no energy counts with the share `MOTION.left_out_small` of the largest one.
        """
        stiffness = np.append(self.plant.stiffness_of_outputs, np.ones(len(self.plant.winches)))[self._rows]
        least_variances = MOTION.left_out_small * (variances * stiffness).max(axis=1, keepdims=True) / stiffness
        return 2 * least * np.maximum(variances, least_variances)


def _interpolated(omega, known, values):
    """Values, shape (k, r), known at some frequencies, linearly interpolated at others: shape (f, r)."""
    return np.stack([np.interp(omega, known, of_output) for of_output in values.T], axis=-1)


def _where_finite(omega, values):
    """Frequencies at which all values, shape (f, ...), are finite, and these values."""
    known = np.isfinite(values).reshape(len(omega), -1).all(axis=1)
    return omega[known], values[known]


def refined_grid(function, omega, values, matters):
    """Refine a grid of frequencies where a function changes fast, by halving intervals.

    An interval is halved where the logarithm of the function may change by more than `MOTION.left_out_change` across
    it, by the steepest slope there or next to it. It must also be wider than `MOTION.left_out_step` times its
    frequency, and matter.

    Parameters
    ----------
    function : callable
        Frequencies [rad/s], shape (f,) -> values, 0 or more, shape (f, ...). Where they are NaN the frequency is left
        out.
    omega : ndarray, shape (f,)
        The grid to begin with, ascending. [rad/s]
    values : ndarray, shape (f, ...)
        Of the function on this grid.
    matters : callable
        Frequencies and values on a grid -> ndarray of bool, shape (f - 1,), False for intervals not to be halved.

    Returns
    -------
    omega, values : ndarray
        The refined grid and the values there, shapes as those of the first one.
    """
    for _ in range(MOTION.left_out_rounds):
        logarithm, width = np.log(np.maximum(values, MOTION.tiny)).reshape(len(omega), -1), np.diff(omega)[:, None]
        slope = np.pad(np.abs(np.diff(logarithm, axis=0)) / width, ((1, 1), (0, 0)))
        # the slope to either side too: it shows a peak between two frequencies with equal values
        steepest = np.maximum(np.maximum(slope[:-2], slope[2:]), slope[1:-1])
        fast = (steepest * width > MOTION.left_out_change).any(axis=1)
        fast &= (np.diff(omega) > MOTION.left_out_step * omega[1:]) & matters(omega, values)
        if not fast.any():
            break
        between = (omega[:-1] + omega[1:])[fast] / 2
        order = np.argsort(np.append(omega, between), kind="stable")
        omega, values = np.append(omega, between)[order], np.concatenate([values, function(between)])[order]
        omega, values = _where_finite(omega, values)
    return omega, values
