"""Initial length: the unstretched length of a cable with a given tension or a given sag (form finding).

The tension is the mean, horizontal or largest one, or that at an end (`TENSIONS`). The unknown is the chord strain:
chord over unstretched length, minus 1. Of two lengths with the same tension the shorter one is meant.
"""

from functools import lru_cache, partial

import numpy as np

from cablestudy.cable.bracketing import minima_between, zeros_between
from cablestudy.cable.catenary import solve
from cablestudy.cable.span import Span
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError

BELOW_LEAST = "below the least that this cable can have"  # of a tension, in messages


def _tension_at_end(end):
    """Function of a `Catenary`: its tension at end 1 (0) or end 2 (1), shape (...). [N]"""
    return lambda catenary: np.sqrt((catenary.end_forces()[..., end, :] ** 2).sum(axis=-1))


# place at which a tension may be stated -> its name in messages, and a function of a `Catenary` [N]
TENSIONS = {
    "mean": ("a mean tension", lambda catenary: catenary.mean_tension),
    "horizontal": ("a horizontal tension", lambda catenary: catenary.horizontal_tension),
    "max": ("a largest tension", lambda catenary: catenary.max_tension),
    "end_1": ("a tension at end 1", _tension_at_end(0)),
    "end_2": ("a tension at end 2", _tension_at_end(1)),
}


def shorter_strain_for_tension(span, tension, at="mean"):
    """Find the chord strain, and so the unstretched length, with which a taut cable has a stated tension.

    The chord strain is chord over unstretched length, minus 1. Above the least tension over all lengths, two lengths
    have the same tension: the shorter one is meant.

    Parameters
    ----------
    span : Span
        One cable; its own chord strain is not used.
    tension : float
        Stated tension, above 0. [N]
    at : {"mean", "horizontal", "max", "end_1", "end_2"}
        Which tension of the cable is stated: its mean, its horizontal part, the largest one, or that at an end.

    Returns
    -------
    float
        Chord strain of the shorter cable. [-]

    Raises
    ------
    NoSolutionError
        The tension is below the least over all lengths, the cable would end before its last load, or it has no definite
        form at any length.
    """
    highest, name = float(_highest_strain(span, tension, at)), TENSIONS[at][0]

    def excess(strain, _):
        return _tension(span, strain, at) / tension - 1

    fixed_loads = span.load_positions[np.isfinite(span.load_positions)]  # the others move along with the length
    if excess(highest, 0) < 0 and not len(fixed_loads):
        raise NoSolutionError(f"no unstretched length gives {name} of {tension:.6g} N")
    if excess(highest, 0) < 0:  # too long to be taut: its last load needs the length
        raise NoSolutionError(
            f"{name} of {tension:.6g} N needs a cable that ends before its last load, at {fixed_loads[-1]:.6g} m"
        )
    strain_of_least, least_tension = _least_tension(span, highest, at)
    if not np.isfinite(least_tension):
        raise NoSolutionError(f"at no length with {name} of {tension:.6g} N has the cable a definite form")
    if tension > least_tension:
        return float(_bracketed_zeros(excess, [strain_of_least], [highest], [0])[0])
    if tension >= least_tension * (1 - CABLE.mean_tension_rounding):
        return strain_of_least
    length = span.chord / (1 + strain_of_least)
    raise NoSolutionError(
        f"{name} of {tension:.6g} N is {BELOW_LEAST}: {least_tension:.6g} N, at an unstretched length of {length:.6g} m"
    )


def strains_for_tension(span, tension, at="mean"):
    """Find the chord strain e = c/L - 1 (chord c, unstretched length L) with which each of n cables has a tension T.

    Each search starts from that of a parabola of weight w per length: e = T/EA - (w c cos)^2/(24 T^2), cos being the
    cosine of the inclination. Two lengths may have the same tension: wanted is the shorter one, the larger e.

    Parameters
    ----------
    span : Span
        The n cables; their own chord strains are not used.
    tension : ndarray, shape (n,)
        T. [N]
    at : {"mean", "horizontal", "max", "end_1", "end_2"}
        Which tension of a cable T is: its mean, its horizontal part, its largest, or that at an end.

    Returns
    -------
    ndarray, shape (n,)
        e. NaN where no length was found, or only the longer of two: the function `shorter_strain_for_tension` then
        finds the shorter one, or raises an error with the reason. [-]
    """
    highest = _highest_strain(span, tension, at)
    # strain of the tension, less what the sag of a parabola adds to the length of its chord
    by_sag = -((span.weight_per_length * span.chord * span.cosine) ** 2) / (24 * tension**2)
    guess = tension / span.axial_stiffness + np.maximum(by_sag, -0.05)  # the parabola is right for little sag

    def excess(strain, index):
        return _tension(span.take(index), strain, at) / tension[index] - 1

    strain, known_to_rise = _rising_zeros(excess, guess, highest)
    unsure = np.flatnonzero(~known_to_rise & np.isfinite(strain))
    if len(unsure):  # where the tension falls with the strain, it is the longer one of two cables
        has_shorter = ~(excess(highest[unsure], unsure) < 0)
        step = np.maximum(1e-6 * np.abs(strain[unsure]), 1e-14)  # well above the rounding of a strain
        falls = excess(strain[unsure] - step, unsure) >= excess(strain[unsure] + step, unsure)
        strain[unsure[falls & has_shorter]] = np.nan
    return strain


