"""PID, delay and lag of the winches of a suspension: dense determinants, time by small steps."""

import json
import re
from functools import cache

import numpy as np
import pytest
import scipy.linalg
from campaign import campaign
from command import rows_of, run, with_sets
from references.modal_loop import gains_of_modes
from references.straight_suspension import Straight
from solved import solve
from straight_scenes import LOOP, WIND, closed_loop_of, everything, one_axis, platform, two_bodies
from suspension_cases import SUSPENSIONS, case_at, case_of, value
from test_suspension_wind import FREQUENCY, integral, von_karman

from cablestudy.control.statespace import state_space_of
from cablestudy.errors import NoSolutionError
from cablestudy.motion.response_in_time import labelled, measured_by
from cablestudy.study.loop_in_time import TimeOptions, time_case

TURN = 2 * np.pi
NET = SUSPENSIONS / "carlina-net-wind.yaml"
SPEEDS = "winch_rms_speed", "winch_peak_speed"


# -------------------------------------------------------------------------------- against det(I + L) of dense models


def laws_of(seed):
    """Random gains, delay and lag."""
    draw = np.random.default_rng(seed)
    found = {"gain": float(10 ** draw.uniform(-1.5, 0)), "delay": float(10 ** draw.uniform(-2.5, -0.2))}
    if seed % 2:
        found |= {"proportional_gain": float(10 ** draw.uniform(-2.5, -0.5)), "bandwidth": float(draw.uniform(1, 20))}
        found |= {
            "derivative_gain": float(10 ** draw.uniform(-3, -1.5)),
            "derivative_filter": float(draw.uniform(1, 9)),
        }
    return found


SIX = {f"f{i}": {"end": "to"} if i == 2 else {} for i in range(6)}
SCENES = {
    "three coordinates, actuators": lambda law: everything(control=LOOP | law),
    "three coordinates, no notch": lambda law: everything(control=LOOP | law | {"notch": "none"}, actuators={}),
    "pose of six": lambda law: two_bodies(winches=SIX, control=law | {"body": "first", "notch": LOOP["notch"]}),
}


@cache
def solved(scene, seed):
    """Dense model and `ClosedLoop`."""
    text = SCENES[scene](laws_of(seed))
    return Straight(text), closed_loop_of(text)


def encirclements(own, gain):
    """Growing motions with a gain, or with one of each coordinate.

    The turns of det(I + L) from below to above the real axis, past the pole at 0 on its right.
    """
    small, k = 1e-5, len(own.measured)
    path = np.concatenate([small * np.exp(1j * np.linspace(0, np.pi / 2, 200)), 1j * np.geomspace(small, 1e4, 4000)])

    def determinants(s):
        return np.linalg.det(np.eye(k) + own.unit_gain(s) * gain)

    found = determinants(path)
    for _ in range(20):
        coarse = np.abs(np.angle(found[1:] / found[:-1])) > 0.3
        if not coarse.any():
            break
        places = np.flatnonzero(coarse)
        between = np.sqrt(path[places] * path[places + 1])
        path, found = np.insert(path, places + 1, between), np.insert(found, places + 1, determinants(between))
    assert not coarse.any()
    turned = np.angle(found[1:] / found[:-1]).sum() / np.pi
    assert abs(turned - round(turned)) < 0.02
    return round(-turned)


@pytest.mark.crossed
@pytest.mark.parametrize("seed", campaign(range(6), (0, 3)))
@pytest.mark.parametrize("scene", SCENES)
def test_growing_poles_are_the_encirclements_of_the_exact_loop_gain(scene, seed):
    own, closed_loop = solved(scene, seed)
    limit, judged = closed_loop.stability.largest_gain, 0
    for factor in (0.2, 0.999, 1.001, 2.0, 6.0):
        try:
            found = closed_loop.stability.gains.unstable(factor * limit)
        except NoSolutionError:  # refused, and not judged wrongly
            assert factor > 1.5
            continue
        judged += 1
        count = encirclements(own, factor * limit)
        assert found == count, factor
        assert (count > 0) == (factor > 1), factor
    assert judged >= 3


