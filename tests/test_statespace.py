"""State space against dense bars, the continuous cable and the transfer functions of the loop; frequency responses."""

import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, PAPER_LENGTH, G
from command import CARLINA, SLACK
from references import bars
from references.bars_in_wind import BarsInWind
from references.dense import condensed
from references.loop_matrix import notch as notched
from scenes import choice_of, scene

from cablestudy.control import response
from cablestudy.control.loop import Loop
from cablestudy.control.notch import Notch
from cablestudy.control.one_cable import state_space
from cablestudy.control.tolerances import CONTROL
from cablestudy.study import ssm
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.ssm import nodal_shapes

RATIO, GONDOLA_MASS = 0.01, 50.0
GONDOLA = (GONDOLA_MASS, 0.0)
OMEGA = np.geomspace(0.1, 1000, 40)
SELECTIONS = {"all": slice(None), "third": slice(0, None, 3), "one": slice(1, 2), "none": slice(0, 0)}
each_location = pytest.mark.parametrize("location", ["ground", "gondola"])
each_cable = pytest.mark.parametrize("path", [CARLINA, SLACK], ids=["taut", "slack"])
each_damping = pytest.mark.parametrize("damping", ["modal", "kelvin_voigt"])
DAMPINGS = {"modal": "{ratio: 0.01}", "kelvin_voigt": "{time: 0.3 ms}", "hysteretic": "{loss_factor: 0.02}"}
NOTCH_NUMBERS = 2 * np.pi * 0.7, 0.05, 2 * np.pi * 10, 1.0
NOTCH = Notch(*NOTCH_NUMBERS)
each_notch = pytest.mark.parametrize("notch", [NOTCH, None], ids=["notch", "none"])


def case_of(path, *sets):
    return CableCase(scene(*sets, base=path))


@pytest.fixture(scope="module")
def model():
    return case_of(CARLINA).end_model


@pytest.fixture(scope="module", params=[CARLINA, SLACK], ids=["taut", "slack"])
def either(request):
    """With modal damping."""
    return case_of(request.param, "model.elements=40").end_model


@pytest.fixture(scope="module")
def dense():
    """The paper's 40 bars: K, M, C of interior and ends from `references.bars`, modes damped by 1 %."""
    chain = bars.solve_spatial((PAPER_CHORD, 0, 0), PAPER_LENGTH, EA, MASS * G, 40)
    K, M = bars.matrices(chain, PAPER_LENGTH, EA, MASS)
    modes = bars.modes(chain, PAPER_LENGTH, EA, MASS)
    weighted = M[3:-3, None] * modes.vectors
    C = np.zeros_like(K)
    C[3:-3, 3:-3] = weighted * (4 * np.pi * RATIO * modes.frequencies) @ weighted.T
    return K, np.diag(M), C, modes


def dense_stiffness(dense, s):
    """Six ends, interior condensed, at one s."""
    K, M, C, _ = dense
    return condensed(K + s * C + s**2 * M, np.r_[0:3, len(K) - 3 : len(K)])


def chosen(model, name):
    return np.arange(len(model.omega))[SELECTIONS[name]]


def largest(difference, reference):
    """Difference relative to the largest entry at each frequency."""
    return (np.abs(difference).max(axis=(1, 2)) / np.abs(reference).max(axis=(1, 2))).max()


def test_eigenvalues_are_modes_and_damping(model, dense):
    value = np.linalg.eigvals(state_space(model).a)
    value = value[value.imag > 0]
    order = np.argsort(np.abs(value))
    # references.bars: dense eigh of the textbook matrices
    np.testing.assert_allclose(np.abs(value[order]) / (2 * np.pi), dense[3].frequencies, rtol=1e-8)
    np.testing.assert_allclose(np.sort(np.abs(value)), np.sort(model.omega), rtol=1e-12)
    np.testing.assert_allclose(-value.real / np.abs(value), RATIO, rtol=1e-9)


def test_response_is_that_of_dense_bars(model, dense):
    computed = state_space(model).response(1j * OMEGA, derivatives=True)
    expected = np.array([dense_stiffness(dense, 1j * w) for w in OMEGA])
    assert largest(computed - expected, expected) < 1e-9


