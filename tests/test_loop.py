"""Margins and response in time of the winch loop: python-control and closed forms; the command `loop`."""

from dataclasses import replace
from math import factorial
from types import SimpleNamespace

import control
import numpy as np
import pytest
import scipy.linalg
from cables import along_x
from command import CARLINA, ROOT, refused_in_one_line, rows_of, run, table_of, with_sets
from one_loop import moved_by_winch
from references import loop_matrix
from scenes import AREA, DENSITY, MODULUS, case_of, cells, scene
from scipy.optimize import brentq
from test_control_law import PID
from test_windrms import paper_loop

from cablestudy import plots
from cablestudy.study.columns import find
from cablestudy.study.loop_in_time import TimeOptions, time_case
from cablestudy.study.loop_report import curves, unwrapped_phase
from cablestudy.study.one_cable.case import CableCase

LENGTH, TIME, TURN = 99.0, 0.002, 2 * np.pi
STIFFNESS = MODULUS * AREA / LENGTH
MASS = 50 + DENSITY * AREA * LENGTH / 2  # of the gondola and of half of its cable
NATURAL = float(np.sqrt(STIFFNESS / MASS))
SPRING = (
    "gravity=0", "cable.ends=[[0, 0, 0], [100 m, 0, 0]]", f"cable.unstretched_length={LENGTH} m",
    "model={elements: 1, order: 1, mass: lumped}",
)  # fmt: skip
SAGGING = ("cable.area=24.2 mm^2", "cable.unstretched_length=186.000 m")  # the last row of Table 6
COUPLED = "winch.controller.notch.frequency=coupled"
BARS = {
    "ground": (),
    "gondola": ("winch.location=gondola",),
    "sagging": (*SAGGING, COUPLED),
    "no notch": ("winch.location=gondola", "winch.controller.notch=none"),
}


def automatic(margin):
    """The gain with a gain margin [dB], whatever the sensitivity."""
    return f"winch.controller.gain={{auto: {{gain_margin: {margin} dB, sensitivity: 1e9}}}}"


def spring(gain, ratio=1.1, location="ground"):
    """A loop with a gondola on one bar of damped strain, without any mode: its analysis and its notch's frequency."""
    notch = f"{{frequency: {ratio * NATURAL / TURN!r} Hz}}" if ratio else "none"
    damped = f"cable.damping={{model: kelvin_voigt, time: {TIME} s}}"
    own = (f"winch.controller={{gain: {gain!r} rad/s, notch: {notch}}}", f"winch.location={location}")
    return CableCase(scene(*SPRING, damped, *own)).analysis


def spring_loop(gain, ratio=1.1):
    """An integrator with a notch on a damped spring, and the same as a transfer function of python-control."""
    omega = ratio * NATURAL
    bar = STIFFNESS * np.array([TIME, 1.0])
    zero = np.array([1, 0.1 * omega, omega**2]) / omega**2
    pole = np.array([1, 40 * np.pi, (20 * np.pi) ** 2]) / (20 * np.pi) ** 2
    below = np.polymul([1, 0], np.polymul(pole, np.polyadd([MASS, 0, 0], bar)))
    return spring(gain, ratio), control.tf(gain * np.polymul(zero, bar), below)


def bar_loop(case):
    """Cable, mass, winch and notch of a case, as `loop_matrix` takes them."""
    winch, notch = case.scene.winch, case.scene.winch.controller.notch
    if notch is not None:
        static = find("gondola_frequency_static").compute(case)
        own = {"coupled": case.gondola_mode.frequency[0], "static": static}[notch.frequency]
        notch = SimpleNamespace(
            omega=TURN * own,
            damping_ratio=notch.damping_ratio,
            rolloff_omega=TURN * notch.rolloff_frequency,
            rolloff_damping_ratio=notch.rolloff_damping_ratio,
        )
    return SimpleNamespace(
        cable=along_x(case), mass=case.scene.gondola.mass, location=winch.location, notch=notch, damping=0.0
    )


def loop_gain(case, omega):
    """L over frequency [rad/s] by the stiffness of the cable at its ends."""
    loop, s = bar_loop(case), 1j * omega
    moved = moved_by_winch(loop.cable, loop.mass, loop.location, s)
    filtered = loop_matrix.notch(s, *vars(loop.notch).values()) if loop.notch else 1.0
    return case.analysis.gain[0] * filtered / s * moved