def test_the_limit_of_one_coordinate_alone_is_where_the_exact_loop_gain_encircles():
    own, closed_loop = solved("three coordinates, no notch", 3)
    gain = 0.3 * closed_loop.stability.largest_gain
    limits, whole = closed_loop.stability.gains.single_limits(gain), gain * np.ones(3)
    found = np.array([limit.factor for limit in limits])

    assert (found > 1.5).all()
    for place, factor in enumerate(found):
        for part, grows in ((0.999, False), (1.001, True)):
            gains = np.where(np.arange(3) == place, part * factor, 1.0) * whole
            assert (encirclements(own, gains) > 0) == grows


def test_a_coordinate_without_which_the_loop_is_unstable_has_no_margin_and_a_note():
    """Stable with all coordinates; two motions grow with a thousandth of the gain of yaw, none with that of others."""
    notch, names = LOOP["notch"] | {"frequency": 0.7}, ("roll", "y", "yaw", "z")
    control = {"measured": names, "gain": 0.164, "notch": notch, "allocation": {"weights": {"c2": 0.3}}}
    text = platform(time=1.2e-3, winches={f"c{number}": {} for number in (1, 2, 6, 7)}, control=control)
    own, whole = Straight(text), 0.164 * np.ones(4)
    assert encirclements(own, whole) == 0
    for place, name in enumerate(names):
        few = np.where(np.arange(4) == place, 1e-3, 1.0) * whole
        assert encirclements(own, few) == (2 if name == "yaw" else 0)
    done = run("loop", "-", "--table", "coordinates", "--format", "json", stdin=json.dumps(text))
    margins = [row["gain_margin_dB"] for row in json.loads(done.out)["rows"]]
    assert [margin is None for margin in margins] == [name == "yaw" for name in names]
    notes = [line for line in done.lines if "no gain margin" in line]
    assert notes == ["note: no gain margin of gondola.yaw alone: the loop is unstable without this coordinate"]


# ---------------------------------------------------------------------------------------------- in time, by small steps


def in_time(own, law, time, steps, push=0.0, reference=0.0):
    """What is measured of a dense model, shape (t, k), after a push and a step of references.

    The delayed movement is linear within a step; all else is exact (`scipy.linalg.expm`).
    """
    M, C, K, B, rate = own.matrices
    n, k = len(M), len(own.measured)
    integral, proportional = law["gain"], law.get("proportional_gain", 0.0)
    # states: z, z', integral of what was measured a delay ago, what the drive follows; input: what was measured
    size = 2 * n + 2 * k
    A, given = np.zeros((size, size)), np.zeros((size, k))
    z, speed, summed, driven = np.split(np.eye(size), [n, 2 * n, 2 * n + k])
    A[:n], given[2 * n : 2 * n + k] = speed, np.eye(k)
    force, pushed = -K @ z - C @ speed, np.zeros((n, k))
    if "bandwidth" in law:
        lag = TURN * law["bandwidth"]
        A[2 * n + k :], given[2 * n + k :] = lag * (integral * summed - driven), lag * proportional * np.eye(k)
        moved, moving, moving_given = driven, A[2 * n + k :], given[2 * n + k :]
    else:
        moved, moving, moving_given = integral * summed, np.zeros((k, size)), integral * np.eye(k)
    force -= B @ own.shares @ moved + rate @ own.shares @ moving
    pushed -= rate @ own.shares @ moving_given
    A[n : 2 * n], given[n : 2 * n] = np.linalg.solve(M, force), np.linalg.solve(M, pushed)
    width = law["delay"] / steps
    whole = np.zeros((size + 2 * k, size + 2 * k))
    whole[:size, :size], whole[:size, size : size + k], whole[size : size + k, size + k :] = A, given, np.eye(k) / width
    advance = scipy.linalg.expm(whole * width)[:size]
    state, count = np.zeros(size), int(time / width)
    state[n : 2 * n] = np.linalg.solve(M, own.measured.T @ (push * np.ones(k)))
    seen = np.zeros((count + steps + 1, k))  # from a delay before the start
    for place in range(count):
        seen[place + steps] = own.measured @ state[:n] - reference
        before, after = seen[place], seen[place + 1]
        state = advance @ np.concatenate([state, before, after - before])
    return seen[steps:-1] + reference


@pytest.mark.parametrize("law", [{"gain": 1.0, "delay": 0.3}, {"gain": 1.0, "delay": 0.05},
                                 {"gain": 1.0, "proportional_gain": 0.1, "bandwidth": 3.0, "delay": 0.1}])  # fmt: skip
