"""Modes of a cable in ascending frequency, those of all planes together."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.plane_modes import KINDS, SYMMETRIES, ascends, clusters, reordered


class CombinedModes:
    """Modes of all planes of one cable or of a batch, in ascending frequency.

    Parameters
    ----------
    motions : list of PlaneModes
    dynamics : Dynamics
    """

    def __init__(self, motions, dynamics):
        self._motions, self._dynamics = motions, dynamics
        self.square, self.kinds = (self._all(name) for name in ("square", "kinds"))
        self._order = None
        if not ascends(self.square) or clusters(self.square):
            self._sort()

    def _sort(self):
        """Ascending frequencies; modes that coincide in the order of kind and symmetry."""
        self._order = np.argsort(self.square, axis=-1, kind="stable")
        coinciding = clusters(self._sorted(self.square))
        symmetries = self._all("symmetries") if coinciding else None
        for cable, first, last in coinciding:
            chosen = self._order[cable][first:last].copy()
            names = symmetries[cable][chosen], self.kinds[cable][chosen]
            self._order[cable][first:last] = chosen[np.lexsort(names)]

    def _all(self, name):
        return np.concatenate([getattr(motion, name) for motion in self._motions], axis=-1)

    def _sorted(self, values):
        return reordered(values, self._order)

    @property
    def frequency(self):
        """Shape (..., k). [Hz]"""
        return np.sqrt(self._sorted(self.square)) * np.asarray(self._dynamics.unit_frequency)[..., None]

    @property
    def sorted_kinds(self):
        """Places in KINDS, shape (..., k)."""
        return self._sorted(self.kinds)

    @cached_property
    def errors(self):
        """Estimated relative errors of the frequencies, shape (..., k). [-]"""
        return self._sorted(self._all("error"))

    @cached_property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        return self._sorted(self._all("symmetries"))

    @cached_property
    def shapes(self):
        """Shape (..., nodes, 3, k). [1/sqrt(kg)]"""
        mesh, begin = self._dynamics.state.mesh, 0
        *lead, count = self.square.shape
        shapes = np.zeros((*lead, mesh.nodes, 3, count))
        for motion in self._motions:
            end = begin + motion.square.shape[-1]
            for place, axis in enumerate(motion.system.axes):
                shapes[..., axis, begin:end] = motion.signed[..., place, :]
            begin = end
        shapes /= np.sqrt(self._dynamics.mass * self._dynamics.length)[..., None, None, None]
        return self._in_order(shapes, -1)

    def _in_order(self, values, axis):
        """Values of each cable with its modes, along an axis, in ascending frequency."""
        for cable in np.ndindex(self.square.shape[:-1]) if self._order is not None else ():
            values[cable] = values[cable].take(self._order[cable], axis=axis)
        return values

    @cached_property
    def participation(self):
        """Shape (..., k, 3). [N/(m sqrt(kg))]"""
        return self._at_end("participation")

    @cached_property
    def driven(self):
        """Shape (..., k, 3). [N/(m sqrt(kg))]"""
        return self._at_end("driven")

    @cached_property
    def rigid(self):
        """Shape (..., k, 3). [N/(m sqrt(kg))]"""
        return self._at_end("rigid")

    def _at_end(self, name):
        dynamics, begin = self._dynamics, 0
        found = np.zeros((*self.square.shape, 3))
        for motion in self._motions:
            end = begin + motion.square.shape[-1]
            found[..., begin:end, list(motion.system.axes)] = getattr(motion, name)
            begin = end
        scale = np.asarray(dynamics.state.force / dynamics.length / np.sqrt(dynamics.mass * dynamics.length))
        return self._in_order(found * scale[..., None, None], -2)


@dataclass(frozen=True)
class Modes:
    """Modes in ascending frequency, of one cable or of a batch.

    Attributes
    ----------
    frequency : ndarray, shape (..., k)
        [Hz]
    kinds : ndarray of int, shape (..., k)
        Places in KINDS.
    complete : bool
        True when the model has no more modes.
    combined : CombinedModes
        Of the batch.
    cable : tuple of int
        Index of this cable in it.
    """

    frequency: np.ndarray
    kinds: np.ndarray
    complete: bool
    combined: CombinedModes
    cable: tuple = ()

    def __len__(self):
        return self.frequency.shape[-1]

    @property
    def shapes(self):
        """Chord frame, mass-normalised, ends included (at rest), shape (..., nodes, 3, k). [1/sqrt(kg)]"""
        return self.combined.shapes[self.cable][..., : len(self)]

    @property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        return self.combined.symmetries[self.cable][..., : len(self)]

    @property
    def errors(self):
        """Estimated relative discretisation errors of the frequencies (`PlaneModes.error`), shape (..., k). [-]"""
        return self.combined.errors[self.cable][..., : len(self)]

    @property
    def participation(self):
        """psi^T K21 e_j for a displacement of end 2 along axis j, chord frame, shape (..., k, 3). [N/(m sqrt(kg))]"""
        return self.combined.participation[self.cable][..., : len(self), :]

    @property
    def driven(self):
        """Participation with the mass coupling of a mass that is not lumped: -omega^2 psi^T (M22 u_j + M21 e_j)."""
        return self.combined.driven[self.cable][..., : len(self), :]

    @property
    def rigid(self):
        """Participation for a translation of the whole cable along axis j: -omega^2 psi^T M e_j."""
        return self.combined.rigid[self.cable][..., : len(self), :]

    @cached_property
    def kind(self):
        """Of one cable: "in-plane", "out-of-plane" or "axial" for each mode."""
        return tuple(KINDS[i] for i in self.kinds.tolist())

    @cached_property
    def symmetry(self):
        """Of one cable: "symmetric", "antisymmetric" or "mixed" for each mode."""
        return tuple(SYMMETRIES[i] for i in self.symmetries.tolist())

    def take(self, cable):
        """Those of one cable of a batch."""
        return Modes(self.frequency[cable], self.kinds[cable], self.complete, self.combined, (cable,))

    def first(self, count):
        """Only the lowest `count` modes."""
        if count >= len(self):
            return self
        return Modes(self.frequency[..., :count], self.kinds[..., :count], False, self.combined, self.cable)

    def numbered(self, number, kind, symmetry=None):
        """Mask of mode `number` (from 1) of a kind and symmetry, shape (..., k): true in one place, or in none."""
        chosen = self.kinds == KINDS.index(kind)
        if symmetry is not None:
            chosen = chosen & (self.symmetries == SYMMETRIES.index(symmetry))
        return chosen & (np.cumsum(chosen, axis=-1) == number)

    def select(self, kind=None, symmetry=None):
        """Indices of the modes of one cable of a kind and symmetry, ascending in frequency."""
        return [
            i
            for i in range(len(self))
            if (kind is None or self.kind[i] == kind) and (symmetry is None or self.symmetry[i] == symmetry)
        ]
