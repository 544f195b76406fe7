"""The loop gain over frequency: gains at which a pole crosses the imaginary axis, phase margin and bandwidth."""

import numpy as np

STEPS = 60  # of bisection, to rounding
BISECTIONS = 12  # for the frequency of a crossing, whose gain is then judged and refined
PER_DECADE = 40
ASIDE = np.concatenate([[0.0], 0.2 * 1.6 ** np.arange(16)])  # distances from a pole, in its half-widths
BESIDE = 0.12  # largest such distance, relative to the frequency of the pole
REFINEMENTS = 6
NEAR_AXIS, TURN, COARSE = 0.8, 0.5, 2e-3  # where: angle from the negative axis, turn [rad]; finest relative distance


def crossing_gains(plant, cable, poles):
    """Gains at which a pole of the closed loop crosses the imaginary axis: where L is real and negative, L = -1.

    Parameters
    ----------
    plant : Plant
    cable : Superelement
        Model of the cable.
    poles : ndarray
        Poles without control of the plant with this model. [rad/s]

    Returns
    -------
    ndarray
        Ascending. [rad/s]
    """
    omega, value = np.zeros(0), np.zeros(0, dtype=complex)
    new = frequencies(plant, np.concatenate([poles, cable.poles]))
    for _ in range(REFINEMENTS):
        with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode
            omega, value = np.append(omega, new), np.append(value, plant.unit_gain_of(cable, 1j * new))
        there = np.isfinite(value)
        order = np.argsort(omega[there])
        omega, value = omega[there][order], value[there][order]
        # L may cross the axis and come back between two frequencies: finer where it turns, and near the negative axis
        near = np.abs(np.angle(-value)) < NEAR_AXIS
        gap = np.diff(omega) / omega[1:]
        coarse = (gap > COARSE) & (near[1:] | near[:-1] | (np.abs(np.angle(value[1:] / value[:-1])) > TURN))
        new = (omega[1:] + omega[:-1])[coarse] / 2
        if not len(new):
            break
    crosses = (value.imag[:-1] * value.imag[1:] < 0) & (np.minimum(value.real[:-1], value.real[1:]) < 0)
    where = np.flatnonzero(crosses)
    if not len(where):
        return np.zeros(0)
    low, _ = _bisected(lambda omega: plant.unit_gain_of(cable, 1j * omega).imag, omega, value.imag, where, BISECTIONS)
    real = plant.unit_gain_of(cable, 1j * low).real
    return np.sort(-1 / real[real < 0])


def frequencies(plant, poles):
    """Frequencies at which a loop gain is evaluated: all decades, and beside poles and notch. [rad/s]"""
    notch = plant.notch
    if notch is not None:
        own = notch.omega * (1j - notch.damping_ratio), notch.rolloff_omega * (1j - notch.rolloff_damping_ratio)
        poles = np.concatenate([poles, own])
    poles = poles[np.abs(poles) > 0]
    centre = np.abs(poles)
    low, high = 1e-4 * centre.min(), 1e3 * centre.max()
    width = np.maximum(np.abs(poles.real), 1e-9 * centre)[:, None] * ASIDE
    centre = centre[:, None]
    width = np.where(width < BESIDE * centre, width, 0.0)
    decades = np.geomspace(low, high, 2 + int(PER_DECADE * np.log10(high / low)))
    return np.unique(np.concatenate([decades, (centre + width).ravel(), (centre - width).ravel()]))


def phase_margin(loop):
    """Least angle between L and -1 where |L| = 1; None where there is none. [deg]"""
    omega = _zeros(loop, lambda value: np.abs(value) - 1, lambda size: size[:-1] * size[1:] < 0)
    if not len(omega):
        return None
    return float(np.abs(np.degrees(np.angle(-loop.unit_gain(1j * omega)))).min())


def bandwidth(loop):
    """Where the closed loop L/(1 + L) first falls to 1/sqrt(2); None when it never does. [Hz]"""

    def first(size):
        falls = (size[:-1] > 0) & (size[1:] <= 0)
        return falls & (np.cumsum(falls) == 1)

    omega = _zeros(loop, lambda value: np.abs(value / (1 + value)) - np.sqrt(0.5), first)
    return float(omega[0] / (2 * np.pi)) if len(omega) else None


def _zeros(loop, size, chosen):
    """Frequencies at which a real function of the loop gain is zero, by bisection. [rad/s]"""
    plant = loop.plant
    omega = frequencies(plant, np.concatenate([plant.open_poles, plant.responding.poles]))
    with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode
        value = loop.gain * plant.unit_gain(1j * omega)
    there = np.isfinite(value)
    omega, value = omega[there], size(value[there])
    where = np.flatnonzero(chosen(value))
    if not len(where):
        return np.zeros(0)
    low, high = _bisected(lambda w: size(loop.gain * plant.unit_gain(1j * w)), omega, value, where, STEPS)
    return (low + high) / 2


def _bisected(function, omega, value, where, steps):
    """Narrow brackets of the zeros of a function that follow the places `where` of a grid with known values."""
    low, high, sign = omega[where], omega[where + 1], np.sign(value[where])
    for _ in range(steps):
        middle = (low + high) / 2
        same = np.sign(function(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low, high