def test_a_loop_in_time_grows_above_the_largest_gain_and_decays_below(law):
    text = everything(control=LOOP | law | {"notch": "none"}, actuators={})
    own, limit = Straight(text), closed_loop_of(text).stability.largest_gain
    for factor in (0.97, 1.03):
        scaled = law | {key: factor * limit * law[key] for key in ("gain", "proportional_gain") if key in law}
        size = np.abs(in_time(own, scaled, 150.0, round(law["delay"] / 7.5e-3), push=1.0)).max(axis=1)
        quarter = len(size) // 4
        early, late = size[quarter : 2 * quarter].max(), size[3 * quarter :].max()
        assert (late > 1.2 * early) == (factor > 1)
        assert (late < 0.8 * early) == (factor < 1)


# ------------------------------------------------------------------------------- in the wind, and as a state space

DELAYED = {"gain": 0.2, "proportional_gain": 0.02, "derivative_gain": 0.001, "derivative_filter": 4.0,
           "bandwidth": 6.0, "delay": 0.15}  # fmt: skip


CALM_BODY = WIND | {"aerodynamic_damping": False, "admittance": "none"}


def rms_of_one_axis(dynamic, omega):
    """RMS of a body of `one_axis` in `CALM_BODY`, by its dynamic stiffness, a function of s. [mm]

    The frequencies are dense near one resonance [rad/s].
    """
    near = omega / TURN * (1 + np.sinh(np.linspace(-13, 13, 60_001)) * 1e-6)
    frequency = np.unique(np.concatenate([np.geomspace(1e-6, 1e4, 40_000), near[near > 0]]))
    force = 1.2 * 1.2 * 0.5 * WIND["speed"] / dynamic(2j * np.pi * frequency)
    driving = von_karman(frequency, WIND["speed"], 0.15 * WIND["speed"], WIND["length_scale"])
    return 1e3 * np.sqrt(np.trapezoid(np.abs(force) ** 2 * driving, frequency))


def closed_stiffness(own, s):
    """D + (B + s B') v/z, shape (f, n, n), and v/z, shape (f, i, n), of a dense model, with exp(-s T)."""
    *_, B, rate = own.matrices
    wide = s[:, None, None]
    reeled = -own.text["control"]["gain"] * own.notch(wide) * own.law(wide) * (own.shares @ own.measured)
    return own.dynamic_stiffness(s) - (B + wide * rate) @ reeled, reeled


def resonance_behind_a_delay(phase, ratio, gain, **others):
    """A body of one coordinate, whose loop is PI behind a lag and a delay: scene, dynamic stiffness, frequency [rad/s].

    `phase` is the turn by the delay at this frequency, of the body with its winches at rest; `gain` is over it.
    """
    mass, spring, proportional = 20.0, 2e5 / 9.9, 0.01
    omega = np.sqrt(spring / mass)
    delay, corner, gain = phase / omega, 1e3 * omega, gain * omega
    text = one_axis(
        mass=mass, time=2 * ratio / omega, winches={"west": {}, "east": {}}, wind=CALM_BODY,
        control={"gain": gain, "proportional_gain": proportional, "bandwidth": corner / TURN, "notch": "none",
                 "delay": delay},
        bodies__gondola__wind={"area": 0.5, "drag_coefficient": 1.2}, **others,
    )  # fmt: skip

    def dynamic(s):
        law = (proportional + gain / s) / (1 + s / corner) * np.exp(-delay * s)
        return mass * s**2 + spring * (1 + 2 * ratio * s / omega) * (1 + law)

    return text, dynamic, omega


@pytest.mark.parametrize("phase", campaign([1.3e-3, 1e-3, 1e-5, 1e-8], [1.3e-3, 1e-3]))  # at 1e-3 it is 1/corner
def test_a_delay_far_shorter_than_a_period_changes_the_damping_of_a_resonance(phase):
    """The loop gain is -0.5 - 10 i at the resonance: 1.3e-3 rad of it change the damping by 3 %, the RMS by 1.5 %."""
    text, dynamic, omega = resonance_behind_a_delay(phase, ratio=5e-4, gain=4.9e-4)
    found = solve(text, "gondola.rms_x")
    assert found.values["gondola.rms_x"] == pytest.approx(rms_of_one_axis(dynamic, omega), rel=1e-5)


