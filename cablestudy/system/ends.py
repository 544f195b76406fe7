"""Computes superelements of a cable, or of many on one mesh, from their modes with fixed ends and static shapes."""

from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import flatten_components
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.plane_modes import unresolved_share
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.superelement import Superelement
from cablestudy.system.tolerances import SYSTEM


def _of_batch(compute):
    """A cached property of `Ends`, an array, a tuple of arrays or None: of some of a batch computed for all."""

    def found(ends):
        if ends.among is None:
            return compute(ends)
        whole, rows = ends.among
        known = getattr(whole, compute.__name__)
        if isinstance(known, tuple):
            return tuple(part[rows] for part in known)
        return None if known is None else known[rows]

    return cached_property(found)


class Ends:
    """The superelements of a cable, or of many on one mesh, with any damping.

    Parameters
    ----------
    dynamics : Dynamics
        Of one cable, or with a leading axis of many.
    frame : ndarray, shape (..., 3, 3)
        Rows: the chord frame in global coordinates. [-]
    count : int
        How many modes to keep.

    Attributes
    ----------
    among : (Ends, slice or ndarray of int) or None
        The batch of which these were taken, and which of it they are.
    """

    def __init__(self, dynamics, frame, count):
        self._dynamics, self._frame, self._count, self.among = dynamics, frame, count, None

    def take(self, rows):
        """Those of some cables, by a slice or their numbers: what they need is computed for all at once."""
        if self.among is not None:
            whole, first = self.among
            return whole.take(np.arange(len(whole._frame))[first][rows])
        some = Ends(self._dynamics.take(rows), self._frame[rows], self._count)
        some.among = self, rows
        return some

    def model(self, damping, place=()):
        """The `Superelement` of one cable.

        Parameters
        ----------
        damping : Damping
            model, and ratio [-], loss_factor [-] or time [s]; viscous [N s/m^2].
        place : int
            Of the cable among many.
        """
        omega, coupling, stiffness, inertia = (part[place] for part in self._undamped)
        participation = -(omega[:, None] ** 2) * coupling
        viscous = damping.viscous / float(self._dynamics.mass[place])
        carried = None if self._carried is None else self._carried[place]
        if damping.model == "modal":
            ratio = np.full(len(omega), damping.ratio)
            return Superelement(omega, participation, ratio, stiffness, inertia, None, viscous, carried=carried)
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        strain = Strain(damping.model, amount, *(part[place] for part in self._elastic))
        ratio = np.diagonal(strain.modes) / omega**2 * amount / 2 * (1 if damping.model == "hysteretic" else omega)
        return Superelement(omega, participation, ratio, stiffness, inertia, strain, viscous, carried=carried)

    def motion(self, amplitudes, ends):
        """Displacements of the nodes of all cables.

        Parameters
        ----------
        amplitudes : ndarray, shape (..., n, r)
            Of the modes, about the static shapes. [sqrt(kg) m]
        ends : ndarray, shape (..., 6, r)
            Displacements of the ends, global axes. [m]

        Returns
        -------
        ndarray, shape (..., nodes, 3, r)
            Chord frame. [m]
        """
        local = self._turn @ ends
        shapes = self._basis[1]
        moved = (flatten_components(shapes) @ amplitudes).reshape(*shapes.shape[:-1], amplitudes.shape[-1])
        for system, places, both in self._static_shapes:
            moved[..., list(system.axes), :] += both @ local[..., None, places, :]
        return moved

    @property
    def shapes(self):
        """Displacements of the nodes in each mode, and by a movement of each end, shape (..., nodes, 3, n + 6).

        Chord frame; movements of the ends by global axes.
        """
        modes = self._basis[1]
        still = np.zeros((*self._frame.shape[:-2], modes.shape[-1], 6))
        return np.concatenate([modes, self.motion(still, np.eye(6))], axis=-1)

    def highest_energy(self, amplitudes, ends):
        """Estimated error of twice the strain energy of motions of all cables by the mesh, shape (..., r). [J]

        A share of the energy in the two highest polynomials of the elements (`plane_modes.unresolved_share`).

        Parameters
        ----------
        amplitudes, ends
            As for `motion`.
        """
        moved, dynamics = self.motion(amplitudes, ends), self._dynamics
        energy = sum(system.highest_energy(moved[..., system.axes, :]) for system in dynamics.systems)
        scale = unresolved_share(self.state.mesh.order) * np.asarray(self.state.force / dynamics.length)
        return scale[..., None] * energy

    @property
    def state(self):
        """`State` of the cables."""
        return self._dynamics.state

    @property
    def omega(self):
        """Of the modes of all cables, shape (..., n). [rad/s]"""
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

    @_of_batch
    def _basis(self):
        """Angular frequencies [rad/s] and shapes (`Modes.shapes`) of the coordinates inside."""
        modes = self._dynamics.modes(self._count).first(self._count)
        return 2 * np.pi * modes.frequency, modes.shapes

    @cached_property
    def _static_shapes(self):
        """Of each system the places of its axes among the six, and its static shapes for movements of either end."""
        found = []
        for system in self._dynamics.systems:
            # a movement of end 1 is one of the whole cable less one of end 2
            second = system.end_shapes
            both = np.concatenate([np.eye(len(system.axes)) - second, second], axis=-1)
            found.append((system, [*system.axes, *(axis + 3 for axis in system.axes)], both))
        return found

    @property
    def _turn(self):
        """Rows: the chord frame at both ends, shape (..., 6, 6)."""
        none = np.zeros_like(self._frame)
        return np.block([[self._frame, none], [none, self._frame]])

    @_of_batch
    def _undamped(self):
        """Angular frequencies, coupling, static stiffness and inertia, as in `Superelement`."""
        dynamics, (omega, inside), frame, turn = self._dynamics, self._basis, self._frame, self._turn
        *lead, _, _, count = inside.shape
        coupling, inertia = np.zeros((*lead, count, 6)), np.zeros(turn.shape)
        for system, places, both in self._static_shapes:
            weighed = flatten_components(system.inertia(both))
            shapes = flatten_components(inside[..., system.axes, :])
            coupling[..., places] = shapes.swapaxes(-1, -2) @ weighed
            inertia[..., np.array(places)[:, None], places] = flatten_components(both).swapaxes(-1, -2) @ weighed
        mass = np.asarray(dynamics.mass * dynamics.length)[..., None, None]
        static = frame.swapaxes(-1, -2) @ dynamics.end_stiffness @ frame
        return (
            omega,
            mass * coupling @ turn,
            np.block([[static, -static], [-static, static]]),
            turn.swapaxes(-1, -2) @ (mass * inertia) @ turn,
        )

    @_of_batch
    def _carried(self):
        """See `Superelement.carried`, shape (..., c, n + 6); None without point masses."""
        mesh, shapes = self.state.mesh, self._basis[1]
        nodes = np.flatnonzero(mesh.carried)
        if not len(nodes):
            return None
        *lead, _, _, count = shapes.shape
        moved = np.zeros((*lead, len(nodes), 3, count + 6))
        moved[..., :count] = shapes[..., nodes, :, :]
        for system, places, both in self._static_shapes:
            rows, columns = np.array(system.axes)[:, None], count + np.array(places)
            moved[..., rows, columns] = both[..., nodes, :, :]
        mass = np.asarray(self._dynamics.mass * self._dynamics.length)[..., None] * mesh.carried[nodes]
        moved = flatten_components(np.sqrt(mass)[..., None, None] * moved)
        return np.concatenate([moved[..., :count], moved[..., count:] @ self._turn], axis=-1)

    @_of_batch
    def _elastic(self):
        """E, R and S of `Strain`."""
        dynamics, shapes, turn = self._dynamics, self._basis[1], self._turn
        n = shapes.shape[-1]
        elastic = np.zeros((*shapes.shape[:-3], n + 6, n + 6))
        for system, places, both in self._static_shapes:
            index = np.array([*range(n), *(n + place for place in places)])
            parts = np.concatenate([shapes[..., list(system.axes), :], both], axis=-1)
            elastic[..., index[:, None], index] += system.elastic_energy(parts)
        elastic *= np.asarray(dynamics.state.force / dynamics.length)[..., None, None]
        return (
            elastic[..., :n, :n],
            elastic[..., :n, n:] @ turn,
            turn.swapaxes(-1, -2) @ elastic[..., n:, n:] @ turn,
        )


