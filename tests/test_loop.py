"""Margins and response in time of the winch loop: python-control, closed forms, encirclements; the command `loop`."""

from dataclasses import replace
from functools import cache

import control
import numpy as np
import pytest
import scipy.integrate
from command import CARLINA, ROOT, process, rows_of, run, table_of
from references import loop_matrix
from scenes import cells, scene
from test_encirclements import encirclements, plant_of
from test_winch import loop_gain, loop_of, rigid

from cablestudy.control import loop_response, time_response
from cablestudy.control.winch import Loop, Notch
from cablestudy.errors import NoSolutionError
from cablestudy.study import plots
from cablestudy.study.case import Case

MASS, STIFFNESS, TIME = 50.0, 1025.0, 0.002
NATURAL = np.sqrt(STIFFNESS / MASS)


def spring_loop(gain, ratio=1.1):
    """An integrator with a notch on a damped spring, and the same as a transfer function of python-control."""
    notch = Notch(ratio * NATURAL, 0.05, 20 * np.pi, 1.0)
    spring = STIFFNESS * np.array([TIME, 1.0])
    zero = np.array([1, 0.1 * notch.omega, notch.omega**2]) / notch.omega**2
    pole = np.array([1, 40 * np.pi, (20 * np.pi) ** 2]) / (20 * np.pi) ** 2
    below = np.polymul([1, 0], np.polymul(pole, np.polyadd([MASS, 0, 0], spring)))
    return rigid(MASS, STIFFNESS, gain=gain, notch=notch, time=TIME), control.tf(gain * np.polymul(zero, spring), below)


@pytest.mark.parametrize("gain", [0.05, 0.3])
@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_margins_are_those_of_python_control(gain, ratio):
    loop, rational = spring_loop(gain, ratio)
    gains, phases, distances, at_gain, at_phase, at_distance = control.stability_margins(rational, returnall=True)
    if loop.largest_gain < gain:
        assert min(gains) == pytest.approx(loop.largest_gain / gain, rel=1e-6)
        return
    least = np.argmin(np.abs(phases))
    assert loop.margins.phase_margin == pytest.approx(abs(phases[least]), abs=1e-5)
    assert 2 * np.pi * loop.margins.gain_crossover == pytest.approx(at_phase[least], rel=1e-6)
    above = gains[gains > 1]
    assert loop.largest_gain / gain == pytest.approx(above.min(), rel=1e-6)
    assert 2 * np.pi * loop.phase_crossover == pytest.approx(at_gain[gains > 1][above.argmin()], rel=1e-6)
    peak, frequency = loop.margins.sensitivity_peak, loop.margins.sensitivity_frequency
    assert peak == pytest.approx(1 / distances.min(), rel=1e-6)
    assert 2 * np.pi * frequency == pytest.approx(at_distance[distances.argmin()], rel=1e-3)
    assert loop.margins.delay_margin == pytest.approx((np.radians(phases % 360) / at_phase).min(), rel=1e-6)


@pytest.mark.parametrize("location", ["ground", "gondola"])
def test_delay_and_phase_margin_of_an_integrator_in_closed_form(location):
    """Far below the gondola's frequency the loop is K/s: it crosses at K with 90 degrees, a delay of pi/(2 K)."""
    gain = 1e-5 * NATURAL
    loop = rigid(MASS, STIFFNESS, location, gain, time=TIME)
    assert 2 * np.pi * loop.margins.gain_crossover == pytest.approx(gain, rel=1e-9)
    assert loop.margins.phase_margin == pytest.approx(90, abs=1e-3)
    assert loop.margins.delay_margin == pytest.approx(np.pi / (2 * gain), rel=1e-4)


class Late:
    """A plant whose loop gain comes later."""

    def __init__(self, plant, delay):
        self._plant, self._delay = plant, delay

    def __getattr__(self, name):
        return getattr(self._plant, name)

    def unit_gain(self, s):
        return self._plant.unit_gain(s) * np.exp(-s * self._delay)


@pytest.mark.parametrize("name", ["ground", "thick, gondola", "viscous"])
def test_a_delay_of_the_margin_is_where_the_curve_begins_to_encircle(name):
    loop = Loop.of(plant_of(name), 0.5)
    for part, expected in ((0.3, 0), (0.999, 0), (1.001, 2)):
        assert encirclements(Late(loop.plant, part * loop.margins.delay_margin), loop.gain) == expected


