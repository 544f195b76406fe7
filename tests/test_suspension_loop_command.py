"""The command `loop` of a suspension: response in time against scipy and neighbouring equilibria; its tables."""

import json
import re
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import scipy.signal
from campaign import campaign
from command import CONFIGS, rows_of, run, table_of, with_sets
from picture import faults
from references.bar_loop import AXES, BarLoop
from scipy.optimize import brentq
from test_suspension_loop_bars import scene_of

from cablestudy import plots
from cablestudy.cable.dynamics import Dynamics
from cablestudy.control import time_response
from cablestudy.errors import ConvergenceError
from cablestudy.interface import Suspension
from cablestudy.motion.response_in_time import in_time as response_in_time
from cablestudy.motion.response_in_time import uniform_gust
from cablestudy.pages import page as pages
from cablestudy.scene.scene import load_scene
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.loop_in_time import TimeOptions, time_case
from cablestudy.study.ssm import StateSpaceOptions
from cablestudy.study.suspension import ssm
from cablestudy.study.suspension.case import SuspensionCase

NET = str(CONFIGS / "suspensions" / "carlina-net-wind.yaml")


@cache
def solved(*sets):
    document, scene = load_scene(NET, sets)
    return document, SuspensionCase(scene)


def test_several_winches_without_gain_have_a_largest_gain_and_no_crossover():
    (row,) = table_of("loop", NET, "--set", "control.gain=0", "--table", "loop")
    (other,) = table_of("loop", NET, "--set", "control.gain=0.01", "--table", "loop")
    assert row["largest_gain_rad_per_s"] == pytest.approx(other["largest_gain_rad_per_s"], rel=1e-4)
    assert (row["sensitivity_peak"], row["disk_margin"]) == (1, 2)  # S is I
    assert row["phase_margin_deg"] is row["gain_crossover_Hz"] is None


def in_time(document, case, options):
    return time_case(document, case.scene, case.analysis, options)


def test_a_step_of_a_reference_is_that_of_scipy():
    document, case = solved()
    found = in_time(document, case, TimeOptions("10s:21", "reference.y", "2 mm")).response.measured
    system = ssm.choose(document, case.scene, StateSpaceOptions(attached="loop")).system()
    output, input_ = system.output_names.index("gondola.y"), system.input_names.index("reference.y")
    siso = system.a, system.b[:, [input_]], system.c[[output]], system.d[[output], [input_]][None]
    _, expected = scipy.signal.step(siso, T=np.linspace(0, 10, len(found)))
    # of other numbers of modes: in the first tenth of a second waves along the cables
    assert found == pytest.approx(2e-3 * expected, abs=2e-3 * 2e-3)


def step_by_frequency(closed_loop, reference, output, time, highest):
    """A measured coordinate and all winches after a step of a reference, from the loop gain with all modes of cables.

    The inverse Laplace transform as a Fourier series to the `highest` frequency [Hz], with Lanczos' factors.
    """
    period = 2 * time[-1]
    shift, harmonics = np.log(1e7) / period, np.arange(int(highest * period))
    s = shift + 2j * np.pi * harmonics / period
    loop_gain = closed_loop.loop.gain * closed_loop.stability.gains.loop_gain(s)
    loop = closed_loop.loop
    left = np.linalg.inv(np.eye(loop_gain.shape[1]) + loop_gain)[:, :, reference]  # of the step, which the law takes
    winches = (loop.gain * loop.controller(s) * left) @ loop.allocation.matrix.T
    closed = np.concatenate([(loop_gain @ left[..., None])[:, [output], 0], winches], axis=1)
    terms = closed * (np.sinc(harmonics / len(harmonics)) * np.where(harmonics, 2.0, 1.0) / s)[:, None]
    return (np.exp(np.outer(time, s)) @ terms).real / period


