"""First-order (state-space) equations of a linear system, with the control loop of its winches or without it.

    x' = (A0 + gain sum A_j) x + B0 u + B1 u' + B2 u''

The entries of each matrix row are coefficients of the states x and, where there are inputs, of u, u' and u''. States:
z times `LinearSystem.unit` (z the coordinates), z', the low-passed movement of each actuator with a high-pass filter,
two states of each notch filter, the states of the control law of each independent movement of the winches, and these
movements themselves. Inputs: with the loop the references r of the measured coordinates; the lengths that the winches
reel in, beyond those that the loop commands; forces.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system.tolerances import SYSTEM

NOTHING = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0  # a law of no states that passes what it is given


@dataclass(frozen=True)
class Allocation:
    """Measured coordinates of a control loop, and how their errors are shared among the winches.

    Attributes
    ----------
    measured : ndarray, shape (k, m)
        The k measured coordinates per unit of each of the m coordinates of the motion.
    shares : ndarray, shape (i, k)
        A: length that each of the i winches reels in per error of each measured coordinate. [-], [m/rad]
    static_gain : ndarray, shape (k, i), optional
        G: static movement of the measured coordinates per length reeled in. [-], [rad/m]
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
    """The equations of the module's docstring, N states, p inputs; w = N columns, or N + 3 p with inputs.

    Attributes
    ----------
    fixed : ndarray, shape (N, w)
        A0, B0, B1, B2: the part of the equations without the loop gain; complex with a complex stiffness, as the next.
    scaled : ndarray, shape (k, N, w)
        The part that the loop gain multiplies, such as A_j, for each measured coordinate j.
    places, speeds : ndarray, shape (m, w)
        Rows that give the coordinates z and their rates z'.
    feedback : list of (ndarray, ndarray)
        Rows, shape (w,), of the movement that each actuator measures behind its filter, and of its rate.
    winches : ndarray, shape (i, r)
        Length that the loop reels in at each winch per unit of the last r states; r is zero without a loop.
    """

    fixed: np.ndarray
    scaled: np.ndarray
    places: np.ndarray
    speeds: np.ndarray
    feedback: list
    winches: np.ndarray


def equations(motion, allocation=None, notches=(), law=NOTHING, forces=None):
    """Assemble the first-order `Equations` of a linear system, its control loop closed if there is one.

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
    A (c n' + d (y' - r')). A, `Allocation.shares`, is taken as U R with independent columns U, so that the winches have
    as many states as movements. Another law is between U and R: v' = U q, q = c l + d w, l' = a l + b w, w = -gain R e.
    """
    a, b, c, d = law
    m, unit = len(motion), motion.unit
    filters = sum(1 for actuator in motion.feedback if actuator.corner)
    winches = motion.b[0].shape[1]
    movements, rates = _independent(allocation.shares) if allocation else (np.zeros((winches, 0)),) * 2  # U and R
    r = movements.shape[1]
    size = 2 * m + filters + 2 * sum(notch is not None for notch in notches) + (len(a) + 1) * r
    references = len(notches) if allocation and forces is not None else 0
    inputs = 0 if forces is None else references + winches + forces.shape[1]
    width, dtype = size + 3 * inputs, motion.stiffness.dtype
    z, z_rate = np.zeros((2, m, width))
    z[:, :m], z_rate[:, m : 2 * m] = np.diag(1 / unit), np.eye(m)
    fixed, scaled = np.zeros((size, width), dtype), np.zeros((len(notches), size, width), dtype)
    fixed[:m, m : 2 * m] = np.diag(unit)
    force = -motion.stiffness @ z - motion.damping @ z_rate
    feedback = _feedback(motion, z, z_rate, fixed)
    for actuator, (movement, speed) in zip(motion.feedback, feedback, strict=True):
        force += np.outer(actuator.acts, actuator.velocity_gain * speed + actuator.position_gain * movement)
    if forces is not None:
        force[:, size + inputs - forces.shape[1] : size + inputs] += forces
        for order, matrix in enumerate(motion.b):
            force[:, size + order * inputs + references :][:, :winches] += matrix
    if allocation:
        error, error_rate = allocation.measured @ z, allocation.measured @ z_rate  # y - r, then e behind the notches
        if inputs:
            error[:, size : size + references] -= np.eye(references)
            error_rate[:, size + inputs : size + inputs + references] -= np.eye(references)
        _filter_by_notches(notches, error, error_rate, fixed, 2 * m + filters)
        begin = size - r  # of the movements of the winches; the states of the laws are before them
        laws = slice(begin - len(a) * r, begin)
        by_length, by_speed, by_acceleration = (matrix @ movements for matrix in motion.b)
        force[:, begin:size] += by_length
        if len(a):
            force[:, laws] += np.kron(by_speed, c) + np.kron(by_acceleration, c @ a)
            fixed[laws, laws], fixed[begin:, laws] = np.kron(np.eye(r), a), np.kron(np.eye(r), c)
        accelerated = motion.accelerated(np.concatenate([by_speed, by_acceleration], axis=1))
        by_speed, by_acceleration = np.split(accelerated, 2, axis=1)
        for rows_of_gain, column, e, e_rate in zip(scaled, rates.T, error, error_rate, strict=True):
            if len(a):
                rows_of_gain[laws] = -np.outer(np.kron(column, b), e)
            rows_of_gain[begin:] = -d * np.outer(column, e)
            rows_of_gain[m : 2 * m] = -np.outer((d * by_speed + (c @ b) * by_acceleration) @ column, e)
            rows_of_gain[m : 2 * m] -= d * np.outer(by_acceleration @ column, e_rate)
    fixed[m : 2 * m] = motion.accelerated(force)
    return Equations(fixed, scaled, z, z_rate, feedback, movements)


