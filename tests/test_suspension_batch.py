"""Coupled modes of many cases together: each has the digits, or the reason, that it has alone."""

import shutil

import numpy as np
import pytest
from campaign import campaign
from command import edit_rows, run
from straight_scenes import everything, with_changes
from suspension_cases import SUSPENSIONS, scene_from
from test_suspension_extremes import platform
from test_suspension_links import random_scene

from cablestudy.cable.damping import Damping
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.study import read_study
from cablestudy.study.case_table import tables_of
from cablestudy.study.columns import find
from cablestudy.study.prepare import prepare
from cablestudy.study.study_rows import evaluate_tables
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.group import Group
from cablestudy.study.suspension.rows import cases_of, evaluate_suspensions
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled_modes import coupled_modes_of_cases
from cablestudy.system.hanging_cables import FixedModel
from cablestudy.wind.tolerances import WIND

HELD_AT_ITS_CENTER = {"attachments": {f"e{k}": [0, 0, 0] for k in range(8)}, "center_of_mass": [0, 0, 0]}


def scenes():
    """Taut and sagging ones, light and heavy, of different accuracies, and one that is not stable."""
    parts = [
        platform(mass=m, line=line, strain=s)
        for m, line, s in ((50, 0.1, 1e-3), (5e3, 0.1, 1e-3), (1, 1.0, -4e-3), (50, 1.0, 2e-3))
    ]
    turning = platform(mass=5e3, stiffness=1e5, **HELD_AT_ITS_CENTER)
    parts += [platform(mass=500), turning, platform(mass=500, line=0.02)]
    accuracies = (1e-6, 1e-6, 1e-6, 1e-6, 1e-4, 1e-6, 1e-6)
    return [scene_from(part | {"model": {"accuracy": one}}) for part, one in zip(parts, accuracies, strict=True)]


def answer(case):
    """Its modes, or why it has none."""
    try:
        return case.modes(12)
    except NoSolutionError as reason:
        return str(reason)


@pytest.mark.parametrize("cables", campaign([100, 20], [20]))
def test_each_case_has_the_digits_that_it_has_alone(monkeypatch, cables):
    monkeypatch.setattr(type(STUDY), "cables_at_once", cables)
    together = [answer(case) for case in cases_of(scenes())]
    alone = [answer(SuspensionCase(scene)) for scene in scenes()]
    assert [one for one in alone if isinstance(one, str)] == [one for one in together if isinstance(one, str)]
    pairs = [pair for pair in zip(together, alone, strict=True) if not isinstance(pair[1], str)]
    assert len(pairs) == len(alone) - 1
    for found, expected in pairs:
        for name in ("frequency", "error", "shapes", "body_energy", "cable_energy", "damping_ratio"):
            assert np.array_equal(getattr(found, name), getattr(expected, name)), name
        assert (found.moves, found.coincident, found.cables) == (expected.moves, expected.coincident, expected.cables)


def as_alone(scenes, damping, **more):
    """Modes of all cases, or why they have none: those of each alone, equal bits."""
    cases = Group(scenes).equilibrium
    damping = [damping] * cases.lengths.shape[1]
    together = coupled_modes_of_cases(cases, 12, 1e-6, damping * len(scenes), **more)
    for place, found in enumerate(together):
        (alone,) = coupled_modes_of_cases(cases.take(np.array([place])), 12, 1e-6, damping, **more)
        if isinstance(found, Exception):
            assert str(found) == str(alone)
            continue
        for name in ("frequency", "error", "shapes", "damping_ratio", "cable_energy"):
            assert np.array_equal(getattr(found, name), getattr(alone, name), equal_nan=True), name
        assert found.cables == alone.cables
    return together


@pytest.mark.parametrize("damped", [False, True])
def test_a_case_without_modes_leaves_the_others(damped):
    found = as_alone(scenes(), Damping("hysteretic", loss_factor=0.01), damped=damped)
    assert str(found.pop(5)) == "no modes about this equilibrium: nothing holds body roll"
    assert all((one.damped is one) == damped for one in found)


@pytest.mark.parametrize(("elements", "lost"), [(2, True), (12, False)])
def test_elements_of_cases_are_those_of_each_alone(elements, lost):
    """Two are too few for cables that sag so much."""
    parts = [platform(mass=50, strain=1e-3), platform(mass=1, line=1.0, strain=-0.6), platform(mass=500, strain=2e-3)]
    found = as_alone([scene_from(part) for part in parts], Damping(ratio=0.01), model=FixedModel(elements))
    assert [isinstance(one, ConvergenceError) for one in found] == [False, lost, False]


def test_a_case_that_asks_for_more_modes_does_not_move_the_others():
    first, second = cases_of(scenes()[:2])
    assert len(first.modes(5)) == 5
    assert len(second.modes(9)) == 9
    assert np.array_equal(second.modes(9).frequency, SuspensionCase(scenes()[1]).modes(9).frequency)


