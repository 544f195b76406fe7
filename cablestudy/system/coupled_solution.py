"""Coupled modes of a suspension: their errors, their damping, and which bodies and cables move in each."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.plane_modes import runs_of
from cablestudy.cable.records import with_computed
from cablestudy.system.coupled_trial import RowModel
from cablestudy.system.damped_pole import ratios_near
from cablestudy.system.damping import damped_poles
from cablestudy.system.mode_pairs import pair_modes
from cablestudy.system.tolerances import SYSTEM

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
KINDS = ("in-plane", "out-of-plane", "axial")


@dataclass(frozen=True)
class CableRecord:
    """Mesh and modes of one cable in a model, and the reason for them.

    Attributes
    ----------
    name : str
    elements, order : int
        Of its mesh; zero for a cable without mass.
    modes, residuals : int
        Coordinates: modes with fixed ends, and vectors that represent the others.
    first_mode : float
        Its lowest mode with fixed ends; infinite without mass. [Hz]
    limit : float
        Frequency up to which modes are kept. [Hz]
    error : float
        Largest relative error of the frequencies by the modes left out. [-]
    """

    name: str
    elements: int
    order: int
    modes: int
    residuals: int
    first_mode: float
    limit: float
    error: float

    @property
    def reason(self):
        """Reason why the cable keeps these modes: one sentence."""
        if not self.elements:
            return "without mass: stiffness only"
        if not self.modes + self.residuals:
            first = f"its first one, at {self.first_mode:.4g} Hz,"
            return f"no modes: {first} changes no frequency by more than {self.error:.1e}"
        count = "1 mode" if self.modes == 1 else f"{self.modes} modes"
        if not np.isfinite(self.limit):
            all_kept = self.modes == 3 * (self.elements * self.order - 1)
            kept = f"all {count}" if all_kept else f"{count} and vectors for those above"
            return f"{kept} of {self.elements} elements of order {self.order}"
        return (
            f"{count} below {self.limit:.4g} Hz and {self.residuals} vectors for those above: "
            f"what is left out changes no frequency by more than {self.error:.1e}"
        )


@dataclass(frozen=True)
class CoupledModes:
    """The lowest modes of a suspension.

    Attributes
    ----------
    omega : ndarray, shape (k,)
        Undamped angular frequencies, ascending. [rad/s]
    error : ndarray, shape (k,)
        Estimated relative error of each; NaN for stated elements. [-]
    coincident : tuple of (int, int)
        First and last number (from 1) of each run of modes whose frequencies agree within their errors: their motions
        may be combined at will.
    model : RowModel
        Coordinates and matrices of the suspension.
    shapes : ndarray, shape (n, k)
        In the coordinates of the system, mass-normalised.
    truncation_error : ndarray, shape (c, k)
        Relative error of the squared frequencies due to modes that each cable leaves out. [-]
    finer : callable or None
        Computes modes of a finer model, more of them, for `damped`; None where these modes serve.
    all_modes : CoupledModes or None
        All modes that were computed, of which these are the lowest; None where these are all.
    """

    omega: np.ndarray
    error: np.ndarray
    coincident: tuple
    model: RowModel
    shapes: np.ndarray
    truncation_error: np.ndarray
    finer: Callable | None = None
    all_modes: "CoupledModes | None" = None

    def __len__(self):
        return len(self.omega)

    @property
    def frequency(self):
        """Undamped frequencies, shape (k,). [Hz]"""
        return self.omega / (2 * np.pi)

    @property
    def with_all_modes(self):
        """All modes that were computed."""
        return self if self.all_modes is None else self.all_modes

    @property
    def layout(self):
        """`Layout`."""
        return self.model.layout

    @property
    def system(self):
        """The `LinearSystem`."""
        return self.model.system

    @property
    def models(self):
        """`Models` of the cables."""
        return self.model.coordinates.models

    @property
    def kept(self):
        """Coordinates of each cable: list of ReducedCable."""
        return self.model.coordinates.kept

    @property
    def fewest_modes_of_cable(self):
        """Fewest modes that a cable with mass has among the coordinates, those of both planes; none without such."""
        pairs = zip(self.models.meshes, self.kept, strict=True)
        return min((kept.modes for mesh, kept in pairs if mesh is not None), default=np.inf)

    def first(self, count):
        """The lowest of these modes, in the same model and without a finer one; all of them as they are."""
        if count >= len(self):
            return self
        lowest, runs = self.take(np.arange(count)), tuple(run for run in self.coincident if run[1] <= count)
        return replace(lowest, coincident=runs, finer=None, all_modes=self.with_all_modes)

    @cached_property
    def damping_ratio(self):
        """Damping ratio of the pole of each mode, shape (k,): with all motion of the cables where that is found. [-]

        Else that of the model of the modes, see `damping.damped_poles`: with modal damping, for stated elements, and
        for a mode that does not oscillate.
        """
        ratio, found = self._poles_and_ratios[1], self._ratio_with_all_motion
        return np.where(np.isnan(found), ratio, found)

    @cached_property
    def _poles_and_ratios(self):
        """Pole of each mode [rad/s] and its damping ratio [-] by the model of the modes: `damping.damped_poles`."""
        modes = self.damped
        return damped_poles(modes.system, modes.omega, modes.shapes)

    @cached_property
    def _ratio_with_all_motion(self):
        """Damping ratio of each pole with all motion of the cables, NaN where it is not found. [-]"""
        models, (poles, ratio) = self.damped.models, self._poles_and_ratios
        sought = (ratio > SYSTEM.frequency_rounding) & ~np.isnan(self.error) & (not models.cables.modal.any())
        meshes = models if models.complete else models.with_all_displacements()
        return self._ratios_near(np.where(sought, poles, complex(np.nan, np.nan)), meshes)

    def _ratios_near(self, poles, models):
        """Damping ratios of the poles nearest to some, by elements of the cables: `damped_pole.ratios_near`. [-]"""
        if np.isnan(poles).all() or not len(self.layout.free):  # nothing to condense the motion to
            return np.full(len(poles), np.nan)
        cables = models.condensed(np.arange(models.cables.count))
        return ratios_near(self.damped.layout, cables, poles, self.damped.shapes)

    @cached_property
    def damped(self):
        """These modes, in their order, of a finer model with more modes of cables: for damping and state spaces.

        Where there is none (see `finer`), these modes themselves.
        """
        finer_modes = self.finer and self.finer()
        if not finer_modes or len(finer_modes) < len(self):
            return self
        return finer_modes.take(pair_modes(self, finer_modes))

    @cached_property
    def damping_error(self):
        """Estimated relative error of each damping ratio, shape (k,). [-]

        By what coarser meshes of the cables change, zero of a ratio that is no more than rounding. Not a number for
        stated elements, for a mode that does not oscillate, and for modal damping, whose effect on a mode that moves
        the ends of cables grows with their modes.
        """
        poles, ratio = self._poles_and_ratios
        found, models = self._ratio_with_all_motion, self.damped.models
        near = np.where(np.isnan(found), complex(np.nan, np.nan), poles)
        coarse = models.with_all_displacements(coarser=SYSTEM.finer_orders)
        change = np.abs(self._ratios_near(near, coarse) / found - 1)
        rounding = SYSTEM.frequency_rounding + SYSTEM.damping_rounding / found
        error = np.maximum(SYSTEM.coarser_mesh_safety * change, rounding)
        known_as_zero = (ratio <= SYSTEM.frequency_rounding) & ~np.isnan(self.error)
        return np.where(known_as_zero, 0.0, error)

    def compliance_shares(self, body, axis):
        """Share of each mode in the static compliance of a free motion of a body: all of them add up to one. [-]

        Parameters
        ----------
        body, axis : int
            Among all bodies and junctions, and of AXES.

        Returns
        -------
        ndarray, shape (k,)
        """
        return self.shares_of(np.flatnonzero(self.layout.free == 6 * body + axis))[0]

    def shares_of(self, motions):
        """`compliance_shares` of some free displacements, by their numbers, shape (q, k). [-]"""
        displacement = self.layout.bodies(self.shapes)[motions] / self.omega
        return displacement**2 / self.model.reduced.compliance(motions)[:, None]

    def run_of(self, mode):
        """The modes that coincide with one, itself among them: slice of their indices, from 0."""
        runs = (slice(first - 1, last) for first, last in self.coincident)
        return next((run for run in runs if run.start <= mode < run.stop), slice(mode, mode + 1))

    def over_coincident(self, shares, chosen=None):
        """Shares of modes with those of all modes that coincide added up: such modes may be combined at will.

        Parameters
        ----------
        shares : ndarray, shape (..., m)
        chosen : ndarray of int, shape (m,), optional
            Indices of the modes, from 0; by default all.
        """
        total, index = np.array(shares), np.arange(len(self)) if chosen is None else chosen
        for first, last in self.coincident:
            run = (index >= first - 1) & (index < last)
            total[..., run] = total[..., run].sum(axis=-1, keepdims=True)
        return total

    @cached_property
    def _nodes(self):
        """Positions of the nodes of each cable from its end 1, and their displacements: list, see `Models.nodes`."""
        amplitudes = self.model.coordinates.amplitudes(self.shapes)
        return self.models.nodes(amplitudes, self.layout.ends(self.layout.bodies(self.shapes)))

    @cached_property
    def displacements(self):
        """Displacements of the nodes of each cable in each mode, global axes: list of ndarray, shape (nodes, 3, k).

        [1/sqrt(kg)]
        """
        return [displacement for _, displacement in self._nodes]

    def nodes(self, mode):
        """Positions of the nodes of each cable from its end 1, and displacements in one mode (from 0), global axes.

        Returns
        -------
        list of (ndarray, ndarray)
            Both of shape (nodes, 3). [m], [1/sqrt(kg)]
        """
        return [(position, displacement[..., mode]) for position, displacement in self._nodes]

    def take(self, chosen):
        """Some of these modes, by their indices (from 0), in that order, without a word about which coincide."""
        return replace(
            self,
            omega=self.omega[chosen],
            error=self.error[chosen],
            coincident=(),
            shapes=self.shapes[:, chosen],
            truncation_error=self.truncation_error[:, chosen],
        )

    def up_to(self, frequency):
        """Indices of the modes up to a frequency [Hz], from 0."""
        return np.flatnonzero(self.frequency <= frequency)

    @cached_property
    def _energy(self):
        """Shares of bodies and cables in the kinetic energy: `body_energy` and `cable_energy`."""
        displacements, amplitudes = self.layout.bodies(self.shapes), self.model.coordinates.amplitudes(self.shapes)
        bodies = self.layout.moving_mass(displacements)
        cables = self.models.moving_mass(amplitudes, self.layout.ends(displacements))
        total = bodies.sum(axis=(0, 1)) + cables.sum(axis=(0, 1))
        return bodies / total, cables / total

    @property
    def body_energy(self):
        """Shares of bodies in the kinetic energy, shape (b, 6, k): x y z of the center of mass, rotations. [-]

        Rotations are about the axes of the body.
        """
        return self._energy[0]

    @property
    def cable_energy(self):
        """Shares of cables in the kinetic energy, shape (c, 3, k): in the plane of each, out of it, along it. [-]"""
        return self._energy[1]

    @cached_property
    def kinds(self):
        """Kind of the motion of all cables in each mode, one of KINDS as of the modes of one cable: tuple of str.

        Empty where a body, or the junctions together, have more of the kinetic energy than the cables, see `moves`.
        """
        cables = self.cable_energy.sum(axis=0)
        _, out_of_plane, axial = cables > 0.5 * cables.sum(axis=0)
        displacements, amplitudes = self.layout.bodies(self.shapes), self.model.coordinates.amplitudes(self.shapes)
        elastic, geometric = self.models.strain_energies(amplitudes, self.layout.ends(displacements))
        kinds = np.where(out_of_plane, KINDS[1], np.where(axial & (elastic > geometric), KINDS[2], KINDS[0]))
        groups = self._energy_of_groups
        return tuple(np.where(np.argmax(groups, axis=0) < len(groups) - 1, "", kinds).tolist())

    @cached_property
    def cables(self):
        """Mesh and modes of each cable: tuple of `CableRecord`."""
        return tuple(_cable_record(self, cable, name) for cable, name in enumerate(self._cable_names))

    @property
    def _cable_names(self):
        return self.layout.equilibrium.suspension.cable_names

    @property
    def body_share(self):
        """Share of the kinetic energy in bodies and junctions, shape (k,). [-]"""
        return self.body_energy.sum(axis=(0, 1))

    @cached_property
    def moves(self):
        """Name of what has the largest share of the kinetic energy in each mode, such as "gondola x" or "n1 in-plane".

        A body, the junctions together or the cables together; of these one by its name where it has more than half.
        """
        return tuple(self._name_of_largest(mode) for mode in range(len(self)))

    @cached_property
    def _energy_of_groups(self):
        """Shares of each body, of the junctions together and of the cables together, rounded, shape (bodies + 2, k)."""
        count, bodies = self.layout.equilibrium.suspension.bodies, self.body_energy.sum(axis=1)
        groups = [*bodies[:count], bodies[count:].sum(axis=0), self.cable_energy.sum(axis=(0, 1))]
        return np.round(groups, 9)

    def _name_of_largest(self, mode):
        """Name of what moves most in one mode, by its index, see `moves`: str."""
        suspension, energy = self.layout.equilibrium.suspension, self.body_energy[..., mode]
        body_names, count = suspension.body_names, suspension.bodies
        largest = int(np.argmax(self._energy_of_groups[:, mode]))
        if largest < count:
            return _largest(body_names[largest : largest + 1], AXES, energy[largest : largest + 1], None)
        if largest == count:
            return _largest(body_names[count:], AXES, energy[count:], "points")
        return _largest(self._cable_names, KINDS, self.cable_energy[..., mode], "cables")


def modes_of_row(trial, row, error, finer=None):
    """`CoupledModes` of one suspension of a `Trial`, with modes of nearly equal frequencies marked as coincident.

    Modes coincide if their frequencies agree within their errors, so that their order is not certain. The error of each
    of them becomes the largest of their errors plus the relative distance of the highest from the lowest frequency.
    The shapes Phi of those that agree within rounding are replaced by combinations Phi V, orthogonal for M, that move
    different coordinates as far as possible: V are the eigenvectors of the symmetric part of Phi^T N M Phi, N being the
    diagonal matrix of 1, 2, 3...; of others, combinations would not be orthogonal for the stiffness.

    Parameters
    ----------
    trial : Trial
        Modes of many suspensions, called rows.
    row : int
        Index of the suspension.
    error : ndarray, shape (k,)
        Estimated relative error of each frequency, except for `Trial.rounding`. [-]
    finer : callable, optional
        Makes modes of a finer model when they are needed, see `CoupledModes`.

    Returns
    -------
    CoupledModes

    Raises
    ------
    NoSolutionError
        The equilibrium is not stable.
    """
    model, omega, shapes, truncation_error = trial.modes_of(row)
    rounding = np.maximum(trial.rounding[row][: len(omega)], SYSTEM.frequency_rounding)
    error = np.maximum(error[: len(omega)], rounding)
    coincident = _runs_within(np.where(np.isnan(error), rounding, error), omega)
    for run in coincident:
        error[run] = error[run].max() + omega[run][-1] / omega[run][0] - 1
    separate(shapes, _runs_within(rounding, omega), model.reduced.mass_times)
    numbers = tuple((run.start + 1, run.stop) for run in coincident)
    return CoupledModes(omega, error, numbers, model, shapes, truncation_error, finer)


def separate(shapes, runs, mass_times):
    """Combine the shapes of runs of modes that agree, in place: they move different coordinates as far as possible."""
    number = np.arange(len(shapes))[:, None] + 1.0
    for run in runs:
        # combinations by the principal axes of the mean number of the coordinates that move
        by_number = shapes[:, run].T @ (number * mass_times(shapes[:, run]))
        shapes[:, run] = shapes[:, run] @ np.linalg.eigh(by_number + by_number.T)[1]


def of_system(modes, system):
    """`CoupledModes` of a `LinearSystem` in the coordinates of some, as many as these, and the system with them.

    Modes of the system that agree within rounding are combined as in `modes_of_row`: its `strain_modes` then are these.
    """
    compliance, shapes = system.strain_modes
    massive, shapes = compliance > 0, shapes.copy()
    omega = 1 / np.sqrt(compliance[massive])
    separate(shapes, _runs_within(np.full(len(omega), SYSTEM.frequency_rounding), omega), lambda v: system.mass @ v)
    omega = omega[: len(modes)]
    own = replace(modes, omega=omega, shapes=shapes[:, : len(omega)] * omega, finer=None, all_modes=None)
    return own, with_computed(replace(system), strain_modes=(compliance, shapes))


def _runs_within(error, omega):
    """Runs of frequencies each of which agrees with the next one within relative errors, shape (k,): list of slice."""
    return [slice(*ends) for ends in runs_of(np.diff(omega) <= (error[1:] + error[:-1]) * omega[1:])]


def _cable_record(modes, cable, name):
    """`CableRecord` of one cable, by its index."""
    mesh, kept = modes.models.meshes[cable], modes.kept[cable]
    return CableRecord(
        name=name,
        elements=mesh.elements if mesh else 0,
        order=mesh.order if mesh else 0,
        modes=kept.modes,
        residuals=kept.residuals,
        first_mode=float(modes.models.lowest_omega[cable]) / (2 * np.pi),
        limit=float(modes.model.coordinates.limits[cable]) / (2 * np.pi),
        error=float(np.abs(modes.truncation_error[cable]).max(initial=0.0)) / 2,
    )


def _largest(names, kinds, energy, word_for_all):
    """Name and kind of motion with most energy, as "n1 in-plane"; a word where no name has more than half of it.

    Parameters
    ----------
    names, kinds : sequence of str
    energy : ndarray, shape (names, kinds)
    word_for_all : str or None
    """
    by_name = energy.sum(axis=1)
    largest = int(np.argmax(by_name))
    if by_name[largest] <= 0.5 * by_name.sum():
        return word_for_all
    return f"{names[largest]} {kinds[int(np.argmax(np.round(energy[largest], 9)))]}"
