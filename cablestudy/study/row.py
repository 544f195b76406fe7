"""One row of a table: the columns of one case, its accuracy and its status."""

import time
from dataclasses import dataclass

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.study.batch import Batch, ScenesOnly
from cablestudy.study.case import LADDER, Case
from cablestudy.study.columns import breaking, broken, infinite, lacks, stress_and_strength, value, values, without
from cablestudy.study.shelf import Shelf
from cablestudy.study.spans import load_count

ROUNDING = 1e-12  # of the closed forms, held by the tests against 50 digits
REFERENCE = 1e-9  # accuracy of the model that a fixed model's error is estimated with
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"
CLOSED_FORM = "statics and end stiffness: closed form of the elastic catenary, no elements"
# notes on what takes no elements: without a cable, and with one
CHEAPEST = {
    True: ("nothing to model",),
    False: (CLOSED_FORM, "left out: mass and modes, which no column needs"),
}
CLOSED = ("scene", "statics", "stiffness")
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
    errors : dict
        Header -> estimated relative error against the continuous cable; None where none was asked for or can be had.
    """

    cells: dict
    case: Case
    notes: tuple
    errors: dict

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
    return evaluate_cases([scene], columns)[0]


def evaluate_cases(scenes, columns):
    """Compute the columns of many scenes: closed forms for all at once, and what some share once.

    Parameters
    ----------
    scenes : sequence of Scene
    columns : sequence of Column

    Returns
    -------
    list of Row
        Each as if it were alone, to the last digit.
    """
    groups = {}
    for index, scene in enumerate(scenes):
        groups.setdefault((load_count(scene), scene.model.elements is None), []).append(index)
    rows, shelf, wanted = [None] * len(scenes), Shelf(), Wanted(columns)
    for (_, exact), indices in groups.items():
        chosen = [scenes[index] for index in indices]
        for index, row in zip(indices, _group(chosen, wanted, exact, shelf), strict=True):
            rows[index] = row
    return rows


class Wanted:
    """Columns, by what they need.

    Parameters
    ----------
    columns : sequence of Column
    """

    def __init__(self, columns):
        self.physical = [column for column in columns if column.needs != "run"]
        self.closed = [column for column in self.physical if column.needs in CLOSED and not column.each]
        self.motion = [column for column in self.physical if column.needs in DISCRETE]
        self.scene_only = all(column.needs == "scene" for column in self.physical)
        self.estimate = any(column.name == "error_estimate" for column in columns)
        self.exact = {column.header: 0.0 if column.needs == "scene" else ROUNDING for column in self.physical}
        self.empty = dict.fromkeys(column.header for column in columns)
        self.timed = any(column.needs == "run" and column.name != "status" for column in columns)


def _group(scenes, wanted, exact, shelf):
    """Rows of scenes whose cables are of one kind."""
    begin = time.perf_counter()
    batch = Batch(scenes)
    known, errors = closed_form(batch, scenes, wanted) if exact else ([{}] * len(scenes), {})
    spent = (time.perf_counter() - begin) / len(scenes)
    for index, scene in enumerate(scenes):
        case = Case(scene, batch, index, shelf=shelf)
        yield _row(case, wanted, known[index], errors.get(index), spent)


def closed_form(batch, scenes, wanted):
    """The columns in closed form of many scenes.

    Returns
    -------
    cells : list of dict
        Header -> number.
    errors : dict
        Index -> the error of a scene without an answer.
    """
    errors = {}
    if wanted.scene_only:
        batch, there = ScenesOnly(scenes), range(len(scenes))
    else:
        errors.update(batch.unsolved)
        there = batch.there.tolist()
        if any(scene.cable.strength is not None for scene in scenes):
            stress, strength = stress_and_strength(batch)
            for place in np.flatnonzero(stress > strength).tolist():
                reason = breaking(float(stress[place]), float(strength[place]))
                errors.setdefault(there[place], NoSolutionError(reason))
    numbers = []
    for column in wanted.closed:
        if column.key:
            for index in there:
                if lacks(scenes[index], column):
                    errors.setdefault(index, without(scenes[index], column))
        numbers.append(values(column, batch))
        for place in np.flatnonzero(~np.isfinite(numbers[-1])).tolist():
            errors.setdefault(there[place], infinite(column))
    cells, headers = [{} for _ in scenes], [column.header for column in wanted.closed]
    for index, *row in zip(there, *numbers, strict=True):
        cells[index] = dict(zip(headers, row, strict=True))
    return cells, errors


def _row(case, wanted, known, failure, spent):
    """One row, from what is known of it in closed form."""
    if failure is None and not wanted.timed and len(known) == len(wanted.physical):
        return Row({**wanted.empty, **known, "status": "ok"}, case, CHEAPEST[wanted.scene_only], wanted.exact)
    begin, cells = time.perf_counter() - spent, dict(wanted.empty)
    status, dof, errors, notes = "ok", 0, {}, ()
    try:
        if failure is not None:
            raise failure
        if not case.exact_statics and not wanted.scene_only:
            reason = broken(case)
            if reason:
                raise NoSolutionError(reason)
        numbers, dof, errors, notes = _values(case, wanted, known)
        cells.update(numbers)
    except CablestudyError as problem:
        status = " ".join(str(problem).split())
    run = {
        "dof": dof,
        "solve_time_ms": 1e3 * (time.perf_counter() - begin),
        "error_estimate": None if None in errors.values() else max(errors.values(), default=0.0),
        "status": status,
    }
    for header, number in run.items():
        if header in cells and (status == "ok" or header in ("solve_time_ms", "status")):
            cells[header] = number
    cells["status"] = status
    return Row(cells, case, tuple(notes), errors)


def _values(case, wanted, known):
    """Values of the columns, degrees of freedom, estimated errors, notes."""
    if len(known) == len(wanted.physical):
        return known, 0, wanted.exact, CHEAPEST[wanted.scene_only]
    rest = [column for column in wanted.physical if column.header not in known]
    if wanted.scene_only:
        return {column.header: value(column, case) for column in rest}, 0, wanted.exact, CHEAPEST[True]
    if not case.exact_statics:
        numbers = {column.header: value(column, case) for column in rest}
        model = case.scene.model
        notes = [f"model: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"]
        notes.append(f"statics: {case.discrete[1]}")
        errors = _errors_of_fixed(case, wanted.physical, numbers) if wanted.estimate else dict.fromkeys(numbers)
        return numbers, case.dof if wanted.motion else _static_dof(case), errors, notes
    numbers = {**known, **{column.header: value(column, case) for column in rest if column not in wanted.motion}}
    if not wanted.motion:
        return numbers, 0, wanted.exact, CHEAPEST[False]
    try:
        finer, moving, errors = _ladder(case, lambda other: {c.header: value(c, other) for c in wanted.motion})
    except ConvergenceError as failure:
        damped = any(column.needs in ("loop", "wind") for column in wanted.motion)
        if damped and case.scene.cable.damping.model == "modal":
            raise ConvergenceError(f"{failure} ({MODAL})", failure.record) from None
        raise
    for column in wanted.motion:
        if column.needs == "wind":
            errors[column.header] += finer.integration_error
    notes = (CLOSED_FORM, _about(finer, max(errors.values())))
    return {**numbers, **moving}, finer.dof, {**wanted.exact, **errors}, notes


def _about(case, error):
    mesh = case.discrete[0].mesh
    return (
        f"motion: {mesh.elements} element(s) of order {mesh.order} about the closed form, {case.dof} unknowns;"
        f" estimated error {error:.1e}, asked for {case.scene.model.accuracy:g}"
    )


def _static_dof(case):
    planes = 2 if case.span.planar else 3
    return planes * (case.discrete[0].mesh.nodes - 2)


def _ladder(case, sample):
    """Raise the order until two neighbours agree; the finer one is the answer.

    Parameters
    ----------
    case : Case
    sample : callable
        Case -> dict of numbers to agree on.

    Returns
    -------
    case : Case
        The finer one.
    values, errors : dict
        The numbers and their estimated relative errors.
    """
    accuracy = case.scene.model.accuracy
    before, errors, failure = None, None, None
    for elements, order in LADDER:
        finer = case.refined(elements, order)
        try:
            values = sample(finer)
        except (ConvergenceError, NoSolutionError) as problem:  # a finer one may have the mode that a coarse one lacks
            failure = problem
            continue
        if before is not None and before.keys() == values.keys():
            errors = {name: max(_relative(values[name], before[name]), ROUNDING) for name in values}
            if max(errors.values(), default=0.0) <= accuracy:
                return finer, values, errors
        before = values
    if failure is not None and before is None:
        raise failure
    reached = "the finest model is too coarse"
    if errors is not None:
        reached = f"the error reached is about {max(errors.values()):.1e}"
    raise ConvergenceError(f"accuracy {accuracy:g} cannot be had: {reached}")


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
            found = other.dynamics.up_to(upto)
            return found.first(int(np.searchsorted(found.frequency, upto, side="right")))
        found = other.dynamics.modes(count)
        if case.exact_statics and len(found) < count:
            raise ConvergenceError(f"{count} modes are too many: the finest model has {len(found)}")
        return found.first(count)

    if not case.exact_statics:
        model = case.scene.model
        note = f"motion: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"
        return case, wanted(case), (note, f"statics: {case.discrete[1]}")
    finer, _, errors = _ladder(case, lambda other: dict(enumerate(wanted(other).frequency)))
    return finer, wanted(finer), (_about(finer, max(errors.values(), default=0.0)),)


def _relative(value, reference):
    if value is None or reference is None:
        return float(value is not reference)
    return abs(value - reference) / abs(reference) if reference else float(value != reference)


def _errors_of_fixed(case, columns, values):
    """Errors of a fixed model, against the continuous cable to REFERENCE; None where that cannot be had."""
    model = case.scene.model.model_copy(update={"elements": None, "accuracy": REFERENCE})
    exact = evaluate(case.scene.model_copy(update={"model": model}), columns)
    counted = [name for name in values if name != "iterations"]
    if exact.failed:
        return dict.fromkeys(counted)
    return {name: _relative(values[name], exact.cells[name]) for name in counted}
