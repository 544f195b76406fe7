"""Variances of linear systems in coloured noise by their poles, against integrals in closed form and by quadrature."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from random_twins import random_scene
from references.dense import state_matrix
from scipy.integrate import quad
from suspension_cases import in_wind

from cablestudy.cable.records import stack
from cablestudy.scene.scene import CableScene
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.system import analysis_of
from cablestudy.system.residues import eigen, residues
from cablestudy.wind import variance
from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import Noise, Panels, smooth_on, variances

RANGE = 1e-7, 1e7


def system(a, b, c, d=None):
    a, b, c = (np.array(part, dtype=float) for part in (a, b, c))
    return residues(eigen(a), b, c, np.zeros((len(c), b.shape[1])) if d is None else np.array(d, dtype=float))


def noise(panels, matrix, function):
    return Noise(np.array([matrix], dtype=float), [slice(None)], [[function(panels.frequency)[None]]])


def panels_of(function=None):
    edges = np.geomspace(*RANGE, 8 * 14 + 1)
    return Panels(smooth_on(edges, [function] if function else []))


@pytest.mark.parametrize("ratio", [1e-8, 1e-3, 0.3, 1.0, 3.0])
def test_an_oscillator_in_white_noise(ratio):
    """x'' + 2 z w x' + w^2 x = u with S = 1: variance 1/(8 z w^3), of x' 1/(8 z w); z = 1 has no eigenvectors."""
    omega, panels = 2.7, panels_of()
    found = variances(
        system([[0, 1], [-(omega**2), -2 * ratio * omega]], [[0], [1]], np.eye(2)),
        panels, noise(panels, [[1]], np.ones_like), np.ones((1, len(panels.frequency))),
    )  # fmt: skip
    assert found[0] == pytest.approx([1 / (8 * ratio * omega**3), 1 / (8 * ratio * omega)], rel=1e-6)


@pytest.mark.parametrize("loss", [1e-6, 0.02, 0.3])
def test_two_oscillators_with_complex_stiffness_in_coloured_noise(loss):
    """Against quadrature of |C (K (1 + i loss) - w^2 + i w c)^-1 B + D|^2, which holds for positive frequencies."""
    stiffness = np.array([[5.0, -1.2], [-1.2, 4.0]]) + 1j * loss * np.array([[5.0, -1.0], [-1.0, 0.5]])
    damping, b, c, d = np.array([[0.03, 0.01], [0.01, 0.02]]), np.array([[1.0], [0.4]]), np.array([[1.0, 0.5]]), 0.01
    a = state_matrix(np.eye(2), damping, stiffness)
    whole = residues(eigen(a), np.concatenate([0 * b, b]), np.concatenate([c, 0 * c], axis=1), np.array([[d]]))
    panels = panels_of()

    def spectrum(f):
        return 1 / (1 + (3 * f) ** 2)

    ones = np.ones((1, len(panels.frequency)))
    found = variances(replace(whole, one_sided=True), panels, noise(panels, [[1.0]], spectrum), ones)

    def output(f):
        s = 2j * np.pi * f
        return abs((c @ np.linalg.solve(s**2 * np.eye(2) + s * damping + stiffness, b))[0, 0] + d) ** 2 * spectrum(f)

    resonances = np.abs(whole.poles[whole.poles.imag > 0]) / (2 * np.pi)
    marks = [0.0, *np.sort([factor * one for one in resonances for factor in (0.9, 0.99, 1.0, 1.01, 1.1)]), 1, 10, 1e4]
    expected = sum(quad(output, *pair, epsrel=1e-10, limit=400)[0] for pair in pairwise(marks))
    assert found[0, 0] == pytest.approx(expected, rel=1e-6)


def test_coloured_noise_in_two_inputs_with_a_direct_part():
    """Against quadrature of |C (i w - A)^-1 B + D|^2: two close resonances, weights that oscillate."""
    a = [[0, 1, 0, 0], [-4, -0.1, 0.05, 0], [0, 0, 0, 1], [0.05, 0, -4.2, -0.02]]
    b, c = [[0, 0], [1, 0.3], [0, 0], [-0.5, 1]], [[1, 0, 1, 0], [0, 1, 0, 0]]
    d, matrix = [[0.02, 0.0], [0.0, 0.1]], np.array([[1.0, 0.4], [0.4, 2.0]])

    def spectrum(f):
        return 1 / (1 + (3 * f) ** 2)

    def weight(f):
        return 1 - np.sinc(2 * f) ** 2

    panels = panels_of(weight)
    found = variances(
        system(a, b, c, d), panels, noise(panels, matrix, spectrum), np.stack([np.ones_like(panels.frequency),
        weight(panels.frequency)]),
    )  # fmt: skip

    def output(f, row):
        moved = np.linalg.solve(2j * np.pi * f * np.eye(4) - np.array(a), np.array(b))
        answer = (np.array(c) @ moved + np.array(d))[row]
        return (answer @ matrix @ answer.conj()).real * spectrum(f)

    marks = [0.0, 0.2, 0.31, 0.318, 0.326, 0.34, 0.5, 1.0, 3.0, 10.0, 100.0, 1e4]
    for place, factor in enumerate([lambda f: 1.0, weight]):
        expected = [
            sum(quad(lambda f, row=row, factor=factor: factor(f) * output(f, row), *pair, epsrel=1e-10, limit=400)[0]
                for pair in pairwise(marks))
            for row in (0, 1)
        ]  # fmt: skip
        assert found[place] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("count", [24, 64, 100])
def test_more_modes_of_a_hysteretic_cable_do_not_change_the_rms_with_a_loop(count):
    """The notch of a slow loop has a double pole, and hysteretic damping many poles that are damped alike."""
    wind = analysis_of(CableCase(CableScene.model_validate(random_scene(48))))
    found = in_wind(wind, count).turbulence.variances.value[0]
    few = in_wind(wind, 32).turbulence.variances.value[0]
    assert found[0] == pytest.approx(few[0], rel=1e-7)


@pytest.mark.parametrize("seed", [16, 49])
def test_the_error_of_few_modes_counts_what_they_leave_out_of_damping(seed):
    """Loss factors of 0.2, cables that hang or carry masses, against 200 modes; 24 are up to 0.15 % off."""
    wind = analysis_of(CableCase(CableScene.model_validate(random_scene(seed, model={"accuracy": 1e-4}))))
    few, many = (in_wind(wind, count, responses=True).plant_in_wind.at_rest.variances for count in (24, 200))
    error = np.abs(few.value - many.value)
    assert (error[:, 0] <= few.by_modes[:, 0] + 1e-9 * many.value[:, 0]).all()


@pytest.mark.parametrize("seed", [22, 31])
def test_the_error_of_models_that_are_compared_is_not_below_the_true_one(seed):
    """To 1e-9, which one model alone does not state: against 200 modes."""
    scene = random_scene(seed, model={"accuracy": 1e-9})
    del scene["winch"]
    wind = analysis_of(CableCase(CableScene.model_validate(scene)))
    truth = in_wind(wind, 200, responses=True).plant_in_wind.at_rest.variances.value[0, 0]
    found, error = wind.rms(["gondola.x"], "value", open_loop=True)
    assert len(wind.closed_loop.modes) <= 100
    assert abs(found / np.sqrt(truth) - 1) <= error <= 1e-9


def test_variances_of_many_rows_are_those_of_each_alone():
    """Oscillators with other frequencies and panels, in one call: against 1/(8 z w^3), and to the last digit alone."""
    omega, ratio = np.array([1.1, 2.7, 9.0]), np.array([1e-6, 0.02, 0.6])
    systems = [
        system([[0, 1], [-(w**2), -2 * z * w]], [[0], [1]], np.eye(2)) for w, z in zip(omega, ratio, strict=True)
    ]
    edges = np.stack([np.geomspace(1e-7 * k, 1e7, 8 * 14 + 1) for k in (1, 2, 3)])
    panels = Panels(edges)
    ones = np.ones((3, 1, panels.frequency.shape[-1]))
    noises = [noise(Panels(of_row), [[1]], np.ones_like) for of_row in edges]
    together = variances(stack(systems), panels, stack(noises), ones)
    assert together[:, 0, 0] == pytest.approx(1 / (8 * ratio * omega**3), rel=1e-6)
    for found, one, of_row, own in zip(together, systems, edges, noises, strict=True):
        assert np.array_equal(found, variances(one, Panels(of_row), own, ones[0]))


@pytest.mark.parametrize("entries", [1, WIND.product_entries])
def test_poles_times_matrices_are_summed_a_few_poles_at_once(monkeypatch, entries):
    """Sum over k of c_k b_j S_k, of two rows with 5 poles, 3 weights, 7 matrices and 4 inputs: term by term."""
    monkeypatch.setattr(type(WIND), "product_entries", entries)
    random = np.random.default_rng(1)
    inputs, matrices = random.normal(size=(2, 5, 4, 2)) @ [1, 1j], random.normal(size=(2, 7, 4, 4))
    integrals = random.normal(size=(2, 2, 5, 3, 7))
    expected = np.einsum("rNwp,rNi,rpil->rNwl", integrals[:, 0] + 1j * integrals[:, 1], inputs, matrices)
    assert variance._times_matrices(inputs, matrices, integrals) == pytest.approx(expected, rel=1e-12)
