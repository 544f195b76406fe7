"""Change of suspensions in a steady wind due to drag that varies along each cable, in place of uniform drag.

The actual drag changes the forces of each cable on its ends (`CablesInDrag`), and these move the bodies, until all is
in equilibrium again: a light body may move far by a small change of the forces, or turn, and a cable that swings takes
another drag.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.catenary_in_drag import in_drag
from cablestudy.cable.records import assign_rows, copy_record, take_rows
from cablestudy.cable.steady_drag import SteadyDrag, across
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.uneven_drag import (
    CablesInDrag,
    Pieces,
    largest_ratio,
    settled_changes,
    stiffness_of,
)
from cablestudy.cable.vectors import size
from cablestudy.statics import tangent
from cablestudy.statics.links import Links, joined
from cablestudy.statics.pose_state import PoseState, displaced, spans
from cablestudy.statics.rigid import turn
from cablestudy.statics.suspension import Equilibrium
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.mean import body_loads, next_argument


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
    mean, applied = profile.mean_pressure(equilibrium.catenary, end_1), equilibrium.suspension.cable_wind
    if applied is not None and not drag.stretched:  # that with which the equilibrium was found, to the last digit
        at_stated = normal_drag * size(across(drag_of_cables.direction, equilibrium.catenary.span.frame[..., 0, :]))
        mean = np.divide(size(applied), at_stated, out=mean, where=at_stated > 0)
    return replace(drag_of_cables, profile=profile, end_1=end_1, mean=mean)


def equilibrium_in_drag(equilibrium, drag, parts):
    """Find the equilibria of suspensions in a steady wind whose drag varies along each cable.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, in the wind, the drag taken as uniform along each cable. Cases without equilibrium keep it, and
        those for which no other is found.
    drag : Drag
        The wind, and drag areas of cables and bodies.
    parts : int
        Equal parts of each smooth piece of a cable, on which the drag is a polynomial.

    Returns
    -------
    Equilibrium
        Its `catenary` is a `CatenaryInDrag` of shape (n, c); where no equilibrium was found, `unsettled` of the cables
        whose ends move is `CABLE.unknown_error`.
    """
    count, steady = equilibrium.lengths.shape[1], drag_on_cables(drag, equilibrium)
    in_wind = equilibrium.record.converged & (steady.normal_drag > 0).any(axis=-1)
    rows, movement = np.flatnonzero(in_wind), np.zeros((*equilibrium.position.shape[:2], 6))
    found, moving = np.zeros(0, dtype=bool), np.zeros(equilibrium.lengths.shape)
    if len(rows):
        flat, of_rows = np.divmod(_of_cables(rows, count), count), equilibrium.take(rows)
        catenary = equilibrium.catenary.take(flat)
        cables = CablesInDrag.of(steady.take(flat), catenary, drag.stretched, Pieces.of(catenary, parts))
        held = settled_changes(cables)
        least = (tangent.motion_units(of_rows.suspension) * of_rows.uncertainty.pose).max(axis=(-2, -1), initial=0.0)
        of_bodies, changes, found = _search(of_rows, drag.take(rows), cables, held, least)
        movement[rows[found]] = of_bodies[found]
        moving[rows] = np.where(found[:, None], changes.unsettled.reshape(-1, count), CABLE.unknown_error)
    moved, steady = _moved_equilibrium(equilibrium, drag, steady, movement)
    form = in_drag(steady, moved.catenary, parts)
    unsettled = np.where(_moves(moved.suspension), np.maximum(moving, form.unsettled), form.unsettled)
    return replace(moved, catenary=replace(form, unsettled=unsettled))


def _moved_equilibrium(equilibrium, drag, steady, movement):
    """`Equilibrium` of bodies that moved, drag uniform along each cable between its ends then; its `SteadyDrag`."""
    suspension, of_cables, links = equilibrium.suspension, equilibrium.suspension.of_cables, equilibrium.links
    vector = np.diff(equilibrium.ends, axis=-2)[:, of_cables, 0]
    before = PoseState(
        position=equilibrium.position,
        rotation=equilibrium.rotation,
        arms=equilibrium.arms,
        ends=equilibrium.ends,
        vector=joined(vector, links and links.vector, -2),
        length=equilibrium.lengths,
        strain=np.asarray(equilibrium.catenary.span.chord_strain),
        extension=np.zeros((len(vector), 0)) if links is None else links.extension,
        tension=np.full(vector.shape, np.nan),
    )
    state = displaced(suspension, before, movement)
    if steady.end_1 is not None:
        steady = replace(steady, end_1=state.ends[:, of_cables, 0])
    uniform = steady.uniform(state.chord / size(state.chord)[..., None])
    heavy, loaded = suspension.cable_mass > 0, _with_wind_on_moved_bodies(equilibrium, drag, movement, state.rotation)
    loaded = replace(loaded, cable_wind=np.where(heavy[..., None], uniform, suspension.cable_wind))
    catenary = solve(spans(loaded, state), equilibrium.catenary.middle_tension)
    links = links and Links.of(loaded, state.vector[:, of_cables.stop :], state.extension)
    return Equilibrium(loaded, state.position, state.rotation, catenary, equilibrium.record, links), steady


def _moves(suspension):
    """True for cables an end of which moves, shape (c,)."""
    owner = suspension.owner[suspension.of_cables]
    return np.append(suspension.free.any(axis=-1), False)[owner].any(axis=-1)  # the last one is the ground, -1


def change_by_fewer_parts(equilibrium):
    """Changes of equilibria in drag that varies along each cable, if it varies on half as many parts of the cables.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, of `equilibrium_in_drag`.

    Returns
    -------
    relative : ndarray, shape (n,)
        The larger one of the relative changes of forces at the ends of cables, over the largest one of their cable, and
        of the stiffness (`stiffness_change`), bodies at rest. [-]
    movement : ndarray, shape (n, b, 6)
        Of bodies and points. [m], [rad]
    """
    suspension, of_cables = equilibrium.suspension, equilibrium.suspension.of_cables
    changed = replace(equilibrium, catenary=equilibrium.catenary.coarser)
    forces, others = (one.end_forces[:, of_cables] for one in (equilibrium, changed))
    largest = np.maximum(size(forces).max(axis=-1), np.finfo(float).tiny)
    of_forces = (size(forces - others).max(axis=-1) / largest).max(axis=-1, initial=0.0)
    of_ends = (changed.end_stiffness - equilibrium.end_stiffness)[:, of_cables]
    relative = np.maximum(of_forces, stiffness_change(equilibrium, changed.blocks, of_ends))
    net, _ = tangent.net_forces(
        suspension, changed.rotation, changed.arms, changed.end_forces, np.zeros(changed.lengths.shape)
    )
    movement = np.zeros((len(net), *suspension.free.shape))
    by_forces = tangent.free_values(suspension, net)[..., None]
    movement[:, suspension.free] = tangent.displacements(equilibrium.blocks, suspension, by_forces)[..., 0]
    return relative, movement


@dataclass(frozen=True)
class MovedState:
    """n suspensions whose bodies have moved, and whose cables hang in the actual drag, out of balance perhaps."""

    ends: np.ndarray  # (n, c + l, 2, 3): movement of the ends of cables and links [m]
    net: np.ndarray  # (n, d): net force [N] and moment [N m] on the free degrees of freedom
    # (n,): true where what is left out of balance is almost nothing of what the forces change, and cables are settled
    balanced: np.ndarray
    blocks: tangent.Blocks  # tangent stiffness, the drag as a dead load


def _ends_moved(equilibrium, movement):
    """Movements of all ends of cables and links by those of the bodies, (n, c + l, 2, 3), and attitudes after them."""
    rotation = equilibrium.rotation + turn(movement[..., 3:]) @ equilibrium.rotation
    ends = equilibrium.suspension.ends(equilibrium.position + movement[..., :3], rotation)
    return ends - equilibrium.ends, rotation


def _moved_state(equilibrium, drag, cables, movement, changes):
    """`MovedState` of n cases.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of the n cases in uniform drag.
    drag : Drag
    cables : CablesInDrag
        The n c cables.
    movement : ndarray, shape (n, b, 6)
        Of the bodies and points from their equilibrium. [m], [rad]
    changes : ChangesByDrag
        Of the cables with these movements.
    """
    suspension, shape = equilibrium.suspension, (*equilibrium.lengths.shape, 3, 3)
    ends, rotation = _ends_moved(equilibrium, movement)
    links = equilibrium.links and equilibrium.links.moved(ends[:, shape[1] :])
    of_cables = changes.end_tensions.reshape(*shape[:2], 2, 3) * np.array([1.0, -1.0])[:, None]
    forces = equilibrium.end_forces + joined(of_cables, links and links.end_forces - equilibrium.links.end_forces)
    stiffness = stiffness_of(changes.tensions, cables).reshape(shape)
    loaded, arms = _with_wind_on_moved_bodies(equilibrium, drag, movement, rotation), suspension.arms(rotation)
    net, _ = tangent.net_forces(loaded, rotation, arms, forces, np.zeros(shape[:2]))
    blocks = tangent.stiffness_blocks(loaded, rotation, arms, forces, joined(stiffness, links and links.end_stiffness))
    net = tangent.free_values(suspension, net)
    left = np.abs(net / tangent.free_values(suspension, tangent.motion_units(suspension))).max(axis=-1, initial=0.0)
    change, largest = (size(vectors).max(axis=(-2, -1)) for vectors in (forces - equilibrium.end_forces, forces))
    balanced = left <= CABLE.settled_drag * np.maximum(change, CABLE.no_drag * largest)
    balanced &= (changes.unsettled.reshape(shape[:2]) <= CABLE.known_drag).all(axis=-1)
    return MovedState(ends, net, balanced, blocks)


def _with_wind_on_moved_bodies(equilibrium, drag, movement, rotation):
    """`SuspendedSystem` of an `Equilibrium` whose bodies meet the wind where they have moved to, and turned."""
    before = body_loads(drag, equilibrium.position, equilibrium.rotation)
    now, suspension = body_loads(drag, equilibrium.position + movement[..., :3], rotation), equilibrium.suspension
    force, eccentric = (after - earlier for after, earlier in zip(now, before, strict=True))
    loads = {"force": suspension.force + force, "eccentric_loads": suspension.eccentric_loads + eccentric}
    return replace(suspension, **loads)


def _search(equilibrium, drag, cables, held, least):
    """Find how far the actual drag moves the bodies of n cases, and the form of their cables.

    Each movement follows from the net forces by the tangent stiffness, to which the drag is a dead load. Since the drag
    follows the cables, after some steps the next movement is combined from several of those before (`next_argument`).

    Parameters
    ----------
    equilibrium, drag, cables
        As of `_moved_state`.
    held : ChangesByDrag
        Of the cables, their ends held.
    least : ndarray, shape (n,)
        Steps that end the search however small the movement is. [m]

    Returns
    -------
    movement : ndarray, shape (n, b, 6)
        Of bodies and points; zero where none was found. [m], [rad]
    changes : ChangesByDrag
        Of the n c cables with these movements.
    found : ndarray of bool, shape (n,)
    """
    suspension, cases = equilibrium.suspension, np.arange(len(equilibrium.position))
    movement, changes, tried = np.zeros((*equilibrium.position.shape[:2], 6)), held, []
    if not suspension.free.any():
        return movement, held, np.ones(len(cases), dtype=bool)
    all_movements, all_changes, found = movement.copy(), copy_record(held), np.zeros(len(cases), dtype=bool)
    units, count = tangent.motion_units(suspension), equilibrium.lengths.shape[1]
    for step in range(STUDY.drag_movements):
        state = _moved_state(equilibrium, drag, cables, movement, changes)
        further, longest = units * _movement(equilibrium.suspension, state), equilibrium.longest
        of_step, of_all = (np.abs(moved).max(axis=(-2, -1)) for moved in (further, units * movement))
        ended = state.balanced & (of_step <= np.maximum(CABLE.settled_form * of_all, least))
        here, left = np.flatnonzero(ended), np.flatnonzero(~ended & np.isfinite(of_step))
        found[cases[here]], all_movements[cases[here]] = True, movement[here]
        assign_rows(all_changes, _of_cables(cases[here], count), take_rows(changes, _of_cables(here, count)))
        if not len(left):
            break
        if len(left) < len(cases):
            of_left = _of_cables(left, count)
            cables, changes = take_rows(cables, of_left), take_rows(changes, of_left)
            cases, units, movement, further = (array[left] for array in (cases, units, movement, further))
            longest, least = longest[left], least[left]
            tried = [[array[left] for array in both] for both in tried]
            equilibrium, drag = equilibrium.take(left), drag.take(left)
        now, most = units * movement, STUDY.drag_movement * longest
        tried = [*tried, [now, now + _limited(further, most)]][-STUDY.combined_movements :]
        following = tried[-1][1]
        if step >= STUDY.plain_movements:
            flat = np.array(tried).reshape(len(tried), 2, len(cases), -1)
            following = next_argument(flat[:, 0], flat[:, 1]).reshape(now.shape)
        movement = (now + _limited(following - now, most)) / units
        ends, _ = _ends_moved(equilibrium, movement)
        changes = settled_changes(cables, ends[:, :count].reshape(-1, 2, 3), changes)
    return all_movements, all_changes, found


def _of_cables(cases, count):
    """Indices of the cables of some cases, `count` of each, among those of all."""
    return (cases[:, None] * count + np.arange(count)).ravel()


def _limited(steps, most):
    """Steps of n cases, shape (n, b, 6), shortened to the largest component `most`, shape (n,)."""
    largest = np.abs(steps).max(axis=(-2, -1))
    return steps * (most / np.maximum(largest, most))[:, None, None]


def _movement(suspension, state):
    """Movements of bodies by the net forces of a `MovedState`, (n, b, 6); zero where they are held. [m], [rad]"""
    movement = np.zeros((len(state.net), *suspension.free.shape))
    movement[:, suspension.free] = tangent.displacements(state.blocks, suspension, state.net[..., None])[..., 0]
    return movement


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
        Of K + dK, of a `MovedState`.
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
