"""Drag of the wind on a cable, linear in the turbulence; and vortex shedding frequencies.

Only the wind across the cable counts (the independence principle of a round cylinder of diameter d). With the part U_n
of the mean wind that is normal to the cable, a = |U_n| and the tangent t, turbulence u' changes the drag per length,
rho C_d d/2 |u_n| u_n of the normal wind u_n = U_n + u'_n, by

    rho C_d d/2 [a (I - t t^T) + U_n U_n^T/a] u':

along the mean normal wind by rho C_d d a, across it by half as much.

A body or a cable that moves meets a wind that is slower by its own velocity, so the same factors damp it.
"""

import numpy as np

from cablestudy.wind.tolerances import WIND

STROUHAL = 0.2  # of a round cylinder at Reynolds numbers from 3e2 to 2e5 (Blevins, Flow-Induced Vibration, 1990)


def drag_matrices(tangent, wind_direction):
    """Matrices from turbulence to the drag that it adds per length of a cable: [a (I - t t^T) + U_n U_n^T/a]/(2 v).

    U_n is the part of the mean wind, of speed v, that is normal to the cable, and a = |U_n|. Where the cable is along
    the wind the matrix is zero.

    Parameters
    ----------
    tangent : ndarray, shape (..., 3)
        Unit vectors t along the cable. [-]
    wind_direction : ndarray, shape (3,)
        Unit vector of the mean wind. [-]

    Returns
    -------
    ndarray, shape (..., 3, 3)
        The added force per length [N/m] is rho C_d d v times this matrix times the turbulence u' [m/s], with the
        density rho of the air, the drag coefficient C_d and the diameter d. [-]
    """
    normal_wind = wind_direction - tangent * (tangent @ wind_direction)[..., None]  # U_n/v
    a = np.sqrt((normal_wind**2).sum(axis=-1))[..., None, None]  # |U_n|/v
    unit = normal_wind / np.where(a > 0, a, 1.0)[..., 0]  # zero where the cable is along the wind
    across = np.eye(3) - tangent[..., :, None] * tangent[..., None, :]
    return a * (across + unit[..., :, None] * unit[..., None, :]) / 2


def body_damping(wind, area, drag_coefficient):
    """Viscous damping rho C_d A v of a body that moves along the mean wind v; zero if `wind` has no such damping.

    Parameters
    ----------
    wind : Wind
        Has speed v [m/s], air_density rho [kg/m^3] and aerodynamic_damping, a bool.
    area, drag_coefficient : float
        A and C_d of the body across the wind. [m^2], [-]

    Returns
    -------
    float
        [N s/m]

    Notes
    -----
    Drag rho/2 C_d A (v - x')^2, linearised in the velocity x' of the body: Simiu and Scanlan, Wind Effects on
    Structures (1996).
    """
    return wind.air_density * drag_coefficient * area * wind.speed if wind.aerodynamic_damping else 0.0


def cable_damping(wind, diameter):
    """Viscous damping per length of a cable's motion, rho C_d d v/2; zero if `wind` has no such damping.

    This is the damping of motion normal to the cable and to the wind; that of motion along the wind is twice as large.
    So motion of the cable in any direction is damped by no less, where the wind is across the cable.

    Parameters
    ----------
    wind : Wind
        Has speed, air_density, cable_drag_coefficient and aerodynamic_damping.
    diameter : float
        [m]

    Returns
    -------
    float
        [N s/m^2]
    """
    return body_damping(wind, diameter / 2, wind.cable_drag_coefficient)


def shedding_frequencies(wind, diameter):
    """Vortex shedding frequencies St v/d of a cable in a `Wind`: lowest, mean and highest. [Hz]

    At the mean speed, and at three standard deviations below (0 at least) and above it; the diameter in m.
    """
    speeds = (wind.speed + side * WIND.shedding_deviations * wind.turbulence for side in (-1, 0, 1))
    return tuple(STROUHAL * np.maximum(speed, 0.0) / diameter for speed in speeds)
