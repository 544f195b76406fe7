"""Errors of the limits and margins of `DrivenCables`, by what its loop gain leaves open."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.control.gain_limits import gain_of_one, limit_near
from cablestudy.control.margins import Margins
from cablestudy.control.nearby_margins import nearby_margins
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.cable_coordinates import residual_vectors
from cablestudy.system.tolerances import SYSTEM


class LoopGainErrors:
    """Errors of the largest stable gain and of margins, from what the loop gain of `DrivenCables` leaves open.

    They are found by comparison with other loop gains: of cables changed by the errors of their models, or with other
    vectors in place of the highest modes.

    Parameters
    ----------
    driven : DrivenCables
    """

    def __init__(self, driven):
        self._driven = driven

    @cached_property
    def by_models(self):
        """Loop gains changed by the possible errors of the models of the cables: list of one to three `LoopGain`.

        1. The frequencies of all modes are lower by the estimated errors of the mesh.
        2. If cables have modal damping, the upper half of their modes has none. The damping by these modes grows with
           their number, and is uncertain.
        3. If vectors represent the highest modes in the loop gain, they represent more modes.
        """
        driven, loop_gain, elements = self._driven, self._driven.loop_gain, self._driven.loop_gain.elements
        mesh_errors = [np.zeros(len(element.omega)) for element in elements]
        for group in driven.models.groups:
            for cable, errors in zip(group.cable_indices.tolist(), self._mesh_errors(group), strict=True):
                mesh_errors[cable] = errors
        perturbed = [[_lowered(element, error) for element, error in zip(elements, mesh_errors, strict=True)]]
        if any(element.strain is None and element.damping_ratio.any() for element in elements):
            perturbed.append([_half_damped(element) if element.strain is None else element for element in elements])
        loop_gains = [replace(loop_gain, elements=elements, near=loop_gain) for elements in perturbed]
        if self._vectors_used:
            fewer = driven.models.with_modes(driven.modes_in_loop(driven.models, MOTION.coarser_share))
            loop_gains.append(replace(loop_gain, elements=driven.elements_of(fewer)))
        return loop_gains

    def _mesh_errors(self, group):
        """Estimated relative errors due to the mesh: of the frequencies W of n modes of each cable of a `MeshGroup`.

        W^2 is twice the strain energy of a mode of modal mass 1. With the error E of twice the strain energy by the
        mesh, W has the relative error E/(2 W^2), at most 1/2.

        Far above the modes that decide on the loop, only the joint response of all modes to moving ends matters. There
        errors of single modes cancel. Six combinations of these modes (`residual_vectors`) have the same response. So
        the error of such a mode is at most the mean of their errors, weighted by its squared amplitudes in them.
        """
        elements, multiple = self._driven.loop_gain.elements, MOTION.single_mode_errors
        far, vectors, amplitudes, errors = [], [], [], []
        for cable in group.cable_indices.tolist():
            element, shapes = elements[cable], self._driven.kept[cable].shapes
            far.append(~self._driven.modes_below(cable, element, multiple, multiple))
            own = residual_vectors(element.omega[None], element.coupling[None], far[-1][None])[0]
            vectors.append(own[:, own.any(axis=0)])
            amplitudes.append(np.concatenate([shapes, shapes @ vectors[-1]], axis=1))
        width = max(own.shape[1] for own in amplitudes)
        padded = np.stack([np.pad(own, ((0, 0), (0, width - own.shape[1]))) for own in amplitudes])
        energies = group.ends.highest_energy(padded, np.zeros((len(padded), 6, width)))
        for cable, is_far, own, energy in zip(group.cable_indices.tolist(), far, vectors, energies, strict=True):
            square = elements[cable].omega ** 2
            n, squares = len(square), np.concatenate([square, square @ own**2])  # W^2 of modes, then of vectors
            # W^2 is twice the strain energy of a mode; `energy` is its error due to the mesh, and that of W is half of
            # it
            error = np.minimum(energy[: len(squares)] / squares / 2, 0.5)
            share = own**2 + np.finfo(float).tiny  # of each mode in each vector
            by_vectors = share @ error[n:] / share.sum(axis=1)
            errors.append(np.where(is_far, np.minimum(error[:n], by_vectors), error[:n]))
        return errors

    @property
    def simplification(self):
        """Relative error of margins, at least, by vectors for other modes or poles found in windows; 0 without. [-]"""
        if self._driven.ill_conditioned:  # the loop gain is that of the coupled modes
            return 0.0
        return MOTION.by_other_modes if self._vectors_used or self._driven.loop_gain.windowed else 0.0

    def of_pole_sums(self, omega):
        """Relative error of the loop gain from sums over poles of cables at some frequencies, shape (f,) [rad/s]. [-]

        It is compared with the loop gain of solved equations: where poles are found in windows at all frequencies, else
        at narrow resonances alone, where a small error of a pole due to rounding is a large one of the loop gain.
        """
        if not self._driven.coupling_damping:
            return 0.0
        s, poles = 1j * np.unique(omega), self._driven.poles
        narrow = np.abs(s[:, None] - poles).min(axis=1, initial=np.inf) < MOTION.narrow_resonance * np.abs(s)
        s = s[narrow | self._driven.loop_gain.windowed][-SYSTEM.solved_frequencies :]
        if not len(s):
            return 0.0
        summed, solved = self._driven.loop_gain(s), self._driven.loop_gain.by_equations(s)
        return float((np.abs(summed - solved).max(axis=(1, 2)) / np.abs(solved).max(axis=(1, 2))).max())

    @property
    def _vectors_used(self):
        """True if vectors represent other modes."""
        return any(kept.residuals for kept in self._driven.kept)

    @cached_property
    def of_limit(self):
        """Relative errors of the factor and the frequency of `limit`, NaN where not known: list of two. [-]"""
        limit, resolving, unknown = self._driven.limit, self._driven.resolving, [np.nan, np.nan]
        if limit is None or not limit.omega <= resolving.resolved_to:
            return unknown
        if resolving.fixed_elements or resolving.ill_conditioned:
            return unknown
        # at the few frequencies of a local search poles cost more than they spare
        limits = [limit_near(loop_gain.by_equations, limit) for loop_gain in resolving.errors.by_models]
        if None in limits:
            return unknown
        changes = np.array([(other.factor / limit.factor - 1, other.omega / limit.omega - 1) for other in limits])
        errors = MOTION.largest_gain_safety * np.abs(changes).sum(axis=0)
        return (errors + resolving.errors.simplification).tolist()

    def of_single_limit(self, limit, gain, coordinate):
        """Relative error of the factor by which the gain of one coordinate may grow while the others keep theirs.

        The limit is located again in each perturbed loop gain (`by_models`); the relative changes are added.

        Parameters
        ----------
        limit : Limit
            Of this coordinate, as in `StableGains.single_limits`: its `factor` multiplies the gain.
        gain : float
            Gain of all coordinates. [rad/s]
        coordinate : int
            Index of the measured coordinate.

        Returns
        -------
        float
            NaN where the error is not known: with stated elements (`model.elements`), where rounding spoils the
            response of a cable, beyond the frequencies that the meshes resolve, or where a perturbed loop gain has no
            such limit. [-]
        """
        driven = self._driven
        if driven.fixed_elements or driven.ill_conditioned or not 0 < limit.omega <= driven.resolved_to:
            return np.nan
        of_coordinate = [gain_of_one(loop_gain.by_equations, gain, coordinate) for loop_gain in self.by_models]
        limits = [limit_near(loop_gain, limit) for loop_gain in of_coordinate]
        if None in limits:
            return np.nan
        change = sum(abs(other.factor / limit.factor - 1) for other in limits)
        return max(MOTION.largest_gain_safety * change + self.simplification, MOTION.rounding)

    def perturbed_margins(self, margins):
        """`Margins` of the perturbed loop gains, near the frequencies that decide some `Margins` of the loop gain."""
        if self._driven.fixed_elements or self._driven.ill_conditioned:
            return []
        return [nearby_margins(margins, one) or _margins_near(margins, one) for one in self.by_models]


def _margins_near(margins, loop_gain):
    """`Margins` with the same gain of a similar loop gain, near the frequencies that decide those of the known one."""
    omega, near = margins.omega, margins.deciding
    chosen = (np.abs(omega[:, None] - near) < MOTION.margin_window * near).any(axis=1)
    chosen[0] = True
    return Margins(loop_gain, omega[chosen], margins.gain)


def _lowered(element, error):
    """A `Superelement` whose modes have frequencies lower by relative errors, shape (n,)."""
    participation = element.participation * (1 - error)[:, None] ** 2
    return replace(element, omega=element.omega * (1 - error), participation=participation)


def _half_damped(element):
    """A `Superelement` without modal damping in the upper half of its modes."""
    lower = np.arange(len(element.omega)) < len(element.omega) / 2
    return replace(element, damping_ratio=np.where(lower, element.damping_ratio, 0.0))
