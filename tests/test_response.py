"""Frequency responses: the same as by state space, and the features of the paper's Fig. 8."""

import numpy as np
import pytest
from cables import EA, MASS, PAPER_LENGTH
from command import CARLINA, SLACK
from scenes import choice_of

from cablestudy.control import response
from cablestudy.control.tolerances import CONTROL

FREQUENCY = np.geomspace(0.01, 100, 150)
S = 2j * np.pi * FREQUENCY


each_cable = pytest.mark.parametrize("path", [CARLINA, SLACK], ids=["taut", "slack"])


BARS = "model.elements=40"


def open_loop(path):
    """Position of the gondola over a movement of the winch on the ground, and over that of one on the gondola."""
    return [curve.value for curve in choice_of(BARS, base=path, attached="gondola").curves()]


@pytest.mark.parametrize(
    "count", [2, 300, *(CONTROL.frequency_block * n + more for n, more in ((1, 0), (1, 1), (3, -1)))]
)
def test_frequencies_have_equal_ratios_and_both_ends(count):
    blocks = list(response.frequencies(0.013, 97, count))
    assert all(len(block) == CONTROL.frequency_block for block in blocks[:-1])
    assert 0 < len(blocks[-1]) <= CONTROL.frequency_block
    np.testing.assert_array_equal(np.concatenate(blocks), np.geomspace(0.013, 97, count))


@each_cable
def test_between_ends_is_the_state_space(path):
    choice = choice_of(BARS, base=path)
    expected = choice.system().response(S, derivatives=True)
    size = np.abs(expected).max(axis=(1, 2))
    for force, displacement in ((3, 3), (0, 3), (5, 2), (4, 4)):
        computed = choice.response((force, displacement), FREQUENCY)
        assert (np.abs(computed - expected[:, force, displacement]) / size).max() < 1e-10


@pytest.mark.crossed
@each_cable
@pytest.mark.parametrize("place", ["ground", "gondola"])
def test_the_position_of_the_gondola_is_that_of_the_state_space(path, place):
    sets = BARS, f"winch.location={place}", "winch.controller.gain=0.1", "winch.controller.notch=none"
    choices = {attached: choice_of(*sets, base=path, attached=attached) for attached in ("gondola", "loop")}
    curves = {"gondola": open_loop(path)[place == "gondola"], "loop": choices["loop"].curves()[0].value}
    for attached, choice in choices.items():
        expected = choice.system().response(S)[:, 0, 0]
        np.testing.assert_allclose(curves[attached](FREQUENCY), expected, rtol=1e-9)


def test_the_phase_goes_on_from_block_to_block():
    whole = 300 * np.cumsum(np.random.default_rng(1).uniform(-0.01, 0.01, 1000))  # tens of turns
    value = np.exp(1j * whole) * np.linspace(1, 2, 1000)
    for cuts in ([], [500], range(1, 1000), [0, 3, 3, 400]):
        phase = response.Phase()
        found = np.concatenate([phase(block) for block in np.split(value, cuts)])
        np.testing.assert_allclose(np.radians(found) - found[0] * np.pi / 180, whole - whole[0], atol=1e-11)
        assert abs(found[0]) <= 180
    # where there is no number there is none, and the others are as without it
    phase, lacking = response.Phase(), value.copy()
    lacking[[0, 1, 499, 500, 999]] = np.nan
    known = np.isfinite(lacking)
    found = np.concatenate([phase(block) for block in np.split(lacking, [2, 500])])
    np.testing.assert_allclose(np.radians(found[known]), np.unwrap(np.angle(value[known])), atol=1e-11)
    assert np.isnan(found[~known]).all()


def test_figure_8():
    on_ground, on_gondola = (curve(FREQUENCY) for curve in open_loop(CARLINA))
    # slow: the gondola follows, or moves against, the winch one to one
    assert on_ground[0] == pytest.approx(1, rel=1e-3)
    assert on_gondola[0] == pytest.approx(-1, rel=1e-3)
    frequency = choice_of(BARS).case.gondola_mode.frequency[0]
    # the peak of both is the gondola on its cable, 0.72 Hz in the paper
    for curve in (on_ground, on_gondola):
        assert FREQUENCY[np.argmax(np.abs(curve))] == pytest.approx(frequency, rel=0.02)
    # B has its zero where the free cable resonates, half a wave along it: c/(4 l), A has none
    band = (FREQUENCY > 3) & (FREQUENCY < 15)
    zero = FREQUENCY[band][np.argmin(np.abs(on_gondola[band]))]
    assert zero == pytest.approx(np.sqrt(EA / MASS) / (4 * PAPER_LENGTH), rel=0.03)
    assert np.abs(on_ground[band]).min() > 5 * np.abs(on_gondola[band]).min()


def test_pole_of_an_undamped_mode_is_not_a_number():
    choice = choice_of(BARS, "cable.damping={ratio: 0}")
    value = choice.response((3, 3), choice.case.end_model.omega[[1]] / (2 * np.pi))
    assert not np.isfinite(value[0]) or abs(value[0]) > 1e6


@each_cable
def test_phase_has_no_jumps(path):
    phase = response.Phase()(open_loop(path)[0](np.geomspace(0.01, 100, 20_000)))
    assert np.abs(np.diff(phase)).max() < 90
