"""Poles of single modes with damping that is not symmetric, as that of drag, against dense eigenvalues."""

from types import SimpleNamespace

import numpy as np
import pytest

from cablestudy.system.damped_pole import poles_near


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
    inverse = np.linalg.inv(mass)
    states = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    values, vectors = np.linalg.eig(states)
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
