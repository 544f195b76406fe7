"""Change of cables in a steady wind due to the drag where they hang, in place of the drag that is uniform along each.

The tension vector at a point is N = N_0 + c - integral of d, with N_0 under the uniform drag, d(s) the drag where the
cable hangs less the uniform one, and c the constant vector for which the ends stay where they are, or go where they
move: the integral of r' = N/EA + N/|N| is the chord. d depends on the form: c and d are found in turns, c by Newton's
method. Integrals are by Gauss's rule on each piece between two loads, and on both sides of mid-length: r' is smooth
there.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cablestudy.cable.geometry import points_along
from cablestudy.cable.matrices import of_each, solved
from cablestudy.cable.records import assign_rows, take_rows
from cablestudy.cable.steady_drag import SteadyDrag, across
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size


@dataclass(frozen=True)
class ChangesByDrag:
    """Changes of n equilibria where drag that varies along each cable takes the place of uniform drag.

    Attributes
    ----------
    end_tensions : ndarray, shape (n, 2, 3)
        Change of the tension vector at both ends, global axes. [N]
    displacement : ndarray, shape (n, j, 3)
        Movement of the j points of its `Pieces` along each cable. [m]
    tensions : ndarray, shape (n, j, 3)
        Tension vectors at these points under the actual drag, global axes. [N]
    constant, difference : ndarray, shape (n, 1, 3), (n, j, 3)
        c of the head of the file, and d at these points times the unstretched length. [N]
    unsettled : ndarray, shape (n,)
        Last change of tension vectors and form in the search, over all of their change. [-]
    """

    end_tensions: np.ndarray
    displacement: np.ndarray
    tensions: np.ndarray
    constant: np.ndarray
    difference: np.ndarray
    unsettled: np.ndarray


@dataclass(frozen=True)
class CablesInDrag:
    """n cables in uniform drag, and what is needed to find their form in the drag that varies along each.

    Made by `of`. Vectors are in global axes; points are those of `pieces`, j along each cable.
    """

    drag: SteadyDrag
    pieces: "Pieces"
    stiffness: np.ndarray  # (n, 1, 1): EA [N]
    length: np.ndarray  # (n, 1, 1): unstretched [m]
    uniform_drag: np.ndarray  # (n, 1, 3): over the drag at right angles to the wind [-]
    at_points: np.ndarray  # (n, j, 3): tension vectors N_0 [N]
    at_ends: np.ndarray  # (n, 2, 3): N_0 at both ends [N]
    positions: np.ndarray | None  # (n, j, 3): of the points from ends 1, where the wind has a profile [m]

    @classmethod
    def of(cls, drag, catenary, pieces, stretched=False):
        """Make `CablesInDrag` of n equilibria.

        Parameters
        ----------
        drag : SteadyDrag
            Drag on the n cables.
        catenary : Catenary
            Equilibria of the n cables under the uniform drag, between fixed ends.
        pieces : Pieces
            Of the cables.
        stretched : bool
            Whether the uniform drag was computed for the stretched length, not for the unstretched one.
        """
        span = catenary.span
        uniform_drag = drag.times_mean_pressure(across(drag.direction, span.frame[..., 0, :]))[:, None]
        if stretched:
            uniform_drag = uniform_drag * (1 + catenary.mean_tension / span.axial_stiffness)[:, None, None]
        at_points, at_ends = (
            span.in_frame(catenary.tension_at(points), "global") for points in (pieces.points, np.array([0.0, 1.0]))
        )
        stiffness, length = (
            np.asarray(array)[..., None, None] for array in (span.axial_stiffness, span.unstretched_length)
        )
        positions = None if drag.profile is None else points_along(catenary, pieces.points)
        return cls(drag, pieces, stiffness, length, uniform_drag, at_points, at_ends, positions)

    def changes(self, ends=None, start=None, steps=CABLE.drag_steps, share=1.0):
        """Compute how the equilibria change in the actual drag.

        Parameters
        ----------
        ends : ndarray, shape (n, 2, 3), optional
            Movements of the two ends of each cable; by default they are held. [m]
        start : ChangesByDrag, optional
            Of the same cables, with which the search begins.
        steps : int
            Number of turns in which c and d settle.
        share : float
            Of the new d that each turn takes, and of the tension by which a step may change c: less than 1 where a
            slack cable would swing to and fro.

        Returns
        -------
        ChangesByDrag

        Notes
        -----
        Symbols as at the head of the file: N_0 `at_points`, d `difference`, c `constant`, r' `slope`.
        """
        drag, pieces, stiffness, length = self.drag, self.pieces, self.stiffness, self.length
        at_points, none = self.at_points, np.zeros((len(self.at_points), 1, 3))
        from_end, apart = (none, none) if ends is None else (ends[:, :1] / length, (ends[:, 1:] - ends[:, :1]) / length)
        uniform_slope, tension, tangent = slope_of(at_points, stiffness)
        constant, displacement, difference = none, np.zeros_like(at_points), 0.0
        if start is not None:
            constant, displacement, difference = start.constant, start.displacement / length, start.difference
            _, tension, tangent = slope_of(start.tensions, stiffness)
        for _ in range(steps):
            # the drag where the cable hangs now, then Newton steps of c for it, then the new form
            shift = length * displacement
            actual_drag = (1 + tension / stiffness) * across(drag.direction[:, None], tangent)
            actual_drag = drag.times_local_pressure(actual_drag, lambda shift=shift: self.positions + shift)
            new = drag.normal_drag[:, None, None] * length * (actual_drag - self.uniform_drag)
            difference = difference + share * (new - difference)
            without_constant = at_points - pieces.running_integral(difference)
            for _ in range(CABLE.newton_steps_of_drag):
                slope, tension, tangent = slope_of(without_constant + constant, stiffness)
                step = _newton_step(slope - uniform_slope - apart, tension, tangent, pieces, stiffness, share)
                constant = constant - step
            slope, tension, tangent = slope_of(without_constant + constant, stiffness)
            previous, displacement = displacement, from_end + pieces.running_integral(slope - uniform_slope)
        tensions = without_constant + constant
        at_both = constant - np.concatenate([none, pieces.integral(difference)], axis=1)
        force = np.concatenate([at_points, self.at_ends], axis=1)
        change = size(np.concatenate([tensions - at_points, at_both], axis=1))
        of_all = np.maximum(size(displacement).max(axis=-1), CABLE.no_drag)
        of_tension = np.maximum(change.max(axis=-1), CABLE.no_drag * size(force).max(axis=-1))
        unsettled = np.maximum(size(displacement - previous).max(axis=-1) / of_all, size(step)[:, 0] / of_tension)
        return ChangesByDrag(at_both, length * displacement, tensions, constant, difference, unsettled)


@dataclass(frozen=True)
class Pieces:
    """Gauss's rule on pieces of n cables: k points on each of p pieces, j = p k."""

    width: np.ndarray  # (n, p): a share of the unstretched length; zero for loads that a cable does not have [-]
    points: np.ndarray  # (n, j): shares of the unstretched length [-]
    weights: np.ndarray  # (n, j, 1): they add up to 1 [-]

    @classmethod
    def of(cls, catenary, parts):
        """The `Pieces` of n cables between their loads, and on both sides of mid-length, each in equal parts."""
        loaded = np.pad(catenary.span.load_forces.any(axis=-1), ((0, 0), (1, 1)), constant_values=True)
        edges = np.where(loaded, catenary.edges, 1.0)
        edges = np.sort(np.concatenate([edges, np.full((len(edges), 1), 0.5)], axis=-1), axis=-1)
        width = np.repeat(np.diff(edges, axis=-1) / parts, parts, axis=-1)
        begins = np.repeat(edges[:, :-1], parts, axis=-1) + width * np.tile(np.arange(parts), edges.shape[1] - 1)
        points = begins[..., None] + width[..., None] * gauss_nodes()
        of_points = width[..., None] * gauss_weights()
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


