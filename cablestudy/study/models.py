"""Elements for cases: those of many cables on one mesh are made, and later solved, in one call."""

from functools import cached_property
from math import ceil

import numpy as np

from cablestudy.cable import equilibrium
from cablestudy.cable.dynamics import ALL_AT_ONCE, Dynamics
from cablestudy.cable.element import mesh_pieces, mesh_segments
from cablestudy.control.ends import Ends
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.batch import along

MAX_MODES = 600  # of a large model, for its dynamics
MAX_NODES = 1_000_000  # of a fixed model: its statics take 2 s and 420 MB


class Models:
    """The elements of many cables on one mesh, in equilibrium.

    Parameters
    ----------
    state : State
        With a leading axis of cables.
    record : Record or None
        Of the iteration to equilibrium; None where the elements lie on the closed form.
    span : Span
        Fields of shape (cables,).
    elements : int
        Into how many the smooth piece with the most waves is divided.
    """

    def __init__(self, state, record, span, elements):
        self.state, self.record, self.span, self._elements = state, record, span, elements
        self._dynamics, self._ends, self._stiffness = {}, {}, {}

    def dynamics(self, planes):
        """`Dynamics` of all cables, made once."""
        if planes not in self._dynamics:
            few = self.record is None  # other orders follow
            self._dynamics[planes] = Dynamics(self.state, self.span.unstretched_length, self.span.mass, planes, few)
        return self._dynamics[planes]

    def ends(self, planes):
        """`Ends` of all cables, made once, with every mode that can be had."""
        if planes not in self._ends:
            dynamics = self.dynamics(planes)
            self._ends[planes] = Ends(dynamics, self.span.frame, min(dynamics.dof, MAX_MODES))
        return self._ends[planes]

    def end_stiffness_along(self, planes, axis):
        """Static stiffness of end 2 along x, y or z, of each cable moving in some planes. [N/m]"""
        if (planes, axis) not in self._stiffness:
            stiffness = along(self.span, self.dynamics(planes).end_stiffness, axis)
            self._stiffness[planes, axis] = stiffness.tolist()
        return self._stiffness[planes, axis]

    @cached_property
    def statics(self):
        """Mean, horizontal, largest and least tension [N], stretched length [m] and Newton steps, of each cable."""
        state, span = self.state, self.span
        weights, unit = state.mesh.point_weights, state.force
        force = (state.tension * unit[:, None, None])[..., None] * state.direction
        up = span.up[:, None, None]
        level = force - (force * up).sum(axis=-1, keepdims=True) * up

        def mean(values):
            return (weights * values).reshape(len(values), -1).sum(axis=-1)

        tension = mean(state.tension) * unit
        columns = (
            tension,
            mean(np.sqrt((level**2).sum(axis=-1))),
            state.max_tension,
            state.min_tension,
            span.unstretched_length * (1 + tension / span.axial_stiffness),
            self.record.steps,
        )
        return list(zip(*(column.tolist() for column in columns), strict=True))

    @cached_property
    def wave_time(self):
        """How long a transverse wave takes along the longest smooth piece, for each cable. [s]

        By the speed of waves across the cable, sqrt(T/(m stretch)).
        """
        state, span = self.state, self.span
        force = state.tension * state.force[:, None, None]
        slow = np.sqrt(span.mass[:, None, None] * state.stretch / force)
        time = (state.mesh.point_weights * slow).sum(axis=-1).max(axis=-1)
        # elements of one piece follow each other and are alike
        return (span.unstretched_length * time * self._elements).tolist()

    @cached_property
    def turn(self):
        """How far each cable turns. [rad]"""
        direction = self.state.direction
        apart = direction - direction[:, :1, :1]
        return np.sqrt((apart**2).sum(axis=-1).max(axis=(-2, -1))).tolist()


