"""Lengths from tensions (`statics/lengths.py`, `tension_distribution.py`), and what cables state (`stated.py`)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from command import CONFIGS
from scipy.optimize import minimize
from suspensions import body, cable, point, sagging, suspension, with_values

from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span
from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import load_scene
from cablestudy.statics import lengths, rest, stated
from cablestudy.statics.fitted_lengths import fit_strains
from cablestudy.statics.tension_distribution import distribute
from cablestudy.statics.tolerances import STATICS
from cablestudy.study.suspension.group import Group


def robot(cables=8, mass=40.0, line=0.05):
    """A body on cables from the corners of a box: tensions from 210 to 790 N hold it in its place."""
    anchors = np.array([(x, y, z) for x in (-8.0, 8.0) for y in (-6.0, 6.0) for z in (-5.0, 6.0)])
    places = np.random.default_rng(27).uniform(-0.7, 0.7, (8, 3))
    lines = [cable(tuple(a), ("b", tuple(p)), 1e6, line, given=None) for a, p in zip(anchors, places, strict=True)]
    return suspension([body("b", (0.3, -0.2, 0.5), mass, center=(0.02, 0.01, -0.1))], lines[:cables])


def straight_wrenches(scene):
    """Unit wrenches of weightless cables at the body's place, shape (6, c), and the load that they balance."""
    ends = scene.ends(scene.position, scene.rotation)
    arms = ends[:, 1] - scene.position[0]
    units = ends[:, 0] - ends[:, 1]
    units /= np.linalg.norm(units, axis=-1)[:, None]
    weight = np.array([0, 0, -9.81 * scene.mass[0]])
    load = np.concatenate([weight, np.cross(scene.center[0], weight)])
    return np.concatenate([units, np.cross(arms, units)], axis=-1).T, -load


def least_squares(matrix, load, objective, low, high):
    """The same convex problem by a general solver (SLSQP), from scipy."""
    count = matrix.shape[1]
    unit = np.abs(load).max()
    start = np.linalg.lstsq(matrix, load / unit, rcond=None)[0]
    found = minimize(
        lambda t: objective(t), start, method="SLSQP", bounds=[(low / unit, high / unit)] * count,
        constraints={"type": "eq", "fun": lambda t: matrix @ t - load / unit}, options={"ftol": 1e-15, "maxiter": 500},
    )  # fmt: skip
    assert found.success
    return found.x * unit


@pytest.mark.crossed
@pytest.mark.parametrize("method", ["balanced", "least", "closest"])
@pytest.mark.parametrize(("low", "high"), [(100.0, np.inf), (200.0, 800.0)])
def test_weightless_cables_against_a_general_solver(method, low, high):
    """Cables without weight pull along straight lines: one linear problem, whatever the lengths."""
    scene = robot(line=0.0)
    matrix, load = straight_wrenches(scene)
    unit = np.abs(load).max()
    objective = {
        "balanced": lambda t: ((t - t.mean()) ** 2).sum(),
        "least": lambda t: (t**2).sum(),
        "closest": lambda t: ((t - 450 / unit) ** 2).sum(),
    }[method]
    expected = least_squares(matrix, load, objective, low, high)
    found, problems = lengths.solve(scene, method, low, high, reference=450.0)
    assert problems == ""
    assert found.record.converged
    tension = found.catenary.mean_tension
    np.testing.assert_allclose(matrix @ tension, load, atol=1e-8 * unit)
    assert tension.min() > low * (1 - 1e-9)
    np.testing.assert_allclose(tension, expected, rtol=2e-5)


def test_balanced_tensions_are_the_least_squares_that_the_documentation_states():
    """Squared deviations and 1e-8 of the squares, in balance with the weight: linear equations with multipliers."""
    scene = robot(line=1e-12)
    units, load = straight_wrenches(scene)
    hessian = np.eye(8) * (1 + 1e-8) - 1 / 8
    equations = np.block([[hessian, units.T], [units, np.zeros((6, 6))]])
    found, problems = lengths.solve(scene, "balanced")
    assert problems == ""
    tension = np.linalg.solve(equations, np.append(np.zeros(8), load))[:8]
    np.testing.assert_allclose(found.catenary.mean_tension, tension, rtol=1e-10)


