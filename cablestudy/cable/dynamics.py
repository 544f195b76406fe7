"""Eigenmodes of a cable with fixed ends: the lowest, all up to a frequency, or all.

The eigenvalue problem is that of the compliance, K^-1 M, so that the lowest modes are the most accurate; each frequency
is then the Rayleigh quotient of its shape, with energies summed as squares. Uncoupled planes and symmetries are solved
separately. Small models of a batch of cables are solved in one call.
"""

from functools import cached_property, lru_cache
from math import ceil, isnan

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, SPATIAL, System
from cablestudy.cable.matrices import lanczos_basis, lanczos_modes
from cablestudy.cable.modes import CombinedModes, Modes
from cablestudy.cable.plane_modes import PlaneModes
from cablestudy.cable.state import State
from cablestudy.cable.symmetry import symmetry_subspaces
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError

PLANAR = (IN_PLANE, OUT_OF_PLANE)


def of_batch(compute):
    """Decorate a method: a cached property, computed at once for the whole batch of which an object is a part.

    Such an object has an attribute `among`: the batch, and which of it the object is; or None. A value is an array, an
    object with a method `take`, a tuple of these, a list with an entry for each cable, or None.
    """

    def value(part):
        if part.among is None:
            return compute(part)
        batch, index = part.among
        return _taken(getattr(batch, compute.__name__), index)

    return cached_property(value)


def _taken(value, index):
    """The part of a value of `of_batch` that belongs to some of the cables."""
    if isinstance(value, tuple):
        return tuple(_taken(part, index) for part in value)
    if isinstance(value, list):
        return [value[cable] for cable in index]
    return value[index] if isinstance(value, np.ndarray) else value and value.take(index)


