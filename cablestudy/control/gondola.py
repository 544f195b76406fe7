"""The gondola on end 2 of its cable, free along x."""

import numpy as np

NEGLIGIBLE = 1e-10  # p/W^2, relative to the largest, below which a mode does not feel the gondola

COINCIDENT = 1e-11  # relative distance of squared frequencies that count as one


def static_frequency(mass, stiffness):
    """Frequency of a mass on the static end stiffness.

    Parameters
    ----------
    mass : float or ndarray
        [kg]
    stiffness : float or ndarray
        Static end stiffness along x, >= 0. [N/m]

    Returns
    -------
    float or ndarray
        sqrt(k/M)/(2 pi): what the paper's tables call the gondola frequency. [Hz]
    """
    return np.sqrt(stiffness / mass) / (2 * np.pi)


def coupled_modes(mass, stiffness, frequency, participation, inertia):
    """Modes of the gondola and its cable together.

    Parameters
    ----------
    mass : float
        Of the gondola. [kg]
    stiffness : float
        Static end stiffness along x. [N/m]
    frequency : ndarray, shape (n,)
        Of the cable with fixed ends. [Hz]
    participation : ndarray, shape (n,)
        psi^T K21 e_x of those modes. [N/(m sqrt(kg))]
    inertia : sequence of 3 float
        s_0 [kg], s_1 [kg s^2], s_2 [kg s^4] of the whole cable moving with its end, of which every mode k is the share
        p^2/W^(4 + 2 j): what the modes that are not given add. See `Case.end_inertia`.

    Returns
    -------
    frequency : ndarray, shape (m,)
        Ascending, m <= n + 1: modes that do not feel the gondola are left out. [Hz]
    share : ndarray, shape (m,)
        Share of the modal mass that is the gondola's. [-]

    Notes
    -----
    Roots of k - w^2 (M + r_0 + sum of p^2 / (W^2 (W^2 - w^2))) - w^4 r_1 - w^6 r_2 = 0, where r_j is what the sum over
    the given modes leaves of s_j: the end's own mass, and the omitted modes up to a share (w/W)^6 of their mass.
    Between two neighbours W there is exactly one root, so each is bracketed and none is lost or repeated; a matrix
    would lose a very heavy gondola's frequency in rounding.
    """
    every = (2 * np.pi * frequency) ** 2
    carried = np.abs(participation) / every  # p itself grows with the stiffness, and would hide all but axial modes
    felt = carried > NEGLIGIBLE * carried.max(initial=0.0)
    rest = [max(s - (carried[felt] ** 2 / every[felt] ** j).sum(), 0.0) for j, s in enumerate(inertia)]
    square, strength = _united(every[felt], participation[felt] ** 2)
    weaker = strength / square

    def balance(value):
        """The equation and its slope, which is negative everywhere."""
        near = 1 / (square - value[:, None])
        carried = mass + near @ weaker + rest[0] + value * (rest[1] + value * rest[2])
        near *= near
        slope = mass + near @ strength + rest[0] + value * (2 * rest[1] + 3 * value * rest[2])
        return stiffness - value * carried, -slope

    # above the last W the root is below that of the gondola on all the springs of the cable together
    highest = (stiffness + (strength / square).sum()) / mass + square.max(initial=0.0)
    edges = np.concatenate([[0.0], square, [highest * (1 + 1e-9)]])
    root = _between_poles(balance, edges)
    weight = mass + (strength / (square - root[:, None]) ** 2).sum(axis=-1)
    weight += rest[0] + root * (2 * rest[1] + 3 * root * rest[2])
    return np.sqrt(root) / (2 * np.pi), mass / weight


def _united(square, strength):
    """Poles that coincide as one, ascending: between them there is no root that could be told from them."""
    if not len(square):
        return square, strength
    order = np.argsort(square, kind="stable")
    square, strength = square[order], strength[order]
    first = np.flatnonzero(np.concatenate([[True], np.diff(square) > COINCIDENT * square[1:]]))
    return square[first], np.add.reduceat(strength, first)


def _between_poles(function, edges):
    """Zeros of a function that falls from one pole to the next; at the first and the last edge there is no pole.

    Newton on the function without the pole of the half in which it has its zero, which is nearly straight there,
    halving where it leaves its bracket.
    """
    left, right = edges[:-1], edges[1:]
    aside = np.maximum(1e-13 * (right - left), 4e-16 * right)  # a pole cannot be evaluated
    low, high = left + aside, right - aside
    low[0] = 0.0
    between = (function(low)[0] > 0) & (function(high)[0] < 0)
    low, high, left, right = low[between], high[between], left[between], right[between]
    first, last = low, high
    place = (low + high) / 2
    begins = function(place)[0] < 0
    pole = np.where(begins, left, right)
    smooth = (pole == edges[0]) | (pole == edges[-1])
    for _ in range(200):
        value, slope = function(place)
        low, high = np.where(value > 0, place, low), np.where(value > 0, high, place)
        slope = slope + np.where(smooth, 0.0, value / (place - pole))
        step = place - value / np.where(slope < 0, slope, -1e-300)
        settled = np.abs(step - place) <= 1e-15 * place  # if only by rounding out of the bracket
        place = np.where(settled | (step > low) & (step < high), np.clip(step, first, last), (low + high) / 2)
        if settled.all():
            break
    return place
