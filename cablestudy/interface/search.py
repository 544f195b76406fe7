"""Command find on a scene, which may lack the key that is solved for: an `Answer`."""

from cablestudy.interface.answer import Answer
from cablestudy.interface.kinds import Between, Columns, Goal, Text


def find(scene, goal: Goal, by: Text, between: Between | None = None, columns: Columns | None = None):
    """The values of a key of a `Scene`; see `Scene.find`."""
    return find_value(scene.document, goal, by, between, columns)


def find_value(document, goal, by, between=None, columns=None):
    """The values of a key for which a column takes a value.

    Parameters
    ----------
    document : Document
    goal, by, between, columns : str
        See `Scene.find`.
    """
    from cablestudy.study import find, find_limits
    from cablestudy.study.goal import LIMITS, read_find, read_goal
    from cablestudy.study.scene_kind import kind_of

    asked = read_goal(*read_find(goal, by, between), document)
    shown = find.shown_columns(asked, document, columns)
    if goal.strip() == LIMITS:
        found, table, rows = find_limits.ranges(asked, document, shown)
        several = ()
    else:
        found = find.solve(asked, document)
        table, rows = find.find_table(asked, found, shown)
        several = (f"{len(found.values)} values of {by}",) if len(found.values) > 1 else ()
    notes = kind_of(found.scenes[0]).notes_on_found(rows[0].case)
    warnings = dict.fromkeys((*found.notes, *(warning for row in rows for warning in row.warnings), *notes))
    return Answer(
        table=table,
        warnings=(*warnings, *several),
        failures=tuple(dict.fromkeys(row.cells["status"] for row in rows if row.failed)),
    )
