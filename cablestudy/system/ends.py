"""Modes with fixed ends and static shapes of a cable, or of many on one mesh, of which superelements are made."""

from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import flatten_components
from cablestudy.cable.dynamics import Dynamics, of_batch
from cablestudy.cable.plane_modes import unresolved_share
from cablestudy.cable.symmetry import symmetry_subspaces
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.superelement import Superelement
from cablestudy.system.tolerances import SYSTEM


class Ends:
    """A cable as seen from its two ends, or many on one mesh: n modes with fixed ends, and six static shapes.

    Superelements with any damping are made of them.

    Parameters
    ----------
    dynamics : Dynamics
        Of one cable, or with a leading axis of many.
    frame : ndarray, shape (..., 3, 3)
        Rows: the chord frame in global coordinates. [-]
    count : int
        How many modes to keep, n.
    alone : bool
        True if no other object asks for modes of `dynamics`: those of a model of its own are then taken, since what
        the eigen-solution leaves in a model is eight times as large as the modes.

    Attributes
    ----------
    among : (Ends, slice or ndarray of int) or None
        The batch of which these were taken, and which of it they are.
    """

    def __init__(self, dynamics, frame, count, alone=False):
        self._dynamics, self._frame, self._count, self._alone, self.among = dynamics, frame, count, alone, None

    def take(self, rows):
        """`Ends` of some of the cables, by a slice or their indices; its properties are computed for all at once."""
        if self.among is not None:
            batch, rows_of_batch = self.among
            return batch.take(np.arange(len(batch._frame))[rows_of_batch][rows])
        taken = type(self)(self._dynamics.take(rows), self._frame[rows], self._count)
        taken.among = self, rows
        return taken

    def superelement(self, damping, index=()):
        """Make the `Superelement` of one cable with a given damping.

        Parameters
        ----------
        damping : Damping
            Its `model`: "modal" with a damping ratio [-], "hysteretic" with a loss factor [-] or "kelvin_voigt" with a
            time [s]; in addition viscous damping per length [N s/m^2].
        index : int
            Index of the cable among those of this object; () if it has but one, without an axis of cables.

        Returns
        -------
        Superelement
            With all n modes. For damping of strain its `damping_ratio` are equivalent ones: E_jj/W_j^2 times loss
            factor/2 (hysteretic) or W_j time/2 (Kelvin-Voigt) for mode j. W_j is its frequency and E the elastic part
            of the modal stiffness.
        """
        omega, coupling, stiffness, inertia = (matrix[index] for matrix in self._undamped)
        participation = -(omega[:, None] ** 2) * coupling
        viscous = damping.viscous / float(self.mass[index])
        carried = None if self.carried is None else self.carried[index]
        if damping.model == "modal":
            ratio = np.full(len(omega), damping.ratio)
            return Superelement(omega, participation, ratio, stiffness, inertia, None, viscous, carried=carried)
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        strain = Strain(damping.model, amount, *(matrix[index] for matrix in self._elastic))
        ratio = np.diagonal(strain.modes) / omega**2 * amount / 2 * (1 if damping.model == "hysteretic" else omega)
        return Superelement(omega, participation, ratio, stiffness, inertia, strain, viscous, carried=carried)

    def nodal_displacements(self, amplitudes, ends):
        """Displacements Psi q + U u of the nodes of all cables: Psi are modes with fixed ends, U static shapes.

        Parameters
        ----------
        amplitudes : ndarray, shape (..., n, r)
            q: amplitudes of the n modes, relative to the static shapes. [sqrt(kg) m]
        ends : ndarray, shape (..., 6, r)
            u: displacements of end 1 and end 2 along x, y, z, global axes. [m]

        Returns
        -------
        ndarray, shape (..., nodes, 3, r)
            Along the axes of the chord frame. [m]
        """
        in_chord_frame = self._rotation @ ends
        shapes = self._basis[1]
        displacements = _combined(shapes, amplitudes)
        for system, columns, static in self._static_shapes:
            displacements[..., list(system.axes), :] += static @ in_chord_frame[..., None, columns, :]
        return displacements

    @property
    def shapes(self):
        """Displacements of the nodes in each mode, and by a movement of each end, shape (..., nodes, 3, n + 6).

        Chord frame; movements of the ends by global axes.
        """
        modes = self._basis[1]
        no_amplitudes = np.zeros((*self._frame.shape[:-2], modes.shape[-1], 6))
        return np.concatenate([modes, self.nodal_displacements(no_amplitudes, np.eye(6))], axis=-1)

    def highest_energy(self, amplitudes, ends):
        """Estimated error of twice the strain energy of motions of all cables due to the mesh, shape (..., r). [J]

        A share of the energy in the two highest polynomials of the elements (`plane_modes.unresolved_share`).

        Parameters
        ----------
        amplitudes, ends
            As for `nodal_displacements`.
        """
        displacements, forces = self.nodal_displacements(amplitudes, ends), self._holding_forces(amplitudes)
        dynamics, energy = self._dynamics, 0.0
        for system in dynamics.systems:
            shapes = displacements[..., system.axes, :]
            energy += system.highest_energy(shapes, system.tension_vectors(forces[..., system.axes, :], shapes))
        scale = unresolved_share(self.state.mesh.order) * np.asarray(self.state.force / dynamics.length)
        return scale[..., None] * energy

    def strain_energies(self, amplitudes, ends):
        """Twice the elastic and the geometric energy of motions of all cables, shape (2, ..., r). [J]

        Arguments are those of `nodal_displacements`.
        """
        displacements, dynamics = self.nodal_displacements(amplitudes, ends), self._dynamics
        energies = sum(
            np.array(system.modal_energies(displacements[..., system.axes, :])) for system in dynamics.systems
        )
        return np.asarray(self.state.force / dynamics.length)[..., None] * energies

    def _holding_forces(self, amplitudes):
        """Forces on the nodes that hold the amplitudes of modes, W^2 M psi of each; shape (..., nodes, 3, r).

        Chord frame, over `State.force`; static shapes need none. See `nodal_displacements`.
        """
        omega, shapes = self._basis
        return self._inertia(_combined(shapes, (omega / self._unit_frequency[..., None])[..., None] ** 2 * amplitudes))

    def _inertia(self, movements):
        """M u of movements of the nodes, shape (..., nodes, 3, r), for cables of unit mass; chord frame."""
        forces = np.zeros(movements.shape)
        for system in self._dynamics.systems:
            forces[..., system.axes, :] = system.inertia(movements[..., system.axes, :])
        return forces

    @property
    def _unit_frequency(self):
        """Angular frequency of the eigenvalue 1, shape (...). [rad/s]"""
        return 2 * np.pi * self._dynamics.unit_frequency

    @property
    def state(self):
        """`State` of the cables."""
        return self._dynamics.state

    @property
    def mass(self):
        """Mass per unstretched length, shape (...). [kg/m]"""
        return self._dynamics.mass

    @property
    def omega(self):
        """Angular frequencies of the modes, shape (..., n). [rad/s]"""
        return self._undamped[0]

    @property
    def coupling(self):
        """Coupling of the modes and the ends, see `Superelement`, shape (..., n, 6). [sqrt(kg)]"""
        return self._undamped[1]

    @property
    def stiffness(self):
        """Static stiffness of the ends, see `Superelement`, shape (..., 6, 6). [N/m]"""
        return self._undamped[2]

    @property
    def inertia(self):
        """Inertia of the ends in static shapes, see `Superelement`, shape (..., 6, 6). [kg]"""
        return self._undamped[3]

    @property
    def inertia_of_modes(self):
        """Inertia of the modes among themselves where it is not the identity, shape (..., n, n); else None. [-]"""

    @property
    def _modes(self):
        """`Modes` with fixed ends; those of `alone` are computed anew whenever they are asked for."""
        dynamics = Dynamics(self.state, self._dynamics.planes) if self._alone else self._dynamics
        return dynamics.modes(self._count).first(self._count)

    @of_batch
    def _basis(self):
        """Angular frequencies [rad/s] and shapes (`Modes.shapes`) of the modes with fixed ends."""
        modes = self._modes
        return 2 * np.pi * modes.frequency, modes.shapes

    @cached_property
    def _static_shapes(self):
        """Static shapes of the planes of motion: list of (system, columns, static), see `Dynamics.systems`.

        `columns` are the indices of the plane's axes among the six movements of both ends, `static` the displacements
        of the nodes along these axes by these movements.
        """
        shapes = []
        for system in self._dynamics.systems:
            # a movement of end 1 is one of the whole cable less one of end 2
            by_end_2 = system.end_shapes
            static = np.concatenate([np.eye(len(system.axes)) - by_end_2, by_end_2], axis=-1)
            shapes.append((system, [*system.axes, *(axis + 3 for axis in system.axes)], static))
        return shapes

    @property
    def _rotation(self):
        """Rotation of the movements of both ends from global axes to the chord frame, shape (..., 6, 6)."""
        rotation = np.zeros((*self._frame.shape[:-2], 6, 6))
        rotation[..., :3, :3] = rotation[..., 3:, 3:] = self._frame
        return rotation

    @of_batch
    def _undamped(self):
        """Angular frequencies, coupling, static stiffness and inertia, as in `Superelement`."""
        dynamics, (omega, shapes), frame, rotation = self._dynamics, self._basis, self._frame, self._rotation
        *batch, _, _, count = shapes.shape
        coupling, inertia = np.zeros((*batch, count, 6)), np.zeros(rotation.shape)
        for system, columns, static in self._static_shapes:
            momentum = flatten_components(system.inertia(static))
            coupling[..., columns] = flatten_components(shapes[..., system.axes, :]).swapaxes(-1, -2) @ momentum
            inertia[..., np.array(columns)[:, None], columns] = flatten_components(static).swapaxes(-1, -2) @ momentum
        mass = np.asarray(dynamics.mass * dynamics.length)[..., None, None]
        end_stiffness = frame.swapaxes(-1, -2) @ dynamics.end_stiffness @ frame
        return (
            omega,
            mass * coupling @ rotation,
            np.block([[end_stiffness, -end_stiffness], [-end_stiffness, end_stiffness]]),
            rotation.swapaxes(-1, -2) @ (mass * inertia) @ rotation,
        )

    @of_batch
    def carried(self):
        """`Superelement.carried`: movements of the point masses, shape (..., c, n + 6); None without any."""
        mesh, shapes = self.state.mesh, self._basis[1]
        nodes = np.flatnonzero(mesh.carried)
        if not len(nodes):
            return None
        *batch, _, _, count = shapes.shape
        movements = np.zeros((*batch, len(nodes), 3, count + 6))
        movements[..., :count] = shapes[..., nodes, :, :]
        for system, columns, static in self._static_shapes:
            axes = np.array(system.axes)[:, None]
            movements[..., axes, count + np.array(columns)] = static[..., nodes, :, :]
        mass = np.asarray(self._dynamics.mass * self._dynamics.length)[..., None] * mesh.carried[nodes]
        movements = flatten_components(np.sqrt(mass)[..., None, None] * movements)
        return np.concatenate([movements[..., :count], movements[..., count:] @ self._rotation], axis=-1)

    @of_batch
    def strain_root(self):
        """V of the movements by modes and ends, shape (..., n q, n + 6): their elastic energies are V^T V.

        Zero in the plane across which the cable moves without strain.
        """
        (*lead, _, _, n), mesh = self._basis[1].shape, self.state.mesh
        root = np.zeros((*lead, mesh.elements * mesh.order, n + 6))
        for system, columns, static in self._static_shapes:
            if len(system.axes) > 1:
                root[..., :n] = system.elastic_root(self._basis[1][..., : len(system.axes), :])
                root[..., n + np.array(columns)] = system.elastic_root(static)
        root *= np.sqrt(np.asarray(self._dynamics.state.force / self._dynamics.length))[..., None, None]
        root[..., n:] = root[..., n:] @ self._rotation
        return root

    @of_batch
    def _elastic(self):
        """E, R and S of `Strain`."""
        n, root = self._basis[1].shape[-1], self.strain_root
        by_modes, by_ends = root[..., :n].swapaxes(-1, -2), root[..., n:]
        return by_modes @ root[..., :n], by_modes @ by_ends, by_ends.swapaxes(-1, -2) @ by_ends