def test_what_a_delay_changes_that_is_left_out_is_in_the_stated_error():
    """The loop gain is 50 at the resonance, which it moves: 2e-7 rad there change the damping by 1e-5 of it."""
    text, dynamic, omega = resonance_behind_a_delay(2e-7, ratio=1e-4, gain=1e-5, model={"accuracy": 1e-6})
    found, expected = solve(text, "gondola.rms_x"), rms_of_one_axis(dynamic, omega * np.sqrt(1.01))
    error = abs(found.values["gondola.rms_x"] / expected - 1)
    assert 5e-6 < error < found.errors["gondola.rms_x"] < 3 * error


def test_a_resonance_just_below_the_frequency_up_to_which_the_delay_is_right():
    """The loop changes its damping by a tenth: a pole of the winches at rest in its place is 4 % off in the RMS."""
    mass, spring, time, gain = 20.0, 2e5 / 9.9, 3e-5, 0.003
    omega = np.sqrt(spring / mass)
    delay = 3.8 / omega
    text = one_axis(
        mass=mass, time=time, winches={"west": {}, "east": {}}, wind=CALM_BODY,
        control={"gain": gain, "notch": "none", "delay": delay},
        bodies__gondola__wind={"area": 0.5, "drag_coefficient": 1.2},
    )  # fmt: skip

    def dynamic(s):
        return mass * s**2 + spring * (1 + time * s) * (1 + gain / s * np.exp(-delay * s))

    found = solve(text, "gondola.rms_x")
    assert found.values["gondola.rms_x"] == pytest.approx(rms_of_one_axis(dynamic, omega), rel=1e-5)


def test_speeds_of_winches_state_what_a_resonance_beyond_the_approximated_delay_changes():
    """Two equal bodies with a stiff link, whose mode at 30 times the lowest frequency has a loop gain of 0.19."""
    mass, spring, proportional = 20.0, 2e5 / 9.9, 0.2
    slow = np.sqrt(spring / (2 * mass))
    fast, gain, corner, delay, time = 30 * slow, 0.01 * slow, 1e3 * slow, 0.3 / slow, 0.1 / slow
    link = {"stiffness": fast**2 * mass / 2, "damping": 2e-4 * fast * mass}
    text = one_axis(
        mass=mass, time=time, winches={"west": {}, "east": {}}, wind=CALM_BODY, links__link={
            "from": "gondola.a", "to": "small.a", "length": 0.0, **link},
        control={"body": "gondola", "gain": gain, "proportional_gain": proportional, "bandwidth": corner / TURN,
                 "notch": "none", "delay": delay},
        bodies__gondola__wind={"area": 0.5, "drag_coefficient": 1.2},
        bodies__small={"at": [0.0, 2.0, 0.0], "mass": mass, "inertia": [1.0, 1.0, 1.0], "free": ["x"],
                       "attachments": {"a": [0.0, 0.0, 0.0]}},
    )  # fmt: skip

    def law(s):
        return (proportional + gain / s) / (1 + s / corner) * np.exp(-delay * s)

    def speed(s):  # per force, of what the winches reel in: 0.99 of it moves the stretched cable
        joint = link["stiffness"] + link["damping"] * s
        other = mass * s**2 + joint
        own = mass * s**2 + spring * (1 + time * s) * (1 + law(s)) + joint
        return 0.99 * s * law(s) / (own - joint**2 / other)

    rms = rms_of_one_axis(lambda s: 1 / speed(s), fast)
    rate = rms_of_one_axis(lambda s: 1 / (s * speed(s)), fast)
    mode = np.sqrt(2 * np.log(rate / rms / TURN * 600))
    found = solve(text, *SPEEDS)
    for name, expected in zip(SPEEDS, (rms, rms * (mode + np.euler_gamma / mode)), strict=True):
        assert abs(found.values[name] / expected - 1) < found.errors[name] < 0.02


