"""Coordinates that no output depends on, and few modes of few cables: against dense solutions, and many modes."""

from itertools import pairwise, product

import numpy as np
import pytest
from references import dense
from scipy.linalg import eigh
from straight_scenes import with_changes
from suspension_cases import case_of, response_with

from cablestudy.motion.gust_response import GustResponse
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.connected import component_numbers, connected, joined_states, observed
from cablestudy.system.linear import LinearSystem
from cablestudy.system.reduced import ReducedSystem
from cablestudy.system.residues import eigen

DAMPING = {
    "modal": {"model": "modal", "ratio": 0.01, "viscous": 0.01},
    "hysteretic": {"model": "hysteretic", "loss_factor": 0.03, "viscous": 0.01},
    "kelvin_voigt": {"model": "kelvin_voigt", "time": 2e-3, "viscous": 0.01},
}
each_damping = pytest.mark.parametrize("damping", DAMPING)


@pytest.mark.parametrize("entries", [float, complex])
def test_states_that_do_not_depend_on_each_other_are_solved_apart(entries):
    """Two blocks of a matrix, in mixed order, joined by entries that are rounding; and one in a chain."""
    draw = np.random.default_rng(5)
    order, whole = draw.permutation(9), 1e-18 * draw.normal(size=(9, 9)).astype(entries)
    for block in (order[:5], order[5:]):
        whole[np.ix_(block, block)] = draw.normal(size=(len(block),) * 2) * np.ones(1, dtype=entries)
    number = component_numbers(joined_states(whole[None]))[0]
    assert len(set(number[order[:5]])) == len(set(number[order[5:]])) == 1
    assert set(number) == {0, 1}
    found = eigen(whole)
    assert (found.right * found.values) @ found.left == pytest.approx(whole, abs=1e-13)
    assert found.left @ found.right == pytest.approx(np.eye(9), abs=1e-12)
    assert found.one_sided == (entries is complex)
    assert not component_numbers(joined_states((np.diag([1.0, 1.0], 1) + np.eye(3))[None])).any()


def one_cable(damping, **changes):
    """A body free along x on one sagging, inclined cable in the plane of x and z, with its winch."""
    text = {
        "cable": {"elastic_modulus": 70e9, "density": 1440.0, "area": 6e-6, "damping": DAMPING[damping]},
        "bodies": {"gondola": {
            "at": [0.0, 0.0, 0.0], "mass": 50.0, "free": ["x"], "force": [1300.0, 0.0, 0.0],
            "attachments": {"eye": [0.0, 0.0, 0.0]}, "wind": {"area": 0.6, "drag_coefficient": 1.17},
        }},
        "cables": {"cable": {"from": [-150.0, 0.0, 40.0], "to": "gondola.eye", "unstretched_length": 155.0}},
        "winches": {"cable": {}},
        "control": {"gain": 0.05, "notch": {"frequency": "static"}},
        "wind": {"speed": 6.0, "turbulence_intensity": 0.15, "length_scale": 25.0, "on": "bodies"},
        "model": {"accuracy": 1e-4},
    }  # fmt: skip
    return with_changes(text, **changes)


# ------------------------------------------------------------------------------------------------- what is connected


@pytest.mark.parametrize("part", range(3))
@pytest.mark.parametrize(("size", "reached"), [(0.0, 2), (1e-14, 2), (1e-9, 4)])
def test_coordinates_are_connected_by_what_is_more_than_rounding(part, size, reached):
    """Two pairs, coupled by mass, damping or stiffness of a size over the geometric mean of their own."""
    scale = np.array([1.0, 1e3, 1e-4, 10.0])
    matrices = [np.diag(scale), 0.1 * np.diag(scale), np.diag(1e4 * scale)]
    for matrix in matrices:
        for i, j in ((0, 2), (1, 3)):
            matrix[i, j] = matrix[j, i] = 0.1 * np.sqrt(matrix[i, i] * matrix[j, j])
    critical = np.sqrt(np.diagonal(matrices[0]) * np.diagonal(matrices[2]))
    own = critical if part == 1 else np.diagonal(matrices[part])
    matrices[part][2, 1] = matrices[part][1, 2] = size * np.sqrt(own[1] * own[2])
    found = connected(*matrices, np.array([True, False, False, False]))
    assert found.sum() == reached
    assert found[[0, 2]].all()


def test_a_complex_stiffness_and_a_rate_that_is_seen_connect():
    mass, none = np.eye(3), np.zeros((3, 3))
    stiffness = np.diag([1.0, 4.0, 9.0]).astype(complex)
    stiffness[0, 1] = stiffness[1, 0] = 1e-6j
    moved = np.array([[1.0, 0.0, 0.0]])
    system = LinearSystem(mass, none, stiffness, c=(moved, 0 * moved, 0 * moved))
    assert observed(system).tolist() == [True, True, False]
    rate = np.array([[0.0, 0.0, 1e-3]])
    assert observed(LinearSystem(mass, none, stiffness, c=(moved, rate, 0 * moved))).all()