@pytest.mark.crossed
@pytest.mark.parametrize("selection", SELECTIONS)
@each_damping
@pytest.mark.parametrize("residual", [True, False])
def test_response_is_the_dynamic_end_stiffness(damping, selection, residual):
    model = case_of(CARLINA, f"cable.damping={DAMPINGS[damping]}").end_model
    kept = chosen(model, selection)
    reduced = model.condense(kept) if residual else model.truncate(kept)
    expected = reduced.dynamic_stiffness(1j * OMEGA)
    system = state_space(model, kept, residual)
    assert largest(system.response(1j * OMEGA, derivatives=True) - expected, expected) < 1e-10


@pytest.mark.parametrize("selection", SELECTIONS)
def test_slow_movements_meet_the_modal_damping_of_all_modes(either, selection):
    s = np.array([1e-4j * either.omega[0]])
    reduced = state_space(either, chosen(either, selection)).response(s, derivatives=True)
    whole = either.dynamic_stiffness(s)
    assert largest(reduced.imag - whole.imag, whole.imag) < 1e-6


def test_what_is_left_for_derivatives_is_the_mass_of_the_ends(model):
    first, second = state_space(model).derivatives
    assert not first.any()
    np.testing.assert_allclose(second, np.eye(6) * MASS * PAPER_LENGTH / 80, atol=1e-9)  # half a bar each


@pytest.mark.parametrize("selection", SELECTIONS)
def test_static_gain_is_exact_for_any_selection(either, selection):
    gain = state_space(either, chosen(either, selection)).response([0j])[0]
    assert np.abs(gain - either.stiffness).max() < 1e-10 * np.abs(either.stiffness).max()
    along = either.stiffness[3, 3]
    assert gain[3, 3].real == pytest.approx(along, rel=1e-10)


def end_stiffness_of_bars():
    """Static, along x: what five axial modes alone leave of K22 of 40 dense bars, and all of them. [N/m]"""
    chain, cable = bars.solve_spatial((PAPER_CHORD, 0, 0), PAPER_LENGTH, EA, MASS * G, 40), (PAPER_LENGTH, EA, MASS)
    modes = bars.modes(chain, *cable)
    axial = np.flatnonzero(modes.axial > 0.5)[:5]
    taken = (modes.participation[axial, 0] / (2 * np.pi * modes.frequencies[axial])) ** 2
    return bars.matrices(chain, *cable)[0][-3, -3] - taken.sum(), chain.end_stiffness[0, 0]


def test_plain_truncation_of_five_axial_modes_is_thirty_times_too_stiff(model):
    case = case_of(CARLINA)
    axial = np.array(case.dynamics.modes(117).select("axial")[:5])
    gain = state_space(model, axial, residual=False).response([0j])[0, 3, 3].real
    truncated, exact = end_stiffness_of_bars()
    assert gain == pytest.approx(truncated, rel=1e-9)
    assert truncated > 30 * exact
    assert state_space(model, axial).response([0j])[0, 3, 3].real == pytest.approx(exact, rel=1e-9)
    # K11 of a bar: EA over its unstretched length, and nothing taken off
    empty = state_space(model, np.arange(0), residual=False)
    assert empty.d[3, 3] == pytest.approx(EA * 40 / PAPER_LENGTH, rel=1e-4)  # bars hardly inclined


def test_entries_of_a_grow_like_the_frequency(either):
    assert np.abs(state_space(either).a).max() == pytest.approx(either.omega.max(), rel=1e-12)


@each_cable
def test_entries_of_the_coupled_model_grow_like_the_frequency(path):
    models = [case_of(path, f"model.elements={count}").end_model for count in (20, 80)]
    ratio = [np.abs(state_space(model, gondola=GONDOLA).a).max() / model.omega.max() for model in models]
    assert models[1].omega.max() > 3.5 * models[0].omega.max()
    assert ratio[1] < 1.1 * ratio[0]


