"""A suspension with its actuators, and with the loop of its winches, as a state space.

The equations are those of `pose_equations`. Without derivatives of the inputs on the states: with x = q + G1 u + G2 u',
G2 = B2 and G1 = B1 + A B2,

    q' = A q + (B0 + A G1) u,      y = C x + E0 u + E1 u' + E2 u'' = C q + (E0 + C G1) u + (E1 + C G2) u' + E2 u''.

A state on which derivatives of an input act is its quantity less a multiple of that input; outputs are never shifted.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.pose_equations import equations
from cablestudy.control.statespace import StateSpace


@dataclass(frozen=True)
class Labels:
    """Name and unit of what a state space is made of: tuples of (str, str).

    Attributes
    ----------
    coordinates : tuple
        Without strokes.
    winches, forces, outputs : tuple
        Lengths reeled in, forces, and outputs of the motion.
    measured : tuple
        What the loop measures.
    """

    coordinates: tuple
    winches: tuple
    forces: tuple
    outputs: tuple
    measured: tuple = ()


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space(motion, forces, labels, loop=None, actuators=()):
    """`StateSpace` of a suspension with its actuators.

    Parameters
    ----------
    motion : Motion
    forces : ndarray, shape (m, j)
        Force on each coordinate by each input that is a force.
    labels : Labels
    loop : PoseLoop, optional
        With the motion as above.
    actuators : sequence of Actuator
        Those of the motion.

    Returns
    -------
    StateSpace
        Inputs: with a loop the reference of each measured coordinate, else the length that each winch reels in; then
        forces. Outputs: those of the motion, with a loop the length that each winch has reeled in, then stroke and
        force of each reaction mass, momentum and torque of each wheel.

    Raises
    ------
    NoSolutionError
        Entries overflow.
    """
    found, whole, winches, shown = _rows(motion, forces, loop, actuators)
    if loop:
        shown = np.insert(shown, len(motion.moved[0]), winches, axis=0)
    size = len(whole)
    inputs = (whole.shape[1] - size) // 3
    states = _states(labels, loop, actuators, found.winches.shape[1])
    a, *given = np.split(whole, [size, size + inputs, size + 2 * inputs], axis=1)
    c, *direct = np.split(shown, [size, size + inputs, size + 2 * inputs], axis=1)
    first = given[1] + a @ given[2]
    derivatives = direct[1] + c @ given[2], direct[2]
    return StateSpace(
        a, given[0] + a @ first, c, direct[0] + c @ first, states, *names(labels, bool(loop), actuators), derivatives
    )


def by_forces(motion, forces, loop=None, actuators=()):
    """B, C and D with the forces as the only inputs, and without the lengths of the winches among the outputs.

    Arguments are those of `state_space`. A is that of `PoseLoop.eigen`, or of `Motion.eigen` without a loop.
    """
    _, whole, _, shown = _rows(motion, forces, loop, actuators)
    size = len(whole)
    end = size + (whole.shape[1] - size) // 3
    inputs = slice(end - forces.shape[1], end)
    return whole[:, inputs], shown[:, :size], shown[:, inputs]


def _rows(motion, forces, loop, actuators):
    """`Equations`, and as rows over x, u, u', u'': x', lengths of winches, outputs of motion and actuators."""
    found = equations(motion, *((loop.allocation, loop.notches, loop.law_space) if loop else ()), forces=forces)
    whole = found.fixed + (loop.gain * found.scaled.sum(axis=0) if loop else 0.0)
    m, size = len(motion), len(whole)
    inputs = (whole.shape[1] - size) // 3

    def derivative(row):
        """Of rows over x, u, u', u'' that have no part of u''."""
        shifted = np.zeros_like(row)
        shifted[:, size + inputs :] = row[:, size:-inputs]
        return row[:, :size] @ whole + shifted

    winches = np.zeros((len(found.winches), whole.shape[1]))
    if loop:
        winches[:, size - found.winches.shape[1] : size] = found.winches
        rate = derivative(winches)
        reeled = winches, rate, derivative(rate)
    else:
        reeled = np.zeros((3, *winches.shape))
        for order, part in enumerate(reeled):
            part[:, size + order * inputs :][:, : len(part)] = np.eye(len(part))
    moving = found.places, found.speeds, whole[m : 2 * m]
    shown = sum(part @ rows for part, rows in zip(motion.moved, moving, strict=True))
    shown += sum(part @ rows for part, rows in zip(motion.follow, reeled, strict=True))
    outputs = [shown]
    strokes = iter(found.places[m - sum(not one.wheel for one in actuators) :])
    for one, (moved, speed) in zip(actuators, found.feedback, strict=True):
        force = one.velocity_gain * speed + one.position_gain * moved
        outputs.append([one.velocity_gain * moved, force] if one.wheel else [next(strokes), force])
    return found, whole, winches, np.concatenate(outputs)


def names(labels, closed, actuators=()):
    """Name and unit of each input and of each output, with or without a loop; arguments as for `state_space`."""
    references = tuple((f"reference.{name}", unit) for name, unit in labels.measured)
    driven = references if closed else labels.winches
    seen = [*labels.outputs, *(labels.winches if closed else ())]
    for one in actuators:
        units = {"momentum": "N m s", "torque": "N m"} if one.wheel else {"stroke": "m", "force": "N"}
        seen += [(f"{one.name}.{what}", unit) for what, unit in units.items()]
    return (*driven, *labels.forces), tuple(seen)


def _states(labels, loop, actuators, movements):
    """Name and unit of each state, the last ones of as many movements of the winches."""
    strokes = [(f"{one.name}.stroke", "m") for one in actuators if not one.wheel]
    moving = [*labels.coordinates, *strokes]
    found = [(f"{name}_{what}", f"{unit}/s") for what in ("amplitude", "velocity") for name, unit in moving]
    found += [(f"{one.name}.low_pass", "rad" if one.wheel else "m") for one in actuators if one.corner]
    for (name, unit), notch in zip(labels.measured if loop else (), loop.notches if loop else (), strict=True):
        found += [(f"notch.{name}_{k}", unit) for k in (1, 2) if notch]
    laws = loop.law_names if loop else ()
    found += [(f"{name}.winches_{k + 1}", "") for k in range(movements) for name in laws]
    return (*found, *((f"winches_{k + 1}", "m") for k in range(movements)))
