"""Poles of a motion with its loop closed from those with its winches at rest: one equation for the pole of each mode.

With the winches at rest a motion has the poles d_i and its eigenvectors. A motion exp(s t) in which the loop moves the
winches by p, all symbols as in `first_order`, has the amplitudes x_i of these, and the loop answers to them:

    x_i = b_i(s) p/(s - d_i),    p = K(s) sum over i of c_i x_i,    K(s) = -gain C1(s) R N(s)

b_i(s) is how far the winches drive the i-th by p, p' and p'', and c_i its share in the measured coordinates. With
x_j = 1, so that the pole is that of the mode j,

    s = d_j + b_j(s) p,    p = (I - K(s) G_j(s))^-1 K(s) c_j

with the sum G_j(s) of c_i b_i(s)/(s - d_i) over all other modes i. The right side hardly depends on s: a few steps of
the secant method find the poles of all modes, unless the gain moves some past each other. The loop's own states have
the remaining poles, those of the matrix A in the quotient of all states by the motions of these modes.
"""

import numpy as np

from cablestudy.cable.matrices import inverse
from cablestudy.system.residues import Eigen, eigen, independent_vectors
from cablestudy.system.tolerances import SYSTEM


@np.errstate(all="ignore")  # what is not finite is not found
def eigen_of_closed_loop(a, at_rest, motion, control):
    """`Eigen` of a closed loop, None where its poles are not found from those at rest: then the general way is needed.

    Parameters
    ----------
    a : ndarray, complex, shape (N, N)
        Matrix of the closed loop: n states of the motion, then those of the loop, see `first_order`.
    at_rest : Eigen
        Of the n states, the winches at rest.
    motion : LinearSystem
        Its inputs are the lengths that winches reel in.
    control : LinearControl
    """
    modes, count = _Modes(at_rest, motion, control), len(at_rest.values)
    s = modes.closed_poles()
    if s is None:
        return None
    amplitudes, of_loop = modes.amplitudes(s), a[count:, count:]
    shapes = at_rest.right @ amplitudes
    # states of the loop in the motions of the modes
    inputs = (a[count:, :count] @ shapes).T[..., None]
    states = np.linalg.solve(s[:, None, None] * np.eye(len(of_loop)) - of_loop, inputs)[..., 0].T
    by_modes = inverse(amplitudes[None])[0] @ at_rest.left
    by_states = states @ by_modes
    if not np.isfinite(by_states).all():
        return None
    others = eigen(of_loop - by_states @ a[:count, count:])
    motions_by_loop = (by_modes @ a[:count, count:] @ others.right) / (others.values - s[:, None])
    right = np.block([[shapes, shapes @ motions_by_loop], [states, states @ motions_by_loop + others.right]])
    left_of_others = np.concatenate([-others.left @ by_states, others.left], axis=1)
    left = np.concatenate([-motions_by_loop @ left_of_others, left_of_others])
    left[:count, :count] += by_modes
    found = Eigen(np.concatenate([s, others.values]), right, left, one_sided=True)
    residual = _largest(a @ right - right * found.values)
    rounding = SYSTEM.closed_pole_residual * _largest(a).max() * _largest(right)
    return found if (residual <= rounding).all() and independent_vectors(right[None], left[None]).all() else None


class _Modes:
    """Modes of a motion at rest that its loop measures and drives; arguments are those of `eigen_of_closed_loop`."""

    def __init__(self, at_rest, motion, control):
        count, allocation = len(motion), control.allocation
        self._poles, self._control = at_rest.values, control
        by_forces = at_rest.left[:, count : 2 * count]
        # b_i of p, p' and p'', shape (3, n, r), and c_i, shape (k, n)
        self._driven = np.array([by_forces @ motion.accelerations(b @ allocation.movements) for b in motion.b])
        self._measured = (allocation.measured / motion.unit) @ at_rest.right[:count]
        products = self._measured.T[:, :, None] * self._driven[:, :, None]  # c_i b_i, shape (3, n, k, r)
        self._products = np.moveaxis(products, 0, 1).reshape(len(self._poles), -1)

    def closed_poles(self):
        """The poles s of all modes with the loop closed, shape (n,); None where they are not found."""
        before, s = self._poles, self._poles + self._shift(self._poles)
        change = s - before
        for _ in range(SYSTEM.closed_pole_steps):
            if not (np.abs(s - before) < SYSTEM.closed_pole_shift * np.abs(s)).all():
                return None
            step = self._poles + self._shift(s) - s
            slope = (step - change) / (s - before)
            steep = np.abs(slope) > SYSTEM.secant_slope
            before, change, s = s, step, s - np.where(steep, step / slope, -step)
            if (np.abs(s - before) <= SYSTEM.closed_pole_change * np.abs(s)).all():
                return s
        return None

    def amplitudes(self, s):
        """Amplitudes x_i of the modes at rest in those with the loop closed, columns, shape (n, n)."""
        movements, fractions = self._movements(s)
        amplitudes = _polynomial([driven @ movements.T for driven in self._driven], s) * fractions.T
        np.fill_diagonal(amplitudes, 1.0)
        return amplitudes

    def _shift(self, s):
        """b_j(s) p of each mode, by which the loop shifts its pole, shape (n,)."""
        movements, _ = self._movements(s)
        return (_polynomial(self._driven, s[:, None]) * movements).sum(axis=1)

    def _movements(self, s):
        """p of each mode j at s_j, shape (n, r), and 1/(s_j - d_i), 0 where i = j, shape (n, n)."""
        fractions = 1 / (s[:, None] - self._poles)
        fractions[~np.isfinite(fractions)] = 0.0  # of poles that coincide with another one which the loop does not move
        np.fill_diagonal(fractions, 0.0)
        law = self._law(s)
        (_, size, _), measured = law.shape, len(self._measured)
        sums = np.moveaxis((fractions @ self._products).reshape(len(s), 3, measured, size), 1, 0)
        plant = _polynomial(sums, s[:, None, None])  # G_j
        movements = np.linalg.solve(np.eye(size) - law @ plant, law @ self._measured.T[..., None])
        return movements[..., 0], fractions

    def _law(self, s):
        """K(s), shape (n, r, k)."""
        control = self._control
        filtered = [np.ones(len(s)) if notch is None else notch(s) for notch in control.notches]
        by_error = -control.gain * _response(control.law_space, s) / s
        return by_error[:, None, None] * control.allocation.rates * np.stack(filtered, axis=-1)[:, None]


def _largest(matrix):
    """Largest size in each column of a complex matrix: several times faster than by `abs`."""
    return np.sqrt((matrix.real**2 + matrix.imag**2).max(axis=0))


def _polynomial(coefficients, s):
    """a + s b + s^2 c of three arrays."""
    a, b, c = coefficients
    return a + s * (b + s * c)


def _response(state_space, s):
    """Response c (s - a)^-1 b + d of a state space at s, shape (f,)."""
    a, b, c, d = map(np.asarray, state_space)
    if not len(a):
        return np.full(len(s), d, dtype=complex)
    states = np.linalg.solve(s[:, None, None] * np.eye(len(a)) - a, np.broadcast_to(b[:, None], (len(s), len(b), 1)))
    return states[..., 0] @ c + d
