"""Statics of cases with a fixed number of elements: those on equal meshes at once, as arrays over cases."""

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, SPATIAL
from cablestudy.cable.dynamics import PLANAR
from cablestudy.cable.equilibrium import refusal
from cablestudy.cable.geometry import midspan
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.columns import LIMP
from cablestudy.study.models import fixed_mesh, solve_elements
from cablestudy.study.results import NO_MOTION, Results, along
from cablestudy.study.statics import ElementStatics
from cablestudy.study.tolerances import STUDY


class ElementResults(Results):
    """`Results` of cases whose statics and end stiffness are those of elements, all on one mesh.

    Parameters
    ----------
    closed : Results
        The closed form of these and other cases.
    places : ndarray of int, shape (n,)
        Which of them these are.
    models : BatchElements
        Their elements, in equilibrium.
    """

    def __init__(self, closed, places, models):
        super().__init__(closed.values.take(places))
        self.models = models
        known = closed.reference_length[places], closed.drag.take(places)
        self._span_and_reasons = models.span, {}, *known
        self.catenary = closed.catenary.take(places)
        self.pushed = tuple(part[places] for part in closed.pushed)
        self.statics = ElementStatics(models.state, models.record, self.catenary.middle)

    @property
    def form(self):
        """The elements where they hang: `State`."""
        return self.models.state

    @property
    def middle(self):
        """Arc length at mid-span over unstretched length, shape (n,). [-]"""
        return midspan(self.form)

    def end_stiffness_along(self, axis, moved=None):
        """Static stiffness of end 2, see `Results.end_stiffness_along`. [N/m]"""
        key = axis, axis if moved is None else moved
        if key not in self._along:
            planar = bool(self.planar.all())  # or none is: they are on one mesh
            in_plane = planar and not self.span.frame[:, 2, list(key)].any()
            planes = (IN_PLANE,) if in_plane else PLANAR if planar else (SPATIAL,)
            self._along[key] = along(self.span, self.models.dynamics(planes).end_stiffness, *key)
        return self._along[key]

    @property
    def end_stiffness_chord(self):
        """Static stiffness of end 2 along the chord, shape (n,). [N/m]"""
        planes = (IN_PLANE,) if self.planar.all() else (SPATIAL,)
        return self.models.dynamics(planes).end_stiffness[..., 0, 0]


def element_results(results):
    """Statics of the elements of all cases that have an equilibrium.

    Parameters
    ----------
    results : Results
        The closed form of n cases, each with a fixed number of elements.

    Returns
    -------
    found : list of (ndarray of int, ElementResults)
        Which cases, and their results.
    failures : dict
        Case -> NoSolutionError or ConvergenceError of one whose elements have no equilibrium.
    """
    found, failures = [], {}
    alive = np.ones(len(results.values), dtype=bool)
    alive[list(results.failures)] = False
    for case in np.flatnonzero(results.folded & alive).tolist():
        failures[case] = NoSolutionError(LIMP if results.limp[case] else NO_MOTION)
    places = np.flatnonzero(alive & ~results.folded)
    for group in _on_equal_meshes(results, places):
        try:
            mesh = fixed_mesh(results, group[0]).bare
        except (NoSolutionError, ConvergenceError) as error:
            failures.update(dict.fromkeys(group.tolist(), error))
            continue
        width = max(1, STUDY.nodes_at_once // mesh.nodes)
        for own in np.split(group, range(width, len(group), width)):
            models = solve_elements(results, own, mesh)
            good = models.record.converged
            for place in np.flatnonzero(~good).tolist():
                failures[int(own[place])] = refusal(models.record.of(place), mesh)
            if good.any():
                found.append((own[good], ElementResults(results, own[good], models.take(np.flatnonzero(good)))))
    return found, failures


def _on_equal_meshes(results, places):
    """Groups of some cases whose meshes are equal, and whose elements are solved alike: list of ndarray of int."""
    if not len(places):
        return []
    values = results.values
    _, kind = np.unique(values.words("model.mass"), return_inverse=True)
    alike = [values.given("model.elements"), values.given("model.order"), kind, results.planar,
             results.mirror_symmetric, results.drag.normal_drag > 0, *results.catenary.segments.fraction.T]  # fmt: skip
    rows = np.stack([np.broadcast_to(part, (len(values),)) for part in alike], axis=1)[places]
    group = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    return [places[group == number] for number in range(group.max() + 1)]
