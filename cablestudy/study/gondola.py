"""The gondola's mode on the cable of a case: of one that is free along x, and to the accuracy of the scene."""

from functools import cached_property
from itertools import chain

import numpy as np

from cablestudy.study.one_cable_system import GONDOLA, cables_of
from cablestudy.study.suspension.body_mode import BodyMode, to_accuracy
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled_modes import coupled_modes


class GondolaMode:
    """The coupled mode of gondola and cable with the largest share of the gondola's static compliance along x.

    Each number comes with its estimated relative error, not a number for an exact choice of elements.

    Parameters
    ----------
    case : Case
        With the mass of a gondola.
    """

    def __init__(self, case):
        self._case, self._accuracy = case, case.scene.model.accuracy

    @cached_property
    def mode(self):
        """`BodyMode`, of the modes of loop and wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no modes, or not to the accuracy.
        """
        return BodyMode.search(self._case.in_wind.lowest_modes, GONDOLA, 0, 0)

    def _sharper_mode(self, sharper):
        """`BodyMode` of modes with `sharper` times the accuracy of the scene, computed with a finer model too."""
        case, damping, accuracy = self._case, self._case.scene.cable.damping, sharper * self._accuracy
        equilibrium, cables = case.equilibrium, cables_of(case, damping)
        return BodyMode.search(
            lambda count: coupled_modes(equilibrium, count, accuracy, damping, cables=cables), GONDOLA, 0, 0
        )

    @property
    def _rounding(self):
        """Relative error by rounding, at least. [-]"""
        return max(STUDY.rounding, float(self._case.results.motion_rounding[self._case.index]))

    @cached_property
    def frequency(self):
        """Undamped frequency. [Hz]"""
        value, error = self.mode.frequency
        return value, np.maximum(error, self._rounding)

    @cached_property
    def share(self):
        """Share of the gondola's static compliance. [-]"""
        if not self._accuracy:
            return self.mode.share
        return self._to_accuracy(lambda mode: mode.share, map(self._sharper_mode, STUDY.sharper))

    @cached_property
    def damping_ratio(self):
        """Damping ratio of its pole, the winch at rest: 1 without oscillation. [-]

        Raises
        ------
        NoSolutionError, ConvergenceError
            As of `mode`, and of `BodyMode.damping_ratio`.
        """
        airflow = self._case.in_wind.airflow
        modes = chain([self.mode], map(self._sharper_mode, STUDY.sharper[1:]))
        return self._to_accuracy(lambda mode: mode.damping_ratio(airflow), modes)

    def _to_accuracy(self, number_of, modes):
        """A number to the accuracy, whose error is not below rounding; see `to_accuracy`."""
        value, error = to_accuracy(number_of, modes, self._accuracy)
        return value, np.maximum(error, self._rounding)
