"""Statics of cables by the closed form, and of one cable by elements, with the same attributes."""

import numpy as np

from cablestudy.cable.catenary import FOLDED
from cablestudy.cable.geometry import sag_and_swing
from cablestudy.cable.state import interpolate, sag
from cablestudy.errors import NoSolutionError
from cablestudy.study.columns import SHAPELESS, UPRIGHT


class ClosedStatics:
    """Statics of the elastic catenary, of one cable or with an axis of cases: tensions [N], length [m], iterations."""

    def __init__(self, catenary):
        self._catenary = catenary
        self.mean_tension, self.max_tension = catenary.mean_tension, catenary.max_tension
        # the solver leaves a folded cable a tiny tension at its fold, and an upright one a tiny horizontal tension
        least, horizontal = catenary.min_tension, catenary.horizontal_tension
        folded = least <= FOLDED * self.max_tension
        self.min_tension = np.where(folded, 0.0, least)
        floor = np.where(folded, FOLDED, UPRIGHT) * self.max_tension
        self.horizontal_tension = np.where(horizontal > floor, horizontal, 0.0)
        self.stretched_length, self.iterations = catenary.stretched_length, catenary.record.steps

    @property
    def sag(self):
        """Vertical distance from chord to cable at mid-span, shape (...). [m]"""
        return self._catenary.sag

    def shape(self, positions):
        """Displacement from the chord, shape (j, 3), and tension, shape (j,) [N], of one cable.

        Displacements are in unstretched lengths, in the chord frame; `positions`, shape (j,), are arc lengths over
        unstretched length. NoSolutionError where a part of the cable is slack.
        """
        if np.any(self._catenary.slack):
            raise NoSolutionError(SHAPELESS)
        displacement, tension = self._catenary.at(positions)
        return displacement, np.sqrt((tension**2).sum(axis=-1))


class DiscreteStatics:
    """Statics of a fixed number of elements; attributes as of `ClosedStatics`, of one cable."""

    def __init__(self, case):
        self._case = case
        (
            self.mean_tension,
            self.horizontal_tension,
            self.max_tension,
            self.min_tension,
            self.stretched_length,
            self.iterations,
        ) = case.model.statics

    @property
    def sag(self):
        """Vertical distance from chord to cable at mid-span. [m]"""
        case = self._case
        if case.results.span.vertical[case.index][2] != 1:  # blown out of the vertical
            return float(sag_and_swing(case.state, case.middle)[0])
        return sag(case.state, case.results.catenary.middle[case.index])

    def shape(self, positions):
        """Static form at some places, see `ClosedStatics.shape`."""
        return interpolate(self._case.state, positions)
