"""Search for the drag of a steady wind on cables where they hang, on more and more parts of each: `drag_where_it_acts`.

The tension vector at a point is N = N_0 + c - integral of d, with N_0 under drag that is uniform along the cable, d(s)
the drag where the cable hangs less the uniform one, and c the constant vector for which the ends stay where they are:
the integral of r' = N/EA + N/|N| is the chord. In each turn d follows the form, and c closes the gap at end 2 that the
form and the change of d leave, to first order in the changes:

    gap + F (change of c) = integral of A (integral of the change of d),    A = I/EA + (I - t t^T)/T

with the flexibility F, the integral of A. What a turn changes falls by the same factor whatever the number of parts:
the search begins with few of them, and goes on with these polynomials on the halves of each part. Integrals are by
Gauss's rule on each piece between two loads, and on both sides of mid-length: r' is smooth there.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from cablestudy.cable.geometry import points_along
from cablestudy.cable.records import assign_rows, take_rows
from cablestudy.cable.segment import solve_symmetric
from cablestudy.cable.steady_drag import SteadyDrag, across
from cablestudy.cable.tolerances import CABLE


@dataclass(frozen=True)
class Pieces:
    """Gauss's rule on pieces of n cables: k points on each of p pieces, j = p k."""

    width: np.ndarray  # (n, p): a share of the unstretched length; zero for loads that a cable does not have [-]
    points: np.ndarray  # (n, j): shares of the unstretched length [-]
    weights: np.ndarray  # (n, j): they add up to 1 [-]
    parts: int  # of each smooth piece

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
        return cls(width, points.reshape(len(points), -1), of_points.reshape(len(points), -1), parts)


@dataclass(frozen=True)
class FoundDrag:
    """The drag on n cables, polynomials on pieces of them; vectors in the chord frame, (n, 3, j) at the j points."""

    constant: np.ndarray  # c, shape (n, 3, 1) [N]
    difference: np.ndarray  # d times the unstretched length [N]
    tension: np.ndarray  # N [N]
    unsettled: np.ndarray  # (n,): what is left to change in tension and form, relative [-]
    rate: np.ndarray  # (n,): factor by which this falls from turn to turn [-]
    change: np.ndarray  # (n,): what half as many parts change of tension and form, relative [-]


@np.errstate(all="ignore")  # of cables without an equilibrium
def drag_where_it_acts(drag, catenary, parts):
    """Find the drag on n cables where they hang.

    Parameters
    ----------
    drag : SteadyDrag
    catenary : Catenary
        Equilibria in uniform drag, shape (n,).
    parts : int
        Even number of equal parts of each smooth piece of a cable, on which the drag is a polynomial.

    Returns
    -------
    list of (CablesOnParts, FoundDrag)
        On half of the parts, and on all.
    """
    halvings = (parts & -parts).bit_length() - 1
    levels, found = [], None
    for number in [parts >> halving for halving in range(halvings, -1, -1)]:
        cables = CablesOnParts.of(drag, catenary, Pieces.of(catenary, number))
        start = cables.in_uniform_drag() if found is None else cables.on_halves(found)
        found = cables.settle(start)
        for turns, share in CABLE.further_drag_turns:
            left = np.flatnonzero(~(found.unsettled <= CABLE.settled_form))
            if len(left):
                of_left = take_rows(cables, left)
                further = of_left.settle(of_left.in_uniform_drag(), turns, share)
                better = np.flatnonzero(further.unsettled < found.unsettled[left])
                assign_rows(found, left[better], take_rows(further, better))
        unknown = np.flatnonzero(~(found.unsettled <= CABLE.known_drag))
        if len(unknown):
            assign_rows(found, unknown, take_rows(cables, unknown).in_uniform_drag())
        found = replace(found, change=_relative(found.tension - start.tension, found.tension))
        levels.append((cables, found))
    return levels[-2:]


