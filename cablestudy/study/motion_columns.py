"""Columns of the motion of a gondola, or of a cable with fixed ends, in the wind and under control: their functions.

Those of the loop and its winches are the same for one cable and for suspensions.
"""

from functools import partial
from math import hypot

import numpy as np

from cablestudy.cable.records import is_computed
from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.motion import peaks
from cablestudy.motion.tolerances import MOTION
from cablestudy.study.column import DIAMETER, MM, STRONG, UM, Column, first_without_value, scaled
from cablestudy.study.tolerances import STUDY
from cablestudy.system.tolerances import SYSTEM

WINCH = "gondola.mass, winch.controller"
DAMPING_RATIO = "gondola_damping_ratio"
GONDOLA_X = "gondola.x"  # outputs of `as_suspension`, with a gondola and without
MIDSPAN, TENSIONS = [f"cable.midspan.{axis}" for axis in "xyz"], ["cable.tension_from", "cable.tension_to"]
DRAG = "gondola.area, gondola.drag_coefficient, wind"
BODY = f"gondola.mass, {DRAG}"
ON_CABLE = f"gondola.mass, wind, {DIAMETER}"
# numbers of `control.margins.Margins` of one loop and of several -> unit, meaning
SENSITIVITY = {
    "sensitivity_peak": ("", "largest singular value of the sensitivity S = (I + L)^-1 over frequency; |1/(1 + L)| of "
                         "one loop"),
    "sensitivity_frequency": ("Hz", "frequency of the largest sensitivity"),
    "bandwidth": ("Hz", "first frequency at which the largest singular value of T = L (I + L)^-1 falls below "
                  "1/sqrt(2); empty where it never does"),
    "disk_margin": ("", "alpha: stable with each factor (1 + d/2)/(1 - d/2) of the loop gain, |d| < alpha; at most 2. "
                    "Of several loops a lower bound, for such factors of all at once, also coupled ones"),
    "disk_gain_margin": ("dB", "gains may grow or fall by less than this, those of several loops independently; empty "
                         "if without limit"),
    "disk_phase_margin": ("deg", "phases may change by less than this, those of several loops independently"),
}  # fmt: skip


def mean_displacement(results):
    """Displacement of each gondola along x by `force_on_gondola`: that over the static stiffness. [m]"""
    with np.errstate(divide="ignore"):  # of cases that have no equilibrium
        return results.force_on_gondola / results.slow_stiffness


def damping_ratio_of_gondola(case):
    """Damping ratio of the gondola's mode, and its relative error; refused where no mesh is as fine as it needs. [-]"""
    mode = case.gondola_mode
    if mode.damping.finest and not mode.damping.within(mode.accuracy):
        raise ConvergenceError(
            f"{DAMPING_RATIO}: estimated error {mode.damping.error:.1e}, asked for {mode.accuracy:g}: it needs all "
            f"modes of the cable, of which no mesh has more than {SYSTEM.damped_pole_freedoms}"
        )
    return mode.damping_ratio


def check_winch_speed(case):
    """Refuse numbers of the loop in the wind where its winch would have to be faster than it can: NoSolutionError."""
    winch = case.scene.winch
    if winch is None or winch.controller is None or winch.max_speed is None:
        return
    peak, _ = peaks.winch_speeds(case.analysis).peak
    if peak > winch.max_speed:
        raise NoSolutionError(
            f"the winch would reach {1e3 * peak:.4g} mm/s in the wind, above its max_speed of "
            f"{1e3 * winch.max_speed:.4g} mm/s: the linear numbers do not hold"
        )


def peak_of_gondola(case):
    """Expected largest displacement of a gondola [mm], and its estimated relative error."""
    check_winch_speed(case)
    return scaled(peaks.peak(case.analysis, [GONDOLA_X], float(mean_displacement(case))), MM)


def tension_columns():
    """The columns of the tension in the wind, on the gondola or, of a cable with fixed ends, on it: list of Column."""

    def column(name, unit, meaning, number, key=""):
        def compute(case):
            if case.scene.gondola is not None and (lacking := first_without_value(case.scene, BODY.split(", "))):
                raise NoSolutionError(f"{name} needs the key {lacking}, which this case does not have")
            return number(case)

        return Column(name, unit, f"{meaning}; linear", "wind", compute, f"wind, gondola.area|{DIAMETER}{key}",
                      any_error=True)  # fmt: skip

    by = "by the gondola's displacement, towards either side, or of a cable with fixed ends by the gusts on it"
    return [
        column("least_tension", "N", f"least tension expected at an end within wind.duration, {by}", least_tension),
        column("peak_utilisation", "", f"largest tension expected within wind.duration over breaking force, {by}",
               _peak_utilisation, f", {STRONG}"),
        column("slack_probability", "", f"probability that the tension at an end falls to zero within wind.duration, "
               f"{by}", _slack_probability),
    ]  # fmt: skip


