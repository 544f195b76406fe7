"""Stated values of cables: a tension or sag that the user prescribes instead of the unstretched length.

The unstretched length L with which a cable has its stated value is found by iteration, from the derivatives given here.
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

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.cable.vectors import size
from cablestudy.statics.tolerances import STATICS

FORCES = ["preload", "tension_to", "tension_from", "horizontal_tension", "max_tension"]
LEVEL = np.array([1.0, 1.0, 0.0])


@dataclass(frozen=True)
class Rates:
    """Derivatives of the end forces and stated values of c cables by unstretched length L and by the position of end 2.

    Attributes
    ----------
    end_forces : ndarray, shape (..., c, 2, 3)
        Derivative of the force on each end, global axes, by the relative change of length dL/L. [N]
    stiffness : ndarray, shape (..., c, 3, 3)
        K = dN/dd, global axes. [N/m]
    by_length : ndarray, shape (..., c)
        Derivative of the stated value by dL/L; NaN where nothing is stated. [N] or [m]
    by_end : ndarray, shape (..., c, 3)
        Derivative of the stated value by the position of end 2, global axes; zero where nothing is stated. [N/m] or [-]
    """

    end_forces: np.ndarray
    stiffness: np.ndarray
    by_length: np.ndarray
    by_end: np.ndarray


def actual_values(cables, quantities):
    """Value that each cable actually has of the quantity that is stated for it, such as its sag or a tension.

    Parameters
    ----------
    cables : Catenary
        Equilibria of the c cables, shape (..., c).
    quantities : sequence of (str or None)
        Name of the stated quantity of each cable, one of `suspension.STATED`; None where nothing is stated.

    Returns
    -------
    ndarray, shape (..., c)
        Not a number where nothing is stated. [m] or [N]
    """
    kinds = np.asarray(quantities, dtype=object)
    result, loaded = np.full(np.shape(cables.span.chord), np.nan), cables.span.load_positions.shape[-1] > 0
    # without point loads an end has the horizontal and the largest tension of the whole cable
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


def rates(cables, quantities):
    """Change of the end forces and of the stated tension or sag of cables, by length L and position of end 2: `Rates`.

    By the module's docstring; sags, and cables with point loads, have central differences.

    Parameters
    ----------
    cables : Catenary
        Equilibria of the c cables, shape (..., c).
    quantities : sequence of (str or None)
        Name of the stated quantity of each of the c cables, one of `suspension.STATED`; None where nothing is stated.
    """
    span, kinds = cables.span, np.asarray(quantities, dtype=object)
    if span.load_positions.shape[-1]:
        return _rates_with_loads(cables, quantities)
    length, stiffness = span.unstretched_length, cables.global_end_stiffness
    middle_tension, half_difference, *_ = _end_tensions(cables)
    middle_by_length = -(stiffness @ _end_movement_by_length(cables)[..., None])[..., 0]  # L dN/dL
    end_forces = np.stack([middle_by_length - half_difference, -middle_by_length - half_difference], axis=-2)
    gradients = _gradients(cables, kinds) if np.isin(kinds, FORCES).any() else {}
    by_length = np.where(kinds == "unstretched_length", length, np.nan)
    by_end = np.zeros_like(middle_tension)
    for kind, (by_middle_tension, at_fixed_tension) in gradients.items():
        of_kind = kinds == kind
        by_length = np.where(of_kind, (by_middle_tension * middle_by_length).sum(axis=-1) + at_fixed_tension, by_length)
        by_end = np.where(of_kind[..., None], (stiffness @ by_middle_tension[..., None])[..., 0], by_end)
    if (kinds == "sag").any():
        step = STATICS.sag_difference * np.maximum(np.abs(span.chord_strain), 1e-8)  # a share of the slack or stretch
        sag = _differences(span, lambda varied: varied.sag[..., None], step)[..., 0, :]
        by_length = np.where(kinds == "sag", sag[..., 0], by_length)
        by_end = np.where((kinds == "sag")[..., None], sag[..., 1:], by_end)
    return Rates(end_forces, stiffness, by_length, by_end)


def _end_tensions(cables):
    """Tension vectors P_1 and P_2 at the ends, global axes.

    Returns
    -------
    mean, half_difference : ndarray, shape (..., c, 3)
        (P_1 + P_2)/2, which is N, and (P_2 - P_1)/2. [N]
    t1, t2 : ndarray, shape (..., c, 1)
        T_1 and T_2, the sizes of P_1 and P_2. [N]
    tangents : list of 2 ndarray, shape (..., c, 3)
        P_1/T_1 and P_2/T_2. [-]
    """
    forces = cables.end_forces("global")
    first, last = forces[..., 0, :], -forces[..., 1, :]
    t1, t2 = size(first)[..., None], size(last)[..., None]
    tangents = [p / np.maximum(t, STATICS.tiny) for p, t in ((first, t1), (last, t2))]
    return (first + last) / 2, (last - first) / 2, t1, t2, tangents


def _end_movement_by_length(cables):
    """Movement of end 2 away from end 1 per dL/L, the tension vector at mid-length fixed, shape (..., c, 3). [m]"""
    middle_tension, _, _, _, tangents = _end_tensions(cables)
    axial_stiffness = np.asarray(cables.span.axial_stiffness)[..., None]
    mean_tangent = (tangents[0] + tangents[1]) / 2
    return cables.span.unstretched_length[..., None] * (mean_tangent + middle_tension / axial_stiffness)


def _gradients(cables, kinds):
    """Derivatives of the tensions that may be stated, by the tension vector N at mid-length and by the length L.

    `kinds` names the stated quantity of each of the c cables, a `Catenary` without point loads.

    Returns
    -------
    dict of str to (ndarray, ndarray)
        Name of a tension -> its derivatives by N, shape (..., c, 3) [-], and by dL/L at constant N, shape (..., c) [N].
        Horizontal and largest tension are there only if one of the cables states them.
    """
    span, mean = cables.span, cables.mean_tension
    axial_stiffness = np.asarray(span.axial_stiffness)[..., None]
    middle_tension, half_difference, t1, t2, tangents = _end_tensions(cables)
    chord_over_length = span.frame[..., 0, :] * (1 + np.asarray(span.chord_strain))[..., None]
    gradients = {
        "preload": (chord_over_length - middle_tension / axial_stiffness, (t1 + t2)[..., 0] / 2 - mean),
        "tension_to": (tangents[1], (tangents[1] * half_difference).sum(axis=-1)),
        "tension_from": (tangents[0], -(tangents[0] * half_difference).sum(axis=-1)),
    }
    if (kinds == "horizontal_tension").any():
        horizontal = middle_tension * LEVEL
        gradients["horizontal_tension"] = horizontal / np.maximum(size(horizontal)[..., None], STATICS.tiny), 0.0 * mean
    if (kinds == "max_tension").any():
        at_end_2 = t2 > t1
        by_middle_tension, at_fixed_tension = zip(gradients["tension_to"], gradients["tension_from"], strict=True)
        gradients["max_tension"] = np.where(at_end_2, *by_middle_tension), np.where(at_end_2[..., 0], *at_fixed_tension)
    return gradients


def force_changes_at_stated_values(cables, quantities):
    """Change of the end forces of cables that keep a stated tension, sag or length v, per movement of end 2 and per v.

    The length L of a cable adjusts so that v stays. The changes tell how far rounding of v, or of net forces, moves an
    equilibrium (`uncertainty`).

    Parameters
    ----------
    cables : Catenary
        Equilibria of the c cables, shape (..., c).
    quantities : sequence of str
        Name of the stated quantity of each cable, one of `suspension.STATED`.

    Returns
    -------
    ndarray, shape (..., c, 2, 3, 4)
        Force on each end (axis -3) along x, y, z (axis -2); last axis: per movement of end 2 along x, y, z [N/m], then
        per relative change dv/v of the stated value [N].

    Notes
    -----
    The stiffness along a cable that keeps a stated tension nearly vanishes. As a difference (stiffness at fixed length
    less the effect of dL) it would be rounding. It is found instead from

        [F, m; g, c] [dN; dL/L] = [dd; dv]

    with the tension vector N at mid-length, the flexibility F, the movement dd of end 2, its part m per dL/L at fixed
    N, and the derivatives g and c of v by N and by dL/L (`_changes_at_stated_tension`).
    """
    derivatives, value = rates(cables, quantities), actual_values(cables, quantities)
    force_1, force_2 = (derivatives.end_forces[..., end, :] for end in (0, 1))  # on each end, per dL/L
    by_length = derivatives.by_length
    by_length = np.where(np.abs(by_length) > STATICS.tiny, by_length, STATICS.tiny)
    # dL/L, and then dN, by the three movements of end 2 and by the stated value
    lengthening = np.concatenate([-derivatives.by_end, value[..., None]], axis=-1) / by_length[..., None]
    at_given_length = np.zeros((*value.shape, 3, 4))
    at_given_length[..., :3] = derivatives.stiffness
    tension_changes = at_given_length + ((force_1 - force_2) / 2)[..., None] * lengthening[..., None, :]
    exact = np.isin(np.asarray(quantities, dtype=object), FORCES) & ~cables.slack & ~cables.folded
    if exact.any() and not cables.span.load_positions.shape[-1]:
        changes = _changes_at_stated_tension(cables, quantities, value, exact)
        tension_changes = np.where(exact[..., None, None], changes[..., :3, :], tension_changes)
        lengthening = np.where(exact[..., None], changes[..., 3, :], lengthening)
    half_weight = ((force_1 + force_2) / 2)[..., None] * lengthening[..., None, :]  # a longer cable is heavier
    return np.stack([half_weight + tension_changes, half_weight - tension_changes], axis=-3)


def _changes_at_stated_tension(cables, quantities, value, chosen):
    """Change of tension and length of cables that keep a stated tension v, per movement of end 2 and per v.

    They solve the equations of the notes of `force_changes_at_stated_values`, in which forces are divided by the
    tension and lengths by L: all entries are of like size.

    `quantities` names the stated quantity of each of c cables. `value` has the stated values v [N]; the results where
    `chosen` is False have no meaning. Both have the shape (..., c).

    Returns
    -------
    ndarray, shape (..., c, 4, 4)
        Rows: dN along x, y, z [N], then dL/L [-]. Columns: per movement of end 2 along x, y, z [m], then per relative
        change dv/v of the stated tension [-].
    """
    span, kinds = cables.span, np.asarray(quantities, dtype=object)
    length, tension = span.unstretched_length[..., None], np.where(chosen, cables.max_tension, 1.0)[..., None]
    qq, nn, yy, qn, qy, ny = cables.flexibility
    compliance = np.stack([qq, qn, qy, qn, nn, ny, qy, ny, yy], axis=-1).reshape((*qq.shape, 3, 3))
    compliance = np.swapaxes(span.frame, -1, -2) @ compliance @ span.frame
    matrix, right = np.zeros((2, *value.shape, 4, 4))
    matrix[..., :3, :3] = compliance * (tension / length)[..., None]  # F
    matrix[..., :3, 3] = _end_movement_by_length(cables) / length  # m
    value_by_tension, value_by_length = matrix[..., 3, :3], matrix[..., 3, 3:]  # views: g and c
    for kind, (by_middle_tension, at_fixed_tension) in _gradients(cables, kinds).items():
        of_kind = (kinds == kind)[..., None]
        np.copyto(value_by_tension, by_middle_tension, where=of_kind)
        np.copyto(value_by_length, at_fixed_tension[..., None] / tension, where=of_kind)
    right[..., :3, :3] = np.eye(3) / length[..., None]
    right[..., 3, 3] = value / tension[..., 0]
    matrix = np.where(chosen[..., None, None] & np.isfinite(matrix), matrix, np.eye(4))
    try:
        solution = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        solution = np.linalg.pinv(matrix) @ right
    solution[..., :3, :] *= tension[..., None]
    return solution


def _rates_with_loads(cables, quantities):
    """`rates` of cables that may carry point loads: central differences."""
    span = cables.span

    def forces_and_value(varied):
        value = np.asarray(actual_values(varied, quantities))[..., None]
        return np.concatenate([varied.end_forces("global").reshape((*value.shape[:-1], 6)), value], axis=-1)

    strain = np.maximum(np.abs(span.chord_strain), cables.mean_tension / span.axial_stiffness)
    rate = _differences(span, forces_and_value, STATICS.sag_difference * np.maximum(strain, 1e-12))
    rate = np.where(np.isfinite(rate), rate, 0.0)  # without a definite form, as without any load, there are none
    stated = ~np.isnan(actual_values(cables, quantities))
    end_forces = rate[..., :6, 0].reshape((*rate.shape[:-2], 2, 3))
    by_end = np.where(stated[..., None], rate[..., 6, 1:], 0.0)
    return Rates(end_forces, cables.global_end_stiffness, np.where(stated, rate[..., 6, 0], np.nan), by_end)


def _differences(span, function, step):
    """Derivatives of m quantities of cables, such as the sag, by length and position of end 2, by central differences.

    `function` returns the quantities, shape (8, ..., m), of the `Catenary` of the cables in 8 variations. `step`, shape
    (...), is the relative change of the unstretched length L, and the change of the position of end 2 over L. The
    result, shape (..., m, 4), is per relative change dL/L, and per meter of movement along x, y and z.
    """
    vector = span.frame[..., 0, :] * np.asarray(span.chord)[..., None]
    forces = span.in_frame(span.load_forces, "global")
    loads = {"load_positions": span.load_positions, "load_forces": forces} if forces.shape[-2] else {}
    length = span.unstretched_length
    # longer, shorter, and end 2 ahead and back along each axis: solved together
    signs = np.kron(np.eye(4), [[1.0], [-1.0]]).reshape(8, *[1] * step.ndim, 4)  # of each change in each variation
    length_change, shift = signs[..., 0] * step, signs[..., 1:] * (step * length)[..., None]
    properties = span.axial_stiffness, span.mass, span.gravity
    varied = Span.between(np.zeros(3), vector + shift, *properties, vertical=span.vertical, **loads)
    square_change = 2 * (vector * shift).sum(axis=-1) + (shift**2).sum(axis=-1)  # of the chord
    strain = span.chord_strain + square_change / (varied.chord + span.chord) / length
    varied = replace(varied, load_fractions=span.load_fractions)
    value = function(catenary.solve(varied.with_chord_strain(strain_at_changed_length(strain, length_change))))
    steps = 2 * step * np.stack([np.ones_like(length), length, length, length])
    return np.stack(list((value[::2] - value[1::2]) / steps[..., None]), axis=-1)


def strain_at_changed_length(strain, change):
    """Chord strain of cables whose unstretched lengths change by dL/L, the ends at rest."""
    return (strain - change) / (1 + change)
