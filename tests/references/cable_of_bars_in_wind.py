"""One cable of bars in the wind on it, as dense matrices of all its nodes: drag at two Gauss points to a bar.

Of the package it has the form of the bars, and their matrices. Global axes; the cable lies in the plane of x and z.
"""

import numpy as np
from cables import matrices_of_all_nodes

TURN = 2 * np.pi
DIRECTIONS = {"across": np.array([0.0, 1.0, 0.0]), "along": np.array([1.0, 0.0, 0.0])}
VON_KARMAN = {"von_karman": 70.7, "von_karman_exact": 70.78012763381717}


class CableOfBars:
    """The bars of the `CableCase` of a scene of one cable without masses, in the wind across or along its plane.

    Attributes
    ----------
    stiffness, elastic, bare, mass, damping : ndarray, shape (3 n, 3 n)
        The second is the share of strain in the first; `mass` has what the cable carries, and `bare` has not.
    drags : ndarray, shape (3 n, 3 p)
        Force on the nodes per speed of the wind along x, y and z at the Gauss points. [N s/m]
    air : ndarray, shape (3 n, 3 n)
        Damping by the drag of each Gauss point on its own movement. [N s/m]
    """

    def __init__(self, case, direction, carried=()):
        """`carried` are masses that move with the cable, (node, kg)."""
        self.span, self.wind, self.law, self.nodes = (
            case.span,
            case.scene.wind,
            case.scene.cable.damping,
            case.state.mesh.nodes,
        )
        turn = np.kron(np.eye(self.nodes), self.span.frame)
        self.stiffness, self.elastic, self.bare = (turn.T @ matrix @ turn for matrix in matrices_of_all_nodes(case))
        self.mass = self.bare.copy()
        for node, mass in carried:
            self.mass[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] += mass * np.eye(3)
        self.damping = self.law.viscous / float(self.span.mass) * self.bare
        if self.law.model == "modal":
            self._damp_modes()
        self._blow(case, DIRECTIONS[direction])

    def _damp_modes(self):
        """Damp the modes between fixed ends, of absolute movement: 2 zeta M sqrt(M^-1 K)."""
        inner = np.s_[3:-3]
        root = np.sqrt(np.diagonal(self.mass)[inner])
        value, vector = np.linalg.eigh(self.stiffness[inner, inner] / np.outer(root, root))
        modal = (vector * 2 * self.law.ratio * np.sqrt(value)) @ vector.T
        self.damping[inner, inner] += modal * np.outer(root, root)

    def _blow(self, case, wind):
        """Compute the drag of each Gauss point, in a direction of the wind."""
        state, section = case.state, case.scene.cable
        t = np.array([0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)])
        sizes = state.mesh.sizes * state.stretch[:, 0] * float(self.span.unstretched_length)
        start = np.concatenate([[0.0], np.cumsum(sizes)])[:-1]
        place, weight = (start[:, None] + sizes[:, None] * t).ravel(), np.repeat(sizes / 2, 2)
        tangent = np.repeat(state.direction[:, 0] @ self.span.frame, 2, axis=0)
        factor = self.wind.air_density * self.wind.cable_drag_coefficient * section.section_diameter * self.wind.speed
        self.drags, self.air = np.zeros((3 * self.nodes, 3 * len(place))), np.zeros_like(self.mass)
        for k in range(len(place)):
            n = wind - tangent[k] * (tangent[k] @ wind)
            a = np.linalg.norm(n)
            G = a * (np.eye(3) - np.outer(tangent[k], tangent[k])) / 2 + (np.outer(n, n) / a / 2 if a else 0)
            bar = np.s_[3 * (k // 2) : 3 * (k // 2) + 6]  # the two nodes of its bar
            shape = np.kron([[1 - t[k % 2]], [t[k % 2]]], np.eye(3))
            self.drags[bar, 3 * k : 3 * k + 3] = factor * weight[k] * shape @ G
            self.air[bar, bar] += factor * weight[k] * shape @ G @ shape.T
        self._apart = np.abs(place[:, None] - place)

    def spectra(self, frequency, shown):
        """Spectra of what `shown` gives per speed at each Gauss point, from -w^2 M + i w C + K: shape (o, f)."""
        found, v, L = [], self.wind.speed, self.wind.length_scale
        for f in frequency:
            omega = TURN * f
            lossy = {"modal": 0, "hysteretic": self.law.loss_factor, "kelvin_voigt": (self.law.time or 0) * omega}
            dynamic = self.stiffness + 1j * ((lossy[self.law.model] or 0) * self.elastic + omega * self.damping)
            h = shown(dynamic - omega**2 * self.mass).reshape(-1, len(self._apart), 3)
            given = self.wind.coherence_length
            decay = 1 / given if given else 12 * np.hypot(f / v, 0.12 / L)
            level = (
                self.wind.turbulence**2 * 4 * L / v / (1 + VON_KARMAN[self.wind.spectrum] * (f * L / v) ** 2) ** (5 / 6)
            )
            found.append(level * np.einsum("oka,kl,ola->o", h.conj(), np.exp(-decay * self._apart), h).real)
        return np.array(found).T
