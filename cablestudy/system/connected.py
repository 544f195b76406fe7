"""Which coordinates of a linear system depend on each other.

A cable that moves in its own plane is not moved out of it: a body that is free in that plane alone, and the tension of
the cable, know nothing of its motion out of the plane. Coordinates that mass, damping and stiffness do not connect move
as if the others were not there.
"""

import numpy as np

NONE = 1e-12  # of the size of two coordinates, up to which what couples them is rounding


def connected(mass, damping, stiffness, some):
    """Which coordinates depend on some of them, which are among them: ndarray of bool, shape (n,).

    Parameters
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
        Symmetric.
    some : ndarray of bool, shape (n,)

    Notes
    -----
    Each entry is compared with the masses m, stiffnesses k and critical damping (k m)^(1/2) of both coordinates.
    """
    k, m = np.sqrt(np.abs(np.diagonal(stiffness))), np.sqrt(np.diagonal(mass))
    coupled = np.abs(mass) > NONE * m[:, None] * m
    for part, size in ((damping, np.sqrt(k * m)), (stiffness, k)):
        coupled |= np.abs(part) > NONE * size[:, None] * size
    found, more = some, coupled[some].any(axis=0) & ~some
    while more.any():
        found = found | more
        more = coupled[more].any(axis=0) & ~found
    return found


def observed(system):
    """Which coordinates of a `LinearSystem` any output depends on, shape (n,).

    Parameters
    ----------
    system : LinearSystem
        With dense matrices, without actuators.

    Returns
    -------
    ndarray of bool

    Notes
    -----
    What is moved is compared for motions with the energy k z^2 of 1.
    """
    stiffness, mass = np.sqrt(np.diagonal(system.stiffness).real), np.sqrt(np.diagonal(system.mass))
    with np.errstate(divide="ignore", invalid="ignore"):  # coordinates without mass
        moving = 1 / stiffness, 1 / mass, stiffness / mass**2
        seen = sum(np.nan_to_num(np.abs(part) * one) for part, one in zip(system.c, moving, strict=True))
    seen = (seen > NONE * seen.max(axis=1, keepdims=True, initial=0.0)).any(axis=0)
    return connected(system.mass, system.damping, system.stiffness, seen)
