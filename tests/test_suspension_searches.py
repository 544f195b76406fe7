"""Searches for poses and lengths that used to end without an answer, and what refusals say (`statics/failure.py`)."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from random_suspensions import scene_data
from references import catenary_mp
from scipy.optimize import brentq, minimize_scalar, root
from scipy.spatial.transform import Rotation
from suspension_cases import case_of
from suspensions import body, cable, point, suspension, trifilar

from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span
from cablestudy.errors import ConvergenceError
from cablestudy.statics import lengths, rest
from cablestudy.statics.failure import explain
from cablestudy.statics.fitted_lengths import least_preload
from cablestudy.statics.tolerances import STATICS

G = 9.81


def chain(count, start, slack, stiffness):
    """A cable of 0.1 kg/m between two anchors at 30 m, cut in pieces at free points that begin at `start`."""
    places = start(np.linspace(0, 30, count + 2)[1:-1])
    points = [point(f"p{i}", place) for i, place in enumerate(places)]
    ends = [(0.0, 0.0, 0.0), *(p["name"] for p in points), (30.0, 0.0, 0.0)]
    own = 30 * (1 + slack) / (count + 1)
    return suspension([], [cable(*pair, stiffness, 0.1, value=own) for pair in pairwise(ends)], points)


def scattered(x):
    return np.stack([x, 0 * x, 0 * x], axis=-1) + np.random.default_rng(1).normal(size=(len(x), 3)) * 3


def deep(x):
    return np.stack([x, 0 * x, -3 * np.sin(np.pi * x / 30)], axis=-1)


@pytest.mark.parametrize(("start", "slack", "stiffness"), [(scattered, 0.1, 1e5), (deep, -1e-3, 1e8)])
def test_a_chain_of_300_points(start, slack, stiffness):
    """Its points lie on the catenary of the cable that is not cut."""
    found = rest.pose(chain(300, start, slack, stiffness))
    assert found.record.converged
    assert found.stability.stable
    whole = solve(Span.between(np.zeros(3), [30, 0, 0], stiffness, 0.1, G, 30 * (1 + slack)))
    share = np.arange(1, 301) / 301
    moved, _ = whole.at(share)
    along = (1 + whole.span.chord_strain) * share[:, None] * np.array([1.0, 0, 0]) + moved
    np.testing.assert_allclose(found.position, whole.span.unstretched_length * along @ whole.span.frame, atol=1e-7)


@pytest.mark.parametrize("kind", ["preload", "tension_to", "horizontal_tension"])
def test_a_point_is_pushed_past_an_anchor_by_more_than_the_other_cable_keeps(kind):
    """Two cables in line, the first one of given length: it holds what force and stated tension leave, on either side.

    On the way past its anchor it is slack, and the tension of the other is the force whatever its length.
    """
    length, stiffness, kept = 49.995, 1e6, 1000.0
    force = np.array([0.0, 500.0, 999.0, 1001.0, 1050.0, 1300.0, 1778.0, 2000.0, 3000.0])
    lines = [cable((0, 0, 0), "k", stiffness, value=length), cable("k", (100, 0, 0), stiffness, given=kind, value=kept)]
    scene = suspension([], lines, [point("k", (50, 0, 0))])
    pushed = np.zeros((len(force), 1, 3))
    pushed[:, 0, 0] = -force
    found = rest.pose(replace(scene, force=pushed))
    assert found.record.converged.all()
    assert found.stability.stable.all()
    tension = kept - force  # of the first cable, negative where it pulls the other way
    place = np.sign(tension) * length * (1 + np.abs(tension) / stiffness)
    np.testing.assert_allclose(found.position[:, 0, 0], place, rtol=1e-9)
    np.testing.assert_allclose(found.catenary.mean_tension[:, 0], np.abs(tension), rtol=1e-6)


@pytest.mark.parametrize(("kind", "value"), [("sag", 1.9), ("preload", 4e6)])
def test_a_platform_comes_to_rest_far_below_its_place_in_the_file(kind, value):
    """Six stiff cables keep what they state while it moves by 118 and 234 m, to where exact catenaries balance it."""
    mass, upper, lower = 8.2e5, (2.3e9, 124.0), (5.7e8, 31.0)  # EA and mass per length of the cables
    lines = []
    for angle in 2 * np.pi * np.arange(3) / 3:
        x, y = np.cos(angle), np.sin(angle)
        end = ("a", (35 * x, 35 * y, 2.0))
        lines.append(cable((300 * x, 300 * y, 110.0), end, *upper, given=kind, value=value))
        lines.append(cable((120 * x, 120 * y, -40.0), end, *lower, given="preload", value=3e5))
    platform = body("a", (0, 0, 100.0), mass, inertia=(8e7, 8e7, 1.4e8))
    found = rest.pose(suspension([platform], lines, gravity=G))
    assert found.record.converged

    def exact(cable, radius, top, length):
        """Mean tension, sag, and how much of the weight one of these cables carries."""
        stiffness, weight = cable[0], cable[1] * G
        force = catenary_mp.solve(radius - 35, found.position[0, 2] + 2.0 - top, length, stiffness, weight)
        mean, sag = catenary_mp.mean_tension(*force, length, weight), catenary_mp.sag(*force, length, stiffness, weight)
        return {"preload": float(mean), "sag": float(sag), "lift": -float(force[1] + weight * length)}

    of_upper, of_lower = exact(upper, 300, 110.0, found.lengths[0]), exact(lower, 120, -40.0, found.lengths[1])
    assert of_upper[kind] == pytest.approx(value, rel=1e-9)
    assert of_lower["preload"] == pytest.approx(3e5, rel=1e-9)
    assert 3 * (of_upper["lift"] + of_lower["lift"]) == pytest.approx(mass * G, rel=1e-9)


def test_a_mechanism_beside_stiff_cables_is_passed():
    """Five cables of EA/T from 1e6 to 1e9 hold four free motions; the others are those of a flat valley."""
    found = case_of(scene_data(10043)).equilibrium
    own = found.suspension
    weight = np.array([0, 0, -own.mass[0] * own.gravity])
    net = found.end_forces[:, 1].sum(axis=0) + weight
    np.testing.assert_allclose(net[[0, 2]], 0, atol=1e-7 * -weight[2])


@pytest.mark.parametrize("at", [[0, 0, 0], [-0.5, 0.2, 0.5]])
def test_a_body_whose_yaw_is_held_stands_alike_wherever_the_search_begins(at):
    """On springs, cables without weight: its rotation vector (a, b, 0) by a root-finder, moments about x and y zero."""
    arms = np.array([[0.5, 0, 0.2], [-0.5, 0.3, 0.2], [0, -0.5, 0.2]])
    anchors, own = np.array([[5.0, 1, 4], [-5, 2, 4], [0, -5, 4]]), np.array([5.95, 6.1, 6.0])
    center, weight, stiffness = np.array([0.15, 0.1, -0.3]), np.array([0, 0, -50 * G]), 1e6
    body = {"at": at, "mass": 50.0, "inertia": [4, 4, 6], "center_of_mass": center.tolist(),
            "free": ["x", "y", "z", "roll", "pitch"],
            "attachments": dict(zip("abc", arms.tolist(), strict=True))}  # fmt: skip
    cables = {
        f"n{k}": {"from": anchors[k].tolist(), "to": f"b.{'abc'[k]}", "unstretched_length": own[k]} for k in range(3)
    }
    section = {"axial_stiffness": stiffness, "mass_per_length": 1e-12}

    def unbalanced(q):
        turn = Rotation.from_rotvec([q[3], q[4], 0])
        chord = anchors - q[:3] - turn.apply(arms)
        length = np.linalg.norm(chord, axis=-1, keepdims=True)
        force = stiffness * (length / own[:, None] - 1) * chord / length
        moment = np.cross(turn.apply(arms), force).sum(axis=0) + np.cross(turn.apply(center), weight)
        return [*(force.sum(axis=0) + weight), *moment[:2]]

    expected = root(unbalanced, [0.03, 0.17, 0, -0.12, 0.15], tol=1e-14).x
    found = case_of({"gravity": G, "bodies": {"b": body}, "cables": cables, "cable": section}).equilibrium
    np.testing.assert_allclose(found.position[0], expected[:3], atol=1e-10)
    turned = Rotation.from_matrix(found.rotation[0]).as_rotvec()
    np.testing.assert_allclose(turned, [*expected[3:], 0], atol=1e-10)


@pytest.mark.usefixtures("short_searches")
def test_a_dead_moment_that_cables_cannot_hold():
    """Twisted wires of 20 m hold m g r^2 sin(angle)/drop: 15.7 N m at most."""
    turned = rest.pose(trifilar(stiffness=1e7, moment=(0, 0, 20.0)))
    assert not turned.record.converged
    assert explain(turned).startswith("a body turns on and on (")
    assert explain(turned).endswith("the dead moment of 20 N m on disk may be more than the cables can hold")


def test_a_dead_moment_just_below_what_cables_hold():
    """It is m g r^2 sin(angle)/drop, the drop sqrt(L^2 - (2 r sin(angle/2))^2), and largest past 90 degrees."""

    def held(angle):
        return 50 * G * 0.8**2 * np.sin(angle) / np.sqrt(20.0**2 - (1.6 * np.sin(angle / 2)) ** 2)

    most = minimize_scalar(lambda angle: -held(angle), bounds=(1.0, 2.0), method="bounded").x
    angle = brentq(lambda angle: held(angle) - 0.9999 * held(most), 1.0, most)
    found = rest.pose(trifilar(stiffness=1e7, moment=(0, 0, 0.9999 * held(most))))
    assert found.record.converged
    assert Rotation.from_matrix(found.rotation[0]).as_rotvec()[2] == pytest.approx(angle, abs=1e-5)


@pytest.mark.usefixtures("short_searches")
def test_a_dead_moment_beside_loose_cables_without_gravity():
    """No other force gives a scale for what is left, which must not overflow: pytest takes a warning for an error."""
    case = case_of(scene_data(2008, states=False))
    with pytest.raises(ConvergenceError, match=r"the dead moment of .* N m on a may be more than"):
        _ = case.equilibrium


def topheavy(**more):
    """A disk on three wires whose weight is above them: upright it balances, and falls over."""
    return trifilar(below=-3.0, height=20.0, radius=0.2, stiffness=1e5, line=1e-3, **more)


def test_a_search_that_begins_on_a_saddle():
    found = rest.pose(topheavy())
    assert found.record.converged
    assert found.stability.stable
    assert (found.rotation[0] @ found.suspension.center[0])[2] < -1


def test_a_free_attitude_is_a_stable_one():
    """The same disk where it shall be, its attitude and lengths from equilibrium."""
    scene = topheavy()
    found, problems = lengths.solve(replace(scene, stated=(None,) * 3))
    assert problems == ""
    assert found.stability.stable
    np.testing.assert_allclose(found.position[0], 0, atol=1e-9)
    assert (found.rotation[0] @ scene.center[0])[2] < -1
    net = found.end_forces[:, 1].sum(axis=0) - [0, 0, 50 * G]
    np.testing.assert_allclose(net, 0, atol=1e-7)


@pytest.mark.parametrize("way", [(10.0, 0, 0), (0, 0, -10.0), (0, 0, 10.0)])
def test_the_least_tension_of_a_cable(way):
    """Of the weight of its chord (u + sinh u cosh u)/(4 u sinh u) if level and stiff, a half if it is vertical."""

    def level(u):
        return (u + np.sinh(u) * np.cosh(u)) / (4 * u * np.sinh(u))

    share = minimize_scalar(level, bounds=(0.5, 3.0), method="bounded").fun if way[0] else 0.5
    span = Span.between(np.zeros(3), np.array([way]), 1e9, 2.0, G, np.array([10.0]))
    assert least_preload(span)[0] == pytest.approx(share * 2.0 * G * 10, rel=STATICS.least_tension_error)


def heavy_robot(line):
    """A body of 50 kg between twelve cables, each from 30 m away, without bounds of their tensions."""
    rng = np.random.default_rng(4)
    anchors = rng.normal(size=(12, 3))
    anchors *= 30 / np.linalg.norm(anchors, axis=-1)[:, None]
    places = rng.uniform(-0.7, 0.7, (12, 3))
    lines = [cable(tuple(a), ("b", tuple(p)), 1e6, line, given=None) for a, p in zip(anchors, places, strict=True)]
    return suspension([body("b", (0, 0, 0), 50.0)], lines)


@pytest.mark.parametrize("line", [1e-3, 0.02, 0.2])
def test_no_tension_below_what_its_own_weight_gives_a_cable(line):
    """The least tensions of all: some cables hang as slack as the search allows; forces and moments balance."""
    found, problems = lengths.solve(heavy_robot(line), "least")
    assert problems == ""
    force, arm = found.end_forces[:, 1], found.arms[:, 1]
    np.testing.assert_allclose(force.sum(axis=0), [0, 0, 50 * G], atol=1e-6)
    np.testing.assert_allclose(np.cross(arm, force).sum(axis=0), 0, atol=1e-6)
    least = least_preload(found.catenary.span)
    ratio = found.catenary.mean_tension / least
    assert ratio.min() >= 1
    assert ratio.min() < 2.01


@pytest.mark.parametrize(("mass", "stiffness", "line"), [(5.5e-3, 2e9, 3e-9), (5.5e-3, 2e9, 3e-5), (50.0, 1e7, 0.0)])
def test_lengths_of_a_trifilar_pendulum_of_thin_wires(mass, stiffness, line):
    """Each wire has a third of the weight, and half of its own at mid-length."""
    scene = replace(trifilar(mass=mass, stiffness=stiffness, line=line, height=10.5), stated=(None,) * 3)
    found, problems = lengths.solve(scene, "least")
    assert problems == ""
    np.testing.assert_allclose(found.catenary.mean_tension, (mass / 3 + line * 10.5 / 2) * G, rtol=1e-6)


def test_a_preload_below_the_least_is_named():
    """A level cable of 1 kg/m and 10 m has 49.8 N at least (see above), and 3 N are asked for."""
    held = body("b", (10, 0, 0), 1.0, free=(False,) * 5 + (True,))
    lines = [
        cable((0, 0, 0), ("b", (0, 0, 0)), 1e6, 1.0, given="preload", value=3.0),
        cable((10, 5, 0), ("b", (0, 0.3, 0)), 1e6, 0.1, value=4.6),
        cable((10, -5, 0), ("b", (0, -0.3, 0)), 1e6, 0.1, value=4.6),
    ]
    found = rest.pose(suspension([held], lines))
    assert not found.record.converged
    reason = explain(found)
    assert "c0 has a preload of" in reason
    assert "instead of 3 N; its own weight gives it at least 49.8" in reason


def test_cables_without_any_tension_are_a_mechanism():
    """Without gravity a stretched cable pulls a point until nothing is left: no force, and nothing that holds it."""
    line = cable((0, 0, 0), ("b", (0.3, 0, 0.1)), 1e2, 1e-4, value=4.0)
    found = rest.pose(suspension([body("b", (3, 2, 3.5), 1e-3)], [line], gravity=0.0))
    assert found.record.converged
    assert found.stability.reason().startswith("nothing holds b")
