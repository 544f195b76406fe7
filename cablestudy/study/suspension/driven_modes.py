"""Modes above those of a model that the loop of the winches could drive: they decide whether a gain is stable.

A mode of frequency W and damping force c per velocity meets, by itself, s^2 + c s + W^2 + (gain/s) X = 0 with
X = b A N p: p what is measured of it, A N what the winches make of that, b their force on it. Near i W its pole moves
by

    gain X/(2 W^2) - c/2,

so that it grows from the gain c W^2/Re X on, where Re X is positive; of modes that nearly coincide X is a matrix, and
its eigenvalues count. The modes with the least such gains are taken into the model beside the lowest ones; eigenvalues
of the closed loop then decide.

How high modes are looked at follows from waves along the cables, which winches drive most. A wave that runs to and fro
along a cable, of modal mass 1, has the force F with F^2 = 2 W^2 Z/t on both of its ends (Z = sqrt(EA m) its impedance,
t its travel time). Far above the frequencies of the body it moves the body by M^-1 w F/W^2 (M the body's inertia, w the
wrench of a unit tension), so that

    X_ij = sqrt(2 Z_i/t_i) sqrt(2 Z_j/t_j) A_i N M^-1 w_j

between cables whose waves have the same frequency, and |X| bounds the real part of its eigenvalues.

Another law than an integrator may make the loop gain large far above the frequencies of the body. All modes are then in
the model up to where the loop gain of waves that do not return, of tension Z v', is below BROAD, as for one cable.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.activity import doing
from cablestudy.control.pose_loop import growing
from cablestudy.control.pose_margins import limit_near
from cablestudy.control.stability import BROAD, too_many
from cablestudy.control.suspension import winch_forces
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.suspension.movement import Movement
from cablestudy.system.coupled_solution import CoupledModes
from cablestudy.wind.strips import strips

BAND = 3.0  # frequencies that are looked at, over the highest of notch, roll-off and gain
MOST = 1200  # modes that are looked at
HARMONICS = 60  # of the waves along a cable
TAKEN = 60  # that are added to a model at most
MOST_BROAD = 300  # modes with a law that is no integrator; more are refused
WIDE = np.geomspace(1.0, 1e5, 501)  # frequencies that are looked at with such a law, over the lowest of the modes
BESIDE = 0.05  # frequencies that are looked at beyond the highest wave
CLOSE = 5e-3  # relative distance of modes that nearly coincide
RISK = 3.0  # gain from which a mode alone would grow, over that of the loop and over its largest gain


def with_driven_modes(movement):
    """The same movement, with the modes that its loop could drive: of exact elements among all that they have.

    Itself where there are none, or where it grows without a loop.

    Parameters
    ----------
    movement : Movement
        With a loop.

    Raises
    ------
    NoSolutionError, ConvergenceError
        Of a law that is no integrator: it could drive too many modes.
    """
    if growing(movement.open_poles) is not None:
        return movement
    loop, lowest, exact = movement.loop, len(movement.modes), movement.linear.model is not None
    corners = [max(notch.omega, notch.rolloff_omega) for notch in movement.notches if notch is not None]
    limit = max(loop.gain, movement.largest_gain or 0.0)
    broad = _broad_up_to(movement, movement.largest_gain or loop.gain)
    highest = max(BAND * max([*corners, loop.gain]), _driven_along(movement, RISK * limit), broad)
    cables = movement.modes.solution.models.cables
    count = int(2 * highest / np.pi * cables.travel_time[cables.heavy].sum()) + len(movement.layout.free)
    if not exact and (movement.modes.solution.omega[-1] >= highest or count <= lowest):
        return movement
    linear, count = movement.linear, MOST if exact else min(count, MOST)
    if count not in linear.candidates:
        linear.candidates[count] = _candidates(linear, count)
    found = linear.candidates[count]
    gains = _gains(movement, found)
    order, below = np.argsort(gains), int((found.modes.solution.omega < broad).sum())
    if below > MOST_BROAD and movement.stable:
        raise too_many(loop.law.said(loop.gain, 4), below, broad)
    lowest = max(lowest, min(below, MOST_BROAD))
    risky = [mode for mode in order[:TAKEN].tolist() if mode >= lowest and gains[mode] < RISK * limit]
    if len(found.modes) <= lowest + TAKEN:
        lowest, risky = len(found.modes), []
    if not (risky or exact) and lowest == len(movement.modes):
        return movement
    return Movement(movement.scene, linear.with_modes(found.modes, [*range(lowest), *sorted(risky)], len(risky)))


def _driven_along(movement, gain):
    """Frequency up to which a gain could drive waves along the cables; 0 where it drives none. [rad/s]

    Of a cable that ends at a junction the body is taken to be at the end of its line of action.
    """
    cables = movement.modes.solution.models.cables
    span, reeled = cables.catenary.span, np.array([winch.cable for winch in movement.winches], dtype=int)
    if not len(reeled) or not cables.heavy[reeled].all():
        return 0.0
    stiffness, mass = (values[reeled] for values in (span.axial_stiffness, span.mass))
    time = span.unstretched_length[reeled] * np.sqrt(mass / stiffness)
    size = np.sqrt(2 * np.sqrt(stiffness * mass) / time)
    moved = _moved_by_tensions(movement, reeled) * size
    omega = np.pi * np.arange(1, HARMONICS + 1) / time.max()
    shares = size[:, None] * movement.allocation.shares * _filtered(movement, omega)[:, None, :]
    driven = np.abs(np.linalg.eigvals(shares @ moved)).max(axis=1)
    needed = _lost_along(movement, reeled, omega) * omega**2
    return float(omega[driven * gain > needed].max(initial=0.0)) * (1 + BESIDE)


def _broad_up_to(movement, gain):
    """Frequency up to which all modes are needed with a gain of a law that is no integrator; 0 of one. [rad/s]"""
    cables, loop = movement.modes.solution.models.cables, movement.loop
    reeled = np.array([winch.cable for winch in movement.winches], dtype=int)
    if loop.law.integrates_only or not len(reeled):
        return 0.0
    span, omega = cables.catenary.span, WIDE * movement.modes.solution.omega[0]
    impedance = np.sqrt(span.axial_stiffness * span.mass)[reeled] * cables.heavy[reeled]
    shares = movement.allocation.shares * loop.controller(1j * omega)[:, None, :]
    passed = np.abs(np.linalg.eigvals(shares @ _moved_by_tensions(movement, reeled) * impedance)).max(axis=1)
    return float(omega[gain * passed > BROAD * omega].max(initial=0.0))


def _filtered(movement, omega):
    """What the winches integrate of each measured coordinate, over the gain: s C1 N, shape (f, k)."""
    s = 1j * omega
    return s[:, None] * movement.loop.controller(s)


def _moved_by_tensions(movement, reeled):
    """What is measured of a body without cables, per tension of each cable and over -s^2: shape (k, i)."""
    equilibrium, body = movement.equilibrium, movement.body
    suspension = equilibrium.suspension
    force = equilibrium.end_forces[reeled]
    there = suspension.owner[reeled] == body
    end = np.where(there.any(axis=1), there.argmax(axis=1), 1)
    rows = np.arange(len(reeled))
    along = force[rows, end] / np.linalg.norm(force[rows, end], axis=-1, keepdims=True)
    arms = np.where(there.any(axis=1)[:, None], equilibrium.arms[reeled][rows, end], 0.0)
    wrenches = np.concatenate([along, np.cross(arms, along)], axis=-1)
    free = np.flatnonzero(suspension.free[body])
    moved = np.zeros((6, len(reeled)))
    moved[free] = np.linalg.solve(movement.layout.mass[body][np.ix_(free, free)], wrenches[:, free].T)
    return moved[[MOTIONS.index(name) for name in movement.measured]]


def _lost_along(movement, reeled, omega):
    """Least damping force per velocity of waves along some cables, of modal mass 1, shape (f,). [1/s]"""
    cables, least = movement.modes.solution.models.cables, np.full(len(omega), np.inf)
    for cable in reeled.tolist():
        damping = cables.damping[cable]
        lost = {
            "modal": lambda d=damping: 2 * d.ratio * omega,
            "hysteretic": lambda d=damping: d.loss_factor * omega,
            "kelvin_voigt": lambda d=damping: d.time * omega**2,
        }[damping.model]()
        least = np.minimum(least, lost + damping.viscous / cables.catenary.span.mass[cable])
    return least


@dataclass(frozen=True)
class Candidates:
    """Modes that are looked at.

    Attributes
    ----------
    modes : CoupledModes
    driven : tuple of 3 ndarray, shape (k, i)
        Force on each mode per length that each winch reels in, its first and its second derivative.
    lost : ndarray, shape (k,)
        Damping force of each mode per velocity. [1/s]
    """

    modes: CoupledModes
    driven: tuple
    lost: np.ndarray


def _candidates(linear, count):
    doing(f"modes that the winches could drive are sought among the lowest {count}")
    modes, layout = linear.lowest(count), linear.layout
    omega, shapes = modes.solution.omega, modes.shapes
    driven = tuple(shapes.T @ part for part in winch_forces(layout, modes.solution.kept, linear.winches))
    system = modes.system
    lost = (shapes * (system.damping @ shapes)).sum(axis=0)
    lost = lost + (shapes * (system.stiffness.imag @ shapes)).sum(axis=0) / omega
    if linear.drag is not None and linear.scene.wind.aerodynamic_damping:
        for strip in strips(modes.solution, layout, shapes, linear.drag):
            lost = lost + (np.moveaxis(strip.forces, 0, 1)[..., :-2] * strip.shapes).sum(axis=(0, 1))
    for begin, end in _clusters(omega):
        lost[begin:end] = lost[begin:end].min()
    return Candidates(modes, driven, lost)


def gain_error(movement):
    """Estimated relative error of the largest gain; not a number where it is not known. [-]

    By leaving out the highest of the lowest modes; where modes were chosen among more, by what the others change.
    """
    limit = movement.limit
    if movement.loop is None or limit is None:
        return np.nan
    if movement.linear.wide is not None:
        return np.nan if movement.limit_change is None else movement.limit_change
    found = limit_near(movement.fewer_loop, limit)
    return np.nan if found is None else abs(found.factor / limit.factor - 1)


def _gains(movement, candidates):
    """Gain from which each mode alone would grow, infinite where none does, shape (k,). [rad/s]

    Where the peak of the sensitivity bounds the gain, as if the phase of each were the worst one.
    """
    omega = candidates.modes.solution.omega
    s = 1j * omega[:, None]
    pulled = sum(s**order * part for order, part in enumerate(candidates.driven))
    measured = movement.measured_of(candidates.modes.shapes)
    shares = movement.allocation.shares[None] * _filtered(movement, omega)[:, None, :]
    made = (shares @ measured.T[..., None])[..., 0]  # of the winches by each mode
    driven, bounded = np.zeros(len(omega)), not isinstance(movement.scene.control.gain, int | float)
    for begin, end in _clusters(omega):
        own = slice(begin, end)
        values = np.linalg.eigvals(pulled[own] @ made[own].T)
        driven[own] = (np.abs(values) if bounded else values.real).max()
    return np.where(driven > 0, candidates.lost * omega**2 / np.where(driven > 0, driven, 1.0), np.inf)


def _clusters(omega):
    """First and one beyond the last of each run of frequencies that nearly coincide."""
    edges = np.flatnonzero(np.diff(omega) > CLOSE * omega[1:]) + 1
    return zip([0, *edges.tolist()], [*edges.tolist(), len(omega)], strict=True)
