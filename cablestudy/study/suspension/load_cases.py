"""What a load case does to suspensions: from the reference state to that of the day.

Unstretched lengths are those of the reference state, which are stated or found there. Temperature changes them, ice
adds to the mass per length, point loads act on cables and a steady wind on bodies and cables, and the pose is found
again. The drag of a cable is that of one cable (`study.load_cases`): uniform, per unstretched length, by the direction
of its chord.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from cablestudy.study.load_cases import (
    ICE_PARTS,
    LEAST_LENGTH,
    SECOND_ORDER,
    UNKNOWN,
    ice_mass,
    uneven_drag_errors,
    wind_direction,
)
from cablestudy.study.scene_values import merged_loads
from cablestudy.study.suspension.linear_motion import offered_by_bodies, wind_diameters
from cablestudy.system import stated, statics, tangent
from cablestudy.system.rigid import size
from cablestudy.system.suspension import Equilibrium
from cablestudy.wind.mean import Drag, equilibrium_in_wind

BESIDE = 0.6180339887  # share of its part of a cable at which a place without a load is: no load is likely there


@dataclass(frozen=True)
class LoadedState:
    """Suspensions in their load cases.

    Attributes
    ----------
    calm, equilibrium : Equilibrium
        Without the steady wind and with it, shape (n,).
    drag : Drag or None
        The steady wind; None where none of the cases has one.
    problems : list of str
        For each case why a cable or a load on it does not exist; empty where all do.
    """

    calm: Equilibrium
    equilibrium: Equilibrium
    drag: Drag | None
    problems: list


def pressed_cables(drag, mass):
    """Drag of a length of each cable across the wind, zero of those without mass, and the direction of the wind.

    Parameters
    ----------
    drag : Drag
        Of n cases.
    mass : ndarray, shape (n, c)
        Per length. [kg/m]

    Returns
    -------
    pressed : ndarray, shape (n, c)
        [N/m]
    direction : ndarray, shape (n, c, 3)
        [-]
    """
    pressure, speed = drag.density / 2 * (drag.velocity**2).sum(axis=-1), size(drag.velocity)
    direction = drag.velocity / np.maximum(speed, np.finfo(float).tiny)[:, None]
    pressed = np.where(mass > 0, pressure[:, None] * drag.cables, 0.0)
    return pressed, np.broadcast_to(direction[:, None], (*mass.shape, 3))


def drag_change(found, drag):
    """What an equilibrium changes by, since drag is taken as uniform along each cable, to first order.

    Parameters
    ----------
    found : Equilibrium
        Of n cases, in the wind.
    drag : Drag or None

    Returns
    -------
    error : ndarray, shape (n,)
        Largest one of all cables, relative. [-]
    moved : ndarray, shape (n, b, 3)
        Displacement of bodies and points along x, y, z. [m]
    """
    shape = found.lengths.shape
    error, moved = np.zeros(shape[0]), np.zeros(found.position.shape)
    if drag is None:
        return error, moved
    pressed, direction = pressed_cables(drag, found.suspension.cable_mass)
    case, cable = np.nonzero((pressed > 0) & found.record.converged[:, None])
    own, forces = np.zeros(shape), np.zeros((*shape, 2, 3))
    if len(case):
        about = pressed[case, cable], direction[case, cable], found.catenary.take((case, cable)), drag.stretched
        own[case, cable], forces[case, cable] = uneven_drag_errors(*about)
    for place in np.unique(case).tolist():
        more, moved[place] = _by_bodies(found, place, forces[place])
        error[place] = np.minimum(np.nan_to_num(own[place] + SECOND_ORDER * more, nan=UNKNOWN), UNKNOWN).max()
    return error, np.minimum(np.nan_to_num(SECOND_ORDER * np.abs(moved), nan=UNKNOWN), UNKNOWN)


def _by_bodies(found, place, forces):
    """What follows from changed forces of the cables on the bodies of one case.

    Returns
    -------
    change : ndarray, shape (c,)
        Of the tension at an end of each cable, relative. [-]
    moved : ndarray, shape (b, 3)
        [m]
    """
    suspension, arms = found.suspension.take(place), found.arms[place]
    every, whole = np.arange(len(forces)), np.zeros((len(suspension.body_names), 6))
    factors = None
    if suspension.free.any():
        factors = tangent.factorised(tangent.sparse(found.blocks.of(place), suspension))
    if factors is None:  # nothing moves, or the equilibrium is not stable and no answer
        return np.zeros(len(forces)), whole[:, :3]
    wrenches = tangent.wrenches(arms, forces)[None]
    whole[suspension.free] = factors.solve(tangent.by_body(suspension, every, wrenches)[0].sum(axis=0))
    ends = np.where((suspension.owner == tangent.GROUND)[..., None], 0.0,
                    whole[suspension.owner, :3] + np.cross(whole[suspension.owner, 3:], arms))  # fmt: skip
    pulled = (found.end_stiffness[place] @ (ends[:, 1] - ends[:, 0])[..., None])[:, None, :, 0]
    held = found.end_forces[place]
    square = np.maximum((held**2).sum(axis=-1), np.finfo(float).tiny)
    return np.abs((pulled * held).sum(axis=-1) / square).max(axis=-1), whole[:, :3]


def loaded_state(reference, scenes, forced=True):
    """Suspensions in the load cases of their scenes.

    Parameters
    ----------
    reference : Equilibrium
        In the reference state, shape (n,).
    scenes : sequence of SuspensionScene
        n of them; all of their load cases have a steady wind, or none has.
    forced : bool
        Whether the forces of the load cases on bodies and points act too.

    Returns
    -------
    LoadedState

    Raises
    ------
    ConvergenceError
        Forces of the steady wind and the attitude that they lead to do not agree.
    """
    suspension = reference.suspension
    warm = 1.0 + np.array([[s.load_case.elongation(cable) for cable in s.cables.values()] for s in scenes])
    problems = [_shrunk(scene, own) for scene, own in zip(scenes, warm, strict=True)]
    warm = np.where(warm < LEAST_LENGTH, 1.0, warm)
    standing = reference.record.converged
    loaded = replace(
        suspension,
        load_fractions=None,
        given=("unstretched_length",) * warm.shape[-1],
        value=reference.lengths * warm,
        cable_mass=suspension.cable_mass / warm + _ice_masses(scenes),
        position=np.where(standing[:, None, None], reference.position, suspension.position) + _moves_of_bodies(scenes),
        rotation=np.where(standing[:, None, None, None], reference.rotation, suspension.rotation),
        place=suspension.place + _moves_of_ends(scenes),
        **(_forces(scenes, suspension) if forced else {}),
    )
    if any(load_counts(scenes[0]).values()):
        loads, beyond = _loads(scenes, loaded.value, warm)
        loaded, problems = replace(loaded, **loads), [one or other for one, other in zip(problems, beyond, strict=True)]
    calm = statics.pose(loaded)
    if all(scene.load_case.wind is None for scene in scenes):
        return LoadedState(calm, calm, None, problems)
    drag = _steady_drag(scenes, suspension.body_names)
    # without an equilibrium there is nothing that the wind could move
    drag = replace(drag, velocity=np.where(calm.record.converged[:, None], drag.velocity, 0.0))
    return LoadedState(calm, equilibrium_in_wind(calm, drag), drag, problems)


def _moves_of_bodies(scenes):
    """Displacements of bodies by their load cases, none of junctions, shape (n, b, 3). [m]"""
    still = (0.0, 0.0, 0.0)
    return np.array([
        [*(scene.load_case.moves.get(name, still) for name in scene.bodies),
         *(still for point in scene.points.values() if point.free)]
        for scene in scenes
    ]).reshape(len(scenes), -1, 3)  # fmt: skip


def _moves_of_ends(scenes):
    """Displacements of the fixed ends of cables by their load cases, shape (n, c, 2, 3). [m]"""

    def moved(scene, end):
        return scene.load_case.moves.get(end, (0.0, 0.0, 0.0)) if isinstance(end, str) else (0.0, 0.0, 0.0)

    return np.array([[[moved(s, end) for end in cable.ends] for cable in s.cables.values()] for s in scenes])


def _forces(scenes, suspension):
    """Dead loads with those of the load cases: fields of `Suspension`, those that change.

    A force on a marker is one on the reference point and an eccentric load, as of `Suspension.eccentric_loads`.
    """
    if not any(scene.load_case.forces for scene in scenes):
        return {}
    shape, places = suspension.force.shape, {name: k for k, name in enumerate(suspension.body_names)}
    force, moment, eccentric = np.zeros(shape), np.zeros(shape), np.zeros((*shape, 3))
    for case, scene in enumerate(scenes):
        for name, load in scene.load_case.forces.items():
            body, _, marker = name.partition(".")
            force[case, places[body]] += load.force
            moment[case, places[body]] += load.moment
            if marker:
                eccentric[case, places[body]] += np.outer(scene.bodies[body].markers[marker], load.force)
    some = {"eccentric_loads": eccentric} if eccentric.any() else {}
    return {"force": suspension.force + force, "moment": suspension.moment + moment, **some}


def _shrunk(scene, warm):
    """Which cables have next to no length left at the temperature of their case, in words; empty without any."""
    names = [name for name, own in zip(scene.cables, warm.tolist(), strict=True) if own < LEAST_LENGTH]
    text = "at the temperature of the case next to nothing is left of its length, by its expansion"
    return f"{', '.join(names)}: {text}" if names else ""


def reference_loads(scenes):
    """Point loads that are on cables in the reference state, as many for each: fields of `Suspension`.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With equally many such loads on cables of the same name.
    """
    count = max(reference_load_counts(scenes[0]).values())
    if not count:
        return {}
    shape = len(scenes), len(scenes[0].cables), count
    positions, fractions, forces = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros((*shape, 3))
    for case, scene in enumerate(scenes):
        for number, cable in enumerate(scene.cables.values()):
            loads = merged_loads(cable.loads) if cable.reference.loads else []
            for slot, (at, fraction, force, mass) in enumerate(loads):
                positions[case, number, slot], fractions[case, number, slot] = at, fraction
                forces[case, number, slot] = force - [0.0, 0.0, mass * scene.gravity]
            missing = count - len(loads)  # these places carry nothing
            fractions[case, number, len(loads) :] = (np.arange(missing) + BESIDE) / max(missing, 1)
    return {"load_positions": positions, "load_fractions": fractions, "load_forces": forces}


def too_long(reference):
    """For each case which cables have their stated tension only as they hang under themselves, in words; empty else.

    A scene of one cable takes the shorter one of two cables with a tension. Here both lengths are equilibria, and a
    search that loads lead astray may end at the longer one.

    Parameters
    ----------
    reference : Equilibrium
        With point loads, shape (n,).
    """
    kinds, lengths = np.array(reference.suspension.given, dtype=object), reference.lengths
    tauter = ~(stated.rates(reference.catenary, kinds).by_length < 0) & np.isin(kinds, stated.FORCES)
    return [
        "; ".join(
            f"{name} has its {kind} only at {length:.4g} m, where a longer cable would be tauter"
            for name, kind, length, wrong in zip(reference.suspension.cable_names, kinds, of_case, hangs, strict=True)
            if wrong
        )
        for of_case, hangs in zip(lengths.tolist(), tauter, strict=True)
    ]


def reference_load_counts(scene):
    """Name of each cable -> at how many places it carries loads in the reference state."""
    loads = {name: cable.loads if cable.reference.loads else () for name, cable in scene.cables.items()}
    return {name: len(merged_loads(of_cable)) for name, of_cable in loads.items()}


def load_counts(scene):
    """Name of each cable -> at how many places it carries loads."""
    return {name: len(merged_loads(scene.loads_on(name))) for name in scene.cables}


def _loads(scenes, lengths, warm):
    """Point loads of all cables, as many for each: fields of `Suspension`, and for each case what is wrong with them.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With equally many loads on cables of the same name.
    lengths, warm : ndarray, shape (n, c)
        Unstretched lengths at the temperature of the case [m], and over those in the reference state [-].
    """
    count = max(load_counts(scenes[0]).values())
    places, forces, masses = (np.zeros((*lengths.shape, count, *more)) for more in ((), (3,), ()))
    problems = [""] * len(scenes)
    for case, scene in enumerate(scenes):
        for number, name in enumerate(scene.cables):
            length, own = lengths[case, number], {}
            for at, fraction, force, mass in merged_loads(scene.loads_on(name)):
                place = fraction * length if np.isnan(at) else at * warm[case, number]
                if place >= length:
                    end = length / warm[case, number]
                    problems[case] = f"{name}: the load at {at:.6g} m is beyond the cable's end, at {end:.6g} m"
                    continue
                before, carried = own.get(place, (0.0, 0.0))
                own[place] = before + force - [0.0, 0.0, mass * scene.gravity], carried + mass
            for nothing in _more_places(own, count, length):
                own[nothing] = np.zeros(3), 0.0
            for slot, place in enumerate(sorted(own)):
                places[case, number, slot] = place
                forces[case, number, slot], masses[case, number, slot] = own[place]
    return {"load_positions": places, "load_forces": forces, "load_masses": masses}, problems


def _more_places(places, count, length):
    """Places at which a cable carries nothing, so that it has `count` of them: evenly along its longest free part."""
    edges = sorted([0.0, *places, length])
    begin, end = max(pairwise(edges), key=lambda pair: pair[1] - pair[0])
    missing = count - len(places)
    return [begin + (end - begin) * step / (missing + 1) for step in range(1, missing + 1)]


def _ice_masses(scenes):
    """Of ice and other loads per length on each cable, shape (n, c). [kg/m]"""
    parts = np.array([[getattr(s.load_case.ice, key, None) for key in ICE_PARTS] for s in scenes], dtype=float)
    diameter = np.array([[c.section_diameter for c in s.cables.values()] for s in scenes], dtype=float)
    gravity = np.array([scene.gravity for scene in scenes])
    return ice_mass(*parts.T[..., None], diameter, gravity[:, None])


def _steady_drag(scenes, body_names):
    """`Drag` of the steady winds of some scenes, with a leading axis of cases."""
    winds = [scene.load_case.wind for scene in scenes]
    level = wind_direction(np.array([wind.direction for wind in winds]))
    speed = np.sqrt([wind.dynamic_pressure for wind in winds])  # with a density of 2 kg/m^3
    cables = np.array([s.load_case.wind.cable_drag_coefficient * wind_diameters(s) for s in scenes])
    bodies, centers = map(np.array, zip(*(offered_by_bodies(s, body_names) for s in scenes), strict=True))
    return Drag(speed[:, None] * level, np.full(len(scenes), 2.0), cables, bodies, centers, stretched=False)
