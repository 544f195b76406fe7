"""Many cables at once, in closed form: what a column of statics or end stiffness needs, as arrays."""

from functools import cached_property

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.element import pieces
from cablestudy.cable.taut import lambda_squared
from cablestudy.control import gondola
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.columns import ROUNDING, SHAPELESS
from cablestudy.study.spans import spans_of

EPSILON, TINY = 4e-16, 1e-300  # rounding of one number, and what is divided by instead of nothing
POINTS = 8  # Gauss points on each piece, for the time that a wave takes
UPRIGHT = 1e-50  # share of the largest tension that an upright cable is held aside by at most
FOLDED = 1e-12  # share of the largest tension below which a cable counts as folded


class Gathered:
    """The same attribute of many objects as one array; not a number where an object has none.

    Parameters
    ----------
    objects : list
    """

    def __init__(self, objects):
        self._objects = objects

    def __getattr__(self, name):
        values = [getattr(one, name, None) for one in self._objects]
        if all(value is None for value in values):
            return np.full(len(values), np.nan).view(Absent)
        if all(value is None or isinstance(value, float | int) for value in values):
            return np.array(values, dtype=float)
        return Gathered(values)


class Absent(np.ndarray):
    """What no object has: not a number, and neither is any attribute of it."""

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return self


class ScenesOnly:
    """What a column asks of a `Case` that needs nothing but the scene.

    Parameters
    ----------
    scenes : list of Scene
    """

    def __init__(self, scenes):
        self.scene = Gathered(scenes)


