"""Statics of suspensions with given lengths, preloads, sags or tensions: where the bodies come to rest (`pose`)."""

from dataclasses import fields, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.errors import NoSolutionError
from cablestudy.system import stated, tangent
from cablestudy.system.descent import (
    ROUNDED,
    TINY,
    UNMET,
    PoseState,
    assign_rows,
    at_ends,
    copy_record,
    descend,
    displaced,
    extent,
    search,
    size,
    spans,
    take_rows,
)  # fmt: skip
from cablestudy.system.links import Links
from cablestudy.system.rounding import Bounds, of_values
from cablestudy.system.stability import UNSTABLE
from cablestudy.system.suspension import GIVEN, GROUND, Equilibrium
from cablestudy.system.tolerances import SYSTEM


def pose(suspension):
    """Equilibrium of a suspension: free points, free degrees of freedom of bodies, and lengths that are not stated.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of any shape. Each cable states something.

    Returns
    -------
    Equilibrium
        Its record says for each case whether it converged; `Equilibrium.stability` whether it is stable.

    Raises
    ------
    NoSolutionError
        A cable that states nothing, a body that nothing holds.

    Notes
    -----
    Stated preloads, sags and tensions are met by Newton's method on the lengths, about equilibria that `search` finds.
    """
    refuse_unheld(suspension)
    unstated = [name for name, kind in zip(suspension.cable_names, suspension.given, strict=True) if kind is None]
    if unstated:
        raise NoSolutionError(f"{', '.join(unstated)}: states none of {', '.join(GIVEN)}")
    shape = suspension.shape
    flat = suspension.broadcast((int(np.prod(shape)),))
    state, record = search_all(flat, start(flat))
    hard = np.flatnonzero(record.reason == UNMET)
    if len(hard):
        again, last = by_softer_cables(flat.take(hard))
        # what the first search says of the others is nearer to the scene
        good, record = last.converged, copy_record(record)
        assign_rows(state, hard[good], take_rows(again, good))
        assign_rows(record, hard[good], take_rows(last, good))
    return leave_saddle_points(suspension, flat, state, record)


def leave_saddle_points(suspension, flat, state, record):
    """Equilibria, where those found are unstable others that the suspension falls to from there: `Equilibrium`.

    Parameters
    ----------
    suspension, flat : SuspendedSystem
        The cases in their shape, and of shape (n,).
    state : PoseState
    record : SearchRecord

    Notes
    -----
    A search that begins on a saddle of the energy stays there: its forces balance. It goes on from a place beside it
    along the unstable motion.
    """
    for side in SYSTEM.off_saddle:
        found = equilibrium(suspension, flat, state, record)
        falling = record.converged & (found.stability.verdict == UNSTABLE).reshape(len(record.converged))
        if not falling.any():
            break
        part, index = flat.take(falling), np.flatnonzero(falling)
        off_saddle = perturbed(
            part, take_rows(state, index), found.stability.motion.reshape(len(falling), -1, 6)[index], side
        )
        descended, last = descend(part, off_saddle)
        if set(part.given) - {"unstretched_length"}:
            descended, last = satisfy_stated(part, descended, last)
        good = last.converged
        record = copy_record(record)
        assign_rows(state, index[good], take_rows(descended, good))
        assign_rows(record, index[good], take_rows(last, good))
    else:
        found = equilibrium(suspension, flat, state, record)
    return found


def perturbed(suspension, state, motion, size):
    """State after a step along motions of `Stability`: its largest rotation, or share of the extent, is `size`."""
    step = motion.copy()
    step[..., :3] /= extent(state)[:, None, None]
    step[..., 3:] /= tangent.body_sizes(suspension)[..., None]
    step *= size / np.maximum(np.abs(step).max(axis=(-1, -2)), TINY)[:, None, None]
    step[..., :3] *= extent(state)[:, None, None]
    return displaced(suspension, state, step)


def search_all(suspension, state):
    """Pose, and lengths with which the cables have what they state: `PoseState`, `SearchRecord`."""
    state, record = search(suspension, state)
    if set(suspension.given) - {"unstretched_length"}:
        state, record = satisfy_stated(suspension, state, record)
    return state, record


