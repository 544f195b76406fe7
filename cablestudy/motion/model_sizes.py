"""Numbers of modes of the models of a suspension in motion that are tried, and how accurate their RMS are."""

from functools import cached_property

import numpy as np

from cablestudy.cable.damping import any_grows_with_modes
from cablestudy.control.law import law_from
from cablestudy.motion.tolerances import MOTION

# why a number has no limit as modes are added
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"


class ModelSizes:
    """Numbers of modes that models of one case have: those of all its winds, loops and states share them.

    Parameters
    ----------
    scene : SuspensionScene
    suspension : SuspendedSystem
        Of this case.
    fixed : bool
        True of stated elements, for which `accuracy` is that of its modes.
    in_planes : bool
        True if the modes of the cables are those of some planes.
    wind_on_cables : bool
        True if gusts act on the cables.
    fewest : int
        Least number of modes.

    Attributes
    ----------
    accuracy : float
        Relative accuracy of what moves. [-]
    """

    def __init__(self, scene, suspension, fixed, in_planes, wind_on_cables, fewest=0):
        self._scene, self._moves, self._fixed, self._in_planes = scene, suspension.free.any(), fixed, in_planes
        self._wind_on_cables, self._fewest = wind_on_cables, fewest
        self.accuracy = scene.model.accuracy or MOTION.fixed_model_accuracy

    @cached_property
    def tried(self):
        """Numbers of modes of models, ascending, from the fewest that may do: tuple.

        Small models come first where cables are few and few modes are excited: by wind on free bodies alone, and a loop
        that only integrates. Modal damping, unless of stated elements, depends on the number of modes: it
        is then one of the usual numbers.
        """
        usual, all_excited = self.usual, self._wind_on_cables or self.fast_loop
        small = map(self._for_cables, (MOTION.few_modes,) if self._fixed else (MOTION.fewest_modes, MOTION.few_modes))
        small = [count for count in small if count < usual[0]]
        count_matters = self.damping_grows and not self._fixed
        if not small or all_excited or count_matters or not self._moves:
            return tuple(count for count in usual if count >= self._fewest) or (self._fewest,)
        return *small, *usual

    @cached_property
    def fast_loop(self):
        """True if the control law has a proportional or derivative part, which moves winches at high frequencies."""
        control = self._scene.control
        return control is not None and not law_from(control)[0].integrates_only

    @cached_property
    def usual(self):
        """Numbers of modes for many cables, or for cables all of whose modes gusts excite: ascending, tuple."""
        if self._fixed:
            return (MOTION.element_modes,)
        if self._in_planes:
            return MOTION.plane_model_modes
        return MOTION.model_modes if self.damping_grows else (*MOTION.model_modes, MOTION.more_modes[0])

    def computed(self, count):
        """Number of modes that are computed for a model of `count`: enough for meshes that serve the loop too."""
        return max(count, min(self._for_cables(MOTION.few_modes), self.usual[0]))

    def _for_cables(self, numbers):
        """Number of modes of the whole: `numbers` are a constant and a number for each cable."""
        return numbers[0] + numbers[1] * len(self._scene.cables)

    @property
    def compared(self):
        """True if models are compared with each other: those to an accuracy, of few cables and few excited modes."""
        return not self._fixed and self.tried[0] < self.usual[0]

    @cached_property
    def damping_grows(self):
        """True if damping is modal, so that it grows with the number of modes, and the ends of some cable move."""
        ends_move = self._moves or bool(self._scene.winches)
        return ends_move and any_grows_with_modes(self._scene.cables.values())

    @property
    def error_known(self):
        """True if errors of RMS are known: not for stated elements, nor with modal damping."""
        return not (self._fixed or self.damping_grows)

    def least_error(self, modes):
        """Least relative error that is stated for an RMS by a model with some `CoupledModes`; infinite where unknown.

        Found on random scenes: larger for the smallest model.
        """
        if not self.error_known:
            return np.inf
        fewest = len(modes) == self.tried[0] < self.computed(len(modes))
        return (MOTION.resolved_by_fewest if fewest else MOTION.resolved) * self.accuracy

    def suffice(self, response):
        """True if the RMS of bodies in a `GustResponse` are accurate, or more modes do not make them so.

        They are as accurate as the modes left out and the quadrature allow; what the quadrature lacks no mode adds.
        """
        return self.surely_suffice(response) or response.truncation_error <= self._allowed_truncation(response)

    def surely_suffice(self, response):
        """True if `suffice` is already by an upper bound of the error by modes left out."""
        return response.truncation_at_most <= self._allowed_truncation(response)

    def _allowed_truncation(self, response):
        """Largest `GustResponse.truncation_error` with which modes suffice. [-]"""
        by_quadrature = response.integration_error / 2
        allowed = max(self.accuracy - by_quadrature, self.accuracy / 2, by_quadrature)
        return 2 * (MOTION.element_modes_change if self._fixed else allowed)  # of a variance, twice that of its root
