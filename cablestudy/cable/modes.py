"""Modes of a cable in ascending frequency, those of all planes together."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.plane_modes import KINDS, SYMMETRIES, ascends, clusters, reordered


class CombinedModes:
    """Modes of all planes of one cable or of a batch, in ascending frequency.

    Parameters
    ----------
    planes : list of PlaneModes
    dynamics : Dynamics
    """

    def __init__(self, planes, dynamics):
        self._planes, self._found, self._order = planes, {}, None
        self.unit_frequency = np.asarray(dynamics.unit_frequency)
        self.root_mass = np.sqrt(np.asarray(dynamics.mass * dynamics.length))
        self.unit_stiffness = np.asarray(dynamics.state.force / dynamics.length)
        square = self._joined("square")
        if not ascends(square) or clusters(square):
            self._order = self._ascending(square)

    def _ascending(self, square):
        """Order of ascending frequency; modes that coincide in the order of kind and symmetry."""
        order = np.argsort(square, axis=-1, kind="stable")
        coinciding = clusters(reordered(square, order))
        if coinciding:
            kinds, symmetries = self._joined("kinds"), self._joined("symmetries")
        for cable, first, last in coinciding:
            chosen = order[cable][first:last].copy()
            order[cable][first:last] = chosen[np.lexsort((symmetries[cable][chosen], kinds[cable][chosen]))]
        return order

    def values(self, name):
        """A property of `PlaneModes`, with all three components where it has some of them; the modes are last."""
        if name not in self._found:
            values = self._joined(name)
            self._found[name] = values if self._order is None else reordered(values, self._order)
        return self._found[name]

    def _joined(self, name):
        parts = [getattr(plane, name) for plane in self._planes]
        batch = self._planes[0].square.ndim
        if parts[0].ndim == batch:
            return np.concatenate(parts, axis=-1)
        *lead, _, _ = parts[0].shape
        whole, begin = np.zeros((*lead, 3, sum(part.shape[-1] for part in parts))), 0
        for plane, part in zip(self._planes, parts, strict=True):
            end = begin + part.shape[-1]
            whole[..., list(plane.system.axes), begin:end] = part
            begin = end
        return whole


@dataclass(frozen=True)
class Modes:
    """Modes in ascending frequency, of one cable or of a batch."""

    combined: CombinedModes  # of the batch
    count: int  # how many of them, from the lowest
    complete: bool  # whether the model has no more modes
    cable: tuple = ()  # index of this cable in the batch

    def __len__(self):
        return self.count

    def _values(self, name):
        return self.combined.values(name)[self.cable][..., : self.count]

    @cached_property
    def frequency(self):
        """Shape (..., k). [Hz]"""
        return np.sqrt(self._values("square")) * self.combined.unit_frequency[self.cable][..., None]

    @property
    def errors(self):
        """Estimated relative discretisation errors of the frequencies (`PlaneModes.errors`), shape (..., k). [-]"""
        return self._values("errors")

    @property
    def kinds(self):
        """Places in KINDS, shape (..., k)."""
        return self._values("kinds")

    @property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        return self._values("symmetries")

    @cached_property
    def shapes(self):
        """Chord frame, mass-normalised, ends included (at rest), shape (..., nodes, 3, k). [1/sqrt(kg)]"""
        return self._values("signed") / self.combined.root_mass[self.cable][..., None, None, None]

    @property
    def participation(self):
        """psi^T K21 e_j for a displacement of end 2 along axis j, chord frame, shape (..., k, 3). [N/(m sqrt(kg))]

        Less omega^2 psi^T M21 e_j where the mass is not lumped (`PlaneModes.participation`).
        """
        unit = (self.combined.unit_stiffness / self.combined.root_mass)[self.cable]
        return np.ascontiguousarray((self._values("participation") * unit[..., None, None]).swapaxes(-1, -2))

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
        return replace(self, cable=(cable,))

    def first(self, count):
        """Only the lowest `count` modes."""
        return self if count >= self.count else replace(self, count=count, complete=False)

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
