"""Deflection of a cable by point loads, linear and non-linear, as in the paper's Fig. 4."""

from dataclasses import replace

import numpy as np

from cablestudy.cable import segment
from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, System
from cablestudy.cable.catenary import solve, split
from cablestudy.cable.equilibrium import external_forces, from_catenary
from cablestudy.cable.equilibrium import solve as solve_elements
from cablestudy.cable.meshes import mesh_segments
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.tolerances import STUDY


def nodal_deflections(case):
    """Displacements of the nodes of a cable by its point loads, from its form without them: non-linear and linear.

    The non-linear displacement is the difference of two equilibria, with and without the loads. The linear one is the
    product of the tangent flexibility of the unloaded form and the loads. Their difference shows how non-linear the
    cable is.

    Parameters
    ----------
    case : CableCase or HangingCable
        With point loads. If `case.exact_statics`, both equilibria are those of the continuous cable; else they are
        those of the finite elements that the scene states.

    Returns
    -------
    mesh : Mesh
        Elements of the cable; the loads are at element boundaries.
    full, linear : ndarray, shape (nodes, 3)
        Non-linear and linear displacements, in the chord frame (along the chord, across it, sideways). [m] `linear` is
        NaN for a cable that hangs folded.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no point load, or no equilibrium of the unloaded cable.
    """
    span = case.span
    if not len(span.load_positions):
        raise NoSolutionError("the cable carries no point load")
    unloaded = case.form_of(span.without_loads())
    if not unloaded.record.converged:
        raise ConvergenceError("deflections need an equilibrium of the unloaded cable", unloaded.record)
    if case.exact_statics:
        fractions = split(span).fraction
        mesh = mesh_segments(fractions, len(fractions), STUDY.spectral_order)
        unloaded_state, loaded_state = from_catenary(unloaded, mesh), from_catenary(case.form, mesh)
    else:
        loaded_state = case.state
        mesh = loaded_state.mesh
        unloaded_state, _ = solve_elements(solve(span.without_loads()), mesh)
    full = loaded_state.displacement - unloaded_state.displacement
    length = float(span.unstretched_length)
    linear = _by_tangent(unloaded, mesh, span) if case.exact_statics else length * _by_elements(unloaded_state, span)
    return mesh, full * length, linear


def _by_tangent(unloaded, mesh, span):
    """Linear displacements of the nodes of a mesh by point loads, by the tangent of a continuous cable without loads.

    The tension vector of piece i, between the nodes i and i + 1, changes by c - f_i: c is its change at end 1, f_i the
    sum of the loads before the piece. With the flexibility F_i of the piece, the displacements u of its nodes differ by
    u_(i+1) - u_i = F_i (c - f_i). c follows from the ends, which stay: (sum of F_i) c = sum of F_i f_i. Returns u,
    shape (nodes, 3), in the chord frame [m]; NaN where the cable hangs folded.
    """
    if unloaded.folded:
        return np.full((mesh.nodes, 3), np.nan)
    entries = unloaded.flexibility_between(mesh.node_positions)  # qq, nn, yy, qn, qy, ny [m/N]
    flexibility = entries[[[0, 3, 4], [3, 1, 5], [4, 5, 2]]]  # shape (3, 3, pieces)
    forces = np.zeros((mesh.nodes, 3))
    np.add.at(forces, _nodes_of_loads(mesh, span), span.load_forces)
    loads_before = np.cumsum(forces, axis=0)[:-1].T
    change_at_end_1 = segment.solve_symmetric(entries.sum(axis=-1), (flexibility * loads_before).sum(axis=(1, 2)))
    moved_apart = (flexibility * (np.array(change_at_end_1)[:, None] - loads_before)).sum(axis=1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(moved_apart.T, axis=0)])


def _by_elements(unloaded, span):
    """Displacements of the nodes over the unstretched length by the tangent of elements without loads, (nodes, 3).

    `unloaded` is the `State` of the elements, `span` has the point loads.
    """
    forces = external_forces(replace(span, mass=0.0), unloaded.mesh, unloaded.force)[1:-1]
    linear = np.zeros_like(unloaded.displacement)
    for axes in (IN_PLANE, OUT_OF_PLANE):
        if forces[:, axes].any():
            displacement = System(unloaded, axes).solve(forces[:, axes].reshape(-1, 1))
            linear[1:-1, axes] = displacement.reshape(-1, len(axes))
    return linear


def _nodes_of_loads(mesh, span):
    """Node of each of k point loads, which are at ends of elements: list of int."""
    positions = span.load_positions / span.unstretched_length
    return [int(np.argmin(np.abs(mesh.edges - position))) * mesh.order for position in positions]


def load_deflections(case):
    """Displacement of each of k point loads along its force, non-linear and linear: two arrays of shape (k,). [m]"""
    mesh, full, linear = nodal_deflections(case)
    span, nodes = case.span, _nodes_of_loads(mesh, case.span)
    size = np.sqrt((span.load_forces**2).sum(axis=1))
    direction = span.load_forces / np.where(size > 0, size, 1.0)[:, None]
    return (full[nodes] * direction).sum(axis=1), (linear[nodes] * direction).sum(axis=1)


def rounding(case, full):
    """Error due to rounding of a deflection that is the difference of two forms of a cable in closed form. [m]

    Parameters
    ----------
    case : CableCase or HangingCable
    full : float
        The deflection. [m]
    """
    loaded, _ = case.form.at(np.linspace(0.0, 1.0, STUDY.spectral_order + 1))
    size = float(np.abs(loaded).max() * case.span.unstretched_length) + abs(full)
    return STUDY.form_rounding * size
