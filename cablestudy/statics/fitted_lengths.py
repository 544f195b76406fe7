"""Unstretched lengths with which cables between ends at rest have their stated values, found by iteration."""

import numpy as np

from cablestudy.cable import catenary, initial_length
from cablestudy.cable.vectors import size
from cablestudy.statics.stated import FORCES, actual_values, rates, strain_at_changed_length
from cablestudy.statics.tolerances import STATICS

EXACT = STATICS.sum_rounding * STATICS.rounding  # relative error of a stated value at which its length is found


def first_strains(span, quantities, value):
    """Estimate the unstretched lengths with which cables have a stated tension or sag, as the start of a search.

    A length is given as chord strain: chord over unstretched length, minus 1. Any stated tension is taken as the mean
    tension of the cable.

    Parameters
    ----------
    span : Span
        n cables between ends at rest.
    quantities : ndarray of object, shape (n,)
        Name of the stated quantity of each cable, such as "sag" or "preload"; None where nothing is stated.
    value : ndarray, shape (n,)
        Stated values: lengths and sags [m], tensions [N].

    Returns
    -------
    ndarray, shape (n,)
        Chord strains; 0 where nothing is stated or no length was found. [-]
    """
    strain = np.zeros(len(value))
    finders = dict.fromkeys(FORCES, initial_length.strains_for_tension) | {"sag": initial_length.strains_for_sag}
    for kind, find in finders.items():
        of_kind = np.flatnonzero(quantities == kind)
        if len(of_kind):
            strain[of_kind] = find(span.take(of_kind), value[of_kind])
    lengths = quantities == "unstretched_length"
    strain[lengths] = (span.chord[lengths] - value[lengths]) / value[lengths]
    return np.where(np.isfinite(strain), strain, 0.0)


def fit_strains(span, quantities, value, strain):
    """Find the unstretched lengths L with which cables between ends at rest have their stated tensions or sags.

    A length is given as chord strain: chord over L, minus 1.

    Parameters
    ----------
    span : Span
        Cables of shape (..., c); their own chord strains are not used.
    quantities : sequence of (str or None), one per cable
        Name of the stated quantity, such as "sag" or "preload" (mean tension); None where nothing is stated.
    value : ndarray, shape (..., c)
        Stated values: lengths and sags [m], tensions [N].
    strain : ndarray, shape (..., c)
        Chord strains at which the iteration begins. [-]

    Returns
    -------
    strain : ndarray, shape (..., c)
        Chord strains; those given where nothing is stated. [-]
    error : ndarray, shape (..., c)
        (Actual value)/(stated value) - 1 that is left; zero where nothing is stated. [-]
    tension : ndarray, shape (..., c, 3)
        Tension vectors at mid-length in the last step, global axes. [N]

    Notes
    -----
    Newton's method for ln L. The tension is a convex function of L unless a cable is very slack: the steps of a cable
    that begins too short then approach the solution from one side. The iteration of a cable ends with an error below
    `EXACT`, with one near rounding that no longer halves, or after `STATICS.stalled_steps` steps without progress. It
    is then left as it is, so that its digits do not depend on the other cables.
    """
    kinds = np.asarray(quantities, dtype=object)
    stated, of_force = np.array([kind is not None for kind in quantities]), np.isin(kinds, FORCES)
    highest_strain = np.where(of_force, _highest_strain(span, kinds, value), np.inf)
    strain = np.where(of_force, np.minimum(strain, highest_strain), strain)
    best_size, last_size, stalled_steps = np.inf, np.inf, 0  # sizes of errors, and steps since they last fell
    ended = np.zeros(np.shape(strain), dtype=bool)
    tension = np.full((*np.shape(strain), 3), np.nan)  # from which the catenaries begin
    for _ in range(STATICS.stated_steps):
        cables = catenary.solve(span.with_chord_strain(strain), tension)
        error = np.where(stated, actual_values(cables, quantities) / value - 1, 0.0)
        error = np.where(np.isfinite(error), error, 1.0)
        error_size = np.abs(error)
        stalled_steps = np.where(error_size < STATICS.falling_error * best_size, 0, stalled_steps + 1)
        best_size = np.minimum(error_size, best_size)
        stopped_by_rounding = (error_size < STATICS.stalled_error) & (error_size >= last_size / 2)
        ended |= (error_size < EXACT) | stopped_by_rounding | (stalled_steps >= STATICS.stalled_steps)
        if ended.all():
            break
        by_length = rates(cables, quantities).by_length
        next_strain = strain_at_changed_length(strain, _newton_step(error, by_length / value, kinds))
        too_long = of_force & (error < 0) & ~(by_length < 0)  # so long that a longer cable would be tauter
        next_strain = np.where(too_long, highest_strain, np.minimum(next_strain, highest_strain))
        strain, last_size = np.where(ended, strain, next_strain), error_size
        near = (error_size < STATICS.predicted_change)[..., None]
        tension = np.where(ended[..., None], tension, np.where(near, cables.middle_tension, np.nan))
    return strain, error, cables.middle_tension


