"""Many cables at once, in closed form: what a column of statics or end stiffness needs, as arrays."""

from functools import cached_property

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.control import gondola
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.columns import SHAPELESS
from cablestudy.study.spans import spans_of

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

    Parameters
    ----------
    scenes : list of Scene
    """

    def __init__(self, scenes):
        self._scenes = scenes

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
        """Of the cables that exist."""
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

    def catenary_of(self, index):
        """The equilibrium of one scene.

        Raises
        ------
        NoSolutionError
            A weightless slack cable, or one that would end before its last load.
        ConvergenceError
            No equilibrium was found.
        """
        if index in self.unsolved:
            raise self.unsolved[index]
        return self.catenary.take(self._place[index])


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
        # a folded cable is computed with next to no tension at its fold, and shown with none
        folded = FOLDED * self.max_tension
        self.min_tension, self.horizontal_tension = (
            np.where(tension > folded, tension, 0.0) for tension in (catenary.min_tension, catenary.horizontal_tension)
        )
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