def test_sagging_cables_hold_the_body_where_it_stands():
    """The pose of the lengths that were found is the pose that was asked for, and the equilibrium of `pose`."""
    scene = robot(line=0.8)
    found, problems = lengths.solve(scene, "least", low=200.0)
    assert problems == ""
    np.testing.assert_array_equal(found.position, scene.position)
    assert found.stability.stable
    again = rest.pose(with_values(scene, "unstretched_length", found.lengths))
    np.testing.assert_allclose(again.position, scene.position, atol=1e-8)
    np.testing.assert_allclose(again.catenary.mean_tension, found.catenary.mean_tension, rtol=1e-7)


def test_as_many_cables_as_equations():
    """Two of the eight cables with given tensions: those of the others are the solution of a linear system."""
    scene = robot(line=0.0)
    matrix, load = straight_wrenches(scene)
    whole, _ = lengths.solve(scene, "least", low=220.0, high=780.0)
    tension = whole.catenary.mean_tension
    given, value = ("preload", "preload", *[None] * 6), np.where(np.arange(8) < 2, tension + 3.0, np.nan)
    expected = np.linalg.solve(matrix[:, 2:], load - matrix[:, :2] @ value[:2])
    found, problems = lengths.solve(replace(scene, stated=given, value=value))
    assert problems == ""
    np.testing.assert_allclose(found.catenary.mean_tension, [*value[:2], *expected], rtol=1e-8)


def test_what_is_stated_is_kept():
    scene = robot()
    whole, _ = lengths.solve(scene, "least", low=220.0)
    given, value = list(scene.stated), scene.value.copy()
    given[2], value[2] = "preload", whole.catenary.mean_tension[2] + 5.0
    given[5], value[5] = "unstretched_length", whole.lengths[5] * (1 - 1e-6)
    found, problems = lengths.solve(replace(scene, stated=tuple(given), value=value), low=100.0)
    assert problems == ""
    assert found.catenary.mean_tension[2] == pytest.approx(value[2], rel=1e-9)
    assert found.lengths[5] == pytest.approx(value[5], rel=1e-12)


def test_the_nearest_tensions_are_named():
    """Two vertical cables share a weight half and half: 245 N each, whatever the bounds."""
    lines = [cable((x, 0, 5), ("beam", (x, 0, 0)), 1e6, given=None) for x in (-1.0, 1.0)]
    free = (False, False, True, False, True, False)
    scene = suspension([body("beam", (0, 0, 0), 50.0, free=free)], lines)
    found, problems = lengths.solve(scene, low=300.0, high=1200.0)
    assert problems == "no tensions in [300, 1200] N hold beam here; nearest: c0 at 245.2 N, c1 at 245.2 N"
    assert not found.record.converged
    found, problems = lengths.solve(scene, low=100.0, high=1200.0)
    assert problems == ""
    np.testing.assert_allclose(found.catenary.mean_tension, 50 * 9.81 / 2, rtol=1e-10)


def test_loads_that_no_cable_can_hold():
    """Vertical cables hold no force along x."""
    lines = [cable((x, y, 5), ("b", (x, y, 0)), 1e6, given=None) for x, y in ((1, 0), (-1, 1), (-1, -1))]
    lines += [cable((x, -y, 5), ("b", (x, -y, 0)), 1e6, given=None) for x, y in ((1, 0.5), (-0.5, 1), (-1, -0.2))]
    scene = suspension([body("b", (0, 0, 0), 50.0, force=(30.0, 0, 0))], lines)
    _, problems = lengths.solve(scene)
    assert problems == "no tensions hold b here: nothing balances b along x"


@pytest.mark.parametrize("lift", [0.0, 600.0])
def test_cables_that_end_below_a_body_do_not_carry_it(lift):
    """Three anchors 10 m below the body: with 50 kg it needs lift, with which the cables balance 600 - 490.5 N."""
    anchors = [(20, 0, 0), (-10, 17, 0), (-10, -17, 0)]
    lines = [cable(anchor, ("b", (0.0, 0.0, 0.0)), 1e6, mass=0.0, given=None) for anchor in anchors]
    free = (True, True, True, False, False, False)
    scene = suspension([body("b", (0, 0, 10.0), 50.0, force=(0.0, 0.0, lift), free=free)], lines)
    found, problems = lengths.solve(scene)
    if lift:
        assert problems == ""
        assert found.end_forces[:, 1, 2].sum() == pytest.approx(50 * 9.81 - lift, rel=1e-9)
    else:
        assert problems == "no lengths hold b here: all its cables pull down, and nothing lifts it"


