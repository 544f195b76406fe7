"""Effect of a load case on suspensions: from the reference state to that of the day.

Unstretched lengths are those of the reference state, which are stated or found there. Temperature changes them, ice
adds to the mass per length, point loads act on cables and a steady wind on bodies and cables, and the pose is found
again. The drag of a cable is that of one cable (`study.load_cases`): uniform, per unstretched length, by the direction
of its chord.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.steady_drag import Profile, SteadyDrag
from cablestudy.study.load_cases import (
    bounded,
    drag_width,
    elongation,
    ice_mass,
    placed_on_cable,
    point_loads,
    shrunk,
    uneven_drag_errors,
    wind_direction,
)
from cablestudy.study.suspension.numbers import CableValues, loads_of, numbers_of
from cablestudy.study.suspension.plant import offered_by_bodies
from cablestudy.study.tolerances import STUDY
from cablestudy.system import stated, tangent
from cablestudy.system.equilibria import pose
from cablestudy.system.rigid import size
from cablestudy.system.suspension import Equilibrium
from cablestudy.wind.mean import Drag, equilibrium_in_wind


@dataclass(frozen=True)
class LoadedState:
    """Suspensions in their load cases.

    Attributes
    ----------
    without_wind, equilibrium : Equilibrium
        Without the steady wind and with it, shape (n,).
    drag : Drag or None
        The steady wind; None where none of the cases has one.
    problems : list of str
        For each case why a cable or a load on it does not exist; empty where all do.
    """

    without_wind: Equilibrium
    equilibrium: Equilibrium
    drag: Drag | None
    problems: list


def drag_on_cables(drag, found):
    """`SteadyDrag` on each cable, none on those without mass, of shape (n, c).

    Parameters
    ----------
    drag : Drag
        Of n cases.
    found : Equilibrium
        Of these, in the wind.
    """
    mass = found.suspension.cable_mass
    pressure, speed = drag.density / 2 * (drag.velocity**2).sum(axis=-1), size(drag.velocity)
    direction = drag.velocity / np.maximum(speed, np.finfo(float).tiny)[:, None]
    pressed = np.where(mass > 0, pressure[:, None] * drag.cables, 0.0)
    whole = SteadyDrag(pressed, np.broadcast_to(direction[:, None], (*mass.shape, 3)))
    if drag.profile is None:
        return whole
    profile, end_1 = drag.profile.over(mass.shape[1]), found.ends[:, found.suspension.of_cables, 0]
    return replace(whole, profile=profile, end_1=end_1, mean=profile.mean_pressure(found.catenary, end_1))


@dataclass(frozen=True)
class DragChange:
    """Estimated errors of an equilibrium, since drag is taken as uniform along each cable.

    Attributes
    ----------
    error : ndarray, shape (n,)
        Largest one of all cables, relative. [-]
    sag : ndarray, shape (n, c)
        That of the sag of each cable. [-]
    moved : ndarray, shape (n, b, 6)
        Displacement of bodies and points along x, y, z [m], and their rotation about these [rad].
    """

    error: np.ndarray
    sag: np.ndarray
    moved: np.ndarray


def drag_change(found, drag):
    """`DragChange` of an equilibrium, to first order.

    Parameters
    ----------
    found : Equilibrium
        Of n cases, in the wind.
    drag : Drag or None
    """
    shape = found.lengths.shape
    error, sag, moved = np.zeros(shape[0]), np.zeros(shape), np.zeros((*found.position.shape[:2], 6))
    if drag is None:
        return DragChange(error, sag, moved)
    whole = drag_on_cables(drag, found)
    case, cable = np.nonzero((whole.normal_drag > 0) & found.record.converged[:, None])
    own, forces = np.zeros(shape), np.zeros((*shape, 2, 3))
    if len(case):
        about = whole.take((case, cable)), found.catenary.take((case, cable)), drag.stretched
        own[case, cable], sag[case, cable], forces[case, cable] = uneven_drag_errors(*about)
    for place in np.unique(case).tolist():
        more, moved[place] = _by_bodies(found, place, forces[place])
        error[place] = bounded(own[place] + STUDY.second_order * more).max()
        sag[place] = bounded(sag[place] + STUDY.second_order * more)
    return DragChange(error, sag, bounded(STUDY.second_order * np.abs(moved)))


def _by_bodies(found, place, forces):
    """What follows from changed forces of the cables on the bodies of one case.

    Returns
    -------
    change : ndarray, shape (c,)
        Of the tension at an end of each cable, relative. [-]
    moved : ndarray, shape (b, 6)
        [m], [rad]
    """
    suspension, arms = found.suspension.take(place), found.arms[place, found.suspension.of_cables]
    owner = suspension.owner[suspension.of_cables]
    every, whole = np.arange(len(forces)), np.zeros((len(suspension.body_names), 6))
    factors = None
    if suspension.free.any():
        factors = tangent.factorised(tangent.sparse(found.blocks.of(place), suspension))
    if factors is None:  # nothing moves, or the equilibrium is not stable and no answer
        return np.zeros(len(forces)), whole
    wrenches = tangent.wrenches(arms, forces)[None]
    whole[suspension.free] = factors.solve(tangent.by_body(suspension, every, wrenches)[0].sum(axis=0))
    ends = np.where((owner == tangent.GROUND)[..., None], 0.0,
                    whole[owner, :3] + np.cross(whole[owner, 3:], arms))  # fmt: skip
    pulled = (found.end_stiffness[place, suspension.of_cables] @ (ends[:, 1] - ends[:, 0])[..., None])[:, None, :, 0]
    held = found.end_forces[place, suspension.of_cables]
    square = np.maximum((held**2).sum(axis=-1), np.finfo(float).tiny)
    return np.abs((pulled * held).sum(axis=-1) / square).max(axis=-1), whole


@dataclass(frozen=True)
class CablesOfCase:
    """Cables of the reference state as a load case takes them, shape (n, c).

    Attributes
    ----------
    lengths : ndarray
        Unstretched, in the reference state. [m]
    warm : ndarray
        Those of the case over them. [-]
    stiffness, mass : ndarray
        EA [N], and mass per unstretched length in the reference state [kg/m].
    share : ndarray or float
        Ice and wind per unstretched length of the case over those of the scenes. [-]
    """

    lengths: np.ndarray
    warm: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    share: np.ndarray | float = 1.0

    def take(self, cables):
        """Those of some cables, by their numbers."""
        parts = (self.lengths, self.warm, self.stiffness, self.mass, np.broadcast_to(self.share, self.warm.shape))
        return CablesOfCase(*(part[:, cables] for part in parts))


def loaded_state(reference, scenes, forced=True, cables=None):
    """Suspensions in the load cases of their scenes.

    Parameters
    ----------
    reference : Equilibrium
        In the reference state, with all cables, shape (n,).
    scenes : sequence of SuspensionScene
        n of them, `without_lost`; all of their load cases have a steady wind, or none has.
    forced : bool
        Whether the forces of the load cases on bodies and points act too.
    cables : CablesOfCase, optional
        By default those of the reference state, as warm as the cases.

    Returns
    -------
    LoadedState

    Raises
    ------
    ConvergenceError
        Forces of the steady wind and the attitude that they lead to do not agree.
    """
    left, values = cables_left(reference, scenes[0]), CableValues(scenes)
    suspension, lengths = reference.suspension, reference.lengths
    if len(left) < lengths.shape[-1]:
        suspension, lengths, cables = suspension.with_cables(left), lengths[:, left], cables and cables.take(left)
    own = lengths, 1.0 + elongation(values), suspension.axial_stiffness, suspension.cable_mass
    cables, problems = cables or CablesOfCase(*own), _shrunk(values, suspension.cable_names)
    warm = cables.warm
    standing = reference.record.converged
    loaded = replace(
        suspension,
        load_fractions=None,
        given=("unstretched_length",) * warm.shape[-1],
        value=cables.lengths * warm,
        axial_stiffness=cables.stiffness,
        cable_mass=cables.mass / warm + ice_mass(values) * cables.share,
        position=np.where(standing[:, None, None], reference.position, suspension.position) + _moves_of_bodies(scenes),
        rotation=np.where(standing[:, None, None, None], reference.rotation, suspension.rotation),
        place=suspension.place + values.moves,
        **(_forces(scenes, suspension) if forced else {}),
    )
    if any(loads_of(scenes[0], of_case=True)):
        loads, beyond = _loads(values, suspension.cable_names, loaded.value, warm)
        loaded, problems = replace(loaded, **loads), [one or other for one, other in zip(problems, beyond, strict=True)]
    without_wind = pose(loaded)
    if all(scene.load_case.wind is None for scene in scenes):
        return LoadedState(without_wind, without_wind, None, problems)
    drag = _steady_drag(scenes, np.nan_to_num(drag_width(values)) * cables.share, suspension.body_names)
    # without an equilibrium there is nothing that the wind could move
    drag = replace(drag, velocity=np.where(without_wind.record.converged[:, None], drag.velocity, 0.0))
    return LoadedState(without_wind, equilibrium_in_wind(without_wind, drag), drag, problems)


def cables_left(reference, scene):
    """Numbers of the cables of a reference state that are there in the load case of a scene: list of int."""
    return [number for number, name in enumerate(reference.suspension.cable_names) if name in scene.cables]


def _moves_of_bodies(scenes):
    """Displacements of bodies by their load cases, none of junctions, shape (n, b, 3). [m]"""
    still = (0.0, 0.0, 0.0)
    return np.array([
        [*(scene.load_case.moves.get(name, still) for name in scene.bodies),
         *(still for point in scene.points.values() if point.free)]
        for scene in scenes
    ]).reshape(len(scenes), -1, 3)  # fmt: skip


def _forces(scenes, suspension):
    """Dead loads with those of the load cases: fields of `SuspendedSystem`, those that change.

    A force on a marker is one on the reference point and an eccentric load, as of `SuspendedSystem.eccentric_loads`.
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