def test_hysteretic_modes_lose_half_the_loss_factor_times_their_elastic_share():
    model = case_of(CARLINA, f"cable.damping={DAMPINGS['hysteretic']}").end_model
    value = np.linalg.eigvals(state_space(model).a)
    value = value[value.imag > 0]
    for omega, ratio in zip(model.omega, model.damping_ratio, strict=True):
        nearest = value[np.abs(np.abs(value) - omega) < 1e-9 * omega]
        assert np.abs(-nearest.real / np.abs(nearest) - ratio).min() < 1e-9
    # the gondola on a taut cable: half the loss factor, whatever the number of modes (DESIGN 6)
    value = np.linalg.eigvals(state_space(model, gondola=GONDOLA).a)
    gondola = value[np.argmin(np.abs(np.abs(value) - np.sqrt(model.stiffness[3, 3] / GONDOLA_MASS)))]
    assert -gondola.real / abs(gondola) == pytest.approx(0.01, rel=0.02)


def fewest(share, error):
    return ssm.fewest_modes(share, np.arange(len(share)), error, "all", ("end_2_x", "end_2_x"))


def test_error_keeps_the_fewest_modes(model):
    share = model.inertia_share(3, 3)
    assert share.sum() == pytest.approx(1, rel=1e-12)
    for error in (0.5, 0.1, 1e-3, 1e-12):
        kept = fewest(share, error)
        assert np.delete(share, kept).sum() <= error
        largest_first = np.sort(share)[::-1]
        assert 1 - largest_first[: len(kept) - 1].sum() > error  # one fewer does not do


def test_error_bounds_the_inertia_that_the_response_lacks():
    model = case_of(CARLINA, "cable.damping={ratio: 0}").end_model
    kept = fewest(model.inertia_share(3, 3), 1e-2)
    omega = 0.1 * model.omega.min()
    exact = state_space(model).response([1j * omega])[0, 3, 3]
    less = state_space(model, kept).response([1j * omega])[0, 3, 3]
    carried = (model.participation[:, 3] ** 2 / model.omega**4).sum()
    assert abs(less - exact) < 1.2e-2 * carried * omega**2


def transfers(model, location, s):
    """k_xx and k_xu of the kept modes."""
    stiffness = model.dynamic_stiffness(s)
    return stiffness, stiffness[:, 3, 3], stiffness[:, 3, 3 if location == "gondola" else 0]


@pytest.mark.crossed
@each_location
@pytest.mark.parametrize("selection", ["all", "third", "none"])
@each_damping
@each_cable
def test_coupled_model_is_gondola_on_end_stiffness(path, damping, selection, location):
    model = case_of(path, "model.elements=40", f"cable.damping={DAMPINGS[damping]}").end_model
    kept, s = chosen(model, selection), 1j * OMEGA
    stiffness, own, driven = transfers(model.condense(kept), location, s)
    compliance = 1 / (GONDOLA_MASS * s**2 + own)
    system = state_space(model, kept, gondola=GONDOLA, location=location)
    computed = system.response(s, derivatives=True)
    for column, moved in ((0, -driven * compliance), (1, compliance)):
        np.testing.assert_allclose(computed[:, 0, column], moved, rtol=1e-9)
        np.testing.assert_allclose(computed[:, 1, column], s * moved, rtol=1e-9)
    force = stiffness[:, :, 3] * compliance[:, None]
    assert np.abs(computed[:, 2:, 1] - force).max() < 1e-9 * np.abs(force).max()
    if damping == "modal":  # the position of the gondola needs no derivatives
        assert not any(matrix[0].any() for matrix in system.derivatives)


