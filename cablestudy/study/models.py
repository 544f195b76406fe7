"""Finite elements of one cable, or of many on one mesh, in equilibrium, with their motion; and the mesh of a case."""

from functools import cached_property

import numpy as np

from cablestudy.cable import equilibrium
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.element import counts_of_pieces, mesh_pieces, mesh_segments
from cablestudy.cable.steady_drag import uneven_drag
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.results import along
from cablestudy.study.tolerances import STUDY


class BatchElements:
    """The elements of many cables on one mesh, in equilibrium.

    Parameters
    ----------
    state : State
        With a leading axis of cables.
    record : Record or None
        Of the iteration to equilibrium; None where the nodes lie on the catenary in closed form.
    span : Span
        Fields of shape (cables,).
    elements : int
        Number of elements of the smooth piece with the most waves.
    """

    def __init__(self, state, record, span, elements):
        self.state, self.record, self.span, self._elements = state, record, span, elements
        self._dynamics, self._ends, self._stiffness = {}, {}, {}

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

    def end_stiffness_along(self, planes, axis):
        """Static stiffness of end 2 along x, y or z, of each cable moving in some planes. [N/m]"""
        if (planes, axis) not in self._stiffness:
            stiffness = along(self.span, self.dynamics(planes).end_stiffness, axis)
            self._stiffness[planes, axis] = stiffness.tolist()
        return self._stiffness[planes, axis]

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


class CableElements:
    """The elements of one cable of `BatchElements`.

    Parameters
    ----------
    models : BatchElements
    index : int
        Of the cable among them.
    """

    def __init__(self, models, index):
        self._models, self._index = models, index

    @property
    def mesh(self):
        """`Mesh` of the elements."""
        return self._models.state.mesh

    @cached_property
    def state(self):
        """`State` of the elements."""
        return self._models.state.take(self._index)

    @property
    def convergence(self):
        """`Record` of the iteration to equilibrium; None where the elements lie on the closed form."""
        return self._models.record and self._models.record.of(self._index)

    def dynamics(self, planes):
        """`Dynamics` of this cable; its modes are computed with those of the others."""
        return self._models.dynamics(planes).take(self._index)

    def end_model(self, planes, damping):
        """`Superelement` of this cable."""
        return self._models.ends(planes).model(damping, self._index)

    def end_shapes(self, planes):
        """Displacements of the nodes by modes and ends of `end_model`, shape (nodes, 3, n + 6): `Ends.shapes`."""
        return self._models.ends(planes).shapes[self._index]

    def end_stiffness_along(self, planes, axis):
        """Static stiffness of end 2 along x, y or z, see `BatchElements`. [N/m]"""
        return self._models.end_stiffness_along(planes, axis)[self._index]

    @property
    def wave_time(self):
        """Travel time of a transverse wave along the longest smooth piece, see `BatchElements`. [s]"""
        return self._models.wave_time[self._index]

    @property
    def turn(self):
        """Largest angle between the tangent at end 1 and another one, see `BatchElements`. [rad]"""
        return self._models.turn[self._index]


def mesh_of(case):
    """The mesh of a case: of its level of refinement, or of its scene.

    Raises
    ------
    NoSolutionError, ConvergenceError
        No equilibrium, a cable that hangs folded, more loads than elements, or more nodes than `fixed_nodes`.
    """
    results, index = case.results, case.index
    pieces, point_masses = results.pieces(index), case.point_masses
    if case.level is not None:
        elements, order = case.level
        if len(pieces) == 2:
            return mesh_pieces(pieces, (elements,), order, point_masses=point_masses)
        # on each piece as many as its share of the waves needs
        shares = results.travel_shares(index, pieces) if elements > 1 else [1.0] * (len(pieces) - 1)
        return mesh_pieces(pieces, counts_of_pieces(elements, shares), order, point_masses=point_masses)
    return fixed_mesh(results, index, point_masses)


def fixed_mesh(results, case, carried=()):
    """Mesh of one cable whose scene states the number of elements (`model.elements`): `Mesh`.

    Parameters
    ----------
    results : Results
        Closed form of a batch of cases.
    case : int
        Row of the case in the batch.
    carried : tuple
        Point masses on the cable, see `Mesh`.

    Raises
    ------
    NoSolutionError
        More loads than elements, or more nodes than `fixed_nodes`.
    """
    elements, order = (int(results.given(f"model.{name}")[case]) for name in ("elements", "order"))
    if elements * order > STUDY.fixed_nodes:
        raise NoSolutionError(
            f"model.elements: {elements} elements of order {order} have {elements * order} nodes "
            f"(at most {STUDY.fixed_nodes}): take fewer elements, or model.accuracy instead"
        )
    mass = str(results.values.words("model.mass")[case])
    return mesh_segments(results.catenary.segments.fraction[case], elements, order, mass, carried)


def model_of(case):
    """The elements of one case: `CableElements`.

    Raises
    ------
    NoSolutionError, ConvergenceError
        No mesh (see `mesh_of`), or no equilibrium of the elements.
    """
    models = _solve_group(case.results, [case.index], mesh_of(case), case.level)
    if models.record is not None and not models.record.converged[0]:
        raise equilibrium.refusal(models.record.of(0), models.state.mesh)
    return CableElements(models, 0)


def numbers_of(model):
    """Estimated count of the numbers in all modes of a fixed number of elements, a `ModelTable`. [-]"""
    nodes = (model.elements or 1) * model.order
    return nodes * min(3 * nodes, STUDY.modes_at_ends)


def give_elements(cases, groups):
    """Set the models of cases to the elements that were solved for their statics, where their motion needs no others.

    Parameters
    ----------
    cases : dict
        Number in the batch -> Case.
    groups : list of (ndarray of int, ElementResults)
        Numbers in the batch, and their elements.
    """
    for numbers, elements in groups:
        batch = elements.models
        if len(numbers) > 1 and 3 * (batch.state.mesh.nodes - 2) > CABLE.cheap_freedoms:
            continue
        for index, number in enumerate(numbers.tolist()):
            case = cases.get(number)
            if case is not None and not case.point_masses:
                case.model = CableElements(batch, index)


def solve_models(cases):
    """Solve the finite elements of many cases, those on equal meshes in one call, and store them in the cases.

    That saves time, and changes no result: a case that is left out here (large, alone on its mesh, or without an
    equilibrium) solves its own elements, or raises the error, when its `model` is asked for.

    Parameters
    ----------
    cases : list of Case
        Cases of one batch, with the same `results`.
    """
    groups, different = {}, {id(case.known): case for case in cases if "model" not in case.known}
    for case in different.values():
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
                case.model = CableElements(models, index)


def _solve_group(results, cases, mesh, level):
    """`BatchElements` of cases of a batch on one mesh, at a level of refinement, or fixed elements if it is None."""
    for case in cases:
        results.check(case)
    if level is None:
        return solve_elements(results, np.array(cases), mesh)
    catenary = results.catenary.take(np.array(cases))
    return BatchElements(equilibrium.from_catenary(catenary, mesh), None, catenary.span, level[0])


def solve_elements(results, cases, mesh):
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
