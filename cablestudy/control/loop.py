"""The loop of several winches that hold the pose of a body.

Each measured coordinate y_j, y = P z of the coordinates z of the motion, is filtered by a notch N_j, and shared among
the winches by the weighted pseudo-inverse A of the static gain G from winches to pose; one control law (`law`) drives
all winches:

    v = -gain C1(s) A N(s) y,        A = W^-1 G^T (G W^-1 G^T)^+

which is the movement with the least sum of w_k v_k^2 that corrects y, W = diag(w). The loop gain at the measured
coordinates is L = gain C1 (y/v) A N; without dynamics L = gain C1. C1 = 1/s of an integrator.

A delay is the same factor of all eigenvalues of L, so that what `law` shows of one loop gain holds for each of them:
approximants of the delay leave the number of unstable poles as it is.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.control.law import INTEGRATOR, Law
from cablestudy.control.notch import NotchedLaw
from cablestudy.control.tolerances import CONTROL
from cablestudy.system.first_order import Allocation, LinearControl, equations
from cablestudy.system.linear import LinearSystem
from cablestudy.system.residues import eigen, eigen_of_delayed, one_sided_poles
from cablestudy.system.tolerances import SYSTEM


def moved_by_winches(motion, measured, sizes):
    """Which measured coordinates any winch moves, array of bool, shape (k,), and their static gain, shape (k, i).

    Parameters
    ----------
    motion : LinearSystem
    measured : ndarray, shape (k, m)
        P: measured coordinates by the m coordinates of the motion.
    sizes : ndarray, shape (k,)
        Length by which a rotation is multiplied to compare it with a displacement; 1 for displacements. [m]
    """
    gain = measured @ np.linalg.solve(motion.static_stiffness, motion.b[0].real)
    largest = np.abs(gain * sizes[:, None]).max(axis=1, initial=0.0)
    return largest > CONTROL.unmoved * largest.max(initial=0.0), gain


def allocate(measured, sizes, gain, weights):
    """`Allocation` of errors of the measured pose to winches, by the weighted pseudo-inverse A of the static gain G.

    Parameters
    ----------
    measured, sizes, gain
        As for `moved_by_winches`, which gives the gain: of coordinates that a winch moves.
    weights : ndarray, shape (i,)
        Cost of the movement of each winch.
    """
    # A = W^-1/2 (D G W^-1/2)^+ D, D = diag(sizes): errors of rotations count as lengths
    inverse_root = 1 / np.sqrt(weights)
    left, values, right = np.linalg.svd(sizes[:, None] * gain * inverse_root, full_matrices=False)
    corrected = np.flatnonzero(values > SYSTEM.uncorrected * values.max(initial=0.0))[::-1]  # most movement first
    movements = inverse_root[:, None] * right[corrected].T
    most = np.take_along_axis(movements, np.abs(movements).argmax(axis=0)[None], axis=0)[0]
    lengths = np.sign(most) * np.sqrt((movements**2).sum(axis=0))
    rates = (left[:, corrected] * (lengths / values[corrected])).T * sizes
    return Allocation(measured, movements / lengths, rates)


@dataclass(frozen=True)
class Loop:
    """A suspension whose winches hold a pose.

    Attributes
    ----------
    motion : LinearSystem
    allocation : Allocation
    gain : float
        Gain of an integrator; another law is multiplied by it. [rad/s]
    notches : tuple of (Notch or None)
        Of each measured coordinate.
    law : Law
        What all winches do with what the notches pass.
    gains : StableGains or None
        The loop gain over frequency: a law with a delay needs it.
    """

    motion: LinearSystem
    allocation: Allocation
    gain: float
    notches: tuple
    law: Law = INTEGRATOR
    gains: object = field(default=None, repr=False, compare=False)

    def within(self, space):
        """The loop in a space of its coordinates, of shape (m, r)."""
        return replace(self, motion=self.motion.within(space), allocation=self.allocation.within(space))

    @cached_property
    def controller(self):
        """C1 N_j of each measured coordinate, a function of s: `NotchedLaw`. [s]"""
        return NotchedLaw.of(self.law, self.notches)

    def winch_response(self, s):
        """Response of the winches to the coordinates, v = -gain C1 A N(s) P z, shape (f, i, m)."""
        filtered = self.controller(s)[:, :, None] * self.allocation.measured
        return -self.gain * (self.allocation.matrix @ filtered)

    @property
    def corners(self):
        """Frequencies of the zeros and poles of notches, of the filter of a derivative and of the drive. [rad/s]"""
        notches = [notch.corners for notch in self.notches if notch]
        return np.abs(np.concatenate([self.law.corners, *notches]))

    def dynamic_stiffness(self, s):
        """Forces per displacement of the coordinates with the loop closed, shape (f, m, m)."""
        return self.motion.dynamic_stiffness(s) - self.motion.pulled(s) @ self.winch_response(s)

    def unit_gain(self, s):
        """L over the gain at the measured coordinates, shape (f, k, k)."""
        pulled = self.motion.pulled(s) @ self.allocation.matrix
        measured = self.allocation.measured @ np.linalg.solve(self.motion.dynamic_stiffness(s), pulled)
        return measured * self.controller(s)[:, None, :]

    @property
    def limit_by_modes(self):
        """Gain at which the first pole of the motion crosses the axis, to first order; None where none does. [rad/s]

        With z = sum of r_a b_a(s) v/(s - l_a) over the poles l_a and their right eigenvectors r_a, a gain g moves the
        pole l_a by -g b_a(l_a) A C1 N P r_a.
        """
        motion, count = self.motion, len(self.motion)
        upper = motion.eigen.values.imag > 0
        poles = motion.eigen.values[upper]
        forces = motion.eigen.left[upper, count : 2 * count] @ motion.accelerations(np.eye(count))
        from_winches = (forces[:, None] @ motion.pulled(poles))[:, 0] @ self.allocation.matrix
        measured = self.allocation.measured @ (motion.eigen.right[:count, upper] / motion.unit[:, None])
        growth = -(from_winches * self.controller(poles) * measured.T).sum(axis=1).real
        return min((-poles.real[growth > 0] / growth[growth > 0]).tolist(), default=None)

    def _approximants(self, highest):
        """Number of approximants that make the delay right up to a frequency [rad/s]; 0 where the delay is slight."""
        highest = min(highest, self.law.reach)
        return self.law.approximants(highest) if highest * self.law.delay > CONTROL.slight_delay else 0

    @cached_property
    def equations(self):
        """`Equations` x' = (A0 + gain sum A_j) x of the closed loop, without inputs."""
        return equations(self.motion, self.allocation, self.notches, self.law_states[0])

    @cached_property
    def _delay_needed_up_to(self):
        """Frequency up to which a delay matters to responses; 0 without delay. [rad/s]

        Raises
        ------
        NoSolutionError
            The delay is too long to judge the loop.
        """
        if not self.law.delay or not self.gain:
            return 0.0
        self.gains.check_delay(self.gain)
        needed, faint = (
            self.gains.large_up_to(size / self.gain) for size in (CONTROL.harmless_delayed_gain, CONTROL.faint_gain)
        )
        return max(needed, min(faint, CONTROL.delay_accurate_up_to * self.motion.unit.min()))

    @property
    def delay_accurate_up_to(self):
        """Frequency up to which Padé approximants of a delay are accurate in responses; 0 without delay. [rad/s]"""
        if not self.law.delay:
            return 0.0
        least = CONTROL.slight_delay if self.slight_delay else CONTROL.pade_phase
        return min(max(self._delay_needed_up_to, least / self.law.delay), self.law.reach)

    @property
    def slight_delay(self):
        """True if there is a delay that is left out of poles and state space."""
        return self.law.delay > 0 and not self._approximants(self._delay_needed_up_to)

    @property
    def gain_beyond(self):
        """Largest eigenvalue of the loop gain above `delay_accurate_up_to`; 0 without delay. [-]"""
        return self.gain * self.gains.largest_beyond(self.delay_accurate_up_to) if self.law.delay else 0.0

    @property
    def linear(self):
        """`LinearControl` of the loop, with its law as a state space."""
        return LinearControl(self.allocation, self.gain, self.notches, *self.law_states)

    @cached_property
    def law_states(self):
        """s C1 as a state space for responses, a, b, c, d, and names of its states."""
        return self.law.state_space_of(self._approximants(self._delay_needed_up_to))

    @property
    def law_states_of_finer_delay(self):
        """`law_states` with twice as many approximants of the delay; None where there are none."""
        count = self._approximants(self._delay_needed_up_to)
        return self.law.state_space_of(2 * count) if count else None

    @cached_property
    def eigen(self):
        """`Eigen` of the closed loop; with a delay right for poles that do not nearly coincide alone."""
        matrix = self.equations.with_gain(self.gain)
        return eigen_of_delayed(matrix) if self.law.delay else eigen(matrix)

    @property
    def poles(self):
        """Poles of the closed loop. [rad/s]"""
        return self.eigen.poles

    def poles_with(self, gain):
        """Poles of the closed loop with a gain [rad/s] in place of its own. [rad/s]"""
        matrix = self.equations.with_gain(gain)
        poles = np.linalg.eigvals(matrix)
        return one_sided_poles(poles) if np.iscomplexobj(matrix) else poles

    @property
    def unstable_pole(self):
        """The pole that grows fastest; None where the loop is stable."""
        return unstable_pole(self.poles)


def unstable_pole(poles):
    """The pole that grows fastest, or None where none grows."""
    size = np.abs(poles)  # growth is reduced by the rounding that it may contain
    growth = poles.real - CONTROL.unstable_growth * size - CONTROL.pole_rounding * size.max(initial=0.0)
    return complex(poles[np.argmax(growth)]) if growth.max(initial=-1.0) > 0 else None


def clearly_stable(poles):
    """True if all poles decay faster than rounding may pretend, with damping ratios above `CONTROL.undamped`."""
    size = np.abs(poles)
    uncertain = CONTROL.undamped * size + CONTROL.pole_rounding * size.max(initial=0.0)
    return bool((poles.real < -uncertain).all())
