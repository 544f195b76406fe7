"""First-order (state-space) equations of a linear system, with the control loop of its winches or without it.

    x' = (A0 + gain A1) x + B0 u + B1 u' + B2 u''

Matrices may have leading axes, of many rows (...). The entries of each matrix row are coefficients of the states x and,
where there are inputs, of u, u' and u''. States:
z times `LinearSystem.unit` (z the coordinates), z', the low-passed movement of each actuator with a high-pass filter,
two states of each notch filter, the states of the control law of each independent movement of the winches, and these
movements themselves. Inputs: with the loop the references r of the measured coordinates; the lengths that the winches
reel in, beyond those that the loop commands; forces.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate

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

    def within(self, space):
        """`Allocation` with new coordinates q of the motion, z = S q, with S of shape (..., m, r)."""
        return replace(self, measured=self.measured @ space)


@dataclass(frozen=True)
class LinearControl:
    """Control law that closes the loop; of many rows too.

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
    scaled : ndarray, shape (..., N, w)
        The part that the loop gain multiplies, such as A1.
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

    def with_gain(self, gain):
        """A0 + gain A1, and the matrices of the inputs, shape (..., N, w), for gains [rad/s] of shape (...)."""
        return self.fixed + np.asarray(gain)[..., None, None] * self.scaled


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
    rows = _EquationRows(motion, allocation, notches, law, forces)
    m, columns, index = len(motion), rows.columns, np.arange(len(motion))
    # z and z' from the states, and (unit z)' = unit z'
    rows.coordinates[..., index, index] = 1 / motion.unit
    rows.rates[..., index, m + index] = 1.0
    rows.fixed[..., index, m + index] = motion.unit
    # forces -K z - C z' on the coordinates, those of actuators, and by the inputs
    rows.force[..., columns.displacements] = -motion.stiffness * (1 / motion.unit)[..., None, :]
    rows.force[..., columns.rates] = -motion.damping
    feedback = _feedback(motion, rows)
    for actuator, measured in zip(motion.feedback, feedback, strict=True):
        rows.force += _outer(actuator.acts, force_of_actuator(actuator, *measured))
    if forces is not None:
        rows.force[..., columns.input(columns.forces)] += forces
        for order, matrix in enumerate(motion.b):
            rows.force[..., columns.input(columns.winches, order)] += matrix
    if allocation:
        error, error_rate = allocation.measured @ rows.coordinates, allocation.measured @ rows.rates  # y - r, its rate
        if forces is not None:
            error[..., columns.input(columns.references)] -= np.eye(len(notches))
            error_rate[..., columns.input(columns.references, 1)] -= np.eye(len(notches))
        _filter_by_notches(notches, error, error_rate, rows)
        _add_law(motion, allocation, law, (error, error_rate), rows)
    rows.fixed[..., columns.rates, :] = motion.accelerations(rows.force)
    at_rest = np.zeros((*motion.mass.shape[:-2], motion.b[0].shape[-1], 0))  # winches without a loop
    winches = allocation.movements if allocation else at_rest
    return Equations(rows.fixed, rows.scaled, rows.coordinates, rows.rates, feedback, winches)


class _EquationColumns:
    """Columns of the rows that `equations` makes: coefficients of the N states, then of the p inputs u, of u' and u''.

    Parameters
    ----------
    motion, allocation, notches, law, forces
        As of `equations`.

    Attributes
    ----------
    displacements, rates, filters, notches, law, movements : slice
        States, in this order: z times its unit, z', those of actuators' filters, two of each notch, of the control law
        for each independent movement of the winches, and these movements.
    references, winches, forces : slice
        Inputs, in this order, see `input`.
    states, inputs, count : int
        N, p and the number of all columns.
    """

    def __init__(self, motion, allocation, notches, law, forces):
        m, movements = len(motion), allocation.movements.shape[-1] if allocation else 0
        filters = sum(actuator.filtered for actuator in motion.feedback)
        of_notches = 2 * sum(notch is not None for notch in notches)
        of_law = np.asarray(law[0]).shape[-1] * movements
        states = _consecutive(m, m, filters, of_notches, of_law, movements)
        self.displacements, self.rates, self.filters, self.notches, self.law, self.movements = states
        references = len(notches) if allocation else 0
        sizes = (0, 0, 0) if forces is None else (references, motion.b[0].shape[-1], forces.shape[-1])
        self.references, self.winches, self.forces = _consecutive(*sizes)
        self.states, self.inputs = self.movements.stop, sum(sizes)
        self.count = self.states + 3 * self.inputs

    def input(self, which, order=0):
        """Columns of some inputs, or of their derivative of an order: slice."""
        first = self.states + order * self.inputs
        return slice(first + which.start, first + which.stop)


def _consecutive(*sizes):
    """Slices of some sizes, each of which begins where the one before ends: list."""
    return [slice(end - size, end) for size, end in zip(sizes, accumulate(sizes), strict=True)]


