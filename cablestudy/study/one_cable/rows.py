"""Rows of scenes of one cable: columns to the accuracy of each scene, with the reason where one has no value."""

import time

from cablestudy.cable.damping import grows_with_modes
from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.motion.model_sizes import MODAL
from cablestudy.scene.scene import missing
from cablestudy.study import notes
from cablestudy.study.cable_columns import is_of_one_cable
from cablestudy.study.column import lacks
from cablestudy.study.columns import find
from cablestudy.study.motion_columns import DAMPING_RATIO, goes_slack
from cablestudy.study.one_cable import models
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.closed_form import ColumnRequirements, by_elements, closed_form
from cablestudy.study.one_cable.results import Results
from cablestudy.study.refinement import reference_scene
from cablestudy.study.scene_values import SceneValues, load_count
from cablestudy.study.table_rows import OVER_STRENGTH, SLACK, UnfinishedRow, batched, compute_together
from cablestudy.study.tolerances import STUDY
from cablestudy.study.uneven_drag import relative_change
from cablestudy.system.comparison import relative


def evaluate(scene, columns, estimate=False):
    """Compute the columns of one scene; see `evaluate_cases`.

    Returns
    -------
    Row
    """
    return evaluate_cases([scene], columns, estimate)[0]


def evaluate_named(document, scene, names, command, estimate=False):
    """Find the columns that a command needs by their names, and compute them for one scene.

    Parameters
    ----------
    document : Document
        File of the scene, for the places of mistakes.
    scene : CableScene
    names : sequence of str
        Names of columns.
    command : str
        Command that needs them, for messages.
    estimate : bool
        Whether the errors of a stated number of elements are to be estimated.

    Returns
    -------
    (list of Column, Row)

    Raises
    ------
    SceneError
        The scene lacks a key that a column needs.
    """
    columns = [find(name) for name in names]
    for column in columns:
        if lacks(scene, column):
            raise missing(document, lacks(scene, column), command)
    return columns, evaluate(scene, columns, estimate)


def evaluate_cases(scenes, columns, estimate=False):
    """Compute the columns of many scenes: closed forms of all at once, and results shared by some only once.

    Parameters
    ----------
    scenes : sequence of CableScene
    columns : sequence of Column
    estimate : bool
        Whether to estimate the errors of a stated number of elements although no column shows them, and to write
        notes; a scene alone always has notes.

    Returns
    -------
    list of Row
        Each as if it were alone, to the last digit. Where a column has no value its cell is empty, and the status says
        why.
    """
    groups = {}
    for index, scene in enumerate(scenes):
        groups.setdefault((load_count(scene), scene.model.elements is None), []).append(index)
    rows, required = [None] * len(scenes), ColumnRequirements(columns)
    for (_, to_accuracy), indices in groups.items():
        rows_at_once = len(indices) if to_accuracy else _fixed_rows_at_once([scenes[index] for index in indices])
        for piece in batched(indices, rows_at_once):
            rows_of_piece = _rows_of_batch([scenes[index] for index in piece], required, to_accuracy, estimate)
            for index, row in zip(piece, rows_of_piece, strict=True):
                rows[index] = row
    return rows


