"""One row of a table: the columns of one case, its accuracy and its status."""

import time
from dataclasses import dataclass

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.study.case import FINEST, LADDER, Case
from cablestudy.study.columns import broken, value

ROUNDING = 1e-12  # of the closed forms, held by the tests against 50 digits
REFERENCE = 1e-9  # accuracy of the model that a fixed model's error is estimated with
EPSILON = 4e-16  # rounding of one number
MOST = 3000  # unknowns beyond which the search for an accuracy ends
UNSEEN = 10  # error over the angle by which the cable turns, where its transverse waves are not resolved
NOISE = 1e-8  # difference below which rounding may hide how the error falls
SAFETY, LEAST = 10, 0.03  # of the error that is left, held against random scenes by tests/test_extremes.py
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"
DISCRETE = ("modes", "gondola", "loop", "wind")


@dataclass(frozen=True)
class Row:
    """Values of one case.

    Attributes
    ----------
    cells : dict
        Header -> float, or None where there is no answer; `status` is a text.
    case : Case
        For what a caller wants besides, pictures for example.
    notes : tuple of str
        What was modelled and what was left out.
    """

    cells: dict
    case: Case
    notes: tuple

    @property
    def failed(self):
        """Whether the case has no answer."""
        return self.cells["status"] != "ok"


def evaluate(scene, columns):
    """Compute the columns of one scene.

    Parameters
    ----------
    scene : Scene
    columns : sequence of Column

    Returns
    -------
    Row
        A case that cannot be solved has empty cells, and its status says why.
    """
    begin = time.perf_counter()
    case = Case(scene)
    physical = [column for column in columns if column.needs != "run"]
    cells = dict.fromkeys((column.header for column in columns), None)
    status, dof, error, notes = "ok", 0, None, ()
    try:
        if any(column.needs != "scene" for column in physical):
            reason = broken(case)
            if reason:
                raise NoSolutionError(reason)
        estimate = any(column.name == "error_estimate" for column in columns)
        values, dof, error, notes = _values(case, physical, estimate)
        cells.update(values)
    except CablestudyError as failure:
        status = " ".join(str(failure).split())
    run = {
        "dof": dof,
        "solve_time_ms": 1e3 * (time.perf_counter() - begin),
        "error_estimate": error,
        "status": status,
    }
    for header, number in run.items():
        if header in cells and (status == "ok" or header in ("solve_time_ms", "status")):
            cells[header] = number
    cells["status"] = status
    return Row(cells, case, tuple(notes))


def _values(case, columns, estimate):
    """Values of the columns, degrees of freedom, estimated error, notes."""
    if all(column.needs == "scene" for column in columns):
        return {column.header: value(column, case) for column in columns}, 0, 0.0, ("nothing to model",)
    motion = [column for column in columns if column.needs in DISCRETE]
    if not case.exact_statics:
        values = {column.header: value(column, case) for column in columns}
        model = case.scene.model
        notes = [f"model: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"]
        notes.append(f"statics: {case.discrete[1]}")
        error = _error_of_fixed(case, columns, values) if estimate else None
        return values, case.dynamics.dof if motion else _static_dof(case), error, notes
    values = {column.header: value(column, case) for column in columns if column not in motion}
    notes = ["statics and end stiffness: closed form of the elastic catenary, no elements"]
    rounding = _rounding(case, columns)
    if not motion:
        notes.append("left out: mass and modes, which no column needs")
        return values, 0, rounding, notes
    try:
        finer, moving, error = _ladder(
            case, lambda other: {c.header: value(c, other) for c in motion}, _highest(motion)
        )
    except ConvergenceError as failure:
        damped = any(column.needs in ("loop", "wind") for column in motion)
        if damped and case.scene.cable.damping.model == "modal":
            raise ConvergenceError(f"{failure} ({MODAL})", failure.record) from None
        raise
    notes.append(_about(finer, error))
    error = max(error, rounding) if len(motion) < len(columns) else error
    return {column.header: {**values, **moving}[column.header] for column in columns}, finer.dynamics.dof, error, notes


def _rounding(case, columns):
    """Relative error of the closed forms by rounding.

    What is left of large tensions where they balance has their rounding: a cable that all but folds. The sag of an
    exactly vertical cable has that of the chord.
    """
    error, statics = ROUNDING, case.statics
    if statics.min_tension > 0:
        error = max(error, EPSILON * statics.max_tension / statics.min_tension)
    if not case.span.cosine and any(column.name.startswith("sag") for column in columns) and statics.sag:
        error = max(error, EPSILON * case.span.chord / abs(statics.sag))
    return float(error)


def _highest(columns):
    """The highest frequency that columns feel: Case, values -> [Hz]."""
    own = [column.header for column in columns if column.needs == "modes"]

    def highest(case, values):
        felt = [values[name] for name in own]
        return max(felt if len(own) == len(columns) else [*felt, case.gondola_frequency])

    return highest


