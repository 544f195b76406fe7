"""RMS of the gondola: fine integration, closed forms; and the command `windrms`."""

from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg
from cables import along_x
from campaign import campaign
from command import CARLINA, rows_of, run, study_file, table_of, with_sets
from references import loop_matrix
from references.bars_in_wind import von_karman
from scenes import GONDOLA, PAPER, case_of, scene, scene_of
from scipy.optimize import brentq

from cablestudy.errors import NoSolutionError
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.wind_report import BELOW
from cablestudy.study.table_rows import SLACK
from cablestudy.wind import gusts

SPEED, LENGTH_SCALE, AREA, DRAG, AIR, INTENSITY = 6.0, 25.0, 0.6, 1.17, 1.2, 0.15  # configs/carlina.yaml
AUTO = "winch.controller.gain={auto: {gain_margin: 6 dB, sensitivity: 1000}}"


def force(frequency, speed=SPEED):
    """The paper's wind, typed in from DESIGN.md, section 7. [N^2/Hz]"""
    turbulence = von_karman(frequency, speed, INTENSITY * speed, LENGTH_SCALE)
    admittance = 1 / (1 + (frequency * 2 * np.sqrt(AREA) / speed) ** (4 / 3))
    return (AIR * DRAG * AREA * speed) ** 2 * admittance * turbulence


def brute(loop, gain, spectrum, low=1e-6, high=3e3):
    """RMS of place and velocity by Simpson's rule over a grid that is dense in log f, and denser beside each pole."""
    A, B = loop_matrix.matrices(loop, gain)
    poles, left, right = scipy.linalg.eig(A, left=True, right=True)
    weights = right[loop_matrix.place(A)] * (left.conj().T @ B) / np.einsum("ik,ik->k", left.conj(), right)
    edges = [np.linspace(np.log(low), np.log(high), 1500)]
    for pole in poles[(poles.imag > 0) & (np.abs(poles) < 2 * np.pi * high)]:
        centre, width = np.log(np.abs(pole.imag) / (2 * np.pi)), np.abs(pole.real) / np.abs(pole.imag)
        edges.append(centre + width * np.sinh(np.linspace(-np.arcsinh(0.3 / width), np.arcsinh(0.3 / width), 161)))
    edges = np.unique(np.clip(np.concatenate(edges), np.log(low), np.log(high)))
    # three points to each panel
    points = np.empty(2 * len(edges) - 1)
    points[::2], points[1::2] = edges, (edges[1:] + edges[:-1]) / 2
    frequency = np.exp(points)
    transfer = sum(share / (2j * np.pi * frequency - pole) for pole, share in zip(poles, weights, strict=True))
    square = np.abs(transfer) ** 2 * spectrum(frequency) * frequency
    squares = np.array([square, square * (2 * np.pi * frequency) ** 2])
    panels = (squares[:, :-2:2] + 4 * squares[:, 1:-1:2] + squares[:, 2::2]) / 6
    return np.sqrt(panels @ np.diff(edges))


def rms_of(case, *variances):
    """Place and velocity, or other variances, loop closed, then open; what a telescope sees loop closed alone."""
    own = "value", "rate"
    wanted = [(name, False) for name in variances or own]
    wanted += [(name, True) for name in variances or own if name in own]
    return [case.analysis.rms(["gondola.x"], *one)[0] for one in wanted]


def loop_of(case):
    """The loop of a case, with modal damping, and every mode of its cable, for `loop_matrix`."""
    notch, damping = case.analysis.loop_for_margins.body.notches[0], case.gondola_air_damping
    parts = {"mass": case.scene.gondola.mass, "location": case.scene.winch.location, "notch": notch}
    gain = case.scene.winch.controller.gain
    return SimpleNamespace(cable=along_x(case), damping=damping, gain=gain, **parts)


@cache
def paper_loop():
    """The loop of configs/carlina.yaml for `loop_matrix`: 40 bars with a damping ratio of 0.01, without the program."""
    cable = loop_matrix.cable_of_bars(PAPER.chain(), *PAPER.bar, 0.01)
    notch = {"omega": np.sqrt(cable.stiffness[3, 3] / GONDOLA), "damping_ratio": 0.05,
             "rolloff_omega": 2 * np.pi * 10, "rolloff_damping_ratio": 1.0}  # fmt: skip
    parts = {"mass": GONDOLA, "damping": 0.0, "location": "ground", "notch": SimpleNamespace(**notch)}
    return SimpleNamespace(cable=cable, gain=0.325, **parts)


