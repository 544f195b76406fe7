"""Pairing of the modes of two models of one suspension by their shapes, since close modes may come in another order."""

from functools import lru_cache

import numpy as np

from cablestudy.cable.element import basis, lagrange
from cablestudy.system.damping import assign_columns


def pair_modes(modes, others):
    """Find for each mode of one model of a suspension the mode of another model that has about its shape.

    Parameters
    ----------
    modes : CoupledModes
        k modes phi, perhaps none.
    others : CoupledModes
        At least k modes psi of the same suspension, with other meshes or coordinates.

    Returns
    -------
    ndarray of int, shape (k,)
        Index in `others` of the mode that belongs to each of `modes`; no index occurs twice.

    Notes
    -----
    The pairs have the largest sum of (phi^T M psi)^2, the modal assurance criterion of mass-normalised shapes (Allemang
    and Brown, 1982). M has the masses of bodies and nodes in the model of `others`, at whose nodes phi is interpolated.
    """
    if not len(modes):
        return np.zeros(0, dtype=int)
    motion, other_motion = (model.layout.displaced(model.layout.bodies(model.shapes)) for model in (modes, others))
    products = [_product(motion, others.layout.mass @ other_motion)]  # phi^T M psi of the bodies, then of each cable
    models, meshes = others.models, modes.models.meshes
    for cable, (mesh, mass) in enumerate(zip(models.meshes, models.cables.mass.tolist(), strict=True)):
        if mesh is not None:
            interpolated = _interpolation(meshes[cable], mesh) @ modes.displacements[cable].swapaxes(0, 1)
            momentum = mass * _mass_shares(mesh)[:, None, None] * others.displacements[cable]
            products.append(_product(interpolated.swapaxes(0, 1), momentum))
    return assign_columns(sum(products) ** 2)[1]


def _product(first, second):
    """Matrix of the products of k and m fields of vectors at equal points, of shapes (..., k) and (..., m)."""
    return first.reshape(-1, first.shape[-1]).T @ second.reshape(-1, second.shape[-1])


@lru_cache(maxsize=128)
def _mass_shares(mesh):
    """Share of each node in the mass of a cable with all it carries, shape (nodes,). [-]"""
    return mesh.node_masses / mesh.node_masses.sum()


@lru_cache(maxsize=128)
def _interpolation(mesh, other):
    """Displacements at the nodes of another mesh from those at the nodes of a mesh, shape (other nodes, nodes). [-]"""
    element, local = mesh.located(other.node_positions)
    matrix = np.zeros((other.nodes, mesh.nodes))
    np.put_along_axis(matrix, mesh.element_nodes[element], lagrange(basis(mesh.order).nodes, local), axis=1)
    return matrix
