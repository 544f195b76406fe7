"""Statics of suspensions with given lengths, preloads, sags or tensions: where the bodies come to rest (`pose`)."""

from dataclasses import replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.records import assign_rows, copy_record, take_rows, with_arrays
from cablestudy.cable.vectors import largest, size
from cablestudy.errors import NoSolutionError
from cablestudy.statics import tangent
from cablestudy.statics.descent import UNMET, descend, least_energy_poses
from cablestudy.statics.fitted_lengths import first_strains
from cablestudy.statics.links import Links
from cablestudy.statics.pose_state import PoseState, displaced, evaluate, extent, spans
from cablestudy.statics.rigid import about_two_axes, rotation_vector
from cablestudy.statics.rounding import largest_ratio
from cablestudy.statics.stability import UNSTABLE
from cablestudy.statics.stated_equilibrium import satisfy_stated
from cablestudy.statics.suspension import STATED, Equilibrium
from cablestudy.statics.tolerances import STATICS


def pose(suspension):
    """Find the equilibrium of a suspension: poses of its free bodies and points, and lengths of cables not given.

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables, in cases of any shape. For each cable its length is stated or, instead, a tension or the sag.

    Returns
    -------
    Equilibrium
        Its record says for each case whether it converged; `Equilibrium.stability` whether it is stable.

    Raises
    ------
    NoSolutionError
        Nothing is stated for a cable, or nothing holds a body.

    Notes
    -----
    First the pose of least potential energy is found. Where tensions or sags are stated, Newton's method then changes
    the lengths and the pose together. Where this fails, the search is repeated from the equilibrium with softer cables,
    or with a little weight on cables that have none, or with the softest motion held. Where an equilibrium is unstable,
    another search begins near it.
    """
    refuse_unsupported(suspension)
    unstated = [name for name, kind in zip(suspension.cable_names, suspension.stated, strict=True) if kind is None]
    if unstated:
        raise NoSolutionError(f"{', '.join(unstated)}: states none of {', '.join(STATED)}")
    shape = suspension.shape
    flat = suspension.broadcast((int(np.prod(shape)),))
    state, record = search_all(flat, start(flat))
    weightless = (flat.cable_mass == 0).any(axis=-1) & (flat.gravity != 0)
    for search, suited in ((search_with_softer_cables, True), (search_with_heavier_cables, weightless)):
        unmet = np.flatnonzero((record.reason == UNMET) & suited)
        if len(unmet):
            # where this search fails too, the state and record of the first one are kept: they are nearer to the scene
            _assign_converged(state, record, unmet, *search(flat.take(unmet)))
    failed = np.flatnonzero(~record.converged)
    if len(failed):
        ended = take_rows(state, failed), take_rows(record, failed)
        _assign_converged(state, record, failed, *search_with_softest_held(flat.take(failed), *ended))
    with_held_rotations(flat, state, record)
    return leave_saddle_points(suspension, flat, state, record)


def _assign_converged(state, record, index, new_state, new_record):
    """Write the states and records of another search of the cases at `index` into all, where it converged."""
    converged = new_record.converged
    assign_rows(state, index[converged], take_rows(new_state, converged))
    assign_rows(record, index[converged], take_rows(new_record, converged))


def leave_saddle_points(suspension, flat, state, record):
    """Replace unstable equilibria by those to which the suspension falls from there: `Equilibrium` of all cases.

    At a saddle point of the energy the forces balance, so that a search that begins there stays there. Another search
    begins a step away, along the unstable motion. Where its result is unstable too, other sizes of this step are tried
    (`STATICS.off_saddle`). `flat` has the same n cases as `suspension` along one axis, as have `state` and `record`;
    states that are replaced are written over.
    """
    for size_of_step in STATICS.off_saddle:
        result = equilibrium(suspension, flat, state, record)
        unstable = (result.stability.verdict == UNSTABLE).reshape(len(record.converged))
        index = np.flatnonzero(record.converged & unstable)
        if not len(index):
            return result
        subset, motion = flat.take(index), result.stability.motion.reshape(len(unstable), -1, 6)[index]
        descended, record_of_descent = descend(subset, perturbed(subset, take_rows(state, index), motion, size_of_step))
        if set(subset.stated) - {"unstretched_length"}:
            descended, record_of_descent = satisfy_stated(subset, descended, record_of_descent)
        record = copy_record(record)
        _assign_converged(state, record, index, descended, record_of_descent)
        with_held_rotations(flat, state, record)
    return equilibrium(suspension, flat, state, record)


