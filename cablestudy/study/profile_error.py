"""Errors of cable statics that take the drag as uniform along each cable, in a wind that grows with the height.

The tension vector at Gauss's points is N = N_0 + c - integral of d, with N_0 under the uniform drag, d(s) the drag
where the cable hangs less the uniform one, and c the constant vector for which the ends stay where they are: the
integral of r' = N/EA + N/|N| is the chord. d depends on the form: c and d are found in turns, c by Newton's method.
"""

import numpy as np

from cablestudy.cable.geometry import places as places_along
from cablestudy.cable.steady_drag import across
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size
from cablestudy.study.tolerances import STUDY


def changes(drag, catenary):
    """Compute how n equilibria change if drag that varies along each cable takes the place of uniform drag.

    The changes are the errors of results with uniform drag, in a wind that grows with the height.

    Parameters
    ----------
    drag : SteadyDrag
        Drag on the n cables, with a profile of the wind over the height.
    catenary : Catenary
        Equilibria of the n cables under the uniform drag, between fixed ends.

    Returns
    -------
    error : ndarray, shape (n,)
        The larger one of the change of the tension vector over the tension and of the movement at mid-length over the
        distance from the chord there. [-]
    sag_error : ndarray, shape (n,)
        Vertical movement at mid-length over the vertical distance from the chord there. [-]
    ends : ndarray, shape (n, 2, 3)
        Change of the tension vector at both ends, global axes. [N]
    displacement : ndarray, shape (n, k, 3)
        Movement of Gauss's points. [m]

    Notes
    -----
    Symbols as at the head of the file: N_0 `at_points`, d `difference`, c `constant`, r' `slope`.
    """
    span = catenary.span
    nodes, weights = np.polynomial.legendre.leggauss(CABLE.drag_points)
    points, weights, running = (1 + nodes) / 2, weights / 2, running_integral(nodes)
    stiffness, length = (np.asarray(array)[:, None, None] for array in (span.axial_stiffness, span.unstretched_length))
    uniform_force = span.in_frame(catenary.at(np.concatenate([points, [0.0, 1.0]]))[1], "global")
    at_points, positions = uniform_force[:, :-2], places_along(catenary, points)
    uniform_drag = drag.times_mean_pressure(across(drag.direction, span.frame[..., 0, :]))[:, None]
    constant, displacement = np.zeros((len(at_points), 1, 3)), np.zeros_like(at_points)
    start, tension, tangent = _slope(at_points, stiffness)
    for _ in range(STUDY.profile_steps):
        # the drag where the cable hangs now, then one Newton step of c for it, then the new form
        actual_drag, shift = (1 + tension / stiffness) * across(drag.direction[:, None], tangent), length * displacement
        actual_drag = drag.times_local_pressure(actual_drag, lambda shift=shift: positions + shift)
        difference = drag.normal_drag[:, None, None] * length * (actual_drag - uniform_drag)
        without_constant = at_points - running @ difference
        slope, tension, tangent = _slope(without_constant + constant, stiffness)
        step = _newton_step(slope - start, tension, tangent, weights, stiffness)
        constant = constant - step
        slope, tension, tangent = _slope(without_constant + constant, stiffness)
        previous, displacement = displacement, running @ (slope - start)
    ends = constant - np.stack([0 * difference[:, 0], (weights[:, None] * difference).sum(axis=1)], axis=1)
    change = np.concatenate([without_constant + constant - at_points, ends], axis=1)
    force_size = np.maximum(size(uniform_force), np.finfo(float).tiny)
    # the last steps of the iteration, of c and of the form, are added to the errors
    tension_change = ((size(change) + size(step)) / force_size).max(axis=-1)
    middle = np.stack([displacement, displacement - previous])[:, :, CABLE.drag_points // 2]
    shape_error, sag_error = shares_at_middle(size(middle).sum(axis=0), np.abs(middle[..., 2]).sum(axis=0), catenary)
    return np.maximum(tension_change, shape_error), sag_error, ends, length * displacement


def _newton_step(slope_change, tension, tangent, weights, stiffness):
    """Step of Newton's method by which c takes back the displacement of end 2, shape (n, 1, 3). [N]

    `slope_change`, shape (n, k, 3), is r' at k Gauss's points less r' under the uniform drag: its integral, by the
    `weights`, is the displacement of end 2. Tension and tangent are size [N] and direction of the tension vector.
    """
    weight_over_tension, gap = weights[:, None] / tension, (weights[:, None] * slope_change).sum(axis=1)
    # derivative of the integral of r' with c
    jacobian = (weight_over_tension.sum(axis=1, keepdims=True) + 1 / stiffness) * np.eye(3)
    jacobian = jacobian - ((weight_over_tension * tangent)[..., :, None] * tangent[..., None, :]).sum(axis=1)
    return np.linalg.solve(jacobian, gap[..., None])[:, None, :, 0]


def shares_at_middle(distance, vertical, catenary):
    """Movement at mid-length over the distance from the chord there, and likewise vertically, each of shape (n,). [-]

    Parameters
    ----------
    distance, vertical : ndarray, shape (n,)
        Over the unstretched length. [-]
    catenary : Catenary
        Of shape (n,).
    """
    offset = catenary.span.in_frame(catenary.at(np.array([0.5]))[0], "global")[:, 0]
    tiny = np.finfo(float).tiny
    return distance / np.maximum(size(offset), tiny), vertical / np.maximum(np.abs(offset[..., 2]), tiny)


def _slope(force, stiffness):
    """r' of tension vectors, shape (n, k, 3) [-], their sizes, shape (n, k, 1) [N], and directions."""
    tension = np.maximum(size(force), np.finfo(float).tiny)[..., None]
    return force / stiffness + force / tension, tension, force / tension


def running_integral(nodes):
    """Matrix that takes values at Gauss's points of [0, 1] to their integral up to each point, by their polynomial."""
    order = np.arange(len(nodes))
    powers = nodes[:, None] ** order
    upper, lower = nodes[:, None] ** (order + 1), (-1.0) ** (order + 1)
    return (upper - lower) / (2 * (order + 1)) @ np.linalg.inv(powers)
