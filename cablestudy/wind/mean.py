"""The mean wind on a suspension: forces on bodies and cables, and the equilibrium that they lead to.

With u the wind along the axes of a body and C_d A_k the drag areas that it shows along them, the force on its centre of
pressure is

    f_k = rho/2 C_d A_k |u| u_k,

in body axes. Of the wind on a cable only the part u_n across its chord counts, and the force per stretched length is
rho/2 C_d d |u_n| u_n, taken as uniform along the cable. Both depend on how bodies and cables stand in the wind, so the
equilibrium is sought for fixed forces that are computed again where it is found, until they agree. The linear model
about it takes them as dead loads: that they change with the attitude of bodies and cables is no part of its stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.steady_drag import Profile
from cablestudy.system.descent import DISAGREED, ROUNDED
from cablestudy.system.equilibria import pose
from cablestudy.system.rigid import size
from cablestudy.system.tangent import GROUND
from cablestudy.system.tolerances import SYSTEM
from cablestudy.wind.tolerances import WIND


@dataclass(frozen=True)
class Drag:
    """Wind, and what of a suspension it meets; `...` are the axes of cases.

    Attributes
    ----------
    velocity : ndarray, shape (..., 3)
        Mean wind, global axes. [m/s]
    density : ndarray, shape (...)
        Of the air. [kg/m^3]
    cables : ndarray, shape (..., c)
        Drag coefficient times diameter of each cable; zero where the wind on it is left out. [m]
    bodies : ndarray, shape (..., b, 3)
        Drag coefficient times area along each axis of each body and junction. [m^2]
    centers : ndarray, shape (..., b, 3)
        Centres of pressure from the reference points, body axes. [m]
    stretched : bool
        Whether the length of a cable that the wind meets is the stretched one, or the unstretched one.
    profile : Profile or None
        How its pressure changes with the height; None where it does not.
    """

    velocity: np.ndarray
    density: np.ndarray
    cables: np.ndarray
    bodies: np.ndarray
    centers: np.ndarray
    stretched: bool = True
    profile: Profile | None = None

    def take(self, place):
        """That of one case."""
        parts = (self.velocity, self.density, self.cables, self.bodies, self.centers)
        profile = self.profile and self.profile.take(place)
        return Drag(*(np.asarray(part)[place] for part in parts), self.stretched, profile)


def body_forces(drag, rotation):
    """Mean force on each body at its centre of pressure [N], and the arm of that centre [m], global axes.

    Parameters
    ----------
    drag : Drag
    rotation : ndarray, shape (..., b, 3, 3)

    Returns
    -------
    force, arm : ndarray, shape (..., b, 3)
    """
    own = (np.swapaxes(rotation, -1, -2) @ drag.velocity[..., None, :, None])[..., 0]
    speed = size(drag.velocity)[..., None, None]
    pressed = np.asarray(drag.density)[..., None, None] / 2 * drag.bodies * speed * own
    return (rotation @ pressed[..., None])[..., 0], (rotation @ drag.centers[..., None])[..., 0]


def cable_loads(drag, catenary, end_1=None):
    """Mean force per unstretched length on each cable, global axes, shape (..., c, 3). [N/m]

    Parameters
    ----------
    drag : Drag
    catenary : Catenary
        Of shape (..., c).
    end_1 : ndarray, shape (..., c, 3), optional
        Places of their ends 1, where the wind has a profile. [m]
    """
    chord = catenary.span.frame[..., 0, :]
    wind = np.broadcast_to(drag.velocity[..., None, :], chord.shape)
    across = wind - chord * (wind * chord).sum(axis=-1, keepdims=True)
    stretch = 1 + catenary.mean_tension / catenary.span.axial_stiffness if drag.stretched else 1.0
    factor = np.asarray(drag.density)[..., None] / 2 * drag.cables * stretch * size(across)
    if drag.profile is not None:
        factor = factor * drag.profile.over(factor.shape[-1]).mean_pressure(catenary, end_1)
    return factor[..., None] * across


def _kept(chosen, old, new):
    """Arrays of cases, old ones where they are chosen; `chosen` has the shape of the cases."""
    return np.where(chosen.reshape(chosen.shape + (1,) * (np.ndim(new) - chosen.ndim)), old, new)


def equilibrium_in_wind(without_wind, drag):
    """The equilibrium in the mean wind, with the unstretched lengths of the equilibrium without wind.

    Parameters
    ----------
    without_wind : Equilibrium
        With any axes of cases.
    drag : Drag
        With the same axes.

    Returns
    -------
    Equilibrium
        Where the search from that without wind fails for a case, or forces and attitude do not agree, its record says
        so.

    Notes
    -----
    Forces and attitude agree where a new equilibrium has its cable ends where the last one had them, but for the
    rounding of places; or where they come no closer, and are within what rounding leaves of the places
    (`uncertainty.uncertainty_of`). Where the wind has a profile the loads of the cables have to be settled too.
    """
    lengths = np.asarray(without_wind.lengths)
    suspension = replace(
        without_wind.suspension,
        given=("unstretched_length",) * lengths.shape[-1],
        value=lengths,
        position=without_wind.position,
        rotation=without_wind.rotation,
    )
    found, shape = without_wind, np.shape(without_wind.record.converged)
    loads, ended = None, np.zeros(shape, dtype=bool)
    least, reason = np.full(shape, np.inf), np.full(shape, DISAGREED)
    for _ in range(WIND.mean_wind_equilibria):
        force, arm = body_forces(drag, found.rotation)
        if drag.profile is not None:
            force = force * drag.profile.pressure(found.position + arm)[..., None]
        fresh = {
            "force": suspension.force + force,
            "moment": suspension.moment + np.cross(arm, force),
            "cable_wind": cable_loads(drag, found.catenary, found.ends[..., found.suspension.of_cables, 0, :]),
            "position": found.position,
            "rotation": found.rotation,
        }
        # a case that has ended keeps its digits while others go on
        loads = {name: _kept(ended, loads[name], new) for name, new in fresh.items()} if ended.any() else fresh
        before, found = found, pose(replace(suspension, **loads))
        change = size(found.ends - before.ends).max(axis=(-1, -2))
        agreed = change <= SYSTEM.sum_rounding * SYSTEM.rounding * np.abs(found.ends).max(axis=(-1, -2, -3))
        settled = _settled(drag, found, loads["cable_wind"])
        agreed, rounded = agreed & settled, settled & ~agreed & (change >= WIND.mean_wind_progress * least)
        least = np.minimum(least, change)
        if (rounded & ~ended).any():
            rounded &= change <= _unknown(found)
        failed = ~np.asarray(found.record.converged)
        why = np.where(rounded & ~failed, ROUNDED, found.record.reason)
        reason = np.where(~ended & (agreed | rounded | failed), why, reason)
        ended = ended | agreed | rounded | failed
        if ended.all():
            break
    return replace(found, record=replace(found.record, reason=reason[()]))


def _settled(drag, found, used):
    """Cases whose cables hang where the loads that were used are those of a wind with a profile, or that has none."""
    if drag.profile is None:
        return np.ones(np.shape(found.record.converged), dtype=bool)
    there = cable_loads(drag, found.catenary, found.ends[..., found.suspension.of_cables, 0, :])
    return (size(there - used) <= WIND.mean_wind_load * size(used)).all(axis=-1)


def _unknown(found):
    """How far rounding leaves the ends of cables undetermined, at most, of each case. [m]"""
    place = found.uncertainty.place
    if not place.size:
        return np.zeros(np.shape(found.record.converged))
    arms = np.where(found.suspension.owner != GROUND, size(found.arms), 0.0).max(axis=(-1, -2))
    return np.sqrt(3) * (place[..., :3].max(axis=(-1, -2)) + place[..., 3:].max(axis=(-1, -2)) * arms)
