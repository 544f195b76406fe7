"""Frequency response of a linear system as a sum over its poles: one eigenvalue problem, then a sum per frequency.

x' = A x + B u,   y = C x + D u        A = V L V^-1,   L = diag(l_j)
y = [D + sum c_j b_j/(s - l_j)] u      c_j the columns of C V, b_j the rows of V^-1 B

Eigenvectors of poles that coincide, or nearly, need care, since V^-1 is then lost to rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.matrices import inverse
from cablestudy.system.connected import component_numbers, joined_states
from cablestudy.system.solvents import eigen_by_solvents
from cablestudy.system.tolerances import SYSTEM

CIRCLE = np.exp(2j * np.pi * (np.arange(24) + 0.5) / 24)  # points of a contour around poles that coincide


@dataclass(frozen=True)
class Eigen:
    """Eigenvalues and eigenvectors of the matrix A of a state space, N states.

    Attributes
    ----------
    values : ndarray, complex, shape (N,)
        [rad/s]
    right, left : ndarray, shape (N, N)
        V and V^-1.
    one_sided : bool
        True if A is complex: its response holds for Im s > 0 alone.
    """

    values: np.ndarray
    right: np.ndarray
    left: np.ndarray
    one_sided: bool = False

    @property
    def poles(self):
        """All eigenvalues of a real A, of a complex one `one_sided_poles`."""
        return one_sided_poles(self.values) if self.one_sided else self.values


def one_sided_poles(values):
    """Those eigenvalues of a complex A that are poles of motion: in the upper half plane, or divergent.

    Motion that diverges without oscillating has no hysteretic damping: its pole lies on either side of the real axis,
    by less than 45 degrees. Mirror images of damped poles lie farther from it, whatever the loss factor is.
    """
    return values[(values.imag >= 0) | (values.real > np.abs(values.imag))]


def eigen(a):
    """`eigen_of_rows` of the matrix A of one state space, shape (N, N): `Eigen`."""
    return eigen_of_rows(a[None])[0]


def eigen_of_rows(a):
    """Eigenvalues and eigenvectors, right and left, of the matrices A of n state spaces.

    Parameters
    ----------
    a : ndarray, shape (n, N, N)
        The matrices; no result depends on the others.

    Returns
    -------
    list of Eigen

    Notes
    -----
    Groups of states that do not depend on each other are solved apart. Rows of A are ordered by their size, the largest
    first: the small eigenvalues of a graded matrix then keep more digits (Stewart, Matrix Algorithms II: Eigensystems,
    2001, section 2.3).

    A matrix may lack a full set of eigenvectors, such as that of a critically damped filter. It is then changed
    slightly so that it has one, only in the space of the poles that coincide (Davies, Approximate diagonalization, SIAM
    Journal on Matrix Analysis and Applications 29, 2007). This is done if the shares of states in a pole are too large:
    V_jk (V^-1)_kj for state j and pole k, V being the matrix of eigenvectors. They do not depend on units.
    """
    groups = component_numbers(joined_states(a))
    whole, found = ~groups.any(axis=-1), [None] * len(a)
    for row, of_row in zip(np.flatnonzero(whole).tolist(), _eigen_of_groups(a[whole]), strict=True):
        found[row] = of_row
    for row in np.flatnonzero(~whole).tolist():
        poles, right, left = np.zeros(a.shape[-1], dtype=complex), *np.zeros((2, *a[row].shape), dtype=complex)
        for group in range(groups[row].max() + 1):
            states = np.flatnonzero(groups[row] == group)
            block = np.ix_(states, states)
            (of_group,) = _eigen_of_groups(a[row][block][None])
            poles[states], right[block], left[block] = of_group.values, of_group.right, of_group.left
        found[row] = Eigen(poles, right, left, np.iscomplexobj(a))
    return found


def _eigen_of_groups(a):
    """`eigen_of_rows` of matrices whose states all depend on each other."""
    complex_stiffness, damped = _half_size_forms(a)
    solvers = (complex_stiffness, _eigen_with_complex_stiffness), (damped, _eigen_of_weakly_damped)
    found = [None] * len(a)
    for rows, solve in (*solvers, (~(complex_stiffness | damped), _eigen_of_full)):
        if rows.any():
            for row, of_row in zip(np.flatnonzero(rows).tolist(), solve(a[rows]), strict=True):
                found[row] = of_row
    return [found[row] or _eigen_of_full(a[row : row + 1])[0] for row in range(len(a))]


def _eigen_of_full(a):
    """`eigen_of_rows` by the general algorithm; a matrix with dependent eigenvectors is changed by little first."""
    row, order = np.arange(len(a))[:, None], np.argsort(-np.abs(a).sum(axis=-1), axis=-1, kind="stable")
    sorted_a = a[row[:, None], order[:, :, None], order[:, None, :]]
    poles, right = np.linalg.eig(sorted_a)
    left = _inverse_of_vectors(poles, right, np.iscomplexobj(a))
    independent = independent_vectors(right, left)
    poles, right, left = poles + 0j, right + 0j, left + 0j
    for dependent in np.flatnonzero(~independent).tolist():
        of_row = sorted_a[dependent]
        change = SYSTEM.moved_apart * _separating_change(of_row, poles[dependent], right[dependent])
        poles[dependent], right[dependent] = np.linalg.eig(of_row + change)
        left[dependent] = np.linalg.inv(right[dependent])
    back = np.argsort(order, axis=-1)
    right, left = right[row, back], left[row[:, None], np.arange(a.shape[-1])[:, None], back[:, None]]
    return [Eigen(*of_row, np.iscomplexobj(a)) for of_row in zip(poles, right, left, strict=True)]


def _inverse_of_vectors(poles, right, is_complex):
    """V^-1 of eigenvectors V, shape (n, N, N), those of a real matrix in pairs; infinite where V is singular.

    Of a pair v and conj(v) of a real matrix the real and the imaginary part of v are inverted in their place, in real
    numbers: if a and b are the rows of the inverse that belong to them, those of the pair are (a - i b)/2 and its
    conjugate.
    """
    if is_complex or not np.iscomplexobj(right):
        return inverse(right)
    first, second = poles.imag > 0, poles.imag < 0  # of each pair, one after the other
    rows = inverse(np.where(second[:, None, :], -right.imag, right.real))
    left = rows + 0j
    left[first] = (rows[first] - 1j * rows[second]) / 2
    left[second] = left[first].conj()
    return left


def independent_vectors(right, left):
    """True where the eigenvectors of a matrix are far from dependent: V and V^-1, both of shape (n, N, N)."""
    size = np.abs(left)
    shares, largest = (size * np.abs(np.swapaxes(right, -1, -2))).sum(axis=-1), size.max(axis=(-2, -1), initial=0.0)
    return (shares.max(axis=-1, initial=0.0) <= SYSTEM.dependent_shares) & (largest <= SYSTEM.singular_inverse)


def _half_size_forms(a):
    """Where a complex matrix has the form [0 U; S D], U diagonal, D zero; and D not zero: two arrays of shape (n,)."""
    half = a.shape[-1] // 2
    if not np.iscomplexobj(a) or a.shape[-1] % 2:
        return np.zeros((2, len(a)), dtype=bool)
    unit = np.diagonal(a[:, :half, half:], axis1=-2, axis2=-1)
    of_form = unit.all(axis=-1) & (np.count_nonzero(a[:, :half, half:], axis=(-2, -1)) <= half)
    of_form &= ~a[:, :half, :half].any(axis=(-2, -1))
    damped = a[:, half:, half:].any(axis=(-2, -1))
    return of_form & ~damped, of_form & damped


def _eigen_with_complex_stiffness(a):
    """`eigen_of_rows` of systems damped by a complex stiffness alone (hysteretic): A = [0 U; S 0], U diagonal.

    The eigenvalue problem for the displacements p is half as large: (U S)^-1 p = p/l^2, l being a pole. The inverse is
    taken since the slow poles then are the largest eigenvalues, which rounding spares. None where eigenvectors are
    nearly dependent.
    """
    half = a.shape[-1] // 2
    unit = np.diagonal(a[:, :half, half:], axis1=-2, axis2=-1)
    try:
        squares, right = np.linalg.eig(np.linalg.inv(unit[:, :, None] * a[:, half:, :half]))
    except np.linalg.LinAlgError:
        return [None] if len(a) == 1 else [_eigen_with_complex_stiffness(of_row[None])[0] for of_row in a]
    left = inverse(right)
    independent, poles = independent_vectors(right, left), np.sqrt(1 / squares)
    speeds, by_speeds = right * (poles[:, None] / unit[:, :, None]), left * (unit[:, None] / poles[:, :, None])
    right, left = np.block([[right, right], [speeds, -speeds]]), np.block([[left, by_speeds], [left, -by_speeds]]) / 2
    return _one_sided(np.concatenate([poles, -poles], axis=1), right, left, independent)


@np.errstate(invalid="ignore")  # of rows whose damping is not weak
def _eigen_of_weakly_damped(a):
    """`eigen_of_rows` of weakly damped systems with a complex stiffness: A = [0 U; S D], U diagonal, S complex.

    The displacements p of a pole l solve l^2 p - l U D U^-1 p - U S p = 0 (`eigen_by_solvents`). None where damping is
    not weak, or eigenvectors are nearly dependent.
    """
    half = a.shape[-1] // 2
    unit = np.diagonal(a[:, :half, half:], axis1=-2, axis2=-1)
    stiffness, damping = -unit[:, :, None] * a[:, half:, :half], -unit[:, :, None] * a[:, half:, half:] / unit[:, None]
    poles, shapes, weak = eigen_by_solvents(stiffness, damping.real)
    right = np.concatenate([shapes, shapes * poles[:, None] / unit[:, :, None]], axis=1)
    left = inverse(right)
    return _one_sided(poles, right, left, weak & independent_vectors(right, left))


def _one_sided(poles, right, left, usable):
    """`Eigen` of each of n systems with a complex stiffness, or None where it is not usable, bool, shape (n,): list."""
    found = [None] * len(poles)
    for row in np.flatnonzero(usable).tolist():
        found[row] = Eigen(poles[row], right[row], left[row], one_sided=True)
    return found


def _separating_change(a, poles, right):
    """Random matrix; a small multiple of it, added to A, separates poles of A that nearly coincide.

    It is real for a real A, and acts only in the space of such poles whose eigenvectors, columns of `right`, are nearly
    parallel; other poles do not change. Its norm there is the size of these poles.
    """
    random, total, is_real = np.random.default_rng(0), np.zeros_like(a), not np.iscomplexobj(a)
    remaining = np.arange(len(poles))
    while len(remaining):
        centre = poles[remaining[0]]
        near = np.abs(poles - centre) <= SYSTEM.coincident_poles * np.abs(centre)
        remaining = np.setdiff1d(remaining, np.append(np.flatnonzero(near), remaining[0]))
        # a pole in the lower half plane changes with its conjugate
        conjugate = is_real and centre.imag < -SYSTEM.coincident_poles * np.abs(centre)
        if conjugate or np.linalg.svd(right[:, near], compute_uv=False)[-1] > SYSTEM.parallel_vectors:
            continue
        centre = poles[near].mean()
        projector = _spectral_projector(a, centre, poles[~near])
        change = projector @ random.normal(size=a.shape) @ projector
        change *= np.abs(centre) / np.linalg.norm(change, 2)
        if is_real:
            pair = 1.0 + (centre.imag > SYSTEM.coincident_poles * np.abs(centre))  # twice the real part, for both
            change = pair * change.real
        total += change
    return total


def _spectral_projector(a, centre, other_poles):
    """Projector P, P A = A P, onto the space of the eigenvectors of the poles of A near a centre, shape (N, N).

    P is the integral of (s - A)^-1/(2 pi i) along a circle around these poles, but no others (Kato, Perturbation Theory
    for Linear Operators, I.5.3), here by the trapezoidal rule.
    """
    radius = SYSTEM.circle_radius * np.abs(other_poles - centre).min(initial=np.abs(centre))
    step = radius * CIRCLE
    inverse = np.linalg.inv((centre + step)[:, None, None] * np.eye(len(a)) - a)
    return (step[:, None, None] * inverse).mean(axis=0)


def eigen_of_delayed(a):
    """`Eigen` of the state matrix A, (N, N), of a loop with a delay: its Padé approximant has nearly coincident poles.

    Left eigenvectors are computed on their own, and not as rows of V^-1, where those of the nearly coincident poles
    would spoil all others.
    """
    from scipy.linalg import eig

    order = np.argsort(-np.abs(a).sum(axis=1), kind="stable")
    back = np.argsort(order)
    poles, left, right = eig(a[np.ix_(order, order)], left=True, right=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = left.conj().T / (left.conj() * right).sum(axis=0)[:, None]
    return Eigen(poles + 0j, right[back], left[:, back], np.iscomplexobj(a))


@dataclass(frozen=True)
class Residues:
    """The system of the module's docstring: N poles, i inputs, o outputs.

    Attributes
    ----------
    poles : ndarray, complex, shape (N,)
        [rad/s]
    inputs : ndarray, complex, shape (N, i)
        b_j: how far each input drives pole j.
    outputs : ndarray, complex, shape (o, N)
        c_j: share of pole j in each output.
    direct : ndarray, shape (o, i)
        D: direct change of each output by each input.
    one_sided : bool
        True if the sum is the response for Im s > 0 alone, as for a complex stiffness: its poles are then no pairs.
    """

    poles: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    direct: np.ndarray
    one_sided: bool = False

    def response(self, s):
        """Outputs per input, shape (f, o, i), for s of shape (f,); not finite at a pole."""
        products = self.outputs.T[:, :, None] * self.inputs[:, None, :]  # of each pole
        distances = s[:, None] - self.poles
        fractions = np.reciprocal(distances, out=distances)  # in place: of many poles and frequencies far faster
        products = products.reshape(len(self.poles), self.direct.size)  # of no columns without inputs
        return (fractions @ products).reshape(len(s), *self.direct.shape) + self.direct

    def split(self, highest):
        """Itself and None, since no response is to be added to it; see `DelayedResponse.split`."""
        return self, None

    def combined(self, space):
        """Residues of r combinations of the outputs, the columns of `space`, shape (o, r)."""
        return replace(self, outputs=space.T @ self.outputs, direct=space.T @ self.direct)

    def of_outputs(self, rows):
        """Residues of some of the outputs."""
        return replace(self, outputs=self.outputs[rows], direct=self.direct[rows])

    def take(self, chosen):
        """Residues of some of its poles, chosen by an array of bool."""
        return replace(self, poles=self.poles[chosen], inputs=self.inputs[chosen], outputs=self.outputs[:, chosen])


@dataclass(frozen=True)
class DelayedResponse:
    """Frequency response of a system with a delay, and those of its poles that make sharp peaks in it.

    Integrals over frequency treat the peaks by the poles and the smooth remainder numerically, see `split`.

    Attributes
    ----------
    response : callable
        s, shape (f,) -> outputs per input, shape (f, o, i).
    sharp : Residues
        Without a direct part.
    """

    response: Callable
    sharp: Residues

    def split(self, highest):
        """Sharp poles up to a frequency [rad/s], and the response that is to be added to theirs, a function of s."""
        sharp = self.sharp.take(np.abs(self.sharp.poles) <= highest)
        return sharp, lambda s: self.response(s) - sharp.response(s)

    def combined(self, space):
        """Response of combinations of the outputs, see `Residues.combined`."""
        return DelayedResponse(lambda s: space.T @ self.response(s), self.sharp.combined(space))

    def of_outputs(self, rows):
        """Response of some of the outputs."""
        return DelayedResponse(lambda s: self.response(s)[:, rows], self.sharp.of_outputs(rows))


def delayed_response(response, slow, fast, highest):
    """Make the `DelayedResponse` of a system with a delay: its exact response, and approximate poles that are sharp.

    Sharp poles are lightly damped. Below a limit of frequency they are those of `slow`, above it those of `fast`. The
    limit is the middle of the widest gap between poles of `fast` in a band above `highest`, so that no pole is taken
    twice or lost: below `highest` the loop moves poles of `fast` by more than the remainder may have of a peak.

    Parameters
    ----------
    response : callable
        s, shape (f,) [rad/s] -> outputs per input, shape (f, o, i).
    slow, fast : Residues
        Approximations of the system as sums over poles, good up to the limit and above it.
    highest : float
        Frequency up to which `slow` is good, the lower end of the band in which the limit is sought. [rad/s]

    Returns
    -------
    DelayedResponse
        Integrals over frequency treat the sharp peaks of its response by these poles, the rest numerically.
    """
    slow, fast = _lightly_damped(slow), _lightly_damped(fast)
    band = highest, SYSTEM.gap * highest
    sizes = np.unique(np.append(np.abs(fast.poles), band))
    sizes = sizes[(sizes >= band[0]) & (sizes <= band[1])]
    widest = np.argmax(np.diff(sizes))
    limit = sizes[widest : widest + 2].mean()
    slow, fast = slow.take(np.abs(slow.poles) <= limit), fast.take(np.abs(fast.poles) > limit)
    poles, inputs = np.concatenate([slow.poles, fast.poles]), np.concatenate([slow.inputs, fast.inputs])
    outputs, direct = np.concatenate([slow.outputs, fast.outputs], axis=1), np.zeros_like(slow.direct)
    return DelayedResponse(response, replace(slow, poles=poles, inputs=inputs, outputs=outputs, direct=direct))


def _lightly_damped(system):
    """`Residues` of the lightly damped poles; of pairs both, of a one-sided system those of the upper half plane."""
    size, imag = np.abs(system.poles), system.poles.imag
    oscillates = imag > 0 if system.one_sided else imag != 0
    return system.take((np.abs(system.poles.real) < SYSTEM.sharp * size) & oscillates)


def residues(eigen, b, c, d):
    """`Residues` of a state space from the `Eigen` of A, and B, C, D of shapes (N, i), (o, N) and (o, i)."""
    return Residues(eigen.values, eigen.left @ b, c @ eigen.right, d, eigen.one_sided)
