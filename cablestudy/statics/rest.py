"""Statics of suspensions with given lengths, preloads, sags or tensions: where the bodies come to rest (`pose`)."""

from dataclasses import dataclass, fields, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.vectors import largest, size
from cablestudy.errors import NoSolutionError
from cablestudy.statics import stated, tangent
from cablestudy.statics.descent import ROUNDED, UNMET, descend, least_energy_poses
from cablestudy.statics.links import Links
from cablestudy.statics.pose_state import (
    TINY,
    PoseState,
    assign_rows,
    copy_record,
    displaced,
    end_forces_and_stiffness,
    extent,
    spans,
    take_rows,
)
from cablestudy.statics.rounding import Bounds, of_stated
from cablestudy.statics.stability import UNSTABLE
from cablestudy.statics.suspension import GROUND, STATED, Equilibrium
from cablestudy.statics.tolerances import STATICS


def pose(suspension):
    """Find the equilibrium of a suspension: its free degrees of freedom, and the lengths that are not stated.

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
    Stated preloads, sags and tensions are met by Newton's method on the lengths, about poses of least energy. Cases
    that do not meet them are searched again by way of softer or heavier cables. Unstable equilibria are left for
    others.
    """
    refuse_unheld(suspension)
    unstated = [name for name, kind in zip(suspension.cable_names, suspension.stated, strict=True) if kind is None]
    if unstated:
        raise NoSolutionError(f"{', '.join(unstated)}: states none of {', '.join(STATED)}")
    shape = suspension.shape
    flat = suspension.broadcast((int(np.prod(shape)),))
    state, record = search_all(flat, start(flat))
    weightless = (flat.cable_mass == 0).any(axis=-1) & (flat.gravity != 0)
    for search, cases in ((search_with_softer_cables, True), (search_with_heavier_cables, weightless)):
        unmet = np.flatnonzero((record.reason == UNMET) & cases)
        if len(unmet):
            record = copy_record(record)
            # where this search fails too, the state and record of the first one are kept: they are nearer to the scene
            _assign_converged(state, record, unmet, *search(flat.take(unmet)))
    return leave_saddle_points(suspension, flat, state, record)


def _assign_converged(state, record, index, new_state, new_record):
    """Write the states and records of another search of the cases at `index` into all, where it converged."""
    converged = new_record.converged
    assign_rows(state, index[converged], take_rows(new_state, converged))
    assign_rows(record, index[converged], take_rows(new_record, converged))


def leave_saddle_points(suspension, flat, state, record):
    """`Equilibrium` of all cases, unstable ones replaced by those to which the suspension falls from there.

    Parameters
    ----------
    suspension, flat : SuspendedSystem
        The cases in their shape, and of shape (n,).
    state : PoseState
    record : SearchRecord

    Notes
    -----
    A search that begins on a saddle of the energy stays there, where the forces balance. So another search begins
    beside the saddle, a step along the unstable motion away; cases that stay unstable try the other steps of
    `STATICS.off_saddle`.
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
    return equilibrium(suspension, flat, state, record)


def perturbed(suspension, state, motion, step_size):
    """State after a step along motions of `Stability`, to leave a saddle of the energy.

    The largest rotation of the step, or displacement over extent of the suspension, is `step_size`.
    """
    step = motion.copy()
    step[..., :3] /= extent(state)[:, None, None]
    step[..., 3:] /= tangent.body_sizes(suspension)[..., None]
    step *= step_size / np.maximum(largest(step).max(axis=-1), TINY)[:, None, None]
    step[..., :3] *= extent(state)[:, None, None]
    return displaced(suspension, state, step)


def search_all(suspension, state):
    """Find the pose, and the lengths with which cables have their stated values: `PoseState`, `SearchRecord`."""
    state, record = least_energy_poses(suspension, state)
    if set(suspension.stated) - {"unstretched_length"}:
        state, record = satisfy_stated(suspension, state, record)
    return state, record


def search_with_softer_cables(suspension):
    """Pose and lengths as of `search_all`, by way of softer cables where something else than a length is stated.

    For stated tensions the pose hardly depends on the stiffness, but the search for it does: between stiff cables a
    small movement makes large tensions.
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


def search_with_heavier_cables(suspension):
    """Pose and lengths as of `search_with_softer_cables`, by way of a little weight of cables that have none.

    While a cable without weight is slack, the lengths of others may change no tension, and lead a search nowhere.
    """
    first_state = start(suspension)
    tension = catenary.solve(spans(suspension, first_state)).mean_tension.max(axis=-1, keepdims=True)
    gravity = np.maximum(np.abs(suspension.gravity), TINY)
    mass = STATICS.little_weight * tension / (gravity * extent(first_state))[:, None]
    heavier = replace(suspension, cable_mass=np.where(suspension.cable_mass > 0, suspension.cable_mass, mass))
    state, _ = search_with_softer_cables(heavier)
    from_heavier = replace(suspension, position=state.position, rotation=state.rotation)
    return search_all(from_heavier, start(from_heavier))


