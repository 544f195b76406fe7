"""Finite elements of one cable, or of many on one mesh, in equilibrium, with their motion; and the mesh of a case."""

from functools import cached_property

import numpy as np

from cablestudy.cable import equilibrium
from cablestudy.cable.assembly import IN_PLANE, SPATIAL
from cablestudy.cable.dynamics import PLANAR, Dynamics
from cablestudy.cable.equilibrium import refusal
from cablestudy.cable.geometry import midspan
from cablestudy.cable.meshes import mesh_by_waves, mesh_segments
from cablestudy.cable.steady_drag import uneven_drag
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.column import LIMP
from cablestudy.study.one_cable.loaded_cables import LoadedCables
from cablestudy.study.one_cable.results import NO_MOTION, Results
from cablestudy.study.statics import ElementStatics
from cablestudy.study.tolerances import STUDY


class BatchElements:
    """The elements of many cables on one mesh, in equilibrium.

    Parameters
    ----------
    state : State
        With a leading axis of cables.
    record : NewtonRecord or None
        Of the iteration to equilibrium; None where the nodes lie on the catenary in closed form.
    span : Span
        Fields of shape (cables,).
    elements : int
        Number of elements of the smooth piece with the most waves.
    """

    def __init__(self, state, record, span, elements):
        self.state, self.record, self.span, self._elements = state, record, span, elements
        self._dynamics, self._ends = {}, {}

    def dynamics(self, planes):
        """`Dynamics` of all cables."""
        if planes not in self._dynamics:
            only_requested = self.record is None  # other levels of the error estimate follow
            self._dynamics[planes] = Dynamics(self.state, planes, only_requested)
        return self._dynamics[planes]

    def ends(self, planes):
        """`Ends` of all cables, with up to `modes_at_ends` modes."""
        from cablestudy.system.ends import Ends

        if planes not in self._ends:
            dynamics = self.dynamics(planes)
            self._ends[planes] = Ends(dynamics, self.span.frame, min(dynamics.dof, STUDY.modes_at_ends))
        return self._ends[planes]

    def take(self, indices):
        """`BatchElements` of the cables at some indices, shape (m,)."""
        if len(indices) == len(self.span.chord):
            return self
        record = self.record and self.record.of(indices)
        return BatchElements(self.state.take(indices), record, self.span.take(indices), self._elements)

    @cached_property
    def wave_time(self):
        """Travel time of a transverse wave along the longest smooth piece, of each cable. [s]

        The speed is sqrt(T/(m stretch)).
        """
        state, span = self.state, self.span
        force = state.tension * state.force[:, None, None]
        slowness = np.sqrt(span.mass[:, None, None] * state.stretch / force)
        time = (state.mesh.point_weights * slowness).sum(axis=-1).max(axis=-1)
        # elements of one piece follow each other and are alike
        return (span.unstretched_length * time * self._elements).tolist()

    @cached_property
    def turn(self):
        """Largest angle between the tangent at end 1 and the tangent elsewhere, of each cable. [rad]"""
        direction = self.state.direction
        difference = direction - direction[:, :1, :1]
        return np.sqrt((difference**2).sum(axis=-1).max(axis=(-2, -1))).tolist()


def mesh_of(case):
    """Finite-element mesh by which one case of a cable is solved: `Mesh`.

    The cable is divided into pieces along which it bends little. A case at a level of refinement, `case.level`, has the
    elements and order of that on the piece which a wave takes longest to pass, and fewer elements on others. Without a
    level the scene fixes the elements.

    Parameters
    ----------
    case : CableCase

    Raises
    ------
    NoSolutionError, ConvergenceError
        No equilibrium, a cable that hangs folded, fewer elements than segments between point loads and ends, or more
        nodes than `STUDY.fixed_nodes`.
    """
    results, index = case.results, case.index
    pieces, point_masses = results.pieces(index), case.point_masses
    if case.level is not None:
        return mesh_by_waves(results.form, index, pieces, *case.level, point_masses)
    return fixed_mesh(results, index, point_masses)


