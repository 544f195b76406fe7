"""Motion within exposures, and what a correcting mirror leaves of it."""

import numpy as np
import pytest

from cablestudy.errors import NoSolutionError
from cablestudy.wind.imaging import correction_weight, exposure_weight


@pytest.mark.parametrize("frequency", [0.3, 1.0, 7.7, 40.0, 159.0, 159.2, 500.0, 1234.5])
def test_sinusoid_within_exposures(frequency):
    exposure = 1e-3
    points, weights = np.polynomial.legendre.leggauss(200)
    within = exposure * (1 + points) / 2
    phase = np.arange(16)[:, None] * 2 * np.pi / 16  # exposures that begin anywhere in a period
    # about the value at mid-exposure, so that nothing cancels
    motion = np.sin(2 * np.pi * frequency * within + phase) - np.sin(np.pi * frequency * exposure + phase)
    mean = motion @ weights / 2
    variance = (motion**2 @ weights / 2 - mean**2).mean()
    assert exposure_weight(np.array([frequency]), exposure)[0] == pytest.approx(variance / 0.5, rel=1e-9)


def test_limits_of_exposure():
    assert exposure_weight(np.array([0.0, 1e9]), 1.0) == pytest.approx([0.0, 1.0])
    # slow motion is a straight line: the variance of an interval, t^2/12, times (2 pi f)^2
    slow = np.array([1e-150, 1e-9])
    assert exposure_weight(slow, 2.0) == pytest.approx((2 * np.pi * slow) ** 2 * 4 / 12, rel=1e-12)


@pytest.mark.parametrize("delay", [0.0, 1e-3, 12e-3])
def test_mirror(delay):
    frequency = np.geomspace(1e-3, 1e4, 50)
    s = 2j * np.pi * frequency
    loop = 2 * np.pi * 20 / s * np.exp(-s * delay)
    assert correction_weight(frequency, 20.0, delay) == pytest.approx(np.abs(1 / (1 + loop)) ** 2, rel=1e-9)


def test_mirror_in_time():
    bandwidth, delay, frequency, steps = 5.0, 0.02, 4.0, 20_000
    step = 1 / frequency / steps  # the mirror follows what was left before the delay
    late, count = round(delay / step), 20 * steps
    motion = np.sin(2 * np.pi * frequency * step * np.arange(count))
    left, mirror = motion.tolist(), 0.0
    for now in range(count):
        left[now] -= mirror
        if now >= late:
            mirror += 2 * np.pi * bandwidth * step * left[now - late]
    rms = np.sqrt(2 * np.mean(np.square(left[-steps:])))
    assert rms**2 == pytest.approx(correction_weight(np.array([frequency]), bandwidth, delay)[0], rel=2e-3)


def test_limits_of_mirror():
    assert np.array_equal(correction_weight(np.array([0.0, 1e-300, 1e300]), 20.0, 1e-3), [0.0, 0.0, 1.0])


def test_unstable_mirror():
    with pytest.raises(NoSolutionError, match=r"20 Hz is unstable with a delay of 0.0125 s.*= 20 Hz"):
        correction_weight(np.ones(1), 20.0, 0.0125)
    assert np.isfinite(correction_weight(np.ones(1), 20.0, 0.0124999)).all()
