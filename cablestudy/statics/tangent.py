"""Net forces on the bodies of a suspension, and their tangent stiffness, for a batch of load cases.

With r the arm of a cable end (its vector from the reference point of the body that holds it), F the force of the cable
on it and K its end stiffness, a body's stiffness is

    sum B^T K B + [0, 0; 0, -sum [F x][r x] - [W x][r_G x]],     B = [I, -[r x]],

over the ends of cables and links on the body, W being its weight and r_G the arm of its center of mass; a cable or link
between two bodies couples them by -B_1^T K B_2. The stiffness is symmetric where forces balance without dead moments.
A dead load F at an arm r from the reference point adds -[F x][r x] = (r.F) I - r F^T.
"""

import itertools
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.cable.vectors import cross, dot, size, times
from cablestudy.statics.block_stiffness import Blocks, free_values
from cablestudy.statics.links import joined
from cablestudy.statics.rigid import point_movement

GROUND = -1  # owner of a cable end that is fixed to the ground


@dataclass(frozen=True)
class PairsOfEnds:
    """Pairs of ends between which a cable or link has stiffness: p ordered pairs, an end with itself too.

    Ends at the ground have no part. A pair of ends belongs to a pair of bodies, those that hold the two ends. The pairs
    of ends are sorted so that the sums over those of each pair of bodies are a few products of stacked matrices: those
    of one pair of bodies follow each other, and so do pairs of bodies with equally many pairs of ends, a run.

    Attributes
    ----------
    line, row, column : ndarray of int, shape (p,)
        Cable or link; its end on which the force acts, 0 or 1; and its end that is displaced.
    row_body, column_body : ndarray of int, shape (g,)
        The bodies at the row end and at the column end, of each of the g different pairs of bodies.
    runs : tuple of (slice, int, int)
        Of each run its pairs of ends, the number of its pairs of bodies, and how many pairs of ends each of these has.
    """

    line: np.ndarray
    row: np.ndarray
    column: np.ndarray
    row_body: np.ndarray
    column_body: np.ndarray
    runs: tuple


@lru_cache(maxsize=16)
def _pairs_of_owners(owners):
    """`PairsOfEnds` by the owners of the two ends of each cable or link, a tuple of (int, int)."""
    groups = {}
    for line, ends in enumerate(owners):
        for row, column in itertools.product((0, 1), repeat=2):
            if GROUND not in (ends[row], ends[column]):
                groups.setdefault((ends[row], ends[column]), []).append((line, row, column))
    bodies = sorted(groups, key=lambda pair: len(groups[pair]))
    runs, begin = [], 0
    for per_pair, body_pairs in Counter(len(groups[pair]) for pair in bodies).items():
        runs.append((slice(begin, begin + per_pair * body_pairs), body_pairs, per_pair))
        begin += per_pair * body_pairs
    pairs = np.array([pair for pair_of_bodies in bodies for pair in groups[pair_of_bodies]], dtype=int).reshape(-1, 3)
    return PairsOfEnds(*pairs.T, *np.array(bodies, dtype=int).reshape(-1, 2).T, tuple(runs))


def pairs(suspension):
    """`PairsOfEnds` of a suspension."""
    return _pairs_of_owners(tuple(map(tuple, np.asarray(suspension.owner).tolist())))


def between_bodies(suspension, stiffness, arms):
    """Stiffness of bodies by the cables and links (springs) that hold them, as a 6x6 block for each pair of bodies.

    A block is the sum of B_1^T K B_2 over pairs of ends: both ends of one cable or link, or one end twice, held by the
    two bodies. K is the force at the first end per displacement of the second one.

    Parameters
    ----------
    suspension : SuspendedSystem
        With b bodies and points, c cables and l links.
    stiffness : ndarray, shape (..., p, 3, 3)
        K of each of the p pairs of ends, in the order of `pairs`. [N/m]
    arms : ndarray, shape (..., c + l, 2, 3)
        r of both ends of all cables and links, global axes. [m]

    Returns
    -------
    matrices : ndarray, shape (..., g, 6, 6)
        For each of the g different pairs of bodies, a body with itself too, in the order of `PairsOfEnds.row_body`.
    sizes : ndarray, shape (..., b, 6)
        For each body the sums of the sizes of the terms on its diagonal. [N/m], [N m/rad]
    """
    ends, count = pairs(suspension), len(suspension.body_names)
    movement_1 = point_movement(arms[..., ends.line, ends.row, :])  # B_1, (..., p, 3, 6)
    one_end_twice = np.array_equal(ends.row, ends.column)  # in all pairs
    movement_2 = movement_1 if one_end_twice else point_movement(arms[..., ends.line, ends.column, :])
    force_by_2 = stiffness @ movement_2  # K B_2
    lead, sums = movement_1.shape[:-3], []
    for run, body_pairs, per_pair in ends.runs:
        shape = *lead, body_pairs, 3 * per_pair, 6  # all of the same two bodies one below the other
        left, right = (moved[..., run, :, :].reshape(shape) for moved in (movement_1, force_by_2))
        sums.append(np.swapaxes(left, -1, -2) @ right)
    matrices = np.concatenate(sums, axis=-3) if sums else np.zeros((*lead, 0, 6, 6))
    # sizes of the terms on the diagonal of each body, by the pairs of ends that it holds both, body by body
    owner = suspension.owner[ends.line, ends.row]
    same_body = np.flatnonzero(owner == suspension.owner[ends.line, ends.column])
    same_body = same_body[np.argsort(owner[same_body], kind="stable")]
    products = movement_1 * force_by_2
    diagonal = np.abs(products[..., 0, :] + products[..., 1, :] + products[..., 2, :])
    return matrices, on_bodies(diagonal.take(same_body, axis=-2), owner[same_body], count)