def with_held_rotations(suspension, state, record):
    """Turn bodies with two free rotations back about the third axis, and search again, until none of them has turned.

    Small rotations about two axes, one after the other, add up to one about the third, by the area that they enclose:
    where a body ends would depend on the way of the search. Held is the part along this axis of the rotation vector
    that leads from `suspension.attitude` to where the body is, which turns by less than `STATICS.held_turn`. States and
    records of cases that turn are written over.

    Parameters
    ----------
    suspension : SuspendedSystem
    state : PoseState
    record : SearchRecord
        Of n cases, with arrays that can be written.
    """
    if suspension.attitude is None:
        return
    held = about_two_axes(suspension.free)[:, None] & ~suspension.free[:, 3:]
    for _ in range(STATICS.held_searches):
        turned = rotation_vector(state.rotation @ np.swapaxes(suspension.attitude, -1, -2))
        back = -np.where(held & (size(turned) < STATICS.held_turn)[..., None], turned, 0.0)
        index = np.flatnonzero(record.converged & (np.abs(back).max(axis=(-1, -2)) > STATICS.held_rotation))
        if not len(index):
            return
        subset, step = suspension.take(index), np.concatenate([np.zeros(back.shape), back], axis=-1)[index]
        found = search_all(subset, displaced(subset, take_rows(state, index), step))
        if not found[1].converged.any():
            return
        _assign_converged(state, record, index, *found)


def perturbed(suspension, state, motion, step_size):
    """State after a step along a motion, to leave a saddle of the energy.

    Parameters
    ----------
    suspension, state
        Of n cases.
    motion : ndarray, shape (n, b, 6)
        Of `Stability`.
    step_size : float
        Largest rotation of the step [rad], or displacement over extent of the suspension [-].
    """
    step = motion / tangent.motion_units(suspension)
    sizes = np.maximum(largest(step[..., :3]) / extent(state)[:, None], largest(step[..., 3:])).max(axis=-1)
    return displaced(suspension, state, step * (step_size / np.maximum(sizes, STATICS.tiny))[:, None, None])


def search_all(suspension, state):
    """Find the pose, and the lengths with which cables have their stated values: `PoseState`, `SearchRecord`."""
    state, record = least_energy_poses(suspension, state)
    if set(suspension.stated) - {"unstretched_length"}:
        state, record = satisfy_stated(suspension, state, record)
    return state, record


def search_with_softer_cables(suspension):
    """Find equilibria with stated tensions where a direct search fails: with softer cables first, then stiffer ones.

    The pose hardly depends on the stiffness EA of the cables, but the search does: between stiff cables a small step
    makes large tensions. Each search begins at the pose of the one before. EA is limited to (mean tension)/strain, for
    one strain of `STATICS.softened` after the other, except of cables whose length is stated. Returned are the pose and
    lengths with the actual stiffness, and the `SearchRecord` of the last search.
    """
    length_stated = np.array([kind == "unstretched_length" for kind in suspension.stated])
    first_state = start(suspension)
    tension, reach = catenary.solve(spans(suspension, first_state)).mean_tension, extent(first_state)
    stiffness, softer = suspension.axial_stiffness, suspension
    for strain in STATICS.softened:
        soft_stiffness = np.where(length_stated, stiffness, np.minimum(stiffness, tension / strain))
        softer = replace(softer, axial_stiffness=soft_stiffness)
        state, record = search_all(softer, start(softer))
        # where a search has failed it may be on the way, or have wandered off
        distance = largest(state.position - suspension.position).max(axis=-1, initial=0.0)
        usable = (record.converged | (distance < STATICS.farthest_softened * reach))[:, None, None]
        softer = replace(
            softer,
            position=np.where(usable, state.position, softer.position),
            rotation=np.where(usable[..., None], state.rotation, softer.rotation),
        )
        if np.array_equal(soft_stiffness, stiffness):
            break
    from_softer = replace(softer, axial_stiffness=stiffness)
    return search_all(from_softer, start(from_softer))


def search_with_softest_held(suspension, state, record):
    """Find equilibria of cases whose search ended without one: first with the softest motion held, then free.

    A motion that nothing holds, as the yaw of a body that hangs at one point, leads a search astray: its stiffness away
    from equilibrium is of either sign, and its steps are long. `state` and `record` are where the searches ended.
    """
    state, record = copy_record(state), copy_record(record)
    motion = np.abs(equilibrium(suspension, suspension, state, record).stability.motion)
    free = suspension.free & (motion < motion.max(axis=(-2, -1), keepdims=True))
    for of_cases in np.unique(free, axis=0):  # what is free is the same for all cases of a search
        if of_cases.any():
            index = np.flatnonzero((free == of_cases).all(axis=(-2, -1)))
            found = _held_then_free(suspension.take(index), of_cases)
            assign_rows(state, index, found[0])
            assign_rows(record, index, found[1])
    return state, record


def _held_then_free(suspension, free):
    """State and record of searches with fewer degrees of freedom, `free`, and then with all where forces remain."""
    held = replace(suspension, free=free)
    state, record = search_all(held, start(held))
    at_rest = evaluate(suspension, state)
    balanced = largest_ratio(suspension, at_rest.net, at_rest.most_rounding) <= 1
    if len(moving := np.flatnonzero(~balanced)):
        further = search_all(suspension.take(moving), take_rows(state, moving))
        assign_rows(state, moving, further[0])
        assign_rows(record, moving, further[1])
    return state, record


