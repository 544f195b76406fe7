"""Where bodies and junctions come to rest (`statics/rest.py`), and their form by force densities."""

from dataclasses import replace

import numpy as np
import pytest
import solved
import yaml
from campaign import campaign
from references import catenary_mp
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation
from suspensions import body, cable, heavy, point, sagging, suspension, trifilar, with_values

import cablestudy as cs
from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span
from cablestudy.errors import NoSolutionError
from cablestudy.statics import force_density, rest
from cablestudy.statics.descent import descend
from cablestudy.statics.rigid import to_angles
from cablestudy.statics.stability import MECHANISM, STABLE, UNSTABLE
from cablestudy.statics.tolerances import STATICS


def at_rest(scene):
    """Its equilibrium, which is stable and in which the forces balance: summed up here once more."""
    found = rest.pose(scene)
    assert found.record.converged.all()
    assert found.stability.stable.all()
    return found


def net_force(found, body_index):
    """Sum of the forces of cables, weight and dead force on one body."""
    own = found.suspension
    on = own.owner == body_index
    weight = np.array([0, 0, -own.mass[body_index] * own.gravity])
    return found.end_forces[on].sum(axis=0) + weight + own.force[body_index]


def node(start):
    """A node between two cables that another program throws away with a force of 1.5e7 N."""
    lines = [cable((x, 0, 2.0), "node", 1e8, 0.14, value=2.4) for x in (-2.0, 2.0)]
    return suspension([], lines, [point("node", start, 2.0)])


STARTS = [(0.5, 0.3, -3), (-2, 0, 2), (40, -30, 60), (0, 0, 1), (0, 0, 2.5)]


@pytest.mark.parametrize("start", campaign(STARTS, STARTS[:3]))
def test_a_node_from_bad_starts(start):
    """Each half of the symmetric form is one cable whose end carries half the node: a scalar equation in the depth."""
    found = at_rest(node(start))

    def lift(z):
        _, pull = catenary_mp.solve(2.0, z - 2.0, 2.4, 1e8, 0.14 * 9.81)
        return -float(pull) - 0.14 * 9.81 * 2.4 - 9.81

    depth = brentq(lift, 0.6, 0.75, xtol=1e-14)
    np.testing.assert_allclose(found.position[0], [0, 0, depth], atol=1e-9)


def test_a_plumb_line():
    """A weight on one cable: stretched by its own weight and by the load, in closed form."""
    length, ea, mu, mass = 30.0, 1e4, 0.2, 5.0
    found = at_rest(suspension([], [cable((0, 0, 0), "bob", ea, mu, value=length)], [point("bob", (3, 2, -10), mass)]))
    stretch = (mass * 9.81 + mu * length * 9.81 / 2) * length / ea
    np.testing.assert_allclose(found.position[0], [0, 0, -length - stretch], atol=1e-9)


def test_a_twisted_trifilar_pendulum():
    """A moment about the vertical: m g r^2 sin(angle)/height of the twisted cables (rigid, Routh)."""
    radius, height, angle = 0.8, 20.0, 0.7
    drop = np.sqrt(height**2 - (2 * radius * np.sin(angle / 2)) ** 2)
    moment = 50 * 9.81 * radius**2 * np.sin(angle) / drop
    found = at_rest(trifilar(radius=radius, height=height, stiffness=1e11, line=0.0, moment=(0, 0, moment)))
    np.testing.assert_allclose(to_angles(found.rotation[0]), [0, 0, angle], atol=1e-7)
    assert found.position[0, 2] == pytest.approx(height - drop, abs=1e-6)


def test_forces_balance():
    found = at_rest(sagging())
    for index in range(4):
        np.testing.assert_allclose(net_force(found, index), 0, atol=1e-7)


def test_a_held_body_leaves_each_cable_alone():
    one = sagging()
    held = replace(one, free=np.zeros_like(one.free))
    found = rest.pose(held)
    ends = one.ends(one.position, one.rotation)
    for i in range(10):
        alone = solve(Span.between(*ends[i], one.axial_stiffness[i], one.cable_mass[i], 9.81, one.value[i]))
        np.testing.assert_allclose(found.end_forces[i], alone.end_forces("global"), rtol=1e-8)


