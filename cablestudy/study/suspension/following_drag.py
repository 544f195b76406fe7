"""Places of bodies in a mean wind with drag that varies along each cable, in place of uniform drag.

The drag on a piece of a hanging cable depends on its direction. First it is taken as uniform along each cable, by the
direction of its chord. The drag that follows the cable's local direction changes the forces of the cable on its ends
(`CablesInDrag`). These changes are loads on the bodies, found again where the bodies move, until all is in
equilibrium.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.study.suspension.drag_change import drag_on_cables
from cablestudy.study.tolerances import STUDY
from cablestudy.study.uneven_drag import CablesInDrag
from cablestudy.wind.mean import equilibrium_in_wind


@dataclass(frozen=True)
class Poses:
    """Poses of the b bodies and free points of n cases.

    Attributes
    ----------
    position : ndarray, shape (n, b, 3)
        [m]
    rotation : ndarray, shape (n, b, 3, 3)
    uncertainty : ndarray, shape (n, b, 6)
        Errors of positions [m] and attitudes [rad] by the drag.
    followed : ndarray of bool, shape (n,)
        True where the drag varies along the cables, as it does in reality. False where it is taken as uniform along
        each cable; `uncertainty` is then a first-order estimate of what this neglects.
    """

    position: np.ndarray
    rotation: np.ndarray
    uncertainty: np.ndarray
    followed: np.ndarray


def poses_in_following_drag(without_wind, equilibrium, drag, uncertainty):
    """Find where the bodies of suspensions are in a mean wind whose drag varies along each cable: `Poses`.

    The drag varies with the local direction of the cable; in `equilibrium` it is taken as uniform along each cable.
    Cases without wind on a cable, or for which no equilibrium is found, keep the pose of `equilibrium`.

    Parameters
    ----------
    without_wind, equilibrium : Equilibrium
        Of n cases: without wind, and in the wind under uniform drag.
    drag : Drag
        The wind, and drag areas of cables and bodies.
    uncertainty : ndarray, shape (n, b, 6)
        Estimated errors of the poses of `equilibrium` by taking the drag as uniform. [m], [rad]

    Returns
    -------
    Poses
        Where a pose in uneven drag is found, its uncertainty is `STUDY.following_drag` times the given one.
    """
    not_followed = np.zeros(len(uncertainty), dtype=bool)
    poses = Poses(equilibrium.position.copy(), equilibrium.rotation.copy(), uncertainty.copy(), not_followed)
    in_wind = (drag_on_cables(drag, equilibrium).normal_drag > 0).any(axis=-1)
    rows = np.flatnonzero(in_wind & equilibrium.record.converged)
    if not (len(rows) and equilibrium.suspension.free.any()):
        return poses
    drag, start = drag.take(rows), replace(equilibrium.take(rows), suspension=without_wind.suspension.take(rows))
    result = equilibrium_in_wind(start, drag, lambda state: _changes_of_end_forces(state, drag))
    converged = result.record.converged
    uncertainty = STUDY.following_drag * uncertainty[rows]
    poses.followed[rows[converged]] = True
    for name, values in (("position", result.position), ("rotation", result.rotation), ("uncertainty", uncertainty)):
        getattr(poses, name)[rows[converged]] = values[converged]
    return poses


def _changes_of_end_forces(equilibrium, drag):
    """Changes of the forces of cables on bodies and ground if drag is not taken as uniform along each cable.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of n cases, in uniform drag.
    drag : Drag
        The wind, and drag areas of cables and bodies.

    Returns
    -------
    ndarray, shape (n, c, 2, 3)
        At both ends of the c cables, global axes; zero without wind on a cable. [N]
    """
    forces, drag_of_cables = np.zeros((*equilibrium.lengths.shape, 2, 3)), drag_on_cables(drag, equilibrium)
    in_wind = np.nonzero((drag_of_cables.normal_drag > 0) & equilibrium.record.converged[:, None])
    drag_in_wind, catenary = drag_of_cables.take(in_wind), equilibrium.catenary.take(in_wind)
    cables = CablesInDrag.of(drag_in_wind, catenary, drag.stretched)
    changes = cables.changes(steps=STUDY.following_drag_steps)
    forces[in_wind] = changes.end_tensions * np.array([1.0, -1.0])[:, None]
    return forces
