"""Columns of a suspension in the wind and under control: of bodies, markers, cables, actuators and the loop.

Their names are an owner, a dot and a quantity: `gondola.rms_x`, `gondola.focus.peak`, `n1.least_tension`.
"""

from dataclasses import replace

import numpy as np

from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.motion import peaks
from cablestudy.motion.tolerances import MOTION
from cablestudy.study.column import MM, UM, Column, scaled
from cablestudy.study.motion_columns import loop_columns, winch_columns

DISPLACEMENTS, TURNS = ("x", "y", "z"), ("rx", "ry", "rz")
STATES = {"": "", "_open_loop": ", the winches at rest"}
ENDS = ("tension_from", "tension_to")


# ------------------------------------------------------------------------------------ RMS of outputs, by their names


def _rms(case, names, variance="value", state=""):
    """RMS of some outputs together, and its relative error, see `DynamicAnalysis.rms`; by its `state` of `STATES`."""
    return _analysis(case, names).rms(names, variance, open_loop=bool(state))


def _analysis(case, names):
    """`DynamicAnalysis` of a case for the motion of a body, or of a free point, of which some outputs are."""
    return case.analysis.with_points if names[0].partition(".")[0] in case.scene.points else case.analysis


# ------------------------------------------------------------------------------------------- of bodies and markers


def displacement_columns(name):
    """Columns of the motion in the wind of a body (its reference point), a marker BODY.MARKER or a free point: list.

    * `mean_x`, `mean_y`, `mean_z`: displacement by the mean wind, the winches at rest;
    * `rms_x`, `rms_y`, `rms_z`, `rms`, `rms_velocity`: by gusts, with the loop, and `..._open_loop`: the winches at
      rest;
    * `peak`: the largest displacement that is expected, mean and gusts together;
    * `exposure`, `corrected`, `corrected_exposure`: RMS of what a telescope sees, within an exposure time, behind a
      correcting mirror, or both.

    Parameters
    ----------
    name : str
        With a dot before each of these it is the name of a column, such as `gondola.rms_x`.
    """
    outputs = [f"{name}.{axis}" for axis in DISPLACEMENTS]

    def rms(axes, unit, state, variance="value"):
        return lambda case: scaled(_rms(case, axes, variance, state), unit)

    def mean(axis):
        return lambda case: scaled(case.mean_displacement(name, axis), MM)

    def peak(case):
        means, errors = np.transpose([case.mean_displacement(name, axis) for axis in range(len(DISPLACEMENTS))])
        mean = np.linalg.norm(means)
        mean_error = np.linalg.norm(means * errors) / mean if mean else 0.0
        return scaled(peaks.peak(_analysis(case, outputs), outputs, mean, mean_error=mean_error), MM)

    def image_motion(variance, *keys):
        """Function of a case: the RMS that a telescope sees, which needs some keys of the scene."""

        def compute(case):
            for key in keys:
                if getattr(case.scene, key) is None:
                    raise NoSolutionError(f"{name}.{key} needs the key {key}, which this case does not have")
            return scaled(_rms(case, outputs, variance), UM)

        return compute

    columns = [
        Column(f"{name}.mean_{axis}", "mm", f"displacement by the mean wind along {axis}, the winches at rest", "wind",
               mean(number), "wind", follows_drag=True)
        for number, axis in enumerate(DISPLACEMENTS)
    ]  # fmt: skip
    for state, words in STATES.items():
        columns += [
            Column(f"{name}.rms_{axis}{state}", "mm", f"RMS displacement along {axis}{words}", "wind",
                   rms([output], MM, state), "wind")
            for axis, output in zip(DISPLACEMENTS, outputs, strict=True)
        ]  # fmt: skip
        columns += [
            Column(f"{name}.rms{state}", "mm", f"RMS displacement, of x, y and z together{words}", "wind",
                   rms(outputs, MM, state), "wind"),
            Column(f"{name}.rms_velocity{state}", "mm/s", f"RMS velocity, of x, y and z together{words}", "wind",
                   rms(outputs, MM, state, "rate"), "wind"),
        ]  # fmt: skip
    return [
        *columns,
        Column(f"{name}.peak", "mm", "mean displacement and peak factor times RMS (Davenport)", "wind", peak, "wind"),
        Column(f"{name}.exposure", "um", "RMS motion within one exposure", "wind", image_motion("exposure", "exposure"),
               "wind, exposure"),
        Column(f"{name}.corrected", "um", "RMS motion that is left after correction by the mirror", "wind",
               image_motion("corrected", "correction"), "wind, correction"),
        Column(f"{name}.corrected_exposure", "um", "RMS motion within one exposure behind the mirror", "wind",
               image_motion("corrected_exposure", "exposure", "correction"), "wind, exposure, correction"),
    ]  # fmt: skip


