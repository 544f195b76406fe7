"""The loop of several winches that hold the pose of a body.

Each measured coordinate y_j is filtered by a notch N_j, and shared among the winches by the weighted pseudo-inverse A
of the static gain G from winches to pose; the winches integrate:

    v' = -gain A N(s) y,        A = W^-1 G^T (G W^-1 G^T)^+

which is the movement with the least sum of w_k v_k^2 that corrects y, W = diag(w). The loop gain at the measured
coordinates is L = gain/s (y/v) A N; without dynamics L = gain/s.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.motion import Motion
from cablestudy.errors import NoSolutionError

STILL = 1e-3  # static gain of a coordinate over the largest, below which winches do not move it
DEPENDENT = 1e-3  # singular value of the static gain over the largest, below which a pose is not corrected
GROWING = 1e-9  # growth over frequency that is called instability, as for one cable
ROUNDING = 1e-12  # of a pole over the largest one


@dataclass(frozen=True)
class Allocation:
    """What is measured, and how an error is shared among the winches.

    Attributes
    ----------
    measured : ndarray, shape (k, m)
        Coordinates of the pose by those of the motion.
    shares : ndarray, shape (i, k)
        A. [-], [m/rad]
    static_gain : ndarray, shape (k, i)
        G. [-], [rad/m]
    """

    measured: np.ndarray
    shares: np.ndarray
    static_gain: np.ndarray


def moved_by_winches(motion, measured, sizes):
    """Which of some coordinates any winch moves, shape (k,), and their static gain, shape (k, i).

    Parameters
    ----------
    motion : Motion
    measured : ndarray, shape (k, m)
    sizes : ndarray, shape (k,)
        Length that makes a rotation comparable with a displacement; 1 for these. [m]
    """
    gain = measured @ np.linalg.solve(motion.dynamic_stiffness(np.zeros(1))[0].real, motion.driven[0])
    largest = np.abs(gain * sizes[:, None]).max(axis=1, initial=0.0)
    return largest > STILL * largest.max(initial=0.0), gain


def allocate(motion, measured, sizes, weights):
    """The `Allocation` of errors of the pose to winches.

    Parameters
    ----------
    motion, measured, sizes
        As for `moved_by_winches`.
    weights : ndarray, shape (i,)
        Cost of the movement of each winch.

    Raises
    ------
    NoSolutionError
        No winch moves anything that is measured.
    """
    moves, gain = moved_by_winches(motion, measured, sizes)
    if not moves.all():
        raise NoSolutionError("no winch moves a coordinate that is measured")
    root = 1 / np.sqrt(weights)
    inverse = np.linalg.pinv(sizes[:, None] * gain * root, rcond=DEPENDENT)
    return Allocation(measured, root[:, None] * inverse * sizes, gain)


@dataclass(frozen=True)
class PoseLoop:
    """A suspension whose winches hold a pose.

    Attributes
    ----------
    motion : Motion
    allocation : Allocation
    gain : float
        [rad/s]
    notches : tuple of (Notch or None)
        Of each measured coordinate.
    """

    motion: Motion
    allocation: Allocation
    gain: float
    notches: tuple

    def with_gain(self, gain):
        """The same loop with another gain. [rad/s]"""
        return replace(self, gain=gain)

    def within(self, space):
        """The same in a space of its coordinates, see `Motion.within`."""
        allocation = replace(self.allocation, measured=self.allocation.measured @ space)
        return replace(self, motion=self.motion.within(space), allocation=allocation)

    def filters(self, s):
        """N_j(s), shape (f, k)."""
        ones = np.ones(len(s), dtype=complex)
        return np.stack([ones if notch is None else notch(s) for notch in self.notches], axis=1)

    def winch_gain(self, s):
        """v per measured coordinate, -gain/s A N(s), shape (f, i, k)."""
        return -(self.gain / s)[:, None, None] * (self.allocation.shares * self.filters(s)[:, None, :])

    def winch_response(self, s):
        """v per coordinate, shape (f, i, m)."""
        if not self.gain:
            return np.zeros((len(s), self.motion.driven[0].shape[1], len(self.motion)))
        return self.winch_gain(s) @ self.allocation.measured

    def dynamic_stiffness(self, s):
        """Forces per displacement of the coordinates with the loop closed, shape (f, m, m)."""
        return self.motion.dynamic_stiffness(s) - self.motion.pulled(s) @ self.winch_response(s)

    def unit_gain(self, s):
        """L over the gain at the measured coordinates, shape (f, k, k)."""
        moved = np.linalg.solve(self.motion.dynamic_stiffness(s), self.motion.pulled(s))
        response = self.allocation.measured @ moved @ self.allocation.shares
        return response * (self.filters(s) / s[:, None])[:, None, :]

    def sensitivity(self, s):
        """(I + L)^-1 at the measured coordinates, shape (f, k, k)."""
        return np.linalg.inv(np.eye(len(self.notches)) + self.gain * self.unit_gain(s))

    @cached_property
    def matrices(self):
        """A0, shape (N, N), and A_j, shape (k, N, N), of x' = (A0 + gain sum A_j) x; see `first_order`."""
        return first_order(self.motion, self.allocation, self.notches)

    @cached_property
    def poles(self):
        """Eigenvalues of the closed loop. [rad/s]"""
        fixed, scaled = self.matrices
        return np.linalg.eigvals(fixed + self.gain * scaled.sum(axis=0))

    @cached_property
    def open_poles(self):
        """The same with the winches at rest. [rad/s]"""
        return np.linalg.eigvals(self.matrices[0])

    @property
    def growing(self):
        """The pole that grows most, relative to its size; None where the loop is stable."""
        return growing(self.poles)


