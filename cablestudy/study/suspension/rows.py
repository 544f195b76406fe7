"""Rows of a table of suspensions: the columns of cases, with the reason where one has no value.

Suspensions of equal names and connections are solved together, and those that rest alike once.
"""

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError, known
from cablestudy.scene.words import first_of
from cablestudy.study.load_arrays import position_count
from cablestudy.study.refinement import reference_scene
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.group import Group
from cablestudy.study.suspension.notes import fallen, notes_of, strength_warning
from cablestudy.study.suspension.numbers import distinct_connections, kind_of_case, loads_of, topology_of
from cablestudy.study.suspension.part_columns import WHOLE
from cablestudy.study.suspension.wind_columns import exceeded_limits, slackened
from cablestudy.study.table_rows import FALLEN, OVER_STRENGTH, SLACK, Row, RowBatch, TableColumns, batched
from cablestudy.study.tolerances import STUDY

IN_MOTION = {"winches", "actuators", "control", "exposure", "correction"}  # keys that change nothing at rest
OF_THE_WHOLE = {column.name: column for column in WHOLE}


def cases_of(scenes):
    """Make the cases of many scenes, whose equilibria are found together as far as possible: list of `SuspensionCase`.

    Scenes with equal parts, connections and kinds of loads are solved in one call (`Group`). Those that differ only in
    keys that change nothing at rest (`IN_MOTION`), such as a controller, share one solution.

    Parameters
    ----------
    scenes : sequence of SuspensionScene

    Returns
    -------
    list of SuspensionCase
        In the order of the scenes. A case without an equilibrium raises its error when it is asked for its numbers.
    """
    groups = {}
    first_scenes, runs = distinct_connections(scenes)
    connections = [_connections(scene) for scene in first_scenes]
    for index, (scene, run) in enumerate(zip(scenes, runs, strict=True)):
        method = scene.tensions and scene.tensions.method
        kinds = scene.case is None, scene.wind and (scene.wind.mean, scene.wind.on != "bodies"), *kind_of_case(scene)
        groups.setdefault((connections[run], scene.solve_for, method, *kinds), []).append(index)
    cases = [None] * len(scenes)
    for indices in groups.values():
        groups_at_rest = _different_at_rest(scenes, indices)
        solved_groups = _solved_groups([scenes[members[0]] for members in groups_at_rest])
        for group_index, (members, group) in enumerate(zip(groups_at_rest, solved_groups, strict=True)):
            of_one_case = isinstance(group, Group) and len(group.problems) == 1  # solved alone, or the only one
            for index in members:
                cases[index] = SuspensionCase(scenes[index], group, 0 if of_one_case else group_index)
    return cases


def _different_at_rest(scenes, indices):
    """Lists of those of the `indices` of scenes that differ in the keys IN_MOTION alone, so that they rest alike.

    Where all scenes share the objects at these keys, they differ in other keys: each scene makes a list of its own.
    """
    first_scene, by_contents = scenes[indices[0]], {}
    if all(getattr(scenes[index], key) is getattr(first_scene, key) for index in indices for key in IN_MOTION):
        return [[index] for index in indices]
    for index in indices:
        by_contents.setdefault(scenes[index].model_dump_json(exclude=IN_MOTION), []).append(index)
    return list(by_contents.values())


def _connections(scene):
    """Connections, and counts of loaded positions on cables, which all cases of one `Group` must share: tuple."""
    load_counts = [position_count(cable.loads) for cable in scene.cables.values()]
    return (*topology_of(scene).values(), *load_counts, *[position_count(loads) for loads in loads_of(scene, False)])


def prepare(cases):
    """Compute the coupled modes with which the analyses of loop and wind begin (`solve_modes`), of many cases together.

    A case without an equilibrium, or without such modes, raises its error when it is asked for its numbers.

    Parameters
    ----------
    cases : sequence of SuspensionCase
    """
    from cablestudy.motion.model_search import solve_modes

    groups = {}
    for case, wind in known(cases, "analysis").items():
        groups.setdefault(id(case.group), (case.group, []))[1].append((case.index, wind))
    for group, members in groups.values():
        indices, winds = (list(values) for values in zip(*members, strict=True))
        solve_modes(winds, group.in_motion.take(np.array(indices)))