def peak_along(case, name, axis):
    """Largest expected displacement of a body along x, y or z (0, 1, 2), the mean one included. [mm]"""
    return MM * peaks.peak(case.analysis, [f"{name}.{DISPLACEMENTS[axis]}"], case.mean_displacement(name, axis)[0])[0]


def rotation_columns(name):
    """The columns of the rotation of a body: list of Column."""

    def rms(axis, state):
        return lambda case: scaled(_rms(case, [f"{name}.{axis}"], "value", state), 1e6)

    return [
        Column(f"{name}.rms_{axis}{state}", "urad", f"RMS rotation about {axis[1]}{words}", "wind", rms(axis, state),
               "wind")
        for state, words in STATES.items()
        for axis in TURNS
    ]  # fmt: skip


# ----------------------------------------------------------------------------------------- of cables and actuators


def tension_columns(name):
    """The columns of a cable: list of Column."""

    def rms(case):
        return case.analysis.largest_rms([f"{name}.{end}" for end in ENDS])

    def slack_probability(case):
        means, error = case.analysis.mean_tensions(name), _error_of_mean_tensions(case)
        pairs = (
            peaks.probability_of_change(case.analysis, [f"{name}.{end}"], mean, MOTION.crossings, error)
            for mean, end in zip(means, ENDS, strict=True)
        )
        return max(pairs, key=lambda pair: pair[0])

    def utilisation(case):
        tension, error = tension_at_peak(case, name, 1)
        return tension / case.scene.cables[name].section_breaking_force, error

    return [
        Column(f"{name}.rms_tension", "N", "RMS tension, the larger one of both ends", "wind", rms, "wind"),
        Column(f"{name}.least_tension", "N", "mean less peak factor times RMS, the smaller one of both ends; below "
               "zero it goes slack", "wind", lambda case: tension_at_peak(case, name, -1), "wind"),
        Column(f"{name}.peak_utilisation", "", "mean and peak factor times RMS of the tension, the larger one of both "
               "ends, over breaking force", "wind", utilisation, f"wind, cables.{name}.section_breaking_force"),
        Column(f"{name}.slack_probability", "", "probability that the tension at an end falls to zero within "
               "wind.duration, that of the more probable end", "wind", slack_probability, "wind"),
    ]  # fmt: skip


def tension_at_peak(case, name, sign):
    """Mean tension of a cable plus `sign` times peak factor and RMS, and its relative error. [N]

    The largest one of both ends with a `sign` of 1, the least one with -1.
    """
    tensions, by_statics = [], _error_of_mean_tensions(case)
    for mean, end in zip(case.analysis.mean_tensions(name), ENDS, strict=True):
        change, error = peaks.peak(case.analysis, [f"{name}.{end}"], crossings=MOTION.crossings)
        tension = mean + sign * change
        tensions.append((tension, (error * change + by_statics * mean) / abs(tension) if tension else error))
    return max(tensions, key=lambda pair: sign * pair[0])


def _error_of_mean_tensions(case):
    """Relative error of tensions in the mean wind. [-]"""
    return case.statics_error(None) + case.group.motion_errors[case.index]


def midspan_column(name):
    """The column of the RMS displacement of a cable at mid-span, which needs outputs that the others do not."""

    def rms(case):
        return scaled(case.analysis.with_midspans.largest_rms([f"{name}.midspan.{axis}" for axis in DISPLACEMENTS]), MM)

    meaning = "RMS displacement at mid-span, in the direction that moves most"
    return Column(f"{name}.midspan_rms", "mm", meaning, "wind", rms, "wind")


def slackened(case):
    """Names of the cables whose least tension in the wind is below zero; none where it cannot be computed."""
    if case.scene.wind is None:
        return []
    try:
        return [name for name in case.scene.cables if _goes_slack(case.analysis, name)]
    except CablestudyError:  # the columns of the wind say why
        return []


def _goes_slack(analysis, name):
    """True if the least tension of a cable by a `DynamicAnalysis`, mean less peak of change, is below zero."""
    means = zip(analysis.mean_tensions(name), ENDS, strict=True)
    return any(mean < peaks.peak_of_change(analysis, [f"{name}.{end}"]) for mean, end in means)