def fixed_mesh(results, case, carried=()):
    """Finite-element mesh of one cable whose scene fixes the number of elements (`model.elements`): `Mesh`.

    Parameters
    ----------
    results : Results
        Closed form of a batch of cables, one for each case.
    case : int
        Index of the case in the batch.
    carried : tuple of (float, float)
        Point masses on the cable: place as a share of the unstretched length, and mass over that of the cable. [-]

    Raises
    ------
    NoSolutionError
        Fewer elements than segments between point loads and ends, or more nodes than `STUDY.fixed_nodes`.
    """
    elements, order = (int(results.number(f"model.{name}")[case]) for name in ("elements", "order"))
    if elements * order > STUDY.fixed_nodes:
        raise NoSolutionError(
            f"model.elements: {elements} elements of order {order} have {elements * order} nodes "
            f"(at most {STUDY.fixed_nodes}): take fewer elements, or model.accuracy instead"
        )
    mass = str(results.values.words("model.mass")[case])
    return mesh_segments(results.catenary.segments.fraction[case], elements, order, mass, carried)


def elements_of(case):
    """The elements of one case: `BatchElements`, and its row among them.

    Raises
    ------
    NoSolutionError, ConvergenceError
        No mesh (see `mesh_of`), or no equilibrium of the elements.
    """
    models = _solve_group(case.results, [case.index], mesh_of(case), case.level)
    if models.record is not None and not models.record.converged[0]:
        raise equilibrium.refusal(models.record.of(0), models.state.mesh)
    return models, 0


def numbers_in_modes(model):
    """Estimated count of the numbers in all modes of a fixed number of elements, a `ModelTable`. [-]"""
    nodes = (model.elements or 1) * model.order
    return nodes * min(3 * nodes, STUDY.modes_at_ends)


def give_elements(cases, groups):
    """Give cases the elements that were solved for their statics, also as models where their motion needs no others.

    Parameters
    ----------
    cases : dict
        Number in the batch -> CableCase.
    groups : list of (ndarray of int, ElementResults)
        Numbers in the batch, and their elements.
    """
    for numbers, results in groups:
        batch = results.elements
        others_needed = len(numbers) > 1 and 3 * (batch.state.mesh.nodes - 2) > CABLE.cheap_freedoms
        for index, number in enumerate(numbers.tolist()):
            case = cases.get(number)
            if case is not None:
                case.by_elements = results, index
                if not (others_needed or case.point_masses):
                    case.elements = batch, index


def solve_elements(cases):
    """Solve the finite elements of many cases, those on equal meshes in one call, and store them in the cases.

    That saves time, and changes no result. A case that is left out here (large, alone on its mesh, or without an
    equilibrium) solves its own elements, or raises the error, when its `elements` is asked for.

    Parameters
    ----------
    cases : list of CableCase
        Cases of one batch, with the same `results`.
    """
    # equal cases share one cache, and so the model that is stored: one of them is solved
    groups, unsolved = {}, {id(case.cache): case for case in cases if "elements" not in case.cache}
    for case in unsolved.values():
        try:
            mesh = mesh_of(case)
        except (NoSolutionError, ConvergenceError):
            continue
        if 3 * (mesh.nodes - 2) <= CABLE.cheap_freedoms:  # larger models are solved case by case
            group_key = mesh, case.level, case.planar, bool(case.results.mirror_symmetric[case.index])
            groups.setdefault(group_key, []).append(case)
    for (mesh, level, *_), members in groups.items():
        if len(members) == 1:
            continue
        models = _solve_group(members[0].results, [case.index for case in members], mesh, level)
        for index, case in enumerate(members):
            if models.record is None or models.record.converged[index]:
                case.elements = models, index


def _solve_group(results, cases, mesh, level):
    """`BatchElements` of cases of a batch on one mesh, at a level of refinement, or fixed elements if it is None."""
    for case in cases:
        results.check(case)
    if level is None:
        return solve_fixed_elements(results, np.array(cases), mesh)
    form = results.form.take(np.array(cases))
    return BatchElements(equilibrium.from_catenary(form, mesh), None, form.span, level[0])


