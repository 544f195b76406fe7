"""Drag of a steady wind along a cable: only the part of the wind across it counts.

With the unit vector u of the wind and the tangent t of the cable, u_n = u - t (t . u), the force per unstretched length
is C_d q D (1 + strain) |u_n| u_n. As a uniform load it is that of the chord, in the place of the tangent, without
strain.
"""

import numpy as np

ALONG_CHORD = np.array([1.0, 0.0, 0.0])  # chord frame


def across(direction, tangent):
    """|u_n| u_n of a unit vector u, with its part u_n across a tangent, shape (..., 3). [-]"""
    normal = direction - tangent * (direction * tangent).sum(axis=-1, keepdims=True)
    return np.sqrt((normal**2).sum(axis=-1, keepdims=True)) * normal


def uneven_drag(pressed, direction):
    """Difference of the drag of cables made of elements, where they hang, from the uniform one.

    Parameters
    ----------
    pressed : ndarray, shape (n,)
        Drag of a length across the wind, C_d q D. [N/m]
    direction : ndarray, shape (n, 3)
        Of the wind, global axes. [-]

    Returns
    -------
    callable or None
        `State` of these cables -> force per unstretched length at the Gauss points, chord frame, shape (n, e, q, 3)
        [N/m]; None where no wind blows.
    """
    if not pressed.any():
        return None

    def at_points(state):
        local = (state.span.frame @ direction[..., None])[:, None, None, :, 0]
        there = state.stretch[..., None] * across(local, state.direction)
        return pressed[:, None, None, None] * (there - across(local, ALONG_CHORD))

    return at_points