def start(suspension):
    """`PoseState` in which a search begins: lengths for which the cables have what they state where the bodies are.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).
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
    strain[sought] = stated.first_strains(span, kinds, value[sought])
    return replace(state, strain=strain, length=distance[:, cables] / (1 + strain))


def with_lengths(state, change):
    """State with unstretched lengths changed by dL/L, shape (n, c), the bodies at rest."""
    strain = stated.with_relative_length(state.strain, change)
    unknown = np.full(state.tension.shape, np.nan)
    return replace(state, length=state.length * (1 + change), strain=strain, tension=unknown)


def with_stated(suspension, state):
    """State with the lengths for which the cables have what they state, in the same pose."""
    strain, _, tension = stated.fit_strains(spans(suspension, state), suspension.stated, suspension.value, state.strain)
    return replace(state, strain=strain, length=size(state.chord) / (1 + strain), tension=tension)


def stated_errors(suspension, state, which):
    """Errors of stated preloads, sags and tensions in a state.

    Parameters
    ----------
    suspension : SuspendedSystem
    state : PoseState
    which : ndarray of int, shape (s,)
        The cables that state one of these.

    Returns
    -------
    error : ndarray, shape (n, s)
        (Value in this state)/(stated value) - 1, infinite where it is not a number. [-]
    rounding : Bounds
        Of these errors.
    cables : Catenary
        All of them.
    """
    cables = catenary.solve(spans(suspension, state), state.tension)
    error = (stated.actual_values(cables, suspension.stated) / suspension.value - 1)[:, which]
    rounding = of_stated(state.ends[:, suspension.of_cables], state.strain, cables, suspension.stated, suspension.value)
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
    SearchRecord
        With the reason UNMET where the values are not met, and ROUNDED where the errors fall no further and are below
        `Bounds.most`; else that of the last search for an equilibrium.
    """
    which = np.flatnonzero([kind != "unstretched_length" for kind in suspension.stated])
    final, final_record = copy_record(state), copy_record(record)
    active, subset = np.arange(len(state.length)), suspension
    best_error, slow_steps = np.full(len(active), np.inf), np.zeros(len(active), dtype=int)
    error, _, cables = stated_errors(subset, state, which)
    for _ in range(STATICS.equilibrium_steps):
        step, change = coupled_step(subset, state, cables, which, error)
        state, error, rounding, cables, record = backtrack(subset, state, step, change, which, error)
        assign_rows(final, active, state)
        assign_rows(final_record, active, replace(record, steps=final_record.steps[active] + record.steps))
        met = (np.abs(error) <= rounding.least).all(axis=-1)
        largest_error = log_error(error)
        slow = (largest_error > STATICS.equilibrium_progress * best_error[active]) | np.isinf(largest_error)
        slow_steps[active] = np.where(slow, slow_steps[active] + 1, 0)
        best_error[active] = np.minimum(best_error[active], largest_error)
        stuck = slow_steps[active] >= STATICS.equilibrium_patience
        rounded = stuck & (np.abs(error) <= rounding.most).all(axis=-1)
        answered = met | ~record.converged
        final_record.reason[active] = np.where(answered, record.reason, np.where(rounded, ROUNDED, UNMET))
        going_on = np.flatnonzero(~(answered | stuck))
        if not len(going_on):
            break
        if len(going_on) < len(active):
            active, state, error = active[going_on], take_rows(state, going_on), error[going_on]
            subset = suspension.take(active)
            cables = catenary.solve(spans(subset, state), state.tension)
    return final, final_record


