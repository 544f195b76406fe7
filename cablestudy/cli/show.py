"""The command show."""

import click

from cablestudy.cli.error_handling import echo_notes
from cablestudy.cli.options import SELECTION, exclude, save_plot, selection_options, study_command
from cablestudy.cli.sweep import selection_of, words_of
from cablestudy.cli.tables import show as print_table
from cablestudy.errors import SceneError


@study_command
@selection_options
def show(study, sets, vary, out, style, plot, quiet, sensitivity, **selection):
    """Show what is stored of a study, and compute nothing: its rows as a sweep keeps them, else its CSV.

    Of a sweep that was interrupted, the rows that are done.
    """
    exclude(click.get_current_context().params, ((("--sensitivity",), SELECTION),))
    from cablestudy.scene.study import read_study
    from cablestudy.scene.words import counted
    from cablestudy.study.table import TableFiles
    from cablestudy.sweeps.run import command
    from cablestudy.sweeps.stored import stored_table

    requested = read_study(study, sets, vary)
    again = command(words_of(study, sets, vary), *(() if out == "results" else ("--out", out)))
    with stored_table(requested, TableFiles(out, requested.name), again) as stored:
        select = selection_of(requested, style, sensitivity, **selection)
        if requested.asked:
            names = ", ".join(requested.asked)
            raise SceneError(f"{stored.path}: no column {names}: 'cablestudy sweep' with these options computes it")
        if sensitivity and not stored.complete:
            raise SceneError(*stored.notes, "--sensitivity needs all rows")
        echo_notes([*stored.notes, f"{stored.path}: {counted(len(stored.table.rows), 'row')}"], quiet)
        save_plot(plot, lambda plots: plots.study_plot(requested, stored.table))
        table, notes = select(stored.table) if select else (stored.table, [])
        echo_notes(notes, quiet)
        print_table(table, style)
    return 0
