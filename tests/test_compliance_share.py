"""The share of a mode in a body's static compliance, and its stated error, against continuous cables."""

import numpy as np
import pytest
from references.continuous_cable import dynamic_end_stiffness
from references.continuous_suspension import Suspension
from scipy.linalg import eigh
from scipy.optimize import brentq
from solved import end_force, solve
from straight_scenes import case_of

from cablestudy.motion.body_mode import error_by_mixing

TURN = 2 * np.pi
# span [m], rise [m], unstretched length [m], axial stiffness [N], mass per length [kg/m]: one slack and heavy cable,
# whose modes are the lowest, and two light ones, whose modes lie far above those that are computed
SLACK, STEEP = (50.0, -20.0, 56.0, 1e7, 1.0), (40.0, -30.0, 55.0, 1e7, 2.0)
LIGHT, HEAVIER = (
    ((20.0, -8.0, 21.5, 2e5, mass), (-20.0, -6.0, 20.8, 3e5, mass)) for mass in (0.02, 0.05)
)  # fmt: skip


def suspension(cables, mass, accuracy):
    """A body free along x at the origin, held there by a dead force beside the cables: a mapping."""
    table, forces = {}, []
    for number, (span, rise, length, stiffness, per_length) in enumerate(cables):
        own = {"unstretched_length": length, "axial_stiffness": stiffness, "mass_per_length": per_length}
        own["diameter"] = 0.01
        begin = [-span, 0.0, -rise]
        forces.append(end_force({"cable": own | {"ends": [begin, [0.0, 0.0, 0.0]]}}))
        table[f"c{number}"] = own | {"from": begin, "to": "b.a"}
    body = {"at": [0.0] * 3, "mass": mass, "free": ["x"], "attachments": {"a": [0.0] * 3}}
    body["force"] = [-float(np.sum(forces, axis=0)[0]), 0.0, 0.0]
    return {"bodies": {"b": body}, "cables": table, "model": {"accuracy": accuracy}}


def share_near(cables, mass, frequency):
    """Of the root of D(w) = k(w) - M w^2 near a frequency [Hz]: -k(0)/(w^2 dD/d(w^2)), by a complex step."""

    def stiffness(omega):
        return sum(dynamic_end_stiffness(*cable, 9.81, omega, n=60)[0, 0] for cable in cables)

    omega = TURN * frequency
    omega = brentq(lambda w: stiffness(w).real - mass * w**2, omega * (1 - 1e-4), omega * (1 + 1e-4), xtol=1e-13)
    step = 1e-20 * omega**2
    slope = stiffness(np.sqrt(omega**2 + 1j * step)).imag / step - mass
    return -stiffness(1e-7 * omega).real / slope / omega**2


@pytest.mark.crossed
@pytest.mark.parametrize("accuracy", [1e-4, 1e-2])
@pytest.mark.parametrize("light", [LIGHT, HEAVIER], ids=["light", "heavier"])
@pytest.mark.parametrize("slack", [SLACK, STEEP], ids=["slack", "steep"])
def test_the_stated_error_of_a_share_is_true_where_modes_of_cables_lie_far_above(slack, light, accuracy):
    """Two models without a mode of the light cables agree with each other to more digits than they are right."""
    cables, mass = (slack, *light), 3000.0
    found = solve(suspension(cables, mass, accuracy), "b.share_x", "b.frequency_x")
    expected = share_near(cables, mass, found.values["b.frequency_x"])
    error, stated = abs(found.values["b.share_x"] / expected - 1), found.errors["b.share_x"]
    assert error <= stated <= max(accuracy * 1e-2, 1e-5)


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_modes_that_coincide_have_one_share(turn):
    """Three equal cables hold a knot: its modes along x and y coincide, and along any axis are half of a pair."""
    angles = turn + TURN / 3 * np.arange(3)
    cables = {f"c{k}": {"from": f"p{k}", "to": "knot", "unstretched_length": 31.0} for k in range(3)}
    data = {
        "points": {f"p{k}": [30 * np.cos(a), 30 * np.sin(a), 8.0] for k, a in enumerate(angles)}
        | {"knot": {"at": [0.0, 0.0, 0.0], "free": True, "mass": 8.0}},
        "cable": {"axial_stiffness": 3e5, "mass_per_length": 0.3, "diameter": 0.01},
        "cables": cables,
        "model": {"accuracy": 1e-5},
    }
    found = solve(data, "knot.share_x", "knot.frequency_x")
    truth = Suspension(case_of(data).equilibrium)

    def along_x(omega):
        return truth.dynamic_stiffness(omega)[0, 0]

    omega = TURN * found.values["knot.frequency_x"]
    step = 1e-4 * omega
    omega = brentq(along_x, omega - step, omega + step, xtol=1e-13)
    slope = (along_x(omega + step) - along_x(omega - step)) / (4 * omega * step)  # by omega^2
    expected = -along_x(1e-5 * omega) / slope / omega**2
    assert found.values["knot.share_x"] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("left_out", ["stiffness", "mass"])
