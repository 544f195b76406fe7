"""The gondola on end 2 of its cable, free along x."""

from itertools import pairwise

import numpy as np

NEGLIGIBLE = 1e-10  # p/W^2, relative to the largest, below which a mode does not feel the gondola
COINCIDENT = 1e-11  # relative distance of squared frequencies that count as one
ROUNDING = 2e-14  # of a moment of inertia: times w^6 it would be more than a light gondola weighs
SETTLED = 1e-12, 1e-15  # change of a root over its distance from the pole, or over itself, that ends its search
STEPS = 200  # of each root; few take more than four


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
        p^2/W^(4 + 2 j): what the modes that are not given add. See `Ends.moments`.

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
    found, alike = [None] * len(problems), {}
    for index, problem in enumerate(problems):
        alike.setdefault(len(problem[2]), []).append(index)
    for indices in alike.values():
        parts = zip(*(problems[index] for index in indices), strict=True)
        solved = _Balances(*(np.array(part, dtype=float) for part in parts)).modes()
        for index, modes in zip(indices, solved, strict=True):
            found[index] = modes
    return found


class _Balances:
    """Problems with equally many modes: poles W^2, their strengths p^2, and what is left of the inertia.

    A root is counted from the pole beside it, so that its distance has all digits however little a mode is felt. It is
    found by Newton's method with that pole as it is and only the rest of the equation taken as straight: a quadratic.
    """

    def __init__(self, mass, stiffness, frequency, participation, inertia):
        every = (2 * np.pi * frequency) ** 2
        carried = np.abs(participation) / every  # p itself grows with the stiffness, and would hide all but axial modes
        felt = carried > NEGLIGIBLE * carried.max(axis=-1, initial=0.0, keepdims=True)
        carried = np.where(felt, carried, 0.0) ** 2
        left = [s - (carried / every**j).sum(axis=-1) for j, s in enumerate(inertia.T)]
        left = [np.where(part > ROUNDING * s, part, 0.0) for part, s in zip(left, inertia.T, strict=True)]
        self._mass, self._stiffness, self._left = mass, stiffness, (mass + left[0], left[1], left[2])
        # a pole at infinity, without strength, stands for none: after the last one and before the first
        self._pole, self._strength = (np.full((len(mass), every.shape[-1] + 1), fill) for fill in (np.inf, 0.0))
        if (felt.all(axis=-1) & _apart(every).all(axis=-1)).all():
            self._pole[:, :-1], self._strength[:, :-1] = every, participation**2
        else:
            for cable, chosen in enumerate(felt):
                pole, strength = _united(every[cable, chosen], participation[cable, chosen] ** 2)
                self._pole[cable, : len(pole)], self._strength[cable, : len(pole)] = pole, strength
        self._static = self._strength / self._pole
        self._count = np.isfinite(self._pole).sum(axis=-1)

    def modes(self):
        """Frequency and the gondola's share, for each problem."""
        cable, root, weight = self._roots()
        frequency, share = np.sqrt(root) / (2 * np.pi), self._mass[cable] / weight
        ends = np.searchsorted(cable, np.arange(len(self._mass) + 1))
        return [(frequency[a:b], share[a:b]) for a, b in pairwise(ends)]

    def _rest(self, cable, number, value):
        """The equation without its pole `number`, and its slope with the sign turned, which is positive."""
        result, slope = np.empty_like(value), np.empty_like(value)
        ends = np.searchsorted(cable, np.arange(len(self._mass) + 1))
        for one, (a, b) in enumerate(pairwise(ends)):
            if a == b:
                continue
            count, here = self._count[one] + 1, value[a:b]
            near = self._pole[one, :count, None] - here
            near[number[a:b], np.arange(b - a)] = np.inf
            np.divide(1.0, near, out=near)
            result[a:b] = self._static[one, :count] @ near
            near *= near
            slope[a:b] = self._strength[one, :count] @ near
        mass, first, second = (part[cable] for part in self._left)
        result = (
            self._stiffness[cable]
            + self._static[cable, number]
            - value * (result + mass + value * (first + value * second))
        )
        return result, slope + mass + value * (2 * first + 3 * value * second)

    def _roots(self):
        """Cable, place and slope with the sign turned of each root, ascending for each cable."""
        count = self._count
        edges = np.concatenate([np.zeros((len(count), 1)), self._pole], axis=-1)
        cable, right = np.nonzero(np.isfinite(edges[:, :-1]))
        first, last = right == 0, right == count[cable]
        # the two poles about each root, numbers and places; at either end there is one only
        number = np.stack([np.where(first, count[cable], right - 1), right])
        pole = edges[cable, np.stack([right, right + 1])]
        # above the last pole the root is below that of the gondola on all the springs of the cable together
        springs = (self._stiffness + self._static.sum(axis=-1)) / self._mass
        top = (springs + edges[np.arange(len(count)), count]) * (1 + 1e-9)
        gap = np.where(last, top[cable], pole[1]) - pole[0]
        half = np.where(last, gap, gap / 2)
        # from where this leads from a pole, to the nearer of the two
        rest, slope = self._rest(cable, number[0], pole[0])
        ahead = _beside(rest, slope, self._strength[cable, number[0]])
        behind = _beside(-np.roll(rest, -1), np.roll(slope, -1), self._strength[cable, right])
        behind[last] = np.inf
        side = (behind < ahead).astype(int)
        distance = np.minimum(np.minimum(ahead, behind), half) * (1 - 2 * side)
        low, high = -gap * side, gap * (1 - side)
        weight, active = np.empty(len(cable)), np.arange(len(cable))
        for _ in range(STEPS):
            which, sign, here = cable[active], 1 - 2 * side[active], distance[active]
            base, own = pole[side[active], active], number[side[active], active]
            strength = self._strength[which, own]
            rest, slope = self._rest(which, own, base + here)
            above = rest + strength / np.where(strength > 0, here, 1.0) > 0
            low[active], high[active] = np.where(above, here, low[active]), np.where(above, high[active], here)
            place = sign * _beside(sign * (rest + slope * here), slope, strength)
            change = np.abs(place - here)
            settled = change <= np.maximum(SETTLED[0] * np.abs(here), SETTLED[1] * (base + here))
            inside = settled | ((place > low[active]) & (place < high[active]))
            place = np.where(inside, place, (low[active] + high[active]) / 2)
            distance[active], weight[active] = place, slope + strength / np.where(strength > 0, place, 1.0) ** 2
            active = active[~settled]
            if not len(active):
                break
            across = active[np.abs(distance[active]) > half[active]]  # nearer to the other pole
            for part in (distance, low, high):
                part[across] += np.where(side[across], gap[across], -gap[across])
            side[across] = 1 - side[across]
        return cable, pole[side, np.arange(len(cable))] + distance, weight


def _beside(rest, slope, strength):
    """Positive root of rest - slope x + strength/x = 0."""
    root = np.sqrt(rest**2 + 4 * slope * strength)
    rising = rest >= 0
    return np.where(rising, rest + root, 2 * strength) / np.where(rising, 2 * slope, root - rest)


def _apart(square):
    return square[..., 1:] > square[..., :-1] * (1 + COINCIDENT)


def _united(square, strength):
    """Poles that coincide as one, ascending: between them there is no root that could be told from them."""
    if not len(square):
        return square, strength
    order = np.argsort(square, kind="stable")
    square, strength = square[order], strength[order]
    first = np.flatnonzero(np.concatenate([[True], _apart(square)]))
    return square[first], np.add.reduceat(strength, first)
