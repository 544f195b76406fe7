"""Effect of a load case on cables: from the cable in its reference state to the cable of the day.

Temperature changes the unstretched length, L (1 + alpha dT), and leaves the mass of the cable as it is. Ice adds to the
mass per length, and so to the weight and to the inertia. A steady wind adds a uniform force per unstretched length,
C_d q D |u_n| u_n, with the part u_n of its direction across the chord and the diameter D with ice; where the wind
grows with the height, with the mean of q along the cable.

`values` are those of n scenes of one cable, `SceneValues` or a `CaseTable`, or of c cables each, `CableValues`: the
shape (...) of what follows from them is (n,) or (n, c).
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.span import Span
from cablestudy.cable.steady_drag import Profile, SteadyDrag, across
from cablestudy.cable.tolerances import CABLE
from cablestudy.study import profile_error
from cablestudy.study.profile_error import running_integral
from cablestudy.study.tolerances import STUDY

UP = np.array([0.0, 0.0, 1.0])
END_2_ALONG_X = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def bare_spans(values):
    """The cables without point loads, at the reference temperature, of the length of their chords.

    Parameters
    ----------
    values : SceneValues or CaseTable

    Returns
    -------
    Span
        Fields of shape (n,).
    """
    return Span.between(
        *values.ends,
        values.given("cable.section_axial_stiffness"),
        values.given("cable.section_mass"),
        values.given("gravity"),
        chord=values.given("cable.chord_length"),
    ).broadcast()


def point_loads(values, of_case):
    """Point loads of cables: see `scene_values.load_arrays`, but with the weight of their masses in their forces.

    Parameters
    ----------
    values : SceneValues, CaseTable or CableValues
    of_case : bool
        Whether they are those of the chosen case, or of the reference state.
    """
    positions, fractions, forces, masses = values.loads(of_case)
    return positions, fractions, forces - (masses * values.given("gravity")[..., None])[..., None] * UP, masses


def placed_on_cable(places, length):
    """Places of point loads, with a place on the cable also for those that have none.

    The arrays of a batch have as many loads for each cable as the one with the most. Those that do not exist, and those
    beyond the end of a cable, whose case is refused, are spread along the longest part without a load.

    Parameters
    ----------
    places : ndarray, shape (..., k)
        Arc length, not a number where there is no load. [m]
    length : ndarray, shape (...)
        Unstretched. [m]

    Returns
    -------
    ndarray, shape (..., k)
        In any order. [m]
    """
    end = length[..., None]
    absent = ~(places < end)
    edges = np.concatenate([0 * end, np.sort(np.where(absent, end, places)), end], axis=-1)
    gaps = np.diff(edges)
    longest = gaps.argmax(axis=-1)[..., None]
    begin, gap = (np.take_along_axis(part, longest, axis=-1) for part in (edges, gaps))
    number = np.cumsum(absent, axis=-1)
    return np.where(absent, begin + gap * number / (number[..., -1:] + 1), places)


def with_loads(span, values, of_case, warm=None):
    """Cables with their point loads.

    Parameters
    ----------
    span : Span
        Fields of shape (n,).
    values, of_case
        As of `point_loads`.
    warm : ndarray, shape (n,), optional
        Unstretched lengths of the cables over those along which places are stated. [-]
    """
    positions, fractions, forces, masses = point_loads(values, of_case)
    positions = positions if warm is None else positions * warm[:, None]
    if not positions.shape[-1]:
        return span
    forces = (forces[..., None, :] * span.frame[..., None, :, :]).sum(axis=-1)
    shares = np.isfinite(fractions).any()
    return replace(
        span,
        load_positions=positions,
        load_forces=forces,
        load_masses=masses if masses.any() else None,
        load_fractions=fractions if shares else None,
    )


def loaded_spans(span, values, strain, shift=None, changed=None, drag=None):
    """Cables under the loads of their cases, with the unstretched lengths that the case gives them.

    Parameters
    ----------
    span : Span
        In the reference state, without point loads. Fields of shape (n,).
    values : SceneValues or CaseTable
    strain : ndarray, shape (n,)
        Chord strain in the reference state. [-]
    shift : ndarray, shape (n,), optional
        Displacement of end 2 along x beside the moves of the case. [m]
    changed : ndarray, shape (2, n), optional
        Relative change of the unstretched lengths, by default `elongation`; ice and wind per unstretched length over
        those of the scenes. [-]
    drag : SteadyDrag, optional
        With the mean pressures along the cables; without it with the pressures halfway between their ends.

    Returns
    -------
    span : Span
        Fields of shape (n,).
    drag : SteadyDrag
    """
    ends, moves = np.stack(values.ends, axis=-2), values.moves
    if shift is not None:
        moves = moves + shift[:, None, None] * END_2_ALONG_X
    if moves.any():
        ends = ends + moves
        span, strain = _moved(span, strain, ends, moves)
    longer, share = (elongation(values), 1.0) if changed is None else changed
    warm = 1.0 + longer
    span = replace(span, mass=span.mass / warm + ice_mass(values) * share)
    drag = steady_drag(values, ends, share) if drag is None else drag
    if drag.normal_drag.any():
        span = _in_wind(span, ends, drag.uniform(span.frame[..., 0, :]))
    span = with_loads(span, values, of_case=True)
    span = replace(span, load_positions=span.load_positions * warm[:, None])
    return span.with_chord_strain((strain - longer) / warm), drag


def elongation(values):
    """Relative change of unstretched lengths by the temperature, none of shrunk cables, shape (...). [-]"""
    return np.where(shrunk(values), 0.0, values.given("elongation"))


def shrunk(values):
    """Which cables have next to no length left at the temperature of their case, shape (...); they do not exist."""
    return 1.0 + values.given("elongation") < STUDY.least_length


def ice_mass(values):
    """Mass per unstretched length of a layer of ice and of other loads per length, shape (...). [kg/m]"""
    thickness, weight = (np.nan_to_num(values.given(f"load_case.ice.{key}")) for key in ("thickness", "weight"))
    density, diameter = values.given("load_case.ice.density"), values.given("cable.section_diameter")
    gravity = values.given("gravity")
    layer = np.where(thickness > 0, np.pi * density * thickness * (diameter + thickness), 0.0)
    return layer + np.where(gravity > 0, weight / np.where(gravity > 0, gravity, 1.0), 0.0)


def steady_drag(values, ends, share=1.0):
    """`SteadyDrag` on cables between ends, shape (n, 2, 3) [m], with the pressures halfway between these.

    With `share` of it on an unstretched length. [-]
    """
    pressure = np.nan_to_num(values.given("load_case.wind.dynamic_pressure"))
    if not pressure.any():
        return SteadyDrag(pressure, np.zeros((len(values), 3)))
    angle = np.nan_to_num(values.given("load_case.wind.direction"))
    drag = SteadyDrag(np.where(pressure > 0, pressure * drag_width(values), 0.0) * share, wind_direction(angle))
    profile = Profile.of(*(values.given(f"load_case.wind.{key}") for key in ("exponent", "at")), values.grounds)
    if profile is None:
        return drag
    halfway = profile.pressure(ends.mean(axis=1, keepdims=True))[:, 0]
    return replace(drag, profile=profile, end_1=ends[:, 0], mean=halfway)


def drag_width(values):
    """Drag coefficient in the steady wind times diameter, ice included, shape (...); NaN without wind. [m]"""
    return values.given("load_case.wind.cable_drag_coefficient") * values.given("wind_diameter")


def uneven_drag_errors(drag, catenary, stretched=False):
    """Changes of cables with fixed ends, since their drag is taken as uniform along them.

    Parameters
    ----------
    drag : SteadyDrag
        Of shape (n,).
    catenary : Catenary
        Of shape (n,).
    stretched : bool
        Whether the uniform drag is that of the stretched length.

    Returns
    -------
    error : ndarray, shape (n,)
        Estimated relative error of the equilibrium. [-]
    sag : ndarray, shape (n,)
        That of the sag: no less. [-]
    end_forces : ndarray, shape (n, 2, 3)
        Change of the force on what holds the two ends, global axes, to first order. [N]

    Notes
    -----
    The drag of the cable where it hangs, by its own tangent t and stretched length, differs from the uniform one by
    d(s). To first order the tension vector changes by N = c - integral of d, with the constant c for which the ends
    stay where they are: integral of A N = 0, A = (I - t t^T)/T + t t^T/EA. The error is the larger one of the change of
    the tension over the tension and of the movement at mid-length over the distance from the chord there; that of the
    sag is the same vertically, where a cable that the wind carries aside may hang little. In a wind that grows with
    the height, `profile_error` finds the changes, which are larger, to all orders.
    """
    if drag.profile is None:
        error, sag, ends = _first_order(drag, catenary, stretched)
    else:
        growing = drag.profile.exponent > 0
        error, sag, ends = *np.zeros((2, len(growing))), np.zeros((len(growing), 2, 3))
        for chosen, changes in ((growing, profile_error.changes), (~growing, _first_order)):
            if chosen.any():
                error[chosen], sag[chosen], ends[chosen] = changes(drag.take(chosen), catenary.take(chosen))
    errors = np.stack([error, np.fmax(sag, error)])
    errors = STUDY.second_order * bounded(errors)
    return *np.where(drag.normal_drag > 0, errors, 0.0), ends * np.array([1.0, -1.0])[:, None]


def bounded(error):
    """Estimated errors that are numbers, none of them larger than `unknown_error`."""
    return np.minimum(np.nan_to_num(error, nan=STUDY.unknown_error), STUDY.unknown_error)


def _first_order(drag, catenary, stretched=False):
    """Error, that of the sag, and change of the tension vector at both ends, see `uneven_drag_errors`."""
    span, length = catenary.span, catenary.span.unstretched_length
    nodes, weights = np.polynomial.legendre.leggauss(CABLE.drag_points)
    places, near = (1 + nodes) / 2, [*range(CABLE.drag_points), 0, -1]
    force = span.in_frame(catenary.at(places)[1], "global")
    tension = np.sqrt((force**2).sum(axis=-1, keepdims=True))
    tension = np.maximum(tension, STUDY.slack * np.maximum(tension.max(axis=1, keepdims=True), STUDY.slack))
    tangent, stiffness = force / tension, np.asarray(span.axial_stiffness)[:, None, None]
    there = (1 + tension / stiffness) * across(drag.direction[:, None], tangent)
    uniform = across(drag.direction, span.frame[..., 0, :])
    if stretched:
        uniform = uniform * (1 + catenary.mean_tension / span.axial_stiffness)[:, None]
    differs = (drag.normal_drag * length)[:, None, None] * (there - uniform[:, None])
    passed = running_integral(nodes) @ differs
    outer = tangent[..., :, None] * tangent[..., None, :]
    compliance = (np.eye(3) - outer) / tension[..., None] + outer / stiffness[..., None]
    mean = (weights[:, None, None] / 2 * compliance).sum(axis=1)
    gap = (weights[:, None] / 2 * (compliance @ passed[..., None])[..., 0]).sum(axis=1)
    constant = np.linalg.solve(mean, gap[..., None])[:, None, :, 0]
    change = constant - passed
    # at the points, and with the change at the ends over the tension near them
    ends = constant - np.stack([0 * passed[:, 0], (weights[:, None] / 2 * differs).sum(axis=1)], axis=1)
    pulled = np.abs((np.concatenate([change, ends], axis=1) * tangent[:, near]).sum(axis=-1)) / tension[:, near, 0]
    moved = (running_integral(nodes) @ (compliance @ change[..., None])[..., 0])[:, CABLE.drag_points // 2]
    whole = np.hypot(np.hypot(moved[:, 0], moved[:, 1]), moved[:, 2])
    aside, sag = profile_error.shares_at_middle(whole, np.abs(moved[:, 2]), catenary)
    return np.maximum(pulled.max(axis=-1), aside), sag, ends


def wind_direction(angle):
    """Unit vector of a horizontal wind, zero where it is not for rounding only, shape (..., 3). [-]

    Parameters
    ----------
    angle : ndarray, shape (...)
        From x towards y. [rad]
    """
    level = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    return np.where(np.abs(level) < STUDY.rounded_direction, 0.0, level)


def _moved(span, strain, ends, moves):
    """Cables between moved ends, and their chord strains, which keep the digits of a small movement.

    Parameters
    ----------
    span : Span
    strain : ndarray, shape (n,)
        Before the movement.
    ends, moves : ndarray, shape (n, 2, 3)
        Places after the movement, and the movement. [m]
    """
    step = moves[:, 1] - moves[:, 0]
    still = ~step.any(axis=-1)
    vector = span.frame[..., 0, :] * span.chord[:, None] + step
    chord = np.where(still, span.chord, np.sqrt((vector**2).sum(axis=-1)))
    longer = ((vector + (vector - step)) * step).sum(axis=-1) / (chord + span.chord)
    first, last = ends[:, 0], ends[:, 1]
    moved = Span.between(first, last, span.axial_stiffness, span.mass, span.gravity, chord=chord).broadcast()
    return moved, strain + longer * (1 + strain) / span.chord


def _in_wind(span, ends, wind):
    """Cables whose uniform load is weight and wind together: along another direction than the vertical.

    Those without wind are as in a batch without it, to the last digit.

    Parameters
    ----------
    span : Span
    ends : ndarray, shape (n, 2, 3)
        [m]
    wind : ndarray, shape (n, 3)
        Force of the steady wind per unstretched length, global axes. [N/m]
    """
    blown = wind.any(axis=-1)
    load = (span.mass * span.gravity)[:, None] * UP - wind
    size = np.sqrt((load**2).sum(axis=-1))
    gravity = np.where(blown, size / span.mass, span.gravity)
    vertical = np.where((blown & (size > 0))[:, None], load / np.where(size > 0, size, 1.0)[:, None], UP)
    first, last = ends[:, 0], ends[:, 1]
    turned = Span.between(
        first, last, span.axial_stiffness, span.mass, gravity, chord=span.chord, vertical=vertical
    ).broadcast()
    return replace(
        turned,
        cosine=np.where(blown, turned.cosine, span.cosine),
        sine=np.where(blown, turned.sine, span.sine),
        level=np.where(blown[:, None], turned.level, span.level),
    )
