"""First-order (state-space) equations of a linear system, with the control loop of its winches or without it.

    x' = (A0 + gain sum A_j) x + B0 u + B1 u' + B2 u''

Matrices may have leading axes, of many rows (...). The entries of each matrix row are coefficients of the states x and,
where there are inputs, of u, u' and u''. States:
z times `LinearSystem.unit` (z the coordinates), z', the low-passed movement of each actuator with a high-pass filter,
two states of each notch filter, the states of the control law of each independent movement of the winches, and these
movements themselves. Inputs: with the loop the references r of the measured coordinates; the lengths that the winches
reel in, beyond those that the loop commands; forces.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

NOTHING = np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0  # a law of no states that passes what it is given


@dataclass(frozen=True)
class Allocation:
    """Measured coordinates of a control loop, and how their errors are shared among the winches.

    Attributes
    ----------
    measured : ndarray, shape (..., k, m)
        The k measured coordinates per unit of each of the m coordinates of the motion.
    movements : ndarray, shape (..., i, r)
        U: independent movements of the i winches, of length 1. The winch that moves most reels in.
    rates : ndarray, shape (..., r, k)
        R: each of these movements per error of each measured coordinate. [-], [m/rad]
    """

    measured: np.ndarray
    movements: np.ndarray
    rates: np.ndarray

    @cached_property
    def matrix(self):
        """A = U R: length that each winch reels in per error of each measured coordinate, (..., i, k). [-], [m/rad]"""
        return self.movements @ self.rates

    @staticmethod
    def stack(allocations):
        """`Allocation` of n rows from those of each, whose winches have equally many independent movements."""
        parts = zip(*((one.measured, one.movements, one.rates) for one in allocations), strict=True)
        return Allocation(*map(np.stack, parts))

    def take(self, rows):
        """`Allocation` of some of many rows."""
        return Allocation(self.measured[rows], self.movements[rows], self.rates[rows])

    def within(self, space):
        """`Allocation` with new coordinates q of the motion, z = S q, with S of shape (..., m, r)."""
        return replace(self, measured=self.measured @ space)


@dataclass(frozen=True)
class LinearControl:
    """Control law that closes the loop, as `Loop` has it too.

    Attributes
    ----------
    allocation : Allocation
    gain : float or ndarray, shape (...)
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

    @staticmethod
    def stack(loops):
        """`LinearControl` of n rows from loops whose allocations, notches and laws have equal shapes."""
        notches = tuple(of_rows[0] and type(of_rows[0]).stack(of_rows) for of_rows in zip(*(
            loop.notches for loop in loops), strict=True))  # fmt: skip
        law_space = tuple(map(np.stack, zip(*(loop.law_space for loop in loops), strict=True)))
        gain = np.array([loop.gain for loop in loops])
        return LinearControl(Allocation.stack([loop.allocation for loop in loops]), gain, notches, law_space, [])

    def take(self, rows):
        """`LinearControl` of some of many rows."""
        notches = tuple(notch and notch.take(rows) for notch in self.notches)
        law_space = tuple(part[rows] for part in self.law_space)
        return LinearControl(self.allocation.take(rows), self.gain[rows], notches, law_space, [])

    def within(self, space):
        """The law with new coordinates q, z = S q, with S of shape (..., m, r)."""
        return replace(self, allocation=self.allocation.within(space))


@dataclass(frozen=True)
class Equations:
    """The equations of the module's docstring, N states, p inputs; w = N columns, or N + 3 p with inputs.

    Attributes
    ----------
    fixed : ndarray, shape (..., N, w)
        A0, B0, B1, B2: the part of the equations without the loop gain; complex with a complex stiffness, as the next.
    scaled : ndarray, shape (..., k, N, w)
        The part that the loop gain multiplies, such as A_j, for each measured coordinate j.
    coordinates, rates : ndarray, shape (..., m, w)
        Rows that give the coordinates z and their rates z'.
    feedback : list of (ndarray, ndarray)
        Rows, shape (..., w), of the movement that each actuator measures behind its filter, and of its rate.
    winches : ndarray, shape (..., i, r)
        Length that the loop reels in at each winch per unit of the last r states; r is zero without a loop.
    """

    fixed: np.ndarray
    scaled: np.ndarray
    coordinates: np.ndarray
    rates: np.ndarray
    feedback: list
    winches: np.ndarray

    def take(self, row):
        """`Equations` of one row of many, or of some."""
        arrays = (getattr(self, name)[row] for name in ("fixed", "scaled", "coordinates", "rates"))
        feedback = [(movement[row], rate[row]) for movement, rate in self.feedback]
        return Equations(*arrays, feedback, self.winches[row])

    def with_gain(self, gain):
        """A0 + gain sum A_j, and the matrices of the inputs, shape (..., N, w), for gains [rad/s] of shape (...)."""
        return self.fixed + np.asarray(gain)[..., None, None] * self.scaled.sum(axis=-3)


