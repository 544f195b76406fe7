"""The unstretched length that gives a wanted mean tension or a wanted sag."""

from dataclasses import replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.errors import NoSolutionError

MAX_STEPS = 120
LOOSEST = 1 / 1000 - 1  # chord strain of a cable a thousand chords long


def chord_strain_for_tension(span, tension):
    """Chord strain of the taut cable with a given mean tension.

    Parameters
    ----------
    span : Span
        One cable; its own chord strain is not used.
    tension : float
        Mean tension, > 0. [N]

    Returns
    -------
    float
        The shorter of the two cables with this tension. [-]

    Raises
    ------
    NoSolutionError
        The tension is below the least that any length gives.
    """
    loose = -((float(span.weight_per_length) * span.chord * span.cosine) ** 2) / (24 * tension**2)
    guess = tension / span.axial_stiffness + max(loose, -0.05)

    def excess(strain):
        return _solved(span, strain).mean_tension / tension - 1

    strain = _root(excess, guess, tension / span.axial_stiffness)
    if strain is not None:
        return strain
    lowest, least = _least_tension(span)
    if tension > least:
        return _between(excess, lowest, tension / span.axial_stiffness * (1 + 1e-9) + 1e-300)
    length = span.chord / (1 + lowest)
    raise NoSolutionError(
        f"a mean tension of {tension:.6g} N is below the least that this cable can have: "
        f"{least:.6g} N, at an unstretched length of {length:.6g} m"
    )


def chord_strain_for_sag(span, sag):
    """Chord strain of the cable with a given sag.

    Parameters
    ----------
    span : Span
        One cable; its own chord strain is not used.
    sag : float
        Vertical distance from the chord at mid-span, > 0. [m]

    Returns
    -------
    float
        [-]

    Raises
    ------
    NoSolutionError
        No length gives this sag: a weightless cable, for example.
    """
    depth = sag * span.cosine / span.chord
    horizontal = span.weight_per_length * span.chord**2 / (8 * sag)
    guess = horizontal / span.axial_stiffness - 8 / 3 * depth**2
    if depth > 0.2 or guess < -0.5:
        guess = 1 / np.hypot(1.0, 2 * depth) - 1

    def excess(strain):
        return 1 - _solved(span, strain).sag / sag

    strain = _root(excess, guess, 10.0)
    if strain is None:
        raise NoSolutionError(f"no unstretched length gives a sag of {sag:.6g} m")
    return strain


def _solved(span, strain):
    """The span with each chord strain of an array, solved."""
    strain = np.asarray(strain, dtype=float)
    shape = strain.shape
    batch = replace(
        span.with_chord_strain(strain),
        **{name: np.broadcast_to(getattr(span, name), shape) for name in ("chord", "cosine", "sine")},
    )
    return solve(batch)


def _root(function, guess, highest):
    """A zero of a rising function near a guess, or None."""
    from scipy.optimize import elementwise

    guess = max(guess, -0.99)
    step = max(1e-3 * abs(guess), 1e-15)
    bracket = elementwise.bracket_root(function, guess - step, guess + step, xmin=LOOSEST, xmax=highest + 2 * step,
                                        maxiter=MAX_STEPS)  # fmt: skip
    if not bracket.success:
        return None
    return _between(function, *bracket.bracket)


def _between(function, low, high):
    from scipy.optimize import elementwise

    tolerances = {"xatol": 0.0, "xrtol": 2e-16, "fatol": 4e-16, "frtol": 0.0}
    return float(elementwise.find_root(function, (low, high), tolerances=tolerances, maxiter=MAX_STEPS).x)


def _least_tension(span):
    """Chord strain and value of the least mean tension over all lengths."""
    from scipy.optimize import elementwise

    strain = np.concatenate([np.linspace(-0.9, 0.5, 150), np.geomspace(0.51, 1e3, 60)])
    place = int(np.clip(np.argmin(_solved(span, strain).mean_tension), 1, len(strain) - 2))
    found = elementwise.find_minimum(lambda x: _solved(span, x).mean_tension, tuple(strain[place - 1 : place + 2]))
    return float(found.x), float(found.f_x)
