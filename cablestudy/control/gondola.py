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


def coupled_modes_of(problems):
    """Modes of gondolas and their cables together, each as if it were alone.

    Parameters
    ----------
    problems : sequence of tuple
        Each (mass, stiffness, frequency, participation, inertia):
        of the gondola [kg]; static end stiffness along x [N/m]; of the cable with fixed ends, shape (n,) [Hz];
        psi^T K21 e_x of those modes, shape (n,) [N/(m sqrt(kg))];
        s_0 [kg], s_1 [kg s^2], s_2 [kg s^4] of the whole cable moving with its end, of which every mode k is the share
        p^2/W^(4 + 2 j): what the modes that are not given add. See `Case.end_inertia`.

    Returns
    -------
    list of (frequency, share)
        Frequencies ascending, shape (m,), m <= n + 1: modes that do not feel the gondola are left out [Hz]; the
        gondola's share of their modal masses, shape (m,) [-].

    Notes
    -----
    Roots of k - w^2 (M + r_0 + sum of p^2 / (W^2 (W^2 - w^2))) - w^4 r_1 - w^6 r_2 = 0, where r_j is what the sum over
    the given modes leaves of s_j: the end's own mass, and the omitted modes up to a share (w/W)^6 of their mass.
    Between two neighbours W there is exactly one root, so each is bracketed and none is lost or repeated; a matrix
    would lose a very heavy gondola's frequency in rounding.
    """
    if not problems:
        return []
    balances = [_Balance(*problem) for problem in problems]
    which, root = _between_poles(_Balances(balances), [balance.edges for balance in balances])
    ends = np.searchsorted(which, np.arange(len(balances) + 1))
    return [balance.modes(root[a:b]) for balance, a, b in zip(balances, ends[:-1], ends[1:], strict=True)]


class _Balance:
    """One problem: the poles W^2 that are felt, their strengths p^2 and what is left of the inertia."""

    def __init__(self, mass, stiffness, frequency, participation, inertia):
        every = (2 * np.pi * frequency) ** 2
        carried = np.abs(participation) / every  # p itself grows with the stiffness, and would hide all but axial modes
        felt = carried > NEGLIGIBLE * carried.max(initial=0.0)
        self.rest = [max(s - (carried[felt] ** 2 / every[felt] ** j).sum(), 0.0) for j, s in enumerate(inertia)]
        self.square, self.strength = _united(every[felt], participation[felt] ** 2)
        # above the last W the root is below that of the gondola on all the springs of the cable together
        springs = stiffness + (self.strength / self.square).sum()
        self.edges = np.concatenate(
            [[0.0], self.square, [(springs / mass + self.square.max(initial=0.0)) * (1 + 1e-9)]]
        )
        self.mass, self.stiffness, self._weaker = mass, stiffness, self.strength / self.square

    def __call__(self, value):
        """The equation and its slope, which is negative everywhere."""
        near = self.square[:, None] - value
        np.divide(1.0, near, out=near)
        carried = self._weaker @ near + (self.mass + self.rest[0] + value * (self.rest[1] + value * self.rest[2]))
        near *= near
        slope = self.strength @ near + (
            self.mass + self.rest[0] + value * (2 * self.rest[1] + 3 * value * self.rest[2])
        )
        return self.stiffness - value * carried, -slope

    def modes(self, root):
        """Frequency and the gondola's share at the roots."""
        weight = self.mass + ((1 / (self.square - root[:, None])) ** 2) @ self.strength
        weight += self.rest[0] + root * (2 * self.rest[1] + 3 * root * self.rest[2])
        return np.sqrt(root) / (2 * np.pi), self.mass / weight


class _Balances:
    """Several problems, each evaluated by itself: sums over many at once would depend on how many there are."""

    def __init__(self, balances):
        self._balances = balances

    def __call__(self, which, value):
        """Values and slopes of the problems `which`, ascending."""
        if len(self._balances) == 1:
            return self._balances[0](value)
        ends = np.searchsorted(which, np.arange(len(self._balances) + 1))
        result, slope = np.empty_like(value), np.empty_like(value)
        for balance, a, b in zip(self._balances, ends[:-1], ends[1:], strict=True):
            if a < b:
                result[a:b], slope[a:b] = balance(value[a:b])
        return result, slope


def _united(square, strength):
    """Poles that coincide as one, ascending: between them there is no root that could be told from them."""
    if not len(square):
        return square, strength
    order = np.argsort(square, kind="stable")
    square, strength = square[order], strength[order]
    first = np.flatnonzero(np.concatenate([[True], np.diff(square) > COINCIDENT * square[1:]]))
    return square[first], np.add.reduceat(strength, first)


def _between_poles(function, edges):
    """Zeros of functions that fall from one pole to the next; at the first and the last edge there is no pole.

    Newton on the function without the pole of the half in which it has its zero, which is nearly straight there,
    halving where it leaves its bracket.

    Parameters
    ----------
    function : callable
        (numbers of the functions, shape (m,), places, shape (m,)) -> values and slopes.
    edges : list of ndarray
        Of each function, ascending.

    Returns
    -------
    which : ndarray of int, shape (m,)
        Ascending: numbers of the functions.
    place : ndarray, shape (m,)
        Ascending for each of them.
    """
    left, right = (np.concatenate([part[cut] for part in edges]) for cut in (slice(0, -1), slice(1, None)))
    which = np.repeat(np.arange(len(edges)), [len(part) - 1 for part in edges])
    aside = np.maximum(1e-13 * (right - left), 4e-16 * right)  # a pole cannot be evaluated
    ends = np.cumsum([len(part) - 1 for part in edges])
    begin, end = np.concatenate([[0], ends[:-1]]), ends - 1
    low, high = left + aside, right - aside
    low[begin] = 0.0
    lowest, highest, found = low, high, (low + high) / 2
    value, slope = function(which, found)
    pole = np.where(value < 0, left, right)
    smooth = np.zeros(len(pole), dtype=bool)  # beside no pole
    smooth[begin], smooth[end] = value[begin] < 0, value[end] >= 0
    active, numbers, place, there = np.arange(len(which)), which, found.copy(), np.ones(len(which), dtype=bool)
    for _ in range(200):
        low = np.where(value > 0, np.nextafter(place, np.inf), low)
        high = np.where(value > 0, high, np.nextafter(place, -np.inf))
        gap = np.where(smooth, 1.0, place - pole)
        slope = slope + np.where(smooth, 0.0, value / np.where(gap, gap, np.spacing(pole)))
        step = place - value / np.where(slope < 0, slope, -1e-300)
        settled = np.abs(step - place) <= 1e-15 * place  # if only by rounding out of the bracket
        inside = settled | ((step > low) & (step < high))
        place = np.where(inside, np.clip(step, lowest, highest), (low + high) / 2)
        # out at an edge where nobody has been yet: nearer to a pole than can be told from it there may be none
        place = np.where(~inside & (step <= low) & (low == lowest), lowest, place)
        place = np.where(~inside & (step >= high) & (high == highest), highest, place)
        none = (low > highest) | (high < lowest)
        found[active], there[active] = place, ~none
        going = ~(settled | none)
        active, which, place, low, high, lowest, highest, pole, smooth = (
            part[going] for part in (active, which, place, low, high, lowest, highest, pole, smooth)
        )
        if not len(active):
            break
        value, slope = function(which, place)
    return numbers[there], found[there]
