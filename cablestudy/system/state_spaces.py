"""Linear systems of many rows, with their loops closed or the winches at rest, as state spaces driven by forces f.

    x' = A x + B f,   y = C x + D f

The states x are those of `first_order`. The outputs y are those of the motion, then two of each actuator and, with a
loop, the speeds of the winches. Rows with arrays of equal sizes are one `StateSpaces`, whose arrays have the row first:
one call serves all of them, and no digit of a row depends on the others.
"""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.cable.records import stack, take_rows
from cablestudy.system.closed_poles import eigen_of_closed_loop
from cablestudy.system.linear import LinearSystem
from cablestudy.system.residues import eigen, eigen_of_rows, residues
from cablestudy.system.state_rows import state_rows
from cablestudy.system.tolerances import SYSTEM


class StateSpaces:
    """State spaces of n rows.

    Parameters
    ----------
    motions : list of LinearSystem
        Of each row; their inputs are the lengths that winches reel in.
    control : LinearControl, optional
        Of n rows; without it the winches are at rest.
    actuators : sequence of Actuator
        Actuators of each row, whose stroke and force, or momentum and torque, are further outputs.

    Attributes
    ----------
    rows : StateRows
        Without inputs; with a loop, `outputs` has the speeds of the winches too.
    """

    def __init__(self, motions, control=None, actuators=()):
        self._motions, self._control, self._actuators = motions, control, actuators
        self.motion = motion = LinearSystem.of_rows(motions)
        self.rows = rows = state_rows(motion, None, control, actuators)
        # a force changes an output directly by the accelerations z'' and, with a loop, by rates and accelerations of
        # winches: by this matrix times the change of the states
        self._at_once = np.zeros(rows.outputs.shape, rows.outputs.dtype)
        of_motion = self._at_once[:, : motion.c[2].shape[-2]]
        of_motion[..., len(motion) : 2 * len(motion)] = motion.c[2]
        if control:
            of_motion += motion.d[1] @ rows.reeled + motion.d[2] @ rows.speed
            self.rows = replace(rows, outputs=np.concatenate([rows.outputs, rows.speed], axis=1))
            self._at_once = np.concatenate([self._at_once, rows.reeled], axis=1)

    @staticmethod
    def of(motions, loops=None, actuators=()):
        """`StateSpaces` of rows with arrays of equal sizes, see `signature`.

        Parameters
        ----------
        motions : list of LinearSystem
        loops : list of Loop, optional
            About these motions.
        actuators : sequence of Actuator
        """
        return StateSpaces(motions, loops and stack([loop.linear for loop in loops]), actuators)

    @staticmethod
    def of_one(motion, loop=None, actuators=()):
        """`StateSpaces` of one row, with the eigenvalues of its loop, or without one of the motion."""
        space = StateSpaces.of([motion], loop and [loop], actuators)
        space.eigen = [(loop or motion).eigen]
        return space

    @staticmethod
    def signature(motion, loop=None):
        """Sizes of all arrays, by which rows are found that are one `StateSpaces`: tuple."""
        if loop is None:
            return motion.signature
        notches, law = (notch is not None for notch in loop.notches), (np.shape(part) for part in loop.law_states[0])
        movements = loop.allocation.movements
        return *motion.signature, *notches, *law, movements.shape, loop.law.delay > 0

    def take(self, rows):
        """`StateSpaces` of some rows, by their indices: itself where these are all."""
        if rows == list(range(len(self.eigen))):
            return self
        taken = copy(self)
        taken.motion, taken._control = self.motion.take(rows), take_rows(self._control, rows)
        taken._motions = [self._motions[row] for row in rows]
        taken.rows, taken._at_once = take_rows(self.rows, rows), self._at_once[rows]
        taken.eigen = [self.eigen[row] for row in rows]
        return taken

    def within(self, space, motions):
        """State spaces in other coordinates q of the motion, z = S q, S of shape (n, m, r): with `motions` in these."""
        return StateSpaces(motions, self._control and self._control.within(space), self._actuators)

    @cached_property
    def eigen(self):
        """`Eigen` of each row: list."""
        state_rate = self.rows.state_rate
        if not np.iscomplexobj(state_rate) or state_rate.shape[-1] < SYSTEM.closed_loop_states:
            return eigen_of_rows(state_rate)
        if not self._control:
            return [motion.eigen for motion in self._motions]  # which loops about them need, too
        arguments = enumerate(zip(state_rate, self._motions, strict=True))
        return [
            eigen_of_closed_loop(rate, motion.eigen, motion, take_rows(self._control, row)) or eigen(rate)
            for row, (rate, motion) in arguments
        ]

    def matrices(self, forces, direct=None):
        """B, C and D, for forces on the m coordinates by each of j inputs, shape (n, m, j).

        Parameters
        ----------
        forces : ndarray, shape (n, m, j)
        direct : ndarray, shape (n, p, j), optional
            Part of each input that appears in each output of the motion directly.
        """
        b, m = np.zeros((*self.rows.state_rate.shape[:-1], forces.shape[-1])), len(self.motion)
        b[:, m : 2 * m] = self.motion.accelerations(forces)
        d = self._at_once @ b
        if direct is not None:
            d[:, : direct.shape[-2]] += direct
        return b, self.rows.outputs, d

    def residues(self, forces, direct=None):
        """`Residues` of each row: list; arguments are those of `matrices`."""
        return list(map(residues, self.eigen, *self.matrices(forces, direct)))
