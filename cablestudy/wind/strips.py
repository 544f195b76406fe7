"""Cables in turbulent wind: the drag along each, and the covariance of its work along one cable and between two.

The drag on a cable is linear in the turbulence and in the motion against it, see `drag`; integrals along the cable give
the forces on the coordinates of a suspension and the aerodynamic damping. With the distance r along the cable the
coherence exp(-kappa r) is Green's function of a rod, see `coherence.Rods`: the covariance follows from the forces by a
turbulence that has the form of each shape function of the rod's elements. Cables on equal meshes are one stack of
arrays.

Where a cable comes closest to the direction of the wind its drag, by |u_n|, has a kink, or nearly one: integrals over
an element are sums over both sides of that point.

Covariances between cables follow from the loads' integrals with polynomials of each element, see `cable_pairs`.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, sqrt

import numpy as np

from cablestudy.cable.element import Mesh, basis, lagrange
from cablestudy.cable.meshes import mesh_segments
from cablestudy.cable.steady_drag import across, turning_matrices
from cablestudy.statics.suspension import outward_tangents
from cablestudy.system.superelement import of_shapes, with_ends
from cablestudy.wind.cable_pairs import Arcs, load_points
from cablestudy.wind.coherence import gauss, rods
from cablestudy.wind.drag import drag_matrices
from cablestudy.wind.tolerances import WIND

STRAIGHT = mesh_segments(np.ones(1), 1, 2)  # of a cable without mass


@dataclass(frozen=True)
class Strips:
    """Wind forces along n cables of k coordinates each, on one mesh with p nodes and q points of quadrature.

    Attributes
    ----------
    cables : ndarray of int, shape (n,)
        Indices of the cables.
    mesh : Mesh
    unstretched : ndarray, shape (n,)
        Lengths. [m]
    places : ndarray, shape (n, p, 3)
        Positions of the nodes, global axes. [m]
    shapes : ndarray, shape (n, p, 3, k)
        Displacements of the nodes per coordinate: the kept modes, then six displacements of the ends.
    drag_factor : ndarray, shape (n,)
        Linear drag per length across the wind, rho C_d d U at the mean speed U. [N s/m^2]
    wind_direction : ndarray, shape (3,)
        Unit vector of the mean wind, global axes. [-]
    direction : ndarray, shape (n, elements, order, 3)
        Unit tangents at the points of the tensions, global axes. [-]
    stretch : ndarray, shape (n, elements, order)
        |r'| at these points. [-]
    kinks : ndarray, shape (n, elements)
        Position in each element, on [0, 1], where the tangent is closest to the direction of the wind, so that the drag
        may have a kink there; 1 where that is an end. [-]
    speed : float
        Of the mean wind, for `stiffness`. [m/s]
    profile : Profile or None
        Change of its pressure with the height, of shape (n,); None where there is none.
    """

    cables: np.ndarray
    mesh: Mesh
    unstretched: np.ndarray
    places: np.ndarray
    shapes: np.ndarray
    drag_factor: np.ndarray
    wind_direction: np.ndarray
    direction: np.ndarray
    stretch: np.ndarray
    kinks: np.ndarray
    speed: float = 0.0
    profile: object = None

    @cached_property
    def _rod_mesh(self):
        """`Mesh` of the rods, with more nodes near the ends of elements than the cables need."""
        order, elements = self.mesh.order, self.mesh.elements
        return self.mesh if order == 1 else replace(self.mesh, order=max(order, ceil(WIND.rod_orders / sqrt(elements))))

    @cached_property
    def _rods(self):
        """`Rods` of the cables."""
        points, rod_points = basis(self.mesh.order).points, basis(self._rod_mesh.order).points
        return rods(self._rod_mesh, self.stretch @ lagrange(points, rod_points).T)

    @property
    def length(self):
        """Stretched lengths, shape (n,). [m]"""
        return self.unstretched * self._rods.length

    @cached_property
    def _quadrature(self):
        """Positions on [0, 1] and weights in each element for the rods' functions, see `_split_at_kinks`."""
        return _split_at_kinks(*gauss(self._rod_mesh.order), self.kinks)

    @cached_property
    def forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z with the form of each of the rod's P shape functions.

        Shape (n, 3, P, k). The sum over the P functions is the work by a unit speed everywhere.
        """
        mesh, (positions, weights) = self._rod_mesh, self._quadrature
        by_element = _work_on_functions(
            lagrange(basis(mesh.order).nodes, positions), self._point_work(positions, weights)
        )
        work = np.zeros((*by_element.shape[:2], mesh.nodes, by_element.shape[-1]))
        work[:, :, :-1] = by_element[..., :-1, :].reshape(*work.shape[:2], -1, work.shape[-1])
        work[:, :, mesh.order :: mesh.order] += by_element[..., -1, :]  # neighbours share a node
        return work

    @property
    def largest_force(self):
        """Upper bound of the force on all cables by a unit speed. [N s/m]"""
        matrices = drag_matrices(self.direction, self.wind_direction)
        return float((self.length * self.drag_factor) @ np.abs(matrices).sum(axis=-1).max(axis=(1, 2, 3)))

    @property
    def arcs(self):
        """Elements of each cable for covariances with other cables, list of `Arcs`."""
        return [Arcs(places[self.mesh.element_nodes]) for places in self.places]

    @property
    def point_forces(self):
        """Work on each of `shapes` by a turbulence along x, y, z with the form of each function of the `arcs`.

        Shape (n, 3, q, k), q being the number of functions of all elements of a cable.
        """
        points, weights = load_points(self.mesh.order)
        positions, weights = _split_at_kinks(points, weights, self.kinks)
        by_element = _work_on_functions(lagrange(points, positions), self._point_work(positions, weights))
        return by_element.reshape(*by_element.shape[:2], -1, by_element.shape[-1])

    def _point_work(self, positions, weights):
        """Work on each of `shapes` by a unit speed along x, y, z at positions in each element, shape (n, e, q, 3, k).

        Positions on [0, 1] and their weights are those of `_split_at_kinks`.
        """
        interpolation = lagrange(basis(self.mesh.order).points, positions)
        tangent = interpolation @ self.direction
        tangent = tangent / np.sqrt((tangent**2).sum(axis=-1, keepdims=True))
        stretch = (interpolation @ self.stretch[..., None])[..., 0]
        lengths = self.unstretched[:, None, None] * self.mesh.sizes[:, None] * weights * stretch
        factors = self.drag_factor[:, None, None] * lengths
        if self.profile is not None:
            points = lagrange(basis(self.mesh.order).nodes, positions) @ self.places[:, self.mesh.element_nodes]
            factors = factors * np.sqrt(self.profile.pressure(points))  # speeds are as roots of pressures
        return factors[..., None, None] * drag_matrices(tangent, self.wind_direction) @ self._displacements(positions)

    def _displacements(self, positions):
        """Displacements per coordinate at positions in each element, shape (n, e, q, 3, k)."""
        nodal = self.shapes[:, self.mesh.element_nodes]
        interpolation = lagrange(basis(self.mesh.order).nodes, positions)
        displacements = interpolation @ nodal.reshape(*nodal.shape[:3], -1)
        return displacements.reshape(*displacements.shape[:3], *nodal.shape[3:])

    @property
    def damping(self):
        """Aerodynamic damping of the coordinates, shape (n, k, k)."""
        work, displacements = self._point_work(*self._quadrature), self._displacements(self._quadrature[0])
        work, displacements = (field.reshape(len(field), -1, field.shape[-1]) for field in (work, displacements))
        return np.swapaxes(work, 1, 2) @ displacements

    @property
    def stiffness(self):
        """Stiffness of the coordinates by the mean drag, which turns with the cables, shape (n, k, k); not symmetric.

        The drag changes with r' (`turning_matrices`), and where its pressure changes with the place.
        """
        element, mesh = basis(self.mesh.order), self.mesh
        nodal = self.shapes[:, mesh.element_nodes]
        nodal = nodal.reshape(*nodal.shape[:3], -1)
        shape = len(nodal), mesh.elements, len(element.points), 3, self.shapes.shape[-1]
        slopes = (element.derivative @ nodal).reshape(shape)  # by the position in the element, from 0 to 1
        displacements = (lagrange(element.nodes, element.points) @ nodal).reshape(shape)
        weights = self.drag_factor[:, None, None] * (self.speed / 2 * element.weights)
        turning = turning_matrices(self.direction, self.wind_direction)
        if self.profile is None:
            change = weights[..., None, None] * turning @ slopes
        else:
            points = lagrange(element.nodes, element.points) @ self.places[:, mesh.element_nodes]
            pressure, gradient = self.profile.pressure(points), self.profile.gradient(points)
            lengths = self.unstretched[:, None, None] * mesh.sizes[:, None] * self.stretch
            drag = lengths[..., None] * across(self.wind_direction, self.direction)
            by_place = drag[..., :, None] * gradient[..., None, :]
            change = weights[..., None, None] * (
                pressure[..., None, None] * turning @ slopes + by_place @ displacements
            )
        displacements, change = (field.reshape(len(field), -1, shape[-1]) for field in (displacements, change))
        return -np.swapaxes(displacements, 1, 2) @ change

    def gust_covariance(self, components, kappa):
        """Covariance of the generalised gust forces on `shapes`, for turbulence with the coherence exp(-kappa r).

        r is the distance along the cable. `cable_pairs.coherence_of_chords` gives what the straight distance adds.

        Parameters
        ----------
        components : ndarray, shape (c, 3)
            Directions of the components times their RMS. [m/s]
        kappa : ndarray, shape (f,)
            Positive. [1/m]

        Returns
        -------
        ndarray, shape (n, f, k, k)
        """
        forces = np.moveaxis(self.forces, 1, -1) @ components.T  # (n, P, k, c)
        loads = np.moveaxis(forces, 1, -1).swapaxes(1, 2) @ self._rods.shapes[:, None]
        return self._rods.covariance(loads, kappa * self.length[:, None])


def strips(models, kept, equilibrium, drag):
    """Wind forces along the cables that the wind acts on, for gusts and aerodynamic damping: list of `Strips`.

    There is one `Strips` for all cables with equal meshes and equal numbers of coordinates; none without drag.

    Parameters
    ----------
    models : Models
        Elements of all c cables.
    kept : list of ReducedCable, or None
        Coordinates of each cable: some modes, and vectors that represent the others; None for all modes.
    equilibrium : Equilibrium
        Of one case.
    drag : Drag
        Mean wind, and drag coefficient times diameter of the c cables, of this case.
    """
    if not (drag.cables > 0).any():
        return []
    speed = float(np.sqrt((drag.velocity**2).sum()))
    end_1 = equilibrium.ends[:, 0]
    wind_direction, drag_factors = drag.velocity / speed, float(drag.density) * drag.cables * speed
    courses, groups, found = _directions_along(models, equilibrium.catenary), {}, []
    for cable, mesh, places, shapes in nodal_shapes(models, kept, np.flatnonzero(drag.cables > 0)):
        groups.setdefault((mesh, shapes.shape[-1]), []).append((cable, places, shapes))
    for (mesh, _), members in groups.items():
        cables, places, shapes = map(np.array, zip(*members, strict=True))
        direction, stretch, middle, half = map(np.array, zip(*(courses[cable] for cable in cables), strict=True))
        frame, kinks = equilibrium.catenary.span.frame[cables], np.ones((len(cables), mesh.elements))
        if mesh.order > 1:  # a bar has one direction, and so no kink of its drag
            kinks = _closest_to_wind(middle @ frame, half @ frame, wind_direction)
        of_group = Strips(
            cables,
            mesh,
            unstretched=equilibrium.lengths[cables],
            places=end_1[cables, None] + places,
            shapes=shapes,
            drag_factor=drag_factors[cables],
            wind_direction=wind_direction,
            direction=direction @ frame[:, None],
            stretch=stretch,
            kinks=kinks,
            speed=speed,
            profile=drag.profile and drag.profile.of_each(len(cables)),
        )
        found.append(of_group)
    return found


def nodal_shapes(models, kept, cables):
    """Yield for each of some cables its mesh, the positions of its p nodes, and their displacements per coordinate.

    A cable has k coordinates: its modes or vectors in `kept`, then six displacements of its ends. A cable without mass
    is straight, with one element.

    Parameters
    ----------
    models : Models
        Elements of the cables.
    kept : list of ReducedCable, or None
        Coordinates of each cable: some modes, and vectors that represent the others; None for all modes.
    cables : ndarray of int
        Indices of the cables.

    Yields
    ------
    cable : int
        Index of the cable.
    mesh : Mesh
    positions : ndarray, shape (p, 3)
        Positions of the nodes from end 1, global axes. [m]
    shapes : ndarray, shape (p, 3, k)
        Displacements of the nodes per coordinate, global axes.
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
        shapes = flat if kept is None else of_shapes(flat, with_ends(kept[cable].shapes))
        yield cable, mesh, positions, shapes.reshape(*displacements.shape[:2], -1)


