"""Search for the value of a key of a scene, such as its preload, for which a result column, such as the sag, takes a
given value: `cablestudy find`, and `find:` in a study."""

from dataclasses import dataclass

import numpy as np

from cablestudy.activity import doing
from cablestudy.errors import CablestudyError, Mistake, Mistakes, NoSolutionError, SceneError
from cablestudy.scene.entries import Entry
from cablestudy.scene.layers import split_key
from cablestudy.scene.scene import read_scene
from cablestudy.scene.section import Share
from cablestudy.scene.units import common_factor
from cablestudy.scene.words import counted
from cablestudy.study.case_table import tables_of
from cablestudy.study.column import CLOSED
from cablestudy.study.columns import find
from cablestudy.study.limits import limits_of
from cablestudy.study.roots import Effort, find_zeros, points_between, ranges_about
from cablestudy.study.scene_kind import kind_of, why_not
from cablestudy.study.study_rows import evaluate, evaluate_tables
from cablestudy.study.table import Table
from cablestudy.study.table_rows import STATUS, has_answer
from cablestudy.study.tolerances import STUDY


@dataclass(frozen=True)
class Solutions:
    """Values of a key for which a column takes the value that a `Goal` asks for."""

    values: list  # of float, of the key, rising, in SI
    scenes: list  # the CableScene or SuspensionScene with each of these values
    notes: list  # of str: the range searched, and values of the key at which the column jumps over that of the goal


# --------------------------------------------------------------------------------------------------------- the search


class KeyValues:
    """Scenes that differ in the value of the key of a goal, presented like the cases of a study for `tables_of`.

    Parameters
    ----------
    document_of : callable
        Number of a case of a study (0 for a scene by itself) -> Document of the scene of this case.
    goal : Goal
    values : sequence of float
        Values of the key, in SI. The key varies fastest: case c of the study with value i is case c len(values) + i.
    entries : tuple of Entry
        Entries of the study, each of which varies keys of its own; empty for a scene by itself.
    """

    def __init__(self, document_of, goal, values, entries=()):
        self._document_of, self._goal = document_of, goal
        self.values = [float(value) for value in values]
        self.entries = (*entries, Entry(((goal.key.name, self.values, lambda _: goal.locations["by"][0]),)))

    def case(self, index):
        """Overrides (key -> value), and the scene of one case."""
        case, step = divmod(index, len(self.values))
        value = self.values[step]
        return {self._goal.key.name: value}, scene_at(self._goal, self._document_of(case), value)


def solve(goal, document, column_at=None):
    """Find all values of a key of a scene for which a result column takes the value that a goal states.

    The range that is searched is the one of the goal. If it states none, growing ranges are searched up to the first
    one with a solution.

    Parameters
    ----------
    goal : Goal
        The column, its value, and the key that is varied.
    document : Document
        File of the scene; it may state another value of the key, or a key that excludes it.
    column_at : callable, optional
        Computes the column: values of the key, shape (n,) -> numbers, shape (n,), NaN where there is none, and list of
        n status texts. By default the scene is computed for each value.

    Returns
    -------
    Solutions

    Raises
    ------
    SceneError
        The key cannot be set in this scene, or the scene cannot have the column.
    NoSolutionError
        There is no value of the key.
    """
    zeros_found, statuses, notes = search(goal, document, column_at=column_at)
    jump = f"{goal.column.name} jumps over {goal.value:.6g} at {goal.key.name} ="
    jumps = [f"{jump} {goal.of_key(x)}" for x in zeros_found.jumps]
    if not zeros_found.roots:
        raise NoSolutionError("; ".join([_no_solution_message(goal, zeros_found, list(statuses.values())), *jumps]))
    notes += [f"{goal} over all of {goal.key.name} from {goal.of_key(*ends)}" for ends in zeros_found.plateaus]
    scenes = [scene_at(goal, document, root) for root in zeros_found.roots]
    return Solutions(zeros_found.roots, scenes, notes + jumps)


