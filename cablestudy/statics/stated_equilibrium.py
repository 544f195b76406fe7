"""Lengths with which cables have what they state while bodies are in equilibrium: Newton's method on both together.

The step (q, dL/L) of bodies and lengths solves

    [K, -G; M, D] [q; dL/L] = [0; -error],

with K the tangent stiffness, and the derivatives G of the net forces by dL/L, M of the stated values by q and D of the
stated values by dL/L; values are relative. A descent to equilibrium follows each step.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.records import assign_rows, copy_record, take_rows
from cablestudy.cable.vectors import size
from cablestudy.statics import block_stiffness, stated, tangent
from cablestudy.statics.descent import ROUNDED, UNMET, descend
from cablestudy.statics.fitted_lengths import fit_strains, linear_measure
from cablestudy.statics.pose_state import displaced, end_forces_and_stiffness, spans
from cablestudy.statics.rounding import Bounds, of_stated
from cablestudy.statics.tangent import GROUND
from cablestudy.statics.tolerances import STATICS


def satisfy_stated(suspension, state, record):
    """Change cable lengths until the tensions and sags are those stated, with the bodies in equilibrium.

    Each step of Newton's method changes lengths and poses together (`coupled_step`); a search for the equilibrium at
    these lengths follows (`backtrack`).

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables, and what is stated for these; with cases of shape (n,).
    state : PoseState
        In equilibrium with the first lengths.
    record : SearchRecord
        Of the search that led there.

    Returns
    -------
    PoseState
        Where the search ended, with its lengths.
    SearchRecord
        Why the search ended. UNMET: some value is not met. ROUNDED: the errors fall no further, and are within the
        rounding of lengths and positions (`Bounds.most`). Else the reason of the last search for an equilibrium: it
        failed, or all values are met to the rounding of sums (`Bounds.least`).
    """
    sought = np.flatnonzero([kind != "unstretched_length" for kind in suspension.stated])
    final, final_record = copy_record(state), copy_record(record)
    active, subset = np.arange(len(state.length)), suspension
    best_error, slow_steps = np.full(len(active), np.inf), np.zeros(len(active), dtype=int)
    error, _, cables = stated_errors(subset, state, sought)
    for _ in range(STATICS.equilibrium_steps):
        step, change = coupled_step(subset, state, cables, sought, error)
        state, error, rounding, cables, record = backtrack(subset, state, step, change, sought, error)
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


def backtrack(suspension, state, step, length_change, sought, error):
    """Line search: shorten a step of bodies and cable lengths until it lowers the errors of stated tensions and sags.

    After each trial step the bodies are brought to equilibrium, and only then are the errors compared. The trials of a
    case, until one is better:

    1. The whole step, with the given changes of length.
    2. The whole step of the bodies, where each cable gets the length with which it has its stated value at their new
       place. (Where bodies move far, linear changes of length are wrong by more than a stiff cable stretches.)
    3. A quarter of the step and of the changes of length, then a sixteenth, and so on. The last trial is returned even
       if it is no better.

    `step` and `length_change` are those of `coupled_step` from `state`, in which the cables `sought` have the relative
    errors `error`, as `stated_errors` gives them. The results are the last trial after the search for its equilibrium,
    what `stated_errors` returns of it, and the `SearchRecord` of that search.
    """
    error_before, share, refitted = log_error(error), np.ones(len(error)), np.zeros(len(error), dtype=bool)
    for number in range(STATICS.equilibrium_tries):
        trial = with_lengths(displaced(suspension, state, step * share[:, None, None]), length_change * share[:, None])
        trial = _with_stated_of(refitted, sought, suspension, trial) if refitted.any() else trial
        trial, record = descend(suspension, trial, STATICS.next_equilibrium_steps)
        trial_error, rounding, cables = stated_errors(suspension, trial, sought)
        larger = ~(log_error(trial_error) < error_before) & (np.abs(trial_error) > rounding.most).any(axis=-1)
        worse = larger | ~record.converged
        if not worse.any():
            break
        share = np.where(worse, share / 4, share) if number else share
        refitted = refitted & ~worse if number else worse
    return trial, trial_error, rounding, cables, record


def _with_stated_of(cases, sought, suspension, state):
    """`with_stated` of the cables `sought` in some cases, a mask, and the state as it is of the others."""
    fitted, chosen = with_stated(suspension, state), np.zeros(state.length.shape, dtype=bool)
    chosen[:, sought] = cases[:, None]
    strain, length = np.where(chosen, fitted.strain, state.strain), np.where(chosen, fitted.length, state.length)
    return replace(state, strain=strain, length=length)


def log_error(error):
    """Largest |log(value/(stated value))| of each case, from relative errors of shape (n, s), shape (n,)."""
    return np.abs(np.log(np.maximum(1 + error, STATICS.tiny))).max(axis=-1)


def stated_errors(suspension, state, sought):
    """Relative errors of the tensions and sags that are stated for cables, in a state.

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables, with the stated values.
    state : PoseState
        Pose and unstretched lengths, of n cases.
    sought : ndarray of int, shape (s,)
        Indices of the cables for which a tension or sag is stated in place of the length.

    Returns
    -------
    error : ndarray, shape (n, s)
        (Value in this state)/(stated value) - 1, infinite where it is NaN. [-]
    rounding : Bounds
        Of these errors.
    cables : Catenary
        Equilibria of all cables in this state.
    """
    cables = catenary.solve(spans(suspension, state), state.tension)
    error = (stated.actual_values(cables, suspension.stated) / suspension.value - 1)[:, sought]
    rounding = of_stated(state.ends[:, suspension.of_cables], state.strain, cables, suspension.stated, suspension.value)
    rounding = Bounds(rounding.least[:, sought], rounding.most[:, sought])
    return np.where(np.isfinite(error), error, np.inf), rounding, cables


def with_lengths(state, change):
    """State with unstretched lengths changed by dL/L, shape (n, c), the bodies at rest."""
    strain = stated.strain_at_changed_length(state.strain, change)
    unknown = np.full(state.tension.shape, np.nan)
    return replace(state, length=state.length * (1 + change), strain=strain, tension=unknown)


def with_stated(suspension, state):
    """State with the lengths for which the cables have what they state, in the same pose."""
    strain, _, tension = fit_strains(spans(suspension, state), suspension.stated, suspension.value, state.strain)
    return replace(state, strain=strain, length=size(state.chord) / (1 + strain), tension=tension)


def coupled_step(suspension, state, cables, sought, error):
    """Newton step of bodies and cable lengths together towards the stated tensions and sags.

    The step q of the bodies and the relative changes of length dL/L solve the equations of the module's docstring.
    Degrees of freedom are scaled, see `blocks.magnitudes`, and dL/L is divided by the dL/L for which D alone gives a
    relative change of 1. A step takes away an error of no more than `STATICS.error_in_step`, and changes no length by
    more than `STATICS.length_change`. The error of a sag is replaced by a measure that is nearly linear in L
    (`linear_measure`).

    Parameters
    ----------
    suspension : SuspendedSystem
    state : PoseState
        In equilibrium; n cases.
    cables, sought, error
        As of `stated_errors`.

    Returns
    -------
    step : ndarray, shape (n, b, 6)
        Displacement and rotation of each of the b bodies. [m], [rad]
    change : ndarray, shape (n, c)
        dL/L, zero for cables whose length is stated. [-]
    """
    rates, arms = stated.rates(cables, suspension.stated), state.arms[:, sought]
    forces, stiffness, _ = end_forces_and_stiffness(suspension, state, cables, rates.stiffness)
    blocks = tangent.stiffness_blocks(suspension, state.rotation, state.arms, forces, stiffness)
    measure, factor = linear_measure(error, np.array(suspension.stated, dtype=object)[sought])
    # a rate of a value, divided by this, is one of the measure of its error
    value = suspension.value[:, sought] / np.where(np.isfinite(factor), factor, 1.0)
    value_by_length = rates.by_length[:, sought] / value
    sign_of_end = np.array([-1.0, 1.0])[:, None]
    value_by_ends = rates.by_end[:, sought, None, :] * sign_of_end / value[..., None, None]  # (n, s, 2, 3)
    length_scale = np.where(value_by_length != 0, 1 / np.maximum(np.abs(value_by_length), STATICS.tiny), 1.0)
    equations = CoupledEquations(
        blocks,
        scales=np.sqrt(np.maximum(block_stiffness.magnitudes(blocks, suspension), STATICS.tiny)),
        sought=sought,
        force_by_length=tangent.wrenches(arms, rates.end_forces[:, sought]) * length_scale[..., None, None],
        value_by_motion=tangent.wrenches(arms, value_by_ends),
        value_by_length=value_by_length * length_scale,
        right=-np.clip(measure, -1.0, STATICS.error_in_step),
    )
    scaled_motion, scaled_change = equations.solve(suspension)
    step, changes = np.zeros((*state.position.shape[:-1], 6)), np.zeros(state.length.shape)
    # without a definite form, as for a slack cable without weight, there are no rates
    step[:, suspension.free] = np.nan_to_num(scaled_motion / equations.scales)
    changes[:, sought] = np.nan_to_num(scaled_change * length_scale)
    divisor = np.maximum(1.0, np.abs(changes).max(axis=-1) / STATICS.length_change)
    return step / divisor[:, None, None], changes / divisor[:, None]


@dataclass(frozen=True)
class CoupledEquations:
    """Scaled equations of the module's docstring: d free degrees of freedom of bodies and s lengths, in n cases.

    Attributes
    ----------
    blocks : block_stiffness.Blocks
        K, the tangent stiffness.
    scales : ndarray, shape (n, d)
        By which rows and columns of the degrees of freedom are divided. [sqrt(N/m)], [sqrt(N m/rad)]
    sought : ndarray of int, shape (s,)
        The cables whose lengths are sought.
    force_by_length, value_by_motion : ndarray, shape (n, s, 2, 6)
        G and M: derivatives of the force and moment at each of the two ends of these cables by dL/L, and of their
        relative stated values by displacement and rotation of what holds each end.
    value_by_length : ndarray, shape (n, s)
        Diagonal of D, the derivatives of the relative stated values by dL/L.
    right : ndarray, shape (n, s)
        Right-hand sides of the equations of the stated values, -error.
    """

    blocks: block_stiffness.Blocks
    scales: np.ndarray
    sought: np.ndarray
    force_by_length: np.ndarray
    value_by_motion: np.ndarray
    value_by_length: np.ndarray
    right: np.ndarray

    def solve(self, suspension):
        """Scaled motions, shape (n, d), and changes of length, shape (n, s)."""
        n, d = self.scales.shape
        right = np.concatenate([np.zeros((n, d)), self.right], axis=-1)
        if right.shape[-1] <= STATICS.dense_freedoms:
            solution = block_stiffness.solved(self._dense(suspension), right)
        else:
            from scipy.sparse.linalg import splu

            matrices = self._sparse(suspension)
            solution = np.array([splu(matrix).solve(vector) for matrix, vector in zip(matrices, right, strict=True)])
        return solution[:, :d], solution[:, d:]

    def _dense(self, suspension):
        """Matrices [K, -G; M, D] of all cases, shape (n, d + s, d + s)."""
        (n, d), s, scales = self.scales.shape, len(self.sought), self.scales[:, None, :]
        force_by_length = tangent.by_body(suspension, self.sought, self.force_by_length) / scales  # G^T, (n, s, d)
        value_by_motion = tangent.by_body(suspension, self.sought, self.value_by_motion) / scales  # M, (n, s, d)
        matrix = np.zeros((n, d + s, d + s))
        matrix[:, :d, :d] = block_stiffness.scaled_dense(self.blocks, suspension, self.scales)
        matrix[:, :d, :d] += STATICS.added_stiffness * np.eye(d)
        matrix[:, :d, d:] = -np.swapaxes(force_by_length, -1, -2)
        matrix[:, d:, :d] = value_by_motion
        matrix[:, d:, d:] = (self.value_by_length[:, None, :] + STATICS.added_stiffness) * np.eye(s)
        return matrix

    def _sparse(self, suspension):
        """Yield the sparse matrix [K, -G; M, D] of each case."""
        from scipy.sparse import block_array, coo_array, diags_array, eye_array

        shape = len(self.sought), self.scales.shape[-1]  # (s, d)
        owner = suspension.owner[self.sought]
        cable, end = np.nonzero(owner != GROUND)  # of each of e ends that a body holds
        freedom = block_stiffness.free_index(suspension.free)[owner[cable, end]]  # of motions of that body, (e, 6)
        is_free = freedom >= 0
        rows, columns = np.broadcast_to(cable[:, None], freedom.shape)[is_free], freedom[is_free]

        def by_freedom(at_ends, scales):
            """Sums for each cable over its two ends, of shape (s, 2, 6), in the columns of their bodies' motions."""
            return coo_array((at_ends[cable, end][is_free], (rows, columns)), shape) @ diags_array(1 / scales)

        for case, scales in enumerate(self.scales):
            stiffness = block_stiffness.scaled_sparse(self.blocks.of(case), suspension, scales)  # K
            stiffness = stiffness + STATICS.added_stiffness * eye_array(shape[1])
            force_by_length = by_freedom(self.force_by_length[case], scales)  # G^T
            value_by_motion = by_freedom(self.value_by_motion[case], scales)  # M
            value_by_length = diags_array(self.value_by_length[case] + STATICS.added_stiffness)  # D
            yield block_array([[stiffness, -force_by_length.T], [value_by_motion, value_by_length]]).tocsc()