def wrenches(arms, forces):
    """Forces at the ends of arms as forces and moments about the other ends: [F; r x F], shape (..., 6)."""
    return np.concatenate([forces, cross(arms, forces)], axis=-1)


def held_ends(suspension):
    """Cable (or link), end and body of each end that a body holds, body by body: 3 ndarrays of int, shape (e,)."""
    cable, end = np.nonzero(suspension.owner != GROUND)
    body = suspension.owner[cable, end]
    order = np.argsort(body, kind="stable")
    return cable[order], end[order], body[order]


def on_bodies(values, body, count):
    """Sums of values over all that belong to each of `count` bodies.

    Parameters
    ----------
    values : ndarray, shape (..., e, k)
    body : ndarray of int, shape (e,)
        To which each value belongs, ascending.
    count : int

    Returns
    -------
    ndarray, shape (..., count, k)
    """
    total = np.zeros((*values.shape[:-2], count, values.shape[-1]))
    if len(body):
        first = np.flatnonzero(np.append(True, body[1:] != body[:-1]))  # of the values of each body
        total[..., body[first], :] = np.add.reduceat(values, first, axis=-2)
    return total


def by_body(suspension, cables, values):
    """Forces of each of some cables on the free degrees of freedom of all bodies, from those at its two ends.

    Parameters
    ----------
    suspension : SuspendedSystem
        With d free degrees of freedom.
    cables : ndarray of int, shape (s,)
        Indices of the cables.
    values : ndarray, shape (n, s, 2, 6)
        Force and moment of each of them at each end in n cases, about the reference point of the body that holds the
        end. Derivatives are collected alike: of these forces, or of a quantity of the cable by displacement and
        rotation of that body. Ends at the ground are left out.

    Returns
    -------
    ndarray, shape (n, s, d)
        For each cable by itself; zero for bodies that it does not join.
    """
    owner = suspension.owner[cables]
    cable, end = np.nonzero(owner != GROUND)
    total = np.zeros((*values.shape[:2], *suspension.free.shape))
    np.add.at(total, (slice(None), cable, owner[cable, end]), values[:, cable, end])
    return free_values(suspension, total)


def weights(suspension, rotation):
    """Arm of the center of mass and weight of each body, global axes, shape (..., b, 3). [m], [N]"""
    arm = times(rotation, suspension.center)
    down = -suspension.mass * np.asarray(suspension.gravity)[..., None]
    return arm, down[..., None] * np.array([0.0, 0.0, 1.0])


def eccentric(suspension, rotation):
    """Sum of r F^T of dead loads away from the reference point of each body, shape (..., b, 3, 3), or None. [N m]"""
    loads = suspension.eccentric_loads
    return None if loads is None else (rotation[..., None] * loads[..., None, :, :]).sum(axis=-2)


def _moment_from_outer_product(outer):
    """Sum of r x F, shape (..., 3), from the sum of r F^T, shape (..., 3, 3). [N m]"""
    difference = outer - np.swapaxes(outer, -1, -2)
    return np.stack([difference[..., 1, 2], difference[..., 2, 0], difference[..., 0, 1]], axis=-1)


def net_forces(suspension, rotation, arms, end_forces, tension):
    """Net force and moment on each body, zero in equilibrium, and a scale to judge them by.

    Parameters
    ----------
    suspension : SuspendedSystem
        With b bodies and points, c cables and l links; their weights, dead forces and dead moments.
    rotation : ndarray, shape (..., b, 3, 3)
        Rotation matrix of each body.
    arms : ndarray, shape (..., c + l, 2, 3)
        Vector from the reference point of the body to each end of the cables and links, global axes. [m]
    end_forces : ndarray, shape (..., c + l, 2, 3)
        Force of the cable or link on what holds this end, global axes. [N]
    tension : ndarray, shape (..., c)
        Largest tension in each cable, for the scale. [N]

    Returns
    -------
    net : ndarray, shape (..., b, 6)
        Force [N] and moment about the reference point of the body [N m].
    scale : ndarray, shape (..., b)
        Sum of the sizes of weight and dead force and of the tensions of the cables and links on the body. [N]
    """
    center, weight = weights(suspension, rotation)
    moment = suspension.moment + cross(center, weight)
    eccentricity = eccentric(suspension, rotation)
    moment = moment if eccentricity is None else moment + _moment_from_outer_product(eccentricity)
    cable, end, body = held_ends(suspension)
    force, arm = end_forces[..., cable, end, :], arms[..., cable, end, :]
    if suspension.link_names:
        tension = joined(tension, size(end_forces[..., len(suspension.cable_names) :, 0, :]), -1)
    of_ends = np.concatenate([wrenches(arm, force), tension[..., cable, None]], axis=-1)
    by_ends = on_bodies(of_ends, body, moment.shape[-2])
    net = by_ends[..., :6] + np.concatenate([weight + suspension.force, moment], axis=-1)
    return net, by_ends[..., 6] + (size(weight) + size(suspension.force))


