"""PID, delay and lag of the winch: closed forms and python-control.

The law over frequency: `test_statespace`; encirclements by the loops of suspensions: `test_suspension_control_law`.
"""

import control
import numpy as np
import pytest
from command import CARLINA, refused_in_one_line, run, table_of, with_sets
from one_loop import spring_loop
from references.loop_matrix import notch
from scenes import cells, scene
from test_windrms import brute, force, paper_loop

from cablestudy.control.law import Law
from cablestudy.control.notch import Notch

MASS, STIFFNESS = 50.0, 1025.0
NATURAL = np.sqrt(STIFFNESS / MASS)
PID = (
    "winch.bandwidth=20 Hz", "winch.delay=10 ms", "winch.controller.proportional_gain=0.02",
    "winch.controller.derivative_gain=0.01 s", "winch.controller.derivative_filter=5 Hz",
)  # fmt: skip


@pytest.mark.parametrize("location", ["ground", "gondola"])
def test_an_integrator_with_a_delay_in_closed_form(location):
    """Far below the gondola's frequency: gain margin pi/(2 K T), phase margin 90 degrees - K T."""
    delay = 1e3 / NATURAL
    gain = 0.5 / delay
    gains = spring_loop(MASS, STIFFNESS, location, time=1 / NATURAL, law=Law(delay=delay))
    margins = gains.margins(gain)
    assert gains.limits[0].factor / gain == pytest.approx(np.pi / (2 * gain * delay), rel=1e-5)
    assert gains.limits[0].omega == pytest.approx(np.pi / (2 * delay), rel=1e-5)
    assert margins.phase_margin == pytest.approx(90 - np.degrees(gain * delay), abs=1e-4)
    assert margins.delay_margin == pytest.approx(np.pi / (2 * gain) - delay, rel=1e-5)


@pytest.mark.parametrize("derivative", [0.0, 0.02])
def test_a_pid_controller_has_the_margins_of_python_control(derivative):
    time, corner, lag, notch = 0.002, 40.0, 100.0, Notch(1.1 * NATURAL, 0.05, 20 * np.pi, 1.0)
    integral, proportional = 0.2, 0.03
    law = Law(1.0, proportional / integral, derivative / integral, corner, 0.0, lag)
    found = spring_loop(MASS, STIFFNESS, notch=notch, time=time, law=law)
    s = control.tf("s")
    spring = STIFFNESS * (time * s + 1)
    passed = (s**2 / notch.omega**2 + 0.1 * s / notch.omega + 1) / (s**2 / (20 * np.pi) ** 2 + s / (10 * np.pi) + 1)
    bracket = integral / s + proportional + derivative * s / (1 + s / corner)
    rational = bracket * passed / (1 + s / lag) * spring / (MASS * s**2 + spring)
    gains, phases, distances, *_ = control.stability_margins(rational, returnall=True)
    margins = found.margins(integral)
    assert found.limits[0].factor / integral == pytest.approx(gains[gains > 1].min(), rel=1e-5)
    assert margins.phase_margin == pytest.approx(np.abs(phases).min(), abs=1e-3)
    assert margins.sensitivity_peak == pytest.approx(1 / distances.min(), rel=1e-4)


def test_a_winch_that_is_too_slow_has_no_linear_answer():
    slow = ("--set", "winch.max_speed=1 mm/s")
    told = run("windrms", CARLINA, *slow, code=3).err

    def of_speed(frequency):
        """Spectrum of the force times |gain N|^2, with which the movement of the gondola is the speed of the winch."""
        passed = notch(2j * np.pi * frequency, paper_loop().notch.omega, 0.05, 2 * np.pi * 10, 1)
        return force(frequency) * np.abs(0.325 * passed) ** 2

    rms, rms_rate = 1e3 * brute(paper_loop(), 0.325, of_speed)
    most = np.sqrt(2 * np.log(600 * rms_rate / (2 * np.pi * rms)))  # Davenport's peak in 600 s
    reached = rms * (most + np.euler_gamma / most)
    assert f"the winch would reach {reached:.4g} mm/s in the wind, above its max_speed of 1 mm/s" in told
    (row,) = table_of("windrms", CARLINA, *slow, code=3)
    assert row["gondola_rms_mm"] is None
    assert row["gondola_rms_open_loop_mm"] > 0
    assert row["winch_peak_speed_mm_per_s"] > 1
    done = run("loop", CARLINA, *slow, "--time", "5s:3", "--input", "reference")
    at_once = 0.325 * (2 * np.pi * 10 / paper_loop().notch.omega) ** 2  # gain N(s) of large s, times 1 mm
    assert f"warning: the winch would reach {at_once:.3g}" in done.err
    assert "max_speed" not in run("windrms", CARLINA, "--set", "winch.max_speed=10 mm/s").err


