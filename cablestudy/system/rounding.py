"""Bounds on the rounding of net forces: where a search for an equilibrium ends.

A net force is a sum of terms that cancel. Of each cable on a body it has the rounding of its tension T and of the place
P of its ends, which turns the force: eps T (1 + P/chord); and of its strain e, which the search carries from step to
step: eps K L e, with the end stiffness K and the length L. Moments have these times their arms. A search cannot go
below that: `Bounds.least`.

Values that cables state have the rounding of their tension, a sag that of the place of the cable too.

Of a link, whose vector and extension are carried from step to step, it has eps F.

Where lengths and places of ends are changed by their own rounding, the force changes by eps K (L + P). A state with
net forces up to that is the exact equilibrium of a suspension that differs by rounding from the one described:
`Bounds.most`. No search needs to go below that, and one that can go no further has found its answer there.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system import tangent
from cablestudy.system.links import joined
from cablestudy.system.rigid import size
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class Bounds:
    """Rounding of what a search brings to zero.

    Attributes
    ----------
    least, most : ndarray
        Of the sums, and of the lengths and places they are computed from: of net forces and moments, shape
        (..., b, 6) [N], [N m]; or of values, shape (..., c) [-].
    """

    least: np.ndarray
    most: np.ndarray


def bounds(suspension, rotation, arms, ends, strain, cables, tension, links=None):
    """`Bounds` of the net forces of a suspension.

    Parameters
    ----------
    suspension : SuspendedSystem
    rotation : ndarray, shape (..., b, 3, 3)
    arms, ends : ndarray, shape (..., c + l, 2, 3)
        Of the ends of cables and links, from their owners and from the origin. [m]
    strain : ndarray, shape (..., c)
        Distance of the ends over the unstretched length less 1. [-]
    cables : Catenary
        Of shape (..., c).
    tension : ndarray, shape (..., c)
        Largest one of each cable, or what is known of it. [N]
    links : Links, optional
    """
    of_cables = _of_tensions(ends[..., suspension.of_cables, :, :], strain, cables, tension)
    of_links = (None, None) if links is None else of_springs(ends[..., len(suspension.cable_names) :, :, :], links)
    least, most = (joined(*parts, axis=-1) for parts in zip(of_cables, of_links, strict=True))
    center, weight = tangent.weights(suspension, rotation)
    dead = np.stack([
        size(weight) + size(suspension.force), size(weight) * size(center) + size(suspension.moment)
    ], axis=-1)  # fmt: skip
    cable, end = np.nonzero(suspension.owner != tangent.GROUND)
    body, arm = suspension.owner[cable, end], size(arms)[..., cable, end]

    def summed(of_cables):
        force = of_cables[..., cable]
        total = np.zeros((*force.shape[:-1], *dead.shape[-2:])) + dead
        np.add.at(total, (..., body, slice(None)), np.stack([force, force * arm], axis=-1))
        return SYSTEM.sum_rounding * SYSTEM.rounding * np.repeat(total, 3, axis=-1)

    return Bounds(summed(least), summed(most))


def of_values(ends, strain, cables, given, value):
    """Relative rounding of what cables state: `Bounds` of shape (..., c), infinite where a cable has no tension.

    Parameters
    ----------
    ends, strain, cables
        As for `bounds`.
    given : sequence of (str or None), one per cable
    value : ndarray, shape (..., c)
    """
    sags = np.array([kind == "sag" for kind in given])
    tension = np.where(sags, cables.mean_tension, value)
    deep = np.where(sags, cables.span.chord / np.maximum(value, SYSTEM.tiny), 0.0)
    parts = (
        part / np.maximum(tension, SYSTEM.tiny) + deep
        for part in _of_tensions(ends, strain, cables, cables.max_tension)
    )
    return Bounds(*(SYSTEM.sum_rounding * SYSTEM.rounding * part for part in parts))


def _of_tensions(ends, strain, cables, tension):
    """Rounding of the force of each cable over that of a number: least and most, shape (..., c). [N]"""
    length, place = cables.span.unstretched_length, np.abs(ends).max(axis=(-1, -2))
    stiffness = np.sqrt((cables.end_stiffness**2).sum(axis=(-1, -2)))
    least = tension * (1 + place / cables.span.chord) + stiffness * length * np.abs(strain)
    return least, least + stiffness * (length + place)


def of_springs(ends, links):
    """Rounding of the force of each of some `Links` over that of a number: least and most, shape (..., l). [N]"""
    place, least = np.abs(ends).max(axis=(-1, -2)), 2 * np.abs(links.force)
    return least, least + links.stiffness * links.length + (links.stiffness + np.abs(links.across)) * place


def over(suspension, net, bound):
    """Largest net force on a free degree of freedom over its bound, shape (...). [-]"""
    share = np.where(suspension.free, np.abs(net), 0.0) / np.maximum(bound, SYSTEM.tiny)
    return share.max(axis=(-1, -2))
