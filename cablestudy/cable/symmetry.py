"""Into which parts the motion of a system falls that is solved by itself, and which patterns each consists of.

A cable that is its own mirror image at mid-length has two: a motion is symmetric when its image in a mirror at right
angles to the chord is the same, and antisymmetric when it is the opposite. Neither stirs the other, and one half of the
cable tells how the other one moves.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.cable.assembly import masses, static_force_transfer_of_axes

SMALL = 200  # free displacements up to which the patterns are kept


@dataclass(frozen=True)
class SymmetrySubspace:
    """Patterns of motion, orthonormal by the mass of a cable of unit mass: all of them, or those of one symmetry.

    Attributes
    ----------
    sign : int
        1 for symmetric motion, -1 for antisymmetric motion, 0 for all of it.
    points : slice
        Gauss points by which to tell the energy of such a motion: those up to mid-length,
    middle : slice
        and which of the gradients there, d at each point, are at mid-length and count half.
    shapes : ndarray, shape (dof, k)
        P.
    transferred : ndarray, shape (n q, d, k)
        S M P: what the Gauss points carry less for the inertia of each.
    """

    sign: int
    points: slice
    middle: slice
    shapes: np.ndarray
    transferred: np.ndarray

    def root(self, system):
        """B M P, of the points alone, shape (..., r, k): its square is, to a factor, the compliance of the patterns."""
        root = system.root(self.transferred, self.points)
        root[..., self.middle, :] *= np.sqrt(0.5)
        return root


def symmetry_subspaces(mesh, axes, mirror_symmetric):
    """The parts of the motion of a system.

    Parameters
    ----------
    mesh : Mesh
    axes : tuple of int
        Which components of the chord frame move.
    mirror_symmetric : bool
        Whether the cable is its own mirror image at mid-length.

    Returns
    -------
    tuple of SymmetrySubspace
    """
    small = (mesh.nodes - 2) * len(axes) <= SMALL
    return (_symmetry_subspaces if small else _symmetry_subspaces.__wrapped__)(mesh, axes, mirror_symmetric)


@lru_cache(maxsize=128)
def _symmetry_subspaces(mesh, axes, mirror_symmetric):
    nodes, d = mesh.nodes - 2, len(axes)
    if not mirror_symmetric:
        return (_subspace(mesh, d, 0, slice(None), slice(0), np.eye(nodes * d)),)
    kept, found = (nodes + 1) // 2, []
    alike = np.where(np.array(axes) == 0, -1.0, 1.0)[:, None, None]  # what a mirror turns round
    one = np.eye(nodes * d).reshape(nodes, d, nodes, d)[:, :, :kept]
    for sign in (1, -1):
        both = (one + sign * alike * one[::-1]).reshape(nodes * d, kept * d)
        both = both[:, both.any(axis=0)]
        found.append(_subspace(mesh, d, sign, slice(nodes // 2 + 1), slice(kept * d, None), both))
    return tuple(found)


def _subspace(mesh, d, sign, points, middle, patterns):
    """Of motion that is made of some patterns, shape (dof, k)."""
    mass = masses(mesh, d)[1]
    weighted = mass @ patterns
    if mass.nnz == len(patterns):
        shapes = patterns / np.sqrt((patterns * weighted).sum(axis=0))
    else:
        shapes = np.linalg.solve(np.linalg.cholesky(patterns.T @ weighted), patterns.T).T
    return SymmetrySubspace(sign, points, middle, shapes, static_force_transfer_of_axes(mesh, d, mass @ shapes))