@dataclass(frozen=True)
class CablesOnParts:
    """n cables in uniform drag and what its change needs; vectors in the chord frame, components before points."""

    drag: SteadyDrag
    pieces: Pieces
    frame: np.ndarray  # (n, 3, 3), as of `Span`
    compliance: np.ndarray  # (n, 1): 1/EA [1/N]
    length: np.ndarray  # (n, 1): unstretched [m]
    wind: np.ndarray  # (n, 3, 1): unit vector [-]
    uniform_drag: np.ndarray  # (n, 3, 1): over the drag at right angles to the wind [-]
    uniform: np.ndarray  # (n, 3, j): N_0 [N]
    uniform_slope: np.ndarray  # (n, 3, j): r' in uniform drag, less the unit vector along the chord [-]
    positions: np.ndarray | None  # (n, j, 3): of the points from ends 1, global axes, where the wind has a profile [m]

    @classmethod
    def of(cls, drag, catenary, pieces):
        """Make `CablesOnParts` of n cables by their equilibria in uniform drag, a `Catenary`."""
        span = catenary.span
        frame, compliance = span.frame, 1 / np.asarray(span.axial_stiffness)[:, None]
        uniform = np.ascontiguousarray(np.swapaxes(catenary.tension_at(pieces.points), -1, -2))
        slope, *_ = _slope(uniform, compliance)
        positions = None if drag.profile is None else points_along(catenary, pieces.points)
        wind, uniform_drag = (
            (frame * vector[:, None, :]).sum(axis=-1)[..., None]
            for vector in (drag.direction, drag.times_mean_pressure(across(drag.direction, frame[:, 0])))
        )
        length = np.asarray(span.unstretched_length)[:, None]
        return cls(drag, pieces, frame, compliance, length, wind, uniform_drag, uniform, slope, positions)

    def slope_change(self, tension):
        """r' of tension vectors less that in uniform drag, shape (n, 3, j). [-]"""
        return _slope(tension, self.compliance)[0] - self.uniform_slope

    def running_integral(self, vectors):
        """Integral from end 1 up to each point of vectors at the points, shape (n, 3, j)."""
        of_pieces = (len(vectors), 3, *self.pieces.width.shape[1:], -1)
        within = vectors.reshape(of_pieces) @ to_points_and_end().T * self.pieces.width[:, None, :, None]
        whole = within[..., -1]
        return (within[..., :-1] + (np.cumsum(whole, axis=-1) - whole)[..., None]).reshape(vectors.shape)

    def settle(self, start, turns=CABLE.drag_turns, share=1.0):
        """`FoundDrag` after turns from another, as many as each cable needs.

        Each turn takes a `share` of what the drag changes; its steps of c are no larger than that of the tension.
        """
        found, now, cables, left = None, start, self, np.arange(len(self.uniform))
        for turn in range(turns):
            now = cables._turn(now, turn == 0, share)
            unsettled = np.flatnonzero(~(now.unsettled <= CABLE.settled_turn))
            if not len(unsettled):
                break
            if len(unsettled) < len(left):
                found = _with_rows(found, left, now)
                cables, now, left = take_rows(cables, unsettled), take_rows(now, unsettled), left[unsettled]
        return _with_rows(found, left, now)

    def in_uniform_drag(self):
        """`FoundDrag` of uniform drag, of which nothing is known."""
        none, unknown = np.zeros_like(self.uniform), np.full(len(self.uniform), CABLE.unknown_error)
        rate = np.full(len(self.uniform), CABLE.slowest_turns)
        return FoundDrag(none[..., :1], none, self.uniform, unknown, rate, unknown)

    def on_halves(self, coarser):
        """`FoundDrag` before the first turn, by the polynomials of `coarser`, which is on parts twice as long."""
        shape = self.uniform.shape
        of_pieces = coarser.difference.reshape(*shape[:2], -1, len(gauss_nodes()))
        difference = (of_pieces @ _to_halves().T).reshape(shape)
        tension = self.uniform + coarser.constant - self.running_integral(difference)
        return FoundDrag(coarser.constant, difference, tension, coarser.unsettled, coarser.rate.copy(), coarser.change)

    def _turn(self, now, first, share):
        """`FoundDrag` after one turn from another; its rate stays that of other parts in the first turn on these."""
        slope, size, tangent = _slope(now.tension, self.compliance)
        change, weights = slope - self.uniform_slope, self.pieces.weights
        step = share * (self._drag_change(size, tangent, change) - now.difference)
        turned = self.running_integral(step)
        along = sum(tangent[:, i] * turned[:, i] for i in range(3))
        by_step = self.compliance[:, None] * turned + (turned - along[:, None] * tangent) / size[:, None]
        gap = ((change - by_step) * weights[:, None]).sum(axis=-1)
        axial, turning = self.compliance[:, 0], turning_flexibility(np.swapaxes(now.tension, 0, 1), weights)
        flexibility = *(axial + entry for entry in turning[:3]), *turning[3:]
        constant = _limited(np.stack(solve_symmetric(flexibility, -gap.T), axis=-1), share * size)
        step_of_tension = constant[..., None] - turned
        tension = now.tension + step_of_tension
        moved, rate = _relative(step_of_tension, tension), now.rate
        if not first:
            rate = np.clip(moved / now.change, CABLE.fastest_turns, CABLE.slowest_turns)
        unsettled = moved * rate / (1 - rate)
        return FoundDrag(
            now.constant + constant[..., None], now.difference + step, tension, unsettled, rate, change=moved
        )

    def _drag_change(self, size, tangent, change):
        """d times the unstretched length, of sizes and directions of tension vectors, and the `slope_change`. [N]"""
        along = sum(self.wind[:, i] * tangent[:, i] for i in range(3))
        normal = self.wind - along[:, None] * tangent
        speed = np.sqrt(sum(normal[:, i] ** 2 for i in range(3)))
        actual = (speed * (1 + self.compliance * size))[:, None] * normal
        if self.drag.profile is not None:
            shift = self.length[..., None] * (np.swapaxes(self.running_integral(change), -1, -2) @ self.frame)
            points = np.swapaxes(actual, -1, -2)
            points = self.drag.times_local_pressure(points, lambda: self.positions + shift)
            actual = np.swapaxes(points, -1, -2)
        return (self.drag.normal_drag[:, None] * self.length)[..., None] * (actual - self.uniform_drag)


