"""Change of suspensions in a steady wind due to drag that varies along each cable, in place of uniform drag.

The actual drag changes the forces of each cable on its ends (`CatenaryInDrag`), and these move the bodies, until all is
in equilibrium again: a light body may move far by a small change of the forces, or turn, and a cable that swings takes
another drag.
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.catenary_in_drag import in_drag
from cablestudy.cable.matrices import largest_ratio
from cablestudy.cable.steady_drag import SteadyDrag, across
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import dot, size
from cablestudy.statics import block_stiffness, tangent
from cablestudy.statics.descent import DISAGREED
from cablestudy.statics.links import Links, joined
from cablestudy.statics.pose_state import PoseState, displaced, spans
from cablestudy.statics.rigid import rotation_vector, turn
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


def equilibria_in_drag(equilibrium, drag, parts):
    """Find the equilibria of suspensions in a steady wind whose drag varies along each cable.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, in the wind, the drag taken as uniform along each cable. Cases without equilibrium keep it.
    drag : Drag
        The wind, and drag areas of cables and bodies.
    parts : int
        Equal parts of each smooth piece of a cable, on which the drag is a polynomial.

    Returns
    -------
    dict
        Number of parts -> `Equilibrium`, of half of the parts and of all. Its `catenary` is a `CatenaryInDrag` of shape
        (n, c). Where none was found it is not valid: the reason in its record is `DISAGREED`.

    Notes
    -----
    With half of the parts the bodies move from the equilibrium found with all by what the forces of such cables leave
    out of balance there: what that search has left is part of the difference.
    """
    steady, movement = drag_on_cables(drag, equilibrium), np.zeros((*equilibrium.position.shape[:2], 6))
    rows = np.flatnonzero(equilibrium.record.converged & (steady.normal_drag > 0).any(axis=-1))
    found, lost = np.zeros((2, len(movement)), dtype=bool)
    moves = equilibrium.suspension.free.any()
    if len(rows) and moves:
        least = (tangent.motion_units(equilibrium.suspension) * equilibrium.uncertainty.pose).max(axis=(-2, -1))
        for plain, most in STUDY.drag_movements:
            left = rows[~found[rows]]
            if len(left):
                in_wind = equilibrium.take(left), drag.take(left), steady.take(left)
                movement[left], found[left] = _search(*in_wind, parts, least[left], plain, most)
    finer = _equilibrium_after(equilibrium, drag, steady, movement, parts)
    further = _movement(replace(finer, catenary=finer.catenary.coarser))
    uniform = replace(finer, catenary=finer.catenary.catenary)
    further = np.where(found[:, None, None], further, 0.0)
    coarser = _equilibrium_after(uniform, drag, drag_on_cables(drag, uniform), further, parts // 2)
    lost[rows] = ~finer.catenary.found[rows].all(axis=-1) | (moves & ~found[rows])
    record = replace(equilibrium.record, reason=np.where(lost, DISAGREED, equilibrium.record.reason))
    return {parts // 2: replace(coarser, record=record), parts: replace(finer, record=record)}


def _equilibrium_after(equilibrium, drag, steady, movement, parts):
    """`Equilibrium` of bodies that moved, out of balance perhaps, its cables in drag that varies along each.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, drag uniform along each cable.
    drag, steady : Drag, SteadyDrag
        The wind, and its drag on the cables there.
    movement : ndarray, shape (n, b, 6)
        Of bodies and points. [m], [rad]
    parts : int
        As of `equilibria_in_drag`.
    """
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
    form = in_drag(steady, solve(spans(loaded, state), equilibrium.catenary.middle_tension), parts)
    links = links and Links.of(loaded, state.vector[:, of_cables.stop :], state.extension)
    return Equilibrium(loaded, state.position, state.rotation, form, equilibrium.record, links)


def changes_by_fewer_parts(coarser, finer):
    """Changes of equilibria in drag that varies along each cable, if it varies on fewer parts of the cables.

    Parameters
    ----------
    coarser, finer : Equilibrium
        Of n cases, of `equilibria_in_drag`.

    Returns
    -------
    relative : ndarray, shape (n,)
        The larger one of the relative changes of forces at the ends of cables, over the largest one of their cable, and
        of the stiffness (`stiffness_change`). [-]
    movement : ndarray, shape (n, b, 6)
        Of bodies and points. [m], [rad]
    """
    of_cables = finer.suspension.of_cables
    forces, others = (one.end_forces[:, of_cables] for one in (finer, coarser))
    largest = np.maximum(size(forces).max(axis=-1), np.finfo(float).tiny)
    of_forces = (size(forces - others).max(axis=-1) / largest).max(axis=-1, initial=0.0)
    of_ends = (coarser.end_stiffness - finer.end_stiffness)[:, of_cables]
    relative = np.maximum(of_forces, stiffness_change(finer, coarser.blocks, of_ends))
    turned = rotation_vector(coarser.rotation @ np.swapaxes(finer.rotation, -1, -2))
    return relative, np.concatenate([coarser.position - finer.position, turned], axis=-1)


def _with_wind_on_moved_bodies(equilibrium, drag, movement, rotation):
    """`SuspendedSystem` of an `Equilibrium` whose bodies meet the wind where they have moved to, and turned."""
    before = body_loads(drag, equilibrium.position, equilibrium.rotation)
    now, suspension = body_loads(drag, equilibrium.position + movement[..., :3], rotation), equilibrium.suspension
    force, eccentric = (after - earlier for after, earlier in zip(now, before, strict=True))
    loads = {"force": suspension.force + force, "eccentric_loads": suspension.eccentric_loads + eccentric}
    return replace(suspension, **loads)


def _search(equilibrium, drag, steady, parts, least, plain, most):
    """Find how far the drag that varies along each cable moves the bodies of n cases.

    Each movement follows from the net forces by the tangent stiffness, to which the drag is a dead load. Since the drag
    follows the cables, after some steps the next movement is combined from several of those before (`next_argument`).

    Parameters
    ----------
    equilibrium, drag, steady, parts
        As of `_equilibrium_after`.
    least : ndarray, shape (n,)
        Steps that end the search however small the movement is. [m]
    plain, most : int
        Steps by the stiffness alone, and of all.

    Returns
    -------
    movement : ndarray, shape (n, b, 6)
        Of bodies and points; zero where none was found. [m], [rad]
    found : ndarray of bool, shape (n,)
    """
    cases, units, tried = np.arange(len(least)), tangent.motion_units(equilibrium.suspension), []
    movement, found = np.zeros(units.shape), np.zeros(len(cases), dtype=bool)
    now, before = movement, np.full(len(cases), STUDY.tiny)
    for step in range(most):
        rough = step < STUDY.rough_movements
        moved = _equilibrium_after(equilibrium, drag, steady, now / units, 1 if rough else parts)
        further = units * _movement(moved)
        of_step, of_all = (np.abs(vectors).max(axis=(-2, -1)) for vectors in (further, now))
        # the next step is as much smaller again, unless it is combined
        rate = np.clip(of_step / before, CABLE.fastest_turns, 1.0) if step < plain else 1.0
        small = rate * of_step <= np.maximum(CABLE.settled_form * of_all, least)
        ended = small & _balanced(equilibrium, moved) & (not rough)
        found[cases[ended]] = True  # what others leave may not be finite
        movement[cases[ended]] = _after_step(now[ended], further[ended], units[ended]) / units[ended]
        on = np.flatnonzero(~ended & np.isfinite(of_step))
        if not len(on):
            break
        if len(on) < len(cases):
            equilibrium, drag, steady = equilibrium.take(on), drag.take(on), steady.take(on)
            cases, units, least, now, further, of_step = (
                array[on] for array in (cases, units, least, now, further, of_step)
            )
            tried = [[array[on] for array in both] for both in tried]
        before, longest = of_step, STUDY.drag_movement * equilibrium.longest
        tried = [*tried, [now, _after_step(now, _limited(further, longest), units)]][-STUDY.combined_movements :]
        following = tried[-1][1]
        if step >= plain:
            flat = np.array(tried).reshape(len(tried), 2, len(cases), -1)
            following = next_argument(flat[:, 0], flat[:, 1]).reshape(now.shape)
        now = now + _limited(following - now, longest)
    return movement, found


def _balanced(equilibrium, moved):
    """True where bodies are left with almost nothing of what the forces change by drag that varies, shape (n,)."""
    suspension, forces = moved.suspension, moved.end_forces
    net = _net_forces(moved) / block_stiffness.free_values(suspension, tangent.motion_units(suspension))
    change, largest = (size(vectors).max(axis=(-2, -1)) for vectors in (forces - equilibrium.end_forces, forces))
    balanced = np.abs(net).max(axis=-1) <= CABLE.settled_drag * np.maximum(change, CABLE.no_drag * largest)
    return balanced & moved.catenary.found.all(axis=-1)


def _net_forces(equilibrium):
    """Net forces [N] and moments [N m] on the d free degrees of freedom of n cases, shape (n, d)."""
    suspension, none = equilibrium.suspension, np.zeros(equilibrium.lengths.shape)
    of_all, _ = tangent.net_forces(suspension, equilibrium.rotation, equilibrium.arms, equilibrium.end_forces, none)
    return block_stiffness.free_values(suspension, of_all)


def _after_step(movement, step, units):
    """Movements of bodies and points after a further step, shape (n, b, 6), both times the `motion_units`.

    Rotations follow one another; of vectors that differ by whole turns, the one that is nearest to the sum is taken.
    """
    added = (movement + step) / units
    before, further = (np.eye(3) + turn((vectors / units)[..., 3:]) for vectors in (movement, step))
    vector = rotation_vector(further @ before)
    angle = size(vector)[..., None]
    axis = vector / np.maximum(angle, STUDY.tiny)
    turns = np.rint(dot(added[..., 3:] - vector, axis) / (2 * np.pi))[..., None]
    added[..., 3:] = vector + 2 * np.pi * turns * axis
    return added * units


def _limited(steps, most):
    """Steps of n cases, shape (n, b, 6), shortened to the largest component `most`, shape (n,)."""
    largest = np.abs(steps).max(axis=(-2, -1))
    return steps * (most / np.maximum(largest, most))[:, None, None]


def _movement(equilibrium):
    """Movements of bodies and points by the net forces on them, (n, b, 6); zero where they are held. [m], [rad]"""
    suspension, net = equilibrium.suspension, _net_forces(equilibrium)
    movement = np.zeros((len(net), *suspension.free.shape))
    movement[:, suspension.free] = block_stiffness.displacements(equilibrium.blocks, suspension, net[..., None])[..., 0]
    return movement


def stiffness_change(equilibrium, blocks, of_cables):
    """Largest relative change of the stiffness of suspensions from one `Equilibrium` in drag to another.

    With the tangent stiffness K and its change dK it is the largest

        |u^T dK u| / u^T K u    of all static displacements u

    With more than `STUDY.dense_stiffness` free degrees of freedom, or none, the result is the largest change of the
    stiffness of a single cable, which is no smaller where no body turns.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, with K.
    blocks : Blocks
        Of K + dK.
    of_cables : ndarray, shape (n, c, 3, 3)
        Change of the stiffness of end 2 of each cable, global axes. [N/m]

    Returns
    -------
    ndarray, shape (n,)
        [-]
    """
    suspension = equilibrium.suspension
    if not 0 < suspension.free.sum() <= STUDY.dense_stiffness:
        return largest_ratio(of_cables, equilibrium.end_stiffness[:, suspension.of_cables]).max(axis=-1)
    before = equilibrium.stiffness
    return largest_ratio(block_stiffness.dense(blocks, suspension) - before, before)
