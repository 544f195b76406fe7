"""Cables in equilibrium under drag that varies along each, by its tangent, stretch and the height: `CatenaryInDrag`.

A catenary in uniform drag, in closed form, and what the actual drag changes of it: polynomials on pieces of the cable.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.catenary import Catenary, solve
from cablestudy.cable.drag_search import (
    Pieces,
    drag_where_it_acts,
    gauss_nodes,
    gauss_weights,
    integral_coefficients,
    to_points_and_end,
    turning_flexibility,
)
from cablestudy.cable.element import lagrange
from cablestudy.cable.geometry import midspan, sag_and_swing
from cablestudy.cable.matrices import largest_ratio
from cablestudy.cable.records import take_rows, with_arrays
from cablestudy.cable.segment import SegmentedCable, inverse_symmetric
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size


@dataclass(frozen=True)
class CatenaryInDrag(SegmentedCable):
    """Equilibrium of cables under drag that varies along each, with the attributes of a `Catenary`; chord frame.

    Fields have the shape (...) of the cables. At j = p k points, Gauss's on p pieces, the drag differs from the uniform
    one of the `catenary`; the tension vector differs from its by `constant` less the integral of `difference`, the
    derivative of the form by `slope`. Both integrals are those of polynomials through these points.
    """

    catenary: Catenary
    pieces: Pieces
    constant: np.ndarray  # (..., 1, 3) [N]
    difference: np.ndarray  # (..., j, 3): drag less the uniform drag, times the unstretched length [N]
    change: np.ndarray  # (..., j, 3): of the tension vector [N]
    slope: np.ndarray  # (..., j, 3): change of r' [-]
    uniform: np.ndarray  # (..., j, 3): tension vectors under the uniform drag [N]
    unsettled: np.ndarray  # (...): what is left to change, relative; `unknown_error` where no form was found [-]
    by_parts: np.ndarray  # (...): what half as many parts change of tension and form, relative [-]
    coarser: "CatenaryInDrag | None" = None  # with drag that varies on half as many parts

    def take(self, index):
        """One cable of a batch of shape (n,), or some."""
        return self._changed(lambda catenary: catenary.take(index), lambda part: take_rows(part, index))

    def with_span(self, span):
        """Copy with another `Span`, such as one without places of loads that carry nothing."""
        return self._changed(lambda catenary: catenary.with_span(span), lambda part: part)

    def _changed(self, of_catenary, of_arrays):
        """Copy with a function of the catenary, and one of records and arrays."""
        own = replace(self, catenary=None, coarser=None)
        coarser = self.coarser and self.coarser._changed(of_catenary, of_arrays)
        return replace(of_arrays(own), catenary=of_catenary(self.catenary), coarser=coarser)

    @property
    def found(self):
        """True where the search for the drag settled, shape (...)."""
        return self.unsettled <= CABLE.known_drag

    @cached_property
    def least_errors(self):
        """Relative errors that all numbers of each cable have, shape (...). [-]

        Against half as many parts one of them may be right by chance: it still has the error of the finer polynomials,
        a 64th of what they change, or its square where that is more: so large a change falls more slowly.
        """
        return bounded_errors(self.unsettled + self.by_parts * np.clip(self.by_parts, CABLE.finer_parts, 1.0))

    @property
    def span(self):
        """The cables and their ends, with the uniform load: `Span`."""
        return self.catenary.span

    @property
    def record(self):
        """`NewtonRecord` of the search for the catenary."""
        return self.catenary.record

    @property
    def slack(self):
        """True where a segment has no tension and no definite form, shape (...)."""
        return self.catenary.slack

    @property
    def planar(self):
        """False: the drag leaves the plane of chord and uniform load."""
        return False

    @property
    def mirror_symmetric(self):
        """False for each cable, shape (...)."""
        return np.zeros(np.shape(self.span.chord), dtype=bool)

    @property
    def segments(self):
        """`Segments` of the cables between their loads."""
        return self.catenary.segments

    @property
    def singularities(self):
        """Those of the `catenary`, by which elements are distributed."""
        return self.catenary.singularities

    @property
    def end_loads(self):
        """Distributed load at both ends, global axes, shape (..., 2, 3). [N/m]"""
        difference = self.difference.reshape(*self.pieces.width.shape, -1, 3)
        nodes = gauss_nodes()
        at_ends = [lagrange(nodes, np.array([float(end)]))[0] @ difference[..., -end, :, :] for end in (0, 1)]
        of_drag = self.span.in_frame(np.stack(at_ends, axis=-2), "global")
        return self.catenary.end_loads + of_drag / np.asarray(self.span.unstretched_length)[..., None, None]

    def uneven_load(self, edges):
        """Load besides the uniform one and point loads on each of n parts between n + 1 edges, (..., n, 3). [N]"""
        return -np.diff(self._change_of_tension(edges), axis=-2)

    # ------------------------------------------------------------------------------------- form and tension

    def at(self, position):
        """Displacement and tension vector at positions along the cable, see `Catenary.at`."""
        displacement, tension = self.catenary.at(position)
        return displacement + self._by_slope(position), tension + self._change_of_tension(position)

    def displacement_at(self, position):
        """Displacement from the chord as of `at`, shape (..., j, 3). [-]"""
        return self.catenary.at(position)[0] + self._by_slope(position)

    def tension_at(self, position):
        """Tension vector along the cable as of `at`, shape (..., j, 3). [N]"""
        return self.catenary.tension_at(position) + self._change_of_tension(position)

    def _change_of_tension(self, position):
        """Tension vector less that of `catenary` at positions along the cable, shape (..., j, 3). [N]"""
        return self.constant - self._by_drag(position)

    @cached_property
    def _by_slope(self):
        """Function of the position: displacement from the chord less that of `catenary`. [-]"""
        return integral(self.pieces, self.slope)

    @cached_property
    def _by_drag(self):
        """Function of the position: drag from end 1 on, less that of the uniform drag. [N]"""
        return integral(self.pieces, self.difference)

    # ---------------------------------------------------------------------- tensions between edges and points

    @cached_property
    def _edge_vectors(self):
        """Tension vectors at the beginning, the k points and the end of each piece, shape (..., p, k + 2, 3). [N]"""
        pieces, nodes = self.pieces, gauss_nodes()
        shape = (*pieces.width.shape, len(nodes), 3)
        uniform = self.uniform.reshape(shape)
        first, last = uniform[..., :1, :], uniform[..., -1:, :]
        slope = (last - first) / (nodes[-1] - nodes[0])  # linear on each piece
        uniform = np.concatenate([first - nodes[0] * slope, uniform, last + (1 - nodes[-1]) * slope], axis=-2)
        within = np.zeros(uniform.shape)
        within[..., 1:, :] = pieces.width[..., None, None] * (to_points_and_end() @ self.difference.reshape(shape))
        whole = within[..., -1:, :]
        return uniform + self.constant[..., None, :, :] - (within + np.cumsum(whole, axis=-3) - whole)

    @cached_property
    def edges(self):
        """Ends of the s segments, on which the tension vector is nearly linear: shares of the length, (..., s + 1)."""
        width = self.pieces.width
        points = self.pieces.points.reshape(*width.shape, -1)
        begins = np.cumsum(width, axis=-1) - width
        inner = np.concatenate([begins[..., None], points], axis=-1)
        inner = inner.reshape(*width.shape[:-1], -1)
        return np.concatenate([inner, np.ones_like(inner[..., :1])], axis=-1)

    @cached_property
    def mid_forces(self):
        """Tension vector in the middle of each segment, chord frame, shape (..., s, 3). [N]"""
        return self._of_segments(lambda begin, end: (begin + end) / 2)

    @cached_property
    def half_changes(self):
        """Change of the tension vector along half of each segment, chord frame, shape (..., s, 3). [N]"""
        return self._of_segments(lambda begin, end: (end - begin) / 2)

    def _of_segments(self, combine):
        """`combine` of the tension vectors at both ends of each segment, a function of two arrays: (..., s, 3)."""
        vectors = self._edge_vectors
        combined = combine(vectors[..., :-1, :], vectors[..., 1:, :])
        return combined.reshape(*combined.shape[:-3], -1, 3)

    @cached_property
    def edge_tensions(self):
        """Tension at both ends of each segment, shape (..., s, 2). [N]"""
        middle, half = self.mid_forces, self.half_changes
        return size(np.stack([middle - half, middle + half], axis=-2))

    @cached_property
    def min_tension(self):
        """Smallest tension, at an end, at a load or where the cable is level, shape (...). [N]"""
        middle, half = self.mid_forces, self.half_changes
        squares = (half**2).sum(axis=-1)
        place = np.divide(-(middle * half).sum(axis=-1), squares, out=np.zeros_like(squares), where=squares > 0)
        place = np.clip(place, -1.0, 1.0)
        least = size(middle + place[..., None] * half)
        segment = least.argmin(axis=-1)[..., None]
        begin, end = (
            np.take_along_axis(part, segment, axis=-1) for part in (self.edges[..., :-1], self.edges[..., 1:])
        )
        at, reach = begin + (end - begin) * (1 + np.take_along_axis(place, segment, axis=-1)) / 2, (end - begin) / 4
        for _ in range(2):  # parabolas through the squares of three tensions
            at = np.clip(at, reach, 1 - reach)
            below, here, above = np.moveaxis(self._squares(at + reach * np.array([-1.0, 0.0, 1.0])), -1, 0)[..., None]
            bend = below - 2 * here + above
            step = np.divide(below - above, 2 * bend, out=np.zeros_like(bend), where=bend > 0)
            at, reach = np.clip(at + reach * step, 0.0, 1.0), reach / 8
        return np.minimum(self.edge_tensions.min(axis=(-2, -1)), np.sqrt(self._squares(at))[..., 0])

    def _squares(self, position):
        """Squares of the tension at positions, shape (..., j). [N^2]"""
        return (self.tension_at(position) ** 2).sum(axis=-1)

    def extremes(self, normal):
        """Arc lengths at which a cable may be farthest along a normal, see `SegmentedCable`, shape (..., k + 2 + p).

        Between two points on a piece at which T . normal has other signs, a chord and one of Newton's steps give the
        zero.
        """
        in_chord_frame = (self.span.frame * normal[..., None, :]).sum(axis=-1)
        places = np.concatenate([[0.0], gauss_nodes(), [1.0]])
        along = (self._edge_vectors * in_chord_frame[..., None, None, :]).sum(axis=-1)  # (..., p, k + 2)
        passes = along[..., :-1] * along[..., 1:] < 0
        segment = passes.argmax(axis=-1)[..., None]
        begin, end = (np.take_along_axis(part, segment, axis=-1)[..., 0] for part in (along[..., :-1], along[..., 1:]))
        first, last = places[:-1][segment[..., 0]], places[1:][segment[..., 0]]
        step = np.divide(last - first, end - begin, out=np.zeros_like(begin), where=passes.any(axis=-1))
        width = self.pieces.width
        at = np.cumsum(width, axis=-1) - width + width * (first - begin * step)
        left = (self.tension_at(at) * in_chord_frame[..., None, :]).sum(axis=-1)
        return np.concatenate([self.catenary.edges, np.clip(at - width * step * left, 0.0, 1.0)], axis=-1)

    @cached_property
    def _tensions(self):
        """Tension vectors at the points under the actual and under the uniform drag, two of shape (..., j, 3). [N]"""
        return self.uniform + self.change, self.uniform

    def _mean_change(self, of):
        """Mean over the unstretched length of what the actual drag changes of a function of the tension vector."""
        actual, uniform = (of(vectors) for vectors in self._tensions)
        return ((actual - uniform) * self.pieces.weights).sum(axis=-1)

    @cached_property
    def mean_tension(self):
        """Mean over the unstretched length, shape (...). [N]"""
        return self.catenary.mean_tension + self._mean_change(size)

    @property
    def horizontal_tension(self):
        """Mean horizontal part of the tension vector, shape (...). [N]"""

        def horizontal(vectors):
            in_axes = self.span.in_frame(vectors, "global")
            return np.hypot(in_axes[..., 0], in_axes[..., 1])

        return self.catenary.horizontal_tension + self._mean_change(horizontal)

    def flexibility_between(self, positions):
        """Movement of one end of each part of a cable per force, see `Catenary.flexibility_between`."""
        width, nodes = np.diff(positions), gauss_nodes()
        points = (positions[:-1, None] + width[:, None] * nodes).ravel()

        def of_parts(vectors):
            """Flexibilities of the parts by change of direction, by tension vectors at their points, (6, ..., k)."""
            of_points = vectors.reshape(*vectors.shape[:-2], len(width), len(nodes), 3)
            return np.array(turning_flexibility(np.moveaxis(of_points, -1, 0), width[:, None] * gauss_weights()))

        change = of_parts(self.tension_at(points)) - of_parts(self.catenary.tension_at(points))
        length = np.asarray(self.span.unstretched_length)[..., None]
        return self.catenary.flexibility_between(positions) + length * change

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, the drag a dead load, chord frame, shape (..., 3, 3). [N/m]"""
        weights = self.pieces.weights
        actual, uniform = (turning_flexibility(np.moveaxis(vectors, -1, 0), weights) for vectors in self._tensions)
        length, entries = self.span.unstretched_length, zip(self.catenary.flexibility, actual, uniform, strict=True)
        changed = inverse_symmetric(tuple(entry + length * (new - old) for entry, new, old in entries))
        return np.where((self.slack | self.folded)[..., None, None], self.catenary.end_stiffness, changed)

    @property
    def mode_errors(self):
        """Relative errors of the frequencies of one cable by drag that varies along it, shape (...). [-]

        Half as many parts change its tension, form and stiffness by so much: far more than the error of the form, and
        no less than that of Gauss's rule on the elements where the drag changes sharply, as in a wind along the cable.
        """
        of_stiffness = largest_ratio(self.coarser.end_stiffness - self.end_stiffness, self.end_stiffness)
        return bounded_errors(np.maximum(self.by_parts, of_stiffness) + self.unsettled)

    # ------------------------------------------------------------------------------------------- at mid-span

    @cached_property
    def middle(self):
        """Arc length at mid-span over unstretched length (`midspan`), shape (...). [-]"""
        return midspan(self)

    @cached_property
    def sag(self):
        """Vertical distance from the chord down to the cable at mid-span, shape (...); NaN of a slack cable. [m]"""
        return np.where(self.slack, np.nan, sag_and_swing(self, self.middle)[0])


