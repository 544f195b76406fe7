"""Rotations (`statics/rigid.py`) and the tangent stiffness of suspensions (`statics/tangent.py`)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from suspensions import body, cable, sagging, suspension, trifilar

from cablestudy.statics import block_stiffness, pose_state, rest, rigid, stability, tangent
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.tolerances import STATICS


@pytest.fixture(scope="module")
def at_rest():
    """Two bodies and two junctions at rest."""
    found = rest.pose(sagging())
    assert found.record.converged
    assert found.stability.stable
    return found


def differences(found, step=1e-6):
    """-d(net forces)/d(displacements and rotations) of all degrees of freedom, by central differences."""
    flat = found.suspension.broadcast((1,))
    own = replace(flat, position=found.position[None], rotation=found.rotation[None], value=found.lengths[None])
    state, count = rest.start(replace(own, stated=("unstretched_length",) * len(own.stated))), own.position.shape[1]
    columns = []
    for i in range(6 * count):
        move = np.zeros(6 * count)
        move[i] = step
        forces = [
            pose_state.evaluate(own, pose_state.displaced(own, state, sign * move.reshape(1, count, 6))).net.ravel()
            for sign in (1, -1)
        ]
        columns.append((forces[1] - forces[0]) / (2 * step))
    return np.stack(columns, axis=-1)


def test_differences_of_forces(at_rest):
    """Held degrees of freedom too; junctions have no moments."""
    count = len(at_rest.suspension.body_names)
    whole = block_stiffness.full(at_rest.blocks, count)
    expected = differences(at_rest)
    np.testing.assert_allclose(whole, expected, atol=2e-8 * np.abs(expected).max())


def test_the_energy_and_its_slope():
    """Along any step from any pose the energy changes as the net forces tell, dead moments included."""
    flat = sagging().broadcast((1,))
    flat = replace(flat, moment=flat.moment + np.array([4.0, -3, 5]))
    state = rest.start(flat)
    step = np.random.default_rng(8).normal(size=(1, 4, 6)) * flat.free
    along = np.polynomial.legendre.leggauss(12)
    size, slope = 2e-3, 0.0  # without a cable that becomes taut on the way
    for place, weight in zip(*along, strict=True):
        there = pose_state.evaluate(flat, pose_state.displaced(flat, state, step * size * (1 + place) / 2))
        slope += weight / 2 * size * (there.net * step).sum()
    first, last = (pose_state.evaluate(flat, pose_state.displaced(flat, state, step * x)) for x in (0, size))
    change = last.energy - first.energy - pose_state.displaced_with_work(flat, state, step * size)[1]
    assert change[0] == pytest.approx(-slope, rel=1e-7)


def test_symmetric_under_all_loads_only(at_rest):
    """K_tt - K_tt^T = [M x], M the moment of the loads that are counted: zero for all of them."""
    whole = block_stiffness.full(at_rest.blocks, len(at_rest.suspension.body_names))
    np.testing.assert_allclose(whole, whole.T, atol=1e-9 * np.abs(whole).max())
    center, weight = tangent.weights(at_rest.suspension, at_rest.rotation)
    ends, arms = at_rest.end_forces, at_rest.arms
    own = at_rest.suspension.owner == 0
    moment = np.cross(arms[own], ends[own]).sum(axis=0)  # of the cables alone on the first body
    np.testing.assert_allclose(moment, -np.cross(center[0], weight[0]), atol=1e-9)
    cables_only = whole[3:6, 3:6] + cross_matrix(weight[0]) @ cross_matrix(center[0])
    np.testing.assert_allclose(cables_only - cables_only.T, cross_matrix(moment), atol=1e-7 * np.abs(moment).max())
    assert np.abs(moment).max() > 1


def test_a_dead_moment_makes_it_unsymmetric():
    """A moment that keeps its axis has no potential: the difference of the halves is its cross matrix."""
    loaded = trifilar(moment=(3.0, -2.0, 4.0), line=0.2)
    found = rest.pose(loaded)
    assert found.record.converged
    block = found.body_stiffness[0, 3:, 3:]
    np.testing.assert_allclose(block.T - block, cross_matrix(loaded.moment[0]), atol=1e-6)
    np.testing.assert_allclose(differences(found)[3:, 3:], block, atol=2e-6 * np.abs(block).max())


def test_least_eigenvalue_dense_and_sparse():
    """The same stability from the dense matrix and from the sparse one."""
    found = rest.pose(sagging())
    own = found.suspension
    scales = np.sqrt(block_stiffness.magnitudes(found.blocks, own))
    value, vector = stability._least_eigenvalue(block_stiffness.scaled_sparse(found.blocks, own, scales))
    assert value == pytest.approx(found.stability.least, rel=1e-9)
    assert np.linalg.norm(vector) == pytest.approx(1)


def test_bodies_without_free_degrees_have_a_stiffness():
    """Held degrees of freedom are moved too: two springs of a held body."""
    held = suspension(
        [body("b", (0, 0, 0), 1.0, free=(False,) * 6)],
        [
            cable((0, 0, 5.0), ("b", (0, 0, 1.0)), 1e4, value=3.9),
            cable((0, 0, -5.0), ("b", (0, 0, -1.0)), 1e4, value=3.9),
        ],
    )
    found = rest.pose(held)
    k = found.body_stiffness[0]
    tension = 1e4 * (4 / 3.9 - 1)
    assert k[2, 2] == pytest.approx(2 * 1e4 / 3.9, rel=1e-12)
    assert k[0, 0] == pytest.approx(2 * tension / 4, rel=1e-12)
    assert k[5, 5] == pytest.approx(0, abs=1e-12)
    assert found.stability.stable  # nothing is free


@pytest.mark.parametrize("dense_freedoms", [100, 0], ids=["dense", "sparse"])
def test_displacements_and_condensed_stiffness_are_those_of_the_whole_matrix(at_rest, monkeypatch, dense_freedoms):
    """Few equations are dense, many are sparse: both hold against K u = f and K_bb - K_bj K_jj^-1 K_jb, written out."""
    monkeypatch.setattr(type(STATICS), "dense_freedoms", dense_freedoms)
    suspension, blocks, bodies = at_rest.suspension, at_rest.blocks, 6 * at_rest.suspension.bodies
    whole = block_stiffness.full(blocks, len(suspension.body_names))
    free = suspension.free.ravel()
    forces = np.random.default_rng(3).normal(size=(free.sum(), 2))
    found = block_stiffness.displacements(blocks.of(None), suspension, forces[None])
    assert whole[np.ix_(free, free)] @ found[0] == pytest.approx(forces, abs=1e-9)
    junctions = np.flatnonzero(free & (np.arange(len(free)) >= bodies))
    following = np.linalg.inv(whole[np.ix_(junctions, junctions)]) @ whole[junctions, :bodies]
    condensed = whole[:bodies, :bodies] - whole[:bodies, junctions] @ following
    for body_number, of_body in enumerate(block_stiffness.body_stiffness(blocks, suspension)):
        rows = slice(6 * body_number, 6 * body_number + 6)
        assert of_body == pytest.approx(condensed[rows, rows], abs=1e-9 * np.abs(condensed).max())


# ------------------------------------------------------------------------------------------------------------ rotations


def test_angles_there_and_back():
    """scipy's extrinsic rotations about x, y, z are the same matrix."""
    angles = np.random.default_rng(1).uniform([-3, -1.5, -3], [3, 1.5, 3], (20, 3))
    matrices = rigid.from_angles(angles)
    np.testing.assert_allclose(matrices, Rotation.from_euler("xyz", angles).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(rigid.to_angles(matrices), angles, atol=1e-14)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_a_pitch_of_90_degrees_has_no_roll(pitch):
    matrix = rigid.from_angles(np.array([0.3, pitch, 0.8]))
    angles = rigid.to_angles(matrix)
    assert angles[0] == 0
    np.testing.assert_allclose(rigid.from_angles(angles), matrix, atol=1e-12)


@pytest.mark.parametrize("pitch", [-1.2, 0.0, 0.7, np.pi / 2 - 1e-3])
def test_a_small_rotation_changes_angles_by_no_more_than_their_errors_and_by_these(pitch):
    """Each angle changes by its error for one of the eight rotations that have the given components."""
    angles, most = np.array([0.3, pitch, -2.0]), np.array([1e-8, 3e-8, 2e-8])
    signs = np.array(list(product([-1.0, 1.0], repeat=3)))
    turned = Rotation.from_rotvec(signs * most) * Rotation.from_euler("xyz", angles)
    changes = np.abs(turned.as_euler("xyz") - angles).max(axis=0)
    assert rigid.angle_errors(rigid.from_angles(angles), most) == pytest.approx(changes, rel=1e-4)


def test_roll_and_yaw_are_unknown_at_a_pitch_of_90_degrees():
    errors = rigid.angle_errors(rigid.from_angles(np.array([0.3, np.pi / 2, 0.8])), np.full(3, 1e-9))
    assert errors.tolist() == pytest.approx([np.pi, 1.4e-9, np.pi], rel=0.1)


@pytest.mark.parametrize("angle", [1e-12, 1e-5, 0.3, 3.0])
def test_a_turn_is_the_matrix_exponential(angle):
    vector = angle * np.array([0.48, -0.6, 0.64])
    np.testing.assert_allclose(rigid.turn(vector), expm(rigid.cross_matrix(vector)) - np.eye(3), atol=1e-15)
    along = rigid.turn(vector) @ np.array([1.0, 0, 0]) / angle  # no digits are lost where the angle is small
    exact = Rotation.from_rotvec(vector).apply([1.0, 0, 0]) / angle - [1 / angle, 0, 0]
    np.testing.assert_allclose(along, exact, atol=4e-16 / angle + 1e-15)