def search(goal, document, enclose=False, column_at=None):
    """Search for the zeros of f(x) = column(x) - value of the goal, over values x of the key.

    Parameters
    ----------
    goal, document, column_at
        As of `solve`, which refuses the same.
    enclose : bool
        Whether to search on until f is negative, or has no value, at both ends of the range tried.

    Returns
    -------
    zeros_found : roots.Zeros
        Zeros of f, and jumps over zero.
    statuses : dict
        Each value of the key that was tried -> status text of the results there.
    notes : list of str
        The range that was searched, unless the goal states it, and the gaps in it that were left unsearched.
    """
    start, scene = check_goal(goal, document)
    statuses = {}

    def column_of_scene(values):
        return column_values(goal, KeyValues(lambda _: document, goal, values), range(len(values)))

    def difference(values):
        """Column less the value of the goal at values of the key, shape (n,); NaN without a value of the column."""
        doing(f"{counted(len(statuses) + len(values), 'value')} of {goal.key.name} tried for {goal}")
        numbers, row_statuses = (column_at or column_of_scene)(values)
        statuses.update(zip(values.tolist(), row_statuses, strict=True))
        return numbers - goal.value

    effort = _search_effort(goal, scene)
    if goal.between:
        ranges = [[points_between(*goal.between, effort.points)]]
    elif start is None:
        ranges = [[points_between(goal.quantity.low, goal.quantity.high, 2 * effort.points)]]
    else:
        ranges = ranges_about(start, goal.quantity.low, goal.quantity.high, effort.points, effort.reach)
    zeros_found = find_zeros(difference, ranges, effort, enclose)
    notes = [] if goal.between else [
        f"searched: {goal.key.name} from {goal.of_key(zeros_found.low, zeros_found.high)}; {goal.elsewhere}"
    ]  # fmt: skip
    ends = f"at an end of the values of {goal.column.name}"
    notes += [f"not searched: {goal.key.name} from {goal.of_key(*gap)}, {ends}" for gap in zeros_found.gaps]
    return zeros_found, statuses, notes


def scene_at(goal, document, value):
    """The scene with a value of the key; SceneError where it is none."""
    return read_scene(document.with_sets([(goal.key.name, value, goal.locations["by"][0])]))


def check_goal(goal, document):
    """The value of the key at which a search begins, None without one [SI]; and a scene with some value of the key.

    SceneError if the key can have no value in this scene, or the scene cannot have the column.
    """
    start = _value_of_scene(goal, document)
    scene = _valid_scene(goal, document, start)
    if reason := why_not(scene, goal.column):
        raise SceneError(Mistake(*goal.locations["column"], reason))
    limits_of(scene, document)
    return start, scene


def _value_of_scene(goal, document):
    """Value of the key that the scene states or implies, at which a search begins [SI]; None without one.

    A scene implies a value if a result column has the name of the key: a scene that states a tension has a sag too.
    """
    try:
        scene = read_scene(document)
    except SceneError:  # it may lack what is to be found
        return None
    path = split_key(goal.key.name)
    value = scene.value_at(path)
    if isinstance(value, Share):  # of the breaking force of the cable, in the table `cable` or `cables.NAME`
        cable = scene.value_at(path[: 2 if path[0] == "cables" else 1])
        value = cable.force_of(value)
    if isinstance(value, float):
        return value
    try:
        column = find(goal.key.name.rpartition(".")[2])
        if why_not(scene, column):
            return None
        value = evaluate([scene], [column])[0].cells[column.header]
        start = None if value is None else value * float(common_factor(column.unit, goal.quantity.unit))
    except (ValueError, CablestudyError):
        return None
    return start if start is not None and goal.quantity.low <= start <= goal.quantity.high else None