def search_with_heavier_cables(suspension):
    """Pose and lengths as in `search_with_softer_cables`, by way of a little weight of cables that have none.

    While a cable without weight is slack, the lengths of others may change no tension, and lead a search nowhere.
    """
    first_state = start(suspension)
    tension = catenary.solve(spans(suspension, first_state)).mean_tension.max(axis=-1, keepdims=True)
    gravity = np.maximum(np.abs(suspension.gravity), STATICS.tiny)
    mass = STATICS.little_weight * tension / (gravity * extent(first_state))[:, None]
    heavier = replace(suspension, cable_mass=np.where(suspension.cable_mass > 0, suspension.cable_mass, mass))
    state, _ = search_with_softer_cables(heavier)
    from_heavier = replace(suspension, position=state.position, rotation=state.rotation)
    return search_all(from_heavier, start(from_heavier))


def start(suspension):
    """Pose in which a search for the equilibrium begins: bodies at their given positions, with estimated cable lengths.

    A cable whose length is stated has this length. Another one has a length for which its tension or sag is about the
    stated value, the bodies at rest.

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables, with cases of shape (n,).

    Returns
    -------
    PoseState
        The tensions are NaN: they are not known yet.
    """
    arms = suspension.arms(suspension.rotation)
    ends = suspension.ends(suspension.position, suspension.rotation)
    vector, value = ends[..., 1, :] - ends[..., 0, :], suspension.value
    length_stated = np.array([kind == "unstretched_length" for kind in suspension.stated])
    length = np.where(length_stated, value, 1.0)
    distance, cables = size(vector), suspension.of_cables
    strain = (distance[:, cables] - length) / length
    extension = distance[:, cables.stop :] - (suspension.link_length if suspension.link_names else 0.0)
    pose = suspension.position.copy(), suspension.rotation.copy()
    state = PoseState(*pose, arms, ends, vector, length, strain, extension, np.full((*length.shape, 3), np.nan))
    if length_stated.all():
        return state
    sought = np.broadcast_to(~length_stated, value.shape)
    span = span_of_shape(spans(suspension, state), (value.size,)).take(np.flatnonzero(sought))
    kinds = np.broadcast_to(np.array(suspension.stated, dtype=object), value.shape)[sought]
    strain[sought] = first_strains(span, kinds, value[sought])
    return replace(state, strain=strain, length=distance[:, cables] / (1 + strain))


def refuse_unsupported(suspension):
    """Raise for a body free to translate that no chain of cables, links and bodies joins to the ground or a held body.

    Raises
    ------
    NoSolutionError
    """
    held = np.append(~suspension.free[:, :3].all(axis=-1), True)  # the last one is the ground
    owner = suspension.owner % len(held)
    while True:
        held_by_cables = owner[held[owner].any(axis=-1)]  # at either end of a cable one end of which is held
        if held[held_by_cables].all():
            break
        held[held_by_cables] = True
    if not held.all():
        name = suspension.body_names[int(np.argmin(held))]
        raise NoSolutionError(f"nothing holds {name}: no cables lead from it to the ground")


def equilibrium(suspension, flat, state, record):
    """The `Equilibrium` in the shape of the cases of `suspension`, from arrays of all cases in a row."""
    shape = suspension.shape

    def shaped(array):
        return array.reshape(shape + array.shape[1:])

    span = span_of_shape(spans(flat, state), (*shape, state.length.shape[-1]))
    cables = catenary.solve(span, shaped(state.tension))
    record = with_arrays(record, lambda array: shaped(array)[()])
    result = Equilibrium(suspension.broadcast(), shaped(state.position), shaped(state.rotation), cables, record)
    return _with_links(result, shaped(state.vector), shaped(state.extension)) if suspension.link_names else result


def _with_links(equilibrium, vector, extension):
    """The `Equilibrium` with its links, all of which have a length: the distance of their ends where none is stated.

    `vector` and `extension` are those of `PoseState`.
    """
    suspension, distance = equilibrium.suspension, size(vector)
    unstated, first_link = np.isnan(suspension.link_length), len(suspension.cable_names)
    coincident = distance <= STATICS.coincident_link_ends * distance.max(axis=-1, keepdims=True)
    link_distance = np.where(coincident, 0.0, distance)[..., first_link:]
    suspension = replace(suspension, link_length=np.where(unstated, link_distance, suspension.link_length))
    links = Links.of(suspension, vector[..., first_link:, :], np.where(unstated, 0.0, extension))
    return replace(equilibrium, suspension=suspension, links=links)


def span_of_shape(span, shape):
    """Cables of shape (n, c) in another shape of the same size."""
    return with_arrays(span, lambda array: array.reshape((*shape, *array.shape[2:])))