def _max_peak_utilisation(case):
    """Largest `peak_utilisation` of the cables whose breaking force is known, and its relative error."""
    names = [name for name, cable in case.scene.cables.items() if cable.section_breaking_force is not None]
    if not names:
        raise NoSolutionError("max_peak_utilisation needs the strength or breaking_force of a cable, and none has it")
    return max((tension_columns(name)[2].compute(case) for name in names), key=lambda pair: pair[0])


PEAK_UTILISATION = Column(
    "max_peak_utilisation", "", "largest peak_utilisation of any cable", "wind", _max_peak_utilisation, "wind"
)


QUANTITIES = {
    "stroke": ("mm", MM, "displacement of the mass to the body"),
    "force": ("N", 1.0, "force of the actuator"),
    "momentum": ("Nms", 1.0, "angular momentum of the wheel"),
    "torque": ("Nm", 1.0, "torque on the wheel"),
}


def actuator_columns(name, wheel=None):
    """The columns of a reaction mass or wheel; of both where `wheel` is None: list of Column."""
    quantities = {None: tuple(QUANTITIES), True: ("momentum", "torque"), False: ("stroke", "force")}[wheel]

    def rms(quantity, unit):
        return lambda case: scaled(_rms(case, [_directed(case, f"{name}.{quantity}")]), unit)

    def peak(quantity, unit):
        return lambda case: scaled(peaks.peak(case.analysis, [f"{name}.{quantity}"]), unit)

    columns = []
    for quantity in quantities:
        unit, scale, meaning = QUANTITIES[quantity]
        columns += [
            Column(f"{name}.rms_{quantity}", unit, f"RMS {meaning}", "wind", rms(quantity, scale), "wind"),
            Column(f"{name}.peak_{quantity}", unit, f"expected peak: {meaning}", "wind", peak(quantity, scale), "wind"),
        ]
    return columns


def _directed(case, output):
    """The name of an output; refused, by NoSolutionError, is the force of a link whose two ends coincide."""
    names, link = list(case.scene.links), output.rpartition(".")[0]
    if link in names and not case.equilibrium.links.direction[names.index(link)].any():
        raise NoSolutionError(f"{link}: its two places are one, so that its force has no direction")
    return output


def link_force_column(name):
    """The column of the force of a link, named and computed as that of an actuator."""
    column = next(column for column in actuator_columns(name) if column.name == f"{name}.rms_force")
    return replace(column, meaning="RMS force along the link, spring and dashpot together")


def wind_columns_of(scene, name):
    """The columns of a body, BODY.MARKER, free point, cable, link or actuator in the wind: list, empty for other names.

    Parameters
    ----------
    scene : SuspensionScene
    name : str
    """
    body, _, marker = name.partition(".")
    if body in scene.bodies and marker in ("", *scene.bodies[body].markers):
        return displacement_columns(name) + ([] if marker else rotation_columns(name))
    if name in scene.points and scene.points[name].free:
        return displacement_columns(name)
    if name in scene.cables:
        return [*tension_columns(name), midspan_column(name)]
    if name in scene.links:
        return [link_force_column(name)]
    return actuator_columns(name, hasattr(scene.actuators[name], "torque")) if name in scene.actuators else []


def exceeded_limits(case):
    """Find limits of winches and actuators that are exceeded by the peaks expected in the wind.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    dict
        Name of the limit, `control.max_speed` of the winches or ACTUATOR.QUANTITY (stroke, force, momentum, torque) ->
        text of a warning with the peak and the limit.
    """
    exceeded, control = {}, case.scene.control
    if control is not None and control.max_speed is not None:
        speeds = peaks.winch_speeds(case.analysis)
        peak, _ = speeds.peak
        if peak > control.max_speed:
            name = list(case.scene.winches)[speeds.fastest]
            exceeded["control.max_speed"] = (
                f"the winch of {name} would reach {MM * peak:.4g} mm/s in the wind, above max_speed of "
                f"{MM * control.max_speed:.4g} mm/s"
            )
    for name, table in case.scene.actuators.items():
        for quantity in ("stroke", "force", "momentum", "torque"):
            limit = getattr(table, quantity, None)
            if limit is None:
                continue
            unit, scale, _ = QUANTITIES[quantity]
            peak, _ = peaks.peak(case.analysis, [f"{name}.{quantity}"])
            if peak > limit:
                exceeded[f"{name}.{quantity}"] = (
                    f"{name}: its {quantity} reaches {scale * peak:.4g} {unit}, above its limit of {scale * limit:.4g}"
                )
    return exceeded


# ------------------------------------------------------------------------------------------------------ of the loop


WINCHES = tuple(winch_columns("wind, control"))
LOOP = tuple(loop_columns("control"))
