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
# Between two frequencies more are taken where an eigenvalue turns so far, or where one near the negative real axis
# changes so much (its angle over that to the axis, the logarithm of its size) that it may cross and come back.
FAR_TURN, NEAR_AXIS, SHARE, GROWTH = 0.5, 0.8, 0.25, 0.3
COARSE, HALVINGS = 1e-3, 7  # relative distance of two frequencies that are close enough, and how often it is halved


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


def paired(values):
    """Eigenvalues at neighbouring frequencies that belong together, before and after, shape (f - 1, 2 k) both.

    Each with the nearest one at the next frequency, and each of these with the nearest one before; `values` (f, k).
    """
    apart = np.abs(values[:-1, :, None] - values[1:, None, :])
    before = np.concatenate([values[:-1], np.take_along_axis(values[:-1], apart.argmin(axis=1), axis=1)], axis=1)
    after = np.concatenate([np.take_along_axis(values[1:], apart.argmin(axis=2), axis=1), values[1:]], axis=1)
    return before, after


def resolved(function, omega):
    """Frequencies that show where eigenvalues of a loop gain cross the negative real axis, and the loop gain there.

    Parameters
    ----------
    function : callable
        s, shape (f,) [rad/s] -> the loop gain, shape (f, k, k).
    omega : ndarray, shape (f,)
        Ascending frequencies to begin with. [rad/s]

    Returns
    -------
    omega : ndarray, shape (g,)
        Ascending; those at which the loop gain is infinite are left out. [rad/s]
    matrices : ndarray, shape (g, k, k)
    """
    matrices = by_parts(function, omega)
    for _ in range(HALVINGS):
        finite = np.isfinite(matrices).all(axis=(-2, -1))
        omega, matrices = omega[finite], matrices[finite]
        before, after = paired(eigenvalues(matrices))
        turn = np.abs(np.angle(after * before.conj()))
        to_axis = np.minimum(np.abs(np.angle(-before)), np.abs(np.angle(-after)))
        with np.errstate(divide="ignore", invalid="ignore"):  # an eigenvalue of zero
            growth = np.abs(np.log(np.abs(after / before)))
        unsure = (turn > FAR_TURN) | ((to_axis < NEAR_AXIS) & ((turn > SHARE * to_axis) | ~(growth < GROWTH)))
        wide = unsure.any(axis=1) & (np.diff(omega) > COARSE * omega[1:])
        if not wide.any():
            break
        between = (omega[1:] + omega[:-1])[wide] / 2
        order = np.argsort(np.concatenate([omega, between]))
        omega = np.concatenate([omega, between])[order]
        matrices = np.concatenate([matrices, by_parts(function, between)])[order]
    return omega, matrices


def by_parts(function, omega):
    """A function of s at many frequencies [rad/s], few at a time, whose matrices stay in the processor's cache."""
    return np.concatenate([function(1j * omega[i : i + AT_ONCE]) for i in range(0, len(omega), AT_ONCE)])


def eigenvalues(matrices):
    """Not a number where a matrix is not finite, shape (f, k)."""
    finite = np.isfinite(matrices).all(axis=(-2, -1))
    found = np.full(matrices.shape[:-1], np.nan, dtype=complex)
    found[finite] = np.linalg.eigvals(matrices[finite])
    return found