class _EquationRows:
    """Rows over states and inputs of `equations`, zero at first; arguments are those of `_EquationColumns`.

    Attributes
    ----------
    columns : _EquationColumns
        What the w entries of each row belong to.
    coordinates, rates : ndarray, shape (..., m, w)
        They give z and z'.
    force : ndarray, shape (..., m, w)
        Force on each coordinate, without what the loop gain multiplies.
    fixed, scaled : ndarray, shape (..., N, w)
        Rates of the states: the part without the gain, and the part that the gain multiplies.
    """

    def __init__(self, motion, allocation, notches, law, forces):
        self.columns = columns = _EquationColumns(motion, allocation, notches, law, forces)
        leading, m, dtype = motion.mass.shape[:-2], len(motion), motion.stiffness.dtype
        self.coordinates, self.rates = np.zeros((2, *leading, m, columns.count))
        self.force = np.zeros((*leading, m, columns.count), dtype)
        self.fixed, self.scaled = np.zeros((2, *leading, columns.states, columns.count), dtype)


def _add_law(motion, allocation, law, errors, rows):
    """Add the control law and the winches to the rows of the first-order equations that `equations` makes, in place.

    With the errors e behind the notches, and the state space a, b, c, d of the law, the r independent winch movements p
    and the states l of the law obey

        p' = c l + d w,    l' = a l + b w,    w = -gain R e,    v = U p.

    The lengths v that winches reel in, v' and v'' act on the m coordinates by B0, B1 and B2. Terms with the gain go
    into `scaled` of the rows, others into `force` and `fixed`. `errors` are the rows that give e and e', shape (..., k,
    w) both.
    """
    a, b, c, d = map(np.asarray, law)
    b_column, c_row, d = b[..., :, None], c[..., None, :], d[..., None, None]
    states, movements, velocities = rows.columns.law, rows.columns.movements, rows.columns.rates
    identity = np.eye(allocation.movements.shape[-1])
    by_length, by_speed, by_acceleration = (matrix @ allocation.movements for matrix in motion.b)
    rows.force[..., movements] += by_length
    if a.shape[-1]:
        rows.force[..., states] += _kron(by_speed, c_row) + _kron(by_acceleration, c_row @ a)
        rows.fixed[..., states, states] = _kron(identity, a)
        rows.fixed[..., movements, states] = _kron(identity, c_row)
    accelerated = motion.accelerations(np.concatenate([by_speed, by_acceleration], axis=-1))
    by_speed, by_acceleration = np.split(accelerated, 2, axis=-1)  # accelerations M^-1 B1 U and M^-1 B2 U
    error, error_rate = (allocation.rates @ of_all for of_all in errors)  # R e and R e'
    if a.shape[-1]:
        rows.scaled[..., states, :] = -_kron(identity, b_column) @ error
    rows.scaled[..., movements, :] = -d * error
    rows.scaled[..., velocities, :] = -(d * by_speed + (c_row @ b_column) * by_acceleration) @ error
    rows.scaled[..., velocities, :] -= d * by_acceleration @ error_rate


def _outer(column, row):
    """Products of the entries of vectors, shapes (..., p) and (..., q): shape (..., p, q)."""
    return column[..., :, None] * row[..., None, :]


def _kron(first, second):
    """Kronecker products of matrices, shapes (..., p, q) and (..., k, l): shape (..., p k, q l)."""
    product = first[..., :, None, :, None] * np.asarray(second)[..., None, :, None, :]
    *leading, rows, rows_of_second, columns, columns_of_second = product.shape
    return product.reshape(*leading, rows * rows_of_second, columns * columns_of_second)


def _feedback(motion, rows):
    """Movement that each actuator measures behind its filter, and its rate: list of two rows over states and inputs.

    Fills the rows of the filters' states.
    """
    feedback, state = [], rows.columns.filters.start
    for actuator in motion.feedback:
        measured = actuator.measured[..., None, :]
        movement, rate = (measured @ rows.coordinates)[..., 0, :], (measured @ rows.rates)[..., 0, :]
        if actuator.filtered:  # h(s) x = x - l, l' = w_h (x - l)
            movement[..., state] -= 1.0
            rows.fixed[..., state, :] = np.asarray(actuator.corner)[..., None] * movement
            rate -= rows.fixed[..., state, :].real
            state += 1
        feedback.append((movement, rate))
    return feedback


def force_of_actuator(feedback, movement, rate):
    """Row that gives the force, or torque, of an actuator from those of what it measures, and of its rate, (..., w)."""
    velocity_gain, position_gain = (
        np.asarray(gain)[..., None] for gain in (feedback.velocity_gain, feedback.position_gain)
    )
    return velocity_gain * rate + position_gain * movement


def _filter_by_notches(notches, error, error_rate, rows):
    """Pass the control errors through the notch filters, in place, and write the equations of the filters' states n.

    Each filter turns an error e into c n + d e, with n' = a n + b e; None leaves it as it is. `error` and `error_rate`,
    shape (..., k, w), are rows that give the k errors and their rates.
    """
    begin = rows.columns.notches.start
    for coordinate, notch in enumerate(notches):
        if notch is None:
            continue
        a, b, c, d = notch.state_space
        states, d = slice(begin, begin + 2), np.asarray(d)[..., None]
        # views: rows that give n', e and e'
        n_rate, e, e_rate = rows.fixed[..., states, :], error[..., coordinate, :], error_rate[..., coordinate, :]
        n_rate[..., states] = a
        n_rate += _outer(b, e)
        e_rate *= d
        e_rate += (c[..., None, :] @ n_rate.real)[..., 0, :]
        e *= d
        e[..., states] += c
        begin += 2
