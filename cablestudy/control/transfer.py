"""The dynamic stiffness of a cable's ends: one cable at many frequencies, or many cables at places of their own."""

import numpy as np

BLOCK = 30000  # numbers at once: what is computed on the way stays in the cache, and in memory that is at hand


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
    Modal damping: sum of p p^T r/(W^2 (r + W^2)) with r = s^2 + 2 zeta W s.
    """

    def __init__(self, model, rows=slice(None), columns=slice(None)):
        self._model, self._rows, self._columns = model, rows, columns
        self._static = model.stiffness[rows][:, columns]
        self._own = model.residual_inertia[rows][:, columns]
        if model.strain is not None:
            return
        omega, k = model.omega, self._static.size
        self._square, self._drag = omega**2, 2 * model.damping_ratio * omega
        left, right = model.participation.T[rows], model.participation.T[columns] / self._square
        self._products = (left[:, None] * right).reshape(k, len(omega))
        # of 1/|r + W^2|^2: the real part by its powers w^4 and w^2, and the imaginary part by w
        factors = np.array([np.ones(len(omega)), self._drag**2 - self._square, self._drag * self._square])
        self._weights = (factors[:, None] * self._products).reshape(3 * k, len(omega))
        # of W^2 - w^2 and of what damping adds to its square, by 1 and w^2
        self._forms = np.zeros((2, len(omega), 2))
        self._forms[0, :, 0], self._forms[0, :, 1], self._forms[1, :, 1] = self._square, -1.0, self._drag**2

    def __call__(self, s):
        """Value at s, shape (m,) -> (m, r, c). [N/m]"""
        return self.rows(np.asarray(s)).T.reshape(len(s), *self._static.shape)

    def rows(self, s):
        """Value at s, shape (m,) -> (r c, m). [N/m]"""
        if self._model.strain is None and not s.real.any():
            return self._on_axis(s.imag)
        return Several([self]).values(np.zeros(len(s), dtype=int), s)

    def _on_axis(self, omega):
        """Value at i omega, in real numbers: several times faster than in complex ones."""
        result = np.empty((self._static.size, len(omega)), dtype=complex)
        size = max(BLOCK // max(len(self._square), 1), 16)
        for i in range(0, len(omega), size):
            self._in_block(omega[i : i + size], result[:, i : i + size])
        return result

    def _in_block(self, omega, result):
        k, powers = self._static.size, np.ones((2, len(omega)))
        square = np.multiply(omega, omega, out=powers[1])
        size, damped = self._forms @ powers  # a product of matrices takes a third of the time of outer ones
        size *= size
        size += damped
        np.divide(1.0, size, out=size)
        sums = self._weights @ size
        sums[:k] *= square
        sums[:k] += sums[k : 2 * k]
        sums[:k] -= self._own.reshape(k, 1)
        sums[:k] *= square
        np.add(sums[:k], self._static.reshape(k, 1), out=result.real)
        np.multiply(sums[2 * k :], omega, out=result.imag)


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
            alike = len(transfer._square) if transfer._model.strain is None else (index,)
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
        size = max(BLOCK // max(len(transfer._square), 1), 16)
        if len(s) <= size:
            return _in_plane(stack, place, s)
        starts = range(0, len(s), size)
        return np.concatenate([_in_plane(stack, place[i : i + size], s[i : i + size]) for i in starts], axis=1)


def _stacked(transfers):
    """What `_in_plane` takes: squares, drags and products of transfers with equally many modes; None otherwise."""
    if transfers[0]._model.strain is not None:
        return None
    squares, drags = (np.stack([getattr(t, name) for t in transfers], axis=1) for name in ("_square", "_drag"))
    products = np.stack([t._products for t in transfers], axis=2)
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