@cache
def paper_largest_gain():
    """Gain at which a pole of `paper_loop` crosses the imaginary axis. [rad/s]"""
    return brentq(lambda gain: np.linalg.eigvals(loop_matrix.matrices(paper_loop(), gain)[0]).real.max(), 0.5, 60)


@cache
def case_with(ratio, share, *sets):
    """The paper's scene with 12 bars, another modal damping, and the gain a share of the largest one."""
    sets = "model.elements=12", f"cable.damping.ratio={ratio!r}", *sets
    gain = share * case_of("winch.controller.gain=1e-3", *sets).analysis.largest_gain[0] if share else 0.0
    return case_of(*sets, f"winch.controller.gain={gain!r}")


@pytest.mark.crossed
@pytest.mark.parametrize("ratio", [1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5])
@pytest.mark.parametrize("gain", [0.0, 0.01, 0.5])
def test_the_rms_is_that_of_a_fine_integration(ratio, gain):
    case = case_with(ratio, gain)
    case.analysis.check_stable()
    loop = loop_of(case)
    assert rms_of(case) == pytest.approx([*brute(loop, loop.gain, force), *brute(loop, 0.0, force)], rel=1e-5)
    assert case.analysis.response.integration_error < 1e-9


@pytest.mark.parametrize("sets", [(), ("cable.diameter=7.4 mm",), ("winch.location=gondola",), ("gondola.mass=5 kg",)])
def test_the_rms_of_a_scene_is_that_of_a_fine_integration_with_every_mode(sets):
    case = case_of(*sets)
    loop = loop_of(case)
    assert rms_of(case) == pytest.approx([*brute(loop, loop.gain, force), *brute(loop, 0.0, force)], rel=1e-5)


WHITE = "wind.admittance=none"
PUSHED = AIR * DRAG * AREA * SPEED  # force per speed of a gust [N s/m]


@pytest.fixture
def white(monkeypatch):
    """Gusts of the same spectrum at all frequencies, of a force of 3 N^2/Hz."""
    monkeypatch.setattr(
        gusts, "speed_spectrum", lambda frequency, *_: 3.0 / (PUSHED * INTENSITY * SPEED) ** 2 + 0 * frequency
    )


AIR_DAMPS = "wind.aerodynamic_damping=true"
# a massless cable, which is a spring of EA/L
LIGHT = ("gravity=0", "cable.density=1e-6", "cable.unstretched_length=184.4883 m", "gondola.mass=50 kg")
SPRING = 70.3e9 * 2.69e-6 / 184.4883


@pytest.mark.usefixtures("white")
@pytest.mark.parametrize(("time", "drag"), [(0.002, None), (0.0, 1.17), (0.0, 10.0), (0.0, 40.0)])
def test_a_gondola_on_a_light_cable_in_white_noise_is_the_textbook_s_oscillator(time, drag):
    """Variances S/(4 c k) and S/(4 c M) of a one-sided spectrum S, which grows with the square of the drag.

    Damped by the strain of the cable, or by the air.
    """
    sets = (*LIGHT, WHITE, f"cable.damping={{model: kelvin_voigt, time: {time}}}", "model={elements: 1, order: 2}",
            "winch.controller.gain=0", *([AIR_DAMPS, f"gondola.drag_coefficient={drag}"] if drag else []))  # fmt: skip
    level, damping = 3.0 * ((drag or DRAG) / DRAG) ** 2, PUSHED * drag / DRAG if drag else time * SPRING
    *closed, displacement, velocity = rms_of(CableCase(scene(*sets)))
    assert displacement == pytest.approx(np.sqrt(level / (4 * damping * SPRING)), rel=1e-6)
    # of the velocity the range of frequencies lacks a little
    assert velocity == pytest.approx(np.sqrt(level / (4 * damping * 50.0)), rel=1e-3)
    assert closed == pytest.approx([displacement, velocity], rel=1e-14)


# what follows from linearity, and what the record of the integration says


