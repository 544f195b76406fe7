"""A cable as its ends feel it: static stiffness, inertia and the modes between, in global axes, with its damping.

Everything dynamic (frequency response, state space, gondola, winch loop) is made from this. With u the ends, q the
modes about the static shapes that the ends impose, m = -p/W^2 and c(s) the damping of the elastic strain,

    (s^2 + W^2 + c E) q = -(c R + s^2 m) u,        f = (K + c S + s^2 M) u + (c R + s^2 m)^T q

c = i loss factor (hysteretic), c = s time (Kelvin-Voigt); E, R, S are the elastic parts of the modes' stiffness, of
modes against static shapes, and of the static shapes. The paper's modal damping instead damps the modes with fixed
ends, each by its ratio.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError

GROUND, GONDOLA = 0, 3  # x of end 1 and of end 2 among the six end displacements
BLOCK = 12000  # numbers at once: what is computed on the way stays in the cache, and in memory that is at hand
MANY, FAR = 24, 4  # modes from which those of so many times a frequency are taken together,
TERMS = 13  # by so many terms of their real and of their imaginary part: 1e-13 of the first one is left
NAMES = tuple(f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz")
TRUSTED = 1e-10  # difference between the sum over poles and solved systems up to which the sum is an answer


@dataclass(frozen=True)
class Strain:
    """Damping of the elastic strain.

    Attributes
    ----------
    law : {"hysteretic", "kelvin_voigt"}
    amount : float
        Loss factor [-], or time [s].
    modes : ndarray, shape (n, n)
        E. [1/s^2]
    coupling : ndarray, shape (n, 6)
        R. [N/(m sqrt(kg))]
    ends : ndarray, shape (6, 6)
        S. [N/m]
    """

    law: str
    amount: float
    modes: np.ndarray
    coupling: np.ndarray
    ends: np.ndarray

    def factor(self, s):
        """c(s)."""
        return s * self.amount if self.law == "kelvin_voigt" else 1j * self.amount * np.sign(np.imag(s))


@dataclass(frozen=True)
class EndModel:
    """The cable between its two ends. Ends are ordered end 1 x, y, z, end 2 x, y, z.

    Attributes
    ----------
    omega : ndarray, shape (n,)
        Of the modes with fixed ends. [rad/s]
    participation : ndarray, shape (n, 6)
        p = psi^T K21: modal force per end displacement. [N/(m sqrt(kg))]
    damping_ratio : ndarray, shape (n,)
        Modal; where the strain is damped, the equivalent one. [-]
    stiffness : ndarray, shape (6, 6)
        Static, interior condensed. [N/m]
    inertia : ndarray, shape (6, 6)
        Mass of the static shapes. [kg]
    strain : Strain or None
        None for modal damping.
    """

    omega: np.ndarray
    participation: np.ndarray
    damping_ratio: np.ndarray
    stiffness: np.ndarray
    inertia: np.ndarray
    strain: Strain | None = None

    @property
    def feedthrough(self):
        """D: static stiffness plus what the modes take off it, shape (6, 6). [N/m]"""
        scaled = self.participation / self.omega[:, None]
        return self.stiffness + scaled.T @ scaled

    @cached_property
    def residual_inertia(self):
        """What the modes leave of `inertia`: the ends' own mass and the omitted modes', shape (6, 6). [kg]"""
        scaled = self.participation / self.omega[:, None] ** 2
        return self.inertia - scaled.T @ scaled

    def select(self, chosen):
        """The same cable with only some modes; its static stiffness stays exact.

        Parameters
        ----------
        chosen : array of int or bool

        Returns
        -------
        EndModel
        """
        strain = self.strain
        if strain is not None:
            strain = replace(strain, modes=strain.modes[chosen][:, chosen], coupling=strain.coupling[chosen])
        return replace(
            self,
            omega=self.omega[chosen],
            participation=self.participation[chosen],
            damping_ratio=self.damping_ratio[chosen],
            strain=strain,
        )

    @cached_property
    def poles(self):
        """(values, left, right) of the strain-damped modes, so that no system is solved per frequency.

        q = sum of left (right a)/(s^2 + value), or over (s - value) for Kelvin-Voigt, for a right-hand side a.

        Raises
        ------
        NoSolutionError
            So much damping that rounding spoils the sum.
        """
        poles = self._poles
        self._check(poles)
        return poles

    @cached_property
    def _poles(self):
        # of the inverse: the lowest modes are then the most accurate, however fast others die out
        n, unit = len(self.omega), np.outer(self.omega, self.omega)
        elastic = self.strain.amount * self.strain.modes / unit
        if self.strain.law == "hysteretic":
            value, vector = np.linalg.eig(np.linalg.inv(np.eye(n) + 1j * elastic) / unit)
            return 1 / value, vector, np.linalg.inv(vector)
        # for W q and q': symmetric but for a sign, entries no larger than they must be
        slowness = np.diag(1 / self.omega)
        value, vector = np.linalg.eig(np.block([[-elastic, -slowness], [slowness, np.zeros((n, n))]]))
        return 1 / value, vector[:n] / self.omega[:, None], np.linalg.inv(vector)[:, n:]

    def _check(self, poles):
        """Refuse poles whose sum is not the solution of the systems that it stands for, at some s."""
        if not len(self.omega):
            return
        # up to where the model means something, off the axis: a resonance has no more digits than its frequency
        s = (0.03 + 1j) * np.geomspace(self.omega.min() / 10, np.median(self.omega), 8)[:, None]
        summed, solved = _summed(self, poles, s, slice(None), slice(None)), _solved(self, s)
        at_rest = self.stiffness + self.inertia * s[..., None] ** 2
        size = np.sqrt(np.abs(np.diagonal(at_rest + solved, axis1=1, axis2=2)))
        if not (np.abs(summed - solved) <= TRUSTED * size[:, :, None] * size[:, None, :]).all():
            raise NoSolutionError(
                f"the strain is damped so much ({self.strain.law}, {self.strain.amount:g}) that rounding spoils the "
                f"response: cable.damping must be less"
            )


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
        own = model.residual_inertia if model.strain is None else model.inertia
        self._static, self._own = model.stiffness[rows][:, columns], own[rows][:, columns]
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
            modal = _summed(self._model, self._model.poles, s[:, None], self._rows, self._columns)
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
        for count in self._splits:
            last = count == len(self._omega)
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

    @cached_property
    def _splits(self):
        """How many of the lowest modes are summed one by one, from the lowest frequencies to the highest."""
        n = len(self._omega)
        few = n < MANY or (self._ratio > 1).any()
        return (n,) if few else (0, n // 8, n // 3, n)

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
        self._own, self._groups = np.stack([t._own.ravel() for t in transfers]), {}
        self._kind, self._place = np.zeros(len(transfers), dtype=int), np.zeros(len(transfers), dtype=int)
        for index, transfer in enumerate(transfers):
            modal = transfer._model.strain is None
            _, members = self._groups.setdefault(
                ("modal", len(transfer._omega)) if modal else ("strain", index), (len(self._groups), [])
            )
            self._kind[index], self._place[index] = _, len(members)
            members.append(transfer)
        self._groups = [members for _, members in self._groups.values()]
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
            model = transfer._model
            value = _summed(model, model.poles, s[:, None], transfer._rows, transfer._columns)
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


def _summed(model, poles, s, rows, columns):
    """Damped strain: c S - (c R + s^2 m)^T (s^2 + W^2 + c E)^-1 (c R + s^2 m), by the poles."""
    value, left, right = poles
    hysteretic, below = model.strain.law == "hysteretic", np.imag(s) < 0
    s = np.where(below, np.conj(s), s) if hysteretic else s  # the poles are those of the upper half-plane
    carried = -model.participation / model.omega[:, None] ** 2
    factor, square = model.strain.factor(s), s**2
    weight = 1 / (square + value if hysteretic else s - value)
    # (c a + s^2 b)(c d + s^2 e), term by term
    a, b = ((source[:, rows].T @ left).T[:, :, None] for source in (model.strain.coupling, carried))
    d, e = ((right @ source[:, columns])[:, None, :] for source in (model.strain.coupling, carried))
    shape = (len(s), a.shape[1], d.shape[2])
    powers = ((factor**2, a * d), (factor * square, a * e + b * d), (square**2, b * e))
    modal = sum(
        (power * (weight @ part.reshape(len(part), shape[1] * shape[2]))).reshape(shape) for power, part in powers
    )
    total = factor[..., None] * model.strain.ends[rows][:, columns] - modal
    return np.where(below[..., None], total.conj(), total) if hysteretic else total


def _solved(model, s):
    """The same for all ends, by a system for each s."""
    strain, factor, square = model.strain, model.strain.factor(s)[..., None], s[..., None] ** 2
    force = factor * strain.coupling - square * (model.participation / model.omega[:, None] ** 2)
    inside = factor * strain.modes + (square + model.omega**2) * np.eye(len(model.omega))
    return factor * strain.ends - force.swapaxes(1, 2) @ np.linalg.solve(inside, force)


def of_cable(dynamics, modes, frame, damping):
    """The end model of a cable.

    Parameters
    ----------
    dynamics : Dynamics
    modes : Modes
        The modes to keep.
    frame : ndarray, shape (3, 3)
        Rows: the chord frame in global coordinates. [-]
    damping : Damping
        model, and ratio [-], loss_factor [-] or time [s].

    Returns
    -------
    EndModel
    """
    omega = 2 * np.pi * modes.frequency
    n, mass, unit = len(modes), dynamics.mass * dynamics.length, dynamics.state.force / dynamics.length
    static, inertia, elastic = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((n + 6, n + 6))
    carried = np.zeros((n, 3))
    for system in dynamics.systems:
        axes = list(system.axes)
        places = axes + [axis + 3 for axis in axes]
        block = system.end_stiffness * unit
        static[np.ix_(places, places)] = np.block([[block, -block], [-block, block]])
        # a movement of end 1 is one of the whole cable less one of end 2
        second = system.end_shapes
        both = np.concatenate([np.eye(len(axes)) - second, second], axis=2)
        flat = both.reshape(-1, 2 * len(axes))
        inertia[np.ix_(places, places)] = mass * flat.T @ (system.full_mass() @ flat)
        shapes = modes.shapes[:, axes]
        ones = system.mass @ np.tile(np.eye(len(axes)), (system.dof // len(axes), 1))
        carried[:, axes] = mass * shapes[1:-1].reshape(len(ones), n).T @ ones
        if damping.model != "modal":
            index = [*range(n), *(n + place for place in places)]
            elastic[np.ix_(index, index)] += unit * system.strain_energy(np.concatenate([shapes, both], axis=2))[0]
    participation = np.concatenate([-modes.participation - omega[:, None] ** 2 * carried, modes.participation], axis=1)
    turn = np.kron(np.eye(2), frame)
    strain, ratio = None, np.full(n, damping.ratio if damping.model == "modal" else 0.0)
    if damping.model != "modal":
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        share = np.diagonal(elastic)[:n] / omega**2
        ratio = share * amount / 2 * (1 if damping.model == "hysteretic" else omega)
        strain = Strain(damping.model, amount, elastic[:n, :n], elastic[:n, n:] @ turn, turn.T @ elastic[n:, n:] @ turn)
    return EndModel(omega, participation @ turn, ratio, turn.T @ static @ turn, turn.T @ inertia @ turn, strain)