@pytest.mark.parametrize("driving", ["winch", "reference", "gust"])
def test_winches_rest_exactly_until_the_delay_has_passed(driving):
    """By causality: approximants of the delay answer at once, with ripples of 1e-3 of the step."""
    late = with_sets("winch.delay=30 s", "winch.controller.gain=0.01")
    rows = table_of("loop", CARLINA, *late, "--time", "40s:21", "--input", driving)
    for row in rows:
        if row["time_s"] < 30:
            assert row["winch_mm"] == row["winch_speed_mm_per_s"] == 0
            assert row["gondola_mm"] == (0 if driving == "reference" else row["gondola_open_loop_mm"])
    assert [row["time_s"] for row in rows if row["winch_mm"]][-5:] == [32, 34, 36, 38, 40]
    if driving == "reference":  # the law integrates an error of 1 mm that nothing answers until 60 s
        assert rows[-1]["winch_mm"] == pytest.approx(0.01 * 10, rel=2e-3)


def test_the_speed_after_a_jump_of_the_reference_is_found_between_points_of_time():
    """w_d w_f w_b times the step, at once after the delay: between two points of time."""
    drive = "winch.delay=30 ms", "winch.bandwidth=10 Hz", "winch.max_speed=50 mm/s"
    law = "winch.controller={gain: 0.5 rad/s, derivative_gain: 0.1 s, derivative_filter: 5 Hz, notch: none}"
    damped = "cable.damping={model: kelvin_voigt, time: 1 ms, viscous: 0.02 N s/m^2}"
    asked = "loop", CARLINA, *with_sets(*drive, law, damped), "--input", "reference"
    reached = 0.1 * 2 * np.pi * 5 * 2 * np.pi * 10  # of a step of 1 mm
    assert f"the winch would reach {reached:.4g} mm/s" in run(*asked, "--time", "20s:3").err
    assert ", and 0 mm/s" in run(*asked, "--time", "0.02s:3").err


def test_gains_of_zero_change_nothing():
    names = "gain_margin", "phase_margin", "gondola_rms", "largest_gain"
    zero = ("winch.controller.proportional_gain=0", "winch.controller.derivative_gain=0", "winch.delay=0")
    assert cells(scene(*zero), *names) == cells(scene(), *names)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_the_margins_of_a_pid_loop_with_delay_have_the_error_that_they_state(accuracy):
    damped = ("cable.damping={model: kelvin_voigt, time: 1e-3, viscous: 0.02}",)
    names = "largest_gain", "phase_margin", "sensitivity_peak"
    exact, found = (
        cells(scene(*PID, *damped, f"model={{accuracy: {a}}}"), *names) for a in (1e-8, accuracy)
    )  # fmt: skip
    for name in names:
        assert found[name] == pytest.approx(exact[name], rel=3 * accuracy)


MISTAKES = {
    ("winch.controller.proportional_gain=0.1",): "winch.bandwidth: missing key",
    ("winch.controller.derivative_gain=0.1 s", "winch.bandwidth=5 Hz"): "derivative_filter: missing key",
    ("winch.controller.proportional_gain=0.1", "winch.bandwidth=5 Hz", "winch.controller.gain={auto: 6 dB}"):
        "winch.controller.gain: auto chooses an integral gain",
    ("winch.controller.gain=0", "winch.controller.proportional_gain=1", "winch.bandwidth=5 Hz"):
        "winch.controller.gain: must be above 0 with",
    ("winch.controller.proportional_gain=-1",): "winch.controller.proportional_gain",
    ("winch.delay=-1 ms",): "winch.delay",
    ("winch.delay=5 mm",): "winch.delay",
    ("winch.bandwidth=0",): "winch.bandwidth",
    ("winch.max_speed=1 mm",): "winch.max_speed",
    ("winch.controller.derivative_filter=5 ms",): "derivative_filter",
    ("winch.controler.gain=1",): "unknown key",
    ("winch.controller.propotional_gain=1",): "did you mean proportional_gain?",
}  # fmt: skip


@pytest.mark.parametrize("sets", MISTAKES)
def test_mistakes_are_one_line(sets, folder):
    refused_in_one_line(folder, MISTAKES[sets], "loop", CARLINA, *with_sets(*sets))
