"""Pose of a suspension whose cables have given lengths: a guarded Newton iteration on its potential energy.

Between ends at a distance d a cable with the tension vector N at mid-length has the energy

    W(d) = N.d - L (T_mean + (|N|^2 + (w L)^2/12)/(2 EA)),     dW/dd = N,     d2W/dd2 = K,

which is convex (W is the Legendre transform of the complementary energy). With half of each cable's weight as a dead
load on each of its ends, the potential energy of a suspension is the sum of W, of the springs' energies (`links`) and
of the dead loads' potentials: without rotations and links it is convex, and Newton's method with a guarded step
converges from any start. With rotations, or springs that push, negative eigenvalues of the stiffness are taken by their
absolute value, so that every step descends.

Sources: Nocedal and Wright (2006), Numerical Optimization, section 3.4 (modified Newton); Hager and Zhang (2005), SIAM
J. Optim. 16, eq. 4.1 (acceptance of a step by its slope, where the change of energy is below its rounding).
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.newton import STALLED as CABLE_STALLED
from cablestudy.cable.span import Span
from cablestudy.system import tangent
from cablestudy.system.links import Links, joined
from cablestudy.system.rigid import size, turn
from cablestudy.system.rounding import bounds, over
from cablestudy.system.tangent import GROUND
from cablestudy.system.tolerances import SYSTEM

CONVERGED, NO_DESCENT, TOO_MANY, UNMET, UNHELD, ROUNDED, DISAGREED = range(7)
REASONS = (
    "converged",
    "no step lowers the energy",
    "no convergence in the largest number of steps",
    "no lengths were found for which the cables have what they state",
    "no tensions within the bounds hold the bodies where they shall be",
    "converged: no step leaves less, and what is left is the rounding of lengths and places",
    "the forces of the mean wind and the attitude that they lead to do not agree",
)
SOFTENED = (0.3, 0.1, 0.03, *(10.0**-k for k in range(2, 13)))  # strains of those: ten times stiffer each is few steps
TINY, EPSILON = 1e-300, 2 * SYSTEM.rounding


@dataclass(frozen=True)
class SearchRecord:
    """How the pose searches went; all arrays have the shape of the cases.

    Attributes
    ----------
    steps : ndarray of int
        Newton steps.
    residual : ndarray
        Largest net force on a body over the sum of the forces on it. [-]
    correction : ndarray
        Size of the last step: over the longest chord, or in radians. [-]
    reason : ndarray of int
        Why the search stopped: place in REASONS.
    """

    steps: np.ndarray
    residual: np.ndarray
    correction: np.ndarray
    reason: np.ndarray

    @property
    def converged(self):
        """Shape (...)."""
        return (self.reason == CONVERGED) | (self.reason == ROUNDED)


@dataclass(frozen=True)
class PoseState:
    """A pose, and the chord strains of the cables, which keep their digits from step to step; n cases.

    Attributes
    ----------
    position, rotation : ndarray, shape (n, b, 3), (n, b, 3, 3)
    arms, ends : ndarray, shape (n, c + l, 2, 3)
        From the reference point of its owner to each end of a cable or link, and its place, global axes. [m]
    vector : ndarray, shape (n, c + l, 3)
        From end 1 to end 2. [m]
    length, strain : ndarray, shape (n, c)
        Unstretched length of each cable [m], and the distance of its ends over it less 1 [-].
    extension : ndarray, shape (n, l)
        Of the links: distance of their ends less their length. [m]
    """

    position: np.ndarray
    rotation: np.ndarray
    arms: np.ndarray
    ends: np.ndarray
    vector: np.ndarray
    length: np.ndarray
    strain: np.ndarray
    extension: np.ndarray

    @property
    def chord(self):
        """From end 1 to end 2 of each cable, shape (n, c, 3). [m]"""
        return self.vector[:, : self.length.shape[-1]]


@dataclass(frozen=True)
class Point:
    """Forces, stiffness and energy in a state; n cases.

    Attributes
    ----------
    net : ndarray, shape (n, b, 6)
        Force and moment of all loads on each body. [N], [N m]
    scale : ndarray, shape (n, b)
        Sum of the sizes of the forces on each body. [N]
    least, most : ndarray, shape (n, b, 6)
        Rounding of `net`: `rounding.Bounds`. [N], [N m]
    energy, rounding : ndarray, shape (n,)
        Sum of W and of the energy of the links, and its rounding. [J]
    end_forces, end_stiffness : ndarray, shape (n, c + l, 2, 3), (n, c + l, 3, 3)
        As those of `Equilibrium`.
    solved : ndarray of bool, shape (n,)
        Whether all catenaries converged.
    """

    net: np.ndarray
    scale: np.ndarray
    least: np.ndarray
    most: np.ndarray
    energy: np.ndarray
    rounding: np.ndarray
    end_forces: np.ndarray
    end_stiffness: np.ndarray
    solved: np.ndarray


def take_rows(record, index):
    """Some of the n cases of a dataclass of arrays."""
    return replace(record, **{f.name: getattr(record, f.name)[index] for f in fields(record)})


def copy_record(record):
    """Copy of the cases in arrays of their own."""
    return replace(record, **{f.name: np.array(getattr(record, f.name)) for f in fields(record)})


def assign_rows(record, index, part):
    """Write some cases back into a dataclass of arrays."""
    for f in fields(record):
        getattr(record, f.name)[index] = getattr(part, f.name)


def displaced(suspension, state, step):
    """State after a step; see `moved_with_work`."""
    return displaced_with_work(suspension, state, step)[0] if suspension.body_names else state


def displaced_with_work(suspension, state, step):
    """State after a step, and the work of the dead loads along it.

    Parameters
    ----------
    suspension : SuspendedSystem
        With bodies.
    state : PoseState
    step : ndarray, shape (n, b, 6)
        Displacements [m] and rotation vectors [rad] of the bodies.

    Returns
    -------
    PoseState
    ndarray, shape (n,)
        [J]
    """
    turned, shift = turn(step[..., 3:]), np.zeros(state.ends.shape)
    cable, end = np.nonzero(suspension.owner != GROUND)
    body = suspension.owner[cable, end]
    lever = (turned[:, body] * state.arms[:, cable, end, None, :]).sum(axis=-1)
    shift[:, cable, end] = step[:, body, :3] + lever
    rotation = state.rotation + turned @ state.rotation
    position, arms = state.position + step[..., :3], suspension.arms(rotation)
    ends = arms.copy()
    ends[:, cable, end] += position[:, body]
    vector = ends[..., 1, :] - ends[..., 0, :]
    change = shift[..., 1, :] - shift[..., 0, :]
    # |d + change| - |d| without cancellation, so that the strain of a stiff cable keeps its digits
    longer = ((2 * state.vector + change) * change).sum(axis=-1)
    longer /= np.maximum(size(vector) + size(state.vector), TINY)
    cables = state.length.shape[-1]
    vector[:, cables:] = state.vector[:, cables:] + change[:, cables:]  # so that short ones keep their digits
    strain, extension = state.strain + longer[:, :cables] / state.length, state.extension + longer[:, cables:]
    after = PoseState(position, rotation, arms, ends, vector, state.length, strain, extension)
    return after, _work(suspension, state, step, turned, shift)


def spans(suspension, state):
    """The cables between their ends: a `Span` of shape (n, c)."""
    length, close = state.length, size(state.chord) <= SYSTEM.nearest_ends * state.length
    down = np.array([0.0, 0.0, -SYSTEM.nearest_ends]) * length[..., None]
    vector = np.where(close[..., None], down, state.chord)
    gravity, vertical = suspension.cable_gravity
    stiffness, mass = suspension.axial_stiffness, suspension.cable_mass
    loads = {}
    if suspension.load_forces is not None:
        loads = {"load_positions": suspension.load_positions, "load_forces": suspension.load_forces}
    span = Span.between(np.zeros(3), vector, stiffness, mass, gravity, vertical=vertical, **loads)
    if loads:
        span = replace(span, load_masses=suspension.load_masses, load_fractions=suspension.load_fractions).broadcast()
    return span.with_chord_strain(np.where(close, SYSTEM.nearest_ends - 1, state.strain))


def at_ends(suspension, state, cables, stiffness):
    """Forces of cables and links at their ends and their end stiffness, as in `Point`, and the `Links` or None.

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