def no_strain_for_sag(_, sag):
    """Raise NoSolutionError for a sag that no length of a cable gives, as for a weightless one."""
    raise NoSolutionError(f"no unstretched length gives a sag of {sag:.6g} m")


def strains_for_sag(span, sag):
    """Chord strains of n cables with stated sags [m], each of shape (n,); NaN where there is none. [-]"""
    depth = sag * span.cosine / span.chord
    horizontal = span.weight_per_length * span.chord**2 / (8 * sag)
    guess = horizontal / span.axial_stiffness - 8 / 3 * depth**2
    # of a deep sag as for two straight halves, since the parabola is right for little sag only
    guess = np.where((depth > 0.2) | (guess < -0.5), 1 / np.hypot(1.0, 2 * depth) - 1, guess)

    def excess(strain, index):
        return 1 - _catenary(span.take(index), strain).sag / sag[index]

    highest = _not_beyond_last_load(span, np.full(len(sag), CABLE.tautest_strain))
    return _rising_zeros(excess, guess, highest)[0]


def _highest_strain(span, tension, at="mean"):
    """Upper bound of the chord strain: the tension is at least `tension` there, or the cable ends at its last load."""
    if at != "mean":  # the tension of an end is less by the weight at most, its horizontal part by the inclination
        load = np.asarray(span.weight) + np.sqrt((span.load_forces**2).sum(axis=-1)).sum(axis=-1)
        tension = (tension + 2 * load) / (np.maximum(np.abs(span.cosine), 1e-6) if at == "horizontal" else 1.0)
    # a little more than the strain by the tension, so that rounding leaves the zero below this bound
    return _not_beyond_last_load(span, tension / span.axial_stiffness * (1 + 1e-9) + 1e-300)


def _not_beyond_last_load(span, strain):
    """The smaller of `strain` and the chord strain at which the cable ends at its last load."""
    positions = span.load_positions
    if span.load_fractions is not None:  # a load at a share of the length is always on the cable
        positions = np.where(np.isnan(span.load_fractions), positions, 0.0)
    last_load = positions.max(axis=-1, initial=0.0)
    return np.where(last_load > 0, np.minimum(strain, span.chord / np.where(last_load > 0, last_load, 1.0) - 1), strain)


def _catenary(span, strain):
    """`Catenary` of a span with each chord strain of an array."""
    return solve(span.with_chord_strain(np.asarray(strain, dtype=float)))


def _tension(span, strain, at="mean"):
    """Tension at each chord strain; NaN where the cable has no definite form."""
    catenary = _catenary(span, strain)
    return np.where(catenary.record.converged, TENSIONS[at][1](catenary), np.nan)


def _rising_zeros(function, guess, highest):
    """Find the chord strains with which n cables have stated tensions or sags: zeros of n functions of the strain.

    Each search begins near a guess: first the secant method, then brackets near the guess, then in all of the range up
    to `highest`. A function with two zeros rises at that of the shorter cable, which is the wanted one. `function`
    returns the relative errors of the stated values for strains of some cables and their indices, all of shape (k,).

    Returns
    -------
    zeros : ndarray, shape (n,)
        Not a number where none was found. [-]
    known_to_rise : ndarray of bool, shape (n,)
        True where the secant method found the zero: it accepts none at which the function falls. False where a zero is
        from a bracket, or none was found.
    """
    # half-width of the first bracket about the guess
    step = np.minimum(np.maximum(1e-3 * np.abs(guess), 1e-15), (highest - CABLE.loosest_strain) / 8)
    guess = np.clip(guess, CABLE.loosest_strain + 2 * step, highest - 2 * step)
    zeros = _zeros_by_secant(function, guess, highest)
    known_to_rise = np.isfinite(zeros)
    unsolved = np.flatnonzero(~known_to_rise)
    loosest = np.full(len(guess), CABLE.loosest_strain)
    near_low = np.maximum(guess - CABLE.near_guess_steps * step, CABLE.loosest_strain)
    near_high = np.minimum(guess + CABLE.near_guess_steps * step, highest)
    # near the guess, and then in all of the range: upper end of the first interval, and the limits
    for first_high, low_limit, high_limit in ((guess + step, near_low, near_high), (highest, loosest, highest)):
        if not len(unsolved):
            break
        from scipy.optimize.elementwise import bracket_root  # slow to import, and seldom needed

        interval = (guess - step)[unsolved], first_high[unsolved]
        limits = {"xmin": low_limit[unsolved], "xmax": high_limit[unsolved]}
        found = bracket_root(function, *interval, **limits, args=(unsolved,), maxiter=CABLE.length_brackets)
        if found.success.any():
            low, high = (end[found.success] for end in found.bracket)
            index = unsolved[found.success]
            zeros[index] = _bracketed_zeros(function, low, high, index)
        unsolved = unsolved[~found.success]
    return zeros, known_to_rise


