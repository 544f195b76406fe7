"""Damping ratio of the gondola by the strain of its cable: bars in long arithmetic, closed forms, truth of scenes."""

import numpy as np
import pytest
from mpmath import mp
from random_scenes import expected, scene_data, scene_of, truth_of
from references import bars
from scenes import GONDOLA, INCLINED, PAPER, SAGGING, Twin, scene
from test_ends import damped

from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate

LOADED = Twin(175.68, 60.49, 186.0, loads=((46.5, (3.0, 0.0, -20.0)), (93.0, (0.0, 0.0, 5.0))))
STEEP = Twin(0.5, 185.8, 184.6)
CABLES = {"taut": PAPER, "sagging": SAGGING, "inclined": INCLINED, "loaded": LOADED, "steep": STEEP}


def ratio_of(scene):
    """Damping ratio of the gondola. [-]"""
    return CableCase(scene).gondola_mode.damping_ratio[0]


@pytest.mark.parametrize("amount", [0.0, 1e-14, 1e-3, 0.5, 2.0])
def test_one_bar_is_a_spring_with_a_dashpot(amount):
    bar, mass = ("model.elements=1", "gravity=0"), GONDOLA + PAPER.mass * PAPER.length / 2
    omega = float(np.sqrt(PAPER.stiffness / PAPER.length / mass))
    assert 2 * np.pi * CableCase(PAPER.scene(*bar)).gondola_mode.frequency[0] == pytest.approx(omega, rel=1e-12)
    found = ratio_of(PAPER.scene(*bar, damped("hysteretic", amount)))
    assert found == pytest.approx(np.sin(np.arctan(amount) / 2), rel=1e-12)
    found = ratio_of(PAPER.scene(*bar, damped("kelvin_voigt", amount)))
    assert found == pytest.approx(min(1.0, amount * omega / 2), rel=1e-12)


@pytest.mark.crossed
@pytest.mark.parametrize("name", CABLES)
@pytest.mark.parametrize("law", ["hysteretic", "kelvin_voigt"])
@pytest.mark.parametrize("amount", [1e-9, 1e-3, 0.3])
def test_bars_with_a_mass_in_long_arithmetic(name, law, amount):
    """Each digit of a ratio of 1e-13 too: a steep cable, whose end hardly strains it along x."""
    twin = CABLES[name]
    omega = 2 * np.pi * CableCase(twin.scene("model.elements=4")).gondola_mode.frequency[0]
    amount = amount if law == "hysteretic" else amount / omega
    pole, chain = 1j * omega, twin.chain(4)
    for share in (0.2, 0.6, 1.0)[0 if amount * omega > 0.1 else 2 :]:
        rate = share * mp.mpf(amount)
        loss = (lambda s, rate=rate: rate * s) if law == "kelvin_voigt" else (lambda s, rate=rate: 1j * rate)
        pole = bars.damped_pole(chain, *twin.bar, GONDOLA, pole, loss)
    found = ratio_of(twin.scene("model.elements=4", damped(law, amount)))
    assert found == pytest.approx(float(-pole.real / abs(pole)), rel=1e-9)


# almost inextensible, steep, slack, with loads, hardly and heavily damped: rounding spoilt the modes of all of them
@pytest.mark.parametrize("seed", [110003, 110006, 110040, 110041, 120020, 500045, 500077, 500104, 500136, 1004558])
def test_random_scenes(seed):
    data = scene_data(seed)
    value, doubt = expected(truth_of(data, CableCase(scene_of(data, 1e-4)).span), data, "gondola_damping_ratio")
    row = evaluate(scene_of(data, 1e-8), [find("gondola_damping_ratio"), find("error_estimate")])
    assert row.cells["status"] == "ok"
    assert row.cells["gondola_damping_ratio"] == pytest.approx(value, rel=1e-8 + 3 * doubt)


def test_a_mode_that_moves_across_its_cable_is_not_damped():
    for sets in (("cable.ends=[[0, 0, 0], [0, 0, 185.8]]",), ("cable.ends=[[0, 0, 0], [0, 185.8, 0]]",)):
        assert ratio_of(scene("cable.damping={model: hysteretic, loss_factor: 2}", *sets)) == 0.0


def test_a_mode_that_meets_its_conjugate_creeps():
    """Up to the damping at which the two meet it oscillates; beyond, one of both returns slowly. Taut: a spring's."""
    fine = "model.accuracy=1e-8"
    critical = 1 / (np.pi * CableCase(PAPER.scene(fine)).gondola_mode.frequency[0])
    below, above = (ratio_of(PAPER.scene(fine, damped("kelvin_voigt", share * critical))) for share in (0.99, 1.02))
    assert 0.98 < below < 1.0
    assert above == 1.0
