"""Tables of the command `loop` for a suspension: its margins, singular values over frequency, response in time."""

from dataclasses import replace

import numpy as np

from cablestudy.control import loop_response
from cablestudy.control.pose_state_space import Labels, state_space
from cablestudy.control.statespace import MODAL
from cablestudy.control.suspension import labels
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.scene.scene import missing
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.loop_in_time import OF_WIND, TimeCase, remarks_of
from cablestudy.study.loop_report import CURVES, decibels, over_frequency
from cablestudy.study.ssm import number_of
from cablestudy.study.suspension.wind_report import coordinate_table, loop_table, made
from cablestudy.study.table import Field
from cablestudy.system.first_order import LinearControl
from cablestudy.system.suspension import AXES

TURNS = ("roll", "pitch", "yaw")
GUST = "gust"  # input of the state space
TABLES = {"loop": loop_table, "coordinates": coordinate_table}


def check_control(document, scene):
    """Refuse a suspension without a loop: SceneError."""
    if not scene.control:
        raise missing(document, "control", "loop")


def loop_tables(case, only=None):
    """The tables `loop`, and `coordinates` with the margin of each alone, of a `SuspensionCase`: dict; or one of them.

    And why cells of them are empty: tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no loop.
    """
    return made(case, {name: make for name, make in TABLES.items() if only in (None, name)})


def unstable(movement):
    """Why a `Movement` is unstable: tuple of str, empty where it is stable."""
    try:
        movement.check_stable()
    except NoSolutionError as error:
        return (str(error),)
    return ()


def response_table(movement, span):
    """Table of the singular values [dB] of L, S = (I + L)^-1 and T = S L at what is measured, over frequency.

    Parameters
    ----------
    movement : Movement
    span : (float, float, int)
        From `ssm.read_span`. Poles of the closed loop in the range have rows of their own beside these.
    """
    (low, high, count), loop = span, movement.loop
    own = np.abs(loop.poles[loop.poles.imag > 0]) / (2 * np.pi)
    frequency = np.unique(np.concatenate([np.geomspace(low, high, count), own[(own > low) & (own < high)]]))
    gain = loop.gain * movement.gains.loop_gain(2j * np.pi * frequency)
    sensitivity = np.linalg.inv(np.eye(gain.shape[-1]) + gain)
    columns = {}
    for name, value in zip(CURVES, (gain, sensitivity, sensitivity @ gain), strict=True):
        title = name.replace("_", " ")
        values = decibels(np.linalg.svd(value, compute_uv=False))
        columns[Field(f"{name}_largest_dB", f"{title} largest", "dB")] = values[:, 0]
        columns[Field(f"{name}_smallest_dB", f"{title} smallest", "dB")] = values[:, -1]
    return over_frequency(frequency, columns)


def time_case(document, case, options):
    """`TimeCase` of a suspension: one coordinate of its pose after a step of a winch or a reference, or in a gust.

    Parameters
    ----------
    document : Document
        Of its scene, for the places of mistakes.
    case : SuspensionCase
        With a loop.
    options : TimeOptions

    Raises
    ------
    SceneError
        An unknown input or output, or the scene has no wind for it.
    NoSolutionError, ConvergenceError
        The loop is unstable, or there is none.
    """
    movement, scene = case.in_wind.movement, case.scene
    body = movement.equilibrium.suspension.body_names[movement.body]
    winches = [f"winch.{name}" for name in scene.winches]
    references = [f"reference.{name}" for name in movement.measured]
    outputs = [f"{body}.{name}" for name in movement.measured]
    kind = input_ = options.input or winches[0]
    number_of("--input", kind, [*winches, *references, *OF_WIND])
    shown = number_of("--output", options.output, outputs) if options.output else 0
    if kind in references and not options.output:
        shown = references.index(kind)
    if kind in OF_WIND:
        if scene.wind is None:
            raise missing(document, "wind", f"loop --input {kind}")
        asked, input_ = options.gust(scene.wind, scene.wind.turbulence[0]), GUST
    elif kind in references:
        unit = _unit(movement.measured[references.index(kind)])
        asked = options.step(f"the {kind} moves", unit)
    else:
        asked = options.step(f"{kind} reels in")
    moved = f"{body}.{AXES[MOTIONS.index(movement.measured[shown])]}"
    whole = movement.linear.viscous_motion
    found = [
        _responses(movement, motion, space, moved, input_, asked.components, options.times)
        for motion, space in ((whole, None), (whole.within(movement.linear.fewer), movement.linear.fewer))
    ]
    found = loop_response.compared(*found).times(asked.size)
    unit = f"m{_unit(movement.measured[shown])}"
    loop = movement.loop
    dampings = [cable.damping for cable in scene.cables.values()]
    remarks = remarks_of(scene.control, 0.0 if loop.slight_delay else loop.right_up_to, found, dampings)
    return TimeCase(options, asked, found, movement.loop.gain, outputs[shown], unit, tuple(winches), remarks)


def _unit(coordinate):
    return "rad" if coordinate in TURNS else "m"


def _responses(movement, motion, space, output, input_, components, time):
    """`TimeResponse` with the motion, or with that in a space of its coordinates."""
    loop = movement.loop
    if loop is None:
        raise SceneError("control: there is no loop")
    loads, allocation = np.zeros((len(movement.motion), 1)), loop.allocation
    if movement.gusts is not None:
        along = uniform_gust(movement.gusts)
        loads[: len(along), 0] = along
    if space is not None:
        loads, allocation = space.T @ loads, replace(allocation, measured=allocation.measured @ space)
    inputs, outputs = labels(movement.layout, movement.winches, movement.markers)
    winches, size = inputs[: len(movement.winches)], len(motion) - sum(not one.wheel for one in movement.actuators)
    coordinates = tuple((f"coordinate_{k + 1}", MODAL) for k in range(size))
    measured = tuple((name, _unit(name)) for name in movement.measured)
    named = Labels(coordinates, winches, ((GUST, "m/s"),), outputs, measured)
    control = LinearControl(allocation, loop.gain, loop.notches, loop.law_space, loop.law_names)
    closed = state_space(motion, loads, named, control, movement.actuators, added=True)
    alone = state_space(motion, loads, named, None, movement.actuators)
    reeled = [closed.output_names.index(name) for name, _ in winches]
    places = closed.output_names.index(output), reeled, closed.input_names.index(input_)
    return loop_response.responses(closed, alone, *places, components, time)


def uniform_gust(gusts):
    """Force on each coordinate per speed of a gust along the mean wind that is the same everywhere. [N/(m/s)]"""
    count = gusts.forces.shape[-1]  # strips have shapes beyond the coordinates
    everywhere = gusts.forces.sum(axis=0) + sum(strip.forces[..., :count].sum(axis=1) for strip in gusts.strips)
    return gusts.directions[0] @ everywhere
