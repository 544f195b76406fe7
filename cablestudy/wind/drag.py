"""Drag of the wind on a cable, linear in the turbulence; and vortex shedding frequencies.

Only the wind across the cable counts (the independence principle of a round cylinder). With U_n what of the mean wind
is normal to the cable, a = |U_n| and t the tangent, the drag rho C_d d/2 |u_n| u_n per length changes with the
turbulence u' by

    rho C_d d/2 [a (I - t t^T) + U_n U_n^T/a] u':

along the mean normal wind by rho C_d d a, across it by half as much.
"""

import numpy as np

STROUHAL = 0.2  # of a round cylinder at Reynolds numbers from 3e2 to 2e5 (Blevins, Flow-Induced Vibration, 1990)
GUSTS = 3.0  # standard deviations of the speed on either side in a range of shedding frequencies


def drag_matrices(tangent, blowing):
    """The bracket above over the mean speed, halved.

    Parameters
    ----------
    tangent : ndarray, shape (..., 3)
        Unit vectors. [-]
    blowing : ndarray, shape (3,)
        Unit vector of the mean wind. [-]

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Force per length = rho C_d d v times this times turbulence. [-]
    """
    normal = blowing - tangent * (tangent @ blowing)[..., None]
    size = np.sqrt((normal**2).sum(axis=-1))[..., None, None]
    unit = normal / np.where(size > 0, size, 1.0)[..., 0]
    across = np.eye(3) - tangent[..., :, None] * tangent[..., None, :]
    return size * (across + unit[..., :, None] * unit[..., None, :]) / 2


def shedding_frequencies(wind, diameter):
    """Vortex shedding frequencies St v/d of a cable in a `Wind`: lowest, mean and highest. [Hz]

    At the mean speed, and at three standard deviations below (0 at least) and above it; the diameter in m.
    """
    speeds = (wind.speed - GUSTS * wind.turbulence, wind.speed, wind.speed + GUSTS * wind.turbulence)
    return tuple(STROUHAL * np.maximum(speed, 0.0) / diameter for speed in speeds)
