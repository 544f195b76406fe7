"""Values that a cable may state instead of its unstretched length (tensions, sag), and how they depend on it.

With N the tension vector at mid-length, P_1, P_2 the tension vectors at the ends, T_1, T_2 their sizes, d the vector
from end 1 to end 2 and K the stiffness, at ends that do not move

    dN/dL = -K (P_1/T_1 + P_2/T_2 + (P_1 + P_2)/EA)/2,

since a longer cable moves either end out by (1 + T/EA) dL/2 along its tangent. For the mean tension T_m

    dT_m/dN = d/L - N/EA,     dT_m/dL = ((T_1 + T_2)/2 - T_m)/L at given N,

because L (T_m + (|N|^2 + (w L)^2/12)/(2 EA)) is the complementary energy, whose derivative by N is d. Of cables with
point loads, and of sags, the derivatives are central differences.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary, initial_length
from cablestudy.cable.span import Span
from cablestudy.system.rigid import size
from cablestudy.system.tolerances import SYSTEM

EXACT = SYSTEM.sum_rounding * SYSTEM.rounding  # relative error of a stated value at which its length is found
FORCES = ["preload", "tension_to", "tension_from", "horizontal_tension", "max_tension"]
LEVEL = np.array([1.0, 1.0, 0.0])


@dataclass(frozen=True)
class Rates:
    """Derivatives of cables between ends, per relative change dL/L of their unstretched lengths.

    Attributes
    ----------
    end_forces : ndarray, shape (..., c, 2, 3)
        Of the force on each end, global axes, by dL/L. [N]
    stiffness : ndarray, shape (..., c, 3, 3)
        dN/dd, global axes. [N/m]
    by_length : ndarray, shape (..., c)
        Of the stated quantity by dL/L; not a number where nothing is stated. [N] or [m]
    by_end : ndarray, shape (..., c, 3)
        Of the stated quantity by the place of end 2, global axes; zero where nothing is stated. [N/m] or [-]
    """

    end_forces: np.ndarray
    stiffness: np.ndarray
    by_length: np.ndarray
    by_end: np.ndarray


def values(cables, given):
    """Of what each cable states.

    Parameters
    ----------
    cables : Catenary
        Of shape (..., c).
    given : sequence of (str or None)
        One of `suspension.GIVEN`, or None, for each cable.

    Returns
    -------
    ndarray, shape (..., c)
        Not a number where nothing is stated. [m] or [N]
    """
    kinds = np.asarray(given, dtype=object)
    result, loaded = np.full(np.shape(cables.span.chord), np.nan), cables.span.load_positions.shape[-1] > 0
    quantities = {
        "unstretched_length": lambda: cables.span.unstretched_length,
        "preload": lambda: cables.mean_tension,
        "sag": lambda: cables.sag,
        "tension_to": lambda: size(cables.end_forces("global")[..., 1, :]),
        "tension_from": lambda: size(cables.end_forces("global")[..., 0, :]),
        "horizontal_tension": lambda: (
            cables.horizontal_tension if loaded else size(cables.end_forces("global")[..., 0, :2])
        ),
        "max_tension": lambda: cables.max_tension if loaded else size(cables.end_forces("global")).max(axis=-1),
    }
    for kind, quantity in quantities.items():
        if (kinds == kind).any():
            result = np.where(kinds == kind, quantity(), result)
    return result


def rates(cables, given):
    """Derivatives of the end forces and of what is stated: `Rates`.

    Parameters
    ----------
    cables, given
        As for `values`.
    """
    span, kinds = cables.span, np.asarray(given, dtype=object)
    if span.load_positions.shape[-1]:
        return _rates_with_loads(cables, given)
    length, stiffness = span.unstretched_length, cables.global_end_stiffness
    middle, half, *_ = _at_ends(cables)
    by_length = -(stiffness @ _outward(cables)[..., None])[..., 0]
    end_forces = np.stack([by_length - half, -by_length - half], axis=-2)
    gradients = _gradients(cables, kinds) if np.isin(kinds, FORCES).any() else {}
    own = np.where(kinds == "unstretched_length", length, np.nan)
    across = np.zeros_like(middle)
    for kind, (gradient, direct) in gradients.items():
        chosen = kinds == kind
        own = np.where(chosen, (gradient * by_length).sum(axis=-1) + direct, own)
        across = np.where(chosen[..., None], (stiffness @ gradient[..., None])[..., 0], across)
    if (kinds == "sag").any():
        sag = _differences(span, lambda moved: moved.sag[..., None], _slack_step(span))[..., 0, :]
        own = np.where(kinds == "sag", sag[..., 0], own)
        across = np.where((kinds == "sag")[..., None], sag[..., 1:], across)
    return Rates(end_forces, stiffness, own, across)


def _at_ends(cables):
    """Mean of the tension vectors at the ends, half of their difference, their sizes and directions; global axes."""
    forces = cables.end_forces("global")
    first, last = forces[..., 0, :], -forces[..., 1, :]
    t1, t2 = size(first)[..., None], size(last)[..., None]
    tangents = [p / np.maximum(t, SYSTEM.tiny) for p, t in ((first, t1), (last, t2))]
    return (first + last) / 2, (last - first) / 2, t1, t2, tangents


def _outward(cables):
    """Movement of end 2 from end 1 by dL/L at a given tension vector at mid-length, shape (..., c, 3). [m]"""
    middle, _, _, _, tangents = _at_ends(cables)
    stiff = np.asarray(cables.span.axial_stiffness)[..., None]
    return cables.span.unstretched_length[..., None] * ((tangents[0] + tangents[1]) / 2 + middle / stiff)


def _gradients(cables, kinds):
    """Kind of tension -> its derivatives by the tension vector at mid-length, and by dL/L at given such vector.

    Those of the kinds that occur; without point loads. Shapes (..., c, 3) and (..., c). [-], [N]
    """
    span, mean = cables.span, cables.mean_tension
    stiff = np.asarray(span.axial_stiffness)[..., None]
    middle, half, t1, t2, tangents = _at_ends(cables)
    direction = span.frame[..., 0, :] * (1 + np.asarray(span.chord_strain))[..., None] - middle / stiff
    gradients = {
        "preload": (direction, (t1 + t2)[..., 0] / 2 - mean),
        "tension_to": (tangents[1], (tangents[1] * half).sum(axis=-1)),
        "tension_from": (tangents[0], -(tangents[0] * half).sum(axis=-1)),
    }
    if (kinds == "horizontal_tension").any():
        level = middle * LEVEL
        gradients["horizontal_tension"] = level / np.maximum(size(level)[..., None], SYSTEM.tiny), 0.0 * mean
    if (kinds == "max_tension").any():
        at_end_2 = t2 > t1
        by_place, by_length_alone = zip(gradients["tension_to"], gradients["tension_from"], strict=True)
        gradients["max_tension"] = np.where(at_end_2, *by_place), np.where(at_end_2[..., 0], *by_length_alone)
    return gradients


def kept(cables, given):
    """How cables answer that keep what they state, their lengths following.

    Parameters
    ----------
    cables, given
        As for `values`; each cable states something.

    Returns
    -------
    ndarray, shape (..., c, 2, 3, 4)
        Change of the force on each end by a movement of end 2 along x, y, z [N/m], and by a relative change of what is
        stated [N].

    Notes
    -----
    Of a cable that keeps a tension the stiffness along it all but vanishes: a difference of its stiffness and what its
    length takes back has no digits of that. [F, t; g, c] [dN; dL/L] = [d; dv] has them, with F the flexibility, t the
    movement by dL/L at a given tension vector N, and g and c the derivatives of what is stated.
    """
    found, value = rates(cables, given), values(cables, given)
    own = np.where(np.abs(found.by_length) > SYSTEM.tiny, found.by_length, SYSTEM.tiny)
    by_length = (found.end_forces[..., 0, :] - found.end_forces[..., 1, :]) / 2
    lengthening = np.concatenate([-found.by_end, value[..., None]], axis=-1) / own[..., None]
    pulled = np.concatenate([found.stiffness, np.zeros_like(value)[..., None, None].repeat(3, axis=-2)], axis=-1)
    pulled = pulled + by_length[..., None] * lengthening[..., None, :]
    chosen = np.isin(np.asarray(given, dtype=object), FORCES) & ~cables.slack & ~cables.folded
    if chosen.any() and not cables.span.load_positions.shape[-1]:
        exact = _kept_tension(cables, given, value, chosen)
        pulled = np.where(chosen[..., None, None], exact[..., :3, :], pulled)
        lengthening = np.where(chosen[..., None], exact[..., 3, :], lengthening)
    of_weight = (found.end_forces[..., 0, :] + found.end_forces[..., 1, :]) / 2  # half of the weight on each end
    of_weight = of_weight[..., None] * lengthening[..., None, :]
    return np.stack([of_weight + pulled, of_weight - pulled], axis=-3)


def _kept_tension(cables, given, value, chosen):
    """Changes of tension vector and dL/L of cables that keep a tension, shape (..., c, 4, 4); see `kept`."""
    span, kinds = cables.span, np.asarray(given, dtype=object)
    length, tension = span.unstretched_length[..., None], np.where(chosen, cables.max_tension, 1.0)[..., None]
    qq, nn, yy, qn, qy, ny = cables.flexibility
    compliance = np.stack([qq, qn, qy, qn, nn, ny, qy, ny, yy], axis=-1).reshape((*qq.shape, 3, 3))
    compliance = np.swapaxes(span.frame, -1, -2) @ compliance @ span.frame
    matrix, right = (np.zeros((*value.shape, 4, 4)) for _ in range(2))  # forces over the tension, places over L
    matrix[..., :3, :3] = compliance * (tension / length)[..., None]
    matrix[..., :3, 3] = _outward(cables) / length
    for kind, (by_force, alone) in _gradients(cables, kinds).items():
        of_kind = (kinds == kind)[..., None]
        matrix[..., 3, :3] = np.where(of_kind, by_force, matrix[..., 3, :3])
        matrix[..., 3, 3:] = np.where(of_kind, alone[..., None] / tension, matrix[..., 3, 3:])
    right[..., :3, :3], right[..., 3, 3] = np.eye(3) / length[..., None], value / tension[..., 0]
    matrix = np.where(chosen[..., None, None] & np.isfinite(matrix), matrix, np.eye(4))
    try:
        answer = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        answer = np.linalg.pinv(matrix) @ right
    answer[..., :3, :] *= tension[..., None]
    return answer


def _rates_with_loads(cables, given):
    """`rates` of cables that may carry point loads."""
    span = cables.span

    def asked(moved):
        known = np.asarray(values(moved, given))[..., None]
        return np.concatenate([moved.end_forces("global").reshape((*known.shape[:-1], 6)), known], axis=-1)

    strain = np.maximum(np.abs(span.chord_strain), cables.mean_tension / span.axial_stiffness)
    found = _differences(span, asked, SYSTEM.sag_difference * np.maximum(strain, 1e-12))
    found = np.where(np.isfinite(found), found, 0.0)  # without a definite form, as without any load, there are none
    stated = ~np.isnan(values(cables, given))
    end_forces = found[..., :6, 0].reshape((*found.shape[:-2], 2, 3))
    by_end = np.where(stated[..., None], found[..., 6, 1:], 0.0)
    return Rates(end_forces, cables.global_end_stiffness, np.where(stated, found[..., 6, 0], np.nan), by_end)


def _slack_step(span):
    """A change of strain about as large as what the slack or stretch of a cable can tell of its sag."""
    return SYSTEM.sag_difference * np.maximum(np.abs(span.chord_strain), 1e-8)


def _differences(span, function, step):
    """Derivatives by dL/L and by the place of end 2, by central differences, shape (..., m, 4).

    Parameters
    ----------
    span : Span
    function : callable
        Catenary -> ndarray, shape (..., m).
    step : ndarray, shape (...)
        Relative change of the length. [-]
    """
    vector = span.frame[..., 0, :] * np.asarray(span.chord)[..., None]
    forces = span.in_frame(span.load_forces, "global")
    of_loads = {"load_positions": span.load_positions, "load_forces": forces} if forces.shape[-2] else {}

    def at(factor, shift):
        stiffness, vertical = span.axial_stiffness, span.vertical
        moved = Span.between(
            np.zeros(3), vector + shift, stiffness, span.mass, span.gravity, vertical=vertical, **of_loads
        )
        longer = 2 * (vector * shift).sum(axis=-1) + (shift**2).sum(axis=-1)
        strain = span.chord_strain + longer / (moved.chord + span.chord) / span.unstretched_length
        moved = replace(moved, load_fractions=span.load_fractions)
        return function(catenary.solve(moved.with_chord_strain(with_relative_length(strain, factor))))

    none, steps = np.zeros(3), step[..., None]
    columns = [(at(step, none) - at(-step, none)) / (2 * steps)]
    for axis in range(3):
        shift = np.eye(3)[axis] * (step * span.unstretched_length)[..., None]
        columns.append((at(0.0, shift) - at(0.0, -shift)) / (2 * steps * span.unstretched_length[..., None]))
    return np.stack(columns, axis=-1)


def linear_measure(error, kinds):
    """A measure of relative errors that is nearly linear in the length, and its derivative by the relative error.

    Half of the relative error of the square of a sag, which is proportional to the slack of a cable that is stiff.

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