def by_softer_cables(suspension):
    """State in which a search begins, by way of softer cables where something else than a length is stated.

    Given tensions, the pose hardly depends on the stiffness; the path to it does: between stiff cables a small movement
    makes large tensions.
    """
    own = np.array([kind == "unstretched_length" for kind in suspension.given])
    begin = start(suspension)
    tension, reach = catenary.solve(spans(suspension, begin)).mean_tension, extent(begin)
    stiffness, part = suspension.axial_stiffness, suspension
    for strain in SYSTEM.softened:
        soft = np.where(own, stiffness, np.minimum(stiffness, tension / strain))
        part = replace(part, axial_stiffness=soft)
        state, record = search_all(part, start(part))
        # where a search has failed it may be on the way, or have wandered off
        moved_by = np.abs(state.position - suspension.position).max(axis=(-1, -2), initial=0.0)
        found = (record.converged | (moved_by < SYSTEM.farthest_softened * reach))[:, None, None]
        part = replace(
            part,
            position=np.where(found, state.position, part.position),
            rotation=np.where(found[..., None], state.rotation, part.rotation),
        )
        if np.array_equal(soft, stiffness):
            break
    part = replace(part, axial_stiffness=stiffness)
    return search_all(part, start(part))


def start(suspension):
    """State in which a search begins: lengths for which the cables have what they state where the bodies are.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).

    Returns
    -------
    PoseState
    """
    arms = suspension.arms(suspension.rotation)
    ends = suspension.ends(suspension.position, suspension.rotation)
    vector, value = ends[..., 1, :] - ends[..., 0, :], suspension.value
    own = np.array([kind == "unstretched_length" for kind in suspension.given])
    length = np.where(own, value, 1.0)
    distance, cables = size(vector), suspension.of_cables
    strain = (distance[:, cables] - length) / length
    extension = distance[:, cables.stop :] - (suspension.link_length if suspension.link_names else 0.0)
    pose = suspension.position.copy(), suspension.rotation.copy()
    state = PoseState(*pose, arms, ends, vector, length, strain, extension)
    if own.all():
        return state
    span = spans(suspension, state)
    chosen = np.broadcast_to(~own, value.shape)
    single = span_of_shape(span, (value.size,)).take(np.flatnonzero(chosen))
    kinds = np.broadcast_to(np.array(suspension.given, dtype=object), value.shape)[chosen]
    strain[chosen] = stated.first_strains(single, kinds, value[chosen])
    return replace(state, strain=strain, length=distance[:, cables] / (1 + strain))


def with_lengths(state, change):
    """State with unstretched lengths changed by dL/L, shape (n, c), the bodies at rest."""
    strain = stated.with_relative_length(state.strain, change)
    return replace(state, length=state.length * (1 + change), strain=strain)


def errors(suspension, state, which):
    """Relative error of what the cables `which` state, infinite where it is not a number, shape (n, s); its rounding.

    Returns
    -------
    error : ndarray, shape (n, s)
    rounding : Bounds
        Of this shape.
    cables : Catenary
        All of them.
    """
    cables = catenary.solve(spans(suspension, state))
    error = (stated.values(cables, suspension.given) / suspension.value - 1)[:, which]
    rounding = of_values(state.ends[:, suspension.of_cables], state.strain, cables, suspension.given, suspension.value)
    rounding = Bounds(rounding.least[:, which], rounding.most[:, which])
    return np.where(np.isfinite(error), error, np.inf), rounding, cables


def satisfy_stated(suspension, state, record):
    """Change lengths until preloads, sags and tensions are what the cables state, with the bodies in equilibrium.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).
    state : PoseState
        In equilibrium.
    record : SearchRecord
        Of the search that led there.

    Returns
    -------
    PoseState
    Record
    """
    which = np.flatnonzero([kind != "unstretched_length" for kind in suspension.given])
    final, whole = copy_record(state), copy_record(record)
    active, part = np.arange(len(state.length)), suspension
    best, slow = np.full(len(active), np.inf), np.zeros(len(active), dtype=int)
    error, rounding, cables = errors(part, state, which)
    for _ in range(SYSTEM.equilibrium_steps):
        step, change = coupled_step(part, state, cables, which, error)
        state, error, rounding, cables, last = backtrack(part, state, step, change, which, error)
        assign_rows(final, active, state)
        assign_rows(whole, active, replace(last, steps=whole.steps[active] + last.steps))
        met = (np.abs(error) <= rounding.least).all(axis=-1)
        left = log_error(error)
        slow[active] = np.where(
            (left > SYSTEM.equilibrium_progress * best[active]) | np.isinf(left), slow[active] + 1, 0
        )
        best[active] = np.minimum(best[active], left)
        stuck = slow[active] >= SYSTEM.equilibrium_patience
        rounded = stuck & (np.abs(error) <= rounding.most).all(axis=-1)
        ended = met | ~last.converged | stuck
        whole.reason[active] = np.where(met | ~last.converged, last.reason, np.where(rounded, ROUNDED, UNMET))
        if ended.all():
            break
        if ended.any():
            rest = np.flatnonzero(~ended)
            active, state, error = active[rest], take_rows(state, rest), error[rest]
            part = suspension.take(active)
            cables = catenary.solve(spans(part, state))
    return final, whole


