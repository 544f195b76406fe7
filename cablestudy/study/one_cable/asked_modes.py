"""Frequencies of the modes that a row asks for, by models which are refined until each is within the accuracy."""

from functools import cached_property, partial

from cablestudy.errors import CablestudyError, outcome_of, without_errors
from cablestudy.study.one_cable.elements import solve_elements
from cablestudy.study.refinement import Refinement, needs_of, refine


class AskedModes:
    """Modes between fixed ends whose frequencies are asked for, found by one search.

    Parameters
    ----------
    labels : iterable of tuple
        Number (from 1), kind, and symmetry or None of each mode.
    """

    def __init__(self, labels=()):
        self.labels = dict.fromkeys(labels)

    @cached_property
    def waves(self):
        """Most half-waves of a mode along a taut cable; 0 without modes. [-]"""
        return max(map(_half_waves, self.labels), default=0)

    @cached_property
    def sagging_waves(self):
        """Most half-waves in the plane of a sagging cable, where a mode has up to two more; 0 without modes. [-]"""
        return max((_half_waves(label) + (2 if label[2] else 1) for label in _in_plane(self.labels)), default=0)

    @cached_property
    def axial(self):
        """Largest number of an axial mode; 0 without one."""
        return max((number for number, kind, _ in self.labels if kind == "axial"), default=0)

    @cached_property
    def _planes(self):
        """Labels of modes in the plane of the cable, and of those across: two tuples."""
        return tuple(_in_plane(self.labels)), tuple(label for label in self.labels if label[1] == "out-of-plane")

    def frequencies(self, case, refused=()):
        """Frequencies of the asked modes by one model of the cable, without those of `refused` labels.

        All modes are computed in one call. If it fails, each is computed by itself, so that a mode that is missing does
        not take the others with it.

        Parameters
        ----------
        case : CableCase
            The cable at one level of refinement, with its elements.
        refused : container of tuple
            Labels (number, kind, symmetry) of modes to leave out.

        Returns
        -------
        values : dict
            Label -> frequency. [Hz]
        errors : dict
            Label -> relative error, estimated from this model alone, without comparison with a finer one. [-]
        failures : dict
            Label -> CablestudyError of a mode without a frequency.
        """
        if refused:
            return AskedModes(label for label in self.labels if label not in refused).frequencies(case)
        try:
            frequencies, errors = case.frequencies(self._planes)
        except CablestudyError as error:
            if len(self.labels) == 1:
                return {}, {}, dict.fromkeys(self.labels, error)
            values, errors, failures = {}, {}, {}
            for label in self.labels:
                value, relative_error, failure = AskedModes([label]).frequencies(case)
                values, errors, failures = values | value, errors | relative_error, failures | failure
            return values, errors, failures
        labels = (*self._planes[0], *self._planes[1])
        return dict(zip(labels, frequencies, strict=True)), dict(zip(labels, errors, strict=True)), {}


def _in_plane(labels):
    """Labels of modes in the plane of the cable: list."""
    return [label for label in labels if label[1] != "out-of-plane"]


def _half_waves(label):
    """Half-waves of a mode along a taut cable. [-]"""
    number, _, symmetry = label
    return 2 * number - 1 if symmetry else number


def found_frequencies(cases):
    """Search for the frequencies of the modes that some cases ask for (`CableCase.asked_modes`), all level by level.

    Parameters
    ----------
    cases : sequence of CableCase

    Returns
    -------
    dict
        Case -> `Refinement` that has ended, or the error of a case without motion.
    """
    found = {case: outcome_of(partial(_search, case)) for case in cases}
    searches = list(without_errors(found).values())
    refine(searches, solve_elements)
    for search in searches:
        search.case = None  # which keeps the search
    return found


def _search(case):
    """The `Refinement` of a case before it begins; raises as `needs_of`."""
    asked = case.asked_modes
    return Refinement(case, asked.frequencies, *needs_of(case, asked))
