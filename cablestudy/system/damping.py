"""Damping ratios of coupled modes, by the poles of the damped system in a space of its undamped modes."""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


def damping_ratios(system, omega, shapes, coupled=SYSTEM.coupled_modes):
    """Damping ratio -Re s/|s| of the pole that belongs to each mode, shape (k,); see `damped_poles`. [-]"""
    return damped_poles(system, omega, shapes, coupled)[1]


def damped_poles(system, omega, shapes, coupled=SYSTEM.coupled_modes):
    """The pole that belongs to each mode, and its damping ratio -Re s/|s|.

    Parameters
    ----------
    system : LinearSystem
    omega : ndarray, shape (k,)
        Of some of the lowest modes, in any order. [rad/s]
    shapes : ndarray, shape (n, k)
        Mass-normalised.
    coupled : int
        How many other modes are considered too.

    Returns
    -------
    poles : ndarray, shape (k,)
        Not a number where a mode does not oscillate. [rad/s]
    ratio : ndarray, shape (k,)
        [-]

    Notes
    -----
    The poles are those of s^2 + s phi^T C phi + w^2 + i phi^T Im K phi in a space of these modes, some others, and
    the static response K^-1 C phi to the damping forces of these modes. A pole belongs to the mode that has the largest
    part in its motion; a mode that does not oscillate has phi^T C phi/(2 w).
    """
    count, loss, damping = len(omega), system.stiffness.imag, system.damping
    forces = loss @ shapes
    forces = forces if np.any(forces) else damping @ shapes
    if not np.any(forces):
        return 1j * omega, np.zeros(count)
    above, others = system.lowest(count + coupled)
    product = shapes.T @ (system.mass @ others)
    rest = np.delete(np.arange(len(above)), assigned(product**2)[1])
    above, others = above[rest], others[:, rest]
    if np.abs(product[:, rest]).max(initial=0.0) > SYSTEM.not_orthogonal:
        above, others = ritz(system, shapes, others)
    omega, basis = np.concatenate([omega, above]), np.concatenate([shapes, others], axis=1)
    more, added = ritz(system, basis, system.compliance(forces))
    omega, basis = np.concatenate([omega, more]), np.concatenate([basis, added], axis=1)
    modes, damping, loss = len(omega), basis.T @ (damping @ basis), basis.T @ (loss @ basis)
    # states w q and q', of like size
    stiffness = np.diag(omega) + (1j * loss / omega if loss.any() else 0.0)
    poles, vectors = np.linalg.eig(np.block([[np.zeros((modes, modes)), np.diag(omega)], [-stiffness, -damping]]))
    above = poles.imag > 0
    poles, part = poles[above], np.abs(vectors[:modes, above]) ** 2
    part = (part / part.sum(axis=0))[:count]
    mode, pole = assigned(part)
    ratio = (np.diagonal(damping) / (2 * omega) + np.diagonal(loss) / (2 * omega**2))[:count]
    own = (part[mode, pole] >= SYSTEM.own_part) | (ratio[mode] <= 1)
    mode, pole = mode[own], pole[own]
    ratio[mode] = np.maximum(-poles.real[pole], 0.0) / np.abs(poles[pole])  # what is below zero is rounding
    found = np.full(count, complex(np.nan, np.nan))
    found[mode] = poles[pole]
    return found, ratio


def ritz(system, basis, vectors):
    """Frequencies [rad/s] and mass-normalised shapes of what vectors add to modes: Rayleigh and Ritz."""
    whole = np.sqrt((vectors * (system.stiffness.real @ vectors)).sum(axis=0))
    vectors = vectors / np.where(whole > 0, whole, 1.0)
    vectors = vectors - basis @ (basis.T @ (system.mass @ vectors))
    size, turned = np.linalg.eigh(vectors.T @ (system.stiffness.real @ vectors))
    chosen = size > SYSTEM.dependent_ritz
    vectors = vectors @ (turned[:, chosen] / np.sqrt(size[chosen]))
    compliance, turned = np.linalg.eigh(vectors.T @ (system.mass @ vectors))
    chosen = compliance > SYSTEM.dependent_ritz * compliance.max(initial=0.0)
    root = np.sqrt(compliance[chosen])
    return 1 / root, vectors @ (turned[:, chosen] / root)


def assigned(part):
    """Rows and columns of the assignment with the largest sum of entries."""
    best = part.argmax(axis=1) if part.size else []
    if len(np.unique(best)) == len(part):  # no sum of one entry of each row is larger, and none need be searched
        return np.arange(len(part)), best
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(part, maximize=True)
