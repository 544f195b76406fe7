"""How forces along the cable reach the gondola: as a force at end 2 along x."""

import numpy as np

from cablestudy.control.ends import GONDOLA


def modal_shares(model, s):
    """Force on the gondola per modal force psi^T f, beside the static share of f that end 2 holds.

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
    With modal damping p r/(W^2 (r + W^2)), r = s^2 + 2 zeta W s; with damped strain -(c R + s^2 m)^T
    (s^2 + W^2 + c E)^-1, by the poles of the latter. See the head of `control.ends`.
    """
    s = np.asarray(s)[:, None]
    carried = -model.participation[:, GONDOLA] / model.omega**2
    if model.strain is None:
        rate = s**2 + 2 * model.damping_ratio * model.omega * s
        return -carried * rate / (rate + model.omega**2)
    value, left, right = model.poles
    weight = 1 / (s**2 + value if model.strain.law == "hysteretic" else s - value)
    driven = model.strain.factor(s) * (model.strain.coupling[:, GONDOLA] @ left) + s**2 * (carried @ left)
    return -(driven * weight) @ right
