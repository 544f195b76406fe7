"""Random and extreme suspensions: the errors that the program states are true. `make extremes`: many more.

The truth is `references/suspension_truth.py`: 50-digit catenaries in a pose of their own, and bars for the motion.
"""

import math
from copy import deepcopy

import pytest
from campaign import campaign
from random_suspensions import MODES, STATIC, errors_of_statics, examine, replay, truth_of
from references.suspension_truth import Bars
from suspension_cases import case_of

from cablestudy.errors import NoSolutionError

SCENES = campaign([90_001, 90_003, 90_004, 90_006, 90_011, 90_012], [90_001, 90_003, 90_004, 90_011])
TIMES = 10  # no error is larger than so many times the stated one


@pytest.fixture(scope="module")
def cells():
    return [cell for seed in SCENES for cell in examine(seed)]


def test_nothing_crashes_and_nothing_warns(cells):
    assert [(cell.note, replay(cell.seed)) for cell in cells if cell.note.startswith(("crash", "slow"))] == []


def test_no_error_is_larger_than_stated(cells):
    judged = [cell for cell in cells if cell.error is not None]
    assert len(judged) > campaign(60, 40)
    assert {cell.column for cell in judged} == {*STATIC, *(f"frequency_{k + 1}" for k in range(MODES))}
    assert [(cell.column, cell.error, cell.estimate, replay(cell.seed)) for cell in judged if cell.excess > TIMES] == []


def test_the_asked_accuracy_is_kept(cells):
    moving = [cell for cell in cells if cell.column.startswith("frequency") and cell.value is not None]
    assert [cell for cell in moving if cell.estimate > cell.accuracy] == []


def test_what_is_refused_has_a_reason(cells):
    refused = [cell for cell in cells if cell.value is None and not cell.note.startswith("no truth")]
    assert refused
    assert all(cell.note.startswith("refused: ") and len(cell.note) > 20 for cell in refused)


def platform(mass=50.0, stiffness=1e6, line=0.1, strain=1e-3, count=8, **body):
    """A body on cables to anchors above and below, each shorter than the distance of its ends by a strain."""
    angles = [2 * math.pi * k / count for k in range(count)]
    attachments = {
        f"e{k}": [0.5 * math.cos(a + 0.6), 0.4 * math.sin(a + 0.6), 0.3 * (-1) ** k] for k, a in enumerate(angles)
    }
    half = {"at": [0, 0, 0], "mass": mass, "center_of_mass": [0.02, -0.01, -0.1]}
    inertia = [0.1 * mass, 0.12 * mass, 0.15 * mass]
    cables = {}
    for k, a in enumerate(angles):
        anchor = [12 * math.cos(a), 10 * math.sin(a), 7 * (-1) ** k]
        length = math.dist(anchor, attachments[f"e{k}"]) / (1 + strain)
        cables[f"c{k}"] = {"from": anchor, "to": f"body.e{k}", "unstretched_length": length}
    cables = {name: cable | section(stiffness, line) for name, cable in cables.items()}
    bodies = {"body": {**half, "inertia": inertia, "attachments": attachments, **body}}
    return {"gravity": 9.81, "points": {}, "bodies": bodies, "cables": cables}


def section(stiffness, line):
    """Keys of the section: EA [N], mass per length [kg/m]."""
    return {"area": 1e-4, "elastic_modulus": stiffness / 1e-4, "density": line / 1e-4}


def in_one_plane():
    """A body on four cables in the plane y = 0, of which one hangs slack."""
    data = platform(count=4)
    places = {"e0": [0.5, 0, 0.2], "e1": [0.3, 0, 0.3], "e2": [-0.3, 0, 0.3], "e3": [-0.5, 0, 0.2]}
    anchors = [[9, 0, 6], [4, 0, 8], [-4, 0, 8], [-9, 0, 6]]
    data["bodies"]["body"] |= {"attachments": places, "center_of_mass": [0, 0, -0.1]}
    for k, cable in enumerate(data["cables"].values()):
        cable |= {"from": anchors[k], "unstretched_length": math.dist(anchors[k], places[f"e{k}"]) * (1 + 0.002 * k)}
    return data


def at_one_point(place=(0.0, 0.0, 0.4), count=3, **body):
    """A body on three cables, or fewer, that meet in one attachment."""
    data = platform(count=count, center_of_mass=[0, 0, -0.2], attachments={"e": list(place)}, **body)
    anchors = [[8, 0, 6], [-4, 7, 6], [-4, -7, 6]]
    for anchor, cable in zip(anchors, data["cables"].values(), strict=False):
        cable |= {"from": anchor, "to": "body.e", "unstretched_length": math.dist(anchor, place)}
    return data