@pytest.mark.parametrize("seed", campaign([25, 34, 38], [25, 38]))
def test_the_error_of_a_step_response_with_a_controller_of_three_parts_is_true(seed):
    """Against all modes of the cables and the delay itself: a smaller space alone showed half of it."""
    data = scene_of(seed)
    corner, line = data["control"]["gain"] * 1e5 / (2 * np.pi), data["cable"]["density"] * data["cable"]["area"]
    data["cable"]["damping"] = {"model": "modal", "ratio": 0.0, "viscous": 0.5 * line * corner}
    parts = {"gain": 0.02 * corner, "proportional_gain": 0.01, "derivative_gain": 0.01 / corner}
    drive = {"derivative_filter": corner, "bandwidth": corner, "delay": 0.2 / corner, "notch": "none"}
    data["control"] |= parts | drive
    analysis = SuspensionCase(SuspensionScene.model_validate(data)).analysis
    closed_loop = analysis.closed_loop
    measured, time = closed_loop.body.measured, np.linspace(0, 2 / corner, 201)
    driving = closed_loop.body.measured_outputs[0], f"reference.{measured[-1]}", time_response.step(1.0), time
    found = response_in_time(closed_loop, analysis.airflow, *driving)
    expected = step_by_frequency(closed_loop, len(measured) - 1, 0, time[1:], 3000 * corner)
    pairs = (found.measured[1:], expected[:, 0]), (found.winch[1:], expected[:, 1:])
    error, of_winches = (np.abs(own - true).max() / np.abs(own).max() for own, true in pairs)
    assert 1e-4 < error < found.errors[0] < 5 * error
    assert of_winches < found.errors[1] < max(20 * of_winches, 1e-4)


def test_a_step_of_a_winch_is_taken_back_as_far_as_the_pose_is_measured():
    document, case = solved("control.gain=0.5")
    for name in ("gondola.x", "gondola.z"):
        found = in_time(document, case, TimeOptions("200s:11", "winch.u1", output=name)).response
        assert abs(found.measured[-1]) < 1e-3 * np.abs(found.measured).max()
        assert abs(found.open_loop[-1]) > 0.1 * np.abs(found.open_loop).max()
        assert abs(found.final) < 1e-9 * np.abs(found.measured).max()


def test_a_reference_is_reached_in_the_end_and_the_settling_time_is_that_of_the_table():
    document, case = solved("control.gain=0.5")
    found = in_time(document, case, TimeOptions("60s:4001", "reference.y"))
    assert found.response.final == pytest.approx(1e-3, rel=1e-9)
    outside = np.abs(found.response.measured - 1e-3) > 0.02e-3
    assert found.step.settling_time == pytest.approx(found.time[outside].max(), abs=found.time[1])
    assert "overshoot" in found.notes[2]


def test_a_small_rise_of_the_wind_moves_the_suspension_to_its_equilibrium_in_that_wind():
    """The static response to a uniform gust against two equilibria in winds that differ by 1 %."""
    speed = 6.0
    cases = [solved(f"wind.speed={part * speed}")[1] for part in (0.995, 1.005)]
    places = np.array([[case.mean_displacement("gondola", axis)[0] for axis in range(3)] for case in cases])
    analysis = solved()[1].analysis
    closed_loop = analysis.closed_loop
    stiffness = closed_loop.motion.dynamic_stiffness(np.zeros(1))[0].real
    moved = np.linalg.solve(stiffness, uniform_gust(analysis.in_wind(closed_loop).gusts))
    rows = [closed_loop.outputs[f"gondola.{axis}"] for axis in "xyz"]
    found = 0.01 * speed * closed_loop.motion.c[0][rows] @ moved
    expected = places[1] - places[0]
    assert found == pytest.approx(expected, abs=5e-3 * np.abs(expected).max())


def test_singular_values_are_those_of_the_loop():
    rows = table_of("loop", NET, "--response", "0.05Hz:2Hz:4")
    closed_loop = solved()[1].analysis.closed_loop
    frequency = np.array([row["frequency_Hz"] for row in rows])
    gain = closed_loop.loop.gain * closed_loop.stability.gains.loop_gain(2j * np.pi * frequency)
    expected = 1 / np.linalg.svd(np.eye(gain.shape[-1]) + gain, compute_uv=False)
    for name, value in (("largest", expected[:, -1]), ("smallest", expected[:, 0])):
        assert [row[f"sensitivity_{name}_dB"] for row in rows] == pytest.approx(20 * np.log10(value), abs=1e-6)
    assert len(rows) > 4  # resonances have rows of their own