def evaluate(suspension, state):
    """Forces, stiffness and energy in a state: `Point`."""
    cables = catenary.solve(spans(suspension, state))
    span = cables.span
    forces, stiffness, links = at_ends(suspension, state, cables, cables.global_end_stiffness)
    # a force is not known better than the rounding of a strain, also where all cables hang without tension
    known = np.maximum(cables.max_tension, EPSILON * span.axial_stiffness)
    net, scale = tangent.net_forces(suspension, state.rotation, state.arms, forces, known)
    rounding = bounds(suspension, state.rotation, state.arms, state.ends, state.strain, cables, known, links)
    q, squared = _along_and_squared(cables)
    length, tension = span.unstretched_length, cables.mean_tension
    strained = squared / (2 * span.axial_stiffness)
    stretched = q * (1 + span.chord_strain)
    energy = length * (stretched - tension - strained)
    terms = length * (np.abs(stretched) + tension + strained)
    energy, terms = (joined(part, links and links.energy, -1) for part in (energy, terms))
    solved = cables.record.reason != CABLE_STALLED
    return Point(
        net, scale, rounding.least, rounding.most, energy.sum(axis=-1), EPSILON * terms.sum(axis=-1),
        forces, stiffness, solved.all(axis=-1) & np.isfinite(net).all(axis=(-1, -2)),
    )  # fmt: skip


