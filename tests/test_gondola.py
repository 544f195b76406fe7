"""The gondola on its cable: limits, the continuous cable, and modes that were left out."""

import math

import numpy as np
import pytest
from scenes import CHORD, PAPER, SAGGING, Twin, cells, scene
from scipy.optimize import brentq

from cablestudy.control.gondola import coupled_modes_of, static_frequency
from cablestudy.scene.scene import Gondola
from cablestudy.study.case import Case


def test_the_static_frequency_is_that_of_a_mass_on_a_spring():
    assert static_frequency(2.0, 8.0) == pytest.approx(2 / (2 * math.pi), rel=1e-15)
    assert static_frequency(50.0, 1025.0) == pytest.approx(0.72, abs=0.005)  # Table 5


def coupled_modes(*problem):
    return coupled_modes_of([problem])[0]


def chain(masses, springs):
    """Masses in a row, wall - spring - mass - ... - spring - last mass: K and M."""
    n = len(masses)
    K = np.zeros((n, n))
    for i, k in enumerate(springs):
        K[i, i] += k
        if i:
            K[i - 1, i - 1] += k
            K[i, i - 1] -= k
            K[i - 1, i] -= k
    return K, np.diag(masses)


def parts(K, M, end_mass):
    """What `coupled_modes` asks for: the last mass is the gondola, its own end_mass counted with the cable."""
    inner = slice(0, -1)
    value, psi = np.linalg.eigh(np.linalg.solve(np.sqrt(M[inner, inner]), K[inner, inner]) / np.sqrt(np.diag(M)[:-1]))
    psi = psi / np.sqrt(np.diag(M)[:-1])[:, None]
    participation = psi.T @ K[inner, -1]
    shape = np.append(np.linalg.solve(K[inner, inner], -K[inner, -1]), 1.0)
    stiffness = shape @ K @ shape
    inside = M[inner, inner] @ shape[:-1]
    moved = np.linalg.solve(K[inner, inner], inside)
    inertia = (shape[:-1] @ inside + end_mass, inside @ moved, moved @ M[inner, inner] @ moved)
    return stiffness, np.sqrt(value) / (2 * np.pi), participation, inertia


@pytest.mark.parametrize("gondola", [1e-3, 0.3, 5.0, 1e6])
def test_all_modes_together_are_the_whole_eigenproblem(gondola):
    masses, springs, end_mass = [1.0, 2.0, 0.5, 0.25], [3.0, 5.0, 2.0, 7.0], 0.25
    K, M = chain(masses, springs)
    frequency, share = coupled_modes(gondola, *parts(K, M, end_mass))
    M[-1, -1] = gondola + end_mass
    root = np.sqrt(np.diag(M))
    value, psi = np.linalg.eigh(K / np.outer(root, root))
    assert frequency == pytest.approx(np.sqrt(value) / (2 * np.pi), rel=1e-12)
    # share of the gondola alone, without the cable's end: of the modal mass 1
    assert share == pytest.approx(gondola * (psi[-1] / root[-1]) ** 2, rel=1e-9)


def test_omitted_modes_are_made_up_for():
    masses, springs = [0.1] * 30 + [0.05], [50.0] * 31
    K, M = chain(masses, springs)
    stiffness, frequency, participation, inertia = parts(K, M, 0.05)
    exact = coupled_modes(2.0, stiffness, frequency, participation, inertia)[0][0]
    few = coupled_modes(2.0, stiffness, frequency[:4], participation[:4], inertia)[0][0]
    ratio = exact / frequency[4]
    assert few == pytest.approx(exact, rel=ratio**6)  # the order that the docstring states
    assert abs(coupled_modes(2.0, stiffness, frequency[:4], participation[:4], (0, 0, 0))[0][0] / exact - 1) > 1e-3


def test_modes_that_do_not_feel_the_gondola_are_left_out():
    frequency, share = coupled_modes(1.0, 10.0, np.array([1.0, 2.0]), np.array([0.0, 0.0]), (0.0, 0.0, 0.0))
    assert frequency == pytest.approx([math.sqrt(10) / (2 * math.pi)], rel=1e-12)
    assert share == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("twin", "guess"), [(PAPER, 0.7188), (SAGGING, 2.3309), (Twin(30.0, 183.0, 186.0, 24.2e-6), None)]
)
def test_the_column_is_the_root_of_the_continuous_cable(twin, guess):
    found = cells(twin.scene("model.accuracy=1e-8"), "gondola_frequency")["gondola_frequency"]
    if guess:
        assert found == pytest.approx(guess, rel=1e-3)

    def balance(value):
        return twin.dynamic_stiffness(value) - 50.0 * (2 * math.pi * value) ** 2

    root = brentq(balance, found * (1 - 1e-6), found * (1 + 1e-6), xtol=1e-14)
    assert found == pytest.approx(root, rel=1e-9)


def test_a_heavy_gondola_feels_the_static_stiffness_and_a_third_of_the_cable():
    for mass in (50.0, 5000.0, 5e8):
        found = cells(
            scene("model.accuracy=1e-8", f"gondola.mass={mass}"), "gondola_frequency", "end_stiffness", "mass"
        )
        # Rayleigh: the static shape is a straight line along the taut cable, which moves a third of its mass
        expected = static_frequency(mass + found["mass"] / 3, found["end_stiffness"])
        assert found["gondola_frequency"] == pytest.approx(expected, rel=1e-4 * 50 / mass + 1e-9)


@pytest.mark.parametrize("elements", [40, 100, 400])
def test_more_bars_do_not_lose_the_modes_that_are_not_computed(elements):
    # above some size only some of the modes are computed: that must not show
    found = cells(SAGGING.scene(f"model.elements={elements}"), "gondola_frequency")["gondola_frequency"]
    exact = cells(SAGGING.scene("model.accuracy=1e-8"), "gondola_frequency")["gondola_frequency"]
    assert abs(found / exact - 1) < 12 / elements**2  # second order; 6 / n^2 at 40 bars


@pytest.mark.parametrize("mass", ["lumped", "consistent", "blended"])
def test_every_kind_of_mass_carries_the_end_too(mass):
    fine = cells(scene("model.accuracy=1e-8"), "gondola_frequency")["gondola_frequency"]
    found = cells(scene("model.elements=40", f"model.mass={mass}"), "gondola_frequency")["gondola_frequency"]
    assert found == pytest.approx(fine, rel=1e-6)


def test_the_smallest_models_have_an_answer():
    case = Case(scene("model.elements=1", "cable.preload=1344.75 N"))
    assert len(case.dynamics.modes(5)) == 0
    # a single bar: a spring, and half of its mass on the gondola
    assert case.gondola_frequency == pytest.approx(
        static_frequency(50.0 + case.span.mass * case.span.unstretched_length / 2, case.end_stiffness[0, 0]), rel=1e-12
    )


def test_moving_along_y_or_turned_around_the_vertical():
    # the gondola moves along x: across a cable along y it swings sideways on the tension
    across = cells(scene(f"cable.ends=[[0, 0, 0], [0, {CHORD}, 0]]"), "gondola_frequency_static", "preload")
    assert across["gondola_frequency_static"] == pytest.approx(
        static_frequency(50.0, across["preload"] / CHORD), rel=1e-3
    )
    here, there = (
        cells(scene(f"cable.ends=[[0, 0, 0], [{end}, 0, 0]]"), "gondola_frequency")["gondola_frequency"]
        for end in (CHORD, -CHORD)
    )
    assert here == pytest.approx(there, rel=1e-12)
    assert Gondola(mass=1).mass == 1