def _zeros_by_secant(function, guess, highest):
    """Find zeros of n functions of the chord strain near good guesses, each where its function rises: secant method.

    A zero is NaN where the steps do not become small, where they leave the range, or where the function was
    not seen to rise. The arguments are those of `_rising_zeros`.
    """
    zeros, index = np.full(len(guess), np.nan), np.arange(len(guess))
    previous, x = guess, guess * (1 + CABLE.length_first_secant)
    value, rises = function(previous, index), np.zeros(len(guess), dtype=bool)
    for _ in range(CABLE.length_secants):
        previous_value, value = value, function(x, index)
        with np.errstate(divide="ignore", invalid="ignore"):  # of functions that do not change, or have no value
            change = value * (x - previous) / (value - previous_value)
            rises |= (value - previous_value) / (x - previous) > 0
        settled = rises & (
            (np.abs(change) <= CABLE.length_last_step * np.abs(x)) | (np.abs(value) <= CABLE.length_zero)
        )
        zeros[index[settled]] = x[settled]
        following = x - change
        unfinished = ~settled & (following > CABLE.loosest_strain) & (following < highest[index])
        index, previous, x, value, rises = (a[unfinished] for a in (index, x, following, value, rises))
        if not len(index):
            break
    return zeros


def _bracketed_zeros(function, low, high, index):
    """Zeros between arguments with values of different sign, shape (k,)."""
    return zeros_between(function, low, high, index, rtol=5e-16, smallest=CABLE.length_zero, steps=CABLE.length_steps)


def _least_tension(span, highest, at="mean"):
    """Chord strain and value of the least tension over all lengths."""
    strain = np.append(STRAINS[highest > STRAINS], highest)
    if span.load_positions.shape[-1]:  # a cable must not end before its last load
        tension, minimum_between = _tension(span, strain, at), partial(_least_between, span, at)
    else:  # whatever tension is asked for, only the last strain follows from it
        properties = _properties(span)
        tension = _tensions_at_strains(properties, at)[: len(strain) - 1]
        tension = np.append(tension, _tension(span, strain[-1:], at))
        minimum_between = partial(_least_between_once, properties, at)
    lowest = int(np.argmin(np.where(np.isnan(tension), np.inf, tension)))
    if 0 < lowest < len(strain) - 1:
        minimum, least = minimum_between(*strain[lowest - 1 : lowest + 2].tolist())
        if least <= tension[lowest]:
            return minimum, least
    return float(strain[lowest]), float(tension[lowest])


def _least_between(span, at, low, middle, high):
    """Chord strain and value of the least tension between `low` and `high`; it is less at `middle` than at both."""
    points = np.array([low, middle, high])[:, None]
    (minimum,), (least,) = minima_between(lambda strain, _: _tension(span, strain, at), *points, [0])
    return float(minimum), float(least)


def _strains():
    """Chord strains from those of long cables to those of taut ones, ascending. [-]"""
    small = np.geomspace(1e-14, 1e-2, 50)  # a steep cable has its least tension just before it is slack
    # under loads larger than its weight, where it is long
    long = np.geomspace(1 + CABLE.loosest_strain, 0.1, 50)[:-1] - 1
    slack, taut = np.linspace(-0.9, -0.011, 100), np.geomspace(0.011, CABLE.tautest_strain, 100)
    return np.concatenate([long, slack, -small[::-1], [0.0], small, taut])


STRAINS = _strains()


def _properties(span):
    """Name and value of each field of a cable without loads but its length, a tuple."""
    names = "chord", "cosine", "sine", "axial_stiffness", "mass", "gravity"
    numbers = tuple((name, float(getattr(span, name))) for name in names)
    return (*numbers, *((name, tuple(np.asarray(getattr(span, name)).tolist())) for name in ("horizontal", "vertical")))


def _span_of(properties):
    """`Span` of such a cable, of any length."""
    return Span(**{name: np.array(value)[()] for name, value in properties}, chord_strain=0.0)


@lru_cache(maxsize=32)
def _tensions_at_strains(properties, at):
    """Tensions of such a cable at STRAINS."""
    return _tension(_span_of(properties), STRAINS, at)


@lru_cache(maxsize=32)
def _least_between_once(properties, at, low, middle, high):
    """`_least_between` of such a cable."""
    return _least_between(_span_of(properties), at, low, middle, high)