def test_modes_beside_coordinates_that_move_no_body_are_those_of_the_whole():
    """Frequencies and shapes against a general eigen-solution, coordinates that move nothing among the others."""
    rng = np.random.default_rng(3)
    omega, coupling = np.sort(rng.uniform(1, 50, 30)), rng.normal(size=(30, 2))
    coupling[[0, 4, 5, 17, 29]] *= 1e-15
    inertia = coupling.T @ coupling + np.array([[20.0, 1.0], [1.0, 5.0]])
    system = ReducedSystem(omega, coupling, inertia, np.array([[300.0, 20.0], [20.0, 80.0]]))
    mass, stiffness = np.eye(32), np.diag([*omega**2, 0.0, 0.0])
    mass[:30, 30:], mass[30:, :30], mass[30:, 30:] = coupling, coupling.T, inertia
    stiffness[30:, 30:] = system.stiffness
    square, vectors = eigh(stiffness, mass)
    for count in (1, 7, 32, 40):
        found, shapes = system.lowest(count)
        assert found == pytest.approx(np.sqrt(square[:count]), rel=1e-10)
        assert np.abs(shapes.T @ mass @ shapes - np.eye(len(found))).max() < 1e-9
        assert np.abs(vectors.T @ mass @ shapes)[: len(found)] == pytest.approx(np.eye(len(found)), abs=1e-6)
    alone = system.lowest(32)[1][[0, 4, 5, 17, 29]]
    assert set(np.count_nonzero(alone, axis=1)) == {1}


# --------------------------------------------------------------------------------------- the model of loop and wind


@each_damping
def test_modes_that_no_output_depends_on_change_nothing(damping):
    """Poles and responses of the model without them, and of all modes by dense matrices of its own."""
    case = case_of(one_cable(damping))
    some = case.analysis.closed_loop_of(40)
    every = some.with_all_modes
    assert len(some.plant.kept) < 0.6 * len(some.modes)
    assert len(every.plant.kept) == len(every.modes) == len(some.modes) == 40
    own, poles = (dense.poles(one.motion.mass, one.motion.damping, one.motion.stiffness) for one in (some, every))
    assert np.abs(own[:, None] - poles).min(axis=1) == pytest.approx(0.0, abs=1e-9 * np.abs(own).max())
    s = 1j * np.geomspace(0.01, 60, 400)
    found = []
    for closed_loop in (some, every):
        motion = closed_loop.motion
        dynamic = s[:, None, None] ** 2 * motion.mass + s[:, None, None] * motion.damping + motion.stiffness
        pulled = sum(s[:, None, None] ** order * part for order, part in enumerate(motion.b))
        by_gusts = case.analysis.in_wind(closed_loop).gusts.input_matrix
        blown = np.broadcast_to(by_gusts, (len(s), *by_gusts.shape))
        moved = np.linalg.solve(dynamic, np.concatenate([pulled, blown], axis=-1))
        found.append(sum(s[:, None, None] ** order * (part @ moved) for order, part in enumerate(motion.c)))
    size = np.abs(found[1]).max(axis=0)
    assert (np.abs(found[0] - found[1]) <= 1e-9 * size).all()
    at_rest = case.analysis.at_rest.closed_loop_of(40)
    for pair in ((some, every), (at_rest, at_rest.with_all_modes)):
        responses = (GustResponse(case.analysis.in_wind(closed_loop), case.scene) for closed_loop in pair)
        own, other = (response.variances.weighted["value"] for response in responses)
        assert own == pytest.approx(other, rel=1e-9)


def test_numbers_and_names_of_modes_are_those_of_all():
    """The k-th coordinate is the mode with its frequency: in the plane of the cable or along it."""
    closed_loop = case_of(one_cable("hysteretic")).analysis.closed_loop
    frequency = closed_loop.motion.unit[: len(closed_loop.plant.kept)] / (2 * np.pi)
    numbers = []
    for place, own in enumerate(frequency):
        name = closed_loop.mode_name(place)
        number = int(name.split()[1])
        assert closed_loop.modes.frequency[number - 1] == pytest.approx(own, rel=1e-12)
        assert closed_loop.modes.moves[number - 1] != "cable out-of-plane"
        assert closed_loop.modes.moves[number - 1] in name
        numbers.append(number)
    assert all(one < other for one, other in pairwise(numbers))
    assert numbers[-1] > len(numbers)


