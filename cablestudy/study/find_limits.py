"""The ranges of a key in which all limits of a scene hold: `cablestudy find SCENE limits`."""

from dataclasses import replace
from itertools import groupby
from math import nan

from cablestudy.errors import NoSolutionError
from cablestudy.study.columns import find
from cablestudy.study.find import Solutions, find_table, scene_at, search
from cablestudy.study.limits import NOT_MET
from cablestudy.study.study_rows import checks_of
from cablestudy.study.table import Field
from cablestudy.study.table_rows import has_answer

GOVERNING = find("governing")
END = Field("end", "end", label=True)


def ranges(goal, document, columns):
    """Find the ranges of a key in which a scene meets all of its limits.

    Parameters
    ----------
    goal : Goal
        The goal `limit_margin = 0` (least relative margin of all limits), with the key that is varied.
    document : Document
    columns : list of Column
        Further columns of the table; those that are about limits are left out.

    Returns
    -------
    solutions : Solutions
        Ends of the ranges, and the scenes there.
    table : Table
        A row for each end: `from` or `to`, value of the key, governing limit, and the columns.
    rows : list of Row
        Results at the ends.

    Raises
    ------
    SceneError
        The key cannot be set in this scene, or the scene cannot have its limits.
    NoSolutionError
        No value of the key meets all limits; the message has the nearest value, and the limits not met there.
    """
    zeros_found, statuses, notes = search(goal, document, enclose=True)
    ends = _range_ends(zeros_found, statuses)
    if not ends:
        raise NoSolutionError(_no_range_message(goal, document, zeros_found, statuses))
    key = goal.key.name
    notes += [f"all limits hold {end} {key} = {goal.of_key(value)}: {reason}" for end, value, reason in ends if reason]
    values = [value for _, value, _ in ends]
    solutions = Solutions(values, [scene_at(goal, document, value) for value in values], notes)
    shown_columns = [GOVERNING, *(column for column in columns if column.needs != "limits")]
    table, rows = find_table(goal, solutions, shown_columns)
    for (end, _, reason), cells in zip(ends, table.rows, strict=True):
        # where a range ends though all limits hold, no limit governs
        cells |= {END.name: end} | ({GOVERNING.header: None} if reason else {})
    return solutions, replace(table, fields=(END, *table.fields)), rows


def _range_ends(zeros_found, statuses):
    """Ends of the ranges of a key in which all limits hold: a list of `from` or `to`, value of the key, reason.

    The margin m at a value of the key is the least margin of all limits. A range is a run of neighbouring values with
    m >= 0, and m > 0 at some of them. It ends at a zero or a jump of m; or, though all limits hold, for a reason: the
    status (in `statuses`) of the next value, which has no answer, or the end of the search.
    """
    crossings = {*zeros_found.roots, *zeros_found.jumps}
    margins = {value: nan for value, status in statuses.items() if not has_answer(status)}
    values, evaluated_margins = (array.tolist() for array in zeros_found.evaluated)
    margins |= dict(zip(values, evaluated_margins, strict=True)) | dict.fromkeys(crossings, 0.0)
    points, ends = sorted(margins), []

    def end(word, index, next_index):
        """One end of a range, at the point of an index; the status at the point beyond it may be the reason."""
        searched = 0 <= next_index < len(points)
        reason = f"beyond, {statuses.get(points[next_index])}" if searched else "the end of what was searched"
        return word, points[index], "" if points[index] in crossings else reason

    for holds, run in groupby(range(len(points)), lambda index: margins[points[index]] >= 0):
        indices = list(run)
        if holds and any(margins[points[index]] > 0 for index in indices):
            first, last = indices[0], indices[-1]
            ends += [end("from", first, first - 1), end("to", last, last + 1)]
    return ends


def _no_range_message(goal, document, zeros_found, statuses):
    """Text why there is no range: the limits not met where the least margin is largest, or why there is no answer."""
    searched = f"no value of {goal.key.name} from {goal.of_key(zeros_found.low, zeros_found.high)}"
    points, margins = zeros_found.evaluated
    if not len(points):
        reason = next((status for status in statuses.values() if not has_answer(status)), "no limit has a value")
        return f"{searched} has an answer: {reason}"
    best = float(points[margins.argmax()])
    (checks,) = checks_of([scene_at(goal, document, best)])
    broken = ", ".join(check.governing for check in checks if check.status == NOT_MET)
    nearest = f"nearest is {goal.of_key(best)}, with a least margin of {100 * margins.max():.3g} %"
    elsewhere = "" if goal.between else f"; {goal.elsewhere}"
    return f"{searched} meets all limits: {nearest}; not met there: {broken}{elsewhere}"
