"""Integration of a response spectrum to a stated accuracy: adaptive Gauss-Kronrod panels in log frequency.

All panels of a generation are evaluated in one call. Breakpoints are laid around every resonance in steps that grow
from its half-width, so that the first generation already sees each peak.
"""

from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from cablestudy.errors import ConvergenceError

EPSILON = np.finfo(float).eps
MAX_GENERATIONS = 40
MAX_PANELS = 200_000
# breakpoints at a resonance and beside it, in half-widths: so that a rule of 15 points cannot step over a flank
OFFSETS = np.concatenate([[0.0, 1.0, 3.0, 9.0, 27.0, 81.0], 250 * 8.0 ** np.arange(12)])
OFFSETS = np.concatenate([-OFFSETS[:0:-1], OFFSETS])
OUTER, OUTERMOST = 0.3, 0.5  # of the frequency: up to where these are taken, and the one after the last of them

# Gauss-Kronrod 7-15 on [-1, 1]: positive nodes, Kronrod weights, Gauss weights (Piessens et al., QUADPACK, 1983)
_NODES = np.array([
    0.991455371120812639206854697526329, 0.949107912342758524526189684047851, 0.864864423359769072789712788640926,
    0.741531185599394439863864773280788, 0.586087235467691130294144045693013, 0.405845151377397166906606412076961,
    0.207784955007898467600689403773245, 0.0,
])  # fmt: skip
_KRONROD = np.array([
    0.022935322010529224963732008058970, 0.063092092629978553290700663189204, 0.104790010322250183839876322541518,
    0.140653259715525918745189590510238, 0.169004726639267902826583426598550, 0.190350578064785409913256402421014,
    0.204432940075298892414161999234649, 0.209482141084727828012999174891714,
])  # fmt: skip
_GAUSS = np.array([
    0.129484966168869693270611432679082, 0.279705391489276667901467771423780, 0.381830050505118944950369775488975,
    0.417959183673469387755102040816327,
])  # fmt: skip
NODES = np.concatenate([-_NODES, _NODES[-2::-1]])
KRONROD = np.concatenate([_KRONROD, _KRONROD[-2::-1]])
GAUSS = np.zeros(15)
GAUSS[1::2] = np.concatenate([_GAUSS, _GAUSS[-2::-1]])
RULES = np.stack([KRONROD, GAUSS], axis=1)


@dataclass(frozen=True)
class Integral:
    """Result of `integrate`.

    Attributes
    ----------
    value, error : ndarray, shape (r,)
        Integrals and their estimated absolute errors.
    evaluations : int
        Frequencies at which the spectrum was evaluated. [-]
    edges : ndarray, shape (k + 1,)
        Ascending panel boundaries. [Hz]
    panels : ndarray, shape (k, r)
        Integral of each panel.
    """

    value: np.ndarray
    error: np.ndarray
    evaluations: int
    edges: np.ndarray
    panels: np.ndarray


def breakpoints(low, high, resonances=(), half_widths=(), marks=(), anchor=None):
    """Panel boundaries for a spectrum with known resonances.

    Parameters
    ----------
    low, high : float
        Range. [Hz]
    resonances, half_widths : sequence of float
        Frequencies of the poles and their half-widths. [Hz]
    marks : sequence of float
        Further boundaries. [Hz]
    anchor : float, optional
        From which the decades are counted, so that ranges about the same have the same boundaries; default `low`. [Hz]

    Returns
    -------
    ndarray
        Ascending, from low to high; at least two a decade. [Hz]
    """
    anchor = low if anchor is None else anchor
    first, last = ceil(2 * log10(low / anchor)), floor(2 * log10(high / anchor))
    points = [anchor * 10.0 ** (np.arange(first, last + 1) / 2), marks, (low, high)]
    if len(resonances):
        centre, width = np.array([resonances, half_widths], dtype=float)
        centre = centre[:, None]
        steps = np.maximum(width[:, None], 1e-12 * centre) * OFFSETS
        steps = np.where(np.abs(steps) < OUTER * centre, steps, OUTERMOST * np.sign(OFFSETS) * centre)
        points.append((centre + steps).ravel())
    every = np.sort(np.concatenate(points))
    every = every[every.searchsorted(low) : every.searchsorted(high, "right")]
    kept = every[np.append(True, every[1:] > every[:-1] * (1 + 1e-13))]
    kept[-1] = high  # and not a neighbour that is the same but for rounding
    return kept


