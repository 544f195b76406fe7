"""The command show."""

import click

from cablestudy.cli.error_handling import echo_notes
from cablestudy.cli.options import SELECTION, exclude, selection_options, study_command
from cablestudy.cli.tables import show as print_table
from cablestudy.errors import SceneError


@study_command
@selection_options
def show(study, sets, vary, out, style, plot, quiet, sensitivity, **selection):
    """Show what is stored of a study, and compute nothing: its rows as a sweep keeps them, else its CSV.

    Of a sweep that was interrupted, the rows that are done.
    """
    exclude(click.get_current_context().params, ((("--sensitivity",), SELECTION),))
    from cablestudy.interface.study import Study

    asked = Study(study, sets, vary)
    with asked.stored(out) as stored:
        select = asked.selection(style.columns, sensitivity, **selection)
        if asked.asked:
            names, near = ", ".join(asked.asked), asked.varied_alike
            hint = f"did you mean {' or '.join(near)}? else " if near else ""
            raise SceneError(
                f"{stored.path}: no column {names}: {hint}'cablestudy sweep' with these options computes it"
            )
        if sensitivity and not stored.complete:
            raise SceneError(*stored.notes, "--sensitivity needs all rows")
        number = len(stored.table.rows)
        echo_notes([*stored.notes, f"{stored.path}: {number} row{'s' * (number != 1)}"], quiet)
        table, notes = select(stored.table) if select else (stored.table, [])
        if plot:
            left_out = asked.save_figure(plot, table, sensitivity, style.columns)
            echo_notes([f"written: {plot}", *left_out], quiet)
        echo_notes(notes, quiet)
        print_table(table, style)
    return 0
