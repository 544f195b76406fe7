"""Initial length: the unstretched length of a cable with a given mean tension or a given sag (form finding)."""

import numpy as np

from cablestudy.cable.bracketing import bracket, minima_between, zeros_between
from cablestudy.cable.catenary import solve
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError

BELOW_LEAST = "below the least that this cable can have"  # of a tension, in messages


def _end(end):
    return lambda catenary: np.sqrt((catenary.end_forces()[..., end, :] ** 2).sum(axis=-1))


# Where a tension may be stated -> how messages name it, and its value. [N]
TENSIONS = {
    "mean": ("a mean tension", lambda catenary: catenary.mean_tension),
    "horizontal": ("a horizontal tension", lambda catenary: catenary.horizontal_tension),
    "max": ("a largest tension", lambda catenary: catenary.max_tension),
    "end_1": ("a tension at end 1", _end(0)),
    "end_2": ("a tension at end 2", _end(1)),
}


def closer_strain_for_tension(span, tension, at="mean"):
    """Chord strain of a taut cable with a given tension, by a search that also finds the least tension.

    Parameters
    ----------
    span : Span
        One cable; its own chord strain is not used.
    tension : float
        > 0. [N]
    at : str
        A key of TENSIONS: the tension where it is.

    Returns
    -------
    float
        Of the shorter one of the two cables with this tension. [-]

    Raises
    ------
    NoSolutionError
        The tension is below the least of all lengths, or the cable would end before its last load.
    """
    highest, name = float(_tightest(span, tension, at)), TENSIONS[at][0]

    def excess(strain, _):
        return _tension(span, strain, at) / tension - 1

    placed = span.load_positions[np.isfinite(span.load_positions)]  # the others move along with the length
    if excess(highest, 0) < 0 and not len(placed):
        raise NoSolutionError(f"no unstretched length gives {name} of {tension:.6g} N")
    if excess(highest, 0) < 0:  # too long to be taut: its last load needs the length
        raise NoSolutionError(
            f"{name} of {tension:.6g} N needs a cable that ends before its last load, at {placed[-1]:.6g} m"
        )
    lowest, least = _least_tension(span, highest, at)
    if not np.isfinite(least):
        raise NoSolutionError(f"at no length with {name} of {tension:.6g} N has the cable a definite form")
    if tension > least:
        return float(_between(excess, [lowest], [highest], [0])[0])
    if tension >= least * (1 - CABLE.mean_tension_rounding):
        return lowest
    length = span.chord / (1 + lowest)
    raise NoSolutionError(
        f"{name} of {tension:.6g} N is {BELOW_LEAST}: {least:.6g} N, at an unstretched length of {length:.6g} m"
    )


def strains_for_tension(span, tension, at="mean"):
    """Chord strains of n taut cables with given tensions [N] at one of TENSIONS, each of shape (n,). [-]

    Not a number where no zero near the guess was found, or only the longer one of two cables with this tension:
    `closer_strain_for_tension` decides.
    """
    highest = _tightest(span, tension, at)
    # strain of the tension, less what the sag of a parabola adds to the length of its chord
    by_sag = -((span.weight_per_length * span.chord * span.cosine) ** 2) / (24 * tension**2)
    guess = tension / span.axial_stiffness + np.maximum(by_sag, -0.05)

    def excess(strain, index):
        return _tension(span.take(index), strain, at) / tension[index] - 1

    strain, rises = _root(excess, guess, highest)
    unsure = np.flatnonzero(~rises & np.isfinite(strain))
    if len(unsure):  # where the tension falls with the strain, it is the longer one of two cables
        no_shorter = excess(highest[unsure], unsure) < 0
        step = np.maximum(1e-6 * np.abs(strain[unsure]), 1e-14)
        falls = excess(strain[unsure] - step, unsure) >= excess(strain[unsure] + step, unsure)
        strain[unsure[falls & ~no_shorter]] = np.nan
    return strain


def no_strain_for_sag(_, sag):
    """Raise NoSolutionError for a sag that `strains_for_sag` found no length for, as of a weightless cable."""
    raise NoSolutionError(f"no unstretched length gives a sag of {sag:.6g} m")


def strains_for_sag(span, sag):
    """Chord strains of n cables with given sags [m], each of shape (n,); not a number where there is none. [-]"""
    depth = sag * span.cosine / span.chord
    horizontal = span.weight_per_length * span.chord**2 / (8 * sag)
    guess = horizontal / span.axial_stiffness - 8 / 3 * depth**2
    guess = np.where((depth > 0.2) | (guess < -0.5), 1 / np.hypot(1.0, 2 * depth) - 1, guess)

    def excess(strain, index):
        return 1 - _solved(span.take(index), strain).sag / sag[index]

    return _root(excess, guess, _shortest(span, np.full(len(sag), CABLE.tautest_strain)))[0]


