"""The loop of several winches, and a suspension without it, as equations of first order.

    x' = (A0 + gain sum A_j) x + B0 u + B1 u' + B2 u''

Rows of all matrices are over the states x and, where there are inputs, over u, u', u''. States: h z (h the `unit` of
each coordinate), z', the low-passed movement of each actuator with a high-pass filter, two of each notch, those of the
control law of each independent movement of the winches, and as many movements as the allocation makes. Inputs: with the
loop the references r of what is measured, without it the lengths v that the winches reel in; then forces.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.law import NOTHING

DEPENDENT = 1e-3  # singular value of the static gain over the largest, below which a pose is not corrected


@dataclass(frozen=True)
class Allocation:
    """What is measured, and how an error is shared among the winches.

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
        v by the last r states; r is zero where winches are inputs.
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
        Force on each coordinate by each force; without it there are no inputs, and winches without loop are at rest.

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
    left, rates = _independent(allocation.shares) if allocation else (np.zeros((motion.driven[0].shape[1], 0)),) * 2
    movements = left.shape[1]
    size = 2 * m + filters + 2 * len(own) + (len(a) + 1) * movements
    driving = 0 if forces is None else len(notches) if allocation else len(left)
    inputs = 0 if forces is None else driving + forces.shape[1]
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
        force[:, size + driving : size + inputs] += forces
    if allocation:
        moved, moving = allocation.measured @ places, allocation.measured @ speeds
        if inputs:
            moved[:, size : size + driving] -= np.eye(driving)
            moving[:, size + inputs : size + inputs + driving] -= np.eye(driving)
        begin, each = size - movements, np.eye(movements)
        laws = slice(begin - len(a) * movements, begin)
        _notched(notches, moved, moving, fixed, 2 * m + filters)
        zeroth, first, second = (part @ left for part in motion.driven)
        force[:, begin:size] += zeroth
        force[:, laws] += np.kron(first, c) + np.kron(second, c @ a)
        fixed[laws, laws], fixed[begin:, laws] = np.kron(each, a), np.kron(each, c)
        for one, column, error, rate in zip(scaled, rates.T, moved, moving, strict=True):
            one[laws], one[begin:] = -np.outer(np.kron(column, b), error), -d * np.outer(column, error)
            one[m : 2 * m] = -np.outer((d * first + (c @ b) * second) @ column, error)
            one[m : 2 * m] -= d * np.outer(second @ column, rate)
    elif inputs:
        for order, part in enumerate(motion.driven):
            force[:, size + order * inputs :][:, :driving] += part
    fixed[m : 2 * m] = np.linalg.solve(motion.mass, force)
    scaled[:, m : 2 * m] = np.linalg.solve(motion.mass, scaled[:, m : 2 * m])
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
    kept = values > DEPENDENT * values.max(initial=0.0)
    left, right = left[:, kept], values[kept, None] * right[kept]
    sign = np.sign(np.take_along_axis(left, np.abs(left).argmax(axis=0)[None], axis=0))[0]
    return left * sign, right * sign[:, None]
