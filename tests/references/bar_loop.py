"""A suspension whose winches hold a body, as dense bars: its closed loop as one matrix.

About an equilibrium, with z the displacements of `bar_suspension` and v the lengths that winches reel in,

    M z'' + C z' + K z = F0 v + F1 v' + F2 v'',    v = -gain A integral of N(s) P z

P picks what is measured, A is the pseudo-inverse of the static response P K^-1 F0, and N the notch. An end that reels
in moves out along its tangent by (1 + T/EA) v, and takes the weight of what it reels in off itself.
"""

import numpy as np

from . import bar_suspension

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
TURN = 2 * np.pi


class BarLoop:
    """The loop of a scene (a mapping in SI numbers with one body "b") about an `Equilibrium`, with n bars a cable."""

    def __init__(self, scene, equilibrium, n):
        self.scene, self.bars = scene, bar_suspension.dense(equilibrium, n)
        size, winches = len(self.bars.K), scene["winches"]
        per_length, loss = equilibrium.catenary.span.mass, scene["cable"]["damping"].get("loss_factor", 0.0)
        self.K = self.bars.K + 1j * loss * self.bars.elastic if loss else self.bars.K
        own, self.C = self.bars.damping(scene["cable"]["damping"], per_length)
        self.forces = np.zeros((3, size, len(winches)), self.K.dtype)
        pull = equilibrium.end_forces[: len(per_length)]
        tension = np.linalg.norm(pull, axis=-1)
        stretch = 1 + tension / equilibrium.catenary.span.axial_stiffness[:, None]
        for place, (name, winch) in enumerate(winches.items()):
            cable = equilibrium.suspension.cable_names.index(name)
            end, rows = (1, slice(-3, None)) if winch.get("end") == "to" else (0, slice(0, 3))
            k, mass, elastic = self.bars.cables[cable]
            k = k + 1j * loss * elastic if loss else k
            moved, lifted = np.zeros((2, len(mass)))
            moved[rows] = -pull[cable, end] / tension[cable, end] * stretch[cable, end]
            lifted[rows] = 0, 0, per_length[cable] * scene["gravity"]
            on_nodes = lifted - k @ moved, -own[cable] @ moved, -mass @ moved
            self.forces[:, :, place] = [self.bars.maps[cable].T @ force for force in on_nodes]
        free = scene["bodies"]["b"]["free"]
        self.measured = np.eye(size)[[size - len(free) + free.index(axis) for axis in scene["control"]["measured"]]]
        static = self.measured @ np.linalg.solve(self.bars.K, self.forces[0].real)
        self.allocation = np.linalg.pinv(static, rcond=1e-3)  # what winches hardly move is not corrected

    def matrices(self):
        """A0 and A1 of the closed loop x' = (A0 + gain A1) x."""
        M, n, k = self.bars.M, len(self.bars.M), len(self.measured)
        notch = self.scene["control"]["notch"]
        states = 0 if notch == "none" else 2 * k
        unit = np.eye(2 * n + states + k)
        fixed, scaled = np.zeros((2, *unit.shape), self.K.dtype)
        z, rate, integral = unit[:n], unit[n : 2 * n], unit[2 * n + states :]
        passed, change = self.measured @ z, self.measured @ rate
        fixed[:n] = rate
        if states:
            w1 = self._coupled() if notch["frequency"] == "coupled" else TURN * notch["frequency"]
            w2 = TURN * notch["rolloff_frequency"]
            d1, d2 = 2 * notch["damping_ratio"] * w1, 2 * notch["rolloff_damping_ratio"] * w2
            low, slope = unit[2 * n : 2 * n + k], unit[2 * n + k : 2 * n + 2 * k]
            bend = passed - d2 * slope - w2**2 * low
            jerk = change - d2 * bend - w2**2 * slope
            fixed[2 * n : 2 * n + k], fixed[2 * n + k : 2 * n + 2 * k] = slope, bend
            passed = (w2 / w1) ** 2 * (bend + d1 * slope + w1**2 * low)
            change = (w2 / w1) ** 2 * (jerk + d1 * bend + w1**2 * slope)
        fixed[2 * n + states :] = passed
        fixed[n : 2 * n] = -np.linalg.solve(M, self.K @ z + self.C @ rate)
        first, second, third = np.linalg.solve(M, self.forces) @ self.allocation
        scaled[n : 2 * n] = -(first @ integral + second @ passed + third @ change)
        return fixed, scaled

    def _coupled(self):
        """Of each measured coordinate, the mode with the largest share in its static compliance, (k, 1). [rad/s]"""
        frequency, shapes = self.bars.modes()
        share = (self.measured @ shapes / frequency) ** 2
        return TURN * frequency[share.argmax(axis=1)][:, None]

    def poles(self, gain):
        """All poles with the loop closed. [rad/s]"""
        fixed, scaled = self.matrices()
        return np.linalg.eigvals(fixed + gain * scaled)

    def growth(self, gain):
        """Largest growth of a pole over its frequency, positive where one grows. [-]

        Poles at zero are left out: integrals of what the winches do not correct. With a loss factor the equations hold
        for Im s >= 0.
        """
        poles = self.poles(gain)
        poles = poles[poles.imag >= 0]
        poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max()]
        return float((poles.real / np.abs(poles)).max())

    def displacements(self, s, gain, force):
        """z, complex, shape (f, n), by a unit of some force, shape (n,), at s with the loop closed; without a notch."""
        s = np.asarray(s)[:, None, None]
        by_winches = self.forces[0] + s * self.forces[1] + s**2 * self.forces[2]
        dynamic = s**2 * self.bars.M + s * self.C + self.K + gain / s * by_winches @ self.allocation @ self.measured
        return np.linalg.solve(dynamic, np.broadcast_to(force[:, None], (len(s), len(force), 1)))[..., 0]
