"""One row of a table: the columns of one case, its accuracy and its status."""

import time
from dataclasses import dataclass

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.study import loops, models
from cablestudy.study.batch import EPSILON, Batch, ScenesOnly
from cablestudy.study.case import Case
from cablestudy.study.columns import breaking, broken, infinite, lacks, stress_and_strength, value, values, without
from cablestudy.study.ladder import ROUNDING, Feeling, climb, felt_by, relative
from cablestudy.study.shelf import Shelf
from cablestudy.study.spans import load_count
from cablestudy.study.wanted import Wanted

REFERENCE = 1e-9  # accuracy of the model that a fixed model's error is estimated with
NUMBERS = 300_000  # of their modes, about: what a cache holds
TOGETHER = 200  # rows whose models are solved at once
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"
CLOSED_FORM = "statics and end stiffness: closed form of the elastic catenary, no elements"
# notes on what takes no elements: without a cable, and with one
CHEAPEST = {
    True: ("nothing to model",),
    False: (CLOSED_FORM, "left out: inertia and modes, which no column needs"),
}


@dataclass(frozen=True)
class Row:
    """Values of one case.

    Attributes
    ----------
    cells : dict
        Header -> float, or None where there is no answer; `status` is a text.
    case : Case
        With the model that was used, for what a caller wants besides, pictures for example.
    notes : tuple of str
        What was modelled and what was left out.
    errors : dict
        Header -> estimated relative error against the continuous cable; None where none was asked for or can be had.
    """

    cells: dict
    case: Case
    notes: tuple
    errors: dict

    def known_errors(self):
        """Yield the estimated errors of the cells, as a table of this one row has them."""
        yield {name: error for name, error in self.errors.items() if error is not None}

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


