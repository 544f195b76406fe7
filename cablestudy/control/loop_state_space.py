"""Response of a suspension with its actuators, and with the loop of its winches, to forces, with an exact delay.

The equations are those of `system.first_order`.
"""

import numpy as np

from cablestudy.control.margins import sensitivity
from cablestudy.system.residues import Residues
from cablestudy.system.state_rows import state_rows


class ExactResponse:
    """Response to forces of a suspension with a loop whose delay T is exp(-s T) itself, not an approximant.

    A function of s, shape (f,) [rad/s] -> outputs per force, shape (f, p, j). The outputs are those of `StateSpaces`.

    With the winches at rest the response y of the measured coordinates is a sum over poles; the loop then moves the
    winches by v = -gain C1 A N (I + L)^-1 y, symbols as in `control.loop`.

    Parameters
    ----------
    motion : LinearSystem
        The suspension in m coordinates, with o outputs; its inputs are the lengths that winches reel in.
    forces : ndarray, shape (m, j)
        Force on each coordinate by each of the j inputs of the result.
    loop : Loop
    actuators : sequence of Actuator
        Actuators of the suspension.
    direct : ndarray, shape (o, j), optional
        Feedthrough: outputs of the motion per input, without delay.
    """

    def __init__(self, motion, forces, loop, actuators, direct=None):
        rows = state_rows(motion, forces, actuators=actuators)
        size = len(rows.state_rate)
        inputs = (rows.state_rate.shape[1] - size) // 3
        if direct is not None:
            rows.outputs[: len(direct), size + inputs - forces.shape[1] : size + inputs] += direct
        output_rows = np.concatenate([rows.outputs, loop.allocation.measured @ rows.equations.coordinates])
        self._loop, self._winches = loop, len(rows.reeled)
        # by eigenvectors; of inputs u, u' and u'', the winches first
        parts = [slice(size + order * inputs, size + (order + 1) * inputs) for order in range(3)]
        self._inputs = [motion.eigen.left @ rows.state_rate[:, part] for part in parts]
        self._outputs = output_rows[:, :size] @ motion.eigen.right
        self._direct = [output_rows[:, part] for part in parts]

    @property
    def at_small_gain(self):
        """`Residues` where the loop gain is small: outputs with the winches at rest, speeds without a direct part."""
        loop, eigen, count = self._loop, self._loop.motion.eigen, len(self._loop.notches)
        inputs, direct = (parts[0][..., self._winches :] for parts in (self._inputs, self._direct))
        # to the left of -1/T, exp(-s T) says nothing any more of what happens on the imaginary axis; and poles that do
        # not oscillate, where the law may be infinite, make no peaks there
        decay = np.where(eigen.values.imag == 0, 0.0, np.maximum(eigen.values.real, -1 / loop.law.delay))
        s = decay + 1j * np.where(eigen.values.imag == 0, np.abs(eigen.values), eigen.values.imag)
        error = loop.controller(s).T * self._outputs[-count:]
        speeds = -loop.gain * eigen.values * (loop.allocation.matrix @ error)
        outputs = np.concatenate([self._outputs[:-count], speeds])
        direct = np.concatenate([direct[:-count], np.zeros((len(speeds), direct.shape[1]))])
        return Residues(eigen.values, inputs, outputs, direct, eigen.one_sided)

    def __call__(self, s):
        """Outputs per force, shape (f, p, j), for s of shape (f,) [rad/s]."""
        loop, count = self._loop, len(self._loop.notches)
        fractions = self._outputs / (s[:, None] - loop.motion.eigen.values)[:, None, :]
        by_order = zip(self._inputs, self._direct, strict=True)  # of v, v' and v''
        by_forces = fractions @ self._inputs[0][:, self._winches :] + self._direct[0][:, self._winches :]
        by_winches = sum(
            s[:, None, None] ** order * (fractions @ b[:, : self._winches] + d[:, : self._winches])
            for order, (b, d) in enumerate(by_order)
        )
        filters = loop.controller(s)
        gain = loop.gain * (by_winches[:, -count:] @ loop.allocation.matrix) * filters[:, None, :]
        error = filters[:, :, None] * (sensitivity(gain) @ by_forces[:, -count:])
        reeled = -loop.gain * loop.allocation.matrix @ error
        outputs = by_forces[:, :-count] + by_winches[:, :-count] @ reeled
        return np.concatenate([outputs, s[:, None, None] * reeled], axis=1)
