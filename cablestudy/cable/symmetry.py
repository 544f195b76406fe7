"""Splits the motion of a mirror-symmetric cable into its symmetric and antisymmetric subspaces.

Reflection at mid-length, across the chord, leaves a symmetric motion unchanged and reverses an antisymmetric one. The
two are uncoupled, and half of the cable determines each.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.cable.assembly import inertia, static_force_transfer_of_axes
from cablestudy.cable.tolerances import CABLE


@dataclass(frozen=True)
class SymmetrySubspace:
    """Basis of the motion of a system, all of it or that of one symmetry; orthonormal by the mass of a unit cable."""

    sign: int  # 1 for symmetric motion, -1 for antisymmetric motion, 0 for all motion
    points: slice  # Gauss points that determine the energy: those up to mid-length, or all
    middle: slice  # rows of the gradients there (d for each point) that are at mid-length and count half
    shapes: np.ndarray  # P, shape (dof, k)
    accumulated: np.ndarray  # S M P, tension vectors that balance the inertia forces M P, shape (n q, d, k)

    def root(self, system):
        """B M P at `points`, shape (..., r, k); its square is P^T M K^-1 M P, to a factor of two for half a cable."""
        root = system.root(self.accumulated, self.points)
        root[..., self.middle, :] *= np.sqrt(0.5)
        return root


def symmetry_subspaces(mesh, axes, mirror_symmetric):
    """Uncoupled subspaces of the motion of a system: a tuple of one or two `SymmetrySubspace`.

    Parameters
    ----------
    mesh : Mesh
    axes : tuple of int
        Which components of the chord frame move.
    mirror_symmetric : bool
        Whether the cable is its own mirror image at mid-length.
    """
    small = (mesh.nodes - 2) * len(axes) <= CABLE.cached_basis_freedoms
    return (_symmetry_subspaces if small else _symmetry_subspaces.__wrapped__)(mesh, axes, mirror_symmetric)


@lru_cache(maxsize=128)
def _symmetry_subspaces(mesh, axes, mirror_symmetric):
    """`symmetry_subspaces` that are computed, and cached by mesh and axes."""
    nodes, d = mesh.nodes - 2, len(axes)
    if not mirror_symmetric:
        return (_subspace(mesh, d, 0, slice(None), slice(0), np.eye(nodes * d)),)
    half, subspaces = (nodes + 1) // 2, []  # nodes up to mid-length
    reflection = np.where(np.array(axes) == 0, -1.0, 1.0)[:, None, None]  # motion along the chord is reversed
    unit_motions = np.eye(nodes * d).reshape(nodes, d, nodes, d)[:, :, :half]  # of one node along one axis each
    for sign in (1, -1):
        patterns = (unit_motions + sign * reflection * unit_motions[::-1]).reshape(nodes * d, half * d)
        patterns = patterns[:, patterns.any(axis=0)]  # the node at mid-length has either motion along an axis or none
        subspaces.append(_subspace(mesh, d, sign, slice(nodes // 2 + 1), slice(half * d, None), patterns))
    return tuple(subspaces)


def _subspace(mesh, d, sign, points, middle, patterns):
    """`SymmetrySubspace` that is spanned by the motions `patterns`, shape (dof, k)."""
    weighted = _inner_inertia(mesh, d, patterns)
    if mesh.mass == "lumped":
        shapes = patterns / np.sqrt((patterns * weighted).sum(axis=0))
    else:
        shapes = np.linalg.solve(np.linalg.cholesky(patterns.T @ weighted), patterns.T).T
    accumulated = static_force_transfer_of_axes(mesh, d, _inner_inertia(mesh, d, shapes))
    return SymmetrySubspace(sign, points, middle, shapes, accumulated)


def _inner_inertia(mesh, d, movements):
    """M u for movements u of the inner nodes, both of shape (dof, k)."""
    of_all_nodes = np.zeros((mesh.nodes, d, movements.shape[-1]))
    of_all_nodes[1:-1] = movements.reshape(mesh.nodes - 2, d, movements.shape[-1])
    return inertia(mesh, of_all_nodes)[1:-1].reshape(movements.shape)
