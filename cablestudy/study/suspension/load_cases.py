"""Effect of a load case on suspensions: from the reference state to the equilibrium under the loads of the case.

Unstretched lengths are those of the reference state, which are stated or found there. Temperature changes them, ice
adds to the mass per length, point loads act on cables and a steady wind on bodies and cables, and the pose is found
again. The drag of a cable is that of one cable (`study.load_cases`): uniform, per unstretched length, by the direction
of its chord.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from cablestudy.cable.records import assign_rows
from cablestudy.cable.steady_drag import Profile, SteadyDrag
from cablestudy.cable.vectors import size, times
from cablestudy.motion.airflow import drag_areas_of_bodies
from cablestudy.statics import stated, tangent
from cablestudy.statics.equilibria import pose
from cablestudy.statics.rigid import turn
from cablestudy.statics.suspension import Equilibrium
from cablestudy.study.load_cases import (
    drag_width,
    elongation,
    ice_mass,
    placed_on_cable,
    point_loads,
    shrunk,
    wind_direction,
)
from cablestudy.study.suspension.numbers import CableValues, loads_of, numbers_of
from cablestudy.study.tolerances import STUDY
from cablestudy.study.uneven_drag import (
    DragErrors,
    bounded_errors,
    largest_ratio,
    movement_errors,
    uneven_drag_errors,
)
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


def drag_on_cables(drag, equilibrium):
    """Drag of a steady wind on each of the c cables of n suspensions: `SteadyDrag` of shape (n, c).

    The drag per length of a cable across the wind is rho/2 v^2 C_d D, with the density rho, the speed v and the drag
    width C_d D. It is zero on cables without mass. Where the wind grows with the height, `mean` is the ratio of its
    mean pressure along each cable to the stated one.

    Parameters
    ----------
    drag : Drag
        Wind and drag widths of the cables in the n cases.
    equilibrium : Equilibrium
        Equilibria of these cases in the wind, shape (n,).
    """
    mass = equilibrium.suspension.cable_mass
    pressure, speed = drag.density / 2 * (drag.velocity**2).sum(axis=-1), size(drag.velocity)
    direction = drag.velocity / np.maximum(speed, np.finfo(float).tiny)[:, None]
    normal_drag = np.where(mass > 0, pressure[:, None] * drag.cables, 0.0)
    drag_of_cables = SteadyDrag(normal_drag, np.broadcast_to(direction[:, None], (*mass.shape, 3)))
    if drag.profile is None:
        return drag_of_cables
    # a wind that grows with the height: the mean of its pressure along each cable
    profile, end_1 = drag.profile.over(mass.shape[1]), equilibrium.ends[:, equilibrium.suspension.of_cables, 0]
    mean = profile.mean_pressure(equilibrium.catenary, end_1)
    return replace(drag_of_cables, profile=profile, end_1=end_1, mean=mean)


@dataclass(frozen=True)
class DragChange:
    """Estimated errors of an equilibrium by drag that is taken as uniform along each cable.

    Attributes
    ----------
    error : ndarray, shape (n,)
        Largest relative error of the tension or form of any cable. [-]
    displacement : ndarray, shape (n, b, 6)
        Changes of the positions of bodies and points along x, y, z [m], and of their attitudes about these axes [rad],
        to first order.
    form_error : ndarray, shape (n,)
        Largest `DragErrors.form_error` of any cable. [-]
    stiffness_error : ndarray, shape (n,)
        Largest relative change of the energy of a static displacement, by the tangent stiffness. [-]
    links : ndarray, shape (n, l)
        Changes of the forces of links, to first order. [N]
    blocks : (ndarray of int, Blocks) or None
        Cases with wind on a cable, and the blocks of their tangent stiffness in the actual drag; None without drag.
    cables : DragErrors or None
        Of each cable, fields of shape (n, c, ...), with what the movement of its ends adds; None without drag.
    """

    error: np.ndarray
    displacement: np.ndarray
    form_error: np.ndarray
    stiffness_error: np.ndarray
    links: np.ndarray
    blocks: tuple | None = None
    cables: DragErrors | None = None

    @property
    def uncertainty(self):
        """Errors of positions [m] and attitudes [rad], shape (n, b, 6)."""
        return np.concatenate([movement_errors(part) for part in np.split(self.displacement, 2, axis=-1)], axis=-1)


def drag_change(equilibrium, drag):
    """Estimate the errors of n equilibria in which drag is taken as uniform along each cable: `DragChange`.

    To first order:

    1. The actual drag, which varies along a cable with its direction, changes the form of each cable between fixed
       ends, and the forces on its ends by f.
    2. These forces move the bodies by u = K^-1 f, with the tangent stiffness K.
    3. The movements of its ends change the tension of each cable again.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of the n cases, in the wind.
    drag : Drag or None
        The wind, and drag areas of cables and bodies; without it all errors are 0.
    """
    cases, cables = equilibrium.lengths.shape
    displacement = np.zeros((*equilibrium.position.shape[:2], 6))
    links = np.zeros((cases, equilibrium.suspension.owner.shape[0] - cables))
    form_error, stiffness_error = np.zeros((2, cases))
    has_wind = np.zeros((cases, cables), dtype=bool)
    if drag is not None:
        drag_of_cables = drag_on_cables(drag, equilibrium)
        has_wind = (drag_of_cables.normal_drag > 0) & equilibrium.record.converged[:, None]
    if not has_wind.any():
        return DragChange(np.zeros(cases), displacement, form_error, stiffness_error, links)
    errors = _errors_between_held_ends(equilibrium, drag_of_cables, has_wind, drag.stretched)
    rows = np.flatnonzero(has_wind.any(axis=1))  # m cases with wind on a cable
    in_wind = equilibrium.take(rows)
    displacement[rows], ends = _movement_of_bodies(in_wind, errors.end_forces[rows])
    ends_of_cables, ends_of_links = np.split(ends, [cables], axis=1)
    stiffness_of_links = in_wind.end_stiffness[:, cables:]
    links[rows] = size(times(stiffness_of_links, ends_of_links[:, :, 1] - ends_of_links[:, :, 0]))
    # all m c cables of these cases, in one axis
    of_rows = np.repeat(rows, cables), np.tile(np.arange(cables), len(rows))
    catenary = equilibrium.catenary.take(of_rows)
    at_ends = equilibrium.end_stiffness[of_rows], equilibrium.end_forces[of_rows]
    moved_errors = errors.take(of_rows).with_moved_ends(catenary, ends_of_cables.reshape(-1, 2, 3), *at_ends)
    assign_rows(errors, of_rows, moved_errors)
    form_error[rows] = moved_errors.form_error(catenary).reshape(len(rows), cables).max(axis=-1)
    change_of_stiffness = moved_errors.stiffness_change(catenary).reshape(len(rows), cables, 3, 3)
    change_of_end_forces = moved_errors.end_forces.reshape(len(rows), cables, 2, 3)
    blocks = _changed_blocks(in_wind, displacement[rows], change_of_stiffness, change_of_end_forces)
    stiffness_error[rows] = STUDY.second_order * stiffness_change(in_wind, blocks, change_of_stiffness)
    stiffness_error, of_blocks = bounded_errors(stiffness_error), (rows, blocks)
    return DragChange(errors.error.max(axis=-1), displacement, form_error, stiffness_error, links, of_blocks, errors)


def _errors_between_held_ends(equilibrium, drag_of_cables, has_wind, stretched):
    """Errors of n equilibria by drag that is taken as uniform along each of c cables, whose ends are held.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of the n cases.
    drag_of_cables : SteadyDrag
        Of each cable, shape (n, c), see `drag_on_cables`.
    has_wind : ndarray of bool, shape (n, c)
        Cables on which the wind acts.
    stretched : bool
        See `Drag.stretched`.

    Returns
    -------
    DragErrors
        Fields of shape (n, c, ...); zero in cases without wind on any cable.
    """
    in_wind = np.nonzero(has_wind)
    errors_in_wind = uneven_drag_errors(drag_of_cables.take(in_wind), equilibrium.catenary.take(in_wind), stretched)
    of_one = {field.name: getattr(errors_in_wind, field.name).shape[1:] for field in fields(DragErrors)}
    errors = DragErrors(**{name: np.zeros(has_wind.shape + shape) for name, shape in of_one.items()})
    assign_rows(errors, in_wind, errors_in_wind)
    without_wind = np.nonzero(has_wind.any(axis=1)[:, None] & ~has_wind)  # other cables of the same cases
    if len(without_wind[0]):
        assign_rows(errors, without_wind, DragErrors.none(equilibrium.catenary.take(without_wind)))
    return errors


def _changed_blocks(equilibrium, displacement, of_cables, end_forces):
    """`Blocks` of the tangent stiffness of suspensions in the actual drag, to first order.

    By the stiffness and forces of the cables and the attitudes of the bodies; links (springs) keep their stiffness.
    `equilibrium` and `of_cables` are as of `stiffness_change`.

    Parameters
    ----------
    displacement : ndarray, shape (n, b, 6)
        Change of the positions [m] and attitudes [rad] of the b bodies and points by the actual drag.
    end_forces : ndarray, shape (n, c, 2, 3)
        Change of the forces of each cable on what holds its ends. [N]
    """
    suspension = equilibrium.suspension
    forces, stiffness = np.array(equilibrium.end_forces), np.array(equilibrium.end_stiffness)
    stiffness[:, suspension.of_cables] += of_cables
    forces[:, suspension.of_cables] += end_forces
    rotation = equilibrium.rotation + turn(displacement[..., 3:]) @ equilibrium.rotation
    return tangent.stiffness_blocks(suspension, rotation, suspension.arms(rotation), forces, stiffness)


def stiffness_change(equilibrium, blocks, of_cables):
    """Largest relative change of the stiffness of suspensions if drag is not taken as uniform along each cable.

    With the tangent stiffness K in uniform drag, and its change dK by the actual drag, it is the largest

        |u^T dK u| / u^T K u    of all static displacements u

    With more than `STUDY.dense_stiffness` free degrees of freedom, or none, the result is the largest change of the
    stiffness of a single cable, which is no smaller where no body turns.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, in uniform drag.
    blocks : Blocks
        Of K + dK, see `_changed_blocks`.
    of_cables : ndarray, shape (n, c, 3, 3)
        Change of the stiffness of end 2 of each cable by the actual drag, global axes. [N/m]

    Returns
    -------
    ndarray, shape (n,)
        [-]
    """
    suspension = equilibrium.suspension
    if not 0 < suspension.free.sum() <= STUDY.dense_stiffness:
        return largest_ratio(of_cables, equilibrium.end_stiffness[:, suspension.of_cables]).max(axis=-1)
    before = equilibrium.stiffness
    return largest_ratio(tangent.dense(blocks, suspension) - before, before)


def _movement_of_bodies(equilibrium, forces):
    """Compute how far changed forces of the cables move the bodies, and all ends of cables and links.

    The bodies move by u = K^-1 f, with the tangent stiffness K and the changes f of the forces on them.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases.
    forces : ndarray, shape (n, c, 2, 3)
        Changes of the forces of the cables on what holds their ends. [N]

    Returns
    -------
    movement : ndarray, shape (n, b, 6)
        Displacements [m] and rotations [rad]; zero where nothing holds a body, so that there is no answer.
    ends : ndarray, shape (n, c + l, 2, 3)
        Displacements of the ends of cables and links. [m]
    """
    suspension, arms = equilibrium.suspension, equilibrium.arms
    movement = np.zeros((*equilibrium.position.shape[:2], 6))
    if not suspension.free.any():
        return movement, np.zeros(arms.shape)
    wrenches, cables = tangent.wrenches(arms[:, suspension.of_cables], forces), np.arange(forces.shape[1])
    on_bodies = tangent.by_body(suspension, cables, wrenches).sum(axis=1)
    moved = tangent.displacements(equilibrium.blocks, suspension, on_bodies[..., None])[..., 0]
    movement[:, suspension.free] = np.where(np.isfinite(moved), moved, 0.0)
    owner = suspension.owner  # body that holds each end, shape (c + l, 2)
    end_movements = movement[:, owner, :3] + np.cross(movement[:, owner, 3:], arms)
    return movement, np.where((owner == tangent.GROUND)[..., None], 0.0, end_movements)


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
    present, values = cables_left(reference, scenes[0]), CableValues(scenes)
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
    return replace(suspension, position=position, rotation=rotation, attachment=suspension.attachment + values.moves)


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

    A force on a marker is one on the reference point and an eccentric load, as of `SuspendedSystem.eccentric_loads`.
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
    """Text for each case on cables with next to no length left at its temperature; empty without any: list."""
    text = "at the temperature of the case next to nothing is left of its length, by its expansion"
    shrunk_cables = [", ".join(np.array(names, dtype=object)[of_case]) for of_case in shrunk(values)]
    return [f"{cables}: {text}" if cables else "" for cables in shrunk_cables]


def numbers_at_rest(scenes):
    """`SuspendedSystem` of scenes in the reference state; parameters as of `numbers_of`."""
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
    positions, fractions, forces, _ = point_loads(CableValues(scenes), of_case=False)
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
    values : CableValues
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
    """`Drag` of the steady winds of some scenes, with a leading axis of cases; `cables` as of `Drag`."""
    winds = [scene.load_case.wind for scene in scenes]
    direction = wind_direction(np.array([wind.direction for wind in winds]))
    speed = np.sqrt([wind.dynamic_pressure for wind in winds])  # where the density is 2 kg/m^3
    bodies, centers = map(np.array, zip(*(drag_areas_of_bodies(s, body_names) for s in scenes), strict=True))
    for case, wind in enumerate(winds):
        if wind.on is not None:
            bodies[case, [name not in wind.on for name in body_names]] = 0.0
    exponent, height = (np.array([getattr(wind, key) for wind in winds], dtype=float) for key in ("exponent", "at"))
    profile = Profile.of(exponent, height, [scene.ground for scene in scenes])
    density = np.full(len(scenes), 2.0)
    return Drag(speed[:, None] * direction, density, cables, bodies, centers, stretched=False, profile=profile)