def _feedback(motion, z, z_rate, fixed):
    """Movement that each actuator measures behind its filter, and its rate: list of two rows over states and inputs.

    Fills the rows of `fixed` of the filters.
    """
    feedback, state = [], 2 * len(motion)
    for actuator in motion.feedback:
        movement, rate = actuator.measured @ z, actuator.measured @ z_rate
        if actuator.corner:  # h(s) x = x - l, l' = w_h (x - l)
            movement[state] -= 1.0
            fixed[state] = actuator.corner * movement
            rate -= fixed[state].real
            state += 1
        feedback.append((movement, rate))
    return feedback


def _filter_by_notches(notches, error, error_rate, fixed, begin):
    """Pass the control errors through the notch filters, in place, and write the equations of the filters' states.

    Parameters
    ----------
    notches : tuple of (Notch or None)
        Filter of each measured coordinate; None leaves its error as it is.
    error, error_rate : ndarray, shape (k, w)
        Rows that give the errors and their rates; on return those behind the filters.
    fixed : ndarray, shape (N, w)
        `Equations.fixed`; on return with the rows of the filters' states, two for each filter.
    begin : int
        Index of the first of these states.
    """
    for coordinate, notch in enumerate(notches):
        if notch is None:
            continue
        a, b, c, d = notch.state_space
        states = slice(begin, begin + 2)
        fixed[states, states] = a
        fixed[states] += np.outer(b, error[coordinate])
        error_rate[coordinate] = d * error_rate[coordinate] + c @ fixed[states].real
        error[coordinate] *= d
        error[coordinate, states] += c
        begin += 2


def _independent(shares):
    """Allocation A as a product U R: independent movements of the winches, (i, r), and their rates by errors, (r, k).

    The sign of each movement is such that the winch that moves most reels in.
    """
    left, values, right = np.linalg.svd(shares, full_matrices=False)
    kept = values > SYSTEM.uncorrected * values.max(initial=0.0)
    left, right = left[:, kept], values[kept, None] * right[kept]
    sign = np.sign(np.take_along_axis(left, np.abs(left).argmax(axis=0)[None], axis=0))[0]
    return left * sign, right * sign[:, None]


def rows(system, forces=None, loop=None, actuators=()):
    """Rows that give the state derivative, the winch movements and the outputs of a system, with its loop or without.

    The entries of a row multiply the N states x, then u, u' and u'': w columns in all. State-space models
    (`control.statespace`, `control.loop_state_space`) are made of these rows.

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
    first_order : Equations
    state_rate : ndarray, shape (N, w)
        x'.
    reeled : tuple of 2 ndarray, shape (i, w)
        Length that the loop reels in at each winch, and its speed.
    outputs : ndarray, shape (o + 2 a, w)
        Outputs of the system, then those of the actuators, see `_actuator_outputs`.
    """
    if forces is None:
        first_order = (loop or system).equations
    else:
        of_loop = (loop.allocation, loop.notches, loop.law_space) if loop else ()
        first_order = equations(system, *of_loop, forces=forces)
    state_rate = first_order.fixed + (loop.gain * first_order.scaled.sum(axis=0) if loop else 0.0)
    m, size, (winches, movements) = len(system), len(state_rate), first_order.winches.shape
    inputs = (state_rate.shape[1] - size) // 3

    def derivative(row):
        """Rows of the time derivatives of the quantities that some rows give, none of which depends on u''."""
        of_inputs = np.zeros_like(row)  # coefficients of u and u' become those of u' and u''
        of_inputs[:, size + inputs :] = row[:, size : size + 2 * inputs]
        return row[:, :size] @ state_rate + of_inputs

    reeled = np.zeros((winches, state_rate.shape[1]))
    reeled[:, size - movements : size] = first_order.winches
    speed = derivative(reeled)
    lengths = [reeled, speed, derivative(speed)] if loop else np.zeros((3, *reeled.shape))  # l, l' and l''
    if inputs:
        first_length = inputs - forces.shape[1] - winches  # index of the first input that is a length
        for order, by_loop in enumerate(lengths):
            lengths[order] = by_loop + np.eye(*by_loop.shape, size + order * inputs + first_length)
    motions = first_order.places, first_order.speeds, state_rate[m : 2 * m]  # z, z' and z''
    of_system = sum(matrix @ motion for matrix, motion in zip(system.c, motions, strict=True))
    of_system += sum(matrix @ length for matrix, length in zip(system.d, lengths, strict=True))
    outputs = np.concatenate([of_system, *_actuator_outputs(first_order, actuators)])
    return first_order, state_rate, (reeled, speed), outputs


def _actuator_outputs(first_order, actuators):
    """Rows of each actuator: stroke and force of a reaction mass, or momentum and torque of a wheel; list of pairs."""
    outputs, coordinates = [], first_order.places
    strokes = iter(coordinates[len(coordinates) - sum(not actuator.wheel for actuator in actuators) :])  # the last ones
    for actuator, (movement, rate) in zip(actuators, first_order.feedback, strict=True):
        force = actuator.velocity_gain * rate + actuator.position_gain * movement
        outputs.append([actuator.velocity_gain * movement, force] if actuator.wheel else [next(strokes), force])
    return outputs
