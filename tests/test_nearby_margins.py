"""Margins and largest gains of loop gains that differ little, against those of each by itself."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import campaign
from test_margins import Chain, bisected

from cablestudy.control.gain_limits import Limit
from cablestudy.control.nearby_margins import nearby_limits, nearby_margins

NAMES = ("phase_margin", "gain_crossover", "delay_margin", "sensitivity_peak", "sensitivity_frequency", "bandwidth",
         "disk_margin", "disk_frequency", "disk_gain_margin", "disk_phase_margin")  # fmt: skip
LOOPS = pytest.mark.parametrize("k", [1, 2, 3])
SEEDS = pytest.mark.parametrize("seed", campaign(range(40), range(4)))


def changed(loop, change, seed):
    """The loop with other frequencies, damping ratios and shapes of its modes, by a relative change at most."""
    other, draw = Chain.__new__(Chain), np.random.default_rng(1000 + seed)
    vars(other).update(vars(loop))
    for name in ("omega", "ratio", "right", "left"):
        value = getattr(loop, name)
        setattr(other, name, value * (1 + change * draw.uniform(-1, 1, value.shape)))
    return other


@pytest.mark.crossed
@SEEDS
@LOOPS
def test_the_changes_of_all_margins_are_those_of_a_search_over_all_frequencies(seed, k):
    """To first order in 1e-6: next to modes of a damping ratio of 1e-5 that is not exact; of 1 %, where not refused."""
    loop = Chain(seed, k)
    known = loop.margins
    for change, rel in ((1e-6, 1e-9), (1e-2, 1e-8)):
        other = changed(loop, change, seed)
        found = nearby_margins(known, other)
        if found is None:  # a mode as narrow as the change
            assert change == 1e-2 or loop.ratio.min() < 1e-3
            continue
        expected = other.margins
        for name in NAMES:
            before, after, estimate = (getattr(margins, name) for margins in (known, expected, found))
            assert estimate == pytest.approx(after, rel=rel, abs=0.4 * abs(after - before)), name


@pytest.mark.crossed
@SEEDS
@LOOPS
def test_the_largest_gain_is_that_of_the_first_eigenvalue_to_cross(seed, k):
    loop = Chain(seed, k)
    if loop.limit is None:
        return
    pole = loop.poles(loop.limit)
    pole = pole[np.argmax(pole.real)]
    step = 1e-6
    rate = (loop.poles(loop.limit * (1 + step)).real.max() - loop.poles(loop.limit * (1 - step)).real.max()) / 2 / step
    limit = Limit(loop.limit, abs(pole.imag), rate / abs(pole.imag))
    rounding = 1e-13 * np.abs(loop.poles(0.0)).max() / rate * loop.limit  # of the gain at which an eigenvalue crosses
    for change in (1e-9, 1e-7, 1e-5):  # over the width of the pole from 1e-7 to more than 1
        other = changed(loop, change, seed)
        (found,) = nearby_limits(loop.unit_gain, [other.unit_gain], limit)
        if found is None:
            continue

        def growth(gain, other=other):
            return other.poles(gain).real.max()

        expected = bisected(growth, loop.limit * (1 - 0.1), loop.limit * (1 + 0.1))
        assert found.factor == pytest.approx(expected, abs=rounding + 1e-5 * abs(expected - loop.limit))
        assert abs(found.omega / limit.omega - 1) < 10 * change


def test_a_shift_of_more_than_the_width_of_the_pole_is_refused():
    """One narrow mode in front of an integrator, that crosses; its frequency moves by its own width."""
    ratio, share = 1e-5, 0.1

    def loop(frequency):
        """-share s/(s^2 + 2 ratio W s + W^2), which is -share/(2 ratio W) at s = i W."""
        return lambda s: (-share * s / (s**2 + 2 * ratio * frequency * s + frequency**2))[:, None, None]

    limit = Limit(2 * ratio / share, 1.0, ratio)
    (near,) = nearby_limits(loop(1.0), [loop(1 + 0.01 * ratio)], limit)
    assert near.omega - 1 == pytest.approx(0.01 * ratio, rel=1e-4)
    assert near.factor == pytest.approx(limit.factor * (1 + 0.01 * ratio), rel=1e-9)
    assert nearby_limits(loop(1.0), [loop(1 + ratio)], limit) == [None]
    assert nearby_limits(loop(1.0), [loop(1.0)], replace(limit, rate=1e-12)) == [None]  # as good as undamped
