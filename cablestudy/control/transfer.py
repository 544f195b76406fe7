"""The dynamic stiffness of a cable's ends: one cable at many frequencies, or many cables at places of their own."""

from functools import cached_property

import numpy as np

BLOCK = 12000  # numbers at once: what is computed on the way stays in the cache, and in memory that is at hand
MANY, PART, FAR = 24, 6, 4  # modes from which on all but a sixth are taken together below a quarter of their frequency,
TERMS = 13  # by so many terms of their real and of their imaginary part: 1e-13 of the first one is left


def dynamic_stiffness(model, s, rows=slice(None), columns=slice(None)):
    """Force at the ends per displacement of the ends.

    Parameters
    ----------
    model : EndModel
    s : ndarray, shape (m,)
        Laplace variable, i omega for the frequency response. [rad/s]
    rows, columns : slice or list of int
        Which forces and which displacements, of the six.

    Returns
    -------
    ndarray, complex, shape (m, r, c)
        [N/m]
    """
    return Transfer(model, rows, columns)(s)


class Transfer:
    """Some forces at the ends per some displacements there; what does not depend on s is prepared once.

    Parameters
    ----------
    model, rows, columns
        As for `dynamic_stiffness`.

    Notes
    -----
    Modal damping: sum of p p^T r/(W^2 (r + W^2)) with r = s^2 + 2 zeta W s. On the imaginary axis modes of at least FAR
    times the frequency are taken together, as the power series of their sum.
    """

    def __init__(self, model, rows=slice(None), columns=slice(None)):
        self._model, self._rows, self._columns = model, rows, columns
        self._static = model.stiffness[rows][:, columns]
        self._own = model.residual_inertia[rows][:, columns]
        if model.strain is not None:
            return
        order = np.argsort(model.omega, kind="stable")
        omega, self._ratio = model.omega[order], model.damping_ratio[order]
        left, right = model.participation[order][:, rows], model.participation[order][:, columns]
        self._omega, self._square, self._drag = omega, omega**2, 2 * self._ratio * omega
        self._products = (left[:, :, None] * right[:, None, :]).reshape(len(omega), self._static.size)
        self._products /= self._square[:, None]
        # of 1/|r + W^2|^2: the real part by its powers w^4 and w^2, and the imaginary part by w
        first, second = (self._drag**2 - self._square)[:, None], (self._drag * self._square)[:, None]
        weights = np.concatenate([self._products, first * self._products, second * self._products], axis=1)
        self._weights, self._series = np.ascontiguousarray(weights.T), {}

    def __call__(self, s):
        """Value at s, shape (m,) -> (m, r, c). [N/m]"""
        return self.rows(np.asarray(s)).T.reshape(len(s), *self._static.shape)

    def rows(self, s):
        """Value at s, shape (m,) -> (r c, m). [N/m]"""
        if self._model.strain is not None:
            modal = self._model.strained(s[:, None], self._rows, self._columns)
            result = modal.reshape(len(s), self._static.size).T
        elif s.real.any():
            result = Several([self])(np.zeros(len(s), dtype=int), s)
        else:
            result = self._on_axis(s.imag)
        square = s**2
        static, own = self._static.ravel(), self._own.ravel()
        for k in range(len(result)):
            result[k] += static[k] + own[k] * square
        return result

    def _on_axis(self, omega):
        """The modes' share at i omega, shape (r c, m), in real numbers: several times faster than in complex ones."""
        ascending = bool((omega[1:] >= omega[:-1]).all())
        order = slice(None) if ascending else np.argsort(omega, kind="stable")
        ordered, begin = omega[order], 0
        result = np.empty((self._static.size, len(omega)), dtype=complex)
        n = len(self._omega)
        few = n < MANY or n * len(omega) < BLOCK or (self._ratio > 1).any()
        for count in (n,) if few else (n // PART, n):
            last = count == n
            end = len(omega) if last else int(np.searchsorted(ordered, self._omega[count] / FAR))
            size = max(BLOCK // max(count, 1), 16)
            for i in range(begin, end, size):
                here = slice(i, min(i + size, end))
                share = self._one_by_one if last else self._with_far_ones
                result[:, here] = share(ordered[here], count)
            begin = max(begin, end)
        if ascending:
            return result
        back = np.empty_like(result)
        back[:, order] = result
        return back

    def _one_by_one(self, omega, count):
        """The share of the lowest modes."""
        k, square = self._static.size, omega**2
        size = self._square[:count, None] - square
        size *= size
        size += (self._drag[:count] ** 2)[:, None] * square
        np.divide(1.0, size, out=size)
        sums = self._weights[:, :count] @ size
        result = np.empty((k, len(omega)), dtype=complex)
        sums[:k] *= square
        sums[:k] += sums[k : 2 * k]
        np.multiply(sums[:k], square, out=result.real)
        np.multiply(sums[2 * k :], omega, out=result.imag)
        return result

    def _with_far_ones(self, omega, count):
        """The same, and the others by their series."""
        k, ratio = self._static.size, omega / self._omega[count]
        powers = np.empty((TERMS, len(omega)))
        powers[0], powers[1:] = ratio, ratio**2
        np.multiply.accumulate(powers, axis=0, out=powers)
        sums = self._far(count) @ powers
        result = np.empty((k, len(omega)), dtype=complex)
        np.multiply(sums[:k], ratio, out=result.real)
        result.imag = sums[k:]
        return result + self._one_by_one(omega, count) if count else result

    def _far(self, count):
        """Coefficients of the series of the modes from `count` on: of the real parts, and of the imaginary ones."""
        if count not in self._series:
            scale = (self._omega[count] / self._omega[0]) ** np.arange(1, 2 * TERMS + 1)
            sums = (self._terms[:, count:] @ self._products[count:]) * scale[:, None]
            self._series[count] = np.concatenate([sums[1::2].T, sums[::2].T])
        return self._series[count]

    @cached_property
    def _terms(self):
        """Of x (x + 2 zeta)/(1 + x (x + 2 zeta)), x = i w/W, for each mode, over powers of w/W of the lowest one."""
        # -sum of U_k(-zeta) x^k, with Chebyshev's polynomials
        ratio = self._ratio[:1] if (self._ratio == self._ratio[0]).all() else self._ratio
        chebyshev = [np.ones_like(ratio), -2 * ratio]
        for _ in range(2 * TERMS - 1):
            chebyshev.append(-2 * ratio * chebyshev[-1] - chebyshev[-2])
        signs = np.resize([-1.0, 1.0, 1.0, -1.0], 2 * TERMS)
        powers = np.multiply.accumulate(np.tile(self._omega[0] / self._omega, (2 * TERMS, 1)), axis=0)
        return signs[:, None] * np.stack(chebyshev[1:]) * powers


class Several:
    """Some transfers at once, each at places of its own, with no digit that depends on the others.

    Parameters
    ----------
    transfers : list of Transfer
    """

    def __init__(self, transfers):
        self._transfers, self._static = transfers, np.stack([t._static.ravel() for t in transfers])
        self._own = np.stack([t._own.ravel() for t in transfers])
        # those with equally many modes are one group
        (self._kind, self._place), groups = np.empty((2, len(transfers)), dtype=int), {}
        for index, transfer in enumerate(transfers):
            alike = len(transfer._omega) if transfer._model.strain is None else (index,)
            number, members = groups.setdefault(alike, (len(groups), []))
            self._kind[index], self._place[index] = number, len(members)
            members.append(transfer)
        self._groups = [members for _, members in groups.values()]
        self._stacks = [_stacked(members) for members in self._groups]

    def values(self, which, s):
        """Values of the transfers `which`, shape (m,), at s, shape (m,) -> (r c, m). [N/m]"""
        return self._static[which].T + self._own[which].T * s**2 + self(which, s)

    def __call__(self, which, s):
        """The modes' share of `values`, shape (r c, m)."""
        if len(self._groups) == 1:
            return self._of_group(0, self._place[which], s)
        result, kind = np.empty((self._static.shape[1], len(s)), dtype=complex), self._kind[which]
        for number in np.unique(kind):
            here = np.flatnonzero(kind == number)
            result[:, here] = self._of_group(number, self._place[which[here]], s[here])
        return result

    def _of_group(self, number, place, s):
        stack, transfer = self._stacks[number], self._groups[number][0]
        if stack is None:
            value = transfer._model.strained(s[:, None], transfer._rows, transfer._columns)
            return value.reshape(len(s), self._static.shape[1]).T
        size = max(BLOCK // max(len(transfer._omega), 1), 16)
        if len(s) <= size:
            return _in_plane(stack, place, s)
        starts = range(0, len(s), size)
        return np.concatenate([_in_plane(stack, place[i : i + size], s[i : i + size]) for i in starts], axis=1)


def _stacked(transfers):
    """What `_in_plane` takes: squares, drags and products of transfers with equally many modes; None otherwise."""
    if transfers[0]._model.strain is not None:
        return None
    squares, drags = (np.stack([getattr(t, name) for t in transfers], axis=1) for name in ("_square", "_drag"))
    products = np.stack([t._products.T for t in transfers], axis=2)
    return squares, drags, products


def _in_plane(stack, place, s):
    """Sum of products r/(r + W^2) anywhere, in real numbers, each place by itself."""
    if len(s) == 1:  # a single column would be summed in another order
        return _in_plane(stack, np.repeat(place, 2), np.repeat(s, 2))[:, :1]
    square, drag, products = stack
    if square.shape[1] > 1:  # rows stay rows in memory, for the order of the sums
        square, drag, products = square.take(place, axis=1), drag.take(place, axis=1), products.take(place, axis=2)
    rate = drag * s.real
    rate += s.real**2 - s.imag**2
    turn = drag + 2 * s.real
    turn *= s.imag
    whole = rate + square
    rate *= whole
    whole *= whole
    turned = turn**2
    rate += turned
    whole += turned
    np.divide(1.0, whole, out=whole)
    rate *= whole
    turn *= square
    turn *= whole
    result = np.empty((len(products), len(s)), dtype=complex)
    for k, chosen in enumerate(products):
        result[k].real = np.multiply(rate, chosen, out=turned).sum(axis=0)
        result[k].imag = np.multiply(turn, chosen, out=turned).sum(axis=0)
    return result
