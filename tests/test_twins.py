"""Each scene of one cable, written as a suspension too, has the same numbers: those of configs/ and random ones.

`benchmarks/twins.py` compares many more scenes in everything, and prints what differs.
"""

from functools import cache

import pytest
import twins
from campaign import campaign
from command import CONFIGS
from random_twins import random_scene, straight_scene
from solved import contents, rows_of_study, solve
from twin_comparison import (
    OF_FORM,
    compare_cable_wind,
    compare_gondola,
    compare_linear_ranges,
    compare_loop,
    compare_modes,
    compare_open_wind,
    compare_state_space,
    compare_statics,
    difference,
    is_one_bar,
)
from twins import VORTICES, blown, held, swinging, without

from cablestudy.study.cable_columns import COLUMNS, FAMILIES

# Part of the comparison -> column -> relative difference that is rounding where the cable has a loss factor: of a
# resonance with a damping ratio of 3e-10, and of a largest gain that a mode with a damping ratio of 3e-8 decides on.
ROUNDED = {
    "wind on a bare cable": {"tension_rms": 1e-5, "midspan_rms": 1e-5},
    "wind on the cable": {
        "gondola_rms_open_loop_cable_wind": 1e-5, "gondola_rms_velocity_open_loop_cable_wind": 1e-5,
    },
    "loop and wind of any form": {"largest_gain": 1e-8, "gain_margin": 1e-8},
}  # fmt: skip
# random scenes, all combinations of form and damping at least once, and rows of each study
RANDOM, ROWS = campaign(200, 72), campaign(12, 4)
LOOPS = ("carlina", "carlina-inclined", "carlina-pid")
FILES = ("carlina", "carlina-inclined", "carlina-pid", "guy", "line", "point-load", "slack", "zipline")
STUDIES = (
    "damping", "density-high", "density-low", "diameter", "emodulus", "extremes", "extremes-cases", "extremes-loop",
    "guy-preload", "line-cases", "material", "preload", "sensitivity", "vortex", "wind-speed", "winch-location",
    "zipline-ropes", "zipline-travel",
)  # fmt: skip
# loops: all dampings, laws and places of the winch
STRAIGHT = campaign((0, 1, 2, 3, 4, 6, 9, 10, 12, 14, 15, 16, 28, 44), (1, 2, 6, 15, 16, 44))
HANGING = campaign(  # of any form
    (0, 1, 3, 4, 8, 9, 11, 14, 16, 18, 20, 25, 27, 30, 32, 36, 40, 44, 47, 50, 53, 58, 62, 65),
    (3, 11, 14, 18, 20, 27, 32, 53, 58),
)
STORMS = campaign((1, 2, 3, 13, 14, 20, 26, 27, 28, 32), (2, 14))


@cache
def from_files():
    """Name -> scene of each file of configs/ of one cable, in each of its load cases, and of rows of each study."""
    found = {}
    for name in FILES:
        scene = contents(CONFIGS / f"{name}.yaml")
        found[name] = scene
        found |= {f"{name}, {case}": {**scene, "case": case} for case in scene.get("cases", {})}
    for name in STUDIES:
        rows = rows_of_study(CONFIGS / f"{name}.yaml", ROWS)
        found |= {f"{name}, row {number}": scene for number, scene in enumerate(rows, 1)}
    return found


@cache
def drawn():
    """Name -> random scene."""
    return {f"random {seed}": random_scene(seed) for seed in range(RANDOM)}


def every(scenes, step, keep=lambda scene: True):
    """Each so-and-so-many-th of the scenes that are to be kept."""
    kept = {name: scene for name, scene in scenes.items() if keep(scene)}
    return dict(list(kept.items())[::step])


def few_elements(scene):
    """Whether a scene states its elements, and no load case."""
    return "elements" in scene["model"] and "case" not in scene


def chosen(names):
    """Scenes of files, by name."""
    return {name: from_files()[name] for name in names}


def is_first_of_its_file(name):
    """Whether this is a scene of a file, in any load case, or the first row of a study."""
    return ", row " not in name or name.endswith(", row 1")


def stormy(seeds):
    """Random scenes in a storm, whose cables have five elements."""
    storm = {"cases": {"storm": {"wind": {"speed": 30.0, "direction": 1.9}}}, "case": "storm"}
    found = {f"random {seed} in a storm": drawn()[f"random {seed}"] | storm for seed in seeds}
    model = {"elements": 5, "order": 4}
    return {
        name: scene | {"model": model, "wind": scene["wind"] | {"aerodynamic_damping": True}}
        for name, scene in found.items()
    }


def weightless(name, **model):
    """A scene of a file without gravity and with other elements: where its winch reels in is along x."""
    return {**from_files()[name], "gravity": 0.0, "model": model}


