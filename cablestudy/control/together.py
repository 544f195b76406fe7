"""Several plants evaluated at once, and the notch that filters their winch."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control.roots import secant
from cablestudy.control.transfer import Several


@dataclass(frozen=True)
class Notch:
    """N(s) = [(s^2 + 2 z1 w1 s + w1^2)/w1^2] [w2^2/(s^2 + 2 z2 w2 s + w2^2)].

    Attributes
    ----------
    omega, damping_ratio : float
        Of the notch. [rad/s], [-]
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

    @classmethod
    def stacked(cls, notches):
        """Several as one, whose fields have the shape (k, 1); None where there are none."""
        if None in notches:
            return None
        rows = [(one.omega, one.damping_ratio, one.rolloff_omega, one.rolloff_damping_ratio) for one in notches]
        return cls(*np.array(rows, dtype=float).T[..., None])

    @cached_property
    def poles(self):
        """Of the roll-off. [rad/s]"""
        damping, sign = complex(self.rolloff_damping_ratio), np.array([1, -1])
        return self.rolloff_omega * (sign * np.sqrt(damping**2 - 1) - damping)


class Together:
    """Some plants at once, each at places of its own, with no digit that depends on the others.

    Parameters
    ----------
    plants : list of Plant
    """

    def __init__(self, plants):
        self.plants, self._transfers = plants, Several([plant.transfer for plant in plants])
        self._mass = np.array([plant.mass for plant in plants], dtype=float)
        self._ground = np.array([plant.location != "gondola" for plant in plants])
        self._filtered = np.array([plant.notch is not None for plant in plants])
        fields = ("omega", "damping_ratio", "rolloff_omega", "rolloff_damping_ratio")
        self._notch = np.array(
            [[getattr(plant.notch, name, 1.0) for name in fields] for plant in plants], dtype=float
        ).T

    def balance(self, which, s, gain):
        """M s^2 + k_xx + C k_xu at a gain each. [N/m]"""
        own, driven = self._stiffness(which, s)
        return self._mass[which] * s**2 + own + gain * self._controller(which, s) * driven

    def unit_gain(self, which, s):
        """L for a gain of 1 rad/s. [-]"""
        own, driven = self._stiffness(which, s)
        return self._controller(which, s) * driven / (self._mass[which] * s**2 + own)

    def _stiffness(self, which, s):
        both = self._transfers.values(which, s)
        return both[0], np.where(self._ground[which], -both[1], both[0])

    def _controller(self, which, s):
        if not self._filtered.any():
            return 1 / s
        notch = Notch(*self._notch[:, which])(s)
        return (notch if self._filtered.all() else np.where(self._filtered[which], notch, 1.0)) / s


def zeros_of(together, which, gain, begin):
    """Poles with control near some places.

    Parameters
    ----------
    together : Together
    which : ndarray of int, shape (n,)
        Numbers of the plants, ascending.
    gain : ndarray, shape (n,)
        [rad/s]
    begin : ndarray, shape (n,)
        [rad/s]

    Returns
    -------
    ndarray, complex, shape (n,)
        NaN where there is none near. [rad/s]
    """
    ends = np.searchsorted(which, np.arange(len(together.plants) + 1))
    near, there = np.zeros(len(begin), dtype=complex), np.zeros(len(begin), dtype=bool)
    for plant, a, b in zip(together.plants, ends[:-1], ends[1:], strict=True):
        poles = plant.cable_poles if plant.notch is None else np.append(plant.cable_poles, plant.notch.poles)
        if a < b and len(poles):
            near[a:b] = poles[np.argmin(np.abs(begin[a:b, None] - poles), axis=1)]
            there[a:b] = True

    def balance(active, s):
        value = together.balance(which[active], s, gain[active])
        # a zero hides beside a pole of cable or notch, without which it is as plain as any other
        return np.where(there[active], value * (s - near[active]), value)

    return secant(balance, begin)
