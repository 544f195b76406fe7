"""Factors of the spectrum of a motion with which a telescope sees it: within an exposure, behind a correcting mirror.

Both are factors of the variance at each frequency, so their product holds for exposures behind a mirror.
"""

from math import pi

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.wind.tolerances import WIND


def exposure_weight(frequency, exposure):
    """Share of the variance, at each frequency, that is motion within one exposure: 1 - (sin x/x)^2, x = pi f t.

    It is the variance about the mean of each exposure, averaged over exposures that begin at any time: the motion that
    blurs an image.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        f. [Hz]
    exposure : float
        Duration t of the exposure. [s]

    Returns
    -------
    ndarray, shape (m,)
        [-]

    Notes
    -----
    Martin, Image motion as a measure of seeing quality, PASP 99 (1987) 1360-1370: the mean of an exposure keeps
    (sin x/x)^2.
    """
    phase = pi * exposure * np.asarray(frequency, dtype=float)
    fast = np.maximum(phase, WIND.series_phase)  # small phases, at which the difference cancels, follow from a series
    square = np.minimum(phase, WIND.series_phase) ** 2
    # 1 - sin^2(x)/x^2 is the sum of (-1)^k 2^(2k - 1) x^(2k - 2)/(2k)! over k from 2
    series, factor = np.zeros_like(square), np.ones_like(square)
    for k in range(2, 2 + WIND.series_terms):
        factor = factor * square * (1.0 if k == 2 else -1.0) * 4 / ((2 * k) * (2 * k - 1))
        series = series + factor
    return np.where(phase < WIND.series_phase, series, 1 - (np.sin(fast) / fast) ** 2)


def correction_weight(frequency, bandwidth, delay):
    """Share of the variance, at each frequency, that a correcting mirror leaves: |1/(1 + L)|^2.

    The mirror follows the motion by an integrating loop with a delay: L = (2 pi bandwidth/s) exp(-s delay), where
    s = 2 pi i f.

    Parameters
    ----------
    frequency : ndarray, shape (m,)
        f. [Hz]
    bandwidth : float
        Frequency at which |L| = 1. [Hz]
    delay : float
        [s]

    Returns
    -------
    ndarray, shape (m,)
        Above 1 where the mirror amplifies. [-]

    Raises
    ------
    NoSolutionError
        The mirror is unstable: 2 pi bandwidth delay >= pi/2, where the phase of L reaches -180 degrees at |L| = 1.
    """
    check_mirror(bandwidth, delay)
    frequency = np.asarray(frequency, dtype=float)
    # |s + w exp(-s delay)|^2 = (f - b)^2 + 2 f b (1 - sin(2 pi f delay)), times (2 pi)^2; the last factor as a square
    lag = np.sin(pi / 4 - pi * frequency * delay) ** 2
    scale = np.maximum(frequency, bandwidth)  # squares of frequencies over it do not overflow
    f, b = frequency / scale, bandwidth / scale
    return f**2 / ((f - b) ** 2 + 4 * f * b * lag)


def image_weights(exposure=None, correction=None):
    """Factors that turn the spectrum of a motion into that of the motion seen in the images of a telescope.

    Parameters
    ----------
    exposure : float, optional
        Duration of an exposure. [s]
    correction : Correction, optional
        Correcting mirror: has bandwidth [Hz] and delay [s].

    Returns
    -------
    dict
        Name -> factor, a function of frequencies [Hz]. `exposure`: motion within one exposure; `corrected`: motion left
        by the mirror; `corrected_exposure`: both. Names whose argument is None are missing.
    """
    weights = {}
    if exposure is not None:
        weights["exposure"] = lambda frequency: exposure_weight(frequency, exposure)
    if correction is not None:
        weights["corrected"] = lambda frequency: correction_weight(frequency, correction.bandwidth, correction.delay)
    if len(weights) == 2:
        exposed, corrected = weights.values()
        weights["corrected_exposure"] = lambda frequency: exposed(frequency) * corrected(frequency)
    return weights


def check_mirror(bandwidth, delay):
    """Refuse an integrating mirror whose loop is unstable; bandwidth in Hz, delay in s.

    Raises
    ------
    NoSolutionError
    """
    if 4 * bandwidth * delay >= 1:
        raise NoSolutionError(
            f"correction: a mirror of {bandwidth:.4g} Hz is unstable with a delay of {delay:.4g} s: "
            f"its bandwidth must be below 1/(4 delay) = {0.25 / delay:.4g} Hz"
        )