def test_the_rms_in_the_wind_is_the_integral_of_the_exact_spectrum():
    text = everything(control=LOOP | DELAYED)
    own, case = Straight(text), case_of(text)
    s = 2j * np.pi * FREQUENCY
    stiffness, reeled = closed_stiffness(own, s)
    speed = own.wind["speed"]
    direction = own.blowing / speed
    turn = np.stack([direction, np.cross([0, 0, 1.0], direction), [0, 0, 1.0]])
    moved = np.linalg.solve(stiffness, np.broadcast_to(own.gust_forces @ turn.T + 0j, (len(s), len(own.free) + 2, 3)))
    area = np.array(own.bodies[0]["wind"]["area"]) @ direction**2
    driving = von_karman(FREQUENCY, speed, 1.0, 25.0) / (1 + (FREQUENCY * 2 * np.sqrt(area) / speed) ** (4 / 3))
    driving = driving[:, None] * own.turbulence**2
    for name, row in (("gondola.rms_x", 0), ("gondola.rms_y", 1), ("gondola.rms_z", 2), ("mass_x.rms_stroke", 6)):
        expected = np.sqrt(integral((np.abs(moved[:, row]) ** 2 * driving).sum(axis=1)))
        assert value(case, name) == pytest.approx(1e3 * expected, rel=1e-4), name
    speeds = ((np.abs(reeled @ moved) * np.abs(s)[:, None, None]) ** 2 * driving[:, None]).sum(axis=2)
    expected = max(np.sqrt(integral(spectrum)) for spectrum in speeds.T)
    assert value(case, "winch_rms_speed") == pytest.approx(1e3 * expected, rel=1e-4)


ROD = {"EA": 1e5, "mass": 0.5, "body": 200.0, "span": 40.0, "strain": 2e-3, "time": 2e-5, "viscous": 0.2}
ROD_LAW = {"gain": 0.02, "proportional_gain": 0.02, "derivative_gain": 1e-3, "derivative_filter": 60.0,
           "bandwidth": 100.0}  # fmt: skip
ROD_WIND = {"speed": 5.0, "turbulence_intensity": 0.2, "length_scale": 60.0, "on": "bodies", "mean": False,
            "aerodynamic_damping": False, "admittance": "none", "duration": 60.0}  # fmt: skip


def between_rods(rod, law, accuracy):
    """A body between two straight cables without weight along x, whose winches move against each other: a mapping."""
    shared = {"elastic_modulus": 1e9, "area": rod["EA"] / 1e9, "density": rod["mass"] * 1e9 / rod["EA"],
              "damping": {"model": "kelvin_voigt", "time": rod["time"], "viscous": rod["viscous"]}}  # fmt: skip
    return one_axis(
        mass=rod["body"], span=rod["span"], strain=rod["strain"], cable=shared, winches={"west": {}, "east": {}},
        control=law | {"notch": "none"}, wind=ROD_WIND, model={"accuracy": accuracy},
        bodies__gondola__wind={"area": 0.5, "drag_coefficient": 1.2},
    )  # fmt: skip


def speeds_between_rods(rod, law):
    """RMS and expected peak of the speed of each winch of `between_rods`, by the waves in continuous rods. [mm/s]"""
    frequency = np.geomspace(1e-6, 2e4, 400_001)
    s, length = 2j * np.pi * frequency, rod["span"] * (1 - rod["strain"])
    stiffness = rod["EA"] * (1 + rod["time"] * s) / length
    g = length * np.sqrt((rod["mass"] * s**2 + rod["viscous"] * s) / (stiffness * length))
    g = np.minimum(g.real, 300) + 1j * g.imag  # as good as infinitely long
    filtered = law["derivative_gain"] * s / (1 + s / TURN / law["derivative_filter"])
    controller = (law["gain"] / s + law["proportional_gain"] + filtered) / (1 + s / TURN / law["bandwidth"])
    # the winches move both far ends alike; an end moves by the stretched length of what is reeled in
    dynamic = rod["body"] * s**2 + 2 * stiffness * g / np.tanh(g) + 2 * stiffness * g / np.sinh(g) * controller
    speed = s * controller * (1 - rod["strain"]) * 1.2 * 1.2 * 0.5 * ROD_WIND["speed"] / dynamic
    spectrum = np.abs(speed) ** 2 * von_karman(frequency, ROD_WIND["speed"], 1.0, ROD_WIND["length_scale"])
    rms, rate = (np.sqrt(np.trapezoid(part * frequency, np.log(frequency)) + part[0] * frequency[0])
                 for part in (spectrum, (TURN * frequency) ** 2 * spectrum))  # fmt: skip
    mode = np.sqrt(2 * np.log(rate / rms / TURN * ROD_WIND["duration"]))
    return 1e3 * rms, 1e3 * rms * (mode + np.euler_gamma / mode)