def test_held_degrees_of_freedom_stay():
    one = sagging()
    free = one.free.copy()
    free[0, [0, 5]] = False
    found = at_rest(replace(one, free=free))
    assert found.position[0, 0] == one.position[0, 0]
    assert net_force(found, 0)[1:] == pytest.approx([0, 0], abs=1e-7)
    assert abs(net_force(found, 0)[0]) > 1


HOOKS = np.array([[3.0, 0.0, 4.0], [-2.0, 2.5, 4.5], [-1.5, -3.0, 3.5]])
RINGS = np.array([[0.3, 0.0, 0.1], [-0.2, 0.25, 0.1], [-0.1, -0.3, 0.1]])
CENTER, MASS, PULL, EA, LENGTH = np.array([0.12, 0.15, -0.2]), 10.0, np.array([5.0, -8.0, 0.0]), 1e5, 4.6


def on_three_springs(free):
    """Place and rotation vector of a body on three ropes without weight, with two free rotations, by Newton's law."""

    def left_over(unknown):
        vector = np.zeros(3)
        vector[free] = unknown[3:]
        turn = Rotation.from_rotvec(vector)
        arms, center = turn.apply(RINGS), turn.apply(CENTER)
        ropes = HOOKS - unknown[:3] - arms
        distance = np.linalg.norm(ropes, axis=1)[:, None]
        forces, weight = EA * (distance / LENGTH - 1) * ropes / distance, np.array([0.0, 0.0, -MASS * 9.81])
        moment = np.cross(arms, forces).sum(axis=0) + np.cross(center, weight)
        return np.concatenate([forces.sum(axis=0) + weight + PULL, moment[free]])

    found = root(left_over, [0.0, 0.5, 0.5, 0.0, 0.0], tol=1e-13).x
    vector = np.zeros(3)
    vector[free] = found[3:]
    return found[:3], vector


@pytest.mark.parametrize("held", ["roll", "pitch", "yaw"])
def test_a_rotation_is_held_whatever_the_way_of_the_search(held):
    """Two rotations in turns add up to one about the third axis: by 0.7 degrees from the one start to the other."""
    angles = ["roll", "pitch", "yaw"]
    place, vector = on_three_springs([k for k, angle in enumerate(angles) if angle != held])
    scene = {
        "points": {f"p{k}": hook.tolist() for k, hook in enumerate(HOOKS)},
        "cable": {"axial_stiffness": EA, "mass_per_length": 1e-12, "unstretched_length": LENGTH},
        "cables": {f"c{k}": {"from": f"p{k}", "to": f"a.r{k}"} for k in range(3)},
    }
    body = {
        "mass": MASS, "center_of_mass": CENTER.tolist(), "inertia": [1, 1, 1], "free": [*"xyz", *angles],
        "attachments": {f"r{k}": ring.tolist() for k, ring in enumerate(RINGS)},
    }  # fmt: skip
    body["free"].remove(held)
    pulled = {"cases": {"pulled": {"forces": {"a": {"force": PULL.tolist()}}}}, "case": "pulled"}
    own = {"bodies": {"a": {"at": [0, 0, 0], **body, "force": PULL.tolist()}}}
    elsewhere = {"bodies": {"a": {**own["bodies"]["a"], "at": [-0.5, 1, -0.5]}}}
    pulled |= {"bodies": {"a": {"at": [0, 0, 0], **body}}}
    frozen = yaml.safe_load(cs.load(scene | pulled).freeze())
    for same in (scene | own, scene | elsewhere, scene | pulled, frozen):
        names = [f"a.{name}" for name in (*"xyz", *angles)]
        row = solved.solve(same, *names)
        values = list(row.values.values())
        assert values[:3] == pytest.approx(place, rel=1e-9)
        turned = Rotation.from_euler("ZYX", values[:2:-1], degrees=True).as_rotvec()
        assert turned == pytest.approx(vector, abs=1e-10)