def test_a_body_that_moves_out_of_the_plane_has_all_modes():
    closed_loop = case_of(one_cable("hysteretic", bodies__gondola__free=["x", "y"])).analysis.closed_loop
    assert len(closed_loop.plant.kept) == len(closed_loop.modes)


def test_what_moves_nothing_at_all_is_kept():
    """A cable without weight between two places: no tension depends on its waves."""
    text = {
        "gravity": 0.0, "cable": {"elastic_modulus": 70e9, "density": 1440.0, "area": 6e-6, "damping": {"ratio": 0.01}},
        "points": {"a": [0.0, 0.0, 0.0], "b": [30.0, 0.0, 0.0]},
        "cables": {"c": {"from": "a", "to": "b", "unstretched_length": 29.9}},
        "wind": {"speed": 6.0, "turbulence_intensity": 0.15, "length_scale": 25.0, "on": "cables"},
    }  # fmt: skip
    closed_loop = case_of(text).analysis.closed_loop_of(12)
    assert len(closed_loop.motion) >= len(closed_loop.modes) == 12


# -------------------------------------------------------------------------------------------------------- few modes


def few_and_all(wind, count):
    """The `GustResponse` of an `DynamicAnalysis`, and that with so many modes."""
    return wind.response, response_with(wind, count)


@pytest.mark.crossed
@pytest.mark.parametrize("damping", ["hysteretic", "kelvin_voigt"])
@pytest.mark.parametrize("end", ["from", "to"])
def test_few_modes_of_one_cable_have_the_numbers_of_many(damping, end):
    """RMS of displacement and speed of the body and speed of the winch: within the errors stated."""
    case = case_of(one_cable(damping, winches__cable__end=end))
    found, many = few_and_all(case.analysis, 160)
    assert len(found.closed_loop.modes) == 12
    for pair, name in product(((found, many), few_and_all(case.analysis.at_rest, 160)), ("value", "rate")):
        shown, true = (response.variances for response in pair)
        row = shown.rows["gondola.x"]
        own, other = (part.weighted[name][row] for part in (shown, true))
        assert np.abs(own - other) <= shown.errors(name)[row]
        assert own == pytest.approx(other, rel=1e-6)
    (own, error), (other, _) = found.winch_speeds, many.winch_speeds
    assert (np.abs(own - other) <= error).all()


@pytest.mark.parametrize("end", ["from", "to"])
def test_few_modes_of_bars_have_the_numbers_of_all(end):
    """Of 40 bars with modal damping, which the modes left out have too."""
    bars = {"elements": 40, "order": 1, "mass": "lumped"}
    case = case_of(one_cable("modal", winches__cable__end=end, model=bars))
    found, every = few_and_all(case.analysis, MOTION.element_modes)
    assert len(found.closed_loop.modes) == 24
    assert len(every.closed_loop.modes) == 118
    row = found.variances.rows["gondola.x"]
    pairs = (found, every), few_and_all(case.analysis.at_rest, MOTION.element_modes)
    for pair, (name, allowed) in product(pairs, (("value", 1e-9), ("rate", 1e-8))):
        own, other = (part.variances.weighted[name][row] for part in pair)
        assert own == pytest.approx(other, rel=allowed)


@pytest.mark.parametrize(
    "changes",
    [
        {"wind__on": "both"},
        {"control__proportional_gain": 0.5, "control__bandwidth": 5.0},
        {"bodies__gondola__free": []},
    ],
    ids=["gusts on the cable", "no integrator", "nothing is free"],
)
def test_what_excites_all_modes_has_many(changes):
    text = one_cable("hysteretic", **changes)
    if not text["bodies"]["gondola"]["free"]:
        text = {key: value for key, value in text.items() if key not in ("control", "winches")}
    in_wind = case_of(text).analysis
    assert len(in_wind.closed_loop.modes) >= 64


def test_a_body_that_few_modes_hardly_move_has_many():
    """A light one on a heavy, slack and stiff cable: its own frequency is far above the lowest modes."""
    changes = {
        "cable__area": 4e-5, "bodies__gondola__mass": 1.0, "cables__cable__from": [-370.0, 0.0, 0.0],
        "cables__cable__unstretched_length": 370.5, "bodies__gondola__force": [2500.0, 0.0, 0.0],
    }  # fmt: skip
    in_wind = case_of(one_cable("hysteretic", **changes)).analysis
    few = in_wind.closed_loop_of(24, True).plant
    share = few.modes.compliance_shares(0, 0)
    assert few.lacked_compliance == pytest.approx(1 - share[:16].sum(), rel=1e-6)
    assert few.lacked_compliance > 1e-2
    assert len(in_wind.loop_for_margins.modes) == 64
