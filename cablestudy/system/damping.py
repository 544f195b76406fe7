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
    omega, basis = _with_coupled_modes(system, omega, shapes, coupled)
    static_omega, static_shapes = ritz(system, basis, system.compliance(forces))
    omega, basis = np.concatenate([omega, static_omega]), np.concatenate([basis, static_shapes], axis=1)
    modes, damping, loss = len(omega), basis.T @ (damping @ basis), basis.T @ (loss @ basis)
    # states w q and q', of like size
    stiffness = np.diag(omega) + (1j * loss / omega if loss.any() else 0.0)
    poles, vectors = np.linalg.eig(np.block([[np.zeros((modes, modes)), np.diag(omega)], [-stiffness, -damping]]))
    oscillating = poles.imag > 0
    poles, share = poles[oscillating], np.abs(vectors[:modes, oscillating]) ** 2
    share = (share / share.sum(axis=0))[:count]
    mode, pole = assigned(share)
    ratio = (np.diagonal(damping) / (2 * omega) + np.diagonal(loss) / (2 * omega**2))[:count]
    oscillates = (share[mode, pole] >= SYSTEM.oscillating_share) | (ratio[mode] <= 1)
    mode, pole = mode[oscillates], pole[oscillates]
    ratio[mode] = np.maximum(-poles.real[pole], 0.0) / np.abs(poles[pole])  # what is below zero is rounding
    pole_of_mode = np.full(count, complex(np.nan, np.nan))
    pole_of_mode[mode] = poles[pole]
    return pole_of_mode, ratio


def _with_coupled_modes(system, omega, shapes, coupled):
    """Frequencies and shapes of modes, and after them those of so many others that damping may couple to them."""
    other_omega, other_shapes = system.lowest(len(omega) + coupled)
    product = shapes.T @ (system.mass @ other_shapes)
    others = np.delete(np.arange(len(other_omega)), assigned(product**2)[1])
    other_omega, other_shapes = other_omega[others], other_shapes[:, others]
    if np.abs(product[:, others]).max(initial=0.0) > SYSTEM.not_orthogonal:
        other_omega, other_shapes = ritz(system, shapes, other_shapes)
    return np.concatenate([omega, other_omega]), np.concatenate([shapes, other_shapes], axis=1)


def ritz(system, basis, vectors):
    """Approximate modes, by Rayleigh and Ritz, in the space that vectors add to that of some modes.

    Parameters
    ----------
    system : LinearSystem
        Of n coordinates.
    basis : ndarray, shape (n, k)
        Mass-normalised shapes of the modes.
    vectors : ndarray, shape (n, r)
        They need not be independent.

    Returns
    -------
    omega : ndarray, shape (q,)
        At most r of them. [rad/s]
    shapes : ndarray, shape (n, q)
        Mass-normalised, orthogonal to the modes.
    """
    size = np.sqrt((vectors * (system.stiffness.real @ vectors)).sum(axis=0))
    vectors = vectors / np.where(size > 0, size, 1.0)
    vectors = vectors - basis @ (basis.T @ (system.mass @ vectors))
    strain_energy, directions = np.linalg.eigh(vectors.T @ (system.stiffness.real @ vectors))
    independent = strain_energy > SYSTEM.dependent_ritz
    vectors = vectors @ (directions[:, independent] / np.sqrt(strain_energy[independent]))
    compliance, directions = np.linalg.eigh(vectors.T @ (system.mass @ vectors))
    massive = compliance > SYSTEM.dependent_ritz * compliance.max(initial=0.0)
    root = np.sqrt(compliance[massive])
    return 1 / root, vectors @ (directions[:, massive] / root)


def assigned(scores):
    """Assign one column to each row of a matrix so that the sum of their entries is largest: rows, columns."""
    best = scores.argmax(axis=1) if scores.size else []
    if len(np.unique(best)) == len(scores):  # no sum of one entry of each row is larger, and none need be searched
        return np.arange(len(scores)), best
    from scipy.optimize import linear_sum_assignment

    return linear_sum_assignment(scores, maximize=True)
