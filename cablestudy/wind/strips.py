"""Cables in turbulent wind: the drag along each, and the coherence along one cable and between two.

The drag on a cable is linear in the turbulence and in the motion against it, see `drag`; integrals along the cable give
the forces on the coordinates of a suspension and the aerodynamic damping. The coherence exp(-kappa r) of two places of
one cable is Green's function of a rod, see `coherence.Rod`, and follows from the forces by a turbulence that has the
form of each shape function of the elements.

Where a cable comes closest to the direction of the wind its drag, by |u_n|, has a kink, or nearly one: integrals over
an element are sums over both sides of that place.

Two cables that meet at a body are coherent near their common end alone, over a small part of the distance of two nodes.
Their covariance is a sum over Gauss points that lie close together at the ends of each element: over t with the place
3 t^2 - 2 t^3. Elements of high orders have fewer of them than their loads need: between these the coherence is a
polynomial in t, and the loads are taken to them by its Lagrange polynomials.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import ceil, sqrt

import numpy as np

from cablestudy.cable.element import Mesh, basis, lagrange, mesh_segments
from cablestudy.system.superelement import of_shapes, with_ends
from cablestudy.system.suspension import outward
from cablestudy.wind.coherence import gauss, rod
from cablestudy.wind.drag import drag_matrices
from cablestudy.wind.tolerances import WIND

STRAIGHT = mesh_segments(np.ones(1), 1, 2)  # of a cable without mass


@dataclass(frozen=True)
class Strip:
    """One cable, its p nodes and q points.

    Attributes
    ----------
    cable : int
    mesh : Mesh
    unstretched : float
        Length. [m]
    places : ndarray, shape (p, 3)
        Of the nodes, global axes. [m]
    shapes : ndarray, shape (p, 3, k)
        Displacements per coordinate of the cable: what is kept of its modes, then its six ends.
    offered : float
        Drag of a length across the wind over the mean speed, rho C_d d U. [N s/m^2]
    blowing : ndarray, shape (3,)
        Unit vector of the mean wind, global axes. [-]
    direction : ndarray, shape (elements, order, 3)
        Unit tangents at the points of the tensions, global axes. [-]
    stretch : ndarray, shape (elements, order)
        |r'| at these points. [-]
    kinks : ndarray, shape (elements,)
        Place in each element on [0, 1] where it comes closest to the direction of the wind, 1 where there is none. [-]
    """

    cable: int
    mesh: Mesh
    unstretched: float
    places: np.ndarray
    shapes: np.ndarray
    offered: float
    blowing: np.ndarray
    direction: np.ndarray
    stretch: np.ndarray
    kinks: np.ndarray

    @cached_property
    def _fine(self):
        """The mesh of the rod, with more nodes near the ends of elements than the cable needs."""
        order, elements = self.mesh.order, self.mesh.elements
        return self.mesh if order == 1 else replace(self.mesh, order=max(order, ceil(WIND.rod_orders / sqrt(elements))))

    @cached_property
    def _rod(self):
        points, fine = basis(self.mesh.order).points, basis(self._fine.order).points
        return rod(self._fine, self.stretch @ lagrange(points, fine).T)

    @property
    def length(self):
        """Stretched. [m]"""
        return self.unstretched * self._rod.length

    @cached_property
    def _quadrature(self):
        """Places on [0, 1] and weights in each element of the rod's mesh, shape (e, q) both."""
        return _both_sides(*gauss(self._fine.order), self.kinks)

    @cached_property
    def forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z of the form of each of the rod's P shape functions.

        Of shape (3, P, k). Of a unit speed everywhere it is the sum over the P nodes.
        """
        values = _between(basis(self._fine.order).nodes, self._quadrature[0])
        found = np.zeros((3, self._fine.nodes, self.shapes.shape[-1]))
        np.add.at(found, (slice(None), self._fine.element_nodes), _taken(values, self._pushed(*self._quadrature)))
        return found

    @property
    def most(self):
        """Bound of the force by a unit speed. [N s/m]"""
        matrices = drag_matrices(self.direction, self.blowing)
        return self.length * self.offered * float(np.abs(matrices).sum(axis=-1).max())

    @cached_property
    def points(self):
        """Places of the points, shape (q, 3), global axes. [m]"""
        nodes = basis(self.mesh.order).nodes
        return (lagrange(nodes, self._points[1]) @ self.places[self.mesh.element_nodes]).reshape(-1, 3)

    @cached_property
    def point_forces(self):
        """Forces at each point, as `forces` of strips, shape (3, q, k)."""
        order, points = self.mesh.order, self._points[0]
        if order == 1:
            t, weights = _both_sides(*gauss(1), self.kinks)
            pushed = self._pushed(t, weights)
        else:
            t, weights = _both_sides(*_gauss(order + WIND.strip_points), _graded_inverse(self.kinks))
            pushed = self._pushed(_graded(t), weights * 6 * t * (1 - t))
        return _taken(_between(points, t), pushed).reshape(3, -1, self.shapes.shape[-1])

    @property
    def _points(self):
        """Of an element: t and places of `points`, on [0, 1]; of bars those at which they have a drag of their own."""
        order = self.mesh.order
        t = _gauss(min(order + WIND.strip_points, WIND.interpolated_points))[0]
        return (t, _graded(t)) if order > 1 else (gauss(1)[0],) * 2

    def _pushed(self, places, weights):
        """Work on each of `shapes` by a unit speed along x, y, z at places of each element, shape (e, q, 3, k).

        Places on [0, 1] and their weights have the shape (e, q).
        """
        mesh, between = self.mesh, _between(basis(self.mesh.order).points, places)
        tangent = between @ self.direction
        tangent = tangent / np.sqrt((tangent**2).sum(axis=-1, keepdims=True))
        lengths = self.unstretched * mesh.sizes[:, None] * weights * (between @ self.stretch[..., None])[..., 0]
        forces = self.offered * drag_matrices(tangent, self.blowing) * lengths[..., None, None]
        return forces @ self._displaced(places)

    def _displaced(self, places):
        """`shapes` at places of each element, shape (e, q, 3, k)."""
        moved = self.shapes[self.mesh.element_nodes]
        found = _between(basis(self.mesh.order).nodes, places) @ moved.reshape(*moved.shape[:2], -1)
        return found.reshape(*places.shape, *self.shapes.shape[1:])

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (k, k)."""
        parts = self._pushed(*self._quadrature), self._displaced(self._quadrature[0])
        pushed, moved = (part.reshape(-1, part.shape[-1]) for part in parts)
        return pushed.T @ moved

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
    if not (drag.cables > 0).any():
        return []
    speed = float(np.sqrt((drag.velocity**2).sum()))
    begin = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)[:, 0]
    states, blowing, found = _states(models), drag.velocity / speed, []
    for cable, mesh, places, shapes in nodal_shapes(models, kept, np.flatnonzero(drag.cables > 0)):
        mean = 1 + equilibrium.catenary.mean_tension[cable] / equilibrium.catenary.span.axial_stiffness[cable]
        course = _course(mesh, states.get(cable), equilibrium.catenary.span.frame[cable], float(mean), blowing)
        offered = float(drag.density) * drag.cables[cable] * speed
        length = float(equilibrium.lengths[cable])
        found.append(Strip(cable, mesh, length, begin[cable] + places, shapes, offered, blowing, *course))
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
        shapes = of_shapes(moved.reshape(-1, moved.shape[-1]), with_ends(kept[cable].shapes))
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
        (element,), local = mesh.located(catenary.middle[cable : cable + 1])
        weights = lagrange(basis(mesh.order).nodes, local)[0]
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
    if not cables:
        return []
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


