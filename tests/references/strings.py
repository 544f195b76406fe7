"""A rigid body on straight taut cables, each a string across and a rod along itself: closed forms of their waves.

With the far end held, the end of a cable that moves by e exp(s t) is pulled back by

    across:  T g coth(g l) e,   g^2 = (m s^2 + c s)/T        along:  A h coth(h L) e,   h^2 = (m0 s^2 + c0 s)/A

with the tension T, the lengths l stretched and L unstretched, mass and viscous damping per stretched (m, c) and per
unstretched length (m0, c0), and A = EA (1 + i loss factor).
"""

import numpy as np

from .dense import cross


def dynamic_stiffness(s, anchors, ends, tension, EA, per_length, viscous, loss_factor):
    """Of a body without mass at its reference point, shape (f, 6, 6).

    Parameters
    ----------
    s : ndarray, shape (f,)
        [rad/s]
    anchors, ends : ndarray, shape (c, 3)
        Of the cables, from the reference point. [m]
    tension, EA, per_length, viscous : float
        Alike of all cables: [N], [N], and [kg/m], [N s/m^2] per unstretched length.
    loss_factor : float
    """
    found, elastic = np.zeros((len(s), 6, 6), dtype=complex), EA * (1 + 1j * loss_factor)
    for anchor, end in zip(anchors, ends, strict=True):
        chord = end - anchor
        stretched = np.linalg.norm(chord)
        along, length = chord / stretched, stretched / (1 + tension / EA)
        lossy = per_length * s**2 + viscous * s
        across, rod = np.sqrt(lossy * length / stretched / tension), np.sqrt(lossy / elastic)
        string = tension * across / np.tanh(across * stretched)
        rod = elastic * rod / np.tanh(rod * length)
        axial, moved = np.outer(along, along), np.concatenate([np.eye(3), -cross(end)], axis=1)
        pull = string[:, None, None] * (np.eye(3) - axial) + rod[:, None, None] * axial
        found += moved.T @ pull @ moved
        turn = tension * cross(along) @ cross(end)  # the force -T along turns the body that turns under it
        found[:, 3:, 3:] += (turn + turn.T) / 2
    return found