def _tightest(span, tension, at="mean"):
    """Chord strain at which the tension is at least `tension`, or the cable ends at its last load."""
    if at != "mean":  # the tension of an end is less by the weight at most, its horizontal part by the inclination
        load = np.asarray(span.weight) + np.sqrt((span.load_forces**2).sum(axis=-1)).sum(axis=-1)
        tension = (tension + 2 * load) / (np.maximum(np.abs(span.cosine), 1e-6) if at == "horizontal" else 1.0)
    return _shortest(span, tension / span.axial_stiffness * (1 + 1e-9) + 1e-300)


def _shortest(span, strain):
    """The smaller of `strain` and the chord strain at which the cable ends at its last load."""
    places = span.load_positions
    if span.load_fractions is not None:  # a load at a share of the length is always on the cable
        places = np.where(np.isnan(span.load_fractions), places, 0.0)
    last = places.max(axis=-1, initial=0.0)
    return np.where(last > 0, np.minimum(strain, span.chord / np.where(last > 0, last, 1.0) - 1), strain)


def _solved(span, strain):
    """`Catenary` of a span with each chord strain of an array."""
    return solve(span.with_chord_strain(np.asarray(strain, dtype=float)))


def _tension(span, strain, at="mean"):
    """Tension at each chord strain; not a number where the cable has no definite form."""
    solved = _solved(span, strain)
    return np.where(solved.record.converged, TENSIONS[at][1](solved), np.nan)


def _root(function, guess, highest):
    """Zeros of rising functions near guesses, each of shape (n,); not a number where there is none.

    The function takes places and which of the n they belong to. The second array says where the function is known to
    rise at its zero.
    """
    step = np.minimum(np.maximum(1e-3 * np.abs(guess), 1e-15), (highest - CABLE.loosest_strain) / 8)
    guess = np.clip(guess, CABLE.loosest_strain + 2 * step, highest - 2 * step)
    root = _by_secant(function, guess, highest)
    rises = np.isfinite(root)
    rest = np.flatnonzero(~rises)
    near = (
        np.maximum(guess - CABLE.near_guess_steps * step, CABLE.loosest_strain),
        np.minimum(guess + CABLE.near_guess_steps * step, highest),
    )
    for right, (least, most) in ((guess + step, near), (highest, (np.full(len(guess), CABLE.loosest_strain), highest))):
        if not len(rest):
            break
        limits = least[rest], most[rest]
        found, low, high = bracket(function, (guess - step)[rest], right[rest], *limits, rest, CABLE.length_brackets)
        if found.any():
            root[rest[found]] = _between(function, low[found], high[found], rest[found])
        rest = rest[~found]
    return root, rises


def _by_secant(function, guess, highest):
    """Zeros of `_root` by the secant method from good guesses; not a number where it does not settle on a rise."""
    root, index = np.full(len(guess), np.nan), np.arange(len(guess))
    before, place = guess, guess * (1 + CABLE.length_first_secant)
    value, risen = function(before, index), np.zeros(len(guess), dtype=bool)
    for _ in range(CABLE.length_secants):
        earlier, value = value, function(place, index)
        with np.errstate(divide="ignore", invalid="ignore"):  # of functions that do not change, or have no value
            change = value * (place - before) / (value - earlier)
            risen |= (value - earlier) / (place - before) > 0
        settled = risen & (
            (np.abs(change) <= CABLE.length_last_step * np.abs(place)) | (np.abs(value) <= CABLE.length_zero)
        )
        root[index[settled]] = place[settled]
        after = place - change
        going = ~settled & (after > CABLE.loosest_strain) & (after < highest[index])
        index, before, place, value, risen = (part[going] for part in (index, place, after, value, risen))
        if not len(index):
            break
    return root


def _between(function, low, high, index):
    """Zeros between two places of different sign, shape (k,)."""
    return zeros_between(function, low, high, index, rtol=5e-16, smallest=CABLE.length_zero, steps=CABLE.length_steps)


def _least_tension(span, highest, at="mean"):
    """Chord strain and value of the least tension over all lengths."""
    near = np.geomspace(1e-14, 1e-2, 50)  # a steep cable has its least tension just before it is slack
    # under loads larger than its weight, where it is long
    long = np.geomspace(1 + CABLE.loosest_strain, 0.1, 50)[:-1] - 1
    strain = np.concatenate(
        [long, np.linspace(-0.9, -0.011, 100), -near[::-1], [0.0], near, np.geomspace(0.011, CABLE.tautest_strain, 100)]
    )
    strain = np.append(strain[strain < highest], highest)
    tension = _tension(span, strain, at)
    place = int(np.argmin(np.where(np.isnan(tension), np.inf, tension)))
    if 0 < place < len(strain) - 1:
        around = strain[place - 1 : place + 2, None]
        (found,), (value,) = minima_between(lambda x, _: _tension(span, x, at), *around, [0])
        if value <= tension[place]:
            return float(found), float(value)
    return float(strain[place]), float(tension[place])
