"""A suspension whose winches hold a body, as dense bars: its closed loop as one matrix.

About an equilibrium, with z the displacements of `bar_suspension` and v the lengths that winches reel in,

    M z'' + C z' + K z = F0 v + F1 v' + F2 v'',    v = -gain A integral of N(s) P z

P picks what is measured, A is the pseudo-inverse of the static response P K^-1 F0, and N the notch. An end that reels
in moves out along its tangent by (1 + T/EA) v, and takes the weight of what it reels in off itself.
"""

import numpy as np
import scipy.linalg

from . import bar_suspension

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
TURN = 2 * np.pi


def cable_damping(damping, k, mass, elastic, per_length):
    """C of the nodes of one cable, which weighs `per_length` [kg/m]: modal, Kelvin-Voigt and viscous per length."""
    found = damping.get("time", 0.0) * elastic + damping.get("viscous", 0.0) / per_length * mass
    inner = slice(3, -3)
    if ratio := damping.get("ratio", 0.0):  # of each mode between fixed ends, on absolute motion
        square, shapes = scipy.linalg.eigh(k[inner, inner], mass[inner, inner])
        weighted = mass[inner, inner] @ shapes
        found[inner, inner] += weighted * (2 * ratio * np.sqrt(square)) @ weighted.T
    return found


class BarLoop:
    """The loop of a scene (a mapping in SI numbers with one body "b") about an `Equilibrium`, with n bars a cable."""

    def __init__(self, scene, equilibrium, n):
        self.scene, self.bars = scene, bar_suspension.dense(equilibrium, n)
        size, winches = len(self.bars.K), scene["winches"]
        per_length = equilibrium.catenary.span.mass
        own = [
            cable_damping(scene["cable"]["damping"], *matrices, float(mass))
            for matrices, mass in zip(self.bars.cables, per_length, strict=True)
        ]
        self.C = sum(turn.T @ part @ turn for turn, part in zip(self.bars.maps, own, strict=True))
        self.forces = np.zeros((3, size, len(winches)))
        pull = equilibrium.end_forces
        tension = np.linalg.norm(pull, axis=-1)
        stretch = 1 + tension / equilibrium.catenary.span.axial_stiffness[:, None]
        for place, (name, winch) in enumerate(winches.items()):
            cable = equilibrium.suspension.cable_names.index(name)
            end, rows = (1, slice(-3, None)) if winch.get("end") == "to" else (0, slice(0, 3))
            k, mass, _ = self.bars.cables[cable]
            moved, lifted = np.zeros((2, len(k)))
            moved[rows] = -pull[cable, end] / tension[cable, end] * stretch[cable, end]
            lifted[rows] = 0, 0, per_length[cable] * scene["gravity"]
            on_nodes = lifted - k @ moved, -own[cable] @ moved, -mass @ moved
            self.forces[:, :, place] = [self.bars.maps[cable].T @ force for force in on_nodes]
        free = scene["bodies"]["b"]["free"]
        self.measured = np.eye(size)[[size - len(free) + free.index(axis) for axis in scene["control"]["measured"]]]
        static = self.measured @ np.linalg.solve(self.bars.K, self.forces[0])
        self.allocation = np.linalg.pinv(static, rcond=1e-3)  # what winches hardly move is not corrected

    def matrices(self):
        """A0 and A1 of the closed loop x' = (A0 + gain A1) x."""
        M, n, k = self.bars.M, len(self.bars.M), len(self.measured)
        notch = self.scene["control"]["notch"]
        states = 0 if notch == "none" else 2 * k
        unit = np.eye(2 * n + states + k)
        fixed, scaled = np.zeros_like(unit), np.zeros_like(unit)
        z, rate, integral = unit[:n], unit[n : 2 * n], unit[2 * n + states :]
        passed, change = self.measured @ z, self.measured @ rate
        fixed[:n] = rate
        if states:
            w1, w2 = TURN * notch["frequency"], TURN * notch["rolloff_frequency"]
            d1, d2 = 2 * notch["damping_ratio"] * w1, 2 * notch["rolloff_damping_ratio"] * w2
            low, slope = unit[2 * n : 2 * n + k], unit[2 * n + k : 2 * n + 2 * k]
            bend = passed - d2 * slope - w2**2 * low
            jerk = change - d2 * bend - w2**2 * slope
            fixed[2 * n : 2 * n + k], fixed[2 * n + k : 2 * n + 2 * k] = slope, bend
            passed = (w2 / w1) ** 2 * (bend + d1 * slope + w1**2 * low)
            change = (w2 / w1) ** 2 * (jerk + d1 * bend + w1**2 * slope)
        fixed[2 * n + states :] = passed
        fixed[n : 2 * n] = -np.linalg.solve(M, self.bars.K @ z + self.C @ rate)
        first, second, third = np.linalg.solve(M, self.forces) @ self.allocation
        scaled[n : 2 * n] = -(first @ integral + second @ passed + third @ change)
        return fixed, scaled

    def growth(self, gain):
        """Largest growth of a pole over its frequency, positive where one grows. [-]

        Poles at zero are left out: integrals of what the winches do not correct.
        """
        fixed, scaled = self.matrices()
        poles = np.linalg.eigvals(fixed + gain * scaled)
        poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max()]
        return float((poles.real / np.abs(poles)).max())