class EndsOfLarge(Ends):
    """Those of one cable whose modes are not all computed: six vectors, or fewer, stand for the others.

    As in `cables`, they are the response of the other modes to the inertia of the static shapes; here by solving with
    the inertia and taking off the part of the modes.
    """

    def take(self, rows):
        """Itself: it is one cable."""
        return self

    @cached_property
    def _basis(self):
        # a model of its own: what the eigen-solution leaves in it is ten times as large as the modes
        modes = Dynamics(self.state, self._dynamics.planes).modes(self._count).first(self._count)
        omega, shapes = 2 * np.pi * modes.frequency, modes.shapes
        found = [self._response(*parts, shapes[0]) for parts in self._static_shapes]
        more = np.concatenate([vectors for _, vectors in found], axis=-1)
        return (
            np.concatenate([omega[0], *(own for own, _ in found)])[None],
            np.concatenate([shapes[0], more], axis=-1)[None],
        )

    def _response(self, system, _places, both, shapes):
        """Angular frequencies and shapes, mass-normalised, of the vectors of one plane."""
        dynamics, axes = self._dynamics, system.axes
        mass = (dynamics.mass * dynamics.length).item()
        one = system.take(0)
        weighed = one.inertia(both[0])[1:-1].reshape(one.dof, -1)
        modes = np.sqrt(mass) * shapes[1:-1, list(axes)].reshape(one.dof, -1)
        vectors = response = one.solve(weighed)
        for _ in range(2):  # the second time for what rounding left
            vectors = vectors - modes @ (modes.T @ (one.mass @ vectors))
        size, whole = (np.sqrt((part * (one.mass @ part)).sum(axis=0)) for part in (vectors, response))
        vectors = vectors[:, size > SYSTEM.left_by_modes * whole] / size[size > SYSTEM.left_by_modes * whole]
        size, turned = np.linalg.eigh(vectors.T @ (one.mass @ vectors))
        definite = size > SYSTEM.dependent_unit
        vectors = vectors @ (turned[:, definite] / np.sqrt(size[definite]))
        nodal = np.zeros((*shapes.shape[:2], vectors.shape[1]))
        nodal[1:-1, list(axes)] = vectors.reshape(len(nodal) - 2, len(axes), -1)
        nodal = nodal @ one.principal(nodal[:, list(axes)])
        square = sum(one.modal_energies(nodal[:, list(axes)]))
        unit = 2 * np.pi * dynamics.unit_frequency.item()
        return unit * np.sqrt(square), nodal / np.sqrt(mass)