@pytest.mark.parametrize(
    ("change", "factor"),
    [
        ("wind.turbulence_intensity=0.3", 2),
        ("wind.turbulence_rms=0.09 m/s", 0.1),
        ("gondola.drag_coefficient=3.51", 3),
        ("wind.air_density=0.3", 0.25),
        ("wind.turbulence_intensity=1e-12", 1e-12 / 0.15),
        ("wind.turbulence_intensity=1e6", 1e6 / 0.15),
    ],
)
def test_the_rms_is_proportional_to_turbulence_drag_and_air(change, factor):
    expected = factor * np.array(rms_of(case_of()))
    assert rms_of(case_of(change)) == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("sets", [(), ("cable.diameter=7.4 mm",), ("wind.speed=20 m/s",), ("gondola.mass=1e4 kg",)])
def test_shares_of_the_variance(sets):
    case = case_of(*sets)
    shares = case.analysis.response.shares_below("gondola.x", BELOW)
    assert all(0 <= below <= above <= 1 for below, above in pairwise(shares))
    loop = loop_of(case)
    spectrum = partial(force, speed=case.scene.wind.speed)
    whole = brute(loop, loop.gain, spectrum)[0]
    for limit, share in zip(BELOW, shares, strict=True):
        assert share == pytest.approx((brute(loop, loop.gain, spectrum, high=limit)[0] / whole) ** 2, abs=1e-5)


@pytest.mark.crossed
@pytest.mark.parametrize("on", ["analysis", "in_cable_wind"])
@pytest.mark.parametrize(
    "damping", ["{loss_factor: 0.02, viscous: 1e-3}", "{model: kelvin_voigt, time: 2 ms, viscous: 1e-3}"]
)
def test_the_estimated_error_is_not_smaller_than_the_true_one(on, damping):
    sets = f"cable.damping={damping}", "winch.controller.gain=0.05"
    rms = [(variance, open_loop) for variance in ("value", "rate") for open_loop in (False, True)]

    def solved(model):
        wind = getattr(CableCase(scene(*sets, f"model={model}")), on)
        return [wind.rms(["gondola.x"], *one) for one in rms]

    truth = solved("{elements: 2, order: 30}")  # six of order 40 differ by 2e-11
    for accuracy in (1e-2, 1e-4, 1e-6):
        for one, (found, error), (true, _) in zip(rms, solved(f"{{accuracy: {accuracy}}}"), truth, strict=True):
            assert abs(found / true - 1) <= error + 1e-9, (accuracy, one)


def damping_ratios(model, elements):
    """Of the gondola, for a damping model of configs/damping.yaml."""
    scenes = [scene(f"cable.damping={model}", f"model.elements={n}") for n in elements]
    return [CableCase(one).gondola_mode.damping_ratio[0] for one in scenes]


def test_modal_damping_of_the_gondola_grows_with_the_bars():
    """With modes along the cable the sum grows like 1 + 1/2 + 1/3 + ..."""
    ratios = damping_ratios("{model: modal, ratio: 0.01}", (10, 20, 40, 80, 160))
    # DESIGN.md, section 6: 0.16, 0.27, 0.37 % at 10, 40, 160 bars
    assert [round(100 * ratio, 2) for ratio in ratios[::2]] == [0.16, 0.27, 0.37]
    growth = np.diff(ratios)
    assert growth == pytest.approx(np.full(4, growth.mean()), rel=0.15)  # like the logarithm
    assert growth[2] / growth[1] == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        ("{model: hysteretic, loss_factor: 0.02}", 0.01),  # half the loss factor
        ("{model: kelvin_voigt, time: 4.4 ms}", np.pi * 0.72 * 4.4e-3),  # half of time x angular frequency
    ],
)
def test_damped_strain_gives_the_gondola_what_a_spring_would_have_whatever_the_bars(model, expected):
    ratios = damping_ratios(model, (20, 40, 80))
    assert ratios == pytest.approx([expected] * 3, rel=0.01)
    assert abs(ratios[2] - ratios[1]) < 1e-4 * ratios[2]
    assert abs(ratios[2] - ratios[1]) < 0.4 * abs(ratios[1] - ratios[0])


