"""The cables of a suspension about their equilibrium: which of them have modes, their end stiffness, their meshes."""

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from cablestudy.cable.catenary import GAUSS_POINTS
from cablestudy.cable.damping import Damping, grows_with_modes
from cablestudy.cable.dynamics import of_batch
from cablestudy.cable.element import basis
from cablestudy.cable.meshes import edges_of_pieces, mesh_by_waves, mesh_segments
from cablestudy.cable.records import take_rows
from cablestudy.cable.steady_drag import SteadyDrag, uneven_drag
from cablestudy.system.condensed_cables import CondensedCables, laws_of
from cablestudy.system.coupling_damping import Strain
from cablestudy.system.superelement import Superelement
from cablestudy.system.tolerances import SYSTEM

STRAIGHT = np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3)) / 6  # inertia of a straight cable of unit mass at its ends
UNDAMPED = Damping()


@dataclass(frozen=True)
class FixedModel:
    """Elements that the scene states, the same for each cable.

    Attributes
    ----------
    elements, order : int
    mass : {"lumped", "consistent", "blended"}
    drag : SteadyDrag, optional
        Drag by a steady wind, of shape (c,), under which the elements are in equilibrium.
    """

    elements: int
    order: int = 1
    mass: str = "lumped"
    drag: SteadyDrag | None = None


