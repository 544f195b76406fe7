"""Links: springs and dashpots between two points, without mass.

With d the distance of the two points, t the unit vector from the first to the second, and l the length at which the
spring carries nothing, the force F along the link (positive in tension; in compression it pushes), its tangent K and
the damping C of a movement of one end relative to the other are

    F = k (d - l),    K = k t t^T + F/d (I - t t^T),    C = c t t^T,

and the energy is k (d - l)^2/2. A link with l = 0 is a mount that resists any movement of one point relative to the
other: K = k I and C = c I at any distance, and at none.

A link whose length is not stated (NaN) is mounted in the reference state: there it carries nothing, and is no
part of the search; its length is the distance that this state has.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.vectors import size
from cablestudy.statics.tolerances import STATICS


@dataclass(frozen=True)
class Links:
    """The links of a suspension in a state, l of them.

    Attributes
    ----------
    vector : ndarray, shape (..., l, 3)
        From the first place to the second. [m]
    extension : ndarray, shape (..., l)
        Distance less length. Both keep their digits while a search changes them by little. [m]
    stiffness, damping, length : ndarray, shape (..., l)
        [N/m], [N s/m], [m]
    """

    vector: np.ndarray
    extension: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    length: np.ndarray

    @classmethod
    def of(cls, suspension, vector, extension):
        """`Links` of a `SuspendedSystem` in a state; None where it has none."""
        if not suspension.link_names:
            return None
        length, damping = np.nan_to_num(suspension.link_length), suspension.link_damping
        has_length = ~np.isnan(suspension.link_length)  # the others carry nothing yet
        stiffness, extension = (np.where(has_length, value, 0.0) for value in (suspension.link_stiffness, extension))
        extension = np.where(has_length & (length == 0), size(vector), extension)
        return cls(vector, extension, stiffness, damping, length)

    @cached_property
    def distance(self):
        """d, shape (..., l). [m]"""
        return size(self.vector)

    @property
    def force(self):
        """F, shape (..., l). [N]"""
        return self.stiffness * self.extension

    @cached_property
    def direction(self):
        """t, shape (..., l, 3); zero where the two points coincide."""
        return self.vector / np.maximum(self.distance, STATICS.tiny)[..., None]

    @property
    def across(self):
        """F/d, shape (..., l). [N/m]"""
        distance = np.maximum(self.distance, np.maximum(STATICS.nearest_link_ends * self.length, STATICS.tiny))
        return self.stiffness * np.where(self.length > 0, self.extension / distance, 1.0)

    @property
    def end_forces(self):
        """Force of each link on what holds its two ends, global axes, shape (..., l, 2, 3). [N]"""
        on_first = self.force[..., None] * self.direction
        return np.stack([on_first, -on_first], axis=-2)

    @property
    def end_stiffness(self):
        """K, global axes, shape (..., l, 3, 3). [N/m]"""
        return _along_and_across(self.direction, self.stiffness, self.across)

    @property
    def end_damping(self):
        """C, global axes, shape (..., l, 3, 3). [N s/m]"""
        return _along_and_across(self.direction, self.damping, np.where(self.length > 0, 0.0, self.damping))

    @property
    def energy(self):
        """Shape (..., l). [J]"""
        return self.force * self.extension / 2


def _along_and_across(direction, along, across):
    """Matrix a t t^T + b (I - t t^T) of a direction t, a along it and b across it, shape (..., 3, 3)."""
    projection = direction[..., :, None] * direction[..., None, :]
    return across[..., None, None] * np.eye(3) + (along - across)[..., None, None] * projection


def joined(of_cables, of_links, axis=-3):
    """Values of all cables and then of all links, along an axis; without links (None) those of the cables."""
    return of_cables if of_links is None else np.concatenate([of_cables, of_links], axis=axis)
