"""The gondola's mode on the cable of a case: of one that is free along x, and to the accuracy of the scene."""

from functools import cached_property, partial
from itertools import chain

import numpy as np

from cablestudy.errors import ConvergenceError, result_of
from cablestudy.study.one_cable_system import GONDOLA, cables_of
from cablestudy.study.suspension.body_mode import BodyMode, damping_ratios, to_accuracy
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
        self._case, self._accuracy, self._damping_ratio = case, case.scene.model.accuracy, None

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
        modes_of = partial(coupled_modes, case.equilibrium, accuracy=accuracy, cables=cables_of(case, damping))
        return BodyMode.search(modes_of, GONDOLA, 0, 0)

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
        value, error = to_accuracy(lambda mode: mode.share, map(self._sharper_mode, STUDY.sharper), self._accuracy)
        return value, np.maximum(error, self._rounding)

    @property
    def damping_ratio(self):
        """Damping ratio of its pole, the winch at rest: 1 without oscillation. [-]

        Raises
        ------
        NoSolutionError, ConvergenceError
            As of `mode`, and of `body_mode.damping_ratios`; a gondola that needs a finer mesh than there is.
        """
        if self._damping_ratio is None:
            solve_damping_ratios([self])
        ratio = result_of(self._damping_ratio)
        if ratio.finest and not ratio.within(self._accuracy):
            raise ConvergenceError(
                f"gondola_damping_ratio: estimated error {ratio.error:.1e}, asked for {self._accuracy:g}: it needs all "
                f"modes of the cable, of which no mesh has more than {STUDY.damped_pole_freedoms}"
            )
        return ratio.value, np.maximum(ratio.error, self._rounding)

    def _attempts(self):
        """Yield `mode` and the airflow that damps it, and then that of ever finer models."""
        for mode in chain([self.mode], map(self._sharper_mode, STUDY.sharper[1:])):
            yield mode, self._case.in_wind.airflow


def solve_damping_ratios(modes):
    """Compute the damping ratios of the modes of many cases (list of GondolaMode) together, and keep them in each."""
    ratios = damping_ratios([mode._attempts() for mode in modes], [mode._accuracy for mode in modes])
    for mode, ratio in zip(modes, ratios, strict=True):
        mode._damping_ratio = ratio
