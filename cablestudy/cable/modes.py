"""Modes of a cable in ascending frequency, those of all planes together."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.plane_modes import KINDS, SYMMETRIES, ascends, coincident, reordered


class CombinedModes:
    """Modes of all planes of one cable or of a batch, in ascending frequency.

    Parameters
    ----------
    planes : list of PlaneModes
    dynamics : Dynamics
    """

    def __init__(self, planes, dynamics):
        self._planes, self._cache, self._order = planes, {}, None
        self.unit_frequency = np.asarray(dynamics.unit_frequency)
        self.root_mass = np.sqrt(np.asarray(dynamics.mass * dynamics.length))
        self.unit_stiffness = np.asarray(dynamics.state.force / dynamics.length)
        square = self._concatenated("square")
        if not ascends(square) or coincident(square).any():
            self._order = self._ascending_order(square)

    def _ascending_order(self, square):
        """Order of ascending frequency; modes that coincide in the order of kind and symmetry."""
        order = np.argsort(square, axis=-1, kind="stable")
        coincides = coincident(reordered(square, order))
        if not coincides.any():
            return order
        run = np.cumsum(~coincides, axis=-1)  # those that coincide have one number
        symmetries, kinds = (reordered(self._concatenated(name), order) for name in ("symmetries", "kinds"))
        return np.take_along_axis(order, np.lexsort((symmetries, kinds, run)), axis=-1)

    def values(self, name):
        """Values of a property of `PlaneModes` in ascending frequency, shape (..., k) or (..., 3, k).

        A property with the components that move has zeros for the others.
        """
        if name not in self._cache:
            values = self._concatenated(name)
            self._cache[name] = values if self._order is None else reordered(values, self._order)
        return self._cache[name]

    def _concatenated(self, name):
        """Values of a property of `PlaneModes`, as `values`, plane after plane."""
        by_plane = [getattr(plane, name) for plane in self._planes]
        if by_plane[0].ndim == self._planes[0].square.ndim:  # one number for each mode
            return np.concatenate(by_plane, axis=-1)
        *lead, _, _ = by_plane[0].shape
        combined, begin = np.zeros((*lead, 3, sum(values.shape[-1] for values in by_plane))), 0
        for plane, values in zip(self._planes, by_plane, strict=True):
            end = begin + values.shape[-1]
            combined[..., list(plane.system.axes), begin:end] = values
            begin = end
        return combined


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
        """Values of the lowest modes of this cable by their name in `combined`, shape (..., k)."""
        return self.combined.values(name)[self.cable][..., : self.count]

    @cached_property
    def frequency(self):
        """Natural frequencies, shape (..., k). [Hz]"""
        return np.sqrt(self._values("square")) * self.combined.unit_frequency[self.cable][..., None]

    @property
    def errors(self):
        """Estimated relative discretisation errors of the frequencies (`PlaneModes.errors`), shape (..., k). [-]"""
        return self._values("errors")

    @property
    def kinds(self):
        """Kind of each mode, an index of KINDS, shape (..., k)."""
        return self._values("kinds")

    @property
    def symmetries(self):
        """Symmetry of each mode, an index of SYMMETRIES, shape (..., k)."""
        return self._values("symmetries")

    @cached_property
    def shapes(self):
        """Mass-normalised shapes, chord frame, ends included (at rest), shape (..., nodes, 3, k). [1/sqrt(kg)]"""
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
        """Kind of each mode of one cable: "in-plane", "out-of-plane" or "axial", a tuple."""
        return tuple(KINDS[i] for i in self.kinds.tolist())

    @cached_property
    def symmetry(self):
        """Symmetry of each mode of one cable: "symmetric", "antisymmetric" or "mixed", a tuple."""
        return tuple(SYMMETRIES[i] for i in self.symmetries.tolist())

    def take(self, cable):
        """`Modes` of one cable of a batch."""
        return replace(self, cable=(cable,))

    def first(self, count):
        """`Modes` with the lowest `count` only."""
        return self if count >= self.count else replace(self, count=count, complete=False)

    def ordinals(self, kind, symmetry=None):
        """Number (from 1) of each mode among those of a kind and symmetry, shape (..., k); 0 of the others."""
        matches = self.kinds == KINDS.index(kind)
        if symmetry is not None:
            matches = matches & (self.symmetries == SYMMETRIES.index(symmetry))
        return np.cumsum(matches, axis=-1) * matches

    def select(self, kind=None, symmetry=None):
        """Indices of the modes of one cable of a kind and symmetry, ascending in frequency."""
        return [
            i
            for i in range(len(self))
            if (kind is None or self.kind[i] == kind) and (symmetry is None or self.symmetry[i] == symmetry)
        ]