def _newton_step(slope_change, tension, tangent, pieces, stiffness, share):
    """Step of Newton's method by which c takes back the displacement of end 2, shape (n, 1, 3). [N]

    No step is larger than a share of the largest tension along the cable: a slack one has next to none where it is
    level.

    `slope_change`, shape (n, j, 3), is r' less r' under the uniform drag: its integral is the displacement of end 2.
    Tension and tangent are size [N] and direction of the tension vector.
    """
    jacobian = flexibility(tension, tangent, pieces.weights, stiffness)
    step = solved(jacobian, pieces.integral(slope_change)[:, 0, :, None])[:, None, :, 0]
    largest = share * tension.max(axis=1, keepdims=True)
    return step * (largest / np.maximum(size(step)[..., None], largest))


def stiffness_of(tensions, cables):
    """Static stiffness of end 2, end 1 held, of `CablesInDrag` with these tension vectors, shape (n, 3, 3). [N/m]"""
    _, tension, tangent = slope_of(tensions, cables.stiffness)
    matrix = flexibility(tension, tangent, cables.pieces.weights, cables.stiffness)
    return of_each(np.linalg.inv, np.nan, matrix) / cables.length


def flexibility(tension, tangent, weights, stiffness):
    """Integral of I/EA + (I - t t^T)/T, the derivative of that of r' with a constant vector, (..., 3, 3). [1/N]"""
    weights = weights / tension
    of_tension = (weights.sum(axis=-2, keepdims=True) + 1 / stiffness) * np.eye(3)
    return of_tension - np.swapaxes(weights * tangent, -1, -2) @ tangent