@pytest.mark.parametrize("time", ["1 us", "1 ms", "1 s", "100 s"])
def test_kelvin_and_voigt_s_damping_of_the_gondola_is_positive(time):
    case = CableCase(scene(f"cable.damping={{model: kelvin_voigt, time: {time}}}"))
    assert 0 < case.gondola_mode.damping_ratio[0] <= 1
    poles = case.analysis.loop_for_margins.open_poles
    assert (poles.real < 1e-15 * np.abs(poles).max()).all()


def test_so_much_damping_that_a_mode_does_not_strain_is_refused():
    case = CableCase(scene("cable.damping={model: kelvin_voigt, time: 1e6 s}"))
    with pytest.raises(NoSolutionError, match="undamped"):
        rms_of(case)
    assert case.gondola_mode.damping_ratio[0] == 1.0  # which needs no response


# no answer, rather than a wrong one


@pytest.mark.crossed
@pytest.mark.parametrize(
    "damping",
    ["{model: modal, ratio: 0}", "{model: modal, ratio: 1e-9}", "{model: hysteretic, loss_factor: 0}",
     "{model: kelvin_voigt, time: 0}"],
)  # fmt: skip
@pytest.mark.parametrize("gain", ["0.325", "0", "{auto: {gain_margin: 6}}"])
def test_an_undamped_cable_has_no_rms(damping, gain):
    with pytest.raises(NoSolutionError, match=r"(undamped|damping ratio).*cable\.damping"):
        rms_of(CableCase(scene(f"cable.damping={damping}", f"winch.controller.gain={gain}")))


EXTREME = [
    ["winch.controller.gain=1e12"],
    ["gondola.mass=1e-6 kg"],
    ["gondola.mass=1e9 kg"],
    ["gondola.mass=1e9 kg", "cable.damping.ratio=1e-7"],
    ["wind.speed=0.01 m/s"],
    ["wind.speed=1000 m/s"],
    ["wind.speed=1000 m/s", "wind.length_scale=1e-6 m"],
    ["cable.ends=[[0, 0, 0], [0, 0, 185.8]]"],
    ["cable.ends=[[0, 0, 0], [0, 0, 185.8]]", AUTO],
    ["cable.ends=[[0, 0, 0], [0, 185.8, 0]]", AUTO],
    ["winch.controller.notch=none", AUTO],
    ["cable.unstretched_length=1000 m", AUTO],
    ["cable.damping={model: hysteretic, loss_factor: 2}"],
    ["cable.damping={model: hysteretic, loss_factor: 1e-6}", AUTO],
    ["cable.damping={model: kelvin_voigt, time: 1e6 s}"],
    ["cable.damping.ratio=1"],
    ["cable.damping.ratio=2", AUTO],
    ["model={elements: 1}"],
    ["model={elements: 2}", AUTO],
    ["gravity=0", AUTO],
    ["winch.controller.notch.damping_ratio=1e6"],
    ["winch.controller.notch.rolloff_damping_ratio=1e-9"],
    ["winch.controller.notch.rolloff_frequency=1e-6 Hz"],
]


@pytest.mark.parametrize("sets", campaign(EXTREME, EXTREME[::2]), ids=" ".join)
def test_an_extreme_scene_has_an_answer_or_says_why_not(sets):
    outcome = run("windrms", CARLINA, *with_sets(*sets), "--format", "json", code=None)
    row = rows_of(outcome.out, "json")[0]
    if outcome.code == 3:
        assert len([line for line in outcome.lines if not line.startswith("warning: tensions or sag of")]) == 1
        assert row["status"] in outcome.err
        # a loop may damp what nothing else does
        assert None in (row["gondola_rms_mm"], row["gondola_rms_open_loop_mm"])
        assert "unstable" not in row["status"] or " grows by " in row["status"]
    else:
        assert outcome.code == 0
        assert row["status"] in ("ok", SLACK)
        assert (f"warning: {SLACK}" in outcome.err) == (row["status"] == SLACK)
        assert 0 < row["gondola_rms_mm"] < np.inf
        assert 0 < row["gondola_damping_ratio"] <= 1


CLOSED = {"gondola_rms_mm", "gondola_rms_velocity_mm_per_s", "gain_margin_dB", "phase_margin_deg", "bandwidth_Hz",
          "largest_gain_rad_per_s"}  # fmt: skip


