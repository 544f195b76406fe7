"""Stability by counting how often the loop gain passes the negative real axis beyond -1 (Nyquist).

Each passage is located to rounding; no matrix of the size of the model is factorised. The gain of the winch only scales
the curve, so that its passages are counted once for all gains.

Where the damping is light the grid is laid around those poles only that the curve can show, and as far as the curve
reaches: a mode that hardly couples is left out where it cannot turn the curve to the real axis, and so are frequencies
beyond which the curve surely stays within a small circle. For what lies within that circle there is the whole grid.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np

from cablestudy.control.ends import GONDOLA, GROUND
from cablestudy.control.roots import between
from cablestudy.control.together import Notch, Together
from cablestudy.control.transfer import BLOCK

ASIDE = np.concatenate([[0.0], 0.2 * 1.6 ** np.arange(16)])  # grid beside a pole, in half-widths
PER_DECADE, PER_CALM_DECADE = 40, 10  # among the poles, and below all of them
REACH = 0.12  # of a pole's frequency: farther aside the grid of all decades is the finer one
LIGHT = 0.3  # damping ratio up to which a pole is a resonance
WEAK = 0.03  # what a mode adds to the curve, relatively, up to which it can be left out
TURN = 30  # times as much the curve must be away from the real axis there
CIRCLE = 0.03  # of the largest resonance: size of the circle that is not looked into
ENDS, BEYOND = 18, 3.0  # places where the curve may end, up to so many times the highest mode


@dataclass(frozen=True)
class Passages:
    """Where the loop gain for a gain of 1 rad/s passes the negative real axis.

    Attributes
    ----------
    omega : ndarray, shape (k,)
        [rad/s]
    depth : ndarray, shape (k,)
        -L there: the loop is at its limit for a gain of 1/depth. [s/rad]
    turn : ndarray of int, shape (k,)
        +1 from below to above (two poles to the right once the gain is above 1/depth), -1 back.
    circle : float
        Depth from which on they are all here. [s/rad]
    every : callable or None
        Without arguments: all of them, where not all are here.
    """

    omega: np.ndarray
    depth: np.ndarray
    turn: np.ndarray
    circle: float = 0.0
    every: Callable | None = None

    def for_gain(self, gain):
        """The passages, enough of them for a gain."""
        return self.every() if gain * self.circle > 1 else self

    def unstable_poles(self, gain):
        """How many closed-loop poles lie to the right at a gain."""
        if gain * self.circle > 1:
            return self.every().unstable_poles(gain)
        return int(2 * self.turn[self.depth * gain > 1].sum())

    @property
    def largest_gain(self):
        """Below it the loop is stable; None when it always is. [rad/s]"""
        for depth in np.sort(self.depth)[::-1]:
            if depth < self.circle:
                break
            if self.turn[self.depth >= depth].sum() != 0:
                return float(1 / depth)
        return self.every().largest_gain if self.circle else None


@dataclass(frozen=True)
class Curve:
    """L for a gain of 1 rad/s over frequency.

    Attributes
    ----------
    omega : ndarray, shape (m,)
        Ascending. [rad/s]
    value : ndarray, complex, shape (m,)
        [-]
    circle : float
        Size from which on the curve is complete. [-]
    """

    omega: np.ndarray
    value: np.ndarray
    circle: float = 0.0


def whole_curve(plant):
    """The curve on a grid that resolves every pole of the cable and of the gondola.

    Parameters
    ----------
    plant : Plant
        Damped.

    Returns
    -------
    Curve
    """
    poles = np.concatenate([plant.seen_poles, plant.cable_poles, _filter(plant)])
    centre = np.abs(poles)
    low, high = 1e-4 * centre.min(), 1e3 * centre.max()
    return _sampled(plant, poles, [_decades(low, high, PER_DECADE)], 0.0)


def curves_of(plants):
    """The same with only what decides about stability, unless the gain is very large; what can be for all at once.

    Parameters
    ----------
    plants : list of Plant
        Damped.

    Returns
    -------
    list of Curve
    """
    found, groups = [None] * len(plants), {}
    for index, plant in enumerate(plants):
        if _light(plant):
            alike = groups.setdefault((len(plant.felt.omega), plant.location, plant.notch is None), [[]])
            if len(alike[-1]) * ENDS * len(plant.felt.omega) >= BLOCK:
                alike.append([])
            alike[-1].append(index)
    for indices in chain(*groups.values()):
        for index, curve in zip(indices, _short([plants[index] for index in indices]), strict=True):
            found[index] = curve
    return [curve or whole_curve(plant) for plant, curve in zip(plants, found, strict=True)]


def _light(plant):
    """Whether all of its poles are resonances."""
    cable, seen = plant.felt, plant.seen_poles
    if cable.strain is not None or not len(cable.omega):
        return False
    ratio = cable.damping_ratio
    return ratio.min() > 0 and ratio.max() <= LIGHT and (seen.real >= -LIGHT * np.abs(seen)).all()


def _short(plants):
    """Curves of plants with equally many modes, alike in location and in having a notch; None for a long one."""
    cables, location = [plant.felt for plant in plants], plants[0].location
    omega, ratio, participation = (
        np.array([getattr(cable, name) for cable in cables]) for name in ("omega", "damping_ratio", "participation")
    )
    values = np.array([plant.stiffness(1j * own) for plant, own in zip(plants, omega, strict=True)])
    notch, mass = Notch.stacked([plant.notch for plant in plants]), np.array([[plant.mass] for plant in plants])
    whole, driven = values[:, 0] - mass * omega**2, values[:, 1]
    strength = participation[..., GONDOLA] / omega**2
    columns = GONDOLA, GONDOLA if location == "gondola" else GROUND
    first, second = (np.abs(strength * participation[..., column]) for column in columns)
    with np.errstate(divide="ignore", invalid="ignore"):
        curve = (1 if notch is None else notch(1j * omega)) * driven / (1j * omega * whole)
        added = (first / np.abs(whole) + second / np.abs(driven)) / (2 * ratio)
        strong = ~((added < WEAK) & (np.abs(curve.imag) > TURN * added * np.abs(curve)))
        size = np.where(strong, np.abs(curve), 0.0)
        circle = CIRCLE * size.max(axis=1, keepdims=True)
        low, high = np.where(size > circle, omega, 0.0).max(axis=1), BEYOND * omega.max(axis=1)
        places = (low * np.exp(np.linspace(0.01, 1.0, ENDS)[:, None] * np.log(high / low))).T
        driven, own = _bounds(cables, places, first, second, columns)
        own = mass - own
        filtered, far = _control(notch, places)
        inside = far & (own > 0) & (filtered * driven <= circle * own)
    beyond, found = np.logical_and.accumulate(inside[:, ::-1], axis=1).sum(axis=1), [None] * len(plants)
    for number in np.flatnonzero(beyond):
        plant, chosen, end = plants[number], strong[number], float(places[number, -beyond[number]])
        poles = omega[number, chosen] * (1j - ratio[number, chosen])
        poles = np.concatenate([plant.seen_poles, poles, _filter(plant)])
        lowest = min(float(np.abs(poles).min()), end)
        poles = poles[np.abs(poles) * (1 - REACH) < end]
        decades = [_decades(1e-4 * lowest, lowest / 3, PER_CALM_DECADE)[:-1], _decades(lowest / 3, end, PER_DECADE)]
        found[number] = _sampled(plant, poles, decades, float(circle[number, 0]), end)
    return found


def _bounds(cables, places, first, second, columns):
    """Bounds of |k_xu| and |k_xx| over w^2 from each place to the next, and from the last on, shape (p, m) each. [kg]

    The sums over the modes: |r/(r + W^2)| over w^2 is at most sqrt(1 + (2 zeta/y)^2)/W^2 with y = w/W at the place,
    times the largest 1/|1 - y^2 + 2 i zeta y| up to the next one.
    """
    omega, damping = (
        np.array([getattr(cable, name) for cable in cables])[:, None] for name in ("omega", "damping_ratio")
    )
    damping = 4 * damping**2
    until = np.append(places, np.full((len(places), 1), np.inf), axis=1)
    square = (until[..., None] / omega) ** 2
    size = (1 - square) ** 2 + damping * square
    before = square < 1 - damping / 2
    peak = before[:, :-1] & ~before[:, 1:]
    least = np.where(peak, damping * (1 - damping / 4), np.minimum(size[:, :-1], size[:, 1:]))
    largest = np.sqrt((1 + damping / square[:, :-1]) / least) / omega**2
    sums = largest @ np.stack([first, second], axis=-1)
    static, moving = (
        np.abs([getattr(cable, name)[GONDOLA] for cable in cables]) for name in ("stiffness", "residual_inertia")
    )
    for k, column in enumerate(columns):
        sums[..., k] += static[:, [column]] / places**2 + moving[:, [column]]
    return sums[..., 1], sums[..., 0]


def _control(notch, places):
    """A bound of |C| from each place on, and whether it is one there."""
    if notch is None:
        return 1 / places, True
    below, gone = notch.omega / places, 1 - (notch.rolloff_omega / places) ** 2
    size = (1 + below**2 + 2 * notch.damping_ratio * below) * (notch.rolloff_omega / notch.omega) ** 2
    return size / (gone * places), places > 1.2 * notch.rolloff_omega


def _decades(low, high, count):
    """Frequencies in equal ratios, about so many to a decade, both ends included."""
    steps = 2 + int(count * np.log10(high / low))
    inner = low * np.exp(np.arange(steps) * (np.log(high / low) / (steps - 1)))
    inner[-1] = high
    return inner


def _filter(plant):
    """Zero of the notch and pole of its roll-off, where a grid is laid around them. [rad/s]"""
    notch = plant.notch
    if notch is None:
        return np.zeros(0, dtype=complex)
    places = [notch.omega * (1j - notch.damping_ratio)]
    if notch.rolloff_damping_ratio < LIGHT:
        places.append(notch.rolloff_omega * (1j - notch.rolloff_damping_ratio))
    return np.array(places)


def _sampled(plant, poles, decades, circle, end=np.inf):
    """The curve on all decades and beside poles, but for places upon the pole of an undamped mode."""
    centre = np.abs(poles)
    width = np.maximum(np.abs(poles.real), 1e-9 * centre)[:, None] * ASIDE
    centre = centre[:, None]
    width = np.where(width < REACH * centre, width, 0.0)
    omega = np.sort(np.concatenate([*decades, (centre + width).ravel(), (centre - width).ravel()]))
    chosen = omega <= end
    chosen[1:] &= omega[1:] > omega[:-1] * (1 + 1e-14)
    omega = omega[chosen]
    with np.errstate(divide="ignore", invalid="ignore"):
        value = plant.unit_gain(1j * omega)
    there = np.isfinite(value)
    return Curve(omega[there], value[there], circle)


def passages_of(plants, curves):
    """Passages of curves, refined for all plants at once.

    Parameters
    ----------
    plants : list of Plant
    curves : list of Curve

    Returns
    -------
    list of Passages
        Of incomplete curves without `every`.
    """
    brackets = []
    for curve in curves:
        real, imaginary = curve.value.real, curve.value.imag
        across = (imaginary[:-1] * imaginary[1:] < 0) & (np.minimum(real[:-1], real[1:]) < 0)
        brackets.append(np.flatnonzero(across))
    which = np.repeat(np.arange(len(plants)), [len(where) for where in brackets])
    together = Together(plants)
    low, high = (
        np.concatenate([curve.omega[where + k] for curve, where in zip(curves, brackets, strict=True)]) for k in (0, 1)
    )
    omega = between(lambda active, place: together.unit_gain(which[active], 1j * place).imag, low, high)
    depth = -together.unit_gain(which, 1j * omega).real if len(omega) else np.zeros(0)
    ends, found = np.searchsorted(which, np.arange(len(plants) + 1)), []
    for curve, where, a, b in zip(curves, brackets, ends[:-1], ends[1:], strict=True):
        turn = np.where(curve.value.imag[where] < 0, 1, -1)
        keep = (depth[a:b] > 0) & (depth[a:b] >= curve.circle)
        found.append(Passages(omega[a:b][keep], depth[a:b][keep], turn[keep], curve.circle))
    return found
