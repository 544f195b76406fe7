"""Deflections of a cable by point loads in a steady wind: errors by drag that is taken as uniform along the cable."""

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.records import with_arrays
from cablestudy.study.uneven_drag import (
    CablesInDrag,
    Pieces,
    flexibility,
    settled_changes,
    slope_of,
    stiffness_and_length,
    stretched_and_turned,
)


def deflections_by_drag(case):
    """Changes of the deflections of k point loads by drag that varies along the cable, in place of uniform drag.

    Parameters
    ----------
    case : CableCase or HangingCable
        With point loads, its statics in closed form.

    Returns
    -------
    ndarray, shape (2, k)
        Of the non-linear and the linear deflections of `load_deflections`; zero without a steady wind. [m]
    """
    span = case.span
    size = np.sqrt((span.load_forces**2).sum(axis=-1))
    if case.steady_wind is None:
        return np.zeros((2, len(size)))
    loaded_span = with_arrays(span, lambda array: np.asarray(array)[None])  # a batch of one
    forces, shares = span.in_frame(span.load_forces, "global"), span.load_positions / span.unstretched_length
    loads, spans = _Loads(Pieces.of(solve(loaded_span)), shares, forces), (loaded_span, loaded_span.without_loads())
    stiffness, length = stiffness_and_length(loaded_span)
    loaded, unloaded = (_tensions(case.steady_wind, of_one, loads.pieces) for of_one in spans)
    # two each, in uniform and in actual drag
    full = np.diff([[loads.places(tensions, stiffness) for tensions in both] for both in (unloaded, loaded)], axis=0)[0]
    linear = [loads.linear(tensions, stiffness) for tensions in unloaded]
    moved = length[0] * np.diff([full, linear], axis=1)[:, 0]
    return (moved * forces).sum(axis=-1) / np.where(size > 0, size, 1.0)


def _tensions(steady_wind, span, pieces):
    """Tension vectors at the points of a cable under uniform and under actual drag, (1, j, 3) each, global axes. [N]

    The actual drag also moves the ends: `steady_wind` is that of a case.
    """
    drag, ends = steady_wind
    cables = CablesInDrag.of(drag, solve(span), pieces=pieces)
    return cables.at_points, settled_changes(cables, ends).tensions


class _Loads:
    """k point loads on a cable, in a batch of one, and integrals from end 1 up to each.

    Parameters
    ----------
    pieces : Pieces
        Of the cable between the loads.
    shares : ndarray, shape (k,)
        Of the unstretched length, at which the loads are. [-]
    forces : ndarray, shape (k, 3)
        Global axes. [N]
    """

    def __init__(self, pieces, shares, forces):
        self.pieces = pieces
        before = pieces.points < shares[:, None]  # points before each load, shape (k, j)
        self._up_to_loads = before * pieces.weights[0, :, 0]
        self._loads_before = (~before).T @ forces

    def places(self, tensions, stiffness):
        """Places of the loads from end 1 over the length, by tension vectors at the points, shape (k, 3). [-]"""
        return self._up_to_loads @ slope_of(tensions, stiffness)[0][0]

    def linear(self, tensions, stiffness):
        """Linear movements of the loads over the length, by the tensions without them, shape (k, 3). [-]"""
        _, tension, tangent = slope_of(tensions, stiffness)
        give = stretched_and_turned(self._loads_before[None], tension, tangent, stiffness)
        # both ends stay: a constant change of the tension vector takes back what the loads move end 2 by
        total = flexibility(tension, tangent, self.pieces.weights, stiffness)
        constant = np.linalg.solve(total, self.pieces.integral(give)[:, 0, :, None])[:, None, :, 0]
        return self._up_to_loads @ (stretched_and_turned(constant, tension, tangent, stiffness) - give)[0]
