"""Superelements of all cables of a suspension: those on equal meshes are computed together.

Each cable is given the mesh that resolves its waves up to the highest frequency of interest, and keeps the modes with
fixed ends up to a multiple of it; six vectors at most stand for the others (`cable_coordinates`). A cable all of whose
modes lie far above keeps none: its inertia is that of its static shapes.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from operator import attrgetter

import numpy as np

from cablestudy.cable import equilibrium
from cablestudy.cable.assembly import SPATIAL
from cablestudy.cable.catenary import GAUSS_POINTS, travel_shares
from cablestudy.cable.damping import Damping, grows_with_modes
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.element import basis, counts_of_pieces, mesh_pieces, mesh_segments, pieces
from cablestudy.cable.plane_modes import nodal_tangent
from cablestudy.cable.steady_drag import SteadyDrag, uneven_drag
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import outcome_of
from cablestudy.system.cable_coordinates import Coordinates, MeshGroup
from cablestudy.system.condensed_cables import CondensedCables, laws_of
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.ends import Ends, EndsOfAllMotion, EndsOfLarge
from cablestudy.system.superelement import Superelement
from cablestudy.system.together import batches, computed_together
from cablestudy.system.tolerances import SYSTEM

STRAIGHT = np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3)) / 6  # inertia of a straight cable of unit mass at its ends


@dataclass(frozen=True)
class FixedModel:
    """An exact choice of elements, the same for each cable.

    Attributes
    ----------
    elements, order : int
    mass : {"lumped", "consistent", "blended"}
    drag : SteadyDrag, optional
        Drag by a steady wind, of shape (c,), under which the elements are in equilibrium.
    """

    elements: int
    order: int = 1
    mass: str = "lumped"
    drag: SteadyDrag | None = None

    def take(self, cables):
        """`FixedModel` with the drag on some of the cables alone, by their indices."""
        return replace(self, drag=self.drag and self.drag.take(cables))


class Cables:
    """All cables of a suspension about their equilibrium, or of many cases of it, one case after the other.

    Parameters
    ----------
    catenary : Catenary
        Of shape (c,).
    damping : Damping or sequence of Damping
        Of all cables, or of each: model, and ratio [-], loss_factor [-] or time [s]; viscous [N s/m^2].
    static : ndarray, shape (c, 3, 3), optional
        `Catenary.global_end_stiffness` of the cables, where it is known. [N/m]
    drag : SteadyDrag, optional
        As for `FixedModel`.
    planes : tuple, optional
        As for `Dynamics`: directions in which the cables move; by default all.

    Attributes
    ----------
    among : (Cables, ndarray of int) or None
        The cables of which these were taken, and their indices there.
    """

    def __init__(self, catenary, damping, static=None, drag=None, planes=None):
        self.catenary, self.count, self._static = catenary, len(catenary.span.chord), static
        self._drag, self.planes, self.among = drag, planes, None
        self.damping = list(damping) if isinstance(damping, (list, tuple)) else [damping] * self.count

    def take(self, indices):
        """`Cables` of some of them, by their indices; what all need is computed for all at once."""
        damping, drag = [self.damping[cable] for cable in indices], self._drag
        drag = None if drag is None else drag.take(indices)
        taken = Cables(self.catenary.take(indices), damping, drag=drag, planes=self.planes)
        all_cables, own = self.among or (self, np.arange(self.count))
        taken.among = all_cables, own[indices]
        for name in ("heavy", "shapeless", "folded", "travel_time", "end_stiffness"):
            taken.__dict__[name] = getattr(self, name)[indices]
        taken.__dict__["edges"] = [self.edges[cable] for cable in indices]
        return taken

    @cached_property
    def heavy(self):
        """True for cables that move by themselves: those with mass, and no slack segment; shape (c,)."""
        return (np.asarray(self.catenary.span.mass) > 0) & ~self.catenary.slack

    @cached_property
    def shapeless(self):
        """True for cables with mass that hang slack without weight: nothing says where that mass is; shape (c,)."""
        return (np.asarray(self.catenary.span.mass) > 0) & self.catenary.slack

    @cached_property
    def modal(self):
        """True for cables with modal damping, shape (c,)."""
        return self.heavy & np.array([grows_with_modes(damping) for damping in self.damping], dtype=bool)

    @property
    def across(self):
        """Number of directions across themselves in which they move."""
        return 2 if self.planes is None else sum(len(axes) - (0 in axes) for axes in self.planes)

    @cached_property
    def folded(self):
        """True for cables that hang folded, and have no definite motion, shape (c,)."""
        return self.heavy & self.catenary.folded

    @cached_property
    def in_steady_wind(self):
        """True for cables in a steady wind that their elements follow, shape (c,)."""
        return np.zeros(self.count, dtype=bool) if self._drag is None else self.heavy & (self._drag.normal_drag > 0)

    def uneven_drag(self, cables):
        """Uneven drag of some cables, see `steady_drag.uneven_drag`; None where none of them is blown."""
        return uneven_drag(self._drag.take(cables)) if self.in_steady_wind[cables].any() else None

    @cached_property
    def travel_time(self):
        """Travel time of a transverse wave from end to end, zero without mass, shape (c,). [s]

        The integral of 1/speed over the stretched length by Gauss's rule, with the speed sqrt(T/m') and the mass m' per
        stretched length: over the unstretched length that of sqrt(m (1/T + 1/EA)).
        """
        gauss, span = basis(GAUSS_POINTS), self.catenary.span
        force = self.catenary.tension_at(gauss.points)
        tension = np.sqrt((force**2).sum(axis=-1))
        compliance = np.where(tension > 0, 1 / np.where(tension > 0, tension, 1.0), 0.0)
        compliance = compliance + 1 / span.axial_stiffness[:, None]
        return span.unstretched_length * (np.sqrt(compliance * span.mass[:, None]) @ gauss.weights)

    @cached_property
    def edges(self):
        """Edges of the pieces along which each cable bends little, shares of its length; see `element.pieces`."""
        singularities, fraction = self.catenary.singularities, self.catenary.segments.fraction
        loaded = fraction.shape[-1] > 1
        bent = (np.abs(0.5 - singularities) < 1)[:, 0]
        divided = (bent | loaded) & self.heavy
        return [pieces(fraction[i], singularities[i]) if divided[i] else (0.0, 1.0) for i in range(self.count)]

    @cached_property
    def point_masses(self):
        """Point masses of each cable, see `Span.point_masses`: list of tuple."""
        span = self.catenary.span
        if span.load_masses is None:
            return [()] * self.count
        return [span.take(i).point_masses if self.heavy[i] else () for i in range(self.count)]

    @cached_property
    def carried(self):
        """Mass on each cable over its own, shape (c,). [-]"""
        return np.array([sum(mass for _, mass in masses) for masses in self.point_masses])

    @cached_property
    def end_stiffness(self):
        """Static stiffness of the six ends, from the closed form, global axes, shape (c, 6, 6). [N/m]"""
        static = self.catenary.global_end_stiffness if self._static is None else self._static
        return np.block([[static, -static], [-static, static]])

    @property
    def mass(self):
        """Mass of each cable with what it carries, shape (c,). [kg]"""
        return self.catenary.span.mass * self.catenary.span.unstretched_length * (1 + self.carried)

    @property
    def straight_inertia(self):
        """Inertia of the six ends, the mass distributed as that of straight cables, shape (c, 6, 6). [kg]"""
        return self.mass[:, None, None] * STRAIGHT

    def element_without_mass(self, cable):
        """`Superelement` of a cable without mass, by its index."""
        damping, stiffness, span = self.damping[cable], self.end_stiffness[cable], self.catenary.span
        length = span.unstretched_length[cable]
        no_modes = np.zeros(0), np.zeros((0, 6)), np.zeros(0)
        inertia, strain = np.zeros((6, 6)), None
        if damping.model != "modal" and not self.catenary.slack[cable]:
            chord = span.frame[cable, 0]
            along = span.axial_stiffness[cable] / length * np.outer(chord, chord)
            amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
            elastic = np.block([[along, -along], [-along, along]])
            strain = Strain(damping.model, amount, np.zeros((0, 0)), np.zeros((0, 6)), elastic)
        viscous = damping.viscous * length * STRAIGHT
        return Superelement(*no_modes, stiffness, inertia, strain, residual_damping=viscous)

    def condensed_without_mass(self, cables):
        """`CondensedCables` of cables without mass, by their indices."""
        span, damping, count = self.catenary.span.take(cables), [self.damping[cable] for cable in cables], len(cables)
        along = np.sqrt(np.where(self.catenary.slack[cables], 0.0, span.axial_stiffness / span.unstretched_length))
        strain_root = along[:, None, None] * np.concatenate([-span.frame[:, :1], span.frame[:, :1]], axis=-1)
        viscous = np.array([law.viscous for law in damping]) * span.unstretched_length
        return CondensedCables(
            cables=cables,
            omega=np.zeros((count, 0)),
            coupling=np.zeros((count, 0, 6)),
            stiffness=self.end_stiffness[cables],
            inertia=np.zeros((count, 6, 6)),
            **laws_of(damping),
            viscous=np.zeros(count),
            strain_root=strain_root,
            further=viscous[:, None, None] * STRAIGHT,
        )

    def meshes(self, orders):
        """Mesh of each cable, for a sum of the orders of the elements along the piece that has most waves.

        Other pieces (`edges`) have fewer elements, by the time that a wave takes along each.

        Parameters
        ----------
        orders : ndarray, shape (c,)
            This sum of each cable, which is rounded up.

        Returns
        -------
        list of (Mesh or None)
            None for a cable without mass.
        """
        meshes = [None] * self.count
        for cable in np.flatnonzero(self.heavy).tolist():
            elements = ceil(orders[cable] / SYSTEM.highest_order)
            order = 2 * ceil(orders[cable] / elements / 2)  # even ones, so that many cables share a mesh
            edges = self.edges[cable]
            shares = travel_shares(self.catenary.take(cable), edges) if len(edges) > 2 else [1.0]
            counts = counts_of_pieces(elements, shares)
            meshes[cable] = mesh_pieces(edges, counts, order, point_masses=self.point_masses[cable])
        return meshes


class Models:
    """Elements of all cables, one mesh for each: superelements with all modes, and their motion.

    Parameters
    ----------
    cables : Cables
    meshes : list of (Mesh or None)
    fixed : bool
        True if the elements are in their own equilibrium, False if on the closed form of the catenary.
    most_modes : int
        Modes of each cable that are computed at most; six vectors stand for the others.
    modes_of_large : ndarray of int, shape (c,), optional
        Modes that are computed of each cable that has more than `most_modes`, up to as many, which is the default.
    in_modes : bool
        False for `EndsOfAllMotion`, which serve for `condensed` alone.
    """

    def __init__(
        self, cables, meshes, fixed=False, most_modes=SYSTEM.modes_of_cable, in_modes=True, modes_of_large=None
    ):
        self.cables, self.meshes, self._fixed, self._most_modes = cables, meshes, fixed, most_modes
        most = np.full(cables.count, most_modes)
        self._modes_of_large = most if modes_of_large is None else np.minimum(modes_of_large, most)
        self._in_modes, self._on_other_meshes = in_modes, {}

    def equal(self, other):
        """True if these are superelements of the same cables on the same meshes."""
        settings = self.cables, self.meshes, self._fixed, self._most_modes
        equal = settings == (other.cables, other.meshes, other._fixed, other._most_modes)
        return equal and (~self.large | (self._modes_of_large == other._modes_of_large)).all()

    def take(self, indices, cables=None):
        """`Models` of some cables, by their indices, ascending; `cables` are these `Cables`, where they are known."""
        meshes = [self.meshes[cable] for cable in indices]
        settings = self._fixed, self._most_modes, self._in_modes, self._modes_of_large[indices]
        taken = Models(cables or self.cables.take(indices), meshes, *settings)
        taken.groups = _taken(self.groups, indices)
        return taken

    @property
    def freedoms(self):
        """Number of displacements of all nodes of the cables."""
        return sum(3 * mesh.nodes for mesh in self.meshes if mesh is not None)

    def with_modes_up_to(self, limits):
        """`Models` with the modes of large cables up to frequencies, shape (c,) [rad/s]: itself where it has them."""
        modes = self._modes_of_large.copy()
        for group in self.groups:
            if isinstance(group.ends, EndsOfLarge):
                (cable,) = group.cable_indices.tolist()
                modes[cable] = modes[cable] if group.ends.highest_computed > limits[cable] else self._most_modes
        if (modes == self._modes_of_large).all():
            return self
        return Models(self.cables, self.meshes, self._fixed, self._most_modes, self._in_modes, modes)

    def with_all_displacements(self, most_displacements, coarser=0):
        """`Models` of the same cables with all displacements of nodes as unknowns, and no modes: for `condensed`.

        For cables without modal damping.

        Parameters
        ----------
        most_displacements : int
            Largest number of displacements of the nodes of a cable: larger meshes get elements of a lower order.
        coarser : int
            Amount by which the order of the elements of each mesh is lowered, to estimate errors; at least 1 is left.
        """
        key = most_displacements, coarser
        if key not in self._on_other_meshes:
            other = {mesh: mesh and _with_at_most(mesh, most_displacements, coarser) for mesh in set(self.meshes)}
            meshes = [other[mesh] for mesh in self.meshes]
            self._on_other_meshes[key] = Models(self.cables, meshes, most_modes=most_displacements, in_modes=False)
        return self._on_other_meshes[key]

    def in_drag(self, drag):
        """`Models` on the same meshes whose elements are in their own equilibrium under a `SteadyDrag`, shape (c,)."""
        cables = Cables(self.cables.catenary, self.cables.damping, drag=drag)
        return Models(cables, self.meshes, True, self._most_modes)

    @computed_together
    def groups(models):
        """Cables on equal meshes: list of MeshGroup, an attribute of `Models`.

        It is computed in one call for many `Models` whose cables are parts of the same `Cables`.
        """

        def taken_from(one):
            """Key of the cables from which those of some `Models` were taken; None of other ones."""
            return None if one.cables.among is None or one._fixed else (id(one.cables.among[0]), one._most_modes)

        for members in batches(models, taken_from, attrgetter("freedoms")):
            several = len(members) > 1 and taken_from(members[0]) is not None
            solved = _solved_together(members) if several else None
            yield from solved or ((one, one._own_groups()) for one in members)

    def _own_groups(self):
        """`groups` where they are computed for these `Models` alone: list of MeshGroup."""
        cables, members = self.cables, {}
        symmetric = np.asarray(cables.catenary.span.mirror_symmetric)
        for cable, mesh in enumerate(self.meshes):
            if mesh is not None:
                alone = cable if self._large(mesh) else None
                blown = bool(self._fixed and cables.in_steady_wind[cable])
                members.setdefault((mesh, bool(symmetric[cable]), blown, alone), []).append(cable)
        return [self._group(mesh, blown, indices) for (mesh, _, blown, _), indices in members.items()]

    def _group(self, mesh, blown, indices):
        """`MeshGroup` of some cables on one mesh, `in_steady_wind` ones with uneven drag, which couples the planes."""
        catenary = self.cables.catenary.take(np.array(indices))
        if self._fixed:
            state, record = equilibrium.solve_many(catenary, mesh, self.cables.uneven_drag(indices))
            failed = np.flatnonzero(~record.converged)
            if len(failed):
                raise equilibrium.refusal(record.of(failed[0]), mesh)
        else:
            state = equilibrium.from_catenary(catenary, mesh)
        dynamics = Dynamics(state, (SPATIAL,) if blown else self.cables.planes)
        if self._large(mesh):
            ends = EndsOfLarge(dynamics, catenary.span.frame, int(self._modes_of_large[indices[0]]))
        else:
            ends = (Ends if self._in_modes else EndsOfAllMotion)(dynamics, catenary.span.frame, dynamics.dof)
        return MeshGroup(np.array(indices), ends)

    @property
    def complete(self):
        """True if all modes of all cables are computed."""
        return not self.large.any()

    @cached_property
    def large(self):
        """True for cables not all of whose modes are computed, shape (c,)."""
        return np.array([mesh is not None and self._large(mesh) for mesh in self.meshes], dtype=bool)

    def _large(self, mesh):
        """True if a cable has more modes than are computed, and more than cost little."""
        return has_more_modes(mesh, self._most_modes)

    @cached_property
    def elements(self):
        """Superelement of each cable with all its modes: list."""
        elements = [None] * self.cables.count
        for group in self.groups:
            for row, cable in enumerate(group.cable_indices.tolist()):
                elements[cable] = group.ends.model(self.cables.damping[cable], row)
        pairs = enumerate(elements)
        return [self.cables.element_without_mass(cable) if element is None else element for cable, element in pairs]

    def condensed(self, cables):
        """`CondensedCables` of some cables, by their indices, ascending, in whose order theirs are numbered: list."""
        condensed, without_mass = [], np.ones(len(cables), dtype=bool)
        for group in self.groups:
            rows, positions = group.rows(cables)
            if len(positions):
                damping = [self.cables.damping[cable] for cable in cables[positions].tolist()]
                condensed.append(CondensedCables.of_ends(positions, group.ends, rows, damping))
                without_mass[positions] = False
        if without_mass.any():
            of_massless = self.cables.condensed_without_mass(cables[without_mass])
            condensed.append(replace(of_massless, cables=np.flatnonzero(without_mass)))
        return condensed

    @cached_property
    def ends(self):
        """Static stiffness [N/m] and inertia [kg] of the six ends of each cable, both of shape (c, 6, 6)."""
        stiffness, inertia = self.cables.end_stiffness.copy(), np.zeros((self.cables.count, 6, 6))
        for group in self.groups:
            stiffness[group.cable_indices], inertia[group.cable_indices] = group.ends.stiffness, group.ends.inertia
        return stiffness, inertia

    @cached_property
    def first(self):
        """Lowest angular frequency of each cable with fixed ends, infinite without mass, shape (c,). [rad/s]"""
        omega = np.full(self.cables.count, np.inf)
        for group in self.groups:
            omega[group.cable_indices] = group.ends.omega.min(axis=-1, initial=np.inf)
        return omega

    def coordinates(self, limits, chosen=None):
        """`Coordinates` with the modes of each cable up to a frequency.

        Parameters
        ----------
        limits : ndarray, shape (c,)
            Angular frequency up to which modes are kept; zero for none, nor a residual; infinite for all. [rad/s]
        chosen : list of (ndarray of bool, shape (n,)), optional
            Modes of each cable that are kept in any case.
        """
        kept = [group.ends.omega < limits[group.cable_indices, None] for group in self.groups]
        if chosen is not None:
            kept = [below | mask for below, mask in zip(kept, self._mask_of_groups(chosen), strict=True)]
        return self._coordinates(kept, limits)

    def with_modes(self, chosen):
        """Coordinates of each cable: some of its modes, and vectors for the others: list of Kept.

        Parameters
        ----------
        chosen : list of ndarray of bool, shape (n,)
        """
        return self._coordinates(self._mask_of_groups(chosen)).kept

    def _coordinates(self, masks, limits=None):
        """`Coordinates` with the modes of masks, one for each group; no vectors for a cable whose limit is zero."""
        vectors = np.ones(self.cables.count, dtype=bool) if limits is None else limits > 0
        of_groups = [
            group.coordinates(mask, vectors[group.cable_indices])
            for group, mask in zip(self.groups, masks, strict=True)
        ]
        return Coordinates(self, of_groups, limits)

    def _mask_of_groups(self, masks):
        """Masks of the modes of each group, of shape (g, n): list, from those of each cable, of shape (n,)."""
        return [np.stack([masks[cable] for cable in group.cable_indices.tolist()]) for group in self.groups]

    def omitted(self, coordinates, square, ends):
        """Relative error of squared frequencies by the modes that the coordinates of each cable leave out.

        Parameters
        ----------
        coordinates : Coordinates
        square : ndarray, shape (c, r)
            Squared frequencies of r modes of the suspension, at each cable. [rad^2/s^2]
        ends : ndarray, shape (c, 6, r)
            Displacements of the ends in the modes, mass-normalised. [1/sqrt(kg)]

        Returns
        -------
        ndarray, shape (c, r)
            [-]

        Notes
        -----
        A mode left out, with the frequency W and the momentum m per velocity of the ends, whose displacements are u,
        adds the mass |m u|^2 w^2/(W^2 - w^2): over that of the motion, which is 1, this is the relative error of w^2.
        """
        error = np.zeros(square.shape)
        for of_group in coordinates.of_groups:
            cables = of_group.group.cable_indices
            error[cables] = of_group.omitted(square[cables], ends[cables])
        return error

    def unresolved(self, amplitudes, square, ends):
        """Estimated relative error of squared frequencies by the mesh of each cable.

        Parameters
        ----------
        amplitudes : list of ndarray, shape (g, n, r)
            Of all modes of the cables of each group, about their static shapes.
        square, ends
            As for `omitted`.

        Returns
        -------
        ndarray, shape (c, r)
            A share of the energy in the two highest polynomials of the elements (`PlaneModes.errors`). [-]
        """
        error = np.zeros(square.shape)
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            error[group.cable_indices] = group.ends.highest_energy(of_group, ends[group.cable_indices])
        return error / np.where(square > 0, square, 1.0)

    def nodes(self, amplitudes, ends):
        """Positions and displacements of the nodes of each cable, from end 1 to end 2.

        Parameters
        ----------
        amplitudes, ends
            As for `unresolved`.

        Returns
        -------
        list of (ndarray, ndarray)
            Positions from end 1, shape (nodes, 3), and displacements, shape (nodes, 3, r), global axes; the two ends of
            a cable without mass. [m]
        """
        nodes = [(chord, of_ends.reshape(2, 3, -1)) for chord, of_ends in zip(self._chords, ends, strict=True)]
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            cables = group.cable_indices
            for cable, of_cable in zip(cables.tolist(), group.nodes(of_group, ends[cables]), strict=True):
                nodes[cable] = of_cable
        return nodes

    def shapes_of_modes(self):
        """Positions of the nodes, and displacements in modes with fixed ends and in static shapes of the six ends.

        Returns
        -------
        list of (ndarray, ndarray)
            The displacements have the shape (nodes, 3, n + 6).
        """
        nodes = [(chord, np.eye(6).reshape(2, 3, 6)) for chord in self._chords]
        for group in self.groups:
            of_group = group.in_global_axes(group.ends.shapes)
            for cable, of_cable in zip(group.cable_indices.tolist(), of_group, strict=True):
                nodes[cable] = of_cable
        return nodes

    @property
    def _chords(self):
        """Positions of both ends of each cable from its end 1, global axes, shape (c, 2, 3). [m]"""
        span = self.cables.catenary.span
        return (span.chord[:, None] * span.frame[:, 0])[:, None, :] * np.array([[0.0], [1.0]])

    def kinetic(self, amplitudes, ends):
        """Moving mass of each cable by direction: across it in its plane, out of this plane, and along the cable.

        Parameters
        ----------
        amplitudes, ends
            As for `unresolved`.

        Returns
        -------
        ndarray, shape (c, 3, r)
            Twice the kinetic energy over w^2: for mass-normalised motions, whose total is 1, a share of the total. [-]
        """
        moving_mass = np.zeros((len(ends), 3, ends.shape[-1]))
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            span, state = group.ends.state.span, group.ends.state
            displacements = group.ends.motion(of_group, ends[group.cable_indices])
            mass = (span.mass * span.unstretched_length)[:, None, None]
            node_masses = state.mesh.node_masses[:, None]
            along = (nodal_tangent(state)[..., None] * displacements).sum(axis=-2)
            out_of_plane = (node_masses * displacements[..., 2, :] ** 2).sum(axis=-2)
            axial = (node_masses * along**2).sum(axis=-2)
            total = (node_masses[..., None] * displacements**2).sum(axis=(-3, -2))
            in_plane = total - (out_of_plane + axial)
            moving_mass[group.cable_indices] = mass * np.stack([in_plane, out_of_plane, axial], axis=1)
        return moving_mass


def _solved_together(models):
    """`Models.groups` of many `Models` whose cables were taken from the same ones, with their modes: pairs with each.

    None where a cable has no modes.
    """
    cables = models[0].cables.among[0].take(np.concatenate([one.cables.among[1] for one in models]))
    meshes, modes = [mesh for one in models for mesh in one.meshes], [one._modes_of_large for one in models]
    of_all = Models(cables, meshes, most_modes=models[0]._most_modes, modes_of_large=np.concatenate(modes))
    if isinstance(outcome_of(lambda: of_all.first), Exception):
        return None
    edges = np.cumsum([0, *(one.cables.count for one in models)]).tolist()
    own = map(np.arange, edges[:-1], edges[1:])
    return [(one, _taken(of_all.groups, indices)) for one, indices in zip(models, own, strict=True)]


def _taken(groups, indices):
    """`MeshGroup`s reduced to some cables, by their indices, without groups that have none of them: list."""
    taken = (group.take(indices) for group in groups)
    return [group for group in taken if group is not None]


def _with_at_most(mesh, displacements, coarser):
    """Mesh with an order less by `coarser`, and no more than so many displacements; itself if it is that."""
    highest_order = (displacements // 3 + 1) // mesh.elements
    order = max(min(mesh.order, highest_order) - coarser, 1)
    return mesh if order == mesh.order else replace(mesh, order=order)


def has_more_modes(mesh, most_modes=0):
    """True if a cable on a mesh has more modes than `most_modes`, and more than cost little."""
    return 3 * (mesh.nodes - 2) > max(most_modes, CABLE.cheap_freedoms)


def fixed_meshes(cables, model):
    """One mesh for each cable with mass.

    Parameters
    ----------
    cables : Cables
    model : FixedModel
    """
    fraction = cables.catenary.segments.fraction
    return [
        mesh_segments(fraction[i], model.elements, model.order, model.mass, cables.point_masses[i]) if heavy else None
        for i, heavy in enumerate(cables.heavy.tolist())
    ]


UNDAMPED = Damping()
