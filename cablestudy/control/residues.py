"""A linear system as a sum over its poles: after one eigenvalue problem each frequency costs one sum.

x' = A x + B u,   y = C x + D u        A = V L V^-1,   L = diag(l_a)
y = [D + sum c_a b_a/(s - l_a)] u      c_a the columns of C V, b_a the rows of V^-1 B
"""

from dataclasses import dataclass

import numpy as np

DEPENDENT = 1e5  # entry of V^-1, the columns of V of unit size, above which A is taken for one without eigenvectors
DELAYED = 1e12  # the same with approximants of a delay, whose eigenvalues hardly any change may reach
NUDGE = 1e-9  # change of its entries then, over the smaller one of the sizes of its rows


@dataclass(frozen=True)
class Eigen:
    """Eigenvalues, complex, shape (N,), and right and left eigenvectors V and V^-1, shape (N, N), of A."""

    poles: np.ndarray
    right: np.ndarray
    left: np.ndarray


def eigen(a, dependent=DEPENDENT):
    """`Eigen` of a matrix, shape (N, N), with eigenvectors up to an entry of V^-1.

    Notes
    -----
    Rows are ordered by their size, the largest first: the small eigenvalues of a graded matrix then keep more digits
    (Stewart, Matrix Algorithms II: Eigensystems, 2001, section 2.3). A matrix without a full set of eigenvectors, as
    that of a critically damped filter, is changed by little so that it has one (Davies, Approximate diagonalization,
    SIAM Journal on Matrix Analysis and Applications 29, 2007).
    """
    size = np.abs(a).sum(axis=1)
    order = np.argsort(-size, kind="stable")
    a, back = a[np.ix_(order, order)], np.argsort(order)
    try:
        poles, right = np.linalg.eig(a)
        left = np.linalg.inv(right)
    except np.linalg.LinAlgError:  # V is singular
        left = np.full_like(a, np.inf)
    if np.abs(left).max(initial=0.0) > dependent:
        noise = np.random.default_rng(0).normal(size=a.shape)
        poles, right = np.linalg.eig(a + NUDGE * np.minimum.outer(size[order], size[order]) * noise)
        left = np.linalg.inv(right)
    return Eigen(poles + 0j, right[back], left[:, back])


@dataclass(frozen=True)
class Residues:
    """The system of the module's docstring: N poles, i inputs, o outputs.

    Attributes
    ----------
    poles : ndarray, complex, shape (N,)
        [rad/s]
    given : ndarray, complex, shape (N, i)
        b_a.
    shown : ndarray, complex, shape (o, N)
        c_a.
    direct : ndarray, shape (o, i)
        D.
    """

    poles: np.ndarray
    given: np.ndarray
    shown: np.ndarray
    direct: np.ndarray

    def response(self, s):
        """Outputs per input, shape (f, o, i), for s of shape (f,); not finite at a pole."""
        return (self.shown / (s[:, None] - self.poles)[:, None, :]) @ self.given + self.direct

    def some(self, chosen):
        """The same with some of its poles, an array of bool."""
        return Residues(self.poles[chosen], self.given[chosen], self.shown[:, chosen], self.direct)

    def statically(self, fast):
        """The same with some poles, an array of bool, replaced by their static response -c_a b_a/l_a."""
        follow = (self.shown[:, fast] / -self.poles[fast]) @ self.given[fast]
        rest = self.some(~fast)
        return Residues(rest.poles, rest.given, rest.shown, self.direct + follow.real)


def residues(eigen, b, c, d):
    """`Residues` of a state space from the `Eigen` of A, and B, C, D of shapes (N, i), (o, N) and (o, i)."""
    return Residues(eigen.poles, eigen.left @ b, c @ eigen.right, d)
