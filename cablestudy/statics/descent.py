"""Pose of a suspension whose cables have given lengths: a guarded Newton iteration on its potential energy.

Without rotations and links the potential energy (`pose_state`) is convex, and Newton's method with a guarded step
converges from any start. With rotations, or springs that push, negative eigenvalues of the stiffness are taken by their
absolute value, so that every step descends.

Sources: Nocedal and Wright (2006), Numerical Optimization, section 3.4 (modified Newton); Hager and Zhang (2005), SIAM
J. Optim. 16, eq. 4.1 (acceptance of a step by its slope, where the change of energy is below its rounding).
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.matrices import factors_of_each, shifted_factors
from cablestudy.cable.records import assign_rows, copy_record, take_rows
from cablestudy.cable.vectors import dot, largest, size, times
from cablestudy.statics import block_stiffness, tangent
from cablestudy.statics.pose_state import displaced_with_work, evaluate, extent, longest, spans
from cablestudy.statics.rounding import largest_ratio
from cablestudy.statics.tangent import GROUND
from cablestudy.statics.tolerances import STATICS

CONVERGED, NO_DESCENT, TOO_MANY, UNMET, UNHELD, ROUNDED, DISAGREED, TURNING = range(8)
REASONS = (
    "converged",
    "no step lowers the energy",
    "no convergence in the largest number of steps",
    "no lengths were found for which the cables have what they state",
    "no tensions within the bounds hold the bodies where they shall be",
    "converged: no step leaves less, and what is left is the rounding of lengths and positions",
    "the forces of the wind and the positions that they lead to do not agree",
    "a body turns on and on",
)
# strains by the loads that softened cables have, in turn (`least_energy_poses`): cables ten times as stiff as before
# take few steps
SOFTENED = (0.3, 0.1, 0.03, *(10.0**-k for k in range(2, 13)))


@dataclass(frozen=True)
class SearchRecord:
    """How the pose searches went; all arrays have the shape of the cases.

    Attributes
    ----------
    steps : ndarray of int
        Newton steps.
    residual : ndarray
        Largest net force on a body over the sum of the forces on it. [-]
    correction : ndarray
        Size of the last step: over the longest chord, or in radians. [-]
    reason : ndarray of int
        Why the search stopped: index in REASONS.
    """

    steps: np.ndarray
    residual: np.ndarray
    correction: np.ndarray
    reason: np.ndarray

    @property
    def converged(self):
        """Shape (...)."""
        return (self.reason == CONVERGED) | (self.reason == ROUNDED)


def newton_step(suspension, state, evaluation):
    """Newton step of all bodies towards equilibrium, K^-1 times the net forces and moments on them: shape (n, b, 6).

    Where the tangent stiffness K is not positive definite, another step is taken, along which the net forces do
    positive work so that the energy falls. Degrees of freedom that are held have a step of zero. Where a displacement
    is larger than `STATICS.farthest_step` times the extent of the suspension, or a rotation larger than
    `STATICS.widest_turn`, the step of the whole case is shortened.
    """
    free = suspension.free
    force, end_forces = block_stiffness.free_values(suspension, evaluation.net), evaluation.end_forces
    blocks = tangent.stiffness_blocks(suspension, state.rotation, state.arms, end_forces, evaluation.end_stiffness)
    largest_step = np.ones((len(force), *free.shape)) * STATICS.widest_turn
    largest_step[..., :3] = STATICS.farthest_step * extent(state)[:, None, None]
    # where nothing holds a degree of freedom the step is small if the force is rounding, and else as large as allowed
    least_stiffness = np.maximum(np.abs(evaluation.net), evaluation.least_rounding) / largest_step
    least_stiffness = block_stiffness.free_values(suspension, least_stiffness)
    stiffness = np.maximum(block_stiffness.magnitudes(blocks, suspension), least_stiffness)
    scales = np.sqrt(np.maximum(stiffness, STATICS.tiny))
    if free.sum() <= STATICS.dense_freedoms:
        largest_scaled = block_stiffness.free_values(suspension, largest_step) * scales
        scaled = block_stiffness.scaled_dense(blocks, suspension, scales)
        scaled_step = _dense_step(scaled, force / scales, largest_scaled)
    else:
        scaled_step = np.empty(scales.shape)
        for case in range(len(force)):
            matrix = block_stiffness.scaled_sparse(blocks.of(case), suspension, scales[case])
            # a multiple of I is added until the stiffness is positive definite
            scaled_step[case] = shifted_factors(matrix, STATICS.flattest)[0].solve(force[case] / scales[case])
    step = np.zeros(largest_step.shape)
    step[:, free] = scaled_step / scales
    return step / np.maximum(1.0, largest(step / largest_step).max(axis=-1))[:, None, None]


def _dense_step(matrix, force, largest):
    """Steps of n cases that lower the potential energy, with dense matrices: Newton steps K^-1 g where these do.

    Where the stiffness K is not positive definite, or K^-1 g is too long, the step is

        sum over j of q_j (q_j^T g)/|k_j|

    with the eigenvalues k_j and eigenvectors q_j of the symmetric part of K. Each term is shortened by itself to the
    largest step allowed: a motion that nothing holds does not shorten the others.

    `matrix` is K, shape (n, d, d), and `force` the net forces and moments g, shape (n, d), both divided by the scales
    s_i of the d free degrees of freedom. `largest`, the largest size allowed, and the steps, both (n, d), are times
    s_i.
    """
    symmetric = (matrix + np.swapaxes(matrix, -1, -2)) / 2
    unit = np.eye(force.shape[-1])
    definite = np.isfinite(factors_of_each(symmetric - STATICS.flattest * unit)).all(axis=(-1, -2))
    regular = matrix if definite.all() else np.where(definite[:, None, None], matrix, unit)
    exact = block_stiffness.solved(regular, force)
    usable = definite & (np.abs(exact) <= largest).all(axis=-1)
    if usable.all():
        return exact
    values, vectors = np.linalg.eigh(symmetric)
    modal_force = (np.swapaxes(vectors, -1, -2) @ force[..., None])[..., 0]
    modal_steps = vectors * (modal_force / np.maximum(np.abs(values), STATICS.flattest))[:, None, :]
    modal_steps = modal_steps / np.maximum(1.0, (np.abs(modal_steps) / largest[..., None]).max(axis=-2))[:, None, :]
    return np.where(usable[:, None], exact, modal_steps.sum(axis=-1))


def imbalance(suspension, net, scale):
    """Largest net force on a free degree of freedom over the sum of forces on that body, shape (n,). [-]

    `scale`, shape (n, b), is the sum of the sizes of the forces on each body. [N]
    """
    free_net = np.where(suspension.free, net / tangent.motion_units(suspension), 0.0)
    return (largest(free_net) / np.maximum(scale, STATICS.tiny)).max(axis=-1, initial=0.0)


def _with_predicted_tensions(trial, state, evaluation):
    """State `trial` with the tensions that the end stiffness in `state` predicts, NaN where they change too much."""
    change = times(evaluation.end_stiffness[:, : state.length.shape[-1]], trial.chord - state.chord)
    near = size(change) <= STATICS.predicted_change * size(evaluation.tension)
    return replace(trial, tension=np.where(near[..., None], evaluation.tension + change, np.nan))


def line_search(suspension, state, evaluation, step):
    """Line search: shorten the steps of n cases until each lowers the potential energy enough (Armijo rule).

    A share x of a step is accepted where the energy falls by at least c x w. Here w is the work that constant net
    forces would do along the whole step, and c is `STATICS.sufficient_descent`. Where the change of energy is no more
    than rounding, the share is accepted if the energy does not rise too steeply at its end (Hager and Zhang).

    `evaluation` is that of `state`. Returned are the state after the shortened steps, its `Evaluation`, and x, shape
    (n,): zero where none was accepted, and state and evaluation are unchanged.
    """
    descent = (evaluation.net * step).sum(axis=(-1, -2))  # of the energy, by the share of the step: the forces' work
    share, accepted = np.ones(len(descent)), np.zeros(len(descent), dtype=bool)
    new_state, new_evaluation = state, evaluation
    pending = np.arange(len(descent))  # cases whose step is not yet accepted
    subset, before, at_before = suspension, state, evaluation
    for _ in range(STATICS.descent_halvings):
        shortened = step[pending] * share[pending, None, None]
        trial, work = displaced_with_work(subset, before, shortened)
        at_trial = evaluate(subset, _with_predicted_tensions(trial, before, at_before))
        change = at_trial.energy - at_before.energy - work
        rounding = at_trial.energy_rounding + at_before.energy_rounding
        descent_at_trial = (at_trial.net * step[pending]).sum(axis=(-1, -2))
        falls = change <= -STATICS.sufficient_descent * share[pending] * descent[pending]
        flat = (change <= rounding) & (descent_at_trial >= -(1 - 2 * STATICS.slope_change) * descent[pending])
        good = at_trial.solved & (falls | flat)
        if not accepted.any():
            if good.all():
                return trial, at_trial, share
            new_state, new_evaluation = copy_record(state), copy_record(evaluation)
        assign_rows(new_state, pending[good], take_rows(trial, good))
        assign_rows(new_evaluation, pending[good], take_rows(at_trial, good))
        accepted[pending[good]] = True
        # where the slope along the step vanishes, by the secant; a whole step at most
        secant = descent[pending] / np.maximum(descent[pending] - np.minimum(descent_at_trial, 0.0), STATICS.tiny)
        factor = np.where(at_trial.solved, np.clip(secant, 0.05, 0.5), 0.25)
        pending, factor = pending[~good], factor[~good]
        share[pending] *= factor
        if not len(pending):
            break
        subset, before, at_before = suspension.take(pending), take_rows(state, pending), take_rows(evaluation, pending)
    return new_state, new_evaluation, np.where(accepted, share, 0.0)


def descend(suspension, state, most_steps=STATICS.descent_steps, small_net_force=0.0):
    """Find poses of least potential energy, in which the forces balance, from given starts by Newton steps.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,). The unstretched lengths of the cables are those of `state`; other values that cables
        state, such as a tension, have no influence.
    state : PoseState
        Where the searches begin; its tensions are not used.
    most_steps : int
        Number of steps after which a search ends. Without rotations and links the energy is convex, so that there is
        one equilibrium only. Then a search goes on while whole steps leave no more than `STATICS.descent_settling` of
        the net force, up to `STATICS.descent_steps`.
    small_net_force : float
        Net force over the sum of forces that counts as balance, even if it is more than rounding. [-]

    Returns
    -------
    PoseState
        Where each search ended. The digits of a case do not depend on the other cases.
    SearchRecord
        For each case the number of steps, what they left, and why the search ended.
    """
    cases = len(state.length)
    if not suspension.free.any():
        zero = np.zeros(cases)
        return state, SearchRecord(zero.astype(int), zero, zero, np.full(cases, CONVERGED))
    final = copy_record(state)
    record = SearchRecord(np.zeros(cases, dtype=int), np.zeros(cases), np.zeros(cases), np.zeros(cases, dtype=int))
    # from no known tensions, which may be those of other cables; many searches begin in one pose
    evaluation = evaluate(suspension, state, catenary.solve_each_once(spans(suspension, state)))
    active, subset = np.arange(cases), suspension
    best_ratio, slow_steps = np.full(cases, np.inf), np.zeros(cases, dtype=int)
    axis = suspension.moment / np.maximum(size(suspension.moment), STATICS.tiny)[..., None]
    turned = np.zeros(axis.shape[:-1])  # by each body about the dead moment on it [rad]
    convex = not (suspension.free[:, 3:].any() or suspension.link_names)
    for number in range(STATICS.descent_steps if convex else most_steps):
        step = newton_step(subset, state, evaluation)
        change = np.maximum(size(step[..., :3]).max(axis=-1) / longest(state), size(step[..., 3:]).max(axis=-1))
        state, evaluation, share = line_search(subset, state, evaluation, step)
        turned[active] += share[:, None] * dot(step[..., 3:], axis[active])
        relative_force = imbalance(subset, evaluation.net, evaluation.scale)
        rounding_ratio = largest_ratio(subset, evaluation.net, evaluation.least_rounding)
        slow = rounding_ratio > STATICS.descent_progress * best_ratio[active]
        slow_steps[active] = np.where(slow, slow_steps[active] + 1, 0)
        best_ratio[active] = np.minimum(best_ratio[active], rounding_ratio)
        converged = (rounding_ratio <= 1) | (relative_force < small_net_force)
        patience_over = slow_steps[active] >= STATICS.descent_patience
        stuck = (share == 0) | patience_over | (number == STATICS.descent_steps - 1)
        rounded = stuck & (largest_ratio(subset, evaluation.net, evaluation.most_rounding) <= 1)
        residual_before = record.residual[active]
        turning = turned[active].max(axis=-1) > STATICS.most_turned
        failure = np.where(share == 0, NO_DESCENT, np.where(turning, TURNING, TOO_MANY))
        reason = np.where(converged, CONVERGED, np.where(rounded, ROUNDED, failure))
        assign_rows(record, active, SearchRecord(np.full(len(active), number + 1), relative_force, change, reason))
        assign_rows(final, active, replace(state, tension=evaluation.tension))
        going_on = ~(converged | rounded | turning | (share == 0))
        if number >= most_steps - 1:
            going_on &= (share == 1) & (relative_force <= STATICS.descent_settling * residual_before)
        if not going_on.all():
            active, state, evaluation = active[going_on], take_rows(state, going_on), take_rows(evaluation, going_on)
            subset = suspension.take(active)
        if not len(active):
            break
    return final, record


def typical_loads(suspension, state):
    """For each cable the smaller one of the loads on the bodies at its ends, shape (n, c), 0 between fixed ends. [N]

    Loads on a body are its weight, its dead force and moment, and the weights of the cables at it with their loads.
    """
    gravity = np.abs(suspension.gravity)[:, None]
    weight = suspension.cable_mass * gravity * state.length
    if suspension.load_forces is not None:
        weight = weight + size(suspension.load_forces).sum(axis=-1)
    loads = (
        suspension.mass * gravity + size(suspension.force) + size(suspension.moment) / tangent.body_sizes(suspension)
    )
    owner = suspension.owner[suspension.of_cables]
    cable, end = np.nonzero(owner != GROUND)
    np.add.at(loads, (slice(None), owner[cable, end]), weight[:, cable])
    load_of_ground = np.full((len(loads), 1), np.inf)  # the last one, which GROUND as an index takes
    smaller = np.concatenate([loads, load_of_ground], axis=-1)[:, owner].min(axis=-1)
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _softened_links(suspension, state, strain):
    """Stiffness of the links, limited to that of the cables while these are softened to a strain, shape (n, l). [N/m]

    The limit is the larger one of the largest EA and the dead loads over the longest cable, and grows as the strain
    falls. None without links.
    """
    if not suspension.link_names:
        return None
    dead_loads = (suspension.mass * np.abs(suspension.gravity)[:, None] + size(suspension.force)).sum(axis=-1)
    limit = np.maximum(suspension.axial_stiffness.max(axis=-1, initial=0.0), dead_loads) / longest(state)
    return np.minimum(suspension.link_stiffness, SOFTENED[0] / strain * limit[:, None])


def least_energy_poses(suspension, state):
    """Find equilibria, poses of least potential energy: straight from the start or, where this fails, by softer cables.

    Stiff cables make a narrow, curved valley of the energy, in which Newton steps are short. Cables so soft that the
    loads strain them by a third make it wide. Their equilibrium is the start of the search with stiffer ones, and so on
    (`SOFTENED`). The stiffness of links (springs) is limited alike. Returned are the states in which the search with
    the actual stiffness ended, and its `SearchRecord`.
    """
    final, record = descend(suspension, state, STATICS.straight_steps)
    failed = np.flatnonzero(~record.converged)
    if not len(failed):
        return final, record
    subset, state = suspension.take(failed), take_rows(state, failed)
    loads, stiffness = typical_loads(subset, state), subset.axial_stiffness
    for strain in SOFTENED:
        softened = np.minimum(stiffness, np.where(loads > 0, loads / strain, np.inf))
        links = _softened_links(subset, state, strain)
        softer = (softened < stiffness).any(axis=-1)
        softer = softer if links is None else softer | (links < subset.link_stiffness).any(axis=-1)
        pending = np.flatnonzero(softer)
        if not len(pending):
            break
        soft = replace(subset, axial_stiffness=softened, link_stiffness=links).take(pending)
        soft_state, _ = descend(soft, take_rows(state, pending), STATICS.soft_steps, STATICS.soft_net_force)
        assign_rows(state, pending, soft_state)
        # the next stiffness follows from the tensions found, between the typical loads and a multiple of all of them
        tension = catenary.solve(spans(soft, soft_state)).max_tension
        largest = STATICS.soft_tension * loads[pending].sum(axis=-1, keepdims=True)
        loads[pending] = np.clip(tension, loads[pending], largest)
    state, record_of_failed = descend(subset, state)
    assign_rows(final, failed, state)
    assign_rows(record, failed, record_of_failed)
    return final, record
