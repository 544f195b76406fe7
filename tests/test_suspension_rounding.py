"""Ends of searches for an equilibrium, and what rounding leaves of it: `statics/rounding.py`, `statics/uncertainty.py`.

The last digits of sums, and with them the way of a search, depend on the processor, on the axes and on the order of the
cables: what is found, or refused, must not.
"""

from dataclasses import replace

import numpy as np
import pytest
from campaign import campaign
from scenes import scene_of
from suspension_cases import scene_at, scene_from
from suspensions import body, cable, heavy, point, sagging, stacked, suspension, trifilar, turned
from test_suspension_extremes import EXTREMES, platform
from test_suspension_searches import chain

from cablestudy.errors import NoSolutionError
from cablestudy.statics import lengths, rest, rounding, tangent
from cablestudy.statics.descent import CONVERGED, ROUNDED, UNHELD, UNMET
from cablestudy.statics.failure import explain
from cablestudy.statics.pose_state import evaluate
from cablestudy.study.suspension.numbers import distribution_of, numbers_of
from cablestudy.study.suspension.rows import cases_of
from cablestudy.wind.mean import Drag, equilibrium_in_wind


def test_a_heavy_body_turned_and_its_cables_in_any_order():
    one = rest.pose(heavy())
    scenes, turns = zip(*(turned(heavy(), seed) for seed in range(40)), strict=True)
    found = rest.pose(stacked(scenes))
    assert found.record.converged.all()
    assert (found.record.steps < 30).all()  # of 112
    unknown = one.uncertainty.pose[0, :3].max() + found.uncertainty.pose[:, 0, :3].max(axis=-1)
    moved = np.linalg.norm(np.einsum("ni,nij->nj", found.position[:, 0], turns) - one.position[0], axis=-1)
    assert (moved <= unknown).all()


def extreme(name):
    return numbers_of([scene_from(EXTREMES[name])]).take(0)


MANY = {
    "sagging": sagging(),
    "trifilar": trifilar(),
    "twisted": trifilar(stiffness=1e11, line=0.0, moment=(0, 0, 10.0)),
    "slack": suspension([], [cable((x, 0, 0), "p", 1e5, value=5.5) for x in (-5.0, 5.0)], [point("p", (1, 0, 0), 3.0)],
                        gravity=0.0),
    "mechanism": suspension([body("bell", (0, 0, -5), 3.0, center=(0, 0, -0.2))],
                            [cable((0, 0, 0), ("bell", (0, 0, 0)), 1e5, 0.1, value=5.0)]),
    "too little preload": suspension([], [cable((x, 0, 10), "bob", 1e5, given="preload", value=5.0) for x in (-4, 4)],
                                     [point("bob", (0, 0, 8), 2.0)]),
    **{name: extreme(name) for name in EXTREMES},
}  # fmt: skip


TURNS = campaign(4, 2)


@pytest.mark.parametrize("name", MANY)
def test_any_axes_and_any_order_end_alike(name):
    def verdicts(cases):
        found = rest.pose(stacked(cases))
        known = [found.stability.reason(case) == found.uncertainty.reason(case) == "" for case in range(len(cases))]
        return list(zip(found.record.converged, found.stability.verdict, known, strict=True))

    groups = {}
    for one in (MANY[name], *(turned(MANY[name], seed)[0] for seed in range(TURNS))):
        groups.setdefault((one.stated, one.owner.tobytes()), []).append(one)
    found = [verdict for cases in groups.values() for verdict in verdicts(cases)]
    assert found == [found[0]] * (1 + TURNS)


@pytest.mark.parametrize("name", ["fast", "carlina-net", "carlina-balloon", "mast-guys", "net-2x2"])
def test_scenes_of_the_configurations_in_any_axes_end_alike(name):
    scene = scene_at(name)
    numbers = numbers_of([scene])

    def solved(case):
        case = case.broadcast((1,))
        return lengths.solve(case, **distribution_of([scene]))[0] if scene.solve_for == "lengths" else rest.pose(case)

    one = solved(numbers)
    assert one.record.converged
    for seed in range(4):
        other, turn = turned(numbers.take(0), seed, order=False)
        found = solved(other)
        assert found.record.converged
        np.testing.assert_allclose(found.position @ turn, one.position, atol=1e-7)


def fast(**cable):
    """The suspension of configs/suspensions/fast.yaml, with other keys of its cables, and how it chooses tensions."""
    scene = scene_at("fast", *(f"cable.{key}={value}" for key, value in cable.items()))
    return numbers_of([scene]), distribution_of([scene])


