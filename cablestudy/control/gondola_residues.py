"""The gondola's response to a force on it as a sum over poles, with the winch at rest and with its loop closed.

Of the cable's modes those that matter for the motion are kept; few vectors stand for all others
(`LinearSystem.reduced`), so that one eigenvalue problem of some twenty states gives all poles. A delay is by
approximants in the poles and exact in the response (`residues.beside`).
"""

from dataclasses import replace

import numpy as np

from cablestudy.system.residues import beside, eigen, eigen_apart, residues

BLUNT = 0.03  # of the gondola's stiffness: least dynamic stiffness at the resonance of a mode
NO_DAMPING = 1e-12  # damping ratio of a mode at least


def at_rest(system, inputs):
    """`Residues` of the gondola's place by forces, the winch at rest. [m/N]

    Parameters
    ----------
    system : LinearSystem
        Of gondola and cable; the gondola is its last coordinate.
    inputs : ndarray, shape (n, i)
        Forces on the coordinates of the system.
    """
    return _residues(system, system.eigen, _forced(system, inputs), [len(system.mass) - 1])


def closed(loop, system, inputs):
    """`Residues` of the places of gondola and winch by forces, as `at_rest`; `Beside` with a delay. [m/N]"""
    plant = loop.plant
    if not plant.law.delay:
        return _with_filter(loop, system, inputs, 0.0)
    highest = plant.right_up_to(plant.pole_model.omega)
    without = replace(plant, law=replace(plant.law, delay=0.0), known={})
    slow = _with_filter(loop, system, inputs, highest)
    fast = _with_filter(replace(loop, plant=without, law=without.law), system, inputs, 0.0)
    return beside(_response(loop, system, inputs), slow, fast, highest)


def _with_filter(loop, system, inputs, highest):
    """`closed` with the delay as approximants that are right up to a frequency [rad/s]."""
    plant = loop.plant
    fixed, scaled = plant.feedback(system, highest)
    a, n = fixed + loop.gain * scaled, len(system.mass)
    found = (eigen_apart if plant.law.delay else eigen)(a)
    force = np.zeros((len(a), inputs.shape[1]), dtype=a.dtype)
    force[: 2 * n] = _forced(system, inputs)
    return _residues(system, found, force, [n - 1, len(a) - 1])


def _residues(system, found, force, places):
    """`Residues` of a state space with states w z: those of the gondola and the winch are at some places."""
    shown = np.zeros((len(places), len(force)))
    for row, place in enumerate(places):
        shown[row, place] = 1 / system.unit[-1] if place == len(system.mass) - 1 else 1.0
    sums = residues(found, force, shown, np.zeros((len(places), force.shape[1])))
    return replace(sums, one_sided=bool(np.iscomplexobj(system.stiffness)))


def _forced(system, inputs):
    """What forces on the coordinates do to the states, shape (2 n, i)."""
    return np.concatenate([np.zeros(inputs.shape), np.linalg.solve(system.mass, inputs)])


def _response(loop, system, inputs):
    """A function of s: places of gondola and winch by forces, shape (f, 2, i), with the delay itself. [m/N]"""
    pushed = np.concatenate([inputs, *system.driven], axis=1)
    alone = _residues(system, system.eigen, _forced(system, pushed), [len(system.mass) - 1])
    count = inputs.shape[1]

    def response(s):
        found = alone.response(s)[:, 0]
        place, speed, acceleration = found[:, count:].T
        moving = loop.gain * loop.controller(s) * (1.0 if loop.location == "gondola" else -1.0)
        moved = found[:, :count] / (1 - (place + s * (speed + s * acceleration)) * moving)[:, None]
        return np.stack([moved, moving[:, None] * moved], axis=1)

    return response


def shaken_by(system, force):
    """About the variance of the gondola's place by the resonance of each mode of the cable, shape (n,). [m^2]

    Parameters
    ----------
    system : LinearSystem
        Of gondola and cable; the gondola is its last coordinate.
    force : ndarray, shape (n,)
        Spectrum of the force on each mode at its frequency. [N^2/(kg Hz)]

    Notes
    -----
    A mode at its resonance moves the gondola by inertia and, with damped strain, by damping.
    """
    matrices, omega = (system.stiffness, system.damping, system.mass), system.unit[:-1]
    s = 1j * omega
    across, own = (
        part[0] + s * part[1] + s**2 * part[2]
        for part in ([one[:-1, -1] for one in matrices], [one[-1, -1] for one in matrices])
    )
    moved = np.abs(across) / np.maximum(np.abs(own), BLUNT * system.stiffness[-1, -1].real)
    decay = (np.diagonal(system.damping)[:-1] + np.diagonal(system.stiffness).imag[:-1] / omega) / 2
    size = moved**2 * force / (8 * omega**2)
    return np.where(size > 0, size / np.maximum(decay, NO_DAMPING * omega), 0.0)
