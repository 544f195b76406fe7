"""Cables in turbulent wind: the drag along each, and the covariance of its work along one cable and between two.

The drag on a cable is linear in the turbulence and in the motion against it, see `drag`; integrals along the cable give
the forces on the coordinates of a suspension and the aerodynamic damping. The coherence exp(-kappa r) of two places of
one cable is Green's function of a rod, see `coherence.Rod`: the covariance follows from the forces by a turbulence that
has the form of each shape function of the rod's elements.

Where a cable comes closest to the direction of the wind its drag, by |u_n|, has a kink, or nearly one: integrals over
an element are sums over both sides of that point.

Two cables that meet at a body are coherent near their common end alone, over a small part of the distance of two nodes.
Their covariance is a sum over Gauss points that lie close together at the ends of each element: points of a parameter t
with the position 3 t^2 - 2 t^3. Elements of high orders have fewer of them than their loads need: between these the
coherence is a polynomial in t, and the loads are distributed to them by its Lagrange polynomials.
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
    """Wind forces along one cable of k coordinates, with p nodes and q points of quadrature.

    Attributes
    ----------
    cable : int
        Index of the cable.
    mesh : Mesh
    unstretched : float
        Length. [m]
    places : ndarray, shape (p, 3)
        Positions of the nodes, global axes. [m]
    shapes : ndarray, shape (p, 3, k)
        Displacements of the nodes per coordinate: the kept modes, then six displacements of the ends.
    drag_factor : float
        Linear drag per length across the wind, rho C_d d U at the mean speed U. [N s/m^2]
    wind_direction : ndarray, shape (3,)
        Unit vector of the mean wind, global axes. [-]
    direction : ndarray, shape (elements, order, 3)
        Unit tangents at the points of the tensions, global axes. [-]
    stretch : ndarray, shape (elements, order)
        |r'| at these points. [-]
    kinks : ndarray, shape (elements,)
        Position in each element, on [0, 1], that is closest to the direction of the wind; 1 where that is an end. [-]
    """

    cable: int
    mesh: Mesh
    unstretched: float
    places: np.ndarray
    shapes: np.ndarray
    drag_factor: float
    wind_direction: np.ndarray
    direction: np.ndarray
    stretch: np.ndarray
    kinks: np.ndarray

    @cached_property
    def _rod_mesh(self):
        """`Mesh` of the rod, with more nodes near the ends of elements than the cable needs."""
        order, elements = self.mesh.order, self.mesh.elements
        return self.mesh if order == 1 else replace(self.mesh, order=max(order, ceil(WIND.rod_orders / sqrt(elements))))

    @cached_property
    def _rod(self):
        """`Rod` of the cable."""
        points, rod_points = basis(self.mesh.order).points, basis(self._rod_mesh.order).points
        return rod(self._rod_mesh, self.stretch @ lagrange(points, rod_points).T)

    @property
    def length(self):
        """Stretched length. [m]"""
        return self.unstretched * self._rod.length

    @cached_property
    def _quadrature(self):
        """Positions on [0, 1] and weights in each of e elements for the rod's functions, shape (e, q) each."""
        return _split_at_kinks(*gauss(self._rod_mesh.order), self.kinks)

    @cached_property
    def forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z with the form of each of the rod's P shape functions.

        Shape (3, P, k). The sum over the P functions is the work by a unit speed everywhere.
        """
        mesh, (positions, weights) = self._rod_mesh, self._quadrature
        values = _lagrange_by_element(basis(mesh.order).nodes, positions)
        work = np.zeros((3, mesh.nodes, self.shapes.shape[-1]))
        by_element = _work_on_functions(values, self._point_work(positions, weights))
        np.add.at(work, (slice(None), mesh.element_nodes), by_element)
        return work

    @property
    def largest_force(self):
        """Upper bound of the force by a unit speed. [N s/m]"""
        matrices = drag_matrices(self.direction, self.wind_direction)
        return self.length * self.drag_factor * float(np.abs(matrices).sum(axis=-1).max())

    @cached_property
    def points(self):
        """Positions of the points for covariances with other cables, shape (q, 3), global axes. [m]"""
        nodes = basis(self.mesh.order).nodes
        return (lagrange(nodes, self._point_parameters[1]) @ self.places[self.mesh.element_nodes]).reshape(-1, 3)

    @cached_property
    def point_forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z at each of `points` alone, shape (3, q, k)."""
        order, parameters = self.mesh.order, self._point_parameters[0]
        if order == 1:
            t, weights = _split_at_kinks(*gauss(1), self.kinks)
            work = self._point_work(t, weights)
        else:
            t, weights = _split_at_kinks(*_gauss(order + WIND.strip_points), _graded_inverse(self.kinks))
            work = self._point_work(_graded(t), weights * 6 * t * (1 - t))
        return _work_on_functions(_lagrange_by_element(parameters, t), work).reshape(3, -1, self.shapes.shape[-1])

    @property
    def _point_parameters(self):
        """Parameters t and positions of `points` in an element, on [0, 1]; in a bar those of its two Gauss points."""
        order = self.mesh.order
        t = _gauss(min(order + WIND.strip_points, WIND.interpolated_points))[0]
        return (t, _graded(t)) if order > 1 else (gauss(1)[0],) * 2

    def _point_work(self, positions, weights):
        """Work on each of `shapes` by a unit speed along x, y, z at positions in each element, shape (e, q, 3, k).

        Positions on [0, 1] and their weights have the shape (e, q).
        """
        mesh, interpolation = self.mesh, _lagrange_by_element(basis(self.mesh.order).points, positions)
        tangent = interpolation @ self.direction
        tangent = tangent / np.sqrt((tangent**2).sum(axis=-1, keepdims=True))
        stretch = (interpolation @ self.stretch[..., None])[..., 0]
        lengths = self.unstretched * mesh.sizes[:, None] * weights * stretch
        forces = self.drag_factor * drag_matrices(tangent, self.wind_direction) * lengths[..., None, None]
        return forces @ self._displacements(positions)

    def _displacements(self, positions):
        """Displacements per coordinate at positions in each element, shape (e, q, 3, k)."""
        nodal = self.shapes[self.mesh.element_nodes]
        interpolation = _lagrange_by_element(basis(self.mesh.order).nodes, positions)
        displacements = interpolation @ nodal.reshape(*nodal.shape[:2], -1)
        return displacements.reshape(*positions.shape, *self.shapes.shape[1:])

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (k, k)."""
        work, displacements = self._point_work(*self._quadrature), self._displacements(self._quadrature[0])
        return work.reshape(-1, work.shape[-1]).T @ displacements.reshape(-1, displacements.shape[-1])

    def coherent(self, components, kappa):
        """Covariance of the work on each of `shapes` by components of turbulence with the coherence exp(-kappa r).

        Parameters
        ----------
        components : ndarray, shape (c, 3)
            Directions of the components times their RMS. [m/s]
        kappa : ndarray, shape (f,)
            Positive. [1/m]

        Returns
        -------
        ndarray, shape (f, k, k)
        """
        loads = np.einsum("pr,ca,apk->ckr", self._rod.shapes, components, self.forces, optimize=True)
        return self._rod.covariance(loads, kappa * self.length)


def strips(models, kept, equilibrium, drag):
    """`Strip` of each cable that the wind acts on, for gust forces and aerodynamic damping: list.

    Parameters
    ----------
    models : Models
    kept : list of Kept
        Coordinates of each cable.
    equilibrium : Equilibrium
        Of one case.
    drag : Drag
        Of this case.
    """
    if not (drag.cables > 0).any():
        return []
    speed = float(np.sqrt((drag.velocity**2).sum()))
    end_1 = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)[:, 0]
    span, tension = equilibrium.catenary.span, equilibrium.catenary.mean_tension
    states, wind_direction, on_cables = _states_by_cable(models), drag.velocity / speed, []
    for cable, mesh, places, shapes in nodal_shapes(models, kept, np.flatnonzero(drag.cables > 0)):
        mean_stretch = float(1 + tension[cable] / span.axial_stiffness[cable])
        course = _direction_and_stretch(mesh, states.get(cable), span.frame[cable], mean_stretch, wind_direction)
        drag_factor = float(drag.density) * drag.cables[cable] * speed
        length = float(equilibrium.lengths[cable])
        places = end_1[cable] + places
        on_cables.append(Strip(cable, mesh, length, places, shapes, drag_factor, wind_direction, *course))
    return on_cables


def nodal_shapes(models, kept, cables):
    """Yield index, `Mesh`, positions of the nodes and their displacements per coordinate, for each of some cables.

    Parameters
    ----------
    models : Models
    kept : list of Kept
        Coordinates of each cable.
    cables : ndarray of int
        Indices of the cables.

    Yields
    ------
    int, Mesh, ndarray, ndarray
        Positions from end 1, shape (p, 3) [m]; displacements as `Strip.shapes`, shape (p, 3, k).
    """
    meshes, nodes = models.meshes, models.shapes_of_modes()
    for cable in cables.tolist():
        mesh, (positions, displacements) = meshes[cable], nodes[cable]
        if mesh is None:  # a cable without mass has the values of its two ends
            mesh = STRAIGHT
            x = mesh.node_positions[:, None]
            positions = (1 - x) * positions[0] + x * positions[1]
            displacements = (1 - x[..., None]) * displacements[0] + x[..., None] * displacements[1]
        flat = displacements.reshape(-1, displacements.shape[-1])
        shapes = of_shapes(flat, with_ends(kept[cable].shapes))
        yield cable, mesh, positions, shapes.reshape(*displacements.shape[:2], -1)


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
    at_midspan = []
    for cable, mesh, _, shapes in nodal_shapes(models, kept, np.arange(len(kept))):
        (element,), local = mesh.located(catenary.middle[cable : cable + 1])
        weights = lagrange(basis(mesh.order).nodes, local)[0]
        displacements = np.tensordot(weights, shapes[mesh.element_nodes[element]], axes=1)
        at_midspan.append(catenary.span.frame[cable] @ displacements)
    return at_midspan


def on_cables(solution, layout, shapes, drag):
    """`strips` with the coordinates of a `Solution`, and their `amplitudes` in shapes of the suspension."""
    on_each = strips(solution.models, solution.kept, layout.equilibrium, drag)
    return on_each, amplitudes(solution, layout, shapes, [strip.cable for strip in on_each])


def amplitudes(solution, layout, shapes, cables):
    """Amplitudes of the coordinates of cables in shapes of the suspension, and in two end movements of each cable.

    They turn the wind forces of a `Strip` into those on the shapes, and into tensions. In an end movement one end is
    moved out of its cable along the tangent by one, and nothing else: the work of a load on this movement is the
    decrease of the tension at that end by the load.

    Parameters
    ----------
    solution : Solution
        Models and coordinates of the cables.
    layout : Layout
    shapes : ndarray, shape (n, m)
        Combinations of the n coordinates of the suspension.
    cables : list of int

    Returns
    -------
    list of ndarray, shape (k, m + 2 c)
        Amplitudes for each of the c cables: rows are its coordinates, modes first and then its ends.
    """
    if not cables:
        return []
    ends, outwards = layout.ends(layout.bodies(shapes)), outward(layout.equilibrium)[0]
    owner, count, by_cable = solution.coordinates.cable, shapes.shape[1], []
    for index, cable in enumerate(cables):
        modes = shapes[np.flatnonzero(owner == cable)]
        columns = np.zeros((len(modes) + 6, count + 2 * len(cables)))
        columns[:, :count] = np.concatenate([modes, ends[cable]])
        for end in range(2):
            row = len(modes) + 3 * end
            columns[row : row + 3, count + 2 * index + end] = outwards[cable, end]
        by_cable.append(columns)
    return by_cable


def _direction_and_stretch(mesh, state, frame, mean_stretch, wind_direction):
    """`direction`, `stretch` and `kinks` of a `Strip`.

    Parameters
    ----------
    mesh : Mesh
    state : State or None
        Static state of the cable; None without mass: the cable then counts as straight.
    frame : ndarray, shape (3, 3)
        Chord frame of the cable.
    mean_stretch : float
        Stretch of a straight cable. [-]
    wind_direction : ndarray, shape (3,)
        Unit vector of the mean wind, global axes.
    """
    no_kinks = np.ones(mesh.elements)
    if state is None:
        chord = np.broadcast_to(frame[0], (mesh.elements, mesh.order, 3))
        return chord, np.full((mesh.elements, mesh.order), mean_stretch), no_kinks
    kinks = no_kinks
    if mesh.order > 1:  # a bar has one direction
        kinks = _closest_to_wind(state.mid_forces @ frame, state.half_changes @ frame, wind_direction)
    return state.direction @ frame, state.stretch, kinks


def _closest_to_wind(middle, half, wind_direction):
    """Position in each element, on [0, 1], where its tangent is closest to the direction u of the wind; 1 at an end.

    The tension vector is T = M + x H, from x = -1 to 1, with M in `middle` and the change H in `half`, shape (e, 3):
    |T . u|/|T| is largest where its derivative vanishes, (H . u) (M . M + x M . H) = (M . u) (M . H + x H . H).
    """
    mu, hu = middle @ wind_direction, half @ wind_direction
    mm, mh, hh = (middle * middle).sum(axis=-1), (middle * half).sum(axis=-1), (half * half).sum(axis=-1)
    divisor = hu * mh - mu * hh
    x = (mu * mh - hu * mm) / np.where(divisor != 0, divisor, 1.0)
    return np.where((divisor != 0) & (np.abs(x) < 1), (1 + x) / 2, 1.0)


def _split_at_kinks(points, weights, kinks):
    """Points and weights of a rule on both sides of the kink in each element, (e, 2 q), without kinks (e, q)."""
    if (kinks == 1).all():
        return np.tile(points, (len(kinks), 1)), np.tile(weights, (len(kinks), 1))
    kinks = kinks[:, None]
    points = np.concatenate([kinks * points, kinks + (1 - kinks) * points], axis=1)
    return points, np.concatenate([kinks * weights, (1 - kinks) * weights], axis=1)


def _lagrange_by_element(nodes, positions):
    """`lagrange` of nodes, shape (k,), at positions in each element, shape (e, q): shape (e, q, k)."""
    return lagrange(nodes, positions.ravel()).reshape(*positions.shape, -1)


def _work_on_functions(values, work):
    """Sum over q points of the work at each, (e, q, 3, k), times i functions there, (e, q, i): shape (3, e, i, k)."""
    sums = np.swapaxes(values, 1, 2) @ work.reshape(*work.shape[:2], -1)
    return np.moveaxis(sums.reshape(*sums.shape[:2], *work.shape[2:]), 2, 0)


@cache
def _gauss(count):
    """Gauss points and weights on [0, 1], shape (count,) both."""
    roots, weights = np.polynomial.legendre.leggauss(count)
    return (roots + 1) / 2, weights / 2


def _graded(t):
    """Position in an element by its parameter t, both on [0, 1]: close together at the ends for equal steps of t."""
    return t**2 * (3 - 2 * t)


def _graded_inverse(positions):
    """Parameter t of positions in an element, the inverse of `_graded`."""
    return 0.5 - np.sin(np.arcsin(1 - 2 * positions) / 3)


def _states_by_cable(models):
    """`State` of each cable with mass, by its index: dict."""
    return {
        cable: group.ends.state.take(index)
        for group in models.groups
        for index, cable in enumerate(group.cable_indices.tolist())
    }
