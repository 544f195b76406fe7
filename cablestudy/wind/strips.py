"""Cables in turbulent wind: the drag along each, and the coherence along one cable and between two.

The drag on a cable is linear in the turbulence and in the motion against it, see `drag`; integrals along the cable give
the forces on the coordinates of a suspension and the aerodynamic damping. The coherence exp(-kappa r) of two places of
one cable is Green's function of a rod, see `coherence.Rod`, and follows from the forces by a turbulence that has the
form of each shape function of the elements.

Two cables that meet at a body are coherent near their common end alone, over a small part of the distance of two nodes.
Their covariance is a sum over Gauss points that lie close together at the ends of each element: over t with the place
3 t^2 - 2 t^3.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from cablestudy.cable.element import Mesh, basis, lagrange, mesh_segments
from cablestudy.cable.plane_modes import nodal_tangent
from cablestudy.system.suspension import outward
from cablestudy.wind.coherence import at_points, galerkin, gauss, rod, tangents
from cablestudy.wind.drag import drag_matrices

MORE = 4  # points of an element than its order: an error of 1e-6 of the RMS on six cables that meet
STRAIGHT = mesh_segments(np.ones(1), 1, 2)  # of a cable without mass


@dataclass(frozen=True)
class Strip:
    """One cable, its p nodes and q points.

    Attributes
    ----------
    cable : int
    mesh : Mesh
    length : float
        Stretched. [m]
    places : ndarray, shape (p, 3)
        Of the nodes, global axes. [m]
    shapes : ndarray, shape (p, 3, m)
        Displacements per coordinate.
    pulled : ndarray, shape (p, 3, 2)
        Static displacements where either end is moved out of the cable along its tangent by one, and nothing else: the
        work of a load on them is what it takes off the tension there.
    drag : ndarray, shape (p, 3, 3)
        Force per length and speed at the nodes, symmetric, see `drag.drag_matrices`. [N s/m^2]
    inside : ndarray, shape (elements, points, 3, 3)
        The same at the points of the elements, see `coherence.gauss`.
    stretch : ndarray, shape (elements, order)
        As for `coherence.galerkin`. [-]
    """

    cable: int
    mesh: Mesh
    length: float
    places: np.ndarray
    shapes: np.ndarray
    pulled: np.ndarray
    drag: np.ndarray
    inside: np.ndarray
    stretch: np.ndarray

    @cached_property
    def _rod(self):
        return rod(self.mesh, self.stretch)

    @cached_property
    def forces(self):
        """Work on each of `shapes`, then of `pulled`, by a turbulence along x, y, z of the form of each shape function.

        Shape (3, p, m + 2); of a unit speed everywhere it is the sum over the nodes.
        """
        points, order = self._rod.points[0], self.mesh.order
        values, whole = lagrange(basis(order).nodes, points), at_points(self.mesh, self._whole, points)
        pushed = self.inside @ whole * (self.length * self._rod.shares[..., None, None])
        found = np.zeros((len(self.places), 3, pushed.shape[-1]))
        np.add.at(found, self.mesh.element_nodes, np.einsum("qi,eqam->eiam", values, pushed, optimize=True))
        return np.moveaxis(found, 1, 0)

    @property
    def _whole(self):
        return np.concatenate([self.shapes, self.pulled], axis=-1)

    @cached_property
    def points(self):
        """Places of the points, shape (q, 3), global axes. [m]"""
        return self._at_points(self.places)

    @cached_property
    def point_forces(self):
        """As `forces` at each point, shape (3, q, m + 2)."""
        mesh = self.mesh
        if mesh.order == 1:  # at the points of `inside`, where bars have a drag of their own
            drag, shares = self.inside.reshape(-1, 3, 3), self._rod.shares.ravel()
        else:
            drag, shares = self._at_points(self.drag), (mesh.sizes[:, None] * _points(mesh.order)[1]).ravel()
        lengths = self.length * shares
        forces = drag @ self._at_points(self._whole)
        return np.moveaxis(forces * lengths[:, None, None], 1, 0)

    def _at_points(self, values):
        """Values of the nodes, shape (p, ...), at the points, shape (q, ...)."""
        mesh = self.mesh
        between = lagrange(basis(mesh.order).nodes, _points(mesh.order)[0])
        found = np.tensordot(values[mesh.element_nodes], between, axes=(1, 1))
        return np.moveaxis(found, -1, 1).reshape(-1, *values.shape[1:])

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (m, m)."""
        count = self.shapes.shape[-1]
        return np.moveaxis(self.forces, 0, 1)[..., :count].reshape(-1, count).T @ self.shapes.reshape(-1, count)

    def coherent(self, forces, kappa):
        """Covariance of forces by c components of turbulence of unit variance with the coherence exp(-kappa r).

        Parameters
        ----------
        forces : ndarray, shape (p, c, m)
            By a turbulence of the form of each shape function.
        kappa : ndarray, shape (q,)
            Positive. [1/m]

        Returns
        -------
        ndarray, shape (q, m, m)
        """
        loads = np.einsum("pr,pcm->cmr", self._rod.shapes, forces, optimize=True)
        return self._rod.covariance(loads, kappa * self.length)


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
    ends = layout.ends(layout.bodies(shapes))
    pulled = np.zeros((len(ends), 2, 3, 2))
    for end in range(2):
        pulled[:, end, :, end] = outward(equilibrium)[0][:, end]
    ends = np.concatenate([ends, pulled.reshape(-1, 6, 2)], axis=-1)
    shapes = np.concatenate([shapes, np.zeros((len(shapes), 2))], axis=-1)
    nodes = solution.models.nodes(solution.coordinates.amplitudes(shapes), ends)
    return list(_strips(solution.models, equilibrium, nodes, drag))


