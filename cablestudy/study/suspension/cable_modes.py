"""Modes of single cables of a suspension between fixed ends, by the code of a scene of one cable.

The ends are those of the equilibrium. A cable of the suspension has an elastic catenary there, from which `Results`,
`CableCase` and `Refinement` of one cable go on: its modes by kind and symmetry, and their errors, are computed in one
place.
"""

from functools import cached_property

import numpy as np

from cablestudy.cable.steady_drag import SteadyDrag
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.loaded_cables import LoadedCables
from cablestudy.study.one_cable.results import Results
from cablestudy.study.stated_numbers import StatedNumbers
from cablestudy.study.suspension.numbers import SingleCable


class CableModes(Results):
    """Modes of the cables of one suspension between fixed ends: `Results` with the catenaries of its equilibrium.

    Parameters
    ----------
    scene : SuspensionScene
    form : Catenary or CatenaryInDrag
        All c cables in equilibrium, shape (c,).
    drag : SteadyDrag or None
        Drag of a steady wind on them, which fixed elements follow, see `FixedModel`.
    mode_error : float
        Relative error of all frequencies by what the equilibrium leaves out. [-]
    finer : callable
        Function without arguments -> `CableModes` of the suspension with a finer model.

    Attributes
    ----------
    cases : dict
        Name of each cable -> `CableAtRest`.
    """

    def __init__(self, scene, form, drag, mode_error, finer):
        count = len(form.span.chord)
        super().__init__(StatedNumbers([SingleCable(scene, name) for name in scene.cables]))
        self.catenary, self.form, self.finer = form, form, finer
        self.mode_error = np.full(count, mode_error)
        drag = SteadyDrag(np.zeros(count), np.zeros((count, 3))) if drag is None else drag
        self.loaded = LoadedCables(form.span, drag, None, None, None, {})
        self.cases = {name: CableAtRest(self, index, name) for index, name in enumerate(scene.cables)}

    @property
    def failures(self):
        """None: the cables are in equilibrium."""
        return {}

    @property
    def limp(self):
        """True for cables without a definite form, shape (c,)."""
        return self.catenary.slack

    def frequency(self, name, column):
        """Frequency of one mode of a cable between fixed ends [Hz], and its estimated relative error [-].

        The error is NaN where the scene fixes the number of elements, since these are not refined.

        Parameters
        ----------
        name : str
            Name of the cable.
        column : Column
            Column of the frequency, whose `mode` is the number of the mode, its kind, and its symmetry or None.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no such mode, or not to the accuracy.
        """
        case = self.cases[name]
        frequency, error = case.frequency(*column.mode)
        return frequency, np.nan if error is None else error + case.mode_error


class CableAtRest(CableCase):
    """One cable of the suspension of `CableModes` between fixed ends, by its index and name."""

    def __init__(self, modes, index, name):
        super().__init__(modes.values.scenes[index], modes, index)
        self._name = name

    @cached_property
    def finer(self):
        """`CableAtRest` of the suspension with a model to the accuracy `reference_accuracy`, for comparison."""
        return self.results.finer().cases[self._name]
