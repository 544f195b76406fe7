"""Coordinates of a linear system that depend on each other.

A cable that moves in its own plane is not moved out of it: a body that is free in that plane alone, and the tension of
the cable, know nothing of its motion out of the plane. Coordinates that mass, damping and stiffness do not connect move
as if the others were not there.
"""

import numpy as np

from cablestudy.system.tolerances import SYSTEM


def connected(mass, damping, stiffness, start):
    """Mask of the coordinates that depend on those of `start`, which are among them: ndarray of bool, shape (..., n).

    Parameters
    ----------
    mass, damping, stiffness : ndarray, shape (..., n, n)
        Symmetric.
    start : ndarray of bool, shape (..., n)

    Notes
    -----
    Each entry is compared with the masses m, stiffnesses k and critical damping (k m)^(1/2) of both coordinates.
    """
    return reachable(_coupled(mass, damping, stiffness), start)


def _coupled(mass, damping, stiffness):
    """True where an entry couples two coordinates, shape (..., n, n); see `connected`."""
    root_k, root_m = (np.sqrt(np.abs(np.diagonal(matrix, axis1=-2, axis2=-1))) for matrix in (stiffness, mass))
    scales = (mass, root_m), (damping, np.sqrt(root_k * root_m)), (stiffness, root_k)
    coupled = np.zeros(np.shape(mass), dtype=bool)
    for matrix, scale in scales:
        coupled |= np.abs(matrix) > SYSTEM.uncoupled_entry * scale[..., :, None] * scale[..., None, :]
    return coupled


def coupled_groups(mass, damping, stiffness):
    """Number of the group of coordinates that depend on each other, from 0, shape (..., n); see `connected`."""
    return component_numbers(_coupled(mass, damping, stiffness))


def component_numbers(joined):
    """Number of the connected component of each node of graphs, from 0, shape (..., n); see `reachable`."""
    group, count, index = np.full(joined.shape[:-1], -1), 0, np.arange(joined.shape[-1])
    while (remaining := group < 0).any():
        group[remaining & reachable(joined, index == np.argmax(remaining, axis=-1)[..., None])] = count
        count += 1
    return group


def reachable(joined, start):
    """Mask of the nodes of a graph that paths lead to from some (`start`), these included, shape (..., n).

    `joined`, shape (..., n, n), is True where an edge leads from the node of the row to that of the column.
    """
    nodes, count = start, -1
    while (found := np.count_nonzero(nodes)) > count:
        nodes, count = nodes | (joined & nodes[..., :, None]).any(axis=-2), found
    return nodes


def joined_states(a):
    """True where two states depend on each other, of matrices A of shape (n, N, N).

    Entries that are rounding compared with the largest ones of their row and of their column join nothing.
    """
    size = np.abs(a)
    largest_of_row, largest_of_column = size.max(axis=-1, initial=0.0), size.max(axis=-2, initial=0.0)
    joined = size > SYSTEM.entry_rounding * np.minimum(largest_of_row[..., None], largest_of_column[..., None, :])
    return joined | np.swapaxes(joined, -1, -2)


def observed(system):
    """Mask of the coordinates of a `LinearSystem` that affect its outputs, directly or through others.

    Parameters
    ----------
    system : LinearSystem
        Of n coordinates; one system, or many (...). With dense matrices, without actuators.

    Returns
    -------
    ndarray of bool, shape (..., n)

    Notes
    -----
    To compare coordinates of different units, let each vibrate alone with the amplitude a = 1/sqrt(k), at the frequency
    w = sqrt(k/m), k and m being its entries on the diagonals of stiffness and mass. It then changes an output,
    y = C0 z + C1 z' + C2 z'', by |C0| a + |C1| w a + |C2| w^2 a. It affects the output directly if this is more than
    rounding of the largest change by any coordinate. Coordinates that mass, damping or stiffness couple to such a one,
    perhaps through others, affect the output too.
    """
    diagonals = (np.diagonal(matrix, axis1=-2, axis2=-1) for matrix in (system.stiffness.real, system.mass))
    root_k, root_m = map(np.sqrt, diagonals)
    with np.errstate(divide="ignore"):  # coordinates without mass
        amplitudes = np.stack([1 / root_k, 1 / root_m, root_k / root_m**2])  # of z, z' and z''
    amplitudes = np.minimum(amplitudes, SYSTEM.massless_amplitude)
    change = sum(np.abs(c) * of_order[..., None, :] for c, of_order in zip(system.c, amplitudes, strict=True))
    in_outputs = (change > SYSTEM.uncoupled_entry * change.max(axis=-1, keepdims=True, initial=0.0)).any(axis=-2)
    return connected(system.mass, system.damping, system.stiffness, in_outputs)
