"""Poles: sums over them, those of coupled modes in windows, and those of single modes whose damping is not symmetric.

Against solved systems of equations, and one eigenvalue problem of all modes.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from references import dense

from cablestudy.control.notch import Notch
from cablestudy.system.closed_poles import eigen_of_closed_loop
from cablestudy.system.damped_pole import poles_near
from cablestudy.system.first_order import Allocation, LinearControl, equations
from cablestudy.system.linear import LinearSystem
from cablestudy.system.pole_windows import mode_amplitudes, poles_and_vectors, poles_in_windows
from cablestudy.system.residues import eigen, eigen_of_rows
from cablestudy.system.solvents import eigen_by_solvents
from cablestudy.system.tolerances import SYSTEM

FREQUENCIES = 1j * np.geomspace(1e-2, 1e3, 60)


def chain(*blocks, into=1.0):
    """Systems one behind the other: each is driven by the first state of the one before, times a factor."""
    size = sum(len(block) for block in blocks)
    found, begin = np.zeros((size, size)), 0
    for place, block in enumerate(blocks):
        own = slice(begin, begin + len(block))
        found[own, own] = block
        if place:
            found[begin + len(block) - 1, begin - len(blocks[place - 1])] = into
        begin += len(block)
    return found


def second_order(omega, ratio):
    """x'' + 2 z w x' + w^2 x, its states x and x'."""
    return np.array([[0.0, 1.0], [-(omega**2), -2 * ratio * omega]])


LAG = np.array([[-60.0]])
MATRICES = {
    "a critically damped filter": second_order(60.0, 1.0),
    "it before a slow and a fast oscillator": chain(
        second_order(60.0, 1.0), second_order(0.7, 0.04), second_order(300.0, 0.1), into=3e5
    ),
    "two equal filters": chain(LAG, LAG),
    "three equal filters": chain(LAG, LAG, LAG, into=60.0),
    "a critically damped filter and two of its poles": chain(second_order(60.0, 1.0), LAG, LAG, into=60.0),
}
WRONG = 2e-7  # of a response, over its largest value


@pytest.mark.parametrize("name", MATRICES)
def test_the_sum_over_poles_is_the_response(name):
    """Of each state to a force on itself, and of the last one to a force on the first."""
    matrix, found = MATRICES[name], eigen(MATRICES[name])
    right = np.linalg.inv(FREQUENCIES[:, None, None] * np.eye(len(matrix)) - matrix)
    summed = (found.right / (FREQUENCIES[:, None] - found.values)[:, None, :]) @ found.left
    own = np.arange(len(matrix))
    for rows, columns in ((own, own), ([-1], [0])):
        size = np.abs(right[:, rows, columns]).max(axis=0)
        assert (np.abs(summed - right)[:, rows, columns] / size).max() < WRONG


def test_the_slow_poles_of_a_graded_matrix_are_not_moved_by_a_double_pole_far_above():
    """0.7 rad/s with 4 % beside a critically damped filter of 60 rad/s, and forces of 3e5 between them."""
    poles = eigen(MATRICES["it before a slow and a fast oscillator"]).poles
    slow = poles[np.argmin(np.abs(poles - 0.7j))]
    assert slow == pytest.approx(0.7 * (-0.04 + 1j * np.sqrt(1 - 0.04**2)), rel=1e-9)


def test_matrices_of_many_rows_have_the_poles_and_vectors_of_each_alone():
    """Full matrices, one with real poles alone, one of two groups of states, one with coinciding poles."""
    draw = np.random.default_rng(3)
    full, triangular, apart = draw.normal(size=(4, 4)), np.triu(draw.normal(size=(4, 4))), draw.normal(size=(4, 4))
    apart[:2, 2:] = apart[2:, :2] = 0.0
    coinciding = np.eye(4, k=1) - 2 * np.eye(4)
    coinciding[3, 0] = 1e-15
    rows = np.array([full, triangular, apart, coinciding, full.T])
    for found, matrix in zip(eigen_of_rows(rows), rows, strict=True):
        alone = eigen(matrix)
        for name in ("values", "right", "left"):
            assert np.array_equal(getattr(found, name), getattr(alone, name)), name
        assert (found.right * found.values) @ found.left == pytest.approx(matrix, abs=1e-6)


def test_the_inverse_of_vectors_in_pairs_is_that_of_the_complex_matrix():
    matrix = np.random.default_rng(8).normal(size=(9, 9))
    found = eigen(matrix)
    assert (found.values.imag != 0).any()
    assert found.left == pytest.approx(np.linalg.inv(found.right), abs=1e-12)
    assert found.left @ found.right == pytest.approx(np.eye(9), abs=1e-13)


@pytest.mark.parametrize("ratio", [1e-9, 1e-4, 0.1, 3.0, 100.0])  # of the damping; the last one is above critical
@pytest.mark.parametrize("seed", range(3))
def test_complex_stiffness_and_damping_together(seed, ratio):
    """A [0 U; S D] of 12 coordinates, frequencies over three decades, damping and loss that couple them."""
    draw, n = np.random.default_rng(seed), 12
    omega, shapes = 10 ** draw.uniform(-1, 2, n), draw.normal(size=(2, n, n)) / n
    root = np.sqrt(omega[:, None] * omega)
    damping, loss = (root * (shape @ shape.T) for shape in shapes)
    unit = omega * draw.uniform(0.5, 2.0, n)
    stiffness = np.diag(omega**2) + 0.05j * root * loss
    matrix = np.block([[np.zeros((n, n)), np.diag(unit)], [-stiffness / unit[:, None], -ratio * damping]])
    matrix[n:, n:] *= unit / unit[:, None]  # of the speeds over `unit`
    found = eigen(matrix)
    right = np.linalg.inv(FREQUENCIES[:, None, None] * np.eye(2 * n) - matrix)
    summed = (found.right / (FREQUENCIES[:, None] - found.values)[:, None, :]) @ found.left
    size = np.sqrt(np.diagonal(np.abs(right).max(axis=0)))
    assert (np.abs(summed - right) / size[:, None] / size).max() < 1e-10  # rounding, over three decades
    assert found.one_sided


def closed_loop(gain):
    """A and what `eigen_of_closed_loop` needs: 30 modes, 3 winches, a notch of 2 coordinates, a law of one state."""
    draw, n = np.random.default_rng(1), 30
    omega = np.sort(10 ** draw.uniform(0, 2.5, n))
    loss, drag, *winches = draw.normal(size=(5, n, n)) / n
    root = np.sqrt(omega[:, None] * omega)
    stiffness, damping = np.diag(omega**2) + 0.02j * root * (np.eye(n) + loss @ loss.T), 0.01 * root * (drag @ drag.T)
    b = tuple(part[:, :3] * size for part, size in zip(winches, (30.0, 0.5, 0.1), strict=True))
    motion = LinearSystem(np.eye(n), damping, stiffness, b, c=(np.eye(n),) * 3, d=(np.zeros((n, 3)),) * 3)
    allocation = Allocation(draw.normal(size=(2, n)), draw.normal(size=(3, 2)), draw.normal(size=(2, 2)))
    law = np.array([[-20.0]]), np.array([1.0]), np.array([5.0]), 0.8
    control = LinearControl(allocation, gain, (Notch(omega[3], 0.05, 60.0, 1.0), None), law, ["lag"])
    first_order = equations(motion, allocation, control.notches, law)
    return first_order.with_gain(gain), motion, control


@pytest.mark.parametrize("gain", [1e-3, 0.1, 0.7])
def test_poles_of_a_closed_loop_follow_from_those_at_rest(gain):
    """And its vectors: the sum over them is the response, the poles are those of the general algorithm."""
    matrix, motion, control = closed_loop(gain)
    found = eigen_of_closed_loop(matrix, motion.eigen, motion, control)
    expected = np.linalg.eigvals(matrix)
    assert np.sort_complex(found.values) == pytest.approx(np.sort_complex(expected), rel=1e-9)
    right = np.linalg.inv(FREQUENCIES[:, None, None] * np.eye(len(matrix)) - matrix)
    summed = (found.right / (FREQUENCIES[:, None] - found.values)[:, None, :]) @ found.left
    size = np.abs(right).max(axis=0)
    assert (np.abs(summed - right).max(axis=0) <= 1e-9 * size + 1e-14 * size.max()).all()
    moved = np.abs(expected[:, None] - motion.eigen.values).min(axis=0) / np.abs(motion.eigen.values)
    assert gain < 0.7 or moved.max() > 0.05  # the loop moves poles by far more than a step may be wrong


def test_a_pole_that_is_not_found_from_those_at_rest_is_noticed():
    """With a gain that moves poles past each other, and with wrong poles at rest."""
    matrix, motion, control = closed_loop(10.0)
    assert eigen_of_closed_loop(matrix, motion.eigen, motion, control) is None
    matrix, motion, control = closed_loop(0.1)
    wrong = replace(motion.eigen, values=motion.eigen.values * (1 + 1e-9))
    assert eigen_of_closed_loop(matrix, wrong, motion, control) is None


# in windows

MODES, LOSS, TIME = 240, 0.02, 1e-4
BEYOND = 5e-3  # coupling over the distance of modes more than ten apart: no window may hold them together
KINDS = pytest.mark.parametrize("kind", ["hysteretic in air", "kelvin_voigt in air", "hysteretic"])


def polynomial(kind):
    """Frequencies and matrices by ascending power of x: pairs of modes in a plane and out of it, 2 rad/s apart.

    The strain is that of few shapes, each shared by the modes near its frequency; drag varies smoothly along the cable.
    """
    number = np.repeat(np.arange(1, MODES // 2 + 1), 2)
    omega = 2.0 * number + np.tile([0.0, 0.003], MODES // 2)
    shared = np.exp(-np.abs(omega[:, None] - np.array([37.0, 111.0, 185.0])) / 3.0)
    shapes = np.linalg.qr(shared)[0] * omega[:, None]
    strain, apart = shapes @ shapes.T, np.abs(number[:, None] - number)
    mixed = np.where(np.add.outer(np.arange(MODES), np.arange(MODES)) % 2, 0.3, 1.0)
    air, stiffness, mass = 0.6 * 0.15**apart * mixed, np.diag(omega**2), np.eye(MODES)
    return omega, {
        "hysteretic in air": [stiffness + 1j * LOSS * strain, air, mass],
        "kelvin_voigt in air": [stiffness, air + TIME * strain, mass],
        "hysteretic": [stiffness + 1j * LOSS * strain, mass],
    }[kind]


@KINDS
def test_each_pole_is_found_once(kind):
    """Eigenvalues of the companion matrix of all modes."""
    omega, matrices = polynomial(kind)
    stiffness, *damping, mass = matrices
    expected = dense.poles(mass, damping[0], stiffness) if damping else np.linalg.eigvals(-stiffness)
    poles = poles_in_windows(matrices, omega).poles
    nearest = np.abs(poles[:, None] - expected).argmin(axis=1)
    assert sorted(nearest) == list(range(len(expected)))
    assert poles == pytest.approx(expected[nearest], rel=1e-8)


@KINDS
def test_the_inverse_is_the_sum_over_the_poles(kind):
    """By a system of equations at each frequency, from below the first mode to above the highest."""
    omega, matrices = polynomial(kind)
    resolvent = poles_in_windows(matrices, omega)
    push = np.sin(1.3 * np.arange(MODES))
    for s in 1j * np.linspace(0.3, 1.1 * omega[-1], 201):
        x = s**2 if len(matrices) == 2 else s
        answer = np.linalg.solve(sum(x**order * part for order, part in enumerate(matrices)), push)
        found = resolvent.left @ (resolvent.right @ push / (x - resolvent.poles))
        assert np.abs(found - answer).max() < BEYOND**2 * np.abs(answer).max()


def test_poles_that_are_lost_are_noticed(monkeypatch):
    """Windows of two modes, none beside them."""
    omega, matrices = polynomial("hysteretic in air")
    for name, value in {"window": 4, "window_margin": 0, "lowest_window": 1}.items():
        monkeypatch.setattr(type(SYSTEM), name, value)
    with pytest.raises(np.linalg.LinAlgError):
        poles_in_windows(matrices, omega)


@pytest.mark.parametrize("factor", [1e-6, 1.0, 30.0, 1000.0])  # the last ones are damped above critical: no solvent
def test_all_poles_of_few_modes_with_complex_stiffness_and_damping(factor):
    """Eigenvalues of the companion matrix; each shape solves the equations of its pole."""
    omega, matrices = polynomial("hysteretic in air")
    omega, (stiffness, damping, mass) = omega[:50], [matrix[:50, :50] for matrix in matrices]
    damping = factor * damping
    expected = dense.poles(mass, damping, stiffness)
    assert eigen_by_solvents(stiffness[None], damping[None])[2] == (factor <= 1)
    (poles,), vectors = poles_and_vectors([matrix[None] for matrix in (stiffness, damping, mass)], omega[None])
    nearest = np.abs(poles[:, None] - expected).argmin(axis=1)
    assert sorted(nearest) == list(range(len(expected)))
    assert poles == pytest.approx(expected[nearest], rel=1e-9)
    (amplitudes,) = mode_amplitudes(vectors, omega[None])
    forces = stiffness @ amplitudes + damping @ amplitudes * poles + amplitudes * poles**2
    assert np.abs(forces).max() < 1e-10 * omega[-1] ** 2 * np.abs(amplitudes).max()


# of single modes


def layout_of(mass, stiffness):
    """Of one suspension without cables, whose bodies have d displacements."""
    size = len(mass)
    return SimpleNamespace(
        equilibrium=SimpleNamespace(suspension=SimpleNamespace(cable_names=[])),
        shape=(1,),
        large=False,
        body_matrices=(stiffness[None], mass[None]),
        of_cables=lambda matrices: np.zeros((1, size, size)),
        ends=lambda displacements: np.zeros((1, 0, 6, 1)),
    )


@pytest.mark.parametrize("skew", [0.0, 0.6, -0.6])
def test_the_real_part_counts_the_part_of_the_damping_that_is_not_symmetric(skew):
    """Im v^H C v is zero of a symmetric C; here it is more than a tenth of 2 w v^H M v, and counts like mass."""
    mass, stiffness = np.diag([1.0, 2.0]), np.array([[2.0, -0.4], [-0.4, 5.0]])
    damping = np.array([[0.08, 0.02 + skew], [0.02 - skew, 0.05]])
    values, vectors = np.linalg.eig(dense.state_matrix(mass, damping, stiffness))
    for pole, vector in zip(values, vectors[:2].T, strict=True):
        if pole.imag < 0:
            continue
        share = abs((vector.conj() @ damping @ vector).imag / (2 * pole.imag * (vector.conj() @ mass @ vector).real))
        assert share > 0.1 if skew else share < 1e-15
        (found,) = poles_near(
            layout_of(mass, stiffness), [], np.array([pole * (1 + 1e-3j)]), vector[None], damping[None], 0.1
        )
        assert found.real == pytest.approx(pole.real, rel=1e-10)
        assert found.imag == pytest.approx(pole.imag, rel=1e-10)
