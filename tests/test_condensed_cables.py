"""Many cables condensed to their ends at complex frequencies: against dense matrices of all nodes, and one by one."""

from dataclasses import replace

import numpy as np
import pytest
from cables import batch, chord_span, condensed_stiffness
from references import dense

from cablestudy.cable import catenary
from cablestudy.cable.damping import Damping
from cablestudy.system.cables import Models
from cablestudy.system.condensed_cables import solved
from cablestudy.system.hanging_cables import STRAIGHT, Cables

SPANS = [chord_span(100.0, degrees, strain, 1e5) for degrees, strain in ((20.0, -0.01), (60.0, 0.02), (19.0, 0.005))]
DAMPING = [
    Damping("hysteretic", loss_factor=0.3),
    Damping("kelvin_voigt", time=0.02, viscous=0.4),
    Damping("modal", ratio=0.0, viscous=0.1),
]
S = np.array([-0.1 + 2.0j, -0.02 + 5.0j, -0.4 + 0.9j])


def models_of(damping=DAMPING, coarser=0, spans=SPANS, orders=16.0):
    """`Models` of cables on one mesh: in modes, or with all motion of a mesh that is coarser."""
    cables = Cables(catenary.solve(batch(spans)), damping)
    models = Models(cables, cables.meshes(np.full(cables.count, orders)))
    return models.with_all_displacements(coarser) if coarser else models


def condensed_of(models):
    return models.condensed(np.arange(models.cables.count))


@pytest.mark.parametrize("coarser", [0, 2])
def test_the_dynamic_stiffness_is_that_of_dense_matrices_condensed(coarser):
    """Modes, and shapes that are no modes: both span all that the mesh allows."""
    models = models_of(coarser=coarser)
    (group,), (condensed,) = models.groups, condensed_of(models)
    found = condensed.dynamic_stiffness(S)[0]
    for cable, (span, damping, s) in enumerate(zip(SPANS, DAMPING, S.tolist(), strict=True)):
        rotation = np.kron(np.eye(2), span.frame)
        loss = 1j * damping.loss_factor + s * damping.time
        moving = np.sqrt(s**2 + s * damping.viscous / span.mass)
        expected = condensed_stiffness(group.ends._dynamics.take(cable), moving, loss)
        expected = rotation.T @ expected @ rotation
        assert np.abs(found[cable] - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("coarser", [0, 2])
def test_the_slope_is_that_of_the_dynamic_stiffness(coarser):
    (condensed,) = condensed_of(models_of(coarser=coarser))
    step = 1e-5
    slope = (condensed.dynamic_stiffness(S + step)[0] - condensed.dynamic_stiffness(S - step)[0]) / (2 * step)
    assert condensed.dynamic_stiffness(S)[1] == pytest.approx(slope, rel=1e-6, abs=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("law", [
    {"model": "modal", "ratio": 0.2}, {"model": "hysteretic", "loss_factor": 0.1},
    {"model": "kelvin_voigt", "time": 0.01},
])  # fmt: skip
def test_it_is_that_of_the_superelements(law):
    """With point masses, on which no viscous damping acts."""
    loads = [(0.3, (0, 0, -30.0)), (0.8, (0, 0, -60.0))]
    spans = [chord_span(100.0, degrees, -0.01, 1e5, loads=loads) for degrees in (0.0, 20.0)]
    spans = [replace(span, load_masses=np.array([3.0, 6.0])) for span in spans]
    models = models_of(Damping(**law, viscous=0.3), spans=spans)
    for condensed in condensed_of(models):
        assert condensed.carried is not None
        found = condensed.dynamic_stiffness(S[condensed.cables])[0]
        for matrix, cable in zip(found, condensed.cables.tolist(), strict=True):
            expected = models.elements[cable].dynamic_stiffness(S[cable, None])[0]
            assert np.abs(matrix - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["added_damping", "loads"])
def test_added_damping_and_loads_need_not_be_symmetric(name):
    """Against a dense solution; it takes another way, to the same numbers where they are zero."""
    models = models_of()
    (condensed,) = condensed_of(models)
    size = condensed.omega.shape[1] + 6
    none = condensed.with_matrices(name, {0: np.zeros((size, size))})
    assert none.dynamic_stiffness(S)[0] == pytest.approx(
        condensed.dynamic_stiffness(S)[0], rel=1e-9, abs=1e-9 * np.abs(condensed.dynamic_stiffness(S)[0]).max()
    )
    matrix = np.random.default_rng(1).normal(size=(size, size)) * 0.1
    with_matrix = condensed.with_matrices(name, {1: matrix})
    found = with_matrix.dynamic_stiffness(S)[0][1]
    mass, damping, stiffness = models.elements[1].matrices()
    whole = S[1] ** 2 * mass + S[1] * damping + stiffness + (S[1] if name == "added_damping" else 1.0) * matrix
    expected = dense.condensed(whole, np.arange(size - 6, size))
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
    if name == "loads":  # the derivative is that of differences
        slope, step = with_matrix.dynamic_stiffness(S)[1], 1e-5 * np.abs(S)
        above, below = (with_matrix.dynamic_stiffness(S + shift)[0] for shift in (step, -step))
        by_differences = (above - below) / (2 * step[:, None, None])
        assert np.abs(slope - by_differences).max() < 1e-7 * np.abs(by_differences).max()


def test_cables_without_mass():
    """A spring along the chord, with its damping, and viscous damping as of a mass along a straight line; one slack."""
    spans = [chord_span(100.0, 20.0, strain, 1e5, mass=0.0) for strain in (0.01, -0.01)]
    cables = Cables(catenary.solve(batch(spans)), [DAMPING[1], DAMPING[0]])
    (condensed,) = condensed_of(Models(cables, [None, None]))
    taut, slack = condensed.dynamic_stiffness(S[:2])[0]
    span, s = spans[0], S[0]
    along = np.outer(span.frame[0], span.frame[0]) * span.axial_stiffness / span.unstretched_length
    expected = cables.end_stiffness[0] + s * 0.02 * np.kron([[1.0, -1.0], [-1.0, 1.0]], along)
    expected = expected + s * 0.4 * span.unstretched_length * STRAIGHT
    assert np.abs(taut - expected).max() < 1e-12 * np.abs(expected).max()
    assert not slack.any()


@pytest.mark.parametrize("coarser", [0, 2])
def test_no_digit_depends_on_other_cables(coarser):
    together = condensed_of(models_of(coarser=coarser))[0].dynamic_stiffness(S)
    for cable in range(len(SPANS)):
        alone = condensed_of(models_of(DAMPING[cable : cable + 1], coarser, SPANS[cable : cable + 1]))[0]
        for found, expected in zip(together, alone.dynamic_stiffness(S[cable : cable + 1]), strict=True):
            assert (found[cable] == expected[0]).all()


def test_a_singular_matrix_spoils_no_other():
    matrices = np.array([np.eye(2), np.ones((2, 2)), 2 * np.eye(2)], dtype=complex)
    found = solved(matrices, np.ones((3, 2, 1), dtype=complex))
    assert np.isnan(found[1]).all()
    assert (found[[0, 2], :, 0] == [[1.0], [0.5]]).all()