class EndsOfAllMotion(Ends):
    """`Ends` with all motion that a mesh allows, not in modes, which cost more: in shapes whose stiffness is diagonal.

    With P the shapes of `SymmetrySubspace` and B M P = Q T, T a triangle, they are P T^T: their stiffness is 1 and
    their inertia T T^T, both over that of a cable of unit mass and the eigenvalue 1.
    """

    @property
    def _basis(self):
        """Root of the stiffness of each shape [rad/s], the same for all, and the shapes [1/sqrt(kg)]."""
        return self._basis_and_inertia[:2]

    @property
    def inertia_of_modes(self):
        """Inertia between the shapes, which are no modes, shape (..., n, n). [-]"""
        return self._basis_and_inertia[2]

    @of_batch
    def _basis_and_inertia(self):
        """Roots of stiffness and shapes, see `_basis`, and `inertia_of_modes`; symmetry by symmetry."""
        mesh, lead, count, begin = self.state.mesh, self._frame.shape[:-2], self._dynamics.dof, 0
        shapes, inertia = np.zeros((*lead, mesh.nodes, 3, count)), np.zeros((*lead, count, count))
        root_mass = np.sqrt(np.asarray(self._dynamics.mass * self._dynamics.length))[..., None, None]
        for system in self._dynamics.systems:
            for subspace in symmetry_subspaces(mesh, system.axes, self.state.mirror_symmetric):
                triangle = np.linalg.qr(subspace.root(system), mode="r") * (np.sqrt(2) if subspace.sign else 1.0)
                own = slice(begin, begin + triangle.shape[-1])
                inertia[..., own, own] = triangle @ triangle.swapaxes(-1, -2)
                of_nodes = subspace.shapes @ (triangle.swapaxes(-1, -2) / root_mass)
                of_nodes = of_nodes.reshape(*lead, mesh.nodes - 2, len(system.axes), triangle.shape[-1])
                shapes[..., 1:-1, system.axes[0] : system.axes[-1] + 1, own] = of_nodes
                begin = own.stop
        return np.broadcast_to(self._unit_frequency[..., None], (*lead, count)), shapes, inertia


