"""Forces on the nodes of the cables as inputs of a suspension's state space, as of the wind on them."""

from dataclasses import replace

import numpy as np

from cablestudy.control.suspension import outward
from cablestudy.system.linear import dense
from cablestudy.wind.strips import nodal_shapes


def with_node_forces(system, layout, models, kept):
    """A `LinearSystem` of `control.suspension.second_order` with forces on inner nodes as further inputs.

    Parameters
    ----------
    system : LinearSystem
        In the coordinates of cables and bodies; its last outputs are the tensions, two of each cable.
    layout : Layout
    models : Models
        Of the c cables.
    kept : list of Kept
        Their coordinates in the system.

    Returns
    -------
    LinearSystem
        With the inputs `CABLE.force_node_1_x` and so on, global axes, numbered from the end `from` on. [N]
    """
    names, (direction, _) = layout.equilibrium.suspension.cable_names, outward(layout.equilibrium)
    sizes, ends = [len(one.element.omega) for one in kept], dense(layout.moved)
    begin, tensions = np.cumsum([0, *sizes]), len(system.outputs) - 2 * len(kept)
    forces, direct, labels = [], [], []
    for cable, _, _, shapes in nodal_shapes(models, kept, np.flatnonzero(models.cables.heavy)):
        moved, size = shapes[1:-1].reshape(-1, shapes.shape[-1]), sizes[cable]
        force, through = np.zeros((len(system), len(moved))), np.zeros((len(system.outputs), len(moved)))
        force[begin[cable] : begin[cable + 1]] = moved[:, :size].T
        force[begin[-1] :] = ends[6 * cable : 6 * cable + 6].T @ moved[:, size:].T
        # what the ends take statically is no force of the cable on them
        taken = moved[:, size:].reshape(-1, 2, 3)
        through[tensions + 2 * cable : tensions + 2 * cable + 2] = -np.einsum("ea,fea->ef", direction[cable], taken)
        forces.append(force)
        direct.append(through)
        nodes = range(1, len(shapes) - 1)
        labels += [(f"{names[cable]}.force_node_{node}_{axis}", "N") for node in nodes for axis in "xyz"]
    if not forces:
        return system
    forces, direct = np.concatenate(forces, axis=1), np.concatenate(direct, axis=1)
    return replace(
        system,
        b=tuple(np.concatenate([part, forces * (order == 0)], axis=1) for order, part in enumerate(system.b)),
        d=tuple(np.concatenate([part, direct * (order == 0)], axis=1) for order, part in enumerate(system.d)),
        inputs=(*system.inputs, *labels),
    )