def solve_fixed_elements(results, cases, mesh):
    """Fixed elements of some cases on one mesh: `BatchElements`; its record says which are in equilibrium.

    Parameters
    ----------
    results : Results
    cases : ndarray of int
        With an equilibrium of the closed form.
    mesh : Mesh
    """
    catenary = results.catenary.take(cases)
    drag = uneven_drag(results.drag.take(cases))
    return BatchElements(*equilibrium.solve_many(catenary, mesh, drag), catenary.span, 1)


# --------------------------------------------------------------------- statics of cases with a fixed number of elements


class ElementResults(Results):
    """`Results` of n cases whose statics and end stiffness are those of finite elements, all on one mesh.

    Parameters
    ----------
    closed : Results
        Results in closed form of these and other cases.
    indices : ndarray of int, shape (n,)
        Rows of these cases in `closed`.
    elements : BatchElements
        Elements of the n cases, in equilibrium.
    """

    def __init__(self, closed, indices, elements):
        super().__init__(closed.values.take(indices))
        self.elements, self.failures, self._closed = elements, {}, (closed, indices)
        arrays = (array[indices] for array in (closed.reference_length, *closed.force_displacement))
        self.loaded = LoadedCables(elements.span, closed.drag.take(indices), *arrays, {})
        self.catenary = closed.catenary.take(indices)
        self.statics = ElementStatics(elements.state, elements.record, closed.middle[indices])

    @property
    def form(self):
        """The elements where they hang: `State`."""
        return self.elements.state

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
            self._along[key] = self.span.stiffness_along(self.elements.dynamics(planes).end_stiffness, *key)
        return self._along[key]

    @property
    def tension_change(self):
        """That of the closed form, see `Results`: across the cable it needs no motion across it then."""
        closed, indices = self._closed
        return lambda positions: closed.tension_change(positions)[indices]

    @property
    def slow_stiffness(self):
        """Static stiffness of the elements along x, and what the closed form has more by drag that follows. [N/m]"""
        closed, indices = self._closed
        return self.end_stiffness_along(0) + (closed.slow_stiffness - closed.end_stiffness_along(0))[indices]

    @property
    def end_stiffness_chord(self):
        """Static stiffness of end 2 along the chord, shape (n,). [N/m]"""
        planes = (IN_PLANE,) if self.planar.all() else (SPATIAL,)
        return self.elements.dynamics(planes).end_stiffness[..., 0, 0]


def element_results(results):
    """Solve the equilibria of cables by finite elements, those on equal meshes in one call.

    Parameters
    ----------
    results : Results
        Closed form of n cables, whose scenes each fix the number of elements. A cable without an equilibrium in closed
        form is left out.

    Returns
    -------
    groups : list of (ndarray of int, ElementResults)
        For cables on one mesh: their indices in `results`, and their statics by elements. Large groups are split.
    failures : dict
        Index of a cable -> NoSolutionError or ConvergenceError: it has no mesh, its elements have no equilibrium, or it
        hangs folded, with almost no tension and so no stiffness somewhere.
    """
    groups, failures = [], {}
    in_equilibrium = np.ones(len(results.values), dtype=bool)
    in_equilibrium[list(results.failures)] = False
    for case in np.flatnonzero(results.folded & in_equilibrium).tolist():
        failures[case] = NoSolutionError(LIMP if results.limp[case] else NO_MOTION)
    # folded cables are failures: with almost no tension somewhere, they have no stiffness there
    cases = np.flatnonzero(in_equilibrium & ~results.folded)
    for group in _on_equal_meshes(results, cases):
        try:
            mesh = fixed_mesh(results, group[0]).bare
        except (NoSolutionError, ConvergenceError) as error:
            failures.update(dict.fromkeys(group.tolist(), error))
            continue
        cases_at_once = max(1, STUDY.nodes_at_once // mesh.nodes)
        for members in np.split(group, range(cases_at_once, len(group), cases_at_once)):
            models = solve_fixed_elements(results, members, mesh)
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
    criteria = [values.number("model.elements"), values.number("model.order"), kind, results.planar,
             results.mirror_symmetric, results.drag.normal_drag > 0, *results.catenary.segments.fraction.T]  # fmt: skip
    rows = np.stack([np.broadcast_to(values_of_cases, (len(values),)) for values_of_cases in criteria], axis=1)[cases]
    group = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    return [cases[group == number] for number in range(group.max() + 1)]
