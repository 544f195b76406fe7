"""The gondola on its cable: limits, the continuous cable, and modes that were left out."""

import math

import numpy as np
import pytest
from mpmath import mp
from scenes import CHORD, SAGGING, cells, scene
from scipy.optimize import brentq

from cablestudy.control.gondola import coupled_modes, gondola_mode, static_frequency
from cablestudy.study.case import Case
from cablestudy.study.notes import gondola_notes


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
    # to the rounding of the lowest one: all digits for the gondola's
    assert frequency**-2.0 == pytest.approx(
        (2 * np.pi) ** 2 / value, rel=1e-12, abs=1e-14 * (2 * np.pi) ** 2 / value[0]
    )
    # phi^2/w^2 of the last mass over what it moves for a force of one
    assert share == pytest.approx((psi[-1] / root[-1]) ** 2 / value / np.linalg.inv(K)[-1, -1], rel=1e-9)
    assert share.sum() == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("rounding", [-4e-15, 0.0, 4e-15])
def test_a_light_gondola_does_not_feel_the_rounding_of_the_moments(rounding):
    """Its frequency is far above the cable's first one, and what all modes leave of a moment grows with w^6."""
    n, mass, spring, gondola = 79, 0.1, 50.0, 1e-5
    number = np.arange(1, n + 1)  # modes of equal masses on equal springs between two walls
    omega = 2 * math.sqrt(spring / mass) * np.sin(number * np.pi / (2 * (n + 1)))
    participation = -spring * math.sqrt(2 / ((n + 1) * mass)) * np.sin(n * number * np.pi / (n + 1))
    moments = [math.fsum(participation**2 / omega ** (4 + 2 * j)) * (1 + rounding * (j > 0)) for j in range(3)]
    found, share = coupled_modes(gondola, spring / (n + 1), omega / (2 * np.pi), participation, moments)
    K, M = chain([mass] * n + [gondola], [spring] * (n + 1))
    root = np.sqrt(np.diag(M))
    value, psi = np.linalg.eigh(K / np.outer(root, root))
    assert found[-1] == pytest.approx(np.sqrt(value[-1]) / (2 * np.pi), rel=1e-12)
    compliance = (psi[-1] / root[-1]) ** 2 / value
    assert gondola_mode(share) == np.argmax(compliance)
    assert share == pytest.approx(compliance / np.linalg.inv(K)[-1, -1], rel=1e-6, abs=1e-12)


def test_omitted_modes_are_made_up_for():
    masses, springs = [0.1] * 30 + [0.05], [50.0] * 31
    K, M = chain(masses, springs)
    stiffness, frequency, participation, inertia = parts(K, M, 0.05)
    exact = coupled_modes(2.0, stiffness, frequency, participation, inertia)[0][0]
    few = coupled_modes(2.0, stiffness, frequency[:4], participation[:4], inertia)[0][0]
    ratio = exact / frequency[4]
    assert few == pytest.approx(exact, rel=ratio**8)  # the order that the docstring states
    none = coupled_modes(2.0, stiffness, frequency[:4], participation[:4], (0, 0, 0))[0][0]
    assert abs(none / exact - 1) > 1e-3


def test_modes_that_do_not_feel_the_gondola_are_left_out():
    frequency, share = coupled_modes(1.0, 10.0, np.array([1.0, 2.0]), np.array([0.0, 0.0]), (0.0, 0.0, 0.0))
    assert frequency == pytest.approx([math.sqrt(10) / (2 * math.pi)], rel=1e-12)
    assert share == pytest.approx([1.0])


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


def test_moving_along_y_or_turned_around_the_vertical():
    # the gondola moves along x: across a cable along y it swings sideways on the tension
    across = cells(scene(f"cable.ends=[[0, 0, 0], [0, {CHORD}, 0]]"), "gondola_frequency_static", "preload")
    expected = static_frequency(50.0, across["preload"] / CHORD)
    assert across["gondola_frequency_static"] == pytest.approx(expected, rel=1e-3)
    here, there = (
        cells(scene(f"cable.ends=[[0, 0, 0], [{end}, 0, 0]]"), "gondola_frequency")["gondola_frequency"]
        for end in (CHORD, -CHORD)
    )
    assert here == pytest.approx(there, rel=1e-12)