def midspan_shapes(models, kept, catenary):
    """Displacements at mid-span of each cable along the axes of its chord frame, per coordinate: list of (3, k).

    Parameters
    ----------
    models, kept
        As for `nodal_shapes`.
    catenary : Catenary
        Of the c cables.
    """
    at_midspan = []
    for cable, mesh, _, shapes in nodal_shapes(models, kept, np.arange(len(kept))):
        (element,), local = mesh.located(catenary.middle[cable : cable + 1])
        weights = lagrange(basis(mesh.order).nodes, local)[0]
        displacements = np.tensordot(weights, shapes[mesh.element_nodes[element]], axes=1)
        at_midspan.append(catenary.span.frame[cable] @ displacements)
    return at_midspan


def on_cables(modes, layout, shapes, drag):
    """`strips` on the coordinates of `CoupledModes`, and their `coordinate_amplitudes` in shapes of the suspension."""
    on_each = strips(modes.models, modes.kept, layout.equilibrium, drag)
    return on_each, coordinate_amplitudes(modes.model.coordinates, layout, shapes, [group.cables for group in on_each])


def coordinate_amplitudes(coordinates, layout, shapes, groups):
    """Amplitudes of the coordinates of cables in shapes of the suspension, and in movements of one end of a cable.

    The transpose turns wind forces on the coordinates of a cable into forces on the shapes, and into tensions: if one
    end moves by one along its tangent out of the cable, and nothing else moves, the work of a load on this movement is
    the decrease of the tension at that end by the load.

    Parameters
    ----------
    coordinates : Coordinates
        Of the cables.
    layout : Layout
        Connection of the ends of cables to the bodies.
    shapes : ndarray, shape (n, m)
        Combinations of the n coordinates of the suspension.
    groups : list of ndarray of int, shape (g,)
        Indices of the g cables of each group, with equal numbers k of coordinates; c cables in all groups.

    Returns
    -------
    list of ndarray, shape (g, k, m + 2 c)
        For each group: rows are the coordinates of a cable, modes first and then its six ends. Columns are the m
        shapes, then the movements of end 1 and end 2 of each of the c cables, in the order of the groups.
    """
    if not groups:
        return []
    ends, tangents = layout.ends(layout.bodies(shapes)), outward_tangents(layout.equilibrium)[0]
    total, begin, by_group = sum(map(len, groups)), 0, []
    for cables in groups:
        modes = [shapes[np.flatnonzero(coordinates.cable == cable)] for cable in cables.tolist()]
        by_shapes = np.concatenate([np.stack(modes), ends[cables]], axis=1)  # (g, k, m)
        by_movements = np.zeros((*by_shapes.shape[:2], total, 2))
        for index, (at_end_1, at_end_2) in enumerate(tangents[cables]):
            by_movements[index, -6:-3, begin + index, 0] = at_end_1
            by_movements[index, -3:, begin + index, 1] = at_end_2
        by_group.append(np.concatenate([by_shapes, by_movements.reshape(*by_shapes.shape[:2], -1)], axis=-1))
        begin += len(cables)
    return by_group


