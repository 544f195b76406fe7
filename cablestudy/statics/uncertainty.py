"""Uncertainty of an equilibrium: displacements and changes of tension due to rounding of forces, lengths and values.

Where rounding alone moves a body far, nothing determines its position, and the equilibrium found is no answer.

With K the stiffness on the free degrees of freedom of cables that keep what they state (a length, or a tension that
their length follows), g the net forces that the search left, and b changes of them due to rounding, the position is
known to K^-1 (g + b). The sum of all b is sampled: each has its size and a random sign, and the root mean square of
some samples is taken.

Bodies may be in equilibrium exactly where the description puts them. The cables then are taken as cut to length for
these positions: their uncertainty is that at known lengths, even where the stated tensions balance elsewhere too.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.vectors import largest, size
from cablestudy.statics import block_stiffness, rounding, stated, tangent
from cablestudy.statics.links import joined
from cablestudy.statics.rigid import point_movement
from cablestudy.statics.stability import MOTIONS
from cablestudy.statics.tolerances import STATICS

LENGTH = 2 * STATICS.rounding  # rounding of a length, relative


@dataclass(frozen=True)
class Uncertainty:
    """Changes due to rounding; all of them `unknown` where there is no equilibrium.

    Attributes
    ----------
    pose : ndarray, shape (..., b, 6)
        Displacement [m] and rotation [rad] of each body.
    tension : ndarray, shape (..., c)
        Change of the tension of each cable over its largest tension; 0 without tension. [-]
    force : ndarray, shape (..., l)
        Change of the force of each link. [N]
    longest : ndarray, shape (...)
        `Equilibrium.longest`. [m]
    body_names : tuple of str
    """

    pose: np.ndarray
    tension: np.ndarray
    force: np.ndarray
    longest: np.ndarray
    body_names: tuple

    @cached_property
    def relative(self):
        """Displacements over the longest chord, and rotations, shape (..., b, 6). [-], [rad]"""
        lengths = np.ones((*self.longest.shape, 6))
        lengths[..., :3] = self.longest[..., None]
        return self.pose / lengths[..., None, :]

    @cached_property
    def determined(self):
        """True where no displacement or rotation of `relative` is larger than `STATICS.undetermined`, shape (...)."""
        return largest(self.relative).max(axis=-1, initial=0.0) <= STATICS.undetermined

    def reason(self, case=()):
        """Reason why the positions in one case are not determined, for a message; an empty string where they are."""
        if self.determined[case]:
            return ""
        body, motion = divmod(int(self.relative[case].argmax()), 6)
        return (
            f"nothing determines {self.body_names[body]} {MOTIONS[motion]}: with what the cables state the forces "
            "balance in other places too, except for rounding; state an unstretched_length of a cable that leads there"
        )


def uncertainty_of(equilibrium):
    """`Uncertainty` of an equilibrium or a batch."""
    suspension, cables = equilibrium.suspension, equilibrium.catenary
    with np.errstate(all="ignore"):  # of cases that have no equilibrium
        pose, change = _changes_by_rounding(equilibrium)
    converged = np.asarray(equilibrium.record.converged)[..., None]

    def bounded(values, converged):
        """Values where there is an equilibrium, no larger than `STATICS.unknown`; `STATICS.unknown` elsewhere."""
        finite = np.minimum(np.nan_to_num(values, nan=STATICS.unknown), STATICS.unknown)
        return np.where(converged, finite, STATICS.unknown)

    tension, force = np.split(change, [len(suspension.cable_names)], axis=-1)
    tension = bounded(np.where(cables.max_tension > 0, tension, 0.0), converged)
    pose, force = bounded(pose, converged[..., None]), bounded(force, converged)
    return Uncertainty(pose, tension, force, equilibrium.longest, suspension.body_names)


def _changes_by_rounding(equilibrium):
    """Estimate how far rounding moves an equilibrium: positions of bodies, tensions, and forces of links (springs).

    Random samples have rounding errors of full size and random sign, which change the net forces on the bodies by b.
    The displacements are K^-1 b, with the stiffness K of cables that keep their stated tensions, sags or lengths. The
    result is the root mean square of the samples. One more sample, the last, has the net forces and errors of stated
    values that the search has left: `STATICS.curved` times its size is added.

    Returns
    -------
    displacement : ndarray, shape (..., b, 6)
        Displacement [m] and rotation [rad] of each body.
    change : ndarray, shape (..., c + l)
        Change of each tension over the largest tension of the cable [-], and of the force of each link [N].
    """
    suspension, cables = equilibrium.suspension, equilibrium.catenary
    kinds = tuple(kind or "unstretched_length" for kind in suspension.stated)
    force_changes, length_known = _force_changes(equilibrium, kinds)
    stiffness, end_forces = force_changes[..., :3], force_changes[..., 3]  # by end 2; by a relative change
    net, net_rounding, error, value_rounding = _residuals(equilibrium, kinds, length_known)
    generator = np.random.default_rng(STATICS.seed)
    body_signs = generator.choice([-1.0, 1.0], size=(STATICS.samples, *suspension.free.shape))
    cable_signs = generator.choice([-1.0, 1.0], size=(STATICS.samples, len(kinds)))
    # samples on the last axis: relative changes of stated values, and of the forces of links with their lengths; and
    # the net force on each body, its own rounding or residual
    changes = np.concatenate([cable_signs.T * value_rounding[..., None], -error[..., None]], axis=-1)
    forces = np.concatenate([np.moveaxis(body_signs, 0, -1) * net_rounding[..., None], net[..., None]], axis=-1)
    if suspension.link_names:
        stiffness, end_forces, changes = _with_links(equilibrium, stiffness, end_forces, changes, generator)
    forces += _on_bodies(equilibrium, end_forces, changes)
    tension = end_forces[..., 1, :, None] * changes[..., None, :]  # at end 2, (..., c + l, 3, samples + 1)
    displacement = np.zeros(forces.shape)
    if suspension.free.any():
        displacement = _displacements(_blocks(equilibrium, stiffness, length_known), suspension, forces)
        tension += stiffness[..., 1, :, :] @ _end_movements(equilibrium, displacement)
    unit = np.maximum(cables.max_tension, STATICS.tiny)
    unit = joined(unit, equilibrium.links and np.ones_like(equilibrium.links.extension), -1)
    return _rms(displacement), _rms(size(np.swapaxes(tension, -1, -2)) / unit[..., None])


def _on_bodies(equilibrium, end_forces, changes):
    """Forces and moments on each body by relative changes of cables and links in k samples, shape (..., b, 6, k).

    `end_forces`, shape (..., c + l, 2, 3), are per relative change; `changes` have the shape (..., c + l, k).
    """
    cable, end, body = tangent.held_ends(equilibrium.suspension)
    wrenches = tangent.wrenches(equilibrium.arms[..., cable, end, :], end_forces[..., cable, end, :])
    of_ends = wrenches[..., None] * changes[..., cable, None, :]
    flat = of_ends.reshape(*of_ends.shape[:-2], 6 * changes.shape[-1])
    by_body = tangent.on_bodies(flat, body, len(equilibrium.suspension.body_names))
    return by_body.reshape(*by_body.shape[:-1], 6, changes.shape[-1])


def _end_movements(equilibrium, displacement):
    """Movement of end 2 of each cable and link away from end 1, shape (..., c + l, 3, k), in k samples. [m]

    `displacement`, shape (..., b, 6, k), is that of the bodies.
    """
    (cable, end, body), (*lead, _, _, samples) = tangent.held_ends(equilibrium.suspension), displacement.shape
    movements = np.zeros((*lead, len(equilibrium.suspension.owner), 2, 3, samples))
    of_ends = point_movement(equilibrium.arms[..., cable, end, :]) @ displacement.take(body, axis=-3)
    movements[..., cable, end, :, :] = of_ends
    return movements[..., 1, :, :] - movements[..., 0, :, :]


def _displacements(blocks, suspension, forces):
    """Static displacements of all b bodies by forces on them, zero where they are held, shape (..., b, 6, k) both."""
    freedoms = np.flatnonzero(suspension.free)
    displacement = np.zeros((*forces.shape[:-3], suspension.free.size, forces.shape[-1]))
    free_forces = forces.reshape(displacement.shape).take(freedoms, axis=-2)
    displacement[..., freedoms, :] = block_stiffness.displacements(blocks, suspension, free_forces)
    return displacement.reshape(forces.shape)


def _force_changes(equilibrium, kinds):
    """Changes of the end forces of all cables by the position of end 2 and by length or stated value.

    They have the shape (..., c, 2, 3, 4), see `stated.force_changes_at_stated_values`; at fixed length where the length
    is known, as the second result says, shape (..., c): it is stated, or bodies that have not moved show that it is
    known.
    """
    cables, length_stated = equilibrium.catenary, np.array([kind == "unstretched_length" for kind in kinds], dtype=bool)
    length_known = _has_not_moved(equilibrium)[..., None] | length_stated
    force_changes = stated.force_changes_at_stated_values(cables, kinds)
    if (length_known & ~length_stated).any():
        at_given_lengths = stated.force_changes_at_stated_values(cables, ("unstretched_length",) * len(kinds))
        force_changes = np.where(length_known[..., None, None, None], at_given_lengths, force_changes)
    return force_changes, length_known


def _with_links(equilibrium, stiffness, end_forces, changes, generator):
    """Append the l links (springs) to the arrays of c cables from which `_changes_by_rounding` finds its result.

    These are the `stiffness`, force on each end per movement of end 2, shape (..., c, 2, 3, 3) [N/m]; `end_forces`,
    their changes by a relative change of the stated value, (..., c, 2, 3) [N], for links by one of their lengths and
    positions; and `changes`, relative changes of the stated values in each sample of rounding and in the last one,
    which has what the search has left, (..., c, samples + 1): zero for links. The `generator` draws the signs of the
    rounding of links.
    """
    links, ends = equilibrium.links, equilibrium.ends[..., len(equilibrium.suspension.cable_names) :, :, :]
    least, most = rounding.of_link_forces(ends, links)
    sign = generator.choice([-1.0, 1.0], size=(STATICS.samples + 1, least.shape[-1]))
    sign[-1] = 0.0  # the last sample is that of the residuals
    # force per relative rounding of lengths and positions: stiffness times these
    force = (most - least)[..., None] * links.direction
    link_stiffness = np.stack([links.end_stiffness, -links.end_stiffness], axis=-3)
    of_links = np.stack([-force, force], axis=-2)
    changes_of_links = np.broadcast_to(LENGTH * sign.T, (*least.shape, len(sign)))
    return joined(stiffness, link_stiffness, -4), joined(end_forces, of_links), joined(changes, changes_of_links, -2)


def _rms(samples):
    """Root mean square of the samples by rounding, plus a multiple of the size of the last sample, by the residuals."""
    return np.sqrt((samples[..., :-1] ** 2).mean(axis=-1)) + STATICS.curved * np.abs(samples[..., -1])


def _has_not_moved(equilibrium):
    """True for cases in which all bodies are where the search began, within `STATICS.stayed`, shape (...)."""
    suspension, longest = equilibrium.suspension, equilibrium.longest
    distance = largest(equilibrium.position - suspension.position).max(axis=-1, initial=0.0) / longest
    turn = np.abs(equilibrium.rotation - suspension.rotation).max(axis=(-1, -2, -3), initial=0.0)
    return np.maximum(distance, turn) <= STATICS.stayed


def _residuals(equilibrium, quantities, length_known):
    """Net forces on bodies and errors of stated values that the search for an equilibrium has left, and their rounding.

    Parameters
    ----------
    equilibrium : Equilibrium
    quantities : sequence of str
        Of each of c cables the quantity that the scene states: its unstretched length, a tension or a sag.
    length_known : ndarray of bool, shape (..., c)
        True if the length is given, so that no stated value had to be met.

    Returns
    -------
    net, net_rounding : ndarray, shape (..., b, 6)
        Net force and moment on each body, zero in exact equilibrium; and the size of its rounding. [N], [N m]
    error, value_rounding : ndarray, shape (..., c)
        Actual over stated value of each cable, minus 1, zero where the length is known; and the relative rounding of
        the stated value, or of the length where it is known. [-]
    """
    suspension, cables, arms, ends = equilibrium.suspension, equilibrium.catenary, equilibrium.arms, equilibrium.ends
    strain, tension = np.asarray(cables.span.chord_strain), cables.max_tension
    net, _ = tangent.net_forces(suspension, equilibrium.rotation, arms, equilibrium.end_forces, tension)
    bounds = rounding.bounds(suspension, equilibrium.rotation, arms, ends, strain, cables, tension, equilibrium.links)
    ends = ends[..., suspension.of_cables, :, :]
    of_values = rounding.of_stated(ends, strain, cables, quantities, suspension.value).least
    of_lengths = LENGTH * (1 + largest(largest(ends)) / cables.span.chord)
    error = np.where(length_known, 0.0, stated.actual_values(cables, quantities) / suspension.value - 1)
    return net, bounds.least, error, np.where(length_known, of_lengths, of_values)


def _blocks(equilibrium, end_stiffness, length_known):
    """`block_stiffness.Blocks` of the suspension with cables that keep what they state, see `_with_links`."""
    suspension, blocks = equilibrium.suspension, equilibrium.blocks
    if length_known.all():
        return blocks
    ends = tangent.pairs(suspension)
    sign = np.where(ends.column == 1, -1.0, 1.0)[:, None, None]
    stiffness = sign * end_stiffness[..., ends.line, ends.row, :, :]
    between, sizes = tangent.between_bodies(suspension, stiffness, equilibrium.arms)
    matrices = np.concatenate([between, blocks.matrices[..., between.shape[-3] :, :, :]], axis=-3)
    return replace(blocks, matrices=matrices, by_ends=sizes)
