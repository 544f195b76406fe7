"""Superelements of all cables of a suspension: those on equal meshes are computed together.

Each cable is given the mesh that resolves its waves up to the highest frequency of interest, and keeps the modes with
fixed ends up to a multiple of it; six vectors at most represent the others (`cable_coordinates`). A cable all of whose
modes lie far above keeps none: its inertia is that of its static shapes.
"""

from dataclasses import replace
from functools import cached_property
from operator import attrgetter

import numpy as np

from cablestudy.cable import equilibrium
from cablestudy.cable.assembly import SPATIAL
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.plane_modes import nodal_tangent
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import outcome_of
from cablestudy.system.cable_coordinates import Coordinates, MeshGroup
from cablestudy.system.condensed_cables import CondensedCables
from cablestudy.system.ends import Ends, EndsOfAllMotion, EndsOfLarge
from cablestudy.system.together import batches, computed_together
from cablestudy.system.tolerances import SYSTEM


class Models:
    """Elements of c cables, with a mesh for each: their modes with fixed ends, superelements, errors and motion.

    Cables on equal meshes are groups (`groups`), whose arrays are computed together: g cables of n modes each.

    Parameters
    ----------
    cables : Cables
    meshes : list of (Mesh or None)
        None for a cable without mass.
    fixed : bool
        True if the elements are in their own equilibrium, False if on the closed form of the catenary.
    most_modes : int
        Largest number of modes of a cable that are computed; up to six vectors represent the others.
    modes_of_large : ndarray of int, shape (c,), optional
        Modes that are computed of a cable that has more than `most_modes`. Default and upper bound: `most_modes`.
    in_modes : bool
        False for `EndsOfAllMotion`, which serve for `condensed` alone: displacements of nodes in place of modes.
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
        same_elements = self.cables == other.cables and self.meshes == other.meshes and self._fixed == other._fixed
        if not same_elements or self._most_modes != other._most_modes:
            return False
        # how many modes are computed differs of large cables only: of others all are
        return bool((self._modes_of_large == other._modes_of_large)[self.large].all())

    def take(self, indices, cables=None):
        """`Models` of some cables, by their indices, ascending; `cables` are these `Cables`, where they are known."""
        cables, meshes = cables or self.cables.take(indices), [self.meshes[cable] for cable in indices]
        modes_of_large = self._modes_of_large[indices]
        taken = Models(cables, meshes, self._fixed, self._most_modes, self._in_modes, modes_of_large)
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

    def with_all_displacements(self, coarser=0):
        """`Models` of the same cables with all displacements of nodes as unknowns, and no modes: for `condensed`.

        For cables without modal damping. A mesh with more displacements than `SYSTEM.damped_pole_freedoms` gets
        elements of a lower order.

        Parameters
        ----------
        coarser : int
            Amount by which the order of the elements of each mesh is lowered, to estimate errors; at least 1 is left.
        """
        if coarser not in self._on_other_meshes:
            most = SYSTEM.damped_pole_freedoms
            other = {mesh: mesh and _with_at_most(mesh, most, coarser) for mesh in set(self.meshes)}
            meshes = [other[mesh] for mesh in self.meshes]
            self._on_other_meshes[coarser] = Models(self.cables, meshes, most_modes=most, in_modes=False)
        return self._on_other_meshes[coarser]

    @computed_together
    def groups(models):
        """Cables on equal meshes: list of MeshGroup, an attribute of `Models`.

        It is computed in one call for many `Models` whose cables are parts of the same `Cables`.
        """

        def taken_from(one):
            """Key of the `Cables` of which those of some `Models` are a part; None if of none."""
            return None if one.cables.among is None or one._fixed else (id(one.cables.among[0]), one._most_modes)

        for members in batches(models, taken_from, attrgetter("freedoms")):
            several = len(members) > 1 and taken_from(members[0]) is not None
            solved = _solved_together(members) if several else None
            yield from solved or ((one, one._own_groups()) for one in members)

    def _own_groups(self):
        """`groups` where they are computed for these `Models` alone: list of MeshGroup."""
        symmetric = np.asarray(self.cables.catenary.mirror_symmetric)
        indices_by_key = {}  # what the cables of a group have in common -> their indices
        for cable, mesh in enumerate(self.meshes):
            if mesh is not None:
                in_wind = bool(self._fixed and self.cables.in_steady_wind[cable])
                alone = cable if self._large(mesh) else None  # a large cable is a group by itself
                key = mesh, in_wind, bool(symmetric[cable]), alone
                indices_by_key.setdefault(key, []).append(cable)
        return [self._group(mesh, in_wind, indices) for (mesh, in_wind, *_), indices in indices_by_key.items()]

    def _group(self, mesh, in_wind, indices):
        """`MeshGroup` of some cables on one mesh; in a steady wind uneven drag couples the planes of their motion."""
        catenary = self.cables.catenary.take(np.array(indices))
        dynamics = Dynamics(self._state(catenary, mesh, indices), (SPATIAL,) if in_wind else self.cables.planes)
        if self._large(mesh):
            (cable,) = indices
            ends = EndsOfLarge(dynamics, catenary.span.frame, int(self._modes_of_large[cable]), alone=True)
        elif self._in_modes:
            ends = Ends(dynamics, catenary.span.frame, dynamics.dof, alone=True)
        else:
            ends = EndsOfAllMotion(dynamics, catenary.span.frame, dynamics.dof)
        return MeshGroup(np.array(indices), ends)

    def _state(self, catenary, mesh, indices):
        """State of some cables on one mesh: in equilibrium of the elements where these are `fixed`, else the catenary.

        Raises ConvergenceError where one of them has no such equilibrium.
        """
        if not self._fixed:
            return equilibrium.from_catenary(catenary, mesh)
        state, record = equilibrium.solve_many(catenary, mesh, self.cables.uneven_drag(indices))
        failed = np.flatnonzero(~record.converged)
        if len(failed):
            raise equilibrium.refusal(record.of(failed[0]), mesh)
        return state

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
                elements[cable] = group.ends.superelement(self.cables.damping[cable], row)
        pairs = enumerate(elements)
        return [self.cables.element_without_mass(cable) if element is None else element for cable, element in pairs]

    def condensed(self, cables):
        """Equations of some cables without their modes as coordinates: list of `CondensedCables`, one for each mesh.

        Parameters
        ----------
        cables : ndarray of int
            Indices of these cables, ascending; `CondensedCables.cables` are positions among them.
        """
        condensed, without_mass = [], np.ones(len(cables), dtype=bool)
        for group in self.groups:
            rows, positions = group.find(cables)
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
    def lowest_omega(self):
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
            Angular frequency up to which modes are kept: infinite for all; zero for none, and no residual. [rad/s]
        chosen : list of (ndarray of bool, shape (n,)), optional
            Modes of each cable that are kept in any case.
        """
        kept = [group.ends.omega < limits[group.cable_indices, None] for group in self.groups]
        if chosen is not None:
            kept = [below | mask for below, mask in zip(kept, self._mask_of_groups(chosen), strict=True)]
        return self._coordinates(kept, limits)

    def with_modes(self, chosen):
        """Coordinates of each cable: some of its modes, and vectors for the others: list of ReducedCable.

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
        return [np.array([masks[cable] for cable in group.cable_indices.tolist()]) for group in self.groups]

    def truncation_error(self, coordinates, square, ends):
        """Part of each cable in the error of squared frequencies due to modes that `Coordinates` omit; (c, r). [-]

        See `GroupCoordinates.truncation_error`; `square`, shape (c, r), and `ends`, (c, 6, r), as there.
        """
        error = np.zeros(square.shape)
        for of_group in coordinates.of_groups:
            cables = of_group.group.cable_indices
            error[cables] = of_group.truncation_error(square[cables], ends[cables])
        return error

    def mesh_error(self, amplitudes, square, ends):
        """Estimate the relative error of squared frequencies of a suspension due to the mesh of each of its c cables.

        It is E/w^2 for a mass-normalised mode, whose strain energy is w^2/2. E is a share of the energy in the two
        highest polynomials of a cable's elements: an estimate of the error of twice the strain energy.

        Parameters
        ----------
        amplitudes : list of ndarray, shape (g, n, r)
            For each group of g cables on equal meshes: amplitudes of their n modes with fixed ends, relative to the
            static shapes, in r mass-normalised modes of the suspension. [-]
        square : ndarray, shape (c, r)
            w^2: squared angular frequencies of these r modes, given for each cable. [rad^2/s^2]
        ends : ndarray, shape (c, 6, r)
            Displacements of both ends of each cable along x, y, z in these modes, global axes. [1/sqrt(kg)]

        Returns
        -------
        ndarray, shape (c, r)
            Part of the error that each cable makes; zero without mass. [-]
        """
        error = np.zeros(square.shape)
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            error[group.cable_indices] = group.ends.highest_energy(of_group, ends[group.cable_indices])
        return error / np.where(square > 0, square, 1.0)

    def strain_energies(self, amplitudes, ends):
        """Twice the elastic and the geometric energy of all cables in r motions of the suspension, shape (2, r). [J]

        Arguments are those of `mesh_error`; cables without mass, which have no kind of motion, are left out.
        """
        energies = np.zeros((2, ends.shape[-1]))
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            energies += group.ends.strain_energies(of_group, ends[group.cable_indices]).sum(axis=1)
        return energies

    def nodes(self, amplitudes, ends):
        """Positions and displacements of the nodes of each of the c cables in r motions of the suspension.

        Parameters
        ----------
        amplitudes : list of ndarray, shape (g, n, r)
            For each group of g cables on equal meshes: amplitudes of their n modes with fixed ends, relative to the
            static shapes. [sqrt(kg) m]
        ends : ndarray, shape (c, 6, r)
            Displacements of both ends of each cable along x, y, z, global axes. [m]

        Returns
        -------
        list of (ndarray, ndarray), one for each cable
            Positions of the nodes relative to end 1, shape (nodes, 3) [m], and displacements, shape (nodes, 3, r) [m];
            global axes, nodes from end 1 to end 2. A cable without mass has its two ends as nodes.
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

    def moving_mass(self, amplitudes, ends):
        """Moving mass of each of the c cables in r motions of the suspension, by direction.

        This is 2 T/w^2, T being the kinetic energy and w the frequency: the sum of mass times squared displacement over
        the nodes. For mass-normalised motions it is a share of the kinetic energy.

        Parameters
        ----------
        amplitudes : list of ndarray, shape (g, n, r)
            For each group of g cables on equal meshes: amplitudes of their n modes with fixed ends, relative to the
            static shapes, in mass-normalised motions. [-]
        ends : ndarray, shape (c, 6, r)
            Displacements of both ends of each cable along x, y, z in these motions, global axes. [1/sqrt(kg)]

        Returns
        -------
        ndarray, shape (c, 3, r)
            By direction: across the cable in its plane, out of this plane, along the cable; zero without mass. [-]
        """
        moving_mass = np.zeros((len(ends), 3, ends.shape[-1]))
        for group, of_group in zip(self.groups, amplitudes, strict=True):
            span, state = group.ends.state.span, group.ends.state
            displacements = group.ends.nodal_displacements(of_group, ends[group.cable_indices])
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
    """`Models.groups` of many `Models` whose cables are parts of the same `Cables`, their modes computed in one call.

    Returns
    -------
    list of (Models, list of MeshGroup), or None
        None where a cable has no modes: each of the `Models` then tells by itself.
    """
    cables = models[0].cables.among[0].take(np.concatenate([one.cables.among[1] for one in models]))
    meshes, modes = [mesh for one in models for mesh in one.meshes], [one._modes_of_large for one in models]
    of_all = Models(cables, meshes, most_modes=models[0]._most_modes, modes_of_large=np.concatenate(modes))
    if isinstance(outcome_of(lambda: of_all.lowest_omega), Exception):
        return None
    edges = np.cumsum([0, *(one.cables.count for one in models)]).tolist()
    own = map(np.arange, edges[:-1], edges[1:])
    return [(one, _taken(of_all.groups, indices)) for one, indices in zip(models, own, strict=True)]


def _taken(groups, indices):
    """`MeshGroup`s reduced to some cables, by their indices, without groups that have none of them: list."""
    taken = (group.take(indices) for group in groups)
    return [group for group in taken if group is not None]


def _with_at_most(mesh, displacements, coarser):
    """Mesh of at most `displacements` displacements, its order then lowered by `coarser`; the mesh itself if equal."""
    highest_order = (displacements // 3 + 1) // mesh.elements
    order = max(min(mesh.order, highest_order) - coarser, 1)
    return mesh if order == mesh.order else replace(mesh, order=order)


def has_more_modes(mesh, most_modes=0):
    """True if a cable on a mesh has more modes than `most_modes`, and more than cost little."""
    return 3 * (mesh.nodes - 2) > max(most_modes, CABLE.cheap_freedoms)
