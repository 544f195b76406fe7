"""Statics of cases with a fixed number of elements: cases on equal meshes are solved at once, as arrays over cases."""

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, SPATIAL
from cablestudy.cable.dynamics import PLANAR
from cablestudy.cable.equilibrium import refusal
from cablestudy.cable.geometry import midspan
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.column import LIMP
from cablestudy.study.models import fixed_mesh, solve_elements
from cablestudy.study.results import NO_MOTION, Results, along
from cablestudy.study.statics import ElementStatics
from cablestudy.study.tolerances import STUDY


class ElementResults(Results):
    """`Results` of n cases whose statics and end stiffness are those of finite elements, all on one mesh.

    Parameters
    ----------
    closed : Results
        Results in closed form of these and other cases.
    indices : ndarray of int, shape (n,)
        Rows of these cases in `closed`.
    models : BatchElements
        Elements of the n cases, in equilibrium.
    """

    def __init__(self, closed, indices, models):
        super().__init__(closed.values.take(indices))
        self.models = models
        references = closed.reference_length[indices], closed.drag.take(indices)
        self._span_and_reasons = models.span, {}, *references
        self.catenary = closed.catenary.take(indices)
        self.pushed = tuple(array[indices] for array in closed.pushed)
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
    """Solve the equilibrium of finite elements for many cases, those on equal meshes together.

    Cases without an equilibrium in closed form are left out.

    Parameters
    ----------
    results : Results
        Results in closed form of n cases, each with a fixed number of elements.

    Returns
    -------
    groups : list of (ndarray of int, ElementResults)
        Rows of cases in `results`, and the statics of their elements.
    failures : dict
        Row of a case whose elements have no equilibrium -> NoSolutionError or ConvergenceError.
    """
    groups, failures = [], {}
    in_equilibrium = np.ones(len(results.values), dtype=bool)
    in_equilibrium[list(results.failures)] = False
    for case in np.flatnonzero(results.folded & in_equilibrium).tolist():
        failures[case] = NoSolutionError(LIMP if results.limp[case] else NO_MOTION)
    # folded cables are failures: with next to no tension somewhere, they have no stiffness there
    cases = np.flatnonzero(in_equilibrium & ~results.folded)
    for group in _on_equal_meshes(results, cases):
        try:
            mesh = fixed_mesh(results, group[0]).bare
        except (NoSolutionError, ConvergenceError) as error:
            failures.update(dict.fromkeys(group.tolist(), error))
            continue
        cases_at_once = max(1, STUDY.nodes_at_once // mesh.nodes)
        for members in np.split(group, range(cases_at_once, len(group), cases_at_once)):
            models = solve_elements(results, members, mesh)
            converged = models.record.converged
            for index in np.flatnonzero(~converged).tolist():
                failures[int(members[index])] = refusal(models.record.of(index), mesh)
            if converged.any():
                solved, models = members[converged], models.take(np.flatnonzero(converged))
                groups.append((solved, ElementResults(results, solved, models)))
    return groups, failures


def _on_equal_meshes(results, cases):
    """Groups of cases with equal meshes, whose elements can be solved in one call: list of ndarray of int."""
    if not len(cases):
        return []
    values = results.values
    _, kind = np.unique(values.words("model.mass"), return_inverse=True)
    criteria = [values.given("model.elements"), values.given("model.order"), kind, results.planar,
             results.mirror_symmetric, results.drag.normal_drag > 0, *results.catenary.segments.fraction.T]  # fmt: skip
    rows = np.stack([np.broadcast_to(values_of_cases, (len(values),)) for values_of_cases in criteria], axis=1)[cases]
    group = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    return [cases[group == number] for number in range(group.max() + 1)]
