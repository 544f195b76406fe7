"""Range in which the static restoring force of cables on a point that they hold is linear in the point's movement."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.bracketing import zeros_between
from cablestudy.cable.catenary import Catenary
from cablestudy.cable.catenary_in_drag import CatenaryInDrag, bounded_errors, in_drag
from cablestudy.cable.moved_in_drag import changes_of_tension
from cablestudy.cable.records import with_arrays
from cablestudy.cable.span import Span
from cablestudy.cable.steady_drag import SteadyDrag
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size

SIGNS = np.array([[1.0], [-1.0]])  # of movements


@dataclass(frozen=True)
class MovedCables:
    """Cables some of whose ends a point holds, and moves.

    Attributes
    ----------
    at_rest : Catenary or CatenaryInDrag
        The cables at rest, of shape (c,).
    moves : ndarray, shape (c, 2, 3)
        m: movement of each end per movement of the point, global axes. [-]
    drag : SteadyDrag or None
        Of shape (c,), of the wind in which they hang: it follows the displaced cables.
    """

    at_rest: Catenary | CatenaryInDrag
    moves: np.ndarray
    drag: SteadyDrag | None

    def displaced(self, distances):
        """Equilibria where the point has moved by distances of either sign, shape (...) [m]: shape (..., c)."""
        span = self.at_rest.span
        movement = np.asarray(distances)[..., None, None, None] * self.moves
        chord = span.chord[..., None] * span.frame[..., 0, :] + movement[..., 1, :] - movement[..., 0, :]
        if self.drag is None:
            return catenary.solve(self._span(chord, span.gravity, np.broadcast_to(span.vertical, chord.shape)))
        drag = with_arrays(self.drag, lambda array: np.broadcast_to(array, movement.shape[:-3] + array.shape))
        if drag.profile is not None:
            drag = replace(drag, end_1=drag.end_1 + movement[..., 0, :])
        weight = (span.mass * span.gravity)[..., None] * span.vertical + self.drag.uniform(span.frame[..., 0, :])
        load = weight - drag.uniform(chord / size(chord)[..., None])
        loaded, most = load.any(axis=-1), np.maximum(size(load), CABLE.tiny)
        gravity = np.where(loaded, size(load) / np.where(loaded, span.mass, 1.0), span.gravity)
        uniform = self._span(chord, gravity, np.where(loaded[..., None], load / most[..., None], span.vertical))
        return in_drag(drag, catenary.solve(uniform), self.at_rest.pieces.parts)

    def _span(self, chord, gravity, vertical):
        """`Span` of the cables between ends a `chord` apart, their uniform load against `vertical`, shape (..., 3)."""
        span = self.at_rest.span
        return Span.between(
            np.zeros(3),
            chord,
            span.axial_stiffness,
            span.mass,
            gravity,
            np.broadcast_to(span.unstretched_length, chord.shape[:-1]),
            span.load_positions,
            span.in_frame(span.load_forces, "global"),
            vertical=vertical,
        )

    def force(self, distances):
        """Restoring force on the point that has moved, shape (...); NaN where no equilibrium of a cable is found. [N]

        With the force P that holds an end of a cable it is the sum of m^T (P(x m) - P(0)).
        """
        displaced = self.displaced(distances)
        change = self.at_rest.end_forces("global") - displaced.end_forces("global")
        solved = np.asarray(displaced.record.converged) & (True if self.drag is None else displaced.found)
        solved = solved.all(axis=-1)
        return np.where(solved, (change * self.moves).sum(axis=(-1, -2, -3)), np.nan)

    @property
    def stiffness(self):
        """Restoring force per small movement, to which drag follows: sum of m^T K m, of relative movements. [N/m]"""
        if self.drag is not None:
            change = changes_of_tension(self.at_rest, self.drag, self.moves)(np.array([0.0, 1.0]))
            return float((np.array([-1.0, 1.0])[:, None] * change * self.moves).sum())
        moved = self.moves[:, 1] - self.moves[:, 0]
        return float((moved * (self.at_rest.global_end_stiffness @ moved[..., None])[..., 0]).sum())


def linear_range(at_rest, moves, drag=None):
    """Shortest movement of a point at which the restoring force of the cables ceases to be linear.

    It is not linear where it differs from stiffness times distance by more than the share `CABLE.linear_difference`, or
    where a cable has no equilibrium. Both signs of the movement are tried. In a steady wind stiffness and force are
    those of cables whose drag follows them.

    Parameters
    ----------
    at_rest : Catenary or CatenaryInDrag
        The cables, of shape (c,).
    moves : ndarray, shape (c, 2, 3)
        Movement of each end of each cable per movement of the point, global axes. [-]
    drag : SteadyDrag, optional
        Of shape (c,), of the wind in which they hang.

    Returns
    -------
    movement : float or None
        Size of this movement [m]. None where the force is linear up to `CABLE.largest_movement` of the shortest chord,
        where no cable is moved, and where there is no stiffness, or no equilibrium even at `CABLE.least_movement`.
    error : float
        Relative error of the movement: by the width of the last interval of the search, by what drag leaves, and by
        rounding of the force and of the positions of the ends. [-]
    """
    moving = np.flatnonzero((moves[:, 1] != moves[:, 0]).any(axis=-1))
    if not len(moving):
        return None, 0.0
    blown = drag is not None and drag.normal_drag[moving].any()
    cables = MovedCables(at_rest.take(moving), moves[moving], drag.take(moving) if blown else None)
    at_rest = cables.at_rest
    chord, least = at_rest.span.chord, CABLE.movement_rounding
    stiffness, error = cables.stiffness, float(at_rest.least_errors.max()) if blown else 0.0
    found = (_limits_in_wind if blown else _limits_without_wind)(cables, stiffness, error)
    if not found:
        return None, 0.0
    movement = float(min(found))
    if blown:
        about = movement * SIGNS * (1 + CABLE.beyond_limit * SIGNS[:, 0])
        least = least + cables.displaced(about).least_errors.max(axis=(0, 1))
    by_force = float((at_rest.max_tension * least).sum()) / abs(stiffness * movement)
    by_ends = float(chord.max()) / movement * CABLE.movement_rounding
    error = CABLE.last_interval + (by_force + error) / CABLE.linear_difference + by_ends
    return movement, float(bounded_errors(error))


def _limits_without_wind(cables, stiffness, error):
    """`_limits` over all movements that are looked at; arguments as of that."""
    movements = np.geomspace(CABLE.least_movement, CABLE.largest_movement, 2 * CABLE.movements_at_once)
    return _limits(cables, stiffness, error, movements * cables.at_rest.span.chord.min())


def _limits_in_wind(cables, stiffness, error):
    """`_limits` about the range in which the cables are linear in uniform drag, a dead load, then over longer ones."""
    longest = CABLE.largest_movement * cables.at_rest.span.chord.min()
    in_dead_drag = linear_range(cables.at_rest.catenary, cables.moves)[0] or longest
    near, far = (min(factor * in_dead_drag, longest) for factor in CABLE.near_range)
    found = _limits(cables, stiffness, error, np.geomspace(near, far, CABLE.movements_at_once))
    if found or far == longest:
        return found
    return _limits(cables, stiffness, error, np.geomspace(far, longest, CABLE.movements_at_once))


def _limits(cables, stiffness, error, movements):
    """Sizes of the movements of each sign at which a force first ceases to be linear, where it does: list. [m]

    Parameters
    ----------
    cables : MovedCables
    stiffness, error : float
        [N/m], and its relative error.
    movements : ndarray, shape (k,)
        Positive, ascending. [m]
    """
    force = cables.force(SIGNS * movements)

    def beyond(movement, sign):
        """How much further from linear a force is than `CABLE.linear_difference`; 1 where there is no equilibrium."""
        signed = SIGNS[sign, 0] * movement
        return np.nan_to_num(np.abs(cables.force(signed) / (stiffness * signed) - 1) - CABLE.linear_difference, nan=1.0)

    firsts = [_first_nonlinear(force[sign], stiffness * SIGNS[sign] * movements) for sign in range(2)]
    signs = np.array([sign for sign in range(2) if firsts[sign]], dtype=int)
    found = [float(movements[0]) for first in firsts if first == 0]
    if len(signs):
        ends = np.array([firsts[sign] for sign in signs])
        intervals = movements[ends - 1], movements[ends]
        found += zeros_between(beyond, *intervals, signs, rtol=CABLE.last_interval + error).tolist()
    return found


def _first_nonlinear(force, linear):
    """Index of the first of growing movements at which a force is not linear, or None: arguments of shape (k,). [N]

    None too where there is no stiffness, or no equilibrium even at the first of them.
    """
    if not linear.all() or np.isnan(force[0]):
        return None
    nonlinear = ~(np.abs(force / linear - 1) <= CABLE.linear_difference)
    return int(np.argmax(nonlinear)) if nonlinear.any() else None
