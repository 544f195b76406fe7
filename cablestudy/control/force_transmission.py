"""Transmission of forces along the cable to the gondola, as a force at end 2 along x."""

import numpy as np

from cablestudy.system.superelement import GONDOLA


def modal_force_transmission(model, s):
    """Force on the gondola per modal force psi^T f, beside the static share of f that end 2 takes.

    Parameters
    ----------
    model : Superelement
    s : ndarray, shape (m,)
        Laplace variable, in the upper half plane. [rad/s]

    Returns
    -------
    ndarray, complex, shape (m, n)
        [sqrt(kg)]

    Notes
    -----
    With modal damping p r/(W^2 (r + W^2)), r = s^2 + 2 zeta W s. With damped strain
    -(c R + s^2 m)^T (s^2 + W^2 + c E)^-1, as a sum over the poles of the inverse. Symbols: see `system.superelement`.
    """
    if model.uneven:
        return -model.held_by_modes(s, [GONDOLA])[:, 0]
    s = np.asarray(s)[:, None]
    inertial, coupling = s**2 + model.viscous * s, model.coupling[:, GONDOLA]
    if model.strain is None:
        rate = inertial + 2 * model.damping_ratio * model.omega * s
        return -coupling * rate / (rate + model.omega**2)
    factor = model.strain.factor(s)
    if model.resolvent is None:
        force = factor * model.strain.coupling[:, GONDOLA] + inertial * coupling
        matrix = np.diag(model.omega**2) + factor[..., None] * model.strain.modes
        matrix = matrix + inertial[..., None] * np.eye(len(model.omega))
        return -np.linalg.solve(matrix, force[..., None])[..., 0]
    value, left, right = model.resolvent
    weight = 1 / (inertial + value if model.strain.law == "hysteretic" else s - value)
    driven = factor * (model.strain.coupling[:, GONDOLA] @ left) + inertial * (coupling @ left)
    return -(driven * weight) @ right
