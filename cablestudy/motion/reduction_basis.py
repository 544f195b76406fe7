"""Coordinates of the model of a `Plant`: its modes, and the static responses to loads on the suspension.

Static responses represent the modes that the model leaves out. They are those to

* winches, and forces on bodies, which act on the suspension (`applied_loads`); on free points where their motion is
  asked for, and at mid-spans of cables where these are outputs;
* the inertia of the response to forces at the mid-span of a cable without a mode in the model: else its frequency
  would be that of a string under one force, a tenth too high;
* the mean drag that turns with these responses, where it matters;
* the inertia and damping of moving bodies and winches, and the inertia of the response to these, where
  `Plant.responses` asks for them: the effect of modes left out on the motion and the damping of the others.
"""

import numpy as np

from cablestudy.cable.records import stack
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.damping import ritz_of_rows
from cablestudy.system.linear import LinearSystem
from cablestudy.system.together import batches

MIDSPAN = ".midspan."  # in names of outputs


def applied_loads(plant):
    """Forces on the coordinates by winches, loads on bodies, and on free points and mid-spans, shape (n, r)."""
    winches, system = len(plant.winches), plant.full_system
    loaded = plant.points | (plant.layout.free < 6 * plant.equilibrium.suspension.bodies)
    of_bodies = winches + np.flatnonzero(loaded)
    loads = system.b[0].real[:, [*range(winches), *of_bodies.tolist()]], _midspan_loads(plant)
    return np.concatenate(loads, axis=1)


def _midspan_loads(plant):
    """Forces on the coordinates by unit forces at mid-spans that are outputs, shape (n, r)."""
    at_midspan = [row for name, row in plant.outputs.items() if MIDSPAN in name]
    return plant.full_system.c[0][at_midspan].real.T


def _applied_and_midspan_loads(plant):
    """`applied_loads`, and inertia of responses at mid-spans of cables without a mode in the model, shape (n, r)."""
    system, applied = plant.full_system, applied_loads(plant)
    if not plant.midspans:
        return applied
    without_modes = plant.modes.models.lowest_omega > 2 * np.pi * plant.modes.frequency[-1]
    loads = _midspan_loads(plant)[:, np.repeat(without_modes, 3)]
    return np.concatenate([applied, system.mass @ system.compliance(loads)], axis=1)


def _moving_loads(plant):
    """Forces on the coordinates by inertia and damping of moving bodies and winches, if asked for, shape (n, r)."""
    system, winches = plant.full_system, len(plant.winches)
    if not plant.responses:
        return np.zeros((len(system), 0))
    of_bodies = np.s_[:, len(system) - system.bodies :]
    moving = [part[of_bodies] for part in (system.mass, system.damping, system.stiffness.imag)]
    moving += [part[:, :winches] for part in (system.b[0].imag, system.b[1].real, system.b[2].real)]
    moving = np.concatenate(moving, axis=1)
    return moving[:, moving.any(axis=0)]


def _turning_loads(plant, applied):
    """Forces by the mean drag that turns with the responses to `applied` loads, shape (n, r), if they matter.

    They do where this is more than `MOTION.turning_drag` of the strain energy of a response: modes left out were 3e-5
    of an RMS without them, 8 times what is stated. With them the responses at rest are those of all coordinates.
    """
    system = plant.full_system
    if not plant.loads_turn:
        return np.zeros((len(system), 0))
    responses = system.compliance(applied)
    forces = plant.holding_loads(responses)[:, : responses.shape[1]]
    energies = (responses * applied).sum(axis=0)
    if not (np.abs((responses * forces).sum(axis=0)) > MOTION.turning_drag * energies).any():
        return forces[:, :0]
    turning = plant.holding_loads(np.eye(len(system)))[:, : len(system)]
    return turning @ np.linalg.solve(system.stiffness.real + turning, applied)


def loads_and_bases(plants, size):
    """Yield for each plant the reduction basis of its model: modes, and static responses in place of the other modes.

    A static response is K^-1 f, with the stiffness K and forces f on the coordinates. The head of this file says which
    forces count. Plants whose arrays have equal sizes are computed together.

    Parameters
    ----------
    plants : list of Plant
    size : callable
        Plant -> number n of coordinates of its full system.

    Yields
    ------
    plant : Plant
    loads : ndarray, shape (n, r)
        The r columns f.
    basis : (ndarray, ndarray), shapes (m,) and (n, m)
        Frequencies [rad/s] and shapes of the m coordinates of the model: modes of the plant, then Ritz vectors of the
        static responses.
    """
    loads = {plant: (_applied_and_midspan_loads(plant), _moving_loads(plant)) for plant in plants}
    turning = {plant: _turning_loads(plant, applied) for plant, (applied, _) in loads.items()}

    def sizes(plant):
        """Sizes that plants have in common whose bases are computed together."""
        parts = *loads[plant], turning[plant]
        return plant.full_system.signature, plant.modes.shapes.shape, *(part.shape for part in parts)

    for members in batches(plants, sizes, size):
        systems = LinearSystem.of_rows([plant.full_system for plant in members])
        applied, moving = stack([loads[plant] for plant in members])
        inertia = systems.mass @ systems.compliance(moving)
        all_loads = np.concatenate([applied, moving, inertia, stack([turning[plant] for plant in members])], axis=-1)
        shapes = np.array([plant.modes.shapes for plant in members])
        added = ritz_of_rows(systems, shapes, systems.compliance(all_loads))
        for plant, of_row, (omega, vectors) in zip(members, all_loads, added, strict=True):
            modes, ascending = plant.modes, np.argsort(omega)
            frequencies = np.concatenate([modes.omega[plant.kept], omega[ascending]])
            basis = np.concatenate([modes.shapes[:, plant.kept], vectors[:, ascending]], axis=1)
            yield plant, (of_row, (frequencies, basis))


def space_with_fewer_modes(plant, loads):
    """Basis of a smaller model, whose results tell the error by the modes left out, shape (m, r).

    Of the m coordinates of a plant it has the lowest modes, a share `MOTION.fewer_modes` of them, static responses to
    `loads`, shape (n, j), modes that the loop could drive, and all strokes.
    """
    (omega, shapes), count = plant.basis, len(plant.kept)
    modes = np.count_nonzero(plant.kept < len(plant.modes) - plant.driven)
    lowest = int(MOTION.fewer_modes * modes)
    replaced = np.concatenate([np.arange(lowest, modes), np.arange(count, len(omega))])
    static = (shapes.T @ loads / omega[:, None] ** 2)[replaced]
    static, sizes, _ = np.linalg.svd(static, full_matrices=False)
    static = static[:, sizes > MOTION.dependent_response * sizes.max(initial=0.0)]
    unit = np.eye(len(plant.motion))
    driven, strokes = unit[:, modes:count], unit[:, len(omega) :]
    return np.concatenate([unit[:, :lowest], driven, unit[:, replaced] @ static, strokes], axis=1)
