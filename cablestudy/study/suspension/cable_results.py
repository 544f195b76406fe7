"""Statics of the cables of suspensions: of all of them as arrays, and of one for columns computed case by case."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from cablestudy.cable.catenary import Catenary
from cablestudy.cable.catenary_in_drag import CatenaryInDrag
from cablestudy.study.cable_columns import utilisation_of
from cablestudy.study.one_cable.loaded_cables import LoadedCables
from cablestudy.study.one_cable.results import Results
from cablestudy.study.suspension.numbers import CableNumbers, SingleCable
from cablestudy.study.tolerances import STUDY

# zero except for rounding where the load is along the chord
HORIZONTAL = (
    "horizontal_tension", "reaction_1_horizontal", "reaction_2_horizontal", "catenary_constant", "lambda_squared",
)  # fmt: skip


class CableResults(Results):
    """Statics of the c cables of n suspensions: `Results` whose arrays have the shape (n, c) in place of (n,).

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n of them, with the same cables.
    equilibrium : Equilibrium
        Of these cases, shape (n,), in the drag that varies along each cable.
    reference_length : ndarray, shape (n, c)
        Unstretched lengths in the reference state, which is without a load case. [m]
    """

    def __init__(self, scenes, equilibrium, reference_length):
        super().__init__(CableNumbers(scenes))
        self._equilibrium, self._columns = equilibrium, {}
        self.form = equilibrium.catenary
        self.loaded = LoadedCables(self.form.span, None, reference_length, None, None, {})

    @property
    def end_1(self):
        """Positions of the ends `from`, shape (n, c, 3). [m]"""
        return self._equilibrium.ends[:, self._equilibrium.suspension.of_cables, 0]

    @property
    def chord(self):
        """Distances of the ends, shape (n, c). [m]"""
        return self.span.chord

    @cached_property
    def utilisation(self):
        """Largest tension over breaking force of each cable, shape (n, c), NaN without one. [-]"""
        return utilisation_of(self)

    @cached_property
    def overloaded(self):
        """True for cases with a cable whose largest tension is above its breaking force: list of bool."""
        return (self.utilisation > 1).any(axis=-1).tolist()

    def over_all(self, name, compute, extreme):
        """Least, largest or sum over all cables that have a number in a column, NaN without any: list.

        Parameters
        ----------
        name, compute
            As for `column`.
        extreme : {numpy.fmin, numpy.fmax, numpy.add}
        """
        if (name, extreme) not in self._columns:
            values = self.column(name, compute)
            known = ~np.isnan(values)
            numbers = extreme.reduce(np.where(known, values, 0.0) if extreme is np.add else values, axis=-1)
            self._columns[name, extreme] = np.where(known.any(axis=-1), numbers, np.nan).tolist()
        return self._columns[name, extreme]

    def column(self, name, compute):
        """Numbers of all cables in a column of single cables, shape (n, c), computed once.

        Parameters
        ----------
        name : str
            Of the column.
        compute : callable
            Results -> array.
        """
        if name not in self._columns:
            values = np.broadcast_to(compute(self), np.shape(self.span.chord))
            self._columns[name] = np.where(self._is_rounding(name), 0.0, values)
        return self._columns[name]

    def _is_rounding(self, name):
        """True where a column of HORIZONTAL is rounding of zero: all load, and so the cable, is along the chord.

        Horizontal tension and catenary constant are zero there only if that load is vertical, not oblique as in a wind.
        """
        point_loads = np.abs(self.span.load_forces)
        across = point_loads[..., 1:].sum(axis=(-1, -2)) > STUDY.rounding * point_loads.sum(axis=(-1, -2))
        load_along_chord = (name in HORIZONTAL) & (np.abs(self.span.cosine) < STUDY.rounding) & ~across
        return load_along_chord & (self.span.vertical[..., 2] == 1) if name != "lambda_squared" else load_along_chord


@dataclass(frozen=True)
class HangingCable:
    """One cable in equilibrium, with the attributes of `CableCase` that columns computed case by case need."""

    scene: SingleCable
    end_1: np.ndarray  # position of its end `from`, shape (3,) [m]
    form: Catenary | CatenaryInDrag
    reference_length: float  # unstretched length in the reference state [m]
    statics_error: float  # relative error of the statics of its case [-]
    form_of: Callable  # `Span` of the cable with other loads -> its form
    coarser: "HangingCable | None"  # by drag that varies on half as many parts; None without a steady wind
    exact_statics: ClassVar = True

    @property
    def continuous(self):
        """`form`, as of `CableCase`."""
        return self.form

    @property
    def span(self):
        """The cable and its ends: `Span`."""
        return self.form.span
