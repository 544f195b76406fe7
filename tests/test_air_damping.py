"""Damping by the air, and by viscous forces along the cable: closed forms, dense matrices, state space and loop."""

import numpy as np
import pytest
import scipy.linalg
from cables import EA, MASS, PAPER_CHORD, PAPER_LENGTH, G, check_damping_ratio, poles_between_fixed_ends
from command import CARLINA, run, table_of, with_sets
from one_loop import OneLoop
from references import bars, dense, loop_matrix
from scenes import SAGGING, case_of, cells, choice_of, scene
from solved import rows_as_alone
from test_windrms import AIR_DAMPS as AIR
from test_windrms import (  # noqa: F401 a fixture
    LIGHT,
    PUSHED,
    WHITE,
    brute,
    case_with,
    force,
    loop_of,
    paper_loop,
    rms_of,
    white,
)

from cablestudy.control.loop import Loop
from cablestudy.control.one_cable import state_space
from cablestudy.study.one_cable.case import CableCase

C = PUSHED  # rho C_d A v of configs/carlina.yaml [N s/m]


@pytest.mark.crossed
@pytest.mark.parametrize("damping", [1e-4, 1.0, 50.0, 400.0])
@pytest.mark.parametrize("law", ["loss_factor: 0.02", "time: 4 ms"])
def test_the_damping_ratio_by_strain_and_air_is_that_of_the_pole(law, damping):
    case = case_of(AIR, f"gondola.drag_coefficient={1.17 * damping / C!r}", f"cable.damping={{{law}}}")
    assert case.gondola_air_damping == pytest.approx(damping, rel=1e-12)
    check_damping_ratio(case, 1e-7)


def test_an_overdamped_gondola_creeps_back():
    sets = AIR, "cable.damping={loss_factor: 1e-9}", f"gondola.drag_coefficient={1.17 * 2000 / C!r}"
    assert case_of(*sets).gondola_mode.damping_ratio[0] == pytest.approx(1.0, abs=1e-6)


def lyapunov(loop, gain, level):
    """RMS of the gondola under a force of constant one-sided spectrum, by Lyapunov's equation."""
    A, B = loop_matrix.matrices(loop, gain)
    if not gain:
        A, B = A[:-3, :-3], B[:-3]  # neither notch nor integrator; the latter has no finite variance alone
    P = scipy.linalg.solve_continuous_lyapunov(A, -np.outer(B, B) * level / 2)
    place = 2 * len(loop.cable.omega)
    return np.sqrt(P[place, place])


