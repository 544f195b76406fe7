"""Range in which the static restoring force of cables on a point that they hold is linear in the point's movement."""

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.cable.tolerances import CABLE


def forces(at_rest, moves, distances):
    """Restoring force of cables on a point that moves their ends 2: exact by the catenaries, and linear by stiffness.

    For a movement x of the point, end 2 of a cable moves by x m. With the force P that holds end 2 of each cable, and
    the stiffness K there, the forces are

        exact: sum of m^T (P(x m) - P(0)),    linear: x (sum of m^T K m)

    Parameters
    ----------
    at_rest : Catenary
        The cables at rest, of shape (c,).
    moves : ndarray, shape (c, 3)
        m: movement of end 2 relative to end 1 per movement of the point, global axes. [-]
    distances : ndarray, shape (...)
        Movements x of the point, of either sign. [m]

    Returns
    -------
    force, linear : ndarray, shape (...)
        Exact and linear force; the exact one is NaN where a cable has no equilibrium. [N]
    """
    span = at_rest.span
    force_at_rest = -at_rest.end_forces("global")[..., 1, :]
    chord = span.chord[..., None] * span.frame[..., 0, :]
    movement = np.asarray(distances)[..., None, None] * moves
    displaced = catenary.solve(
        Span.between(
            np.zeros(3),
            chord + movement,
            span.axial_stiffness,
            span.mass,
            span.gravity,
            np.broadcast_to(span.unstretched_length, movement.shape[:-1]),
            span.load_positions,
            span.in_frame(span.load_forces, "global"),
            vertical=np.broadcast_to(span.vertical, movement.shape),
        )
    )
    change = -displaced.end_forces("global")[..., 1, :] - force_at_rest
    solved = np.asarray(displaced.record.converged).all(axis=-1)
    stiffness = (moves * (at_rest.global_end_stiffness @ moves[..., None])[..., 0]).sum()
    return np.where(solved, (change * moves).sum(axis=(-1, -2)), np.nan), stiffness * np.asarray(distances)


def linear_range(span, moves):
    """Shortest movement of a point at which the restoring force of the cables ceases to be linear.

    It is not linear where it differs from stiffness times distance by more than the share `CABLE.linear_difference`, or
    where a cable has no equilibrium. Both signs of the movement are tried.

    Parameters
    ----------
    span : Span
        The cables, of shape (c,).
    moves : ndarray, shape (c, 3)
        Movement of end 2 of each cable relative to end 1, per movement of the point, global axes; zero for cables that
        the point does not move. [-]

    Returns
    -------
    movement : float or None
        Size of this movement [m]. None where the force is linear up to `CABLE.largest_movement` of the shortest chord,
        where no cable is moved, and where there is no stiffness, or no equilibrium even at `CABLE.least_movement`.
    error : float
        Relative error of the movement: by the width of the last interval of the search, and by rounding of the force
        and of the positions of the ends. [-]
    """
    moving = np.abs(moves).max(axis=-1) > 0
    if not moving.any():
        return None, 0.0
    at_rest, moves = catenary.solve(span.take(np.flatnonzero(moving))), moves[moving]
    chord = float(at_rest.span.chord.min())
    shortest, longest = CABLE.least_movement * chord, CABLE.largest_movement * chord
    distances = np.geomspace(shortest, longest, 2 * CABLE.movements_at_once) * [[1.0], [-1.0]]
    limits = []
    for _ in range(CABLE.movement_divisions):
        intervals = []  # for each sign the distances that divide the interval in which the force ceases to be linear
        for movements, force, linear in zip(distances, *forces(at_rest, moves, distances), strict=True):
            index = _first_nonlinear(force, linear)
            if index:
                intervals.append(np.linspace(movements[index - 1], movements[index], CABLE.movements_at_once))
            elif index == 0:
                limits.append(abs(movements[0]))
        distances = np.array(intervals)
        if not intervals:
            break
    limits += [abs(movements[0]) for movements in distances]
    if not limits:
        return None, 0.0
    _, linear = forces(at_rest, moves, movement := float(min(limits)))
    by_force = float(at_rest.max_tension.sum()) / abs(float(linear)) / CABLE.linear_difference
    by_ends = float(at_rest.span.chord.max()) / movement
    return movement, CABLE.last_interval + CABLE.movement_rounding * (by_force + by_ends)


def _first_nonlinear(force, linear):
    """Index of the first of growing movements at which a force is not linear, or None: arguments of shape (k,). [N]

    None too where there is no stiffness, or no equilibrium even at the first of them.
    """
    if not linear.all() or np.isnan(force[0]):
        return None
    nonlinear = ~(np.abs(force / linear - 1) <= CABLE.linear_difference)
    return int(np.argmax(nonlinear)) if nonlinear.any() else None
