"""Poles of coupled modes found in windows, against one eigenvalue problem of all of them and systems of equations."""

import numpy as np
import pytest

from cablestudy.system.pole_windows import mode_amplitudes, poles_and_vectors, poles_in_windows
from cablestudy.system.solvents import eigen_by_solvents
from cablestudy.system.tolerances import SYSTEM

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
    companion = -stiffness
    if damping:
        companion = np.block([[0 * mass, mass], [-stiffness, -damping[0]]])
    expected = np.linalg.eigvals(companion)
    poles, _, _ = poles_in_windows(matrices, omega)
    nearest = np.abs(poles[:, None] - expected).argmin(axis=1)
    assert sorted(nearest) == list(range(len(expected)))
    assert poles == pytest.approx(expected[nearest], rel=1e-8)


@KINDS
def test_the_inverse_is_the_sum_over_the_poles(kind):
    """By a system of equations at each frequency, from below the first mode to above the highest."""
    omega, matrices = polynomial(kind)
    poles, left, right = poles_in_windows(matrices, omega)
    push = np.sin(1.3 * np.arange(MODES))
    for s in 1j * np.linspace(0.3, 1.1 * omega[-1], 201):
        x = s**2 if len(matrices) == 2 else s
        answer = np.linalg.solve(sum(x**order * part for order, part in enumerate(matrices)), push)
        found = left @ (right @ push / (x - poles))
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
    expected = np.linalg.eigvals(np.block([[0 * mass, mass], [-stiffness, -damping]]))
    assert eigen_by_solvents(stiffness[None], damping[None])[2] == (factor <= 1)
    (poles,), vectors = poles_and_vectors([matrix[None] for matrix in (stiffness, damping, mass)], omega[None])
    nearest = np.abs(poles[:, None] - expected).argmin(axis=1)
    assert sorted(nearest) == list(range(len(expected)))
    assert poles == pytest.approx(expected[nearest], rel=1e-9)
    (amplitudes,) = mode_amplitudes(vectors, omega[None])
    forces = stiffness @ amplitudes + damping @ amplitudes * poles + amplitudes * poles**2
    assert np.abs(forces).max() < 1e-10 * omega[-1] ** 2 * np.abs(amplitudes).max()