def _solved_groups(scenes):
    """For each of some scenes of equal topology its `Group`, or error: scenes that fail together are solved alone."""
    try:
        return [Group(scenes)] * len(scenes)
    except (NoSolutionError, ConvergenceError) as error:
        return [error] if len(scenes) == 1 else [result for scene in scenes for result in _solved_groups([scene])]


def evaluate_suspensions(scenes, columns, estimate=False):
    """Compute the columns of many suspensions.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
    columns : sequence of Column
    estimate : bool
        Whether to write notes, and to estimate the errors of models with stated elements even if no column asks for it.

    Returns
    -------
    list of Row
        Where a column has no value its cell is empty, and the status says why.
    """
    required = TableColumns([OF_THE_WHOLE.get(column.name, column) for column in columns])
    most_cables = max((len(scene.cables) for scene in scenes), default=1)
    batch_size = max(STUDY.suspensions_at_once, STUDY.suspended_cables_at_once // max(1, most_cables))
    batches = (SuspensionBatch(batch, required, noted=estimate) for batch in batched(scenes, batch_size))
    return [row for batch in batches for row in batch.rows()]


class SuspensionBatch(RowBatch):
    """Suspensions whose equilibria are found together; see `evaluate_suspensions` and `RowBatch`."""

    def solve_statics(self):
        """Find the equilibria, also of the finer models with which those of stated elements are compared."""
        required = self.required
        self._cases = cases_of(self.scenes) if required.of_equilibrium else list(map(SuspensionCase, self.scenes))
        if required.discrete and (self.noted or required.estimate):
            _compare(self._cases)

    def blocks(self, width):
        """Yield the rows: in the wind or under control as many as models of cables are computed together."""
        rows = list(map(Row, self._cases))
        if self.required.system:
            most_cables = max(1, *(len(scene.cables) for scene in self.scenes))
            width = width or max(1, STUDY.cables_at_once // most_cables)
        return batched(rows, width or len(rows))

    def prepare(self, rows):
        """Compute the first modes of loop and wind of all rows, which are returned."""
        if self.required.system:
            prepare([row.case for row in rows])
        return rows

    def finish(self, row):
        """Add doubts, by exceeded limits, strength, slack or fallen cables, the size of the model, and notes."""
        case, in_wind = row.case, self.required.in_wind
        if not row.failures:
            row.failures.update(_reasons_to_doubt(case, in_wind))
        row.doubts = doubts_of(case, in_wind)
        is_overloaded = case.solved and case.over_strength
        row.notes, row.warnings = notes_of(case) if self.noted else (), strength_warning(case) if is_overloaded else ()
        row.dof = case.size


def _compare(cases):
    """Set `finer` of the cases that state their elements, for comparison; their statics are computed together."""
    exact = [case for case in cases if case.fixed]
    for case, finer in zip(exact, cases_of([reference_scene(case.with_all_cables) for case in exact]), strict=True):
        case.estimate, case.finer = True, finer


def doubts_of(case, in_wind):
    """Doubts about the answer of a case, for `status_of`, with the names of cables and bodies: tuple of str.

    With `in_wind` those about its motion in the wind too.
    """
    overloaded, falling = (list(case.over_strength), fallen(case)) if case.solved else ([], [])
    slack_cables = slackened(case) if in_wind and case.moves else []
    doubts = (OVER_STRENGTH, overloaded), (SLACK, slack_cables), (FALLEN, falling)
    return tuple(f"{words}: {first_of(names, STUDY.listed_parts)}" for words, names in doubts if names)


def _reasons_to_doubt(case, in_wind):
    """Reasons to doubt a row: an unstable loop; with `in_wind`, limits exceeded in the wind, or why none are known.

    Returns
    -------
    dict
        Name -> CablestudyError.
    """
    try:
        if case.scene.control is not None and case.moves:
            case.analysis.check_stable()
        return {name: NoSolutionError(text) for name, text in exceeded_limits(case).items()} if in_wind else {}
    except CablestudyError as error:
        return {"limits": error}
