"""Effect of a load case on suspensions: from the reference state to the equilibrium under the loads of the case.

Unstretched lengths are those of the reference state, which are stated or found there. Temperature changes them, ice
adds to the mass per length, point loads act on cables and a steady wind on bodies and cables, and the pose is found
again. The drag of a cable is that of one cable (`study.load_cases`): uniform, per unstretched length, by the direction
of its chord.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.steady_drag import Profile
from cablestudy.motion.airflow import drag_areas_of_bodies
from cablestudy.statics import stated
from cablestudy.statics.equilibria import pose
from cablestudy.statics.suspension import Equilibrium
from cablestudy.study.load_cases import (
    density_and_speed,
    drag_width,
    elongation,
    ice_mass,
    placed_on_cable,
    point_loads,
    shrunk,
    wind_direction,
)
from cablestudy.study.suspension.numbers import CableNumbers, loads_of, numbers_of
from cablestudy.study.tolerances import STUDY
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
        For each case why a cable, or a load on it, does not exist; empty where all do.
    """

    without_wind: Equilibrium
    equilibrium: Equilibrium
    drag: Drag | None
    problems: list


@dataclass(frozen=True)
class CablesOfCase:
    """Cables of the reference state with their changes in a load case, shape (n, c).

    Attributes
    ----------
    lengths : ndarray
        Unstretched, in the reference state. [m]
    length_ratio : ndarray
        Unstretched lengths in the case over `lengths`. [-]
    stiffness, mass : ndarray
        EA [N], and mass per unstretched length in the reference state [kg/m].
    load_ratio : ndarray or float
        Ice and wind per unstretched length of the case over those of the scenes. [-]
    """

    lengths: np.ndarray
    length_ratio: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    load_ratio: np.ndarray | float = 1.0

    def take(self, cables):
        """`CablesOfCase` of some cables, by their indices."""
        load_ratio = np.broadcast_to(self.load_ratio, self.length_ratio.shape)
        arrays = self.lengths, self.length_ratio, self.stiffness, self.mass, load_ratio
        return CablesOfCase(*(array[:, cables] for array in arrays))


def loaded_state(reference, scenes, forced=True, cables=None):
    """Find the equilibria of suspensions in load cases, with the unstretched cable lengths of the reference state.

    The reference state is the equilibrium without a load case, from which these lengths follow. A load case may change
    temperature, ice, wind and forces, move ends and bodies, and take cables away.

    Parameters
    ----------
    reference : Equilibrium
        Reference states with all cables, shape (n,).
    scenes : sequence of SuspensionScene
        n scenes, each from `SuspensionScene.without_lost`, all with the same cables left. The load cases of all of them
        have a steady wind, or none has.
    forced : bool
        Whether the forces of the load cases on bodies and points act too.
    cables : CablesOfCase, optional
        Lengths, stiffness and mass of all cables in the load cases; by default those of the reference state, with the
        lengths changed by temperature.

    Returns
    -------
    LoadedState

    Raises
    ------
    NoSolutionError
        The cables that are left do not hold a body.
    """
    present, values = cables_left(reference, scenes[0]), CableNumbers(scenes)
    suspension, lengths = reference.suspension, reference.lengths
    if len(present) < lengths.shape[-1]:  # the load case has lost cables
        suspension, lengths = suspension.with_cables(present), lengths[:, present]
        cables = cables and cables.take(present)
    if cables is None:
        cables = CablesOfCase(lengths, 1.0 + elongation(values), suspension.axial_stiffness, suspension.cable_mass)
    problems = _shrunk(values, suspension.cable_names)
    loaded = replace(
        _with_moves(suspension, reference, scenes, values),
        **dict.fromkeys(("load_positions", "load_forces", "load_masses", "load_fractions")),  # of the reference state
        stated=("unstretched_length",) * len(suspension.cable_names),
        value=cables.lengths * cables.length_ratio,
        axial_stiffness=cables.stiffness,
        cable_mass=cables.mass / cables.length_ratio + ice_mass(values) * cables.load_ratio,
        **(_forces(scenes, suspension) if forced else {}),
    )
    if any(loads_of(scenes[0], of_case=True)):
        loads, loads_beyond = _case_loads(values, suspension.cable_names, loaded.value, cables.length_ratio)
        loaded = replace(loaded, **loads)
        problems = [problem or beyond_end for problem, beyond_end in zip(problems, loads_beyond, strict=True)]
    without_wind = pose(loaded)
    if all(scene.load_case.wind is None for scene in scenes):
        return LoadedState(without_wind, without_wind, None, problems)
    drag = _steady_drag(scenes, np.nan_to_num(drag_width(values)) * cables.load_ratio, suspension.body_names)
    # without an equilibrium there is nothing that the wind could move
    drag = replace(drag, velocity=np.where(without_wind.record.converged[:, None], drag.velocity, 0.0))
    return LoadedState(without_wind, equilibrium_in_wind(without_wind, drag), drag, problems)