def equations(motion, allocation=None, notches=(), law=NOTHING, forces=None):
    """First-order `Equations` of a linear system of m coordinates, with its control loop closed if there is one.

    Parameters
    ----------
    motion : LinearSystem
        M z'' + C z' + K z = forces, with the i winches as inputs.
    allocation : Allocation, optional
        Measured coordinates y of the loop, and how their errors are shared among the winches; without it no loop.
    notches : tuple of (Notch or None)
        Notch filter of each measured coordinate.
    law : tuple of 4 ndarray
        State space a, b, c, d of s C1, the control law C1 times s; see `Law.state_space_of`. Default: an integrator.
    forces : ndarray, shape (..., m, j), optional
        Force on each coordinate by each of j forces. Without it there are no inputs, and winches move by the loop
        alone.

    Returns
    -------
    Equations

    Notes
    -----
    The error behind the notches N is e = N (y - r), with references r: with the states n of the notches,
    e = c_n n + d_n (y - r). An integrator moves the winches by v with v' = -gain A e and
    v'' = -gain A (c_n n' + d_n (y' - r')). Both are sums of states and inputs.

    A = U R, the columns of U being independent movements of the winches (`Allocation`). So one state p for each of them
    is enough, v = U p. Another law has states l between R and U: p' = c l + d w, l' = a l + b w, w = -gain R e.
    """
    m, unit, leading, order = len(motion), motion.unit, motion.mass.shape[:-2], np.asarray(law[0]).shape[-1]
    filters = sum(actuator.filtered for actuator in motion.feedback)
    winches = motion.b[0].shape[-1]
    movements = allocation.movements if allocation else np.zeros((*leading, winches, 0))
    r = movements.shape[-1]
    size = 2 * m + filters + 2 * sum(notch is not None for notch in notches) + (order + 1) * r
    references = len(notches) if allocation and forces is not None else 0
    inputs = 0 if forces is None else references + winches + forces.shape[-1]
    width, dtype, index = size + 3 * inputs, motion.stiffness.dtype, np.arange(m)
    # rows over the states and inputs, which give: the coordinates and their rates, the rates of the states without what
    # the loop gain multiplies, that part, and the force on each coordinate
    z, z_rate = np.zeros((2, *leading, m, width))
    fixed = np.zeros((*leading, size, width), dtype)
    scaled = np.zeros((*leading, len(notches), size, width), dtype)
    force = np.zeros((*leading, m, width), dtype)
    z[..., index, index], z_rate[..., index, m + index] = 1 / unit, 1.0
    fixed[..., index, m + index] = unit
    force[..., :m], force[..., m : 2 * m] = -motion.stiffness * (1 / unit)[..., None, :], -motion.damping
    feedback = _feedback(motion, z, z_rate, fixed)
    for actuator, measured in zip(motion.feedback, feedback, strict=True):
        force += _outer(actuator.acts, _force_of_actuator(actuator, *measured))
    if forces is not None:
        force[..., size + inputs - forces.shape[-1] : size + inputs] += forces
        for derivative, matrix in enumerate(motion.b):
            force[..., size + derivative * inputs + references :][..., :winches] += matrix
    if allocation:
        error, error_rate = allocation.measured @ z, allocation.measured @ z_rate  # y - r, then e behind the notches
        if inputs:
            error[..., size : size + references] -= np.eye(references)
            error_rate[..., size + inputs : size + inputs + references] -= np.eye(references)
        _filter_by_notches(notches, error, error_rate, fixed, 2 * m + filters)
        _add_law(motion, allocation, law, (error, error_rate), force, fixed, scaled)
    fixed[..., m : 2 * m, :] = motion.accelerations(force)
    return Equations(fixed, scaled, z, z_rate, feedback, movements)


