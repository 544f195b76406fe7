"""Frequencies at which the loop gain of several winches is evaluated, and its eigenvalues there."""

import numpy as np

PER_DECADE = 30
ASIDE = np.array([1.0, 3.0])  # frequencies beside a pole, in its half-widths, for the sensitivity
CLOSER = np.array([0.3, 0.7, 1.2, 2.0, 3.0, 5.0])  # and for eigenvalues of the loop gain, which must be told apart
UNDAMPED = 1e-9  # damping ratio below which the loop gain at a pole is infinite
NARROWEST = 1e-6  # half-width that is taken at least, over the frequency
RANGE = 1e-3, 30.0  # frequencies that are looked at, over the least and largest of the poles
TURN = 0.1  # of a delay from one frequency to the next [rad]
AT_ONCE = 100  # frequencies


def beside(poles, distances, law):
    """Frequencies of all decades, at poles, at some distances from them in their half-widths, and of the turns that a
    delay can be approximated for. [rad/s]
    """
    poles = poles[np.abs(poles) > 1e-9 * np.abs(poles).max(initial=0.0)]
    poles = poles[poles.imag >= 0]
    centre, width = np.abs(poles), np.abs(poles.real)
    low, high = RANGE[0] * centre.min(), RANGE[1] * centre.max()
    decades = np.geomspace(low, high, 2 + int(PER_DECADE * np.log10(high / low)))
    steps = np.clip(width, NARROWEST * centre, 0.2 * centre)[:, None] * np.concatenate([-distances, distances])
    turns = TURN / law.delay * np.arange(1, law.reach * law.delay / TURN) if law.delay else np.zeros(0)
    turns = turns[turns < high]
    points = [decades, centre[width > UNDAMPED * centre], (centre[:, None] + steps).ravel(), turns]
    points = np.concatenate(points)
    return np.unique(points[points > 0])


def by_parts(function, omega):
    """A function of s at many frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    return np.concatenate([function(1j * omega[i : i + AT_ONCE]) for i in range(0, len(omega), AT_ONCE)])


def eigenvalues(matrices):
    """Not a number where a matrix is not finite, shape (f, k)."""
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-1], np.nan, dtype=complex)
    found[finite] = np.linalg.eigvals(matrices[finite])
    return found
