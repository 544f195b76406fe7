"""Command `trade`: error against time, for every model that a user can choose, of one cable or of a suspension.

The error is relative to the continuous cable (`reference_of`). The time is that of one more case of a sweep: processor
time from the scene to the numbers, statics included, on one thread, after all imports and cached constants. The modules
`one_cable.trade` and `suspension.trade` have functions of equal names, which `kind_of(scene).trade` gives.
"""

import gc
import os
import platform
import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.metadata import version
from math import isnan

import numpy as np

from cablestudy.activity import doing
from cablestudy.cable.damping import any_grows_with_modes
from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError, SceneError, one_line
from cablestudy.motion.model_sizes import MODAL
from cablestudy.scene.scene import missing
from cablestudy.study.column import DISCRETE, SYSTEM, lacking_key, value_and_error
from cablestudy.study.columns import find
from cablestudy.study.compared_models import ACCURACIES, ComparedModel, power, static_value
from cablestudy.study.pareto import pareto_front
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.scene_kind import kind_of, why_not
from cablestudy.study.table import Field, Table, short
from cablestudy.study.table_rows import STATUS
from cablestudy.study.tolerances import STUDY
from cablestudy.system.comparison import relative

CLOSELY = (1e-8, 1e-9)  # accuracies of cables and bodies as one linear system: closer ones add rounding
TARGETS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)  # errors below which the fastest model is named
CONTINUOUS = "continuous cable"


def models_of(scene, columns):
    """List of every `ComparedModel` of a scene on which the value of some column depends; raises as its equilibrium."""
    kind = kind_of(scene)

    def closest(scene, _):
        return kind.case(with_accuracy(scene, ACCURACIES[-1]))

    catenary = ComparedModel("closed form", "catenary", closest, ("statics", "stiffness"), static_value, lambda _: 0)
    models = [catenary, *kind.trade.models_of(scene)]
    return [model for model in models if any(column.needs in model.needs for column in columns)]


# ------------------------------------------------------------------------------------------------------------ columns


def columns_to_compare(document, scene, names=None):
    """Read the names of the result columns for which the command `trade` compares errors and times of models.

    Parameters
    ----------
    document : Document
        File of the scene, for the positions of mistakes.
    scene : CableScene or SuspensionScene
    names : str, optional
        Columns, separated by commas; default: those of `default_columns` that the scene has keys for.

    Returns
    -------
    columns : list of Column
    notes : list of str
        Default columns that are left out, and why.

    Raises
    ------
    SceneError
        Unknown or repeated columns, or one that needs a key which the scene lacks.
    """
    if names is None:
        reasons = {column: _why_left_out(scene, column) for column in kind_of(scene).trade.default_columns(scene)}
        notes = [f"left out: {column.name}: {reason}" for column, reason in reasons.items() if reason]
        return [column for column, reason in reasons.items() if not reason], notes
    columns = []
    for name in names.split(","):
        column = kind_of(scene).trade.comparable(scene, _column_of_option(name.strip()))
        if column.name in [other.name for other in columns]:
            raise SceneError(f"--columns: {column.name} is listed twice")
        reason, key = why_not(scene, column), lacking_key(scene, column)
        if reason and key:
            raise missing(document, key, "trade")
        if reason:
            raise SceneError(f"--columns: {reason}")
        columns.append(column)
    return columns, []


def _why_left_out(scene, column):
    """Reason for which a default column is left out; empty where it is not."""
    key = lacking_key(scene, column)
    return f"needs the key {key}" if key else _why_no_reference(scene, column)


def _column_of_option(name):
    """The column of a name in --columns, which depends on the model; SceneError where there is none."""
    if not name:
        raise SceneError("--columns: names separated by commas, e.g. end_stiffness,cable_frequency")
    try:
        column = find(name)
    except ValueError as error:
        raise SceneError(f"--columns: {error}") from None
    if column.needs == "limits":
        raise SceneError(f"--columns: {column.name} is of several load cases: name a column that a limit compares")
    if column.needs in ("run", "scene") or column.name == "iterations":
        raise SceneError(f"--columns: {column.name} does not depend on the model")
    return column


# ---------------------------------------------------------------------------------------------------------- reference


@dataclass(frozen=True)
class Reference:
    """Values of the continuous cable; each dict has the names of columns as keys."""

    values: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)  # estimated relative errors of the values [-]
    notes: dict = field(default_factory=dict)  # how the values were computed
    failures: dict = field(default_factory=dict)  # why there is no value
    warnings: tuple = ()


