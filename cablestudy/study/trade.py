"""Command `trade`: error against time, for every model that a user can choose.

The error is against the continuous cable: its closed form for statics and end stiffness, and elements of high order
about that closed form, refined until two neighbours agree, for everything that moves. The time is what one more case of
a sweep costs: processor time from the scene to the numbers, statics included, on one thread, with imports and tables of
constants warm.
"""

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, SceneError
from cablestudy.scene.scene import missing
from cablestudy.study import windrms
from cablestudy.study.case import Case
from cablestudy.study.column_requirements import DISCRETE
from cablestudy.study.columns import ROUNDING, broken, find, lacks
from cablestudy.study.row import MODAL
from cablestudy.study.trade_models import Answer, choices, integrate_by, read, with_accuracy

DEFAULT = ("end_stiffness", "cable_frequency", "inplane_frequency_8", "gondola_frequency", "gondola_rms_open_loop")
RUNGS = ((1, 16), (1, 24), (1, 32), (1, 48), (2, 48), (4, 48), (8, 48), (16, 48))  # elements a segment, order
AGREED = 1e-12  # relative difference of two rungs at which a reference is not refined further
ROUNDED = 1e-8  # below it a difference that grows again is rounding
NO_TRUTH = 1e-3  # relative difference of the finest rungs above which there is no reference
INTEGRALS = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6)  # tolerance of the reference's integrals: the first that is reached
BUDGET = 1.5  # of the repeats of one model [s]
BRIEF = 0.1  # below it a model is run once more before it is timed: others have emptied the processor's caches [s]
EQUAL = 1.15  # times whose ratio is below are not told apart


@dataclass(frozen=True)
class Reference:
    """The continuous cable.

    Attributes
    ----------
    values : dict
        Column name -> number.
    errors : dict
        Column name -> its estimated relative error.
    notes : dict
        Column name -> where the number comes from.
    failures : dict
        Column name -> why it has none.
    """

    values: dict
    errors: dict
    notes: dict
    failures: dict


@dataclass(frozen=True)
class Entry:
    """One model.

    Attributes
    ----------
    family, name : str
    dof : int or None
    time : float or None
        Median for all columns together. [s]
    times : dict
        Column name -> median for this column alone, where the model differs from its base. [s]
    errors : dict
        Column name -> relative error, of the columns that it has; at least the reference's own.
    status : str
        `ok`, or which columns it lacks and why.
    """

    family: str
    name: str
    dof: int | None
    time: float | None
    times: dict
    errors: dict
    status: str

    @property
    def largest(self):
        """Largest error when every column is there, else None. [-]"""
        return max(self.errors.values()) if self.status == "ok" else None


@dataclass(frozen=True)
class Trade:
    """Error against time.

    Attributes
    ----------
    columns : list of Column
        Those that have a reference.
    reference : Reference
    entries : list of Entry
    """

    columns: list
    reference: Reference
    entries: list

    @cached_property
    def front(self):
        """Names of the models on the Pareto front of time against the largest error.

        Those that have every column, and than which no other is at most as slow and at most as wrong, and better in
        one of the two.
        """
        whole = [entry for entry in self.entries if entry.largest is not None]
        return {whole[k].name for k in pareto([e.time for e in whole], [e.largest for e in whole])}

    def front_of(self, column):
        """The same for one column alone, with what this column alone costs: list of Entry, fastest first."""
        able = [entry for entry in self.entries if column.name in entry.times]
        chosen = pareto([e.times[column.name] for e in able], [e.errors[column.name] for e in able])
        return sorted((able[k] for k in chosen), key=lambda entry: entry.times[column.name])

    def fastest(self, column, target):
        """The fastest model whose error in one column is at most a target, or None; of equals the first."""
        name = column.name
        able = [entry for entry in self.entries if name in entry.times and entry.errors[name] <= target]
        least = min((entry.times[name] for entry in able), default=None)
        return next((entry for entry in able if entry.times[name] <= EQUAL * least), None)