def stiffness_blocks(suspension, rotation, arms, end_forces, end_stiffness):
    """Tangent stiffness of the bodies, for held degrees of freedom too, as a sum of 6x6 blocks.

    As in the module's docstring: B_1^T K B_2 of cables and links for each pair of bodies, then for each body the sum of
    (r.F) I - r F^T over its loads F, which are forces of cables and links, weight and dead loads.

    Parameters
    ----------
    suspension : SuspendedSystem
        With b bodies and points, c cables and l links.
    rotation : ndarray, shape (..., b, 3, 3)
        Rotation matrix of each body.
    arms : ndarray, shape (..., c + l, 2, 3)
        Vector r from the reference point of the body to each end of the cables and links, global axes. [m]
    end_forces : ndarray, shape (..., c + l, 2, 3)
        Force F of the cable or link on what holds this end, global axes. [N]
    end_stiffness : ndarray, shape (..., c + l, 3, 3)
        K of end 2 of each cable and link, end 1 fixed, global axes. [N/m]

    Returns
    -------
    Blocks
        One for each pair of bodies that a cable or link joins, a body with itself too, then one for each body.
    """
    ends = pairs(suspension)
    sign = np.where(ends.row == ends.column, 1.0, -1.0)[:, None, None]
    between, sizes = between_bodies(suspension, sign * end_stiffness[..., ends.line, :, :], arms)
    outer, sum_of_sizes = _loads_at_arms(suspension, rotation, arms, end_forces)
    by_rotation = np.trace(outer, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - outer  # sum of (r.F) I - r F^T
    leading = np.broadcast_shapes(between.shape[:-3], outer.shape[:-3])
    count, bodies = between.shape[-3], outer.shape[-3]
    matrices = np.zeros((*leading, count + bodies, 6, 6))
    matrices[..., :count, :, :], matrices[..., count:, 3:, 3:] = between, by_rotation
    by_forces = np.zeros((*leading, bodies, 6))
    by_forces[..., 3:] = np.abs(np.diagonal(by_rotation, axis1=-2, axis2=-1)) + sum_of_sizes[..., None]
    rows = np.concatenate([ends.row_body, np.arange(bodies)])
    columns = np.concatenate([ends.column_body, np.arange(bodies)])
    return Blocks(rows, columns, matrices, np.broadcast_to(sizes, by_forces.shape), by_forces)


def _loads_at_arms(suspension, rotation, arms, end_forces):
    """Sums over all loads F on each of b bodies, at arms r: forces of cables and links, weight and dead loads.

    Parameters are those of `stiffness_blocks`. The sums are r F^T, shape (..., b, 3, 3), and |r| |F|, shape (..., b),
    which bounds the rounding of the first. [N m]
    """
    center, weight = weights(suspension, rotation)
    cable, end, body = held_ends(suspension)
    force, arm = end_forces[..., cable, end, :], arms[..., cable, end, :]
    outer_of_ends = (arm[..., :, None] * force[..., None, :]).reshape(*force.shape[:-1], 9)
    sizes_of_ends = (size(force) * size(arm))[..., None]
    by_ends = on_bodies(np.concatenate([outer_of_ends, sizes_of_ends], axis=-1), body, center.shape[-2])
    outer = by_ends[..., :9].reshape(*by_ends.shape[:-1], 3, 3) + center[..., :, None] * weight[..., None, :]
    sum_of_sizes = by_ends[..., 9] + size(weight) * size(center)
    eccentricity = eccentric(suspension, rotation)
    if eccentricity is None:
        return outer, sum_of_sizes
    return outer + eccentricity, sum_of_sizes + np.sqrt((eccentricity**2).sum(axis=(-1, -2)))


def body_sizes(suspension):
    """Length that makes a rotation of each body comparable with a displacement, shape (n, b). [m]

    The root mean square distance of the ends of cables and links on the body from its reference point, or the distance
    of its center of mass if that is larger; 1 m where both are zero.
    """
    count = len(suspension.body_names)
    cable, end, body = held_ends(suspension)
    arms = suspension.attachment[..., cable, end, :]
    total = on_bodies(dot(arms, arms)[..., None], body, count)[..., 0]
    square = total / np.maximum(np.bincount(body, minlength=count), 1)
    square = np.maximum(square, dot(suspension.center, suspension.center))
    return np.where(square > 0, np.sqrt(square), 1.0)


def motion_units(suspension):
    """Units that make all motions of bodies comparable, shape (n, b, 6): 1, and `body_sizes` of rotations. [-], [m]"""
    units = np.ones((*suspension.position.shape[:-1], 6))
    units[..., 3:] = body_sizes(suspension)[..., None]
    return units
