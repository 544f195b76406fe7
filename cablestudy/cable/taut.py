"""Closed forms for taut cables (Irvine's frequencies, axial modes), for comparison with the elements.

Sources: Irvine (1981), chapters 2 and 3, for a flat taut cable; inclined cables by the component of gravity across
the chord.
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.bracketing import zeros_between


def lambda_squared(span, tension):
    """Irvine's parameter: stiffness by stretching over stiffness by sagging. [-]

    Parameters
    ----------
    span : Span
    tension : float or ndarray
        Mean tension. [N]

    Notes
    -----
    (rho A g cos(theta))^2 l^3 EA / (F^3 L_e), L_e = l (1 + 8 (sag/l)^2): the paper's gamma^2, Irvine (1981) eq. 2.41.
    """
    transverse_weight = span.weight_per_length * span.cosine
    sag = transverse_weight * span.chord**2 / (8 * tension)
    effective_length = span.chord * (1 + 8 * (sag / span.chord) ** 2)
    load_ratio = transverse_weight * span.chord / tension  # ratios: the cube of the tension overflows
    return load_ratio**2 * (span.chord / effective_length) * (span.axial_stiffness / tension)


def per_deformed_length(span):
    """Mass m L0/l [kg/m] and axial stiffness EA l/L0 [N] per length of the chord.

    The closed forms neglect the pre-stretch; with these values they agree with the exact cable.
    """
    ratio = 1 + span.chord_strain
    return span.mass / ratio, span.axial_stiffness * ratio


def string_frequencies(count, length, tension, mass):
    """The lowest natural frequencies of a taut string with fixed ends, shape (..., count). [Hz]

    Parameters
    ----------
    count : int
    length, tension, mass : float or ndarray, shape (...)
        Span [m], tension > 0 [N], mass per length [kg/m].

    Notes
    -----
    f_k = k/(2 l) sqrt(F/m). Out-of-plane modes and antisymmetric in-plane modes (k = 2, 4, ...) of a taut cable.
    """
    base = np.sqrt(np.asarray(tension) / mass) / (2 * np.asarray(length))
    return base[..., None] * np.arange(1, count + 1)


def symmetric_roots(count, lambda_2):
    """Frequencies of the symmetric in-plane modes of a taut cable, as Omega = omega l / sqrt(F/m): (..., count). [-]

    Parameters
    ----------
    count : int
        Number of frequencies, from the lowest.
    lambda_2 : float or ndarray, shape (...)
        Irvine's parameter lambda^2 >= 0, see `lambda_squared`. [-]

    Notes
    -----
    With span l, tension F and mass per length m; Omega/2 is a root y of cos(y) (1 - q) + q sin(y)/y = 0 with
    q = lambda^2/Omega^2: Irvine's tan(y) = y - 4 y^3/lambda^2 without its poles. Root k lies between (k - 1/2) pi
    (no sag) and (k + 1/2) pi.
    """
    lambda_2 = np.asarray(lambda_2, dtype=float)[..., None]
    without_sag = (np.arange(1, count + 1) - 0.5) * np.pi
    lambda_2, without_sag = np.broadcast_arrays(lambda_2, without_sag)
    shape, lambda_2, without_sag = lambda_2.shape, lambda_2.ravel(), without_sag.ravel()

    def equation(y, index):
        q = lambda_2[index] / (4 * y * y)
        return np.cos(y) * (1 - q) + q * np.sin(y) / y

    # Without sag both ends of the interval are roots: a little before them, so that it has the first and not the next.
    low, high = without_sag * (1 - 1e-12), without_sag + np.pi * (1 - 1e-12)
    return 2 * zeros_between(equation, low, high, np.arange(len(low)), rtol=1e-15).reshape(shape)


def symmetric_frequencies(count, span, tension):
    """Symmetric in-plane frequencies of a taut cable by its values per deformed length, shape (..., count). [Hz]

    Parameters
    ----------
    count : int
    span : Span
    tension : float or ndarray
        Mean tension. [N]
    """
    mass, axial_stiffness = per_deformed_length(span)
    span = replace(span, mass=mass, axial_stiffness=axial_stiffness)
    rate = np.sqrt(tension / span.mass) / span.chord / (2 * np.pi)
    return symmetric_roots(count, lambda_squared(span, tension)) * np.asarray(rate)[..., None]


def axial_frequencies(count, span):
    """Axial frequencies k c/(2 L), shape (..., count). [Hz]

    Over the unstretched length L sound travels at c = sqrt(EA/m) exactly.
    """
    sound = np.sqrt(span.axial_stiffness / np.asarray(span.mass, dtype=float))
    return (sound / (2 * span.unstretched_length))[..., None] * np.arange(1, count + 1)