def with_relative_length(strain, change):
    """Chord strain of cables whose unstretched lengths change by dL/L, the ends at rest."""
    return (strain - change) / (1 + change)


def least_preload(span):
    """Least mean tension that cables between given ends can have, of all unstretched lengths.

    A shorter cable is stretched, a longer one hangs deeper: either raises the tension. A horizontal cable that hardly
    stretches has 0.508 of its weight per length times its chord at a length of 1.48 chords, a vertical one 0.5 at 1.

    Parameters
    ----------
    span : Span

    Returns
    -------
    tension : ndarray, shape of the span
        At most `least_tension_error` above the exact one. [N]
    """
    stretched = np.log1p(span.weight_per_length * span.chord / span.axial_stiffness)
    span = span.without_loads()
    # logarithm of chord over unstretched length
    low, high = np.broadcast_to(-np.log(SYSTEM.slackest), stretched.shape), stretched
    share = np.linspace(0.0, 1.0, SYSTEM.slack_lengths).reshape(-1, *[1] * stretched.ndim)
    for _ in range(2):
        trials = low + share * (high - low)
        tension = catenary.solve(span.with_chord_strain(np.expm1(trials))).mean_tension
        lowest = tension.argmin(axis=0)[None]
        low, high = (
            np.take_along_axis(trials, np.clip(lowest + side, 0, SYSTEM.slack_lengths - 1), axis=0)[0]
            for side in (-1, 1)
        )
    return tension.min(axis=0)


