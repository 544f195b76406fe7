"""How far a place on cables can be moved until the force that restores it is no longer linear: from statics alone."""

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.cable.tolerances import CABLE


def forces(rest, moves, distances):
    """Force on what is moved, beyond that at rest, and its linear part.

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
    there = np.asarray(distances)[..., None, None] * moves
    found = catenary.solve(
        Span.between(
            np.zeros(3),
            chord + there,
            span.axial_stiffness,
            span.mass,
            span.gravity,
            np.broadcast_to(span.unstretched_length, there.shape[:-1]),
            span.load_positions,
            span.in_frame(span.load_forces, "global"),
            vertical=np.broadcast_to(span.vertical, there.shape),
        )
    )
    change = -found.end_forces("global")[..., 1, :] - at_rest
    solved = np.asarray(found.record.converged).all(axis=-1)
    stiffness = (moves * (rest.global_end_stiffness @ moves[..., None])[..., 0]).sum()
    return np.where(solved, (change * moves).sum(axis=(-1, -2)), np.nan), stiffness * np.asarray(distances)


def linear_range(span, moves):
    """Shortest movement, of either sign, with a restoring force `linear_difference` off its linear part.

    Parameters
    ----------
    span : Span
        The cables, of shape (c,).
    moves
        As for `forces`.

    Returns
    -------
    float or None
        Shorter where a cable has no equilibrium; None without one below `largest_movement` of the shortest chord. [m]
    """
    moving = np.abs(moves).max(axis=-1) > 0
    if not moving.any():
        return None
    rest, moves = catenary.solve(span.take(np.flatnonzero(moving))), moves[moving]
    chord = float(rest.span.chord.min())
    distances = np.geomspace(
        CABLE.least_movement * chord, CABLE.largest_movement * chord, 2 * CABLE.movements_at_once
    ) * [[1.0], [-1.0]]
    found = []
    for _ in range(CABLE.movement_divisions):
        divided = []
        for row, force, linear in zip(distances, *forces(rest, moves, distances), strict=True):
            if not linear.all() or np.isnan(force[0]):
                continue
            beyond = ~(np.abs(force / linear - 1) <= CABLE.linear_difference)
            if beyond.any():
                place = int(np.argmax(beyond))
                if place:
                    divided.append(np.linspace(row[place - 1], row[place], CABLE.movements_at_once))
                else:
                    found.append(abs(row[0]))
        distances = np.array(divided)
        if not divided:
            break
    found += [abs(row[0]) for row in distances]
    return float(min(found)) if found else None
