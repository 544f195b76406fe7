"""Resonances of modes of cables above those of a model: what they add to variances of bodies, to first order."""

from functools import cached_property

import numpy as np

from cablestudy.study.tolerances import STUDY
from cablestudy.system.matrices import dense

TURN = 2 * np.pi


class Resonances:
    """Modes of the cables that a `Plant` with gusts has, or that may add to variances of its bodies.

    Parameters
    ----------
    plant : Plant

    Attributes
    ----------
    highest : float
        Highest frequency of the modes of the model. [rad/s]
    moved : ndarray, shape (c, 6, d)
        Movements of the ends of each cable by the free displacements of bodies.
    """

    def __init__(self, plant):
        self._plant, self._models, self.highest = plant, plant.modes.solution.models, plant.modes.solution.omega[-1]
        connection = dense(plant.layout.connection)
        self.moved = connection.reshape(self._models.cables.count, 6, connection.shape[-1])

    @cached_property
    def kept(self):
        """`Kept` of each cable, in the air: the modes that the model may have, or that may add to a variance."""
        added = []
        for element, by_bodies in zip(self._models.elements, self.moved, strict=True):
            of_cable = _size(element.omega, element.coupling @ by_bodies, element.omega)
            added.append(np.where(element.omega > STUDY.left_out_from * self.highest, of_cable, 0.0))
        least = STUDY.left_out_share * max((of_cable.max(initial=0.0) for of_cable in added), default=0.0)
        pairs = zip(self._models.elements, added, strict=True)
        chosen = [(element.omega <= self.highest) | (of_cable > least) for element, of_cable in pairs]
        return self._plant.in_air(self._models, self._models.with_modes(chosen))

    def variances(self, weights):
        """Variances of displacements that the resonances add, under weights as of `Turbulence.seen`, shape (w, r)."""
        omega, added = self._added
        return np.stack([weight(omega / TURN) @ added for weight in weights.values()])

    @cached_property
    def _added(self):
        """Frequencies of the largest resonances above `highest`, shape (k,), and what each adds, shape (k, r).

        To first order, with the winches at rest. In the gusts the model moves the free displacements by x. A mode with
        the coupling c is driven by w^2 c^T x, whose spectrum is S, has the variance S/(8 z w^3), and moves the bodies
        by w^2 R c, R being the response of the free displacements to forces on them.
        """
        plant, (_, displacements) = self._plant, self._plant.displacements
        parts = [[np.zeros(0)], [np.zeros((0, self.moved.shape[-1]))], [np.zeros(0)]]  # of no cable
        for of_cable, by_bodies in zip(self.kept, self.moved, strict=True):
            element, modes = of_cable.element, slice(of_cable.modes)
            above = element.omega[modes] > self.highest
            decay = np.maximum(element.decay, STUDY.undamped_motion * element.omega)
            for part, array in zip(parts, (element.omega, element.coupling @ by_bodies, decay), strict=True):
                part.append(array[modes][above])
        omega, coupling, decay = map(np.concatenate, parts)
        size = _size(omega, coupling, decay)
        large = size > STUDY.left_out_resonances * size.max(initial=0.0)
        omega, coupling, decay = omega[large], coupling[large], decay[large]
        loads = plant.loads_on_bodies
        forces = np.concatenate([loads, plant.gust_forces], axis=1).astype(complex)
        moved = loads.T @ np.linalg.solve(plant.motion.dynamic_stiffness(1j * omega), forces)  # (k, d, d + i)
        by_forces, by_gusts = np.split(moved, [loads.shape[1]], axis=-1)
        accelerated = omega[:, None] ** 2 * coupling  # w^2 c
        driven = plant.gusts.input_spectra(omega / TURN, np.swapaxes(accelerated[:, None] @ by_gusts, -1, -2))
        response = (displacements @ by_forces @ accelerated[..., None])[..., 0]
        return omega, np.abs(response) ** 2 * driven / (8 * decay * omega**2)[:, None]


def _size(omega, coupling, decay):
    """What resonances of modes add to variances, over an unknown factor, shape (n,).

    A mode with a coupling c to the bodies, shape (n, d), and a decay a [1/s] adds about c^4 S/(a w^2), and the spectrum
    S of the gusts falls with w^(-5/3).
    """
    return np.linalg.norm(coupling, axis=-1) ** 4 / (decay * omega ** (11 / 3))
