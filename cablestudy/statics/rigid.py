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
    unique = cos_pitch > 1e-12  # else the axes of roll and yaw are one, except for rounding
    roll = np.where(unique, np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2]), 0.0)
    yaw = np.where(
        unique,
        np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]),
        np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1]),
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def angle_errors(rotation, rotation_error):
    """Errors of roll, pitch and yaw by those of a small rotation of the body, shape (..., 3). [rad]

    Parameters
    ----------
    rotation : ndarray, shape (..., 3, 3)
        Rotation matrix of the body.
    rotation_error : ndarray, shape (..., 3)
        Largest components of the small rotation vector about the global axes. [rad]

    Notes
    -----
    A small rotation v with the components h = vx cos(yaw) + vy sin(yaw) changes roll by h / cos(pitch), pitch by
    vy cos(yaw) - vx sin(yaw), and yaw by vz + h tan(pitch): near a pitch of 90 degrees roll and yaw may be anything. No
    error is larger than pi.
    """
    _, pitch, yaw = np.moveaxis(to_angles(rotation), -1, 0)
    error_x, error_y, error_z = np.moveaxis(rotation_error, -1, 0)
    cosine, sine, cos_pitch = np.abs(np.cos(yaw)), np.abs(np.sin(yaw)), np.abs(np.cos(pitch))
    level = error_x * cosine + error_y * sine
    of_roll = level / cos_pitch  # cos(pitch) of a number is never exactly zero
    errors = np.stack([of_roll, error_x * sine + error_y * cosine, error_z + level * np.abs(np.tan(pitch))], axis=-1)
    return np.minimum(errors, np.pi)


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


def rotation_vector(rotation):
    """Vector v of a rotation exp([v x]) by less than half a turn, the inverse of `turn`, shape (..., 3). [rad]

    Parameters
    ----------
    rotation : ndarray, shape (..., 3, 3)
    """
    skew = (rotation - np.swapaxes(rotation, -1, -2)) / 2
    vector = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    sine = np.sqrt((vector**2).sum(axis=-1))
    angle = np.arctan2(sine, (np.trace(rotation, axis1=-2, axis2=-1) - 1) / 2)
    return vector * np.where(sine > 0, angle / np.where(sine > 0, sine, 1.0), 1.0)[..., None]


def about_two_axes(free):
    """True for bodies of which exactly two rotations are free, shape (b,); `free` as of `SuspendedSystem`."""
    return free[:, 3:].sum(axis=-1) == 2


def point_movement(arm):
    """B of the module's docstring: displacement of a point per displacement and rotation of its body, [I, -[r x]].

    Parameters
    ----------
    arm : ndarray, shape (..., 3)
        r, global axes. [m]

    Returns
    -------
    ndarray, shape (..., 3, 6)
    """
    movement = np.empty((*arm.shape, 6))
    movement[..., :3], movement[..., 3:] = np.eye(3), cross_matrix(-arm)
    return movement
