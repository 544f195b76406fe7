"""A linear system with the loop of its winches, or without it, as equations of first order.

    x' = (A0 + gain sum A_j) x + B0 u + B1 u' + B2 u''

Rows of all matrices are over the states x and, where there are inputs, over u, u', u''. States: h z (h the `unit` of
each coordinate), z', the low-passed movement of each actuator with a high-pass filter, two of each notch, those of the
control law of each independent movement of the winches, and as many movements as the allocation makes. Inputs: with the
loop the references r of what is measured; the lengths that the winches reel in, beyond those of the loop; forces.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system.tolerances import SYSTEM

NOTHING = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0  # a law of no states that passes what it is given


@dataclass(frozen=True)
class Allocation:
    """Measured coordinates, and how an error is shared among the winches.

    Attributes
    ----------
    measured : ndarray, shape (k, m)
        What is measured, by the coordinates of the motion.
    shares : ndarray, shape (i, k)
        A. [-], [m/rad]
    static_gain : ndarray, shape (k, i), optional
        G. [-], [rad/m]
    """

    measured: np.ndarray
    shares: np.ndarray
    static_gain: np.ndarray = None


@dataclass(frozen=True)
class LinearControl:
    """Control law that closes the loop, as `Loop` has it too.

    Attributes
    ----------
    allocation : Allocation
    gain : float
        [rad/s]
    notches : tuple of (Notch or None)
        Of each measured coordinate.
    law_space : tuple of 4 ndarray
        s C1 as a state space a, b, c, d.
    law_names : list of str
        Of its states.
    """

    allocation: Allocation
    gain: float
    notches: tuple
    law_space: tuple
    law_names: list


@dataclass(frozen=True)
class Equations:
    """The equations of the module's docstring, N states, p inputs, w = N, or N + 3 p with inputs.

    Attributes
    ----------
    fixed : ndarray, shape (N, w)
        A0, B0, B1, B2; complex with a complex stiffness, as the next.
    scaled : ndarray, shape (k, N, w)
        A_j, and what belongs to the gain in the others, for each measured coordinate.
    places, speeds : ndarray, shape (m, w)
        z and z'.
    feedback : list of (ndarray, ndarray)
        Movement that each actuator measures behind its filter, and its derivative, each of shape (w,).
    winches : ndarray, shape (i, r)
        What the loop reels in by the last r states; r is zero without a loop.
    """

    fixed: np.ndarray
    scaled: np.ndarray
    places: np.ndarray
    speeds: np.ndarray
    feedback: list
    winches: np.ndarray


def equations(motion, allocation=None, notches=(), law=NOTHING, forces=None):
    """The `Equations` of a motion.

    Parameters
    ----------
    motion : LinearSystem
    allocation : Allocation, optional
        Without it there is no loop.
    notches : tuple of (Notch or None)
        Of each measured coordinate.
    law : tuple of 4 ndarray
        s C1 as a state space: see `Law.state_space`.
    forces : ndarray, shape (m, j), optional
        Force on each coordinate by each force; without it there are no inputs, and winches move by the loop alone.

    Notes
    -----
    Of an integrator v' and v'' are sums of states: v' = -gain A e with e = N (y - r) = c n + d (y - r), and v'' = -gain
    A (c n' + d (y' - r')). The allocation A is taken as U R with independent columns U, so that the winches have as
    many states as movements. Another law is between U and R: v' = U q, q = c l + d w, l' = a l + b w, w = -gain R e.
    """
    a, b, c, d = law
    m, unit = len(motion), motion.unit
    filters = sum(1 for one in motion.feedback if one.corner)
    own = [notch for notch in notches if notch is not None]
    left, rates = _independent(allocation.shares) if allocation else (np.zeros((motion.b[0].shape[1], 0)),) * 2
    movements = left.shape[1]
    size = 2 * m + filters + 2 * len(own) + (len(a) + 1) * movements
    references = len(notches) if allocation and forces is not None else 0
    inputs = 0 if forces is None else references + len(left) + forces.shape[1]
    places, speeds = np.zeros((2, m, size + 3 * inputs))
    places[:, :m], speeds[:, m : 2 * m] = np.diag(1 / unit), np.eye(m)
    width, entries = size + 3 * inputs, motion.stiffness.dtype
    fixed, scaled = np.zeros((size, width), entries), np.zeros((len(notches), size, width), entries)
    fixed[:m, m : 2 * m] = np.diag(unit)
    force = -motion.stiffness @ places - motion.damping @ speeds
    feedback = _feedback(motion, places, speeds, fixed)
    for one, (moved, moving) in zip(motion.feedback, feedback, strict=True):
        force += np.outer(one.acts, one.velocity_gain * moving + one.position_gain * moved)
    if forces is not None:
        force[:, size + inputs - forces.shape[1] : size + inputs] += forces
        for order, part in enumerate(motion.b):
            force[:, size + order * inputs + references :][:, : len(left)] += part
    if allocation:
        moved, moving = allocation.measured @ places, allocation.measured @ speeds
        if inputs:
            moved[:, size : size + references] -= np.eye(references)
            moving[:, size + inputs : size + inputs + references] -= np.eye(references)
        begin, each = size - movements, np.eye(movements)
        laws = slice(begin - len(a) * movements, begin)
        _notched(notches, moved, moving, fixed, 2 * m + filters)
        zeroth, first, second = (part @ left for part in motion.b)
        force[:, begin:size] += zeroth
        if len(a):
            force[:, laws] += np.kron(first, c) + np.kron(second, c @ a)
            fixed[laws, laws], fixed[begin:, laws] = np.kron(each, a), np.kron(each, c)
        first, second = (motion.accelerated(part) for part in (first, second))
        for one, column, error, rate in zip(scaled, rates.T, moved, moving, strict=True):
            if len(a):
                one[laws] = -np.outer(np.kron(column, b), error)
            one[begin:] = -d * np.outer(column, error)
            one[m : 2 * m] = -np.outer((d * first + (c @ b) * second) @ column, error)
            one[m : 2 * m] -= d * np.outer(second @ column, rate)
    fixed[m : 2 * m] = motion.accelerated(force)
    return Equations(fixed, scaled, places, speeds, feedback, left)


def _feedback(motion, places, speeds, fixed):
    """What each actuator measures behind its filter, and its derivative; fills the rows of `fixed` of the filters."""
    found, begin = [], 2 * len(motion)
    for one in motion.feedback:
        moved, moving = one.measured @ places, one.measured @ speeds
        if one.corner:  # h(s) x = x - l, l' = w_h (x - l)
            moved[begin] -= 1.0
            fixed[begin] = one.corner * moved
            moving -= fixed[begin].real
            begin += 1
        found.append((moved, moving))
    return found


def _notched(notches, moved, moving, fixed, begin):
    """Replaces what is measured, and its derivative, by what is behind the notches; fills the rows of `fixed` of these.

    Parameters
    ----------
    notches : tuple of (Notch or None)
    moved, moving : ndarray, shape (k, w)
    fixed : ndarray, shape (N, w)
    begin : int
        Where the states of the notches begin.
    """
    for place, notch in enumerate(notches):
        if notch is None:
            continue
        a, b, c, d = notch.state_space
        states = slice(begin, begin + 2)
        fixed[states, states] = a
        fixed[states] += np.outer(b, moved[place])
        moving[place] = d * moving[place] + c @ fixed[states].real
        moved[place] *= d
        moved[place, states] += c
        begin += 2


def _independent(shares):
    """A as the product of independent movements of the winches, shape (i, r), and their rates, shape (r, k).

    In each movement the winch that moves most reels in.
    """
    left, values, right = np.linalg.svd(shares, full_matrices=False)
    kept = values > SYSTEM.uncorrected * values.max(initial=0.0)
    left, right = left[:, kept], values[kept, None] * right[kept]
    sign = np.sign(np.take_along_axis(left, np.abs(left).argmax(axis=0)[None], axis=0))[0]
    return left * sign, right * sign[:, None]


def rows(system, forces=None, loop=None, actuators=()):
    """A system, with its loop closed or without one, as rows over x, u, u', u'' with the inputs of `Equations`.

    Parameters
    ----------
    system : LinearSystem
    forces : ndarray, shape (m, j), optional
        Force on each coordinate by each input that is a force; without it there are no inputs.
    loop : LinearControl or Loop, optional
    actuators : sequence of Actuator
        Those of the system.

    Returns
    -------
    found : Equations
    whole : ndarray, shape (N, w)
        x'.
    reeled : tuple of 2 ndarray, shape (i, w)
        What the loop reels in, and its speed.
    shown : ndarray, shape (o + a, w)
        Outputs of the system, then two of each actuator: stroke and force, or momentum and torque.
    """
    if forces is None:
        found = (loop or system).equations
    else:
        found = equations(system, *((loop.allocation, loop.notches, loop.law_space) if loop else ()), forces=forces)
    whole = found.fixed + (loop.gain * found.scaled.sum(axis=0) if loop else 0.0)
    m, size, (winches, movements) = len(system), len(whole), found.winches.shape
    inputs = (whole.shape[1] - size) // 3

    def derivative(row):
        """Of rows over x, u, u', u'' that have no part of u''."""
        shifted = np.zeros_like(row)
        shifted[:, size + inputs :] = row[:, size : size + 2 * inputs]
        return row[:, :size] @ whole + shifted

    reeled = np.zeros((winches, whole.shape[1]))
    reeled[:, size - movements : size] = found.winches
    speed = derivative(reeled)
    lengths = [reeled, speed, derivative(speed)] if loop else np.zeros((3, *reeled.shape))
    if inputs:
        added = inputs - forces.shape[1] - winches  # after the references
        for order, part in enumerate(lengths):
            lengths[order] = part + np.eye(*part.shape, size + order * inputs + added)
    moving = found.places, found.speeds, whole[m : 2 * m]
    shown = sum(part @ one for part, one in zip(system.c, moving, strict=True))
    shown += sum(part @ one for part, one in zip(system.d, lengths, strict=True))
    outputs = [shown]
    strokes = iter(found.places[m - sum(not one.wheel for one in actuators) :])
    for one, (moved, rate) in zip(actuators, found.feedback, strict=True):
        force = one.velocity_gain * rate + one.position_gain * moved
        outputs.append([one.velocity_gain * moved, force] if one.wheel else [next(strokes), force])
    return found, whole, (reeled, speed), np.concatenate(outputs)