def slope_of(force, stiffness):
    """r' of tension vectors, shape (..., j, 3) [-], their sizes, shape (..., j, 1) [N], and directions.

    Sizes are not less than a share of the largest one, so that no quotient overflows.
    """
    tension = size(force)[..., None]
    tension = np.maximum(tension, CABLE.slack * np.maximum(tension.max(axis=-2, keepdims=True), CABLE.slack))
    return force / stiffness + force / tension, tension, force / tension


@lru_cache(1)
def gauss_nodes():
    """Gauss's points of a piece, shares of its length. [-]"""
    return (1 + np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[0]) / 2


@lru_cache(1)
def gauss_weights():
    """Gauss's weights of the points of a piece; they add up to 1. [-]"""
    return np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[1] / 2


@lru_cache(1)
def _running_integral():
    """Matrix that takes values at Gauss's points of [0, 1] to their integral up to each point, by their polynomial."""
    nodes, _ = np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)
    order = np.arange(len(nodes))
    powers = nodes[:, None] ** order
    upper, lower = nodes[:, None] ** (order + 1), (-1.0) ** (order + 1)
    return (upper - lower) / (2 * (order + 1)) @ np.linalg.inv(powers)


@np.errstate(over="ignore", invalid="ignore")  # of a soft cable that the drag stretches without end
def settled_changes(cables, ends=None, start=None):
    """`ChangesByDrag` of `CablesInDrag`, in more turns where few do not settle them; see `changes`."""
    changes = cables.changes(ends, start)
    for steps, share in CABLE.further_drag_steps:
        unsettled = np.flatnonzero(changes.unsettled > CABLE.settled_form)
        if not len(unsettled):
            break
        of_these, their_ends = take_rows(cables, unsettled), None if ends is None else ends[unsettled]
        more = of_these.changes(their_ends, take_rows(changes, unsettled), steps, share)
        better = np.flatnonzero(more.unsettled < changes.unsettled[unsettled])
        assign_rows(changes, unsettled[better], take_rows(more, better))
    return changes


def bounded_errors(error):
    """Estimated errors that are numbers, none of them larger than `unknown_error`."""
    return np.fmin(error, CABLE.unknown_error)
