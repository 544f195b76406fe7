"""The winch loop of one cable in time: gondola and winch after a step of the winch, of the reference, or of a force."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control import statespace
from cablestudy.control.time_response import respond

REFERENCE, WINCH, FORCE = 0, 1, 2  # inputs of `statespace.Feedback`
LEFT_OUT = 0.3  # share of the modes, the highest ones, without which the error is estimated


@dataclass(frozen=True)
class TimeResponse:
    """Attributes
    ----------
    gondola, open_loop : ndarray, shape (m,)
        Displacement of the gondola with the loop closed, and without it; None where only the loop has the input. [m]
    winch, winch_speed : ndarray, shape (m,)
        Movement of the winch by the loop, without what is added to it. [m], [m/s]
    error : float
        Estimated relative error of the gondola's largest displacement by the modes that are left out. [-]
    """

    gondola: np.ndarray
    open_loop: np.ndarray | None
    winch: np.ndarray
    winch_speed: np.ndarray
    error: float


def loop_response(loop, place, components, time):
    """`TimeResponse` of a loop at rest.

    Parameters
    ----------
    loop : Loop
    place : {REFERENCE, WINCH, FORCE}
        Where the input acts: the reference of the gondola's position [m], added to the movement of the winch [m], or a
        force on the gondola [N].
    components : list of time_response.Component
    time : ndarray, shape (m,)
        Uniform, from zero. [s]

    Raises
    ------
    NoSolutionError
        The loop is unstable, or the state space overflows.
    """
    loop.check_stable()
    cable = loop.plant.responding
    found = _respond(loop, cable, place, components, time)
    kept = np.argsort(cable.omega)[: int((1 - LEFT_OUT) * len(cable.omega))]
    fewer = _respond(loop, cable.select(np.sort(kept)), place, components, time)[0]
    largest = np.abs(found[0]).max() or 1.0
    return TimeResponse(*found, float(np.abs(found[0] - fewer).max() / largest))


def _respond(loop, cable, place, components, time):
    """Displacement with and without the loop, movement and velocity of the winch, each of shape (m,)."""
    plant = statespace.coupled(cable, loop.mass, loop.location, damping=loop.damping)
    fed = statespace.feedback(plant, replace(loop, cable=cable))
    (seen, at_once), size = fed.position, len(fed.a)
    rows = np.stack([seen, np.eye(size)[-1], fed.rate])
    direct = np.array([at_once[place], 0.0, fed.b[-1, place]])
    gondola, winch, speed = respond(fed.a, fed.b[:, place], rows, direct, components, time).T
    if place == REFERENCE:
        return gondola, None, winch, speed
    alone = respond(
        plant.a, plant.b[:, place - 1], plant.c[:1], plant.d[:1, place - 1], components, time
    )[:, 0]  # fmt: skip
    return gondola, alone, winch, speed
