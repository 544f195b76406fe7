"""Response over time of a `ClosedLoop` to a step of a winch or a reference, or to a gust, and its error."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control import time_response
from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels
from cablestudy.motion.in_wind import PlantInWind
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.determinacy import ROTATIONS
from cablestudy.system.first_order import LinearControl
from cablestudy.system.linear import MODAL

WIND_INPUT = "gust"  # name of the input of a state space that is a gust


@dataclass(frozen=True)
class _Channel:
    """One input over time, and the displacement that responds.

    Attributes
    ----------
    output, input_ : str
        Names of the displacement, and of the input: `winch.CABLE`, `reference.COORDINATE` or WIND_INPUT.
    components : list of time_response.Component
        The input as a sum of functions of time.
    times : ndarray, shape (m,)
        Points of time, uniform, from zero. [s]
    """

    output: str
    input_: str
    components: list
    times: np.ndarray


def in_time(closed_loop, airflow, output, input_, components, times):
    """Compute how a displacement and the winches of a closed loop respond over time to one input.

    The relative errors of the response are estimated by the sum of

    * its change by a smaller space of coordinates (`Plant.coarse_space_in_time`);
    * twice its change by twice as many modes: at a corner of the input in time amplitudes of modes fall with the square
      of their frequency, so that twice as many modes make the error half as large;
    * two and a half times its change by twice as many approximants of a delay, in the smaller space: behind a delay a
      step makes a corner, which contains all frequencies, so that twice as many make the error 0.52 times as large
      (`MOTION.more_approximants`). Ripples before the delay has passed, which the response does not have, count: they
      show the error too.

    Parameters
    ----------
    closed_loop : ClosedLoop
        A stable loop; with a gain of zero its winches rest.
    airflow : Airflow or None
        The air about it; None without wind.
    output : str
        Name of the displacement, one of `ClosedLoop.outputs`.
    input_ : str
        `winch.CABLE`, `reference.COORDINATE`, or WIND_INPUT: speed of a gust along the mean wind, equal everywhere.
    components : list of time_response.Component
        The input as a sum of functions of time.
    times : ndarray, shape (m,)
        Points of time, uniform, from zero. [s]

    Returns
    -------
    TimeResponse

    Raises
    ------
    NoSolutionError
        The state space overflows.
    """
    loop, plant = closed_loop.loop, closed_loop.plant
    all_coordinates, coarse_space = plant.viscous_motion, plant.coarse_space_in_time
    coarse_motion = all_coordinates.within(coarse_space)
    channel, delay_and_times = _Channel(output, input_, components, times), (loop.law.delay, times)
    full = _response_in_space(closed_loop, airflow, loop, all_coordinates, None, channel).after_delay(*delay_and_times)
    coarse = _response_in_space(closed_loop, airflow, loop, coarse_motion, coarse_space, channel)
    errors = time_response.differences(full, coarse.after_delay(*delay_and_times))
    if finer := closed_loop.with_twice_the_modes:
        same_loop = replace(loop, allocation=finer.body.allocation, notches=finer.body.notches)
        of_finer = _response_in_space(finer, airflow, same_loop, finer.plant.viscous_motion, None, channel)
        errors = errors + 2 * time_response.differences(full, of_finer.after_delay(*delay_and_times))
    finer_delay = loop.law_states_of_finer_delay
    if finer_delay and times[-1] >= loop.law.delay:
        of_finer = _response_in_space(closed_loop, airflow, loop, coarse_motion, coarse_space, channel, finer_delay)
        errors = errors + MOTION.more_approximants * time_response.differences(coarse, of_finer)
    response = replace(full, errors=errors)
    if loop.gain:
        return response
    at_rest = {name: np.zeros_like(getattr(response, name)) for name in ("winch", "winch_speed", "speed_at_jump")}
    return replace(response, **at_rest)


def unit_of(coordinate):
    """Unit of a measured coordinate: m or rad."""
    return "rad" if coordinate in ROTATIONS else "m"


def measured_by(closed_loop):
    """Name and unit of what the loop of a `ClosedLoop` measures: tuple."""
    return tuple((name, unit_of(name)) for name in closed_loop.body.measured)


def labelled(closed_loop, motion, names, forces, of_forces=None):
    """Name the coordinates, inputs and outputs of a linear system, and add inputs for forces: `LinearSystem`.

    Its inputs are then the winches, followed by the forces.

    Parameters
    ----------
    closed_loop : ClosedLoop
        Its winches, markers and actuators give names and units.
    motion : LinearSystem
        Equations of motion of the closed loop's plant, in m coordinates: all of them, or those of a subspace.
    names : list of str
        Names of the coordinates, without the strokes of reaction masses, which come last.
    forces : ndarray, shape (m, j)
        Force on each coordinate per unit of each of j inputs.
    of_forces : tuple of (str, str), optional
        Name and unit of each of these inputs; by default they are forces along all free displacements of bodies.
    """
    winch_count = len(closed_loop.winches)
    inputs, outputs = labels(closed_loop.layout, closed_loop.winches, closed_loop.markers)
    strokes = [(f"{actuator.name}.stroke", "m") for actuator in closed_loop.actuators if not actuator.wheel]
    coordinates = (*((name, MODAL) for name in names), *strokes)
    motion = replace(motion, coordinates=coordinates, inputs=inputs[:winch_count], outputs=outputs)
    return motion.with_forces(forces, inputs[winch_count:] if of_forces is None else of_forces)


def uniform_gust(gusts):
    """Force on each coordinate per speed of a gust along the mean wind that is the same everywhere. [N/(m/s)]"""
    return gusts.directions[0] @ gusts.uniform


def _response_in_space(closed_loop, airflow, loop, motion, space, channel, law_states=None):
    """Compute the response of `in_time`, without its errors, with all coordinates of the plant or in a subspace.

    Parameters
    ----------
    closed_loop : ClosedLoop
    airflow : Airflow or None
        As of `in_time`.
    loop : Loop
        Of all n coordinates of the plant; its gain, notches and allocation are used.
    motion : LinearSystem
        Equations of motion of the plant, in its n coordinates or in the r coordinates of the subspace.
    space : ndarray, shape (n, r), or None
        Basis of the subspace; None without one.
    channel : _Channel
        Input, output and points of time.
    law_states : tuple, optional
        `Loop.law_states` with another approximant of a delay.

    Returns
    -------
    TimeResponse
    """
    loads, allocation = np.zeros((len(closed_loop.motion), 1)), loop.allocation
    if airflow is not None:
        gust_force = uniform_gust(PlantInWind(closed_loop.plant, airflow).gusts)
        loads[: len(gust_force), 0] = gust_force  # strokes of reaction masses, the last coordinates, have no wind load
    if space is not None:
        loads, allocation = space.T @ loads, replace(allocation, measured=allocation.measured @ space)
    coordinate_count = len(motion) - sum(not actuator.wheel for actuator in closed_loop.actuators)
    names = [f"coordinate_{k + 1}" for k in range(coordinate_count)]
    system = labelled(closed_loop, motion, names, loads, ((WIND_INPUT, "m/s"),))
    control = LinearControl(allocation, loop.gain, loop.notches, *(law_states or loop.law_states))
    actuators, measured = closed_loop.actuators, measured_by(closed_loop)
    # `added`: inputs are references, and lengths that winches reel in beyond those of the loop: either may make a step
    with_loop = state_space_of(system, loop=control, measured=measured, actuators=actuators, added=True)
    without_loop = state_space_of(system, actuators=actuators)
    outputs, inputs = with_loop.output_names, with_loop.input_names
    return time_response.responses(
        with_loop,
        without_loop,
        output=outputs.index(channel.output),
        winches=[outputs.index(name) for name, _ in system.inputs[: len(closed_loop.winches)]],
        input_=inputs.index(channel.input_),
        components=channel.components,
        time=channel.times,
    )
