"""Change of cables in a steady wind by the drag where they hang, in place of the drag that is uniform along each.

The tension vector at a point is N = N_0 + c - integral of d, with N_0 under the uniform drag, d(s) the drag where the
cable hangs less the uniform one, and c the constant vector for which the ends stay where they are: the integral of
r' = N/EA + N/|N| is the chord. d depends on the form: c and d are found in turns, c by Newton's method. Integrals are
by Gauss's rule on each piece between two loads, and on both sides of mid-length: r' is smooth there.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.cable.geometry import places as places_along
from cablestudy.cable.steady_drag import across
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size
from cablestudy.study.tolerances import STUDY


def changes(drag, catenary, stretched=False):
    """Compute how n equilibria change if drag that varies along each cable takes the place of uniform drag.

    The changes are the errors of results with uniform drag.

    Parameters
    ----------
    drag : SteadyDrag
        Drag on the n cables.
    catenary : Catenary
        Equilibria of the n cables under the uniform drag, between fixed ends.
    stretched : bool
        Whether the uniform drag was computed for the stretched length, not for the unstretched one.

    Returns
    -------
    error : ndarray, shape (n,)
        The larger one of the change of the tension vector over the tension and of the movement at mid-length over the
        distance from the chord there. [-]
    ends : ndarray, shape (n, 2, 3)
        Change of the tension vector at both ends, global axes. [N]
    displacement : ndarray, shape (n, j, 3)
        Movement of j points along each cable. [m]
    points : ndarray, shape (n, j)
        These points, shares of the unstretched length. [-]

    Notes
    -----
    Symbols as at the head of the file: N_0 `at_points`, d `difference`, c `constant`, r' `slope`.
    """
    span, pieces = catenary.span, Pieces.of(catenary)
    stiffness, length = (np.asarray(array)[:, None, None] for array in (span.axial_stiffness, span.unstretched_length))
    at_points, at_ends = (
        span.in_frame(catenary.tension_at(points), "global") for points in (pieces.points, np.array([0.0, 1.0]))
    )
    uniform_drag = drag.times_mean_pressure(across(drag.direction, span.frame[..., 0, :]))[:, None]
    if stretched:
        uniform_drag = uniform_drag * (1 + catenary.mean_tension / span.axial_stiffness)[:, None, None]
    positions = None if drag.profile is None else places_along(catenary, pieces.points)
    constant, displacement = np.zeros((len(at_points), 1, 3)), np.zeros_like(at_points)
    start, tension, tangent = _slope(at_points, stiffness)
    at_middle, before_middle = np.zeros_like(constant), (pieces.points < 0.5)[..., None]
    for _ in range(STUDY.drag_steps):
        # the drag where the cable hangs now, then one Newton step of c for it, then the new form
        actual_drag, shift = (1 + tension / stiffness) * across(drag.direction[:, None], tangent), length * displacement
        actual_drag = drag.times_local_pressure(actual_drag, lambda shift=shift: positions + shift)
        difference = drag.normal_drag[:, None, None] * length * (actual_drag - uniform_drag)
        without_constant = at_points - pieces.running_integral(difference)
        slope, tension, tangent = _slope(without_constant + constant, stiffness)
        step = _newton_step(slope - start, tension, tangent, pieces, stiffness)
        constant = constant - step
        slope, tension, tangent = _slope(without_constant + constant, stiffness)
        displacement = pieces.running_integral(slope - start)
        previous, at_middle = at_middle, pieces.integral((slope - start) * before_middle)
    ends = constant - np.concatenate([0 * constant, pieces.integral(difference)], axis=1)
    force = np.concatenate([at_points, at_ends], axis=1)
    change = np.concatenate([without_constant + constant - at_points, ends], axis=1)
    # the last steps of the iteration, of c and of the form, are added to the errors
    force_error = ((size(change) + size(step)) / np.maximum(size(force), np.finfo(float).tiny)).max(axis=-1)
    offset = size(span.in_frame(catenary.at(np.array([0.5]))[0], "global"))
    shape_error = (size(at_middle) + size(at_middle - previous)) / np.maximum(offset, np.finfo(float).tiny)
    return np.maximum(force_error, shape_error[:, 0]), ends, length * displacement, pieces.points


@dataclass(frozen=True)
class Pieces:
    """Gauss's rule on pieces of n cables: k points on each of p pieces, j = p k.

    Attributes
    ----------
    width : ndarray, shape (n, p)
        Of each piece, a share of the unstretched length; zero of pieces for loads that a cable does not have. [-]
    points : ndarray, shape (n, j)
        Shares of the unstretched length. [-]
    weights : ndarray, shape (n, j, 1)
        They add up to 1. [-]
    """

    width: np.ndarray
    points: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, catenary):
        """The `Pieces` of n cables between their loads, and on both sides of mid-length."""
        nodes, weights = np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)
        loaded = np.pad(catenary.span.load_forces.any(axis=-1), ((0, 0), (1, 1)), constant_values=True)
        edges = np.where(loaded, catenary.edges, 1.0)
        edges = np.sort(np.concatenate([edges, np.full((len(edges), 1), 0.5)], axis=-1), axis=-1)
        width = np.diff(edges, axis=-1)
        points = edges[:, :-1, None] + width[..., None] * (1 + nodes) / 2
        of_points = width[..., None] * weights / 2
        return cls(width, points.reshape(len(points), -1), of_points.reshape(len(points), -1, 1))

    def integral(self, vectors):
        """Integral over each cable of vectors at its points, shape (n, j, 3): shape (n, 1, 3)."""
        return (self.weights * vectors).sum(axis=1, keepdims=True)

    def running_integral(self, vectors):
        """Integral from end 1 up to each point of vectors at the points, shape (n, j, 3)."""
        of_pieces = (*self.width.shape, -1, 3)
        within = self.width[..., None, None] * (_running_integral() @ vectors.reshape(of_pieces))
        whole = (self.weights * vectors).reshape(of_pieces).sum(axis=2, keepdims=True)
        return (within + np.cumsum(whole, axis=1) - whole).reshape(vectors.shape)


def _newton_step(slope_change, tension, tangent, pieces, stiffness):
    """Step of Newton's method by which c takes back the displacement of end 2, shape (n, 1, 3). [N]

    `slope_change`, shape (n, j, 3), is r' less r' under the uniform drag: its integral is the displacement of end 2.
    Tension and tangent are size [N] and direction of the tension vector.
    """
    # derivative of the integral of r' with c: that of (I - t t^T)/T + I/EA
    weights = pieces.weights / tension
    jacobian = (weights.sum(axis=1, keepdims=True) + 1 / stiffness) * np.eye(3)
    jacobian = jacobian - np.swapaxes(weights * tangent, -1, -2) @ tangent
    return np.linalg.solve(jacobian, pieces.integral(slope_change)[:, 0, :, None])[:, None, :, 0]


def _slope(force, stiffness):
    """r' of tension vectors, shape (n, j, 3) [-], their sizes, shape (n, j, 1) [N], and directions.

    Sizes are not less than a share of the largest one, so that no quotient overflows.
    """
    tension = size(force)[..., None]
    tension = np.maximum(tension, STUDY.slack * np.maximum(tension.max(axis=1, keepdims=True), STUDY.slack))
    return force / stiffness + force / tension, tension, force / tension


@lru_cache(1)
def _running_integral():
    """Matrix that takes values at Gauss's points of [0, 1] to their integral up to each point, by their polynomial."""
    nodes, _ = np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)
    order = np.arange(len(nodes))
    powers = nodes[:, None] ** order
    upper, lower = nodes[:, None] ** (order + 1), (-1.0) ** (order + 1)
    return (upper - lower) / (2 * (order + 1)) @ np.linalg.inv(powers)
