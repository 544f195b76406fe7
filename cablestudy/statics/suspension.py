"""Numeric description of a suspension: rigid bodies and free points on cables; and its equilibrium.

Bodies come first, free points (junctions) after them: a junction is a body without size, whose rotations are held.
Every array of numbers may have leading axes `...` of cases (heights of anchors, masses, ...) that share names and
connections.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.catenary import Catenary
from cablestudy.cable.records import is_computed, take_rows, with_computed
from cablestudy.cable.vectors import row_keys, times
from cablestudy.statics import block_stiffness, stability, tangent, uncertainty
from cablestudy.statics.links import Links, joined
from cablestudy.statics.tangent import GROUND

STATED = (
    "unstretched_length", "preload", "sag", "tension_to", "tension_from", "horizontal_tension", "max_tension",
)  # fmt: skip
AXES = ("x", "y", "z", "rx", "ry", "rz")
# dimensions that each array has for one case
CORES = {
    "gravity": 0, "position": 2, "rotation": 3, "attitude": 3, "mass": 1, "center": 2, "inertia": 3, "force": 2,
    "moment": 2, "eccentric_loads": 3, "attachment": 3, "axial_stiffness": 1, "cable_mass": 1, "value": 1,
    "force_density": 1, "cable_wind": 2, "link_stiffness": 1, "link_damping": 1, "link_length": 1,
    "load_positions": 2, "load_forces": 3, "load_masses": 2, "load_fractions": 2,
}  # fmt: skip
OF_CABLES = (
    "axial_stiffness", "cable_mass", "value", "force_density", "cable_wind", "load_positions", "load_forces",
    "load_masses", "load_fractions",
)  # fmt: skip


@dataclass(frozen=True)
class SuspendedSystem:
    """Bodies, junctions, cables and links; b bodies and junctions, c cables, l links.

    Attributes
    ----------
    gravity : ndarray, shape (...)
        Along -z. [m/s^2]
    body_names : tuple of str
        Bodies first, then junctions.
    position : ndarray, shape (..., b, 3)
        Reference points: where they are, or where the search begins. [m]
    rotation : ndarray, shape (..., b, 3, 3)
        Body axes to global axes, R = Rz(yaw) Ry(pitch) Rx(roll). [-]
    mass : ndarray, shape (..., b)
        [kg]
    center : ndarray, shape (..., b, 3)
        Center of mass from the reference point, body axes. [m]
    inertia : ndarray, shape (..., b, 3, 3)
        About the center of mass, body axes. [kg m^2]
    force, moment : ndarray, shape (..., b, 3)
        Dead loads at the reference point, global axes. [N], [N m]
    free : ndarray of bool, shape (b, 6)
        x y z rx ry rz (small rotations about global axes) that are not held; no rotation of a junction is free.
    junctions : int
        How many of the bodies, the last ones, are junctions.
    cable_names : tuple of str
    owner : ndarray of int, shape (c + l, 2)
        Of the cables, then of the links: body at end 1 ("from", the winch's) and at end 2 ("to"); GROUND where the end
        is fixed.
    attachment : ndarray, shape (..., c + l, 2, 3)
        Of each end: from the reference point in body axes, or in global axes where the end is fixed. [m]
    axial_stiffness, cable_mass : ndarray, shape (..., c)
        EA [N], mass per unstretched length [kg/m].
    stated : tuple of (str or None)
        What each cable states: one of STATED, or None.
    value : ndarray, shape (..., c)
        Of what is stated: unstretched length [m], preload (mean tension) [N], sag [m], tension at end 2 or end 1, its
        horizontal part, or the largest one [N].
    force_density : ndarray, shape (..., c), or None
        For form finding. [N/m]
    cable_wind : ndarray, shape (..., c, 3), or None
        Uniform load on each cable besides its weight, per unstretched length, global axes; a cable without mass has
        none. [N/m]
    link_names : tuple of str
    link_stiffness, link_damping, link_length : ndarray, shape (..., l), or None
        Of each link: k [N/m], c [N s/m], and the length at which it carries nothing, NaN where that is the
        distance in the equilibrium that is sought [m]. None without links.
    eccentric_loads : ndarray, shape (..., b, 3, 3), or None
        Sum over the dead loads on each body that act away from its reference point of p F^T: p from the reference point
        to where the load acts, body axes, F global; the loads themselves are part of `force`. [N m]
    load_positions : ndarray, shape (..., c, k), or None
        Of point loads on each cable: arc length from end 1 along the unstretched cable, ascending. [m]
    load_forces : ndarray, shape (..., c, k, 3), or None
        Point loads, global axes, the weight of their masses included. [N]
    load_masses : ndarray, shape (..., c, k), or None
        What moves with the cable there. [kg]
    attitude : ndarray, shape (..., b, 3, 3), or None
        Of bodies with two free rotations: rotation from which the third one is held, see `rest.with_held_rotations`;
        None where there is no such body.
    load_fractions : ndarray, shape (..., c, k), or None
        Share of the unstretched length at which a load is whatever that length; NaN where its position is an arc
        length. With it the order of the loads is free. [-]
    """

    gravity: np.ndarray
    body_names: tuple
    position: np.ndarray
    rotation: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    inertia: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    free: np.ndarray
    junctions: int
    cable_names: tuple
    owner: np.ndarray
    attachment: np.ndarray
    axial_stiffness: np.ndarray
    cable_mass: np.ndarray
    stated: tuple
    value: np.ndarray
    force_density: np.ndarray | None = None
    cable_wind: np.ndarray | None = None
    link_names: tuple = ()
    link_stiffness: np.ndarray | None = None
    link_damping: np.ndarray | None = None
    link_length: np.ndarray | None = None
    eccentric_loads: np.ndarray | None = None
    load_positions: np.ndarray | None = None
    load_forces: np.ndarray | None = None
    load_masses: np.ndarray | None = None
    load_fractions: np.ndarray | None = None
    attitude: np.ndarray | None = None

    @cached_property
    def _arrays(self):
        """Arrays of numbers by name."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self) if field.name in CORES)
        return {name: np.asarray(array, dtype=float) for name, array in pairs if array is not None}

    @cached_property
    def shape(self):
        """Shape of the cases: () for one."""
        return np.broadcast_shapes(*(array.shape[: array.ndim - CORES[name]] for name, array in self._arrays.items()))

    @cached_property
    def _full_arrays(self):
        """Arrays of numbers by name, in the full shape of cases."""
        pairs = ((name, array, array.shape[array.ndim - CORES[name] :]) for name, array in self._arrays.items())
        return {name: np.broadcast_to(array, self.shape + core) for name, array, core in pairs}

    @property
    def identity(self):
        """Hashable keys of cases of shape (n,): what they share, and a list with the numbers of each.

        Two cases are equal where both keys are.
        """
        arrays = self._full_arrays
        names = self.body_names, self.junctions, self.cable_names, self.stated, self.link_names, tuple(arrays)
        common = *names, self.free.tobytes(), self.owner.tobytes(), *(array.shape[1:] for array in arrays.values())
        return common, row_keys(arrays.values())

    @property
    def cable_gravity(self):
        """Uniform load over mass of each cable [m/s^2], shape (..., c) or (..., 1), and the direction against it.

        The direction is None where it is z of all cables, and else has the shape (..., c, 3).
        """
        gravity = np.asarray(self.gravity)[..., None]
        if self.cable_wind is None:
            return gravity, None
        upwards = gravity[..., None] * np.array([0.0, 0.0, 1.0])
        heavy = (self.cable_mass > 0)[..., None]
        upwards = upwards - np.where(heavy, self.cable_wind / np.where(heavy, self.cable_mass[..., None], 1.0), 0.0)
        total = np.sqrt((upwards**2).sum(axis=-1))
        loaded = total[..., None] > 0
        vertical = np.where(loaded, upwards / np.where(loaded, total[..., None], 1.0), np.array([0.0, 0.0, 1.0]))
        return total, vertical

    @property
    def of_cables(self):
        """Slice of the cables among cables and links, such as the rows of `owner`; the links are behind it."""
        return slice(len(self.cable_names))

    @property
    def bodies(self):
        """Number of bodies, junctions not counted."""
        return len(self.body_names) - self.junctions

    def broadcast(self, shape=None):
        """Copy of the cases with all arrays in the full shape of cases, or in another `shape` of the same size."""
        full, axes = self._full_arrays, len(self.shape)
        shape = self.shape if shape is None else shape
        return replace(self, **{name: array.reshape(shape + array.shape[axes:]) for name, array in full.items()})

    def take(self, index):
        """Copy of one case of a batch of shape (n,), or of some of them."""
        return replace(self, **{name: array[index] for name, array in self._full_arrays.items()})

    def with_cables(self, cables):
        """Copy with some of its cables only, by their indices, and with all links."""
        arrays = {name: array.take(cables, axis=array.ndim - CORES[name])
                  for name, array in self._arrays.items() if name in OF_CABLES}  # fmt: skip
        kept = [*cables, *range(len(self.cable_names), len(self.owner))]
        ends = {"owner": self.owner[kept], "attachment": self.attachment.take(kept, axis=-3)}
        names, quantities = (tuple(values[cable] for cable in cables) for values in (self.cable_names, self.stated))
        return replace(self, cable_names=names, stated=quantities, **ends, **arrays)

    def arms(self, rotation):
        """Vectors from the reference point of its owner to each end, global axes; from the origin where it is fixed.

        Parameters
        ----------
        rotation : ndarray, shape (..., b, 3, 3)

        Returns
        -------
        ndarray, shape (..., c + l, 2, 3)
            [m]
        """
        cable, end, body = tangent.held_ends(self)
        if not len(cable):
            return self.attachment
        shape = np.broadcast_shapes(rotation.shape[:-3], self.attachment.shape[:-3])
        arms = np.broadcast_to(self.attachment, (*shape, *self.attachment.shape[-3:])).copy()
        arms[..., cable, end, :] = times(rotation[..., body, :, :], self.attachment[..., cable, end, :])
        return arms

    def ends(self, position, rotation):
        """Positions of the ends of cables and links for a pose of the bodies.

        Parameters
        ----------
        position : ndarray, shape (..., b, 3)
            [m]
        rotation : ndarray, shape (..., b, 3, 3)

        Returns
        -------
        ndarray, shape (..., c + l, 2, 3)
            Global axes. [m]
        """
        fixed = self.owner == GROUND
        if fixed.all():
            return self.attachment
        return self.arms(rotation) + np.where(fixed[..., None], 0.0, position[..., self.owner, :])


@dataclass(frozen=True)
class Equilibrium:
    """A pose in which all forces on the free degrees of freedom balance, where its record says so.

    Attributes
    ----------
    suspension : SuspendedSystem
        Its `position` and `rotation` are those where the search began.
    position : ndarray, shape (..., b, 3)
        [m]
    rotation : ndarray, shape (..., b, 3, 3)
    catenary : Catenary
        Of all cables, shape (..., c).
    record : SearchRecord
        Of the pose search (`descent.SearchRecord`).
    links : Links or None
    """

    suspension: SuspendedSystem
    position: np.ndarray
    rotation: np.ndarray
    catenary: Catenary
    record: object
    links: Links | None = None
    _origin = None  # of some cases taken from a batch: this, and their indices there

    def take(self, index):
        """`Equilibrium` of one case of a batch of shape (n,), or of some, with its stiffness if that was computed.

        One case is taken once, from the first batch that has it: all who take it share it. With `np.newaxis` as index
        that of one case is a batch of it.
        """
        if index is np.newaxis:
            return self._taken(index)
        if self._origin is not None:
            batch, own = self._origin
            return batch.take(own[index])
        if np.ndim(index):
            return with_computed(self._taken(index), _origin=(self, np.arange(len(self.position))[index]))
        case = int(index)
        if case not in self._cases:
            self._cases[case] = self._taken(case)
        return self._cases[case]

    @cached_property
    def _cases(self):
        """Cases that were taken, by their indices: dict."""
        return {}

    def _taken(self, index):
        """`take` of this batch itself."""
        taken = Equilibrium(
            self.suspension.take(index),
            self.position[index],
            self.rotation[index],
            self.catenary.take(index),
            take_rows(self.record, index),
            take_rows(self.links, index),
        )
        if is_computed(self, "blocks"):
            ends = {name: getattr(self, name)[index] for name in ("end_forces", "end_stiffness")}
            with_computed(taken, blocks=self.blocks.of(index), **ends)
        return taken

    @property
    def lengths(self):
        """Unstretched lengths, shape (..., c). [m]"""
        return self.catenary.span.unstretched_length

    @property
    def ends(self):
        """Positions of the ends of cables and links, global axes, shape (..., c + l, 2, 3). [m]"""
        return self.suspension.ends(self.position, self.rotation)

    @cached_property
    def arms(self):
        """Vectors from the reference point of its owner to each end, global axes, shape (..., c + l, 2, 3). [m]"""
        return self.suspension.arms(self.rotation)

    @cached_property
    def longest(self):
        """Longest distance of the two ends of a cable or link, shape (...); 1 m where there is none. [m]"""
        chord = np.asarray(self.catenary.span.chord)
        longest = joined(chord, self.links and self.links.distance, -1).max(axis=-1)
        return np.where(longest > 0, longest, 1.0)

    @cached_property
    def end_forces(self):
        """Force of each cable and link on what holds its two ends, global axes, shape (..., c + l, 2, 3). [N]"""
        return joined(self.catenary.end_forces("global"), self.links and self.links.end_forces)

    @cached_property
    def end_stiffness(self):
        """Stiffness of end 2, end 1 fixed, of each cable and link, global axes, shape (..., c + l, 3, 3). [N/m]"""
        return joined(self.catenary.global_end_stiffness, self.links and self.links.end_stiffness)

    @cached_property
    def blocks(self):
        """Stiffness of all degrees of freedom, held ones too, by cable, link and body: `block_stiffness.Blocks`."""
        return tangent.stiffness_blocks(self.suspension, self.rotation, self.arms, self.end_forces, self.end_stiffness)

    @cached_property
    def stiffness(self):
        """Stiffness of the free degrees of freedom, in the order of `free.ravel()`, all loads counted, (..., d, d).

        `blocks.sparse` makes the same matrix of one case for a large net.
        """
        return block_stiffness.dense(self.blocks, self.suspension)

    @cached_property
    def body_stiffness(self):
        """Stiffness of each body at its reference point, all loads counted, shape (..., b - junctions, 6, 6).

        For small movements of this body, of its held degrees of freedom too, with the junctions following and all
        other bodies at rest. Rows x y z rx ry rz. [N/m, N/rad; N, N m/rad]
        """
        return block_stiffness.body_stiffness(self.blocks, self.suspension)

    @cached_property
    def stability(self):
        """Stability of the equilibrium, and which motion is not stable: `stability.Stability`."""
        return stability.stability_of(self)

    @cached_property
    def uncertainty(self):
        """Displacements and changes of tension due to rounding: `uncertainty.Uncertainty`."""
        return uncertainty.uncertainty_of(self)

    @cached_property
    def valid(self):
        """True where the search converged to a stable equilibrium, determined beyond rounding, shape (...)."""
        return self.record.converged & self.stability.stable & self.uncertainty.determined


def outward_tangents(equilibrium):
    """Unit tangents at the ends of the cables that point out of them, and the tensions there.

    Parameters
    ----------
    equilibrium : Equilibrium

    Returns
    -------
    direction : ndarray, shape (c, 2, 3)
        Zero where a cable has no tension.
    tension : ndarray, shape (c, 2)
        [N]
    """
    return tangents(equilibrium.end_forces[..., equilibrium.suspension.of_cables, :, :])


def tangents(forces):
    """`outward_tangents` from the forces that cables exert at their ends, (..., 3): shapes (..., 3) and (...)."""
    tension = np.sqrt((forces**2).sum(axis=-1))
    return -forces / np.where(tension > 0, tension, 1.0)[..., None], tension