@pytest.mark.parametrize("which", [("carlina", "ground"), ("carlina", "gondola"), ("slack", "ground", "coupled")])
@pytest.mark.parametrize("margin", [1.0, 20.0])
def test_the_peak_of_the_sensitivity_is_that_of_a_fine_scan(which, margin):
    loop = loop_of(*which).with_margins(margin)
    poles = np.linalg.eigvals(loop_matrix.matrices(loop, loop.gain)[0])
    poles = poles[poles.imag > 1e-6]
    parts = [abs(p) + abs(p.real) * np.linspace(-3, 3, 601) for p in poles]
    omega = np.unique(np.concatenate([np.geomspace(1e-3 * loop.gain, 2 * np.abs(poles).max(), 20_000), *parts]))
    size = np.abs(1 / (1 + loop_gain(loop, omega[omega > 0])))
    peak, frequency = loop.margins.sensitivity_peak, loop.margins.sensitivity_frequency
    assert peak == pytest.approx(size.max(), rel=1e-4)
    assert peak >= size.max() * (1 - 1e-12)
    assert 2 * np.pi * frequency == pytest.approx(omega[omega > 0][size.argmax()], rel=1e-3)


def test_no_peak_is_stated_for_a_mode_as_good_as_undamped():
    """Its pole lies to the right by less than what is called instability, and the peak is none of the loop."""
    loop = loop_of("carlina", "ground", "static", "cable.damping={model: kelvin_voigt, time: 1e-3}")
    with pytest.raises(NoSolutionError, match=r"no peak of the sensitivity.*3\.179 Hz.*cable\.damping\.viscous"):
        _ = replace(loop, gain=0.2).margins.sensitivity_peak


# ------------------------------------------------------------------------------------------------------- in time


def test_a_step_of_the_winch_without_loop_in_closed_form():
    ratio = 0.05
    loop = replace(rigid(MASS, STIFFNESS), damping=2 * ratio * NATURAL * MASS)
    time = np.linspace(0, 20, 101)
    found = loop_response.loop_response(loop, loop_response.WINCH, time_response.step(2e-3), time)
    damped = NATURAL * np.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * NATURAL * time)
    expected = 1 - decay * (np.cos(damped * time) + ratio * NATURAL / damped * np.sin(damped * time))
    assert found.open_loop == pytest.approx(2e-3 * expected, abs=1e-14)
    assert found.measured == pytest.approx(2e-3 * expected, abs=1e-14)
    assert np.abs(found.winch).max() < 1e-16
    assert np.isnan(found.final)


@pytest.mark.parametrize("which", [("carlina", "ground"), ("slack", "gondola", "coupled"), ("carlina", "ground", "")])
def test_a_gust_on_the_gondola_is_that_of_the_dense_matrix_by_integration(which):
    loop = loop_of(*which).with_margins(10.0)
    A, B = loop_matrix.matrices(loop, loop.gain)
    size, length, time = 3.0, 1.7, np.linspace(0, 6, 25)  # no point of time is the end of the gust

    def rate(t, x):
        return A @ x + B * (size / 2 * (1 - np.cos(2 * np.pi * t / length)) if t < length else 0.0)

    settings = {"method": "Radau", "rtol": 1e-8, "atol": 1e-14, "jac": lambda t, x: A}
    first = scipy.integrate.solve_ivp(rate, (0, length), np.zeros(len(A)), t_eval=time[time < length], **settings)
    begin = scipy.integrate.solve_ivp(rate, (0, length), np.zeros(len(A)), **settings).y[:, -1]
    second = scipy.integrate.solve_ivp(rate, (length, 6), begin, t_eval=time[time > length], **settings)
    expected = np.concatenate([first.y, second.y], axis=1)[loop_matrix.place(A)]
    found = loop_response.loop_response(loop, loop_response.FORCE, time_response.gust(size, length), time)
    assert found.measured == pytest.approx(expected, abs=2e-6 * np.abs(expected).max())


