"""Modes above those of a model that the loop of the winches could drive: they decide whether a gain is stable.

A mode of frequency W and damping force c per velocity meets, by itself, s^2 + c s + W^2 + (gain/s) X = 0 with
X = b A N p: p what is measured of it, A N what the winches make of that, b their force on it. Near i W its pole moves
by

    gain X/(2 W^2) - c/2,

so that it grows from the gain c W^2/Re X on, where Re X is positive; of modes that nearly coincide X is a matrix, and
its eigenvalues count. The modes with the least such gains are taken into the model beside the lowest ones; eigenvalues
of the closed loop then decide.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.pose_margins import gain_beside
from cablestudy.control.suspension import winch_forces
from cablestudy.study.suspension.movement import Movement
from cablestudy.system.coupled_modes import CoupledModes
from cablestudy.wind.strips import strips

BAND = 3.0  # frequencies that are looked at, over the highest of notch, roll-off and gain
MOST = 400  # modes that are looked at
TAKEN = 24  # that are added to a model at most
CLOSE = 5e-3  # relative distance of modes that nearly coincide
RISK = 3.0  # gain from which a mode alone would grow, over that of the loop and over its largest gain


def with_driven_modes(movement):
    """The same movement, with the modes that its loop could drive; itself where there are none.

    Parameters
    ----------
    movement : Movement
        With a loop.

    Raises
    ------
    NoSolutionError, ConvergenceError
    """
    loop, lowest = movement.loop, len(movement.modes)
    corners = [max(notch.omega, notch.rolloff_omega) for notch in movement.notches if notch is not None]
    highest = BAND * max([*corners, loop.gain])
    cables = movement.modes.solution.models.cables
    count = int(2 * highest / np.pi * cables.travel_time[cables.heavy].sum()) + len(movement.layout.free)
    if movement.modes.solution.omega[-1] >= highest or count <= lowest:
        return movement
    linear, count = movement.linear, min(count, MOST)
    if count not in linear.candidates:
        linear.candidates[count] = _candidates(linear, count)
    found = linear.candidates[count]
    gains = _gains(movement, found)
    limit = max(loop.gain, movement.largest_gain or 0.0)
    order = np.argsort(gains)
    risky = [mode for mode in order[:TAKEN].tolist() if mode >= lowest and gains[mode] < RISK * limit]
    if not risky:
        return movement
    return Movement(movement.scene, linear.with_modes(found.modes, [*range(lowest), *sorted(risky)], len(risky)))


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
    modes, layout = linear.lowest(count), linear.layout
    omega, shapes = modes.solution.omega, modes.shapes
    driven = tuple(shapes.T @ part for part in winch_forces(layout, modes.solution.kept, linear.winches))
    system = modes.system
    lost = (shapes * (system.damping @ shapes)).sum(axis=0)
    lost = lost + (shapes * (system.stiffness.imag @ shapes)).sum(axis=0) / omega
    if linear.drag is not None and linear.scene.wind.aerodynamic_damping:
        for strip in strips(modes.solution, layout, shapes, linear.drag):
            lost = lost + (np.moveaxis(strip.forces, 0, 1) * strip.shapes).sum(axis=(0, 1))
    for begin, end in _clusters(omega):
        lost[begin:end] = lost[begin:end].min()
    return Candidates(modes, driven, lost)


def gain_error(movement):
    """Estimated relative error of the largest gain; not a number where it is not known. [-]

    By leaving out the highest of the lowest modes; where modes above them decide, by taking in all that were looked at.
    """
    limit, linear = movement.limit, movement.linear
    if movement.loop is None or limit is None:
        return np.nan
    other = movement.fewer_loop
    if linear.driven:
        wide = linear.candidates[max(linear.candidates)].modes
        other = Movement(movement.scene, linear.with_modes(wide, range(len(wide)), 0)).loop
    found = gain_beside(other, limit)
    return np.nan if found is None else abs(found / limit.factor - 1)


def _gains(movement, candidates):
    """Gain from which each mode alone would grow, infinite where none does, shape (k,). [rad/s]"""
    omega = candidates.modes.solution.omega
    s = 1j * omega[:, None]
    pulled = sum(s**order * part for order, part in enumerate(candidates.driven))
    measured = movement.measured_of(candidates.modes.shapes)
    shares = movement.allocation.shares[None] * movement.loop.filters(1j * omega)[:, None, :]
    made = (shares @ measured.T[..., None])[..., 0]  # of the winches by each mode
    driven = np.zeros(len(omega))
    for begin, end in _clusters(omega):
        own = slice(begin, end)
        driven[own] = np.linalg.eigvals(pulled[own] @ made[own].T).real.max()
    return np.where(driven > 0, candidates.lost * omega**2 / np.where(driven > 0, driven, 1.0), np.inf)


def _clusters(omega):
    """First and one beyond the last of each run of frequencies that nearly coincide."""
    edges = np.flatnonzero(np.diff(omega) > CLOSE * omega[1:]) + 1
    return zip([0, *edges.tolist()], [*edges.tolist(), len(omega)], strict=True)
