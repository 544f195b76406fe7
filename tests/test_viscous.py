"""Viscous damping per length of the cable: dense bars, closed forms, state space and loop."""

import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, PAPER_LENGTH, G, check_damping_ratio, poles_between_fixed_ends
from references import bars, dense
from scenes import SAGGING, cells, scene
from test_windrms import loop_of

from cablestudy.control.loop import Loop
from cablestudy.control.one_cable import state_space
from cablestudy.study.one_cable.case import CableCase

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
