"""Modal damping of cables between bodies: what modes that are left out leave, and why more modes damp more.

A string of tension T, mass m per length and speed c = sqrt(T/m) whose end moves sideways, its N - 1 modes by N lumped
bars: each has the frequency 2 c N/L sin a and the coupling m L/(2 N^2) cot^2 a, a = n pi/(2 N), so that they damp the
movement by 2 zeta c m/N sum cos^2 a/sin a, about 4 zeta c m/pi (1 + 1/2 + 1/3 + ...).
"""

import numpy as np
import pytest
from command import run
from suspension_scenes import G, hung, platform, suspension

from cablestudy.cable.damping import Damping
from cablestudy.system.cables import Models
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.system.damping import damping_ratios
from cablestudy.system.hanging_cables import Cables, FixedModel

ZETA = 0.01


@pytest.mark.parametrize("bars", [5, 20, 80, 320])
def test_the_damping_of_a_pendulum_grows_with_the_number_of_modes_of_its_string(bars):
    mass, line, length = 50.0, 1e-3, 10.0
    model = suspension({"bob": {"at": (0, 0, 0), "mass": mass, "free": ("x",)}},
                       [((0.0, 0.0, length), ("bob", (0.0, 0.0, 0.0)), 1e7, line)])  # fmt: skip
    found = coupled_modes(hung(model, [length / (1 + mass * G / 1e7)]), 1, damping=Damping(ratio=ZETA),
                          model=FixedModel(bars))  # fmt: skip
    angle = np.arange(1, bars) * np.pi / (2 * bars)
    speed = np.sqrt(mass * G / line)
    force = 2 * ZETA * speed * line / bars * (np.cos(angle) ** 2 / np.sin(angle)).sum()  # per velocity of the bob
    assert found.damping_ratio[0] == pytest.approx(force / (2 * mass * np.sqrt(G / length)), rel=1e-3)


@pytest.mark.parametrize("share", [0.0, 2.0, 6.0])
def test_modes_that_are_left_out_leave_their_damping(share):
    """Of one mesh some modes or none are kept, up to a multiple of the highest frequency."""
    state = platform(mass=1e-6)
    layout, cables = Layout(state), Cables(state.catenary, Damping(ratio=ZETA))
    models = Models(cables, cables.meshes(np.full(cables.count, 24.0)))

    def ratios(limit):
        system = layout.system([one.element for one in models.coordinates(np.full(cables.count, limit)).kept])
        omega, shapes = system.lowest(6)
        return omega, damping_ratios(system, omega, shapes)

    omega, expected = ratios(np.inf)
    first = min(element.omega[0] for element in models.elements)
    assert omega[-1] < 0.3 * first  # those of the body alone
    _, found = ratios(share * first)
    assert found == pytest.approx(expected, rel=1e-6 if share else 0.05)


def test_notes_tell_of_how_many_modes_the_damping_is():
    scene = "configs/suspensions/trifilar.yaml"
    (line,) = [
        line for line in run("modes", scene, "--explain", "--set", "model.elements=9").lines if "damping" in line
    ]
    assert line.startswith("damping ratios: modal damping grows with the number of modes, 24 of each cable here: ")
    for damping in ("{model: hysteretic, loss_factor: 0.02}", "{model: modal, ratio: 0, viscous: 0.01}"):
        lines = run("modes", scene, "--explain", "--set", f"cable.damping={damping}").lines
        assert not [line for line in lines if "damping" in line]