def backtrack(suspension, state, step, length_change, which, error):
    """Shorten steps of bodies and lengths until they lower the errors of stated values, in equilibrium after each.

    Where bodies move far, lengths that follow linearly are wrong by more than stiff cables stretch: before a step is
    shortened, the whole of it is tried with those for which the cables have what they state where it leads. A step that
    is no better after the last try is returned as it is.

    Parameters
    ----------
    suspension, state, which, error
        As of `stated_errors`.
    step, length_change
        As of `coupled_step`.

    Returns
    -------
    state : PoseState
    error, rounding, cables
        As of `stated_errors`, in this state.
    record : SearchRecord
        Of the search for the equilibrium.
    """
    error_before, share, fitted = log_error(error), np.ones(len(error)), np.zeros(len(error), dtype=bool)
    for number in range(STATICS.equilibrium_tries):
        trial = with_lengths(displaced(suspension, state, step * share[:, None, None]), length_change * share[:, None])
        trial = _with_stated_of(fitted, which, suspension, trial) if fitted.any() else trial
        trial, record = descend(suspension, trial, STATICS.next_equilibrium_steps)
        trial_error, rounding, cables = stated_errors(suspension, trial, which)
        larger = ~(log_error(trial_error) < error_before) & (np.abs(trial_error) > rounding.most).any(axis=-1)
        worse = larger | ~record.converged
        if not worse.any():
            break
        share = np.where(worse, share / 4, share) if number else share
        fitted = fitted & ~worse if number else worse
    return trial, trial_error, rounding, cables, record


def _with_stated_of(cases, which, suspension, state):
    """`with_stated` of the cables `which` in some cases, a mask, and the state as it is of the others."""
    fitted, chosen = with_stated(suspension, state), np.zeros(state.length.shape, dtype=bool)
    chosen[:, which] = cases[:, None]
    strain, length = np.where(chosen, fitted.strain, state.strain), np.where(chosen, fitted.length, state.length)
    return replace(state, strain=strain, length=length)


def log_error(error):
    """Largest |log(value/(stated value))| of each case, from relative errors of shape (n, s), shape (n,)."""
    return np.abs(np.log(np.maximum(1 + error, TINY))).max(axis=-1)


def coupled_step(suspension, state, cables, which, error):
    """Newton step of bodies and lengths together towards what the cables `which` state.

    Parameters
    ----------
    suspension, state, which
        As of `stated_errors`, `cables` and `error` its results.

    Returns
    -------
    step : ndarray, shape (n, b, 6)
        [m], [rad]
    change : ndarray, shape (n, c)
        dL/L. [-]

    Notes
    -----
    [K, -G; M, D] [q; dL/L] = [0; -error], with K the tangent stiffness, q the step, and the derivatives G of the net
    forces by dL/L, M of the stated values by q and D of the stated values by dL/L; values are relative. Degrees of
    freedom are scaled, see `tangent.magnitudes`, and dL/L is divided by the dL/L for which D alone gives a relative
    change of 1. A step takes away an error of no more than `error_in_step`, and changes no length by more
    than `length_change`.
    """
    rates = stated.rates(cables, suspension.stated)
    forces, stiffness, _ = end_forces_and_stiffness(suspension, state, cables, rates.stiffness)
    blocks = tangent.stiffness_blocks(suspension, state.rotation, state.arms, forces, stiffness)
    measure, factor = stated.linear_measure(error, np.array(suspension.stated, dtype=object)[which])
    value = suspension.value[:, which] / np.where(np.isfinite(factor), factor, 1.0)
    end_sign = np.array([-1.0, 1.0])[:, None]
    value_by_ends = rates.by_end[:, which, None, :] * end_sign / value[..., None, None]
    value_by_length = rates.by_length[:, which] / value
    length_scale = np.where(value_by_length != 0, 1 / np.maximum(np.abs(value_by_length), TINY), 1.0)
    force_by_length = tangent.wrenches(state.arms[:, which], rates.end_forces[:, which])
    equations = CoupledEquations(
        blocks,
        scales=np.sqrt(np.maximum(tangent.magnitudes(blocks, suspension), TINY)),
        which=which,
        force_by_length=force_by_length * length_scale[..., None, None],
        value_by_motion=tangent.wrenches(state.arms[:, which], value_by_ends),
        value_by_length=value_by_length * length_scale,
        right=-np.clip(measure, -1.0, STATICS.error_in_step),
    )
    motion, change = equations.solve(suspension)
    step, changes = np.zeros((*state.position.shape[:-1], 6)), np.zeros(state.length.shape)
    # without a definite form, as of a slack cable without weight, there are no rates
    step[:, suspension.free] = np.nan_to_num(motion / equations.scales)
    changes[:, which] = np.nan_to_num(change * length_scale)
    divisor = np.maximum(1.0, np.abs(changes).max(axis=-1) / STATICS.length_change)
    return step / divisor[:, None, None], changes / divisor[:, None]