class Cables:
    """All cables of a suspension about their equilibrium, or of many cases of it, one case after the other.

    Parameters
    ----------
    catenary : Catenary
        Of shape (c,).
    damping : Damping or sequence of Damping
        Of all cables, or of each: model, and ratio [-], loss_factor [-] or time [s]; viscous [N s/m^2].
    static : ndarray, shape (c, 3, 3), optional
        `Catenary.global_end_stiffness` of the cables, where it is known. [N/m]
    drag : SteadyDrag, optional
        As for `FixedModel`.
    planes : tuple of tuple of int, optional
        Axes of the chord frame along which cables move, in uncoupled groups, as ((0, 1), (2,)). Default: all.

    Attributes
    ----------
    among : (Cables, ndarray of int) or None
        The cables of which these were taken, and their indices there.
    """

    def __init__(self, catenary, damping, static=None, drag=None, planes=None):
        self.catenary, self.count, self._static = catenary, len(catenary.span.chord), static
        self._drag, self.planes, self.among = drag, planes, None
        self.damping = list(damping) if isinstance(damping, (list, tuple)) else [damping] * self.count

    def take(self, indices, catenary=None):
        """`Cables` of some of them, by their indices; what all need is computed for all at once.

        `catenary` is that of these cables, where it is known.
        """
        damping, drag = [self.damping[cable] for cable in indices], take_rows(self._drag, indices)
        taken = Cables(catenary or self.catenary.take(indices), damping, drag=drag, planes=self.planes)
        all_cables, own = self.among or (self, np.arange(self.count))
        taken.among = all_cables, own[indices]
        return taken

    @of_batch
    def heavy(self):
        """True for cables that move by themselves: those with mass, and no slack segment; shape (c,)."""
        return (np.asarray(self.catenary.span.mass) > 0) & ~self.catenary.slack

    @of_batch
    def shapeless(self):
        """True for cables with mass that hang slack without weight: nothing says where that mass is; shape (c,)."""
        return (np.asarray(self.catenary.span.mass) > 0) & self.catenary.slack

    @cached_property
    def modal(self):
        """True for cables with modal damping, shape (c,)."""
        return self.heavy & np.array([grows_with_modes(damping) for damping in self.damping], dtype=bool)

    @property
    def across(self):
        """Number of directions across themselves in which they move."""
        return 2 if self.planes is None else sum(len(axes) - (0 in axes) for axes in self.planes)

    @of_batch
    def folded(self):
        """True for cables that hang folded, and have no definite motion, shape (c,)."""
        return self.heavy & self.catenary.folded

    @cached_property
    def in_steady_wind(self):
        """True for cables in a steady wind that their elements follow, shape (c,)."""
        return np.zeros(self.count, dtype=bool) if self._drag is None else self.heavy & (self._drag.normal_drag > 0)

    def uneven_drag(self, cables):
        """Uneven drag of some cables, see `steady_drag.uneven_drag`; None where none of them is blown."""
        return uneven_drag(self._drag.take(cables)) if self.in_steady_wind[cables].any() else None

    @of_batch
    def travel_time(self):
        """Travel time of a transverse wave from end to end, zero without mass, shape (c,). [s]

        The integral of 1/speed over the stretched length by Gauss's rule, with the speed sqrt(T/m') and the mass m' per
        stretched length: over the unstretched length that of sqrt(m (1/T + 1/EA)).
        """
        gauss, span = basis(GAUSS_POINTS), self.catenary.span
        force = self.catenary.tension_at(gauss.points)
        tension = np.sqrt((force**2).sum(axis=-1))
        compliance = np.where(tension > 0, 1 / np.where(tension > 0, tension, 1.0), 0.0)
        compliance = compliance + 1 / span.axial_stiffness[:, None]
        return span.unstretched_length * (np.sqrt(compliance * span.mass[:, None]) @ gauss.weights)

    @of_batch
    def edges(self):
        """Edges of the pieces along which each cable bends little, shares of its length; see `meshes.pieces`."""
        return edges_of_pieces(self.catenary, self.heavy)

    @cached_property
    def point_masses(self):
        """Point masses of each cable, see `Span.point_masses`: list of tuple."""
        span = self.catenary.span
        if span.load_masses is None:
            return [()] * self.count
        return [span.take(i).point_masses if self.heavy[i] else () for i in range(self.count)]

    @cached_property
    def carried(self):
        """Mass on each cable over its own, shape (c,). [-]"""
        return np.array([sum(mass for _, mass in masses) for masses in self.point_masses])

    @of_batch
    def end_stiffness(self):
        """Static stiffness of the six ends, from the closed form, global axes, shape (c, 6, 6). [N/m]"""
        static = self.catenary.global_end_stiffness if self._static is None else self._static
        return np.block([[static, -static], [-static, static]])

    @property
    def mass(self):
        """Mass of each cable with what it carries, shape (c,). [kg]"""
        return self.catenary.span.mass * self.catenary.span.unstretched_length * (1 + self.carried)

    @property
    def straight_inertia(self):
        """Inertia of the six ends, the mass distributed as that of straight cables, shape (c, 6, 6). [kg]"""
        return self.mass[:, None, None] * STRAIGHT

    def element_without_mass(self, cable):
        """`Superelement` of a cable without mass, by its index."""
        damping, stiffness, span = self.damping[cable], self.end_stiffness[cable], self.catenary.span
        length = span.unstretched_length[cable]
        no_modes = np.zeros(0), np.zeros((0, 6)), np.zeros(0)
        inertia, strain = np.zeros((6, 6)), None
        if damping.model != "modal" and not self.catenary.slack[cable]:
            chord = span.frame[cable, 0]
            along = span.axial_stiffness[cable] / length * np.outer(chord, chord)
            amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
            elastic = np.block([[along, -along], [-along, along]])
            strain = Strain(damping.model, amount, np.zeros((0, 0)), np.zeros((0, 6)), elastic)
        viscous = damping.viscous * length * STRAIGHT
        return Superelement(*no_modes, stiffness, inertia, strain, residual_damping=viscous)

    def condensed_without_mass(self, cables):
        """`CondensedCables` of cables without mass, by their indices."""
        span, damping, count = self.catenary.span.take(cables), [self.damping[cable] for cable in cables], len(cables)
        along = np.sqrt(np.where(self.catenary.slack[cables], 0.0, span.axial_stiffness / span.unstretched_length))
        strain_root = along[:, None, None] * np.concatenate([-span.frame[:, :1], span.frame[:, :1]], axis=-1)
        viscous = np.array([law.viscous for law in damping]) * span.unstretched_length
        return CondensedCables(
            cables=cables,
            omega=np.zeros((count, 0)),
            coupling=np.zeros((count, 0, 6)),
            stiffness=self.end_stiffness[cables],
            inertia=np.zeros((count, 6, 6)),
            **laws_of(damping),
            viscous=np.zeros(count),
            strain_root=strain_root,
            added_damping=viscous[:, None, None] * STRAIGHT,
        )

    def meshes(self, orders):
        """Make a mesh for each of the c cables, from the sum of the polynomial orders of its elements.

        The sum along a piece of a cable, between two of its `edges`, says how many waves the elements of this piece
        resolve. It is given for the piece that a wave takes longest to pass. The other pieces get fewer elements, of
        the same order, in proportion to the time that a wave takes along them.

        Parameters
        ----------
        orders : ndarray, shape (c,)
            Sum of orders for each cable; it is rounded up to elements of equal, even order.

        Returns
        -------
        list of (Mesh or None)
            None for a cable without mass, or with a slack segment.
        """
        meshes = [None] * self.count
        for cable in np.flatnonzero(self.heavy).tolist():
            elements = ceil(orders[cable] / SYSTEM.highest_order)
            order = 2 * ceil(orders[cable] / elements / 2)  # even ones, so that many cables share a mesh
            of_cable = self.edges[cable], elements, order, self.point_masses[cable]
            meshes[cable] = mesh_by_waves(self.catenary, cable, *of_cable)
        return meshes


def fixed_meshes(cables, model):
    """One mesh for each cable with mass.

    Parameters
    ----------
    cables : Cables
    model : FixedModel
    """
    fraction = cables.catenary.segments.fraction
    return [
        mesh_segments(fraction[i], model.elements, model.order, model.mass, cables.point_masses[i]) if heavy else None
        for i, heavy in enumerate(cables.heavy.tolist())
    ]