def _valid_scene(goal, document, start):
    """A scene with some value of the key; SceneError where it can have none."""
    low, high = goal.between or (goal.quantity.low, goal.quantity.high)
    candidates = points_between(low, high, STUDY.tried_values)
    from_middle = np.argsort(np.abs(np.arange(len(candidates)) - len(candidates) // 2), kind="stable")
    candidates = candidates[from_middle].tolist()
    error = None
    for value in [start, *candidates] if start is not None and low <= start <= high else candidates:
        try:
            return scene_at(goal, document, value)
        except SceneError as refused:
            error = error or refused
    mistakes_of_key = [mistake for mistake in error.mistakes if mistake.where == goal.locations["by"][0]]
    raise SceneError(*(mistakes_of_key or error.mistakes))


def _search_effort(goal, scene):
    """The `Effort` of a search, by the cost of the column: closed forms of one cable cost little."""
    model, size, columns = scene.model, abs(goal.value), [goal.column]
    if goal.column.needs == "limits":  # whose margins are relative
        size, columns = 1.0, [column for limit in limits_of(scene) for _, _, column in limit.terms]
    if not all(map(kind_of(scene).is_cheap, columns)):
        closed = all(column.needs in CLOSED for column in columns)
        noise = STUDY.found_value if model.elements is not None or closed else model.accuracy
        return Effort(8, 10, 1e-3 * noise, STUDY.costly_reach, noise * size, size, parts=8, costly=True)
    if model.elements is not None:
        return Effort(25, 20, 1e-3 * STUDY.found_value, STUDY.costly_reach, STUDY.found_value * size, size)
    return Effort(40, 40, scale=size)


def column_values(goal, key_values, cases):
    """The column of the goal in n cases of `KeyValues`, shape (n,), NaN where it has none, and their status texts."""
    tables, refused = tables_of(key_values, cases)
    rows = evaluate_tables(tables, [goal.column])
    found = {case: (cells[0], status) for case, (cells, status, *_) in rows.items()}
    found |= {case: (None, error.without_places) for case, error in refused.items()}
    numbers, statuses = zip(*(found[int(case)] for case in cases), strict=True)
    return np.array([np.nan if number is None else number for number in numbers]), list(statuses)


def _no_solution_message(goal, zeros_found, statuses):
    """Text why there is no solution: the column has no value, does not change, or reaches only from one to another."""
    points, values = zeros_found.evaluated
    key, name = goal.key.name, goal.column.name
    searched = f"{key} from {goal.of_key(zeros_found.low, zeros_found.high)}"
    if not len(points):
        reason = next((status for status in statuses if status and not has_answer(status)), "it has no value")
        return f"no solution of {goal}: none of {searched} gives a value of {name}: {reason}"
    unit = f" {goal.column.unit}" if goal.column.unit else ""
    reached = values + goal.value
    if zeros_found.constant and values[0] == 0:
        return f"{goal} with every {key}: {name} does not depend on it"
    if zeros_found.constant:
        return f"no solution of {goal}: {name} does not depend on {key}, it is {reached[0]:.6g}{unit}"
    extremes = int(np.argmin(values)), int(np.argmax(values))
    ends = [f"{reached[k]:.6g}{unit} (at {goal.of_key(points[k])})" for k in extremes]
    elsewhere = "" if goal.between else f"; {goal.elsewhere}"
    return f"no solution of {goal}: over {searched} {name} reaches from {ends[0]} to {ends[1]}{elsewhere}"


# --------------------------------------------------------------------------------------------------------- the tables


def find_table(goal, solutions, columns):
    """`Table` of the solutions, and list of `Row`; `columns` from `shown_columns`."""
    rows = evaluate(solutions.scenes, columns)
    cells = [{goal.key.header: value, **row.cells} for value, row in zip(solutions.values, rows, strict=True)]
    fields = (goal.key.field, *(column.field for column in columns), STATUS)

    def errors():
        for row in rows:
            yield from row.known_errors()

    return Table(fields, cells, errors=errors), rows


def shown_columns(goal, document, names=None):
    """Columns of the table of solutions of `find`: that of the goal, then those that the user names.

    Parameters
    ----------
    goal : Goal
    document : Document
        The scene as read.
    names : str, optional
        Names of columns, separated by commas. Default: the usual columns of statics, without that of the key.

    Returns
    -------
    list of Column

    Raises
    ------
    SceneError
        A column is unknown, the scene cannot have it, or the goal does not fit the scene.
    """
    _, scene = check_goal(goal, document)
    if names is None:
        in_goal = (goal.column.name, goal.key.name.rpartition(".")[2])
        others = [column for column in map(find, kind_of(scene).usual_columns) if column.name not in in_goal]
        return [goal.column, *(column for column in others if not why_not(scene, column))]
    columns = [goal.column]
    with Mistakes() as mistakes:
        for name in filter(None, (part.strip() for part in names.split(","))):
            with mistakes.at("--columns"):
                column = find(name)
                if reason := why_not(scene, column):
                    raise ValueError(reason)
                if column.name not in ("status", *(other.name for other in columns)):
                    columns.append(column)
    return columns
