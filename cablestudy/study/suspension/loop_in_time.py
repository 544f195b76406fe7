"""The loop of a suspension in time: what one displacement and the winches do after a step, or in a gust."""

from dataclasses import replace

import numpy as np

from cablestudy.control import loop_response
from cablestudy.control.loop_state_space import Labels, state_space
from cablestudy.control.suspension import labels
from cablestudy.system.first_order import LinearControl
from cablestudy.system.linear import MODAL

TURNS = ("roll", "pitch", "yaw")
GUST = "gust"  # input of the state space


def in_time(movement, output, input_, components, times):
    """`TimeResponse` of a `Movement`, with its error by the modes that are left out.

    Parameters
    ----------
    movement : Movement
        With a loop, stable.
    output : str
        A displacement, as of `Movement.outputs`.
    input_ : str
        `winch.CABLE`, `reference.COORDINATE`, or GUST: a gust along the mean wind that is the same everywhere, per
        speed of it.
    components : list of time_response.Component
        Of the input.
    times : ndarray, shape (m,)
        Uniform, from zero. [s]

    Raises
    ------
    NoSolutionError
        The state space overflows.
    """
    linear = movement.linear
    whole = linear.viscous_motion
    found = [
        _responses(movement, motion, space, output, input_, components, times)
        for motion, space in ((whole, None), (whole.within(linear.fewer), linear.fewer))
    ]
    found = loop_response.compared(*found)
    if movement.loop.gain:
        return found
    return replace(found, winch=np.zeros_like(found.winch), winch_speed=np.zeros_like(found.winch_speed))


def delayed_up_to(loop):
    """Frequency up to which an approximant of the delay of a `Loop` is right; 0 where there is none. [rad/s]"""
    return 0.0 if loop.slight_delay else loop.right_up_to


def unit_of(coordinate):
    """Of a measured coordinate: m or rad."""
    return "rad" if coordinate in TURNS else "m"


def uniform_gust(gusts):
    """Force on each coordinate per speed of a gust along the mean wind that is the same everywhere. [N/(m/s)]"""
    return gusts.directions[0] @ gusts.uniform


def _responses(movement, motion, space, output, input_, components, times):
    """`TimeResponse` with the motion, or with that in a space of its coordinates."""
    loop = movement.loop
    loads, allocation = np.zeros((len(movement.motion), 1)), loop.allocation
    if movement.gusts is not None:
        along = uniform_gust(movement.gusts)
        loads[: len(along), 0] = along
    if space is not None:
        loads, allocation = space.T @ loads, replace(allocation, measured=allocation.measured @ space)
    inputs, outputs = labels(movement.layout, movement.winches, movement.markers)
    winches, size = inputs[: len(movement.winches)], len(motion) - sum(not one.wheel for one in movement.actuators)
    coordinates = tuple((f"coordinate_{k + 1}", MODAL) for k in range(size))
    measured = tuple((name, unit_of(name)) for name in movement.measured)
    named = Labels(coordinates, winches, ((GUST, "m/s"),), outputs, measured)
    control = LinearControl(allocation, loop.gain, loop.notches, loop.law_space, loop.law_names)
    closed = state_space(motion, loads, named, control, movement.actuators, added=True)
    alone = state_space(motion, loads, named, None, movement.actuators)
    reeled = [closed.output_names.index(name) for name, _ in winches]
    places = closed.output_names.index(output), reeled, closed.input_names.index(input_)
    return loop_response.responses(closed, alone, *places, components, times)
