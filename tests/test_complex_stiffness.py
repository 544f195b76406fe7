"""`control/complex_stiffness.py`: bars in long arithmetic, the continuous cable, closed forms, the truth of scenes."""

from functools import cache
from itertools import product

import complex_stiffness
import numpy as np
import pytest
from cables import condensed_stiffness
from campaign import campaign
from complex_stiffness import ComplexStiffness, damped_mode, excited
from mpmath import mp
from random_scenes import expected, scene_data, scene_of, truth_of
from references import bars, continuous_cable
from scenes import GONDOLA, INCLINED, PAPER, SAGGING, Twin, scene

from cablestudy.errors import NoSolutionError
from cablestudy.study.case import Case
from cablestudy.study.columns import find
from cablestudy.study.row import evaluate

LOADED = Twin(175.68, 60.49, 186.0, loads=((46.5, (3.0, 0.0, -20.0)), (93.0, (0.0, 0.0, 5.0))))
STEEP = Twin(0.5, 185.8, 184.6)
CABLES = {"taut": PAPER, "sagging": SAGGING, "inclined": INCLINED, "loaded": LOADED, "steep": STEEP}
NAMES = pytest.mark.parametrize("name", CABLES)
PLACES = (0.3j, -0.2 + 5.0j, -7.0 + 9.0j, -1.0 + 70.0j, -3.0)
LOSSES = (0.0, 1e-5j, 0.3 + 0.2j, 2j, 1e4j, 1e9 + 1e9j)


@cache
def of(name, *model):
    case = Case(CABLES[name].scene(*(model or ("model.accuracy=1e-8",))))
    case = case if model else case.refined(2 if name == "loaded" else 1, 30)
    return ComplexStiffness(excited(case), case.span.frame[:, 0])


@NAMES
def test_bars_are_those_eliminated_one_by_one_in_long_arithmetic(name):
    twin, found = CABLES[name], of(name, "model.elements=12")
    chain = twin.chain(12)
    for s, c in campaign(product(PLACES, LOSSES), zip((*PLACES, PLACES[1]), LOSSES, strict=True)):
        value = bars.eliminated(chain, *twin.bar, s, c)[3, 3]
        assert abs(found(s, c).stiffness - value) < 1e-11 * abs(value), (s, c)


@NAMES
def test_an_element_of_high_order_is_the_continuous_cable(name):
    twin, found = CABLES[name], of(name)
    for s in PLACES[:3]:
        for eta in (0.0, 1e-4, 0.3, 2.0):
            value, error = continuous_cable.dynamic_end_stiffness(
                *twin.cable, -1j * s, n=48, loads=twin.loads, eta=eta, full_output=True
            )
            assert abs(found(s, 1j * eta).stiffness / value[0, 0] - 1) < 1e-9 + 10 * error, (s, eta)


@pytest.mark.crossed
@NAMES
@pytest.mark.parametrize(("mass", "order"), [("lumped", 1), ("lumped", 4), ("consistent", 3), ("blended", 1)])
def test_every_order_and_mass_is_the_dense_matrix_condensed(name, mass, order):
    case = Case(CABLES[name].scene("model.elements=8", f"model.order={order}", f"model.mass={mass}"))
    found, along = ComplexStiffness(excited(case), case.span.frame[:, 0]), case.span.frame[:, 0]
    for s in PLACES[:4]:
        for c in LOSSES[:4]:
            condensed = condensed_stiffness(excited(case), s, c)[3:, 3:]
            value = along @ condensed @ along
            assert abs(found(s, c).stiffness - value) < 1e-9 * np.abs(condensed).max()


@NAMES
def test_its_slopes_and_its_energies(name):
    found, size = of(name), 1e-6
    for s, c in ((4.0j, 0.1j), (-2.0 + 7.0j, 0.3 + 0.2j)):
        here = found(s, c)
        by_s = (found(s * (1 + size), c).stiffness - found(s * (1 - size), c).stiffness) / (2 * size * s)
        by_c = (found(s, c + size).stiffness - found(s, c - size).stiffness) / (2 * size)
        assert by_s == pytest.approx(2 * s * here.inertia, rel=1e-5)
        assert by_c == pytest.approx(here.elastic, rel=1e-5, abs=1e-9 * abs(here.stiffness))
        # power: what goes in at the end is what the strain, the tension and the mass take up
        energies = here.bend + (1 + c) * here.strain + s * s * here.moving_mass
        assert here.stiffness == pytest.approx(energies, rel=1e-10)


# the damping ratio


