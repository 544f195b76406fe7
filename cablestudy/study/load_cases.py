"""What a load case does to a batch of cables: from the cable in its reference state to the cable of the day.

Temperature changes the unstretched length, L (1 + alpha dT), and leaves the mass of the cable as it is. Ice adds to the
mass per length, and so to the weight and to the inertia. A steady wind adds a uniform force per unstretched length,
C_d q D |u_n| u_n, with the part u_n of its direction across the chord and the diameter D with ice.
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.span import Span

DRAG_POINTS = 9  # along a cable, at which the drag that it has is compared with the uniform one
UP = np.array([0.0, 0.0, 1.0])


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


def with_loads(span, values, of_case):
    """Cables with their point loads.

    Parameters
    ----------
    span : Span
        Fields of shape (n,).
    values : SceneValues or CaseTable
    of_case : bool
        Whether those of the chosen case are on them too.
    """
    positions, fractions, forces, masses = values.loads_of_case if of_case else values.loads
    if not positions.shape[-1]:
        return span
    forces = forces - (masses * values.given("gravity")[:, None])[..., None] * UP
    forces = (forces[..., None, :] * span.frame[..., None, :, :]).sum(axis=-1)
    shares = np.isfinite(fractions).any()
    return replace(
        span,
        load_positions=positions,
        load_forces=forces,
        load_masses=masses if masses.any() else None,
        load_fractions=fractions if shares else None,
    )


def loaded_spans(span, values, strain):
    """Cables under the loads of their cases, with the unstretched lengths that the case gives them.

    Parameters
    ----------
    span : Span
        In the reference state, without point loads. Fields of shape (n,).
    values : SceneValues or CaseTable
    strain : ndarray, shape (n,)
        Chord strain in the reference state. [-]

    Returns
    -------
    Span
        Fields of shape (n,).
    """
    elongation = values.given("elongation")
    warm = 1.0 + elongation
    gravity = values.given("gravity")
    ice = _ice_mass(values, gravity)
    span = replace(span, mass=span.mass / warm + ice)
    wind = wind_loads(values, span)
    if wind.any():
        span = _in_wind(span, values, wind)
    span = with_loads(span, values, of_case=True)
    return replace(span, load_positions=_warmed(span, warm)).with_chord_strain((strain - elongation) / warm)


def _warmed(span, warm):
    """Arc lengths of loads at the temperature of the case, shape (n, k). [m]"""
    return span.load_positions * warm[:, None] if span.load_positions.shape[-1] else span.load_positions


def _ice_mass(values, gravity):
    """Of ice and other loads per length, shape (n,). [kg/m]"""
    thickness, weight = (np.nan_to_num(values.given(f"load_case.ice.{key}")) for key in ("thickness", "weight"))
    density, diameter = values.given("load_case.ice.density"), values.given("cable.section_diameter")
    layer = np.where(thickness > 0, np.pi * density * thickness * (diameter + thickness), 0.0)
    return layer + np.where(gravity > 0, weight / np.where(gravity > 0, gravity, 1.0), 0.0)


def wind_loads(values, span):
    """Force of the steady wind per unstretched length, global axes, shape (n, 3). [N/m]"""
    pressed, direction = _pressed(values)
    if not pressed.any():
        return np.zeros((len(values), 3))
    return pressed[:, None] * _across(direction, span.frame[..., 0, :])


def _pressed(values):
    """Drag of a length across the steady wind, C_d q D, shape (n,) [N/m]; its direction, shape (n, 3)."""
    pressure = np.nan_to_num(values.given("load_case.wind.dynamic_pressure"))
    direction = np.stack([*along(values), np.zeros(len(values))], axis=-1)
    if not pressure.any():
        return pressure, direction
    drag = values.given("load_case.wind.cable_drag_coefficient") * values.given("wind_diameter")
    return np.where(pressure > 0, pressure * drag, 0.0), direction


def _across(direction, tangent):
    """|u_n| u_n of a unit vector u, with its part u_n across a tangent."""
    across = direction - tangent * (direction * tangent).sum(axis=-1, keepdims=True)
    return np.sqrt((across**2).sum(axis=-1, keepdims=True)) * across


def drag_errors(values, catenary):
    """Estimated relative error of the equilibrium, since drag is taken as uniform along the cable, shape (n,). [-]

    Largest difference from the drag of the cable where it hangs, by its own tangent and stretched length, over the
    whole load per length.
    """
    pressed, direction = _pressed(values)
    if not pressed.any():
        return pressed
    span = catenary.span
    assumed = _across(direction, span.frame[..., 0, :])[:, None]
    force = span.in_frame(catenary.at(np.linspace(0.0, 1.0, DRAG_POINTS))[1], "global")
    tension = np.sqrt((force**2).sum(axis=-1, keepdims=True))
    stretch = 1 + tension / np.asarray(span.axial_stiffness)[:, None, None]
    there = stretch * _across(direction[:, None], force / np.maximum(tension, np.finfo(float).tiny))
    most = pressed * np.sqrt(((there - assumed) ** 2).sum(axis=-1)).max(axis=-1)
    load = span.mass * span.gravity
    return np.divide(most, load, out=np.ones_like(most), where=most < load)


def along(values):
    """Cosine and sine of the direction of the steady wind, zero where they are not for rounding only, shapes (n,). [-]

    1 and 0 without a wind.
    """
    direction = np.nan_to_num(values.given("load_case.wind.direction"))
    return tuple(np.where(np.abs(part) < 1e-15, 0.0, part) for part in (np.cos(direction), np.sin(direction)))


def _in_wind(span, values, wind):
    """Cables whose uniform load is weight and wind together: along another direction than the vertical."""
    blown = wind.any(axis=-1)
    load = (span.mass * span.gravity)[:, None] * UP - wind
    size = np.sqrt((load**2).sum(axis=-1))
    gravity = np.where(blown, size / span.mass, span.gravity)
    vertical = np.where((blown & (size > 0))[:, None], load / np.where(size > 0, size, 1.0)[:, None], UP)
    return Span.between(
        *values.ends, span.axial_stiffness, span.mass, gravity, chord=span.chord, vertical=vertical
    ).broadcast()
