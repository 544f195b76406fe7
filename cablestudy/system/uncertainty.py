"""How well an equilibrium is determined: what the rounding of forces, lengths and stated values moves it by.

With K the stiffness on the free degrees of freedom of cables that keep what they state (a length, or a tension that
their length follows), g what is left of the net forces, and b changes by rounding, the place is known to K^-1 (g + b).
The sum of all b is sampled: each has its size and a random sign, and the root mean square of some samples is taken.

Where bodies stay where the description puts them, since what it states balances there, lengths are cut for these places
and the places are known with them, also where the tensions would balance in other places too.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.system import rounding, stated, tangent
from cablestudy.system.links import joined
from cablestudy.system.rigid import at_attachments, size
from cablestudy.system.tolerances import SYSTEM

LENGTH = 2 * SYSTEM.rounding  # rounding of a length, relative
MOTIONS = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Uncertainty:
    """Changes by rounding; all of them `unknown` where there is no equilibrium.

    Attributes
    ----------
    place : ndarray, shape (..., b, 6)
        Displacement [m] and rotation [rad] of each body.
    tension : ndarray, shape (..., c)
        Change of the tension of each cable over its largest tension; 0 without tension. [-]
    force : ndarray, shape (..., l)
        Change of the force of each link. [N]
    longest : ndarray, shape (...)
        `Equilibrium.longest`. [m]
    body_names : tuple of str
    """

    place: np.ndarray
    tension: np.ndarray
    force: np.ndarray
    longest: np.ndarray
    body_names: tuple

    @cached_property
    def relative(self):
        """Displacements over the longest chord, and rotations, shape (..., b, 6). [-], [rad]"""
        lengths = np.ones((*self.longest.shape, 6))
        lengths[..., :3] = self.longest[..., None]
        return self.place / lengths[..., None, :]

    @cached_property
    def determined(self):
        """True where the places are answers, shape (...)."""
        return self.relative.max(axis=(-1, -2), initial=0.0) <= SYSTEM.undetermined

    def reason(self, case=()):
        """Why the place of one case is no answer; an empty string where it is one."""
        if self.determined[case]:
            return ""
        body, motion = divmod(int(self.relative[case].argmax()), 6)
        return (
            f"nothing determines {self.body_names[body]} {MOTIONS[motion]}: with what the cables state the forces "
            "balance in other places too, but for rounding; state an unstretched_length of a cable that leads there"
        )


def uncertainty_of(equilibrium):
    """`Uncertainty` of an equilibrium or a batch."""
    suspension, cables = equilibrium.suspension, equilibrium.catenary
    with np.errstate(all="ignore"):  # of cases that have no equilibrium
        place, change = _sampled(equilibrium)
    solved = np.asarray(equilibrium.record.converged)[..., None]
    tension, force = np.split(change, [len(suspension.cable_names)], axis=-1)
    tension = np.where(cables.max_tension > 0, tension, 0.0)
    place = np.where(
        solved[..., None], np.minimum(np.nan_to_num(place, nan=SYSTEM.unknown), SYSTEM.unknown), SYSTEM.unknown
    )
    tension = np.where(solved, np.minimum(np.nan_to_num(tension, nan=SYSTEM.unknown), SYSTEM.unknown), SYSTEM.unknown)
    force = np.where(solved, np.minimum(np.nan_to_num(force, nan=SYSTEM.unknown), SYSTEM.unknown), SYSTEM.unknown)
    return Uncertainty(place, tension, force, equilibrium.longest, suspension.body_names)


def _sampled(equilibrium):
    """Root mean square of the samples, with what is left added: of places, tensions and forces of links.

    Returns
    -------
    moved : ndarray, shape (..., b, 6)
        [m], [rad]
    change : ndarray, shape (..., c + l)
        Of each tension over the largest one of the cable [-], of each force [N].
    """
    suspension, cables, arms = equilibrium.suspension, equilibrium.catenary, equilibrium.arms
    given = tuple(kind or "unstretched_length" for kind in suspension.given)
    lengths = np.array([kind == "unstretched_length" for kind in given], dtype=bool)
    cut, answers = _stayed(equilibrium)[..., None] | lengths, stated.kept(cables, given)
    if (cut & ~lengths).any():
        fixed = stated.kept(cables, ("unstretched_length",) * len(given))
        answers = np.where(cut[..., None, None, None], fixed, answers)
    net, bounds, error, rounded = _left(equilibrium, given, cut)
    free = suspension.free
    signs = np.random.default_rng(SYSTEM.seed)
    on_bodies = signs.choice([-1.0, 1.0], size=(SYSTEM.samples, *free.shape))
    on_cables = signs.choice([-1.0, 1.0], size=(SYSTEM.samples, len(given)))
    changes = np.concatenate([on_cables * rounded[..., None, :], -error[..., None, :]], axis=-2)
    pulled = answers[..., None, :, :, :, 3] * changes[..., None, None]  # (..., samples, c, 2, 3)
    answers = answers[..., :, :, :3]
    if suspension.link_names:
        answers, pulled = _with_links(equilibrium, answers, pulled, signs)
    forces = np.concatenate([on_bodies * bounds[..., None, :, :], net[..., None, :, :]], axis=-3)
    cable, end = np.nonzero(suspension.owner != tangent.GROUND)
    body = suspension.owner[cable, end]
    held = arms[..., None, cable, end, :]
    acting = tangent.wrenches(held, pulled[..., cable, end, :])
    for place, owner in enumerate(body.tolist()):
        forces[..., owner, :] += acting[..., place, :]
    moved, pulled = np.zeros(forces.shape), pulled[..., 1, :]
    if free.any():
        moved[..., free] = _solved(suspension, _blocks(equilibrium, answers), tangent.free_values(suspension, forces))
        ends = np.zeros((*pulled.shape[:-1], 2, 3))
        ends[..., cable, end, :] = moved[..., body, :3] + np.cross(moved[..., body, 3:], held)
        along = (ends[..., 1, :] - ends[..., 0, :])[..., None]
        pulled = pulled + (answers[..., None, :, 1, :, :] @ along)[..., 0]
    unit = np.maximum(cables.max_tension, SYSTEM.tiny)
    unit = joined(unit, equilibrium.links and np.ones_like(equilibrium.links.extension), -1)
    return _rms(moved, -3), _rms(size(pulled) / unit[..., None, :], -2)


def _with_links(equilibrium, answers, pulled, signs):
    """Answers of all ends to movements, and forces at them by rounding of lengths in each sample, those of links too.

    Parameters
    ----------
    equilibrium : Equilibrium
    answers : ndarray, shape (..., c, 2, 3, 3)
    pulled : ndarray, shape (..., samples + 1, c, 2, 3)
    signs : numpy.random.Generator
    """
    links, ends = equilibrium.links, equilibrium.ends[..., len(equilibrium.suspension.cable_names) :, :, :]
    least, most = rounding.of_springs(ends, links)
    change = (
        LENGTH * signs.choice([-1.0, 1.0], size=(SYSTEM.samples + 1, least.shape[-1])) * (most - least)[..., None, :]
    )
    change[..., -1, :] = 0.0  # that is what is left
    force = change[..., None] * links.direction[..., None, :, :]
    stiffness = np.stack([links.end_stiffness, -links.end_stiffness], axis=-3)
    return joined(answers, stiffness, -4), joined(pulled, np.stack([-force, force], axis=-2))


def _rms(samples, axis):
    """Root mean square of all samples but the last along an axis, and what is left, the last one."""
    samples = np.moveaxis(np.abs(samples), axis, 0)
    return np.sqrt((samples[:-1] ** 2).mean(axis=0)) + SYSTEM.curved * samples[-1]


def _stayed(equilibrium):
    """Whether all bodies are where the search began, shape (...)."""
    suspension, longest = equilibrium.suspension, equilibrium.longest
    moved = np.abs(equilibrium.position - suspension.position).max(axis=(-1, -2), initial=0.0) / longest
    turned = np.abs(equilibrium.rotation - suspension.rotation).max(axis=(-1, -2, -3), initial=0.0)
    return np.maximum(moved, turned) <= SYSTEM.stayed


def _left(equilibrium, given, cut):
    """Net forces that are left and their rounding (..., b, 6), errors of stated values and their rounding (..., c)."""
    suspension, cables, arms, ends = equilibrium.suspension, equilibrium.catenary, equilibrium.arms, equilibrium.ends
    strain = np.asarray(cables.span.chord_strain)
    net, _ = tangent.net_forces(suspension, equilibrium.rotation, arms, equilibrium.end_forces, cables.max_tension)
    known = strain, cables, cables.max_tension, equilibrium.links
    least = rounding.bounds(suspension, equilibrium.rotation, arms, ends, *known).least
    ends = ends[..., suspension.of_cables, :, :]
    own = rounding.of_values(ends, strain, cables, given, suspension.value).least
    of_length = LENGTH * (1 + np.abs(ends).max(axis=(-1, -2)) / cables.span.chord)
    error = np.where(cut, 0.0, stated.values(cables, given) / suspension.value - 1)
    return net, least, error, np.where(cut, of_length, own)


def _blocks(equilibrium, answers):
    """`tangent.Blocks` of cables that keep what they state."""
    suspension, arms, blocks = equilibrium.suspension, equilibrium.arms, equilibrium.blocks
    cable, row, column = tangent.pairs(suspension)
    sign = np.where(column == 1, -1.0, 1.0)[:, None, None]
    stiffness = sign * answers[..., cable, row, :, :]
    between = at_attachments(stiffness, arms[..., cable, row, :], arms[..., cable, column, :])
    matrices = np.concatenate([between, blocks.matrices[..., len(cable) :, :, :]], axis=-3)
    return tangent.Blocks(blocks.rows, blocks.columns, matrices, blocks.leverage)


def _solved(suspension, blocks, forces):
    """Displacements of the free degrees of freedom by forces on them, both of shape (..., samples, d)."""
    scales = np.sqrt(np.maximum(tangent.magnitudes(blocks, suspension), SYSTEM.tiny))
    right = np.swapaxes(forces / scales[..., None, :], -1, -2)
    solution = np.full(right.shape, np.inf)
    if scales.shape[-1] <= SYSTEM.dense_freedoms:
        matrices = tangent.scaled_dense(blocks, suspension, scales)
        usable = np.isfinite(matrices).all(axis=(-1, -2)) & np.isfinite(right).all(axis=(-1, -2))
        solution[usable] = _dense_solutions(matrices[usable], right[usable])
    else:
        from scipy.sparse.linalg import splu

        for case in np.ndindex(scales.shape[:-1]):
            matrix = tangent.scaled_sparse(blocks.of(case), suspension, scales[case])
            solution[case] = _one(matrix, right[case], lambda m, r: splu(m).solve(r))
    return np.swapaxes(solution, -1, -2) / scales[..., None, :]


def _dense_solutions(matrices, right):
    """Those of some cases, shape (m, d, samples); infinite where a matrix is singular."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:  # of one of them
        pairs = zip(matrices, right, strict=True)
        return np.array([_one(matrix, vectors, np.linalg.solve) for matrix, vectors in pairs])


def _one(matrix, right, solve):
    try:
        return solve(matrix, right)
    except (np.linalg.LinAlgError, RuntimeError):  # singular: nothing holds some motion
        return np.full(right.shape, np.inf)