def _newton_step(error, by_length, kinds):
    """Relative changes of length dL/L = -m/(dm/d ln L) of cables, no larger than `STATICS.stated_length_change`.

    `error` has the relative errors e of the stated values, of which `linear_measure` makes m, zero where nothing is
    stated, and `by_length` de/d ln L, both of shape (..., c); where the latter is zero or NaN the length
    stays.
    """
    measure, factor = linear_measure(error, kinds)
    slope = factor * by_length
    usable = (slope != 0) & np.isfinite(slope)
    change = np.where(usable, -measure / np.where(slope != 0, slope, 1.0), 0.0)
    return np.clip(np.nan_to_num(change), -STATICS.stated_length_change, STATICS.stated_length_change)


def linear_measure(error, kinds):
    """Measure of relative errors that is nearly linear in the length, for Newton steps, and its derivative by error.

    For a sag half of the relative error of its square, which is proportional to the slack of a stiff cable; for other
    stated quantities the relative error itself.

    Parameters
    ----------
    error : ndarray, shape (..., c)
    kinds : ndarray of object, shape (c,)

    Returns
    -------
    measure, factor : ndarray, shape (..., c)
    """
    sag = np.asarray(kinds, dtype=object) == "sag"
    return np.where(sag, error * (1 + error / 2), error), np.where(sag, 1 + error, 1.0)


def _highest_strain(span, kinds, value):
    """Chord strain of cables without mass under the largest mean tension that a stated one allows, shape (..., c)."""
    # an end may be the lower one
    heaviest = np.where(np.isin(kinds, ["tension_to", "tension_from"]), span.weight_per_length * span.chord, 0.0)
    heaviest = heaviest + np.where(kinds == "preload", 0.0, size(span.load_forces).sum(axis=-1))
    steepness = np.where(kinds == "horizontal_tension", np.maximum(np.abs(span.cosine), STATICS.steepest), 1.0)
    return (value + heaviest) / steepness / span.axial_stiffness


def least_preload(span):
    """Least mean tension ("preload") that cables between fixed ends can have, whatever their unstretched lengths.

    A shorter cable is stretched, a longer one hangs deeper: either raises the tension. The least tension of a
    horizontal cable that hardly stretches is 0.508 of its weight per length times its chord, at a length of 1.48
    chords. That of a vertical one is 0.5 of it, at a length of one chord.

    Parameters
    ----------
    span : Span
        Cables of shape (...); their point loads and own lengths are not used.

    Returns
    -------
    tension : ndarray, shape (...)
        Above the exact one by a relative error of at most `STATICS.least_tension_error`. [N]
    """
    # bounds of the logarithm of chord over unstretched length
    high = np.log1p(span.weight_per_length * span.chord / span.axial_stiffness)
    low = np.broadcast_to(-np.log(STATICS.slackest), high.shape)
    span, grid = span.without_loads(), np.linspace(0.0, 1.0, STATICS.slack_lengths).reshape(-1, *[1] * high.ndim)
    for _ in range(2):  # a coarse grid, then one between the neighbours of its lowest point
        trials = low + grid * (high - low)
        tension = catenary.solve(span.with_chord_strain(np.expm1(trials))).mean_tension
        lowest = tension.argmin(axis=0)[None]
        neighbours = (np.clip(lowest + side, 0, STATICS.slack_lengths - 1) for side in (-1, 1))
        low, high = (np.take_along_axis(trials, neighbour, axis=0)[0] for neighbour in neighbours)
    return tension.min(axis=0)