def _along_and_squared(cables):
    """Mean of the tension vectors at both ends along the chord [N], and the mean of |N(s)|^2 [N^2], shape (n, c)."""
    if cables.segments.fraction.shape[-1] == 1:
        q, n, y = (part[..., 0] for part in cables.tension)
        return q, q**2 + n**2 + y**2 + cables.span.weight**2 / 12
    ends = cables.end_forces()[..., 0]
    squared = sum(part**2 for part in cables.tension) + cables.segments.weight**2 / 12
    return (ends[..., 0] - ends[..., 1]) / 2, (squared * cables.segments.fraction).sum(axis=-1)


def _work(suspension, state, step, turned, shift):
    """Work of the dead loads along a step: of weights, of half the load of each cable on each of its ends, of forces.

    Parameters
    ----------
    suspension, state, step
        As for `moved_with_work`.
    turned : ndarray, shape (n, b, 3, 3)
        Change of the rotation of each body, as of `rigid.turn`.
    shift : ndarray, shape (n, c + l, 2, 3)
        Displacements of the ends of cables and links. [m]

    Returns
    -------
    ndarray, shape (n,)
        [J]
    """
    center, weight = tangent.weights(suspension, state.rotation)
    lifted = step[..., :3] + (turned * center[..., None, :]).sum(axis=-1)
    bodies = (weight * lifted).sum(axis=-1) + (suspension.force * step[..., :3]).sum(axis=-1)
    bodies = bodies + (suspension.moment * step[..., 3:]).sum(axis=-1)
    eccentricity = tangent.eccentric(suspension, state.rotation)
    if eccentricity is not None:
        bodies = bodies + (turned * np.swapaxes(eccentricity, -1, -2)).sum(axis=(-1, -2))
    gravity, vertical = suspension.cable_gravity
    half = suspension.cable_mass * gravity * state.length / 2
    shift = shift[:, : state.length.shape[-1]]
    raised = shift[..., 2] if vertical is None else (shift * vertical[..., None, :]).sum(axis=-1)
    total = bodies.sum(axis=-1) - (half * raised.sum(axis=-1)).sum(axis=-1)
    if suspension.load_forces is None:
        return total
    return total + (suspension.load_forces.sum(axis=-2) * shift.sum(axis=-2)).sum(axis=(-1, -2)) / 2