@pytest.mark.parametrize("number", [0, 1])
def test_the_error_of_a_share_counts_stiffness_and_inertia_that_a_model_leaves_out(left_out, number):
    """Two modes of which the other one moves the body ten times as much, against numpy's generalised eigenvalues."""
    squares, moved, added = np.array([1.0, 16.0]), np.array([1.0, 1.0]), np.array([1e-3, 1e-3])
    moved[1 - number] = 10.0
    stiffness, mass, lowered = np.diag(squares), np.eye(2), np.outer(added, added)
    if left_out == "stiffness":
        stiffness = stiffness - lowered * np.sqrt(np.outer(squares, squares))
    else:
        mass = mass + lowered
    true_squares, shapes = eigh(stiffness, mass)
    compliance = moved @ np.linalg.solve(np.diag(squares), moved)
    share = moved**2 / squares / compliance
    true_share = (moved @ shapes) ** 2 / true_squares / (moved @ np.linalg.solve(stiffness, moved))
    error = error_by_mixing(number, share, np.sqrt(squares) / TURN, added**2 / 2)
    change = abs(true_share[number] / share[number] - 1)
    assert 1e-6 < change < error < 20 * change


ON_FOUR = {
    (27.92, 43.4, 19.3): 55.18,
    (-44.57, 26.02, 18.94): 56.11,
    (-18.52, -48.17, 27.95): 63.49,
    (47.48, -20.23, 39.68): 66.06,
}  # ends [m] -> unstretched lengths [m]


def on_four_cables(pieces, accuracy):
    """A body below four slack cables, each in some pieces with junctions without mass: `SuspensionCase`."""
    points, cables = {}, {}
    for number, (end, length) in enumerate(ON_FOUR.items()):
        nodes = [list(end), *(f"p{number}{k}" for k in range(1, pieces)), "b.a"]
        for k in range(1, pieces):
            x, y, z = (1 - k / pieces) * np.array(end)
            at = [x, y, z - 6 * k * (pieces - k) / pieces**2]
            points[nodes[k]] = {"at": at, "free": True, "mass": 0.0}
        for k in range(pieces):
            cables[f"c{number}{k}"] = {"from": nodes[k], "to": nodes[k + 1], "unstretched_length": length / pieces}
    body = {"at": [0, 0, 0], "free": ["x", "y", "z", "roll", "pitch"], "mass": 337.0, "inertia": [1, 1, 1]}
    body |= {"center_of_mass": [0, 0, -0.5], "attachments": {"a": [0, 0, 0.3]}}
    cable = {"axial_stiffness": 4.88e5, "mass_per_length": 0.0572, "diameter": 0.00343}
    data = {"cable": cable, "points": points, "bodies": {"b": body}, "cables": cables, "model": {"accuracy": accuracy}}
    return case_of(data)


def test_the_mode_with_the_largest_share_is_one_that_errors_of_frequencies_cannot_change():
    """Shares are 0.148 and 0.137: by the first model of an accuracy of 0.1 a mode at 2.0 Hz, not 0.48, has 0.20."""
    value, error = on_four_cables(4, 0.1).mode_along("b", 3).frequency
    expected, _ = on_four_cables(1, 1e-6).mode_along("b", 3).frequency
    assert abs(value - expected) <= (error + 1e-9) * expected
