"""Deflection of a cable by point loads, linear and non-linear, as in the paper's Fig. 4."""

from dataclasses import replace

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, System
from cablestudy.cable.catenary import solve, split
from cablestudy.cable.element import mesh_segments
from cablestudy.cable.equilibrium import external_forces, from_catenary
from cablestudy.cable.equilibrium import solve as solve_elements
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.tolerances import STUDY


def nodal_deflections(case):
    """Displacements of the nodes of a cable by its point loads: from the form without loads to the form with them.

    They are computed twice, so that a user sees how non-linear the cable is: as the difference of both equilibria, and
    linearly, by the tangent stiffness of the unloaded form.

    Parameters
    ----------
    case : Case

    Returns
    -------
    mesh : Mesh
        Elements of the cable; the loads are at element boundaries.
    full, linear : ndarray, shape (nodes, 3)
        Non-linear and linear displacements, in the chord frame. [m]

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no point load, or no equilibrium of the unloaded cable.
    """
    span = case.span
    if not len(span.load_positions):
        raise NoSolutionError("the cable carries no point load")
    unloaded = solve(span.without_loads())
    if not unloaded.record.converged:
        raise ConvergenceError("deflections need an equilibrium of the unloaded cable", unloaded.record)
    if case.exact_statics:  # both forms are elastic catenaries; else those of the scene's own elements
        fractions = split(span).fraction
        mesh = mesh_segments(fractions, len(fractions), STUDY.spectral_order)
        unloaded_state, loaded_state = from_catenary(unloaded, mesh), from_catenary(case.catenary, mesh)
    else:
        loaded_state = case.state
        mesh = loaded_state.mesh
        unloaded_state, _ = solve_elements(unloaded, mesh)
    full = loaded_state.displacement - unloaded_state.displacement
    loads_only = replace(span, mass=0.0)
    forces = external_forces(loads_only, mesh, unloaded_state.force)[1:-1]
    linear = np.zeros_like(full)
    for axes in (IN_PLANE, OUT_OF_PLANE):
        if forces[:, axes].any():
            displacement = System(unloaded_state, axes).solve(forces[:, axes].reshape(-1, 1))
            linear[1:-1, axes] = displacement.reshape(-1, len(axes))
    length = float(span.unstretched_length)
    return mesh, full * length, linear * length


def load_deflections(case):
    """Displacement of each of k point loads along its force, non-linear and linear: two arrays of shape (k,). [m]"""
    mesh, full, linear = nodal_deflections(case)
    span = case.span
    positions = span.load_positions / span.unstretched_length
    nodes = np.array([int(np.argmin(np.abs(mesh.edges - position))) * mesh.order for position in positions])
    size = np.sqrt((span.load_forces**2).sum(axis=1))
    direction = span.load_forces / np.where(size > 0, size, 1.0)[:, None]
    return (full[nodes] * direction).sum(axis=1), (linear[nodes] * direction).sum(axis=1)