def reference_of(scene, columns):
    """Compute the values of the continuous cable, with which the models of the command `trade` are compared.

    Statics and stiffness have a closed form. Modes are computed with elements of high order, which are refined until
    the values of two successive levels agree; gondola, loop and wind are computed to two accuracies.

    Parameters
    ----------
    scene : CableScene or SuspensionScene
    columns : sequence of Column
        Results that are compared.

    Returns
    -------
    Reference
        Value and error of each column, or the reason why it has none.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    kind, kind_module = kind_of(scene), kind_of(scene).trade
    case = kind.case(with_accuracy(scene, STUDY.agreed_levels))
    _ = case.form  # raises where there is none
    parts, elements = kind_module.moving_parts(scene), kind_module.reference_levels(case)
    systems = [(f"{parts} to {power(accuracy)}", kind.case(with_accuracy(scene, accuracy))) for accuracy in CLOSELY]
    reference = Reference(warnings=kind_module.strength_warning(case))
    for column in columns:
        name = column.name
        try:
            reason = _why_no_reference(scene, column)
            if reason:
                raise NoSolutionError(reason)
            if column.needs in DISCRETE:
                error, number, note = _refined_value(systems if column.needs in SYSTEM else elements, column)
            else:
                number, error = _exact_value(column, case)
                error, note = max(error, STUDY.rounding), "closed form"
        except CablestudyError as failure:
            reference.failures[name] = one_line(failure)
        else:
            reference.values[name], reference.errors[name], reference.notes[name] = number, error, note
    return reference


def _why_no_reference(scene, column):
    """Reason for which a column has no value for the continuous cable; empty where it has one."""
    modal = column.needs in ("loop", "wind") and any_grows_with_modes(scene.cables.values())
    return MODAL.partition(", or fixed")[0] if modal else ""


def _exact_value(column, case):
    """A number of a case of the reference, and its relative error by anything but its elements."""
    number, error = value_and_error(column, case)
    return number, 0.0 if error is None or isnan(error) else float(error)


def _refined_value(levels, column):
    """Compute a column by finer and finer models; take the value that differs least from that of the model before.

    Parameters
    ----------
    levels : iterable of (str, case)
        Name and case of each model, the coarsest first. Models after the one at which the value settles are not taken.
    column : Column

    Returns
    -------
    error : float
        Estimated relative error of the value: that difference, or a larger error that the model states. [-]
    value : float or None
        None where the quantity does not exist, such as the largest gain of a loop that is stable at any gain.
    note : str
        Name of the model.

    Raises
    ------
    ConvergenceError
        No two successive models have a value, or their values differ too much.
    """
    candidates, previous, failure = [], None, "no two models have a value"
    for note, case in levels:
        try:
            number, other_error = _exact_value(column, case)
        except CablestudyError as error:
            previous, failure = None, one_line(error)
            continue
        if previous:
            difference = max(relative(number, *previous), STUDY.rounding)
            candidates.append((difference, max(difference, other_error), number, note))
            if difference <= STUDY.agreed_levels or min(candidates)[0] < min(difference, STUDY.rounded_difference):
                break
        previous = (number,)  # which may be None: a gain without a limit
    if not candidates:
        raise ConvergenceError(f"no reference: {failure}")
    difference, *best = min(candidates)
    if difference > STUDY.no_reference:
        raise ConvergenceError(f"no reference: the finest models differ by {difference:.1e}")
    return best


# -------------------------------------------------------------------------------------------------------- measurement


class Measurement:
    """Errors and times of one `ComparedModel`, for the columns that have a value in a `Reference`.

    Attributes
    ----------
    family, name : str
        Of the model; models of one family differ in one number.
    dof : int or None
        Number of free displacements, None where the model cannot be made.
    errors : dict
        Column name -> relative error against the reference, but at least the error of the reference itself; of the
        columns that have a value. [-]
    stated : dict
        Column name -> relative error that the model states of itself, of the columns of which it states one. [-]
    status : str
        `ok`, or the columns without a value, and why.
    """

    def __init__(self, model, scene, columns, reference):
        """Solve a scene once with a model, and compare the values with the reference; `repeat` then measures times.

        Parameters
        ----------
        model : ComparedModel
        scene : CableScene or SuspensionScene
        columns : sequence of Column
            Columns that have a value in `reference`.
        reference : Reference
            Values of the continuous cable.
        """
        self.family, self.name = model.family, model.name
        self._model, self._scene, self._columns = model, scene, columns
        row, seconds = self._run(columns)  # to warm up; this time counts where the model is slow
        values = {column.name: row.cells[column.header] for column in columns if column.header in row.cells}
        stated = {column.name: row.errors.get(column.header) for column in columns}
        self.stated = {name: error for name, error in stated.items() if error is not None}
        try:
            self.dof = None if row.case is None else model.count_dof(row.case)
        except CablestudyError:
            self.dof = None
        # name of a column -> times for it alone, filled by `repeat`; "" -> times for all columns together
        self._seconds = {"": [seconds] if seconds > STUDY.timing_budget else []}
        if len(columns) > 1:
            self._seconds |= {c.name: [] for c in columns if c.name in values and c.needs in model.needs}
        self.errors = {
            name: max(relative(number, reference.values[name]), reference.errors[name])
            for name, number in values.items()
        }
        reasons = {}
        for column in columns:
            if column.header in row.failures:
                reasons.setdefault(one_line(row.failures[column.header]), []).append(column.name)
        self.status = "; ".join(f"{', '.join(names)}: {reason}" for reason, names in reasons.items()) or "ok"

    def repeat(self):
        """Time all columns together and each alone once more, as long as the times of the model are few or short."""
        for name, times in self._seconds.items():
            if not times or sum(map(sum, self._seconds.values())) < STUDY.timing_budget:
                columns = [column for column in self._columns if name in ("", column.name)]
                _, seconds = self._run(columns)
                if not name and seconds < STUDY.brief_run:
                    _, seconds = self._run(columns)
                times.append(seconds)

    def _run(self, columns):
        """Result of `ComparedModel.solve`, and its processor time, which other programs hardly change. [s]"""
        start = time.process_time()
        row = self._model.solve(self._scene, columns)
        seconds = time.process_time() - start
        if seconds > STUDY.brief_run:
            gc.collect()  # cases refer to themselves in circles, and their arrays are large
        return row, seconds

    @cached_property
    def time(self):
        """Median time for all columns together, None where there is no value. [s]"""
        return float(np.median(self._seconds[""])) if self.errors else None

    @cached_property
    def times(self):
        """Column name -> median time for this column alone, where the model makes a difference for it. [s]"""
        if len(self._columns) == 1:
            return dict.fromkeys(self.errors, self.time)
        return {name: float(np.median(seconds)) for name, seconds in self._seconds.items() if name}

    @property
    def largest(self):
        """Largest error when every column has a value, else None. [-]"""
        return max(self.errors.values()) if self.status == "ok" else None

    @property
    def largest_stated(self):
        """Largest stated error when one is stated of every column, else None. [-]"""
        return max(self.stated.values()) if self.status == "ok" and self.stated.keys() == self.errors.keys() else None


@dataclass(frozen=True)
class Trade:
    """Error against time of the models of a scene."""

    columns: list  # of Column: those that have a reference
    reference: Reference
    entries: list  # of Measurement

    @cached_property
    def front(self):
        """Set of names: the Pareto front of time and largest error, among the models that have every column."""
        complete = [(entry.time, entry.largest, entry) for entry in self.entries if entry.largest is not None]
        return {entry.name for entry in _entries_on_front(complete)}

    def front_of(self, column):
        """List of Measurement: the Pareto front of one column and its time alone, fastest first."""
        name = column.name
        measured = [(entry.times[name], entry.errors[name], entry) for entry in self.entries if name in entry.times]
        return sorted(_entries_on_front(measured), key=lambda entry: entry.times[name])

    def fastest(self, column, target):
        """Name and time of the fastest model whose error in one column is at most a target; of equals the first."""
        name = column.name
        accurate_enough = [entry for entry in self.entries if name in entry.times and entry.errors[name] <= target]
        least = min((entry.times[name] for entry in accurate_enough), default=None)
        for entry in accurate_enough:
            if entry.times[name] <= STUDY.equal_times * least:
                return f"{entry.name} ({1e3 * entry.times[name]:.2g} ms)"
        return "none"


def _entries_on_front(points):
    """The entries on the Pareto front of points, which are (time, error, Measurement): list of Measurement."""
    numbers = np.array([point[:2] for point in points], dtype=float).reshape(-1, 2)
    return [entry for (*_, entry), on_front in zip(points, pareto_front(numbers), strict=True) if on_front]


def compare(scene, columns, repeats=5, models=None):
    """Measure the errors of all models of a scene against the continuous cable, and their computation times.

    Parameters
    ----------
    scene : CableScene or SuspensionScene
    columns : sequence of Column
        Results whose errors and times are measured.
    repeats : int
        Timings of each model, after one run to warm up; fewer of slow models. [-]
    models : list of ComparedModel, optional
        Default: `models_of(scene, columns)`.

    Returns
    -------
    Trade
        A `Measurement` of each model, of those columns that have a reference.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium, or no column has a reference.
    """
    reference = reference_of(scene, columns)
    with_reference = [column for column in columns if column.name in reference.values]
    if not with_reference:
        raise ConvergenceError("; ".join(f"{name}: {reason}" for name, reason in reference.failures.items()))
    models = models_of(scene, with_reference) if models is None else models
    entries, runs = [], (repeats + 1) * len(models)
    for model in models:
        doing(f"run {len(entries) + 1} of {runs}: {model.name}")
        entries.append(Measurement(model, scene, with_reference, reference))
    for number in range(1, repeats + 1):  # in rounds, so that a disturbance does not fall on one model alone
        for index, entry in enumerate(entries):
            doing(f"run {number * len(models) + index + 1} of {runs}: {entry.name}")
            entry.repeat()
    return Trade(with_reference, reference, entries)


# ------------------------------------------------------------------------------------------------------------- tables


def table_of(trade, for_markdown=False):
    """Table with one row for each model, the reference first.

    With `for_markdown` errors and times are rounded, and errors below the reference's own are `< 1e-12`.
    """
    fields = [Field("family", "family"), Field("model", "model"), Field("dof", "dof", secondary=True)]
    fields.append(Field("time_ms", "time", "ms"))
    for column in trade.columns:
        fields.append(Field(f"{column.name}_error", f"{column.name.replace('_', ' ')} error", secondary=True))
        fields.append(Field(f"{column.name}_stated_error", f"{column.name} stated error", hidden=True))
        fields.append(Field(f"{column.name}_time_ms", f"{column.name} time", "ms", hidden=True))
    fields.append(Field("largest_error", "largest error"))
    fields.append(Field("largest_stated_error", "stated error", secondary=True))
    fields += [Field("pareto", "pareto", secondary=True), replace(STATUS, secondary=True)]
    limits = {f"{column.name}_error": trade.reference.errors[column.name] for column in trade.columns}
    limits["largest_error"] = max(limits.values())
    rows = [{"family": "reference", "model": CONTINUOUS, **limits, "status": "ok"}]
    rows += [_row(entry, trade.front) for entry in trade.entries]
    return Table(tuple(fields), [_row_for_markdown(row, limits) for row in rows] if for_markdown else rows)


def _row(entry, front):
    """Row of the table for one model, a `Measurement`: dict. `front`: names of the models that are Pareto-optimal."""
    return {
        "family": entry.family,
        "model": entry.name,
        "dof": entry.dof,
        "time_ms": None if entry.time is None else 1e3 * entry.time,
        **{f"{name}_error": error for name, error in entry.errors.items()},
        **{f"{name}_stated_error": error for name, error in entry.stated.items()},
        **{f"{name}_time_ms": 1e3 * seconds for name, seconds in entry.times.items()},
        "largest_error": entry.largest,
        "largest_stated_error": entry.largest_stated,
        "pareto": "yes" if entry.name in front else "no",
        "status": entry.status,
    }


def _row_for_markdown(row, limits):
    """A row for Markdown; limits: error column -> the reference's own error."""
    texts = dict(row)
    for name, limit in limits.items():
        error = row.get(name)
        if error is not None:
            texts[name] = f"< {limit:.0e}" if error <= limit else f"{error:.1e}"
    if row.get("largest_stated_error") is not None:
        texts["largest_stated_error"] = f"{row['largest_stated_error']:.1e}"
    if row.get("time_ms") is not None:
        texts["time_ms"] = short(float(f"{row['time_ms']:.2g}"))
    texts["pareto"] = "yes" if row.get("pareto") == "yes" else None
    return texts