def test_the_command_prints_one_row_in_every_format():
    outcome = run("windrms", CARLINA, "--format", "json")
    beginnings = ["note: the cable sheds vortices", "note: the error of the RMS is ", "note: with the loop the RMS is"]
    assert [line[:30] for line in outcome.lines] == beginnings
    (row,) = rows_of(outcome.out, "json")
    assert row["status"] == "ok"
    assert set(row) >= CLOSED
    found = rms_of(case_of())
    assert row["gondola_rms_mm"] == pytest.approx(1e3 * found[0], rel=1e-12)
    assert row["gondola_rms_velocity_open_loop_mm_per_s"] == pytest.approx(1e3 * found[3], rel=1e-12)
    share = case_of().analysis.response.shares_below("gondola.x", [1.0])
    assert row["variance_share_below_1_Hz"] == pytest.approx(share[0], rel=1e-12)
    for style in ("csv", "jsonl"):
        assert rows_of(run("windrms", CARLINA, "--format", style).out, style) == [row]
    assert run("windrms", "-", "--format", "json", stdin=Path(CARLINA).read_text(encoding="utf-8")).out == outcome.out
    text = run("windrms", CARLINA).out
    assert f"{1e3 * brute(paper_loop(), 0.325, force)[0]:.4g}" in text
    assert "0.325" not in text


@pytest.mark.crossed
@pytest.mark.parametrize("on", ["gondola", "both"])
@pytest.mark.parametrize("sets", [(), ("--set", "wind.aerodynamic_damping=true"), ("--set", "winch.controller.gain=0")])
def test_a_loop_that_makes_the_motion_larger_is_told(sets, on):
    outcome = run("windrms", CARLINA, *sets, "--on", on, "--format", "json")
    (row,) = rows_of(outcome.out, "json")
    part = "_all_wind" if on == "both" else ""
    closed, at_rest = (row[f"gondola_rms{state}{part}_mm"] for state in ("", "_open_loop"))
    assert (closed > at_rest) == (sets == ())  # 18.8 and 17.6 mm in the paper, whose air damps nothing
    line = "note: with the loop the RMS is larger than with the winch at rest: gondola "
    line += f"{closed:.3g} mm, not {at_rest:.3g} mm"
    assert (line in outcome.lines) == (closed > at_rest)
    assert ("with the loop" in outcome.err) == (closed > at_rest)


def test_the_utilisation_is_that_of_the_cable_at_rest():
    (row,), (at_rest,) = table_of("windrms", CARLINA), table_of("static", CARLINA)
    breaking_force = 3000e6 * 2.69e-6
    assert row["utilisation"] == pytest.approx(at_rest["max_tension_N"] / breaking_force, rel=1e-12)
    assert "utilisation" not in table_of("windrms", CARLINA, "--set", "cable.strength=null")[0]
    bare = table_of("windrms", CARLINA, "--set", "gondola=null", "--set", "winch=null")[0]
    assert bare["utilisation"] == row["utilisation"]


def test_set_and_explain():
    row = table_of("windrms", CARLINA, "--set", "winch.location=gondola", "--set", AUTO)[0]
    assert row["gain_margin_dB"] == pytest.approx(6, abs=1e-9)
    assert row["largest_gain_rad_per_s"] == pytest.approx(case_of("winch.location=gondola").analysis.largest_gain[0])
    assert "40 elements of order 1" in run("windrms", CARLINA, "--explain").err
    assert run("windrms", CARLINA, "--explain", "--quiet").err == ""


def test_an_unstable_loop_is_refused_with_the_pole_and_the_largest_gain():
    outcome = run("windrms", CARLINA, "--set", "winch.controller.gain=60", "--format", "json", code=3)
    (line,) = outcome.lines
    assert line.startswith(f"{CARLINA}: the loop is unstable at 60 rad/s: mode ")
    assert line.endswith(f"; stable below {paper_largest_gain():.4g} rad/s")
    (row,) = rows_of(outcome.out, "json")
    assert row["gondola_rms_mm"] is None
    assert row["status"].startswith("the loop is unstable")


@pytest.mark.parametrize("winch", ["null", "{location: ground}"])
def test_a_scene_without_a_winch_shows_the_open_loop_only(winch):
    row = table_of("windrms", CARLINA, "--set", f"winch={winch}")[0]
    assert not CLOSED & set(row)
    assert row["gondola_rms_open_loop_mm"] == pytest.approx(1e3 * rms_of(case_of())[2], rel=1e-9)
    assert row["status"] == "ok"


