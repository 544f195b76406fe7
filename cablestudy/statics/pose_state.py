"""A pose of a suspension whose cables have known lengths: where all ends are, and forces, stiffness and energy there.

Between ends at a distance d a cable with the tension vector N at mid-length has the energy

    W(d) = N.d - L (T_mean + (|N|^2 + (w L)^2/12)/(2 EA)),     dW/dd = N,     d2W/dd2 = K,

which is convex (W is the Legendre transform of the complementary energy). With half of each cable's weight as a dead
load on each of its ends, the potential energy of a suspension is the sum of W, of the springs' energies (`links`) and
of the dead loads' potentials.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.newton import STALLED as CABLE_STALLED
from cablestudy.cable.span import Span
from cablestudy.cable.vectors import dot, size, times
from cablestudy.statics import tangent
from cablestudy.statics.links import Links, joined
from cablestudy.statics.rigid import turn
from cablestudy.statics.rounding import bounds
from cablestudy.statics.tolerances import STATICS

EPSILON = 2 * STATICS.rounding


@dataclass(frozen=True)
class PoseState:
    """A pose of n cases, with what a search carries from step to step so that no digits are lost.

    There are b bodies and points, c cables and l links.

    Attributes
    ----------
    position, rotation : ndarray, shape (n, b, 3), (n, b, 3, 3)
        Reference point of each body [m], and its rotation matrix.
    arms, ends : ndarray, shape (n, c + l, 2, 3)
        Both ends of each cable and link: vector from the reference point of the body that holds the end, and from the
        origin; global axes. [m]
    vector : ndarray, shape (n, c + l, 3)
        From end 1 to end 2. [m]
    length, strain : ndarray, shape (n, c)
        Unstretched length of each cable [m], and the distance of its ends over it, minus 1 [-].
    extension : ndarray, shape (n, l)
        Of the links: distance of their ends less their length. [m]
    tension : ndarray, shape (n, c, 3)
        Tension vector of each cable at mid-length, global axes; NaN where it is not known. [N]
    """

    position: np.ndarray
    rotation: np.ndarray
    arms: np.ndarray
    ends: np.ndarray
    vector: np.ndarray
    length: np.ndarray
    strain: np.ndarray
    extension: np.ndarray
    tension: np.ndarray

    @property
    def chord(self):
        """From end 1 to end 2 of each cable, shape (n, c, 3). [m]"""
        return self.vector[:, : self.length.shape[-1]]


@dataclass(frozen=True)
class Evaluation:
    """Forces, stiffness and energy of a suspension in one `PoseState`: n cases, b bodies and points, c cables, l links.

    Attributes
    ----------
    net : ndarray, shape (n, b, 6)
        Force and moment of all loads on each body. [N], [N m]
    scale : ndarray, shape (n, b)
        Sum of the sizes of the forces on each body. [N]
    least_rounding, most_rounding : ndarray, shape (n, b, 6)
        Rounding of `net`: `least` and `most` of `rounding.Bounds`. [N], [N m]
    energy, energy_rounding : ndarray, shape (n,)
        Energy of the cables (W of the module's docstring) and links, and its rounding. [J]
    end_forces : ndarray, shape (n, c + l, 2, 3)
        Force of each cable and link on what holds its two ends, global axes. [N]
    end_stiffness : ndarray, shape (n, c + l, 3, 3)
        Stiffness of end 2, end 1 fixed, of each cable and link, global axes. [N/m]
    tension : ndarray, shape (n, c, 3)
        Tension vector of each cable at mid-length, global axes. [N]
    solved : ndarray of bool, shape (n,)
        True where the equilibria of all cables were found, and all forces are finite.
    """

    net: np.ndarray
    scale: np.ndarray
    least_rounding: np.ndarray
    most_rounding: np.ndarray
    energy: np.ndarray
    energy_rounding: np.ndarray
    end_forces: np.ndarray
    end_stiffness: np.ndarray
    tension: np.ndarray
    solved: np.ndarray


def displaced(suspension, state, step):
    """State after a step; see `displaced_with_work`."""
    return displaced_with_work(suspension, state, step)[0] if suspension.body_names else state


def displaced_with_work(suspension, state, step):
    """State of a suspension after a step of its bodies, and the work of the constant loads along this step.

    Constant loads are the weights of the bodies, the dead forces and moments on them, and half of the load of each
    cable on each of its ends.

    Parameters
    ----------
    suspension : SuspendedSystem
        With b bodies, at least one.
    state : PoseState
        Before the step.
    step : ndarray, shape (n, b, 6)
        Displacements [m] and rotation vectors [rad] of the bodies.

    Returns
    -------
    state : PoseState
        After the step, with the same unstretched lengths; its tensions are not known and NaN.
    work : ndarray, shape (n,)
        [J]
    """
    rotation_change, shift = turn(step[..., 3:]), np.zeros(state.ends.shape)
    cable, end, body = tangent.held_ends(suspension)
    shift[:, cable, end] = step[:, body, :3] + times(rotation_change[:, body], state.arms[:, cable, end])
    rotation = state.rotation + rotation_change @ state.rotation
    position, arms = state.position + step[..., :3], suspension.arms(rotation)
    ends = arms.copy()
    ends[:, cable, end] += position[:, body]
    vector = ends[..., 1, :] - ends[..., 0, :]
    change = shift[..., 1, :] - shift[..., 0, :]
    # |d + change| - |d| without cancellation, so that the strain of a stiff cable keeps its digits
    lengthening = dot(2 * state.vector + change, change)
    lengthening /= np.maximum(size(vector) + size(state.vector), STATICS.tiny)
    cables = state.length.shape[-1]
    vector[:, cables:] = state.vector[:, cables:] + change[:, cables:]  # so that short links keep their digits
    strain = state.strain + lengthening[:, :cables] / state.length
    extension = state.extension + lengthening[:, cables:]
    unknown = np.full(state.tension.shape, np.nan)
    after = PoseState(position, rotation, arms, ends, vector, state.length, strain, extension, unknown)
    return after, _work(suspension, state, step, rotation_change, shift)


def spans(suspension, state):
    """Cables between their ends in a state: a `Span` of shape (n, c).

    Ends that nearly coincide, between which a cable has no direction, are taken as just apart, one above the other.
    """
    length, coincident = state.length, size(state.chord) <= STATICS.nearest_ends * state.length
    short_vertical = np.array([0.0, 0.0, -STATICS.nearest_ends]) * length[..., None]
    vector = np.where(coincident[..., None], short_vertical, state.chord)
    gravity, vertical = suspension.cable_gravity
    stiffness, mass = suspension.axial_stiffness, suspension.cable_mass
    loads = {}
    if suspension.load_forces is not None:
        loads = {"load_positions": suspension.load_positions, "load_forces": suspension.load_forces}
    span = Span.between(np.zeros(3), vector, stiffness, mass, gravity, vertical=vertical, **loads)
    if loads:
        span = replace(span, load_masses=suspension.load_masses, load_fractions=suspension.load_fractions).broadcast()
    return span.with_chord_strain(np.where(coincident, STATICS.nearest_ends - 1, state.strain))


def end_forces_and_stiffness(suspension, state, cables, stiffness):
    """Forces of cables and links at their ends, their end stiffness, both as in `Evaluation`, and the `Links` or None.

    Parameters
    ----------
    suspension : SuspendedSystem
    state : PoseState
    cables : Catenary
        Of shape (n, c).
    stiffness : ndarray, shape (n, c, 3, 3)
        Of end 2 of each cable. [N/m]
    """
    links = Links.of(suspension, state.vector[:, state.length.shape[-1] :], state.extension)
    forces = cables.end_forces("global")
    if links is None:
        return forces, stiffness, None
    return joined(forces, links.end_forces), joined(stiffness, links.end_stiffness), links


def evaluate(suspension, state, solved_cables=None):
    """Forces, stiffness and energy of a suspension whose bodies are in a given pose: `Evaluation`.

    The energy is that of the links (springs), and W of the module's docstring for each cable. With point loads N is the
    mean of the tension vectors at both ends, and |N|^2 + (w L)^2/12 the mean of their square along the cable.

    Parameters
    ----------
    suspension : SuspendedSystem
        Bodies on cables and links (springs).
    state : PoseState
        Pose and unstretched lengths, of n cases.
    solved_cables : Catenary, shape (n, c), optional
        Equilibria of the c cables in this pose, if they are known already; else they are computed.

    Returns
    -------
    Evaluation
        Net forces on the bodies and their rounding, the energy, and forces and stiffness at the ends of the cables.
    """
    cables = solved_cables or catenary.solve(spans(suspension, state), state.tension)
    span = cables.span
    forces, stiffness, links = end_forces_and_stiffness(suspension, state, cables, cables.global_end_stiffness)
    # a force is not known better than the rounding of a strain, also where all cables hang without tension
    tension_scale = np.maximum(cables.max_tension, EPSILON * span.axial_stiffness)
    net, scale = tangent.net_forces(suspension, state.rotation, state.arms, forces, tension_scale)
    rounding = bounds(suspension, state.rotation, state.arms, state.ends, state.strain, cables, tension_scale, links)
    # W of the module's docstring: N.d, T_mean and the strain energy, each over L
    along_chord, mean_square = _along_chord_and_mean_square(cables)
    length, tension = span.unstretched_length, cables.mean_tension
    strain_energy = mean_square / (2 * span.axial_stiffness)
    chord_work = along_chord * (1 + span.chord_strain)
    energy = length * (chord_work - tension - strain_energy)
    size_of_terms = length * (np.abs(chord_work) + tension + strain_energy)
    energy, size_of_terms = (joined(of_cables, links and links.energy, -1) for of_cables in (energy, size_of_terms))
    solved = cables.record.reason != CABLE_STALLED
    return Evaluation(
        net, scale, rounding.least, rounding.most, energy.sum(axis=-1), EPSILON * size_of_terms.sum(axis=-1),
        forces, stiffness, cables.middle_tension,
        solved.all(axis=-1) & np.isfinite(net).all(axis=(-1, -2)),
    )  # fmt: skip


def _along_chord_and_mean_square(cables):
    """Mean of the tension vectors at both ends along the chord [N], and the mean of |N(s)|^2 [N^2], shape (n, c)."""
    if cables.segments.fraction.shape[-1] == 1:  # without point loads
        q, n, y = (component[..., 0] for component in cables.tension)
        return q, q**2 + n**2 + y**2 + cables.span.weight**2 / 12
    ends = cables.end_forces()[..., 0]
    square = sum(component**2 for component in cables.tension) + cables.segments.weight**2 / 12
    return (ends[..., 0] - ends[..., 1]) / 2, (square * cables.segments.fraction).sum(axis=-1)


def _work(suspension, state, step, rotation_change, shift):
    """Work of the constant loads along a step of the bodies from a `PoseState`, shape (n,). [J]

    These are the weights of the bodies, the dead forces and moments on them, and half of the load of each cable (its
    weight, wind and point loads) on each of its ends. `step`, shape (n, b, 6), has displacements [m] and rotation
    vectors [rad]; `rotation_change`, shape (n, b, 3, 3), is the rotation matrix less I (`rigid.turn`). `shift`, shape
    (n, c + l, 2, 3), are the displacements of both ends of the c cables and l links [m].
    """
    center, weight = tangent.weights(suspension, state.rotation)
    center_shift = step[..., :3] + times(rotation_change, center)
    of_bodies = dot(weight, center_shift) + dot(suspension.force, step[..., :3]) + dot(suspension.moment, step[..., 3:])
    eccentricity = tangent.eccentric(suspension, state.rotation)
    if eccentricity is not None:
        of_bodies = of_bodies + (rotation_change * np.swapaxes(eccentricity, -1, -2)).sum(axis=(-1, -2))
    gravity, vertical = suspension.cable_gravity
    half_load = suspension.cable_mass * gravity * state.length / 2
    shift = shift[:, : state.length.shape[-1]]
    rise = shift[..., 2] if vertical is None else dot(shift, vertical[..., None, :])
    work = of_bodies.sum(axis=-1) - (half_load * (rise[..., 0] + rise[..., 1])).sum(axis=-1)
    if suspension.load_forces is None:
        return work
    return work + (suspension.load_forces.sum(axis=-2) * shift.sum(axis=-2)).sum(axis=(-1, -2)) / 2


def longest(state):
    """Longest cable or distance of two ends, shape (n,); 1 m where there is none. [m]"""
    length = np.maximum(size(state.vector).max(axis=-1), state.length.max(axis=-1, initial=0.0))
    return np.where(length > 0, length, 1.0)


def extent(state):
    """Largest extent of all ends along x, y or z, or longest cable if that is more, shape (n,). [m]"""
    # each coordinate in a row of its own: a maximum over a middle axis costs ten times as much
    coordinates = np.ascontiguousarray(state.ends.reshape(len(state.ends), -1, 3).T)
    return np.maximum(np.ptp(coordinates, axis=1).max(axis=0), longest(state))
