"""The loop gain of a suspension from the residues of many of its coupled modes, beside that of its bodies."""

import numpy as np

from cablestudy.control.stable_gains import StableGains
from cablestudy.motion.driven_cables import open_poles
from cablestudy.system.first_order import equations


def gains_of_modes(closed_loop):
    """`StableGains` of a `ClosedLoop` by the modes of its model: poles and residues of one eigen-solution."""
    loop = closed_loop.untuned_loop
    found, eigen, m = equations(loop.motion), loop.motion.eigen, len(loop.motion)
    seen = (loop.allocation.measured @ found.coordinates @ eigen.right).T
    forced = eigen.left[:, m : 2 * m] @ np.linalg.inv(loop.motion.mass)
    pulled = [forced @ part @ loop.allocation.matrix for part in loop.motion.b]
    residues = [seen[:, :, None] * part[:, None, :] for part in pulled]
    size = len(loop.notches)

    @np.errstate(divide="ignore", invalid="ignore")  # at a pole
    def loop_gain(s):
        fractions = 1 / (s[:, None] - eigen.values)
        parts = (s[:, None] ** order * (fractions @ part.reshape(-1, size**2)) for order, part in enumerate(residues))
        return sum(parts).reshape(-1, size, size) * loop.controller(s)[:, None, :]

    return StableGains(loop_gain, open_poles(closed_loop), loop.notches, loop.law)