def test_a_search_for_lengths_ends_where_rounding_ends_it():
    """Net forces no larger than the rounding of their sums, in any axes: no tolerance decides."""
    one, limits = fast()
    where = stacked([turned(one.take(0), seed, order=False)[0] for seed in range(40)])
    found, problems = lengths.solve(where, **limits)
    assert (found.record.reason == CONVERGED).all()
    assert (problems == "").all()
    assert (found.record.steps < 8).all()
    cables, tension = found.catenary, found.catenary.max_tension
    strain = np.asarray(cables.span.chord_strain)
    limit = rounding.bounds(where, found.rotation, found.arms, found.ends, strain, cables, tension).least
    net, _ = tangent.net_forces(where, found.rotation, found.arms, found.end_forces, tension)
    assert (rounding.largest_ratio(where, net, limit) <= 1.5).all()


def test_a_search_for_lengths_that_comes_no_closer_to_its_bounds_ends():
    """Cables of 300 t/m3 weigh 0.9 MN and more each: they need more than 1.3 MN where 1.2 MN are allowed."""
    one, limits = fast(density=300_000)
    found, problems = lengths.solve(one, **limits)
    assert found.record.reason == [UNHELD]
    assert problems[0].startswith("no tensions in [0.12, 1.2] MN hold cabin here; nearest: c")
    assert found.record.steps < 12  # of 40


def windy(one):
    """Mean wind of 30 m/s on all cables and bodies of a suspension."""
    count, bodies = len(one.cable_names), len(one.body_names)
    return Drag(np.array([[30.0, 0.0, 0.0]]), np.array([1.2]), np.full((1, count), 1.2 * 0.05),
                np.full((1, bodies, 3), 20.0), np.zeros((1, bodies, 3)))  # fmt: skip


@pytest.mark.parametrize("name", campaign(["fast", "cogiro", "trifilar", "mast-guys"], ["fast", "trifilar"]))
def test_the_mean_wind_in_any_axes_ends_where_rounding_ends_it(name):
    """Also where rounding moves a body by more than 1e-12 of the longest cable: trifilar."""
    scene = scene_at(name)
    numbers, places = numbers_of([scene]), []
    limits = distribution_of([scene]) if scene.solve_for == "lengths" else None
    for seed in range(4):
        other, turn = turned(numbers.take(0), seed, order=False)
        other = other.broadcast((1,))
        calm = rest.pose(other) if limits is None else lengths.solve(other, **limits)[0]
        drag = replace(windy(other), velocity=np.array([[30.0, 0.0, 0.0]]) @ turn.T)
        found = equilibrium_in_wind(calm, drag)
        assert found.record.converged
        places.append(found.position[0] @ turn)
    np.testing.assert_allclose(places[1:], [places[0]] * 3, atol=1e-7)


# ------------------------------------------------------------------------------------------------- where they end


def test_what_is_left_is_within_its_bounds():
    """Newton's steps end far below what rounding of the lengths does to the forces, also of stiff cables."""
    for stiffness in (1e5, 1e12):
        found = rest.pose(trifilar(stiffness=stiffness, line=0.1))
        assert found.record.reason in (CONVERGED, ROUNDED)
        flat = found.suspension.broadcast((1,))
        state = replace(rest.start(flat), position=found.position[None], rotation=found.rotation[None])
        limits = evaluate(flat, state)
        assert (limits.least_rounding <= limits.most_rounding).all()
    # EA/T is 6e9: the rounding of lengths changes forces by more than 1e-7 of the weight, that of sums by 1e-14
    weight = 50 * 9.81
    assert limits.most_rounding[0, 0, 2] > 1e-7 * weight
    assert limits.least_rounding[0, 0, 2] < 1e-11 * weight
    net = found.end_forces[:, 1].sum(axis=0) - [0, 0, weight]
    np.testing.assert_allclose(net, 0, atol=1e-11 * weight)


def test_the_rounding_of_the_energy_is_known():
    """Energies of one state, with the cables in any order, differ by no more: of cables 160 times as long too."""
    scene = heavy().broadcast((1,))
    state = rest.start(scene)
    state = replace(state, position=state.position - [0.0, 0.0, 3940.0])
    ends = scene.ends(state.position, state.rotation)
    vector = ends[..., 1, :] - ends[..., 0, :]
    state = replace(state, vector=vector, strain=np.linalg.norm(vector, axis=-1) / state.length - 1)
    points = []
    for seed in range(20):
        moved = np.random.default_rng(seed).normal(size=3) * 1e-12  # nothing but other last digits
        vector = state.vector + moved
        points.append(evaluate(scene, replace(state, vector=vector)))
    energies = np.array([point.energy[0] for point in points])
    assert np.ptp(energies) <= 2 * points[0].energy_rounding[0]
    assert points[0].energy_rounding[0] < 1e-13 * abs(energies[0])