class Batch:
    """Scenes whose cables carry loads at equally many places, with what a closed-form column asks of a `Case`.

    Arrays hold the k cables that exist. Methods that end in `_of` take the index of a scene and answer for it alone, or
    raise what keeps it from an equilibrium.

    Parameters
    ----------
    scenes : list of Scene
    """

    def __init__(self, scenes):
        self._scenes, self._stiffness = scenes, {}

    @cached_property
    def _cables(self):
        return spans_of(self._scenes)

    @property
    def span(self):
        """Of the cables that exist, fields of shape (k,)."""
        return self._cables[0]

    @property
    def there(self):
        """Which scenes they belong to, shape (k,)."""
        return self._cables[1]

    @cached_property
    def scene(self):
        """The scenes of the cables that exist."""
        return Gathered([self._scenes[index] for index in self.there])

    @cached_property
    def _place(self):
        return {index: place for place, index in enumerate(self.there.tolist())}

    @cached_property
    def catenary(self):
        """The closed-form equilibria, of the cables that exist."""
        return solve(self.span)

    @cached_property
    def statics(self):
        """What the equilibria look like."""
        return ClosedStatics(self.catenary)

    def _solved(self, index):
        """Place of a scene's equilibrium in the arrays.

        Raises
        ------
        NoSolutionError, ConvergenceError
            It has none.
        """
        if index in self.unsolved:
            raise self.unsolved[index]
        return self._place[index]

    @cached_property
    def _planar(self):
        return (~self.span.load_forces[..., 2].any(axis=-1)).tolist()

    def planar_of(self, index):
        """Whether no load leaves the plane of one cable."""
        return self._planar[self._solved(index)]

    @cached_property
    def _mirrored(self):
        return self.span.mirror_symmetric.tolist()

    def mirror_symmetric_of(self, index):
        """Whether one cable is its own mirror image at mid-length."""
        return self._mirrored[self._solved(index)]

    @cached_property
    def _aside(self):
        return (self.span.azimuth[:, 1] != 0).tolist()

    def aside_of(self, index):
        """Whether a movement along x leaves the plane of one cable."""
        return self._aside[self._solved(index)]

    @cached_property
    def strained(self):
        """Relative error of the tensions by the rounding of the unstretched length, shape (k,). [-]

        Felt where loads hold a slack cable in straight pieces, which only stretching lets give way.
        """
        span = self.span
        if not span.load_positions.shape[-1]:
            return np.zeros(len(span.chord))
        stiffness = self.catenary.end_stiffness[..., 0, 0] * span.unstretched_length
        return EPSILON * np.abs(span.chord_strain) * stiffness / np.maximum(self.statics.mean_tension, TINY)

    @cached_property
    def _rounding(self):
        # the least tension has the rounding of the largest; it is felt over the short piece that hangs from it
        largest = self.statics.max_tension
        steep = largest / np.maximum(self.catenary.min_tension, FOLDED * largest)
        return np.maximum(np.maximum(ROUNDING, self.strained), EPSILON * steep**0.75).tolist()

    def rounding_of(self, index):
        """Relative error of the motion of one cable by the rounding of its least tension. [-]"""
        return self._rounding[self._solved(index)]

    @cached_property
    def _longest(self):
        return self.catenary.segments.fraction.max(axis=-1).tolist()

    def longest_of(self, index):
        """Share of the unstretched length of the longest segment between the loads of one cable. [-]"""
        return self._longest[self._solved(index)]

    @cached_property
    def _folded(self):
        return (self.catenary.min_tension <= FOLDED * self.catenary.max_tension).tolist()

    @cached_property
    def _bent(self):
        """Fractions and bends of the segments of each cable, and whether it bends so that pieces are shorter."""
        fraction, singularities = self.catenary.segments.fraction, self.catenary.singularities
        middle = np.cumsum(fraction, axis=-1) - fraction / 2
        return fraction, singularities, (fraction > np.abs(middle - singularities)).any(axis=-1).tolist()

    @cached_property
    def _travel(self):
        """Seconds that a transverse wave takes along each cable, and such waves at its first axial frequency."""
        span, tension = self.span, self.statics.mean_tension
        time = span.unstretched_length * np.sqrt(span.mass * (1 / tension + 1 / span.axial_stiffness))
        return time.tolist(), np.sqrt(span.axial_stiffness / tension).tolist()

    @cached_property
    def _sagging(self):
        return (np.sqrt(lambda_squared(self.span, self.statics.mean_tension)) / np.pi).tolist()

    def sagging_of(self, index):
        """Up to about how many half-waves the symmetric in-plane modes of one cable have more than of a taut one. [-]

        By Irvine's parameter: stretching by the sag lifts each such mode by two half-waves at most, to these.
        """
        return self._sagging[self._solved(index)]

    def pieces_of(self, index):
        """Pieces of one cable along which it bends little; see `element.pieces`.

        Raises
        ------
        NoSolutionError
            The cable hangs folded, and has no motion.
        """
        place = self._solved(index)
        if self._folded[place]:
            raise NoSolutionError("the cable hangs folded: somewhere it has no tension, and no stiffness about it")
        fraction, singularities, bent = self._bent
        if fraction.shape[-1] == 1 and not bent[place]:
            return 0.0, 1.0
        return pieces(fraction[place], singularities[place])

    def times_of(self, index, edges):
        """How long a transverse wave takes along pieces of one cable, over the longest of these times. [-]

        By the speed sqrt(T/m), and Gauss's rule with a few points on each piece.
        """
        nodes, weights = np.polynomial.legendre.leggauss(POINTS)
        low, high = np.array(edges[:-1]), np.array(edges[1:])
        places = (low[:, None] + high[:, None] + (high - low)[:, None] * nodes) / 2
        force = self.catenary.take(self._solved(index)).at(places.ravel())[1]
        tension = np.maximum(np.sqrt((force**2).sum(axis=-1)), TINY).reshape(places.shape)
        time = (high - low) * ((1 / np.sqrt(tension)) @ weights)
        return (time / time.max()).tolist()

    def fractions_of(self, index):
        """Share of the unstretched length of each segment between the loads of one cable, shape (j,). [-]"""
        return self.catenary.segments.fraction[self._solved(index)]

    def travel_of(self, index):
        """About how long a transverse wave takes from end to end of one cable, by the mean tension [s], and about how
        many transverse half-waves there are at its first axial frequency."""
        place = self._solved(index)
        return self._travel[0][place], self._travel[1][place]

    def middle_of(self, index):
        """Arc length at mid-span of one cable; see `Catenary.middle`. [-]"""
        return self.catenary.middle[self._solved(index)]

    def frame_of(self, index):
        """Rows: the chord frame of one cable in global coordinates, shape (3, 3). [-]"""
        return self.span.frame[self._solved(index)]

    def end_stiffness_of(self, index, axis):
        """Static stiffness of end 2 of one cable along x, y or z (0, 1, 2), end 1 fixed. [N/m]"""
        place = self._solved(index)
        if axis not in self._stiffness:
            self._stiffness[axis] = self.end_stiffness_along(axis).tolist()
        return self._stiffness[axis][place]

    def end_stiffness_along(self, axis):
        """Static stiffness of end 2 along x, y or z (0, 1, 2), end 1 fixed, shape (k,). [N/m]"""
        return along(self.span, self.catenary.end_stiffness, axis)

    @property
    def gondola_frequency_static(self):
        """sqrt(k/M)/(2 pi), shape (k,). [Hz]"""
        return gondola.static_frequency(self.scene.gondola.mass, self.end_stiffness_along(0))

    @cached_property
    def unsolved(self):
        """Index of a scene -> the error that says why it has no equilibrium."""
        errors = {index: NoSolutionError(reason) for index, reason in self._cables[2].items()}
        if not len(self.there):
            return errors
        record, span = self.catenary.record, self.span
        loose = (span.weight == 0) & ~span.load_forces.any(axis=(-1, -2))
        for place in np.flatnonzero(~record.converged):
            if loose[place]:
                error = NoSolutionError("a slack cable without weight has no definite form")
            else:
                error = ConvergenceError(f"catenary: no convergence in {int(record.steps[place])} steps", record)
            errors[int(self.there[place])] = error
        return errors

    def span_of(self, index):
        """The cable of one scene.

        Raises
        ------
        NoSolutionError
            No such cable exists.
        """
        reasons = self._cables[2]
        if index in reasons:
            raise NoSolutionError(reasons[index])
        return self.span.take(self._place[index])

    def catenaries_of(self, indices):
        """The equilibria of some scenes that have one, with a leading axis."""
        return self.catenary.take(np.array([self._solved(index) for index in indices]))

    def catenary_of(self, index):
        """The equilibrium of one scene.

        Raises
        ------
        NoSolutionError
            A weightless slack cable, or one that would end before its last load.
        ConvergenceError
            No equilibrium was found.
        """
        return self.catenary.take(self._solved(index))