def least_tension(case):
    """Least tension at an end that is expected within `wind.duration` [N], and its relative error."""
    tensions, changes, errors = _tensions_at_peak(case)
    end = min((0, -1), key=lambda end: tensions[end] - changes[end])
    least = float(tensions[end] - changes[end])
    error = float(errors[end] * changes[end] + case.statics_error * tensions[end])
    return least, max(error / abs(least), STUDY.rounding) if least else error


def _slack_probability(case):
    """Probability that the tension at an end falls to zero within `wind.duration`, and its relative error; linear.

    With fixed ends by the RMS of the tension there, in wind across the cable or along it, whichever is more probable.
    """
    if case.scene.gondola is None:
        ends = list(zip(TENSIONS, _tensions_at_ends(case), strict=True))
        winds = _in_winds_on_cable(case)
        return max(
            peaks.probability_of_change(wind, [name], mean, MOTION.crossings) for wind in winds for name, mean in ends
        )
    check_winch_speed(case)
    distance_error = case.error_by_drag(_distance_to_slack)
    return peaks.probability_of_change(
        case.analysis, [GONDOLA_X], _distance_to_slack(case), distance_error=distance_error
    )


def _distance_to_slack(case):
    """Displacement of a gondola from its mean along x at which the tension at an end falls to zero. [m]"""
    tensions, slopes = _tensions_and_slopes(case)
    with np.errstate(divide="ignore", invalid="ignore"):  # of an end that the gondola's displacement does not change
        return float((tensions / slopes)[[0, -1]].min()) - abs(float(mean_displacement(case)))


def _peak_utilisation(case):
    """Largest tension of the cable expected within `wind.duration` over the breaking force, and its relative error."""
    tensions, changes, errors = _tensions_at_peak(case)
    index = int(np.argmax(tensions + changes))
    largest = float(tensions[index] + changes[index])
    return largest / float(case.number(STRONG)), max(float(errors[index] * changes[index]) / largest, STUDY.rounding)


def _tensions_at_peak(case):
    """Tensions from end 1 to end 2, their largest changes in the wind [N], errors of these [-]: shape (j,) each.

    With a gondola the places are the ends, and both sides of point loads between them. The changes are by its largest
    displacement: linear and quasi-static, towards either side, since a scene of one cable does not say whether its wind
    blows towards end 1 or away from it. With fixed ends the places are these, and the changes those of each end in the
    wind across the cable or along it, whichever is larger.
    """
    if case.scene.gondola is None:
        winds = _in_winds_on_cable(case)
        peaks_in_winds = ([peaks.peak(wind, [name], crossings=MOTION.crossings) for wind in winds] for name in TENSIONS)
        return _tensions_at_ends(case), *np.transpose(list(map(max, peaks_in_winds)))
    (tensions, slopes), (peak, error) = _tensions_and_slopes(case), peak_of_gondola(case)
    return tensions, slopes * peak / MM, np.full(tensions.shape, error)


def _tensions_at_ends(case):
    """Tensions at end 1 and end 2 without gusts, shape (2,). [N]"""
    return case.form.edge_tensions.ravel()[[0, -1]]


def _in_winds_on_cable(case):
    """`DynamicAnalysis` of a cable with fixed ends in the wind across it, and along it: list."""
    accuracy = case.scene.model.accuracy or np.inf
    return [wind.to_accuracy(accuracy, TENSIONS)[1] for wind in case.in_cable_wind.each]


def _tensions_and_slopes(case):
    """Tensions as in `_tensions_at_peak`, and sizes of their changes per displacement of the gondola along x. [N/m]"""
    results, index = case.statics_of_model
    tensions, slopes = (of_all[index] for of_all in results.tensions_by_end_2)
    return tensions.ravel(), slopes.ravel()


def goes_slack(case):
    """True if the least tension of a `CableCase` in the wind is below zero; False where its RMS was not computed."""
    winds = [] if case.scene.wind is None else case.solved_winds
    solved = winds and (case.scene.gondola is None or (is_computed(case, "analysis") and case.analysis in winds))
    try:
        return bool(solved and least_tension(case)[0] < 0)
    except CablestudyError:  # a winch that would be too fast, for example: the columns of the wind say why
        return False


