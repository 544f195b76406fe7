"""Which coordinates of a linear system its outputs depend on.

A cable that moves in its own plane is not moved out of it: a body that is free in that plane alone, and the tension of
the cable, know nothing of its motion out of the plane. Such coordinates are connected with no output by the mass, the
damping or the stiffness, and the response of the others is the same without them.
"""

import numpy as np

NONE = 1e-12  # of the size of two coordinates, up to which what couples them is rounding


def observed(system):
    """Which coordinates any output depends on.

    Parameters
    ----------
    system : LinearSystem
        With dense matrices, without actuators.

    Returns
    -------
    ndarray of bool, shape (n,)

    Notes
    -----
    Mass, damping and stiffness are compared with the masses m, stiffnesses k and critical damping (k m)^(1/2) of both
    coordinates, and outputs for motions with the energy k z^2 of 1.
    """
    from scipy.sparse.csgraph import connected_components

    stiffness, mass = np.sqrt(np.diagonal(system.stiffness).real), np.sqrt(np.diagonal(system.mass))
    with np.errstate(divide="ignore", invalid="ignore"):
        coupling = np.nan_to_num(np.abs(system.mass) / np.outer(mass, mass), nan=0.0)
        size = np.sqrt(stiffness * mass)
        coupling += np.nan_to_num(np.abs(system.damping) / np.outer(size, size), nan=0.0)
        coupling += np.abs(system.stiffness) / np.outer(stiffness, stiffness)
        moving = 1 / stiffness, 1 / mass, stiffness / mass**2
        seen = sum(np.nan_to_num(np.abs(part) * one) for part, one in zip(system.moved, moving, strict=True))
    group = connected_components(coupling > NONE, directed=False)[1]
    seen = (seen > NONE * seen.max(axis=1, keepdims=True, initial=0.0)).any(axis=0)
    return np.isin(group, group[seen])
