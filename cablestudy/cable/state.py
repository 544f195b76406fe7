"""A discretised cable: tensions and directions at the Gauss points, places of the nodes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.element import Mesh, basis, lagrange
from cablestudy.cable.span import Span


@dataclass(frozen=True)
class State:
    """A cable at the Gauss points and nodes of a mesh, or many cables on one mesh; chord frame.

    Attributes
    ----------
    mesh : Mesh
    span : Span
        Fields of shape (...).
    direction : ndarray, shape (..., n, q, 3)
        Unit tangent. [-]
    tension : ndarray, shape (..., n, q)
        In units of `force`. [-]
    stretch : ndarray, shape (..., n, q)
        |r'|. [-]
    displacement : ndarray, shape (..., nodes, 3)
        Of the nodes from the straight chord, in unstretched lengths. [-]
    force : float or ndarray, shape (...)
        Reference force. [N]
    mirror_symmetric : bool
        Whether each cable, with its elements, is its own mirror image at mid-length.
    """

    mesh: Mesh
    span: Span
    direction: np.ndarray
    tension: np.ndarray
    stretch: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    mirror_symmetric: bool

    def take(self, index):
        """One cable of a batch, or some of them."""
        fields = (self.direction, self.tension, self.stretch, self.displacement, self.force)
        return State(self.mesh, self.span.take(index), *(field[index] for field in fields), self.mirror_symmetric)

    @property
    def compliance(self):
        """force / EA, shape (...). [-]"""
        return self.force / np.asarray(self.span.axial_stiffness, dtype=float)

    @cached_property
    def mid_forces(self):
        """Tension vector at the middle of each element, chord frame, shape (..., n, 3). [N]"""
        mean = ((basis(self.mesh.order).weights * self.tension)[..., None] * self.direction).sum(axis=-2)
        return mean * np.asarray(self.force)[..., None, None]

    @cached_property
    def weight_forces(self):
        """Change of the tension vector along each element, chord frame, shape (..., n, 3). [N]

        In equilibrium N(s) is linear between point loads: dN/ds = m g along the vertical.
        """
        span = self.span
        return (np.asarray(span.weight)[..., None] * span.up)[..., None, :] * self.mesh.sizes[:, None]

    @cached_property
    def edge_tensions(self):
        """Tension at both ends of each element, shape (..., n, 2). [N]"""
        half = self.weight_forces / 2
        edges = np.stack([self.mid_forces - half, self.mid_forces + half], axis=-2)
        return np.sqrt((edges**2).sum(axis=-1))

    @property
    def max_tension(self):
        """Largest tension in equilibrium, at an end or at a load, shape (...). [N]

        |N(s)| is convex along each element, so that its maximum is at an end of one.
        """
        return self.edge_tensions.max(axis=(-2, -1))

    @property
    def min_tension(self):
        """Smallest tension in equilibrium, at an end, at a load or at the lowest point, shape (...). [N]"""
        up = np.asarray(self.span.up)[..., None, :]
        vertical = (self.mid_forces * up).sum(axis=-1)
        horizontal = np.sqrt(((self.mid_forces - vertical[..., None] * up) ** 2).sum(axis=-1))
        half = np.asarray(self.span.weight)[..., None] * self.mesh.sizes / 2
        return np.where(np.abs(vertical) < half, horizontal, self.edge_tensions.min(axis=-1)).min(axis=-1)

    def end_forces(self, frame="chord"):
        """Force of the cable on each end in equilibrium, shape (..., 2, 3); `frame` is "chord" or "global". [N]"""
        first = self.mid_forces[..., 0, :] - self.weight_forces[..., 0, :] / 2
        last = self.mid_forces[..., -1, :] + self.weight_forces[..., -1, :] / 2
        return self.span.in_frame(np.stack([first, -last], axis=-2), frame)


def interpolate(state, positions):
    """Displacement and tension of one cable between the nodes.

    Parameters
    ----------
    state : State
        In equilibrium.
    positions : ndarray, shape (j,)
        Unstretched arc length over unstretched length; at a load, the side of end 1. [-]

    Returns
    -------
    displacement : ndarray, shape (j, 3)
        From the chord, in unstretched lengths, chord frame. [-]
    tension : ndarray, shape (j,)
        Of the tension vector, linear along each element (`State.weight_forces`). [N]
    """
    mesh = state.mesh
    positions = np.asarray(positions, dtype=float)
    which = np.clip(np.searchsorted(mesh.edges, positions, side="left") - 1, 0, mesh.elements - 1)
    local = (positions - mesh.edges[which]) / mesh.sizes[which]
    nodal = state.displacement[mesh.element_nodes[which]]
    displacement = (lagrange(basis(mesh.order).nodes, local)[..., None] * nodal).sum(axis=-2)
    force = state.mid_forces[which] + (local - 0.5)[:, None] * state.weight_forces[which]
    return displacement, np.sqrt((force**2).sum(axis=-1))


def sag(state, start):
    """Vertical distance from the chord down to one cable at mid-span.

    Parameters
    ----------
    state : State
    start : float
        Arc length at mid-span of the continuous cable, over unstretched length; used as it is for a vertical cable. [-]

    Returns
    -------
    float
        [m]
    """
    span = state.span
    up, stretch = np.asarray(span.up), 1 + float(span.chord_strain)

    def vertical_and_horizontal(position):
        place = interpolate(state, np.array([position]))[0][0]
        place[0] += stretch * (position - 0.5)
        return place @ up, place[0] * span.cosine - place[1] * span.sine

    position = start
    if span.cosine > 1e-9 and abs(vertical_and_horizontal(start)[1]) > 1e-16:
        from scipy.optimize import brentq

        position = brentq(lambda s: vertical_and_horizontal(s)[1], 0.0, 1.0, xtol=1e-15)
    return -float(vertical_and_horizontal(position)[0] * span.unstretched_length)
