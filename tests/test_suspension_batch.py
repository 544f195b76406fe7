"""Coupled modes of many cases together: each has the digits, or the reason, that it has alone."""

import numpy as np
import pytest
from straight_scenes import everything, with_changes
from test_suspension_extremes import platform

from cablestudy.errors import NoSolutionError
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.suspension import group
from cablestudy.study.suspension.case import SuspensionCase, cases_of
from cablestudy.study.suspension.columns import find
from cablestudy.study.suspension.rows import evaluate_suspensions

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
    return [
        SuspensionScene.model_validate(part | {"model": {"accuracy": accuracy}})
        for part, accuracy in zip(parts, accuracies, strict=True)
    ]


def answer(case):
    """Its modes, or why it has none."""
    try:
        return case.modes(12)
    except NoSolutionError as reason:
        return str(reason)


@pytest.mark.parametrize("cables", [100, 20])
def test_each_case_has_the_digits_that_it_has_alone(monkeypatch, cables):
    monkeypatch.setattr(group, "TOGETHER", cables)
    together = [answer(case) for case in cases_of(scenes())]
    alone = [answer(SuspensionCase(scene)) for scene in scenes()]
    assert [one for one in alone if isinstance(one, str)] == [one for one in together if isinstance(one, str)]
    pairs = [pair for pair in zip(together, alone, strict=True) if not isinstance(pair[1], str)]
    assert len(pairs) == len(alone) - 1
    for found, expected in pairs:
        for name in ("frequency", "error", "shapes", "body_energy", "cable_energy", "damping_ratio"):
            assert np.array_equal(getattr(found, name), getattr(expected, name)), name
        assert (found.moves, found.coincident, found.cables) == (expected.moves, expected.coincident, expected.cables)


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
    parts = [SuspensionScene.model_validate(with_changes(text, **change)) for change in changes]
    together = evaluate_suspensions(parts, columns)
    alone = [evaluate_suspensions([part], columns)[0] for part in parts]
    assert [row.cells for row in together] == [row.cells for row in alone]
    assert together[0].case.in_wind.movement.linear is together[2].case.in_wind.movement.linear
    assert together[0].cells["gondola.rms_mm"] != together[1].cells["gondola.rms_mm"]
