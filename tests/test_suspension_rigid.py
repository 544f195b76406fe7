"""`statics/rigid.py`: rotations, and stiffness matrices of rigid bodies."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from cablestudy.statics import rigid


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


@pytest.mark.parametrize("angle", [1e-12, 1e-5, 0.3, 3.0])
def test_a_turn_is_the_matrix_exponential(angle):
    vector = angle * np.array([0.48, -0.6, 0.64])
    np.testing.assert_allclose(rigid.turn(vector), expm(rigid.cross_matrix(vector)) - np.eye(3), atol=1e-15)
    along = rigid.turn(vector) @ np.array([1.0, 0, 0]) / angle  # no digits are lost where the angle is small
    exact = Rotation.from_rotvec(vector).apply([1.0, 0, 0]) / angle - [1 / angle, 0, 0]
    np.testing.assert_allclose(along, exact, atol=4e-16 / angle + 1e-15)


def test_a_spring_at_an_attachment():
    """Force and moment of a spring on a body that is displaced and turned a little, linear in both."""
    rng = np.random.default_rng(2)
    half = rng.normal(size=(3, 3))
    spring, first, second = half @ half.T, rng.normal(size=3), rng.normal(size=3)
    shift, turn = rng.normal(size=3), rng.normal(size=3)
    force = spring @ (shift + np.cross(turn, second))
    at_second = rigid.point_movement(second) @ np.concatenate([shift, turn])
    wrench = rigid.point_movement(first).T @ spring @ at_second
    np.testing.assert_allclose(wrench, np.concatenate([force, np.cross(first, force)]), rtol=1e-13)


def test_another_reference_point():
    """Dead forces at points of a body: its stiffness is -[F x][r x] with arms from either reference point."""
    rng = np.random.default_rng(3)
    forces, arms, offset = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=3)
    half = rng.normal(size=(4, 3, 3))

    def stiffness(from_point):
        total = np.zeros((6, 6))
        for force, arm, spring in zip(forces, arms, half @ np.swapaxes(half, 1, 2), strict=True):
            r = arm - from_point
            total += rigid.point_movement(r).T @ spring @ rigid.point_movement(r)
            total[3:, 3:] -= rigid.cross_matrix(force) @ rigid.cross_matrix(r)
        return total

    d = rigid.cross_matrix(offset)
    k11, k12, k21, k22 = (stiffness(np.zeros(3))[i : i + 3, j : j + 3] for i in (0, 3) for j in (0, 3))
    corner = k22 + k21 @ d - d @ (k12 + k11 @ d) + rigid.cross_matrix(forces.sum(axis=0)) @ d
    moved = np.block([[k11, k12 + k11 @ d], [k21 - d @ k11, corner]])
    np.testing.assert_allclose(moved, stiffness(offset), rtol=1e-12, atol=1e-12)