class Model:
    """The elements of one cable of `Models`.

    Parameters
    ----------
    models : Models
    place : int
        Of the cable among them.
    """

    def __init__(self, models, place):
        self._models, self._place = models, place

    @property
    def mesh(self):
        """`Mesh` of the elements."""
        return self._models.state.mesh

    @cached_property
    def state(self):
        """`State` of the elements."""
        return self._models.state.take(self._place)

    @property
    def convergence(self):
        """How the statics of the elements were found; None for the closed form."""
        return self._models.record and self._models.record.of(self._place)

    def dynamics(self, planes):
        """`Dynamics` of this cable, which finds its modes together with the others."""
        return self._models.dynamics(planes).take(self._place)

    def end_model(self, planes, damping):
        """`EndModel` of this cable."""
        return self._models.ends(planes).model(damping, self._place)

    def end_moments(self, planes):
        """See `Ends.moments`, shape (3,)."""
        return self._models.ends(planes).moments[self._place]

    def end_stiffness_along(self, planes, axis):
        """See `Models`. [N/m]"""
        return self._models.end_stiffness_along(planes, axis)[self._place]

    @property
    def statics(self):
        """See `Models`."""
        return self._models.statics[self._place]

    @property
    def wave_time(self):
        """See `Models`. [s]"""
        return self._models.wave_time[self._place]

    @property
    def turn(self):
        """See `Models`. [rad]"""
        return self._models.turn[self._place]


def mesh_of(case):
    """The mesh of a case: of its rung, or of its scene.

    Raises
    ------
    NoSolutionError
        A cable that hangs folded, with more loads than elements, or with more nodes than MAX_NODES.
    """
    pieces = case.batch.pieces_of(case.place)
    if case.rung is not None:
        elements, order = case.rung
        if len(pieces) == 2:
            return mesh_pieces(pieces, (elements,), order)
        # as many as the waves along each piece ask for
        times = case.batch.times_of(case.place, pieces) if elements > 1 else [1.0] * (len(pieces) - 1)
        return mesh_pieces(pieces, tuple(ceil(elements * time - 1e-9) or 1 for time in times), order)
    model = case.scene.model
    nodes = model.elements * model.order
    if nodes > MAX_NODES:
        raise NoSolutionError(
            f"model.elements: {model.elements} elements of order {model.order} have {nodes} nodes "
            f"(at most {MAX_NODES}): take fewer elements, or model.accuracy instead"
        )
    try:
        return mesh_segments(case.batch.fractions_of(case.place), model.elements, model.order, model.mass)
    except ValueError as error:
        raise NoSolutionError(str(error)) from None


def model_of(case):
    """The elements of one case.

    Returns
    -------
    Model

    Raises
    ------
    NoSolutionError, ConvergenceError
        There are none.
    """
    models = _solved(case.batch, [case.place], mesh_of(case), case.rung)
    if models.record is not None and not models.record.converged[0]:
        raise equilibrium.refusal(models.record.of(0), models.state.mesh)
    return Model(models, 0)


def prepare(cases):
    """Make the elements of cases that will be asked for them, those on one mesh in one call.

    Parameters
    ----------
    cases : list of Case
        Of one batch. What one of them lacks it finds, or fails of, alone.
    """
    groups, seen = {}, set()
    for case in cases:
        if case.has_model or case.cable_key in seen:
            continue
        seen.add(case.cable_key)
        try:
            mesh = mesh_of(case)
        except (NoSolutionError, ConvergenceError):
            continue
        if 3 * (mesh.nodes - 2) <= ALL_AT_ONCE:
            groups.setdefault((mesh, case.rung, case.planar, case.batch.mirror_symmetric_of(case.place)), []).append(
                case
            )
    for (mesh, rung, *_), members in groups.items():
        if len(members) > 1:
            models = _solved(members[0].batch, [case.place for case in members], mesh, rung)
            for place, case in enumerate(members):
                if models.record is None or models.record.converged[place]:
                    case.keep(Model(models, place))


def _solved(batch, places, mesh, rung):
    """Models of some cables of a batch."""
    catenary = batch.catenaries_of(places)
    if rung is not None:
        return Models(equilibrium.from_catenary(catenary, mesh), None, catenary.span, rung[0])
    return Models(*equilibrium.solve_many(catenary, mesh), catenary.span, 1)
