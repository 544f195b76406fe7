"""PID, delay and lag of the winches of a suspension: one cable, dense determinants, time by small steps."""

from functools import cache

import numpy as np
import pytest
import scipy.linalg
from command import CARLINA, run
from references.straight_suspension import Straight
from straight_scenes import LOOP, case_of, everything, movement_of, one_axis, two_bodies

from cablestudy.control.pose_margins import single_limits
from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import Scene
from cablestudy.study.case import Case

TURN = 2 * np.pi
NET = CARLINA.replace("carlina.yaml", "suspensions/carlina-net-wind.yaml")
LAWS = {
    "integrator": {"gain": 0.4},
    "lag": {"gain": 0.4, "bandwidth": 5.0},
    "delay": {"gain": 0.4, "delay": 0.03},
    "long delay": {"gain": 0.3, "delay": 0.4},
    "PI": {"gain": 0.4, "proportional_gain": 0.05, "bandwidth": 20.0},
    "PID": {"gain": 0.4, "proportional_gain": 0.02, "derivative_gain": 0.01, "derivative_filter": 5.0,
            "bandwidth": 20.0, "delay": 0.01},
}  # fmt: skip
each_law = pytest.mark.parametrize("name", LAWS)
COLUMNS = "gain", "largest_gain", "gain_margin", "sensitivity_peak"


# -------------------------------------------------------------------------------------- against the loop of one cable

AXIS = {"mass": 0.3, "EA": 2e4, "span": 10.0, "tension": 200.0, "body": 25.0, "time": 2e-3, "elements": 6}
SHARED = {"elastic_modulus": 1e8, "area": AXIS["EA"] / 1e8, "density": AXIS["mass"] * 1e8 / AXIS["EA"],
          "damping": {"model": "kelvin_voigt", "time": AXIS["time"], "viscous": 0.02}}  # fmt: skip
FIXED = {"elements": AXIS["elements"], "order": 2}
AXIS_NOTCH = {"frequency": 1.5, "damping_ratio": 0.05, "rolloff_frequency": 10.0, "rolloff_damping_ratio": 1.0}


def one_cable(law, notch=AXIS_NOTCH):
    """The loop of one cable along x without weight."""
    drive = {key: law[key] for key in ("delay", "bandwidth") if key in law}
    own = {key: value for key, value in law.items() if key not in drive}
    text = {
        "gravity": 0.0, "cable": SHARED | {"preload": AXIS["tension"], "chord": AXIS["span"]},
        "gondola": {"mass": AXIS["body"]}, "winch": drive | {"controller": own | {"notch": notch}}, "model": FIXED,
    }  # fmt: skip
    return Case(Scene.model_validate(text)).loop


def both_sides(law, notch=AXIS_NOTCH):
    """A body of twice the mass between two such cables, whose winches move against each other: of `movement_of`."""
    own = AXIS["span"] / (1 + AXIS["tension"] / AXIS["EA"])
    text = one_axis(mass=2 * AXIS["body"], span=AXIS["span"], strain=1 - own / AXIS["span"], cable=SHARED,
                    winches={"west": {}, "east": {}}, control=law | {"notch": notch}, model=FIXED)  # fmt: skip
    return case_of(text).in_wind.movement_of(200)


@each_law
def test_two_equal_cables_have_the_loop_of_one(name):
    one, two = one_cable(LAWS[name]), both_sides(LAWS[name])
    s = 1j * np.geomspace(0.05, 300, 60)
    expected = one.gain * one.whole.unit_gain(s)
    assert two.loop.gain * two.loop.unit_gain(s)[:, 0, 0] == pytest.approx(expected, rel=1e-8)
    assert two.largest_gain == pytest.approx(one.largest_integral_gain, rel=1e-8)
    assert two.sensitivity_peak == pytest.approx(one.sensitivity_peak[0], rel=1e-6)


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
    """Dense model and `Movement`."""
    text = SCENES[scene](laws_of(seed))
    return Straight(text), movement_of(text)


def encirclements(own, gain):
    """Growing motions: the turns of det(I + L) from below to above the real axis, past the pole at 0 on its right."""
    small, k = 1e-5, len(own.measured)
    path = np.concatenate([small * np.exp(1j * np.linspace(0, np.pi / 2, 200)), 1j * np.geomspace(small, 1e4, 4000)])

    def determinants(s):
        return np.linalg.det(np.eye(k) + gain * own.unit_gain(s))

    value = determinants(path)
    for _ in range(20):
        coarse = np.abs(np.angle(value[1:] / value[:-1])) > 0.3
        if not coarse.any():
            break
        places = np.flatnonzero(coarse)
        between = np.sqrt(path[places] * path[places + 1])
        path, value = np.insert(path, places + 1, between), np.insert(value, places + 1, determinants(between))
    assert not coarse.any()
    turned = np.angle(value[1:] / value[:-1]).sum() / np.pi
    assert abs(turned - round(turned)) < 0.02
    return round(-turned)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scene", SCENES)
