"""How far a place on cables can be moved until the force that restores it is no longer linear: from statics alone."""

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.cable.tolerances import CABLE


def forces(rest, moves, distances):
    """Change of the restoring force on cables as one place on them is moved, and its linear part.

    Parameters
    ----------
    rest : Catenary
        The cables at rest, of shape (c,).
    moves : ndarray, shape (c, 3)
        Movement of end 2 against end 1 per movement of the place, global axes. [-]
    distances : ndarray, shape (...)
        Movements of the place, of any sign. [m]

    Returns
    -------
    force, linear : ndarray, shape (...)
        Against the movement; not a number where a cable has no equilibrium. [N]
    """
    span = rest.span
    at_rest, chord = -rest.end_forces("global")[..., 1, :], span.chord[..., None] * span.frame[..., 0, :]
    movement = np.asarray(distances)[..., None, None] * moves
    moved = catenary.solve(
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
    change = -moved.end_forces("global")[..., 1, :] - at_rest
    solved = np.asarray(moved.record.converged).all(axis=-1)
    stiffness = (moves * (rest.global_end_stiffness @ moves[..., None])[..., 0]).sum()
    return np.where(solved, (change * moves).sum(axis=(-1, -2)), np.nan), stiffness * np.asarray(distances)


def linear_range(span, moves):
    """Shortest movement, of either sign, at which the restoring force is no longer linear to `linear_difference`.

    A movement at which a cable has no equilibrium counts as one.

    Parameters
    ----------
    span : Span
        The cables, of shape (c,).
    moves
        As for `forces`.

    Returns
    -------
    float or None
        None where the force is linear up to `largest_movement` of the shortest chord. [m]
    """
    moving = np.abs(moves).max(axis=-1) > 0
    if not moving.any():
        return None
    rest, moves = catenary.solve(span.take(np.flatnonzero(moving))), moves[moving]
    chord = float(rest.span.chord.min())
    distances = np.geomspace(
        CABLE.least_movement * chord, CABLE.largest_movement * chord, 2 * CABLE.movements_at_once
    ) * [[1.0], [-1.0]]
    limits = []
    for _ in range(CABLE.movement_divisions):
        intervals = []  # of each sign, that in which the force ceases to be linear, divided
        for row, force, linear in zip(distances, *forces(rest, moves, distances), strict=True):
            if not linear.all() or np.isnan(force[0]):
                continue
            beyond = ~(np.abs(force / linear - 1) <= CABLE.linear_difference)
            if beyond.any():
                first = int(np.argmax(beyond))
                if first:
                    intervals.append(np.linspace(row[first - 1], row[first], CABLE.movements_at_once))
                else:
                    limits.append(abs(row[0]))
        distances = np.array(intervals)
        if not intervals:
            break
    limits += [abs(row[0]) for row in distances]
    return float(min(limits)) if limits else None