def _group(scenes, wanted, exact, shelf):
    """Yield the rows of scenes whose cables carry loads at equally many places, with or without fixed elements."""
    begin = time.perf_counter()
    batch = Batch(scenes)
    known, errors, coarse = closed_form(batch, scenes, wanted) if exact else ([{}] * len(scenes), {}, {})
    spent = (time.perf_counter() - begin) / len(scenes)
    done = exact and not wanted.timed and len(wanted.closed) == len(wanted.physical)
    notes = CHEAPEST[wanted.scene_only]
    width = 1 if wanted.clock else TOGETHER  # a time is that of a row alone
    if not exact:
        width = min(width, max(1, NUMBERS // max(Case(scene).size for scene in scenes)))
    for first in range(0, len(scenes), width):
        block = range(first, min(first + width, len(scenes)))
        cases = [Case(scenes[i], batch, i, shelf=shelf) for i in block]
        if done and errors.keys().isdisjoint(block):  # nothing is left to compute
            for i, case in zip(block, cases, strict=True):
                cells = {**wanted.empty, **known[i], "status": "ok"}
                yield Row(cells, case, notes, coarse.get(i, wanted.exact))
            continue
        rows = (
            _row(case, wanted, known[i], errors.get(i), coarse.get(i, wanted.exact), spent)
            for i, case in zip(block, cases, strict=True)
        )
        for case, row in zip(cases, run_together(rows, wanted), strict=True):
            # of many rows none keeps its modes
            light = Case(case.scene, batch, case.place) if wanted.motion and len(scenes) > 1 else row.case
            yield row if light is row.case else Row(row.cells, light, row.notes, row.errors)


def run_together(generators, wanted):
    """Run generators side by side, so that models of equal fineness are solved in one call.

    Parameters
    ----------
    generators : iterable of generator
        Each yields a `Case` before it uses its model, and goes on once that is there.
    wanted : Wanted
        Whether gondola and loop are to be prepared too.

    Returns
    -------
    list
        What each generator returned.
    """
    generators = list(generators)
    answers, waiting = [None] * len(generators), {}  # waiting: index -> the case yielded last

    def advance(index):
        try:
            waiting[index] = next(generators[index])
        except StopIteration as end:
            answers[index] = end.value
            waiting.pop(index, None)

    for index in range(len(generators)):
        advance(index)
    while waiting:
        rung = min((case.rung for case in waiting.values()), key=lambda rung: rung or ())  # finer ones may follow
        chosen = [index for index, case in waiting.items() if case.rung == rung]
        chosen = chosen[: max(1, NUMBERS // waiting[chosen[0]].size)]
        if len(chosen) > 1:
            cases = [waiting[index] for index in chosen]
            models.prepare(cases)
            if wanted.body:
                loops.prepare(cases, wanted.damped)
        for index in chosen:
            advance(index)
    return answers


def closed_form(batch, scenes, wanted):
    """The columns in closed form of many scenes.

    Returns
    -------
    cells : list of dict
        Header -> number.
    errors : dict
        Index -> the error of a scene without an answer.
    coarse : dict
        Index -> estimated errors of the cells, where rounding is felt more than in most.
    """
    errors, coarse = {}, {}
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
        coarse = _rounding(batch, wanted)
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
    return cells, errors, coarse


def _rounding(batch, wanted):
    """Index -> estimated errors of closed forms, where they exceed ROUNDING.

    What is left of large tensions where they balance has their rounding: a cable that all but folds. Stiff straight
    pieces feel that of the length, and the sag of an exactly vertical cable that of the chord.
    """
    statics, span = batch.statics, batch.span
    balanced = EPSILON * statics.max_tension / np.where(statics.min_tension > 0, statics.min_tension, np.inf)
    balanced = np.maximum(balanced, batch.strained)
    sags = [column.header for column in wanted.physical if column.name in ("sag", "sag_ratio")]
    upright = np.zeros(len(balanced))
    if sags and not span.cosine.all():
        sag = np.abs(statics.sag)
        upright = np.where((span.cosine == 0) & (sag > 0), EPSILON * span.chord / np.where(sag > 0, sag, 1.0), 0.0)
    coarse = {}
    for place in np.flatnonzero(np.maximum(balanced, upright) > ROUNDING):
        cells = {name: max(error, float(balanced[place]) if error else 0.0) for name, error in wanted.exact.items()}
        cells.update({name: max(cells[name], float(upright[place])) for name in sags})
        coarse[int(batch.there[place])] = cells
    return coarse


def _row(case, wanted, known, failure, exact, spent):
    """One row; a generator as `run_together` takes it.

    Parameters
    ----------
    case : Case
    wanted : Wanted
    known, exact : dict
        Header -> what is known in closed form, and its relative error.
    failure : CablestudyError or None
        Why there is no answer, where that is known already.
    spent : float
        On the row's part of the closed forms. [s]
    """
    begin, cells = time.perf_counter() - spent, dict(wanted.empty)
    status, used, dof, errors, notes = "ok", case, 0, {}, ()
    try:
        if failure is not None:
            raise failure
        if not case.exact_statics and not wanted.scene_only:
            yield case
            reason = broken(case)
            if reason:
                raise NoSolutionError(reason)
        numbers, used, dof, errors, notes = yield from _values(case, wanted, known, exact)
        cells.update(numbers)
    except CablestudyError as problem:
        status = " ".join(str(problem).split())
    if wanted.timed:
        run = {"solve_time_ms": 1e3 * (time.perf_counter() - begin)}
        if status == "ok":
            run["dof"] = dof
            run["error_estimate"] = None if None in errors.values() else max(errors.values(), default=0.0)
        cells.update((header, number) for header, number in run.items() if header in cells)
    cells["status"] = status
    return Row(cells, used, tuple(notes), errors)


def _values(case, wanted, known, exact):
    """Values of the columns, the case with the model used, degrees of freedom, estimated errors, notes.

    A generator, as `_row`.
    """
    if len(known) == len(wanted.physical):
        return known, case, 0, exact, CHEAPEST[wanted.scene_only]
    for column in wanted.keyed:
        if lacks(case.scene, column):
            raise without(case.scene, column)
    if wanted.scene_only:
        numbers = {column.header: value(column, case) for column in wanted.physical}
        return numbers, case, 0, wanted.exact, CHEAPEST[True]
    if not case.exact_statics:
        numbers = {column.header: value(column, case) for column in wanted.physical}
        model = case.scene.model
        notes = [f"model: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"]
        notes.append(f"statics: {case.model.convergence}")
        if wanted.damped:
            notes += assumed_damping(case.scene)
        errors = _errors_of_fixed(case, wanted.physical, numbers) if wanted.estimate else dict.fromkeys(numbers)
        return numbers, case, case.dof if wanted.motion else _static_dof(case), errors, notes
    numbers = {**known, **{column.header: value(column, case) for column in wanted.single}}
    if not wanted.motion:
        return numbers, case, 0, exact, CHEAPEST[False]
    if wanted.damped and case.scene.cable.damping.model == "modal":
        raise NoSolutionError(MODAL)
    finer, moving, errors, tried = yield from climb(case, wanted.sample, felt_by(case, wanted))
    for column in wanted.motion:
        if column.needs == "wind":
            errors[column.header] += finer.integration_error
    dof = finer.dof
    notes = (CLOSED_FORM, *_about(finer, dof, max(errors.values()), tried))
    return {**numbers, **moving}, finer, dof, {**exact, **errors}, notes


def _about(case, dof, error, tried):
    """What was chosen for the motion, what was left out, and what it cost."""
    mesh = case.model.mesh
    yield (
        f"motion: {mesh.elements} element(s) of order {mesh.order} about the closed form, {dof} unknowns;"
        f" estimated error {error:.1e}, asked for {case.scene.model.accuracy:g}"
    )
    planes = [name for name in ("in_plane", "out_of_plane", "dynamics") if name in case.__dict__]
    if case.planar and planes in (["in_plane"], ["out_of_plane"]):
        there, gone = ("in", "across") if planes == ["in_plane"] else ("across", "in")
        yield f"left out: motion {gone} the cable's plane, since all that is asked for moves {there} it"
    yield f"compared: {tried} models, coarse to fine"


def assumed_damping(scene):
    """Notes, at most one: a scene without damping gets the default."""
    if "damping" in scene.cable.model_fields_set:
        return []
    damping = scene.cable.damping
    return [f"damping: the scene gives none; {damping.model}, with a ratio of {100 * damping.ratio:g} %, is assumed"]


def _static_dof(case):
    planes = 2 if case.planar else 3
    return planes * (case.model.mesh.nodes - 2)


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
        return case, wanted(case), (note, f"statics: {case.model.convergence}")
    waves = count or 2 * upto * case.travel_time
    feeling = Feeling(
        waves,
        lambda _, values: max(values.values(), default=0.0),
        alone=True,
    )

    def sample(other):
        found = wanted(other)
        return dict(enumerate(found.frequency.tolist())), dict(enumerate(found.errors.tolist()))

    (found,) = run_together([climb(case, sample, feeling)], Wanted(()))
    finer, _, errors, tried = found
    return finer, wanted(finer), tuple(_about(finer, finer.dof, max(errors.values(), default=0.0), tried))


def _errors_of_fixed(case, columns, values):
    """Errors of a fixed model, against the continuous cable to REFERENCE; None where that cannot be had."""
    model = case.scene.model.model_copy(update={"elements": None, "accuracy": REFERENCE})
    exact = evaluate(case.scene.model_copy(update={"model": model}), columns)
    counted = [name for name in values if name != "iterations"]
    if exact.failed:
        return dict.fromkeys(counted)
    return {name: relative(values[name], exact.cells[name]) for name in counted}
