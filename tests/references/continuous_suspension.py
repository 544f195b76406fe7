"""How many modes a suspension of continuous cables has below a frequency, without elements or modes.

Wittrick and Williams (1971), Quarterly Journal of Mechanics and Applied Mathematics 24: the number of modes of the
cables with fixed ends below it, and the number of negative eigenvalues of the dynamic stiffness of the bodies.
"""

import numpy as np

from . import continuous_cable
from .bar_suspension import body_matrices, cross


class Suspension:
    """Continuous cables about an equilibrium; none is vertical.

    Parameters
    ----------
    equilibrium : Equilibrium
    many : int
        How many modes of each cable, of each plane, are enough.
    """

    def __init__(self, equilibrium, many=12):
        self.equilibrium, model = equilibrium, equilibrium.suspension
        self.places = model.ends(equilibrium.position, equilibrium.rotation)
        span, self.cables, self.turns, self.fixed = equilibrium.catenary.span, [], [], []
        for cable, (one, two) in enumerate(self.places):
            d = two - one
            level = np.hypot(d[0], d[1])
            L, EA, m = (float(a[cable]) for a in (span.unstretched_length, span.axial_stiffness, span.mass))
            data = float(level), float(d[2]), L, EA, m, float(model.gravity)
            turn = np.array([[d[0] / level, -d[1] / level, 0], [d[1] / level, d[0] / level, 0], [0, 0, 1]])
            self.cables.append(data)
            self.turns.append(np.kron(np.eye(2), turn))
            self.fixed += [continuous_cable.frequencies(*data, many, plane) for plane in ("in", "out")]
        assert all(len(found) == many for found in self.fixed)
        self.most = min(found[-1] for found in self.fixed)

    def dynamic_stiffness(self, omega):
        """Of all free displacements of the bodies. [N/m]"""
        model, state = self.equilibrium.suspension, self.equilibrium
        whole = np.zeros((6 * len(model.body_names),) * 2)
        for cable, (data, turn) in enumerate(zip(self.cables, self.turns, strict=True)):
            moved = np.zeros((6, len(whole)))
            for end, body in enumerate(model.owner[cable]):
                if body >= 0:
                    arm = self.places[cable, end] - state.position[body]
                    moved[3 * end : 3 * end + 3, 6 * body : 6 * body + 6] = np.concatenate(
                        [np.eye(3), -cross(arm)], axis=1
                    )
            stiffness = continuous_cable.dynamic_stiffness_both_ends(*data, omega)
            whole += moved.T @ turn @ stiffness @ turn.T @ moved
        for body in range(len(model.body_names)):
            place, (mass, geometric) = slice(6 * body, 6 * body + 6), body_matrices(state, body)
            whole[place, place] += geometric - omega**2 * mass
        free = model.free.ravel()
        return whole[np.ix_(free, free)]

    def below(self, frequency):
        """Number of modes below a frequency [Hz]."""
        assert frequency < self.most
        fixed = sum(int((found < frequency).sum()) for found in self.fixed)
        value = np.linalg.eigvalsh(self.dynamic_stiffness(2 * np.pi * frequency))
        return fixed + int((value < 0).sum())