@pytest.mark.parametrize("name", BARS)
def test_curves_are_those_of_the_stiffness_of_the_cable_at_its_ends(name):
    case, frequency = case_of(*BARS[name]), np.geomspace(1e-3, 30, 200)
    value = loop_gain(case, TURN * frequency)
    found = curves(case.analysis.loop_for_margins, frequency)[..., 0, 0]
    for own, expected in zip(found, (value, 1 / (1 + value), value / (1 + value)), strict=True):
        assert own == pytest.approx(expected, rel=1e-10)


# ------------------------------------------------------------------------------------------------------- in time


def in_time(case, kind, time, size):
    """The response over some uniform points of time."""
    options = TimeOptions(f"{float(time[-1])!r} s:{len(time)}", kind, size)
    found = time_case(None, case.scene, case.analysis, options).response
    every = slice(None, None, options.every)
    return replace(
        found,
        measured=found.measured[every],
        open_loop=None if found.open_loop is None else found.open_loop[every],
        winch=found.winch[every],
    )


def test_a_step_of_the_winch_without_loop_in_closed_form():
    ratio = 0.05
    bar = f"cable.damping={{model: kelvin_voigt, time: {2 * ratio / NATURAL!r} s}}"
    time = np.linspace(0, 20, 101)
    found = in_time(case_of(*SPRING, bar, "winch.controller.gain=0"), "winch", time, "2 mm")
    # end 1 moves the gondola by the spring and its dashpot
    damped = NATURAL * np.sqrt(1 - ratio**2)
    decay = np.exp(-ratio * NATURAL * time)
    expected = 1 - decay * (np.cos(damped * time) - ratio * NATURAL / damped * np.sin(damped * time))
    assert found.open_loop == pytest.approx(2e-3 * expected, abs=1e-14)
    assert found.measured == pytest.approx(2e-3 * expected, abs=1e-14)
    assert np.abs(found.winch).max() < 1e-16
    assert np.isnan(found.final)


@pytest.mark.parametrize("name", ["ground", "sagging", "no notch"])
def test_a_gust_on_the_gondola_is_that_of_the_dense_matrix_by_its_exponential(name):
    size, length, step = 3.0, 25 / 6, 0.25  # no point of time is the end of the gust
    case = case_of(*BARS[name], automatic(10))
    A, B = loop_matrix.matrices(bar_loop(case), case.analysis.gain[0])
    force = 1.2 * 1.17 * 0.6 * 6.0 * size / 2  # air density, drag coefficient, area and mean speed
    n = len(A)
    pushed = np.zeros((n + 3, n + 3))  # with 1, cosine and sine of the gust as states
    pushed[:n, :n], pushed[:n, n], pushed[:n, n + 1] = A, force * B, -force * B
    pushed[n + 1, n + 2], pushed[n + 2, n + 1] = -TURN / length, TURN / length
    states, onwards = [np.array([*np.zeros(n), 1.0, 1.0, 0.0])], scipy.linalg.expm(pushed * step)
    while len(states) * step < length:
        states.append(onwards @ states[-1])
    rest = length - (len(states) - 1) * step
    end = scipy.linalg.expm(pushed * rest) @ states[-1]
    states.append(scipy.linalg.expm(A * (step - rest)) @ end[:n])
    onwards = scipy.linalg.expm(A * step)
    while len(states) < 25:
        states.append(onwards @ states[-1])
    expected = np.array([state[loop_matrix.place(A)] for state in states])
    found = in_time(case, "gust", step * np.arange(25), "3 m/s")
    assert found.measured == pytest.approx(expected, abs=2e-6 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["ground", "sagging"])
def test_a_step_of_the_winch_has_the_stated_error_by_all_modes_of_the_dense_matrix(name):
    size, step = 1e-3, 0.05
    case = case_of(*BARS[name], automatic(10))
    gain = case.analysis.gain[0]
    A, _ = loop_matrix.matrices(bar_loop(case), gain)
    states = [np.zeros(len(A))]
    states[0][-1] = -size / gain  # the integrator, which moves the winch by -gain times its value
    onwards = scipy.linalg.expm(A * step)
    while len(states) < 41:
        states.append(onwards @ states[-1])
    expected = np.array([state[loop_matrix.place(A)] for state in states])
    found = in_time(case, "winch", step * np.arange(41), "1 mm")
    error = np.abs(found.measured - expected).max() / np.abs(expected).max()
    assert error < found.errors[0] < 10 * error


@pytest.mark.parametrize("name", ["ground", "gondola"])
def test_the_reference_is_reached_and_a_step_of_the_winch_is_taken_back(name):
    case = case_of(*BARS[name], automatic(30))
    time = np.linspace(0, 3000 / case.analysis.gain[0], 11)
    winches = -1.0 if case.scene.winch.location == "gondola" else 1.0
    for kind, gondola, winch in (("reference", 1.0, winches), ("winch", 0.0, -1.0)):
        found = in_time(case, kind, time, "1 m")
        assert (found.measured[-1], found.winch[-1, 0]) == pytest.approx((gondola, winch), abs=1e-6)
        assert found.final == pytest.approx(gondola, abs=1e-9)


