"""The ranges of a key in which all limits of a scene hold: `cablestudy find SCENE limits`."""

from dataclasses import replace
from itertools import groupby
from math import nan

from cablestudy.errors import NoSolutionError
from cablestudy.study.all_columns import find
from cablestudy.study.find import Found, find_table, scenes_at, search
from cablestudy.study.limits import NOT_MET
from cablestudy.study.status import has_answer
from cablestudy.study.study_rows import checks_of
from cablestudy.study.table import Field

GOVERNING = find("governing")
END = Field("end", "end", label=True)


def ranges(goal, document, columns):
    """The ranges of the key, an end in each row.

    Parameters
    ----------
    goal : Goal
        Of `limit_margin = 0`.
    document : Document
    columns : list of Column
        Shown beside.

    Returns
    -------
    found : Found
    table : Table
    rows : list of Row

    Raises
    ------
    SceneError
        As of `find.solve`.
    NoSolutionError
        No value of the key meets all limits; the message has the nearest, and what is not met there.
    """
    found, statuses, notes = search(goal, document, enclose=True)
    ends = _ends(found, statuses)
    if not ends:
        raise NoSolutionError(_why_none(goal, document, found, statuses))
    key = goal.key.name
    notes += [f"all limits hold {end} {key} = {goal.of_key(value)}: {reason}" for end, value, reason in ends if reason]
    values = [value for _, value, _ in ends]
    found = Found(values, scenes_at(goal, document, values), notes)
    shown = [GOVERNING, *(column for column in columns if column.needs != "limits")]
    table, rows = find_table(goal, found, shown)
    for (end, _, reason), cells in zip(ends, table.rows, strict=True):
        cells |= {END.name: end} | ({GOVERNING.header: None} if reason else {})
    return found, replace(table, fields=(END, *table.fields)), rows


def _ends(found, statuses):
    """The two ends of each range, rising: from or to, value of the key, and why it ends there though all limits hold.

    Ranges are runs of values with margins that are not negative, between zeros and jumps of the least margin, values
    without an answer, and the ends of what was searched. The reason is empty where some limit does not hold beyond.
    """
    limits = {*found.places, *found.jumps}
    margins = {value: nan for value, status in statuses.items() if not has_answer(status)}
    margins |= dict(zip(*(known.tolist() for known in found.known), strict=True)) | dict.fromkeys(limits, 0.0)
    places, ends = sorted(margins), []

    def end(word, place, beyond):
        known = 0 <= beyond < len(places)
        reason = f"beyond, {statuses.get(places[beyond])}" if known else "the end of what was searched"
        return word, places[place], "" if places[place] in limits else reason

    for holds, run in groupby(range(len(places)), lambda place: margins[places[place]] >= 0):
        first, *_, last = [*run] * 2
        if holds and any(margins[places[place]] > 0 for place in range(first, last + 1)):
            ends += [end("from", first, first - 1), end("to", last, last + 1)]
    return ends


def _why_none(goal, document, found, statuses):
    """Why there is no range: what is not met where the least margin is largest, or why there is no answer."""
    where = f"no value of {goal.key.name} from {goal.of_key(found.low, found.high)}"
    places, margins = found.known
    if not len(places):
        reason = next((status for status in statuses.values() if not has_answer(status)), "no limit has a value")
        return f"{where} has an answer: {reason}"
    best = float(places[margins.argmax()])
    (checks,) = checks_of(scenes_at(goal, document, [best]))
    broken = ", ".join(check.governing for check in checks if check.status == NOT_MET)
    nearest = f"nearest is {goal.of_key(best)}, with a least margin of {100 * margins.max():.3g} %"
    elsewhere = "" if goal.between else f"; {goal.elsewhere}"
    return f"{where} meets all limits: {nearest}; not met there: {broken}{elsewhere}"
