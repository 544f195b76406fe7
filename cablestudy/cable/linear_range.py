"""How far a place on cables can be moved until the force that restores it is no longer linear: from statics alone."""

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.span import Span

APART = 0.05  # difference of the restoring force from its linear part
NEAREST, FARTHEST = 1e-7, 0.9  # movements that are looked at, over the shortest chord
POINTS, PASSES = 40, 6  # movements at once, and how often the interval of two of them is divided again


def forces(span, moves, distances):
    """Force on what is moved, beyond that at rest, and its linear part.

    Parameters
    ----------
    span : Span
        The cables, of shape (c,).
    moves : ndarray, shape (c, 3)
        Movement of end 2 against end 1 per movement of the place, global axes. [-]
    distances : ndarray, shape (n,)
        Movements of the place, of any sign. [m]

    Returns
    -------
    force, linear : ndarray, shape (n,)
        Against the movement; not a number where a cable has no equilibrium. [N]
    """
    rest = catenary.solve(span)
    at_rest, chord = -rest.end_forces("global")[..., 1, :], span.chord[..., None] * span.frame[..., 0, :]
    there = np.asarray(distances)[:, None, None] * moves
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
    """Shortest movement, of either sign, at which the restoring force differs by APART from its linear part.

    Parameters
    ----------
    span, moves
        As for `forces`.

    Returns
    -------
    float or None
        Shorter where a cable has no equilibrium; None where there is none below FARTHEST of the shortest chord. [m]
    """
    moving = np.abs(moves).max(axis=-1) > 0
    if not moving.any():
        return None
    span, moves = span.take(np.flatnonzero(moving)), moves[moving]
    chord = float(span.chord.min())
    places = [_first(span, moves, sign, chord) for sign in (1.0, -1.0)]
    return min((place for place in places if place is not None), default=None)


def _first(span, moves, sign, chord):
    """The same for one sign."""
    distances = np.geomspace(NEAREST * chord, FARTHEST * chord, 2 * POINTS)
    for _ in range(PASSES):
        force, linear = forces(span, moves, sign * distances)
        if not linear.all() or np.isnan(force[0]):
            return None
        beyond = ~(np.abs(force / linear - 1) <= APART)
        if not beyond.any():
            return None
        place = int(np.argmax(beyond))
        if not place:
            break
        distances = np.linspace(distances[place - 1], distances[place], POINTS)
    return float(distances[0])
