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
    """The system reduced to some of its modes, with the static response of the others to the inputs.

    Parameters
    ----------
    system : LinearSystem
        Of one row, n coordinates.
    chosen : ndarray of int
        Modes to keep, from 0.

    Returns
    -------
    LinearSystem
        Its coordinates are modal amplitudes.

    Notes
    -----
    Mode acceleration method (Williams, Quarterly of Mechanics and Applied Mathematics 2, 1949): of the modes left out
    the static part stays, S = R B0 with R = K^-1 - Phi W^-2 Phi^T. Damping couples them with those kept: as the inputs
    move them, they drive q by -Phi^T C S u', and as q moves, they add -C0 R C Phi q' to the outputs, without which
    responses would not be reciprocal. The jump B2 u' of q' is left out of this, as is what the inputs alone would add
    by damping: displacements need no derivatives of inputs.
    """
    compliance, shapes = system.strain_modes
    others = np.delete(shapes, chosen, axis=1)
    reduced = _in_modes(system, chosen, others @ (others.T @ system.b[0]), system.c, system.d)
    by_damping = -system.c[0] @ others @ (others.T @ system.damping @ shapes[:, chosen] / np.sqrt(compliance[chosen]))
    c = reduced.c[0], reduced.c[1] + by_damping, reduced.c[2]
    return replace(reduced, c=c, d=(reduced.d[0], reduced.d[1] - by_damping @ reduced.b[2], reduced.d[2]))


def truncate_modes(system, chosen):
    """The system reduced to some of its modes, without the static response of the others: modal truncation.

    It shows the error that `keep_modes` avoids, whose parameters and result it has.

    Notes
    -----
    The displacements of the modes left out are held at zero, relative to the movement P B2 u of the inputs itself:
    S = P B2 with P = M^-1 - Phi Phi^T, the sum of phi phi^T over the modes left out. The forces that hold them would
    appear in the outputs, as if they were inertia forces, by C2 z'': D0, D1 and C1 take them out again. Without damping
    the response of each mode left out is missing, c g/(W^2 + s^2) with c = (C0 - W^2 C2) phi and
    g = phi^T (B0 - W^2 B2). Motions without mass are at rest.
    """
    compliance, shapes = system.strain_modes
    others, square = massive_modes(np.delete(shapes, chosen, axis=1), np.delete(compliance, chosen))
    static, c2_p = others @ (others.T @ system.b[2]), system.c[2] @ others @ others.T
    by_holding = system.c[2] @ (others @ (others.T @ system.b[0] - square[:, None] * (others.T @ system.b[2])))
    c = system.c[0], system.c[1] - c2_p @ system.damping, system.c[2]
    d = system.d[0] + by_holding, system.d[1] + c2_p @ system.b[1], system.d[2]
    return _in_modes(system, chosen, static, c, d)


def _in_modes(system, chosen, static, c, d):
    """The system in modal amplitudes q and static displacements by the inputs: z = Phi q + S u.

    Parameters
    ----------
    system : LinearSystem
    chosen : ndarray of int
        Modes of the columns of Phi, from 0.
    static : ndarray, shape (n, i)
        S: displacement of each coordinate by a unit of each input.
    c, d : tuple of 3 ndarray, shapes (o, n) and (o, i)
        C0 to C2 and D0 to D2: outputs per z, z', z'' and per u, u', u''.
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
    """Share of each mode in the inertia between one output and one input, by which the modes to keep are chosen. [-]

    Parameters
    ----------
    system : LinearSystem
    output, input_ : int
        Numbers of the output and of the input.

    Returns
    -------
    ndarray, shape (n,)

    Notes
    -----
    About the static displacements K^-1 B0 u a mode moves by w^2 m/(W^2 - w^2) with m = Phi^T (B0/W^2 - B2), and at its
    frequency the output is W^2 (C0/W^2 - C2) Phi of it. The share is that of |(C0/W^2 - C2) Phi m|, for two ends of a
    cable as in `Superelement.inertia_share`.
    """
    compliance, shapes = system.strain_modes
    inertia = compliance * (shapes.T @ system.b[0][:, input_]) - shapes.T @ system.b[2][:, input_]
    observed = compliance * (system.c[0][output] @ shapes) - system.c[2][output] @ shapes
    # W^2, as if the shapes were mass-normalised; none of motions without mass
    square = np.where(compliance > 0, 1 / np.where(compliance > 0, compliance, 1.0), 0.0)
    return shares(np.abs(observed * inertia) * square)
