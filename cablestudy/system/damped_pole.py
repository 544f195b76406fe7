"""The pole of one mode of a suspension with damping, no mode of its cables left out.

    D(s) u = 0,    D(s) = s^2 M_b + s C_b + K_b + sum of G_i^T D_i(s) G_i,

u being the free displacements of the bodies, M_b, C_b and K_b their own matrices, and G_i u the displacements of the
six ends of cable i, whose dynamic stiffness is D_i(s), all its other coordinates condensed. With v all displacements of
the pole s = r + i w, the imaginary part of v^H (s^2 M + s C + K) v = 0 says what is lost in each cycle,

    r (2 w v^H M v + Im v^H C v) + w Re v^H C v + v^H Im K v = 0,

whose last two terms do not cancel, however small the damping. C need not be symmetric: drag is not.
"""

import numpy as np

from cablestudy.errors import ConvergenceError
from cablestudy.system.tolerances import SYSTEM


def damped_pole(layout, elements, near, displacements, damping, far):
    """The pole next to a complex frequency, by inverse iteration with a Newton step along each vector.

    Its real part is then taken from the losses, by the last equation of the module's docstring.

    Parameters
    ----------
    layout : Layout
        Of one equilibrium, with d free displacements.
    elements : list of Superelement
        Of the cables.
    near : complex
        Estimate of the pole, above the real axis. [rad/s]
    displacements : ndarray, shape (d,)
        Estimate of the free displacements of the pole.
    damping : ndarray, shape (d, d), or 0
        C_b without that of links. [N s/m]
    far : float
        Relative distance from `near` from which on a pole counts as another one. [-]

    Returns
    -------
    complex
        [rad/s]

    Raises
    ------
    ConvergenceError
        No pole is found nearer than `far`.
    """
    cables, damping = [element.matrices() for element in elements], damping + layout.damping
    pole, vector = near, displacements.astype(complex)
    for _ in range(SYSTEM.pole_steps):
        condensed = [_condensed(matrices, pole) for matrices in cables]
        stiffness, slope = _dynamic_stiffness(layout, condensed, pole, damping)
        try:
            vector = _solved(stiffness, slope @ vector)
        except (np.linalg.LinAlgError, RuntimeError):  # singular: `pole` is one to the last digit
            step = 0.0
        else:
            vector = vector / np.abs(vector).max()
            step = (vector @ (stiffness @ vector)) / (vector @ (slope @ vector))
        pole = pole - step
        if not (abs(pole - near) < far * abs(near) and pole.imag > 0):
            break
        if abs(step) <= SYSTEM.pole_change * abs(pole):
            return _pole_by_losses(layout, cables, condensed, pole.imag, vector, damping)
    raise ConvergenceError(
        f"no damped mode is found for certain near {abs(near) / (2 * np.pi):.4g} Hz: the damping there is too strong"
    )


def _dynamic_stiffness(layout, condensed, s, damping):
    """D(s) and its derivative, shape (d, d), sparse where the layout's are, from `_condensed` of each cable."""
    body_stiffness, body_mass = layout.body_matrices
    ends = np.array([stiffness for stiffness, _, _ in condensed]).reshape(-1, 6, 6)
    slopes = np.array([slope for _, slope, _ in condensed]).reshape(-1, 6, 6)
    stiffness = layout.of_cables(ends) + body_stiffness + s * damping + s**2 * body_mass
    return stiffness, layout.of_cables(slopes) + damping + 2 * s * body_mass


def _condensed(matrices, s):
    """Dynamic stiffness of the ends of a cable, its derivative by s, and all displacements by those of the ends.

    Shapes (6, 6), (6, 6) and (n + 6, 6); `matrices` are M, C and K of its n modes and six ends.
    """
    mass, damping, stiffness = matrices
    dynamic, modes = stiffness + s * damping + s**2 * mass, len(mass) - 6
    by_ends = np.concatenate([-np.linalg.solve(dynamic[:modes, :modes], dynamic[:modes, modes:]), np.eye(6)])
    return dynamic[modes:] @ by_ends, by_ends.T @ ((damping + 2 * s * mass) @ by_ends), by_ends


def _pole_by_losses(layout, cables, condensed, omega, vector, damping):
    """The pole of a frequency [rad/s] with the real part that follows from its losses, see the module's docstring."""
    inertia = _quadratic(layout.body_matrices[1], vector)
    viscous, hysteretic = _quadratic(damping, vector) if np.ndim(damping) else 0j, 0j
    ends_of_cables = layout.ends(vector[:, None])
    for (mass, cable_damping, stiffness), (_, _, by_ends), ends in zip(cables, condensed, ends_of_cables, strict=True):
        shape = (by_ends @ ends)[:, 0]
        inertia += _quadratic(mass, shape)
        viscous += _quadratic(cable_damping, shape)
        hysteretic += _quadratic(stiffness.imag, shape)
    return complex(-(omega * viscous + hysteretic).real / (2 * omega * inertia + viscous.imag).real, omega)


def _quadratic(matrix, vector):
    """v^H A v of a real matrix."""
    return complex(vector.conj() @ (matrix @ vector))


def _solved(matrix, right):
    """Solution of a linear system whose matrix is sparse or not."""
    if isinstance(matrix, np.ndarray):
        return np.linalg.solve(matrix, right)
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import splu

    return splu(csc_array(matrix)).solve(right)