@dataclass(frozen=True)
class CoupledEquations:
    """Scaled equations of `coupled_step`: d free degrees of freedom of bodies and s lengths in each of n cases.

    Attributes
    ----------
    blocks : tangent.Blocks
        K.
    scales : ndarray, shape (n, d)
        By which rows and columns of the degrees of freedom are divided. [sqrt(N/m)], [sqrt(N m/rad)]
    which : ndarray of int, shape (s,)
        The cables whose lengths are sought.
    force_by_length, value_by_motion : ndarray, shape (n, s, 2, 6)
        G and M, for force, moment, displacement and rotation of what holds each of the two ends of these cables.
    value_by_length : ndarray, shape (n, s)
        Diagonal of D.
    right : ndarray, shape (n, s)
        Right-hand sides of the equations of the stated values, -error.
    """

    blocks: tangent.Blocks
    scales: np.ndarray
    which: np.ndarray
    force_by_length: np.ndarray
    value_by_motion: np.ndarray
    value_by_length: np.ndarray
    right: np.ndarray

    def solve(self, suspension):
        """Scaled motions, shape (n, d), and changes of length, shape (n, s)."""
        n, d = self.scales.shape
        right = np.concatenate([np.zeros((n, d)), self.right], axis=-1)
        if right.shape[-1] <= STATICS.dense_freedoms:
            solution = tangent.solved(self._dense(suspension), right)
        else:
            from scipy.sparse.linalg import splu

            matrices = self._sparse(suspension)
            solution = np.array([splu(matrix).solve(vector) for matrix, vector in zip(matrices, right, strict=True)])
        return solution[:, :d], solution[:, d:]

    def _dense(self, suspension):
        """Matrices of all cases, shape (n, d + s, d + s)."""
        (n, d), s, scales = self.scales.shape, len(self.which), self.scales[:, None, :]
        columns = tangent.by_body(suspension, self.which, self.force_by_length) / scales
        rows = tangent.by_body(suspension, self.which, self.value_by_motion) / scales
        matrix = np.zeros((n, d + s, d + s))
        matrix[:, :d, :d] = tangent.scaled_dense(self.blocks, suspension, self.scales)
        matrix[:, :d, :d] += STATICS.added_stiffness * np.eye(d)
        matrix[:, :d, d:], matrix[:, d:, :d] = -np.swapaxes(columns, -1, -2), rows
        matrix[:, d:, d:] = (self.value_by_length[:, None, :] + STATICS.added_stiffness) * np.eye(s)
        return matrix

    def _sparse(self, suspension):
        """Yield the matrix of each case: scaled [K, -G; M, D] of `coupled_step`, csc_array of shape (d + s, d + s)."""
        from scipy.sparse import block_array, coo_array, diags_array, eye_array

        d, s, free = self.scales.shape[-1], len(self.which), suspension.free
        owner = suspension.owner[self.which]
        number = np.where(free.ravel(), np.cumsum(free) - 1, -1).reshape(free.shape)
        cable, end = np.nonzero(owner != GROUND)
        column = number[owner[cable, end]]  # shape (ends, 6), -1 where held
        is_free = column >= 0
        position = np.broadcast_to(cable[:, None], column.shape)[is_free], column[is_free]
        for case, scales in enumerate(self.scales):
            columns, rows = (
                coo_array((entries[case, cable, end][is_free], position), shape=(s, d)) @ diags_array(1 / scales)
                for entries in (self.force_by_length, self.value_by_motion)
            )
            stiffness = tangent.scaled_sparse(self.blocks.of(case), suspension, scales)
            stiffness = stiffness + STATICS.added_stiffness * eye_array(d)
            by_length = diags_array(self.value_by_length[case] + STATICS.added_stiffness)
            yield block_array([[stiffness, -columns.T], [rows, by_length]]).tocsc()


def refuse_unheld(suspension):
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
    record = replace(record, **{f.name: shaped(getattr(record, f.name))[()] for f in fields(record)})
    result = Equilibrium(suspension.broadcast(), shaped(state.position), shaped(state.rotation), cables, record)
    return _with_links(result, shaped(state.vector), shaped(state.extension)) if suspension.link_names else result


def _with_links(equilibrium, vector, extension):
    """The `Equilibrium` with its links, all of which have a length: the distance of their ends where none is stated.

    Parameters
    ----------
    equilibrium : Equilibrium
        Without links.
    vector, extension
        As of `PoseState`.
    """
    suspension, distance = equilibrium.suspension, size(vector)
    unstated, first_link = np.isnan(suspension.link_length), len(suspension.cable_names)
    coincident = distance <= STATICS.link_places * distance.max(axis=-1, keepdims=True)
    link_distance = np.where(coincident, 0.0, distance)[..., first_link:]
    suspension = replace(suspension, link_length=np.where(unstated, link_distance, suspension.link_length))
    links = Links.of(suspension, vector[..., first_link:, :], np.where(unstated, 0.0, extension))
    return replace(equilibrium, suspension=suspension, links=links)


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
