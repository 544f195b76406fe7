"""The notch in series with a control law: it removes one frequency, and rolls off above another one."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Notch:
    """Notch filter N(s) = [(s^2 + 2 z1 w1 s + w1^2)/w1^2] [w2^2/(s^2 + 2 z2 w2 s + w2^2)].

    Attributes
    ----------
    omega, damping_ratio : float
        Of the notch; arrays of shape (k,) for k notches at once. [rad/s], [-]
    rolloff_omega, rolloff_damping_ratio : float
        [rad/s], [-]
    """

    omega: float
    damping_ratio: float
    rolloff_omega: float
    rolloff_damping_ratio: float

    def __call__(self, s):
        """Value at s. [-]"""
        zero, pole = s / self.omega, s / self.rolloff_omega
        return (zero * (zero + 2 * self.damping_ratio) + 1) / (pole * (pole + 2 * self.rolloff_damping_ratio) + 1)

    @property
    def corners(self):
        """Estimates of its zero and its pole in the upper half plane, shape (2,). [rad/s]"""
        zero_and_pole = (self.omega, self.damping_ratio), (self.rolloff_omega, self.rolloff_damping_ratio)
        return np.array([omega * (1j - ratio) for omega, ratio in zero_and_pole])

    @property
    def state_space(self):
        """a, b, c, d for the states w2^2/q and s w2/q, q the roll-off's polynomial; of k notches (k, 2, 2), (k, 2)."""
        w1, w2, zero = np.asarray(self.omega), np.asarray(self.rolloff_omega), 0 * np.asarray(self.omega)
        d = (w2 / w1) ** 2
        a = np.stack(
            [np.stack([zero, w2], axis=-1), np.stack([-w2, -2 * w2 * self.rolloff_damping_ratio], axis=-1)], -2
        )
        of_second = 2 * d * (self.damping_ratio * w1 / w2 - self.rolloff_damping_ratio)
        return a, np.stack([zero, w2], axis=-1), np.stack([1.0 - d, of_second], axis=-1), d

    @staticmethod
    def stack(notches):
        """`Notch` with arrays, shape (n, ...), of n notches."""
        return Notch(*np.stack([[*vars(notch).values()] for notch in notches], axis=1))

    def take(self, rows):
        """`Notch` with some of many."""
        return Notch(*(np.asarray(part)[rows] for part in vars(self).values()))