def test_a_sweep_keeps_the_rows_beside_an_unstable_one(tmp_path):
    vary = "vary: [{winch.controller.gain: [0.325, 100, 1]}]\n"
    study = study_file(tmp_path, vary + "columns: [gondola_rms, gondola_rms_open_loop]\n")
    rows = table_of("sweep", study, "--no-write", code=3)
    assert [row["gondola_rms_mm"] is None for row in rows] == [False, True, False]
    assert rows[1]["gondola_rms_open_loop_mm"] == pytest.approx(rows[0]["gondola_rms_open_loop_mm"], rel=1e-7)
    assert rows[1]["status"].startswith("the loop is unstable at 100 rad/s")
    assert [rows[k]["status"] for k in (0, 2)] == ["ok", "ok"]
    # columns of the open loop need no stable one
    rows = table_of(
        "sweep", study_file(tmp_path, vary + "columns: [gondola_rms_open_loop, largest_gain]\n"), "--no-write"
    )
    assert rows[0]["gondola_rms_open_loop_mm"] == pytest.approx(rows[1]["gondola_rms_open_loop_mm"], rel=1e-7)
    assert rows[1]["largest_gain_rad_per_s"] == pytest.approx(paper_largest_gain(), rel=1e-6)


@pytest.mark.parametrize(("change", "words"), [
    ("cable.damping.ratio=0", "undamped"),
    ("model.accuracy=1e-4", "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed"),
])  # fmt: skip
def test_nothing_but_the_message_reaches_standard_error(change, words):
    (line,) = run("windrms", CARLINA, "--set", change, "--format", "json", code=3).lines
    assert words in line


def test_the_rms_by_modal_damping_has_no_known_error():
    told = "note: the error of the RMS is not known: modal damping grows with the number of modes, here those of 40"
    assert any(line.startswith(told) for line in run("windrms", CARLINA).lines)
    strain = "cable.damping={model: kelvin_voigt, time: 1 ms, viscous: 0.01}"
    assert not any("modal damping" in line for line in run("windrms", CARLINA, "--set", strain).lines)


@pytest.mark.usefixtures("folder")
def test_a_cable_that_hangs_folded_says_so_once():
    """A vertical cable longer than its chord: neither columns of its motion nor its frequency have a value."""
    scene_of(
        "cable: {ends: [[0, 0, 0], [0, 0, -50]], unstretched_length: 80, axial_stiffness: 1 MN, mass_per_length: 0.5,\n"
        "  diameter: 8 mm}\n"
        "wind: {speed: 10 m/s, turbulence_intensity: 0.15, length_scale: 50 m}\n"
    )
    done = run("windrms", "s.yaml", code=3)
    assert done.err.count("hangs folded") == done.out.count("hangs folded") == 1


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("damping", ["viscous: 0.01", "loss_factor: 0.01"])
def test_what_grows_by_drag_that_turns_names_it(damping):
    """A vane whose side faces the wind from behind its pivot: drag turns it by more than its cables hold.

    Its pole is real, and of a complex stiffness by rounding on either side of the real axis.
    """
    scene_of(
        "bodies: {vane: {at: [0, 0, 0], mass: 20, inertia: [2, 2, 2], free: [x, y, z, yaw],\n"
        "  attachments: {a: [0.2, 0, 0], b: [-0.2, 0, 0]},\n"
        "  wind: {area: [0.01, 1, 0.01], drag_coefficient: 1.2, center_of_pressure: [-1, 0, 0]}}}\n"
        "cables: {n1: {from: [0.2, 0, 10], to: vane.a}, n2: {from: [-0.2, 0, 10], to: vane.b}}\n"
        f"cable: {{unstretched_length: 10, axial_stiffness: 1e5, mass_per_length: 0.01, damping: {{{damping}}}}}\n"
        "wind: {speed: 8 m/s, turbulence_intensity: 0.1, length_scale: 50 m, on: bodies}\n"
    )
    (line,) = run("windrms", "s.yaml", code=3).lines
    assert "unstable without winches (drag that turns with what moves): mode 1 (vane yaw, " in line
    assert line.endswith("/s without oscillating")
    assert "unstable" not in run("windrms", "s.yaml", "--set", "wind.aerodynamic_damping=false", code=None).err