@pytest.mark.parametrize("seed", campaign(range(6), [1, 4]))
def test_bad_starts_end_in_the_same_place(seed):
    """Junctions alone: the energy is convex, and its minimum one and the same from any start."""
    rng = np.random.default_rng(seed)
    names = ["p", "q", "r"]
    anchors = rng.normal(size=(6, 3)) * 20 + [0, 0, 20]
    pairs = [(tuple(anchors[i]), names[i % 3]) for i in range(6)] + [("p", "q"), ("q", "r")]
    starts = rng.normal(size=(2, 3, 3)) * [[[3.0]], [[200.0]]]
    lines = [cable(*pair, 10 ** rng.uniform(3, 9), 0.1, value=rng.uniform(15, 40)) for pair in pairs]
    places = [at_rest(suspension([], lines, [point(n, a, 3.0) for n, a in zip(names, s, strict=True)])) for s in starts]
    np.testing.assert_allclose(places[0].position, places[1].position, atol=1e-7)


def test_a_bad_case_does_not_stop_the_others():
    """No lengths give two weightless cables less tension than half of the weight; the other case is found."""
    pair = suspension(
        [], [cable((x, 0, 10), "bob", 1e5, given="preload", value=1.0) for x in (-4, 4)],
        [point("bob", (0, 0, 8), 2.0)],
    )  # fmt: skip
    weight = 2 * 9.81
    found = rest.pose(replace(pair, value=np.array([[40.0, 40.0], [weight / 4, weight / 4]])))
    assert found.record.converged.tolist() == [True, False]
    np.testing.assert_allclose(found.catenary.mean_tension[0], 40, rtol=1e-10)


@pytest.mark.parametrize("kind", campaign(["preload", "sag", "tension_to"], ["sag", "tension_to"]))
def test_stated_quantities_come_back(kind):
    """Whatever the cables of an equilibrium have: with all of it stated, the lengths are found again."""
    first = at_rest(sagging())
    stated = {
        "preload": first.catenary.mean_tension, "sag": first.catenary.sag,
        "tension_to": np.linalg.norm(first.end_forces[:, 1], axis=-1),
    }[kind]  # fmt: skip
    own = first.suspension
    some = [0, 3, 4, 7]  # six of the ten keep their lengths
    given = tuple(kind if i in some else "unstretched_length" for i in range(10))
    second = rest.pose(replace(own, stated=given, value=np.where(np.isin(range(10), some), stated, own.value)))
    assert second.record.converged
    np.testing.assert_allclose(second.position, first.position, atol=1e-7)
    np.testing.assert_allclose(second.lengths, first.lengths, rtol=1e-8)


def test_three_stated_tensions_at_one_point():
    """Weightless cables to a free point that pull with 3, 4 and 5 N in a plane: right angle between 3 and 4."""
    angles = np.deg2rad([20, 110, 250])
    lines = [
        cable((50 * np.cos(a), 50 * np.sin(a), 0), "p", 1e5, given="preload", value=t)
        for a, t in zip(angles, (3.0, 4.0, 5.0), strict=True)
    ]
    found = rest.pose(suspension([], lines, [point("p", (1, 2, 0))], gravity=0.0))
    assert found.record.converged
    pull = found.end_forces[:, 1]
    np.testing.assert_allclose(np.linalg.norm(pull, axis=-1), [3, 4, 5], rtol=1e-9)
    assert pull[0] @ pull[1] == pytest.approx(0, abs=1e-8)


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6, 1e10])
def test_from_rubber_to_steel(ratio):
    """EA over tension from 1 to 1e10: a tripod keeps all digits of its tensions, which its weight alone determines."""
    anchors = np.array([[5.0, 0, 8], [-3, 4, 8], [-2, -5, 8]])
    weight = 70 * 9.81
    lengths = np.linalg.norm(anchors, axis=-1) * 0.95
    lines = [cable(tuple(a), "p", weight * ratio, value=n) for a, n in zip(anchors, lengths, strict=True)]
    found = at_rest(suspension([], lines, [point("p", (0.5, 0.2, -1), 70.0)]))
    directions = anchors - found.position[0]
    directions /= np.linalg.norm(directions, axis=-1)[:, None]
    tension = np.linalg.solve(directions.T, [0, 0, weight])
    np.testing.assert_allclose(found.catenary.mean_tension, tension, rtol=1e-12)
    assert found.uncertainty.tension.max() < 1e-12


