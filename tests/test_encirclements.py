"""A second opinion on the winch loop: encirclements of the Nyquist curve, and gains between which it is unstable."""

import numpy as np
import pytest
from campaign import campaign
from one_loop import OneLoop
from scenes import scene

from cablestudy.control.margins_grid import frequencies

STATIC = "winch.controller.notch.frequency=static"
THICK = "cable.diameter=5.55 mm"
LOOPS = {
    "ground": (),
    "gondola": ("winch.location=gondola",),
    "thick, ground": (THICK, STATIC),
    "thick, gondola": (THICK, STATIC, "winch.location=gondola"),
    "viscous": ("cable.damping={model: kelvin_voigt, time: 1e-3, viscous: 0.02}",),
    "no notch": ("winch.controller.notch=none", "winch.location=gondola"),
}


def loop_of(name):
    """The loop of 40 bars."""
    return OneLoop(scene(*LOOPS[name]))


def encirclements(loop, gain):
    """Number of unstable poles by the argument principle.

    1 + L has its only pole that is not stable in s = 0, where L is about gain/s. The contour passes it on the right,
    where the argument falls by pi; along either half of the imaginary axis it grows by the same angle. So
    -2 pi Z = 2 angle - pi.
    """
    poles = np.concatenate([loop.open_poles, loop.cable.poles])
    omega = frequencies(poles[poles.imag >= 0], (loop.notch,))
    value = 1 + gain * loop.unit_gain(1j * omega)
    for _ in range(12):
        coarse = np.abs(np.angle(value[1:] / value[:-1])) > 0.3
        if not coarse.any():
            break
        omega = np.sort(np.concatenate([omega, (omega[1:] + omega[:-1])[coarse] / 2]))
        value = 1 + gain * loop.unit_gain(1j * omega)
    angle = np.angle(value[1:] / value[:-1]).sum()
    # from the lowest frequency down to zero, and from the highest up to infinity
    angle += np.angle(value[0] / -1j) - np.angle(value[-1])
    return round(0.5 - angle / np.pi)


@pytest.mark.parametrize("name", LOOPS)
@pytest.mark.parametrize("gain", campaign([0.1, 1.0, 4.0, 6.0, 20.0, 60.0], [1.0, 6.0, 20.0]))
def test_encirclements_count_the_unstable_eigenvalues(name, gain):
    loop = loop_of(name)
    assert encirclements(loop, gain) == loop.unstable(gain)


@pytest.mark.parametrize("name", LOOPS)
def test_the_largest_gain_is_the_first_at_which_the_curve_encircles(name):
    loop = loop_of(name)
    limit = loop.largest_gain
    assert all(encirclements(loop, gain) == 0 for gain in limit * np.geomspace(1e-3, 0.999, campaign(20, 6)))
    assert encirclements(loop, 1.001 * limit) > 0


def test_a_loop_that_is_stable_again_at_larger_gains_has_the_smaller_limit():
    loop = loop_of("thick, ground")
    assert encirclements(loop, 20.0) == 0
    assert loop.largest_gain < 5.0
