"""Poles of one mode each of many suspensions with damping, no mode of their cables left out.

    D(s) u = 0,    D(s) = s^2 M_b + s C_b + K_b + sum of G_i^T D_i(s) G_i,

u being the free displacements of the bodies, M_b, C_b and K_b their own matrices, and G_i u the displacements of the
six ends of cable i, whose dynamic stiffness is D_i(s), all its other coordinates condensed. With v all displacements of
the pole s = r + i w, the imaginary part of v^H (s^2 M + s C + K) v = 0 says what is lost in each cycle,

    r (2 w v^H M v + Im v^H C v) + w Re v^H C v + v^H Im K v = 0,

whose last two terms do not cancel, however small the damping. C need not be symmetric: drag is not. Nor need K: loads
that turn with bodies and cables add a stiffness A, and Im v^H A v to the last term.
"""

import numpy as np

from cablestudy.cable.matrices import solved, solved_sparse
from cablestudy.system.tolerances import SYSTEM


@np.errstate(all="ignore")  # what is not finite is not taken for a pole
def poles_near(layout, cables, near, displacements, damping, far, loads=0.0):
    """Find the pole nearest to an estimate for each of n damped suspensions ("rows"), by inverse iteration.

    A pole s solves D(s) u = 0, D being the dynamic stiffness of the d free displacements u of the bodies, all motion of
    the cables included. Each iteration updates u, and takes a Newton step of s.

    Parameters
    ----------
    layout : Layout
        Of the n rows, with d free displacements and c cables each; or of one, without an axis of rows.
    cables : list of CondensedCables
        Of the n c cables, those of one row after the other.
    near : ndarray of complex, shape (n,)
        Estimates of the poles, above the real axis; NaN where none is asked for. [rad/s]
    displacements : ndarray, shape (n, d)
        Estimates of u.
    damping : ndarray, shape (n, d, d); sparse array, shape (d, d), where the layout's matrices are sparse; or 0
        Damping of the bodies without that of the cables. [N s/m, N s; N s, N m s]
    far : ndarray, shape (n,)
        Largest relative distance of a pole from `near`: farther ones are not accepted. [-]
    loads : array, as `damping`
        A, the stiffness of the bodies by the loads on them, see the module's docstring. [N/m, N; N, N m]

    Returns
    -------
    ndarray of complex, shape (n,)
        Not a number where no pole is found nearer than `far`. [rad/s]

    Notes
    -----
    Finally the real part r of the pole r + i w is taken from the losses, which are accurate however small the damping
    is. With the displacements v of bodies and cables, r = -(w Re v^H C v + v^H Im K v)/(2 w v^H M v + Im v^H C v). No
    digit of a row depends on the others.
    """
    count = len(layout.equilibrium.suspension.cable_names)
    ends, slopes = np.zeros((2, len(near) * count, 6, 6), dtype=complex)
    poles, pole, vector = np.full(len(near), complex(np.nan, np.nan)), near.copy(), displacements.astype(complex)
    pending = np.isfinite(near)
    for _ in range(SYSTEM.pole_steps):
        motions = []
        for of_mesh in cables:
            now = of_mesh.take(pending[of_mesh.cables // count])
            if len(now.cables):
                ends[now.cables], slopes[now.cables], shapes = now.dynamic_stiffness(pole[now.cables // count])
                motions.append((now, shapes))
        stiffness, slope = _dynamic_stiffness(layout, ends, slopes, pole, damping, loads)
        pending &= np.isfinite(_times(stiffness, vector)).all(axis=-1)
        response = _solved(stiffness, _times(slope, vector), pending)
        response = response / np.abs(response).max(axis=-1, keepdims=True)
        regular = np.isfinite(response).all(axis=-1)  # else `pole` is one to the last digit
        vector = np.where(regular[:, None], response, vector)
        step = (vector * _times(stiffness, vector)).sum(axis=-1) / (vector * _times(slope, vector)).sum(axis=-1)
        pole = np.where(pending & regular, pole - step, pole)
        pending &= (np.abs(pole - near) < far * np.abs(near)) & (pole.imag > 0)
        found = pending & ~(regular & (np.abs(step) > SYSTEM.pole_change * np.abs(pole)))
        if found.any():
            poles[found] = _poles_by_losses(layout, motions, pole.imag, vector, damping, loads)[found]
        pending &= ~found
        if not pending.any():
            break
    return poles


def ratios_near(layout, cables, poles, shapes):
    """Damping ratios -Re s/|s| of the poles of one suspension nearest to estimates, no motion of its cables left out.

    Parameters
    ----------
    layout : Layout
    cables : list of CondensedCables
        Of all its cables.
    poles : ndarray, complex, shape (k,)
        Estimates, above the real axis; NaN where none is asked for. [rad/s]
    shapes : ndarray, shape (n, k)
        Of these modes; the last rows are the free displacements of the bodies.

    Returns
    -------
    ndarray, shape (k,)
        Not a number where no pole is found within `SYSTEM.paired_pole_distance`, and nearer than any other estimate:
        where cables move alone their motion shows nothing at the bodies. [-]
    """
    displacements = shapes[len(shapes) - len(layout.free) :].T
    damping = layout.damping if np.ndim(layout.damping) else 0.0
    distance = np.abs(poles[:, None] - poles) / np.abs(poles[:, None])
    others = np.where(distance > SYSTEM.coincident_poles, distance, np.inf)
    far = np.fmin(SYSTEM.paired_pole_distance, np.fmin.reduce(others, axis=1, initial=np.inf) / 2)
    one_by_one = zip(poles[:, None], displacements[:, None], far[:, None], strict=True)
    found = [poles_near(layout, cables, near, moved, damping, most) for near, moved, most in one_by_one]
    found = np.array(found, dtype=complex).reshape(-1)
    return -found.real / np.abs(found)


def _dynamic_stiffness(layout, ends, slopes, s, damping, loads):
    """D(s) and its derivative, shape (n, d, d), sparse where the layout's are, from those of the ends of all cables."""
    shape, (body_stiffness, body_mass) = layout.shape, layout.body_matrices
    ends, slopes = (layout.of_cables(matrices.reshape(*shape, -1, 6, 6)) for matrices in (ends, slopes))
    s = complex(s[0]) if layout.large else s[:, None, None]
    return ends + body_stiffness + loads + s * damping + s**2 * body_mass, slopes + damping + 2 * s * body_mass


def _poles_by_losses(layout, motions, omega, vector, damping, loads):
    """The poles of frequencies [rad/s] with the real parts that follow from their losses, see the module's docstring.

    `motions` has `CondensedCables`, and all displacements of each by those of its ends.
    """
    ends = layout.ends(vector.reshape(*layout.shape, -1, 1)).reshape(-1, 6, 1)
    motions = [(cables, shapes @ ends[cables.cables]) for cables, shapes in motions]
    inertia, viscous, hysteretic = energies(layout, motions, vector, damping, loads)
    return -(omega * viscous + hysteretic).real / (2 * omega * inertia + viscous.imag).real + 1j * omega


def energies(layout, motions, displacements, damping, loads=0.0):
    """v^H M v, v^H C v and v^H (Im K - i A) v of a motion of each of n suspensions, complex, each of shape (n,).

    A is the load stiffness; Im v^H A v is the real part of the last one.

    Parameters
    ----------
    layout, damping, loads
        As for `poles_near`.
    motions : list of (CondensedCables, ndarray)
        With all displacements of each cable, shape (g, n + 6, 1); cables that are not there do not count.
    displacements : ndarray, shape (n, d)
        Free displacements of the bodies.
    """
    count = len(layout.equilibrium.suspension.cable_names)
    of_cables = np.zeros((3, len(displacements) * count), dtype=complex)
    for cables, motion in motions:
        of_cables[:, cables.cables] = np.stack(cables.products(motion.conj(), motion))[..., 0, 0]
    inertia, viscous, hysteretic = of_cables.reshape(3, len(displacements), count).sum(axis=-1)
    inertia = inertia + _quadratic(layout.body_matrices[1], displacements)
    return inertia, viscous + _quadratic(damping, displacements), hysteretic - 1j * _quadratic(loads, displacements)


def _quadratic(matrix, vector):
    """v^H A v of real matrices, shape (n,); 0 for the number 0."""
    return (vector.conj() * _times(matrix, vector)).sum(axis=-1) if np.ndim(matrix) else 0.0


def _times(matrix, vector):
    """Products of matrices, shape (n, d, d), with vectors, shape (n, d), or of one sparse matrix."""
    if isinstance(matrix, np.ndarray):
        return (matrix @ vector[..., None])[..., 0]
    return (matrix @ vector[0])[None]


def _solved(matrix, right, pending):
    """Solutions of the linear systems of pending rows, see `_times`; NaN where one is singular."""
    solution = np.full(right.shape, np.nan, dtype=complex)
    if isinstance(matrix, np.ndarray):
        of_rows = matrix.reshape(-1, *matrix.shape[-2:])[pending], right[pending, :, None]
        solution[pending] = solved(*of_rows)[..., 0]
    elif pending.all():
        solution[0] = solved_sparse(matrix, right[0])
    return solution
