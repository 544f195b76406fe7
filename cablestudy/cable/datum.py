"""The unstretched length that gives a wanted mean tension or a wanted sag."""

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.errors import NoSolutionError

MAX_STEPS = 120
ROUNDING = 1e-12  # of a mean tension
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
        The tension is below the least that any length gives, or asks for a cable that ends before its last load.
    """
    highest = _shortest(span, tension / span.axial_stiffness * (1 + 1e-9) + 1e-300)
    loose = -((float(span.weight_per_length) * span.chord * span.cosine) ** 2) / (24 * tension**2)
    guess = tension / span.axial_stiffness + max(loose, -0.05)

    def excess(strain):
        return _solved(span, strain).mean_tension / tension - 1

    strain = _root(excess, guess, highest)
    only_longer = excess(highest) < 0  # the load keeps it too long to be taut
    if strain is not None and (only_longer or _rises(excess, strain)):
        return strain
    if only_longer:
        raise NoSolutionError(
            f"a mean tension of {tension:.6g} N needs a cable that ends before its last load, at "
            f"{span.load_positions[-1]:.6g} m"
        )
    lowest, least = _least_tension(span, highest)
    if tension > least:
        return _between(excess, lowest, highest)
    if tension >= least * (1 - ROUNDING):
        return lowest
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

    strain = _root(excess, guess, _shortest(span, 10.0))
    if strain is None:
        raise NoSolutionError(f"no unstretched length gives a sag of {sag:.6g} m")
    return strain


def _shortest(span, strain):
    """The largest chord strain up to `strain` at which the cable still reaches its last load."""
    return min(strain, *(span.chord / span.load_positions[-1:] - 1)) if span.load_positions.any() else strain


def _solved(span, strain):
    """The span with each chord strain of an array, solved."""
    return solve(span.with_chord_strain(np.asarray(strain, dtype=float)))


def _root(function, guess, highest):
    """A zero of a rising function near a guess, or None."""
    from scipy.optimize import elementwise

    step = min(max(1e-3 * abs(guess), 1e-15), (highest - LOOSEST) / 8)
    guess = min(max(guess, LOOSEST + 2 * step), highest - 2 * step)
    bracket = elementwise.bracket_root(
        function, guess - step, guess + step, xmin=LOOSEST, xmax=highest, maxiter=MAX_STEPS
    )
    if not bracket.success:
        return None
    return _between(function, *bracket.bracket)


def _between(function, low, high):
    from scipy.optimize import elementwise

    tolerances = {"xatol": 0.0, "xrtol": 2e-16, "fatol": 4e-16, "frtol": 0.0}
    return float(elementwise.find_root(function, (low, high), tolerances=tolerances, maxiter=MAX_STEPS).x)


def _rises(function, place):
    step = max(1e-6 * abs(place), 1e-14)
    return function(place - step) < function(place + step)


def _least_tension(span, highest):
    """Chord strain and value of the least mean tension over all lengths."""
    from scipy.optimize import elementwise

    near = np.geomspace(1e-14, 1e-2, 50)  # a steep cable has its least tension where it just hangs straight
    strain = np.concatenate([np.linspace(-0.9, -0.011, 100), -near[::-1], [0.0], near, np.geomspace(0.011, 1e3, 100)])
    strain = np.append(strain[strain < highest], highest)
    tension = _solved(span, strain).mean_tension
    place = int(np.argmin(tension))
    if 0 < place < len(strain) - 1:
        found = elementwise.find_minimum(lambda x: _solved(span, x).mean_tension, tuple(strain[place - 1 : place + 2]))
        if found.success and found.f_x <= tension[place]:
            return float(found.x), float(found.f_x)
    return float(strain[place]), float(tension[place])