def test_a_body_that_is_too_heavy_for_its_preload_is_refused_in_few_steps():
    data = platform(mass=1e9, count=3)
    for one in data["cables"].values():
        del one["unstretched_length"]
        one["preload"] = 1000.0
    found = rest.pose(numbers_of([scene_from(data)]).take(0))
    assert found.record.reason == UNMET
    assert found.record.steps < 60
    assert np.abs(found.position).max() < 1e6  # EA is 1e-4 of its weight, but the search has not wandered off
    assert "instead of 1000 N" in explain(found)


# ------------------------------------------------------------------------------------- how well it is determined


JUNCTION = """\
gravity: {gravity}
cable: {{axial_stiffness: {stiffness} N, mass_per_length: 50 kg/m, diameter: 0.1 m}}
points: {{a: {{at: [{at} m, 0, 5 m], free: true}}, b: {{at: [{at} m, 0, 0], free: true}}}}
cables:
  u1: {{from: [0, 0, 5 m], to: a, preload: 2200 kN}}
  u2: {{from: a, to: [72 m, 0, 5 m], preload: 2200 kN}}
  l1: {{from: [0, 0, 0], to: b, preload: 2200 kN}}
  l2: {{from: b, to: [72 m, 0, 0], preload: 2200 kN}}
  tie: {{from: a, to: b, preload: 1 N, mass_per_length: 1e-6 kg/m}}
"""


def junctions(gravity, stiffness):
    """Three cases, solved together, that begin in different places."""
    return cases_of([scene_of(JUNCTION.format(gravity=gravity, stiffness=stiffness, at=at)) for at in (10, 24, 50)])


WEIGHTS = [(9.81, 1e8), (9.81, 1e12), (1.0, 1e10), (0.01, 1e8)]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("gravity", "stiffness"), campaign(WEIGHTS, [WEIGHTS[1], WEIGHTS[3]]))
def test_a_place_that_weight_alone_determines_has_its_error_stated(gravity, stiffness):
    """By symmetry the junctions are in the middle."""
    for case in junctions(gravity, stiffness):
        for name in "ab":
            value, error = case.coordinate(name, 0)
            assert abs(value / 36 - 1) <= error
            assert error < 1e-3
            assert error > 1e-12 / gravity**2  # w^2/(24 T) is the stiffness of this motion


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("gravity", "stiffness"), [(1e-3, 1e8), (1e-6, 1e12), (0, 1e10)])
def test_a_place_that_nothing_determines_is_refused(gravity, stiffness):
    for case in junctions(gravity, stiffness):
        with pytest.raises(NoSolutionError, match=r"nothing determines [ab] x: .*state an unstretched_length"):
            case.coordinate("a", 0)


def test_a_load_on_a_plumb_line_whose_tension_is_its_weight_may_be_anywhere():
    """With its tension stated at the load, any length will do; with the mean one only that of its own weight."""
    line, load = 0.5, 20.0
    hung = suspension(
        [], [cable((0, 0, 0), "bob", 1e6, line, given="tension_to", value=load * 9.81)],
        [point("bob", (0.5, 0, -10), load)],
    )  # fmt: skip
    assert rest.pose(hung).uncertainty.reason().startswith("nothing determines bob z")
    mean = rest.pose(replace(hung, stated=("preload",), value=np.array([(load + line * 10 / 2) * 9.81])))
    assert mean.uncertainty.reason() == ""
    assert mean.position[0, 2] == pytest.approx(-10, abs=0.01)


def test_the_tension_between_two_stiff_cables_has_the_error_of_their_lengths():
    """Of two collinear cables to a point the tension changes by EA (e_1 + e_2)/2 with their strains; T is EA 1e-9."""
    strain, stiffness = 1e-9, 1e12
    lines = [cable((x, 0, 0), "p", stiffness, value=5.0 / (1 + strain)) for x in (-5.0, 5.0)]
    found = rest.pose(suspension([], lines, [point("p", (0.001, 0, 0), 1e-9)], gravity=0.0))
    known = 2 * 2.0**-52 * 2 / np.sqrt(2)  # of a length, and of the anchor that is as far away
    assert found.uncertainty.tension == pytest.approx([known / strain] * 2, rel=0.5)
    np.testing.assert_allclose(found.catenary.mean_tension, stiffness * strain, rtol=3 * known / strain)


def test_many_points_are_judged_as_few():
    """By sparse matrices, of a chain whose middle is a hundred times better known than by the sum of all bounds."""
    sparse = rest.pose(chain(40, lambda x: np.stack([x, 0 * x, 0 * x - 1], axis=-1), 0.01, 1e6))
    assert sparse.suspension.free.sum() > 100
    whole = sparse.uncertainty.pose[:, :3]
    assert (whole > 0).all()
    assert whole.max() < 1e-9
    assert whole.max() > 2.0**-52