def longest(state):
    """Longest cable or distance of two ends, shape (n,); 1 m where there is none. [m]"""
    found = np.maximum(size(state.vector).max(axis=-1), state.length.max(axis=-1, initial=0.0))
    return np.where(found > 0, found, 1.0)


def extent(state):
    """Largest extent of all ends along x, y or z, or longest cable if that is more, shape (n,). [m]"""
    return np.maximum(np.ptp(state.ends, axis=(-3, -2)).max(axis=-1), longest(state))


def newton_step(suspension, state, point):
    """Newton step of all free degrees of freedom; where the stiffness is not positive definite, one that descends.

    Parameters
    ----------
    suspension : SuspendedSystem
    state : PoseState
        Of n cases.
    point : Point
        Forces and stiffness in this pose.

    Returns
    -------
    ndarray, shape (n, b, 6)
        No component is longer than `farthest_step` or `widest_turn`. [m], [rad]
    """
    free = suspension.free
    force = tangent.free_values(suspension, point.net)
    blocks = tangent.blocks(suspension, state.rotation, state.arms, point.end_forces, point.end_stiffness)
    largest_step = np.ones((len(force), *free.shape)) * SYSTEM.widest_turn
    largest_step[..., :3] = SYSTEM.farthest_step * extent(state)[:, None, None]
    # where nothing holds a degree of freedom the step is small if the force is rounding, and else as large as allowed
    least = tangent.free_values(suspension, np.maximum(np.abs(point.net), point.least) / largest_step)
    stiffness = np.maximum(tangent.magnitudes(blocks, suspension), least)
    scales = np.sqrt(np.maximum(stiffness, TINY))
    if free.sum() <= SYSTEM.dense_freedoms:
        longest_moves = tangent.free_values(suspension, largest_step) * scales
        moves = _dense_step(tangent.scaled_dense(blocks, suspension, scales), force / scales, longest_moves)
    else:
        cases = range(len(force))
        moves = [
            _sparse_step(tangent.scaled_sparse(blocks.of(i), suspension, scales[i]), force[i] / scales[i])
            for i in cases
        ]
    step = np.zeros(largest_step.shape)
    step[:, free] = np.asarray(moves) / scales
    return step / np.maximum(1.0, (np.abs(step) / largest_step).max(axis=(-1, -2)))[:, None, None]


def _dense_step(matrix, force, largest):
    """K^-1 g; or where that is too long or K not positive definite Q (Q^T g/|eigenvalue|); shape (n, d).

    There the part along each eigenvector is no longer than allowed, so that a motion that nothing holds does not leave
    the others without a step.
    """
    symmetric = (matrix + np.swapaxes(matrix, -1, -2)) / 2
    definite = np.linalg.eigvalsh(symmetric)[:, 0] > SYSTEM.flattest
    plain = np.where(definite[:, None, None], matrix, np.eye(force.shape[-1]))
    exact = tangent.solved(plain, force)
    good = definite & (np.abs(exact) <= largest).all(axis=-1)
    if good.all():
        return exact
    values, vectors = np.linalg.eigh(symmetric)
    shares = (np.swapaxes(vectors, -1, -2) @ force[..., None])[..., 0]
    parts = vectors * (shares / np.maximum(np.abs(values), SYSTEM.flattest))[:, None, :]
    parts = parts / np.maximum(1.0, (np.abs(parts) / largest[..., None]).max(axis=-2))[:, None, :]
    return np.where(good[:, None], exact, parts.sum(axis=-1))


def _sparse_step(matrix, force):
    """The same for one case, with a multiple of the unit matrix added until the stiffness is positive definite."""
    from scipy.sparse import eye_array

    unit, shift = eye_array(len(force), format="csc"), 0.0
    while (factors := tangent.factorised(matrix + shift * unit)) is None:
        shift = max(10 * shift, SYSTEM.flattest)
    return factors.solve(force)


