"""Pairs of modes of two models of one suspension, by their shapes: close modes may come in another order."""

from functools import lru_cache

import numpy as np

from cablestudy.cable.element import basis, lagrange
from cablestudy.system.damping import assigned


def pair_modes(modes, others):
    """Number (from 0) of the mode of another model that has the shape of each mode, shape (k,).

    Parameters
    ----------
    modes : CoupledModes
        k of them.
    others : CoupledModes
        Of the same suspension with other meshes or coordinates, no fewer.

    Notes
    -----
    The pairs have the largest sum of modal assurance criteria (phi^T M psi)^2, of mass-normalised shapes with the
    masses of the nodes of the other model. Allemang and Brown (1982).
    """
    bodies = (one.layout.displaced(one.layout.bodies(one.shapes)) for one in (modes, others))
    product = [_product(next(bodies), others.layout.mass @ next(bodies))]
    models, own = others.solution.models, modes.solution.models.meshes
    for place, (mesh, mass) in enumerate(zip(models.meshes, models.cables.mass.tolist(), strict=True)):
        if mesh is not None:
            moved = _interpolation(own[place], mesh) @ modes.displacements[place].swapaxes(0, 1)
            weighted = mass * _shares(mesh)[:, None, None] * others.displacements[place]
            product.append(_product(moved.swapaxes(0, 1), weighted))
    return assigned(sum(product) ** 2)[1]


def _product(first, second):
    """Sum of the products of two displacements of places, shapes (..., k) and (..., m): shape (k, m)."""
    return first.reshape(-1, first.shape[-1]).T @ second.reshape(-1, second.shape[-1])


@lru_cache(maxsize=128)
def _shares(mesh):
    """Share of each node in the mass of a cable with all it carries, shape (nodes,). [-]"""
    return mesh.node_masses / mesh.node_masses.sum()


@lru_cache(maxsize=128)
def _interpolation(mesh, other):
    """Displacements at the nodes of another mesh from those at the nodes of a mesh, shape (other nodes, nodes). [-]"""
    which, local = mesh.located(other.node_positions)
    found = np.zeros((other.nodes, mesh.nodes))
    np.put_along_axis(found, mesh.element_nodes[which], lagrange(basis(mesh.order).nodes, local), axis=1)
    return found
