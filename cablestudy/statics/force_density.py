"""Form finding by force densities: the positions of free points of a net whose cables have given tensions over lengths.

With q = T/l of each cable, C the branch-node matrix (1 at end 1, -1 at end 2) of the free and C_f that of all other
ends, the balance of the free points is linear in their coordinates, and independent along x, y and z:

    C^T Q C x = p - C^T Q C_f x_f

Source: Schek (1974), The force density method for form finding and computation of general networks, Comput. Methods
Appl. Mech. Eng. 3, eq. 8. Cables are weightless here, points have their weights and dead forces; links are left out.
"""

from dataclasses import replace

import numpy as np

from cablestudy.cable.matrices import solved, solved_sparse
from cablestudy.errors import NoSolutionError
from cablestudy.statics.tolerances import STATICS


def find_form(suspension):
    """Find the positions of the free points (junctions) of a cable net where given force densities are in balance.

    The force density q of a cable is its tension over its length. The bodies do not move.

    Parameters
    ----------
    suspension : SuspendedSystem
        Cables, bodies and points, in cases of any shape; with a force density of every cable that ends at a free
        junction.

    Returns
    -------
    SuspendedSystem
        The same with its junctions at these positions.
    tension : ndarray, shape (..., c)
        Force density times length of each of the c cables; NaN for cables without a force density. [N]

    Raises
    ------
    NoSolutionError
        A cable at a free junction has no force density, or the force densities do not hold a junction.
    """
    shape = suspension.shape
    flat = suspension.broadcast((int(np.prod(shape)),))  # cases along one axis
    density = flat.force_density
    if density is None:
        raise NoSolutionError("no cable has a force density")
    if names := cables_without_force_density(flat):
        raise NoSolutionError(f"no force density of {', '.join(names)}")
    free = _free_coordinates(flat)
    cables, position = np.flatnonzero(_at_free_junction(flat)), np.array(flat.position)
    ends = flat.ends(position, flat.rotation)
    for case in range(len(position)):
        for axis in range(3):
            moving = free[:, axis]
            load = flat.force[case, :, axis] - (axis == 2) * flat.gravity[case] * flat.mass[case]
            coordinates = ends[case, :, :, axis]
            position[case, moving, axis] = _coordinates(flat, moving, cables, density[case], load, coordinates)
    form = replace(flat, position=position)
    ends = form.ends(position, flat.rotation)[:, flat.of_cables]
    length = np.sqrt(((ends[..., 1, :] - ends[..., 0, :]) ** 2).sum(axis=-1))
    return form.broadcast(shape), (density * length).reshape((*shape, length.shape[-1]))


def cables_without_force_density(suspension):
    """Names of the cables that end at a free junction and have no force density, in some row: list of str."""
    missing = _at_free_junction(suspension)
    if suspension.force_density is not None:
        missing = missing & ~np.isfinite(suspension.force_density).all(axis=0)
    return [suspension.cable_names[i] for i in np.flatnonzero(missing)]


def _free_coordinates(suspension):
    """True for each coordinate x, y and z that a free junction finds; bodies do not move. Shape (b, 3)."""
    free = suspension.free[:, :3].copy()
    free[: suspension.bodies] = False
    return free


def _at_free_junction(suspension):
    """True for each cable with an end at a free junction, shape (c,)."""
    free = np.append(_free_coordinates(suspension).any(axis=-1), False)  # the ground last, at the index GROUND
    return free[suspension.owner[suspension.of_cables]].any(axis=-1)


def _coordinates(suspension, moving, cables, density, load, ends):
    """Coordinates along x, y or z of the points of a cable net that can move, by force densities, in one case.

    Solves C^T Q C x = p - C^T Q C_f x_f, see the docstring of the module.

    Parameters
    ----------
    suspension : SuspendedSystem
        With b bodies and points.
    moving : ndarray of bool, shape (b,)
        True for the m points that can move along this axis.
    cables : ndarray of int
        Indices of the cables with an end at a free junction.
    density : ndarray, shape (c,)
        Force density q of each cable. [N/m]
    load : ndarray, shape (b,)
        Force p on each body and point along this axis. [N]
    ends : ndarray, shape (c, 2)
        Coordinates of all cable ends; used where they cannot move. [m]

    Returns
    -------
    ndarray, shape (m,)
        [m]

    Raises
    ------
    NoSolutionError
        The force densities do not hold a junction.
    """
    if not moving.any():
        return np.zeros(0)
    # row of the equations that each point has, -1 where it does not move; last the ground, whose index GROUND is -1
    row = np.append(np.where(moving, np.cumsum(moving) - 1, -1), -1)
    node = row[suspension.owner[cables]]  # row of the point at each end, shape (cables, 2)
    q, count, right = density[cables], int(moving.sum()), load[moving].copy()
    rows, columns, entries = [], [], []
    for end, other_end in ((0, 1), (1, 0)):
        moves, other_fixed = node[:, end] >= 0, node[:, other_end] < 0
        between, to_fixed = moves & ~other_fixed, moves & other_fixed
        rows += [node[moves, end], node[between, end]]
        columns += [node[moves, end], node[between, other_end]]
        entries += [q[moves], -q[between]]
        np.add.at(right, node[to_fixed, end], (q * ends[cables, other_end])[to_fixed])
    indices = np.concatenate(rows), np.concatenate(columns)
    solution = (_solved if count <= STATICS.dense_freedoms else _solved_sparse)(np.concatenate(entries), indices, right)
    if not np.isfinite(solution).all():
        names = [suspension.body_names[i] for i in np.flatnonzero(moving)]
        raise NoSolutionError(f"the force densities do not hold {', '.join(names[:5])}: no form balances them")
    return solution


def _solved(entries, indices, right):
    """Solution of the equations of balance, NaN where they are singular, shape (m,).

    The entries of their matrix are at `indices`, rows and columns; those at equal indices are added.
    """
    matrix = np.zeros((len(right), len(right)))
    np.add.at(matrix, indices, entries)
    return solved(matrix[None], right[None, :, None])[0, :, 0]


def _solved_sparse(entries, indices, right):
    """`_solved` of many equations."""
    from scipy.sparse import coo_array

    return solved_sparse(coo_array((entries, indices), shape=(len(right), len(right))), right)