def test_the_reference_is_reached_and_a_step_of_the_winch_is_taken_back():
    loop = loop_of("carlina", "ground").with_margins(30.0)
    time = np.linspace(0, 3000 / loop.gain, 11)
    for place, gondola, winch in ((loop_response.REFERENCE, 1.0, 1.0), (loop_response.WINCH, 0.0, -1.0)):
        found = loop_response.loop_response(loop, place, time_response.step(1.0), time)
        assert (found.measured[-1], found.winch[-1, 0]) == pytest.approx((gondola, winch), abs=1e-6)
        assert found.final == pytest.approx(gondola, abs=1e-9)


def test_an_unstable_loop_has_no_response_in_time():
    with pytest.raises(NoSolutionError, match="unstable loop"):
        loop_response.loop_response(
            replace(loop_of("carlina"), gain=80.0), "winch", time_response.step(1.0), np.linspace(0, 1, 3)
        )


# ----------------------------------------------------------------------------------------------------- the command


def test_the_table_has_the_margins_of_the_loop():
    (row,) = table_of("loop", CARLINA)
    loop = Case(scene()).loop
    assert row["gain_rad_per_s"] == 0.325
    assert row["delay_margin_s"] == pytest.approx(loop.margins.delay_margin, rel=1e-9)
    peak = loop.margins.sensitivity_peak, loop.margins.sensitivity_frequency
    assert (row["sensitivity_peak"], row["sensitivity_frequency_Hz"]) == pytest.approx(peak, rel=1e-6)
    assert row["phase_crossover_Hz"] == pytest.approx(loop.phase_crossover, rel=1e-9)
    assert row["status"] == "ok"


def test_the_response_has_a_row_at_each_resonance():
    rows = table_of("loop", CARLINA, "--response", "0.1 Hz:10 Hz:20")
    loop = Case(scene()).loop
    frequency = np.array([row["frequency_Hz"] for row in rows])
    value = loop_gain(replace(loop, cable=loop.excited), 2 * np.pi * frequency)
    for name, expected in (
        ("open_loop", value), ("sensitivity", 1 / (1 + value)), ("complementary_sensitivity", value / (1 + value))
    ):  # fmt: skip
        assert [row[f"{name}_dB"] for row in rows] == pytest.approx(20 * np.log10(np.abs(expected)), abs=1e-6)
        turns = ([row[f"{name}_phase_deg"] for row in rows] - np.degrees(np.angle(expected))) / 360
        assert turns == pytest.approx(np.round(turns), abs=1e-8)
    assert np.abs(np.geomspace(0.1, 10, 20)[:, None] - frequency).min(axis=1).max() < 1e-12
    assert max(row["sensitivity_dB"] for row in rows) > 20 * np.log10(loop.margins.sensitivity_peak) - 0.2


def test_a_gust_is_a_multiple_of_the_turbulence_and_shown_as_asked():
    done = run("loop", CARLINA, "--time", "10s:11", "--input", "gust", "--format", "json")
    rows = rows_of(done.out, "json")
    assert [row["time_s"] for row in rows] == pytest.approx(np.linspace(0, 10, 11))
    expected = 3 * 0.15 * 6 / 2 * (1 - np.cos(2 * np.pi * np.arange(5) * 6 / 25))
    assert [row["wind_m_per_s"] for row in rows] == pytest.approx([*expected, *[0] * 6], abs=1e-12)
    assert "1-cosine gust of 2.7 m/s within 4.167 s" in done.err


MISTAKES = {
    ("--time", "-1s"): "--time -1s: a time must be positive",
    ("--time", "10 kg"): "--time 10 kg",
    ("--time", "1e-9 s"): "--time 1e-9 s: 1e-09 s is not from 1e-06 to 1e+09 s",
    ("--time", "1s", "--size", "1e300 m"): "1e+300 m is not from 1e-12 to 1e+09 m",
    ("--time", "1s", "--input", "gust", "--length", "1 us"): "--length of the gust: 1e-06 s is not from 0.0001",
    ("--time", "10s:1"): "COUNT must be a whole number",
    ("--time", "10s", "--response", "1Hz:2Hz:3"): "--response and --time exclude each other",
    ("--input", "gust"): "--input: no effect: for --time only",
    ("--time", "10s", "--length", "2 s"): "--length: no effect",
    (
        "--time",
        "10s",
        "--input",
        "gusts",
    ): "--input gusts: unknown (did you mean gust? allowed: winch, reference, gust, wind)",
    ("--time", "10s", "--output", "gondola.x"): "--output: no effect",
    ("--table", "loop"): "--table: no effect",
    ("--time", "10s", "--size", "2 m/s"): "--size 2 m/s",
    ("--time", "10s", "--input", "gust", "--size", "0 m/s"): "a speed must be positive",
    ("--time", "10s", "--input", "gust", "--set", "wind=null"): "missing key",
    ("--response", "2Hz:1Hz:5"): "FROM must be below TO",
    ("--set", "winch.controller=null"): "missing key",
    ("--set", "gondola=null"): "missing key",
    ("--plot", "x.gif"): "unknown kind of picture",
    ("--case", "all"): "a loop is that of one case",
}


