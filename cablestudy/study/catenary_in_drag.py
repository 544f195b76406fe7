"""Cables in equilibrium under drag that varies along each, by its tangent, stretch and the height: `CatenaryInDrag`.

A catenary in uniform drag, in closed form, and what the actual drag changes of it: polynomials on pieces of the cable.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from cablestudy.cable.catenary import Catenary
from cablestudy.cable.element import lagrange
from cablestudy.cable.geometry import midspan, sag_and_swing
from cablestudy.cable.records import take_rows, with_arrays
from cablestudy.cable.segment import SegmentedCable, inverse_symmetric
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size
from cablestudy.study.tolerances import STUDY
from cablestudy.study.uneven_drag import (
    CablesInDrag,
    Pieces,
    bounded_errors,
    flexibility,
    settled_changes,
    slope_of,
    stiffness_and_length,
)

ENTRIES = ((0, 1, 2, 0, 0, 2), (0, 1, 2, 1, 2, 1))  # rows and columns of qq, nn, yy, qn, qy, ny


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
    slope: np.ndarray  # (..., j, 3): change of r' [-]
    unsettled: np.ndarray  # (...): what may be left of these changes; `unknown_error` where none was found [-]

    def take(self, index):
        """One cable of a batch of shape (n,), or some."""
        parts = self.pieces, self.constant, self.difference, self.slope, self.unsettled
        return CatenaryInDrag(self.catenary.take(index), *(take_rows(part, index) for part in parts))

    def with_span(self, span):
        """Copy with another `Span`, such as one without places of loads that carry nothing."""
        return replace(self, catenary=self.catenary.with_span(span))

    @property
    def span(self):
        """The cables and their ends, with the uniform load: `Span`."""
        return self.catenary.span

    @property
    def record(self):
        """`Record` of the search for the catenary."""
        return self.catenary.record

    @property
    def slack(self):
        """True where a segment has no tension and no definite form, shape (...)."""
        return self.catenary.slack

    @property
    def folded(self):
        """True where a cable has next to no tension somewhere, shape (...)."""
        return self.min_tension <= CABLE.folded * self.max_tension

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
        nodes = _nodes()
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

    def tension_at(self, position):
        """Tension vector along the cable as of `at`, shape (..., j, 3). [N]"""
        return self.catenary.tension_at(position) + self._change_of_tension(position)

    def _change_of_tension(self, position):
        return self.constant - self._by_drag(position)

    @cached_property
    def _by_slope(self):
        return _integral(self.pieces, self.slope)

    @cached_property
    def _by_drag(self):
        return _integral(self.pieces, self.difference)

    # ---------------------------------------------------------------------- tensions between edges and points

    @cached_property
    def _edge_vectors(self):
        """Tension vectors at the beginning, the k points and the end of each piece, shape (..., p, k + 2, 3). [N]"""
        pieces, nodes = self.pieces, _nodes()
        shape = (*pieces.width.shape, len(nodes), 3)
        uniform = self.catenary.tension_at(pieces.points).reshape(shape)
        first, last = uniform[..., :1, :], uniform[..., -1:, :]
        slope = (last - first) / (nodes[-1] - nodes[0])  # linear on each piece
        uniform = np.concatenate([first - nodes[0] * slope, uniform, last + (1 - nodes[-1]) * slope], axis=-2)
        within = np.zeros(uniform.shape)
        within[..., 1:, :] = pieces.width[..., None, None] * (_to_points_and_end() @ self.difference.reshape(shape))
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

    def change_along(self, normal):
        """Change of the part of the tension vector along a normal, global axes, over each segment, (..., s). [N]"""
        return 2 * (self.span.in_frame(self.half_changes, "global") * normal).sum(axis=-1)

    @cached_property
    def _tensions(self):
        """Tension vectors at the points under the actual and under the uniform drag, two of shape (..., j, 3). [N]"""
        uniform = self.catenary.tension_at(self.pieces.points)
        return self.tension_at(self.pieces.points), uniform

    def _mean_change(self, of):
        """Mean over the unstretched length of what the actual drag changes of a function of the tension vector."""
        actual, uniform = (of(vectors) for vectors in self._tensions)
        return ((actual - uniform) * self.pieces.weights[..., 0]).sum(axis=-1)

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

    @property
    def stretched_length(self):
        """Stretched length of the cable, shape (...). [m]"""
        return self.span.unstretched_length * (1 + self.mean_tension / self.span.axial_stiffness)

    def flexibility_between(self, positions):
        """Movement of one end of each part of a cable per force, see `Catenary.flexibility_between`."""
        width, nodes = np.diff(positions), _nodes()
        points = (positions[:-1, None] + width[:, None] * nodes).ravel()
        stiffness, length = stiffness_and_length(self.span)
        weights = (width[:, None] * _weights()).reshape(-1, 1)

        def of_parts(vectors):
            """Flexibilities of the parts by tension vectors at their points, shape (..., k, 3, 3)."""
            _, tension, tangent = slope_of(vectors, stiffness)
            of_part = (*tension.shape[:-2], len(width), len(nodes))
            tension, tangent = tension.reshape(*of_part, 1), tangent.reshape(*of_part, 3)
            return flexibility(tension, tangent, weights.reshape(of_part[-2:])[..., None], stiffness[..., None])

        change = length[..., None] * (of_parts(self.tension_at(points)) - of_parts(self.catenary.tension_at(points)))
        return self.catenary.flexibility_between(positions) + np.array(
            [change[..., i, j] for i, j in zip(*ENTRIES, strict=True)]
        )

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, the drag a dead load, chord frame, shape (..., 3, 3). [N/m]"""
        stiffness, length = stiffness_and_length(self.span)
        actual, uniform = (
            flexibility(*slope_of(vectors, stiffness)[1:], self.pieces.weights, stiffness) for vectors in self._tensions
        )
        change = length * (actual - uniform)
        entries = zip(self.catenary.flexibility, *ENTRIES, strict=True)
        changed = inverse_symmetric(tuple(entry + change[..., row, column] for entry, row, column in entries))
        return np.where((self.slack | self.folded)[..., None, None], self.catenary.end_stiffness, changed)

    @cached_property
    def global_end_stiffness(self):
        """`end_stiffness` along x, y, z. [N/m]"""
        frame = self.span.frame
        return np.swapaxes(frame, -1, -2) @ self.end_stiffness @ frame

    # ------------------------------------------------------------------- changes of the form in uniform drag

    @property
    def relative_change(self):
        """Largest change of the tension vector over the tension, or of the form over its offset, shape (...). [-]

        The offset is the distance of mid-length from the chord.
        """
        actual, uniform = self._tensions
        tiny = np.finfo(float).tiny
        of_tension = (size(actual - uniform) / np.maximum(size(uniform), tiny)).max(axis=-1)
        middle = np.array([0.5])
        of_form = size(self._by_slope(middle)) / np.maximum(size(self.catenary.at(middle)[0]), tiny)
        return self._stated(np.maximum(of_tension, of_form[..., 0]))

    @property
    def form_change(self):
        """Largest movement of a point over the distance of mid-length from the chord, shape (...). [-]"""
        largest = size(self._by_slope(self.pieces.points)).max(axis=-1)
        offset = size(self.catenary.at(np.array([0.5]))[0])[..., 0]
        return self._stated(np.divide(largest, offset, out=np.where(largest > 0, np.inf, 0.0), where=offset > 0))

    def _stated(self, change):
        """Relative changes as errors of the form in uniform drag."""
        return bounded_errors(STUDY.second_order * (change + self.unsettled))

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
        Equal parts of each smooth piece of a cable, on which the drag is a polynomial.
    """
    shape = np.shape(catenary.span.chord)
    flat = tuple(np.indices(shape).reshape(len(shape), -1))
    uniform, on_cables = catenary.take(flat), drag.take(flat)
    cables = CablesInDrag.of(on_cables, uniform, pieces=Pieces.of(uniform, parts))
    changes = settled_changes(cables, settled=STUDY.settled_form)
    in_wind, known = on_cables.normal_drag > 0, changes.unsettled <= STUDY.known_drag
    slope = slope_of(changes.tensions, cables.stiffness)[0] - slope_of(cables.at_points, cables.stiffness)[0]
    counted = (known & in_wind)[:, None, None]
    in_chord_frame = (
        np.where(counted, _in_chord_frame(uniform.span.frame, part), 0.0)
        for part in (changes.constant, changes.difference, slope)
    )
    unsettled = np.where(in_wind, np.where(known, changes.unsettled, STUDY.unknown_error), 0.0)
    form = CatenaryInDrag(None, cables.pieces, *in_chord_frame, unsettled)
    return replace(with_arrays(form, lambda array: array.reshape(*shape, *array.shape[1:])), catenary=catenary)


def _in_chord_frame(frame, vectors):
    """Vectors of shape (n, k, 3) along the axes of the chord frames, (n, 3, 3), by those along x, y, z."""
    return np.ascontiguousarray(vectors) @ np.swapaxes(frame, -1, -2)


@lru_cache(1)
def _nodes():
    """Gauss's points of a piece, shares of its length. [-]"""
    return (1 + np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[0]) / 2


