"""Cables of scenes of one cable, from the reference state, where their lengths follow, to their load cases."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span
from cablestudy.cable.steady_drag import SteadyDrag
from cablestudy.study import load_cases
from cablestudy.study.load_cases import pushed_ends
from cablestudy.study.one_cable.reference_length import chord_strain
from cablestudy.study.tolerances import STUDY

UNPUSHED = "the force of the load case on end 2 leads to no equilibrium"


@dataclass(frozen=True)
class LoadedCables:
    """n cables under the loads of their load cases.

    Attributes
    ----------
    span : Span
        Fields of shape (n,); a taut one in place of a cable that does not exist.
    drag : SteadyDrag
        Of the steady wind on them, shape (n,); zero without wind.
    reference_length : ndarray, shape (n,)
        Unstretched lengths in the reference state, without the load case. [m]
    shift, shift_error : ndarray, shape (n,)
        Displacement of end 2 along x by the force of the load case on it [m], and its relative error [-].
    reasons : dict
        Index of a cable -> why it does not exist.
    at : callable or None
        Displacements of end 2, shape (n,) [m], or None -> `Span` and `SteadyDrag` with these in place of `shift`; None
        where no case has a force on end 2.
    """

    span: Span
    drag: SteadyDrag
    reference_length: np.ndarray
    shift: np.ndarray
    shift_error: np.ndarray
    reasons: dict
    at: Callable | None = None


def loaded_cables(values, equivalent=None):
    """Find n cables as they are in their load cases: unstretched length, ice, wind, loads, moved ends: `LoadedCables`.

    The unstretched length follows from the length, tension or sag that a scene states in the reference state, which is
    without a load case. Where a wind grows with height, its mean pressure is that where the cable hangs.

    Parameters
    ----------
    values : StatedNumbers or CaseTable
        Values of the n scenes.
    equivalent : EquivalentCables, optional
        Linear cables that replace the n conductors with permanent elongation.
    """
    span, length_changes = load_cases.bare_spans(values), None
    if equivalent is None:
        strain, reasons = chord_strain(span, values)
    else:
        linear, strain, reasons = equivalent.linear, equivalent.chord_strain, dict(equivalent.reasons)
        span = replace(span, axial_stiffness=linear.stiffness)
        length_changes = np.array([linear.elongation, linear.length_ratio])
    for case in np.flatnonzero(load_cases.shrunk(values)).tolist():
        reasons[case] = "at the temperature of the case next to nothing is left of the cable's length"
    length = span.with_chord_strain(strain).unstretched_length

    def loaded_with(shift, drag=None):
        """Cables with end 2 displaced along x [m], with the mean pressures of a drag, and their drag."""
        spans, drag = load_cases.loaded_spans(span, values, strain, shift, length_changes, drag)
        return _with_loads_on_cable(spans, reasons), drag

    def loaded_at(shift):
        """Cables with end 2 displaced along x [m], and their drag, by the mean pressure where they hang."""
        spans, drag = loaded_with(shift)
        for _ in range(0 if drag.profile is None else STUDY.pressure_passes):
            pressure = drag.profile.mean_pressure(solve(spans), drag.end_1)
            changing = np.abs(pressure - drag.mean) > STUDY.pressure_change * np.abs(drag.mean)
            if not changing.any():
                break
            spans, drag = loaded_with(shift, replace(drag, mean=np.where(changing, pressure, drag.mean)))
        return spans, drag

    if not values.push.any():
        return LoadedCables(*loaded_at(None), length, *np.zeros((2, len(values))), reasons)
    push = pushed_ends(lambda shift: solve(loaded_at(shift)[0]), values.push)
    loaded = loaded_at(push.shift)
    for case in np.flatnonzero(~push.converged).tolist():
        reasons.setdefault(case, f"{UNPUSHED} ({push.describe(case)})")
    return LoadedCables(*loaded, length, push.shift, push.error, reasons, loaded_at)


def _with_loads_on_cable(span, reasons):
    """Spans whose loads are all on the cable; adds to the reasons the cables that end before a load.

    In cables that do not exist the loads are moved onto the taut cable in their place.
    """
    if not span.load_positions.shape[-1]:
        return span
    length, last_position = span.unstretched_length, span.load_positions[:, -1]
    for case in np.flatnonzero(last_position >= length).tolist():
        position, end = last_position[case], length[case]
        reasons.setdefault(case, f"the load at {position:.6g} m is beyond the cable's end, at {end:.6g} m")
    if not reasons:
        return span
    return replace(span, load_positions=np.sort(load_cases.placed_on_cable(span.load_positions, length)))