def test_equations_and_unknowns_are_counted():
    scene = suspension(
        [body("b", (0, 0, 0), 5.0)],
        [
            cable((1, 0, 5), ("b", (0.1, 0, 0)), 1e6, given=None),
            cable((-1, 0, 5), ("b", (-0.1, 0, 0)), 1e6, given=None),
        ],
    )
    with pytest.raises(NoSolutionError, match=r"6 equations of balance for 5 unknowns \(2 lengths and 3 degrees"):
        lengths.solve(scene)


def test_three_cables_are_a_pendulum():
    """Fewer lengths than equations: the attitude follows. The center of mass hangs so that all moments vanish."""
    angles = np.deg2rad([0, 120, 240])
    anchors = np.stack([4 * np.cos(angles), 4 * np.sin(angles), np.full(3, 6.0)], axis=-1)
    places = 0.6 * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=-1)
    lines = [cable(tuple(a), ("b", tuple(p)), 1e6, 0.02, given=None) for a, p in zip(anchors, places, strict=True)]
    scene = suspension([body("b", (0.4, 0.2, 0.0), 30.0, center=(0, 0, -0.3))], lines)
    found, problems = lengths.solve(scene)
    assert problems == ""
    np.testing.assert_array_equal(found.position, scene.position)
    moment = np.cross(found.arms[:, 1], found.end_forces[:, 1]).sum(axis=0)
    center = found.rotation[0] @ scene.center[0]
    np.testing.assert_allclose(moment + np.cross(center, [0, 0, -30 * 9.81]), 0, atol=1e-8)
    assert found.stability.stable
    assert np.abs(found.rotation[0] - np.eye(3)).max() > 1e-3


def test_a_free_attitude_follows_from_balanced_tensions():
    """No attitude nearby has better balanced tensions, those of attitudes held at small turns either way."""
    scene = robot(line=0.02)
    attitude = np.zeros((1, 6), dtype=bool)
    attitude[0, 3:] = True
    best, problems = lengths.solve(scene, "balanced", low=50.0, moving=attitude)
    assert problems == ""
    variance = best.catenary.mean_tension.var()
    from cablestudy.statics.rigid import turn

    worse = []
    for axis in range(3):
        for angle in (-0.03, 0.03):
            rotation = best.rotation + turn(angle * np.eye(3)[axis]) @ best.rotation
            held, problems = lengths.solve(replace(scene, rotation=rotation), "balanced", low=50.0)
            if problems == "":
                worse.append(held.catenary.mean_tension.var() > variance)
            else:  # a tension of the best attitude is on its bound: turned one way it would be below
                assert "no tensions of 50 N and more hold b here" in str(problems)
    assert len(worse) >= 3
    assert all(worse)


def test_junctions_find_their_places():
    """A bridle: its junction goes where three of its cables, two with given lengths, balance."""
    lines = [
        cable((5, 0, 6), "knot", 1e6, 0.05, given=None), cable("knot", ("b", (0.3, 0, 0.2)), 1e6, 0.05, value=2.0),
        cable("knot", ("b", (-0.3, 0, 0.2)), 1e6, 0.05, value=2.0),
        cable((-5, 0, 6), ("b", (-0.3, 0, 0.2)), 1e6, 0.05, given=None),
    ]  # fmt: skip
    free = (True, False, True, False, False, False)
    scene = suspension([body("b", (0, 0, 0), 20.0, free=free)], lines, [point("knot", (1.5, 0, 2), 1.0)])
    found, problems = lengths.solve(scene)
    assert problems == ""
    on = found.suspension.owner == 1
    np.testing.assert_allclose(found.end_forces[on].sum(axis=0), [0, 0, 9.81], atol=1e-8)
    np.testing.assert_allclose(found.lengths[1:3], 2.0, rtol=1e-12)


def hung_point(**other):
    """A point of 20 kg between two anchors at 100 m, on weightless cables that state nothing."""
    lines = [cable((0, 0, 0), "k", 1e6, given=None), cable("k", (100, 0, 0), 1e6, given=None)]
    return replace(suspension([], lines, [point("k", (40, 0, -2), 20.0)]), **other)


@pytest.mark.parametrize(
    ("method", "wanted"), [("balanced", {"low": 120.0}), ("least", {"low": 120.0}), ("closest", {"reference": 120.0})]
)
def test_points_alone_follow_the_tensions_that_the_method_wants(method, wanted):
    """Two tensions T hold a weight P in the middle, at angles of sin a = P/(2 T) below the level."""
    found, problems = lengths.solve(hung_point(), method, **wanted)
    assert problems == ""
    assert found.stability.stable
    angle = np.arcsin(20 * 9.81 / 2 / 120)
    np.testing.assert_allclose(found.position[0], [50, 0, -50 * np.tan(angle)], atol=1e-7)
    np.testing.assert_allclose(found.lengths, 50 / np.cos(angle) / (1 + 120 / 1e6), rtol=1e-9)