def backtrack(suspension, state, step, change, which, error):
    """The largest of a falling series of shares of a step of bodies and lengths that lowers the errors."""
    before, share = log_error(error), np.ones(len(error))
    for _ in range(SYSTEM.equilibrium_halvings):
        trial = displaced(suspension, state, step * share[:, None, None])
        trial, record = descend(suspension, with_lengths(trial, change * share[:, None]), SYSTEM.next_equilibrium_steps)
        fresh, rounding, cables = errors(suspension, trial, which)
        worse = ~(log_error(fresh) < before) & (np.abs(fresh) > rounding.most).any(axis=-1) | ~record.converged
        if not worse.any():
            break
        share = np.where(worse, share / 4, share)
    return trial, fresh, rounding, cables, record


def log_error(error):
    """Largest logarithm of what is over what shall be, shape (n,)."""
    return np.abs(np.log(np.maximum(1 + error, TINY))).max(axis=-1)


def coupled_step(suspension, state, cables, which, error):
    """Newton step of bodies and lengths together towards what the cables `which` state.

    Returns
    -------
    step : ndarray, shape (n, b, 6)
        [m], [rad]
    change : ndarray, shape (n, c)
        dL/L. [-]

    Notes
    -----
    [K, -G; M, D] [q; dL/L] = [0; -error], with G the net forces and D the stated values by dL/L, and M the stated
    values by q.
    """
    rates = stated.rates(cables, suspension.given)
    forces, stiffness, _ = at_ends(suspension, state, cables, rates.stiffness)
    blocks = tangent.blocks(suspension, state.rotation, state.arms, forces, stiffness)
    measure, factor = stated.linear_measure(error, np.array(suspension.given, dtype=object)[which])
    value = suspension.value[:, which] / np.where(np.isfinite(factor), factor, 1.0)
    pulled = tangent.wrenches(state.arms[:, which], rates.end_forces[:, which])
    signed = rates.by_end[:, which, None, :] * np.array([-1.0, 1.0])[:, None] / value[..., None, None]
    turned = tangent.wrenches(state.arms[:, which], signed)
    own = rates.by_length[:, which] / value
    stretch = np.where(own != 0, 1 / np.maximum(np.abs(own), TINY), 1.0)  # dL/L that changes a value by itself
    scales = np.sqrt(np.maximum(tangent.magnitudes(blocks, suspension), TINY))
    right = -np.clip(measure, -1.0, SYSTEM.error_in_step)
    couple = _dense_coupled if scales.shape[-1] + len(which) <= SYSTEM.dense_freedoms else _sparse_coupled
    moves, change = couple(
        suspension, blocks, scales, which, pulled * stretch[..., None, None], turned, own * stretch, right
    )
    step, changes = np.zeros((*state.position.shape[:-1], 6)), np.zeros(state.length.shape)
    # without a definite form, as of a slack cable without weight, there are no rates
    step[:, suspension.free], changes[:, which] = np.nan_to_num(moves / scales), np.nan_to_num(change * stretch)
    limited = np.maximum(1.0, np.abs(changes).max(axis=-1) / SYSTEM.length_change)
    return step / limited[:, None, None], changes / limited[:, None]


def _dense_coupled(suspension, blocks, scales, which, pulled, turned, own, right):
    """Solution of the equations of `coupled_step` for all cases at once."""
    n, d, s = len(own), scales.shape[-1], own.shape[-1]
    columns, rows = (tangent.by_body(suspension, which, values) / scales[:, None, :] for values in (pulled, turned))
    matrix = np.zeros((n, d + s, d + s))
    matrix[:, :d, :d] = tangent.scaled_dense(blocks, suspension, scales) + SYSTEM.added_stiffness * np.eye(d)
    matrix[:, :d, d:], matrix[:, d:, :d] = -np.swapaxes(columns, -1, -2), rows
    matrix[:, d:, d:] = (own[:, None, :] + SYSTEM.added_stiffness) * np.eye(s)
    vector = np.concatenate([np.zeros((n, d)), right], axis=-1)
    solution = tangent.solved(matrix, vector)
    return solution[:, :d], solution[:, d:]