def lengthy(mass, own, stiffness, frequency, participation):
    """The same modes by a dense eigenproblem in 80 digits: squares of the angular frequencies, and the shares."""
    n = len(frequency)
    square = [mp.mpf(w) for w in ((2 * np.pi * frequency) ** 2).tolist()]
    moved = [mp.mpf(p) / w for p, w in zip(participation.tolist(), square, strict=True)]
    total = mp.mpf(mass) + own + sum(m**2 for m in moved)
    inertia, rigid = mp.eye(n + 1), mp.diag([*square, mp.mpf(stiffness)])
    inertia[n, n] = total
    for k in range(n):
        inertia[k, n] = inertia[n, k] = moved[k]
    # the ordinary form K x = w^2 M x, by the root of M
    root = mp.cholesky(inertia)
    value, shape = mp.eigsy(root**-1 * rigid * (root**-1).T)
    shape = (root**-1).T * shape
    return list(value), [shape[n, k] ** 2 / value[k] * stiffness for k in range(n + 1)]


@pytest.mark.parametrize("mass", [1e-6, 1e-3, 1.0, 1e3, 1e15])
@pytest.mark.parametrize("seed", range(6))
def test_extreme_gondolas_and_cables_in_long_arithmetic(mass, seed):
    """Modes that move with parts in 1e9 of the largest, frequencies over six decades or in pairs."""
    rng, n = np.random.default_rng(seed), 7
    frequency = np.sort(10 ** rng.uniform(-1, (0.5, 2, 5)[seed % 3], n))
    if seed % 2:
        frequency[1::2] = frequency[:-1:2] * (1 + 10.0 ** -rng.integers(2, 9))
    moved = 10 ** rng.uniform((-0.2, -3, -9)[seed // 2], 0, n)
    participation = moved * (2 * np.pi * frequency) ** 2
    cable = float((moved**2).sum())
    mass, stiffness = mass * cable, 10 ** rng.uniform(-4, 4) * (2 * np.pi * frequency[0]) ** 2 * cable
    own = rng.choice([0.25, 1.0]) * cable
    found, share = coupled_modes(mass, stiffness, frequency, participation, (cable + own, 0.0, 0.0))
    with mp.workdps(80):
        square, expected = lengthy(mass, own, stiffness, frequency, participation)
        best = max(range(n + 1), key=lambda k: expected[k])
        exact = [float(mp.sqrt(w) / (2 * np.pi)) for w in square]
    here = gondola_mode(share)
    assert found[here] == pytest.approx(exact[best], rel=1e-12)
    assert share[here] == pytest.approx(float(expected[best]), rel=1e-7)
    # the others to the rounding of the lowest one
    assert found**-2.0 == pytest.approx(np.array(exact) ** -2.0, abs=1e-13 * exact[0] ** -2.0)


SLACK = ("cable.ends=[[0, 0, 0], [60, 0, 10]]", "cable.unstretched_length=80 m", "cable.area=2.5 cm^2",
         "cable.strength=null")  # fmt: skip


def test_the_gondola_frequency_of_a_light_gondola_on_a_slack_cable_does_not_depend_on_the_accuracy():
    """A gondola of 6 kg on a cable of 29 kg: its mass is spread over many modes, its compliance is not."""
    found = {
        digits: cells(
            scene(*SLACK, "gondola.mass=6 kg", f"model.accuracy=1e-{digits}"), "gondola_frequency", "gondola_share"
        )
        for digits in range(3, 11)
    }
    for digits, row in found.items():
        assert row["gondola_frequency"] == pytest.approx(found[10]["gondola_frequency"], rel=10.0**-digits)
    assert found[3]["gondola_share"] == pytest.approx(found[10]["gondola_share"], rel=1e-3)


def test_modes_that_share_the_gondola_are_named():
    """Tuned to the first mode of its cable, a gondola moves as much in either of two modes."""

    def tuned(mass):
        return Case(scene(f"gondola.mass={mass!r}", "model.accuracy=1e-6")).refined(1, 16)

    def difference(mass):
        share = tuned(mass).coupled[1]
        return share[0] - share[1]

    case = tuned(brentq(difference, 9.9, 10.1, xtol=1e-10))
    frequency, share = case.coupled
    assert share.sum() == pytest.approx(1, rel=1e-9)
    assert share[:2] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert gondola_mode(share) == 0  # of two equal shares the lower one
    note, tie = gondola_notes(case)
    assert f"{frequency[0]:.4g} Hz has only {share[0]:.3g} of its static compliance" in note
    assert f"{frequency[1]:.4g} Hz ({share[1]:.3g})" in note
    assert tie == f"gondola: a tie, within the error the mode of {frequency[1]:.4g} Hz has as large a share"
    assert list(gondola_notes(Case(scene()))) == []  # a taut cable: one mode has nearly all


def test_of_two_equal_shares_the_lower_mode_is_the_gondola_s():
    assert gondola_mode(np.array([0.1, 0.4, 0.1, 0.4 * (1 + 1e-9)])) == 1
    assert gondola_mode(np.array([0.1, 0.4, 0.1, 0.4 * (1 + 1e-3)])) == 3
