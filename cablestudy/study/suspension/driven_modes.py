"""Modes of a suspension, far above those of a model, that the loop of its winches could drive: with them it is judged.

They are found among the modes of single cables (`driven_cables`), and added to the coupled ones of the model.
"""

from dataclasses import dataclass
from math import ceil, log2

import numpy as np

from cablestudy.control.gain_limits import limit_near
from cablestudy.control.pose_loop import growing
from cablestudy.control.suspension import winch_forces
from cablestudy.study.suspension.driven_cables import DrivenCables
from cablestudy.study.suspension.movement import Movement
from cablestudy.system.coupled_modes import Search
from cablestudy.system.coupled_solution import CoupledModes
from cablestudy.wind.strips import strips

UNLIMITED = 1e3  # gain up to which a loop that seems to have no limit is examined, over its lowest frequency
MOST_ELEMENTS = 400  # modes of an exact choice of elements that are all in the model; of more, those that a gain drives
WIDER = 1.5  # frequency up to which modes of exact elements are kept, over that of the model
FEW, TAKEN = 250, 60  # modes that are all in a model; of more those that are added to the lowest at most
CLOSE = 5e-3  # relative distance of modes that nearly coincide
SAFETY = 4.0  # on the change of the largest gain by the highest modes, where those left out are many
BEYOND, MOST_LOWEST = 1.6, 1200  # coupled modes are sought up to so many times the frequency of a pole that crosses
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
        The loop could drive too many modes.
    """
    if growing(movement.open_poles) is not None:
        return movement
    loop, linear, own = movement.loop, movement.linear, movement.limit_of_model
    limit = max(loop.gain, own.factor if own else 0.0)
    examined = limit if own else max(limit, UNLIMITED * movement.modes.solution.omega[0])
    key = ceil(log2(examined)), movement.loop_key  # gains that are alike share them
    if key not in linear.candidates:
        cables = DrivenCables(movement, 2.0 ** key[0])
        linear.candidates[key] = cables, _candidates(movement, cables)
    cables, candidates = linear.candidates[key]
    if candidates is not None:
        linear = _with_candidates(movement, candidates, cables.broad, RISK * limit)
    exact = (cables.limit, cables.errors) if cables.exact else None
    if exact or linear is not movement.linear:
        return _with_all_below(Movement(movement.scene, linear, exact, own), movement)
    return movement


def _with_all_below(found, movement):
    """The movement with all coupled modes up to the frequency of the pole that crosses first, where those decide."""
    limit, base = found.limit_of_model, movement.modes.solution
    if found.limit_errors is not None or movement.linear.model is not None or limit is None:
        return found
    cables = base.models.cables
    highest, time = BEYOND * limit.omega, cables.travel_time[cables.heavy].sum()
    count = int(2 * highest / np.pi * time) + len(movement.layout.free)
    if limit.omega <= base.omega[-1]:
        return found
    known, count = movement.linear.candidates, min(count, MOST_LOWEST)
    if count not in known:
        known[count] = _candidates_of(movement.linear, movement.linear.lowest(count))
    linear = _with_candidates(movement, known[count], 0.0, RISK * max(movement.loop.gain, limit.factor))
    return Movement(movement.scene, linear, coarse=limit)


def _with_candidates(movement, candidates, broad, gain):
    """The `LinearMotion` of a movement with those `Candidates` that alone grow with a gain [rad/s], or are few.

    With all of them up to a frequency. [rad/s]
    """
    linear, gains = movement.linear, _gains(movement, candidates)
    lowest = max(len(movement.modes), int((candidates.modes.solution.omega < broad).sum()))
    chosen = [mode for mode in np.argsort(gains)[:TAKEN].tolist() if mode >= lowest and gains[mode] < gain]
    if len(candidates.modes) <= FEW:
        lowest, chosen = len(candidates.modes), []
    if not chosen and linear.model is None and lowest == len(movement.modes):
        return linear
    return linear.with_modes(candidates.modes, [*range(lowest), *sorted(chosen)], len(chosen))


@dataclass(frozen=True)
class Candidates:
    """Coupled modes from which those of a model are chosen.

    Attributes
    ----------
    modes : CoupledModes
    forces : tuple of 3 ndarray, shape (k, i)
        Force on each mode per length that each winch reels in, its first and its second derivative.
    lost : ndarray, shape (k,)
        Damping force of each mode per velocity. [1/s]
    """

    modes: CoupledModes
    forces: tuple
    lost: np.ndarray


def _candidates(movement, cables):
    """`Candidates` with the modes of `DrivenCables`; None where the model has them all."""
    linear, base, models = movement.linear, movement.modes.solution, cables.models
    every, limits = sum(len(element.omega) for element in models.elements), base.coordinates.limits
    if linear.model is None:
        highest = [one.omega[own].max(initial=0.0) for one, own in zip(models.elements, cables.chosen, strict=True)]
        if max(highest) <= base.omega[-1]:
            return None
    elif every > MOST_ELEMENTS:
        limits = np.where(limits > 0, WIDER * base.omega[-1], 0.0)
    search = Search(linear.equilibrium, every + len(movement.layout.free), linear.accuracy, cables=models.cables)
    return _candidates_of(linear, search.with_chosen(models, limits, cables.chosen))


def _candidates_of(linear, modes):
    """`Candidates` with some `CoupledModes`."""
    forces = winch_forces(linear.layout, modes.solution.kept, linear.winches)
    return Candidates(modes, tuple(modes.shapes.T @ part for part in forces), _lost(linear, modes))


def _lost(linear, modes):
    """Damping force of each mode per velocity, the least of those that nearly coincide, shape (k,). [1/s]"""
    omega, shapes, system = modes.solution.omega, modes.shapes, modes.system
    lost = (shapes * (system.damping @ shapes)).sum(axis=0)
    lost = lost + (shapes * (system.stiffness.imag @ shapes)).sum(axis=0) / omega
    if linear.drag is not None and linear.scene.wind.aerodynamic_damping:
        for strip in strips(modes.solution, linear.layout, shapes, linear.drag):
            lost = lost + (np.moveaxis(strip.forces, 0, 1)[..., :-2] * strip.shapes).sum(axis=(0, 1))
    for begin, end in _clusters(omega):
        lost[begin:end] = lost[begin:end].min()
    return lost


def gain_error(movement):
    """Estimated relative error of the largest gain; not a number where it is not known. [-]

    Where the exact loop gain does not decide: by leaving out the highest of the lowest modes, or by the model with
    fewer modes; where modes were chosen among more, by what the others change.
    """
    limit = movement.limit
    if movement.loop is None or limit is None:
        return np.nan
    if movement.limit_errors is not None:
        return movement.limit_errors[0]
    if movement.linear.wide is not None:
        return np.nan if movement.limit_change is None else movement.limit_change
    found = limit_near(movement.fewer_loop, limit)
    if found is not None:
        return SAFETY * abs(found.factor / limit.factor - 1)
    return abs(movement.coarse.factor / limit.factor - 1) if movement.coarse else np.nan


def _gains(movement, candidates):
    """Gain from which each mode alone would grow, infinite where none does, shape (k,). [rad/s]

    Where the peak of the sensitivity bounds the gain, as if the phase of each were the worst one.
    """
    omega = candidates.modes.solution.omega
    s = 1j * omega[:, None]
    pulled = sum(s**order * part for order, part in enumerate(candidates.forces))
    measured = movement.measured_of(candidates.modes.shapes)
    shares = movement.allocation.shares[None] * (s * movement.loop.controller(s[:, 0]))[:, None, :]
    made = (shares @ measured.T[..., None])[..., 0]  # of the winches by each mode
    pushed, bounded = np.zeros(len(omega)), not isinstance(movement.scene.control.gain, int | float)
    for begin, end in _clusters(omega):
        own = slice(begin, end)
        values = np.linalg.eigvals(pulled[own] @ made[own].T)
        pushed[own] = (np.abs(values) if bounded else values.real).max()
    return np.where(pushed > 0, candidates.lost * omega**2 / np.where(pushed > 0, pushed, 1.0), np.inf)


def _clusters(omega):
    """First and one beyond the last of each run of frequencies that nearly coincide."""
    edges = np.flatnonzero(np.diff(omega) > CLOSE * omega[1:]) + 1
    return zip([0, *edges.tolist()], [*edges.tolist(), len(omega)], strict=True)
