"""Linear systems reduced to some of their undamped modes, with the static response of the others or without it.

With the shapes phi of the modes, mass-normalised and the columns of Phi, their frequencies W and the coordinates z of
the system, of which q are the modal amplitudes:

    z = Phi q + S u,    S what the modes left out contribute to the displacements by the inputs u.
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.matrices import massive_modes, shares
from cablestudy.system.linear import MODAL


def keep_modes(system, chosen):
    """Reduce a system to some of its undamped modes, with the static response of the others to the inputs.

    This is the mode acceleration method (Williams, Quarterly of Mechanics and Applied Mathematics 2, 1949).

    Parameters
    ----------
    system : LinearSystem
        Of one row, n coordinates z, and inputs u that act by B0, B1, B2.
    chosen : ndarray of int, shape (k,)
        Indices of the modes to keep, from 0, the lowest first.

    Returns
    -------
    LinearSystem
        Its coordinates are the amplitudes q of the k modes; inputs and outputs are those of `system`.

    Notes
    -----
    With the kept modes Phi and their frequencies W, z = Phi q + S u, S = R B0, R = K^-1 - Phi W^-2 Phi^T.

    Damping couples the modes left out with those kept, both ways. Inputs move the modes left out, which drive q by
    -Phi^T C S u'. The motion of q, and inputs by their speed and acceleration, move the modes left out, which add

        C0 R ((B1 - C S) u' + (B2 - M S) u'' - C Phi q')

    to the outputs; without C Phi q' responses would not be reciprocal. Tensions by winches have it all, in addition to
    Cj S + Dj: where a winch moves far what hardly resists, these are large and nearly cancel. Of other responses the
    parts by u' and u'' are left out, and of q' what an input causes directly, Phi^T B2 u': so displacements need no
    derivatives of inputs, and neither do tensions by forces, to which they are reciprocal.
    """
    compliance, shapes = system.strain_modes
    others = np.delete(shapes, chosen, axis=1)
    static, observed = others @ (others.T @ system.b[0]), system.c[0] @ others
    reduced = _in_modes(system, chosen, static, system.c, system.d)
    by_damping = -observed @ (others.T @ system.damping @ shapes[:, chosen] / np.sqrt(compliance[chosen]))
    by_speed = observed @ (others.T @ (system.b[1] - system.damping @ static))
    by_acceleration = observed @ (others.T @ (system.b[2] - system.mass @ static))
    improper = _with_derivatives(system.c, 1)[:, None] & _with_derivatives(system.b, 0)
    by_speed = np.where(improper, by_speed, -by_damping @ reduced.b[2])
    d = reduced.d[0], reduced.d[1] + by_speed, reduced.d[2] + np.where(improper, by_acceleration, 0.0)
    return replace(reduced, c=(reduced.c[0], reduced.c[1] + by_damping, reduced.c[2]), d=d)


def _with_derivatives(matrices, axis):
    """Which outputs (`axis` 1) of C0, C1, C2, or inputs (0) of B0, B1, B2, have a part by a derivative: bool."""
    return matrices[1].any(axis=axis) | matrices[2].any(axis=axis)


def truncate_modes(system, chosen):
    """Reduce a system to some of its undamped modes, without the static response of the others: modal truncation.

    It serves to show the error that `keep_modes` avoids.

    Parameters
    ----------
    system : LinearSystem
        Of one row, n coordinates z, and inputs u that act by B0, B1, B2.
    chosen : ndarray of int, shape (k,)
        Indices of the modes to keep, from 0, the lowest first.

    Returns
    -------
    LinearSystem
        Its coordinates are the amplitudes q of the k modes Phi; inputs and outputs are those of `system`.

    Notes
    -----
    The modes left out are held at zero, except for the movement P B2 u that the inputs impose directly:

        z = Phi q + S u,    S = P B2,    P = M^-1 - Phi Phi^T, the sum of phi phi^T over the modes left out.

    The forces that hold these modes would appear in the outputs, by C2 z'', as if they were inertia forces: changes of
    D0, D1 and C1 take them out. Without damping the outputs then lack, for each mode left out, exactly its response
    c g/(W^2 + s^2), c = (C0 - W^2 C2) phi, g = phi^T (B0 - W^2 B2). Modes without mass are left out of P.
    """
    compliance, shapes = system.strain_modes
    others, square = massive_modes(np.delete(shapes, chosen, axis=1), np.delete(compliance, chosen))
    static, c2_p = others @ (others.T @ system.b[2]), system.c[2] @ others @ others.T
    by_holding = system.c[2] @ (others @ (others.T @ system.b[0] - square[:, None] * (others.T @ system.b[2])))
    c = system.c[0], system.c[1] - c2_p @ system.damping, system.c[2]
    d = system.d[0] + by_holding, system.d[1] + c2_p @ system.b[1], system.d[2]
    return _in_modes(system, chosen, static, c, d)


def _in_modes(system, chosen, static, c, d):
    """`LinearSystem` in modal amplitudes q and static displacements S u by the inputs u: z = Phi q + S u.

    The columns of Phi are the modes `chosen`, S is `static`, shape (n, i): q'' + Phi^T C Phi q' + W^2 q = Phi^T (B0 u +
    (B1 - C S) u' + B2 u''), with the outputs Cj Phi and Dj + Cj S, j = 0, 1, 2; C0 to D2 are `c` and `d`.
    """
    compliance, shapes = system.strain_modes
    omega = 1 / np.sqrt(compliance[chosen])
    kept = shapes[:, chosen] * omega
    b0, b1, b2 = (kept.T @ matrix for matrix in system.b)
    return replace(
        system,
        mass=np.eye(len(omega)),
        damping=kept.T @ system.damping @ kept,
        stiffness=np.diag(omega**2),
        b=(b0, b1 - kept.T @ (system.damping @ static), b2),
        c=tuple(matrix @ kept for matrix in c),
        d=tuple(direct + matrix @ static for direct, matrix in zip(d, c, strict=True)),
        bodies=0,
        coordinates=tuple((f"mode_{k + 1}", MODAL) for k in np.asarray(chosen).tolist()),
    )


def inertia_shares(system, output, input_):
    """Share of each undamped mode in the inertia between one output and one input: it serves to choose modes to keep.

    Parameters
    ----------
    system : LinearSystem
        Of n coordinates.
    output, input_ : int
        Indices of the output and of the input.

    Returns
    -------
    ndarray, shape (n,)
        Not negative, of sum 1 (or all zero); the modes ascend in frequency. [-]

    Notes
    -----
    A mode phi of frequency W, driven at w, moves relative to the static displacements K^-1 B0 u by w^2 m/(W^2 - w^2)
    times u, with m = phi^T (B0/W^2 - B2). At w = W its amplitude adds W^2 (C0/W^2 - C2) phi to the output. The share of
    a mode is in proportion to |(C0/W^2 - C2) phi m|; for two ends of a cable it is that of
    `Superelement.inertia_share`.
    """
    compliance, shapes = system.strain_modes
    inertia = compliance * (shapes.T @ system.b[0][:, input_]) - shapes.T @ system.b[2][:, input_]
    observed = compliance * (system.c[0][output] @ shapes) - system.c[2][output] @ shapes
    # W^2, as if the shapes were mass-normalised; none of motions without mass
    square = np.where(compliance > 0, 1 / np.where(compliance > 0, compliance, 1.0), 0.0)
    return shares(np.abs(observed * inertia) * square)
