"""Dynamic stiffness at the ends of many cables, each at its own complex frequency, no coordinate left out.

The equations are those of `superelement`, for n coordinates q of each cable and its six ends u, the inertia I of modes
replaced by any matrix where the coordinates are no modes:

    Q(s) = s^2 M + s C + K,    D(s) = Q_uu - Q_uq Q_qq^-1 Q_qu.

Damping of strain and of point masses has few rows V compared with the number of coordinates: V^T c V with a complex
factor c for each row. Where the rest of Q_qq is a diagonal matrix d, the formula of Woodbury,

    (d + V^T c V)^-1 = d^-1 - d^-1 V^T (I + c V d^-1 V^T)^-1 c V d^-1,

solves equations of the size of V alone. Arrays have a first axis of g cables; no digit of one depends on the others.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.matrices import product, solved
from cablestudy.cable.records import take_rows
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class CondensedCables:
    """Equations of motion of g cables with n coordinates each, and the six displacements of their ends.

    Attributes
    ----------
    cables : ndarray of int, shape (g,)
        Indices of these cables.
    omega : ndarray, shape (g, n)
        Root of the stiffness of each coordinate, which is diagonal. [rad/s]
    coupling : ndarray, shape (g, n, 6)
        m: momentum of the coordinates per velocity of the ends. [sqrt(kg)]
    stiffness, inertia : ndarray, shape (g, 6, 6)
        k and J of the ends. [N/m], [kg]
    ratio, loss, time, viscous : ndarray, shape (g,)
        Damping: modal ratio [-], loss factor [-], time of Kelvin and Voigt's law [s], and viscous damping per length
        over mass per length [1/s].
    strain_root : ndarray, shape (g, r, n + 6), or None
        V: V^T V is the elastic part of the stiffness of coordinates and ends; None where no cable has damped strain.
    carried : ndarray, shape (g, c, n + 6), or None
        B: B^T B is the mass of point masses on the cables, without viscous damping; None where there are none, or no
        such damping.
    inertia_of_modes : ndarray, shape (g, n, n), or None
        None for modes, whose inertia is the identity.
    added_damping, loads : ndarray, shape (g, n + 6, n + 6), or None
        Damping besides that of the laws [1/s], [N s/m], and stiffness by loads that turn with the cable [1/s^2], [N/m];
        neither need be symmetric.
    """

    cables: np.ndarray
    omega: np.ndarray
    coupling: np.ndarray
    stiffness: np.ndarray
    inertia: np.ndarray
    ratio: np.ndarray
    loss: np.ndarray
    time: np.ndarray
    viscous: np.ndarray
    strain_root: np.ndarray | None = None
    carried: np.ndarray | None = None
    inertia_of_modes: np.ndarray | None = None
    added_damping: np.ndarray | None = None
    loads: np.ndarray | None = None

    @classmethod
    def of_ends(cls, cables, ends, rows, damping):
        """`CondensedCables` of some rows of `Ends`, by their indices `cables` among all, with a `Damping` each."""
        laws, viscous = laws_of(damping), np.array([law.viscous for law in damping]) / ends.mass[rows]
        arrays = [ends.omega, ends.coupling, ends.stiffness, ends.inertia]
        strained, resisted = laws["loss"].any() or laws["time"].any(), viscous.any()
        optional = {
            "strain_root": ends.strain_root if strained else None,
            "carried": ends.carried if resisted else None,
            "inertia_of_modes": ends.inertia_of_modes,
        }
        optional = {name: None if array is None else array[rows] for name, array in optional.items()}
        return cls(cables, *(array[rows] for array in arrays), **laws, viscous=viscous, **optional)

    def take(self, chosen):
        """Some of the cables, by an array of bool."""
        return self if chosen.all() else take_rows(self, chosen)

    def with_matrices(self, name, matrices):
        """Copy with full matrices of some cables: `name` is "added_damping" or "loads".

        `matrices` is a dict, index of the cable -> matrix, shape (n + 6, n + 6); other cables have zeros.
        """
        if not matrices:
            return self
        none = np.zeros((self.omega.shape[-1] + 6,) * 2)
        return replace(self, **{name: np.array([matrices.get(cable, none) for cable in self.cables.tolist()])})

    def dynamic_stiffness(self, s):
        """Dynamic stiffness D(s) at the six end displacements of each of g cables, its derivative, and the shapes X.

        With the coordinates q of a cable (modes with fixed ends, or others), its end displacements u and their matrices
        Q = s^2 M + s C + K,

            D = Q_uu - Q_uq Q_qq^-1 Q_qu,    X = [-Q_qq^-1 Q_qu; I],    D' = Y^T Q' X,

        Y being X of Q^T.

        Parameters
        ----------
        s : ndarray, complex, shape (g,)
            Laplace variable, one value for each cable. [rad/s]

        Returns
        -------
        stiffness, derivative : ndarray, complex, shape (g, 6, 6)
            D and dD/ds. The derivative is an approximation if `added_damping` is not symmetric. [N/m], [N s/m]
        shapes : ndarray, complex, shape (g, n + 6, 6)
            X: displacements of the n coordinates, then of the ends, per displacement of each end.
        """
        n, s = self.omega.shape[-1], s[:, None, None]
        viscous, ratio = self.viscous[:, None, None], self.ratio[:, None, None]
        inertial, modal = s**2 + viscous * s, 2 * s * ratio * self.omega[..., None]
        by_ends = (inertial + modal) * self.coupling
        of_ends = self.stiffness + inertial * self.inertia + self.coupling.swapaxes(-1, -2) @ (modal * self.coupling)
        diagonal = self.omega[..., None] ** 2 + modal + (inertial if self.inertia_of_modes is None else 0.0)
        strain_factor = s * self.time[:, None, None] + 1j * self.loss[:, None, None]
        damped = (self.strain_root, strain_factor), (self.carried, -viscous * s)  # V^T c V: rows V and their factor c
        damped = [(rows, factor) for rows, factor in damped if rows is not None]
        for rows, factor in damped:
            by_ends = by_ends + factor * (rows[..., :n].swapaxes(-1, -2) @ rows[..., n:])
            of_ends = of_ends + factor * (rows[..., n:].swapaxes(-1, -2) @ rows[..., n:])
        of_modes = by_ends.swapaxes(-1, -2)
        full_matrices = (self.added_damping, s), (self.loads, np.ones_like(s))  # and the power of s before each
        full_matrices = [(matrix, factor) for matrix, factor in full_matrices if matrix is not None]
        for matrix, factor in full_matrices:
            by_ends, of_modes = by_ends + factor * matrix[:, :n, n:], of_modes + factor * matrix[:, n:, :n]
            of_ends = of_ends + factor * matrix[:, n:, n:]
        dense = [(matrix[:, :n, :n], factor) for matrix, factor in full_matrices]
        if self.inertia_of_modes is not None:
            dense.insert(0, (self.inertia_of_modes, inertial))
        of_strain = [(rows[..., :n], factor) for rows, factor in damped]
        shapes, ends = -_solution(diagonal, of_strain, dense, by_ends), np.broadcast_to(np.eye(6), of_ends.shape)
        all_shapes = left = np.concatenate([shapes, ends], axis=1)
        if self.loads is not None:
            transposed = [(matrix.swapaxes(-1, -2), factor) for matrix, factor in dense]
            by_modes = -_solution(diagonal, of_strain, transposed, of_modes.swapaxes(-1, -2))
            left = np.concatenate([by_modes, ends], axis=1)
        inertia, damping, _ = self.products(left, all_shapes)
        return of_ends + of_modes @ shapes, 2 * s * inertia + damping, all_shapes

    def products(self, left, right):
        """Products left^T M right, left^T C right and left^T H right of each of g cables, for energies and losses.

        M, C and K are the matrices of the n coordinates of a cable and its six end displacements, and H = Im(K) - i A
        with the stiffness A by `loads`. `left` is transposed, not conjugated. Modal damping in C acts on the absolute
        amplitudes q + m u of the coordinates q, with the end displacements u and the `coupling` m.

        Parameters
        ----------
        left, right : ndarray, complex, shape (g, n + 6, k)
            Displacements of the n coordinates, then of the six ends, in k motions of each cable.

        Returns
        -------
        inertia, damping, loss : ndarray, complex, shape (g, k, k)
            Products with M, C and H.
        """
        n = self.omega.shape[-1]
        momentum = product(self.coupling, right[:, n:])  # of the coordinates
        moving = right[:, :n] if self.inertia_of_modes is None else product(self.inertia_of_modes, right[:, :n])
        of_ends = product(self.coupling.swapaxes(-1, -2), right[:, :n]) + product(self.inertia, right[:, n:])
        inertia = left.swapaxes(-1, -2) @ np.concatenate([moving + momentum, of_ends], axis=1)
        damping, loss = self.viscous[:, None, None] * inertia, np.zeros_like(inertia)
        if self.ratio.any():
            absolute = (left[:, :n] + product(self.coupling, left[:, n:])).swapaxes(-1, -2)
            rate = 2 * self.ratio[:, None] * self.omega
            damping = damping + absolute @ (rate[..., None] * (right[:, :n] + momentum))
        if self.strain_root is not None:
            strains = product(self.strain_root, left).swapaxes(-1, -2) @ product(self.strain_root, right)
            damping, loss = damping + self.time[:, None, None] * strains, self.loss[:, None, None] * strains
        if self.carried is not None:
            borne = product(self.carried, left).swapaxes(-1, -2) @ product(self.carried, right)
            damping = damping - self.viscous[:, None, None] * borne
        if self.added_damping is not None:
            damping = damping + left.swapaxes(-1, -2) @ product(self.added_damping, right)
        if self.loads is not None:
            loss = loss - 1j * (left.swapaxes(-1, -2) @ product(self.loads, right))
        return inertia, damping, loss


def laws_of(damping):
    """Numbers of the laws of a sequence of `Damping`, zero where a law is another one: dict of arrays, shape (g,)."""
    named = {"ratio": ("modal", "ratio"), "loss": ("hysteretic", "loss_factor"), "time": ("kelvin_voigt", "time")}
    return {
        name: np.array([getattr(law, attribute) if law.model == model else 0.0 for law in damping])
        for name, (model, attribute) in named.items()
    }


def _solution(diagonal, damped, dense, right):
    """Solve (d + sum of V^T c V + sum of f B) x = b for the n coordinates of each of g cables.

    x has the shape (g, n, 6) of b. d, a diagonal matrix, has the shape (g, n, 1). `damped` has pairs of rows V, shape
    (g, r, n), of the damping of strain or of point masses, and their complex factors c; `dense` pairs of matrices B,
    shape (g, n, n), and factors f; both factors have the shape (g, 1, 1).
    """
    n = diagonal.shape[1]
    # if V has few rows and there is no B, Woodbury's formula of the module's docstring is cheaper
    if dense or sum(rows.shape[1] for rows, _ in damped) >= n:
        return _dense_solution(diagonal, damped, dense, right)
    inverse = 1 / diagonal
    alone = inverse * right
    if not damped:
        return alone
    rows = np.concatenate([rows for rows, _ in damped], axis=1) if len(damped) > 1 else damped[0][0]
    factors = np.concatenate([np.broadcast_to(factor, (*rows.shape[:2], 1)) for rows, factor in damped], axis=1)
    columns, by_mode = rows.swapaxes(-1, -2), inverse.swapaxes(-1, -2)
    matrix = factors * ((rows * by_mode.real) @ columns + 1j * ((rows * by_mode.imag) @ columns))
    matrix[:, np.arange(rows.shape[1]), np.arange(rows.shape[1])] += 1.0
    return alone - inverse * product(columns, solved(matrix, factors * product(rows, alone)))


def _dense_solution(diagonal, damped, dense, right):
    """`_solution` of whole matrices, some cables at a time, for the sake of memory."""
    n, solutions = diagonal.shape[1], []
    block = max(1, SYSTEM.dense_numbers // max(n, 1) ** 2)
    for begin in range(0, len(diagonal), block):
        here = slice(begin, begin + block)
        squares = [(rows[here].swapaxes(-1, -2) @ rows[here], factor[here]) for rows, factor in damped]
        matrix = np.zeros((len(diagonal[here]), n, n), dtype=complex)
        for square, factor in (*squares, *((whole[here], factor[here]) for whole, factor in dense)):
            matrix.real += factor.real * square
            matrix.imag += factor.imag * square
        matrix[:, np.arange(n), np.arange(n)] += diagonal[here, :, 0]
        solutions.append(solved(matrix, right[here]))
    return np.concatenate(solutions)