@np.errstate(all="ignore")  # of cables without an equilibrium
def in_drag(drag, catenary, parts):
    """Find the equilibria of cables in a steady wind, whose drag varies along each: `CatenaryInDrag`.

    Parameters
    ----------
    drag : SteadyDrag
        On the cables, shape (...).
    catenary : Catenary
        Their equilibria in uniform drag, where the search begins. Cables whose search does not settle keep them.
    parts : int
        Even number of equal parts of each smooth piece of a cable, on which the drag is a polynomial.
    """
    shape = np.shape(catenary.span.chord)
    flat = tuple(np.indices(shape).reshape(len(shape), -1))
    uniform, on_cables = catenary.take(flat), drag.take(flat)
    form = None
    for cables, found in drag_where_it_acts(on_cables, uniform, parts):
        of_level = _form_of_level(cables, found, on_cables.normal_drag > 0)
        of_level = with_arrays(of_level, lambda array: array.reshape(*shape, *array.shape[1:]))
        form = replace(of_level, catenary=catenary, coarser=form)
    return form


def _form_of_level(cables, found, in_wind):
    """`CatenaryInDrag` without its catenary, of n cables, by the `FoundDrag` on `CablesOnParts`."""
    changes = found.constant, found.difference, found.tension - cables.uniform, cables.slope_change(found.tension)
    changes = (np.where(in_wind[:, None, None], change, 0.0) for change in changes)
    vectors = [np.swapaxes(part, -1, -2).copy() for part in (*changes, cables.uniform)]  # in rows, whatever the batch
    errors = (np.where(in_wind, bounded_errors(error), 0.0) for error in (found.unsettled, found.change))
    return CatenaryInDrag(None, cables.pieces, *vectors, *errors)


