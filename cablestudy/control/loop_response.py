"""A loop of winches in time: what is measured, and the winches, after a step of a winch or a reference, or a force."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control import statespace
from cablestudy.control.time_response import respond

REFERENCE, WINCH, FORCE = "reference", "winch", "force"  # where an input acts
LEFT_OUT = 0.3  # share of the modes, the highest ones, without which the error is estimated


@dataclass(frozen=True)
class TimeResponse:
    """What one measured coordinate and the winches do.

    Attributes
    ----------
    measured, open_loop : ndarray, shape (m,)
        Displacement with the loop closed, and without it; None where only the loop has the input. [m] or [rad]
    winch, winch_speed : ndarray, shape (m, i)
        Movement of each winch by the loop, without what is added to it. [m], [m/s]
    error : float
        Estimated relative error of the largest displacement by the modes that are left out. [-]
    final : float
        The measured displacement after a long time of a constant input of one; nan without a loop. [m] or [rad]
    """

    measured: np.ndarray
    open_loop: np.ndarray | None
    winch: np.ndarray
    winch_speed: np.ndarray
    error: float
    final: float

    def times(self, factor):
        """The response to so many times the input."""
        parts = {name: getattr(self, name) for name in ("measured", "open_loop", "winch", "winch_speed", "final")}
        return replace(self, **{name: part if part is None else factor * part for name, part in parts.items()})


@dataclass(frozen=True)
class Driven:
    """A plant with its loop, and an input.

    Attributes
    ----------
    plant : StateSpace
        As for `statespace.feedback`, like those that follow.
    measured : tuple of int
    filters : list
    shares : ndarray, shape (i, k)
    shown : int
        Which measured coordinate is returned.
    place : {REFERENCE, WINCH, FORCE}
    number : int
        Which reference, winch, or force after the winches among the inputs of the plant.
    """

    plant: object
    measured: tuple
    filters: list
    shares: np.ndarray
    shown: int
    place: str
    number: int = 0

    def responses(self, components, time):
        """`TimeResponse` without its error, for the components of an input at uniform times from zero [s]."""
        plant, winches, count = self.plant, len(self.shares), len(self.measured)
        fed = statespace.feedback(plant, self.measured, self.filters, self.shares)
        column = self.number + {REFERENCE: 0, WINCH: count, FORCE: count + winches}[self.place]
        seen, at_once = (part[self.shown] for part in fed.measured)
        last = slice(len(fed.a) - winches, None)
        rows = np.concatenate([seen[None], np.eye(len(fed.a))[last], fed.a[last]])
        direct = np.concatenate([at_once[[column]], np.zeros(winches), fed.b[last, column]])
        found = respond(fed.a, fed.b[:, column], rows, direct, components, time)
        alone = None
        if self.place != REFERENCE:
            own, output = column - count, self.measured[self.shown]
            direct = plant.d[[output], own]
            alone = respond(plant.a, plant.b[:, own], plant.c[[output]], direct, components, time)[:, 0]
        final = at_once[column] - seen @ _solved(fed.a, fed.b[:, column])
        return TimeResponse(found[:, 0], alone, found[:, 1 : 1 + winches], found[:, 1 + winches :], 0.0, float(final))


def _solved(a, b):
    """Solution of a x = b; nan where a loop without gain leaves a singular."""
    try:
        return np.linalg.solve(a, b)
    except np.linalg.LinAlgError:
        return np.full(len(a), np.nan)


def compared(found, fewer):
    """A `TimeResponse` with its error by another one with fewer modes."""
    difference = np.abs(found.measured - fewer.measured).max()
    return replace(found, error=float(difference / (np.abs(found.measured).max() or 1.0)))


def loop_response(loop, place, components, time):
    """`TimeResponse` of the winch loop of one cable.

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
    kept = np.sort(np.argsort(cable.omega)[: int((1 - LEFT_OUT) * len(cable.omega))])
    found = []
    for model in (cable, cable.select(kept)):
        plant = statespace.coupled(model, loop.mass, loop.location, damping=loop.damping)
        filtering, _ = loop.filter_to(loop.plant.right_up_to(model.omega))
        driven = Driven(plant, (0,), [filtering], loop.shares, 0, place)
        found.append(driven.responses(components, time))
    return compared(*found)
