"""Load cases at the limits of their keys: numbers or a reason, and errors below what is stated.

The truth is the 50-digit catenary with the weight vector and the length of the case (random_load_cases.truth): in a
steady wind that of the cable in uniform drag, from which the search for the actual form begins.
"""

import math
import re

import pytest
from campaign import campaign
from command import CONFIGS
from mpmath import mp
from random_load_cases import scene_data, truth
from solved import solve

from cablestudy.scene.scene import CableScene
from cablestudy.scene.study import read_study
from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.results import NO_FORM, Results
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.study.stated_numbers import StatedNumbers

ASKED = (
    "preload", "max_tension", "min_tension", "sag", "swing", "clearance", "lowest_point", "tension_1", "tension_2",
    "reaction_1_vertical", "reaction_1_horizontal", "reaction_2_vertical", "reaction_2_horizontal", "angle_1",
    "angle_2", "unstretched_length", "end_stiffness", "utilisation", "outofplane_frequency_1", "error_estimate",
)  # fmt: skip
COMPARED = [name for name in ASKED if name == "preload" or name.startswith(("tension", "reaction"))]
TABLE = read_study(CONFIGS / "extremes-cases.yaml")
# these overflowed, or were off in the axes of an almost upright cable in the wind, or named a load at nan m
ONCE_WRONG = (11, 21, 156, 179, 243, 344, 362)


def is_an_answer(status):
    return status in ("ok", "over strength")


@pytest.mark.parametrize("seed", campaign([*range(50_000, 50_060), *ONCE_WRONG], [*range(50_000, 50_015), *ONCE_WRONG]))
def test_every_number_is_finite_or_has_a_reason(seed):
    """No warning either: pytest makes errors of them."""
    cells = evaluate(CableScene.model_validate(scene_data(seed)), [find(name) for name in ASKED]).cells
    assert all(math.isfinite(value) for value in cells.values() if isinstance(value, float))
    assert "nan" not in cells["status"].split()
    missing = [name for name in ASKED if cells.get(find(name).header) is None and name != "error_estimate"]
    assert bool(missing) != is_an_answer(cells["status"])


def in_uniform_drag(scene):
    """Header -> number of the columns COMPARED in uniform drag: dict."""
    results = Results(StatedNumbers([scene]))
    results.form = results.catenary
    return {column.header: column.compute(results)[0] for column in map(find, COMPARED)}


def compared(seed):
    """Of one scene: cells, the truth, and the stated error; None where there is nothing to compare."""
    data = scene_data(seed)
    if "unstretched_length" not in data["cable"]:
        return None
    scene = CableScene.model_validate(data)
    cells = evaluate(scene, [find(name) for name in (*COMPARED, "max_tension")]).cells
    if not is_an_answer(cells["status"]) or cells["max_tension_N"] > data["cable"]["axial_stiffness"]:
        return None  # no answer, or a cable that is pulled to more than twice its length
    expected = truth(data)
    stated = max(1e-12, float(CableCase(scene).results.statics_rounding[0]))
    return None if expected is None else (in_uniform_drag(scene), expected, stated)


def test_errors_of_statics_are_below_what_is_stated():
    """Tensions each by itself, forces of the supports by the larger one of the two."""
    seeds = campaign([*range(60_000, 60_100), *ONCE_WRONG], [*range(60_000, 60_025), *ONCE_WRONG])
    found = {seed: compared(seed) for seed in seeds}
    found = {seed: both for seed, both in found.items() if both}
    assert len(found) > campaign(25, 6)
    for seed, (cells, expected, stated) in found.items():
        size = float(max(expected["tension_1"], expected["tension_2"]))
        for name, value in expected.items():
            scale = size if name.startswith("reaction") else float(value)
            assert cells[find(name).header] == pytest.approx(float(value), abs=stated * scale), (seed, name, stated)


@pytest.fixture(scope="module")
def rows():
    """(keys, cells) of each row of configs/extremes-cases.yaml."""
    columns = [find(name) for name in (*TABLE.columns, *COMPARED, "unstretched_length")]
    return [(changes, scene, evaluate(scene, columns).cells) for changes, scene in TABLE.cases()]


