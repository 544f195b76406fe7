"""Errors of cables whose drag is taken as uniform in a wind that grows with the height, against that where they hang.

The tension vector at Gauss's points is N = N_0 + c - integral of d, with N_0 under the uniform drag, the difference
d(s) of the drag where the cable hangs from that, and the constant c for which the ends stay where they are: the
integral of r' = N/EA + N/|N| is the chord. d depends on the form: c and d are found in turns, c by Newton's method.
"""

import numpy as np

from cablestudy.cable.geometry import places as places_along
from cablestudy.cable.steady_drag import DRAG_POINTS, across

PANELS = 3  # of DRAG_POINTS each, an odd number: also where a cable passes through the ground
STEPS = 8  # in which c and d settle; what is left in the last one is added to the error


def changes(drag, catenary):
    """Changes of cables between their ends as their drag follows the wind where they hang.

    Parameters
    ----------
    drag : SteadyDrag
        Of shape (n,), with a profile.
    catenary : Catenary
        Of shape (n,), under the uniform drag.

    Returns
    -------
    error : ndarray, shape (n,)
        The larger one of the change of the tension vector over the tension and of the movement at mid-length over the
        distance from the chord there. [-]
    ends : ndarray, shape (n, 2, 3)
        Change of the tension vector at both ends, global axes. [N]
    """
    span = catenary.span
    points, weights, running = _panels()
    stiffness = np.asarray(span.axial_stiffness)[:, None, None]
    given = span.in_frame(catenary.at(np.concatenate([points, [0.0, 1.0]]))[1], "global")
    first, where = given[:, :-2], places_along(catenary, points)
    slopes, length = _slope(first, stiffness)[0], span.unstretched_length[:, None, None]
    uniform = drag.averaged(across(drag.direction, span.frame[..., 0, :]))[:, None]
    constant, differs = np.zeros((len(first), 1, 3)), np.zeros_like(first)
    for _ in range(STEPS):
        slope, tension, tangent = _slope(first + constant - running @ differs, stiffness)
        longer = slope - slopes
        outer = tangent[..., :, None] * tangent[..., None, :]
        compliance = (np.eye(3) - outer) / tension[..., None] + (np.eye(3) / stiffness)[:, None]
        mean, gap = (weights[:, None, None] * compliance).sum(axis=1), (weights[:, None] * longer).sum(axis=1)
        step = np.linalg.solve(mean, gap[..., None])[:, None, :, 0]
        moved = running @ longer
        there = (1 + tension / stiffness) * across(drag.direction[:, None], tangent)
        there = drag.locally(there, lambda moved=moved: where + length * moved)
        constant, differs = constant - step, drag.pressed[:, None, None] * length * (there - uniform)
    ends = constant - np.stack([0 * differs[:, 0], (weights[:, None] * differs).sum(axis=1)], axis=1)
    change, before = np.concatenate([constant - running @ differs, ends], axis=1), _size(given)
    pulled = _size(change) + _size(step)
    away = np.maximum(_size(catenary.at(np.array([0.5]))[0])[:, 0], np.finfo(float).tiny)
    aside = _size(moved[:, len(points) // 2]) / away
    return np.maximum((pulled / np.maximum(before, np.finfo(float).tiny)).max(axis=-1), aside), ends


def _slope(force, stiffness):
    """r' of tension vectors, shape (n, k, 3) [-], their sizes, shape (n, k, 1) [N], and directions."""
    tension = np.maximum(_size(force), np.finfo(float).tiny)[..., None]
    return force / stiffness + force / tension, tension, force / tension


def _size(vectors):
    return np.sqrt((vectors**2).sum(axis=-1))


def _panels():
    """Gauss's points of PANELS equal parts of [0, 1], their weights, and the matrix of the integrals up to them."""
    nodes, weights = np.polynomial.legendre.leggauss(DRAG_POINTS)
    within, parts = running_integral(nodes), np.arange(PANELS)
    points = ((1 + nodes) / 2 + parts[:, None]).ravel() / PANELS
    before = np.kron(parts[:, None] > parts, np.ones((DRAG_POINTS, 1)) * weights / 2)
    return points, np.tile(weights / 2, PANELS) / PANELS, (np.kron(np.eye(PANELS), within) + before) / PANELS


def running_integral(nodes):
    """Matrix that takes values at Gauss's points of [0, 1] to their integral up to each point, by their polynomial."""
    order = np.arange(len(nodes))
    powers = nodes[:, None] ** order
    upper, lower = nodes[:, None] ** (order + 1), (-1.0) ** (order + 1)
    return (upper - lower) / (2 * (order + 1)) @ np.linalg.inv(powers)