def _about(case, error):
    mesh = case.discrete[0].mesh
    return (
        f"motion: {mesh.elements} element(s) of order {mesh.order} about the closed form, {case.dynamics.dof} unknowns;"
        f" estimated error {error:.1e}, asked for {case.scene.model.accuracy:g}"
    )


def _static_dof(case):
    planes = 2 if case.span.planar else 3
    return planes * (case.discrete[0].mesh.nodes - 2)


def _ladder(case, sample, felt=None):
    """Raise the order until the error left is below the accuracy.

    Parameters
    ----------
    case : Case
    sample : callable
        Case -> dict of numbers to agree on.
    felt : callable, optional
        Case, dict -> highest frequency that the numbers feel; by default the largest of them. [Hz]

    Returns
    -------
    case : Case
        The finest that was needed.
    values : dict
    error : float

    Notes
    -----
    Of three neighbours the differences d1 and d2 tell how fast the error falls with the order, and so what is left:
    d2 (d2/d1)^(step/last step), times SAFETY, at least LEAST of d2. A model that does not resolve the transverse waves
    at a frequency agrees with its neighbours on a number that ignores them: where the cable turns by an angle, they may
    be wrong by UNSEEN times as much.
    """
    accuracy = case.scene.model.accuracy
    felt = felt or (lambda other, values: max(values.values(), default=0.0))
    history, error, failure, last = [], None, None, 0.0
    for elements, order in LADDER:
        finer = case.refined(elements, order)
        if history and finer.dynamics.dof > MOST:
            break
        try:
            values = sample(finer)
        except (ConvergenceError, NoSolutionError) as problem:  # a finer one may have the mode that a coarse one lacks
            failure = problem
            continue
        waves, turn = finer.waves(felt(finer, values))
        known, last = abs(waves - last) < 0.1 * last, waves
        if known and waves > FINEST and UNSEEN * turn > accuracy:
            raise ConvergenceError(
                f"accuracy {accuracy:g} cannot be had: about {waves:.3g} waves along a piece of the cable, "
                f"and the finest model resolves {FINEST}"
            )
        unseen = UNSEEN * turn if 1.7 * waves + 3 > elements * order else 0.0
        if unseen > accuracy:
            history = []  # it says nothing of how the error falls
            continue
        if history and history[-1][1].keys() != values.keys():
            history = []
        history.append((elements * order, values))
        if len(history) > 2:
            error = max([ROUNDING, unseen, *(_left(history[-3:], name) for name in values)])
            if error <= accuracy:
                return finer, values, error
    if failure is not None and not history:
        raise failure
    reached = "the finest model is too coarse" if error is None else f"the error reached is about {error:.1e}"
    raise ConvergenceError(f"accuracy {accuracy:g} cannot be had: {reached}")


def _left(history, name):
    """Relative error that is left in the last of three values."""
    orders, values = zip(*((order, values[name]) for order, values in history), strict=True)
    last, before = _relative(values[2], values[1]), _relative(values[1], values[0])
    if last < ROUNDING or None in values or not last < before < 0.1:
        return last if last < ROUNDING or before > last else SAFETY * last
    rest = (last / before) ** ((orders[2] - orders[1]) / (orders[1] - orders[0]))
    return last * max(SAFETY * rest, LEAST if last > NOISE else 1.0)


def modes(case, count=None, upto=None):
    """The modes of a case, to its accuracy.

    Parameters
    ----------
    case : Case
    count : int, optional
        How many, from the lowest; fewer when a fixed model has no more.
    upto : float, optional
        All up to this frequency instead. [Hz]

    Returns
    -------
    case : Case
        With the discretisation that was used.
    modes : Modes
    notes : tuple of str

    Raises
    ------
    NoSolutionError, ConvergenceError
    """

    reason = broken(case)
    if reason:
        raise NoSolutionError(reason)

    def wanted(other):
        if upto is not None:
            found = other.modes_up_to(upto)
            return found.first(int(np.searchsorted(found.frequency, upto, side="right")))
        found = other.modes(count)
        if case.exact_statics and len(found) < count:
            raise ConvergenceError(f"{count} modes are too many: the finest model has {len(found)}")
        return found.first(count)

    if not case.exact_statics:
        model = case.scene.model
        note = f"motion: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"
        return case, wanted(case), (note, f"statics: {case.discrete[1]}")
    finer, _, error = _ladder(case, lambda other: dict(enumerate(wanted(other).frequency)))
    return finer, wanted(finer), (_about(finer, error),)


def _relative(value, reference):
    if value is None or reference is None:
        return float(value is not reference)
    return abs(value - reference) / abs(reference) if reference else float(value != reference)


def _error_of_fixed(case, columns, values):
    """Error of a fixed model, against the continuous cable to REFERENCE; None where that cannot be had."""
    model = case.scene.model.model_copy(update={"elements": None, "accuracy": REFERENCE})
    exact = evaluate(case.scene.model_copy(update={"model": model}), columns)
    if exact.failed:
        return None
    return max((_relative(values[name], exact.cells[name]) for name in values if name != "iterations"), default=0.0)