def along(span, stiffness, axis):
    """Stiffness along a global axis from one in the chord frame, without a matrix product whose rounding depends on
    how many cables there are.

    Parameters
    ----------
    span : Span
        Fields of shape (...).
    stiffness : ndarray, shape (..., 3, 3)
        Chord frame. [N/m]
    axis : int
        0, 1, 2 for x, y, z.

    Returns
    -------
    ndarray, shape (...)
        [N/m]
    """
    turn = span.frame[..., axis]
    return sum(turn[..., i] * stiffness[..., i, j] * turn[..., j] for i in range(3) for j in range(3))


class ClosedStatics:
    """Statics of the closed form, of one cable or a batch."""

    def __init__(self, catenary):
        self.mean_tension, self.max_tension = catenary.mean_tension, catenary.max_tension
        # a folded cable is computed with next to no tension at its fold, an upright one aside, and shown with none
        least, aside = catenary.min_tension, catenary.horizontal_tension
        folded = least <= FOLDED * self.max_tension
        self.min_tension = np.where(folded, 0.0, least)
        nothing = np.where(folded, FOLDED, UPRIGHT) * self.max_tension
        self.horizontal_tension = np.where(aside > nothing, aside, 0.0)
        self.stretched_length, self.iterations = catenary.stretched_length, catenary.record.steps
        self._catenary = catenary

    @property
    def sag(self):
        """[m]"""
        return self._catenary.sag

    def shape(self, positions):
        """Displacement from the chord (in unstretched lengths, chord frame) and tension [N] at arc lengths."""
        if np.any(self._catenary.slack):
            raise NoSolutionError(SHAPELESS)
        displacement, tension = self._catenary.at(positions)
        return displacement, np.sqrt((tension**2).sum(axis=-1))