@lru_cache(1)
def _weights():
    """Gauss's weights of the points of a piece; they add up to 1. [-]"""
    return np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[1] / 2


@lru_cache(1)
def _coefficients():
    """Matrix that takes values at Gauss's points to the coefficients of x, x^2, ... of the integral from 0 to x."""
    order = np.arange(len(_nodes()))
    return np.linalg.inv(_nodes()[:, None] ** order) / (order + 1)[:, None]


@lru_cache(1)
def _to_points_and_end():
    """Matrix that takes values at Gauss's points to their integrals from 0 up to each point, and to 1."""
    places = np.append(_nodes(), 1.0)
    return places[:, None] ** np.arange(1, len(places)) @ _coefficients()


def _integral(pieces, vectors):
    """Function of positions, shares of the length, shape (..., i): integral from end 1 of vectors at the points."""
    width = pieces.width
    of_pieces = vectors.reshape(*width.shape, -1, 3)
    coefficients = width[..., None, None] * (_coefficients() @ of_pieces)  # (..., p, k, 3)
    whole, ends = coefficients.sum(axis=-2), np.cumsum(width, axis=-1)
    before = np.cumsum(whole, axis=-2) - whole

    def up_to(position):
        position = np.broadcast_to(position, width.shape[:-1] + np.shape(position)[-1:]).astype(float)
        piece = (position[..., None] > ends[..., None, :-1]).sum(axis=-1)
        of_width, end = (np.take_along_axis(array, piece, axis=-1) for array in (width, ends))
        share = 1 + np.divide(position - end, of_width, out=np.zeros_like(position), where=of_width > 0)
        powers = share[..., None] ** np.arange(1, coefficients.shape[-2] + 1)
        of_piece = np.take_along_axis(coefficients, piece[..., None, None], axis=-3)
        begin = np.take_along_axis(before, piece[..., None], axis=-2)
        return begin + (powers[..., None] * of_piece).sum(axis=-2)

    return up_to