def _shrunk(values, names):
    """For each case which cables have next to no length left at its temperature, in words; empty without any."""
    text = "at the temperature of the case next to nothing is left of its length, by its expansion"
    found = [", ".join(name for name, own in zip(names, of_case, strict=True) if own) for of_case in shrunk(values)]
    return [f"{short}: {text}" if short else "" for short in found]


def numbers_at_rest(scenes):
    """`SuspendedSystem` of scenes in the reference state; parameters as of `numbers_of`."""
    return replace(numbers_of(scenes), **_reference_loads(scenes))


def _reference_loads(scenes):
    """Point loads that are on cables in the reference state, as many for each: fields of `SuspendedSystem`.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With equally many such loads on cables of the same name.
    """
    if not any(loads_of(scenes[0], of_case=False)):
        return {}
    positions, fractions, forces, _ = point_loads(CableValues(scenes), of_case=False)
    nothing = np.isnan(positions) & np.isnan(fractions)  # these places carry nothing
    number = np.cumsum(nothing, axis=-1)
    fractions = np.where(nothing, (number - 1 + STUDY.place_without_load) / np.maximum(number[..., -1:], 1), fractions)
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


def _loads(values, names, lengths, warm):
    """Point loads of all cables, as many for each: fields of `SuspendedSystem`, and what is wrong in each case.

    Parameters
    ----------
    values : CableValues
        With equally many loads on cables of the same name.
    names : sequence of str
        Of the cables.
    lengths, warm : ndarray, shape (n, c)
        Unstretched lengths at the temperature of the case [m], and over those in the reference state [-].
    """
    positions, fractions, forces, masses = point_loads(values, of_case=True)
    places = np.where(np.isnan(fractions), positions * warm[..., None], fractions * lengths[..., None])
    beyond, problems = places >= lengths[..., None], [""] * len(lengths)
    for case, cable, load in np.argwhere(beyond).tolist():
        at, end = positions[case, cable, load], lengths[case, cable] / warm[case, cable]
        problems[case] = f"{names[cable]}: the load at {at:.6g} m is beyond the cable's end, at {end:.6g} m"
    places = placed_on_cable(places, lengths)
    forces, masses = np.where(beyond[..., None], 0.0, forces), np.where(beyond, 0.0, masses)
    order = np.argsort(places, axis=-1, kind="stable")
    return {
        "load_positions": np.take_along_axis(places, order, axis=-1),
        "load_forces": np.take_along_axis(forces, order[..., None], axis=-2),
        "load_masses": np.take_along_axis(masses, order, axis=-1),
    }, problems


def _steady_drag(scenes, cables, body_names):
    """`Drag` of the steady winds of some scenes, with a leading axis of cases; `cables` is that of `Drag`."""
    winds = [scene.load_case.wind for scene in scenes]
    level = wind_direction(np.array([wind.direction for wind in winds]))
    speed = np.sqrt([wind.dynamic_pressure for wind in winds])  # with a density of 2 kg/m^3
    bodies, centers = map(np.array, zip(*(offered_by_bodies(s, body_names) for s in scenes), strict=True))
    for case, wind in enumerate(winds):
        if wind.on is not None:
            bodies[case, [name not in wind.on for name in body_names]] = 0.0
    exponent, height = (np.array([getattr(wind, key) for wind in winds], dtype=float) for key in ("exponent", "at"))
    profile = Profile.of(exponent, height, [scene.ground for scene in scenes])
    return Drag(speed[:, None] * level, np.full(len(scenes), 2.0), cables, bodies, centers, False, profile)
