"""The largest value that a random motion is expected to reach within some time, and how probable a given one is."""

from math import erfc, exp, expm1, sqrt

import numpy as np

from cablestudy.wind.tolerances import WIND

LEAST_CROSSINGS = np.e  # of fewer the factor of the formula grows again


def peak_factor(rate, duration):
    """Davenport's peak factor of a random motion: its expected largest value within some time, divided by its RMS.

    The motion is a stationary Gaussian process of zero mean.

    Parameters
    ----------
    rate : float or ndarray
        Expected up-crossings of zero per time, RMS velocity/(2 pi RMS displacement). [Hz]
    duration : float or ndarray
        The time. [s]

    Returns
    -------
    float or ndarray
        g = sqrt(2 ln n) + 0.5772/sqrt(2 ln n), n = rate x duration. Fewer than e crossings count as e, so that g is at
        least 1.82: the formula holds for many crossings and is infinite at n = 1. So g never falls with the duration,
        and for a time that is too short for a crossing it is on the safe side. [-]

    Notes
    -----
    Davenport, Note on the distribution of the largest value of a random function with application to gust loading,
    Proc. Institution of Civil Engineers 28 (1964) 187-196. It takes crossings as independent. Those of a lightly damped
    motion come in clusters, and its largest value is smaller.
    """
    with np.errstate(divide="ignore"):
        crossings = np.log(rate) + np.log(duration)  # their product might overflow
    mode = np.sqrt(2 * np.maximum(crossings, np.log(LEAST_CROSSINGS)))
    return mode + np.euler_gamma / mode


def probability_beyond(level, rate, duration):
    """Probability that a random motion goes beyond a level, to one side, at some moment within some time.

    The motion is a stationary Gaussian process of zero mean.

    Parameters
    ----------
    level : float
        Over the RMS; below zero where the mean is beyond already. [-]
    rate : float
        Expected up-crossings of zero per time, as in `peak_factor`. [Hz]
    duration : float
        The time. [s]

    Returns
    -------
    float
        1 - Phi(a) exp(-n exp(-a^2/2)), n = rate x duration: Phi(a) is the probability to begin below the level a, and
        n exp(-a^2/2) the expected number of its up-crossings. [-]

    Notes
    -----
    Rice, Mathematical analysis of random noise, Bell System Technical Journal 24 (1945), section 3.3, for the rate of
    crossings. They are taken as independent: those of a lightly damped motion come in clusters, and the probability is
    smaller.
    """
    level = min(max(level, -WIND.highest_level), WIND.highest_level)
    beyond, below = (erfc(sign * level / sqrt(2)) / 2 for sign in (1, -1))  # at the beginning
    return beyond - below * expm1(-rate * duration * exp(-(level**2) / 2))