def pareto(times, errors):
    """Which of some points are on the Pareto front.

    Parameters
    ----------
    times, errors : sequence of float

    Returns
    -------
    list of int
        Indices of the points that no other beats: at most as large in both, and smaller in one.
    """
    order = sorted(range(len(times)), key=lambda k: (times[k], errors[k]))
    found, best, last = [], np.inf, None
    for k in order:
        if errors[k] < best or (times[k], errors[k]) == last:
            found.append(k)
            best, last = errors[k], (times[k], errors[k])
    return sorted(found)


def wanted(document, scene, names=None):
    """The columns to compare.

    Parameters
    ----------
    document : Document
        Of the scene, for the places of mistakes.
    scene : Scene
    names : str, optional
        Columns, separated by commas; without them the defaults that the scene has keys for.

    Returns
    -------
    columns : list of Column
    notes : list of str
        Which defaults were left out, and why.

    Raises
    ------
    SceneError
        Unknown or repeated columns, or one that needs a key which the scene lacks.
    """
    if names is None:
        columns = [find(name) for name in DEFAULT]
        reasons = {column.name: _no_default(scene, column) for column in columns}
        notes = [f"left out: {name}: {reason}" for name, reason in reasons.items() if reason]
        return [column for column in columns if not reasons[column.name]], notes
    columns = []
    for name in (part.strip() for part in names.split(",")):
        if not name:
            raise SceneError("--columns: names separated by commas, e.g. end_stiffness,cable_frequency")
        try:
            column = find(name)
        except ValueError as error:
            raise SceneError(f"--columns: {error}") from None
        if column.needs in ("run", "scene") or column.name == "iterations":
            raise SceneError(f"--columns: {column.name} is nothing that a model computes more or less well")
        if any(column.name == other.name for other in columns):
            raise SceneError(f"--columns: {column.name} is listed twice")
        if lacks(scene, column):
            raise missing(document, lacks(scene, column), "trade")
        columns.append(column)
    return columns, []


def _no_default(scene, column):
    key = lacks(scene, column)
    return f"needs the key {key}" if key else _untrue(scene, column)


def _untrue(scene, column):
    """Why a column has no value for the continuous cable, or an empty text."""
    modal = column.needs in ("loop", "wind") and scene.cable.damping.model == "modal"
    return MODAL.partition(", or fixed")[0] if modal else ""


def reference_of(scene, columns):
    """The continuous cable, as well as it can be had.

    Parameters
    ----------
    scene : Scene
    columns : sequence of Column

    Returns
    -------
    Reference
    """
    case = Case(with_accuracy(scene, AGREED))
    reference = Reference({}, {}, {}, {c.name: _untrue(scene, c) for c in columns if _untrue(scene, c)})
    still = [column for column in columns if column.needs not in DISCRETE]
    values, failures = read(case, still)
    reference.failures.update(failures)
    for name, number in values.items():
        _settle(reference, name, number, ROUNDING, "closed form")
    moving = [c for c in columns if c.needs in DISCRETE and c.name not in reference.failures]
    before, best = {}, {}
    for rung in RUNGS:
        if not moving:
            break
        values, failures, floor = _on_rung(case, rung, moving)
        for column in tuple(moving):
            name = column.name
            if name in values and name in before:
                difference = max(deviation(values[name], before[name]), ROUNDING)
                known = best.get(name, np.inf)
                if difference <= known:
                    best[name] = difference
                    note = f"{rung[0]} x order {rung[1]} about the closed form"
                    own = floor if column.needs == "wind" else 0.0
                    _settle(reference, name, values[name], max(difference, own), note)
                if difference <= AGREED or (difference > known and known < ROUNDED):
                    moving.remove(column)
        before = values
    for column in (c for c in columns if c.needs in DISCRETE and c.name not in reference.failures):
        name = column.name
        if best.get(name, np.inf) > NO_TRUTH:
            reached = f"the finest models differ by {best[name]:.1e}" if name in best else failures.get(name, "none")
            reference.failures[name] = f"no reference: {reached}"
            reference.values.pop(name, None)
    return reference


def _settle(reference, name, number, error, note):
    reference.values[name], reference.errors[name], reference.notes[name] = number, error, note


