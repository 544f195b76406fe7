"""A discretised cable: tensions and directions at the Gauss points, displacements of the nodes."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

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
        """Displacement and tension at any positions along cables, from values at nodes and Gauss points.

        Parameters
        ----------
        positions : ndarray, shape (..., j)
            Unstretched arc length over unstretched length; at a point load it means the side of end 1. [-]

        Returns
        -------
        displacement : ndarray, shape (..., j, 3)
            From the straight chord to the cable, over the unstretched length, in the chord frame. [-]
        tension : ndarray, shape (..., j)
            Size of the tension vector, which changes linearly along each element by its weight; the change by an
            `uneven` load within the element is neglected. [N]
        """
        positions = np.broadcast_to(positions, (*np.shape(self.force), np.shape(positions)[-1]))
        element, local = self.mesh.located(positions)  # index of the element, and position in it from 0 to 1
        middle = np.take_along_axis(self.mid_forces, element[..., None], axis=-2)
        weight = np.take_along_axis(self.segment_weights, element, axis=-1)
        force = middle + ((local - 0.5) * weight)[..., None] * np.asarray(self.span.up)[..., None, :]
        nodes = self.mesh.element_nodes[element]  # shape (..., j, p + 1)
        nodal = np.take_along_axis(self.displacement, nodes.reshape(*nodes.shape[:-2], -1, 1), axis=-2)
        shares = lagrange(basis(self.mesh.order).nodes, local)[..., None]
        return (shares * nodal.reshape(*nodes.shape, 3)).sum(axis=-2), np.sqrt((force**2).sum(axis=-1))
