"""The notch in series with a control law, which removes one frequency and rolls off above another one; and both."""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.records import stack, take_rows
from cablestudy.control.law import Law


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


PASSES = Notch(1.0, 1.0, 1.0, 1.0)  # a notch that is one at all frequencies


@dataclass(frozen=True)
class NotchedLaw:
    """C1 N_j of each measured coordinate j, a function: s, shape (f,) -> shape (f, k). [s]

    Attributes
    ----------
    law : Law
    notch : Notch
        Of all k coordinates at once.
    """

    law: Law
    notch: Notch

    @classmethod
    def of(cls, law, notches):
        """`NotchedLaw` of a law and the notch, or None, of each coordinate."""
        return cls(law, stack([notch or PASSES for notch in notches]))

    def __call__(self, s):
        return self.law(s)[:, None] * self.notch(s[:, None])

    @staticmethod
    def of_rows(controllers, row, s):
        """C1 N_j of n controllers of k coordinates, at s of the controllers `row`, both of shape (f,): shape (f, k)."""
        laws = {}
        for number, controller in enumerate(controllers):
            laws.setdefault(controller.law, []).append(number)
        value = np.empty(len(s), dtype=complex)
        for law, numbers in laws.items():
            own = slice(None) if len(laws) == 1 else np.isin(row, numbers)
            value[own] = law(s[own])
        notches = stack([controller.notch for controller in controllers])
        return value[:, None] * take_rows(notches, row)(s[:, None])