def _course(mesh, state, frame, mean, blowing):
    """`direction`, `stretch` and `kinks` of a `Strip`.

    Parameters
    ----------
    mesh : Mesh
    state : State or None
        None of a straight cable.
    frame : ndarray, shape (3, 3)
        Of the chord.
    mean : float
        Stretch of a straight cable.
    blowing : ndarray, shape (3,)
        Unit vector of the mean wind, global axes.
    """
    none = np.ones(mesh.elements)
    if state is None:
        straight = np.broadcast_to(frame[0], (mesh.elements, mesh.order, 3))
        return straight, np.full((mesh.elements, mesh.order), mean), none
    bars = mesh.order == 1  # each has one direction
    kinks = none if bars else _closest(state.mid_forces @ frame, state.half_changes @ frame, blowing)
    return state.direction @ frame, state.stretch, kinks


def _closest(middle, half, blowing):
    """Place in each element on [0, 1] where its tangent comes closest to the direction of the wind, 1 where outside.

    The tension vector is middle + x half, from x = -1 to 1: |T . blowing|/|T| is largest where its derivative vanishes.
    """
    along, rise = middle @ blowing, half @ blowing
    squared, mixed, risen = ((one * other).sum(axis=-1) for one, other in ((middle,) * 2, (middle, half), (half,) * 2))
    below = rise * mixed - along * risen
    x = (along * mixed - rise * squared) / np.where(below != 0, below, 1.0)
    return np.where((below != 0) & (np.abs(x) < 1), (1 + x) / 2, 1.0)


def _both_sides(points, weights, kinks):
    """Points and weights on [0, 1] of the two sides of a place in each element, shape (e, 2 q) both."""
    if (kinks == 1).all():
        return np.tile(points, (len(kinks), 1)), np.tile(weights, (len(kinks), 1))
    kinks = kinks[:, None]
    points = np.concatenate([kinks * points, kinks + (1 - kinks) * points], axis=1)
    return points, np.concatenate([kinks * weights, (1 - kinks) * weights], axis=1)


def _between(nodes, places):
    """`lagrange` of nodes, shape (k,), at places of each element, shape (e, q): shape (e, q, k)."""
    return lagrange(nodes, places.ravel()).reshape(*places.shape, -1)


def _taken(values, pushed):
    """Works at places, shape (e, q, 3, k), on functions of some values there, (e, q, i): shape (3, e, i, k)."""
    found = np.swapaxes(values, 1, 2) @ pushed.reshape(*pushed.shape[:2], -1)
    return np.moveaxis(found.reshape(*found.shape[:2], *pushed.shape[2:]), 2, 0)


@cache
def _gauss(count):
    """Gauss points and weights on [0, 1], shape (count,) both."""
    roots, weights = np.polynomial.legendre.leggauss(count)
    return (roots + 1) / 2, weights / 2


def _graded(t):
    """Place in an element that belongs to t."""
    return t**2 * (3 - 2 * t)


def _graded_inverse(places):
    """t that belongs to a place in an element."""
    return 0.5 - np.sin(np.arcsin(1 - 2 * places) / 3)


def _states(models):
    """`State` of each cable with mass, by its number: dict."""
    return {
        cable: group.ends.state.take(place)
        for group in models.groups
        for place, cable in enumerate(group.cable_indices.tolist())
    }