PARTS = {  # what is compared, and of which scenes
    "statics of files": lambda: compare_statics(from_files()),
    # damping has no part in it: fewer scenes have all the forms, loads and load cases
    "statics": lambda: compare_statics(dict(list(drawn().items())[: campaign(200, 36)])),
    "linear range of files": lambda: compare_linear_ranges(
        {name: scene for name, scene in from_files().items() if "gondola" in scene and is_first_of_its_file(name)}
    ),
    "linear range": lambda: compare_linear_ranges(every(drawn(), 9)),
    "modes of files": lambda: compare_modes(chosen([*FILES, "guy, storm", "line, ice"])),
    "modes": lambda: compare_modes(every(drawn(), 13)),
    "gondola of files": lambda: compare_gondola(chosen(["carlina", "carlina-inclined", "carlina-pid", "slack"])),
    "gondola": lambda: compare_gondola(every(drawn(), 9, lambda scene: "elements" in scene["model"])),
    "state space": lambda: compare_state_space(every(drawn(), 9, few_elements)),
    "wind, winch at rest": lambda: compare_open_wind(every(drawn(), 9, few_elements)),
    "wind of files, winch at rest": lambda: compare_open_wind(chosen(LOOPS)),
    "loop of files": lambda: compare_loop(chosen(LOOPS), by_name=LOOPS),
    "loop of many elements": lambda: compare_loop({"carlina, 717 modes": weightless("carlina", elements=30, order=8)}),
    "loop and wind": lambda: compare_loop(
        {f"straight {seed}": straight_scene(seed) for seed in STRAIGHT},
        by_name=[f"straight {seed}" for seed in STRAIGHT[: campaign(6, 3)]],
    ),
    "loop and wind of any form": lambda: compare_loop(
        {f"random {seed}": drawn()[f"random {seed}"] for seed in HANGING},
        by_name=[f"random {seed}" for seed in HANGING[: campaign(10, 4)]],
    ),
    # the drag of the steady wind turns with what moves
    "gondola in a storm": lambda: compare_gondola(stormy(STORMS)),
    "loop and wind in a storm": lambda: compare_loop(stormy(STORMS)),
    "wind on the cable in a storm": lambda: compare_cable_wind(stormy(STORMS[:1])),
    "wind on the cable": lambda: compare_cable_wind(every(drawn(), 25, few_elements)),
    "wind on a bare cable": lambda: compare_cable_wind(
        {name: without(scene, "gondola") for name, scene in every(drawn(), 25, few_elements).items()}
    ),
    "wind on a bare cable to an accuracy": lambda: compare_cable_wind(
        {name: without(scene, "gondola") | {"model": {"accuracy": 1e-4}} for name, scene in every(drawn(), 25).items()}
    ),
}


@pytest.mark.parametrize("part", PARTS)
def test_one_cable_and_its_twin_have_the_same_numbers(part):
    """In one test: workers that have one each would compute each part twice."""
    rounded = ROUNDED.get(part, {})
    found = [one for one in PARTS[part]() if not (one.lossy and one.size <= rounded.get(one.column, 0.0))]
    assert found == []


def test_each_column_of_one_cable_has_a_twin_or_a_reason():
    """With the modes, which are compared by other names."""
    named = {*twins.STATIC, *twins.LINEAR, *VORTICES, *twins.COUPLED, *twins.LOOP, *twins.VARIANCES, *twins.NO_TWIN}
    modes = {"cable_frequency"} | {family.name for family in FAMILIES}
    own = {column.name for column in COLUMNS if column.needs != "run" and column.name != "iterations"}
    assert own - named - modes == set()


def test_vortices_of_a_cable_in_the_wind_and_in_its_ice():
    iced = {name: scene for name, scene in drawn().items() if scene.get("case") == "ice"}
    scenes = {name: scene for name, scene in from_files().items() if name.startswith("vortex")} | every(iced, 5)
    assert len(scenes) > campaign(5, 4)
    for scene in scenes.values():
        own, other = solve(scene, *VORTICES), solve(blown(scene, True), *VORTICES.values())
        assert list(other.values.values()) == pytest.approx(list(own.values.values()), rel=1e-12)


def test_a_wrong_twin_differs():
    """The comparison sees a mass that is off by 1e-8, and a number that one side lacks."""
    scene, column = straight_scene(4), "gondola_frequency"
    heavier = {**scene, "gondola": {**scene["gondola"], "mass": scene["gondola"]["mass"] * (1 + 1e-8)}}
    own, other = (solve(one, column).values[column] for one in (scene, heavier))
    assert difference("", scene, column, (own, other), (None, None)).size == pytest.approx(5e-9, rel=0.2)
    assert difference("", scene, column, (own, None), (None, None)).column.endswith("twin refuses")
    assert difference("", scene, column, (own, own), (None, None)) is None


def test_the_stated_error_of_one_straight_bar_is_the_sag_that_its_twin_has():
    """Of a suspension statics are those of the closed form, whatever its elements; those of one bar have no sag."""
    for scene in filter(is_one_bar, from_files().values()):
        own, other = solve(scene, *OF_FORM), solve(held(scene), *(f"cable.{name}" for name in OF_FORM))
        for name in OF_FORM:
            truth = other.values[f"cable.{name}"]
            assert own.errors[name] == pytest.approx(abs(own.values[name] - truth) / abs(truth), rel=1e-9)


def test_a_stated_error_beyond_all_measure_excuses_nothing():
    scene = straight_scene(4) | {"model": {"accuracy": 1e-4}}
    assert difference("", scene, "sag", (1.0, 1.01), (0.5, 0.5)).stated < 1e-3


def test_the_body_of_the_twin_stands_where_end_2_is():
    for seed in (1, 4, 8, 14):
        scene = random_scene(seed)
        twin = swinging(scene)
        at = twin["bodies"]["gondola"]["at"]
        assert solve(twin, "gondola.x").values["gondola.x"] == pytest.approx(at[0], rel=1e-11)
        assert held(scene)["bodies"]["gondola"]["at"] == at