def test_growing_poles_are_the_encirclements_of_the_exact_loop_gain(scene, seed):
    own, movement = solved(scene, seed)
    limit, judged = movement.largest_gain, 0
    for factor in (0.2, 0.999, 1.001, 2.0, 6.0):
        try:
            poles = movement.loop.poles_with(np.full(len(own.measured), factor * limit))
        except NoSolutionError:  # refused, and not judged wrongly
            assert factor > 1.5
            continue
        judged += 1
        count = encirclements(own, factor * limit)
        assert (poles.real > 1e-7 * np.abs(poles)).sum() == count, factor
        assert (count > 0) == (factor > 1), factor
    assert judged >= 3


def test_the_limit_of_one_coordinate_alone_is_where_the_exact_loop_gain_encircles():
    own, movement = solved("three coordinates, no notch", 3)
    movement = movement.loop.with_gain(0.3 * movement.largest_gain)
    found = single_limits(movement)
    whole = movement.gain * np.ones(3)

    class Alone:
        """The dense model whose loop gain is that of some gains."""

        measured = own.measured

        def __init__(self, gains):
            self.gains = gains

        def unit_gain(self, s):
            return own.unit_gain(s) * self.gains

    assert (found > 1.5).all()
    for place, factor in enumerate(found):
        for part, grows in ((0.999, False), (1.001, True)):
            gains = np.where(np.arange(3) == place, part * factor, 1.0) * whole
            assert (encirclements(Alone(gains), 1.0) > 0) == grows


# ---------------------------------------------------------------------------------------------- in time, by small steps


def sizes_in_time(own, law, time, steps):
    """Largest measured displacement in the second and last quarter of a time, after a push, of a dense model.

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
    state[n : 2 * n] = np.linalg.solve(M, own.measured.T @ np.ones(k))
    seen = np.zeros((count + steps + 1, k))  # from a delay before the start
    for place in range(count):
        seen[place + steps] = own.measured @ state[:n]
        before, after = seen[place], seen[place + 1]
        state = advance @ np.concatenate([state, before, after - before])
    size = np.abs(seen[steps:-1]).max(axis=1)
    return size[count // 4 : count // 2].max(), size[3 * count // 4 :].max()


@pytest.mark.parametrize("law", [{"gain": 1.0, "delay": 0.3}, {"gain": 1.0, "delay": 0.05},
                                 {"gain": 1.0, "proportional_gain": 0.1, "bandwidth": 3.0, "delay": 0.1}])  # fmt: skip
def test_a_loop_in_time_grows_above_the_largest_gain_and_decays_below(law):
    text = everything(control=LOOP | law | {"notch": "none"}, actuators={})
    own, limit = Straight(text), movement_of(text).largest_gain
    for factor in (0.97, 1.03):
        scaled = law | {key: factor * limit * law[key] for key in ("gain", "proportional_gain") if key in law}
        early, late = sizes_in_time(own, scaled, 150.0, 40)
        assert (late > 1.2 * early) == (factor > 1)
        assert (late < 0.8 * early) == (factor < 1)


# ------------------------------------------------------------------------------------------------------ what is refused

MISTAKES = {
    ("control.proportional_gain=0.1",): "control.bandwidth: missing key: with proportional",
    ("control.derivative_gain=0.1 s", "control.bandwidth=5 Hz"): "control.derivative_filter: missing key",
    ("control.proportional_gain=0.1", "control.bandwidth=5 Hz", "control.gain={auto: 6 dB}"):
        "control.gain: auto chooses an integral gain",
    ("control.gain=0", "control.proportional_gain=1", "control.bandwidth=5 Hz"): "control.gain: must be above 0 with",
    ("control.delay=5 mm",): "control.delay",
    ("control.max_speed=0",): "control.max_speed",
    ("control.dealy=5 ms",): "did you mean delay?",
    ("winches.u1.delay=5 ms",): "winches.u1.delay: unknown key in a suspension: that of all winches is under control",
    ("winches.u1.controller={gain: 1}",): "that of all winches is under control",
}  # fmt: skip


@pytest.mark.parametrize("sets", MISTAKES)
def test_mistakes_are_one_line(sets):
    done = run("loop", NET, *(part for text in sets for part in ("--set", text)), code=2)
    assert len(done.lines) == 1, done.err
    assert MISTAKES[sets] in done.err


def test_a_delay_that_is_too_long_to_be_judged_is_refused():
    text = everything(control=LOOP | {"delay": 30.0})
    with pytest.raises(NoSolutionError, match=r"stability with a delay of 30 s is not judged at a gain of 0\.4 rad/s"):
        case_of(text).in_wind.movement  # noqa: B018