def follow(stiffness, omega, law, amount):
    return damped_mode(stiffness, GONDOLA, omega, law, amount)[0]


@pytest.mark.parametrize("amount", [0.0, 1e-14, 1e-3, 0.5, 2.0, 1e6])
def test_one_bar_is_a_spring_with_a_dashpot(amount):
    case = Case(PAPER.scene("model.elements=1", "gravity=0"))
    stiffness, mass = ComplexStiffness(excited(case), case.span.frame[:, 0]), GONDOLA + PAPER.mass * PAPER.length / 2
    omega = float(np.sqrt(PAPER.stiffness / PAPER.length / mass))
    assert 2 * np.pi * case.gondola_mode.frequency[0] == pytest.approx(omega, rel=1e-12)
    assert follow(stiffness, omega, "hysteretic", amount) == pytest.approx(np.sin(np.arctan(amount) / 2), rel=1e-12)
    found = follow(stiffness, omega, "kelvin_voigt", amount)
    assert found == pytest.approx(min(1.0, amount * omega / 2), rel=1e-12)


@pytest.mark.crossed
@NAMES
@pytest.mark.parametrize("law", ["hysteretic", "kelvin_voigt"])
@pytest.mark.parametrize("amount", [1e-9, 1e-3, 0.3])
def test_bars_with_a_mass_in_long_arithmetic(name, law, amount):
    """Each digit of a ratio of 1e-13 too: a steep cable, whose end hardly strains it along x."""
    twin, case = CABLES[name], Case(CABLES[name].scene("model.elements=4"))
    omega = 2 * np.pi * case.gondola_mode.frequency[0]
    amount = amount if law == "hysteretic" else amount / omega
    found = follow(ComplexStiffness(excited(case), case.span.frame[:, 0]), omega, law, amount)
    begin, chain = 1j * omega, twin.chain(4)
    for share in (0.2, 0.6, 1.0)[0 if amount * omega > 0.1 else 2 :]:
        rate = share * mp.mpf(amount)
        loss = (lambda s, rate=rate: rate * s) if law == "kelvin_voigt" else (lambda s, rate=rate: 1j * rate)
        begin = bars.damped_pole(chain, *twin.bar, GONDOLA, begin, loss)
    assert found == pytest.approx(float(-begin.real / abs(begin)), rel=1e-9)


# almost inextensible, steep, slack, with loads, hardly and heavily damped: rounding spoilt the modes of all of them
@pytest.mark.parametrize("seed", [110003, 110006, 110040, 110041, 120020, 500045, 500077, 500104, 500136, 1004558])
def test_random_scenes(seed):
    data = scene_data(seed)
    value, doubt = expected(truth_of(data, Case(scene_of(data, 1e-4)).span), data, "gondola_damping_ratio")
    row = evaluate(scene_of(data, 1e-8), [find("gondola_damping_ratio"), find("error_estimate")])
    assert row.cells["status"] == "ok"
    assert row.cells["gondola_damping_ratio"] == pytest.approx(value, rel=1e-8 + 3 * doubt)


def test_a_mode_that_moves_across_its_cable_is_not_damped():
    for sets in (("cable.ends=[[0, 0, 0], [0, 0, 185.8]]",), ("cable.ends=[[0, 0, 0], [0, 185.8, 0]]",)):
        case = Case(scene("cable.damping={model: hysteretic, loss_factor: 2}", *sets))
        assert case.gondola_mode.damping_ratio[0] == 0.0


def test_a_mode_that_meets_its_conjugate_creeps():
    """Up to the damping at which the two meet it oscillates; beyond, one of both returns slowly. Taut: a spring's."""
    case = Case(PAPER.scene("model.accuracy=1e-8")).refined(1, 16)
    stiffness, omega = (
        ComplexStiffness(excited(case), case.span.frame[:, 0]),
        2 * np.pi * case.gondola_mode.frequency[0],
    )
    critical = 2 / omega
    below, above = (follow(stiffness, omega, "kelvin_voigt", share * critical) for share in (0.99, 1.02))
    assert 0.98 < below < 1.0
    assert above == 1.0
    assert follow(stiffness, omega, "kelvin_voigt", 1e6 * critical) == 1.0


def test_what_cannot_be_followed_is_refused(monkeypatch):
    monkeypatch.setattr(complex_stiffness, "FOLLOWED", 2)
    with pytest.raises(NoSolutionError, match="damped so much that it is no oscillation"):
        follow(of("sagging"), 14.6, "kelvin_voigt", 2.0)
