"""Transmission of forces along the cable to the gondola, as a force at end 2 along x."""

import numpy as np

from cablestudy.control.ends import GONDOLA


def modal_force_transmission(model, s):
    """Force on the gondola per modal force psi^T f, beside the static share of f that end 2 takes.

    Parameters
    ----------
    model : EndModel
    s : ndarray, shape (m,)
        Laplace variable, in the upper half plane. [rad/s]

    Returns
    -------
    ndarray, complex, shape (m, n)
        [sqrt(kg)]

    Notes
    -----
    With modal damping p r/(W^2 (r + W^2)), r = s^2 + 2 zeta W s. With damped strain
    -(c R + s^2 m)^T (s^2 + W^2 + c E)^-1, as a sum over the poles of the inverse. Symbols: see `control.ends`.
    """
    s = np.asarray(s)[:, None]
    mass = -model.participation[:, GONDOLA] / model.omega**2
    if model.strain is None:
        r = s**2 + 2 * model.damping_ratio * model.omega * s
        return -mass * r / (r + model.omega**2)
    value, left, right = model.poles
    weight = 1 / (s**2 + value if model.strain.law == "hysteretic" else s - value)
    driven = model.strain.factor(s) * (model.strain.coupling[:, GONDOLA] @ left) + s**2 * (mass @ left)
    return -(driven * weight) @ right