def errors_by_parts(numbers, coarser, least):
    """Relative errors of numbers by the parts on which drag is a polynomial, shape (...). [-]

    Parameters
    ----------
    numbers, coarser : ndarray or float
        Of cables whose drag varies on so many parts, and on half as many.
    least : ndarray or float
        `CatenaryInDrag.least_errors`, relative. [-]

    Notes
    -----
    With the change |numbers - coarser| + least |numbers| it is change/(|number| - change), since the true value may be
    smaller than the number by the change; `unknown_error` where it may be zero.
    """
    change = CABLE.second_order * (np.abs(numbers - coarser) + least * np.abs(numbers))
    least = np.abs(numbers) - change
    return bounded_errors(np.divide(change, least, out=np.where(change > 0, np.inf, 0.0), where=least > 0))


def form_of_one(span, drag, parts):
    """One cable by its `Span`: `Catenary`, or `CatenaryInDrag` with a `SteadyDrag` of shape (1,), not None."""
    if drag is None:
        return solve(span)
    batch_of_one = with_arrays(span, lambda array: np.asarray(array)[None])
    return in_drag(drag, solve(batch_of_one), parts).take(0)


def integral(pieces, vectors):
    """Function of positions, shares of the length, shape (..., i): integral from end 1 of vectors at the points."""
    width = pieces.width
    of_pieces = vectors.reshape(*width.shape, -1, 3)
    coefficients = width[..., None, None] * (integral_coefficients() @ of_pieces)  # (..., p, k, 3)
    whole, ends = coefficients.sum(axis=-2), np.cumsum(width, axis=-1)
    before = np.cumsum(whole, axis=-2) - whole

    def up_to(position):
        position = np.broadcast_to(position, width.shape[:-1] + np.shape(position)[-1:]).astype(float)
        piece = (position[..., None] > ends[..., None, :-1]).sum(axis=-1)
        of_width, end = (np.take_along_axis(array, piece, axis=-1) for array in (width, ends))
        share = 1 + np.divide(position - end, of_width, out=np.zeros_like(position), where=of_width > 0)
        of_piece = np.take_along_axis(coefficients, piece[..., None, None], axis=-3)
        begin, share = np.take_along_axis(before, piece[..., None], axis=-2), share[..., None]
        total = of_piece[..., -1, :]
        for power in range(of_piece.shape[-2] - 2, -1, -1):
            total = of_piece[..., power, :] + share * total
        return begin + share * total

    return up_to


def bounded_errors(error):
    """Estimated errors that are numbers, none of them larger than `unknown_error`."""
    return np.fmin(error, CABLE.unknown_error)