def _add_law(motion, allocation, law, errors, force, fixed, scaled):
    """Add the control law and the winches to the rows of the first-order equations that `equations` makes, in place.

    With the errors e behind the notches, and the state space a, b, c, d of the law, the r independent winch movements p
    and the states l of the law obey

        p' = c l + d w,    l' = a l + b w,    w = -gain R e,    v = U p.

    The lengths v that winches reel in, v' and v'' act on the m coordinates by B0, B1 and B2. Terms with the gain go
    into `scaled`, others into `force` and `fixed`. "Rows" hold the coefficients of the N states and of the inputs,
    N_c columns in all.

    Parameters
    ----------
    motion : LinearSystem
        Of m coordinates, with B0, B1 and B2.
    allocation : Allocation
        R: movements by errors; U: lengths that winches reel in by movements.
    law : tuple of 4 ndarray
        a, b, c, d.
    errors : (ndarray, ndarray)
        Rows that give e and e' of the k measured coordinates, shape (..., k, N_c) both.
    force : ndarray, shape (..., m, N_c)
        Rows that give the force on each coordinate, without what the gain multiplies.
    fixed, scaled : ndarray, shapes (..., N, N_c) and (..., k, N, N_c)
        Rows that give the rates of the states: the part without the gain; and the part that the gain multiplies, by the
        error of each measured coordinate.
    """
    a, b, c, d = law
    m, size, order, r = len(motion), fixed.shape[-2], np.asarray(a).shape[-1], allocation.movements.shape[-1]
    begin = size - r  # of the movements of the winches; the states of the laws are before them
    laws = slice(begin - order * r, begin)
    by_length, by_speed, by_acceleration = (matrix @ allocation.movements for matrix in motion.b)
    force[..., begin:size] += by_length
    c_rows = np.asarray(c)[..., None, :]
    if order:
        force[..., laws] += _kron(by_speed, c_rows) + _kron(by_acceleration, c_rows @ a)
        fixed[..., laws, laws], fixed[..., begin:, laws] = _kron(np.eye(r), a), _kron(np.eye(r), c_rows)
    accelerated = motion.accelerations(np.concatenate([by_speed, by_acceleration], axis=-1))
    by_speed, by_acceleration = np.split(accelerated, 2, axis=-1)
    direct, c_b = np.asarray(d)[..., None, None], (c_rows @ np.asarray(b)[..., None])
    for number in range(scaled.shape[-3]):
        rows_of_gain, column = scaled[..., number, :, :], allocation.rates[..., number]
        e, e_rate = (rows[..., number, :] for rows in errors)
        if order:
            rows_of_gain[..., laws, :] = -_outer(_kron(column[..., None], np.asarray(b)[..., None])[..., 0], e)
        rows_of_gain[..., begin:, :] = -direct * _outer(column, e)
        by_error = ((direct * by_speed + c_b * by_acceleration) @ column[..., None])[..., 0]
        rows_of_gain[..., m : 2 * m, :] = -_outer(by_error, e)
        rows_of_gain[..., m : 2 * m, :] -= direct * _outer((by_acceleration @ column[..., None])[..., 0], e_rate)


def _outer(column, row):
    """Products of the entries of vectors, shapes (..., p) and (..., q): shape (..., p, q)."""
    return column[..., :, None] * row[..., None, :]


def _kron(first, second):
    """Kronecker products of matrices, shapes (..., p, q) and (..., k, l): shape (..., p k, q l)."""
    product = first[..., :, None, :, None] * np.asarray(second)[..., None, :, None, :]
    *leading, rows, rows_of_second, columns, columns_of_second = product.shape
    return product.reshape(*leading, rows * rows_of_second, columns * columns_of_second)


def _feedback(motion, z, z_rate, fixed):
    """Movement that each actuator measures behind its filter, and its rate: list of two rows over states and inputs.

    Fills the rows of `fixed` of the filters.
    """
    feedback, state = [], 2 * len(motion)
    for actuator in motion.feedback:
        measured = actuator.measured[..., None, :]
        movement, rate = (measured @ z)[..., 0, :], (measured @ z_rate)[..., 0, :]
        if actuator.filtered:  # h(s) x = x - l, l' = w_h (x - l)
            movement[..., state] -= 1.0
            fixed[..., state, :] = np.asarray(actuator.corner)[..., None] * movement
            rate -= fixed[..., state, :].real
            state += 1
        feedback.append((movement, rate))
    return feedback


