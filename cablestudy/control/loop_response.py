"""Measured coordinate and winches of a loop in time, after a step of a winch or a reference, or a force."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control.time_response import respond


@dataclass(frozen=True)
class TimeResponse:
    """Response of one measured coordinate and of the winches.

    Attributes
    ----------
    measured, open_loop : ndarray, shape (m,)
        Displacement with the loop closed, and without the loop; None where only the loop has the input. [m] or [rad]
    winch, winch_speed : ndarray, shape (m, i)
        Movement of each winch by the loop, without the step of a winch that is the input. [m], [m/s]
    errors : ndarray, shape (3,)
        Estimated errors by modes that are left out, and by approximated delays: of the displacement, over the largest
        one, and of movements and of speeds of winches, over the largest of all winches. [-]
    final : float
        The measured displacement after a long time of a constant input of one; nan without a loop. [m] or [rad]
    """

    measured: np.ndarray
    open_loop: np.ndarray | None
    winch: np.ndarray
    winch_speed: np.ndarray
    errors: np.ndarray
    final: float

    def times(self, factor):
        """Response to the input multiplied by a factor."""
        values = {name: getattr(self, name) for name in ("measured", "open_loop", "winch", "winch_speed", "final")}
        return replace(self, **{name: None if value is None else factor * value for name, value in values.items()})


def responses(closed, alone, output, winches, input_, components, time):
    """Compute the `TimeResponse` of one displacement and of the winches to one input.

    Its `errors` are left at 0; they follow from `differences`.

    Parameters
    ----------
    closed, alone : StateSpace
        Suspension with the loop and without it: `alone` has the last inputs of `closed`, all but the references.
    output, input_ : int
        Indices, in `closed`, of the displacement that is returned and of the input.
    winches : list of int
        Indices of the outputs of `closed` that are movements of winches by the loop.
    components : list of time_response.Component
        Parts whose sum is the input over time.
    time : ndarray, shape (m,)
        Uniform, from zero. [s]
    """
    c_winches, b = closed.c[winches], closed.b[:, input_]
    c = np.concatenate([closed.c[[output]], c_winches, c_winches @ closed.a])  # displacement, winches, their speeds
    d = np.concatenate([closed.d[[output], input_], np.zeros(len(winches)), c_winches @ b])
    displacement_and_winches = respond(closed.a, b, c, d, components, time)
    # static gain D - C A^-1 B
    final = closed.d[output, input_] - closed.c[output] @ _solved(closed.a, b)
    # index of the input in `alone`; negative for a reference, which only the loop has
    open_input, open_loop = input_ - (len(closed.inputs) - len(alone.inputs)), None
    if open_input >= 0:
        system = alone.a, alone.b[:, open_input], alone.c[[output]], alone.d[[output], open_input]
        open_loop = respond(*system, components, time)[:, 0]
    return TimeResponse(
        displacement_and_winches[:, 0],
        open_loop,
        *np.split(displacement_and_winches[:, 1:], 2, axis=1),
        np.zeros(3),
        float(final),
    )


def _solved(a, b):
    """Solution of a x = b; nan where a loop without gain leaves a singular."""
    try:
        return np.linalg.solve(a, b)
    except np.linalg.LinAlgError:
        return np.full(len(a), np.nan)


def differences(response, other):
    """Differences of a `TimeResponse` from another one, over its own largest values, as `errors`: shape (3,)."""

    def difference(own, its):
        return np.abs(own - its).max(initial=0.0) / (np.abs(own).max(initial=0.0) or 1.0)

    names = "measured", "winch", "winch_speed"
    return np.array([difference(getattr(response, name), getattr(other, name)) for name in names])
