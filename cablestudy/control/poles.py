"""Poles of modes that damped strain couples: q = sum of left (right a)/(s^2 + value) for a right-hand side a, or, for
Kelvin-Voigt, over (s - value).

The modes of a cable reach from its lowest to the stiffest along it, many powers of ten above: an eigen-solution has
rounding of the size of its largest eigenvalue. So the inverse gives the slow poles well, and the matrix the fast ones.
"""

import numpy as np


def slow_poles(omega, strain):
    """All poles, the slow ones most accurate.

    Parameters
    ----------
    omega : ndarray, shape (n,)
        Of the undamped modes. [rad/s]
    strain : Strain

    Returns
    -------
    value : ndarray, shape (n,) or (2 n,)
        [1/s^2], or [1/s] for Kelvin-Voigt.
    left, right : ndarray, shape (n, k), (k, n)
    """
    n, unit = len(omega), np.outer(omega, omega)
    elastic = strain.amount * strain.modes / unit
    if strain.law == "hysteretic":
        value, vector = np.linalg.eig(np.linalg.inv(np.eye(n) + 1j * elastic) / unit)
        return 1 / value, vector, np.linalg.inv(vector)
    # for W q and q': symmetric but for a sign, entries no larger than they must be
    slowness = np.diag(1 / omega)
    value, vector = np.linalg.eig(np.block([[-elastic, -slowness], [slowness, np.zeros((n, n))]]))
    return 1 / value, vector[:n] / omega[:, None], np.linalg.inv(vector)[:, n:]


def all_poles(omega, strain, slow):
    """The slow poles with fast ones that are as accurate.

    The vectors on the right are those on the left transposed, in the product in which they are orthogonal.

    Parameters
    ----------
    omega, strain
        As for `slow_poles`.
    slow : tuple
        What it returned.

    Returns
    -------
    value, left, right
        As there.

    Raises
    ------
    LinAlgError
        Two poles that have become one.
    """
    slow, near, _ = slow
    omega, elastic = omega[:, None], strain.amount * strain.modes
    if strain.law == "kelvin_voigt":
        none, turn = np.zeros(elastic.shape), np.diag(omega[:, 0])
        fast, far = np.linalg.eig(np.block([[-elastic, -turn], [turn, none]]))
        first, last = _halves(slow, fast)
        value = np.concatenate([slow[first], fast[last]])
        vector = np.concatenate([near[:, first], far[: len(omega), last] / fast[last]], axis=1)
        rate, force = value * vector, omega * vector
        return value, vector, np.linalg.solve(rate.T @ rate - force.T @ force, rate.T)
    fast, far = np.linalg.eig(np.diag(omega[:, 0] ** 2) + 1j * elastic)
    first, last = _halves(slow, fast)
    slow, near, fast, far = slow[first], near[:, first], fast[last], far[:, last]
    # what a slow one has of fast modes is small: once more through the inverse, and it is more than rounding
    share = elastic / (omega * omega.T)
    through = slow * np.linalg.solve(np.eye(len(omega)) + 1j * share, near / omega) / omega
    near = np.where(omega > np.sqrt(np.abs(slow)), through, near)
    # and what a fast one has of slow modes, through the matrix
    through = (omega**2 * far + 1j * elastic @ far) / fast
    far = np.where(omega < np.sqrt(np.abs(fast)), through, far)
    vector = np.concatenate([near, far], axis=1)
    vector /= np.sqrt((vector**2).sum(axis=0))
    force = omega * vector
    value = (force * (force + 1j * share @ force)).sum(axis=0)
    return value, vector, np.linalg.solve(vector.T @ vector, vector.T)


def _halves(slow, fast):
    """Places of the slower half, by decades, of some poles, and of the faster half of the same, found another way."""
    slow_order, fast_order = np.argsort(np.abs(slow)), np.argsort(np.abs(fast))
    size = np.sqrt(np.abs(slow[slow_order]) * np.abs(fast[fast_order]))
    middle = int(np.searchsorted(size, np.sqrt(size[0] * size[-1])))
    # where the gap is widest: no pair of poles is parted
    places = np.arange(max(1, middle - 6), min(len(size) - 1, middle + 6) + 1)
    first = places[np.argmax(size[places] / size[places - 1])] if len(places) else len(size)
    return slow_order[:first], fast_order[first:]
