"""Start of Newton's method for a catenary: a parabola for a taut cable, an inextensible catenary for a slack one.

Source: Irvine (1981), chapter 1 (inextensible catenary) and chapter 2 (parabola).
"""

import numpy as np

from cablestudy.cable.segment import TINY


def first_tension(span):
    """Approximate tension vector at mid-length, weight and loads distributed uniformly over the cable.

    Parameters
    ----------
    span : Span

    Returns
    -------
    tuple of 3 ndarrays, shape (...)
        In the chord frame. [N]
    """
    down = span.load_forces.sum(axis=-2) - np.asarray(span.weight)[..., None] * span.up
    size = np.sqrt((down**2).sum(axis=-1))
    largest = np.maximum(size, np.sqrt((span.load_forces**2).sum(axis=-1)).max(axis=-1, initial=0.0))
    up = -down / np.maximum(size, TINY)[..., None]
    along = up[..., 0]
    across = np.sqrt(up[..., 1] ** 2 + up[..., 2] ** 2)
    taut = _taut_tension(span, np.where(size > 0, across * size, largest))
    ratio = 1.0 / (1.0 + span.chord_strain)  # unstretched length over chord
    slack = (ratio > 1.2) & (across > 1e-8)
    if not np.any(slack):
        return taut, np.zeros_like(taut), np.zeros_like(taut)
    ratio_across = np.sqrt(np.maximum(ratio**2 - along**2, 1.0)) / np.maximum(across, 1e-8)
    parameter = _sinhc_inverse(np.where(slack, ratio_across, 1.0))
    horizontal = largest * across / (2 * parameter * np.maximum(ratio, 1.0))
    vertical = largest * along / np.maximum(2 * ratio * np.tanh(np.minimum(parameter, 300.0)), TINY)
    unit = 1.0 / np.maximum(across, 1e-8)
    q = np.where(slack, horizontal * across + vertical * along, taut)
    n, y = (np.where(slack, (-horizontal * along * unit + vertical) * up[..., i], 0.0) for i in (1, 2))
    return q, n, y


def _taut_tension(span, across):
    """Positive root T of T^3/EA - strain T^2 - W^2/24 = 0, the parabola's, for a transverse load W: Newton steps."""
    stiffness, strain = span.axial_stiffness, span.chord_strain
    load = across**2 / 24
    tension = np.maximum(np.maximum(strain, 0.0) * stiffness, np.cbrt(load * stiffness))
    slack = strain < 0
    tension = np.where(slack, np.minimum(tension, np.sqrt(load / np.where(slack, -strain, 1.0))), tension)
    tension = np.maximum(tension, TINY)
    for _ in range(8):
        value = tension**2 * (tension / stiffness - strain) - load
        slope = tension * (3 * tension / stiffness - 2 * strain)
        step = np.where(slope > 0, value / np.where(slope > 0, slope, 1.0), 0.0)
        tension = np.clip(tension - step, tension / 4, tension * 4)
    return tension


def _sinhc_inverse(value):
    """y > 0 with sinh(y)/y = value >= 1."""
    log = np.log(np.maximum(value, 1 + 1e-12))
    y = np.where(value < 3, np.sqrt(6 * np.maximum(value - 1, 1e-12)), log + np.log(2 * log + 2))
    for _ in range(6):
        small = np.minimum(y, 300.0)
        value_log = np.where(y > 300, y - np.log(2 * y), np.log(np.sinh(small) / small))
        slope = np.where(y > 300, 1.0, 1 / np.tanh(small)) - 1 / y
        y = np.maximum(y - (value_log - log) / slope, y / 3)
    return y
