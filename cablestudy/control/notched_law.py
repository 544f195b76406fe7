"""The controller of a loop, its law behind the notches of what is measured: of one loop, or of many at once."""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.law import Law
from cablestudy.control.notch import Notch

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
        return cls(law, Notch.stack([notch or PASSES for notch in notches]))

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
        notches = Notch.stack([controller.notch for controller in controllers])
        return value[:, None] * notches.take(row)(s[:, None])