def damping_of_cables(models, equilibrium, drag):
    """Aerodynamic damping of the modes and ends of each cable, see `Superelement.air`.

    Parameters
    ----------
    models : Models
    equilibrium : Equilibrium
    drag : Drag
        Of one case.

    Returns
    -------
    dict
        Number of each cable that the wind acts on -> ndarray, shape (n + 6, n + 6).
    """
    nodes = [(places, np.concatenate([moved, np.zeros((*moved.shape[:2], 2))], axis=-1))
             for places, moved in models.shapes_of_modes()]  # fmt: skip
    return {one.cable: one.damping for one in _strips(models, equilibrium, nodes, drag)}


def _strips(models, equilibrium, nodes, drag):
    """Yield the `Strip` of each cable that the wind acts on.

    Parameters
    ----------
    models : Models
    equilibrium : Equilibrium
    nodes : list of (ndarray, ndarray)
        Of each cable, as `Models.nodes`: the last two displacements are those of `Strip.pulled`.
    drag : Drag
    """
    speed = float(np.sqrt((drag.velocity**2).sum()))
    begin = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)[:, 0]
    states, meshes = _states(models), models.meshes
    for cable in np.flatnonzero(drag.cables > 0).tolist():
        mesh, (places, moved) = meshes[cable], nodes[cable]
        if mesh is None:
            mesh = STRAIGHT
            blend = mesh.node_positions[:, None]
            places = (1 - blend) * places[0] + blend * places[1]
            moved = (1 - blend[..., None]) * moved[0] + blend[..., None] * moved[1]
        mean = 1 + equilibrium.catenary.mean_tension[cable] / equilibrium.catenary.span.axial_stiffness[cable]
        *course, stretch = _course(mesh, states.get(cable), equilibrium.catenary.span.frame[cable], float(mean))
        size = float(drag.density) * drag.cables[cable] * speed
        matrices = (size * drag_matrices(tangent, drag.velocity / speed) for tangent in course)
        length = float(equilibrium.lengths[cable]) * galerkin(mesh, stretch, *gauss(mesh.order))[2]
        shapes = moved[..., :-2], moved[..., -2:]
        yield Strip(cable, mesh, length, begin[cable] + places, *shapes, *matrices, stretch)


def _course(mesh, state, frame, mean):
    """Unit tangents at the nodes, and at the points of the elements, global axes; and the stretch of the elements.

    Parameters
    ----------
    mesh : Mesh
    state : State or None
        None of a straight cable.
    frame : ndarray, shape (3, 3)
        Of the chord.
    mean : float
        Stretch of a straight cable.

    Returns
    -------
    ndarray, shapes (nodes, 3), (elements, points, 3) and (elements, order)
    """
    points = gauss(mesh.order)[0]
    if state is None:
        inside = np.broadcast_to(frame[0], (mesh.elements, len(points), 3))
        return np.broadcast_to(frame[0], (mesh.nodes, 3)), inside, np.full((mesh.elements, mesh.order), mean)
    return nodal_tangent(state) @ frame, tangents(mesh, state.direction, points) @ frame, state.stretch


@cache
def _points(order):
    """Points of an element on [0, 1] and their weights, shape (n,) both."""
    if order == 1:
        return gauss(order)
    roots, weights = np.polynomial.legendre.leggauss(order + MORE)
    t = (roots + 1) / 2
    return t**2 * (3 - 2 * t), weights * 3 * t * (1 - t)


def _states(models):
    """`State` of each cable with mass, by its number: dict."""
    return {
        cable: group.ends.state.take(place)
        for group in models.groups
        for place, cable in enumerate(group.places.tolist())
    }