@pytest.mark.crossed
@pytest.mark.usefixtures("white")
@pytest.mark.parametrize("ratio", [1e-3, 1e-2])
@pytest.mark.parametrize("gain", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("damping", [0.3, C, 100.0])
def test_the_loop_is_that_of_the_dense_matrix(ratio, gain, damping):
    sets = AIR, WHITE, f"gondola.drag_coefficient={1.17 * damping / C!r}"
    case = CableCase(case_with(ratio, gain, *sets).scene)
    loop = loop_of(case)
    assert loop.damping == pytest.approx(damping, rel=1e-12)
    poles, closed_loop = np.linalg.eigvals(loop_matrix.matrices(loop, loop.gain)[0]), case.analysis.closed_loop
    closed = closed_loop.loop.eigen.poles if loop.gain else closed_loop.open_poles
    main = closed[np.argmin(np.abs(closed - 2j * np.pi * case.gondola_mode.frequency[0]))]
    assert np.abs(poles - main).min() < 1e-5 * abs(main)
    expected = lyapunov(loop, loop.gain, 3.0 * (damping / C) ** 2)
    assert rms_of(case, "value")[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("location", ["ground", "gondola"])
def test_state_spaces_have_it_too(location):
    case = case_of(AIR, f"winch.location={location}")
    assert case.gondola_air_damping == pytest.approx(C, rel=1e-14)
    loop = OneLoop(case.scene)

    def alone(s):
        return loop.mass * s**2 + loop.damping * s + case.end_model.dynamic_stiffness(s, [3], [3])[:, 0, 0]

    def in_loop(s):
        return alone(s) * (1 + loop.gain * loop.unit_gain(s))

    frequency = np.array([0.05, 0.71, 1.6, 5.0])
    s = 2j * np.pi * frequency
    attached = {"gondola": (loop.mass, loop.damping), "location": location}
    closed = state_space(loop.cable, **attached, loop=loop.closed_loop.loop).response(s)[:, 0, 0]
    assert closed == pytest.approx(1 / in_loop(s), rel=1e-8)
    coupled = state_space(case.end_model, gondola=(50.0, C), location=location).response(s)
    assert coupled[:, 0, 1] == pytest.approx(1 / alone(s), rel=1e-8)
    curve = choice_of(AIR, attached="gondola").curves()[("ground", "gondola").index(location)]
    assert coupled[:, 0, 0] == pytest.approx(curve.value(frequency), rel=1e-8)
    with_loop = run("ssm", CARLINA, "--set", AIR, "--set", f"winch.location={location}", "--with", "loop",
                    "--response", "0.1Hz:5Hz:3", "--format", "csv").out  # fmt: skip
    rows = np.array([line.split(",")[:2] for line in with_loop.splitlines()[1:]], dtype=float)
    frequency, amplitude = rows.T  # with rows at resonances
    assert np.isin(np.geomspace(0.1, 5, 3).round(12), frequency.round(12)).all()
    assert amplitude == pytest.approx(np.abs(1 / in_loop(2j * np.pi * frequency)), rel=1e-8)


def test_without_it_the_rms_is_that_of_bars_that_the_air_does_not_damp_and_the_default_has_it():
    on, off = (cells(scene(*sets), "gondola_rms", "gondola_damping_ratio", "gondola_rms_cable_wind")
               for sets in ((AIR,), ()))  # fmt: skip
    assert off["gondola_rms"] == pytest.approx(1e3 * brute(paper_loop(), 0.325, force)[0], rel=1e-6)
    assert on["gondola_rms"] < 0.5 * off["gondola_rms"]
    # about c/(2 M w) more
    more = C / (2 * 50.0 * 2 * np.pi * 0.7188)
    assert on["gondola_damping_ratio"] - off["gondola_damping_ratio"] == pytest.approx(more, rel=0.01)
    assert on["gondola_rms_cable_wind"] < off["gondola_rms_cable_wind"]
    data = scene()
    assert not data.wind.aerodynamic_damping
    assert type(data.wind).model_fields["aerodynamic_damping"].default


def test_an_undamped_cable_is_damped_by_the_air():
    sets = ("cable.damping={model: modal, ratio: 0}", "winch.controller.gain=0")
    row = cells(scene(*sets, AIR), "gondola_rms", "gondola_damping_ratio")
    assert row["gondola_damping_ratio"] == pytest.approx(C / (2 * 50.0 * 2 * np.pi * 0.7188), rel=0.01)
    outcome = run("windrms", CARLINA, *with_sets(*sets), code=3)
    assert "undamped" in outcome.err


def test_the_steady_wind_of_a_load_case_damps_the_gondola_by_its_own_speed():
    """rho V C_d A (1 + cos^2)/2 for an oblique wind; of a taut cable along x the drag damps nothing along x."""
    sets = (
        "cable={chord: 20 m, axial_stiffness: 1e7, mass_per_length: 1e-3, diameter: 2 mm, preload: 2e5}",
        "cable.damping={loss_factor: 1e-9}",
        "cases={day: {wind: {speed: 15, direction: 60 deg, air_density: 1.3}}}",
        "case=day",
    )
    case, drag_area = case_of(AIR, *sets), 1.17 * 0.6
    expected = 1.3 * 15 * drag_area * (1 + 0.25) / 2
    assert case.gondola_air_damping == pytest.approx(expected, rel=1e-12)
    ratio, omega = case.gondola_mode.damping_ratio[0], 2 * np.pi * case.gondola_mode.frequency[0]
    moved = 50.0 + 1e-3 * 20 / 3  # a third of the cable
    assert ratio == pytest.approx(expected / (2 * moved * omega), rel=1e-5)


def test_steady_winds_of_one_pressure_damp_by_the_density_of_their_air():
    cases = "cases={{day: {{wind: {{speed: {}, air_density: {}}}}}}}"
    sets = [(AIR, "case=day", cases.format(speed, density)) for speed, density in ((20, 1.2), (40, 0.3))]
    thick, thin = rows_as_alone([scene(*each) for each in sets], ["gondola_damping_ratio", "gondola_rms_open_loop"])
    assert thin.values["gondola_damping_ratio"] < 0.7 * thick.values["gondola_damping_ratio"]
    assert thin.values["gondola_rms_open_loop"] > 1.1 * thick.values["gondola_rms_open_loop"]


def test_explain_says_what_is_damped():
    err = run("windrms", CARLINA, "--set", AIR, "--explain").err
    on_cable = 1.2 / 2 * 1.2 * np.sqrt(4 / np.pi * 2.69e-6) * 6  # half of rho C_d d v, up and down: docs/physics.md
    assert f"aerodynamic damping: {C:.4g} N s/m on the gondola; {on_cable:.4g} N s/m^2 on the cable too" in err
    storm = "cases={storm: {wind: {speed: 12}}}"
    err = run("windrms", CARLINA, "--set", AIR, "--set", storm, "--case", "storm", "--explain").err
    assert f"{2 * C:.4g} N s/m on the gondola; the steady wind of the load case damps the cable too" in err
    assert "aerodynamic" not in run("windrms", CARLINA, "--explain").err


def test_the_winch_at_rest_beside_an_unstable_loop():
    sets = ("--set", AIR, "--set", "winch.controller.gain=60")
    (row,) = table_of("windrms", CARLINA, *sets, "--on", "both", "--quiet", code=3)
    (stable,) = table_of("windrms", CARLINA, "--set", AIR, "--on", "both", "--quiet")
    for name in ("gondola_rms_open_loop_all_wind_mm", "gondola_rms_open_loop_cable_wind_mm"):
        assert row[name] == pytest.approx(stable[name], rel=1e-5)


# viscous damping per length of the cable

VISCOUS = 0.016  # N s/m^2, about what wind of 6 m/s gives the paper's cable across
RATE = VISCOUS / MASS
LAWS = ("ratio: 0.0", "ratio: 0.02", "loss_factor: 0.02", "time: 1 ms")


def closed(case):
    """State space of the closed loop with every mode of its cable."""
    loop = loop_of(case)
    own = Loop(None, None, loop.gain, (loop.notch,))
    return state_space(loop.cable, gondola=(loop.mass, 0.0), location=loop.location, loop=own)


def damped(law, viscous=VISCOUS):
    return f"cable.damping={{{law}, viscous: {viscous} N s/m^2}}"


@pytest.mark.parametrize("law", LAWS)
def test_the_dynamic_stiffness_of_the_ends_is_that_of_dense_bars(law):
    chain = bars.solve_spatial((PAPER_CHORD, 0, 0), PAPER_LENGTH, EA, MASS * G, 40)
    K, M = bars.matrices(chain, PAPER_LENGTH, EA, MASS)
    elastic = bars.elastic_matrix(chain, PAPER_LENGTH, EA)
    ends, inner = np.r_[0:3, 120:123], np.s_[3:120]
    root = np.sqrt(M[inner])
    square, psi = np.linalg.eigh(K[inner, inner] / np.outer(root, root))
    modal = root[:, None] * psi
    modal = modal * (2 * 0.02 * np.sqrt(square)) @ modal.T  # damping matrix of a ratio for each mode with fixed ends
    model = CableCase(scene(damped(law))).end_model
    for s in (0.7j, 10j, 3 + 60j, 400j):
        whole = K + np.diag(M * (s**2 + RATE * s)).astype(complex)
        whole = whole + {"loss_factor: 0.02": 0.02j, "time: 1 ms": 1e-3 * s}.get(law, 0.0) * elastic
        if law == "ratio: 0.02":
            whole[inner, inner] += s * modal
        condensed = dense.condensed(whole, ends)
        found = model.dynamic_stiffness(np.array([s]))[0]
        # the plane of the cable; across it elements have no part in damped strain
        assert np.abs(found - condensed).max() < 1e-7 * np.abs(condensed).max()


def test_every_mode_of_the_bare_cable_decays_alike():
    poles = poles_between_fixed_ends(CableCase(scene(damped("ratio: 0.0"))).end_model)
    assert poles.real == pytest.approx(np.full(len(poles), -RATE / 2), rel=1e-9)
    assert -poles.real[0] / np.abs(poles[0]) == pytest.approx(0.2, abs=0.02)  # the first mode: docs/physics.md


def test_viscous_damping_alone_has_no_modal_ratio_and_goes_with_accuracy():
    names, alone = ("gondola_damping_ratio", "gondola_rms", "largest_gain"), "cable.damping={viscous: 0.016 N s/m^2}"
    fine, finer = (cells(scene(alone, f"model.accuracy={a}"), *names, "error_estimate") for a in (1e-3, 1e-6))
    for name in names:
        assert fine[name] == pytest.approx(finer[name], rel=1e-3)
    assert finer["error_estimate"] < 1e-6


def test_the_gondola_on_a_light_straight_cable_in_closed_form():
    # the static shape is a straight line: a third of the cable moves, and a third of the force per length acts
    found = cells(scene("cable.damping={viscous: 1e-3 N s/m^2}", "gravity=0.01", "model.accuracy=1e-7"),
                  "gondola_damping_ratio", "gondola_frequency", "mass", "unstretched_length")  # fmt: skip
    omega, third = 2 * np.pi * found["gondola_frequency"], found["mass"] / 3
    expected = 1e-3 * found["unstretched_length"] / 3 / (2 * (50 + third) * omega)
    assert found["gondola_damping_ratio"] == pytest.approx(expected, rel=3e-3)  # (w/W)^2 of the first axial mode


@pytest.mark.crossed
@pytest.mark.parametrize("law", LAWS[2:])
@pytest.mark.parametrize("sets", [(), ("cable.area=24.2 mm^2", "cable.unstretched_length=186 m")])
def test_the_damping_ratio_of_the_gondola_is_that_of_its_pole(law, sets):
    check_damping_ratio(CableCase(scene(damped(law, 1e-3), *sets, "model.accuracy=1e-8")).refined(1, 40), 1e-8)


@pytest.mark.crossed
@pytest.mark.parametrize("law", ["ratio: 0.01", "time: 1 ms"])
@pytest.mark.parametrize("where", ["ground", "gondola"])
def test_the_state_space_has_the_poles_of_the_loop(law, where):
    sets = damped(law), f"winch.location={where}", "model.elements=20", "winch.controller.gain=0.1"
    case = CableCase(SAGGING.scene(*sets))
    found = case.analysis.closed_loop_of(250).loop.eigen.values
    for pole in np.linalg.eigvals(closed(case).a):
        assert np.abs(found - pole).min() < 1e-7 * np.abs(pole) + 1e-11 * np.abs(found).max()