class EndsOfLarge(Ends):
    """`Ends` of one cable whose modes are not all computed: six residual vectors, or fewer, represent the others.

    As in `cable_coordinates`, they are the response of the other modes to the inertia forces of the static shapes; here
    the whole response, from which the part of the computed modes is taken off.
    """

    def take(self, rows):
        """The cable itself: there is only one."""
        return self

    @property
    def highest_computed(self):
        """Highest angular frequency of the modes computed. [rad/s]"""
        omega, _, forces = self._basis_and_forces
        return float(omega[0, : omega.shape[-1] - forces.shape[-1]].max(initial=0.0))

    @property
    def _basis(self):
        """Angular frequencies [rad/s] and shapes of the modes computed, and of the vectors for the others."""
        return self._basis_and_forces[:2]

    def _holding_forces(self, amplitudes):
        """Forces as of `Ends._holding_forces`, by the modes and by the vectors in place of the others."""
        omega, shapes, forces = self._basis_and_forces
        count = omega.shape[-1] - forces.shape[-1]
        square = (omega[..., :count] / self._unit_frequency[..., None]) ** 2
        by_modes = self._inertia(_combined(shapes[..., :count], square[..., None] * amplitudes[..., :count, :]))
        return by_modes + _combined(forces, amplitudes[..., count:, :])

    @cached_property
    def _basis_and_forces(self):
        """`_basis`, and the forces on the nodes that hold the vectors, shape (1, nodes, 3, k)."""
        modes = self._modes
        omega, shapes = 2 * np.pi * modes.frequency[0], modes.shapes[0]
        vectors = [
            self._residual_vectors(system, static[0], omega, shapes) for system, _, static in self._static_shapes
        ]
        vector_omega, vector_shapes, forces = (np.concatenate(arrays, axis=-1) for arrays in zip(*vectors, strict=True))
        basis = np.concatenate([omega, vector_omega]), np.concatenate([shapes, vector_shapes], axis=-1)
        return tuple(array[None] for array in (*basis, forces))

    def _residual_vectors(self, system, static, omega, shapes):
        """Residual vectors of the cable in one plane of motion: they represent the modes that are not computed.

        Parameters
        ----------
        system : System
            Stiffness and mass of the plane, of one cable.
        static : ndarray
            U: displacements of the nodes in this plane by unit displacements of the ends, see `_static_shapes`.
        omega : ndarray, shape (n,)
            W: angular frequencies of the computed modes. [rad/s]
        shapes : ndarray, shape (nodes, 3, n)
            Phi: their mass-normalised shapes.

        Returns
        -------
        omega : ndarray, shape (k,)
            Of k independent vectors. [rad/s]
        shapes : ndarray, shape (nodes, 3, k)
            Mass-normalised.
        forces : ndarray, shape (nodes, 3, k)
            On the nodes, which hold these shapes (K V, scaled as in `_holding_forces`).

        Notes
        -----
        With Phi^T K Phi = W^2, the response of the other modes to the inertia forces M U, and the forces that hold it,
        are

            V = K^-1 M U - Phi a,    K V = M U - M Phi W^2 a,    a = Phi^T M K^-1 M U.

        The vectors are combinations of the columns of V that are orthonormal for M and orthogonal for K.
        """
        dynamics, axes = self._dynamics, list(system.axes)
        cable_mass, unit = (dynamics.mass * dynamics.length).item(), self._unit_frequency.item()
        plane = system.take(0)
        forces = plane.inertia(static)[1:-1].reshape(plane.dof, -1)
        modes = np.sqrt(cable_mass) * shapes[1:-1, axes].reshape(plane.dof, -1)
        vectors = response = plane.solve(forces)
        for _ in range(2):  # twice, since rounding leaves some of the computed modes in the difference
            amplitudes = modes.T @ (plane.mass @ vectors)
            vectors = vectors - modes @ amplitudes
            forces = forces - plane.mass @ (modes @ ((omega / unit)[:, None] ** 2 * amplitudes))
        size, response_size = (np.sqrt((v * (plane.mass @ v)).sum(axis=0)) for v in (vectors, response))
        independent = size > SYSTEM.left_by_modes * response_size
        vectors, forces = (columns[:, independent] / size[independent] for columns in (vectors, forces))
        modal_mass, directions = np.linalg.eigh(vectors.T @ (plane.mass @ vectors))
        definite = modal_mass > SYSTEM.dependent_unit
        combinations = directions[:, definite] / np.sqrt(modal_mass[definite])
        nodal = np.zeros((2, *shapes.shape[:2], combinations.shape[1]))  # shapes and forces
        nodal[:, 1:-1, axes] = [
            (columns @ combinations).reshape(len(shapes) - 2, len(axes), -1) for columns in (vectors, forces)
        ]
        nodal = nodal @ plane.principal(nodal[0][:, axes])
        square = sum(plane.modal_energies(nodal[0][:, axes]))
        return unit * np.sqrt(square), *(nodal / np.sqrt(cable_mass))


def _combined(fields, amplitudes):
    """Sum of vector fields at nodes, shape (..., nodes, 3, n), times amplitudes, (..., n, r): (..., nodes, 3, r)."""
    return (flatten_components(fields) @ amplitudes).reshape(*fields.shape[:-1], amplitudes.shape[-1])
