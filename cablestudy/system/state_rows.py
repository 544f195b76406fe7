"""State spaces of a linear system as rows of coefficients: what gives x', the winch movements and the outputs.

The states x and the inputs u, u' and u'' are those of `first_order`.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system.first_order import Equations, equations, force_of_actuator


@dataclass(frozen=True)
class StateRows:
    """Rows of coefficients for the matrices of state spaces, of N states and p inputs u.

    A row has the coefficients of the N states x; then, if there are inputs, those of u, of u' and of u'': w = N or
    N + 3 p columns. The inputs are, in this order, the references of the loop, the lengths u_w that the i winches reel
    in besides the loop, and the forces.

    Attributes
    ----------
    equations : Equations
    state_rate : ndarray, shape (..., N, w)
        x'.
    reeled, speed : ndarray, shape (..., i, w)
        Length that the loop reels in at each winch, and its speed.
    outputs : ndarray, shape (..., o + 2 a, w)
        Outputs of the system, then stroke and force of each of a reaction masses, or momentum and torque of wheels.
    """

    equations: Equations
    state_rate: np.ndarray
    reeled: np.ndarray
    speed: np.ndarray
    outputs: np.ndarray


def state_rows(system, forces=None, loop=None, actuators=()):
    """Rows that give x', the winch movements and the outputs of a linear system with its loop: `StateRows`.

    Parameters
    ----------
    system : LinearSystem
        Of m coordinates z, i winches as inputs, and o outputs.
    forces : ndarray, shape (..., m, j), optional
        Force on each coordinate by each of j forces; without it there are no inputs.
    loop : LinearControl, optional
        Control loop of the winches; without it only inputs move them.
    actuators : sequence of Actuator
        The a actuators of the system.

    Notes
    -----
    In all the winches reel in l = l_loop + u_w, where l_loop is `Equations.winches` times the last states. The outputs
    of the system are y = C0 z + C1 z' + C2 z'' + D0 l + D1 l' + D2 l''.
    """
    of_loop = (loop.allocation, loop.notches, loop.law_space) if loop else ()
    first_order = equations(system, *of_loop, forces=forces)
    state_rate = first_order.with_gain(loop.gain) if loop else first_order.fixed
    m, states, (winches, movements) = len(system), state_rate.shape[-2], first_order.winches.shape[-2:]
    inputs = (state_rate.shape[-1] - states) // 3

    def derivative(row):
        """Rows of the time derivatives of the quantities that some rows give, none of which depends on u''."""
        of_inputs = np.zeros_like(row)  # coefficients of u and u' become those of u' and u''
        of_inputs[..., states + inputs :] = row[..., states : states + 2 * inputs]
        return row[..., :states] @ state_rate + of_inputs

    reeled = np.zeros((*state_rate.shape[:-2], winches, state_rate.shape[-1]))
    reeled[..., states - movements : states] = first_order.winches
    speed = derivative(reeled)
    lengths = [reeled, speed, derivative(speed)] if loop else np.zeros((3, *reeled.shape))  # l, l' and l''
    if inputs:
        first_winch = inputs - forces.shape[-1] - winches  # index of the first input that is a length
        for order, by_loop in enumerate(lengths):
            lengths[order] = by_loop + np.eye(*by_loop.shape[-2:], states + order * inputs + first_winch)
    motions = first_order.coordinates, first_order.rates, state_rate[..., m : 2 * m, :]  # z, z' and z''
    of_system = sum(matrix @ motion for matrix, motion in zip(system.c, motions, strict=True))
    of_system = of_system + sum(matrix @ length for matrix, length in zip(system.d, lengths, strict=True))
    of_actuators = _actuator_outputs(first_order, system, actuators)
    outputs = np.concatenate([of_system, *(row[..., None, :] for row in of_actuators)], axis=-2)
    return StateRows(first_order, state_rate, reeled, speed, outputs)


def _actuator_outputs(first_order, system, actuators):
    """Rows of each actuator, two each: stroke and force of a reaction mass, or momentum and torque of a wheel; list."""
    outputs, coordinates = [], first_order.coordinates
    stroke = coordinates.shape[-2] - sum(not actuator.wheel for actuator in actuators)  # the last coordinates
    of_actuators = zip(actuators, system.feedback, first_order.feedback, strict=True)
    for actuator, feedback, (movement, rate) in of_actuators:
        momentum = np.asarray(feedback.velocity_gain)[..., None] * movement
        force = force_of_actuator(feedback, movement, rate)
        outputs += [momentum if actuator.wheel else coordinates[..., stroke, :], force]
        stroke += not actuator.wheel
    return outputs