def _sparse_coupled(suspension, blocks, scales, which, pulled, turned, own, right):
    """The same case by case, by sparse matrices."""
    from scipy.sparse import block_array, coo_array, diags_array, eye_array
    from scipy.sparse.linalg import splu

    d, s = scales.shape[-1], own.shape[-1]
    free, owner = suspension.free, suspension.owner[which]
    number = np.where(free.ravel(), np.cumsum(free) - 1, -1).reshape(free.shape)
    cable, end = np.nonzero(owner != GROUND)
    column = number[owner[cable, end]]
    row = np.broadcast_to(cable[:, None], column.shape)
    solutions = []
    for case in range(len(own)):
        inverse = diags_array(1 / scales[case])

        def assembled(wrenches, inverse=inverse, case=case):
            entries = wrenches[case, cable, end]
            there = column >= 0
            return coo_array((entries[there], (row[there], column[there])), shape=(s, d)) @ inverse

        stiffness = tangent.scaled_sparse(
            blocks.of(case), suspension, scales[case]
        ) + SYSTEM.added_stiffness * eye_array(d)
        matrix = block_array(
            [[stiffness, -assembled(pulled).T], [assembled(turned), diags_array(own[case] + SYSTEM.added_stiffness)]]
        )
        solutions.append(splu(matrix.tocsc()).solve(np.concatenate([np.zeros(d), right[case]])))
    solution = np.array(solutions)
    return solution[:, :d], solution[:, d:]


def refuse_unheld(suspension):
    """Raise for a body that no cables join to the ground, directly or by others, and that is free to move away.

    Raises
    ------
    NoSolutionError
    """
    held = ~suspension.free[:, :3].all(axis=-1)
    reached = np.append(held, True)  # the last one is the ground
    owner = suspension.owner % len(reached)
    while True:
        joined = reached[owner].any(axis=-1)
        fresh = np.unique(owner[joined])
        if reached[fresh].all():
            break
        reached[fresh] = True
    if not reached.all():
        name = suspension.body_names[int(np.argmin(reached))]
        raise NoSolutionError(f"nothing holds {name}: no cables lead from it to the ground")


def equilibrium(suspension, flat, state, record):
    """The `Equilibrium` in the shape of the cases of `suspension`, from arrays of all cases in a row."""
    shape = suspension.shape

    def shaped(array):
        return array.reshape(shape + array.shape[1:])

    cables = catenary.solve(span_of_shape(spans(flat, state), (*shape, state.length.shape[-1])))
    record = replace(record, **{f.name: shaped(getattr(record, f.name))[()] for f in fields(record)})
    found = Equilibrium(suspension.broadcast(), shaped(state.position), shaped(state.rotation), cables, record)
    return _mounted(found, shaped(state.vector), shaped(state.extension)) if suspension.link_names else found


def _mounted(found, vector, extension):
    """An `Equilibrium` with its links, which all have a length: where none is stated their distance there."""
    suspension, distance = found.suspension, size(vector)
    unstated, first = np.isnan(suspension.link_length), len(suspension.cable_names)
    own = np.where(distance <= SYSTEM.link_places * distance.max(axis=-1, keepdims=True), 0.0, distance)[..., first:]
    suspension = replace(suspension, link_length=np.where(unstated, own, suspension.link_length))
    links = Links.of(suspension, vector[..., first:, :], np.where(unstated, 0.0, extension))
    return replace(found, suspension=suspension, links=links)


def span_of_shape(span, shape):
    """Cables of shape (n, c) in another shape of the same size."""
    names = ["chord", "cosine", "sine", "chord_strain", "axial_stiffness", "mass", "gravity", "level", "vertical"]
    loaded = span.load_positions.shape[-1] > 0
    of_loads = ("load_positions", "load_forces", "load_masses", "load_fractions")
    names += [name for name in of_loads if loaded and getattr(span, name) is not None]
    arrays = {name: np.asarray(getattr(span, name)) for name in names}
    shaped = {name: array.reshape((*shape, *array.shape[2:])) for name, array in arrays.items()}
    shaped = replace(span, **shaped)
    return (shaped if loaded else shaped.without_loads()).broadcast()
