"""Spectra in pictures: their frequencies, and the share of the variance below each."""

import numpy as np

RANGE = (1e-3, 1e2)  # of the pictures [Hz]


def frequencies_near(poles, half_widths, count):
    """Frequencies of RANGE with equal ratios, so many, and closer ones near poles. [Hz]

    Parameters
    ----------
    poles : ndarray, shape (p,)
        [rad/s]
    half_widths : ndarray
        Distances from each pole, over the half-width of its resonance.
    count : int
    """
    centre, width = np.abs(poles) / (2 * np.pi), np.abs(poles.real) / (2 * np.pi)
    near = (centre[:, None] + width[:, None] * half_widths).ravel()
    points = np.concatenate([np.geomspace(*RANGE, count), near])
    return np.unique(points[(points >= RANGE[0]) & (points <= RANGE[1])])


def share_below(frequency, spectrum):
    """Share of the variance below each frequency, by trapezoids, shape (f,). [-]"""
    step = np.diff(frequency) * (spectrum[1:] + spectrum[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(step)]) / step.sum()