def cables_left(reference, scene):
    """Indices of the cables of a reference state that the load case of a scene leaves: list of int."""
    return [number for number, name in enumerate(reference.suspension.cable_names) if name in scene.cables]


def _with_moves(suspension, reference, scenes, values):
    """`SuspendedSystem` with ends and bodies moved by their load cases from where the search shall begin.

    It begins at the reference state, where there is one, else where the scenes say.
    """
    known = reference.record.converged[:, None, None]
    position = np.where(known, reference.position, suspension.position) + _moves_of_bodies(scenes)
    rotation = np.where(known[..., None], reference.rotation, suspension.rotation)
    found = suspension.attitude is not None and scenes[0].solve_for == "lengths"  # the reference state has the attitude
    attitude = {"attitude": rotation} if found else {}
    attachment = suspension.attachment + values.moves
    return replace(suspension, position=position, rotation=rotation, attachment=attachment, **attitude)


def _moves_of_bodies(scenes):
    """Displacements of bodies by their load cases, none of junctions, shape (n, b, 3). [m]"""
    none = (0.0, 0.0, 0.0)
    return np.array([
        [*(scene.load_case.moves.get(name, none) for name in scene.bodies),
         *(none for point in scene.points.values() if point.free)]
        for scene in scenes
    ]).reshape(len(scenes), -1, 3)  # fmt: skip


def _forces(scenes, suspension):
    """Dead loads with those of the load cases: fields of `SuspendedSystem`, those that change.

    A force on a marker is one on the reference point and an eccentric load, as in `SuspendedSystem.eccentric_loads`.
    """
    if not any(scene.load_case.forces for scene in scenes):
        return {}
    shape, indices = suspension.force.shape, {name: k for k, name in enumerate(suspension.body_names)}
    force, moment, eccentric = np.zeros(shape), np.zeros(shape), np.zeros((*shape, 3))
    for case, scene in enumerate(scenes):
        for name, load in scene.load_case.forces.items():
            body, _, marker = name.partition(".")
            force[case, indices[body]] += load.force
            moment[case, indices[body]] += load.moment
            if marker:
                eccentric[case, indices[body]] += np.outer(scene.bodies[body].markers[marker], load.force)
    eccentric_loads = {"eccentric_loads": eccentric} if eccentric.any() else {}
    return {"force": suspension.force + force, "moment": suspension.moment + moment, **eccentric_loads}


def _shrunk(values, names):
    """Text for each case on cables with almost no length left at its temperature; empty without any: list."""
    text = "at the temperature of the case next to nothing is left of its length, by its expansion"
    shrunk_cables = [", ".join(np.array(names, dtype=object)[of_case]) for of_case in shrunk(values)]
    return [f"{cables}: {text}" if cables else "" for cables in shrunk_cables]


def numbers_at_rest(scenes):
    """`SuspendedSystem` of scenes in the reference state; parameters are those of `numbers_of`."""
    return replace(numbers_of(scenes), **_reference_loads(scenes))


def _reference_loads(scenes):
    """Point loads that are on cables in the reference state: dict, fields of `SuspendedSystem`; empty without any.

    The arrays have equally many places for each cable; those in excess carry nothing and are spread along the cable.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With equally many such loads on cables of the same name.
    """
    if not any(loads_of(scenes[0], of_case=False)):
        return {}
    positions, fractions, forces, _ = point_loads(CableNumbers(scenes), of_case=False)
    absent = np.isnan(positions) & np.isnan(fractions)  # these places carry nothing
    number = np.cumsum(absent, axis=-1)
    fractions = np.where(absent, (number - 1 + STUDY.unloaded_fraction) / np.maximum(number[..., -1:], 1), fractions)
    return {"load_positions": positions, "load_fractions": fractions, "load_forces": forces}