def _on_rung(case, rung, columns):
    """Values and failures of one refinement, and the error of its integrals over frequency."""
    finer = case.refined(*rung)
    floor = windrms.TOLERANCE / 2  # an RMS is the root of what is integrated
    if any(column.needs == "wind" for column in columns):
        for tolerance in INTEGRALS:
            try:
                integrate_by(finer, columns, lambda c, loop, t=tolerance: windrms.response_of(c, loop, t))
                floor = tolerance / 2
            except ConvergenceError:
                continue
            except CablestudyError:  # not a matter of tolerance: `read` meets it again, and says it
                pass
            break
    return *read(finer, columns), floor


def deviation(value, truth):
    """Relative to the truth; of a truth that is zero or nothing, 0 or 1."""
    if value is None or truth is None or truth == 0:
        return float(value != truth)
    return abs(value - truth) / abs(truth)


def compare(scene, columns, repeats=5, models=None, progress=None):
    """Measure models.

    Parameters
    ----------
    scene : Scene
    columns : sequence of Column
    repeats : int
        Of each timing, after one that warms up; fewer of those that take long. [-]
    models : list of Choice, optional
        Default: `choices`.
    progress : callable, optional
        Called with 1 after each of `repeats + 1` turns of each model.

    Returns
    -------
    Trade

    Raises
    ------
    NoSolutionError, ConvergenceError
        The cable breaks, or no column has a reference.
    """
    reason = broken(Case(with_accuracy(scene, AGREED)))
    if reason:
        raise ConvergenceError(reason)
    reference = reference_of(scene, columns)
    known = [column for column in columns if column.name in reference.values]
    if not known:
        raise ConvergenceError("; ".join(f"{name}: {why}" for name, why in reference.failures.items()))
    runs = [_Run(choice, scene, known) for choice in (choices(known) if models is None else models)]
    for turn in range(repeats + 1):  # in rounds, so that a disturbance does not fall on one model alone
        for run in runs:
            run.warm_up() if turn == 0 else run.once_more()
            if progress:
                progress(1)
    return Trade(known, reference, [run.entry(reference) for run in runs])


class _Run:
    """One model at work."""

    def __init__(self, choice, scene, columns):
        self._choice, self._scene, self._columns = choice, scene, columns
        self._times = {}

    def warm_up(self):
        """The answer; the time of a slow model already counts."""
        self._answer, first = _timed(self._choice, self._scene, self._columns)
        alone = [c for c in self._columns if c.name in self._answer.values and self._choice.concerns(c)]
        self._asked = {"": self._columns}
        if len(self._columns) > 1:
            self._asked |= {column.name: [column] for column in alone}
        self._times = {name: [] for name in self._asked}
        if first > BUDGET:
            self._times[""].append(first)

    def once_more(self):
        """One more timing of all columns together and of each alone, each after one that counts only if it is long."""
        for name, columns in self._asked.items():
            times = self._times[name]
            if not times or sum(times) < BUDGET:
                _, seconds = _timed(self._choice, self._scene, columns)
                if seconds < BRIEF:
                    _, seconds = _timed(self._choice, self._scene, columns)
                times.append(seconds)

    def entry(self, reference):
        """What came of it."""
        answer = self._answer
        times = {name: float(np.median(spent)) for name, spent in self._times.items()}
        whole = times.pop("")
        if len(self._columns) == 1:
            times = dict.fromkeys(answer.values, whole)
        errors = {
            name: max(deviation(number, reference.values[name]), reference.errors[name])
            for name, number in answer.values.items()
        }
        whole = whole if answer.values else None
        return Entry(self._choice.family, self._choice.name, answer.dof, whole, times, errors, _status(answer))


def _timed(choice, scene, columns):
    """Answer of a model, and what it cost. [s]"""
    begin = time.process_time()  # and not the clock on the wall: what else the machine does is no matter here
    answer = choice.solve(scene, columns)
    return answer, time.process_time() - begin


def _status(answer: Answer):
    if not answer.failures:
        return "ok"
    reasons = {}
    for name, reason in answer.failures.items():
        reasons.setdefault(reason, []).append(name)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items())
