"""Results of the statics of cables, by the closed form or by elements: two classes with the same attributes."""

from functools import cached_property

import numpy as np

from cablestudy.cable.geometry import midspan, sag_and_swing
from cablestudy.cable.tolerances import CABLE
from cablestudy.study.tolerances import STUDY


class ClosedStatics:
    """Statics of the elastic catenary, of one cable or with an axis of cases: tensions [N], length [m], iterations."""

    def __init__(self, catenary):
        """Take the statics from a `Catenary` or `CatenaryInDrag`, each when it is needed."""
        self._catenary = catenary

    @cached_property
    def mean_tension(self):
        """Mean over the unstretched length, shape (...). [N]"""
        return self._catenary.mean_tension

    @cached_property
    def max_tension(self):
        """Largest tension, shape (...). [N]"""
        return self._catenary.max_tension

    @cached_property
    def _least_tension(self):
        """Smallest tension, shape (...) [N]; and whether it is next to none, where the solver leaves a tiny one."""
        least = self._catenary.min_tension
        return least, least <= CABLE.folded * self.max_tension

    @cached_property
    def min_tension(self):
        """Smallest tension, 0 of a folded cable, shape (...). [N]"""
        least, folded = self._least_tension
        return np.where(folded, 0.0, least)

    @cached_property
    def horizontal_tension(self):
        """Mean horizontal tension, 0 of a folded cable and of an upright one, shape (...). [N]"""
        floor = np.where(self._least_tension[1], CABLE.folded, STUDY.upright) * self.max_tension
        horizontal = self._catenary.horizontal_tension
        return np.where(horizontal > floor, horizontal, 0.0)

    @cached_property
    def stretched_length(self):
        """Stretched length, shape (...). [m]"""
        return self._catenary.stretched_length

    @property
    def iterations(self):
        """Newton steps to the equilibrium, shape (...)."""
        return self._catenary.record.steps

    @cached_property
    def sag(self):
        """Vertical distance from chord to cable at mid-span, shape (...). [m]"""
        return self._catenary.sag


class ElementStatics:
    """Statics of elements in equilibrium, of one cable or with an axis of cases; attributes as in `ClosedStatics`.

    From a `State`, its `NewtonRecord`, and the arc length at mid-span of the continuous cables over the unstretched
    length, shape (...), where the sag of an upright cable is measured. [-]
    """

    def __init__(self, state, record, middle):
        self._state, self._middle = state, middle
        span, weights = state.span, state.mesh.point_weights
        force = (state.tension * np.asarray(state.force)[..., None, None])[..., None] * state.direction
        up = span.frame[..., 2][..., None, None, :]  # in the chord frame
        horizontal = force - (force * up).sum(axis=-1, keepdims=True) * up

        def mean(values):
            """Integral of values at the Gauss points over the unstretched length, over this length."""
            return (weights * values).reshape(*np.shape(state.force), -1).sum(axis=-1)

        self.mean_tension = mean(state.tension) * state.force
        self.horizontal_tension = mean(np.sqrt((horizontal**2).sum(axis=-1)))
        self.max_tension, self.min_tension = state.max_tension, state.min_tension
        self.stretched_length = span.unstretched_length * (1 + self.mean_tension / span.axial_stiffness)
        self.iterations = record.steps

    @cached_property
    def sag(self):
        """Vertical distance from chord to cable at mid-span, shape (...). [m]"""
        return sag_and_swing(self._state, midspan(self._state, self._middle))[0]


def tensions_by_end_2(form, change):
    """Tensions at both ends of the k pieces of cables, and sizes of their changes with end 2, shape (..., k, 2) each.

    Parameters
    ----------
    form : Catenary, CatenaryInDrag or State
        The cables in equilibrium.
    change : ndarray, shape (..., k + 1, 3)
        Of the tension vector at the edges of the pieces, along x, y and z, per displacement of end 2. [N/m]

    Returns
    -------
    tensions : ndarray
        [N]
    changes : ndarray
        Per displacement of end 2. [N/m]
    """
    tensions, of_ends = form.edge_tensions, np.stack([change[..., :-1, :], change[..., 1:, :]], axis=-2)
    along = np.abs((form.edge_forces * of_ends).sum(axis=-1))
    return tensions, along / np.where(tensions > 0, tensions, 1.0)
