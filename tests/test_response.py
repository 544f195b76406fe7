"""Frequency responses: the same as by state space, and the features of the paper's Fig. 8."""

import numpy as np
import pytest
from cables import EA, MASS, PAPER_LENGTH
from command import CARLINA, SLACK

from cablestudy.control import response, statespace
from cablestudy.control.winch import Loop
from cablestudy.scene.scene import load_scene
from cablestudy.study.case import Case

FREQUENCY = response.frequencies(0.01, 100, 300)
S = 2j * np.pi * FREQUENCY


def case_of(path, *sets):
    return Case(load_scene(path, sets)[1])


@pytest.fixture(scope="module", params=[CARLINA, SLACK], ids=["taut", "slack"])
def model(request):
    return case_of(request.param, "model.elements=40").end_model


def test_frequencies_have_equal_ratios_and_both_ends():
    assert FREQUENCY[0] == 0.01
    assert FREQUENCY[-1] == 100
    np.testing.assert_allclose(FREQUENCY[1:] / FREQUENCY[:-1], 1e4 ** (1 / 299), rtol=1e-12)


@pytest.mark.parametrize(("force", "displacement"), [(3, 3), (0, 3), (5, 2), (4, 4)])
def test_between_ends_is_the_state_space(model, force, displacement):
    expected = statespace.cable(model).response(S, derivatives=True)
    computed = response.between_ends(model, FREQUENCY, force, displacement)
    size = np.abs(expected).max(axis=(1, 2))
    assert (np.abs(computed - expected[:, force, displacement]) / size).max() < 1e-10


@pytest.mark.parametrize("place", ["ground", "gondola"])
def test_winch_to_gondola_is_the_state_space(model, place):
    expected = statespace.coupled(model, 50.0, place).response(S)[:, 0, 0]
    np.testing.assert_allclose(response.winch_to_gondola(model, 50.0, place, FREQUENCY), expected, rtol=1e-9)


@pytest.mark.parametrize("place", ["ground", "gondola"])
def test_closed_loop_is_the_state_space(model, place):
    loop = Loop(model, 50.0, place, 0.1)
    expected = statespace.closed(loop).response(S)[:, 0, 0]
    np.testing.assert_allclose(response.position(loop, model, FREQUENCY), expected, rtol=1e-9)


def test_blocks_do_not_show(model):
    long = response.frequencies(0.1, 10, 2 * response.BLOCK + 3)
    whole = response.between_ends(model, long, 3, 3)
    assert len(whole) == len(long)
    few = slice(response.BLOCK - 2, response.BLOCK + 2)
    np.testing.assert_allclose(whole[few], response.between_ends(model, long[few], 3, 3), rtol=1e-12)


def test_figure_8():
    case = case_of(CARLINA)
    on_ground, on_gondola = (
        response.winch_to_gondola(case.end_model, 50.0, place, FREQUENCY) for place in ("ground", "gondola")
    )
    # slow: the gondola follows, or moves against, the winch one to one
    assert on_ground[0] == pytest.approx(1, rel=1e-3)
    assert on_gondola[0] == pytest.approx(-1, rel=1e-3)
    # the peak of both is the gondola on its cable, 0.72 Hz in the paper
    for curve in (on_ground, on_gondola):
        assert FREQUENCY[np.argmax(np.abs(curve))] == pytest.approx(case.gondola_frequency, rel=0.02)
    # B has its zero where the free cable resonates, half a wave along it: c/(4 l), A has none
    band = (FREQUENCY > 3) & (FREQUENCY < 15)
    zero = FREQUENCY[band][np.argmin(np.abs(on_gondola[band]))]
    assert zero == pytest.approx(np.sqrt(EA / MASS) / (4 * PAPER_LENGTH), rel=0.03)
    assert np.abs(on_ground[band]).min() > 5 * np.abs(on_gondola[band]).min()


def test_pole_of_an_undamped_mode_is_not_a_number():
    case = case_of(CARLINA, "cable.damping={ratio: 0}")
    frequency = case.end_model.omega[[1]] / (2 * np.pi)
    value = response.between_ends(case.end_model, frequency, 3, 3)
    assert not np.isfinite(value[0]) or abs(value[0]) > 1e6
    magnitude, phase = response.bode(np.array([1.0, complex(np.nan, np.nan), -1.0]))
    assert np.isnan(magnitude[1])
    assert np.isnan(phase[1])
    assert abs(phase[2]) == 180


def test_phase_has_no_jumps(model):
    _, phase = response.bode(response.winch_to_gondola(model, 50.0, "ground", response.frequencies(0.01, 100, 20_000)))
    assert np.abs(np.diff(phase)).max() < 90