@pytest.mark.parametrize("given", MISTAKES)
def test_mistakes_are_one_line(given):
    done = run("loop", CARLINA, *given, code=2)
    assert done.out == ""
    assert len(done.lines) == 1
    assert MISTAKES[given] in done.err


@pytest.mark.parametrize("given", [(), ("--time", "10s")])
def test_an_unstable_loop_says_why(given):
    done = run("loop", CARLINA, "--set", "winch.controller.gain=80", *given, code=3)
    assert "the loop is unstable at 80 rad/s" in done.err
    if not given:
        assert "gain margin" in done.out


@cache
def case_of(*sets):
    return Case(scene(*sets))


PID = ("winch.delay=5 ms", "winch.bandwidth=10 Hz", "winch.controller.proportional_gain=0.02",
       "winch.controller.derivative_gain=1 ms", "winch.controller.derivative_filter=5 Hz")  # fmt: skip


@pytest.mark.parametrize("given", [(), ("--response", "0.1Hz:1Hz:3"), ("--time", "1 s:3")])
def test_a_loop_that_no_model_is_made_for_says_why(given):
    """Modal damping to an accuracy: refused before anything is refined."""
    done = run("loop", CARLINA, "--set", "model={accuracy: 1e-4}", *given, code=3)
    assert "modal damping grows with the number of modes" in done.err


@pytest.mark.parametrize("sets", [(), ("winch.controller.gain=80",), ("winch.controller.gain={auto: 6 dB}",), PID])
def test_pictures_show_the_margins_within_the_figure(sets):
    figure = plots.loop_margins(case_of(*sets))
    figure.canvas.draw()
    whole = figure.bbox
    for legend in [axes.get_legend() for axes in figure.axes if axes.get_legend()]:
        box = legend.get_window_extent()
        assert whole.x0 <= box.x0 < box.x1 <= whole.x1
        assert whole.y0 <= box.y0 < box.y1 <= whole.y1
    beside = figure.axes[-1]
    lowest = min(text.get_window_extent().y0 for text in beside.texts)
    assert lowest > beside.get_legend().get_window_extent().y1
    said = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    limit = case_of(*sets).loop.largest_integral_gain
    assert f"{limit:.4g} rad/s" in said
    assert ("unstable" in said) == ("80" in str(sets))


def test_a_gain_of_zero_has_no_picture():
    done = process("loop", CARLINA, "--set", "winch.controller.gain=0", "--plot", "none.png")
    assert done.code == 3
    assert "the gain of the loop is zero" in done.err


def test_the_example_for_python_control_agrees_with_the_loop(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    text = (ROOT / "docs" / "control.md").read_text(encoding="utf-8")
    exec(text.split("```python\n")[1].partition("```")[0], {})
    found, phase, expected = map(float, capsys.readouterr().out.split())
    assert found == pytest.approx(expected, abs=0.01)  # dB, with the modes up to 25 Hz
    pid = cells(scene(base=str(ROOT / "configs" / "carlina-pid.yaml")), "phase_margin")
    assert phase == pytest.approx(pid["phase_margin"], rel=1e-4)


@pytest.mark.parametrize(("size", "told"), [("100 m", True), ("1 mm", False)])
def test_a_winch_that_is_faster_than_any_is_told(size, told):
    err = run("loop", CARLINA, "--time", "10 s", "--size", size).err
    assert ("where hardly any winch can" in err) is told
    stated = ["--set", "winch.max_speed=1000 m/s"]
    assert "hardly any" not in run("loop", CARLINA, "--time", "10 s", "--size", size, *stated).err