def test_a_reference_with_a_delay_by_the_method_of_steps():
    """x' = K (1 - x(t - T)) behind T: the sum of -(-K)^n (t - n T)^n/n! over n >= 1 with t > n T."""
    delay = 1e4 / NATURAL
    gain, damped = 0.6 / delay, f"cable.damping={{model: kelvin_voigt, time: {1 / NATURAL!r} s}}"
    law = f"winch.controller={{gain: {gain!r} rad/s, notch: none}}", f"winch.delay={delay!r} s"
    time = np.linspace(0, 6 * delay, 2401)
    found = in_time(case_of(*SPRING, damped, *law), "reference", time, "1 m")
    expected = sum(-((-gain * np.maximum(time - n * delay, 0)) ** n) / factorial(n) for n in range(1, 7))
    # a corner in time has no end in frequency
    assert found.measured == pytest.approx(expected, abs=5e-3)
    assert np.abs(found.measured - expected)[np.abs(time / delay % 1 - 0.5) < 0.35].max() < 1e-3
    error = np.abs(found.measured - expected).max() / np.abs(expected).max()
    assert error < found.errors[0] < 10 * error


@pytest.mark.parametrize("delays", [1.6, 1.6001])  # the delay is a point of time, or just before one
def test_the_corner_of_a_winch_behind_a_delay_has_the_stated_error(delays):
    """Until twice the delay a winch behind a lag answers a step of the reference by the law alone."""
    delay, lag, gain, proportional = 0.05, TURN * 3, 0.4, 0.1
    parts = f"{{gain: {gain}, proportional_gain: {proportional}, notch: none}}"
    law = f"winch.controller={parts}", f"winch.delay={delay} s", f"winch.bandwidth={lag / TURN!r} Hz"
    damped = f"cable.damping={{model: kelvin_voigt, time: {1 / NATURAL!r} s}}"
    case = CableCase(scene(*SPRING, damped, *law))
    options = TimeOptions(f"{delays * delay!r} s:2001", "reference", "1 m")
    found, time = time_case(None, case.scene, case.analysis, options).response, options.times
    later = np.maximum(time - delay * (1 + 1e-12), 0)
    risen = -np.expm1(-lag * later)
    expected = proportional * risen + gain * (later - risen / lag)
    error = np.abs(found.winch[:, 0] - expected).max() / expected.max()
    assert 0.1 * found.errors[1] < error < found.errors[1]
    if delays == 1.6:
        assert not found.winch[:1251].any()
        assert found.winch_speed[1250, 0] == pytest.approx(proportional * lag, rel=1e-12)


# ----------------------------------------------------------------------------------------------------- the command


def test_the_table_has_the_margins_of_the_loop():
    (row,) = table_of("loop", CARLINA)
    found = case_of().analysis
    assert row["gain_rad_per_s"] == 0.325
    for name, unit in (("delay_margin", "_s"), ("sensitivity_peak", ""), ("sensitivity_frequency", "_Hz")):
        assert row[name + unit] == pytest.approx(found.margin(name)[0], rel=1e-9)
    assert row["phase_crossover_Hz"] == pytest.approx(found.phase_crossover[0], rel=1e-9)
    assert row["status"] == "ok"


def test_the_response_has_a_row_at_each_resonance():
    rows = table_of("loop", CARLINA, "--response", "0.1 Hz:10 Hz:20")
    frequency = np.array([row["frequency_Hz"] for row in rows])
    value = loop_gain(case_of(), TURN * frequency)
    for name, expected in (
        ("open_loop", value), ("sensitivity", 1 / (1 + value)), ("complementary_sensitivity", value / (1 + value))
    ):  # fmt: skip
        assert [row[f"{name}_dB"] for row in rows] == pytest.approx(20 * np.log10(np.abs(expected)), abs=1e-6)
        turns = ([row[f"{name}_phase_deg"] for row in rows] - np.degrees(np.angle(expected))) / 360
        assert turns == pytest.approx(np.round(turns), abs=1e-8)
    assert np.abs(np.geomspace(0.1, 10, 20)[:, None] - frequency).min(axis=1).max() < 1e-12
    peak = case_of().analysis.margin("sensitivity_peak")[0]
    assert max(row["sensitivity_dB"] for row in rows) > 20 * np.log10(peak) - 0.2


