"""Effect of a load case on cables: from the cable in its reference state to the cable under the loads of the case.

Temperature changes the unstretched length, L (1 + alpha dT), and leaves the mass of the cable as it is. Ice adds to the
mass per length, and so to the weight and to the inertia. A steady wind adds a uniform force per unstretched length,
C_d q D |u_n| u_n, with the part u_n of its direction across the chord and the diameter D with ice; where the wind
grows with the height, with the mean of q along the cable.

`values` are those of n scenes of one cable, `StatedNumbers` or a `CaseTable`, or of c cables each, `CableNumbers`: the
shape (...) of what follows from them is (n,) or (n, c).
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.span import Span
from cablestudy.cable.steady_drag import Profile, SteadyDrag
from cablestudy.study.tolerances import STUDY

UP = np.array([0.0, 0.0, 1.0])
END_2_ALONG_X = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
CONVERGED, TOO_MANY, UNBALANCED = range(3)
REASONS = ("converged", "no convergence", "rounding leaves a part of the force")


def bare_spans(values):
    """`Span` of n cables without point loads, at the reference temperature, of the length of their chords."""
    return Span.between(
        *values.ends,
        values.number("cable.section_axial_stiffness"),
        values.number("cable.section_mass"),
        values.number("gravity"),
        chord=values.number("cable.chord_length"),
    ).broadcast()


def point_loads(values, of_case):
    """Point loads of cables: see `load_arrays.load_arrays`, but with the weight of their masses in their forces.

    They are those of the chosen case, or (without `of_case`) of the reference state.
    """
    positions, fractions, forces, masses = values.loads(of_case)
    return positions, fractions, forces - (masses * values.number("gravity")[..., None])[..., None] * UP, masses


def placed_on_cable(positions, length):
    """Complete the positions of point loads, so that every entry of the array is a distinct point of its cable.

    All cables of a batch have k entries, as many as the cable with the most loads. Entries without a load, and those at
    or beyond the end of a cable (such a case is refused later), get places at equal distances along the longest part of
    the cable that has no load.

    Parameters
    ----------
    positions : ndarray, shape (..., k)
        Arc length of each load from end 1, NaN where there is no load. [m]
    length : ndarray, shape (...)
        Unstretched length of each cable. [m]

    Returns
    -------
    ndarray, shape (..., k)
        Arc lengths from end 1, in the order of the entries. [m]
    """
    end = length[..., None]
    absent = ~(positions < end)
    edges = np.concatenate([0 * end, np.sort(np.where(absent, end, positions)), end], axis=-1)
    gaps = np.diff(edges)
    longest = gaps.argmax(axis=-1)[..., None]
    start, gap = (np.take_along_axis(array, longest, axis=-1) for array in (edges, gaps))
    number = np.cumsum(absent, axis=-1)
    return np.where(absent, start + gap * number / (number[..., -1:] + 1), positions)


def with_loads(span, values, of_case, length_ratio=None):
    """Add to n cables the point loads of their scenes, turned from the global axes to the chord frame of each cable.

    Parameters
    ----------
    span : Span
        The cables without point loads, fields of shape (n,).
    values : StatedNumbers or CaseTable
    of_case : bool
        Whether the loads of the load cases are added too, or only those of the reference state.
    length_ratio : ndarray, shape (n,), optional
        Factor on the arc lengths that the scenes state for the loads: unstretched length of the cable, divided by the
        length for which the scene states them. Default 1. [-]

    Returns
    -------
    Span
    """
    positions, fractions, forces, masses = point_loads(values, of_case)
    positions = positions if length_ratio is None else positions * length_ratio[:, None]
    if not positions.shape[-1]:
        return span
    forces = (forces[..., None, :] * span.frame[..., None, :, :]).sum(axis=-1)
    has_fractions = np.isfinite(fractions).any()
    return replace(
        span,
        load_positions=positions,
        load_forces=forces,
        load_masses=masses if masses.any() else None,
        load_fractions=fractions if has_fractions else None,
    )


def loaded_spans(span, values, strain, shift=None, length_changes=None, drag=None):
    """Take n cables from the reference state to their load cases: moved ends, new lengths, ice, wind and point loads.

    With the relative change of length e, the chord strain s becomes (s - e)/(1 + e), and the mass per unstretched
    length m becomes m/(1 + e) plus ice.

    Parameters
    ----------
    span : Span
        The cables in the reference state, without point loads; fields of shape (n,).
    values : StatedNumbers or CaseTable
    strain : ndarray, shape (n,)
        s: chord length over unstretched length, minus 1, in the reference state. [-]
    shift : ndarray, shape (n,), optional
        Displacement of end 2 along x, in addition to the movements that the case states. [m]
    length_changes : ndarray, shape (2, n), optional
        e, by default that of the temperature; and a factor on ice and wind per unstretched length, by default 1. [-]
    drag : SteadyDrag, optional
        Force of the steady wind; by default with the wind pressure halfway between the ends of each cable.

    Returns
    -------
    span : Span
        The loaded cables, fields of shape (n,).
    drag : SteadyDrag
        Drag of the steady wind on them.
    """
    ends, moves = np.stack(values.ends, axis=-2), values.moves
    if shift is not None:
        moves = moves + shift[:, None, None] * END_2_ALONG_X
    if moves.any():
        ends = ends + moves
        span, strain = _between_moved_ends(span, strain, ends, moves)
    elongations, load_ratio = (elongation(values), 1.0) if length_changes is None else length_changes
    length_ratio = 1.0 + elongations
    span = replace(span, mass=span.mass / length_ratio + ice_mass(values) * load_ratio)
    drag = steady_drag(values, ends, load_ratio) if drag is None else drag
    if drag.normal_drag.any():
        span = _with_uniform_drag(span, ends, drag.uniform(span.frame[..., 0, :]))
    span = with_loads(span, values, True, length_ratio)
    return span.with_chord_strain((strain - elongations) / length_ratio), drag


def elongation(values):
    """Relative change of unstretched lengths by the temperature, none of shrunk cables, shape (...). [-]"""
    return np.where(shrunk(values), 0.0, values.number("elongation"))


def shrunk(values):
    """True of cables with almost no length left at the temperature of their case, shape (...); they do not exist."""
    return 1.0 + values.number("elongation") < STUDY.least_length


def ice_mass(values):
    """Mass per unstretched length of a layer of ice and of other loads per length, shape (...). [kg/m]"""
    thickness, weight = (np.nan_to_num(values.number(f"load_case.ice.{key}")) for key in ("thickness", "weight"))
    density, diameter = values.number("load_case.ice.density"), values.number("cable.section_diameter")
    gravity = values.number("gravity")
    layer = np.where(thickness > 0, np.pi * density * thickness * (diameter + thickness), 0.0)
    return layer + np.where(gravity > 0, weight / np.where(gravity > 0, gravity, 1.0), 0.0)


def steady_drag(values, ends, load_ratio=1.0):
    """Drag of the steady wind of the load cases on n cables: C_d q D per unstretched length of a cable across the wind.

    C_d is the drag coefficient, D the diameter with ice, q the dynamic pressure. Where q changes with the height, its
    value halfway between the ends of the cable counts. Without wind the drag is zero.

    Parameters
    ----------
    values : StatedNumbers or CaseTable
    ends : ndarray, shape (n, 2, 3)
        Positions of both ends of each cable. [m]
    load_ratio : float or ndarray, shape (n,)
        Factor on the drag per unstretched length. [-]

    Returns
    -------
    SteadyDrag
        Fields of shape (n,).
    """
    pressure = np.nan_to_num(values.number("load_case.wind.dynamic_pressure"))
    if not pressure.any():
        return SteadyDrag(pressure, np.zeros((len(values), 3)))
    angle = np.nan_to_num(values.number("load_case.wind.direction"))
    drag = SteadyDrag(np.where(pressure > 0, pressure * drag_width(values), 0.0) * load_ratio, wind_direction(angle))
    profile = Profile.of(*(values.number(f"load_case.wind.{key}") for key in ("exponent", "at")), values.grounds)
    if profile is None:
        return drag
    halfway = profile.pressure(ends.mean(axis=1, keepdims=True))[:, 0]
    return replace(drag, profile=profile, end_1=ends[:, 0], mean=halfway)


def density_and_speed(scene):
    """Density of the air [kg/m^3] and speed [m/s] of the steady wind of a load case, gust factor included.

    Where it states a pressure the air is that of `wind`, if the scene has one.
    """
    steady = scene.load_case.wind
    of_air = steady if steady.speed is not None or scene.wind is None else scene.wind
    return of_air.air_density, np.sqrt(2 * steady.dynamic_pressure / of_air.air_density)


def drag_width(values):
    """Drag coefficient in the steady wind times diameter, ice included, shape (...); NaN without wind. [m]"""
    return values.number("load_case.wind.cable_drag_coefficient") * values.number("wind_diameter")


def wind_direction(angle):
    """Unit vector of a horizontal wind, exactly zero where rounding alone makes a component differ, shape (..., 3). [-]

    Parameters
    ----------
    angle : ndarray, shape (...)
        Direction in which the wind blows, from x towards y. [rad]
    """
    level = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    return np.where(np.abs(level) < STUDY.rounded_direction, 0.0, level)


def _between_moved_ends(span, strain, ends, moves):
    """Cables between moved ends, and their chord strains, shape (n,), which keep the digits of a small movement.

    `ends` and `moves`, shape (n, 2, 3), are the positions after the movement, and the movement. [m]
    """
    step = moves[:, 1] - moves[:, 0]
    still = ~step.any(axis=-1)
    vector = span.frame[..., 0, :] * span.chord[:, None] + step
    chord = np.where(still, span.chord, np.sqrt((vector**2).sum(axis=-1)))
    chord_change = ((vector + (vector - step)) * step).sum(axis=-1) / (chord + span.chord)
    end_1, end_2 = ends[:, 0], ends[:, 1]
    moved_span = Span.between(end_1, end_2, span.axial_stiffness, span.mass, span.gravity, chord=chord).broadcast()
    return moved_span, strain + chord_change * (1 + strain) / span.chord


def _with_uniform_drag(span, ends, wind):
    """Turn n cables so that weight and steady wind together act as one uniform load along a "vertical" of their own.

    A cable under a uniform load in any direction hangs in the plane of its chord and the load, as a catenary does in
    the vertical plane. With the mass m per unstretched length, the upward unit vector z, gravity g and the wind force
    w, the new vertical is the direction of m g z - w, and the new gravity is |m g z - w|/m. Cables without wind keep
    their fields exactly. `ends`, shape (n, 2, 3), are the positions of both ends [m], `wind` is w per unstretched
    length in global axes, shape (n, 3) [N/m].
    """
    in_wind = wind.any(axis=-1)
    load = (span.mass * span.gravity)[:, None] * UP - wind
    magnitude = np.sqrt((load**2).sum(axis=-1))
    gravity = np.where(in_wind, magnitude / span.mass, span.gravity)
    direction = load / np.where(magnitude > 0, magnitude, 1.0)[:, None]
    vertical = np.where((in_wind & (magnitude > 0))[:, None], direction, UP)
    end_1, end_2 = ends[:, 0], ends[:, 1]
    turned = Span.between(
        end_1, end_2, span.axial_stiffness, span.mass, gravity, chord=span.chord, vertical=vertical
    ).broadcast()
    return replace(
        turned,
        cosine=np.where(in_wind, turned.cosine, span.cosine),
        sine=np.where(in_wind, turned.sine, span.sine),
        horizontal=np.where(in_wind[:, None], turned.horizontal, span.horizontal),
    )


# ------------------------------------------------------------------------------- a force on an end that is free along x


@dataclass(frozen=True)
class Push:
    """Displacements of n cable ends by forces on them, and the searches for them: arrays of shape (n,)."""

    shift: np.ndarray  # displacement of end 2 along x [m]
    error: np.ndarray  # of `shift`, relative, by the rounding of the tensions [-]
    steps: np.ndarray  # of the searches [-]
    residual: np.ndarray  # force out of balance, over the larger one of the force and the tension [-]
    reason: np.ndarray  # of the end of each search, an index into REASONS

    @property
    def converged(self):
        """True of searches that found an equilibrium, shape (n,)."""
        return self.reason == CONVERGED

    def describe(self, case):
        """Text on the search of one case."""
        return f"{REASONS[self.reason[case]]} in {self.steps[case]} steps, {self.residual[case]:.1e} left"


def pushed_ends(form_at, force):
    """Displacements u of n cable ends along x by forces F on them, from their positions without F.

    Solves g(u) = g(0) + F for u, where g(u) is the force that holds end 2 at the displacement u. The slope of g, the
    static end stiffness, is positive, so that there is only one solution. Newton's method finds it within a bracket
    that each step narrows: the first step of a soft cable may be much too long.

    Parameters
    ----------
    form_at : callable
        Displacements u of end 2, shape (n,) [m] -> `Catenary` of n cables with all other loads.
    force : ndarray, shape (n,)
        F of each cable, along x. [N]

    Returns
    -------
    Push
        u, its error, and how each search ended.
    """
    shift, done = np.zeros(len(force)), force == 0
    low, high = np.where(force > 0, 0.0, -np.inf), np.where(force > 0, np.inf, 0.0)
    force_there, stiffness, tension, chord = holding_force(form_at(shift))
    target, steps = force_there + force, np.zeros(len(force), dtype=int)
    for _ in range(STUDY.push_steps):  # of Newton's method; the solution stays between low and high
        imbalance = target - force_there
        low, high = np.where(imbalance > 0, shift, low), np.where(imbalance < 0, shift, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            next_shift = shift + imbalance / stiffness
            middle = np.where(np.isfinite(low + high), (low + high) / 2, 2 * shift + np.sign(force) * chord)
        next_shift = np.where((next_shift > low) & (next_shift < high) & np.isfinite(next_shift), next_shift, middle)
        settled = (np.abs(next_shift - shift) <= STUDY.epsilon * (chord + np.abs(shift))) | (imbalance == 0)
        done = done | settled
        if done.all():
            break
        shift, steps = np.where(done, shift, next_shift), steps + ~done
        force_there, stiffness, tension, chord = holding_force(form_at(shift))
    imbalance = np.where(force == 0, 0.0, np.abs(target - force_there))
    scale = np.maximum(np.abs(force), tension)
    residual = np.divide(imbalance, scale, out=np.zeros_like(imbalance), where=scale > 0)
    unbalanced = np.where(residual <= STUDY.balanced, CONVERGED, UNBALANCED)
    reason = np.where(done, unbalanced, TOO_MANY)
    force_error = np.maximum(STUDY.epsilon * scale, imbalance) / np.maximum(stiffness, np.finfo(float).tiny)
    error = np.divide(force_error, np.abs(shift), out=np.sign(np.abs(force)), where=shift != 0)
    return Push(shift, np.minimum(error, 1.0), steps, residual, reason)


def holding_force(cables):
    """Force that holds end 2 along x [N], its slope [N/m], largest tension [N] and chord [m], each of shape (n,)."""
    force = -cables.end_forces("global")[..., 1, 0]
    return force, cables.span.stiffness_along(cables.end_stiffness, 0), cables.max_tension, cables.span.chord
