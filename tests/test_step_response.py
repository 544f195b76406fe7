"""Overshoot, rise time and settling time against closed forms of systems of first and second order."""

import numpy as np
import pytest
import scipy.optimize
from command import CONFIGS, run, table_of
from picture import faults

from cablestudy import plots
from cablestudy.control.step_response import step_response

RATIOS = (0.05, 0.3, 0.7, 0.99)
OMEGA = 3.0  # [rad/s]


def rising(ratio, time):
    """Response of 1/(s^2/w^2 + 2 ratio s/w + 1) to a step of one."""
    damped = OMEGA * np.sqrt(1 - ratio**2)
    rest = np.cos(damped * time) + ratio * OMEGA / damped * np.sin(damped * time)
    return 1 - np.exp(-ratio * OMEGA * time) * rest


def settled(ratio, band):
    """From when on the response is within a band about one: its extrema, one after the other, bracket the crossing."""
    damped = OMEGA * np.sqrt(1 - ratio**2)
    turn = np.pi / damped
    last = int(np.floor(-np.log(band) / (ratio * OMEGA) / turn))  # the last extremum that is beyond the band
    level = 1 - (-1) ** last * band
    return scipy.optimize.brentq(lambda time: rising(ratio, time) - level, last * turn, (last + 1) * turn)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("final", [1.0, -2e-3])
def test_a_system_of_second_order(ratio, final):
    time = np.linspace(0, 10 / (ratio * OMEGA), 2001)
    found = step_response(time, final * rising(ratio, time), final)
    first, last = (
        scipy.optimize.brentq(lambda t, share=share: rising(ratio, t) - share, 0, np.pi / OMEGA / np.sqrt(1 - ratio**2))
        for share in (0.1, 0.9)
    )
    assert found.overshoot == pytest.approx(np.exp(-np.pi * ratio / np.sqrt(1 - ratio**2)), abs=1e-6)
    assert found.rise_time == pytest.approx(last - first, rel=1e-6)
    assert found.settling_time == pytest.approx(settled(ratio, 0.02), rel=1e-6)
    assert found.resolved
    assert not found.ends_near_zero


def test_a_system_of_first_order_never_overshoots():
    time = np.linspace(0, 10, 2001)
    found = step_response(time, 1 - np.exp(-time), 1.0)
    assert found.overshoot == 0
    assert (found.rise_time, found.settling_time) == pytest.approx((np.log(9), np.log(50)), rel=1e-9)
    short = time[time < 2]
    early = step_response(short, 1 - np.exp(-short), 1.0)
    assert (early.rise_time, early.settling_time) == (None, None)


def test_a_response_that_begins_after_a_delay():
    time = np.linspace(0, 60, 1201)
    found = step_response(time, np.where(time < 30, 0.0, 1 - np.exp((30 - time) / 3)), 1.0)
    assert (found.rise_time, found.settling_time) == pytest.approx((3 * np.log(9), 30 + 3 * np.log(50)), rel=1e-5)
    early = step_response(time, np.where(time < 30, 0.0, 0.01 * (time - 30)), 1.0)
    assert (early.rise_time, early.settling_time) == (None, None)


def test_a_disturbance_that_is_taken_back():
    """t exp(-t) is largest at t = 1; it comes to 2 % of that at the second root of t exp(1 - t) = 0.02."""
    time = np.linspace(0, 20, 2001)
    found = step_response(time, -time * np.exp(-time), 0.0)
    assert found.ends_near_zero
    assert found.size == pytest.approx(np.exp(-1), rel=1e-9)
    expected = scipy.optimize.brentq(lambda t: t * np.exp(1 - t) - 0.02, 1, 20)
    assert found.settling_time == pytest.approx(expected, rel=1e-6)


def test_too_few_points_of_time_are_said():
    time = np.linspace(0, 600, 201)
    assert not step_response(time, rising(0.3, time), 1.0).resolved
    assert step_response(time[:5], rising(0.3, time[:5]), 1.0) is None
    assert step_response(time, np.zeros(201), 0.0) is None
    assert step_response(time, rising(0.3, time), np.nan) is None


@pytest.mark.parametrize(
    ("which", "words"),
    [("reference", "overshoot 0 %, rise time 4."), ("winch", "(to 2 % of the largest displacement)"), ("gust", "")],
)
def test_the_command_states_them_and_draws_no_panel_of_a_constant(which, words, monkeypatch):
    asked = ("loop", str(CONFIGS / "carlina-pid.yaml"), "--time", "20s:3", "--input", which)
    figures = []
    monkeypatch.setattr(plots, "save", lambda figure, path: figures.append(figure))
    said = run(*asked, "--plot", "picture.svg").err
    assert words in said
    assert ("settling time" in said) == bool(words)
    (figure,) = figures
    assert len(figure.axes) == (3 if which == "gust" else 2)
    assert faults(figure) == []


def test_speed_of_a_winch_behind_a_jump_is_as_wrong_as_the_documentation_says():
    """Until the delay has passed twice the winch feels the reference alone: K_i/s + K_d s/(1 + s/f), behind its lag b.

    Per cent of the largest speed, in docs/control.md: at 1 ms, from 3 ms on, and at 20 ms behind the delay of 20 ms.
    """
    table = table_of("loop", str(CONFIGS / "carlina-pid.yaml"), "--time", "40ms:41", "--input", "reference")
    time, (f, b) = np.arange(1, 21) * 1e-3, 2 * np.pi * np.array([5.0, 10.0])
    derivative = 0.1 * f * b * (f * np.exp(-f * time) - b * np.exp(-b * time)) / (f - b)
    exact, largest = 0.5 * (1 - np.exp(-b * time)) + derivative, 0.1 * f * b
    wrong = np.abs([row["winch_speed_mm_per_s"] for row in table[21:]] - exact) / largest
    assert (wrong[0], wrong[2:].max()) == (pytest.approx(0.23, abs=5e-3), pytest.approx(0.04, abs=5e-3))
    assert wrong[-1] == pytest.approx(4e-4, abs=5e-5)
    assert table[20]["winch_speed_mm_per_s"] == pytest.approx(largest, rel=1e-9)