def turning_flexibility(tension, weights):
    """Integral of (I - t t^T)/T over cables, as (qq, nn, yy, qn, qy, ny), shape (...) each. [1/N]

    Without cancellation along the chord: a^2 + b^2 in place of 1 - c^2 of the direction (a, b, c).

    Parameters
    ----------
    tension : ndarray, shape (3, ..., j)
        Components of T t at points. [N]
    weights : ndarray, shape (..., j)
        Of the points in the integral. [-]
    """
    size = _size(tension)
    weights, (x, y, z) = weights / size, tension / size
    wx, wy, wz = weights * x, weights * y, weights * z
    pairs = (wx, x), (wy, y), (wz, z), (wx, y), (wx, z), (wy, z)
    xx, yy, zz, xy, xz, yz = ((weighted * part).sum(axis=-1) for weighted, part in pairs)
    return yy + zz, xx + zz, xx + yy, -xy, -xz, -yz


def _size(tension):
    """Sizes of tension vectors, shape (3, ..., j): shape (..., j). [N]

    They are not less than a share of the largest one of each cable, so that no quotient overflows.
    """
    size = np.sqrt(tension[0] ** 2 + tension[1] ** 2 + tension[2] ** 2)
    return np.maximum(size, CABLE.slack * np.maximum(size.max(axis=-1, keepdims=True), CABLE.slack))


def _slope(tension, compliance):
    """r' of tension vectors less the unit vector along the chord, (n, 3, j), their sizes, (n, j), and directions."""
    x, y, z = (tension[:, i] for i in range(3))
    across_chord = y * y + z * z
    size = _size(np.swapaxes(tension, 0, 1))
    tangent = tension / size[:, None]
    slope = compliance[:, None] * tension + tangent
    # without cancellation where the cable runs along its chord
    less = np.where(x > 0, across_chord / (size + np.abs(x)), size - x)
    slope[:, 0] = compliance * x - less / size
    return slope, size, tangent


def _relative(step, tension):
    """Relative change of tension and form by a step of tension vectors, shape (n,). [-]

    It is the largest turn of a direction, over the largest one from the chord: no less than the change of the tension.
    """
    x, y, z = (tension[:, i] ** 2 for i in range(3))
    square, across_chord = x + y + z, y + z
    moved = sum(step[:, i] ** 2 for i in range(3))
    turned, from_chord = ((part / square).max(axis=-1) for part in (moved, across_chord))
    return np.sqrt(turned / np.maximum(from_chord, np.finfo(float).tiny))


def _with_rows(found, rows, of_rows):
    """`FoundDrag` of all cables, that of some written into it; None is of none, before that of all."""
    if found is None:
        return of_rows
    assign_rows(found, rows, of_rows)
    return found


def _limited(step, size):
    """Steps of c, shape (n, 3), none larger than the largest `size`: a slack cable has next to none where level."""
    largest = size.max(axis=-1, keepdims=True)
    return step * (largest / np.maximum(np.sqrt((step**2).sum(axis=-1, keepdims=True)), largest))


@lru_cache(1)
def gauss_nodes():
    """Gauss's points of a piece, shares of its length. [-]"""
    return (1 + np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[0]) / 2


@lru_cache(1)
def gauss_weights():
    """Gauss's weights of the points of a piece; they add up to 1. [-]"""
    return np.polynomial.legendre.leggauss(CABLE.drag_points_of_piece)[1] / 2


@lru_cache(1)
def integral_coefficients():
    """Matrix that takes values at Gauss's points to the coefficients of x, x^2, ... of the integral from 0 to x."""
    order = np.arange(len(gauss_nodes()))
    return np.linalg.inv(gauss_nodes()[:, None] ** order) / (order + 1)[:, None]


@lru_cache(1)
def to_points_and_end():
    """Matrix that takes values at Gauss's points to their integrals from 0 up to each point, and to 1."""
    places = np.append(gauss_nodes(), 1.0)
    return places[:, None] ** np.arange(1, len(places)) @ integral_coefficients()


@lru_cache(1)
def _to_halves():
    """Matrix that takes values at Gauss's points of a piece to those of its polynomial at the points of its halves."""
    places, order = np.append(gauss_nodes(), 1 + gauss_nodes()) / 2, np.arange(len(gauss_nodes()))
    return places[:, None] ** order @ np.linalg.inv(gauss_nodes()[:, None] ** order)