class Dynamics:
    """Free vibration of a cable about an equilibrium, or of a batch of cables on one mesh.

    Parameters
    ----------
    state : State
        Of one cable or, with a leading axis, of a batch.
    planes : tuple of tuple of int, optional
        Directions of motion, coupled ones together: PLANAR, one of its two, or (SPATIAL,); without it PLANAR unless a
        load couples them.
    only_requested : bool
        Whether only the requested modes of a small model are computed: faster, but the last digit of a mode may depend
        on their number.
    """

    def __init__(self, state: State, planes=None, only_requested=False):
        self._state, self._mesh, self._only_requested = state, state.mesh, only_requested
        self.planes = planes or (PLANAR if state.planar else (SPATIAL,))
        self._modes, self._frequency_cache, self._eigenvectors = {}, {}, {}
        self.among = None  # of some cables of a batch: the `Dynamics` of all, and the index of these

    def take(self, index):
        """`Dynamics` of one cable of a batch, or of several, whose modes are computed with those of the whole batch."""
        if self.among is not None:
            batch, own_index = self.among
            return batch.take(np.arange(len(batch.length))[own_index][index])
        chosen = Dynamics(self._state, self.planes, self._only_requested)
        chosen.among, chosen.dof = (self, index), self.dof
        return chosen

    @of_batch
    def state(self):
        """`State` of the equilibrium."""
        return self._state

    @of_batch
    def length(self):
        """Unstretched length, shape (...). [m]"""
        return np.asarray(self._state.span.unstretched_length, dtype=float)

    @of_batch
    def mass(self):
        """Per unstretched length, shape (...). [kg/m]"""
        return np.asarray(self._state.span.mass, dtype=float)

    @of_batch
    def systems(self):
        """`System` of each of the planes."""
        return tuple(System(self.state, axes) for axes in self.planes)

    @cached_property
    def dof(self):
        """Number of free displacements. [-]"""
        return (self._mesh.nodes - 2) * sum(len(axes) for axes in self.planes)

    @property
    def small(self):
        """True if the modes of a batch of such models are computed together."""
        return self.dof <= CABLE.cheap_freedoms

    @cached_property
    def unit_frequency(self):
        """Frequency of the eigenvalue 1, shape (...). [Hz]"""
        return np.sqrt(self.state.force / self.mass) / self.length / (2 * np.pi)

    @cached_property
    def end_stiffness(self):
        """Condensed static stiffness of end 2, end 1 fixed, chord frame, shape (..., 3, 3). [N/m]

        Zero in the directions that do not move.
        """
        stiffness = np.zeros((*np.shape(self.length), 3, 3))
        for system in self.systems:
            rows, columns = np.ix_(system.axes, system.axes)
            stiffness[..., rows, columns] = system.end_stiffness
        return stiffness * np.asarray(self.state.force / self.length)[..., None, None]

    def modes(self, count):
        """At least the `count` lowest `Modes`, or all; cached by their number. Raises as `lowest`."""
        if self.small:
            # rounded up: models of a batch then share a call, and a cable's digits do not depend on the others
            count = min(_rounded_up(count), self.dof) if self._only_requested else self.dof
        else:
            # exactly as many as requested: the last digits of Lanczos modes depend on their number
            count = min(count, self.dof)
        if count not in self._modes:
            batch, index = self.among or (None, None)
            self._modes[count] = batch.modes(count).take(index) if batch else self.lowest(count)
        return self._modes[count]

    def up_to(self, frequency):
        """All modes of one cable up to a frequency [Hz], and at least one above it if the model has one."""
        count = self.dof if self.small else CABLE.first_modes
        while True:
            modes = self.modes(count)
            if modes.complete or modes.frequency[-1] > frequency * (1 + CABLE.coincident_modes):
                return modes
            count *= 2

    def frequencies(self, labels, errors=False, estimated_count=0):
        """Frequencies of labelled modes of one cable, such as its second antisymmetric in-plane mode, and their errors.

        Parameters
        ----------
        labels : tuple of tuple
            Number (from 1), kind and symmetry of each mode, such as (2, "in-plane", "antisymmetric"). Where the
            symmetry is None, the number counts modes of any symmetry.
        errors : bool
            True to estimate the errors (`Modes.errors`).
        estimated_count : float
            Estimate of how many modes lie below the highest labelled one. About so many are computed first, at most a
            quarter of those of a large model; then more until each labelled mode is among them.

        Returns
        -------
        frequency : list of float
            One for each label. [Hz]
        error : list of float
            Relative errors of these; empty unless asked for. [-]
        count : int
            Number of modes computed.

        Raises
        ------
        NoSolutionError
            The model has no such mode.
        ConvergenceError
            Too many modes of a large model, or an eigen-solution that failed.
        """
        batch, cable = self.among or (self, None)
        largest_count = batch.dof if batch.dof <= CABLE.all_modes_freedoms else batch.dof // 4
        count = max(_estimated_count(labels, batch.planes), min(ceil(estimated_count), largest_count))
        while True:
            frequency, error = batch._frequencies(count, labels, errors)
            if cable is not None:
                frequency, error = frequency[cable], error[cable]
            if not any(map(isnan, frequency)):
                return frequency, error, count
            modes = self.modes(count)
            if modes.complete:
                number, kind, symmetry = next(label for label, f in zip(labels, frequency, strict=True) if isnan(f))
                there, words = len(modes.select(kind, symmetry)), " ".join(word for word in (symmetry, kind) if word)
                raise NoSolutionError(f"the model has {there} {words} mode{'s' * (there != 1)}, not {number}")
            count *= 2

    def _frequencies(self, count, labels, errors):
        """Frequencies and errors of labelled modes among the lowest `count`, of all cables: lists, (..., labels) each.

        Not a number where a mode is not among them.
        """
        key = (count, labels, errors)
        if key not in self._frequency_cache:
            modes = self.modes(count)
            ordinals = {label[1:]: modes.ordinals(*label[1:]) for label in labels}
            found = np.stack([ordinals[kind, symmetry] == number for number, kind, symmetry in labels], axis=-2)
            unknown = np.where(found.any(axis=-1), 0.0, np.nan)

            def labelled(values):
                return unknown + np.where(found, values[..., None, :], 0.0).sum(axis=-1)

            frequency = labelled(modes.frequency)
            error = labelled(modes.errors) if errors else frequency[..., :0]
            self._frequency_cache[key] = frequency.tolist(), error.tolist()
        return self._frequency_cache[key]

    def lowest(self, count):
        """The `count` lowest `Modes`; all if the model has fewer.

        Raises
        ------
        ConvergenceError
            Too many modes of a large model, or an eigen-solution that failed.
        """
        planes = [plane for system in self.systems for plane in self._solve(system, min(count, system.dof))]
        return Modes(CombinedModes(planes, self), min(count, self.dof), count >= self.dof)

    def _solve(self, system, count):
        """At least the `count` lowest modes of cables in one plane, or in all directions if these are coupled.

        Small systems, and larger ones of which many modes are wanted, have dense matrices. These are solved apart for
        shapes that are symmetric and antisymmetric about mid-length, if the cable is its own mirror image: one
        `PlaneModes` for each kind of symmetry. Other systems are solved by Lanczos iteration. Raises as `lowest`.
        """
        dof, lead = system.dof, np.shape(self.length)
        if count == 0:
            return [PlaneModes(system, np.zeros((*lead, dof, 0)))]
        if dof <= CABLE.dense_freedoms or (count > dof // 4 and dof <= CABLE.all_modes_freedoms):
            if system.axes not in self._eigenvectors:
                subspaces = symmetry_subspaces(self._mesh, system.axes, self.state.mirror_symmetric)
                self._eigenvectors[system.axes] = [_eigenvectors(system, subspace) for subspace in subspaces]
            return [
                PlaneModes(system, subspace.shapes @ _refined(root, vectors, count), subspace.sign)
                for subspace, root, vectors in self._eigenvectors[system.axes]
            ]
        if count > dof // 4:
            raise ConvergenceError(
                f"{count} modes of a model with {dof} unknowns: "
                f"above {CABLE.all_modes_freedoms} unknowns at most a quarter of the modes can be computed"
            )
        shapes = [_lanczos(System(self.state.take(cable), system.axes), count) for cable in np.ndindex(lead)]
        return [PlaneModes(system, np.stack(shapes).reshape(*lead, dof, count))]


@lru_cache(maxsize=128)
def _estimated_count(labels, planes):
    """Estimated count of the lowest modes in some planes among which those of some labels are.

    Half of the modes have either symmetry, and where a cable moves in all directions half of them either direction.
    """
    directions = 1 if planes in ((IN_PLANE,), (OUT_OF_PLANE,)) else 2
    return max(number * directions * (2 if symmetry else 1) for number, _, symmetry in labels)


def _rounded_up(count):
    """The next of 3, 4, 6, 8, 12, 16, 24 ... modes."""
    power = 1 << max(count - 1, 3).bit_length()
    return 3 * power // 4 if count <= 3 * power // 4 else power


def _eigenvectors(system, subspace):
    """A subspace, R = B M P, and the eigenvectors of P^T M K^-1 M P = R^T R, lowest frequency first."""
    root = subspace.root(system)
    return subspace, root, np.linalg.eigh(-root.swapaxes(-1, -2) @ root)[1]


def _refined(root, vectors, count):
    """The `count` lowest eigenvectors after one step of inverse iteration, orthonormal, shape (..., k, count)."""
    iterated = root.swapaxes(-1, -2) @ (root @ vectors[..., :count])
    # orthogonalised from the lowest on: removes rounding errors of high modes along low ones
    return np.linalg.qr(iterated).Q


def _lanczos(system, count):
    """Shapes of the lowest modes of a large system by Lanczos iteration, shape (dof, count); raises as `lowest`."""
    dof, basis_size = system.dof, lanczos_basis(system.dof, count)
    if basis_size * dof > CABLE.lanczos_numbers:
        largest = max(CABLE.lanczos_numbers // basis_size, CABLE.all_modes_freedoms)
        raise ConvergenceError(
            f"{count} modes of a model with {dof} unknowns are too many to compute "
            f"(at most {largest} unknowns for so many modes): "
            f"take fewer elements, fewer of a higher order, or an accuracy instead"
        )
    return lanczos_modes(dof, lambda force: system.solve(force.reshape(-1, 1))[:, 0], system.mass.__matmul__, count)
