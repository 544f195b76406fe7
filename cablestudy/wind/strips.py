"""Cables in turbulent wind: the drag along each, and the coherence along one cable and between two.

The drag on a cable is linear in the turbulence and in the motion against it, see `drag`; integrals along the cable give
the forces on the coordinates of a suspension and the aerodynamic damping. The coherence exp(-kappa r) of two places of
one cable is Green's function of a rod, see `coherence.Rod`, and follows from the forces by a turbulence that has the
form of each shape function of the elements.

Two cables that meet at a body are coherent near their common end alone, over a small part of the distance of two nodes.
Their covariance is a sum over Gauss points that lie close together at the ends of each element: over t with the place
3 t^2 - 2 t^3. Elements of high orders have fewer of them than their loads need: between these the coherence is a
polynomial in t, and the loads are taken to them by its Lagrange polynomials.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from cablestudy.cable.element import Mesh, basis, lagrange, mesh_segments
from cablestudy.cable.plane_modes import nodal_tangent
from cablestudy.system.superelement import with_ends
from cablestudy.system.suspension import outward
from cablestudy.wind.coherence import at_points, galerkin, gauss, rod, tangents
from cablestudy.wind.drag import drag_matrices

# points of an element more than its order: an error of 1e-6 of the RMS on six cables that meet; and most of those that
# the coherence with other cables is interpolated between: one of 2e-8 of the RMS, of elements of order 44
MORE, MOST = 4, 30
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
    shapes : ndarray, shape (p, 3, k)
        Displacements per coordinate of the cable: what is kept of its modes, then its six ends.
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
    drag: np.ndarray
    inside: np.ndarray
    stretch: np.ndarray

    @cached_property
    def _rod(self):
        return rod(self.mesh, self.stretch)

    @cached_property
    def forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z of the form of each shape function, shape (3, p, k).

        Of a unit speed everywhere it is the sum over the nodes.
        """
        points, order = self._rod.points[0], self.mesh.order
        values, moved = lagrange(basis(order).nodes, points), at_points(self.mesh, self.shapes, points)
        pushed = self.inside @ moved * (self.length * self._rod.shares[..., None, None])
        found = np.zeros((len(self.places), 3, pushed.shape[-1]))
        np.add.at(found, self.mesh.element_nodes, np.einsum("qi,eqam->eiam", values, pushed, optimize=True))
        return np.moveaxis(found, 1, 0)

    @cached_property
    def points(self):
        """Places of the points, shape (q, 3), global axes. [m]"""
        order = self.mesh.order
        return self._at(gauss(1)[0] if order == 1 else _graded(min(order + MORE, MOST))[1], self.places)

    @cached_property
    def point_forces(self):
        """As `forces` at each point, shape (3, q, k)."""
        mesh, order = self.mesh, self.mesh.order
        if order == 1:  # at the points of `inside`, where bars have a drag of their own
            lengths = self.length * self._rod.shares.ravel()
            forces = self.inside.reshape(-1, 3, 3) @ self._at(gauss(1)[0], self.shapes)
            return np.moveaxis(forces * lengths[:, None, None], 1, 0)
        fine, places, weights = _graded(order + MORE)
        lengths = self.length * (mesh.sizes[:, None] * weights).ravel()
        forces = self._at(places, self.drag) @ self._at(places, self.shapes) * lengths[:, None, None]
        forces = lagrange(_graded(min(order + MORE, MOST))[0], fine).T @ forces.reshape(mesh.elements, len(places), -1)
        return np.moveaxis(forces.reshape(-1, *self.shapes.shape[1:]), 1, 0)

    def _at(self, places, values):
        """Values of the nodes, shape (p, ...), at places of each element on [0, 1], one element after the other."""
        mesh = self.mesh
        found = np.tensordot(values[mesh.element_nodes], lagrange(basis(mesh.order).nodes, places), axes=(1, 1))
        return np.moveaxis(found, -1, 1).reshape(-1, *values.shape[1:])

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (k, k)."""
        count = self.shapes.shape[-1]
        return np.moveaxis(self.forces, 0, 1).reshape(-1, count).T @ self.shapes.reshape(-1, count)

    def coherent(self, components, kappa):
        """Covariance of the works on `shapes` by components of turbulence with the coherence exp(-kappa r).

        Parameters
        ----------
        components : ndarray, shape (c, 3)
            Their directions times their RMS. [m/s]
        kappa : ndarray, shape (f,)
            Positive. [1/m]

        Returns
        -------
        ndarray, shape (f, k, k)
        """
        loads = np.einsum("pr,ca,apk->ckr", self._rod.shapes, components, self.forces, optimize=True)
        return self._rod.covariance(loads, kappa * self.length)


def strips(models, kept, equilibrium, drag):
    """The `Strip` of each cable that the wind acts on: list.

    Parameters
    ----------
    models : Models
    kept : list of Kept
        Coordinates of each cable.
    equilibrium : Equilibrium
    drag : Drag
        Of one case.
    """
    speed = float(np.sqrt((drag.velocity**2).sum()))
    begin = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)[:, 0]
    states, found = _states(models), []
    for cable, mesh, places, shapes in nodal_shapes(models, kept, np.flatnonzero(drag.cables > 0)):
        mean = 1 + equilibrium.catenary.mean_tension[cable] / equilibrium.catenary.span.axial_stiffness[cable]
        *course, stretch = _course(mesh, states.get(cable), equilibrium.catenary.span.frame[cable], float(mean))
        size = float(drag.density) * drag.cables[cable] * speed
        matrices = (size * drag_matrices(tangent, drag.velocity / speed) for tangent in course)
        length = float(equilibrium.lengths[cable]) * galerkin(mesh, stretch, *gauss(mesh.order))[1]
        found.append(Strip(cable, mesh, length, begin[cable] + places, shapes, *matrices, stretch))
    return found


def nodal_shapes(models, kept, cables):
    """Yield number, `Mesh`, places of the nodes and their displacements per coordinate, of some cables.

    Parameters
    ----------
    models : Models
    kept : list of Kept
        Coordinates of each cable.
    cables : ndarray of int

    Yields
    ------
    int, Mesh, ndarray, ndarray
        Places from end 1 on, shape (p, 3) [m]; displacements as `Strip.shapes`, shape (p, 3, k).
    """
    meshes, nodes = models.meshes, models.shapes_of_modes()
    for cable in cables.tolist():
        mesh, (places, moved) = meshes[cable], nodes[cable]
        if mesh is None:
            mesh = STRAIGHT
            blend = mesh.node_positions[:, None]
            places = (1 - blend) * places[0] + blend * places[1]
            moved = (1 - blend[..., None]) * moved[0] + blend[..., None] * moved[1]
        shapes = moved.reshape(-1, moved.shape[-1]) @ with_ends(kept[cable].shapes)
        yield cable, mesh, places, shapes.reshape(*moved.shape[:2], -1)


def midspan_shapes(models, kept, catenary):
    """Displacements at mid-span of each cable along the axes of its chord frame, per coordinate: list of ndarray.

    Parameters
    ----------
    models, kept
        As for `nodal_shapes`.
    catenary : Catenary
        Of the c cables.

    Returns
    -------
    list of ndarray, shape (3, k)
    """
    found = []
    for cable, mesh, _, shapes in nodal_shapes(models, kept, np.arange(len(kept))):
        place = catenary.middle[cable]
        element = int(np.clip(np.searchsorted(mesh.edges, place) - 1, 0, mesh.elements - 1))
        local = (place - mesh.edges[element]) / mesh.sizes[element]
        weights = lagrange(basis(mesh.order).nodes, np.array([local]))[0]
        found.append(catenary.span.frame[cable] @ np.tensordot(weights, shapes[mesh.element_nodes[element]], axes=1))
    return found


def on_cables(solution, layout, shapes, drag):
    """`strips` with the coordinates of a `Solution`, and their `amplitudes` in shapes of the suspension."""
    found = strips(solution.models, solution.kept, layout.equilibrium, drag)
    return found, amplitudes(solution, layout, shapes, [strip.cable for strip in found])


def amplitudes(solution, layout, shapes, cables):
    """Of the coordinates of cables in combinations of those of the suspension, and in two movements of their own ends.

    In these two either end is moved out of the cable along its tangent by one, and nothing else: the work of a load on
    them is what it takes off the tension there.

    Parameters
    ----------
    solution : Solution
        Models and coordinates of the cables.
    layout : Layout
    shapes : ndarray, shape (n, m)
        Combinations.
    cables : list of int

    Returns
    -------
    list of ndarray, shape (k, m + 2 c)
        Of each of the c cables.
    """
    ends, outwards = layout.ends(layout.bodies(shapes)), outward(layout.equilibrium)[0]
    owner, count, found = solution.coordinates.cable, shapes.shape[1], []
    for place, cable in enumerate(cables):
        own = shapes[np.flatnonzero(owner == cable)]
        moved = np.zeros((len(own) + 6, count + 2 * len(cables)))
        moved[:, :count] = np.concatenate([own, ends[cable]])
        for end in range(2):
            moved[len(own) + 3 * end : len(own) + 3 * end + 3, count + 2 * place + end] = outwards[cable, end]
        found.append(moved)
    return found


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
def _graded(count):
    """Points of an element: t, places 3 t^2 - 2 t^3 on [0, 1], and weights, shape (count,) all."""
    roots, weights = np.polynomial.legendre.leggauss(count)
    t = (roots + 1) / 2
    return t, t**2 * (3 - 2 * t), weights * 3 * t * (1 - t)


def _states(models):
    """`State` of each cable with mass, by its number: dict."""
    return {
        cable: group.ends.state.take(place)
        for group in models.groups
        for place, cable in enumerate(group.places.tolist())
    }