def imbalance(suspension, point):
    """Largest net force on a free degree of freedom over the sum of forces on that body, shape (n,). [-]"""
    sizes = np.ones_like(point.net)
    sizes[..., 3:] = tangent.body_sizes(suspension)[..., None]
    net = np.where(suspension.free, point.net / sizes, 0.0)
    return (np.abs(net) / np.maximum(point.scale, TINY)[..., None]).max(axis=(-1, -2))


def line_search(suspension, state, point, step):
    """The largest of a falling series of shares of a step that lowers the energy enough.

    Returns
    -------
    state : PoseState
    point : Point
        There.
    share : ndarray, shape (n,)
        Zero where no share lowers the energy: state and point are those before.
    """
    slope = (point.net * step).sum(axis=(-1, -2))  # of the energy, with the sign turned
    share, found = np.ones(len(slope)), np.zeros(len(slope), dtype=bool)
    new_state, new_point = copy_record(state), copy_record(point)
    rest = np.arange(len(slope))
    for _ in range(SYSTEM.descent_halvings):
        part = suspension if len(rest) == len(slope) else suspension.take(rest)
        before, taken = take_rows(state, rest), step[rest] * share[rest, None, None]
        trial, work = displaced_with_work(part, before, taken)
        there = evaluate(part, trial)
        change = there.energy - point.energy[rest] - work
        rounding = there.rounding + point.rounding[rest]
        ahead = (there.net * step[rest]).sum(axis=(-1, -2))
        falls = change <= -SYSTEM.sufficient_descent * share[rest] * slope[rest]
        flat = (change <= rounding) & (ahead >= -(1 - 2 * SYSTEM.slope_change) * slope[rest])
        good = there.solved & (falls | flat)
        if not found.any() and good.all():
            return trial, there, share
        put_into = rest[good]
        for whole, fresh in ((new_state, trial), (new_point, there)):
            assign_rows(whole, put_into, take_rows(fresh, good))
        found[put_into] = True
        # where the slope along the step vanishes, by the secant; a whole step at most
        secant = slope[rest] / np.maximum(slope[rest] - np.minimum(ahead, 0.0), TINY)
        smaller = np.where(there.solved, np.clip(secant, 0.05, 0.5), 0.25)
        rest, smaller = rest[~good], smaller[~good]
        share[rest] *= smaller
        if not len(rest):
            break
    return new_state, new_point, np.where(found, share, 0.0)


def descend(suspension, state, most=SYSTEM.descent_steps, enough=0.0):
    """Poses of least energy, from given starts.

    Parameters
    ----------
    suspension : SuspendedSystem
        With cases of shape (n,).
    state : PoseState
    most : int
        Steps.
    enough : float
        Net force over the sum of forces that counts as none, beside what is rounding. [-]

    Returns
    -------
    PoseState
        Each case's to the last digit as if it were alone.
    Record
    """
    cases = len(state.length)
    if not suspension.free.any():
        zero = np.zeros(cases)
        return state, SearchRecord(zero.astype(int), zero, zero, np.full(cases, CONVERGED))
    final, count = copy_record(state), np.zeros(cases, dtype=int)
    residual, correction, reason = np.zeros(cases), np.full(cases, np.inf), np.full(cases, TOO_MANY)
    active, part, point = np.arange(cases), suspension, evaluate(suspension, state)
    best, slow = np.full(cases, np.inf), np.zeros(cases, dtype=int)
    for number in range(most):
        step = newton_step(part, state, point)
        change = np.maximum(size(step[..., :3]).max(axis=-1) / longest(state), size(step[..., 3:]).max(axis=-1))
        state, point, share = line_search(part, state, point, step)
        after, left = imbalance(part, point), over(part, point.net, point.least)
        slow[active] = np.where(left > SYSTEM.descent_progress * best[active], slow[active] + 1, 0)
        best[active] = np.minimum(best[active], left)
        found = (left <= 1) | (after < enough)
        stuck = (share == 0) | (slow[active] >= SYSTEM.descent_patience) | (number == SYSTEM.descent_steps - 1)
        rounded = stuck & (over(part, point.net, point.most) <= 1)
        ended = found | rounded | (share == 0)
        count[active] += 1
        residual[active], correction[active] = after, change
        why = np.where(share == 0, NO_DESCENT, TOO_MANY)
        reason[active] = np.where(found, CONVERGED, np.where(rounded, ROUNDED, why))
        assign_rows(final, active, state)
        if ended.any():
            rest = ~ended
            active, state, point = active[rest], take_rows(state, rest), take_rows(point, rest)
            part = suspension.take(active)
        if not len(active):
            break
    return final, SearchRecord(count, residual, correction, reason)


