"""Bounds on the rounding of net forces: where a search for an equilibrium ends.

The net force on a body is a sum of terms that cancel, each with a rounding error of its own. With eps the relative
rounding of a number, a cable on the body contributes two: eps T (1 + P/chord), T its tension and P the largest
coordinate of its ends, whose rounding turns the force; and eps K L |e|, K its end stiffness, L its length and e its
strain, which the search carries from step to step. A link, whose extension is carried likewise, contributes
2 eps F for its force F, a dead load eps times its size. Moments have these errors times the arms. A search cannot bring
net forces below the sum of the errors (times `STATICS.sum_rounding`): `Bounds.least`.

Where lengths and coordinates of ends are changed by their own rounding, the force of a cable changes by eps K (L + P).
A state with net forces up to the sum of these changes too is the exact equilibrium of a suspension that differs by
rounding from the one described: `Bounds.most`. No search needs to go below this bound, and a search that can go no
further below it has found its answer.

Stated values have a relative rounding: of a tension that of the force of its cable; of a sag eps chord/sag besides.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.vectors import largest, size
from cablestudy.statics import tangent
from cablestudy.statics.links import joined
from cablestudy.statics.tolerances import STATICS


@dataclass(frozen=True)
class Bounds:
    """Bounds on the rounding of net forces, or of errors of stated values, which a search brings to zero.

    Attributes
    ----------
    least, most : ndarray
        Rounding of the sums alone, and rounding of the lengths and positions that enter the sums included. Of net
        forces and moments shape (..., b, 6) [N], [N m]; of relative errors of stated values shape (..., c) [-].
    """

    least: np.ndarray
    most: np.ndarray


def bounds(suspension, rotation, arms, ends, strain, cables, tension, links=None):
    """Size of the net force and moment on each body that is mere rounding, so that a search can end: `Bounds`.

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables and links (springs).
    rotation : ndarray, shape (..., b, 3, 3)
        Rotation matrices of the b bodies.
    arms : ndarray, shape (..., c + l, 2, 3)
        Vectors to both ends of the c cables and l links, from the reference point of the body that holds the end. [m]
    ends : ndarray, shape (..., c + l, 2, 3)
        Vectors to the same ends from the origin. [m]
    strain : ndarray, shape (..., c)
        Distance of the ends over the unstretched length, minus 1. [-]
    cables : Catenary
        Equilibria of the c cables, shape (..., c).
    tension : ndarray, shape (..., c)
        Largest tension in each cable, or an upper bound of it. [N]
    links : Links, optional
        Forces and stiffness of the links (springs); by default there are none.
    """
    least, most = _of_tensions(ends[..., suspension.of_cables, :, :], strain, cables, tension)
    if links is not None:
        of_links = of_link_forces(ends[..., len(suspension.cable_names) :, :, :], links)
        least, most = joined(least, of_links[0], axis=-1), joined(most, of_links[1], axis=-1)
    center, weight = tangent.weights(suspension, rotation)
    force, moment = size(suspension.force), size(suspension.moment)
    eccentricity = tangent.eccentric(suspension, rotation)
    moment = moment if eccentricity is None else moment + np.sqrt((eccentricity**2).sum(axis=(-1, -2)))
    dead_loads = np.stack([size(weight) + force, size(weight) * size(center) + moment], axis=-1)
    cable, end, body = tangent.held_ends(suspension)
    arm, least, most = size(arms[..., cable, end, :]), least[..., cable], most[..., cable]
    of_ends = np.stack([least, least * arm, most, most * arm], axis=-1)
    by_ends = tangent.on_bodies(of_ends, body, dead_loads.shape[-2])

    def of_all(of_ends):
        """Bound of three forces and three moments of each body from sums over its ends, of force and moment."""
        return STATICS.sum_rounding * STATICS.rounding * np.repeat(of_ends + dead_loads, 3, axis=-1)

    return Bounds(least=of_all(by_ends[..., :2]), most=of_all(by_ends[..., 2:]))


def of_stated(ends, strain, cables, quantities, value):
    """Relative error of a stated tension or sag that is mere rounding, so that a search can end: `Bounds` of (..., c).

    Parameters
    ----------
    ends : ndarray, shape (..., c, 2, 3)
        Vectors from the origin to both ends of the cables. [m]
    strain : ndarray, shape (..., c)
        Distance of the ends over the unstretched length, minus 1. [-]
    cables : Catenary
        Equilibria of the c cables, shape (..., c).
    quantities : sequence of (str or None), one per cable
        Name of the stated quantity; the result has no meaning where it is neither a tension nor a sag.
    value : ndarray, shape (..., c)
        Stated values. [N] or [m]
    """
    sag_stated = np.array([kind == "sag" for kind in quantities])
    tension = np.where(sag_stated, cables.mean_tension, value)
    of_sag = np.where(sag_stated, cables.span.chord / np.maximum(value, STATICS.tiny), 0.0)
    least, most = (
        STATICS.sum_rounding * STATICS.rounding * (of_force / np.maximum(tension, STATICS.tiny) + of_sag)
        for of_force in _of_tensions(ends, strain, cables, cables.max_tension)
    )
    return Bounds(least, most)


def _of_tensions(ends, strain, cables, tension):
    """Rounding of the force of each cable over eps: `Bounds.least` and `most`, shape (..., c). [N]"""
    length, coordinate = cables.span.unstretched_length, largest(largest(ends))
    stiffness = size(cables.end_stiffness.reshape(*length.shape, 9))
    least = tension * (1 + coordinate / cables.span.chord) + stiffness * length * np.abs(strain)
    return least, least + stiffness * (length + coordinate)


def of_link_forces(ends, links):
    """Rounding of the force of each of some `Links` over eps: `Bounds.least` and `most`, shape (..., l). [N]"""
    coordinate, least = largest(largest(ends)), 2 * np.abs(links.force)
    return least, least + links.stiffness * links.length + (links.stiffness + np.abs(links.across)) * coordinate


def largest_ratio(suspension, net, bound):
    """Largest net force on a free degree of freedom over its bound, shape (...). [-]"""
    ratio = np.where(suspension.free, np.abs(net), 0.0) / np.maximum(bound, STATICS.tiny)
    return largest(ratio).max(axis=-1)
