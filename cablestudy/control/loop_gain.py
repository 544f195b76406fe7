"""The loop gain of winches from the dynamic stiffness of the bodies, with all modes that the cables' elements have.

    L(s) = P Z^-1 F A C1(s) N(s),    Z = s^2 M + K + sum of G^T S(s) G,    F = F_0 - sum of G^T S(s) H

P picks what is measured, A shares it among the winches, M and K are mass and geometric stiffness of the bodies, S the
dynamic stiffness of a cable at its six ends, G and H their displacements by the bodies and by the lengths reeled in,
F_0 the load that a winch takes off its own end. No system larger than that of the bodies is solved, and no mode of the
whole is needed.

A mode of one cable between fixed ends, of frequency W, has its pole with the bodies free near that of

    s^2 + c s + W^2 = s^4 w^T Z_r^-1 w,    w = G^T m,

Z_r being Z without this mode. A gain g moves it by -g X/(2 s) to first order, with

    X = s^4 (w^T Z_r^-1 F + m^T H) A C1 N P Z_r^-1 w.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

AT_ONCE = 200  # frequencies, so that matrices stay in the processor's cache
COUPLED = 100  # modes of a cable that damped strain may couple; of more, those that are strained most
ASIDE = 5.0  # distance from the frequency of a mode, in its half-widths, at which Z is computed for its pole
NARROWEST = 1e-9  # half-width that is taken at least, over the frequency


@dataclass(frozen=True)
class LoopGain:
    """The loop gain over the gain.

    Attributes
    ----------
    mass, stiffness : ndarray, shape (d, d)
        M and K.
    elements : list of Superelement
        Of c cables.
    moved : ndarray, shape (c, 6, d)
        G.
    reeled : ndarray, shape (c, 6, i)
        H.
    lifted : ndarray, shape (d, i)
        F_0.
    measured : ndarray, shape (k, d)
        P.
    shares : ndarray, shape (i, k)
        A.
    controller : callable
        s, shape (f,) -> C1 N, shape (f, k).
    """

    mass: np.ndarray
    stiffness: np.ndarray
    elements: list
    moved: np.ndarray
    reeled: np.ndarray
    lifted: np.ndarray
    measured: np.ndarray
    shares: np.ndarray
    controller: object

    def __call__(self, s):
        """L for s of shape (f,), shape (f, k, k)."""
        parts = [self._part(s[begin : begin + AT_ONCE]) for begin in range(0, len(s), AT_ONCE)]
        return np.concatenate(parts or [np.zeros((0, len(self.measured), len(self.measured)), dtype=complex)])

    exact_unit_gain = __call__

    @property
    def spoilt(self):
        """Whether so much strain is damped that rounding spoils the response of a cable."""
        return any(element.spoilt for element, _ in self._parts)

    @np.errstate(divide="ignore", invalid="ignore")  # at the pole of an undamped mode it is infinite
    def _part(self, s):
        bodies, pulled = self._bodies(s)
        moved = self.measured @ np.linalg.solve(bodies, pulled @ self.shares)
        return moved * self.controller(s)[:, None, :]

    def _bodies(self, s):
        """Z, shape (f, d, d), and F, shape (f, d, i)."""
        bodies = s[:, None, None] ** 2 * self.mass + self.stiffness
        pulled = np.broadcast_to(self.lifted, (len(s), *self.lifted.shape)).astype(complex)
        for cable, part in enumerate(self._parts):
            stiffness, moved = self._stiffness(part, s), self.moved[cable]
            bodies = bodies + moved.T @ stiffness @ moved
            if self.reeled[cable].any():
                pulled = pulled - moved.T @ stiffness @ self.reeled[cable]
        return bodies, pulled

    @cached_property
    def _parts(self):
        """Each cable as a `Superelement`, and modes beside it that damping couples to no other: these or None."""
        found = []
        for element in self.elements:
            if element.strain is None or element.uneven or len(element.omega) <= COUPLED:
                found.append((element, None))
            else:
                strained = np.abs(element.strain.coupling).max(axis=1) / element.omega + np.sqrt(
                    np.abs(np.diagonal(element.strain.modes))
                )
                coupled = np.zeros(len(element.omega), dtype=bool)
                coupled[np.argsort(-strained / element.omega)[:COUPLED]] = True
                found.append((element.select(coupled), element.select(~coupled)))
        return found

    @staticmethod
    def _stiffness(part, s):
        element, others = part
        value = element.dynamic_stiffness(s)
        if others is None:
            return value
        rate = others.viscous + 2 * others.damping_ratio * others.omega
        moving = s[:, None] ** 4 / (others.omega**2 + s[:, None] * (s[:, None] + rate))
        products = others.coupling[:, :, None] * others.coupling[:, None, :]
        return value - (moving @ products.reshape(len(rate), 36)).reshape(value.shape)

    def poles_of(self, cable, modes):
        """About where modes of one cable have their poles with the bodies free, and their shift per gain, shape (n,).

        Parameters
        ----------
        cable : int
        modes : ndarray of int, shape (n,)
            Their numbers.

        Returns
        -------
        poles : ndarray, complex
            [rad/s]
        shift : ndarray, complex
            To first order.
        """
        element = self.elements[cable]
        omega, decay = element.omega[modes], np.maximum(element.decay[modes], NARROWEST * element.omega[modes])
        every, rate, coupling = 1j * (omega + ASIDE * decay), 2 * decay, element.coupling[modes]
        found = []
        for begin in range(0, len(modes), AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            s, momentum = every[part], coupling[part] @ self.moved[cable]
            bodies, pulled = self._bodies(s)
            own = s**4 / (omega[part] ** 2 + s * (s + rate[part]))
            bodies = bodies + own[:, None, None] * momentum[:, :, None] * momentum[:, None, :]
            moved = np.linalg.solve(bodies, momentum[..., None])[..., 0]
            pushed = (moved[:, None, :] @ pulled)[:, 0] + coupling[part] @ self.reeled[cable]
            made = (self.controller(s) * (moved @ self.measured.T)) @ self.shares.T
            found.append(np.stack([(momentum * moved).sum(axis=-1), (pushed * made).sum(axis=-1)]))
        held, driven = np.concatenate(found, axis=1) * omega**4
        poles = -decay + 1j * np.sqrt(omega**2 - held - decay**2)
        return poles, -driven / (2 * poles)