@pytest.mark.parametrize("mass", [1e-3, 1.0, 1e9])
def test_from_a_gram_to_a_million_tonnes(mass):
    """A body on six cables of 0.5 kg/m and EA 1e7 N: forces and moments balance."""
    found = at_rest(heavy(mass))
    load = mass * 9.81 + 6 * 0.5 * 24 * 9.81
    np.testing.assert_allclose(net_force(found, 0), 0, atol=1e-9 * load)


def test_gravity_zero():
    """Cables that are too long for their anchors hold nothing; taut ones hold a junction where forces balance."""
    lines = [cable((x, 0, 0), "p", 1e5, value=4.9) for x in (-5.0, 5.0)]
    found = at_rest(suspension([], lines, [point("p", (1, 0.5, 0.2), 3.0)], gravity=0.0))
    np.testing.assert_allclose(found.position[0], 0, atol=1e-9)
    loose = rest.pose(with_values(found.suspension, "unstretched_length", [5.5, 5.5]))
    assert loose.stability.verdict == MECHANISM


def test_an_unstable_equilibrium_is_no_answer():
    """Weight above the attachments of a body that can only roll: descent stays there, and a search goes on to below."""
    free = (False, False, False, True, False, False)
    lines = [cable((x, 0, 5), ("b", (0, 0, 0)), 1e6, 0.1, value=7.0) for x in (-5, 5)]
    scene = suspension([body("b", (0, 0, 0), 4.0, center=(0, 0, 0.5), free=free)], lines)
    state, record = descend(scene.broadcast((1,)), rest.start(scene.broadcast((1,))))
    upright = rest.equilibrium(scene, scene.broadcast((1,)), state, record)
    assert upright.stability.verdict == UNSTABLE
    assert upright.stability.reason() == "unstable: b roll"
    found = rest.pose(scene)
    assert found.stability.verdict == STABLE
    np.testing.assert_allclose(found.rotation[0] @ [0, 0, 0.5], [0, 0, -0.5], atol=1e-9)


def test_what_nothing_holds_is_refused():
    lines = [cable((0, 0, 0), "p", 1e5, value=1.0), cable("q", "r", 1e5, value=1.0)]
    adrift = suspension([], lines, [point(name, (1, 1, 1), 1.0) for name in "pqr"])
    with pytest.raises(NoSolutionError, match="nothing holds q: no cables lead from it to the ground"):
        rest.pose(adrift)


def test_a_cable_that_states_nothing_is_refused():
    lines = [cable((0, 0, 0), "p", 1e5, given=None)]
    with pytest.raises(NoSolutionError, match="c0: states none of unstretched_length, preload, sag, tension_to"):
        rest.pose(suspension([], lines, [point("p", (1, 1, 1), 1.0)]))


def test_ends_in_one_place():
    """A cable that begins where its point starts: the search leaves that place."""
    lines = [cable((0, 0, 0), "p", 1e5, 0.1, value=2.0), cable((3, 0, 0), "p", 1e5, 0.1, value=2.0)]
    found = at_rest(suspension([], lines, [point("p", (0, 0, 0), 4.0)]))
    assert found.position[0, 0] == pytest.approx(1.5, abs=1e-9)


