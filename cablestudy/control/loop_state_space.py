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
        self._loop, self._winches, self._count = loop, len(rows.reeled), inputs
        # of inputs u, the winches first, and of the winches in u' and u''
        columns = [size + np.arange(inputs), *(size + order * inputs + np.arange(len(rows.reeled)) for order in (1, 2))]
        eigen, columns = motion.eigen, np.concatenate(columns)
        by_poles = eigen.left @ rows.state_rate[:, columns], output_rows[:, :size] @ eigen.right
        self._open = Residues(eigen.values, *by_poles, output_rows[:, columns], eigen.one_sided)

    @property
    def at_small_gain(self):
        """`Residues` where the loop gain is small: outputs with the winches at rest, speeds without a direct part."""
        loop, count, of_open = self._loop, len(self._loop.notches), self._open
        inputs, direct = (part[:, self._winches : self._count] for part in (of_open.inputs, of_open.direct))
        poles = of_open.poles
        # to the left of -1/T, exp(-s T) says nothing any more of what happens on the imaginary axis; and poles that do
        # not oscillate, where the law may be infinite, make no peaks there
        decay = np.where(poles.imag == 0, 0.0, np.maximum(poles.real, -1 / loop.law.delay))
        s = decay + 1j * np.where(poles.imag == 0, np.abs(poles), poles.imag)
        error = loop.controller(s).T * of_open.outputs[-count:]
        speeds = -loop.gain * poles * (loop.allocation.matrix @ error)
        outputs = np.concatenate([of_open.outputs[:-count], speeds])
        direct = np.concatenate([direct[:-count], np.zeros((len(speeds), direct.shape[1]))])
        return Residues(poles, inputs, outputs, direct, of_open.one_sided)

    def __call__(self, s):
        """Outputs per force, shape (f, p, j), for s of shape (f,) [rad/s]."""
        loop, count = self._loop, len(self._loop.notches)
        ends = self._winches, self._count, self._count + self._winches
        of_u, by_forces, of_rate, of_acceleration = np.split(self._open.response(s), ends, axis=-1)
        by_winches = of_u + s[:, None, None] * of_rate + s[:, None, None] ** 2 * of_acceleration
        filters = loop.controller(s)
        gain = loop.gain * (by_winches[:, -count:] @ loop.allocation.matrix) * filters[:, None, :]
        error = filters[:, :, None] * (sensitivity(gain) @ by_forces[:, -count:])
        reeled = -loop.gain * loop.allocation.matrix @ error
        outputs = by_forces[:, :-count] + by_winches[:, :-count] @ reeled
        return np.concatenate([outputs, s[:, None, None] * reeled], axis=1)