def test_points_alone_in_a_batch_and_tensions_that_no_place_has():
    """The tension of two cables at 98 N is less than half of the weight: of that case alone there is no answer."""
    references = np.array([[120.0, 120.0], [98.0, 98.0], [400.0, 400.0]])
    found, problems = lengths.solve(hung_point(mass=np.full((3, 1), 20.0)), "closest", reference=references)
    assert problems[[0, 2]].tolist() == ["", ""]
    assert "no lengths were found" in problems[1]
    angles = np.arcsin(20 * 9.81 / 2 / references[[0, 2], 0])
    np.testing.assert_allclose(found.position[[0, 2], 0, 2], -50 * np.tan(angles), rtol=1e-9)


@pytest.mark.parametrize("method", ["balanced", "least"])
def test_points_alone_without_a_wanted_tension_are_refused(method):
    with pytest.raises(NoSolutionError, match=r"decides the tensions of c0, c1: .* state tensions.min"):
        lengths.solve(hung_point(), method, high=5000.0)


def test_two_weightless_cables_in_line_have_the_tension_that_something_decides():
    """Without load and weight any equal tensions are in balance: those of the bounds, the reference, or none."""
    lines = [cable((-5, 0, 0), "b", 1e6, given=None), cable("b", (5, 0, 0), 1e6, given=None)]
    along = (True, False, False, False, False, False)
    scene = suspension([body("b", (0, 0, 0), 2.0, free=along)], lines)
    low = np.array([[0.0, 0.0], [70.0, 70.0]])
    found, problems = lengths.solve(replace(scene, mass=np.full((2, 1), 2.0)), "balanced", low=low)
    assert problems[0].startswith(
        "nothing decides the tensions of c0, c1: nothing pulls at them, and they weigh nothing"
    )
    assert problems[1] == ""
    np.testing.assert_allclose(found.lengths[1], 5 / (1 + 70 / 1e6), rtol=1e-14)
    nearest, problem = lengths.solve(scene, "closest", reference=30.0)
    assert problem == ""
    np.testing.assert_allclose(nearest.lengths, 5 / (1 + 30 / 1e6), rtol=1e-14)
    pulled, problem = lengths.solve(replace(scene, force=np.array([[20.0, 0, 0]])), "least")
    assert problem == ""
    np.testing.assert_allclose(pulled.lengths[0], 5 / (1 + 20 / 1e6), rtol=1e-9)


def test_the_smallest_of_equally_balanced_tensions():
    """Two equal cables against each other, without load: all tensions are balanced, the least is that of the bound."""
    matrix = np.array([[[1.0, -1.0]]])
    none = np.zeros((1, 1, 0))
    bounds = np.full((1, 2), 70.0), np.full((1, 2), np.inf)
    found = distribute(
        matrix, none, np.zeros((1, 1)), "balanced", np.zeros((1, 2)), *bounds, np.zeros(1), np.ones((1, 2))
    )
    np.testing.assert_allclose(found.tension, [[70, 70]], rtol=1e-9)


def least_by_enumeration(matrix, right, target, low, high):
    """Tensions t with A t = b and bounds, nearest to a target: the best of all choices of the tensions at a bound."""
    best, count = None, len(low)
    for choice in product((None, low, high), repeat=count):
        held = np.array([bound is not None for bound in choice])
        t = np.array([target[k] if bound is None else bound[k] for k, bound in enumerate(choice)])
        if not np.isfinite(t).all():
            continue
        free = matrix[:, ~held]  # of those that are free the nearest ones to their targets that balance the rest
        t[~held] += np.linalg.pinv(free) @ (right - matrix @ t)
        balanced = np.abs(matrix @ t - right).max() < 1e-9 * np.abs(right).max()
        within = (t >= low - 1e-9).all() and (t <= high + 1e-9).all()
        if balanced and within and (best is None or ((t - target) ** 2).sum() < ((best - target) ** 2).sum()):
            best = t
    return best