def _force_of_actuator(feedback, movement, rate):
    """Row that gives the force, or torque, of an actuator from those of what it measures, and of its rate, (..., w)."""
    velocity_gain, position_gain = (
        np.asarray(gain)[..., None] for gain in (feedback.velocity_gain, feedback.position_gain)
    )
    return velocity_gain * rate + position_gain * movement


def _filter_by_notches(notches, error, error_rate, fixed, begin):
    """Pass the control errors through the notch filters, in place, and write the equations of the filters' states n.

    Each filter turns an error e into c n + d e, with n' = a n + b e. "Rows" hold the coefficients of the N states and
    of the inputs, w columns in all.

    Parameters
    ----------
    notches : tuple of (Notch or None)
        Filter of each of the k measured coordinates; None leaves its error as it is.
    error, error_rate : ndarray, shape (..., k, w)
        Rows that give the errors and their rates; on return those behind the filters.
    fixed : ndarray, shape (..., N, w)
        Rows of the state rates; on return with those of the filters' states, two for each filter.
    begin : int
        Index of the first of these states.
    """
    for coordinate, notch in enumerate(notches):
        if notch is None:
            continue
        a, b, c, d = notch.state_space
        d = np.asarray(d)[..., None]
        states = slice(begin, begin + 2)
        fixed[..., states, states] = a
        fixed[..., states, :] += _outer(b, error[..., coordinate, :])
        by_states = (c[..., None, :] @ fixed[..., states, :].real)[..., 0, :]
        error_rate[..., coordinate, :] = d * error_rate[..., coordinate, :] + by_states
        error[..., coordinate, :] *= d
        error[..., coordinate, states] += c
        begin += 2


def state_rows(system, forces=None, loop=None, actuators=()):
    """Rows of coefficients for the matrices of state spaces: they give x', the winch movements and the outputs.

    A row has the coefficients of the N states x; then, if there are `forces`, those of the p inputs u, of u' and of
    u'': w = N or N + 3 p columns.

    Parameters
    ----------
    system : LinearSystem
        Of m coordinates z, i winches as inputs, and o outputs.
    forces : ndarray, shape (..., m, j), optional
        Force on each coordinate by each of j forces; without it there are no inputs.
    loop : LinearControl or Loop, optional
        Control loop of the winches; without it only inputs move them.
    actuators : sequence of Actuator
        The a actuators of the system.

    Returns
    -------
    first_order : Equations
    state_rate : ndarray, shape (..., N, w)
        x'.
    reeled : tuple of 2 ndarray, shape (..., i, w)
        Length that the loop reels in at each winch, and its speed.
    outputs : ndarray, shape (..., o + 2 a, w)
        Outputs of the system, then stroke and force of each reaction mass, or momentum and torque of each wheel.

    Notes
    -----
    The inputs u are, in this order, the references of the loop, the lengths u_w that the winches reel in beside the
    loop, and the forces. In all the winches reel in l = l_loop + u_w, where l_loop is `Equations.winches` times the
    last states. The outputs of the system are y = C0 z + C1 z' + C2 z'' + D0 l + D1 l' + D2 l''.
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
    of_actuators = [row[..., None, :] for pair in _actuator_outputs(first_order, system, actuators) for row in pair]
    outputs = np.concatenate([of_system, *of_actuators], axis=-2)
    return first_order, state_rate, (reeled, speed), outputs


def _actuator_outputs(first_order, system, actuators):
    """Rows of each actuator: stroke and force of a reaction mass, or momentum and torque of a wheel; list of pairs."""
    outputs, coordinates = [], first_order.coordinates
    stroke = coordinates.shape[-2] - sum(not actuator.wheel for actuator in actuators)  # the last coordinates
    of_actuators = zip(actuators, system.feedback, first_order.feedback, strict=True)
    for actuator, feedback, (movement, rate) in of_actuators:
        momentum = np.asarray(feedback.velocity_gain)[..., None] * movement
        force = _force_of_actuator(feedback, movement, rate)
        outputs.append((momentum if actuator.wheel else coordinates[..., stroke, :], force))
        stroke += not actuator.wheel
    return outputs