def too_long(reference):
    """Text for each case on cables that have their stated tension at the longer one of two lengths; empty without any.

    A scene of one cable takes the shorter one of two cables with a tension. Here both lengths are equilibria, and a
    search with point loads may end at the longer one.

    Parameters
    ----------
    reference : Equilibrium
        With point loads, shape (n,).
    """
    kinds, lengths = np.array(reference.suspension.stated, dtype=object), reference.lengths
    # at the longer one the stated tension grows with the length
    longer = ~(stated.rates(reference.catenary, kinds).by_length < 0) & np.isin(kinds, stated.FORCES)
    problems, names = [[] for _ in lengths], reference.suspension.cable_names
    for case, cable in np.argwhere(longer).tolist():
        length = f"{names[cable]} has its {kinds[cable]} only at {lengths[case, cable]:.4g} m"
        problems[case].append(f"{length}, where a longer cable would be tauter")
    return ["; ".join(texts) for texts in problems]


def _case_loads(values, names, lengths, length_ratio):
    """Place the point loads of the load cases along the c cables of n suspensions.

    Every cable gets equally many, k, in ascending order along it; those in excess are zero.

    Parameters
    ----------
    values : CableNumbers
        Values of the n scenes, with equally many loads on cables of the same name.
    names : sequence of str
        Names of the cables.
    lengths : ndarray, shape (n, c)
        Unstretched lengths at the temperature of the case. [m]
    length_ratio : ndarray, shape (n, c)
        These lengths over those in the reference state. [-]

    Returns
    -------
    fields : dict
        Fields of `SuspendedSystem`: `load_positions` along the unstretched cable, shape (n, c, k) [m]; `load_forces`,
        shape (n, c, k, 3) [N]; `load_masses`, shape (n, c, k) [kg].
    problems : list of str
        One text for each case, which names a load beyond the end of its cable; empty where there is none. Such a load
        is set to zero.
    """
    positions, fractions, forces, masses = point_loads(values, of_case=True)
    # from end 1 along the cable at the temperature of the case; stated as a length in the reference state or a share
    arc_lengths = np.where(np.isnan(fractions), positions * length_ratio[..., None], fractions * lengths[..., None])
    beyond, problems = arc_lengths >= lengths[..., None], [""] * len(lengths)
    for case, cable, load in np.argwhere(beyond).tolist():
        at, end = positions[case, cable, load], lengths[case, cable] / length_ratio[case, cable]
        problems[case] = f"{names[cable]}: the load at {at:.6g} m is beyond the cable's end, at {end:.6g} m"
    arc_lengths = placed_on_cable(arc_lengths, lengths)
    forces, masses = np.where(beyond[..., None], 0.0, forces), np.where(beyond, 0.0, masses)
    order = np.argsort(arc_lengths, axis=-1, kind="stable")
    return {
        "load_positions": np.take_along_axis(arc_lengths, order, axis=-1),
        "load_forces": np.take_along_axis(forces, order[..., None], axis=-2),
        "load_masses": np.take_along_axis(masses, order, axis=-1),
    }, problems


def _steady_drag(scenes, cables, body_names):
    """`Drag` of the steady winds of some scenes, with a leading axis of cases; `cables` as in `Drag`."""
    winds = [scene.load_case.wind for scene in scenes]
    direction = wind_direction(np.array([wind.direction for wind in winds]))
    density, speed = map(np.array, zip(*map(density_and_speed, scenes), strict=True))
    bodies, centers = map(np.array, zip(*(drag_areas_of_bodies(s, body_names) for s in scenes), strict=True))
    for case, wind in enumerate(winds):
        if wind.on is not None:
            bodies[case, [name not in wind.on for name in body_names]] = 0.0
    exponent, height = (np.array([getattr(wind, key) for wind in winds], dtype=float) for key in ("exponent", "at"))
    profile = Profile.of(exponent, height, [scene.ground for scene in scenes])
    return Drag(speed[:, None] * direction, density, cables, bodies, centers, stretched=False, profile=profile)