def imaged_column(name, meaning, keys):
    """Column of the gondola's motion in a telescope's image, with exposure time or correction as `name` says."""

    def compute(case):
        check_winch_speed(case)
        return scaled(case.analysis.rms([GONDOLA_X], name, open_loop=False), UM)

    return Column(name, "um", meaning, "wind", compute, f"{BODY}, {keys}")


def loop_columns(keys):
    """Make the result columns of the winch loop, such as its gain and its margins.

    They serve scenes of one cable and suspensions. Their functions take a case with the attribute `analysis`, and
    return a number and its estimated relative error.

    Parameters
    ----------
    keys : str
        Keys that a scene must state for these columns, separated by commas.

    Returns
    -------
    list of Column
    """
    properties = {
        "gain": ("rad/s", "integral gain of the loop of the winches, as stated or as it follows from a margin"),
        "largest_gain": ("rad/s", "integral gain below which the loop is stable, proportional and derivative gain in "
                         "proportion; empty when it always is"),
        "gain_margin": ("dB", "largest stable gain over the gain, of all winches together; empty when there is no "
                        "limit"),
        "phase_crossover": ("Hz", "frequency at which the largest gain puts a pole of the loop on the imaginary axis: "
                            "that of the gain margin"),
    }  # fmt: skip
    margins = {
        "phase_margin": ("deg", "least angle to instability where the loop gain is one: of several coordinates where "
                         "one of its eigenvalues has the size 1"),
        "gain_crossover": ("Hz", "frequency at which the loop gain is one: that of the phase margin"),
        "delay_margin": ("s", "least further delay in the loop of all winches that makes it unstable"),
        **SENSITIVITY,
    }  # fmt: skip

    def number(case, name):
        return case.analysis.margin(name) if name in margins else getattr(case.analysis, name)

    return [
        Column(name, unit, meaning, "loop", partial(number, name=name), keys)
        for name, (unit, meaning) in (properties | margins).items()
    ]


def winch_columns(keys):
    """The columns of the speed of the winches in the wind, as `loop_columns`."""

    def rms(case):
        return scaled(peaks.winch_speeds(case.analysis).rms, MM)

    def peak(case):
        return scaled(peaks.winch_speeds(case.analysis).peak, MM)

    of_rms = "RMS of the speed of the winches in the wind, that of the fastest one"
    of_peak = "largest speed of any winch expected within wind.duration"
    return [
        Column("winch_rms_speed", "mm/s", of_rms, "wind", rms, keys),
        Column("winch_peak_speed", "mm/s", of_peak, "wind", peak, keys),
    ]


def rms_columns(suffix, words, key, *winds):
    """Yield the columns of the gondola's RMS in one wind or several: of displacement and velocity, in loop and at rest.

    `suffix` and `words` are the parts of their names and meanings for the wind; `winds` names of `CableCase`'s.
    """
    loops = (False, "with the winch loop", f"{key}, winch.controller"), (True, "the winch at rest", key)
    for at_rest, loop, keys in loops:
        for quantity, variance, unit in (("displacement", "value", "mm"), ("velocity", "rate", "mm/s")):
            compute = partial(_rms_in_winds, winds=winds, variance=variance, at_rest=at_rest)
            name = "gondola_rms" + ("_velocity" if unit == "mm/s" else "") + ("_open_loop" if at_rest else "") + suffix
            meaning = f"RMS {quantity} of the gondola along x {words}, {loop}"
            yield Column(name, unit, meaning, "wind", compute, keys)


def _rms_in_winds(case, winds, variance, at_rest):
    """RMS of the gondola along x [mm] or [mm/s], and its relative error; winds are independent: variances add."""
    if not at_rest:
        check_winch_speed(case)
    pairs = [getattr(case, wind).rms([GONDOLA_X], variance, at_rest) for wind in winds]
    total, error = pairs[0]
    if len(pairs) > 1:
        total = hypot(*(rms for rms, _ in pairs))
        error = sum(error * (rms / total) ** 2 for rms, error in pairs) if total else 0.0
    return MM * total, error


def rms_of_bare_cable(case, names):
    """Largest RMS of some outputs of a bare cable over the directions of the wind, and its relative error."""
    return case.in_cable_wind.to_accuracy(case.scene.model.accuracy or np.inf, names)[0]