def test_distributions_of_many_cases_against_all_choices_of_active_bounds():
    """Some with a bound that holds, some that no tensions within the bounds balance; each the same as alone."""
    rng, cases, cables = np.random.default_rng(5), 60, 4
    matrix, reference = rng.normal(size=(cases, 2, cables)), rng.uniform(0, 100, (cases, cables))
    right = (matrix @ rng.uniform(5, 90, (cases, cables, 1)))[..., 0]
    low, high = np.full((cases, cables), 20.0), np.where(rng.random((cases, cables)) < 0.5, 60.0, np.inf)
    none, damping, current = np.zeros((cases, 2, 0)), np.zeros(cases), np.ones((cases, cables))
    for method, target in (("least", 0 * reference), ("closest", reference)):
        arguments = matrix, none, right, method, reference, low, high, damping, current
        found = distribute(*arguments)
        assert found.held.all()
        at_bounds = 0
        for case in range(cases):
            expected = least_by_enumeration(matrix[case], right[case], target[case], low[case], high[case])
            assert found.within[case] == (expected is not None)
            if expected is not None:
                np.testing.assert_allclose(found.tension[case], expected, rtol=1e-8)
                at_bounds += bool((np.isclose(expected, low[case]) | np.isclose(expected, high[case])).any())
            one = [part if isinstance(part, str) else part[case : case + 1] for part in arguments]
            assert np.array_equal(distribute(*one).tension[0], found.tension[case])
        assert at_bounds > 10
        assert 0 < np.count_nonzero(found.within) < cases


@pytest.mark.crossed
@pytest.mark.parametrize("strain", [3e-4, -0.01, -0.3])
@pytest.mark.parametrize("kind", [*stated.FORCES, "sag"])
def test_rates_by_differences(kind, strain):
    """What a cable states and its end forces, by its length and by its end, against central differences."""
    end = np.array([30.0, 12.0, 9.0])
    length = np.linalg.norm(end) / (1 + strain)

    def at(place, unstretched):
        return solve(Span.between(np.zeros(3), place[None], 1e6, 0.7, 9.81, np.array([unstretched])))

    def value(cables):
        return stated.actual_values(cables, (kind,))[0]

    rates = stated.rates(at(end, length), (kind,))
    step = 1e-6
    up, down = at(end, length * (1 + step)), at(end, length * (1 - step))
    assert rates.by_length[0] == pytest.approx((value(up) - value(down)) / (2 * step), rel=1e-5)
    forces = (up.end_forces("global") - down.end_forces("global"))[0] / (2 * step)
    np.testing.assert_allclose(rates.end_forces[0], forces, rtol=1e-5, atol=1e-5 * np.abs(forces).max())
    for axis in range(3):
        move = 1e-5 * np.eye(3)[axis]
        difference = (value(at(end + move, length)) - value(at(end - move, length))) / 2e-5
        scale = np.abs(rates.by_end[0]).max()
        assert rates.by_end[0, axis] == pytest.approx(difference, rel=1e-5, abs=2e-5 * scale)


def test_lengths_that_are_fitted():
    """Of taut, slack and very stiff cables: each has what it states."""
    scene = sagging()
    ends = scene.ends(scene.position, scene.rotation)
    tensions = {"preload": 300.0, "tension_to": 450.0, "tension_from": 450.0, "horizontal_tension": 200.0}
    for kind, wanted in {**tensions, "max_tension": 450.0, "sag": 0.2}.items():
        value = np.full(10, wanted)
        span = Span.between(ends[:, 0], ends[:, 1], np.geomspace(1e4, 1e10, 10), 0.4)
        strain, error, _ = fit_strains(span, (kind,) * 10, value, np.full(10, -0.01))
        assert np.abs(error).max() < 1e-9
        np.testing.assert_allclose(
            stated.actual_values(solve(span.with_chord_strain(strain)), (kind,) * 10), wanted, rtol=1e-9
        )


def test_cables_whose_own_weight_needs_more_than_is_allowed_end_the_search_at_once(monkeypatch):
    """A level cable that does not stretch has 0.508 of the weight of its chord at least: more than max, soon seen."""
    searched, search = [], lengths.search
    monkeypatch.setattr(lengths, "search", lambda *given: searched.append(search(*given)) or searched[-1])
    _, scene = load_scene(CONFIGS / "suspensions" / "fast.yaml", ["cable.density=1.2e6"])
    reason = Group([scene]).failure(0)
    assert "by its own weight at least" in str(reason)
    assert len(searched) == 1  # other least tensions are not tried
    assert searched[0].record.steps <= STATICS.infeasible_steps