def _fixed_rows_at_once(scenes):
    """Number of scenes with fixed elements to solve at once, whose modes a processor's cache holds. [-]"""
    largest = max(models.numbers_of(scene.model) for scene in scenes)
    return max(1, min(STUDY.rows_at_once, STUDY.numbers_at_once // largest))


def _rows_of_batch(scenes, required, to_accuracy, estimate):
    """Yield the rows of a batch of scenes whose cables carry equally many point loads.

    `to_accuracy`: no scene states the number of elements, so that models are refined to an accuracy; else all do.
    """
    start_time = time.perf_counter()
    results = Results(SceneValues(scenes))
    closed, elements = closed_form(results, required), ()
    if not (to_accuracy or required.scene_only):
        closed, elements = by_elements(results, required, closed)
    solve = _solving_function(required, to_accuracy)
    cells = closed.cells(closed.numbers)
    closed_time = (time.perf_counter() - start_time) / len(scenes)
    rows_at_once = 1 if required.clock else STUDY.rows_at_once  # the time of each row is measured alone
    for start in range(0, len(scenes), rows_at_once):
        start_time, indices = time.perf_counter(), range(start, min(start + rows_at_once, len(scenes)))
        cases = _cases(results, indices, required)
        rows = [_row_of_closed_form(case, closed, cells[case.index], required) for case in cases]
        if elements:
            models.give_elements({row.case.index: row.case for row in rows}, elements)
        if solve:
            solve(rows, required, estimate or required.estimate)
        seconds = closed_time + time.perf_counter() - start_time
        for index, row in zip(indices, rows, strict=True):
            if required.in_wind and goes_slack(row.case):
                row.doubts += (SLACK,)
            if (required.modes or required.system) and len(scenes) > 1:  # many rows drop their modes
                row.case = CableCase(scenes[index], results, index)
            yield row.finished(required, seconds)


def _cases(results, indices, required):
    """Cases of a range of rows of a batch: equal ones share their elements and modes, see `Results.first_equal`."""
    scenes, asked_modes = results.values.scenes, required.asked_modes
    if len(indices) == 1 or not required.of_models:
        return [CableCase(scenes[index], results, index, asked_modes=asked_modes) for index in indices]
    caches, cases = {}, []  # index of the first of equal cases -> results that these share
    for index, first in zip(indices, results.first_equal[indices.start : indices.stop].tolist(), strict=True):
        cache = caches.setdefault(first, {})
        cases.append(CableCase(scenes[index], results, index, None, cache, asked_modes))
    for block in batched(cases, STUDY.coupled_rows_at_once if required.system else len(cases)):
        for case in block:
            case.together = block
    return cases


def _solving_function(required, to_accuracy):
    """Function that computes the columns without a closed form of many cases; None where there are none."""
    if required.scene_only or (to_accuracy and not required.of_models):
        return None
    return _solve_to_accuracy if to_accuracy else _solve_fixed_elements


def _row_of_closed_form(case, closed, cells, required):
    """The `UnfinishedRow` of a case with all numbers of its closed form."""
    failures = dict(closed.failures.get(case.index, {}))
    values = {header: number for header, number in cells.items() if header not in failures}
    errors = dict(closed.errors_of(case.index))
    note = notes.NOTHING if required.scene_only else notes.STATIC
    over_strength = case.index in closed.over_strength
    warnings = notes.of_closed_form(case, over_strength) if case.exact_statics and not required.scene_only else ()
    return UnfinishedRow(case, values, failures, errors, note, warnings, (OVER_STRENGTH,) if over_strength else ())


# ------------------------------------------------------------------------------------------------- to an accuracy


def _solve_to_accuracy(rows, required, estimate):
    """Compute the columns that no closed form of many cases gives, by models refined to the accuracy of each case.

    Values, errors and failures are added to the rows (list of UnfinishedRow); notes to a row alone, or with `estimate`.
    """
    noted = estimate or len(rows) == 1
    compute_together(rows, required.single)
    for block in batched(rows, STUDY.coupled_rows_at_once) if required.system else ():
        _prepare_systems(block, required)
        _solve_systems(block, required, noted)
    compute_together(rows, required.modes)
    _add_errors_by_drag(rows, required.single)
    for row in rows if required.modes else ():
        _add_search(row, required, noted)


def _add_errors_by_drag(rows, columns):
    """Let the errors of columns of statics be no less than those by drag that is taken as uniform.

    The rows are those of one batch.
    """
    results = rows[0].case.results
    for column in columns if results.drag_errors is not None else ():
        if column.by_drag is None:
            continue
        changes, header = column.by_drag(results), column.header
        for row in (row for row in rows if header in row.values):
            by_drag = relative_change(changes[row.case.index], row.values[header])
            row.errors[header] = max(row.errors[header], float(by_drag))


def _prepare_systems(rows, required):
    """Compute in one call the modes of gondola, loop and wind of many rows that lack no key for them."""
    from cablestudy.study.one_cable.system import prepare

    cases = [row.case for row in rows if any(column.header not in row.failures for column in required.system)]
    if not required.gondola:
        cases = [case for case in cases if not (case.exact_statics and _modal_gondola(case.scene))]
    with_gondola = [case for case in cases if case.scene.gondola is not None]
    prepare(with_gondola)
    prepare([case for case in cases if case.scene.gondola is None])


def _modal_gondola(scene):
    """True if the damping of a gondola grows with the number of modes."""
    return scene.gondola is not None and grows_with_modes(scene.cable.damping)


def _solve_systems(rows, required, noted):
    """Compute the columns of gondola and cable as one linear system, which estimates the error of each of them.

    A column of one cable whose error is above the accuracy fails, but in a steady wind: no finer model takes away what
    its drag, taken as uniform, changes.
    """
    columns = required.system
    for row in rows:
        if _modal_gondola(row.case.scene):
            row.fail([c for c in columns if c.needs != "gondola" or c.name == DAMPING_RATIO], NoSolutionError(MODAL))
    compute_together(rows, columns)
    for row in rows:
        _judge_system(row, required, noted)


def _judge_system(row, required, noted):
    """Refuse the columns of a row of `_solve_systems` whose error is above the accuracy, and add notes if `noted`."""
    case, accuracy = row.case, row.case.scene.model.accuracy
    for column in required.system:
        name = column.header
        error = row.errors.get(name) if name in row.values else None
        if error is None or case.results.drag.normal_drag[case.index] or not is_of_one_cable(column):
            continue  # in a steady wind, and those of suspensions, state the error they reach
        error -= case.equilibrium_error(column)
        if error > accuracy:
            text = f"{name}: estimated error {error:.1e}, asked for {accuracy:g}"
            row.failures[name] = ConvergenceError(text)
            del row.values[name]
    row.dof = case.system_size
    if noted:
        gondola = any(column.needs == "gondola" and column.header in row.values for column in required.system)
        row.notes = _system_notes(row, gondola, required.damped)


def _system_notes(row, gondola, damped):
    """Notes on gondola and cable as one linear system; `gondola`: whether a number of its mode was computed."""
    case, texts = row.case, row.notes
    if case.moves:
        texts = (notes.CLOSED_FORM, *notes.of_system(case))
    elif gondola:
        texts = (notes.CLOSED_FORM, *notes.of_gondola(case))
    if case.moves or damped:
        texts += notes.assumed_damping(case.scene) + notes.air_damping(case)
    return texts + _gondola_notes(row)


def _gondola_notes(row):
    """Notes on the modes that share the gondola's motion, where its frequency was computed."""
    return tuple(notes.gondola_notes(row.case)) if "gondola_frequency_Hz" in row.values else ()


def _add_search(row, required, noted):
    """Add to a row the unknowns of the elements by which its frequencies were found, and notes on them if `noted`."""
    search = row.case.frequency_search
    if isinstance(search, Exception):
        return
    row.dof = max(search.used.dof, row.dof)
    if noted and search.values:
        worst = max(row.errors[column.header] for column in required.modes if column.header in row.values)
        texts = (notes.CLOSED_FORM, *notes.of_refined(search.used, worst, search.tried))
        row.notes = texts + tuple(line for line in row.notes if line not in texts)


# -------------------------------------------------------------------------------------------------- fixed elements


def _solve_fixed_elements(rows, required, estimate):
    """Compute the columns with the fixed elements of each scene, and estimate errors against the continuous cable."""
    solvable = [row for row in rows if row.case.index not in row.case.results.failures]
    if not solvable:
        return
    if len(solvable) > 1 and required.of_models:
        models.solve_models([row.case for row in solvable])
    for block in batched(solvable, STUDY.coupled_rows_at_once):
        if required.system:
            _prepare_systems(block, required)
        _compute_motion(block, required, estimate or len(rows) == 1)
    if estimate and required.of_models:
        _estimate_errors(solvable, required)


def _compute_motion(rows, required, noted):
    """Add the columns beyond statics to the `UnfinishedRow`s of cases whose scenes state the number of elements.

    `noted`: whether to write notes.
    """
    for row in rows:
        row.notes = ()
    if not (required.of_models or required.run or noted):
        return
    solved = []
    for row in rows:
        try:
            _ = row.case.model
        except CablestudyError as error:
            row.fail([column for column in required.physical if column.needs != "scene"], error)
            continue
        solved.append(row)
    columns = [*required.single, *required.system, *required.modes]
    compute_together(solved, columns)
    for row in solved:
        case, model = row.case, row.case.model
        for column in columns:
            if column.least_error is not None and column.header in row.values:
                row.errors.setdefault(column.header, None)  # not known without a finer model
        unknowns = case.dof if required.modes else (2 if case.planar else 3) * (model.mesh.nodes - 2)
        row.dof = max(unknowns, case.system_size)
        if noted:
            row.notes, row.warnings = notes.of_fixed(case)
            row.notes += _gondola_notes(row)
            if required.damped or required.driven:
                row.notes += notes.assumed_damping(case.scene) + notes.air_damping(case) + notes.judged_by(case.scene)


def _estimate_errors(rows, required):
    """Add the errors, against a finer model, of the columns that are no closed form of many cases."""
    of_models = {*required.modes, *required.system, *required.single}
    columns = [column for column in required.physical if column in of_models]
    scenes = [reference_scene(row.case.scene) for row in rows]
    quantity = "motion" if required.modes or required.system else "deflections"
    for row, finer in zip(rows, evaluate_cases(scenes, columns), strict=True):
        headers = [column.header for column in columns if column.header in row.values]
        errors = {header: _difference(row.values[header], finer, header) for header in headers}
        row.errors |= errors
        row.notes += tuple(notes.comparison_notes(errors, finer.cells["status"], quantity))


def _difference(value, finer, header):
    """Relative error of a value against the row of a finer model, and the error of that; None if not known. [-]"""
    reference = finer.cells[header]
    if finer.failed and reference is None:
        return None
    return relative(value, reference) + (finer.errors.get(header) or 0.0)
