"""Textbook closed forms of taut cables."""

import math

import numpy as np
from mpmath import mp


def string_frequencies(count, length, tension, mass):
    """Taut string, fixed ends: f_k = k/(2 l) sqrt(T/m), mass per deformed length. Irvine (1981), ch. 3. [Hz]"""
    return np.arange(1, count + 1) / (2 * length) * math.sqrt(tension / mass)


def axial_frequencies(count, length, stiffness, mass):
    """Axial waves between fixed ends: f_k = k c/(2 l), c = sqrt(EA/m). The paper's section 4.1. [Hz]

    Length and mass per length both unstretched, or both as the paper has them (chord).
    """
    return np.arange(1, count + 1) / (2 * length) * math.sqrt(stiffness / mass)


def irvine_parameter(weight, length, stiffness, tension, inclination=0.0):
    """Irvine's lambda^2 = (w l cos(theta)/T)^2 l EA/(T Le), Le = l (1 + (w l cos(theta)/T)^2/8).

    Irvine (1981), eq. 3.10 (the paper's gamma^2; its Le with sag = w l^2/(8 T) is the same), with the chord l [m], the
    tension along it [N] and its inclination [rad].
    """
    slope = weight * length * math.cos(inclination) / tension
    return slope**2 * stiffness / (tension * (1 + slope**2 / 8))


def irvine_symmetric(count, lambda_squared):
    """Roots Omega of tan(y) = y - (4/lambda^2) y^3, y = Omega/2: omega l/sqrt(T/m) of symmetric in-plane modes.

    Irvine (1981), eq. 3.11; lambda^2 = 0 means the string. tan(y) - y + (4/lambda^2) y^3 increases on every branch of
    the tangent and from -inf to +inf, so branch k, ((k - 1/2) pi, (k + 1/2) pi), holds exactly one root, and the
    branch before holds none.
    """
    if lambda_squared == 0:
        return math.pi * (2.0 * np.arange(1, count + 1) - 1)
    with mp.workdps(30):
        roots = []
        for k in range(1, count + 1):
            low, high = (k - mp.mpf(1) / 2) * mp.pi, (k + mp.mpf(1) / 2) * mp.pi
            for _ in range(90):  # bisection on the tangent itself: it cannot leave its branch
                y = (low + high) / 2
                above = mp.tan(y) - y + 4 * y**3 / mp.mpf(lambda_squared) > 0
                low, high = (low, y) if above else (y, high)
            roots.append(float(low + high))
    return np.array(roots)


def irvine_frequencies(count, length, tension, mass, stiffness, gravity=9.81):
    """Symmetric in-plane frequencies of a horizontal taut cable after Irvine. [Hz]

    Chord [m], tension [N], mass per length [kg/m], EA [N]. With stretch: m L0/l and EA l/L0.
    """
    lambda_squared = irvine_parameter(mass * gravity, length, stiffness, tension)
    return irvine_symmetric(count, lambda_squared) / (2 * math.pi * length) * math.sqrt(tension / mass)