def test_the_tables_are_those_of_windrms():
    loop, wind = (json.loads(run(command, NET, "--format", "json").out) for command in ("loop", "windrms"))
    for name in ("loop", "coordinates"):
        assert loop[name]["rows"] == wind[name]["rows"]


def test_every_winch_is_in_the_file_and_the_busiest_on_the_screen():
    done = run("loop", NET, "--time", "2s:3", "--input", "gust", "--format", "csv")
    winches = [name for name in rows_of(done.out, "csv")[0] if name.endswith("speed_mm_per_s")]
    assert len(winches) == 6
    shown = run("loop", NET, "--time", "2s:3", "--input", "gust").out
    assert shown.count("winch.") == 1


def test_the_picture_has_a_line_for_each_winch():
    document, case = solved()
    figure = plots.loop_in_time(in_time(document, case, TimeOptions("5s:11", "gust")))
    lines = figure.axes[-1].lines
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 6
    widths = [line.get_linewidth() for line in lines]  # a later line is within one that it covers
    assert all(before > after for before, after in pairwise(widths))
    assert faults(figure) == []
    # below the axes, where it covers no line, however many winches there are
    assert [len(legend.get_texts()) for legend in figure.legends] == [6]
    assert figure.axes[-1].get_legend() is None


MISTAKES = {
    ("--time", "1s", "--input", "winch"): "--input winch: unknown",
    ("--time", "1s", "--output", "gondola.yaw"): "--output gondola.yaw: unknown",
    ("--time", "1s", "--input", "reference.roll", "--size", "1 mm"): "--size 1 mm",
    ("--time", "1s", "--table", "loop"): "--table: no effect",
    ("--set", "control=null"): "missing key",
    ("--format", "csv"): "--format csv: one table at a time: give --table loop, coordinates",
    ("--columns", "gain"): "--columns: one table at a time: give --table loop, coordinates",
    ("--time", "1s", "--size", "1 m/s"): "--size 1 m/s",
    ("--time", "1s", "--input", "gust", "--size", "1 mm"): "--size 1 mm",
    ("--time", "1s", "--input", "gust", "--length", "1e9 s"): "--length",
    ("--table", "motion"): "Invalid value for '--table'",
    ("--set", "control.bandwidth=5 Hz", "--set", "control.proportional_gain=0.1", "--set", "control.gain={auto: 6 dB}"):
        "control.gain: auto chooses an integral gain",
    ("--set", "control.delay=5 mm"): "control.delay",
    ("--set", "control.max_speed=0"): "control.max_speed",
    ("--set", "control.dealy=5 ms"): "did you mean delay?",
    ("--set", "winches.u1.delay=5 ms"):
        "winches.u1.delay: unknown key in a suspension: that of all winches is under control",
    ("--set", "winches.u1.controller={gain: 1}"): "that of all winches is under control",
}  # fmt: skip


@pytest.mark.parametrize("given", MISTAKES)
def test_mistakes_are_one_line(given):
    done = run("loop", NET, *given, code=2)
    assert done.out == ""
    assert len(done.lines) == 1
    assert MISTAKES[given] in done.err


MOVED_BY_NO_WINCH = ("--time", "1s", "--output", "gondola.yaw")  # which the equilibrium decides
EARLY = [given for given in MISTAKES if given[0] in ("--time", "--format", "--columns") and given != MOVED_BY_NO_WINCH]


@pytest.mark.parametrize("given", EARLY)
def test_mistakes_in_options_are_told_before_anything_is_computed(given, monkeypatch):
    monkeypatch.setattr(Suspension, "case", property(lambda _: pytest.fail("computed")))
    monkeypatch.setattr(Suspension, "estimated", Suspension.case)
    assert MISTAKES[given] in run("loop", NET, *given, code=2).err