def notes_of(trade):
    """List of lines: on the reference, on the times, and on the fastest model below each error."""
    reference = trade.reference
    lines = [
        f"reference: {c.name} {reference.values[c.name]!r} {c.unit}, {reference.notes[c.name]}; "
        f"estimated error {reference.errors[c.name]:.1e}"
        for c in trade.columns
    ]
    lines.append(
        "time: processor time from the scene to the numbers, statics included, one thread, imports and constants cached"
    )
    for column in trade.columns:
        lines += [f"fastest below {target:.0e}: {column.name}: {trade.fastest(column, target)}" for target in TARGETS]
    return lines


def file_name(scene):
    """File name of a scene's tables, for example `trade-carlina.yaml` for configs/carlina.yaml."""
    return f"trade-{'stdin' if scene == '-' else os.path.basename(scene)}"


def write(trade, files, title):
    """Write the table to `TableFiles` and return their names; the title has the scene and its changes."""
    names = [f"{target:.0e}" for target in TARGETS]
    fields = (Field("column", "column"), *(Field(name, f"error below {name}") for name in names))
    lines = [(column.name, *(trade.fastest(column, float(name)) for name in names)) for column in trade.columns]
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy"))
    text = (
        f"# Error against time: {title}\n\n{table_of(trade, for_markdown=True).render('md')}\n"
        f"Times: Python {platform.python_version()}, {libraries}, {platform.machine()}, one thread; "
        f"processor time. Read the ratios: another machine has other milliseconds.\n\n"
        f"## The fastest model below an error\n\n{Table.of(fields, lines).render('md')}"
    )
    files.write_texts(table_of(trade).render("csv"), text)
    return files.csv, files.md