def integrate(function, edges, tolerance=1e-6):
    """Integral over frequency of one or several non-negative spectra.

    Parameters
    ----------
    function : callable
        Frequencies, shape (n,) [Hz] -> values, shape (r, n).
    edges : ndarray
        Panel boundaries, ascending. [Hz]
    tolerance : float
        Relative, for each integral.

    Returns
    -------
    Integral

    Raises
    ------
    ConvergenceError
        The tolerance was not reached, or a value is not finite.
    """
    edges = np.log(edges)
    low, high = edges[:-1], edges[1:]
    value, error, noise = _panels(function, low, high)
    evaluations = len(low) * len(NODES)
    for _ in range(MAX_GENERATIONS):
        total = value.sum(axis=1)
        allowed = tolerance * total
        missing = error.sum(axis=1) > allowed
        if not missing.any():
            break
        # a panel may have its share of the error by length, of a total that is no better known than the panels
        share = allowed[:, None] * (high - low) / (edges[-1] - edges[0])
        # halving a panel does not help below
        least = np.maximum(noise, 1e-15 * total[:, None])
        poor = (error > np.maximum(share, least))[missing].any(axis=0)
        if not poor.any():
            break
        middle, good = (low[poor] + high[poor]) / 2, ~poor
        new_low, new_high = np.concatenate([low[poor], middle]), np.concatenate([middle, high[poor]])
        if len(new_low) + np.count_nonzero(good) > MAX_PANELS:
            raise ConvergenceError(f"response spectrum: more than {MAX_PANELS} panels")
        new = _panels(function, new_low, new_high)
        evaluations += len(new_low) * len(NODES)
        order = np.argsort(np.concatenate([low[good], new_low]))
        low, high = (np.concatenate(pair)[order] for pair in ((low[good], new_low), (high[good], new_high)))
        value, error, noise = (
            np.concatenate([old[:, good], part], axis=1)[:, order]
            for old, part in zip((value, error, noise), new, strict=True)
        )
    else:
        raise ConvergenceError("response spectrum: the integral does not settle")
    error = (error + noise).sum(axis=1)
    if (error > tolerance * total).any():
        reached = np.max(error[total > 0] / total[total > 0])
        raise ConvergenceError(f"response spectrum: an error of {reached:.1e} remains, {tolerance:.1e} was wanted")
    boundaries = np.exp(np.concatenate([low, edges[-1:]]))
    return Integral(value=total, error=error, evaluations=evaluations, edges=boundaries, panels=value.T)


def _panels(function, low, high):
    """Kronrod value, estimate of its error, and what rounding the frequencies does to it; each of shape (r, k)."""
    half = (high - low) / 2
    point = np.exp((low + high)[:, None] / 2 + half[:, None] * NODES)
    values = np.asarray(function(point.ravel()))
    values = values.reshape(-1, *point.shape)
    with np.errstate(over="ignore", invalid="ignore"):
        values = values * point
        both = values @ RULES
    fine = both[..., 0] * half
    if not np.isfinite(fine).all():
        raise ConvergenceError("a value of the response spectrum is not finite")
    # rounding of a frequency changes the value on the flank of a very narrow resonance
    rounding = EPSILON * (1 + np.maximum(np.abs(low), np.abs(high)))
    change = values[..., 1:] - values[..., :-1]
    noise = rounding * np.abs(change, out=change).sum(axis=-1)
    values -= (both[..., 0] / 2)[..., None]
    spread = (np.abs(values, out=values) @ KRONROD) * half
    difference = np.abs(fine - both[..., 1] * half)
    # the estimate of QUADPACK: the difference of the rules flatters the finer one far less than it is wrong
    ratio = 200 * difference / np.where(spread > 0, spread, 1.0)
    scaled = spread * np.minimum(1.0, ratio * np.sqrt(ratio))
    error = np.maximum(np.where(spread > 0, scaled, difference), 5e-16 * np.abs(fine))
    return fine, error, noise