def test_the_stated_errors_of_the_speeds_of_winches_are_true():
    """Waves along the cables, which a PID law drives: their peak has the error of the acceleration too."""
    found = solve(between_rods(ROD, ROD_LAW, 1e-4), *SPEEDS)
    for name, expected in zip(SPEEDS, speeds_between_rods(ROD, ROD_LAW), strict=True):
        assert found.values[name] == pytest.approx(expected, rel=1e-4)
        assert abs(found.values[name] / expected - 1) < found.errors[name]


def test_winches_that_follow_gusts_far_faster_than_the_body_moves():
    """A body of 0.05 Hz, and a law with corners of 300 and 600 Hz: half of the acceleration is above 60 Hz."""
    rod = ROD | {"mass": 1e-6, "body": 50e3, "time": 2e-2, "viscous": 0.0}
    law = ROD_LAW | {"gain": 1e-4, "derivative_gain": 0.01, "derivative_filter": 300.0, "bandwidth": 600.0}
    found = solve(between_rods(rod, law, 1e-4), *SPEEDS)
    expected = speeds_between_rods(rod, law)
    assert [found.values[name] for name in SPEEDS] == pytest.approx(expected, rel=1e-5)


def test_the_state_space_has_the_response_of_the_exact_loop_up_to_where_its_delay_is_right():
    text = everything(control=LOOP | DELAYED)
    own, closed_loop = Straight(text), closed_loop_of(text)
    loop, n = closed_loop.loop, len(own.free)
    forces = np.zeros((len(loop.motion), 6))
    forces[: loop.motion.shapes.shape[1]] = closed_loop.layout.bodies(loop.motion.shapes).T
    names = [f"{k}" for k in range(loop.motion.shapes.shape[1])]
    driven = labelled(closed_loop, loop.motion, names, forces)
    system = state_space_of(driven, None, loop.linear, measured_by(closed_loop), closed_loop.actuators)
    s = 1j * np.geomspace(0.01, 0.99 * loop.delay_accurate_up_to, 40)
    rows = [closed_loop.outputs[f"gondola.{axis}"] for axis in "xyz"]
    found = system.response(s, derivatives=True)
    stiffness, reeled = closed_stiffness(own, s)
    by_forces = np.linalg.solve(stiffness, np.broadcast_to(np.eye(n + 2, 6) + 0j, (len(s), n + 2, 6)))
    *_, B, rate = own.matrices
    assert found[:, rows, 3:] == pytest.approx(by_forces[:, :3], abs=1e-6 * np.abs(by_forces[:, :3]).max())
    # a reference moves the winches as much as a displacement of what is measured, the other way
    by_place = reeled @ np.linalg.pinv(own.measured)
    by_references = np.linalg.solve(stiffness, -(B + s[:, None, None] * rate) @ by_place)
    assert found[:, rows, :3] == pytest.approx(by_references[:, :3], abs=1e-6 * np.abs(by_references).max())
    assert len(set(system.state_names)) == len(system.a)


def test_a_step_of_a_reference_in_time_is_that_of_small_steps():
    law = {"gain": 0.4, "delay": 0.3}
    text = everything(control=LOOP | law | {"notch": "none"}, actuators={})
    own, case = Straight(text), case_of(text)
    options = TimeOptions("20s:41", "reference.y", "1 mm", output="gondola.y")
    found = time_case(None, case.scene, case.analysis, options)
    seen = in_time(own, law, 20.0, 60, reference=1e-3 * np.eye(3)[1])
    times = np.arange(len(seen)) * law["delay"] / 60
    expected = np.interp(found.time[:: found.options.every], times, seen[:, 1])
    # a corner in time has no end in frequency
    assert found.response.measured[:: found.options.every] == pytest.approx(expected, abs=5e-3 * np.abs(expected).max())
    assert "delay: Padé approximants, whose phase is accurate up to" in " ".join(found.remarks)
    assert "estimated error by modes left out and the approximated delay: " in " ".join(found.notes)


