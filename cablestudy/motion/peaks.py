"""Largest values that outputs of a `DynamicAnalysis`, and the speeds of its winches, are expected to reach in the wind.

    |mean| + g(n, T) RMS,   n = RMS of the rate of change/(2 pi RMS)

g is Davenport's peak factor (`wind.peak`) for the rate n of up-crossings of the mean in a time T.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.motion.tolerances import MOTION
from cablestudy.system.comparison import error_of_root
from cablestudy.wind.peak import peak_factor, probability_beyond


def peak(analysis, names, mean=0.0, crossings=0.0, mean_error=0.0):
    """Estimate the largest size that some outputs together reach in the wind, |mean| + g(n, T) RMS.

    Parameters
    ----------
    analysis : DynamicAnalysis
        With wind, whose duration is T.
    names : sequence of str
        Names of the outputs, of equal units. RMS is the root of the sum of their variances, with the loop closed.
    mean : float
        Their mean value, in their unit.
    crossings : float
        Lower bound on the relative error of n, the rate at which the mean is crossed. [-]
    mean_error : float
        Relative error of the mean value. [-]

    Returns
    -------
    largest, error : float
        Largest size, in the unit of the outputs, and its estimated relative error [-].
    """
    rms, error, rate, rate_error = _rms_and_crossings(analysis, names, crossings)
    if not rms:
        return abs(mean), error + mean_error
    change, error = _expected_peak(rms, rate, error, rate_error, analysis.scene.wind.duration)
    largest = abs(mean) + change
    return largest, (error * change + mean_error * abs(mean)) / largest


def peak_of_change(analysis, names):
    """Largest change from their mean that some outputs together are expected to have in the wind, g RMS.

    Its error, which takes long for tensions, is not computed.
    """
    rms, rms_rate = (np.sqrt(analysis.sum_of_variances(names, variance)) for variance in ("value", "rate"))
    return peak_factor(rms_rate / (2 * np.pi * rms), analysis.scene.wind.duration) * rms if rms else rms


def probability_of_change(analysis, names, distance, crossings=0.0, distance_error=0.0):
    """Probability that some outputs together move from their mean by a distance, to one side, in `wind.duration`.

    Parameters
    ----------
    analysis, names, crossings
        As of `peak`.
    distance : float
        In the unit of the outputs.
    distance_error : float
        Its relative error. [-]

    Returns
    -------
    probability, error : float
        And its estimated relative error. [-]
    """
    rms, error, rate, rate_error = _rms_and_crossings(analysis, names, crossings)
    if not rms:
        return float(distance <= 0), error
    level, duration = distance / rms, analysis.scene.wind.duration
    probability = probability_beyond(level, rate, duration)
    change = abs(level) * (error + distance_error) if np.isfinite(level) else 0.0
    largest = probability_beyond(level - change, rate * (1 + rate_error), duration)
    least = probability_beyond(level + change, rate / (1 + rate_error), duration)
    error = max(largest - probability, probability - least)  # near one it may hardly be larger
    return probability, error / probability if probability else float(largest > 0)


@dataclass(frozen=True)
class WinchSpeeds:
    """Speeds of the winches in the wind.

    Attributes
    ----------
    rms, peak : (float, float)
        Largest RMS, and largest expected peak g(n, T) RMS, of all winches [m/s], with estimated relative errors [-].
    fastest : int
        Number of the winch with the largest peak, from 0.
    """

    rms: tuple
    peak: tuple
    fastest: int


def winch_speeds(analysis):
    """Largest RMS and largest expected peak of the speeds of all winches in the wind: `WinchSpeeds`.

    Both are zero where no loop moves the winches.

    Parameters
    ----------
    analysis : DynamicAnalysis
        With wind.

    Raises
    ------
    NoSolutionError, ConvergenceError
        What moves is unstable, or the variances cannot be computed.
    """
    response = analysis.response
    if response.loop is None:
        return WinchSpeeds((0.0, 0.0), (0.0, 0.0), 0)
    variances, errors = response.winch_speeds
    divisor = np.where(variances > 0, variances, 1.0)
    (rms, rms_rate), (error, rate_error) = np.sqrt(variances), error_of_root(errors / divisor)
    plant, left_out = response.closed_loop.plant, response.in_wind.left_out_modes
    if response.in_wind.gusts.strips:  # these excite modes above the model's, each of which moves a winch or two
        rate_error = (1.0 if plant.responses or plant.driven else MOTION.one_model_safety) * rate_error.max()
    crossings_error = np.maximum(rate_error + error, MOTION.crossings if left_out.unknown else 0.0)
    rate, duration = rms_rate / (2 * np.pi * np.sqrt(divisor[0])), analysis.scene.wind.duration
    peaks, peak_errors = _expected_peak(rms, rate, error, crossings_error, duration)
    largest, fastest = int(np.argmax(rms)), int(np.argmax(peaks))
    known = 0.0 if analysis.sizes.error_known else np.nan
    return WinchSpeeds(
        rms=(float(rms[largest]), error[largest] + known),
        peak=(float(peaks[fastest]), peak_errors[fastest] + known),
        fastest=fastest,
    )


def _rms_and_crossings(analysis, names, crossings):
    """RMS of some outputs together and the rate at which they cross their mean upwards [Hz], each with relative error.

    Arguments are those of `peak`; the rate of outputs that are held is 0.
    """
    rms, error = analysis.rms(names, "value", open_loop=False)
    if not rms:
        return rms, error, 0.0, crossings
    rms_rate, rate_error = analysis.rms(names, "rate", open_loop=False)
    return rms, error, rms_rate / (2 * np.pi * rms), max(rate_error + error, crossings)


def _expected_peak(rms, rate, error, rate_error, duration):
    """Peak factor times RMS in a `duration` [s], and its relative error; `rate` is that of up-crossings [Hz].

    `error` and `rate_error` are the relative errors of RMS and rate.
    """
    factor = peak_factor(rate, duration)
    return factor * rms, error + peak_factor(rate * (1 + rate_error), duration) / factor - 1