def _directions_along(models, catenary):
    """Direction, stretch and tension along each cable in its chord frame. A cable without mass counts as straight.

    For each cable, with e elements of some order p: unit tangents, shape (e, p, 3), and local stretched over
    unstretched length, (e, p), at the Gauss points; tension vectors in the middle of each element, and half of their
    changes over it, both (e, 3) [N]. Without mass a unit vector represents the tension.
    """
    along = np.eye(3)[:1]
    mean_stretch = (1 + catenary.mean_tension / catenary.span.axial_stiffness)[:, None, None]
    courses = [(along[None], stretch, along, 0 * along) for stretch in mean_stretch]
    for group in models.groups:
        state = group.ends.state
        fields = state.direction, state.stretch, state.mid_forces, state.half_changes
        for cable, *course in zip(group.cable_indices.tolist(), *fields, strict=True):
            courses[cable] = course
    return courses


def _closest_to_wind(middle, half, wind_direction):
    """Position in each element, on [0, 1], where its tangent is closest to the direction u of the wind; 1 at an end.

    The tension vector is T = M + x H, from x = -1 to 1, with M in `middle` and the change H in `half`, (..., e, 3):
    |T . u|/|T| is largest where its derivative vanishes, (H . u) (M . M + x M . H) = (M . u) (M . H + x H . H).
    """
    mu, hu = middle @ wind_direction, half @ wind_direction
    mm, mh, hh = (middle * middle).sum(axis=-1), (middle * half).sum(axis=-1), (half * half).sum(axis=-1)
    divisor = hu * mh - mu * hh
    x = (mu * mh - hu * mm) / np.where(divisor != 0, divisor, 1.0)
    return np.where((divisor != 0) & (np.abs(x) < 1), (1 + x) / 2, 1.0)


def _split_at_kinks(points, weights, kinks):
    """Points and weights of a rule on both sides of the kink in each element of n cables, shape (n, e, 2 q) each.

    Without kinks they are the same in all elements, shape (1, 1, q).
    """
    if (kinks == 1).all():
        return points[None, None], weights[None, None]
    kinks = kinks[..., None]
    points = np.concatenate([kinks * points, kinks + (1 - kinks) * points], axis=-1)
    return points, np.concatenate([kinks * weights, (1 - kinks) * weights], axis=-1)


def _work_on_functions(values, work):
    """Sum over q points of the work at each, (n, e, q, 3, k), times i functions there, (..., q, i): (n, 3, e, i, k)."""
    sums = np.swapaxes(values, -1, -2) @ work.reshape(*work.shape[:3], -1)
    return np.moveaxis(sums.reshape(*sums.shape[:3], *work.shape[3:]), 3, 1)