def test_a_winch_that_is_too_slow_is_named():
    slow = ("--set", "control.max_speed=0.5 mm/s")
    done = run("windrms", NET, *slow, "--table", "loop", "--format", "json")
    assert re.search(r"warning: the winch of \w+ would reach [1-9]", done.err)
    (row,) = rows_of(done.out, "json")
    assert 0.5 < row["winch_rms_speed_mm_per_s"] < row["winch_peak_speed_mm_per_s"]
    done = run("loop", NET, *slow, "--time", "5s:3", "--input", "reference.x")
    assert "above its max_speed of 0.5 mm/s: the linear response does not hold" in done.err
    assert "max_speed" not in run("windrms", NET, "--set", "control.max_speed=50 mm/s", "--table", "loop").err


def test_what_was_modelled_is_said(tmp_path):
    sets = [f"control.{key}" for key in ("proportional_gain=0.01", "bandwidth=10 Hz", "delay=20 ms", "notch=none")]
    options = with_sets(*sets, "control.gain=0.1")
    for command in (("loop", NET), ("ssm", NET, "--with", "loop", "--out", tmp_path / "m.json")):
        said = run(*command, "--explain", *options).err
        assert "gains of 0.1 rad/s (integral), 0.01 (proportional)" in said
        assert "a lag of first order of 10 Hz" in said
        assert re.search(r"delay of 0\.02 s: Padé approximants, whose phase is accurate to 1e-7 up to 31\.83 Hz", said)


@cache
def with_delay(delay):
    """The straight suspension with all parts, and a delay of its winches [s]."""
    return case_of(everything(control=LOOP | {"delay": delay}))


@pytest.mark.parametrize("delay", campaign([1e-12, 1e-9, 1e-6, 1e-5, 1e-3], [1e-12, 1e-5, 1e-3]))
def test_a_short_delay_changes_little(delay):
    """The limit is a real eigenvalue of L with exp(-s T): to first order its change is at most the phase w T."""
    late, at_once = with_delay(delay), with_delay(0.0)
    for name in ("largest_gain", "gondola.rms_x", "winch_peak_speed"):
        found, expected = (value(case, name) for case in (late, at_once))
        assert found == pytest.approx(expected, rel=1e-5 + 100 * delay), name
    loop = late.analysis.closed_loop.loop
    assert loop.slight_delay == (delay < 1e-8)
    assert late.analysis.closed_loop.stability.limit.omega < 100


def test_a_derivative_part_is_judged_with_the_modes_that_it_drives():
    """Waves along the cables near 19 Hz decide, above the 64 modes of the model; one of 250 has them."""
    sets = "derivative_gain=5 ms", "derivative_filter=50 Hz", "bandwidth=25 Hz", "notch=none", "gain=0.03"
    case = case_at("carlina-net-wind", *(f"control.{one}" for one in sets))
    few, many = (case.analysis.closed_loop_of(count) for count in (64, 250))
    assert few.modes.frequency[-1] < 10
    of_modes = [gains_of_modes(one).limits[0].factor for one in (few, many)]
    assert of_modes[0] > 1.2 * of_modes[1]
    assert few.stability.largest_gain == pytest.approx(of_modes[1], rel=3e-3)


def test_a_loop_in_the_wind_between_long_cables_whose_modes_are_none():
    """The damping by the air of no modes of cables at all was asked for, which ended with a traceback."""
    mass, span, time, gain, strain = 20.0, 47.0, 3e-4, 0.4, 7e-3
    spring = 2e5 / (span * (1 - strain))
    text = one_axis(
        mass=mass, span=span, strain=strain, time=time, winches={"west": {}, "east": {}}, wind=WIND,
        control={"gain": gain, "notch": "none"}, bodies__gondola__wind={"area": 0.5, "drag_coefficient": 1.2},
        cable__density=1e-7,
    )  # fmt: skip
    # s (m s^2 + c s + k) + g k (1 + T s), by Routh's rule
    damping = spring * time + 1.2 * 0.6 * WIND["speed"]
    expected = damping * spring / (mass * spring - damping * spring * time)
    assert solve(text, "largest_gain").values["largest_gain"] == pytest.approx(expected, rel=1e-5)
