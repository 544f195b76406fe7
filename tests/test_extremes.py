"""Random scenes over everything that a cable can be: the errors that the program states are true. `make extremes`: all.

The truth is `references/scene_truth.py`: the 50-digit catenary and the spectral continuous cable.
"""

import json
import sys

import numpy as np
import pytest
import random_scenes
from campaign import WHOLE, campaign
from command import ROOT
from random_scenes import ACCURACIES, Cell, examine, replay
from references.scene_truth import Cable, Truth, Unknown
from solved import solve

from cablestudy.scene.study import read_study
from cablestudy.study.one_cable.case import CableCase

SCENES = campaign(range(90_000, 90_030), range(90_000, 90_008))  # never looked at while anything was tuned


@pytest.fixture(scope="module")
def cells():
    return [cell for seed in SCENES for cell in examine(seed)]


def test_nothing_crashes_and_nothing_warns(cells):
    assert [(cell.note, replay(cell.seed)) for cell in cells if cell.note.startswith("crash")] == []


def test_no_error_is_larger_than_stated(cells):
    judged = [cell for cell in cells if cell.error is not None]
    assert len(judged) > campaign(350, 80)
    assert {cell.accuracy for cell in judged} == set(ACCURACIES)
    wrong = [(cell.column, cell.error, cell.estimate, replay(cell.seed)) for cell in judged if cell.excess > 1]
    assert wrong == []


def test_the_asked_accuracy_is_kept(cells):
    late = [cell for cell in cells if cell.value is not None and cell.estimate > cell.accuracy]
    assert late == []
    assert any(cell.together for cell in cells)


def test_what_is_refused_has_a_reason(cells):
    refused = [cell for cell in cells if cell.value is None]
    assert all(cell.note.startswith("refused: ") and len(cell.note) > 20 for cell in refused)
    assert len(refused) < 0.1 * len(cells)


def test_a_number_without_a_stated_error_counts_as_stated_exactly():
    right, wrong = (
        Cell(102, 1e-6, "gondola_damping_ratio", False, 1.0, None, error, 2e-13, "") for error in (0.0, 0.1)
    )
    assert right.excess == 0
    assert right.caution is None
    assert wrong.excess > 1e10


def test_a_mode_that_ceases_to_oscillate_and_begins_again_has_no_truth():
    """Of scene 604 the pair of poles is real at 92 % of its damping; at all of it there is another pair."""
    data = random_scenes.scene_data(604)
    cable, mass = data["cable"], data["gondola"]["mass"]
    chord, weight = cable["chord"], cable["area"] * cable["density"] * data["gravity"]
    tension = weight * chord**2 / (8 * cable["sag"])
    own, sag = cable["elastic_modulus"] * cable["area"] / chord, 12 * tension**3 / (weight**2 * chord**3)  # springs
    poles = {}
    for share in (0.5, 0.92, 1.0):
        time = share * cable["damping"]["time"]
        poles[share] = np.roots([mass * own * time, mass * (own + sag), own * sag * time, own * sag])
    assert [sum(abs(pole.imag) > 0 for pole in poles[share]) for share in poles] == [2, 0, 2]
    case = CableCase(random_scenes.scene_of(data, 1e-4))
    with pytest.raises(Unknown, match="which pole continues it"):
        random_scenes.truth_of(data, case.span).gondola_damping_ratio()
    pair = poles[1.0][np.abs(poles[1.0].imag) > 0][0]
    ratio = solve(case.scene, "gondola_damping_ratio").values["gondola_damping_ratio"]
    assert ratio == pytest.approx(-pair.real / abs(pair), rel=1e-4)


def test_a_scene_that_takes_too_long_is_given_up(monkeypatch):
    def forever(*_):
        while True:
            pass

    monkeypatch.setattr(random_scenes, "evaluate", forever)
    (cell,) = examine(7, limit=0.5)
    assert cell.note == "slow: 0.5 s of CPU, the last of them in the program"
    assert cell.cpu > 0.4
    assert cell.value is None