def from_one_anchor(**body):
    """A body on three cables from one anchor to a triangle."""
    places = {f"e{k}": [math.cos(2.1 * k), math.sin(2.1 * k), 0.0] for k in range(3)}
    data = platform(count=3, center_of_mass=[0, 0, -0.1], attachments=places, **body)
    for name, cable in zip(places, data["cables"].values(), strict=True):
        cable |= {"from": [0, 0, 9], "to": f"body.{name}", "unstretched_length": math.dist([0, 0, 9], places[name])}
    return data


def on_the_edge():
    """One cable is exactly as long as the distance of its ends in the equilibrium without it."""
    data = in_one_plane()
    without = deepcopy(data)
    del without["cables"]["c3"]
    del without["bodies"]["body"]["attachments"]["e3"]
    found = case_of(without).equilibrium
    end = found.position[0] + found.rotation[0] @ data["bodies"]["body"]["attachments"]["e3"]
    data["cables"]["c3"] |= {"unstretched_length": math.dist(data["cables"]["c3"]["from"], end), **section(1e6, 1e-4)}
    return data


NO_YAW = ["x", "y", "z", "roll", "pitch"]
EXTREMES = {
    "a body of 1 g": platform(mass=1e-3),
    "a body of 1e9 kg": platform(mass=1e9, stiffness=1e13),
    "EA/T = 1": platform(stiffness=500.0, strain=0.9, line=0.01),
    "EA/T = 1e10": platform(stiffness=1e12, strain=1e-10, line=1e-3),
    "all cables in one plane": in_one_plane(),
    "three cables at one point": at_one_point(free=NO_YAW),
    "anchors at one place": from_one_anchor(free=NO_YAW),
    "the edge of slackness": on_the_edge(),
    "no gravity": platform(strain=0.1) | {"gravity": 0.0},
    "very slack": platform(strain=-0.4),
}


@pytest.mark.parametrize("name", EXTREMES)
def test_extremes_are_right(name):
    data = EXTREMES[name]
    case = case_of(data)
    estimate = case.statics_error(None)
    truth = truth_of(data, case.equilibrium)
    for number, (_, error, doubt) in errors_of_statics(data, case, truth).items():
        assert error <= TIMES * estimate + 3 * doubt, number
    modes, (expected, doubt) = case.modes(MODES), truth.frequencies(MODES)
    for k in range(MODES):
        error = abs(modes.frequency[k] / expected[k] - 1)
        assert error <= TIMES * modes.error[k] + 3 * doubt[k], k + 1


MECHANISMS = {
    "three cables at one point, yaw free": (at_one_point(), "nothing holds body yaw"),
    "three cables at the reference point": (at_one_point((0, 0, 0)), "nothing holds body yaw"),
    "one cable": (at_one_point(count=1), "nothing holds body yaw"),
    "anchors at one place, yaw free": (from_one_anchor(), "nothing holds body yaw"),
}


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_is_refused_and_its_motion_named(name):
    data, reason = MECHANISMS[name]
    with pytest.raises(NoSolutionError) as refusal:
        case_of(data).equilibrium  # noqa: B018
    assert str(refusal.value) == reason


@pytest.mark.parametrize("size", [0.03, 0.3, 0.5, 1, 3, 10, 30])
def test_a_mechanism_of_any_size_is_named(size):
    """A light body that hangs by one point from four stiff cables, in a search for which it turns and turns."""
    data = platform(count=4, mass=0.01235, stiffness=1.7e8, line=0.332)
    body = data["bodies"]["body"]
    body["center_of_mass"] = [size * part for part in (0.0023, -0.0008, -0.009)]
    body["attachments"] = {key: [size * part for part in (0.079, -0.041, -0.008)] for key in body["attachments"]}
    with pytest.raises(NoSolutionError, match=r"^nothing holds body yaw$"):
        case_of(data).equilibrium  # noqa: B018


def test_the_bars_of_the_reference_come_to_the_catenaries():
    """Two ways to the same equilibrium: the places of bars and catenaries differ by the square of a bar's length."""
    data = platform(line=1.0)
    truth = truth_of(data, case_of(data).equilibrium)
    off = [abs(Bars(truth, n).positions[0] - [float(x) for x in truth.positions[0]]).max() for n in (16, 32)]
    assert off[0] / off[1] == pytest.approx(4, rel=0.02)
    assert off[1] < 1e-4
