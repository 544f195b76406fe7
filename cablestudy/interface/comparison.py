"""Command trade: error against time of the models of one cable or of a suspension, as an `Answer`."""

import shlex

from cablestudy.interface.answer import Answer
from cablestudy.interface.kinds import Columns, File, Runs


def compare_models(
    scene,
    columns: Columns | None = None,
    repeats: Runs = 5,
    out: File | None = None,
    shown: bool = False,
):
    """`out`: a folder for its tables."""
    from cablestudy.study import trade
    from cablestudy.study.table import TableFiles

    compared, notes = trade.columns_to_compare(scene.document, scene.model, columns)
    place = None if out is None else TableFiles(out, trade.file_name(scene.path))
    if place:
        place.check_writable()
    found = trade.compare(scene.model, compared, repeats)
    title = shlex.join([scene.path, *(word for change in scene.changes for word in ("--set", change))])
    if place:
        trade.write(found, place, title)
        notes = [*notes, f"written: {place.csv}, {place.md}"]
    return Answer(
        table=trade.table_of(found, shown=shown),
        explain=lambda: tuple(trade.notes_of(found)),
        warnings=(*notes, *found.reference.warnings),
        failures=tuple(f"{name}: {reason}" for name, reason in found.reference.failures.items()),
        draw=lambda plots: plots.trade_plot(found, f"Error against time: {title}"),
    )
