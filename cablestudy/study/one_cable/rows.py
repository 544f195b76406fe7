"""Rows of scenes of one cable: columns to the accuracy of each scene, with the reason where one has no value."""

from functools import cached_property

from cablestudy.errors import ConvergenceError, outcome_of
from cablestudy.scene.scene import missing
from cablestudy.study import notes
from cablestudy.study.cable_columns import is_of_one_cable
from cablestudy.study.column import lacking_key
from cablestudy.study.columns import find
from cablestudy.study.load_arrays import load_count
from cablestudy.study.motion_columns import goes_slack
from cablestudy.study.one_cable import elements
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.results import Results
from cablestudy.study.one_cable.static_columns import ColumnRequirements, by_closed_form, by_elements
from cablestudy.study.refinement import reference_scene
from cablestudy.study.stated_numbers import StatedNumbers
from cablestudy.study.table_rows import OVER_STRENGTH, SLACK, Row, RowBatch, batched
from cablestudy.study.tolerances import STUDY


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
        Whether to estimate the errors where the scene fixes the number of elements.

    Returns
    -------
    (list of Column, Row)
        The columns, and their values with errors and status.

    Raises
    ------
    SceneError
        The scene lacks a key that a column needs.
    """
    columns = [find(name) for name in names]
    for column in columns:
        if lacking_key(scene, column):
            raise missing(document, lacking_key(scene, column), command)
    return columns, evaluate(scene, columns, estimate)


def evaluate_cases(scenes, columns, estimate=False):
    """Compute the columns of a table for many scenes of one cable.

    To save time, closed forms are computed for many scenes in one call, and modes once for all scenes whose cables are
    equal. No digit of a row depends on this: each is as if its scene were alone.

    Parameters
    ----------
    scenes : sequence of CableScene
    columns : sequence of Column
    estimate : bool
        Whether to write notes, which a single scene always has, and to estimate the errors of scenes that fix the
        number of elements even if no column shows them.

    Returns
    -------
    list of Row
        In the order of the scenes. A column without a value has an empty cell, and the status of the row says why.
    """
    groups = {}
    for index, scene in enumerate(scenes):
        to_accuracy, linear = scene.model.elements is None, scene.cable.stress_strain is None
        key = to_accuracy, linear, scene.load_case.wind is None, load_count(scene)
        groups.setdefault(key, []).append(index)
    rows, required = [None] * len(scenes), ColumnRequirements(columns)
    for (to_accuracy, *_), indices in groups.items():
        rows_at_once = len(indices) if to_accuracy else _fixed_rows_at_once([scenes[index] for index in indices])
        kind = RefinedBatch if to_accuracy or required.scene_only else StatedBatch
        for piece in batched(indices, rows_at_once):
            batch = kind([scenes[index] for index in piece], required, estimate)
            for index, row in zip(piece, batch.rows(), strict=True):
                rows[index] = row
    return rows


def _fixed_rows_at_once(scenes):
    """Number of scenes with fixed elements to solve at once, whose modes a processor's cache holds. [-]"""
    largest = max(elements.numbers_in_modes(scene.model) for scene in scenes)
    return max(1, min(STUDY.rows_at_once, STUDY.numbers_at_once // largest))


class CableBatch(RowBatch):
    """Scenes of one cable, with equally many point loads, all with stress-strain curves, a steady wind, or none.

    See `RowBatch`.

    Parameters
    ----------
    scenes : sequence of CableScene
        All to an accuracy, or all with stated elements.
    required : ColumnRequirements
    estimate : bool
        As for `evaluate_cases`.
    """

    def __init__(self, scenes, required, estimate):
        super().__init__(scenes, required, noted=estimate or len(scenes) == 1)

    @cached_property
    def results(self):
        """`Results` of all cases."""
        return Results(StatedNumbers(self.scenes))

    def solve_statics(self):
        """Compute the closed forms of all cases."""
        self.statics = by_closed_form(self.results, self.required)

    def blocks(self, width):
        """Yield the rows with all numbers of their closed forms."""
        width = width or self.required.rows_at_once
        cells = self.statics.cells()
        for indices in batched(range(len(self.scenes)), width):
            cases = self.cases(indices)
            yield [self._row_of_statics(case, cells[case.index]) for case in cases]

    def cases(self, indices):
        """Cases of a range of rows: equal ones share their elements and modes, see `Results.first_equal`."""
        results, asked_modes = self.results, self.required.asked_modes
        if len(indices) == 1 or not self.required.computed:
            return [CableCase(self.scenes[index], results, index, asked_modes=asked_modes) for index in indices]
        caches, cases = {}, []  # index of the first of equal cases -> results that these share
        for index, first in zip(indices, results.first_equal[indices.start : indices.stop].tolist(), strict=True):
            cache = caches.setdefault(first, {})
            cases.append(CableCase(self.scenes[index], results, index, None, cache, asked_modes))
        return cases

    def _row_of_statics(self, case, cells):
        """The `Row` of a case with all numbers of its closed form."""
        statics, scene_only = self.statics, self.required.scene_only
        failures = dict(statics.failures.get(case.index, {}))
        values = {header: number for header, number in cells.items() if header not in failures}
        note = notes.NOTHING if scene_only else notes.STATIC
        over_strength = bool(statics.over_strength[case.index])
        warnings = notes.of_closed_form(case, over_strength) if case.exact_statics and not scene_only else ()
        doubts = (OVER_STRENGTH,) if over_strength else ()
        return Row(case, values, failures, statics.errors_of(case.index), note, warnings, doubts)

    def prepare_systems(self, cases):
        """Compute in one call the lowest modes of many cases that have the keys of columns of gondola, loop or wind."""
        from cablestudy.study.one_cable.system import solve_lowest_modes

        if not self.required.gondola:
            cases = [case for case in cases if not (case.exact_statics and case.damped_by_modes)]
        solve_lowest_modes([case for case in cases if case.scene.gondola is not None])
        bare = [case for case in cases if case.scene.gondola is None] if self.required.in_wind else []
        solve_lowest_modes([case for case in bare if case.scene.wind and case.scene.wind_diameter])

    def finish(self, row):
        """Add the doubt that the cable goes slack in the wind; of many rows each drops its modes, to save memory."""
        if self.required.in_wind and goes_slack(row.case):
            row.doubts += (SLACK,)
        if self.required.discrete and len(self.scenes) > 1:
            row.case = CableCase(row.case.scene, self.results, row.case.index)


class RefinedBatch(CableBatch):
    """Scenes that state an accuracy, to which the models of their motion are refined."""

    def prepare(self, rows):
        """Compute the first modes of gondola, loop and wind of all rows, which are returned."""
        columns = self.required.system
        if columns:
            wanted = (row for row in rows if any(column.header not in row.failures for column in columns))
            self.prepare_systems([row.case for row in wanted])
        return rows

    def finish(self, row):
        """Refuse numbers above the accuracy; add the unknowns of the models, notes on them, and doubts."""
        self._refuse_inaccurate(row)
        if self.required.run:
            row.dof = row.case.size
        if self.noted and self.required.system:
            row.notes = self._notes_on_system(row)
        if self.noted and self.required.modes:
            row.notes = self._notes_on_modes(row)
        super().finish(row)

    def _refuse_inaccurate(self, row):
        """Let columns of gondola, loop and wind fail whose error is above the accuracy.

        In a steady wind, and those of suspensions, they state the error that they reach, as `Column.any_error` does.
        """
        case, accuracy = row.case, row.case.scene.model.accuracy
        for column in self.required.system:
            name = column.header
            error = row.errors.get(name) if name in row.cells and not column.any_error else None
            if error is None or case.in_steady_wind or not is_of_one_cable(column):
                continue
            error -= case.equilibrium_error(column)
            if error > accuracy:
                text = f"{name}: estimated error {error:.1e}, asked for {accuracy:g}"
                row.failures[name] = ConvergenceError(text)
                del row.cells[name]

    def _notes_on_modes(self, row):
        """Notes of the row, before them those on the elements by which its frequencies were found, if any were."""
        found = row.case.known_frequencies
        if found is None or not found.values:
            return row.notes
        worst = max(row.errors[column.header] for column in self.required.modes if column.header in row.cells)
        texts = (notes.CLOSED_FORM, *notes.of_refined(found.used, worst, found.tried))
        return texts + tuple(line for line in row.notes if line not in texts)

    def _notes_on_system(self, row):
        """Notes on gondola and cable as one linear system."""
        case, texts, required = row.case, row.notes, self.required
        if case.moves:
            texts = (notes.CLOSED_FORM, *notes.of_system(case))
        elif any(column.needs == "gondola" and column.header in row.cells for column in required.system):
            texts = (notes.CLOSED_FORM, *notes.of_coupled_modes(case))
        if case.moves or required.damped:
            texts += notes.assumed_damping(case.scene) + notes.air_damping(case)
        return texts + _gondola_notes(row)


class StatedBatch(CableBatch):
    """Scenes that fix their number of elements. Errors are estimated against the closed form and refined models."""

    def __init__(self, scenes, required, estimate):
        super().__init__(scenes, required, estimate)
        self._compared = required.computed and (estimate or required.estimate)

    def solve_statics(self):
        """Compute the closed forms of all cases, and the statics of their elements."""
        super().solve_statics()
        self.statics, self._elements = by_elements(self.results, self.required, self.statics)

    def prepare(self, rows):
        """Solve the finite elements of all rows, and compute the modes that their columns need first, in few calls.

        Parameters
        ----------
        rows : list of Row
            With the columns in closed form.

        Returns
        -------
        list of Row
            Those whose elements are in equilibrium; empty where nothing that is shown depends on the elements. In the
            others every column that needs an equilibrium fails.
        """
        required, cases = self.required, {row.case.index: row.case for row in rows}
        if not (required.computed or required.run or self.noted):
            return []
        elements.give_elements(cases, self._elements)
        if len(cases) > 1 and required.computed:
            elements.solve_elements([case for index, case in cases.items() if index not in self.results.failures])
        solvable = []
        for row in rows:
            error = outcome_of(lambda case=row.case: case.elements)
            if isinstance(error, Exception):
                row.fail([column for column in required.physical if column.needs != "scene"], error)
            else:
                solvable.append(row)
        solvable_cases = [row.case for row in solvable]
        if required.system:
            self.prepare_systems(solvable_cases)
        if self._compared and solvable:
            self._compare(solvable_cases)
        return solvable

    def _compare(self, cases):
        """Set `finer` of cases, with which their numbers are compared; first modes of all of these in one call."""
        finer = RefinedBatch([reference_scene(case.scene) for case in cases], self.required, estimate=False)
        finer_cases = finer.cases(range(len(cases)))
        if self.required.system:
            finer.prepare_systems(finer_cases)
        for case, finer_case in zip(cases, finer_cases, strict=True):
            finer_case.together = finer_cases
            case.estimate, case.finer = True, finer_case

    def finish(self, row):
        """Add the unknowns of the elements, notes on these and on their errors, and doubts."""
        case, required = row.case, self.required
        if "elements" in case.computed:
            unknowns = case.dof if required.modes else (2 if case.planar else 3) * (case.state.mesh.nodes - 2)
            row.dof = max(unknowns, case.system_size)
            if self.noted:
                row.notes, row.warnings = notes.of_fixed(case)
                row.notes += _gondola_notes(row)
                if required.damped or required.in_motion:
                    of_scene = notes.assumed_damping(case.scene), notes.air_damping(case), notes.judged_by(case.scene)
                    row.notes += sum(of_scene, ())
                quantity = "motion" if required.discrete else "deflections"
                headers = (column.header for column in required.physical if column.header in case.differences)
                differences = {header: case.differences[header] for header in headers}
                row.notes += tuple(notes.comparison_notes(differences, case.reason, quantity))
            if case.estimate:
                case.finer.together = ()  # as `RowBatch.rows` does with the case itself
        super().finish(row)


def _gondola_notes(row):
    """Notes on the modes that share the gondola's motion, where its frequency was computed."""
    return tuple(notes.gondola_notes(row.case)) if "gondola_frequency_Hz" in row.cells else ()
