"""Response in time of a linear system, and of a loop, to inputs that obey linear equations: steps and gusts.

With x' = A x + B u, y = C x + D u and an input u = h z, z' = S z, state and input together obey one equation without
input, whose solution over a time step is a matrix exponential:

    [x]'   [A  B h] [x]
    [z]  = [0   S ] [z]

No error is made by the size of the time step (Franklin, Powell and Workman, Digital Control of Dynamic Systems, 1998,
section 4.3, for a step; here the same for a cosine).
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.matrices import solved
from cablestudy.control.tolerances import CONTROL


@dataclass(frozen=True)
class Component:
    """Part of an input, u = h z with z' = S z, from a time on; before that time it is zero.

    Attributes
    ----------
    begin : float
        >= 0. [s]
    output : ndarray, shape (k,)
        h.
    matrix : ndarray, shape (k, k)
        S.
    start : ndarray, shape (k,)
        z when it begins.
    """

    begin: float
    output: np.ndarray
    matrix: np.ndarray
    start: np.ndarray


def step(size):
    """Components of an input that is constant from time zero on: list."""
    return [Component(0.0, np.array([size]), np.zeros((1, 1)), np.ones(1))]


def gust(size, length):
    """Components of a 1-cosine gust, size/2 (1 - cos(2 pi t/length)) while 0 < t < length: list.

    Parameters
    ----------
    size : float
        Its largest value.
    length : float
        [s]

    Notes
    -----
    The shape of a discrete gust (EASA, CS-25, paragraph 25.341), whose rise is that of the extreme coherent gust of IEC
    61400-1, ed. 3, section 6.3.2.5. It is a periodic input less the same from t = length on.
    """
    omega = 2 * np.pi / length
    matrix = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -omega], [0.0, omega, 0.0]])
    output, start = np.array([size / 2, -size / 2, 0.0]), np.array([1.0, 1.0, 0.0])
    return [Component(0.0, output, matrix, start), Component(length, -output, matrix, start)]


def respond(a, b, c, d, components, time):
    """Response over time of o outputs of a linear system, from rest, to one input: exact at each point of time.

    Parameters
    ----------
    a, b, c, d : ndarray, shapes (n, n), (n,), (o, n), (o,)
        x' = A x + B u, y = C x + D u with n states and one input u.
    components : list of Component
        Parts whose sum is the input: each is h z with z' = S z, from a time on.
    time : ndarray, shape (m,)
        Uniform, from zero. [s]

    Returns
    -------
    ndarray, shape (m, o)

    Notes
    -----
    State and component together obey [x; z]' = [A, B h; 0, S] [x; z], an equation without input. A time step dt
    multiplies [x; z] by the exponential of this matrix times dt.
    """
    from scipy.linalg import expm

    outputs, step = np.zeros((len(time), len(c))), time[1] - time[0]
    for component in components:
        first_index = int(np.ceil(component.begin / step - CONTROL.component_begin))
        if first_index >= len(time):
            continue
        n, k = len(a), len(component.start)
        matrix = np.zeros((n + k, n + k))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, n:] = a, np.outer(b, component.output), component.matrix
        output = np.concatenate([c, np.outer(d, component.output)], axis=1)
        state = np.concatenate([np.zeros(n), component.start])
        # from the beginning of the component to the first point of time after it, then from point to point
        state = expm(matrix * max(first_index * step - component.begin, 0.0)) @ state
        advance = expm(matrix * step)
        for index in range(first_index, len(time)):
            outputs[index] += output @ state
            state = advance @ state
    return outputs


@dataclass(frozen=True)
class TimeResponse:
    """Response of one measured coordinate and of the winches.

    Attributes
    ----------
    measured, open_loop : ndarray, shape (m,)
        Displacement with the loop closed, and without the loop; None where only the loop has the input. [m] or [rad]
    winch, winch_speed : ndarray, shape (m, i)
        Movement of each winch by the loop, without the step of a winch that is the input. [m], [m/s]
    speed_at_jump : ndarray, shape (i,)
        Speed of each winch immediately after a jump of the input at time zero, or, with a delay, when that has passed;
        no point of time may be there. [m/s]
    errors : ndarray, shape (3,)
        Estimated errors due to modes that are left out, and to approximated delays: of the displacement, over the
        largest one, and of movements and of speeds of winches, over the largest of all winches. [-]
    final : float
        The measured displacement after a long time of a constant input of one; nan without a loop. [m] or [rad]
    """

    measured: np.ndarray
    open_loop: np.ndarray | None
    winch: np.ndarray
    winch_speed: np.ndarray
    speed_at_jump: np.ndarray
    errors: np.ndarray
    final: float

    def times(self, factor):
        """Response to the input multiplied by a factor."""
        names = "measured", "open_loop", "winch", "winch_speed", "speed_at_jump", "final"
        values = {name: getattr(self, name) for name in names}
        return replace(self, **{name: None if value is None else factor * value for name, value in values.items()})

    def after_delay(self, delay, time):
        """`TimeResponse` in which the winches rest until the delay of the loop has passed, as they do exactly.

        A Padé approximant of the delay moves them from the beginning, with ripples. Until the delay has passed the
        winches are set to rest here, and the displacement to that without the loop. The speeds of the winches after a
        jump of the input (`speed_at_jump`) are right in size with the approximant, but come too early: they are moved
        to the point of time at which the delay has passed.

        Parameters
        ----------
        delay : float
            [s]
        time : ndarray, shape (m,)
            Points of time of this response. [s]
        """
        if not delay:
            return self
        tolerance = CONTROL.component_begin * time[1]
        resting, jumping = time <= delay + tolerance, np.abs(time - delay) <= tolerance
        open_loop = np.zeros_like(self.measured) if self.open_loop is None else self.open_loop
        jump = np.where(jumping[:, None], self.speed_at_jump, 0.0)
        return replace(
            self,
            measured=np.where(resting, open_loop, self.measured),
            winch=np.where(resting[:, None], 0.0, self.winch),
            winch_speed=np.where(resting[:, None], jump, self.winch_speed),
            speed_at_jump=np.where(time[-1] < delay - tolerance, 0.0, self.speed_at_jump),
        )

    @property
    def largest_winch_speeds(self):
        """Largest size of the speed of each winch, shape (i,). [m/s]"""
        return np.maximum(np.abs(self.winch_speed).max(axis=0), np.abs(self.speed_at_jump))


def responses(closed, alone, output, winches, input_, components, time):
    """Compute the `TimeResponse` of one displacement and of the winches to one input.

    Parameters
    ----------
    closed, alone : StateSpace
        Suspension with its loop, and without it. The inputs of `closed` are the references of the loop, then all
        inputs of `alone`.
    output, input_ : int
        Indices, in `closed`, of the output that is the displacement, and of the input.
    winches : list of int
        Indices of the i outputs of `closed` that are movements of winches by the loop.
    components : list of Component
        Parts whose sum is the input over time.
    time : ndarray, shape (m,)
        Uniform, from zero. [s]

    Returns
    -------
    TimeResponse
        Its `final` is the static gain D - C A^-1 B of the closed loop. Its `errors` are zero; they follow from
        `differences`.
    """
    c_winches, b = closed.c[winches], closed.b[:, input_]
    c = np.concatenate([closed.c[[output]], c_winches, c_winches @ closed.a])  # displacement, winches, their speeds
    d = np.concatenate([closed.d[[output], input_], np.zeros(len(winches)), c_winches @ b])
    displacement_and_winches = respond(closed.a, b, c, d, components, time)
    # static gain D - C A^-1 B; NaN where a loop without gain leaves A singular
    final = closed.d[output, input_] - closed.c[output] @ solved(closed.a[None], b[None, :, None])[0, :, 0]
    # index of the input in `alone`; negative for a reference, which only the loop has
    open_input, open_loop = input_ - (len(closed.inputs) - len(alone.inputs)), None
    if open_input >= 0:
        system = alone.a, alone.b[:, open_input], alone.c[[output]], alone.d[[output], open_input]
        open_loop = respond(*system, components, time)[:, 0]
    winch, winch_speed = np.split(displacement_and_winches[:, 1:], 2, axis=1)
    return TimeResponse(
        displacement_and_winches[:, 0],
        open_loop,
        winch,
        winch_speed,
        winch_speed[0],
        np.zeros(3),
        float(final),
    )


def differences(response, other):
    """Differences of a `TimeResponse` from another one, over its own largest values, as `errors`: shape (3,)."""

    def difference(own, its):
        return np.abs(own - its).max(initial=0.0) / (np.abs(own).max(initial=0.0) or 1.0)

    names = "measured", "winch", "winch_speed"
    return np.array([difference(getattr(response, name), getattr(other, name)) for name in names])
