"""Which coordinates of a linear system depend on each other.

A cable that moves in its own plane is not moved out of it: a body that is free in that plane alone, and the tension of
the cable, know nothing of its motion out of the plane. Coordinates that mass, damping and stiffness do not connect move
as if the others were not there.
"""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


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
    return reached(_coupled(mass, damping, stiffness), some)


def _coupled(mass, damping, stiffness):
    """Which coordinates each is coupled with, shape (n, n); see `connected`."""
    k, m = np.sqrt(np.abs(np.diagonal(stiffness))), np.sqrt(np.diagonal(mass))
    coupled = np.abs(mass) > SYSTEM.uncoupled_entry * m[:, None] * m
    for part, size in ((damping, np.sqrt(k * m)), (stiffness, k)):
        coupled |= np.abs(part) > SYSTEM.uncoupled_entry * size[:, None] * size
    return coupled


def parts_of(mass, damping, stiffness):
    """Numbers of the coordinates that depend on each other: list of ndarray; arguments as of `connected`."""
    return _parts(_coupled(mass, damping, stiffness))


def _parts(joined):
    """Numbers of those that are joined to each other, by a symmetric matrix of bool: list of ndarray."""
    left, found = np.ones(len(joined), dtype=bool), []
    while left.any():
        part = reached(joined, np.arange(len(joined)) == np.argmax(left))
        found.append(np.flatnonzero(part))
        left &= ~part
    return found


def reached(joined, some):
    """Which are some of n, or joined to them by others: ndarray of bool, shape (n,); `joined` of shape (n, n)."""
    found, more = some, joined[some].any(axis=0) & ~some
    while more.any():
        found = found | more
        more = joined[more].any(axis=0) & ~found
    return found


def apart(a):
    """Numbers of the states that depend on each other, of a matrix A of shape (N, N): list of ndarray.

    Entries that are rounding beside the largest ones of their row and of their column join nothing.
    """
    size = np.abs(a)
    joined = size > SYSTEM.entry_rounding * np.minimum(
        size.max(axis=1, initial=0.0)[:, None], size.max(axis=0, initial=0.0)
    )
    return _parts(joined | joined.T)


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
    seen = (seen > SYSTEM.uncoupled_entry * seen.max(axis=1, keepdims=True, initial=0.0)).any(axis=0)
    return connected(system.mass, system.damping, system.stiffness, seen)