def test_an_unstable_loop_is_no_answer():
    """But by how much its gain is too large, and its response over frequency."""
    done = run("loop", NET, "--set", "control.gain=12", code=3)
    limit = re.search(r"the loop is unstable at 12 rad/s.*; stable below (\S+) rad/s", done.err)[1]
    margin = float(re.search(r"gain margin +\| +(-\d\.\d{3}) \| dB", done.out)[1])
    assert margin == pytest.approx(20 * np.log10(float(limit) / 12), abs=1e-3)  # of four digits each
    assert "phase margin" not in done.out
    over = run("loop", NET, "--set", "control.gain=12", "--response", "0.1Hz:1Hz:3", code=3)
    assert over.err == done.err
    assert len(over.out.splitlines()) > 5
    done = run("loop", NET, "--set", "control.gain=12", "--time", "1 s", code=3)
    assert done.out == ""


def test_the_negative_gain_margin_of_an_unstable_loop_is_that_of_dense_bars():
    """Six bars a cable and no wind: the gain at which the first pole of one matrix crosses."""
    sets = "wind=null", "cable.damping.viscous=0.01", "model.elements=6", "control.gain=12"
    notch = {"frequency": "coupled", "damping_ratio": 0.05, "rolloff_frequency": 10.0, "rolloff_damping_ratio": 1.0}
    net = {
        "gravity": 9.81, "cable": {"damping": {"loss_factor": 0.02, "viscous": 0.01}},
        "bodies": {"b": {"free": list(AXES)}}, "winches": {key: {} for key in ("u1", "u2", "u3", "d1", "d2", "d3")},
        "control": {"measured": AXES[:5], "notch": notch},
    }  # fmt: skip
    case = solved(*sets)[1]
    bars = BarLoop(net, case.equilibrium, 6)
    limit = brentq(bars.growth, 1.0, 12.0)
    assert max(bars.growth(share * limit) for share in (0.01, 0.1, 0.5, 0.99)) < 0
    assert case.analysis.largest_gain[0] == pytest.approx(limit, rel=1e-9)
    done = run("loop", NET, *with_sets(*sets), code=3)
    assert re.search(rf"gain margin +\| +{20 * np.log10(limit / 12):.4g} \| dB", done.out)
    assert f"; stable below {limit:.4g} rad/s" in done.err


def test_the_page_of_an_unstable_loop_says_why_and_shows_the_rest(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "inline_picture", lambda figure, *_: f"<p>{len(figure.axes)} axes</p>")
    page = tmp_path / "net.html"
    done = run("report", NET, "--set", "control.gain=12", "--out", page, code=3)
    assert "the loop is unstable at 12 rad/s" in done.err
    text = page.read_text(encoding="utf-8")
    assert "gain margin" in text
    assert re.search(r"<p>[1-9] axes</p>.*Loop gain, sensitivity and margins", text, re.DOTALL)  # the picture


def test_a_loop_that_needs_too_large_a_model_says_what_for(monkeypatch):
    """A cable of 1 km in the bridle of a balloon took 12 s to say `1600 modes of a model with 4798 unknowns` alone."""

    def refused(self, count):
        raise ConvergenceError(f"{count} modes of a model")

    closed_loop = SuspensionCase(load_scene(NET, ["control.gain=8"])[1]).analysis.closed_loop_of(64)
    closed_loop.check_open()
    lowest = closed_loop.modes.omega[0]
    trial_gain = lowest * 2 ** np.ceil(np.log2(8 / lowest))
    monkeypatch.setattr(Dynamics, "modes", refused)
    message = rf"a gain of {trial_gain:.4g} rad/s, which needs modes of a cable up to .* Hz: \d"
    with pytest.raises(ConvergenceError, match=message):
        _ = closed_loop.stability.gains


def test_an_error_of_the_largest_gain_above_the_accuracy_is_noted_and_no_other():
    """The error of the drag that varies along the cables, which no model takes away, counts too."""
    done = run("loop", NET, "--set", "model.accuracy=1e-7", "--table", "loop", "--format", "json")
    (errors,) = json.loads(done.out)["errors"]
    assert errors["largest_gain_rad_per_s"] > 1e-7
    assert (
        f"model.accuracy, 1e-07: largest_gain_rad_per_s (up to {errors['largest_gain_rad_per_s']:.1e}, 1 row)"
        in done.err
    )
    assert run("loop", NET, "--set", "model.accuracy=1e-3").err == ""
