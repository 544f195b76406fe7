"""Cables in turbulent wind: the nodes of each with its share of the drag, and the coherence along one cable.

The drag on a node is linear in the turbulence and in the motion against it, see `drag`; as sums over the nodes it gives
the forces on the coordinates of a suspension and the aerodynamic damping. The coherence exp(-kappa r) of two places of
one cable is Green's function of a rod, see `coherence`; so with g the forces at the nodes by a turbulence that is the
same at all of them, their covariance is

    2 g^T (S/kappa + kappa diag(w) + E)^-1 g,

S being the stiffness of the rod, w the length that belongs to each node, E one at both ends.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.assembly import add_elements
from cablestudy.cable.element import basis, mesh_segments
from cablestudy.cable.plane_modes import nodal_tangent
from cablestudy.wind.drag import drag_matrices

STRAIGHT = mesh_segments(np.ones(1), 1, 2)  # of a cable without mass


@dataclass(frozen=True)
class Strip:
    """The nodes of one cable.

    Attributes
    ----------
    places : ndarray, shape (p, 3)
        Global axes. [m]
    lengths : ndarray, shape (p,)
        Stretched length that belongs to each node. [m]
    shapes : ndarray, shape (p, 3, m)
        Displacements per coordinate.
    drag : ndarray, shape (p, 3, 3)
        Force per length and speed, see `drag.drag_matrices`. [N s/m^2]
    rod : ndarray, shape (p, p)
        S. [1/m]
    """

    places: np.ndarray
    lengths: np.ndarray
    shapes: np.ndarray
    drag: np.ndarray
    rod: np.ndarray

    @property
    def forces(self):
        """Force on each coordinate by a unit speed of the turbulence along x, y, z at each node, shape (3, p, m)."""
        pushed = np.swapaxes(self.drag, -1, -2) @ self.shapes  # the matrices are symmetric
        return np.moveaxis(pushed * self.lengths[:, None, None], 1, 0)

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (m, m)."""
        count = self.shapes.shape[-1]
        return self.shapes.reshape(-1, count).T @ np.moveaxis(self.forces, 0, 1).reshape(-1, count)

    def coherent(self, forces, kappa):
        """Covariance of forces by c components of turbulence of unit variance with the coherence exp(-kappa r).

        Parameters
        ----------
        forces : ndarray, shape (p, c, m)
            By a unit speed at each node.
        kappa : ndarray, shape (q,)
            Positive. [1/m]

        Returns
        -------
        ndarray, shape (q, m, m)
        """
        (nodes, _, count), ends = forces.shape, np.zeros_like(self.rod)
        ends[[0, -1], [0, -1]] = 1.0
        kappa = kappa[:, None, None]
        matrix = self.rod / kappa + kappa * np.diag(self.lengths) + ends
        moved = np.linalg.inv(matrix) @ forces.reshape(nodes, -1)
        return 2 * forces.reshape(-1, count).T @ moved.reshape(len(kappa), -1, count)


def strips(solution, layout, shapes, drag):
    """The `Strip` of each cable that the wind acts on.

    Parameters
    ----------
    solution : Solution
        Models and coordinates of the cables.
    layout : Layout
    shapes : ndarray, shape (n, m)
        Combinations of the coordinates.
    drag : Drag
        Of one case.

    Returns
    -------
    list of Strip
    """
    equilibrium = layout.equilibrium
    speed = float(np.sqrt((drag.velocity**2).sum()))
    begin = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)[:, 0]
    ends = layout.ends(layout.bodies(shapes))
    nodes = solution.models.nodes(solution.coordinates.amplitudes(shapes), ends)
    tangents, meshes = _tangents(solution.models), solution.models.meshes
    stretch = 1 + equilibrium.catenary.mean_tension / equilibrium.catenary.span.axial_stiffness
    found = []
    for cable in np.flatnonzero(drag.cables > 0).tolist():
        mesh, (places, moved) = meshes[cable], nodes[cable]
        if mesh is None:
            mesh = STRAIGHT
            blend = mesh.node_positions[:, None]
            places = (1 - blend) * places[0] + blend * places[1]
            moved = (1 - blend[..., None]) * moved[0] + blend[..., None] * moved[1]
        tangent = tangents.get(cable, equilibrium.catenary.span.frame[cable, 0])
        length = float(equilibrium.lengths[cable] * stretch[cable])
        matrices = drag_matrices(np.broadcast_to(tangent, places.shape), drag.velocity / speed)
        found.append(
            Strip(
                begin[cable] + places,
                length * mesh.node_weights,
                moved,
                float(drag.density) * drag.cables[cable] * speed * matrices,
                _rod(mesh) / length,
            )
        )
    return found


def _tangents(models):
    """Unit tangents at the nodes of the cables with mass, global axes: cable -> shape (p, 3)."""
    found = {}
    for group in models.groups:
        turned = nodal_tangent(group.ends.state) @ group.ends.state.span.frame
        found.update(zip(group.places.tolist(), turned, strict=True))
    return found


def _rod(mesh):
    """Stiffness of a rod of unit length on the nodes of a mesh, shape (p, p)."""
    element = basis(mesh.order)
    weights = element.weights / mesh.sizes[:, None]
    slopes = element.derivative
    return add_elements(mesh, 1, slopes.T @ (weights[..., None] * slopes)).toarray()
