"""A discretised cable: tensions and directions at the Gauss points, displacements of the nodes."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.bracketing import zeros_between
from cablestudy.cable.element import Mesh, basis, lagrange
from cablestudy.cable.segment import SegmentedCable
from cablestudy.cable.span import Span


@dataclass(frozen=True)
class State(SegmentedCable):
    """A cable at the Gauss points and nodes of a mesh, or many cables on one mesh; chord frame."""

    mesh: Mesh
    span: Span  # fields of shape (...)
    direction: np.ndarray  # unit tangent, shape (..., n, q, 3) [-]
    tension: np.ndarray  # in units of `force`, shape (..., n, q) [-]
    displacement: np.ndarray  # of the nodes from the chord, in unstretched lengths, shape (..., nodes, 3) [-]
    force: np.ndarray  # reference force, shape (...) [N]
    mirror_symmetric: bool  # whether each cable, with its elements, is its own mirror image at mid-length
    uneven: np.ndarray | None = None  # load on each element besides weight and point loads, shape (..., n, 3) [N]

    def take(self, index):
        """`State` of one cable of a batch, or of several."""
        names = ("direction", "tension", "displacement", "force", "uneven")
        arrays = {name: getattr(self, name)[index] for name in names if getattr(self, name) is not None}
        return replace(self, span=self.span.take(index), **arrays)

    @property
    def planar(self):
        """True when no load leaves the plane of chord and vertical: motion in it and out of it decouple."""
        return self.uneven is None and self.span.planar

    @property
    def half_changes(self):
        """Half of the changes of tension over each segment, see `SegmentedCable.half_changes`."""
        changes = super().half_changes
        return changes if self.uneven is None else changes - self.uneven / 2

    @cached_property
    def edge_tensions(self):
        """Tensions at the ends of each segment, see `SegmentedCable.edge_tensions`."""
        if self.uneven is None:
            return super().edge_tensions
        middle, half = self.mid_forces, self.half_changes
        return np.sqrt((np.stack([middle - half, middle + half], axis=-2) ** 2).sum(axis=-1))

    @property
    def compliance(self):
        """force / EA, shape (...). [-]"""
        return self.force / np.asarray(self.span.axial_stiffness, dtype=float)

    @cached_property
    def stretch(self):
        """|r'| = 1 + T/EA, shape (..., n, q). [-]"""
        return 1 + np.asarray(self.compliance)[..., None, None] * self.tension

    @cached_property
    def mid_forces(self):
        """Tension vector at the middle of each element, chord frame, shape (..., n, 3). [N]"""
        mean = ((basis(self.mesh.order).weights * self.tension)[..., None] * self.direction).sum(axis=-2)
        return mean * np.asarray(self.force)[..., None, None]

    @cached_property
    def segment_weights(self):
        """Weight of each element, shape (..., n). [N]

        In equilibrium N(s) is linear between point loads: dN/ds = m g along the vertical.
        """
        return np.asarray(self.span.weight)[..., None] * self.mesh.sizes

    @property
    def edges(self):
        """Ends of the elements, shares of the unstretched length, shape (n + 1,). [-]"""
        return self.mesh.edges

    def at(self, positions):
        """Displacements and tensions along one cable, by `interpolate`; tensions are sizes, not vectors."""
        return interpolate(self, positions)


def interpolate(state, positions):
    """Interpolate displacement and tension at any positions along cables, from values at nodes and Gauss points.

    Parameters
    ----------
    state : State
        Elements in equilibrium, fields of shape (...).
    positions : ndarray, shape (..., j)
        Unstretched arc length over unstretched length; at a point load it means the side of end 1. [-]

    Returns
    -------
    displacement : ndarray, shape (..., j, 3)
        From the straight chord to the cable, over the unstretched length, in the chord frame. [-]
    tension : ndarray, shape (..., j)
        Size of the tension vector, which changes linearly along each element by its weight; the change by an `uneven`
        load within the element is neglected. [N]
    """
    positions = np.broadcast_to(positions, (*np.shape(state.force), np.shape(positions)[-1]))
    element, local = state.mesh.located(positions)  # index of the element, and position in it from 0 to 1
    middle = np.take_along_axis(state.mid_forces, element[..., None], axis=-2)
    weight = np.take_along_axis(state.segment_weights, element, axis=-1)
    force = middle + ((local - 0.5) * weight)[..., None] * np.asarray(state.span.up)[..., None, :]
    return _displacement(state.mesh, state.displacement, element, local), np.sqrt((force**2).sum(axis=-1))


def _displacement(mesh, displacement, element, local):
    """Displacements at positions in elements, shape (..., j, 3), interpolated from those of the nodes.

    `element` and the position `local` in it, both of shape (..., j), are as in `Mesh.located`.
    """
    nodes = mesh.element_nodes[element]  # shape (..., j, p + 1)
    nodal = np.take_along_axis(displacement, nodes.reshape(*nodes.shape[:-2], -1, 1), axis=-2)
    return (lagrange(basis(mesh.order).nodes, local)[..., None] * nodal.reshape(*nodes.shape, 3)).sum(axis=-2)


def sag(state, start):
    """Vertical distance from the chord down to each cable of elements at mid-span, halfway along the horizontal.

    Mid-span is searched for along the elements, unless `start` is there already to rounding. A vertical cable has no
    mid-span: its sag is taken at `start`.

    Parameters
    ----------
    state : State
        Elements in equilibrium; fields of shape (n,), or of one cable.
    start : ndarray, shape (n,) or ()
        Mid-span of the same cable in closed form: arc length over unstretched length (`Catenary.middle`). [-]

    Returns
    -------
    ndarray, shape (n,) or ()
        [m]
    """
    if not np.shape(state.force):
        return sag(state.take(None), np.array([start]))[0]
    span = state.span
    stretch, cosine, sine = (np.asarray(field) for field in (1 + span.chord_strain, span.cosine, span.sine))

    def from_mid_chord(position, index):
        """Vectors from the middle of the chord to m of the cables, chord frame, (m, 3), in unstretched lengths."""
        element, local = state.mesh.located(position[:, None])
        vector = _displacement(state.mesh, state.displacement[index], element, local)[:, 0]
        vector[:, 0] += stretch[index] * (position - 0.5)
        return vector

    def horizontal_distance(position, index):
        vector = from_mid_chord(position, index)
        return vector[:, 0] * cosine[index] - vector[:, 1] * sine[index]

    position, all_cables = np.array(start, dtype=float), np.arange(len(stretch))
    # neither upright, where no distance is horizontal, nor already there, except for rounding
    unsolved = np.flatnonzero((cosine > 1e-9) & (np.abs(horizontal_distance(position, all_cables)) > 1e-16))
    if len(unsolved):
        ends = np.zeros(len(unsolved)), np.ones(len(unsolved))
        position[unsolved] = zeros_between(horizontal_distance, *ends, unsolved)
    return -(from_mid_chord(position, all_cables) * span.up).sum(axis=-1) * span.unstretched_length
