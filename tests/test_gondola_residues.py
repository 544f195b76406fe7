"""The gondola in the wind by few poles: against fine integration of the response with every mode; its parts."""

from functools import partial

import numpy as np
import pytest
from scenes import scene
from test_windrms import CORNER, force, rms_of

from cablestudy.control.gondola_residues import at_rest, closed
from cablestudy.study import windrms
from cablestudy.study.cable_wind import CableWind
from cablestudy.study.case import Case
from cablestudy.wind.coherence import ratio_of

HYSTERETIC, VOIGT = (f"cable.damping={{model: {law}}}" for law in
                     ("hysteretic, loss_factor: 0.2", "kelvin_voigt, time: 2 ms, viscous: 0.01"))  # fmt: skip
THIN, THICK = (("cable.area=null", f"cable.diameter={size} mm") for size in (1.85, 5))
SLOW, LATE = "winch.controller.gain=0.03", "winch.delay=80 ms"
LAWS = [
    (),
    (HYSTERETIC, SLOW),
    (VOIGT, SLOW),
    (LATE, SLOW),
    (HYSTERETIC, LATE, SLOW),
    ("gondola.mass=3 kg", VOIGT, SLOW),
]


def loop_of(*sets):
    return Case(scene("model={elements: 20}", *sets)).loop.whole


def fine(loop):
    """RMS of place and velocity with and without the loop, by trapezoids over |x/F|^2, dense near each pole."""
    poles = np.concatenate([loop.open_poles, loop.closed_poles, loop.excited.poles])
    poles = poles[poles.imag > 0]
    width = np.maximum(np.abs(poles.real) / np.abs(poles), 1e-12)
    beside = np.sinh(np.linspace(-1, 1, 3001) * np.arcsinh(0.3 / width)[:, None]) * width[:, None]
    around = np.abs(poles)[:, None] / (2 * np.pi) * np.exp(beside)
    frequency = np.unique(np.concatenate([np.geomspace(1e-7, 1e4, 60_001), around.ravel()]))
    log = np.log(frequency)
    found = []
    for answer in loop.compliances(2j * np.pi * frequency)[::-1]:
        spectrum = np.abs(answer) ** 2 * force(frequency) * frequency
        found += [np.trapezoid(spectrum, log), np.trapezoid(spectrum * (2 * np.pi * frequency) ** 2, log)]
    return np.sqrt(found)


@pytest.mark.parametrize("sets", LAWS)
def test_rms_by_poles_is_a_fine_integral_with_every_mode(sets):
    loop = loop_of(*sets)
    loop.check_stable()
    found = windrms.respond(loop, force, CORNER)
    assert rms_of(found) == pytest.approx(fine(loop), rel=2e-6)
    assert found.error < 1e-6


@pytest.mark.parametrize("sets", LAWS)
def test_the_sum_over_poles_is_the_response(sets):
    """With every mode; of a delay the response itself, and its sharp poles leave a smooth rest."""
    loop = loop_of(*sets)
    system = loop.plant.system_of(loop.excited)
    inputs = np.eye(len(system.mass))[:, -1:]
    s = 2j * np.pi * np.geomspace(1e-3, 30, 50)
    alone, held = loop.compliances(s)
    assert at_rest(system, inputs).response(s)[:, 0, 0] == pytest.approx(alone, rel=1e-7)
    both = closed(loop, system, inputs).response(s)[:, :, 0]
    assert both[:, 0] == pytest.approx(held, rel=1e-7)
    assert np.abs(both[:, 1]) == pytest.approx(np.abs(loop.gain * loop.controller(s) * held), rel=1e-7)


@pytest.mark.parametrize("sets", [(), (HYSTERETIC,), (VOIGT,)])
def test_vectors_stand_for_the_modes_left_out(sets):
    """More of them, a smaller error of the compliance near the gondola's frequency; without any it is exact."""
    plant = loop_of(*sets).plant
    system = plant.system_of(plant.excited)
    s = 1j * plant.main * np.array([0.1, 0.9, 1.1, 2.0])
    exact = at_rest(system, np.eye(len(system.mass))[:, -1:]).response(s)[:, 0, 0]
    errors = []
    for orders in (0, 1, 2):
        space = system.few(plant.pole_modes, orders)
        few = system.within(space)
        answer = at_rest(few, np.eye(len(few.mass))[:, -1:]).response(s)[:, 0, 0]
        errors.append(np.abs(answer / exact - 1).max())
    assert errors[2] < 1e-8
    assert errors[2] < 0.1 * errors[1] < 0.01 * errors[0]
    assert (system.few(np.arange(len(plant.excited.omega)), 1) == np.eye(len(system.mass))).all()


@pytest.mark.parametrize("sets", [
    ("cable.damping={model: kelvin_voigt, time: 5 ms}", "cable.ends=[[0, 0, 0], [160 m, 0, 95 m]]", *THICK),
    ("cable.damping={model: hysteretic, loss_factor: 0.2}", "cable.elastic_modulus=10 GPa", *THIN),
    (HYSTERETIC, *THICK),
])  # fmt: skip
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_the_stated_error_in_wind_along_the_cable_is_true(sets, tolerance):
    """Against all modes of the cable, which damped strain couples; the error is that of the variance."""
    case = Case(scene("model={elements: 4, order: 8}", "winch.controller.gain=0.01", *sets))
    on_cable, loop, corner = CableWind(case), case.loop_in_air, case.scene.wind.speed / case.scene.wind.length_scale
    exact, found = (
        windrms.respond_along(loop, on_cable.model, partial(on_cable.gusts, "along"), corner, size)
        for size in (1e-13, tolerance)
    )
    assert (2 * np.abs(np.divide(rms_of(found), rms_of(exact)) - 1) <= found.error).all()
    assert found.error < max(tolerance, 2e-6)


def test_covariances_of_loads_on_a_cable_are_those_of_their_sums():
    case = Case(scene("cable.ends=[[0, 0, 0], [160 m, 0, 95 m]]"))
    reach = CableWind(case)
    gusts = reach.gusts("along", (1e-3, 1e3))
    ratio = ratio_of(case.scene.wind, reach.length)(np.array([1e-3, 0.3, 20.0]))
    weights = np.random.default_rng(3).normal(size=gusts.loads.shape[1])
    summed = np.einsum("n,cnr->cr", weights, gusts.loads)[:, None]
    covariance = gusts.rod.covariance(gusts.loads, ratio)
    assert weights @ covariance @ weights == pytest.approx(gusts.rod.variance(summed, ratio), rel=1e-9)
    # and between the ratios for which they are computed
    frequency = np.geomspace(1e-3, 1e2, 37)
    columns = np.tile(weights[:, None], (len(frequency), 1, 1)) + 0j
    found = (weights @ gusts.matrix_times(frequency, columns))[:, 0].real
    expected = gusts.rod.variance(summed, ratio_of(case.scene.wind, reach.length)(frequency))
    assert found == pytest.approx(gusts.spectrum(frequency) * expected, rel=1e-8)