def growing(poles):
    """The pole that grows most, or None where none grows."""
    growth = growths(poles)
    return complex(poles[np.argmax(growth)]) if growth.max(initial=-1.0) > 0 else None


def growth_of(poles):
    """Largest growth of some poles, positive where one grows. [1/s]"""
    return float(growths(poles).max())


def growths(poles):
    """Growth of each pole less what rounding may be. [1/s]"""
    return poles.real - GROWING * np.abs(poles) - ROUNDING * np.abs(poles).max(initial=0.0)


def first_order(motion, allocation=None, notches=()):
    """The closed loop as x' = (A0 + gain sum A_j) x, with a part A_j of each measured coordinate.

    Parameters
    ----------
    motion : Motion
    allocation : Allocation, optional
        Without it the winches are at rest.
    notches : tuple of (Notch or None)

    Returns
    -------
    A0 : ndarray, shape (N, N)
    A_j : ndarray, shape (k, N, N)
        States: u z (u the `unit` of each coordinate), z', the low-passed movement of each actuator with a high-pass
        filter, two of each notch, and as many movements of the winches as the allocation makes.

    Notes
    -----
    v' and v'' are sums of states: v' = -gain A e with e = N y = c n + d y, and v'' = -gain A (c n' + d y').
    The allocation A is taken as U R with independent columns U, so that the winches have as many states as movements.
    """
    m, unit = len(motion), motion.unit
    filtered = [one for one in motion.feedback if one.corner]
    own = [notch for notch in notches if notch is not None]
    left, rates = _independent(allocation.shares) if allocation else (np.zeros((0, 0)),) * 2
    winches = len(rates)
    size = 2 * m + len(filtered) + 2 * len(own) + winches
    places, speeds = np.zeros((2, m, size))
    places[:, :m], speeds[:, m : 2 * m] = np.diag(1 / unit), np.eye(m)
    fixed, scaled = np.zeros((size, size)), np.zeros((len(notches), size, size))
    fixed[:m, m : 2 * m] = np.diag(unit)
    force = -motion.stiffness @ places - motion.damping @ speeds
    begin = 2 * m
    for one in motion.feedback:
        moved, moving = one.measured @ places, one.measured @ speeds
        if one.corner:  # h(s) x = x - l, l' = w_h (x - l)
            moved = moved.copy()
            moved[begin] -= 1.0
            fixed[begin] = one.corner * moved
            moving = moving - fixed[begin]
            begin += 1
        force += np.outer(one.acts, one.velocity_gain * moving + one.position_gain * moved)
    if allocation:
        passed, passing = [], []
        for row, notch in zip(allocation.measured, notches, strict=True):
            moved, moving = row @ places, row @ speeds
            if notch is not None:
                a, b, c, d = notch.state_space
                states = slice(begin, begin + 2)
                fixed[states, states] = a
                fixed[states] += np.outer(b, moved)
                moved, moving = d * moved, d * moving + c @ fixed[states]
                moved[states] += c
                begin += 2
            passed.append(moved)
            passing.append(moving)
        zeroth, first, second = (part @ left for part in motion.driven)
        force[:, begin:] += zeroth
        for one, column, moved, moving in zip(scaled, rates.T, passed, passing, strict=True):
            one[begin:] = -np.outer(column, moved)
            one[m : 2 * m] = -np.outer(first @ column, moved) - np.outer(second @ column, moving)
    fixed[m : 2 * m] = np.linalg.solve(motion.mass, force)
    scaled[:, m : 2 * m] = np.linalg.solve(motion.mass, scaled[:, m : 2 * m])
    return fixed, scaled


def _independent(shares):
    """A as the product of independent movements of the winches, shape (i, r), and their rates, shape (r, k)."""
    left, values, right = np.linalg.svd(shares, full_matrices=False)
    kept = values > DEPENDENT * values.max(initial=0.0)
    return left[:, kept], values[kept, None] * right[kept]