@pytest.mark.crossed
@each_location
@each_notch
@each_damping
def test_closed_loop_is_the_transfer_function(damping, notch, location):
    model = case_of(CARLINA, f"cable.damping={DAMPINGS[damping]}").end_model
    kept, s = chosen(model, "third"), 1j * OMEGA
    stiffness, own, driven = transfers(model.condense(kept), location, s)
    # u = -C x on the ground, +C x on the gondola, C = (k/s) N: DESIGN 7
    sign = 1 if location == "gondola" else -1
    control = sign * 0.3 / s * (notched(s, *NOTCH_NUMBERS) if notch else 1.0)
    position = 1 / (GONDOLA_MASS * s**2 + own + driven * control)
    system = state_space(model, kept, gondola=GONDOLA, location=location, loop=Loop(None, None, 0.3, (notch,)))
    named = system.input_names.index

    def check(computed, moved, winch, rtol):
        end = moved if location == "ground" else moved + winch
        forces = stiffness[:, :, 3] * end[:, None]
        forces = forces + (stiffness[:, :, 0] * winch[:, None] if location == "ground" else 0)
        np.testing.assert_allclose(computed[:, 0], moved, rtol=rtol)
        np.testing.assert_allclose(computed[:, -1], winch, rtol=1e-9)
        assert np.abs(computed[:, 2:-1] - forces).max() < 1e-9 * np.abs(forces).max()

    computed = system.response(s)[:, :, named("force_gondola")]
    check(computed, position, control * position, 1e-10)
    np.testing.assert_allclose(computed[:, 1], s * position, rtol=1e-10)
    # to a reference r the winch answers by C (x - r)
    followed = driven * control * position
    computed = system.response(s, derivatives=True)[:, :, named("reference")]
    check(computed, followed, control * (followed - 1), 1e-9)
    first, second = system.derivatives
    assert not second.any()
    assert not np.delete(first, named("reference"), axis=1).any()
    assert len(system.states) == len(system.a)
    assert len(system.outputs) == len(system.c)


PID = ("proportional_gain=0.018", "derivative_gain=0.009", f"derivative_filter={31 / (2 * np.pi)!r} Hz")
LAWS = {
    "delay": (["winch.delay=20 ms"], lambda s: 1 / s * np.exp(-0.02 * s)),
    "long delay": (["winch.delay=300 ms"], lambda s: 1 / s * np.exp(-0.3 * s)),
    "lag": ([f"winch.bandwidth={31 / (2 * np.pi)!r} Hz"], lambda s: 1 / s / (1 + s / 31.0)),
    "PID": (
        ["winch.delay=10 ms", f"winch.bandwidth={125 / (2 * np.pi)!r} Hz", *(f"winch.controller.{key}" for key in PID)],
        lambda s: (1 / s + 0.06 + 0.03 * s / (1 + s / 31.0)) / (1 + s / 125.0) * np.exp(-0.01 * s),
    ),
}


@pytest.mark.crossed
@each_location
@pytest.mark.parametrize("name", LAWS)
def test_another_law_than_an_integrator(name, location, model):
    sets, exact = LAWS[name]
    sets = ["winch.controller.gain=0.3", "winch.controller.notch.frequency=0.7 Hz", f"winch.location={location}", *sets]
    choice = choice_of(*sets, attached="loop")
    s = 2j * np.pi * np.array([0.01, 0.1, 0.5, 0.72, 2.0, 10.0])
    _, own, driven = transfers(model, location, s)
    control = (1 if location == "gondola" else -1) * 0.3 * exact(s) * notched(s, *NOTCH_NUMBERS)
    expected = 1 / (GONDOLA_MASS * s**2 + own + driven * control)
    (curve,) = choice.curves()
    np.testing.assert_allclose(curve.value(s.imag / (2 * np.pi)), expected, rtol=1e-9)
    system = choice.system()
    np.testing.assert_allclose(system.response(s)[:, 0, 0], expected, rtol=1e-6)
    assert len(set(system.state_names)) == len(system.a)


@pytest.mark.parametrize("selection", ["all", "third"])
def test_forces_on_nodes_are_those_of_dense_bars(dense, selection):
    choice = choice_of(wind=True)
    model = choice.case.end_model
    kept = chosen(model, selection)
    system = state_space(model, kept, nodes=nodal_shapes(choice.case))
    K, M, C, _ = dense
    for s in [0j] if selection == "third" else [0j, 5j, 100j]:
        full = K + s * C + s**2 * M
        # ends held: the force there is K12 times the movement of the interior
        outer = np.r_[0:3, len(K) - 3 : len(K)]
        expected = full[outer][:, 3:-3] @ np.linalg.inv(full[3:-3, 3:-3])
        computed = system.response([s])[0, :, 6:]
        assert np.abs(computed - expected).max() < 1e-9 * np.abs(expected).max()
    assert system.inputs[6] == ("force_node_1_x", "N")
    assert system.inputs[-1] == ("force_node_39_z", "N")