def test_the_campaign_goes_on_from_its_file(tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import extremes as script

    out = tmp_path / "cells.jsonl"

    def extremes(scenes, *more):
        """What it prints, or why it refuses."""
        words = ["--jobs", "1", "--first", "90000", "--scenes", str(scenes), "--out", str(out), *more]
        monkeypatch.setattr(sys, "argv", ["extremes.py", *words])
        with pytest.raises(SystemExit) as stop:
            script.main()
        return stop.value.code if isinstance(stop.value.code, str) else capsys.readouterr().out

    extremes(1)
    first = out.read_bytes()
    assert "exists" in extremes(2)
    with out.open("ab") as file:
        file.write(b"[90001, [[90001, 0.0")  # torn
    report = extremes(2, "--resume")
    assert "scenes: 2;" in report
    assert out.read_bytes().startswith(first)
    assert [json.loads(line)[0] for line in out.read_text().splitlines()] == ["extremes", 90000, 90001]
    assert len(json.loads(first.splitlines()[1])[1]) >= 10


ENDS = read_study(ROOT / "configs" / "extremes.yaml")
REFUSED = {  # what has no answer, and why
    "folded": "the cable hangs folded",
    "shapeless": "a slack cable without weight has no definite form",
    "one bar": "the model has 0 in-plane modes, not 1",
    "beyond rounding": "accuracy 1e-15 cannot be reached: the error reached is about 1",
}


@pytest.fixture(scope="module")
def ends():
    """(scene, row) of every row of configs/extremes.yaml."""
    return [(scene, solve(scene, *ENDS.columns)) for _, scene in ENDS.cases()]


def test_every_end_is_right_or_refused(ends):
    """Against the truth, to the accuracy that the row asks for; a model of elements, to that of its kind."""
    refused = [row.status for _, row in ends if row.status != "ok"]
    assert len(refused) == len(REFUSED)
    assert all(sum(status.startswith(why) for status in refused) == 1 for why in REFUSED.values())
    for scene, row in ends:
        if row.status != "ok":
            continue
        cable, elements = scene.cable, scene.model.elements
        loads = tuple((load.at, load.force) for load in cable.loads)
        section = cable.section_axial_stiffness, cable.section_mass
        truth = Truth(Cable(cable.chord, cable.inclination, cable.unstretched_length, *section, scene.gravity, loads))
        modes = truth.lowest(8)
        expected = {
            **{name: float(truth.statics[name]) for name in ("preload", "min_tension", "sag")},
            "end_stiffness": float(truth.end_stiffness[0, 0]),
            "cable_frequency": truth.frequency("in-plane", 1, modes)[0],
            "inplane_frequency_3": truth.frequency("in-plane", 3, modes)[0],
        }
        for name, value in expected.items():
            tolerance = 1e-5 if elements else scene.model.accuracy
            assert row.values[name] == pytest.approx(value, rel=tolerance, abs=1e-25), (scene, name)


@pytest.mark.parametrize("seed", [1000042, 1000153, 1002026, 1002939, 1004558, 1006460, 1006641, 1008627])
def test_scenes_that_once_were_wrong_or_warned(seed):
    """Heavy damping where modes pass on their motion; poles at zero; no modes; stiff legs that hang from a load."""
    cells = examine(seed, every=ACCURACIES) if WHOLE else examine(seed, in_turn=ACCURACIES[1::2])
    assert not [cell.note for cell in cells if cell.note.startswith("crash")]
    assert [(cell.column, cell.error, cell.estimate) for cell in cells if cell.excess > 1] == []
    assert sum(cell.error is not None for cell in cells) > 5


# almost inextensible cables (EA 1e10 to 1e20 times the weight) that fold back on themselves, almost no tension there
LOOPS = [(9200228, "gondola_frequency"), (9200045, "outofplane_frequency_1"), (9200096, "cable_frequency"),
         (9200063, "gondola_frequency")]  # fmt: skip


@pytest.mark.parametrize(("seed", "column"), LOOPS)
def test_modes_of_almost_inextensible_loops_have_numbers(seed, column):
    data = random_scenes.scene_data(seed)
    row = solve(random_scenes.scene_of(data, 1e-8), column)
    truth, doubt = random_scenes.expected(
        random_scenes.truth_of(data, CableCase(random_scenes.scene_of(data, 1e-4)).span), data, column
    )
    assert row.status == "ok"
    assert abs(row.values[column] - truth) <= (row.errors[column] + 3 * doubt) * truth