def typical_loads(suspension, state):
    """For each cable the smaller one of the loads on the bodies at its ends, shape (n, c). [N]"""
    gravity = np.abs(suspension.gravity)[:, None]
    weight = suspension.cable_mass * gravity * state.length
    if suspension.load_forces is not None:
        weight = weight + size(suspension.load_forces).sum(axis=-1)
    loads = (
        suspension.mass * gravity + size(suspension.force) + size(suspension.moment) / tangent.body_sizes(suspension)
    )
    owner = suspension.owner[suspension.of_cables]
    cable, end = np.nonzero(owner != GROUND)
    np.add.at(loads, (slice(None), owner[cable, end]), weight[:, cable])
    infinite = np.full((len(loads), 1), np.inf)
    smaller = np.concatenate([loads, infinite], axis=-1)[:, owner].min(axis=-1)
    return np.where(np.isfinite(smaller), smaller, 0.0)


def _softened_links(suspension, state, strain):
    """Stiffness of the links, shape (n, l), none more than that of the firmest cable, or of the weights, at a strain.

    None without links. [N/m]
    """
    if not suspension.link_names:
        return None
    weights = (suspension.mass * np.abs(suspension.gravity)[:, None] + size(suspension.force)).sum(axis=-1)
    firmest = np.maximum(suspension.axial_stiffness.max(axis=-1, initial=0.0), weights) / longest(state)
    return np.minimum(suspension.link_stiffness, SOFTENED[0] / strain * firmest[:, None])


def search(suspension, state):
    """Poses of least energy: straight from the start, or where that takes many steps, by softer cables and links.

    Stiff cables make a narrow, curved valley of the energy, in which Newton steps are short. Cables that the loads
    strain by a third make it wide; stiffer ones then follow, each from the equilibrium of the one before; so do links.
    """
    first, record = descend(suspension, state, SYSTEM.straight_steps)
    hard = np.flatnonzero(~record.converged)
    if not len(hard):
        return first, record
    part, state = suspension.take(hard), take_rows(state, hard)
    loads, stiffness = typical_loads(part, state), part.axial_stiffness
    for strain in SOFTENED:
        softened = np.minimum(stiffness, np.where(loads > 0, loads / strain, np.inf))
        links = _softened_links(part, state, strain)
        softer = (softened < stiffness).any(axis=-1)
        softer = softer if links is None else softer | (links < part.link_stiffness).any(axis=-1)
        rest = np.flatnonzero(softer)
        if not len(rest):
            break
        soft = replace(part, axial_stiffness=softened, link_stiffness=links).take(rest)
        there, _ = descend(soft, take_rows(state, rest), SYSTEM.soft_steps, SYSTEM.soft_net_force)
        assign_rows(state, rest, there)
        tension = catenary.solve(spans(soft, there)).max_tension
        loads[rest] = np.clip(tension, loads[rest], SYSTEM.soft_tension * loads[rest].sum(axis=-1, keepdims=True))
    state, last = descend(part, state)
    assign_rows(first, hard, state)
    record = copy_record(record)
    assign_rows(record, hard, last)
    return first, record
