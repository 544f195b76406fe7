"""Spectra of the wind speed, aerodynamic admittance of a body, and spectra of the force on it.

One-sided spectra: their integral over f from 0 to infinity is the variance.
"""

from math import sqrt

import numpy as np

from cablestudy.wind.tolerances import WIND

# 4 B(1/2, 1/3)^2: with it the von Karman spectrum has exactly the variance that it is given
VON_KARMAN_EXACT = 70.78012763381717
# S v/(sigma^2 L) over x = f L/v, by the name that a scene states: `scene.wind_tables` lists the names
SPECTRA = {
    "von_karman": lambda x: 4 / (1 + 70.7 * x**2) ** (5 / 6),
    "von_karman_exact": lambda x: 4 / (1 + VON_KARMAN_EXACT * x**2) ** (5 / 6),
    "davenport": lambda x: 2 / 3 * x / (1 + x**2) ** (4 / 3),
    "kaimal": lambda x: 4 / (1 + 6 * x) ** (5 / 3),
}


def speed_spectrum(frequency, speed, rms, length_scale, kind="von_karman"):
    """One-sided spectrum S(f) of the longitudinal turbulence of the wind, shape (n,). [m^2/s^2/Hz]

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        > 0. [Hz]
    speed, rms, length_scale : float
        Mean speed v [m/s], RMS sigma of its fluctuation [m/s], integral length scale L [m].
    kind : str
        One of `SPECTRA`.

    Notes
    -----
    With x = f L/v, S v/(sigma^2 L) is:
    von Karman 4/(1 + 70.7 x^2)^(5/6), that of the paper that this program follows; its integral is 1.00057 sigma^2,
    exactly sigma^2 with 70.78.
    Davenport (1961) (2/3) x/(1 + x^2)^(4/3), for which L is 1200 m. Kaimal (IEC 61400-1) 4/(1 + 6 x)^(5/3).
    """
    time_scale = length_scale / speed
    return rms * rms * time_scale * SPECTRA[kind](frequency * time_scale)


def admittance(frequency, speed, area, kind="vickery"):
    """Aerodynamic admittance: share of the spectrum of the wind that acts on a whole body, shape (n,). [-]

    Small fast gusts do not cover a large body: the factor falls from 1 to 0 with frequency.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        f. [Hz]
    speed, area : float
        Mean speed v of the wind [m/s], area A of the body across it [m^2].
    kind : {"vickery", "vickery_squared", "none"}

    Notes
    -----
    chi = 1/(1 + (f/f_c)^(4/3)), f_c = v/(2 sqrt(A)): equation (7) of the paper that this program follows, to the first
    power or squared.
    """
    if kind == "none":
        return np.ones_like(frequency)
    inverse_corner = min(2 * sqrt(area) / speed, WIND.largest_power_base)  # 1/f_c
    chi = 1 / (1 + np.minimum(frequency * inverse_corner, WIND.largest_power_base) ** (4 / 3))
    return chi if kind == "vickery" else chi**2
