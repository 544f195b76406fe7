"""Modes above those of a model that the loop of the winches could drive: they decide whether a gain is stable.

A mode of frequency W and damping force c per velocity meets, by itself, s^2 + c s + W^2 + (gain/s) X = 0 with
X = b A N p: p what is measured of it, A N what the winches make of that, b their force on it. Near i W its pole moves
by

    gain X/(2 W^2) - c/2,

so that it grows from the gain c W^2/Re X on, where Re X is positive; of modes that nearly coincide X is a matrix, and
its eigenvalues count. The modes with the least such gains are taken into the model beside the lowest ones; eigenvalues
of the closed loop then decide.
"""

from dataclasses import replace

import numpy as np

from cablestudy.control.suspension import winch_forces
from cablestudy.system.coupled_modes import coupled_modes
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
    count = int(2 * highest / np.pi * cables.travel_time[cables.heavy].sum()) + movement.free_count
    if movement.modes.solution.omega[-1] >= highest or count <= lowest:
        return movement
    wide = coupled_modes(movement.equilibrium, min(count, MOST), movement.accuracy, cables.damping, movement.model)
    gains = _gains(movement, wide)
    limit = max(loop.gain, movement.largest_gain or 0.0)
    order = np.argsort(gains)
    risky = [mode for mode in order[:TAKEN].tolist() if mode >= lowest and gains[mode] < RISK * limit]
    if not risky:
        return movement
    return movement.with_modes(_some(wide, np.array([*range(lowest), *sorted(risky)])))


def _some(modes, chosen):
    """Some of the modes of a `CoupledModes`."""
    solution = modes.solution
    solution = replace(
        solution, omega=solution.omega[chosen], shapes=solution.shapes[:, chosen], omitted=solution.omitted[:, chosen]
    )
    return replace(
        modes,
        frequency=modes.frequency[chosen],
        error=modes.error[chosen],
        coincident=(),
        shapes=modes.shapes[:, chosen],
        solution=solution,
        finer=None,
    )


def _gains(movement, modes):
    """Gain from which each mode alone would grow, infinite where none does, shape (k,). [rad/s]"""
    layout, omega, shapes = movement.layout, modes.solution.omega, modes.shapes
    zeroth, first, second = winch_forces(layout, modes.solution.kept, movement.winches)
    s = 1j * omega
    pulled = shapes.T @ zeroth + s[:, None] * (shapes.T @ first) + s[:, None] ** 2 * (shapes.T @ second)
    measured = movement.measured_of(shapes)
    shares = movement.allocation.shares[None] * movement.loop.filters(s)[:, None, :]
    made = shares @ measured.T[..., None]  # of the winches by each mode
    driven = np.zeros(len(omega))
    for begin, end in _clusters(omega):
        own = slice(begin, end)
        driven[own] = np.linalg.eigvals(pulled[own] @ made[own, :, 0].T).real.max()
    system = modes.system
    lost = (shapes * (system.damping @ shapes)).sum(axis=0)
    lost = lost + (shapes * (system.stiffness.imag @ shapes)).sum(axis=0) / omega
    if movement.drag is not None and movement.scene.wind.aerodynamic_damping:
        for strip in strips(modes.solution, layout, shapes, movement.drag):
            lost = lost + np.einsum("pik,pij,pjk,p->k", strip.shapes, strip.drag, strip.shapes, strip.lengths)
    for begin, end in _clusters(omega):
        lost[begin:end] = lost[begin:end].min()
    return np.where(driven > 0, lost * omega**2 / np.where(driven > 0, driven, 1.0), np.inf)


def _clusters(omega):
    """First and one beyond the last of each run of frequencies that nearly coincide."""
    edges = np.flatnonzero(np.diff(omega) > CLOSE * omega[1:]) + 1
    return zip([0, *edges.tolist()], [*edges.tolist(), len(omega)], strict=True)