def first_strains(span, given, value):
    """Chord strains with which cables between given ends have what they state, or about so.

    Parameters
    ----------
    span : Span
        Of shape (n,).
    given : ndarray of object, shape (n,)
    value : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        Of any tension as if it were the mean one; 0 where nothing is stated or no length was found. [-]
    """
    strain = np.zeros(len(value))
    finders = dict.fromkeys(FORCES, initial_length.strains_for_tension) | {"sag": initial_length.strains_for_sag}
    for kind, find in finders.items():
        chosen = np.flatnonzero(given == kind)
        if len(chosen):
            strain[chosen] = find(span.take(chosen), value[chosen])
    own = given == "unstretched_length"
    strain[own] = (span.chord[own] - value[own]) / value[own]
    return np.where(np.isfinite(strain), strain, 0.0)


def fit(span, given, value, strain):
    """Chord strains with which cables between given ends have what they state, by Newton's method.

    Parameters
    ----------
    span : Span
        Of shape (..., c).
    given : sequence of (str or None), one per cable
    value, strain : ndarray, shape (..., c)
        Of what is stated, and where the iteration begins.

    Returns
    -------
    strain : ndarray, shape (..., c)
        That of the beginning where nothing is stated.
    error : ndarray, shape (..., c)
        Relative, of what is stated; zero where nothing is.

    Notes
    -----
    The tension is a convex function of the length of a cable that is not very slack. From the strain of a weightless
    cable with this tension, which is too large, Newton steps fall on the solution and never pass it.
    """
    kinds = np.asarray(given, dtype=object)
    stated = np.array([kind is not None for kind in given])
    force = np.isin(kinds, FORCES)
    # an end may be the lower one
    heaviest = np.where(np.isin(kinds, ["tension_to", "tension_from"]), span.weight_per_length * span.chord, 0.0)
    heaviest = heaviest + np.where(kinds == "preload", 0.0, size(span.load_forces).sum(axis=-1))
    steepness = np.where(kinds == "horizontal_tension", np.maximum(np.abs(span.cosine), SYSTEM.steepest), 1.0)
    most = np.where(force, (value + heaviest) / steepness / span.axial_stiffness, np.inf)
    strain, last = np.where(force, np.minimum(strain, most), strain), np.inf
    best, stalled_steps = np.inf, 0  # errors so far, and steps since they last fell
    ended = np.zeros(np.shape(strain), dtype=bool)  # a cable ends where it would end alone
    for _ in range(SYSTEM.stated_steps):
        cables = catenary.solve(span.with_chord_strain(strain))
        error = np.where(stated, values(cables, given) / value - 1, 0.0)
        error = np.where(np.isfinite(error), error, 1.0)
        worst = np.abs(error)
        stalled_steps = np.where(worst < SYSTEM.falling_error * best, 0, stalled_steps + 1)
        best = np.minimum(worst, best)
        ended |= (
            (worst < EXACT)
            | ((worst < SYSTEM.stalled_error) & (worst >= last / 2))
            | (stalled_steps >= SYSTEM.stalled_steps)
        )
        if ended.all():
            break
        excess, factor = linear_measure(error, kinds)
        by_length = rates(cables, given).by_length
        slope = factor * by_length / value
        change = np.where(stated & (slope != 0) & np.isfinite(slope), -excess / np.where(slope != 0, slope, 1.0), 0.0)
        change = np.clip(np.nan_to_num(change), -SYSTEM.stated_length_change, SYSTEM.stated_length_change)
        closer = np.minimum(with_relative_length(strain, np.where(stated, change, 0.0)), most)
        hanging = force & (error < 0) & ~(by_length < 0)  # so long that a longer cable would be tauter
        strain, last = np.where(ended, strain, np.where(hanging, most, closer)), worst
    return strain, error