def test_the_phase_of_a_delay_is_known_between_frequencies_that_are_far_apart():
    frequency = np.geomspace(0.1, 300, 12)
    lag, delay = 1j * TURN * frequency, 0.2  # of a first-order lag of 1 s
    phase = unwrapped_phase(frequency, np.exp(-delay * lag) / (1 + lag), delay)
    assert phase == pytest.approx(-np.degrees(np.arctan(TURN * frequency)) - 360 * delay * frequency, abs=1e-9)


def test_the_phase_of_a_long_delay_has_few_marks_at_odd_multiples_of_180_degrees():
    analysis = case_of("winch.delay=150 ms").analysis
    figure = plots.loop_margins(analysis.loop_for_margins, (0.01, 300.0, 1500))
    axes = figure.axes[1]
    marks = [mark for mark in axes.get_yticks() if axes.get_ylim()[0] < mark < axes.get_ylim()[1]]
    lines = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert len(marks) == len({*marks} & {*lines}) <= 5
    assert np.mod(marks, 360) == pytest.approx([180] * len(marks))


def test_a_loop_that_is_not_judged_has_its_table_without_its_picture_and_one_reason(tmp_path):
    sets = with_sets("winch.delay=500 ms", "winch.controller.gain=5 rad/s")
    done = run("loop", CARLINA, *sets, "--plot", tmp_path / "loop.svg", code=3)
    assert done.err.count("is not judged at a gain of 5 rad/s") == 1
    assert "largest gain" in done.out
    assert not list(tmp_path.iterdir())


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
    ("--time", "10s", "--output", "gondola.y"): "--output gondola.y: unknown",
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
def test_mistakes_are_one_line(given, folder):
    refused_in_one_line(folder, MISTAKES[given], "loop", CARLINA, *given)


UNSTABLE, TO_ACCURACY = "winch.controller.gain=80", "model={accuracy: 1e-4}"  # refused before anything is refined
PROPORTIONAL = "winch.bandwidth=20 Hz", "winch.controller.proportional_gain=0.5"


@pytest.mark.parametrize(("sets", "given", "words"), [
    *(([UNSTABLE], given, ["the loop is unstable at 80 rad/s", "stable below"]) for given in ((), ("--time", "10s"))),
    *(([TO_ACCURACY], given, ["modal damping grows with the number of modes"])
      for given in ((), ("--response", "0.1Hz:1Hz:3"), ("--time", "1 s:3"))),
    (PROPORTIONAL, (), ["the loop is unstable at gains of 0.325 rad/s (integral), 0.5 (proportional)"]),
    (["winch.delay=30 s"], (), ["stability with a delay of 30 s is not judged"]),
    (["winch.controller.gain=0"], ("--plot", "none.png"), ["the gain of the loop is zero"]),
])  # fmt: skip
def test_a_loop_without_an_answer_says_why(sets, given, words):
    done = run("loop", CARLINA, *with_sets(*sets), *given, code=3)
    assert all(word in done.err for word in words)
    assert "gain margin" in done.out or sets != [UNSTABLE] or given


def test_the_gains_below_which_a_proportional_loop_is_stable_are_those_of_bars():
    """The smallest of all factors of both gains with which L of dense bars crosses -1, the actuator a lag of 20 Hz."""
    loop = paper_loop()

    def loop_gain(frequency):
        s = 2j * np.pi * frequency
        return (0.325 / s + 0.5) / (1 + s / (2 * np.pi * 20)) * loop_matrix.gain_of_bars(loop, s)

    frequency = np.geomspace(0.05, 500, 20_001)  # beyond the highest mode of these bars
    value = loop_gain(frequency)
    crossings = np.flatnonzero((value.imag[1:] * value.imag[:-1] < 0) & (value.real[1:] < 0))
    places = [brentq(lambda one: loop_gain(np.array([one])).imag[0], *frequency[k : k + 2]) for k in crossings]
    factor = (-1 / loop_gain(np.array(places)).real).min()
    done = run("loop", CARLINA, *with_sets(*PROPORTIONAL), code=3)
    assert f"stable below {factor:.4g} times these gains" in done.err


@pytest.mark.parametrize("sets", [(), ("winch.controller.gain=80",), ("winch.controller.gain={auto: 6 dB}",), PID])
def test_pictures_show_the_margins_within_the_figure(sets):
    figure = plots.loop_margins(case_of(*sets).analysis.loop_for_margins)
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
    limit, _ = case_of(*sets).analysis.largest_gain
    assert f"{limit:.4g} rad/s" in said
    assert ("unstable" in said) == ("80" in str(sets))


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
