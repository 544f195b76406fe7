"""Response of a loop of winches in time, for the command `loop`: its options, input and table."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control import time_response
from cablestudy.control.step_response import step_response
from cablestudy.errors import SceneError
from cablestudy.motion.response_in_time import WIND_INPUT, in_time, unit_of
from cablestudy.scene.units import read_positive
from cablestudy.study.column import require
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.ssm import has_loss_factor, number_of
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

OF_WIND = ("gust", "wind")
MILLI = 1e3


@dataclass(frozen=True)
class TimeOptions:
    """Options of the command `loop` for a response in time, as texts, and their values.

    Raises
    ------
    SceneError
        An option is wrong, or has no effect.
    """

    duration: str  # DURATION, or DURATION:COUNT
    input: str | None = None
    size: str | None = None
    length: str | None = None  # of a gust
    output: str | None = None  # measured coordinate that is shown

    def __post_init__(self):
        if self.length is not None and self.input != "gust":
            raise SceneError("--length: no effect: only --input gust has a length")
        _ = self.times, self.stated_length  # computed here, so that a wrong option raises SceneError immediately

    @cached_property
    def times(self):
        """Uniform times from zero, of which every `every`-th is in the table. [s]"""
        return np.linspace(0.0, self._end_and_count[0], (self._end_and_count[1] - 1) * self.every + 1)

    @cached_property
    def every(self):
        """Steps of time from one row of the table to the next."""
        return -(-STUDY.fine_time_steps // (self._end_and_count[1] - 1))

    @cached_property
    def _end_and_count(self):
        """Last point of time [s] and number of rows of the table."""
        text, colon, count = self.duration.partition(":")
        option = f"--time {self.duration}"
        end = within(option, read_positive(option, text, "s"), STUDY.durations, "s")
        if colon and not (re.fullmatch("[0-9]{1,9}", count.strip()) and 2 <= int(count) <= STUDY.most_time_points):
            raise SceneError(f"{option}: COUNT must be a whole number from 2 to {STUDY.most_time_points}")
        return end, int(count) if colon else STUDY.time_points

    def size_or(self, default, unit):
        """Size that --size states in a unit, or a default."""
        if self.size is None:
            return default
        option = f"--size {self.size}"
        return within(option, read_positive(option, self.size, unit), STUDY.sizes, unit)

    @cached_property
    def stated_length(self):
        """Length of a gust that --length states, or None. [s]"""
        return None if self.length is None else read_positive(f"--length {self.length}", self.length, "s")

    def gust(self, wind, turbulence):
        """`Input` of a gust or step of the wind, with the standard deviation of the turbulence [m/s]."""
        size = self.size_or(STUDY.gust_deviations * turbulence, "m/s")
        if not size:
            raise SceneError(f"--input {self.input}: the wind has no turbulence: give --size")
        if self.input == "wind":
            return Input(f"the wind rises by {size:.4g} m/s at once", "m/s", *_step(size, self.times))
        length = self.stated_length or wind.length_scale / wind.speed
        within("--length of the gust", length, [bound * self.times[-1] for bound in STUDY.gust_lengths], "s")
        description, phase = f"a 1-cosine gust of {size:.4g} m/s within {length:.4g} s", self.times / length
        values = np.where(phase < 1, size / 2 * (1 - np.cos(2 * np.pi * phase)), 0.0)
        return Input(description, "m/s", size, time_response.gust(1.0, length), values)

    def step(self, moving_part, unit="m"):
        """`Input` of a step of a displacement [m], or a rotation [rad], of a part that `moving_part` names."""
        size = self.size_or(STUDY.winch_step, unit)
        return Input(f"{moving_part} by {MILLI * size:.4g} m{unit} at once", f"m{unit}", *_step(size, self.times))


def _step(size, times):
    """`size`, `components` and `values` of an `Input` that is a step."""
    return size, time_response.step(1.0), np.full(len(times), size)


def within(option, value, bounds, unit):
    """A value of an option; SceneError where it is not within two bounds."""
    if not bounds[0] <= value <= bounds[1]:
        raise SceneError(f"{option}: {value:g} {unit} is not from {bounds[0]:g} to {bounds[1]:g} {unit}")
    return value


@dataclass(frozen=True)
class Input:
    """Input that drives a loop."""

    what: str  # in words
    unit: str  # for tables and pictures: mm, mrad or m/s
    size: float  # of the step or gust [m], [rad] or [m/s]
    components: list  # of time_response.Component: the input with a size of one, as a sum of functions of time
    values: np.ndarray  # at the points of time, shape (m,) [m], [rad] or [m/s]

    @property
    def values_in_unit(self):
        """The input at the points of time in `unit`, shape (m,)."""
        return self.values * (MILLI if self.unit != "m/s" else 1.0)


@dataclass(frozen=True)
class TimeCase:
    """Response in time of a control loop to one input, for the table and the picture of the command `loop`."""

    options: TimeOptions
    input: Input
    response: object  # `TimeResponse`
    gain: float  # of the loop [rad/s]
    name: str  # of the measured coordinate
    unit: str  # of it in tables: mm or mrad
    winches: tuple  # their names
    remarks: tuple  # on approximations, and warnings: texts
    delayed: bool  # whether a delay is approximated

    @property
    def time(self):
        """Points of time, shape (m,). [s]"""
        return self.options.times

    @property
    def busiest(self):
        """Number of the winch that moves most."""
        return int(np.abs(self.response.winch).max(axis=0).argmax())

    @cached_property
    def step(self):
        """`StepResponse` of the measured coordinate; None in a gust, without a loop, or where nothing moves."""
        final = None if self.options.input == "gust" else self.response.final
        return None if final is None else step_response(self.time, self.response.measured, final)

    @property
    def notes(self):
        """Notes on input, largest displacements, speeds and error: list of str."""
        response, winch = self.response, self.busiest
        largest_displacement = f"{self.name}: at most {self._largest(response.measured)}"
        if response.open_loop is not None:
            largest_displacement += f"; without the loop {self._largest(response.open_loop)}"
        speed = MILLI * response.largest_winch_speeds[winch]
        displacement, movement, speed_error = response.errors.tolist()
        causes = "modes left out" + (" and the approximated delay" if self.delayed else "")
        return [
            f"input: {self.input.what}",
            largest_displacement,
            *([] if self.step is None else [f"{self.name}: {step_words(self.step, self.options.times)}"]),
            f"{self.winches[winch]}: at most {self._largest(response.winch[:, winch], 'mm')}, and {speed:.4g} mm/s",
            f"estimated error by {causes}: {displacement:.1e} of the largest displacement, {movement:.1e} of that "
            f"of a winch, {speed_error:.1e} of its speed",
            *self.remarks,
        ]

    def _largest(self, value, unit=None):
        """Text of the largest value over time, of shape (m,) [m] or [rad], and its time."""
        index = int(np.argmax(np.abs(value)))
        return f"{MILLI * value[index]:.4g} {unit or self.unit} at {self.time[index]:.4g} s"


def step_words(step, time):
    """A `StepResponse` in words; `time` are the points of time by which it was computed. [s]"""
    settling = f"not within {time[-1]:.4g} s" if step.settling_time is None else f"{step.settling_time:.4g} s"
    if step.ends_near_zero:
        words = f"settling time {settling} (to 2 % of the largest displacement)"
    else:
        rise = f"not within {time[-1]:.4g} s" if step.rise_time is None else f"{step.rise_time:.4g} s"
        words = f"overshoot {100 * step.overshoot:.3g} %, rise time {rise} (10 to 90 %), settling time {settling} (2 %)"
    remark = f"; steps of {time[1]:.3g} s are too long for these numbers: --time with a shorter duration, or more rows"
    return words + ("" if step.resolved else remark)


@dataclass(frozen=True)
class InputAndOutput:
    """Input and output of a response in time, which options of the command `loop` name.

    A winch, reference or output may have one name for the user and another one in the plant, the suspension without its
    loop; options may have either.
    """

    winches: tuple  # names of all winches, for the user
    input: Input
    plant_input: str  # name of the input in the plant
    output: str  # name of the measured coordinate that is shown, for the user
    output_number: int  # index of this coordinate among the measured ones


def input_and_output(document, scene, options, measured=None):
    """Find the input and the output that the user names for a response in time, without computing anything.

    Parameters
    ----------
    document : Document
        File of the scene, for the positions of mistakes.
    scene : CableScene or SuspensionScene
        With a controller.
    options : TimeOptions
        Options of the command `loop`. Default input: a step of the first winch. Default output: the first measured
        coordinate, or the one whose reference makes the step.
    measured : list of str, optional
        Measured coordinates, such as x and yaw; by default those that the scene states, else all that are free.

    Returns
    -------
    InputAndOutput

    Raises
    ------
    SceneError
        An unknown input or output, a size of another unit, or the scene has no wind for it.
    """
    kind = kind_of(scene)
    loop_scene, names = kind.as_suspension(scene), kind.names_in_loop
    body = loop_scene.body_of(loop_scene.control)
    measured = measured or loop_scene.control.measured or loop_scene.bodies[body].free
    winches = _shown_names([f"winch.{name}" for name in loop_scene.winches], names)
    references = _shown_names([f"reference.{name}" for name in measured], names)
    outputs = list(_shown_names([f"{body}.{name}" for name in measured], names))
    shown_input = names.get(options.input, options.input) or next(iter(winches))
    number_of("--input", shown_input, [*winches, *references, *OF_WIND])  # SceneError for an unknown input
    output_number = number_of("--output", names.get(options.output, options.output), outputs) if options.output else 0
    if shown_input in references and not options.output:
        output_number = list(references).index(shown_input)
    if shown_input in OF_WIND:
        require(document, scene, kind.wind_keys, f"loop --input {shown_input}")
    plant_input = (winches | references).get(shown_input, WIND_INPUT)
    driving_input = _driving_input(loop_scene, options, shown_input, plant_input)
    return InputAndOutput(tuple(winches), driving_input, plant_input, outputs[output_number], output_number)


def time_case(document, scene, analysis, options):
    """Compute the response of one measured coordinate to a step of a winch or a reference, or to a gust.

    Parameters
    ----------
    document : Document
        File of the scene, for the positions of mistakes.
    scene : CableScene or SuspensionScene
    analysis : DynamicAnalysis
        Of the scene as a suspension with a stable loop.
    options : TimeOptions
        Input, output and points of time; defaults of the first two as for `input_and_output`.

    Returns
    -------
    TimeCase

    Raises
    ------
    SceneError
        An unknown input or output, a size of another unit, or the scene has no wind for it.
    """
    closed_loop, loop_scene = analysis.closed_loop, analysis.scene
    body, loop = closed_loop.body, closed_loop.loop
    chosen = input_and_output(document, scene, options, body.measured)
    output = body.measured_outputs[chosen.output_number]
    of_unit_input = chosen.plant_input, chosen.input.components, options.times
    response = in_time(closed_loop, analysis.airflow, output, *of_unit_input).times(chosen.input.size)
    dampings = [cable.damping for cable in loop_scene.cables.values()]
    accurate_up_to = 0.0 if loop.slight_delay else loop.delay_accurate_up_to
    remarks = remarks_of(loop_scene.control, accurate_up_to, response, dampings)
    unit, delayed = f"m{unit_of(body.measured[chosen.output_number])}", accurate_up_to > 0
    return TimeCase(options, chosen.input, response, loop.gain, chosen.output, unit, chosen.winches, remarks, delayed)


def _shown_names(plant_names, names):
    """Name for the user of each of some names in the plant -> that name; `names` are those that differ."""
    return {names.get(name, name): name for name in plant_names}


def _driving_input(loop_scene, options, kind, input_name):
    """The `Input` that --input names as `kind`: a gust, or a step of a winch or reference named so in the plant."""
    if input_name == WIND_INPUT:
        return options.gust(loop_scene.wind, loop_scene.wind.turbulence_along)
    group, _, name = input_name.partition(".")
    if group == "reference":
        return options.step(f"the {kind} moves", unit_of(name))
    is_reel = loop_scene.winches[name].direction is None
    return options.step(f"{kind} reels in" if is_reel else f"the {kind} moves")


def remarks_of(drive, accurate_up_to, response, dampings):
    """Remarks for the user on a response in time: how damping and delay are approximated, and a winch that is too fast.

    Parameters
    ----------
    drive : Control
        Controller of the scene, which may state the largest speed of the winches, `max_speed`. [m/s]
    accurate_up_to : float
        Frequency up to which the phase of an approximated delay is accurate; 0 without an approximated delay. [rad/s]
    response : TimeResponse
    dampings : list
        Damping that each cable states.

    Returns
    -------
    tuple of str
    """
    remarks, speed = [], response.largest_winch_speeds.max()
    if has_loss_factor(dampings):
        remarks.append("damping: hysteretic, viscous in time, with the same loss of each mode at its frequency")
    if accurate_up_to:
        remarks.append(f"delay: Padé approximants, whose phase is accurate up to {accurate_up_to / (2 * np.pi):.4g} Hz")
    if drive.max_speed is not None and speed > drive.max_speed:
        remarks.append(
            f"warning: the winch would reach {MILLI * speed:.4g} mm/s, above its max_speed of "
            f"{MILLI * drive.max_speed:.4g} mm/s: the linear response does not hold"
        )
    elif drive.max_speed is None and speed > STUDY.fast_winch:
        remarks.append(
            f"warning: a winch would reach {speed:.4g} m/s, above {STUDY.fast_winch:g} m/s, where "
            "hardly any winch can: the linear response does not hold (max_speed states what this one can do)"
        )
    return tuple(remarks)


def time_table(solved):
    """Table of a response over time: the input, the displacement with and without the loop, the motion of the winches.

    Parameters
    ----------
    solved : TimeCase

    Returns
    -------
    Table
        A row for every `solved.options.every`-th point of time. Displacements are in mm or mrad, speeds of winches in
        mm/s. A CSV file has all winches; Markdown only the one that moves most.
    """
    response, unit, name = solved.response, solved.unit, solved.name
    of_wind = solved.input.unit == "m/s"
    columns = [
        (Field("time_s", "time", "s"), solved.time),
        (Field("wind_m_per_s", "wind", "m/s") if of_wind else Field(f"input_{solved.input.unit}", "input",
         solved.input.unit), solved.input.values_in_unit),
        (Field(f"{name}_{unit}", name, unit), MILLI * response.measured),
    ]  # fmt: skip
    if response.open_loop is not None:
        columns.append((Field(f"{name}_open_loop_{unit}", "open loop", unit), MILLI * response.open_loop))
    for index, winch in enumerate(solved.winches):
        hidden = index != solved.busiest
        columns += [
            (Field(f"{winch}_mm", winch, "mm", hidden=hidden), MILLI * response.winch[:, index]),
            (Field(f"{winch}_speed_mm_per_s", "speed", "mm/s", hidden=hidden), MILLI * response.winch_speed[:, index]),
        ]
    # the response has more points of time than the table has rows
    rows = np.stack([_without_rounding(value)[:: solved.options.every] for _, value in columns], axis=1)
    return Table.of([field for field, _ in columns], rows.tolist())


def _without_rounding(value):
    """Values with zero in place of what is rounding."""
    return np.where(np.abs(value) > STUDY.time_rounding * np.abs(value).max(), value, 0.0)