def test_forces_on_an_inclined_cable_are_in_global_axes():
    system = choice_of("cable.ends=[[0, 0, 0], [120, 80, 116]]", wind=True, count=3).system()
    held = system.response([0j])[0, :, 6:].real.reshape(2, 3, -1, 3)
    # whatever direction a force has, both ends together hold it (statics)
    np.testing.assert_allclose(held.sum(axis=0), -np.eye(3)[:, None] * np.ones((3, 39, 3)), atol=1e-8)


# frequency responses: those of the state space, and the features of the paper's Fig. 8

FREQUENCY = np.geomspace(0.01, 100, 150)
S = 2j * np.pi * FREQUENCY


BARS = "model.elements=40"


def open_loop(path):
    """Position of the gondola over a movement of the winch on the ground, and over that of one on the gondola."""
    return [curve.value for curve in choice_of(BARS, base=path, attached="gondola").curves()]


@pytest.mark.parametrize(
    "count", [2, 300, *(CONTROL.frequency_block * n + more for n, more in ((1, 0), (1, 1), (3, -1)))]
)
def test_frequencies_have_equal_ratios_and_both_ends(count):
    blocks = list(response.frequency_blocks(0.013, 97, count))
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


STORM = (
    "cable={ends: [[0, 0, 0], [34.1, 0, 6]], axial_stiffness: 228 kN, mass_per_length: 0.15, diameter: 10 mm, "
    "unstretched_length: 35.2, damping: {time: 1 ms, viscous: 0.05}}",
    "gondola={mass: 5, area: 0.2, drag_coefficient: 1.1}", "wind.speed=20", "wind.aerodynamic_damping=true",
    "cases.storm={wind: {speed: 25, direction: 1.2}}", "case=storm", "model={elements: 8, order: 1}",
)  # fmt: skip


def test_in_a_steady_wind_a_gondola_moves_as_on_bars_whose_own_drag_turns():
    """With all modes over frequency, with few at rest, where the winch moves it by as much; of a dead load 7 % less."""
    choice = choice_of(*STORM, attached="gondola")
    wind = {"speed": 25, "direction": 1.2, "density": 1.2, "turbulence": (0,) * 3, "length_scale": 1,
            "coherence_decay": 0}  # fmt: skip
    law = {"time": 1e-3, "viscous": 0.05}
    moving = BarsInWind(choice.case.equilibrium, 8, wind, [1.2 * 0.01], damping=law, mean=True)
    damping = moving.C.copy()
    damping[-1, -1] += 1.2 * 1.1 * 0.2 * 25 * (1 + np.cos(1.2) ** 2) / 2  # half as much across the wind
    s = 2j * np.pi * np.array([1e-6, 0.1, 0.3, 1.0, 3.0])
    expected = [np.linalg.inv(one**2 * moving.M + one * damping + moving.K)[-1, -1] for one in s]
    np.testing.assert_allclose(choice.system().response(s)[:, 0, 1], expected, rtol=1e-9)
    assert abs(np.linalg.inv(moving.dead)[-1, -1] / expected[0] - 1) > 0.07
    for options in ({"count": 3}, {"count": 5, "kinds": "inplane"}):
        few = choice_of(*STORM, attached="gondola", **options)
        winch, force = few.system().response(s[:1])[0, 0]
        assert force.real == pytest.approx(expected[0].real, rel=1e-9)  # modes that are left out damp nothing
        assert winch == pytest.approx(1, rel=1e-6)
    truncated = choice_of(*STORM, attached="gondola", count=3, residual=False)
    by_curve = truncated._by_winch("ground", s.imag / (2 * np.pi))
    np.testing.assert_allclose(truncated.system().response(s)[:, 0, 0], by_curve, rtol=1e-9)


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
