"""Close modes of two models of one suspension are paired by their shapes: damping ratios and errors belong to them."""

import math

import numpy as np
import pytest
from straight_scenes import case_of

from cablestudy.scene.scene import load_scene
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.report import mode_errors
from cablestudy.system.damping import damped_poles
from cablestudy.system.linear import LinearSystem

STAYS = "configs/suspensions/stays.yaml"


@pytest.mark.parametrize("count", [5, 6, 7, 8, 12])
def test_a_damper_in_the_plane_of_stays_damps_no_mode_across_it(count):
    """By symmetry; modes across and in the plane are closer to each other than the meshes resolve them."""
    modes = SuspensionCase(load_scene(STAYS)[1]).modes(count)
    across = modes.cable_energy[:, 1].sum(axis=0) > 0.5
    assert 0 < np.count_nonzero(across) < len(modes)
    assert modes.damping_ratio[across] == pytest.approx(0, abs=1e-12)
    assert (modes.damping_ratio[~across] > 1e-6).all()
    assert modes.damping_error[across] == pytest.approx(0, abs=1e-12)
    assert modes.damping_error.max() < 1e-2


@pytest.mark.parametrize("wanted", [2, 3, 4, 5, 6])
def test_of_strings_with_almost_equal_tensions_the_one_with_a_dashpot_is_damped(wanted):
    """Of equal strings beside each other one has a weak dashpot at x: c sin(n pi x/L)^2/(m L w_n) for mode n.

    Their frequencies differ by 1e-9, the meshes are good to 1e-4.
    """
    span, mass, tension, damping, at = 20.0, 2.0, 1e5, 5.0, 3.1
    points, cables = {}, {}
    for row, name in enumerate("abc"):
        own = tension * (1 + 2e-9 * row)
        points |= {f"{name}1": [0, row, 0], f"{name}2": [span, row, 0], name: {"at": [at, row, 0], "free": True}}
        slack = at / (1 + own / 1e9)
        cables[f"{name}_short"] = {"from": f"{name}1", "to": name, "unstretched_length": slack}
        cables[f"{name}_long"] = {"from": name, "to": f"{name}2", "preload": own}
    scene = {
        "cable": {"axial_stiffness": 1e9, "mass_per_length": mass, "damping": {"ratio": 0}},
        "gravity": 0.0,
        "points": points,
        "cables": cables,
        "links": {"damper": {"from": [at, 1, -1], "to": "b", "damping": damping}},
    }
    modes = case_of(scene).modes(wanted)
    first = math.pi / span * math.sqrt(tension / mass)
    expected = damping * math.sin(math.pi * at / span) ** 2 / (mass * span * first)
    damped = [move.startswith("b_long in-plane") for move in modes.moves]
    assert modes.damping_ratio == pytest.approx(np.where(damped, expected, 0.0), rel=1e-3, abs=1e-12)
    assert len(modes) < 6 or any(damped)


@pytest.mark.crossed
@pytest.mark.parametrize("damped", [0, 1, 2])
@pytest.mark.parametrize("other", [1, 2])
@pytest.mark.parametrize("turn", [0.3, 1.2])
def test_of_modes_that_coincide_not_all_need_be_asked_for(damped, other, turn):
    """Three equal oscillators, one damped; of a mixture the ratio is that of the pole with most of it."""
    stiffness, damping = 9.0, 0.06
    matrix = np.zeros((3, 3))
    matrix[damped, damped] = damping
    system = LinearSystem(np.eye(3), matrix, stiffness * np.eye(3))
    shape = np.zeros((3, 1))
    shape[damped], shape[(damped + other) % 3] = math.cos(turn), math.sin(turn)
    _, (ratio,) = damped_poles(system, np.array([3.0]), shape)
    assert ratio == pytest.approx(damping / (2 * 3.0) if turn < math.pi / 4 else 0.0, abs=1e-12)


@pytest.mark.parametrize("bars", [8, 20])
def test_bars_are_held_against_the_mode_of_their_shape(bars):
    """The errors of modes across the plane are those against such modes alone; their damping ratio has none."""
    scene = load_scene(STAYS, [f"model.elements={bars}"])[1]
    case, exact = SuspensionCase(scene), SuspensionCase(load_scene(STAYS, ["model.accuracy=1e-8"])[1])
    modes, true = case.modes(8), exact.modes(14)
    frequency, ratio = mode_errors(case, modes, 8)
    across, reference = (one.cable_energy[:, 1].sum(axis=0) > 0.5 for one in (modes, true))
    count = np.count_nonzero(across)
    expected = np.abs(modes.frequency[across] / true.frequency[reference][:count] - 1)
    assert count >= 4
    assert frequency[across] == pytest.approx(expected, rel=1e-2, abs=1e-7)
    assert (ratio[across] == 0).all()
    assert np.isfinite(ratio[~across]).all()