def test_rows_that_share_a_motion_have_the_digits_that_they_have_alone():
    """Gains, an exposure and a mirror over the same suspension: together, and each alone."""
    text = everything(exposure=0.01, correction={"marker": "gondola.focus", "bandwidth": 5.0, "delay": 0.0})
    changes = [{"control__gain": 0.2}, {"control__gain": 0.4}, {"exposure": 0.1}, {"control": None}]
    columns = [
        find(name) for name in ("gondola.rms", "gondola.focus.exposure", "gondola.rms_open_loop", "c1.rms_tension")
    ]
    parts = [scene_from(with_changes(text, **change)) for change in changes]
    together = evaluate_suspensions(parts, columns)
    alone = [evaluate_suspensions([part], columns)[0] for part in parts]
    assert [row.cells for row in together] == [row.cells for row in alone]
    assert together[0].case.analysis.closed_loop.plant is together[2].case.analysis.closed_loop.plant
    assert together[0].cells["gondola.rms_mm"] != together[1].cells["gondola.rms_mm"]


MAST = {
    "base": str(SUSPENSIONS / "mast-guys.yaml"),
    "vary": [{"cable.preload": [1e-3, 2e4, 8e4]}],
}  # the first is refused
WINDY = {"cases": {"w": {"wind": {"speed": 30, "direction": 0.35}}}, "cable.diameter": 0.016}
LOADED = {"cables.guy1.loads": [{"at": 20, "force": [0, 0, -200]}]}
IN_REFERENCE = [*MAST["vary"], {"cable.reference.loads": [True, False]}]
LINKED = random_scene(1)
STIFFER = {f"links.{name}.stiffness": [300.0, 1e4, 1e5] for name in LINKED["links"]}
MOVED = [{"bodies.disc.mass": [30, 3, 45]}, {"points.top1.2": [4, 4.2], "cables.w1.diameter": [1e-3, 2e-3]}]
TRIFILAR = {"base": str(SUSPENSIONS / "trifilar.yaml"), "vary": MOVED}
IN_MEAN_WIND = {"base": str(SUSPENSIONS / "carlina-net-wind.yaml"), "vary": [{"wind.mean": [True, False]}]}
# ways through the solvers that no stored study takes (those are in test_digits)
STUDIES = {
    "preload": MAST | {"columns": ["max_tension", "guy1.sag", "top.z"]},
    "sag": MAST | {"vary": [{"cable.sag": [0.05, 0.2, 1]}], "columns": ["max_tension", "top.z"]},
    "loads": MAST | {"set": LOADED, "vary": IN_REFERENCE, "columns": ["max_tension", "guy1.sag", "top.x"]},
    "links": {
        "base": LINKED,
        "vary": [STIFFER | {"links.both.length": [None, 2.0, None]}],
        "columns": ["u.x", "push.force", "both.length", "frequency_2", "u.damping_ratio_z"],
    },
    "load cases": MAST | {"set": WINDY, "vary": [*MAST["vary"], {"case": ["w"]}], "columns": ["top.x", "max_tension"]},
    "geometry": TRIFILAR | {"columns": ["disc.x", "disc.pitch", "w1.preload", "disc.stiffness_xx", "frequency_1"]},
    "mean wind": IN_MEAN_WIND | {"columns": ["gondola.rms"]},
}


def numbers_and_status(study, cases):
    """Of some cases of a study, computed together: case -> numbers, status."""
    columns = [column for column in prepare(study)[0] if column.needs != "run"]
    tables, refused = tables_of(study, cases)
    assert not refused
    return {case: row[:2] for case, row in evaluate_tables(tables, columns).items()}


@pytest.mark.parametrize("name", campaign(STUDIES, [name for name in STUDIES if name != "sag"]))
def test_no_digit_of_a_row_depends_on_the_rows_beside_it(name):
    """Whole, in the reverse order, and each row alone."""
    study = read_study(STUDIES[name])
    cases = range(study.count)
    whole = numbers_and_status(study, cases)
    assert sum(None not in numbers for numbers, _ in whole.values()) > 1
    for shards in ([cases[::-1]], [[case] for case in cases]):
        parts = {}
        for shard in shards:
            parts |= numbers_and_status(study, shard)
        assert parts == whole


def test_rows_that_are_resumed_or_merged_are_those_of_one_run(tmp_path):
    """To the last byte of the table."""
    arguments = ("sweep", SUSPENSIONS / "gondola-preload.yaml", "--quiet", "--out")
    whole, resumed, merged = (tmp_path / name for name in ("whole", "resumed", "merged"))
    run(*arguments, whole)
    shutil.copytree(whole, resumed)
    unfinished = "UPDATE about SET value = '0' WHERE name = 'finished'"
    edit_rows(resumed / "gondola-preload.rows.sqlite", "DELETE FROM rows WHERE row IN (2, 4, 7)", unfinished)
    run(*arguments, resumed, "--resume")
    for shard in range(1, 4):
        run(*arguments, merged, "--shard", f"{shard}/3")
    run("merge", *arguments[1:], merged)
    first, *others = [(folder / "gondola-preload.csv").read_bytes() for folder in (whole, resumed, merged)]
    assert others == [first, first]


def test_a_case_whose_wind_and_attitude_do_not_agree_fails_alone(monkeypatch):
    """After one equilibrium only almost no wind has come to rest; of the other one no force is left that says more."""
    monkeypatch.setattr(type(WIND), "mean_wind_equilibria", 1)
    speeds = {"vary": [{"wind.speed": [1e-6, 20]}], "set": {"control": None}}
    study = read_study(IN_MEAN_WIND | speeds | {"columns": ["gondola.mean_x"]})
    (calm, windy) = numbers_and_status(study, range(2)).values()
    assert calm[1] == "ok"
    reason = "no equilibrium in the mean wind: the forces of the wind and the positions that they lead to do not agree"
    assert windy[1] == reason
    assert windy[0] == [None]
