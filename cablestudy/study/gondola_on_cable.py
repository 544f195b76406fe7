"""A gondola on its cable as a case of a suspension, for numbers that a scene of one cable has no function for."""

from functools import cached_property

import numpy as np

from cablestudy.scene.one_cable import CABLE, GONDOLA, as_suspension
from cablestudy.study.case import Case
from cablestudy.study.one_cable_system import equilibria_of
from cablestudy.study.refinement import reference_scene
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.group import Group
from cablestudy.study.suspension.load_cases import DragChange
from cablestudy.system.coupled_modes import coupled_modes


class OneCableGroup(Group):
    """A `Group` of one case whose body is held where end 2 of its cable is.

    Its errors of statics are those of the cable: that by a drag which changes along the cable is among them, since rows
    of one cable add it to the errors of motion. The position of end 2 has none.

    Parameters
    ----------
    case : Case
        With an equilibrium.
    """

    def __init__(self, case):
        self._case, self.reference, self._loaded, self._coordinates = case, equilibria_of([case]), None, {}
        self._conductors = None  # their errors are in those of the case
        self.cable_indices, self.body_indices = {CABLE: 0}, {GONDOLA: 0}
        self._rounding_errors = [case.statics_error]
        self._rounding_movement = np.zeros((1, 1, 6))
        self._drag_change = self._drag_change_in_wind = DragChange(np.zeros(1), self._rounding_movement)

    def failure(self, _):
        """None, since the case has an equilibrium."""

    def modes(self, _, count):
        """The lowest `CoupledModes`, those across the plane of the cable too; raises as `coupled_modes`."""
        scene = self._case.scene
        return coupled_modes(self.take(0), count, scene.model.accuracy, [scene.cable.damping])

    def steady_drag(self, _):
        """Drag of the steady wind on the cable, as `FixedModel.drag`."""
        return self._case.results.drag.take([self._case.index])


class GondolaOnCable(SuspensionCase):
    """`SuspensionCase` of a `Case` with a gondola, for columns that only a suspension has a function for."""

    def __init__(self, case):
        case.results.check(case.index)
        super().__init__(as_suspension(case.scene), OneCableGroup(case))
        self._case = case

    @cached_property
    def finer(self):
        """`GondolaOnCable` with a model to the accuracy `reference_accuracy`, for comparison."""
        return gondola_on_cable(Case(reference_scene(self._case.scene)))

    @property
    def in_wind(self):
        """`DynamicAnalysis` of the gondola with its winch loop, and in the wind on it."""
        return self._case.in_wind


def gondola_on_cable(case):
    """The `GondolaOnCable` of a case, made once."""
    if "gondola_on_cable" not in case.computed:
        case.computed["gondola_on_cable"] = GondolaOnCable(case)
    return case.computed["gondola_on_cable"]
