"""Forces on the nodes of the cables of a suspension as inputs of a linear system."""

import numpy as np

from cablestudy.system.superelement import NAMES
from cablestudy.wind.strips import coordinate_amplitudes, nodal_shapes


def with_node_forces(system, layout, coordinates, shapes=None):
    """Add forces on the inner nodes of the cables, for wind that varies along them, to the inputs of a linear system.

    While nothing moves, the two ends of a cable carry these forces, which changes its tensions and the forces that hold
    its ends directly: the change is in the matrix D of the system (see `strips.coordinate_amplitudes`).

    Parameters
    ----------
    system : LinearSystem
        From `control.suspension.suspension_systems`, or reduced from that; its last outputs are the tensions, two of
        each cable.
    layout : Layout
        Coordinates of the bodies, and their connection to the ends of the cables.
    coordinates : Coordinates
        Coordinates of the cables in the system that is not reduced.
    shapes : ndarray, shape (n, m), optional
        The n coordinates of that by the m of `system`; by default they are equal.

    Returns
    -------
    LinearSystem
        `system` with further inputs `CABLE.force_node_1_x` and so on: forces along global axes [N], nodes numbered from
        the end `from`. Cables without mass have none.
    """
    names, heavy = layout.equilibrium.suspension.cable_names, np.flatnonzero(coordinates.models.cables.heavy)
    if not heavy.size:
        return system
    shapes = np.eye(len(system)) if shapes is None else shapes
    by_cable = coordinate_amplitudes(coordinates, layout, shapes, list(heavy[:, None]))
    forces, labels = [], []  # forces on the coordinates, then their decrease of the two tensions of each heavy cable
    held, outputs = {}, [name for name, _ in system.outputs]  # index of a force on an end -> its decrease, and by which
    # moved: displacements of the nodes of a cable by its modes, then by its ends, shape (p, 3, k)
    on_nodes = nodal_shapes(coordinates.models, coordinates.kept, heavy)
    for (cable, _, _, moved), (of_cable,) in zip(on_nodes, by_cable, strict=True):
        nodes, moved = range(1, len(moved) - 1), moved[1:-1].reshape(-1, moved.shape[-1])
        forces.append((moved @ of_cable).T)
        for name, decrease in zip(NAMES, moved[:, -6:].T, strict=True):
            if (output := f"{names[cable]}.force_{name}") in outputs:
                held[outputs.index(output)] = slice(len(labels), len(labels) + len(moved)), decrease
        labels += [(f"{names[cable]}.force_node_{node}_{axis}", "N") for node in nodes for axis in "xyz"]
    forces, decrease = np.split(np.concatenate(forces, axis=1), [len(system)])
    direct = np.zeros((len(system.outputs), forces.shape[1]))
    first_tension = len(direct) - 2 * len(names)
    direct[(first_tension + 2 * heavy[:, None] + np.arange(2)).ravel()] = -decrease
    for row, (columns, load) in held.items():
        direct[row, columns] = -load
    return system.with_forces(forces, labels, direct)