def test_the_table_of_extremes_is_right_or_refused(rows):
    refused = [cells["status"] for *_, cells in rows if not is_an_answer(cells["status"])]
    unsettled, shrunk = sorted(refused, reverse=True)
    assert unsettled == NO_FORM
    assert shrunk == "at the temperature of the case next to nothing is left of the cable's length"
    for _, scene, cells in rows:
        if not is_an_answer(cells["status"]):
            continue
        day = scene.cases[scene.case]
        data = {
            "cable": {
                "chord": math.hypot(300, 8), "inclination": math.atan2(8, 300), "axial_stiffness": 77e9 * 468.6e-6,
                "mass_per_length": 1.628, "diameter": 28.14e-3, "expansion": scene.cable.expansion,
                "unstretched_length": cells["unstretched_length_m"],
                "loads": [{"fraction": load.fraction, "mass": load.mass} for load in day.loads],
            },
            "cases": {"day": day.model_dump(include={"temperature", "ice", "wind"}, exclude_none=True)},
        }  # fmt: skip
        found = in_uniform_drag(scene)
        for name, value in truth(data).items():
            assert found[find(name).header] == pytest.approx(float(value), rel=1e-9), (scene.case, name)


def test_ends_of_the_ranges_are_what_physics_says(rows):
    found = {(scene.case, scene.cable.expansion): cells for _, scene, cells in rows}
    everyday = found["everyday", 19e-6]
    for little in ("rime", "breath", "dust"):
        for name in ("tension_1_N", "sag_m", "cable_frequency_Hz"):
            assert found[little, 19e-6][name] == pytest.approx(everyday[name], rel=1e-7), (little, name)
    assert found["frost", 1e-4]["utilisation"] > 1  # torn
    assert found["frost", -1e-3]["sag_m"] > 10 * everyday["sag_m"]  # slack
    assert found["blast", 19e-6]["swing_deg"] == pytest.approx(90, abs=1e-3)
    # a ship in the middle: all of its weight by both ends, which hang nearly straight down
    assert found["ship", 19e-6]["reaction_1_vertical_N"] == pytest.approx(1e9 * 9.81 / 2, rel=1e-3)


def test_a_cable_that_the_wind_blows_beyond_the_known_ground_has_no_clearance():
    ends, wind = [[0, 0, 9], [1, 0, 9]], {"speed": 30}
    cable = {"ends": ends, "unstretched_length": 4, "mass_per_length": 0.1, "diameter": 0.02, "axial_stiffness": 1e6}
    row = solve({"cable": cable, "ground": [[0, 0], [1, 0]], "cases": {"w": {"wind": wind}}, "case": "w"}, "clearance")
    assert re.match("the ground is known from x = 0 m to 1 m, the cable is from 0 m to 2", row.status)


def test_a_ribbon_that_the_wind_blows_along_itself_has_no_numbers_by_the_drag_of_its_chord():
    cable = {"chord": 20, "unstretched_length": 20.3, "mass_per_length": 2e-3, "diameter": 0.03, "axial_stiffness": 1e6}
    row = solve({"cable": cable, "cases": {"w": {"wind": {"speed": 70}}}, "case": "w"}, "max_tension")
    assert (row.values, row.status) == ({"max_tension": None}, NO_FORM)


def test_elements_in_drag_that_varies_along_them_are_that_cable(rows):
    columns = [find("preload"), find("error_estimate")]
    for case in ("breath", "everything"):
        (scene,) = (scene for _, scene, _ in rows if scene.case == case)
        closed = evaluate(scene, columns).cells
        model = type(scene.model).model_validate({"elements": 32, "order": 6})
        fine = evaluate(scene.model_copy(update={"model": model}), columns).cells
        assert closed["preload_N"] == pytest.approx(fine["preload_N"], rel=closed["error_estimate"] + 1e-9)
        assert closed["error_estimate"] < 1e-6


def test_the_rounding_of_a_force_is_more_of_a_part_of_it():
    """A cable that leaves end 1 almost level: the vertical part is what is left of 1,200 N."""
    cable = {
        "chord": 100.0, "inclination": 0.2, "axial_stiffness": 1e6, "mass_per_length": 0.5, "diameter": 0.01,
        "expansion": 1e-5, "loads": [], "unstretched_length": 100.51793167530559,
    }  # fmt: skip
    data = {"cable": cable, "cases": {"day": {}}, "case": "day"}
    expected, row = truth(data), solve(data, "reaction_1_vertical", "reaction_1_horizontal", "angle_1")
    level, vertical = expected["reaction_1_horizontal"], expected["reaction_1_vertical"]
    expected["angle_1"] = mp.degrees(mp.atan2(vertical, level))
    for name, value in row.values.items():
        assert abs(value - expected[name]) <= row.errors[name] * abs(expected[name]), name
    assert row.errors["reaction_1_horizontal"] < 2e-12