@pytest.mark.parametrize("kind", ["unstretched_length", "preload"])
def test_a_net_of_many_points(kind):
    """192 degrees of freedom, solved by sparse matrices: each point in balance, each cable with what it states."""
    n, spacing = 8, 1.5
    inside = [(i, j) for i in range(1, n + 1) for j in range(1, n + 1)]

    def end(key):
        return f"p{key}" if key in inside else (spacing * key[0], spacing * key[1], 0.02 * key[0] * key[1])

    lines = [
        cable(end(key), end(other), 1e6, 0.05, given=kind, value=spacing * 0.999 if kind != "preload" else 900.0)
        for key in [(i, j) for i in range(n + 2) for j in range(n + 2)]
        for other in [(key[0] + 1, key[1]), (key[0], key[1] + 1)]
        if key in inside or other in inside
    ]
    points = [point(f"p{key}", (spacing * key[0], spacing * key[1], 0.5), 0.2) for key in inside]
    found = at_rest(suspension([], lines, points))
    for index in range(n * n):
        np.testing.assert_allclose(net_force(found, index), 0, atol=1e-7)
    if kind == "preload":
        np.testing.assert_allclose(found.catenary.mean_tension, 900, rtol=1e-9)


# ------------------------------------------------------------------------------------------------------ force densities

CORNERS = [(0, 0, 0.0), (10, 0, 3.0), (10, 10, 0.0), (0, 10, 3.0)]


def net(densities=(1.0, 1.0, 1.0, 1.0)):
    """Four corners, one free point."""
    lines = [cable(c, "p", 1e9, given=None, density=q) for c, q in zip(CORNERS, densities, strict=True)]
    return suspension([], lines, [point("p", (1, 2, 9), force=(0, 0, 6.0))], gravity=0.0)


@pytest.mark.parametrize("dense_freedoms", [100, 0], ids=["dense", "sparse"])
def test_one_point_is_the_weighted_mean_of_its_neighbours(monkeypatch, dense_freedoms):
    """x = (sum q x_k + p)/sum q; weight and dead force both count."""
    monkeypatch.setattr(type(STATICS), "dense_freedoms", dense_freedoms)
    densities, unloaded = np.array([1.0, 2.0, 3.0, 4.0]), net((1.0, 2.0, 3.0, 4.0))
    found, tension = force_density.find_form(replace(unloaded, gravity=np.array(9.81), mass=np.array([0.5])))
    expected = (densities @ np.array(CORNERS) + [0, 0, 6.0 - 0.5 * 9.81]) / 10
    np.testing.assert_allclose(found.position[0], expected, rtol=1e-14)
    np.testing.assert_allclose(tension, densities * np.linalg.norm(np.array(CORNERS) - expected, axis=-1), rtol=1e-13)


def test_the_form_is_in_equilibrium():
    """With the tensions that belong to it each point of the exact model stays where it is; bodies stand."""
    rng = np.random.default_rng(2)
    names = ["p", "q", "r"]
    anchors = rng.normal(size=(5, 3)) * 10
    pairs = [(tuple(anchors[i]), names[i % 3]) for i in range(5)] + [("p", "q"), ("q", "r"), ("r", ("b", (0, 0, 1.0)))]
    lines = [cable(*pair, 1e6, given=None, density=rng.uniform(50, 200)) for pair in pairs]
    held = body("b", (0, 0, 20.0), 1.0, free=(False,) * 6)
    scene = suspension([held], lines, [point(n, (0, 0, 0), 2.0) for n in names])
    found, tension = force_density.find_form(scene)
    exact = rest.pose(with_values(found, "preload", tension))
    assert exact.record.converged
    np.testing.assert_allclose(exact.position, found.position, atol=1e-9)
    np.testing.assert_array_equal(found.position[0], scene.position[0])


def test_forms_of_a_batch():
    densities = np.array([[1.0, 1, 1, 1], [1, 2, 3, 4]])
    found, _ = force_density.find_form(replace(net(), force_density=densities))
    for i in range(2):
        alone, _ = force_density.find_form(net(densities=densities[i]))
        np.testing.assert_array_equal(found.position[i], alone.position)


def test_what_has_no_form():
    with pytest.raises(NoSolutionError, match="no force density of c2"):
        force_density.find_form(net(densities=(1, 1, np.nan, 1)))
    with pytest.raises(NoSolutionError, match="do not hold p"):
        force_density.find_form(net(densities=(1, -1, 1, -1)))
