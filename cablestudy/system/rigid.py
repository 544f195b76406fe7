"""Rigid bodies: rotations, and stiffness matrices for small displacements and rotations about global axes.

A body whose reference point is displaced by u and that turns by a small rotation vector a moves a point at r from the
reference point by u + a x r = B [u; a], B = [I, -[r x]].
"""

import numpy as np


def cross_matrix(vector):
    """[v x], the matrix of the cross product: [v x] w = v x w.

    Parameters
    ----------
    vector : ndarray, shape (..., 3)

    Returns
    -------
    ndarray, shape (..., 3, 3)
    """
    matrix = np.zeros((*vector.shape, 3))
    x, y, z = (vector[..., i] for i in range(3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def from_angles(angles):
    """Rotation matrix of roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll).

    Parameters
    ----------
    angles : ndarray, shape (..., 3)
        [rad]

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Body axes to global axes.
    """
    # cosines and sines of roll (r), pitch (p) and yaw (y)
    (cr, cp, cy), (sr, sp, sy) = (np.moveaxis(values, -1, 0) for values in (np.cos(angles), np.sin(angles)))
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_angles(rotation):
    """Roll, pitch and yaw of a rotation matrix; at a pitch of 90 degrees, where they are not unique, roll is zero.

    Parameters
    ----------
    rotation : ndarray, shape (..., 3, 3)

    Returns
    -------
    ndarray, shape (..., 3)
        Roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2]. [rad]
    """
    cos_pitch = np.hypot(rotation[..., 2, 1], rotation[..., 2, 2])
    pitch = np.arctan2(-rotation[..., 2, 0], cos_pitch)
    unique = cos_pitch > 1e-12
    roll = np.where(unique, np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]), 0.0)
    yaw = np.where(
        unique,
        np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]),
        np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1]),
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def turn(vector):
    """Matrix of a finite rotation less the unit matrix, exp([v x]) - I, accurate to rounding however small v is.

    Parameters
    ----------
    vector : ndarray, shape (..., 3)
        Rotation vector. [rad]

    Returns
    -------
    ndarray, shape (..., 3, 3)

    Notes
    -----
    sin(a)/a [v x] + (1 - cos a)/a^2 [v x]^2 with a = |v| (Rodrigues' formula).
    """
    matrix = cross_matrix(vector)
    angle = np.sqrt((vector**2).sum(axis=-1))[..., None, None]
    return np.sinc(angle / np.pi) * matrix + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (matrix @ matrix)


def at_attachments(stiffness, first, second):
    """Transfer a stiffness between attachment points to the reference points of the bodies: B_1^T K B_2.

    Parameters
    ----------
    stiffness : ndarray, shape (..., 3, 3)
        K, a 3x3 stiffness between the two points; its sign is left to the caller. [N/m]
    first, second : ndarray, shape (..., 3)
        r_1 and r_2: vectors from the reference point of body 1 and 2 to its attachment point, global axes. [m]

    Returns
    -------
    ndarray, shape (..., 6, 6)
        Rows force and moment on body 1, columns displacement and rotation of body 2. [N/m, N/rad; N, N m/rad]
    """
    left, right = cross_matrix(first), -cross_matrix(second)  # rotational parts of B_1^T and B_2: -[r x]^T = [r x]
    by_rotation = stiffness @ right
    matrix = np.empty((*stiffness.shape[:-2], 6, 6))
    matrix[..., :3, :3], matrix[..., :3, 3:] = stiffness, by_rotation
    matrix[..., 3:, :3], matrix[..., 3:, 3:] = left @ stiffness, left @ by_rotation
    return matrix
